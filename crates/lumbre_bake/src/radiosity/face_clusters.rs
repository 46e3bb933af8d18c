//! Face clusters: small adjacent triangles that share one patch, so that the number of patches follows from the area of
//! the surfaces and not from how finely they are meshed (Willmott, Heckbert, Garland, "Face cluster radiosity", 1999;
//! here on one level, as the patches have one size). Larger triangles are divided in `triangle_cells` instead.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;

use super::triangle_cells::{cell_area, longest_edge, may_be_cut};
use crate::sampling::interval_at;
use crate::scene::{BakeScene, SceneTriangle, Side, position_bits};
use crate::visibility::PlaneFrame;
use crate::visibility::contacts::{REACH, contacts};

/// Triangles of at most this share of a cell's area may be in a cluster.
const MAX_SHARE: f32 = 0.5;
/// Least cosine between the normal of a triangle and that of its cluster's first one: 40 degrees.
const MIN_COSINE: f32 = 0.766;
/// How far the corners of a cluster may be from the centroid of its first triangle, in sides of a patch.
const MAX_DISTANCE: f32 = 1.0;
/// Height above two adjacent triangles at which nothing may stand between them, as a share of the distance between their
/// centroids. With the angle that [`MIN_COSINE`] allows, the segment at this height clears the edge between them.
const HEIGHT: f32 = 0.25;

/// Rounds in which clusters grow from triangles that had to leave others; what is left after them is alone.
const ROUNDS: usize = 8;
/// Where more edges than this coincide, no triangles are joined across them: all are compared with each other.
const MAX_EDGES: usize = 16;

/// No triangle.
const NONE: u32 = u32::MAX;

/// For each triangle its neighbours, across up to three edges, that may share a patch with it.
#[derive(Clone, Debug, Default)]
pub(crate) struct JoinableFaces {
    /// Empty if no triangle has any.
    neighbours: Vec<[u32; 3]>,
}

/// A small triangle.
struct Face {
    triangle: u32,
    /// Whether something lies closely above its front and its back.
    covered: [bool; 2],
}

/// An edge of a small triangle, in the order by which equal edges come together.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Edge {
    hash: u64,
    /// The place of its face.
    face: u32,
    corner: u32,
}

impl JoinableFaces {
    /// For patches of `side` canonical units, and larger ones. Two triangles may share a patch if they are small, adjacent
    /// and about parallel, belong to the same surface, and nothing stands between them or lies on one of them only.
    pub fn new(scene: &BakeScene, side: f32) -> Self {
        let faces: Vec<Face> = (0..scene.triangles.len() as u32)
            .into_par_iter()
            .filter_map(|index| face(scene, index, side))
            .collect();
        if faces.len() < 2 {
            return Self::default();
        }
        let edges_of = |(place, face): (usize, &Face)| {
            let corners = scene.triangles[face.triangle as usize].corners;
            [0, 1, 2].map(|corner| {
                let hash = edge_hash([corners[corner], corners[(corner + 1) % 3]]);
                Edge { hash, face: place as u32, corner: corner as u32 }
            })
        };
        let mut edges: Vec<Edge> = faces.par_iter().enumerate().flat_map_iter(edges_of).collect();
        edges.par_sort_unstable();
        let mut pairs: Vec<[u32; 2]> = edges
            .par_chunk_by(|a, b| a.hash == b.hash)
            .flat_map_iter(|edges| joinable_pairs(scene, &faces, edges))
            .collect();
        if pairs.is_empty() {
            return Self::default();
        }
        // Clusters are not to depend on the order of hashes, which may differ from one compiler to the next.
        pairs.par_sort_unstable();
        let mut neighbours = vec![[NONE; 3]; scene.triangles.len()];
        let mut join = |from: u32, to: u32| {
            // There is a place for each edge, and across each there is one neighbour at most.
            if let Some(place) = neighbours[from as usize].iter_mut().find(|place| **place == NONE) {
                *place = to;
            }
        };
        for [a, b] in pairs {
            join(a, b);
            join(b, a);
        }
        Self { neighbours }
    }

    fn of(&self, triangle: u32) -> impl Iterator<Item = u32> {
        let neighbours = self.neighbours.get(triangle as usize).copied().unwrap_or([NONE; 3]);
        neighbours.into_iter().filter(|&other| other != NONE)
    }
}

