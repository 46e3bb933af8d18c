//! Compares frames with deferred shading with the same frames in forward shading: the same up to rounding, for any
//! contents and order of drawing. Compute shaders draw what fragments draw.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DVec3, UVec3, Vec2, Vec3, Vec4};
use lumbre_graph::LoadOp;
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_optics::{AlphaMode, BakeMode, Fog, FogMode, Light, Material, Shading, SpotCone, Surface};
use lumbre_render::effects::{Board, BuiltIn, Effect, FrameGraph, Stage};
use lumbre_render::{
    Display, FrameOptions, FrameReport, LightLists, Measure, Offscreen, OffscreenFormat, Renderer,
    RenderingPath, SceneFacts, Viewport,
};
use lumbre_scene::{
    AmbientCube, Camera, DynamicObject, IrradianceVolume, Lightmap, LightmapEncoding, LightmapImage,
    MaterialTextures, Mesh, Projection, SceneSettings, Transform,
};
use lumbre_tests::device::{apart_by_moved_corners, filter_step, same_by_another_pipeline};
use lumbre_tests::panes::{image, sharp};

use crate::adapter::{Canvas, draw, gpu, linear};

/// The largest accepted difference of a pixel, relative to its brightest channel plus a hundredth. A point is
/// reconstructed from its pixel and depth, and a normal is stored in octahedral encoding, which rounds in other
/// ways than interpolation does. A step of eight bits is 4e-3.
const ROUNDING: f64 = 6e-5;
/// The same where textures or vertex colours modulate light: they are stored with a relative error of 2^-13.
const TINTED: f64 = 1.22e-4 + ROUNDING;

const SIZE: (u32, u32) = (131, 83);

fn by(rendering_path: RenderingPath) -> FrameOptions {
    FrameOptions { rendering_path, shading: Some(Shading::Phong), ..linear() }
}

/// Compares two frames of [`SIZE`]. Deferred lighting finds a point on its pixel's ray, forward lighting on the
/// triangle between the corners' exact places; a rasterizer that moves the corners puts these apart.
fn largest_difference(expected: &[DVec3], got: &[DVec3]) -> f64 {
    assert!(expected.iter().any(|pixel| pixel.max_element() > 0.01), "the frame is black");
    let allowed = apart_by_moved_corners(expected, SIZE.0 as usize);
    let of = |((a, b), allowed): ((&DVec3, &DVec3), f64)| {
        ((*a - *b).abs().max_element() - allowed).max(0.0) / (a.abs().max_element() + 0.01)
    };
    expected.iter().zip(got).zip(allowed).map(of).fold(0.0, f64::max)
}

/// Returns the difference of forward and deferred shading, and the report of the deferred frame. Fails unless compute
/// shaders light the same.
fn difference(world: &mut World, options: &FrameOptions) -> (f64, FrameReport) {
    let with = |rendering_path| FrameOptions { rendering_path, ..options.clone() };
    let (expected, forward) = draw(world, SIZE.0, SIZE.1, &with(RenderingPath::Forward));
    let (got, deferred) = draw(world, SIZE.0, SIZE.1, &with(RenderingPath::Deferred));
    let (computed, in_compute) = draw(world, SIZE.0, SIZE.1, &with(RenderingPath::DeferredCompute));
    assert!(!forward.plan.status("g-buffer").unwrap().runs());
    assert!(deferred.plan.status("g-buffer").unwrap().runs());
    assert!(deferred.plan.status("deferred lighting").is_none());
    assert!(in_compute.plan.status("deferred lighting").unwrap().runs());
    assert_eq!(deferred.statistics.draws, in_compute.statistics.draws);
    assert!(same_by_another_pipeline(&computed, &got), "compute shaders light otherwise");
    (largest_difference(&expected, &got), deferred)
}

/// A shiny material of a colour.
fn shiny(red: f32, green: f32, blue: f32) -> Material {
    let front = Surface {
        ambient: Vec3::splat(0.2),
        diffuse: Vec3::new(red, green, blue),
        specular: Vec3::splat(0.4),
        emission: Vec3::new(0.0, 0.02, 0.01),
        shininess: 60.0,
    };
    Material { front, ..Material::default() }
}

fn ball() -> TriangleMesh {
    shapes::uv_sphere(1.0, 24, 12)
}

