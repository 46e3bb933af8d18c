//! Pushes a capsule out of the walls that it penetrates. The ground is handled in `ground`.

use glam::DVec3;

use super::{Capsule, TriangleTree};

/// Largest number of contacts resolved in one call. A corner of three walls needs three; the rest is resolved
/// in the next step.
const ITERATIONS: usize = 12;
/// Penetration that is tolerated, metres; far below what is visible or a near plane reveals.
const SKIN: f64 = 1e-6;

/// Moves a capsule sideways (or down, from a ceiling) out of the triangles that it penetrates, the deepest
/// first, and calls `contact` with the unit direction of every push.
///
/// `came_from` is the previous lower end of the segment, on the side of the wall where it has to stay.
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

/// Returns true if a capsule penetrates any triangle.
pub fn overlaps(capsule: &Capsule, level: &TriangleTree) -> bool {
    deepest(capsule, capsule.bottom, level).is_some()
}

/// Returns how far to move out of the deepest penetration, and the unit direction to move in.
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
    // Floors are handled by the rays of `ground`. A ledge pushes sideways only, or it would lift a body that
    // walks against it.
    let sideways = normal.with_y(0.0);
    let along = sideways.length();
    if normal.y < -0.7 || along < 1e-3 {
        Some((depth, normal))
    } else {
        Some((depth / along, sideways / along))
    }
}

/// Returns the normal of a triangle on the side of a point.
fn face_normal(&[a, b, c]: &[DVec3; 3], side: DVec3) -> DVec3 {
    let normal = (b - a).cross(c - a).normalize_or(DVec3::Y);
    if normal.dot(side - a) < 0.0 { -normal } else { normal }
}
