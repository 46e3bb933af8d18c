//! Reversible changes to the JSON of a file. A bake records in the file what it changes, so that the next
//! bake can restore the artist's version first. What is changed is up to the callers.

use std::collections::{BTreeMap, HashSet};

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

/// The root-level extension that holds the record.
pub(crate) const EXTENSION: &str = "LUMBRE_bake";

/// The lists to which elements may be appended.
const LISTS: [&str; 6] = ["accessors", "bufferViews", "buffers", "materials", "meshes", "nodes"];

/// Version of the record. Records of other versions are not undone.
const VERSION: u32 = 1;

/// One step of a path: the name of an object member or the index of a list element.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(untagged)]
pub(crate) enum Key {
    Index(usize),
    Name(String),
}

impl From<usize> for Key {
    fn from(index: usize) -> Self {
        Self::Index(index)
    }
}

impl From<&str> for Key {
    fn from(name: &str) -> Self {
        Self::Name(name.to_owned())
    }
}

/// The path from the root to a value.
pub(crate) type Place = Vec<Key>;

/// Builds a path from names and indices.
macro_rules! place {
    ($($key:expr),+ $(,)?) => { [$($crate::gltf::patch::Key::from($key)),+] };
}
pub(crate) use place;

/// The record of changes, stored as `extensions.LUMBRE_bake`.
#[derive(Serialize, Deserialize)]
struct Record {
    version: u32,
    /// Length of each changed list before and after the changes; `None` if the list did not exist.
    lengths: BTreeMap<String, [Option<usize>; 2]>,
    /// The former values at the changed paths; `None` where there was no value.
    replaced: Vec<(Place, Option<Value>)>,
    /// URIs of the files that were copied beside the output.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    copied: Vec<String>,
}

/// The JSON of a file, with a record of the changes made to it.
#[derive(Clone, Debug)]
pub(crate) struct Patch {
    root: Value,
    lengths: BTreeMap<String, Option<usize>>,
    replaced: Vec<(Place, Option<Value>)>,
    /// The places in `replaced`.
    remembered: HashSet<Place>,
}

impl Patch {
    pub(crate) fn new(root: Map<String, Value>) -> Self {
        let root = Value::Object(root);
        let lengths = LISTS.iter().map(|&list| (list.to_owned(), length(&root, list))).collect();
        Self { root, lengths, replaced: Vec::new(), remembered: HashSet::new() }
    }

    /// The value at a path.
    pub(crate) fn get(&self, place: &[Key]) -> Option<&Value> {
        place.iter().try_fold(&self.root, |value, key| step(value, key))
    }

    /// A copy of the JSON in its current state.
    pub(crate) fn root(&self) -> Map<String, Value> {
        self.root.as_object().cloned().unwrap_or_default()
    }

    /// Returns true if nothing was changed.
    pub(crate) fn is_unchanged(&self) -> bool {
        self.replaced.is_empty()
            && self.lengths.iter().all(|(list, before)| length(&self.root, list) == *before)
    }

    /// Length of a list before anything was appended to it.
    pub(crate) fn former_length(&self, list: &str) -> usize {
        self.lengths.get(list).copied().flatten().unwrap_or_default()
    }

    /// Appends to one of the extensible lists and returns the index of the new element.
    pub(crate) fn push(&mut self, list: &str, value: Value) -> usize {
        let entry = &mut self.root[list];
        if !entry.is_array() {
            *entry = Value::Array(Vec::new());
        }
        let entries = entry.as_array_mut().map(|entries| {
            entries.push(value);
            entries.len()
        });
        entries.unwrap_or_default().saturating_sub(1)
    }

    /// Sets the value at a path, creating missing objects along it.
    pub(crate) fn set(&mut self, place: &[Key], value: Value) {
        if self.get(place) == Some(&value) {
            return;
        }
        // Undoing removes the first step of the path that does not exist yet.
        let existing = (0..place.len()).take_while(|&end| self.get(&place[..=end]).is_some()).count();
        let changed = &place[..(existing + 1).min(place.len())];
        let former = self.get(changed).cloned();
        self.remember(changed, former);
        put(&mut self.root, place, Some(value));
    }

