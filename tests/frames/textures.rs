//! Textures: each texel appears where its coordinates say, decoded as its slot requires, and modulates only what it
//! should.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec2, DVec3, Vec2, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{
    Light, Material, ReflectionModel, Shading, Surface, SurfaceSample, evaluate_light, shade,
};
use lumbre_render::FrameOptions;
use lumbre_scene::{
    Camera, Image, MaterialTextures, Mesh, MetallicRoughnessTexture, Mipmap, Sampler, SceneSettings,
    TextureReference, Transform,
};
use lumbre_tests::compare::{Difference, compare};
use lumbre_tests::panes::{
    EYE, image, orthographic, pane, pane_of, perspective, pixel_point, pixel_uv, sharp, srgb, srgb_texel,
};

use crate::adapter::{draw, linear};

pub(crate) const SIZE: usize = 32;

/// Error of a decoded sRGB texel: decoding may be off by half an eight-bit code (the bound of the Direct3D
/// functional specification, which drivers keep), and the curve is steepest at white, 2.275: 0.5/255*2.275.
const DECODED: f64 = 4.5e-3;
/// Error of a colour of eight linear bits: f32 roundings of one or two products of numbers up to 1.
const EXACT: f64 = 5e-7;

/// Sixteen colours, no two of them similar, with all rows and columns different.
fn palette() -> Vec<[u8; 4]> {
    (0..16_u8).map(|i| [i * 17, 255 - (i % 4) * 80, (i / 4) * 80, 255]).collect()
}

fn nearest(texels: &[[u8; 4]], width: usize, uv: DVec2) -> [u8; 4] {
    let at = (uv - uv.floor()) * DVec2::new(width as f64, (texels.len() / width) as f64);
    texels[at.y as usize * width + at.x as usize]
}

/// Returns true if a coordinate is so near an edge between texels that f32 may be on the other side of it: 1e-4 of
/// a texel is hundreds of roundings.
fn on_an_edge(uv: DVec2, width: usize, height: usize) -> bool {
    let at = uv * DVec2::new(width as f64, height as f64);
    (at - at.round()).abs().min_element() < 1e-4
}

fn textured(textures: MaterialTextures, material: Material) -> World {
    let mut world = pane_of(material);
    let pane = world.query_filtered::<Entity, With<Mesh>>().single(&world).unwrap();
    world.entity_mut(pane).insert(textures);
    world
}

fn base_color(texture: TextureReference) -> MaterialTextures {
    MaterialTextures { base_color: Some(texture), ..MaterialTextures::default() }
}

/// Compares a frame with a side of [`SIZE`] pixels with what each pixel should show.
pub(crate) fn difference(
    world: &mut World,
    options: &FrameOptions,
    expected: impl Fn(usize, usize) -> Option<DVec3>,
) -> Difference {
    let (got, _) = draw(world, SIZE as u32, SIZE as u32, options);
    let got: Vec<_> = got.into_iter().map(Some).collect();
    let expected: Vec<_> = (0..SIZE * SIZE).map(|at| expected(at % SIZE, at / SIZE)).collect();
    let difference = compare(&got, &expected);
    assert!(difference.pixels > SIZE * SIZE / 2, "{} pixels are too few to compare", difference.pixels);
    difference
}

#[test]
fn texels_land_where_their_coordinates_say() {
    let texels = palette();
    let texture = sharp(&image(4, &texels));
    for camera in [orthographic(), perspective()] {
        let mut world = textured(base_color(texture.clone()), Material::matt(Vec3::ONE));
        let old = world.query_filtered::<Entity, With<Camera>>().single(&world).unwrap();
        world.entity_mut(old).insert(camera);
        let expected = |x, y| Some(srgb_texel(nearest(&texels, 4, pixel_uv(x, y, SIZE))));
        let right = difference(&mut world, &linear(), expected);
        assert!(right.largest < DECODED, "{right:?}");
        // Negative control: upside down or without decoding it is detected.
        let flipped = |x, y: usize| Some(srgb_texel(nearest(&texels, 4, pixel_uv(x, SIZE - 1 - y, SIZE))));
        assert!(difference(&mut world, &linear(), flipped).largest > 0.1);
        let raw = |x, y| {
            let texel = nearest(&texels, 4, pixel_uv(x, y, SIZE));
            Some(DVec3::new(texel[0].into(), texel[1].into(), texel[2].into()) / 255.0)
        };
        assert!(difference(&mut world, &linear(), raw).largest > 0.1);
    }
}

