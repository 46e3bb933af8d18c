//! Cuts a cell of a triangle along contact lines into smaller triangles, and finds the one that contains a point, by a
//! BSP tree (Fuchs, Kedem, Naylor, "On Visible Surface Generation by A Priori Tree Structures", 1980). Without the
//! cuts, a cell that a wall crosses would carry light from one side of the wall to the other. The lines are found in
//! `visibility::contacts`.

use glam::{DMat2, DVec2};

use crate::scene::mean_of_points::SubTriangle;
use crate::visibility::clipping::{clip, clip_segment};

/// An inner node: a line, and the children on its two sides.
#[derive(Clone, Copy, Debug)]
struct BspNode {
    /// (a, b, c): a u + b v + c >= 0 on the first side, with (u, v) the barycentric weights of the second and third
    /// vertex.
    line: [f32; 3],
    sides: [BspChild; 2],
}

/// The index of a node or, with [`PIECE_FLAG`] set, the slot of a piece. A slot is the place of the piece's patch among
/// those of its triangle's side.
#[derive(Clone, Copy, Debug)]
struct BspChild(u32);

const PIECE_FLAG: u32 = 1 << 31;

/// The trees of all cells that are cut.
#[derive(Clone, Debug)]
pub(crate) struct BspTrees {
    /// Most lines that cut one cell.
    most_lines: u32,
    nodes: Vec<BspNode>,
    /// The pieces, cell by cell.
    pub pieces: Vec<SubTriangle>,
    /// How many cells are crossed by more lines than may cut them.
    pub full: usize,
}

/// A cell that was cut.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CutCell {
    /// The root node of its tree.
    pub root: u32,
    /// Its pieces are `count` in [`BspTrees::pieces`], from `first` on.
    pub first: u32,
    pub count: u32,
}

/// Most lines that cut one cell where there are not too many pieces.
pub(crate) const MAX_LINES: u32 = 12;
/// Area of the smallest piece that a contact line may cut off, as a share of its cell's.
const MIN_PIECE: f64 = 1.0 / 256.0;
/// A contact line cuts a piece if it is at least as long as this share of the piece's size.
const MIN_CONTACT: f64 = 0.1;
/// Points at most this far from a line, as a share of a piece's size, count as lying on it.
const ON_LINE: f64 = 0.02;

/// A polygon's corner is dropped if that changes the area by less than this share: contact lines, and with them the
/// corners of pieces, are known to some 1e-7 of a triangle only.
const SLIVER: f64 = 1e-4;

/// A cell while it is being cut.
struct Cell<'a> {
    trees: &'a mut BspTrees,
    /// From places in the plane's frame to barycentric weights, which are 0 at its origin.
    weights: DMat2,
    /// Its first piece in [`BspTrees::pieces`].
    first: u32,
    /// The slot of its first piece, and the first one of the others'.
    slots: (u32, u32),
    /// Area of the smallest piece that a line may cut off, square canonical units.
    smallest: f64,
    /// How many more lines may cut it.
    lines_left: u32,
    /// Whether more lines cross it than may cut it.
    full: bool,
}

impl BspTrees {
    /// No trees yet; cells will be cut along so many lines at most.
    pub fn new(most_lines: u32) -> Self {
        Self { most_lines, nodes: Vec::new(), pieces: Vec::new(), full: 0 }
    }

    /// Cuts a cell, counter-clockwise in its plane's frame, along segments. `weights` converts places in the frame to
    /// barycentric weights. The first piece takes the slot `cell_slot`, the others those from `free_slot` on. `None` if
    /// no segment cuts it.
    pub fn cut(
        &mut self,
        corners: [DVec2; 3],
        segments: &[[DVec2; 2]],
        weights: DMat2,
        (cell_slot, free_slot): (u32, u32),
    ) -> Option<CutCell> {
        let smallest = MIN_PIECE * area(&corners);
        let (root, first) = (self.nodes.len() as u32, self.pieces.len() as u32);
        let (slots, lines_left) = ((cell_slot, free_slot), self.most_lines);
        let mut cell = Cell { trees: self, weights, first, slots, smallest, lines_left, full: false };
        let line = cell.best_line(&corners, segments)?;
        cell.divide(&corners, segments, Some(line));
        let full = cell.full;
        self.full += usize::from(full);
        Some(CutCell { root, first, count: self.pieces.len() as u32 - first })
    }

