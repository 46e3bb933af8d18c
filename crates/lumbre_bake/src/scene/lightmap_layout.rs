//! Where every object's texels are: its own `uv1` where it has sound ones, an unwrap where not, and the size of its map.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use glam::{DAffine3, Vec2, Vec3};
use lumbre_mesh::uv_validation::validate_uv1;
use lumbre_mesh::{Charted, TriangleMesh, UnwrapError, UnwrapOptions, Unwrapped};

use super::texture_coordinates::{free_second, sets_read};
use super::{Canonical, SceneObject, SceneTriangle};
use crate::cancel_token::CancelToken;
use crate::texel_index::MapTexel;
use crate::{BakeError, BakeOptions, Density};

/// The texels of one object.
#[derive(Clone, Debug)]
pub(crate) struct MapLayout {
    /// One per part of the object, with `uv1`.
    pub meshes: Vec<Arc<TriangleMesh>>,
    /// Of each part, whether its textures' coordinates moved from `uv1` to `uv0`.
    pub moved: Vec<bool>,
    /// Texels across.
    pub width: u32,
    /// Texel rows.
    pub height: u32,
    /// Index of its first texel in the row of all maps.
    pub first: usize,
}

impl MapLayout {
    /// The texel in a column and a row.
    pub fn texel(&self, x: u32, y: u32) -> MapTexel {
        MapTexel::new(self.first + (y * self.width + x) as usize)
    }

    /// The places of its texels in lists per texel of all maps.
    pub fn places(&self) -> Range<usize> {
        self.first..self.first + (self.width * self.height) as usize
    }

    /// The texels at most `radius` columns and rows away from one, itself included, row by row.
    pub fn neighbourhood(&self, x: u32, y: u32, radius: u32) -> impl Iterator<Item = MapTexel> {
        let columns = x.saturating_sub(radius)..=(x + radius).min(self.width - 1);
        let rows = y.saturating_sub(radius)..=(y + radius).min(self.height - 1);
        rows.flat_map(move |y| columns.clone().map(move |x| self.texel(x, y)))
    }
}

/// The texels of all objects.
#[derive(Clone, Debug, Default)]
pub(crate) struct LightmapLayout {
    /// One per object.
    pub maps: Vec<MapLayout>,
    /// Texels of all maps.
    pub texels: usize,
    /// Texels per canonical unit that were aimed at.
    pub density: f64,
}

impl LightmapLayout {
    /// The texel at a point of a triangle; none where it is not on its map.
    pub fn texel_at(&self, triangle: &SceneTriangle, at: (f32, f32)) -> Option<MapTexel> {
        let map = &self.maps[triangle.object as usize];
        let place = triangle.place_on_map(at);
        let (x, y) = (place.x as u32, place.y as u32);
        (x < map.width && y < map.height).then(|| map.texel(x, y))
    }
}

/// Texels that [`Density::Automatic`] aims at.
const AUTOMATIC_TEXELS: f64 = 500_000.0;
/// Largest side of a map.
const LARGEST_SIDE: u32 = 8192;
/// Most texels of all maps: 4 GiB of working memory at some 64 bytes each.
const MAX_TEXELS: u64 = 1 << 26;

/// Texels per canonical unit of objects whose lightmap scale is 1: exact under a scale of 2^k, unlike metres; 1 where maps have a size instead.
pub(crate) fn density_of(objects: &[SceneObject], space: Canonical, options: &BakeOptions) -> f64 {
    let area = || -> f64 {
        objects
            .iter()
            .map(|object| ObjectGeometry::new(object, space).area * object.lightmap_scale.powi(2))
            .sum()
    };
    match options.density {
        Density::Automatic => {
            let area = area();
            if area > 0.0 { (AUTOMATIC_TEXELS / area).sqrt() } else { 1.0 }
        }
        Density::TexelsPerMeter(density) => density / space.scale,
        Density::MapSize(_) => 1.0,
    }
}

