//! A bounding volume hierarchy in f64 for box queries on triangles. Ray casting is in `lumbre_rays`.

use glam::DVec3;

/// Triangles per leaf.
const LEAF: usize = 4;

/// The triangles of a level, for queries by box.
#[derive(Clone, Debug, Default)]
pub struct TriangleTree {
    triangles: Vec<[DVec3; 3]>,
    nodes: Vec<Node>,
}

/// The bounding box of a range of triangles. The first child of an inner node directly follows it.
#[derive(Clone, Copy, Debug)]
struct Node {
    min: DVec3,
    max: DVec3,
    first: usize,
    count: usize,
    /// Index of the second child, 0 in a leaf.
    second: usize,
}

impl TriangleTree {
    /// Builds the hierarchy over triangles in metres. Triangles with a corner that is not finite or without
    /// area are left out.
    pub fn build(triangles: impl IntoIterator<Item = [DVec3; 3]>) -> Self {
        let solid = |t: &[DVec3; 3]| {
            t.iter().all(|corner| corner.is_finite())
                && (t[1] - t[0]).cross(t[2] - t[0]).length_squared() > 0.0
        };
        let mut tree = Self { triangles: triangles.into_iter().filter(solid).collect(), nodes: Vec::new() };
        if !tree.triangles.is_empty() {
            tree.split(0, tree.triangles.len());
        }
        tree
    }

    /// Returns the number of triangles.
    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// Returns true if there are no triangles.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Returns the corners of the bounding box of all triangles, if there are any.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        self.nodes.first().map(|node| (node.min, node.max))
    }

    /// Calls `visit` for every triangle whose bounding box touches the box, in a fixed order.
    pub fn for_each_in_box(&self, min: DVec3, max: DVec3, mut visit: impl FnMut(&[DVec3; 3])) {
        let touches = |low: DVec3, high: DVec3| low.cmple(max).all() && high.cmpge(min).all();
        let mut index = 0;
        let mut postponed = Vec::new();
        loop {
            if let Some(node) = self.nodes.get(index).filter(|node| touches(node.min, node.max)) {
                if node.second > 0 {
                    postponed.push(node.second);
                    index += 1;
                    continue;
                }
                for triangle in &self.triangles[node.first..node.first + node.count] {
                    let (low, high) = box_around(triangle);
                    if touches(low, high) {
                        visit(triangle);
                    }
                }
            }
            match postponed.pop() {
                Some(next) => index = next,
                None => return,
            }
        }
    }

    /// Splits at the median of the longest axis. Half of the triangles go to each side, so that the depth is
    /// logarithmic whatever the triangles are.
    fn split(&mut self, first: usize, count: usize) {
        let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for triangle in &self.triangles[first..first + count] {
            let (low, high) = box_around(triangle);
            (min, max) = (min.min(low), max.max(high));
        }
        let index = self.nodes.len();
        self.nodes.push(Node { min, max, first, count, second: 0 });
        if count <= LEAF {
            return;
        }
        let axis = (max - min).max_position();
        let middle = count / 2;
        let key = |t: &[DVec3; 3]| t[0][axis] + t[1][axis] + t[2][axis];
        self.triangles[first..first + count].select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)));
        self.split(first, middle);
        self.nodes[index].second = self.nodes.len();
        self.split(first + middle, count - middle);
    }
}

fn box_around(triangle: &[DVec3; 3]) -> (DVec3, DVec3) {
    let [a, b, c] = *triangle;
    (a.min(b).min(c), a.max(b).max(c))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_what_a_search_through_all_finds() {
        // A deterministic scatter of triangles, from a linear congruential generator.
        let mut state = 1u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1 << 24)
        };
        let triangles: Vec<[DVec3; 3]> = (0..500)
            .map(|_| {
                let at = DVec3::new(next(), next(), next()) * 20.0;
                [at, at + DVec3::new(next(), next(), next()), at + DVec3::new(next(), next(), next())]
            })
            .collect();
        let tree = TriangleTree::build(triangles.iter().copied());
        let mut found_any = 0;
        for _ in 0..100 {
            let min = DVec3::new(next(), next(), next()) * 20.0;
            let max = min + DVec3::new(next(), next(), next()) * 8.0;
            let mut expected: Vec<_> = triangles
                .iter()
                .filter(|t| box_around(t).0.cmple(max).all() && box_around(t).1.cmpge(min).all())
                .map(|t| t[0].x.to_bits())
                .collect();
            let mut found = Vec::new();
            tree.for_each_in_box(min, max, |t| found.push(t[0].x.to_bits()));
            found_any += found.len();
            expected.sort_unstable();
            found.sort_unstable();
            assert_eq!(found, expected);
        }
        assert!(found_any > 100);
    }

    #[test]
    fn what_has_no_area_is_left_out() {
        let nan = [DVec3::NAN, DVec3::X, DVec3::Y];
        let line = [DVec3::ZERO, DVec3::X, DVec3::X * 2.0];
        let tree = TriangleTree::build([nan, line]);
        assert!(tree.is_empty() && tree.bounds().is_none());
        tree.for_each_in_box(DVec3::NEG_INFINITY, DVec3::INFINITY, |_| panic!("nothing is there"));
        assert_eq!(TriangleTree::build([[DVec3::ZERO, DVec3::X, DVec3::Y]]).len(), 1);
    }
}
