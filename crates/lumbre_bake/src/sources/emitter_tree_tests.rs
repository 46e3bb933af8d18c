//! Tests of the hierarchy of emitters against exact sums over all emitters.

use lumbre_mesh::shapes;

use super::*;
use crate::sampling::{Sequence, Stream};
use crate::scene::Side;

fn emitter(corners: [Vec3; 3], radiance: Vec3) -> Emitter {
    let [a, b, c] = corners;
    let cross = (b - a).cross(c - a);
    Emitter {
        corners,
        corners_f64: corners.map(|corner| corner.as_dvec3()),
        normal: cross.normalize_or_zero(),
        area: 0.5 * cross.length(),
        radiance,
        triangle: 0,
        side: Side::Front,
    }
}

/// The emitters of a sphere of about segments² triangles.
fn ball(center: Vec3, radius: f32, segments: u32, radiance: Vec3) -> Vec<Emitter> {
    let mesh = shapes::uv_sphere(1.0, segments, segments / 2);
    let triangles = mesh.triangle_positions().expect("a valid mesh");
    let placed = triangles.iter().map(|t| emitter(t.map(|p| center + radius * p), radiance));
    placed.filter(|emitter| emitter.area > 0.0).collect()
}

fn receiver(position: Vec3, normal: Vec3) -> Receiver {
    Receiver { position, origin: position, geometric_normal: normal, normal }
}

fn exact(emitters: &[Emitter], receiver: &Receiver) -> DVec3 {
    let (p, n) = (receiver.position.as_dvec3(), receiver.normal.as_dvec3());
    let light = |e: &Emitter| {
        e.radiance.as_dvec3() * (std::f64::consts::PI * point_to_triangle(p, n, &e.corners_f64))
    };
    emitters.iter().map(light).sum()
}

/// The emitters of two spheres of different light and a quadrilateral, and the lamp of each emitter.
fn scene() -> (Vec<Emitter>, Vec<u32>) {
    let mut emitters = ball(Vec3::new(0.3, 1.0, 0.0), 0.1, 44, Vec3::new(3.0, 2.0, 1.0));
    let first = emitters.len();
    emitters.extend(ball(Vec3::new(-0.6, 0.7, 0.2), 0.05, 20, Vec3::new(0.1, 0.2, 9.0)));
    let second = emitters.len();
    let [a, b, c, d] = [[0.0, 0.0], [0.2, 0.0], [0.2, 0.3], [0.0, 0.3]].map(|[x, z]| Vec3::new(x, 1.4, z));
    emitters.extend([emitter([a, b, c], Vec3::ONE), emitter([a, c, d], Vec3::ONE)]);
    let lamp = |index| u32::from(index >= first) + u32::from(index >= second);
    let lamps = (0..emitters.len()).map(lamp).collect();
    (emitters, lamps)
}

/// The largest relative error of a tree's light at some receivers, summed over the channels, and the root of their mean
/// square.
fn errors(tree: &EmitterTree, emitters: &[Emitter], receivers: &[Receiver]) -> [f64; 2] {
    let (mut worst, mut squares) = (0.0f64, 0.0);
    for at in receivers {
        let (computed, expected) = (tree.unoccluded(emitters, 0, at).as_dvec3(), exact(emitters, at));
        let error = (computed - expected).abs().element_sum() / expected.element_sum().max(1e-4);
        (worst, squares) = (worst.max(error), squares + error * error);
    }
    let rms = (squares / receivers.len() as f64).sqrt();
    println!("worst of {}: {:.4} %, RMS {:.4} %", receivers.len(), 100.0 * worst, 100.0 * rms);
    [worst, rms]
}

/// 400 receivers at random places of a box, of which this share looks up and the others aside.
fn receivers(low: Vec3, high: Vec3, upward: f32) -> Vec<Receiver> {
    let random = |i: u32| {
        let [x, y, z, w] = Sequence::new(3, Stream::Test(0), 0).point(i, 0);
        let normal = if w < upward { Vec3::Y } else { Vec3::new(0.6, 0.0, -0.8) };
        receiver(low + (high - low) * Vec3::new(x, y, z), normal)
    };
    (0..400).map(random).collect()
}

