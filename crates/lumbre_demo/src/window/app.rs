//! The application: connects winit's events to the file that is viewed and to the stage that draws it.

use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use lumbre_optics::Light;
use lumbre_render::{FrameOptions, FrameReport, Measure, MissingPipelines};
use lumbre_scene::SceneSettings;
use winit::application::ApplicationHandler;
use winit::dpi::LogicalSize;
use winit::event::{DeviceEvent, DeviceId, ElementState, KeyEvent, MouseButton, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow};
use winit::keyboard::{KeyCode, PhysicalKey};
use winit::window::{Window, WindowId};

use super::accuracy::{Accuracy, choose};
use super::keys;
use super::mouse::{Drag, Grab};
use super::overlay::{Facts, FileFacts, LaidOut, Overlay};
use super::stage::{OverlayFrame, Shown, Stage};
use super::viewing::Viewing;
use super::{PlayOptions, Trial};
use crate::picture::write_png;
use crate::recording::STEPS_PER_SECOND;
use crate::{Action, Input, Opened, Recording, Viewpoint};

/// Largest number of devices that may be lost in a row without a frame being shown.
const MAX_LOSSES: u32 = 3;
/// Delay before the next attempt while the window shows nothing.
const IDLE: Duration = Duration::from_millis(50);
/// Frames to draw after all work has ended: the overlay lays out new text in the first and shows it in the
/// second.
const FRAMES_AT_REST: u32 = 2;
/// Steps of a recording per frame, for 60 frames per second of game time.
const STEPS_PER_FRAME: u32 = STEPS_PER_SECOND / 60;

/// A file in a window.
pub struct App {
    viewing: Viewing,
    options: PlayOptions,
    replay: Option<std::vec::IntoIter<(Input, Vec<Action>)>>,
    window: Option<Arc<Window>>,
    stage: Option<Stage>,
    overlay: Overlay,
    accuracy: Accuracy,
    egui: Option<egui_winit::State>,
    report: Option<Box<FrameReport>>,
    input: Input,
    grab: Grab,
    drag: Drag,
    /// Whether a file is being dragged over the window.
    hovered: bool,
    last: Option<Instant>,
    frames: u64,
    /// Frames since everything that was being opened, baked, written or measured ended.
    frames_at_rest: u32,
    losses: u32,
    /// The error that ends the event loop, if any.
    pub outcome: Result<()>,
}

impl App {
    /// Creates the application. Its window opens when the event loop runs.
    pub fn new(opened: Opened, options: PlayOptions, replay: Option<&Recording>) -> Self {
        let overlay = match options.screenshot {
            // The last frame shows everything that is said by then, however fast the frames are.
            Some(_) => Overlay::without_fading(),
            None => Overlay::default(),
        };
        let replay = replay.map(|recording| recording.player().collect::<Vec<_>>().into_iter());
        Self {
            viewing: match options.bake {
                true => Viewing::baking(opened, options.open.clone()),
                false => Viewing::new(opened, options.open.clone()),
            },
            options,
            replay,
            window: None,
            stage: None,
            overlay,
            accuracy: Accuracy::default(),
            egui: None,
            report: None,
            input: Input::default(),
            grab: Grab::default(),
            drag: Drag::default(),
            hovered: false,
            last: None,
            frames: 0,
            frames_at_rest: 0,
            losses: 0,
            outcome: Ok(()),
        }
    }

    /// Returns the recording of what was played, if it was requested.
    pub fn take_recording(&mut self) -> Option<Recording> {
        self.viewing.take_recording()
    }

