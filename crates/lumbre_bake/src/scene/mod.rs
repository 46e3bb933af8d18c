//! The static scene as light meets it: triangles in one space, what they reflect and emit, where their texels are.
//! Not the World: it is read once, before, and written once, after.

mod collect;
pub(crate) mod crossings;
mod duplicates;
mod hidden_side;
mod input;
mod leaks;
mod lightmap_layout;
pub(crate) mod material;
mod occlusion;
mod rooms;
mod texture;
mod texture_coordinates;
mod triangles;
mod wanted_probes;

pub(crate) use collect::{
    Object, PlacedLight, PlacedPrimitive, collect, lights, sky, under_a_dynamic_object,
};
pub(crate) use input::Input;
pub(crate) use lightmap_layout::{LightmapLayout, density_of, lay_out, lay_out_with, world_points};
pub(crate) use material::SurfaceMaterial;
pub(crate) use occlusion::SurfaceHit;
pub(crate) use texture_coordinates::textures_of;
pub(crate) use triangles::{BakeScene, Canonical, SceneTriangle};
pub(crate) use wanted_probes::WantedProbes;
