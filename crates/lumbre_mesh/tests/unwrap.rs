//! Lightmap charts are injective, separated by the gap and of the requested density, for shapes and for a
//! scanned mesh.

use std::path::Path;

use glam::{Quat, Vec2, Vec3};
use lumbre_mesh::uv_validation::{for_each_owned_texel, validate_uv1};
use lumbre_mesh::{TriangleMesh, UnwrapError, UnwrapOptions, Unwrapped, shapes, unwrap};

fn unwrapped(mesh: &TriangleMesh, density: f64, options: UnwrapOptions) -> Unwrapped {
    let unwrapped = unwrap(mesh, &mesh.positions, density, options).expect("a sound mesh unwraps");
    check(mesh, &unwrapped, density, options);
    unwrapped
}

/// Signed area of a triangle's coordinates in texels; positive if counter-clockwise.
fn texel_area(unwrapped: &Unwrapped, triangle: [u32; 3]) -> f64 {
    let size = Vec2::new(unwrapped.width as f32, unwrapped.height as f32).as_dvec2();
    let [a, b, c] = triangle.map(|v| unwrapped.mesh.uv1[v as usize].as_dvec2() * size);
    0.5 * (b - a).perp_dot(c - a)
}

fn area(mesh: &TriangleMesh, triangle: [u32; 3]) -> f64 {
    let [a, b, c] = triangle.map(|v| mesh.positions[v as usize].as_dvec3());
    0.5 * (b - a).cross(c - a).length()
}

/// Checks what must hold for every result.
fn check(mesh: &TriangleMesh, unwrapped: &Unwrapped, density: f64, options: UnwrapOptions) {
    let Unwrapped { mesh: result, vertex_sources, width, height, charts } = unwrapped;
    // The triangles are the same, at the same positions.
    assert_eq!(result.indices.len(), mesh.indices.len());
    assert_eq!(vertex_sources.len(), result.positions.len());
    for (&new, &old) in result.indices.iter().zip(&mesh.indices) {
        assert_eq!(vertex_sources[new as usize], old);
        assert_eq!(
            result.positions[new as usize].to_array().map(f32::to_bits),
            mesh.positions[old as usize].to_array().map(f32::to_bits)
        );
    }
    // Every triangle is in exactly one chart.
    let mut all: Vec<u32> = charts.iter().flat_map(|chart| chart.triangles.iter().copied()).collect();
    all.sort_unstable();
    assert_eq!(all, (0..mesh.triangle_count() as u32).collect::<Vec<_>>());
    // No two triangles own the same texel.
    let report = validate_uv1(result, *width, *height).expect("what was unwrapped can be checked");
    assert!(report.is_sound(), "{report:?}");
    // Chart rectangles extended by the gap are disjoint and within the page; checked by painting them.
    let mut painted = vec![false; *width as usize * *height as usize];
    for chart in charts {
        assert!(chart.x + chart.width <= *width && chart.y + chart.height <= *height);
        for y in chart.y..(chart.y + chart.height + options.gap).min(*height) {
            for x in chart.x..(chart.x + chart.width + options.gap).min(*width) {
                let texel = &mut painted[y as usize * *width as usize + x as usize];
                assert!(!*texel, "two charts at {x}, {y}");
                *texel = true;
            }
        }
    }
    let triangles: Vec<[u32; 3]> = result.triangles().collect();
    let cosine = options.chart_angle.to_radians().cos();
    for chart in charts {
        for &triangle in &chart.triangles {
            let triangle = triangles[triangle as usize];
            // All coordinates are at least half a texel inside the rectangle; f32 is accurate to 1e-3 texels
            // at this page size.
            for vertex in triangle {
                let texel = result.uv1[vertex as usize] * Vec2::new(*width as f32, *height as f32);
                let low = texel - Vec2::new(chart.x as f32, chart.y as f32) - 0.5;
                let high = Vec2::new(chart.width as f32, chart.height as f32) - 1.0 - low;
                assert!(low.min_element() > -1e-3 && high.min_element() > -1e-3 || chart.width == 1);
            }
            if chart.normal != Vec3::ZERO {
                // The density is reached, up to the tilt within a chart and the rounding of coordinates to
                // f32.
                let wanted = area(result, triangle) * density * density * cosine;
                assert!(texel_area(unwrapped, triangle) > wanted * (1.0 - 1e-3) - 1e-2);
            }
        }
    }
}

