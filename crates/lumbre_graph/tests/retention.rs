//! Leaving out unchanged passes must not change results. Random graphs run over several frames twice, with numbers
//! in place of texels: once with fingerprints, so that passes may be left out, and once without. The sinks must see
//! the same numbers in both. Needs no GPU.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};

use lumbre_graph::wgpu::{Color, TextureFormat};
use lumbre_graph::*;
use proptest::prelude::*;

const LAYERS: u32 = 2;
const RESOURCES: usize = 4;

#[derive(Clone, Debug)]
enum Write {
    /// One layer, as an attachment, which is cleared, or (if true) only cleared if it is the first write.
    Layer(u32, bool),
    /// All layers, as a storage texture.
    All,
}

#[derive(Clone, Debug)]
struct RandomPass {
    reads: Vec<usize>,
    target: usize,
    write: Write,
}

/// For each pass its fingerprint, and whether the scene has what it requires.
type RandomFrame = Vec<(u64, bool)>;

fn random() -> impl Strategy<Value = (Vec<bool>, Vec<RandomPass>, Vec<RandomFrame>)> {
    let write = prop_oneof![
        3 => (0..LAYERS, any::<bool>()).prop_map(|(layer, keep)| Write::Layer(layer, keep)),
        1 => Just(Write::All),
    ];
    let pass = (prop::collection::vec(0..RESOURCES, 0..2), 0..RESOURCES, write)
        .prop_map(|(reads, target, write)| RandomPass { reads, target, write });
    let retained = prop::collection::vec(prop::bool::weighted(0.7), RESOURCES);
    (retained, prop::collection::vec(pass, 1..7)).prop_flat_map(|(retained, passes)| {
        let frame = prop::collection::vec((0..2_u64, prop::bool::weighted(0.85)), passes.len());
        (Just(retained), Just(passes), prop::collection::vec(frame, 2..6))
    })
}

/// Runs frames on numbers in place of texels.
#[derive(Default)]
struct Machine {
    fingerprints: bool,
    history: History,
    /// The content of each layer of each resource.
    memory: HashMap<(usize, u32), u64>,
    /// Number of passes run so far.
    ran: u64,
    left_out: u64,
}

fn number(parts: impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    parts.hash(&mut hasher);
    hasher.finish()
}

