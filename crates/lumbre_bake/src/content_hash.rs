//! Hashes of everything that a bake's result depends on. They show whether a scene has to be baked again and which of
//! its objects have changed, and they keep a checkpoint from being resumed by another bake. What the result does not
//! depend on is left out, such as cameras, the highlights of dielectrics and the number of threads.
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
use crate::scene::{
    PlacedLight, PlacedPrimitive, SceneObject, StaticScene, from_world, reflectance_as_metal,
};
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
/// It covers the baker's version, the options, static meshes with their transforms, the diffuse reflection, the
/// highlights of metals, emission and opacity of their materials with the pixels of their textures, the baked lights,
/// and the sky, all in the order in which they are baked. If probes are baked, it also covers the bounding box of moving objects, and which emissive
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
    // The result does not depend on the number of threads, nor on the time limit unless it cuts the bake short.
    // `resolution_error` does not change the map, but the report, which is stored with the map.
    let options = BakeOptions { threads: None, time: None, ..*options };
    let mut images = Images::default();
    let object_hashes: Vec<ContentHash> =
        objects.iter().map(|object| object_hash(object, &mut images)).collect();
    let light_hashes: Vec<ContentHash> = lights.iter().map(light_hash).collect();
    // Options that do not influence samples are set to their defaults.
    let default = BakeOptions::default();
    let sampling = BakeOptions {
        atlas_size: default.atlas_size,
        seams: default.seams,
        resolution_error: default.resolution_error,
        probes: default.probes,
        probe_spacing: default.probe_spacing,
        separate_light: default.separate_light,
        memory: default.memory,
        ..options
    };
    // Which objects share a mesh is hashed, because they also share its unwrap.
    let mut numbers: HashMap<*const TriangleMesh, usize> = HashMap::new();
    let mut number = |primitive: &PlacedPrimitive| {
        let next = numbers.len();
        *numbers.entry(Arc::as_ptr(&primitive.mesh)).or_insert(next)
    };
    let meshes: Vec<usize> = input.primitives().map(&mut number).collect();
    let probes = input.calls_for_probes(&options).is_ok().then(|| {
        // The box around moving objects determines the grid of probes.
        let finite = input.moving_points().iter().copied().filter(|point| point.is_finite());
        let lights_frames = input.primitives().map(|primitive| primitive.lights_frames);
        (finite.collect::<Bounds<DVec3>>(), lights_frames.collect::<Vec<bool>>())
    });
    Hashes {
        content: Hasher::new("lumbre bake").text(&(
            options,
            &object_hashes,
            meshes,
            &light_hashes,
            sky,
            probes,
        )),
        objects: object_hashes,
        lights: Hasher::new("lights").text(&(&light_hashes, sky)),
        sampling: Hasher::new("sampling").text(&sampling),
    }
}

/// The hash of an object, including its transform.
fn object_hash(object: &SceneObject, images: &mut Images) -> ContentHash {
    let mut hasher = Hasher::new("object");
    // The name counts because the object's map is named after it.
    let SceneObject { name, primitives, lightmap_scale } = object;
    for primitive in primitives {
        // `lights_frames` concerns only the probes and is hashed with them.
        let PlacedPrimitive { mesh, material, textures, transform, lights_frames: _ } = primitive;
        hasher.mesh(mesh);
        let textures =
            textures.as_ref().map(|textures| images.textures(textures, material.reflects_as_metal()));
        hasher.text(&(baked_part(material), textures.unwrap_or_default(), transform));
    }
    hasher.text(&(name, lightmap_scale, primitives.len()))
}

fn light_hash(placed: &PlacedLight) -> ContentHash {
    let PlacedLight { light, position, axis } = placed;
    // Disabled lights are not in the list. Specular and ambient terms and shadow maps are used only in real time.
    let unused = Vec3::ZERO;
    let baked = Light { ambient: unused, specular: unused, enabled: true, shadow: false, ..light.clone() };
    Hasher::new("light").text(&(baked, position, axis))
}

