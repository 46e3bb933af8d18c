//! Lightmap coordinates and map size of every object: its own `uv1` if that is sound, else a new unwrap. Textures that
//! read `uv1` make room for the unwrap in `texture_coordinates`.

use std::collections::HashMap;
use std::sync::Arc;

use glam::Vec2;
use lumbre_mesh::uv_validation::validate_uv1;
use lumbre_mesh::{Charted, TriangleMesh, UnwrapError, UnwrapOptions, Unwrapped};

use super::lightmap_layout::{LightmapLayout, MapLayout};
use super::texture_coordinates::{free_second, sets_read};
use super::{Canonical, SceneObject, world_points};
use crate::cancel_token::CancelToken;
use crate::{BakeError, BakeOptions, Density};

/// Number of texels that [`Density::Automatic`] aims at.
const AUTOMATIC_TEXELS: f64 = 500_000.0;
/// Largest side of a map.
const LARGEST_SIDE: u32 = 8192;
/// Most texels of all maps together: 4 GiB of working memory at some 64 bytes each.
const MAX_TEXELS: u64 = 1 << 26;

/// Texels per canonical unit for objects whose lightmap scale is 1; 1 if the options give the size of maps instead.
/// Unlike a density per metre, it stays exact when the scene is scaled by 2^k.
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

/// How objects are laid out.
pub(crate) struct Layouter<'a> {
    pub space: Canonical,
    /// Texels per canonical unit.
    pub density: f64,
    pub options: &'a BakeOptions,
    pub stop: &'a CancelToken,
    pub warnings: Vec<String>,
}