    /// Removes the value at a path from its object.
    pub(crate) fn remove(&mut self, place: &[Key]) {
        if let Some(former) = self.get(place).cloned() {
            self.remember(place, Some(former));
            put(&mut self.root, place, None);
        }
    }

    /// Changes the value at a path to `value`, touching only the members that differ.
    pub(crate) fn replace(&mut self, place: &[Key], value: &Value) {
        let (Some(Value::Object(before)), Value::Object(after)) = (self.get(place), value) else {
            self.set(place, value.clone());
            return;
        };
        let gone: Vec<String> = before.keys().filter(|key| !after.contains_key(*key)).cloned().collect();
        let below = |key: &str| [place, &place![key]].concat();
        for key in gone {
            self.remove(&below(&key));
        }
        for (key, value) in after {
            self.replace(&below(key), value);
        }
    }

    fn remember(&mut self, place: &[Key], former: Option<Value>) {
        // Appended elements are removed as a whole, so former values inside them are not needed.
        let added = match place {
            [Key::Name(list), Key::Index(index), ..] => {
                self.lengths.contains_key(list) && *index >= self.former_length(list)
            }
            _ => false,
        };
        if !added && self.remembered.insert(place.to_vec()) {
            self.replaced.push((place.to_vec(), former));
        }
    }

    /// The changed JSON, including the record of the changes if there are any.
    ///
    /// # Errors
    /// The error of the JSON serializer.
    pub(crate) fn finish(mut self) -> Result<Value, serde_json::Error> {
        if self.is_unchanged() {
            return Ok(self.root);
        }
        let lengths = std::mem::take(&mut self.lengths);
        let lengths = lengths
            .into_iter()
            .map(|(list, before)| {
                let after = length(&self.root, &list);
                (list, [before, after])
            })
            .filter(|(_, [before, after])| before != after)
            .collect();
        let record = Record { version: VERSION, lengths, replaced: self.replaced, copied: Vec::new() };
        put(&mut self.root, &place!["extensions", EXTENSION], Some(serde_json::to_value(record)?));
        Ok(self.root)
    }
}

/// Removes an extension from `extensionsUsed` and `extensionsRequired` if no element of `list` has it any
/// more.
pub(crate) fn without_unused(patch: &mut Patch, extension: &str, list: &str) {
    fn has(value: &Value, extension: &str) -> bool {
        match value {
            Value::Object(object) => object.iter().any(|(key, member)| {
                (key == "extensions" && member.get(extension).is_some())
                    || (key != "extras" && has(member, extension))
            }),
            Value::Array(elements) => elements.iter().any(|element| has(element, extension)),
            _ => false,
        }
    }
    if patch.get(&place![list]).is_some_and(|elements| has(elements, extension)) {
        return;
    }
    for key in ["extensionsUsed", "extensionsRequired"] {
        let Some(Value::Array(names)) = patch.get(&place![key]) else { continue };
        let others: Vec<Value> = names.iter().filter(|name| *name != extension).cloned().collect();
        if others.is_empty() {
            patch.remove(&place![key]);
        } else if others.len() < names.len() {
            patch.set(&place![key], others.into());
        }
    }
}

/// The outcome of undoing an earlier bake.
pub(crate) enum EarlierBake {
    /// The file has no record of a bake.
    None,
    /// The changes of the bake were undone.
    Undone,
    /// The file was modified after the bake, so the record no longer matches it. Only the record was removed.
    Modified,
}

/// Undoes the changes that an earlier bake made to a file.
pub(crate) fn undo_bake(root: &mut Map<String, Value>) -> EarlierBake {
    let Some(record) = root.get("extensions").and_then(|extensions| extensions.get(EXTENSION)) else {
        return EarlierBake::None;
    };
    let mut pristine = Value::Object(root.clone());
    let taken = Record::deserialize(record).ok().filter(|record| record.version == VERSION);
    if let Some(record) = taken
        && restore(&mut pristine, record).is_some()
        && let Value::Object(pristine) = pristine
    {
        *root = pristine;
        return EarlierBake::Undone;
    }
    // Remove the record, so that it cannot be mistaken for a valid one later.
    if let Some(Value::Object(extensions)) = root.get_mut("extensions") {
        extensions.shift_remove(EXTENSION);
    }
    EarlierBake::Modified
}

