//! Where a receiver's light by bounces comes from: points by cosine rays and by the guide, several receivers at a time, so that what they
//! read is on its way from memory together. Not what is made of it: that is `gather`.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::outgoing::Outgoing;
use crate::sampling::{cosine_about, triangle_point};
use crate::scene::SurfaceHit;
use crate::scene::material::Side;
use crate::transport::direct::Receiver;

/// A receiver that asks for a sample of its light by bounces.
#[derive(Clone, Copy, Debug)]
pub(super) struct Asked {
    pub receiver: Receiver,
    /// Its region of the guide; without one cosine rays only.
    pub region: Option<u32>,
    /// In the unit square.
    pub u: f32,
    pub v: f32,
}

impl Asked {
    /// Fills the lists' empty places.
    pub const NOWHERE: Self = Self {
        receiver: Receiver {
            position: Vec3::ZERO,
            origin: Vec3::ZERO,
            geometric_normal: Vec3::Z,
            normal: Vec3::Z,
        },
        region: None,
        u: 0.0,
        v: 0.0,
    };
}

/// A surface that a sample has met.
#[derive(Clone, Copy, Debug)]
pub(super) struct Met {
    pub triangle: u32,
    pub side: Side,
    pub at: (f32, f32),
    pub patch: u32,
    pub reflectance: Vec3,
    /// Direct irradiance there.
    pub direct: Vec3,
    /// Of the ray, of unit length, and how far it went.
    pub direction: Vec3,
    pub distance: f32,
}

/// A surface that reflects, with the sample's weight, or else what arrives all the same (times π as all light is here): the sky's, or none, with its
/// weight.
pub(super) type Arriving = Result<(Met, f32), (Vec3, f32)>;

/// No light and no weight: what the guide named is not to be seen.
pub(super) const NOTHING: (Vec3, f32) = (Vec3::ZERO, 0.0);

/// Where a sample looks.
#[derive(Clone, Copy)]
enum Aim {
    /// About the receiver's normal.
    Around {
        u: f32,
        v: f32,
    },
    /// At a region of the guide, named with this probability.
    At {
        region: u32,
        u: f32,
        v: f32,
        probability: f32,
    },
    Nowhere,
}

/// What is known of a sample under way.
#[derive(Clone, Copy)]
struct Way {
    aim: Aim,
    /// Of the samples, what the guide places; none if it knows nothing of the receiver.
    share: Option<f32>,
    /// Region met, if there is one and it is asked for.
    region: Option<u32>,
}

/// What the direction of a ray about a receiver's normal is worth: cos θ / π, with what lies under the facet mirrored up.
fn kernel(receiver: &Receiver, direction: Vec3) -> f32 {
    let below = direction - receiver.geometric_normal * (2.0 * direction.dot(receiver.geometric_normal));
    (direction.dot(receiver.normal).max(0.0) + below.dot(receiver.normal).max(0.0)) * FRAC_1_PI
}

