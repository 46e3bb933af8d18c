//! Normals of surfaces given by equations: closed forms, agreement of the implicit and parametric forms,
//! poles, and places without a normal.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

use glam::{DMat3, DVec2, DVec3};
use lumbre_mesh::normals::face_normal;
use lumbre_mesh::surfaces::{
    Cone, Cylinder, ImplicitSurface, ParametricSurface, Sphere, SurfaceError, Torus,
    central_difference_gradient, difference_partials, implicit_normal, parametric_mesh, parametric_normal,
    plane_normal,
};
use lumbre_mesh::{shapes, weld_positions};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

const SPHERE: Sphere = Sphere { radius: 0.8 };
const CYLINDER: Cylinder = Cylinder { radius: 0.5, height: 3.0 };
const CONE: Cone = Cone { radius: 0.6, height: 1.7 };
const TORUS: Torus = Torus { major_radius: 2.0, minor_radius: 0.3 };

/// Provides only the points of a surface, so that derivatives and normals are computed from differences.
struct PointsOf<'a>(&'a dyn ParametricSurface);

impl ParametricSurface for PointsOf<'_> {
    fn domain(&self) -> [DVec2; 2] {
        self.0.domain()
    }
    fn closed(&self) -> [bool; 2] {
        self.0.closed()
    }
    fn point(&self, u: f64, v: f64) -> DVec3 {
        let [low, high] = self.domain();
        assert!(
            DVec2::new(u, v).cmpge(low).all() && DVec2::new(u, v).cmple(high).all(),
            "({u}, {v}) is outside"
        );
        self.0.point(u, v)
    }
}

/// Provides points and partial derivatives, so that the normal is computed from them.
struct PartialsOf<'a>(&'a dyn ParametricSurface);

impl ParametricSurface for PartialsOf<'_> {
    fn domain(&self) -> [DVec2; 2] {
        self.0.domain()
    }
    fn closed(&self) -> [bool; 2] {
        self.0.closed()
    }
    fn point(&self, u: f64, v: f64) -> DVec3 {
        self.0.point(u, v)
    }
    fn partials(&self, u: f64, v: f64) -> [DVec3; 2] {
        self.0.partials(u, v)
    }
}

/// The surface of a function over the square [-1, 1]².
struct Patch<F>(F);

impl<F: Fn(f64, f64) -> DVec3> ParametricSurface for Patch<F> {
    fn domain(&self) -> [DVec2; 2] {
        [DVec2::NEG_ONE, DVec2::ONE]
    }
    fn point(&self, u: f64, v: f64) -> DVec3 {
        (self.0)(u, v)
    }
}

fn both_forms() -> [(&'static str, &'static dyn ParametricSurface, &'static dyn ImplicitSurface); 4] {
    [
        ("sphere", &SPHERE, &SPHERE),
        ("cylinder", &CYLINDER, &CYLINDER),
        ("cone", &CONE, &CONE),
        ("torus", &TORUS, &TORUS),
    ]
}

fn angle(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b))
}

