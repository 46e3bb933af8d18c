//! Patches: the pieces of surface over which radiosity is constant. They are the cells of triangles, pieces of cut cells,
//! or clusters of small triangles: `triangle_cells` divides the large ones, `face_clusters` puts the small ones together.
//! The light of patches is computed in `form_factors` and `solver`.

use std::f32::consts::FRAC_1_SQRT_2;

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::bsp::BspTrees;
use super::face_clusters::FaceClusters;
use super::patch_index::PatchIndex;
use super::subdivision::Subdivision;
use super::triangle_cells::{CORNERS, TriangleCells, cell_area, cell_at, point_in_row, row_of_cell};
use crate::sampling::triangle_point;
use crate::scene::mean_of_points::{SubTriangle, mean_of_points};
use crate::scene::{BakeScene, SceneTriangle, ShownTexels, Side};
use crate::texel_index::MapIndex;

/// One side of one piece of a triangle, or of a cluster of triangles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patch {
    /// The triangle, or the first one of the cluster.
    pub triangle: u32,
    pub side: Side,
    /// Which piece of the triangle this is: a whole cell as [`packed`] stores it; with [`PIECE_FLAG`] set, the index of a
    /// piece of a cut cell; or, with [`CLUSTER_FLAG`] set, the number of a cluster.
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
/// Marks the number of a cluster. Rows of cells end below it.
const CLUSTER_FLAG: u32 = 1 << 30;
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
    clusters: FaceClusters,
    pub subdivision: Subdivision,
    /// Where patches are coarser than they should be, for the report.
    pub warnings: Vec<String>,
}

/// Pieces of surface that are smaller than this share of a cell have fewer points, in proportion to their area: their
/// means are less exact, but they reflect less light.
const FEWER_POINTS_BELOW: f32 = 0.25;
/// As many points along its edge as any piece of surface may have.
const FEWEST_TEXTURE_POINTS: u32 = 4;

/// Most points along the edge of a piece of surface whose area is this share of a cell's, which may have `of_cell`.
fn most_texture_points(of_cell: u32, share: f32) -> u32 {
    let share = (share / FEWER_POINTS_BELOW).min(1.0);
    ((of_cell as f32 * share.sqrt()).ceil() as u32).max(FEWEST_TEXTURE_POINTS)
}

