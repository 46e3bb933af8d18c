//! The stated error of single texels against the tests' path tracer, which shares no code with the baker, in scenes from the generators by
//! numbers that no constant was chosen on: at most twice the stated one on 95 of a hundred texels. Against converged bakes: `honest_error`.

#![allow(clippy::print_stdout, reason = "the shares are what one wants to see of it")]

use std::f64::consts::PI;

use bevy_ecs::world::World;
use glam::{DVec2, DVec3};
use lumbre_bake::{Bake, BakeOptions, Density, TexelErrors};
use lumbre_scene::{GlobalTransform, Lightmap, Mesh, Name};

use crate::held_out::path_tracer::{Effort, PathTracer};
use crate::held_out::random::Random;
use crate::held_out::scenes;

/// Texels of a scene that are judged.
const TEXELS: usize = 300;
/// The texels farthest beyond what they state that are printed.
const MISSES: usize = 24;
/// Places along a texel's side at which its light is traced.
const PLACES: u32 = 3;
/// The effort for a place: 3,200 paths choose how many more bring the standard error down to a tenth of its light, up to
/// 25,600. Where the light comes through gaps that few paths find, a fixed number of them mostly traces too little light,
/// and too little noise.
const EFFORT: Effort = Effort { side: 20, error: 0.1, batches: [8, 64] };
/// What lies this far beyond a texel's middle, in texels, is another's.
const HALF: f64 = 0.499;

/// A texel that shows one triangle and nothing else.
struct Texel {
    /// The object that it is on.
    object: String,
    /// Irradiance and its stated error, W/m².
    value: DVec3,
    stated: f64,
    /// Its corner, and what a texel more along either side adds, metres.
    corner: DVec3,
    right: DVec3,
    up: DVec3,
    normal: DVec3,
}

impl Texel {
    fn point(&self, x: f64, y: f64) -> DVec3 {
        self.corner + self.right * x + self.up * y
    }
}

/// The texels that lie wholly in one triangle of what shows them, and state an error.
fn texels(world: &mut World) -> Vec<Texel> {
    let mut found = Vec::new();
    let mut query = world.query::<(&Mesh, &Lightmap, &TexelErrors, &GlobalTransform, Option<&Name>)>();
    for (mesh, map, errors, transform, name) in query.iter(world) {
        let (mesh, map) = (&mesh.0, &map.image);
        let size = DVec2::new(map.width.into(), map.height.into());
        for vertices in mesh.triangles() {
            let [a, b, c] = vertices.map(|vertex| mesh.uv1[vertex as usize].as_dvec2() * size);
            let [p, q, r] = vertices
                .map(|vertex| transform.0.transform_point3(mesh.positions[vertex as usize].as_dvec3()));
            let (along, across) = (b - a, c - a);
            let twice = along.perp_dot(across);
            let Some(normal) = (q - p).cross(r - p).try_normalize().filter(|_| twice != 0.0) else {
                continue;
            };
            let weights = |at: DVec2| ((at - a).perp_dot(across) / twice, along.perp_dot(at - a) / twice);
            let place = |at: DVec2| {
                let (u, v) = weights(at);
                p + (q - p) * u + (r - p) * v
            };
            let is_inside = |at: DVec2| {
                let (u, v) = weights(at);
                u >= 0.0 && v >= 0.0 && u + v <= 1.0
            };
            let (low, high) = (a.min(b).min(c), a.max(b).max(c));
            for y in low.y as u32..(high.y.ceil() as u32).min(map.height) {
                for x in low.x as u32..(high.x.ceil() as u32).min(map.width) {
                    let corner = DVec2::new(x.into(), y.into());
                    let corners = [[-HALF, -HALF], [HALF, -HALF], [-HALF, HALF], [HALF, HALF]];
                    let index = (y * map.width + x) as usize;
                    let stated = f64::from(errors.0[index]) * PI;
                    if !corners.iter().all(|&off| is_inside(corner + 0.5 + DVec2::from(off)))
                        || stated.is_nan()
                    {
                        continue;
                    }
                    let (own, right, up) =
                        (place(corner), place(corner + DVec2::X), place(corner + DVec2::Y));
                    let value = map.texels[index].as_dvec3() * PI;
                    found.push(Texel {
                        object: name.map_or_else(String::new, |name| name.to_string()),
                        value,
                        stated,
                        corner: own,
                        right: right - own,
                        up: up - own,
                        normal,
                    });
                }
            }
        }
    }
    found
}

/// By how much a place is lifted off its surface before it is asked whether it is in the open, in metres. Corners of
/// meshes are rounded to f32, so that things that stand on a surface may leave a crack of some ten nanometres.
const LIFT: f64 = 1e-4;

