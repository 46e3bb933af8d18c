//! The density and the format of lightmaps among the settings of a level: the chosen settings are measured with
//! coarser and with packed maps too. The time of a frame hardly depends on them, so that what is saved are bytes:
//! of the maps that keep the goal, those with the fewest are chosen.

use bevy_ecs::prelude::*;
use lumbre_render::LightmapMemory;
use lumbre_scene::{LightmapEncoding, shown_lightmaps};

use super::candidates::Candidates;
use super::draw_settings::DrawSettings;
use super::goal::{Goal, keeps, look_alike};
use crate::Point;
use crate::findings::{error_of, listed, rounded, times_of};

/// The count of a point that says how large its lightmaps are on the device.
pub const LIGHTMAP_BYTES: &str = "bytes of lightmaps";

/// How many texels become one along each side, the densest first.
const REDUCTIONS: [u32; 4] = [1, 2, 4, 8];

/// Formats on the device, the most accurate first.
const FORMATS: [LightmapEncoding; 2] = [LightmapEncoding::Rgb16Float, LightmapEncoding::Rgb9E5];

/// The sizes of a level's lightmaps.
pub(crate) struct LightmapSizes(Vec<[u32; 2]>);

impl LightmapSizes {
    /// Returns the sizes of the lightmaps that a World shows.
    pub fn of(world: &mut World) -> Self {
        Self(shown_lightmaps(world).into_iter().map(|image| [image.width, image.height]).collect())
    }

    /// Returns true if there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns their bytes on the device with these settings.
    pub fn bytes(&self, way: &DrawSettings) -> f64 {
        let reduced = |sides: &[u32; 2]| sides.map(|side| side.div_ceil(way.lightmap_reduction));
        LightmapMemory::of(way.lightmap_format, self.0.iter().map(reduced)).bytes as f64
    }
}

/// Returns settings with lightmaps of each density in each format, beginning with the settings themselves, whose
/// lightmaps are those of the most accurate settings.
pub(crate) fn variants(of: DrawSettings) -> Vec<DrawSettings> {
    let in_formats = |lightmap_reduction| {
        FORMATS.map(|lightmap_format| DrawSettings { lightmap_reduction, lightmap_format, ..of })
    };
    REDUCTIONS.into_iter().flat_map(in_formats).collect()
}

/// Returns the index of the lightmaps with the fewest bytes that do as well as the first, with which settings
/// were chosen: they keep the goal, are not distinguishably slower and, if the goal is a time, look alike.
/// `points` have their bytes beside them.
pub(crate) fn choose(points: &[(&Point, f64)], goal: Goal) -> Option<usize> {
    let (first, _) = points.first()?;
    let (time, error) = (first.milliseconds?, first.error?.relative_rmse);
    let does_as_well = |point: &Point| {
        let (Some(own), Some(found)) = (point.milliseconds, point.error) else { return false };
        let is_alike = goal.milliseconds.is_none() || look_alike(error, found.relative_rmse);
        // The first reached the goal in earlier rounds. A time that is not distinguishable from its time now
        // reaches the goal as well.
        is_alike && !time.is_below(&own) && keeps(Goal { milliseconds: None, ..goal }, own, found)
    };
    let kept = points.iter().enumerate().filter(|(_, (point, _))| does_as_well(point));
    kept.min_by(|(_, a), (_, b)| a.1.total_cmp(&b.1)).map(|(place, _)| place)
}

/// Returns the ways of the last measurement that no other one beats in time, error and bytes, from the cheapest
/// to the most accurate. The chosen one is among them, even if another one was quicker this time.
pub(crate) fn front(
    found: &Candidates,
    chosen: Option<usize>,
    bytes: impl Fn(&DrawSettings) -> f64,
) -> Vec<usize> {
    let numbers = |&place: &usize| {
        let point = &found.points[place];
        let time = point.milliseconds?.median;
        Some((place, [time, point.error?.relative_rmse, bytes(&found.settings[place])]))
    };
    let all: Vec<(usize, [f64; 3])> = found.latest().iter().filter_map(numbers).collect();
    let is_beaten = |(place, own): &(usize, [f64; 3])| {
        all.iter().any(|(other, its)| {
            place != other && its != own && its.iter().zip(own).all(|(its, own)| its <= own)
        })
    };
    let mut front: Vec<&(usize, [f64; 3])> =
        all.iter().filter(|one| Some(one.0) == chosen || !is_beaten(one)).collect();
    front.sort_by(|(_, a), (_, b)| b[1].total_cmp(&a[1]).then(a[0].total_cmp(&b[0])));
    front.into_iter().map(|(place, _)| *place).collect()
}

