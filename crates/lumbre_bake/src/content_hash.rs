//! One number for everything that a bake depends on, so that an unchanged scene need not be baked again and no checkpoint of another
//! bake is continued. Not what it does not depend on: cameras, highlights, threads; of what moves only the room it takes, for the probes.
//!
//! Everything is taken apart field by field, without `..`: whoever adds a field decides here whether the bake reads it.

use std::collections::HashMap;
use std::fmt;
use std::sync::Arc;

use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre_mesh::TriangleMesh;
use lumbre_optics::{AlphaMode, Attenuation, BakeMode, Light, LightKind, Material, SpotCone, Surface};
use lumbre_scene::{Image, MaterialTextures, MetallicRoughnessTexture, TextureReference, Wrap};
use serde::{Deserialize, Serialize};

use crate::scene::{PlacedLight, PlacedPrimitive, SceneObject, StaticScene, from_world};
use crate::{BakeError, BakeOptions, Density};

/// The version of the crate, and a hash of its sources and those of the crates whose work goes into a baked file.
pub(crate) const BAKER: &str = concat!(env!("CARGO_PKG_VERSION"), "+", env!("LUMBRE_BAKE_SOURCES"));

/// A BLAKE3 hash of a bake's input; 64 hexadecimal digits when displayed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct ContentHash([u8; 32]);

impl ContentHash {
    /// Its bytes.
    pub fn bytes(&self) -> &[u8; 32] {
        &self.0
    }

    /// The hash of what this stands for, made from what `other` stands for.
    pub(crate) fn made_from(&self, other: &Self) -> Self {
        Self(*blake3::Hasher::new().update(&self.0).update(&other.0).finalize().as_bytes())
    }
}

impl fmt::Display for ContentHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

/// The hash of everything that a [`Bake`](crate::Bake) reads of a world and its options, and of the baker itself: static meshes in their
/// places, what their materials reflect, emit and let through with the pixels of their textures, the lights that are baked and the sky, all in
/// the order in which they are baked; and where probes are called for, the box around what moves and which faces shine in real time. A bake does not
/// change it: the coordinates that it gives to meshes do not count.
///
/// Equal hashes mean equal bits, unless [`BakeOptions::time`] cuts a bake short: the hash leaves it out, like the number of threads.
/// Only global transforms of the world are brought up to date.
///
/// # Errors
/// [`BakeError`] as of a bake: an option out of its range, or a mesh that cannot be read.
pub fn content_hash(world: &mut World, options: &BakeOptions) -> Result<ContentHash, BakeError> {
    options.check()?;
    Ok(hashes_of(&from_world(world).0.checked()?, options).content)
}

/// The hash of everything, and those of its parts.
#[derive(Clone, Debug)]
pub(crate) struct Hashes {
    pub content: ContentHash,
    /// Of each object in its place.
    pub objects: Vec<ContentHash>,
    /// Of all lights and the sky.
    pub lights: ContentHash,
    /// Of the options that a texel's samples depend on, and of the baker.
    pub sampling: ContentHash,
}

/// The hashes of what was collected already.
pub(crate) fn hashes_of(input: &StaticScene, options: &BakeOptions) -> Hashes {
    // What moves counts only where probes are called for.
    let StaticScene { objects, lights, sky, moving: _ } = input;
    let mut images = Images::default();
    let object_hashes: Vec<ContentHash> =
        objects.iter().map(|object| object_hash(object, &mut images)).collect();
    let light_hashes: Vec<ContentHash> = lights.iter().map(light_hash).collect();
    let mut hasher = Hasher::new("lights");
    hasher.hashes(&light_hashes);
    hasher.color(sky);
    let of_lights = hasher.finish();
    let mut hasher = Hasher::new("sampling");
    let of_samples = BakeOptions::default();
    hasher.options(&BakeOptions {
        atlas_size: of_samples.atlas_size,
        seams: of_samples.seams,
        resolution_error: of_samples.resolution_error,
        probes: of_samples.probes,
        probe_spacing: of_samples.probe_spacing,
        separate_light: of_samples.separate_light,
        memory: of_samples.memory,
        ..*options
    });
    let sampling = hasher.finish();
    let mut hasher = Hasher::new("lumbre bake");
    hasher.options(options);
    hasher.number(objects.len() as u64);
    for hash in &object_hashes {
        hasher.hashes(&[*hash]);
    }
    // Objects that share their meshes share their unwrap.
    let mut numbers: HashMap<*const TriangleMesh, u64> = HashMap::new();
    for part in objects.iter().flat_map(|object| &object.primitives) {
        let next = numbers.len() as u64;
        hasher.number(*numbers.entry(Arc::as_ptr(&part.mesh)).or_insert(next));
    }
    hasher.hashes(&light_hashes);
    hasher.color(sky);
    let probes = input.calls_for_probes(options).is_ok();
    hasher.number(probes.into());
    if probes {
        // Of what moves, the place of the probes' grid.
        let (low, high) = bounds(input.moving_points());
        hasher.doubles(&[low.to_array(), high.to_array()].concat());
        // In the order of the parts, whose lengths are hashed with their objects.
        hasher.number(input.primitives().count() as u64);
        input.primitives().for_each(|part| hasher.number(part.lights_frames.into()));
    }
    Hashes { content: hasher.finish(), objects: object_hashes, lights: of_lights, sampling }
}

