//! Patches: the pieces of surface over which radiosity is constant. They are the cells of triangles, or pieces of cut
//! cells: `triangle_cells` divides the triangles. The light of patches is computed in `form_factors` and `solver`.

use std::f32::consts::FRAC_1_SQRT_2;

use std::collections::BTreeMap;

use glam::Vec3;
use rayon::prelude::*;

use super::bsp::BspTrees;
use super::patch_index::PatchIndex;
use super::triangle_cells::{CORNERS, TriangleCells, cell_at, point_in_row, row_of_cell};
use crate::scene::mean_of_points::{SubTriangle, mean_of_points};
use crate::scene::{BakeScene, SceneTriangle, ShownTexels, Side};
use crate::texel_index::MapIndex;

/// One side of one piece of a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patch {
    pub triangle: u32,
    pub side: Side,
    /// Which piece of the triangle this is: a whole cell as [`packed`] stores it or, with [`PIECE_FLAG`] set, the index
    /// of a piece of a cut cell.
    cell: u32,
    /// Square canonical units.
    pub area: f32,
    /// Mean diffuse reflectance.
    pub reflectance: Vec3,
}

/// Where the patches of one triangle are in the list of all patches.
#[derive(Clone, Copy, Debug)]
struct TrianglePatches {
    /// Cells along each edge; 0 for a triangle that receives no light.
    divisions: u32,
    /// The first patch of the front, and of the back of a two-sided triangle.
    front: PatchIndex,
    back: Option<PatchIndex>,
    /// Reflectance of the front and of the back; `None` where it varies over the triangle.
    reflectance: Option<[Vec3; 2]>,
    /// Where the tree roots of its cells begin in [`Patches::roots`]; [`UNCUT`] if none of its cells is cut.
    roots: u32,
}

impl TrianglePatches {
    /// Of a triangle that receives no light.
    const NONE: Self = Self {
        divisions: 0,
        front: PatchIndex(0),
        back: None,
        reflectance: Some([Vec3::ZERO; 2]),
        roots: UNCUT,
    };
}

/// Smallest area of a piece, as a share of its cell's.
const MIN_PIECE_SHARE: f32 = 1e-6;
/// In place of a tree's root: no line cuts the cell, or any cell of the triangle.
const UNCUT: u32 = u32::MAX;
/// Marks the number of a piece of a cut cell, as opposed to that of a whole cell.
const PIECE_FLAG: u32 = 1 << 31;
/// Bit of [`Patch::cell`] at which the row begins. The row and the place in it are both below 2^11, as a triangle has
/// at most 1024 divisions.
const ROW_SHIFT: u32 = 16;

/// All patches of a scene, and the structures that find the patch at a point.
#[derive(Clone, Debug)]
pub(crate) struct Patches {
    pub list: Vec<Patch>,
    triangles: Vec<TrianglePatches>,
    /// For each cell of each triangle with cut cells: the root of the cell's tree, or [`UNCUT`].
    roots: Vec<u32>,
    trees: BspTrees,
    /// Where patches are coarser than they should be, for the report.
    pub warnings: Vec<String>,
}

/// Most points along a patch's edge at which textures are averaged.
const MAX_TEXTURE_POINTS: u32 = 64;
/// Texels along a patch's edge up to which each of them has a point.
const FEW_TEXELS: f32 = 16.0;

impl Patches {
    /// The mean of all patches, weighted by area, of the channels' mean; at most 0.999.
    pub fn mean_reflectance(&self) -> f64 {
        let (sum, area) = self.list.iter().fold((0.0, 0.0), |(sum, total), patch| {
            let area = f64::from(patch.area);
            (sum + area * f64::from(patch.reflectance.element_sum()) / 3.0, total + area)
        });
        if area > 0.0 { (sum / area).clamp(0.0, 0.999) } else { 0.0 }
    }

    /// How many patches [`Patches::new`] would make, without the memory that they take.
    pub fn count(scene: &BakeScene, side: f32) -> u64 {
        let mut trees = BspTrees::default();
        let lit = scene.triangles.iter().enumerate().filter(|(_, triangle)| !triangle.is_hidden_duplicate);
        let lit = lit.take_while(|_| !scene.stop.is_cancelled());
        lit.map(|(index, triangle)| {
            let cells = TriangleCells::new(scene, index, side, &mut trees);
            cells.patches_per_side() * (1 + u64::from(triangle.two_sided))
        })
        .sum()
    }

    /// Divides every triangle into patches of about `side` canonical units.
    pub fn new(scene: &BakeScene, side: f32) -> Self {
        let mut patches = Self::outlines(scene, side);
        patches.find_reflectances(scene);
        patches
    }

