//! Numbers out of buffers: accessors, sparse ones and normalized integers included. Not what they are used for.
//!
//! Every offset, stride and count is checked against the bytes that exist before anything is allocated, and what is
//! decoded counts against one limit for the whole file.

use super::compressed_views::DecodedViews;
use super::document::{Accessor, Document, Sparse, element};
use super::error::LoadProblem;
use super::limits::Budget;

const BYTE: u32 = 5120;
const UNSIGNED_BYTE: u32 = 5121;
const SHORT: u32 = 5122;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;

/// The bytes of a file's buffers, with the JSON that divides them.
pub(crate) struct Buffers<'a> {
    pub document: &'a Document,
    pub bytes: Vec<std::borrow::Cow<'a, [u8]>>,
    /// Views that were compressed.
    pub decoded: std::borrow::Cow<'a, DecodedViews>,
}

/// Elements in a buffer view, `count` of them, already known to lie inside it.
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
}

impl<'a> Elements<'a> {
    /// The bytes of one element; empty beyond the last.
    fn get(&self, index: usize, size: usize) -> &'a [u8] {
        let start = index.saturating_mul(self.stride);
        self.bytes.get(start..start.saturating_add(size)).unwrap_or_default()
    }
}

/// What elements look like: vectors, or matrices of `columns` columns, each beginning at a multiple of four bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Format {
    pub component: u32,
    /// Of a vector or a column.
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

    /// Bytes from a column to the next.
    fn column_size(self) -> usize {
        let size = self.component_size() * self.components;
        if self.columns > 1 { size.next_multiple_of(4) } else { size }
    }

    pub(crate) fn size(self) -> usize {
        self.column_size() * self.columns
    }

    /// The components of an element as they stand, without normalization.
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

/// The elements of an accessor as they lie in the file.
pub(crate) struct RawElements<'a> {
    pub format: Format,
    pub count: usize,
    base: Option<Elements<'a>>,
    /// What is said instead of some of them: index and bytes.
    pub sparse: Vec<(u32, &'a [u8])>,
}

impl<'a> RawElements<'a> {
    /// The bytes of an element of the buffer view; nothing where there is none, which means zeros.
    pub(crate) fn base(&self, index: usize) -> Option<&'a [u8]> {
        self.base.as_ref().map(|base| base.get(index, self.format.size()))
    }
}

impl<'a> Buffers<'a> {
    /// The bytes of a buffer view and its stride.
    pub(crate) fn view(
        &self,
        index: usize,
        place: impl FnOnce() -> String,
    ) -> Result<(&[u8], Option<u64>), LoadProblem> {
        let view = element(&self.document.buffer_views, "bufferViews", index, place)?;
        if let Some(decoded) = self.decoded.get(&index) {
            return Ok((decoded, view.byte_stride));
        }
        let buffer = element(&self.bytes, "buffers", view.buffer, || format!("bufferViews[{index}].buffer"))?;
        let end = view.byte_offset.checked_add(view.byte_length);
        let range =
            end.and_then(|end| Some(usize::try_from(view.byte_offset).ok()?..usize::try_from(end).ok()?));
        let bytes = range.and_then(|range| buffer.get(range)).ok_or_else(|| LoadProblem::BufferView {
            view: index,
            offset: view.byte_offset,
            end: end.unwrap_or(u64::MAX),
            buffer: view.buffer,
            length: buffer.len() as u64,
        })?;
        Ok((bytes, view.byte_stride))
    }