impl Outgoing<'_> {
    /// For each receiver a point that its light by bounces comes from: some of the samples, if the guide knows the receiver's region, are
    /// points of regions that it names, the others are what cosine rays meet; weighed by the balance heuristic (Veach and Guibas, "Optimally
    /// Combining Sampling Techniques for Monte Carlo Rendering", 1995, section 3.3).
    pub(super) fn arriving<const MOST: usize>(&self, asked: &[Asked], found: &mut [Arriving; MOST]) {
        let mut ways = [Way { aim: Aim::Nowhere, share: None, region: None }; MOST];
        for (way, asked) in ways.iter_mut().zip(asked) {
            *way = self.way(asked);
        }
        for ((way, asked), found) in ways.iter_mut().zip(asked).zip(found.iter_mut()) {
            *found = self.follow(asked, way);
        }
        for (found, _) in found.iter_mut().zip(asked) {
            if let Ok((met, _)) = found {
                met.reflectance = self.reflectance(met.triangle, met.side, met.at);
                met.direct = self.direct_at(met.triangle, met.side, met.at, met.patch);
            }
        }
        for ((way, asked), found) in ways.iter().zip(asked).zip(found) {
            if let (Ok((met, weight)), Some(share)) = (&mut *found, way.share) {
                match self.weight(asked, way, share, met) {
                    Some(own) => *weight = own,
                    None => *found = Err(NOTHING),
                }
            }
        }
    }

    /// Where to look.
    fn way(&self, &Asked { region, u, v, .. }: &Asked) -> Way {
        let Some((region, share)) = region.and_then(|region| Some((region, self.guide.share(region)?)))
        else {
            return Way { aim: Aim::Around { u, v }, share: None, region: None };
        };
        let aim = if u < share {
            match self.guide.pick(region, u / share) {
                Some((region, u, probability)) => Aim::At { region, u, v, probability },
                None => Aim::Nowhere,
            }
        } else {
            Aim::Around { u: (u - share) / (1.0 - share), v }
        };
        Way { aim, share: Some(share), region: None }
    }

    /// What is there: its light is not read yet, its weight 1.
    fn follow(&self, asked: &Asked, way: &mut Way) -> Arriving {
        let met = match way.aim {
            Aim::Nowhere => return Err(NOTHING),
            Aim::At { region, u, v, .. } => {
                way.region = Some(region);
                self.point_of(&asked.receiver, region, u, v).ok_or(NOTHING)?
            }
            Aim::Around { u, v } => {
                let met = self.meet_about(&asked.receiver, u, v);
                // The sky is found by these alone.
                let rest = 1.0 - way.share.unwrap_or(0.0);
                let met = met.map_err(|light| (light / rest, 1.0 / rest))?;
                if way.share.is_some() {
                    way.region = self.guide.regions.at(met.triangle, met.side, met.at);
                }
                met
            }
        };
        Ok((met, 1.0))
    }

    /// The weight of a sample of which the guide places a share.
    fn weight(&self, asked: &Asked, way: &Way, share: f32, met: &Met) -> Option<f32> {
        let region = way.region?;
        let probability = match way.aim {
            Aim::At { probability, .. } => probability,
            Aim::Around { .. } => {
                asked.region.map_or(0.0, |receiver| self.guide.probability(receiver, region))
            }
            Aim::Nowhere => return None,
        };
        // Densities over the surfaces' area.
        let by_guide = probability / self.guide.regions.list[region as usize].area;
        let normal = self.scene.triangles[met.triangle as usize].side_normal(met.side);
        let cosine = -met.direction.dot(normal);
        let by_cosine = kernel(&asked.receiver, met.direction) * cosine / (met.distance * met.distance);
        let weight = by_cosine / ((1.0 - share) * by_cosine + share * by_guide);
        (cosine > 0.0 && weight.is_finite()).then_some(weight)
    }

    /// What a ray about a receiver's normal meets, or what arrives all the same.
    fn meet_about(&self, receiver: &Receiver, u: f32, v: f32) -> Result<Met, Vec3> {
        let mut direction = cosine_about(receiver.normal, u, v);
        let below = direction.dot(receiver.geometric_normal);
        if below <= 0.0 {
            // Under the facet though above the smooth surface: mirrored up.
            direction -= receiver.geometric_normal * (2.0 * below);
        }
        let (triangle, side, at, distance) = match self.scene.first_hit(receiver.origin, direction) {
            SurfaceHit::Lit { triangle, side, at, distance } => (triangle, side, at, distance),
            SurfaceHit::None => return Err(self.sky),
            SurfaceHit::Back | SurfaceHit::Inside => return Err(Vec3::ZERO),
        };
        self.unread(triangle, side, at, direction, distance).ok_or(Vec3::ZERO)
    }

    /// A point of a region, if the receiver sees it.
    fn point_of(&self, receiver: &Receiver, region: u32, u: f32, v: f32) -> Option<Met> {
        let region = &self.guide.regions.list[region as usize];
        let (triangle, side) = (region.triangle, region.side);
        let at = self.guide.regions.point(region, triangle_point(u, v));
        let surface = &self.scene.triangles[triangle as usize];
        let position = surface.position(at.0, at.1);
        let apart = position - receiver.position;
        let distance = apart.length();
        let direction = apart / distance;
        let faces =
            direction.dot(surface.side_normal(side)) < 0.0 && direction.dot(receiver.geometric_normal) > 0.0;
        if !faces {
            return None;
        }
        let end = self.scene.off_surface_seen_from(triangle, side, position, receiver.origin);
        if self.scene.blocked(receiver.origin, end) {
            return None;
        }
        self.unread(triangle, side, at, direction, distance)
    }

    /// A surface whose light is still to be read.
    fn unread(
        &self,
        triangle: u32,
        side: Side,
        at: (f32, f32),
        direction: Vec3,
        distance: f32,
    ) -> Option<Met> {
        let patch = self.patches.at(triangle, side, at)?;
        let (reflectance, direct) = (Vec3::ZERO, Vec3::ZERO);
        Some(Met { triangle, side, at, patch, reflectance, direct, direction, distance })
    }

    /// The receiver at a surface that was met.
    pub(super) fn receiver_at(&self, met: &Met) -> Receiver {
        let surface = &self.scene.triangles[met.triangle as usize];
        let position = surface.position(met.at.0, met.at.1);
        let origin = self.scene.off_surface(met.triangle, met.side, position);
        let normal = surface.side_normal(met.side);
        Receiver { position, origin, geometric_normal: normal, normal }
    }
}
