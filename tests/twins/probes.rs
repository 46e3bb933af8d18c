//! What surfaces read from an irradiance volume: the position of a point in its grid, and the light of an ambient
//! cube.

use glam::DVec4;
use lumbre_optics::*;
use lumbre_tests::kernel::Type;

use crate::bounds::probes as bound;
use crate::inputs::{Sequence, crossed, product};
use crate::judge::Twin;
use crate::vectors::vector;

fn side(x: &[f64], at: usize) -> DVec4 {
    DVec4::from_slice(&x[at..at + 4])
}

/// Light of any brightness, premultiplied by its openness.
fn random_cube(sequence: &mut Sequence) -> Vec<f32> {
    let openness = if sequence.next() < 0.3 { sequence.decades(-3.0, 0.0) } else { 1.0 };
    let sides = (0..3).flat_map(|_| {
        let light = [(); 3].map(|()| sequence.decades(-4.0, 4.0) * openness);
        [light[0], light[1], light[2], openness]
    });
    let sides: Vec<f32> = sides.collect();
    [&sequence.unit().to_array()[..], &sides].concat()
}

fn grid(sequence: &mut Sequence) -> Vec<f32> {
    let resolution = [(); 3].map(|()| (1.0 + sequence.decades(0.0, 2.8)).floor());
    let mirrored = if sequence.next() < 0.2 { -1.0 } else { 1.0 };
    let scale = [(); 3].map(|()| sequence.decades(-1.5, 2.0) * mirrored);
    let offset = [(); 3].map(|()| sequence.between(-300.0, 300.0));
    // Points within the grid and around it.
    let place = |axis: usize, part: f32| (part * resolution[axis] - offset[axis]) / scale[axis];
    let point = [0, 1, 2].map(|axis| place(axis, sequence.between(-0.3, 1.3)));
    [point, scale, offset, resolution].concat()
}

fn texel(sequence: &mut Sequence) -> Vec<f32> {
    let resolution = [(); 3].map(|()| (1.0 + sequence.decades(0.0, 2.8)).floor());
    let cell = resolution.map(|side| 0.5 + (side - 1.0) * sequence.next());
    let axis = (3.0 * sequence.next()).floor().min(2.0);
    [&cell[..], &resolution, &[axis, f32::from(sequence.next() < 0.5)]].concat()
}

pub fn twins() -> Vec<Twin> {
    let normals: Vec<Vec<f32>> =
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.6, -0.64, 0.48], [1e-20, 1.0, -0.0]]
            .map(|normal: [f32; 3]| normal.to_vec())
            .to_vec();
    let lights =
        [[0.0; 4], [1.0, 0.5, 0.25, 1.0], [65504.0, 0.0, 6e-8, 1.0], [0.01, 64.0, 6e-8, 1.0 / 1024.0]];
    let sides: Vec<Vec<f32>> = lights.map(|side: [f32; 4]| side.to_vec()).to_vec();
    let cubes = crossed(&crossed(&sides, &sides), &sides);
    let along: &[f32] = &[-1e6, -3.0, 0.0, 0.25, 7.0, 1e20];
    let points = product(&[along; 3]);
    let grids = product(&[
        &[0.5, -2.0, 1e9],
        &[1.0],
        &[3.0],
        &[-1e6, 0.5, 1e30],
        &[0.0],
        &[17.0],
        &[1.0, 2.0, 682.0],
        &[1.0],
        &[1024.0],
    ]);
    let cells = crossed(
        &product(&[&[0.5, 1.0, 681.5], &[0.5, 2.25, 1023.5], &[0.5, 681.5]]),
        &product(&[&[1.0, 682.0, 2048.0], &[1.0, 1024.0], &[1.0, 682.0], &[0.0, 1.0, 2.0], &[0.0, 1.0]]),
    );
    vec![
        Twin::new(
            "ambient_cube",
            "ambient_cube",
            &[],
            &[Type::Vector, Type::Vector4, Type::Vector4, Type::Vector4],
            Type::Vector,
        )
        .expect(|x| ambient_cube(vector(x, 0), side(x, 3), side(x, 7), side(x, 11)))
        .within(|x| bound::ambient_cube(vector(x, 0), [side(x, 3), side(x, 7), side(x, 11)]))
        .random(random_cube)
        .corners(crossed(&normals, &cubes)),
        Twin::new("probe_grid", "probe_grid_cell", &[], &[Type::Vector; 4], Type::Vector)
            .expect(|x| probe_grid_cell(vector(x, 0), vector(x, 3), vector(x, 6), vector(x, 9)))
            .within(|x| bound::probe_grid_cell(vector(x, 0), vector(x, 3), vector(x, 6), vector(x, 9)))
            .random(grid)
            .corners(crossed(&points, &grids)),
        Twin::new(
            "probe_grid",
            "probe_grid_texel",
            &[],
            &[Type::Vector, Type::Vector, Type::Number, Type::Flag],
            Type::Vector,
        )
        .expect(|x| probe_grid_texel(vector(x, 0), vector(x, 3), x[6], x[7] > 0.5))
        .within(|x| bound::probe_grid_texel(vector(x, 0), vector(x, 3), x[6], x[7] > 0.5))
        .random(texel)
        .corners(cells),
    ]
}
