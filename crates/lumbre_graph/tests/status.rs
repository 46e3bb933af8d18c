//! What happens to passes, and why; merging; stores; explanations. Needs no GPU.

use lumbre_graph::wgpu::{Color, TextureFormat};
use lumbre_graph::*;

const BLACK: LoadOp<Color> = LoadOp::Clear(Color::BLACK);
const FIRST: LoadOp<Color> = LoadOp::ClearIfFirst(Color::BLACK);

fn hdr() -> TextureDescriptor {
    TextureDescriptor::new_2d(640, 360, TextureFormat::Rgba16Float)
}

fn depth() -> TextureDescriptor {
    TextureDescriptor::new_2d(640, 360, TextureFormat::Depth32Float)
}

fn running(plan: &Plan) -> Vec<&str> {
    plan.running().collect()
}

fn reason<'p>(plan: &'p Plan, pass: &str) -> (&'p str, &'p str) {
    let status = plan.status(pass).expect("the pass is declared");
    (status.word(), status.reason())
}

/// A frame of the forward renderer, in which any of three passes may be missing.
fn forward_frame(lightmap: bool, forward: bool, transparent: bool) -> Graph<'static> {
    let mut graph = Graph::new("frame");
    let mut color = graph.texture("color", hdr().samples(4));
    let mut resolved = graph.texture("resolved", hdr());
    let mut z = graph.texture("depth", depth().samples(4));
    let mut screen =
        graph.import_texture("screen", TextureDescriptor::new_2d(640, 360, TextureFormat::Rgba8Unorm));
    for (name, there, what) in [
        ("lightmap", lightmap, "a lightmapped mesh"),
        ("forward", forward, "a mesh without lightmap"),
        ("transparent", transparent, "transparent meshes"),
    ] {
        graph
            .raster_pass(name)
            .requires(there, what)
            .color(&mut color, FIRST)
            .resolve(&mut resolved)
            .depth(&mut z, LoadOp::ClearIfFirst(0.0));
    }
    graph.raster_pass("tone map").samples(&resolved).color(&mut screen, BLACK);
    graph
}

#[test]
fn any_subset_of_a_chain_may_be_skipped() {
    for bits in 1..8_u32 {
        let there = [bits & 1 != 0, bits & 2 != 0, bits & 4 != 0];
        let plan = forward_frame(there[0], there[1], there[2]).compile().expect("valid");
        let mut expected: Vec<&str> = ["lightmap", "forward", "transparent"]
            .into_iter()
            .zip(there)
            .filter(|(_, there)| *there)
            .map(|(name, _)| name)
            .collect();
        let groups: Vec<Vec<&str>> = plan.groups().collect();
        assert_eq!(groups, [expected.clone(), vec!["tone map"]], "one render pass for all that run");
        expected.push("tone map");
        assert_eq!(running(&plan), expected);
    }
    let error = forward_frame(false, false, false).compile().expect_err("nobody writes `resolved`");
    assert!(matches!(*error, GraphError::ProducersSkipped { .. }), "{error}");
    assert!(error.to_string().contains("`forward`: the scene has no mesh without lightmap"), "{error}");
}

#[test]
fn skipped_says_what_the_scene_has_not() {
    let plan = forward_frame(false, true, false).compile().expect("valid");
    assert_eq!(reason(&plan, "lightmap"), ("skipped", "the scene has no lightmapped mesh"));
    assert_eq!(reason(&plan, "transparent"), ("skipped", "the scene has no transparent meshes"));
    assert_eq!(reason(&plan, "forward"), ("runs", "`tone map` reads its `resolved`"));
    assert_eq!(reason(&plan, "tone map"), ("runs", "it writes `screen`, which is imported"));
    assert_eq!(plan.status("bloom"), None);
}

