//! Rooms carved out of solid rock: boxes of air, boxes of matter within them, and the surface between.
//! Furniture is added by the rooms.
//!
//! The surface of a union of boxes is closed whatever the boxes are, and all of it lies on one grid, so that
//! no light leaks through a seam and there are no T-junctions.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};
use lumbre_mesh::TriangleMesh;

use super::paint::Paint;

/// The paints of the six sides of a box of air.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Finish {
    /// The side below.
    pub floor: Paint,
    /// The side above.
    pub ceiling: Paint,
    /// The sides towards -x, +x, -z and +z.
    pub walls: [Paint; 4],
}

impl Finish {
    /// Creates a finish with the same paint on all four walls.
    pub fn new(floor: Paint, ceiling: Paint, walls: Paint) -> Self {
        Self { floor, ceiling, walls: [walls; 4] }
    }

    /// Returns the paint at the negative (false) or positive end of an axis.
    fn towards(&self, axis: usize, positive: bool) -> Paint {
        match (axis, positive) {
            (0, _) => self.walls[usize::from(positive)],
            (1, false) => self.floor,
            (1, true) => self.ceiling,
            _ => self.walls[2 + usize::from(positive)],
        }
    }
}

/// A box of air. Where two boxes overlap, the later one decides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Air {
    /// The room that it belongs to.
    pub room: &'static str,
    /// Smallest corner, metres.
    pub min: DVec3,
    /// Largest corner, metres.
    pub max: DVec3,
    /// The paints of its sides.
    pub finish: Finish,
}

/// A box of matter inside the air, such as a step, a podium or a beam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Matter {
    /// Smallest corner, metres.
    pub min: DVec3,
    /// Largest corner, metres.
    pub max: DVec3,
    /// The paint of its sides.
    pub paint: Paint,
}

/// The boxes that make up a level.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plan {
    /// Rooms, doorways and windows.
    pub air: Vec<Air>,
    /// Matter inside the air.
    pub matter: Vec<Matter>,
}

/// The contents of a grid cell.
#[derive(Clone, Copy, PartialEq)]
enum Cell {
    Rock,
    Air(usize),
    Matter(usize),
}

impl Plan {
    /// Returns true if a point is in air.
    #[cfg(test)]
    pub fn is_air(&self, point: DVec3) -> bool {
        matches!(self.fill(point), Cell::Air(_))
    }