impl Machine {
    /// Returns what the sink of each resource sees in this frame.
    fn frame(&mut self, retained: &[bool], passes: &[RandomPass], frame: &RandomFrame) -> Vec<Vec<u64>> {
        let mut graph = Graph::new("random");
        let shape = TextureDescriptor::new_2d(8, 8, TextureFormat::Rgba16Float).layers(LAYERS);
        let mut handles: Vec<TextureHandle> = (0..RESOURCES)
            .map(|index| match retained[index] {
                true => graph.retained_texture(format!("resource {index}"), shape),
                false => graph.texture(format!("resource {index}"), shape),
            })
            .collect();
        // Passes only read what was written earlier in this frame, as a fingerprint does not cover what last frame
        // left.
        let mut readable: Vec<Vec<usize>> = Vec::new();
        for (index, (pass, &(fingerprint, there))) in passes.iter().zip(frame).enumerate() {
            let name = format!("pass {index}");
            let reads: Vec<usize> = pass
                .reads
                .iter()
                .copied()
                .filter(|&read| read != pass.target && handles[read].version() > 0)
                .collect();
            match pass.write {
                Write::Layer(layer, keep) => {
                    let load =
                        if keep { LoadOp::ClearIfFirst(Color::BLACK) } else { LoadOp::Clear(Color::BLACK) };
                    let mut builder = graph.raster_pass(name).requires(there, "luck");
                    if self.fingerprints {
                        builder = builder.fingerprint(fingerprint);
                    }
                    for &read in &reads {
                        builder = builder.reads_optional(&handles[read], TextureRead::Sampled);
                    }
                    builder.color(&mut handles[pass.target], load).part(Part::layer(layer));
                }
                Write::All => {
                    let mut builder = graph.compute_pass(name).requires(there, "luck");
                    if self.fingerprints {
                        builder = builder.fingerprint(fingerprint);
                    }
                    for &read in &reads {
                        builder = builder.reads_optional(&handles[read], TextureRead::Sampled);
                    }
                    builder.writes(&mut handles[pass.target], TextureWrite::Storage);
                }
            }
            readable.push(reads);
        }
        for (index, handle) in handles.iter().enumerate() {
            let sink = graph.compute_pass(format!("sink {index}")).side_effect("looks");
            sink.reads_optional(handle, TextureRead::Sampled);
        }
        let plan =
            graph.compile_with(&self.history, CompileOptions::default()).expect("valid by construction");
        self.history = plan.history().clone();
        self.memory.retain(|(resource, _), _| retained[*resource]);

        let mut seen = vec![Vec::new(); RESOURCES];
        let running: Vec<String> = plan.running().map(str::to_owned).collect();
        for index in 0..passes.len() {
            let word = plan.status(&format!("pass {index}")).expect("declared").word();
            self.left_out += u64::from(word == "unchanged");
        }
        let wrote_before = |index: usize, layer: u32| {
            (0..index).any(|earlier| {
                let pass = &passes[earlier];
                let touches = match pass.write {
                    Write::Layer(held, _) => held == layer,
                    Write::All => true,
                };
                frame[earlier].1 && pass.target == passes[index].target && touches
            })
        };
        // Content that no pass wrote is undefined; it counts as 0 in both machines.
        let look = |memory: &HashMap<(usize, u32), u64>, resource: usize| -> Vec<u64> {
            (0..LAYERS).map(|layer| memory.get(&(resource, layer)).copied().unwrap_or(0)).collect()
        };
        for name in running {
            if let Some(index) = name.strip_prefix("sink ") {
                let index: usize = index.parse().expect("a number");
                seen[index] = look(&self.memory, index);
                continue;
            }
            let index: usize =
                name.strip_prefix("pass ").and_then(|index| index.parse().ok()).expect("a number");
            let pass = &passes[index];
            self.ran += 1;
            let reads: Vec<Vec<u64>> = readable[index].iter().map(|&read| look(&self.memory, read)).collect();
            let layers = match pass.write {
                Write::Layer(layer, _) => layer..layer + 1,
                Write::All => 0..LAYERS,
            };
            for layer in layers {
                let keeps = !matches!(pass.write, Write::Layer(_, false)) && wrote_before(index, layer);
                let below = keeps.then(|| self.memory.get(&(pass.target, layer)).copied());
                self.memory.insert((pass.target, layer), number((index, frame[index].0, &reads, below)));
            }
        }
        seen
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 3000,
        rng_seed: prop::test_runner::RngSeed::Fixed(21),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn leaving_out_is_not_seen((retained, passes, frames) in random()) {
        let mut leaving = Machine { fingerprints: true, ..Machine::default() };
        let mut running = Machine::default();
        for (index, frame) in frames.iter().enumerate() {
            let seen = leaving.frame(&retained, &passes, frame);
            let expected = running.frame(&retained, &passes, frame);
            prop_assert_eq!(seen, expected, "frame {}", index);
        }
        prop_assert_eq!(running.left_out, 0, "without a fingerprint nothing is known to be unchanged");
        prop_assert!(leaving.ran <= running.ran);
    }
}

#[test]
fn something_is_left_out() {
    let passes = vec![RandomPass { reads: vec![], target: 0, write: Write::Layer(0, true) }];
    let mut machine = Machine { fingerprints: true, ..Machine::default() };
    let first = machine.frame(&[true; RESOURCES], &passes, &vec![(1, true)]);
    assert_eq!(machine.frame(&[true; RESOURCES], &passes, &vec![(1, true)]), first);
    assert_eq!((machine.ran, machine.left_out), (1, 1));
}