/// A texture that would take more points than this along a patch's edge is named in a warning, whether the bake is to be
/// exact or not.
const NAMED_ABOVE: f32 = 64.0;
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

    /// How many patches [`Patches::new`] would make, without the memory that they take. `None` if cutting cells adds more
    /// than `most_pieces`.
    pub fn count(scene: &BakeScene, subdivision: &Subdivision, most_pieces: u64) -> Option<u64> {
        let clusters = FaceClusters::new(scene, &subdivision.joinable, subdivision.side);
        let sides = |index: usize| 1 + u64::from(scene.triangles[index].two_sided);
        let of_clusters: u64 =
            (0..clusters.len()).map(|cluster| sides(clusters.faces(cluster)[0] as usize)).sum();
        let is_alone = |&index: &usize| {
            let triangle = &scene.triangles[index];
            !triangle.is_hidden_duplicate && clusters.of(index as u32).is_none() && !scene.stop.is_cancelled()
        };
        let pieces = AtomicU64::new(0);
        let of_triangle = |index: usize| {
            let mut trees = BspTrees::new(subdivision.most_lines);
            let cells = TriangleCells::new(scene, index, subdivision.side, &mut trees);
            let added = sides(index) * cells.added_by_cuts();
            // Whether there are too many does not depend on the order in which they are counted.
            let is_within = pieces.fetch_add(added, Ordering::Relaxed) + added <= most_pieces;
            is_within.then_some(sides(index) * cells.patches_per_side())
        };
        let alone = (0..scene.triangles.len()).into_par_iter().filter(is_alone).map(of_triangle);
        Some(of_clusters + alone.try_reduce(|| 0, |a, b| Some(a + b))?)
    }

    /// Divides all surfaces into patches. Textures are averaged from up to `texture_points` along the edge of a patch.
    pub fn new(scene: &BakeScene, subdivision: &Subdivision, texture_points: u32) -> Self {
        let mut patches = Self::outlines(scene, subdivision);
        patches.find_reflectances(scene, texture_points);
        patches
    }

    /// As [`Patches::new`], but without reflectances: all of them are 0.
    pub fn outlines(scene: &BakeScene, subdivision: &Subdivision) -> Self {
        let mut patches = Self {
            list: Vec::new(),
            triangles: Vec::with_capacity(scene.triangles.len()),
            roots: Vec::new(),
            trees: BspTrees::new(subdivision.most_lines),
            clusters: FaceClusters::new(scene, &subdivision.joinable, subdivision.side),
            subdivision: subdivision.clone(),
            warnings: Vec::new(),
        };
        // Per cluster, its patches, once its first triangle has been visited.
        let mut of_clusters = vec![None; patches.clusters.len() as usize];
        // Per object, how many of its cells more lines cross than may cut them.
        let mut full_cells: BTreeMap<MapIndex, usize> = BTreeMap::new();
        for (index, triangle) in scene.triangles.iter().enumerate() {
            if triangle.is_hidden_duplicate || scene.stop.is_cancelled() {
                patches.triangles.push(TrianglePatches::NONE);
                continue;
            }
            if let Some(cluster) = patches.clusters.of(index as u32) {
                let of_cluster = &mut of_clusters[cluster as usize];
                let of_cluster = *of_cluster.get_or_insert_with(|| patches.push_cluster(scene, cluster));
                patches.triangles.push(of_cluster);
                continue;
            }
            let full_before = patches.trees.full;
            let cells = TriangleCells::new(scene, index, subdivision.side, &mut patches.trees);
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
        // Where cells are cut along few lines, that was decided for the whole scene, with a warning for all of it.
        if !subdivision.has_few_lines() {
            patches.warnings = full_cells.into_iter().map(warning).collect();
        }
        patches
    }

    /// Appends the patches of a cluster, one per side.
    fn push_cluster(&mut self, scene: &BakeScene, cluster: u32) -> TrianglePatches {
        let faces = self.clusters.faces(cluster);
        let triangle = &scene.triangles[faces[0] as usize];
        let area =
            faces.iter().map(|&face| f64::from(scene.triangles[face as usize].area)).sum::<f64>() as f32;
        let (cell, reflectance) = (CLUSTER_FLAG | cluster, Vec3::ZERO);
        let mut push = |side| {
            self.list.push(Patch { triangle: faces[0], side, cell, area, reflectance });
            PatchIndex::new(self.list.len() - 1)
        };
        let (front, back) = (push(Side::Front), triangle.two_sided.then(|| push(Side::Back)));
        let varies = scene.surfaces[triangle.surface as usize].varies();
        let reflectance = (!varies).then_some([Vec3::ZERO; 2]);
        TrianglePatches { divisions: 1, front, back, reflectance, roots: UNCUT }
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
    fn find_reflectances(&mut self, scene: &BakeScene, texture_points: u32) {
        let of_cell = cell_area(self.subdivision.side);
        let of_patch = |patch: &Patch| {
            let triangle = &scene.triangles[patch.triangle as usize];
            let surface = &scene.surfaces[triangle.surface as usize];
            if !surface.varies() {
                return (surface.reflectance(patch.side, triangle.vertices, [1.0 / 3.0; 3]), None);
            }
            let (mut sum, mut area, mut most_texels) = (DVec3::ZERO, 0.0, None::<f32>);
            for (triangle, corners) in self.pieces(patch) {
                if scene.stop.is_cancelled() {
                    break;
                }
                // By rounding, the share of a very small piece may be 0.
                let share = f64::from(area_share(&corners).max(f32::MIN_POSITIVE));
                let area_of_piece = share * f64::from(scene.triangles[triangle as usize].area);
                let share_of_cell = area_of_piece as f32 / of_cell;
                let most_points = most_texture_points(texture_points, share_of_cell);
                let piece = (triangle as usize, patch.side, corners);
                let (reflectance, texels) = mean_reflectance(scene, piece, most_points);
                sum += reflectance.as_dvec3() * area_of_piece;
                area += area_of_piece;
                if points_for(texels) > NAMED_ABOVE {
                    most_texels = Some(most_texels.map_or(texels.edge, |most| most.max(texels.edge)));
                }
            }
            (if area > 0.0 { (sum / area).as_vec3() } else { Vec3::ZERO }, most_texels)
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
                 {texture_points} points along there, which may miss what is smaller",
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

    /// A point of a patch for (x, y) in [0, 1)², uniformly distributed over its area: the triangle, and the barycentric
    /// weights of its second and third vertex.
    pub fn point(&self, patch: &Patch, [x, y]: [f32; 2]) -> (u32, (f32, f32)) {
        match self.cluster(patch) {
            Some(cluster) => {
                let (face, x) = self.clusters.pick(cluster, x);
                (face, triangle_point(x, y))
            }
            None => (patch.triangle, self.point_in_triangle(patch, triangle_point(x, y))),
        }
    }

    /// The centroid of a patch, or of the first triangle of its cluster, as [`Patches::point`] returns points.
    pub fn middle(&self, patch: &Patch) -> (u32, (f32, f32)) {
        let centroid = (1.0 / 3.0, 1.0 / 3.0);
        let is_cluster = self.cluster(patch).is_some();
        (patch.triangle, if is_cluster { centroid } else { self.point_in_triangle(patch, centroid) })
    }

    /// Whether light may pass directly from one point of a patch to another, as it may not be flat.
    pub fn sees_itself(&self, index: PatchIndex) -> bool {
        self.cluster(&self.list[index.place()]).is_some()
    }

    /// The number of a patch's cluster; `None` for a piece of a triangle.
    fn cluster(&self, patch: &Patch) -> Option<u32> {
        (patch.cell & PIECE_FLAG == 0 && patch.cell & CLUSTER_FLAG != 0).then_some(patch.cell & !CLUSTER_FLAG)
    }

    /// Converts barycentric weights in a patch, which is no cluster, to those in its triangle, both of the second and
    /// third vertex.
    pub(super) fn point_in_triangle(&self, patch: &Patch, (u, v): (f32, f32)) -> (f32, f32) {
        if patch.cell & PIECE_FLAG == 0 {
            let divisions = self.triangles[patch.triangle as usize].divisions.max(1);
            let (row, place) = (patch.cell >> ROW_SHIFT, patch.cell & ((1 << ROW_SHIFT) - 1));
            return point_in_row(divisions, row, place, u, v);
        }
        point_between(&self.trees.pieces[(patch.cell & !PIECE_FLAG) as usize], u, v)
    }

    /// The triangles that a patch consists of: whole ones, or a part of one.
    fn pieces(&self, patch: &Patch) -> impl Iterator<Item = (u32, SubTriangle)> {
        let faces = self.cluster(patch).map_or(&[][..], |cluster| self.clusters.faces(cluster));
        let part = faces.is_empty().then(|| CORNERS.map(|at| self.point_in_triangle(patch, at)));
        let triangle = patch.triangle;
        faces.iter().map(|&face| (face, CORNERS)).chain(part.map(|corners| (triangle, corners)))
    }

    /// The corners of each triangle that a patch consists of, canonical units.
    pub fn facets(&self, scene: &BakeScene, patch: &Patch) -> impl Iterator<Item = [Vec3; 3]> {
        self.pieces(patch).map(|(triangle, corners)| {
            let triangle = &scene.triangles[triangle as usize];
            corners.map(|(u, v)| triangle.position(u, v))
        })
    }

    /// Per patch, the distance below which it is too coarse to be treated as uniformly bright, canonical units: twice
    /// the length of its side.
    pub fn min_read_distances(&self, scene: &BakeScene) -> Vec<f32> {
        let of_patch = |patch: &Patch| {
            let longest_edge = |[a, b, c]: [Vec3; 3]| a.distance(b).max(b.distance(c)).max(c.distance(a));
            let diameter = match self.cluster(patch) {
                None => self.facets(scene, patch).map(longest_edge).fold(0.0, f32::max),
                Some(_) => {
                    let (triangle, (u, v)) = self.middle(patch);
                    let middle = scene.triangles[triangle as usize].position(u, v);
                    let corners = self.facets(scene, patch).flatten();
                    2.0 * corners.map(|corner| corner.distance(middle)).fold(0.0, f32::max)
                }
            };
            // The longest edge of half a square is the square's diagonal.
            NEAR_SIDES * self.subdivision.side.min(diameter * FRAC_1_SQRT_2)
        };
        self.list.iter().map(of_patch).collect()
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

/// The mean reflectance of a part of a side of a triangle with textures or vertex colours, from n² points with n up to `most_points`, and the texels that
/// it shows.
fn mean_reflectance(
    scene: &BakeScene,
    (index, side, corners): (usize, Side, SubTriangle),
    most_points: u32,
) -> (Vec3, ShownTexels) {
    let triangle = &scene.triangles[index];
    let surface = &scene.surfaces[triangle.surface as usize];
    let texels = surface.reflectance_texels(triangle.vertices, corners);
    let points = points_for(texels);
    let n = (points.ceil() as u32).clamp(2, most_points);
    let mean = mean_of_points(n, |(u, v)| {
        let (u, v) = point_between(&corners, u, v);
        surface.reflectance(side, triangle.vertices, [1.0 - u - v, u, v])
    });
    (mean, texels)
}

/// Points along a patch's edge, n for n² points in all, at which its textures are averaged. A few texels are averaged
/// with a point for each of them along the longest edge, which makes at least two per texel. Of many, one point
/// per texel is enough, and one for every two texels along an edge, since bilinear filtering reads two.
fn points_for(texels: ShownTexels) -> f32 {
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
