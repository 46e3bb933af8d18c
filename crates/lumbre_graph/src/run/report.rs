//! What a frame measured: times, invocations, and the first value that is not finite. Data only.

use crate::resource::Label;

/// What to measure. Each has a cost; [`Measurements::OFF`] has none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Measurements {
    /// Time that recording each pass takes on the CPU.
    pub cpu: bool,
    /// Time that each pass takes on the GPU, where the device has `TIMESTAMP_QUERY`.
    pub gpu: bool,
    /// Vertex, fragment and compute invocations, where the device has `PIPELINE_STATISTICS_QUERY`.
    pub statistics: bool,
}

impl Measurements {
    /// Nothing.
    pub const OFF: Self = Self { cpu: false, gpu: false, statistics: false };
    /// Times only.
    pub const TIMES: Self = Self { cpu: true, gpu: true, statistics: false };
    /// Everything.
    pub const ALL: Self = Self { cpu: true, gpu: true, statistics: true };
}

impl Default for Measurements {
    fn default() -> Self {
        Self::TIMES
    }
}

/// Time on the GPU.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[serde(tag = "scope", rename_all = "snake_case")]
pub enum GpuTime {
    /// Not asked for, or the device can not tell.
    NotMeasured,
    /// Of this pass alone.
    Pass {
        /// Milliseconds.
        ms: f64,
    },
    /// Of a part of a render pass shared with others. On tile-based GPUs and software rasterizers, which draw all of
    /// a render pass tile by tile, this says little; to compare such passes switch merging off
    /// ([`Executor::set_merging`](crate::Executor::set_merging)).
    PartOfGroup {
        /// Milliseconds.
        ms: f64,
    },
    /// Of the whole group of merged passes, the same for each of them: the device has no
    /// `TIMESTAMP_QUERY_INSIDE_PASSES`.
    Group {
        /// Milliseconds.
        ms: f64,
    },
}

impl GpuTime {
    /// Milliseconds, whatever they are of.
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
    /// Of the vertex stage.
    pub vertex: u64,
    /// Of the fragment stage.
    pub fragment: u64,
    /// Of the compute stage.
    pub compute: u64,
}

/// Milliseconds on the CPU of one execution, stage after stage: each begins where the one before ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct ExecutionStages {
    /// Results of earlier frames that have arrived.
    pub collecting_ms: f64,
    /// Compiling the graph, or finding the plan of an equal one.
    pub planning_ms: f64,
    /// Memory of transient and retained resources, imports, queries.
    pub resources_ms: f64,
    /// The commands of all passes.
    pub recording_ms: f64,
    /// Handing them to the queue.
    pub submission_ms: f64,
    /// What is kept for the next frame.
    pub keeping_ms: f64,
}

impl ExecutionStages {
    /// All of them.
    #[must_use]
    pub fn total_ms(&self) -> f64 {
        let Self { collecting_ms, planning_ms, resources_ms, recording_ms, submission_ms, keeping_ms } = self;
        collecting_ms + planning_ms + resources_ms + recording_ms + submission_ms + keeping_ms
    }
}

/// What was measured of one pass.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct PassReport {
    /// The pass.
    pub name: Label,
    /// The part of the program that declared it, if the graph was told ([`Graph::set_owner`](crate::Graph::set_owner)).
    pub owner: Option<Label>,
    /// The wgpu pass of the frame it was in, from 0. Passes of the same group were merged.
    pub group: usize,
    /// Milliseconds that recording it took on the CPU.
    pub cpu_ms: Option<f64>,
    /// Time on the GPU.
    pub gpu: GpuTime,
    /// Shader invocations.
    pub invocations: Option<Invocations>,
}

/// The first value of a frame that is NaN or infinite.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct NonFinite {
    /// The first pass after which it was there.
    pub pass: Label,
    /// The texture that it is in.
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
    /// The texel, for looking at. (JSON has no NaN; they are `null` there.)
    pub value: [f32; 4],
}

/// What a frame measured, all of the same frame.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct GraphReport {
    /// The frame, counted from 1 by the executor.
    pub frame: u64,
    /// Milliseconds on the CPU until the frame was submitted: of the whole of `execute`, and of what came before it since
    /// `Executor::begun_at`.
    pub cpu_ms: Option<f64>,
    /// Milliseconds from the first pass's begin to the last one's end on the GPU.
    pub gpu_ms: Option<f64>,
    /// The passes that ran, in order.
    pub passes: Vec<PassReport>,
    /// The first value that is not finite, if the probe was on and found one.
    pub non_finite: Option<NonFinite>,
    /// Whether the probe was on and there was a texture that it could look at.
    pub probed: bool,
    /// What could not be measured, and why.
    pub notes: Vec<String>,
}

impl GraphReport {
    /// Milliseconds on the GPU of all passes, each wgpu pass counted once; `None` if none was measured. The rest of [`gpu_ms`](Self::gpu_ms) lies between them.
    #[must_use]
    pub fn passes_gpu_ms(&self) -> Option<f64> {
        let mut counted = None;
        let mut sum = None;
        for pass in &self.passes {
            let shared = matches!(pass.gpu, GpuTime::Group { .. });
            // The same time stands at every pass of the group, and these follow each other.
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
