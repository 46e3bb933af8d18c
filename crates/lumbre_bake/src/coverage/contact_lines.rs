//! The lines along which other surfaces touch what the texels of a map show, and which places they separate: what
//! stands on a floor, or a wall that ends at it, so that light on one side of such a line says nothing about the other.
//! Not how they are found: that is `visibility::contacts`.

use glam::{DVec2, Vec2};

use crate::scene::MapLayout;
use crate::texel_index::MapTexel;

/// Contact lines by texel.
#[derive(Clone, Debug, Default)]
pub(crate) struct ContactLines(Vec<(MapTexel, [DVec2; 2])>);

/// By how much of its length a line counts as longer at each of its ends, so that nothing slips through between the
/// lines of two adjacent texels.
const OVERLAP: f64 = 1e-3;

impl ContactLines {
    /// From pairs of a texel and a line's segment in the texel's unit square, ordered by texel.
    pub fn new(lines: Vec<(MapTexel, [DVec2; 2])>) -> Self {
        debug_assert!(lines.is_sorted_by_key(|(texel, _)| *texel), "texels are found by binary search");
        Self(lines)
    }

    /// Bytes that the lines take.
    pub fn bytes(&self) -> u64 {
        size_of_val(&self.0[..]) as u64
    }

    /// All lines, ordered by texel.
    pub fn iter(&self) -> impl Iterator<Item = &(MapTexel, [DVec2; 2])> {
        self.0.iter()
    }

    /// Returns true if a line crosses the segment between two places of a map, in texels.
    pub fn separate(&self, map: &MapLayout, [from, to]: [Vec2; 2]) -> bool {
        let (low, high) = (from.min(to).max(Vec2::ZERO).as_uvec2(), from.max(to).max(Vec2::ZERO).as_uvec2());
        (low.y..=high.y.min(map.height - 1)).any(|y| {
            let (first, last) = (map.texel(low.x, y), map.texel(high.x.min(map.width - 1), y));
            self.in_row(first, last).any(|&(texel, line)| {
                let corner = DVec2::new(f64::from(low.x + texel.0 - first.0), f64::from(y));
                cross(line, [from, to].map(|place| place.as_dvec2() - corner))
            })
        })
    }

    /// The lines in a texel, each as a segment in its unit square.
    pub fn in_texel(&self, texel: MapTexel) -> impl Iterator<Item = [DVec2; 2]> {
        self.in_row(texel, texel).map(|(_, line)| *line)
    }

    /// The lines in the texels of a row of a map, from the first to the last.
    fn in_row(&self, first: MapTexel, last: MapTexel) -> impl Iterator<Item = &(MapTexel, [DVec2; 2])> {
        let start = self.0.partition_point(|(texel, _)| *texel < first);
        self.0[start..].iter().take_while(move |(texel, _)| *texel <= last)
    }
}

/// Returns true if a line, which is a little longer than stated, crosses a segment.
fn cross([a, b]: [DVec2; 2], [from, to]: [DVec2; 2]) -> bool {
    let (along, segment) = (b - a, to - from);
    let determinant = along.perp_dot(segment);
    let (on_line, on_segment) = ((from - a).perp_dot(segment), (from - a).perp_dot(along));
    if determinant == 0.0 {
        return false;
    }
    let (on_line, on_segment) = (on_line / determinant, on_segment / determinant);
    (-OVERLAP..=1.0 + OVERLAP).contains(&on_line) && (0.0..=1.0).contains(&on_segment)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wall_separates_what_lies_on_its_two_sides() {
        let map = MapLayout { width: 8, height: 8, ..MapLayout::default() };
        // A wall along x = 3.25 from y = 0 to y = 4.
        let line = [DVec2::new(0.25, 0.0), DVec2::new(0.25, 1.0)];
        let lines = ContactLines::new((0..4).map(|y| (map.texel(3, y), line)).collect());
        let separate = |from: [f32; 2], to: [f32; 2]| lines.separate(&map, [from.into(), to.into()]);
        assert!(separate([2.5, 1.5], [3.5, 1.5]) && separate([3.5, 1.5], [2.5, 1.5]));
        assert!(separate([3.1, 2.9], [4.6, 3.3]), "across a border between two texels");
        assert!(!separate([2.5, 1.5], [3.2, 1.5]) && !separate([3.5, 1.5], [5.5, 3.5]), "on one side");
        assert!(!separate([2.5, 5.5], [4.5, 5.5]), "beyond the wall's end");
        assert!(!separate([2.0, 1.0], [2.0, 1.0]), "no segment at all");
    }
}
