//! A file that was opened to be looked at: a game in it, what was noted, and how it is exposed. Not the window that shows it.

use std::path::{Path, PathBuf};

use bevy_ecs::prelude::*;
use lumbre_bake::BakeOptions;
use lumbre_scene::{LoadOptions, add_default_light, is_without_light, load_with};

use crate::{Game, GameError};

/// Share of a picture that has to be white for want of an exposure before one is metered unasked.
pub(crate) const CLIPPED: f64 = 0.02;

/// Side of the atlases that small meshes share, in texels: what every device can bind, and most levels fit into a few of them.
pub const ATLAS_SIDE: u32 = 2048;

/// How bright pictures are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Exposure {
    /// The camera's; metered if the file's lights are in candela or lux, no camera states an exposure, and too much would be white.
    #[default]
    AsNeeded,
    /// Metered.
    Auto,
    /// A factor on radiance.
    Factor(f32),
}

/// How files are opened.
#[derive(Clone, Debug)]
pub struct OpenOptions {
    /// How they are read.
    pub load: LoadOptions,
    /// Lights files without light from the camera.
    pub default_light: bool,
    /// How bright their pictures are.
    pub exposure: Exposure,
    /// What a bake in the background comes to in the end.
    pub bake: BakeOptions,
}

impl Default for OpenOptions {
    fn default() -> Self {
        let load = LoadOptions { lenient: true, ..LoadOptions::default() };
        let bake = BakeOptions { error: 0.02, atlas_size: Some(ATLAS_SIDE), ..BakeOptions::default() };
        Self { load, default_light: true, exposure: Exposure::default(), bake }
    }
}

/// A file in a game.
pub struct Opened {
    /// The game in it: from the camera `start` if the file has one, else around all of it.
    pub game: Game,
    /// The file.
    pub path: PathBuf,
    /// What was repaired, left out or added.
    pub notes: Vec<String>,
    /// How it is exposed.
    pub exposure: Exposure,
    /// Whether an exposure is metered if none is asked for and too much would be white.
    pub is_photometric: bool,
    /// The entity of each node of the file.
    pub nodes: Vec<Entity>,
    /// The lights that were added because there was none.
    pub default_lights: Vec<Entity>,
}

impl Opened {
    /// Opens a .glb or .gltf, baked or not.
    ///
    /// # Errors
    /// [`GameError`] with the file, the node and the remedy.
    pub fn open(path: &Path, options: &OpenOptions) -> Result<Self, GameError> {
        let mut world = World::new();
        let report = load_with(&mut world, path, &options.load)?;
        let mut notes: Vec<String> = report.notes.iter().map(ToString::to_string).collect();
        let mut game = Game::new(world)?;
        game.order_cameras(&report.nodes);
        let mut default_lights = Vec::new();
        if options.default_light && is_without_light(&mut game.world) {
            let camera = game.camera();
            add_default_light(&mut game.world, camera);
            let torch = game.torch();
            let below = game.world.get::<Children>(camera);
            default_lights =
                below.map_or_else(Vec::new, |all| all.iter().filter(|light| *light != torch).collect());
            notes.push(
                "has no light that a frame shows; lit by a key and a fill light at the camera (--no-default-light leaves it dark)"
                    .to_owned(),
            );
        }
        if !game.has_a_start() {
            game.orbit_everything();
        }
        Ok(Self {
            game,
            path: path.to_owned(),
            notes,
            exposure: options.exposure,
            is_photometric: report.photometric_lights > 0 && !report.states_exposure,
            nodes: report.nodes,
            default_lights,
        })
    }

    /// Where a bake of this file is saved: beside it, and never over it.
    pub fn place_of_bake(&self) -> PathBuf {
        let stem = self.path.file_stem().unwrap_or_default().to_string_lossy();
        let stem = stem.strip_suffix(".baked").unwrap_or(&stem);
        let beside = self.path.with_file_name(format!("{stem}.baked.glb"));
        // By the stem, whatever its letters' case: a `.baked.gltf` would share its folder of lightmaps with the new file.
        let stem_of = |path: &Path| path.file_stem().map(|stem| stem.to_string_lossy().to_lowercase());
        if stem_of(&beside) == stem_of(&self.path) {
            self.path.with_file_name(format!("{stem}.baked-again.glb"))
        } else {
            beside
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{START_CAMERA, Viewpoint};

    #[test]
    fn the_demo_level_is_walked_and_other_files_are_turned() {
        let folder = tempfile::tempdir().unwrap();
        for (name, walks) in [(START_CAMERA, true), ("view", false)] {
            let mut world = World::new();
            let place = lumbre_scene::Transform::from_xyz(0.0, 1.7, 0.0);
            world.spawn((lumbre_scene::Name::new(name), lumbre_scene::Camera::default(), place));
            let cuboid = std::sync::Arc::new(lumbre_mesh::shapes::cuboid(glam::Vec3::ONE, 1));
            world.spawn((lumbre_scene::Mesh(cuboid), lumbre_scene::Name::new("box")));
            let path = folder.path().join("file.glb");
            lumbre_scene::save(&mut world, &path).unwrap();
            let opened = Opened::open(&path, &OpenOptions::default()).unwrap();
            assert_eq!(*opened.game.viewpoint() == Viewpoint::Player, walks);
            // Nothing shines in it.
            assert_eq!(opened.default_lights.len(), 2);
            assert!(
                opened.notes.iter().any(|note| note.contains("--no-default-light")),
                "{:?}",
                opened.notes
            );
            let dark = OpenOptions { default_light: false, ..OpenOptions::default() };
            assert!(Opened::open(&path, &dark).unwrap().default_lights.is_empty());
        }
    }

    #[test]
    fn a_bake_lies_beside_its_file_and_never_over_it() {
        let folder = tempfile::tempdir().unwrap();
        for (name, expected) in [
            ("room.glb", "room.baked.glb"),
            ("a.b.gltf", "a.b.baked.glb"),
            ("room.baked.glb", "room.baked-again.glb"),
        ] {
            let path = folder.path().join(name);
            lumbre_scene::save(&mut World::new(), &path).unwrap();
            let opened = Opened::open(&path, &OpenOptions::default()).unwrap();
            assert_eq!(opened.place_of_bake(), folder.path().join(expected));
        }
    }
}
