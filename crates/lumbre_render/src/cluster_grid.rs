//! The grid of clusters that a view is divided into: columns and rows of tiles, and slices of depth, with their planes.
//! Which lights reach a cluster is found in `light_clusters`.

use glam::DVec3;

use crate::extract::{CameraView, ViewVolume};

/// Largest number of depth slices.
const MAX_SLICES: f64 = 96.0;
/// Slices overlap by this fraction of a slice, for the rounding of a depth and of its logarithm on the
/// device.
const SLICE_MARGIN: f64 = 2e-3;

/// The view that a grid is built for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ClusteredView {
    pub view: CameraView,
    /// Origin of frame space in the world.
    pub origin: DVec3,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Depth range along the line of sight that contains anything to light, in metres.
    pub depths: [f64; 2],
    /// No tile has a shorter side than this, in pixels.
    pub finest_tile: u32,
}

/// One screen axis of the grid. A coordinate on it is x (or y) divided by depth in a perspective view, and x
/// itself otherwise.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axis {
    pub first: f64,
    pub step: f64,
    pub count: u32,
    pub perspective: bool,
}

/// The plane at an edge of a row: through the eye in a perspective view, otherwise parallel to the line of
/// sight. The signed distance of a point from it is y `normal_y` + depth `normal_depth` - `offset`, positive
/// below.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    pub normal_y: f64,
    pub normal_depth: f64,
    pub offset: f64,
}

/// The depth axis. In a perspective view the slices have equal ratios, so that clusters are about as deep as
/// they are wide; otherwise they have equal depths.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Depths {
    pub count: u32,
    pub scale: f64,
    pub bias: f64,
    pub logarithmic: bool,
}

impl ClusteredView {
    /// Returns a direction of the world in view space: to the right, downwards, along the line of sight.
    pub fn turned(&self, direction: DVec3) -> DVec3 {
        let basis = self.view.basis;
        let mirrored = match self.view.volume {
            ViewVolume::Perspective { .. } => [1.0; 2],
            ViewVolume::Orthographic { half_width, half_height, .. } => {
                [half_width.signum(), half_height.signum()]
            }
        };
        DVec3::new(
            direction.dot(basis.x_axis) * mirrored[0],
            -direction.dot(basis.y_axis) * mirrored[1],
            -direction.dot(basis.z_axis),
        )
    }
}

impl Edge {
    pub fn new(axis: &Axis, edge: u32) -> Self {
        let coordinate = axis.first + axis.step * f64::from(edge);
        if !axis.perspective {
            return Self { normal_y: 1.0, normal_depth: 0.0, offset: coordinate };
        }
        let length = (1.0 + coordinate * coordinate).sqrt();
        Self { normal_y: 1.0 / length, normal_depth: -coordinate / length, offset: 0.0 }
    }

    /// Returns the signed distance of a point at this height and depth.
    pub fn distance(&self, y: f64, depth: f64) -> f64 {
        y * self.normal_y + depth * self.normal_depth - self.offset
    }
}

impl Axis {
    /// Returns the columns and rows of tiles with this side in pixels, from the frame's upper left corner.
    /// The last ones may extend beyond the frame.
    pub fn both(view: &ClusteredView, side: u32) -> [Self; 2] {
        let (half, perspective) = match view.view.volume {
            ViewVolume::Perspective { half_width, half_height, .. } => ([half_width, half_height], true),
            ViewVolume::Orthographic { half_width, half_height, .. } => {
                ([half_width.abs(), half_height.abs()], false)
            }
        };
        [0, 1].map(|axis| Self {
            first: -half[axis],
            step: 2.0 * half[axis] * f64::from(side) / f64::from(view.size[axis]),
            count: view.size[axis].div_ceil(side),
            perspective,
        })
    }

    /// Returns the middle of a tile at a depth, and how far the tile extends from there at most between
    /// depths that are `half_depth` away; `far` is the greater of them.
    pub fn tile(&self, tile: u32, depth: f64, far: f64, half_depth: f64) -> (f64, f64) {
        let middle = self.first + self.step * (f64::from(tile) + 0.5);
        match self.perspective {
            true => (middle * depth, middle.abs() * half_depth + 0.5 * self.step * far),
            false => (middle, 0.5 * self.step),
        }
    }

