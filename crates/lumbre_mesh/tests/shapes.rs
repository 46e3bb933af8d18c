//! Compares shapes with closed forms: counts, Euler's formula, areas, volumes and normals.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};
use lumbre_mesh::normals::face_normal;
use lumbre_mesh::shapes::{ShapeError, try_tetrahedral_sphere};
use lumbre_mesh::{Adjacency, TriangleMesh, shapes, weld_positions};

fn area(mesh: &TriangleMesh) -> f64 {
    mesh.triangle_positions()
        .expect("a sound shape")
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|p| p.as_dvec3());
            0.5 * (b - a).cross(c - a).length()
        })
        .sum()
}

/// Signed volume by the divergence theorem; positive if the faces point outwards.
fn volume(mesh: &TriangleMesh) -> f64 {
    let triangles = mesh.triangle_positions().expect("a sound shape");
    triangles.iter().map(|t| t.map(|p| p.as_dvec3())).map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
}

/// After welding: the number of points, V - E + F, and whether every edge has exactly two triangles.
fn topology(mesh: &TriangleMesh) -> (usize, i64, bool) {
    mesh.validate().expect("a sound shape");
    let welded = weld_positions(&mesh.positions);
    let points = welded.iter().enumerate().filter(|&(i, &p)| i == p as usize).count();
    let triangles: Vec<[u32; 3]> = mesh.triangles().map(|t| t.map(|v| welded[v as usize])).collect();
    let adjacency = Adjacency::new(&triangles, mesh.positions.len());
    let euler = points as i64 - adjacency.edge_count() as i64 + triangles.len() as i64;
    (points, euler, adjacency.edge_valences().keys().eq([&2]))
}

/// The largest angle between a vertex normal and its face, in degrees. Also checks that the normals are unit
/// vectors.
fn normal_deviation(mesh: &TriangleMesh) -> f64 {
    let mut largest = 0.0f64;
    for triangle in mesh.triangles() {
        let face =
            face_normal(&triangle.map(|v| mesh.positions[v as usize])).expect("a sound shape").as_dvec3();
        for vertex in triangle {
            let normal = mesh.normals[vertex as usize].as_dvec3();
            assert!((normal.length() - 1.0).abs() < 1e-6);
            largest = largest.max(normal.angle_between(face).to_degrees());
        }
    }
    largest
}

#[test]
fn the_sphere_from_a_tetrahedron() {
    // The tetrahedron inscribed in the unit sphere: edge sqrt(8/3), area 8 / sqrt(3), volume 8 sqrt(3) / 27.
    let tetrahedron = shapes::tetrahedral_sphere(1.0, 0, false);
    assert!((area(&tetrahedron) - 8.0 / 3f64.sqrt()).abs() < 1e-6);
    assert!((volume(&tetrahedron) - 8.0 * 3f64.sqrt() / 27.0).abs() < 1e-6);
    assert!(tetrahedron.positions.iter().all(|p| *p == Vec3::Z || (p.z + 1.0 / 3.0).abs() < 1e-7));
    let mut last_error = f64::INFINITY;
    for depth in 0..7u32 {
        let smooth = shapes::tetrahedral_sphere(2.0, depth, false);
        assert_eq!(smooth.triangle_count(), 4usize.pow(depth + 1));
        assert_eq!(topology(&smooth), (2 * 4usize.pow(depth) + 2, 2, true));
        for (position, normal) in smooth.positions.iter().zip(&smooth.normals) {
            assert!((position.as_dvec3() - normal.as_dvec3() * 2.0).length() < 1e-6);
            assert!((position.as_dvec3().length() - 2.0).abs() < 1e-6);
        }
        // Inscribed, so the area is below 4 pi r^2 and converges to it; halving the edges quarters the error
        // in the limit.
        let error = 1.0 - area(&smooth) / (4.0 * PI * 4.0);
        assert!(error > 0.0 && error < last_error * if depth < 3 { 0.75 } else { 0.3 }, "{error}");
        last_error = error;
        let flat = shapes::tetrahedral_sphere(2.0, depth, true);
        assert_eq!(flat.positions.len(), 3 * flat.triangle_count());
        assert!(normal_deviation(&flat) < 0.05);
        assert!((area(&flat) - area(&smooth)).abs() < 1e-9);
    }
    assert!(last_error < 2e-3, "{last_error}");
}

#[test]
fn the_sphere_of_990_triangles_and_497_points() {
    let sphere = shapes::uv_sphere(1.0, 33, 16);
    assert_eq!(sphere.triangle_count(), 990);
    assert_eq!(topology(&sphere), (497, 2, true));
    // Inscribed in a sphere of volume 4/3 pi: the deficit is about (1 / 6) (pi / 16)^2 + (1 / 6) (2 pi /
    // 33)^2 * 2, or 1.9 %.
    assert!((volume(&sphere) / (4.0 / 3.0 * PI) - 1.0).abs() < 0.025);
    for (position, normal) in sphere.positions.iter().zip(&sphere.normals) {
        assert_eq!(position, normal);
    }
}

#[test]
fn texture_coordinates_run_on_and_never_flip_on_spheres() {
    // The tetrahedral sphere's lower pole lies inside a triangle, whose longitudes cannot be consistent.
    for (mesh, around_a_pole) in
        [(shapes::uv_sphere(1.0, 24, 12), 0), (shapes::tetrahedral_sphere(1.0, 4, false), 1)]
    {
        let mut wide = 0;
        for triangle in mesh.triangles() {
            let [a, b, c] = triangle.map(|v| mesh.uv0[v as usize]);
            // v runs down, so triangles that are counter-clockwise on the surface are clockwise in texture
            // space.
            assert!((b - a).perp_dot(c - a) < 1e-6, "{a} {b} {c}");
            let span = a.x.max(b.x).max(c.x) - a.x.min(b.x).min(c.x);
            wide += usize::from(span > 0.5);
        }
        assert_eq!(wide, around_a_pole);
    }
}

