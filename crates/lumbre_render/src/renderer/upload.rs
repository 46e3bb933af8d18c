//! Uploads what a frame reads: instances, lights and their lists, the data of each view, meshes and shadow maps.

use lumbre_scene::ShadowFilter;

use super::Renderer;
use crate::cluster_grid::ClusteredView;
use crate::draws::Draws;
use crate::extract::CameraView;
use crate::frame_decision::{Decided, Seen};
use crate::frame_scene::SHAPE;
use crate::mesh_buffers::Attribute;
use crate::mirror_views::MirrorView;
use crate::pipelines::{attributes, is_flat};
use crate::shadows::ShadowedView;
use crate::stage_clock::StageClock;
use crate::view_buffers::{SharedBuffers, ViewBuffers};
use crate::{CpuStages, LightListing, LitPasses, RenderError, Statistics, Uploads};

impl Renderer {
    /// Uploads what the frame reads, and returns its statistics.
    pub(super) fn upload(
        &mut self,
        decided: &Decided,
        seen: &Seen<'_>,
        finest_tile: u32,
        clock: &mut StageClock,
    ) -> Result<Statistics, RenderError> {
        let Decided { draws, mirrors, lights, light_list, .. } = decided;
        self.instances.replace(decided.every_draws().flat_map(|draws| draws.instances.iter().copied()));
        self.light_list.replace(light_list.iter().copied());
        let views = 1 + mirrors.len();
        if self.views.len() < views {
            self.views.resize_with(views, || ViewBuffers::new(&self.gpu));
        }
        let (origin, size) = (self.objects.origin, [seen.target.width, seen.target.height]);
        for ((view, draws), buffers) in views_of(decided, seen).zip(&mut self.views) {
            if let Some(depths) = draws.clustered_depths {
                buffers.clusters.build(&ClusteredView { view, origin, size, depths, finest_tile }, lights);
            }
        }
        let clustered = draws.clustered_depths.is_some();
        clock.lap(|cpu| &mut cpu.clusters_ms);
        let shadowed = !lights.shadows.is_empty();
        if shadowed {
            let depths = decided.every_draws().filter_map(|draws| draws.depths);
            let depths = depths.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]).unwrap_or([0.0, 1.0]);
            let resolution = decided.decision.settings.frame.shadow_resolution();
            let reflected = mirrors.iter().map(|mirror| mirror.view).collect();
            let height = seen.target.height;
            let planes = decided.decision.settings.frame.shadow_filter != ShadowFilter::Hard;
            let view = ShadowedView { view: seen.view, reflected, height, depths, resolution, planes };
            self.shadows.plan(&lights.shadows, &self.objects, &view);
        }
        clock.lap(|cpu| &mut cpu.shadows_ms);
        let mut uploads = self.upload_buffers(decided, seen, shadowed)?;
        if decided.counts_lights() {
            self.light_counter.begin(&self.gpu);
        }
        self.make_groups(decided);
        let flat_rule = decided.decision.flat_rule();
        let mut triangles = 0;
        self.drawn.clear();
        for (batch, lit_with) in decided.every_draws().flat_map(Draws::lit_batches) {
            match self.drawn.last_mut() {
                Some((variant, count)) if variant == lit_with => *count += batch.instances.len(),
                _ => self.drawn.push((*lit_with, batch.instances.len())),
            }
            let variant = &batch.pipeline.variant;
            if let Some(mesh) = self.meshes.get_mut(batch.mesh) {
                let flat = is_flat(variant).then_some(flat_rule);
                uploads.meshes += mesh.prepare(&self.gpu, &attributes(variant), flat);
                if decided.draws_objects {
                    uploads.meshes += mesh.prepare(&self.gpu, &[Attribute::Position], None);
                }
                triangles += mesh.triangles() * batch.instances.len();
            }
        }
        for batch in &draws.refractive {
            if let Some(mesh) = self.meshes.get_mut(batch.mesh) {
                uploads.meshes += mesh.prepare(&self.gpu, &SHAPE, None);
            }
        }
        for surface in mirrors.iter().flat_map(|mirror| &mirror.mirrors) {
            let object = self.objects.get(surface.slot);
            if let Some(mesh) = object.and_then(|object| self.meshes.get_mut(object.mesh)) {
                uploads.meshes += mesh.prepare(&self.gpu, &[Attribute::Position], None);
            }
        }
        [uploads.textures, uploads.lightmaps] = self.textures.take_uploaded();
        uploads.irradiance_volumes = self.volumes.take_uploaded();
        clock.lap(|cpu| &mut cpu.upload_ms);
        let clusters = &self.views[0].clusters.clusters;
        let light_lists = LightListing {
            clustered,
            clusters: if clustered { clusters.grid.size.to_array() } else { [0; 3] },
            tile_side: if clustered { clusters.tile_side } else { 0 },
            entries: if clustered { clusters.entries } else { 0 },
            inverse_square_lights: lights.set.inverse_square.all,
            shadowed_lights: lights.set.shadowed.all,
            other_ranged_lights: lights.set.ranged.all,
            unbounded_lights: lights.set.unbounded.all,
        };
        Ok(Statistics {
            light_lists,
            lit_passes: LitPasses::default(),
            cpu: CpuStages::default(),
            lights: lights.set.every.all,
            static_lights: lights.set.every.all - lights.set.every.dynamic,
            lights_per_object: decided.lights_per_object,
            shading_by_need: decided.shading_by_need,
            objects: draws.instances.len(),
            objects_outside: draws.outside,
            triangles,
            draws: decided.batches().count() + draws.deferred.len(),
            mirror_views: mirrors.len(),
            variants: self.pipelines.variants(),
            pipelines_made: self.pipelines.made(),
            pipelines_awaited: 0,
            uploads,
            lightmaps: self.textures.lightmap_memory(),
        })
    }

    /// Uploads the components that changed, and returns the uploaded bytes.
    fn upload_buffers(
        &mut self,
        decided: &Decided,
        seen: &Seen<'_>,
        shadowed: bool,
    ) -> Result<Uploads, RenderError> {
        let origin = self.objects.origin;
        let (settings, lights) = (&decided.decision.settings, &decided.lights.set);
        let mut uploads = Uploads {
            transforms: self.objects.transforms.pending_bytes(),
            materials: self.objects.materials.pending_bytes(),
            instances: self.instances.pending_bytes(),
            lights: self.lights.pending_bytes(),
            light_lists: self.light_list.pending_bytes(),
            ..Uploads::default()
        };
        let mut renewed = vec![
            self.objects.transforms.upload(&self.gpu),
            self.objects.materials.upload(&self.gpu),
            self.instances.upload(&self.gpu),
            self.lights.upload(&self.gpu),
            self.light_list.upload(&self.gpu),
        ];
        for ((view, draws), buffers) in views_of(decided, seen).zip(&mut self.views) {
            let size = [seen.target.width, seen.target.height];
            buffers.write(&self.gpu, (&view, origin, size), settings, lights, seen.exposure);
            if draws.clustered_depths.is_some() {
                uploads.clusters += buffers.clusters.pending_bytes();
                renewed.push(buffers.clusters.upload(&self.gpu));
            }
            buffers.lit_classes.replace(draws.dispatches(size).map(|(_, dispatch)| dispatch.class));
            if !buffers.lit_classes.values.is_empty() {
                uploads.instances += buffers.lit_classes.pending_bytes();
                // The bind group that refers to it is made for each frame.
                buffers.lit_classes.upload(&self.gpu)?;
            }
        }
        if renewed.iter().any(|renewed| !matches!(renewed, Ok(false))) {
            // Even if an upload failed, the old bind groups refer to buffers that no longer exist.
            self.views.iter_mut().for_each(ViewBuffers::forget_groups);
        }
        renewed.into_iter().collect::<Result<Vec<bool>, _>>()?;
        if let Some(transforms) = self.objects.transforms.bound().filter(|_| shadowed) {
            let layout = self.pipelines.shadow_layout();
            let of_shadows = self.shadows.upload(&self.gpu, transforms, &mut self.meshes, layout)?;
            (uploads.shadows, uploads.meshes) = (of_shadows.shadows, of_shadows.meshes);
        }
        Ok(uploads)
    }

    /// Creates the missing bind groups 0 of a frame's draws.
    fn make_groups(&mut self, decided: &Decided) {
        let mut views = std::mem::take(&mut self.views);
        for (draws, buffers) in decided.every_draws().zip(&mut views) {
            for wanted in buffers.missing_groups(draws) {
                let layout = self.pipelines.frame_layout(&self.gpu, wanted.bindings).clone();
                buffers.make_group(&self.gpu, wanted, &layout, &self.shared_buffers());
            }
        }
        self.views = views;
    }

    /// Returns the buffers of group 0 that all views share.
    pub(super) fn shared_buffers(&self) -> SharedBuffers<'_> {
        SharedBuffers {
            objects: self.objects.transforms.bound(),
            materials: self.objects.materials.bound(),
            instances: self.instances.bound(),
            lights: self.lights.bound(),
            light_list: self.light_list.bound(),
            counter: &self.light_counter,
        }
    }
}

/// Returns the views of a frame and what is drawn in each: the camera's view first, then those in mirrors.
fn views_of<'a>(
    decided: &'a Decided,
    seen: &Seen<'_>,
) -> impl Iterator<Item = (CameraView, &'a Draws)> + use<'a> {
    let mirrored = |mirror: &'a MirrorView| (mirror.view, &mirror.draws);
    std::iter::once((seen.view, &decided.draws)).chain(decided.mirrors.iter().map(mirrored))
}
