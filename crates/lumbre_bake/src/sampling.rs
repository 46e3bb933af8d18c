//! Sample points and directions: Owen-scrambled Sobol sequences (Burley, "Practical Hash-based Owen Scrambling", JCGT
//! 9(4), 2020) and their mappings to hemispheres, spheres and triangles. What is sampled with them is up to the caller.

use std::f32::consts::TAU;
use std::sync::LazyLock;

use glam::Vec3;
use sobol_burley::parts::{self, Int4, hash_int4, owen_scramble_int4_rev, owen_scramble_rev, sobol_int4_rev};

/// The purpose that samples are drawn for. Each has its own scramble, so that no two stages use the same samples.
/// Variants with a number tell apart several estimates of the same thing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stream {
    /// Cosine rays of a patch.
    FormFactors,
    /// Rays that probe a texel for hidden parts.
    HiddenTexel,
    /// Rays that classify the points of a texel as hidden or open.
    HiddenView,
    /// Shadow rays of a texel to individually sampled sources.
    DirectLight,
    /// Shadow rays of a patch, by half.
    PatchLight(u32),
    /// Lines through the whole scene, by half.
    GlobalLines(u32),
    /// Rays of the final gather, by replicate.
    Gather(u32),
    /// Points at which the map's resolution is tested.
    ResolutionPoints,
    /// Rays that measure the light at those points.
    ResolutionLight,
    /// Rays of a probe, by replicate.
    ProbeSphere(u32),
    /// Shadow rays of a probe to emissive faces, by the side of its ambient cube.
    ProbeSide(u32),
    /// Rays of patches that estimate what has changed since a previous bake.
    ChangedPatches,
    /// The same for blocks of texels.
    ChangedTexels,
    /// Walks that estimate local light.
    LocalLight,
    /// Shadow rays to sources that share samples, by replicate.
    SharedLight(u32),
    /// Shadow rays of the cells of texels whose direct light is steep.
    SteepLight,
    #[cfg(test)]
    Test(u32),
}

impl Stream {
    /// A number that is different for each stream, from which its scramble is made.
    pub fn number(self) -> u32 {
        match self {
            Self::FormFactors => 1,
            Self::HiddenTexel => 2,
            Self::HiddenView => 3,
            Self::DirectLight => 4,
            Self::PatchLight(half) => 5 + half,
            Self::GlobalLines(half) => 12 + half,
            Self::Gather(replicate) => 16 + replicate,
            Self::ResolutionPoints => 40,
            Self::ResolutionLight => 41,
            Self::ProbeSphere(replicate) => 48 + replicate,
            Self::ProbeSide(side) => 52 + side,
            Self::ChangedPatches => 60,
            Self::ChangedTexels => 61,
            Self::LocalLight => 80,
            Self::SharedLight(replicate) => 96 + replicate,
            Self::SteepLight => 112,
            #[cfg(test)]
            Self::Test(number) => number,
        }
    }
}

/// A sequence of points in [0, 1)⁴ with its own scramble.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sequence {
    seed: u32,
}

/// The longest sequence that `sobol_burley` supports; points beyond come from another scramble.
const LENGTH: u32 = 1 << 16;

impl Sequence {
    /// The sequence for a seed, a stream and an index within the stream, such as a texel's.
    pub fn new(seed: u32, stream: Stream, index: u32) -> Self {
        Self { seed: hash(hash(hash(seed) ^ stream.number().wrapping_mul(0x9e37_79b9)) ^ index) }
    }

    /// A sequence with another scramble for each `which`.
    pub fn of(&self, which: u32) -> Self {
        Self { seed: hash(self.seed ^ which.wrapping_mul(0x85eb_ca6b)) }
    }

    /// The four dimensions of point `index` in dimension set `set` (0, 1, …).
    pub fn point(&self, index: u32, set: u32) -> [f32; 4] {
        self.set(set).point(index)
    }

    /// One dimension set, to take several points from.
    pub fn set(&self, set: u32) -> SequenceSet {
        SequenceSet { sequence: *self, set, scramble: Scramble::new(set, self.seed) }
    }
}

