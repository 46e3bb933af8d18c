//! Finds primitives with KHR_draco_mesh_compression, checks their bounds and decodes them. The codec is in
//! `draco`.

use std::borrow::Cow;
use std::collections::HashMap;

use super::accessor_format::{Format, Reader};
use super::buffer_view::range_of_view;
use super::document::{Document, Primitive, extension};
use super::draco;
use super::error::LoadProblem;
use super::extensions::DracoPrimitive;
use super::limits::Budget;

pub(crate) const EXTENSION: &str = "KHR_draco_mesh_compression";

/// Bytes of the decoder's internal tables per triangle.
const TABLES: usize = 64;

/// The decoded elements by accessor index, tightly packed in the accessor's own format.
pub(crate) type DecodedAccessors = HashMap<usize, Vec<u8>>;

/// Where an accessor's data comes from: a buffer view, and the id of an attribute in its Draco data, or
/// `None` for the indices of the triangles.
type Origin = (usize, Option<u32>);

/// An accessor to be filled from Draco data.
struct Target<'a> {
    reader: Reader<'a>,
    format: Format,
    count: u64,
    origin: Origin,
}

/// Decodes all primitives that are compressed with Draco.
pub(crate) fn decode(
    document: &Document,
    contents: &[Cow<'_, [u8]>],
    budget: &mut Budget,
) -> Result<DecodedAccessors, LoadProblem> {
    let mut decoded = DecodedAccessors::new();
    let mut origins: HashMap<usize, Origin> = HashMap::new();
    if !cfg!(feature = "draco") {
        return Ok(decoded);
    }
    for (mesh, source) in document.meshes.iter().enumerate() {
        for (index, primitive) in source.primitives.iter().enumerate() {
            let place = || format!("{}.primitives[{index}]", document.mesh_place(mesh));
            let Some(compressed) = compressed(primitive, place)? else { continue };
            let place = place();
            let names = names(primitive, &compressed, &place)?;
            let targets = targets(document, &compressed, &names)?;
            if targets.iter().all(|target| origins.get(&target.reader.index) == Some(&target.origin)) {
                continue;
            }
            for target in &targets {
                if origins.insert(target.reader.index, target.origin).is_some_and(|was| was != target.origin)
                {
                    return Err(target.reader.error(
                        "is decoded from the Draco data of two primitives; every primitive needs accessors of its own, export the file again",
                    ));
                }
            }
            decode_one(document, contents, &compressed, &targets, &place, budget, &mut decoded)?;
        }
    }
    Ok(decoded)
}

/// The Draco extension of a primitive, if it has one.
pub(crate) fn compressed(
    primitive: &Primitive,
    place: impl FnOnce() -> String,
) -> Result<Option<DracoPrimitive>, LoadProblem> {
    if !primitive.extensions.contains_key(EXTENSION) {
        return Ok(None);
    }
    extension(&primitive.extensions, EXTENSION, &place())
}

/// The accessors that the Draco data provides: accessor index, attribute id in the data (`None` for the
/// indices), and a name for messages.
fn names(
    primitive: &Primitive,
    compressed: &DracoPrimitive,
    place: &str,
) -> Result<Vec<(usize, Option<u32>, String)>, LoadProblem> {
    let refused = |field: &str, value: &str, expected: &str| LoadProblem::Value {
        place: place.to_owned(),
        field: field.to_owned(),
        value: value.to_owned(),
        expected: expected.to_owned(),
    };
    if primitive.mode.is_some_and(|mode| mode != 4) {
        let value = format!("{} with {EXTENSION}", primitive.mode.unwrap_or_default());
        return Err(refused("mode", &value, "Draco data are triangles (4); export the file again"));
    }
    let Some(indices) = primitive.indices else {
        let expected = "a primitive with Draco data needs an accessor for its indices; export the file again";
        return Err(refused("indices", "missing", expected));
    };
    let mut names = vec![(indices, None, format!("{place}.indices"))];
    for (name, number) in &compressed.attributes {
        let Some(accessor) = primitive.attributes.get(name) else { continue };
        let used_by = format!("{place}.{name}");
        let accessor = serde_json::from_value(accessor.clone())
            .map_err(|source| LoadProblem::Json { place: used_by.clone(), source })?;
        names.push((accessor, Some(*number), used_by));
    }
    Ok(names)
}

fn targets<'a>(
    document: &'a Document,
    compressed: &DracoPrimitive,
    names: &'a [(usize, Option<u32>, String)],
) -> Result<Vec<Target<'a>>, LoadProblem> {
    let target = |(accessor, number, used_by): &'a (usize, Option<u32>, String)| {
        let shapes: &[&str] =
            if number.is_none() { &["SCALAR"] } else { &["SCALAR", "VEC2", "VEC3", "VEC4"] };
        let (reader, accessor, format) = Reader::of(document, *accessor, used_by, shapes)?;
        Ok(Target { reader, format, count: accessor.count, origin: (compressed.buffer_view, *number) })
    };
    names.iter().map(target).collect()
}

fn decode_one(
    document: &Document,
    contents: &[Cow<'_, [u8]>],
    compressed: &DracoPrimitive,
    targets: &[Target<'_>],
    place: &str,
    budget: &mut Budget,
    decoded: &mut DecodedAccessors,
) -> Result<(), LoadProblem> {
    let bytes = range_of_view(document, contents, compressed.buffer_view)?;
    // The whole output is charged to the budget before the decoder runs, and the decoder may not produce more
    // than that.
    let (mut corners, mut points) = (0, None);
    for target in targets {
        budget.charge(target.count, target.format.size(), || place.to_owned())?;
        if target.origin.1.is_none() {
            corners = target.count;
            budget.charge(corners / 3, TABLES, || place.to_owned())?;
        } else if *points.get_or_insert(target.count) != target.count {
            return Err(target.reader.error(format!(
                "has {} elements, but another attribute in the same Draco data {}; export the file again",
                target.count,
                points.unwrap_or_default()
            )));
        }
    }
    let refused = |problem| LoadProblem::Compressed { place: place.to_owned(), problem };
    let points = points.unwrap_or_default();
    budget.charge(points, draco::MAX_BYTES_PER_POINT, || place.to_owned())?;
    let mesh = draco::decode(bytes, points, corners / 3).map_err(refused)?;
    if mesh.points() as u64 != points || mesh.triangles() as u64 * 3 != corners {
        let (points, triangles) = (mesh.points(), mesh.triangles());
        return Err(refused(format!(
            "its Draco data hold {points} vertices and {triangles} triangles, which its accessors do not say"
        )));
    }
    for target in targets {
        let elements = match target.origin.1 {
            Some(number) => mesh.attribute(number, target.format),
            None => mesh.indices(target.format),
        };
        decoded.insert(target.reader.index, elements.map_err(|problem| target.reader.error(problem))?);
    }
    Ok(())
}