#[test]
fn culled_says_who_would_have_read() {
    let mut graph = Graph::new("frame");
    let mut a = graph.texture("a", hdr());
    let mut b = graph.texture("b", hdr());
    let mut c = graph.texture("c", hdr());
    let mut d = graph.texture("d", hdr());
    graph.raster_pass("make a").color(&mut a, BLACK);
    graph.raster_pass("make b").samples(&a).color(&mut b, BLACK);
    graph.raster_pass("make c").color(&mut c, BLACK);
    graph.raster_pass("mirror").requires(false, "a mirror").samples(&c).color(&mut d, BLACK);
    graph.compute_pass("idle");
    let plan = graph.compile().expect("valid");
    assert_eq!(running(&plan), [""; 0]);
    assert_eq!(reason(&plan, "make a"), ("culled", "nothing that runs reads `a` (only `make b`)"));
    assert_eq!(reason(&plan, "make b"), ("culled", "nothing reads `b`"));
    assert_eq!(reason(&plan, "make c"), ("culled", "nothing that runs reads `c` (only `mirror`)"));
    assert_eq!(reason(&plan, "idle"), ("culled", "it writes nothing and has no side effect"));
}

#[test]
fn what_a_full_clear_overwrites_is_culled() {
    let mut graph = Graph::new("frame");
    let mut target = graph.texture("target", hdr());
    graph.raster_pass("lost").color(&mut target, BLACK);
    graph.raster_pass("kept").color(&mut target, BLACK);
    graph.export(&target);
    let plan = graph.compile().expect("valid");
    assert_eq!(running(&plan), ["kept"]);
    assert_eq!(reason(&plan, "kept").1, "it writes `target`, which is exported");
}

#[test]
fn clearing_one_layer_keeps_the_others() {
    let mut graph = Graph::new("frame");
    let mut shadows = graph.texture("shadows", depth().layers(3));
    for (layer, name) in ["sun", "lamp", "torch"].into_iter().enumerate() {
        graph.raster_pass(name).depth(&mut shadows, LoadOp::Clear(0.0)).part(Part::layer(layer as u32));
    }
    graph.compute_pass("shade").samples(&shadows).side_effect("test");
    let plan = graph.compile().expect("valid");
    assert_eq!(running(&plan), ["sun", "lamp", "torch", "shade"]);
    assert_eq!(plan.groups().count(), 4, "different layers are different attachments");
}

#[test]
fn clear_if_first_goes_by_part() {
    let mut graph = Graph::new("frame");
    let mut shadows = graph.texture("shadows", depth().layers(2));
    let clear = LoadOp::ClearIfFirst(0.0);
    graph.raster_pass("a").depth(&mut shadows, clear).part(Part::layer(0));
    graph.raster_pass("b").depth(&mut shadows, clear).part(Part::layer(1));
    graph.raster_pass("c").depth(&mut shadows, clear).part(Part::layer(1));
    graph.export(&shadows);
    let plan = graph.compile().expect("valid");
    // b must not load layer 1, which a did not write; c loads it and therefore shares b's render pass.
    assert_eq!(plan.groups().collect::<Vec<_>>(), [vec!["a"], vec!["b", "c"]]);
}

#[test]
fn optional_reads_do_without() {
    let mut graph = Graph::new("frame");
    let mut mirror = graph.texture("mirror", hdr());
    graph.raster_pass("draw mirror").requires(false, "a mirror").color(&mut mirror, BLACK);
    graph.compute_pass("shade").reads_optional(&mirror, TextureRead::Sampled).side_effect("test");
    let plan = graph.compile().expect("valid");
    assert_eq!(running(&plan), ["shade"]);
    assert_eq!(plan.slot("mirror"), None, "what nobody writes takes no memory");
}

#[test]
fn side_effects_run_and_say_so() {
    let mut graph = Graph::new("frame");
    graph.transfer_pass("present").side_effect("presents the frame");
    let plan = graph.compile().expect("valid");
    assert_eq!(reason(&plan, "present"), ("runs", "presents the frame"));
}

