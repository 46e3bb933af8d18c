//! Runs graphs on a device. These are the only tests of this crate that need one; a software rasterizer is
//! sufficient.

use lumbre_graph::wgpu;
use lumbre_graph::wgpu::{Color, Features, TextureFormat, TextureUsages};
use lumbre_graph::*;

struct Gpu {
    device: wgpu::Device,
    queue: wgpu::Queue,
}

fn gpu(wanted: Features) -> Gpu {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN;
    let instance = wgpu::Instance::new(descriptor);
    let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))
        .expect(
            "no Vulkan adapter; a software one is in the package mesa-vulkan-drivers: apt-get install it",
        );
    let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
        label: Some("lumbre_graph tests"),
        required_features: adapter.features() & wanted,
        ..Default::default()
    }))
    .expect("the adapter has a device");
    Gpu { device, queue }
}

const TIMES: Features = Features::TIMESTAMP_QUERY
    .union(Features::TIMESTAMP_QUERY_INSIDE_PASSES)
    .union(Features::TIMESTAMP_QUERY_INSIDE_ENCODERS)
    .union(Features::PIPELINE_STATISTICS_QUERY);

/// A pipeline that draws one triangle covering the whole target with a fragment shader.
fn pipeline(
    device: &wgpu::Device,
    fragment: &str,
    format: TextureFormat,
    samples: u32,
) -> wgpu::RenderPipeline {
    let source = format!(
        "@vertex fn corner(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {{
             return vec4(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0);
         }}
         @fragment fn shade(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {{ {fragment} }}"
    );
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let add = wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Add,
    };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("corner"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState { count: samples, ..Default::default() },
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("shade"),
            compilation_options: Default::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format,
                blend: Some(wgpu::BlendState { color: add, alpha: add }),
                write_mask: wgpu::ColorWrites::ALL,
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}

const SIDE: u32 = 64;
const FORMAT: TextureFormat = TextureFormat::Rgba32Float;

/// A buffer for reading back a SIDE x SIDE texture of FORMAT, with 1024 bytes per row, a multiple of 256.
fn readback(device: &wgpu::Device) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("readback"),
        size: u64::from(SIDE * SIDE * 16),
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

fn read(gpu: &Gpu, buffer: &wgpu::Buffer) -> Vec<[f32; 4]> {
    buffer.map_async(wgpu::MapMode::Read, .., |result| result.expect("mapped"));
    gpu.device.poll(wgpu::PollType::wait_indefinitely()).expect("the GPU finishes");
    let bytes = buffer.get_mapped_range(..).expect("mapped");
    let texels = bytemuck::cast_slice(&bytes).to_vec();
    drop(bytes);
    buffer.unmap();
    texels
}

fn copy_out<'a, User>(graph: &mut Graph<'a, User>, from: &TextureHandle) {
    let from = *from;
    let mut result = graph.import_buffer("result", BufferDescriptor::new(u64::from(SIDE * SIDE * 16)));
    let pass = graph
        .transfer_pass("read back")
        .reads(&from, TextureRead::CopySource)
        .writes(&mut result, BufferWrite::CopyDestination);
    pass.run(move |context| {
        context.encoder.copy_texture_to_buffer(
            context.resources.texture(&from)?.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: context.resources.buffer(&result)?,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(SIDE * 16),
                    rows_per_image: None,
                },
            },
            wgpu::Extent3d { width: SIDE, height: SIDE, depth_or_array_layers: 1 },
        );
        Ok(())
    });
}

/// Two passes that add to one target, and a copy of the result.
fn adding<'a>(
    first: &'a wgpu::RenderPipeline,
    second: &'a wgpu::RenderPipeline,
) -> Graph<'a, Vec<&'static str>> {
    let mut graph: Graph<'a, Vec<&'static str>> = Graph::with_user("adding");
    let mut target = graph.texture("target", TextureDescriptor::new_2d(SIDE, SIDE, FORMAT));
    let clear = LoadOp::ClearIfFirst(Color { r: 0.0, g: 0.5, b: 0.0, a: 0.0 });
    for (name, pipeline) in [("first", first), ("second", second)] {
        graph.raster_pass(name).color(&mut target, clear).run(move |context| {
            context.pass.set_pipeline(pipeline);
            context.pass.draw(0..3, 0..1);
            context.user.push(name);
            Ok(())
        });
    }
    copy_out(&mut graph, &target);
    graph
}