/// Corners of the box around points; infinite and turned inside out if there is nothing.
fn bounds(points: &[DVec3]) -> (DVec3, DVec3) {
    let finite = points.iter().filter(|point| point.is_finite());
    finite
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), &point| (low.min(point), high.max(point)))
}

/// The hash of an object in its place.
fn object_hash(object: &SceneObject, images: &mut Images) -> ContentHash {
    let mut hasher = Hasher::new("object");
    // The map is named after the object.
    let SceneObject { name, primitives, lightmap_scale } = object;
    hasher.bytes(name.as_bytes());
    hasher.doubles(&[*lightmap_scale]);
    hasher.number(primitives.len() as u64);
    for primitive in primitives {
        // What lights frames counts with the probes, which it concerns.
        let PlacedPrimitive { mesh, material, textures, transform, lights_frames: _ } = primitive;
        hasher.mesh(mesh);
        hasher.material(material);
        hasher.textures(textures.as_ref().unwrap_or(&MaterialTextures::default()), images);
        hasher.doubles(&transform.to_cols_array());
    }
    hasher.finish()
}

fn light_hash(placed: &PlacedLight) -> ContentHash {
    let PlacedLight { light, position, axis } = placed;
    // Lights that are off are not baked at all; highlights, ambient terms and shadow maps are the frame's.
    let Light {
        kind,
        ambient: _,
        diffuse,
        specular: _,
        attenuation,
        spot,
        enabled: _,
        shadow: _,
        bake,
        radius,
        angle,
    } = light;
    let Attenuation { constant, linear, quadratic, clamp, range } = *attenuation;
    let mut hasher = Hasher::new("light");
    hasher.number(match kind {
        LightKind::Ambient => 0,
        LightKind::Directional => 1,
        LightKind::Point => 2,
    });
    hasher.number(match bake {
        BakeMode::Dynamic => 0,
        BakeMode::Mixed => 1,
        BakeMode::Static => 2,
    });
    hasher.color(diffuse);
    hasher.floats(&[constant, linear, quadratic, range, *radius, *angle]);
    hasher.number(clamp.into());
    match *spot {
        None => hasher.number(0),
        Some(SpotCone::Exponent { cutoff, exponent }) => {
            hasher.number(1);
            hasher.floats(&[cutoff, exponent]);
        }
        Some(SpotCone::Smooth { inner, outer }) => {
            hasher.number(2);
            hasher.floats(&[inner, outer]);
        }
    }
    for place in [position, axis] {
        let DVec3 { x, y, z } = *place;
        hasher.doubles(&[x, y, z]);
    }
    hasher.finish()
}

/// Hashes of pixels that were read already.
#[derive(Default)]
struct Images(HashMap<*const Image, ContentHash>);

impl Images {
    fn hash(&mut self, image: &Arc<Image>) -> ContentHash {
        *self.0.entry(Arc::as_ptr(image)).or_insert_with(|| {
            let Image { name: _, width, height, rgba } = &**image;
            let mut hasher = Hasher::new("image");
            hasher.number((*width).into());
            hasher.number((*height).into());
            hasher.bytes(rgba);
            hasher.finish()
        })
    }
}

/// Every list is preceded by its length, every choice by its number: different inputs are different bytes.
struct Hasher(blake3::Hasher);

impl Hasher {
    fn new(of: &str) -> Self {
        let mut hasher = Self(blake3::Hasher::new());
        hasher.bytes(of.as_bytes());
        hasher.bytes(BAKER.as_bytes());
        hasher
    }

    fn finish(&self) -> ContentHash {
        ContentHash(*self.0.finalize().as_bytes())
    }

    fn bytes(&mut self, bytes: &[u8]) {
        self.number(bytes.len() as u64);
        self.0.update(bytes);
    }

    fn number(&mut self, value: u64) {
        self.0.update(&value.to_le_bytes());
    }

    fn floats(&mut self, values: &[f32]) {
        self.list(values.len(), values.iter().copied());
    }

    fn doubles(&mut self, values: &[f64]) {
        self.number(values.len() as u64);
        values.iter().for_each(|value| self.number(value.to_bits()));
    }

    fn color(&mut self, color: &Vec3) {
        self.floats(&color.to_array());
    }

    fn hashes(&mut self, hashes: &[ContentHash]) {
        self.number(hashes.len() as u64);
        hashes.iter().for_each(|hash| {
            self.0.update(hash.bytes());
        });
    }

    /// `count` of something, each some floats.
    fn list(&mut self, count: usize, floats: impl Iterator<Item = f32>) {
        self.words(count, floats.map(f32::to_le_bytes));
    }