    /// Builds the surface from rectangles with edges of at most `spacing` metres: one mesh per room and
    /// paint.
    pub fn surface(&self, spacing: f64) -> BTreeMap<(&'static str, Paint), TriangleMesh> {
        let lines: [Vec<f64>; 3] = std::array::from_fn(|axis| self.lines(axis, spacing));
        let counts: [usize; 3] = std::array::from_fn(|axis| lines[axis].len().saturating_sub(1));
        let middle = |axis: usize, at: usize| 0.5 * (lines[axis][at] + lines[axis][at + 1]);
        let mut cells = Vec::with_capacity(counts.iter().product());
        for z in 0..counts[2] {
            for y in 0..counts[1] {
                for x in 0..counts[0] {
                    cells.push(self.fill(DVec3::new(middle(0, x), middle(1, y), middle(2, z))));
                }
            }
        }
        let cell = |at: [isize; 3]| {
            let inside = (0..3).all(|axis| (0..counts[axis] as isize).contains(&at[axis]));
            let index = (at[2] * counts[1] as isize + at[1]) * counts[0] as isize + at[0];
            if inside { cells[index as usize] } else { Cell::Rock }
        };
        let mut pieces: BTreeMap<(&'static str, Paint), Piece> = BTreeMap::new();
        for z in 0..counts[2] {
            for y in 0..counts[1] {
                for x in 0..counts[0] {
                    let at = [x as isize, y as isize, z as isize];
                    let Cell::Air(air) = cell(at) else { continue };
                    for axis in 0..3 {
                        for positive in [false, true] {
                            let mut beyond = at;
                            beyond[axis] += if positive { 1 } else { -1 };
                            let paint = match cell(beyond) {
                                Cell::Air(_) => continue,
                                Cell::Matter(matter) => self.matter[matter].paint,
                                Cell::Rock => self.air[air].finish.towards(axis, positive),
                            };
                            let piece = pieces.entry((self.air[air].room, paint)).or_default();
                            piece.rectangle(&lines, [x, y, z], axis, positive, paint.tile());
                        }
                    }
                }
            }
        }
        pieces.into_iter().map(|(key, piece)| (key, piece.mesh)).collect()
    }

    fn fill(&self, point: DVec3) -> Cell {
        let holds = |min: DVec3, max: DVec3| min.cmple(point).all() && point.cmple(max).all();
        if let Some(matter) = self.matter.iter().rposition(|one| holds(one.min, one.max)) {
            return Cell::Matter(matter);
        }
        self.air.iter().rposition(|one| holds(one.min, one.max)).map_or(Cell::Rock, Cell::Air)
    }

    /// Returns the grid's coordinates along an axis: the sides of all boxes, with equal divisions between
    /// them.
    fn lines(&self, axis: usize, spacing: f64) -> Vec<f64> {
        let air = self.air.iter().flat_map(|one| [one.min[axis], one.max[axis]]);
        let matter = self.matter.iter().flat_map(|one| [one.min[axis], one.max[axis]]);
        let mut sides: Vec<f64> = air.chain(matter).collect();
        sides.sort_by(f64::total_cmp);
        sides.dedup_by(|a, b| (*a - *b).abs() < 1e-6);
        let mut lines = Vec::new();
        for pair in sides.windows(2) {
            // The tolerance of a millionth prevents rounding from dividing 3 m by 0.5 m into seven parts.
            let parts = ((pair[1] - pair[0]) / spacing - 1e-6).ceil().max(1.0);
            lines.extend((0..parts as usize).map(|part| pair[0] + (pair[1] - pair[0]) * part as f64 / parts));
        }
        lines.extend(sides.last());
        lines
    }
}

/// A mesh under construction, with its vertices by grid point and side.
#[derive(Default)]
struct Piece {
    mesh: TriangleMesh,
    vertices: BTreeMap<([usize; 3], usize, bool), u32>,
}

impl Piece {
    /// Adds one side of a cell, facing into the cell.
    fn rectangle(&mut self, lines: &[Vec<f64>; 3], cell: [usize; 3], axis: usize, positive: bool, tile: f64) {
        // The normal points into the cell, so on its positive side it is negative.
        let normal = DVec3::AXES[axis] * if positive { -1.0 } else { 1.0 };
        let up = if axis == 1 { DVec3::NEG_Z * normal.y } else { DVec3::Y };
        let right = up.cross(normal);
        let mut corner = |along_right: bool, along_up: bool| {
            let mut point = cell;
            point[axis] += usize::from(positive);
            for (direction, far) in [(right, along_right), (up, along_up)] {
                let (axis, sign) = axis_of(direction);
                point[axis] += usize::from(far == (sign > 0.0));
            }
            *self.vertices.entry((point, axis, positive)).or_insert_with(|| {
                let position = DVec3::from_array(std::array::from_fn(|axis| lines[axis][point[axis]]));
                self.mesh.positions.push(position.as_vec3());
                self.mesh.normals.push(normal.as_vec3());
                let uv = DVec2::new(position.dot(right), -position.dot(up)) / tile;
                self.mesh.uv0.push(uv.as_vec2());
                self.mesh.positions.len() as u32 - 1
            })
        };
        let [a, b, c, d] =
            [corner(false, false), corner(true, false), corner(true, true), corner(false, true)];
        // The diagonals alternate, so that interpolation over the triangles has no preferred direction.
        let even = cell.iter().sum::<usize>().is_multiple_of(2);
        self.mesh.indices.extend(if even { [a, b, c, a, c, d] } else { [a, b, d, b, c, d] });
    }
}

fn axis_of(direction: DVec3) -> (usize, f64) {
    let axis = direction.abs().max_position();
    (axis, direction[axis])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn room(min: [f64; 3], max: [f64; 3]) -> Air {
        let finish = Finish::new(Paint::Planks, Paint::White, Paint::Red);
        Air { room: "room", min: DVec3::from_array(min), max: DVec3::from_array(max), finish }
    }

    fn two_rooms() -> Plan {
        let air = vec![
            room([0.0, 0.0, 0.0], [4.0, 3.0, 4.0]),
            room([4.0, 0.0, 1.4], [4.5, 2.2, 2.6]),
            room([4.5, 0.0, 0.0], [7.0, 3.0, 3.0]),
        ];
        let podium = Matter { min: DVec3::ZERO, max: DVec3::new(1.0, 0.5, 1.0), paint: Paint::Stone };
        Plan { air, matter: vec![podium] }
    }

    /// Returns the area of a surface that is seen from inside, and the volume that it encloses.
    fn measure(surface: &BTreeMap<(&'static str, Paint), TriangleMesh>) -> (f64, f64) {
        let (mut area, mut volume) = (0.0, 0.0);
        for mesh in surface.values() {
            for triangle in mesh.triangles() {
                let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize].as_dvec3());
                area += (b - a).cross(c - a).length();
                volume -= a.dot(b.cross(c));
            }
        }
        (0.5 * area, volume / 6.0)
    }

