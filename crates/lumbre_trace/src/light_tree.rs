//! Selects a few of many lamps for a surface point. A tree of boxes around the lamps is descended, at each
//! step into one of two boxes in proportion to an estimate of their light, until few lamps are left, which
//! `light_sampling` weighs one by one. After Conty Estevez and Kulla, "Importance Sampling of Many Lights
//! with Adaptive Tree Splitting", 2018, without their splitting.
//!
//! The estimate of a box is above 0 wherever one of its lamps sends light, so that no light is left out; its
//! accuracy affects the noise alone.
//!
//! The same boxes find the lamps with a size that a ray meets, without asking every lamp.

use std::ops::Range;

use glam::DVec3;
use lumbre_optics::{Attenuation, Light, LightKind};
use smallvec::SmallVec;

use crate::metering::luminance;
use crate::scene::Scene;

/// The tree over all lamps that have a position, and the distant lights.
#[derive(Debug)]
pub(crate) struct LightTree {
    /// The root is the last element.
    boxes: Vec<LightBox>,
    /// Indices of the lamps, sorted so that every leaf's are together.
    lamps: Vec<usize>,
    /// Place of every light in `lamps`, by the light's index; `None` for lights without a position.
    places: Vec<Option<usize>>,
    /// Indices of the distant lights.
    distant: Vec<usize>,
    /// Sum of their brightnesses.
    distant_brightness: f64,
}

#[derive(Debug)]
struct LightBox {
    low: DVec3,
    high: DVec3,
    /// Sum of the lamps' brightnesses.
    brightness: f64,
    /// Attenuation of the brightest lamp, with an infinite range.
    attenuation: Attenuation,
    /// Largest range of a lamp, metres.
    reach: f64,
    /// Opposite corners of a box around the balls of the lamps that have a size, which may be seen above a horizon that
    /// hides their centres; `None` if no lamp has one.
    balls: Option<[DVec3; 2]>,
    /// Its lamps, in [`LightTree::lamps`].
    lamps: Range<usize>,
    /// The two boxes within it; `None` for a leaf.
    inside: Option<[usize; 2]>,
}

/// Largest number of lamps in a leaf.
const FEW: usize = 8;
/// Lower bound of the cosine for a box in which a lamp has a size, since part of it may be above the horizon.
const BELOW_HORIZON: f64 = 0.1;

impl LightTree {
    pub fn new(scene: &Scene) -> Self {
        let of_kind = |kind: LightKind| {
            let lights = scene.lights.iter().enumerate();
            lights.filter(move |(_, placed)| placed.light.kind == kind).map(|(number, _)| number)
        };
        let mut lamps: Vec<usize> = of_kind(LightKind::Point).collect();
        let distant: Vec<usize> = of_kind(LightKind::Directional).collect();
        let mut tree = Self {
            boxes: Vec::new(),
            lamps: Vec::new(),
            places: vec![None; scene.lights.len()],
            distant_brightness: distant.iter().map(|number| brightness(&scene.lights[*number].light)).sum(),
            distant,
        };
        if !lamps.is_empty() {
            tree.add(scene, &mut lamps, 0);
        }
        for (place, &lamp) in lamps.iter().enumerate() {
            tree.places[lamp] = Some(place);
        }
        tree.lamps = lamps;
        tree
    }

    /// Selects some lamps by `choice` in [0, 1). Returns them, the probability of selecting them, and an
    /// evenly distributed number that is left of `choice`; `None` where no lamp's light arrives.
    pub fn few(&self, point: DVec3, normal: DVec3, mut choice: f64) -> Option<(&[usize], f64, f64)> {
        let mut chance = 1.0;
        if take(&mut choice, &mut chance, self.share_of_distant(point, normal)?) {
            return Some((&self.distant, chance, choice));
        }
        let mut at = self.boxes.len().checked_sub(1)?;
        while let Some(next) = self.boxes[at].inside {
            let into_first = take(&mut choice, &mut chance, self.share_of_first(next, point, normal)?);
            at = next[usize::from(!into_first)];
        }
        Some((&self.lamps[self.boxes[at].lamps.clone()], chance, choice))
    }

