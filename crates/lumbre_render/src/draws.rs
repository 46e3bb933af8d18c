//! Decides what a frame draws, in which order and with which pipelines: culling, variants, sorting and
//! batching. Uploading is not done here.

use std::ops::Range;
use std::sync::Arc;

use lumbre_optics::{ErrorBound, Shading};
use lumbre_scene::{ObjectTraits, SceneSettings};

use crate::extract::{CameraView, LitPass, Object, Objects, Window};
use crate::features::{self, FrameFeatures};
use crate::g_buffer::{self, DeferredVariants, GBufferContents, LitDispatch};
use crate::irradiance_volumes::IrradianceVolumes;
use crate::layout::InstanceData;
use crate::light_lists::ObjectLightLists;
use crate::mesh_buffers::MeshKey;
use crate::pipelines::PipelineKey;
use crate::shader::{Feature, Variant};
use crate::texture_sets::TextureSet;

/// Instances of one mesh in one pipeline.
#[derive(Debug)]
pub(crate) struct Batch {
    pub pipeline: PipelineKey,
    pub mesh: MeshKey,
    pub texture_set: Option<Arc<TextureSet>>,
    /// Group 2: a lightmap or an irradiance volume.
    pub baked_light: Option<Arc<wgpu::BindGroup>>,
    /// Number of the deferred class that lights the instances; 0 if they are lit forward.
    pub class_number: u32,
    /// Range within the instances of its view.
    pub instances: Range<u32>,
}

/// Surfaces of a pass that are lit from the G-buffer by one draw: those with the same pipeline and the same
/// baked light. The number of a class is its index plus one.
#[derive(Debug)]
pub(crate) struct DeferredClass {
    pub pass: LitPass,
    pub pipeline: PipelineKey,
    /// Group 2: a lightmap or an irradiance volume.
    pub baked_light: Option<Arc<wgpu::BindGroup>>,
    /// The part of the frame that its surfaces may cover.
    pub window: Window,
}

/// The draws of a view, by pass.
#[derive(Debug, Default)]
pub(crate) struct Draws {
    /// What is drawn into the G-buffer, for all passes.
    pub geometry: Vec<Batch>,
    /// The draws that light the G-buffer.
    pub deferred: Vec<DeferredClass>,
    /// What the lightmap pass lights forward.
    pub lightmapped: Vec<Batch>,
    /// What the forward pass lights forward.
    pub opaque: Vec<Batch>,
    /// Surfaces through which what lies behind them is visible.
    pub refractive: Vec<Batch>,
    pub transparent: Vec<Batch>,
    /// In the order of the draws.
    pub instances: Vec<InstanceData>,
    /// Index of the first instance among those of all views of the frame.
    pub first_instance: u32,
    /// Number of objects outside the view.
    pub outside: usize,
    /// Depth range of what is in view, along the line of sight, in metres.
    pub depths: Option<[f64; 2]>,
    /// Depth range of what is lit by clusters, along the line of sight, in metres.
    pub clustered_depths: Option<[f64; 2]>,
}

/// Chooses the shading of an object that is shaded by need, which is given by its slot.
pub(crate) type ChooseShading<'a> = dyn FnMut(usize, &Object, ErrorBound) -> Shading + 'a;

/// The objects in view, each with the pipeline that draws it.
#[derive(Default)]
pub(crate) struct VisibleObjects<'a> {
    visible: Vec<Visible<'a>>,
    outside: usize,
    depths: Option<[f64; 2]>,
    clustered_depths: Option<[f64; 2]>,
    deferred: Vec<DeferredClass>,
    /// The pipelines of the objects, one entry for each run of objects with the same pipelines.
    pipelines: Vec<ChosenPipelines>,
}