#[test]
fn a_pass_that_samples_the_attachment_is_not_merged() {
    let mut graph = Graph::new("frame");
    let mut color = graph.texture("color", hdr());
    let mut z = graph.texture("depth", depth());
    graph.raster_pass("opaque").color(&mut color, BLACK).depth(&mut z, LoadOp::Clear(0.0));
    graph.raster_pass("decals").color(&mut color, LoadOp::Load).depth_read_only(&z);
    graph.raster_pass("soft").samples(&z).color(&mut color, LoadOp::Load).depth_read_only(&z);
    graph.raster_pass("cleared").color(&mut color, BLACK).depth_read_only(&z);
    graph.export(&color);
    let groups = |graph: &Graph| -> Vec<Vec<String>> {
        let plan = graph.compile().expect("valid");
        plan.groups().map(|group| group.into_iter().map(str::to_owned).collect()).collect()
    };
    // The last pass clears the colour, so everything before it is lost except the depth.
    assert_eq!(groups(&graph), [vec!["opaque"], vec!["cleared"]]);
    graph.raster_pass("hold").color(&mut color, LoadOp::Load).depth(&mut z, LoadOp::Load);
    graph.export(&color);
    assert_eq!(groups(&graph), [vec!["opaque"], vec!["cleared", "hold"]]);

    let mut graph = Graph::new("frame");
    let mut color = graph.texture("color", hdr());
    let mut z = graph.texture("depth", depth());
    graph.raster_pass("opaque").color(&mut color, BLACK).depth(&mut z, LoadOp::Clear(0.0));
    graph.raster_pass("decals").color(&mut color, LoadOp::Load).depth_read_only(&z);
    graph.raster_pass("soft").samples(&z).color(&mut color, LoadOp::Load).depth_read_only(&z);
    graph.export(&color);
    assert_eq!(groups(&graph), [vec!["opaque", "decals"], vec!["soft"]]);
}

#[test]
fn a_buffer_written_in_the_group_keeps_its_reader_apart() {
    let mut graph = Graph::new("frame");
    let mut color = graph.texture("color", hdr());
    let mut counts = graph.buffer("counts", BufferDescriptor::new(64));
    graph.raster_pass("count").color(&mut color, BLACK).writes(&mut counts, BufferWrite::Storage);
    graph.raster_pass("draw").color(&mut color, LoadOp::Load).reads(&counts, BufferRead::Indirect);
    graph.export(&color);
    assert_eq!(graph.compile().expect("valid").groups().count(), 2);
}

#[test]
fn merging_can_be_switched_off() {
    let options = CompileOptions { merge: false, ..CompileOptions::default() };
    let graph = forward_frame(true, true, true);
    let plan = graph.compile_with(&History::default(), options).expect("valid");
    assert_eq!(plan.groups().count(), 4);
}

#[test]
fn after_orders_what_no_resource_does() {
    let mut graph = Graph::new("frame");
    graph.compute_pass("second").after("first").side_effect("test");
    graph.compute_pass("first").side_effect("test");
    graph.compute_pass("third").side_effect("test");
    let plan = graph.compile().expect("valid");
    assert_eq!(running(&plan), ["first", "second", "third"]);
}

#[test]
fn a_reader_of_the_old_version_goes_before_the_writer() {
    let mut graph = Graph::new("frame");
    let mut a = graph.texture("a", hdr());
    graph.raster_pass("draw").color(&mut a, BLACK);
    let drawn = a;
    graph.raster_pass("draw over").color(&mut a, LoadOp::Load);
    graph.compute_pass("look").samples(&drawn).side_effect("test");
    graph.export(&a);
    assert_eq!(running(&graph.compile().expect("valid")), ["draw", "look", "draw over"]);
}

/// Two shadow maps as layers of one retained texture, and a pass that reads them.
fn shadows(sun: u64, lamp: u64, there: bool) -> Graph<'static> {
    let mut graph = Graph::new("frame");
    let mut shadows = graph.retained_texture("shadows", depth().layers(2));
    graph
        .raster_pass("sun shadow")
        .fingerprint(sun)
        .depth(&mut shadows, LoadOp::Clear(0.0))
        .part(Part::layer(0));
    graph
        .raster_pass("lamp shadow")
        .requires(there, "a lamp")
        .fingerprint(lamp)
        .depth(&mut shadows, LoadOp::Clear(0.0))
        .part(Part::layer(1));
    graph.compute_pass("shade").samples(&shadows).side_effect("test");
    graph
}

