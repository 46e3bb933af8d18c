//! Checks that each fault of a declaration has its own error, which names the pass, the resource and both
//! declarations. Needs no GPU.

use lumbre_graph::wgpu::{Color, TextureFormat, TextureUsages};
use lumbre_graph::*;

const BLACK: LoadOp<Color> = LoadOp::Clear(Color::BLACK);

fn hdr() -> TextureDescriptor {
    TextureDescriptor::new_2d(64, 32, TextureFormat::Rgba16Float)
}

/// Returns the error, as text, of a graph that `build` declares, after checking its variant.
fn fault(build: impl FnOnce(&mut Graph<'_>), is: impl FnOnce(&GraphError) -> bool) -> String {
    let mut graph = Graph::new("test");
    build(&mut graph);
    let error = graph.compile().expect_err("the graph has a fault");
    assert!(is(&error), "another error: {error:?}");
    error.to_string()
}

fn says(text: &str, words: &[&str]) {
    for word in words {
        assert!(text.contains(word), "`{word}` is not in: {text}");
    }
}

#[test]
fn missing_producer() {
    let text = fault(
        |graph| {
            let depth = graph.texture("depth", hdr());
            graph.compute_pass("fog").samples(&depth).side_effect("test");
        },
        |error| matches!(error, GraphError::MissingProducer { .. }),
    );
    says(&text, &["`fog`", "`depth`", "sampled texture", "tests/errors.rs"]);
}

#[test]
fn a_load_of_what_nobody_wrote_is_a_missing_producer_too() {
    let text = fault(
        |graph| {
            let mut target = graph.texture("target", hdr());
            graph.raster_pass("draw").color(&mut target, LoadOp::Load).side_effect("test");
        },
        |error| matches!(error, GraphError::MissingProducer { .. }),
    );
    says(&text, &["`draw`", "`target`", "(load)"]);
}

#[test]
fn read_before_write() {
    let text = fault(
        |graph| {
            let mut target = graph.texture("target", hdr());
            let early = target;
            graph.raster_pass("draw").color(&mut target, BLACK);
            graph.compute_pass("blur").samples(&early).side_effect("test");
        },
        |error| matches!(error, GraphError::ReadBeforeWrite { .. }),
    );
    says(&text, &["`blur`", "`target`", "`draw`"]);
    assert_eq!(text.matches("tests/errors.rs").count(), 2, "both declarations: {text}");
}

#[test]
fn two_writers_of_one_version() {
    let text = fault(
        |graph| {
            let mut target = graph.texture("target", hdr());
            let mut stale = target;
            graph.raster_pass("first").color(&mut target, BLACK);
            graph.raster_pass("second").color(&mut stale, BLACK);
        },
        |error| matches!(error, GraphError::TwoWriters { version: 0, .. }),
    );
    says(&text, &["`first`", "`second`", "`target`", "version 0"]);
    assert_eq!(text.matches("tests/errors.rs").count(), 2, "both declarations: {text}");
}

#[test]
fn handle_of_another_graph() {
    let mut other = Graph::new("other");
    let mut foreign = other.texture("target", hdr());
    let before = foreign;
    let text = fault(
        |graph| graph.raster_pass("draw").color(&mut foreign, BLACK).run(|_| Ok(())),
        |error| matches!(error, GraphError::ForeignHandle { .. }),
    );
    says(&text, &["`draw`", "texture handle"]);
    assert_eq!(foreign, before, "a refused write does not move the handle");
    let text =
        fault(|graph| graph.export(&foreign), |error| matches!(error, GraphError::ForeignHandle { .. }));
    says(&text, &["(export)"]);
}

#[test]
fn duplicate_names() {
    let text = fault(
        |graph| {
            graph.texture("target", hdr());
            graph.buffer("target", BufferDescriptor::new(16));
        },
        |error| matches!(error, GraphError::DuplicateName { kind: "resources", .. }),
    );
    says(&text, &["`target`"]);
    assert_eq!(text.matches("tests/errors.rs").count(), 2, "both declarations: {text}");
    let text = fault(
        |graph| {
            graph.compute_pass("blur");
            graph.compute_pass("blur");
        },
        |error| matches!(error, GraphError::DuplicateName { kind: "passes", .. }),
    );
    says(&text, &["`blur`"]);
}

#[test]
fn misspelt_pass_gives_the_nearest() {
    let text = fault(
        |graph| {
            graph.compute_pass("forward");
            graph.compute_pass("fog").after("foward");
        },
        |error| matches!(error, GraphError::UnknownPass { .. }),
    );
    says(&text, &["`fog`", "`foward`", "did you mean `forward`?"]);
    let text = fault(
        |graph| {
            graph.compute_pass("fog").after("tone map");
        },
        |error| matches!(error, GraphError::UnknownPass { nearest: None, .. }),
    );
    assert!(!text.contains("did you mean"), "{text}");
}

#[test]
fn cycle_is_a_path() {
    let text = fault(
        |graph| {
            let mut a = graph.texture("a", hdr());
            let mut b = graph.texture("b", hdr());
            graph.compute_pass("outside").side_effect("test");
            graph.raster_pass("draw a").color(&mut a, BLACK).after("use b");
            graph.raster_pass("draw b").samples(&a).color(&mut b, BLACK);
            graph.compute_pass("use b").samples(&b).side_effect("test");
            graph.compute_pass("behind").after("use b").side_effect("test");
        },
        |error| {
            let GraphError::Cycle { path } = error else { return false };
            path.len() == 3
        },
    );
    says(&text, &["`draw a` -(", "`draw b` -(", "`use b` -(named by .after() of", "of `a`, read by"]);
    assert!(!text.contains("outside") && !text.contains("behind"), "only the circle: {text}");
}

#[test]
fn a_pass_after_itself_is_a_cycle() {
    let text = fault(
        |graph| {
            graph.compute_pass("blur").after("blur");
        },
        |error| matches!(error, GraphError::Cycle { path } if path.len() == 1),
    );
    says(&text, &["`blur` -(", "-> `blur`"]);
}

#[test]
fn a_stale_reader_of_its_own_overwriter_is_a_cycle() {
    let text = fault(
        |graph| {
            let mut a = graph.texture("a", hdr());
            let mut b = graph.texture("b", hdr());
            graph.raster_pass("one").color(&mut a, BLACK);
            let old = a;
            graph.raster_pass("two").color(&mut a, LoadOp::Load).color(&mut b, BLACK);
            graph.compute_pass("late").samples(&old).samples(&b).side_effect("test");
        },
        |error| matches!(error, GraphError::Cycle { path } if path.len() == 2),
    );
    says(&text, &["`late` -(reads version 1 of `a`, overwritten by)", "`two`"]);
}

#[test]
fn producers_skipped() {
    let text = fault(
        |graph| {
            let mut mirror = graph.texture("mirror", hdr());
            graph.raster_pass("draw mirror").requires(false, "a mirror").color(&mut mirror, BLACK);
            graph.compute_pass("blur").samples(&mirror).side_effect("test");
        },
        |error| matches!(error, GraphError::ProducersSkipped { .. }),
    );
    says(&text, &["`blur`", "`mirror`", "`draw mirror`: the scene has no mirror"]);
}

#[test]
fn format_mismatch() {
    let text = fault(
        |graph| {
            let mut depth =
                graph.texture("depth", TextureDescriptor::new_2d(8, 8, TextureFormat::Depth32Float));
            graph.raster_pass("draw").color(&mut depth, BLACK);
        },
        |error| matches!(error, GraphError::FormatMismatch { .. }),
    );
    says(&text, &["`draw`", "`depth`", "Depth32Float", "colour format"]);
    let text = fault(
        |graph| {
            let mut color = graph.texture("color", hdr());
            graph.raster_pass("draw").depth(&mut color, LoadOp::Clear(0.0));
        },
        |error| matches!(error, GraphError::FormatMismatch { .. }),
    );
    says(&text, &["Rgba16Float", "depth format"]);
    let text = fault(
        |graph| {
            let mut many = graph.texture("many", hdr().samples(4));
            let mut one = graph.texture("one", TextureDescriptor::new_2d(64, 32, TextureFormat::Rgba8Unorm));
            graph.raster_pass("draw").color(&mut many, BLACK).resolve(&mut one);
        },
        |error| matches!(error, GraphError::FormatMismatch { .. }),
    );
    says(&text, &["`one`", "`many`", "Rgba8Unorm", "Rgba16Float"]);
}

#[test]
fn size_mismatch() {
    let text = fault(
        |graph| {
            let mut color = graph.texture("color", hdr());
            let mut depth =
                graph.texture("depth", TextureDescriptor::new_2d(64, 64, TextureFormat::Depth32Float));
            graph.raster_pass("draw").color(&mut color, BLACK).depth(&mut depth, LoadOp::Clear(0.0));
        },
        |error| matches!(error, GraphError::SizeMismatch { .. }),
    );
    says(&text, &["`draw`", "`color`", "64x32", "`depth`", "64x64"]);
}

#[test]
fn mip_level_counts_for_the_size() {
    let mut graph = Graph::new("test");
    let mut chain = graph.texture("chain", hdr().mips(3));
    let mut half = graph.texture("half", TextureDescriptor::new_2d(32, 16, TextureFormat::Rgba16Float));
    graph
        .raster_pass("draw")
        .color(&mut chain, BLACK)
        .part(Part::mip(1))
        .color(&mut half, BLACK)
        .side_effect("test");
    assert!(graph.compile().is_ok());
}

#[test]
fn sample_count_mismatch() {
    let is = |error: &GraphError| matches!(error, GraphError::SampleCountMismatch { .. });
    let depth = TextureDescriptor::new_2d(64, 32, TextureFormat::Depth32Float);
    let text = fault(
        |graph| {
            let mut color = graph.texture("color", hdr().samples(4));
            let mut depth = graph.texture("depth", depth);
            graph.raster_pass("draw").color(&mut color, BLACK).depth(&mut depth, LoadOp::Clear(0.0));
        },
        is,
    );
    says(&text, &["`depth`", "1 samples", "4 as `color` has"]);
    let text = fault(
        |graph| {
            let mut color = graph.texture("color", hdr());
            let mut resolved = graph.texture("resolved", hdr());
            graph.raster_pass("draw").color(&mut color, BLACK).resolve(&mut resolved);
        },
        is,
    );
    says(&text, &["`color`", "more than 1", "`resolved`"]);
    let text = fault(
        |graph| {
            let mut many = graph.texture("many", hdr().samples(4));
            graph.compute_pass("fill").writes(&mut many, TextureWrite::Storage);
        },
        is,
    );
    says(&text, &["no multisampled storage"]);
}

#[test]
fn usage_mismatch() {
    let is = |error: &GraphError| matches!(error, GraphError::UsageMismatch { .. });
    let text = fault(
        |graph| {
            let screen = graph.import_texture("screen", hdr().usage(TextureUsages::RENDER_ATTACHMENT));
            graph.compute_pass("histogram").samples(&screen).side_effect("test");
        },
        is,
    );
    says(&text, &["`histogram`", "`screen`", "TEXTURE_BINDING", "RENDER_ATTACHMENT"]);
    let text = fault(
        |graph| {
            let mut copy = graph.texture("copy", hdr());
            graph.compute_pass("fill").writes(&mut copy, TextureWrite::CopyDestination);
        },
        is,
    );
    says(&text, &["`fill`", "a transfer pass", "a compute pass"]);
}

#[test]
fn access_conflict() {
    let is = |error: &GraphError| matches!(error, GraphError::AccessConflict { .. });
    let text = fault(
        |graph| {
            let mut target = graph.texture("target", hdr());
            graph.raster_pass("first").color(&mut target, BLACK);
            let read = target;
            graph.raster_pass("second").samples(&read).color(&mut target, LoadOp::Load);
        },
        is,
    );
    says(&text, &["`second`", "`target`", "sampled texture", "colour attachment (load)"]);
}

#[test]
fn other_mip_levels_do_not_conflict() {
    let mut graph = Graph::new("test");
    let mut chain = graph.texture("chain", hdr().mips(2));
    graph.raster_pass("draw").color(&mut chain, BLACK);
    let drawn = chain;
    graph
        .raster_pass("halve")
        .samples(&drawn)
        .part(Part::mip(0))
        .color(&mut chain, BLACK)
        .part(Part::mip(1))
        .side_effect("test");
    assert_eq!(graph.compile().map(|plan| plan.running().count()), Ok(2));
}

#[test]
fn invalid_shapes() {
    let is = |error: &GraphError| matches!(error, GraphError::InvalidShape { .. });
    let texture = |descriptor: TextureDescriptor| {
        fault(
            |graph| {
                graph.texture("target", descriptor);
            },
            is,
        )
    };
    says(&texture(TextureDescriptor::new_2d(0, 32, TextureFormat::R8Unorm)), &["`target`", "0x32x1"]);
    says(&texture(hdr().samples(3)), &["3 samples"]);
    says(&texture(hdr().mips(0)), &["0 mip levels", "1 to 7"]);
    says(&texture(hdr().mips(8)), &["8 mip levels", "1 to 7"]);
    says(&texture(hdr().mips(2).samples(4)), &["one mip level"]);
    let buffer = |size| {
        fault(
            |graph| {
                graph.buffer("lights", BufferDescriptor::new(size));
            },
            is,
        )
    };
    says(&buffer(0), &["`lights`", "0 bytes"]);
    says(&buffer(6), &["6 bytes", "multiple of 4"]);
}

#[test]
fn part_out_of_range() {
    let text = fault(
        |graph| {
            let mut shadows = graph.texture("shadows", hdr().layers(4));
            graph.raster_pass("draw").color(&mut shadows, BLACK).part(Part::layer(4));
        },
        |error| matches!(error, GraphError::PartOutOfRange { .. }),
    );
    says(&text, &["`draw`", "layer 4", "`shadows`", "4 layer(s)"]);
}

#[test]
fn nothing_to_modify() {
    let text = fault(
        |graph| {
            let mut target = graph.texture("target", hdr());
            graph.raster_pass("draw").resolve(&mut target);
        },
        |error| matches!(error, GraphError::NothingToModify { method: "resolve", .. }),
    );
    says(&text, &["`draw`", ".resolve()", "colour attachment"]);
}

#[test]
fn raster_pass_without_attachment() {
    let text = fault(
        |graph| {
            graph.raster_pass("draw").side_effect("test");
        },
        |error| matches!(error, GraphError::NoAttachment { .. }),
    );
    says(&text, &["`draw`"]);
}

#[test]
fn export_overwritten() {
    let text = fault(
        |graph| {
            let mut target = graph.texture("target", hdr());
            graph.raster_pass("first").color(&mut target, BLACK);
            graph.export(&target);
            graph.raster_pass("second").color(&mut target, BLACK);
        },
        |error| matches!(error, GraphError::ExportOverwritten { version: 1, .. }),
    );
    says(&text, &["`target`", "`second`", "version 1"]);
}

#[test]
fn faults_do_not_depend_on_what_the_scene_holds() {
    // A skipped pass with a fault is rejected too; otherwise the fault would only show with some scenes.
    fault(
        |graph| {
            let depth = graph.texture("depth", hdr());
            graph.compute_pass("fog").requires(false, "fog").samples(&depth).side_effect("test");
        },
        |error| matches!(error, GraphError::MissingProducer { .. }),
    );
}
