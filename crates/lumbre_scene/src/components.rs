//! What an entity can be, beside the lights and materials of `lumbre_optics`: a mesh, a camera, a lightmapped surface.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::TriangleMesh;

use crate::{Image, LightmapImage, TextureReference, Transform};

/// The geometry of an entity. Entities that share the `Arc` share the GPU's copy.
/// To change a mesh, put another `Arc` in its place.
#[derive(Component, Clone, Debug)]
#[require(Transform, lumbre_optics::Material)]
pub struct Mesh(pub Arc<TriangleMesh>);

impl From<TriangleMesh> for Mesh {
    fn from(mesh: TriangleMesh) -> Self {
        Self(Arc::new(mesh))
    }
}

/// Textures that modulate an entity's `Material`. An entity without this component has none, and no texture code runs for it.
#[derive(Component, Clone, Debug, Default, PartialEq)]
pub struct MaterialTextures {
    /// Multiplies ambient, diffuse and alpha (sRGB).
    pub base_color: Option<TextureReference>,
    /// Multiplies emission (sRGB).
    pub emissive: Option<TextureReference>,
    /// Green is roughness, blue is metallic (linear); present only for glTF materials without Phong coefficients.
    pub metallic_roughness: Option<MetallicRoughnessTexture>,
    /// Turns the normal of every fragment under Phong shading (linear).
    pub normal: Option<NormalTexture>,
    /// Weakens indirect light: ambient terms and lightmaps (red, linear).
    pub occlusion: Option<OcclusionTexture>,
}

impl MaterialTextures {
    /// How many textures a material may have.
    pub const SLOTS: usize = 5;

    /// Its textures: base colour, emissive, metallic-roughness, normal, occlusion.
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

    /// Which of its slots are filled: bit i for slot i.
    pub fn slot_mask(&self) -> u8 {
        mask(self.slots().map(|slot| slot.is_some()))
    }

    /// Which of its slots read the second set of texture coordinates: bit i for slot i.
    pub fn second_set_mask(&self) -> u8 {
        mask(self.slots().map(|slot| slot.is_some_and(|texture| texture.tex_coord != 0)))
    }

    /// The textures that there are.
    pub fn references(&self) -> impl Iterator<Item = &TextureReference> {
        self.slots().into_iter().flatten()
    }

    /// The textures that there are, to be changed.
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

/// Bit i for truth i.
fn mask(bits: [bool; MaterialTextures::SLOTS]) -> u8 {
    (0..).zip(bits).map(|(place, bit)| u8::from(bit) << place).sum()
}

/// A tangent-space normal map: red points along the mesh's tangents, green against v, blue along the normal (glTF's convention).
///
/// A mesh that has no tangents gets those of MikkTSpace when it is first drawn, over the coordinates that the texture reads.
#[derive(Clone, Debug, PartialEq)]
pub struct NormalTexture {
    /// The texture.
    pub texture: TextureReference,
    /// Factor of red and green after decoding; any number that is finite.
    pub scale: f32,
}

/// How much of the indirect light reaches each texel, in red.
#[derive(Clone, Debug, PartialEq)]
pub struct OcclusionTexture {
    /// The texture.
    pub texture: TextureReference,
    /// 0 for no occlusion, 1 for all of it.
    pub strength: f32,
}

/// A metallic-roughness texture with the factors that the per-texel mapping to Phong needs.
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
    /// k_s where nothing is metal: .04, unless a file states an index of refraction or a specular colour.
    pub dielectric: glam::Vec3,
}

/// An entity whose indirect (and static direct) light comes from a baked texture through the mesh's `uv1`.
#[derive(Component, Clone, Debug)]
pub struct Lightmap {
    /// E/π per texel, shared by the entities of one map.
    pub image: Arc<LightmapImage>,
}

/// The light of an entity's [`Lightmap`] in two maps of the same size and coordinates, which add up to it within the rounding of numbers. A baker makes
/// it on request; saving writes both beside the map, as `<map>.direct.exr` and `<map>.bounced.exr`, which no file names. Frames do not read it.
///
/// Where seams were closed or values carried past a border, both follow in the proportion of their light there.
#[derive(Component, Clone, Debug)]
pub struct SeparateLight {
    /// What arrives straight from lamps, shining surfaces and the sky. E/π.
    pub direct: Arc<LightmapImage>,
    /// What arrives by bounces. E/π.
    pub bounced: Arc<LightmapImage>,
}

