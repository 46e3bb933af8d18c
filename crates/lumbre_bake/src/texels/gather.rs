//! The final gather: cosine rays from every texel read the light that leaves what they meet. Direct light there is that of
//! the texel hit; the bounces before are the patches', or, where the hit is near and the patches coarse against it, one
//! real bounce more. Emission is not read: `direct` has counted it.

use glam::Vec3;

use super::footprint::{Texel, receiver};
use crate::sampling::{Sequence, cosine_about};
use crate::scene::material::Side;
use crate::scene::{BakeScene, LightmapLayout, SurfaceHit};
use crate::transport::patches::Patches;

/// Independent scrambles per texel: their spread is the texel's error.
pub(crate) const SCRAMBLES: usize = 4;

/// The light that leaves surfaces, as the gather reads it.
pub(crate) struct Outgoing<'a> {
    pub scene: &'a BakeScene,
    pub layout: &'a LightmapLayout,
    pub patches: &'a Patches,
    /// Per texel of all maps, direct irradiance (mixed lights included); NaN where there is none.
    pub direct: &'a [Vec3],
    /// Per patch, direct irradiance.
    pub patch_direct: &'a [Vec3],
    /// Per patch, irradiance by bounces.
    pub patch_indirect: &'a [Vec3],
    /// Hits nearer than this get a real bounce more, canonical units.
    pub near: f32,
}

/// What a texel has gathered: irradiance by bounces.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Gathered {
    /// Sum of the samples of each scramble.
    pub sums: [Vec3; SCRAMBLES],
    /// Samples of each scramble.
    pub samples: u32,
    /// Rays cast.
    pub rays: u64,
}

impl Gathered {
    /// The estimate of each scramble.
    pub fn estimates(&self) -> [Vec3; SCRAMBLES] {
        self.sums.map(|sum| if self.samples > 0 { sum / self.samples as f32 } else { Vec3::ZERO })
    }
}

impl Outgoing<'_> {
    /// Adds samples `self.samples..samples` of every scramble.
    pub fn gather(&self, texel: &Texel, gathered: &mut Gathered, samples: u32, seed: u32) {
        for (scramble, sum) in gathered.sums.iter_mut().enumerate() {
            let sequence = Sequence::new(seed, 16 + scramble as u32, texel.index);
            for sample in gathered.samples..samples {
                let [x, y, u, v] = sequence.point(sample, 0);
                let Some(point) = texel.point(self.scene, x, y) else { continue };
                let receiver = receiver(self.scene, &point);
                let mut direction = cosine_about(receiver.normal, u, v);
                let below = direction.dot(receiver.geometric_normal);
                if below <= 0.0 {
                    // Under the facet though above the smooth surface: mirrored up.
                    direction -= receiver.geometric_normal * (2.0 * below);
                }
                gathered.rays += 1;
                *sum += self.towards(receiver.origin, direction, sequence, sample, &mut gathered.rays);
            }
        }
        gathered.samples = gathered.samples.max(samples);
    }

    /// Radiosity of what a ray meets, emission apart.
    fn towards(
        &self,
        origin: Vec3,
        direction: Vec3,
        sequence: Sequence,
        sample: u32,
        rays: &mut u64,
    ) -> Vec3 {
        let SurfaceHit::Lit { triangle, side, at, distance } = self.scene.first_hit(origin, direction) else {
            return Vec3::ZERO;
        };
        let Some(patch) = self.patches.at(triangle, side, at) else { return Vec3::ZERO };
        let reflectance = self.reflectance(triangle, side, at, patch);
        if reflectance == Vec3::ZERO {
            return Vec3::ZERO;
        }
        let direct = self.direct_at(triangle, side, at, patch);
        let indirect = if distance < self.near {
            let [u, v, ..] = sequence.point(sample, 1);
            *rays += 1;
            self.one_bounce_more(triangle, side, at, u, v)
        } else {
            self.patch_indirect[patch as usize]
        };
        reflectance * (direct + indirect)
    }

    /// One sample of the irradiance by bounces at a hit.
    fn one_bounce_more(&self, triangle: u32, side: Side, at: (f32, f32), u: f32, v: f32) -> Vec3 {
        let surface = &self.scene.triangles[triangle as usize];
        let origin = self.scene.off_surface(triangle, side, surface.position(at.0, at.1));
        let direction = cosine_about(surface.side_normal(side), u, v);
        let SurfaceHit::Lit { triangle, side, at, .. } = self.scene.first_hit(origin, direction) else {
            return Vec3::ZERO;
        };
        let Some(patch) = self.patches.at(triangle, side, at) else { return Vec3::ZERO };
        let light = self.direct_at(triangle, side, at, patch) + self.patch_indirect[patch as usize];
        self.reflectance(triangle, side, at, patch) * light
    }

    fn reflectance(&self, triangle: u32, side: Side, (u, v): (f32, f32), patch: u32) -> Vec3 {
        let scene_triangle = &self.scene.triangles[triangle as usize];
        let surface = &self.scene.surfaces[scene_triangle.surface as usize];
        if surface.varies() {
            surface.reflectance(side, scene_triangle.vertices, [1.0 - u - v, u, v])
        } else {
            self.patches.list[patch as usize].reflectance
        }
    }

    /// Of the texel hit, or of the patch where no texel shows that side.
    fn direct_at(&self, triangle: u32, side: Side, (u, v): (f32, f32), patch: u32) -> Vec3 {
        if side == Side::Front {
            let scene_triangle = &self.scene.triangles[triangle as usize];
            let map = &self.layout.maps[scene_triangle.object as usize];
            let [a, b, c] = scene_triangle.uv;
            let uv = a + (b - a) * u + (c - a) * v;
            let (x, y) = (uv.x as u32, uv.y as u32);
            if x < map.width && y < map.height {
                let direct = self.direct[map.first + (y * map.width + x) as usize];
                if !direct.x.is_nan() {
                    return direct;
                }
            }
        }
        self.patch_direct[patch as usize]
    }
}
