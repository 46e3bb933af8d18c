//! Declaring one pass: what it requires, reads and writes, and how it runs.

use std::marker::PhantomData;

use crate::access::{Access, LoadOp, Part, TextureRead};
use crate::declaration::{AccessDeclaration, PassDeclaration};
use crate::declare::graph::Graph;
use crate::declare::kind::{AnyAccess, Compute, PassType, Raster, ResourceKind, Transfer};
use crate::error::GraphError;
use crate::handle::{Handle, TextureHandle};
use crate::resource::Label;
use crate::run::context::{Body, BodyResult, ComputeContext, RasterContext, TransferContext};

/// A pass being declared. The pass is in the graph from the start; each call adds to it.
pub struct PassBuilder<'g, 'a, K, User> {
    graph: &'g mut Graph<'a, User>,
    index: usize,
    kind: PhantomData<K>,
}

impl<'g, 'a, K: PassType, User> PassBuilder<'g, 'a, K, User> {
    /// A builder for the pass that was declared last.
    pub(crate) fn new(graph: &'g mut Graph<'a, User>) -> Self {
        let index = graph.declarations.passes.len() - 1;
        Self { graph, index, kind: PhantomData }
    }

    /// Adds something that the pass requires, and whether it is there ("point lights", "a lightmapped mesh"). If
    /// anything that a pass requires is not there, the pass is skipped: each version that it would have written
    /// has the content of the version before.
    pub fn requires(mut self, there: bool, what: impl Into<Label>) -> Self {
        self.pass().requirements.push((there, what.into()));
        self
    }

    /// Adds an effect outside the graph ("presents the frame"). A pass that has one is never culled.
    pub fn side_effect(mut self, what: impl Into<Label>) -> Self {
        self.pass().side_effects.push(what.into());
        self
    }

    /// Sets a number that changes whenever anything changes that the pass depends on, except for the resources that
    /// it reads (which the graph tracks itself). If everything that the pass writes is retained and already has the
    /// resulting content, the pass does not run.
    pub fn fingerprint(mut self, inputs: u64) -> Self {
        self.pass().fingerprint = Some(inputs);
        self
    }

    /// Makes the pass run after the pass with this name, for dependencies that no resource expresses.
    pub fn after(mut self, pass: impl Into<Label>) -> Self {
        self.pass().after.push(pass.into());
        self
    }

    /// Reads a texture or a buffer.
    pub fn reads<R: ResourceKind>(self, handle: &Handle<R>, how: R::Read) -> Self {
        let AnyAccess(access) = R::read_access(how);
        self.access(handle, access, false)
    }

    /// Reads a texture or a buffer if any pass that runs has written it. The pass has to work without it.
    pub fn reads_optional<R: ResourceKind>(self, handle: &Handle<R>, how: R::Read) -> Self {
        let AnyAccess(access) = R::read_access(how);
        self.access(handle, access, true)
    }

    /// Samples a texture: short for `reads(handle, TextureRead::Sampled)`.
    pub fn samples(self, handle: &TextureHandle) -> Self {
        self.reads(handle, TextureRead::Sampled)
    }

    /// Writes a texture or a buffer, and keeps the parts that are not overwritten.
    pub fn writes<R: ResourceKind>(self, handle: &mut Handle<R>, how: R::Write) -> Self {
        let AnyAccess(access) = R::write_access(how);
        self.write(handle, access)
    }

    /// Restricts the read, write or attachment that was declared last to one mip level of one layer.
    pub fn part(mut self, part: Part) -> Self {
        if let Some(last) = self.pass().accesses.last_mut() {
            last.part = Some(part);
        } else {
            self.nothing_to_modify("part", "access");
        }
        self
    }

    fn pass(&mut self) -> &mut PassDeclaration {
        &mut self.graph.declarations.passes[self.index]
    }

