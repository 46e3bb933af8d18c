//! The footprint of each texel: the pieces of triangles that lie in its square, found by conservative rasterisation, so
//! that a texel that a triangle merely touches is covered too. Which of it other geometry hides is found in `hidden`.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::scene::{BakeScene, LightmapLayout, Receiver, SceneTriangle, Side};
use crate::texel_index::{CoveredTexel, MapIndex, MapTexel};
use crate::visibility::clipping::clip;

/// A point on a triangle that a texel shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FootprintPoint {
    pub triangle: u32,
    /// Barycentric weights of the second and third vertex.
    pub at: (f32, f32),
    /// Its position in the texel's unit square.
    pub offset: Vec2,
}

/// How a map lies on the surface that it shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MapAxes {
    /// Unit vectors on the surface: in the direction of the map's rows, and square to it. Zero if the surface has no area.
    pub along: Vec3,
    pub across: Vec3,
    /// The surface's unit normal.
    pub normal: Vec3,
    /// The steps from one column to the next and from one row to the next, by `along` and `across`, canonical units.
    pub column_step: Vec2,
    pub row_step: Vec2,
}

/// The part of the scene that a texel shows.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Footprint {
    /// The whole square lies on one triangle, by index.
    Whole(u32),
    /// Evenly spread points, at least one.
    Points(Vec<FootprintPoint>),
    /// Other geometry hides everything that the texel covers.
    Hidden,
}

/// A texel that some triangle covers.
#[derive(Clone, Debug)]
pub(crate) struct Texel {
    pub index: MapTexel,
    pub map: MapIndex,
    /// Column and row in its map.
    pub x: u32,
    pub y: u32,
    /// One of the triangles in its footprint.
    pub triangle: u32,
    pub footprint: Footprint,
}

/// Grid points along a texel's side: for a texel that several triangles share.
const COARSE: u32 = 4;
/// The same for a texel that other geometry may hide in part.
pub(crate) const FINE: u32 = 8;
/// Points in the coarse grid: as many as a texel has that several triangles fill together.
pub(crate) const GRID: usize = (COARSE * COARSE) as usize;

/// The covered texels of all maps, map by map and row by row.
pub(crate) fn footprints(scene: &BakeScene, layout: &LightmapLayout) -> Vec<Texel> {
    let mut by_map: Vec<Vec<u32>> = vec![Vec::new(); layout.maps.len()];
    for (index, triangle) in scene.triangles.iter().enumerate() {
        by_map[triangle.map.place()].push(index as u32);
    }
    let maps: Vec<Vec<Texel>> = by_map
        .par_iter()
        .enumerate()
        .map(|(number, triangles)| {
            let map = &layout.maps[number];
            let mut covers: Vec<(u32, u32)> = Vec::new();
            for &index in triangles {
                if scene.stop.is_cancelled() {
                    return Vec::new();
                }
                covered_texels(&scene.triangles[index as usize], map.width, map.height, |x, y| {
                    covers.push((y * map.width + x, index));
                });
            }
            covers.sort_unstable();
            covers
                .par_chunk_by(|a, b| a.0 == b.0)
                .filter_map(|chunk| {
                    if scene.stop.is_cancelled() {
                        return None;
                    }
                    let cell = chunk[0].0;
                    let (x, y) = (cell % map.width, cell / map.width);
                    let triangles = || chunk.iter().map(|&(_, triangle)| triangle);
                    let footprint = footprint(scene, triangles(), x, y, COARSE)?;
                    let triangle = match &footprint {
                        Footprint::Points(points) => points[points.len() / 2].triangle,
                        _ => triangles().next()?,
                    };
                    let index = map.texel(x, y);
                    Some(Texel { index, map: MapIndex(number as u32), x, y, triangle, footprint })
                })
                .collect()
        })
        .collect();
    maps.into_iter().flatten().collect()
}

