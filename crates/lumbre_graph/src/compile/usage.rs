//! Infers the GPU usages of each resource from the accesses of all passes, skipped and culled ones too: so the usages,
//! and with them the GPU objects, stay the same while the scene's content comes and goes.

use crate::declaration::Declarations;
use crate::plan::CompileOptions;
use crate::resource::{Origin, Shape};

/// The shape of each resource with all usages it needs.
pub(super) fn infer(declarations: &Declarations, options: CompileOptions) -> Vec<Shape> {
    let mut shapes: Vec<Shape> = declarations.resources.iter().map(|resource| resource.shape).collect();
    // What an imported resource allows is its maker's word; what the passes need of it is only compared with that.
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
