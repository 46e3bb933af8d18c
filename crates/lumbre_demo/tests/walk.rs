//! Recorded input walks through the level: into the next room, and not into a wall.

use std::path::Path;
use std::time::Duration;

use bevy_ecs::world::World;
use glam::{DVec2, DVec3};
use lumbre_demo::level::{self, Room};
use lumbre_demo::{Action, Game, Input, Recording};
use lumbre_optics::Light;

fn game() -> Game {
    let mut world = World::new();
    level::build(&mut world);
    Game::new(world).expect("the level's motions are sound")
}

fn walk(name: &str) -> Recording {
    Recording::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/walks").join(name))
        .expect("a recorded walk")
}

fn is_in(room: &str, point: DVec3) -> bool {
    let Room { bounds, .. } =
        level::rooms().into_iter().find(|one| one.name == room).expect("a room of the level");
    // At the height of the waist: the feet are on the border of the room, to within rounding.
    let point = point + DVec3::Y;
    bounds.min.cmple(point).all() && point.cmple(bounds.max).all()
}

#[test]
fn a_recorded_walk_leads_from_the_hall_into_the_corridor() {
    let mut game = game();
    assert!(is_in("hall", game.player().body.feet));
    game.replay(&walk("hall_to_corridor.json"));
    let player = game.player();
    assert!(is_in("corridor", player.body.feet), "{player:?}");
    assert!(player.body.on_ground && !player.flying);
    assert!(game.world.get::<Light>(game.torch()).unwrap().enabled);
}

#[test]
fn a_recorded_walk_takes_the_round_through_all_rooms() {
    let mut game = game();
    let mut rooms = Vec::new();
    for (input, actions) in walk("all_rooms.json").player() {
        for action in actions {
            game.apply(action);
        }
        game.step_once(&input);
        let feet = game.player().body.feet;
        let room = level::rooms().iter().find(|room| is_in(room.name, feet)).map(|room| room.name);
        if let Some(room) = room.filter(|room| rooms.last() != Some(room)) {
            rooms.push(room);
        }
    }
    // Down the stairs from the gallery to the vault, up the other stairs, and out into the corridor.
    assert_eq!(rooms, ["hall", "corridor", "gallery", "vault", "corridor"]);
    assert!(game.player().body.on_ground);
}

#[test]
fn walking_straight_at_a_wall_stops_at_the_radius() {
    let mut game = game();
    let turn =
        |game: &Game, yaw: f64| Input { look: DVec2::new(game.player().yaw - yaw, 0.0), ..Input::default() };
    // Towards +z, where nothing is in the way: the teal wall is at z = 10.
    let south = turn(&game, std::f64::consts::PI);
    game.step_once(&Input { forward: true, ..south });
    let forward = Input { forward: true, run: true, ..Input::default() };
    // To the side of the door's niche, which is 0.3 m deeper.
    game.step_once(&Input { left: false, right: true, ..Input::default() });
    for _ in 0..100 {
        game.step_once(&Input { right: true, ..Input::default() });
    }
    for _ in 0..240 {
        game.step_once(&forward);
    }
    let feet = game.player().body.feet;
    let radius = game.player().stature.radius;
    assert!((feet.z - (10.0 - radius)).abs() < 1e-4, "{feet}");
    assert!(is_in("hall", feet));
}

#[test]
fn the_same_walk_without_its_turns_ends_in_the_hall() {
    // Negative control of the first test: without the turn into the doorway, a wall of the hall stops the
    // walk.
    let mut recording = walk("hall_to_corridor.json");
    for event in &mut recording.events {
        event.input.look = DVec2::ZERO;
    }
    let mut game = game();
    game.replay(&recording);
    assert!(is_in("hall", game.player().body.feet), "{:?}", game.player());
}

#[test]
fn what_is_recorded_at_any_frame_rate_is_replayed_exactly() {
    let mut live = game();
    live.record();
    let forward = Input { forward: true, ..Input::default() };
    for frame in 0..300u32 {
        // Frames of 1 to 40 ms, with a turn in each.
        let length = Duration::from_micros(u64::from(1000 + frame * 7919 % 39_000));
        let look = DVec2::new(0.01 * f64::from(frame % 7), -0.002 * f64::from(frame % 3));
        if frame == 100 {
            live.apply(Action::ToggleTorch);
        }
        live.step(length, &Input { look, jump: frame % 50 == 0, ..forward });
    }
    let end = *live.player();
    let recording = live.take_recording().unwrap();
    let text = serde_json::to_string(&recording).unwrap();
    let mut again = game();
    again.replay(&Recording::parse(&text, "recorded").unwrap());
    assert_eq!(again.player().body, end.body);
    assert_eq!((again.player().yaw, again.player().pitch), (end.yaw, end.pitch));
    assert!(again.world.get::<Light>(again.torch()).unwrap().enabled);
    assert!(end.body.feet.distance(game().player().body.feet) > 1.0);
}

#[test]
fn frames_of_a_quarter_second_end_where_short_ones_do() {
    let play = |frame: Duration, frames: u32| {
        let mut game = game();
        for _ in 0..frames {
            game.step(frame, &Input { forward: true, run: true, ..Input::default() });
        }
        game.player().body
    };
    assert_eq!(play(Duration::from_millis(250), 16), play(Duration::from_millis(4), 1000));
}
