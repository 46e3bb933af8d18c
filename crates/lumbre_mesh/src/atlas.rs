//! Packs rectangles of texels into pages with a skyline packer, the tallest rectangles first.
//!
//! Jylänki, "A Thousand Ways to Pack the Bin", 2010: skyline, bottom-left. The result is deterministic.

/// Limits for packing, in texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AtlasOptions {
    /// Largest width of a page.
    pub max_width: u32,
    /// Largest height of a page.
    pub max_height: u32,
    /// Free texels between two rectangles. There is no gap at the borders of a page.
    pub gap: u32,
}

/// The place of a rectangle in an atlas.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Placement {
    /// Index of the page.
    pub page: u32,
    /// Left edge in texels.
    pub x: u32,
    /// First row in texels.
    pub y: u32,
}

/// The result of packing.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Atlas {
    /// Width and height of each page in texels: as small as its rectangles allow, and within the limits.
    pub pages: Vec<(u32, u32)>,
    /// The place of each rectangle, in the order of the input.
    pub placements: Vec<Placement>,
}

/// Why rectangles cannot be packed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum AtlasError {
    /// A rectangle is larger than a page.
    #[error(
        "rectangle {index} of {width} x {height} texels exceeds the page of {max_width} x {max_height}; \
         raise the page size or lower the texel density"
    )]
    TooLarge {
        /// Index of the rectangle.
        index: usize,
        /// Its width in texels.
        width: u32,
        /// Its height in texels.
        height: u32,
        /// Largest width of a page.
        max_width: u32,
        /// Largest height of a page.
        max_height: u32,
    },
}

/// Packs rectangles (width, height) into as many pages as necessary, without rotating them.
///
/// Rectangles without area take no space. Pages are made narrower than the limit where that suffices, so that
/// few rectangles give an approximately square page.
///
/// # Errors
/// [`AtlasError::TooLarge`] if a single rectangle exceeds a page.
pub fn pack(rectangles: &[(u32, u32)], options: AtlasOptions) -> Result<Atlas, AtlasError> {
    let AtlasOptions { max_width, max_height, gap } = options;
    for (index, &(width, height)) in rectangles.iter().enumerate() {
        if width > max_width || height > max_height {
            return Err(AtlasError::TooLarge { index, width, height, max_width, max_height });
        }
    }
    let mut order: Vec<usize> =
        (0..rectangles.len()).filter(|&i| rectangles[i].0 > 0 && rectangles[i].1 > 0).collect();
    order.sort_by_key(|&i| (std::cmp::Reverse(rectangles[i].1), std::cmp::Reverse(rectangles[i].0), i));

    let width = page_width(&order, rectangles, options);
    let padded = |i: usize| [rectangles[i].0, rectangles[i].1].map(|size| u64::from(size) + u64::from(gap));
    let limit = (u64::from(width) + u64::from(gap), u64::from(max_height) + u64::from(gap));
    let mut atlas = Atlas { pages: Vec::new(), placements: vec![Placement::default(); rectangles.len()] };
    let mut skylines: Vec<Skyline> = Vec::new();
    for index in order {
        let [w, h] = padded(index);
        let found = skylines
            .iter_mut()
            .enumerate()
            .find_map(|(page, skyline)| skyline.place(w, h, limit.1).map(|(x, y)| (page, x, y)));
        let (page, x, y) = match found {
            Some(place) => place,
            None => {
                let mut skyline = Skyline::new(limit.0);
                // An empty page can hold any rectangle that is not larger than a page.
                let (x, y) = skyline.place(w, h, limit.1).unwrap_or_default();
                skylines.push(skyline);
                atlas.pages.push((0, 0));
                (skylines.len() - 1, x, y)
            }
        };
        let (x, y) = (x as u32, y as u32);
        atlas.placements[index] = Placement { page: page as u32, x, y };
        let size = &mut atlas.pages[page];
        *size = (size.0.max(x + rectangles[index].0), size.1.max(y + rectangles[index].1));
    }
    Ok(atlas)
}

/// The width at which all rectangles should fit into a square page, or into the maximum height if that needs
/// more width.
fn page_width(order: &[usize], rectangles: &[(u32, u32)], options: AtlasOptions) -> u32 {
    let gap = f64::from(options.gap);
    let area: f64 =
        order.iter().map(|&i| (f64::from(rectangles[i].0) + gap) * (f64::from(rectangles[i].1) + gap)).sum();
    let widest = order.iter().map(|&i| rectangles[i].0).max().unwrap_or(1);
    // A skyline wastes about 5 to 10 %.
    let square = (area * 1.08).sqrt().ceil();
    let needed = (area * 1.15 / f64::from(options.max_height.max(1))).ceil();
    let width = square.max(needed).min(f64::from(options.max_width)) as u32;
    width.clamp(widest.min(options.max_width), options.max_width)
}

/// The upper outline of the placed rectangles, as segments from left to right.
struct Skyline {
    /// Each segment is (left, top, width).
    segments: Vec<(u64, u64, u64)>,
}

impl Skyline {
    fn new(width: u64) -> Self {
        Self { segments: vec![(0, 0, width)] }
    }

    /// Finds the lowest and then leftmost place for a rectangle and occupies it.
    fn place(&mut self, width: u64, height: u64, max_height: u64) -> Option<(u64, u64)> {
        let mut best: Option<(u64, u64, usize)> = None;
        for first in 0..self.segments.len() {
            let Some(y) = self.height_at(first, width) else { break };
            if y + height <= max_height && best.is_none_or(|(lowest, _, _)| y < lowest) {
                best = Some((y, self.segments[first].0, first));
            }
        }
        let (y, x, first) = best?;
        self.raise(first, x, width, y + height);
        Some((x, y))
    }

    /// The height at which a rectangle with its left edge at segment `first` comes to rest; `None` if it
    /// exceeds the page.
    fn height_at(&self, first: usize, width: u64) -> Option<u64> {
        let (mut top, mut left_over) = (0, width);
        for &(_, y, segment) in &self.segments[first..] {
            top = top.max(y);
            if segment >= left_over {
                return Some(top);
            }
            left_over -= segment;
        }
        None
    }

    fn raise(&mut self, first: usize, x: u64, width: u64, top: u64) {
        let end = x + width;
        let mut last = first;
        let mut rest = None;
        while last < self.segments.len() {
            let (left, y, segment) = self.segments[last];
            last += 1;
            if left + segment >= end {
                rest = (left + segment > end).then_some((end, y, left + segment - end));
                break;
            }
        }
        self.segments.splice(first..last, [(x, top, width)].into_iter().chain(rest));
        // Merge neighbouring segments of equal height.
        self.segments.dedup_by(|next, kept| {
            let same = next.1 == kept.1;
            if same {
                kept.2 += next.2;
            }
            same
        });
    }
}
