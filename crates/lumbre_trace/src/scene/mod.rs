//! The World as the tracer reads it, once: objects, lights, settings, and the surfaces that rays meet. Not the light.

mod collect;
mod emissive_polygons;
mod object;
mod texture;

use bevy_ecs::world::World;
use glam::{DVec2, DVec3};
use lumbre_optics::{AlphaMode, ReflectionModel};
use lumbre_scene::SceneSettings;

use crate::TraceError;
use crate::fingerprint::{Fingerprint, of_debug};
use crate::geometry::{Crossing, Geometry, Place};

pub(crate) use collect::PlacedLight;
pub(crate) use emissive_polygons::EmissivePolygon;
pub(crate) use object::{Object, Passage};
pub(crate) use texture::{sample_color, sample_lightmap, sample_linear};

/// The scene.
#[derive(Debug)]
pub(crate) struct Scene {
    pub settings: SceneSettings,
    /// Where the tracer's origin stands in the world, metres.
    pub origin: DVec3,
    pub objects: Vec<Object>,
    pub lights: Vec<PlacedLight>,
    /// Faces that light others in a frame.
    pub polygons: Vec<EmissivePolygon>,
    pub geometry: Geometry,
    /// Of every object, what rays ask of all that they meet.
    passable: Vec<Passable>,
    /// Some objects let light past in part.
    pub see_through: bool,
    /// Some objects have holes by their texture.
    pub holes: bool,
    /// Some objects have an inside that light is refracted into.
    pub solids: bool,
    /// What was left out, and why.
    pub notes: Vec<String>,
}

/// What becomes of a ray at an object, in few bytes: rays ask it of thousands of triangles a pixel.
#[derive(Clone, Copy, Debug)]
struct Passable {
    passage: Passage,
    shows_back: bool,
    thin: bool,
    solid: bool,
}

/// From so many metres off the world's origin on, the tracer has an origin of its own, as a frame has.
const FAR: f64 = 512.0;
/// As many triangles as the hierarchy numbers.
const MOST_TRIANGLES: usize = 1 << 29;

impl Scene {
    /// Reads a World whose global transforms are up to date, seen from an eye, with its lightmaps and its irradiance volumes or without.
    pub fn new(
        world: &mut World,
        eye: DVec3,
        reflection: Option<ReflectionModel>,
        baked_light: [bool; 2],
    ) -> Result<Self, TraceError> {
        let origin = if eye.length() > FAR { eye } else { DVec3::ZERO };
        let collected = collect::collect(world, origin, reflection, baked_light)?;
        let exact = |index: usize| collected.quadrics.iter().any(|(own, _)| *own == index);
        let mut triangles = Vec::new();
        for (index, object) in collected.objects.iter().enumerate().filter(|(index, _)| !exact(*index)) {
            if triangles.len() + object.shape.triangle_count() > MOST_TRIANGLES {
                let triangles = triangles.len() + object.shape.triangle_count();
                return Err(TraceError::TooManyTriangles { triangles });
            }
            for (number, corners) in (0u32..).zip(object.shape.triangles()) {
                triangles
                    .push((object.corners(corners).map(|corner| corner.as_vec3()), (index as u32, number)));
            }
        }
        let quadrics: Vec<_> = collected
            .quadrics
            .iter()
            .map(|(index, quadric)| {
                let object = &collected.objects[*index];
                (*index, quadric.clone(), object.place, object.normals)
            })
            .collect();
        let passable: Vec<Passable> = collected.objects.iter().map(Passable::of).collect();
        let is_open = |found: &Passable| matches!(found.passage, Passage::Clear | Passage::Covering);
        Ok(Self {
            see_through: passable.iter().any(is_open),
            holes: passable.iter().any(|found| found.passage == Passage::Cut),
            solids: passable.iter().any(|found| found.solid),
            passable,
            geometry: Geometry::build(triangles, &quadrics),
            settings: collected.settings,
            origin,
            objects: collected.objects,
            lights: collected.lights,
            polygons: collected.polygons,
            notes: collected.notes,
        })
    }

    /// Whether a ray that looks sees a surface there: not the back of what has none, nor a hole in a texture.
    pub fn is_seen(&self, crossing: &Crossing) -> bool {
        (crossing.front || self.passable[crossing.object].shows_back) && self.blocks(crossing)
    }

