//! Clustered forward shading (Olsson, Billeter and Assarsson, High Performance Graphics 2012). The view is
//! divided into tiles of pixels and slices of depth; each of these clusters has a list of the lights whose
//! range reaches it, and a fragment evaluates only those. The lists are exact, not an approximation: a light
//! that is missing from a cluster is 0 everywhere in it. They are built on the CPU for every frame in which
//! something moved, slice by slice on all cores. The shader that reads them is shaders/light_clusters.wesl; the
//! grid itself is in `cluster_grid`, the lists of whole objects are in `light_lists`, and what the cone of a spotlight
//! does not touch is found by `light_cone`.

use std::ops::Range;
use std::sync::OnceLock;

use glam::{DVec3, UVec3};

use crate::cluster_grid::{Axis, ClusteredView, Depths, Edge};
use crate::extract::ConeReach;
use crate::layout::ClusterGridData;
use crate::light_cone::LightCone;

/// Tile sides that are tried, in pixels, finest first. At 32 pixels the lists are short, and the 64-pixel
/// tiles of a software rasterizer still contain whole tiles. Coarser tiles are for frames in which building
/// the lists would take longer than they save.
const TILE_SIDES: [u32; 7] = [32, 64, 128, 256, 512, 1024, 16384];
/// Largest number of clusters, and largest estimated number of list entries. Beyond these, a coarser grid is
/// used.
const MANY_CLUSTERS: f64 = 131_072.0;
const MANY_ENTRIES: f64 = 3e6;
/// Number of lights that the list entries are estimated from, if there are more.
const SAMPLED_LIGHTS: usize = 1000;
/// Slices are given to other cores in groups of about this many estimated list entries. A group takes some 0.1 ms,
/// which is several times what waking up another core takes.
const ENTRIES_PER_TASK: f64 = 16_384.0;
/// By how much a light's range is enlarged, relative to the range and to the distance from the origin of
/// frame space. This covers the rounding of points, of the depth and of its logarithm on the device.
const RANGE_MARGIN: f64 = 1e-4;
const DISTANCE_MARGIN: f64 = 2e-6;

/// A sphere that contains all points that a light reaches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BoundingSphere {
    /// The index of the light in the shader.
    pub light: u32,
    /// In world space.
    pub center: DVec3,
    /// In metres, finite.
    pub radius: f64,
    /// The cone that the light does not leave, if it is a spotlight.
    pub cone: Option<ConeReach>,
}

/// The light lists of a frame. Its vectors are reused from frame to frame.
#[derive(Debug, Default)]
pub(crate) struct LightClusters {
    /// The offset at which the list of each cluster begins in this vector, and the end of the last list; the
    /// same for the second and the third class of lights; then the lists of the first class with two lights
    /// per word, and those of the others with one light per word. Each class ends in one extra word, so that
    /// an empty list at the end can be read.
    pub values: Vec<u32>,
    pub grid: ClusterGridData,
    /// Side of a tile in pixels.
    pub tile_side: u32,
    /// Number of entries in all lists.
    pub entries: usize,
    /// Index of a black light of the first class.
    black: u32,
    spheres: Vec<ViewSphere>,
    cones: Vec<ViewCone>,
    rows: Vec<Edge>,
    /// The slices of depth that each sphere reaches.
    reached: Vec<Range<usize>>,
    /// For each slice, where the spheres that reach it begin in `reaching`; then the end of the last.
    first_reaching: Vec<u32>,
    /// Indices of spheres in ascending order, slice by slice.
    reaching: Vec<u32>,
    slices: Vec<SliceLists>,
}

/// The lists of the clusters in one slice of depth, and what is needed to build them.
#[derive(Debug, Default)]
struct SliceLists {
    /// Of each class, the position in `words` at which the list of each tile begins.
    offsets: [Vec<u32>; CLASSES],
    /// Of each class, the lists, as `LightClusters::values` has them.
    words: [Vec<u32>; CLASSES],
    entries: usize,
    spans: Vec<Span>,
}

