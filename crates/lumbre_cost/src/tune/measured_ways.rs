//! The frames of a level in all ways to draw it: draws them where they are asked for, each picture once, and
//! keeps the error of each way at each camera and the picture of its largest error. What is drawn where is
//! decided in `tune`.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use bevy_ecs::world::World;
use lumbre_render::FrameOptions;
use lumbre_scene::{SceneSettings, reduce_lightmaps};
use lumbre_trace::relative_error;

use super::cameras::Cameras;
use super::draw_settings::DrawSettings;
use crate::frame::Frame;
use crate::frames::{DrawnFrame, draw_in_rounds};
use crate::measured::Measured;
use crate::rounds::Rounds;
use crate::scene_file::SceneFile;
use crate::{Conditions, CostError, ErrorOver, Point, Spread, Study};

/// The ways to draw a level, as far as they have been measured.
pub(crate) struct MeasuredWays<'a> {
    conditions: &'a Conditions<'a>,
    scene: &'a SceneFile,
    /// The most accurate way, whose pictures are the references.
    reference: DrawSettings,
    /// The level as it is read, and with coarser lightmaps. All ways share these Worlds, so that a renderer
    /// uploads each of them once.
    worlds: BTreeMap<u32, (Arc<Mutex<World>>, SceneSettings)>,
    ways: Vec<KnownWay>,
    /// The references, and the picture of the largest error of each way.
    pub pictures: Measured,
}

/// The errors of a way.
struct KnownWay {
    settings: DrawSettings,
    /// The relative RMSE at each camera; `None` where it has not been drawn.
    errors: Vec<Option<f64>>,
    /// The point of the camera with the largest of them.
    worst: Option<Point>,
}

/// Where a way is drawn: the cameras at which it is timed, and those at which its picture is drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Where<'a> {
    pub timed: &'a [bool],
    pub pictured: &'a [bool],
}

impl<'a> MeasuredWays<'a> {
    pub fn new(
        conditions: &'a Conditions<'a>,
        scene: &'a SceneFile,
        reference: DrawSettings,
        study: Study,
    ) -> Self {
        let pictures = Measured::of(study);
        Self { conditions, scene, reference, worlds: BTreeMap::new(), ways: Vec::new(), pictures }
    }

    /// Draws ways in turn, and returns the times of each at every camera; `None` where it was not timed. The first
    /// way ever drawn has to be the reference, at all cameras. `told` are the fractions that are done before and
    /// after.
    ///
    /// # Errors
    /// [`CostError`].
    pub fn draw(
        &mut self,
        cameras: &Cameras,
        ways: &[DrawSettings],
        at: Where<'_>,
        rounds: Rounds,
        told: [f64; 2],
    ) -> Result<Vec<Vec<Option<Spread>>>, CostError> {
        let (mut frames, mut places) = (Vec::new(), Vec::new());
        for (number, settings) in ways.iter().enumerate() {
            let (world, own) = self.world(settings.lightmap_reduction)?;
            let known = self.errors(settings, cameras);
            for (camera, (entity, _)) in cameras.all.iter().enumerate() {
                let (is_timed, is_pictured) =
                    (at.timed[camera], at.pictured[camera] && known[camera].is_none());
                if is_timed || is_pictured {
                    let options = FrameOptions { camera: Some(*entity), ..FrameOptions::default() };
                    let frame = Frame::of(&world, options).with_settings(settings.of_scene(own));
                    frames.push(frame.sharing("tune").timed(is_timed).pictured(is_pictured));
                    places.push((number, camera));
                }
            }
        }
        let drawn = draw_in_rounds(self.conditions, frames, rounds, told)?;
        let mut times = vec![vec![None; cameras.all.len()]; ways.len()];
        for ((number, camera), drawn) in places.into_iter().zip(drawn) {
            times[number][camera] = drawn.spread();
            if !drawn.picture.radiance.is_empty() {
                self.take_picture(cameras, &ways[number], camera, drawn)?;
            }
        }
        Ok(times)
    }

    /// Returns the relative RMSE of a way at each camera; `None` where it has not been drawn.
    pub fn errors(&self, way: &DrawSettings, cameras: &Cameras) -> Vec<Option<f64>> {
        let known = self.ways.iter().find(|known| known.settings == *way);
        known.map_or_else(|| vec![None; cameras.all.len()], |known| known.errors.clone())
    }

    /// Returns the point of a way, with the picture and the error of the camera where it errs most among those at
    /// which it was drawn. `None` if there is none.
    pub fn point(&self, way: &DrawSettings) -> Option<Point> {
        self.ways.iter().find(|known| known.settings == *way)?.worst.clone()
    }

    fn take_picture(
        &mut self,
        cameras: &Cameras,
        way: &DrawSettings,
        camera: usize,
        drawn: DrawnFrame,
    ) -> Result<(), CostError> {
        let name = &cameras.all[camera].1;
        let reference = format!("reference {camera} {name}");
        let reference = match *way == self.reference {
            true => self.pictures.keep_reference(&reference, drawn.picture.clone()),
            false => self.pictures.file_name(&reference),
        };
        let known = match self.ways.iter().position(|known| known.settings == *way) {
            Some(known) => known,
            None => {
                let errors = vec![None; cameras.all.len()];
                self.ways.push(KnownWay { settings: *way, errors, worst: None });
                self.ways.len() - 1
            }
        };
        let wanted = self.pictures.pictures.get(&reference).map_or(&[][..], |wanted| &wanted.radiance);
        let error = relative_error(wanted, &drawn.picture.radiance);
        self.ways[known].errors[camera] = Some(error);
        let worst = self.ways[known].worst.as_ref().and_then(|worst| worst.error);
        // FLIP takes longer than the picture, and only the largest error is looked at.
        if worst.is_some_and(|worst| worst.relative_rmse >= error) {
            return Ok(());
        }
        let point = Point {
            series: way.shading.name().to_owned(),
            label: way.label(&self.reference),
            counts: drawn.counts(),
            command: format!(
                "lumbre render {} -o frame.png --camera '{name}' --size {} {}",
                self.scene.in_commands(),
                self.conditions.size_text(),
                way.arguments()
            ),
            ..Point::default()
        };
        self.pictures.add_picture(point, drawn.picture, &reference, ErrorOver::Picture)?;
        self.ways[known].worst = self.pictures.study.points.pop();
        Ok(())
    }

    /// Returns the World with lightmaps reduced by this much, and the settings of the file.
    fn world(&mut self, reduction: u32) -> Result<(Arc<Mutex<World>>, SceneSettings), CostError> {
        if let Some(known) = self.worlds.get(&reduction) {
            return Ok(known.clone());
        }
        let mut world = self.scene.open(self.conditions.aspect())?;
        reduce_lightmaps(&mut world, reduction);
        let own = world.get_resource::<SceneSettings>().copied().unwrap_or_default();
        let new = (Arc::new(Mutex::new(world)), own);
        self.worlds.insert(reduction, new.clone());
        Ok(new)
    }
}
