//! The error in the patches' light that is due to their size. The same system is solved with patches twice as large,
//! whose form factors are sums of those at hand, without any more rays. The mean light of constant elements converges
//! with a power of their size: the second where light is smooth (as in Galerkin's method; Troutman and Max, "Radiosity
//! Algorithms Using Higher Order Finite Element Methods", 1993), a lower one in rooms, where no patch follows the edges
//! of shadows. From the difference of the two solutions, Richardson's extrapolation estimates the error of the finer
//! one. The error by the noise of form factors is estimated in `exchange`, from two halves of the rays.

use super::form_factors::FormFactors;
use super::larger_patches::LargerPatches;
use super::patch_index::{PatchIndex, RegionIndex};
use super::patches::Patches;
use super::solution::{TOLERANCE, gather};
use crate::options::Solver;
use crate::scene::BakeScene;

/// How many times larger the coarse patches are.
const COARSER: f32 = 2.0;
/// The power of the patches' size with which the error falls, measured in rooms.
const ORDER: f64 = 1.2;

/// The radiosity system of the mean of the channels.
pub(crate) struct MeanSystem {
    pub solver: Solver,
    /// Per patch.
    pub reflectance: Vec<f64>,
    /// Irradiance of each patch by direct light and sky, W/m².
    pub first: Vec<f64>,
}

/// The signed error of each patch's irradiance by bounces.
pub(crate) fn size_error(
    scene: &BakeScene,
    patches: &Patches,
    factors: &FormFactors,
    system: &MeanSystem,
) -> Vec<f32> {
    let MeanSystem { solver, reflectance, first } = system;
    let Some(larger) = LargerPatches::new(scene, patches, COARSER * patches.subdivision.side) else {
        return vec![0.0; patches.list.len()];
    };
    let emission: Vec<f64> = reflectance.iter().zip(first).map(|(rho, light)| rho * light).collect();
    let fine = gather(factors, &solver.solve(factors, reflectance, &emission, TOLERANCE).radiosity);
    // Integrals over the larger patches, and means weighted by area.
    let areas: Vec<f64> = factors.areas.iter().map(|&area| f64::from(area)).collect();
    let integral = |value: &dyn Fn(usize) -> f64| {
        let mut sums = vec![0.0; larger.patches.list.len()];
        for (patch, &large) in larger.of.iter().enumerate() {
            sums[large.place()] += areas[patch] * value(patch);
        }
        sums
    };
    let larger_areas = integral(&|_| 1.0);
    let mean = |value: &dyn Fn(usize) -> f64| -> Vec<f64> {
        let over_area = |(sum, area): (f64, &f64)| if *area > 0.0 { sum / area } else { 0.0 };
        integral(value).into_iter().zip(&larger_areas).map(over_area).collect()
    };
    let coarse_factors = larger_factors(factors, &larger, &larger_areas);
    let solution =
        solver.solve(&coarse_factors, &mean(&|i| reflectance[i]), &mean(&|i| emission[i]), TOLERANCE);
    let coarse = gather(&coarse_factors, &solution.radiosity);
    let fine = mean(&|i| fine[i]);
    // The error of the finer solution as a share of the difference between the two.
    let share = 1.0 / (f64::from(COARSER).powf(ORDER) - 1.0);
    let error = |large: &RegionIndex| (share * (coarse[large.place()] - fine[large.place()])) as f32;
    larger.of.iter().map(error).collect()
}

/// The form factors between the larger patches, which have these areas.
fn larger_factors(factors: &FormFactors, larger: &LargerPatches, areas: &[f64]) -> FormFactors {
    let mut coarse = FormFactors { starts: vec![0], stop: factors.stop.clone(), ..FormFactors::default() };
    // In this system the larger patches are the patches.
    let entry = |(larger, g): (RegionIndex, f64)| (PatchIndex(larger.0), g as f32);
    let to_f32 = |row: Vec<(RegionIndex, f64)>| row.into_iter().map(entry).collect();
    let rows: Vec<Vec<(PatchIndex, f32)>> = larger.rows(factors, |_, row| to_f32(row));
    rows.into_iter().for_each(|row| coarse.push_row(row));
    coarse.areas = areas.iter().map(|&area| area.max(f64::from(f32::MIN_POSITIVE)) as f32).collect();
    coarse
}