/// Lays out every object, with so many texels per canonical unit.
pub(crate) fn lay_out(
    objects: &[SceneObject],
    space: Canonical,
    density: f64,
    options: &BakeOptions,
    stop: &CancelToken,
    warnings: &mut Vec<String>,
) -> Result<LightmapLayout, BakeError> {
    let mut layout = LightmapLayout { density, ..LightmapLayout::default() };
    let mut instances: HashMap<Vec<u64>, ObjectLayout> = HashMap::new();
    let mut texels = 0u64;
    for object in objects {
        let key = instance_key(object, space);
        let made = match instances.get(&key) {
            Some(known) => known.clone(),
            None => {
                let made = lay_out_object(object, space, density, options, stop, warnings)?;
                instances.insert(key, made.clone());
                made
            }
        };
        let ObjectLayout { meshes, moved, width, height } = made;
        texels += u64::from(width) * u64::from(height);
        if texels > MAX_TEXELS {
            return Err(BakeError::TooManyTexels { texels, limit: MAX_TEXELS });
        }
        layout.maps.push(MapLayout { meshes, moved, width, height, first: layout.texels });
        layout.texels = texels as usize;
    }
    Ok(layout)
}

/// Objects that share their meshes and differ by a rotation and translation only share their coordinates.
fn instance_key(object: &SceneObject, space: Canonical) -> Vec<u64> {
    let mut key = Vec::with_capacity(1 + object.primitives.len() * 7);
    key.push(object.lightmap_scale.to_bits());
    for part in &object.primitives {
        key.push(Arc::as_ptr(&part.mesh) as usize as u64);
        // A mesh whose second set holds a texture's coordinates in one place may be free in another.
        key.extend(sets_read(part.textures.as_ref()).map(u64::from));
        let m = part.transform.matrix3;
        let scale = space.scale * space.scale;
        for (a, b) in [
            (m.x_axis, m.x_axis),
            (m.y_axis, m.y_axis),
            (m.z_axis, m.z_axis),
            (m.x_axis, m.y_axis),
            (m.y_axis, m.z_axis),
            (m.x_axis, m.z_axis),
        ] {
            // Rotations differ in the last bits; a thousandth of the axes' size tells scales apart.
            let size = (a.length_squared() * b.length_squared()).sqrt();
            let cosine = if size > 0.0 { (a.dot(b) / size * 1000.0).round() } else { 0.0 };
            key.push((size * scale).to_bits() >> 40);
            key.push(cosine.to_bits());
        }
    }
    key
}

/// All triangles of an object in canonical space.
struct ObjectGeometry {
    mesh: TriangleMesh,
    area: f64,
    /// Area in the unit square of `uv1`, if every part has it.
    uv_area: Option<f64>,
}

impl ObjectGeometry {
    fn new(object: &SceneObject, space: Canonical) -> Self {
        let mut mesh = TriangleMesh::default();
        let has_uv =
            object.primitives.iter().all(|part| !part.mesh.uv1.is_empty() || part.mesh.positions.is_empty());
        for part in &object.primitives {
            let base = mesh.positions.len() as u32;
            let place = |p: &Vec3| space.position(part.transform.transform_point3(p.as_dvec3()));
            mesh.positions.extend(part.mesh.positions.iter().map(place));
            if has_uv {
                mesh.uv1.extend_from_slice(&part.mesh.uv1);
            }
            mesh.indices.extend(part.mesh.indices.iter().map(|index| index + base));
        }
        let (mut area, mut uv_area) = (0.0, 0.0);
        for triangle in mesh.triangles() {
            let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize].as_dvec3());
            let own = 0.5 * (b - a).cross(c - a).length();
            area += if own.is_finite() { own } else { 0.0 };
            if has_uv {
                let [a, b, c] = triangle.map(|vertex| mesh.uv1[vertex as usize].as_dvec2());
                let own = 0.5 * (b - a).perp_dot(c - a).abs();
                uv_area += if own.is_finite() { own } else { 0.0 };
            }
        }
        Self { mesh, area, uv_area: has_uv.then_some(uv_area) }
    }
}

/// What objects share that are laid out alike.
#[derive(Clone)]
struct ObjectLayout {
    meshes: Vec<Arc<TriangleMesh>>,
    moved: Vec<bool>,
    width: u32,
    height: u32,
}

