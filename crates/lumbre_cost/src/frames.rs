//! Draws frames repeatedly and alternately, for their times, their counts and their pictures.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use bevy_ecs::world::World;
use glam::DQuat;
use lumbre_optics::Light;
use lumbre_render::{FrameOptions, FrameTarget, Measure, Offscreen, OffscreenFormat, Renderer, Statistics};

use lumbre_scene::Transform;

use crate::compile_ahead::{Begun, Drawing, compile_ahead};
use crate::frame::{Frame, picture_options};
use crate::picture::Picture;
use crate::rounds::{Rounds, Work, in_rounds, milliseconds_since, warm_up};
use crate::{Conditions, CostError, Spread};

/// Distance in metres by which lamps move, and angle in radians by which directional lights turn.
const HAIR: f64 = 1e-4;

/// The measurements of a frame.
#[derive(Default)]
pub struct DrawnFrame {
    /// Milliseconds of each round, from the call until the device has finished; empty if it is not timed.
    pub times: Vec<f64>,
    /// Its picture, in 32-bit floats and without exposure; empty if it is not drawn for its picture.
    pub picture: Picture,
    /// Numbers of vertex and fragment invocations; pixels that compute shaders light count as fragments. How often a device shades a vertex that several triangles
    /// share, and whether it counts hidden fragments, depends on the device: `None` if only counts that are
    /// the same on all machines are wanted.
    pub invocations: Option<[u64; 2]>,
    /// Number of lights evaluated at vertices and fragments, and how many of these evaluations contributed
    /// visibly; `None` if this was not requested or the device cannot count it.
    pub light_evaluations: Option<[u64; 2]>,
    /// The renderer's statistics.
    pub statistics: Statistics,
}

impl DrawnFrame {
    /// Returns the median and the quartiles of its times.
    pub fn spread(&self) -> Option<Spread> {
        Spread::of(&self.times)
    }

    /// Returns the counts that do not depend on when they are taken.
    pub fn counts(&self) -> BTreeMap<String, f64> {
        let of_device = self.invocations.map(|[vertices, fragments]| {
            [("vertex invocations", vertices as f64), ("fragment invocations", fragments as f64)]
        });
        let of_lights = self.light_evaluations.map(|[tested, contributing]| {
            [("light evaluations", tested as f64), ("light evaluations above 1/255", contributing as f64)]
        });
        let of_device = of_device.into_iter().chain(of_lights);
        let counts = [
            ("triangles", self.statistics.triangles as f64),
            ("draw calls", self.statistics.draws as f64),
            ("bytes uploaded", self.statistics.uploads.total() as f64),
        ];
        of_device.flatten().chain(counts).map(|(name, count)| (name.to_owned(), count)).collect()
    }
}

/// Draws every frame once for its picture, and then all of them in turn for about `seconds` seconds (see
/// [`Conditions::rounds`]). `told` are the fractions of the study that are done before and after.
///
/// # Errors
/// [`CostError::Render`], [`CostError::Interrupted`].
pub fn draw_frames(
    conditions: &Conditions<'_>,
    frames: Vec<Frame>,
    seconds: f64,
    told: [f64; 2],
) -> Result<Vec<DrawnFrame>, CostError> {
    draw_in_rounds(conditions, frames, conditions.rounds(seconds), told)
}

