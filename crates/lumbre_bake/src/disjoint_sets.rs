//! Disjoint sets: union-find with path halving (Tarjan and van Leeuwen, "Worst-case analysis of set union algorithms",
//! 1984). A set is represented by its least member, in whatever order sets were joined, so that results do not depend
//! on that order. (petgraph's `UnionFind` represents sets by rank.)

/// A partition of the members 0..n into sets.
#[derive(Clone, Debug, Default)]
pub(crate) struct DisjointSets {
    parent: Vec<u32>,
}

impl DisjointSets {
    /// Sets of one member each.
    pub fn new(count: usize) -> Self {
        Self { parent: (0..count as u32).collect() }
    }

    /// Adds a member in a set of its own, and returns it.
    pub fn push(&mut self) -> u32 {
        self.parent.push(self.parent.len() as u32);
        self.parent.len() as u32 - 1
    }

    /// The least member of a member's set.
    pub fn find(&mut self, mut member: u32) -> u32 {
        while self.parent[member as usize] != member {
            let grandparent = self.parent[self.parent[member as usize] as usize];
            self.parent[member as usize] = grandparent;
            member = grandparent;
        }
        member
    }

    /// Joins the sets of two members, and returns the least member of the result.
    pub fn join(&mut self, a: u32, b: u32) -> u32 {
        let (a, b) = (self.find(a), self.find(b));
        self.parent[a.max(b) as usize] = a.min(b);
        a.min(b)
    }

    /// The least member of every member's set.
    pub fn into_sets(mut self) -> Vec<u32> {
        (0..self.parent.len() as u32).map(|member| self.find(member)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_is_represented_by_its_least_member_in_any_order() {
        let pairs = [(7, 3), (3, 9), (2, 4), (9, 8), (5, 5)];
        for forward in [true, false] {
            let mut sets = DisjointSets::new(9);
            assert_eq!(sets.push(), 9);
            let mut join = |(a, b): (u32, u32)| sets.join(a, b);
            match forward {
                true => pairs.into_iter().map(&mut join).for_each(drop),
                false => pairs.into_iter().rev().map(&mut join).for_each(drop),
            }
            assert_eq!(sets.into_sets(), [0, 1, 2, 3, 2, 5, 6, 3, 3, 3]);
        }
    }
}
