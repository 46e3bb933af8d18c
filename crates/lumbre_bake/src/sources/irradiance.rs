//! The direct light of a receiver from all sources: those that are sampled individually, each by itself, and the others
//! by samples that they share. `light_cut` decides which are which.

use super::direct::Direct;
use super::light_cut::LightCut;
use super::light_sources::Sources;
use super::sampled_receiver::{SampledReceiver, SurfacePoints};
use crate::sampling::Sequence;
use crate::visibility::Visibility;

/// Number of shared samples for each sample of an individually sampled source.
const SHARED_SAMPLES_FACTOR: u32 = 4;

impl Sources<'_> {
    /// Mean irradiance of a receiver, by `samples` shadow rays to each source that matters and
    /// [`SHARED_SAMPLES_FACTOR`] times as many to the others together. `point` maps the unit square onto the receiver's
    /// surface.
    pub fn irradiance(&self, sequence: Sequence, samples: u32, point: &impl SurfacePoints) -> Direct {
        let Some(anchor) = point(0.5, 0.5) else { return Direct::default() };
        let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];
        let corners = corners.iter().filter_map(|&(x, y)| point(x, y));
        let reach = corners.map(|corner| corner.position.distance(anchor.position)).fold(0.0, f32::max);
        let cut = self.cut(&anchor, reach, &[]);
        let is_point = reach == 0.0;
        let visibility = &Visibility::UNKNOWN;
        let receiver = SampledReceiver { point, covered: None, is_point, visibility, sequence, samples };
        let mut direct = self.irradiance_per_source(&cut, &receiver);
        self.add_shared_light(&cut.shared, sequence, SHARED_SAMPLES_FACTOR * samples, point, &mut direct);
        direct
    }

    /// Mean irradiance by the sources that are sampled individually. For sources whose possible occluders are known, it
    /// casts no shadow rays, and visibility is exact at each of the receiver's points.
    pub fn irradiance_per_source(
        &self,
        cut: &LightCut,
        receiver: &SampledReceiver<'_, impl SurfacePoints>,
    ) -> Direct {
        let mut direct = Direct::default();
        if !cut.lamps.is_empty() {
            let light = self.area_light_irradiance(&cut.lamps, receiver, &mut direct);
            direct.baked += light;
        }
        for &light in &cut.lights {
            self.add_punctual(light, receiver, &mut direct);
        }
        direct
    }
}