#[test]
fn approximating_distant_nodes_by_one_term_is_close_to_the_exact_sum() {
    let (emitters, lamps) = scene();
    let tree = EmitterTree::new(&emitters, &lamps);
    let receivers = receivers(Vec3::new(-1.5, -0.2, -1.5), Vec3::new(1.5, 1.4, 1.5), 0.7);
    let [worst, rms] = errors(&tree, &emitters, &receivers);
    // The error is a small multiple of (r/d)² = 0.0025; where the receiver's horizon or the lamp's cuts off most of the
    // light, it is of the order of r/d itself.
    assert!(worst < 0.03 && rms < f64::from(TERM_ERROR), "{worst} {rms}");
}

/// A lamp of 48 x 24 squares of random colours, 2 wide and 1 deep, that faces down at a height of 1.
fn screen() -> Vec<Emitter> {
    let color = |i: i32| {
        let [x, y, z, _] = Sequence::new(9, Stream::Test(0), 0).point(i as u32, 0);
        Vec3::new(x, y, z * z * z).powf(3.0)
    };
    let place = |i: i32| Vec3::new(((i % 48) as f32 - 23.5) / 24.0, 1.0, ((i / 48) as f32 - 11.5) / 24.0);
    let colored = |i: i32| square(place(i), 1.0 / 24.0).map(|half| Emitter { radiance: color(i), ..half });
    (0..48 * 24).flat_map(colored).collect()
}

#[test]
fn distant_parts_of_a_flat_lamp_are_close_to_the_exact_sum() {
    let emitters = screen();
    let tree = EmitterTree::new(&emitters, &vec![0; emitters.len()]);
    let receivers = receivers(Vec3::new(-2.0, 0.0, -2.0), Vec3::new(2.0, 0.98, 2.0), 0.5);
    let [worst, rms] = errors(&tree, &emitters, &receivers);
    // (r/d)³ = 0.0034 where a node is just small enough; most are farther away, and 0.02 % was measured.
    assert!(worst < 0.0034 && rms < 0.1 * f64::from(TERM_ERROR), "{worst} {rms}");
}

/// Each channel has its own place on the lamp: a red middle, a blue corner, and a green strip along an edge.
#[test]
fn every_channel_of_a_flat_lamp_is_close_to_its_exact_sum() {
    let turn = glam::Quat::from_rotation_y(0.7) * glam::Quat::from_rotation_x(2.1);
    let color = |middle: Vec3| {
        let is_red = middle.x.abs() < 0.5 && middle.z.abs() < 0.25;
        let is_blue = middle.x > 0.8 && middle.z > 0.4;
        [is_red, middle.z < -0.4, is_blue].map(|is_lit| f32::from(u8::from(is_lit)))
    };
    let turned =
        |part: Emitter| emitter(part.corners.map(|corner| turn * corner), color(part.middle()).into());
    let emitters: Vec<Emitter> = screen().into_iter().map(turned).collect();
    let tree = EmitterTree::new(&emitters, &vec![0; emitters.len()]);
    let (mut worst, mut squares) = (0.0f64, 0.0);
    for i in 0..1000 {
        let [x, y, z, w] = Sequence::new(8, Stream::Test(0), 0).point(i, 0);
        let position = turn * Vec3::new(8.0 * x - 4.0, 0.9 - 3.0 * y, 8.0 * z - 4.0);
        let at = receiver(position, turn * Vec3::new(w - 0.5, 1.0, 0.4 - 0.8 * w).normalize());
        let (computed, expected) = (tree.unoccluded(&emitters, 0, &at).as_dvec3(), exact(&emitters, &at));
        let floor = 1e-2 * expected.element_sum() + 1e-6;
        let error = ((computed - expected).abs() / (expected + floor)).max_element();
        (worst, squares) = (worst.max(error), squares + error * error / 1000.0);
        assert!(computed.min_element() >= 0.0, "{computed}");
    }
    println!("worst of 1000: {:.4} %, RMS {:.4} %", 100.0 * worst, 100.0 * squares.sqrt());
    // The worst are near the receiver's horizon.
    assert!(worst < 0.05 && squares.sqrt() < 0.5 * f64::from(TERM_ERROR), "{worst} {squares}");
}