    /// `count` elements starting at an offset in a view, or why they are not all inside it.
    fn elements(
        &self,
        view: usize,
        offset: u64,
        count: u64,
        format: &Format,
        strided: bool,
        reader: &Reader<'_>,
    ) -> Result<Elements<'_>, LoadProblem> {
        let (bytes, stride) = self.view(view, || format!("accessors[{}]", reader.index))?;
        let size = format.size() as u64;
        let stride = stride.filter(|_| strided).unwrap_or(size);
        if stride < size {
            return Err(
                reader.error(format!("byteStride {stride} is less than the {size} bytes of an element"))
            );
        }
        let end = count
            .checked_sub(1)
            .map_or(Some(0), |last| last.checked_mul(stride)?.checked_add(size))
            .and_then(|length| offset.checked_add(length));
        let length = bytes.len() as u64;
        if end.is_none_or(|end| end > length) {
            let end = end.map_or_else(|| "more than 2^64".to_owned(), |end| end.to_string());
            return Err(reader.error(format!(
                "its {count} elements need bytes up to {end} but bufferViews[{view}] has {length}; export the file again"
            )));
        }
        // Both fit: they are at most the length of a slice.
        let bytes = bytes.get(offset as usize..).unwrap_or_default();
        Ok(Elements { bytes, stride: stride as usize })
    }

    /// An accessor as vectors of `N` numbers; a shorter one leaves the rest of each vector at `fill`.
    ///
    /// `shapes` are the types that the use allows, such as `VEC3`.
    pub(crate) fn floats<const N: usize>(
        &self,
        index: usize,
        used_by: &str,
        shapes: &[&str],
        fill: [f32; N],
        budget: &mut Budget,
    ) -> Result<Vec<[f32; N]>, LoadProblem> {
        let (reader, accessor, format) = self.reader(index, used_by, shapes)?;
        if format.component == UNSIGNED_INT {
            return Err(
                reader.error("componentType 5125 (unsigned int) is only for indices; use 5126 (float)")
            );
        }
        let normalized = accessor.normalized;
        let decode = |bytes: &[u8]| {
            let mut value = fill;
            for (slot, bytes) in value.iter_mut().zip(bytes.chunks_exact(format.component_size())) {
                *slot = number(bytes, format.component, normalized);
            }
            value
        };
        let zero = decode(&[0; 16][..format.size().min(16)]);
        self.decode(&reader, accessor, &format, zero, decode, budget)
    }

    /// An accessor of indices, each less than `vertices`.
    pub(crate) fn indices(
        &self,
        index: usize,
        used_by: &str,
        vertices: usize,
        budget: &mut Budget,
    ) -> Result<Vec<u32>, LoadProblem> {
        let (reader, accessor, format) = self.reader(index, used_by, &["SCALAR"])?;
        if !matches!(format.component, UNSIGNED_BYTE | UNSIGNED_SHORT | UNSIGNED_INT) {
            return Err(reader.error(format!(
                "componentType {} cannot be an index; use 5121, 5123 or 5125",
                format.component
            )));
        }
        let values = self.decode(&reader, accessor, &format, 0, whole, budget)?;
        match values.iter().position(|&value| value as usize >= vertices) {
            Some(at) => Err(reader.error(format!(
                "index {at} is {}, but there are {vertices} vertices; export the file again",
                values[at]
            ))),
            None => Ok(values),
        }
    }

    fn reader<'b>(
        &'b self,
        index: usize,
        used_by: &'b str,
        shapes: &[&str],
    ) -> Result<(Reader<'b>, &'b Accessor, Format), LoadProblem> {
        let accessor = element(&self.document.accessors, "accessors", index, || used_by.to_owned())?;
        let reader = Reader { index, used_by };
        if !shapes.contains(&accessor.shape.as_str()) {
            let shape = super::document::shortened(&accessor.shape);
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

    fn decode<T: Copy>(
        &self,
        reader: &Reader<'_>,
        accessor: &Accessor,
        format: &Format,
        zero: T,
        decode: impl Fn(&[u8]) -> T,
        budget: &mut Budget,
    ) -> Result<Vec<T>, LoadProblem> {
        let base = match accessor.buffer_view {
            Some(view) => {
                Some(self.elements(view, accessor.byte_offset, accessor.count, format, true, reader)?)
            }
            None => None,
        };
        budget.charge(accessor.count, size_of::<T>(), || {
            format!("accessors[{}] ({})", reader.index, reader.used_by)
        })?;
        let mut values = match &base {
            Some(base) => base
                .bytes
                .chunks(base.stride)
                .take(accessor.count as usize)
                .map(|chunk| decode(&chunk[..format.size()]))
                .collect(),
            None => vec![zero; accessor.count as usize],
        };
        let Some(sparse) = &accessor.sparse else { return Ok(values) };
        for (index, replacement) in self.replacements(reader, accessor, sparse, format)? {
            let Some(value) = values.get_mut(index as usize) else {
                return Err(reader.error(format!(
                    "sparse index {index} is not below its count of {}; export the file again",
                    accessor.count
                )));
            };
            *value = decode(replacement);
        }
        Ok(values)
    }

    /// The elements of a sparse accessor that differ from the rest, with their indices.
    fn replacements(
        &self,
        reader: &Reader<'_>,
        accessor: &Accessor,
        sparse: &Sparse,
        format: &Format,
    ) -> Result<impl Iterator<Item = (u32, &[u8])>, LoadProblem> {
        let kind = Format { component: sparse.indices.component_type, components: 1, columns: 1 };
        if !matches!(kind.component, UNSIGNED_BYTE | UNSIGNED_SHORT | UNSIGNED_INT)
            || sparse.count > accessor.count
        {
            return Err(reader.error(format!(
                "sparse has {} elements of {} with indices of componentType {}; export the file again",
                sparse.count, accessor.count, kind.component
            )));
        }
        let (at, new) = (&sparse.indices, &sparse.values);
        let indices = self.elements(at.buffer_view, at.byte_offset, sparse.count, &kind, false, reader)?;
        let values = self.elements(new.buffer_view, new.byte_offset, sparse.count, format, false, reader)?;
        let pairs = indices.bytes.chunks_exact(kind.size()).zip(values.bytes.chunks_exact(format.size()));
        Ok(pairs.take(sparse.count as usize).map(|(index, value)| (whole(index), value)))
    }

    /// The elements of an accessor of any type, unread.
    pub(crate) fn raw(&self, index: usize, used_by: &str) -> Result<RawElements<'_>, LoadProblem> {
        const SHAPES: [&str; 7] = ["SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"];
        let (reader, accessor, format) = self.reader(index, used_by, &SHAPES)?;
        let base = match accessor.buffer_view {
            Some(view) => {
                Some(self.elements(view, accessor.byte_offset, accessor.count, &format, true, &reader)?)
            }
            None => None,
        };
        let sparse = match &accessor.sparse {
            Some(sparse) => self.replacements(&reader, accessor, sparse, &format)?.collect(),
            None => Vec::new(),
        };
        match usize::try_from(accessor.count) {
            Ok(count) if sparse.iter().all(|(index, _)| (*index as usize) < count) => {
                Ok(RawElements { format, count, base, sparse })
            }
            _ => Err(reader.error("a sparse index is not below its count; export the file again")),
        }
    }
}

/// An accessor in use, for messages.
struct Reader<'a> {
    index: usize,
    used_by: &'a str,
}

impl Reader<'_> {
    fn error(&self, problem: impl Into<String>) -> LoadProblem {
        LoadProblem::Accessor {
            accessor: self.index,
            used_by: self.used_by.to_owned(),
            problem: problem.into(),
        }
    }
}

/// A little-endian unsigned integer of one to four bytes.
fn whole(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |value, &byte| value << 8 | u32::from(byte))
}

/// One component; normalized integers by the glTF 2.0 specification, section 3.11.
fn number(bytes: &[u8], component: u32, normalized: bool) -> f32 {
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