#[test]
fn box_plane_cylinder_cone_and_torus() {
    let cuboid = shapes::cuboid(Vec3::new(2.0, 3.0, 5.0), 4);
    assert_eq!(topology(&cuboid), (98, 2, true)); // 6 n^2 + 2
    assert!((area(&cuboid) - 62.0).abs() < 1e-5 && (volume(&cuboid) - 30.0).abs() < 1e-5);
    assert!(normal_deviation(&cuboid) < 1e-3);

    let plane = shapes::plane(4.0, 2.0, 8, 3);
    assert_eq!((plane.triangle_count(), plane.positions.len()), (48, 36));
    assert!((area(&plane) - 8.0).abs() < 1e-6 && normal_deviation(&plane) == 0.0);
    assert_eq!(plane.normals[0], Vec3::Y);

    // A prism over the inscribed n-gon, whose area is n/2 sin(2 pi / n) for radius 1.
    let n = 40.0;
    let polygon = n / 2.0 * (TAU / n).sin();
    let cylinder = shapes::cylinder(0.5, 2.0, 40);
    assert_eq!(topology(&cylinder), (82, 2, true));
    assert!((volume(&cylinder) - polygon * 0.25 * 2.0).abs() < 1e-5);
    assert!((normal_deviation(&cylinder) - 180.0 / n).abs() < 1e-3);

    let cone = shapes::cone(0.5, 2.0, 40);
    assert_eq!(topology(&cone), (42, 2, true));
    assert!((volume(&cone) - polygon * 0.25 * 2.0 / 3.0).abs() < 1e-5);
    for (position, normal) in cone.positions.iter().zip(&cone.normals).filter(|(_, n)| n.y > -0.5) {
        // On the slope, the normal is perpendicular to the line to the apex.
        let to_apex = Vec3::Y - *position;
        assert!(normal.dot(to_apex).abs() < 1e-6 && (normal.y - 0.5 / 4.25f32.sqrt()).abs() < 1e-6);
    }

    // Pappus's theorem. Both deficits of the inscribed torus are below one percent.
    let torus = shapes::torus(2.0, 0.5, 64, 48);
    assert_eq!(topology(&torus), (64 * 48, 0, true));
    let exact = 2.0 * PI * PI * 2.0 * 0.25;
    assert!(volume(&torus) < exact && volume(&torus) > exact * 0.99);
}

#[test]
fn counts_out_of_range_are_clamped() {
    assert_eq!(shapes::uv_sphere(1.0, 0, 0).triangle_count(), 6);
    assert_eq!(shapes::plane(1.0, 1.0, 0, 0).triangle_count(), 2);
    assert_eq!(shapes::cylinder(1.0, 1.0, 1).triangle_count(), 12);
    assert_eq!(shapes::plane(1.0, 1.0, u32::MAX, 1).triangle_count(), 2 * shapes::MAX_SEGMENTS as usize);
    // A shape without extent has no triangles, and all its values are finite.
    assert!(shapes::cone(0.0, 0.0, 8).normals.iter().all(|n| n.is_finite()));
}

#[test]
fn a_sphere_too_deep_is_refused_before_it_is_built() {
    for depth in [shapes::MAX_DEPTH + 1, 40, u32::MAX] {
        assert_eq!(try_tetrahedral_sphere(1.0, depth, false), Err(ShapeError::TooDeep { depth }));
    }
    for radius in [0.0, -1.0, f32::INFINITY] {
        assert_eq!(try_tetrahedral_sphere(radius, 2, false), Err(ShapeError::Radius { radius }));
    }
    assert!(try_tetrahedral_sphere(f32::NAN, 2, false).is_err());
    assert_eq!(try_tetrahedral_sphere(2.0, 3, true), Ok(shapes::tetrahedral_sphere(2.0, 3, true)));
    let message = try_tetrahedral_sphere(1.0, 99, true).unwrap_err().to_string();
    assert!(message.contains("99") && message.contains("11"), "{message}");
}

#[test]
fn the_fourth_vertex_of_the_code_in_document_i_is_not_on_a_regular_tetrahedron() {
    // The text has z = -1/3 and the code +0.333333, which makes three of the six edges shorter than the
    // others.
    let edges = |fourth: DVec3| {
        let sphere = shapes::tetrahedral_sphere(1.0, 0, false);
        let welded = weld_positions(&sphere.positions);
        let mut points: Vec<DVec3> = welded
            .iter()
            .enumerate()
            .filter(|&(vertex, &first)| vertex == first as usize)
            .map(|(vertex, _)| sphere.positions[vertex].as_dvec3())
            .collect();
        let last = points.iter().position(|p| p.x > 0.1).expect("a corner lies at positive x");
        points[last] = fourth;
        let pairs = (0..4).flat_map(|i| (0..i).map(move |j| (i, j)));
        pairs.map(|(i, j)| (points[i] - points[j]).length()).collect::<Vec<_>>()
    };
    let regular = (8.0f64 / 3.0).sqrt();
    let off = |fourth| edges(fourth).iter().filter(|edge| (**edge - regular).abs() > 1e-6).count();
    assert_eq!(off(DVec3::new(0.816497, -0.471405, -1.0 / 3.0)), 0);
    assert_eq!(off(DVec3::new(0.816497, -0.471405, 0.333333)), 3);
}
