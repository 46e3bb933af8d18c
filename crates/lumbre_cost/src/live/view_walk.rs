//! Measures the Pareto front of settings for a view, one frame per step, in the same stages as `tune`.
//! Nothing in the World may move meanwhile, as all errors are measured against one picture.

use bevy_ecs::world::World;
use glam::DVec3;
use lumbre_render::{FrameOptions, RenderError};
use lumbre_trace::relative_error;

use super::side_view::SideView;
use super::view_front::{Priced, ViewFront};
use crate::tune::{Candidates, Choices, DrawSettings, Stage};
use crate::{ErrorOf, Point, Spread, pareto_front};

/// Number of rounds in a stage, and in the final measurement of what is left. Each round draws every way
/// once.
const ROUNDS: [usize; 2] = [3, 7];

/// A measurement of the settings for a view. Each step draws one frame.
pub struct ViewWalk {
    choices: Choices,
    found: Candidates,
    reference: Vec<DVec3>,
    /// The way in which the view was drawn when the measurement began, its error against the reference, and
    /// its times in the final rounds.
    now: (DrawSettings, f64, Vec<f64>),
    /// The stages that have not begun yet; the next one is last.
    ahead: Vec<Stage>,
    under_way: Leg,
}

/// Ways that are measured in the same rounds.
#[derive(Default)]
struct Leg {
    ways: Vec<DrawSettings>,
    /// Whether these are the final rounds.
    is_last: bool,
    /// Errors of the ways that are new.
    errors: Vec<Option<f64>>,
    times: Vec<Vec<f64>>,
    drawn: usize,
}

impl Leg {
    fn rounds(&self) -> usize {
        ROUNDS[usize::from(self.is_last)]
    }

    /// Returns the number of frames: a picture of each way, and every way once per round. The final rounds
    /// include the view as it is.
    fn frames(&self) -> usize {
        let timed = self.ways.len() + usize::from(self.is_last);
        self.ways.len() + self.rounds() * timed
    }
}

impl ViewWalk {
    /// Begins a measurement by drawing the view as it is, and in the most accurate way. `exposure` is that of
    /// the window, if it is not the camera's.
    ///
    /// # Errors
    /// As drawing a frame.
    pub fn begin(
        side: &mut SideView,
        world: &mut World,
        options: &FrameOptions,
    ) -> Result<Self, RenderError> {
        let choices = Choices::of(world, options.exposure).with_format_of(world);
        let best = choices.reference();
        let reference = best.drawn(world, options, |world, options| side.radiance(world, options))?;
        let reference = radiance(&reference);
        let as_it_is = radiance(&side.radiance(world, options)?);
        let error = relative_error(&reference, &as_it_is);
        let now = (DrawSettings::current(world, options), error, Vec::new());
        let mut ahead = Stage::ALL.to_vec();
        ahead.reverse();
        let mut walk =
            Self { choices, found: Candidates::default(), reference, now, ahead, under_way: Leg::default() };
        walk.set_out();
        Ok(walk)
    }

    /// Returns the fraction that is done. It is an estimate, since the result of a stage determines how much
    /// there is to do in the next.
    pub fn fraction(&self) -> f64 {
        let legs = (Stage::ALL.len() + 1) as f64;
        let ahead = if self.under_way.is_last { 0.0 } else { (self.ahead.len() + 1) as f64 };
        let part = self.under_way.drawn as f64 / self.under_way.frames().max(1) as f64;
        ((legs - ahead - 1.0 + part) / legs).clamp(0.0, 1.0)
    }