#[test]
fn a_flat_lamp_brings_nothing_behind_and_in_its_plane_and_the_exact_light_across_its_horizon() {
    let emitters = screen();
    let tree = EmitterTree::new(&emitters, &vec![0; emitters.len()]);
    let root = tree.root().unwrap();
    let flat = tree.nodes[root as usize].flat.unwrap();
    let bounds = tree.bounds(root);
    for i in 0..100 {
        let [x, y, z, w] = Sequence::new(4, Stream::Test(0), 0).point(i, 0);
        let at =
            |height: f32, normal: Vec3| receiver(Vec3::new(3.0 * x - 1.5, height, 3.0 * z - 1.5), normal);
        let view = |at: &Receiver| flat.view(&bounds, bounds.center - at.position, at.normal);
        let tilted = Vec3::new(w - 0.5, y - 0.5, 0.3).normalize();
        for dark in
            [at(1.0, Vec3::NEG_Y), at(0.3, Vec3::NEG_Y), at(1.001 + y, Vec3::NEG_Y), at(1.001, tilted)]
        {
            assert_eq!(view(&dark), FlatView::None, "{dark:?}");
            assert_eq!(tree.unoccluded(&emitters, root, &dark), Vec3::ZERO);
        }
        assert_eq!(view(&at(0.9, Vec3::Y)), FlatView::Whole);
        // Close below its plane, with some of it below the receiver's horizon.
        let near = at(0.95, tilted);
        let (computed, expected) =
            (tree.unoccluded(&emitters, root, &near).as_dvec3(), exact(&emitters, &near));
        let error = (computed - expected).abs().element_sum();
        assert!(error <= 0.01 * expected.element_sum() + 1e-6, "{near:?}: {computed} {expected}");
    }
}

#[test]
fn the_distance_of_a_lamp_is_that_of_its_emitters_and_not_of_the_sphere_around_it() {
    let emitters = screen();
    let tree = EmitterTree::new(&emitters, &vec![0; emitters.len()]);
    for i in 0..100 {
        let [x, y, z, _] = Sequence::new(6, Stream::Test(0), 0).point(i, 0);
        let at = receiver(Vec3::new(4.0 * x - 2.0, 1.6 * y, 4.0 * z - 2.0), Vec3::Y);
        // That of the rectangle.
        let outside = (at.position - Vec3::Y).abs() - Vec3::new(1.0, 0.0, 0.5);
        let exact = outside.max(Vec3::ZERO).length();
        let distance = tree.distance(0, &at);
        // A sphere whose radius is a quarter of its distance ends at most 1.5 times as far away; those of single emitters
        // have a radius of up to 0.03.
        assert!(distance <= exact + 1e-5 && distance >= 0.6 * exact - 0.05, "{distance} of {exact}");
    }
}

#[test]
fn a_node_holds_the_emitters_of_its_children() {
    let (emitters, lamps) = scene();
    let tree = EmitterTree::new(&emitters, &lamps);
    let root = tree.root().expect("there are emitters");
    assert_eq!((tree.lamps(root), tree.emitters(root) as usize), (3, emitters.len()));
    let mut all = tree.emitters_of(root).to_vec();
    all.sort_unstable();
    assert!(all.iter().copied().eq(0..emitters.len() as u32));
    let (mut open, mut lamps_found) = (vec![root], Vec::new());
    while let Some(node) = open.pop() {
        let Some(halves) = tree.children(node) else { continue };
        let together: Vec<u32> = halves.iter().flat_map(|&half| tree.emitters_of(half)).copied().collect();
        assert_eq!(tree.emitters_of(node), together);
        for half in halves {
            if tree.lamps(half) == 1 && tree.lamps(node) > 1 {
                let half_lamps: Vec<u32> =
                    tree.emitters_of(half).iter().map(|&e| lamps[e as usize]).collect();
                assert!(half_lamps.iter().all(|lamp| *lamp == half_lamps[0]), "a lamp is one node");
                lamps_found.push(half_lamps[0]);
            }
        }
        open.extend(halves);
    }
    lamps_found.sort_unstable();
    assert_eq!(lamps_found, [0, 1, 2]);
    assert!(EmitterTree::new(&[], &[]).root().is_none());
}

#[test]
fn weights_are_positive_and_sines_grow_to_one_when_near() {
    let (emitters, lamps) = scene();
    let tree = EmitterTree::new(&emitters, &lamps);
    for i in 0..200 {
        let [x, y, z, w] = Sequence::new(5, Stream::Test(0), 0).point(i, 0);
        let at = receiver(Vec3::new(3.0 * x - 1.5, 2.0 * y - 0.4, 3.0 * z - 1.5), Vec3::Y);
        for node in 0..emitters.len() as u32 {
            assert!(tree.weight(node, &at, 0.1 * w) > 0.0);
            assert!((0.0..=1.0).contains(&tree.sine(node, &at, 0.0)));
            assert!(tree.sine(node, &at, 0.5) >= tree.sine(node, &at, 0.0));
        }
    }
    assert_eq!(tree.sine(0, &receiver(Vec3::new(0.2, 0.9, 0.0), Vec3::Y), 0.0), 1.0);
    assert!(tree.sine(0, &receiver(Vec3::new(0.0, -200.0, 0.0), Vec3::Y), 0.0) < 0.02);
}

