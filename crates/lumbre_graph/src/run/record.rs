//! The resources of one frame, and the recording of its steps.

use std::time::Instant;

use crate::access::Part;
use crate::declaration::{AccessDeclaration, PassKind};
use crate::handle::{BufferHandle, Handle, TextureHandle};
use crate::plan::{Plan, Step, Target};
use crate::resource::{Origin, Shape};
use crate::run::context::{Body, ComputeContext, PassResources, RasterContext, TransferContext};
use crate::run::error::RunError;
use crate::run::measure::{FrameQueries, Scope};
use crate::run::pool::{GpuObject, GpuTexture};
use crate::run::probe::{FiniteProbe, Probed};
use crate::run::report::{GpuTime, PassReport};

/// The GPU objects behind the resources of one frame.
pub(crate) struct FrameResources<'p> {
    pub plan: &'p Plan,
    /// Per resource; `None` for transient and imported resources that no running pass uses.
    pub objects: Vec<Option<GpuObject>>,
}

impl FrameResources<'_> {
    pub fn view(
        &self,
        pass: &PassResources<'_>,
        handle: &TextureHandle,
    ) -> Result<&wgpu::TextureView, RunError> {
        let declared = self.declared(pass, handle)?;
        let texture = self.texture_object(pass, declared)?;
        Ok(match declared.touched_part() {
            Some(part) => part_view(texture, part),
            None => &texture.view,
        })
    }

    pub fn texture(
        &self,
        pass: &PassResources<'_>,
        handle: &TextureHandle,
    ) -> Result<&wgpu::Texture, RunError> {
        let declared = self.declared(pass, handle)?;
        Ok(&self.texture_object(pass, declared)?.texture)
    }

    pub fn buffer(&self, pass: &PassResources<'_>, handle: &BufferHandle) -> Result<&wgpu::Buffer, RunError> {
        let declared = self.declared(pass, handle)?;
        match &self.objects[declared.resource] {
            Some(GpuObject::Buffer(buffer)) => Ok(buffer),
            _ => Err(self.absent(pass, declared)),
        }
    }

    /// Returns the declaration that gives this pass access to this version; a read takes precedence over a write.
    fn declared<K>(
        &self,
        pass: &PassResources<'_>,
        handle: &Handle<K>,
    ) -> Result<&AccessDeclaration, RunError> {
        let declarations = &self.plan.declarations;
        let accesses = &declarations.passes[pass.pass].accesses;
        let own = handle.graph == pass.graph;
        let of_it = |declared: &&AccessDeclaration| own && declared.resource == handle.resource as usize;
        let matches = |declared: &&AccessDeclaration| {
            of_it(declared)
                && (declared.version == handle.version || declared.written() == Some(handle.version))
        };
        let found = accesses.iter().filter(matches).min_by_key(|declared| declared.access.writes());
        let Some(found) = found else {
            let resource = if own { declarations.resources.get(handle.resource as usize) } else { None };
            let versions: Vec<String> = accesses
                .iter()
                .filter(of_it)
                .map(|declared| format!("version {} of it", declared.written().unwrap_or(declared.version)))
                .collect();
            return Err(RunError::Undeclared {
                pass: declarations.passes[pass.pass].name.clone(),
                resource: resource.map_or("a resource of another graph".into(), |found| found.name.clone()),
                version: handle.version,
                declared: if versions.is_empty() { "none of it".into() } else { versions.join(", ") },
            });
        };
        // For an optional read of a transient resource that a skipped pass would have written, there may be memory
        // because of another version, but no content that this pass may see.
        let standing = self.plan.effective[found.resource][found.version as usize];
        if found.optional && standing == 0 && !self.plan.initial[found.resource] {
            return Err(self.absent(pass, found));
        }
        Ok(found)
    }

    fn texture_object(
        &self,
        pass: &PassResources<'_>,
        declared: &AccessDeclaration,
    ) -> Result<&GpuTexture, RunError> {
        match &self.objects[declared.resource] {
            Some(GpuObject::Texture(texture)) => Ok(texture),
            _ => Err(self.absent(pass, declared)),
        }
    }

    fn absent(&self, pass: &PassResources<'_>, declared: &AccessDeclaration) -> RunError {
        RunError::Absent {
            pass: self.plan.pass_name(pass.pass).clone(),
            resource: self.plan.declarations.resources[declared.resource].name.clone(),
        }
    }

    fn target(&self, target: Target) -> Option<&wgpu::TextureView> {
        match &self.objects[target.resource] {
            Some(GpuObject::Texture(texture)) => Some(part_view(texture, target.part)),
            _ => None,
        }
    }
}

