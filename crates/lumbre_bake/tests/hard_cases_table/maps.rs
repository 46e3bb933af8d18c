//! Cases about texture coordinates that are unusable for a lightmap, borders of charts, interrupted bakes, and
//! malformed files.

use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use bevy_ecs::world::World;
use glam::{DVec3, Vec2, Vec3};
use lumbre_bake::{Bake, BakeOptions, BakeReport, Checkpoint};
use lumbre_mesh::{TriangleMesh, shapes};
use lumbre_scene::{Lightmap, Mesh, StaticObject, save};
use serde_json::{Value, json};

use crate::case::Outcome;
use crate::common;
use crate::common::shapes::square;
use crate::corner::corner;
use crate::gltf_files::{File, container, load_bytes};
use crate::scenes::{draft, grey, irradiance, run, spawn, warning, zenith};

crate::cases! {
    "overlapping or out-of-range UVs; texels with no coverage; charts under a texel" {
        overlapping_coordinates_are_named, coordinates_out_of_range_are_named, light_on_overlapping_coordinates,
        light_on_coordinates_out_of_range, gap_of_two, gap_of_four, the_very_border_of_a_chart,
    }
    "kill -9 in the middle, disk full, no permission, an output that exists" {
        bits_after_an_interruption, nothing_of_an_interrupted_bake_is_in_the_world, a_checkpoint_that_is_something_else,
        a_folder_that_is_not_there, an_output_that_exists_is_replaced_whole, nothing_else_is_left_beside_it,
    }
    "malformed glTF" {
        truncated, wrong_magic, index_out_of_range, cyclic_nodes, a_count_of_two_to_the_31, missing_buffer, an_accessor_that_is_not_a_number,
        required_extension_unknown, no_mutant_is_taken_for_a_level,
    }
}

/// Bakes a floor of two triangles with the given lightmap coordinates.
fn floor_with(uv1: [[f32; 2]; 4]) -> (World, BakeReport) {
    let mesh = TriangleMesh { uv1: uv1.map(Vec2::from).to_vec(), ..square(2.0, 0.0, true) };
    let mut world = World::new();
    spawn(&mut world, "rug", mesh, grey(0.5, 0.0));
    zenith(&mut world);
    let report = run(&mut world, &draft(32));
    (world, report)
}

/// Folded along the diagonal: both triangles cover the same texels.
const FOLDED: [[f32; 2]; 4] = [[0.1, 0.1], [0.9, 0.1], [0.9, 0.9], [0.9, 0.1]];
const TILED: [[f32; 2]; 4] = [[0.0, 0.0], [3.0, 0.0], [3.0, 3.0], [0.0, 3.0]];

fn overlapping_coordinates_are_named() -> Outcome {
    Outcome::text("rug: its TEXCOORD_1 cannot hold a lightmap", warning(&floor_with(FOLDED).1, "overlapping"))
}

fn coordinates_out_of_range_are_named() -> Outcome {
    Outcome::text(
        "rug: its TEXCOORD_1 cannot hold a lightmap",
        warning(&floor_with(TILED).1, "2 triangles out of range"),
    )
}

const WHY_UNWRAPPED: &str = "E of the sun at the zenith, to the very edge: it was unwrapped anew; f32";

fn light_on(uv1: [[f32; 2]; 4]) -> Outcome {
    let points =
        (0..121).map(|i| DVec3::new(f64::from(i % 11) * 0.2 - 1.0, 0.0, f64::from(i / 11) * 0.2 - 1.0));
    let measured = irradiance(&mut floor_with(uv1).0, DVec3::Y, points);
    Outcome::worst(measured.into_iter().map(|e| (1.0, e)), 1e-5, WHY_UNWRAPPED)
}

fn light_on_overlapping_coordinates() -> Outcome {
    light_on(FOLDED)
}

fn light_on_coordinates_out_of_range() -> Outcome {
    light_on(TILED)
}