/// Number of classes of lights.
const CLASSES: usize = 3;

/// What all slices are built from.
struct Building<'a> {
    spheres: &'a [ViewSphere],
    cones: &'a [ViewCone],
    /// The indices of the first sphere of each class, and the number of all spheres.
    classes: [usize; CLASSES + 1],
    rows: &'a [Edge],
    axes: [Axis; 2],
    depths: Depths,
    first_reaching: &'a [u32],
    reaching: &'a [u32],
    /// Index of a black light of the first class.
    black: u32,
}

/// A sphere in view space: x to the right, y downwards, depth along the line of sight.
#[derive(Clone, Copy, Debug)]
struct ViewSphere {
    light: u32,
    /// Index of its cone; `NO_CONE` for none.
    cone: u32,
    x: f64,
    y: f64,
    depth: f64,
    radius: f64,
}

const NO_CONE: u32 = u32::MAX;

/// The cone of a spotlight in view space.
#[derive(Clone, Copy, Debug)]
struct ViewCone {
    cone: LightCone,
    /// By how much spheres are enlarged that are tested, in metres, for the rounding of the light's place.
    margin: f64,
}

/// A run of clusters of one row that a light reaches.
#[derive(Clone, Copy, Debug)]
struct Span {
    /// Index of the first tile in its slice.
    first: u32,
    count: u32,
    light: u32,
}

impl LightClusters {
    /// Builds the lists of the three classes of lights: inverse-square lights, those with a shadow, and others.
    /// Lights of the first class are numbered from 0, and the number after the last one is a black light. An
    /// empty list of the second class evaluates `black`, and `none` is evaluated if there is no light of the third.
    pub fn build(&mut self, view: &ClusteredView, classes: [&[BoundingSphere]; 3], [black, none]: [u32; 2]) {
        self.spheres.clear();
        self.cones.clear();
        for sphere in classes.into_iter().flatten() {
            let mut in_view = ViewSphere::new(view, sphere);
            if let Some(cone) = ViewCone::new(view, sphere) {
                in_view.cone = saturated(self.cones.len());
                self.cones.push(cone);
            }
            self.spheres.push(in_view);
        }
        let ([columns, rows], depths, estimated_entries) = self.choose(view);
        self.grid.size = UVec3::new(columns.count, rows.count, depths.count);
        self.grid.depth_scale = depths.scale as f32;
        self.grid.depth_bias = depths.bias as f32;
        self.grid.logarithmic = u32::from(depths.logarithmic);
        self.grid.tiles_per_pixel = 1.0 / self.tile_side as f32;
        self.rows.clear();
        self.rows.extend((0..=rows.count).map(|row| Edge::new(&rows, row)));
        self.black = saturated(classes[0].len());
        let first = classes[0].len();
        let second = first + classes[1].len();
        self.find_reaching(&depths);
        let slices = depths.count as usize;
        if self.slices.len() < slices {
            self.slices.resize_with(slices, SliceLists::default);
        }
        let building = Building {
            spheres: &self.spheres,
            cones: &self.cones,
            classes: [0, first, second, self.spheres.len()],
            rows: &self.rows,
            axes: [columns, rows],
            depths,
            first_reaching: &self.first_reaching,
            reaching: &self.reaching,
            black: self.black,
        };
        let tasks = (estimated_entries / ENTRIES_PER_TASK) as usize;
        let (lists, slices_per_task) = (&mut self.slices[..slices], slices.div_ceil(tasks.max(1)));
        let build = |first, group: &mut [SliceLists]| {
            group.iter_mut().zip(first..).for_each(|(lists, slice)| lists.build(slice, &building));
        };
        let threads = if slices_per_task < lists.len() { threads() } else { None };
        match threads {
            Some(threads) => threads.install(|| in_groups(lists, slices_per_task, 0, &build)),
            None => build(0, lists),
        }
        // Evaluating any light of a class is harmless: it adds nothing where it does not reach.
        let any = self.spheres.get(second).map_or(none, |sphere| sphere.light);
        self.join([self.black | self.black << 16, black, any]);
    }

