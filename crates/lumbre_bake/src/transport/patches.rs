//! Patches: the pieces of surface over which radiosity is constant. Each triangle is cut into n² equal ones, so that a
//! ray's hit finds its patch by arithmetic. Not their light: that is `form_factors` and `solver`.

use glam::Vec3;

use crate::scene::material::Side;
use crate::scene::{BakeScene, SceneTriangle};

/// One side of one piece of a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patch {
    pub triangle: u32,
    pub side: Side,
    /// Which piece of its triangle.
    pub cell: u32,
    /// Square canonical units.
    pub area: f32,
    /// Mean diffuse reflectance.
    pub reflectance: Vec3,
}

/// Where the patches of a triangle are in the list.
#[derive(Clone, Copy, Debug)]
struct Cut {
    /// Pieces along each edge; 0 for a triangle that light does not meet.
    divisions: u32,
    front: u32,
    back: Option<u32>,
}

/// All patches, and the way from a point to its patch.
#[derive(Clone, Debug)]
pub(crate) struct Patches {
    pub list: Vec<Patch>,
    cuts: Vec<Cut>,
}

/// Points of a patch at which textures are averaged.
const TEXTURE_POINTS: [(f32, f32); 4] =
    [(1.0 / 3.0, 1.0 / 3.0), (2.0 / 3.0, 1.0 / 6.0), (1.0 / 6.0, 2.0 / 3.0), (1.0 / 6.0, 1.0 / 6.0)];

impl Patches {
    /// By area, mean of the channels, at most .999.
    pub fn mean_reflectance(&self) -> f64 {
        let (sum, area) = self.list.iter().fold((0.0, 0.0), |(sum, area), patch| {
            let own = f64::from(patch.area);
            (sum + own * f64::from(patch.reflectance.element_sum()) / 3.0, area + own)
        });
        if area > 0.0 { (sum / area).clamp(0.0, 0.999) } else { 0.0 }
    }

    /// How many [`Patches::new`] would make.
    pub fn count(scene: &BakeScene, side: f32) -> u64 {
        let met = scene.triangles.iter().filter(|triangle| !triangle.superseded);
        met.map(|t| u64::from(divisions(t, side)).pow(2) * (1 + u64::from(t.two_sided))).sum()
    }

    /// Cuts every triangle into patches of about `side` canonical units.
    pub fn new(scene: &BakeScene, side: f32) -> Self {
        let (mut list, mut cuts) = (Vec::new(), Vec::with_capacity(scene.triangles.len()));
        for (index, triangle) in scene.triangles.iter().enumerate() {
            if triangle.superseded {
                cuts.push(Cut { divisions: 0, front: 0, back: None });
                continue;
            }
            let divisions = divisions(triangle, side);
            let mut add = |face: Side| {
                let first = list.len() as u32;
                for cell in 0..divisions * divisions {
                    list.push(Patch {
                        triangle: index as u32,
                        side: face,
                        cell,
                        area: triangle.area / (divisions * divisions) as f32,
                        reflectance: mean_reflectance(scene, index, face, divisions, cell),
                    });
                }
                first
            };
            let front = add(Side::Front);
            let back = triangle.two_sided.then(|| add(Side::Back));
            cuts.push(Cut { divisions, front, back });
        }
        Self { list, cuts }
    }

    /// The patch at a point of a triangle's side; none where light does not arrive.
    pub fn at(&self, triangle: u32, side: Side, (u, v): (f32, f32)) -> Option<u32> {
        let cut = &self.cuts[triangle as usize];
        if cut.divisions == 0 {
            return None;
        }
        let first = match side {
            Side::Front => cut.front,
            Side::Back => cut.back?,
        };
        Some(first + cell_at(cut.divisions, u, v))
    }

    /// Barycentric weights (second, third vertex) of a point of a patch given by weights of its own.
    pub fn point(&self, patch: &Patch, (u, v): (f32, f32)) -> (f32, f32) {
        point_of_cell(self.cuts[patch.triangle as usize].divisions.max(1), patch.cell, u, v)
    }
}

