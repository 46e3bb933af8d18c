//! Checks each resource's shape, and that each access is compatible with it: format, size, samples, parts and
//! usage.

use crate::access::Access;
use crate::declaration::{AccessDeclaration, Declarations, PassDeclaration, PassKind};
use crate::error::{GraphError, GraphResult};
use crate::resource::{Origin, ResourceDeclaration, Shape, TextureDescriptor};

pub(super) fn check(declarations: &Declarations) -> GraphResult<()> {
    for resource in &declarations.resources {
        shape(resource)?;
        let written = u32::try_from(resource.writers.len()).unwrap_or(u32::MAX);
        if let Some(version) = resource.exported.filter(|&version| version < written) {
            let overwriter = &declarations.passes[resource.writers[version as usize]];
            return Err(Box::new(GraphError::ExportOverwritten {
                resource: resource.name.clone(),
                version,
                pass: overwriter.name.clone(),
                site: overwriter.site,
            }));
        }
    }
    for pass in &declarations.passes {
        let check = PassCheck { declarations, pass };
        for declared in &pass.accesses {
            check.usage(declared)?;
            check.texture(declared)?;
        }
        check.conflicts()?;
        check.attachments()?;
    }
    Ok(())
}

fn shape(resource: &ResourceDeclaration) -> GraphResult<()> {
    let reason = match &resource.shape {
        Shape::Texture(texture) => texture_fault(texture),
        Shape::Buffer(buffer) if buffer.size == 0 => Some("a buffer of 0 bytes; size it at least 4".into()),
        // wgpu copies and clears in multiples of COPY_BUFFER_ALIGNMENT.
        Shape::Buffer(buffer) if buffer.size % wgpu::COPY_BUFFER_ALIGNMENT != 0 => {
            Some(format!("{} bytes is not a multiple of {}", buffer.size, wgpu::COPY_BUFFER_ALIGNMENT))
        }
        Shape::Buffer(_) => None,
    };
    reason.map_or(Ok(()), |reason| {
        Err(Box::new(GraphError::InvalidShape {
            resource: resource.name.clone(),
            site: resource.site,
            reason,
        }))
    })
}

fn texture_fault(texture: &TextureDescriptor) -> Option<String> {
    let size = texture.size;
    if size.width == 0 || size.height == 0 || size.depth_or_array_layers == 0 {
        return Some(format!(
            "a texture of {}x{}x{} texels; a window without area has no frame to draw",
            size.width, size.height, size.depth_or_array_layers
        ));
    }
    if !matches!(texture.sample_count, 1 | 2 | 4 | 8 | 16) {
        return Some(format!("{} samples per texel; it must be 1, 2, 4, 8 or 16", texture.sample_count));
    }
    let largest = match texture.dimension {
        wgpu::TextureDimension::D3 => size.width.max(size.height).max(size.depth_or_array_layers),
        _ => size.width.max(size.height),
    };
    let levels = 32 - largest.leading_zeros();
    if texture.mip_level_count == 0 || texture.mip_level_count > levels {
        return Some(format!("{} mip levels; its size allows 1 to {levels}", texture.mip_level_count));
    }
    if texture.sample_count > 1
        && (texture.mip_level_count > 1 || texture.dimension != wgpu::TextureDimension::D2)
    {
        return Some("a multisampled texture has one mip level and two dimensions".into());
    }
    // Video formats with several planes have no simple size in bytes, and nothing draws into them.
    texture.format.is_multi_planar_format().then(|| format!("format {:?} has several planes", texture.format))
}

struct PassCheck<'d> {
    declarations: &'d Declarations,
    pass: &'d PassDeclaration,
}