    /// Finds the spheres that reach each slice.
    fn find_reaching(&mut self, depths: &Depths) {
        let slices = depths.count as usize;
        self.first_reaching.clear();
        self.first_reaching.resize(slices + 1, 0);
        self.reached.clear();
        self.reached.extend(self.spheres.iter().map(
            |sphere| match depths.span(sphere.depth, sphere.radius) {
                Some([first, last]) => first as usize..last as usize + 1,
                None => 0..0,
            },
        ));
        // Turns numbers of spheres into ends, then fills each slice from its end, which turns ends into
        // beginnings.
        for reached in &self.reached {
            self.first_reaching[reached.clone()].iter_mut().for_each(|count| *count += 1);
        }
        let mut end = 0;
        for count in &mut self.first_reaching {
            end += *count;
            *count = end;
        }
        self.reaching.clear();
        self.reaching.resize(end as usize, 0);
        for (sphere, reached) in self.reached.iter().enumerate().rev() {
            for begin in &mut self.first_reaching[reached.clone()] {
                *begin -= 1;
                self.reaching[*begin as usize] = saturated(sphere);
            }
        }
    }

    /// Joins the lists of all slices, each class followed by one of these words.
    fn join(&mut self, last_words: [u32; CLASSES]) {
        let slices = &self.slices[..self.grid.size.z as usize];
        let clusters = (self.grid.size.x * self.grid.size.y * self.grid.size.z) as usize;
        self.grid.shadowed_offsets = saturated(clusters + 1);
        self.grid.ranged_offsets = saturated(2 * (clusters + 1));
        self.entries = slices.iter().map(|lists| lists.entries).sum();
        self.values.clear();
        let words = slices.iter().flat_map(|lists| &lists.words).map(Vec::len).sum::<usize>() + CLASSES;
        self.values.reserve(CLASSES * (clusters + 1) + words);
        let mut begin = CLASSES * (clusters + 1);
        for class in 0..CLASSES {
            for lists in slices {
                let before = saturated(begin);
                self.values.extend(lists.offsets[class].iter().map(|offset| before.saturating_add(*offset)));
                begin += lists.words[class].len();
            }
            self.values.push(saturated(begin));
            begin += 1;
        }
        for (class, last) in last_words.into_iter().enumerate() {
            slices.iter().for_each(|lists| self.values.extend_from_slice(&lists.words[class]));
            self.values.push(last);
        }
    }

    /// Chooses the finest grid whose lists are not too long, and estimates the number of their entries.
    fn choose(&mut self, view: &ClusteredView) -> ([Axis; 2], Depths, f64) {
        let mut near = f64::INFINITY;
        let mut far = f64::NEG_INFINITY;
        for sphere in &self.spheres {
            near = near.min(sphere.depth - sphere.radius);
            far = far.max(sphere.depth + sphere.radius);
        }
        let [near, far] = [near.max(view.depths[0]), far.min(view.depths[1])];
        let mut grid = None;
        for side in TILE_SIDES.into_iter().filter(|side| *side >= view.finest_tile) {
            let axes = Axis::both(view, side);
            let depths = Depths::new(view, side, near, far);
            self.tile_side = side;
            let clusters = f64::from(axes[0].count) * f64::from(axes[1].count) * f64::from(depths.count);
            // The volume of a sphere is about half that of the cube around it.
            let entries = 0.5 * self.cells(&axes, &depths);
            grid = Some((axes, depths, entries));
            if clusters <= MANY_CLUSTERS && entries <= MANY_ENTRIES {
                break;
            }
        }
        // If every tile would be too fine, the coarsest is taken.
        grid.unwrap_or_else(|| {
            self.tile_side = TILE_SIDES[TILE_SIDES.len() - 1];
            (Axis::both(view, self.tile_side), Depths::new(view, self.tile_side, near, far), 0.0)
        })
    }

