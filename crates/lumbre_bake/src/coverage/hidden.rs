//! Finds texels that lie, wholly or in part, inside other geometry or pressed against it: rays from there hit the
//! inside of a solid, or hit something almost at once. The hidden part is taken out of the footprint, so that a texel
//! half under a box has the light of its open half. The result is independent of the bake's seed, unless the time is
//! too short to classify all texels exactly.

use std::collections::BTreeMap;

use glam::{DVec2, Vec2};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::contact_lines::ContactLines;
use super::divided_texels::has_contact_lines;
use super::footprint::{FINE, Footprint, FootprintPoint, Texel, footprint, receiver};
use super::texel_geometry::{bounding_area, positions_of};
use super::texel_groups::TexelGroups;
use crate::BakeError;
use crate::chunks::in_chunks;
use crate::monitor::{BakeMonitor, Clock};
use crate::sampling::{Sequence, Stream, cosine_about};
use crate::scene::{BakeScene, LightmapLayout, Receiver, SurfaceHit};
use crate::texel_index::{CoveredTexel, MapTexel};
use crate::visibility::shaft::is_free_before;

/// The seed of all rays here, independent of the bake's seed.
const SEED: u32 = 0;
/// A ray that ends within this share of the texel's side, or of its triangle's, is blocked: the point lies against
/// another surface. Faces that touch are apart by the rounding of their corners, and no light gets in between.
const MIN_CLEARANCE: f32 = 1.0 / 64.0;

/// Rays per texel that decide whether it is suspicious, so that its points are classified one by one.
const TEST_RAYS: u32 = 6;
/// Rays per tile that is hidden or open throughout.
const TILE_TEST_RAYS: u32 = 16;
/// Rays per texel once the time for exact classification is up.
const LATE_TEST_RAYS: u32 = 2;
/// Rays per point that classify it as open or hidden.
const POINT_RAYS: u32 = 8;
/// Rays from each corner and from the middle of what lies between contact lines. If all of them are clear, or all hit
/// the inside of a solid, they decide for everything there. They never decide for a part that is so small that it has
/// fewer of these points than make [`POINT_RAYS`] rays together.
/// The same number decides for a point on a line between areas that have the same view, if it confirms that view.
const AGREEING_RAYS: u32 = 2;
/// Distance from a contact line, in texels, below which a point lies on the line and may belong to either side.
const LINE_MARGIN: f64 = 0.05;
/// Rays that must be clear for an open point if another is blocked: where faces touch, a single ray may slip out
/// between them.
const MIN_CLEAR: u32 = 2;

/// Share of the time that the running stage may use up before texels are only classified roughly: direct light needs
/// the rest.
const EXACT_TIME_SHARE: f64 = 0.5;
/// The first so many texels are classified exactly whatever time it takes, so that small maps never lose quality.
const ALWAYS_EXACT: usize = 4096;
/// Usual share of the running stage's time that it takes to find suspicious texels, and of the time after that, to
/// classify them.
const PASSES: [f32; 2] = [0.1, 0.2];

/// Takes what is hidden out of the footprints; returns how many texels are hidden in part or whole, and the rays cast.
/// `contacts` are the lines beside which something may be hidden, and divide the texels in `divided`.
pub(crate) fn remove_hidden(
    scene: &BakeScene,
    layout: &LightmapLayout,
    texels: &mut [Texel],
    contacts: &ContactLines,
    divided: &[MapTexel],
    monitor: &mut BakeMonitor<'_>,
) -> Result<(usize, u64), BakeError> {
    let clock = monitor.clock().until(EXACT_TIME_SHARE);
    let (suspicious, mut rays) = suspicious_texels(scene, layout, texels, contacts, clock, monitor)?;
    let mut is_suspect = vec![false; layout.texels];
    divided.iter().for_each(|texel| is_suspect[texel.place()] = true);
    // The few rays of a texel may miss a hidden corner that its neighbours' rays have found.
    for (texel, _) in texels.iter().zip(&suspicious).filter(|(_, suspicious)| **suspicious) {
        let map = &layout.maps[texel.map.place()];
        map.neighbourhood(texel.x, texel.y, 1).for_each(|near| is_suspect[near.place()] = true);
    }
    let mut suspects: Vec<&mut Texel> =
        texels.iter_mut().filter(|texel| is_suspect[texel.index.place()]).collect();
    monitor.pass(PASSES[1]);
    let classified = in_chunks(suspects.len(), monitor, |place| {
        let texel = &*suspects[place];
        if place >= ALWAYS_EXACT && clock.is_over() {
            classify_roughly(scene, texel)
        } else {
            classify(scene, texel, contacts)
        }
    })?;
    rays += classified.iter().map(|points| u64::from(points.rays)).sum::<u64>();
    let hidden = monitor.run_interruptible(1.0, || {
        let pairs = suspects.par_iter_mut().zip(&classified);
        pairs.map(|(texel, points)| usize::from(keep_open(scene, texel, points))).sum()
    })?;
    Ok((hidden, rays))
}

