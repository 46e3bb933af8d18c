//! What the rays of each patch have hit, as counts per patch hit. Rays are cast in `cosine_rays` and `global_lines`;
//! counts become form factors in `form_factors`.

use serde::{Deserialize, Serialize};

use super::patch_index::PatchIndex;

/// The rays of one patch in two independent halves: how many hit each other patch, began inside other geometry, or hit
/// nothing.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct PatchRayCounts {
    pub hits: [Vec<(PatchIndex, u32)>; 2],
    pub inside: [u32; 2],
    pub missed: [u32; 2],
    /// How many rays there were.
    pub count: [u32; 2],
}

/// As [`PatchRayCounts`], for one half or for both together.
#[derive(Clone, Debug, Default)]
pub(crate) struct Counts {
    pub hits: Vec<(PatchIndex, u32)>,
    pub inside: u32,
    pub missed: u32,
    pub count: u32,
}

impl Counts {
    /// Share of the rays that did not begin inside other geometry; 1 if there are no rays.
    pub fn open(&self) -> f32 {
        if self.count == 0 { 1.0 } else { (self.count - self.inside) as f32 / self.count as f32 }
    }
}

impl PatchRayCounts {
    /// Both halves together.
    pub fn whole(&self) -> Counts {
        let [even, odd] = &self.hits;
        Counts {
            hits: merged(even, odd),
            inside: self.inside.iter().sum(),
            missed: self.missed.iter().sum(),
            count: self.count.iter().sum(),
        }
    }

    /// One half.
    pub fn half(&self, half: usize) -> Counts {
        Counts {
            hits: self.hits[half].clone(),
            inside: self.inside[half],
            missed: self.missed[half],
            count: self.count[half],
        }
    }

    /// Adds the rays of another.
    pub fn add(&mut self, other: &Self) {
        for half in 0..2 {
            self.hits[half] = merged(&self.hits[half], &other.hits[half]);
            self.inside[half] += other.inside[half];
            self.missed[half] += other.missed[half];
            self.count[half] += other.count[half];
        }
    }
}

/// The sum of two lists of counts by patch, all ascending.
pub(crate) fn merged(a: &[(PatchIndex, u32)], b: &[(PatchIndex, u32)]) -> Vec<(PatchIndex, u32)> {
    let mut both = Vec::with_capacity(a.len() + b.len());
    let (mut a, mut b) = (a.iter().peekable(), b.iter().peekable());
    loop {
        let next = [a.peek().map(|entry| entry.0), b.peek().map(|entry| entry.0)];
        let Some(patch) = next.into_iter().flatten().min() else { return both };
        let is_next = |&&(other, _): &&(PatchIndex, u32)| other == patch;
        both.push((
            patch,
            a.next_if(is_next).map_or(0, |entry| entry.1) + b.next_if(is_next).map_or(0, |entry| entry.1),
        ));
    }
}

/// How often each patch occurs, ascending by patch.
pub(crate) fn counted(mut hits: Vec<PatchIndex>) -> Vec<(PatchIndex, u32)> {
    hits.sort_unstable();
    let mut row: Vec<(PatchIndex, u32)> = Vec::new();
    for patch in hits {
        match row.last_mut() {
            Some((last, n)) if *last == patch => *n += 1,
            _ => row.push((patch, 1)),
        }
    }
    row
}
