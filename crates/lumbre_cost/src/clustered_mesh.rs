//! Simplifies meshes by merging all vertices in a cell of a grid (Rossignac and Borrel, "Multi-resolution 3D
//! approximations for rendering complex scenes", 1993).
//!
//! This is fast and works for any mesh, but does not give the smallest error for a number of triangles.
//! Texture coordinates and vertex colours are dropped.

use std::borrow::Cow;
use std::collections::HashMap;

use glam::{DVec3, Vec3};
use lumbre_mesh::normals::{NormalWeight, compute_smooth_normals};
use lumbre_mesh::{MeshError, TriangleMesh};

/// Returns the mesh simplified by a grid with `cells` cells (at least 1) along the longest side of its
/// bounding box. The vertices in a cell become one, at their mean position and with the mean of their
/// normals; triangles that lose a side are removed. A mesh without normals gets smooth normals, weighted by
/// area.
///
/// # Errors
/// [`MeshError`] if the mesh is invalid.
pub fn clustered(scan: &TriangleMesh, cells: u32) -> Result<TriangleMesh, MeshError> {
    scan.validate()?;
    let mesh = match scan.normals.is_empty() {
        true => Cow::Owned(compute_smooth_normals(scan, NormalWeight::Area)?.mesh),
        false => Cow::Borrowed(scan),
    };
    let finite = || mesh.positions.iter().filter(|point| point.is_finite());
    let least = finite().fold(Vec3::splat(f32::MAX), |least, point| least.min(*point));
    let most = finite().fold(Vec3::splat(f32::MIN), |most, point| most.max(*point));
    let side = f64::from((most - least).max_element().max(f32::MIN_POSITIVE)) / f64::from(cells.max(1));
    let mut places: HashMap<[i64; 3], u32> = HashMap::new();
    // Sum of positions, sum of normals, and number of vertices of each cluster.
    let mut sums: Vec<(DVec3, DVec3, f64)> = Vec::new();
    let cluster_of: Vec<u32> = mesh
        .positions
        .iter()
        .zip(&mesh.normals)
        .map(|(point, normal)| {
            let from = (point.as_dvec3() - least.as_dvec3()) / side;
            let cell = from.floor().to_array().map(|place| place as i64);
            let next = sums.len() as u32;
            let cluster = *places.entry(cell).or_insert(next);
            if cluster == next {
                sums.push((DVec3::ZERO, DVec3::ZERO, 0.0));
            }
            let (sum, normals, count) = &mut sums[cluster as usize];
            *sum += point.as_dvec3();
            *normals += normal.as_dvec3();
            *count += 1.0;
            cluster
        })
        .collect();
    let whole = |[a, b, c]: &[u32; 3]| a != b && b != c && c != a;
    let triangles = mesh.triangles().map(|triangle| triangle.map(|vertex| cluster_of[vertex as usize]));
    Ok(TriangleMesh {
        positions: sums.iter().map(|(sum, _, count)| (*sum / *count).as_vec3()).collect(),
        normals: sums.iter().map(|(_, normals, _)| normals.normalize_or_zero().as_vec3()).collect(),
        indices: triangles.filter(whole).flatten().collect(),
        ..TriangleMesh::default()
    })
}

#[cfg(test)]
mod tests {
    use lumbre_mesh::shapes::tetrahedral_sphere;

    use super::*;

    #[test]
    fn a_sphere_stays_one_with_fewer_triangles() {
        let fine = tetrahedral_sphere(1.0, 6, false);
        let mut before = 0;
        for cells in [4, 8, 16, 32] {
            let coarse = clustered(&fine, cells).expect("a sphere is sound");
            assert!(coarse.triangle_count() > 2 * before && coarse.triangle_count() < fine.triangle_count());
            before = coarse.triangle_count();
            // The mean of points in a cell is off by at most its diagonal, √3 times its side of 2 / cells.
            let off = 3f32.sqrt() * 2.0 / cells as f32;
            for (point, normal) in coarse.positions.iter().zip(&coarse.normals) {
                assert!((1.0 - off..=1.0 + 1e-6).contains(&point.length()), "{point}");
                assert!(normal.dot(point.normalize()) > 0.7, "{normal} at {point}");
            }
        }
    }

    #[test]
    fn a_mesh_within_one_cell_is_gone_and_one_without_a_shared_cell_stays() {
        let fine = tetrahedral_sphere(1.0, 1, false);
        assert_eq!(clustered(&fine, 1).map(|mesh| mesh.triangle_count()), Ok(0));
        let same = clustered(&fine, 1000).expect("it is sound");
        assert_eq!(same.triangle_count(), fine.triangle_count());
        let bad = TriangleMesh { indices: vec![0, 1, 2], ..TriangleMesh::default() };
        assert!(clustered(&bad, 4).is_err());
    }
}
