//! The graph of one frame, which is built anew for each frame: resources, passes and their bodies.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::compile;
use crate::declaration::{Declarations, PassDeclaration};
use crate::declare::kind::{Compute, PassType, Raster, ResourceKind, Transfer};
use crate::declare::pass::PassBuilder;
use crate::error::{GraphError, GraphResult};
use crate::handle::{BufferHandle, Handle, TextureHandle};
use crate::history::History;
use crate::plan::CompileOptions;
use crate::plan::Plan;
use crate::resource::{BufferDescriptor, Label, Origin, ResourceDeclaration, Shape, TextureDescriptor};
use crate::run::context::Body;
use crate::site::Site;

static NEXT_GRAPH: AtomicU64 = AtomicU64::new(1);

/// A graph of passes over textures and buffers.
///
/// `'a` is the lifetime of what the bodies of the passes borrow. `User` is state that several passes share:
/// [`Executor::execute_with`](crate::Executor::execute_with) lends it to one pass after the other as
/// `context.user`.
pub struct Graph<'a, User = ()> {
    pub(crate) id: u64,
    pub(crate) declarations: Declarations,
    pub(crate) bodies: Vec<Option<Body<'a, User>>>,
    /// The owner of the passes that are declared from now on.
    owner: Option<Label>,
}

impl Graph<'_> {
    /// Creates an empty graph. The label is for messages and debuggers.
    #[must_use]
    pub fn new(label: impl Into<Label>) -> Self {
        Self::with_user(label)
    }
}

impl<'a, User> Graph<'a, User> {
    /// Creates an empty graph whose passes share the state that
    /// [`Executor::execute_with`](crate::Executor::execute_with) lends them.
    #[must_use]
    pub fn with_user(label: impl Into<Label>) -> Self {
        Self {
            id: NEXT_GRAPH.fetch_add(1, Ordering::Relaxed),
            declarations: Declarations {
                label: label.into(),
                resources: Vec::new(),
                passes: Vec::new(),
                faults: Vec::new(),
            },
            bodies: Vec::new(),
            owner: None,
        }
    }

    /// Sets the part of the program that the passes declared from now on belong to, until the next call. Reports
    /// and explanations name it, so that the cost of passes can be summed by part. At first passes have no owner.
    pub fn set_owner(&mut self, owner: impl Into<Label>) {
        self.owner = Some(owner.into());
    }

    /// Declares a transient texture, which lives for part of this frame only.
    #[track_caller]
    pub fn texture(&mut self, name: impl Into<Label>, descriptor: TextureDescriptor) -> TextureHandle {
        self.resource(name.into(), Shape::Texture(descriptor), Origin::Transient, Site::caller())
    }

    /// Declares a transient buffer, which lives for part of this frame only.
    #[track_caller]
    pub fn buffer(&mut self, name: impl Into<Label>, descriptor: BufferDescriptor) -> BufferHandle {
        self.resource(name.into(), Shape::Buffer(descriptor), Origin::Transient, Site::caller())
    }

    /// Declares a texture that the executor keeps from frame to frame under its name. Version 0 is what last frame
    /// left.
    #[track_caller]
    pub fn retained_texture(
        &mut self,
        name: impl Into<Label>,
        descriptor: TextureDescriptor,
    ) -> TextureHandle {
        self.resource(name.into(), Shape::Texture(descriptor), Origin::Retained, Site::caller())
    }

    /// Declares a buffer that the executor keeps from frame to frame under its name. Version 0 is what last frame
    /// left.
    #[track_caller]
    pub fn retained_buffer(&mut self, name: impl Into<Label>, descriptor: BufferDescriptor) -> BufferHandle {
        self.resource(name.into(), Shape::Buffer(descriptor), Origin::Retained, Site::caller())
    }

    /// Declares an external texture, which is bound by its name in [`Imports`](crate::Imports) when the graph runs.
    #[track_caller]
    pub fn import_texture(&mut self, name: impl Into<Label>, descriptor: TextureDescriptor) -> TextureHandle {
        self.resource(name.into(), Shape::Texture(descriptor), Origin::Imported, Site::caller())
    }