/// Adds to the record the URIs of the files that were copied beside the output.
pub(crate) fn record_copied(root: &mut Value, copied: Vec<String>) {
    if let (false, Some(Value::Object(record))) =
        (copied.is_empty(), root.get_mut("extensions").and_then(|own| own.get_mut(EXTENSION)))
    {
        record.insert("copied".to_owned(), copied.into());
    }
}

/// The URIs of the files that an earlier bake copied beside its output.
pub(crate) fn copied(root: &Map<String, Value>) -> Vec<String> {
    let record = root.get("extensions").and_then(|extensions| extensions.get(EXTENSION));
    record.and_then(|record| Record::deserialize(record).ok()).map_or(Vec::new(), |record| record.copied)
}

/// For each light, whether its intensity is in candela or lux, as in `KHR_lights_punctual`: true if it has no
/// `LUMBRE_lights_phong`, or has it only because a bake added it.
pub(crate) fn photometric_lights(root: &Map<String, Value>) -> Vec<bool> {
    let extensions = root.get("extensions");
    let record = extensions.and_then(|extensions| Record::deserialize(extensions.get(EXTENSION)?).ok());
    let marked = |light: usize| {
        let of_it = place!["extensions", "KHR_lights_punctual", "lights", light];
        let mut replaced = record.iter().flat_map(|record| &record.replaced);
        // The bake created the extension, or the object around it.
        replaced.any(|(place, former)| {
            former.is_none() && place.starts_with(&of_it) && place.len() <= of_it.len() + 2
        })
    };
    let lights =
        extensions.and_then(|extensions| extensions.get("KHR_lights_punctual")?.get("lights")?.as_array());
    let lights = lights.into_iter().flatten().enumerate();
    lights
        .map(|(index, light)| light.pointer("/extensions/LUMBRE_lights_phong").is_none() || marked(index))
        .collect()
}

fn restore(root: &mut Value, record: Record) -> Option<()> {
    let fits = |(list, [_, after]): (&String, &[Option<usize>; 2])| length(root, list) == *after;
    if !record.lengths.iter().all(fits) {
        return None;
    }
    for (place, former) in record.replaced.into_iter().rev() {
        put(root, &place, former)?;
    }
    for (list, [before, _]) in &record.lengths {
        match (before, root.get_mut(list)) {
            (Some(before), Some(Value::Array(entries))) => entries.truncate(*before),
            (None, _) => put(root, &place![list.as_str()], None)?,
            _ => return None,
        }
    }
    if let Some(Value::Object(extensions)) = root.get_mut("extensions") {
        extensions.shift_remove(EXTENSION);
        if extensions.is_empty() {
            put(root, &place!["extensions"], None)?;
        }
    }
    Some(())
}

fn length(root: &Value, list: &str) -> Option<usize> {
    root.get(list).and_then(Value::as_array).map(Vec::len)
}

fn step<'a>(value: &'a Value, key: &Key) -> Option<&'a Value> {
    match key {
        Key::Name(name) => value.as_object()?.get(name),
        Key::Index(index) => value.as_array()?.get(*index),
    }
}

