//! What the patches' size leaves in their light: the same system with patches twice as large, each the sum of those that it is made of, no
//! ray more. The mean light of constant elements converges with a power of their size: the second where light is smooth (as in Galerkin's method;
//! Troutman and Max, "Radiosity Algorithms Using Higher Order Finite Element Methods", 1993), a lower one in rooms, whose shadows have edges that
//! no patch follows. By Richardson's extrapolation that tells, from what differs between the two, what the finer one is still off by. Not the noise
//! of form factors: that is told by two halves of the rays.

use super::form_factors::FormFactors;
use super::larger_patches::LargerPatches;
use super::patch_index::PatchIndex;
use super::patches::Patches;
use super::solution::gather;
use crate::options::Solver;
use crate::scene::BakeScene;

/// Times larger.
const COARSER: f32 = 2.0;
/// The power of the patches' size with which the error falls, as it was measured in rooms.
const ORDER: f64 = 1.2;

/// The error, with its sign, of each patch's irradiance by bounces, for grey reflectances, and light that direct light and the sky have
/// brought (`first`, W/m²); `side` is the patches' own.
pub(crate) fn size_error(
    scene: &BakeScene,
    patches: &Patches,
    side: f32,
    factors: &FormFactors,
    (reflectance, first): (&[f64], &[f64]),
    (solver, tolerance): (Solver, f64),
) -> Vec<f32> {
    let Some(larger) = LargerPatches::new(scene, patches, COARSER * side) else {
        return vec![0.0; patches.list.len()];
    };
    let emission: Vec<f64> = reflectance.iter().zip(first).map(|(rho, light)| rho * light).collect();
    let fine = gather(factors, &solver.solve(factors, reflectance, &emission, tolerance).radiosity);
    // Means by area.
    let areas: Vec<f64> = factors.areas.iter().map(|&area| f64::from(area)).collect();
    let summed = |of: &dyn Fn(usize) -> f64| {
        let mut sums = vec![0.0; larger.patches.list.len()];
        for (patch, &large) in larger.of.iter().enumerate() {
            sums[large.place()] += areas[patch] * of(patch);
        }
        sums
    };
    let total = summed(&|_| 1.0);
    let mean = |of: &dyn Fn(usize) -> f64| -> Vec<f64> {
        let over_area = |(sum, area): (f64, &f64)| if *area > 0.0 { sum / area } else { 0.0 };
        summed(of).into_iter().zip(&total).map(over_area).collect()
    };
    let coarse = exchange(factors, &larger, &total);
    let solution = solver.solve(&coarse, &mean(&|i| reflectance[i]), &mean(&|i| emission[i]), tolerance);
    let found = gather(&coarse, &solution.radiosity);
    let expected = mean(&|i| fine[i]);
    // Of what differs, the part that the finer one is off by.
    let part = 1.0 / (f64::from(COARSER).powf(ORDER) - 1.0);
    let left = |large: &PatchIndex| (part * (found[large.place()] - expected[large.place()])) as f32;
    larger.of.iter().map(left).collect()
}

/// Between the larger patches, of these areas.
fn exchange(factors: &FormFactors, larger: &LargerPatches, areas: &[f64]) -> FormFactors {
    let mut coarse = FormFactors { starts: vec![0], stop: factors.stop.clone(), ..FormFactors::default() };
    let single =
        |row: Vec<(PatchIndex, f64)>| row.into_iter().map(|(larger, g)| (larger, g as f32)).collect();
    let rows: Vec<Vec<(PatchIndex, f32)>> = larger.rows(factors, |_, row| single(row));
    for row in rows {
        coarse.columns.extend(row.iter().map(|entry| entry.0));
        coarse.exchange.extend(row.iter().map(|entry| entry.1));
        coarse.starts.push(coarse.columns.len());
    }
    coarse.areas = areas.iter().map(|&area| area.max(f64::from(f32::MIN_POSITIVE)) as f32).collect();
    coarse
}
