//! The World as the tracer reads it, once: objects, lights, settings and the surfaces that rays hit. Light
//! transport is not here.

mod collect;
mod emissive_polygons;
mod object;
mod texture;

use bevy_ecs::world::World;
use glam::{DVec2, DVec3};
use lumbre_optics::{AlphaMode, ReflectionModel, try_normalize};
use lumbre_scene::SceneSettings;

use crate::TraceError;
use crate::fingerprint::{Fingerprint, of_debug};
use crate::geometry::{Candidate, Geometry, Place};

pub(crate) use collect::PlacedLight;
pub(crate) use emissive_polygons::EmissivePolygon;
pub(crate) use object::{Object, Passage};
pub(crate) use texture::{sample_color, sample_lightmap, sample_linear};

/// The scene of a picture.
#[derive(Debug)]
pub(crate) struct Scene {
    pub settings: SceneSettings,
    /// Position of the tracer's origin in the world, metres.
    pub origin: DVec3,
    pub objects: Vec<Object>,
    pub lights: Vec<PlacedLight>,
    /// Faces that light other objects in a frame.
    pub polygons: Vec<EmissivePolygon>,
    pub geometry: Geometry,
    /// For every object, what rays need to know of it.
    passable: Vec<Passable>,
    /// Whether any object lets part of the light pass, by transmission or alpha blending.
    pub see_through: bool,
    /// Opposite corners of a box around everything that covers its background in part; `None` if nothing does.
    covered: Option<[DVec3; 2]>,
    /// Whether light passes any object, or some of its holes, as if it were not there: by an alpha mask, or because it is
    /// unlit.
    pub holes: bool,
    /// Whether any object is a refracting solid.
    pub solids: bool,
    /// What was left out, and why.
    pub notes: Vec<String>,
}

/// How an object affects rays, in few bytes, since it is read for thousands of triangles per pixel.
#[derive(Clone, Copy, Debug)]
struct Passable {
    passage: Passage,
    shows_back: bool,
    thin: bool,
    solid: bool,
    /// It shows its colour to the viewer and takes no part in the light.
    unlit: bool,
}

/// Beyond this distance of the eye from the world's origin, in metres, the eye becomes the tracer's origin,
/// as in a frame.
const FAR: f64 = 512.0;
/// Margin of the box around everything that covers its background in part, as a fraction of its largest
/// coordinate: more than the distance at which surfaces count as coplanar.
const COVERING_MARGIN: f64 = 1e-3;
/// Largest number of triangles that the hierarchy can index.
const MAX_TRIANGLES: usize = 1 << 29;

