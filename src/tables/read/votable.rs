//! VOTables: the first table of the file, its fields and its rows, read as a stream.
//!
//! TABLEDATA row by row; BINARY and BINARY2 decoded as a whole. Not supported: FITS inside a VOTable, rows in another file, tables
//! after the first.

use std::collections::HashMap;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use quick_xml::XmlVersion;
use quick_xml::events::{BytesStart, Event};
use quick_xml::reader::Reader;

use super::binary::{Binary, Kind};
use super::{Column, Row, Rows, Table, bad, most_columns};
use crate::base::error::{Error, Result};
use crate::tables::schema::Datatype;

/// The rows of a VOTable.
#[derive(Debug)]
pub struct XmlRows {
    xml: Xml,
    binary: Option<Binary>,
    /// Whether the rows are at an end.
    done: bool,
    number: usize,
}

/// The stream of tags.
#[derive(Debug)]
struct Xml {
    reader: Reader<BufReader<File>>,
    buffer: Vec<u8>,
}

/// What the reader of a VOTable looks at.
enum Item {
    Start(String, Vec<(String, String)>),
    End(String),
    Text(String),
    Other,
    Eof,
}

impl Xml {
    fn next(&mut self, path: &Path) -> Result<Item> {
        self.buffer.clear();
        let at = self.reader.buffer_position();
        let broken = |e: &dyn std::fmt::Display| bad(path, None, format!("damaged VOTable at byte {at}: {e}"));
        let tag = |e: &BytesStart| -> std::result::Result<Item, String> {
            let mut attributes = Vec::new();
            // a search for repeated names would take the square of their number
            for attribute in e.attributes().with_checks(false).flatten() {
                let key = local(attribute.key.as_ref());
                let value = attribute.normalized_value(XmlVersion::Implicit1_0).map_err(|e| e.to_string())?;
                attributes.push((key, value.into_owned()));
            }
            Ok(Item::Start(local(e.name().as_ref()), attributes))
        };
        match self.reader.read_event_into(&mut self.buffer) {
            Err(e) => Err(broken(&e)),
            Ok(Event::Start(e)) => tag(&e).map_err(|e| broken(&e)),
            Ok(Event::End(e)) => Ok(Item::End(local(e.name().as_ref()))),
            Ok(Event::Text(e)) => Ok(Item::Text(e.xml10_content().into_owned())),
            Ok(Event::CData(e)) => Ok(Item::Text(e.xml10_content().into_owned())),
            Ok(Event::GeneralRef(e)) => Ok(Item::Text(match e.resolve_char_ref() {
                Ok(Some(letter)) => letter.to_string(),
                _ => match e.xml10_content().as_ref() {
                    "lt" => "<".to_owned(),
                    "gt" => ">".to_owned(),
                    "amp" => "&".to_owned(),
                    "quot" => "\"".to_owned(),
                    "apos" => "'".to_owned(),
                    other => return Err(broken(&format!("unknown entity &{other};"))),
                },
            })),
            Ok(Event::Eof) => Ok(Item::Eof),
            Ok(_) => Ok(Item::Other),
        }
    }

    /// The text up to the end of the element `name`.
    fn text(&mut self, path: &Path, name: &str) -> Result<String> {
        let mut text = String::new();
        loop {
            match self.next(path)? {
                Item::Text(part) => text.push_str(&part),
                Item::End(end) if end == name => return Ok(text),
                Item::Eof => return Err(cut(path)),
                _ => {}
            }
        }
    }
}

/// A name without its namespace.
fn local(name: &str) -> String {
    name.rsplit(':').next().unwrap_or(name).to_owned()
}

fn cut(path: &Path) -> Error {
    bad(path, None, "the VOTable ends in the middle: fetch it again")
}