/// An object in view. It is kept small because thousands of them are read in draw order; what a batch needs
/// to know of the object is stored right here.
struct Visible<'a> {
    pass: LitPass,
    slot: u32,
    /// Objects with a smaller value are drawn earlier.
    order: f64,
    object: &'a Object,
    mesh: MeshKey,
    texture_set: Option<&'a Arc<TextureSet>>,
    /// Index of the pipelines that draw it.
    pipelines: u32,
    /// Group 2 of the pipeline that lights it.
    baked_light: Option<&'a Arc<wgpu::BindGroup>>,
    /// Number of its deferred class; 0 for none.
    class_number: u32,
}

impl Visible<'_> {
    fn is_deferred(&self) -> bool {
        self.class_number > 0
    }
}

/// The pipelines that draw and light a surface. They are the same unless the surface is lit deferred.
#[derive(Clone, Copy, PartialEq)]
struct ChosenPipelines {
    drawn: PipelineKey,
    lit: PipelineKey,
}

impl<'a> VisibleObjects<'a> {
    /// Finds what `view` sees, except the objects in the slots `without`. Each object gets the pipeline that
    /// `choose` returns for the one that it calls for. Objects that ask for shading by need are shaded as
    /// `need` says.
    pub fn new(
        (objects, volumes): (&'a Objects, &'a IrradianceVolumes),
        (view, without): (&CameraView, &[usize]),
        settings: &SceneSettings,
        frame: &FrameFeatures,
        (format, samples): (wgpu::TextureFormat, u32),
        choose: &dyn Fn(PipelineKey) -> Option<PipelineKey>,
        need: &mut ChooseShading<'_>,
    ) -> Self {
        let mut seen = Self::default();
        let planes = view.frustum(objects.origin);
        let inside = |object: &Object| {
            let center = (object.center - objects.origin).extend(1.0);
            planes.iter().all(|plane| plane.dot(center) >= -object.reach(*plane))
        };
        // Most objects have the same traits as the previous one, so its variant is kept.
        let mut known: Option<(ObjectTraits, Shading, Variant)> = None;
        let mut known_key: Option<(PipelineKey, LitPass, Option<ChosenPipelines>)> = None;
        for (slot, object) in objects.iter() {
            if without.contains(&slot) {
                continue;
            }
            if !inside(object) {
                seen.outside += 1;
                continue;
            }
            let traits = &object.traits;
            let pass = LitPass::of(traits, frame.lightmaps, frame.refraction);
            let shading = match features::asked_shading(traits, settings, frame) {
                Shading::Auto { max_error } => need(slot, object, max_error),
                asked => asked,
            };
            let variant = match known {
                Some((of, at, variant)) if of == *traits && at == shading => variant,
                _ => features::variant(traits, shading, settings, frame),
            };
            known = Some((*traits, shading, variant));
            let pipeline = PipelineKey {
                variant,
                format,
                samples,
                mirrored: object.mirrored != view.is_mirrored(),
                double_sided: traits.double_sided,
                blend: pass == LitPass::Transparent,
                texture_mask: object.texture_set.as_ref().map_or(0, |set| set.mask),
            };
            let chosen = match known_key {
                Some((of, at, chosen)) if of == pipeline && at == pass => chosen,
                _ => ChosenPipelines::of(pipeline, pass, frame.g_buffer, choose),
            };
            known_key = Some((pipeline, pass, chosen));
            // An object whose pipeline is still being created is not drawn yet.
            let Some(mut pipelines) = chosen else { continue };
            let has = |feature| pipelines.lit.variant.has(feature);
            let lightmap = object.lightmap.as_ref().filter(|_| has(Feature::Lightmap));
            let volume = || volumes.around(object.center);
            let baked_light =
                if has(Feature::IrradianceVolume) { lightmap.or_else(volume) } else { lightmap };
            let class_number = match pipelines.is_deferred() {
                true => seen.class(pass, pipelines.lit, baked_light, || {
                    view.window_of_sphere(object.center, object.radius)
                }),
                false => Some(0),
            };
            if class_number.is_none() {
                // The G-buffer has no class number left, so the object is lit forward.
                match choose(pipeline) {
                    Some(forward) => pipelines = ChosenPipelines { drawn: forward, lit: forward },
                    None => continue,
                }
            }
            let class_number = class_number.unwrap_or(0);
            let depth = (view.eye - object.center).dot(view.basis.z_axis);
            let widened = |depths: Option<[f64; 2]>| {
                let [near, far] = depths.unwrap_or([f64::INFINITY, f64::NEG_INFINITY]);
                Some([near.min(depth - object.radius), far.max(depth + object.radius)])
            };
            seen.depths = widened(seen.depths);
            if pipelines.lit.variant.has(Feature::Clusters) {
                seen.clustered_depths = widened(seen.clustered_depths);
            }
            if seen.pipelines.last() != Some(&pipelines) {
                seen.pipelines.push(pipelines);
            }
            // Tables are indexed by 32 bits.
            let number = |count: usize| u32::try_from(count).unwrap_or(u32::MAX);
            seen.visible.push(Visible {
                pass,
                slot: number(slot),
                order: order(object, view, pass),
                object,
                mesh: object.mesh,
                texture_set: object.texture_set.as_ref(),
                pipelines: number(seen.pipelines.len() - 1),
                baked_light,
                class_number,
            });
        }
        seen
    }

