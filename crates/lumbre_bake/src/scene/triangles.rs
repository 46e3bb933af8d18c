//! The scene's triangles in canonical space: relative to the scene's centre, and scaled by a power of two so that the
//! largest coordinate is in [1, 2). A scene scaled by 2^k is then baked with exactly the same numbers.

use glam::{DMat3, DVec3, Vec2, Vec3};
use lumbre_mesh::TriangleMesh;
use lumbre_rays::{Bvh, triangle_extent};
use serde::{Deserialize, Serialize};

use super::box_tree::BoxTree;
use super::duplicates::is_hidden_duplicate;
use super::hidden_side::closed_pieces;
use super::leaks::Leaks;
use super::material::{LARGEST_REFLECTANCE, Side, reflectance_as_metal};
use super::rooms::{Room, all_within, closed_shells};
use super::texture_coordinates::textures_of;
use super::{LightmapLayout, MapLayout, PlacedPrimitive, SceneObject, SurfaceMaterial, world_points};
use crate::BakeError;
use crate::bounds::Bounds;
use crate::cancel_token::CancelToken;
use crate::texel_index::MapIndex;

/// The canonical space that the baker computes in.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Canonical {
    /// Its origin in the world, metres.
    pub center: DVec3,
    /// Canonical units per world metre: a power of two.
    pub scale: f64,
}

impl Canonical {
    /// The canonical space of a scene with these points; points that are not finite are ignored.
    pub fn of(points: impl Iterator<Item = DVec3>) -> Self {
        let bounds: Bounds<DVec3> = points.filter(|point| point.is_finite()).collect();
        if bounds.is_empty() {
            return Self { center: DVec3::ZERO, scale: 1.0 };
        }
        let Bounds { low, high } = bounds;
        let center = 0.5 * low + 0.5 * high;
        let reach = (high - center).max_element();
        // Rounding in log2 can put the exponent off by one at worst, which is good enough.
        let exponent = if reach > 0.0 { reach.log2().floor().clamp(-900.0, 900.0) } else { 0.0 };
        Self { center, scale: (-exponent).exp2() }
    }

    /// A world position in canonical units.
    pub fn position(&self, world: DVec3) -> Vec3 {
        self.place(world).as_vec3()
    }

    /// A world position in canonical units, without rounding to f32.
    pub fn place(&self, world: DVec3) -> DVec3 {
        (world - self.center) * self.scale
    }

    /// The world position, in metres, of a canonical position.
    pub fn world(&self, position: Vec3) -> DVec3 {
        position.as_dvec3() / self.scale + self.center
    }
}

/// The bits of a position, equal for equal positions: adding zero turns -0 into 0.
pub(crate) fn position_bits(position: Vec3) -> [u32; 3] {
    (position + Vec3::ZERO).to_array().map(f32::to_bits)
}

/// A triangle of the scene.
#[derive(Clone, Debug)]
pub(crate) struct SceneTriangle {
    /// Counter-clockwise seen from the front, canonical units.
    pub corners: [Vec3; 3],
    /// Unit geometric normal.
    pub normal: Vec3,
    /// Square canonical units.
    pub area: f32,
    /// Largest absolute coordinate.
    pub extent: f32,
    /// Unit shading normals at the corners; the geometric normal where the mesh has no usable one.
    pub normals: [Vec3; 3],
    /// Whether the three shading normals equal the geometric one (nearly).
    pub flat: bool,
    /// Lightmap coordinates in texels.
    pub uv: [Vec2; 3],
    /// Index of its material in [`BakeScene::surfaces`].
    pub surface: u32,
    /// Its map, and with that its object.
    pub map: MapIndex,
    /// Vertex indices in its mesh.
    pub vertices: [u32; 3],
    /// Whether its back takes part in light transport too: it is double-sided, and not part of a closed piece.
    pub two_sided: bool,
    /// Whether it belongs to a closed piece of its mesh, so that a ray that hits its back started inside.
    pub closed: bool,
    /// The number of its closed piece, if that is a solid (its fronts face outward). No light enters a solid, even
    /// through surfaces that coincide with its outside.
    pub solid: Option<u32>,
    /// Whether a coincident triangle replaces it.
    pub is_hidden_duplicate: bool,
}

