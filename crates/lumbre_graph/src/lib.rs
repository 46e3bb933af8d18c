//! A render graph that is compiled without a device, explains its plan, and measures its passes.
//!
//! ```text
//!   Graph ── declare ──► compile ──────► Plan ──► explain: text, JSON, DOT
//!   resources, passes,   pure, no device  │
//!   what they call for                    ▼
//!   and run                            Executor ──► wgpu ──► GraphReport
//!                                      pool, retained,       times, invocations,
//!                                      queries, probe        first NaN
//! ```
//!
//! A pass reads through `&handle` and writes through `&mut handle`, which advances the handle to a new version. It
//! states what it *requires*; if that is missing, the pass is skipped, and the resources that it would have
//! written keep their previous content. Passes whose results nothing reads are culled. Passes whose results are
//! retained and would come out the same do not run. Passes that draw into the same attachments share one wgpu
//! render pass, and transient resources share memory. The plan records all of this with the reasons.
//!
//! This crate knows nothing about lights, meshes or scenes.
//!
//! ```
//! use lumbre_graph::{Graph, LoadOp, TextureDescriptor, wgpu};
//! let mut graph = Graph::new("frame");
//! let format = wgpu::TextureFormat::Rgba16Float;
//! let mut hdr = graph.texture("hdr", TextureDescriptor::new_2d(640, 360, format));
//! let mut screen = graph.import_texture("screen", TextureDescriptor::new_2d(640, 360, format));
//! let black = LoadOp::ClearIfFirst(wgpu::Color::BLACK);
//! graph.raster_pass("lightmap").requires(false, "a lightmapped mesh").color(&mut hdr, black).run(|_| Ok(()));
//! graph.raster_pass("forward").color(&mut hdr, black).run(|context| {
//!     context.pass.draw(0..3, 0..1);
//!     Ok(())
//! });
//! graph.raster_pass("tone map").samples(&hdr).color(&mut screen, LoadOp::Clear(wgpu::Color::BLACK));
//! let plan = graph.compile()?;
//! assert_eq!(plan.running().collect::<Vec<_>>(), ["forward", "tone map"]);
//! assert_eq!(plan.status("lightmap").unwrap().reason(), "the scene has no lightmapped mesh");
//! # Ok::<(), Box<lumbre_graph::GraphError>>(())
//! ```
//!
//! `examples/sobel.rs` runs a graph on a device, with a bind group for the texture that an earlier pass has drawn.

mod access;
mod compile;
mod declaration;
mod declare;
mod error;
mod executor;
mod explain;
mod handle;
mod history;
mod nearest;
mod plan;
mod resource;
mod run;
mod site;

pub use wgpu;

pub use access::{BufferRead, BufferWrite, LoadOp, Part, TextureRead, TextureWrite};
pub use declaration::PassKind;
pub use declare::graph::Graph;
pub use declare::kind::{Compute, PassType, Raster, ResourceKind, Transfer};
pub use declare::pass::PassBuilder;
pub use error::{CycleStep, GraphError, GraphResult};
pub use executor::{Executor, Frame};
pub use explain::{Explanation, PassExplanation, Requirement, ResourceExplanation, Use};
pub use handle::{Buffer, BufferHandle, Handle, Texture, TextureHandle};
pub use history::History;
pub use plan::{CompileOptions, Memory, Plan, Status};
pub use resource::{BufferDescriptor, Label, Origin, Shape, TextureDescriptor};
pub use run::context::{
    BodyError, BodyResult, ComputeContext, PassResources, RasterContext, TransferContext,
};
pub use run::error::RunError;
pub use run::imports::Imports;
pub use run::map_request::{MapRequest, MapState};
pub use run::pool::{KEEP_RETAINED_FRAMES, KEEP_TRANSIENT_FRAMES, PoolStatistics};
pub use run::probe::FiniteProbe;
pub use run::report::{
    ExecutionStages, GpuTime, GraphReport, Invocations, Measurements, NonFinite, PassReport,
};
pub use site::Site;