/// Says what coarser and packed lightmaps save and lose, compared with the first of these points, and whether they
/// change the time of a frame. `points` have their bytes beside them, `ways` are their settings.
pub(crate) fn findings(points: &[(&Point, f64)], ways: &[DrawSettings]) -> Vec<String> {
    let (Some(((first, bytes), others)), Some((of_first, ways))) = (points.split_first(), ways.split_first())
    else {
        return Vec::new();
    };
    let (Some(time), Some(error)) = (first.milliseconds, first.error) else { return Vec::new() };
    let megabytes = |bytes: f64| rounded(bytes / 1e6);
    let known: Vec<_> = others
        .iter()
        .zip(ways)
        .filter_map(|((point, bytes), way)| {
            Some((way.of_lightmaps(), *bytes, point.milliseconds?, point.error?))
        })
        .collect();
    let sizes: Vec<String> = known
        .iter()
        .map(|(maps, bytes, _, error)| format!("{maps} {} MB ({})", megabytes(*bytes), error_of(error)))
        .collect();
    let sizes: Vec<&str> = sizes.iter().map(String::as_str).collect();
    let mut findings = vec![format!(
        "With {}, the lightmaps take {} MB on the device ({}) and the error is {}; they would take {}.",
        first.label,
        megabytes(*bytes),
        of_first.of_lightmaps(),
        error_of(&error),
        listed(&sizes, "and")
    )];
    let apart: Vec<String> = known
        .iter()
        .filter(|(_, _, own, _)| own.is_below(&time) || time.is_below(own))
        .map(|(maps, _, own, _)| format!("with lightmaps {maps} it takes {}", times_of(own, &time)))
        .collect();
    findings.push(match apart.is_empty() {
        true => format!(
            "The time of a frame does not change measurably with the density and the format of lightmaps ({} rounds), so that these are chosen by error and bytes alone.",
            time.rounds
        ),
        false => format!("The time of a frame changes with its lightmaps: {}.", apart.join("; ")),
    });
    findings
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ErrorOf, Spread};

    fn point(time: f64, error: f64) -> Point {
        let times: Vec<f64> = [0.98, 0.99, 1.0, 1.01, 1.02].map(|factor| factor * time).to_vec();
        let error = Some(ErrorOf { relative_rmse: error, ..ErrorOf::default() });
        Point { milliseconds: Spread::of(&times), error, ..Point::default() }
    }

    #[test]
    fn of_the_maps_that_keep_the_goal_the_smallest_are_chosen() {
        let points = [point(20.0, 0.01), point(20.1, 0.011), point(19.9, 0.02), point(20.0, 0.3)];
        let sized = |points: &[Point]| -> Option<usize> {
            let with: Vec<(&Point, f64)> = points.iter().zip([64.0, 16.0, 4.0, 1.0]).collect();
            choose(&with, Goal { milliseconds: None, error: Some(0.05) })
        };
        assert_eq!(sized(&points), Some(2));
        // Coarser maps do not make a frame slower; if they do nevertheless, they are not taken.
        let slow = [point(20.0, 0.01), point(20.1, 0.011), point(30.0, 0.02), point(20.0, 0.3)];
        assert_eq!(sized(&slow), Some(1));
        // Within a time the error decides, unless it looks alike.
        let with: Vec<(&Point, f64)> = points.iter().zip([64.0, 16.0, 4.0, 1.0]).collect();
        assert_eq!(choose(&with, Goal { milliseconds: Some(25.0), error: None }), Some(1));
        assert_eq!(choose(&with[..1], Goal { milliseconds: Some(25.0), error: None }), Some(0));
    }
}