    fn open(&mut self, event_loop: &ActiveEventLoop) -> Result<()> {
        let (width, height) = self.options.size;
        let attributes = Window::default_attributes()
            .with_title(self.title())
            .with_inner_size(LogicalSize::new(width.max(1), height.max(1)));
        let window = Arc::new(event_loop.create_window(attributes).context("no window could be opened")?);
        self.window = Some(window);
        self.build_stage(event_loop)?;
        let software = self
            .stage
            .as_ref()
            .is_some_and(|stage| stage.gpu().adapter.get_info().device_type == wgpu::DeviceType::Cpu);
        if software {
            // Four samples are expensive on a software rasterizer, so they are off unless the level asks for
            // them; M turns them on.
            let game = &mut self.viewing.opened.game;
            let asked =
                game.world.get_resource::<SceneSettings>().and_then(|settings| settings.frame.multisample);
            game.view.multisample = asked.unwrap_or(false);
        }
        self.follow_size();
        if !self.viewing.opened.game.has_a_start() {
            // Framed again with the window's aspect ratio.
            self.viewing.opened.game.orbit_everything();
        }
        Ok(())
    }

    fn title(&self) -> String {
        format!("Lumbre: {}", self.viewing.opened.path.file_name().unwrap_or_default().to_string_lossy())
    }

    /// Passes the picture's aspect ratio to the game.
    fn follow_size(&mut self) {
        if let Some((width, height)) = self.stage.as_ref().map(Stage::size) {
            self.viewing.opened.game.set_aspect(f64::from(width) / f64::from(height));
        }
    }

    /// Creates a device for the window, and a new overlay context, because the fonts have to be uploaded
    /// again.
    fn build_stage(&mut self, event_loop: &ActiveEventLoop) -> Result<()> {
        let Some(window) = self.window.clone() else { return Ok(()) };
        self.stage = None;
        let stage = Stage::new(event_loop, window.clone(), self.options.screenshot.is_some())?;
        self.overlay.forget_device();
        self.accuracy.forget_device();
        let side = stage.gpu().device.limits().max_texture_dimension_2d as usize;
        let (context, scale) = (self.overlay.context.clone(), window.scale_factor() as f32);
        let viewport = egui::ViewportId::ROOT;
        self.egui = Some(egui_winit::State::new(
            context,
            viewport,
            &*window,
            Some(scale),
            window.theme(),
            Some(side),
        ));
        self.stage = Some(stage);
        Ok(())
    }

    /// Advances by the time since the last frame.
    fn advance(&mut self) {
        let now = Instant::now();
        let passed = self.last.replace(now).map_or(Duration::ZERO, |last| now - last);
        if !passed.is_zero() {
            self.overlay.note_frame(passed.as_secs_f32() * 1000.0);
        }
        if self.viewing.update(passed) {
            self.show_new_file();
        }
        if self.replay.is_none() && !self.accuracy.is_measuring() {
            self.viewing.opened.game.step(passed, &self.input);
            self.input = self.input.held();
        }
        for _ in 0..STEPS_PER_FRAME {
            // The frames of one measurement must show the same state.
            if self.accuracy.is_measuring() {
                break;
            }
            let Some((input, actions)) = self.replay.as_mut().and_then(Iterator::next) else { break };
            actions.into_iter().for_each(|action| self.act(action));
            self.viewing.opened.game.step_once(&input);
        }
    }

    /// Carries out a command.
    fn act(&mut self, action: Action) {
        match action {
            Action::ToggleReference => {
                self.accuracy.toggle();
                self.overlay.forget_reference();
            }
            Action::MeasureSettings if self.accuracy.cancel() => {}
            Action::MeasureSettings if self.viewing.is_at_rest() => self.accuracy.measure(),
            Action::MeasureSettings => self.viewing.say_that_it_works(),
            Action::CheaperSettings | Action::BetterSettings => {
                let options = self.frame_options();
                let game = &mut self.viewing.opened.game;
                let next = self.accuracy.next(game, &options, action == Action::BetterSettings);
                if let Some(settings) = next {
                    choose(game, &settings);
                }
            }
            Action::ToggleOverlay | Action::Quit => {}
            // Other commands change the picture, which ends a measurement of it.
            _ => drop(self.accuracy.cancel()),
        }
        self.viewing.apply(action);
    }

