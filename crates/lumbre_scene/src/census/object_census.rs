//! Counts over the traits of visible objects, updated incrementally as objects are added, changed and
//! removed. They do not depend on the scene's settings.

use lumbre_optics::{AlphaMode, ReflectionModel, Shading};

use super::object::{Mobility, ObjectTraits, RefractiveShape};
use crate::MaterialTextures;

/// Counts over the objects of a scene that are not hidden, independent of the scene's settings.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct ObjectCensus {
    /// Objects that are not hidden.
    pub meshes: usize,
    /// Their triangles.
    pub triangles: usize,
    /// Static objects that are lit: those that the baker includes.
    pub static_objects: usize,
    /// Objects marked as moving.
    pub dynamic_objects: usize,
    /// Objects lit by a lightmap.
    pub lightmapped: usize,
    /// Of these, objects with alpha blending.
    pub lightmapped_blended: usize,
    /// Lit objects without a lightmap.
    pub without_lightmap: usize,
    /// Metals lit by a lightmap.
    pub lightmapped_metals: usize,
    /// Lit metals without a lightmap.
    pub metals_without_lightmap: usize,
    /// Objects with each texture, in the order of [`MaterialTextures::slots`].
    pub textures: [usize; MaterialTextures::SLOTS],
    /// Objects with a texture of any kind.
    pub textured: usize,
    /// Objects with vertex colours.
    pub vertex_colors: usize,
    /// Objects with an alpha mask.
    pub alpha_mask: usize,
    /// Objects with alpha blending.
    pub alpha_blend: usize,
    /// Objects whose material is double-sided.
    pub double_sided: usize,
    /// Of these, objects with a separate material on the back.
    pub back_materials: usize,
    /// Unlit objects.
    pub unlit: usize,
    /// Objects whose front emits light.
    pub glowing: usize,
    /// Objects of which only the back emits light.
    pub glowing_behind: usize,
    /// Objects whose emissive faces light others in real time.
    pub emissive_lights: usize,
    /// Lit objects by their own shading rate: index 0 for objects that take the scene's, then those of
    /// [`Shading::ALL`] in order, and last shading by need.
    pub shading: [usize; 2 + Shading::ALL.len()],
    /// Lit objects by their own reflection model: index 0 for objects that take the scene's, then those of
    /// [`ReflectionModel::ALL`] in order.
    pub reflection: [usize; 1 + ReflectionModel::ALL.len()],
    /// As `reflection`, for objects with specular reflection only.
    pub highlights: [usize; 1 + ReflectionModel::ALL.len()],
    /// Objects with mirror reflection.
    pub mirrors: usize,
    /// Mirroring objects that are flat, so that the reflection can be drawn as a view of its own.
    pub planar_mirrors: usize,
    /// Objects that transmit light.
    pub transmission: usize,
    /// Transmissive objects through which the scene behind them can be drawn.
    pub refractive: usize,
    /// Their triangles.
    pub refractive_triangles: usize,
    /// Of these objects, those of each of [`RefractiveShape::ALL`].
    pub refractive_shapes: [usize; RefractiveShape::ALL.len()],
    /// Of these objects, those lit by a lightmap.
    pub lightmapped_refractive: usize,
}

/// The index of a choice in the counters: 0 for none, otherwise 1 plus its index in `all`.
fn choice<T: PartialEq>(own: Option<T>, all: &[T]) -> usize {
    own.and_then(|own| all.iter().position(|one| *one == own)).map_or(0, |place| place + 1)
}

/// The index of [`Shading::Auto`] in the counters of shading rates.
const BY_NEED: usize = 1 + Shading::ALL.len();

fn shading_choice(own: Option<Shading>) -> usize {
    match own {
        Some(Shading::Auto { .. }) => BY_NEED,
        own => choice(own, Shading::ALL),
    }
}