#[test]
fn a_box_has_six_charts_that_lie_along_the_axes() {
    let mesh = shapes::cuboid(Vec3::new(4.0, 2.0, 3.0), 2);
    let result = unwrapped(&mesh, 10.0, UnwrapOptions::default());
    let mut sizes: Vec<_> = result.charts.iter().map(|chart| (chart.width, chart.height)).collect();
    sizes.sort_unstable();
    // 4 x 3, 4 x 2 and 3 x 2 metres with 10 texels per metre, plus one texel for the border.
    assert_eq!(sizes, [(31, 21), (31, 21), (41, 21), (41, 21), (41, 31), (41, 31)]);
    for triangle in result.mesh.triangles() {
        // The sides are whole numbers of texels, so the density is exact up to the rounding of f32
        // coordinates.
        assert!((texel_area(&result, triangle) / (area(&result.mesh, triangle) * 100.0) - 1.0).abs() < 1e-3);
        let [a, b, c] = triangle.map(|v| result.mesh.uv1[v as usize]);
        let along = |p: Vec2, q: Vec2| (p.x - q.x).abs() < 1e-5 || (p.y - q.y).abs() < 1e-5;
        assert!([along(a, b), along(b, c), along(c, a)].iter().filter(|&&along| along).count() == 2);
    }
}

#[test]
fn a_turned_and_scaled_node_counts() {
    let mesh = shapes::plane(1.0, 1.0, 3, 3);
    let turn = Quat::from_euler(glam::EulerRot::XYZ, 0.7, 0.4, 1.1);
    let world: Vec<Vec3> = mesh.positions.iter().map(|&p| turn * (p * Vec3::new(8.0, 1.0, 2.0))).collect();
    let result = unwrap(&mesh, &world, 4.0, UnwrapOptions::default()).unwrap();
    assert_eq!(result.charts.len(), 1);
    assert_eq!((result.width, result.height), (33, 9));
    assert_eq!(result.mesh.positions, mesh.positions);
}

#[test]
fn curved_shapes() {
    for mesh in [
        shapes::tetrahedral_sphere(1.0, 4, false),
        shapes::tetrahedral_sphere(1.0, 2, true),
        shapes::uv_sphere(2.0, 33, 16),
        shapes::cylinder(0.5, 2.0, 40),
        shapes::cone(0.7, 1.0, 24),
        shapes::torus(1.0, 0.3, 32, 16),
    ] {
        for (density, gap) in [(20.0, 2), (3.0, 4)] {
            let result = unwrapped(&mesh, density, UnwrapOptions { gap, ..UnwrapOptions::default() });
            assert!(result.charts.len() <= 24, "{} charts", result.charts.len());
        }
    }
}

/// A nearly flat strip that winds twice around an axis: its normals fit into one chart, but its projection
/// overlaps.
fn spiral() -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let steps = 80u32;
    for step in 0..=steps {
        let angle = step as f32 / steps as f32 * 4.0 * std::f32::consts::PI;
        for radius in [1.0, 2.0] {
            mesh.positions.push(Vec3::new(angle.cos() * radius, angle * 0.02, -angle.sin() * radius));
        }
    }
    for i in 0..steps {
        let [a, b, c, d] = [2 * i, 2 * i + 1, 2 * i + 3, 2 * i + 2];
        mesh.indices.extend([a, b, c, a, c, d]);
    }
    mesh
}

#[test]
fn a_spiral_is_cut_where_it_would_cover_itself() {
    let result = unwrapped(&spiral(), 16.0, UnwrapOptions::default());
    assert!((2..=4).contains(&result.charts.len()), "{} charts", result.charts.len());
}

#[test]
fn coincident_and_two_sided_faces_stay_apart() {
    let mut mesh = shapes::plane(1.0, 1.0, 2, 2);
    let front = mesh.indices.clone();
    mesh.indices.extend(&front);
    mesh.indices.extend(front.chunks(3).flat_map(|t| [t[0], t[2], t[1]]));
    unwrapped(&mesh, 12.0, UnwrapOptions::default());
}