/// Length below which a ray from a texel is blocked, canonical units.
fn min_clearance(scene: &BakeScene, texel: &Texel) -> f32 {
    let triangle_side = (2.0 * scene.triangles[texel.triangle as usize].area).sqrt();
    // `min` returns the other number if one is NaN.
    MIN_CLEARANCE * triangle_side.min(texel.side(scene))
}

/// Whether each texel is suspicious, and the rays cast. A tile that is hidden or open throughout needs only a few rays.
fn suspicious_texels(
    scene: &BakeScene,
    layout: &LightmapLayout,
    texels: &[Texel],
    contacts: &ContactLines,
    clock: Clock,
    monitor: &mut BakeMonitor<'_>,
) -> Result<(Vec<bool>, u64), BakeError> {
    let tiles = TexelGroups::tiles(texels);
    let mut is_crossed = vec![false; layout.texels];
    contacts.iter().for_each(|(texel, _)| is_crossed[texel.place()] = true);
    let suspicious_tiles = monitor.run_interruptible(0.0, || {
        let check = |members: &Vec<CoveredTexel>| {
            let members: Vec<&Texel> = members.iter().map(|member| &texels[member.place()]).collect();
            suspicious_tile(scene, &members, &is_crossed)
        };
        tiles.members.par_iter().map(check).collect::<Vec<(bool, u32)>>()
    })?;
    let must_test = |place: usize| suspicious_tiles[tiles.group_of[place] as usize].0;
    monitor.pass(PASSES[0]);
    let suspicious = in_chunks(texels.len(), monitor, |place| {
        let rays = if place >= ALWAYS_EXACT && clock.is_over() { LATE_TEST_RAYS } else { TEST_RAYS };
        must_test(place) && is_suspicious(scene, &texels[place], rays)
    })?;
    let tested = (0..texels.len()).filter(|&place| must_test(place)).count();
    let rays = suspicious_tiles.iter().map(|(_, rays)| u64::from(*rays)).sum::<u64>();
    Ok((suspicious, rays + tested as u64 * u64::from(TEST_RAYS)))
}

/// Whether the texels of a tile have to be tested thoroughly, and the rays cast. They need not be if all of the tile is
/// hidden or all of it is open, and a few rays for the whole tile are clear; nor if no contact line is known to cross
/// the tile, and one ray from each texel is clear.
fn suspicious_tile(scene: &BakeScene, members: &[&Texel], is_crossed: &[bool]) -> (bool, u32) {
    if scene.stop.is_cancelled() {
        return (false, 0);
    }
    let rays = if is_free_tile(scene, members) {
        TILE_TEST_RAYS as usize
    } else if members.iter().all(|texel| !is_crossed[texel.index.place()] && has_all_lines(scene, texel)) {
        members.len().max(TILE_TEST_RAYS as usize)
    } else {
        return (true, 0);
    };
    let tested = (0..rays).map(|ray| members[ray * members.len() / rays]);
    let is_clear = |(ray, texel): (usize, &Texel)| test_ray(scene, texel, ray as u32) == RayEnd::Clear;
    (!tested.enumerate().all(is_clear), rays as u32)
}

/// Whether the contact lines on everything that a texel shows have been searched for.
fn has_all_lines(scene: &BakeScene, texel: &Texel) -> bool {
    let has_lines = |triangle: u32| has_contact_lines(&scene.triangles[triangle as usize]);
    match &texel.footprint {
        Footprint::Whole(triangle) => has_lines(*triangle),
        Footprint::Points(points) => points.iter().all(|point| has_lines(point.triangle)),
        Footprint::Hidden => false,
    }
}

