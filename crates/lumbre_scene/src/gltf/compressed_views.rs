//! Finds buffer views with EXT_meshopt_compression, checks their bounds and decodes them. The codec is in
//! `meshopt`.

use std::borrow::Cow;
use std::collections::HashMap;

use super::buffer_view;
use super::document::{Document, extension, shortened};
use super::error::LoadProblem;
use super::extensions::{MeshoptBuffer, MeshoptView};
use super::limits::Budget;
use super::meshopt::{self, Filter, Mode};

const EXTENSION: &str = "EXT_meshopt_compression";

/// The decoded bytes of buffer views, by view index.
pub(crate) type DecodedViews = HashMap<usize, Vec<u8>>;

/// Returns true if a buffer is only a placeholder that states the size of the decoded views.
pub(crate) fn is_fallback(document: &Document, buffer: usize) -> Result<bool, LoadProblem> {
    let Some(own) = document.buffers.get(buffer) else { return Ok(false) };
    let Some(extensions) = &own.extensions else { return Ok(false) };
    let found = extension::<MeshoptBuffer>(&extensions.others, EXTENSION, &format!("buffers[{buffer}]"))?;
    Ok(own.uri.is_none() && found.is_some_and(|found| found.fallback))
}

/// Decodes all compressed views of a file.
pub(crate) fn decode(
    document: &Document,
    contents: &[Cow<'_, [u8]>],
    budget: &mut Budget,
) -> Result<DecodedViews, LoadProblem> {
    let mut decoded = DecodedViews::new();
    for (index, view) in document.buffer_views.iter().enumerate() {
        let place = format!("bufferViews[{index}]");
        let Some(extensions) = &view.extensions else { continue };
        let Some(source) = extension::<MeshoptView>(&extensions.others, EXTENSION, &place)? else { continue };
        let refused = |field: &str, value: String, expected: &str| LoadProblem::Value {
            place: place.clone(),
            field: format!("{EXTENSION}.{field}"),
            value,
            expected: expected.to_owned(),
        };
        let mode = match source.mode.as_str() {
            "ATTRIBUTES" => Mode::Attributes,
            "TRIANGLES" => Mode::Triangles,
            "INDICES" => Mode::Indices,
            other => {
                let value = format!("{:?}", shortened(other));
                return Err(refused("mode", value, "use ATTRIBUTES, TRIANGLES or INDICES"));
            }
        };
        let filter = match source.filter.as_deref() {
            None | Some("NONE") => Filter::None,
            Some("OCTAHEDRAL") => Filter::Octahedral,
            Some("QUATERNION") => Filter::Quaternion,
            Some("EXPONENTIAL") => Filter::Exponential,
            Some(other) => {
                let value = format!("{:?}", shortened(other));
                return Err(refused("filter", value, "use NONE, OCTAHEDRAL, QUATERNION or EXPONENTIAL"));
            }
        };
        let length = source.count.checked_mul(source.byte_stride);
        if length != Some(view.byte_length.0) {
            let value = format!("{} elements of {} bytes", source.count, source.byte_stride);
            return Err(refused("count", value, "they have to fill the buffer view; export the file again"));
        }
        budget.charge(view.byte_length.0, 1, || place.clone())?;
        let field = || format!("{place}.{EXTENSION}.buffer");
        let place_in_buffer = (source.buffer, source.byte_offset, source.byte_length);
        let bytes = buffer_view::range(contents, index, place_in_buffer, field)?;
        let made = meshopt::decode(mode, filter, source.count as usize, source.byte_stride as usize, bytes);
        let made = made.map_err(|problem| LoadProblem::Compressed {
            place: place.clone(),
            problem: problem.to_owned(),
        })?;
        decoded.insert(index, made);
    }
    Ok(decoded)
}
