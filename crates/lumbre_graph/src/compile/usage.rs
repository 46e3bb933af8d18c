//! Infers the GPU usages of each resource from the accesses of all passes, including skipped and culled ones. The
//! usages, and with them the GPU objects, therefore stay the same while the content of the scene changes.

use crate::declaration::Declarations;
use crate::plan::CompileOptions;
use crate::resource::{Origin, Shape};

/// Returns the shape of each resource with all usages that it needs.
pub(super) fn infer(declarations: &Declarations, options: CompileOptions) -> Vec<Shape> {
    let mut shapes: Vec<Shape> = declarations.resources.iter().map(|resource| resource.shape).collect();
    // The usages of an imported resource are given by its creator; those that the passes need are only compared
    // with them.
    for (shape, resource) in shapes.iter_mut().zip(&declarations.resources) {
        if resource.origin == Origin::Imported {
            *shape = shape.without_usage();
        }
    }
    for declared in declarations.passes.iter().flat_map(|pass| &pass.accesses) {
        match &mut shapes[declared.resource] {
            Shape::Texture(texture) => texture.usage |= declared.access.texture_usage(),
            Shape::Buffer(buffer) => buffer.usage |= declared.access.buffer_usage(),
        }
    }
    // wgpu creates textures of several samples only as attachments, even if they are only copied to and read.
    for (shape, resource) in shapes.iter_mut().zip(&declarations.resources) {
        if let Shape::Texture(texture) = shape
            && resource.origin != Origin::Imported
            && texture.sample_count > 1
        {
            texture.usage |= wgpu::TextureUsages::RENDER_ATTACHMENT;
        }
    }
    if options.probe {
        for (shape, resource) in shapes.iter_mut().zip(&declarations.resources) {
            if let Shape::Texture(texture) = shape
                && resource.origin != Origin::Imported
                && texture.can_be_probed()
            {
                texture.usage |= wgpu::TextureUsages::TEXTURE_BINDING;
            }
        }
    }
    shapes
}
