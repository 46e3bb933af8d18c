//! Running a compiled graph on wgpu: memory, commands and measurements. What runs and in which order is decided by
//! the plan.

pub(crate) mod context;
pub(crate) mod error;
pub(crate) mod imports;
pub(crate) mod map_request;
pub(crate) mod measure;
pub(crate) mod pool;
pub(crate) mod probe;
pub(crate) mod record;
pub(crate) mod report;
