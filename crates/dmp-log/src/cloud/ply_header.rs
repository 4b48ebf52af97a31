use crate::decimal::shorten;
use crate::{ParseError, Place};
use std::io::{self, BufRead, Read};

/// Longest line of a header, and of a vertex in text.
pub(crate) const MAX_LINE_BYTES: u64 = 64 * 1024;
const MAX_HEADER_LINES: u64 = 10_000;

/// The order of a file's bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// A coordinate: its column, its first byte, and whether it is a double.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Coordinate {
    pub(crate) column: usize,
    pub(crate) offset: usize,
    pub(crate) double: bool,
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
    pub(crate) xyz: [Coordinate; 3],
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

struct Element {
    properties: Vec<PlyProperty>,
    name: String,
    rows: u64,
    bytes: u64,
    columns: usize,
    list: Option<String>,
    xyz: [Option<Coordinate>; 3],
    line: u64,
}

/// One line, without its end, of at most [`MAX_LINE_BYTES`]; `None` at the end of the file.
pub(crate) fn read_line(input: &mut impl BufRead, line: &mut Vec<u8>) -> io::Result<Option<u64>> {
    line.clear();
    let count = input.by_ref().take(MAX_LINE_BYTES).read_until(b'\n', line)? as u64;
    if count == 0 {
        return Ok(None);
    }
    if count == MAX_LINE_BYTES && line.last() != Some(&b'\n') {
        return Err(io::Error::new(
            io::ErrorKind::InvalidData,
            format!("a line longer than {MAX_LINE_BYTES} bytes"),
        ));
    }
    while line.last().is_some_and(u8::is_ascii_whitespace) {
        line.pop();
    }
    Ok(Some(count))
}

/// Reads the header up to and including its `end_header` line.
pub(crate) fn read_header(input: &mut impl BufRead) -> Result<PlyHeader, ParseError> {
    let (mut number, mut bytes, mut line) = (0, 0, Vec::new());
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    loop {
        number += 1;
        let place = Place::Line(number);
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
                elements.push(Element {
                    name,
                    rows,
                    bytes: 0,
                    columns: 0,
                    properties: Vec::new(),
                    list: None,
                    xyz: [None; 3],
                    line: number,
                });
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
        encoding.ok_or_else(|| ParseError::new(Place::Line(number), "no format line in the header"))?;
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
            let bytes = match *kind {
                "char" | "uchar" | "int8" | "uint8" => 1,
                "short" | "ushort" | "int16" | "uint16" => 2,
                "int" | "uint" | "float" | "int32" | "uint32" | "float32" => 4,
                "double" | "float64" => 8,
                other => {
                    return Err(format!(
                        "property `{}` has the unknown type `{}`",
                        shorten(name),
                        shorten(other)
                    ));
                }
            };
            let axis = match *name {
                "x" => element.xyz.get_mut(0),
                "y" => element.xyz.get_mut(1),
                "z" => element.xyz.get_mut(2),
                _ => None,
            };
            if let Some(axis) = axis {
                let double = matches!(*kind, "double" | "float64");
                if !double && !matches!(*kind, "float" | "float32") {
                    return Err(format!("property `{name}` is {kind}, not float or double"));
                }
                *axis = Some(Coordinate { column: element.columns, offset: element.bytes as usize, double });
            }
            element.properties.push(PlyProperty::Scalar { bytes });
            element.bytes += bytes;
            element.columns += 1;
            Ok(())
        }
        _ => Err(format!("not a property: `{}`", shorten(&definition.join(" ")))),
    }
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
        let wrong = |problem: String| ParseError::new(Place::Line(element.line), problem);
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
            after: after.collect(),
        });
    }
    Err(ParseError::new(Place::Line(lines), "no element `vertex` in the header"))
}