/// Does what [`draw_frames`] does, in these rounds.
///
/// # Errors
/// [`CostError::Render`], [`CostError::Interrupted`].
pub fn draw_in_rounds(
    conditions: &Conditions<'_>,
    frames: Vec<Frame>,
    rounds: Rounds,
    [before, after]: [f64; 2],
) -> Result<Vec<DrawnFrame>, CostError> {
    let renderers = renderers(conditions, &frames);
    let (width, height) = conditions.size;
    let format = if conditions.as_shown { OffscreenFormat::Rgba8 } else { OffscreenFormat::LinearFloat };
    let target = Offscreen::new(conditions.gpu, width, height, format)?;
    let timed_target = target.target();
    let part = |share: f64| before + share * (after - before);
    let timed: Vec<(&Frame, usize)> = frames.iter().zip(0..).filter(|(frame, _)| frame.is_timed).collect();
    let mut work: Vec<Work<'_>> =
        timed.iter().map(|frame| timed_work(conditions, *frame, &renderers, &timed_target)).collect();
    let mut drawn = while_compiling_ahead(conditions, &frames, |begun| {
        let mut drawn = Vec::new();
        for (number, frame) in frames.iter().enumerate() {
            if !frame.is_timed {
                begun.begin(number, Drawing::Timed);
            }
            if !frame.is_pictured {
                begun.begin(number, Drawing::Picture);
                begun.begin(number, Drawing::Counted);
            }
        }
        for (number, frame) in frames.iter().enumerate() {
            conditions.tell(part(0.3 * number as f64 / frames.len() as f64))?;
            if !frame.is_pictured {
                drawn.push(DrawnFrame::default());
                continue;
            }
            let mut world = frame.world();
            let draw = |renderer: &RefCell<Renderer>, world: &mut World, drawing: Drawing| {
                begun.begin(number, drawing);
                let measure = measure(conditions, drawing);
                picture_of(conditions, &mut renderer.borrow_mut(), world, &frame.options, measure)
            };
            if counts_in_picture(conditions) {
                begun.begin(number, Drawing::Picture);
                drawn.push(draw(conditions.pictures, &mut world, Drawing::Counted)?);
                continue;
            }
            let renderer = if conditions.as_shown { conditions.pictures } else { &*renderers[number] };
            let mut found = draw(renderer, &mut world, Drawing::Picture)?;
            if conditions.counts_lights {
                found.light_evaluations =
                    draw(conditions.pictures, &mut world, Drawing::Counted)?.light_evaluations;
            }
            drawn.push(found);
        }
        // Frames that were drawn for their pictures are warm, unless they are timed with other pipelines.
        let cold = work.iter_mut().zip(&timed);
        let drawn_so = |frame: &Frame| frame.is_pictured && !conditions.as_shown && frame.renderer.is_some();
        let cold = cold.filter(|(_, (frame, _))| !drawn_so(frame));
        for (piece, (_, number)) in cold {
            begun.begin(*number, Drawing::Timed);
            warm_up([piece], rounds, &|| conditions.tell(part(0.3)))?;
        }
        Ok(drawn)
    })?;
    let go_on = |share: f64| conditions.tell(part(0.3 + 0.7 * share));
    let times = in_rounds(&mut work, rounds, &go_on)?;
    for ((_, number), times) in timed.iter().zip(times) {
        drawn[*number].times = times;
    }
    Ok(drawn)
}

/// Sets the flag when it is dropped, also after an error or a panic.
struct EndsWhenDropped<'a>(&'a AtomicBool);

impl Drop for EndsWhenDropped<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Calls `draw` while the frames' shaders are compiled on a second device, if there is one. Compiling has
/// ended when this returns.
fn while_compiling_ahead<T>(
    conditions: &Conditions<'_>,
    frames: &[Frame],
    draw: impl FnOnce(&Begun) -> Result<T, CostError>,
) -> Result<T, CostError> {
    let (begun, end) = (Begun::none_of(frames.len()), AtomicBool::new(false));
    let size = conditions.size;
    std::thread::scope(|scope| {
        let ahead = conditions.ahead.filter(|_| frames.len() > 1).map(|gpu| {
            let (begun, end) = (&begun, &end);
            // Frames that are timed as their pictures are drawn use the same pipelines.
            let drawings = [
                (Drawing::Picture, !counts_in_picture(conditions)),
                (Drawing::Counted, conditions.counts_lights),
                (Drawing::Timed, conditions.as_shown),
            ];
            let drawings: Vec<Drawing> =
                drawings.into_iter().filter(|(_, is_made)| *is_made).map(|(drawing, _)| drawing).collect();
            scope.spawn(move || compile_ahead(gpu, size, frames, &drawings, begun, end))
        });
        let ending = EndsWhenDropped(&end);
        let drawn = draw(&begun);
        drop(ending);
        if ahead.is_some_and(|ahead| ahead.join().is_err()) {
            // The panic has printed its message. The shaders are compiled when they are needed.
            tracing::debug!("what compiled ahead has panicked");
        }
        drawn
    })
}

