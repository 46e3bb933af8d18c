//! Lightmap coordinates for a mesh that has none: charts by normal, projected, packed into one rectangle of texels.
//! Not the packing of many meshes into pages: the caller packs whole meshes with `atlas`.
//!
//! A chart of W by H texels has its border on the *centres* of its outermost texels: bilinear filtering inside
//! the chart reads its own texels only, and two charts that meet at a seam both have samples on the seam.

use glam::{DVec2, DVec3, Vec3};

use crate::atlas::{self, Atlas, AtlasError, AtlasOptions, Placement};
use crate::bounding_rectangle::BoundingRectangle;
use crate::chart::{Charting, FlatChart};
use crate::vertex_split::VertexSplitter;
use crate::{Adjacency, MeshError, TriangleMesh, weld_positions};

/// How to unwrap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnwrapOptions {
    /// Free texels between charts: 2 for bilinear filtering, 4 for bicubic.
    pub gap: u32,
    /// Largest angle between a triangle's normal and its chart's, in degrees, in [0, 80]. Larger charts have fewer
    /// seams; a triangle is shrunk by at most the cosine.
    pub chart_angle: f64,
    /// Largest width and height, in texels.
    pub max_size: u32,
}

impl Default for UnwrapOptions {
    fn default() -> Self {
        Self { gap: 2, chart_angle: 50.0, max_size: 8192 }
    }
}

/// Where a chart lies, in texels.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// Its triangles, ascending.
    pub triangles: Vec<u32>,
    /// Its plane's unit normal; zero for the spot that holds triangles without area.
    pub normal: Vec3,
    /// Left texel.
    pub x: u32,
    /// First texel row.
    pub y: u32,
    /// Texels across, all of them the chart's own.
    pub width: u32,
    /// Texel rows.
    pub height: u32,
}

/// An unwrapped mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Unwrapped {
    /// The mesh with `uv1`. Triangles keep their order; vertices on seams are split: the first
    /// `positions.len()` of the original are in place, copies follow.
    pub mesh: TriangleMesh,
    /// The original vertex of every vertex.
    pub vertex_sources: Vec<u32>,
    /// Texels across.
    pub width: u32,
    /// Texel rows.
    pub height: u32,
    /// Together they hold every triangle once.
    pub charts: Vec<Chart>,
}

/// Why a mesh cannot be unwrapped.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum UnwrapError {
    /// The mesh is not sound.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The density is zero, negative or not a number.
    #[error("{texels_per_meter} texels per metre; give a positive finite density")]
    Density {
        /// The density given.
        texels_per_meter: f64,
    },
    /// The chart angle is out of its range.
    #[error("chart angle of {degrees} degrees; give one in [0, 80]")]
    ChartAngle {
        /// The angle given.
        degrees: f64,
    },
    /// The caller wanted no more.
    #[error("unwrapping was stopped")]
    Stopped,
    /// A chart or all of them need more texels than allowed.
    #[error(
        "the charts need {width:.0} x {height:.0} texels, the limit is {max_size}; \
         lower the texel density or raise the limit"
    )]
    TooLarge {
        /// Texels needed across.
        width: f64,
        /// Texel rows needed.
        height: f64,
        /// The limit.
        max_size: u32,
    },
}

/// Gives a mesh lightmap coordinates in `uv1`.
///
/// `metric_positions` are the vertices' world positions in metres, for the density: the mesh's own positions
/// transformed by its node, so that a node's scale counts. `texels_per_meter` is met or exceeded everywhere,
/// except that a curved chart shrinks a tilted triangle (see [`UnwrapOptions::chart_angle`]); a chart is never
/// less than 2 texels wide. Triangles without area, or with a coordinate that is not finite, share one texel.
///
/// # Errors
/// [`UnwrapError`]; an allocation is bounded by the mesh and by `max_size`.
pub fn unwrap(
    mesh: &TriangleMesh,
    metric_positions: &[Vec3],
    texels_per_meter: f64,
    options: UnwrapOptions,
) -> Result<Unwrapped, UnwrapError> {
    let chart_angle = options.chart_angle;
    let charted = Charted::new(mesh, metric_positions, chart_angle, &|| true)?;
    charted.unwrap(texels_per_meter, options.gap, options.max_size)
}

/// A mesh cut into charts, which do not depend on the density: to be unwrapped at several.
pub struct Charted<'a> {
    mesh: &'a TriangleMesh,
    surface: Surface,
    flat_charts: Vec<FlatChart>,
    without_area: Vec<u32>,
    go_on: &'a dyn Fn() -> bool,
}