#[test]
fn implicit_and_parametric_forms_agree_and_differences_find_them() {
    for (name, parametric, implicit) in both_forms() {
        let [low, high] = parametric.domain();
        let (mut forms, mut from_partials, mut from_points, mut from_values) =
            (0.0f64, 0.0f64, 0.0f64, 0.0f64);
        let mut tangents = 0.0f64;
        for i in 0..=40 {
            for j in 0..=30 {
                let part = DVec2::new(f64::from(i) / 40.0, f64::from(j) / 30.0);
                let DVec2 { x: u, y: v } = low + (high - low) * part;
                let point = parametric.point(u, v);
                // The value is the distance to the surface times a gradient of about two radii.
                assert!(implicit.value(point).abs() < 1e-14, "{name} at {u}, {v}: {}", implicit.value(point));
                let Ok(normal) = parametric.normal(u, v) else {
                    assert!(name == "cone" && j == 30, "{name} has a normal at {u}, {v}");
                    continue;
                };
                assert!((normal.length() - 1.0).abs() < 1e-15);
                forms = forms.max(angle(normal, implicit_normal(implicit, point).unwrap()));
                from_partials =
                    from_partials.max(angle(normal, PartialsOf(parametric).normal(u, v).unwrap()));
                from_points = from_points.max(angle(normal, PointsOf(parametric).normal(u, v).unwrap()));
                let gradient = central_difference_gradient(implicit, point);
                from_values = from_values.max(angle(normal, gradient));
                let widths = high - low;
                let exact = parametric.partials(u, v);
                let found = difference_partials(&PointsOf(parametric), u, v);
                for axis in 0..2 {
                    tangents = tangents.max((exact[axis] - found[axis]).length() * widths[axis]);
                }
            }
        }
        eprintln!(
            "{name:9} forms {forms:.1e}, partials {from_partials:.1e}, points {from_points:.1e}, values {from_values:.1e}, \
             tangents {tangents:.1e}"
        );
        // Both forms are exact, so only the rounding of sines and of the point remains.
        assert!(forms < 4e-15, "{name}: {forms}");
        // Exact except at the sphere's poles, where the limit of document [I]'s product is extrapolated.
        assert!(from_partials < if name == "sphere" { 2e-8 } else { 1e-15 }, "{name}: {from_partials}");
        // Second-order differences with a step of 6e-6 of the width: an error of (6e-6)^2 (2 pi)^3 / 3 radii
        // plus as much rounding, and at the poles divided by the distance of 1/2000.
        assert!(tangents < 3e-8, "{name}: {tangents}");
        assert!(from_points < if name == "sphere" { 2e-6 } else { 1e-8 }, "{name}: {from_points}");
        assert!(from_values < 1e-9, "{name}: {from_values}");
    }
}

#[test]
fn known_normals() {
    let diagonal = DVec3::new(1.0, 1.0, 0.0).normalize();
    assert!(angle(TORUS.normal(0.0, FRAC_PI_4).unwrap(), diagonal) < 1e-15);
    assert!(angle(TORUS.normal(FRAC_PI_2, PI).unwrap(), DVec3::Z) < 1e-15, "the hole's side faces the axis");
    assert!(angle(CYLINDER.normal(FRAC_PI_2, 1.0).unwrap(), DVec3::NEG_Z) < 1e-15);
    // The normal on the side of a cone is perpendicular to its ruling.
    let ruling = CONE.point(1.0, 1.0) - CONE.point(1.0, 0.0);
    assert!(CONE.normal(1.0, 0.4).unwrap().dot(ruling).abs() < 1e-15);
    assert_eq!(SPHERE.normal(2.0, 0.0), Ok(DVec3::NEG_Y));
    assert_eq!(SPHERE.normal(2.0, PI), Ok(DVec3::Y));
    // Document [I]'s sphere: p = (cos u sin v, cos u cos v, sin u); the product of its partial derivatives is
    // (cos u) p.
    let p = |u: f64, v: f64| DVec3::new(u.cos() * v.sin(), u.cos() * v.cos(), u.sin());
    let (u, v) = (0.7f64, 0.4f64);
    let along_u = DVec3::new(-u.sin() * v.sin(), -u.sin() * v.cos(), u.cos());
    let along_v = DVec3::new(u.cos() * v.cos(), -u.cos() * v.sin(), 0.0);
    assert!((along_u.cross(along_v) - u.cos() * p(u, v)).length() < 1e-15);
    let printed = u.cos() * DVec3::new(u.cos() * v.sin(), u.cos() * v.cos(), v.sin());
    assert!((along_u.cross(along_v) - printed).length() > 0.1, "the third component is printed with v for u");
}