/// The footprint of the texel at column `x` and row `y` on some triangles: points on a grid of `resolution` x
/// `resolution`, or, at the coarse resolution, the triangle that fills the whole texel. `None` if no triangle has area
/// there.
pub(crate) fn footprint(
    scene: &BakeScene,
    triangles: impl Iterator<Item = u32> + Clone,
    x: u32,
    y: u32,
    resolution: u32,
) -> Option<Footprint> {
    let corner = Vec2::new(x as f32, y as f32);
    let inside = |index: u32, offset: Vec2| {
        barycentric(&scene.triangles[index as usize], corner + offset)
            .filter(|&(u, v)| u >= 0.0 && v >= 0.0 && u + v <= 1.0)
    };
    let corners = [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE];
    if resolution == COARSE
        && let Some(whole) = triangles.clone().find(|&t| corners.iter().all(|&c| inside(t, c).is_some()))
    {
        return Some(Footprint::Whole(whole));
    }
    let mut points = Vec::new();
    for cell in 0..resolution * resolution {
        let offset =
            (Vec2::new((cell % resolution) as f32, (cell / resolution) as f32) + 0.5) / resolution as f32;
        let hit = triangles.clone().find_map(|triangle| Some((triangle, inside(triangle, offset)?)));
        if let Some((triangle, at)) = hit {
            points.push(FootprintPoint { triangle, at, offset });
        }
    }
    if points.is_empty() {
        // The pieces are too small to contain a point of the grid: take the centroid of each.
        for triangle in triangles {
            if let Some(offset) = centroid_of_piece(&scene.triangles[triangle as usize], corner)
                && let Some((u, v)) = barycentric(&scene.triangles[triangle as usize], corner + offset)
            {
                let u = u.clamp(0.0, 1.0);
                points.push(FootprintPoint { triangle, at: (u, v.clamp(0.0, 1.0 - u)), offset });
            }
        }
    }
    (!points.is_empty()).then_some(Footprint::Points(points))
}

/// Calls `visit` for every texel whose square a triangle touches, and perhaps for a few next to it.
fn covered_texels(triangle: &SceneTriangle, width: u32, height: u32, mut visit: impl FnMut(u32, u32)) {
    let [a, mut b, mut c] = triangle.uv;
    let area = (b - a).perp_dot(c - a);
    if !(area.is_finite() && area != 0.0) {
        return;
    }
    if area < 0.0 {
        (b, c) = (c, b);
    }
    let edges = [(a, b - a), (b, c - b), (c, a - c)];
    let low = a.min(b).min(c).floor().max(Vec2::ZERO);
    let high = a.max(b).max(c).ceil().min(Vec2::new(width as f32, height as f32));
    // `as` saturates: negative numbers become 0.
    for y in low.y as u32..(high.y as u32).max(low.y as u32 + 1).min(height) {
        for x in low.x as u32..(high.x as u32).max(low.x as u32 + 1).min(width) {
            let center = Vec2::new(x as f32, y as f32) + 0.5;
            // The square reaches this far from its center along the edge's normal.
            let outside = edges.iter().any(|(start, along)| {
                along.perp_dot(center - *start) < -0.5 * (along.x.abs() + along.y.abs())
            });
            if !outside {
                visit(x, y);
            }
        }
    }
}

/// Barycentric weights (second, third vertex) of a position in the map; `None` if the triangle has no area in the map.
pub(crate) fn barycentric(triangle: &SceneTriangle, position: Vec2) -> Option<(f32, f32)> {
    let [a, b, c] = triangle.uv;
    let area = (b - a).perp_dot(c - a);
    let (u, v) = ((position - a).perp_dot(c - a) / area, (b - a).perp_dot(position - a) / area);
    (u.is_finite() && v.is_finite()).then_some((u, v))
}

/// The centroid, in the texel's unit square, of the part of a triangle in that square.
fn centroid_of_piece(triangle: &SceneTriangle, corner: Vec2) -> Option<Vec2> {
    let mut polygon: Vec<Vec2> = triangle.uv.iter().map(|&uv| uv - corner).collect();
    for (axis, sign, limit) in [(0, 1.0, 0.0), (0, -1.0, -1.0), (1, 1.0, 0.0), (1, -1.0, -1.0)] {
        let mut clipped = Vec::with_capacity(polygon.len() + 1);
        clip(&polygon, |p: Vec2| sign * p[axis] - limit, |p| clipped.push(p));
        polygon = clipped;
    }
    let &first = polygon.first()?;
    let (mut sum, mut area) = (Vec2::ZERO, 0.0);
    for pair in polygon.windows(2).skip(1) {
        let doubled_area = (pair[0] - first).perp_dot(pair[1] - first);
        sum += (first + pair[0] + pair[1]) / 3.0 * doubled_area;
        area += doubled_area;
    }
    let centroid = sum / area;
    centroid.is_finite().then(|| centroid.clamp(Vec2::ZERO, Vec2::ONE))
}