impl Patches {
    /// The patch's corners, canonical units.
    pub fn corners(&self, scene: &BakeScene, patch: &Patch) -> [Vec3; 3] {
        let triangle = &scene.triangles[patch.triangle as usize];
        [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)].map(|at| {
            let (u, v) = self.point(patch, at);
            triangle.position(u, v)
        })
    }
}

/// Pieces along each edge of a triangle.
fn divisions(triangle: &SceneTriangle, side: f32) -> u32 {
    let [a, b, c] = triangle.corners;
    let longest = (b - a).length().max((c - b).length()).max((a - c).length());
    // As many as the area asks for; a sliver is cut until its pieces are four sides long.
    let by_area = (triangle.area / (0.5 * side * side)).sqrt();
    by_area.max(longest / (4.0 * side)).ceil().clamp(1.0, 1024.0) as u32
}

fn mean_reflectance(scene: &BakeScene, index: usize, side: Side, divisions: u32, cell: u32) -> Vec3 {
    let triangle = &scene.triangles[index];
    let surface = &scene.surfaces[triangle.surface as usize];
    let points = if surface.varies() { &TEXTURE_POINTS[..] } else { &TEXTURE_POINTS[..1] };
    let sum: Vec3 = points
        .iter()
        .map(|&(u, v)| {
            let (u, v) = point_of_cell(divisions, cell, u, v);
            surface.reflectance(side, triangle.vertices, [1.0 - u - v, u, v])
        })
        .sum();
    sum / points.len() as f32
}

/// Row `a` holds 2(n - a) - 1 cells, so the rows before it hold a(2n - a).
fn cell_at(divisions: u32, u: f32, v: f32) -> u32 {
    let n = divisions as f32;
    let (x, y) = (u.clamp(0.0, 1.0) * n, v.clamp(0.0, 1.0) * n);
    let a = (x as u32).min(divisions - 1);
    let b = (y as u32).min(divisions - 1 - a);
    let beyond = (x - a as f32) + (y - b as f32) > 1.0 && b + a + 1 < divisions;
    a * (2 * divisions - a) + 2 * b + u32::from(beyond)
}

fn point_of_cell(divisions: u32, cell: u32, u: f32, v: f32) -> (f32, f32) {
    let n = f64::from(divisions);
    // The largest a with a(2n - a) <= cell.
    let mut a = (n - (n * n - f64::from(cell)).max(0.0).sqrt()) as u32;
    while a > 0 && a * (2 * divisions - a) > cell {
        a -= 1;
    }
    while (a + 1) * (2 * divisions - a - 1) <= cell && a + 1 < divisions {
        a += 1;
    }
    let within = cell - a * (2 * divisions - a);
    let b = within / 2;
    let (x, y) = if within.is_multiple_of(2) {
        (a as f32 + u, b as f32 + v)
    } else {
        // The turned cell between (a+1, b), (a+1, b+1) and (a, b+1).
        (a as f32 + 1.0 - u, b as f32 + 1.0 - v)
    };
    (x / divisions as f32, y / divisions as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_finds_itself() {
        for divisions in [1, 2, 3, 7, 64] {
            for cell in 0..divisions * divisions {
                for at in [(1.0 / 3.0, 1.0 / 3.0), (0.1, 0.1), (0.8, 0.1), (0.1, 0.8)] {
                    let (u, v) = point_of_cell(divisions, cell, at.0, at.1);
                    assert!(u >= 0.0 && v >= 0.0 && u + v <= 1.0 + 1e-6);
                    assert_eq!(cell_at(divisions, u, v), cell, "{divisions} {cell} {at:?}");
                }
            }
        }
    }

    #[test]
    fn corners_and_edges_belong_to_a_cell() {
        for divisions in [1, 2, 5] {
            for (u, v) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.5), (1.0, 1.0)] {
                assert!(cell_at(divisions, u, v) < divisions * divisions);
            }
        }
    }
}