#[test]
fn coordinates_are_scaled_then_rotated_then_moved() {
    let texels = palette();
    let plain = sharp(&image(4, &texels));
    for (offset, rotation, scale) in [
        (Vec2::new(0.25, 0.5), 0.0, Vec2::ONE),
        (Vec2::ZERO, 0.4, Vec2::ONE),
        (Vec2::ZERO, 0.0, Vec2::new(2.0, -0.5)),
        (Vec2::new(0.1, 0.7), -2.5, Vec2::new(1.5, 0.75)),
    ] {
        let texture = TextureReference { offset, rotation, scale, ..plain.clone() };
        let mut world = textured(base_color(texture), Material::matt(Vec3::ONE));
        // KHR_texture_transform: translation * rotation * scale, with the rotation counter-clockwise on the screen,
        // where v increases downwards.
        let expected = |rotation: f64| {
            let texels = &texels;
            move |x, y| {
                let scaled = pixel_uv(x, y, SIZE) * scale.as_dvec2();
                let (sin, cos) = rotation.sin_cos();
                let rotated = DVec2::new(cos * scaled.x + sin * scaled.y, cos * scaled.y - sin * scaled.x);
                let uv = rotated + offset.as_dvec2();
                (!on_an_edge(uv, 4, 4)).then(|| srgb_texel(nearest(texels, 4, uv)))
            }
        };
        let right = difference(&mut world, &linear(), expected(f64::from(rotation)));
        assert!(right.largest < DECODED, "{offset} {rotation} {scale}: {right:?}");
        if rotation != 0.0 {
            let clockwise = difference(&mut world, &linear(), expected(-f64::from(rotation)));
            assert!(clockwise.largest > 0.1, "clockwise is told apart");
        }
    }
}

#[test]
fn a_texture_may_read_the_second_set_while_another_reads_the_first() {
    let texels = palette();
    let picture = image(4, &texels);
    let textures = MaterialTextures {
        base_color: Some(sharp(&picture)),
        emissive: Some(TextureReference { tex_coord: 1, ..sharp(&picture) }),
        ..MaterialTextures::default()
    };
    let front = Surface { emission: Vec3::new(0.5, 2.0, 1.0), ..Material::matt(Vec3::ONE).front };
    let mut world = textured(textures.clone(), Material { front, ..Material::default() });
    let mut mesh = pane();
    // The second set is the first, mirrored.
    mesh.uv1 = mesh.uv0.iter().map(|uv| Vec2::new(1.0 - uv.x, uv.y)).collect();
    let entity = world.query_filtered::<Entity, With<Mesh>>().single(&world).unwrap();
    world.entity_mut(entity).insert(Mesh(Arc::new(mesh)));
    let emission = front.emission.as_dvec3();
    let expected = |x: usize, y| {
        let mirrored = pixel_uv(SIZE - 1 - x, y, SIZE);
        let base = srgb_texel(nearest(&texels, 4, pixel_uv(x, y, SIZE)));
        Some(base + emission * srgb_texel(nearest(&texels, 4, mirrored)))
    };
    // A decoded base colour and a decoded emission of up to twice that.
    let both = difference(&mut world, &linear(), expected);
    assert!(both.largest < 3.0 * DECODED, "{both:?}");
    let swapped = |x: usize, y| expected(SIZE - 1 - x, y);
    assert!(difference(&mut world, &linear(), swapped).largest > 0.1);
    // Only the second set.
    let alone = MaterialTextures { base_color: None, ..textures };
    world.entity_mut(entity).insert(alone);
    let expected = |x: usize, y| {
        let mirrored = pixel_uv(SIZE - 1 - x, y, SIZE);
        Some(DVec3::ONE + emission * srgb_texel(nearest(&texels, 4, mirrored)))
    };
    assert!(difference(&mut world, &linear(), expected).largest < 3.0 * DECODED);
}

#[test]
fn an_emissive_texture_shows_whatever_the_light_and_the_shading() {
    let texels = palette();
    let textures =
        MaterialTextures { emissive: Some(sharp(&image(4, &texels))), ..MaterialTextures::default() };
    let front = Surface {
        ambient: Vec3::ZERO,
        diffuse: Vec3::ZERO,
        emission: Vec3::splat(0.75),
        ..Surface::default()
    };
    let mut world = textured(textures, Material { front, ..Material::default() });
    world.spawn((Light::directional(Vec3::ONE), Transform::IDENTITY));
    for shading in Shading::ALL {
        let options = FrameOptions { shading: Some(*shading), ..linear() };
        let expected = |x, y| Some(0.75 * srgb_texel(nearest(&texels, 4, pixel_uv(x, y, SIZE))));
        let found = difference(&mut world, &options, expected);
        assert!(found.largest < DECODED, "{}: {found:?}", shading.name());
    }
}