impl<'a> Charted<'a> {
    /// Cuts a mesh, as [`unwrap`] does. `go_on` is asked now and then whether to.
    ///
    /// # Errors
    /// [`UnwrapError`]; [`UnwrapError::Stopped`] if `go_on` said no.
    pub fn new(
        mesh: &'a TriangleMesh,
        metric_positions: &[Vec3],
        chart_angle: f64,
        go_on: &'a dyn Fn() -> bool,
    ) -> Result<Self, UnwrapError> {
        mesh.validate()?;
        if metric_positions.len() != mesh.positions.len() {
            let (found, vertices) = (metric_positions.len(), mesh.positions.len());
            return Err(MeshError::AttributeLength { attribute: "metric positions", found, vertices }.into());
        }
        if !(0.0..=80.0).contains(&chart_angle) {
            return Err(UnwrapError::ChartAngle { degrees: chart_angle });
        }
        let surface = Surface::new(mesh, metric_positions);
        let charting = Charting {
            corners: &surface.corners,
            normals: &surface.normals,
            areas: &surface.areas,
            adjacency: &surface.adjacency,
            // Rounding must not split a plane at an angle of 0.
            least_cosine: chart_angle.to_radians().cos() - 1e-6,
        };
        let flat_charts = charting.charts(go_on).ok_or(UnwrapError::Stopped)?;
        let without_area = (0..surface.corners.len() as u32)
            .filter(|&triangle| surface.normals[triangle as usize] == DVec3::ZERO)
            .collect();
        Ok(Self { mesh, surface, flat_charts, without_area, go_on })
    }

    /// How many charts there are, one for triangles without area among them.
    pub fn len(&self) -> usize {
        self.flat_charts.len() + usize::from(!self.without_area.is_empty())
    }

    /// Whether the mesh has no triangles.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Gives the mesh lightmap coordinates at a density, as [`unwrap`] does.
    ///
    /// # Errors
    /// [`UnwrapError`].
    pub fn unwrap(&self, texels_per_meter: f64, gap: u32, max_size: u32) -> Result<Unwrapped, UnwrapError> {
        if !(texels_per_meter.is_finite() && texels_per_meter > 0.0) {
            return Err(UnwrapError::Density { texels_per_meter });
        }
        let Self { mesh, surface, flat_charts, without_area, go_on } = self;
        let mut layouts = Vec::with_capacity(flat_charts.len());
        for chart in flat_charts {
            if !go_on() {
                return Err(UnwrapError::Stopped);
            }
            layouts.push(Layout::new(chart, surface, texels_per_meter, max_size)?);
        }
        let mut rectangles: Vec<(u32, u32)> = layouts.iter().map(|layout| layout.texels).collect();
        if !without_area.is_empty() {
            rectangles.push((1, 1));
        }
        let packed = place(&rectangles, gap, max_size)?;
        let (width, height) = packed.pages.first().copied().unwrap_or_default();

        let mut charts = Vec::with_capacity(rectangles.len());
        let mut splitter = VertexSplitter::new(mesh);
        let size = DVec2::new(f64::from(width), f64::from(height));
        for (index, Placement { x, y, .. }) in packed.placements.into_iter().enumerate() {
            let corner = DVec2::new(f64::from(x), f64::from(y));
            let (rectangle_width, rectangle_height) = rectangles[index];
            let (triangles, normal) = match (flat_charts.get(index), layouts.get(index)) {
                (Some(chart), Some(layout)) => {
                    for &triangle in &chart.triangles {
                        let positions = surface.corners[triangle as usize];
                        let uv = positions.map(|p| (corner + layout.texel(chart, p)) / size);
                        splitter.assign(index as u32, triangle, uv);
                    }
                    (chart.triangles.clone(), chart.normal.as_vec3())
                }
                _ => {
                    for &triangle in without_area {
                        splitter.assign(index as u32, triangle, [(corner + 0.5) / size; 3]);
                    }
                    (without_area.clone(), Vec3::ZERO)
                }
            };
            charts.push(Chart { triangles, normal, x, y, width: rectangle_width, height: rectangle_height });
        }
        let (mesh, vertex_sources) = splitter.finish();
        Ok(Unwrapped { mesh, vertex_sources, width, height, charts })
    }
}

