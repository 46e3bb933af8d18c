//! What is known of the retained resources from earlier frames. Data only: a plan makes it, the next compilation reads it.

use std::collections::BTreeMap;

use crate::access::Part;
use crate::resource::{Label, Shape};

/// What each part of a resource holds, as numbers: equal numbers, equal content. The key `None` is what the parts that are not listed hold.
pub(crate) type Content = BTreeMap<Option<Part>, Option<u64>>;

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
    pub(crate) retained: BTreeMap<Label, Retained>,
}

impl History {
    /// The record of a resource, if what it holds can serve a resource of `shape`.
    pub(crate) fn find(&self, name: &Label, shape: &Shape) -> Option<&Retained> {
        self.retained.get(name).filter(|kept| kept.shape.serves(shape))
    }
}
