//! Reflectance, emission and opacity of a surface at a point, combined from material factors, vertex colours and
//! textures.

use std::sync::Arc;

use glam::{Vec2, Vec3, Vec4};
use lumbre_mesh::TriangleMesh;
use lumbre_optics::{AlphaMode, Material, Surface, SurfaceSample, shininess_from_roughness};
use lumbre_scene::{MaterialTextures, TextureReference};

use super::texture::sample;

/// Larger reflectances are clamped to this, with a warning: with a reflectance of 1, bounces would never end.
pub(crate) const LARGEST_REFLECTANCE: f32 = 0.999;

/// The material of a primitive, with the mesh whose vertex colours and texture coordinates it reads.
#[derive(Clone, Debug)]
pub(crate) struct SurfaceMaterial {
    pub material: Material,
    pub textures: Option<MaterialTextures>,
    pub mesh: Arc<TriangleMesh>,
}

/// A side of a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Side {
    #[default]
    Front,
    Back,
}

/// How many texels of a texture a piece of a triangle shows; 0 without a texture.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ShownTexels {
    /// Along its longest edge.
    pub edge: f32,
    /// Over its area.
    pub area: f32,
}

impl SurfaceMaterial {
    /// Whether reflectance, emission or opacity may vary within a triangle.
    pub fn varies(&self) -> bool {
        self.textures.is_some() || !self.mesh.colors.is_empty()
    }

    /// Whether it reflects no light anywhere.
    pub fn is_black(&self) -> bool {
        let Material { front, back, unlit, .. } = &self.material;
        let metallic = self.textures.as_ref().is_some_and(|textures| textures.metallic_roughness.is_some());
        let black = |side: &Surface| {
            side.diffuse == Vec3::ZERO && reflectance_as_metal(&self.material, side) == Vec3::ZERO
        };
        *unlit || (black(front) && back.as_ref().is_none_or(black) && !metallic)
    }

    /// The texture that its emission is multiplied by.
    pub fn emissive_texture(&self) -> Option<&TextureReference> {
        self.textures.as_ref()?.emissive.as_ref()
    }

    /// Whether its emission varies within a triangle.
    pub fn emission_varies(&self) -> bool {
        self.emissive_texture().is_some()
    }

