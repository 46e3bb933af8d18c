//! How light is transported between the surfaces of a scene, whatever the light: patches, and the form factors between
//! them. The light of the patches is found in `exchange`.

use glam::Vec3;

use super::form_factors::FormFactors;
use super::patches::Patches;
use super::subdivision::Subdivision;
use crate::monitor::BakeMonitor;
use crate::report::StageNotes;
use crate::scene::BakeScene;
use crate::{BakeError, BakeOptions};

/// How finely the exchange of light is computed.
#[derive(Clone, Debug)]
pub(crate) struct PatchResolution {
    pub subdivision: Subdivision,
    /// Most points along a patch's edge at which textures are averaged.
    pub texture_points: u32,
    /// Rays for all form factors together.
    pub form_factor_rays: usize,
    /// Upper estimate of the bytes that the bake then needs.
    pub memory_bytes: u64,
}

/// The patches of a scene and the form factors between them.
pub(crate) struct Transport {
    pub patches: Patches,
    /// By all rays, and by two independent halves of them.
    pub factors: FormFactors,
    pub halves: [FormFactors; 2],
}

impl Transport {
    /// Divides the scene into patches and samples their form factors; without any where no surface reflects.
    pub fn new(
        scene: &BakeScene,
        resolution: &PatchResolution,
        options: &BakeOptions,
        monitor: &mut BakeMonitor<'_>,
    ) -> Result<(Self, StageNotes), BakeError> {
        let patches = monitor.run_interruptible(0.0, || {
            Patches::new(scene, &resolution.subdivision, resolution.texture_points)
        })?;
        let (factors, halves) = match is_black(&patches) {
            true => (FormFactors::none(&patches), [FormFactors::default(), FormFactors::default()]),
            false => {
                let (method, rays) = (options.form_factors, resolution.form_factor_rays);
                FormFactors::sample(scene, &patches, method, rays, options.seed, monitor)?
            }
        };
        let (warnings, rays) = (patches.warnings.clone(), factors.rays);
        let notes = StageNotes { warnings, rays, ..StageNotes::default() };
        Ok((Self { patches, factors, halves }, notes))
    }

    /// Whether no surface reflects anything.
    pub fn is_black(&self) -> bool {
        is_black(&self.patches)
    }
}

fn is_black(patches: &Patches) -> bool {
    patches.list.iter().all(|patch| patch.reflectance == Vec3::ZERO)
}
