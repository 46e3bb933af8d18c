//! Checks that no two passes and no two resources share a name.

use std::collections::HashMap;

use crate::declaration::Declarations;
use crate::error::{GraphError, GraphResult};
use crate::resource::Label;
use crate::site::Site;

pub(super) fn check(declarations: &Declarations) -> GraphResult<()> {
    unique("passes", declarations.passes.iter().map(|pass| (&pass.name, pass.site)))?;
    unique("resources", declarations.resources.iter().map(|resource| (&resource.name, resource.site)))
}

fn unique<'n>(kind: &'static str, names: impl Iterator<Item = (&'n Label, Site)>) -> GraphResult<()> {
    let mut seen: HashMap<&str, Site> = HashMap::new();
    for (name, second) in names {
        if let Some(first) = seen.insert(name, second) {
            return Err(Box::new(GraphError::DuplicateName { kind, name: name.clone(), first, second }));
        }
    }
    Ok(())
}
