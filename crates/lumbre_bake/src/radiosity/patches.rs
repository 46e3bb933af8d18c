//! Patches: the pieces of surface over which radiosity is constant. Each triangle is cut into n² equal cells, so that a
//! ray's hit finds its own by arithmetic; cells that other surfaces stand on or pass through are cut further along those.
//! Not their light: that is `form_factors` and `solver`.

use std::f32::consts::FRAC_1_SQRT_2;

use std::collections::BTreeMap;

use glam::{DMat2, DVec2, Vec3};
use rayon::prelude::*;

use super::bsp::{BspTrees, Corners, CutCell};
use super::patch_index::PatchIndex;
use crate::scene::mean_of_points::mean_of_points;
use crate::visibility::contacts::{PlaneFrame, contacts};

use crate::scene::material::Side;
use crate::scene::{BakeScene, SceneTriangle};

/// One side of one piece of a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patch {
    pub triangle: u32,
    pub side: Side,
    /// Which piece of its triangle: a cell's row and place in it, or with the highest bit a piece of one.
    cell: u32,
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
    front: PatchIndex,
    back: Option<PatchIndex>,
    /// Of the front's first patch and the back's: of all, where it does not vary.
    reflectance: [Vec3; 2],
    varies: bool,
    /// Where the trees of its cells are listed; [`UNCUT`] if none is cut.
    roots: u32,
}

/// Share of a cell that a piece of it has at least.
const MIN_PIECE: f32 = 1e-6;
/// Of a cell, or of all of a triangle's: no line goes through.
const UNCUT: u32 = u32::MAX;
/// Marks a piece of a cell.
const PIECE: u32 = 1 << 31;
/// Where in a patch's cell the row begins; both it and the place in it are below 2^11, as a triangle has at most 1024 divisions.
const ROW: u32 = 16;

/// All patches, and the way from a point to its patch.
#[derive(Clone, Debug)]
pub(crate) struct Patches {
    pub list: Vec<Patch>,
    cuts: Vec<Cut>,
    /// Of each cell of each triangle that has some cut: its tree, or [`UNCUT`].
    roots: Vec<u32>,
    lines: BspTrees,
    /// What is coarser than it should be, in words.
    pub warnings: Vec<String>,
}

