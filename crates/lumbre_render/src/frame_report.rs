//! What a frame was made of: counts, the plan, and what was measured. Data only.

use std::sync::Arc;

use lumbre_graph::Plan;

/// Counts of one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Statistics {
    /// Lights that are on, ambient ones apart. Each face of an emissive object that lights others is one.
    pub lights: u32,
    /// Of these, the static ones: a lightmapped mesh takes their highlights only. 0 while lightmaps are switched off.
    pub static_lights: u32,
    /// Lights that reach an object in view, on average: what each of its vertices or fragments loops over.
    pub lights_per_object: f32,
    /// Objects in view.
    pub objects: usize,
    /// Objects outside the view, not drawn.
    pub objects_outside: usize,
    /// Triangles in view.
    pub triangles: usize,
    /// Draw calls.
    pub draws: usize,
    /// Forward shader variants compiled so far.
    pub variants: usize,
    /// Bytes of components uploaded for this frame because they changed.
    pub uploaded_bytes: u64,
}

/// What became of a frame.
#[derive(Clone, Debug)]
pub struct FrameReport {
    /// Counts.
    pub statistics: Statistics,
    /// Which passes ran, which did not, and why.
    pub plan: Arc<Plan>,
    /// Lights and fog made in code whose numbers no file may have, each with a sentence that names it: the frame is drawn without them,
    /// and a warning is logged when one appears.
    pub left_out: Vec<String>,
    /// The newest measurements that arrived, often of an earlier frame; `Renderer::wait` has this frame's.
    pub measured: Option<lumbre_graph::FrameReport>,
}
