//! What a bake is asked for. Not how it went: that is `report`.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::BakeError;

/// How many texels a surface gets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Density {
    /// About 500,000 texels for the whole scene, spread by area and by the square of each object's lightmap scale: any scale of scene just works.
    #[default]
    Automatic,
    /// Texels along one metre of surface, times each object's lightmap scale; positive and finite.
    TexelsPerMeter(f64),
    /// The side of each node's own square map, in texels, in [4, 8192], times its lightmap scale.
    MapSize(u32),
}

/// Whether light is baked for what moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Probes {
    /// If something in the scene moves.
    #[default]
    Automatic,
    /// Also if nothing moves yet.
    Always,
    /// Not at all.
    Never,
}

/// How much work the sampling may take before the error is reached.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Quality {
    /// For a look while the level is being built: few patches, few rays.
    Draft,
    /// For shipping.
    #[default]
    Final,
    /// To judge the others by: patches, form factors and rays far beyond what a game needs. Minutes, not seconds.
    Reference,
}

/// How form factors are counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum FormFactorMethod {
    /// Rays from points of every patch, by the cosine: F_ij is the share of i's rays that meet j first.
    #[default]
    CosineRays,
    /// Lines spread evenly through the whole scene (Sbert, "An integral geometry based method for fast form-factor computation", 1993):
    /// two surfaces that follow each other along a line and face each other exchange along it, both ways.
    GlobalLines,
}

/// An iterative method for the radiosity system. They agree; they differ in iterations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Solver {
    /// B ← E + ρ F B: one bounce more per iteration.
    Jacobi,
    /// The same, each patch reading what was found before it in the same sweep.
    GaussSeidel,
    /// On the symmetric positive definite form [diag(A_i/ρ_i) - G] B = A_i E_i/ρ_i, with its diagonal as preconditioner.
    #[default]
    ConjugateGradients,
}

/// What a bake is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BakeOptions {
    /// How many texels a surface gets.
    pub density: Density,
    /// Relative RMSE that sampling may leave in the lightmap (0.01 is one per cent of the light around each texel); positive.
    /// Gathering stops there, or at the quality's largest number of rays.
    pub error: f64,
    /// Wall-clock time after which no more samples are taken: the map is complete, with what there was time for. Bits then depend on
    /// the machine's speed.
    pub time: Option<Duration>,
    /// How much work the sampling may take.
    pub quality: Quality,
    /// Texels along a side of a patch, in [1, 64]: smaller patches exchange light in more detail, which only the bounces after the first see, and take more rays. The
    /// quality's own if absent; patches are larger where the quality has no room for so many.
    pub patch_texels: Option<f32>,
    /// Free texels between charts, and how far values are carried past a chart's border: 2 for bilinear filtering,
    /// 4 for bicubic.
    pub gap: u32,
    /// Lets the maps of several objects share atlases of at most so many texels a side, in [16, 8192]; each object has a map of
    /// its own without it. Copies of an object then have meshes of their own, with their places in the atlas.
    pub atlas_size: Option<u32>,
    /// Replicates every sample sequence. The same seed gives the same bits on any number of threads.
    pub seed: u32,
    /// Worker threads; as many as the machine has if absent.
    pub threads: Option<usize>,
    /// How form factors are counted.
    pub form_factors: FormFactorMethod,
    /// How the radiosity system is solved.
    pub solver: Solver,
    /// Smooths the gathered light within charts where it is noisy.
    pub denoise: bool,
    /// Closes seams: where charts meet smoothly, both sides show the same light.
    pub seams: bool,
    /// Estimates what error the map's resolution leaves, by points baked on their own: about a twentieth of the rays.
    pub resolution_error: bool,
    /// Whether light is baked for what moves.
    pub probes: Probes,
    /// Metres between probes at most, positive and finite; by the scene's size, for up to 4096 of them, if absent.
    pub probe_spacing: Option<f64>,
    /// Also gives every map's direct and bounced light as maps of their own. The maps themselves stay the same.
    pub separate_light: bool,
    /// Bytes that the bake may take beside the World: fewer patches and rays where more would not fit.
    pub memory: Option<u64>,
}

impl Default for BakeOptions {
    fn default() -> Self {
        Self {
            density: Density::Automatic,
            error: 0.01,
            time: None,
            quality: Quality::Final,
            patch_texels: None,
            gap: 2,
            atlas_size: None,
            seed: 0,
            threads: None,
            form_factors: FormFactorMethod::default(),
            solver: Solver::default(),
            denoise: true,
            seams: true,
            resolution_error: true,
            probes: Probes::default(),
            probe_spacing: None,
            separate_light: false,
            memory: None,
        }
    }
}