/// Says that an entity never moves: the baker lights it. Set by the importer on every mesh that is not under a
/// [`DynamicObject`].
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StaticObject;

/// An entity that moves in the game: the baker leaves it (and what hangs below it) out.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DynamicObject;

/// Texels along one metre of an entity's lightmap, relative to the rest of the scene: a positive finite factor, 1 without it. What is looked at closely
/// gets more, what nobody comes near gets less. Read by the baker; primitives that share a map get the largest.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
pub struct LightmapScale(pub f64);

/// Asks that an entity's emissive faces light other objects in real time: each becomes a polygon light. Without it emission adds a
/// colour and lights nothing in a frame (in the baker it always does).
///
/// The front shines with the front's emission; the back only if the material is double-sided and its back is a surface of its own,
/// as in the baker. Faces shine evenly: an emissive texture is averaged over each. Alpha does not weaken them. An emitter does not
/// light itself.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EmissiveLight;

impl EmissiveLight {
    /// Radiance of the front and the back of faces of this material without its texture, W/(m² sr). Channels that are negative or hold
    /// no number are 0; none is above 10³⁰.
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

/// Hides the mesh of an entity, and those of all that hangs from it. Lights shine on, but for glowing faces that are hidden.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Hidden;

/// The `extras` of a glTF node: data of the application, kept from import to export.
#[derive(Component, Clone, Debug, PartialEq)]
pub struct Extras(pub serde_json::Value);

/// One primitive of a glTF mesh; a child of the node's entity. On export the primitives of a node become one mesh again.
#[derive(Component, Clone, Debug, PartialEq, Eq)]
pub struct Primitive {
    /// Place in the mesh's list of primitives.
    pub index: usize,
    /// Name of the glTF mesh, or the node's.
    pub mesh: Arc<str>,
    /// Name of the glTF material, empty without one.
    pub material: Arc<str>,
}

/// The lens of a camera; it looks along its entity's -Z with +Y up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// A pinhole.
    Perspective {
        /// Vertical field of view in radians, in (0, π).
        vertical_fov: f64,
        /// Width by height as the file gave it, kept for export: a frame has its target's.
        aspect: Option<f64>,
        /// Near plane in metres, greater than 0. There is no far plane (reversed-Z, infinite); `far` is kept for export only.
        near: f64,
        /// Far distance as the file gave it, if it did.
        far: Option<f64>,
    },
    /// Parallel rays.
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
    /// A pinhole with a vertical field of view in radians, in (0, π), and a near plane at 1 cm.
    pub fn perspective(vertical_fov: f64) -> Self {
        Self::Perspective { vertical_fov, aspect: None, near: 0.01, far: None }
    }

    /// Parallel rays onto a frame of twice these half sides in metres, from the camera to `far` metres before it.
    pub fn orthographic(half_width: f64, half_height: f64, far: f64) -> Self {
        Self::Orthographic { half_width, half_height, near: 0.0, far }
    }
}

/// A camera.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
#[require(Transform)]
pub struct Camera {
    /// The lens.
    pub projection: Projection,
    /// Factor from radiance to display values, greater than 0.
    pub exposure: f32,
}

impl Default for Camera {
    fn default() -> Self {
        let projection = Projection::Perspective { vertical_fov: 0.9, aspect: None, near: 0.05, far: None };
        Self { projection, exposure: 1.0 }
    }
}

/// The camera that frames are drawn from, if there are several. The first one otherwise.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ActiveCamera;

/// An axis-aligned box in the world, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest corner.
    pub min: DVec3,
    /// Largest corner.
    pub max: DVec3,
}

impl Bounds {
    /// Holds nothing; grows from here.
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// Grows to hold a point; points that are not finite are ignored.
    pub fn include(&mut self, point: DVec3) {
        if point.is_finite() {
            self.min = self.min.min(point);
            self.max = self.max.max(point);
        }
    }

    /// Whether it holds nothing.
    pub fn is_empty(&self) -> bool {
        !(self.min.cmple(self.max).all())
    }

    /// Its middle; the origin if it is empty.
    pub fn center(&self) -> DVec3 {
        if self.is_empty() { DVec3::ZERO } else { 0.5 * self.min + 0.5 * self.max }
    }

    /// Half its diagonal in metres; 0 if it is empty.
    pub fn radius(&self) -> f64 {
        if self.is_empty() { 0.0 } else { 0.5 * (self.max - self.min).length() }
    }
}

/// An image that several components may share.
pub type SharedImage = Arc<Image>;
