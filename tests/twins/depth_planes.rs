//! The planes of shadow maps: what a receiver's plane says of a block must be what it says of each texel.

use lumbre_tests::kernel::Kernel;

use crate::inputs::Sequence;

/// 36 depths of a block and around it; the texel, from 0 on; the receiver's depth at the first texel and its
/// change.
const INPUTS: usize = 36 + 2 + 3;
/// Cases of each kind.
const CASES: usize = 40_000;

/// Returns what the plane of the block says, and how many of nine texels are lit.
fn kernel() -> Kernel {
    let call = "
        var plane = depth_plane(vec4<f32>(x[0], x[5], x[30], x[35]));
        for (var i = 0; i < 36; i++) {
            plane = with_texel(plane, vec2<f32>(f32(i % 6), f32(i / 6)) - 2.5, x[i]);
        }
        let texel = vec2<f32>(x[36], x[37]);
        let slope = vec2<f32>(x[39], x[40]);
        let said = side_of_plane(x[38], slope, texel, plane);
        var lit = 0.0;
        for (var i = 0; i < 9; i++) {
            let aside = vec2<f32>(f32(i % 3), f32(i / 3)) - 1.0;
            let in_block = texel - 4.0 * floor(texel / 4.0) + 1.0 + aside;
            let depth = max(x[38] + dot(slope, texel + aside), 0.0);
            lit += select(0.0, 1.0, depth >= x[i32(in_block.y) * 6 + i32(in_block.x)]);
        }
        return array<f32, 2>(said, lit);";
    let imports = ["package::depth_plane::{depth_plane, with_texel, side_of_plane}"];
    Kernel::new("depth_plane", &imports, &[], INPUTS, 2, call)
}

/// A surface as a map stores it, and a receiver in front of it, in it or behind it. `rough` is by how much
/// texels deviate from a plane, relative to their depth.
fn case(sequence: &mut Sequence, rough: f32) -> Vec<f32> {
    let depth = sequence.decades(-4.0, -0.3);
    let slope = |sequence: &mut Sequence| depth * sequence.between(-1.0, 1.0) * sequence.decades(-4.0, -0.7);
    let [across, down] = [slope(sequence), slope(sequence)];
    // A step: the rest of the block is another surface, or nothing.
    let step = (rough > 0.0 && sequence.next() < 0.3).then(|| sequence.between(-3.0, 3.0));
    let beyond = if sequence.next() < 0.5 { 0.0 } else { depth * sequence.decades(-1.0, 1.0) };
    let texels = (0..36).map(|texel| {
        let place = [texel % 6, texel / 6].map(|at| at as f32 - 2.5);
        if step.is_some_and(|step| place[0] + 0.3 * place[1] > step) {
            return beyond;
        }
        let plane = depth + across * place[0] + down * place[1];
        (plane * (1.0 + rough * sequence.between(-1.0, 1.0))).max(0.0)
    });
    let mut texels: Vec<f32> = texels.collect();
    let block = [0, 1].map(|_| (sequence.between(0.0, 256.0)).floor());
    let inside = [0, 1].map(|_| (sequence.between(0.0, 4.0)).floor().min(3.0));
    let texel = [0, 1].map(|axis| 4.0 * block[axis] + inside[axis]);
    // The receiver: parallel to the surface, or in any direction.
    let [own_across, own_down] = match sequence.next() < 0.5 {
        true => [across, down].map(|slope| slope * 1.0001),
        false => [slope(sequence), slope(sequence)],
    };
    let near = sequence.between(-1.0, 1.0) * sequence.decades(-6.0, 0.0);
    let mut here = (depth + across * (inside[0] - 1.5) + down * (inside[1] - 1.5)) * (1.0 + near);
    if sequence.next() < 0.1 {
        // Nothing is drawn there, and the receiver's plane may lie beyond its horizon.
        texels.fill(0.0);
        here = depth * sequence.between(-1.0, 1.0);
    }
    let first = here - own_across * texel[0] - own_down * texel[1];
    [&texels[..], &texel, &[first, own_across, own_down]].concat()
}

/// Returns how often the plane was certain and wrong, certain and right, and uncertain.
fn counts(kernel: &Kernel, rough: f32) -> [usize; 3] {
    let mut sequence = Sequence(7);
    let inputs: Vec<f32> = (0..CASES).flat_map(|_| case(&mut sequence, rough)).collect();
    let mut counts = [0; 3];
    for said in kernel.run(crate::gpu(), &inputs).chunks_exact(2) {
        counts[match (said[0], said[1]) {
            (-1.0, _) => 2,
            (1.0, 9.0) | (0.0, 0.0) => 1,
            _ => 0,
        }] += 1;
    }
    counts
}

#[test]
fn what_a_plane_says_of_a_block_is_what_every_texel_says() {
    for (rough, certain) in [(0.0, 0.4), (1e-5, 0.3), (1e-3, 0.2), (0.1, 0.1)] {
        let [wrong, right, open] = counts(&kernel(), rough);
        println!("roughness {rough}: {right} certain, {open} open, {wrong} wrong");
        assert_eq!(wrong, 0, "roughness {rough}");
        assert!(right as f32 > certain * CASES as f32 && open > 0, "roughness {rough}: {right}, {open}");
    }
}

#[test]
fn a_plane_that_forgets_its_texels_or_its_slope_is_found_out() {
    for (term, without) in [
        ("plane.deviation + change.x", "change.x"),
        ("plane.deviation + change.x + change.y", "plane.deviation + change.x"),
        ("+ rounding;", "- 1e-5 * abs(first);"),
        ("stored - own_change.x", "1.0 + stored - own_change.x"),
    ] {
        let [wrong, ..] = counts(&kernel().mutated("package::depth_plane", term, without), 1e-3);
        assert!(wrong > 0, "{term}");
    }
}