impl ObjectCensus {
    /// Counts objects.
    pub fn of<'t>(objects: impl IntoIterator<Item = &'t (ObjectTraits, usize)>) -> Self {
        let mut census = Self::default();
        for (traits, triangles) in objects {
            census.add(traits, *triangles);
        }
        census
    }

    /// Adds an object with this many triangles.
    pub fn add(&mut self, traits: &ObjectTraits, triangles: usize) {
        self.count(traits, triangles, |counter, number| *counter += number);
    }

    /// Removes an object that was added with the same arguments.
    pub fn remove(&mut self, traits: &ObjectTraits, triangles: usize) {
        self.count(traits, triangles, |counter, number| *counter -= number);
    }

    fn count(&mut self, traits: &ObjectTraits, triangles: usize, change: impl Fn(&mut usize, usize)) {
        let blended = traits.alpha_mode == AlphaMode::Blend;
        let by_lightmap = traits.is_lit_by_lightmap();
        change(&mut self.triangles, triangles);
        change(&mut self.refractive_triangles, if traits.refracts { triangles } else { 0 });
        for (counter, counts) in [
            (&mut self.meshes, true),
            (&mut self.static_objects, traits.mobility == Mobility::Static && !traits.unlit),
            (&mut self.dynamic_objects, traits.mobility == Mobility::Dynamic),
            (&mut self.lightmapped, by_lightmap),
            (&mut self.lightmapped_blended, by_lightmap && blended),
            (&mut self.without_lightmap, traits.is_lit_by_irradiance_volume()),
            (&mut self.lightmapped_metals, by_lightmap && traits.metal),
            (&mut self.metals_without_lightmap, traits.is_lit_by_irradiance_volume() && traits.metal),
            (&mut self.textured, traits.texture_mask != 0),
            (&mut self.vertex_colors, traits.vertex_color),
            (&mut self.alpha_mask, matches!(traits.alpha_mode, AlphaMode::Mask { .. })),
            (&mut self.alpha_blend, blended),
            (&mut self.double_sided, traits.double_sided),
            (&mut self.back_materials, traits.back_material),
            (&mut self.unlit, traits.unlit),
            (&mut self.glowing, traits.glows),
            (&mut self.glowing_behind, traits.back_glows && !traits.glows),
            (&mut self.emissive_lights, traits.lights_others),
            (&mut self.shading[shading_choice(traits.shading)], !traits.unlit),
            (&mut self.reflection[choice(traits.reflection, ReflectionModel::ALL)], !traits.unlit),
            (
                &mut self.highlights[choice(traits.reflection, ReflectionModel::ALL)],
                !traits.unlit && traits.specular,
            ),
            (&mut self.mirrors, traits.mirrors),
            (&mut self.planar_mirrors, traits.planar_mirror),
            (&mut self.transmission, traits.transmits),
            (&mut self.refractive, traits.refracts),
            (&mut self.lightmapped_refractive, traits.refracts && by_lightmap),
        ] {
            change(counter, usize::from(counts));
        }
        for (shape, counter) in RefractiveShape::ALL.iter().zip(&mut self.refractive_shapes) {
            change(counter, usize::from(traits.refracts && traits.refractive_shape == *shape));
        }
        for (slot, counter) in self.textures.iter_mut().enumerate() {
            change(counter, usize::from(traits.texture_mask & (1 << slot) != 0));
        }
    }

    /// Number of lit objects shaded at this rate if the scene's shading is `scene`.
    pub fn shaded(&self, rate: Shading, scene: Shading) -> usize {
        self.shading[shading_choice(Some(rate))] + usize::from(rate == scene) * self.shading[0]
    }

    /// Number of lit objects shaded by need, with any error bound, if the scene's shading is `scene`.
    pub fn shaded_by_need(&self, scene: Shading) -> usize {
        self.shading[BY_NEED] + if let Shading::Auto { .. } = scene { self.shading[0] } else { 0 }
    }

    /// Number of lit objects with specular reflection of this model if the scene's model is `scene`.
    pub fn highlights_of(&self, model: ReflectionModel, scene: ReflectionModel) -> usize {
        self.highlights[choice(Some(model), ReflectionModel::ALL)]
            + usize::from(model == scene) * self.highlights[0]
    }
}
