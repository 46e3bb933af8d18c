//! A program of its own that Lumbre lights: its World and schedule, its wgpu device, its window, and two effects that the renderer has never heard of.
//!
//! `own_program` opens a window; `--frames N` closes it after so many; `--picture FILE.png` draws one frame without a window.

mod bloom;
mod outline;

use std::error::Error;
use std::path::PathBuf;
use std::sync::Arc;

use bevy_ecs::prelude::*;
use glam::{DQuat, DVec3, Vec3};
use lumbre_graph::wgpu;
use lumbre_mesh::shapes;
use lumbre_optics::{Light, Material};
use lumbre_render::{
    Acquired, CurrentTarget, FrameOptions, Gpu, LastFrame, Offscreen, OffscreenFormat, Renderer,
    WindowSurface, render_frame,
};
use lumbre_scene::{Camera, Mesh, SceneSettings, Transform};
use winit::application::ApplicationHandler;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, EventLoop};
use winit::window::{Window, WindowId};

use bloom::{Bloom, BloomEffect};
use outline::{OutlineEffect, Outlined};

type Anything = Box<dyn Error>;

/// Turns around the world's vertical axis.
#[derive(Component)]
struct Orbits;

/// Seconds since the start.
#[derive(Resource, Default)]
struct Time(f64);

fn orbit(time: Res<Time>, mut moving: Query<&mut Transform, With<Orbits>>) {
    for (index, mut transform) in moving.iter_mut().enumerate() {
        let turn = DQuat::from_rotation_y(time.0 + index as f64 * 2.1);
        transform.translation = turn * DVec3::new(2.2, 1.2 + 0.4 * index as f64, 0.0);
    }
}

/// A floor, three balls, three lamps that glow and orbit.
fn scene() -> World {
    let mut world = World::new();
    world.init_resource::<Time>();
    world.insert_resource(FrameOptions::default());
    world.insert_resource(SceneSettings { ambient: Vec3::splat(0.03), ..SceneSettings::default() });
    let floor = Mesh::from(shapes::plane(12.0, 12.0, 1, 1));
    world.spawn((floor, Material::matt(Vec3::splat(0.4)), Transform::from_xyz(0.0, 0.0, 0.0)));
    let ball = Mesh::from(shapes::uv_sphere(0.7, 48, 24));
    for (index, color) in
        [Vec3::new(0.8, 0.2, 0.1), Vec3::new(0.2, 0.7, 0.2), Vec3::new(0.2, 0.3, 0.9)].into_iter().enumerate()
    {
        let place = Transform::from_xyz(1.7 * (index as f64 - 1.0), 0.7, 0.0);
        let mut entity =
            world.spawn((ball.clone(), Material::from_metallic_roughness(color, 0.0, 0.35), place));
        if index == 1 {
            entity.insert(Outlined { color: Vec3::new(1.0, 0.8, 0.1) });
        }
    }
    let lamp = Mesh::from(shapes::uv_sphere(0.08, 16, 8));
    for color in [Vec3::new(3.0, 2.4, 1.8), Vec3::new(1.5, 2.4, 3.0), Vec3::new(3.0, 1.5, 2.4)] {
        world.spawn((
            lamp.clone(),
            Material::emissive(8.0 * color),
            Light { shadow: true, ..Light::point(color) },
            Transform::IDENTITY,
            Orbits,
        ));
    }
    let view = Transform::from_xyz(0.0, 2.6, 6.0).looking_at(DVec3::new(0.0, 0.6, 0.0), DVec3::Y);
    world.spawn((Camera::default(), view, Bloom::default()));
    world
}

/// This program's own device, which Lumbre is handed.
fn device(instance: wgpu::Instance, surface: Option<&wgpu::Surface<'_>>) -> Result<Gpu, Anything> {
    let options = wgpu::RequestAdapterOptions { compatible_surface: surface, ..Default::default() };
    let adapter = pollster::block_on(instance.request_adapter(&options))?;
    let descriptor = wgpu::DeviceDescriptor {
        label: Some("own program"),
        required_features: adapter.features() & Gpu::OPTIONAL_FEATURES,
        required_limits: adapter.limits(),
        ..Default::default()
    };
    let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))?;
    Ok(Gpu::from_parts(instance, adapter, device, queue)?)
}

