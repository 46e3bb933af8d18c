//! The content of each version, given which passes are skipped, and what each access needs of it.

use crate::access::{Access, LoadOp};
use crate::declaration::{AccessDeclaration, Declarations};
use crate::error::{GraphError, GraphResult};
use crate::history::History;
use crate::resource::{Origin, Shape};

/// What content an access needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Need {
    /// Nothing: it overwrites everything, or works without.
    Nothing,
    /// The content of this version, which exists.
    Version(u32),
    /// Content that does not exist, which is a fault if the pass runs.
    Absent,
}

/// The flow of content through the versions of all resources.
pub(crate) struct Flow<'d> {
    pub declarations: &'d Declarations,
    /// Per resource and version, the version whose content it has. A version that a skipped pass would have made
    /// has the content of the one before.
    pub effective: Vec<Vec<u32>>,
    /// Per resource, whether version 0 has any content (imported, or retained from an earlier frame).
    pub initial: Vec<bool>,
}

impl<'d> Flow<'d> {
    pub fn new(declarations: &'d Declarations, shapes: &[Shape], history: &History) -> Self {
        let effective = |writers: &Vec<usize>| {
            let mut standing = Vec::with_capacity(writers.len() + 1);
            standing.push(0);
            for (version, &writer) in (1..).zip(writers) {
                let before = standing[standing.len() - 1];
                standing.push(if declarations.passes[writer].is_called_for() { version } else { before });
            }
            standing
        };
        let resources = &declarations.resources;
        Self {
            declarations,
            effective: resources.iter().map(|resource| effective(&resource.writers)).collect(),
            initial: resources
                .iter()
                .zip(shapes)
                .map(|(resource, shape)| match resource.origin {
                    Origin::Transient => false,
                    Origin::Imported => true,
                    Origin::Retained => history.find(&resource.name, shape).is_some(),
                })
                .collect(),
        }
    }

    /// Returns the version whose content `version` has.
    pub fn standing(&self, resource: usize, version: u32) -> u32 {
        self.effective[resource][version as usize]
    }

    /// Returns the version whose content the last version has.
    pub fn last(&self, resource: usize) -> u32 {
        *self.effective[resource].last().unwrap_or(&0)
    }

    /// Returns what an access of a running pass needs.
    pub fn need(&self, declared: &AccessDeclaration) -> Need {
        let there = self.content(declared);
        match declared.access {
            Access::ReadTexture(_)
            | Access::ReadBuffer(_)
            | Access::DepthReadOnly
            | Access::Color(LoadOp::Load)
            | Access::Depth(LoadOp::Load) => match there {
                Some(version) => Need::Version(version),
                None if declared.optional => Need::Nothing,
                None => Need::Absent,
            },
            Access::Color(LoadOp::Clear(_)) | Access::Depth(LoadOp::Clear(_)) | Access::Resolve { .. } => {
                if self.overwrites_all(declared) {
                    Need::Nothing
                } else {
                    self.kept(declared)
                }
            }
            Access::Color(LoadOp::ClearIfFirst(_)) | Access::Depth(LoadOp::ClearIfFirst(_)) => {
                if self.is_first(declared) && self.overwrites_all(declared) {
                    Need::Nothing
                } else {
                    self.kept(declared)
                }
            }
            Access::WriteTexture(_) | Access::WriteBuffer(_) => self.kept(declared),
        }
    }

    /// Returns true if the attachment keeps its content and is not cleared.
    pub fn loads(&self, declared: &AccessDeclaration) -> bool {
        match declared.access {
            Access::Color(LoadOp::Load) | Access::Depth(LoadOp::Load) | Access::DepthReadOnly => true,
            Access::Color(LoadOp::ClearIfFirst(_)) | Access::Depth(LoadOp::ClearIfFirst(_)) => {
                !self.is_first(declared)
            }
            _ => false,
        }
    }

    /// Checks for faults that do not depend on the content of the scene: a read of a transient resource that no
    /// pass has written before.
    pub fn check_reads(&self) -> GraphResult<()> {
        for (index, pass) in self.declarations.passes.iter().enumerate() {
            for declared in &pass.accesses {
                let transient = self.declarations.resources[declared.resource].origin == Origin::Transient;
                let must_be_there = match declared.access {
                    Access::Color(load) => load == LoadOp::Load,
                    Access::Depth(load) => load == LoadOp::Load,
                    access => !access.writes() && !declared.optional,
                };
                if transient && declared.version == 0 && must_be_there {
                    return Err(Box::new(self.absent(index, declared)));
                }
            }
        }
        Ok(())
    }

    /// Returns the error for a pass that needs content that does not exist.
    pub fn absent(&self, pass: usize, declared: &AccessDeclaration) -> GraphError {
        let resource = &self.declarations.resources[declared.resource];
        let reader = &self.declarations.passes[pass];
        let access = declared.access.describe();
        if declared.version > 0 {
            let writers = &resource.writers[..declared.version as usize];
            let skipped: Vec<String> = writers
                .iter()
                .map(|&writer| {
                    let writer = &self.declarations.passes[writer];
                    format!("`{}`: {}", writer.name, super::skip_reason(writer))
                })
                .collect();
            return GraphError::ProducersSkipped {
                pass: reader.name.clone(),
                site: reader.site,
                resource: resource.name.clone(),
                access,
                skipped: skipped.join("; "),
            };
        }
        match resource.writers.first().filter(|&&writer| writer != pass) {
            Some(&writer) => GraphError::ReadBeforeWrite {
                pass: reader.name.clone(),
                site: reader.site,
                resource: resource.name.clone(),
                access,
                writer: self.declarations.passes[writer].name.clone(),
                writer_site: self.declarations.passes[writer].site,
            },
            None => GraphError::MissingProducer {
                pass: reader.name.clone(),
                site: reader.site,
                resource: resource.name.clone(),
                resource_site: resource.site,
                access,
            },
        }
    }

    /// Returns the version with the content that this access finds, if there is any.
    fn content(&self, declared: &AccessDeclaration) -> Option<u32> {
        let standing = self.standing(declared.resource, declared.version);
        (standing > 0 || self.initial[declared.resource]).then_some(standing)
    }

    fn kept(&self, declared: &AccessDeclaration) -> Need {
        self.content(declared).map_or(Need::Nothing, Need::Version)
    }

    fn overwrites_all(&self, declared: &AccessDeclaration) -> bool {
        let shape = &self.declarations.resources[declared.resource].shape;
        shape.texture().is_some_and(|texture| texture.is_one_part())
    }

    /// Returns true if no pass of this frame that is not skipped has written this part before.
    fn is_first(&self, declared: &AccessDeclaration) -> bool {
        if self.standing(declared.resource, declared.version) == 0 {
            return true;
        }
        let resource = &self.declarations.resources[declared.resource];
        let here = declared.touched_part();
        !(1..=declared.version).any(|version| {
            self.standing(declared.resource, version) == version
                && self
                    .written_part(resource.writers[version as usize - 1], declared.resource, version)
                    .is_none_or(|part| here.is_none_or(|here| here == part))
        })
    }

    /// Returns the part of `resource` that `pass` writes to make `version`; `None` for all of it.
    pub fn written_part(&self, pass: usize, resource: usize, version: u32) -> Option<crate::access::Part> {
        self.declarations.passes[pass]
            .accesses
            .iter()
            .find(|declared| declared.resource == resource && declared.written() == Some(version))
            .and_then(AccessDeclaration::touched_part)
    }
}
