//! The shadow views of a light, in frame space: one for a spotlight, six for a point light, cascades for a
//! directional light. Their tiles in the atlas are chosen in `atlas`.

use glam::{DMat3, DMat4, DVec3, DVec4};

use crate::extract::{CameraView, ViewVolume};
use crate::shadow_light::{CASCADES, ShadowKind, WIDEST_CONE};

/// Near plane of a view, in metres. Anything nearer to a light casts no shadow.
const NEAR: f64 = 0.01;
/// By how much a view is wider than what it covers, relative to half its side, so that a filter finds
/// neighbours.
const BORDER: f64 = 0.03;
/// Largest depth of the cascades, in metres.
const FARTHEST: f64 = 2000.0;

/// One view of a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct View {
    /// Transforms frame space to the view's clip space, reversed-Z.
    pub clip_from_frame: DMat4,
    /// The directions to the right, up, and backward.
    pub basis: DMat3,
    /// Width of the visible part of the world in metres; for a perspective view at a distance of one metre.
    pub width: f64,
    /// Near plane of a perspective view in metres, or the negative depth range of an orthographic one.
    pub near_or_depth: f64,
    /// Depth along the camera's line of sight at which a cascade ends.
    pub end: f64,
    /// Side in texels that the picture would need.
    pub wanted: f64,
}

/// The properties of a light that its views depend on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lamp {
    pub kind: ShadowKind,
    /// In frame space.
    pub position: DVec3,
    /// Direction that it shines in, of unit length.
    pub axis: DVec3,
    /// Half angle of its cone, in radians.
    pub cone: f64,
    /// In metres; may be infinite.
    pub range: f64,
}

/// The properties of the camera that cascades depend on.
#[derive(Clone, Debug)]
pub(super) struct Seen {
    pub view: CameraView,
    /// The camera's reflections in mirrors.
    pub reflected: Vec<CameraView>,
    pub origin: DVec3,
    /// Nearest and farthest depth of what is in view, in metres.
    pub depths: [f64; 2],
    /// Rows of the frame.
    pub height: u32,
    /// A sphere that contains all casters, in frame space.
    pub casters: (DVec3, f64),
    /// Factor on the default side of a map.
    pub resolution: f64,
}

impl Seen {
    /// Returns the largest side of a map, in texels.
    pub fn most_texels(&self) -> f64 {
        self.resolution * f64::from(super::atlas::MOST)
    }
}

/// Returns the views of a light, as many as its kind has.
pub(super) fn views(lamp: &Lamp, seen: &Seen) -> Vec<View> {
    match lamp.kind {
        ShadowKind::Cone => vec![cone(lamp, seen)],
        ShadowKind::Cube => cube(lamp, seen).to_vec(),
        ShadowKind::Cascades => cascades(lamp, seen),
    }
}

/// Columns: right, up, backward.
fn basis(forward: DVec3) -> DMat3 {
    let right = forward.any_orthonormal_vector();
    DMat3::from_cols(right, right.cross(forward), -forward)
}

fn view_from_frame(basis: DMat3, position: DVec3) -> DMat4 {
    let rotation = basis.transpose();
    DMat4::from_mat3(rotation) * DMat4::from_translation(-position)
}

/// Depth is 1 at the near plane and 0 at infinity.
fn perspective(tangent: f64, near: f64) -> DMat4 {
    DMat4::from_cols(
        DVec4::new(1.0 / tangent, 0.0, 0.0, 0.0),
        DVec4::new(0.0, 1.0 / tangent, 0.0, 0.0),
        DVec4::new(0.0, 0.0, 0.0, -1.0),
        DVec4::new(0.0, 0.0, near, 0.0),
    )
}

/// Returns the least number of rows of the picture that the sphere of a light covers. A map with that many
/// texels shows shadows as sharply as the picture can.
fn wanted(lamp: &Lamp, seen: &Seen) -> f64 {
    let eye = seen.view.eye - seen.origin;
    let half_height = match seen.view.volume {
        ViewVolume::Perspective { half_height, .. } => half_height * (lamp.position - eye).length().max(1e-3),
        ViewVolume::Orthographic { half_height, .. } => half_height.abs(),
    };
    let reach = if lamp.range.is_finite() { lamp.range } else { seen.casters.1 };
    seen.resolution * f64::from(seen.height) * (reach / half_height).min(1.0)
}