fn perspective() -> Projection {
    Projection::Perspective { vertical_fov: 0.9, aspect: None, near: 0.1, far: None }
}

/// A floor, nine balls and lamps above them, seen from above.
fn room(projection: Projection) -> World {
    let mut world = World::new();
    world.spawn((Mesh::from(shapes::plane(30.0, 30.0, 2, 2)), shiny(0.5, 0.6, 0.7), Transform::IDENTITY));
    let mesh = Arc::new(ball());
    for number in 0..9 {
        let (x, z) = (f64::from(number % 3) * 3.0 - 3.0, f64::from(number / 3) * 3.0 - 3.0);
        let material = shiny(0.2 + 0.08 * number as f32, 0.5, 0.9 - 0.08 * number as f32);
        world.spawn((Mesh(mesh.clone()), material, Transform::from_xyz(x, 0.8, z)));
    }
    for number in 0..24 {
        let turn = f64::from(number) * 2.4;
        let place = DVec3::new(turn.cos(), 0.0, turn.sin()) * (0.4 * f64::from(number).sqrt() * 3.0);
        let color = Vec3::new(0.4, 0.2 + 0.02 * number as f32, 0.8 - 0.02 * number as f32);
        let lamp = Light::point(color).with_range(4.0);
        world.spawn((lamp, Transform::from_translation(place + DVec3::Y * 2.2)));
    }
    let sun = Light::directional(Vec3::splat(0.1));
    world.spawn((sun, Transform::from_xyz(3.0, 9.0, 1.0).looking_at(DVec3::ZERO, DVec3::Y)));
    let eye = Transform::from_xyz(1.0, 6.0, 11.0).looking_at(DVec3::new(0.0, 0.5, 0.0), DVec3::Y);
    world.spawn((Camera { projection, exposure: 1.0 }, eye));
    world
}

fn lightmap(color: Vec3) -> Lightmap {
    let texels = (0..16).map(|number| color * (0.5 + 0.1 * number as f32)).collect();
    let encoding = LightmapEncoding::default();
    let image = LightmapImage { name: "map".to_owned(), width: 4, height: 4, texels, encoding };
    Lightmap { image: Arc::new(image) }
}

fn lightmapped(mut mesh: TriangleMesh) -> TriangleMesh {
    let turned = |at: &Vec3| Vec2::new(0.5 + 0.2 * at.x, 0.5 - 0.2 * at.z).clamp(Vec2::ZERO, Vec2::ONE);
    mesh.uv1 = mesh.positions.iter().map(turned).collect();
    mesh
}

#[test]
fn any_camera_and_any_lists_show_the_same() {
    let views = [
        ("perspective", perspective()),
        ("wide", Projection::Perspective { vertical_fov: 2.6, aspect: None, near: 1e-3, far: None }),
        ("narrow", Projection::Perspective { vertical_fov: 0.02, aspect: None, near: 1.0, far: None }),
        ("parallel", Projection::orthographic(14.0, 9.0, 40.0)),
        ("mirrored", Projection::Orthographic { half_width: -7.0, half_height: 5.0, near: 0.5, far: 40.0 }),
    ];
    for (name, projection) in views {
        let mut world = room(projection);
        for light_lists in [LightLists::Clusters, LightLists::Objects, LightLists::Everything] {
            let options = FrameOptions { light_lists, ..by(RenderingPath::Deferred) };
            let (apart, report) = difference(&mut world, &options);
            println!("{name}, {light_lists:?}: {apart:.1e}");
            assert!(apart < ROUNDING, "{name}, {light_lists:?}: {apart}");
            assert_eq!(report.statistics.objects + report.statistics.objects_outside, 10);
        }
    }
}

