//! Accounting of frames: stages, passes and the remainder add up to the wall clock, and the effects are the same
//! time divided differently. The numbers depend on the machine; that they add up does not.

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::shapes;
use lumbre_optics::{AlphaMode, Light, Material, SpotCone};
use lumbre_render::effects::BuiltIn;
use lumbre_render::{
    Accounting, Display, FrameOptions, Measure, Offscreen, OffscreenFormat, RenderError, Renderer, SCENE,
};
use lumbre_scene::{Camera, Mesh, Transform};

use super::own_effects::bloom::{Bloom, BloomEffect};
use crate::adapter::gpu;

/// A ball, a glass ball, a floor, a lamp with a shadow, and a camera with bloom.
fn world() -> World {
    let mut world = World::new();
    let ball = Mesh::from(shapes::uv_sphere(1.0, 24, 12));
    world.spawn((ball.clone(), Material::matt(Vec3::splat(0.6))));
    let glass = Material { alpha: 0.5, alpha_mode: AlphaMode::Blend, ..Material::matt(Vec3::ONE) };
    world.spawn((ball, glass, Transform::from_xyz(1.0, 0.0, 1.0)));
    let floor = Mesh::from(shapes::plane(9.0, 9.0, 1, 1));
    world.spawn((floor, Material::matt(Vec3::splat(0.5)), Transform::from_xyz(0.0, -1.0, 0.0)));
    let lamp =
        Light { shadow: true, ..Light::spot(Vec3::splat(20.0), SpotCone::Smooth { inner: 0.3, outer: 0.6 }) };
    world.spawn((lamp, Transform::from_xyz(1.0, 4.0, 3.0).looking_at(DVec3::ZERO, DVec3::Y)));
    let place = Transform::from_xyz(0.0, 1.0, 5.0).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Camera::default(), Bloom { strength: 0.3, levels: 2 }, place));
    world
}

struct Canvas {
    renderer: Renderer,
    target: Offscreen,
}

impl Canvas {
    fn new(renderer: Renderer) -> Self {
        Self { renderer, target: Offscreen::new(gpu(), 96, 64, OffscreenFormat::Rgba8).unwrap() }
    }

    /// Draws a frame, waits for it, and returns its accounting.
    fn account(&mut self, world: &mut World, measure: Measure) -> Accounting {
        let options = FrameOptions { measure, ..FrameOptions::default() };
        self.renderer.render(world, &self.target.target(), &options).unwrap();
        self.renderer.wait().unwrap();
        self.renderer.accounting().unwrap().clone()
    }
}

/// Returns true if two sums of f64 are equal up to the order of their terms.
fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * a.abs().max(b.abs()).max(1.0)
}

fn check_sums(accounting: &Accounting) {
    let sum = |numbers: &mut dyn Iterator<Item = f64>| numbers.sum::<f64>();
    let wall = accounting.wall_ms.unwrap();
    assert!(same(accounting.accounted_ms() + accounting.remainder_ms().unwrap(), wall));
    // The parts of the wall clock are consecutive.
    let parts = accounting.cpu_ms + accounting.between_ms.unwrap() + accounting.waiting_ms.unwrap();
    assert!(same(parts, wall), "{accounting:#?}");
    assert!(accounting.between_ms.unwrap() >= 0.0 && accounting.waiting_ms.unwrap() > 0.0);
    for stage in &accounting.stages {
        assert!(stage.ms >= 0.0 && stage.ms <= accounting.cpu_ms, "{stage:?}");
    }
    // Time outside of all stages is only that of reading the clock.
    let stages = sum(&mut accounting.stages.iter().map(|stage| stage.ms));
    assert!(stages <= accounting.cpu_ms * (1.0 + 1e-9), "a stage counts twice: {accounting:#?}");
    // Divided by effects it is the same time, the same work, and the same bytes.
    let effects = &accounting.effects;
    assert!(same(sum(&mut effects.iter().map(|effect| effect.cpu_ms)), accounting.cpu_ms));
    assert!(effects.iter().all(|effect| effect.cpu_ms >= 0.0), "{effects:#?}");
    let on_device = sum(&mut effects.iter().filter_map(|effect| effect.gpu_ms));
    assert!(same(on_device, accounting.passes_ms.unwrap()), "{accounting:#?}");
    assert!(accounting.passes_ms.unwrap() <= accounting.gpu_ms.unwrap() * (1.0 + 1e-9));
    let bytes: u64 = effects.iter().map(|effect| effect.uploaded_bytes).sum();
    assert_eq!(bytes, accounting.uploads.total());
    let passes: usize = effects.iter().map(|effect| effect.passes.len()).sum();
    assert_eq!(passes, accounting.passes.len());
}

