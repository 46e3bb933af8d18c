//! The faces of an emissive mesh as a small number of evenly emitting polygons in mesh space. Two triangles
//! that form a parallelogram become one polygon. Their placement in the world is computed in `emitters`.

use std::collections::HashMap;

use glam::{DVec3, Vec2, Vec3};
use lumbre_mesh::{TriangleMesh, weld_positions};
use lumbre_optics::decode_srgb_byte;
use lumbre_scene::{MaterialTextures, TextureReference, Wrap};

/// Largest number of polygons of one object. Every point that it reaches evaluates all of them.
pub(crate) const MAXIMUM_POLYGONS: usize = 256;

/// A polygon of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Face {
    pub corner: DVec3,
    pub edge_u: DVec3,
    pub edge_v: DVec3,
    pub triangle: bool,
    /// Mean of the emissive texture as linear RGB; 1 without a texture.
    pub tint: Vec3,
}

/// Largest distance of the fourth corner of a parallelogram from its exact position, relative to the
/// diagonal. This allows for positions that were rotated in f32.
const TOLERANCE: f64 = 1e-6;

/// Number of sample points along an edge for reading an emissive texture. The baker uses the same number.
const TEXTURE_POINTS: u32 = 8;

/// Returns the faces of a mesh that have an area.
///
/// # Errors
/// The number of polygons, or a lower bound of it, if there are more than [`MAXIMUM_POLYGONS`].
pub(crate) fn faces(mesh: &TriangleMesh, textures: Option<&MaterialTextures>) -> Result<Vec<Face>, usize> {
    let texture = textures.and_then(|textures| textures.emissive.as_ref());
    let valid = |t: &[u32; 3]| t.iter().all(|&vertex| (vertex as usize) < mesh.positions.len());
    let triangles: Vec<[u32; 3]> =
        mesh.triangles().filter(|t| valid(t) && area_vector(mesh, t).length() > 0.0).collect();
    // At best, two triangles form a polygon, and only if they have the same colour.
    let least = if texture.is_some() { triangles.len() } else { triangles.len().div_ceil(2) };
    if least > MAXIMUM_POLYGONS {
        return Err(least);
    }
    let partners = if texture.is_some() { vec![None; triangles.len()] } else { partners(mesh, &triangles) };
    let mut faces = Vec::new();
    for (index, triangle) in triangles.iter().enumerate() {
        match partners[index] {
            // The other triangle of the pair adds the polygon.
            Some(Partner { triangle: other, .. }) if other < index => {}
            Some(Partner { apex, .. }) => {
                let tint = Vec3::ONE;
                faces.push(face(
                    mesh,
                    [triangle[apex], triangle[(apex + 1) % 3], triangle[(apex + 2) % 3]],
                    false,
                    tint,
                ));
            }
            None => {
                let tint = texture.map_or(Vec3::ONE, |texture| mean_texel(mesh, triangle, texture));
                faces.push(face(mesh, *triangle, true, tint));
            }
        }
    }
    if faces.len() > MAXIMUM_POLYGONS { Err(faces.len()) } else { Ok(faces) }
}

/// The other triangle of a parallelogram.
#[derive(Clone, Copy, Debug)]
struct Partner {
    triangle: usize,
    /// The corner of this triangle that the other one does not share.
    apex: usize,
}

fn position(mesh: &TriangleMesh, vertex: u32) -> DVec3 {
    mesh.positions[vertex as usize].as_dvec3()
}

/// Returns twice the area as a vector along the normal, or 0 if it is not finite.
fn area_vector(mesh: &TriangleMesh, triangle: &[u32; 3]) -> DVec3 {
    let [a, b, c] = triangle.map(|vertex| position(mesh, vertex));
    let area = (b - a).cross(c - a);
    if area.is_finite() { area } else { DVec3::ZERO }
}

fn face(mesh: &TriangleMesh, [a, b, c]: [u32; 3], triangle: bool, tint: Vec3) -> Face {
    let corner = position(mesh, a);
    Face { corner, edge_u: position(mesh, b) - corner, edge_v: position(mesh, c) - corner, triangle, tint }
}

