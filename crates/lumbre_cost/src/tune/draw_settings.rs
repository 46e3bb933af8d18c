//! The settings with which a level is drawn, and the settings that differ from them in one respect.

use bevy_ecs::prelude::*;
use lumbre_optics::{ErrorBound, Light, LightKind, Shading};
use lumbre_render::FrameOptions;
use lumbre_scene::{Camera, FrameSettings, LightmapEncoding, SceneSettings, ShadowFilter};

use crate::findings::short;

/// The settings with which a level is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawSettings {
    /// Shading for objects that do not choose their own.
    pub shading: Shading,
    /// Whether lights that ask for shadows cast them.
    pub shadows: bool,
    /// Filter of shadow maps.
    pub shadow_filter: ShadowFilter,
    /// Factor on the resolution of shadow maps along each side.
    pub shadow_resolution: f32,
    /// Radiance on a white surface below which a lamp ends; 0 if lamps end as the level says.
    pub light_threshold: f32,
    /// Whether four samples per pixel are taken.
    pub multisample: bool,
    /// How many texels of a lightmap become one along each side; 1 for lightmaps as they are in the file.
    pub lightmap_reduction: u32,
    /// Format of lightmaps on the device.
    pub lightmap_format: LightmapEncoding,
}

/// What a level leaves to choose.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Choices {
    /// Whether a light asks for shadows.
    shadows: bool,
    /// The radiance that is displayed as white, if there are lamps that may end.
    white: Option<f32>,
    /// The format of lightmaps on the device, which is not chosen together with these.
    lightmap_format: LightmapEncoding,
}

/// What is chosen together. Choices of different stages hardly influence each other's cost, so that stages
/// follow one another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stage {
    /// How often light is evaluated, and how many samples a pixel has.
    Evaluations,
    Shadows,
    Lamps,
}

/// Errors for shading by need.
const BOUNDS: [f32; 4] = [0.003, 0.01, 0.03, 0.1];
/// Filters and resolutions of shadow maps, the most accurate first.
const SHADOWS: [(ShadowFilter, f32); 6] = [
    (ShadowFilter::Soft, 2.0),
    (ShadowFilter::Soft, 1.0),
    (ShadowFilter::Soft, 0.5),
    (ShadowFilter::PercentageCloser, 1.0),
    (ShadowFilter::Hard, 1.0),
    (ShadowFilter::Hard, 0.5),
];
/// Fractions of white below which lamps end.
const THRESHOLDS: [f32; 3] = [0.002, 0.01, 0.05];

impl DrawSettings {
    /// The most accurate settings for a level with shadows. Lightmaps are half floats: 32-bit ones take twice the
    /// memory, and the picture of the demo level differs by 0.004 %.
    const MOST_ACCURATE: Self = Self {
        shading: Shading::Phong,
        shadows: true,
        shadow_filter: SHADOWS[0].0,
        shadow_resolution: SHADOWS[0].1,
        light_threshold: 0.0,
        multisample: true,
        lightmap_reduction: 1,
        lightmap_format: LightmapEncoding::Rgb16Float,
    };

    /// Returns the settings with which a World is drawn with these options, for objects that do not choose
    /// their own shading.
    pub fn current(world: &World, options: &FrameOptions) -> Self {
        let settings = world.get_resource::<SceneSettings>().copied().unwrap_or_default();
        Self {
            shading: options.shading.unwrap_or(settings.shading),
            shadows: options.shadows && settings.frame.shadows,
            shadow_filter: settings.frame.shadow_filter,
            shadow_resolution: settings.frame.shadow_resolution,
            light_threshold: settings.frame.light_threshold,
            multisample: options.multisample.or(settings.frame.multisample).unwrap_or(false),
            lightmap_reduction: 1,
            lightmap_format: settings.frame.lightmap_format,
        }
    }

    /// Calls `draw` with a World and options that have these settings, also for objects that choose their own
    /// shading, and restores the World's settings. Lightmaps keep their density.
    pub(crate) fn drawn<T>(
        &self,
        world: &mut World,
        options: &FrameOptions,
        draw: impl FnOnce(&mut World, &FrameOptions) -> T,
    ) -> T {
        let own = world.get_resource::<SceneSettings>().copied();
        world.insert_resource(SceneSettings { frame: self.frame(), ..own.unwrap_or_default() });
        let options = FrameOptions {
            shading: Some(self.shading),
            shadows: self.shadows,
            multisample: Some(self.multisample),
            ..options.clone()
        };
        let drawn = draw(world, &options);
        match own {
            Some(own) => world.insert_resource(own),
            None => drop(world.remove_resource::<SceneSettings>()),
        }
        drawn
    }

    /// Returns the label of these settings, which says how they differ from the most accurate ones.
    pub(crate) fn label(&self, reference: &Self) -> String {
        let of_maps = (self.shadow_filter, self.shadow_resolution);
        let shadows = match self.shadows {
            false => ", no shadows".to_owned(),
            true if of_maps == (reference.shadow_filter, reference.shadow_resolution) => String::new(),
            true => format!(
                ", {} shadows at {}",
                self.shadow_filter.name(),
                short(f64::from(self.shadow_resolution))
            ),
        };
        let lamps = match self.light_threshold {
            0.0 => String::new(),
            threshold => format!(", lamps to {}", short(f64::from(threshold))),
        };
        let samples = if self.multisample { ", four samples" } else { "" };
        let has_other_maps = self.lightmap_reduction > 1 || self.lightmap_format != reference.lightmap_format;
        let maps =
            if has_other_maps { format!(", lightmaps {}", self.of_lightmaps()) } else { String::new() };
        format!("{}{shadows}{lamps}{samples}{maps}", self.shading)
    }