    /// The slot of the piece that contains a point, in the cell whose tree has this root.
    pub fn find(&self, root: u32, u: f32, v: f32) -> u32 {
        let mut child = BspChild(root);
        while child.0 & PIECE_FLAG == 0 {
            let node = &self.nodes[child.0 as usize];
            let [a, b, c] = node.line;
            child = node.sides[usize::from(a * u + b * v + c < 0.0)];
        }
        child.0 & !PIECE_FLAG
    }
}

impl Cell<'_> {
    /// Divides a convex polygon by the given line or else by the best contact line; if there is none, into triangles.
    fn divide(&mut self, polygon: &[DVec2], segments: &[[DVec2; 2]], line: Option<Line>) -> BspChild {
        let Some(line) = line.or_else(|| self.best_line(polygon, segments)) else {
            return self.triangulate(polygon);
        };
        let tolerance = ON_LINE * area(polygon).sqrt();
        let node = self.push_node(line);
        self.lines_left = self.lines_left.saturating_sub(1);
        for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
            let line = Line { normal: line.normal * sign, offset: line.offset * sign };
            let part = clipped(polygon, line);
            let rest: Vec<[DVec2; 2]> = segments
                .iter()
                .filter(|segment| segment.iter().any(|&p| line.height(p) > tolerance))
                .copied()
                .collect();
            let child = self.divide(&part, &rest, None);
            self.trees.nodes[node as usize].sides[side] = child;
        }
        BspChild(node)
    }

    /// Appends a node whose children are not known yet.
    fn push_node(&mut self, line: Line) -> u32 {
        // The line in barycentric weights goes through the images of two of its points.
        let foot = line.normal * line.offset;
        let (p, q) = (self.weights * foot, self.weights * (foot - line.normal.perp()));
        let normal = (q - p).perp();
        let normal = normal / normal.length().max(f64::MIN_POSITIVE);
        // The normal points to the first side in both frames.
        let normal = if normal.dot(self.weights * line.normal) < 0.0 { -normal } else { normal };
        let line = [normal.x as f32, normal.y as f32, -normal.dot(p) as f32];
        let node = self.trees.nodes.len() as u32;
        self.trees.nodes.push(BspNode { line, sides: [BspChild(PIECE_FLAG); 2] });
        node
    }

    /// Divides a convex polygon into a fan of triangles, about the corner that makes the smallest of them largest.
    fn triangulate(&mut self, polygon: &[DVec2]) -> BspChild {
        let polygon = without_slivers(polygon);
        let count = polygon.len();
        let corner = |i: usize| polygon[i % count];
        let fan =
            |apex: usize| (1..count - 1).map(move |i| [corner(apex), corner(apex + i), corner(apex + i + 1)]);
        let smallest = |apex: usize| fan(apex).map(|t| area(&t)).fold(f64::INFINITY, f64::min);
        let better = |a: &usize, b: &usize| smallest(*a).total_cmp(&smallest(*b)).then(b.cmp(a));
        let apex = (0..count).max_by(better).unwrap_or(0);
        let triangles: Vec<[DVec2; 3]> = fan(apex).collect();
        self.push_fan(&triangles)
    }

    /// Appends the triangles of a fan as pieces, and the nodes that separate them.
    fn push_fan(&mut self, triangles: &[[DVec2; 3]]) -> BspChild {
        let [triangle, rest @ ..] = triangles else { return BspChild(PIECE_FLAG) };
        if rest.is_empty() {
            let piece = triangle.map(|p| self.weights * p).map(|w| (w.x as f32, w.y as f32));
            let place = self.trees.pieces.len() as u32 - self.first;
            self.trees.pieces.push(piece);
            let slot = if place == 0 { self.slots.0 } else { self.slots.1 + place - 1 };
            return BspChild(PIECE_FLAG | slot);
        }
        // From the triangle's last corner to the apex, the triangle lies on the left of the diagonal, which is its
        // first side.
        let node = self.push_node(Line::through(triangle[2], triangle[0]));
        let first = self.push_fan(std::slice::from_ref(triangle));
        let second = self.push_fan(rest);
        self.trees.nodes[node as usize].sides = [first, second];
        BspChild(node)
    }

    /// The line with the greatest length of contacts along it, if that is long enough and a large enough piece lies on
    /// each side.
    fn best_line(&mut self, polygon: &[DVec2], segments: &[[DVec2; 2]]) -> Option<Line> {
        // Once a cell is known to be full, no more lines need to be looked for.
        if segments.is_empty() || self.full {
            return None;
        }
        let size = area(polygon).sqrt();
        let inside: Vec<[DVec2; 2]> =
            segments.iter().filter_map(|segment| clip_segment(polygon, *segment)).collect();
        let mut best: Option<(f64, Line)> = None;
        for segment in &inside {
            let [p, q] = *segment;
            let line = Line::through(p, q);
            if !line.normal.is_finite() {
                continue;
            }
            let is_along =
                |other: &&[DVec2; 2]| other.iter().all(|&p| line.height(p).abs() <= ON_LINE * size);
            let support: f64 = inside.iter().filter(is_along).map(|[p, q]| p.distance(*q)).sum();
            if support < MIN_CONTACT * size || best.is_some_and(|(most, _)| support <= most * (1.0 + 1e-6)) {
                continue;
            }
            let pieces = [1.0, -1.0].map(|sign| {
                area(&clipped(polygon, Line { normal: line.normal * sign, offset: line.offset * sign }))
            });
            if pieces.iter().all(|&piece| piece >= self.smallest) {
                best = Some((support, line));
            }
        }
        self.full = best.is_some() && self.lines_left == 0;
        best.filter(|_| self.lines_left > 0).map(|(_, line)| line)
    }
}

