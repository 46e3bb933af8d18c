//! The element format of an accessor, and the accessor's identity for messages. Reading its bytes is in
//! `accessor`.

pub(crate) use gltf::json::accessor::{BYTE, FLOAT, SHORT, UNSIGNED_BYTE, UNSIGNED_INT, UNSIGNED_SHORT};

use super::document::{Accessor, Document, element, shortened};
use super::error::LoadProblem;

/// The format of an element: a vector, or a matrix of `columns` columns, each of which starts at a multiple
/// of four bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Format {
    pub component: u32,
    /// Components of the vector, or of one column.
    pub components: usize,
    pub columns: usize,
}

impl Format {
    pub(crate) fn component_size(self) -> usize {
        match self.component {
            BYTE | UNSIGNED_BYTE => 1,
            SHORT | UNSIGNED_SHORT => 2,
            _ => 4,
        }
    }

    /// Bytes from one column to the next.
    fn column_size(self) -> usize {
        let size = self.component_size() * self.components;
        if self.columns > 1 { size.next_multiple_of(4) } else { size }
    }

    pub(crate) fn size(self) -> usize {
        self.column_size() * self.columns
    }

    /// The stored components of an element, without normalization.
    pub(crate) fn raw(self, element: &[u8]) -> impl Iterator<Item = f64> {
        let columns = element.chunks(self.column_size()).take(self.columns);
        let own = self.component_size() * self.components;
        columns
            .flat_map(move |column| column.get(..own).unwrap_or_default().chunks_exact(self.component_size()))
            .map(move |bytes| match self.component {
                UNSIGNED_INT => f64::from(whole(bytes)),
                component => f64::from(number(bytes, component, false)),
            })
    }
}

/// An accessor and its use, for messages.
pub(crate) struct Reader<'a> {
    pub index: usize,
    used_by: &'a str,
}

impl<'a> Reader<'a> {
    /// Looks up the accessor `index`. `shapes` are the types that its use allows, such as `VEC3`.
    pub(crate) fn of<'b>(
        document: &'b Document,
        index: usize,
        used_by: &'a str,
        shapes: &[&str],
    ) -> Result<(Self, &'b Accessor, Format), LoadProblem> {
        let accessor = element(&document.accessors, "accessors", index, || used_by.to_owned())?;
        let reader = Self { index, used_by };
        if !shapes.contains(&accessor.shape.as_str()) {
            let shape = shortened(&accessor.shape);
            return Err(
                reader.error(format!("type is {shape:?}, but this use needs {}", shapes.join(" or ")))
            );
        }
        let (components, columns) = match accessor.shape.as_str() {
            "SCALAR" => (1, 1),
            "VEC2" => (2, 1),
            "VEC3" => (3, 1),
            "MAT2" => (2, 2),
            "MAT3" => (3, 3),
            "MAT4" => (4, 4),
            _ => (4, 1),
        };
        let component = accessor.component_type;
        if !matches!(component, BYTE | UNSIGNED_BYTE | SHORT | UNSIGNED_SHORT | UNSIGNED_INT | FLOAT) {
            return Err(
                reader.error(format!("componentType {component} does not exist in glTF; use 5120 to 5126"))
            );
        }
        Ok((reader, accessor, Format { component, components, columns }))
    }

    pub(crate) fn error(&self, problem: impl Into<String>) -> LoadProblem {
        LoadProblem::Accessor {
            accessor: self.index,
            used_by: self.used_by.to_owned(),
            problem: problem.into(),
        }
    }

    pub(crate) fn used_by(&self) -> &str {
        self.used_by
    }
}

/// A little-endian unsigned integer of one to four bytes.
pub(crate) fn whole(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |value, &byte| value << 8 | u32::from(byte))
}

/// Decodes one component. Normalized integers are converted as in the glTF 2.0 specification, section 3.11.
pub(crate) fn number(bytes: &[u8], component: u32, normalized: bool) -> f32 {
    let raw = whole(bytes);
    let (value, largest) = match component {
        BYTE => (f32::from(raw as u8 as i8), 127.0),
        UNSIGNED_BYTE => (f32::from(raw as u8), 255.0),
        SHORT => (f32::from(raw as u16 as i16), 32767.0),
        UNSIGNED_SHORT => (f32::from(raw as u16), 65535.0),
        _ => return f32::from_bits(raw),
    };
    if normalized { (value / largest).max(-1.0) } else { value }
}
