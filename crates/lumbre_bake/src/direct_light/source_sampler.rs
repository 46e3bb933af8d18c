//! Direct light of the sources that matter by themselves: each is sampled individually, with shadow rays where its
//! occluders are not known. Which passes are made, and for which errors, is in the parent module.

use std::collections::{BTreeSet, HashMap};

use glam::Vec3;
use rayon::prelude::*;

use super::light_cuts::LightCuts;
use super::local_light::LocalLight;
use super::shafts::Shafts;
use super::shared_light::SharedLight;
use super::sparse_pass::{relative_difference, sparse_pass};
use super::views::ErrorsInViews;
use crate::chunks::{decide, in_chunks};
use crate::coverage::{CoveredTexels, Representatives, Texel, receiver};
use crate::denoise::Neighbourhoods;
use crate::monitor::BakeMonitor;
use crate::sample_allocation::{
    MOST_DOUBLINGS_LEAVE, SampleAllocation, SampleAllocator, WeightedGoal, take_samples,
};
use crate::sampling::{Sequence, Stream};
use crate::sources::{Direct, SampledReceiver, Sources, VisibilitySummary};
use crate::texel_index::{CoveredTexel, MapTexel};
use crate::{BakeError, BakeOptions};

/// The direct light of the individually sampled sources, as far as it has been sampled.
pub(crate) struct IndividualLight {
    /// Per covered texel.
    pub direct: Vec<Direct>,
    /// Samples that have been taken, per covered texel, or [`INTERPOLATED`].
    samples: Vec<u32>,
    /// The texels that may need more samples than the first pass takes.
    pub doubtful: Vec<CoveredTexel>,
    /// Whether the first pass had time to sample all texels, so that none is interpolated.
    pub is_complete: bool,
}

impl IndividualLight {
    /// Allocates `many` samples to each doubtful texel that has had fewer.
    pub fn with_fewer_samples(&self, many: u32) -> Vec<SampleAllocation> {
        let fewer = self.doubtful.iter().filter(|texel| self.samples[texel.place()] < many);
        fewer.map(|&texel| SampleAllocation { texel, samples: many }).collect()
    }

    /// The expected variances relative to the squared local light.
    fn relative_variances(&self, local: &LocalLight) -> Vec<f32> {
        let variances: Vec<f32> = self.direct.iter().map(|direct| direct.variance - direct.caution).collect();
        local.relative(&variances)
    }

    /// The sum of the texels' expected variances, each relative to the squared local light.
    pub fn variance_left(&self, local: &LocalLight) -> f64 {
        local.views.sum(&self.relative_variances(local))
    }
}

/// Samples the direct light of the texels that are not known from a previous bake, with everything that all passes
/// need.
pub(crate) struct SourceSampler<'a> {
    sources: &'a Sources<'a>,
    texels: &'a CoveredTexels<'a>,
    known: &'a [Option<Direct>],
    options: &'a BakeOptions,
    pub cuts: LightCuts,
    shafts: Shafts<'a>,
}

impl<'a> SourceSampler<'a> {
    pub fn new(
        sources: &'a Sources<'a>,
        texels: &'a CoveredTexels<'a>,
        known: &'a [Option<Direct>],
        options: &'a BakeOptions,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<Self, BakeError> {
        let mut cuts = monitor.run_interruptible(1.0, || LightCuts::new(sources, texels))?;
        let is_wanted = |texel: CoveredTexel| known_light(known, texel).is_none();
        let shafts =
            monitor.run_interruptible(1.0, || Shafts::new(sources, &texels.list, &cuts, is_wanted))?;
        // Where shadow rays would be needed anyway, one ray to any of the sources is worth as much as one to each of
        // them. Not so where all lamps have samples of their own: the unoccluded sum over them is exact, and rays only
        // find the visible share of it.
        cuts.share(sources, &shafts.unresolved(&cuts, |_, cut| !cut.has_all_lamps));
        Ok(Self { sources, texels, known, options, cuts, shafts })
    }

    fn is_wanted(&self, texel: CoveredTexel) -> bool {
        known_light(self.known, texel).is_none()
    }

    /// The texels whose light is not known from a previous bake.
    pub fn unknown(&self) -> impl Iterator<Item = CoveredTexel> {
        CoveredTexel::all(self.texels.list.len()).filter(|&texel| self.is_wanted(texel))
    }

