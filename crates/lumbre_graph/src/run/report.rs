//! What a frame measured: times, invocations, and the first value that is not finite. Data only.

use crate::resource::Label;

/// What to measure. Each measurement has a cost; [`Measurements::OFF`] has none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Measurements {
    /// Time for recording each pass on the CPU.
    pub cpu: bool,
    /// Time of each pass on the GPU, if the device has `TIMESTAMP_QUERY`.
    pub gpu: bool,
    /// Vertex, fragment and compute invocations, if the device has `PIPELINE_STATISTICS_QUERY`.
    pub statistics: bool,
}

impl Measurements {
    /// Measures nothing.
    pub const OFF: Self = Self { cpu: false, gpu: false, statistics: false };
    /// Measures times only.
    pub const TIMES: Self = Self { cpu: true, gpu: true, statistics: false };
    /// Measures everything.
    pub const ALL: Self = Self { cpu: true, gpu: true, statistics: true };
}

impl Default for Measurements {
    fn default() -> Self {
        Self::TIMES
    }
}

/// Time on the GPU, and what it is the time of.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[serde(tag = "scope", rename_all = "snake_case")]
pub enum GpuTime {
    /// Not requested, or the device cannot measure it.
    NotMeasured,
    /// Of this pass alone.
    Pass {
        /// Milliseconds.
        ms: f64,
    },
    /// Of one part of a render pass that is shared with others. On tile-based GPUs and software rasterizers, which
    /// draw a whole render pass tile by tile, this means little; to compare such passes switch merging off
    /// ([`Executor::set_merging`](crate::Executor::set_merging)).
    PartOfGroup {
        /// Milliseconds.
        ms: f64,
    },
    /// Of a whole group of merged passes, and the same for each of them, because the device has no
    /// `TIMESTAMP_QUERY_INSIDE_PASSES`.
    Group {
        /// Milliseconds.
        ms: f64,
    },
}

impl GpuTime {
    /// Returns the milliseconds, regardless of what they are the time of.
    #[must_use]
    pub fn ms(self) -> Option<f64> {
        match self {
            Self::NotMeasured => None,
            Self::Pass { ms } | Self::PartOfGroup { ms } | Self::Group { ms } => Some(ms),
        }
    }
}

/// Shader invocations of one pass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Invocations {
    /// Invocations of the vertex stage.
    pub vertex: u64,
    /// Invocations of the fragment stage.
    pub fragment: u64,
    /// Invocations of the compute stage.
    pub compute: u64,
}

/// CPU time in milliseconds of the stages of one execution; each begins where the previous one ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct ExecutionStages {
    /// Collecting the results of earlier frames that have arrived.
    pub collecting_ms: f64,
    /// Compiling the graph, or finding the plan of an equal one.
    pub planning_ms: f64,
    /// Providing transient and retained resources, imports and queries.
    pub resources_ms: f64,
    /// Recording the commands of all passes.
    pub recording_ms: f64,
    /// Submitting the commands to the queue.
    pub submission_ms: f64,
    /// Updating what is kept for the next frame.
    pub keeping_ms: f64,
}

impl ExecutionStages {
    /// Returns the sum of all stages.
    #[must_use]
    pub fn total_ms(&self) -> f64 {
        let Self { collecting_ms, planning_ms, resources_ms, recording_ms, submission_ms, keeping_ms } = self;
        collecting_ms + planning_ms + resources_ms + recording_ms + submission_ms + keeping_ms
    }
}

/// What was measured for one pass.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct PassReport {
    /// The pass's name.
    pub name: Label,
    /// The part of the program that declared it, if the graph knows it
    /// ([`Graph::set_owner`](crate::Graph::set_owner)).
    pub owner: Option<Label>,
    /// Index of its wgpu pass in the frame, from 0. Passes of the same group were merged.
    pub group: usize,
    /// Milliseconds for recording it on the CPU.
    pub cpu_ms: Option<f64>,
    /// Time on the GPU.
    pub gpu: GpuTime,
    /// Shader invocations.
    pub invocations: Option<Invocations>,
}

/// The first value of a frame that is NaN or infinite.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct NonFinite {
    /// The first pass after which the value was there.
    pub pass: Label,
    /// The texture that contains it.
    pub resource: Label,
    /// Mip level.
    pub mip: u32,
    /// Array layer.
    pub layer: u32,
    /// Column of the first such texel in reading order, from the left.
    pub x: u32,
    /// Row, from the top.
    pub y: u32,
    /// Sample within the texel, 0 unless multisampled.
    pub sample: u32,
    /// The texel's value. (JSON has no NaN; such channels are `null` there.)
    pub value: [f32; 4],
}

/// What was measured in one frame.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct GraphReport {
    /// The number of the frame, counted from 1 by the executor.
    pub frame: u64,
    /// CPU time in milliseconds until the frame was submitted: all of `execute`, and the time before it since
    /// `Executor::begun_at`.
    pub cpu_ms: Option<f64>,
    /// GPU time in milliseconds from the beginning of the first pass to the end of the last one.
    pub gpu_ms: Option<f64>,
    /// The passes that ran, in order.
    pub passes: Vec<PassReport>,
    /// The first value that is not finite, if the probe was on and found one.
    pub non_finite: Option<NonFinite>,
    /// Whether the probe was on and there was a texture that it could inspect.
    pub probed: bool,
    /// What could not be measured, and why.
    pub notes: Vec<String>,
}

impl GraphReport {
    /// Returns the GPU time in milliseconds of all passes, with each wgpu pass counted once; `None` if none was
    /// measured. The rest of [`gpu_ms`](Self::gpu_ms) is spent between them.
    #[must_use]
    pub fn passes_gpu_ms(&self) -> Option<f64> {
        let mut counted = None;
        let mut sum = None;
        for pass in &self.passes {
            let shared = matches!(pass.gpu, GpuTime::Group { .. });
            // All passes of the group have the same time, and they are consecutive.
            if shared && counted == Some(pass.group) {
                continue;
            }
            counted = Some(pass.group);
            sum = match pass.gpu.ms() {
                Some(ms) => Some(sum.unwrap_or(0.0) + ms),
                None => sum,
            };
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_of_a_group_counts_once() {
        let pass = |group, gpu| PassReport {
            name: "pass".into(),
            owner: None,
            group,
            cpu_ms: None,
            gpu,
            invocations: None,
        };
        let of = |passes: Vec<PassReport>| GraphReport { passes, ..GraphReport::default() }.passes_gpu_ms();
        assert_eq!(of(vec![]), None);
        assert_eq!(of(vec![pass(0, GpuTime::NotMeasured)]), None);
        let group = GpuTime::Group { ms: 4.0 };
        let (alone, part) = (GpuTime::Pass { ms: 1.0 }, GpuTime::PartOfGroup { ms: 0.5 });
        assert_eq!(of(vec![pass(0, group), pass(0, group), pass(1, alone)]), Some(5.0));
        assert_eq!(of(vec![pass(0, group), pass(1, group)]), Some(8.0));
        assert_eq!(
            of(vec![pass(0, part), pass(0, part), pass(1, alone), pass(2, GpuTime::NotMeasured)]),
            Some(2.0)
        );
    }
}