#[test]
fn merged_passes_draw_and_are_measured() {
    let gpu = gpu(TIMES | Features::FLOAT32_BLENDABLE);
    let first = pipeline(&gpu.device, "return vec4(floor(at.x), 0.0, 0.0, 1.0);", FORMAT, 1);
    let second = pipeline(&gpu.device, "return vec4(0.0, floor(at.y), 0.25, 0.0);", FORMAT, 1);
    let buffer = readback(&gpu.device);
    let imports = Imports::new().buffer("result", &buffer);
    let mut executor = Executor::new();
    executor.set_measure(Measurements::ALL);
    let mut ran = Vec::new();
    let frame = executor
        .execute_with(&gpu.device, &gpu.queue, adding(&first, &second), &imports, &mut ran)
        .expect("the frame runs");
    assert_eq!(ran, ["first", "second"]);
    assert_eq!(frame.plan.groups().collect::<Vec<_>>(), [vec!["first", "second"], vec!["read back"]]);
    for (index, texel) in read(&gpu, &buffer).into_iter().enumerate() {
        let (x, y) = (index as u32 % SIDE, index as u32 / SIDE);
        // Whole numbers and halves are exact in f32, and so are sums of a few of them.
        assert_eq!(texel, [x as f32, 0.5 + y as f32, 0.25, 1.0], "texel {x} {y}");
    }

    let has = gpu.device.features();
    let report =
        executor.timings_blocking(&gpu.device, &gpu.queue).expect("not lost").expect("a frame ran").clone();
    assert_eq!(report.frame, 1);
    assert_eq!(
        report.passes.iter().map(|pass| &*pass.name).collect::<Vec<_>>(),
        ["first", "second", "read back"]
    );
    assert!(report.passes.iter().all(|pass| pass.cpu_ms.is_some_and(|ms| ms > 0.0)), "{report:?}");
    let cpu = report.cpu_ms.expect("asked for");
    let stages = frame.stages.expect("asked for");
    assert!(stages.recording_ms > 0.0 && stages.submission_ms > 0.0, "{stages:?}");
    // All but the last stage are before the end of the submission, one after the other.
    assert!(stages.total_ms() - stages.keeping_ms <= cpu * (1.0 + 1e-9), "{stages:?} within {cpu} ms");
    let passes: f64 = report.passes.iter().filter_map(|pass| pass.cpu_ms).sum();
    assert!(passes <= stages.recording_ms, "{passes} ms of passes in {stages:?}");
    assert!(has.contains(TIMES), "mesa's software rasterizer has these; a device without would test less");
    assert!(report.gpu_ms.is_some_and(|ms| ms > 0.0), "{report:?}");
    assert!(matches!(report.passes[0].gpu, GpuTime::PartOfGroup { .. }), "{report:?}");
    assert!(matches!(report.passes[2].gpu, GpuTime::Pass { .. }), "{report:?}");
    let sum: f64 = report.passes[..2].iter().filter_map(|pass| pass.gpu.ms()).sum();
    assert!(sum > 0.0 && sum <= report.gpu_ms.unwrap_or(0.0), "{report:?}");
    for pass in &report.passes[..2] {
        let counted = pass.invocations.expect("asked for");
        assert_eq!(counted.vertex, 3, "one triangle");
        // A rasterizer that works in quads or tiles may shade border fragments more than once.
        assert!(
            counted.fragment >= u64::from(SIDE * SIDE) && counted.fragment < u64::from(4 * SIDE * SIDE),
            "{counted:?}"
        );
    }
    assert!(report.notes.is_empty(), "{:?}", report.notes);
}

