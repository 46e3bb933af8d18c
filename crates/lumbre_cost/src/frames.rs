//! Frames that are drawn again and again, side by side: their times, their counts, and the picture that each makes. Not the scenes.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;
use std::time::Instant;

use bevy_ecs::world::World;
use glam::DQuat;
use lumbre_optics::Light;
use lumbre_render::{
    Display, FrameOptions, FrameTarget, Measure, Offscreen, OffscreenFormat, Renderer, Statistics,
};

use lumbre_scene::Transform;

use crate::picture::Picture;
use crate::rounds::{Work, in_rounds, milliseconds_since};
use crate::{Conditions, CostError, Spread};

/// A scene, and how a frame of it is drawn.
pub struct Frame {
    /// The scene, perhaps of several frames.
    pub world: Rc<RefCell<World>>,
    /// How it is drawn.
    pub options: FrameOptions,
    /// Frames of one name share a renderer, and with it what it has compiled, which takes longer than many a frame. Each is then drawn twice in a row, and the
    /// second one timed: in the first the renderer reads another World. Without a name a frame has a renderer of its own.
    pub renderer: Option<&'static str>,
    /// Before each frame that is timed every lamp that casts shadows moves by [`HAIR`] and back again: no shadow map is as it was.
    pub moving_lamps: bool,
}

/// How far lamps move, in metres, and along which axis directional lights turn, by as many radians.
const HAIR: f64 = 1e-4;

impl Frame {
    /// A frame with a renderer of its own.
    pub fn new(world: World, options: FrameOptions) -> Self {
        Self::of(&Rc::new(RefCell::new(world)), options)
    }

    /// The same of a scene that other frames show, too.
    pub fn of(world: &Rc<RefCell<World>>, options: FrameOptions) -> Self {
        Self { world: Rc::clone(world), options, renderer: None, moving_lamps: false }
    }

    /// The same with a renderer in common with all that name it so.
    pub fn sharing(self, renderer: &'static str) -> Self {
        Self { renderer: Some(renderer), ..self }
    }

    /// The same with lamps that move.
    pub fn with_moving_lamps(self) -> Self {
        Self { moving_lamps: true, ..self }
    }
}

/// What was measured of a frame.
pub struct DrawnFrame {
    /// Milliseconds of each round, from the call until the device has finished.
    pub times: Vec<f64>,
    /// What it shows, in 32-bit floats and without exposure.
    pub picture: Picture,
    /// Vertices and fragments that were shaded. How often a device shades a vertex that several triangles share, and whether it counts fragments that another one hides, is
    /// its own affair: nothing where only that is counted which is the same everywhere.
    pub invocations: Option<[u64; 2]>,
    /// What the renderer says of it.
    pub statistics: Statistics,
}

impl DrawnFrame {
    /// The median and the quartiles of its times.
    pub fn spread(&self) -> Option<Spread> {
        Spread::of(&self.times)
    }

    /// Counts that do not depend on the hour.
    pub fn counts(&self) -> BTreeMap<String, f64> {
        let of_device = self.invocations.map(|[vertices, fragments]| {
            [("vertex invocations", vertices as f64), ("fragment invocations", fragments as f64)]
        });
        let counts = [
            ("triangles", self.statistics.triangles as f64),
            ("draw calls", self.statistics.draws as f64),
            ("bytes uploaded", self.statistics.uploads.total() as f64),
        ];
        of_device.into_iter().flatten().chain(counts).map(|(name, count)| (name.to_owned(), count)).collect()
    }
}

