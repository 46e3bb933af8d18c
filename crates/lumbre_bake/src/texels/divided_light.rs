//! Direct light in the parts of texels that walls divide, one value for each part: what bounces off the floor on one side of a thin wall
//! must not be read on the other. Not which texels those are: that is `straddling`.

use std::collections::HashMap;

use glam::{DVec2, Vec2, Vec3};
use rayon::prelude::*;

use super::footprint::{FINE, Footprint, FootprintPoint, Texel, footprint, receiver};
use super::straddling::Straddling;
use crate::sampling::{Sequence, Stream};
use crate::texel_index::MapTexel;
use crate::transport::direct::Sources;

/// Lines through one texel that count: as many as a part's sides have bits.
const MOST_LINES: usize = 32;
/// Lines whose ends are this near to another's, in texels, divide nothing that it does not.
const SAME_LINE: f32 = 1.0 / 16.0;

/// One side of each line through a texel.
#[derive(Clone, Debug)]
struct TexelPart {
    /// A bit for each line that it lies on the left of.
    sides: u32,
    /// The middle of its points.
    middle: Vec2,
    /// Direct irradiance, mixed lights included.
    light: Vec3,
}

/// One texel.
#[derive(Clone, Debug)]
struct Divided {
    lines: Vec<[Vec2; 2]>,
    /// There were more.
    full: bool,
    parts: Vec<TexelPart>,
}

/// All of them.
#[derive(Clone, Debug, Default)]
pub(crate) struct DividedLight {
    texels: HashMap<MapTexel, Divided>,
    /// Texels with more lines than count.
    full: usize,
}

impl DividedLight {
    /// By `samples` shadow rays to each source in each part; with it the rays cast.
    pub fn new(
        sources: &Sources<'_>,
        texels: &[Texel],
        straddling: &[Straddling],
        (samples, seed): (u32, u32),
    ) -> (Self, u64) {
        let divided: Vec<(MapTexel, Divided, u64)> = straddling
            .par_iter()
            .filter_map(|straddling| {
                if sources.scene.stop.is_cancelled() {
                    return None;
                }
                let texel = &texels[straddling.texel.place()];
                let (divided, rays) = divide(sources, texel, &straddling.lines, samples, seed)?;
                Some((texel.index, divided, rays))
            })
            .collect();
        let rays = divided.iter().map(|(.., rays)| rays).sum();
        let full = divided.iter().filter(|(_, divided, _)| divided.full).count();
        let texels = divided.into_iter().map(|(index, divided, _)| (index, divided)).collect();
        (Self { texels, full }, rays)
    }

    /// What does not count although it should, in words.
    pub fn warning(&self) -> Option<String> {
        let full = self.full;
        (full > 0).then(|| {
            format!(
                "{full} texels are divided by more than {MOST_LINES} surfaces that stand on them; light that bounces off there mixes between \
                 some of the parts"
            )
        })
    }

    /// The texels.
    pub fn texels(&self) -> impl Iterator<Item = MapTexel> + '_ {
        self.texels.keys().copied()
    }

    /// Direct irradiance at a point of a texel's unit square; `None` if the texel is not divided.
    pub fn at(&self, index: MapTexel, offset: Vec2) -> Option<Vec3> {
        let divided = self.texels.get(&index)?;
        let sides = sides(&divided.lines, offset);
        let own = divided.parts.iter().find(|part| part.sides == sides);
        let apart = |part: &&TexelPart| part.middle.distance_squared(offset);
        // A corner too small for a point of its own.
        let nearest = || divided.parts.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)));
        own.or_else(nearest).map(|part| part.light)
    }
}

fn divide(
    sources: &Sources<'_>,
    texel: &Texel,
    lines: &[[DVec2; 2]],
    samples: u32,
    seed: u32,
) -> Option<(Divided, u64)> {
    let (mut kept, mut full): (Vec<[Vec2; 2]>, bool) = (Vec::new(), false);
    for line in lines {
        let [a, b] = line.map(|end| end.as_vec2());
        let same = |&[p, q]: &[Vec2; 2]| {
            let normal = (q - p).normalize_or_zero().perp();
            [a, b].into_iter().all(|end| normal.dot(end - p).abs() < SAME_LINE)
        };
        if a != b && !kept.iter().any(same) {
            if kept.len() < MOST_LINES {
                kept.push([a, b]);
            } else {
                full = true;
            }
        }
    }
    let points = match &texel.footprint {
        Footprint::Points(points) => points.clone(),
        Footprint::Whole(triangle) => {
            match footprint(sources.scene, std::iter::once(*triangle), texel.x, texel.y, FINE)? {
                Footprint::Points(points) => points,
                Footprint::Whole(_) | Footprint::Hidden => return None,
            }
        }
        Footprint::Hidden => return None,
    };
    let mut by_side: Vec<(u32, FootprintPoint)> =
        points.into_iter().map(|point| (sides(&kept, point.offset), point)).collect();
    by_side.sort_by_key(|(sides, _)| *sides);
    let mut rays = 0;
    let parts = by_side.chunk_by(|a, b| a.0 == b.0).map(|own| {
        let sequence = Sequence::new(seed, Stream::DividedTexel, texel.index.0).of(own[0].0);
        let direct = sources.irradiance(sequence, samples, &|x, _| {
            let index = ((x * own.len() as f32) as usize).min(own.len() - 1);
            Some(receiver(sources.scene, &own[index].1))
        });
        rays += u64::from(direct.rays);
        let middle = own.iter().map(|(_, point)| point.offset).sum::<Vec2>() / own.len() as f32;
        TexelPart { sides: own[0].0, middle, light: direct.total() }
    });
    let parts: Vec<TexelPart> = parts.collect();
    Some((Divided { lines: kept, full, parts }, rays))
}

/// A bit for each line that has a point on its left.
fn sides(lines: &[[Vec2; 2]], point: Vec2) -> u32 {
    lines.iter().enumerate().map(|(bit, [a, b])| u32::from((*b - *a).perp_dot(point - *a) > 0.0) << bit).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_side_of_a_wall_has_its_own_light() {
        // A wall along x = 0.5, and a corner of another one beyond it that no point of the grid fell into.
        let lines =
            vec![[Vec2::new(0.5, 0.0), Vec2::new(0.5, 1.0)], [Vec2::new(0.9, 1.0), Vec2::new(1.0, 0.9)]];
        let part = |at: Vec2, light: f32| TexelPart {
            sides: sides(&lines, at),
            middle: at,
            light: Vec3::splat(light),
        };
        let parts = vec![part(Vec2::new(0.25, 0.5), 1.0), part(Vec2::new(0.75, 0.5), 8.0)];
        assert_ne!(parts[0].sides, parts[1].sides);
        let divided = Divided { lines, full: false, parts };
        let divided = DividedLight { texels: HashMap::from([(MapTexel(7), divided)]), full: 0 };
        for (x, y, expected) in [(0.49, 0.99, 1.0), (0.01, 0.0, 1.0), (0.51, 0.01, 8.0), (0.99, 0.98, 8.0)] {
            assert_eq!(divided.at(MapTexel(7), Vec2::new(x, y)), Some(Vec3::splat(expected)), "{x} {y}");
        }
        assert_eq!(divided.at(MapTexel(8), Vec2::splat(0.5)), None);
    }
}
