//! A few lamps among many for a point of a surface: a tree of boxes around lamps is walked down, each time into one of two boxes by what it
//! would send at most, until few lamps are left. Not which of these: they are weighed one by one. Conty Estevez and Kulla, "Importance Sampling
//! of Many Lights with Adaptive Tree Splitting", 2018, without their splitting.
//!
//! A box counts for something wherever one of its lamps does, so that no light is left out; how well it is judged decides about the noise alone.

use std::ops::Range;

use glam::DVec3;
use lumbre_optics::{Attenuation, Light, LightKind};

use crate::metering::luminance;
use crate::scene::Scene;

/// The tree over all lamps that have a place, and the lamps that have none.
#[derive(Debug)]
pub(crate) struct LightTree {
    /// The root is the last.
    boxes: Vec<LightBox>,
    /// Numbers of lamps, box by box.
    lamps: Vec<usize>,
    /// Those of distant lights.
    distant: Vec<usize>,
}

#[derive(Debug)]
struct LightBox {
    low: DVec3,
    high: DVec3,
    /// Sum of the lamps' luminances.
    brightness: f64,
    /// Of the brightest of them, without its end.
    attenuation: Attenuation,
    /// Metres that the farthest reaching lamp reaches.
    reach: f64,
    /// Some lamp has a size, and is seen above a horizon that hides its middle.
    sized: bool,
    inside: Inside,
}

#[derive(Debug)]
enum Inside {
    Boxes([usize; 2]),
    /// Places in the list of lamps.
    Lamps(Range<usize>),
}

/// The most lamps of a leaf, which are weighed one by one.
const FEW: usize = 8;
/// A part of a box's light that counts for it below the horizon too, where a lamp in it has a size.
const BELOW_HORIZON: f64 = 0.1;

impl LightTree {
    pub fn new(scene: &Scene) -> Self {
        let of_kind = |kind: LightKind| {
            let lights = scene.lights.iter().enumerate();
            lights.filter(move |(_, placed)| placed.light.kind == kind).map(|(number, _)| number)
        };
        let mut tree = Self {
            boxes: Vec::new(),
            lamps: of_kind(LightKind::Point).collect(),
            distant: of_kind(LightKind::Directional).collect(),
        };
        let mut lamps = std::mem::take(&mut tree.lamps);
        if !lamps.is_empty() {
            tree.add(scene, &mut lamps, 0);
        }
        tree.lamps = lamps;
        tree
    }

    /// Some lamps, by `choice` in [0, 1), and the chance that it was these; nothing where no lamp's light arrives.
    pub fn few(
        &self,
        scene: &Scene,
        point: DVec3,
        normal: DVec3,
        mut choice: f64,
    ) -> Option<(&[usize], f64, f64)> {
        let root = self.boxes.len().checked_sub(1);
        let near = root.map_or(0.0, |root| self.boxes[root].brings(point, normal));
        let far: f64 = self.distant.iter().map(|number| brightness(&scene.lights[*number].light)).sum();
        if near + far <= 0.0 {
            return None;
        }
        let mut chance = 1.0;
        if take(&mut choice, &mut chance, far / (near + far)) {
            return Some((&self.distant, chance, choice));
        }
        let mut at = root?;
        loop {
            match &self.boxes[at].inside {
                Inside::Lamps(range) => return Some((&self.lamps[range.clone()], chance, choice)),
                Inside::Boxes(next) => {
                    let [first, second] = next.map(|next| self.boxes[next].brings(point, normal));
                    if first + second <= 0.0 {
                        return None;
                    }
                    let into_first = take(&mut choice, &mut chance, first / (first + second));
                    at = next[usize::from(!into_first)];
                }
            }
        }
    }

    /// Adds the box of these lamps, whose list begins at a place of the whole one, and all boxes in it. Gives its number.
    fn add(&mut self, scene: &Scene, lamps: &mut [usize], first: usize) -> usize {
        let place = |number: &usize| scene.lights[*number].position;
        let low = lamps.iter().map(place).fold(DVec3::INFINITY, DVec3::min);
        let high = lamps.iter().map(place).fold(DVec3::NEG_INFINITY, DVec3::max);
        let inside = if lamps.len() <= FEW {
            Inside::Lamps(first..first + lamps.len())
        } else {
            let size = high - low;
            let axis = (0..3).max_by(|a, b| size[*a].total_cmp(&size[*b])).unwrap_or(0);
            lamps.sort_by(|a, b| place(a)[axis].total_cmp(&place(b)[axis]));
            let half = lamps.len() / 2;
            let (left, right) = lamps.split_at_mut(half);
            Inside::Boxes([self.add(scene, left, first), self.add(scene, right, first + half)])
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
            sized: lights().any(|light| light.radius > 0.0),
            inside,
        });
        self.boxes.len() - 1
    }
}

impl LightBox {
    /// About the light that its lamps bring to a point of a surface, if nothing stands between; 0 only if none brings any.
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
            // The lamp that stands highest over the surface may be so much nearer to its normal than the middle of the box is.
            let spread = (radius / distance).asin();
            let angle = (normal.dot(to) / distance).clamp(-1.0, 1.0).acos();
            cosine = (angle - spread).max(0.0).cos().max(if self.sized { BELOW_HORIZON } else { 0.0 });
        }
        self.brightness * cosine * self.attenuation.factor(distance.max(radius))
    }
}

/// As lamps are weighed against each other.
fn brightness(light: &Light) -> f64 {
    if light.enabled {
        luminance(light.diffuse.as_dvec3()) + luminance(light.specular.as_dvec3())
    } else {
        0.0
    }
}

/// Whether a choice falls to the first of two of which it has this share; what is left of the choice is as even as it was.
fn take(choice: &mut f64, chance: &mut f64, share: f64) -> bool {
    let first = *choice < share;
    let (from, part) = if first { (0.0, share) } else { (share, 1.0 - share) };
    *choice = ((*choice - from) / part).clamp(0.0, ALMOST_ONE);
    *chance *= part;
    first
}

/// The largest number below 1.
const ALMOST_ONE: f64 = 1.0 - f64::EPSILON / 2.0;