    /// Says how dense the lightmaps are, and in which format.
    pub(crate) fn of_lightmaps(&self) -> String {
        let format = self.lightmap_format.name();
        match self.lightmap_reduction {
            1 => format!("as {format}"),
            reduction => format!("at 1/{reduction} as {format}"),
        }
    }

    /// Returns the arguments of `lumbre render` for these settings.
    pub fn arguments(&self) -> String {
        let shadows = match self.shadows {
            true => format!(
                " --shadows --shadow-filter {} --shadow-resolution {}",
                self.shadow_filter.name(),
                self.shadow_resolution
            ),
            false => " --no-shadows".to_owned(),
        };
        let samples = if self.multisample { " --msaa" } else { " --no-msaa" };
        let maps = match self.lightmap_reduction {
            1 => String::new(),
            reduction => format!(" --lightmap-reduction {reduction}"),
        };
        format!(
            "--shading {}{shadows} --light-threshold {}{samples}{maps} --lightmap-format {}",
            self.shading,
            self.light_threshold,
            self.lightmap_format.name()
        )
    }

    /// Returns the part of the settings that a level's file stores.
    pub fn frame(&self) -> FrameSettings {
        FrameSettings {
            multisample: Some(self.multisample),
            light_threshold: self.light_threshold,
            shadows: self.shadows,
            shadow_resolution: self.shadow_resolution,
            shadow_filter: self.shadow_filter,
            lightmap_format: self.lightmap_format,
        }
    }

    /// Returns the settings of a scene that is drawn so. Objects that choose their shading keep it.
    pub(super) fn of_scene(&self, own: SceneSettings) -> SceneSettings {
        SceneSettings { shading: self.shading, frame: self.frame(), ..own }
    }
}

impl Choices {
    /// Returns the most accurate settings, against which the others are measured. If nothing casts shadows,
    /// shadow maps have the default settings.
    pub fn reference(&self) -> DrawSettings {
        let usual = FrameSettings::default();
        let most = DrawSettings::MOST_ACCURATE;
        let shadow_resolution = if self.shadows { most.shadow_resolution } else { usual.shadow_resolution };
        DrawSettings { shadow_resolution, lightmap_format: self.lightmap_format, ..most }
    }

    /// Returns the most accurate settings with the crudest choice of each kind in turn, and with one sample a pixel.
    pub fn crude(&self) -> Vec<DrawSettings> {
        let reference = self.reference();
        let of_stages = Stage::ALL.into_iter().filter_map(|stage| stage.others(reference, self).pop());
        of_stages.chain([DrawSettings { multisample: false, ..reference }]).collect()
    }

    /// Returns the settings with the crudest choice of every kind.
    pub fn crudest(&self) -> DrawSettings {
        Stage::ALL
            .into_iter()
            .fold(self.reference(), |way, stage| stage.others(way, self).pop().unwrap_or(way))
    }

    /// Returns the choices for a level that is displayed with this exposure, or with that of its cameras.
    pub fn of(world: &mut World, exposure: Option<f32>) -> Self {
        let mut lights = world.query::<&Light>();
        let shining: Vec<&Light> = lights.iter(world).filter(|light| light.enabled).collect();
        let shadows = shining.iter().any(|light| light.shadow);
        let lamps = shining.iter().any(|light| light.kind == LightKind::Point);
        let exposures: Vec<f32> =
            world.query::<&Camera>().iter(world).map(|camera| camera.exposure).collect();
        let exposures = exposure.map_or(exposures, |exposure| vec![exposure]);
        let brightest = exposures.into_iter().filter(|exposure| *exposure > 0.0).fold(0.0, f32::max);
        let white = (lamps && brightest > 0.0).then(|| brightest.recip());
        Self { shadows, white, lightmap_format: DrawSettings::MOST_ACCURATE.lightmap_format }
    }

    /// Returns the choices for a level whose lightmaps stay in the format in which they are.
    pub fn with_format_of(self, world: &World) -> Self {
        let settings = world.get_resource::<SceneSettings>().copied().unwrap_or_default();
        Self { lightmap_format: settings.frame.lightmap_format, ..self }
    }
}

impl Stage {
    /// All stages, in their order.
    pub const ALL: [Self; 3] = [Self::Evaluations, Self::Shadows, Self::Lamps];

    /// Returns the settings that differ from `from` in what this stage chooses, without `from` itself, the crudest
    /// last.
    pub fn others(self, from: DrawSettings, choices: &Choices) -> Vec<DrawSettings> {
        let mut others = Vec::new();
        match self {
            Self::Evaluations => {
                for multisample in [true, false] {
                    others.extend(rates().map(|shading| DrawSettings { shading, multisample, ..from }));
                }
            }
            Self::Shadows if choices.shadows => {
                let read = SHADOWS.into_iter().map(|(shadow_filter, shadow_resolution)| DrawSettings {
                    shadow_filter,
                    shadow_resolution,
                    ..from
                });
                others.extend(read.chain([DrawSettings { shadows: false, ..from }]));
            }
            Self::Lamps => {
                let thresholds =
                    choices.white.into_iter().flat_map(|white| THRESHOLDS.map(|part| part * white));
                others.extend(thresholds.map(|light_threshold| DrawSettings { light_threshold, ..from }));
            }
            Self::Shadows => {}
        }
        others.retain(|other| *other != from);
        others
    }
}

/// Returns the shadings that are tried, the most accurate first.
fn rates() -> impl Iterator<Item = Shading> {
    let by_need = BOUNDS.into_iter().filter_map(ErrorBound::new);
    let by_need = by_need.map(|max_error| Shading::Auto { max_error });
    [Shading::Phong].into_iter().chain(by_need).chain([Shading::Gouraud, Shading::Flat])
}