    fn access<R: ResourceKind>(mut self, handle: &Handle<R>, access: Access, optional: bool) -> Self {
        let (name, site) = (self.pass().name.clone(), self.pass().site);
        if let Some(resource) = self.graph.own(name, site, handle) {
            let version = handle.version;
            self.pass().accesses.push(AccessDeclaration { resource, version, access, part: None, optional });
        }
        self
    }

    fn write<R: ResourceKind>(mut self, handle: &mut Handle<R>, access: Access) -> Self {
        let (index, name, site) = (self.index, self.pass().name.clone(), self.pass().site);
        let Some(resource) = self.graph.own(name.clone(), site, handle) else { return self };
        let declared = &mut self.graph.declarations;
        let writers = &mut declared.resources[resource].writers;
        if let Some(&first) = writers.get(handle.version as usize) {
            declared.faults.push(GraphError::TwoWriters {
                resource: declared.resources[resource].name.clone(),
                version: handle.version,
                first: declared.passes[first].name.clone(),
                first_site: declared.passes[first].site,
                second: name,
                second_site: site,
            });
            return self;
        }
        writers.push(index);
        let version = handle.version;
        handle.version += 1;
        self.pass().accesses.push(AccessDeclaration {
            resource,
            version,
            access,
            part: None,
            optional: false,
        });
        self
    }

    fn nothing_to_modify(&mut self, method: &'static str, wanted: &'static str) {
        let (pass, site) = (self.pass().name.clone(), self.pass().site);
        self.graph.declarations.faults.push(GraphError::NothingToModify { pass, site, method, wanted });
    }
}

impl<'a, User> PassBuilder<'_, 'a, Raster, User> {
    /// Draws into a colour attachment. The order of these calls is the order of the shader's locations.
    pub fn color(self, handle: &mut TextureHandle, load: LoadOp<wgpu::Color>) -> Self {
        self.write(handle, Access::Color(load))
    }

    /// Resolves the multisampled colour attachment that was declared last into a texture with one sample. Several
    /// consecutive passes may name the same target: the resolve happens once, after the last of them, and only if
    /// the target is read.
    pub fn resolve(mut self, target: &mut TextureHandle) -> Self {
        let colors = |pass: &PassDeclaration| {
            pass.accesses.iter().filter(|declared| matches!(declared.access, Access::Color(_))).count()
        };
        match colors(self.pass()).checked_sub(1) {
            Some(of) => self.write(target, Access::Resolve { of }),
            None => {
                self.nothing_to_modify("resolve", "colour attachment");
                self
            }
        }
    }

    /// Tests and writes depth. Values are those of the depth buffer, 0 to 1; with reversed Z it is cleared to 0.
    pub fn depth(self, handle: &mut TextureHandle, load: LoadOp<f32>) -> Self {
        self.write(handle, Access::Depth(load))
    }

    /// Tests depth without writing it; the pass may also sample the same texture.
    pub fn depth_read_only(self, handle: &TextureHandle) -> Self {
        self.access(handle, Access::DepthReadOnly, false)
    }

    /// Sets the function that records the draw calls. Without it the graph can be compiled but not run.
    pub fn run(self, body: impl FnOnce(&mut RasterContext<'_, User>) -> BodyResult + 'a) {
        self.graph.bodies[self.index] = Some(Body::Raster(Box::new(body)));
    }
}

impl<'a, User> PassBuilder<'_, 'a, Compute, User> {
    /// Sets the function that records the dispatches. Without it the graph can be compiled but not run.
    pub fn run(self, body: impl FnOnce(&mut ComputeContext<'_, User>) -> BodyResult + 'a) {
        self.graph.bodies[self.index] = Some(Body::Compute(Box::new(body)));
    }
}

impl<'a, User> PassBuilder<'_, 'a, Transfer, User> {
    /// Sets the function that records onto the encoder. Without it the graph can be compiled but not run.
    pub fn run(self, body: impl FnOnce(&mut TransferContext<'_, User>) -> BodyResult + 'a) {
        self.graph.bodies[self.index] = Some(Body::Transfer(Box::new(body)));
    }
}
