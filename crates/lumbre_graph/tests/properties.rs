//! Properties of random graphs: order, culling and memory; and the cost of compiling. Needs no GPU.

use std::collections::HashMap;

use lumbre_graph::wgpu::{Color, TextureFormat};
use lumbre_graph::*;
use proptest::prelude::*;

/// One random pass: the resources that it reads and writes, and its other properties.
#[derive(Clone, Debug)]
struct RandomPass {
    reads: Vec<usize>,
    write: usize,
    load: bool,
    called_for: bool,
    side_effect: bool,
}

#[derive(Clone, Debug)]
struct RandomGraph {
    /// Which of three sizes each resource has.
    sizes: Vec<u32>,
    passes: Vec<RandomPass>,
    exported: Vec<bool>,
}

fn random_graph() -> impl Strategy<Value = RandomGraph> {
    (2..7_usize).prop_flat_map(|resources| {
        let pass = (
            prop::collection::vec(0..resources, 0..3),
            0..resources,
            any::<bool>(),
            prop::bool::weighted(0.8),
            prop::bool::weighted(0.15),
        )
            .prop_map(|(reads, write, load, called_for, side_effect)| RandomPass {
                reads,
                write,
                load,
                called_for,
                side_effect,
            });
        (
            prop::collection::vec(0..3_u32, resources),
            prop::collection::vec(pass, 1..14),
            prop::collection::vec(prop::bool::weighted(0.3), resources),
        )
            .prop_map(|(sizes, passes, exported)| RandomGraph { sizes, passes, exported })
    })
}

/// The resources and versions that a pass reads and writes.
#[derive(Clone, Debug, Default)]
struct Uses {
    reads: Vec<(usize, u32)>,
    /// Resource and version written, and whether the content of the version below is kept.
    write: Option<(usize, u32, bool)>,
    side_effect: bool,
    called_for: bool,
}

fn name(resource: usize) -> String {
    format!("resource {resource}")
}

/// Declares the graph, leaving out reads of resources that were not written so that it is valid, and returns a
/// record for checking the plan.
fn declare(random: &RandomGraph) -> (Graph<'static>, Vec<Uses>) {
    let mut graph = Graph::new("random");
    let mut handles: Vec<TextureHandle> = random
        .sizes
        .iter()
        .enumerate()
        .map(|(index, size)| {
            graph.texture(name(index), TextureDescriptor::new_2d(16 << size, 16, TextureFormat::Rgba16Float))
        })
        .collect();
    let mut uses = Vec::new();
    for (index, random) in random.passes.iter().enumerate() {
        let mut of_pass =
            Uses { side_effect: random.side_effect, called_for: random.called_for, ..Uses::default() };
        let mut pass = graph.raster_pass(format!("pass {index}")).requires(random.called_for, "luck");
        for &read in &random.reads {
            if read != random.write {
                pass = pass.reads_optional(&handles[read], TextureRead::Sampled);
                of_pass.reads.push((read, handles[read].version()));
            }
        }
        let load = if random.load { LoadOp::ClearIfFirst(Color::RED) } else { LoadOp::Clear(Color::RED) };
        pass = pass.color(&mut handles[random.write], load);
        of_pass.write = Some((random.write, handles[random.write].version(), random.load));
        if random.side_effect {
            pass.side_effect("luck");
        }
        uses.push(of_pass);
    }
    for (handle, &exported) in handles.iter().zip(&random.exported) {
        if exported {
            graph.export(handle);
        }
    }
    (graph, uses)
}

