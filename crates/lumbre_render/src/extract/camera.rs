//! The camera of a frame: which one is used, its matrices, and its mirror image. The tone curve belongs to
//! the display pass.

use bevy_ecs::prelude::*;
use glam::{DMat3, DMat4, DVec2, DVec3, DVec4};
use lumbre_scene::{ActiveCamera, Camera, GlobalTransform, Projection};

use super::planar_mirror::mirror_image;
use crate::RenderError;

/// The volume that a camera sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ViewVolume {
    /// Half the frame's width and height at depth 1, and the depth of the near plane in metres.
    Perspective { half_width: f64, half_height: f64, near: f64 },
    /// Half the frame's width and height, negative if mirrored, and the depths of near and far plane, all in
    /// metres.
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
    /// The part of the frame that is drawn.
    pub window: Window,
    clip_from_view: DMat4,
}

/// The directions of the pixels of a frame, perpendicular to the line of sight: in metres per metre of depth,
/// or in metres if the rays are parallel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PixelRays {
    /// From the eye to the frame's upper left corner.
    pub corner: DVec3,
    /// One pixel to the right.
    pub right: DVec3,
    /// One pixel down.
    pub down: DVec3,
    pub parallel: bool,
}

/// A rectangle of the frame in normalized device coordinates, from -1 to 1, x to the right and y up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Window {
    pub low: DVec2,
    pub high: DVec2,
}

impl Window {
    /// The whole frame.
    pub const WHOLE: Self = Self { low: DVec2::NEG_ONE, high: DVec2::ONE };