#[test]
fn memory_and_plan_are_used_again() {
    let gpu = gpu(Features::FLOAT32_BLENDABLE);
    let first = pipeline(&gpu.device, "return vec4(1.0);", FORMAT, 1);
    let second = pipeline(&gpu.device, "return vec4(2.0);", FORMAT, 1);
    let buffer = readback(&gpu.device);
    let imports = Imports::new().buffer("result", &buffer);
    let mut executor = Executor::new();
    let run = |executor: &mut Executor| {
        let graph = adding(&first, &second);
        executor
            .execute_with(&gpu.device, &gpu.queue, graph, &imports, &mut Vec::new())
            .expect("the frame runs")
            .plan
    };
    let plan = run(&mut executor);
    for _ in 0..5 {
        assert!(std::sync::Arc::ptr_eq(&plan, &run(&mut executor)), "same declaration, same plan");
    }
    let statistics = executor.pool_statistics();
    assert_eq!((statistics.created, statistics.transients), (1, 1));
    assert_eq!(statistics.bytes, u64::from(SIDE * SIDE * 16));

    // Without TIMESTAMP_QUERY there are no GPU times, and the report says so.
    let report = executor.timings_blocking(&gpu.device, &gpu.queue).expect("not lost").expect("a frame ran");
    assert!(report.gpu_ms.is_none() && report.notes[0].contains("TIMESTAMP_QUERY"), "{report:?}");
    assert!(report.passes.iter().all(|pass| pass.gpu == GpuTime::NotMeasured));

    executor.set_measure(Measurements::OFF);
    run(&mut executor);
    let report = executor.timings_blocking(&gpu.device, &gpu.queue).expect("not lost").expect("a frame ran");
    assert_eq!(report.frame, 7);
    assert!(report.cpu_ms.is_none() && report.notes.is_empty());
    assert!(report.passes.iter().all(|pass| pass.cpu_ms.is_none() && pass.gpu == GpuTime::NotMeasured));
}

#[test]
fn the_probe_finds_the_first_pass_and_texel() {
    let gpu = gpu(Features::empty());
    // Half floats are blendable everywhere. There is NaN at (13, 7), (40, 7) and (2, 50); in reading order (13, 7)
    // is first.
    let format = TextureFormat::Rgba16Float;
    let nan = "let p = vec2<u32>(at.xy);
        let hit = all(p == vec2(13u, 7u)) || all(p == vec2(40u, 7u)) || all(p == vec2(2u, 50u));
        return vec4(1.0, select(2.0, bitcast<f32>(0x7fc00000u + min(p.x, 0u)), hit), 3.0, 1.0);";
    let inf = nan.replace("0x7fc00000u", "0x7f800000u");
    for (bad, samples) in [(nan, 1), (nan, 4), (&*inf, 1)] {
        let clean = pipeline(&gpu.device, "return vec4(1.0);", format, samples);
        let dirty = pipeline(&gpu.device, bad, format, samples);
        let build = |order: [&'static str; 3]| {
            let mut graph = Graph::new("probe");
            let shape = TextureDescriptor::new_2d(SIDE, SIDE, format).samples(samples);
            let mut target = graph.texture("target", shape);
            for name in order {
                let pipeline = if name == "dirty" { dirty.clone() } else { clean.clone() };
                graph.raster_pass(name).color(&mut target, LoadOp::ClearIfFirst(Color::BLACK)).run(
                    move |context| {
                        context.pass.set_pipeline(&pipeline);
                        context.pass.draw(0..3, 0..1);
                        Ok(())
                    },
                );
            }
            graph.export(&target);
            graph
        };
        let mut executor = Executor::new();
        let mut look = |graph: Graph<'_>| {
            executor.enable_probe(true);
            executor.execute(&gpu.device, &gpu.queue, graph, &Imports::new()).expect("the frame runs");
            let report = executor.timings_blocking(&gpu.device, &gpu.queue).expect("not lost");
            let report = report.expect("a frame ran");
            assert!(report.probed);
            report.non_finite.clone()
        };
        let found = look(build(["before", "dirty", "after"])).expect("there is one");
        assert_eq!((&*found.pass, &*found.resource), ("dirty", "target"));
        assert_eq!((found.x, found.y, found.sample, found.layer, found.mip), (13, 7, 0, 0, 0));
        assert!(found.value[1].is_nan() || found.value[1].is_infinite(), "{found:?}");
        // `before` drew 1 into each channel, and `dirty` adds to that.
        assert_eq!([found.value[0], found.value[2]], [2.0, 4.0]);
        assert_eq!(look(build(["before", "after", "again"])), None, "a clean frame after a dirty one");
    }
}

