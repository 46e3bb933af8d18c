//! What an eye has in view from each block of texels, and means over such views: so a room counts as a whole, however
//! large the level around it is. Not the light to which the eye adapts: that is `local_light`, whose walks find the
//! views.

use rayon::prelude::*;

use crate::coverage::{CoveredTexels, TexelGroups};

/// How often a mean over views is taken: the first has in it the chance of a few walks, the second is that of the room.
const STEPS: usize = 2;
/// The share of a block itself in the mean over its view.
const OWN_SHARE: f64 = 1.0 / 3.0;
/// The share of a level's texels that may be worse than what is called the level's worst view: cracks and the insides
/// of shelves, where no eye is.
const NEGLECTED_SHARE: f64 = 0.05;
/// The block of hidden texels, which nobody sees.
const UNSEEN: u32 = u32::MAX;
/// Of a block, as many blocks in view are kept as it has texels, but at least so many.
const MIN_KEPT: usize = 4;

/// What is in view from each block of texels.
#[derive(Clone, Debug, Default)]
pub(crate) struct Views {
    /// The block of each covered texel, or [`UNSEEN`].
    block_of: Vec<u32>,
    /// Per block, the number of its texels that are not hidden.
    texels: Vec<u32>,
    /// The blocks in view of all blocks, one block after the other, and where those of each block end.
    in_view: Vec<u32>,
    ends: Vec<usize>,
}

impl Views {
    /// From the blocks that were seen from each block, which may be listed more than once: the more often, the more of
    /// the view they fill.
    pub fn new(
        texels: &CoveredTexels<'_>,
        blocks: &TexelGroups,
        seen_from: impl Fn(usize) -> Vec<u32>,
    ) -> Self {
        let block_of = texels.list.iter().zip(&blocks.group_of);
        let block_of = block_of.map(|(texel, &block)| if texel.is_hidden() { UNSEEN } else { block });
        let mut views = Self { block_of: block_of.collect(), ..Self::default() };
        for (block, members) in blocks.members.iter().enumerate() {
            let seen = seen_from(block).into_iter().filter(|&seen| !blocks.members[seen as usize].is_empty());
            views.in_view.extend(seen.take(members.len().max(MIN_KEPT)));
            views.ends.push(views.in_view.len());
            views.texels.push(members.len() as u32);
        }
        views
    }

    /// The mean over the view from each block of a number per covered texel.
    pub fn means(&self, of_texels: &[f32]) -> Vec<f64> {
        let mut means = vec![0.0; self.texels.len()];
        for (&number, &block) in of_texels.iter().zip(&self.block_of) {
            if block != UNSEEN {
                means[block as usize] += f64::from(number);
            }
        }
        for (mean, &texels) in means.iter_mut().zip(&self.texels) {
            *mean /= f64::from(texels.max(1));
        }
        for _ in 0..STEPS {
            means = (0..means.len()).into_par_iter().map(|block| self.mean_in_view(block, &means)).collect();
        }
        means
    }

    /// The mean of a number per block over what is in view from one of them.
    fn mean_in_view(&self, block: usize, of_blocks: &[f64]) -> f64 {
        let begin = if block == 0 { 0 } else { self.ends[block - 1] };
        let in_view = &self.in_view[begin..self.ends[block]];
        let own = of_blocks[block];
        if in_view.is_empty() {
            return own;
        }
        let sum: f64 = in_view.iter().map(|&seen| of_blocks[seen as usize]).sum();
        OWN_SHARE * own + (1.0 - OWN_SHARE) * sum / in_view.len() as f64
    }

    /// The largest number per block that counts, for views of [`NEGLECTED_SHARE`] of the texels may have a larger one;
    /// 0 where no texel is seen.
    pub fn worst(&self, of_blocks: &[f64]) -> f64 {
        let mut seen: Vec<usize> = (0..of_blocks.len()).filter(|&block| self.texels[block] > 0).collect();
        seen.sort_by(|&a, &b| of_blocks[b].total_cmp(&of_blocks[a]));
        let texels = |block: usize| f64::from(self.texels[block]);
        let mut neglected = NEGLECTED_SHARE * seen.iter().map(|&block| texels(block)).sum::<f64>();
        let worst = seen.into_iter().find(|&block| {
            neglected -= texels(block);
            neglected < 0.0
        });
        worst.map_or(0.0, |block| of_blocks[block])
    }

    /// The sum of a number per covered texel over those that are seen.
    pub fn sum(&self, of_texels: &[f32]) -> f64 {
        let seen = of_texels.iter().zip(&self.block_of).filter(|(_, block)| **block != UNSEEN);
        seen.map(|(&number, _)| f64::from(number)).sum()
    }

    /// The largest of the blocks' numbers that [`Views::worst`] counts, and all smaller ones, each with its number of
    /// texels.
    pub fn counted<'a>(&'a self, of_blocks: &'a [f64]) -> impl Iterator<Item = (usize, f64)> + 'a {
        let worst = self.worst(of_blocks);
        let counted = (0..of_blocks.len()).filter(move |&block| of_blocks[block] <= worst);
        counted.map(|block| (block, f64::from(self.texels[block])))
    }

    /// The number of texels that are seen; at least 1, as it is divided by.
    pub fn seen_texels(&self) -> f64 {
        self.texels.iter().map(|&texels| f64::from(texels)).sum::<f64>().max(1.0)
    }