/// The numbers behind a quality.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    /// Most patches that area alone asks for; every triangle has at least one.
    pub patches: usize,
    /// Rays for all form factors together.
    pub form_factor_rays: usize,
    /// Texels along a patch's side, at least.
    pub patch_texels: f32,
    /// Shadow samples of a texel before and after a penumbra is found in it, and at most.
    pub direct: [u32; 3],
    /// Samples of a texel of the sources that share them: first round and most.
    pub shared: [u32; 2],
    /// Gather rays of a texel: first round and most.
    pub gather: [u32; 2],
    /// Most gather rays of a texel, and most samples of the sources that share them, on average, where that is more than [`FEW_RAYS`]: whatever
    /// error is asked for, this is the most that a bake takes.
    pub mean: u32,
}

/// The error from which on the first rays are half of the quality's: with fewer, smoothing has too little to tell edges from noise, and rounds
/// that have to be added cost more than was spared.
const COARSE: f64 = 0.04;

impl Quality {
    fn effort(self) -> Effort {
        match self {
            Self::Draft => Effort {
                patches: 3_000,
                form_factor_rays: 600_000,
                patch_texels: 6.0,
                direct: [4, 16, 16],
                shared: [8, 64],
                gather: [16, 16],
                mean: 16,
            },
            Self::Final => Effort {
                patches: 8_000,
                form_factor_rays: 1_500_000,
                patch_texels: 4.0,
                direct: [8, 64, 1024],
                shared: [8, 1024],
                gather: [16, 8192],
                mean: 64,
            },
            Self::Reference => Effort {
                patches: 40_000,
                form_factor_rays: 20_000_000,
                patch_texels: 2.0,
                direct: [64, 1024, 4096],
                shared: [256, 8192],
                gather: [256, 8192],
                mean: 8192,
            },
        }
    }
}

impl Effort {
    /// Most samples of so many texels together.
    pub fn budget(&self, texels: u64) -> u64 {
        (texels * u64::from(self.mean)).max(FEW_RAYS)
    }
}

/// Rays that any bake may take: seconds, however few its texels are.
const FEW_RAYS: u64 = 32_000_000;

impl BakeOptions {
    /// The quality's effort, less where a larger error is asked for: what is cast before anything is known must not cost more than what was
    /// asked.
    pub(crate) fn effort(&self) -> Effort {
        let mut effort = self.quality.effort();
        effort.patch_texels = self.patch_texels.unwrap_or(effort.patch_texels);
        if self.quality == Quality::Reference {
            return effort;
        }
        if self.error >= COARSE {
            effort.gather[0] = (effort.gather[0] / 2).max(4);
            effort.patches = effort.patches.min(4_000);
            effort.form_factor_rays = effort.form_factor_rays.min(500_000);
            effort.direct[1] = effort.direct[1].min(16);
        }
        effort
    }

    /// Options for the patches and their form factors: coarser ones if time is `short`, so that the final gather gets most of it.
    pub(crate) fn for_patches(&self, short: bool) -> Self {
        Self { error: if short { self.error.max(COARSE) } else { self.error }, ..*self }
    }

    /// Names the first option that is out of its range.
    pub(crate) fn check(&self) -> Result<(), BakeError> {
        let wrong = |option, found: String, expected| Err(BakeError::Option { option, found, expected });
        match self.density {
            Density::TexelsPerMeter(density) if !(density.is_finite() && density > 0.0) => {
                return wrong("texels per metre", density.to_string(), "a positive finite number");
            }
            Density::MapSize(side) if !(4..=8192).contains(&side) => {
                return wrong("map size", side.to_string(), "a number of texels in [4, 8192]");
            }
            _ => {}
        }
        if !(self.error.is_finite() && self.error > 0.0) {
            return wrong("error", self.error.to_string(), "a positive finite number");
        }
        if let Some(spacing) = self.probe_spacing.filter(|spacing| !(spacing.is_finite() && *spacing > 0.0)) {
            return wrong("probe spacing", spacing.to_string(), "a positive finite number of metres");
        }
        if let Some(texels) = self.patch_texels.filter(|texels| !(1.0..=64.0).contains(texels)) {
            return wrong("texels along a patch", texels.to_string(), "a number in [1, 64]");
        }
        if self.gap > 64 {
            return wrong("gap", self.gap.to_string(), "at most 64 texels");
        }
        if self.atlas_size.is_some_and(|side| !(16..=8192).contains(&side)) {
            return wrong("atlas size", format!("{:?}", self.atlas_size), "a number of texels in [16, 8192]");
        }
        if self.threads.is_some_and(|threads| !(1..=1024).contains(&threads)) {
            return wrong("threads", format!("{:?}", self.threads), "a number in [1, 1024]");
        }
        Ok(())
    }
}