/// A triangle as a face that may be joined with others: it is small, and nothing stands on it that it would be cut along.
fn face(scene: &BakeScene, index: u32, side: f32) -> Option<Face> {
    let triangle = &scene.triangles[index as usize];
    let is_small =
        triangle.area <= MAX_SHARE * cell_area(side) && longest_edge(triangle) <= MAX_DISTANCE * side;
    if !is_small || triangle.is_hidden_duplicate || scene.stop.is_cancelled() {
        return None;
    }
    if may_be_cut(triangle, 1, side) && !contacts(scene, index, &PlaneFrame::new(triangle), side).is_empty() {
        return None;
    }
    let is_covered = |of: Side| {
        let origin = scene.off_surface(index, of, centroid(triangle));
        scene.blocked(origin, raised(triangle, of, REACH as f32 * side))
    };
    let covered = [is_covered(Side::Front), triangle.two_sided && is_covered(Side::Back)];
    Some(Face { triangle: index, covered })
}

fn centroid(triangle: &SceneTriangle) -> Vec3 {
    triangle.position(1.0 / 3.0, 1.0 / 3.0)
}

/// The point at this height above the centroid of a side of a triangle.
fn raised(triangle: &SceneTriangle, side: Side, height: f32) -> Vec3 {
    centroid(triangle) + triangle.side_normal(side) * height
}

/// The same for an edge in both directions.
fn edge_hash(ends: [Vec3; 2]) -> u64 {
    let mut bits = ends.map(position_bits);
    bits.sort_unstable();
    let mut hasher = DefaultHasher::new();
    bits.hash(&mut hasher);
    hasher.finish()
}

/// The pairs of triangles that may be joined across edges of the same hash: of each surface, the two that have an edge in
/// common, if no third one does.
fn joinable_pairs<'a>(
    scene: &'a BakeScene,
    faces: &'a [Face],
    edges: &'a [Edge],
) -> impl Iterator<Item = [u32; 2]> + 'a {
    let ends = |edge: &Edge| {
        let corners = scene.triangles[faces[edge.face as usize].triangle as usize].corners;
        let (from, to) = (edge.corner as usize, (edge.corner as usize + 1) % 3);
        [corners[from], corners[to]].map(position_bits)
    };
    // In a surface of one orientation two adjacent triangles run along their edge in opposite directions.
    let is_other_side = move |first: &Edge, second: &Edge| {
        let ([a, b], [c, d]) = (ends(first), ends(second));
        let [first, second] = [first, second].map(|edge| &faces[edge.face as usize]);
        let triangles = [first, second].map(|face| &scene.triangles[face.triangle as usize]);
        a == d && b == c && are_alike(triangles) && first.covered == second.covered
    };
    let pair = move |(place, edge): (usize, &Edge)| {
        let mut across = edges.iter().enumerate().filter(|(_, other)| is_other_side(edge, other));
        let (other, second) = across.next().filter(|_| across.next().is_none())?;
        let is_only_one = edges.iter().filter(|third| is_other_side(third, second)).count() == 1;
        let pair = [edge, second].map(|edge| faces[edge.face as usize].triangle);
        (place < other && is_only_one && !scene.stop.is_cancelled() && is_open_between(scene, pair))
            .then_some(pair)
    };
    let edges_to_pair = if edges.len() <= MAX_EDGES { edges } else { &[] };
    edges_to_pair.iter().enumerate().filter_map(pair)
}

/// Whether two triangles belong to the same surface and are about parallel.
fn are_alike([first, second]: [&SceneTriangle; 2]) -> bool {
    let surface = |triangle: &SceneTriangle| {
        let &SceneTriangle { map, surface, two_sided, closed, solid, .. } = triangle;
        (map, surface, two_sided, closed, solid)
    };
    surface(first) == surface(second) && first.normal.dot(second.normal) >= MIN_COSINE
}

/// Whether nothing stands between two adjacent triangles, on either side that takes part in light transport.
fn is_open_between(scene: &BakeScene, pair: [u32; 2]) -> bool {
    let [first, second] = pair.map(|index| &scene.triangles[index as usize]);
    see_each_other(scene, [first, second], HEIGHT * centroid(first).distance(centroid(second)))
}

