//! Face clusters: small adjacent triangles that share one patch, so that the number of patches follows from the area of
//! the surfaces and not from how finely they are meshed (Willmott, Heckbert, Garland, "Face cluster radiosity", 1999;
//! here on one level, as the patches have one size). Larger triangles are divided in `triangle_cells` instead.

use std::ops::Range;

use glam::Vec3;
use lumbre_mesh::{Adjacency, weld_positions};
use rayon::prelude::*;

use super::triangle_cells::{cell_area, may_be_cut};
use crate::scene::{BakeScene, SceneTriangle, Side};
use crate::visibility::PlaneFrame;
use crate::visibility::contacts::{REACH, contacts};

/// Triangles of at most this share of a cell's area may be in a cluster.
const MAX_SHARE: f32 = 0.5;
/// Least cosine between the normal of a triangle and that of its cluster's first one: 40 degrees.
const MIN_COSINE: f32 = 0.766;
/// How far a triangle's centroid may be from that of its cluster's first one, in sides of a patch.
const MAX_DISTANCE: f32 = 1.0;
/// Height above two adjacent triangles at which nothing may stand between them, as a share of the distance between their
/// centroids. With the angle that [`MIN_COSINE`] allows, the segment at this height clears the edge between them.
const HEIGHT: f32 = 0.25;

/// No triangle.
const NONE: u32 = u32::MAX;

/// For each triangle its neighbours, across up to three edges, that may share a patch with it.
#[derive(Clone, Debug, Default)]
pub(crate) struct JoinableFaces {
    /// Empty if no triangle has any.
    neighbours: Vec<[u32; 3]>,
}

impl JoinableFaces {
    /// For patches of `side` canonical units, and larger ones. Two triangles may share a patch if they are small, adjacent
    /// and about parallel, belong to the same surface, and nothing stands between them or lies on one of them only.
    pub fn new(scene: &BakeScene, side: f32) -> Self {
        let triangles = &scene.triangles;
        let limit = MAX_SHARE * cell_area(side);
        let small: Vec<u32> = (0..triangles.len() as u32)
            .filter(|&index| {
                let triangle = &triangles[index as usize];
                triangle.area <= limit && !triangle.is_hidden_duplicate
            })
            .collect();
        if small.len() < 2 {
            return Self::default();
        }
        let corners: Vec<Vec3> = small.iter().flat_map(|&index| triangles[index as usize].corners).collect();
        let welded = weld_positions(&corners);
        let faces: Vec<[u32; 3]> = welded.chunks_exact(3).map(|face| [face[0], face[1], face[2]]).collect();
        let adjacency = Adjacency::new(&faces, corners.len());
        // What lies on each of them; `None` where something stands on it.
        let covers: Vec<Option<[bool; 2]>> =
            small.par_iter().map(|&index| covers(scene, index, side)).collect();
        let across = |place: u32, corner: usize| -> Option<u32> {
            let pair = adjacency.across(place, corner);
            let &[first, second] = pair else { return None };
            let other = if first == place { second } else { first };
            let is_alike =
                covers[place as usize].is_some() && covers[place as usize] == covers[other as usize];
            let indices = [first, second].map(|place| small[place as usize]);
            (is_alike && !scene.stop.is_cancelled() && may_be_joined(scene, indices))
                .then_some(small[other as usize])
        };
        let of_face = |place: u32| [0, 1, 2].map(|corner| across(place, corner).unwrap_or(NONE));
        let found: Vec<[u32; 3]> = (0..small.len() as u32).into_par_iter().map(of_face).collect();
        let mut neighbours = vec![[NONE; 3]; triangles.len()];
        for (index, found) in small.into_iter().zip(found) {
            neighbours[index as usize] = found;
        }
        Self { neighbours }
    }

    fn of(&self, triangle: u32) -> impl Iterator<Item = u32> {
        let neighbours = self.neighbours.get(triangle as usize).copied().unwrap_or([NONE; 3]);
        neighbours.into_iter().filter(|&other| other != NONE)
    }
}

/// Whether something lies closely above the centroid of each side of a triangle that takes part in light transport;
/// `None` if something stands on the triangle.
fn covers(scene: &BakeScene, index: u32, side: f32) -> Option<[bool; 2]> {
    let triangle = &scene.triangles[index as usize];
    let is_crossed = || {
        may_be_cut(triangle, 1, side) && !contacts(scene, index, &PlaneFrame::new(triangle), side).is_empty()
    };
    if scene.stop.is_cancelled() || is_crossed() {
        return None;
    }
    let centroid = triangle.position(1.0 / 3.0, 1.0 / 3.0);
    let reach = REACH as f32 * side;
    let is_covered = |side| {
        let normal = triangle.side_normal(side);
        scene.blocked(scene.off_surface(index, side, centroid), centroid + normal * reach)
    };
    Some([is_covered(Side::Front), triangle.two_sided && is_covered(Side::Back)])
}

