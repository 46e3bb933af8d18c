//! Scenes of one quad in front of a camera that sees nothing else, with a closed form for every pixel.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec2, DVec3, Vec2, Vec3};
use lumbre_mesh::TriangleMesh;
use lumbre_optics::Material;
use lumbre_scene::{
    Camera, Image, Mesh, Mipmap, Projection, Sampler, SceneSettings, TextureReference, Transform, Wrap,
};

/// Distance of the camera from the pane's plane z = 0, in metres. It is a power of two, so that it causes no
/// rounding.
pub const EYE: f64 = 4.0;

/// A quad of 2 m by 2 m around the origin that faces +z; `uv0` runs from (0, 0) at the upper left to (1, 1) at the
/// lower right.
pub fn pane() -> TriangleMesh {
    let corners = [Vec2::new(-1.0, -1.0), Vec2::new(1.0, -1.0), Vec2::new(1.0, 1.0), Vec2::new(-1.0, 1.0)];
    TriangleMesh {
        positions: corners.map(|corner| corner.extend(0.0)).to_vec(),
        normals: vec![Vec3::Z; 4],
        uv0: corners.map(|corner| Vec2::new(0.5 + 0.5 * corner.x, 0.5 - 0.5 * corner.y)).to_vec(),
        indices: vec![0, 1, 2, 0, 2, 3],
        ..TriangleMesh::default()
    }
}

/// An orthographic camera on +z whose frame the pane fills exactly.
pub fn orthographic() -> (Camera, Transform) {
    let projection = Projection::Orthographic { half_width: 1.0, half_height: 1.0, near: 0.5, far: 16.0 };
    (Camera { projection, exposure: 1.0 }, Transform::from_xyz(0.0, 0.0, EYE))
}

/// A perspective camera at the same position whose square frame the pane fills exactly.
pub fn perspective() -> (Camera, Transform) {
    let vertical_fov = 2.0 * (1.0 / EYE).atan();
    let projection = Projection::Perspective { vertical_fov, aspect: None, near: 0.05, far: None };
    (Camera { projection, exposure: 1.0 }, Transform::from_xyz(0.0, 0.0, EYE))
}

/// A pane with a material in front of the orthographic camera, in ambient light of 1.
pub fn pane_of(material: Material) -> World {
    let mut world = World::new();
    world.spawn((Mesh(Arc::new(pane())), material));
    world.spawn(orthographic());
    world.insert_resource(SceneSettings { ambient: Vec3::ONE, ..SceneSettings::default() });
    world
}

/// Returns the texture coordinates on the pane of the centre of a pixel of a square frame.
pub fn pixel_uv(x: usize, y: usize, size: usize) -> DVec2 {
    DVec2::new(x as f64 + 0.5, y as f64 + 0.5) / size as f64
}

/// Returns its position in world space.
pub fn pixel_point(x: usize, y: usize, size: usize) -> DVec3 {
    let uv = pixel_uv(x, y, size);
    DVec3::new(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y, 0.0)
}

/// Creates an image of these texels, top row first.
pub fn image(width: u32, texels: &[[u8; 4]]) -> Arc<Image> {
    let height = u32::try_from(texels.len()).expect("a small image") / width;
    Arc::new(Image { name: "test".to_owned(), width, height, rgba: texels.concat() })
}

/// Returns a reference to an image without filtering, repeated in both directions.
pub fn sharp(image: &Arc<Image>) -> TextureReference {
    let sampler = Sampler {
        wrap_u: Wrap::Repeat,
        wrap_v: Wrap::Repeat,
        magnify_linear: false,
        minify_linear: false,
        mipmap: Mipmap::None,
    };
    TextureReference { sampler, ..TextureReference::new(Arc::clone(image)) }
}

/// Returns the linear value of an sRGB code (IEC 61966-2-1).
pub fn srgb(code: u8) -> f64 {
    let value = f64::from(code) / 255.0;
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

/// Returns the linear colour of a texel whose bytes are sRGB-encoded.
pub fn srgb_texel(texel: [u8; 4]) -> DVec3 {
    DVec3::new(srgb(texel[0]), srgb(texel[1]), srgb(texel[2]))
}
