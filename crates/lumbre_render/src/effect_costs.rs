//! Measures what each effect of a scene costs and contributes: milliseconds per frame and the change of the
//! picture, by drawing frames with it and without it. Nothing is predicted here, and no effect is chosen.

use std::time::{Duration, Instant};

use bevy_ecs::prelude::*;
use glam::Vec3;
use lumbre_optics::{AlphaMode, Light, LightKind, Material, Shading, Surface};
use lumbre_scene::{Census, EmissiveLight, MaterialTextures, SceneSettings};

use crate::{
    Accounting, Display, FrameOptions, Gpu, Measure, Offscreen, OffscreenFormat, RenderError, Renderer,
};

/// An effect that a scene calls for and that a frame can be drawn without.
#[derive(Clone, Copy, Debug)]
pub struct Removable {
    /// The name of the effect in the census.
    pub effect: &'static str,
    without: fn(&mut World, &mut FrameOptions),
}

impl Removable {
    /// Removes the effect from a World, or from the options of its frame.
    pub fn remove(&self, world: &mut World, options: &mut FrameOptions) {
        (self.without)(world, options);
    }
}

/// Returns the effects that a scene, or the options of its frame, call for and that can be removed, in the
/// order of the census.
pub fn removable_effects(census: &Census, options: &FrameOptions) -> Vec<Removable> {
    let called_for: Vec<_> = census.lines().into_iter().filter(|line| line.called_for).collect();
    let by_need = matches!(options.shading, Some(Shading::Auto { .. }));
    let is_called_for = |effect: &Removable| {
        called_for.iter().any(|line| line.effect == effect.effect) || by_need && effect.effect == BY_NEED
    };
    EFFECTS.iter().copied().filter(is_called_for).collect()
}

/// The name of the effect in the census.
pub(crate) const BY_NEED: &str = "shading by need";

const EFFECTS: &[Removable] = &[
    // Compared with the next cheaper shading.
    Removable {
        effect: "Gouraud shading",
        without: |world, options| {
            shade_otherwise(world, options, |shading| shading == Shading::Gouraud, Shading::Flat);
        },
    },
    Removable {
        effect: "Phong shading",
        without: |world, options| {
            shade_otherwise(world, options, |shading| shading == Shading::Phong, Shading::Gouraud);
        },
    },
    // Compared with Phong shading, from which the result differs by no more than a bound. The cost is usually
    // negative.
    Removable {
        effect: BY_NEED,
        without: |world, options| {
            shade_otherwise(world, options, |it| matches!(it, Shading::Auto { .. }), Shading::Phong);
        },
    },
    Removable { effect: "sky", without: |world, _| settings(world, |settings| settings.sky = Vec3::ZERO) },
    Removable {
        effect: "global ambient",
        without: |world, _| settings(world, |settings| settings.ambient = Vec3::ZERO),
    },
    Removable {
        effect: "ambient lights",
        without: |world, _| switch_off(world, |kind, _| kind == LightKind::Ambient),
    },
    Removable {
        effect: "directional lights",
        without: |world, _| switch_off(world, |kind, cone| kind == LightKind::Directional && !cone),
    },
    Removable {
        effect: "point lights",
        without: |world, _| switch_off(world, |kind, cone| kind == LightKind::Point && !cone),
    },
    Removable {
        effect: "spot lights",
        without: |world, _| switch_off(world, |kind, cone| kind != LightKind::Ambient && cone),
    },
    Removable { effect: "shadows", without: |_, options| options.shadows = false },
    Removable { effect: "polygon lights", without: |world, _| remove::<EmissiveLight>(world) },
    Removable {
        effect: "specular",
        without: |world, _| {
            each_surface(world, |surface| surface.specular = Vec3::ZERO);
            // A metallic-roughness texture sets the specular coefficient per texel.
            each_textures(world, |textures| textures.metallic_roughness = None);
        },
    },
    Removable {
        effect: "emission",
        without: |world, _| each_surface(world, |surface| surface.emission = Vec3::ZERO),
    },
    Removable { effect: "lightmaps", without: |_, options| options.lightmaps = false },
    Removable { effect: "irradiance volumes", without: |_, options| options.irradiance_volumes = false },
    Removable { effect: "textures", without: |world, _| remove::<MaterialTextures>(world) },
    Removable {
        effect: "normal textures",
        without: |world, _| each_textures(world, |textures| textures.normal = None),
    },
    Removable {
        effect: "occlusion textures",
        without: |world, _| each_textures(world, |textures| textures.occlusion = None),
    },
    Removable {
        effect: "alpha mask",
        without: |world, _| opaque(world, |mode| matches!(mode, AlphaMode::Mask { .. })),
    },
    Removable {
        effect: "alpha blending",
        without: |world, _| opaque(world, |mode| mode == AlphaMode::Blend),
    },
    Removable {
        effect: "two-sided",
        without: |world, _| each_material(world, |material| material.double_sided = false),
    },
    Removable { effect: "refraction", without: |_, options| options.refraction = false },
    Removable { effect: "planar mirrors", without: |_, options| options.mirror_depth = 0 },
    Removable { effect: "fog", without: |world, _| settings(world, |settings| settings.fog = None) },
];