/// Points along a patch's edge at which textures are averaged: one for each texel, so that bilinear filtering leaves none out, but not more than
/// so many.
const TEXTURE_POINTS: u32 = 64;

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
        let mut lines = BspTrees::default();
        let met = scene.triangles.iter().enumerate().filter(|(_, triangle)| !triangle.is_hidden_duplicate);
        let met = met.take_while(|_| !scene.stop.is_cancelled());
        met.map(|(index, triangle)| {
            let divisions = divisions(triangle, side);
            let cut = cut_cells(scene, index, divisions, side, &mut lines);
            let more: u64 = cut.iter().map(|(_, cut)| u64::from(cut.count - 1)).sum();
            (u64::from(divisions).pow(2) + more) * (1 + u64::from(triangle.two_sided))
        })
        .sum()
    }

    /// BspTrees every triangle into patches of about `side` canonical units.
    pub fn new(scene: &BakeScene, side: f32) -> Self {
        let mut patches = Self::outlines(scene, side);
        let of_patch = |patch: &Patch| {
            if scene.stop.is_cancelled() {
                return (Vec3::ZERO, 0.0);
            }
            let corners = CORNERS.map(|at| patches.point(patch, at));
            mean_reflectance(scene, patch.triangle as usize, patch.side, &corners)
        };
        let found: Vec<(Vec3, f32)> = patches.list.par_iter().map(of_patch).collect();
        // Of each object, the most texels along a patch's edge.
        let mut texels: BTreeMap<u32, f32> = BTreeMap::new();
        for (patch, (reflectance, along)) in patches.list.iter_mut().zip(found) {
            patch.reflectance = reflectance;
            if along > TEXTURE_POINTS as f32 {
                let most = texels.entry(scene.triangles[patch.triangle as usize].object).or_default();
                *most = most.max(along);
            }
        }
        for cut in patches.cuts.iter_mut().filter(|cut| cut.divisions > 0) {
            let first = |patch: PatchIndex| patches.list[patch.place()].reflectance;
            cut.reflectance = [first(cut.front), cut.back.map_or(Vec3::ZERO, first)];
        }
        let coarse = texels.into_iter().map(|(object, most)| {
            format!(
                "{}: a patch of it shows up to {most:.0} texels of its textures along an edge; what bounces off it is the mean of \
                 {TEXTURE_POINTS} points along there, which may miss what is smaller",
                scene.names[object as usize]
            )
        });
        patches.warnings.extend(coarse);
        patches
    }

    /// The same, of which nobody asks what they reflect.
    pub fn outlines(scene: &BakeScene, side: f32) -> Self {
        let mut lines = BspTrees::default();
        let (mut list, mut cuts) = (Vec::new(), Vec::with_capacity(scene.triangles.len()));
        let mut roots = Vec::new();
        let mut full: BTreeMap<u32, usize> = BTreeMap::new();
        for (index, triangle) in scene.triangles.iter().enumerate() {
            if triangle.is_hidden_duplicate || scene.stop.is_cancelled() {
                cuts.push(Cut {
                    divisions: 0,
                    front: PatchIndex(0),
                    back: None,
                    reflectance: [Vec3::ZERO; 2],
                    varies: false,
                    roots: UNCUT,
                });
                continue;
            }
            let divisions = divisions(triangle, side);
            let cells = divisions * divisions;
            let before = lines.full;
            let cut = cut_cells(scene, index, divisions, side, &mut lines);
            if lines.full > before {
                *full.entry(triangle.object).or_default() += lines.full - before;
            }
            let own_roots = if cut.is_empty() { UNCUT } else { roots.len() as u32 };
            if !cut.is_empty() {
                roots.resize(roots.len() + cells as usize, UNCUT);
                for (cell, cut) in &cut {
                    roots[(own_roots + cell) as usize] = cut.root;
                }
            }
            let mut add = |side: Side| {
                let first = PatchIndex::new(list.len());
                let patch = |cell: u32| {
                    let corners = corners_of(&lines, divisions, cell);
                    let area = match cell & PIECE {
                        0 => triangle.area / cells as f32,
                        // Of a very fine cell's piece the corners may fall together: no patch is without area.
                        _ => triangle.area * share(&corners).max(MIN_PIECE / cells as f32),
                    };
                    let (cell, reflectance) = (packed(divisions, cell), Vec3::ZERO);
                    Patch { triangle: index as u32, side, cell, area, reflectance }
                };
                list.extend((0..cells).map(patch));
                for (cell, cut) in &cut {
                    let mut pieces = (cut.first..cut.first + cut.count).map(|piece| patch(PIECE | piece));
                    if let Some(own) = pieces.next() {
                        list[first.place() + *cell as usize] = own;
                    }
                    list.extend(pieces);
                }
                first
            };
            let front = add(Side::Front);
            let back = triangle.two_sided.then(|| add(Side::Back));
            let reflectance = [Vec3::ZERO; 2];
            let varies = scene.surfaces[triangle.surface as usize].varies();
            cuts.push(Cut { divisions, front, back, reflectance, varies, roots: own_roots });
        }
        let crossed = full.into_iter().map(|(object, count)| {
            format!(
                "{}: more surfaces stand on {count} of its cells than patches are cut along; light that bounces off there mixes between \
                 what they divide",
                scene.names[object as usize]
            )
        });
        let warnings = crossed.collect();
        Self { list, cuts, roots, lines, warnings }
    }

    /// The patch at a point of a triangle's side; none where light does not arrive.
    pub fn at(&self, triangle: u32, side: Side, (u, v): (f32, f32)) -> Option<PatchIndex> {
        let cut = &self.cuts[triangle as usize];
        if cut.divisions == 0 {
            return None;
        }
        let first = match side {
            Side::Front => cut.front,
            Side::Back => cut.back?,
        };
        let cell = cell_at(cut.divisions, u, v);
        if cut.roots != UNCUT {
            let root = self.roots[(cut.roots + cell) as usize];
            if root != UNCUT {
                return Some(PatchIndex(first.0 + self.lines.find(root, u, v)));
            }
        }
        Some(PatchIndex(first.0 + cell))
    }

    /// Reflectance of a triangle's side, if it has the same all over.
    pub fn reflectance(&self, triangle: u32, side: Side) -> Option<Vec3> {
        let cut = &self.cuts[triangle as usize];
        (!cut.varies).then_some(cut.reflectance[usize::from(side == Side::Back)])
    }

    /// Barycentric weights (second, third vertex) of a point of a patch given by weights of its own.
    pub fn point(&self, patch: &Patch, (u, v): (f32, f32)) -> (f32, f32) {
        if patch.cell & PIECE == 0 {
            let divisions = self.cuts[patch.triangle as usize].divisions.max(1);
            return point_in_row(divisions, patch.cell >> ROW, patch.cell & ((1 << ROW) - 1), u, v);
        }
        point_between(&self.lines.pieces[(patch.cell & !PIECE) as usize], u, v)
    }
}

