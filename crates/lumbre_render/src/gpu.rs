//! The device that everything is drawn with. Not a window: a surface is made from one in `window_surface`.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use crate::RenderError;

/// A wgpu instance, adapter, device and queue, with the features that measuring needs where the adapter has them.
#[derive(Clone, Debug)]
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
}

/// Features that are used where they exist: queries to measure with, and what full-precision frames need.
const WANTED: wgpu::Features = wgpu::Features::TIMESTAMP_QUERY
    .union(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS)
    .union(wgpu::Features::TIMESTAMP_QUERY_INSIDE_PASSES)
    .union(wgpu::Features::PIPELINE_STATISTICS_QUERY)
    .union(wgpu::Features::FLOAT32_BLENDABLE)
    .union(wgpu::Features::TEXTURE_ADAPTER_SPECIFIC_FORMAT_FEATURES);

impl Gpu {
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
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("lumbre"),
            required_features: adapter.features() & WANTED,
            // The adapter's own limits: no light or object count is refused that the machine could take.
            required_limits: adapter.limits(),
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))?;
        let lost = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&lost);
        device.set_device_lost_callback(move |reason, message| {
            tracing::warn!("the GPU device is lost ({reason:?}): {message}");
            flag.store(true, Ordering::Relaxed);
        });
        let fault = Arc::new(Mutex::new(None));
        let first = Arc::clone(&fault);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            tracing::error!("GPU error: {error}");
            if let Ok(mut first) = first.lock() {
                first.get_or_insert_with(|| error.to_string());
            }
        }));
        Ok(Self { instance, adapter, device, queue, lost, fault })
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
