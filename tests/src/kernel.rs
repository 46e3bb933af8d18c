//! Runs a lighting function on the GPU over a buffer of inputs, with a compute kernel around one call. The results
//! are checked by the caller, against the f64 twin and with `running_error` for the bound.
//!
//! Inputs and results are passed as bits, so that neither compiler nor driver can assume that there are no NaNs,
//! and results that were never written can be distinguished from those that were.
//!
//! ```
//! use lumbre_tests::kernel::{Kernel, Type};
//!
//! let kernel = Kernel::of("lambert", "lambert", &[], &[Type::Vector, Type::Vector], Type::Number);
//! let gpu = lumbre_render::Gpu::headless().expect("a Vulkan driver; the software one will do");
//! let got = kernel.run(&gpu, &[0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, -1.0, 0.0]);
//! assert_eq!(got, [1.0, 0.0]);
//! ```

use std::borrow::Cow;
use std::path::Path;

use lumbre_render::Gpu;
use lumbre_shaders::{Kept, Program, UnnamedFeatures};

/// Invocations of a workgroup, and the largest number of workgroups in one dimension that every device supports.
const WORKGROUP: usize = 64;
const WORKGROUPS: usize = 65_535;

/// Initial content of the result buffer: a NaN with a payload that no arithmetic produces.
const UNWRITTEN: u32 = 0x7fc0_dead;

/// The type of an argument or result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Type {
    /// `f32`.
    Number,
    /// `vec3<f32>`.
    Vector,
    /// `vec4<f32>`.
    Vector4,
    /// `bool`, passed as 0 or 1.
    Flag,
}

impl Type {
    /// Returns how many numbers of a buffer it occupies.
    pub fn size(self) -> usize {
        match self {
            Self::Number | Self::Flag => 1,
            Self::Vector => 3,
            Self::Vector4 => 4,
        }
    }

    /// Returns the WGSL expression that reads an argument starting at an index of `x`.
    fn read(self, at: usize) -> String {
        match self {
            Self::Number => format!("x[{at}]"),
            Self::Vector => format!("vec3<f32>(x[{at}], x[{}], x[{}])", at + 1, at + 2),
            Self::Vector4 => format!("vec4<f32>(x[{at}], x[{}], x[{}], x[{}])", at + 1, at + 2, at + 3),
            Self::Flag => format!("x[{at}] > 0.5"),
        }
    }

    /// Returns the WGSL expressions of the numbers of a result called `r`.
    fn write(self) -> &'static str {
        match self {
            Self::Number => "r",
            Self::Vector => "r.x, r.y, r.z",
            Self::Vector4 => "r.x, r.y, r.z, r.w",
            Self::Flag => "select(0.0, 1.0, r)",
        }
    }
}

/// A compute kernel around one function of `shaders/optics`.
#[derive(Clone, Debug)]
pub struct Kernel {
    /// The whole program after resolving imports and conditions, with `evaluate` as the call.
    pub wgsl: String,
    /// The program before resolving imports and conditions.
    source: String,
    features: Vec<String>,
    inputs: usize,
    outputs: usize,
}

impl Kernel {
    /// Creates a kernel around a `function` of the module `optics::module` with arguments of these types, one after
    /// the other.
    ///
    /// # Panics
    /// As [`Kernel::new`].
    pub fn of(module: &str, function: &str, features: &[&str], arguments: &[Type], result: Type) -> Self {
        let mut size = 0;
        let passed: Vec<String> = arguments
            .iter()
            .map(|argument| {
                size += argument.size();
                argument.read(size - argument.size())
            })
            .collect();
        let (passed, outputs) = (passed.join(", "), result.size());
        let call = format!("let r = {function}({passed}); return array<f32, {outputs}>({});", result.write());
        Self::new(module, &[function], features, size, outputs, &call)
    }