fn cone(lamp: &Lamp, seen: &Seen) -> View {
    let tangent = lamp.cone.clamp(1e-3, WIDEST_CONE).tan() * (1.0 + BORDER);
    let basis = basis(lamp.axis);
    View {
        clip_from_frame: perspective(tangent, NEAR) * view_from_frame(basis, lamp.position),
        basis,
        width: 2.0 * tangent,
        near_or_depth: NEAR,
        end: f64::INFINITY,
        wanted: wanted(lamp, seen),
    }
}

fn cube(lamp: &Lamp, seen: &Seen) -> [View; 6] {
    let tangent = 1.0 + BORDER;
    // As `in_cube_view` in shaders/shadows.wesl chooses them. All sides are equally long.
    let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z];
    let faces = [[y, -z, -x], [y, z, x], [-z, x, -y], [z, x, y], [y, x, -z], [-y, x, z]];
    faces.map(|[right, up, backward]| DMat3::from_cols(right, up, backward)).map(|basis| View {
        clip_from_frame: perspective(tangent, NEAR) * view_from_frame(basis, lamp.position),
        basis,
        width: 2.0 * tangent,
        near_or_depth: NEAR,
        end: f64::INFINITY,
        // Six views share the budget of a light.
        wanted: 0.5 * wanted(lamp, seen),
    })
}

/// Returns the views of slices of the view volume. Each slice is bounded by a sphere whose size does not
/// depend on the direction of the camera, and moves only by whole texels, so that the edges of shadows do not
/// shimmer while the camera moves (Valient, "Stable Rendering of Cascaded Shadow Maps", ShaderX6, 2008). The
/// ends of the slices are spaced between logarithmically and evenly (Zhang et al., "Parallel-Split Shadow
/// Maps", 2006).
fn cascades(lamp: &Lamp, seen: &Seen) -> Vec<View> {
    let [near, far] = seen.depths;
    let near = near.max(1e-2);
    let far = far.clamp(near * 1.01, FARTHEST.max(near * 1.01));
    let end = |part: f64| 0.7 * near * (far / near).powf(part) + 0.3 * (near + (far - near) * part);
    let basis = basis(lamp.axis);
    let mut begin = near;
    (1..=CASCADES)
        .map(|number| {
            let finish = end(number as f64 / CASCADES as f64);
            let (center, radius) = slice_of_all(seen, begin, finish);
            begin = finish;
            let texel = 2.0 * radius * (1.0 + BORDER) / seen.most_texels();
            // Snaps to a grid that is fixed in the world.
            let snap = |axis: DVec3| {
                let along = axis.dot(center + seen.origin);
                axis * ((along / texel).round() * texel - along)
            };
            let center = center + snap(basis.x_axis) + snap(basis.y_axis);
            // From before the first caster to behind the last receiver.
            let (casters, around) = seen.casters;
            let toward = |point: DVec3| basis.z_axis.dot(point - center);
            let before = (toward(casters) + around).max(radius);
            let depth = before + radius;
            let half = radius * (1.0 + BORDER);
            let eye = center + basis.z_axis * before;
            let orthographic = DMat4::from_cols(
                DVec4::new(1.0 / half, 0.0, 0.0, 0.0),
                DVec4::new(0.0, 1.0 / half, 0.0, 0.0),
                DVec4::new(0.0, 0.0, 1.0 / depth, 0.0),
                DVec4::new(0.0, 0.0, 1.0, 1.0),
            );
            View {
                clip_from_frame: orthographic * view_from_frame(basis, eye),
                basis,
                width: 2.0 * half,
                near_or_depth: -depth,
                end: finish,
                wanted: seen.most_texels(),
            }
        })
        .collect()
}

