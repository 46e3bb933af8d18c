//! What can go wrong between a World and a frame.

/// Any error of an effect, which [`RenderError::Effect`] carries with the effect's name.
pub type EffectError = Box<dyn std::error::Error + Send + Sync>;

/// Why there is no frame.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// No driver offers a device.
    #[error(
        "no graphics device: install a Vulkan driver (Debian and Ubuntu: `apt-get install mesa-vulkan-drivers`, which also \
         draws without a GPU) ({source})"
    )]
    NoAdapter {
        /// What wgpu tried.
        source: wgpu::RequestAdapterError,
    },
    /// WGPU_ADAPTER_NAME names none.
    #[error(
        "no graphics device is named like `{name}` (WGPU_ADAPTER_NAME); unset it to take the default one"
    )]
    NoAdapterNamed {
        /// The name asked for.
        name: String,
    },
    /// The device could not be opened.
    #[error("the graphics device could not be opened: {0}")]
    Device(#[from] wgpu::RequestDeviceError),
    /// A device that was handed in allows less than a frame binds.
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
    /// The device is gone (driver reset, unplugged): a new `Gpu` and `Renderer` are needed.
    #[error("the graphics device is lost; create a new Gpu and Renderer")]
    DeviceLost,
    /// The device refused a command: out of memory, or a fault of ours.
    #[error("the graphics device refused a command: {message}")]
    Refused {
        /// The device's words.
        message: String,
    },
    /// A window's surface could not be made.
    #[error("the window gives no surface to draw on: {0}")]
    Surface(#[from] wgpu::CreateSurfaceError),
    /// The surface and the device do not fit together.
    #[error("the graphics device `{adapter}` cannot present to this window")]
    SurfaceUnsupported {
        /// The adapter's name.
        adapter: String,
    },
    /// A viewport that is empty, or reaches beyond its texture.
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
    /// No camera to draw from.
    #[error("the World has no Camera: spawn one with `Camera::default()` and a Transform")]
    NoCamera,
    /// The entity asked for is no camera.
    #[error("entity {entity} has no Camera and GlobalTransform")]
    NotACamera {
        /// The entity.
        entity: bevy_ecs::entity::Entity,
    },
    /// A camera's numbers make no picture.
    #[error("camera {entity}: {field} is {value}; it must be {wanted}")]
    BadCamera {
        /// The entity.
        entity: bevy_ecs::entity::Entity,
        /// The field of `Projection` or the transform.
        field: &'static str,
        /// Its value.
        value: f64,
        /// Its range.
        wanted: &'static str,
    },
    /// Larger than the device's textures.
    #[error("a frame of {width}x{height} is beyond this device's {limit} texels; ask for a smaller one")]
    TargetTooLarge {
        /// Width in texels.
        width: u32,
        /// Height in texels.
        height: u32,
        /// The device's limit for either side.
        limit: u32,
    },
    /// A texture that is no picture.
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
        /// Values there are.
        found: usize,
        /// Values there should be.
        expected: u64,
    },
    /// More than a storage buffer holds, or a texture where tables are textures.
    #[error("{what}: {bytes} bytes are beyond the {limit} that this device has room for; have fewer of them")]
    BufferTooLarge {
        /// What was to be stored.
        what: &'static str,
        /// Bytes needed.
        bytes: u64,
        /// Bytes there are.
        limit: u64,
    },
    /// An emissive object makes more polygon lights than anyone would want to wait for.
    #[error(
        "`{object}`: {faces} or more of its emissive faces would light other objects, beyond the limit of {limit}; give the lamp \
         a simpler mesh, or take its EmissiveLight (LUMBRE_object.emissiveLight) away and put a light in its place"
    )]
    TooManyEmissiveFaces {
        /// Name of the object.
        object: String,
        /// Polygons that they make, at least.
        faces: usize,
        /// The limit.
        limit: usize,
    },
    /// A shader variant does not compile: a fault of ours, not of the scene.
    #[error("shader variant [{variant}]: {message}")]
    Shader {
        /// The features of the variant.
        variant: String,
        /// The compiler's words.
        message: String,
    },
    /// An effect could not be prepared.
    #[error("effect `{effect}`: {source}")]
    Effect {
        /// Its name.
        effect: &'static str,
        /// What it met.
        source: EffectError,
    },
    /// A frame that needs a display pass, by a renderer without one.
    #[error(
        "the frame needs a display pass (several samples per pixel, blended surfaces, a viewport, the probe, or an effect between light and display ask for one), and the renderer was \
         built without one: leave `BuiltIn::Display` in, or add an effect at `Stage::Display`"
    )]
    NoDisplay,
    /// The render graph refuses.
    #[error(transparent)]
    Graph(#[from] Box<lumbre_graph::GraphError>),
    /// The render graph fails while it runs.
    #[error(transparent)]
    Run(#[from] lumbre_graph::RunError),
    /// A picture could not be written.
    #[error("cannot write the picture {}: {source}", path.display())]
    Picture {
        /// The file.
        path: std::path::PathBuf,
        /// Why.
        source: image::ImageError,
    },
    /// Reading back failed.
    #[error("reading the frame back failed: {0}")]
    ReadBack(String),
}
