//! A graph of two passes on a device: one draws a disc into a transient texture, and the other finds its edge
//! through a bind group for that texture. It prints the plan and the number of texels on the edge.
//!
//! Run it with `cargo run --release -p lumbre_graph --example sobel`.

#![allow(clippy::print_stdout, reason = "what it prints is what one wants of it")]

use lumbre_graph::{
    BufferDescriptor, BufferWrite, Executor, Graph, Imports, LoadOp, TextureDescriptor, TextureRead, wgpu,
};

const SIDE: u32 = 64;
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Float;

const SHADERS: &str = "
    @vertex fn corner(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {
        return vec4(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0);
    }
    @fragment fn disc(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
        return vec4(select(0.0, 1.0, distance(at.xy, vec2(32.0)) < 20.0));
    }
    @group(0) @binding(0) var image: texture_2d<f32>;
    fn texel(at: vec2<i32>) -> f32 { return textureLoad(image, clamp(at, vec2(0), vec2(63)), 0).r; }
    @fragment fn sobel(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
        var gradient = vec2(0.0);
        for (var y = -1; y <= 1; y++) {
            for (var x = -1; x <= 1; x++) {
                let weight = vec2(f32(x * (2 - abs(y))), f32(y * (2 - abs(x))));
                gradient += weight * texel(vec2<i32>(position.xy) + vec2(x, y));
            }
        }
        return vec4(length(gradient));
    }";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor::default()))?;
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("sobel"),
        source: wgpu::ShaderSource::Wgsl(SHADERS.into()),
    });
    let disc = pipeline(&device, &module, "disc");
    let sobel = pipeline(&device, &module, "sobel");
    let bytes = u64::from(SIDE * SIDE * 4);
    let result = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("result"),
        size: bytes,
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });

    let mut graph = Graph::new("edges");
    let mut image = graph.texture("image", TextureDescriptor::new_2d(SIDE, SIDE, FORMAT));
    let mut edges = graph.texture("edges", TextureDescriptor::new_2d(SIDE, SIDE, FORMAT));
    let mut read_back = graph.import_buffer("result", BufferDescriptor::new(bytes));
    let clear = LoadOp::Clear(wgpu::Color::BLACK);
    graph.raster_pass("disc").color(&mut image, clear).run(|context| {
        context.pass.set_pipeline(&disc);
        context.pass.draw(0..3, 0..1);
        Ok(())
    });
    graph.raster_pass("sobel").samples(&image).color(&mut edges, clear).run(|context| {
        // The texture is only available from here on, as the executor chose its memory for this frame.
        let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("image"),
            layout: &sobel.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::TextureView(context.resources.view(&image)?),
            }],
        });
        context.pass.set_pipeline(&sobel);
        context.pass.set_bind_group(0, &bind_group, &[]);
        context.pass.draw(0..3, 0..1);
        Ok(())
    });
    graph
        .transfer_pass("read back")
        .reads(&edges, TextureRead::CopySource)
        .writes(&mut read_back, BufferWrite::CopyDestination)
        .run(|context| {
            context.encoder.copy_texture_to_buffer(
                context.resources.texture(&edges)?.as_image_copy(),
                wgpu::TexelCopyBufferInfo {
                    buffer: context.resources.buffer(&read_back)?,
                    layout: wgpu::TexelCopyBufferLayout {
                        offset: 0,
                        bytes_per_row: Some(SIDE * 4),
                        rows_per_image: None,
                    },
                },
                wgpu::Extent3d { width: SIDE, height: SIDE, depth_or_array_layers: 1 },
            );
            Ok(())
        });

    let imports = Imports::new().buffer("result", &result);
    let frame = Executor::new().execute(&device, &queue, graph, &imports)?;
    result.map_async(wgpu::MapMode::Read, .., |_| {});
    device.poll(wgpu::PollType::wait_indefinitely())?;
    let texels: Vec<f32> = bytemuck::pod_collect_to_vec(&result.get_mapped_range(..)?);
    println!("{}", frame.plan.running().collect::<Vec<_>>().join(" -> "));
    println!("{} texels of edge", texels.iter().filter(|texel| **texel > 0.0).count());
    Ok(())
}

/// A pipeline that draws one triangle covering the whole target.
fn pipeline(device: &wgpu::Device, module: &wgpu::ShaderModule, fragment: &str) -> wgpu::RenderPipeline {
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(fragment),
        layout: None,
        vertex: wgpu::VertexState {
            module,
            entry_point: Some("corner"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: None,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(fragment),
            compilation_options: Default::default(),
            targets: &[Some(FORMAT.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
