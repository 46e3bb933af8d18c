//! The emissive faces that light other objects in a frame, as few uniform polygons as possible: two triangles
//! of one colour that form a parallelogram become one. Paths sample the emissive triangles themselves, in
//! `light_sampling`.

use std::collections::HashMap;

use glam::{DVec2, DVec3};
use lumbre_mesh::weld_positions;
use lumbre_optics::PolygonLight;
use lumbre_scene::EmissiveLight;

use super::object::Object;
use super::texture::sample_color;

/// Tolerance for the fourth corner of a parallelogram, as a fraction of its diagonal.
const TOLERANCE: f64 = 1e-6;
/// Number of points along an edge at which an emissive texture is read.
const TEXTURE_POINTS: u32 = 8;

/// An emissive polygon.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EmissivePolygon {
    pub light: PolygonLight,
    /// Index of the object that it is a face of. No object lights itself.
    pub emitter: usize,
    /// Whether lightmaps already contain its diffuse light.
    pub baked: bool,
}

/// Returns the emissive polygons of one object, in the tracer's space.
pub(crate) fn emissive_polygons(index: usize, object: &Object, baked: bool) -> Vec<EmissivePolygon> {
    let [front, back] = EmissiveLight::radiance(&object.material).map(|color| color.as_dvec3());
    let mut polygons = Vec::new();
    if front == DVec3::ZERO && back == DVec3::ZERO {
        return polygons;
    }
    for (light, tint) in faces(object) {
        let front = PolygonLight { radiance: front * tint, ..light };
        let front = if object.mirrored { front.turned() } else { front };
        for light in [front, PolygonLight { radiance: back * tint, ..front.turned() }] {
            let area = light.area_vector();
            if light.radiance != DVec3::ZERO && area.is_finite() && area != DVec3::ZERO {
                polygons.push(EmissivePolygon { light, emitter: index, baked });
            }
        }
    }
    polygons
}

/// Returns the faces of an object without radiance, each with the mean colour of its emissive texture.
fn faces(object: &Object) -> Vec<(PolygonLight, DVec3)> {
    let mesh = &object.shape;
    let corner = |vertex: u32| object.place.transform_point3(mesh.positions[vertex as usize].as_dvec3());
    let face = |[a, b, c]: [u32; 3], triangle: bool| {
        let (corner, b, c) = (corner(a), corner(b), corner(c));
        PolygonLight { corner, edge_u: b - corner, edge_v: c - corner, triangle, radiance: DVec3::ZERO }
    };
    let triangles: Vec<[u32; 3]> = mesh.triangles().collect();
    if object.textures.emissive.is_some() {
        return triangles.iter().map(|t| (face(*t, true), mean_texel(object, *t))).collect();
    }
    let welded = weld_positions(&mesh.positions);
    let mut left: HashMap<[u32; 2], (usize, usize)> = HashMap::new();
    let mut faces: Vec<Option<(PolygonLight, DVec3)>> = Vec::new();
    for (index, triangle) in triangles.iter().enumerate() {
        let edge = |apex: usize| [1, 2].map(|next| welded[triangle[(apex + next) % 3] as usize]);
        let pair = (0..3).find_map(|apex| {
            let [from, to] = edge(apex);
            let &(other, across) = left.get(&[to, from])?;
            faces[other]?;
            let (a, d) = (corner(triangle[apex]), corner(triangles[other][across]));
            let (b, c) = (corner(triangle[(apex + 1) % 3]), corner(triangle[(apex + 2) % 3]));
            let apart = ((a + d) - (b + c)).length();
            (apart <= TOLERANCE * (d - a).length().max((c - b).length())).then_some((other, apex))
        });
        match pair {
            Some((other, apex)) => {
                let [a, b, c] = [0, 1, 2].map(|next| triangle[(apex + next) % 3]);
                faces[other] = None;
                faces.push(Some((face([a, b, c], false), DVec3::ONE)));
                // It is now half of a parallelogram and cannot be part of another.
                left.retain(|_, (half, _)| *half != other);
            }
            None => {
                faces.push(Some((face(*triangle, true), DVec3::ONE)));
                for apex in 0..3 {
                    left.insert(edge(apex), (index, apex));
                }
            }
        }
    }
    faces.into_iter().flatten().collect()
}

/// Returns the mean of the emissive texture over a triangle, read at the centroids of 64 equal pieces.
fn mean_texel(object: &Object, triangle: [u32; 3]) -> DVec3 {
    let Some(texture) = &object.textures.emissive else { return DVec3::ONE };
    let coordinates = if texture.tex_coord == 0 { &object.shape.uv0 } else { &object.shape.uv1 };
    let corners = triangle.map(|vertex| coordinates.get(vertex as usize).map(|uv| uv.as_dvec2()));
    let [Some(a), Some(b), Some(c)] = corners else { return DVec3::ONE };
    let mut sum = DVec3::ZERO;
    for row in 0..TEXTURE_POINTS {
        for column in 0..TEXTURE_POINTS {
            // The upright triangle of the cell or, beyond the diagonal, the inverted triangle of the mirrored
            // cell.
            let (i, j, third) = match row + column < TEXTURE_POINTS {
                true => (row, column, 1.0),
                false => (TEXTURE_POINTS - 1 - row, TEXTURE_POINTS - 1 - column, 2.0),
            };
            let at = |index: u32| (f64::from(index) + third / 3.0) / f64::from(TEXTURE_POINTS);
            let uv: DVec2 = a + (b - a) * at(i) + (c - a) * at(j);
            sum += sample_color(texture, uv).truncate();
        }
    }
    sum / f64::from(TEXTURE_POINTS * TEXTURE_POINTS)
}
