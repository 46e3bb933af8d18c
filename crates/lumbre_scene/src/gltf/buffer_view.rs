//! The bytes of buffer views, with bounds checks.

use std::borrow::Cow;

use super::document::{Document, element};
use super::error::LoadProblem;

/// The bytes of `bufferViews[index]`.
pub(crate) fn range_of_view<'a>(
    document: &Document,
    contents: &'a [Cow<'_, [u8]>],
    index: usize,
) -> Result<&'a [u8], LoadProblem> {
    let view = element(&document.buffer_views, "bufferViews", index, || format!("bufferViews[{index}]"))?;
    let place = || format!("bufferViews[{index}].buffer");
    let offset = view.byte_offset.unwrap_or_default().0;
    range(contents, index, (view.buffer.value(), offset, view.byte_length.0), place)
}

/// `length` bytes from `offset` in a buffer, or an error that names the buffer view with index `view`.
pub(crate) fn range<'a>(
    contents: &'a [Cow<'_, [u8]>],
    view: usize,
    (buffer, offset, length): (usize, u64, u64),
    place: impl FnOnce() -> String,
) -> Result<&'a [u8], LoadProblem> {
    let content = element(contents, "buffers", buffer, place)?;
    let end = offset.checked_add(length);
    let range = end.and_then(|end| Some(usize::try_from(offset).ok()?..usize::try_from(end).ok()?));
    range.and_then(|range| content.get(range)).ok_or_else(|| LoadProblem::BufferView {
        view,
        offset,
        end: end.unwrap_or(u64::MAX),
        buffer,
        length: content.len() as u64,
    })
}
