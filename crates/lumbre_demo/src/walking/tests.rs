//! Walls stop the body, steps lift it, and nothing tunnels.

use super::*;

const STEP: f64 = 1.0 / 120.0;

/// Returns the twelve triangles of a box.
fn block(min: [f64; 3], max: [f64; 3]) -> Vec<[DVec3; 3]> {
    let corner = |i: usize| {
        let pick = |axis: usize| if i >> axis & 1 == 1 { max[axis] } else { min[axis] };
        DVec3::new(pick(0), pick(1), pick(2))
    };
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let quad =
        |[a, b, c, d]: [usize; 4]| [[corner(a), corner(b), corner(c)], [corner(a), corner(c), corner(d)]];
    faces.into_iter().flat_map(quad).collect()
}

fn floor() -> Vec<[DVec3; 3]> {
    block([-20.0, -1.0, -20.0], [20.0, 0.0, 20.0])
}

fn level(parts: &[Vec<[DVec3; 3]>]) -> TriangleTree {
    TriangleTree::build(parts.concat())
}

fn standing(x: f64, z: f64) -> Body {
    Body { feet: DVec3::new(x, 0.0, z), on_ground: true, ..Body::default() }
}

fn walk(body: &mut Body, velocity: DVec2, level: &TriangleTree, seconds: f64, step: f64) {
    for _ in 0..(seconds / step).round() as usize {
        move_body(body, Wish { velocity, jump: false }, &Stature::default(), level, step);
    }
}

#[test]
fn walks_on_a_floor_at_the_wished_speed() {
    let level = level(&[floor()]);
    let mut body = standing(0.0, 0.0);
    walk(&mut body, DVec2::new(0.0, -2.0), &level, 3.0, STEP);
    assert!(body.on_ground && body.feet.y == 0.0, "{body:?}");
    // 6 m minus the loss while starting, 2 m/s / GRIP = 0.143 m (the discrete sum is one step shorter).
    assert!((body.feet.z + 6.0 - 2.0 / GRIP).abs() < 2.0 * STEP, "{body:?}");
}

#[test]
fn a_wall_stops_at_the_radius_and_a_slanting_walk_slides() {
    let level = level(&[floor(), block([-20.0, 0.0, -5.5], [20.0, 3.0, -5.0])]);
    let mut body = standing(0.0, 0.0);
    walk(&mut body, DVec2::new(0.0, -2.8), &level, 4.0, STEP);
    assert!((body.feet.z - (-5.0 + 0.3)).abs() < 1e-5, "{body:?}");
    assert!(body.feet.x.abs() < 1e-9);
    walk(&mut body, DVec2::new(2.0, -2.0), &level, 2.0, STEP);
    assert!((body.feet.z + 4.7).abs() < 1e-5 && body.feet.x > 3.5, "{body:?}");
}

#[test]
fn corners_hold() {
    let walls = [block([-20.0, 0.0, -5.5], [20.0, 3.0, -5.0]), block([4.0, 0.0, -20.0], [4.5, 3.0, 20.0])];
    let level = level(&[floor(), walls.concat()]);
    let mut body = standing(0.0, 0.0);
    walk(&mut body, DVec2::new(3.0, -3.5), &level, 6.0, STEP);
    assert!((body.feet.x - 3.7).abs() < 1e-4 && (body.feet.z + 4.7).abs() < 1e-4, "{body:?}");
}

#[test]
fn no_step_length_and_no_speed_tunnels() {
    // A wall of zero thickness.
    let sheet = block([-20.0, 0.0, -5.0], [20.0, 40.0, -5.0]);
    let level = level(&[floor(), sheet]);
    for step in [0.001, 0.01, 0.1, 0.25, 1.0, 60.0] {
        let mut body = standing(0.0, 0.0);
        body.velocity = DVec3::new(0.0, 0.0, -1000.0);
        for _ in 0..20 {
            move_body(
                &mut body,
                Wish { velocity: DVec2::new(0.0, -50.0), jump: false },
                &Stature::default(),
                &level,
                step,
            );
        }
        assert!(body.feet.z > -5.0 && body.feet.z <= 0.0, "{step}: {body:?}");
    }
}

