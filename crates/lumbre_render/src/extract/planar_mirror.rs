//! A planar mirror in the world: its plane, and which part of the light it reflects. Not what is seen in it: that is a view of its own (`mirror_views`).

use bytemuck::{Pod, Zeroable};
use glam::{DAffine3, DVec3, DVec4, Vec3};
use lumbre_mesh::MeshPlane;
use lumbre_optics::Material;
use lumbre_scene::Medium;

use crate::layout::coefficient;

/// A flat surface that mirrors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PlanarMirror {
    /// A point p is on its front where the dot product with (p, 1) is positive; in the world, in metres, with a normal of unit length.
    pub plane: DVec4,
    /// k_r.
    pub mirror: Vec3,
    /// k_t, where Fresnel's equations divide it; else 0, for all of it passes.
    pub transmission: Vec3,
    /// Index of refraction.
    pub ior: f32,
    /// A sheet without an inside.
    pub thin: bool,
}

impl PlanarMirror {
    /// Of a flat mesh in the world; `None` where its transform has no inverse.
    pub fn new(
        mesh: MeshPlane,
        world_from_mesh: &DAffine3,
        material: &Material,
        medium: Option<&Medium>,
    ) -> Option<Self> {
        // A plane's normal goes the inverse transposed way, and the front stays the front, whether the transform mirrors or not.
        let normal = world_from_mesh.matrix3.inverse().transpose() * mesh.normal;
        let normal = normal.try_normalize().filter(|normal| normal.is_finite())?;
        let point = world_from_mesh.transform_point3(mesh.point);
        let medium = medium.copied().unwrap_or_default();
        Some(Self {
            plane: normal.extend(-normal.dot(point)),
            mirror: coefficient(material.mirror),
            transmission: if medium.fresnel { coefficient(material.transmission) } else { Vec3::ZERO },
            ior: if material.ior.is_finite() { material.ior.max(0.0) } else { 1.0 },
            thin: medium.thin,
        })
    }

    /// The largest part of the light that it can reflect, in any channel.
    pub fn weight(&self) -> f64 {
        f64::from((self.mirror + self.transmission).abs().max_element())
    }

    /// Its plane, turned towards a viewer in this direction from it or at this point, with whether that is its front. `None` from within the plane.
    pub fn facing(&self, viewer: DVec4) -> Option<(DVec4, bool)> {
        let side = self.plane.dot(viewer);
        let turned = if side > 0.0 { self.plane } else { -self.plane };
        (side != 0.0 && side.is_finite()).then_some((turned, side > 0.0))
    }
}

/// A mirror in the plane of a view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MirrorSurface {
    /// Of its object.
    pub slot: usize,
    /// What lies behind it is drawn through it where the camera sees it.
    pub refracts: bool,
    pub data: MirrorData,
}

/// `Mirror`: what a surface makes of what it mirrors.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct MirrorData {
    /// k_r.
    mirror: Vec3,
    /// Of the medium behind the surface to that before it.
    eta: f32,
    /// k_t.
    transmission: Vec3,
    /// 1 for a sheet, which both of its faces make brighter.
    thin: f32,
    /// Unit, towards the viewer.
    normal: Vec3,
    /// 1 where rays of sight are parallel.
    parallel: f32,
    /// What lies behind everything, as radiance.
    background: Vec3,
    padding: f32,
}

impl MirrorData {
    /// Of a mirror whose plane is turned towards the viewer, who may be in front of it or behind, and infinitely far.
    pub fn new(mirror: &PlanarMirror, plane: DVec4, front: bool, parallel: bool, background: Vec3) -> Self {
        let flag = |on: bool| if on { 1.0 } else { 0.0 };
        // Seen from behind a solid's surface, the viewer is inside.
        let inside = !front && !mirror.thin && mirror.ior > 0.0;
        Self {
            mirror: mirror.mirror,
            eta: if inside { 1.0 / mirror.ior } else { mirror.ior },
            transmission: mirror.transmission,
            thin: flag(mirror.thin),
            normal: plane.truncate().as_vec3(),
            parallel: flag(parallel),
            background,
            padding: 0.0,
        }
    }
}

/// The mirror image of a point or, with `w` 0, of a direction in a plane.
pub(crate) fn mirror_image(plane: DVec4, point: DVec3, w: f64) -> DVec3 {
    point - 2.0 * plane.dot(point.extend(w)) * plane.truncate()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn its_plane_follows_any_transform_and_keeps_its_front() {
        let mesh = MeshPlane { point: DVec3::new(0.5, 0.25, 0.0), normal: DVec3::Z };
        let material = Material { mirror: Vec3::splat(0.5), ..Material::default() };
        for scale in [DVec3::new(2.0, 3.0, 0.5), DVec3::new(-1.0, 1.0, 1.0), DVec3::new(1.0, 2.0, -4.0)] {
            let transform = DAffine3::from_translation(DVec3::new(10.0, -4.0, 2.0))
                * DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7)
                * DAffine3::from_scale(scale);
            let mirror = PlanarMirror::new(mesh, &transform, &material, None).unwrap();
            let on = transform.transform_point3(DVec3::new(-3.0, 7.0, 0.0)).extend(1.0);
            let before = transform.transform_point3(DVec3::new(-3.0, 7.0, 0.1)).extend(1.0);
            assert!(mirror.plane.dot(on).abs() < 1e-12 && mirror.plane.dot(before) > 0.0, "{scale}");
            assert!((mirror.plane.truncate().length() - 1.0).abs() < 1e-12);
            let image = mirror_image(mirror.plane, before.truncate(), 1.0);
            assert!((mirror.plane.dot(image.extend(1.0)) + mirror.plane.dot(before)).abs() < 1e-12);
        }
        let flattened = DAffine3::from_scale(DVec3::new(0.0, 0.0, 1.0));
        assert_eq!(PlanarMirror::new(mesh, &flattened, &material, None), None);
    }
}
