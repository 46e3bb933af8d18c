//! Camera rays through points of the picture, with the same projection as a frame. Which points are sampled
//! is decided in `film` and `view`.

use bevy_ecs::prelude::*;
use glam::{DMat3, DVec2, DVec3};
use lumbre_scene::{ActiveCamera, Camera, GlobalTransform, Projection};

use crate::TraceError;
use crate::geometry::SpaceRay;

/// A camera in the world, for a picture of a given size.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CameraRays {
    /// Position in the world, metres.
    pub eye: DVec3,
    /// Columns: right, up and backward, unit vectors in the world.
    pub basis: DMat3,
    /// The factor on radiance for display.
    pub exposure: f32,
    projection: Projection,
    size: DVec2,
    /// Position in the tracer's space, metres.
    origin: DVec3,
}

/// A camera ray, which starts at the near plane, and the distance to the far plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CameraRay {
    pub ray: SpaceRay,
    /// Metres along the ray to the far plane of a parallel projection; infinite for a perspective one, which
    /// has none.
    pub farthest: f64,
}

impl CameraRays {
    /// Reads the camera `asked` for, or else the active one, or else the first.
    pub fn new(world: &mut World, asked: Option<Entity>, size: (u32, u32)) -> Result<Self, TraceError> {
        let entity = find(world, asked)?;
        let (Some(camera), Some(place)) = (world.get::<Camera>(entity), world.get::<GlobalTransform>(entity))
        else {
            return Err(TraceError::NotACamera { entity });
        };
        let eye = place.translation();
        check(camera, eye)?;
        let axes = place.0.matrix3;
        let backward = axes.z_axis.try_normalize().unwrap_or(DVec3::Z);
        let up = axes.y_axis.reject_from_normalized(backward).try_normalize();
        let up = up.unwrap_or_else(|| backward.any_orthonormal_vector());
        Ok(Self {
            eye,
            basis: DMat3::from_cols(up.cross(backward), up, backward),
            exposure: camera.exposure,
            projection: camera.projection,
            size: DVec2::new(f64::from(size.0), f64::from(size.1)),
            origin: eye,
        })
    }

    /// Returns the same camera with another origin of the tracer's space.
    pub fn relative_to(self, origin: DVec3) -> Self {
        Self { origin: self.eye - origin, ..self }
    }

    /// Returns the ray through a point in pixels, where (0, 0) is the picture's upper left corner. It starts
    /// at the near plane, as in a frame.
    pub fn through(&self, place: DVec2) -> CameraRay {
        let x = 2.0 * place.x / self.size.x - 1.0;
        let y = 1.0 - 2.0 * place.y / self.size.y;
        let basis = &self.basis;
        let (forward, aspect) = (-basis.z_axis, self.size.x / self.size.y);
        match self.projection {
            Projection::Perspective { vertical_fov, near, .. } => {
                let half = (0.5 * vertical_fov).tan();
                let to = forward + basis.x_axis * (x * half * aspect) + basis.y_axis * (y * half);
                let direction = to.normalize();
                let ray = SpaceRay::new(self.origin + to * near, direction);
                CameraRay { ray, farthest: f64::INFINITY }
            }
            Projection::Orthographic { half_width, half_height, near, far } => {
                let start = self.origin + basis.x_axis * (x * half_width) + basis.y_axis * (y * half_height);
                let ray = SpaceRay::new(start + forward * near, forward);
                CameraRay { ray, farthest: far - near }
            }
        }
    }

    /// Returns the distance in metres along the viewing axis from the eye to a point of the tracer's space,
    /// which a frame's fog uses.
    pub fn depth(&self, point: DVec3) -> f64 {
        (self.origin - point).dot(self.basis.z_axis)
    }

    /// Returns true for a parallel projection, whose rays start in different points.
    pub fn is_parallel(&self) -> bool {
        matches!(self.projection, Projection::Orthographic { .. })
    }

    /// Returns the eye's position in the tracer's space, metres.
    pub fn place(&self) -> DVec3 {
        self.origin
    }
}

fn find(world: &mut World, asked: Option<Entity>) -> Result<Entity, TraceError> {
    if let Some(entity) = asked {
        let there = world.get_entity(entity).is_ok_and(|found| found.contains::<Camera>());
        return if there { Ok(entity) } else { Err(TraceError::NotACamera { entity }) };
    }
    let mut cameras = world.query_filtered::<(Entity, Has<ActiveCamera>), With<Camera>>();
    let found = cameras.iter(world).min_by_key(|(entity, active)| (!active, entity.index_u32()));
    found.map(|(entity, _)| entity).ok_or(TraceError::NoCamera)
}

fn check(camera: &Camera, eye: DVec3) -> Result<(), TraceError> {
    let bad = |field, value, wanted| Err(TraceError::BadCamera { field, value, wanted });
    if !eye.is_finite() {
        return bad("translation", eye.x + eye.y + eye.z, "finite");
    }
    if !(camera.exposure > 0.0 && camera.exposure.is_finite()) {
        return bad("exposure", f64::from(camera.exposure), "greater than 0 and finite");
    }
    match camera.projection {
        Projection::Perspective { vertical_fov, near, .. } => {
            if !(vertical_fov > 0.0 && vertical_fov < std::f64::consts::PI) {
                return bad("vertical_fov", vertical_fov, "between 0 and pi radians");
            }
            if !(near > 0.0 && near.is_finite()) {
                return bad("near", near, "greater than 0 metres");
            }
        }
        Projection::Orthographic { half_width, half_height, near, far } => {
            for (field, value) in [("half_width", half_width), ("half_height", half_height)] {
                if !(value != 0.0 && value.is_finite()) {
                    return bad(field, value, "a finite number of metres other than 0");
                }
            }
            if !(far > near && near.is_finite() && far.is_finite()) {
                return bad("far", far, "greater than `near`");
            }
        }
    }
    Ok(())
}
