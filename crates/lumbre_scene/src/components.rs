//! Components of scene entities: meshes, textures, cameras, baked light and markers. Lights and materials are
//! in `lumbre_optics`.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::TriangleMesh;

use crate::{Image, LightmapImage, TextureReference, Transform};

/// The geometry of an entity. Entities that share the `Arc` also share the GPU buffers. To change a mesh,
/// replace the `Arc`.
#[derive(Component, Clone, Debug)]
#[require(Transform, lumbre_optics::Material)]
pub struct Mesh(pub Arc<TriangleMesh>);

impl From<TriangleMesh> for Mesh {
    fn from(mesh: TriangleMesh) -> Self {
        Self(Arc::new(mesh))
    }
}

/// Textures that modulate an entity's `Material`. An entity without this component is untextured and uses a
/// shader variant without texture code.
#[derive(Component, Clone, Debug, Default, PartialEq)]
pub struct MaterialTextures {
    /// Multiplies ambient, diffuse and alpha (sRGB).
    pub base_color: Option<TextureReference>,
    /// Multiplies emission (sRGB).
    pub emissive: Option<TextureReference>,
    /// Green is roughness, blue is metallic (linear). Present only for glTF materials without Phong
    /// coefficients.
    pub metallic_roughness: Option<MetallicRoughnessTexture>,
    /// Perturbs the normal per fragment under Phong shading (linear).
    pub normal: Option<NormalTexture>,
    /// Attenuates indirect light: ambient terms and lightmaps (red, linear).
    pub occlusion: Option<OcclusionTexture>,
}

impl MaterialTextures {
    /// Number of texture slots of a material.
    pub const SLOTS: usize = 5;

    /// The textures in slot order: base colour, emissive, metallic-roughness, normal, occlusion.
    pub fn slots(&self) -> [Option<&TextureReference>; Self::SLOTS] {
        let Self { base_color, emissive, metallic_roughness, normal, occlusion } = self;
        [
            base_color.as_ref(),
            emissive.as_ref(),
            metallic_roughness.as_ref().map(|mapped| &mapped.texture),
            normal.as_ref().map(|normal| &normal.texture),
            occlusion.as_ref().map(|occlusion| &occlusion.texture),
        ]
    }

    /// A bit mask of the filled slots: bit i for slot i.
    pub fn slot_mask(&self) -> u8 {
        mask(self.slots().map(|slot| slot.is_some()))
    }

    /// A bit mask of the slots that read the second set of texture coordinates: bit i for slot i.
    pub fn second_set_mask(&self) -> u8 {
        mask(self.slots().map(|slot| slot.is_some_and(|texture| texture.tex_coord != 0)))
    }

    /// The textures of all filled slots, in slot order.
    pub fn references(&self) -> impl Iterator<Item = &TextureReference> {
        self.slots().into_iter().flatten()
    }

    /// Mutable references to the textures of all filled slots, in slot order.
    pub fn references_mut(&mut self) -> impl Iterator<Item = &mut TextureReference> {
        let Self { base_color, emissive, metallic_roughness, normal, occlusion } = self;
        let slots = [
            base_color.as_mut(),
            emissive.as_mut(),
            metallic_roughness.as_mut().map(|mapped| &mut mapped.texture),
            normal.as_mut().map(|normal| &mut normal.texture),
            occlusion.as_mut().map(|occlusion| &mut occlusion.texture),
        ];
        slots.into_iter().flatten()
    }
}

/// Packs the flags into a bit mask: bit i for flag i.
fn mask(bits: [bool; MaterialTextures::SLOTS]) -> u8 {
    (0..).zip(bits).map(|(place, bit)| u8::from(bit) << place).sum()
}

/// A tangent-space normal map: red points along the mesh's tangents, green against v, blue along the normal
/// (glTF's convention).
///
/// A mesh without tangents gets MikkTSpace tangents when it is first drawn, computed from the texture
/// coordinates that the texture reads.
#[derive(Clone, Debug, PartialEq)]
pub struct NormalTexture {
    /// The texture.
    pub texture: TextureReference,
    /// Factor of red and green after decoding; any finite number.
    pub scale: f32,
}

