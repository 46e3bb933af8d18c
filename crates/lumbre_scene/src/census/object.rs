//! The traits of one object, derived from its components: everything that decides its pass and shader variant
//! and that the census counts. The decisions are made in the renderer.

use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use lumbre_mesh::{MeshPlane, TriangleMesh};
use lumbre_optics::{
    AlphaMode, Distribution, Fresnel, Lobe, Material, ReflectionModel, Shading, Surface, metal_reflectance,
};

use crate::{
    DynamicObject, EmissiveLight, Lightmap, MaterialTextures, Medium, Mesh, StaticObject, hidden_entities,
};

/// The traits of one object. Objects with equal traits use the same shader variants in every frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ObjectTraits {
    /// The texture slots that are filled: bit i for slot i of [`MaterialTextures::slots`].
    pub texture_mask: u8,
    /// The slots among them that read the second set of texture coordinates, as a bit mask too.
    pub second_set: u8,
    /// Whether its mesh has vertex colours.
    pub vertex_color: bool,
    /// Opaque, masked or blended.
    pub alpha_mode: AlphaMode,
    /// Whether its back faces are drawn.
    pub double_sided: bool,
    /// Whether its back faces are drawn with a separate material.
    pub back_material: bool,
    /// Whether it is unlit.
    pub unlit: bool,
    /// Whether its front emits light.
    pub glows: bool,
    /// Whether its back faces are drawn with a separate material that emits light.
    pub back_glows: bool,
    /// Whether its emissive faces light other objects in real time.
    pub lights_others: bool,
    /// Whether it has specular reflection, on either side or by a metallic-roughness texture.
    pub specular: bool,
    /// Whether the exponent of its highlight may exceed `lumbre_optics::SHARP_SHININESS`, which needs the
    /// shader feature for sharp highlights.
    pub sharp: bool,
    /// Whether it has a lightmap and texture coordinates for it.
    pub lightmapped: bool,
    /// Whether its specular lobe is glTF's energy-conserving one.
    pub energy_conserving: bool,
    /// Whether it reflects baked light like a metal: its lobe is energy-conserving, it neither mirrors nor
    /// transmits light, and its specular coefficient, on either side or by a metallic-roughness texture,
    /// exceeds that of a dielectric.
    pub metal: bool,
    /// Its microfacet distribution, for the Torrance-Sparrow model.
    pub distribution: Distribution,
    /// Its Fresnel reflectance, for the Torrance-Sparrow model.
    pub fresnel: Fresnel,
    /// Its own shading rate, which overrides the scene's.
    pub shading: Option<Shading>,
    /// Its own reflection model, which overrides the scene's.
    pub reflection: Option<ReflectionModel>,
    /// Whether its material has mirror reflection.
    pub mirrors: bool,
    /// Whether its reflection can be drawn as a view of its own: it mirrors (or reflects by the Fresnel
    /// equations what it does not transmit), is flat, and is neither blended nor unlit nor normal-mapped.
    pub planar_mirror: bool,
    /// Whether it transmits light.
    pub transmits: bool,
    /// Whether the scene behind it can be drawn through it: it transmits light and is neither blended nor
    /// unlit.
    pub refracts: bool,
    /// How light would pass through it.
    pub refractive_shape: RefractiveShape,
    /// Whether the baker includes it.
    pub mobility: Mobility,
}

/// How light passes through an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RefractiveShape {
    /// Straight through both faces of a sheet.
    Sheet,
    /// Through a flat surface, such as that of a pool, and not out again: it has no back face.
    Surface,
    /// Into a body, and out through one of its back faces.
    Body,
}

impl RefractiveShape {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Sheet, Self::Surface, Self::Body];

    /// Returns that of an object that is thin, as its [`Medium`] says, or not. `flat` is whether it is flat and its
    /// reflection can be drawn as a view of its own ([`ObjectTraits::planar_mirror`]).
    pub fn new(thin: bool, flat: bool) -> Self {
        match (thin, flat) {
            (true, _) => Self::Sheet,
            (false, true) => Self::Surface,
            (false, false) => Self::Body,
        }
    }
}

/// Whether an object is static or moves, as its marker components say.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Mobility {
    /// The baker includes it.
    Static,
    /// It moves, so the baker leaves it out.
    Dynamic,
    /// It has neither marker.
    #[default]
    Unsaid,
}