/// Returns the view of a part. The views of all parts that are used were created with the object; a texture with
/// one part only has its whole view.
fn part_view(texture: &GpuTexture, part: Part) -> &wgpu::TextureView {
    texture.parts.iter().find(|(held, _)| *held == part).map_or(&texture.view, |(_, view)| view)
}

/// Returns what the probe inspects after a step: the parts of float textures that its passes wrote.
pub(crate) fn looks(plan: &Plan, step: &Step) -> Vec<(usize, Part)> {
    let mut looks = Vec::new();
    for &pass in &step.passes {
        for declared in plan.declarations.passes[pass].accesses.iter().filter(|access| access.access.writes())
        {
            let planned = &plan.resources[declared.resource];
            let resource = &plan.declarations.resources[declared.resource];
            let imported = resource.origin == Origin::Imported;
            let (Shape::Texture(texture), Shape::Texture(described)) = (planned.shape, resource.shape) else {
                continue;
            };
            // An imported texture can only be inspected if its declaration allows that; the usages that the passes
            // need do not tell.
            let bindable = described.usage.contains(wgpu::TextureUsages::TEXTURE_BINDING);
            if !texture.can_be_probed() || planned.lifetime.is_none() || (imported && !bindable) {
                continue;
            }
            match declared.touched_part() {
                Some(part) => looks.push((declared.resource, part)),
                None => looks.extend((0..texture.layer_count()).flat_map(|layer| {
                    (0..texture.mip_level_count).map(move |mip| (declared.resource, Part { mip, layer }))
                })),
            }
        }
    }
    looks
}

/// Records the steps of a frame.
pub(crate) struct Recorder<'r, 'a, User> {
    pub device: &'r wgpu::Device,
    pub queue: &'r wgpu::Queue,
    pub frame: &'r FrameResources<'r>,
    pub graph: u64,
    pub bodies: Vec<Option<Body<'a, User>>>,
    pub queries: FrameQueries,
    pub probe: Option<&'r FiniteProbe>,
    pub time_cpu: bool,
    pub user: &'r mut User,
}