#[test]
fn stages_passes_and_effects_sum_to_the_frame() {
    let mut world = world();
    let mut canvas = Canvas::new(Renderer::builder().with(BloomEffect::default()).build(gpu()));
    let first = canvas.account(&mut world, Measure::TimeAndInvocations);
    check_sums(&first);
    println!("{}", first.to_text());
    let of = |accounting: &Accounting, name: &str| {
        accounting.effects.iter().find(|effect| effect.effect == name).cloned().unwrap_or_default()
    };
    // What each effect did in its first frame, separate from the others.
    let (shadows, bloom, display) = (of(&first, "shadow maps"), of(&first, "bloom"), of(&first, "display"));
    assert_eq!((shadows.passes.len(), shadows.pipelines_made), (2, 3));
    assert_eq!(shadows.uploaded_bytes, first.uploads.shadows);
    assert_eq!((bloom.passes.len(), bloom.pipelines_made), (4, 3), "{bloom:?}");
    assert!(bloom.gpu_ms.unwrap() > 0.0 && bloom.invocations.unwrap().fragment > 0);
    assert_eq!((display.passes.as_slice(), display.pipelines_made), (["display".to_owned()].as_slice(), 1));
    assert_eq!(first.uploads.effects, bloom.uploaded_bytes + display.uploaded_bytes);
    let scene = of(&first, SCENE);
    assert!(scene.pipelines_made >= 2 && scene.uploaded_bytes > 0 && scene.passes.is_empty(), "{scene:?}");

    // Nothing is new in the next frame, and the shadow map is kept; a frame of an unchanged world has few stages.
    let second = canvas.account(&mut world, Measure::TimeAndInvocations);
    check_sums(&second);
    assert!(second.effects.iter().all(|effect| effect.pipelines_made == 0), "{:#?}", second.effects);
    assert_eq!((of(&second, "shadow maps").passes.len(), second.uploads.lights), (0, 0));
    assert!(second.frame == first.frame + 1);
    // Frames that are not measured have no accounting; with several in flight, the last one is waited for.
    let report =
        canvas.renderer.render(&mut world, &canvas.target.target(), &FrameOptions::default()).unwrap();
    assert!(report.accounting.is_none() && canvas.renderer.accounting() == Some(&second));
    let options = FrameOptions { measure: Measure::Time, ..FrameOptions::default() };
    for _ in 0..3 {
        canvas.renderer.render(&mut world, &canvas.target.target(), &options).unwrap();
    }
    canvas.renderer.wait().unwrap();
    let waited = canvas.renderer.accounting().unwrap().clone();
    assert_eq!((waited.frame, waited.wall_ms.is_some()), (second.frame + 4, true));
    check_sums(&waited);
    let lights = canvas.account(&mut world, Measure::Lights);
    check_sums(&lights);
}

#[test]
fn a_renderer_is_built_without_some_of_its_effects() {
    let picture = |renderer: Renderer, world: &mut World, display: Display| -> Result<Vec<u8>, RenderError> {
        let mut canvas = Canvas::new(renderer);
        let options = FrameOptions { display, ..FrameOptions::default() };
        canvas.renderer.render(world, &canvas.target.target(), &options)?;
        canvas.target.read_rgba8(gpu())
    };
    let without = |effect| Renderer::builder().without(effect).build(gpu());
    let srgb = Display::Srgb;
    let whole = picture(Renderer::new(gpu()), &mut world(), srgb).unwrap();
    // Without the effect it is as if shadows were switched off.
    let mut canvas = Canvas::new(Renderer::new(gpu()));
    let options = FrameOptions { shadows: false, ..FrameOptions::default() };
    canvas.renderer.render(&mut world(), &canvas.target.target(), &options).unwrap();
    let shadeless = picture(without(BuiltIn::ShadowMaps), &mut world(), srgb).unwrap();
    assert!(shadeless == canvas.target.read_rgba8(gpu()).unwrap() && shadeless != whole);
    // Surfaces that nothing draws are missing; the background is there.
    let mut pictures = vec![whole];
    for effect in [BuiltIn::Forward, BuiltIn::Transparent] {
        let left = picture(without(effect), &mut world(), srgb).unwrap();
        assert!(pictures.iter().all(|other| *other != left), "{effect:?}");
        pictures.push(left);
    }
    // Blended surfaces need a display pass.
    let refused = picture(without(BuiltIn::Display), &mut world(), srgb);
    assert!(matches!(refused, Err(RenderError::NoDisplay)), "{refused:?}");
    // The explanation agrees with what is drawn.
    let mut renderer =
        Renderer::builder().without(BuiltIn::ShadowMaps).without(BuiltIn::Forward).build(gpu());
    let explanation = renderer.explain(&mut world(), &FrameOptions::default(), 96, 64).unwrap();
    let passes: Vec<&str> = explanation.frame.passes.iter().map(|pass| pass.name.as_str()).collect();
    assert!(
        passes.contains(&"transparent") && !passes.contains(&"forward") && !passes.contains(&"shadow maps")
    );
    assert!(explanation.frame.passes.iter().any(|pass| pass.owner.as_deref() == Some("transparent")));
    assert!(
        explanation.variants.keys().all(|variant| !variant.contains("SHADOWS")),
        "{:?}",
        explanation.variants
    );
    let names: Vec<&str> = BuiltIn::ALL.iter().map(|effect| effect.name()).collect();
    let mut all = Renderer::new(gpu());
    let explained = all.explain(&mut world(), &FrameOptions::default(), 96, 64).unwrap();
    for name in names {
        assert!(explained.frame.passes.iter().any(|pass| pass.owner.as_deref() == Some(name)), "{name}");
    }
}