/// Finds pairs of triangles that form parallelograms, the most rectangular ones first.
fn partners(mesh: &TriangleMesh, triangles: &[[u32; 3]]) -> Vec<Option<Partner>> {
    let welded = weld_positions(&mesh.positions);
    // Maps a directed edge to the triangles on its left, each with its opposite corner.
    let mut left: HashMap<[u32; 2], Vec<(usize, usize)>> = HashMap::new();
    let edge =
        |index: usize, apex: usize| [1, 2].map(|next| welded[triangles[index][(apex + next) % 3] as usize]);
    for index in 0..triangles.len() {
        for apex in 0..3 {
            left.entry(edge(index, apex)).or_default().push((index, apex));
        }
    }
    let mut pairs = Vec::new();
    for index in 0..triangles.len() {
        for apex in 0..3 {
            let [from, to] = edge(index, apex);
            for &(other, other_apex) in left.get(&[to, from]).into_iter().flatten() {
                if other > index {
                    let corner = |index: usize, apex: usize| position(mesh, triangles[index][apex]);
                    let (a, d) = (corner(index, apex), corner(other, other_apex));
                    let (b, c) = (position(mesh, from), position(mesh, to));
                    // The diagonals of a parallelogram bisect each other.
                    let apart = ((a + d) - (b + c)).length();
                    if apart <= TOLERANCE * (d - a).length().max((c - b).length()) {
                        let skew = (b - a).dot(c - a).abs() / ((b - a).length() * (c - a).length());
                        pairs.push((skew, (index, apex), (other, other_apex)));
                    }
                }
            }
        }
    }
    pairs.sort_by(|p, q| p.0.total_cmp(&q.0).then((p.1, p.2).cmp(&(q.1, q.2))));
    let mut partners = vec![None; triangles.len()];
    for (_, (index, apex), (other, other_apex)) in pairs {
        if partners[index].is_none() && partners[other].is_none() {
            partners[index] = Some(Partner { triangle: other, apex });
            partners[other] = Some(Partner { triangle: index, apex: other_apex });
        }
    }
    partners
}

/// Returns the mean of a texture over a triangle: the mean of the texels at the centres of 64 equal parts.
fn mean_texel(mesh: &TriangleMesh, triangle: &[u32; 3], texture: &TextureReference) -> Vec3 {
    let coordinates = if texture.tex_coord == 0 { &mesh.uv0 } else { &mesh.uv1 };
    let corners = triangle.map(|vertex| coordinates.get(vertex as usize).copied());
    let [Some(a), Some(b), Some(c)] = corners else { return Vec3::ONE };
    let mut sum = Vec3::ZERO;
    for i in 0..TEXTURE_POINTS {
        for j in 0..TEXTURE_POINTS {
            // The upright triangle of a cell, or beyond the diagonal the inverted triangle of the mirrored
            // cell.
            let (i, j, third) = match i + j < TEXTURE_POINTS {
                true => (i, j, 1.0),
                false => (TEXTURE_POINTS - 1 - i, TEXTURE_POINTS - 1 - j, 2.0),
            };
            let at = |index: u32| (index as f32 + third / 3.0) / TEXTURE_POINTS as f32;
            sum += texel(texture, a + (b - a) * at(i) + (c - a) * at(j));
        }
    }
    sum / (TEXTURE_POINTS * TEXTURE_POINTS) as f32
}

