//! The triangles that light meets, in canonical space: relative to the scene's centre, scaled by a power of two so
//! that the largest coordinate is in [1, 2). A scene scaled by 2^k is then baked with the very same numbers.

use glam::{DVec3, Vec2, Vec3};
use lumbre_rays::{Bvh, triangle_extent};
use serde::{Deserialize, Serialize};

use super::box_tree::BoxTree;
use super::duplicates::is_hidden_duplicate;
use super::hidden_side::closed_pieces;
use super::leaks::Leaks;
use super::material::{LARGEST_REFLECTANCE, Side};
use super::rooms::{Room, all_within, pieces};
use super::texture_coordinates::textures_of;
use super::{LightmapLayout, SceneObject, SurfaceMaterial};
use crate::BakeError;
use crate::cancel_token::CancelToken;

/// The space in which everything is computed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Canonical {
    /// Its origin in the world, metres.
    pub center: DVec3,
    /// World metres to canonical units: a power of two.
    pub scale: f64,
}

impl Canonical {
    /// For the finite points of a scene.
    pub fn of(points: impl Iterator<Item = DVec3>) -> Self {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for point in points.filter(|point| point.is_finite()) {
            (low, high) = (low.min(point), high.max(point));
        }
        if !low.cmple(high).all() {
            return Self { center: DVec3::ZERO, scale: 1.0 };
        }
        let center = 0.5 * low + 0.5 * high;
        let reach = (high - center).max_element();
        // log2 is exact enough to be off by one at worst, which is as good.
        let exponent = if reach > 0.0 { reach.log2().floor().clamp(-900.0, 900.0) } else { 0.0 };
        Self { center, scale: (-exponent).exp2() }
    }

    /// A world position in canonical units.
    pub fn position(&self, world: DVec3) -> Vec3 {
        self.place(world).as_vec3()
    }

    /// The same, not rounded.
    pub fn place(&self, world: DVec3) -> DVec3 {
        (world - self.center) * self.scale
    }

    /// A canonical position in the world, metres.
    pub fn world(&self, position: Vec3) -> DVec3 {
        position.as_dvec3() / self.scale + self.center
    }
}

/// A triangle that light meets.
#[derive(Clone, Debug)]
pub(crate) struct SceneTriangle {
    /// Counter-clockwise seen from the front, canonical units.
    pub corners: [Vec3; 3],
    /// Unit, geometric.
    pub normal: Vec3,
    /// Square canonical units.
    pub area: f32,
    /// Largest absolute coordinate.
    pub extent: f32,
    /// Unit normals at the corners; the geometric one where the mesh has none.
    pub normals: [Vec3; 3],
    /// Whether the three normals are the geometric one.
    pub flat: bool,
    /// Lightmap coordinates in texels.
    pub uv: [Vec2; 3],
    /// Index of its material.
    pub surface: u32,
    /// Index of its object and map.
    pub object: u32,
    /// Vertices of its mesh.
    pub vertices: [u32; 3],
    /// Light reaches its back too: double-sided, and not the inside of a closed piece.
    pub two_sided: bool,
    /// Part of a closed piece: a ray that meets its back began inside.
    pub closed: bool,
    /// The closed piece, if it looks outward: what is inside sees nothing, whatever lies against it from outside.
    pub solid: Option<u32>,
    /// Another triangle in the same place meets the light.
    pub is_hidden_duplicate: bool,
}

impl SceneTriangle {
    /// The point at barycentric weights of the second and third vertex.
    pub fn position(&self, u: f32, v: f32) -> Vec3 {
        let [a, b, c] = self.corners;
        a + (b - a) * u + (c - a) * v
    }

    /// The unit shading normal there, on the front.
    pub fn shading_normal(&self, u: f32, v: f32) -> Vec3 {
        if self.flat {
            return self.normal;
        }
        let [a, b, c] = self.normals;
        (a * (1.0 - u - v) + b * u + c * v).normalize_or(self.normal)
    }

    /// The same point on its map, in texels.
    pub fn place_on_map(&self, (u, v): (f32, f32)) -> Vec2 {
        let [a, b, c] = self.uv;
        a + (b - a) * u + (c - a) * v
    }

    /// The unit geometric normal of a side.
    pub fn side_normal(&self, side: Side) -> Vec3 {
        match side {
            Side::Front => self.normal,
            Side::Back => -self.normal,
        }
    }
}

/// The static scene as light meets it.
#[derive(Debug)]
pub(crate) struct BakeScene {
    pub space: Canonical,
    pub triangles: Vec<SceneTriangle>,
    /// Of the objects, for people.
    pub names: Vec<String>,
    pub surfaces: Vec<SurfaceMaterial>,
    /// What rays meet.
    pub bvh: Bvh,
    /// What lies near a place.
    pub boxes: BoxTree,
    /// Whether some surface lets light through in places.
    pub masked: bool,
    /// Rays that ended where none should.
    pub leaks: Leaks,
    /// Whether nobody waits for what is computed of it any more.
    pub stop: CancelToken,
    /// The closed pieces that look inward.
    pub rooms: Vec<Room>,
    /// All that shines is inside of rooms: nothing leaves them.
    pub dark_outside: bool,
}

