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

impl Met {
    /// Nothing is read yet.
    const UNREAD: Self = Self {
        triangle: 0,
        side: Side::Front,
        at: (0.0, 0.0),
        patch: 0,
        reflectance: Vec3::ZERO,
        direct: Vec3::ZERO,
        direction: Vec3::ZERO,
        distance: 0.0,
    };
}

/// A surface that reflects, with the sample's weight, or else what arrives all the same (times π as all light is here): the sky's, or none, with its
/// weight.
pub(super) type Arriving = Result<(Met, f32), (Vec3, f32)>;

/// No light and no weight: what the guide named is not to be seen.
pub(super) const NOTHING: (Vec3, f32) = (Vec3::ZERO, 0.0);

/// Where a sample looks.
#[derive(Clone, Copy)]
enum Aim {
    /// In a direction about the receiver's normal.
    Around(Vec3),
    /// At a point of a region that the guide named with this probability, as it would be met; and the point just off it.
    At(u32, f32, Met, Vec3),
    Nowhere,
}

/// A sample under way.
#[derive(Clone, Copy)]
struct Way {
    aim: Aim,
    /// Of the samples, what the guide places; none if it knows nothing of the receiver.
    share: Option<f32>,
    /// Region met, where it counts.
    region: Option<u32>,
}

/// What the direction of a ray about a receiver's normal is worth: cos θ / π, with what lies under the facet mirrored up.
fn kernel(receiver: &Receiver, direction: Vec3) -> f32 {
    let below = direction - receiver.geometric_normal * (2.0 * direction.dot(receiver.geometric_normal));
    (direction.dot(receiver.normal).max(0.0) + below.dot(receiver.normal).max(0.0)) * FRAC_1_PI
}

/// A direction with density [`kernel`].
#[inline]
fn about(receiver: &Receiver, u: f32, v: f32) -> Vec3 {
    let direction = cosine_about(receiver.normal, u, v);
    let below = direction.dot(receiver.geometric_normal);
    if below <= 0.0 {
        // Under the facet though above the smooth surface: mirrored up.
        return direction - receiver.geometric_normal * (2.0 * below);
    }
    direction
}

impl Outgoing<'_> {
    /// For each receiver a point that its light by bounces comes from: some of the samples, if the guide knows the receiver's region, are
    /// points of regions that it names, the others are what cosine rays meet; weighed by the balance heuristic (Veach and Guibas, "Optimally
    /// Combining Sampling Techniques for Monte Carlo Rendering", 1995, section 3.3).
    pub(super) fn arriving<const MOST: usize>(&self, asked: &[Asked], found: &mut [Arriving; MOST]) {
        let mut ways = [Way { aim: Aim::Nowhere, share: None, region: None }; MOST];
        for (way, asked) in ways.iter_mut().zip(asked) {
            way.share = asked.region.and_then(|region| self.guide.share(region));
            way.aim = self.aim(asked, way.share);
        }
        for ((way, asked), found) in ways.iter().zip(asked).zip(found.iter_mut()) {
            *found = match &way.aim {
                Aim::Nowhere => Err(NOTHING),
                Aim::At(_, _, met, end) => {
                    let hidden = self.scene.blocked(asked.receiver.origin, *end);
                    if hidden { Err(NOTHING) } else { Ok((*met, 1.0)) }
                }
                Aim::Around(direction) => match self.meet(asked.receiver.origin, *direction) {
                    Ok(met) => Ok((met, 1.0)),
                    Err(light) => {
                        // The sky is found by these alone.
                        let rest = 1.0 - way.share.unwrap_or(0.0);
                        Err((light / rest, 1.0 / rest))
                    }
                },
            };
        }
        for ((way, found), _) in ways.iter_mut().zip(found.iter_mut()).zip(asked) {
            let Ok((met, _)) = found else { continue };
            let Some(patch) = self.patches.at(met.triangle, met.side, met.at) else {
                *found = Err(NOTHING);
                continue;
            };
            way.region = match way.aim {
                Aim::At(region, ..) => Some(region),
                _ if way.share.is_some() => self.guide.regions.at(met.triangle, met.side, met.at),
                _ => None,
            };
            met.patch = patch;
            met.reflectance = self.reflectance(met.triangle, met.side, met.at);
            met.direct = self.direct_at(met.triangle, met.side, met.at, patch);
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

    /// Where to look: the guide's rows are far, so nothing here waits for what a ray meets.
    #[inline]
    fn aim(&self, asked: &Asked, share: Option<f32>) -> Aim {
        let &Asked { ref receiver, region, u, v } = asked;
        let (Some(region), Some(share)) = (region, share) else {
            return Aim::Around(about(receiver, u, v));
        };
        if u >= share {
            return Aim::Around(about(receiver, (u - share) / (1.0 - share), v));
        }
        let picked = self.guide.pick(region, u / share);
        picked
            .and_then(|(region, u, probability)| self.point_of(receiver, region, probability, u, v))
            .unwrap_or(Aim::Nowhere)
    }

    /// The weight of a sample of which the guide places a share.
    fn weight(&self, asked: &Asked, way: &Way, share: f32, met: &Met) -> Option<f32> {
        let region = way.region?;
        let probability = match way.aim {
            Aim::At(_, probability, ..) => probability,
            _ => asked.region.map_or(0.0, |receiver| self.guide.probability(receiver, region)),
        };
        // Densities over the surfaces' area.
        let by_guide = probability / self.guide.regions.list[region as usize].area;
        let normal = self.scene.triangles[met.triangle as usize].side_normal(met.side);
        let cosine = -met.direction.dot(normal);
        let by_cosine = kernel(&asked.receiver, met.direction) * cosine / (met.distance * met.distance);
        let weight = by_cosine / ((1.0 - share) * by_cosine + share * by_guide);
        (cosine > 0.0 && weight.is_finite()).then_some(weight)
    }

    /// What a ray meets, its light not read yet, or what arrives all the same.
    #[inline]
    fn meet(&self, origin: Vec3, direction: Vec3) -> Result<Met, Vec3> {
        match self.scene.first_hit(origin, direction) {
            SurfaceHit::Lit { triangle, side, at, distance } => {
                Ok(Met { triangle, side, at, direction, distance, ..Met::UNREAD })
            }
            SurfaceHit::None => Err(self.sky),
            SurfaceHit::Back | SurfaceHit::Inside => Err(Vec3::ZERO),
        }
    }

    /// A point of a region, if it and the receiver face each other.
    #[inline]
    fn point_of(&self, receiver: &Receiver, index: u32, probability: f32, u: f32, v: f32) -> Option<Aim> {
        let region = &self.guide.regions.list[index as usize];
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
        let met = Met { triangle, side, at, direction, distance, ..Met::UNREAD };
        Some(Aim::At(index, probability, met, end))
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