/// Whether two adjacent triangles, in ascending order, belong to the same surface, are about parallel, and nothing stands
/// between them.
fn may_be_joined(scene: &BakeScene, indices: [u32; 2]) -> bool {
    let [first, second] = indices.map(|index| &scene.triangles[index as usize]);
    let surface = |triangle: &SceneTriangle| {
        let &SceneTriangle { map, surface, two_sided, closed, solid, .. } = triangle;
        (map, surface, two_sided, closed, solid)
    };
    if surface(first) != surface(second) || first.normal.dot(second.normal) < MIN_COSINE {
        return false;
    }
    let centroids = [first, second].map(|triangle| triangle.position(1.0 / 3.0, 1.0 / 3.0));
    let height = HEIGHT * centroids[0].distance(centroids[1]);
    let is_open = |sign: f32| {
        let raised =
            |place: usize, triangle: &SceneTriangle| centroids[place] + triangle.normal * (sign * height);
        !scene.blocked(raised(0, first), raised(1, second))
    };
    is_open(1.0) && (!first.two_sided || is_open(-1.0))
}

/// The clusters of a scene for one size of patches.
#[derive(Clone, Debug, Default)]
pub(crate) struct FaceClusters {
    /// The cluster of each triangle, or [`NONE`]; empty if there are no clusters.
    of: Vec<u32>,
    /// The triangles of cluster c are `faces[starts[c]..starts[c + 1]]`, the one that it grew from first.
    starts: Vec<u32>,
    faces: Vec<u32>,
    /// For each of these, the share of the cluster's area up to and including it; 1 for the last.
    ends: Vec<f32>,
}

impl FaceClusters {
    /// Grows clusters from one triangle after the other, over joinable neighbours, up to the area of a patch of `side`
    /// canonical units.
    pub fn new(scene: &BakeScene, joinable: &JoinableFaces, side: f32) -> Self {
        if joinable.neighbours.is_empty() {
            return Self::default();
        }
        let triangles = &scene.triangles;
        let mut clusters =
            Self { of: vec![NONE; triangles.len()], starts: vec![0], faces: Vec::new(), ends: Vec::new() };
        for seed in 0..triangles.len() as u32 {
            let is_free = clusters.of[seed as usize] == NONE && joinable.of(seed).next().is_some();
            if !is_free || scene.stop.is_cancelled() {
                continue;
            }
            clusters.grow(triangles, joinable, seed, side);
        }
        clusters
    }

    /// Grows a cluster from a triangle, and keeps it if another one joins.
    fn grow(&mut self, triangles: &[SceneTriangle], joinable: &JoinableFaces, seed: u32, side: f32) {
        let first = &triangles[seed as usize];
        let centroid = |triangle: &SceneTriangle| triangle.position(1.0 / 3.0, 1.0 / 3.0);
        let (middle, limit) = (centroid(first), cell_area(side));
        let (number, start) = (self.starts.len() as u32 - 1, self.faces.len());
        let mut area = first.area;
        self.faces.push(seed);
        self.of[seed as usize] = number;
        // Breadth first, so that clusters are compact.
        let mut next = start;
        while next < self.faces.len() {
            for other in joinable.of(self.faces[next]) {
                let triangle = &triangles[other as usize];
                let fits = area + triangle.area <= limit
                    && triangle.normal.dot(first.normal) >= MIN_COSINE
                    && centroid(triangle).distance(middle) <= MAX_DISTANCE * side;
                if fits && self.of[other as usize] == NONE {
                    self.of[other as usize] = number;
                    self.faces.push(other);
                    area += triangle.area;
                }
            }
            next += 1;
        }
        if self.faces.len() == start + 1 {
            self.faces.pop();
            self.of[seed as usize] = NONE;
            return;
        }
        self.starts.push(self.faces.len() as u32);
        let mut sum = 0.0;
        for &face in &self.faces[start..] {
            sum += triangles[face as usize].area;
            self.ends.push(sum / area);
        }
        self.ends.pop();
        self.ends.push(1.0);
    }

    /// The number of clusters.
    pub fn len(&self) -> u32 {
        self.starts.len().saturating_sub(1) as u32
    }

    /// The number of the cluster that a triangle belongs to.
    pub fn of(&self, triangle: u32) -> Option<u32> {
        self.of.get(triangle as usize).copied().filter(|&cluster| cluster != NONE)
    }