impl Patches {
    /// Of each patch, the distance below which it is too coarse to be read as if it had one light, canonical units: twice its side, which is `side` at
    /// most.
    pub fn near_distances(&self, scene: &BakeScene, side: f32) -> Vec<f32> {
        let of = |patch: &Patch| {
            let [a, b, c] = self.corners(scene, patch);
            let longest = (b - a).length().max((c - b).length()).max((a - c).length());
            // Of half a square, the longest edge is the diagonal.
            NEAR_SIDES * side.min(longest * FRAC_1_SQRT_2)
        };
        self.list.iter().map(of).collect()
    }

    /// The patch's corners, canonical units.
    pub fn corners(&self, scene: &BakeScene, patch: &Patch) -> [Vec3; 3] {
        let triangle = &scene.triangles[patch.triangle as usize];
        CORNERS.map(|at| {
            let (u, v) = self.point(patch, at);
            triangle.position(u, v)
        })
    }
}

/// Sides of a patch within which it is too coarse.
const NEAR_SIDES: f32 = 2.0;

/// Pieces along each edge of a triangle.
fn divisions(triangle: &SceneTriangle, side: f32) -> u32 {
    let [a, b, c] = triangle.corners;
    let longest = (b - a).length().max((c - b).length()).max((a - c).length());
    // As many as the area asks for; a sliver is cut until its pieces are four sides long.
    let by_area = (triangle.area / (0.5 * side * side)).sqrt();
    by_area.max(longest / (4.0 * side)).ceil().clamp(1.0, 1024.0) as u32
}

/// A cell is cut where it is not much smaller than what `side` asks for.
const WORTH_CUTTING: f32 = 0.125;

/// BspTrees the cells of a triangle along what stands on it; returns which.
fn cut_cells(
    scene: &BakeScene,
    index: usize,
    divisions: u32,
    side: f32,
    lines: &mut BspTrees,
) -> Vec<(u32, CutCell)> {
    let triangle = &scene.triangles[index];
    let cells = divisions * divisions;
    if triangle.area < WORTH_CUTTING * 0.5 * side * side * cells as f32 {
        return Vec::new();
    }
    let frame = PlaneFrame::new(triangle);
    let segments = contacts(scene, index as u32, &frame, side);
    let [a, b, c] = triangle.corners.map(|corner| frame.flat(corner.as_dvec3()));
    let weights = DMat2::from_cols(b - a, c - a).inverse();
    if segments.is_empty() || !weights.is_finite() {
        return Vec::new();
    }
    let mut crossed: Vec<(u32, u32)> = Vec::new();
    for (number, segment) in segments.iter().enumerate() {
        cells_along(divisions, segment.map(|p| weights * (p - a)), |cell| {
            crossed.push((cell, number as u32))
        });
    }
    crossed.sort_unstable();
    let mut free = cells;
    crossed
        .chunk_by(|x, y| x.0 == y.0)
        .filter_map(|own| {
            let cell = own[0].0;
            let corners = CORNERS.map(|(u, v)| {
                let (u, v) = point_of_cell(divisions, cell, u, v);
                a + (b - a) * f64::from(u) + (c - a) * f64::from(v)
            });
            let segments: Vec<[DVec2; 2]> =
                own.iter().map(|&(_, number)| segments[number as usize]).collect();
            let cut = lines.cut(corners, &segments, weights, (cell, free))?;
            free += cut.count - 1;
            Some((cell, cut))
        })
        .collect()
}