#[test]
fn unchanged_follows_parts_and_fingerprints() {
    let options = CompileOptions::default();
    let first = shadows(1, 7, true).compile().expect("valid");
    assert_eq!(running(&first), ["sun shadow", "lamp shadow", "shade"]);

    let same = shadows(1, 7, true).compile_with(first.history(), options).expect("valid");
    assert_eq!(running(&same), ["shade"]);
    assert_eq!(reason(&same, "sun shadow").0, "unchanged");

    let moved = shadows(2, 7, true).compile_with(same.history(), options).expect("valid");
    assert_eq!(running(&moved), ["sun shadow", "shade"], "the other layer stays");

    let off = shadows(2, 7, false).compile_with(moved.history(), options).expect("valid");
    assert_eq!(running(&off), ["shade"]);
    let on = shadows(2, 7, true).compile_with(off.history(), options).expect("valid");
    assert_eq!(running(&on), ["shade"], "what it drew is still there");

    let back = shadows(1, 8, true).compile_with(on.history(), options).expect("valid");
    assert_eq!(running(&back), ["sun shadow", "lamp shadow", "shade"]);
}

#[test]
fn unchanged_follows_inputs() {
    let build = |mesh: Option<u64>, inner: u64| {
        let mut graph = Graph::new("frame");
        let vertices = graph.import_buffer("vertices", BufferDescriptor::new(64));
        if let Some(content) = mesh {
            graph.fingerprint(&vertices, content);
        }
        let mut scratch = graph.texture("scratch", hdr());
        let mut kept = graph.retained_texture("kept", hdr());
        graph
            .raster_pass("draw")
            .fingerprint(inner)
            .reads(&vertices, BufferRead::Vertex)
            .color(&mut scratch, BLACK);
        graph.raster_pass("filter").fingerprint(0).samples(&scratch).color(&mut kept, BLACK);
        graph.compute_pass("use").samples(&kept).side_effect("test");
        graph
    };
    let next = |plan: &Plan, graph: Graph| {
        graph.compile_with(plan.history(), CompileOptions::default()).expect("valid")
    };
    let first = build(Some(1), 5).compile().expect("valid");
    let same = next(&first, build(Some(1), 5));
    assert_eq!(running(&same), ["use"]);
    assert_eq!(reason(&same, "draw"), ("culled", "nothing that runs reads `scratch` (only `filter`)"));
    let all = ["draw", "filter", "use"];
    assert_eq!(running(&next(&same, build(Some(2), 5))), all, "the import changed");
    assert_eq!(running(&next(&same, build(Some(1), 6))), all, "the producer of its input changed");
    assert_eq!(running(&next(&same, build(None, 5))), all, "nothing is known of the import");
    let unknown = next(&same, build(None, 5));
    assert_eq!(running(&next(&unknown, build(None, 5))), all, "and so it stays");
}

#[test]
fn a_chain_on_a_retained_resource_runs_whole() {
    let build = |below: u64, above: u64| {
        let mut graph = Graph::new("frame");
        let mut kept = graph.retained_texture("kept", hdr());
        graph.raster_pass("below").fingerprint(below).color(&mut kept, BLACK);
        graph.raster_pass("above").fingerprint(above).color(&mut kept, LoadOp::Load);
        graph.compute_pass("use").samples(&kept).side_effect("test");
        graph
    };
    let first = build(1, 1).compile().expect("valid");
    let next = |graph: Graph| graph.compile_with(first.history(), CompileOptions::default()).expect("valid");
    assert_eq!(running(&next(build(1, 1))), ["use"]);
    // The texture has the content that `above` made; to draw `above` again, `below` must run first.
    assert_eq!(running(&next(build(1, 2))), ["below", "above", "use"]);
    assert_eq!(running(&next(build(2, 1))), ["below", "above", "use"]);
}

#[test]
fn last_frames_content_can_be_read() {
    let build = || {
        let mut graph = Graph::new("frame");
        let mut accumulated = graph.retained_texture("accumulated", hdr());
        let mut mixed = graph.texture("mixed", hdr());
        graph.raster_pass("mix").reads_optional(&accumulated, TextureRead::Sampled).color(&mut mixed, BLACK);
        graph.raster_pass("keep").samples(&mixed).color(&mut accumulated, BLACK);
        graph
    };
    let first = build().compile().expect("valid");
    assert_eq!(running(&first), ["mix", "keep"]);
    assert_eq!(reason(&first, "keep").1, "it writes `accumulated`, which is read by the next frame");
    let second = build().compile_with(first.history(), CompileOptions::default()).expect("valid");
    assert_eq!(running(&second), ["mix", "keep"]);
    let text = second.explain().to_text();
    assert!(text.contains("accumulated#0 (sampled texture)"), "{text}");
}

