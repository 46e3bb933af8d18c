//! Checks lightmap coordinates before anything is baked into them: range, overlap, coverage, texel by texel.
//! Not a repair: a mesh that fails is unwrapped or handed back to its author with the triangles named.

use glam::{DVec2, Vec2};

use crate::{MeshError, TriangleMesh};

/// How far inside a triangle a texel's centre must lie to be owned by it, in texels. Centres on a shared edge
/// belong to both neighbours, and f32 coordinates in an atlas of 8192 texels are off by 2^-11.
const OWNERSHIP_MARGIN: f64 = 2e-3;

/// Most texels that a check allocates: 2^28, a square of 16384.
pub const MAX_TEXELS: u64 = 1 << 28;

/// What is wrong with a set of lightmap coordinates. Lists are ascending; empty lists are good.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UvReport {
    /// Triangles with a coordinate that is not finite or outside [0, 1].
    pub out_of_range: Vec<u32>,
    /// Triangles with area whose coordinates have none: their light has no place.
    pub without_coverage: Vec<u32>,
    /// Pairs of triangles that own the same texel, each pair once.
    pub overlapping: Vec<(u32, u32)>,
    /// Texels owned by some triangle.
    pub owned_texels: u64,
    /// Owned texels over all texels, in [0, 1].
    pub utilisation: f64,
}

impl UvReport {
    /// Whether the coordinates can be baked into.
    pub fn is_sound(&self) -> bool {
        self.out_of_range.is_empty() && self.without_coverage.is_empty() && self.overlapping.is_empty()
    }
}

/// Why coordinates cannot be checked.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum UvValidationError {
    /// The mesh is not sound.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// There is nothing to check.
    #[error("the mesh has no lightmap coordinates (uv1); unwrap it first")]
    MissingUv1,
    /// More texels than the check allocates.
    #[error("{width} x {height} texels exceed {MAX_TEXELS}; check at a lower resolution")]
    TooManyTexels {
        /// Texels across.
        width: u32,
        /// Texel rows.
        height: u32,
    },
}

/// Checks `uv1` on a grid of `width` by `height` texels.
///
/// # Errors
/// [`UvValidationError`].
pub fn validate_uv1(mesh: &TriangleMesh, width: u32, height: u32) -> Result<UvReport, UvValidationError> {
    mesh.validate()?;
    if mesh.uv1.is_empty() && !mesh.indices.is_empty() {
        return Err(UvValidationError::MissingUv1);
    }
    let texels = u64::from(width) * u64::from(height);
    if texels > MAX_TEXELS {
        return Err(UvValidationError::TooManyTexels { width, height });
    }
    let mut report = UvReport::default();
    let mut owners = vec![u32::MAX; texels as usize];
    let size = DVec2::new(f64::from(width), f64::from(height));
    for (triangle, index) in mesh.triangles().zip(0u32..) {
        let uv: [Vec2; 3] = triangle.map(|vertex| mesh.uv1[vertex as usize]);
        let inside = |c: f32| (0.0..=1.0).contains(&c);
        if !uv.iter().all(|uv| inside(uv.x) && inside(uv.y)) {
            report.out_of_range.push(index);
            continue;
        }
        let corners = uv.map(|uv| uv.as_dvec2() * size);
        let [a, b, c] = corners;
        if (b - a).perp_dot(c - a) == 0.0 {
            let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize].as_dvec3());
            if (b - a).cross(c - a).length_squared() > 0.0 {
                report.without_coverage.push(index);
            }
            continue;
        }
        for_each_owned_texel(&corners, width, height, |x, y| {
            let owner = &mut owners[y as usize * width as usize + x as usize];
            if *owner == u32::MAX {
                *owner = index;
                report.owned_texels += 1;
            } else if report.overlapping.last() != Some(&(*owner, index)) {
                report.overlapping.push((*owner, index));
            }
        });
    }
    report.overlapping.sort_unstable();
    report.overlapping.dedup();
    report.utilisation = report.owned_texels as f64 / (texels as f64).max(1.0);
    Ok(report)
}

/// Calls `visit(x, y)` for the texels of a grid whose centres lie inside a triangle, given in texels, by more
/// than a five hundredth of a texel. Either winding; nothing for a triangle without area or with NaN.
pub fn for_each_owned_texel(triangle: &[DVec2; 3], width: u32, height: u32, mut visit: impl FnMut(u32, u32)) {
    let [a, mut b, mut c] = *triangle;
    if (b - a).perp_dot(c - a) < 0.0 {
        (b, c) = (c, b);
    }
    if !((b - a).perp_dot(c - a) > 0.0 && a.is_finite() && b.is_finite() && c.is_finite()) {
        return;
    }
    let edges = [(a, b - a), (b, c - b), (c, a - c)].map(|(start, along)| (start, along.normalize_or_zero()));
    let low = a.min(b).min(c).floor().max(DVec2::ZERO);
    let high = a.max(b).max(c).ceil().min(DVec2::new(f64::from(width), f64::from(height)));
    // Saturates: negative becomes 0, and the limits are u32.
    for y in low.y as u32..high.y as u32 {
        for x in low.x as u32..high.x as u32 {
            let centre = DVec2::new(f64::from(x), f64::from(y)) + 0.5;
            if edges.iter().all(|(start, along)| along.perp_dot(centre - *start) > OWNERSHIP_MARGIN) {
                visit(x, y);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn mesh(uv1: &[[f32; 2]], indices: &[u32]) -> TriangleMesh {
        TriangleMesh {
            positions: (0..uv1.len()).map(|i| Vec3::new(i as f32, (i * i) as f32, 0.0)).collect(),
            uv1: uv1.iter().map(|&uv| Vec2::from(uv)).collect(),
            indices: indices.to_vec(),
            ..TriangleMesh::default()
        }
    }

    #[test]
    fn a_square_of_two_triangles_is_sound() {
        let square = mesh(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], &[0, 1, 2, 0, 2, 3]);
        let report = validate_uv1(&square, 8, 4).unwrap();
        assert!(report.is_sound());
        // The diagonal of 8 x 4 passes through no centre: all 32 are owned.
        assert_eq!((report.owned_texels, report.utilisation), (32, 1.0));
    }

    #[test]
    fn every_fault_names_its_triangles() {
        let faulty = mesh(
            &[[0.0, 0.0], [0.5, 0.0], [0.0, 0.5], [0.4, 0.4], [1.5, 0.0], [0.3, f32::NAN], [0.9, 0.9]],
            &[0, 1, 2, 0, 1, 3, 0, 1, 4, 0, 1, 5, 6, 6, 6, 6, 3, 0, 2, 0, 1],
        );
        let report = validate_uv1(&faulty, 32, 32).unwrap();
        assert_eq!(report.out_of_range, [2, 3]);
        // Triangle 4 has one vertex three times: no area, nothing lost. 5 is a line in uv only.
        assert_eq!(report.without_coverage, [5]);
        assert_eq!(report.overlapping, [(0, 1), (0, 6)]);
        assert!(!report.is_sound());
    }

    #[test]
    fn what_cannot_be_checked_is_an_error() {
        let mut square = mesh(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], &[0, 1, 2]);
        assert!(matches!(
            validate_uv1(&square, u32::MAX, u32::MAX),
            Err(UvValidationError::TooManyTexels { .. })
        ));
        square.uv1.clear();
        assert_eq!(validate_uv1(&square, 8, 8), Err(UvValidationError::MissingUv1));
        assert_eq!(validate_uv1(&TriangleMesh::default(), 0, 0), Ok(UvReport::default()));
    }
}