impl Scene {
    /// Reads a World whose global transforms are up to date, for an eye. `baked_light` says whether lightmaps
    /// and irradiance volumes are read.
    pub fn new(
        world: &mut World,
        eye: DVec3,
        reflection: Option<ReflectionModel>,
        baked_light: [bool; 2],
    ) -> Result<Self, TraceError> {
        let origin = if eye.length() > FAR { eye } else { DVec3::ZERO };
        let collected = collect::collect(world, origin, reflection, baked_light)?;
        let exact = |index: usize| collected.quadrics.iter().any(|(own, _)| *own == index);
        let (mut triangles, mut counts) = (Vec::new(), Vec::with_capacity(collected.objects.len()));
        for (index, object) in collected.objects.iter().enumerate() {
            let count = if exact(index) { 0 } else { object.shape.triangle_count() };
            if triangles.len() + count > MAX_TRIANGLES {
                return Err(TraceError::TooManyTriangles { triangles: triangles.len() + count });
            }
            let corners = object.shape.triangles().take(count);
            triangles.extend(corners.map(|corners| object.corners(corners).map(|corner| corner.as_vec3())));
            counts.push(count as u32);
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
        // Glowing objects may be bulbs, which let the light of their lamp pass.
        let always_blocks = |index: usize| {
            let Passable { passage, unlit, .. } = passable[index];
            passage == Passage::Closed && !unlit && !collected.objects[index].glows()
        };
        let geometry = Geometry::build(&triangles, &counts, &quadrics, always_blocks);
        let is_open =
            |found: &Passable| !found.unlit && matches!(found.passage, Passage::Clear | Passage::Covering);
        Ok(Self {
            see_through: passable.iter().any(is_open),
            covered: box_of_coverings(&collected.objects, exact),
            holes: passable.iter().any(|found| found.unlit || found.passage == Passage::Cut),
            solids: passable.iter().any(|found| found.solid),
            passable,
            geometry,
            settings: collected.settings,
            origin,
            objects: collected.objects,
            lights: collected.lights,
            polygons: collected.polygons,
            notes: collected.notes,
        })
    }

    /// Returns true if a viewing ray sees the surface there: it is neither a culled back nor a hole in an
    /// alpha mask.
    pub fn is_seen(&self, candidate: &Candidate) -> bool {
        let Passable { shows_back, passage, .. } = self.passable[candidate.object];
        (candidate.front || shows_back) && (passage != Passage::Cut || !self.is_hole(candidate))
    }

    /// Returns true if the surface blocks light there, wholly or in part. Both sides do, but not the holes in
    /// an alpha mask, and unlit surfaces do not.
    pub fn blocks(&self, candidate: &Candidate) -> bool {
        let Passable { unlit, passage, .. } = self.passable[candidate.object];
        !unlit && (passage != Passage::Cut || !self.is_hole(candidate))
    }

    /// Returns how rays pass an object.
    pub fn passage(&self, object: usize) -> Passage {
        self.passable[object].passage
    }

    /// Returns true if a surface that covers its background in part, such as a decal, may lie over a point.
    pub fn may_be_covered(&self, point: DVec3) -> bool {
        self.covered.is_some_and(|[low, high]| point.cmpge(low).all() && point.cmple(high).all())
    }

    /// Returns true if an object is a refracting solid.
    pub fn is_solid(&self, object: usize) -> bool {
        self.passable[object].solid
    }

    /// Returns true if light passes an object in part, in a straight line; refracting solids count only if
    /// `with_solids`.
    pub fn is_open(&self, object: usize, with_solids: bool) -> bool {
        let object = self.passable[object];
        match object.passage {
            _ if object.unlit => false,
            Passage::Covering => true,
            Passage::Clear => with_solids || object.thin,
            Passage::Closed | Passage::Cut => false,
        }
    }

    /// Returns where a ray crosses a surface, and the unit geometric normal to its front there; 0 for a triangle
    /// without area.
    pub fn position_and_normal(&self, candidate: &Candidate) -> (DVec3, DVec3) {
        match candidate.place {
            Place::Exact { point, normal } => (point, normal),
            Place::Triangle { triangle, weights: [second, third] } => {
                let object = &self.objects[candidate.object];
                let first = 3 * triangle as usize;
                let [a, b, c] = object.corners([0, 1, 2].map(|next| object.shape.indices[first + next]));
                let normal = try_normalize((b - a).cross(c - a)).unwrap_or_default();
                (a + (b - a) * second + (c - a) * third, normal)
            }
        }
    }

    /// Returns a hash of everything that affects rays.
    pub fn fingerprint(&self) -> Fingerprint {
        of_debug(&(&self.settings, self.origin, &self.objects, &self.lights, self.geometry.exact_surfaces()))
    }

    /// Returns true if any object is lit by a lightmap or an irradiance volume.
    pub fn has_baked_light(&self) -> bool {
        self.objects.iter().any(|object| object.lightmap.is_some() || object.volume.is_some())
    }

    fn is_hole(&self, candidate: &Candidate) -> bool {
        let object = &self.objects[candidate.object];
        match object.material.alpha_mode {
            AlphaMode::Mask { cutoff } => object.alpha(&candidate.place) < f64::from(cutoff),
            AlphaMode::Opaque | AlphaMode::Blend => false,
        }
    }
}

/// Returns opposite corners of a box around all objects that cover their background in part, with a margin for
/// rounding. `exact` says whether an object is an exact surface, which may be infinite.
fn box_of_coverings(objects: &[Object], exact: impl Fn(usize) -> bool) -> Option<[DVec3; 2]> {
    let mut covered: Option<[DVec3; 2]> = None;
    for (index, object) in objects.iter().enumerate() {
        if object.passage() != Passage::Covering {
            continue;
        }
        if exact(index) {
            return Some([DVec3::NEG_INFINITY, DVec3::INFINITY]);
        }
        for position in &object.shape.positions {
            let point = object.place.transform_point3(position.as_dvec3());
            let [low, high] = covered.get_or_insert([point; 2]);
            (*low, *high) = (low.min(point), high.max(point));
        }
    }
    covered.map(|[low, high]| {
        let margin = COVERING_MARGIN * low.abs().max(high.abs()).max_element();
        [low - margin, high + margin]
    })
}

impl Passable {
    fn of(object: &Object) -> Self {
        Self {
            passage: object.passage(),
            shows_back: object.shows_back(),
            thin: object.medium.thin,
            solid: object.is_solid(),
            unlit: object.material.unlit,
        }
    }
}

impl Object {
    /// Returns the corners of a triangle in the tracer's space, counter-clockwise seen from its front.
    pub fn corners(&self, triangle: [u32; 3]) -> [DVec3; 3] {
        let [a, b, c] = triangle
            .map(|vertex| self.place.transform_point3(self.shape.positions[vertex as usize].as_dvec3()));
        if self.mirrored { [a, c, b] } else { [a, b, c] }
    }

    /// Returns the vertices of a triangle in the same order, and their weights at a place in it.
    pub fn vertices(&self, triangle: u32, [second, third]: [f64; 2]) -> ([usize; 3], [f64; 3]) {
        let first = 3 * triangle as usize;
        let at = |next: usize| self.shape.indices.get(first + next).map_or(0, |vertex| *vertex as usize);
        let order = if self.mirrored { [at(0), at(2), at(1)] } else { [at(0), at(1), at(2)] };
        (order, [1.0 - second - third, second, third])
    }

    /// Returns the texture coordinates of a set; 0 in meshes without them.
    pub fn coordinates(&self, set: u32, vertices: [usize; 3], weights: [f64; 3]) -> DVec2 {
        let list = if set == 0 { &self.shape.uv0 } else { &self.shape.uv1 };
        let uv = |corner: usize| list.get(vertices[corner]).map_or(DVec2::ZERO, |uv| uv.as_dvec2());
        (0..3).map(|corner| uv(corner) * weights[corner]).sum()
    }

    /// Returns the opacity at a place, from factor, texture and vertex colour, whatever the alpha mode.
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
