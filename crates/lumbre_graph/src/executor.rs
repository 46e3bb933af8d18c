//! The executor: the state that outlives a frame. It holds GPU memory, the plans of the last frames, what is known
//! about retained resources, and measurements.

use std::sync::Arc;
use std::time::Instant;

use crate::declare::graph::Graph;
use crate::error::GraphResult;
use crate::history::History;
use crate::plan::CompileOptions;
use crate::plan::Plan;
use crate::resource::Origin;
use crate::run::error::RunError;
use crate::run::imports::Imports;
use crate::run::measure::Ring;
use crate::run::pool::{GpuObject, Pool, PoolStatistics};
use crate::run::probe::FiniteProbe;
use crate::run::record::{FrameResources, Recorder, looks};
use crate::run::report::{ExecutionStages, GraphReport, Measurements};

/// Number of plans that are kept.
const KEPT_PLANS: usize = 8;

/// Runs graphs, one per frame, on one device. After a device loss, create a new one.
#[derive(Default)]
pub struct Executor {
    pool: Pool,
    history: History,
    /// The plans of the last frames, the newest last. A graph that alternates between a few forms (say, a shadow
    /// that moves now and then) is only compiled once for each.
    plans: Vec<Arc<Plan>>,
    compiled: u64,
    measure: Measurements,
    keep_apart: bool,
    probing: bool,
    probe: Option<FiniteProbe>,
    ring: Ring,
    report: Option<GraphReport>,
    exported: Vec<(crate::resource::Label, GpuObject)>,
    frame: u64,
    begun: Option<Instant>,
}

/// A frame that was submitted to the GPU.
#[derive(Debug)]
pub struct Frame {
    /// Its number, from 1, which its [`GraphReport`] has too.
    pub number: u64,
    /// What ran and why.
    pub plan: Arc<Plan>,
    /// For waiting until the GPU has finished the frame.
    pub submission: wgpu::SubmissionIndex,
    /// How long its stages took on the CPU, if that was measured.
    pub stages: Option<ExecutionStages>,
}

/// A stopwatch for the stages of an execution.
struct Laps(Instant);

impl Laps {
    /// Milliseconds since the last call.
    fn lap(&mut self) -> f64 {
        let now = Instant::now();
        let lap = (now - self.0).as_secs_f64() * 1e3;
        self.0 = now;
        lap
    }
}

impl Executor {
    /// Creates an executor that has run nothing yet, with [`Measurements::TIMES`].
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Sets what to measure from the next frame on.
    pub fn set_measure(&mut self, measure: Measurements) {
        self.measure = measure;
    }

    /// Sets when work for the next frame began. Its [`GraphReport::cpu_ms`] counts from then on and not from the
    /// call of [`execute`](Self::execute).
    pub fn begun_at(&mut self, begun: Instant) {
        self.begun = Some(begun);
    }

    /// Sets whether to merge raster passes that draw into the same attachments (initially on).
    pub fn set_merging(&mut self, merge: bool) {
        self.keep_apart = !merge;
    }

    /// Sets whether to look for NaN and Inf after every pass. This is for tests and debugging: it disables merging
    /// and reads every texture.
    pub fn enable_probe(&mut self, on: bool) {
        self.probing = on;
    }

    /// What is known about retained resources, for compiling a graph as [`execute`](Self::execute) would.
    #[must_use]
    pub fn history(&self) -> &History {
        &self.history
    }

    /// Returns counts of the GPU memory in use.
    #[must_use]
    pub fn pool_statistics(&self) -> PoolStatistics {
        self.pool.statistics()
    }

    /// Returns the plan of a graph. It is that of one of the last frames if the same was declared then, with the
    /// same knowledge of earlier frames.
    ///
    /// # Errors
    /// The first fault of the declaration.
    pub fn plan<User>(&mut self, graph: &Graph<'_, User>) -> GraphResult<Arc<Plan>> {
        let options = CompileOptions { merge: !self.keep_apart, probe: self.probing };
        let fits = |plan: &Arc<Plan>| {
            plan.options == options && plan.declarations == graph.declarations && plan.before == self.history
        };
        let plan = match self.plans.iter().rposition(fits) {
            Some(known) => self.plans.remove(known),
            None => {
                self.compiled += 1;
                Arc::new(graph.compile_with(&self.history, options)?)
            }
        };
        if self.plans.len() == KEPT_PLANS {
            self.plans.remove(0);
        }
        self.plans.push(Arc::clone(&plan));
        Ok(plan)
    }