    #[test]
    fn encloses_exactly_the_air() {
        let (area, volume) = measure(&two_rooms().surface(0.5));
        // Two rooms and a doorway, without the podium. Positions are f32, accurate to 10⁻⁶ of 50 m³.
        let expected = 48.0 + 0.5 * 2.2 * 1.2 + 2.5 * 3.0 * 3.0 - 0.5;
        assert!((volume - expected).abs() < 1e-4, "{volume} for {expected}");
        let rooms = 2.0 * (16.0 + 12.0 + 12.0) + 2.0 * (7.5 + 7.5 + 9.0);
        // The podium's two visible sides and its top replace parts of two walls and of the floor of the same
        // area.
        let doorway = 2.0 * 0.5 * (1.2 + 2.2) - 2.0 * 1.2 * 2.2;
        assert!((area - rooms - doorway).abs() < 1e-4, "{area}");
    }

    #[test]
    fn is_closed_and_without_vertices_inside_edges() {
        // In a closed surface every edge occurs equally often in both directions, compared by position.
        let mut edges = BTreeMap::new();
        for mesh in two_rooms().surface(0.5).values() {
            for [a, b, c] in mesh.triangles() {
                for (from, to) in [(a, b), (b, c), (c, a)] {
                    let key = |vertex: u32| mesh.positions[vertex as usize].to_array().map(f32::to_bits);
                    *edges.entry((key(from), key(to))).or_insert(0) += 1;
                }
            }
        }
        for ((from, to), count) in &edges {
            assert_eq!(edges.get(&(*to, *from)), Some(count));
        }
        assert!(edges.len() > 1000);
    }

    #[test]
    fn triangles_face_their_normals_and_wear_their_paint() {
        let surface = two_rooms().surface(0.5);
        for ((_, paint), mesh) in &surface {
            for triangle in mesh.triangles() {
                let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize]);
                let normal = mesh.normals[triangle[0] as usize];
                assert!((b - a).cross(c - a).normalize().distance(normal) < 1e-5);
                match paint {
                    Paint::Planks => assert_eq!(normal, glam::Vec3::Y),
                    Paint::White => assert_eq!(normal, glam::Vec3::NEG_Y),
                    Paint::Red => assert_eq!(normal.y, 0.0),
                    _ => assert!(a.x <= 1.0 && a.z <= 1.0),
                }
            }
        }
        assert_eq!(surface.len(), 4);
    }

    #[test]
    fn says_where_air_is() {
        let plan = two_rooms();
        assert!(plan.is_air(DVec3::new(4.2, 1.0, 2.0)) && plan.is_air(DVec3::new(2.0, 1.0, 2.0)));
        assert!(!plan.is_air(DVec3::new(4.2, 1.0, 0.5)) && !plan.is_air(DVec3::new(0.5, 0.2, 0.5)));
    }
}