impl<'r, User> Recorder<'r, '_, User> {
    pub fn step(&mut self, encoder: &mut wgpu::CommandEncoder, group: usize) -> Result<(), RunError> {
        let plan = self.frame.plan;
        let step = &plan.steps[group];
        let kind = step.passes.first().map(|&pass| plan.declarations.passes[pass].kind);
        match kind {
            Some(PassKind::Raster) => self.raster(encoder, step, group)?,
            Some(PassKind::Compute) => self.compute(encoder, step, group)?,
            Some(PassKind::Transfer) => self.transfer(encoder, step, group)?,
            None => {}
        }
        self.look(encoder, step);
        Ok(())
    }

    fn raster(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        step: &Step,
        group: usize,
    ) -> Result<(), RunError> {
        let frame = self.frame;
        let store = |store: bool| if store { wgpu::StoreOp::Store } else { wgpu::StoreOp::Discard };
        let colors: Vec<_> = step
            .colors
            .iter()
            .map(|color| {
                frame.target(color.target).map(|view| wgpu::RenderPassColorAttachment {
                    view,
                    depth_slice: None,
                    resolve_target: color.resolve.and_then(|target| frame.target(target)),
                    ops: wgpu::Operations {
                        load: color.clear.map_or(wgpu::LoadOp::Load, wgpu::LoadOp::Clear),
                        store: store(color.store),
                    },
                })
            })
            .collect();
        let depth = step.depth.and_then(|depth| {
            frame.target(depth.target).map(|view| wgpu::RenderPassDepthStencilAttachment {
                view,
                depth_ops: (!depth.read_only).then(|| wgpu::Operations {
                    load: depth.clear.map_or(wgpu::LoadOp::Load, wgpu::LoadOp::Clear),
                    store: store(depth.store),
                }),
                stencil_ops: None,
            })
        });
        // Allocated together before the pass begins, so that they are in order.
        let inner = if self.queries.inside_passes { step.passes.len() - 1 } else { 0 };
        let stamps: Vec<Option<u32>> = (0..inner + 2).map(|_| self.queries.timestamp()).collect();
        let timestamps = self.queries.timestamps.clone();
        let statistics = self.queries.statistics.clone();
        let label: Vec<&str> = step.passes.iter().map(|&pass| &**frame.plan.pass_name(pass)).collect();
        let mut pass = encoder
            .begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some(&label.join(" + ")),
                color_attachments: &colors,
                depth_stencil_attachment: depth,
                timestamp_writes: timestamps.as_ref().zip(stamps[0].zip(stamps[inner + 1])).map(
                    |(query_set, (begin, end))| wgpu::RenderPassTimestampWrites {
                        query_set,
                        beginning_of_pass_write_index: Some(begin),
                        end_of_pass_write_index: Some(end),
                    },
                ),
                occlusion_query_set: None,
                multiview_mask: None,
            })
            .forget_lifetime();
        for (at, &index) in step.passes.iter().enumerate() {
            let statistic = statistics.as_ref().and_then(|set| Some((set, self.queries.statistic()?)));
            let Some(Body::Raster(body)) = self.bodies[index].take() else { return Err(self.no_body(index)) };
            pass.push_debug_group(label[at]);
            if let Some((set, query)) = statistic {
                pass.begin_pipeline_statistics_query(set, query);
            }
            let start = self.clock();
            body(&mut RasterContext { pass: &mut pass, resources: self.resources(index), user: self.user })
                .map_err(|source| self.failed(index, source))?;
            let cpu = elapsed(start);
            if statistic.is_some() {
                pass.end_pipeline_statistics_query();
            }
            pass.pop_debug_group();
            let span = if inner == 0 {
                let scope = if step.passes.len() == 1 { Scope::Pass } else { Scope::Group };
                stamps[0].zip(stamps[1]).map(|(from, to)| (from, to, scope))
            } else {
                if let (true, Some(set), Some(stamp)) = (at < inner, &timestamps, stamps[at + 1]) {
                    pass.write_timestamp(set, stamp);
                }
                stamps[at].zip(stamps[at + 1]).map(|(from, to)| (from, to, Scope::PartOfGroup))
            };
            self.report(index, group, cpu, span, statistic.map(|(_, query)| query));
        }
        Ok(())
    }

    fn compute(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        step: &Step,
        group: usize,
    ) -> Result<(), RunError> {
        for &index in &step.passes {
            let stamps = self.queries.timestamp().zip(self.queries.timestamp());
            let timestamps = self.queries.timestamps.clone();
            let statistics = self.queries.statistics.clone();
            let statistic = statistics.as_ref().and_then(|set| Some((set, self.queries.statistic()?)));
            let Some(Body::Compute(body)) = self.bodies[index].take() else {
                return Err(self.no_body(index));
            };
            let mut pass = encoder
                .begin_compute_pass(&wgpu::ComputePassDescriptor {
                    label: Some(self.frame.plan.pass_name(index)),
                    timestamp_writes: timestamps.as_ref().zip(stamps).map(|(query_set, (begin, end))| {
                        wgpu::ComputePassTimestampWrites {
                            query_set,
                            beginning_of_pass_write_index: Some(begin),
                            end_of_pass_write_index: Some(end),
                        }
                    }),
                })
                .forget_lifetime();
            if let Some((set, query)) = statistic {
                pass.begin_pipeline_statistics_query(set, query);
            }
            let start = self.clock();
            body(&mut ComputeContext { pass: &mut pass, resources: self.resources(index), user: self.user })
                .map_err(|source| self.failed(index, source))?;
            let cpu = elapsed(start);
            if statistic.is_some() {
                pass.end_pipeline_statistics_query();
            }
            let span = stamps.map(|(from, to)| (from, to, Scope::Pass));
            self.report(index, group, cpu, span, statistic.map(|(_, query)| query));
        }
        Ok(())
    }

    fn transfer(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        step: &Step,
        group: usize,
    ) -> Result<(), RunError> {
        for &index in &step.passes {
            let Some(Body::Transfer(body)) = self.bodies[index].take() else {
                return Err(self.no_body(index));
            };
            let timestamps = self.queries.timestamps.clone().filter(|_| self.queries.inside_encoders);
            let stamps = timestamps
                .as_ref()
                .and_then(|set| Some((set, self.queries.timestamp()?, self.queries.timestamp()?)));
            encoder.push_debug_group(self.frame.plan.pass_name(index));
            if let Some((set, begin, _)) = stamps {
                encoder.write_timestamp(set, begin);
            }
            let start = self.clock();
            body(&mut TransferContext { encoder, resources: self.resources(index), user: self.user })
                .map_err(|source| self.failed(index, source))?;
            let cpu = elapsed(start);
            if let Some((set, _, end)) = stamps {
                encoder.write_timestamp(set, end);
            }
            encoder.pop_debug_group();
            self.report(index, group, cpu, stamps.map(|(_, from, to)| (from, to, Scope::Pass)), None);
        }
        Ok(())
    }

    fn look(&mut self, encoder: &mut wgpu::CommandEncoder, step: &Step) {
        let Some(probe) = self.probe else { return };
        let plan = self.frame.plan;
        for (resource, part) in looks(plan, step) {
            let Some(view) = self.frame.target(Target { resource, part }) else { continue };
            let Some(texture) = plan.resources[resource].shape.texture() else { continue };
            let size = texture.mip_size(part.mip);
            probe.look(self.device, encoder, view, [size.width, size.height], self.queries.probed.len());
            self.queries.probed.push(Probed {
                pass: plan.pass_name(step.passes[0]).clone(),
                resource: plan.declarations.resources[resource].name.clone(),
                part,
                width: size.width,
            });
        }
    }

    fn resources(&self, pass: usize) -> PassResources<'r> {
        PassResources { device: self.device, queue: self.queue, frame: self.frame, graph: self.graph, pass }
    }

    fn clock(&self) -> Option<Instant> {
        self.time_cpu.then(Instant::now)
    }

    fn no_body(&self, pass: usize) -> RunError {
        RunError::NoBody { pass: self.frame.plan.pass_name(pass).clone() }
    }

    fn failed(&self, pass: usize, source: crate::run::context::BodyError) -> RunError {
        RunError::Pass { pass: self.frame.plan.pass_name(pass).clone(), source }
    }

    fn report(
        &mut self,
        pass: usize,
        group: usize,
        cpu_ms: Option<f64>,
        span: Option<(u32, u32, Scope)>,
        count: Option<u32>,
    ) {
        let declared = &self.frame.plan.declarations.passes[pass];
        let (name, owner) = (declared.name.clone(), declared.owner.clone());
        let gpu = GpuTime::NotMeasured;
        self.queries.report.passes.push(PassReport { name, owner, group, cpu_ms, gpu, invocations: None });
        self.queries.spans.push(span);
        self.queries.counts.push(count);
    }
}

fn elapsed(start: Option<Instant>) -> Option<f64> {
    start.map(|start| start.elapsed().as_secs_f64() * 1e3)
}