    /// Number of plans compiled so far.
    #[must_use]
    pub fn compiled_plans(&self) -> u64 {
        self.compiled
    }

    /// Compiles a graph, runs its passes and submits their commands.
    ///
    /// # Errors
    /// Faults of the graph, imports that are missing or not as declared, and errors of passes. Nothing is submitted
    /// then.
    pub fn execute(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        graph: Graph<'_>,
        imports: &Imports,
    ) -> Result<Frame, RunError> {
        self.execute_with(device, queue, graph, imports, &mut ())
    }

    /// [`Executor::execute`] for a graph whose passes share state: `user` is lent to one after the other.
    ///
    /// # Errors
    /// As [`Executor::execute`].
    pub fn execute_with<User>(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        graph: Graph<'_, User>,
        imports: &Imports,
        user: &mut User,
    ) -> Result<Frame, RunError> {
        let begun = self.begun.take();
        let mut laps = Laps(Instant::now());
        let mut stages = ExecutionStages::default();
        let start = self.measure.cpu.then(|| begun.unwrap_or(laps.0));
        self.collect(device, queue);
        stages.collecting_ms = laps.lap();
        self.frame += 1;
        let plan = self.plan(&graph)?;
        stages.planning_ms = laps.lap();
        let frame = FrameResources { plan: &plan, objects: self.objects(device, &plan, imports)? };
        let passes = plan.steps.iter().map(|step| step.passes.len()).sum();
        let queries = self.ring.begin(device, self.measure, passes, plan.steps.len());
        if self.probing && self.ring.has_room() {
            let count = plan.steps.iter().map(|step| looks(&plan, step).len()).sum();
            self.probe.get_or_insert_with(|| FiniteProbe::new(device, count)).begin(device, queue, count);
        }
        let probe = self.probe.as_ref().filter(|_| self.probing && self.ring.has_room());
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor {
            label: Some(&plan.declarations.label),
        });
        stages.resources_ms = laps.lap();
        let mut recorder = Recorder {
            device,
            queue,
            frame: &frame,
            graph: graph.id,
            bodies: graph.bodies,
            queries,
            probe,
            time_cpu: self.measure.cpu,
            user,
        };
        for group in 0..plan.steps.len() {
            recorder.step(&mut encoder, group)?;
        }
        let mut queries = recorder.queries;
        let results = probe.map(FiniteProbe::results);
        let to_wait_for = queries.resolve(device, &mut encoder, results);
        queries.report.frame = self.frame;
        queries.report.probed = !queries.probed.is_empty();
        let commands = encoder.finish();
        stages.recording_ms = laps.lap();
        let submission = queue.submit([commands]);
        stages.submission_ms = laps.lap();
        queries.report.cpu_ms = start.map(|start| start.elapsed().as_secs_f64() * 1e3);
        if let Some(report) = self.ring.end(queries, to_wait_for) {
            self.report = Some(report);
        }
        self.keep(&plan, frame.objects);
        stages.keeping_ms = laps.lap();
        Ok(Frame { number: self.frame, plan, submission, stages: self.measure.cpu.then_some(stages) })
    }

    /// Returns the newest report that has arrived, without waiting. In a window it is a few frames old.
    #[must_use]
    pub fn latest_report(&self) -> Option<&GraphReport> {
        self.report.as_ref()
    }

    /// Waits for the GPU to finish and returns the last frame's report; `None` if no frame has run.
    ///
    /// # Errors
    /// [`RunError::Wait`] if the device was lost.
    pub fn timings_blocking(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
    ) -> Result<Option<&GraphReport>, RunError> {
        device
            .poll(wgpu::PollType::wait_indefinitely())
            .map_err(|error| RunError::Wait(error.to_string()))?;
        self.ring.wait();
        self.collect(device, queue);
        Ok(self.report.as_ref())
    }

    /// Returns a texture that the last frame exported.
    #[must_use]
    pub fn exported_texture(&self, name: &str) -> Option<&wgpu::Texture> {
        self.exported.iter().find_map(|(held, object)| match object {
            GpuObject::Texture(texture) if held == name => Some(&texture.texture),
            _ => None,
        })
    }

    /// Returns a buffer that the last frame exported.
    #[must_use]
    pub fn exported_buffer(&self, name: &str) -> Option<&wgpu::Buffer> {
        self.exported.iter().find_map(|(held, object)| match object {
            GpuObject::Buffer(buffer) if held == name => Some(buffer),
            _ => None,
        })
    }

    fn collect(&mut self, device: &wgpu::Device, queue: &wgpu::Queue) {
        if !self.ring.is_waiting() {
            return;
        }
        // The callbacks of the buffer maps report a lost device.
        let _ = device.poll(wgpu::PollType::Poll);
        if let Some(report) = self.ring.collect(f64::from(queue.get_timestamp_period())) {
            self.report = Some(report);
        }
    }

    /// Returns the GPU objects of the resources of this frame, with views of all parts that are used.
    fn objects(
        &mut self,
        device: &wgpu::Device,
        plan: &Plan,
        imports: &Imports,
    ) -> Result<Vec<Option<GpuObject>>, RunError> {
        let declarations = &plan.declarations;
        let mut objects: Vec<Option<GpuObject>> = vec![None; plan.resources.len()];
        let mut parts = vec![Vec::new(); plan.resources.len()];
        for declared in declarations.passes.iter().flat_map(|pass| &pass.accesses) {
            if let Some(part) = declared.touched_part() {
                parts[declared.resource].push(part);
            }
        }
        if plan.options.probe {
            for (resource, part) in plan.steps.iter().flat_map(|step| looks(plan, step)) {
                parts[resource].push(part);
            }
        }
        let prepare = |object: &mut GpuObject, resource: usize| {
            if let (GpuObject::Texture(texture), Some(shape)) =
                (&mut *object, plan.resources[resource].shape.texture())
                && !shape.is_one_part()
            {
                for &part in &parts[resource] {
                    texture.part(part);
                }
            }
            object.clone()
        };
        for slot in &plan.slots {
            let label = &declarations.resources[slot.resources[0]].name;
            let object = self.pool.transient(device, label, &slot.shape, self.frame)?;
            for &resource in &slot.resources {
                objects[resource] = Some(prepare(object, resource));
            }
        }
        for (index, declared) in declarations.resources.iter().enumerate() {
            let shape = &plan.resources[index].shape;
            match declared.origin {
                Origin::Transient => {}
                // Kept even if no pass uses it in this frame, since last frame's content may be needed again.
                Origin::Retained => {
                    let (object, fresh) = self.pool.retained(device, &declared.name, shape, self.frame)?;
                    objects[index] = Some(prepare(object, index));
                    if fresh {
                        self.history.retained.remove(&declared.name);
                    }
                }
                Origin::Imported if plan.resources[index].lifetime.is_some() => {
                    let mut object = imports.find(declarations, index, shape)?;
                    objects[index] = Some(prepare(&mut object, index));
                }
                Origin::Imported => {}
            }
        }
        Ok(objects)
    }

    /// Updates the state after a frame was submitted.
    fn keep(&mut self, plan: &Plan, objects: Vec<Option<GpuObject>>) {
        self.history = plan.after.clone();
        for name in self.pool.trim(self.frame) {
            self.history.retained.remove(&name);
        }
        self.exported.clear();
        for (declared, object) in plan.declarations.resources.iter().zip(objects) {
            if let (Some(_), Some(object)) = (declared.exported, object) {
                self.exported.push((declared.name.clone(), object));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{LoadOp, TextureDescriptor};

    fn graph(there: bool, side: u32) -> Graph<'static, ()> {
        let mut graph = Graph::new("test");
        let described = TextureDescriptor::new_2d(side, side, wgpu::TextureFormat::Rgba8Unorm);
        let mut target = graph.import_texture("target", described);
        let clear = LoadOp::Clear(wgpu::Color::BLACK);
        graph.raster_pass("always").color(&mut target, clear).run(|_| Ok(()));
        let pass = graph.raster_pass("sometimes").requires(there, "light");
        pass.color(&mut target, LoadOp::Load).run(|_| Ok(()));
        graph
    }

    #[test]
    fn what_comes_and_goes_is_compiled_once() {
        let mut executor = Executor::new();
        for frame in 0..20 {
            let plan = executor.plan(&graph(frame % 2 == 0, 8)).unwrap();
            assert_eq!(plan.running().count(), if frame % 2 == 0 { 2 } else { 1 });
        }
        assert_eq!(executor.compiled_plans(), 2);
        // With more graphs than plans are kept, used in turn, each has to be compiled every time, and no more than
        // that are kept.
        for frame in 0..30 {
            executor.plan(&graph(true, 10 + frame % 10)).unwrap();
        }
        assert_eq!(executor.compiled_plans(), 32);
        assert_eq!(executor.plans.len(), KEPT_PLANS);
    }
}