/// Returns the texel at texture coordinates as linear RGB; 1 if there is none.
fn texel(texture: &TextureReference, uv: Vec2) -> Vec3 {
    let uv = texture.transformed(uv);
    if !uv.is_finite() {
        return Vec3::ONE;
    }
    let image = &texture.image;
    let wrapped = |at: f32, wrap: Wrap, size: u32| {
        let part = match wrap {
            Wrap::Repeat => at.rem_euclid(1.0),
            Wrap::MirroredRepeat => 1.0 - (at.rem_euclid(2.0) - 1.0).abs(),
            Wrap::ClampToEdge => at.clamp(0.0, 1.0),
        };
        ((part * size as f32) as usize).min((size as usize).saturating_sub(1))
    };
    let x = wrapped(uv.x, texture.sampler.wrap_u, image.width);
    let y = wrapped(uv.y, texture.sampler.wrap_v, image.height);
    let first = 4 * (y * image.width as usize + x);
    match image.rgba.get(first..first + 3) {
        Some(&[r, g, b]) => DVec3::from([r, g, b].map(decode_srgb_byte)).as_vec3(),
        _ => Vec3::ONE,
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use lumbre_mesh::shapes;
    use lumbre_scene::Image;

    use super::*;

    fn area(faces: &[Face]) -> f64 {
        let area = |f: &Face| f.edge_u.cross(f.edge_v).length() * if f.triangle { 0.5 } else { 1.0 };
        faces.iter().map(area).sum()
    }

    fn quad() -> TriangleMesh {
        TriangleMesh {
            positions: vec![Vec3::ZERO, Vec3::X * 2.0, Vec3::new(2.0, 1.0, 0.0), Vec3::Y],
            uv0: vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y],
            indices: vec![0, 1, 2, 0, 2, 3],
            ..TriangleMesh::default()
        }
    }

    #[test]
    fn a_quad_is_one_polygon_with_its_front() {
        let found = faces(&quad(), None).unwrap();
        assert_eq!(found.len(), 1);
        assert!(!found[0].triangle);
        assert_eq!(found[0].edge_u.cross(found[0].edge_v), DVec3::Z * 2.0);
        let corners = [DVec3::ZERO, found[0].edge_u, found[0].edge_v, found[0].edge_u + found[0].edge_v];
        let mut corners = corners.map(|c| (found[0].corner + c).to_array().map(|x| x as i32));
        corners.sort_unstable();
        assert_eq!(corners, [[0, 0, 0], [0, 1, 0], [2, 0, 0], [2, 1, 0]]);
    }

    #[test]
    fn a_box_has_six_polygons_and_a_grid_pairs_up() {
        let found = faces(&shapes::cuboid(Vec3::new(1.0, 2.0, 3.0), 1), None).unwrap();
        assert_eq!((found.len(), found.iter().any(|face| face.triangle)), (6, false));
        let outward = |f: &Face| f.edge_u.cross(f.edge_v).dot(f.corner + 0.5 * (f.edge_u + f.edge_v)) > 0.0;
        assert!(found.iter().all(outward));
        // The poles of a sphere stay triangles, and pairing keeps the total area.
        let sphere = shapes::uv_sphere(1.0, 12, 6);
        let found = faces(&sphere, None).unwrap();
        let total: f64 = sphere.triangles().map(|t| 0.5 * area_vector(&sphere, &t).length()).sum();
        assert!((area(&found) - total).abs() < 1e-9 && found.len() >= sphere.triangle_count() / 2);
    }

    #[test]
    fn a_trapezoid_and_a_folded_quad_stay_triangles() {
        let mut trapezoid = quad();
        trapezoid.positions[2].x = 1.5;
        assert_eq!(faces(&trapezoid, None).unwrap().len(), 2);
        let mut folded = quad();
        folded.positions[2].z = 0.01;
        assert_eq!(faces(&folded, None).unwrap().len(), 2);
    }

    #[test]
    fn triangles_without_area_or_numbers_are_left_out() {
        let mut mesh = quad();
        mesh.indices.extend([0, 0, 1, 0, 1, 9]);
        mesh.positions.push(Vec3::NAN);
        mesh.indices.extend([0, 1, 4]);
        assert_eq!(faces(&mesh, None).unwrap().len(), 1);
    }

    #[test]
    fn too_many_are_refused_with_their_number() {
        assert_eq!(faces(&shapes::uv_sphere(1.0, 64, 32), None).unwrap_err(), 64 * 31);
        let strip: Vec<u32> = (0..MAXIMUM_POLYGONS as u32 + 1).flat_map(|i| [i, i + 1, i + 2]).collect();
        let position = |i: u32| Vec3::new(i as f32, (i * i % 7) as f32, i as f32 * 0.3);
        let positions = (0..MAXIMUM_POLYGONS as u32 + 3).map(position).collect();
        let mesh = TriangleMesh { positions, indices: strip, ..TriangleMesh::default() };
        assert!(faces(&mesh, None).unwrap_err() > MAXIMUM_POLYGONS);
    }

    #[test]
    fn a_texture_is_averaged_over_each_triangle() {
        // The left half is black and the right half white, so one of the quad's two triangles is darker.
        let image =
            Image { name: "half".into(), width: 2, height: 1, rgba: vec![0, 0, 0, 255, 255, 255, 255, 255] };
        let texture = TextureReference::new(Arc::new(image));
        let textures = MaterialTextures { emissive: Some(texture), ..MaterialTextures::default() };
        let found = faces(&quad(), Some(&textures)).unwrap();
        assert_eq!(found.len(), 2);
        // Three quarters of the area of the triangle with the right edge have u > 1/2. 64 samples are exact
        // except for the parts that the line u = 1/2 crosses.
        let tints: Vec<f32> = found.iter().map(|face| face.tint.x).collect();
        assert!((tints[0] - 0.75).abs() < 0.07 && (tints[1] - 0.25).abs() < 0.07, "{tints:?}");
        assert!((tints[0] + tints[1] - 1.0).abs() < 1e-6);
    }
}