/// What is baked of a material: diffuse reflection, the highlight of a metal, emission and opacity, but neither mirrors
/// nor refraction.
fn baked_part(material: &Material) -> Material {
    let unused = Material::default();
    let surface = |surface: &Surface| {
        let is_metal = reflectance_as_metal(material, surface) != Vec3::ZERO;
        let highlight = if is_metal { surface } else { &unused.front };
        Surface {
            ambient: unused.front.ambient,
            specular: highlight.specular,
            shininess: highlight.shininess,
            ..*surface
        }
    };
    Material {
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
    }
}

/// Hashes of images, each computed once however many textures use it.
#[derive(Default)]
struct Images(HashMap<*const Image, ContentHash>);

impl Images {
    /// What is baked of a material's textures: normal and occlusion maps are ignored, as a lightmap holds the light on
    /// the geometric surface (docs/decisions.md says why).
    fn textures(&mut self, textures: &MaterialTextures, as_metal: bool) -> [Option<String>; 3] {
        let MaterialTextures { base_color, emissive, metallic_roughness, normal: _, occlusion: _ } = textures;
        let metallic_roughness = metallic_roughness.as_ref().map(|metallic_roughness| {
            let MetallicRoughnessTexture { texture, base_color, metallic, roughness, dielectric } =
                metallic_roughness;
            let of_metal = as_metal.then_some((roughness, dielectric));
            format!("{} {base_color:?} {metallic:?} {of_metal:?}", self.texture(texture))
        });
        let [base_color, emissive] =
            [base_color, emissive].map(|texture| texture.as_ref().map(|texture| self.texture(texture)));
        [base_color, emissive, metallic_roughness]
    }

    /// Everything of a texture that counts; of its sampler only the wrap modes, since the baker always filters
    /// bilinearly.
    fn texture(&mut self, texture: &TextureReference) -> String {
        let TextureReference { image, sampler, tex_coord, offset, rotation, scale } = texture;
        let wraps = (sampler.wrap_u, sampler.wrap_v);
        let hash = self.0.entry(Arc::as_ptr(image)).or_insert_with(|| {
            let Image { name: _, width, height, rgba } = &**image;
            let mut hasher = Hasher::new("image");
            hasher.bytes(rgba);
            hasher.text(&(width, height))
        });
        format!("{hash} {wraps:?} {tex_coord} {offset:?} {rotation:?} {scale:?}")
    }
}

/// Writes values into a hash such that different inputs give different bytes: every list is preceded by its length.
struct Hasher(blake3::Hasher);

impl Hasher {
    /// A hasher of inputs of this kind, which also hashes the baker's version.
    fn new(kind: &str) -> Self {
        let mut hasher = Self(blake3::Hasher::new());
        hasher.text(&(kind, BAKER));
        hasher
    }

    /// Adds the debugging text of a value, and returns the hash of everything so far.
    fn text(&mut self, value: &impl fmt::Debug) -> ContentHash {
        self.bytes(format!("{value:?}").as_bytes());
        ContentHash(*self.0.finalize().as_bytes())
    }

    fn bytes(&mut self, bytes: &[u8]) {
        self.0.update(&(bytes.len() as u64).to_le_bytes());
        self.0.update(bytes);
    }

    fn mesh(&mut self, mesh: &TriangleMesh) {
        // The bake does not use normal maps, and so no tangents.
        let TriangleMesh { positions, normals, tangents: _, uv0, uv1, colors, indices } = mesh;
        self.vectors(positions.iter().map(|v| v.to_array()));
        self.vectors(normals.iter().map(|v| v.to_array()));
        self.vectors(uv0.iter().map(|v| v.to_array()));
        self.vectors(uv1.iter().map(|v| v.to_array()));
        self.vectors(colors.iter().map(|v| v.to_array()));
        self.words(indices.iter().map(|index| index.to_le_bytes()));
    }

    fn vectors<const N: usize>(&mut self, vectors: impl Iterator<Item = [f32; N]>) {
        self.words(vectors.flatten().map(f32::to_le_bytes));
    }

    /// A list of words, all at once, as BLAKE3 is fast only on long inputs.
    fn words(&mut self, words: impl Iterator<Item = [u8; 4]>) {
        self.bytes(&words.flatten().collect::<Vec<u8>>());
    }
}