#[test]
fn shapes_are_meshes_of_these_surfaces() {
    let forms: [(_, &dyn ImplicitSurface); 2] = [
        (shapes::uv_sphere(0.8, 33, 16), &SPHERE),
        (shapes::torus(2.0, 0.3, 24, 12), &Torus { minor_radius: f64::from(0.3f32), ..TORUS }),
    ];
    for (mesh, surface) in forms {
        for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
            let exact = implicit_normal(surface, position.as_dvec3()).unwrap();
            // The rounding of the position to f32 over the smallest radius, plus the rounding of the normal.
            assert!(
                angle(exact, normal.as_dvec3()) < 2.4 * 6e-8 / 0.3 + 1e-7,
                "{position}: {normal} is not {exact}"
            );
        }
    }
    // The sides of cylinder and cone, without caps.
    let sides: [(_, &dyn ImplicitSurface); 2] = [
        (shapes::cylinder(0.5, 3.0, 20), &CYLINDER),
        (shapes::cone(0.6, 1.7, 20), &Cone { radius: f64::from(0.6f32), height: f64::from(1.7f32) }),
    ];
    for (mesh, surface) in sides {
        let side = mesh.positions.iter().zip(&mesh.normals).filter(|(_, normal)| normal.y.abs() < 0.9);
        let mut checked = 0;
        for (position, normal) in side {
            match implicit_normal(surface, position.as_dvec3()) {
                Ok(exact) => {
                    assert!(angle(exact, normal.as_dvec3()) < 6e-7, "{position}: {normal} is not {exact}")
                }
                Err(error) => assert!(matches!(error, SurfaceError::Singular { .. }), "{error}"),
            }
            checked += 1;
        }
        assert!(checked >= 40, "{checked}");
    }
}

#[test]
fn a_mesh_of_any_surface_closes_its_seams_and_faces_the_normal() {
    // A sphere scaled to an ellipsoid, with normals from differences and from the limit at the poles.
    struct Ellipsoid;
    impl ParametricSurface for Ellipsoid {
        fn domain(&self) -> [DVec2; 2] {
            SPHERE.domain()
        }
        fn closed(&self) -> [bool; 2] {
            SPHERE.closed()
        }
        fn point(&self, u: f64, v: f64) -> DVec3 {
            SPHERE.point(u, v) * DVec3::new(1.0, 0.25, 3.0)
        }
    }
    let mesh = parametric_mesh(&Ellipsoid, 24, 12).unwrap();
    mesh.validate().unwrap();
    let welded = weld_positions(&mesh.positions);
    assert_eq!(welded.iter().enumerate().filter(|(i, w)| *i == **w as usize).count(), 24 * 11 + 2);
    assert_eq!(mesh.triangle_count(), 2 * 24 * 11);
    for triangle in mesh.triangles() {
        let face = face_normal(&triangle.map(|v| mesh.positions[v as usize])).unwrap();
        for vertex in triangle {
            assert!(face.dot(mesh.normals[vertex as usize]) > 0.5);
        }
    }
    for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
        let q = position.as_dvec3() / DVec3::new(1.0, 0.25, 3.0).powf(2.0);
        assert!(angle(q, normal.as_dvec3()) < 2e-6, "{position}: {normal}");
    }
    for counts in [(0, 3), (3, 0), (shapes::MAX_SEGMENTS + 1, 1), (1, u32::MAX)] {
        assert!(matches!(parametric_mesh(&SPHERE, counts.0, counts.1), Err(SurfaceError::Grid { .. })));
    }
    for radius in [f64::NAN, f64::INFINITY, 1e39] {
        assert!(matches!(parametric_mesh(&Sphere { radius }, 8, 4), Err(SurfaceError::NotFinite { .. })));
    }
}

