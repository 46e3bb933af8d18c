//! Validates lightmap coordinates before they are used for baking: range, overlaps and coverage, texel by
//! texel. Nothing is repaired: the caller unwraps an invalid mesh again or reports the triangles to its
//! author.

use glam::{DVec2, Vec2};

use crate::{MeshError, TriangleMesh};

/// How far inside a triangle a texel's centre must lie for the triangle to own the texel, in texels. Centres
/// on a shared edge would otherwise belong to both triangles, and f32 coordinates in an atlas of 8192 texels
/// are off by 2^-11.
const OWNERSHIP_MARGIN: f64 = 2e-3;

/// Largest number of texels that validation allocates: 2^28, a square of 16384.
pub const MAX_TEXELS: u64 = 1 << 28;

/// Faults in a set of lightmap coordinates. Lists are in ascending order; the coordinates are valid if all
/// are empty.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UvReport {
    /// Triangles with a coordinate that is not finite or outside [0, 1].
    pub out_of_range: Vec<u32>,
    /// Non-degenerate triangles whose coordinates are degenerate, so that they have no texels.
    pub without_coverage: Vec<u32>,
    /// Pairs of triangles that own the same texel, each pair once.
    pub overlapping: Vec<(u32, u32)>,
    /// Number of texels owned by a triangle.
    pub owned_texels: u64,
    /// Fraction of all texels that are owned, in [0, 1].
    pub utilisation: f64,
}

impl UvReport {
    /// Returns true if the coordinates can be used for baking.
    pub fn is_sound(&self) -> bool {
        self.out_of_range.is_empty() && self.without_coverage.is_empty() && self.overlapping.is_empty()
    }
}

/// Why coordinates cannot be validated.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum UvValidationError {
    /// The mesh is invalid.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The mesh has no lightmap coordinates.
    #[error("the mesh has no lightmap coordinates (uv1); unwrap it first")]
    MissingUv1,
    /// The grid has more texels than validation allocates.
    #[error("{width} x {height} texels exceed {MAX_TEXELS}; check at a lower resolution")]
    TooManyTexels {
        /// Width in texels.
        width: u32,
        /// Height in texels.
        height: u32,
    },
}

/// Validates `uv1` on a grid of `width` by `height` texels.
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

/// Calls `visit(x, y)` for every texel of a grid whose centre lies inside a triangle, given in texels, by
/// more than 1/500 of a texel. The winding does not matter. Degenerate triangles and those with NaN have no
/// texels.
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
    // The casts saturate: negative values become 0, and the limits fit u32.
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
        // The diagonal of 8 x 4 passes through no texel centre, so all 32 are owned.
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
        // Triangle 4 has the same vertex three times, so it needs no coverage. Triangle 5 is degenerate in uv
        // only.
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