    /// Returns the class number of deferred surfaces that are lit this way. `None` if no number is left, or
    /// no room for another instance.
    fn class(
        &mut self,
        pass: LitPass,
        pipeline: PipelineKey,
        baked_light: Option<&Arc<wgpu::BindGroup>>,
        window: impl FnOnce() -> Window,
    ) -> Option<u32> {
        let is = |class: &DeferredClass| {
            class.pass == pass && same(class.baked_light.as_ref(), baked_light) && class.pipeline == pipeline
        };
        let place = self.deferred.iter().position(is).unwrap_or(self.deferred.len());
        let number = u32::try_from(place + 1).ok().filter(|number| *number <= g_buffer::LAST_CLASS)?;
        if self.visible.len() > g_buffer::LAST_INSTANCE as usize {
            return None;
        }
        match self.deferred.get_mut(place) {
            Some(class) if class.window == Window::WHOLE => {}
            Some(class) => class.window = class.window.and(window()),
            None => {
                let baked_light = baked_light.cloned();
                self.deferred.push(DeferredClass { pass, pipeline, baked_light, window: window() });
            }
        }
        Some(number)
    }
}

impl ChosenPipelines {
    /// Returns the pipelines of a surface that the forward pass would draw with `forward`, as far as `choose`
    /// finds them.
    fn of(
        forward: PipelineKey,
        pass: LitPass,
        g_buffer: Option<GBufferContents>,
        choose: &dyn Fn(PipelineKey) -> Option<PipelineKey>,
    ) -> Option<Self> {
        match DeferredVariants::of(&forward.variant, pass, g_buffer) {
            Some(DeferredVariants { geometry, lighting }) => {
                let drawn = PipelineKey { variant: geometry, format: g_buffer::FORMAT, ..forward };
                // Lighting draws a full-screen triangle, or dispatches a compute shader.
                let in_compute = lighting.has(Feature::InCompute);
                let lit = PipelineKey {
                    variant: lighting,
                    format: if in_compute { g_buffer::LIT_FORMAT } else { forward.format },
                    mirrored: false,
                    double_sided: true,
                    texture_mask: 0,
                    ..forward
                };
                Some(Self { drawn: choose(drawn)?, lit: choose(lit)? })
            }
            None => choose(forward).map(|chosen| Self { drawn: chosen, lit: chosen }),
        }
    }

    fn is_deferred(&self) -> bool {
        self.lit.variant.has(Feature::Deferred)
    }
}

