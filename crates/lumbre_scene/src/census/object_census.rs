//! Counts over the traits of shown objects, kept up to date as objects come, change and go. What the scene sets is not in it.

use lumbre_optics::{AlphaMode, ReflectionModel, Shading};

use super::object::{Mobility, ObjectTraits};
use crate::MaterialTextures;

/// What the shown objects of a scene call for, whatever the scene sets.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct ObjectCensus {
    /// Objects that are shown.
    pub meshes: usize,
    /// Their triangles.
    pub triangles: usize,
    /// Objects that the baker lights.
    pub static_objects: usize,
    /// Objects that move.
    pub dynamic_objects: usize,
    /// Objects that are lit by a lightmap.
    pub lightmapped: usize,
    /// Of these, the blended ones.
    pub lightmapped_blended: usize,
    /// Lit objects without a lightmap.
    pub without_lightmap: usize,
    /// Objects by texture, in the order of [`MaterialTextures::slots`].
    pub textures: [usize; MaterialTextures::SLOTS],
    /// Objects with a texture of any kind.
    pub textured: usize,
    /// Objects with vertex colours.
    pub vertex_colors: usize,
    /// Objects that are cut out by alpha.
    pub alpha_mask: usize,
    /// Objects that are blended.
    pub alpha_blend: usize,
    /// Objects whose material is double-sided.
    pub double_sided: usize,
    /// Of these, those with a material of its own on the back.
    pub back_materials: usize,
    /// Objects that take no light.
    pub unlit: usize,
    /// Objects whose front emits light.
    pub glowing: usize,
    /// Objects of which only the back emits light.
    pub glowing_behind: usize,
    /// Objects whose faces light others in real time.
    pub emissive_lights: usize,
    /// Lit objects by their own rate of evaluation: none of its own first, then as [`Shading::ALL`], and last by need.
    pub shading: [usize; 2 + Shading::ALL.len()],
    /// Lit objects by their own specular model: none of its own first, then as [`ReflectionModel::ALL`].
    pub reflection: [usize; 1 + ReflectionModel::ALL.len()],
    /// As `reflection`, of those with a highlight.
    pub highlights: [usize; 1 + ReflectionModel::ALL.len()],
    /// Objects that mirror.
    pub mirrors: usize,
    /// Objects that can be drawn with what they mirror: flat ones.
    pub planar_mirrors: usize,
    /// Objects that light passes through.
    pub transmission: usize,
    /// Objects that can be drawn with what lies behind them.
    pub refractive: usize,
    /// Of these, those that are lit by a lightmap.
    pub lightmapped_refractive: usize,
}

/// 0 for none, or one more than the place among all.
fn choice<T: PartialEq>(own: Option<T>, all: &[T]) -> usize {
    own.and_then(|own| all.iter().position(|one| *one == own)).map_or(0, |place| place + 1)
}

/// The place of [`Shading::Auto`] among rates of evaluation.
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

    /// Counts one more object, of so many triangles.
    pub fn add(&mut self, traits: &ObjectTraits, triangles: usize) {
        self.count(traits, triangles, |counter, number| *counter += number);
    }

    /// Takes away an object that was counted.
    pub fn remove(&mut self, traits: &ObjectTraits, triangles: usize) {
        self.count(traits, triangles, |counter, number| *counter -= number);
    }

    fn count(&mut self, traits: &ObjectTraits, triangles: usize, change: impl Fn(&mut usize, usize)) {
        let blended = traits.alpha_mode == AlphaMode::Blend;
        let by_lightmap = traits.is_lit_by_lightmap();
        change(&mut self.triangles, triangles);
        for (counter, counts) in [
            (&mut self.meshes, true),
            (&mut self.static_objects, traits.mobility == Mobility::Static),
            (&mut self.dynamic_objects, traits.mobility == Mobility::Dynamic),
            (&mut self.lightmapped, by_lightmap),
            (&mut self.lightmapped_blended, by_lightmap && blended),
            (&mut self.without_lightmap, traits.is_lit_by_irradiance_volume()),
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
        for (slot, counter) in self.textures.iter_mut().enumerate() {
            change(counter, usize::from(traits.texture_mask & (1 << slot) != 0));
        }
    }

    /// Lit objects shaded at this rate in a scene that sets `scene`.
    pub fn shaded(&self, rate: Shading, scene: Shading) -> usize {
        self.shading[shading_choice(Some(rate))] + usize::from(rate == scene) * self.shading[0]
    }

    /// Lit objects shaded by need, to whatever error, in a scene that sets `scene`.
    pub fn shaded_by_need(&self, scene: Shading) -> usize {
        self.shading[BY_NEED] + if let Shading::Auto { .. } = scene { self.shading[0] } else { 0 }
    }

    /// Lit objects with a highlight of this model in a scene that sets `scene`.
    pub fn highlights_of(&self, model: ReflectionModel, scene: ReflectionModel) -> usize {
        self.highlights[choice(Some(model), ReflectionModel::ALL)]
            + usize::from(model == scene) * self.highlights[0]
    }
}
