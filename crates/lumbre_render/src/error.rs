//! The errors of drawing a frame.

/// Any error of an effect; [`RenderError::Effect`] carries it together with the effect's name.
pub type EffectError = Box<dyn std::error::Error + Send + Sync>;

/// Why a frame could not be drawn.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// No driver offers a device.
    #[error(
        "no graphics device: install a Vulkan driver (Debian and Ubuntu: `apt-get install mesa-vulkan-drivers`, which also \
         draws without a GPU) ({source})"
    )]
    NoAdapter {
        /// The error of wgpu, which lists what was tried.
        source: wgpu::RequestAdapterError,
    },
    /// The environment variable WGPU_ADAPTER_NAME matches no adapter.
    #[error(
        "no graphics device is named like `{name}` (WGPU_ADAPTER_NAME); unset it to take the default one"
    )]
    NoAdapterNamed {
        /// The name that was asked for.
        name: String,
    },
    /// The device could not be opened.
    #[error("the graphics device could not be opened: {0}")]
    Device(#[from] wgpu::RequestDeviceError),
    /// A device that was passed in has a lower limit than a frame needs.
    #[error(
        "the device's {limit} is {found}, and a frame needs {least}: ask for `wgpu::Limits::default()` or the adapter's own limits"
    )]
    DeviceTooSmall {
        /// The field of `wgpu::Limits`.
        limit: &'static str,
        /// What a frame needs.
        least: u64,
        /// What the device allows.
        found: u64,
    },
    /// The device is gone (driver reset, unplugged). A new `Gpu` and a new `Renderer` are needed.
    #[error("the graphics device is lost; create a new Gpu and Renderer")]
    DeviceLost,
    /// The device refused a command: it is out of memory, or this crate has a bug.
    #[error("the graphics device refused a command: {message}")]
    Refused {
        /// The device's error message.
        message: String,
    },
    /// A window's surface could not be created.
    #[error("the window gives no surface to draw on: {0}")]
    Surface(#[from] wgpu::CreateSurfaceError),
    /// The device cannot present to the surface.
    #[error("the graphics device `{adapter}` cannot present to this window")]
    SurfaceUnsupported {
        /// The adapter's name.
        adapter: String,
    },
    /// A viewport is empty or reaches beyond its texture.
    #[error(
        "the viewport of {} x {} texels at ({}, {}) does not lie within its target of {} x {}: give it a size of 1 or more, and keep it inside",
        size[0], size[1], origin[0], origin[1], texture[0], texture[1]
    )]
    Viewport {
        /// Column and row of its first texel.
        origin: [u32; 2],
        /// Its width and height.
        size: [u32; 2],
        /// Width and height of the texture.
        texture: [u32; 2],
    },
    /// The World has no camera.
    #[error("the World has no Camera: spawn one with `Camera::default()` and a Transform")]
    NoCamera,
    /// The entity that was asked for is not a camera.
    #[error("entity {entity} has no Camera and GlobalTransform")]
    NotACamera {
        /// The entity.
        entity: bevy_ecs::entity::Entity,
    },
    /// A camera has a value that cannot give a picture.
    #[error("camera {entity}: {field} is {value}; it must be {wanted}")]
    BadCamera {
        /// The entity.
        entity: bevy_ecs::entity::Entity,
        /// The field of `Projection`, of `Camera` or of the transform.
        field: &'static str,
        /// Its value.
        value: f64,
        /// The valid range.
        wanted: &'static str,
    },
    /// The frame is larger than the device's largest texture.
    #[error("a frame of {width}x{height} is beyond this device's {limit} texels; ask for a smaller one")]
    TargetTooLarge {
        /// Width in texels.
        width: u32,
        /// Height in texels.
        height: u32,
        /// The device's limit for either side.
        limit: u32,
    },
    /// An image's data does not match its size.
    #[error(
        "image `{name}`: {width}x{height} texels, but {found} values instead of {expected}; sizes start at 1"
    )]
    BadImage {
        /// Name of the image.
        name: String,
        /// Width in texels.
        width: u32,
        /// Height in texels.
        height: u32,
        /// Number of values that were found.
        found: usize,
        /// Number of values that the size requires.
        expected: u64,
    },
    /// The data exceeds the largest storage buffer, or the largest texture on devices that keep tables in
    /// textures.
    #[error("{what}: {bytes} bytes are beyond the {limit} that this device has room for; have fewer of them")]
    BufferTooLarge {
        /// What was to be stored.
        what: &'static str,
        /// Bytes needed.
        bytes: u64,
        /// Bytes that fit.
        limit: u64,
    },
    /// An emissive object has too many faces to be evaluated as polygon lights in reasonable time.
    #[error(
        "`{object}`: {faces} or more of its emissive faces would light other objects, beyond the limit of {limit}; give the lamp \
         a simpler mesh, or take its EmissiveLight (LUMBRE_object.emissiveLight) away and put a light in its place"
    )]
    TooManyEmissiveFaces {
        /// Name of the object.
        object: String,
        /// Number of polygons that its faces make, or a lower bound of it.
        faces: usize,
        /// The limit.
        limit: usize,
    },
    /// A shader variant does not compile. This is a bug in this crate, not in the scene.
    #[error("shader variant [{variant}]: {message}")]
    Shader {
        /// The features of the variant.
        variant: String,
        /// The compiler's error message.
        message: String,
    },
    /// An effect could not be prepared.
    #[error("effect `{effect}`: {source}")]
    Effect {
        /// Name of the effect.
        effect: &'static str,
        /// The effect's error.
        source: EffectError,
    },
    /// The frame needs a display pass, and the renderer has none.
    #[error(
        "the frame needs a display pass (several samples per pixel, blended surfaces, a viewport, the probe, or an effect between light and display ask for one), and the renderer was \
         built without one: leave `BuiltIn::Display` in, or add an effect at `Stage::Display`"
    )]
    NoDisplay,
    /// The render graph is invalid.
    #[error(transparent)]
    Graph(#[from] Box<lumbre_graph::GraphError>),
    /// The render graph failed while it ran.
    #[error(transparent)]
    Run(#[from] lumbre_graph::RunError),
    /// An image file could not be written.
    #[error("cannot write the picture {}: {source}", path.display())]
    Picture {
        /// The file.
        path: std::path::PathBuf,
        /// The error of the encoder.
        source: image::ImageError,
    },
    /// Reading a texture back failed.
    #[error("reading the frame back failed: {0}")]
    ReadBack(String),
}
