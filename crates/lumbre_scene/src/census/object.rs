//! What the components of one object say: all that decides its pass and its shader variant, and what is counted of it. Not those decisions.

use bevy_ecs::prelude::*;
use glam::Vec3;
use lumbre_mesh::{MeshPlane, TriangleMesh};
use lumbre_optics::{AlphaMode, Distribution, Fresnel, Lobe, Material, ReflectionModel, Shading, Surface};

use crate::{
    DynamicObject, EmissiveLight, Lightmap, MaterialTextures, Medium, Mesh, StaticObject, hidden_entities,
};

/// What matters of one object. Equal traits have equal shader variants in every frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ObjectTraits {
    /// Which textures its material has, a bit for each of [`MaterialTextures::slots`].
    pub texture_mask: u8,
    /// Which of them read the second set of texture coordinates.
    pub second_set: u8,
    /// Whether its vertices have colours.
    pub vertex_color: bool,
    /// How alpha is taken.
    pub alpha_mode: AlphaMode,
    /// Whether its back is drawn.
    pub double_sided: bool,
    /// Whether its back, where it is drawn, has a material of its own.
    pub back_material: bool,
    /// Whether it takes no light.
    pub unlit: bool,
    /// Whether its front emits light.
    pub glows: bool,
    /// Whether its back, where it is drawn and has a material of its own, emits light.
    pub back_glows: bool,
    /// Whether its faces light others in real time.
    pub lights_others: bool,
    /// Whether any light makes a highlight on it.
    pub specular: bool,
    /// Whether a highlight may be sharper than plain powers can tell.
    pub sharp: bool,
    /// Whether it has a lightmap, and coordinates for it.
    pub lightmapped: bool,
    /// Whether its highlight is as glTF has it.
    pub energy_keeping: bool,
    /// How its microfacets are distributed, for Torrance and Sparrow's model.
    pub distribution: Distribution,
    /// Its Fresnel reflectance, for the same model.
    pub fresnel: Fresnel,
    /// Its own rate of evaluation, instead of the scene's.
    pub shading: Option<Shading>,
    /// Its own specular model, instead of the scene's.
    pub reflection: Option<ReflectionModel>,
    /// Whether it mirrors.
    pub mirrors: bool,
    /// Whether what it mirrors can be drawn as a view of its own: it mirrors (or reflects by Fresnel's equations what it does not let through),
    /// is flat, and neither blended, unlit nor roughened by a normal texture.
    pub planar_mirror: bool,
    /// Whether light passes through it.
    pub transmits: bool,
    /// Whether what lies behind it can be drawn through it: light passes, and it is neither blended nor unlit.
    pub refracts: bool,
    /// What the baker makes of it.
    pub mobility: Mobility,
}

/// What the baker makes of an object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Mobility {
    /// It is lit by the baker.
    Static,
    /// It moves: the baker leaves it out.
    Dynamic,
    /// It says neither.
    #[default]
    Unsaid,
}

/// The components that an object's traits follow from, as a query's data.
pub type ObjectComponents = (
    (&'static Mesh, &'static Material, Option<&'static MaterialTextures>, Option<&'static Lightmap>),
    (Option<&'static Shading>, Option<&'static ReflectionModel>, Option<&'static Medium>),
    (Has<StaticObject>, Has<DynamicObject>, Has<EmissiveLight>),
);

/// What a query of [`ObjectComponents`] finds.
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
            energy_keeping: material.lobe == Lobe::EnergyKeeping,
            distribution: material.distribution,
            fresnel: material.fresnel,
            shading: shading.copied(),
            reflection: reflection.copied(),
            mirrors: material.mirror != Vec3::ZERO,
            planar_mirror: planar_mirror(mesh, material, maps, medium).is_some(),
            transmits: material.transmission != Vec3::ZERO,
            refracts: material.transmission != Vec3::ZERO
                && material.alpha_mode != AlphaMode::Blend
                && !material.unlit,
            mobility: match (moves, fixed) {
                (true, _) => Mobility::Dynamic,
                (false, true) => Mobility::Static,
                (false, false) => Mobility::Unsaid,
            },
        }
    }

    /// Whether its light comes from a lightmap, where lightmaps are used.
    pub fn is_lit_by_lightmap(&self) -> bool {
        self.lightmapped && !self.unlit
    }

    /// Whether its light comes from an irradiance volume, where there is one: it has no lightmap, whether lightmaps are used or not.
    pub fn is_lit_by_irradiance_volume(&self) -> bool {
        !self.lightmapped && !self.unlit
    }
}

/// The plane of an object, in its mesh's space, where what it mirrors can be drawn as a view of its own.
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

/// The traits and the number of triangles of each object of a World that is shown.
pub fn shown_objects(world: &mut World) -> Vec<(ObjectTraits, usize)> {
    let hidden = hidden_entities(world);
    let mut query = world.query::<(Entity, ObjectComponents)>();
    let shown = query.iter(world).filter(|(entity, _)| !hidden.contains(entity));
    shown.map(|(_, object)| (ObjectTraits::new(object), object.0.0.0.triangle_count())).collect()
}