/// Returns the sphere, in frame space, around what all views show between two depths. With mirrors its size
/// depends on the direction of the camera, so it is rounded up to steps, and most frames keep the texel grid
/// of the previous one.
fn slice_of_all(seen: &Seen, begin: f64, end: f64) -> (DVec3, f64) {
    let own = slice(&seen.view, seen.origin, begin, end);
    let reflected = seen.reflected.iter().filter_map(|view| {
        let corners = view.corners(seen.origin, [begin, end]);
        let mirror = view.frustum(seen.origin)[4];
        // Nothing behind the mirror has to be lit.
        corners.iter().any(|corner| mirror.dot(corner.extend(1.0)) > 0.0).then(|| {
            let center = corners.iter().sum::<DVec3>() / corners.len() as f64;
            (center, corners.iter().map(|corner| corner.distance(center)).fold(0.0, f64::max))
        })
    });
    let (center, radius) = reflected.fold(own, |(center, radius), (other, other_radius)| {
        let apart = center.distance(other);
        if apart + other_radius <= radius {
            return (center, radius);
        }
        if apart + radius <= other_radius {
            return (other, other_radius);
        }
        let both = 0.5 * (apart + radius + other_radius);
        (center.lerp(other, (both - radius) / apart), both)
    });
    match seen.reflected.is_empty() {
        true => (center, radius),
        false => (center, ((4.0 * radius.log2()).ceil() / 4.0).exp2()),
    }
}