    /// In blocks: BLAKE3 is fast on long runs only.
    fn words(&mut self, count: usize, words: impl Iterator<Item = [u8; 4]>) {
        self.number(count as u64);
        let mut block = Vec::with_capacity(1 << 14);
        for word in words {
            block.extend_from_slice(&word);
            if block.len() >= 1 << 14 {
                self.0.update(&block);
                block.clear();
            }
        }
        self.0.update(&block);
    }

    fn options(&mut self, options: &BakeOptions) {
        // The bits are the same on any number of threads, and in any time that is enough.
        let BakeOptions {
            density,
            atlas_size,
            error,
            time: _,
            quality,
            patch_texels,
            gap,
            seed,
            threads: _,
            form_factors,
            solver,
            denoise,
            seams,
            resolution_error,
            probes,
            probe_spacing,
            separate_light,
            memory,
        } = options;
        match density {
            Density::Automatic => self.number(0),
            Density::TexelsPerMeter(density) => {
                self.number(1);
                self.doubles(&[*density]);
            }
            Density::MapSize(side) => {
                self.number(2);
                self.number((*side).into());
            }
        }
        self.doubles(&[*error]);
        self.number(*quality as u64);
        self.doubles(&[patch_texels.map_or(0.0, f64::from)]);
        self.number((*gap).into());
        self.number((*seed).into());
        self.number(*form_factors as u64);
        self.number(*solver as u64);
        self.number((*denoise).into());
        self.number(memory.unwrap_or(u64::MAX));
        self.number(atlas_size.map_or(0, u64::from));
        self.number((*seams).into());
        // Not in the map, but in the report that stands for it.
        self.number((*resolution_error).into());
        self.number(*probes as u64);
        self.doubles(&[probe_spacing.unwrap_or(0.0)]);
        self.number((*separate_light).into());
    }

    fn mesh(&mut self, mesh: &TriangleMesh) {
        // Normal maps bend no light of a bake, so that tangents do not matter.
        let TriangleMesh { positions, normals, tangents: _, uv0, uv1, colors, indices } = mesh;
        self.list(positions.len(), positions.iter().flat_map(|v| v.to_array()));
        self.list(normals.len(), normals.iter().flat_map(|v| v.to_array()));
        self.list(uv0.len(), uv0.iter().flat_map(|v| v.to_array()));
        self.list(uv1.len(), uv1.iter().flat_map(|v| v.to_array()));
        self.list(colors.len(), colors.iter().flat_map(|v| v.to_array()));
        self.words(indices.len(), indices.iter().map(|index| index.to_le_bytes()));
    }

    fn material(&mut self, material: &Material) {
        // Diffuse reflection, emission and coverage are baked; what shines, mirrors or refracts is not.
        let Material {
            front,
            back,
            alpha,
            alpha_mode,
            double_sided,
            unlit,
            mirror: _,
            transmission: _,
            ior: _,
            lobe: _,
            distribution: _,
            fresnel: _,
        } = material;
        self.surface(front);
        self.number(back.is_some().into());
        if let Some(back) = back {
            self.surface(back);
        }
        match *alpha_mode {
            // Alpha is ignored.
            AlphaMode::Opaque => self.number(0),
            AlphaMode::Mask { cutoff } => {
                self.number(1);
                self.floats(&[*alpha, cutoff]);
            }
            AlphaMode::Blend => {
                self.number(2);
                self.floats(&[*alpha]);
            }
        }
        self.number((*double_sided).into());
        self.number((*unlit).into());
    }

    fn surface(&mut self, surface: &Surface) {
        let Surface { ambient: _, diffuse, specular: _, emission, shininess: _ } = surface;
        self.color(diffuse);
        self.color(emission);
    }

    fn textures(&mut self, textures: &MaterialTextures, images: &mut Images) {
        // A lightmap holds the light on the surface as it was modelled: docs/decisions.md says why.
        let MaterialTextures { base_color, emissive, metallic_roughness, normal: _, occlusion: _ } = textures;
        for texture in [base_color, emissive] {
            self.number(texture.is_some().into());
            if let Some(texture) = texture {
                self.texture(texture, images);
            }
        }
        self.number(metallic_roughness.is_some().into());
        if let Some(MetallicRoughnessTexture { texture, base_color, metallic, roughness: _, dielectric: _ }) =
            metallic_roughness
        {
            self.texture(texture, images);
            self.color(base_color);
            self.floats(&[*metallic]);
        }
    }

    fn texture(&mut self, texture: &TextureReference, images: &mut Images) {
        let TextureReference { image, sampler, tex_coord, offset, rotation, scale } = texture;
        let hash = images.hash(image);
        self.hashes(&[hash]);
        // The baker always reads bilinearly: of the sampler only the wrapping counts.
        for wrap in [sampler.wrap_u, sampler.wrap_v] {
            self.number(match wrap {
                Wrap::Repeat => 0,
                Wrap::MirroredRepeat => 1,
                Wrap::ClampToEdge => 2,
            });
        }
        self.number((*tex_coord).into());
        self.floats(&[offset.x, offset.y, *rotation, scale.x, scale.y]);
    }
}
