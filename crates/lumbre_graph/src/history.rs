//! What is known about retained resources from earlier frames. It is data only: a plan makes it and the next
//! compilation reads it.

use std::collections::BTreeMap;

use crate::access::Part;
use crate::resource::{Label, Shape};

/// The content of each part of a resource as a number; equal numbers mean equal content. The key `None` stands for
/// all parts that are not listed.
pub(crate) type Content = BTreeMap<Option<Part>, Option<u64>>;

/// The state of one retained resource.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Retained {
    /// With the usages that it was created with.
    pub shape: Shape,
    /// The content of each part.
    pub content: Content,
}

/// What earlier frames left in retained resources. The default is empty, as before a first frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct History {
    pub(crate) retained: BTreeMap<Label, Retained>,
}

impl History {
    /// Returns the record of a resource, if it can serve a resource of `shape`.
    pub(crate) fn find(&self, name: &Label, shape: &Shape) -> Option<&Retained> {
        self.retained.get(name).filter(|kept| kept.shape.serves(shape))
    }
}
