//! Tests of the patches of a floor that a wall stands on or that something lies on, and of patches with textures.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use lumbre_mesh::TriangleMesh;
use lumbre_optics::Material;
use lumbre_scene::{Image, MaterialTextures, MetallicRoughnessTexture, TextureReference};

use super::form_factor_tests::{patches_of, scene, square};
use super::patch_index::PatchIndex;
use super::patches::Patches;
use crate::sampling::{Sequence, Stream, triangle_point};
use crate::scene::{BakeScene, Side};

/// Checks that the patches cover all surfaces, that each point of a patch is found in it, and that no patch of the
/// floor (the first object) lies on both sides of a contact line; `side_of_line` returns different numbers for the
/// sides.
fn check(objects: &[&[[Vec3; 3]]], side: f32, side_of_line: impl Fn(Vec3) -> u32) {
    let scene = scene(objects);
    let patches = patches_of(&scene, side);
    assert_eq!(Some(patches.list.len() as u64), Patches::count(&scene, &patches.subdivision, u64::MAX));
    let area: f32 = patches.list.iter().map(|patch| patch.area).sum();
    let expected: f32 = scene.triangles.iter().map(|triangle| triangle.area).sum();
    assert!((area / expected - 1.0).abs() < 1e-5, "{area} {expected}");
    let side_of_line = |position: Vec3| side_of_line(scene.space.world(position).as_vec3());
    // Area of the floor that lies beyond a line which crosses its patch.
    let mut crossed = 0.0;
    for (index, patch) in PatchIndex::all(patches.list.len()).zip(&patches.list) {
        let sequence = Sequence::new(1, Stream::Test(2), index.0);
        let mut sides = Vec::new();
        for sample in 0..64 {
            let [x, y, ..] = sequence.point(sample, 0);
            // Away from the patch's edges, where the result depends on rounding.
            let (u, v) = triangle_point(x, y);
            let (u, v) = (0.02 + 0.94 * u, 0.02 + 0.94 * v);
            let at = patches.point_in_triangle(patch, (u, v));
            assert_eq!(patches.at(patch.triangle, patch.side, at), Some(index), "{patch:?} {at:?}");
            sides.push(side_of_line(scene.triangles[patch.triangle as usize].position(at.0, at.1)));
        }
        if patch.triangle < 2 && patch.side == Side::Front {
            let same = sides.iter().filter(|&&side| side == sides[0]).count();
            crossed += patch.area * same.min(sides.len() - same) as f32 / sides.len() as f32;
        }
    }
    // Pieces smaller than 1/256 of a cell are not cut off.
    assert!(crossed < 0.001 * expected, "{crossed} of {expected} in patches on both sides");
}

#[test]
fn no_patch_lies_on_both_sides_of_a_wall() {
    let floor = square([0.0; 3], Vec3::Z * 2.0, Vec3::X * 2.0);
    for x in [0.3, 0.731, 1.9] {
        let wall = square([x, 0.0, 0.0], Vec3::Z * 2.0, Vec3::Y);
        check(&[&floor, &wall], 0.4, |p| u32::from(p.x > x));
        // The wall may also pass through the floor.
        let sunk = square([x, -0.5, 0.0], Vec3::Z * 2.0, Vec3::Y);
        check(&[&floor, &sunk], 0.4, |p| u32::from(p.x > x));
    }
}

#[test]
fn no_patch_lies_partly_under_an_object() {
    let floor = square([0.0; 3], Vec3::Z * 2.0, Vec3::X * 2.0);
    // A sheet a little above the floor.
    let sheet = square([0.35, 0.01, 0.45], Vec3::X, Vec3::Z);
    let is_under = |p: Vec3| p.y < 0.005 && (0.35..1.35).contains(&p.x) && (0.45..1.45).contains(&p.z);
    check(&[&floor, &sheet], 0.4, |p| u32::from(is_under(p)));
}

