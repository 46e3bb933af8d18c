//! Statistics of a frame: counts, uploaded bytes, and the time of each CPU stage. Plain data.

use lumbre_graph::ExecutionStages;

use crate::g_buffer;
use crate::lightmap_texels::LightmapMemory;
use crate::shading_need::ShadingNeeds;

/// Counts of one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Statistics {
    /// Lights that are switched on, except ambient ones. Each face of an emissive object that lights others
    /// counts as one.
    pub lights: u32,
    /// How many of these are static: a lightmapped mesh does not take their diffuse part. 0 while lightmaps
    /// are switched off.
    pub static_lights: u32,
    /// Average length of the light list of an object in view, which each of its vertices or fragments loops
    /// over. Lights that fragments find by clusters are not included.
    pub lights_per_object: f32,
    /// Objects in view.
    pub objects: usize,
    /// Objects outside the view, not drawn.
    pub objects_outside: usize,
    /// Triangles in view.
    pub triangles: usize,
    /// Draw calls.
    pub draws: usize,
    /// Views that visible mirrors need, in addition to the camera's.
    pub mirror_views: usize,
    /// Shader variants of lit surfaces compiled so far.
    pub variants: usize,
    /// Pipelines of lit surfaces created so far.
    pub pipelines_made: usize,
    /// Pipelines and effects that this frame needed and that are still being created. The frame was then
    /// drawn with the decisions of an earlier one
    /// ([`MissingPipelines::Background`](crate::MissingPipelines)).
    pub pipelines_awaited: usize,
    /// What was chosen for the objects in view that are shaded by need.
    pub shading_by_need: ShadingNeeds,
    /// How fragments and vertices find their lights.
    pub light_lists: LightListing,
    /// What each pass over lit surfaces draws, and the lights that it tests. Zeros unless the frame is
    /// measured, because every object's list has to be counted.
    pub lit_passes: LitPasses,
    /// Time of each CPU stage.
    pub cpu: CpuStages,
    /// What was uploaded for this frame, by kind.
    pub uploads: Uploads,
    /// The lightmaps that the renderer keeps on the device.
    pub lightmaps: LightmapMemory,
}

/// Bytes uploaded to the GPU for one frame. The frame's own uniform, some two hundred bytes, is not counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Uploads {
    /// Matrices of objects.
    pub transforms: u64,
    /// Records of materials.
    pub materials: u64,
    /// Instances of the draws, and the classes of surfaces that compute shaders light.
    pub instances: u64,
    /// Records of lights.
    pub lights: u64,
    /// Light lists of objects.
    pub light_lists: u64,
    /// Clusters: their grid, their lists, and the records of inverse-square lights.
    pub clusters: u64,
    /// Views of shadow maps.
    pub shadows: u64,
    /// Attributes and indices of meshes, including those of shadow casters.
    pub meshes: u64,
    /// Textures of materials with their mip levels.
    pub textures: u64,
    /// Lightmaps.
    pub lightmaps: u64,
    /// Irradiance volumes: their light.
    pub irradiance_volumes: u64,
    /// What effects uploaded themselves, as reported by [`Effect::work`](crate::effects::Effect::work).
    pub effects: u64,
}

impl Uploads {
    /// Returns the sum of all bytes.
    pub fn total(&self) -> u64 {
        self.components()
            + self.meshes
            + self.textures
            + self.lightmaps
            + self.irradiance_volumes
            + self.effects
    }

    /// Returns the bytes that follow from components of the World, without meshes, images and volumes.
    pub fn components(&self) -> u64 {
        let Self { transforms, materials, instances, lights, light_lists, clusters, shadows, .. } = self;
        transforms + materials + instances + lights + light_lists + clusters + shadows
    }
}

/// The passes that light surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct LitPasses {
    /// Surfaces that compute shaders light from the G-buffer.
    pub deferred_lighting: PassLights,
    /// Opaque surfaces with a lightmap.
    pub lightmap: PassLights,
    /// Opaque surfaces without one.
    pub forward: PassLights,
    /// Transmissive surfaces.
    pub refraction: PassLights,
    /// Blended surfaces.
    pub transparent: PassLights,
}

impl LitPasses {
    /// Returns the entry of the pass with this name, if that pass lights surfaces.
    pub fn of(&self, pass: &str) -> Option<&PassLights> {
        match pass {
            g_buffer::COMPUTE_PASS => Some(&self.deferred_lighting),
            "lightmap" => Some(&self.lightmap),
            "forward" => Some(&self.forward),
            "refractive surfaces" => Some(&self.refraction),
            "transparent" => Some(&self.transparent),
            _ => None,
        }
    }
}

