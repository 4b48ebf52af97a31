//! The header of a PLY file: its elements, their properties, and where the vertices begin.

use crate::file::{read_line, shorten};
use crate::points::{Field, NumberType};
use crate::{ParseError, PlaceInFile};
use std::io::BufRead;

const MAX_HEADER_LINES: u64 = 10_000;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// What the header says of the vertices, and what comes after them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct PlyHeader {
    pub(crate) encoding: Encoding,
    /// Lines in front of the first element's data.
    pub(crate) lines: u64,
    /// Bytes in front of the first element's data.
    pub(crate) bytes: u64,
    /// Elements in front of the vertices: how many rows, and how many bytes each (0 in text).
    pub(crate) before: Vec<(u64, u64)>,
    pub(crate) vertices: u64,
    pub(crate) vertex_bytes: usize,
    pub(crate) xyz: [(usize, Field); 3],
    /// Every property of a vertex, in order: its name, and its place in binary rows.
    pub(crate) named: Vec<(String, Field)>,
    /// Elements behind the vertices.
    pub(crate) after: Vec<PlyElement>,
}

/// An element: so many rows of the same properties.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct PlyElement {
    pub(crate) name: String,
    pub(crate) rows: u64,
    pub(crate) properties: Vec<PlyProperty>,
}

/// A property of a row; types by the names in the header.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum PlyProperty {
    /// A number of so many bytes.
    Scalar { bytes: u64 },
    /// A count of one type, then so many numbers of the other.
    List { name: String, count: String, item: String },
}

#[derive(Default)]
struct Element {
    properties: Vec<PlyProperty>,
    name: String,
    rows: u64,
    bytes: u64,
    named: Vec<(String, Field)>,
    list: Option<String>,
    xyz: [Option<(usize, Field)>; 3],
    line: u64,
}

/// Reads the header up to and including its `end_header` line.
pub(crate) fn read_header(input: &mut impl BufRead) -> Result<PlyHeader, ParseError> {
    let (mut number, mut bytes, mut line) = (0, 0, Vec::new());
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    loop {
        number += 1;
        let place = PlaceInFile::Line(number);
        let wrong = |problem: String| ParseError::new(place, problem);
        match read_line(input, &mut line).map_err(|e| wrong(e.to_string()))? {
            None => return Err(wrong("the file ends in the header".into())),
            Some(_) if number > MAX_HEADER_LINES => return Err(wrong("the header does not end".into())),
            Some(count) => bytes += count,
        }
        let text = std::str::from_utf8(&line).map_err(|_| wrong("not text in the header".into()))?;
        let words: Vec<&str> = text.split_ascii_whitespace().collect();
        match words.as_slice() {
            ["ply"] if number == 1 => {}
            ["comment" | "obj_info", ..] | [] => {}
            ["format", name, "1.0"] => {
                encoding = Some(match *name {
                    "ascii" => Encoding::Ascii,
                    "binary_little_endian" => Encoding::LittleEndian,
                    "binary_big_endian" => Encoding::BigEndian,
                    other => return Err(wrong(format!("unknown format `{}`", shorten(other)))),
                });
            }
            ["element", name, rows] => {
                let rows =
                    rows.parse().map_err(|_| wrong(format!("`{}` is no count of rows", shorten(rows))))?;
                let name = (*name).to_owned();
                elements.push(Element { name, rows, line: number, ..Element::default() });
            }
            ["property", definition @ ..] => {
                let Some(element) = elements.last_mut() else {
                    return Err(wrong("a property in front of any element".into()));
                };
                add_property(element, definition).map_err(wrong)?;
            }
            ["end_header"] => break,
            _ => return Err(wrong(format!("not a line of a PLY header: `{}`", shorten(text)))),
        }
    }
    let encoding =
        encoding.ok_or_else(|| ParseError::new(PlaceInFile::Line(number), "no format line in the header"))?;
    assemble(encoding, number, bytes, elements)
}

fn add_property(element: &mut Element, definition: &[&str]) -> Result<(), String> {
    match definition {
        ["list", count, item, name] => {
            element.properties.push(PlyProperty::List {
                name: (*name).to_owned(),
                count: (*count).to_owned(),
                item: (*item).to_owned(),
            });
            element.list.get_or_insert((*name).to_owned());
            Ok(())
        }
        [kind, name] => {
            let Some(number) = kind_of(kind) else {
                let (name, kind) = (shorten(name), shorten(kind));
                return Err(format!("property `{name}` has the unknown type `{kind}`"));
            };
            let axis = match *name {
                "x" => element.xyz.get_mut(0),
                "y" => element.xyz.get_mut(1),
                "z" => element.xyz.get_mut(2),
                _ => None,
            };
            if let Some(axis) = axis {
                if !number.is_float() {
                    return Err(format!("property `{name}` is {kind}, not float or double"));
                }
                *axis = Some((element.named.len(), Field { offset: element.bytes as usize, kind: number }));
            }
            let bytes = u64::from(number.bytes());
            element.properties.push(PlyProperty::Scalar { bytes });
            element.named.push(((*name).to_owned(), Field { offset: element.bytes as usize, kind: number }));
            element.bytes += bytes;
            Ok(())
        }
        _ => Err(format!("not a property: `{}`", shorten(&definition.join(" ")))),
    }
}

pub(crate) fn kind_of(name: &str) -> Option<NumberType> {
    Some(match name {
        "char" | "int8" => NumberType::I8,
        "uchar" | "uint8" => NumberType::U8,
        "short" | "int16" => NumberType::I16,
        "ushort" | "uint16" => NumberType::U16,
        "int" | "int32" => NumberType::I32,
        "uint" | "uint32" => NumberType::U32,
        "float" | "float32" => NumberType::F32,
        "double" | "float64" => NumberType::F64,
        _ => return None,
    })
}

fn assemble(
    encoding: Encoding,
    lines: u64,
    bytes: u64,
    elements: Vec<Element>,
) -> Result<PlyHeader, ParseError> {
    let mut before = Vec::new();
    let mut elements = elements.into_iter();
    for element in elements.by_ref() {
        let wrong = |problem: String| ParseError::new(PlaceInFile::Line(element.line), problem);
        let is_vertex = element.name == "vertex";
        if let Some(list) = element.list.as_ref().filter(|_| is_vertex || encoding != Encoding::Ascii) {
            return Err(wrong(format!(
                "element `{}` has the list `{}`: lists are read neither in vertices nor in front of them",
                shorten(&element.name),
                shorten(list)
            )));
        }
        if !is_vertex {
            before.push((element.rows, element.bytes));
            continue;
        }
        let [Some(x), Some(y), Some(z)] = element.xyz else {
            return Err(wrong("the vertices lack x, y or z".into()));
        };
        let after = elements.map(|e| PlyElement { name: e.name, rows: e.rows, properties: e.properties });
        return Ok(PlyHeader {
            encoding,
            lines,
            bytes,
            before,
            vertices: element.rows,
            vertex_bytes: element.bytes as usize,
            xyz: [x, y, z],
            named: element.named,
            after: after.collect(),
        });
    }
    Err(ParseError::new(PlaceInFile::Line(lines), "no element `vertex` in the header"))
}
