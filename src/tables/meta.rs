//! The meta block of a table: ordered keys whose values are texts, numbers, maps and lists, written as flow YAML.
//!
//! Writes what every YAML 1.1 reader takes for the same value; reads what it writes, and keeps as plain text what it
//! does not understand. Units belong in the keys. Not supported: block style, anchors and tags.

use std::fmt::Write as _;

/// One value of the meta block.
#[derive(Debug, Clone, PartialEq)]
pub enum MetaValue {
    /// Any text.
    Text(String),
    /// A finite number; the unit is in the key.
    Number(f64),
    /// Named values, in order.
    Map(Vec<(String, MetaValue)>),
    /// Values, in order.
    List(Vec<MetaValue>),
}

impl From<&str> for MetaValue {
    fn from(text: &str) -> Self {
        MetaValue::Text(text.to_owned())
    }
}
impl From<String> for MetaValue {
    fn from(text: String) -> Self {
        MetaValue::Text(text)
    }
}
impl From<f64> for MetaValue {
    fn from(number: f64) -> Self {
        MetaValue::Number(number)
    }
}

/// The meta block of a table, in file order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Meta {
    /// Key and value, in order.
    pub entries: Vec<(String, MetaValue)>,
}

/// What a table says of the band of instrumental magnitudes.
pub const NO_BAND: &str = "none";

impl Meta {
    /// Appends one entry.
    pub fn push(&mut self, key: &str, value: impl Into<MetaValue>) {
        self.entries.push((key.to_owned(), value.into()));
    }

    /// The band of the magnitudes, as the table names it; `None` where they are instrumental.
    #[must_use]
    pub fn band(&self) -> Option<&str> {
        match self.get("band") {
            Some(MetaValue::Text(band)) if band != NO_BAND => Some(band),
            _ => None,
        }
    }

    /// Gives a key another value, in its place; a new key comes last.
    pub fn set(&mut self, key: &str, value: impl Into<MetaValue>) {
        match self.entries.iter_mut().find(|(k, _)| k == key) {
            Some((_, old)) => *old = value.into(),
            None => self.push(key, value),
        }
    }

    /// The first value of this key.
    #[must_use]
    pub fn get(&self, key: &str) -> Option<&MetaValue> {
        self.entries.iter().find(|(k, _)| k == key).map(|(_, v)| v)
    }

    /// The number `field` of the map `key`, e.g. `lat_deg` of `site`.
    #[must_use]
    pub fn number_in(&self, key: &str, field: &str) -> Option<f64> {
        let Some(MetaValue::Map(pairs)) = self.get(key) else { return None };
        pairs.iter().find_map(|(name, value)| match value {
            MetaValue::Number(number) if name == field => Some(*number),
            _ => None,
        })
    }

    /// The first key, dotted, whose number is NaN or infinite.
    #[must_use]
    pub fn non_finite_key(&self) -> Option<String> {
        self.entries.iter().find_map(|(key, value)| non_finite(key, value))
    }

    /// Every value as a text under its dotted key; a list is one text.
    #[must_use]
    pub fn flat(&self) -> Vec<(String, String)> {
        let mut pairs = Vec::new();
        self.entries.iter().for_each(|(key, value)| flatten(key, value, &mut pairs));
        pairs
    }

    /// The lines under `meta: !!omap`, without the leading `# `.
    pub(crate) fn to_lines(&self) -> Vec<String> {
        self.entries.iter().map(|(key, value)| format!("- {{{}: {}}}", scalar(key), flow(value))).collect()
    }

