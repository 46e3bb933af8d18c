//! A transmissive surface: how much light passes through it, and how it is refracted and absorbed. What is
//! visible through it is drawn by the effect `refraction`.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use lumbre_optics::Material;
use lumbre_scene::{Medium, RefractiveShape};

use super::camera::Window;
use crate::layout::{coefficient, finite};

/// The optical properties from an object's material and medium.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Refractor {
    /// k_r.
    mirror: Vec3,
    /// k_t.
    transmission: Vec3,
    /// Index of refraction.
    ior: f32,
    /// σ, per metre.
    absorption: Vec3,
    /// A sheet without an interior.
    pub thin: bool,
    /// Whether Fresnel's equations split k_t into reflected and transmitted light.
    fresnel: bool,
}

impl Refractor {
    /// Returns true if more than half of the light passes, averaged over the channels.
    pub fn lets_most_pass(&self) -> bool {
        self.transmission.element_sum() > 1.5
    }

    /// Creates it from the components of an object.
    pub fn new(material: &Material, medium: Option<&Medium>) -> Self {
        let medium = medium.copied().unwrap_or_default();
        let ior = if material.ior.is_finite() && material.ior > 0.0 { material.ior } else { 1.0 };
        Self {
            mirror: coefficient(material.mirror),
            transmission: coefficient(material.transmission),
            ior,
            absorption: finite(medium.absorption().as_vec3()).max(Vec3::ZERO),
            thin: medium.thin,
            fresnel: medium.fresnel,
        }
    }
}

/// A transmissive surface of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RefractorSurface {
    /// Slot of its object.
    pub slot: usize,
    /// How light passes through it.
    pub shape: RefractiveShape,
    /// Its transform mirrors, so its triangles have the opposite winding.
    pub mirrored: bool,
    /// Number of triangles of its mesh.
    pub triangles: usize,
    /// A part of the frame that contains it.
    pub window: Window,
    pub data: RefractorData,
}

/// `Refractor` of shaders/refraction.wesl.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct RefractorData {
    mirror: Vec3,
    ior: f32,
    transmission: Vec3,
    flags: u32,
    absorption: Vec3,
    size: f32,
    background: Vec3,
    padding: f32,
}

impl RefractorData {
    const FRESNEL: u32 = 1;
    const PARALLEL: u32 = 2;

    /// Creates the data of an object with a bounding sphere of this radius in metres. `parallel` is true for a
    /// viewer at infinity; `background` is the background's radiance.
    pub fn new(refractor: &Refractor, radius: f64, parallel: bool, background: Vec3) -> Self {
        let flags = [(refractor.fresnel, Self::FRESNEL), (parallel, Self::PARALLEL)];
        Self {
            mirror: refractor.mirror,
            ior: refractor.ior,
            transmission: refractor.transmission,
            flags: flags.iter().map(|(on, flag)| if *on { *flag } else { 0 }).sum(),
            absorption: refractor.absorption,
            size: 2.0 * radius as f32,
            background,
            padding: 0.0,
        }
    }
}