/// Returns the renderer of each frame; frames with the same name share one.
fn renderers(conditions: &Conditions<'_>, frames: &[Frame]) -> Vec<Rc<RefCell<Renderer>>> {
    let mut shared: BTreeMap<&'static str, Rc<RefCell<Renderer>>> = BTreeMap::new();
    let new = || Rc::new(RefCell::new(Renderer::new(conditions.gpu)));
    let of = |frame: &Frame| {
        frame.renderer.map_or_else(new, |name| Rc::clone(shared.entry(name).or_insert_with(new)))
    };
    frames.iter().map(of).collect()
}

/// Returns the timed work of a frame.
fn timed_work<'a>(
    conditions: &Conditions<'_>,
    (frame, number): (&'a Frame, usize),
    renderers: &'a [Rc<RefCell<Renderer>>],
    target: &'a FrameTarget,
) -> Work<'a> {
    let mut side = HAIR;
    let options = match conditions.as_shown {
        true => frame.options.clone(),
        false => picture_options(&frame.options),
    };
    // A shared renderer has read the World of another frame before.
    let is_shared = frame.renderer.is_some();
    Box::new(move || {
        let mut renderer = renderers[number].borrow_mut();
        let mut world = frame.world();
        let mut draw = || -> Result<f64, CostError> {
            if frame.moving_lamps {
                move_lamps(&mut world, side);
                side = -side;
            }
            timed_frame(&mut renderer, &mut world, target, &options)
        };
        if is_shared {
            draw()?;
        }
        draw()
    })
}

/// Returns the milliseconds of a frame, from the call until the device has finished.
fn timed_frame(
    renderer: &mut Renderer,
    world: &mut World,
    target: &FrameTarget,
    options: &FrameOptions,
) -> Result<f64, CostError> {
    let begun = Instant::now();
    renderer.render(world, target, options)?;
    renderer.wait()?;
    Ok(milliseconds_since(begun))
}

/// Moves or turns every lamp that casts shadows.
fn move_lamps(world: &mut World, by: f64) {
    let mut lamps = world.query::<(&Light, &mut Transform)>();
    for (_, mut place) in lamps.iter_mut(world).filter(|(light, _)| light.shadow) {
        place.translation.x += by;
        place.rotation *= DQuat::from_rotation_x(by);
    }
}

/// Returns whether the light evaluations of a frame are counted in the drawing that its picture is taken from. The
/// counting shader variants of a software rasterizer draw the same picture to the bit, and compiling others for it
/// would take longer than anything else. On other devices rounding may differ.
fn counts_in_picture(conditions: &Conditions<'_>) -> bool {
    // Frames that are timed as their pictures are drawn need the pipelines of the picture anyway.
    conditions.counts_lights && conditions.as_shown && conditions.gpu.is_software()
}

/// Returns what is measured while a picture is drawn.
fn measure(conditions: &Conditions<'_>, drawing: Drawing) -> Measure {
    match drawing {
        Drawing::Counted => Measure::Lights,
        _ if conditions.counts_only => Measure::Nothing,
        _ => Measure::TimeAndInvocations,
    }
}