    /// Reads the lines under `meta: !!omap`, without the leading `# `. An entry that cannot be read becomes a text.
    pub(crate) fn from_lines(lines: &[&str]) -> Self {
        let mut texts: Vec<String> = Vec::new();
        for line in lines {
            match (line.strip_prefix("- "), texts.last_mut()) {
                (Some(first), _) => texts.push(first.trim().to_owned()),
                (None, Some(last)) => {
                    last.push(' ');
                    last.push_str(line.trim());
                }
                (None, None) => {}
            }
        }
        let mut entries = Vec::new();
        for text in texts {
            let braced = if text.starts_with('{') { text.clone() } else { format!("{{{text}}}") };
            match Parser::new(&braced).document() {
                Some(MetaValue::Map(pairs)) => entries.extend(pairs),
                _ => {
                    let (key, value) = text.split_once(':').unwrap_or((&text, ""));
                    entries.push((key.trim().to_owned(), MetaValue::Text(value.trim().to_owned())));
                }
            }
        }
        Meta { entries }
    }
}

fn non_finite(key: &str, value: &MetaValue) -> Option<String> {
    match value {
        MetaValue::Text(_) => None,
        MetaValue::Number(number) => (!number.is_finite()).then(|| key.to_owned()),
        MetaValue::Map(pairs) => pairs.iter().find_map(|(k, v)| non_finite(&format!("{key}.{k}"), v)),
        MetaValue::List(items) => items.iter().enumerate().find_map(|(i, v)| non_finite(&format!("{key}[{i}]"), v)),
    }
}

fn flatten(key: &str, value: &MetaValue, pairs: &mut Vec<(String, String)>) {
    match value {
        MetaValue::Text(text) => pairs.push((key.to_owned(), text.clone())),
        MetaValue::Map(inner) => inner.iter().for_each(|(k, v)| flatten(&format!("{key}.{k}"), v, pairs)),
        MetaValue::Number(_) | MetaValue::List(_) => pairs.push((key.to_owned(), flow(value))),
    }
}

/// One value in flow style.
fn flow(value: &MetaValue) -> String {
    match value {
        MetaValue::Text(text) => scalar(text),
        MetaValue::Number(number) => yaml_number(*number),
        MetaValue::Map(pairs) => {
            let inner: Vec<String> = pairs.iter().map(|(k, v)| format!("{}: {}", scalar(k), flow(v))).collect();
            format!("{{{}}}", inner.join(", "))
        }
        MetaValue::List(items) => format!("[{}]", items.iter().map(flow).collect::<Vec<_>>().join(", ")),
    }
}

/// The shortest text that reads back to the same number. YAML 1.1 wants `1.0e-07` where Rust writes `1e-7`.
fn yaml_number(number: f64) -> String {
    if number.fract() == 0.0 && number.abs() < 1e15 {
        return format!("{number:.0}");
    }
    let text = format!("{number:?}");
    let Some((mantissa, exponent)) = text.split_once('e') else { return text };
    let point = if mantissa.contains('.') { "" } else { ".0" };
    let sign = if exponent.starts_with('-') { "" } else { "+" };
    format!("{mantissa}{point}e{sign}{exponent}")
}