fn lay_out_object(
    object: &SceneObject,
    space: Canonical,
    density: f64,
    options: &BakeOptions,
    stop: &CancelToken,
    warnings: &mut Vec<String>,
) -> Result<ObjectLayout, BakeError> {
    let placed = ObjectGeometry::new(object, space);
    let density = density * object.lightmap_scale;
    let side_of_map = |side: u32| {
        (f64::from(side) * object.lightmap_scale).round().clamp(4.0, f64::from(LARGEST_SIDE)) as u32
    };
    if let Some(uv_area) = placed.uv_area.filter(|&area| area > 0.0) {
        let side = match options.density {
            Density::MapSize(side) => side_of_map(side),
            _ => ((placed.area / uv_area).sqrt() * density).ceil().clamp(4.0, f64::from(LARGEST_SIDE)) as u32,
        };
        match validate_uv1(&placed.mesh, side, side) {
            Ok(report) if report.is_sound() => {
                let meshes = object.primitives.iter().map(|part| Arc::clone(&part.mesh)).collect();
                return Ok(ObjectLayout { meshes, moved: vec![false; object.primitives.len()], width: side, height: side });
            }
            Ok(report) => warnings.push(format!(
                "{}: its TEXCOORD_1 cannot hold a lightmap at {side} x {side} texels ({} triangles out of range, {} \
                 without area, {} overlapping pairs); it was unwrapped anew",
                object.name,
                report.out_of_range.len(),
                report.without_coverage.len(),
                report.overlapping.len()
            )),
            Err(error) => warnings.push(format!("{}: {error}; it was unwrapped anew", object.name)),
        }
    }
    if placed.uv_area == Some(0.0) && placed.area > 0.0 {
        warnings.push(format!(
            "{}: its TEXCOORD_1 covers no area, or is not finite; it was unwrapped anew",
            object.name
        ));
    }
    let (object, moved) = free_second(object)?;
    if moved.contains(&true) {
        warnings.push(format!(
            "{}: its textures' coordinates were moved from TEXCOORD_1, where the lightmap needs its own, to TEXCOORD_0, which \
             nothing else read",
            object.name
        ));
    }
    let go_on = || !stop.is_cancelled();
    let charted =
        Charted::new(&placed.mesh, &placed.mesh.positions, UnwrapOptions::default().chart_angle, &go_on)
            .map_err(|source| BakeError::Unwrap { object: object.name.clone(), source })?;
    let (unwrapped, width, height) = match options.density {
        Density::MapSize(side) => {
            let asked = side_of_map(side);
            let (made, side) = fit(&object, &placed, &charted, asked, options.gap)?;
            if side > asked {
                warnings.push(format!(
                    "{}: its {} charts do not fit a map of {asked} x {asked} texels; it got one of {side} x {side}",
                    object.name,
                    charted.len()
                ));
            }
            (made, side, side)
        }
        _ => {
            let made = unwrap_at_most(&object, &charted, density, options.gap, warnings)?;
            let (width, height) = (made.width.max(1), made.height.max(1));
            (made, width, height)
        }
    };
    // From the rectangle of the charts to the map it lies in.
    let shrink = Vec2::new(unwrapped.width as f32 / width as f32, unwrapped.height as f32 / height as f32);
    Ok(ObjectLayout { meshes: split(&object, &unwrapped, shrink), moved, width, height })
}

/// The densest unwrap that fits a square of `side` texels, or the next larger one by a power of two in which its charts have room; and its side.
fn fit(
    object: &SceneObject,
    placed: &ObjectGeometry,
    charted: &Charted<'_>,
    asked: u32,
    gap: u32,
) -> Result<(Unwrapped, u32), BakeError> {
    let failed = |source| BakeError::Unwrap { object: object.name.clone(), source };
    let mut side = asked;
    let mut best = loop {
        match charted.unwrap(SPARSEST, gap, side) {
            Ok(made) => break made,
            Err(UnwrapError::TooLarge { .. }) if side < LARGEST_SIDE => side = (2 * side).min(LARGEST_SIDE),
            Err(UnwrapError::TooLarge { .. }) => {
                return Err(BakeError::TooManyCharts {
                    object: object.name.clone(),
                    charts: charted.len(),
                    limit: LARGEST_SIDE,
                });
            }
            Err(source) => return Err(failed(source)),
        }
    };
    // No packing exceeds one texel per texel.
    let mut high = if placed.area > 0.0 { f64::from(side) / placed.area.sqrt() } else { 1.0 };
    let mut low = high;
    for _ in 0..MAX_DENSITIES {
        match charted.unwrap(low, gap, side) {
            Ok(made) => {
                best = made;
                break;
            }
            Err(UnwrapError::TooLarge { .. }) => (high, low) = (low, 0.7 * low),
            Err(source) => return Err(failed(source)),
        }
    }
    for _ in 0..6 {
        let middle = 0.5 * (low + high);
        match charted.unwrap(middle, gap, side) {
            Ok(made) => (best, low) = (made, middle),
            Err(UnwrapError::TooLarge { .. }) => high = middle,
            Err(source) => return Err(failed(source)),
        }
    }
    Ok((best, side))
}