/// Points p with normal · p = offset.
#[derive(Clone, Copy, Debug)]
struct Line {
    normal: DVec2,
    offset: f64,
}

impl Line {
    /// Its first side, that of positive heights, is on the left when going from `p` to `q`.
    fn through(p: DVec2, q: DVec2) -> Self {
        let normal = (q - p).perp() / (q - p).length();
        Self { normal, offset: normal.dot(p) }
    }

    /// Signed distance of a point.
    fn height(&self, p: DVec2) -> f64 {
        self.normal.dot(p) - self.offset
    }
}

/// Area of a counter-clockwise polygon.
fn area(polygon: &[DVec2]) -> f64 {
    let Some(&origin) = polygon.first() else { return 0.0 };
    polygon.windows(2).map(|pair| 0.5 * (pair[0] - origin).perp_dot(pair[1] - origin)).sum()
}

/// A polygon without the corners that add next to no area. They are removed one at a time, so that one of two in the
/// same place stays.
fn without_slivers(polygon: &[DVec2]) -> Vec<DVec2> {
    let least = SLIVER * area(polygon);
    let mut polygon = polygon.to_vec();
    while polygon.len() > 3 {
        let count = polygon.len();
        let added =
            |i: usize| area(&[polygon[(i + count - 1) % count], polygon[i], polygon[(i + 1) % count]]);
        let Some(corner) = (0..count).min_by(|&a, &b| added(a).total_cmp(&added(b))) else { break };
        if added(corner) > least {
            break;
        }
        polygon.remove(corner);
    }
    polygon
}