/// What a pass lights, and the lights that its vertices, fragments or pixels test.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct PassLights {
    /// Objects in view.
    pub objects: usize,
    /// Draw calls, or dispatches of compute shaders.
    pub draws: usize,
    /// Number of different lights in the lists of its objects, and in the clusters' lists where its fragments
    /// read those.
    pub lights: u32,
    /// Average length of the light lists of its objects, without the lights that fragments find by clusters.
    pub lights_per_object: f32,
}

/// Which lists lights are found by, and the size of these lists.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct LightListing {
    /// Whether Phong-shaded fragments find lights with a range by clusters.
    pub clustered: bool,
    /// Columns, rows and depth slices of the cluster grid; 0 without clusters.
    pub clusters: [u32; 3],
    /// Side of a cluster's tile in pixels; 0 without clusters.
    pub tile_side: u32,
    /// Number of entries in the lists of all clusters.
    pub entries: usize,
    /// Inverse-square lights of one colour, which have compact records.
    pub inverse_square_lights: u32,
    /// Inverse-square lights of one colour that cast a shadow, which have compact records, too.
    pub shadowed_lights: u32,
    /// Other lights with a range: with OpenGL's cone, a different attenuation, several colours, or a shadow for which
    /// there is no room.
    pub other_ranged_lights: u32,
    /// Lights without a range, directional lights and polygon lights. These are always in the lists of
    /// objects.
    pub unbounded_lights: u32,
}

/// CPU time of a frame in milliseconds, from the call of `render` until submission. The stages follow each
/// other without a gap.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct CpuStages {
    /// Checking whether anything has changed since the last frame.
    pub changes_ms: f64,
    /// Propagating transforms down the hierarchy.
    pub transforms_ms: f64,
    /// Updating changed objects, their bounds and their counts.
    pub objects_ms: f64,
    /// Updating lights and their records.
    pub lights_ms: f64,
    /// The census and the facts derived from it.
    pub census_ms: f64,
    /// What effects extract from the World, and what they prepare on the GPU.
    pub effects_ms: f64,
    /// Finding the objects in view and the shader variant of each.
    pub visibility_ms: f64,
    /// Sorting, batching, and the light lists of objects.
    pub draws_ms: f64,
    /// Creating or requesting pipelines, or finding existing ones.
    pub pipelines_ms: f64,
    /// Building the light lists of clusters.
    pub clusters_ms: f64,
    /// Choosing the views of shadow maps and finding out which maps changed.
    pub shadows_ms: f64,
    /// Uploading buffers, meshes, textures and irradiance volumes, and creating bind groups.
    pub upload_ms: f64,
    /// Declaring and executing the graph: recording the commands of its passes and submitting them.
    pub encoding_ms: f64,
    /// The parts of encoding, where times are measured; zeros otherwise. The rest of encoding is the
    /// declaration of the passes.
    pub execution: ExecutionStages,
    /// The whole frame.
    pub total_ms: f64,
}

impl CpuStages {
    /// Returns the name and time of each stage, in the order of a frame. Together with
    /// [`remainder_ms`](Self::remainder_ms) they sum to the total.
    pub fn named(&self) -> [(&'static str, f64); 19] {
        let within = &self.execution;
        [
            ("change detection", self.changes_ms),
            ("transforms", self.transforms_ms),
            ("objects", self.objects_ms),
            ("lights", self.lights_ms),
            ("census", self.census_ms),
            ("effects", self.effects_ms),
            ("visibility", self.visibility_ms),
            ("draws and light lists of objects", self.draws_ms),
            ("pipelines", self.pipelines_ms),
            ("light lists of clusters", self.clusters_ms),
            ("views of shadow maps", self.shadows_ms),
            ("uploads", self.upload_ms),
            ("declaration of the passes", self.encoding_ms - within.total_ms()),
            ("reading back", within.collecting_ms),
            ("graph plan", within.planning_ms),
            ("graph resources", within.resources_ms),
            ("recording", within.recording_ms),
            ("submission", within.submission_ms),
            ("upkeep of the graph", within.keeping_ms),
        ]
    }

    /// Returns the milliseconds of the total that belong to no stage.
    pub fn remainder_ms(&self) -> f64 {
        self.total_ms - self.named().iter().map(|(_, ms)| ms).sum::<f64>()
    }
}