/// Draws a frame for its picture and its counts: those of lights, as counted by shader variants, if they are measured
/// and the device can count them.
fn picture_of(
    conditions: &Conditions<'_>,
    renderer: &mut Renderer,
    world: &mut World,
    options: &FrameOptions,
    measure: Measure,
) -> Result<DrawnFrame, CostError> {
    let (width, height) = conditions.size;
    let target = Offscreen::new(conditions.gpu, width, height, OffscreenFormat::LinearFloat)?;
    let options = FrameOptions { measure, ..picture_options(options) };
    let report = renderer.render(world, &target.target(), &options)?;
    let measured = renderer.wait()?.cloned().unwrap_or_default();
    let invocations = measured.passes.iter().filter_map(|pass| pass.invocations);
    let sum = invocations.fold([0, 0], |[vertices, fragments], found| {
        [vertices + found.vertex, fragments + found.fragment + found.compute]
    });
    let radiance = target.read_linear(conditions.gpu)?;
    Ok(DrawnFrame {
        times: Vec::new(),
        picture: Picture {
            width: width as usize,
            radiance: radiance.iter().map(|pixel| pixel.truncate().as_dvec3()).collect(),
        },
        invocations: (!conditions.counts_only).then_some(sum),
        light_evaluations: (measure == Measure::Lights).then(|| lights_of(renderer)).flatten(),
        statistics: report.statistics,
    })
}

/// Returns how many lights the last frame has evaluated, and how many of these evaluations contribute; `None` if the
/// device cannot count them.
fn lights_of(renderer: &Renderer) -> Option<[u64; 2]> {
    let counts =
        renderer.accounting().into_iter().flat_map(|account| &account.passes).filter_map(|pass| pass.lights);
    counts.fold(None, |sum, found| {
        let [tested, contributing] = sum.unwrap_or([0, 0]);
        Some([tested + found.tested, contributing + found.contributing])
    })
}