/// One dimension set of a sequence.
#[derive(Clone, Copy)]
pub(crate) struct SequenceSet {
    sequence: Sequence,
    set: u32,
    scramble: Scramble,
}

impl SequenceSet {
    /// The four dimensions of point `index`.
    pub fn point(&self, index: u32) -> [f32; 4] {
        let scramble = match index / LENGTH {
            0 => self.scramble,
            beyond => Scramble::new(self.set, self.sequence.of(beyond).seed),
        };
        scramble.point(self.set, index % LENGTH)
    }
}

/// The hashes that `sobol_burley::sample_4d` computes anew for every point.
#[derive(Clone, Copy)]
struct Scramble {
    shuffle: u32,
    dimensions: Int4,
}

impl Scramble {
    fn new(set: u32, seed: u32) -> Self {
        let set_seed = seed.wrapping_mul(0x9c8f_2d3b) ^ set;
        let dimensions =
            [0x912f_69ba, 0x174f_18ab, 0x691e_72ca, 0xb40c_c1b8].map(|constant| set_seed ^ constant);
        Self { shuffle: parts::hash(seed ^ 0x79c6_8e4a), dimensions: hash_int4(dimensions.into()) }
    }

    /// The same point as `sobol_burley::sample_4d`, but in the first sets looked up by four bits of the index at a
    /// time.
    fn point(&self, set: u32, index: u32) -> [f32; 4] {
        let shuffled = owen_scramble_rev(index.reverse_bits(), self.shuffle);
        let point = match NIBBLES.get(set as usize) {
            Some(nibbles) => {
                let look_up = |nibble: usize| -> Int4 {
                    nibbles[nibble][(shuffled >> (28 - 4 * nibble) & 15) as usize].into()
                };
                look_up(0) ^ look_up(1) ^ look_up(2) ^ look_up(3)
            }
            None => sobol_int4_rev(shuffled, set),
        };
        owen_scramble_int4_rev(point, self.dimensions).reverse_bits().to_f32_norm()
    }
}

/// Dimension sets with a table.
const SETS: usize = 8;

/// For each dimension set, each group of four bits of a reversed index (the highest first) and each value of that
/// group: its contribution to a point.
static NIBBLES: LazyLock<[[[[u32; 4]; 16]; 4]; SETS]> = LazyLock::new(|| {
    std::array::from_fn(|set| {
        std::array::from_fn(|nibble| {
            std::array::from_fn(|value| {
                sobol_int4_rev((value as u32) << (28 - 4 * nibble), set as u32).into()
            })
        })
    })
});