/// Calls `visit` for the cells that a segment, in barycentric weights, may cross.
fn cells_along(divisions: u32, [p, q]: [DVec2; 2], mut visit: impl FnMut(u32)) {
    let n = f64::from(divisions);
    let (p, q) = if p.x <= q.x { (p * n, q * n) } else { (q * n, p * n) };
    let row = |x: f64| (x.max(0.0) as u32).min(divisions - 1);
    for a in row(p.x)..=row(q.x) {
        let [from, to] = [f64::from(a), f64::from(a + 1)].map(|x| {
            let along = if q.x > p.x { ((x - p.x) / (q.x - p.x)).clamp(0.0, 1.0) } else { 0.0 };
            p.y + (q.y - p.y) * along
        });
        let (from, to) = if q.x > p.x { (from.min(to), from.max(to)) } else { (p.y.min(q.y), p.y.max(q.y)) };
        let last = divisions - 1 - a;
        for b in (from.max(0.0) as u32).min(last)..=(to.max(0.0) as u32).min(last) {
            let cell = a * (2 * divisions - a) + 2 * b;
            visit(cell);
            if b < last {
                visit(cell + 1);
            }
        }
    }
}

/// A cell's own corners.
const CORNERS: Corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)];

/// Of a cell or a piece of one.
fn corners_of(lines: &BspTrees, divisions: u32, cell: u32) -> Corners {
    if cell & PIECE == 0 {
        CORNERS.map(|(u, v)| point_of_cell(divisions, cell, u, v))
    } else {
        lines.pieces[(cell & !PIECE) as usize]
    }
}

/// A piece's share of its triangle.
fn share(corners: &Corners) -> f32 {
    let [a, b, c] = *corners;
    ((b.0 - a.0) * (c.1 - a.1) - (c.0 - a.0) * (b.1 - a.1)).abs()
}

fn point_between([a, b, c]: &Corners, u: f32, v: f32) -> (f32, f32) {
    (a.0 + (b.0 - a.0) * u + (c.0 - a.0) * v, a.1 + (b.1 - a.1) * u + (c.1 - a.1) * v)
}

/// Of a part of a triangle; and how many texels it shows along its longest edge.
fn mean_reflectance(scene: &BakeScene, index: usize, side: Side, corners: &Corners) -> (Vec3, f32) {
    let triangle = &scene.triangles[index];
    let surface = &scene.surfaces[triangle.surface as usize];
    let texels = surface.reflectance_texels(triangle.vertices, *corners);
    let points = if surface.varies() { (texels.ceil() as u32).clamp(2, TEXTURE_POINTS) } else { 1 };
    let mean = mean_of_points(points, |(u, v)| {
        let (u, v) = point_between(corners, u, v);
        surface.reflectance(side, triangle.vertices, [1.0 - u - v, u, v])
    });
    (mean, texels)
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

/// A cell, or a piece of one, as a patch keeps it: to find the row takes a root.
fn packed(divisions: u32, cell: u32) -> u32 {
    if cell & PIECE != 0 {
        return cell;
    }
    let (row, within) = row_of_cell(divisions, cell);
    row << ROW | within
}

/// A cell's row and place in it.
fn row_of_cell(divisions: u32, cell: u32) -> (u32, u32) {
    let n = f64::from(divisions);
    // The largest a with a(2n - a) <= cell.
    let mut a = (n - (n * n - f64::from(cell)).max(0.0).sqrt()) as u32;
    while a > 0 && a * (2 * divisions - a) > cell {
        a -= 1;
    }
    while (a + 1) * (2 * divisions - a - 1) <= cell && a + 1 < divisions {
        a += 1;
    }
    (a, cell - a * (2 * divisions - a))
}

fn point_of_cell(divisions: u32, cell: u32, u: f32, v: f32) -> (f32, f32) {
    let (row, within) = row_of_cell(divisions, cell);
    point_in_row(divisions, row, within, u, v)
}

fn point_in_row(divisions: u32, a: u32, within: u32, u: f32, v: f32) -> (f32, f32) {
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
