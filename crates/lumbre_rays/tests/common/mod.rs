//! Random numbers with a fixed seed and closed surfaces for the tests.
#![allow(dead_code, reason = "each test binary uses a part of this")]

use glam::{DVec3, Vec3};

/// SplitMix64.
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number in [0, 1).
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1 << 24) as f32
    }

    /// A point in [-1, 1)^3.
    pub fn cube(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }

    /// A direction uniform on the unit sphere.
    pub fn direction(&mut self) -> Vec3 {
        loop {
            let point = self.cube();
            if (1e-4..=1.0).contains(&point.length_squared()) {
                return point.normalize();
            }
        }
    }

    /// A point uniform in a triangle, as weights (u, v) of the second and third vertex.
    pub fn barycentric(&mut self) -> (f32, f32) {
        let (u, v) = (self.unit(), self.unit());
        if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) }
    }
}

/// A box between two corners, facing outward, of 12 triangles over 8 shared vertices.
pub fn cuboid(min: Vec3, max: Vec3) -> Vec<[Vec3; 3]> {
    let corner = |i: usize| {
        let pick = |bit: usize| if i >> bit & 1 == 1 { max[bit] } else { min[bit] };
        Vec3::new(pick(0), pick(1), pick(2))
    };
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
        .into_iter()
        .flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]])
        .map(|triangle| triangle.map(corner))
        .collect()
}

/// A sphere made by subdividing an octahedron, facing outward; shared vertices are bit-identical.
pub fn sphere(depth: u32, radius: f32, centre: Vec3) -> Vec<[Vec3; 3]> {
    let mut faces = Vec::new();
    for i in 0..8 {
        let sign = |bit: usize| if i >> bit & 1 == 1 { -1.0 } else { 1.0 };
        let (x, y, z) = (DVec3::X * sign(0), DVec3::Y * sign(1), DVec3::Z * sign(2));
        let mirrored = sign(0) * sign(1) * sign(2) < 0.0;
        faces.push(if mirrored { [x, z, y] } else { [x, y, z] });
    }
    for _ in 0..depth {
        faces = faces
            .into_iter()
            .flat_map(|[a, b, c]| {
                let middle = |p: DVec3, q: DVec3| (p + q).normalize();
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    faces.into_iter().map(|face| face.map(|p| p.as_vec3() * radius + centre)).collect()
}

/// Loose triangles around points of the cube [-1, 1]^3, with vertices up to `size` from those points along each
/// axis.
pub fn soup(random: &mut Random, count: usize, size: f32) -> Vec<[Vec3; 3]> {
    (0..count)
        .map(|_| {
            let centre = random.cube();
            [(); 3].map(|()| centre + random.cube() * size)
        })
        .collect()
}