    /// Returns the number of clusters in the bounding boxes of all spheres, estimated from a sample of them
    /// if there are many.
    fn cells(&self, axes: &[Axis; 2], depths: &Depths) -> f64 {
        let count = self.spheres.len();
        let sampled = count.min(SAMPLED_LIGHTS);
        // Multiples of the golden ratio spread the sample evenly over all lights, out of step with lights
        // that come in groups.
        let sample = (0..sampled).map(|number| match sampled < count {
            true => {
                let scattered = (number as u64).wrapping_mul(0x9E37_79B9) & 0xffff_ffff;
                &self.spheres[((scattered * count as u64) >> 32) as usize]
            }
            false => &self.spheres[number],
        });
        let length = |span: Option<[u32; 2]>| span.map_or(0.0, |[first, last]| f64::from(last - first + 1));
        let cells = sample.map(|sphere| {
            let slices = length(depths.span(sphere.depth, sphere.radius));
            if slices == 0.0 {
                return 0.0;
            }
            let columns = length(axes[0].span(sphere.x, sphere.depth, sphere.radius));
            slices * columns * length(axes[1].span(sphere.y, sphere.depth, sphere.radius))
        });
        cells.sum::<f64>() * count as f64 / sampled.max(1) as f64
    }
}

/// Returns the threads that build lists. They do nothing else, so that a frame never waits for other work of the
/// program, as it would among the threads of a bake. `None` if the system gives no threads.
fn threads() -> Option<&'static rayon::ThreadPool> {
    static THREADS: OnceLock<Option<rayon::ThreadPool>> = OnceLock::new();
    let start = || {
        let named = rayon::ThreadPoolBuilder::new().thread_name(|number| format!("lists of lights {number}"));
        named.build().ok()
    };
    THREADS.get_or_init(start).as_ref()
}

/// Calls `work` for groups of consecutive slices on all cores, with the number of each group's first slice.
fn in_groups(
    slices: &mut [SliceLists],
    group: usize,
    first: u32,
    work: &(impl Fn(u32, &mut [SliceLists]) + Sync),
) {
    if slices.len() <= group {
        return work(first, slices);
    }
    let half = slices.len() / 2;
    let (before, after) = slices.split_at_mut(half);
    let middle = first + saturated(half);
    rayon::join(|| in_groups(before, group, first, work), || in_groups(after, group, middle, work));
}

impl SliceLists {
    /// Builds the lists of a slice.
    fn build(&mut self, slice: u32, from: &Building) {
        self.entries = 0;
        let reaching =
            from.first_reaching[slice as usize] as usize..from.first_reaching[slice as usize + 1] as usize;
        let mut reaching = &from.reaching[reaching];
        for class in 0..CLASSES {
            let end = saturated(from.classes[class + 1]);
            let of_class;
            (of_class, reaching) = reaching.split_at(reaching.partition_point(|sphere| *sphere < end));
            self.find_spans(slice, of_class, from);
            self.count(class, from);
            match class {
                0 => self.fill_pairs(from.black),
                _ => self.fill(class),
            }
        }
    }

    /// Finds the spans of these spheres, which are given by their indices.
    fn find_spans(&mut self, slice: u32, spheres: &[u32], from: &Building) {
        let [columns, rows] = &from.axes;
        let [near, far] = from.depths.bounds(slice);
        self.spans.clear();
        for sphere in spheres.iter().map(|sphere| &from.spheres[*sphere as usize]) {
            let Some(in_slice) = sphere.between(near, far) else { continue };
            let Some([top, bottom]) = rows.span(in_slice.y, in_slice.depth, in_slice.radius) else {
                continue;
            };
            for row in top..=bottom {
                let edges = [from.rows[row as usize], from.rows[row as usize + 1]];
                let Some(in_row) = in_slice.in_row(edges) else { continue };
                let Some(mut reached) = columns.span(in_row.x, in_row.depth, in_row.radius) else {
                    continue;
                };
                if let Some(cone) = from.cones.get(sphere.cone as usize) {
                    let depths =
                        [near.max(sphere.depth - sphere.radius), far.min(sphere.depth + sphere.radius)];
                    let Some(narrowed) = cone.narrowed(reached, row, [columns, rows], depths) else {
                        continue;
                    };
                    reached = narrowed;
                }
                let [left, right] = reached;
                let (first, count) = (row * columns.count + left, right - left + 1);
                self.spans.push(Span { first, count, light: sphere.light });
            }
        }
    }