#[test]
fn poles_have_the_normal_of_the_limit_and_apexes_none() {
    for surface in [&PartialsOf(&SPHERE) as &dyn ParametricSurface, &PointsOf(&SPHERE)] {
        for u in [0.0, 1.0, 5.0, TAU] {
            for (v, exact) in [(0.0, DVec3::NEG_Y), (PI, DVec3::Y)] {
                let found = surface.normal(u, v).unwrap();
                assert!(angle(found, exact) < 2e-6, "{u}, {v}: {found}");
            }
        }
    }
    for u in [0.0, 2.0] {
        for surface in [&CONE as &dyn ParametricSurface, &PartialsOf(&CONE), &PointsOf(&CONE)] {
            assert_eq!(surface.normal(u, 1.0), Err(SurfaceError::NoTangentPlane { u, v: 1.0 }));
        }
    }
    let apex = DVec3::Y * 0.5 * CONE.height;
    assert_eq!(implicit_normal(&CONE, apex), Err(SurfaceError::Singular { point: apex }));
    assert!(implicit_normal(&SPHERE, DVec3::ZERO).is_err());
    assert!(implicit_normal(&TORUS, DVec3::Y * 0.3).is_err());

    // Derivatives that vanish on a smooth surface: both of them, and one along a line.
    let still = Patch(|u: f64, v: f64| DVec3::new(u * u * u, v * v * v, 0.0));
    assert!(angle(parametric_normal(&still, 0.0, 0.0).unwrap(), DVec3::Z) < 1e-9);
    let saddle = Patch(|u: f64, v: f64| DVec3::new(u.powi(3), v, 0.3 * (u.powi(6) - v * v)));
    let exact = DVec3::new(0.0, 0.6 * 0.5, 1.0);
    assert!(angle(parametric_normal(&saddle, 0.0, 0.5).unwrap(), exact) < 1e-7);
    // A fold, where the front changes sides; a line, which has no front; a point.
    let fold = Patch(|u: f64, v: f64| DVec3::new(u * u, v, 0.0));
    assert!(matches!(parametric_normal(&fold, 0.0, 0.0), Err(SurfaceError::NoTangentPlane { .. })));
    let line = Patch(|u: f64, v: f64| DVec3::X * (u + v));
    assert!(matches!(parametric_normal(&line, 0.1, 0.2), Err(SurfaceError::NoTangentPlane { .. })));
    let dot = Patch(|_, _| DVec3::ONE);
    assert!(matches!(parametric_normal(&dot, 0.1, 0.2), Err(SurfaceError::NoTangentPlane { .. })));
    let nothing = Patch(|_, _| DVec3::NAN);
    assert!(matches!(parametric_normal(&nothing, 0.1, 0.2), Err(SurfaceError::NotFinite { .. })));
}

#[test]
fn differences_keep_their_digits_at_any_size_and_place() {
    // A sphere of any radius, also far from the origin, given by its equation and a scale.
    struct Placed(f64, DVec3);
    impl ImplicitSurface for Placed {
        fn value(&self, point: DVec3) -> f64 {
            (point - self.1).length_squared() - self.0 * self.0
        }
        fn scale(&self) -> f64 {
            self.0
        }
    }
    for radius in [1e-6, 1e-3, 1.0, 1e3, 1e9] {
        for place in [DVec3::ZERO, DVec3::new(7.0, -3.0, 11.0) * radius, DVec3::splat(1e6) * radius] {
            for normal in
                [DVec3::X, DVec3::new(1.0, 2.0, -3.0).normalize(), DVec3::new(0.1, -1.0, 0.02).normalize()]
            {
                let found = implicit_normal(&Placed(radius, place), place + normal * radius).unwrap();
                // Far away the point itself is rounded, to 2^-53 of its coordinates.
                let rounding = place.abs().max_element() / radius * f64::EPSILON;
                assert!(angle(found, normal) < 1e-9 + rounding, "{radius}, {place}: {found} is not {normal}");
            }
        }
    }
    // At the edge of a square root's domain f is finite on one side only: y - sqrt(1 - x^2) has an infinite
    // slope at x = 1.
    let edge = |p: DVec3| p.y - (1.0 - p.x * p.x).sqrt();
    let found = implicit_normal(&edge, DVec3::X).unwrap();
    assert!(angle(found, DVec3::X) < 0.01, "{found}");
    assert!(implicit_normal(&|_: DVec3| f64::NAN, DVec3::ZERO).is_err());
    assert!(implicit_normal(&|p: DVec3| p.x, DVec3::splat(f64::INFINITY)).is_err());
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        6 => -10.0..10.0f64,
        2 => prop::sample::select(vec![0.0, 1.0, -1.0, 2.0, 1e-300, 1e300, f64::MAX, f64::MIN_POSITIVE]),
        1 => prop::sample::select(vec![f64::NAN, f64::INFINITY]),
    ]
}