#[test]
fn explains_as_text() {
    let text = forward_frame(false, true, true).compile().expect("valid").explain().to_text();
    let lines: Vec<&str> = text.lines().map(str::trim_end).collect();
    assert_eq!(lines[0], "graph `frame`: 3 of 4 passes run, in 2 groups");
    assert_eq!(lines[1], "    - lightmap     raster    skipped    the scene has no lightmapped mesh");
    assert_eq!(lines[3], "    0 forward      raster    runs       `transparent` builds on its `color`");
    for line in [
        "writes color#2 (colour attachment (clear if first)), resolved#2 (resolve target), depth#2 (depth attachment (clear if first))",
        "reads resolved#3 (sampled texture of `transparent`)",
        // 640 * 360 texels of 8 bytes, 4 samples: 7 372 800 B.
        "color        Transient  640x360 Rgba16Float, 4 samples  7.0 MiB  groups 0..0, slot 0",
        "resolved     Transient  640x360 Rgba16Float  1.8 MiB  groups 0..1, slot 1",
    ] {
        let line = line.split_whitespace().collect::<Vec<_>>().join(" ");
        let has = |held: &&str| held.split_whitespace().collect::<Vec<_>>().join(" ") == line;
        assert!(lines.iter().any(has), "no line `{line}` in:\n{text}");
    }
}

#[test]
fn explains_as_json_and_dot() {
    let plan = forward_frame(false, true, true).compile().expect("valid");
    let json: serde_json::Value = serde_json::from_str(&plan.explain().to_json()).expect("is JSON");
    assert_eq!(json["passes"][0]["status"], "skipped");
    assert_eq!(json["passes"][0]["reason"], "the scene has no lightmapped mesh");
    assert_eq!(json["passes"][1]["group"], json["passes"][2]["group"]);
    assert_eq!(json["passes"][3]["reads"][0]["from"], "transparent");
    assert_eq!(json["resources"][0]["bytes"], 640 * 360 * 8 * 4);
    assert_eq!(json["resources"][1]["usage"], "TEXTURE_BINDING | RENDER_ATTACHMENT");
    let peak = 640 * 360 * (8 * 4 + 8 + 4 * 4);
    assert_eq!(json["memory"]["peak_bytes"], peak);

    let dot = plan.explain().to_dot();
    assert!(dot.starts_with("digraph \"frame\" {") && dot.ends_with("}\n"), "{dot}");
    assert!(dot.contains("subgraph cluster_0"), "the merged group has a frame: {dot}");
    assert!(dot.contains("\"pass transparent\" -> \"resource resolved 3\""), "{dot}");
    assert!(dot.contains("style=dashed"), "what does not run is dashed: {dot}");
    assert_eq!(dot.matches('{').count(), dot.matches('}').count());
}

#[test]
fn passes_belong_to_whoever_declared_them() {
    let mut graph = Graph::new("frame");
    let mut mixed = graph.texture("mixed", hdr());
    graph.raster_pass("nobody's").color(&mut mixed, BLACK);
    graph.set_owner("glow");
    graph.raster_pass("glow").color(&mut mixed, BLACK);
    graph.raster_pass("glow, wider").color(&mut mixed, BLACK);
    graph.set_owner("rim");
    graph.raster_pass("rim").color(&mut mixed, BLACK);
    graph.export(&mixed);
    let explanation = graph.compile().expect("valid").explain();
    let owners: Vec<_> = explanation.passes.iter().map(|pass| pass.owner.as_deref()).collect();
    assert_eq!(owners, [None, Some("glow"), Some("glow"), Some("rim")]);
    // The owner is only mentioned where it differs from the pass's name.
    let text = explanation.to_text();
    assert_eq!(text.matches("(glow's)").count(), 1, "{text}");
    assert!(!text.contains("(rim's)"), "{text}");
}
