//! Hashes of everything that a bake's result depends on. They show whether a scene has to be baked again and which of
//! its objects have changed, and they keep a checkpoint from being resumed by another bake. What the result does not
//! depend on is left out, such as cameras, specular reflection and the number of threads.
//!
//! Options, lights and materials are hashed as their debugging text, in which every number can be read back exactly, with
//! what does not matter set to a default: a field that is added to them counts until it is set to a default here. Other
//! structures are destructured without `..`, so that whoever adds a field has to decide here whether the bake reads it.

use std::collections::HashMap;
use std::fmt;
use std::sync::Arc;

use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre_mesh::TriangleMesh;
use lumbre_optics::{AlphaMode, Light, Material, Surface};
use lumbre_scene::{Image, MaterialTextures, MetallicRoughnessTexture, TextureReference};
use serde::{Deserialize, Serialize};

use crate::bounds::Bounds;
use crate::scene::{PlacedLight, PlacedPrimitive, SceneObject, StaticScene, from_world};
use crate::{BakeError, BakeOptions};

/// The version of the baker: that of the crate, and a hash of its sources and of the crates that influence a baked
/// file.
pub(crate) const BAKER: &str = concat!(env!("CARGO_PKG_VERSION"), "+", env!("LUMBRE_BAKE_SOURCES"));

/// A BLAKE3 hash of a bake's input, or of a part of it. It is displayed as 64 hexadecimal digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct ContentHash([u8; 32]);

impl ContentHash {
    /// The bytes of the hash.
    pub fn bytes(&self) -> &[u8; 32] {
        &self.0
    }

    /// Combines this hash with that of something else which the result was made from.
    pub(crate) fn made_from(&self, other: &Self) -> Self {
        Self(*blake3::Hasher::new().update(&self.0).update(&other.0).finalize().as_bytes())
    }
}

impl fmt::Display for ContentHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

/// Computes the hash of everything that a [`Bake`](crate::Bake) of this World with these options depends on, so that a
/// level whose hash has not changed need not be baked again.
///
/// It covers the baker's version, the options, static meshes with their transforms, the diffuse reflection, emission
/// and opacity of their materials with the pixels of their textures, the baked lights, and the sky, all in the order in
/// which they are baked. If probes are baked, it also covers the bounding box of moving objects, and which emissive
/// meshes are lights in real time. Baking a World does not change its hash, since the original meshes are hashed, not
/// the unwrapped ones.
///
/// Equal hashes mean bit-identical bakes, unless [`BakeOptions::time`] cuts a bake short: the time limit and the number
/// of threads are not hashed. The World is not changed, except that global transforms are updated.
///
/// # Errors
/// The same [`BakeError`] as a bake, for an option out of range or an invalid mesh.
pub fn content_hash(world: &mut World, options: &BakeOptions) -> Result<ContentHash, BakeError> {
    options.check()?;
    Ok(hashes_of(&from_world(world).0.checked()?, options).content)
}

/// The hash of a bake's whole input, and of parts of it that are compared with a previous bake.
#[derive(Clone, Debug)]
pub(crate) struct Hashes {
    /// Hash of everything.
    pub content: ContentHash,
    /// Hash of each object, including its transform.
    pub objects: Vec<ContentHash>,
    /// Hash of all lights and the sky.
    pub lights: ContentHash,
    /// Hash of the options that a texel's samples depend on.
    pub sampling: ContentHash,
}

/// Computes all hashes of a checked scene.
pub(crate) fn hashes_of(input: &StaticScene, options: &BakeOptions) -> Hashes {
    // Moving objects are hashed below, and only if probes are baked.
    let StaticScene { objects, lights, sky, moving: _ } = input;
    let mut images = Images::default();
    let object_hashes: Vec<ContentHash> =
        objects.iter().map(|object| object_hash(object, &mut images)).collect();
    let light_hashes: Vec<ContentHash> = lights.iter().map(light_hash).collect();
    let mut hasher = Hasher::new("lights");
    hasher.hashes(&light_hashes);
    hasher.color(sky);
    let all_lights = hasher.finish();
    let mut hasher = Hasher::new("sampling");
    // Options that do not influence samples are set to their defaults.
    let default = BakeOptions::default();
    hasher.options(BakeOptions {
        atlas_size: default.atlas_size,
        seams: default.seams,
        resolution_error: default.resolution_error,
        probes: default.probes,
        probe_spacing: default.probe_spacing,
        separate_light: default.separate_light,
        memory: default.memory,
        ..*options
    });
    let sampling = hasher.finish();

    let mut hasher = Hasher::new("lumbre bake");
    hasher.options(*options);
    hasher.number(objects.len() as u64);
    for hash in &object_hashes {
        hasher.hashes(&[*hash]);
    }
    // Which objects share a mesh is hashed, because they also share its unwrap.
    let mut mesh_numbers: HashMap<*const TriangleMesh, u64> = HashMap::new();
    for primitive in input.primitives() {
        let next = mesh_numbers.len() as u64;
        hasher.number(*mesh_numbers.entry(Arc::as_ptr(&primitive.mesh)).or_insert(next));
    }
    hasher.hashes(&light_hashes);
    hasher.color(sky);
    let probes = input.calls_for_probes(options).is_ok();
    hasher.number(probes.into());
    if probes {
        // The box around moving objects determines the grid of probes.
        let finite = input.moving_points().iter().copied().filter(|point| point.is_finite());
        let Bounds::<DVec3> { low, high } = finite.collect();
        hasher.doubles(&[low.to_array(), high.to_array()].concat());
        hasher.number(input.primitives().count() as u64);
        input.primitives().for_each(|primitive| hasher.number(primitive.lights_frames.into()));
    }
    Hashes { content: hasher.finish(), objects: object_hashes, lights: all_lights, sampling }
}