/// An occlusion map: red is the fraction of the indirect light that reaches the texel.
#[derive(Clone, Debug, PartialEq)]
pub struct OcclusionTexture {
    /// The texture.
    pub texture: TextureReference,
    /// How strongly the map applies: 0 ignores it, 1 applies it fully.
    pub strength: f32,
}

/// A metallic-roughness texture, with the factors needed to convert each texel to Phong coefficients.
#[derive(Clone, Debug, PartialEq)]
pub struct MetallicRoughnessTexture {
    /// The texture.
    pub texture: TextureReference,
    /// Base colour factor, linear RGB.
    pub base_color: glam::Vec3,
    /// Factor of the blue channel, [0, 1].
    pub metallic: f32,
    /// Factor of the green channel, [0, 1].
    pub roughness: f32,
    /// Specular coefficient k_s of the non-metallic part: 0.04, unless the file gives an index of refraction
    /// or a specular colour.
    pub dielectric: glam::Vec3,
}

/// Baked light of an entity, read through the mesh's `uv1`: the indirect light and the direct light of static
/// lights.
#[derive(Component, Clone, Debug)]
pub struct Lightmap {
    /// E/π per texel. Entities that share one map share the `Arc`.
    pub image: Arc<LightmapImage>,
}

/// The light of an entity's [`Lightmap`] split into two maps of the same size and coordinates, whose sum is
/// the lightmap up to rounding. The baker makes it on request. Saving writes both next to the lightmap, as
/// `<map>.direct.exr` and `<map>.bounced.exr`; the glTF file does not refer to them, and rendering does not
/// read them.
///
/// Where the baker closed seams or padded chart borders, the corrected light is split in the ratio of the two
/// parts at that texel.
#[derive(Component, Clone, Debug)]
pub struct SeparateLight {
    /// Light that arrives directly from lights, emissive surfaces and the sky, as E/π.
    pub direct: Arc<LightmapImage>,
    /// Light that arrives after at least one bounce, as E/π.
    pub bounced: Arc<LightmapImage>,
}

/// Marks an entity that never moves, so that the baker includes it and lights it unless it is unlit. The
/// importer sets it on every mesh that is not below a [`DynamicObject`].
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StaticObject;

/// Marks an entity that moves at run time. The baker leaves it and its descendants out.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DynamicObject;

/// Lightmap texels per metre of this entity relative to the rest of the scene: a positive finite factor, 1
/// without this component. Use larger values for surfaces that are seen up close and smaller ones for those
/// that are not. Read by the baker; primitives that share a map use the largest of their factors.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
pub struct LightmapScale(pub f64);

/// Makes an entity's emissive faces light other objects in real time: each face becomes a polygon light.
/// Without it, emission only adds to the surface's own colour in a frame; the baker always treats emissive
/// surfaces as light sources.
///
/// The front emits the front's emission. The back emits only if the material is double-sided and has a back
/// material, as in the baker. Radiance is constant over a face: an emissive texture is averaged over it.
/// Alpha does not reduce the emitted light, and an emitter does not light itself.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EmissiveLight;

impl EmissiveLight {
    /// Radiance of the front and the back of faces with this material, without its emissive texture, in W/(m²
    /// sr). Negative and NaN channels become 0, larger ones are clamped to 10³⁰. An unlit material emits
    /// nothing.
    pub fn radiance(material: &lumbre_optics::Material) -> [Vec3; 2] {
        let back = material.back.as_ref().filter(|_| material.double_sided);
        let clean = |color: Vec3| {
            let channel = |value: f32| {
                if value > 0.0 { value.min(lumbre_optics::LARGEST_INTENSITY as f32) } else { 0.0 }
            };
            Vec3::new(channel(color.x), channel(color.y), channel(color.z))
        };
        let emission = [material.front.emission, back.map_or(Vec3::ZERO, |back| back.emission)];
        if material.unlit { [Vec3::ZERO; 2] } else { emission.map(clean) }
    }
}

