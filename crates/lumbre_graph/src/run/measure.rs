//! Queries and the readback of their results. Results arrive some frames later through a ring of buffers, so that
//! measuring never makes the CPU wait unless the caller wants to.

use crate::run::map_request::{MapRequest, MapState};
use crate::run::probe::{self, Probed};
use crate::run::report::{GpuTime, GraphReport, Invocations, Measurements};

/// Number of frames whose results may be in flight at once. Further frames are not measured on the GPU.
const RING: usize = 4;

/// The statistics that are counted, in the order of their results in memory (that of the flags' bits).
const STATISTICS: wgpu::PipelineStatisticsTypes = wgpu::PipelineStatisticsTypes::VERTEX_SHADER_INVOCATIONS
    .union(wgpu::PipelineStatisticsTypes::FRAGMENT_SHADER_INVOCATIONS)
    .union(wgpu::PipelineStatisticsTypes::COMPUTE_SHADER_INVOCATIONS);
const STATISTICS_BYTES: u64 = 3 * 8;

/// The queries of one frame, and what they belong to.
pub(crate) struct FrameQueries {
    pub timestamps: Option<wgpu::QuerySet>,
    pub statistics: Option<wgpu::QuerySet>,
    capacity: [u32; 2],
    resolve: Option<wgpu::Buffer>,
    readback: Option<wgpu::Buffer>,
    /// Numbers of timestamp and statistics queries used in this frame.
    used: [u32; 2],
    /// Whether timestamps can be written inside passes, and on the encoder.
    pub inside_passes: bool,
    pub inside_encoders: bool,
    /// For each pass of the report its first and last timestamp, and what they enclose.
    pub spans: Vec<Option<(u32, u32, Scope)>>,
    /// For each pass of the report its statistics query.
    pub counts: Vec<Option<u32>>,
    pub probed: Vec<Probed>,
    pub report: GraphReport,
    request: MapRequest,
}

/// What lies between two timestamps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scope {
    Pass,
    PartOfGroup,
    Group,
}

impl FrameQueries {
    fn empty() -> Self {
        Self {
            timestamps: None,
            statistics: None,
            capacity: [0; 2],
            resolve: None,
            readback: None,
            used: [0; 2],
            inside_passes: false,
            inside_encoders: false,
            spans: Vec::new(),
            counts: Vec::new(),
            probed: Vec::new(),
            report: GraphReport::default(),
            request: MapRequest::default(),
        }
    }

    /// Allocates a timestamp query, if one is left.
    pub fn timestamp(&mut self) -> Option<u32> {
        take(&mut self.used[0], self.capacity[0])
    }

    /// Allocates a statistics query, if one is left.
    pub fn statistic(&mut self) -> Option<u32> {
        take(&mut self.used[1], self.capacity[1])
    }

    fn prepare(&mut self, device: &wgpu::Device, measure: Measurements, passes: u32, steps: u32) {
        let features = device.features();
        let has = |feature: wgpu::Features| features.contains(feature);
        // Each step needs one more timestamp than it has passes.
        let stamps = passes.saturating_add(steps);
        let want = [
            if measure.gpu && has(wgpu::Features::TIMESTAMP_QUERY) { stamps } else { 0 },
            if measure.statistics && has(wgpu::Features::PIPELINE_STATISTICS_QUERY) { passes } else { 0 },
        ];
        let most = wgpu::QUERY_SET_MAX_QUERIES;
        self.used = [0; 2];
        self.inside_passes = has(wgpu::Features::TIMESTAMP_QUERY_INSIDE_PASSES);
        self.inside_encoders = has(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS);
        self.spans.clear();
        self.counts.clear();
        self.probed.clear();
        self.report = GraphReport::default();
        if measure.gpu && want[0] == 0 && passes > 0 {
            self.report.notes.push("no GPU times: the device was made without TIMESTAMP_QUERY".into());
        }
        if measure.statistics && want[1] == 0 && passes > 0 {
            self.report
                .notes
                .push("no invocation counts: the device was made without PIPELINE_STATISTICS_QUERY".into());
        }
        let types = [wgpu::QueryType::Timestamp, wgpu::QueryType::PipelineStatistics(STATISTICS)];
        for (at, (set, ty)) in [&mut self.timestamps, &mut self.statistics].into_iter().zip(types).enumerate()
        {
            let count = want[at].min(most);
            if want[at] > most {
                self.report.notes.push(format!("only the first {most} queries of {} are made", want[at]));
            }
            if count == 0 {
                *set = None;
                self.capacity[at] = 0;
            } else if self.capacity[at] < count || set.is_none() {
                *set = Some(device.create_query_set(&wgpu::QuerySetDescriptor {
                    label: Some("graph queries"),
                    ty,
                    count,
                }));
                self.capacity[at] = count;
            }
        }
    }