/// The hash of an object, including its transform.
fn object_hash(object: &SceneObject, images: &mut Images) -> ContentHash {
    let mut hasher = Hasher::new("object");
    // The name counts because the object's map is named after it.
    let SceneObject { name, primitives, lightmap_scale } = object;
    hasher.bytes(name.as_bytes());
    hasher.doubles(&[*lightmap_scale]);
    hasher.number(primitives.len() as u64);
    for primitive in primitives {
        // `lights_frames` concerns only the probes and is hashed with them.
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
    // Disabled lights are not in the list. Specular and ambient terms and shadow maps are used only in real time.
    let unused = Vec3::ZERO;
    let baked = Light { ambient: unused, specular: unused, enabled: true, shadow: false, ..light.clone() };
    let mut hasher = Hasher::new("light");
    hasher.text(&baked);
    hasher.doubles(&position.to_array());
    hasher.doubles(&axis.to_array());
    hasher.finish()
}

/// Hashes of images, each computed once however many textures use it.
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

/// Writes values into a hash such that different inputs give different bytes: every list is preceded by its length,
/// every option by whether it is present, every enum by the number of its variant.
struct Hasher(blake3::Hasher);

impl Hasher {
    /// A hasher of inputs of this kind, which also hashes the baker's version.
    fn new(kind: &str) -> Self {
        let mut hasher = Self(blake3::Hasher::new());
        hasher.bytes(kind.as_bytes());
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
        self.words(values.len(), values.iter().map(|value| value.to_le_bytes()));
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

    fn vectors<const N: usize>(&mut self, vectors: impl ExactSizeIterator<Item = [f32; N]>) {
        self.words(vectors.len(), vectors.flatten().map(f32::to_le_bytes));
    }

    /// Whether there is a value, and if so, what `hash` writes of it.
    fn option<T>(&mut self, value: Option<&T>, hash: impl FnOnce(&mut Self, &T)) {
        self.number(value.is_some().into());
        if let Some(value) = value {
            hash(self, value);
        }
    }

    /// A list of `count` items, each of one or more words. Words are collected into blocks, as BLAKE3 is fast only on
    /// long inputs.
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

    /// The debugging text of a value.
    fn text(&mut self, value: &impl fmt::Debug) {
        self.bytes(format!("{value:?}").as_bytes());
    }

    fn options(&mut self, options: BakeOptions) {
        // The result does not depend on the number of threads, nor on the time limit unless it cuts the bake short.
        // `resolution_error` does not change the map, but the report, which is stored with the map.
        self.text(&BakeOptions { threads: None, time: None, ..options });
    }

    fn mesh(&mut self, mesh: &TriangleMesh) {
        // The bake does not use normal maps, and so no tangents.
        let TriangleMesh { positions, normals, tangents: _, uv0, uv1, colors, indices } = mesh;
        self.vectors(positions.iter().map(|v| v.to_array()));
        self.vectors(normals.iter().map(|v| v.to_array()));
        self.vectors(uv0.iter().map(|v| v.to_array()));
        self.vectors(uv1.iter().map(|v| v.to_array()));
        self.vectors(colors.iter().map(|v| v.to_array()));
        self.words(indices.len(), indices.iter().map(|index| index.to_le_bytes()));
    }

    fn material(&mut self, material: &Material) {
        // Diffuse reflection, emission and opacity are baked; specular reflection, mirrors and refraction are not.
        let unused = Material::default();
        let surface = |surface: &Surface| Surface {
            ambient: unused.front.ambient,
            specular: unused.front.specular,
            shininess: unused.front.shininess,
            ..*surface
        };
        self.text(&Material {
            front: surface(&material.front),
            back: material.back.as_ref().map(surface),
            // Opaque materials ignore their alpha.
            alpha: if material.alpha_mode == AlphaMode::Opaque { unused.alpha } else { material.alpha },
            mirror: unused.mirror,
            transmission: unused.transmission,
            ior: unused.ior,
            lobe: unused.lobe,
            distribution: unused.distribution,
            fresnel: unused.fresnel,
            ..material.clone()
        });
    }

    fn textures(&mut self, textures: &MaterialTextures, images: &mut Images) {
        // The bake ignores normal and occlusion maps, as a lightmap holds the light on the geometric surface:
        // docs/decisions.md says why.
        let MaterialTextures { base_color, emissive, metallic_roughness, normal: _, occlusion: _ } = textures;
        for texture in [base_color, emissive] {
            self.option(texture.as_ref(), |hasher, texture| hasher.texture(texture, images));
        }
        self.option(metallic_roughness.as_ref(), |hasher, metallic_roughness| {
            let MetallicRoughnessTexture { texture, base_color, metallic, roughness: _, dielectric: _ } =
                metallic_roughness;
            hasher.texture(texture, images);
            hasher.color(base_color);
            hasher.floats(&[*metallic]);
        });
    }

    fn texture(&mut self, texture: &TextureReference, images: &mut Images) {
        let TextureReference { image, sampler, tex_coord, offset, rotation, scale } = texture;
        let hash = images.hash(image);
        self.hashes(&[hash]);
        // The baker always filters bilinearly, so only the sampler's wrap modes count.
        self.text(&(sampler.wrap_u, sampler.wrap_v, tex_coord));
        self.floats(&[offset.x, offset.y, *rotation, scale.x, scale.y]);
    }
}
