//! A floor whose texels are all covered, for the tests of later stages.

use std::ops::ControlFlow;

use glam::{Vec2, Vec3};
use lumbre_mesh::TriangleMesh;

use super::CoveredTexels;
use crate::monitor::BakeMonitor;
use crate::scene::laid_out::mesh_laid_out;
use crate::{BakeOptions, Density};

/// Calls `check` with the texels of a square floor, `side` by `side` of them, and with a monitor that lets all go on.
pub(crate) fn on_a_floor<T>(
    side: u32,
    check: impl FnOnce(&CoveredTexels<'_>, &mut BakeMonitor<'_>) -> T,
) -> T {
    let floor = TriangleMesh {
        positions: vec![Vec3::ZERO, Vec3::Z, Vec3::X + Vec3::Z, Vec3::X],
        normals: vec![Vec3::Y; 4],
        uv1: vec![Vec2::ZERO, Vec2::Y, Vec2::ONE, Vec2::X],
        indices: vec![0, 1, 2, 0, 2, 3],
        ..TriangleMesh::default()
    };
    let options = BakeOptions { density: Density::MapSize(side), ..BakeOptions::default() };
    let (layout, scene) = mesh_laid_out(floor, &options);
    let mut carry_on = |_| ControlFlow::Continue(());
    let mut monitor = BakeMonitor::new(&mut carry_on, None);
    let (texels, _) = CoveredTexels::new(&scene, &layout, &mut monitor).unwrap();
    check(&texels, &mut monitor)
}