/// Most triangles: patches and texels name them by 32 bits, the hierarchy by 29.
const MAX_TRIANGLES: usize = 1 << 28;

impl BakeScene {
    /// Extracts the triangles; odd ones are named in `warnings`.
    pub fn new(
        objects: &[SceneObject],
        layout: &LightmapLayout,
        space: Canonical,
        stop: &CancelToken,
        warnings: &mut Vec<String>,
    ) -> Result<Self, BakeError> {
        let count = objects.iter().flat_map(|o| &o.primitives).map(|part| part.mesh.triangle_count()).sum();
        if count > MAX_TRIANGLES {
            return Err(BakeError::TooManyTriangles { triangles: count, limit: MAX_TRIANGLES });
        }
        let (mut triangles, mut surfaces) = (Vec::with_capacity(count), Vec::new());
        let (mut rooms, mut solids) = (Vec::new(), Vec::new());
        for (index, object) in objects.iter().enumerate() {
            let first = triangles.len();
            extract(object, index as u32, layout, space, &mut triangles, &mut surfaces, warnings);
            mark_closed(&mut triangles, first, &mut rooms, &mut solids);
        }
        without_hollow(&mut triangles, &rooms, &solids, warnings);
        mark_superseded(&mut triangles, &surfaces, warnings);
        let solid: Vec<[Vec3; 3]> = triangles
            .iter()
            // Both trees leave out what is not a number, and keep the indices.
            .map(|t| if t.is_hidden_duplicate { [Vec3::NAN; 3] } else { t.corners })
            .collect();
        let masked = surfaces.iter().any(SurfaceMaterial::is_masked);
        let closed_scene = all_within(&rooms, triangles.iter().map(|triangle| triangle.corners));
        let leaks = Leaks::new(closed_scene);
        Ok(Self {
            space,
            bvh: Bvh::build(&solid),
            boxes: BoxTree::new(&solid, stop),
            triangles,
            names: objects.iter().map(|object| object.name.clone()).collect(),
            surfaces,
            masked,
            leaks,
            stop: stop.clone(),
            rooms,
            dark_outside: false,
        })
    }
}

fn extract(
    object: &SceneObject,
    index: u32,
    layout: &LightmapLayout,
    space: Canonical,
    triangles: &mut Vec<SceneTriangle>,
    surfaces: &mut Vec<SurfaceMaterial>,
    warnings: &mut Vec<String>,
) {
    let map = &layout.maps[index as usize];
    let size = Vec2::new(map.width as f32, map.height as f32);
    let (mut not_finite, mut without_area) = (0, 0);
    for ((part, mesh), &moved) in object.primitives.iter().zip(&map.meshes).zip(&map.moved) {
        let surface = surfaces.len() as u32;
        // A texture brings its factor down; what is above the limit after that is clamped texel by texel.
        let textured = part
            .textures
            .as_ref()
            .is_some_and(|textures| textures.base_color.is_some() || textures.metallic_roughness.is_some());
        check_reflectance(&part.material.front.diffuse, textured, &object.name, warnings);
        surfaces.push(SurfaceMaterial {
            material: part.material.clone(),
            textures: textures_of(part, moved),
            mesh: mesh.clone(),
        });
        let positions: Vec<Vec3> = mesh
            .positions
            .iter()
            .map(|p| space.position(part.transform.transform_point3(p.as_dvec3())))
            .collect();
        let linear = part.transform.matrix3;
        let mirrored = linear.determinant() < 0.0;
        // The cofactor matrix turns normals under any scale; a mirror image keeps its front by the winding below.
        let cofactor = glam::DMat3::from_cols(
            linear.y_axis.cross(linear.z_axis),
            linear.z_axis.cross(linear.x_axis),
            linear.x_axis.cross(linear.y_axis),
        ) * if mirrored { -1.0 } else { 1.0 };
        for triangle in mesh.triangles() {
            let [a, b, c] = triangle;
            let vertices = if mirrored { [a, c, b] } else { [a, b, c] };
            let corners = vertices.map(|vertex| positions[vertex as usize]);
            if !corners.iter().all(|corner| corner.is_finite()) {
                not_finite += 1;
                continue;
            }
            let [p, q, r] = corners.map(|corner| corner.as_dvec3());
            let cross = (q - p).cross(r - p);
            let longest =
                (q - p).length_squared().max((r - p).length_squared()).max((r - q).length_squared());
            // The rounding of f32 coordinates leaves a sliver no direction of its own.
            let Some(normal) = cross.try_normalize().filter(|_| cross.length() > 1e-9 * longest) else {
                without_area += 1;
                continue;
            };
            let normal = normal.as_vec3();
            let normals = vertices.map(|vertex| {
                let own = mesh.normals.get(vertex as usize).copied().unwrap_or(Vec3::ZERO);
                let own = (cofactor * own.as_dvec3()).normalize_or_zero().as_vec3();
                // Zero, NaN or turned away: the geometric normal.
                if own.is_finite() && own.dot(normal) > 0.1 { own } else { normal }
            });
            triangles.push(SceneTriangle {
                corners,
                normal,
                area: (0.5 * cross.length()) as f32,
                extent: triangle_extent(&corners),
                flat: normals.iter().all(|own| own.dot(normal) > 0.9999),
                normals,
                uv: vertices.map(|vertex| mesh.uv1.get(vertex as usize).copied().unwrap_or_default() * size),
                surface,
                object: index,
                vertices,
                two_sided: part.material.double_sided,
                closed: false,
                solid: None,
                is_hidden_duplicate: false,
            });
        }
    }
    if not_finite > 0 {
        warnings.push(format!(
            "{}: {not_finite} triangles with NaN or infinite positions were left out",
            object.name
        ));
    }
    if without_area > 0 {
        warnings.push(format!("{}: {without_area} triangles without area were left out", object.name));
    }
}