    /// Returns the lamps among which [`few`](Self::few) selects a lamp, and the probability of that; `None` where
    /// it never does.
    pub fn few_with(&self, lamp: usize, point: DVec3, normal: DVec3) -> Option<(&[usize], f64)> {
        let distant = self.share_of_distant(point, normal)?;
        let Some(place) = self.places[lamp] else {
            return Some((&self.distant, distant));
        };
        let mut chance = 1.0 - distant;
        let mut at = self.boxes.len().checked_sub(1)?;
        while let Some(next) = self.boxes[at].inside {
            let first = self.share_of_first(next, point, normal)?;
            let in_first = self.boxes[next[0]].lamps.contains(&place);
            chance *= if in_first { first } else { 1.0 - first };
            at = next[usize::from(!in_first)];
        }
        Some((&self.lamps[self.boxes[at].lamps.clone()], chance))
    }

    /// Calls `found` with every lamp with a size whose ball a ray may meet, and with some others.
    pub fn along(&self, origin: DVec3, direction: DVec3, mut found: impl FnMut(usize)) {
        let reciprocal = direction.recip();
        let mut waiting: SmallVec<[usize; 32]> = self.boxes.len().checked_sub(1).into_iter().collect();
        while let Some(at) = waiting.pop() {
            let own = &self.boxes[at];
            if !own.balls.is_some_and(|balls| meets(balls, origin, reciprocal)) {
                continue;
            }
            match own.inside {
                Some(inside) => waiting.extend(inside),
                None => self.lamps[own.lamps.clone()].iter().for_each(|&lamp| found(lamp)),
            }
        }
    }

    /// Returns the probability of the distant lights; `None` where no light arrives at all.
    fn share_of_distant(&self, point: DVec3, normal: DVec3) -> Option<f64> {
        let near = self.boxes.last().map_or(0.0, |root| root.brings(point, normal));
        let far = self.distant_brightness;
        (near + far > 0.0).then(|| far / (near + far))
    }

    /// Returns the probability of the first of two boxes; `None` where neither brings light.
    fn share_of_first(&self, boxes: [usize; 2], point: DVec3, normal: DVec3) -> Option<f64> {
        let [first, second] = boxes.map(|own| self.boxes[own].brings(point, normal));
        (first + second > 0.0).then(|| first / (first + second))
    }

    /// Adds the box around `lamps`, which begin at index `first` of the whole list, and all boxes within it.
    /// Returns its index.
    fn add(&mut self, scene: &Scene, lamps: &mut [usize], first: usize) -> usize {
        let place = |number: &usize| scene.lights[*number].position;
        let low = lamps.iter().map(place).fold(DVec3::INFINITY, DVec3::min);
        let high = lamps.iter().map(place).fold(DVec3::NEG_INFINITY, DVec3::max);
        let inside = if lamps.len() <= FEW {
            None
        } else {
            let size = high - low;
            let axis = (0..3).max_by(|a, b| size[*a].total_cmp(&size[*b])).unwrap_or(0);
            lamps.sort_by(|a, b| place(a)[axis].total_cmp(&place(b)[axis]));
            let half = lamps.len() / 2;
            let (left, right) = lamps.split_at_mut(half);
            Some([self.add(scene, left, first), self.add(scene, right, first + half)])
        };
        let lights = || lamps.iter().map(|number| &scene.lights[*number].light);
        let brightest = lights().max_by(|a, b| brightness(a).total_cmp(&brightness(b)));
        let attenuation = brightest.map_or(Attenuation::INVERSE_SQUARE, |light| light.attenuation);
        self.boxes.push(LightBox {
            low,
            high,
            brightness: lights().map(brightness).sum(),
            attenuation: Attenuation { range: f32::INFINITY, ..attenuation },
            reach: lights().map(|light| f64::from(light.attenuation.range)).fold(0.0, f64::max),
            balls: box_of_balls(scene, lamps),
            lamps: first..first + lamps.len(),
            inside,
        });
        self.boxes.len() - 1
    }
}