    /// Declares an external buffer, which is bound by its name in [`Imports`](crate::Imports) when the graph runs.
    /// It may be larger than described.
    #[track_caller]
    pub fn import_buffer(&mut self, name: impl Into<Label>, descriptor: BufferDescriptor) -> BufferHandle {
        self.resource(name.into(), Shape::Buffer(descriptor), Origin::Imported, Site::caller())
    }

    /// Sets the fingerprint of an imported resource's content, a number that changes whenever the content does.
    /// Without it, passes that read the resource are never [`Unchanged`](crate::Status::Unchanged).
    #[track_caller]
    pub fn fingerprint<K: ResourceKind>(&mut self, handle: &Handle<K>, content: u64) {
        let site = Site::caller();
        if let Some(index) = self.own("(fingerprint)".into(), site, handle) {
            self.declarations.resources[index].fingerprint = Some(content);
        }
    }

    /// Keeps this version until after the frame: the passes that make it are not culled, and the executor returns
    /// it by name.
    #[track_caller]
    pub fn export<K: ResourceKind>(&mut self, handle: &Handle<K>) {
        let site = Site::caller();
        if let Some(index) = self.own("(export)".into(), site, handle) {
            self.declarations.resources[index].exported = Some(handle.version);
        }
    }

    /// Begins a pass that draws.
    #[track_caller]
    pub fn raster_pass(&mut self, name: impl Into<Label>) -> PassBuilder<'_, 'a, Raster, User> {
        self.pass(name.into(), Site::caller())
    }

    /// Begins a pass that dispatches compute shaders.
    #[track_caller]
    pub fn compute_pass(&mut self, name: impl Into<Label>) -> PassBuilder<'_, 'a, Compute, User> {
        self.pass(name.into(), Site::caller())
    }

    /// Begins a pass that records onto the command encoder itself.
    #[track_caller]
    pub fn transfer_pass(&mut self, name: impl Into<Label>) -> PassBuilder<'_, 'a, Transfer, User> {
        self.pass(name.into(), Site::caller())
    }

    /// Compiles the graph as for a first frame, without any device.
    ///
    /// # Errors
    /// The first fault of the declarations, see [`GraphError`].
    pub fn compile(&self) -> GraphResult<Plan> {
        self.compile_with(&History::default(), CompileOptions::default())
    }

    /// Compiles the graph with the knowledge of what earlier frames left, without any device.
    ///
    /// # Errors
    /// The first fault of the declarations, see [`GraphError`].
    pub fn compile_with(&self, history: &History, options: CompileOptions) -> GraphResult<Plan> {
        compile::compile(&self.declarations, history, options)
    }

    /// Returns the index of a handle's resource, or records a fault if the handle is another graph's.
    pub(crate) fn own<K: ResourceKind>(
        &mut self,
        pass: Label,
        site: Site,
        handle: &Handle<K>,
    ) -> Option<usize> {
        if handle.graph == self.id {
            return Some(handle.resource as usize);
        }
        self.declarations.faults.push(GraphError::ForeignHandle {
            pass,
            site,
            kind: K::WORD,
            index: handle.resource,
            foreign: handle.graph,
        });
        None
    }

    fn resource<K>(&mut self, name: Label, shape: Shape, origin: Origin, site: Site) -> Handle<K> {
        // 2^32 resources would not fit into memory.
        let index = u32::try_from(self.declarations.resources.len()).unwrap_or(u32::MAX);
        self.declarations.resources.push(ResourceDeclaration {
            name,
            shape,
            origin,
            writers: Vec::new(),
            exported: None,
            fingerprint: None,
            site,
        });
        Handle::new(self.id, index)
    }

    fn pass<K: PassType>(&mut self, name: Label, site: Site) -> PassBuilder<'_, 'a, K, User> {
        self.declarations.passes.push(PassDeclaration {
            name,
            owner: self.owner.clone(),
            kind: K::KIND,
            accesses: Vec::new(),
            requirements: Vec::new(),
            side_effects: Vec::new(),
            fingerprint: None,
            after: Vec::new(),
            site,
        });
        self.bodies.push(None);
        PassBuilder::new(self)
    }
}