#[test]
fn a_fall_ends_on_the_floor_from_any_height_and_at_any_step() {
    let level = level(&[floor()]);
    for step in [STEP, 0.05, 0.5] {
        let mut body = Body { feet: DVec3::new(0.0, 35.0, 0.0), ..Body::default() };
        walk(&mut body, DVec2::ZERO, &level, 10.0, step);
        assert!(body.on_ground && body.feet.y == 0.0 && body.velocity.y == 0.0, "{step}: {body:?}");
    }
}

#[test]
fn climbs_steps_up_to_the_limit_and_no_higher() {
    for (rise, climbs) in [(0.1, true), (0.2, true), (0.34, true), (0.37, false), (0.42, false), (0.6, false)]
    {
        let stairs: Vec<_> = (0..4)
            .flat_map(|k| {
                let z = -2.0 - 0.5 * f64::from(k);
                block([-2.0, 0.0, -8.0], [2.0, rise * f64::from(k + 1), z])
            })
            .collect();
        let level = level(&[floor(), stairs]);
        let mut body = standing(0.0, 0.0);
        walk(&mut body, DVec2::new(0.0, -2.0), &level, 3.0, STEP);
        if climbs {
            assert!((body.feet.y - 4.0 * rise).abs() < 1e-9 && body.feet.z < -4.0, "{rise}: {body:?}");
            walk(&mut body, DVec2::new(0.0, 2.0), &level, 3.0, STEP);
            assert!(body.on_ground && body.feet.y == 0.0, "down again, {rise}: {body:?}");
        } else {
            assert!(body.feet.y == 0.0 && body.feet.z > -2.0, "{rise}: {body:?}");
        }
    }
}

#[test]
fn a_step_without_headroom_is_a_wall() {
    // A step of 0.3 m below a ceiling of 1.9 m leaves 1.6 m for a body of 1.75 m.
    let low = [block([-20.0, 0.0, -8.0], [20.0, 0.3, -2.0]), block([-20.0, 1.9, -8.0], [20.0, 3.0, 8.0])];
    let level = level(&[floor(), low.concat()]);
    let mut body = standing(0.0, 0.0);
    walk(&mut body, DVec2::new(0.0, -2.0), &level, 3.0, STEP);
    assert!(body.feet.y == 0.0 && body.feet.z > -2.0, "{body:?}");
}

#[test]
fn a_jump_rises_by_its_height_and_a_ceiling_ends_it() {
    let open = level(&[floor()]);
    let stature = Stature::default();
    let mut body = standing(0.0, 0.0);
    let mut top = 0.0f64;
    for step in 0..240 {
        let wish = Wish { velocity: DVec2::ZERO, jump: step == 0 };
        move_body(&mut body, wish, &stature, &open, STEP);
        top = top.max(body.feet.y);
    }
    // v²/2g, minus the half step by which explicit integration lags.
    let expected = stature.jump.powi(2) / (2.0 * GRAVITY);
    assert!((top - expected).abs() < stature.jump * STEP, "{top} for {expected}");
    assert!(body.on_ground && body.feet.y == 0.0);

    let low = level(&[floor(), block([-20.0, 2.0, -20.0], [20.0, 3.0, 20.0])]);
    top = 0.0;
    for step in 0..240 {
        move_body(&mut body, Wish { velocity: DVec2::ZERO, jump: step == 0 }, &stature, &low, STEP);
        top = top.max(body.feet.y);
    }
    assert!((top - 0.25).abs() < 0.01, "{top}");
}

#[test]
fn without_a_level_one_falls() {
    let nothing = TriangleTree::default();
    let mut body = standing(0.0, 0.0);
    walk(&mut body, DVec2::ZERO, &nothing, 20.0, STEP);
    assert!(!body.on_ground && body.velocity.y == -TERMINAL && body.feet.is_finite());
}
