//! The playable demo level, and a viewer for any other glTF file: game rules, input, window and overlay.
//!
//! ```text
//!   level::build ──► lumbre_scene::save ──► assets/demo.glb ──► bake ──► Game::load
//!                                                                          │
//!   keys, mouse ──► Input, Action ──► Game::step ──► World ──► lumbre_render ──► window
//!        ▲               │             │  player: walking (gravity, walls, steps)
//!   Recording ◄──────────┘             │  motion: lights and props move with the time
//! ```
//!
//! A file that is not a level is an [`Opened`], which is framed and viewed through an [`OrbitView`]; a
//! [`BackgroundBake`] can bake its light while frames are drawn.
//!
//! The game rules are independent of the window, so that a recorded walk runs in a test as it does on screen.
//!
//! ```
//! use std::time::Duration;
//! use lumbre_demo::{Action, Game, Input, level};
//!
//! let mut world = bevy_ecs::world::World::new();
//! level::build(&mut world);
//! let mut game = Game::new(world)?;
//! let before = game.player().body.feet;
//! game.apply(Action::ToggleTorch);
//! game.step(Duration::from_millis(200), &Input { forward: true, ..Input::default() });
//! assert!(game.player().body.feet.distance(before) > 0.2);
//! # Ok::<(), lumbre_demo::GameError>(())
//! ```

mod adaptation;
#[cfg(feature = "window")]
mod background_bake;
mod clock;
mod game;
mod input;
pub mod level;
mod motion;
mod moving;
#[cfg(feature = "window")]
mod opened;
mod orbit_view;
#[cfg(feature = "window")]
mod picture;
mod player;
mod recording;
mod solid;
mod torch;
mod tour;
#[cfg(feature = "window")]
mod tour_frames;
mod view_settings;
pub mod walking;
#[cfg(feature = "window")]
mod window;

pub use adaptation::Adaptation;
#[cfg(feature = "window")]
pub use background_bake::{BackgroundBake, BakeError, BakeNews, BakeStatus, BakedLight};
pub use clock::{LONGEST_FRAME, STEP_SECONDS};
pub use game::{Game, GameError, START_CAMERA, Viewpoint};
pub use input::{Action, Input};
pub use lumbre_bake::has_light_to_bake;
pub use motion::{Bob, Flicker, Motion, MotionError, Orbit, Path, Pose, Spin, Swing};
pub use moving::{ExtrasError, GameTime, Rest, move_things, read_motions};
#[cfg(feature = "window")]
pub use opened::{ATLAS_SIDE, Exposure, OpenOptions, Opened};
pub use orbit_view::OrbitView;
pub use player::Player;
pub use recording::{Event, Playback, Recording, RecordingError, STEPS_PER_SECOND};
pub use torch::{torch_light, torch_place};
pub use tour::{TOUR_CAMERA, Tour};
#[cfg(feature = "window")]
pub use tour_frames::{tour, tour_of};
pub use view_settings::ViewSettings;
#[cfg(feature = "window")]
pub use window::{PlayOptions, Trial, has_display, key_help, run, run_opened};
