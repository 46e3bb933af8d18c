//! Furniture: chairs, shelves, books, vases, pictures. Tables and cupboards are methods of the builder.

use glam::DVec3;

use super::super::random::Random;
use super::builder::{Builder, CLAY, GREEN, NONE, WHITE, WOOD, matt};
use super::revolution::revolution;

/// A random colour of paint.
pub fn paint(random: &mut Random) -> [f32; 3] {
    let colors = [
        WHITE,
        CLAY,
        GREEN,
        [0.75, 0.74, 0.72],
        [0.7, 0.62, 0.45],
        [0.35, 0.42, 0.6],
        [0.6, 0.35, 0.3],
        [0.78, 0.76, 0.6],
    ];
    colors[(random.next() % 8) as usize]
}

/// A chair with four legs.
pub fn chair(b: &mut Builder, x: f64, z: f64, turn: f64) {
    b.mesh_at_turn("chair seat", [0.44, 0.04, 0.44], [x, 0.45, z], turn, [0.0; 3]);
    for (dx, dz) in [(-0.19, -0.19), (0.19, -0.19), (-0.19, 0.19), (0.19, 0.19)] {
        b.mesh_at_turn("chair leg", [0.04, 0.43, 0.04], [x, 0.215, z], turn, [dx, 0.0, dz]);
    }
    b.mesh_at_turn("chair back", [0.44, 0.4, 0.03], [x, 0.67, z], turn, [0.0, 0.0, -0.205]);
}

/// A shelf that is open towards +z and has its back at z.
pub fn shelf(b: &mut Builder, x: f64, z: f64, width: f64, boards: u32) {
    const BOARD: f64 = 0.025;
    let (height, depth) = (1.8, 0.32);
    b.block("shelf left", [x, 0.0, z], [x + BOARD, height, z + depth], WOOD, 0.0);
    b.block("shelf right", [x + width - BOARD, 0.0, z], [x + width, height, z + depth], WOOD, 0.0);
    b.block("shelf back", [x + BOARD, 0.0, z], [x + width - BOARD, height, z + 0.01], WOOD, 0.0);
    for board in 0..boards {
        let y = 0.06 + (height - 0.06 - BOARD) * f64::from(board) / f64::from(boards - 1);
        let low = [x + BOARD, y, z + 0.01];
        b.block("shelf board", low, [x + width - BOARD, y + BOARD, z + depth], WOOD, 0.0);
    }
}

/// A row of books: thin blocks of random size.
pub fn books(b: &mut Builder, low: [f64; 3], count: u32, random: &mut Random) {
    let mut x = low[0];
    for _ in 0..count {
        let (width, height) = (random.between(0.02, 0.05), random.between(0.2, 0.3));
        let color = paint(random);
        b.block("book", [x, low[1], low[2]], [x + width, low[1] + height, low[2] + 0.2], color, 0.0);
        x += width + 0.001;
    }
}

/// A closed vase of several hundred triangles.
pub fn vase(b: &mut Builder, at: [f64; 3], color: [f32; 3]) {
    let (size, segments, rings) = (b.scale, 20, 14);
    let profile = |t: f64| {
        // The profile goes up the outside; the radius falls to 0 at both ends, which closes the vase.
        let radius = 0.05 + 0.045 * (4.6 * t + 0.4).sin() * (1.0 - 0.3 * t);
        let closed = (t * 40.0).min((1.0 - t) * 40.0).min(1.0);
        [radius * closed * size, 0.3 * t * size]
    };
    b.mesh("vase", revolution(profile, segments, rings), matt(color, NONE), DVec3::from(at), 0.0);
}

/// A framed picture on a wall that faces +z.
pub fn picture(b: &mut Builder, middle: [f64; 3], [width, height]: [f64; 2], color: [f32; 3]) {
    let [x, y, z] = middle;
    let (w, h) = (width / 2.0, height / 2.0);
    b.block("picture", [x - w, y - h, z], [x + w, y + h, z + 0.015], color, 0.0);
    for (dx, dy, w, h) in [
        (-w - 0.02, 0.0, 0.02, h + 0.04),
        (w + 0.02, 0.0, 0.02, h + 0.04),
        (0.0, -h - 0.02, w, 0.02),
        (0.0, h + 0.02, w, 0.02),
    ] {
        let (x, y) = (x + dx, y + dy);
        b.block("picture frame", [x - w, y - h, z], [x + w, y + h, z + 0.03], WOOD, 0.0);
    }
}