    /// Bytes of timestamps, statistics and probe results in the readback buffer; the first two are aligned so that
    /// a resolve may begin after them.
    fn layout(&self) -> [u64; 3] {
        let align = |bytes: u64| bytes.next_multiple_of(wgpu::QUERY_RESOLVE_BUFFER_ALIGNMENT);
        [
            align(u64::from(self.used[0]) * u64::from(wgpu::QUERY_SIZE)),
            align(u64::from(self.used[1]) * STATISTICS_BYTES),
            self.probed.len() as u64 * probe::STRIDE,
        ]
    }

    /// Records the resolve and readback of everything that was measured. Returns true if anything was.
    pub fn resolve(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        probe_results: Option<&wgpu::Buffer>,
    ) -> bool {
        let layout = self.layout();
        let total: u64 = layout.iter().sum();
        if total == 0 {
            return false;
        }
        let grow = |held: &mut Option<wgpu::Buffer>, usage: wgpu::BufferUsages| {
            if held.as_ref().is_none_or(|held| held.size() < total) {
                *held = Some(device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some("graph measurements"),
                    size: total,
                    usage,
                    mapped_at_creation: false,
                }));
            }
        };
        grow(&mut self.resolve, wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC);
        grow(&mut self.readback, wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
        let (Some(resolve), Some(readback)) = (&self.resolve, &self.readback) else { return false };
        let queries = layout[0] + layout[1];
        if let Some(set) = self.timestamps.as_ref().filter(|_| self.used[0] > 0) {
            encoder.resolve_query_set(set, 0..self.used[0], resolve, 0);
        }
        if let Some(set) = self.statistics.as_ref().filter(|_| self.used[1] > 0) {
            encoder.resolve_query_set(set, 0..self.used[1], resolve, layout[0]);
        }
        if queries > 0 {
            encoder.copy_buffer_to_buffer(resolve, 0, readback, 0, queries);
        }
        if let Some(results) = probe_results.filter(|_| layout[2] > 0) {
            encoder.copy_buffer_to_buffer(results, 0, readback, queries, layout[2]);
        }
        true
    }

    /// Requests the results, after the submission.
    fn send_for(&mut self) {
        if let Some(readback) = &self.readback {
            self.request = MapRequest::new(readback);
        }
    }

    /// Returns the report with the results that arrived.
    fn read(&mut self, period: f64) -> GraphReport {
        let mut report = std::mem::take(&mut self.report);
        let layout = self.layout();
        let Some(readback) = &self.readback else { return report };
        if self.request.state() == MapState::Failed {
            report.notes.push("the measurements of this frame were lost on their way back".into());
            return report;
        }
        match readback.get_mapped_range(..) {
            Ok(bytes) => {
                let stamps = words(&bytes[..layout[0] as usize]);
                self.times(&mut report, &stamps, period);
                let start = layout[0] as usize;
                let counts = words(&bytes[start..start + layout[1] as usize]);
                for (pass, query) in report.passes.iter_mut().zip(&self.counts) {
                    let values = query.map(|query| &counts[query as usize * 3..][..3]);
                    pass.invocations = values.map(|values| Invocations {
                        vertex: values[0],
                        fragment: values[1],
                        compute: values[2],
                    });
                }
                let start = start + layout[1] as usize;
                report.non_finite = probe::first(&self.probed, &bytes[start..start + layout[2] as usize]);
            }
            Err(error) => report.notes.push(format!("the measurements could not be read: {error}")),
        }
        readback.unmap();
        report
    }

    fn times(&self, report: &mut GraphReport, stamps: &[u64], period: f64) {
        // If the clock was reset between two timestamps, the time is 0 and not a huge number.
        let ms = |from: u64, to: u64| to.saturating_sub(from) as f64 * period * 1e-6;
        for (pass, span) in report.passes.iter_mut().zip(&self.spans) {
            let Some((from, to, scope)) = *span else { continue };
            let ms = ms(stamps[from as usize], stamps[to as usize]);
            pass.gpu = match scope {
                Scope::Pass => GpuTime::Pass { ms },
                Scope::PartOfGroup => GpuTime::PartOfGroup { ms },
                Scope::Group => GpuTime::Group { ms },
            };
        }
        let spans = || self.spans.iter().flatten();
        let first = spans().map(|&(from, ..)| stamps[from as usize]).min();
        let last = spans().map(|&(_, to, _)| stamps[to as usize]).max();
        report.gpu_ms = first.zip(last).map(|(first, last)| ms(first, last));
    }
}

