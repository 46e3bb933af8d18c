//! The data that shaders read. Layout twins of shaders/frame.wesl and shaders/optics/evaluate_light.wesl,
//! field by field.

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, UVec3, Vec3, Vec4};
use lumbre_optics::{
    Attenuation, DEFAULT_IOR, Fresnel, LARGEST_COEFFICIENT, LARGEST_INTENSITY, Light, LightKind, Material,
    PolygonLight, SpotCone, SpotCosines, Surface,
};
use lumbre_scene::{GlobalTransform, MaterialTextures, TextureReference};

/// `Frame`.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct FrameData {
    pub clip_from_frame: [[f32; 4]; 4],
    pub eye: Vec3,
    pub exposure: f32,
    pub backward: Vec3,
    pub padding: f32,
    pub ambient: Vec3,
    pub padding_2: f32,
    pub fog_color: Vec3,
    pub padding_3: f32,
    pub fog_parameters: [f32; 4],
    pub corner: Vec3,
    pub parallel: f32,
    pub pixel_right: Vec3,
    pub padding_4: f32,
    pub pixel_down: Vec3,
    pub padding_5: f32,
}

/// `Instance`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct InstanceData {
    /// Index of the object; from bit 24 on the class of a deferred surface.
    object_and_class: u32,
    pub first_light: u32,
    pub dynamic_end: u32,
    pub static_end: u32,
}

impl InstanceData {
    /// Returns the same light list for an object (its slot, less than 2^24) and its class of deferred
    /// surfaces (0 for none).
    pub fn of_object(self, object: u32, class_number: u32) -> Self {
        Self { object_and_class: object | class_number << 24, ..self }
    }

    /// Creates a light list without an object. Its baked lights begin at `dynamic_end`.
    pub fn lit_by(first_light: u32, dynamic_end: u32, static_end: u32) -> Self {
        Self { object_and_class: 0, first_light, dynamic_end, static_end }
    }

    /// Returns the slot of the object.
    pub fn object(&self) -> u32 {
        self.object_and_class & 0xff_ffff
    }
}

/// `Object`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct ObjectData {
    pub rows: [[f32; 4]; 3],
    pub normals: [[f32; 4]; 3],
}

impl ObjectData {
    /// Subtracts `origin` in f64 before rounding to f32.
    pub fn new(transform: &GlobalTransform, origin: DVec3) -> Self {
        let matrix = transform.0.matrix3;
        let translation = transform.0.translation - origin;
        let row = |index: usize| {
            let row = matrix.row(index);
            [row.x as f32, row.y as f32, row.z as f32, translation[index] as f32]
        };
        // Only the direction of a normal matters. Scaling the matrix keeps very small and very large scales
        // within f32.
        let normal = transform.normal_matrix();
        let largest = normal.x_axis.abs().max(normal.y_axis.abs()).max(normal.z_axis.abs()).max_element();
        let factor = if largest > 0.0 && largest.is_finite() { 1.0 / largest } else { 0.0 };
        let column = |column: DVec3| (column * factor).as_vec3().extend(0.0).to_array();
        let mut normals = [column(normal.x_axis), column(normal.y_axis), column(normal.z_axis)];
        normals[0][3] = if transform.mirrors() { -1.0 } else { 1.0 };
        Self { rows: [row(0), row(1), row(2)], normals }
    }
}

/// Replaces channels that are not finite by 0, so that no frame contains NaN. This is for colours that were
/// created in code; files are checked when they are loaded.
pub(crate) fn finite(color: Vec3) -> Vec3 {
    let channel = |value: f32| if value.is_finite() { value } else { 0.0 };
    Vec3::new(channel(color.x), channel(color.y), channel(color.z))
}

/// Clamps a reflection coefficient or a vertex colour so that its products with light stay finite in f32.
/// Infinity times a cosine of 0 would be NaN.
pub(crate) fn coefficient(color: Vec3) -> Vec3 {
    finite(color).clamp(Vec3::splat(-LARGEST_COEFFICIENT), Vec3::splat(LARGEST_COEFFICIENT))
}

/// Clamps radiance that is added directly: emission, ambient light, background and fog.
pub(crate) fn radiance(color: Vec3) -> Vec3 {
    let largest = Vec3::splat(LARGEST_INTENSITY as f32);
    finite(color).clamp(-largest, largest)
}

/// `Side`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct SideData {
    ambient: Vec3,
    shininess: f32,
    diffuse: Vec3,
    alpha: f32,
    specular: Vec3,
    ior: f32,
    emission: Vec3,
    alpha_cutoff: f32,
}