/// Whether no geometry crosses the space in front of a tile.
fn is_free_tile(scene: &BakeScene, members: &[&Texel]) -> bool {
    let mut positions = Vec::new();
    members.iter().for_each(|texel| positions_of(scene, texel, &mut positions));
    let area = members.first().and_then(|first| bounding_area(scene, first.triangle, &positions));
    area.is_some_and(|area| is_free_before(&area, scene))
}

/// What a ray from a point hits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum RayEnd {
    /// The inside of a solid, as also a ray that leaves a scene which is dark outside.
    Inside,
    /// A back face.
    Back,
    /// A lit surface almost at once.
    Blocked,
    /// A lit surface farther away, or nothing.
    Clear,
}

/// Casts a ray from a point, given two random numbers; it is blocked if it is shorter than `clearance`.
fn ray_end(scene: &BakeScene, from: &Receiver, [u, v]: [f32; 2], clearance: f32) -> RayEnd {
    match scene.classify_hit(from.origin, cosine_about(from.geometric_normal, u, v)) {
        SurfaceHit::Inside => RayEnd::Inside,
        SurfaceHit::Back => RayEnd::Back,
        SurfaceHit::Lit { distance, .. } if distance < clearance => RayEnd::Blocked,
        SurfaceHit::Lit { .. } | SurfaceHit::None => RayEnd::Clear,
    }
}

/// A ray from a random point of a texel.
fn test_ray(scene: &BakeScene, texel: &Texel, ray: u32) -> RayEnd {
    let [x, y, u, v] = Sequence::new(SEED, Stream::HiddenTexel, texel.index.0).point(ray, 0);
    let Some(point) = texel.point(scene, x, y) else { return RayEnd::Clear };
    ray_end(scene, &receiver(scene, &point), [u, v], min_clearance(scene, texel))
}

/// Whether some ray of a texel suggests that part of it is hidden.
fn is_suspicious(scene: &BakeScene, texel: &Texel, rays: u32) -> bool {
    let mut blocked = 0;
    (0..rays).any(|ray| match test_ray(scene, texel, ray) {
        RayEnd::Inside | RayEnd::Back => true,
        // In any corner of a room one ray may be blocked.
        RayEnd::Blocked => {
            blocked += 1;
            blocked > 1
        }
        RayEnd::Clear => false,
    })
}

/// The classification of a texel's points, and the rays that it took.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct OpenPoints {
    /// One bit for each point of the texel's fine footprint, set if it is in the open; empty if all points are.
    open: Vec<u64>,
    rays: u32,
}

/// The evenly spread points of a texel that are classified, always the same ones.
fn fine_points(scene: &BakeScene, texel: &Texel) -> Option<Vec<FootprintPoint>> {
    let mut triangles: Vec<u32> = match &texel.footprint {
        Footprint::Whole(triangle) => vec![*triangle],
        Footprint::Points(points) => points.iter().map(|point| point.triangle).collect(),
        Footprint::Hidden => return None,
    };
    triangles.sort_unstable();
    triangles.dedup();
    match footprint(scene, triangles.into_iter(), texel.x, texel.y, FINE) {
        Some(Footprint::Points(points)) => Some(points),
        _ => None,
    }
}

/// Classifies the points of a texel. Between contact lines a surface is either hidden or open throughout, so where the
/// corners and the middle of what lies between them agree, they decide for all points there.
fn classify(scene: &BakeScene, texel: &Texel, contacts: &ContactLines) -> OpenPoints {
    let Some(points) = fine_points(scene, texel) else { return OpenPoints::default() };
    let sequence = Sequence::new(SEED, Stream::HiddenView, texel.index.0);
    let mut rays =
        PointRays { scene, points: &points, sequence, clearance: min_clearance(scene, texel), cast: 0 };
    let knows_lines = has_all_lines(scene, texel);
    let Areas { areas, on_lines } = between_lines(&points, contacts.in_texel(texel.index));
    let mut views = vec![PointView::Hidden; points.len()];
    let mut agreed_views = Vec::with_capacity(areas.len());
    for area in &areas {
        let tested = corners_and_middle(&points, area);
        let agreed = if knows_lines { rays.agreed_view(&tested) } else { None };
        let agreed = agreed.or_else(|| {
            let views: Vec<PointView> = tested.into_iter().map(|index| rays.view(index)).collect();
            if knows_lines { common_view(&views) } else { equal_view(&views) }
        });
        for &index in area {
            views[index] = agreed.unwrap_or_else(|| rays.view(index));
        }
        agreed_views.push(agreed);
    }
    for (index, beside) in on_lines {
        // With an area on one side only, nothing is known of the other.
        let beside: Option<Vec<PointView>> =
            beside.into_iter().map(|area| agreed_views[area]).collect::<Option<_>>();
        let beside = beside.filter(|views| knows_lines && views.len() > 1);
        views[index] = rays.view_on_line(index, beside.and_then(|views| equal_view(&views)));
    }
    let mut open = vec![0u64; points.len().div_ceil(64)];
    let mut all_open = true;
    for (index, view) in views.into_iter().enumerate() {
        if view == PointView::Open {
            open[index / 64] |= 1 << (index % 64);
        } else {
            all_open = false;
        }
    }
    if all_open {
        open.clear();
    }
    OpenPoints { open, rays: rays.cast }
}