/// Text as a plain scalar where no YAML reader can take it for anything else, otherwise in double quotes.
pub(crate) fn scalar(text: &str) -> String {
    const RESERVED: [&str; 9] = ["true", "false", "yes", "no", "on", "off", "null", "y", "n"];
    let plain = text.starts_with(|c: char| c.is_ascii_alphabetic())
        && text.chars().all(|c| c.is_ascii_alphanumeric() || " _-./+()%".contains(c))
        && !text.ends_with(' ')
        && !RESERVED.contains(&text.to_ascii_lowercase().as_str());
    if plain {
        return text.to_owned();
    }
    let mut quoted = String::from("\"");
    for c in text.chars() {
        match c {
            '"' => quoted.push_str("\\\""),
            '\\' => quoted.push_str("\\\\"),
            '\n' => quoted.push_str("\\n"),
            '\t' => quoted.push_str("\\t"),
            c if c.is_control() || ('\u{2028}'..='\u{2029}').contains(&c) || c == '\u{feff}' => {
                // Writing to a String cannot fail.
                let _ = write!(quoted, "\\u{:04x}", u32::from(c));
            }
            c => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}

/// A reader of one flow value; `None` where the text is not what [`flow`] or astropy would write.
struct Parser {
    chars: Vec<char>,
    at: usize,
}

impl Parser {
    fn new(text: &str) -> Self {
        Self { chars: text.chars().collect(), at: 0 }
    }

    fn document(&mut self) -> Option<MetaValue> {
        let value = self.value(0)?;
        self.blanks();
        (self.at == self.chars.len()).then_some(value)
    }

    fn peek(&self) -> Option<char> {
        self.chars.get(self.at).copied()
    }

    fn blanks(&mut self) {
        while self.peek() == Some(' ') {
            self.at += 1;
        }
    }

    /// Steps over `c` after blanks, or stays.
    fn take(&mut self, c: char) -> bool {
        self.blanks();
        let found = self.peek() == Some(c);
        self.at += usize::from(found);
        found
    }

    fn value(&mut self, depth: usize) -> Option<MetaValue> {
        if depth > 32 {
            return None; // a foreign file must not exhaust the stack
        }
        if self.take('{') {
            let mut pairs = Vec::new();
            while !self.take('}') {
                let key = self.text()?.0;
                if !self.take(':') {
                    return None;
                }
                pairs.push((key, self.value(depth + 1)?));
                self.separator('}')?;
            }
            return Some(MetaValue::Map(pairs));
        }
        if self.take('[') {
            let mut items = Vec::new();
            while !self.take(']') {
                items.push(self.value(depth + 1)?);
                self.separator(']')?;
            }
            return Some(MetaValue::List(items));
        }
        let (text, quoted) = self.text()?;
        // As in YAML 1.1, an exponent needs a point: `9e52` is a text (the start of a hash), `9.0e+52` a number.
        let numeric = !quoted
            && text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c))
            && (text.contains('.') || !text.contains(['e', 'E']));
        match text.parse::<f64>() {
            Ok(number) if numeric && number.is_finite() => Some(MetaValue::Number(number)),
            _ => Some(MetaValue::Text(text)),
        }
    }

    /// A comma, or the closing bracket (which stays).
    fn separator(&mut self, close: char) -> Option<()> {
        if self.take(',') {
            return Some(());
        }
        self.blanks();
        (self.peek() == Some(close)).then_some(())
    }

    /// A scalar and whether it was quoted.
    fn text(&mut self) -> Option<(String, bool)> {
        self.blanks();
        match self.peek()? {
            '"' => self.double_quoted().map(|t| (t, true)),
            '\'' => self.single_quoted().map(|t| (t, true)),
            _ => {
                let start = self.at;
                while let Some(c) = self.peek() {
                    let next = self.chars.get(self.at + 1).copied();
                    let ends_key = c == ':' && matches!(next, None | Some(' ' | ',' | '}' | ']'));
                    if ",]}{[".contains(c) || ends_key {
                        break;
                    }
                    self.at += 1;
                }
                Some((self.chars[start..self.at].iter().collect::<String>().trim().to_owned(), false))
            }
        }
    }

    fn double_quoted(&mut self) -> Option<String> {
        self.at += 1;
        let mut text = String::new();
        loop {
            let c = self.peek()?;
            self.at += 1;
            match c {
                '"' => return Some(text),
                '\\' => {
                    let escape = self.peek()?;
                    self.at += 1;
                    match escape {
                        'n' => text.push('\n'),
                        't' => text.push('\t'),
                        'x' => text.push(self.hex(2)?),
                        'u' => text.push(self.hex(4)?),
                        other => text.push(other),
                    }
                }
                c => text.push(c),
            }
        }
    }

    fn single_quoted(&mut self) -> Option<String> {
        self.at += 1;
        let mut text = String::new();
        loop {
            let c = self.peek()?;
            self.at += 1;
            if c != '\'' {
                text.push(c);
            } else if self.peek() == Some('\'') {
                self.at += 1;
                text.push('\'');
            } else {
                return Some(text);
            }
        }
    }

    fn hex(&mut self, digits: usize) -> Option<char> {
        let text: String = self.chars.get(self.at..self.at + digits)?.iter().collect();
        self.at += digits;
        u32::from_str_radix(&text, 16).ok().and_then(char::from_u32)
    }
}