impl SceneTriangle {
    /// The point at barycentric weights of the second and third vertex.
    pub fn position(&self, u: f32, v: f32) -> Vec3 {
        let [a, b, c] = self.corners;
        a + (b - a) * u + (c - a) * v
    }

    /// The unit shading normal of the front at barycentric weights of the second and third vertex.
    pub fn shading_normal(&self, u: f32, v: f32) -> Vec3 {
        if self.flat {
            return self.normal;
        }
        let [a, b, c] = self.normals;
        (a * (1.0 - u - v) + b * u + c * v).normalize_or(self.normal)
    }

    /// The point's position on its map, in texels.
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

/// The static scene in the form that the baker computes with.
#[derive(Debug)]
pub(crate) struct BakeScene {
    pub space: Canonical,
    pub triangles: Vec<SceneTriangle>,
    /// Names of the objects, for messages.
    pub names: Vec<String>,
    pub surfaces: Vec<SurfaceMaterial>,
    /// The hierarchy for ray casts.
    pub bvh: Bvh,
    /// Finds the triangles near a place.
    pub boxes: BoxTree,
    /// Per triangle, whether light may pass through parts of it; empty if it passes through none. Every hit of a ray
    /// reads it.
    pub masked: Vec<bool>,
    /// Counter of rays that ended where no ray should.
    pub leaks: Leaks,
    /// Set when the bake is cancelled.
    pub stop: CancelToken,
    /// The closed pieces whose fronts face inward.
    pub rooms: Vec<Room>,
    /// Whether all light sources are inside rooms, so that the outside is dark.
    pub dark_outside: bool,
}

/// Most triangles: patches and texels store triangle indices in 32 bits, the hierarchy in 29.
const MAX_TRIANGLES: usize = 1 << 28;

impl BakeScene {
    /// Builds the scene from the objects and their layout. `warnings` reports triangles that are left out or replaced,
    /// and materials that are corrected.
    pub fn new(
        objects: &[SceneObject],
        layout: &LightmapLayout,
        space: Canonical,
        stop: &CancelToken,
        warnings: &mut Vec<String>,
    ) -> Result<Self, BakeError> {
        let count = objects.iter().flat_map(|o| &o.primitives).map(|p| p.mesh.triangle_count()).sum();
        if count > MAX_TRIANGLES {
            return Err(BakeError::TooManyTriangles { triangles: count, limit: MAX_TRIANGLES });
        }
        let mut extraction = Extraction {
            space,
            triangles: Vec::with_capacity(count),
            surfaces: Vec::new(),
            rooms: Vec::new(),
            solids: Vec::new(),
            warnings,
        };
        for ((index, object), map) in (0..).zip(objects).zip(&layout.maps) {
            let first = extraction.triangles.len();
            extraction.extract_object(object, MapIndex(index), map);
            extraction.mark_closed(first);
        }
        extraction.unmark_hollow_solids();
        extraction.mark_hidden_duplicates();
        let Extraction { triangles, surfaces, rooms, .. } = extraction;
        let corners: Vec<[Vec3; 3]> = triangles
            .iter()
            // Both trees leave out triangles with NaN corners, and keep the indices of the others.
            .map(|t| if t.is_hidden_duplicate { [Vec3::NAN; 3] } else { t.corners })
            .collect();
        let mut masked: Vec<bool> =
            triangles.iter().map(|triangle| surfaces[triangle.surface as usize].is_masked()).collect();
        if !masked.contains(&true) {
            masked = Vec::new();
        }
        let closed_scene = all_within(&rooms, triangles.iter().map(|triangle| triangle.corners));
        let leaks = Leaks::new(closed_scene);
        Ok(Self {
            space,
            bvh: Bvh::build(&corners),
            boxes: BoxTree::new(&corners, stop),
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

/// A scene while its triangles are extracted from objects.
struct Extraction<'a> {
    space: Canonical,
    triangles: Vec<SceneTriangle>,
    surfaces: Vec<SurfaceMaterial>,
    rooms: Vec<Room>,
    /// The closed pieces whose fronts face outward: their numbers, ascending, and bounding boxes.
    solids: Vec<(u32, Bounds<Vec3>)>,
    warnings: &'a mut Vec<String>,
}

impl Extraction<'_> {
    /// Appends an object's triangles and materials.
    fn extract_object(&mut self, object: &SceneObject, index: MapIndex, map: &MapLayout) {
        let name = &object.name;
        let (mut not_finite, mut without_area) = (0, 0);
        for ((primitive, mesh), &moved) in object.primitives.iter().zip(&map.meshes).zip(&map.moved) {
            // A texture lowers its factor, so the factor alone says nothing; `SurfaceMaterial` clamps the product at
            // each point.
            let textured = primitive.textures.as_ref().is_some_and(|textures| {
                textures.base_color.is_some() || textures.metallic_roughness.is_some()
            });
            let front = &primitive.material.front;
            let reflectance = front.diffuse + reflectance_as_metal(&primitive.material, front);
            self.check_reflectance(&reflectance, textured, name);
            let surface = self.surfaces.len() as u32;
            self.surfaces.push(SurfaceMaterial {
                material: primitive.material.clone(),
                textures: textures_of(primitive, moved),
                mesh: mesh.clone(),
            });
            let size = Vec2::new(map.width as f32, map.height as f32);
            let left_out = self.extract_triangles(primitive, mesh, size, (surface, index));
            (not_finite, without_area) = (not_finite + left_out.0, without_area + left_out.1);
        }
        if not_finite > 0 {
            let triangles = "triangles with NaN or infinite positions were left out";
            self.warnings.push(format!("{name}: {not_finite} {triangles}"));
        }
        if without_area > 0 {
            self.warnings.push(format!("{name}: {without_area} triangles without area were left out"));
        }
    }

    /// Appends the triangles of a primitive, which has the index `surface`, on a map of `size` texels.
    /// Returns how many are left out because they are not finite, and because they have no area.
    fn extract_triangles(
        &mut self,
        primitive: &PlacedPrimitive,
        mesh: &TriangleMesh,
        size: Vec2,
        (surface, map): (u32, MapIndex),
    ) -> (usize, usize) {
        let positions: Vec<Vec3> =
            world_points(&primitive.transform, mesh).map(|point| self.space.position(point)).collect();
        let linear = primitive.transform.matrix3;
        let is_mirrored = linear.determinant() < 0.0;
        let cofactor = normal_matrix(linear, is_mirrored);
        let (mut not_finite, mut without_area) = (0, 0);
        for [a, b, c] in mesh.triangles() {
            let vertices = if is_mirrored { [a, c, b] } else { [a, b, c] };
            let corners = vertices.map(|vertex| positions[vertex as usize]);
            if !corners.iter().all(|corner| corner.is_finite()) {
                not_finite += 1;
                continue;
            }
            let Some((normal, area)) = normal_and_area(&corners) else {
                without_area += 1;
                continue;
            };
            let normals = vertices.map(|vertex| {
                let mesh_normal = mesh.normals.get(vertex as usize).copied().unwrap_or(Vec3::ZERO);
                let shading = (cofactor * mesh_normal.as_dvec3()).normalize_or_zero().as_vec3();
                // The geometric normal replaces one that is zero, NaN or turned too far away from it.
                if shading.is_finite() && shading.dot(normal) > 0.1 { shading } else { normal }
            });
            let uv = |vertex: u32| mesh.uv1.get(vertex as usize).copied().unwrap_or_default() * size;
            self.triangles.push(SceneTriangle {
                corners,
                normal,
                area,
                extent: triangle_extent(&corners),
                flat: normals.iter().all(|shading| shading.dot(normal) > 0.9999),
                normals,
                uv: vertices.map(uv),
                surface,
                map,
                vertices,
                two_sided: primitive.material.double_sided,
                closed: false,
                solid: None,
                is_hidden_duplicate: false,
            });
        }
        (not_finite, without_area)
    }

    /// Warns of a reflectance that will be clamped.
    fn check_reflectance(&mut self, diffuse: &Vec3, textured: bool, name: &str) {
        let warning = if diffuse.max_element() > LARGEST_REFLECTANCE && !textured {
            format!("is above {LARGEST_REFLECTANCE} and was clamped to it")
        } else if !diffuse.is_finite() || diffuse.min_element() < 0.0 {
            "is negative or not a number and counts as 0".into()
        } else {
            return;
        };
        self.warnings.push(format!("{name}: diffuse reflectance {diffuse} {warning}"));
    }

    /// Marks the triangles of closed pieces in the object whose triangles begin at `first`, and appends its rooms and
    /// solids.
    fn mark_closed(&mut self, first: usize) {
        // Within an object, pieces are numbered by vertices, of which there are at most three per triangle.
        let number = |piece: u32| 3 * first as u32 + piece;
        let triangles = &mut self.triangles[first..];
        let corners: Vec<[Vec3; 3]> = triangles.iter().map(|triangle| triangle.corners).collect();
        let piece_numbers = closed_pieces(&corners);
        let pieces = closed_shells(&corners, &piece_numbers);
        for (triangle, piece_number) in triangles.iter_mut().zip(&piece_numbers) {
            triangle.closed = piece_number.is_some();
            triangle.two_sided &= piece_number.is_none();
            let place = piece_number.and_then(|piece_number| {
                pieces.binary_search_by_key(&piece_number, |piece| piece.number).ok()
            });
            triangle.solid =
                place.filter(|&at| pieces[at].room.is_none()).map(|at| number(pieces[at].number));
        }
        for piece in pieces {
            match piece.room {
                Some(room) => self.rooms.push(room),
                None => self.solids.push((number(piece.number), piece.bounds)),
            }
        }
    }

    /// Unmarks solids that contain a room, as the outside of a house does.
    fn unmark_hollow_solids(&mut self) {
        let (rooms, solids) = (&self.rooms, &self.solids);
        let too_many = rooms.len().saturating_mul(solids.len()) > MAX_PAIRS;
        if too_many {
            self.warnings.push(format!(
                "{} rooms and {} closed pieces are too many to tell which are in which; what a piece stands on may be lit inside of it",
                rooms.len(),
                solids.len()
            ));
        }
        let is_hollow =
            |(_, bounds): &&(u32, Bounds<Vec3>)| too_many || rooms.iter().any(|room| room.is_within(*bounds));
        // In ascending order, as objects and their pieces are, which the binary search needs.
        let hollow: Vec<u32> = solids.iter().filter(is_hollow).map(|(number, ..)| *number).collect();
        for triangle in &mut self.triangles {
            triangle.solid = triangle.solid.filter(|solid| hollow.binary_search(solid).is_err());
        }
    }

    /// Marks the triangles that a coincident one replaces.
    fn mark_hidden_duplicates(&mut self) {
        let corners: Vec<[Vec3; 3]> = self.triangles.iter().map(|triangle| triangle.corners).collect();
        let emits = |triangle: &SceneTriangle| {
            let surface = &self.surfaces[triangle.surface as usize];
            surface.emission(Side::Front, triangle.vertices, [1.0 / 3.0; 3]) != Vec3::ZERO
        };
        let emits: Vec<bool> = self.triangles.iter().map(emits).collect();
        let mut count = 0;
        for (triangle, is_hidden) in self.triangles.iter_mut().zip(is_hidden_duplicate(&corners, &emits)) {
            triangle.is_hidden_duplicate = is_hidden;
            count += usize::from(is_hidden);
        }
        if count > 0 {
            self.warnings.push(format!(
                "{count} triangles lie exactly on others; light meets one of each (an emitter first)"
            ));
        }
    }
}

/// Most pairs of rooms and solids that are tested; with more, no piece counts as a solid.
const MAX_PAIRS: usize = 1 << 24;

/// The cofactor matrix of a linear map: it transforms normals correctly under any scale. Mirrored meshes get the
/// reversed winding, and here the opposite sign, so that their fronts stay fronts.
fn normal_matrix(linear: DMat3, is_mirrored: bool) -> DMat3 {
    DMat3::from_cols(
        linear.y_axis.cross(linear.z_axis),
        linear.z_axis.cross(linear.x_axis),
        linear.x_axis.cross(linear.y_axis),
    ) * if is_mirrored { -1.0 } else { 1.0 }
}

/// Unit geometric normal and area of a triangle; `None` if it is degenerate, or so narrow that the rounding of its f32
/// coordinates leaves its normal undefined.
fn normal_and_area(corners: &[Vec3; 3]) -> Option<(Vec3, f32)> {
    let [p, q, r] = corners.map(|corner| corner.as_dvec3());
    let cross = (q - p).cross(r - p);
    let longest = (q - p).length_squared().max((r - p).length_squared()).max((r - q).length_squared());
    let normal = cross.try_normalize().filter(|_| cross.length() > 1e-9 * longest)?;
    Some((normal.as_vec3(), (0.5 * cross.length()) as f32))
}