/// An independent computation of which passes run. It goes through all passes in order of declaration and tracks,
/// for each texture, the set of passes that contributed to its content; a pass is needed if it contributed to
/// anything that is exported or has a side effect.
fn needed(random: &RandomGraph, uses: &[Uses]) -> Vec<bool> {
    let mut held: HashMap<(usize, u32), Vec<usize>> = HashMap::new();
    let mut last: Vec<u32> = vec![0; random.sizes.len()];
    let mut needed = vec![false; uses.len()];
    for (index, pass) in uses.iter().enumerate() {
        let (resource, version, keeps) = pass.write.expect("every random pass writes");
        let below = held.get(&(resource, version - 1)).cloned().unwrap_or_default();
        last[resource] = version;
        if !pass.called_for {
            held.insert((resource, version), below);
            continue;
        }
        let mut hands = vec![index];
        for &(read, version) in &pass.reads {
            hands.extend(held.get(&(read, version)).cloned().unwrap_or_default());
        }
        if keeps {
            hands.extend(below);
        }
        if pass.side_effect {
            hands.iter().for_each(|&hand| needed[hand] = true);
        }
        held.insert((resource, version), hands);
    }
    for (resource, &exported) in random.exported.iter().enumerate() {
        if exported {
            let hands = held.get(&(resource, last[resource])).cloned().unwrap_or_default();
            hands.into_iter().for_each(|hand| needed[hand] = true);
        }
    }
    needed
}

proptest! {
    // The seed is fixed so that a run can be repeated.
    #![proptest_config(ProptestConfig {
        cases: 2000,
        rng_seed: prop::test_runner::RngSeed::Fixed(20),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn runs_exactly_what_is_needed(random in random_graph()) {
        let (graph, uses) = declare(&random);
        let plan = graph.compile().expect("valid by construction");
        let runs: Vec<bool> = (0..uses.len())
            .map(|index| plan.status(&format!("pass {index}")).expect("declared").runs())
            .collect();
        prop_assert_eq!(runs, needed(&random, &uses));
    }

    #[test]
    fn order_respects_every_dependency(random in random_graph()) {
        let (graph, uses) = declare(&random);
        let plan = graph.compile().expect("valid by construction");
        let at: HashMap<&str, usize> = plan.running().enumerate().map(|(at, name)| (name, at)).collect();
        let position = |index: usize| at.get(format!("pass {index}").as_str()).copied();
        for (reader, pass) in uses.iter().enumerate() {
            let Some(reader_at) = position(reader) else { continue };
            for (writer, other) in uses.iter().enumerate() {
                let (Some(writer_at), Some((resource, written, _))) = (position(writer), other.write) else {
                    continue;
                };
                for &(read, version) in &pass.reads {
                    if read == resource {
                        prop_assert_eq!(written <= version, writer_at < reader_at, "{} {}", writer, reader);
                    }
                }
                if let Some((upon, version, _)) = pass.write && upon == resource && writer != reader {
                    prop_assert_eq!(written < version, writer_at < reader_at);
                }
            }
        }
    }

    #[test]
    fn shared_memory_is_never_shared_at_once(random in random_graph()) {
        let (graph, uses) = declare(&random);
        let plan = graph.compile().expect("valid by construction");
        let group_of: HashMap<String, usize> = plan
            .groups()
            .enumerate()
            .flat_map(|(group, passes)| {
                passes.into_iter().map(move |pass| (pass.to_owned(), group)).collect::<Vec<_>>()
            })
            .collect();
        // Every use is within its resource's lifetime.
        for (index, pass) in uses.iter().enumerate() {
            let Some(&group) = group_of.get(&format!("pass {index}")) else { continue };
            let (resource, ..) = pass.write.expect("every random pass writes");
            let [first, last] = plan.lifetime(&name(resource)).expect("it is written");
            prop_assert!(first <= group && group <= last);
            prop_assert!(plan.slot(&name(resource)).is_some());
        }
        // Two lifetimes in one slot do not overlap, and their resources have the same size.
        for a in 0..random.sizes.len() {
            for b in 0..a {
                let (Some(slot_a), Some(slot_b)) = (plan.slot(&name(a)), plan.slot(&name(b))) else { continue };
                if slot_a == slot_b {
                    let [first_a, last_a] = plan.lifetime(&name(a)).expect("it has a slot");
                    let [first_b, last_b] = plan.lifetime(&name(b)).expect("it has a slot");
                    prop_assert!(last_a < first_b || last_b < first_a);
                    prop_assert_eq!(random.sizes[a], random.sizes[b]);
                }
            }
        }
        let memory = plan.memory();
        prop_assert!(memory.peak_bytes <= memory.pool_bytes && memory.pool_bytes <= memory.unshared_bytes);
    }

    #[test]
    fn merging_changes_neither_what_runs_nor_its_order(random in random_graph()) {
        let (graph, _) = declare(&random);
        let merged = graph.compile().expect("valid by construction");
        let options = CompileOptions { merge: false, ..CompileOptions::default() };
        let apart = graph.compile_with(&History::default(), options).expect("valid by construction");
        prop_assert_eq!(merged.running().collect::<Vec<_>>(), apart.running().collect::<Vec<_>>());
        prop_assert_eq!(apart.groups().count(), apart.running().count());
    }

    #[test]
    fn compiling_and_explaining_is_deterministic(random in random_graph()) {
        let plans: Vec<Plan> = (0..2).map(|_| declare(&random).0.compile().expect("valid")).collect();
        prop_assert_eq!(plans[0].explain(), plans[1].explain());
        prop_assert_eq!(plans[0].explain().to_dot(), plans[1].explain().to_dot());
    }
}