fn take(used: &mut u32, capacity: u32) -> Option<u32> {
    let index = *used;
    (index < capacity).then(|| {
        *used += 1;
        index
    })
}

fn words(bytes: &[u8]) -> Vec<u64> {
    bytes.as_chunks().0.iter().map(|word| u64::from_le_bytes(*word)).collect()
}

/// Frames whose results are in flight.
#[derive(Default)]
pub(crate) struct Ring {
    free: Vec<FrameQueries>,
    /// Oldest first.
    waiting: Vec<FrameQueries>,
}

impl Ring {
    /// Returns the queries for a frame. If too many frames are in flight, it is not measured on the GPU.
    pub fn begin(
        &mut self,
        device: &wgpu::Device,
        measure: Measurements,
        passes: usize,
        steps: usize,
    ) -> FrameQueries {
        let mut queries = self.free.pop().unwrap_or_else(FrameQueries::empty);
        let full = self.waiting.len() >= RING;
        let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        let measure = if full { Measurements { cpu: measure.cpu, ..Measurements::OFF } } else { measure };
        queries.prepare(device, measure, count(passes), count(steps));
        if full {
            queries.report.notes.push(format!("not measured: {RING} earlier frames are still on the GPU"));
        }
        queries
    }

    /// Requests a frame's results after its submission, or returns its report at once if there are none to wait
    /// for.
    pub fn end(&mut self, mut queries: FrameQueries, to_wait_for: bool) -> Option<GraphReport> {
        if to_wait_for {
            queries.send_for();
            self.waiting.push(queries);
            return None;
        }
        let report = std::mem::take(&mut queries.report);
        self.free.push(queries);
        Some(report)
    }

    /// Returns true if the results of any frame are in flight.
    pub fn is_waiting(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Returns true if one more frame may be probed.
    pub fn has_room(&self) -> bool {
        self.waiting.len() < RING
    }

    /// Waits for the answers to all requests, after the device was polled to the end.
    pub fn wait(&self) {
        for frame in &self.waiting {
            if frame.request.wait() == MapState::Waiting {
                return;
            }
        }
    }

    /// Returns the newest report that has arrived.
    pub fn collect(&mut self, period: f64) -> Option<GraphReport> {
        let mut newest = None;
        while let Some(first) = self.waiting.first()
            && first.request.state() != MapState::Waiting
        {
            let mut queries = self.waiting.remove(0);
            newest = Some(queries.read(period));
            self.free.push(queries);
        }
        newest
    }
}