#[test]
fn triangles_without_area_share_a_spot() {
    let mut mesh = shapes::plane(1.0, 1.0, 1, 1);
    mesh.positions.push(Vec3::NAN);
    mesh.normals.push(Vec3::Y);
    mesh.uv0.push(Vec2::ZERO);
    mesh.indices.extend([0, 0, 1, 2, 3, 4]);
    let result = unwrapped(&mesh, 8.0, UnwrapOptions::default());
    assert_eq!(result.charts.len(), 2);
    assert_eq!((result.charts[1].width, result.charts[1].triangles.as_slice()), (1, &[2, 3][..]));
    assert!(result.mesh.uv1.iter().all(|uv| uv.is_finite()));
}

#[test]
fn what_cannot_be_unwrapped_is_an_error() {
    let mesh = shapes::plane(1.0, 1.0, 1, 1);
    let attempt = |mesh: &TriangleMesh, density, options| unwrap(mesh, &mesh.positions, density, options);
    let default = UnwrapOptions::default();
    for density in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(attempt(&mesh, density, default), Err(UnwrapError::Density { .. })));
    }
    for density in [1e6, 1e300] {
        assert!(matches!(attempt(&mesh, density, default), Err(UnwrapError::TooLarge { .. })));
    }
    // Each face fits, but all six together do not.
    let small = UnwrapOptions { max_size: 64, ..default };
    assert!(matches!(attempt(&shapes::cuboid(Vec3::ONE, 1), 60.0, small), Err(UnwrapError::TooLarge { .. })));
    let angle = UnwrapOptions { chart_angle: 90.0, ..default };
    assert!(matches!(attempt(&mesh, 1.0, angle), Err(UnwrapError::ChartAngle { .. })));
    assert!(matches!(unwrap(&mesh, &[], 1.0, default), Err(UnwrapError::Mesh(_))));
    let broken = TriangleMesh { indices: vec![0, 1, 99], ..mesh };
    assert!(matches!(attempt(&broken, 1.0, default), Err(UnwrapError::Mesh(_))));
    assert_eq!(unwrap(&TriangleMesh::default(), &[], 1.0, default).unwrap().charts, []);
}

#[test]
fn a_scanned_bunny_in_under_two_seconds() {
    let path =
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared")).join("models/stanford-bunny.glb");
    let Ok((document, buffers, _)) = gltf::import(&path) else {
        eprintln!("SKIPPED: no scanned mesh at {}", path.display());
        return;
    };
    let mut mesh = TriangleMesh::default();
    for primitive in document.meshes().flat_map(|mesh| mesh.primitives().collect::<Vec<_>>()) {
        let reader = primitive.reader(|buffer| Some(&buffers[buffer.index()][..]));
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(reader.read_positions().unwrap().map(Vec3::from));
        mesh.indices.extend(reader.read_indices().unwrap().into_u32().map(|index| index + first));
    }
    let extent = mesh.positions.iter().fold(0f32, |size, p| size.max(p.abs().max_element()));
    let start = std::time::Instant::now();
    let density = 400.0 / f64::from(extent);
    let result = unwrap(&mesh, &mesh.positions, density, UnwrapOptions::default()).unwrap();
    let seconds = start.elapsed().as_secs_f64();
    check(&mesh, &result, density, UnwrapOptions::default());
    let mut owned = 0u64;
    for triangle in result.mesh.triangles() {
        let size = Vec2::new(result.width as f32, result.height as f32).as_dvec2();
        let corners = triangle.map(|v| result.mesh.uv1[v as usize].as_dvec2() * size);
        for_each_owned_texel(&corners, result.width, result.height, |_, _| owned += 1);
    }
    let used = owned as f64 / (f64::from(result.width) * f64::from(result.height));
    let (triangles, charts) = (mesh.triangle_count(), result.charts.len());
    eprintln!(
        "{triangles} triangles: {charts} charts, {} x {} texels, {:.0} % used, {seconds:.2} s",
        result.width,
        result.height,
        used * 100.0
    );
    // Two seconds is the goal for optimized builds on an idle machine; ten times as long is a fault on any
    // machine.
    assert!(seconds < 20.0, "{seconds} s");
    assert!(triangles > 60_000 && charts < triangles / 50, "{charts} charts of {triangles} triangles");
}