/// A 32-bit hash (Wellons' lowbias32).
pub(crate) fn hash(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// A unit vector about +Z with density cos θ / π, by Shirley and Chiu's concentric map.
pub(crate) fn cosine_direction(u: f32, v: f32) -> Vec3 {
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    if a == 0.0 && b == 0.0 {
        return Vec3::Z;
    }
    let is_wide = a.abs() > b.abs();
    let (radius, other) = if is_wide { (a, b) } else { (b, a) };
    let (sine, cosine) = sin_cos_small(TAU / 8.0 * (other / radius));
    let (x, y) = if is_wide { (cosine, sine) } else { (sine, cosine) };
    Vec3::new(radius * x, radius * y, (1.0 - radius * radius).max(0.0).sqrt())
}

/// The sine and cosine of an angle of at most π / 4, to 1e-7. They have the same bits on every machine, unlike the
/// standard library's (Moshier, Cephes Mathematical Library, sinf.c, 1992).
fn sin_cos_small(x: f32) -> (f32, f32) {
    let y = x * x;
    let sine = ((-1.951_529_6e-4 * y + 8.332_161e-3) * y - 1.666_665_5e-1) * y * x + x;
    let cosine = ((2.443_315_7e-5 * y - 1.388_731_6e-3) * y + 4.166_664_6e-2) * y * y - 0.5 * y + 1.0;
    (sine, cosine)
}

/// Two unit vectors that make a right-handed frame with a unit `normal`
/// (Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017).
pub(crate) fn frame(normal: Vec3) -> [Vec3; 2] {
    let sign = 1.0f32.copysign(normal.z);
    let a = -1.0 / (sign + normal.z);
    let b = normal.x * normal.y * a;
    [
        Vec3::new(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x),
        Vec3::new(b, sign + normal.y * normal.y * a, -normal.y),
    ]
}

/// A unit vector with density 1 / 4π: Archimedes' equal-area map of the cylinder.
pub(crate) fn sphere_direction(u: f32, v: f32) -> Vec3 {
    let z = 1.0 - 2.0 * u;
    let radius = (1.0 - z * z).max(0.0).sqrt();
    let (sine, cosine) = (TAU * v).sin_cos();
    Vec3::new(radius * cosine, radius * sine, z)
}

/// A unit vector about a unit `normal` with density cos θ / π.
pub(crate) fn cosine_about(normal: Vec3, u: f32, v: f32) -> Vec3 {
    let [x, y] = frame(normal);
    let local = cosine_direction(u, v);
    (x * local.x + y * local.y + normal * local.z).normalize_or(normal)
}

/// Barycentric weights (of the second and third vertex) of a uniformly distributed point on a triangle. The map is
/// continuous in (u, v), so that stratified points stay stratified (Heitz, "A Low-Distortion Map Between Triangle and
/// Square", 2019).
pub(crate) fn triangle_point(u: f32, v: f32) -> (f32, f32) {
    if v > u {
        let x = 0.5 * u;
        (x, v - x)
    } else {
        let y = 0.5 * v;
        (u - y, y)
    }
}

/// Finds the interval of a cumulative distribution that contains `u`: its place, its begin and its end. `end` is where
/// an item's interval ends and the next item's begins; from the last end on, the last interval counts. `None` without
/// items.
pub(crate) fn interval_at<T, N: Copy + PartialOrd + Default>(
    items: &[T],
    end: impl Fn(&T) -> N,
    u: N,
) -> Option<(usize, N, N)> {
    let last = items.len().checked_sub(1)?;
    let place = items.partition_point(|item| end(item) <= u).min(last);
    let begin = if place == 0 { N::default() } else { end(&items[place - 1]) };
    Some((place, begin, end(&items[place])))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The stream after another, in an order that visits all: every replicate, both halves, six sides of a probe. A stream
    /// that is added does not compile before it has a place here.
    fn after(stream: Stream) -> Option<Stream> {
        Some(match stream {
            Stream::FormFactors => Stream::HiddenTexel,
            Stream::HiddenTexel => Stream::HiddenView,
            Stream::HiddenView => Stream::DirectLight,
            Stream::DirectLight => Stream::PatchLight(0),
            Stream::PatchLight(0) => Stream::PatchLight(1),
            Stream::PatchLight(_) => Stream::GlobalLines(0),
            Stream::GlobalLines(0) => Stream::GlobalLines(1),
            Stream::GlobalLines(_) => Stream::Gather(0),
            Stream::Gather(replicate @ 0..3) => Stream::Gather(replicate + 1),
            Stream::Gather(_) => Stream::ResolutionPoints,
            Stream::ResolutionPoints => Stream::ResolutionLight,
            Stream::ResolutionLight => Stream::ProbeSphere(0),
            Stream::ProbeSphere(replicate @ 0..3) => Stream::ProbeSphere(replicate + 1),
            Stream::ProbeSphere(_) => Stream::ProbeSide(0),
            Stream::ProbeSide(side @ 0..5) => Stream::ProbeSide(side + 1),
            Stream::ProbeSide(_) => Stream::ChangedPatches,
            Stream::ChangedPatches => Stream::ChangedTexels,
            Stream::ChangedTexels => Stream::LocalLight,
            Stream::LocalLight => Stream::SharedLight(0),
            Stream::SharedLight(replicate @ 0..3) => Stream::SharedLight(replicate + 1),
            Stream::SharedLight(_) => Stream::SteepLight,
            Stream::SteepLight | Stream::Test(_) => return None,
        })
    }

    #[test]
    fn an_interval_contains_the_number_that_it_is_found_by() {
        let ends = [0.25f32, 0.25, 1.0];
        let found = |u| interval_at(&ends, |&end| end, u);
        assert_eq!(found(0.0), Some((0, 0.0, 0.25)));
        // The second interval is empty.
        assert_eq!(found(0.25), Some((2, 0.25, 1.0)));
        assert_eq!(found(1.5), Some((2, 0.25, 1.0)));
        assert_eq!(interval_at(&[], |&end: &f32| end, 0.5), None);
    }

    #[test]
    fn no_two_streams_share_a_number() {
        let streams = std::iter::successors(Some(Stream::FormFactors), |stream| after(*stream));
        let mut numbers: Vec<u32> = streams.map(Stream::number).collect();
        let count = numbers.len();
        assert_eq!(count, 32);
        numbers.sort_unstable();
        numbers.dedup();
        assert_eq!(numbers.len(), count);
    }

    #[test]
    fn points_equal_those_of_sobol_burley() {
        for (seed, set) in [(0, 0), (7, 1), (u32::MAX, 7), (0x1234_5678, 8), (9, 60)] {
            for index in (0..LENGTH).step_by(7) {
                let expected = sobol_burley::sample_4d(index, set, seed);
                assert_eq!(Scramble::new(set, seed).point(set, index), expected, "{index} {set} {seed}");
            }
        }
    }

    #[test]
    fn cosine_directions_have_the_moments_of_the_cosine() {
        // ∫ cos θ · cos θ / π = 2/3 and ∫ x² cos θ / π = 1/4, over 2^14 Sobol points: error ~ 1/N.
        let sequence = Sequence::new(1, Stream::Test(2), 3);
        let n = 1 << 14;
        let (mut z, mut xx) = (0.0, 0.0);
        for i in 0..n {
            let [u, v, ..] = sequence.point(i, 0);
            let d = cosine_direction(u, v);
            assert!((d.length() - 1.0).abs() < 1e-5);
            z += f64::from(d.z);
            xx += f64::from(d.x * d.x);
        }
        assert!((z / f64::from(n) - 2.0 / 3.0).abs() < 1e-3);
        assert!((xx / f64::from(n) - 0.25).abs() < 1e-3);
    }

    #[test]
    fn sine_and_cosine_agree_with_the_standard_library() {
        for step in -1000..=1000i16 {
            let x = f64::from(step) / 1000.0 * std::f64::consts::FRAC_PI_4;
            let (sine, cosine) = sin_cos_small(x as f32);
            let (s, c) = f64::from(x as f32).sin_cos();
            assert!((f64::from(sine) - s).abs() < 1e-7 && (f64::from(cosine) - c).abs() < 1e-7, "{x}");
        }
    }

    #[test]
    fn triangle_points_lie_inside_and_have_the_centroid_as_mean() {
        let sequence = Sequence::new(0, Stream::Test(0), 7);
        let n = 1 << 12;
        let (mut a, mut b) = (0.0, 0.0);
        for i in 0..n {
            let [u, v, ..] = sequence.point(i, 0);
            let (x, y) = triangle_point(u, v);
            assert!(x >= 0.0 && y >= 0.0 && x + y <= 1.0);
            a += f64::from(x);
            b += f64::from(y);
        }
        assert!((a / f64::from(n) - 1.0 / 3.0).abs() < 2e-3 && (b / f64::from(n) - 1.0 / 3.0).abs() < 2e-3);
    }

    #[test]
    fn frames_are_orthonormal_for_every_normal() {
        for normal in [Vec3::Z, Vec3::NEG_Z, Vec3::X, Vec3::new(-0.6, 0.0, -0.8), Vec3::new(1e-8, 0.0, -1.0)]
        {
            let [x, y] = frame(normal);
            for (a, b, expected) in
                [(x, y, 0.0), (x, normal, 0.0), (y, normal, 0.0), (x, x, 1.0), (y, y, 1.0)]
            {
                assert!((a.dot(b) - expected).abs() < 1e-6);
            }
            assert!(x.cross(y).dot(normal) > 0.999);
        }
    }
}