    /// Creates a kernel around a `call`: WESL statements that return an `array<f32, outputs>` computed from `x`, an
    /// `array<f32, inputs>`. They can use the `imports` of the module `optics::module`, compiled with these
    /// `features` on and all others off. Imports from another module than one of `optics` are given as one path from
    /// `package::` on.
    ///
    /// # Panics
    /// If it does not compile: the test itself is wrong.
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
            true if imports.starts_with("package::") => format!("import {imports};\n"),
            true => imports.split(", ").map(|path| format!("import package::optics::{path};\n")).collect(),
            false => format!("import package::optics::{module}::{{{imports}}};\n"),
        };
        let source = format!(
            "{imports}
            @group(0) @binding(0) var<storage, read> input: array<u32>;
            @group(0) @binding(1) var<storage, read_write> output: array<u32>;
            fn evaluate(x: array<f32, {inputs}>) -> array<f32, {outputs}> {{ {call} }}
            @compute @workgroup_size({WORKGROUP})
            fn main(@builtin(global_invocation_id) id: vec3<u32>) {{
                if id.x >= arrayLength(&output) / {outputs}u {{ return; }}
                var x: array<f32, {inputs}>;
                for (var i = 0u; i < {inputs}u; i++) {{ x[i] = bitcast<f32>(input[id.x * {inputs}u + i]); }}
                var result = evaluate(x);
                for (var i = 0u; i < {outputs}u; i++) {{ output[id.x * {outputs}u + i] = bitcast<u32>(result[i]); }}
            }}"
        );
        let features: Vec<String> = features.iter().map(|feature| (*feature).to_owned()).collect();
        let wgsl = compile(&source, &features, |_, text| text);
        Self { wgsl, source, features, inputs, outputs }
    }

    /// Returns the same kernel with a changed shader: in the module `optics::module`, or in one that is given from
    /// `package::` on, `from` is replaced by `to`.
    /// For tests of the tests.
    ///
    /// # Panics
    /// If the module does not contain `from`, or does not compile any more.
    pub fn mutated(&self, module: &str, from: &str, to: &str) -> Self {
        let wgsl = compile(&self.source, &self.features, |name, text| {
            if name != module {
                return text;
            }
            assert!(text.contains(from), "{module} has no {from:?}");
            text.replace(from, to)
        });
        Self { wgsl, ..self.clone() }
    }

    /// Number of numbers in one input.
    pub fn inputs(&self) -> usize {
        self.inputs
    }

    /// Number of numbers in one result.
    pub fn outputs(&self) -> usize {
        self.outputs
    }

    /// Evaluates the function for many inputs of `inputs` numbers each. Returns `outputs` numbers for each.
    ///
    /// # Panics
    /// If the device fails or leaves a result unwritten.
    pub fn run(&self, gpu: &Gpu, input: &[f32]) -> Vec<f32> {
        assert_eq!(input.len() % self.inputs, 0, "inputs come in groups of {}", self.inputs);
        let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("kernel"),
            source: wgpu::ShaderSource::Wgsl(Cow::Borrowed(&self.wgsl)),
        });
        let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("kernel"),
            layout: None,
            module: &module,
            entry_point: Some("main"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        let limits = gpu.device.limits();
        let bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let numbers = usize::try_from(bytes).unwrap_or(usize::MAX) / size_of::<f32>();
        let count = (WORKGROUP * WORKGROUPS).min(numbers / self.inputs.max(self.outputs));
        input.chunks(count * self.inputs).flat_map(|part| self.run_once(gpu, &pipeline, part)).collect()
    }

    fn run_once(&self, gpu: &Gpu, pipeline: &wgpu::ComputePipeline, input: &[f32]) -> Vec<f32> {
        let device = &gpu.device;
        let count = input.len() / self.inputs;
        let bytes = (count * self.outputs * size_of::<f32>()) as u64;
        let buffer = |size, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        let written = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        let source = buffer(size_of_val(input) as u64, written);
        gpu.queue.write_buffer(&source, 0, bytemuck::cast_slice(input));
        let target = buffer(bytes, written | wgpu::BufferUsages::COPY_SRC);
        gpu.queue.write_buffer(&target, 0, bytemuck::cast_slice(&vec![UNWRITTEN; count * self.outputs]));
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
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &bind_group, &[]);
            pass.dispatch_workgroups(count.div_ceil(WORKGROUP) as u32, 1, 1);
        }
        encoder.copy_buffer_to_buffer(&target, 0, &readable, 0, bytes);
        gpu.queue.submit([encoder.finish()]);
        readable.slice(..).map_async(wgpu::MapMode::Read, |_| {});
        device.poll(wgpu::PollType::wait_indefinitely()).unwrap_or_else(|error| panic!("{error}"));
        gpu.check().unwrap_or_else(|error| panic!("{error}"));
        let view = readable.slice(..).get_mapped_range().unwrap_or_else(|error| panic!("{error}"));
        let bits: Vec<u32> = bytemuck::pod_collect_to_vec(&view);
        assert!(!bits.contains(&UNWRITTEN), "the kernel left results unwritten");
        bits.into_iter().map(f32::from_bits).collect()
    }
}