impl PassCheck<'_> {
    fn resource(&self, declared: &AccessDeclaration) -> &ResourceDeclaration {
        &self.declarations.resources[declared.resource]
    }

    fn usage(&self, declared: &AccessDeclaration) -> GraphResult<()> {
        let resource = self.resource(declared);
        let mismatch = |needs: String, declared_usage: String| {
            Err(Box::new(GraphError::UsageMismatch {
                pass: self.pass.name.clone(),
                site: self.pass.site,
                resource: resource.name.clone(),
                resource_site: resource.site,
                access: declared.access.describe(),
                needs,
                declared: declared_usage,
            }))
        };
        let transfers = self.pass.kind == PassKind::Transfer;
        let copies = declared.access.is_copy();
        if copies && !transfers {
            return mismatch(
                "a transfer pass: copies are recorded on the encoder".into(),
                format!("a {} pass", self.pass.kind.name()),
            );
        }
        if declared.access.is_own_attachment() && !transfers {
            return mismatch("a transfer pass".into(), format!("a {} pass", self.pass.kind.name()));
        }
        if resource.origin != Origin::Imported {
            return Ok(());
        }
        match resource.shape {
            Shape::Texture(texture) => {
                let needs = declared.access.texture_usage();
                if !texture.usage.is_empty() && !texture.usage.contains(needs) {
                    return mismatch(format!("{needs:?}"), format!("{:?}", texture.usage));
                }
            }
            Shape::Buffer(buffer) => {
                let needs = declared.access.buffer_usage();
                if !buffer.usage.is_empty() && !buffer.usage.contains(needs) {
                    return mismatch(format!("{needs:?}"), format!("{:?}", buffer.usage));
                }
            }
        }
        Ok(())
    }

    fn texture(&self, declared: &AccessDeclaration) -> GraphResult<()> {
        let resource = self.resource(declared);
        let Shape::Texture(texture) = &resource.shape else { return Ok(()) };
        if let Some(part) = declared.touched_part()
            && (part.mip >= texture.mip_level_count || part.layer >= texture.layer_count())
        {
            return Err(Box::new(GraphError::PartOutOfRange {
                pass: self.pass.name.clone(),
                site: self.pass.site,
                resource: resource.name.clone(),
                mip: part.mip,
                layer: part.layer,
                mips: texture.mip_level_count,
                layers: texture.layer_count(),
            }));
        }
        let format = texture.format;
        match declared.access {
            Access::Color(_) | Access::Resolve { .. } if !format.has_color_aspect() => {
                self.format(declared, format, "a colour format".into())
            }
            Access::Depth(_) | Access::DepthReadOnly if !format.has_depth_aspect() => {
                self.format(declared, format, "a depth format, such as Depth32Float".into())
            }
            Access::Resolve { .. } if texture.sample_count != 1 => {
                self.samples(declared, "1: it receives the average".into())
            }
            Access::WriteTexture(crate::access::TextureWrite::Storage)
            | Access::ReadTexture(crate::access::TextureRead::Storage)
                if texture.sample_count != 1 =>
            {
                self.samples(declared, "1: there are no multisampled storage textures".into())
            }
            _ => Ok(()),
        }
    }

    fn format(
        &self,
        declared: &AccessDeclaration,
        format: wgpu::TextureFormat,
        expected: String,
    ) -> GraphResult<()> {
        let resource = self.resource(declared);
        Err(Box::new(GraphError::FormatMismatch {
            pass: self.pass.name.clone(),
            site: self.pass.site,
            resource: resource.name.clone(),
            resource_site: resource.site,
            access: declared.access.describe(),
            format,
            expected,
        }))
    }

    fn samples(&self, declared: &AccessDeclaration, expected: String) -> GraphResult<()> {
        let resource = self.resource(declared);
        Err(Box::new(GraphError::SampleCountMismatch {
            pass: self.pass.name.clone(),
            site: self.pass.site,
            resource: resource.name.clone(),
            resource_site: resource.site,
            access: declared.access.describe(),
            count: resource.shape.texture().map_or(1, |texture| texture.sample_count),
            expected,
        }))
    }

    /// Checks that no resource is written and also used in another way in one pass, except in separate parts.
    fn conflicts(&self) -> GraphResult<()> {
        for (index, first) in self.pass.accesses.iter().enumerate() {
            for second in &self.pass.accesses[index + 1..] {
                let overlap = match (first.touched_part(), second.touched_part()) {
                    (Some(a), Some(b)) => a == b,
                    _ => true,
                };
                let writes = first.access.writes() || second.access.writes();
                // The encoder orders its own commands, so a transfer pass may read what it has written.
                let ordered = self.pass.kind == PassKind::Transfer;
                if first.resource == second.resource && writes && overlap && !ordered {
                    return Err(Box::new(GraphError::AccessConflict {
                        pass: self.pass.name.clone(),
                        site: self.pass.site,
                        resource: self.resource(first).name.clone(),
                        first: first.access.describe(),
                        second: second.access.describe(),
                    }));
                }
            }
        }
        Ok(())
    }

    /// Checks that the attachments of one pass agree in size and samples, and those of a resolve in format too.
    fn attachments(&self) -> GraphResult<()> {
        let mut first: Option<(&AccessDeclaration, &TextureDescriptor)> = None;
        let mut colors: Vec<(&AccessDeclaration, &TextureDescriptor)> = Vec::new();
        for declared in self.pass.accesses.iter().filter(|declared| declared.access.is_attachment()) {
            let Some(texture) = self.resource(declared).shape.texture() else { continue };
            let (held, held_texture) = *first.get_or_insert((declared, texture));
            let size = |declared: &AccessDeclaration, texture: &TextureDescriptor| {
                let level = texture.mip_size(declared.part.unwrap_or_default().mip);
                [level.width, level.height]
            };
            let (first_size, second_size) = (size(held, held_texture), size(declared, texture));
            if first_size != second_size {
                return Err(Box::new(GraphError::SizeMismatch {
                    pass: self.pass.name.clone(),
                    site: self.pass.site,
                    first: self.resource(held).name.clone(),
                    first_site: self.resource(held).site,
                    first_size,
                    second: self.resource(declared).name.clone(),
                    second_site: self.resource(declared).site,
                    second_size,
                }));
            }
            if let Access::Resolve { of } = declared.access {
                let (from, from_texture) = colors[of];
                if from_texture.sample_count == 1 {
                    return self.samples(
                        from,
                        format!("more than 1, since it is resolved into `{}`", self.resource(declared).name),
                    );
                }
                if from_texture.format != texture.format {
                    let expected = format!(
                        "the format {:?} of `{}`, which it resolves",
                        from_texture.format,
                        self.resource(from).name
                    );
                    return self.format(declared, texture.format, expected);
                }
            } else if texture.sample_count != held_texture.sample_count {
                let expected = format!("{} as `{}` has", held_texture.sample_count, self.resource(held).name);
                return self.samples(declared, expected);
            }
            if matches!(declared.access, Access::Color(_)) {
                colors.push((declared, texture));
            }
        }
        if first.is_none() && self.pass.kind == PassKind::Raster {
            return Err(Box::new(GraphError::NoAttachment {
                pass: self.pass.name.clone(),
                site: self.pass.site,
            }));
        }
        Ok(())
    }
}
