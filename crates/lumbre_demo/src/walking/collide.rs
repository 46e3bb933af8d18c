//! A capsule out of the walls: what it touches pushes it away. Not the ground: that is `ground`.

use glam::DVec3;

use super::{Capsule, TriangleTree};

/// Contacts resolved in one go; a corner of three walls needs three, and what is left is resolved in the next step.
const ITERATIONS: usize = 12;
/// Penetration that is let be, metres: well under what an eye or a near plane notices.
const SKIN: f64 = 1e-6;

/// Moves a capsule sideways (or down, from a ceiling) out of the triangles that it penetrates, the deepest first, and tells
/// `contact` the unit direction of every push.
///
/// `came_from` is where the segment's lower end was before, on the side of the wall that it has to stay on.
pub fn push_out(
    capsule: &mut Capsule,
    came_from: DVec3,
    level: &TriangleTree,
    mut contact: impl FnMut(DVec3),
) {
    for _ in 0..ITERATIONS {
        let Some((depth, direction)) = deepest(capsule, came_from, level) else { return };
        capsule.bottom += direction * depth;
        contact(direction);
    }
}

/// Whether a capsule penetrates anything.
pub fn overlaps(capsule: &Capsule, level: &TriangleTree) -> bool {
    deepest(capsule, capsule.bottom, level).is_some()
}

/// How far to move to leave the deepest triangle, and where to.
fn deepest(capsule: &Capsule, came_from: DVec3, level: &TriangleTree) -> Option<(f64, DVec3)> {
    let reach = DVec3::splat(capsule.radius);
    let mut deepest: Option<(f64, DVec3)> = None;
    level.for_each_in_box(capsule.bottom - reach, capsule.top() + reach, |triangle| {
        let (on_capsule, on_triangle) = capsule.closest(triangle);
        let away = on_capsule - on_triangle;
        let depth = capsule.radius - away.length();
        if depth <= SKIN || deepest.is_some_and(|(deepest, _)| depth <= deepest) {
            return;
        }
        let normal = away.try_normalize().unwrap_or_else(|| face_normal(triangle, came_from));
        deepest = Some((depth, normal));
    });
    let (depth, normal) = deepest?;
    // The rays below look after floors. A ledge pushes sideways only, or it would lift who walks against it.
    let sideways = normal.with_y(0.0);
    let along = sideways.length();
    if normal.y < -0.7 || along < 1e-3 {
        Some((depth, normal))
    } else {
        Some((depth / along, sideways / along))
    }
}

/// The normal of a triangle on the side of a point.
fn face_normal(&[a, b, c]: &[DVec3; 3], side: DVec3) -> DVec3 {
    let normal = (b - a).cross(c - a).normalize_or(DVec3::Y);
    if normal.dot(side - a) < 0.0 { -normal } else { normal }
}