/// Returns true if a place is in the open, and not inside something that stands on its surface: then rays meet the back
/// of a face. They leave at a slant, as along the normal they could meet the floor in whose plane the thing ends. Nor is
/// a place in the open if another face touches it: on which side of that one its rays begin, rounding decides.
fn is_open(tracer: &PathTracer, place: DVec3, normal: DVec3) -> bool {
    !tracer.touches(place, normal)
        && [DVec3::new(0.31, 0.74, 0.23), DVec3::new(-0.52, 0.11, 0.67), DVec3::new(0.09, -0.63, -0.41)]
            .into_iter()
            .map(|slant| (normal + 0.9 * slant).normalize())
            .all(|direction| {
                let hit = tracer.scene.closest(place + normal * LIFT, direction);
                hit.is_none_or(|hit| tracer.scene.triangles[hit.triangle].normal.dot(direction) < 0.0)
            })
}

/// How many of a scene's texels are judged, are within twice what they state, and would be if they stated half as much.
fn judged(name: &str, texels_per_meter: f64) -> [f64; 3] {
    let (build, layout) = scenes::find(name).expect("the generators know it");
    let mut world = build(layout, 1.0);
    let tracer = PathTracer::new(&mut world);
    let density = Density::TexelsPerMeter(texels_per_meter);
    let options = BakeOptions { density, error: 0.02, resolution_error: false, ..BakeOptions::default() };
    let report = Bake::new(&options).run(&mut world).expect("the scene bakes");
    // A statement of 100 % would hold for every texel.
    assert!(report.estimated_error < 0.03, "{name}: {report}");
    let (mut all, mut random) = (texels(&mut world), Random::new(11));
    let mut found = [0.0; 3];
    let mut misses = Vec::new();
    while found[0] < TEXELS as f64 && !all.is_empty() {
        let texel = all.swap_remove((random.uniform() * all.len() as f64) as usize);
        let places: Vec<(DVec3, DVec3)> = (0..PLACES * PLACES)
            .map(|cell| {
                let mut jittered = |cell: u32| (f64::from(cell) + random.uniform()) / f64::from(PLACES);
                (texel.point(jittered(cell % PLACES), jittered(cell / PLACES)), texel.normal)
            })
            .collect();
        if !places.iter().all(|&(place, normal)| is_open(&tracer, place, normal)) {
            continue;
        }
        // What paths and places differ by is the error of their mean; less, as places are spread evenly.
        let traced = tracer.at(&places, EFFORT, random.next());
        let count = traced.len() as f64;
        let mean = traced.iter().map(|place| place.value).sum::<DVec3>() / count;
        // Where no light comes there is nothing to be wrong about.
        if mean == DVec3::ZERO && texel.value == DVec3::ZERO {
            continue;
        }
        let squares: f64 = traced.iter().map(|place| (place.value - mean).length_squared() / 3.0).sum();
        let noise = (squares / (count * (count - 1.0))).sqrt();
        let apart = (texel.value - mean).length() / 3f64.sqrt();
        found[0] += 1.0;
        let times = apart / texel.stated.hypot(noise);
        if times > 2.0 {
            let [value, truth] = [texel.value, mean].map(|light| light.element_sum() / 3.0);
            misses.push((times, format!(
                "  {times:5.1} times: {} at {:.2}: {value:.4} for {truth:.4}, stated {:.4}, traced to {noise:.4}",
                texel.object, texel.point(0.5, 0.5), texel.stated
            )));
        }
        for (within, factor) in found[1..].iter_mut().zip([1.0, 0.5]) {
            *within += f64::from(u8::from(apart <= 2.0 * (factor * texel.stated).hypot(noise)));
        }
    }
    let [count, within, halved] = found;
    // Of fewer a share has a standard error too large to tell 93 from 95 %.
    assert!(count > 0.8 * TEXELS as f64, "{name}: {count} texels are too few");
    let [within, halved] = [within, halved].map(|texels| 100.0 * texels / count);
    println!("{name}: {within:.1} % of {count} texels within twice theirs ({halved:.1} % if halved)");
    misses.sort_by(|a, b| b.0.total_cmp(&a.0));
    misses.iter().take(MISSES).for_each(|(_, miss)| println!("{miss}"));
    found
}

#[test]
#[ignore = "slow: scripts/test --all runs it"]
fn of_scenes_that_no_constant_was_chosen_on() {
    let scenes = [
        ("rooms_41", 6.0),
        ("rooms_57", 6.0),
        ("hall_41", 4.0),
        ("hall_57", 4.0),
        ("cellar_41", 6.0),
        ("sunlit_room_41", 6.0),
        ("corridor_41", 6.0),
        ("grille_41", 6.0),
    ];
    let mut sums = [0.0; 3];
    for (name, density) in scenes {
        let found = judged(name, density);
        // One standard error of a share of so many texels is 1 %.
        assert!(found[1] / found[0] > 0.93, "{name}: {found:?}");
        sums.iter_mut().zip(found).for_each(|(sum, found)| *sum += found);
    }
    let [count, within, halved] = sums;
    assert!(within >= 0.95 * count, "{within} of {count}");
    assert!(
        halved < 0.95 * count,
        "half the stated errors would have passed, so that this tells nothing: {halved}"
    );
}
