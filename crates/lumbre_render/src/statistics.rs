//! What a frame was made of: counts, uploads, and the stages of the CPU. Data only.

use lumbre_graph::ExecutionStages;

use crate::shading_need::ShadingNeeds;

/// Counts of one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Statistics {
    /// Lights that are on, ambient ones apart. Each face of an emissive object that lights others is one.
    pub lights: u32,
    /// Of these, the static ones: a lightmapped mesh takes their highlights only. 0 while lightmaps are switched off.
    pub static_lights: u32,
    /// Lights in the list of an object in view, on average: what each of its vertices or fragments loops over. Where fragments find
    /// lights with a range by clusters, these are not in it.
    pub lights_per_object: f32,
    /// Objects in view.
    pub objects: usize,
    /// Objects outside the view, not drawn.
    pub objects_outside: usize,
    /// Triangles in view.
    pub triangles: usize,
    /// Draw calls.
    pub draws: usize,
    /// Views that mirrors in sight call for, beside the camera's.
    pub mirror_views: usize,
    /// Forward shader variants compiled so far.
    pub variants: usize,
    /// Pipelines made so far.
    pub pipelines_made: usize,
    /// Pipelines, and effects, that this frame called for and that are still being made: it went on as one before it
    /// ([`MissingPipelines::Background`](crate::MissingPipelines)).
    pub pipelines_awaited: usize,
    /// What the objects in view take that are shaded by need.
    pub shading_by_need: ShadingNeeds,
    /// How fragments and vertices find their lights.
    pub light_lists: LightListing,
    /// What the passes that draw lit surfaces draw and test, each its own; zeros where nothing is measured, since every object's list is counted for it.
    pub lit_passes: LitPasses,
    /// What the CPU did, stage by stage.
    pub cpu: CpuStages,
    /// What was uploaded for this frame, by what it is.
    pub uploads: Uploads,
}

/// Bytes brought to the GPU for one frame. The uniform of the frame itself, some two hundred bytes, is not counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Uploads {
    /// Matrices of objects.
    pub transforms: u64,
    /// Records of materials.
    pub materials: u64,
    /// What each draw's instances are.
    pub instances: u64,
    /// Records of lights.
    pub lights: u64,
    /// Lists of the lights that reach objects.
    pub light_lists: u64,
    /// Clusters: their grid, their lists, and the records of inverse-square lights.
    pub clusters: u64,
    /// Views of shadow maps.
    pub shadows: u64,
    /// Attributes and indices of meshes, those of casters of shadows too.
    pub meshes: u64,
    /// Textures of materials with their mip levels.
    pub textures: u64,
    /// Lightmaps.
    pub lightmaps: u64,
    /// Irradiance volumes: their light.
    pub irradiance_volumes: u64,
    /// What effects brought themselves, as [`Effect::work`](crate::effects::Effect::work) counts it.
    pub effects: u64,
}

impl Uploads {
    /// All of them.
    pub fn total(&self) -> u64 {
        self.components()
            + self.meshes
            + self.textures
            + self.lightmaps
            + self.irradiance_volumes
            + self.effects
    }

    /// What follows from components of the World, meshes, pictures and volumes apart.
    pub fn components(&self) -> u64 {
        let Self { transforms, materials, instances, lights, light_lists, clusters, shadows, .. } = self;
        transforms + materials + instances + lights + light_lists + clusters + shadows
    }
}

/// The passes that draw lit surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct LitPasses {
    /// Opaque surfaces with a lightmap.
    pub lightmap: PassLights,
    /// Opaque surfaces without one.
    pub forward: PassLights,
    /// Surfaces that light passes through.
    pub refraction: PassLights,
    /// Surfaces that are blended.
    pub transparent: PassLights,
}

impl LitPasses {
    /// Those of the pass of this name, if it draws lit surfaces.
    pub fn of(&self, pass: &str) -> Option<&PassLights> {
        match pass {
            "lightmap" => Some(&self.lightmap),
            "forward" => Some(&self.forward),
            "refractive surfaces" => Some(&self.refraction),
            "transparent" => Some(&self.transparent),
            _ => None,
        }
    }
}

/// What a pass draws, and the lights that its vertices or fragments test.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct PassLights {
    /// Objects in view.
    pub objects: usize,
    /// Draw calls.
    pub draws: usize,
    /// Different lights in the lists of its objects, and in those of clusters where its fragments read them.
    pub lights: u32,
    /// Lights in the list of one of its objects, on average; without those that its fragments find by clusters.
    pub lights_per_object: f32,
}

/// By which lists lights are found, with their sizes.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct LightListing {
    /// Whether Phong fragments find lights with a range by clusters.
    pub clustered: bool,
    /// Columns, rows and slices of depth of the clusters; 0 without.
    pub clusters: [u32; 3],
    /// Pixels along the side of a cluster's tile; 0 without.
    pub tile_side: u32,
    /// Entries of all clusters' lists.
    pub entries: usize,
    /// Of these, the inverse-square lights of one colour, which have lean records.
    pub inverse_square_lights: u32,
    /// Other lights with a range: with a cone, an attenuation of their own, several colours.
    pub other_ranged_lights: u32,
    /// Lights without a range, directional and polygon lights: they are in the lists of objects always.
    pub unbounded_lights: u32,
}

/// Milliseconds of a frame on the CPU, from the call of `render` until it was submitted. The stages follow each other without a gap.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct CpuStages {
    /// Looking whether anything has changed at all since the last frame.
    pub changes_ms: f64,
    /// Transforms carried down the hierarchy.
    pub transforms_ms: f64,
    /// Changed objects and their bounds, counted as they change.
    pub objects_ms: f64,
    /// Lights and their records.
    pub lights_ms: f64,
    /// The census and the facts that follow from it.
    pub census_ms: f64,
    /// What effects take from the World, and what they prepare on the GPU.
    pub effects_ms: f64,
    /// Which objects are in view, and which shader variant draws each.
    pub visibility_ms: f64,
    /// Sorting, batches, and the lists of objects.
    pub draws_ms: f64,
    /// Pipelines that were made, begun, or found to be there.
    pub pipelines_ms: f64,
    /// The lists of clusters.
    pub clusters_ms: f64,
    /// Views of shadow maps, and which of them changed.
    pub shadows_ms: f64,
    /// Buffers, meshes, textures, irradiance volumes and bind groups.
    pub upload_ms: f64,
    /// The graph, its passes' commands, and their submission.
    pub encoding_ms: f64,
    /// What encoding consists of, where times are measured: the rest of it is the declaration of the passes. Zeros elsewhere.
    pub execution: ExecutionStages,
    /// All of it.
    pub total_ms: f64,
}

impl CpuStages {
    /// Each stage by its name, in the order in which a frame goes through them: with [`remainder_ms`](Self::remainder_ms) they sum to the whole.
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

    /// Milliseconds of the whole that belong to no stage.
    pub fn remainder_ms(&self) -> f64 {
        self.total_ms - self.named().iter().map(|(_, ms)| ms).sum::<f64>()
    }
}