/// A lamp over the pane, near enough for the edge of its highlight to be inside the pane.
fn lamp() -> (Light, Transform) {
    (Light::point(Vec3::splat(3.0)), Transform::from_xyz(0.3, -0.2, 1.5))
}

#[test]
fn a_metallic_roughness_texture_is_the_material_of_each_texel() {
    // Red is not used; green is roughness and blue metalness, both linear.
    let texels = [[255, 128, 0, 255], [0, 255, 255, 255], [9, 60, 128, 255], [77, 200, 51, 255]];
    let base = Vec3::new(0.9, 0.5, 0.2);
    let (metallic, roughness) = (0.8, 0.9);
    let mapped = MetallicRoughnessTexture {
        texture: sharp(&image(2, &texels)),
        base_color: base,
        metallic,
        roughness,
        dielectric: Vec3::splat(0.04),
    };
    let mut textures = MaterialTextures { metallic_roughness: Some(mapped), ..MaterialTextures::default() };
    let base_texels = [[255, 255, 255, 255], [188, 188, 188, 255], [255, 128, 64, 255], [90, 255, 128, 255]];
    for with_base in [false, true] {
        textures.base_color = with_base.then(|| sharp(&image(2, &base_texels)));
        let mut world =
            textured(textures.clone(), Material::from_metallic_roughness(base, metallic, roughness));
        world.spawn(lamp());
        let (light, place) = lamp();
        let expected = |x, y| {
            let (uv, point) = (pixel_uv(x, y, SIZE), pixel_point(x, y, SIZE));
            let texel = nearest(&texels, 2, uv);
            let tint = if with_base { srgb_texel(nearest(&base_texels, 2, uv)) } else { DVec3::ONE };
            let material = Material::from_metallic_roughness(
                base * tint.as_vec3(),
                metallic * f32::from(texel[2]) / 255.0,
                roughness * f32::from(texel[1]) / 255.0,
            );
            let viewer = (DVec3::Z * EYE - point).normalize();
            let sample = evaluate_light(&light, place.translation, DVec3::NEG_Z, point);
            let surface = SurfaceSample::new(&material, true);
            Some(shade(ReflectionModel::Phong, surface, DVec3::ONE, [sample], DVec3::Z, viewer).total())
        };
        let found = difference(&mut world, &linear(), expected);
        // f32 throughout: the exponent, up to 1600 here, times the roundings of the cosine's logarithm. With the
        // base colour texture it is its decoding error times the light: 1 of ambient light, 3/1.5^2 of diffuse,
        // 3/1.5^2 of specular light.
        let bound = if with_base { DECODED * (1.0 + 2.0 * 3.0 / 2.25) } else { 1e-4 };
        assert!(found.largest < bound, "with base: {with_base}: {found:?}");
        // Negative control: the factors alone, without the texture, differ a lot.
        let plain = |x, y| {
            let point = pixel_point(x, y, SIZE);
            let material = Material::from_metallic_roughness(base, metallic, roughness);
            let viewer = (DVec3::Z * EYE - point).normalize();
            let sample = evaluate_light(&light, place.translation, DVec3::NEG_Z, point);
            let surface = SurfaceSample::new(&material, true);
            Some(shade(ReflectionModel::Phong, surface, DVec3::ONE, [sample], DVec3::Z, viewer).total())
        };
        assert!(difference(&mut world, &linear(), plain).largest > 0.1);
    }
}

