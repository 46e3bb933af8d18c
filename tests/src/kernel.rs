//! A lighting function run on the GPU over a buffer of inputs: a compute kernel around one call. Not a judge of what comes out: that
//! is the caller's twin, with `running_error` for the bound.
//!
//! ```
//! use lumbre_tests::kernel::Kernel;
//!
//! let call = "return array<f32, 1>(lambert(vec3<f32>(x[0], x[1], x[2]), vec3<f32>(x[3], x[4], x[5])));";
//! let kernel = Kernel::new("lambert", &["lambert"], &[], 6, 1, call);
//! let gpu = lumbre_render::Gpu::headless().expect("a Vulkan driver; the software one will do");
//! let got = kernel.run(&gpu, &[0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, -1.0, 0.0]);
//! assert_eq!(got, [1.0, 0.0]);
//! ```

use std::borrow::Cow;
use std::path::Path;

use lumbre_render::Gpu;

/// Invocations of a workgroup, and the most workgroups that every device takes in a row.
const WORKGROUP: usize = 64;
const WORKGROUPS: usize = 65_535;

/// One function of `shaders/optics` as a compute kernel.
#[derive(Clone, Debug)]
pub struct Kernel {
    /// The whole program after imports and conditions, with `evaluate` as the call.
    pub wgsl: String,
    inputs: usize,
    outputs: usize,
}

impl Kernel {
    /// A kernel around a `call`: WESL statements that return an `array<f32, outputs>` from the numbers of `x`, an `array<f32, inputs>`.
    /// It knows the `imports` of the module `optics::module`, compiled with these `features` on and all others off.
    ///
    /// # Panics
    /// If it does not compile: the test that asks is wrong.
    pub fn new(
        module: &str,
        imports: &[&str],
        features: &[&str],
        inputs: usize,
        outputs: usize,
        call: &str,
    ) -> Self {
        let imports = imports.join(", ");
        let imports = match imports.contains("::") {
            true => imports.split(", ").map(|path| format!("import package::optics::{path};\n")).collect(),
            false => format!("import package::optics::{module}::{{{imports}}};\n"),
        };
        let source = format!(
            "{imports}
            @group(0) @binding(0) var<storage, read> input: array<f32>;
            @group(0) @binding(1) var<storage, read_write> output: array<f32>;
            fn evaluate(x: array<f32, {inputs}>) -> array<f32, {outputs}> {{ {call} }}
            @compute @workgroup_size({WORKGROUP})
            fn main(@builtin(global_invocation_id) id: vec3<u32>) {{
                if id.x >= arrayLength(&output) / {outputs}u {{ return; }}
                var x: array<f32, {inputs}>;
                for (var i = 0u; i < {inputs}u; i++) {{ x[i] = input[id.x * {inputs}u + i]; }}
                var result = evaluate(x);
                for (var i = 0u; i < {outputs}u; i++) {{ output[id.x * {outputs}u + i] = result[i]; }}
            }}"
        );
        let mut resolver = wesl::VirtualResolver::new();
        let shaders = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shaders/optics");
        let files = std::fs::read_dir(&shaders).unwrap_or_else(|error| panic!("{shaders:?}: {error}"));
        for file in files {
            let path = file.unwrap_or_else(|error| panic!("{shaders:?}: {error}")).path();
            let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path:?}: {error}"));
            resolver.add_module(module_path(&format!("optics::{name}")), Cow::Owned(text));
        }
        resolver.add_module(module_path("kernel"), Cow::Owned(source));
        let mut compiler = wesl::Wesl::new_barebones().set_custom_resolver(resolver);
        compiler.set_mangler(wesl::ManglerKind::Escape).set_options(wesl::CompileOptions {
            imports: true,
            condcomp: true,
            strip: true,
            lazy: true,
            ..Default::default()
        });
        for feature in features {
            compiler.set_feature(feature, true);
        }
        match compiler.compile(&module_path("kernel")) {
            Ok(program) => Self { wgsl: program.to_string(), inputs, outputs },
            Err(error) => panic!("{module}: {error}"),
        }
    }

    /// The function over many inputs, `inputs` numbers each; `outputs` numbers come back for each.
    ///
    /// # Panics
    /// If the device refuses: a test that cannot run has failed.
    pub fn run(&self, gpu: &Gpu, input: &[f32]) -> Vec<f32> {
        assert_eq!(input.len() % self.inputs, 0, "inputs come in groups of {}", self.inputs);
        let chunk = WORKGROUP * WORKGROUPS * self.inputs;
        input.chunks(chunk).flat_map(|part| self.run_once(gpu, part)).collect()
    }

    fn run_once(&self, gpu: &Gpu, input: &[f32]) -> Vec<f32> {
        let device = &gpu.device;
        let count = input.len() / self.inputs;
        let bytes = (count * self.outputs * size_of::<f32>()) as u64;
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("kernel"),
            source: wgpu::ShaderSource::Wgsl(Cow::Borrowed(&self.wgsl)),
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("kernel"),
            layout: None,
            module: &module,
            entry_point: Some("main"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        let buffer = |size, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        let usages = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        let source = buffer((input.len() * size_of::<f32>()) as u64, usages);
        gpu.queue.write_buffer(&source, 0, bytemuck::cast_slice(input));
        let target = buffer(bytes, wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
        let readable = buffer(bytes, wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
        let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: source.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: target.as_entire_binding() },
            ],
        });
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &bind_group, &[]);
            pass.dispatch_workgroups(count.div_ceil(WORKGROUP) as u32, 1, 1);
        }
        encoder.copy_buffer_to_buffer(&target, 0, &readable, 0, bytes);
        gpu.queue.submit([encoder.finish()]);
        readable.slice(..).map_async(wgpu::MapMode::Read, |_| {});
        device.poll(wgpu::PollType::wait_indefinitely()).unwrap_or_else(|error| panic!("{error}"));
        gpu.check().unwrap_or_else(|error| panic!("{error}"));
        let view = readable.slice(..).get_mapped_range().unwrap_or_else(|error| panic!("{error}"));
        bytemuck::pod_collect_to_vec(&view)
    }
}

fn module_path(path: &str) -> wesl::syntax::ModulePath {
    let path = format!("package::{path}");
    path.parse().unwrap_or_else(|error| panic!("{path}: {error}"))
}