impl SideData {
    fn new(surface: &Surface, material: &Material) -> Self {
        let alpha_cutoff = match material.alpha_mode {
            lumbre_optics::AlphaMode::Mask { cutoff } => cutoff,
            _ => 0.0,
        };
        Self {
            ambient: coefficient(surface.ambient),
            shininess: surface.shininess_in_range(),
            diffuse: coefficient(surface.diffuse),
            alpha: if material.alpha.is_finite() { material.alpha } else { 1.0 },
            specular: coefficient(surface.specular),
            ior: if material.ior.is_finite() { material.ior } else { DEFAULT_IOR as f32 },
            emission: radiance(surface.emission),
            alpha_cutoff,
        }
    }
}

/// `TextureCoordinates`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct CoordinatesData {
    u: [f32; 4],
    v: [f32; 4],
}

impl CoordinatesData {
    fn new(texture: Option<&TextureReference>) -> Self {
        let Some(texture) = texture else { return Self::default() };
        let [u, v] = texture.transform();
        Self { u: u.extend(texture.tex_coord as f32).to_array(), v: v.extend(0.0).to_array() }
    }

    /// Stores a number that its shader reads from `v.w`.
    fn with(mut self, number: f32) -> Self {
        self.v[3] = finite(Vec3::splat(number)).x.clamp(-LARGEST_COEFFICIENT, LARGEST_COEFFICIENT);
        self
    }
}

/// The 18 texels of a material. The constants after `coordinates_of` in shaders/frame.wesl name their
/// positions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct MaterialData {
    front: SideData,
    back: SideData,
    base_color: CoordinatesData,
    emissive: CoordinatesData,
    metallic_roughness: CoordinatesData,
    base_and_metallic: [f32; 4],
    roughness: [f32; 4],
    eta: [f32; 4],
    absorption: [f32; 4],
}

impl MaterialData {
    pub fn new(material: &Material, textures: Option<&MaterialTextures>) -> Self {
        let front = SideData::new(&material.front, material);
        let back = SideData::new(material.back.as_ref().unwrap_or(&material.front), material);
        let none = MaterialTextures::default();
        let textures = textures.unwrap_or(&none);
        let mapped = textures.metallic_roughness.as_ref();
        let (eta, absorption) = match material.fresnel {
            Fresnel::Conductor { eta, absorption } => (eta, absorption),
            Fresnel::Dielectric | Fresnel::NormalReflectance => (Vec3::ZERO, Vec3::ZERO),
        };
        Self {
            front,
            back,
            base_color: CoordinatesData::new(textures.base_color.as_ref()),
            emissive: CoordinatesData::new(textures.emissive.as_ref()),
            metallic_roughness: CoordinatesData::new(mapped.map(|mapped| &mapped.texture)),
            base_and_metallic: mapped.map_or([0.0; 4], |m| {
                coefficient(m.base_color).extend(finite(Vec3::splat(m.metallic)).x).to_array()
            }),
            roughness: mapped.map_or([0.0; 4], |m| {
                let dielectric = coefficient(m.dielectric);
                [finite(Vec3::X * m.roughness).x, dielectric.x, dielectric.y, dielectric.z]
            }),
            eta: finite(eta).extend(0.0).to_array(),
            absorption: finite(absorption).extend(0.0).to_array(),
        }
    }
}

/// `SurfaceMaps`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct SurfaceMapsData {
    normal_map: CoordinatesData,
    occlusion: CoordinatesData,
}

impl SurfaceMapsData {
    /// Creates the data of a material with a normal map or an occlusion texture; `None` if it has neither.
    pub fn new(textures: &MaterialTextures) -> Option<Self> {
        let (normal, occlusion) = (textures.normal.as_ref(), textures.occlusion.as_ref());
        (normal.is_some() || occlusion.is_some()).then(|| Self {
            normal_map: CoordinatesData::new(normal.map(|slot| &slot.texture))
                .with(normal.map_or(0.0, |slot| slot.scale)),
            occlusion: CoordinatesData::new(occlusion.map(|slot| &slot.texture))
                .with(occlusion.map_or(0.0, |slot| slot.strength)),
        })
    }
}

/// `LightParameters`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct LightData {
    ambient: Vec3,
    kind: u32,
    diffuse: Vec3,
    flags: u32,
    specular: Vec3,
    range: f32,
    position: Vec3,
    spot: u32,
    axis: Vec3,
    spot_outer: f32,
    attenuation: Vec3,
    spot_inner_or_exponent: f32,
}

