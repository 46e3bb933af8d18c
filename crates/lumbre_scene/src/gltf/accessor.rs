//! Decodes accessors to numbers, including sparse accessors and normalized integers.
//!
//! Every offset, stride and count is checked against the bytes that exist before anything is allocated, and
//! decoded data is charged to a [`Budget`].

use gltf::json::buffer::View;

use super::accessor_format::{Format, Reader, UNSIGNED_BYTE, UNSIGNED_INT, UNSIGNED_SHORT, number, whole};
use super::buffer_view::range_of_view;
use super::compressed::Decoded;
use super::document::{Accessor, Document, Sparse, element};
use super::error::LoadProblem;
use super::limits::Budget;

/// The buffers of a file with the document that describes them.
pub(crate) struct Buffers<'a> {
    pub document: &'a Document,
    pub bytes: Vec<std::borrow::Cow<'a, [u8]>>,
    /// The decoded form of compressed data.
    pub decoded: std::borrow::Cow<'a, Decoded>,
}

/// Elements in a buffer view, already checked to lie within it.
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
}

impl<'a> Elements<'a> {
    /// The bytes of one element; empty if the index is out of range.
    fn get(&self, index: usize, size: usize) -> &'a [u8] {
        let start = index.saturating_mul(self.stride);
        self.bytes.get(start..start.saturating_add(size)).unwrap_or_default()
    }
}

/// The undecoded elements of an accessor.
pub(crate) struct RawElements<'a> {
    pub format: Format,
    pub count: usize,
    base: Option<Elements<'a>>,
    /// Sparse replacements as pairs of element index and bytes.
    pub sparse: Vec<(u32, &'a [u8])>,
}

impl<'a> RawElements<'a> {
    /// The bytes of an element in the buffer view; `None` if the accessor has no view, which means zeros.
    pub(crate) fn base(&self, index: usize) -> Option<&'a [u8]> {
        self.base.as_ref().map(|base| base.get(index, self.format.size()))
    }
}

impl<'a> Buffers<'a> {
    /// Returns true if the accessor's elements come from the compressed data of a primitive.
    pub(crate) fn is_decoded(&self, accessor: usize) -> bool {
        self.decoded.accessors.contains_key(&accessor)
    }

    /// The bytes of a buffer view, and its stride if it states one.
    pub(crate) fn view(
        &self,
        index: usize,
        place: impl FnOnce() -> String,
    ) -> Result<(&[u8], Option<u64>), LoadProblem> {
        let view = element(&self.document.buffer_views, "bufferViews", index, place)?;
        if let Some(decoded) = self.decoded.views.get(&index) {
            return Ok((decoded, stride(view)));
        }
        let bytes = range_of_view(self.document, &self.bytes, index)?;
        Ok((bytes, stride(view)))
    }

    /// `count` elements from an offset in a view, or an error if they exceed the view.
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
        // The casts are lossless: both are at most the length of the slice.
        let bytes = bytes.get(offset as usize..).unwrap_or_default();
        Ok(Elements { bytes, stride: stride as usize })
    }

    /// Decodes an accessor to vectors of `N` numbers. If its elements are shorter, the remaining numbers are
    /// taken from `fill`.
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
        let (reader, accessor, format) = Reader::of(self.document, index, used_by, shapes)?;
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

    /// Decodes an accessor of indices, each of which must be less than `vertices`.
    pub(crate) fn indices(
        &self,
        index: usize,
        used_by: &str,
        vertices: usize,
        budget: &mut Budget,
    ) -> Result<Vec<u32>, LoadProblem> {
        let (reader, accessor, format) = Reader::of(self.document, index, used_by, &["SCALAR"])?;
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

    /// The elements in the accessor's buffer view or in its decompressed data; `None` if it has neither.
    fn base(
        &self,
        reader: &Reader<'_>,
        accessor: &Accessor,
        format: &Format,
    ) -> Result<Option<Elements<'_>>, LoadProblem> {
        if let Some(bytes) = self.decoded.accessors.get(&reader.index) {
            return Ok(Some(Elements { bytes, stride: format.size() }));
        }
        let Some(view) = accessor.buffer_view else { return Ok(None) };
        self.elements(view, accessor.byte_offset, accessor.count, format, true, reader).map(Some)
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
        let base = self.base(reader, accessor, format)?;
        budget.charge(accessor.count, size_of::<T>(), || {
            format!("accessors[{}] ({})", reader.index, reader.used_by())
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

    /// The replaced elements of a sparse accessor, with their indices.
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

    /// The undecoded elements of an accessor of any type.
    pub(crate) fn raw(&self, index: usize, used_by: &str) -> Result<RawElements<'_>, LoadProblem> {
        const SHAPES: [&str; 7] = ["SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"];
        let (reader, accessor, format) = Reader::of(self.document, index, used_by, &SHAPES)?;
        let base = self.base(&reader, accessor, &format)?;
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

/// The stride of a view in bytes, if it states one.
fn stride(view: &View) -> Option<u64> {
    view.byte_stride.map(|stride| stride.0 as u64)
}