#[test]
fn what_the_g_buffer_has_no_room_for_is_drawn_with_the_rest() {
    // In front of deferred surfaces and behind them, with and without lightmaps, so that neither pass may draw over
    // the other.
    let mut world = room(perspective());
    let mesh = |mesh: TriangleMesh| Mesh::from(mesh);
    let at = |x: f64, y: f64, z: f64| Transform::from_xyz(x, y, z).with_scale(DVec3::splat(0.7));
    let holes = image(2, &[[255; 4], [0; 4], [0; 4], [255; 4]]);
    let masked = Material { alpha_mode: AlphaMode::Mask { cutoff: 0.5 }, ..shiny(0.9, 0.3, 0.2) };
    let textures = MaterialTextures { base_color: Some(sharp(&holes)), ..MaterialTextures::default() };
    for (x, z) in [(-1.6, 4.2), (1.5, -1.5)] {
        let fence = lightmapped(ball());
        world.spawn((mesh(fence), masked.clone(), textures.clone(), lightmap(Vec3::ONE), at(x, 1.0, z)));
        world.spawn((mesh(ball()), masked.clone(), textures.clone(), at(x + 1.0, 1.6, z)));
    }
    let glass = Material { alpha: 0.5, alpha_mode: AlphaMode::Blend, ..shiny(0.3, 0.9, 0.3) };
    world.spawn((mesh(ball()), glass, at(0.0, 1.5, 3.0)));
    let unlit = Material { unlit: true, ..shiny(0.9, 0.9, 0.1) };
    world.spawn((mesh(ball()), unlit, at(3.0, 0.5, 4.0)));
    world.spawn((mesh(ball()), shiny(0.8, 0.2, 0.8), Shading::Gouraud, at(-3.0, 0.6, 4.5)));
    world.spawn((mesh(lightmapped(ball())), shiny(0.5, 0.5, 0.5), lightmap(Vec3::X), at(0.4, 0.8, 5.0)));
    let options = FrameOptions { shading: None, ..by(RenderingPath::Deferred) };
    world.insert_resource(SceneSettings { shading: Shading::Phong, ..SceneSettings::default() });
    let (apart, report) = difference(&mut world, &options);
    println!("{apart:.1e}");
    assert!(apart < ROUNDING, "{apart}");
    for pass in ["lightmap", "forward", "transparent"] {
        assert!(report.plan.status(pass).unwrap().runs(), "{pass}");
    }
}

#[test]
fn baked_light_shadows_fog_and_backs_are_the_same() {
    let mut world = room(perspective());
    let open = {
        // A ball without its upper half, whose inside is visible.
        let mut mesh = ball();
        mesh.indices.truncate(mesh.indices.len() / 2);
        mesh
    };
    let back = Surface { diffuse: Vec3::new(0.1, 0.8, 0.2), ..shiny(0.0, 0.0, 0.0).front };
    let two_sided = Material { double_sided: true, back: Some(back), ..shiny(0.8, 0.2, 0.1) };
    let flipped = Transform::from_xyz(-1.5, 1.0, 4.0).with_scale(DVec3::new(-0.8, 0.8, 0.8));
    world.spawn((Mesh::from(open.clone()), two_sided.clone(), flipped));
    world.spawn((
        Mesh::from(lightmapped(open)),
        two_sided,
        lightmap(Vec3::Y),
        Transform::from_xyz(1.6, 1.2, 4.0),
    ));
    for number in 0..3 {
        let color = [Vec3::X, Vec3::Y, Vec3::Z][number];
        let place = Transform::from_xyz(number as f64 * 2.0 - 2.0, 0.5, 5.5).with_scale(DVec3::splat(0.5));
        world.spawn((Mesh::from(lightmapped(ball())), shiny(0.6, 0.6, 0.6), lightmap(color), place));
    }
    world.spawn((
        Mesh::from(ball()),
        shiny(0.7, 0.7, 0.7),
        DynamicObject,
        Transform::from_xyz(3.5, 0.8, 3.0),
    ));
    let cubes = (0..8).map(|number| AmbientCube([Vec3::splat(0.05 * number as f32); 6])).collect();
    let volume = IrradianceVolume { resolution: UVec3::splat(2), cubes, inside: Vec::new() };
    world.spawn((volume, Transform::from_scale(20.0)));
    let spot = Light::spot(Vec3::splat(30.0), SpotCone::Smooth { inner: 0.2, outer: 0.7 });
    let spot = Light { shadow: true, ..spot.with_range(30.0) };
    world.spawn((spot, Transform::from_xyz(4.0, 9.0, 4.0).looking_at(DVec3::ZERO, DVec3::Y)));
    let baked = Light { bake: BakeMode::Static, ..Light::point(Vec3::splat(2.0)).with_range(9.0) };
    world.spawn((baked, Transform::from_xyz(-3.0, 3.0, 5.0)));
    let fog = Fog { color: Vec3::new(0.3, 0.3, 0.4), mode: FogMode::Exponential { density: 0.05 } };
    world.insert_resource(SceneSettings { fog: Some(fog), two_sided: true, ..SceneSettings::default() });
    let (apart, report) = difference(&mut world, &by(RenderingPath::Deferred));
    println!("{apart:.1e}");
    assert!(apart < ROUNDING + filter_step(), "{apart}");
    assert!(report.plan.status("shadow maps").unwrap().runs());
    // Nothing in this frame had to be drawn forward.
    assert_eq!(report.statistics.lit_passes, Default::default());
    let measured = FrameOptions { measure: Measure::Time, ..by(RenderingPath::Deferred) };
    let (_, deferred) = draw(&mut world, SIZE.0, SIZE.1, &measured);
    let (_, forward) = draw(
        &mut world,
        SIZE.0,
        SIZE.1,
        &FrameOptions { rendering_path: RenderingPath::Forward, ..measured },
    );
    let [deferred, forward] = [deferred, forward].map(|report| report.statistics.lit_passes);
    for (deferred, forward) in [(deferred.lightmap, forward.lightmap), (deferred.forward, forward.forward)] {
        assert!(forward.objects > 0);
        assert_eq!((deferred.objects, deferred.lights), (forward.objects, forward.lights));
        assert_eq!(deferred.lights_per_object, forward.lights_per_object);
    }
}

