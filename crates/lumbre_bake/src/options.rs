//! The options of a bake. What it did with them is in `report`.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::BakeError;

/// How densely surfaces are covered with lightmap texels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Density {
    /// About 500,000 texels for the whole scene, whatever its size, distributed in proportion to surface area times the
    /// square of each object's lightmap scale.
    #[default]
    Automatic,
    /// Texels per metre of surface, multiplied by each object's lightmap scale; positive and finite.
    TexelsPerMeter(f64),
    /// Side of each object's square map in texels, in [4, 8192], multiplied by the object's lightmap scale.
    MapSize(u32),
}

/// Whether irradiance probes are baked, which light moving objects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Probes {
    /// If the scene contains dynamic objects.
    #[default]
    Automatic,
    /// Always, even without dynamic objects.
    Always,
    /// Never.
    Never,
}

/// The effort of a bake: the number of patches and form factor rays, and the most samples that it takes to reach
/// [`BakeOptions::error`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Quality {
    /// For previews while a level is being built: few patches and few rays.
    Draft,
    /// For shipping.
    #[default]
    Final,
    /// Ground truth for evaluating the other qualities: far more patches and rays than a game needs. Takes minutes, not
    /// seconds.
    Reference,
}

/// How form factors are estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum FormFactorMethod {
    /// Cosine-distributed rays from points on every patch: F_ij is the fraction of patch i's rays that hit j first.
    #[default]
    CosineRays,
    /// Lines distributed uniformly through the whole scene (Sbert, "An integral geometry based method for fast
    /// form-factor computation", 1993). Two surfaces that are neighbours on a line and face each other exchange light
    /// along it in both directions.
    GlobalLines,
}

/// The iterative method that solves the radiosity system. All reach the same solution, in different numbers of
/// iterations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Solver {
    /// B ← E + ρ F B: each iteration adds one bounce.
    Jacobi,
    /// As Jacobi, but each patch reads the values already updated in the same sweep.
    GaussSeidel,
    /// Conjugate gradients on the symmetric positive definite form [diag(A_i/ρ_i) - G] B = A_i E_i/ρ_i, preconditioned
    /// with its diagonal.
    #[default]
    ConjugateGradients,
}

/// The options of a bake. The defaults suit most levels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BakeOptions {
    /// How densely surfaces are covered with texels.
    pub density: Density,
    /// The target: the relative RMSE that sampling may leave in the lightmap; positive. 0.01 is one per cent of the
    /// light around each texel. The final gather stops when its estimate reaches this, for the whole level and in
    /// every room's view, when the time is up, or, except in a final bake with a time limit, at the quality's limit of
    /// rays, which is half as large again for views once the whole level has reached it.
    pub error: f64,
    /// Wall-clock time after which no more samples are taken; `None` for no limit. The map is complete all the same,
    /// only noisier. Its bits then depend on the machine's speed.
    pub time: Option<Duration>,
    /// The effort that the bake may spend.
    pub quality: Quality,
    /// Side of a patch in texels, in [1, 64]; `None` for the quality's default. Smaller patches exchange light in more
    /// detail, of which only the bounces after the first benefit, and need more rays. Patches are larger than this
    /// where there would be more of them than the quality allows.
    pub patch_texels: Option<f32>,
    /// Empty texels between charts, which are filled with the values beside them so that filtering at a chart's border
    /// reads no black: 2 for bilinear filtering, 4 for bicubic.
    pub gap: u32,
    /// Largest side of an atlas in texels, in [16, 8192]. With it, the maps of several objects are packed into shared
    /// atlases, and objects that share a mesh get copies of it with coordinates for their places in the atlas. With
    /// `None`, each object has its own map.
    pub atlas_size: Option<u32>,
    /// Seed of all random numbers. The same seed gives the same bits on any number of threads.
    pub seed: u32,
    /// Number of worker threads, in [1, 1024]; `None` for those of Rayon's current pool, by default one per logical
    /// processor.
    pub threads: Option<usize>,
    /// How form factors are estimated.
    pub form_factors: FormFactorMethod,
    /// How the radiosity system is solved.
    pub solver: Solver,
    /// Denoises the gathered light within each chart.
    pub denoise: bool,
    /// Closes seams: where charts meet on a smooth surface, both sides are made to show the same light.
    pub seams: bool,
    /// Estimates the error that is due to the map's resolution, from points that are baked separately. Takes about a
    /// twentieth of the rays.
    pub resolution_error: bool,
    /// Whether irradiance probes are baked.
    pub probes: Probes,
    /// Largest distance between probes in metres, positive and finite. `None` chooses it by the scene's size, for up to
    /// 4096 probes.
    pub probe_spacing: Option<f64>,
    /// Additionally outputs direct and bounced light as separate maps. The combined maps stay the same.
    pub separate_light: bool,
    /// Most memory in bytes that the bake may use beside the World; `None` for no limit. Where the quality's patches
    /// and rays do not fit, fewer are used.
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