#[test]
fn textures_modulate_ambient_and_diffuse_light_and_not_highlights() {
    let front = Surface {
        ambient: Vec3::splat(0.3),
        diffuse: Vec3::splat(0.6),
        specular: Vec3::splat(0.5),
        emission: Vec3::splat(0.05),
        shininess: 12.0,
    };
    for shading in Shading::ALL {
        let options = FrameOptions { shading: Some(*shading), ..linear() };
        let frame = |code: Option<u8>, front: Surface| {
            let textures = code.map_or_else(MaterialTextures::default, |code| {
                base_color(sharp(&image(1, &[[code, code, code, 255]])))
            });
            let mut world = textured(textures, Material { front, ..Material::default() });
            // Enough vertices for Gouraud shading to show a highlight.
            let entity = world.query_filtered::<Entity, With<Mesh>>().single(&world).unwrap();
            let upright = Transform::from_rotation(glam::DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2));
            world.entity_mut(entity).insert((Mesh(Arc::new(shapes::plane(2.0, 2.0, 8, 8))), upright));
            let (light, place) = lamp();
            world.spawn((Light { ambient: Vec3::splat(0.2), ..light }, place));
            draw(&mut world, SIZE as u32, SIZE as u32, &options).0
        };
        let none = Surface { ambient: Vec3::ZERO, diffuse: Vec3::ZERO, ..front };
        let (black, grey, white) = (frame(Some(0), front), frame(Some(188), front), frame(Some(255), front));
        let (plain, highlight) = (frame(None, front), frame(None, none));
        for at in 0..SIZE * SIZE {
            // Sums of numbers below 4, in another order.
            let near = |a: DVec3, b: DVec3, bound: f64| (a - b).abs().max_element() < bound;
            assert!(near(white[at], plain[at], 2e-6), "{}: white changes nothing", shading.name());
            assert!(
                near(black[at], highlight[at], 2e-6),
                "{}: black leaves highlight, emission",
                shading.name()
            );
            let mixed = highlight[at] + srgb(188) * (plain[at] - highlight[at]);
            assert!(near(grey[at], mixed, DECODED * 2.0), "{}: {} {mixed}", shading.name(), grey[at]);
        }
        // Negative control: if it were modulated too, the highlight would disappear with the black texture, and be
        // halved with the grey one.
        let brightest = highlight.iter().map(|pixel| pixel.x - 0.05).fold(0.0, f64::max);
        assert!(brightest > 0.2, "{}: the highlight of {brightest} is worth comparing", shading.name());
    }
}

#[test]
fn a_checkerboard_seen_from_afar_has_its_mean_radiance() {
    let side = 128;
    let texels: Vec<[u8; 4]> =
        (0..side * side).map(|at| [if (at % side + at / side) % 2 == 0 { 255 } else { 0 }; 4]).collect();
    let board: Arc<Image> = image(side, &texels.iter().map(|t| [t[0], t[1], t[2], 255]).collect::<Vec<_>>());
    let smooth = TextureReference { sampler: Sampler::default(), ..sharp(&board) };
    let frame = |texture: TextureReference| {
        let mut world = textured(base_color(texture), Material::matt(Vec3::ONE));
        // Eight texels per pixel: mip level 3.
        draw(&mut world, 16, 16, &linear()).0
    };
    // Half of the light is between codes 187 and 188; a mip level stores the nearer one.
    for pixel in frame(smooth.clone()) {
        assert!((pixel - srgb(188)).abs().max_element() < DECODED, "{pixel}");
    }
    assert!((srgb(188) - 0.5).abs() < 3e-3);
    // Negative controls: averaged codes would give 0.216; without mip levels there is only black and white.
    let sampler = Sampler { mipmap: Mipmap::None, minify_linear: false, ..Sampler::default() };
    let aliased = frame(TextureReference { sampler, ..smooth });
    assert!(aliased.iter().all(|pixel| (pixel.x - 0.5).abs() > 0.4));
}

#[test]
fn vertex_colours_are_interpolated_and_multiplied() {
    let mut mesh = pane();
    mesh.colors = mesh
        .positions
        .iter()
        .map(|p| Vec3::new(0.5 + 0.5 * p.x, 0.5 - 0.5 * p.y, 0.25).extend(1.0))
        .collect();
    let mut world = pane_of(Material::matt(Vec3::new(1.0, 0.5, 1.0)));
    let entity = world.query_filtered::<Entity, With<Mesh>>().single(&world).unwrap();
    world.entity_mut(entity).insert(Mesh(Arc::new(mesh)));
    for shading in [Shading::Gouraud, Shading::Phong] {
        let options = FrameOptions { shading: Some(shading), ..linear() };
        // Linear over the pane, so that interpolation over either triangle is exact.
        let expected = |x, y| {
            let uv = pixel_uv(x, y, SIZE);
            Some(DVec3::new(uv.x, 0.5 * uv.y, 0.25))
        };
        let found = difference(&mut world, &options, expected);
        assert!(found.largest < EXACT, "{}: {found:?}", shading.name());
    }
    let settings =
        SceneSettings { ambient: Vec3::ONE, shading: Shading::Gouraud, ..SceneSettings::default() };
    world.insert_resource(settings);
    // With a texture in addition, both multiply.
    world.entity_mut(entity).insert(base_color(sharp(&image(1, &[[188, 255, 0, 255]]))));
    let expected = |x, y| {
        let uv = pixel_uv(x, y, SIZE);
        Some(DVec3::new(uv.x * srgb(188), 0.5 * uv.y, 0.0))
    };
    let found = difference(&mut world, &linear(), expected);
    assert!(found.largest < DECODED, "{found:?}");
}