    /// As [`Patches::new`], but without reflectances: all of them are 0.
    pub fn outlines(scene: &BakeScene, side: f32) -> Self {
        let mut patches = Self {
            list: Vec::new(),
            triangles: Vec::with_capacity(scene.triangles.len()),
            roots: Vec::new(),
            trees: BspTrees::default(),
            warnings: Vec::new(),
        };
        // Per object, how many of its cells more lines cross than may cut them.
        let mut full_cells: BTreeMap<MapIndex, usize> = BTreeMap::new();
        for (index, triangle) in scene.triangles.iter().enumerate() {
            if triangle.is_hidden_duplicate || scene.stop.is_cancelled() {
                patches.triangles.push(TrianglePatches::NONE);
                continue;
            }
            let full_before = patches.trees.full;
            let cells = TriangleCells::new(scene, index, side, &mut patches.trees);
            if patches.trees.full > full_before {
                *full_cells.entry(triangle.map).or_default() += patches.trees.full - full_before;
            }
            patches.push_triangle(scene, index, &cells);
        }
        let warning = |(map, count): (MapIndex, usize)| {
            format!(
                "{}: more surfaces stand on {count} of its cells than patches are cut along; light that bounces off there mixes between \
                 what they divide",
                scene.names[map.place()]
            )
        };
        patches.warnings = full_cells.into_iter().map(warning).collect();
        patches
    }

    /// Appends the patches of a triangle.
    fn push_triangle(&mut self, scene: &BakeScene, index: usize, cells: &TriangleCells) {
        let triangle = &scene.triangles[index];
        let roots = self.push_roots(cells);
        let front = self.push_side(triangle, (index, Side::Front), cells);
        let back = triangle.two_sided.then(|| self.push_side(triangle, (index, Side::Back), cells));
        let varies = scene.surfaces[triangle.surface as usize].varies();
        let reflectance = (!varies).then_some([Vec3::ZERO; 2]);
        let divisions = cells.divisions;
        self.triangles.push(TrianglePatches { divisions, front, back, reflectance, roots });
    }

    /// Appends the tree roots of a triangle's cells if any of them is cut; returns where they begin, or [`UNCUT`].
    fn push_roots(&mut self, cells: &TriangleCells) -> u32 {
        if cells.cut.is_empty() {
            return UNCUT;
        }
        let first = self.roots.len();
        self.roots.resize(first + cells.count() as usize, UNCUT);
        for (cell, cut) in &cells.cut {
            self.roots[first + *cell as usize] = cut.root;
        }
        first as u32
    }

    /// Appends the patches of one side of a triangle; returns the first. A patch's place after the first is its slot in
    /// the trees: a cut cell's first piece takes the place of the cell, and its other pieces follow after all cells.
    fn push_side(
        &mut self,
        triangle: &SceneTriangle,
        (index, side): (usize, Side),
        cells: &TriangleCells,
    ) -> PatchIndex {
        let Self { list, trees, .. } = self;
        let (divisions, count) = (cells.divisions, cells.count());
        let first = PatchIndex::new(list.len());
        let patch = |cell: u32| {
            let area = match cell & PIECE_FLAG {
                0 => triangle.area / count as f32,
                // The corners of a very fine cell's piece may coincide by rounding, but no patch may have zero area.
                _ => {
                    let corners = &trees.pieces[(cell & !PIECE_FLAG) as usize];
                    triangle.area * area_share(corners).max(MIN_PIECE_SHARE / count as f32)
                }
            };
            let (cell, reflectance) = (packed(divisions, cell), Vec3::ZERO);
            Patch { triangle: index as u32, side, cell, area, reflectance }
        };
        list.extend((0..count).map(patch));
        for (cell, cut) in &cells.cut {
            let mut pieces = (cut.first..cut.first + cut.count).map(|piece| patch(PIECE_FLAG | piece));
            if let Some(first_piece) = pieces.next() {
                list[first.place() + *cell as usize] = first_piece;
            }
            list.extend(pieces);
        }
        first
    }

    /// Finds what each patch reflects, and warns of textures that are too fine for the patches.
    fn find_reflectances(&mut self, scene: &BakeScene) {
        let of_patch = |patch: &Patch| {
            if scene.stop.is_cancelled() {
                return (Vec3::ZERO, None);
            }
            let corners = CORNERS.map(|at| self.point(patch, at));
            reflectance_and_texels(scene, patch.triangle as usize, patch.side, &corners)
        };
        let results: Vec<(Vec3, Option<f32>)> = self.list.par_iter().map(of_patch).collect();
        // Per object with a patch that shows too many texels, the most texels along a patch's edge.
        let mut most_texels: BTreeMap<MapIndex, f32> = BTreeMap::new();
        for (patch, (reflectance, texels)) in self.list.iter_mut().zip(results) {
            patch.reflectance = reflectance;
            if let Some(texels) = texels {
                let most = most_texels.entry(scene.triangles[patch.triangle as usize].map).or_default();
                *most = most.max(texels);
            }
        }
        let list = &self.list;
        for triangle in self.triangles.iter_mut().filter(|triangle| triangle.divisions > 0) {
            let reflectance = |patch: PatchIndex| list[patch.place()].reflectance;
            if let Some(sides) = &mut triangle.reflectance {
                *sides = [reflectance(triangle.front), triangle.back.map_or(Vec3::ZERO, reflectance)];
            }
        }
        self.warnings.extend(most_texels.into_iter().map(|(map, most)| {
            format!(
                "{}: a patch of it shows up to {most:.0} texels of its textures along an edge; what bounces off it is the mean of \
                 {MAX_TEXTURE_POINTS} points along there, which may miss what is smaller",
                scene.names[map.place()]
            )
        }));
    }