    /// Counts the lights of each tile.
    fn count(&mut self, class: usize, from: &Building) {
        let tiles = (from.axes[0].count * from.axes[1].count) as usize;
        let lengths = &mut self.offsets[class];
        lengths.clear();
        lengths.resize(tiles, 0);
        for span in &self.spans {
            self.entries += span.count as usize;
            lengths[span.tiles()].iter_mut().for_each(|length| *length += 1);
        }
    }

    /// Writes the lists of the spans. Turns lengths into end offsets, then fills each list from its end,
    /// which turns the end offsets into begin offsets.
    fn fill(&mut self, class: usize) {
        let (offsets, words) = (&mut self.offsets[class], &mut self.words[class]);
        let mut end = 0;
        for offset in &mut *offsets {
            end += *offset;
            *offset = end;
        }
        words.clear();
        words.resize(end as usize, 0);
        for span in self.spans.iter().rev() {
            for offset in &mut offsets[span.tiles()] {
                *offset -= 1;
                words[*offset as usize] = span.light;
            }
        }
    }

    /// Like `fill`, for the first class, with two lights per word. A list of odd length ends in a black light.
    fn fill_pairs(&mut self, black: u32) {
        let (offsets, words) = (&mut self.offsets[0], &mut self.words[0]);
        let mut end = 0;
        for offset in &mut *offsets {
            let length = *offset;
            *offset = 2 * end + length;
            end += length.div_ceil(2);
        }
        words.clear();
        words.resize(end as usize, black | black << 16);
        for span in self.spans.iter().rev() {
            for offset in &mut offsets[span.tiles()] {
                *offset -= 1;
                let (word, half) = ((*offset / 2) as usize, 16 * (*offset % 2));
                words[word] = words[word] & !(0xffff << half) | span.light << half;
            }
        }
        offsets.iter_mut().for_each(|offset| *offset /= 2);
    }
}

impl Span {
    /// Returns the indices of its tiles in the slice.
    fn tiles(&self) -> Range<usize> {
        self.first as usize..(self.first + self.count) as usize
    }
}

/// Converts a number of words to u32. Beyond that range no device has a buffer.
fn saturated(count: usize) -> u32 {
    u32::try_from(count).unwrap_or(u32::MAX)
}

/// Returns by how much a light's sphere is enlarged, in metres.
fn margin(view: &ClusteredView, sphere: &BoundingSphere) -> f64 {
    let from_origin = (sphere.center - view.origin).length();
    RANGE_MARGIN * sphere.radius + DISTANCE_MARGIN * (from_origin + sphere.radius)
}

impl ViewCone {
    /// Returns the cone of a light; `None` if it has none.
    fn new(view: &ClusteredView, sphere: &BoundingSphere) -> Option<Self> {
        let cone = sphere.cone?;
        let apex = cone.apex(sphere.center, sphere.radius);
        let axis = view.turned(cone.axis.as_dvec3());
        let cone = LightCone::new(view.turned(apex - view.view.eye), axis, f64::from(cone.cosine));
        Some(Self { cone, margin: margin(view, sphere) })
    }