/// As [`equal_view`], but points that saw only back faces side with the others: where the open is seen through few gaps,
/// the rays of most points miss it.
fn common_view(views: &[PointView]) -> Option<PointView> {
    let mut certain = views.iter().copied().filter(|view| *view != PointView::BackFaces);
    let Some(first) = certain.next() else { return Some(PointView::BackFaces) };
    certain.all(|view| view == first).then_some(first)
}

/// The view that all points have, if it is the same.
fn equal_view(views: &[PointView]) -> Option<PointView> {
    views.first().copied().filter(|first| views.iter().all(|view| view == first))
}

/// The points of a footprint, by index, as contact lines divide them. Lines are treated as infinite.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Areas {
    /// The points of each area between lines.
    areas: Vec<Vec<usize>>,
    /// The points on lines, each with the areas that it may belong to, by their places in `areas`.
    on_lines: Vec<(usize, Vec<usize>)>,
}

/// Divides the points of a footprint along lines.
fn between_lines(points: &[FootprintPoint], lines: impl Iterator<Item = [DVec2; 2]>) -> Areas {
    let lines: Vec<[DVec2; 2]> =
        lines.filter_map(|[from, to]| Some([from, (to - from).try_normalize()?])).collect();
    let sides = |point: &FootprintPoint| -> Vec<LineSide> {
        let side = |[from, along]: &[DVec2; 2]| {
            let distance = along.perp_dot(point.offset.as_dvec2() - from);
            match distance.abs() < LINE_MARGIN {
                true => LineSide::OnLine,
                false if distance > 0.0 => LineSide::Left,
                false => LineSide::Right,
            }
        };
        lines.iter().map(side).collect()
    };
    let mut areas: BTreeMap<Vec<LineSide>, Vec<usize>> = BTreeMap::new();
    let mut on_lines = Vec::new();
    for (index, point) in points.iter().enumerate() {
        let sides = sides(point);
        if sides.contains(&LineSide::OnLine) {
            on_lines.push((index, sides));
        } else {
            areas.entry(sides).or_default().push(index);
        }
    }
    let may_be_in = |point: &[LineSide], area: &[LineSide]| {
        point.iter().zip(area).all(|(point, area)| *point == LineSide::OnLine || point == area)
    };
    let beside = |sides: &[LineSide]| {
        let may_be_in = areas.keys().enumerate().filter(|(_, area)| may_be_in(sides, area));
        may_be_in.map(|(place, _)| place).collect()
    };
    let on_lines = on_lines.into_iter().map(|(index, sides)| (index, beside(&sides))).collect();
    Areas { areas: areas.into_values().collect(), on_lines }
}

/// Where a point lies beside a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum LineSide {
    OnLine,
    Right,
    Left,
}

/// Classifies all points of a texel alike: as open if at least half of its test rays are clear.
fn classify_roughly(scene: &BakeScene, texel: &Texel) -> OpenPoints {
    let clear = (0..TEST_RAYS).filter(|&ray| test_ray(scene, texel, ray) == RayEnd::Clear).count();
    let open = if 2 * clear >= TEST_RAYS as usize { Vec::new() } else { vec![0] };
    OpenPoints { open, rays: TEST_RAYS }
}

/// Keeps only the open points of a texel; returns whether it has lost some.
fn keep_open(scene: &BakeScene, texel: &mut Texel, classified: &OpenPoints) -> bool {
    if classified.open.is_empty() {
        return false;
    }
    let Some(points) = fine_points(scene, texel) else { return false };
    let is_open =
        |index: usize| classified.open.get(index / 64).is_some_and(|bits| bits >> (index % 64) & 1 == 1);
    let open: Vec<FootprintPoint> =
        points.iter().enumerate().filter(|(index, _)| is_open(*index)).map(|(_, point)| *point).collect();
    if open.is_empty() {
        texel.footprint = Footprint::Hidden;
    } else {
        texel.triangle = open[open.len() / 2].triangle;
        texel.footprint = Footprint::Points(open);
    }
    true
}

