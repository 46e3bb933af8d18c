//! The nested media that a ray is inside of, as a stack, and their absorption. Refraction at their surfaces
//! is in `interface`.

use glam::DVec3;
use smallvec::SmallVec;

use crate::geometry::SpaceRay;
use crate::scene::{Object, Scene};

/// A solid that a ray is inside of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Layer {
    pub object: usize,
    pub index: f64,
    /// Absorption coefficient, 1/m.
    pub absorption: DVec3,
}

/// The solids that a ray is inside of, the innermost last; empty in air.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct MediumStack(SmallVec<[Layer; 4]>);

/// Largest number of surfaces that are crossed to find the media of a point. More than this mean a broken
/// scene.
const MAX_SURFACES: usize = 4096;

impl MediumStack {
    /// Finds the media at a point in free space with a ray to infinity: a solid that it leaves without having
    /// entered it contains the point, and the innermost is left first.
    pub fn at(scene: &Scene, point: DVec3) -> Self {
        let mut around = SmallVec::<[Layer; 4]>::new();
        if !scene.solids {
            return Self(around);
        }
        // Parallel to no axis and no diagonal, so that the ray rarely hits the edges of modelled objects.
        let direction = DVec3::new(0.5377, 0.7213, 0.4368).normalize();
        let mut entered: Vec<usize> = Vec::new();
        let mut ray = SpaceRay::new(point, direction);
        for _ in 0..MAX_SURFACES {
            let found =
                scene.geometry.closest(&ray, f64::INFINITY, |candidate| scene.is_solid(candidate.object));
            let Some(hit) = found else { break };
            let at = crate::surface_point::SurfacePoint::new(scene, &ray, &hit);
            let object = hit.candidate.object;
            if hit.candidate.front {
                entered.push(object);
            } else if let Some(before) = entered.iter().rposition(|own| *own == object) {
                entered.remove(before);
            } else {
                around.push(Layer::of(object, &scene.objects[object]));
            }
            ray = SpaceRay::leaving(at.position, direction, at.geometric, at.extent);
        }
        around.reverse();
        Self(around)
    }

    /// Returns the media behind a surface of a solid that is hit from its front or its back.
    pub fn across(&self, object: usize, solid: &Object, front: bool) -> Self {
        let mut behind = self.clone();
        if front {
            behind.0.push(Layer::of(object, solid));
        } else if let Some(own) = behind.0.iter().rposition(|layer| layer.object == object) {
            behind.0.remove(own);
        }
        behind
    }

    /// Returns the media in front of a surface of a solid. If its back is hit, the solid is among them even
    /// if it was never entered, as where its surface is not closed.
    pub fn before(&self, object: usize, solid: &Object, front: bool) -> Self {
        let inside = self.0.iter().any(|layer| layer.object == object);
        let mut here = self.clone();
        if !front && !inside {
            here.0.push(Layer::of(object, solid));
        }
        here
    }

    /// Returns the index of refraction of the innermost medium; 1 in air.
    pub fn index(&self) -> f64 {
        self.0.last().map_or(1.0, |layer| layer.index)
    }

    /// Returns the transmittance over a distance in metres.
    #[inline]
    pub fn transmittance(&self, distance: f64) -> DVec3 {
        match self.0.last() {
            // Channels without absorption transmit all light, also over an infinite distance, where the
            // product would not be a number.
            Some(layer) if layer.absorption != DVec3::ZERO => layer
                .absorption
                .map(|absorption| if absorption > 0.0 { (-absorption * distance).exp() } else { 1.0 }),
            _ => DVec3::ONE,
        }
    }

    /// Returns the innermost solid, or `None` in air.
    pub fn innermost(&self) -> Option<usize> {
        self.0.last().map(|layer| layer.object)
    }
}

impl Layer {
    fn of(object: usize, solid: &Object) -> Self {
        let index = f64::from(solid.material.ior).clamp(1.0, 1e4);
        Self { object, index, absorption: solid.medium.absorption() }
    }
}
