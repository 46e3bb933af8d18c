//! Loads the triangles of a glTF file; materials and lights are ignored.

use std::error::Error;
use std::path::Path;

use glam::{Mat4, Vec3};

/// Returns a model from the `shared/models` folder beside the checkout, or the reason why there is none.
pub fn shared(name: &str) -> Result<Vec<[Vec3; 3]>, Box<dyn Error>> {
    let checkout = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let path = ["../shared/models", "../../shared/models"]
        .map(|folder| checkout.join(folder).join(name))
        .into_iter()
        .find(|path| path.exists())
        .ok_or_else(|| format!("shared/models/{name} is not beside the checkout"))?;
    load(&path)
}

fn load(path: &Path) -> Result<Vec<[Vec3; 3]>, Box<dyn Error>> {
    let (document, buffers, _) = gltf::import(path)?;
    let mut triangles = Vec::new();
    let mut pending: Vec<_> = document
        .scenes()
        .flat_map(|scene| scene.nodes().collect::<Vec<_>>())
        .map(|node| (node, Mat4::IDENTITY))
        .collect();
    while let Some((node, parent)) = pending.pop() {
        let place = parent * Mat4::from_cols_array_2d(&node.transform().matrix());
        pending.extend(node.children().map(|child| (child, place)));
        for primitive in node.mesh().into_iter().flat_map(|mesh| mesh.primitives().collect::<Vec<_>>()) {
            let reader = primitive.reader(|buffer| buffers.get(buffer.index()).map(|data| &data[..]));
            let positions: Vec<Vec3> = reader
                .read_positions()
                .ok_or("a primitive without positions")?
                .map(|position| place.transform_point3(Vec3::from(position)))
                .collect();
            let indices: Vec<u32> = match reader.read_indices() {
                Some(indices) => indices.into_u32().collect(),
                None => (0..positions.len() as u32).collect(),
            };
            triangles.extend(
                indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]].map(|index| positions[index as usize])),
            );
        }
    }
    Ok(triangles)
}
