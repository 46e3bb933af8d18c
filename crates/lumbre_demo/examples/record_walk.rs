//! Walks through the level by simulated input and records it, for the tests that replay the walks: `cargo run
//! -p lumbre_demo --example record_walk`. Run it again when the level changes.

use std::f64::consts::{PI, TAU};
use std::path::Path;

use anyhow::{Result, ensure};
use bevy_ecs::world::World;
use glam::{DVec2, DVec3};
use lumbre_demo::{Action, Game, Input, level};

/// Waypoints, x and z: through all rooms and back to the corridor.
const WAY: [[f64; 2]; 16] = [
    [10.9, 5.0],
    [13.4, 5.0],
    [18.0, 4.9],
    [22.0, 5.0],
    [24.0, 5.0],
    [27.0, 5.2],
    [25.6, 9.6],
    [24.6, 10.4],
    [24.6, 13.8],
    [24.4, 14.6],
    [20.8, 14.6],
    [17.8, 12.6],
    [17.6, 11.0],
    [17.6, 8.0],
    [17.6, 6.0],
    [15.0, 5.0],
];
/// Fastest turn, radians per step.
const TURN: f64 = 0.03;
/// Number of steps per waypoint after which the player counts as stuck.
const PATIENCE: usize = 2000;

fn main() -> Result<()> {
    // The first two waypoints lead through the door to the corridor.
    record(&WAY[..2], "hall_to_corridor.json")?;
    record(&WAY, "all_rooms.json")
}

fn record(way: &[[f64; 2]], file: &str) -> Result<()> {
    let mut world = World::new();
    level::build(&mut world);
    let mut game = Game::new(world)?;
    game.record();
    for &[x, z] in way {
        let target = DVec3::new(x, 0.0, z);
        let mut steps = 0;
        loop {
            let player = *game.player();
            let way = (target - player.body.feet).with_y(0.0);
            if way.length() < 0.25 {
                break;
            }
            ensure!(steps < PATIENCE, "stuck at {} on the way to {target}", player.body.feet);
            steps += 1;
            let turn = (player.yaw - (-way.x).atan2(-way.z) + PI).rem_euclid(TAU) - PI;
            let look = DVec2::new(turn.clamp(-TURN, TURN), 0.0);
            // Corrections that are too small to matter are left out of the recording.
            let look = if turn.abs() < 0.02 { DVec2::ZERO } else { look };
            let fast = turn.abs() < 0.3 && way.length() > 1.5;
            game.step_once(&Input { forward: turn.abs() < 0.8, run: fast, look, ..Input::default() });
        }
    }
    game.apply(Action::ToggleTorch);
    for _ in 0..30 {
        game.step_once(&Input::default());
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/walks").join(file);
    let recording = game.take_recording().unwrap_or_default();
    recording.save(&path)?;
    eprintln!("{}: {} events in {} steps", path.display(), recording.events.len(), recording.end);
    Ok(())
}
