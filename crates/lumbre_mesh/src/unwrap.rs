//! Lightmap coordinates for a mesh: cuts it into charts by normal, projects them, and packs them into one
//! rectangle of texels. Packing several meshes into shared pages is done by the caller with `atlas`.
//!
//! A chart of W by H texels has its border at the *centres* of its outermost texels. Bilinear filtering
//! inside the chart thus reads only its own texels, and two charts that meet at a seam both have samples on
//! the seam.

use glam::{DVec2, DVec3, Vec3};

use crate::atlas::{self, Atlas, AtlasError, AtlasOptions, Placement};
use crate::bounding_rectangle::BoundingRectangle;
use crate::chart::{Charting, FlatChart};
use crate::vertex_split::VertexSplitter;
use crate::{Adjacency, MeshError, TriangleMesh, weld_positions};

/// Options for unwrapping.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnwrapOptions {
    /// Free texels between charts: 2 for bilinear filtering, 4 for bicubic.
    pub gap: u32,
    /// Largest angle between a triangle's normal and its chart's, in degrees, in [0, 80]. Larger angles give
    /// larger charts with fewer seams; a triangle shrinks by at most the cosine of the angle.
    pub chart_angle: f64,
    /// Largest width and height in texels.
    pub max_size: u32,
}

impl Default for UnwrapOptions {
    fn default() -> Self {
        Self { gap: 2, chart_angle: 50.0, max_size: 8192 }
    }
}

/// A chart and its rectangle in texels.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// Its triangles in ascending order.
    pub triangles: Vec<u32>,
    /// Unit normal of its plane; zero for the chart that collects degenerate triangles.
    pub normal: Vec3,
    /// Left edge in texels.
    pub x: u32,
    /// First row in texels.
    pub y: u32,
    /// Width in texels, without any gap.
    pub width: u32,
    /// Height in texels, without any gap.
    pub height: u32,
}

/// An unwrapped mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Unwrapped {
    /// The mesh with `uv1`. Triangles keep their order. The original vertices keep their indices, and copies
    /// of the vertices on seams follow them.
    pub mesh: TriangleMesh,
    /// For every vertex, the original vertex.
    pub vertex_sources: Vec<u32>,
    /// Width of the rectangle in texels.
    pub width: u32,
    /// Height of the rectangle in texels.
    pub height: u32,
    /// The charts; every triangle is in exactly one.
    pub charts: Vec<Chart>,
}

/// Why a mesh cannot be unwrapped.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum UnwrapError {
    /// The mesh is invalid.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The density is not a positive finite number.
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
    /// The caller's `go_on` returned false.
    #[error("unwrapping was stopped")]
    Stopped,
    /// A single chart, or all charts together, exceed the size limit.
    #[error(
        "the charts need {width:.0} x {height:.0} texels, the limit is {max_size}; \
         lower the texel density or raise the limit"
    )]
    TooLarge {
        /// Width needed in texels.
        width: f64,
        /// Height needed in texels.
        height: f64,
        /// The limit in texels.
        max_size: u32,
    },
}

/// Computes lightmap coordinates for a mesh, in `uv1`.
///
/// `metric_positions` are the world positions of the vertices in metres, i.e. the mesh's positions
/// transformed by its node, so that the density accounts for the node's scale. The density is at least
/// `texels_per_meter` everywhere, except that a triangle tilted against its chart shrinks (see
/// [`UnwrapOptions::chart_angle`]). A chart is at least 2 texels wide. Degenerate triangles and those with a
/// coordinate that is not finite share one texel.
///
/// # Errors
/// [`UnwrapError`]. Allocations are bounded by the size of the mesh and by `max_size`.
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

/// A mesh cut into charts, which are independent of the density, so that it can be unwrapped at several
/// densities.
pub struct Charted<'a> {
    mesh: &'a TriangleMesh,
    surface: Surface,
    flat_charts: Vec<FlatChart>,
    without_area: Vec<u32>,
    go_on: &'a dyn Fn() -> bool,
}

impl<'a> Charted<'a> {
    /// Cuts a mesh into charts, as [`unwrap`] does. `go_on` is called now and then; if it returns false, the
    /// work stops.
    ///
    /// # Errors
    /// [`UnwrapError`]; [`UnwrapError::Stopped`] if `go_on` returned false.
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
            // The tolerance keeps rounding from splitting a plane at an angle of 0.
            least_cosine: chart_angle.to_radians().cos() - 1e-6,
        };
        let flat_charts = charting.charts(go_on).ok_or(UnwrapError::Stopped)?;
        let without_area = (0..surface.corners.len() as u32)
            .filter(|&triangle| surface.normals[triangle as usize] == DVec3::ZERO)
            .collect();
        Ok(Self { mesh, surface, flat_charts, without_area, go_on })
    }

    /// Number of charts, including one for degenerate triangles if there are any.
    pub fn len(&self) -> usize {
        self.flat_charts.len() + usize::from(!self.without_area.is_empty())
    }

    /// Returns true if the mesh has no triangles.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Computes lightmap coordinates at a density, as [`unwrap`] does.
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

/// The triangles in world metres, in f64.
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
            // Also zero if a coordinate is not finite.
            normals.push(cross.normalize_or_zero());
            areas.push(0.5 * cross.length());
        }
        Self { corners, normals, areas, adjacency }
    }
}

/// The mapping from a chart's plane to its texels.
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
        // A curved chart gets texels for its surface area, not for its projected area.
        let stretch = if projected > 0.0 && area > projected { (area / projected).sqrt() } else { 1.0 };
        let extent = (rectangle.max - rectangle.min) * texels_per_meter * stretch;
        // A whole number of texels between the borders; the tolerance keeps 4.000001 from becoming 5.
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

    /// The texel coordinates of a position, relative to the chart's corner.
    fn texel(&self, chart: &FlatChart, position: DVec3) -> DVec2 {
        let local = self.rectangle.local(chart.project(position)) - self.rectangle.min;
        (local * self.scale).clamp(DVec2::ZERO, self.interior()) + 0.5
    }

    fn interior(&self) -> DVec2 {
        DVec2::new(f64::from(self.texels.0), f64::from(self.texels.1)) - 1.0
    }
}

/// Packs all rectangles into one page.
fn place(rectangles: &[(u32, u32)], gap: u32, max_size: u32) -> Result<Atlas, UnwrapError> {
    let padded = f64::from(gap);
    let area = |&(w, h): &(u32, u32)| (f64::from(w) + padded) * (f64::from(h) + padded);
    let side = rectangles.iter().map(area).sum::<f64>().sqrt();
    let too_large = UnwrapError::TooLarge { width: side, height: side, max_size };
    // The total area already exceeds the limit, so packing cannot succeed.
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