    /// Number of texels of the emissive texture along the longest edge of a triangle; 0 without such a texture.
    pub fn emission_texels(&self, vertices: [u32; 3]) -> f32 {
        let texture = self.emissive_texture();
        let whole = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)];
        texture.map_or(0.0, |texture| self.texels(texture, vertices, whole).edge)
    }

    /// What a piece of a triangle shows of the textures that the reflectance is read from: the most of any of them. The
    /// piece's corners are given by the weights of the triangle's second and third vertex.
    pub fn reflectance_texels(&self, vertices: [u32; 3], piece: [(f32, f32); 3]) -> ShownTexels {
        let Some(textures) = &self.textures else { return ShownTexels::default() };
        let metallic = textures.metallic_roughness.as_ref().map(|metallic| &metallic.texture);
        let read = [textures.base_color.as_ref(), metallic].into_iter().flatten();
        read.map(|texture| self.texels(texture, vertices, piece)).fold(
            ShownTexels::default(),
            |most, texels| ShownTexels { edge: most.edge.max(texels.edge), area: most.area.max(texels.area) },
        )
    }

    /// What a piece of a triangle shows of a texture.
    fn texels(&self, texture: &TextureReference, vertices: [u32; 3], piece: [(f32, f32); 3]) -> ShownTexels {
        let coordinates = if texture.tex_coord == 0 { &self.mesh.uv0 } else { &self.mesh.uv1 };
        let size = Vec2::new(texture.image.width as f32, texture.image.height as f32);
        let at = |vertex: u32| {
            coordinates.get(vertex as usize).copied().unwrap_or_default() * texture.scale * size
        };
        let [a, b, c] = vertices.map(at);
        let [a, b, c] = piece.map(|(u, v)| a + (b - a) * u + (c - a) * v);
        let edge = a.distance(b).max(b.distance(c)).max(c.distance(a));
        let area = 0.5 * (b - a).perp_dot(c - a).abs();
        if edge.is_finite() && area.is_finite() { ShownTexels { edge, area } } else { ShownTexels::default() }
    }

    /// Whether light may pass through parts of it.
    pub fn is_masked(&self) -> bool {
        match self.material.alpha_mode {
            AlphaMode::Opaque => false,
            // A cutoff above 1 hides all of the surface.
            AlphaMode::Mask { cutoff } if cutoff > 1.0 => true,
            AlphaMode::Mask { .. } | AlphaMode::Blend => self.material.alpha < 1.0 || self.varies(),
        }
    }

    /// Diffuse reflectance ρ, each channel in [0, 0.999]: k_d, and what stands for the highlight of a metal.
    pub fn reflectance(&self, side: Side, vertices: [u32; 3], weights: [f32; 3]) -> Vec3 {
        if self.material.unlit {
            return Vec3::ZERO;
        }
        let surface = match (side, &self.material.back) {
            (Side::Back, Some(back)) => back,
            _ => &self.material.front,
        };
        let mut surface = *surface;
        let mut tint = self.color(vertices, weights).truncate();
        if let Some(textures) = &self.textures {
            if let Some(base) = &textures.base_color {
                tint *= self.read(base, vertices, weights, true).truncate();
            }
            if let Some(slot) = &textures.metallic_roughness {
                let texel = self.read(&slot.texture, vertices, weights, false);
                let metallic = slot.metallic * texel.z;
                surface.diffuse = slot.base_color * (1.0 - metallic);
                surface.specular = slot.dielectric.lerp(slot.base_color * tint, metallic);
                surface.shininess = shininess_from_roughness(slot.roughness * texel.y);
            }
        }
        surface.diffuse *= tint;
        if self.textures.as_ref().is_none_or(|textures| textures.metallic_roughness.is_none()) {
            // The base colour of a metal is its k_s.
            surface.specular *= tint;
        }
        clean(surface.diffuse + reflectance_as_metal(&self.material, &surface))
            .min(Vec3::splat(LARGEST_REFLECTANCE))
    }

    /// The emitted radiance of a side before its texture, W/(m² sr).
    fn emission_factor(&self, side: Side) -> Vec3 {
        match (side, &self.material.back) {
            (Side::Front, _) => self.material.front.emission,
            (Side::Back, Some(back)) => back.emission,
            // Without a separate back material, a surface emits from its front only.
            (Side::Back, None) => Vec3::ZERO,
        }
    }

    /// Whether a side emits light where its texture is not black.
    pub fn emits(&self, side: Side) -> bool {
        self.emission_factor(side) != Vec3::ZERO
    }

    /// Emitted radiance, W/(m² sr).
    pub fn emission(&self, side: Side, vertices: [u32; 3], weights: [f32; 3]) -> Vec3 {
        let emission = self.emission_factor(side);
        if emission == Vec3::ZERO {
            return emission;
        }
        let factor = self
            .emissive_texture()
            .map_or(Vec3::ONE, |texture| self.read(texture, vertices, weights, true).truncate());
        clean(emission * factor)
    }

    /// Whether the surface blocks light at a point: alpha is compared with the cutoff, or with one half for blending.
    pub fn stops_light(&self, vertices: [u32; 3], weights: [f32; 3]) -> bool {
        let cutoff = match self.material.alpha_mode {
            AlphaMode::Opaque => return true,
            AlphaMode::Mask { cutoff } => cutoff,
            AlphaMode::Blend => 0.5,
        };
        let texture = self.textures.as_ref().and_then(|textures| textures.base_color.as_ref());
        let texel = texture.map_or(1.0, |texture| self.read(texture, vertices, weights, true).w);
        self.material.alpha * texel * self.color(vertices, weights).w >= cutoff
    }

    /// The interpolated vertex colour; white without vertex colours.
    fn color(&self, vertices: [u32; 3], weights: [f32; 3]) -> Vec4 {
        if self.mesh.colors.is_empty() {
            return Vec4::ONE;
        }
        (0..3).map(|i| self.mesh.colors[vertices[i] as usize] * weights[i]).sum()
    }

    /// The texture's value at a point of a triangle; white if the mesh lacks the coordinates.
    fn read(&self, texture: &TextureReference, vertices: [u32; 3], weights: [f32; 3], srgb: bool) -> Vec4 {
        let uv = self.texture_coordinates(texture, vertices, weights);
        uv.map_or(Vec4::ONE, |uv| sample(texture, uv, srgb))
    }

    /// The coordinates in a texture of a point of a triangle, before the texture's own transform; `None` if the mesh lacks
    /// them.
    pub fn texture_coordinates(
        &self,
        texture: &TextureReference,
        vertices: [u32; 3],
        weights: [f32; 3],
    ) -> Option<Vec2> {
        let coordinates = if texture.tex_coord == 0 { &self.mesh.uv0 } else { &self.mesh.uv1 };
        let at = |i: usize| coordinates[vertices[i] as usize] * weights[i];
        (!coordinates.is_empty()).then(|| (0..3).map(at).sum())
    }
}

/// The diffuse reflectance that stands for the highlight of a side of a material.
pub(crate) fn reflectance_as_metal(material: &Material, side: &Surface) -> Vec3 {
    if !material.reflects_as_metal() {
        return Vec3::ZERO;
    }
    SurfaceSample { lobe: material.lobe, ..SurfaceSample::from(side) }.reflectance_as_metal().as_vec3()
}

/// Replaces negative, infinite and NaN channels by 0.
fn clean(color: Vec3) -> Vec3 {
    Vec3::from_array(color.to_array().map(|c| if c.is_finite() { c.max(0.0) } else { 0.0 }))
}
