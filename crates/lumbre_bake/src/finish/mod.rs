//! From the light of the covered texels to finished maps: gaps are filled, seams closed and pages composed, and the
//! error of the map's resolution is measured. Not the computation of the light.

pub(crate) mod baked_maps;
pub(crate) mod fill;
pub(crate) mod finished_maps;
pub(crate) mod pages;
pub(crate) mod resolution_error;
pub(crate) mod seams;
pub(crate) mod separate_light;
pub(crate) mod worst_places;

pub(crate) use baked_maps::{BakedMap, BakedObject, TexelErrors};
pub(crate) use finished_maps::FinishedMaps;
