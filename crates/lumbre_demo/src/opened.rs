//! A file opened for viewing: a game that holds it, the notes of its reader, and its exposure. The window
//! that shows it is in `window`.

use std::path::{Path, PathBuf};

use bevy_ecs::prelude::*;
use lumbre_bake::BakeOptions;
use lumbre_scene::{LoadOptions, add_default_light, is_without_light, load_with};

use crate::{Game, GameError};

/// Fraction of a picture that has to be clipped to white before an exposure is metered without being asked
/// for.
pub(crate) const CLIPPED: f64 = 0.02;

/// Side of the atlases that small meshes share, in texels. Every device supports it, and most levels fit into
/// a few of them.
pub const ATLAS_SIDE: u32 = 2048;

/// How the brightness of pictures is chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Exposure {
    /// The camera's exposure. It is metered instead if the file's lights are in candela or lux, no camera
    /// states an exposure, and too much of the picture would be white.
    #[default]
    AsNeeded,
    /// A metered exposure.
    Auto,
    /// A fixed factor on radiance.
    Factor(f32),
}

/// Options for opening files.
#[derive(Clone, Debug)]
pub struct OpenOptions {
    /// Options of the reader.
    pub load: LoadOptions,
    /// Whether files without light are lit from the camera.
    pub default_light: bool,
    /// How the brightness of their pictures is chosen.
    pub exposure: Exposure,
    /// Options of the final pass of a background bake.
    pub bake: BakeOptions,
}

impl Default for OpenOptions {
    fn default() -> Self {
        let load = LoadOptions { lenient: true, ..LoadOptions::default() };
        let bake = BakeOptions { error: 0.02, atlas_size: Some(ATLAS_SIDE), ..BakeOptions::default() };
        Self { load, default_light: true, exposure: Exposure::default(), bake }
    }
}

/// A file opened in a game.
pub struct Opened {
    /// The game that holds it. It starts at the camera `start` if the file has one, and otherwise frames the
    /// whole file.
    pub game: Game,
    /// The path of the file.
    pub path: PathBuf,
    /// What was repaired, left out or added.
    pub notes: Vec<String>,
    /// How the brightness of its pictures is chosen.
    pub exposure: Exposure,
    /// Whether its lights are photometric and no camera states an exposure, so that an exposure may be
    /// metered.
    pub is_photometric: bool,
    /// The entities of the file's nodes, in order.
    pub nodes: Vec<Entity>,
    /// The lights that were added because the file has none.
    pub default_lights: Vec<Entity>,
}

impl Opened {
    /// Opens a .glb or .gltf file, baked or not.
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

    /// Returns the path for the baked file: beside the original, and never the same.
    pub fn place_of_bake(&self) -> PathBuf {
        let stem = self.path.file_stem().unwrap_or_default().to_string_lossy();
        let stem = stem.strip_suffix(".baked").unwrap_or(&stem);
        let beside = self.path.with_file_name(format!("{stem}.baked.glb"));
        // Compared by stem, ignoring case: a `.baked.gltf` would share its folder of lightmaps with the new
        // file.
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
            // The file has no light.
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
