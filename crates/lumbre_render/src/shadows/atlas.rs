//! The layout of a frame's shadow maps in one square texture: the side of each map follows from what its
//! light contributes to the picture, and maps are packed without gaps.

/// Largest side of a map at the default resolution, and smallest side at any resolution, in texels.
pub(super) const MOST: u32 = 1024;
pub(super) const LEAST: u32 = 64;

/// The place of a map in the atlas, in texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Tile {
    pub x: u32,
    pub y: u32,
    /// A power of two.
    pub side: u32,
}

/// Packs maps that want these sides, clamped to `most`. Returns the side of the atlas, at most `limit`, and
/// the tiles. If the maps do not fit, all sides are halved, down to [`LEAST`]. Maps at the end of the list
/// that still do not fit get no tile.
pub(super) fn pack(wanted: &[f64], most: f64, limit: u32) -> (u32, Vec<Option<Tile>>) {
    let limit = if limit.is_power_of_two() { limit } else { limit.next_power_of_two() / 2 };
    let mut sides: Vec<u32> =
        wanted.iter().map(|side| power_of_two(*side, most.min(f64::from(limit)))).collect();
    let area = |sides: &[u32]| sides.iter().map(|side| u64::from(*side).pow(2)).sum::<u64>();
    while area(&sides) > u64::from(limit).pow(2) && sides.iter().any(|side| *side > LEAST) {
        sides.iter_mut().for_each(|side| *side = (*side / 2).max(LEAST));
    }
    let mut atlas = sides.iter().copied().max().unwrap_or(LEAST);
    while area(&sides) > u64::from(atlas).pow(2) && atlas < limit {
        atlas *= 2;
    }
    // Largest first along a Z-order curve, so that each tile begins at a multiple of its own size.
    let mut order: Vec<usize> = (0..sides.len()).collect();
    order.sort_by_key(|index| (std::cmp::Reverse(sides[*index]), *index));
    let mut tiles = vec![None; sides.len()];
    let mut used = 0;
    for index in order {
        let side = sides[index];
        let cells = u64::from(side / LEAST).pow(2);
        if used + cells > u64::from(atlas / LEAST).pow(2) {
            continue;
        }
        let (x, y) = z_order(used);
        tiles[index] = Some(Tile { x: x * LEAST, y: y * LEAST, side });
        used += cells;
    }
    (atlas, tiles)
}

fn power_of_two(side: f64, most: f64) -> u32 {
    // NaN becomes the smallest side.
    let side = side.max(f64::from(LEAST)).min(most.max(f64::from(LEAST)));
    1 << (side.log2().round() as u32)
}

/// Returns column and row of a cell on the Z-order curve.
fn z_order(cell: u64) -> (u32, u32) {
    let every_second = |bits: u64| (0..32).map(|bit| ((bits >> (2 * bit) & 1) as u32) << bit).sum();
    (every_second(cell), every_second(cell >> 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_lie_in_the_atlas_and_never_upon_each_other() {
        let wanted: Vec<f64> = (0..60).map(|number| f64::from(37 * number % 900) + 40.0).collect();
        for limit in [512, 1024, 4096] {
            let (side, tiles) = pack(&wanted, f64::from(MOST), limit);
            assert!(side <= limit && side.is_power_of_two());
            let placed: Vec<Tile> = tiles.iter().flatten().copied().collect();
            for (index, a) in placed.iter().enumerate() {
                assert!(a.x + a.side <= side && a.y + a.side <= side, "{a:?} in {side}");
                for b in &placed[..index] {
                    let apart = a.x >= b.x + b.side
                        || b.x >= a.x + a.side
                        || a.y >= b.y + b.side
                        || b.y >= a.y + a.side;
                    assert!(apart, "{a:?} {b:?}");
                }
            }
            // An atlas of 512 texels has room for 64 tiles of the smallest size.
            assert_eq!(placed.len(), 60, "in {limit}");
        }
        let (_, tiles) = pack(&[2000.0; 70], f64::from(MOST), 512);
        assert_eq!(tiles.iter().flatten().count(), 64);
        assert!(tiles[63].is_some() && tiles[64].is_none());
    }

    #[test]
    fn an_atlas_is_no_larger_than_its_maps() {
        assert_eq!(pack(&[256.0], f64::from(MOST), 4096), (256, vec![Some(Tile { x: 0, y: 0, side: 256 })]));
        assert_eq!(pack(&[1000.0, 512.0], f64::from(MOST), 4096).0, 2048);
        assert_eq!(pack(&[f64::NAN], f64::from(MOST), 4096).1[0].map(|tile| tile.side), Some(LEAST));
    }
}