impl Layouter<'_> {
    /// Lays out every object.
    pub fn lay_out(&mut self, objects: &[SceneObject]) -> Result<LightmapLayout, BakeError> {
        let mut layout = LightmapLayout { density: self.density, ..LightmapLayout::default() };
        let mut instances: HashMap<Vec<u64>, ObjectLayout> = HashMap::new();
        let mut texels = 0u64;
        for object in objects {
            let key = instance_key(object, self.space);
            let ObjectLayout { meshes, moved, width, height } = match instances.get(&key) {
                Some(known) => known.clone(),
                None => instances.entry(key).insert_entry(self.lay_out_object(object)?).get().clone(),
            };
            texels += u64::from(width) * u64::from(height);
            if texels > MAX_TEXELS {
                return Err(BakeError::TooManyTexels { texels, limit: MAX_TEXELS });
            }
            layout.maps.push(MapLayout { meshes, moved, width, height, first: layout.texels });
            layout.texels = texels as usize;
        }
        Ok(layout)
    }

    fn lay_out_object(&mut self, object: &SceneObject) -> Result<ObjectLayout, BakeError> {
        let geometry = ObjectGeometry::new(object, self.space);
        match self.with_given_uv1(object, &geometry) {
            Some(layout) => Ok(layout),
            None => self.unwrapped_anew(object, &geometry),
        }
    }

    /// Texels per canonical unit of an object.
    fn density_of(&self, object: &SceneObject) -> f64 {
        self.density * object.lightmap_scale
    }

    /// The object's layout by the `uv1` that its meshes have, if that can hold a lightmap; warns if it has `uv1` that
    /// cannot.
    fn with_given_uv1(&mut self, object: &SceneObject, geometry: &ObjectGeometry) -> Option<ObjectLayout> {
        let name = &object.name;
        let Some(uv_area) = geometry.uv_area.filter(|&area| area > 0.0) else {
            if geometry.uv_area == Some(0.0) && geometry.area > 0.0 {
                let warning = "its TEXCOORD_1 covers no area, or is not finite; it was unwrapped anew";
                self.warnings.push(format!("{name}: {warning}"));
            }
            return None;
        };
        let side = match self.options.density {
            Density::MapSize(side) => scaled_side(object, side),
            _ => limited_side(((geometry.area / uv_area).sqrt() * self.density_of(object)).ceil()),
        };
        self.warnings.push(match validate_uv1(&geometry.mesh, side, side) {
            Ok(report) if report.is_sound() => {
                let meshes = object.primitives.iter().map(|primitive| Arc::clone(&primitive.mesh));
                let moved = vec![false; object.primitives.len()];
                return Some(ObjectLayout { meshes: meshes.collect(), moved, width: side, height: side });
            }
            Ok(report) => format!(
                "{name}: its TEXCOORD_1 cannot hold a lightmap at {side} x {side} texels ({} triangles out of range, {} \
                 without area, {} overlapping pairs); it was unwrapped anew",
                report.out_of_range.len(),
                report.without_coverage.len(),
                report.overlapping.len()
            ),
            Err(error) => format!("{name}: {error}; it was unwrapped anew"),
        });
        None
    }

    /// The object's layout by a new unwrap.
    fn unwrapped_anew(
        &mut self,
        object: &SceneObject,
        geometry: &ObjectGeometry,
    ) -> Result<ObjectLayout, BakeError> {
        let (object, moved) = free_second(object)?;
        let name = &object.name;
        if moved.contains(&true) {
            self.warnings.push(format!(
                "{name}: its textures' coordinates were moved from TEXCOORD_1, where the lightmap needs its own, to TEXCOORD_0, which \
                 nothing else read"
            ));
        }
        let may_continue = || !self.stop.is_cancelled();
        let chart_angle = UnwrapOptions::default().chart_angle;
        let charted = Charted::new(&geometry.mesh, &geometry.mesh.positions, chart_angle, &may_continue)
            .map_err(|source| BakeError::Unwrap { object: name.clone(), source })?;
        let charted = ChartedObject { name, charted, gap: self.options.gap };
        let (unwrapped, width, height) = match self.options.density {
            Density::MapSize(side) => {
                let requested = scaled_side(&object, side);
                let (unwrapped, side) = charted.fit_square(geometry.area, requested)?;
                if side > requested {
                    self.warnings.push(format!(
                        "{name}: its {} charts do not fit a map of {requested} x {requested} texels; it got one of {side} x {side}",
                        charted.charted.len()
                    ));
                }
                (unwrapped, side, side)
            }
            _ => {
                let density = self.density_of(&object);
                let (unwrapped, found) = charted.at_most(density)?;
                if found < density {
                    let share = 100.0 * found / density;
                    self.warnings.push(format!(
                        "{name}: its lightmap would exceed {LARGEST_SIDE} texels a side; it got {share:.0} % of the density"
                    ));
                }
                let (width, height) = (unwrapped.width.max(1), unwrapped.height.max(1));
                (unwrapped, width, height)
            }
        };
        // Maps coordinates from the charts' rectangle to the whole map.
        let shrink =
            Vec2::new(unwrapped.width as f32 / width as f32, unwrapped.height as f32 / height as f32);
        Ok(ObjectLayout { meshes: split(&object, &unwrapped, shrink), moved, width, height })
    }
}

/// The side of a map whose size the options give as `side`, for the object's lightmap scale.
fn scaled_side(object: &SceneObject, side: u32) -> u32 {
    limited_side((f64::from(side) * object.lightmap_scale).round())
}

/// A side of a map within the limits, in texels.
fn limited_side(side: f64) -> u32 {
    side.clamp(4.0, f64::from(LARGEST_SIDE)) as u32
}

/// The charts of an object, which are packed at one density after the other.
struct ChartedObject<'a> {
    name: &'a str,
    charted: Charted<'a>,
    gap: u32,
}