/// Draws a frame for its picture only.
///
/// # Errors
/// [`CostError::Render`].
pub fn draw_picture(
    conditions: &Conditions<'_>,
    world: &mut World,
    options: &FrameOptions,
) -> Result<Picture, CostError> {
    let measure = measure(conditions, Drawing::Picture);
    Ok(picture_of(conditions, &mut conditions.pictures.borrow_mut(), world, options, measure)?.picture)
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;
    use std::sync::{Arc, Mutex};

    use lumbre_optics::Shading;
    use lumbre_render::{Gpu, LightLists};
    use lumbre_scene::update_transforms;

    use super::*;
    use crate::converged::ConvergedBakes;
    use crate::scenes::{
        Air, BallsAndLamps, assorted_balls, balls_and_lamps, every_effect, fence, mirror_and_glass, room,
    };
    use crate::shared_bakes::SharedBakes;

    /// Calls `draw` under the conditions of a quick report of small pictures.
    fn under_conditions<T>(gpu: &Gpu, draw: impl FnOnce(&Conditions<'_>) -> T) -> T {
        let (pictures, converged) = (RefCell::new(Renderer::new(gpu)), ConvergedBakes::default());
        let (bakes, folder) = (SharedBakes::default(), std::env::temp_dir());
        draw(&Conditions {
            gpu,
            ahead: None,
            pictures: &pictures,
            converged: &converged,
            bakes: &bakes,
            quick: true,
            counts_only: false,
            counts_lights: true,
            size: (64, 36),
            size_of_report: (64, 36),
            as_shown: true,
            seed: 0,
            folder: &folder,
            files: &[],
            listener: &|_| ControlFlow::Continue(()),
        })
    }

    #[test]
    fn the_picture_with_its_lights_counted_is_that_of_the_frame_to_the_bit() -> Result<(), CostError> {
        let gpu = Gpu::headless()?;
        if !gpu.is_software() {
            println!("skipped: a report counts the lights of this device in drawings of their own");
            return Ok(());
        }
        let lamps = BallsAndLamps { lamps: 64, threshold: 0.1, seed: 0 };
        let scenes: [(&str, World); 7] = [
            ("room", room(Air::Clear)),
            ("hazy room", room(Air::Hazy)),
            ("every effect", every_effect()),
            ("fence with shadows", fence()),
            ("mirror and glass", mirror_and_glass()),
            ("assorted balls", assorted_balls()),
            ("balls and lamps", balls_and_lamps(lamps)),
        ];
        let whole = FrameOptions::default();
        let ways = [
            whole.clone(),
            FrameOptions { multisample: Some(true), ..whole.clone() },
            FrameOptions { light_lists: LightLists::Clusters, ..whole.clone() },
            FrameOptions { shading: Some(Shading::Gouraud), ..whole.clone() },
            FrameOptions { shading: Some(Shading::Flat), shadows: false, ..whole },
        ];
        under_conditions(&gpu, |conditions| {
            assert!(counts_in_picture(conditions));
            for (name, mut world) in scenes {
                update_transforms(&mut world);
                // Each way needs shaders of its own, which take most of the time.
                let ways =
                    if matches!(name, "every effect" | "balls and lamps") { &ways[..] } else { &ways[..1] };
                for options in ways {
                    let mut drawn = |drawing| {
                        let measure = measure(conditions, drawing);
                        picture_of(conditions, &mut Renderer::new(&gpu), &mut world, options, measure)
                    };
                    let (plain, counted) = (drawn(Drawing::Picture)?, drawn(Drawing::Counted)?);
                    assert!(plain.picture == counted.picture, "{name}: {options:?}");
                    assert_eq!(plain.invocations, counted.invocations, "{name}: {options:?}");
                    let [tested, contributing] = counted.light_evaluations.unwrap_or_default();
                    assert!(tested >= contributing && contributing > 0, "{name}: {options:?}");
                    let uncounted = DrawnFrame { light_evaluations: None, ..counted };
                    assert_eq!(plain.counts(), uncounted.counts(), "{name}: {options:?}");
                }
            }
            Ok(())
        })
    }

    #[test]
    fn what_is_compiled_ahead_changes_no_picture_and_no_count() -> Result<(), CostError> {
        let gpu = Gpu::headless()?;
        let other = gpu.another()?;
        let drawn = |ahead, as_shown| -> Result<Vec<DrawnFrame>, CostError> {
            let world = Arc::new(Mutex::new(room(Air::Clear)));
            let lit = FrameOptions { shadows: false, ..FrameOptions::default() };
            let frames = vec![
                Frame::of(&world, FrameOptions::default()).sharing("both"),
                Frame::of(&world, lit).sharing("both"),
                Frame::new(room(Air::Hazy), FrameOptions::default()).with_moving_lamps(),
                Frame::of(&world, FrameOptions::default()).sharing("both").pictured(false),
            ];
            under_conditions(&gpu, |conditions| {
                draw_frames(&Conditions { ahead, as_shown, ..*conditions }, frames, 0.0, [0.0, 1.0])
            })
        };
        for as_shown in [false, true] {
            for (alone, together) in drawn(None, as_shown)?.iter().zip(drawn(Some(&other), as_shown)?) {
                assert!(alone.picture.radiance == together.picture.radiance);
                assert_eq!(alone.counts(), together.counts());
                assert_eq!(together.times.len(), 5);
            }
            let pictured = drawn(None, as_shown)?.into_iter().map(|one| !one.picture.radiance.is_empty());
            assert_eq!(pictured.collect::<Vec<_>>(), [true, true, true, false]);
        }
        Ok(())
    }
    #[test]
    fn a_frame_that_is_timed_is_drawn_once() -> Result<(), CostError> {
        let gpu = Gpu::headless()?;
        let target = Offscreen::new(&gpu, 48, 27, OffscreenFormat::Rgba8)?;
        let (mut world, mut renderer) = (room(Air::Clear), Renderer::new(&gpu));
        update_transforms(&mut world);
        let options = FrameOptions { measure: Measure::Time, ..FrameOptions::default() };
        for number in 1..=3 {
            let milliseconds = timed_frame(&mut renderer, &mut world, &target.target(), &options)?;
            let account = renderer.accounting();
            let drawn = account.map(|account| account.frame);
            assert_eq!(drawn, Some(number));
            // The time contains the whole frame.
            let whole = account.and_then(|account| account.wall_ms);
            assert!(
                whole.is_some_and(|whole| 0.0 < whole && whole <= milliseconds),
                "{whole:?} {milliseconds}"
            );
        }
        Ok(())
    }
}
