//! The scene model of Lumbre: ECS components, the transform hierarchy, glTF import and export, and the census
//! of effects that a scene uses. It contains no GPU code and no lighting equations.
//!
//! ```text
//!  .glb, .gltf ──► load ──► World ──► save ──► .glb, .gltf (+ .bin, lightmaps as .exr, .ktx2)
//!                             │
//!         node: Name, Transform, GlobalTransform, [Light], [Camera], [Extras],
//!               [IrradianceVolume]
//!           ├─ primitive: Mesh, Material, Primitive, [MaterialTextures], [Lightmap], [Shading],
//!           │             StaticObject or DynamicObject
//!           └─ node below ...
//!                             │
//!                             ├──► propagate_transforms ──► GlobalTransform
//!                             ├──► scene_bounds, default_camera
//!                             └──► Census: which effects the scene uses, and which it does not
//! ```
//!
//! Loading validates the whole file before it changes the World. An invalid file gives a [`LoadError`] that
//! names the offending place; anything that was repaired or skipped is reported as a [`Note`].
//!
//! ```
//! use bevy_ecs::prelude::*;
//! use lumbre_scene::{Census, Light, Name, Transform, load_slice, save, update_transforms};
//!
//! let mut world = World::new();
//! world.spawn((Name::new("lamp"), Transform::from_xyz(0.0, 2.5, 0.0), Light::point(glam::Vec3::ONE)));
//! let path = std::env::temp_dir().join("lumbre_scene_example.glb");
//! save(&mut world, &path)?;
//!
//! let mut again = World::new();
//! let report = load_slice(&mut again, &std::fs::read(&path)?, "example.glb", None)?;
//! assert_eq!(report.nodes.len(), 1);
//! assert_eq!(Census::of(&mut again).lights.point_lights, 1);
//! # update_transforms(&mut again);
//! # std::fs::remove_file(path)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bounds;
mod census;
mod components;
mod default_camera;
mod default_light;
mod frame_settings;
mod gltf;
mod hidden_cone;
mod image;
mod lightmap_encoding;
mod lightmap_files;
mod medium;
mod quadric;
mod quadric_mesh;
mod reduced_lightmaps;
mod settings;
mod transform;
mod visibility;
mod volume_place;

pub use bevy_ecs::hierarchy::{ChildOf, Children};
pub use bevy_ecs::name::Name;
pub use bounds::scene_bounds;
pub use census::{
    Census, CensusLine, LightCensus, Mobility, ObjectCensus, ObjectComponents, ObjectItem, ObjectTraits,
    RefractiveShape, light_place, planar_mirror, shines, shown_objects,
};
pub use components::{
    ActiveCamera, Bounds, Camera, DynamicObject, EmissiveLight, Extras, Hidden, Lightmap, LightmapScale,
    MaterialTextures, Mesh, MetallicRoughnessTexture, NormalTexture, OcclusionTexture, Primitive, Projection,
    SeparateLight, SharedImage, StaticObject,
};
pub use default_camera::default_camera;
pub use default_light::{add_default_light, is_without_light};
pub use frame_settings::{FrameSettings, ShadowFilter};
pub use gltf::{
    FileSettings, LightmapFile, LoadError, LoadLimits, LoadOptions, LoadProblem, LoadReport, Note,
    SUPPORTED_EXTENSIONS, SaveError, SaveOptions, SaveReport, SourceFile, load, load_slice,
    load_slice_within, load_with, save, save_baked, save_settings, save_with,
};
pub use hidden_cone::{HiddenCone, hidden_cones};
pub use image::{Image, LightmapImage, Mipmap, Sampler, TextureReference, Wrap};
pub use lightmap_encoding::LightmapEncoding;
pub use lightmap_files::{
    AmbientCube, EncodingError, IrradianceVolume, Ktx2Error, Ktx2Texture, LightmapFileError, PackedFormat,
    Supercompression, lightmap_to_ktx2, lightmap_to_open_exr,
};
pub use lumbre_optics::{Light, Material, Shading};
pub use medium::Medium;
pub use quadric::{Quadric, QuadricError, QuadricShape};
pub use quadric_mesh::QuadricMesh;
pub use reduced_lightmaps::reduce_lightmaps;
pub use settings::SceneSettings;
pub use transform::{GlobalTransform, Transform, propagate_transforms, update_transforms};
pub use visibility::{hidden_entities, shown_lightmaps, with_descendants};
pub use volume_place::{IrradianceVolumeError, VolumePlace, nearest_volume, usable_irradiance_volumes};