/// The device is shared: a thread that polls it takes the callbacks of all threads, and may be delayed before it
/// runs them.
#[test]
fn measurements_arrive_through_another_threads_hands() {
    let gpu = gpu(TIMES | Features::FLOAT32_BLENDABLE);
    let draw = pipeline(&gpu.device, "return vec4(1.0);", FORMAT, 1);
    let buffer = readback(&gpu.device);
    let imports = Imports::new().buffer("result", &buffer);
    let mut executor = Executor::new();
    executor.set_measure(Measurements::ALL);
    let slow = [readback(&gpu.device), readback(&gpu.device)];
    let (polled, taken) = std::sync::mpsc::channel();
    for number in 1..=4 {
        let mut ran = Vec::new();
        // A frame that has to wait for the GPU, so that its callbacks come together with the others.
        executor
            .execute_with(&gpu.device, &gpu.queue, adding(&draw, &draw), &imports, &mut ran)
            .expect("the frame runs");
        for buffer in &slow {
            let polled = polled.clone();
            buffer.map_async(wgpu::MapMode::Read, .., move |result| {
                result.expect("mapped");
                polled.send(()).expect("the test listens");
                std::thread::sleep(std::time::Duration::from_millis(200));
            });
        }
        std::thread::scope(|threads| {
            threads.spawn(|| gpu.device.poll(wgpu::PollType::wait_indefinitely()).expect("the GPU finishes"));
            taken.recv().expect("the other thread has the answers");
            let report = executor.timings_blocking(&gpu.device, &gpu.queue).expect("not lost");
            assert_eq!(report.map(|report| report.frame), Some(number));
        });
        taken.recv().expect("both were mapped");
        slow.iter().for_each(wgpu::Buffer::unmap);
    }
}

#[test]
fn retained_content_is_kept_and_not_drawn_again() {
    let gpu = gpu(Features::FLOAT32_BLENDABLE);
    let seven = pipeline(&gpu.device, "return vec4(7.0);", FORMAT, 1);
    let nine = pipeline(&gpu.device, "return vec4(9.0);", FORMAT, 1);
    let buffer = readback(&gpu.device);
    let imports = Imports::new().buffer("result", &buffer);
    let mut executor = Executor::new();
    let mut run = |fingerprint: u64, pipeline: &wgpu::RenderPipeline| {
        let mut graph = Graph::new("retained");
        let mut kept = graph.retained_texture("kept", TextureDescriptor::new_2d(SIDE, SIDE, FORMAT));
        graph
            .raster_pass("draw")
            .fingerprint(fingerprint)
            .color(&mut kept, LoadOp::Clear(Color::TRANSPARENT))
            .run(|context| {
                context.pass.set_pipeline(pipeline);
                context.pass.draw(0..3, 0..1);
                Ok(())
            });
        copy_out(&mut graph, &kept);
        let frame = executor.execute(&gpu.device, &gpu.queue, graph, &imports).expect("the frame runs");
        let ran = frame.plan.status("draw").expect("declared").runs();
        (ran, read(&gpu, &buffer)[0][0])
    };
    assert_eq!(run(1, &seven), (true, 7.0));
    // The fingerprint states that nothing changed, so the other pipeline must not run.
    assert_eq!(run(1, &nine), (false, 7.0));
    assert_eq!(run(2, &nine), (true, 9.0));
    assert_eq!(run(2, &seven), (false, 9.0));
}