/// The part of a convex polygon that lies on a line's first side.
fn clipped(polygon: &[DVec2], line: Line) -> Vec<DVec2> {
    let mut part = Vec::with_capacity(polygon.len() + 1);
    clip(polygon, |corner| line.height(corner), |corner| part.push(corner));
    part
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Sequence, Stream, triangle_point};

    const CELL: [DVec2; 3] = [DVec2::ZERO, DVec2::new(2.0, 0.0), DVec2::new(0.0, 2.0)];

    /// Area of a piece as a share of the triangle's.
    fn area_share([a, b, c]: SubTriangle) -> f64 {
        f64::from((b.0 - a.0) * (c.1 - a.1) - (c.0 - a.0) * (b.1 - a.1))
    }

    fn cut(segments: &[[DVec2; 2]]) -> (BspTrees, Option<CutCell>) {
        let mut trees = BspTrees::new(MAX_LINES);
        let weights = DMat2::from_diagonal(DVec2::splat(0.5));
        let cell = trees.cut(CELL, segments, weights, (7, 100));
        (trees, cell)
    }

    fn segment(a: [f64; 2], b: [f64; 2]) -> [DVec2; 2] {
        [a.into(), b.into()]
    }

    #[test]
    fn pieces_make_up_the_cell_and_no_piece_lies_across_a_line() {
        // A wall, a corner of a crate, and pieces of a bent wall.
        let wall = vec![segment([-1.0, 0.3], [3.0, 0.5])];
        let crate_corner = vec![segment([0.6, 0.5], [0.6, 3.0]), segment([0.6, 0.5], [3.0, 0.5])];
        let bent_wall: Vec<[DVec2; 2]> = (0..40)
            .map(|i| f64::from(i) / 20.0)
            .map(|x| segment([x, 0.2 + 0.01 * x], [x + 0.05, 0.2 + 0.01 * (x + 0.05)]))
            .collect();
        for segments in [wall, crate_corner, bent_wall] {
            let (trees, cell) = cut(&segments);
            let cell = cell.expect("it is cut");
            assert!(cell.count >= 3 && trees.pieces.len() == cell.count as usize);
            let sum: f64 = trees.pieces.iter().map(|&piece| area_share(piece)).sum();
            assert!((sum - 1.0).abs() < 1e-6, "{sum}");
            let sequence = Sequence::new(1, Stream::Test(2), 3);
            for sample in 0..2000 {
                let [x, y, ..] = sequence.point(sample, 0);
                let (u, v) = triangle_point(x, y);
                let slot = trees.find(cell.root, u, v);
                let place = if slot == 7 { 0 } else { slot - 99 };
                let [a, b, c] = trees.pieces[place as usize];
                let inside =
                    |p: (f32, f32), q: (f32, f32)| (q.0 - p.0) * (v - p.1) - (q.1 - p.1) * (u - p.0) > -1e-5;
                assert!(inside(a, b) && inside(b, c) && inside(c, a), "{u} {v} in {slot}");
            }
            for [p, q] in &segments {
                let line = Line::through(*p, *q);
                for piece in &trees.pieces {
                    let corners = piece.map(|(u, v)| DVec2::new(f64::from(u), f64::from(v)) * 2.0);
                    let parts = [1.0, -1.0].map(|sign| {
                        area(&clipped(
                            &corners,
                            Line { normal: line.normal * sign, offset: line.offset * sign },
                        ))
                    });
                    let across = clip_segment(&corners, [*p, *q]).map_or(0.0, |[p, q]| p.distance(q));
                    let crossed = parts.iter().all(|&part| part > 0.01) && across > 0.1;
                    assert!(!crossed, "{piece:?} across {p} {q}");
                }
            }
        }
    }

    #[test]
    fn a_line_that_ends_on_the_border_leaves_no_piece_without_area() {
        // The lowest facets of a ball that stands on a floor, with the floor's tile in its plane's frame; found in a
        // model file.
        let corners = [
            DVec2::new(0.013020833721384406, 0.013020833721384406),
            DVec2::new(0.026041667442768812, 0.013020833721384406),
            DVec2::new(0.013020833721384406, 0.026041667442768812),
        ];
        let foot = segment([0.015625, 0.0234375], [0.005634784698486328, 0.014785677194595337]);
        let other = segment([0.005634784698486328, 0.03208932280540466], [0.015625, 0.0234375]);
        let weights = DMat2::from_diagonal(DVec2::splat(25.6));
        for segments in [vec![foot, other], vec![other, foot], vec![foot], vec![other]] {
            let mut trees = BspTrees::new(MAX_LINES);
            if trees.cut(corners, &segments, weights, (0, 1)).is_none() {
                continue;
            }
            let shares: Vec<f64> = trees.pieces.iter().map(|&piece| area_share(piece)).collect();
            let sum: f64 = shares.iter().sum();
            assert!(shares.iter().all(|&share| share > 1e-4 * sum), "{shares:?}");
            assert!((9.0 * sum - 1.0).abs() < 1e-4, "{sum}");
        }
    }

    #[test]
    fn a_cell_that_more_lines_cross_than_may_cut_it_is_counted() {
        let lines = |count: u32| -> Vec<[DVec2; 2]> {
            (1..=count)
                .map(|i| 1.2 * f64::from(i) / f64::from(count + 1))
                .map(|x| segment([x, -1.0], [x, 3.0]))
                .collect()
        };
        for (count, full) in [(MAX_LINES, 0), (MAX_LINES + 1, 1)] {
            let (trees, cell) = cut(&lines(count));
            assert!(
                cell.is_some_and(|cell| cell.count > MAX_LINES) && trees.full == full,
                "{count}: {}",
                trees.full
            );
        }
    }

    #[test]
    fn borders_and_short_contacts_cut_nothing() {
        for segments in [
            vec![segment([0.0, 0.0], [2.0, 0.0])],
            vec![segment([2.0, 0.0], [0.0, 2.0])],
            vec![segment([0.5, 0.5], [0.6, 0.5])],
            vec![segment([5.0, 0.0], [5.0, 2.0])],
            Vec::new(),
        ] {
            let (trees, cell) = cut(&segments);
            assert!(cell.is_none() && trees.pieces.is_empty(), "{segments:?}");
        }
    }
}
