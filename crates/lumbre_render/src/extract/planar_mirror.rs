//! A planar mirror in the world: its plane, and how much light it reflects. What is visible in it is a view
//! of its own (`mirror_views`).

use bytemuck::{Pod, Zeroable};
use glam::{DAffine3, DVec3, DVec4, Vec3};
use lumbre_mesh::MeshPlane;
use lumbre_optics::Material;
use lumbre_scene::Medium;

use crate::layout::coefficient;

/// A flat reflective surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PlanarMirror {
    /// A point p in front of the mirror has a positive dot product of the plane with (p, 1). In the world, in
    /// metres, with a normal of unit length.
    pub plane: DVec4,
    /// k_r.
    pub mirror: Vec3,
    /// k_t if Fresnel's equations split it into reflected and transmitted light; otherwise 0, because all of
    /// it is transmitted.
    pub transmission: Vec3,
    /// Index of refraction.
    pub ior: f32,
    /// A sheet without an interior.
    pub thin: bool,
}

impl PlanarMirror {
    /// Creates the mirror of a flat mesh in the world; `None` if its transform has no inverse.
    pub fn new(
        mesh: MeshPlane,
        world_from_mesh: &DAffine3,
        material: &Material,
        medium: Option<&Medium>,
    ) -> Option<Self> {
        // Normals transform by the inverse transpose, and the front stays the front even if the transform
        // mirrors.
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

    /// Returns the largest fraction of light that it can reflect in any channel.
    pub fn weight(&self) -> f64 {
        f64::from((self.mirror + self.transmission).abs().max_element())
    }

    /// Returns its plane, turned towards a viewer at a point or in a direction (`w` 0), and whether that is
    /// its front. `None` if the viewer lies in the plane.
    pub fn facing(&self, viewer: DVec4) -> Option<(DVec4, bool)> {
        let side = self.plane.dot(viewer);
        let turned = if side > 0.0 { self.plane } else { -self.plane };
        (side != 0.0 && side.is_finite()).then_some((turned, side > 0.0))
    }
}

/// A mirror in the plane of a view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MirrorSurface {
    /// Slot of its object.
    pub slot: usize,
    /// Whether what lies behind it is visible through it in the camera's view.
    pub refracts: bool,
    pub data: MirrorData,
}

/// `Mirror` of shaders/mirror.wesl: how a surface reflects what is visible in it.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct MirrorData {
    /// k_r.
    mirror: Vec3,
    /// Index of refraction of the medium behind the surface relative to that in front of it.
    eta: f32,
    /// k_t.
    transmission: Vec3,
    /// 1 for a sheet, whose two faces both reflect.
    thin: f32,
    /// Unit vector towards the viewer.
    normal: Vec3,
    /// 1 if the rays of the view are parallel.
    parallel: f32,
    /// Radiance of the background.
    background: Vec3,
    padding: f32,
}

impl MirrorData {
    /// Creates the data of a mirror whose plane faces the viewer. `front` is true if the viewer is in front
    /// of the mirror, `parallel` if the viewer is at infinity.
    pub fn new(mirror: &PlanarMirror, plane: DVec4, front: bool, parallel: bool, background: Vec3) -> Self {
        let flag = |on: bool| if on { 1.0 } else { 0.0 };
        // Behind the surface of a solid body, the viewer is inside the body.
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

/// Returns the mirror image in a plane of a point or, with `w` 0, of a direction.
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
