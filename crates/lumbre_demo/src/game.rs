//! The game: a level, the player in it, and time. It needs no window and no GPU; those read [`Game::world`]
//! and call [`Game::step`].

use std::path::Path;
use std::time::Duration;

use bevy_ecs::prelude::*;
use bevy_ecs::schedule::SingleThreadedExecutor;
use glam::{DQuat, DVec2, DVec3};
use lumbre_optics::Light;
use lumbre_scene::{
    ActiveCamera, Bounds, Camera, GlobalTransform, LoadError, Name, Projection, Transform, default_camera,
    propagate_transforms, scene_bounds,
};

use crate::clock::{Clock, STEP_SECONDS};
use crate::input::{Action, Input};
use crate::moving::{ExtrasError, GameTime, move_things, read_motions};
use crate::orbit_view::OrbitView;
use crate::player::Player;
use crate::recording::Recording;
use crate::solid::level_triangles;
use crate::torch::{torch_light, torch_place};
use crate::view_settings::ViewSettings;
use crate::walking::{TriangleTree, ground_below, overlaps};

/// Name of the camera that the player starts from.
pub const START_CAMERA: &str = "start";
/// A player who falls this far below the level, in metres, starts again.
const ABYSS: f64 = 10.0;

/// Time in seconds in which flight crosses half of a scene that is not of human size.
const CROSSING_SECONDS: f64 = 4.0;
/// Largest angle above or below the horizon, radians, from which a whole scene is framed.
const STEEPEST_START: f64 = 0.8;
/// Radii of scenes, in metres, in which the player flies at the player's own speed.
const OF_HUMAN_SIZE: std::ops::RangeInclusive<f64> = 2.0..=60.0;

/// Where the picture is taken from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Viewpoint {
    /// The player's eyes, walking or flying.
    Player,
    /// An eye that orbits a target.
    Orbit(OrbitView),
    /// A camera of the file, by its index in [`Game::cameras`].
    FileCamera(usize),
}

/// A level that is being played.
pub struct Game {
    /// Everything that is visible. The camera to draw from has [`ActiveCamera`].
    pub world: World,
    /// The player's choices of how it is drawn.
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
    viewpoint: Viewpoint,
    lens: Camera,
    cameras: Vec<(Entity, String)>,
    bounds: Bounds,
    aspect: f64,
    /// Mouse gestures that no step has processed yet.
    gestures: Input,
    commands: Vec<Action>,
    recording: Option<Recording>,
    quit: bool,
}

/// Reasons why a level cannot be played.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GameError {
    /// The file cannot be loaded.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// The file's data for this game is malformed.
    #[error(transparent)]
    Extras(#[from] ExtrasError),
}

impl Game {
    /// Loads a level (.glb or .gltf, baked or not) and puts the player at its camera `start`, or else at its
    /// active or first camera, or else in front of the level. Where there is no ground the player flies.
    ///
    /// # Errors
    /// [`GameError`] with the file, the node and the remedy.
    pub fn load(path: &Path) -> Result<Self, GameError> {
        let mut world = World::new();
        lumbre_scene::load(&mut world, path)?;
        Self::new(world)
    }