    /// Returns the smallest rectangle that contains both.
    pub fn and(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Returns the fraction of the frame that it covers, at most 1.
    pub fn area(&self) -> f64 {
        let size = self.high - self.low;
        0.25 * size.x * size.y
    }

    /// Returns the pixels of a frame of this size that it touches: x and y of the upper left corner, width
    /// and height.
    pub fn pixels(&self, [width, height]: [u32; 2]) -> [u32; 4] {
        let axis = |low: f64, high: f64, size: u32| {
            let at = |coordinate: f64| 0.5 * (coordinate + 1.0) * f64::from(size);
            let first = at(low).floor().clamp(0.0, f64::from(size.saturating_sub(1)));
            let last = at(high).ceil().clamp(first + 1.0, f64::from(size.max(1)));
            [first as u32, (last - first) as u32]
        };
        let [x, wide] = axis(self.low.x, self.high.x, width);
        // Rows count downwards.
        let [y, high] = axis(-self.high.y, -self.low.y, height);
        [x, y, wide, high]
    }
}

/// Returns the camera that was asked for, or else the active one, or else the first one.
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
    /// Creates the view of a camera entity for a target with this aspect ratio.
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
        Ok(Self { eye, basis, exposure: camera.exposure, volume, window: Window::WHOLE, clip_from_view })
    }

    /// Returns the transform to clip space from frame space, whose origin in the world is `origin`.
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

    /// Returns the reflection of this view in a mirror. Eye and axes are mirror images, so that an object is
    /// drawn at the pixel where this view sees its reflection. The near plane is the plane of the mirror,
    /// which clips what lies behind it. The plane is given in world space and faces this view; only `window`
    /// of the frame is drawn. `None` if no point of the window lies in front of the mirror.
    ///
    /// The oblique near plane follows Lengyel, "Oblique View Frustum Depth Projection and Clipping", Journal
    /// of Game Development 1(2), 2005, adapted to reversed depth: z/w = 1 - a d/w at a distance d from the
    /// mirror, with the largest a that keeps every point of the window above 0.
    pub fn reflected(&self, plane: DVec4, window: Window) -> Option<Self> {
        let eye = mirror_image(plane, self.eye, 1.0);
        let axis = |axis: DVec3| mirror_image(plane, axis, 0.0);
        let basis =
            DMat3::from_cols(axis(self.basis.x_axis), axis(self.basis.y_axis), axis(self.basis.z_axis));
        let in_view = (basis.transpose() * plane.truncate()).extend(plane.dot(eye.extend(1.0)));
        let corners = [window.low, window.high].map(|x| [window.low, window.high].map(|y| [x.x, y.y]));
        let corners = corners.into_iter().flatten();
        let farthest = match self.volume {
            // The distance from the mirror grows with depth along each direction, by this much per metre.
            ViewVolume::Perspective { half_width, half_height, .. } => corners
                .map(|[x, y]| in_view.dot(DVec4::new(x * half_width, y * half_height, -1.0, 0.0)))
                .fold(0.0, f64::max),
            ViewVolume::Orthographic { half_width, half_height, near, far } => corners
                .flat_map(|[x, y]| [near, far].map(|z| DVec4::new(x * half_width, y * half_height, -z, 1.0)))
                .map(|corner| in_view.dot(corner))
                .fold(0.0, f64::max),
        };
        if farthest <= 0.0 {
            return None;
        }
        let mut rows = self.clip_from_view.transpose();
        rows.z_axis = rows.w_axis - in_view / farthest;
        Some(Self { eye, basis, window, clip_from_view: rows.transpose(), ..*self })
    }

    /// Returns true if the view is reflected an odd number of times. The front faces of triangles then have
    /// the opposite winding.
    pub fn is_mirrored(&self) -> bool {
        self.basis.determinant() < 0.0
    }

    /// Returns the eye in the world, or for an infinitely distant viewer the direction towards it, with `w`
    /// 0.
    pub fn viewer(&self) -> DVec4 {
        match self.volume {
            ViewVolume::Perspective { .. } => self.eye.extend(1.0),
            ViewVolume::Orthographic { .. } => self.basis.z_axis.extend(0.0),
        }
    }

    /// Returns the directions of the pixels of a frame of this size.
    pub fn pixel_rays(&self, [width, height]: [u32; 2]) -> PixelRays {
        let (half_width, half_height, parallel) = match self.volume {
            ViewVolume::Perspective { half_width, half_height, .. } => (half_width, half_height, false),
            ViewVolume::Orthographic { half_width, half_height, .. } => (half_width, half_height, true),
        };
        let (right, up) = (self.basis.x_axis * half_width, self.basis.y_axis * half_height);
        PixelRays {
            corner: up - right,
            right: right * (2.0 / f64::from(width.max(1))),
            down: up * (-2.0 / f64::from(height.max(1))),
            parallel,
        }
    }

    /// Returns the part of the window in which an axis-aligned box of the world may be visible; `None` if it
    /// is outside.
    pub fn window_of_box(&self, center: DVec3, half_size: DVec3) -> Option<Window> {
        let clip = self.clip_from_frame(center);
        let corner = |index: usize| {
            let side = |axis: usize| if index & (1 << axis) == 0 { -1.0 } else { 1.0 };
            clip * (DVec3::new(side(0), side(1), side(2)) * half_size).extend(1.0)
        };
        let corners: [DVec4; 8] = std::array::from_fn(corner);
        // Positive in front of the near plane.
        let before = |point: DVec4| point.w - point.z;
        let mut low = DVec2::INFINITY;
        let mut high = DVec2::NEG_INFINITY;
        let mut hold = |point: DVec4| {
            // At the near plane of a perspective view w is positive, but rounding may give 0.
            let projected = point.truncate().truncate() / point.w.max(f64::MIN_POSITIVE);
            (low, high) = (low.min(projected), high.max(projected));
        };
        for (index, from) in corners.iter().enumerate() {
            if before(*from) >= 0.0 {
                hold(*from);
            }
            for axis in 0..3 {
                let to = corners[index | (1 << axis)];
                let (a, b) = (before(*from), before(to));
                if (a < 0.0) != (b < 0.0) {
                    hold(from.lerp(to, a / (a - b)));
                }
            }
        }
        let window = Window { low: low.max(self.window.low), high: high.min(self.window.high) };
        (window.low.cmplt(window.high).all()).then_some(window)
    }

    /// Returns a part of the window that contains every visible point of a sphere in the world.
    pub fn window_of_sphere(&self, center: DVec3, radius: f64) -> Window {
        let in_view = self.basis.transpose() * (center - self.eye);
        let depth = -in_view.z;
        let scale = match self.volume {
            ViewVolume::Perspective { half_width, half_height, near } => {
                if depth - radius < near {
                    return self.window;
                }
                DVec2::new(half_width, half_height)
            }
            ViewVolume::Orthographic { half_width, half_height, .. } => DVec2::new(half_width, half_height),
        };
        // Bounds the box around the sphere: by its nearer face on the side away from the line of sight,
        // otherwise by the farther one.
        let edge = |at: f64, outwards: bool| match self.volume {
            ViewVolume::Perspective { .. } => at / if outwards { depth - radius } else { depth + radius },
            ViewVolume::Orthographic { .. } => at,
        };
        let low = (in_view.truncate() - radius).map(|at| edge(at, at < 0.0)) / scale;
        let high = (in_view.truncate() + radius).map(|at| edge(at, at > 0.0)) / scale;
        let (low, high) = (low.min(high), low.max(high));
        let low = low.clamp(self.window.low, self.window.high);
        Window { low, high: high.clamp(low, self.window.high) }
    }

    /// Returns the corners of the drawn volume between two depths along the line of sight, in frame space.
    pub fn corners(&self, origin: DVec3, depths: [f64; 2]) -> [DVec3; 8] {
        let (eye, window) = (self.eye - origin, self.window);
        std::array::from_fn(|index| {
            let side = |axis: usize, low, high| if index & (1 << axis) == 0 { low } else { high };
            let at = [side(0, window.low.x, window.high.x), side(1, window.low.y, window.high.y)];
            let depth = side(2, depths[0], depths[1]);
            let [x, y] = match self.volume {
                ViewVolume::Perspective { half_width, half_height, .. } => {
                    [at[0] * half_width * depth, at[1] * half_height * depth]
                }
                ViewVolume::Orthographic { half_width, half_height, .. } => {
                    [at[0] * half_width, at[1] * half_height]
                }
            };
            eye + self.basis * DVec3::new(x, y, -depth)
        })
    }

    /// Returns the planes of the drawn volume in frame space, with inward normals of unit length. There is no
    /// far plane.
    pub fn frustum(&self, origin: DVec3) -> [DVec4; 5] {
        let m = self.clip_from_frame(origin).transpose();
        let Window { low, high } = self.window;
        [
            m.x_axis - low.x * m.w_axis,
            high.x * m.w_axis - m.x_axis,
            m.y_axis - low.y * m.w_axis,
            high.y * m.w_axis - m.y_axis,
            m.w_axis - m.z_axis,
        ]
        .map(|plane| plane / plane.truncate().length().max(f64::MIN_POSITIVE))
    }
}