/// Sets the value at a path, creating missing objects along it, or removes the value if it is `None`. Returns
/// `None` if the path does not fit the JSON.
fn put(root: &mut Value, place: &[Key], value: Option<Value>) -> Option<()> {
    let (last, way) = place.split_last()?;
    let parent = way.iter().try_fold(root, |parent, key| match key {
        Key::Name(name) => {
            Some(parent.as_object_mut()?.entry(name.as_str()).or_insert_with(|| Value::Object(Map::new())))
        }
        Key::Index(index) => parent.as_array_mut()?.get_mut(*index),
    })?;
    match (last, value) {
        (Key::Name(name), Some(value)) => {
            parent.as_object_mut()?.insert(name.clone(), value);
        }
        (Key::Name(name), None) => {
            parent.as_object_mut()?.shift_remove(name);
        }
        (Key::Index(index), Some(value)) => *parent.as_array_mut()?.get_mut(*index)? = value,
        (Key::Index(_), None) => return None,
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn object(value: Value) -> Map<String, Value> {
        let Value::Object(object) = value else { panic!("an object") };
        object
    }

    #[test]
    fn everything_is_taken_back() {
        let original = json!({
            "asset": {"version": "2.0"},
            "nodes": [{"name": "floor", "mesh": 0}, {"extensions": {"FOREIGN_thing": {"a": 1}}}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 5}]}],
            "accessors": [{"count": 3}],
        });
        let mut patch = Patch::new(object(original.clone()));
        assert_eq!(patch.push("accessors", json!({"count": 4})), 1);
        patch.set(&place!["accessors", 1, "count"], json!(5));
        assert_eq!(patch.push("buffers", json!({})), 0);
        patch.set(&place!["nodes", 0, "extensions", "LUMBRE_lightmap", "image"], json!("a.exr"));
        patch.set(&place!["nodes", 0, "extensions", "LUMBRE_lightmap", "image"], json!("b.exr"));
        patch.set(&place!["nodes", 1, "extensions", "LUMBRE_lightmap"], json!({}));
        let primitive = json!({"attributes": {"POSITION": 1, "TEXCOORD_1": 1}});
        patch.replace(&place!["meshes", 0, "primitives", 0], &primitive);
        patch.set(&place!["asset", "version"], json!("2.0"));
        let mut baked = patch.finish().unwrap();
        record_copied(&mut baked, vec!["wall.png".to_owned()]);
        assert_eq!(baked["meshes"][0]["primitives"][0], primitive);
        assert_eq!(baked["nodes"][0]["extensions"]["LUMBRE_lightmap"]["image"], "b.exr");
        assert_eq!(copied(&object(baked.clone())), ["wall.png"]);

        let mut again = object(baked.clone());
        assert!(matches!(undo_bake(&mut again), EarlierBake::Undone));
        assert_eq!(Value::Object(again.clone()), original);
        assert!(matches!(undo_bake(&mut again), EarlierBake::None));

        // Another program added an accessor, so the record no longer matches and nothing is undone.
        let mut changed = object(baked);
        changed["accessors"].as_array_mut().unwrap().push(json!({}));
        assert!(matches!(undo_bake(&mut changed), EarlierBake::Modified));
        assert_eq!(changed["accessors"].as_array().unwrap().len(), 3);
        assert_eq!(changed["nodes"][0]["extensions"]["LUMBRE_lightmap"]["image"], "b.exr");
    }

    #[test]
    fn no_record_can_do_harm() {
        for replaced in [
            json!([[[], 1]]),
            json!([[["nodes", 7], 1]]),
            json!([[["nodes", 0], null]]),
            json!([[["nodes", "x"], 1]]),
            json!([[["asset", "version", "x"], 1]]),
            json!("x"),
        ] {
            let record = json!({"version": 1, "lengths": {}, "replaced": replaced});
            let mut root = object(json!({"asset": {"version": "2.0"}, "nodes": [{}],
                "extensions": {"LUMBRE_bake": record}}));
            assert!(matches!(undo_bake(&mut root), EarlierBake::Modified), "{replaced}");
            assert_eq!(root["nodes"], json!([{}]));
        }
    }

    #[test]
    fn nothing_changed_is_nothing_recorded() {
        let original = json!({"asset": {"version": "2.0"}, "nodes": [{}]});
        let mut patch = Patch::new(object(original.clone()));
        patch.set(&place!["asset", "version"], json!("2.0"));
        patch.remove(&place!["nodes", 0, "extensions"]);
        assert_eq!(patch.finish().unwrap(), original);
    }
}