    /// The triangles of a cluster, the one that it grew from first.
    pub fn faces(&self, cluster: u32) -> &[u32] {
        &self.faces[self.range(cluster)]
    }

    /// Chooses a triangle of a cluster by `x` in [0, 1), with a probability in proportion to its area. Returns it and what
    /// `x` leaves for a choice within it, in [0, 1).
    pub fn pick(&self, cluster: u32, x: f32) -> (u32, f32) {
        let range = self.range(cluster);
        let ends = &self.ends[range.clone()];
        let place = ends.partition_point(|&end| end <= x).min(ends.len() - 1);
        let start = if place == 0 { 0.0 } else { ends[place - 1] };
        let left = ((x - start) / (ends[place] - start)).clamp(0.0, 1.0 - f32::EPSILON);
        (self.faces[range.start + place], left)
    }

    fn range(&self, cluster: u32) -> Range<usize> {
        let [start, end] = [cluster, cluster + 1].map(|place| self.starts[place as usize] as usize);
        start..end
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::super::form_factor_tests::{patches_of, scene, square};
    use super::super::patch_index::PatchIndex;
    use super::super::patches::Patches;
    use super::*;
    use crate::sampling::{Sequence, Stream};

    /// An edge of the mesh, a third of the way.
    const BEND: f32 = 0.6875;

    /// A floor of 2 x 2 m in 64 x 64 squares of two triangles, bent upwards by `slope` from [`BEND`] on.
    fn finely_meshed_floor(slope: f32) -> Vec<[Vec3; 3]> {
        const CELLS: usize = 64;
        let at = |place: usize| 2.0 * place as f32 / CELLS as f32;
        let point = |x: f32, z: f32| Vec3::new(x, (slope * (x - BEND)).max(0.0), z);
        let squares = (0..CELLS * CELLS).flat_map(|cell| {
            let (x, z) = (cell % CELLS, cell / CELLS);
            let corner = |dx: usize, dz: usize| point(at(x + dx), at(z + dz));
            let [a, b, c, d] = [corner(0, 0), corner(0, 1), corner(1, 1), corner(1, 0)];
            [[a, b, c], [a, c, d]]
        });
        squares.collect()
    }

    /// The patches of a scene, after checking that they cover all of it and that each point of a patch is found in it.
    fn checked_patches(scene: &BakeScene, side: f32) -> Patches {
        let side = side * scene.space.scale as f32;
        let patches = patches_of(scene, side);
        assert_eq!(patches.list.len() as u64, Patches::count(scene, &patches.joinable, side));
        let area = |areas: &mut dyn Iterator<Item = f32>| areas.map(f64::from).sum::<f64>();
        let covered = area(&mut patches.list.iter().map(|patch| patch.area));
        let expected = area(&mut scene.triangles.iter().map(|triangle| triangle.area));
        assert!((covered / expected - 1.0).abs() < 1e-5, "{covered} {expected}");
        for (index, patch) in PatchIndex::all(patches.list.len()).zip(&patches.list) {
            assert!(patch.area <= 1.001 * cell_area(side));
            let mut sum = Vec3::ZERO;
            for sample in 0..64 {
                let [x, y, ..] = Sequence::new(1, Stream::Test(95), index.0).point(sample, 0);
                let (triangle, (u, v)) = patches.point(patch, [x, y]);
                assert_eq!(patches.at(triangle, patch.side, (u, v)), Some(index));
                sum += scene.triangles[triangle as usize].position(u, v);
            }
            // The points are uniformly distributed: their mean is the centroid of the patch.
            let (mut centroid, mut area) = (Vec3::ZERO, 0.0);
            for [a, b, c] in patches.facets(scene, patch) {
                let of_facet = 0.5 * (b - a).cross(c - a).length();
                centroid += of_facet * (a + b + c) / 3.0;
                area += of_facet;
            }
            let off = (sum / 64.0).distance(centroid / area);
            assert!(off < 0.1 * side, "{off} of {side}");
        }
        patches
    }

    fn position(scene: &BakeScene, patches: &Patches, patch: PatchIndex, [x, y]: [f32; 2]) -> Vec3 {
        let (triangle, (u, v)) = patches.point(&patches.list[patch.place()], [x, y]);
        scene.space.world(scene.triangles[triangle as usize].position(u, v)).as_vec3()
    }

    #[test]
    fn the_number_of_patches_follows_from_the_area_and_not_from_the_triangles() {
        let fine = scene(&[&finely_meshed_floor(0.0)]);
        let coarse = scene(&[&square([0.0; 3], Vec3::Z * 2.0, Vec3::X * 2.0)]);
        let [fine, coarse] = [&fine, &coarse].map(|scene| checked_patches(scene, 0.4).list.len());
        assert_eq!(coarse, 50);
        assert!(fine >= coarse && fine < 3 * coarse, "{fine} patches of 8,192 triangles, {coarse} of two");
    }

    #[test]
    fn no_cluster_reaches_around_an_edge() {
        // At 45 degrees. A gentle bend may lie within a patch.
        let bent = scene(&[&finely_meshed_floor(1.0)]);
        let patches = checked_patches(&bent, 0.4);
        for patch in PatchIndex::all(patches.list.len()) {
            let sides = [0.01, 0.3, 0.6, 0.99].map(|x| position(&bent, &patches, patch, [x, 0.5]).x > BEND);
            assert!(sides.iter().all(|side| *side == sides[0]), "{patch:?}");
        }
        let gentle = checked_patches(&scene(&[&finely_meshed_floor(0.2)]), 0.4);
        assert!(gentle.list.len() < patches.list.len());
    }

    #[test]
    fn no_cluster_lies_on_both_sides_of_a_wall_or_partly_under_a_sheet() {
        let floor = finely_meshed_floor(0.0);
        // Along edges of the mesh, and across its triangles.
        for x in [1.0, 0.731] {
            let wall = square([x, 0.0, 0.0], Vec3::Z * 2.0, Vec3::Y);
            let scene = scene(&[&floor, &wall]);
            let patches = checked_patches(&scene, 0.4);
            let mut clusters = 0;
            for (index, patch) in PatchIndex::all(patches.list.len()).zip(&patches.list) {
                let points = (0..16).map(|i| position(&scene, &patches, index, [i as f32 / 16.0, 0.5]).x - x);
                let (low, high) =
                    points.fold((f32::MAX, f32::MIN), |(low, high), x| (low.min(x), high.max(x)));
                // A single triangle may be crossed: it is small.
                let is_small = patch.area < 1e-3 * (scene.space.scale as f32).powi(2);
                assert!(low * high >= 0.0 || is_small, "{low} {high}");
                clusters += usize::from(!is_small);
            }
            assert!(clusters > 40, "{clusters}");
        }
        // A sheet a little above the floor, higher than the triangles are long.
        let sheet = square([0.35, 0.035, 0.45], Vec3::X, Vec3::Z);
        let scene = scene(&[&floor, &sheet]);
        let patches = checked_patches(&scene, 0.4);
        for patch in PatchIndex::all(patches.list.len()) {
            let points = [0.01, 0.3, 0.6, 0.99].map(|x| position(&scene, &patches, patch, [x, 0.5]));
            let margin = 0.02;
            let is_under = |p: &Vec3| {
                p.y < 0.01
                    && (0.35 + margin..1.35 - margin).contains(&p.x)
                    && (0.45 + margin..1.45 - margin).contains(&p.z)
            };
            let is_beside = |p: &Vec3| {
                p.y < 0.01
                    && !((0.35 - margin..1.35 + margin).contains(&p.x)
                        && (0.45 - margin..1.45 + margin).contains(&p.z))
            };
            assert!(!(points.iter().any(is_under) && points.iter().any(is_beside)), "{points:?}");
        }
    }

    #[test]
    fn a_cluster_that_is_bowl_shaped_lights_itself() {
        // The inside of a shallow bowl, the cap of a sphere, whose form factor to itself is its share of the sphere.
        let mut bowl = lumbre_mesh::shapes::uv_sphere(1.0, 64, 64).triangle_positions().unwrap();
        bowl.retain(|corners| corners.iter().all(|corner| corner.y < -0.97));
        bowl.iter_mut().for_each(|corners| corners.swap(1, 2));
        let scene = scene(&[&bowl]);
        let patches = patches_of(&scene, 2.0 * scene.space.scale as f32);
        assert_eq!(patches.list.len(), 1);
        let area: f32 = scene.triangles.iter().map(|triangle| triangle.area).sum();
        let cast = super::super::cosine_rays::cast_from_patch(&scene, &patches, PatchIndex(0), 65_536, 3);
        let hits: u32 = cast.whole().hits.iter().map(|(_, count)| count).sum();
        let sphere = 4.0 * std::f32::consts::PI * (scene.space.scale as f32).powi(2);
        let (found, expected) = (hits as f32 / 65_536.0, area / sphere);
        assert!((found / expected - 1.0).abs() < 0.1, "{found} {expected}");
    }
}
