//! The device that everything is drawn with. Not a window: a surface is made from one in `window_surface`.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use bevy_ecs::resource::Resource;

use crate::RenderError;
use crate::worker_thread::WorkerThread;

/// A wgpu instance, adapter, device and queue, with the features that measuring needs where the adapter has them.
#[derive(Resource, Clone, Debug)]
pub struct Gpu {
    /// The instance.
    pub instance: wgpu::Instance,
    /// The adapter.
    pub adapter: wgpu::Adapter,
    /// The device.
    pub device: wgpu::Device,
    /// The queue.
    pub queue: wgpu::Queue,
    lost: Arc<AtomicBool>,
    fault: Arc<Mutex<Option<String>>>,
    worker_thread: Arc<WorkerThread>,
}

/// A field of `wgpu::Limits` by name, how it is read, and the least that will do.
type LeastLimit = (&'static str, fn(&wgpu::Limits) -> u64, u64);

/// What a frame binds at most, and the least that a device has to allow of it.
const LEAST_LIMITS: [LeastLimit; 4] = [
    ("max_bind_groups", |limits| u64::from(limits.max_bind_groups), 4),
    (
        "max_storage_buffers_per_shader_stage",
        |limits| u64::from(limits.max_storage_buffers_per_shader_stage),
        8,
    ),
    (
        "max_sampled_textures_per_shader_stage",
        |limits| u64::from(limits.max_sampled_textures_per_shader_stage),
        // Five of a material, one of baked light, the atlas of shadow maps; and eight tables where they are textures.
        15,
    ),
    ("max_uniform_buffer_binding_size", |limits| limits.max_uniform_buffer_binding_size, 1 << 16),
];

impl Gpu {
    /// Features that are used where a device has them, none of which is required: queries to measure with, shaders that count lights ([`Measure::Lights`](crate::Measure)), and
    /// blending and multisampling of 32-bit floats for frames of full precision.
    pub const OPTIONAL_FEATURES: wgpu::Features = wgpu::Features::TIMESTAMP_QUERY
        .union(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS)
        .union(wgpu::Features::TIMESTAMP_QUERY_INSIDE_PASSES)
        .union(wgpu::Features::PIPELINE_STATISTICS_QUERY)
        .union(wgpu::Features::VERTEX_WRITABLE_STORAGE)
        .union(wgpu::Features::SHADER_EARLY_DEPTH_TEST)
        .union(wgpu::Features::FLOAT32_BLENDABLE)
        .union(wgpu::Features::TEXTURE_ADAPTER_SPECIFIC_FORMAT_FEATURES);

    /// A device that a program has made for itself. `wgpu::Limits::default()` is enough, without any feature; storage buffers as large as the adapter
    /// allows let more objects and lights in.
    ///
    /// Its callbacks for a lost device and for uncaptured errors are set, so that [`check`](Self::check) and the renderer know of both. A program that sets
    /// callbacks of its own afterwards passes on what they are told to [`note_lost`](Self::note_lost) and [`note_error`](Self::note_error).
    ///
    /// # Errors
    /// [`RenderError::DeviceTooSmall`].
    pub fn from_parts(
        instance: wgpu::Instance,
        adapter: wgpu::Adapter,
        device: wgpu::Device,
        queue: wgpu::Queue,
    ) -> Result<Self, RenderError> {
        let limits = device.limits();
        for (limit, found, least) in LEAST_LIMITS {
            let found = found(&limits);
            if found < least {
                return Err(RenderError::DeviceTooSmall { limit, least, found });
            }
        }
        let (lost, fault, worker_thread) = Default::default();
        let gpu = Self { instance, adapter, device, queue, lost, fault, worker_thread };
        let noted = gpu.notes();
        gpu.device.set_device_lost_callback(move |reason, message| {
            tracing::warn!("the GPU device is lost ({reason:?}): {message}");
            noted.lost.store(true, Ordering::Relaxed);
        });
        let noted = gpu.notes();
        gpu.device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            tracing::error!("GPU error: {error}");
            noted.error(&error);
        }));
        Ok(gpu)
    }

    /// What callbacks may hold: the device itself would keep itself alive.
    fn notes(&self) -> Notes {
        Notes { lost: Arc::clone(&self.lost), fault: Arc::clone(&self.fault) }
    }

    /// Notes that the device is gone, for a program that is told so itself.
    pub fn note_lost(&self) {
        self.lost.store(true, Ordering::Relaxed);
    }

    /// Notes an error of the device, for a program that is told of it itself: the next [`check`](Self::check) answers with the first.
    pub fn note_error(&self, error: &wgpu::Error) {
        self.notes().error(error);
    }

    /// A device without a window. The environment variables of wgpu (`WGPU_BACKEND`, `WGPU_ADAPTER_NAME`) choose among several.
    ///
    /// # Errors
    /// [`RenderError::NoAdapter`], which says what to install, and [`RenderError::Device`].
    pub fn headless() -> Result<Self, RenderError> {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
        // OpenGL is asked only if nothing better is there: its libraries complain aloud where there is no display.
        let others = descriptor.backends & wgpu::Backends::SECONDARY;
        if descriptor.backends.intersects(wgpu::Backends::PRIMARY) {
            descriptor.backends &= wgpu::Backends::PRIMARY;
        }
        let first = Self::from_instance(wgpu::Instance::new(descriptor), None);
        if !matches!(first, Err(RenderError::NoAdapter { .. })) || others.is_empty() {
            return first;
        }
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
        descriptor.backends = others;
        // The first error is the one that tells what to install.
        Self::from_instance(wgpu::Instance::new(descriptor), None).or(first)
    }

    /// A device that can present to `surface`, which was made by `instance`.
    ///
    /// # Errors
    /// As [`Gpu::headless`].
    pub fn for_surface(instance: wgpu::Instance, surface: &wgpu::Surface<'_>) -> Result<Self, RenderError> {
        Self::from_instance(instance, Some(surface))
    }

    fn from_instance(
        instance: wgpu::Instance,
        surface: Option<&wgpu::Surface<'_>>,
    ) -> Result<Self, RenderError> {
        let adapter = find_adapter(&instance, surface)?;
        Self::from_adapter(instance, adapter)
    }

    /// Whether several devices of the adapter may work at once. Those of OpenGL take turns, and give up when one of them takes seconds.
    pub fn has_independent_devices(&self) -> bool {
        self.adapter.get_info().backend != wgpu::Backend::Gl
    }

    /// Another device of the same adapter.
    ///
    /// # Errors
    /// [`RenderError::Device`], [`RenderError::DeviceTooSmall`].
    pub fn another(&self) -> Result<Self, RenderError> {
        Self::from_adapter(self.instance.clone(), self.adapter.clone())
    }

    /// A device of an adapter that is known.
    pub(crate) fn from_adapter(
        instance: wgpu::Instance,
        adapter: wgpu::Adapter,
    ) -> Result<Self, RenderError> {
        let mut features = adapter.features() & Self::OPTIONAL_FEATURES;
        if adapter.get_info().device_type == wgpu::DeviceType::Cpu {
            // A software rasterizer draws a render pass tile by tile: a timestamp in the midst of it tells of the last tile alone.
            features.remove(wgpu::Features::TIMESTAMP_QUERY_INSIDE_PASSES);
        }
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("lumbre"),
            required_features: features,
            // The adapter's own limits: no light or object count is refused that the machine could take.
            required_limits: adapter.limits(),
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))?;
        Self::from_parts(instance, adapter, device, queue)
    }

    /// Whether a processor draws instead of a GPU.
    pub fn is_software(&self) -> bool {
        self.adapter.get_info().device_type == wgpu::DeviceType::Cpu
    }

    /// Whether the shaders of lit surfaces look things up in textures instead of storage buffers.
    pub(crate) fn reads_tables_from_textures(&self) -> bool {
        self.is_software()
    }

    /// Where pipelines are made that no frame waits for.
    pub(crate) fn worker_thread(&self) -> &WorkerThread {
        &self.worker_thread
    }

    /// Whether the device is gone: make another `Gpu` and another renderer.
    pub fn is_lost(&self) -> bool {
        self.lost.load(Ordering::Relaxed)
    }

    /// What the device refused since this was asked last (out of memory, or a fault of ours): the frame is not to be trusted.
    ///
    /// # Errors
    /// [`RenderError::DeviceLost`], [`RenderError::Refused`].
    pub fn check(&self) -> Result<(), RenderError> {
        if self.is_lost() {
            return Err(RenderError::DeviceLost);
        }
        let Some(message) = self.fault.lock().ok().and_then(|mut fault| fault.take()) else { return Ok(()) };
        // A device that goes refuses commands at once, and says that it is lost when its queue is empty: that is waited for.
        let timeout = Some(std::time::Duration::from_secs(1));
        let _ = self.device.poll(wgpu::PollType::Wait { submission_index: None, timeout });
        Err(if self.is_lost() { RenderError::DeviceLost } else { RenderError::Refused { message } })
    }

    /// Name and driver of the adapter, for reports: figures mean little without them.
    pub fn describe(&self) -> String {
        let info = self.adapter.get_info();
        format!("{} ({:?}, {} {})", info.name, info.backend, info.driver, info.driver_info)
    }
}

/// What was noted of a device.
struct Notes {
    lost: Arc<AtomicBool>,
    fault: Arc<Mutex<Option<String>>>,
}

impl Notes {
    fn error(&self, error: &wgpu::Error) {
        if let Ok(mut first) = self.fault.lock() {
            first.get_or_insert_with(|| error.to_string());
        }
    }
}

fn find_adapter(
    instance: &wgpu::Instance,
    surface: Option<&wgpu::Surface<'_>>,
) -> Result<wgpu::Adapter, RenderError> {
    let options = wgpu::RequestAdapterOptions {
        power_preference: wgpu::PowerPreference::HighPerformance,
        compatible_surface: surface,
        ..Default::default()
    };
    let named = std::env::var("WGPU_ADAPTER_NAME").ok().map(|name| name.to_lowercase());
    if let Some(name) = named {
        let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
        let fits = |adapter: &wgpu::Adapter| {
            adapter.get_info().name.to_lowercase().contains(&name)
                && surface.is_none_or(|surface| adapter.is_surface_supported(surface))
        };
        return adapters.into_iter().find(fits).ok_or(RenderError::NoAdapterNamed { name });
    }
    pollster::block_on(instance.request_adapter(&options)).map_err(|source| RenderError::NoAdapter { source })
}
