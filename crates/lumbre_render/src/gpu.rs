//! The wgpu device and what it was created from. Surfaces are created in `window_surface`.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock};

use bevy_ecs::resource::Resource;

use crate::RenderError;
use crate::worker_thread::WorkerThread;

/// A wgpu instance, adapter, device and queue. Devices that are opened here have the features for
/// measurements if the adapter supports them.
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
    /// Whether fragments can load records for each other, once `shared_records` has found out.
    record_sharing: Arc<OnceLock<bool>>,
}

/// A field of `wgpu::Limits`: its name, how to read it, and the least value that is sufficient.
type LeastLimit = (&'static str, fn(&wgpu::Limits) -> u64, u64);

/// The limits of a device that bound what a frame binds, with the least values that are required.
const MIN_LIMITS: [LeastLimit; 6] = [
    ("max_bind_groups", |limits| u64::from(limits.max_bind_groups), 4),
    (
        "max_storage_buffers_per_shader_stage",
        |limits| u64::from(limits.max_storage_buffers_per_shader_stage),
        8,
    ),
    (
        "max_sampled_textures_per_shader_stage",
        |limits| u64::from(limits.max_sampled_textures_per_shader_stage),
        // Five textures of a material, one of baked light, the shadow atlas and its planes, and eight tables where
        // these are textures.
        16,
    ),
    ("max_uniform_buffer_binding_size", |limits| limits.max_uniform_buffer_binding_size, 1 << 16),
    // What compute shaders light the G-buffer with.
    (
        "max_storage_textures_per_shader_stage",
        |limits| u64::from(limits.max_storage_textures_per_shader_stage),
        1,
    ),
    (
        "max_compute_invocations_per_workgroup",
        |limits| u64::from(limits.max_compute_invocations_per_workgroup),
        64,
    ),
];

impl Gpu {
    /// Features that are used if a device has them; none is required. They are queries for measurements,
    /// shaders that count lights ([`Measure::Lights`](crate::Measure)), subgroups in which the fragments of a
    /// software rasterizer load lights for each other, blending and multisampling of 32-bit floats for
    /// frames with full precision, and their filtering for lightmaps of 32-bit floats.
    pub const OPTIONAL_FEATURES: wgpu::Features = wgpu::Features::TIMESTAMP_QUERY
        .union(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS)
        .union(wgpu::Features::TIMESTAMP_QUERY_INSIDE_PASSES)
        .union(wgpu::Features::PIPELINE_STATISTICS_QUERY)
        .union(wgpu::Features::VERTEX_WRITABLE_STORAGE)
        .union(wgpu::Features::SHADER_EARLY_DEPTH_TEST)
        .union(wgpu::Features::SUBGROUP)
        .union(wgpu::Features::FLOAT32_BLENDABLE)
        .union(wgpu::Features::FLOAT32_FILTERABLE)
        .union(wgpu::Features::TEXTURE_ADAPTER_SPECIFIC_FORMAT_FEATURES);

    /// Wraps a device that a program has created itself. `wgpu::Limits::default()` without any feature is
    /// sufficient; a larger limit on storage buffers, such as the adapter's, allows more objects and lights.
    ///
    /// Sets the device's callbacks for a lost device and for uncaptured errors, so that
    /// [`check`](Self::check) and the renderer notice both. A program that installs its own callbacks
    /// afterwards must forward what they receive to [`note_lost`](Self::note_lost) and
    /// [`note_error`](Self::note_error).
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
        for (limit, found, least) in MIN_LIMITS {
            let found = found(&limits);
            if found < least {
                return Err(RenderError::DeviceTooSmall { limit, least, found });
            }
        }
        let (lost, fault, worker_thread, record_sharing) = Default::default();
        let gpu = Self { instance, adapter, device, queue, lost, fault, worker_thread, record_sharing };
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

    /// Returns what a callback may own: if it owned the device, the device would keep itself alive.
    fn notes(&self) -> Notes {
        Notes { lost: Arc::clone(&self.lost), fault: Arc::clone(&self.fault) }
    }

    /// Records that the device is lost, for a program with its own callback.
    pub fn note_lost(&self) {
        self.lost.store(true, Ordering::Relaxed);
    }

    /// Records an error of the device, for a program with its own callback. The next [`check`](Self::check)
    /// returns the first recorded error.
    pub fn note_error(&self, error: &wgpu::Error) {
        self.notes().error(error);
    }

    /// Opens a device without a window. The environment variables of wgpu (`WGPU_BACKEND`,
    /// `WGPU_ADAPTER_NAME`) choose among several.
    ///
    /// # Errors
    /// [`RenderError::NoAdapter`], whose message says what to install, [`RenderError::NoAdapterNamed`],
    /// [`RenderError::Device`] and [`RenderError::DeviceTooSmall`].
    pub fn headless() -> Result<Self, RenderError> {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
        // OpenGL is tried last: without a display its libraries print errors.
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
        // The first error is the one that says what to install.
        Self::from_instance(wgpu::Instance::new(descriptor), None).or(first)
    }

    /// Opens a device that can present to `surface`, which must have been created by `instance`.
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
        let features = useful_features(&adapter);
        Self::from_adapter(instance, adapter, features)
    }

    /// Returns true if several devices of the adapter can work at the same time. Devices of OpenGL take
    /// turns, and fail when one of them takes seconds.
    pub fn has_independent_devices(&self) -> bool {
        self.adapter.get_info().backend != wgpu::Backend::Gl
    }

    /// Opens another device of the same adapter, with the same features.
    ///
    /// # Errors
    /// [`RenderError::Device`], [`RenderError::DeviceTooSmall`].
    pub fn another(&self) -> Result<Self, RenderError> {
        Self::from_adapter(self.instance.clone(), self.adapter.clone(), self.device.features())
    }

    /// Opens a device of a given adapter with these features.
    pub(crate) fn from_adapter(
        instance: wgpu::Instance,
        adapter: wgpu::Adapter,
        features: wgpu::Features,
    ) -> Result<Self, RenderError> {
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("lumbre"),
            required_features: features,
            // The adapter's own limits, so that no scene is refused that the machine could handle.
            required_limits: adapter.limits(),
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))?;
        let gpu = Self::from_parts(instance, adapter, device, queue)?;
        if gpu.is_software() {
            keep_freed_memory();
        }
        Ok(gpu)
    }

    /// Returns true if the frames are drawn by a CPU instead of a GPU.
    pub fn is_software(&self) -> bool {
        self.adapter.get_info().device_type == wgpu::DeviceType::Cpu
    }

    /// Returns true if the shaders of lit surfaces read tables from textures instead of storage buffers.
    pub(crate) fn reads_tables_from_textures(&self) -> bool {
        self.is_software()
    }

    /// Whether fragments can load records for each other; see `shared_records`.
    pub(crate) fn record_sharing(&self) -> &OnceLock<bool> {
        &self.record_sharing
    }

    /// The thread that creates pipelines which no frame waits for.
    pub(crate) fn worker_thread(&self) -> &WorkerThread {
        &self.worker_thread
    }

    /// Returns true if the device is lost. A new `Gpu` and a new renderer are needed then.
    pub fn is_lost(&self) -> bool {
        self.lost.load(Ordering::Relaxed)
    }

    /// Reports the first error of the device since the last call (out of memory, or a bug in this crate).
    /// After an error the frame is not valid.
    ///
    /// # Errors
    /// [`RenderError::DeviceLost`], [`RenderError::Refused`].
    pub fn check(&self) -> Result<(), RenderError> {
        if self.is_lost() {
            return Err(RenderError::DeviceLost);
        }
        let Some(message) = self.fault.lock().ok().and_then(|mut fault| fault.take()) else { return Ok(()) };
        // A device that is being lost refuses commands at once, but reports the loss only when its queue is
        // empty, so wait for that.
        let timeout = Some(std::time::Duration::from_secs(1));
        let _ = self.device.poll(wgpu::PollType::Wait { submission_index: None, timeout });
        Err(if self.is_lost() { RenderError::DeviceLost } else { RenderError::Refused { message } })
    }

    /// Returns name and driver of the adapter, for reports of measurements.
    pub fn describe(&self) -> String {
        let info = self.adapter.get_info();
        format!("{} ({:?}, {} {})", info.name, info.backend, info.driver, info.driver_info)
    }
}