/// Checks the smallest number of texels between two charts of a box's map.
fn gap(requested: u32) -> Outcome {
    let mut world = World::new();
    let entity = spawn(&mut world, "box", shapes::cuboid(Vec3::new(1.0, 0.7, 0.4), 1), grey(0.5, 0.0));
    zenith(&mut world);
    run(&mut world, &BakeOptions { gap: requested, ..draft(64) });
    let mesh = &world.get::<Mesh>(entity).expect("it was baked").0;
    let side = f64::from(world.get::<Lightmap>(entity).expect("it was baked").image.width);
    // Each face of a box consists of two triangles and is a rectangle in the map.
    let corners: Vec<_> =
        mesh.triangles().flat_map(|t| t.map(|v| mesh.uv1[v as usize].as_dvec2() * side)).collect();
    let charts: Vec<_> = corners
        .chunks_exact(6)
        .map(|face| face.iter().fold((face[0], face[0]), |(low, high), &p| (low.min(p), high.max(p))))
        .collect();
    let texels_between = |a: &(glam::DVec2, glam::DVec2), b: &(glam::DVec2, glam::DVec2)| {
        // Rounding outwards excludes the texels that either chart touches.
        let between = (b.0.floor() - a.1.ceil()).max(a.0.floor() - b.1.ceil());
        between.max_element()
    };
    let pairs = (0..charts.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
    let least = pairs.map(|(i, j)| texels_between(&charts[i], &charts[j])).fold(f64::INFINITY, f64::min);
    let why = "texels that no chart touches between the two nearest of a box's six, at least; more is counted as this";
    Outcome::number(f64::from(requested), least.min(f64::from(requested)), 0.0, why)
}

fn gap_of_two() -> Outcome {
    gap(2)
}

fn gap_of_four() -> Outcome {
    gap(4)
}

fn the_very_border_of_a_chart() -> Outcome {
    let mut world = World::new();
    spawn(&mut world, "box", shapes::cuboid(Vec3::new(1.0, 0.7, 0.4), 1), grey(0.0, 0.0));
    zenith(&mut world);
    run(&mut world, &draft(32));
    let rim = (0..200).map(|i| {
        let along = f64::from(i % 50) / 24.5 - 1.0;
        let [x, z] = [[1.0, along], [-1.0, along], [along, 1.0], [along, -1.0]][i as usize / 50];
        DVec3::new(0.5 * x, 0.35, 0.2 * z)
    });
    let measured = irradiance(&mut world, DVec3::Y, rim);
    let why = "the lid's rim in the sun beside black sides: every texel it touches is covered, and the gap continues it; f32";
    Outcome::worst(measured.into_iter().map(|e| (1.0, e)), 1e-5, why)
}

fn quick_options() -> BakeOptions {
    BakeOptions { error: 0.02, ..draft(24) }
}

/// Writes a checkpoint as often as possible and interrupts the bake three times, each time at a larger fraction.
fn bits_after_an_interruption() -> Outcome {
    let folder = tempfile::tempdir().expect("there is room for it");
    let path = folder.path().join("checkpoint");
    let checkpoint = |resume| Checkpoint { interval: Duration::ZERO, ..Checkpoint::new(&path, resume) };
    for stop in [0.2, 0.5, 0.9] {
        let stopped = Bake::new(&quick_options())
            .checkpoint(&checkpoint(stop > 0.2))
            .progress(|progress| {
                if progress.fraction >= stop { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            })
            .run(&mut corner());
        assert!(stopped.is_err(), "it was to be interrupted at {stop}");
    }
    let (mut resumed, mut whole) = (corner(), corner());
    Bake::new(&quick_options()).checkpoint(&checkpoint(true)).run(&mut resumed).expect("the bake resumes");
    run(&mut whole, &quick_options());
    let why = "texels that differ in a bit from those of a bake that was never stopped; this one three times";
    Outcome::number(0.0, crate::scenes::differing_values(&mut resumed, &mut whole), 0.0, why)
}

fn nothing_of_an_interrupted_bake_is_in_the_world() -> Outcome {
    let mut world = corner();
    let stopped =
        Bake::new(&quick_options())
            .progress(|progress| {
                if progress.fraction >= 0.7 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            })
            .run(&mut world);
    assert!(stopped.is_err());
    let touched = world.query::<&Mesh>().iter(&world).filter(|mesh| !mesh.0.uv1.is_empty()).count();
    Outcome::number(
        0.0,
        (common::maps(&mut world).len() + touched) as f64,
        0.0,
        "maps and meshes that it changed",
    )
}

fn a_checkpoint_that_is_something_else() -> Outcome {
    let folder = tempfile::tempdir().expect("there is room for it");
    let path = folder.path().join("diary");
    fs::write(&path, "mine").expect("the folder takes it");
    let result = Bake::new(&quick_options()).checkpoint(&Checkpoint::new(&path, true)).run(&mut corner());
    assert_eq!(fs::read(&path).expect("it is there"), b"mine");
    let error = result.expect_err("it has to be refused").to_string();
    Outcome::text(
        "diary: the file is no checkpoint of Lumbre; move it away",
        error[error.find("diary").unwrap_or(0)..].to_owned(),
    )
}

/// A baked level that consists of a floor.
fn level() -> World {
    let mut world = World::new();
    world.spawn((Mesh(Arc::new(square(2.0, 0.0, true))), grey(0.5, 0.0), StaticObject));
    zenith(&mut world);
    run(&mut world, &draft(16));
    world
}

fn a_folder_that_is_not_there() -> Outcome {
    let error = save(&mut level(), Path::new("no such folder/level.glb")).expect_err("it has to be refused");
    Outcome::text("no such folder", error.to_string())
}

/// Saves a level twice, the second time over a longer file. Returns the bytes of both files, and how many files lie in
/// the folder that the report does not name.
fn saved_over() -> (Vec<u8>, Vec<u8>, usize) {
    let folder = tempfile::tempdir().expect("there is room for it");
    let path = folder.path().join("level.glb");
    save(&mut level(), &path).expect("the folder takes it");
    let first = fs::read(&path).expect("it is there");
    // The old file is longer than its replacement.
    fs::write(&path, [first.clone(), vec![0; 4096]].concat()).expect("the folder takes it");
    let saved = save(&mut level(), &path).expect("the folder takes it");
    let count = |folder: &Path| fs::read_dir(folder).expect("the folder can be read").count();
    // One less for the folder of the lightmaps, which is not a file.
    let files = count(folder.path()) - 1 + count(&path.with_extension("lightmaps"));
    (first, fs::read(&path).expect("it is there"), files - saved.files.len())
}

fn an_output_that_exists_is_replaced_whole() -> Outcome {
    let (first, second, _) = saved_over();
    let differ =
        first.len().abs_diff(second.len()) + first.iter().zip(&second).filter(|(a, b)| a != b).count();
    Outcome::number(
        0.0,
        differ as f64,
        0.0,
        "bytes that differ from those in an empty folder: written beside it, then renamed",
    )
}

fn nothing_else_is_left_beside_it() -> Outcome {
    Outcome::number(0.0, saved_over().2 as f64, 0.0, "files in the folder that the report does not name")
}

/// The error message with which a file is refused.
fn refusal(bytes: &[u8]) -> String {
    match load_bytes(bytes) {
        Err(error) => error.to_string(),
        Ok(_) => "accepted".to_owned(),
    }
}

fn valid_file() -> File {
    let mut file = File::new();
    file.square(|_, _| {});
    file
}

/// The error message for the valid file with one value of its JSON refusal_with.
fn refusal_with(pointer: &str, value: Value) -> String {
    let mut file = valid_file();
    *file.root.pointer_mut(pointer).expect("it is there") = value;
    refusal(&file.glb())
}

fn truncated() -> Outcome {
    let whole = valid_file().glb();
    Outcome::text("the file is truncated", refusal(&whole[..whole.len() / 2]))
}

fn wrong_magic() -> Outcome {
    Outcome::text("GLTF", refusal(b"GLTF\x02\0\0\0"))
}

fn index_out_of_range() -> Outcome {
    let mut file = valid_file();
    file.root["meshes"][0]["primitives"][0]["indices"] = json!(file.indices(&[0, 1, 4]));
    Outcome::text("accessors[2]", refusal(&file.glb()))
}

fn cyclic_nodes() -> Outcome {
    let mut file = valid_file();
    file.push("nodes", json!({"name": "ring", "children": [2]}));
    file.push("nodes", json!({"children": [1]}));
    Outcome::text("nodes[1] (ring) is its own ancestor", refusal(&file.glb()))
}

fn a_count_of_two_to_the_31() -> Outcome {
    Outcome::text("accessors[0]", refusal_with("/accessors/0/count", json!(1u64 << 31)))
}

fn missing_buffer() -> Outcome {
    let mut file = valid_file();
    file.root["buffers"] = json!([{"byteLength": 4, "uri": "not there.bin"}]);
    Outcome::text("buffers[0]: the URI \"not there.bin\"", refusal(file.root.to_string().as_bytes()))
}

fn an_accessor_that_is_not_a_number() -> Outcome {
    let mut file = valid_file();
    let values = file.floats("VEC3", 3, &[f32::NAN; 12]);
    file.root["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(values);
    Outcome::text("accessors[2]", refusal(&file.glb()))
}

fn required_extension_unknown() -> Outcome {
    let mut file = valid_file();
    file.root["extensionsRequired"] = json!(["KHR_gaussian_splatting"]);
    Outcome::text("KHR_gaussian_splatting", refusal(&file.glb()))
}

fn no_mutant_is_taken_for_a_level() -> Outcome {
    // Every prefix of the container, and a container whose JSON is cut off, must be refused by an error.
    let whole = valid_file().glb();
    let mut refused = 0;
    for length in 0..whole.len() {
        refused += usize::from(load_bytes(&whole[..length]).is_err());
    }
    let cut_json = container(&valid_file().root.to_string().as_bytes()[..40], &[]);
    refused += usize::from(load_bytes(&cut_json).is_err());
    let why = "prefixes of a level that are refused by an error, of as many as it has; 30,000 mutants are in the other list";
    Outcome::number((whole.len() + 1) as f64, refused as f64, 0.0, why)
}