impl Draws {
    /// Creates the draws of what is in view. Their instances follow `first_instance` instances of other
    /// views.
    pub fn new(seen: VisibleObjects<'_>, lights: &mut ObjectLightLists, first_instance: u32) -> Self {
        let VisibleObjects { visible, outside, depths, clustered_depths, deferred, pipelines } = seen;
        let mut draws =
            Self { outside, first_instance, depths, clustered_depths, deferred, ..Self::default() };
        // Opaque surfaces are drawn front to back so that hidden fragments are not shaded, transparent ones
        // back to front. Ties are broken by slot, which is the same every frame.
        let mut order: Vec<u128> = visible
            .iter()
            .zip(0..)
            .map(|(seen, number)| sort_key(seen.is_deferred(), seen.pass, seen.order, number))
            .collect();
        order.sort_unstable();
        draws.instances.reserve(visible.len());
        for key in order {
            // The key ends in the object's index.
            let seen = &visible[key as u32 as usize];
            draws.push(seen, &pipelines[seen.pipelines as usize], lights);
        }
        draws
    }

    /// Adds an instance, to the last batch if it fits.
    fn push(&mut self, seen: &Visible, pipelines: &ChosenPipelines, lights: &mut ObjectLightLists) {
        let instance = u32::try_from(self.instances.len()).unwrap_or(u32::MAX);
        let clustered = pipelines.lit.variant.has(Feature::Clusters);
        let list = lights.empty_if_clustered(clustered).unwrap_or_else(|| {
            let Object { entity, center, half_size, .. } = seen.object;
            lights.reaching(*entity, *center, *half_size, clustered)
        });
        self.instances.push(list.of_object(seen.slot, seen.class_number));
        let batches = match seen.pass {
            _ if seen.is_deferred() => &mut self.geometry,
            LitPass::Lightmap => &mut self.lightmapped,
            LitPass::Forward => &mut self.opaque,
            LitPass::Refraction => &mut self.refractive,
            LitPass::Transparent => &mut self.transparent,
        };
        let pipeline = pipelines.drawn;
        // For a deferred surface, baked light is bound when the G-buffer is lit.
        let baked_light = seen.baked_light.filter(|_| !seen.is_deferred());
        // A pipeline that stands in for another one may have no textures.
        let texture_set = seen.texture_set.filter(|_| pipeline.texture_mask != 0);
        let fits = |batch: &Batch| {
            batch.pipeline == pipeline
                && batch.mesh == seen.mesh
                && same(batch.texture_set.as_ref(), texture_set)
                && same(batch.baked_light.as_ref(), baked_light)
                && batch.class_number == seen.class_number
                && batch.instances.end == instance
        };
        match batches.last_mut() {
            Some(last) if fits(last) => last.instances.end += 1,
            _ => batches.push(Batch {
                pipeline,
                mesh: seen.mesh,
                texture_set: texture_set.cloned(),
                baked_light: baked_light.cloned(),
                class_number: seen.class_number,
                instances: instance..instance + 1,
            }),
        }
    }

    /// Returns the batches that a pass draws.
    pub fn of(&self, pass: LitPass) -> &[Batch] {
        match pass {
            LitPass::Lightmap => &self.lightmapped,
            LitPass::Forward => &self.opaque,
            LitPass::Refraction => &self.refractive,
            LitPass::Transparent => &self.transparent,
        }
    }

    /// Draws refractive surfaces with the other opaque ones, while the refraction effect is not ready.
    pub fn draw_refractive_opaque(&mut self) {
        self.opaque.append(&mut self.refractive);
    }

    /// Returns the range of a batch's instances among those of all views of the frame.
    pub fn instances_of(&self, batch: &Batch) -> Range<u32> {
        self.first_instance + batch.instances.start..self.first_instance + batch.instances.end
    }

    /// Returns every batch, those of the G-buffer first, then those of each pass.
    pub fn batches(&self) -> impl Iterator<Item = &Batch> {
        self.geometry.iter().chain(LitPass::ALL.into_iter().flat_map(|pass| self.of(pass)))
    }

    /// Returns the classes that a pass lights from the G-buffer, with their numbers.
    pub fn deferred_of(&self, pass: LitPass) -> impl Iterator<Item = (u32, &DeferredClass)> {
        (1..).zip(&self.deferred).filter(move |(_, class)| class.pass == pass)
    }

