//! A surface that light passes through: which part of it, how bent and how absorbed. Not what is seen through it: that is the effect `refraction`.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use lumbre_optics::Material;
use lumbre_scene::Medium;

use crate::layout::{coefficient, finite};

/// What its material and its medium say of it.
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
    /// A sheet without an inside.
    pub thin: bool,
    /// Fresnel's equations divide k_t.
    fresnel: bool,
}

impl Refractor {
    /// Whether more than half of the light passes, in the mean of the channels.
    pub fn lets_most_pass(&self) -> bool {
        self.transmission.element_sum() > 1.5
    }

    /// Of what these components say.
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

/// A surface of a frame that light passes through.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RefractorSurface {
    /// Of its object.
    pub slot: usize,
    /// A sheet without an inside.
    pub thin: bool,
    /// Its transform mirrors: its triangles wind the other way.
    pub mirrored: bool,
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
    const THIN: u32 = 1;
    const FRESNEL: u32 = 2;
    const PICTURED: u32 = 4;
    const PARALLEL: u32 = 8;
    const OPEN: u32 = 16;

    /// Of a body in a bounding sphere of this radius, in metres, or a flat surface; before this background, for a viewer who may be infinitely far.
    pub fn new(refractor: &Refractor, (radius, flat): (f64, bool), parallel: bool, background: Vec3) -> Self {
        let flags = [
            (refractor.thin, Self::THIN),
            (refractor.fresnel, Self::FRESNEL),
            (parallel, Self::PARALLEL),
            (flat, Self::OPEN),
        ];
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

    /// The same of a flat surface whose mirror image has a picture of its own.
    pub fn pictured(self) -> Self {
        Self { flags: self.flags | Self::PICTURED, ..self }
    }
}