fn vector() -> impl Strategy<Value = DVec3> {
    [number(), number(), number()].prop_map(DVec3::from)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, rng_seed: RngSeed::Fixed(4), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn three_points_have_a_unit_normal_or_an_error(a in vector(), b in vector(), c in vector()) {
        match plane_normal(&[a, b, c]) {
            Ok(normal) => {
                prop_assert!((normal.length() - 1.0).abs() < 1e-15);
                prop_assert_eq!(plane_normal(&[b, c, a]).map(|n| angle(n, normal) < 1e-15), Ok(true));
                prop_assert_eq!(plane_normal(&[a, c, b]).map(|n| angle(n, -normal) < 1e-15), Ok(true));
            }
            Err(SurfaceError::NotFinite { .. }) => prop_assert!(![a, b, c].iter().all(|p| p.is_finite())),
            Err(error) => prop_assert_eq!(error, SurfaceError::Collinear),
        }
    }

    #[test]
    fn points_on_a_line_have_no_normal_and_points_beside_it_do(
        a in [-10.0..10.0f64, -10.0..10.0f64, -10.0..10.0f64].prop_map(DVec3::from),
        along in [-10.0..10.0f64, -10.0..10.0f64, -10.0..10.0f64].prop_map(DVec3::from),
        step in -40i32..40,
        exponent in -200i32..200,
    ) {
        prop_assume!(along.length() > 1e-3);
        // Integer multiples of a vector with few digits lie exactly on a line.
        let along = (along * 1024.0).round();
        let a = (a * 1024.0).round();
        let scale = 2f64.powi(exponent);
        let line = [a, a + along, a + along * f64::from(step)].map(|point| point * scale);
        prop_assert_eq!(plane_normal(&line), Err(SurfaceError::Collinear));
        // A point at a millionth of the length beside the line gives a plane, whose normal is perpendicular
        // to both vectors.
        let aside = along.any_orthonormal_vector();
        let apart = along.length() * 1e-6;
        let beside = [a, a + along, a + along * 0.5 + aside * apart].map(|point| point * scale);
        let normal = plane_normal(&beside).expect("a plane");
        // The rounding of the points, 2^-53 of their size, over the distance from the line.
        let bound = 4.0 * f64::EPSILON * (a.length() + along.length()) / apart;
        prop_assert!(angle(normal, along.cross(aside)) < bound, "{normal}, {bound}");
    }

    #[test]
    fn a_turned_ellipsoid_has_the_normal_of_its_gradient(
        radii in [0.2..3.0f64, 0.2..3.0f64, 0.2..3.0f64].prop_map(DVec3::from),
        turn in [0.0..6.0f64, 0.0..6.0f64],
        u in 0.0..6.2f64,
        v in 0.0..3.2f64,
    ) {
        let rotation = DMat3::from_rotation_y(turn[0]) * DMat3::from_rotation_x(turn[1]);
        let form = rotation * DMat3::from_diagonal(1.0 / (radii * radii)) * rotation.transpose();
        let v = v.min(PI);
        let point = rotation * (Sphere { radius: 1.0 }.point(u, v) * radii);
        let ellipsoid = |p: DVec3| p.dot(form * p) - 1.0;
        let exact = form * point;
        let found = implicit_normal(&ellipsoid, point).unwrap();
        // Central differences of a quadratic have no truncation error; rounding costs 2^-53 of the terms, up
        // to (3 / 0.2)^2, over the step.
        prop_assert!(angle(found, exact) < 225.0 * 2.3e-16 * 8.0 / (6e-6 * exact.length()), "{found} is not {exact}");
    }
}
