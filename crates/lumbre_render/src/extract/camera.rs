//! The camera of a frame: which one, and its matrices. Not its tone curve: that is the display pass.

use bevy_ecs::prelude::*;
use glam::{DMat3, DMat4, DVec3, DVec4};
use lumbre_scene::{ActiveCamera, Camera, GlobalTransform, Projection};

use crate::RenderError;

/// What a camera sees, as its projection tells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ViewVolume {
    /// Half the frame's width and height at depth 1, and the near plane's depth in metres.
    Perspective { half_width: f64, half_height: f64, near: f64 },
    /// Half the frame's width and height, negative where it is mirrored, and both planes' depths, all in metres.
    Orthographic { half_width: f64, half_height: f64, near: f64, far: f64 },
}

/// A camera in the world, with an orthonormal basis and a reversed-Z projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CameraView {
    pub eye: DVec3,
    /// Columns: right, up, backward.
    pub basis: DMat3,
    pub exposure: f32,
    pub volume: ViewVolume,
    clip_from_view: DMat4,
}

/// The asked-for camera, else the active one, else the first.
pub(crate) fn find_camera(world: &mut World, asked: Option<Entity>) -> Result<Entity, RenderError> {
    if let Some(entity) = asked {
        let there = world.get::<Camera>(entity).is_some() && world.get::<GlobalTransform>(entity).is_some();
        return if there { Ok(entity) } else { Err(RenderError::NotACamera { entity }) };
    }
    let mut cameras = world.query_filtered::<(Entity, Has<ActiveCamera>), With<Camera>>();
    let found = cameras.iter(world).min_by_key(|(entity, active)| (!active, entity.index_u32()));
    found.map(|(entity, _)| entity).ok_or(RenderError::NoCamera)
}

impl CameraView {
    /// The camera of an entity for a target of this aspect ratio.
    pub fn new(world: &World, entity: Entity, aspect: f64) -> Result<Self, RenderError> {
        let (Some(camera), Some(transform)) =
            (world.get::<Camera>(entity), world.get::<GlobalTransform>(entity))
        else {
            return Err(RenderError::NotACamera { entity });
        };
        let bad = |field, value, wanted| RenderError::BadCamera { entity, field, value, wanted };
        let eye = transform.translation();
        if !eye.is_finite() {
            return Err(bad("translation", eye.x + eye.y + eye.z, "finite"));
        }
        if !(camera.exposure > 0.0 && camera.exposure.is_finite()) {
            return Err(bad("exposure", f64::from(camera.exposure), "greater than 0 and finite"));
        }
        let (clip_from_view, volume) = match camera.projection {
            Projection::Perspective { vertical_fov, near, .. } => {
                if !(vertical_fov > 0.0 && vertical_fov < std::f64::consts::PI) {
                    return Err(bad("vertical_fov", vertical_fov, "between 0 and pi radians"));
                }
                if !(near > 0.0 && near.is_finite()) {
                    return Err(bad("near", near, "greater than 0 metres"));
                }
                let half_height = (0.5 * vertical_fov).tan();
                let volume = ViewVolume::Perspective { half_width: half_height * aspect, half_height, near };
                (perspective_reversed(vertical_fov, aspect, near), volume)
            }
            Projection::Orthographic { half_width, half_height, near, far } => {
                if !(half_width != 0.0 && half_width.is_finite()) {
                    return Err(bad("half_width", half_width, "a finite number of metres other than 0"));
                }
                if !(half_height != 0.0 && half_height.is_finite()) {
                    return Err(bad("half_height", half_height, "a finite number of metres other than 0"));
                }
                if !(far > near && near.is_finite() && far.is_finite()) {
                    return Err(bad("far", far, "greater than `near`"));
                }
                let volume = ViewVolume::Orthographic { half_width, half_height, near, far };
                (orthographic_reversed(half_width, half_height, near, far), volume)
            }
        };
        let axes = transform.0.matrix3;
        let backward = axes.z_axis.try_normalize().unwrap_or(DVec3::Z);
        let up = axes.y_axis.reject_from_normalized(backward);
        let up = up.try_normalize().unwrap_or_else(|| backward.any_orthonormal_vector());
        let basis = DMat3::from_cols(up.cross(backward), up, backward);
        Ok(Self { eye, basis, exposure: camera.exposure, volume, clip_from_view })
    }

