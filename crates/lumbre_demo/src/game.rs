//! The game: a level, a player in it, and time. No window, no GPU: those look at [`Game::world`] and feed [`Game::step`].

use std::path::Path;
use std::time::Duration;

use bevy_ecs::prelude::*;
use bevy_ecs::schedule::SingleThreadedExecutor;
use glam::{DQuat, DVec2, DVec3};
use lumbre_optics::Light;
use lumbre_scene::{ActiveCamera, Camera, GlobalTransform, LoadError, Name, Transform, propagate_transforms};

use crate::clock::{Clock, STEP_SECONDS};
use crate::input::{Action, Input};
use crate::moving::{ExtrasError, GameTime, move_things, read_motions};
use crate::player::Player;
use crate::recording::Recording;
use crate::solid::level_triangles;
use crate::torch::{torch_light, torch_place};
use crate::view_settings::ViewSettings;
use crate::walking::{TriangleTree, ground_below, overlaps};

/// Name of the camera that the player starts from.
pub const START_CAMERA: &str = "start";
/// Who falls this far below the level starts again, metres.
const ABYSS: f64 = 10.0;

/// A level that is being played.
pub struct Game {
    /// Everything that can be seen. The camera to draw from has [`ActiveCamera`].
    pub world: World,
    /// How the player wants it drawn.
    pub view: ViewSettings,
    schedule: Schedule,
    level: TriangleTree,
    clock: Clock,
    player: Entity,
    camera: Entity,
    torch: Entity,
    now: Player,
    before: Player,
    start: Player,
    look: DVec2,
    commands: Vec<Action>,
    recording: Option<Recording>,
    quit: bool,
}

/// Why a level cannot be played.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GameError {
    /// The file cannot be loaded.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// What it says for this game is wrong.
    #[error(transparent)]
    Extras(#[from] ExtrasError),
}

impl Game {
    /// Loads a level (.glb, .gltf, baked or not) and puts the player where its camera `start` is, or its first camera, or
    /// before the middle of it. Where there is no ground the player flies.
    ///
    /// # Errors
    /// [`GameError`] with the file, the node and the remedy.
    pub fn load(path: &Path) -> Result<Self, GameError> {
        let mut world = World::new();
        lumbre_scene::load(&mut world, path)?;
        Self::new(world)
    }

    /// Plays what a World holds.
    ///
    /// # Errors
    /// [`GameError::Extras`] where a node's motion is malformed.
    pub fn new(mut world: World) -> Result<Self, GameError> {
        read_motions(&mut world)?;
        lumbre_scene::update_transforms(&mut world);
        let level = TriangleTree::build(level_triangles(&mut world));
        let (view, lens) = first_view(&mut world, &level);
        let mut start = Player::with_eyes_at(&view);
        let ground = ground_below(start.body.feet, 3.0, &start.stature, &level);
        start.flying = ground.is_none() || overlaps(&start.stature.capsule(start.body.feet), &level);
        if let (Some(ground), false) = (ground, start.flying) {
            start.body.feet.y = ground;
            start.body.on_ground = true;
        }

        let player = world.spawn((Name::new("player"), start, Transform::IDENTITY)).id();
        let camera = world.spawn((Name::new("eyes"), lens, Transform::IDENTITY, ChildOf(player))).id();
        let torch =
            world.spawn((Name::new("torch"), torch_light(false), torch_place(), ChildOf(camera))).id();
        let others: Vec<Entity> = world.query_filtered::<Entity, With<ActiveCamera>>().iter(&world).collect();
        for other in others {
            world.entity_mut(other).remove::<ActiveCamera>();
        }
        world.entity_mut(camera).insert(ActiveCamera);
        world.init_resource::<GameTime>();
        let mut schedule = Schedule::default();
        schedule.set_executor(SingleThreadedExecutor::new());
        schedule.add_systems((move_things, propagate_transforms).chain());

        let mut game = Self {
            world,
            view: ViewSettings::default(),
            schedule,
            level,
            clock: Clock::default(),
            player,
            camera,
            torch,
            now: start,
            before: start,
            start,
            look: DVec2::ZERO,
            commands: Vec::new(),
            recording: None,
            quit: false,
        };
        game.show(1.0);
        Ok(game)
    }

    /// Lets a frame's time pass with this input. The player moves in fixed steps; what is drawn lies between the last two.
    pub fn step(&mut self, frame: Duration, input: &Input) {
        if input.look.is_finite() {
            self.look += input.look;
        }
        self.clock.pass(frame);
        self.make_steps(input);
    }

    /// Makes exactly one fixed step.
    pub fn step_once(&mut self, input: &Input) {
        self.look += input.look;
        self.clock.pass_one_step();
        self.make_steps(input);
    }