/// Draws every frame once for its picture, and then all in turn for about `seconds` (see [`Conditions::rounds`]). `told` are the shares of the
/// study that are done before and after.
///
/// # Errors
/// [`CostError::Render`], [`CostError::Interrupted`].
pub fn draw_frames(
    conditions: &Conditions<'_>,
    frames: Vec<Frame>,
    seconds: f64,
    told: [f64; 2],
) -> Result<Vec<DrawnFrame>, CostError> {
    let (gpu, (width, height)) = (conditions.gpu, conditions.size);
    let [before, after] = told;
    let mut drawn = Vec::new();
    let count = frames.len() as f64;
    for frame in &frames {
        conditions.tell(before + 0.3 * (after - before) * drawn.len() as f64 / count)?;
        drawn.push(picture_of(conditions, &mut frame.world.borrow_mut(), &frame.options)?);
    }
    let target = Offscreen::new(gpu, width, height, OffscreenFormat::Rgba8)?;
    let target = target.target();
    let mut shared: Vec<&'static str> = frames.iter().filter_map(|frame| frame.renderer).collect();
    shared.sort_unstable();
    shared.dedup();
    let shared: Vec<_> = shared.into_iter().map(|name| (name, RefCell::new(Renderer::new(gpu)))).collect();
    let mut work: Vec<Work<'_>> = Vec::new();
    for Frame { world, options, renderer, moving_lamps } in &frames {
        let named = shared.iter().find(|(name, _)| Some(*name) == *renderer);
        let target = &target;
        let mut side = HAIR;
        let mut draw = move |renderer: &mut Renderer| -> Result<f64, CostError> {
            if *moving_lamps {
                move_lamps(&mut world.borrow_mut(), side);
                side = -side;
            }
            timed_frame(renderer, &mut world.borrow_mut(), target, options)
        };
        match named {
            Some((_, renderer)) => work.push(Box::new(move || {
                let mut renderer = renderer.borrow_mut();
                draw(&mut renderer)?;
                draw(&mut renderer)
            })),
            None => {
                let mut renderer = Renderer::new(gpu);
                work.push(Box::new(move || draw(&mut renderer)));
            }
        }
    }
    let go_on = |share: f64| conditions.tell(before + (0.3 + 0.7 * share) * (after - before));
    let times = in_rounds(&mut work, conditions.rounds(seconds), &go_on)?;
    for (drawn, times) in drawn.iter_mut().zip(times) {
        drawn.times = times;
    }
    Ok(drawn)
}

/// Milliseconds of a frame, from the call until the device has finished.
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

/// Moves and turns every lamp that casts shadows.
fn move_lamps(world: &mut World, by: f64) {
    let mut lamps = world.query::<(&Light, &mut Transform)>();
    for (_, mut place) in lamps.iter_mut(world).filter(|(light, _)| light.shadow) {
        place.translation.x += by;
        place.rotation *= DQuat::from_rotation_x(by);
    }
}

fn picture_of(
    conditions: &Conditions<'_>,
    world: &mut World,
    options: &FrameOptions,
) -> Result<DrawnFrame, CostError> {
    let (width, height) = conditions.size;
    let target = Offscreen::new(conditions.gpu, width, height, OffscreenFormat::LinearFloat)?;
    let options = FrameOptions {
        display: Display::Linear,
        exposure: Some(1.0),
        full_precision: true,
        measure: if conditions.counts_only { Measure::Nothing } else { Measure::TimeAndInvocations },
        ..options.clone()
    };
    let mut renderer = conditions.pictures.borrow_mut();
    let report = renderer.render(world, &target.target(), &options)?;
    let measured = renderer.wait()?.cloned().unwrap_or_default();
    let invocations = measured.passes.iter().filter_map(|pass| pass.invocations);
    let sum = invocations
        .fold([0, 0], |[vertices, fragments], found| [vertices + found.vertex, fragments + found.fragment]);
    let radiance = target.read_linear(conditions.gpu)?;
    Ok(DrawnFrame {
        times: Vec::new(),
        picture: Picture {
            width: width as usize,
            radiance: radiance.iter().map(|pixel| pixel.truncate().as_dvec3()).collect(),
        },
        invocations: (!conditions.counts_only).then_some(sum),
        statistics: report.statistics,
    })
}

/// A frame for its picture alone.
///
/// # Errors
/// [`CostError::Render`].
pub fn draw_picture(
    conditions: &Conditions<'_>,
    world: &mut World,
    options: &FrameOptions,
) -> Result<Picture, CostError> {
    Ok(picture_of(conditions, world, options)?.picture)
}

#[cfg(test)]
mod tests {
    use lumbre_render::Gpu;
    use lumbre_scene::update_transforms;

    use super::*;
    use crate::scenes::{Air, room};

    /// Both clocks run over the same frames, so that what else the machine does meets both.
    #[test]
    fn a_studys_time_is_that_of_the_frames_own_account() -> Result<(), CostError> {
        let gpu = Gpu::headless()?;
        let target = Offscreen::new(&gpu, 160, 90, OffscreenFormat::Rgba8)?;
        let mut world = room(Air::Clear);
        update_transforms(&mut world);
        let mut renderer = Renderer::new(&gpu);
        let options = FrameOptions { measure: Measure::Time, ..FrameOptions::default() };
        let mut apart = Vec::new();
        for number in 0..11 {
            let time = timed_frame(&mut renderer, &mut world, &target.target(), &options)?;
            let account = renderer.accounting().and_then(|account| account.wall_ms);
            let account = account.unwrap_or_else(|| panic!("frame {number} was measured and waited for"));
            apart.push((time / account - 1.0).abs());
        }
        apart.sort_by(f64::total_cmp);
        // The median: the scheduler may take the thread away between one clock and the other.
        assert!(apart[5] < 0.1, "{apart:?}");
        Ok(())
    }
}