    /// Starts a game in a World that already holds a level.
    ///
    /// # Errors
    /// [`GameError::Extras`] if a node's motion is malformed.
    pub fn new(mut world: World) -> Result<Self, GameError> {
        read_motions(&mut world)?;
        lumbre_scene::update_transforms(&mut world);
        let level = TriangleTree::build(level_triangles(&mut world));
        let cameras = cameras_of(&mut world);
        let bounds = scene_bounds(&mut world);
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
            view: ViewSettings::of(&world),
            world,
            schedule,
            level,
            clock: Clock::default(),
            player,
            camera,
            torch,
            now: start,
            before: start,
            start,
            viewpoint: Viewpoint::Player,
            lens,
            cameras,
            bounds,
            aspect: 16.0 / 9.0,
            gestures: Input::default(),
            commands: Vec::new(),
            recording: None,
            quit: false,
        };
        game.show(1.0);
        Ok(game)
    }

    /// Advances the game by a frame's time with this input. The player moves in fixed steps, and is drawn
    /// interpolated between the last two.
    pub fn step(&mut self, frame: Duration, input: &Input) {
        self.gestures.add_gestures(input);
        self.clock.pass(frame);
        self.make_steps(input);
    }

    /// Makes exactly one fixed step.
    pub fn step_once(&mut self, input: &Input) {
        self.gestures.add_gestures(input);
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
            Action::OrbitEverything => self.orbit_everything(),
            Action::NextCamera => self.next_camera(),
            Action::Quit => self.quit = true,
            // Handled by the view settings above, or by the window.
            _ => {}
        }
    }

    /// Starts to record the player's input from the current state on.
    pub fn record(&mut self) {
        self.recording = Some(Recording::default());
        self.clock = Clock::default();
        self.commands.clear();
    }

    /// Ends the recording and returns it.
    pub fn take_recording(&mut self) -> Option<Recording> {
        self.recording.take()
    }

    /// Puts the player's eyes at a transform, flying.
    pub fn look_from(&mut self, view: &Transform) {
        let flight_speed = match OF_HUMAN_SIZE.contains(&self.bounds.radius()) {
            true => self.start.flight_speed,
            false => (self.bounds.radius() / CROSSING_SECONDS).max(1e-6),
        };
        self.now = Player { flying: true, flight_speed, ..Player::with_eyes_at(view) };
        self.before = self.now;
        self.viewpoint = Viewpoint::Player;
        self.show(1.0);
    }

    /// Frames the whole scene and orbits its centre from there.
    pub fn orbit_everything(&mut self) {
        let (view, lens) = default_camera(&mut self.world, self.aspect);
        self.lens.projection = lens.projection;
        let mut orbit = OrbitView::of_camera(&view, &self.bounds);
        // Limited, so that something on a floor, which is framed best from above, still shows its height.
        orbit.pitch = orbit.pitch.clamp(-STEEPEST_START, STEEPEST_START);
        self.viewpoint = Viewpoint::Orbit(orbit);
        self.show(1.0);
    }

    /// Looks through the file's next camera, or after the last one frames the whole scene.
    pub fn next_camera(&mut self) {
        let next = match self.viewpoint {
            Viewpoint::FileCamera(index) => index + 1,
            Viewpoint::Player | Viewpoint::Orbit(_) => 0,
        };
        if next < self.cameras.len() {
            self.viewpoint = Viewpoint::FileCamera(next);
            self.show(1.0);
        } else {
            self.orbit_everything();
        }
    }

    /// Returns where the picture is taken from.
    pub fn viewpoint(&self) -> &Viewpoint {
        &self.viewpoint
    }

    /// Returns the cameras of the file, each as its entity and name.
    pub fn cameras(&self) -> &[(Entity, String)] {
        &self.cameras
    }

    /// Sorts the cameras by the order of the file's nodes.
    pub fn order_cameras(&mut self, nodes: &[Entity]) {
        let place = |entity: Entity| nodes.iter().position(|node| *node == entity).unwrap_or(usize::MAX);
        self.cameras.sort_by_key(|(entity, _)| place(*entity));
    }

    /// Returns true if the file has a start camera, which makes it a level to walk through.
    pub fn has_a_start(&self) -> bool {
        self.cameras.iter().any(|(_, name)| name == START_CAMERA)
    }

    /// Sets the ratio of the picture's width to its height, by which the scene is framed.
    pub fn set_aspect(&mut self, aspect: f64) {
        if aspect.is_finite() && aspect > 0.0 {
            self.aspect = aspect;
        }
    }

    /// Returns the player after the last step.
    pub fn player(&self) -> &Player {
        &self.now
    }

    /// Returns the entity whose camera is the player's eyes.
    pub fn camera(&self) -> Entity {
        self.camera
    }

    /// Returns the entity whose light is the torch.
    pub fn torch(&self) -> Entity {
        self.torch
    }

    /// Returns the triangles that stop the player.
    pub fn level(&self) -> &TriangleTree {
        &self.level
    }

    /// Returns the time since the start.
    pub fn elapsed(&self) -> Duration {
        self.clock.elapsed()
    }

    /// Returns true if the player wants to leave.
    pub fn wants_to_quit(&self) -> bool {
        self.quit
    }

    fn make_steps(&mut self, input: &Input) {
        while self.clock.take_step() {
            let mut input = input.held();
            input.add_gestures(&std::mem::take(&mut self.gestures));
            if let Some(recording) = &mut self.recording {
                recording.note(self.clock.steps() - 1, input, &self.commands);
            }
            self.commands.clear();
            self.follow_viewpoint(&input);
            self.before = self.now;
            if self.viewpoint != Viewpoint::Player {
                continue;
            }
            self.now.step(&input, &self.level, STEP_SECONDS);
            let lowest = self.level.bounds().map_or(f64::NEG_INFINITY, |(min, _)| min.y);
            if self.now.body.feet.y < lowest - ABYSS && !self.now.flying {
                self.now = self.start;
                self.before = self.start;
            }
        }
        self.show(self.clock.part_of_step());
    }

    /// Updates the viewpoint by an input: gestures orbit, and walking makes the player fly off from the
    /// current view.
    fn follow_viewpoint(&mut self, input: &Input) {
        if self.viewpoint == Viewpoint::Player {
            return;
        }
        if input.wants_to_go() {
            let view = self.view();
            return self.look_from(&view);
        }
        let Some(moved) = self.orbit_after(input) else { return };
        if let Viewpoint::FileCamera(index) = self.viewpoint
            && let Some((entity, _)) = self.cameras.get(index)
            && let Some(Camera { projection: seen @ Projection::Perspective { .. }, .. }) =
                self.world.get(*entity)
        {
            // The field of view stays; the orbit is not limited by the file camera's far plane.
            self.lens.projection = *seen;
            if let Projection::Perspective { far, .. } = &mut self.lens.projection {
                *far = None;
            }
        }
        self.viewpoint = Viewpoint::Orbit(moved);
    }

    /// Returns the orbit after gestures, or `None` if the viewpoint is no orbit and the gestures do not start
    /// one.
    fn orbit_after(&self, gestures: &Input) -> Option<OrbitView> {
        let drags = *gestures != Input { orbit: DVec2::ZERO, pan: DVec2::ZERO, zoom: 0.0, ..*gestures };
        let mut orbit = match self.viewpoint {
            Viewpoint::Orbit(orbit) => orbit,
            Viewpoint::FileCamera(_) if drags => OrbitView::of_camera(&self.view(), &self.bounds),
            Viewpoint::FileCamera(_) | Viewpoint::Player => return None,
        };
        orbit.turn(gestures.orbit);
        orbit.pan(gestures.pan, self.height_of_view());
        orbit.zoom(gestures.zoom);
        Some(orbit)
    }

    /// Returns the height of the picture in metres at a distance of one metre from the eye.
    fn height_of_view(&self) -> f64 {
        match self.lens.projection {
            Projection::Perspective { vertical_fov, .. } => 2.0 * (0.5 * vertical_fov).tan(),
            Projection::Orthographic { .. } => 1.0,
        }
    }

    /// Returns the eye of the picture as it was last shown.
    fn view(&self) -> Transform {
        let entity = match self.viewpoint {
            Viewpoint::FileCamera(index) => self.cameras.get(index).map(|(entity, _)| *entity),
            Viewpoint::Player | Viewpoint::Orbit(_) => Some(self.camera),
        };
        let place = entity.and_then(|entity| self.world.get::<GlobalTransform>(entity));
        place.map_or(Transform::IDENTITY, |place| Transform::from_affine(place.0).0)
    }

    /// Returns the transforms of the player's body and head, and the lens; the player is interpolated between
    /// the last two steps by `part`.
    fn eyes(&self, part: f64) -> (Transform, Transform, Camera) {
        let (before, now) = (&self.before, &self.now);
        // Rotation is shown at once: gestures since the last step are applied here before a step processes
        // them.
        if let Some(orbit) = self.orbit_after(&self.gestures) {
            return (orbit.place(), Transform::IDENTITY, self.lens_from(orbit.near()));
        }
        if let Viewpoint::FileCamera(index) = self.viewpoint
            && let Some((entity, _)) = self.cameras.get(index)
            && let Some(lens) = self.world.get::<Camera>(*entity)
        {
            return (self.view(), Transform::IDENTITY, *lens);
        }
        let feet = before.body.feet.lerp(now.body.feet, part);
        let eyes = before.eye_height() + (now.eye_height() - before.eye_height()) * part;
        let mut turned = *now;
        turned.turn(self.gestures.look);
        let body = Transform::from_translation(feet).with_rotation(DQuat::from_rotation_y(turned.yaw));
        let head = Transform::from_xyz(0.0, eyes, 0.0).with_rotation(DQuat::from_rotation_x(turned.pitch));
        (body, head, self.lens)
    }

    /// Returns the lens with its near plane limited to `most` metres.
    fn lens_from(&self, most: f64) -> Camera {
        let mut lens = self.lens;
        if let Projection::Perspective { near, .. } = &mut lens.projection {
            *near = near.min(most);
        }
        lens
    }

    /// Updates the World: the player's eyes, the lens, and everything that moves with the time.
    fn show(&mut self, part: f64) {
        let (body, head, lens) = self.eyes(part);
        for (entity, transform) in [(self.player, body), (self.camera, head)] {
            if let Some(mut current) = self.world.get_mut::<Transform>(entity) {
                current.set_if_neq(transform);
            }
        }
        if let Some(mut current) = self.world.get_mut::<Camera>(self.camera) {
            current.set_if_neq(lens);
        }
        let now = self.now;
        if let Some(mut player) = self.world.get_mut::<Player>(self.player) {
            player.set_if_neq(now);
        }
        self.world.insert_resource(GameTime { seconds: self.clock.elapsed().as_secs_f64() });
        self.schedule.run(&mut self.world);
    }
}