/// Those of a group of points of a footprint, by index, that are nearest to the corners and the middle of the texel's
/// square.
fn corners_and_middle(points: &[FootprintPoint], group: &[usize]) -> Vec<usize> {
    let places = [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE, Vec2::splat(0.5)];
    let nearest = |place: Vec2| {
        let distance = |index: &usize| points[*index].offset.distance_squared(place);
        group.iter().copied().min_by(|a, b| distance(a).total_cmp(&distance(b)))
    };
    let mut nearest: Vec<usize> = places.into_iter().filter_map(nearest).collect();
    nearest.sort_unstable();
    nearest.dedup();
    nearest
}

/// What the rays from a point say of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PointView {
    Open,
    /// It is inside a solid, or pressed against another surface.
    Hidden,
    /// All rays hit back faces. Taken by itself, the point counts as hidden.
    BackFaces,
}

/// The rays from a texel's points: those of a point are always the same.
struct PointRays<'a> {
    scene: &'a BakeScene,
    points: &'a [FootprintPoint],
    sequence: Sequence,
    /// Length below which a ray is blocked.
    clearance: f32,
    /// Rays so far.
    cast: u32,
}

impl PointRays<'_> {
    /// Casts one of the [`POINT_RAYS`] rays of a point; `from` is that point.
    fn ray(&mut self, from: &Receiver, index: usize, ray: u32) -> RayEnd {
        self.cast += 1;
        let [u, v, ..] = self.sequence.point(index as u32 * POINT_RAYS + ray, 0);
        ray_end(self.scene, from, [u, v], self.clearance)
    }

    /// The view that some points have in common if their first rays are all clear, or all hit the inside of a solid.
    fn agreed_view(&mut self, tested: &[usize]) -> Option<PointView> {
        if (tested.len() as u32) * AGREEING_RAYS < POINT_RAYS {
            return None;
        }
        let mut first = None;
        for &index in tested {
            let receiver = receiver(self.scene, &self.points[index]);
            for ray in 0..AGREEING_RAYS {
                let end = self.ray(&receiver, index, ray);
                if end != *first.get_or_insert(end) || matches!(end, RayEnd::Back | RayEnd::Blocked) {
                    return None;
                }
            }
        }
        Some(if first? == RayEnd::Clear { PointView::Open } else { PointView::Hidden })
    }

    /// The view of a point on a contact line, given the view that everything beside the line has in common, if it has.
    /// The point has it too if its first rays agree: it may lie under something that is thinner than the line's margin.
    fn view_on_line(&mut self, index: usize, beside: Option<PointView>) -> PointView {
        if let Some(view @ (PointView::Open | PointView::Hidden)) = beside {
            let expected = if view == PointView::Open { RayEnd::Clear } else { RayEnd::Inside };
            let receiver = receiver(self.scene, &self.points[index]);
            if (0..AGREEING_RAYS).all(|ray| self.ray(&receiver, index, ray) == expected) {
                return view;
            }
        }
        self.view(index)
    }

    /// The view of a point, by fewer than [`POINT_RAYS`] rays where the first ones decide. The point is hidden if half
    /// of its rays hit the inside of a solid, or if too few are clear: none, or fewer than [`MIN_CLEAR`] where some are
    /// blocked.
    fn view(&mut self, index: usize) -> PointView {
        let receiver = receiver(self.scene, &self.points[index]);
        let (mut inside, mut blocked, mut clear) = (0, 0, 0);
        for ray in 0..POINT_RAYS {
            match self.ray(&receiver, index, ray) {
                RayEnd::Inside => inside += 1,
                RayEnd::Back => {}
                RayEnd::Blocked => blocked += 1,
                RayEnd::Clear => clear += 1,
            }
            if 2 * inside >= POINT_RAYS {
                return PointView::Hidden;
            }
            let enough = if blocked > 0 { MIN_CLEAR } else { 1 };
            if 2 * (ray + 1 - inside) > POINT_RAYS && clear >= enough {
                return PointView::Open;
            }
        }
        if inside + blocked + clear == 0 { PointView::BackFaces } else { PointView::Hidden }
    }
}

