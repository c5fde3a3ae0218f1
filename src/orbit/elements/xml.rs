//! Orbit mean-elements messages in XML (CCSDS 505.0-B), as CelesTrak and Space-Track write them.
//!
//! Of each `omm` element the innermost elements are the keys of the KVN form: `<EPOCH>...</EPOCH>`. Namespaces, comments
//! and user-defined parameters are passed over.

use quick_xml::events::Event;
use quick_xml::reader::Reader;
use serde_json::{Map, Value};

use super::ElementsFile;
use super::set::Problem;
use crate::orbit::omm::add_set;

/// Every message of the text.
pub(super) fn parse(text: &str) -> Result<ElementsFile, Problem> {
    let mut reader = Reader::from_str(text);
    let mut file = ElementsFile::default();
    // Line of the message and its keys; the name and the text of the innermost element.
    let mut message: Option<(usize, Map<String, Value>)> = None;
    let mut key = String::new();
    let mut value = String::new();
    let (mut counted, mut line) = (0, 1);
    loop {
        let at = usize::try_from(reader.buffer_position()).unwrap_or(0).min(text.len());
        line += text.as_bytes()[counted.min(at)..at].iter().filter(|b| **b == b'\n').count();
        counted = at;
        let broken = |e: &dyn std::fmt::Display| (Some(line), format!("damaged XML: {e}"));
        match reader.read_event().map_err(|e| broken(&e))? {
            Event::Start(e) => {
                key = local(e.local_name().as_ref());
                value.clear();
                if key == "OMM" {
                    message = Some((line, Map::new()));
                } else if key == "HTML" {
                    return Err((Some(line), "this is a page in HTML; `fetch elements` gets elements".to_owned()));
                }
            }
            Event::Text(e) => value.push_str(&e.xml10_content()),
            Event::CData(e) => value.push_str(&e.xml10_content()),
            Event::GeneralRef(e) => value.push_str(match e.xml10_content().as_ref() {
                "amp" => "&",
                "lt" => "<",
                "gt" => ">",
                "quot" => "\"",
                "apos" => "'",
                _ => "?",
            }),
            Event::End(e) => {
                let name = local(e.local_name().as_ref());
                if name == "OMM" {
                    if let Some((first, keys)) = message.take() {
                        add_set(&mut file, keys, "OMM XML", Some(first), "");
                    }
                } else if name == key
                    && let Some((_, keys)) = &mut message
                {
                    // once only: a second EPOCH would be another orbit
                    if keys.insert(name.clone(), Value::String(value.trim().to_owned())).is_some()
                        && name != "COMMENT"
                        && name != "USER_DEFINED"
                    {
                        return Err((Some(line), format!("{name} stands twice in one message")));
                    }
                }
                key.clear();
            }
            Event::Eof => break,
            _ => {}
        }
    }
    if let Some((first, _)) = message {
        return Err((Some(first), "the message that begins here does not end: the file was cut".to_owned()));
    }
    if file.sets.is_empty() && file.damaged.is_empty() {
        return Err((None, "XML without an orbit mean-elements message; fetch FORMAT=xml or FORMAT=json".to_owned()));
    }
    Ok(file)
}

fn local(name: &str) -> String {
    name.to_ascii_uppercase()
}