/// Returns the cameras of a World in the order in which they were spawned, with a name for each.
fn cameras_of(world: &mut World) -> Vec<(Entity, String)> {
    let mut query = world.query_filtered::<(Entity, Option<&Name>), With<Camera>>();
    let mut cameras: Vec<(Entity, String)> = query
        .iter(world)
        .map(|(entity, name)| (entity, name.map_or_else(String::new, ToString::to_string)))
        .collect();
    // In the order of spawning, which the order of entities is not.
    cameras.sort_by_key(|(entity, _)| entity.index_u32());
    for (index, (_, name)) in cameras.iter_mut().enumerate().filter(|(_, (_, name))| name.is_empty()) {
        *name = format!("camera {index}");
    }
    cameras
}

/// Returns where the player starts, and the lens of the camera there.
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

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use lumbre_scene::Mesh;

    use super::*;

    /// A box at the origin and two cameras: the first looks at it from the right, the second from above.
    fn looked_at() -> Game {
        let mut world = World::new();
        let cuboid = Arc::new(lumbre_mesh::shapes::cuboid(glam::Vec3::new(2.0, 1.0, 1.0), 1));
        world.spawn(Mesh(cuboid));
        let right = Transform::from_xyz(9.0, 0.0, 0.0).looking_at(DVec3::ZERO, DVec3::Y);
        let above = Transform::from_xyz(0.0, 7.0, 0.1).looking_at(DVec3::ZERO, DVec3::Y);
        world.spawn((Name::new("right"), Camera { exposure: 0.5, ..Camera::default() }, right));
        world.spawn((Camera::default(), above));
        let mut game = Game::new(world).unwrap();
        game.orbit_everything();
        game
    }

    fn eye(game: &Game) -> Transform {
        Transform::from_affine(game.world.get::<GlobalTransform>(game.camera()).unwrap().0).0
    }

    #[test]
    fn a_file_is_framed_and_turned_by_dragging() {
        let mut game = looked_at();
        let before = eye(&game);
        assert!((before.rotation * DVec3::NEG_Z).dot(-before.translation.normalize()) > 1.0 - 1e-9);
        game.step_once(&Input { orbit: DVec2::new(0.4, 0.2), ..Input::default() });
        let after = eye(&game);
        assert!((after.translation.length() - before.translation.length()).abs() < 1e-9);
        assert!(after.translation.distance(before.translation) > 0.3);
        assert!(after.translation.y > before.translation.y, "dragged downwards it is seen from above");
        game.step_once(&Input { zoom: 3.0, ..Input::default() });
        assert!(eye(&game).translation.length() < 0.7 * before.translation.length());
        // Without gestures nothing changes.
        let rest = eye(&game);
        game.step_once(&Input::default());
        assert_eq!(eye(&game), rest);
    }

    #[test]
    fn what_the_mouse_did_is_shown_before_the_next_step() {
        let mut game = looked_at();
        let before = eye(&game);
        game.step(Duration::ZERO, &Input { orbit: DVec2::new(0.4, 0.0), ..Input::default() });
        let shown = eye(&game);
        assert!(shown.translation.distance(before.translation) > 0.3);
        game.step_once(&Input::default());
        assert!(eye(&game).translation.distance(shown.translation) < 1e-9, "and counts once");
    }

    #[test]
    fn cameras_come_in_turn_and_bring_their_lenses() {
        let mut game = looked_at();
        assert_eq!(
            game.cameras().iter().map(|(_, name)| name.as_str()).collect::<Vec<_>>(),
            ["right", "camera 1"]
        );
        game.apply(Action::NextCamera);
        assert_eq!(game.viewpoint(), &Viewpoint::FileCamera(0));
        assert!(eye(&game).translation.distance(DVec3::X * 9.0) < 1e-9);
        assert_eq!(game.world.get::<Camera>(game.camera()).unwrap().exposure, 0.5);
        game.apply(Action::NextCamera);
        assert!((eye(&game).translation.y - 7.0).abs() < 1e-9);
        game.apply(Action::NextCamera);
        assert!(matches!(game.viewpoint(), Viewpoint::Orbit(_)));
        // Dragging in a camera's view orbits the camera's target, starting from that view.
        game.apply(Action::NextCamera);
        game.step_once(&Input { orbit: DVec2::new(1e-6, 0.0), ..Input::default() });
        assert!(matches!(game.viewpoint(), Viewpoint::Orbit(_)));
        assert!(eye(&game).translation.distance(DVec3::X * 9.0) < 1e-3);
    }

    #[test]
    fn walking_sets_out_from_the_view_and_a_key_leads_back() {
        let mut game = looked_at();
        let before = eye(&game);
        game.step_once(&Input { forward: true, ..Input::default() });
        assert_eq!(game.viewpoint(), &Viewpoint::Player);
        assert!(game.player().flying);
        // What is drawn is interpolated between the last two steps.
        game.step_once(&Input { forward: true, ..Input::default() });
        let after = eye(&game);
        let ahead = after.translation - before.translation;
        let speed = game.player().flight_speed;
        assert!((ahead.length() - speed * STEP_SECONDS).abs() < 1e-9, "{ahead} at {speed}");
        assert!(ahead.normalize().dot(before.rotation * DVec3::NEG_Z) > 0.999);
        game.apply(Action::OrbitEverything);
        assert_eq!(eye(&game), before);
    }

    #[test]
    fn nothing_to_see_is_no_fault() {
        let mut game = Game::new(World::new()).unwrap();
        game.orbit_everything();
        game.next_camera();
        game.step_once(&Input { orbit: DVec2::ONE, pan: DVec2::ONE, zoom: 1.0, ..Input::default() });
        game.step_once(&Input { forward: true, ..Input::default() });
        assert!(eye(&game).translation.is_finite());
    }
}