fn settings(world: &mut World, change: impl FnOnce(&mut SceneSettings)) {
    change(&mut world.get_resource_or_insert_with(SceneSettings::default));
}

/// Switches lights off by their kind and by whether they have a cone.
fn switch_off(world: &mut World, which: impl Fn(LightKind, bool) -> bool) {
    for mut light in world.query::<&mut Light>().iter_mut(world) {
        let has_cone = light.spot.is_some_and(|cone| !cone.is_everywhere());
        light.enabled &= !which(light.kind, has_cone);
    }
}

fn each_material(world: &mut World, change: impl Fn(&mut Material)) {
    world.query::<&mut Material>().iter_mut(world).for_each(|mut material| change(&mut material));
}

fn each_textures(world: &mut World, change: impl Fn(&mut MaterialTextures)) {
    world.query::<&mut MaterialTextures>().iter_mut(world).for_each(|mut textures| change(&mut textures));
}

/// Replaces one shading technique by another, both for objects that chose it themselves and for the scene's
/// default.
fn shade_otherwise(world: &mut World, options: &mut FrameOptions, from: fn(Shading) -> bool, to: Shading) {
    if options.shading.is_some_and(from) {
        options.shading = Some(to);
    }
    settings(world, |settings| {
        if from(settings.shading) {
            settings.shading = to;
        }
    });
    for mut shading in world.query::<&mut Shading>().iter_mut(world).filter(|shading| from(**shading)) {
        *shading = to;
    }
}

fn each_surface(world: &mut World, change: impl Fn(&mut Surface)) {
    each_material(world, |material| {
        change(&mut material.front);
        material.back.iter_mut().for_each(&change);
    });
}

fn opaque(world: &mut World, which: impl Fn(AlphaMode) -> bool) {
    each_material(world, |material| {
        if which(material.alpha_mode) {
            material.alpha_mode = AlphaMode::Opaque;
        }
    });
}

fn remove<C: Component>(world: &mut World) {
    let having: Vec<Entity> = world.query_filtered::<Entity, With<C>>().iter(world).collect();
    for entity in having {
        world.entity_mut(entity).remove::<C>();
    }
}

/// What an effect costs, and how much it changes the picture.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct EffectCost {
    /// The name of the effect in the census.
    pub effect: &'static str,
    /// Milliseconds that a frame takes longer with the effect: the median over the rounds. Negative if the
    /// frame is slower without it.
    pub milliseconds: f64,
    /// Half of the interquartile range over the rounds, in milliseconds.
    pub spread: f64,
    /// Root mean square, over pixels and channels, of the change of radiance without the effect, relative to
    /// the mean radiance with it.
    pub difference: f64,
}

/// What a frame costs, and how its effects contribute to that.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct FrameCost {
    /// The device that it was measured on, with its driver.
    pub device: String,
    /// Width and height of the frame in pixels.
    pub size: [u32; 2],
    /// Milliseconds of a frame with all effects, from the call until the device has finished: the median over
    /// the rounds.
    pub milliseconds: f64,
    /// Number of measured rounds. Each round draws every frame once.
    pub rounds: usize,
    /// The cost of each effect that can be removed.
    pub effects: Vec<EffectCost>,
    /// The account of one frame with all effects, by stages, passes and effects, with the lights that its
    /// passes tested.
    pub accounting: Option<Accounting>,
}

/// A frame that is drawn repeatedly.
struct Drawn {
    world: World,
    options: FrameOptions,
    renderer: Renderer,
}

impl Drawn {
    fn new(gpu: &Gpu, (world, options): (World, FrameOptions)) -> Self {
        Self { world, options, renderer: Renderer::new(gpu) }
    }

    fn milliseconds(&mut self, target: &Offscreen) -> Result<f64, RenderError> {
        let begun = Instant::now();
        self.renderer.render(&mut self.world, &target.target(), &self.options)?;
        self.renderer.wait()?;
        Ok(begun.elapsed().as_secs_f64() * 1e3)
    }

    /// Returns the account of a frame. Its lights are counted in a second frame.
    fn accounting(&mut self, target: &Offscreen) -> Result<Option<Accounting>, RenderError> {
        let mut measured = |measure| -> Result<Option<Accounting>, RenderError> {
            let options = FrameOptions { measure, ..self.options.clone() };
            self.renderer.render(&mut self.world, &target.target(), &options)?;
            self.renderer.wait()?;
            Ok(self.renderer.accounting().cloned())
        };
        let mut accounting = measured(Measure::TimeAndInvocations)?;
        if let (Some(accounting), Some(counted)) = (&mut accounting, measured(Measure::Lights)?) {
            accounting.take_lights_of(&counted);
        }
        Ok(accounting)
    }

