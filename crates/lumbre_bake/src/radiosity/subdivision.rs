//! How surfaces are divided into patches: how large patches may be, which triangles may share one, and along how many
//! lines a cell may be cut. Not the patches themselves: those are made by `patches`.

use std::sync::Arc;

use super::bsp::MAX_LINES;
use super::face_clusters::JoinableFaces;
use crate::scene::BakeScene;

/// How surfaces are divided into patches.
#[derive(Clone, Debug)]
pub(crate) struct Subdivision {
    /// Side of a patch, canonical units.
    pub side: f32,
    /// The triangles that may share a patch.
    pub joinable: Arc<JoinableFaces>,
    /// Most contact lines along which a cell is cut.
    pub most_lines: u32,
}

/// By how much [`Subdivision::with_fewer_lines`] lowers the number of lines: from 12 to 4 to 1.
const FEWER_LINES: u32 = 3;

impl Subdivision {
    /// Patches of about `side` canonical units, cut along up to [`MAX_LINES`] lines.
    pub fn new(scene: &BakeScene, side: f32) -> Self {
        Self { side, joinable: Arc::new(JoinableFaces::new(scene, side)), most_lines: MAX_LINES }
    }

    /// The next coarser number of lines; `None` if there is one line only.
    pub fn with_fewer_lines(&self) -> Option<Self> {
        let most_lines = (self.most_lines / FEWER_LINES).max(1);
        (self.most_lines > 1).then(|| Self { most_lines, ..self.clone() })
    }

    /// Whether cells are cut along fewer lines than usual.
    pub fn has_few_lines(&self) -> bool {
        self.most_lines < MAX_LINES
    }
}