/// Opens a VOTable and reads up to its first row.
pub fn open(path: &Path, reader: BufReader<File>) -> Result<Table> {
    let mut reader = Reader::from_reader(reader);
    // so that <TD/> is an empty cell like <TD></TD>
    reader.config_mut().expand_empty_elements = true;
    let mut xml = Xml { reader, buffer: Vec::new() };
    let mut systems: HashMap<String, String> = HashMap::new();
    let mut columns: Vec<Column> = Vec::new();
    let mut kinds: Vec<Kind> = Vec::new();
    let (mut notes, mut status) = (Vec::new(), String::new());
    let (mut is_votable, mut in_table) = (false, false);
    let binary = loop {
        let (name, attributes) = match xml.next(path)? {
            Item::Start(name, attributes) => (name, attributes),
            Item::End(name) if name == "TABLE" && !columns.is_empty() => break None,
            Item::Eof if is_votable && in_table => return Err(cut(path)),
            Item::Eof if is_votable => return Err(bad(path, None, format!("a VOTable without a table{status}"))),
            Item::Eof => return Err(bad(path, None, "is XML, but no VOTable")),
            _ => continue,
        };
        let get = |key: &str| attributes.iter().find(|(k, _)| k == key).map_or("", |(_, v)| v.as_str());
        match name.as_str() {
            "VOTABLE" => is_votable = true,
            "COOSYS" => {
                let system = format!("{} {}", get("system"), get("equinox"));
                systems.entry(get("ID").to_owned()).or_insert(system);
            }
            "INFO" if get("name") == "QUERY_STATUS" => {
                let value = get("value").to_owned();
                let said = xml.text(path, "INFO")?;
                match value.as_str() {
                    "OVERFLOW" => notes.push("was cut by the server at its limit of rows (OVERFLOW)".to_owned()),
                    "ERROR" => status = format!("; the server said: {}", said.trim()),
                    _ => {}
                }
            }
            "TABLE" => in_table = true,
            "FIELD" if in_table => {
                most_columns(columns.len() + 1).map_err(|problem| bad(path, None, problem))?;
                let system = Some(get("ref")).filter(|id| !id.is_empty()).and_then(|id| systems.get(id));
                let given = if get("name").is_empty() { get("ID") } else { get("name") };
                columns.push(Column {
                    unit: get("unit").to_owned(),
                    ucd: get("ucd").to_owned(),
                    system: system.map(|s| s.trim().to_owned()).unwrap_or_default(),
                    datatype: Datatype::of_ecsv(get("datatype")),
                    ..Column::named(given)
                });
                kinds.push(Kind::of(get("datatype"), get("arraysize")));
            }
            "VALUES" => {
                if let Some(column) = columns.last_mut().filter(|_| !get("null").is_empty()) {
                    column.null = Some(get("null").to_owned());
                }
            }
            "TABLEDATA" => break None,
            "BINARY" | "BINARY2" => break Some(Binary::new(stream(path, &mut xml)?, kinds, name == "BINARY2")),
            "FITS" => return Err(bad(path, None, "a VOTable with FITS inside; save it with TABLEDATA")),
            _ => {}
        }
    };
    let rows = XmlRows { xml, binary, done: false, number: 0 };
    Ok(Table { path: path.to_owned(), columns, notes, rows: Rows::Xml(Box::new(rows)) })
}

/// The bytes of a STREAM element.
fn stream(path: &Path, xml: &mut Xml) -> Result<Vec<u8>> {
    use base64::Engine as _;
    loop {
        match xml.next(path)? {
            Item::Start(name, attributes) if name == "STREAM" => {
                let get = |key: &str| attributes.iter().find(|(k, _)| k == key).map_or("", |(_, v)| v.as_str());
                if !get("href").is_empty() {
                    return Err(bad(path, None, format!("its rows are in {}; save it with TABLEDATA", get("href"))));
                }
                if get("encoding") != "base64" {
                    let problem = format!("rows encoded as `{}`; save it with TABLEDATA", get("encoding"));
                    return Err(bad(path, None, problem));
                }
                let mut text = xml.text(path, "STREAM")?.into_bytes();
                text.retain(|b| !b.is_ascii_whitespace());
                return base64::engine::general_purpose::STANDARD
                    .decode(text)
                    .map_err(|e| bad(path, None, format!("its rows are not base64: {e}")));
            }
            Item::Eof => return Err(cut(path)),
            _ => {}
        }
    }
}

impl XmlRows {
    /// Reads the cells of the next row.
    pub fn read(&mut self, path: &Path, row: &mut Row) -> Result<bool> {
        if self.done {
            return Ok(false);
        }
        let more = match &mut self.binary {
            Some(binary) => binary.read(&mut row.cells).map_err(|problem| bad(path, None, problem))?,
            None => self.row(path, row)?,
        };
        self.done = !more;
        self.number += 1;
        row.line = self.number;
        Ok(more)
    }

    /// One TR element.
    fn row(&mut self, path: &Path, row: &mut Row) -> Result<bool> {
        loop {
            match self.xml.next(path)? {
                Item::Start(name, _) if name == "TD" => {
                    let cell = self.xml.text(path, "TD")?;
                    row.cells.push_field(cell.trim());
                }
                Item::End(name) if name == "TR" => return Ok(true),
                Item::End(name) if matches!(name.as_str(), "TABLEDATA" | "TABLE" | "VOTABLE") => return Ok(false),
                Item::Eof if self.number == 0 => return Ok(false),
                Item::Eof => return Err(cut(path)),
                _ => {}
            }
        }
    }
}