/// A closed piece that looks outward: its number, and the box around it.
type Solid = (u32, Vec3, Vec3);

/// Marks the closed pieces of an object whose triangles begin at `first`, and lists them.
fn mark_closed(
    triangles: &mut [SceneTriangle],
    first: usize,
    rooms: &mut Vec<Room>,
    solids: &mut Vec<Solid>,
) {
    // Corners number the pieces.
    let number = |piece: u32| 3 * first as u32 + piece;
    let triangles = &mut triangles[first..];
    let corners: Vec<[Vec3; 3]> = triangles.iter().map(|triangle| triangle.corners).collect();
    let names = closed_pieces(&corners);
    let pieces = pieces(&corners, &names);
    for (triangle, name) in triangles.iter_mut().zip(&names) {
        triangle.closed = name.is_some();
        triangle.two_sided &= name.is_none();
        let place = name.and_then(|name| pieces.binary_search_by_key(&name, |piece| piece.number).ok());
        triangle.solid = place.filter(|&at| pieces[at].room.is_none()).map(|at| number(pieces[at].number));
    }
    for piece in pieces {
        match piece.room {
            Some(room) => rooms.push(room),
            None => solids.push((number(piece.number), piece.low, piece.high)),
        }
    }
}

/// Pairs of rooms and solids that are looked at: with more, none counts as solid.
const MAX_PAIRS: usize = 1 << 24;

/// What has a room inside of it, as a house's outside has, is no solid.
fn without_hollow(
    triangles: &mut [SceneTriangle],
    rooms: &[Room],
    solids: &[Solid],
    warnings: &mut Vec<String>,
) {
    let all = rooms.len().saturating_mul(solids.len()) > MAX_PAIRS;
    if all {
        warnings.push(format!(
            "{} rooms and {} closed pieces are too many to tell which are in which; what a piece stands on may be lit inside of it",
            rooms.len(),
            solids.len()
        ));
    }
    let is_hollow = |(_, low, high): &&Solid| all || rooms.iter().any(|room| room.is_within(*low, *high));
    // Ascending, as objects and their corners are.
    let hollow: Vec<u32> = solids.iter().filter(is_hollow).map(|(number, ..)| *number).collect();
    for triangle in triangles {
        triangle.solid = triangle.solid.filter(|solid| hollow.binary_search(solid).is_err());
    }
}

fn check_reflectance(diffuse: &Vec3, textured: bool, name: &str, warnings: &mut Vec<String>) {
    if diffuse.max_element() > LARGEST_REFLECTANCE && !textured {
        warnings.push(format!(
            "{name}: diffuse reflectance {diffuse} is above {LARGEST_REFLECTANCE} and was clamped to it"
        ));
    } else if !diffuse.is_finite() || diffuse.min_element() < 0.0 {
        warnings.push(format!(
            "{name}: diffuse reflectance {diffuse} is negative or not a number and counts as 0"
        ));
    }
}

fn mark_superseded(
    triangles: &mut [SceneTriangle],
    surfaces: &[SurfaceMaterial],
    warnings: &mut Vec<String>,
) {
    let corners: Vec<[Vec3; 3]> = triangles.iter().map(|triangle| triangle.corners).collect();
    let third = [1.0 / 3.0; 3];
    let emits: Vec<bool> = triangles
        .iter()
        .map(|t| surfaces[t.surface as usize].emission(Side::Front, t.vertices, third) != Vec3::ZERO)
        .collect();
    let mut count = 0;
    for (triangle, is_hidden_duplicate) in triangles.iter_mut().zip(is_hidden_duplicate(&corners, &emits)) {
        triangle.is_hidden_duplicate = is_hidden_duplicate;
        count += usize::from(is_hidden_duplicate);
    }
    if count > 0 {
        warnings.push(format!(
            "{count} triangles lie exactly on others; light meets one of each (an emitter first)"
        ));
    }
}