#[test]
fn a_chain_of_filters_takes_turns_in_two_slots() {
    let mut graph = Graph::new("chain");
    let shape = TextureDescriptor::new_2d(100, 50, TextureFormat::Rgba16Float);
    let mut before: Option<TextureHandle> = None;
    for index in 0..10 {
        let mut target = graph.texture(format!("step {index}"), shape);
        let mut pass = graph.raster_pass(format!("filter {index}"));
        if let Some(before) = &before {
            pass = pass.samples(before);
        }
        pass.color(&mut target, LoadOp::Clear(Color::BLACK));
        before = Some(target);
    }
    graph.export(&before.expect("ten were made"));
    let plan = graph.compile().expect("valid");
    let one = 100 * 50 * 8;
    let expected =
        Memory { peak_bytes: 2 * one, pool_bytes: 2 * one, unshared_bytes: 10 * one, retained_bytes: 0 };
    assert_eq!(plan.memory(), expected);
}

/// A frame of ten passes like those of the renderer.
fn ten_passes() -> Graph<'static> {
    let mut graph = Graph::new("frame");
    let shape = TextureDescriptor::new_2d(1280, 720, TextureFormat::Rgba16Float);
    let mut color = graph.texture("color", shape.samples(4));
    let mut resolved = graph.texture("resolved", shape);
    let depth = TextureDescriptor::new_2d(1280, 720, TextureFormat::Depth32Float).samples(4);
    let mut depth = graph.texture("depth", depth);
    let mut screen = graph.import_texture("screen", shape);
    let lights = graph.import_buffer("lights", BufferDescriptor::new(4096));
    for name in ["background", "lightmap", "flat", "gouraud", "phong", "transparent"] {
        graph
            .raster_pass(name)
            .requires(true, "a mesh")
            .reads(&lights, BufferRead::Storage)
            .color(&mut color, LoadOp::ClearIfFirst(Color::BLACK))
            .resolve(&mut resolved)
            .depth(&mut depth, LoadOp::ClearIfFirst(0.0));
    }
    let mut before = resolved;
    for name in ["fog", "bloom", "grade"] {
        let mut after = graph.texture(name, shape);
        graph.raster_pass(name).samples(&before).color(&mut after, LoadOp::Clear(Color::BLACK));
        before = after;
    }
    graph.raster_pass("tone map").samples(&before).color(&mut screen, LoadOp::Clear(Color::BLACK));
    graph
}

/// Prints the cost of ten passes (the aim is 50 microseconds in a release build); times are never asserted.
#[test]
fn ten_passes_compile_and_six_of_them_merge() {
    // The best of many runs, as the machine may be busy meanwhile.
    let best = |work: &dyn Fn()| {
        (0..200)
            .map(|_| {
                let start = std::time::Instant::now();
                work();
                start.elapsed()
            })
            .min()
            .expect("there are 200")
    };
    let declare = best(&|| drop(ten_passes()));
    let both = best(&|| drop(ten_passes().compile().expect("valid")));
    eprintln!("ten passes: declare {declare:?}, declare and compile {both:?}");
    let plan = ten_passes().compile().expect("valid");
    assert_eq!(plan.running().count(), 10);
    // The six passes that draw into the same attachments are one wgpu pass.
    assert_eq!(plan.groups().next().map(|group| group.len()), Some(6));
}
