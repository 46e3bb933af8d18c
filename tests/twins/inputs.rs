//! Inputs of the functions under test: random ones like those of scenes, and hard ones at their corners. The
//! sequences are fixed, so that a failure can be repeated.

use glam::{DVec3, Vec3};

/// Number of random inputs per function.
pub const RANDOM: usize = 1_000_000;
/// Minimum number of hard inputs per function.
pub const HARD: usize = 100_000;

/// A fixed sequence of numbers in [0, 1): splitmix64 of a counter.
pub struct Sequence(pub u64);

impl Sequence {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }

    pub fn next(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u64 << 24) as f32
    }

    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.next()
    }

    /// Uniform in the logarithm: every decade from 10^low to 10^high is equally likely.
    pub fn decades(&mut self, low: f32, high: f32) -> f32 {
        10f32.powf(self.between(low, high))
    }

    pub fn unit(&mut self) -> Vec3 {
        let z = 2.0 * f64::from(self.next()) - 1.0;
        let (sine, cosine) = (f64::from(self.next()) * std::f64::consts::TAU).sin_cos();
        let radius = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(radius * cosine, z, radius * sine).as_vec3()
    }

    /// Returns a normal, a light mostly in front of it, and a viewer. Half of the viewers are near the mirror
    /// direction, at distances of every magnitude from it.
    pub fn directions(&mut self) -> [Vec3; 3] {
        let (normal, mut light) = (self.unit(), self.unit());
        if normal.dot(light) < 0.0 && self.next() < 0.8 {
            light = -light;
        }
        let mut viewer = self.unit();
        if self.next() < 0.5 {
            let (n, l) = (normal.as_dvec3(), light.as_dvec3());
            let away = f64::from(self.decades(-6.0, 0.0)) * viewer.as_dvec3();
            viewer = (2.0 * n.dot(l) * n - l + away).normalize_or_zero().as_vec3();
        } else if normal.dot(viewer) < 0.0 && self.next() < 0.6 {
            viewer = -viewer;
        }
        [normal, light, viewer]
    }

    /// Returns an exponent from 1 to a million; some are whole numbers.
    pub fn shininess(&mut self) -> f32 {
        let exponent = self.decades(0.0, 6.0);
        if self.next() < 0.2 { exponent.round() } else { exponent }
    }

    /// Returns any finite number, all bit patterns being equally likely.
    pub fn any(&mut self) -> f32 {
        loop {
            let number = f32::from_bits(self.bits() as u32);
            if number.is_finite() {
                return number;
            }
        }
    }
}

/// Exponents at which the behaviour changes.
pub const EXPONENTS: [f32; 11] = [0.0, 1e-3, 0.5, 1.0, 3.0, 128.0, 256.0, 257.0, 1e4, 9.99e5, 1e6];

/// Normals, lights and viewers that are zero, opposite, equal, grazing or mirrored.
pub fn hard_directions() -> Vec<[f32; 9]> {
    let grazing = |height: f64| DVec3::new(1.0, height, 0.0).normalize().as_vec3();
    let mut sequence = Sequence(11);
    let (odd, other) = (sequence.unit(), sequence.unit());
    let normals = [Vec3::Y, Vec3::ZERO, odd];
    let lights = [
        Vec3::ZERO,
        Vec3::Y,
        -Vec3::Y,
        Vec3::X,
        grazing(1e-3),
        grazing(1e-7),
        grazing(-1e-7),
        odd,
        other,
        Vec3::splat(3f32.sqrt().recip()),
    ];
    let mut all = Vec::new();
    for normal in normals {
        for light in lights {
            let mirror = 2.0 * normal.dot(light) * normal - light;
            let viewers = [
                Vec3::ZERO,
                Vec3::Y,
                -Vec3::X,
                -light,
                light,
                mirror,
                (mirror + 1e-4 * odd).normalize_or_zero(),
                (mirror + 1e-2 * other).normalize_or_zero(),
                grazing(1e-6),
                -mirror,
                (odd - light * 1e-3 - light).normalize_or_zero(),
            ];
            for viewer in viewers {
                let mut numbers = [0.0; 9];
                for (at, vector) in [normal, light, viewer].into_iter().enumerate() {
                    numbers[3 * at..3 * at + 3].copy_from_slice(&vector.to_array());
                }
                all.push(numbers);
            }
        }
    }
    all
}

/// Returns every combination of one number from each list.
pub fn product(lists: &[&[f32]]) -> Vec<Vec<f32>> {
    lists.iter().fold(vec![Vec::new()], |sofar, list| {
        let extended = sofar.iter().flat_map(|head| {
            list.iter().map(move |number| head.iter().copied().chain([*number]).collect::<Vec<f32>>())
        });
        extended.collect()
    })
}

/// Returns each of `heads` combined with each of `tails`.
pub fn crossed(heads: &[Vec<f32>], tails: &[Vec<f32>]) -> Vec<Vec<f32>> {
    heads.iter().flat_map(|head| tails.iter().map(move |tail| [head.as_slice(), tail].concat())).collect()
}

/// Returns the corners themselves, and random neighbours up to three units in the last place away until there are
/// enough.
pub fn jittered(corners: &[Vec<f32>]) -> Vec<f32> {
    let mut sequence = Sequence(13);
    assert!(!corners.is_empty(), "there are no hard inputs");
    let mut all: Vec<f32> = corners.concat();
    let mut count = corners.len();
    while count < HARD {
        for corner in corners {
            for number in corner {
                let steps = (sequence.bits() % 7) as i32 - 3;
                all.push(if sequence.next() < 0.5 { *number } else { stepped(*number, steps) });
            }
            count += 1;
        }
    }
    all
}

/// Returns the representable number this many steps further.
fn stepped(number: f32, steps: i32) -> f32 {
    let ordered = |x: f32| {
        let bits = x.to_bits() as i32;
        if bits < 0 { i32::MIN.wrapping_sub(bits) } else { bits }
    };
    let moved = ordered(number) + steps;
    let bits = if moved < 0 { i32::MIN.wrapping_sub(moved) } else { moved };
    let result = f32::from_bits(bits as u32);
    if result.is_finite() { result } else { number }
}

#[test]
fn steps_go_through_zero_and_back() {
    assert_eq!(stepped(1.0, 1), 1.0f32.next_up());
    assert_eq!(stepped(1.0, -1), 1.0f32.next_down());
    assert_eq!(stepped(0.0, -1), -f32::from_bits(1));
    assert_eq!(stepped(-f32::from_bits(2), 3), f32::from_bits(1));
    assert_eq!(stepped(f32::MAX, 1), f32::MAX);
}