/// Returns the sphere, in frame space, around the part of the view volume between two depths.
fn slice(view: &CameraView, origin: DVec3, begin: f64, end: f64) -> (DVec3, f64) {
    let eye = view.eye - origin;
    let forward = -view.basis.z_axis;
    match view.volume {
        ViewVolume::Perspective { half_width, half_height, .. } => {
            // The centre lies on the axis, equally far from the near and the far corners, or in the middle of
            // the far side.
            let spread = half_width * half_width + half_height * half_height;
            let middle = (0.5 * (begin + end) * (1.0 + spread)).min(end);
            let radius = |depth: f64| ((depth - middle).powi(2) + spread * depth * depth).sqrt();
            (eye + forward * middle, radius(end).max(radius(begin)))
        }
        ViewVolume::Orthographic { half_width, half_height, .. } => {
            let half = 0.5 * (end - begin);
            let radius = (half_width * half_width + half_height * half_height + half * half).sqrt();
            (eye + forward * (begin + half), radius)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::extract::Window;

    fn seen(eye: DVec3) -> Seen {
        let mut world = bevy_ecs::world::World::new();
        let transform = lumbre_scene::Transform::from_translation(eye).looking_at(DVec3::ZERO, DVec3::Y);
        let camera = (lumbre_scene::Camera::default(), lumbre_scene::GlobalTransform(transform.affine()));
        let camera = world.spawn(camera).id();
        let view = CameraView::new(&world, camera, 1.5).unwrap();
        Seen {
            view,
            reflected: Vec::new(),
            origin: DVec3::ZERO,
            depths: [0.5, 60.0],
            height: 720,
            casters: (DVec3::ZERO, 40.0),
            resolution: 1.0,
        }
    }

    fn lamp(kind: ShadowKind) -> Lamp {
        let axis = DVec3::new(0.3, -1.0, 0.2).normalize();
        Lamp { kind, position: DVec3::new(1.0, 3.0, -2.0), axis, cone: 0.6, range: 20.0 }
    }

    fn inside(view: &View, point: DVec3) -> bool {
        let clip = view.clip_from_frame * point.extend(1.0);
        clip.w > 0.0 && clip.x.abs() <= clip.w && clip.y.abs() <= clip.w && (0.0..=clip.w).contains(&clip.z)
    }

    #[test]
    fn a_cone_and_a_cube_hold_what_they_light() {
        let seen = seen(DVec3::new(4.0, 3.0, 8.0));
        let cone = lamp(ShadowKind::Cone);
        let side = cone.axis.any_orthonormal_vector();
        for angle in [0.0_f64, 0.3, 0.59] {
            for distance in [0.02, 1.0, 500.0] {
                let point = cone.position + (cone.axis * angle.cos() + side * angle.sin()) * distance;
                assert!(inside(&views(&cone, &seen)[0], point), "{angle} {distance}");
            }
        }
        let cube = lamp(ShadowKind::Cube);
        let faces = views(&cube, &seen);
        for step in 0..500 {
            let t = f64::from(step);
            let direction = DVec3::new((t * 0.37).sin(), (t * 0.73).sin(), (t * 0.11).cos());
            let size = direction.abs().max_element();
            let face = (0..3).find(|axis| direction[*axis].abs() == size).unwrap();
            let face = 2 * face + usize::from(direction[face] < 0.0);
            assert!(inside(&faces[face], cube.position + direction), "{direction} {face}");
        }
        for face in &faces {
            assert_eq!(face.basis.determinant(), 1.0, "{:?}", face.basis);
        }
    }

    #[test]
    fn cascades_hold_what_mirrors_show() {
        let mut seen = seen(DVec3::new(4.0, 3.0, 8.0));
        let normal = DVec3::new(1.0, 0.1, 0.9).normalize();
        let plane = normal.extend(0.0);
        seen.reflected = vec![seen.view.reflected(plane, Window::WHOLE).unwrap()];
        let cascades = views(&lamp(ShadowKind::Cascades), &seen);
        let view = seen.reflected[0];
        let corners = [1.0, 60.0].map(|depth| view.corners(DVec3::ZERO, [depth; 2]));
        let mut held = 0;
        for step in 0..1000 {
            let t = f64::from(step);
            let [u, v, w] = [0.37, 0.73, 0.11].map(|speed| 0.5 + 0.5 * (t * speed).sin());
            // Corners: right, up, far.
            let across = |row: &[DVec3; 8]| row[0] + (row[1] - row[0]) * u + (row[2] - row[0]) * v;
            let point = across(&corners[0]).lerp(across(&corners[1]), w * w);
            if plane.dot(point.extend(1.0)) > 0.0 {
                let depth = (view.eye - point).dot(view.basis.z_axis);
                let cascade = cascades.iter().find(|cascade| depth <= cascade.end).unwrap();
                assert!(inside(cascade, point), "{point} at {depth} m");
                held += 1;
            }
        }
        assert!(held > 300, "{held}");
    }

    #[test]
    fn cascades_hold_the_view_and_move_by_whole_texels() {
        let sun = lamp(ShadowKind::Cascades);
        let seen = seen(DVec3::new(4.0, 3.0, 8.0));
        let cascades = views(&sun, &seen);
        assert_eq!(cascades.len(), CASCADES);
        assert!(cascades.windows(2).all(|pair| pair[0].end < pair[1].end && pair[0].width < pair[1].width));
        assert!((cascades[CASCADES - 1].end - 60.0).abs() < 1e-9);
        let clip = seen.view.clip_from_frame(DVec3::ZERO).inverse();
        let mut begin = 0.5;
        for cascade in &cascades {
            for x in [-1.0, 0.0, 1.0] {
                for y in [-1.0, 0.0, 1.0] {
                    for depth in [begin, cascade.end] {
                        let direction = clip.project_point3(DVec3::new(x, y, 0.5)) - seen.view.eye;
                        let along = direction.dot(-seen.view.basis.z_axis);
                        let point = seen.view.eye + direction * (depth / along);
                        assert!(inside(cascade, point), "{x} {y} {depth}");
                    }
                }
            }
            begin = cascade.end;
        }
        // A point in the world falls on the same part of a texel for every camera position.
        let mut elsewhere = seen;
        elsewhere.view.eye += DVec3::new(0.123, 0.01, -0.2);
        let moved = views(&sun, &elsewhere);
        for (a, b) in cascades.iter().zip(&moved) {
            let texels = |view: &View| {
                let clip = view.clip_from_frame.project_point3(DVec3::new(0.3, 0.7, 0.1));
                clip * 0.5 * f64::from(super::super::atlas::MOST)
            };
            let shift = texels(b) - texels(a);
            let part = (shift - shift.round()).abs();
            assert!(part.x < 1e-6 && part.y < 1e-6, "{shift}");
        }
    }
}