    /// Per covered texel, the share in (0, 1] of its squared error in `squares` that may be left. What the worst view
    /// needs is enough for those that are neglected. What is in view of each other is taken to need the same: a block's
    /// own view decides what it needs.
    pub fn shares(&self, left: &SharesLeft<'_>, squares: &[f32]) -> Vec<f32> {
        let SharesLeft { of_blocks, of_whole, least } = *left;
        let least_share = least as f32;
        let needs: Vec<f64> = of_blocks.iter().map(|share| share.recip()).collect();
        let least = self.worst(&needs).max(1.0).recip();
        let share_of = |&block: &u32| match block {
            UNSEEN => 1.0,
            block => of_blocks[block as usize].max(least) as f32,
        };
        let mut shares: Vec<f32> = self.block_of.par_iter().map(share_of).collect();
        let left: Vec<f32> = squares.par_iter().zip(&shares).map(|(square, share)| square * share).collect();
        let scale = of_whole * self.sum(squares) / self.sum(&left).max(f64::MIN_POSITIVE);
        if scale < 1.0 {
            shares.par_iter_mut().for_each(|share| *share = (*share * scale as f32).max(least_share));
        }
        shares
    }
}

/// Which shares of squared errors may be left, each in (0, 1].
#[derive(Clone, Copy, Debug)]
pub(crate) struct SharesLeft<'a> {
    /// Of that in the view from each block.
    pub of_blocks: &'a [f64],
    /// At most so much of the whole level's.
    pub of_whole: f64,
    /// At least so much of each texel's.
    pub least: f64,
}

/// Squared errors relative to local light, in the whole level and in the view from each block of texels.
pub(crate) struct ErrorsInViews<'a> {
    views: &'a Views,
    squares: &'a [f32],
    /// The sum over the whole level.
    sum: f64,
    /// The mean in the view from each block.
    in_views: Vec<f64>,
}

impl<'a> ErrorsInViews<'a> {
    /// `squares` has a number per covered texel.
    pub fn new(views: &'a Views, squares: &'a [f32]) -> Self {
        Self { views, squares, sum: views.sum(squares), in_views: views.means(squares) }
    }

    /// The sum over the whole level, and what it would be if all of it were like the worst view.
    pub fn sums(&self) -> [f64; 2] {
        [self.sum, self.views.worst(&self.in_views) * self.views.seen_texels()]
    }

    /// Per covered texel, the share in (0, 1] of its squared error that may be left so that they reach the goal, and at
    /// least the `least` share.
    pub fn shares(&self, goal: f64, least: f64) -> Vec<f32> {
        let share = |square: f64, goal: f64| (goal / square.max(f64::MIN_POSITIVE)).clamp(least, 1.0);
        let per_texel = goal / self.views.seen_texels();
        let of_blocks: Vec<f64> = self.in_views.iter().map(|&square| share(square, per_texel)).collect();
        let left = SharesLeft { of_blocks: &of_blocks, of_whole: share(self.sum, goal), least };
        self.views.shares(&left, self.squares)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two rooms of two blocks each that see each other, of 97 and 3 texels, and a hidden texel.
    fn two_rooms() -> Views {
        let block_of = [vec![0; 60], vec![1; 37], vec![2; 2], vec![3; 1], vec![UNSEEN]].concat();
        Views { block_of, texels: vec![60, 37, 2, 1], in_view: vec![1, 0, 3, 2], ends: vec![1, 2, 3, 4] }
    }

    #[test]
    fn a_mean_over_a_view_is_that_of_its_room_alone() {
        let views = two_rooms();
        let dark_and_bright: Vec<f32> =
            [vec![1.0; 60], vec![4.0; 37], vec![100.0; 3], vec![f32::NAN]].concat();
        let means = views.means(&dark_and_bright);
        // One step: (1/3) 1 + (2/3) 4 = 3 and (1/3) 4 + (2/3) 1 = 2; then the same again.
        for (mean, expected) in means.iter().zip([7.0 / 3.0, 8.0 / 3.0, 100.0, 100.0]) {
            assert!((mean - expected).abs() < 1e-12 * expected, "{means:?}");
        }
        // The small room has 3 % of the texels.
        assert_eq!(views.worst(&means), means[1]);
        let larger = Views { texels: vec![60, 37, 4, 2], ..views.clone() };
        assert_eq!(larger.worst(&means), means[2]);
        assert_eq!(Views::default().worst(&[]), 0.0);
    }

    #[test]
    fn every_view_that_counts_and_the_whole_reach_the_goal() {
        let mut views = two_rooms();
        views.texels = vec![60, 33, 4, 3];
        views.block_of = [vec![0; 60], vec![1; 33], vec![2; 4], vec![3; 3], vec![UNSEEN]].concat();
        let squares: Vec<f32> = [vec![1.0; 93], vec![100.0; 7], vec![f32::NAN]].concat();
        let errors = ErrorsInViews::new(&views, &squares);
        assert_eq!(errors.sums(), [793.0, 10_000.0]);
        // A goal of 2 per texel: the large room is below it, the small one is to keep a fiftieth.
        let shares = errors.shares(200.0, 0.0);
        assert_eq!((shares[0], shares[99], shares[100]), (1.0, 0.02, 1.0));
        assert_eq!(errors.shares(200.0, 0.125)[99], 0.125);
        // A goal below what is left then: all keep less.
        let shares = errors.shares(50.0, 0.0);
        let left =
            views.sum(&shares.iter().zip(&squares).map(|(share, square)| share * square).collect::<Vec<_>>());
        assert!((left - 50.0).abs() < 1e-4 * left, "{left}");
    }
}
