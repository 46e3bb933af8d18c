//! Packing rectangles of any sizes: none overlap, and none exceed their page.

use lumbre_mesh::atlas::{Atlas, AtlasError, AtlasOptions, pack};
use proptest::prelude::*;

fn sound(rectangles: &[(u32, u32)], options: AtlasOptions, atlas: &Atlas) -> Result<(), String> {
    for (i, (&(w, h), p)) in rectangles.iter().zip(&atlas.placements).enumerate() {
        if w == 0 || h == 0 {
            continue;
        }
        let page = atlas.pages[p.page as usize];
        if p.x + w > page.0 || p.y + h > page.1 {
            return Err(format!("{i} leaves its page"));
        }
        for (j, (&(v, g), q)) in rectangles.iter().zip(&atlas.placements).enumerate().take(i) {
            let apart = p.x + w + options.gap <= q.x
                || q.x + v + options.gap <= p.x
                || p.y + h + options.gap <= q.y
                || q.y + g + options.gap <= p.y;
            if p.page == q.page && v > 0 && g > 0 && !apart {
                return Err(format!("{j} and {i} are too close"));
            }
        }
    }
    if atlas.pages.iter().any(|page| page.0 > options.max_width || page.1 > options.max_height) {
        return Err("a page is too large".into());
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_overlap(
        rectangles in proptest::collection::vec((0u32..70, 0u32..70), 0..120),
        gap in 0u32..5,
        max_width in 69u32..400,
        max_height in 69u32..400,
    ) {
        let options = AtlasOptions { max_width, max_height, gap };
        let atlas = pack(&rectangles, options).unwrap();
        prop_assert_eq!(sound(&rectangles, options, &atlas), Ok(()));
        prop_assert_eq!(&atlas, &pack(&rectangles, options).unwrap());
    }
}

#[test]
fn the_check_sees_a_gap_that_is_too_small() {
    let options = AtlasOptions { max_width: 64, max_height: 64, gap: 1 };
    let rectangles = [(10, 10), (10, 10), (10, 10)];
    let atlas = pack(&rectangles, options).unwrap();
    assert!(sound(&rectangles, options, &atlas).is_ok());
    assert!(sound(&rectangles, AtlasOptions { gap: 2, ..options }, &atlas).is_err());
}

#[test]
fn equal_squares_fill_their_page() {
    let options = AtlasOptions { max_width: 1024, max_height: 1024, gap: 0 };
    let atlas = pack(&[(16, 16); 4096], options).unwrap();
    assert_eq!(atlas.pages, [(1024, 1024)]);
    let atlas = pack(&[(16, 16); 4097], options).unwrap();
    assert_eq!(atlas.pages, [(1024, 1024), (16, 16)]);
}

#[test]
fn mixed_sizes_waste_little() {
    let rectangles: Vec<(u32, u32)> =
        (0..400u32).map(|i| (5 + i * 7919 % 60, 5 + i * 104_729 % 60)).collect();
    let options = AtlasOptions { max_width: 4096, max_height: 4096, gap: 0 };
    let atlas = pack(&rectangles, options).unwrap();
    let used: u32 = rectangles.iter().map(|r| r.0 * r.1).sum();
    let [(width, height)] = atlas.pages[..] else { panic!("{} pages", atlas.pages.len()) };
    // A skyline usually wastes 5 to 10 %.
    assert!(f64::from(used) / f64::from(width * height) > 0.85, "{used} of {width} x {height}");
    assert!(width.abs_diff(height) < width / 5);
}

#[test]
fn too_large_is_an_error_and_nothing_is_nothing() {
    let options = AtlasOptions { max_width: 64, max_height: 32, gap: 2 };
    let error = pack(&[(1, 1), (64, 33)], options);
    assert!(matches!(error, Err(AtlasError::TooLarge { index: 1, height: 33, .. })));
    assert_eq!(pack(&[(64, 32)], options).unwrap().pages, [(64, 32)]);
    assert_eq!(pack(&[], options).unwrap(), Atlas::default());
    assert_eq!(pack(&[(0, 9), (5, 0)], options).unwrap().pages, []);
    // Sizes near the largest u32 must neither overflow nor allocate much.
    let huge = AtlasOptions { max_width: u32::MAX, max_height: u32::MAX, gap: u32::MAX };
    assert_eq!(pack(&[(u32::MAX, u32::MAX); 3], huge).unwrap().pages.len(), 3);
}
