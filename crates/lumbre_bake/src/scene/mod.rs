//! The static scene in the form that the baker computes with: triangles in one space, their materials, and the layout
//! of their lightmap texels. `from_world` reads it once from the World; nothing here writes to the World.

mod baked_meshes;
mod box_tree;
pub(crate) mod crossings;
mod duplicates;
mod from_world;
mod hidden_side;
#[cfg(test)]
pub(crate) mod laid_out;
mod layouter;
mod leaks;
mod lightmap_layout;
mod lit_texels;
pub(crate) mod material;
pub(crate) mod mean_of_points;
mod occlusion;
mod receiver;
mod rooms;
mod static_scene;
mod texture;
mod texture_coordinates;
mod triangles;

pub(crate) use crossings::Face;
pub(crate) use material::{ShownTexels, Side, SurfaceMaterial, reflectance_as_metal};

pub use baked_meshes::{baked_area, baked_meshes};
pub(crate) use from_world::{Entities, from_world};
pub(crate) use layouter::{Layouter, density_of};
pub(crate) use lightmap_layout::{LightmapLayout, MapLayout};
pub(crate) use lit_texels::LitTexels;
pub(crate) use occlusion::SurfaceHit;
pub(crate) use receiver::Receiver;
pub(crate) use static_scene::world_points;
pub use static_scene::{PlacedLight, PlacedPrimitive, SceneObject, StaticScene};
pub(crate) use texture_coordinates::textures_of;
pub(crate) use triangles::{BakeScene, Canonical, SceneTriangle, position_bits};