/// Whether points at this height above two triangles see each other, on either side that takes part in light transport.
fn see_each_other(scene: &BakeScene, [first, second]: [&SceneTriangle; 2], height: f32) -> bool {
    let on = |side| !scene.blocked(raised(first, side, height), raised(second, side, height));
    on(Side::Front) && (!first.two_sided || on(Side::Back))
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
    /// canonical units. Then those triangles leave that do not see the first one of their cluster, as around the end of a
    /// wall, and others grow from them.
    pub fn new(scene: &BakeScene, joinable: &JoinableFaces, side: f32) -> Self {
        if joinable.neighbours.is_empty() {
            return Self::default();
        }
        let triangles = &scene.triangles;
        let mut clusters = Self { of: vec![NONE; triangles.len()], starts: vec![0], ..Self::default() };
        let sees_first = |clusters: &Self, face: u32| {
            let first = clusters.faces(clusters.of[face as usize])[0];
            let pair = [first, face].map(|index| &triangles[index as usize]);
            first == face || see_each_other(scene, pair, REACH as f32 * side)
        };
        for _ in 0..ROUNDS {
            let (kept, kept_faces) = (clusters.len(), clusters.faces.len());
            for seed in 0..triangles.len() as u32 {
                let is_free = clusters.of[seed as usize] == NONE && joinable.of(seed).next().is_some();
                if is_free && !scene.stop.is_cancelled() {
                    clusters.grow(triangles, joinable, seed, side);
                }
            }
            let stays: Vec<bool> = clusters.faces[kept_faces..]
                .par_iter()
                .map(|&face| scene.stop.is_cancelled() || sees_first(&clusters, face))
                .collect();
            clusters.retain(kept, &stays);
            if stays.iter().all(|stays| *stays) {
                break;
            }
        }
        clusters.without_single_faces(triangles)
    }

    /// Grows a cluster from a triangle.
    fn grow(&mut self, triangles: &[SceneTriangle], joinable: &JoinableFaces, seed: u32, side: f32) {
        let first = &triangles[seed as usize];
        let (middle, limit) = (centroid(first), cell_area(side));
        let (number, start) = (self.len(), self.faces.len());
        let mut area = f64::from(first.area);
        self.faces.push(seed);
        self.of[seed as usize] = number;
        // Breadth first, so that clusters are compact.
        let mut next = start;
        while next < self.faces.len() {
            for other in joinable.of(self.faces[next]) {
                let triangle = &triangles[other as usize];
                let with_it = area + f64::from(triangle.area);
                let fits = with_it <= f64::from(limit)
                    && triangle.normal.dot(first.normal) >= MIN_COSINE
                    && triangle.corners.iter().all(|corner| corner.distance(middle) <= MAX_DISTANCE * side);
                if fits && self.of[other as usize] == NONE {
                    self.of[other as usize] = number;
                    self.faces.push(other);
                    area = with_it;
                }
            }
            next += 1;
        }
        self.starts.push(self.faces.len() as u32);
    }

    /// Leaves only those triangles in the clusters from `first` on that stay. The first one of a cluster always does.
    fn retain(&mut self, first: u32, stays: &[bool]) {
        let (begin, ends) = (self.starts[first as usize] as usize, self.starts.split_off(first as usize + 1));
        let faces = self.faces.split_off(begin);
        let mut place = 0;
        for end in ends {
            while begin + place < end as usize {
                match stays[place] {
                    true => self.faces.push(faces[place]),
                    false => self.of[faces[place] as usize] = NONE,
                }
                place += 1;
            }
            self.starts.push(self.faces.len() as u32);
        }
    }

    /// The clusters of more than one triangle, complete with the shares of their triangles.
    fn without_single_faces(mut self, triangles: &[SceneTriangle]) -> Self {
        let mut clusters = Self { starts: vec![0], ..Self::default() };
        self.of.fill(NONE);
        for range in self.starts.windows(2).map(|ends| ends[0] as usize..ends[1] as usize) {
            let faces = &self.faces[range];
            if faces.len() < 2 {
                continue;
            }
            let area = |face: &u32| f64::from(triangles[*face as usize].area);
            let (mut sum, total) = (0.0, faces.iter().map(area).sum::<f64>());
            for face in faces {
                sum += area(face);
                clusters.ends.push((sum / total) as f32);
                self.of[*face as usize] = clusters.len();
            }
            if let Some(last) = clusters.ends.last_mut() {
                *last = 1.0;
            }
            clusters.faces.extend_from_slice(faces);
            clusters.starts.push(clusters.faces.len() as u32);
        }
        Self { of: self.of, ..clusters }
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
        let (place, begin, end) = interval_at(ends, |end| *end, x).unwrap_or((0, 0.0, 1.0));
        let left = ((x - begin) / (end - begin).max(f32::MIN_POSITIVE)).clamp(0.0, 1.0 - f32::EPSILON);
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
    use crate::bounds::Bounds;
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
        assert_eq!(Some(patches.list.len() as u64), Patches::count(scene, &patches.subdivision, u64::MAX));
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

    /// The centroids of the triangles of each patch, in the world.
    fn centroids(scene: &BakeScene, patches: &Patches) -> Vec<Vec<Vec3>> {
        let of_patch = |patch| {
            let facets = patches.facets(scene, patch);
            facets.map(|[a, b, c]| scene.space.world((a + b + c) / 3.0).as_vec3()).collect()
        };
        patches.list.iter().map(of_patch).collect()
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
        for centroids in centroids(&bent, &patches) {
            assert!(centroids.iter().all(|at| (at.x > BEND) == (centroids[0].x > BEND)), "{centroids:?}");
        }
        let gentle = checked_patches(&scene(&[&finely_meshed_floor(0.2)]), 0.4);
        assert!(gentle.list.len() < patches.list.len());
    }

    #[test]
    fn no_cluster_lies_on_both_sides_of_a_wall() {
        let floor = finely_meshed_floor(0.0);
        // Along edges of the mesh, and across its triangles; on the floor, hovering closely above it, and sunk into it.
        for (x, y) in [(1.0, 0.0), (0.731, 0.0), (0.731, 0.001), (0.731, -0.5)] {
            let wall = square([x, y, 0.0], Vec3::Z * 2.0, Vec3::Y);
            let scene = scene(&[&floor, &wall]);
            let patches = checked_patches(&scene, 0.4);
            let mut clusters = 0;
            for centroids in centroids(&scene, &patches).iter().filter(|centroids| centroids.len() > 1) {
                assert!(centroids.iter().all(|at| (at.x > x) == (centroids[0].x > x)), "{centroids:?}");
                clusters += 1;
            }
            assert!(clusters > 40, "{clusters}");
        }
    }

    #[test]
    fn no_cluster_reaches_around_the_end_of_a_wall() {
        let wall = square([0.731, 0.0, 0.0], Vec3::Z * 1.1, Vec3::Y);
        let scene = scene(&[&finely_meshed_floor(0.0), &wall]);
        let patches = checked_patches(&scene, 0.4);
        // As many as without the wall, but for some: what is cut off from one cluster grows into others.
        let without = checked_patches(&self::scene(&[&finely_meshed_floor(0.0)]), 0.4).list.len();
        let on_floor =
            patches.list.iter().filter(|patch| scene.triangles[patch.triangle as usize].map.0 == 0);
        let on_floor = on_floor.count();
        assert!(on_floor < without + without / 2, "{on_floor} {without}");
        let mut around = 0;
        for (patch, centroids) in patches.list.iter().zip(centroids(&scene, &patches)) {
            let first = scene.space.world(centroid(&scene.triangles[patch.triangle as usize])).as_vec3();
            for at in centroids.into_iter().filter(|at| (at.x > 0.731) != (first.x > 0.731)) {
                // Where the segment to the first triangle passes the wall.
                let z = first.z + (at.z - first.z) * (0.731 - first.x) / (at.x - first.x);
                assert!(z > 1.1, "{first} {at}");
                around += 1;
            }
        }
        assert!(around > 0, "beyond the wall, clusters lie on both sides of its plane");
    }

    #[test]
    fn no_cluster_lies_partly_under_a_sheet() {
        // A little above the floor, but higher than the triangles are long.
        let sheet = square([0.35, 0.035, 0.45], Vec3::X, Vec3::Z);
        let scene = scene(&[&finely_meshed_floor(0.0), &sheet]);
        let patches = checked_patches(&scene, 0.4);
        let is_under = |at: &Vec3| (0.35..1.35).contains(&at.x) && (0.45..1.45).contains(&at.z);
        let on_floor = |centroids: &Vec<Vec3>| centroids[0].y < 0.01;
        let mut clusters = [0, 0];
        for centroids in centroids(&scene, &patches).iter().filter(|centroids| on_floor(centroids)) {
            assert!(centroids.iter().all(|at| is_under(at) == is_under(&centroids[0])), "{centroids:?}");
            clusters[usize::from(is_under(&centroids[0]))] += usize::from(centroids.len() > 1);
        }
        assert!(clusters.iter().all(|&count| count > 12), "{clusters:?}");
    }

    #[test]
    fn long_slivers_are_no_clusters() {
        // A fan of slices that are ten times as long as a patch.
        let rim =
            |number: u32| 4.0 * Vec3::new((0.002 * number as f32).cos(), 0.0, (0.002 * number as f32).sin());
        let fan: Vec<[Vec3; 3]> = (0..400).map(|slice| [Vec3::ZERO, rim(slice + 1), rim(slice)]).collect();
        let scene = scene(&[&fan]);
        let patches = checked_patches(&scene, 0.4);
        for patch in &patches.list {
            let Bounds { low, high } = patches.facets(&scene, patch).flatten().collect::<Bounds<Vec3>>();
            let length = low.distance(high) / scene.space.scale as f32;
            assert!(length < 4.1 * 0.4, "{length}");
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