    /// Adapts the window to a file that has replaced the previous one.
    fn show_new_file(&mut self) {
        self.release();
        self.input = Input::default();
        self.report = None;
        self.accuracy.forget_file();
        self.overlay.forget_reference();
        self.follow_size();
        if !self.viewing.opened.game.has_a_start() {
            self.viewing.opened.game.orbit_everything();
        }
        if let Some(window) = &self.window {
            window.set_title(&self.title());
        }
    }

    fn frame_options(&self) -> FrameOptions {
        let view = &self.viewing.opened.game.view;
        FrameOptions {
            shading: view.shading,
            reflection: view.reflection,
            lightmaps: view.lightmaps,
            // Without lightmaps, moving objects are not lit by baked light either.
            irradiance_volumes: view.lightmaps,
            shadows: view.shadows,
            multisample: Some(view.multisample),
            missing_pipelines: MissingPipelines::Background,
            measure: match (view.overlay, view.count_lights) {
                (false, _) if self.accuracy.is_shown() => Measure::Time,
                (false, _) => Measure::Nothing,
                (true, false) => Measure::TimeAndInvocations,
                (true, true) => Measure::Lights,
            },
            ..FrameOptions::default()
        }
    }

    fn draw(&mut self, event_loop: &ActiveEventLoop) -> Result<()> {
        self.advance();
        let mut options = self.frame_options();
        if let Some(stage) = &mut self.stage {
            self.viewing.measure(stage, &options)?;
        }
        options.exposure = self.viewing.exposure();
        self.measure_accuracy(&options)?;
        let facts = self.facts(&options);
        let (Some(window), Some(egui), Some(stage)) = (&self.window, &mut self.egui, &mut self.stage) else {
            return Ok(());
        };
        let input = egui.take_egui_input(window);
        let LaidOut { mut output, wishes } = self.overlay.lay_out(input, &facts, self.report.as_deref());
        if !self.grab.is_held() {
            // Applying the cursor shape would show the pointer, which has to stay hidden while grabbed.
            egui.handle_platform_output(window, std::mem::take(&mut output.platform_output));
        }
        let scale = output.pixels_per_point;
        let triangles = self.overlay.context.tessellate(output.shapes, scale);
        let frame = OverlayFrame { triangles, textures: output.textures_delta, scale };
        let front = facts.accuracy.front.as_ref();
        let wished = front.zip(wishes.settings).and_then(|(front, place)| front.ways.get(place));
        if let Some(way) = wished {
            choose(&mut self.viewing.opened.game, &way.settings);
        }
        match stage.show(&mut self.viewing.opened.game.world, &options, frame)? {
            Shown::Frame(report) => {
                self.report = Some(report);
                self.losses = 0;
                self.frames += 1;
            }
            Shown::Nothing => event_loop.set_control_flow(ControlFlow::wait_duration(IDLE)),
            Shown::DeviceLost => self.recover(event_loop)?,
        }
        self.grab.recentre(window_of(&self.window)?);
        let measured = self.accuracy.is_at_rest(&self.viewing.opened.game, &options);
        let is_at_rest = self.viewing.is_at_rest() && measured;
        self.frames_at_rest = if is_at_rest { self.frames_at_rest + 1 } else { 0 };
        self.after_frame(event_loop, &options)
    }

    /// Draws the pictures of the accuracy measurements that are due.
    fn measure_accuracy(&mut self, options: &FrameOptions) -> Result<()> {
        let Some(stage) = &self.stage else { return Ok(()) };
        let world = &mut self.viewing.opened.game.world;
        match self.accuracy.update(stage.gpu(), stage.size(), world, options) {
            Ok(Some(beside)) => self.overlay.show_reference(beside.size, &beside.rgba),
            Ok(None) => {}
            // The next frame creates another device.
            Err(_) if stage.gpu().is_lost() => {}
            Err(error) => return Err(error.into()),
        }
        Ok(())
    }

    /// Creates a new device after one was lost.
    fn recover(&mut self, event_loop: &ActiveEventLoop) -> Result<()> {
        self.losses += 1;
        if self.losses > MAX_LOSSES {
            bail!("the graphics device was lost {} times in a row; see the driver's log", self.losses);
        }
        tracing::warn!("the graphics device is lost; making another one");
        self.report = None;
        self.build_stage(event_loop)
    }