impl ChartedObject<'_> {
    /// An unwrap at a density, in texels per canonical unit; `None` if it is larger than a map of this side.
    fn unwrap(&self, density: f64, side: u32) -> Result<Option<Unwrapped>, BakeError> {
        match self.charted.unwrap(density, self.gap, side) {
            Ok(unwrapped) => Ok(Some(unwrapped)),
            Err(UnwrapError::TooLarge { .. }) => Ok(None),
            Err(source) => Err(BakeError::Unwrap { object: self.name.to_owned(), source }),
        }
    }

    fn too_many_charts(&self) -> BakeError {
        BakeError::TooManyCharts {
            object: self.name.to_owned(),
            charts: self.charted.len(),
            limit: LARGEST_SIDE,
        }
    }

    /// The unwrap at the first density, from the given one down by factors of 0.7, that fits a map of this side; that
    /// density, and the last one that did not fit.
    fn first_fit(&self, from: f64, side: u32) -> Result<(Option<Unwrapped>, [f64; 2]), BakeError> {
        let [mut low, mut high] = [from; 2];
        for _ in 0..MAX_DENSITIES {
            if let Some(unwrapped) = self.unwrap(low, side)? {
                return Ok((Some(unwrapped), [low, high]));
            }
            (high, low) = (low, 0.7 * low);
        }
        Ok((None, [low, high]))
    }

    /// About the densest unwrap that fits a square map, with the map's side. The side is `requested`, doubled until the
    /// charts, of this total area, fit at all.
    fn fit_square(&self, area: f64, requested: u32) -> Result<(Unwrapped, u32), BakeError> {
        let mut side = requested;
        let sparsest = loop {
            match self.unwrap(SPARSEST, side)? {
                Some(unwrapped) => break unwrapped,
                None if side < LARGEST_SIDE => side = (2 * side).min(LARGEST_SIDE),
                None => return Err(self.too_many_charts()),
            }
        };
        // Decrease the density from an upper bound (charts that fill the whole map) until an unwrap fits, then bisect.
        let filling = if area > 0.0 { f64::from(side) / area.sqrt() } else { 1.0 };
        let (fitting, [mut low, mut high]) = self.first_fit(filling, side)?;
        let mut best = fitting.unwrap_or(sparsest);
        for _ in 0..6 {
            let middle = 0.5 * (low + high);
            match self.unwrap(middle, side)? {
                Some(unwrapped) => (best, low) = (unwrapped, middle),
                None => high = middle,
            }
        }
        Ok((best, side))
    }

    /// An unwrap at `density` or at the next lower one at which its map does not exceed [`LARGEST_SIDE`], and that
    /// density.
    fn at_most(&self, density: f64) -> Result<(Unwrapped, f64), BakeError> {
        let (unwrapped, [found, _]) = self.first_fit(density, LARGEST_SIDE)?;
        Ok((unwrapped.ok_or_else(|| self.too_many_charts())?, found))
    }
}

/// A key that is equal for objects with the same meshes whose transforms differ only by a rotation and translation:
/// such objects share their lightmap coordinates.
fn instance_key(object: &SceneObject, space: Canonical) -> Vec<u64> {
    let mut key = Vec::with_capacity(1 + object.primitives.len() * 7);
    key.push(object.lightmap_scale.to_bits());
    for primitive in &object.primitives {
        key.push(Arc::as_ptr(&primitive.mesh) as usize as u64);
        // The textures of one instance of a mesh may read `uv1` while those of another leave it free.
        key.extend(sets_read(primitive.textures.as_ref()).map(u64::from));
        let m = primitive.transform.matrix3;
        let scale = space.scale * space.scale;
        for (a, b) in [
            (m.x_axis, m.x_axis),
            (m.y_axis, m.y_axis),
            (m.z_axis, m.z_axis),
            (m.x_axis, m.y_axis),
            (m.y_axis, m.z_axis),
            (m.x_axis, m.z_axis),
        ] {
            // Rotation perturbs the last bits, so products of the axes are compared rounded: lengths to the leading
            // bits, cosines to a thousandth.
            let size = (a.length_squared() * b.length_squared()).sqrt();
            let cosine = if size > 0.0 { (a.dot(b) / size * 1000.0).round() } else { 0.0 };
            key.push((size * scale).to_bits() >> 40);
            key.push(cosine.to_bits());
        }
    }
    key
}

