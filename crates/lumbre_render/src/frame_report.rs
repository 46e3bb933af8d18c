//! What the renderer answers a frame with: its counts, its plan, and what was measured. Data only.

use std::sync::Arc;

use lumbre_graph::Plan;
use lumbre_scene::Census;

use crate::accounting::Accounting;
use crate::statistics::Statistics;

/// What became of a frame.
#[derive(Clone, Debug)]
pub struct FrameReport {
    /// Counts.
    pub statistics: Statistics,
    /// Which passes ran, which did not, and why.
    pub plan: Arc<Plan>,
    /// What the scene calls for: what the frame's passes and shader variants were decided from.
    pub census: Arc<Census>,
    /// Lights, fog and objects made in code with what no file may have (a number that is none, an index past the end, no Transform, no Material), each with a
    /// sentence that names it: the frame is drawn without them, and a warning is logged when one appears.
    pub left_out: Vec<String>,
    /// The newest measurements that arrived, often of an earlier frame; `Renderer::wait` has this frame's.
    pub measured: Option<lumbre_graph::GraphReport>,
    /// The newest frame of which all has arrived, often an earlier one, by stages, passes and effects; nothing unless frames are measured. After `Renderer::wait`
    /// [`Renderer::accounting`](crate::Renderer::accounting) has this frame's.
    pub accounting: Option<Arc<Accounting>>,
}