/// The mesh in world metres, in f64.
struct Surface {
    corners: Vec<[DVec3; 3]>,
    normals: Vec<DVec3>,
    areas: Vec<f64>,
    adjacency: Adjacency,
}

impl Surface {
    fn new(mesh: &TriangleMesh, metric_positions: &[Vec3]) -> Self {
        let welded = weld_positions(metric_positions);
        let indices: Vec<[u32; 3]> =
            mesh.triangles().map(|t| t.map(|vertex| welded[vertex as usize])).collect();
        let adjacency = Adjacency::new(&indices, metric_positions.len());
        let corners: Vec<[DVec3; 3]> =
            indices.iter().map(|t| t.map(|vertex| metric_positions[vertex as usize].as_dvec3())).collect();
        let (mut normals, mut areas) = (Vec::new(), Vec::new());
        for [a, b, c] in &corners {
            let cross = (*b - *a).cross(*c - *a);
            // Also zero where a coordinate is not finite.
            normals.push(cross.normalize_or_zero());
            areas.push(0.5 * cross.length());
        }
        Self { corners, normals, areas, adjacency }
    }
}

/// How a chart's plane maps to its own texels.
struct Layout {
    rectangle: BoundingRectangle,
    /// Texels per metre along the rectangle's sides.
    scale: DVec2,
    texels: (u32, u32),
}

impl Layout {
    fn new(
        chart: &FlatChart,
        surface: &Surface,
        texels_per_meter: f64,
        max_size: u32,
    ) -> Result<Self, UnwrapError> {
        let mut points = Vec::with_capacity(chart.triangles.len() * 3);
        let (mut area, mut projected) = (0.0, 0.0);
        for &triangle in &chart.triangles {
            let [a, b, c] = surface.corners[triangle as usize].map(|corner| chart.project(corner));
            points.extend([a, b, c]);
            area += surface.areas[triangle as usize];
            projected += 0.5 * (b - a).perp_dot(c - a);
        }
        let rectangle = BoundingRectangle::least_area(&points);
        // A curved chart gets the texels of its area, not of its shadow.
        let stretch = if projected > 0.0 && area > projected { (area / projected).sqrt() } else { 1.0 };
        let extent = (rectangle.max - rectangle.min) * texels_per_meter * stretch;
        // Whole texels between border and border; the tolerance keeps 4.000001 from becoming 5.
        let intervals = (extent - 1e-4).ceil().max(DVec2::ONE);
        let needed = intervals + 1.0;
        if needed.max_element() > f64::from(max_size) {
            return Err(UnwrapError::TooLarge { width: needed.x, height: needed.y, max_size });
        }
        let side = |intervals: f64, length: f64| if length > 0.0 { intervals / length } else { 0.0 };
        let length = rectangle.max - rectangle.min;
        let scale = DVec2::new(side(intervals.x, length.x), side(intervals.y, length.y));
        Ok(Self { rectangle, scale, texels: (needed.x as u32, needed.y as u32) })
    }

    /// Where a position falls, in texels from the chart's corner.
    fn texel(&self, chart: &FlatChart, position: DVec3) -> DVec2 {
        let local = self.rectangle.local(chart.project(position)) - self.rectangle.min;
        (local * self.scale).clamp(DVec2::ZERO, self.interior()) + 0.5
    }

    fn interior(&self) -> DVec2 {
        DVec2::new(f64::from(self.texels.0), f64::from(self.texels.1)) - 1.0
    }
}

/// All rectangles on one page.
fn place(rectangles: &[(u32, u32)], gap: u32, max_size: u32) -> Result<Atlas, UnwrapError> {
    let padded = f64::from(gap);
    let area = |&(w, h): &(u32, u32)| (f64::from(w) + padded) * (f64::from(h) + padded);
    let side = rectangles.iter().map(area).sum::<f64>().sqrt();
    let too_large = UnwrapError::TooLarge { width: side, height: side, max_size };
    // Packing them would only tell the same.
    if side > f64::from(max_size) + padded {
        return Err(too_large);
    }
    let packed = atlas::pack(rectangles, AtlasOptions { max_width: max_size, max_height: max_size, gap });
    let packed = packed.map_err(|AtlasError::TooLarge { width, height, .. }| UnwrapError::TooLarge {
        width: f64::from(width),
        height: f64::from(height),
        max_size,
    })?;
    if packed.pages.len() > 1 { Err(too_large) } else { Ok(packed) }
}