    /// Returns the classes that compute shaders light in a frame of this size, in the order of their numbers: all
    /// of them, or none.
    pub fn dispatches(&self, size: [u32; 2]) -> impl Iterator<Item = (&DeferredClass, LitDispatch)> {
        let in_compute = self.deferred.iter().any(|class| class.pipeline.variant.has(Feature::InCompute));
        let lit: &[DeferredClass] = if in_compute { &self.deferred } else { &[] };
        (1..).zip(lit).map(move |(number, class)| (class, LitDispatch::new(number, &class.window, size)))
    }

    /// Returns every pipeline that is used, those of batches first, then those of deferred lighting.
    pub fn pipelines(&self) -> impl Iterator<Item = &PipelineKey> {
        self.batches().map(|batch| &batch.pipeline).chain(self.deferred.iter().map(|class| &class.pipeline))
    }

    /// Returns every batch with the variant that lights it.
    pub fn lit_batches(&self) -> impl Iterator<Item = (&Batch, &Variant)> {
        self.batches().map(|batch| {
            let class = batch.class_number.checked_sub(1).and_then(|place| self.deferred.get(place as usize));
            (batch, class.map_or(&batch.pipeline.variant, |class| &class.pipeline.variant))
        })
    }
}

fn same<T>(a: Option<&Arc<T>>, b: Option<&Arc<T>>) -> bool {
    match (a, b) {
        (None, None) => true,
        (Some(a), Some(b)) => Arc::ptr_eq(a, b),
        _ => false,
    }
}

/// The part of its radius by which an object counts as farther away. It decides where depths are equal.
const TIE: f64 = 1e-6;

/// Returns a key that sorts deferred objects first, then by pass, by order and by index, which the
/// key ends in. Sorting keys is faster than moving the objects themselves, which are large.
fn sort_key(deferred: bool, pass: LitPass, order: f64, number: u32) -> u128 {
    let kind = u128::from(!deferred) << 8 | pass as u128;
    // Maps the bits of a float to an integer with the same order.
    let bits = order.to_bits();
    let order = if bits >> 63 == 0 { bits | 1 << 63 } else { !bits };
    kind << 96 | u128::from(order) << 32 | u128::from(number)
}

/// Returns the value that the objects of a pass are sorted by. For opaque objects, this is the depth of the
/// farthest point of the bounding box, because a room or a floor lies behind what it contains, and a wall that
/// faces the viewer hides what is behind it, however wide it is. Of two boxes that end equally far, the larger
/// one is behind, so that the order of a picture and the wall in whose plane it hangs does not change when the
/// viewer turns. For transparent objects, it is the negative distance to the nearest point of the bounding
/// sphere, so that the farthest object comes first.
fn order(object: &Object, view: &CameraView, pass: LitPass) -> f64 {
    let from_eye = object.center - view.eye;
    match pass {
        LitPass::Transparent => -(from_eye.length() - object.radius).max(0.0),
        LitPass::Lightmap | LitPass::Forward | LitPass::Refraction => {
            let backward = view.basis.z_axis;
            object.half_size.dot(backward.abs()) - from_eye.dot(backward) + TIE * object.radius
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_sort_by_what_they_are_made_of() {
        let orders =
            [f64::NEG_INFINITY, -3.5, -1e-300, -0.0, 0.0, 1e-300, 2.0, 2.0 + 1e-15, f64::INFINITY, f64::NAN];
        let mut expected = Vec::new();
        for deferred in [true, false] {
            for pass in LitPass::ALL {
                for order in orders {
                    expected.extend([0, 7, u32::MAX].map(|number| (deferred, pass, order, number)));
                }
            }
        }
        let keys: Vec<u128> = expected
            .iter()
            .map(|(deferred, pass, order, number)| sort_key(*deferred, *pass, *order, *number))
            .collect();
        assert!(keys.is_sorted_by(|a, b| a < b));
        assert!(keys.iter().zip(&expected).all(|(key, (.., number))| *key as u32 == *number));
    }
}