    /// From frame space, whose origin stands at `origin` in the world, to clip space.
    pub fn clip_from_frame(&self, origin: DVec3) -> DMat4 {
        let rotation = self.basis.transpose();
        let view = DMat4::from_cols(
            rotation.x_axis.extend(0.0),
            rotation.y_axis.extend(0.0),
            rotation.z_axis.extend(0.0),
            (rotation * (origin - self.eye)).extend(1.0),
        );
        self.clip_from_view * view
    }

    /// Planes of the view volume in frame space, normals inwards, of unit length; there is no far plane.
    pub fn frustum(&self, origin: DVec3) -> [DVec4; 5] {
        let m = self.clip_from_frame(origin).transpose();
        [
            m.w_axis + m.x_axis,
            m.w_axis - m.x_axis,
            m.w_axis + m.y_axis,
            m.w_axis - m.y_axis,
            m.w_axis - m.z_axis,
        ]
        .map(|plane| plane / plane.truncate().length().max(f64::MIN_POSITIVE))
    }
}

/// Depth 1 at the near plane, 0 at infinity: f32's precision is spread evenly over the logarithm of distance.
fn perspective_reversed(vertical_fov: f64, aspect: f64, near: f64) -> DMat4 {
    let focal = 1.0 / (0.5 * vertical_fov).tan();
    DMat4::from_cols(
        DVec4::new(focal / aspect, 0.0, 0.0, 0.0),
        DVec4::new(0.0, focal, 0.0, 0.0),
        DVec4::new(0.0, 0.0, 0.0, -1.0),
        DVec4::new(0.0, 0.0, near, 0.0),
    )
}

/// Depth 1 at the near plane, 0 at the far plane.
fn orthographic_reversed(half_width: f64, half_height: f64, near: f64, far: f64) -> DMat4 {
    let depth = far - near;
    DMat4::from_cols(
        DVec4::new(1.0 / half_width, 0.0, 0.0, 0.0),
        DVec4::new(0.0, 1.0 / half_height, 0.0, 0.0),
        DVec4::new(0.0, 0.0, 1.0 / depth, 0.0),
        DVec4::new(0.0, 0.0, far / depth, 1.0),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depth_is_one_at_the_near_plane_and_zero_far_away() {
        let perspective = perspective_reversed(1.0, 1.5, 0.1);
        assert!((perspective.project_point3(DVec3::new(0.0, 0.0, -0.1)).z - 1.0).abs() < 1e-12);
        assert!((perspective.project_point3(DVec3::new(0.0, 0.0, -1e6)).z - 1e-7).abs() < 1e-12);
        let orthographic = orthographic_reversed(1.0, 1.0, 1.0, 3.0);
        assert!((orthographic.project_point3(DVec3::new(0.0, 0.0, -1.0)).z - 1.0).abs() < 1e-12);
        assert!(orthographic.project_point3(DVec3::new(0.0, 0.0, -3.0)).z.abs() < 1e-12);
    }

    #[test]
    fn the_frustum_holds_what_projects_into_the_frame() {
        let mut world = World::new();
        let transform =
            lumbre_scene::Transform::from_xyz(3.0, 2.0, 8.0).looking_at(DVec3::new(0.5, 0.0, 0.0), DVec3::Y);
        let entity = world.spawn((Camera::default(), GlobalTransform(transform.affine()))).id();
        let view = CameraView::new(&world, entity, 1.3).unwrap();
        let origin = DVec3::new(1.0, -2.0, 0.25);
        let planes = view.frustum(origin);
        let clip_from_frame = view.clip_from_frame(origin);
        for step in 0..1000 {
            let t = f64::from(step);
            let point = DVec3::new((t * 0.37).sin(), (t * 0.73).sin(), (t * 0.11).cos()) * 12.0 - origin;
            let clip = clip_from_frame * point.extend(1.0);
            let inside = clip.x.abs() <= clip.w && clip.y.abs() <= clip.w && clip.z <= clip.w && clip.w > 0.0;
            let held = planes.iter().all(|plane| plane.dot(point.extend(1.0)) >= 0.0);
            assert_eq!(inside, held, "{point}");
        }
    }
}
