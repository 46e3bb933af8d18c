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
        let receiver = SampledReceiver {
            point,
            covered: None,
            is_point,
            flat_side: None,
            visibility,
            sequence,
            samples,
        };
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

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use lumbre_mesh::shapes;

    use crate::BakeOptions;
    use crate::Density;
    use crate::sampling::{Sequence, Stream};
    use crate::scene::laid_out::mesh_laid_out;
    use crate::scene::{Receiver, Side};
    use crate::sources::{Emitter, Sources};

    /// Faces of a lamp that is red, green and, on the side that faces away, blue.
    fn lamp_of_three_colors() -> Vec<Emitter> {
        let [a, b, c, d] =
            [[0.0, 0.0], [0.0, 0.3], [0.3, 0.3], [0.3, 0.0]].map(|[x, z]| Vec3::new(x, 2.0, z));
        let face = |corners: [Vec3; 3], normal: Vec3, radiance: Vec3| Emitter {
            corners,
            corners_f64: corners.map(|corner| corner.as_dvec3()),
            normal,
            area: 0.045,
            radiance,
            triangle: 0,
            side: Side::Front,
        };
        vec![
            face([c, b, a], Vec3::NEG_Y, Vec3::X),
            face([d, c, a], Vec3::NEG_Y, Vec3::Y),
            face([a, b, c], Vec3::Y, Vec3::Z),
            face([a, c, d], Vec3::Y, Vec3::Z),
        ]
    }

    /// Where nothing is hidden, a single ray gives the exact light in every channel, although it meets a face of only
    /// one of the colours, and its first sample may meet a face that brings no light.
    #[test]
    fn one_ray_to_a_lamp_of_several_colors_gives_its_exact_light() {
        let options = BakeOptions { density: Density::MapSize(16), ..BakeOptions::default() };
        let (_, scene) = mesh_laid_out(shapes::plane(2.0, 2.0, 1, 1), &options);
        let sources = Sources::new(&scene, lamp_of_three_colors(), Vec::new(), Vec3::ZERO);
        let position = Vec3::new(0.1, 1.0, 0.0);
        let receiver = Receiver { position, origin: position, geometric_normal: Vec3::Y, normal: Vec3::Y };
        let root = sources.emitter_tree.root().unwrap();
        let exact = sources.emitter_tree.unoccluded(&sources.emitters, root, &receiver);
        assert!(exact.x > 0.01 && exact.y > 0.01 && exact.z == 0.0, "{exact}");
        for number in 0..64 {
            let sequence = Sequence::new(3, Stream::Test(93), number);
            let light = sources.irradiance(sequence, 1, &|_, _| Some(receiver));
            assert!(light.baked.distance(exact) < 1e-6 * exact.length(), "{number}: {} {exact}", light.baked);
            assert_eq!(light.rays, 1, "{number}");
        }
    }
}