    /// Returns the first and the last tile that a sphere reaches.
    pub fn span(&self, place: f64, depth: f64, radius: f64) -> Option<[u32; 2]> {
        let (least, most) = match self.perspective {
            true => tangents(place, depth, radius),
            false => (place - radius, place + radius),
        };
        let [first, last] = [least, most].map(|place| (place - self.first) / self.step);
        let count = f64::from(self.count);
        // Casts to u32 round down and saturate.
        (last >= 0.0 && first < count).then(|| [first.max(0.0) as u32, last.min(count - 1.0) as u32])
    }
}

/// Returns the least and the largest place / depth of a disc as seen from the origin; infinite where the
/// tangent does not meet anything in front.
fn tangents(place: f64, depth: f64, radius: f64) -> (f64, f64) {
    let squared = place * place + depth * depth - radius * radius;
    if squared <= 0.0 {
        return (f64::NEG_INFINITY, f64::INFINITY);
    }
    let length = squared.sqrt();
    let [least, most] = [depth * length + place * radius, depth * length - place * radius];
    (
        if least > 0.0 { (place * length - depth * radius) / least } else { f64::NEG_INFINITY },
        if most > 0.0 { (place * length + depth * radius) / most } else { f64::INFINITY },
    )
}

impl Depths {
    /// Creates slices between two depths. Nearer points belong to the first slice, farther ones to the last.
    pub fn new(view: &ClusteredView, side: u32, near: f64, far: f64) -> Self {
        let [columns, rows] = Axis::both(view, side);
        let width = columns.step.min(rows.step);
        let one = Self { count: 1, scale: 0.0, bias: 0.0, logarithmic: columns.perspective };
        let extent = far - near;
        // There is no light or no object in this range.
        if extent.is_nan() || extent <= 0.0 {
            return one;
        }
        if !columns.perspective {
            let count = ((far - near) / width).ceil().clamp(1.0, MAX_SLICES);
            let scale = count / (far - near);
            return Self { count: count as u32, scale, bias: -near * scale, ..one };
        }
        let near = near.max(far * 1e-9);
        let octaves = (far / near).log2();
        // Slices are as deep as tiles are wide, or deeper if there would be too many.
        let per_octave = 1.0 / (1.0 + width).log2();
        let count = (octaves * per_octave).ceil().clamp(1.0, MAX_SLICES);
        let scale = count / octaves;
        Self { count: count as u32, scale, bias: -near.log2() * scale, ..one }
    }

    pub fn slice(&self, depth: f64) -> f64 {
        let along = if self.logarithmic { depth.max(f64::MIN_POSITIVE).log2() } else { depth };
        along * self.scale + self.bias
    }

    /// Returns the first and the last slice that a sphere reaches; `None` if it lies behind the eye.
    pub fn span(&self, depth: f64, radius: f64) -> Option<[u32; 2]> {
        if self.logarithmic && depth + radius <= 0.0 {
            return None;
        }
        let end = f64::from(self.count - 1);
        let first = self.slice(depth - radius) - SLICE_MARGIN;
        let last = self.slice(depth + radius) + SLICE_MARGIN;
        // Casts to u32 round down.
        Some([first, last].map(|slice| slice.clamp(0.0, end) as u32))
    }

    /// Returns the depths at which a slice begins and ends.
    pub fn bounds(&self, slice: u32) -> [f64; 2] {
        let depth = |place: f64| {
            let along = (place - self.bias) / self.scale;
            if self.logarithmic { along.exp2() } else { along }
        };
        let nearest = if self.logarithmic { 0.0 } else { f64::NEG_INFINITY };
        [
            if slice == 0 { nearest } else { depth(f64::from(slice) - SLICE_MARGIN) },
            if slice + 1 == self.count { f64::INFINITY } else { depth(f64::from(slice + 1) + SLICE_MARGIN) },
        ]
    }
}