/// The texels that are not hidden, each with its index among the covered texels.
pub(crate) fn open_texels(texels: &[Texel]) -> impl Iterator<Item = (CoveredTexel, &Texel)> {
    CoveredTexel::all(texels.len()).zip(texels).filter(|(_, texel)| !texel.is_hidden())
}

impl Texel {
    /// The point of the footprint for a sample position in the unit square.
    #[inline]
    pub fn point(&self, scene: &BakeScene, x: f32, y: f32) -> Option<FootprintPoint> {
        match &self.footprint {
            Footprint::Whole(triangle) => {
                let offset = Vec2::new(x, y);
                let corner = Vec2::new(self.x as f32, self.y as f32);
                let (u, v) = barycentric(&scene.triangles[*triangle as usize], corner + offset)?;
                let u = u.clamp(0.0, 1.0);
                Some(FootprintPoint { triangle: *triangle, at: (u, v.clamp(0.0, 1.0 - u)), offset })
            }
            Footprint::Points(points) => {
                let index = ((x * points.len() as f32) as usize).min(points.len().saturating_sub(1));
                points.get(index).copied()
            }
            Footprint::Hidden => None,
        }
    }

    /// Whether the footprint consists of points that stand for all that triangles cover of the texel: not where geometry
    /// hides a part of it, as only the points are known to be in the open there.
    pub fn has_points_for_all(&self) -> bool {
        let is_coarse = |point: &FootprintPoint| {
            let column_and_row = point.offset * COARSE as f32 - 0.5;
            column_and_row == column_and_row.round()
        };
        matches!(&self.footprint, Footprint::Points(points) if points.iter().all(is_coarse))
    }

    /// The point of the footprint's triangles at a place in the texel's unit square; `None` where they do not cover it.
    pub fn covered_point(&self, scene: &BakeScene, x: f32, y: f32) -> Option<FootprintPoint> {
        let Footprint::Points(points) = &self.footprint else { return self.point(scene, x, y) };
        let offset = Vec2::new(x, y);
        let place = Vec2::new(self.x as f32, self.y as f32) + offset;
        points.chunk_by(|a, b| a.triangle == b.triangle).find_map(|of_triangle| {
            let triangle = of_triangle[0].triangle;
            let at = barycentric(&scene.triangles[triangle as usize], place)
                .filter(|&(u, v)| u >= 0.0 && v >= 0.0 && u + v <= 1.0)?;
            Some(FootprintPoint { triangle, at, offset })
        })
    }

    /// The mean position of the footprint in the texel's unit square.
    pub fn middle(&self) -> Vec2 {
        match &self.footprint {
            Footprint::Points(points) if !points.is_empty() => {
                points.iter().map(|point| point.offset).sum::<Vec2>() / points.len() as f32
            }
            _ => Vec2::splat(0.5),
        }
    }

    /// Length of the texel's side on its surface, canonical units.
    pub fn side(&self, scene: &BakeScene) -> f32 {
        let triangle = &scene.triangles[self.triangle as usize];
        let [a, b, c] = triangle.uv;
        (2.0 * triangle.area / (b - a).perp_dot(c - a).abs()).sqrt()
    }

    /// Its longer side, canonical units, if all of it lies on one flat triangle.
    pub fn flat_side(&self, scene: &BakeScene) -> Option<f32> {
        match self.footprint {
            Footprint::Whole(triangle) if scene.triangles[triangle as usize].flat => {
                let axes = self.map_axes(scene);
                Some(axes.column_step.length().max(axes.row_step.length()))
            }
            _ => None,
        }
    }

    /// How the map lies on the texel's surface.
    pub fn map_axes(&self, scene: &BakeScene) -> MapAxes {
        let triangle = &scene.triangles[self.triangle as usize];
        MapAxes::of(triangle.corners, triangle.uv, triangle.normal)
    }

    /// Whether other geometry hides all of it.
    pub fn is_hidden(&self) -> bool {
        self.footprint == Footprint::Hidden
    }
}

