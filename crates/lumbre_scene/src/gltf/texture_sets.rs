//! The texture coordinate sets that a material's textures read: renumbering them, and the convention for
//! meshes that have only lightmap coordinates.

use serde_json::{Value, json};

/// Name of the accessor for the lightmap coordinates of a mesh that has no others. glTF does not allow
/// TEXCOORD_1 without TEXCOORD_0, so both use this accessor; on import, its name tells that TEXCOORD_0 is
/// only a placeholder.
pub(crate) const LIGHTMAP_COORDINATES: &str = "LUMBRE_lightmap coordinates";

/// The material with every texture reading the set `moved(set)` instead of `set`; `None` if that changes
/// nothing.
///
/// Textures in extensions are recognized by their form: a member with a name ending in `Texture` that has an
/// `index`.
pub(crate) fn with_sets_moved(material: &Value, moved: &dyn Fn(u64) -> u64) -> Option<Value> {
    let mut changed = material.clone();
    walk(&mut changed, moved);
    (changed != *material).then_some(changed)
}

fn walk(value: &mut Value, moved: &dyn Fn(u64) -> u64) {
    let Value::Object(object) = value else { return };
    for (key, member) in object.iter_mut().filter(|(key, _)| *key != "extras") {
        if key.to_ascii_lowercase().ends_with("texture") && member.get("index").is_some() {
            move_one(member, moved);
        }
        walk(member, moved);
    }
}

fn move_one(texture: &mut Value, moved: &dyn Fn(u64) -> u64) {
    let transformed = texture.pointer("/extensions/KHR_texture_transform/texCoord").and_then(Value::as_u64);
    let own = texture.get("texCoord").and_then(Value::as_u64).unwrap_or(0);
    let now = moved(transformed.unwrap_or(own));
    if now == transformed.unwrap_or(own) {
        return;
    }
    match texture.pointer_mut("/extensions/KHR_texture_transform/texCoord") {
        Some(set) => *set = json!(now),
        None => texture["texCoord"] = json!(now),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn textures_of_every_kind_follow() {
        let material = json!({
            "pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "texCoord": 1}},
            "normalTexture": {"index": 1, "scale": 0.5},
            "extensions": {"KHR_materials_clearcoat": {"clearcoatTexture": {"index": 2, "texCoord": 0,
                "extensions": {"KHR_texture_transform": {"texCoord": 1}}}}},
            "extras": {"myTexture": {"index": 1, "texCoord": 1}}
        });
        let moved = with_sets_moved(&material, &|set| [2, 0][set as usize]).unwrap();
        let expected = json!({
            "pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "texCoord": 0}},
            "normalTexture": {"index": 1, "scale": 0.5, "texCoord": 2},
            "extensions": {"KHR_materials_clearcoat": {"clearcoatTexture": {"index": 2, "texCoord": 0,
                "extensions": {"KHR_texture_transform": {"texCoord": 0}}}}},
            "extras": {"myTexture": {"index": 1, "texCoord": 1}}
        });
        assert_eq!(moved, expected);
        assert_eq!(with_sets_moved(&material, &|set| set), None);
    }
}