#[test]
fn textures_and_vertex_colors_modulate_the_same_light() {
    let mut world = room(perspective());
    let board = image(2, &[[250, 40, 40, 255], [30, 200, 90, 255], [10, 10, 240, 255], [128; 4]]);
    let textures = |tex_coord| MaterialTextures {
        base_color: Some(lumbre_scene::TextureReference { tex_coord, ..sharp(&board) }),
        ..MaterialTextures::default()
    };
    let at = |x: f64| Transform::from_xyz(x, 1.0, 4.5).with_scale(DVec3::splat(0.8));
    let mut colored = ball();
    colored.colors = colored.positions.iter().map(|at| (*at * 0.5 + 0.5).extend(1.0)).collect();
    world.spawn((Mesh::from(ball()), shiny(1.0, 1.0, 1.0), textures(0), at(-3.0)));
    world.spawn((Mesh::from(lightmapped(ball())), shiny(1.0, 1.0, 1.0), textures(1), at(-1.2)));
    world.spawn((Mesh::from(colored.clone()), shiny(1.0, 1.0, 1.0), at(0.6)));
    // Vertex colours brighter than white.
    colored.colors.iter_mut().for_each(|color| *color *= Vec4::new(3.0, 2.0, 4.0, 1.0));
    let both = (Mesh::from(lightmapped(colored)), shiny(1.0, 1.0, 1.0), textures(0), lightmap(Vec3::ONE));
    world.spawn((both, at(2.4)));
    let (apart, _) = difference(&mut world, &by(RenderingPath::Deferred));
    println!("{apart:.1e}");
    assert!(apart < TINTED, "{apart}");
}

/// An effect that hides everything behind the middle of the depth range of an orthographic camera.
struct Curtain;

impl Effect for Curtain {
    fn name(&self) -> &'static str {
        "curtain"
    }

    fn stage(&self) -> Stage {
        Stage::Background
    }

    fn extract(&mut self, _: &mut World, _: &SceneFacts, _: &FrameOptions) -> bool {
        true
    }

    fn declare<'a>(&'a self, graph: &mut FrameGraph<'a>, board: &mut Board) {
        let pass = board.lit_pass(graph, "curtain", LoadOp::Load);
        pass.depth(&mut board.depth, LoadOp::Clear(0.5)).run(|_| Ok(()));
    }
}

#[test]
fn what_a_program_draws_behind_everything_hides_the_same() {
    let mut world = room(Projection::orthographic(14.0, 9.0, 23.0));
    let mut drawn = |rendering_path, hidden: bool| {
        let builder = Renderer::builder();
        let mut renderer = if hidden { builder.with(Curtain).build(gpu()) } else { builder.build(gpu()) };
        let frame = Offscreen::new(gpu(), SIZE.0, SIZE.1, OffscreenFormat::LinearFloat).unwrap();
        renderer.render(&mut world, &frame.target(), &by(rendering_path)).unwrap();
        let pixels = frame.read_linear(gpu()).unwrap();
        pixels.iter().map(|pixel| pixel.truncate().as_dvec3()).collect::<Vec<_>>()
    };
    let forward = drawn(RenderingPath::Forward, true);
    for path in [RenderingPath::Deferred, RenderingPath::DeferredCompute] {
        let apart = largest_difference(&forward, &drawn(path, true));
        assert!(apart < ROUNDING, "{path:?}: {apart}");
    }
    assert!(largest_difference(&forward, &drawn(RenderingPath::Forward, false)) > 0.1, "nothing is hidden");
}