    /// Returns a run of columns in a row of a slice without the clusters at its ends that the cone does not
    /// touch; `None` if it touches none. `depths` are those of the slice, as far as the light reaches. A
    /// cluster is tested by the sphere around it.
    fn narrowed(
        &self,
        [mut left, mut right]: [u32; 2],
        row: u32,
        [columns, rows]: [&Axis; 2],
        [near, far]: [f64; 2],
    ) -> Option<[u32; 2]> {
        let half_depth = 0.5 * (far - near);
        let depth = near + half_depth;
        let (y, half_height) = rows.tile(row, depth, far, half_depth);
        let touches = |column: u32| {
            let (x, half_width) = columns.tile(column, depth, far, half_depth);
            let half_size = DVec3::new(half_width, half_height, half_depth);
            self.cone.touches(DVec3::new(x, y, depth), half_size.length() + self.margin)
        };
        while !touches(left) {
            left += 1;
            if left > right {
                return None;
            }
        }
        while !touches(right) {
            right -= 1;
        }
        Some([left, right])
    }
}

impl ViewSphere {
    fn new(view: &ClusteredView, sphere: &BoundingSphere) -> Self {
        let DVec3 { x, y, z: depth } = view.turned(sphere.center - view.view.eye);
        Self { light: sphere.light, cone: NO_CONE, x, y, depth, radius: sphere.radius + margin(view, sphere) }
    }

    /// Returns a sphere around the part of this one that lies in a slice. Its radius is that of the largest
    /// cross-section within the slice.
    fn between(&self, near: f64, far: f64) -> Option<Self> {
        let depth = self.depth.max(near).min(far);
        let beyond = self.depth - depth;
        let squared = self.radius * self.radius - beyond * beyond;
        (squared > 0.0).then(|| Self { depth, radius: squared.sqrt(), ..*self })
    }

    /// Returns a sphere around the part of this one that lies between the planes of a row.
    fn in_row(&self, [top, bottom]: [Edge; 2]) -> Option<Self> {
        let above = top.distance(self.y, self.depth);
        let below = bottom.distance(self.y, self.depth);
        let (edge, distance) = match (above < 0.0, below > 0.0) {
            (true, _) => (top, above),
            (_, true) => (bottom, below),
            _ => return Some(*self),
        };
        let squared = self.radius * self.radius - distance * distance;
        (squared > 0.0).then(|| Self {
            y: self.y - distance * edge.normal_y,
            depth: self.depth - distance * edge.normal_depth,
            radius: squared.sqrt(),
            ..*self
        })
    }
}

#[cfg(test)]
mod tests {
    use bevy_ecs::world::World;
    use lumbre_scene::{Camera, GlobalTransform, Projection, Transform};

    use super::*;
    use crate::extract::CameraView;

    struct Random(u64);

    impl Random {
        fn within(&mut self, least: f64, most: f64) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            least + (most - least) * ((self.0 >> 11) as f64 / (1_u64 << 53) as f64)
        }