#[test]
fn the_mean_of_samples_is_the_light_of_their_node() {
    let (emitters, lamps) = scene();
    let tree = EmitterTree::new(&emitters, &lamps);
    // Descents that start at a wide node and inside one.
    let mut nodes = vec![0];
    for place in 0..20 {
        nodes.extend(tree.children(nodes[place]).into_iter().flatten());
    }
    for position in [Vec3::ZERO, Vec3::new(-0.5, 0.2, 0.3), Vec3::new(0.3, 0.8, 0.1)] {
        let at = receiver(position, Vec3::Y);
        for &node in &nodes {
            let members: Vec<Emitter> =
                tree.emitters_of(node).iter().map(|&emitter| emitters[emitter as usize].clone()).collect();
            let expected = exact(&members, &at);
            if expected.element_sum() < 1e-2 * exact(&emitters, &at).element_sum() {
                continue;
            }
            let (n, mut sum) = (1 << 14, DVec3::ZERO);
            for i in 0..n {
                let [u, a, b, _] = Sequence::new(1, Stream::Test(0), 0).point(i, 0);
                let EmitterChoice { emitter, probability, .. } = tree.pick(node, &at, u);
                assert!(tree.emitters_of(node).contains(&emitter), "{emitter} is none of node {node}");
                let e = &emitters[emitter as usize];
                let (s, t) = crate::sampling::triangle_point(a, b);
                let towards =
                    e.corners[0] + (e.corners[1] - e.corners[0]) * s + (e.corners[2] - e.corners[0]) * t
                        - position;
                let direction = towards.normalize();
                let cosines = direction.dot(at.normal).max(0.0) * (-direction.dot(e.normal)).max(0.0);
                sum += e.radiance.as_dvec3()
                    * f64::from(cosines * e.area / (towards.length_squared() * probability));
            }
            let mean = sum / f64::from(n);
            // With a relative standard deviation of about 1 per sample, 5 sigma of 2^14 independent samples is 4 %; the
            // low-discrepancy samples do better.
            let error = (mean - expected).abs().max_element() / expected.max_element();
            assert!(error < 0.02, "{position}, node {node}: {mean} {expected}");
        }
    }
}

/// A horizontal square that emits downwards, as two triangles.
fn square(middle: Vec3, side: f32) -> [Emitter; 2] {
    let corner = |x: f32, z: f32| middle + 0.5 * side * Vec3::new(x, 0.0, z);
    let [a, b, c, d] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    [emitter([a, b, c], Vec3::ONE), emitter([a, c, d], Vec3::ONE)]
}

#[test]
fn a_fully_emissive_ceiling_encloses_a_receiver_and_one_with_small_lamps_does_not() {
    let at = receiver(Vec3::ZERO, Vec3::Y);
    let exact = |emitters: &[Emitter]| -> f32 {
        let of = |e: &Emitter| point_to_triangle(DVec3::ZERO, DVec3::Y, &e.corners_f64);
        emitters.iter().map(of).sum::<f64>() as f32
    };
    let lamps_of =
        |emitters: &[Emitter]| (0..emitters.len() as u32).map(|index| index / 2).collect::<Vec<_>>();
    let place = |i: i32| Vec3::new(0.4 * (i % 10) as f32 - 1.8, 1.0, 0.4 * (i / 10) as f32 - 1.8);
    // Lamps on a hundredth of the ceiling, and on all of it.
    for (side, encloses) in [(0.04, false), (0.4, true)] {
        let emitters: Vec<Emitter> = (0..100).flat_map(|i| square(place(i), side)).collect();
        let estimate = EmitterTree::new(&emitters, &lamps_of(&emitters)).form_factor(&at);
        let exact = exact(&emitters);
        assert_eq!(estimate > 0.5, encloses, "{estimate} instead of {exact}");
        // The estimate evaluates whole triangles at their centres, so it is only approximate.
        assert!(estimate > 0.6 * exact && estimate < 1.6 * exact, "{estimate} instead of {exact}");
    }
}
