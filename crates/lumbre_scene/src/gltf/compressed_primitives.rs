//! Finds primitives with KHR_draco_mesh_compression, checks their bounds and decodes them, each attribute into an
//! accessor of its own. The codec is in `draco`.

use std::borrow::Cow;
use std::collections::HashMap;

use serde_json::{Map, Value};

use super::accessor_format::{Format, Reader};
use super::buffer_view::range_of_view;
use super::document::{Document, Primitive, element, extension};
use super::draco;
use super::error::LoadProblem;
use super::extensions::DracoPrimitive;
use super::limits::Budget;
use super::patch::{Key, Patch, place};

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

/// Returns true if a primitive of the file is compressed with Draco.
pub(crate) fn is_used(root: &Map<String, Value>) -> bool {
    let meshes = root.get("meshes").and_then(Value::as_array).into_iter().flatten();
    let primitives = meshes.filter_map(|mesh| mesh.get("primitives")?.as_array()).flatten();
    let mut extensions = primitives.filter_map(|primitive| primitive.get("extensions"));
    extensions.any(|extensions| extensions.get(EXTENSION).is_some())
}

/// Gives attributes accessors of their own where they share one but have different Draco data: what an accessor says of
/// them (type and count) may be the same, and programs that remove duplicates then keep only one. Returns true if the
/// JSON was changed.
pub(crate) fn separate_accessors(
    patch: &mut Patch,
    document: &Document,
    budget: &mut Budget,
) -> Result<bool, LoadProblem> {
    let mut origins: HashMap<usize, Origin> = HashMap::new();
    // Primitives that differ only in their material share the added accessors, too.
    let mut added: HashMap<(usize, Origin), usize> = HashMap::new();
    for (mesh, source) in document.meshes.iter().enumerate().filter(|_| cfg!(feature = "draco")) {
        for (index, primitive) in source.primitives.iter().enumerate() {
            let place = || format!("{}.primitives[{index}]", document.mesh_place(mesh));
            let Some(compressed) = compressed(primitive, place)? else { continue };
            let place = place();
            for Provided { accessor, attribute, used_by } in provided(primitive, &compressed, &place)? {
                element(&document.accessors, "accessors", accessor, || used_by)?;
                let origin = (compressed.buffer_view, attribute.map(|(_, number)| number));
                if *origins.entry(accessor).or_insert(origin) == origin {
                    continue;
                }
                if added.is_empty() {
                    // A reference that leads nowhere must not lead to an accessor that is added.
                    check_references(document)?;
                }
                let own = match added.get(&(accessor, origin)) {
                    Some(&own) => own,
                    None => {
                        let Some(shared) = patch.get(&place!["accessors", accessor]).cloned() else {
                            continue;
                        };
                        budget.charge(1, shared.to_string().len(), || place.clone())?;
                        let own = patch.push("accessors", shared);
                        added.insert((accessor, origin), own);
                        own
                    }
                };
                let of_primitive = place!["meshes", mesh, "primitives", index];
                let reference: &[Key] = match attribute {
                    Some((name, _)) => &place!["attributes", name],
                    None => &place!["indices"],
                };
                patch.set(&[&of_primitive[..], reference].concat(), own.into());
            }
        }
    }
    Ok(!added.is_empty())
}

/// Checks that the accessors of all primitives are there.
fn check_references(document: &Document) -> Result<(), LoadProblem> {
    for (mesh, source) in document.meshes.iter().enumerate() {
        for (index, primitive) in source.primitives.iter().enumerate() {
            let attributes = primitive.attributes.values().filter_map(Value::as_u64);
            let attributes = attributes.map(|accessor| usize::try_from(accessor).unwrap_or(usize::MAX));
            for accessor in attributes.chain(primitive.indices) {
                let place = || format!("{}.primitives[{index}]", document.mesh_place(mesh));
                element(&document.accessors, "accessors", accessor, place)?;
            }
        }
    }
    Ok(())
}

/// Decodes all primitives that are compressed with Draco. No accessor may have two origins: see
/// [`separate_accessors`].
pub(crate) fn decode(
    document: &Document,
    contents: &[Cow<'_, [u8]>],
    budget: &mut Budget,
) -> Result<DecodedAccessors, LoadProblem> {
    let mut decoded = DecodedAccessors::new();
    for (mesh, source) in document.meshes.iter().enumerate().filter(|_| cfg!(feature = "draco")) {
        for (index, primitive) in source.primitives.iter().enumerate() {
            let place = || format!("{}.primitives[{index}]", document.mesh_place(mesh));
            let Some(compressed) = compressed(primitive, place)? else { continue };
            let place = place();
            let provided = provided(primitive, &compressed, &place)?;
            let targets = targets(document, &compressed, &provided)?;
            if targets.iter().any(|target| !decoded.contains_key(&target.reader.index)) {
                decode_one(document, contents, &compressed, &targets, &place, budget, &mut decoded)?;
            }
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

/// What Draco data provide an accessor with.
struct Provided<'a> {
    accessor: usize,
    /// The attribute's name and its number in the data; `None` for the indices of the triangles.
    attribute: Option<(&'a str, u32)>,
    /// For messages.
    used_by: String,
}

/// What the Draco data of a primitive provide.
fn provided<'a>(
    primitive: &Primitive,
    compressed: &'a DracoPrimitive,
    place: &str,
) -> Result<Vec<Provided<'a>>, LoadProblem> {
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
    let indices = Provided { accessor: indices, attribute: None, used_by: format!("{place}.indices") };
    let mut provided = vec![indices];
    for (name, number) in &compressed.attributes {
        let Some(accessor) = primitive.attributes.get(name) else { continue };
        let used_by = format!("{place}.{name}");
        let accessor = serde_json::from_value(accessor.clone())
            .map_err(|source| LoadProblem::Json { place: used_by.clone(), source })?;
        provided.push(Provided { accessor, attribute: Some((name, *number)), used_by });
    }
    Ok(provided)
}

fn targets<'a>(
    document: &'a Document,
    compressed: &DracoPrimitive,
    provided: &'a [Provided<'_>],
) -> Result<Vec<Target<'a>>, LoadProblem> {
    let target = |Provided { accessor, attribute, used_by }: &'a Provided<'_>| {
        let number = attribute.map(|(_, number)| number);
        let shapes: &[&str] =
            if number.is_none() { &["SCALAR"] } else { &["SCALAR", "VEC2", "VEC3", "VEC4"] };
        let (reader, accessor, format) = Reader::of(document, *accessor, used_by, shapes)?;
        Ok(Target { reader, format, count: accessor.count, origin: (compressed.buffer_view, number) })
    };
    provided.iter().map(target).collect()
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