#[test]
fn of_coplanar_surfaces_the_same_is_seen() {
    let mut world = room(perspective());
    // A wall coplanar with a larger one, and nearer to the eye than that one's farthest corner; and the same mesh
    // twice, the older one without a lightmap.
    let wall =
        |y: f64, z: f64| Transform::from_xyz(0.0, y, z).looking_at(DVec3::new(0.0, -90.0, z), DVec3::Z);
    let (large, small) = (shapes::plane(8.0, 4.0, 1, 1), shapes::plane(1.0, 1.0, 1, 1));
    world.spawn((Mesh::from(small), shiny(0.9, 0.1, 0.1), wall(3.0, 2.0)));
    world.spawn((Mesh::from(lightmapped(large)), shiny(0.1, 0.9, 0.1), lightmap(Vec3::ONE), wall(3.0, 2.0)));
    let at = Transform::from_xyz(2.0, 1.0, 6.0).with_scale(DVec3::splat(0.6));
    world.spawn((Mesh::from(ball()), shiny(0.9, 0.1, 0.1), at));
    world.spawn((Mesh::from(lightmapped(ball())), shiny(0.1, 0.9, 0.1), lightmap(Vec3::ONE), at));
    let (apart, _) = difference(&mut world, &by(RenderingPath::Deferred));
    println!("{apart:.1e}");
    assert!(apart < ROUNDING, "{apart}");
}

#[test]
fn more_lightmaps_than_classes_are_all_shown() {
    let mut world = room(perspective());
    let mesh = Arc::new(lightmapped(ball()));
    for number in 0..300 {
        let (x, z) = (f64::from(number % 20) * 0.6 - 5.7, f64::from(number / 20) * 0.6 - 4.0);
        let place = Transform::from_xyz(x, 1.9, z).with_scale(DVec3::splat(0.25));
        let color = Vec3::new(0.2, 0.003 * number as f32, 0.5);
        world.spawn((Mesh(mesh.clone()), shiny(0.5, 0.5, 0.5), lightmap(color), place));
    }
    let (apart, report) = difference(&mut world, &by(RenderingPath::Deferred));
    println!("{apart:.1e}, {} draws", report.statistics.draws);
    assert!(apart < ROUNDING + filter_step(), "{apart}");
}

#[test]
fn a_light_that_is_left_out_is_missed() {
    // Negative control: a light that is missing in the deferred frame is detected.
    let mut world = room(perspective());
    let (expected, _) = draw(&mut world, SIZE.0, SIZE.1, &by(RenderingPath::Forward));
    let lamps: Vec<Entity> = world.query_filtered::<Entity, With<Light>>().iter(&world).collect();
    let lamp = lamps[2];
    world.get_mut::<Light>(lamp).unwrap().enabled = false;
    for path in [RenderingPath::Deferred, RenderingPath::DeferredCompute] {
        let (got, _) = draw(&mut world, SIZE.0, SIZE.1, &by(path));
        assert!(largest_difference(&expected, &got) > 100.0 * ROUNDING);
    }
}

