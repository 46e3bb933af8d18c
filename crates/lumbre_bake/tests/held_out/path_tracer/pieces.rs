//! Triangles cut into equal pieces, each with a weight of its own. Not what it stands for: light that is emitted, or reflected.

use glam::{DVec2, DVec3};

use super::hierarchy::Triangle;

/// A part of a triangle: a corner and two edges in shares of the triangle's second and third corner.
pub struct Piece {
    pub triangle: usize,
    corner: DVec2,
    edges: [DVec2; 2],
    pub middle: DVec3,
    /// The longest edge.
    pub size: f64,
    pub area: f64,
    pub power: f64,
}

impl Piece {
    /// Its corners in the world.
    pub fn corners(&self, triangle: &Triangle) -> [DVec3; 3] {
        [DVec2::ZERO, self.edges[0], self.edges[1]].map(|edge| triangle.at(self.corner + edge))
    }

    /// A point chosen evenly.
    pub fn shares(&self, [u, v]: [f64; 2]) -> DVec2 {
        let root = u.sqrt();
        self.corner + self.edges[0] * (root * (1.0 - v)) + self.edges[1] * (root * v)
    }
}

/// So many along every edge that a piece has the area of half a square of an edge.
pub fn sides_of(triangle: &Triangle, edge: f64) -> u32 {
    (2.0 * triangle.area / (edge * edge)).sqrt().ceil().clamp(1.0, 64.0) as u32
}

/// So many along every edge, without power.
pub fn cut(index: usize, triangle: &Triangle, sides: u32) -> Vec<Piece> {
    let step = 1.0 / f64::from(sides);
    let mut parts = Vec::new();
    for i in 0..sides {
        for j in 0..sides - i {
            let corner = DVec2::new(f64::from(i), f64::from(j)) * step;
            parts.push((corner, [DVec2::X * step, DVec2::Y * step]));
            if i + j + 1 < sides {
                parts.push((corner + step, [DVec2::NEG_X * step, DVec2::NEG_Y * step]));
            }
        }
    }
    let area = triangle.area * step * step;
    let size = triangle.longest_edge() * step;
    let piece = |(corner, edges): (DVec2, [DVec2; 2])| {
        let middle = triangle.at(corner + (edges[0] + edges[1]) / 3.0);
        Piece { triangle: index, corner, edges, middle, size, area, power: 0.0 }
    };
    parts.into_iter().map(piece).collect()
}

/// Which of the pieces holds a point.
pub fn place_of(shares: DVec2, sides: u32) -> usize {
    let n = f64::from(sides);
    let at = (shares * n).clamp(DVec2::ZERO, DVec2::splat(n));
    let i = (at.x as usize).min(sides as usize - 1);
    let j = (at.y as usize).min(sides as usize - 1 - i);
    let upper = i + j + 1 < sides as usize && (at.x - i as f64) + (at.y - j as f64) > 1.0;
    // Before row i there are 2 (n - k) - 1 pieces in each row k.
    2 * sides as usize * i - i * i + 2 * j + usize::from(upper)
}
