//! What the caller binds to a graph's imported resources, and the check that it is as declared.

use crate::declaration::Declarations;
use crate::nearest::nearest;
use crate::resource::flags;
use crate::resource::{Label, Shape, TextureDescriptor};
use crate::run::error::RunError;
use crate::run::pool::{GpuObject, GpuTexture};

/// Textures and buffers by the names under which they are imported.
#[derive(Clone, Default)]
pub struct Imports {
    bound: Vec<(Label, GpuObject)>,
}

impl Imports {
    /// Creates imports with nothing bound.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Binds the texture of a view. Passes get this very view; single parts of the texture get their own views.
    #[must_use]
    pub fn texture(mut self, name: impl Into<Label>, view: &wgpu::TextureView) -> Self {
        let texture = GpuTexture { texture: view.texture().clone(), view: view.clone(), parts: Vec::new() };
        self.bound.push((name.into(), GpuObject::Texture(texture)));
        self
    }

    /// Binds a buffer.
    #[must_use]
    pub fn buffer(mut self, name: impl Into<Label>, buffer: &wgpu::Buffer) -> Self {
        self.bound.push((name.into(), GpuObject::Buffer(buffer.clone())));
        self
    }

    /// Returns what is bound to resource `index`, which must match `shape`.
    pub(crate) fn find(
        &self,
        declarations: &Declarations,
        index: usize,
        shape: &Shape,
    ) -> Result<GpuObject, RunError> {
        let name = &declarations.resources[index].name;
        let Some((_, object)) = self.bound.iter().rev().find(|(bound, _)| bound == name) else {
            let near = nearest(name, self.bound.iter().map(|(bound, _)| &**bound));
            let near = near.map(|near| near.to_owned().into());
            return Err(RunError::ImportNotBound { resource: name.clone(), nearest: near });
        };
        match (object, shape) {
            (GpuObject::Texture(bound), Shape::Texture(declared)) => texture(name, &bound.texture, declared)?,
            (GpuObject::Buffer(bound), Shape::Buffer(declared)) => {
                if bound.size() < declared.size {
                    return Err(mismatch(name, "at least a size in bytes of", declared.size, bound.size()));
                }
                if !bound.usage().contains(declared.usage) {
                    return Err(RunError::ImportUsage {
                        resource: name.clone(),
                        needs: flags(&declared.usage),
                        bound: flags(&bound.usage()),
                    });
                }
            }
            (GpuObject::Texture(_), Shape::Buffer(_)) => {
                return Err(mismatch(name, "kind", "buffer", "texture"));
            }
            (GpuObject::Buffer(_), Shape::Texture(_)) => {
                return Err(mismatch(name, "kind", "texture", "buffer"));
            }
        }
        Ok(object.clone())
    }
}

fn texture(name: &Label, bound: &wgpu::Texture, declared: &TextureDescriptor) -> Result<(), RunError> {
    // The declared format may differ in its sRGB suffix, as a view may reinterpret the texels that way.
    if bound.format().remove_srgb_suffix() != declared.format.remove_srgb_suffix() {
        let (declared, bound) = (format!("{:?}", declared.format), format!("{:?}", bound.format()));
        return Err(mismatch(name, "format", declared, bound));
    }
    let sides = |size: wgpu::Extent3d| format!("{}x{}", size.width, size.height);
    if (bound.width(), bound.height()) != (declared.size.width, declared.size.height) {
        return Err(mismatch(name, "size", sides(declared.size), sides(bound.size())));
    }
    if bound.sample_count() != declared.sample_count {
        return Err(mismatch(name, "samples per texel", declared.sample_count, bound.sample_count()));
    }
    if bound.depth_or_array_layers() < declared.size.depth_or_array_layers {
        let (declared, bound) = (declared.size.depth_or_array_layers, bound.depth_or_array_layers());
        return Err(mismatch(name, "depth or layers", declared, bound));
    }
    if bound.mip_level_count() < declared.mip_level_count {
        return Err(mismatch(name, "mip levels", declared.mip_level_count, bound.mip_level_count()));
    }
    if bound.dimension() != declared.dimension {
        let (declared, bound) = (format!("{:?}", declared.dimension), format!("{:?}", bound.dimension()));
        return Err(mismatch(name, "dimension", declared, bound));
    }
    if !bound.usage().contains(declared.usage) {
        return Err(RunError::ImportUsage {
            resource: name.clone(),
            needs: flags(&declared.usage),
            bound: flags(&bound.usage()),
        });
    }
    Ok(())
}

fn mismatch(
    name: &Label,
    what: &'static str,
    declared: impl std::fmt::Display,
    bound: impl std::fmt::Display,
) -> RunError {
    RunError::ImportMismatch {
        resource: name.clone(),
        what,
        declared: declared.to_string(),
        bound: bound.to_string(),
    }
}