#[test]
fn automatic_is_deferred_under_many_lights() {
    let mut world = room(perspective());
    let far = Transform::from_xyz(0.0, 90.0, 0.0);
    // With the room's own lamps enough for the device.
    let number = if gpu().is_software() { 60 } else { 1020 };
    let lamps: Vec<Entity> =
        (0..number).map(|_| world.spawn((Light::point(Vec3::ONE).with_range(4.0), far)).id()).collect();
    let runs = |world: &mut World, options: &FrameOptions| {
        let (_, report) = draw(world, 40, 30, options);
        report.plan.status("g-buffer").unwrap().runs()
    };
    let auto = by(RenderingPath::Auto);
    assert!(runs(&mut world, &auto));
    assert!(!runs(&mut world, &FrameOptions { light_lists: LightLists::Objects, ..auto.clone() }));
    assert!(!runs(&mut world, &FrameOptions { multisample: Some(true), ..auto.clone() }));
    assert!(!runs(&mut world, &FrameOptions { shading: Some(Shading::Gouraud), ..auto.clone() }));
    assert!(!runs(&mut world, &FrameOptions { specular_antialiasing: Some(true), ..auto.clone() }));
    // With triangles that are large in the frame, forward shading wastes little.
    assert!(!draw(&mut world, 640, 480, &auto).1.plan.status("g-buffer").unwrap().runs());
    // Even on request: of several samples per pixel the G-buffer would hold only one.
    let several = FrameOptions { multisample: Some(true), ..by(RenderingPath::Deferred) };
    assert!(!runs(&mut world, &several));
    // The plan without a frame agrees with that of the frame.
    let explained = Renderer::new(gpu()).explain(&mut world, &auto, 40, 30).unwrap();
    let pass = explained.frame.passes.iter().find(|pass| pass.name == "g-buffer").unwrap();
    assert!(pass.group.is_some());
    // A GPU lights in compute shaders, a processor in fragments.
    let in_compute = explained.frame.passes.iter().any(|pass| pass.name == "deferred lighting");
    assert_eq!(in_compute, !gpu().is_software());
    let path = |explained: lumbre_render::SceneExplanation| explained.rendering_path;
    assert!(path(explained).starts_with("deferred"));
    // Without a device that of a GPU.
    let without_a_device = path(lumbre_render::explain(&mut world, &auto, 40, 30).unwrap());
    let expected = if gpu().is_software() { "and a GPU gains from 1024 on" } else { "deferred: a GPU draws" };
    assert!(without_a_device.contains(expected), "{without_a_device}");
    let more: Vec<Entity> =
        (0..1020).map(|_| world.spawn((Light::point(Vec3::ONE).with_range(4.0), far)).id()).collect();
    let of_a_gpu = lumbre_render::explain(&mut world, &auto, 40, 30).unwrap();
    let lit = of_a_gpu.frame.passes.iter().find(|pass| pass.name == "deferred lighting");
    assert!(lit.is_some_and(|pass| pass.group.is_some()), "a GPU lights in compute shaders");
    more.into_iter().for_each(|lamp| assert!(world.despawn(lamp)));
    // With fewer lights a G-buffer is not worthwhile.
    lamps.into_iter().for_each(|lamp| assert!(world.despawn(lamp)));
    assert!(!runs(&mut world, &auto));
}

#[test]
fn a_part_of_a_target_and_what_mirrors_show_are_the_same() {
    let mut world = room(perspective());
    let mirror = Material { mirror: Vec3::splat(0.8), ..shiny(0.1, 0.1, 0.1) };
    let wall = Transform::from_xyz(0.0, 2.0, -4.5).looking_at(DVec3::new(0.0, -9.0, -4.5), DVec3::Z);
    world.spawn((Mesh::from(shapes::plane(9.0, 4.0, 1, 1)), mirror, wall));
    let mut drawn = |rendering_path, viewport: Option<Viewport>| {
        let frame = Offscreen::new(gpu(), 96, 64, OffscreenFormat::Rgba8).unwrap();
        let target = match viewport {
            Some(viewport) => frame.target().with_viewport(viewport),
            None => frame.target(),
        };
        let options =
            FrameOptions { rendering_path, shading: Some(Shading::Phong), ..FrameOptions::default() };
        let mut renderer = Renderer::new(gpu());
        let report = renderer.render(&mut world, &target, &options).unwrap();
        (frame.read_rgba8(gpu()).unwrap(), report)
    };
    for viewport in [None, Some(Viewport::new([17, 9], [60, 41]))] {
        let (expected, _) = drawn(RenderingPath::Forward, viewport);
        for path in [RenderingPath::Deferred, RenderingPath::DeferredCompute] {
            let (got, report) = drawn(path, viewport);
            assert!(report.plan.status("g-buffer").unwrap().runs());
            let in_compute = path == RenderingPath::DeferredCompute;
            assert_eq!(report.plan.status("deferred lighting").is_some_and(|pass| pass.runs()), in_compute);
            assert_eq!(report.statistics.mirror_views, 1);
            let apart = expected.iter().zip(&got).map(|(a, b)| a.abs_diff(*b)).max();
            println!("{viewport:?}, {path:?}: {apart:?} of 255");
            assert!(apart <= Some(1), "{viewport:?}, {path:?}: {apart:?}");
        }
    }
    // A renderer without the G-buffer lights every surface where it is drawn.
    let frame = Offscreen::new(gpu(), 48, 32, OffscreenFormat::Rgba8).unwrap();
    let mut without = Renderer::builder().without(BuiltIn::GBuffer).build(gpu());
    let asked = FrameOptions { rendering_path: RenderingPath::Deferred, ..FrameOptions::default() };
    let report = without.render(&mut world, &frame.target(), &asked).unwrap();
    assert!(report.plan.status("g-buffer").is_none());
}