    /// Applies simulated events, and ends the event loop when it is due.
    fn after_frame(&mut self, event_loop: &ActiveEventLoop, options: &FrameOptions) -> Result<()> {
        self.undergo_trials();
        let played = self.replay.as_ref().is_some_and(|replay| replay.len() == 0);
        let counted = self.options.quit_after.is_some_and(|after| self.frames >= u64::from(after));
        let is_over = counted || (played && self.options.quit_after.is_none());
        let waits = self.options.wait_for_work && self.frames_at_rest < FRAMES_AT_REST;
        if !(is_over && !waits || self.viewing.opened.game.wants_to_quit()) {
            return Ok(());
        }
        if let (Some(path), Some(stage)) = (self.options.screenshot.take(), &mut self.stage) {
            let (width, height, rgba) = stage.picture(&mut self.viewing.opened.game.world, options)?;
            write_png(&path, width, height, &rgba)?;
        }
        event_loop.exit();
        Ok(())
    }

    fn undergo_trials(&mut self) {
        let frames = self.frames;
        let due: Vec<Trial> = self
            .options
            .trials
            .extract_if(.., |(after, _)| *after <= frames)
            .map(|(_, trial)| trial)
            .collect();
        for trial in due {
            match (trial, &mut self.stage, &self.window) {
                (Trial::LoseDevice, Some(stage), _) => stage.gpu().device.destroy(),
                (Trial::Vanish, Some(stage), _) => stage.resize(0, 0),
                (Trial::Resize(width, height), Some(stage), Some(window)) => {
                    if let Some(size) = window.request_inner_size(LogicalSize::new(width, height)) {
                        stage.resize(size.width, size.height);
                    }
                }
                (Trial::Drop(path), _, _) => self.viewing.open(&path),
                (Trial::Act(action), _, _) => self.act(action),
                (Trial::Escape, _, _) => self.escape(),
                _ => {}
            }
        }
    }

    fn facts(&mut self, options: &FrameOptions) -> Facts {
        let accuracy = self.accuracy.facts(&mut self.viewing.opened.game, options);
        let game = &self.viewing.opened.game;
        let lit = game.world.get::<Light>(game.torch()).is_some_and(|light| light.enabled);
        let opened = &self.viewing.opened;
        Facts {
            device: self.stage.as_ref().map(|stage| stage.gpu().describe()).unwrap_or_default(),
            size: self.stage.as_ref().map(Stage::size).unwrap_or_default(),
            view: game.view,
            torch: lit,
            is_player: *game.viewpoint() == Viewpoint::Player,
            flying: game.player().flying,
            grabbed: self.grab.is_held(),
            feet: game.player().body.feet,
            is_level: game.has_a_start(),
            exposure: self.viewing.exposure(),
            adapts: self.viewing.adapts(),
            accuracy,
            file: FileFacts {
                name: opened.path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
                notes: opened.notes.clone(),
                viewpoint: self.viewing.viewpoint(),
                cameras: game.cameras().iter().map(|(_, name)| name.clone()).collect(),
                hovered: self.hovered,
                message: self.viewing.message().cloned(),
                bake: self.viewing.bake_status().cloned(),
                light: self.viewing.light(),
                can_save: self.viewing.can_save(),
            },
        }
    }

    fn key(&mut self, event: &KeyEvent) {
        let PhysicalKey::Code(key) = event.physical_key else { return };
        let down = event.state == ElementState::Pressed;
        keys::hold(&mut self.input, key, down);
        if !down || event.repeat {
            return;
        }
        match keys::action(key) {
            Some(action) => self.act(action),
            None if key == KeyCode::Escape => self.escape(),
            None => {}
        }
    }

    /// Releases the mouse, or else cancels a measurement, or else the running bake.
    fn escape(&mut self) {
        if self.grab.is_held() {
            self.release();
        } else if !self.accuracy.cancel() {
            self.viewing.cancel();
        }
    }