/// The query data from which an object's traits are derived.
pub type ObjectComponents = (
    (&'static Mesh, &'static Material, Option<&'static MaterialTextures>, Option<&'static Lightmap>),
    (Option<&'static Shading>, Option<&'static ReflectionModel>, Option<&'static Medium>),
    (Has<StaticObject>, Has<DynamicObject>, Has<EmissiveLight>),
);

/// The item that a query of [`ObjectComponents`] yields.
pub type ObjectItem<'w> = (
    (&'w Mesh, &'w Material, Option<&'w MaterialTextures>, Option<&'w Lightmap>),
    (Option<&'w Shading>, Option<&'w ReflectionModel>, Option<&'w Medium>),
    (bool, bool, bool),
);

impl ObjectTraits {
    /// The traits of an object with these components.
    pub fn new((look, (shading, reflection, medium), (fixed, moves, shines)): ObjectItem<'_>) -> Self {
        let (mesh, material, maps, lightmap) = look;
        let mesh: &TriangleMesh = &mesh.0;
        let back = material.back.as_ref();
        let own_back = back.filter(|_| material.double_sided);
        let roughness_map = maps.is_some_and(|maps| maps.metallic_roughness.is_some());
        let planar_mirror = planar_mirror(mesh, material, maps, medium).is_some();
        let shines_back = |of: fn(&Surface) -> Vec3| back.is_some_and(|back| of(back) != Vec3::ZERO);
        Self {
            texture_mask: maps.map_or(0, MaterialTextures::slot_mask),
            second_set: maps.map_or(0, MaterialTextures::second_set_mask),
            vertex_color: !mesh.colors.is_empty(),
            alpha_mode: material.alpha_mode,
            double_sided: material.double_sided,
            back_material: own_back.is_some(),
            unlit: material.unlit,
            glows: material.front.emission != Vec3::ZERO,
            back_glows: own_back.is_some_and(|back| back.emission != Vec3::ZERO),
            lights_others: shines && EmissiveLight::radiance(material) != [Vec3::ZERO; 2],
            specular: material.front.specular != Vec3::ZERO
                || shines_back(|back| back.specular)
                || roughness_map,
            sharp: material.front.has_sharp_highlight()
                || back.is_some_and(Surface::has_sharp_highlight)
                || roughness_map,
            lightmapped: lightmap.is_some() && !mesh.uv1.is_empty(),
            energy_conserving: material.lobe == Lobe::EnergyConserving,
            metal: is_metal(material, maps),
            distribution: material.distribution,
            fresnel: material.fresnel,
            shading: shading.copied(),
            reflection: reflection.copied(),
            mirrors: material.mirror != Vec3::ZERO,
            planar_mirror,
            transmits: material.transmission != Vec3::ZERO,
            refracts: material.transmission != Vec3::ZERO
                && material.alpha_mode != AlphaMode::Blend
                && !material.unlit,
            refractive_shape: RefractiveShape::new(medium.is_some_and(|medium| medium.thin), planar_mirror),
            mobility: match (moves, fixed) {
                (true, _) => Mobility::Dynamic,
                (false, true) => Mobility::Static,
                (false, false) => Mobility::Unsaid,
            },
        }
    }

    /// Returns true if the object is lit by its lightmap whenever lightmaps are in use.
    pub fn is_lit_by_lightmap(&self) -> bool {
        self.lightmapped && !self.unlit
    }

    /// Returns true if the object is lit by an irradiance volume whenever there is one: it is lit and has no
    /// lightmap. An object with a lightmap never uses a volume, even while lightmaps are switched off.
    pub fn is_lit_by_irradiance_volume(&self) -> bool {
        !self.lightmapped && !self.unlit
    }
}

/// Returns true if any part of a surface may be metal (see [`ObjectTraits::metal`]).
fn is_metal(material: &Material, maps: Option<&MaterialTextures>) -> bool {
    let reflects = |specular: Vec3| metal_reflectance(DVec3::ZERO, specular.as_dvec3(), 0.0) != DVec3::ZERO;
    let by_texture = maps.and_then(|maps| maps.metallic_roughness.as_ref());
    let sides = std::iter::once(&material.front).chain(&material.back);
    material.reflects_as_metal()
        && (sides.map(|side| side.specular).any(reflects)
            || by_texture.is_some_and(|slot| slot.metallic > 0.0 || reflects(slot.dielectric)))
}

/// The plane of a flat mirror in mesh space, or `None` if its reflection cannot be drawn as a view of its own
/// (see [`ObjectTraits::planar_mirror`]).
pub fn planar_mirror(
    mesh: &TriangleMesh,
    material: &Material,
    maps: Option<&MaterialTextures>,
    medium: Option<&Medium>,
) -> Option<MeshPlane> {
    let reflects_by_fresnel =
        material.transmission != Vec3::ZERO && medium.is_some_and(|medium| medium.fresnel);
    let even = maps.is_none_or(|maps| maps.normal.is_none());
    let seen_whole = material.alpha_mode != AlphaMode::Blend && !material.unlit;
    let mirrors = material.mirror != Vec3::ZERO || reflects_by_fresnel;
    if mirrors && even && seen_whole { mesh.plane() } else { None }
}

/// The traits and the triangle count of each object of a World that is not hidden.
pub fn shown_objects(world: &mut World) -> Vec<(ObjectTraits, usize)> {
    let hidden = hidden_entities(world);
    let mut query = world.query::<(Entity, ObjectComponents)>();
    let shown = query.iter(world).filter(|(entity, _)| !hidden.contains(entity));
    shown.map(|(_, object)| (ObjectTraits::new(object), object.0.0.0.triangle_count())).collect()
}
