//! Extracts the World for the GPU: only what changed since the last frame. What is drawn of it is decided in
//! `draws`.

mod camera;
mod emissive_faces;
mod emitters;
mod entity_slots;
mod light_reach;
mod light_records;
mod lights;
mod lit_pass;
mod objects;
mod planar_mirror;
mod refractor;
mod shown_light;

pub(crate) use camera::{CameraView, ViewVolume, Window, find_camera};
pub(crate) use emitters::Emitters;
#[cfg(test)]
pub(crate) use light_reach::PolygonReach;
pub(crate) use light_reach::{ConeReach, LightClass, LightReach};
pub(crate) use light_records::LightRecords;
pub(crate) use lights::{
    KnownLights, Lamp, LightCounts, LightPlace, LightSet, SceneLights, UNIFORM_LIGHTS, extract_lights,
};
pub(crate) use lit_pass::LitPass;
pub(crate) use objects::{Object, Objects, Reflectance, world_box};
pub(crate) use planar_mirror::{MirrorData, MirrorSurface};
pub(crate) use refractor::{RefractorData, RefractorSurface};