    /// Returns red, green and blue of each pixel, as radiance.
    fn radiance(&mut self, gpu: &Gpu, size: [u32; 2]) -> Result<Vec<Vec3>, RenderError> {
        let target = Offscreen::new(gpu, size[0], size[1], OffscreenFormat::LinearFloat)?;
        let options = FrameOptions {
            display: Display::Linear,
            exposure: Some(1.0),
            full_precision: true,
            ..self.options.clone()
        };
        Renderer::new(gpu).render(&mut self.world, &target.target(), &options)?;
        Ok(target.read_linear(gpu)?.iter().map(|pixel| pixel.truncate()).collect())
    }
}

/// Fewest rounds: with fewer, the spread would be meaningless.
const MIN_ROUNDS: usize = 5;
/// Most rounds: variations over a longer time come from the machine's load.
const MAX_ROUNDS: usize = 101;

/// Measures a scene's frame with all its effects, and without each of `effects` in turn. `scene` creates the
/// scene and the options of its frame anew for each of these. Rounds go on for about `time`; they are
/// interleaved, so that the machine's other load affects all frames alike.
///
/// # Errors
/// [`RenderError`], as for drawing a frame, or what `scene` returns.
pub fn effect_costs<E: From<RenderError>>(
    gpu: &Gpu,
    scene: &mut dyn FnMut() -> Result<(World, FrameOptions), E>,
    effects: &[Removable],
    size: [u32; 2],
    time: Duration,
) -> Result<FrameCost, E> {
    let mut frames = vec![Drawn::new(gpu, scene()?)];
    for effect in effects {
        let (mut world, mut options) = scene()?;
        effect.remove(&mut world, &mut options);
        frames.push(Drawn::new(gpu, (world, options)));
    }

    let pictures = frames.iter_mut().map(|frame| frame.radiance(gpu, size)).collect::<Result<Vec<_>, _>>()?;

    let target = Offscreen::new(gpu, size[0], size[1], OffscreenFormat::Rgba8)?;
    // Pipelines are created and buffers grow in the first frames.
    for frame in &mut frames {
        frame.milliseconds(&target)?;
        frame.milliseconds(&target)?;
    }
    let begun = Instant::now();
    let mut rounds: Vec<Vec<f64>> = Vec::new();
    while rounds.len() < MIN_ROUNDS || (begun.elapsed() < time && rounds.len() < MAX_ROUNDS) {
        rounds.push(frames.iter_mut().map(|frame| frame.milliseconds(&target)).collect::<Result<_, _>>()?);
    }

    let cost = |(index, effect): (usize, &Removable)| {
        let differences = rounds.iter().map(|round| round[0] - round[index + 1]).collect();
        let [low, milliseconds, high] = quartiles(differences);
        let difference = relative_difference(&pictures[0], &pictures[index + 1]);
        EffectCost { effect: effect.effect, milliseconds, spread: 0.5 * (high - low), difference }
    };
    Ok(FrameCost {
        device: gpu.describe(),
        size,
        milliseconds: quartiles(rounds.iter().map(|round| round[0]).collect())[1],
        rounds: rounds.len(),
        effects: effects.iter().enumerate().map(cost).collect(),
        accounting: frames[0].accounting(&target)?,
    })
}

/// Returns the lower quartile, the median and the upper quartile of a non-empty list.
fn quartiles(mut numbers: Vec<f64>) -> [f64; 3] {
    numbers.sort_by(f64::total_cmp);
    let last = numbers.len() - 1;
    [1, 2, 3].map(|quarter| numbers[quarter * last / 4])
}

/// Returns the root mean square of the difference of two pictures, relative to the mean of the first; 0 for
/// equal pictures.
fn relative_difference(with: &[Vec3], without: &[Vec3]) -> f64 {
    let numbers = 3.0 * with.len() as f64;
    let squares = with.iter().zip(without).map(|(a, b)| (a.as_dvec3() - b.as_dvec3()).length_squared());
    let rms = (squares.sum::<f64>() / numbers).sqrt();
    let mean = with.iter().map(|pixel| pixel.as_dvec3().element_sum()).sum::<f64>() / numbers;
    if rms == 0.0 { 0.0 } else { rms / mean.max(f64::MIN_POSITIVE) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_of_few_and_many() {
        assert_eq!(quartiles(vec![3.0]), [3.0; 3]);
        assert_eq!(quartiles(vec![5.0, 1.0, 2.0, 4.0, 3.0]), [2.0, 3.0, 4.0]);
    }

    #[test]
    fn pictures_differ_relative_to_their_mean() {
        let (grey, white) = (vec![Vec3::splat(0.5); 4], vec![Vec3::ONE; 4]);
        assert_eq!(relative_difference(&grey, &grey), 0.0);
        assert_eq!(relative_difference(&grey, &white), 1.0);
        assert_eq!(relative_difference(&white, &grey), 0.5);
        assert!(relative_difference(&[Vec3::ZERO; 4], &white).is_finite());
    }
}
