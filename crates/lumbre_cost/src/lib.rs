//! Measures what accuracy costs in time: studies that measure the time and the error of the same choices, and the page that
//! shows the results.
//!
//! ```text
//!   files, or scenes ─► studies/… ─► Measured: Study (points, findings) + pictures
//!                        │  frames: interleaved rounds          │
//!                        │  traced: references in f64           ▼
//!                        │                        folder: cost.json, cost.csv, index.html, pictures/*.exr
//!                        └─ fronts ─► findings: sentences           │
//!                                                                   └─► comparison: two reports, what changed
//! ```
//!
//! - A [`Point`] has a time (median and quartiles over rounds in which all points take turns), an error against the
//!   reference of its study, counts that do not depend on when they are taken, the command that reproduces it, and a picture.
//! - Findings are derived from the points. If the quartiles of two times overlap, they say that the times are not
//!   distinguishable.
//!
//! ```
//! use lumbre_cost::{CostReport, Point, Spread, Study, compare_reports};
//!
//! let frame = |ms: [f64; 3]| Point { label: "frame".into(), milliseconds: Spread::of(&ms), ..Point::default() };
//! let report = |ms| CostReport {
//!     studies: vec![Study { name: "shading".into(), points: vec![frame(ms)], ..Study::default() }],
//!     ..CostReport::default()
//! };
//! let changes = compare_reports(&report([1.0, 1.1, 1.2]), &report([2.0, 2.1, 2.2]), 1.1);
//! assert!(changes.iter().any(|change| change.is_slower()));
//! ```

mod all_pairs;
mod bake_once;
mod baked;
mod bounce_by_bounce;
mod clustered_mesh;
mod command_line;
mod comparison;
mod compile_ahead;
mod conditions;
mod converged;
mod converged_bake;
mod error;
mod findings;
mod folder;
mod frame;
mod frames;
mod fronts;
mod lamps_in_pieces;
mod live;
mod machine;
mod measured;
mod page;
mod picture;
mod plot;
mod report;
mod rounded_lighting;
mod rounds;
mod run;
mod scene_file;
mod scenes;
mod shared_bakes;
mod spread;
mod studies;
mod table;
mod traced;
mod tune;

pub use command_line::command_words;
pub use comparison::{Change, DRIFT_OF_MACHINES, Figure, NOISE_OF_RUNS, What, compare_reports};
pub use conditions::{Conditions, Listener};
pub use error::CostError;
pub use findings::cheapest_by_error;
pub use folder::{PAGE, REPORT, TABLE, read_picture, read_report};
pub use fronts::{Stretch, pareto_front, stretches};
pub use live::{Beside, BesideReference, LightCost, LightCosts, Priced, SideView, ViewFront, ViewWalk};
pub use page::{Images, page};
pub use picture::{Compared, Picture, compared};
pub use report::{
    CostReport, ErrorOf, ErrorOver, KeptMaps, Machine, Plot, Point, PointPicture, Quantity, Settings, Study,
};
pub use run::{CostOptions, CostProgress, measure};
pub use spread::Spread;
pub use studies::{STUDIES, StudyKind, studies_named};
pub use tune::{DrawSettings, Goal, LIGHTMAP_BYTES, TuneOptions, Tuned, tune};