/// What the callbacks of a device record.
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

/// Returns the features of an adapter that a device is opened with.
fn useful_features(adapter: &wgpu::Adapter) -> wgpu::Features {
    let features = adapter.features() & Gpu::OPTIONAL_FEATURES;
    // A software rasterizer draws a render pass tile by tile, so a timestamp within it would cover the last
    // tile only. Only a software rasterizer gains by subgroups.
    match adapter.get_info().device_type {
        wgpu::DeviceType::Cpu => features - wgpu::Features::TIMESTAMP_QUERY_INSIDE_PASSES,
        _ => features - wgpu::Features::SUBGROUP,
    }
}

/// Makes glibc keep memory that is freed, instead of giving it back to the system and asking for it again. llvmpipe
/// allocates the vertices of every draw, and without this a frame of 64 balls spends .04 of its time on page faults.
/// When glibc frees a block that it had mapped by itself, it takes the block's size for the least that it maps so, and twice
/// that for the most that it keeps free (`M_MMAP_THRESHOLD` and `M_TRIM_THRESHOLD` in mallopt(3)); so freeing one of
/// 24 MiB is enough, and the pages of this one are never touched. That holds for the whole process, which then keeps up
/// to 48 MiB per heap. On 32-bit systems the block is too large to count, and where Rust does not allocate by glibc nothing
/// changes.
fn keep_freed_memory() {
    drop(std::hint::black_box(Vec::<u8>::with_capacity(24 << 20)));
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
