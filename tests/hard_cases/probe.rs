//! The probe itself: it finds injected values, by pass and pixel, and no frame of a test is drawn without it.

use std::path::Path;

use lumbre_optics::Material;
use lumbre_render::{FrameOptions, Offscreen, OffscreenFormat, Renderer};
use lumbre_tests::panes::pane_of;

use crate::adapter::{gpu, linear};
use crate::case::Outcome;

crate::cases! {
    "NaN in any frame" {
        an_injected_nan_is_named, an_injected_infinity_is_named, an_injected_nan_among_samples_is_named,
        a_clean_overlay_is_not, no_frame_of_a_test_goes_past_the_probe,
    }
}

/// Returns what the probe reports for a frame over which an overlay writes this WGSL expression at (5, 3) and 0.5
/// elsewhere.
fn probed(value: &str, options: &FrameOptions) -> String {
    let gpu = gpu();
    let frame = Offscreen::new(gpu, 16, 16, OffscreenFormat::LinearFloat).unwrap();
    let source = format!(
        "@vertex fn vertex(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {{
            return vec4<f32>(vec2<f32>(f32((i << 1u) & 2u), f32(i & 2u)) * 2.0 - 1.0, 0.0, 1.0);
        }}
        @fragment fn fragment(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {{
            let pixel = vec2<u32>(at.xy);
            // A number that the compiler does not know.
            let one = select(0u, 1u, pixel.x == 5u);
            return vec4<f32>(0.5, select(0.5, {value}, all(pixel == vec2<u32>(5u, 3u))), 0.5, 1.0);
        }}"
    );
    let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("injection"),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let pipeline = gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("injection"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: None,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("fragment"),
            compilation_options: Default::default(),
            targets: &[Some(wgpu::TextureFormat::Rgba32Float.into())],
        }),
        multiview_mask: None,
        cache: None,
    });
    let mut renderer = Renderer::new(gpu);
    let mut world = pane_of(Material::default());
    renderer
        .render_with_overlay(&mut world, &frame.target(), options, |pass| {
            pass.set_pipeline(&pipeline);
            pass.draw(0..3, 0..1);
        })
        .unwrap();
    let measured = renderer.wait().unwrap().unwrap();
    match &measured.non_finite {
        None => format!("nothing, probed: {}", measured.probed),
        Some(found) => {
            let kind = if found.value[1].is_nan() { "NaN" } else { "Inf" };
            format!("{kind} after {}, in {} at ({}, {})", found.pass, found.resource, found.x, found.y)
        }
    }
}

const NAN: &str = "bitcast<f32>(0x7fc00000u * one)";

fn an_injected_nan_is_named() -> Outcome {
    Outcome::text("NaN after overlay, in target at (5, 3)", probed(NAN, &linear()))
}

fn an_injected_infinity_is_named() -> Outcome {
    Outcome::text(
        "Inf after overlay, in target at (5, 3)",
        probed("bitcast<f32>(0x7f800000u * one)", &linear()),
    )
}

fn an_injected_nan_among_samples_is_named() -> Outcome {
    let options = FrameOptions { multisample: Some(true), ..linear() };
    Outcome::text("NaN after overlay, in target at (5, 3)", probed(NAN, &options))
}

fn a_clean_overlay_is_not() -> Outcome {
    Outcome::text("nothing, probed: true", probed("f32(one)", &linear()))
}

/// `adapter.rs` always draws with the probe on and fails if it finds anything. This checks that nothing else draws,
/// except for files that need their own renderers: they inject values, lose devices, add effects, compare renderers
/// with different histories, draw frames without a linear frame to inspect, or (the shadows') switch the probe on
/// themselves.
fn no_frame_of_a_test_goes_past_the_probe() -> Outcome {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut past = Vec::new();
    let mut files = 0;
    for folder in ["frames", "hard_cases"] {
        for file in std::fs::read_dir(root.join(folder)).unwrap() {
            let path = file.unwrap().path();
            let name = format!("{folder}/{}", path.file_name().unwrap().to_string_lossy());
            let allowed = [
                "frames/accounting.rs",
                "frames/adapter.rs",
                "frames/constant_colors.rs",
                "frames/display.rs",
                "frames/effects_table.rs",
                "frames/explained.rs",
                "frames/missing_pipelines.rs",
                "frames/own_effects.rs",
                "frames/rendering_paths.rs",
                "frames/shadows.rs",
                "frames/unchanged.rs",
                "hard_cases/probe.rs",
                "hard_cases/frames.rs",
            ];
            files += 1;
            let text = std::fs::read_to_string(&path).unwrap();
            if !allowed.contains(&&*name) && (text.contains("Renderer::new") || text.contains(".render(")) {
                past.push(name);
            }
        }
    }
    assert!(files > 20, "{files} files are too few to be the tests");
    Outcome::text(
        "all through adapter.rs",
        if past.is_empty() { "all through adapter.rs".to_owned() } else { past.join(", ") },
    )
}