impl LightData {
    /// Creates the record of a light in frame space, without a shadow.
    pub fn new(light: &Light, transform: &GlobalTransform, origin: DVec3) -> Self {
        let cone = light.spot.filter(|cone| !cone.is_everywhere());
        let cosines = cone.map(|cone| cone.cosines());
        Self {
            ambient: light.ambient,
            kind: match light.kind {
                LightKind::Ambient => 0,
                LightKind::Directional => 1,
                LightKind::Point => 2,
            },
            diffuse: light.diffuse,
            flags: u32::from(light.attenuation.clamp),
            specular: light.specular,
            range: light.attenuation.shader_range(),
            position: (transform.translation() - origin).as_vec3(),
            spot: match cone {
                None => 0,
                Some(SpotCone::Exponent { .. }) => 1,
                Some(SpotCone::Smooth { .. }) => 2,
            },
            axis: transform.forward().as_vec3(),
            spot_outer: cosines.map_or(0.0, |cosines: SpotCosines| cosines.outer as f32),
            attenuation: light.attenuation.coefficients(),
            spot_inner_or_exponent: cosines.map_or(0.0, |cosines| cosines.inner_or_exponent as f32),
        }
    }
}

impl LightData {
    /// Adds the flags of its shadow.
    pub fn with_shadow(self, shadow: u32) -> Self {
        Self { flags: self.flags | shadow, ..self }
    }

    /// Creates the record of a polygon light in frame space. Its edges are stored in the fields that
    /// other kinds use for axis and attenuation.
    pub fn polygon(light: &PolygonLight, origin: DVec3) -> Self {
        let radiance = finite(light.radiance.as_vec3());
        Self {
            kind: if light.triangle { 3 } else { 4 },
            diffuse: radiance,
            specular: radiance,
            position: (light.corner - origin).as_vec3(),
            axis: light.edge_u.as_vec3(),
            attenuation: light.edge_v.as_vec3(),
            ..Self::default()
        }
    }
}

/// `InverseSquareLight`: what a fragment needs of a light of one colour whose attenuation is the inverse
/// square within a range, with a smooth cone or without one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct InverseSquareLightData {
    position: Vec3,
    inverse_range_squared: f32,
    /// The colour divided by the quadratic coefficient.
    color: Vec3,
    /// The constant coefficient divided by the quadratic one, in m².
    constant: f32,
    /// The cone as `smooth_spot_factor` takes it.
    cone: Vec4,
}

impl InverseSquareLightData {
    /// A light that adds nothing.
    pub const BLACK: Self = Self {
        position: Vec3::ZERO,
        inverse_range_squared: 1.0,
        color: Vec3::ZERO,
        constant: 0.0,
        cone: Vec4::W,
    };

    /// Creates the record of a light in frame space.
    pub fn new(light: &Light, transform: &GlobalTransform, origin: DVec3) -> Self {
        let Attenuation { range, constant, quadratic, .. } = light.attenuation;
        let range = f64::from(range);
        Self {
            position: (transform.translation() - origin).as_vec3(),
            inverse_range_squared: (1.0 / (range * range)) as f32,
            color: light.diffuse / quadratic,
            constant: constant / quadratic,
            cone: light
                .spot
                .and_then(|cone| cone.cosines().smooth_cone_about(transform.forward()))
                .map_or(Vec4::W, |cone| cone.as_vec4()),
        }
    }
}

/// `ClusterGrid`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct ClusterGridData {
    /// Columns, rows and slices.
    pub size: UVec3,
    pub ranged_offsets: u32,
    pub tiles_per_pixel: f32,
    pub depth_scale: f32,
    pub depth_bias: f32,
    pub logarithmic: u32,
    pub first_baked_inverse_square: u32,
    pub first_baked_ranged: u32,
    pub shadowed_offsets: u32,
    pub first_baked_shadowed: u32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_those_of_the_shaders() {
        assert_eq!(size_of::<FrameData>(), 192);
        assert_eq!(size_of::<ObjectData>(), 96);
        assert_eq!(size_of::<MaterialData>(), 2 * 64 + 3 * 32 + 4 * 16);
        assert_eq!(size_of::<SurfaceMapsData>(), 2 * 32);
        assert_eq!(size_of::<LightData>(), 96);
        assert_eq!(size_of::<InverseSquareLightData>(), 48);
        assert_eq!(size_of::<ClusterGridData>(), 48);
    }
}