impl LightBox {
    /// Estimates the unoccluded light that the lamps send to a surface point; 0 only if none sends any.
    fn brings(&self, point: DVec3, normal: DVec3) -> f64 {
        let nearest = point.clamp(self.low, self.high);
        if nearest.distance(point) > self.reach {
            return 0.0;
        }
        let middle = 0.5 * (self.low + self.high);
        let radius = 0.5 * (self.high - self.low).length();
        let to = middle - point;
        let distance = to.length();
        let mut cosine = 1.0;
        if distance > radius {
            // A lamp in the box may be closer to the surface's normal than the box's centre is, by up to this
            // angle.
            let spread = (radius / distance).asin();
            let angle = (normal.dot(to) / distance).clamp(-1.0, 1.0).acos();
            cosine =
                (angle - spread).max(0.0).cos().max(if self.balls.is_some() { BELOW_HORIZON } else { 0.0 });
        }
        self.brightness * cosine * self.attenuation.factor(distance.max(radius))
    }
}

/// Margin of the boxes around lamps for rounding, as a fraction of their largest coordinate.
const MARGIN: f64 = 1e-9;

/// Returns opposite corners of a box around the balls of those lamps that have a size.
fn box_of_balls(scene: &Scene, lamps: &[usize]) -> Option<[DVec3; 2]> {
    let placed = lamps.iter().map(|&number| &scene.lights[number]);
    let sized = placed.filter(|placed| placed.light.radius > 0.0);
    let corners = sized.map(|placed| {
        let margin = MARGIN * placed.position.abs().max_element();
        let radius = DVec3::splat(f64::from(placed.light.radius) * (1.0 + MARGIN) + margin);
        [placed.position - radius, placed.position + radius]
    });
    corners.reduce(|[low, high], [own_low, own_high]| [low.min(own_low), high.max(own_high)])
}

/// Returns true if a ray meets a box. `reciprocal` is that of its direction, infinite along axes that it does not run
/// along.
fn meets([low, high]: [DVec3; 2], origin: DVec3, reciprocal: DVec3) -> bool {
    let (to_low, to_high) = ((low - origin) * reciprocal, (high - origin) * reciprocal);
    // 0 times infinity, of a ray within a side of the box, is not a number, which `min` and `max` pass over: such a ray may
    // count as passing by. It passes every ball within, since the box is larger by its margin.
    let enter = (0..3).fold(0.0_f64, |enter, axis| enter.max(to_low[axis].min(to_high[axis])));
    let leave = (0..3).fold(f64::INFINITY, |leave, axis| leave.min(to_low[axis].max(to_high[axis])));
    enter <= leave * (1.0 + MARGIN)
}

/// The brightness by which lamps are compared; 0 for a disabled lamp.
fn brightness(light: &Light) -> f64 {
    if light.enabled {
        luminance(light.diffuse.as_dvec3()) + luminance(light.specular.as_dvec3())
    } else {
        0.0
    }
}

/// Returns true if `choice` selects the first of two alternatives, whose probability is `share`. Multiplies
/// `chance` by the probability of what was selected and rescales `choice` to [0, 1) again.
fn take(choice: &mut f64, chance: &mut f64, share: f64) -> bool {
    let first = *choice < share;
    let (from, part) = if first { (0.0, share) } else { (share, 1.0 - share) };
    *choice = ((*choice - from) / part).clamp(0.0, ALMOST_ONE);
    *chance *= part;
    first
}

/// The largest number below 1.
const ALMOST_ONE: f64 = 1.0 - f64::EPSILON / 2.0;