    /// Plays a recording to its end.
    pub fn replay(&mut self, recording: &Recording) {
        for (input, actions) in recording.player() {
            for action in actions {
                self.apply(action);
            }
            self.step_once(&input);
        }
    }

    /// Carries out a command.
    pub fn apply(&mut self, action: Action) {
        self.commands.push(action);
        if self.view.apply(action) {
            return;
        }
        match action {
            Action::ToggleTorch => {
                if let Some(mut light) = self.world.get_mut::<Light>(self.torch) {
                    light.enabled = !light.enabled;
                }
            }
            Action::ToggleFlight => {
                self.now.flying = !self.now.flying;
                self.now.body.velocity = DVec3::ZERO;
            }
            _ => self.quit = true,
        }
    }

    /// Begins to record what the player does, from where they are.
    pub fn record(&mut self) {
        self.recording = Some(Recording::default());
        self.clock = Clock::default();
        self.commands.clear();
    }

    /// Ends the recording and gives it back.
    pub fn take_recording(&mut self) -> Option<Recording> {
        self.recording.take()
    }

    /// Puts the player's eyes at a place, flying.
    pub fn look_from(&mut self, view: &Transform) {
        self.now = Player { flying: true, ..Player::with_eyes_at(view) };
        self.before = self.now;
        self.show(1.0);
    }

    /// The player after the last step.
    pub fn player(&self) -> &Player {
        &self.now
    }

    /// The entity whose camera is the player's eyes.
    pub fn camera(&self) -> Entity {
        self.camera
    }

    /// The entity whose light is the torch.
    pub fn torch(&self) -> Entity {
        self.torch
    }

    /// The triangles that stop the player.
    pub fn level(&self) -> &TriangleTree {
        &self.level
    }

    /// Time since the start.
    pub fn elapsed(&self) -> Duration {
        self.clock.elapsed()
    }

    /// Whether the player wants to leave.
    pub fn wants_to_quit(&self) -> bool {
        self.quit
    }

    fn make_steps(&mut self, input: &Input) {
        while self.clock.take_step() {
            let input = Input { look: std::mem::take(&mut self.look), ..*input };
            if let Some(recording) = &mut self.recording {
                recording.note(self.clock.steps() - 1, input, &self.commands);
            }
            self.commands.clear();
            self.before = self.now;
            self.now.step(&input, &self.level, STEP_SECONDS);
            let lowest = self.level.bounds().map_or(f64::NEG_INFINITY, |(min, _)| min.y);
            if self.now.body.feet.y < lowest - ABYSS && !self.now.flying {
                self.now = self.start;
                self.before = self.start;
            }
        }
        self.show(self.clock.part_of_step());
    }

    /// Writes what is seen into the World: the player between the last two steps, everything else at this moment.
    fn show(&mut self, part: f64) {
        let (before, now) = (&self.before, &self.now);
        let feet = before.body.feet.lerp(now.body.feet, part);
        let eyes = before.eye_height() + (now.eye_height() - before.eye_height()) * part;
        // The view turns at once: what the mouse did since the last step is shown before it counts.
        let mut turned = *now;
        turned.turn(self.look);
        let body = Transform::from_translation(feet).with_rotation(DQuat::from_rotation_y(turned.yaw));
        let head = Transform::from_xyz(0.0, eyes, 0.0).with_rotation(DQuat::from_rotation_x(turned.pitch));
        for (entity, transform) in [(self.player, body), (self.camera, head)] {
            if let Some(mut current) = self.world.get_mut::<Transform>(entity) {
                current.set_if_neq(transform);
            }
        }
        if let Some(mut player) = self.world.get_mut::<Player>(self.player) {
            player.set_if_neq(*now);
        }
        self.world.insert_resource(GameTime { seconds: self.clock.elapsed().as_secs_f64() });
        self.schedule.run(&mut self.world);
    }
}

/// Where the player starts, and the lens of that camera.
fn first_view(world: &mut World, level: &TriangleTree) -> (Transform, Camera) {
    let mut cameras = world.query::<(&Camera, &GlobalTransform, Option<&Name>, Has<ActiveCamera>)>();
    let rank = |name: Option<&Name>, active: bool| match name {
        Some(name) if name.as_str() == START_CAMERA => 0,
        _ if active => 1,
        _ => 2,
    };
    let best = cameras.iter(world).min_by_key(|(_, _, name, active)| rank(*name, *active));
    if let Some((camera, place, _, _)) = best {
        return (Transform::from_affine(place.0).0, *camera);
    }
    let (min, max) = level.bounds().unwrap_or((DVec3::NEG_ONE, DVec3::ONE));
    let (middle, radius) = (0.5 * (min + max), 0.5 * (max - min).length());
    let eye = middle + DVec3::new(0.3, 0.4, 1.0).normalize() * 2.4 * radius;
    (Transform::from_translation(eye).looking_at(middle, DVec3::Y), Camera::default())
}