/// The numbers behind a [`Quality`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    /// Most patches that the surface area is divided into. There may be more, as every triangle outside
    /// of a cluster has at least one.
    pub patches: usize,
    /// Rays for all form factors together, at least.
    pub form_factor_rays: usize,
    /// The same per texel of the level and per inverse of the requested error, where that makes more, up to four times
    /// as many: the gather of a large level to a small error casts far more rays than these, and needs fewer the better
    /// its guide is.
    pub form_factor_rays_per_texel: f64,
    /// Smallest side of a patch, in texels.
    pub patch_texels: f32,
    /// Most patches that cutting along contact lines may add, if there is a limit. Where many surfaces cross each other,
    /// as leaves do, there could be dozens per triangle.
    pub pieces_by_cuts: Option<u64>,
    /// Most points along the edge of a patch at which its textures are averaged.
    pub texture_points: u32,
    /// Shadow samples per texel: in the first pass, in the pass over suspected penumbrae, and at most.
    pub direct: [u32; 3],
    /// Samples per texel of the sources that share samples: in the first round, and at most.
    pub shared: [u32; 2],
    /// Gather rays per texel: in the first round, and at most.
    pub gather: [u32; 2],
    /// Limit for a bake's total, whatever error was requested (not of a final bake whose time is limited): most gather
    /// rays, and most samples of the sources that share them, per texel on average. The total may always be as large as
    /// [`SMALL_BUDGET`]. The gather may exceed it by what direct light leaves, and for views whose error is larger than
    /// the whole level's.
    pub mean: u32,
}

/// Requested errors from this on start with half of the quality's gather rays, and with fewer patches. At smaller
/// errors that does not pay: from so few rays the smoothing cannot tell edges from noise, and the additional rounds
/// cost more than was saved.
const COARSE_ERROR: f64 = 0.04;

impl Quality {
    fn effort(self) -> Effort {
        match self {
            Self::Draft => Effort {
                patches: 3_000,
                form_factor_rays: 600_000,
                form_factor_rays_per_texel: 0.0,
                patch_texels: 6.0,
                pieces_by_cuts: Some(MAX_PIECES_BY_CUTS),
                texture_points: 16,
                direct: [4, 16, 16],
                shared: [8, 64],
                gather: [16, 16],
                mean: 16,
            },
            Self::Final => Effort {
                patches: 8_000,
                form_factor_rays: 1_500_000,
                form_factor_rays_per_texel: 0.04,
                patch_texels: 4.0,
                pieces_by_cuts: None,
                texture_points: 64,
                direct: [8, 64, 1024],
                shared: [8, 8192],
                gather: [16, 8192],
                mean: 64,
            },
            Self::Reference => Effort {
                patches: 40_000,
                form_factor_rays: 20_000_000,
                form_factor_rays_per_texel: 0.0,
                patch_texels: 2.0,
                pieces_by_cuts: None,
                texture_points: 64,
                direct: [64, 1024, 4096],
                shared: [256, 8192],
                gather: [256, 8192],
                mean: 8192,
            },
        }
    }
}

impl Effort {
    /// Rays for all form factors of a level with so many `texels`, for a requested `error`.
    pub fn form_factor_rays(&self, texels: usize, error: f64) -> usize {
        let by_texels = self.form_factor_rays_per_texel * texels as f64 / error;
        (by_texels as usize).clamp(self.form_factor_rays, MAX_MORE_FORM_FACTOR_RAYS * self.form_factor_rays)
    }

    /// Most samples of all `texels` together.
    pub fn budget(&self, texels: u64) -> u64 {
        (texels * u64::from(self.mean)).max(SMALL_BUDGET)
    }
}

/// Most patches that cutting adds where a preview is wanted or time is short: each casts some rays, and as many take about
/// a second.
const MAX_PIECES_BY_CUTS: u64 = 64_000;

/// Limit of the form factor rays by the number of texels, as a multiple of their least number.
const MAX_MORE_FORM_FACTOR_RAYS: usize = 4;

/// Rays that every bake may take, however few texels it has: they take only seconds.
const SMALL_BUDGET: u64 = 32_000_000;

impl BakeOptions {
    /// The quality's effort, reduced if a large error was requested: the rays that are cast before the error can be
    /// estimated should not cost more than that error needs. If time is limited, it ends a final bake instead of the
    /// quality's limit of rays.
    pub(crate) fn effort(&self) -> Effort {
        let mut effort = self.quality.effort();
        if self.time.is_some() && self.quality == Quality::Final {
            effort.mean = Quality::Reference.effort().mean;
        }
        effort.patch_texels = self.patch_texels.unwrap_or(effort.patch_texels);
        if self.quality == Quality::Reference {
            return effort;
        }
        if self.error >= COARSE_ERROR {
            effort.gather[0] = (effort.gather[0] / 2).max(4);
            effort.patches = effort.patches.min(4_000);
            effort.form_factor_rays = effort.form_factor_rays.min(500_000);
            effort.form_factor_rays_per_texel = 0.0;
            effort.direct[1] = effort.direct[1].min(16);
            // For texels that vary at random, the mean of so many points along an edge, squared, is off by 3 % of their
            // contrast.
            effort.texture_points = effort.texture_points.min(16);
            effort.pieces_by_cuts = Some(MAX_PIECES_BY_CUTS);
        }
        effort
    }

    /// Options for the patches and their form factors: coarser ones if time is short, so that most of it is left for
    /// the final gather.
    pub(crate) fn for_patches(&self, is_time_short: bool) -> Self {
        Self { error: if is_time_short { self.error.max(COARSE_ERROR) } else { self.error }, ..*self }
    }

    /// Checks that all options are in range; the error names the first that is not.
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