/// Returns a projection with depth 1 at the near plane and 0 at infinity. This spreads the precision of f32
/// evenly over the logarithm of the distance.
fn perspective_reversed(vertical_fov: f64, aspect: f64, near: f64) -> DMat4 {
    let focal = 1.0 / (0.5 * vertical_fov).tan();
    DMat4::from_cols(
        DVec4::new(focal / aspect, 0.0, 0.0, 0.0),
        DVec4::new(0.0, focal, 0.0, 0.0),
        DVec4::new(0.0, 0.0, 0.0, -1.0),
        DVec4::new(0.0, 0.0, near, 0.0),
    )
}

/// Returns a projection with depth 1 at the near plane and 0 at the far plane.
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
    fn what_is_seen_of_a_sphere_is_in_its_window() {
        for projection in [
            Projection::Perspective { vertical_fov: 1.2, aspect: None, near: 0.1, far: None },
            Projection::Orthographic { half_width: -4.0, half_height: 3.0, near: 0.1, far: 50.0 },
        ] {
            let mut world = World::new();
            let transform = lumbre_scene::Transform::from_xyz(1.0, 2.0, 3.0);
            let transform = transform.looking_at(DVec3::new(0.5, 0.0, -4.0), DVec3::Y);
            let camera = Camera { projection, exposure: 1.0 };
            let entity = world.spawn((camera, GlobalTransform(transform.affine()))).id();
            let view = CameraView::new(&world, entity, 1.3).unwrap();
            let clip_from_world = view.clip_from_frame(DVec3::ZERO);
            let mut narrow = 0;
            for step in 0..400 {
                let t = f64::from(step);
                let along = |t: f64| DVec3::new((t * 0.37).sin(), (t * 0.73).sin(), (t * 0.11).cos());
                let (center, radius) = (along(t) * 6.0 - 2.0 * DVec3::Z, 0.1 + (0.31 * t).sin().abs());
                let window = view.window_of_sphere(center, radius);
                narrow += usize::from(window.area() < 0.1);
                for part in 0..64 {
                    let direction = along(f64::from(part) * 3.1 + 0.5).normalize();
                    let clip = clip_from_world * (center + direction * radius).extend(1.0);
                    let at = clip.truncate().truncate() / clip.w;
                    let seen = clip.w > 0.0 && clip.z <= clip.w && at.abs().max_element() <= 1.0;
                    let held = at.cmpge(window.low - 1e-12).all() && at.cmple(window.high + 1e-12).all();
                    assert!(held || !seen, "{at} of a sphere at {center} is outside {window:?}");
                }
            }
            assert!(narrow > 100, "{narrow}");
        }
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

    /// Cameras of both kinds in front of a tilted mirror, with the mirror's plane facing the camera.
    fn before_a_mirror() -> Vec<(CameraView, DVec4)> {
        let mut world = World::new();
        let transform =
            lumbre_scene::Transform::from_xyz(3.0, 2.0, 8.0).looking_at(DVec3::new(0.5, 0.0, 0.0), DVec3::Y);
        let projections = [
            Projection::Perspective { vertical_fov: 0.9, aspect: None, near: 0.1, far: None },
            Projection::Orthographic { half_width: 3.0, half_height: 2.0, near: 0.5, far: 40.0 },
        ];
        let normal = DVec3::new(0.2, 0.1, 1.0).normalize();
        let plane = normal.extend(-normal.dot(DVec3::new(0.0, 0.0, -1.0)));
        let view = |projection| {
            let camera = Camera { projection, ..Camera::default() };
            let entity = world.spawn((camera, GlobalTransform(transform.affine()))).id();
            (CameraView::new(&world, entity, 1.5).unwrap(), plane)
        };
        projections.map(view).to_vec()
    }

    #[test]
    fn a_reflected_view_has_images_where_the_view_has_what_they_are_images_of() {
        for (view, plane) in before_a_mirror() {
            let origin = DVec3::new(0.3, -1.0, 2.0);
            let reflected = view.reflected(plane, Window::WHOLE).unwrap();
            assert!(reflected.is_mirrored() && !view.is_mirrored());
            let (whole, mirrored) = (view.clip_from_frame(origin), reflected.clip_from_frame(origin));
            let mut inside = 0;
            for step in 0..2000 {
                let t = f64::from(step);
                let point = DVec3::new((t * 0.37).sin(), (t * 0.73).sin(), (t * 0.11).cos()) * 9.0;
                let distance = plane.dot(point.extend(1.0));
                let image = mirror_image(plane, point, 1.0);
                let seen = mirrored * (point - origin).extend(1.0);
                let direct = whole * (image - origin).extend(1.0);
                let close = (seen.x - direct.x).abs().max((seen.y - direct.y).abs());
                assert!(close < 1e-12 * seen.w.abs().max(10.0), "{point}: {seen} and {direct}");
                if seen.w > 0.0 && seen.x.abs() < seen.w && seen.y.abs() < seen.w {
                    inside += 1;
                    assert_eq!(distance > 0.0, seen.z < seen.w, "{point}: {distance}, {seen}");
                    assert!(distance < 0.0 || seen.z >= -1e-12, "{point} is cut off: {seen}");
                }
            }
            assert!(inside > 50, "{inside}");
        }
    }

    #[test]
    fn a_view_in_two_mirrors_is_not_mirrored() {
        let (view, plane) = before_a_mirror()[0];
        let once = view.reflected(plane, Window::WHOLE).unwrap();
        // In the same mirror from behind, the second image is the original eye.
        let twice = once.reflected(-plane, Window::WHOLE).unwrap();
        assert!(!twice.is_mirrored() && (twice.eye - view.eye).length() < 1e-12);
    }

    #[test]
    fn the_window_of_a_box_holds_every_point_of_it_that_is_seen() {
        for (view, plane) in before_a_mirror() {
            for view in [view, view.reflected(plane, Window::WHOLE).unwrap()] {
                let clip_from_world = view.clip_from_frame(DVec3::ZERO);
                for step in 0..200 {
                    let t = f64::from(step);
                    let center = DVec3::new((t * 0.9).sin(), (t * 1.7).cos(), (t * 0.31).sin()) * 8.0;
                    let half = DVec3::new(2.0 + (t * 0.5).sin(), 0.0, 1.5);
                    let window = view.window_of_box(center, half);
                    for x in -4..=4 {
                        for z in -4..=4 {
                            let place = DVec3::new(f64::from(x), 0.0, f64::from(z)) / 4.0;
                            let clip = clip_from_world * (center + place * half).extend(1.0);
                            let at = DVec2::new(clip.x, clip.y) / clip.w;
                            let inside = at.abs().max_element() < 1.0 && clip.w > 0.0 && clip.z < clip.w;
                            let held = window.is_some_and(|window| {
                                (at.cmpge(window.low - 1e-9) & at.cmple(window.high + 1e-9)).all()
                            });
                            assert!(!inside || held, "{center} {at}: {window:?}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn a_window_covers_the_pixels_that_it_touches() {
        assert_eq!(Window::WHOLE.pixels([640, 360]), [0, 0, 640, 360]);
        let window = Window { low: DVec2::new(-0.5, 0.25), high: DVec2::new(0.0, 1.0) };
        assert_eq!(window.pixels([100, 80]), [25, 0, 25, 30]);
        assert!((window.area() - 0.09375).abs() < 1e-12);
    }
}