/// A square of two triangles with a texture of 64 x 64 texels that is white where `is_white` returns true, and black
/// elsewhere.
fn textured(is_white: impl Fn(u32, u32) -> bool) -> BakeScene {
    let mut scene = scene(&[&square([0.0; 3], Vec3::Z * 2.0, Vec3::X * 2.0)]);
    let rgba = (0..64 * 64).flat_map(|at| [if is_white(at % 64, at / 64) { 255 } else { 0 }; 4]).collect();
    let texture =
        TextureReference::new(Arc::new(Image { name: "texture".into(), width: 64, height: 64, rgba }));
    let surface = &mut scene.surfaces[0];
    surface.material = Material::matt(Vec3::splat(0.8));
    surface.textures = Some(MaterialTextures { base_color: Some(texture), ..MaterialTextures::default() });
    let place = |corner: &Vec3| Vec2::new(corner.x, corner.z) / 2.0;
    let uv0 = surface.mesh.positions.iter().map(place).collect();
    surface.mesh = Arc::new(TriangleMesh { uv0, ..(*surface.mesh).clone() });
    scene
}

#[test]
fn a_patch_reflects_the_mean_of_its_texels() {
    // Sides that give one patch per triangle, and then several. The spots and stripes are missed by an average of a few
    // points only.
    let spots = |x: u32, y: u32| (28..32).contains(&x) && (3..7).contains(&y);
    let stripes = |x: u32, _: u32| x.is_multiple_of(8);
    let checker = |x: u32, y: u32| (x + y).is_multiple_of(2);
    let check = |is_white: &dyn Fn(u32, u32) -> bool, side: f32| {
        let scene = textured(is_white);
        let patches = patches_of(&scene, side * scene.space.scale as f32);
        let white = (0..64 * 64).filter(|at| is_white(at % 64, at / 64)).count() as f64 / (64.0 * 64.0);
        let mean = patches.mean_reflectance();
        assert!((mean / (0.8 * white) - 1.0).abs() < 0.02, "{} patches: {mean} {white}", patches.list.len());
        patches
    };
    for side in [2.0, 0.5, 0.1] {
        for is_white in [&spots as &dyn Fn(u32, u32) -> bool, &stripes, &checker] {
            let patches = check(is_white, side);
            assert!(patches.warnings.is_empty(), "{:?}", patches.warnings);
        }
    }
}

#[test]
fn a_patch_that_shows_too_many_texels_is_named() {
    // A triangle shows 91 texels along its diagonal for each repetition of the texture. Points for half of them are
    // enough, and there may be 64.
    for (scale, expected) in [(1.0, false), (2.0, true)] {
        let mut scene = textured(|x, _| x.is_multiple_of(8));
        let textures = scene.surfaces[0].textures.as_mut().expect("a textured surface");
        textures.base_color.as_mut().expect("a base colour").scale = Vec2::splat(scale);
        let patches = patches_of(&scene, 2.0 * scene.space.scale as f32);
        let warns = patches.warnings.iter().any(|warning| warning.contains("texels of its textures"));
        assert_eq!(warns, expected, "{:?}", patches.warnings);
    }
}

#[test]
fn two_textures_that_vary_together_are_averaged_as_their_product() {
    // Metal exactly where the base colour is white: no point reflects diffusely, though the product of the means is 0.2.
    let is_white = |x: u32, y: u32| (x / 16 + y / 16).is_multiple_of(2);
    for side in [2.0, 0.5] {
        let mut scene = textured(is_white);
        let textures = scene.surfaces[0].textures.as_mut().expect("a textured surface");
        let texture = textures.base_color.clone().expect("a base colour");
        let base_color = Vec3::splat(0.8);
        textures.metallic_roughness = Some(MetallicRoughnessTexture {
            texture,
            base_color,
            metallic: 1.0,
            roughness: 1.0,
            dielectric: Vec3::splat(0.04),
        });
        let patches = patches_of(&scene, side * scene.space.scale as f32);
        let mean = patches.mean_reflectance();
        // Where the two meet, bilinear filtering leaves a line of partly metallic texels.
        assert!(mean < 0.04, "{} patches: {mean}", patches.list.len());
    }
}