    /// The patch at a point of a triangle's side, given by barycentric weights; `None` where no light is received.
    pub fn at(&self, triangle: u32, side: Side, (u, v): (f32, f32)) -> Option<PatchIndex> {
        let triangle = &self.triangles[triangle as usize];
        if triangle.divisions == 0 {
            return None;
        }
        let first = match side {
            Side::Front => triangle.front,
            Side::Back => triangle.back?,
        };
        let cell = cell_at(triangle.divisions, u, v);
        if triangle.roots != UNCUT {
            let root = self.roots[(triangle.roots + cell) as usize];
            if root != UNCUT {
                return Some(PatchIndex(first.0 + self.trees.find(root, u, v)));
            }
        }
        Some(PatchIndex(first.0 + cell))
    }

    /// Reflectance of a triangle's side; `None` if it varies over the triangle.
    pub fn reflectance(&self, triangle: u32, side: Side) -> Option<Vec3> {
        self.triangles[triangle as usize].reflectance.map(|sides| sides[usize::from(side == Side::Back)])
    }

    /// Converts barycentric weights in a patch to those in its triangle, both of the second and third vertex.
    pub fn point(&self, patch: &Patch, (u, v): (f32, f32)) -> (f32, f32) {
        if patch.cell & PIECE_FLAG == 0 {
            let divisions = self.triangles[patch.triangle as usize].divisions.max(1);
            let (row, place) = (patch.cell >> ROW_SHIFT, patch.cell & ((1 << ROW_SHIFT) - 1));
            return point_in_row(divisions, row, place, u, v);
        }
        point_between(&self.trees.pieces[(patch.cell & !PIECE_FLAG) as usize], u, v)
    }
}

impl Patches {
    /// Per patch, the distance below which it is too coarse to be treated as uniformly bright, canonical units: twice
    /// the length of its side, which is at most `side`.
    pub fn min_read_distances(&self, scene: &BakeScene, side: f32) -> Vec<f32> {
        let of_patch = |patch: &Patch| {
            let [a, b, c] = self.corners(scene, patch);
            let longest = (b - a).length().max((c - b).length()).max((a - c).length());
            // The longest edge of half a square is the square's diagonal.
            NEAR_SIDES * side.min(longest * FRAC_1_SQRT_2)
        };
        self.list.iter().map(of_patch).collect()
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

/// A patch is too coarse within this many times the length of its side.
const NEAR_SIDES: f32 = 2.0;

/// Area of a piece as a share of its triangle's.
fn area_share(corners: &SubTriangle) -> f32 {
    let [a, b, c] = *corners;
    ((b.0 - a.0) * (c.1 - a.1) - (c.0 - a.0) * (b.1 - a.1)).abs()
}

/// The point of a triangle with the given corners at barycentric weights (u, v).
fn point_between([a, b, c]: &SubTriangle, u: f32, v: f32) -> (f32, f32) {
    (a.0 + (b.0 - a.0) * u + (c.0 - a.0) * v, a.1 + (b.1 - a.1) * u + (c.1 - a.1) * v)
}

/// The mean reflectance of a part of a triangle. If it shows more texels than [`MAX_TEXTURE_POINTS`] allow for, also the
/// number of texels along its longest edge.
fn reflectance_and_texels(
    scene: &BakeScene,
    index: usize,
    side: Side,
    corners: &SubTriangle,
) -> (Vec3, Option<f32>) {
    let triangle = &scene.triangles[index];
    let surface = &scene.surfaces[triangle.surface as usize];
    let texels = surface.reflectance_texels(triangle.vertices, *corners);
    let points = texture_points(texels);
    let n = if surface.varies() { (points.ceil() as u32).clamp(2, MAX_TEXTURE_POINTS) } else { 1 };
    let mean = mean_of_points(n, |(u, v)| {
        let (u, v) = point_between(corners, u, v);
        surface.reflectance(side, triangle.vertices, [1.0 - u - v, u, v])
    });
    (mean, (points > MAX_TEXTURE_POINTS as f32).then_some(texels.edge))
}

/// Points along a patch's edge, n for n² points in all, at which its textures are averaged. A few texels are averaged
/// with a point for each of them along the longest edge, which makes at least two per texel. Of many, one point
/// per texel is enough, and one for every two texels along an edge, since bilinear filtering reads two.
fn texture_points(texels: ShownTexels) -> f32 {
    texels.edge.min(FEW_TEXELS).max(texels.area.sqrt()).max(0.5 * texels.edge)
}

/// The number of a cell or piece as [`Patch::cell`] stores it. A cell is stored as its row and its place in it, since
/// finding the row takes a square root.
fn packed(divisions: u32, cell: u32) -> u32 {
    if cell & PIECE_FLAG != 0 {
        return cell;
    }
    let (row, place) = row_of_cell(divisions, cell);
    row << ROW_SHIFT | place
}
