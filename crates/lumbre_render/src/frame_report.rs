//! What the renderer returns for a frame: statistics, the graph's plan and measurements. Plain data.

use std::sync::Arc;

use lumbre_graph::Plan;
use lumbre_scene::Census;

use crate::accounting::Accounting;
use crate::statistics::Statistics;

/// The result of drawing a frame.
#[derive(Clone, Debug)]
pub struct FrameReport {
    /// Counts, uploads and CPU times.
    pub statistics: Statistics,
    /// Which passes ran, which did not, and why.
    pub plan: Arc<Plan>,
    /// The census of the scene, which the frame's passes and shader variants were decided from.
    pub census: Arc<Census>,
    /// Lights, fog and objects that were created in code with invalid data (a value that is not a number, an
    /// index past the end, no Transform, no Material), each with a sentence that names it. The frame is drawn
    /// without them, and a warning is logged when a new one appears.
    pub left_out: Vec<String>,
    /// The newest measurements that have arrived, often those of an earlier frame. `Renderer::wait` returns
    /// this frame's.
    pub measured: Option<lumbre_graph::GraphReport>,
    /// The account, by stages, passes and effects, of the newest frame whose measurements have all arrived,
    /// often an earlier one. `None` unless frames are measured. After `Renderer::wait`,
    /// [`Renderer::accounting`](crate::Renderer::accounting) returns this frame's.
    pub accounting: Option<Arc<Accounting>>,
}