/// The scene with a renderer that has both effects, and the schedule that draws it.
fn game(gpu: Gpu) -> (World, Schedule) {
    let mut world = scene();
    world.insert_resource(
        Renderer::builder().with(BloomEffect::default()).with(OutlineEffect::new(3.0)).build(&gpu),
    );
    world.insert_resource(gpu);
    let mut schedule = Schedule::default();
    schedule.add_systems((orbit, render_frame).chain());
    (world, schedule)
}

/// Runs the schedule once; what the frame said.
fn draw(world: &mut World, schedule: &mut Schedule) -> Result<(), Anything> {
    world.resource_mut::<Time>().0 += 1.0 / 60.0;
    schedule.run(world);
    match world.remove_resource::<LastFrame>() {
        Some(LastFrame(Err(error))) => Err(error.into()),
        _ => Ok(()),
    }
}

fn picture(path: &PathBuf) -> Result<(), Anything> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
    let (mut world, mut schedule) = game(device(instance, None)?);
    let frame = Offscreen::new(world.resource::<Gpu>(), 960, 540, OffscreenFormat::Rgba8)?;
    world.insert_resource(CurrentTarget(frame.target()));
    draw(&mut world, &mut schedule)?;
    frame.save_png(world.resource::<Gpu>(), path)?;
    println!("{}", path.display());
    Ok(())
}

struct Game {
    frames: Option<u64>,
    drawn: u64,
    window: Option<OpenGame>,
    failed: Option<Anything>,
}

struct OpenGame {
    window: Arc<Window>,
    surface: WindowSurface,
    world: World,
    schedule: Schedule,
}

impl OpenGame {
    fn new(events: &ActiveEventLoop) -> Result<Self, Anything> {
        let window =
            Arc::new(events.create_window(Window::default_attributes().with_title("A program of its own"))?);
        let display = Box::new(events.owned_display_handle());
        let instance =
            wgpu::Instance::new(wgpu::InstanceDescriptor::new_with_display_handle_from_env(display));
        let surface = instance.create_surface(Arc::clone(&window))?;
        let gpu = device(instance, Some(&surface))?;
        let size = window.inner_size();
        let surface = WindowSurface::new(&gpu, surface, size.width, size.height)?;
        let (world, schedule) = game(gpu);
        Ok(Self { window, surface, world, schedule })
    }

    fn redraw(&mut self) -> Result<(), Anything> {
        let gpu = self.world.resource::<Gpu>().clone();
        if let Acquired::Frame(frame) = self.surface.acquire(&gpu) {
            self.world.insert_resource(CurrentTarget(frame.target.clone()));
            draw(&mut self.world, &mut self.schedule)?;
            frame.present(&gpu);
        }
        self.window.request_redraw();
        Ok(())
    }
}

impl ApplicationHandler for Game {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        match OpenGame::new(events) {
            Ok(game) => self.window = Some(game),
            Err(error) => {
                self.failed = Some(error);
                events.exit();
            }
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(game) = &mut self.window else { return };
        match event {
            WindowEvent::CloseRequested => events.exit(),
            WindowEvent::Resized(size) => {
                let gpu = game.world.resource::<Gpu>().clone();
                game.surface.resize(&gpu, size.width, size.height);
            }
            WindowEvent::RedrawRequested => {
                self.drawn += 1;
                let result = game.redraw();
                if result.is_err() || self.frames == Some(self.drawn) {
                    self.failed = result.err();
                    events.exit();
                }
            }
            _ => {}
        }
    }
}

fn main() -> Result<(), Anything> {
    let mut arguments = std::env::args().skip(1);
    let (first, second) = (arguments.next(), arguments.next());
    if first.as_deref() == Some("--picture") {
        return picture(&second.ok_or("--picture takes the name of a PNG file")?.into());
    }
    let frames = match (first.as_deref(), second) {
        (Some("--frames"), Some(count)) => Some(count.parse()?),
        (None, _) => None,
        _ => return Err("own_program takes --frames N or --picture FILE.png".into()),
    };
    let mut game = Game { frames, drawn: 0, window: None, failed: None };
    EventLoop::new()?.run_app(&mut game)?;
    match game.failed {
        Some(error) => Err(error),
        None => {
            println!("{} frames", game.drawn);
            Ok(())
        }
    }
}
