//! From the light of covered texels to finished maps: gaps filled, seams closed, pages composed, the map's own resolution measured. Not the light.

pub(crate) mod baked_scene;
pub(crate) mod fill;
pub(crate) mod finished_maps;
pub(crate) mod pages;
pub(crate) mod resolution_error;
pub(crate) mod seams;
pub(crate) mod separate_light;
pub(crate) mod worst_places;