fn unwrap_at_most(
    object: &SceneObject,
    charted: &Charted<'_>,
    density: f64,
    gap: u32,
    warnings: &mut Vec<String>,
) -> Result<Unwrapped, BakeError> {
    let mut tried = density;
    for _ in 0..MAX_DENSITIES {
        match charted.unwrap(tried, gap, LARGEST_SIDE) {
            Ok(made) => {
                if tried < density {
                    let share = 100.0 * tried / density;
                    warnings.push(format!(
                        "{}: its lightmap would exceed {LARGEST_SIDE} texels a side; it got {share:.0} % of the density",
                        object.name
                    ));
                }
                return Ok(made);
            }
            Err(UnwrapError::TooLarge { .. }) => tried *= 0.7,
            Err(source) => return Err(BakeError::Unwrap { object: object.name.clone(), source }),
        }
    }
    let (object, charts) = (object.name.clone(), charted.len());
    Err(BakeError::TooManyCharts { object, charts, limit: LARGEST_SIDE })
}

/// Texels per canonical unit at which every chart has the fewest texels.
const SPARSEST: f64 = 1e-9;
/// Densities that are tried, each 0.7 of the one before: down to a millionth.
const MAX_DENSITIES: u32 = 40;

/// Gives the parts their shares of the unwrapped whole.
fn split(object: &SceneObject, unwrapped: &Unwrapped, shrink: Vec2) -> Vec<Arc<TriangleMesh>> {
    let (mut first_vertex, mut first_index) = (0u32, 0usize);
    let mut meshes = Vec::with_capacity(object.primitives.len());
    for part in &object.primitives {
        let vertices = part.mesh.positions.len() as u32;
        let own = first_vertex..first_vertex + vertices;
        let mut local = HashMap::new();
        let mut sources = Vec::new();
        for (index, &source) in unwrapped.vertex_sources.iter().enumerate().filter(|(_, s)| own.contains(s)) {
            local.insert(index as u32, sources.len() as u32);
            sources.push((index, (source - first_vertex) as usize));
        }
        fn copy<T: Copy>(values: &[T], sources: &[(usize, usize)]) -> Vec<T> {
            if values.is_empty() { Vec::new() } else { sources.iter().map(|&(_, s)| values[s]).collect() }
        }
        let count = part.mesh.indices.len();
        let indices = &unwrapped.mesh.indices[first_index..first_index + count];
        meshes.push(Arc::new(TriangleMesh {
            positions: copy(&part.mesh.positions, &sources),
            normals: copy(&part.mesh.normals, &sources),
            tangents: copy(&part.mesh.tangents, &sources),
            uv0: copy(&part.mesh.uv0, &sources),
            uv1: sources.iter().map(|&(index, _)| unwrapped.mesh.uv1[index] * shrink).collect(),
            colors: copy(&part.mesh.colors, &sources),
            indices: indices.iter().map(|index| local[index]).collect(),
        }));
        first_vertex += vertices;
        first_index += count;
    }
    meshes
}

/// The box around a mesh in the world is that of its points; this is their place.
pub(crate) fn world_points<'a>(
    transform: &'a DAffine3,
    mesh: &'a TriangleMesh,
) -> impl Iterator<Item = glam::DVec3> + 'a {
    mesh.positions.iter().map(|p| transform.transform_point3(p.as_dvec3()))
}