    /// Handles a button press over the picture: it grabs the mouse for a walking player and starts a drag
    /// otherwise.
    fn press(&mut self, button: MouseButton) {
        let walks = *self.viewing.opened.game.viewpoint() == Viewpoint::Player;
        match &self.window {
            Some(window) if walks && button == MouseButton::Left && !self.grab.is_held() => {
                self.grab = Grab::take(window);
            }
            _ if !walks => self.drag.press(button),
            _ => {}
        }
    }

    fn release(&mut self) {
        if let (true, Some(window)) = (self.grab.is_held(), &self.window) {
            self.grab.release(window);
        }
    }

    /// Ends the event loop if the result is an error.
    fn fail(&mut self, event_loop: &ActiveEventLoop, result: Result<()>) {
        if result.is_err() {
            self.outcome = result;
            event_loop.exit();
        }
    }
}

fn window_of(window: &Option<Arc<Window>>) -> Result<&Window> {
    window.as_deref().context("the window is gone")
}

impl ApplicationHandler for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.window.is_none() {
            let opened = self.open(event_loop);
            self.fail(event_loop, opened);
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let consumed = match (&self.window, &mut self.egui) {
            (Some(window), Some(egui)) if !self.grab.is_held() => {
                egui.on_window_event(window, &event).consumed
            }
            _ => false,
        };
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::Resized(size) => {
                if let Some(stage) = &mut self.stage {
                    stage.resize(size.width, size.height);
                }
                self.follow_size();
            }
            WindowEvent::Focused(false) => {
                // Releases of keys are not reported while the window has no focus.
                self.input = Input::default();
                self.drag = Drag::default();
                self.release();
            }
            // A recording is not disturbed by keys, but Q still quits.
            WindowEvent::KeyboardInput { event, .. } if self.replay.is_none() || is_quit(&event) => {
                self.key(&event)
            }
            WindowEvent::MouseInput { state: ElementState::Pressed, button, .. }
                if !consumed && self.replay.is_none() =>
            {
                self.press(button);
            }
            WindowEvent::MouseInput { state: ElementState::Released, button, .. } => {
                self.drag.release(button);
            }
            WindowEvent::CursorMoved { position, .. } if self.replay.is_none() => {
                let height = self.stage.as_ref().map_or(1, |stage| stage.size().1);
                let dragged = self.drag.motion((position.x, position.y), height);
                if !self.grab.is_held() {
                    self.input.add_gestures(&dragged);
                }
            }
            WindowEvent::MouseWheel { delta, .. } if !consumed && self.replay.is_none() => {
                self.input.add_gestures(&Drag::wheel(delta));
            }
            WindowEvent::HoveredFile(_) => self.hovered = true,
            WindowEvent::HoveredFileCancelled => self.hovered = false,
            WindowEvent::DroppedFile(path) => {
                self.hovered = false;
                self.viewing.open(&path);
            }
            WindowEvent::RedrawRequested => {
                let drawn = self.draw(event_loop);
                self.fail(event_loop, drawn);
            }
            _ => {}
        }
    }

    fn device_event(&mut self, _: &ActiveEventLoop, _: DeviceId, event: DeviceEvent) {
        if let DeviceEvent::MouseMotion { delta } = event
            && self.replay.is_none()
        {
            self.input.look += self.grab.look(delta);
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        let minimised = self.stage.as_ref().is_some_and(|stage| stage.size().0 == 0 || stage.size().1 == 0);
        let pause = minimised
            || matches!(event_loop.control_flow(), ControlFlow::WaitUntil(until) if until > Instant::now());
        if pause {
            event_loop.set_control_flow(ControlFlow::wait_duration(IDLE));
        } else {
            event_loop.set_control_flow(ControlFlow::Poll);
        }
        if let Some(window) = &self.window {
            window.request_redraw();
        }
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        self.release();
        // The surface must be dropped before the window.
        self.stage = None;
    }
}

fn is_quit(event: &KeyEvent) -> bool {
    matches!(event.physical_key, PhysicalKey::Code(key) if keys::action(key) == Some(Action::Quit))
}