#[test]
fn a_multisampled_chain_resolves_at_its_end() {
    let gpu = gpu(Features::empty());
    let format = TextureFormat::Rgba16Float;
    let draw = pipeline(&gpu.device, "return vec4(0.25);", format, 4);
    let screen = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("screen"),
        size: wgpu::Extent3d { width: SIDE, height: SIDE, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let view = screen.create_view(&Default::default());
    let result = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(SIDE * SIDE * 8),
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut graph = Graph::new("resolve");
    let shape = TextureDescriptor::new_2d(SIDE, SIDE, format);
    let mut many = graph.texture("many", shape.samples(4));
    let mut target = graph.import_texture("screen", shape);
    for name in ["one", "two", "three"] {
        let draw = draw.clone();
        graph
            .raster_pass(name)
            .requires(name != "one", "luck")
            .color(&mut many, LoadOp::ClearIfFirst(Color { r: 1.0, g: 0.0, b: 0.0, a: 0.0 }))
            .resolve(&mut target)
            .run(move |context| {
                context.pass.set_pipeline(&draw);
                context.pass.draw(0..3, 0..1);
                Ok(())
            });
    }
    let mut executor = Executor::new();
    let imports = Imports::new().texture("screen", &view);
    let frame = executor.execute(&gpu.device, &gpu.queue, graph, &imports).expect("the frame runs");
    assert_eq!(frame.plan.groups().collect::<Vec<_>>(), [["two", "three"]]);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    encoder.copy_texture_to_buffer(
        screen.as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer: &result,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(SIDE * 8),
                rows_per_image: None,
            },
        },
        screen.size(),
    );
    gpu.queue.submit([encoder.finish()]);
    result.map_async(wgpu::MapMode::Read, .., |result| result.expect("mapped"));
    gpu.device.poll(wgpu::PollType::wait_indefinitely()).expect("the GPU finishes");
    let bytes = result.get_mapped_range(..).expect("mapped");
    let halves: &[u16] = bytemuck::cast_slice(&bytes);
    // Cleared to (1, 0, 0, 0) and then drawn twice with a quarter: 1.5 and 0.5, which are exact in half floats
    // (0x3e00, 0x3800).
    assert!(halves.chunks(4).all(|texel| texel == [0x3e00, 0x3800, 0x3800, 0x3800]));
}

#[test]
fn faults_at_run_time_are_named() {
    let gpu = gpu(Features::empty());
    let shape = TextureDescriptor::new_2d(8, 8, TextureFormat::Rgba8Unorm);
    let texture = |side: u32, usage: TextureUsages| {
        let size = wgpu::Extent3d { width: side, height: side, depth_or_array_layers: 1 };
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: TextureFormat::Rgba8Unorm,
            usage,
            view_formats: &[],
        });
        texture.create_view(&Default::default())
    };
    let mut executor = Executor::new();
    let mut run = |imports: &Imports, body: bool, ask: bool| {
        let mut graph = Graph::new("faulty");
        let other = graph.texture("other", shape);
        let mut screen = graph.import_texture("screen", shape);
        let pass = graph.raster_pass("draw").color(&mut screen, LoadOp::Clear(Color::BLACK));
        if body {
            pass.run(move |context| {
                if ask {
                    context.resources.view(&other)?;
                }
                Ok(())
            });
        }
        executor
            .execute(&gpu.device, &gpu.queue, graph, imports)
            .map(|_| ())
            .map_err(|error| error.to_string())
    };
    let good = texture(8, TextureUsages::RENDER_ATTACHMENT);
    let bound = |view: &wgpu::TextureView| Imports::new().texture("screen", view);
    assert_eq!(run(&bound(&good), true, false), Ok(()));
    let says = |result: Result<(), String>, words: &[&str]| {
        let text = result.expect_err("there is a fault");
        words.iter().for_each(|word| assert!(text.contains(word), "`{word}` is not in: {text}"));
    };
    says(run(&Imports::new(), true, false), &["`screen`", "nothing is bound"]);
    says(run(&Imports::new().texture("scren", &good), true, false), &["did you mean `scren`?"]);
    says(run(&bound(&texture(16, TextureUsages::RENDER_ATTACHMENT)), true, false), &["size", "8x8", "16x16"]);
    says(
        run(&bound(&texture(8, TextureUsages::COPY_DST)), true, false),
        &["`screen`", "RENDER_ATTACHMENT", "COPY_DST"],
    );
    says(run(&bound(&good), false, false), &["`draw`", "nothing to run"]);
    says(run(&bound(&good), true, true), &["`draw`", "`other`", "did not declare"]);
    assert_eq!(run(&bound(&good), true, false), Ok(()), "a fault leaves the executor usable");
}