#[test]
fn frames_that_change_their_path_and_their_light_stay_right() {
    let mut world = room(perspective());
    let mut canvas = Canvas::new(SIZE.0, SIZE.1);
    let lamps: Vec<Entity> = world.query_filtered::<Entity, With<Light>>().iter(&world).collect();
    for (number, lamp) in lamps.into_iter().enumerate().step_by(3) {
        world.get_mut::<Light>(lamp).unwrap().enabled = false;
        let mut paths =
            [RenderingPath::Forward, RenderingPath::Deferred, RenderingPath::DeferredCompute].map(by);
        paths.rotate_left(number % 3);
        let [a, b, c] = paths.each_ref().map(|options| canvas.draw(&mut world, options).0);
        for [one, other] in [[&a, &b], [&b, &c], [&c, &a]] {
            let apart = largest_difference(one, other);
            assert!(apart < ROUNDING, "after {number} lamps: {apart}");
        }
    }
}

/// Eight bits, which the lit shaders have converted themselves and the composite passes on, or the display pass from a
/// linear frame.
#[test]
fn compute_shaders_write_what_each_target_takes() {
    let mut world = room(perspective());
    for display in [Display::Srgb, Display::Clamp, Display::Linear] {
        for probe in [false, true] {
            let mut drawn = |rendering_path| {
                let frame = Offscreen::new(gpu(), SIZE.0, SIZE.1, OffscreenFormat::Rgba8).unwrap();
                let options = FrameOptions { display, probe, ..by(rendering_path) };
                let report = Renderer::new(gpu()).render(&mut world, &frame.target(), &options).unwrap();
                // The probe needs the linear frame, which the display pass then converts.
                assert_eq!(report.plan.status("display").unwrap().runs(), probe);
                let in_compute = rendering_path == RenderingPath::DeferredCompute;
                assert_eq!(report.plan.status("deferred lighting").is_some(), in_compute);
                frame.read_rgba8(gpu()).unwrap()
            };
            let fragments = drawn(RenderingPath::Deferred);
            let computed = drawn(RenderingPath::DeferredCompute);
            let apart = fragments.iter().zip(&computed).map(|(a, b)| a.abs_diff(*b)).max();
            assert!(fragments.iter().any(|value| (60..200).contains(value)));
            assert!(apart <= Some(1), "{display:?}, {probe}: {apart:?}");
        }
    }
}

/// Where a program's own effect hides every surface, nothing of an earlier frame is left that compute shaders lit there.
#[test]
fn what_compute_shaders_lit_in_an_earlier_frame_is_gone() {
    let mut world = room(Projection::orthographic(14.0, 9.0, 23.0));
    let eye = DVec3::new(1.0, 6.0, 11.0);
    let near = Transform::from_translation(eye.lerp(DVec3::new(0.0, 0.5, 0.0), 0.3));
    let passing = world.spawn((Mesh::from(ball()), shiny(0.9, 0.2, 0.1), near)).id();
    let mut renderer = Renderer::builder().with(Curtain).build(gpu());
    let frame = Offscreen::new(gpu(), SIZE.0, SIZE.1, OffscreenFormat::LinearFloat).unwrap();
    let drawn = |world: &mut World, renderer: &mut Renderer| {
        renderer.render(world, &frame.target(), &by(RenderingPath::DeferredCompute)).unwrap();
        frame.read_linear(gpu()).unwrap()
    };
    let before = drawn(&mut world, &mut renderer);
    world.despawn(passing);
    let after = drawn(&mut world, &mut renderer);
    let fresh = drawn(&mut world, &mut Renderer::builder().with(Curtain).build(gpu()));
    assert!(after == fresh, "something of the ball is left");
    assert!(before != after, "the ball was seen");
}