    /// Whether a surface stands in the light's way there, wholly or in part: both sides do.
    pub fn blocks(&self, crossing: &Crossing) -> bool {
        self.passable[crossing.object].passage != Passage::Cut || !self.is_hole(crossing)
    }

    /// How rays get past an object.
    pub fn passage(&self, object: usize) -> Passage {
        self.passable[object].passage
    }

    /// Whether an object has an inside that light is refracted into.
    pub fn is_solid(&self, object: usize) -> bool {
        self.passable[object].solid
    }

    /// Whether light gets past an object there in part, straight on, and solids that refract count too or not.
    pub fn is_open(&self, object: usize, with_solids: bool) -> bool {
        let object = self.passable[object];
        match object.passage {
            Passage::Covering => true,
            Passage::Clear => with_solids || object.thin,
            Passage::Closed | Passage::Cut => false,
        }
    }

    /// A hash of all that rays can tell of it.
    pub fn fingerprint(&self) -> Fingerprint {
        of_debug(&(&self.settings, self.origin, &self.objects, &self.lights, self.geometry.exact_surfaces()))
    }

    /// Whether some objects are lit by lightmaps or irradiance volumes.
    pub fn has_baked_light(&self) -> bool {
        self.objects.iter().any(|object| object.lightmap.is_some() || object.volume.is_some())
    }

    fn is_hole(&self, crossing: &Crossing) -> bool {
        let object = &self.objects[crossing.object];
        match object.material.alpha_mode {
            AlphaMode::Mask { cutoff } => object.alpha(&crossing.place) < f64::from(cutoff),
            AlphaMode::Opaque | AlphaMode::Blend => false,
        }
    }
}

impl Passable {
    fn of(object: &Object) -> Self {
        Self {
            passage: object.passage(),
            shows_back: object.shows_back(),
            thin: object.medium.thin,
            solid: object.is_solid(),
        }
    }
}

impl Object {
    /// The corners of a triangle in the tracer's space, counter-clockwise seen from its front.
    pub fn corners(&self, triangle: [u32; 3]) -> [DVec3; 3] {
        let [a, b, c] = triangle
            .map(|vertex| self.place.transform_point3(self.shape.positions[vertex as usize].as_dvec3()));
        if self.mirrored { [a, c, b] } else { [a, b, c] }
    }

    /// The vertices of a triangle in the same order, and the weights of a place in it.
    pub fn vertices(&self, triangle: u32, [second, third]: [f64; 2]) -> ([usize; 3], [f64; 3]) {
        let first = 3 * triangle as usize;
        let at = |next: usize| self.shape.indices.get(first + next).map_or(0, |vertex| *vertex as usize);
        let order = if self.mirrored { [at(0), at(2), at(1)] } else { [at(0), at(1), at(2)] };
        (order, [1.0 - second - third, second, third])
    }

    /// Texture coordinates of a set; 0 on exact surfaces and in meshes without them.
    pub fn coordinates(&self, set: u32, vertices: [usize; 3], weights: [f64; 3]) -> DVec2 {
        let list = if set == 0 { &self.shape.uv0 } else { &self.shape.uv1 };
        let uv = |corner: usize| list.get(vertices[corner]).map_or(DVec2::ZERO, |uv| uv.as_dvec2());
        (0..3).map(|corner| uv(corner) * weights[corner]).sum()
    }

    /// Opacity at a place, whatever is done with it: factor, texture and vertex colour.
    pub fn alpha(&self, place: &Place) -> f64 {
        let mut alpha = f64::from(self.material.alpha);
        let Place::Triangle { triangle, weights } = *place else { return alpha };
        let (vertices, weights) = self.vertices(triangle, weights);
        if let Some(texture) = &self.textures.base_color {
            alpha *= sample_color(texture, self.coordinates(texture.tex_coord, vertices, weights)).w;
        }
        if !self.shape.colors.is_empty() {
            let of = |corner: usize| f64::from(self.shape.colors[vertices[corner]].w) * weights[corner];
            alpha *= (0..3).map(of).sum::<f64>();
        }
        alpha
    }
}
