//! Triangles cut into similar pieces of equal area, each with a power: that of the light it emits (`lamps`) or reflects
//! (`bright`).

use glam::{DVec2, DVec3};

use super::hierarchy::Triangle;

/// A part of a triangle, given by a corner and two edges in the triangle's barycentric coordinates.
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
    /// The corners in world space.
    pub fn corners(&self, triangle: &Triangle) -> [DVec3; 3] {
        [DVec2::ZERO, self.edges[0], self.edges[1]].map(|edge| triangle.at(self.corner + edge))
    }

    /// The barycentric coordinates, in the triangle, of a point chosen uniformly on the piece by two uniform numbers.
    pub fn barycentric(&self, [u, v]: [f64; 2]) -> DVec2 {
        let root = u.sqrt();
        self.corner + self.edges[0] * (root * (1.0 - v)) + self.edges[1] * (root * v)
    }
}

/// The number of pieces along each edge of a triangle for which a piece has at most half the area of a square of side
/// `edge`; 64 at the most.
pub fn divisions(triangle: &Triangle, edge: f64) -> u32 {
    (2.0 * triangle.area / (edge * edge)).sqrt().ceil().clamp(1.0, 64.0) as u32
}

/// Cuts a triangle into pieces, `sides` along each edge. Their power is still 0.
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

/// The index of the piece, among those of `cut`, that contains a point with these barycentric coordinates.
pub fn index_at(barycentric: DVec2, sides: u32) -> usize {
    let n = f64::from(sides);
    let at = (barycentric * n).clamp(DVec2::ZERO, DVec2::splat(n));
    let i = (at.x as usize).min(sides as usize - 1);
    let j = (at.y as usize).min(sides as usize - 1 - i);
    let upper = i + j + 1 < sides as usize && (at.x - i as f64) + (at.y - j as f64) > 1.0;
    // Each row k before row i has 2 (n - k) - 1 pieces.
    2 * sides as usize * i - i * i + 2 * j + usize::from(upper)
}
