//! In which medium a ray runs: media inside media as a stack, and what each absorbs. Not refraction.

use glam::DVec3;
use smallvec::SmallVec;

use crate::geometry::SpaceRay;
use crate::scene::{Object, Scene};

/// A solid that a ray is inside of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Layer {
    pub object: usize,
    pub index: f64,
    /// 1/m.
    pub absorption: DVec3,
}

/// The solids that a ray is inside of, the innermost last. Outside of all is air.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct MediumStack(SmallVec<[Layer; 4]>);

/// More surfaces than this around one point are no scene but a mistake.
const MOST_SURFACES: usize = 4096;

impl MediumStack {
    /// The media at a point in free space, found by a ray to infinity: what it leaves without having entered it contains the point, the
    /// innermost first.
    pub fn at(scene: &Scene, point: DVec3) -> Self {
        let mut around = SmallVec::<[Layer; 4]>::new();
        if !scene.solids {
            return Self(around);
        }
        // Along no axis and no diagonal, where the edges of made things lie.
        let direction = DVec3::new(0.5377, 0.7213, 0.4368).normalize();
        let mut entered: Vec<usize> = Vec::new();
        let mut ray = SpaceRay::new(point, direction);
        for _ in 0..MOST_SURFACES {
            let found =
                scene.geometry.closest(&ray, f64::INFINITY, |crossing| scene.is_solid(crossing.object));
            let Some(meeting) = found else { break };
            let at = crate::surface_point::SurfacePoint::new(scene, &ray, &meeting);
            let object = meeting.crossing.object;
            if meeting.crossing.front {
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

    /// The media behind a surface of a solid, met from its front or its back.
    pub fn across(&self, object: usize, solid: &Object, front: bool) -> Self {
        let mut behind = self.clone();
        if front {
            behind.0.push(Layer::of(object, solid));
        } else if let Some(own) = behind.0.iter().rposition(|layer| layer.object == object) {
            behind.0.remove(own);
        }
        behind
    }

    /// On this side of a surface of a solid: inside of it if its back is met, whatever was known before (a surface that does not close has
    /// no way in).
    pub fn before(&self, object: usize, solid: &Object, front: bool) -> Self {
        let inside = self.0.iter().any(|layer| layer.object == object);
        let mut here = self.clone();
        if !front && !inside {
            here.0.push(Layer::of(object, solid));
        }
        here
    }

    /// The index of refraction here.
    pub fn index(&self) -> f64 {
        self.0.last().map_or(1.0, |layer| layer.index)
    }

    /// What is left of the light after so many metres here.
    #[inline]
    pub fn transmittance(&self, distance: f64) -> DVec3 {
        match self.0.last() {
            // What does not absorb lets through all of it, from infinity too.
            Some(layer) if layer.absorption != DVec3::ZERO => layer
                .absorption
                .map(|absorption| if absorption > 0.0 { (-absorption * distance).exp() } else { 1.0 }),
            _ => DVec3::ONE,
        }
    }

    /// The solid here, if there is one.
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
