//! What is known of the retained resources from earlier frames. Data only: a plan makes it, the next compilation reads it.

use std::collections::BTreeMap;

use crate::compile::content::Content;
use crate::resource::{Name, Shape};

/// What one retained resource holds.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Retained {
    /// With the usages it was made with.
    pub shape: Shape,
    /// What each part holds.
    pub content: Content,
}

/// What earlier frames left in retained resources. The default is a first frame: nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct History {
    pub(crate) retained: BTreeMap<Name, Retained>,
}

impl History {
    /// The record of a resource, if what it holds can serve a resource of `shape`.
    pub(crate) fn find(&self, name: &Name, shape: &Shape) -> Option<&Retained> {
        self.retained.get(name).filter(|kept| serves(&kept.shape, shape))
    }
}

/// Whether a resource made as `made` can be used as `asked`: all the same, and at least the usages.
pub(crate) fn serves(made: &Shape, asked: &Shape) -> bool {
    let usages = match (made, asked) {
        (Shape::Texture(made), Shape::Texture(asked)) => made.usage.contains(asked.usage),
        (Shape::Buffer(made), Shape::Buffer(asked)) => made.usage.contains(asked.usage),
        _ => false,
    };
    usages && made.without_usage() == asked.without_usage()
}