        fn place(&mut self, half: f64) -> DVec3 {
            DVec3::from([0; 3].map(|_| self.within(-half, half)))
        }
    }

    fn view(projection: Projection, size: [u32; 2], depths: [f64; 2]) -> ClusteredView {
        let mut world = World::new();
        let place = Transform::from_xyz(3.0, 2.0, 9.0).looking_at(DVec3::new(0.5, 0.0, 0.0), DVec3::Y);
        let camera =
            world.spawn((Camera { projection, exposure: 1.0 }, GlobalTransform(place.affine()))).id();
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        let view = CameraView::new(&world, camera, aspect).unwrap();
        ClusteredView { view, origin: DVec3::new(1.0, -2.0, 0.25), size, depths, finest_tile: 0 }
    }

    /// Twin of `cluster_at` in shaders/light_clusters.wesl; `None` outside of the frame.
    fn cluster_at(clusters: &LightClusters, of: &ClusteredView, point: DVec3) -> Option<usize> {
        let clip = of.view.clip_from_frame(of.origin) * (point - of.origin).extend(1.0);
        let [x, y] = [clip.x / clip.w, clip.y / clip.w];
        if clip.w <= 0.0 || x.abs() >= 1.0 || y.abs() >= 1.0 || clip.z > clip.w || clip.z < 0.0 {
            return None;
        }
        let grid = &clusters.grid;
        let pixel = |ndc: f64, size: u32| {
            ((0.5 + 0.5 * ndc) * f64::from(size) * f64::from(grid.tiles_per_pixel)) as u32
        };
        let (column, row) = (pixel(x, of.size[0]), pixel(-y, of.size[1]));
        let depth = (of.view.eye - point).dot(of.view.basis.z_axis) as f32;
        let along = if grid.logarithmic != 0 { depth.max(1e-30).log2() } else { depth };
        let slice = (along * grid.depth_scale + grid.depth_bias).clamp(0.0, grid.size.z as f32 - 1.0) as u32;
        Some(((slice * grid.size.y + row) * grid.size.x + column) as usize)
    }

    /// The list of a cluster whose class has its offsets from `table` on.
    fn list(clusters: &LightClusters, cluster: usize, table: u32) -> Vec<u32> {
        let first = table as usize + cluster;
        let [begin, end] = [0, 1].map(|next| clusters.values[first + next] as usize);
        let words = clusters.values[begin..end].iter();
        if table > 0 {
            return words.copied().collect();
        }
        words.flat_map(|word| [word & 0xffff, word >> 16]).filter(|light| *light != clusters.black).collect()
    }

    /// Whether a light reaches a point.
    fn reaches(sphere: &BoundingSphere, point: DVec3) -> bool {
        let in_cone = |cone: ConeReach| {
            let from_apex = point - cone.apex(sphere.center, sphere.radius);
            from_apex.dot(cone.axis.as_dvec3()) > f64::from(cone.cosine) * from_apex.length()
        };
        sphere.center.distance(point) < sphere.radius && sphere.cone.is_none_or(in_cone)
    }

    #[test]
    fn a_point_within_a_lights_reach_finds_it_in_its_cluster() {
        let wide = Projection::Perspective { vertical_fov: 1.2, aspect: None, near: 0.1, far: None };
        let narrow = Projection::Perspective { vertical_fov: 0.4, aspect: None, near: 2.0, far: None };
        let parallel =
            |half_width| Projection::Orthographic { half_width, half_height: 4.0, near: 0.1, far: 30.0 };
        for (number, (projection, size)) in [
            (wide, [640, 360]),
            (wide, [33, 1]),
            (narrow, [100, 301]),
            (parallel(6.0), [320, 200]),
            (parallel(-6.0), [97, 61]),
        ]
        .into_iter()
        .enumerate()
        {
            let mut random = Random(number as u64);
            let view = view(projection, size, [-5.0, 1e3]);
            let mut sphere = |light: u32| BoundingSphere {
                light,
                center: random.place(8.0),
                radius: if light.is_multiple_of(50) { 1e3 } else { 10.0_f64.powf(random.within(-2.0, 0.5)) },
                cone: light.is_multiple_of(3).then(|| ConeReach {
                    axis: random.place(1.0).normalize().as_vec3(),
                    cosine: random.within(0.0, 1.0) as f32,
                }),
            };
            let first: Vec<BoundingSphere> = (0..301).map(&mut sphere).collect();
            let second: Vec<BoundingSphere> = (0..50).map(&mut sphere).collect();
            let third: Vec<BoundingSphere> = (500..600).map(&mut sphere).collect();
            let mut clusters = LightClusters::default();
            // Built twice, to check that nothing is left from the first time.
            clusters.build(&view, [&third, &second, &first], [0, 0]);
            clusters.build(&view, [&first, &second, &third], [0, 0]);
            let (mut seen, mut listed, mut reaching) = (0, 0, 0);
            for _ in 0..20_000 {
                let chosen = &first[random.within(0.0, 301.0) as usize];
                let inside = random.place(1.0);
                let point = chosen.center
                    + inside.normalize_or_zero() * (chosen.radius.min(20.0) * random.within(0.0, 1.0));
                let Some(cluster) = cluster_at(&clusters, &view, point) else { continue };
                seen += 1;
                let tables = [0, clusters.grid.shadowed_offsets, clusters.grid.ranged_offsets];
                for (spheres, table) in [&first, &second, &third].into_iter().zip(tables) {
                    let list = list(&clusters, cluster, table);
                    assert!(list.is_sorted_by(|a, b| a < b), "each once: {list:?}");
                    listed += list.len();
                    for sphere in spheres.iter().filter(|sphere| reaches(sphere, point)) {
                        reaching += 1;
                        assert!(
                            list.contains(&sphere.light),
                            "view {number}: {sphere:?} is missed at {point}"
                        );
                    }
                }
            }
            assert!(seen > 100, "view {number}: only {seen} points are in view");
            // With all lights in each list there would be 451 per point. A frame with a single tile has
            // almost that many.
            let most = if size[1] < 32 { 451 } else { 110 };
            assert!(
                listed < most * seen,
                "view {number}: {listed} listed for {seen} points, {reaching} reach"
            );
        }
    }

    #[test]
    fn no_tile_is_finer_than_was_asked_for() {
        let view = view(Projection::perspective(1.0), [640, 360], [0.1, 100.0]);
        let ball = BoundingSphere { light: 0, center: DVec3::ZERO, radius: 2.0, cone: None };
        for (finest_tile, side) in [(0, 32), (32, 32), (100, 128), (256, 256), (u32::MAX, 16384)] {
            let mut clusters = LightClusters::default();
            clusters.build(&ClusteredView { finest_tile, ..view }, [&[ball], &[], &[]], [0, 1]);
            assert_eq!(clusters.tile_side, side, "{finest_tile}");
        }
    }

    #[test]
    fn lists_that_would_grow_too_long_take_a_coarser_grid() {
        let wide = Projection::Perspective { vertical_fov: 1.2, aspect: None, near: 0.1, far: None };
        let view = view(wide, [1920, 1080], [0.1, 100.0]);
        let sphere = |light| BoundingSphere { light, center: DVec3::ZERO, radius: 6.0, cone: None };
        let mut clusters = LightClusters::default();
        clusters.build(&view, [&[sphere(0)], &[], &[]], [0, 0]);
        assert_eq!(clusters.tile_side, 32);
        let many: Vec<BoundingSphere> = (0..60_000).map(sphere).collect();
        clusters.build(&view, [&many, &[], &[]], [0, 0]);
        assert!(
            clusters.tile_side > 32 && clusters.entries as f64 <= 2.0 * MANY_ENTRIES,
            "{}",
            clusters.entries
        );
        // One large light for every seven small ones: the estimate must consider both.
        let mixed = |large: f64, small: f64| -> Vec<BoundingSphere> {
            let radius = |light: u32| if light.is_multiple_of(8) { large } else { small };
            (0..16_000).map(|light| BoundingSphere { radius: radius(light), ..sphere(light) }).collect()
        };
        clusters.build(&view, [&mixed(6.0, 6.0), &[], &[]], [0, 0]);
        let coarse = clusters.tile_side;
        clusters.build(&view, [&mixed(6.0, 0.05), &[], &[]], [0, 0]);
        let few = (clusters.tile_side, clusters.entries as f64);
        assert!(
            few.0 < coarse && few.1 > 0.1 * MANY_ENTRIES && few.1 < 2.0 * MANY_ENTRIES,
            "{few:?}, {coarse}"
        );
        // Without any light every list is empty, and there is still a word to read.
        clusters.build(&view, [&[], &[], &[]], [0, 0]);
        assert_eq!((clusters.entries, list(&clusters, 0, 0)), (0, vec![]));
        assert!((clusters.values[0] as usize) < clusters.values.len());
    }
}