/// Hides the meshes of an entity and of all its descendants. Lights below it stay on, except for hidden
/// meshes with [`EmissiveLight`].
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Hidden;

/// The `extras` of a glTF node: application data that is kept from import to export.
#[derive(Component, Clone, Debug, PartialEq)]
pub struct Extras(pub serde_json::Value);

/// One primitive of a glTF mesh, as a child of the node's entity. Export merges the primitives of a node into
/// one mesh again.
#[derive(Component, Clone, Debug, PartialEq, Eq)]
pub struct Primitive {
    /// Index in the mesh's list of primitives.
    pub index: usize,
    /// Name of the glTF mesh, or of the node if the mesh has none.
    pub mesh: Arc<str>,
    /// Name of the glTF material; empty if it has none.
    pub material: Arc<str>,
}

/// The projection of a camera, which looks along its entity's -Z with +Y up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// A perspective (pinhole) projection.
    Perspective {
        /// Vertical field of view in radians, in (0, π).
        vertical_fov: f64,
        /// Aspect ratio (width / height) from the file, kept for export only: frames use the aspect of their
        /// target.
        aspect: Option<f64>,
        /// Near plane in metres, greater than 0. Frames have no far plane (infinite reversed-Z); `far` is
        /// kept for export only.
        near: f64,
        /// Far plane in metres from the file, if it states one.
        far: Option<f64>,
    },
    /// An orthographic projection.
    Orthographic {
        /// Half width in metres.
        half_width: f64,
        /// Half height in metres.
        half_height: f64,
        /// Near plane in metres.
        near: f64,
        /// Far plane in metres.
        far: f64,
    },
}

impl Projection {
    /// A perspective projection with a vertical field of view in radians, in (0, π), and the near plane at 1
    /// cm.
    pub fn perspective(vertical_fov: f64) -> Self {
        Self::Perspective { vertical_fov, aspect: None, near: 0.01, far: None }
    }

    /// An orthographic projection with these half extents in metres, from the camera to a far plane at `far`
    /// metres.
    pub fn orthographic(half_width: f64, half_height: f64, far: f64) -> Self {
        Self::Orthographic { half_width, half_height, near: 0.0, far }
    }
}

/// A camera: a projection and an exposure.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
#[require(Transform)]
pub struct Camera {
    /// The projection.
    pub projection: Projection,
    /// Exposure: the factor from radiance to display values, greater than 0.
    pub exposure: f32,
}

impl Default for Camera {
    fn default() -> Self {
        let projection = Projection::Perspective { vertical_fov: 0.9, aspect: None, near: 0.05, far: None };
        Self { projection, exposure: 1.0 }
    }
}

/// Marks the camera that frames are drawn from if there are several. Without it, the first camera is used.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ActiveCamera;

/// An axis-aligned bounding box in world space, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Minimum corner.
    pub min: DVec3,
    /// Maximum corner.
    pub max: DVec3,
}

impl Bounds {
    /// The empty box, to be grown with [`include`](Self::include).
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// Grows the box to contain a point. Points that are not finite are ignored.
    pub fn include(&mut self, point: DVec3) {
        if point.is_finite() {
            self.min = self.min.min(point);
            self.max = self.max.max(point);
        }
    }

    /// Returns true if the box contains no point.
    pub fn is_empty(&self) -> bool {
        !(self.min.cmple(self.max).all())
    }

    /// The centre; the origin if the box is empty.
    pub fn center(&self) -> DVec3 {
        if self.is_empty() { DVec3::ZERO } else { 0.5 * self.min + 0.5 * self.max }
    }

    /// Half the diagonal in metres; 0 if the box is empty.
    pub fn radius(&self) -> f64 {
        if self.is_empty() { 0.0 } else { 0.5 * (self.max - self.min).length() }
    }
}

/// An image that several components may share.
pub type SharedImage = Arc<Image>;