#[cfg(test)]
mod tests {
    use super::super::on_a_floor::on_a_floor;
    use super::*;

    /// The points of a footprint that fills its texel.
    fn grid() -> Vec<FootprintPoint> {
        let offset = |cell: u32| (Vec2::new((cell % FINE) as f32, (cell / FINE) as f32) + 0.5) / FINE as f32;
        let point = |cell| FootprintPoint { triangle: 0, at: (0.0, 0.0), offset: offset(cell) };
        (0..FINE * FINE).map(point).collect()
    }

    #[test]
    fn contact_lines_divide_the_points_of_a_texel() {
        let points = grid();
        let divided = |lines: &[[DVec2; 2]]| {
            let divided = between_lines(&points, lines.iter().copied());
            let on_lines = divided.on_lines.iter().map(|(index, _)| index);
            let mut all: Vec<usize> = divided.areas.iter().flatten().chain(on_lines).copied().collect();
            all.sort_unstable();
            assert_eq!(all, (0..points.len()).collect::<Vec<_>>(), "each point is somewhere once");
            divided
        };
        let sizes = |lines: &[[DVec2; 2]]| -> Vec<usize> {
            let mut sizes: Vec<usize> = divided(lines).areas.iter().map(Vec::len).collect();
            sizes.sort_unstable();
            sizes
        };
        // The columns are at 1/16, 3/16, ...: the fourth is on the line at 0.4375, none on the one at 0.25.
        let upright = |x: f64| [DVec2::new(x, 0.2), DVec2::new(x, 0.9)];
        let level = |y: f64| [DVec2::new(0.1, y), DVec2::new(0.6, y)];
        assert_eq!(sizes(&[]), [64]);
        assert_eq!(sizes(&[upright(0.25)]), [16, 48]);
        assert_eq!(sizes(&[upright(0.4375)]), [24, 32]);
        assert_eq!(sizes(&[upright(0.25), level(0.5)]), [8, 8, 24, 24]);
        assert_eq!(sizes(&[[DVec2::splat(0.5); 2]]), [64], "a line without length divides nothing");
        // A point on a line may belong to either side, and one on the other line too to any of four areas.
        let crossed = divided(&[upright(0.4375), level(0.4375)]);
        assert_eq!(crossed.areas.len(), 4);
        for (index, beside) in &crossed.on_lines {
            let both = index % FINE as usize == 3 && index / FINE as usize == 3;
            assert_eq!(beside.len(), if both { 4 } else { 2 }, "{index}");
        }
        assert_eq!(crossed.on_lines.len(), 15);
    }

    #[test]
    fn two_rays_decide_for_points_that_are_enough_together() {
        on_a_floor(8, |texels, _| {
            let texel = &texels.list[9];
            let points = fine_points(texels.scene, texel).unwrap();
            let sequence = Sequence::new(SEED, Stream::HiddenView, texel.index.0);
            let mut rays =
                PointRays { scene: texels.scene, points: &points, sequence, clearance: 0.0, cast: 0 };
            let tested = corners_and_middle(&points, &(0..points.len()).collect::<Vec<_>>());
            assert_eq!((rays.agreed_view(&tested), rays.cast), (Some(PointView::Open), 10));
            assert_eq!((rays.agreed_view(&tested[..3]), rays.cast), (None, 10));
            rays.cast = 0;
            assert_eq!((rays.view(tested[0]), rays.cast), (PointView::Open, 5));
            rays.cast = 0;
            // In the open, where both sides are; where they differ, or are said to be hidden, it is looked at by itself.
            let mut on_line = |beside| {
                rays.cast = 0;
                (rays.view_on_line(tested[0], beside), rays.cast)
            };
            assert_eq!(on_line(Some(PointView::Open)), (PointView::Open, 2));
            assert_eq!(on_line(None), (PointView::Open, 5));
            assert_eq!(on_line(Some(PointView::Hidden)), (PointView::Open, 6));
        });
    }

    #[test]
    fn points_that_see_only_back_faces_side_with_the_others() {
        use PointView::{BackFaces, Hidden, Open};
        assert_eq!(common_view(&[Open, BackFaces, Open]), Some(Open));
        assert_eq!(common_view(&[BackFaces, Hidden]), Some(Hidden));
        assert_eq!(common_view(&[BackFaces, BackFaces]), Some(BackFaces));
        assert_eq!(common_view(&[Open, BackFaces, Hidden]), None);
    }
}