/// All triangles of an object as one mesh in canonical space.
struct ObjectGeometry {
    mesh: TriangleMesh,
    area: f64,
    /// Area that the triangles cover in `uv1` space, if every primitive has `uv1`.
    uv_area: Option<f64>,
}

impl ObjectGeometry {
    fn new(object: &SceneObject, space: Canonical) -> Self {
        let mut mesh = TriangleMesh::default();
        let has_uv = object.primitives.iter().all(|p| !p.mesh.uv1.is_empty() || p.mesh.positions.is_empty());
        for primitive in &object.primitives {
            let base = mesh.positions.len() as u32;
            let points = world_points(&primitive.transform, &primitive.mesh);
            mesh.positions.extend(points.map(|point| space.position(point)));
            if has_uv {
                mesh.uv1.extend_from_slice(&primitive.mesh.uv1);
            }
            mesh.indices.extend(primitive.mesh.indices.iter().map(|index| index + base));
        }
        let (mut area, mut uv_area) = (0.0, 0.0);
        for triangle in mesh.triangles() {
            let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize].as_dvec3());
            let triangle_area = 0.5 * (b - a).cross(c - a).length();
            area += if triangle_area.is_finite() { triangle_area } else { 0.0 };
            if has_uv {
                let [a, b, c] = triangle.map(|vertex| mesh.uv1[vertex as usize].as_dvec2());
                let triangle_area = 0.5 * (b - a).perp_dot(c - a).abs();
                uv_area += if triangle_area.is_finite() { triangle_area } else { 0.0 };
            }
        }
        Self { mesh, area, uv_area: has_uv.then_some(uv_area) }
    }
}

/// The part of a [`MapLayout`] that instances of the same object share.
#[derive(Clone)]
struct ObjectLayout {
    meshes: Vec<Arc<TriangleMesh>>,
    moved: Vec<bool>,
    width: u32,
    height: u32,
}

/// Density so low that every chart has the fewest possible texels, in texels per canonical unit.
const SPARSEST: f64 = 1e-9;
/// Most densities that are tried, each 0.7 times the one before: down to a millionth.
const MAX_DENSITIES: u32 = 40;

/// Divides the unwrap of the whole object among its primitives' meshes.
fn split(object: &SceneObject, unwrapped: &Unwrapped, shrink: Vec2) -> Vec<Arc<TriangleMesh>> {
    let (mut first_vertex, mut first_index) = (0u32, 0usize);
    let mut meshes = Vec::with_capacity(object.primitives.len());
    for primitive in &object.primitives {
        let mesh = &primitive.mesh;
        let vertices = first_vertex..first_vertex + mesh.positions.len() as u32;
        // The unwrap's vertices of this primitive, and where they are in its new mesh.
        let (mut chosen, mut places) = (Vec::new(), HashMap::new());
        for (vertex, source) in unwrapped.vertex_sources.iter().enumerate() {
            if vertices.contains(source) {
                places.insert(vertex as u32, chosen.len() as u32);
                chosen.push(vertex);
            }
        }
        let sources: Vec<u32> =
            chosen.iter().map(|&vertex| unwrapped.vertex_sources[vertex] - vertices.start).collect();
        let indices = &unwrapped.mesh.indices[first_index..first_index + mesh.indices.len()];
        let indices = indices.iter().map(|index| places[index]).collect();
        let uv1 = chosen.iter().map(|&vertex| unwrapped.mesh.uv1[vertex] * shrink).collect();
        meshes.push(Arc::new(TriangleMesh { uv1, ..mesh.with_vertices(&sources, indices) }));
        (first_vertex, first_index) = (vertices.end, first_index + mesh.indices.len());
    }
    meshes
}
