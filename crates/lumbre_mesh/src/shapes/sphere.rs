//! The sphere by recursive subdivision of a tetrahedron. The sphere of meridians and parallels is in
//! `revolution`.

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec2};

use crate::TriangleMesh;
use crate::flat::flat_shaded;

/// Largest depth of subdivision: 4^12 triangles, 16.8 million, in half a gigabyte. One more level would need
/// two.
pub const MAX_DEPTH: u32 = 11;

/// Why a shape cannot be built.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShapeError {
    /// The depth of subdivision is too large: every step multiplies the memory by four.
    #[error(
        "a sphere subdivided {depth} times has 4^{depth} times 4 triangles; subdivide at most {MAX_DEPTH} times"
    )]
    TooDeep {
        /// The requested depth.
        depth: u32,
    },
    /// The radius is not a positive finite number.
    #[error("a radius of {radius} m; give a finite one above 0")]
    Radius {
        /// The requested radius in metres.
        radius: f32,
    },
}

/// As [`tetrahedral_sphere`], but returns an error for arguments that it would clamp or accept unchecked.
///
/// # Errors
/// [`ShapeError::TooDeep`] for a depth above [`MAX_DEPTH`], before anything is allocated;
/// [`ShapeError::Radius`].
pub fn try_tetrahedral_sphere(radius: f32, depth: u32, flat: bool) -> Result<TriangleMesh, ShapeError> {
    if depth > MAX_DEPTH {
        return Err(ShapeError::TooDeep { depth });
    }
    if !(radius.is_finite() && radius > 0.0) {
        return Err(ShapeError::Radius { radius });
    }
    Ok(tetrahedral_sphere(radius, depth, flat))
}

/// A sphere of 4^(depth + 1) triangles and 2 * 4^depth + 2 points (`depth` 0 to [`MAX_DEPTH`]; 0 is the
/// tetrahedron).
///
/// Each step splits every triangle into four at its edge midpoints, which are projected onto the sphere. With
/// `flat`, each triangle has its own vertices with the face normal; otherwise the normals are those of the
/// sphere. The tetrahedron's first vertex is at +z; the other three lie at z = -1/3.
///
/// Source: document \[I\], Aproximación de una esfera por subdivisión recursiva. Its code gives the fourth
/// vertex z = +0.333333, which does not belong to a regular tetrahedron; its text has -1/3.
pub fn tetrahedral_sphere(radius: f32, depth: u32, flat: bool) -> TriangleMesh {
    let root_2 = 2f64.sqrt();
    let root_6 = 6f64.sqrt();
    let mut points = vec![
        DVec3::Z,
        DVec3::new(0.0, 2.0 * root_2 / 3.0, -1.0 / 3.0),
        DVec3::new(-root_6 / 3.0, -root_2 / 3.0, -1.0 / 3.0),
        DVec3::new(root_6 / 3.0, -root_2 / 3.0, -1.0 / 3.0),
    ];
    let mut faces: Vec<[u32; 3]> = vec![[0, 1, 2], [3, 2, 1], [0, 3, 1], [0, 2, 3]];
    for _ in 0..depth.min(MAX_DEPTH) {
        let mut middles: HashMap<[u32; 2], u32> = HashMap::with_capacity(faces.len() * 3 / 2);
        let mut middle = |a: u32, b: u32| {
            *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                points.push((points[a as usize] + points[b as usize]).normalize());
                points.len() as u32 - 1
            })
        };
        let mut finer = Vec::with_capacity(faces.len() * 4);
        for [a, b, c] in faces {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        faces = finer;
    }
    let mesh = with_texture_seam(&points, &faces, f64::from(radius));
    if flat { flat_shaded(&mesh) } else { mesh }
}

/// Adds texture coordinates: u is the longitude about +z and v the latitude. Vertices are split where u jumps
/// from 1 to 0 (a triangle across the seam continues past 1, so sample with repeat) and at the poles, where u
/// is undefined. The lower pole lies inside a triangle, across which a texture is distorted.
fn with_texture_seam(points: &[DVec3], faces: &[[u32; 3]], radius: f64) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let mut split: HashMap<(u32, u32), u32> = HashMap::with_capacity(points.len());
    let is_pole = |point: DVec3| point.x.abs().max(point.y.abs()) < 1e-12;
    for face in faces {
        let corners = face.map(|vertex| points[vertex as usize]);
        let mut longitudes = corners.map(|p| (p.y.atan2(p.x) / TAU).rem_euclid(1.0));
        let others = |skip: usize| (0..3).filter(move |&i| i != skip);
        let largest = (0..3).filter(|&i| !is_pole(corners[i])).map(|i| longitudes[i]).fold(0.0, f64::max);
        for longitude in &mut longitudes {
            if largest - *longitude > 0.5 {
                *longitude += 1.0;
            }
        }
        for corner in 0..3 {
            if is_pole(corners[corner]) {
                longitudes[corner] = others(corner).map(|i| longitudes[i]).sum::<f64>() * 0.5;
            }
        }
        for corner in 0..3 {
            let u = longitudes[corner] as f32;
            let index = *split.entry((face[corner], u.to_bits())).or_insert_with(|| {
                let point = corners[corner];
                mesh.positions.push((point * radius).as_vec3() + 0.0);
                mesh.normals.push(point.as_vec3());
                mesh.uv0.push(Vec2::new(u, (point.z.clamp(-1.0, 1.0).acos() / PI) as f32));
                mesh.positions.len() as u32 - 1
            });
            mesh.indices.push(index);
        }
    }
    mesh
}