impl MapAxes {
    /// How the map lies on a triangle with these corners, which are at `uv` in the map, and this unit normal.
    fn of([a, b, c]: [Vec3; 3], [at_a, at_b, at_c]: [Vec2; 3], normal: Vec3) -> Self {
        let (first, second) = (at_b - at_a, at_c - at_a);
        let scale = first.perp_dot(second).recip();
        let column = ((b - a) * second.y - (c - a) * first.y) * scale;
        let row = ((c - a) * first.x - (b - a) * second.x) * scale;
        let along = column.normalize_or_zero();
        let across = normal.cross(along);
        let step = |step: Vec3| Vec2::new(step.dot(along), step.dot(across));
        let axes = Self { along, across, normal, column_step: step(column), row_step: step(row) };
        // A triangle without area may have one in the map.
        match axes.column_step.is_finite() && axes.row_step.is_finite() {
            true => axes,
            false => Self {
                along: Vec3::ZERO,
                across: Vec3::ZERO,
                column_step: Vec2::ZERO,
                row_step: Vec2::ZERO,
                ..axes
            },
        }
    }
}

/// The receiver at a point on a triangle's front side.
#[inline]
pub(crate) fn receiver(scene: &BakeScene, point: &FootprintPoint) -> Receiver {
    let triangle = &scene.triangles[point.triangle as usize];
    let (u, v) = point.at;
    let mut position = triangle.position(u, v);
    let normal = triangle.shading_normal(u, v);
    if !triangle.flat {
        position = on_curved_surface(triangle, position, u, v);
    }
    let origin = scene.off_surface(point.triangle, Side::Front, position);
    Receiver { position, origin, geometric_normal: triangle.normal, normal }
}

/// Lifts a point of a flat triangle to the curved surface that its vertex normals describe, so that the facets do not
/// shade each other (Hanika, "Hacking the Shadow Terminator", Ray Tracing Gems II, chapter 4).
fn on_curved_surface(triangle: &SceneTriangle, position: glam::Vec3, u: f32, v: f32) -> glam::Vec3 {
    let weights = [1.0 - u - v, u, v];
    (0..3)
        .map(|i| {
            let (corner, normal) = (triangle.corners[i], triangle.normals[i]);
            (position - normal * (position - corner).dot(normal).min(0.0)) * weights[i]
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_of_a_map_lead_from_texel_to_texel() {
        let corners = [Vec3::new(1.0, 0.5, -2.0), Vec3::new(2.5, 1.0, -1.0), Vec3::new(0.0, 3.0, 0.5)];
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        let maps = [
            [Vec2::new(3.0, 4.0), Vec2::new(20.0, 6.0), Vec2::new(5.0, 31.0)],
            // Mirrored, and stretched.
            [Vec2::new(3.0, 4.0), Vec2::new(5.0, 90.0), Vec2::new(20.0, 6.0)],
            // Sheared.
            [Vec2::new(50.0, 40.0), Vec2::new(10.0, 2.0), Vec2::new(9.0, 7.0)],
        ];
        for uv in maps {
            let axes = MapAxes::of(corners, uv, normal);
            assert!(axes.along.is_normalized() && axes.across.is_normalized());
            assert!(axes.along.dot(axes.across).abs() < 1e-6 && axes.across.dot(normal).abs() < 1e-6);
            let from = uv[0];
            for (to, corner) in uv.iter().zip(corners) {
                let step = axes.column_step * (to.x - from.x) + axes.row_step * (to.y - from.y);
                let reached = corners[0] + axes.along * step.x + axes.across * step.y;
                assert!(reached.distance(corner) < 1e-5, "{uv:?}: {reached} is not {corner}");
            }
        }
    }

    #[test]
    fn a_map_on_a_triangle_without_area_has_no_steps() {
        let uv = [Vec2::ZERO, Vec2::X, Vec2::Y];
        for (corners, uv) in [([Vec3::ONE; 3], uv), ([Vec3::ZERO, Vec3::X, Vec3::Y], [Vec2::ZERO; 3])] {
            let axes = MapAxes::of(corners, uv, Vec3::Z);
            assert_eq!((axes.along, axes.column_step, axes.row_step), (Vec3::ZERO, Vec2::ZERO, Vec2::ZERO));
        }
    }
}