    /// The light of the individually sampled sources at a texel, by so many samples of each.
    fn light(&self, covered: CoveredTexel, samples: u32) -> Direct {
        let texel = &self.texels.list[covered.place()];
        if texel.is_hidden() {
            return Direct::default();
        }
        let scene = self.sources.scene;
        let anywhere = |x: f32, y: f32| texel.covered_point(scene, x, y).map(|point| receiver(scene, &point));
        let sampled = SampledReceiver {
            point: |x: f32, y: f32| texel.point(scene, x, y).map(|point| receiver(scene, &point)),
            covered: if texel.has_points_for_all() { Some(&anywhere) } else { None },
            is_point: false,
            flat_side: texel.flat_side(scene),
            visibility: &self.shafts.visibility(covered.place(), texel),
            sequence: Sequence::new(self.options.seed, Stream::DirectLight, texel.index.0),
            samples,
        };
        self.sources.irradiance_per_source(self.cuts.of(covered), &sampled)
    }

    /// The light of texels by a few samples, whatever time it takes.
    fn few_samples(
        &self,
        texels: &[CoveredTexel],
        few: u32,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<Vec<Direct>, BakeError> {
        let clock = monitor.clock();
        monitor.pass(PASS);
        in_chunks(texels.len(), monitor, |place| {
            self.light(texels[place], if clock.is_over() { few.min(LATE_SAMPLES) } else { few })
        })
    }

    /// Known light, and a few samples of every other texel, or of so many that there is time for: the others are
    /// interpolated.
    pub fn first_pass(&self, monitor: &mut BakeMonitor<'_>) -> Result<IndividualLight, BakeError> {
        let is_open = |texel: &CoveredTexel| !self.texels.list[texel.place()].is_hidden();
        let unknown: Vec<CoveredTexel> = self.unknown().filter(is_open).collect();
        let [usual, ..] = self.options.effort().direct;
        let is_time_short = decide(monitor, monitor.clock().is_past(SHORT_OF_TIME))?;
        let few = if is_time_short { usual.min(LATE_SAMPLES) } else { usual };
        let clock = monitor.clock();
        let pass = sparse_pass(self.texels, &unknown, PASS, monitor, |texel| {
            self.light(texel, if clock.is_over() { few.min(LATE_SAMPLES) } else { few })
        })?;
        let count = self.texels.list.len();
        let direct: Vec<Direct> = CoveredTexel::all(count)
            .map(|texel| known_light(self.known, texel).unwrap_or_default())
            .collect();
        let mut light = IndividualLight {
            direct,
            samples: vec![usual; count],
            doubtful: Vec::new(),
            is_complete: pass.blocks.is_none(),
        };
        let mut is_missing = vec![false; count];
        unknown.iter().for_each(|texel| is_missing[texel.place()] = true);
        for (texel, sampled) in pass.sampled {
            light.direct[texel.place()] = sampled;
            is_missing[texel.place()] = false;
        }
        if let Some(blocks) = pass.blocks {
            let missing: Vec<CoveredTexel> =
                unknown.into_iter().filter(|texel| is_missing[texel.place()]).collect();
            let interpolated =
                monitor.run_interruptible(1.0, || self.interpolated(&light.direct, &missing, &blocks))?;
            for (texel, interpolated) in missing.iter().zip(interpolated) {
                light.direct[texel.place()] = interpolated;
                light.samples[texel.place()] = INTERPOLATED;
            }
        }
        Ok(light)
    }

    /// The light of texels that were not sampled, from the representatives around each. By how much these differ counts as
    /// its error; where there is only one, by how much they differ elsewhere.
    fn interpolated(
        &self,
        direct: &[Direct],
        missing: &[CoveredTexel],
        blocks: &Representatives<'_>,
    ) -> Vec<Direct> {
        let keys = self.cuts.keys();
        let interpolate = |texel: &CoveredTexel| {
            if self.texels.scene.stop.is_cancelled() {
                return (Direct::default(), None);
            }
            // Elsewhere a part of the light may be among the shared samples, as it is in all that is known.
            let fits =
                |other: CoveredTexel| self.is_wanted(other) && keys[other.place()] == keys[texel.place()];
            interpolated(direct, &blocks.around(*texel, fits), blocks.of(*texel))
        };
        let (mut light, differences): (Vec<Direct>, Vec<Option<f32>>) =
            missing.par_iter().map(interpolate).unzip();
        let squared_light = |light: &Direct| light.baked.length_squared() / 3.0;
        let pairs: Vec<[f64; 2]> = differences
            .iter()
            .zip(&light)
            .filter_map(|(difference, light)| {
                Some([f64::from((*difference)?), f64::from(squared_light(light))])
            })
            .collect();
        let relative = relative_difference(pairs.iter().copied());
        // What is dark may lie in the shadow that its representative is in, or beside it.
        let mean_light = light.iter().map(squared_light).sum::<f32>() / light.len().max(1) as f32;
        for (light, difference) in light.iter_mut().zip(differences) {
            let of_one = relative * squared_light(light).max(mean_light);
            light.variance += difference.unwrap_or(of_one);
        }
        light
    }

    /// Makes lamps share samples in blocks of which a good part lies in penumbrae of any source (see
    /// [`shares_penumbrae`]): behind a grille, or among many thin blockers. The visible share of each texel by itself
    /// would take hundreds of rays, while smoothing makes use of the neighbours' samples. The light of these blocks is
    /// sampled again.
    pub fn share_penumbrae(
        &mut self,
        direct: &mut [Direct],
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<(), BakeError> {
        let lamps = monitor.run_interruptible(0.0, || {
            let mut lamps = self.shafts.unresolved(&self.cuts, |_, cut| cut.has_all_lamps);
            if lamps.is_empty() {
                return lamps;
            }
            // Per block, its texels in penumbrae, and all of them.
            let mut counts: HashMap<u32, [u32; 2]> = HashMap::new();
            for texel in self.unknown().filter(|texel| !self.texels.list[texel.place()].is_hidden()) {
                let [in_penumbrae, all] = counts.entry(self.cuts.block(texel)).or_default();
                *in_penumbrae += u32::from(direct[texel.place()].seen.partly);
                *all += 1;
            }
            let shares = |&[in_penumbrae, all]: &[u32; 2]| shares_penumbrae(in_penumbrae, all);
            lamps.retain(|(texel, _)| counts.get(&self.cuts.block(*texel)).is_some_and(shares));
            self.cuts.share(self.sources, &lamps);
            lamps
        })?;
        if lamps.is_empty() {
            return Ok(());
        }
        let blocks: BTreeSet<u32> = lamps.iter().map(|(texel, _)| self.cuts.block(*texel)).collect();
        let changed: Vec<CoveredTexel> =
            self.unknown().filter(|texel| blocks.contains(&self.cuts.block(*texel))).collect();
        let [few, ..] = self.options.effort().direct;
        for (texel, light) in changed.iter().zip(self.few_samples(&changed, few, monitor)?) {
            // What was seen before tells the neighbours that a penumbra is near.
            let Direct { rays, seen, .. } = direct[texel.place()];
            direct[texel.place()] = Direct { rays: rays + light.rays, seen, ..light };
        }
        Ok(())
    }

    /// The first round of the sources that share samples; `None` if there are none.
    pub fn shared_light(&self, monitor: &mut BakeMonitor<'_>) -> Result<Option<SharedLight<'_>>, BakeError> {
        if !self.cuts.share_samples() {
            return Ok(None);
        }
        let is_wanted = |place: usize| self.is_wanted(CoveredTexel::new(place));
        // Texels with known light have no shared samples, so the others must not be compared with them.
        let keys = self.cuts.keys().into_iter().enumerate();
        let groups: Vec<u32> = keys.map(|(place, key)| 2 * key + u32::from(is_wanted(place))).collect();
        let neighbourhoods = Neighbourhoods::new(self.texels, &groups);
        let shared =
            SharedLight::new(self.sources, neighbourhoods, &self.cuts, is_wanted, self.options, monitor)?;
        Ok(Some(shared))
    }

    /// The texels in or near penumbras, as far as the first pass has found them: those that have, within [`REACH`], a
    /// texel (perhaps themselves) that saw a source partly, or one that saw other sources than they did. Of interpolated
    /// texels, those that are uncertain.
    pub fn doubtful_texels(&self, light: &IndividualLight) -> Vec<CoveredTexel> {
        let (texels, direct) = (self.texels, &light.direct);
        let is_uncertain =
            |direct: &Direct| direct.variance > UNCERTAIN * direct.baked.length_squared() / 3.0;
        let seen_at = |place: MapTexel| texels.open_at(place).map(|texel| direct[texel.place()].seen);
        let is_doubtful = |&(covered, texel): &(CoveredTexel, &Texel)| {
            let Direct { seen, sampled, .. } = direct[covered.place()];
            if light.samples[covered.place()] == INTERPOLATED {
                return is_uncertain(&direct[covered.place()]);
            }
            let map = &texels.layout.maps[texel.map.place()];
            let differs = |other: VisibilitySummary| other.partly || other.signature != seen.signature;
            let mut near = map.neighbourhood(texel.x, texel.y, REACH);
            sampled && self.is_wanted(covered) && near.any(|near| seen_at(near).is_some_and(differs))
        };
        texels.open().filter(is_doubtful).map(|(covered, _)| covered).collect()
    }

    /// Takes more samples of doubtful texels, up to `most`, mostly at the edges of shadows, until the sum of squared
    /// errors is down to `goal` and in every view their mean to that of the goal, no texel can have more, or the time is
    /// up. After a round of many samples it also ends at `enough`, which is at least `goal`.
    pub fn refine(
        &self,
        light: &mut IndividualLight,
        local: &LocalLight,
        most: u32,
        (goal, enough): (f64, f64),
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<(), BakeError> {
        let [few, ..] = self.options.effort().direct;
        let many = MANY_SAMPLES * u64::from(few) * self.texels.open().count() as u64;
        let mut samples_of_round = 0;
        loop {
            let variances = light.relative_variances(local);
            let errors = ErrorsInViews::new(&local.views, &variances);
            let limit = if samples_of_round > many { enough } else { goal };
            if errors.sums().into_iter().all(|sum| sum <= limit) {
                return Ok(());
            }
            let (texels, samples) = (&light.doubtful, &light.samples);
            let goal =
                WeightedGoal::new(&variances, &errors.shares(goal, MOST_DOUBLINGS_LEAVE), texels, ORDER);
            let allocator =
                SampleAllocator { texels, variances: &goal.variances, samples, most, order: ORDER };
            let allocated = allocator.reach(goal.sum);
            samples_of_round = allocated.iter().map(|to| u64::from(to.samples)).sum();
            if self.sample(&allocated, light, monitor)? == 0 {
                return Ok(());
            }
        }
    }

    /// Samples the texels of a list anew, as far as there is time; returns for how many of them there was. Their rays
    /// add up.
    pub fn sample(
        &self,
        wanted: &[SampleAllocation],
        light: &mut IndividualLight,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<usize, BakeError> {
        if wanted.is_empty() {
            return Ok(0);
        }
        monitor.pass(PASS);
        let taken = take_samples(wanted, &mut light.direct, monitor, |to, before| {
            let sampled = self.light(to.texel, to.samples);
            Direct { rays: before.rays + sampled.rays, ..sampled }
        })?;
        for SampleAllocation { texel, samples } in taken {
            light.samples[texel.place()] = *samples;
        }
        Ok(taken.len())
    }
}

/// The light of a texel that was not sampled, from the representatives around it and its own, with their noise; and the
/// square of by how much they differ, mean of the channels, if there are several.
fn interpolated(
    direct: &[Direct],
    around: &[(CoveredTexel, f32)],
    own: CoveredTexel,
) -> (Direct, Option<f32>) {
    let sum = |of: &dyn Fn(&Direct) -> Vec3| -> Vec3 {
        around.iter().map(|(other, weight)| *weight * of(&direct[other.place()])).sum()
    };
    let (baked, mixed) = (sum(&|light| light.baked), sum(&|light| light.mixed));
    let variance =
        around.iter().map(|(other, weight)| weight * weight * direct[other.place()].variance).sum();
    let difference = |(other, weight): &(CoveredTexel, f32)| {
        weight * (direct[other.place()].baked - baked).length_squared() / 3.0
    };
    let differences = (around.len() > 1).then(|| around.iter().map(difference).sum());
    let seen = direct[own.place()].seen;
    (Direct { baked, mixed, variance, sampled: true, seen, ..Direct::default() }, differences)
}

/// The light of a texel from a previous bake.
fn known_light(known: &[Option<Direct>], texel: CoveredTexel) -> Option<Direct> {
    known.get(texel.place()).copied().flatten()
}

/// Whether lamps share samples in a block of `all` texels, of which so many lie in penumbrae.
fn shares_penumbrae(in_penumbrae: u32, all: u32) -> bool {
    let is_enough = in_penumbrae >= ENOUGH_IN_PENUMBRAE;
    let least_share = if is_enough { PENUMBRA_SHARE } else { PENUMBRA_SHARE_OF_FEW };
    in_penumbrae as f32 > least_share * all as f32
}

/// So many texels in penumbrae are enough to smooth each other's samples.
const ENOUGH_IN_PENUMBRAE: u32 = 32;
/// The share of a block's texels, if they are enough. The narrow penumbra of a single edge that crosses a whole block
/// takes less, and so stays sharp. With a share of a half, the texels of the other blocks took a third of the time of a
/// bake behind a grille, for an error no smaller.
const PENUMBRA_SHARE: f32 = 0.2;
/// The same where they are fewer, as on a small box.
const PENUMBRA_SHARE_OF_FEW: f32 = 0.5;

/// In place of a number of samples: the texel was interpolated. It counts as having one sample.
const INTERPOLATED: u32 = 1;
/// The variance from which on an interpolated texel is uncertain, relative to its squared light: 1 % of the light.
const UNCERTAIN: f32 = 1e-4;

/// How far around a texel that saw a penumbra others may be in it too, in texels.
const REACH: u32 = 2;

/// The power of the number of samples with which the variance falls at straight edges of shadows, as measured.
pub(crate) const ORDER: f64 = 1.5;

/// So many times the samples of the first pass, if all texels took part, are many for one round. A round that takes them
/// and misses its goal has found sharp edges of shadows among thin blockers, where samples are worth less than at
/// straight edges: behind a grille, a second such round took a tenth of the bake and lowered the squared error from 1.7
/// to 1.6 times the goal.
const MANY_SAMPLES: u64 = 2;

/// A pass's usual share of the time that it and the passes after it take.
const PASS: f32 = 0.5;

/// If more than this share of the time for direct light has passed before any is computed, time is short for a scene of
/// this size.
pub(crate) const SHORT_OF_TIME: f64 = 0.3;

/// Shadow rays of a texel in the first pass if time is short or over: still enough to estimate the error from their spread.
const LATE_SAMPLES: u32 = 4;

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;
    use std::sync::Arc;

    use glam::{DVec3, Vec2, Vec3};
    use lumbre_mesh::{TriangleMesh, shapes};
    use lumbre_optics::{BakeMode, Light};

    use super::super::direct_light;
    use super::*;
    use crate::Density;
    use crate::coverage::{Footprint, barycentric};
    use crate::scene::laid_out::laid_out;
    use crate::scene::{PlacedLight, PlacedPrimitive, SceneObject, StaticScene};
    use crate::texel_index::MapIndex;

    #[test]
    fn lamps_share_samples_where_a_good_part_of_a_block_is_in_penumbrae() {
        assert!(shares_penumbrae(52, 256) && !shares_penumbrae(51, 256), "a fifth of a whole block");
        assert!(!shares_penumbrae(31, 256), "the penumbra of one edge, less than two texels wide");
        assert!(shares_penumbrae(32, 70) && !shares_penumbrae(31, 70), "most of a small block");
        assert!(shares_penumbrae(11, 20) && !shares_penumbrae(10, 20));
        assert!(!shares_penumbrae(0, 0));
    }

    /// The sun's shadow of a plate ends on a triangle, whose chart covers the texels along its longest side only in
    /// part. The texels' light must be that of the covered part, and not of the few points that stand for it.
    #[test]
    fn the_edge_of_a_shadow_is_found_where_a_chart_ends() {
        const HALF: f32 = 0.04;
        let floor = TriangleMesh {
            positions: vec![Vec3::ZERO, Vec3::Z, Vec3::X],
            normals: vec![Vec3::Y; 3],
            uv1: vec![Vec2::ZERO, Vec2::Y, Vec2::X],
            indices: vec![0, 1, 2],
            ..TriangleMesh::default()
        };
        // Ten plates along the longest side, each turned otherwise.
        let plates: Vec<(glam::Quat, Vec3)> = (0..10)
            .map(|number| {
                let along = (number as f32 + 0.53) / 10.0;
                (glam::Quat::from_rotation_y(0.3 + number as f32), Vec3::new(along, 0.5, 1.0 - along))
            })
            .collect();
        let plate = |&(turn, middle): &(glam::Quat, Vec3)| {
            let mut plate = shapes::plane(2.0 * HALF, 2.0 * HALF, 1, 1);
            plate.positions.iter_mut().for_each(|position| *position = turn * *position + middle);
            plate
        };
        let object = |mesh| {
            SceneObject::new("", vec![PlacedPrimitive { mesh: Arc::new(mesh), ..PlacedPrimitive::default() }])
        };
        let sun = Light { bake: BakeMode::Static, ..Light::directional(Vec3::ONE) };
        let lights = vec![PlacedLight { light: sun, position: DVec3::ZERO, axis: DVec3::NEG_Y }];
        let objects = std::iter::once(floor).chain(plates.iter().map(plate)).map(object).collect();
        let input = StaticScene { objects, lights, ..StaticScene::default() }.checked().unwrap();
        let options = BakeOptions { density: Density::MapSize(64), error: 1e-4, ..BakeOptions::default() };
        let (layout, scene) = laid_out(&input.objects, input.space(), &options);
        let sources = Sources::new(&scene, Vec::new(), input.lights.clone(), Vec3::ZERO);
        let mut carry_on = |_| ControlFlow::Continue(());
        let mut monitor = BakeMonitor::new(&mut carry_on, None);
        let (texels, _) = CoveredTexels::new(&scene, &layout, &mut monitor).unwrap();
        let (direct, _) = direct_light(&sources, &texels, &[], &options, &mut monitor).unwrap();

        let is_lit = |position: Vec3| {
            plates.iter().all(|(turn, middle)| {
                let from_middle = turn.inverse() * (scene.space.world(position).as_vec3() - *middle);
                from_middle.x.abs() > HALF || from_middle.z.abs() > HALF
            })
        };
        let open = direct.texels.iter().map(|direct| direct.baked.x).fold(0.0, f32::max);
        let (mut squares, mut of_points, mut stated, mut edges) = (0.0f32, 0.0f32, 0.0f32, 0.0f32);
        for (texel, direct) in
            texels.list.iter().zip(&direct.texels).filter(|(texel, _)| texel.map == MapIndex(0))
        {
            let Footprint::Points(points) = &texel.footprint else { continue };
            let triangle = &scene.triangles[texel.triangle as usize];
            let (mut covered, mut lit) = (0.0, 0.0);
            const FINE: u32 = 64;
            for cell in 0..FINE * FINE {
                let offset = (Vec2::new((cell % FINE) as f32, (cell / FINE) as f32) + 0.5) / FINE as f32;
                let at = barycentric(triangle, Vec2::new(texel.x as f32, texel.y as f32) + offset).unwrap();
                if at.0 >= 0.0 && at.1 >= 0.0 && at.0 + at.1 <= 1.0 {
                    covered += 1.0;
                    lit += f32::from(u8::from(is_lit(triangle.position(at.0, at.1))));
                }
            }
            let exact = lit / covered;
            if exact > 0.02 && exact < 0.98 {
                let lit_points = points.iter().filter(|p| is_lit(triangle.position(p.at.0, p.at.1))).count();
                squares += (direct.baked.x / open - exact).powi(2);
                of_points += (lit_points as f32 / points.len() as f32 - exact).powi(2);
                stated += direct.variance / open.powi(2);
                edges += 1.0;
            }
        }
        let [error, of_points, stated] = [squares, of_points, stated].map(|sum| (sum / edges).sqrt());
        println!("{edges} texels: off by {error:.4}, their points by {of_points:.4}, stated {stated:.4}");
        assert!(edges >= 10.0, "{edges}");
        assert!(error < 0.6 * of_points && error < 2.0 * stated, "{error} {of_points} {stated}");
    }
}