    /// Draws the next frame. After the last one it returns the front. World and options must be the same in
    /// all steps.
    ///
    /// # Errors
    /// As drawing a frame.
    pub fn step(
        &mut self,
        side: &mut SideView,
        world: &mut World,
        options: &FrameOptions,
    ) -> Result<Option<ViewFront>, RenderError> {
        let leg = &mut self.under_way;
        let (drawn, ways) = (leg.drawn, leg.ways.len());
        if drawn < ways {
            let way = leg.ways[drawn];
            let is_known = self.found.settings.contains(&way);
            leg.errors.push(match is_known {
                true => None,
                false => {
                    let picture =
                        way.drawn(world, options, |world, options| side.radiance(world, options))?;
                    Some(relative_error(&self.reference, &radiance(&picture)))
                }
            });
        } else {
            let timed = ways + usize::from(leg.is_last);
            let (round, place) = ((drawn - ways) / timed, (drawn - ways) % timed);
            // The order is reversed in every other round, so that no way always follows the same one.
            let place = if round % 2 == 0 { place } else { timed - 1 - place };
            match leg.ways.get(place) {
                Some(way) => {
                    let time =
                        way.drawn(world, options, |world, options| side.milliseconds(world, options))?;
                    leg.times[place].push(time);
                }
                None => self.now.2.push(side.milliseconds(world, options)?),
            }
        }
        leg.drawn += 1;
        if leg.drawn < leg.frames() {
            return Ok(None);
        }
        self.arrive();
        if self.under_way.is_last {
            return Ok(self.front());
        }
        self.set_out();
        Ok(None)
    }

    /// Begins the next stage in which there is something to choose, or the final rounds.
    fn set_out(&mut self) {
        while let Some(stage) = self.ahead.pop() {
            let ways = self.found.next(stage, &self.choices);
            if ways.len() > 1 {
                return self.walk(ways, false);
            }
        }
        let contenders = self.found.contenders();
        let mut ways: Vec<DrawSettings> = contenders.iter().map(|&one| self.found.settings[one]).collect();
        if ways.is_empty() {
            ways = vec![self.choices.reference()];
        }
        self.walk(ways, true);
    }

    fn walk(&mut self, ways: Vec<DrawSettings>, is_last: bool) {
        let times = vec![Vec::new(); ways.len()];
        self.under_way = Leg { ways, is_last, times, ..Leg::default() };
    }

    /// Takes the results of a stage.
    fn arrive(&mut self) {
        let leg = &self.under_way;
        self.found.begin();
        for ((way, error), times) in leg.ways.iter().zip(&leg.errors).zip(&leg.times) {
            let taken = self.found.take(*way, Spread::of(times), |label| {
                let error = error.map(|relative_rmse| ErrorOf { relative_rmse, ..ErrorOf::default() });
                Ok::<_, std::convert::Infallible>(Some(Point { label, error, ..Point::default() }))
            });
            let Ok(()) = taken;
        }
    }

    /// Returns the ways that no other one beats in the final rounds.
    fn front(&self) -> Option<ViewFront> {
        let latest: Vec<(DrawSettings, Point)> = self
            .found
            .contenders()
            .iter()
            .map(|&place| (self.found.settings[place], self.found.points[place].clone()))
            .collect();
        let front = pareto_front(latest.iter().map(|(_, point)| point));
        let settings = |point: &Point| {
            latest.iter().find(|(_, other)| std::ptr::eq(other, point)).map(|(settings, _)| *settings)
        };
        let mut ways: Vec<Priced> = front
            .into_iter()
            .filter_map(|point| {
                Some(Priced {
                    label: point.label.clone(),
                    settings: settings(point)?,
                    milliseconds: point.milliseconds?,
                    error: point.error?.relative_rmse,
                })
            })
            .collect();
        ways.sort_by(|a, b| a.milliseconds.median.total_cmp(&b.milliseconds.median));
        let (settings, error, times) = &self.now;
        let label = settings.label(&self.choices.reference());
        let now = Priced { label, settings: *settings, milliseconds: Spread::of(times)?, error: *error };
        Some(ViewFront { ways, now })
    }
}

/// Returns the colours without alpha, in f64.
fn radiance(picture: &[glam::Vec4]) -> Vec<DVec3> {
    picture.iter().map(|pixel| pixel.truncate().as_dvec3()).collect()
}