/// Compiles the program with the modules of `shaders`, each as `edit` returns it for its name and text. The names
/// of those that are not in `optics` begin with `package::`.
fn compile(source: &str, features: &[String], edit: impl Fn(&str, String) -> String) -> String {
    let mut modules = vec![("kernel".to_owned(), source.to_owned())];
    for (folder, prefix) in [("", "package::"), ("optics/", "")] {
        let shaders = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shaders").join(folder);
        let files = std::fs::read_dir(&shaders).unwrap_or_else(|error| panic!("{shaders:?}: {error}"));
        for file in files {
            let path = file.unwrap_or_else(|error| panic!("{shaders:?}: {error}")).path();
            if path.extension().is_none_or(|extension| extension != "wesl") {
                continue;
            }
            let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path:?}: {error}"));
            let text = edit(&format!("{prefix}{name}"), text);
            modules.push((format!("{folder}{name}"), text));
        }
    }
    let modules: Vec<_> =
        modules.iter().map(|(path, text)| (path.as_str(), Cow::Borrowed(text.as_str()))).collect();
    let features: Vec<_> = features.iter().map(|feature| (feature.as_str(), true)).collect();
    let program = Program {
        modules: &modules,
        root: "kernel",
        features: &features,
        unnamed: UnnamedFeatures::AreOff,
        kept: Kept::EntryPoints,
    };
    program.to_wgsl().unwrap_or_else(|error| panic!("{error}\n{source}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gpu() -> Gpu {
        Gpu::headless().expect("a Vulkan driver; the software one will do")
    }

    #[test]
    fn nan_and_infinity_arrive() {
        let call =
            "return array<f32, 2>(x[0] / x[1], sqrt(x[0]) + lambert(vec3<f32>(x[1]), vec3<f32>(0.0)));";
        let kernel = Kernel::new("lambert", &["lambert"], &[], 2, 2, call);
        let got = kernel.run(&gpu(), &[0.0, 0.0, 1.0, 0.0, -1.0, 1.0]);
        assert!(got[0].is_nan() && got[1] == 0.0, "{got:?}");
        assert!(got[2] == f32::INFINITY && got[3] == 1.0, "{got:?}");
        assert!(got[4] == -1.0 && got[5].is_nan(), "{got:?}");
    }

    #[test]
    fn more_inputs_than_one_dispatch_takes_keep_their_order() {
        let call = "return array<f32, 1>(lambert(vec3<f32>(x[0]), vec3<f32>(1.0, 0.0, 0.0)));";
        let kernel = Kernel::new("lambert", &["lambert"], &[], 1, 1, call);
        let count = WORKGROUP * WORKGROUPS + 1000;
        // Multiples of 2⁻²³ up to 1/2 are exact in f32 and pass unrounded.
        let input: Vec<f32> = (0..count).map(|i| i as f32 / (1 << 23) as f32).collect();
        assert_eq!(kernel.run(&gpu(), &input), input);
    }
}
