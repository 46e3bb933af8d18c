//! The command line: its commands and options, and how their values are parsed. The doc comments of options
//! are their help texts.

use std::path::PathBuf;
use std::time::Duration;

use clap::{ArgGroup, Args, CommandFactory, Parser, Subcommand, ValueEnum};
use lumbre::cost::STUDIES;
use lumbre::demo::key_help;
use lumbre::optics::{FlatRule, NoShading, ReflectionModel, Shading};
use lumbre::render::{Display, RenderingPath};
use lumbre::scene::{FrameSettings, LightmapEncoding, PackedFormat, ShadowFilter};
use lumbre::trace::{Aov, DEFAULT_WEIGHT, Filter, Integrator, TreeFormat};

/// Lighting for games that tells you what it costs.
#[derive(Debug, Parser)]
#[command(
    name = "lumbre",
    version,
    args_conflicts_with_subcommands = true,
    after_help = "\
Examples:
  lumbre                                         play the demo level
  lumbre room.glb                                look at a file: turn it, walk in it, bake it at a key press
  lumbre bake room.glb -o room.baked.glb         bake its radiosity into lightmaps
  lumbre render room.baked.glb -o room.png       draw it without a window
  lumbre trace room.glb -o room.png              the same by ray tracing: mirrors, glass, shadows
  lumbre explain room.glb                        what it calls for, and what it does not
  lumbre cost -o report                          what accuracy costs in time, on this machine
  lumbre tune room.glb --frame-ms 16             the best settings within a time"
)]
pub struct Arguments {
    /// The command; without one, a file is opened in a window, or the demo level is played.
    #[command(subcommand)]
    pub command: Option<Command>,
    #[command(flatten)]
    pub play: Play,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Play a level, or view any glTF file; without a display, write a short tour of it to PNG files.
    #[command(after_help = play_help())]
    Play(Play),
    /// Bake radiosity into lightmaps.
    #[command(after_help = "\
Examples:
  lumbre bake room.glb -o room.baked.glb
  lumbre bake room.glb -o room.baked.glb --error 0.005 --time 120
  lumbre bake room.glb -o room.baked.glb --ktx2 b10g11r11
  lumbre bake box.glb -o box.baked.glb --map-size 256 --json > report.json")]
    Bake(Bake),
    /// Draw frames without a window.
    #[command(after_help = "\
Examples:
  lumbre render room.baked.glb -o room.png --size 1920x1080
  lumbre render ball.glb -o ball.exr --shading gouraud --display linear
  lumbre render room.glb -o room.png --frames 20 --timings times.json
  lumbre render room.glb -o room.png --frames 5 --timings account.txt --count-lights")]
    Render(Render),
    /// Trace rays: Whitted ray tracing with mirrors, glass and shadows, or path tracing of all light.
    #[command(after_help = "\
Examples:
  lumbre trace room.glb -o room.png --depth 8
  lumbre trace room.glb -o room.exr --integrator path --error 0.01
  lumbre trace room.glb -o room.exr --aov albedo,normal,depth,light:*
  lumbre trace room.glb -o room.exr --integrator path --error 0.001 --resume
  lumbre trace room.glb --pixel 640,360 --tree text
  lumbre trace room.glb --pixel 640,360 --tree svg > rays.svg")]
    Trace(Trace),
    /// Measure the difference between two pictures, in radiance and as perceived (FLIP).
    #[command(after_help = "\
Examples:
  lumbre compare traced.exr frame.exr
  lumbre compare traced.png frame.png -o heat.png --json")]
    Compare(Compare),
    /// Show what effects a scene calls for, which passes run, and why the others do not.
    #[command(
        after_help = "Examples:\n  lumbre explain room.glb\n  lumbre explain room.glb --measure\n  lumbre explain room.glb --format dot | dot -Tsvg > frame.svg"
    )]
    Explain(Explain),
    /// Measure what accuracy costs in time; writes a page with plots and pictures, and the same as JSON and
    /// CSV.
    #[command(after_help = cost_help())]
    Cost(Cost),
    /// Measure all ways to draw a level and find the one that keeps a time or an error; can write the level
    /// with it.
    #[command(after_help = "\
Examples:
  lumbre tune level.glb --frame-ms 16 -o level.tuned.glb
  lumbre tune level.glb --error 0.02")]
    Tune(Tune),
}

/// The keys of the window, and examples.
fn play_help() -> String {
    let keys = key_help();
    format!(
        "Keys:\n{keys}\nExamples:
  lumbre play
  lumbre play room.baked.glb
  lumbre play --headless --frames-dir tour"
    )
}

/// The studies, and examples.
fn cost_help() -> String {
    let studies: String =
        STUDIES.iter().map(|study| format!("  {:<15}{}\n", study.name, study.about)).collect();
    format!(
        "Studies:\n{studies}\nExamples:
  lumbre cost -o report --quick
  lumbre cost room.glb -o report --study effects --study bake
  lumbre cost -o report --resume
  lumbre cost --compare before/cost.json after/cost.json"
    )
}

/// Options for reading files.
#[derive(Args, Clone, Debug, Default)]
pub struct Reading {
    /// Refuse files with repairable faults, instead of repairing them with a note.
    #[arg(long)]
    pub strict: bool,
    /// Let a .gltf refer to files outside its own folder, below DIR.
    #[arg(long, value_name = "DIR")]
    pub root: Option<PathBuf>,
}

/// How the brightness of pictures is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// Metered from the frame.
    Auto,
    /// A fixed factor on radiance.
    Factor(f32),
}

#[derive(Args, Debug)]
pub struct Play {
    /// A .glb or .gltf file; without one, the demo level, which is baked if necessary.
    #[arg(value_name = "FILE", value_parser = gltf_file)]
    pub level: Option<PathBuf>,
    #[command(flatten)]
    pub reading: Reading,
    /// Factor on radiance, an exposure value like 12EV, or auto; without this, auto for lights in candela or
    /// lux that would be overexposed.
    #[arg(long, value_name = "auto|EV|X", value_parser = exposure, allow_negative_numbers = true)]
    pub exposure: Option<Exposure>,
    /// Leave a level without lights dark, instead of lighting it from the camera.
    #[arg(long)]
    pub no_default_light: bool,
    /// Write a tour to PNG files even if there is a display.
    #[arg(long)]
    pub headless: bool,
    /// Folder for the tour's frames.
    #[arg(long, value_name = "DIR", default_value = "frames")]
    pub frames_dir: PathBuf,
    /// Number of frames of the tour.
    #[arg(long, value_name = "N", default_value_t = 12, value_parser = clap::value_parser!(u32).range(1..=100_000), allow_negative_numbers = true)]
    pub frames: u32,
    /// Width and height of the tour's frames in pixels.
    #[arg(long, value_name = "WxH", default_value = "960x540", value_parser = size, allow_negative_numbers = true)]
    pub size: (u32, u32),
    /// Replay recorded input (JSON) instead of reading keyboard and mouse.
    #[arg(long, value_name = "FILE")]
    pub input: Option<PathBuf>,
    /// Record the input to this file (JSON), for --input.
    #[arg(long, value_name = "FILE")]
    pub record: Option<PathBuf>,
    /// Write the last frame with its overlay to a PNG file.
    #[arg(long, value_name = "FILE")]
    pub screenshot: Option<PathBuf>,
    /// Quit after this many frames.
    #[arg(long, value_name = "FRAMES", allow_negative_numbers = true)]
    pub quit_after: Option<u32>,
}

#[derive(Args, Debug)]
pub struct Bake {
    /// The level: .glb or .gltf.
    pub input: PathBuf,
    /// The baked level; its lightmaps are written beside it.
    #[arg(short, long, value_name = "OUT.glb")]
    pub output: PathBuf,
    #[command(flatten)]
    pub reading: Reading,
    /// Let the output replace the input, which then remains only as part of the baked file.
    #[arg(long)]
    pub overwrite: bool,
    /// Radiance of a uniform sky, W/(m² sr), instead of the level's own: one number, or red, green and blue.
    #[arg(long, value_name = "X|R,G,B", value_parser = sky, allow_negative_numbers = true)]
    pub sky: Option<glam::Vec3>,
    /// Estimated relative RMSE at which the lightmaps are good enough, like 0.01 or 1%.
    #[arg(long, default_value = "0.01", value_parser = share, allow_negative_numbers = true)]
    pub error: f64,
    /// Seconds after which no more samples are taken; the lightmaps are complete in any case.
    #[arg(long, value_name = "SECONDS", value_parser = seconds, allow_negative_numbers = true)]
    pub time: Option<Duration>,
    /// Texels per metre of surface; without this, chosen from the scene's area.
    #[arg(long, value_name = "X", value_parser = positive, allow_negative_numbers = true, conflicts_with = "map_size")]
    pub texels_per_meter: Option<f64>,
    /// Side of each mesh's own lightmap in texels.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(4..=8192), allow_negative_numbers = true)]
    pub map_size: Option<u32>,
    /// Continue an interrupted bake from its checkpoint, if there is one.
    #[arg(long)]
    pub resume: bool,
    /// Seconds between writes of the checkpoint, which is what a crash may lose.
    #[arg(long, value_name = "SECONDS", default_value = "2", value_parser = seconds, allow_negative_numbers = true)]
    pub checkpoint_every: Duration,
    /// Memory that the bake may use in addition to the level, like 512MiB or 2GB; it then uses fewer patches
    /// and rays.
    #[arg(long, value_name = "BYTES", value_parser = bytes, allow_negative_numbers = true)]
    pub memory: Option<u64>,
    /// Quality preset.
    #[arg(long, value_enum, default_value_t = BakeQuality::Final)]
    pub quality: BakeQuality,
    /// Number of worker threads; without this, one per core.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024), allow_negative_numbers = true)]
    pub threads: Option<u16>,
    /// Free texels between charts: 2 for bilinear filtering, 4 for bicubic.
    #[arg(long, value_name = "TEXELS", default_value_t = 2, value_parser = clap::value_parser!(u32).range(0..=64), allow_negative_numbers = true)]
    pub gap: u32,
    /// Let small meshes share atlases of at most N x N texels; 0 for none. Without this 2048, or 0 with
    /// --map-size.
    #[arg(long, value_name = "N", value_parser = atlas_size, allow_negative_numbers = true)]
    pub atlas_size: Option<u32>,
    /// Texels along a side of a patch, from 1 to 64: smaller patches exchange light in more detail [default:
    /// the quality's]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub patch_texels: Option<f32>,
    /// Leave the seams between charts visible.
    #[arg(long)]
    pub no_seams: bool,
    /// Also write every map's direct and bounced light, as MAP.direct.exr and MAP.bounced.exr beside it.
    #[arg(long)]
    pub separate_light: bool,
    /// Do not estimate the error due to the maps' resolution.
    #[arg(long)]
    pub no_resolution_error: bool,
    /// Bake everything again, including what has not changed since the output was baked, and keep no samples
    /// for the next bake.
    #[arg(long)]
    pub no_reuse: bool,
    /// How form factors are computed.
    #[arg(long, value_enum, default_value_t = BakeFormFactors::Cosine)]
    pub form_factors: BakeFormFactors,
    /// How the radiosity system is solved.
    #[arg(long, value_enum, default_value_t = BakeSolver::ConjugateGradients)]
    pub solver: BakeSolver,
    /// Format of the KTX2 images that are written beside the OpenEXR images, as Bevy reads them.
    #[arg(long, value_name = "rgb9e5|b10g11r11|none", default_value = "rgb9e5", value_parser = ktx2)]
    pub ktx2: Ktx2,
    /// Do not compress KTX2 images with Zstandard.
    #[arg(long)]
    pub ktx2_raw: bool,
    /// Format of the texels in OpenEXR images.
    #[arg(long, value_enum, default_value_t = ExrTexels::Float)]
    pub exr: ExrTexels,
    /// Whether light for moving objects is baked into probes.
    #[arg(long, value_enum, default_value_t = BakeProbes::Auto)]
    pub probes: BakeProbes,
    /// Largest distance between probes in metres; without this, chosen from the scene's size.
    #[arg(long, value_name = "X", value_parser = positive, allow_negative_numbers = true)]
    pub probe_spacing: Option<f64>,
    /// Print the report as JSON.
    #[arg(long)]
    pub json: bool,
    /// Do not show progress, neither as a bar nor, in a pipe, as a line every ten seconds.
    #[arg(long)]
    pub quiet: bool,
}

/// The format of KTX2 images; `None` writes none.
#[derive(Clone, Copy, Debug)]
pub struct Ktx2(pub Option<PackedFormat>);

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum BakeProbes {
    /// If the scene has moving objects.
    Auto,
    /// Even if nothing moves.
    Always,
    /// Never.
    Never,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum BakeFormFactors {
    /// Cosine-distributed rays from every patch.
    Cosine,
    /// Global lines distributed uniformly through the whole scene.
    Lines,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum BakeSolver {
    /// Conjugate gradients, which need the fewest iterations.
    ConjugateGradients,
    /// Gauss-Seidel: each patch uses results from earlier in the same sweep.
    GaussSeidel,
    /// Jacobi: each sweep adds one bounce.
    Jacobi,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum ExrTexels {
    /// 32 bits per channel.
    Float,
    /// 16 bits per channel: half the size, accurate to 1/2048 of each channel.
    Half,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum BakeQuality {
    /// For previews while the level is being built.
    Draft,
    /// For shipping.
    Final,
}

#[derive(Args, Debug)]
pub struct Render {
    /// The scene: .glb or .gltf, baked or not.
    pub input: PathBuf,
    #[command(flatten)]
    pub reading: Reading,
    /// The frame: .png (8 bits) or .exr (floats).
    #[arg(short, long, value_name = "OUT.png|OUT.exr")]
    pub output: PathBuf,
    /// Width and height in pixels.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = size, allow_negative_numbers = true)]
    pub size: (u32, u32),
    #[command(flatten)]
    pub frame: Frame,
    /// Draw this many frames and write the last one.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=100_000), allow_negative_numbers = true)]
    pub frames: u32,
    /// Write the measurements of each frame by stages, passes and effects: as JSON, or for .txt the last
    /// frame's as text.
    #[arg(long, value_name = "OUT.json|OUT.txt")]
    pub timings: Option<PathBuf>,
    /// Count the lights that each pass tests, and those that contribute more than 1/255; draws one more
    /// frame.
    #[arg(long, requires = "timings")]
    pub count_lights: bool,
}

#[derive(Args, Debug)]
pub struct Trace {
    /// The scene: .glb or .gltf, baked or not.
    pub input: PathBuf,
    #[command(flatten)]
    pub reading: Reading,
    /// The picture: .png (8 bits) or .exr (floats).
    #[arg(short, long, value_name = "OUT.png|OUT.exr", required_unless_present = "pixel")]
    pub output: Option<PathBuf>,
    /// Width and height in pixels.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = size, allow_negative_numbers = true)]
    pub size: (u32, u32),
    #[command(flatten)]
    pub frame: Frame,
    /// The algorithm: Whitted's ray tree, or paths, which find all light and report their noise.
    #[arg(long, value_name = "whitted|path", default_value = "whitted", value_parser = integrator)]
    pub integrator: Integrator,
    /// Largest number of mirrored and transmitted rays in succession; without this 5. For paths all
    /// reflections count, and without this only Russian roulette ends them.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=1000), allow_negative_numbers = true)]
    pub depth: Option<u32>,
    /// Rays of the ray tree with a smaller weight in the pixel are not traced.
    #[arg(long, value_name = "X", default_value_t = DEFAULT_WEIGHT, value_parser = weight, allow_negative_numbers = true)]
    pub weight: f64,
    /// Samples per pixel. The ray tree takes exactly this many (1 without this), paths at most this many, rounded
    /// up to a multiple of 4 (64, or as many as --error or --time need).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_048_576), allow_negative_numbers = true)]
    pub samples: Option<u32>,
    /// Relative standard error of the whole picture at which paths end, like 0.01 or 1%.
    #[arg(long, value_name = "X", value_parser = share, allow_negative_numbers = true)]
    pub error: Option<f64>,
    /// Seconds after which no more samples are started; the picture so far is written.
    #[arg(long, value_name = "SECONDS", value_parser = seconds, allow_negative_numbers = true)]
    pub time: Option<Duration>,
    /// Reconstruction filter: box, mitchell, blackman-harris.
    #[arg(long, value_name = "FILTER", default_value = "box", value_parser = filter)]
    pub filter: Filter,
    /// Take only a quarter of the samples where neighbouring pixels, as displayed, differ by less than this,
    /// 0 to 1.
    #[arg(long, value_name = "X", value_parser = positive, allow_negative_numbers = true)]
    pub adaptive: Option<f64>,
    /// Distribute paths over the pixels in proportion to their noise, with --samples of them per pixel on
    /// average.
    #[arg(long)]
    pub sample_by_noise: bool,
    /// Seed of the random numbers: pictures with different seeds have independent noise.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u32,
    /// Auxiliary pictures, as layers of an .exr, or as separate files beside a .png: albedo, normal, depth,
    /// rays, standard-error, direct, indirect, and light:NAME, direct:NAME, indirect:NAME for the light of one
    /// source; * as NAME for every source.
    #[arg(long, value_name = "NAME[,NAME…]", value_delimiter = ',', value_parser = aov, conflicts_with = "pixel")]
    pub aov: Vec<Aov>,
    /// Continue with the paths that an earlier run has kept in OUT.samples, if it exists, and keep them there
    /// at the end.
    #[arg(long, conflicts_with = "pixel")]
    pub resume: bool,
    /// Number of worker threads; without this, one per core.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024), allow_negative_numbers = true)]
    pub threads: Option<u16>,
    /// Print the ray tree of this pixel, counted from the upper left corner.
    #[arg(long, value_name = "X,Y", value_parser = pixel)]
    pub pixel: Option<(u32, u32)>,
    /// Format of the ray tree: text, json, dot for Graphviz, svg for a drawing of the rays.
    #[arg(long, value_name = "FORMAT", default_value = "text", value_parser = tree_format, requires = "pixel")]
    pub tree: TreeFormat,
    /// Print the report as JSON.
    #[arg(long, conflicts_with = "pixel")]
    pub json: bool,
    /// Do not show progress.
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Args, Debug)]
pub struct Compare {
    /// The reference: .png, .jpg or .exr.
    pub reference: PathBuf,
    /// The picture that is compared with it.
    pub test: PathBuf,
    /// File for a heat map of FLIP: black where there is no difference, white where it is largest.
    #[arg(short, long, value_name = "HEATMAP.png")]
    pub output: Option<PathBuf>,
    /// Print the results as JSON.
    #[arg(long)]
    pub json: bool,
}

#[derive(Args, Debug)]
pub struct Cost {
    /// Scenes to measure: .glb or .gltf; without any, the studies create their own.
    #[arg(value_name = "IN.glb", conflicts_with = "compare")]
    pub inputs: Vec<PathBuf>,
    /// Folder for the report: index.html, cost.json, cost.csv, pictures, scenes.
    #[arg(short, long, value_name = "DIR", required_unless_present = "compare", conflicts_with = "compare")]
    pub output: Option<PathBuf>,
    /// Fewer points, rounds and pixels: some 100 s of CPU time, most of it on both of two cores.
    #[arg(long)]
    pub quick: bool,
    /// Only count: nothing is timed or compared and no pictures are drawn, and the report is the same on
    /// every machine. For --compare without noise.
    #[arg(long)]
    pub counts_only: bool,
    /// Run only this study; can be given several times.
    #[arg(long = "study", value_name = "NAME")]
    pub studies: Vec<String>,
    /// Keep the studies that DIR already contains, if they have the same machine, scenes and settings.
    #[arg(long)]
    pub resume: bool,
    /// Width and height of the pictures in pixels; without this 480x270, or 240x135 with --quick.
    #[arg(long, value_name = "WxH", value_parser = picture_size, allow_negative_numbers = true)]
    pub size: Option<(u32, u32)>,
    /// Seed of everything that uses random numbers.
    #[arg(long, value_name = "N", default_value_t = 1, allow_negative_numbers = true)]
    pub seed: u32,
    /// Do not show progress.
    #[arg(long)]
    pub quiet: bool,
    /// Compare two reports instead; exit status 1 if a count or an error of the second is larger, or a point
    /// is missing.
    #[arg(long, num_args = 2, value_names = ["A.json", "B.json"], conflicts_with_all = ["quick", "counts_only", "studies", "resume", "size", "seed", "quiet"])]
    pub compare: Option<Vec<PathBuf>>,
    /// Counts and errors that differ by less than this factor count as equal. Times must also differ by more
    /// than two runs of one program do: by 1.8, beyond what all times of their study have in common.
    #[arg(long, value_name = "X", default_value = "1.1", value_parser = factor, conflicts_with = "output", allow_negative_numbers = true)]
    pub factor: f64,
    /// Exit with status 1 also for times that increased: those of single points, or of a whole study by more
    /// than 2.5.
    #[arg(long, conflicts_with = "output")]
    pub times: bool,
}

#[derive(Args, Debug)]
#[command(group(ArgGroup::new("goal").args(["frame_ms", "error"]).multiple(true)))]
pub struct Tune {
    /// The level: .glb or .gltf, baked or not.
    #[arg(value_name = "IN.glb")]
    pub input: PathBuf,
    /// Milliseconds that a frame may take at any of the level's cameras; the settings with the least error
    /// within them are chosen.
    #[arg(long, value_name = "MS", value_parser = positive, allow_negative_numbers = true)]
    pub frame_ms: Option<f64>,
    /// Relative RMSE that a frame may have compared with the most accurate settings (0.02 or 2%); without
    /// --frame-ms the fastest settings within it are chosen.
    #[arg(long, value_name = "ERROR", value_parser = share, allow_negative_numbers = true)]
    pub error: Option<f64>,
    /// File for the level with the chosen settings: its shading, its shadows, where its lamps end, samples
    /// per pixel, and its lightmaps, if fewer texels of them do.
    #[arg(short, long, value_name = "OUT.glb", requires = "goal")]
    pub output: Option<PathBuf>,
    /// Folder for a report, as of `lumbre cost`: all settings with picture, time and error.
    #[arg(long, value_name = "DIR")]
    pub report: Option<PathBuf>,
    /// Width and height of the frames in pixels; without this 1280x720, or 480x270 with --quick.
    #[arg(long, value_name = "WxH", value_parser = picture_size, allow_negative_numbers = true)]
    pub size: Option<(u32, u32)>,
    /// Fewer rounds with smaller frames.
    #[arg(long)]
    pub quick: bool,
    /// Do not show progress.
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Args, Debug)]
pub struct Explain {
    /// The scene: .glb or .gltf, baked or not.
    pub input: PathBuf,
    #[command(flatten)]
    pub reading: Reading,
    /// Output format.
    #[arg(long, value_enum, default_value_t = ExplainFormat::Text)]
    pub format: ExplainFormat,
    /// Also show what the scene does not call for, every pass and resource with its reason, and every shader
    /// variant.
    #[arg(long)]
    pub all: bool,
    /// Draw frames with and without each effect for about this many seconds, and show what each costs and how
    /// much it changes the picture.
    #[arg(long, value_name = "SECONDS", num_args = 0..=1, require_equals = true, default_missing_value = "10", value_parser = seconds, allow_negative_numbers = true)]
    pub measure: Option<Duration>,
    /// Width and height of the frame in pixels.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = size, allow_negative_numbers = true)]
    pub size: (u32, u32),
    #[command(flatten)]
    pub frame: Frame,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum ExplainFormat {
    /// Text for people.
    Text,
    /// JSON for programs.
    Json,
    /// A graph for Graphviz.
    Dot,
}

/// Options of how a frame is drawn.
#[derive(Args, Clone, Debug)]
pub struct Frame {
    /// Camera by name or index; without this the active or first one, or one that sees the whole scene if
    /// there is none.
    #[arg(long, value_name = "NAME|INDEX")]
    pub camera: Option<String>,
    /// Shading of every object, instead of the file's. auto:ERROR, like auto:0.01, chooses for each object
    /// the cheapest shading that is known in advance to differ from Phong shading by at most ERROR in any
    /// pixel, in exposed linear radiance between 0 and 1.
    #[arg(long, value_name = "flat|gouraud|phong|auto:ERROR", value_parser = shading)]
    pub shading: Option<Shading>,
    /// Specular model instead of the file's: phong, blinn, blinn-4n, blinn-matched, torrance-sparrow.
    #[arg(long, value_name = "MODEL", value_parser = reflection)]
    pub reflection: Option<ReflectionModel>,
    /// Point at which flat shading evaluates a polygon, instead of the file's.
    #[arg(long, value_name = "centroid|first-vertex|last-vertex", value_parser = flat_rule)]
    pub flat_rule: Option<FlatRule>,
    /// Filter highlights within pixels under Phong shading, or not, instead of as the file says.
    #[arg(long, value_name = "on|off", value_parser = on_or_off)]
    pub specular_antialiasing: Option<bool>,
    /// Light opaque surfaces as they are drawn (forward) or afterwards from a G-buffer, in fragment shaders
    /// (deferred) or in compute shaders (deferred-compute). auto (the default) chooses deferred where many lights meet small triangles,
    /// and deferred-compute there on a GPU. The picture is the same but for a few pixels of glass.
    #[arg(long, value_name = "auto|forward|deferred|deferred-compute", value_parser = rendering_path)]
    pub rendering_path: Option<RenderingPath>,
    /// Conversion from radiance to pixel values: srgb for viewing (the default for PNG), linear for unchanged
    /// radiance (for EXR), clamp as OpenGL does.
    #[arg(long, value_name = "linear|clamp|srgb", value_parser = display)]
    pub display: Option<Display>,
    /// Ignore lightmaps.
    #[arg(long)]
    pub no_lightmaps: bool,
    /// Show lightmaps with N times fewer texels along each side: each is the mean of those it replaces.
    #[arg(long, value_name = "N", default_value = "1", hide_default_value = true, value_parser = clap::value_parser!(u32).range(1..=64), allow_negative_numbers = true)]
    pub lightmap_reduction: u32,
    /// Format of lightmaps on the device, instead of the file's: f32, f16 or RGB9E5 (16, 8 or 4 bytes a texel).
    #[arg(long, value_name = "rgb32f|rgb16f|rgb9e5", value_parser = lightmap_format)]
    pub lightmap_format: Option<LightmapEncoding>,
    /// Ignore irradiance volumes; moving objects then get the scene's ambient light.
    #[arg(long)]
    pub no_irradiance_volumes: bool,
    /// Draw the shadows that lights ask for, whatever the file says.
    #[arg(long, conflicts_with = "no_shadows")]
    pub shadows: bool,
    /// Draw no shadows: every light reaches everything.
    #[arg(long)]
    pub no_shadows: bool,
    /// Lets every lamp cast a shadow, whether or not the file asks for one.
    #[arg(long, conflicts_with = "no_shadows")]
    pub every_shadow: bool,
    /// Leaves out an effect that the scene calls for, as `lumbre explain` names it, for example "fog" or
    /// "polygon lights". May be given several times.
    #[arg(long, value_name = "EFFECT")]
    pub without: Vec<String>,
    /// Largest number of reflections in flat mirrors: 1 shows a mirror, 2 (the default) a mirror in a mirror;
    /// 0 shows no reflections.
    #[arg(long, value_name = "N")]
    pub mirror_depth: Option<u32>,
    /// Draw transmissive surfaces opaque.
    #[arg(long)]
    pub no_refraction: bool,
    /// Take four samples per pixel, whatever the file says.
    #[arg(long)]
    pub msaa: bool,
    /// Take one sample per pixel, whatever the file says.
    #[arg(long, conflicts_with = "msaa")]
    pub no_msaa: bool,
    /// End lamps where a white surface that faces them gets less than this radiance, whatever the file says;
    /// 0 leaves the file's ranges.
    #[arg(long, value_name = "X", value_parser = threshold, allow_negative_numbers = true)]
    pub light_threshold: Option<f32>,
    /// Factor on the resolution of shadow maps along each side, from 0.0625 to 4, instead of the file's.
    #[arg(long, value_name = "X", value_parser = shadow_resolution, allow_negative_numbers = true)]
    pub shadow_resolution: Option<f32>,
    /// Filter of shadow maps, instead of the file's.
    #[arg(long, value_name = "hard|percentage-closer|soft", value_parser = shadow_filter)]
    pub shadow_filter: Option<ShadowFilter>,
    /// Factor on radiance, an exposure value like 12EV, or auto, instead of the camera's; without this, auto
    /// for a PNG with lights in candela or lux that would be overexposed.
    #[arg(long, value_name = "auto|EV|X", value_parser = exposure, allow_negative_numbers = true)]
    pub exposure: Option<Exposure>,
    /// Leave a scene without lights dark, instead of lighting it from the camera.
    #[arg(long)]
    pub no_default_light: bool,
}

/// Parses a file to open: one that exists or has the extension of glTF. Anything else is taken for a misspelt
/// command.
fn gltf_file(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let is_named_so = path
        .extension()
        .is_some_and(|extension| ["glb", "gltf"].iter().any(|known| extension.eq_ignore_ascii_case(known)));
    match is_named_so || path.exists() {
        true => Ok(path),
        false => {
            let arguments = Arguments::command();
            let commands: Vec<&str> = arguments.get_subcommands().map(clap::Command::get_name).collect();
            Err(format!("neither a .glb or .gltf file nor a command: {}", commands.join(", ")))
        }
    }
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("a number greater than 0 is wanted".into()),
    }
}

fn threshold(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(value) if value >= 0.0 && value.is_finite() => Ok(value),
        _ => Err("a finite number of at least 0 is wanted".into()),
    }
}

fn shadow_resolution(text: &str) -> Result<f32, String> {
    let [least, most] = FrameSettings::SHADOW_RESOLUTIONS;
    match text.parse::<f32>() {
        Ok(value) if (least..=most).contains(&value) => Ok(value),
        _ => Err(format!("a number from {least} to {most} is wanted")),
    }
}

fn shadow_filter(text: &str) -> Result<ShadowFilter, String> {
    let names: Vec<&str> = ShadowFilter::ALL.iter().map(|filter| filter.name()).collect();
    ShadowFilter::from_name(text).ok_or_else(|| format!("use one of {}", names.join(", ")))
}

fn lightmap_format(text: &str) -> Result<LightmapEncoding, String> {
    named(LightmapEncoding::from_name(text), LightmapEncoding::ALL.iter().map(|format| format.name()))
}

/// Parses a number, or a percentage.
fn share(text: &str) -> Result<f64, String> {
    match text.trim_end().strip_suffix('%') {
        Some(percent) => Ok(positive(percent.trim_end())? / 100.0),
        None => positive(text).map_err(|_| "a number greater than 0 is wanted, like 0.01 or 1%".into()),
    }
}

fn sky(text: &str) -> Result<glam::Vec3, String> {
    let channels: Result<Vec<f32>, _> =
        text.split(',').map(|channel| channel.trim().parse::<f32>()).collect();
    let color = match channels.as_deref() {
        Ok([all]) => glam::Vec3::splat(*all),
        Ok([red, green, blue]) => glam::Vec3::new(*red, *green, *blue),
        _ => glam::Vec3::NAN,
    };
    if color.is_finite() && color.min_element() >= 0.0 {
        Ok(color)
    } else {
        Err("one number that is at least 0 is wanted, or three like 0.4,0.6,1".into())
    }
}

fn seconds(text: &str) -> Result<Duration, String> {
    Duration::try_from_secs_f64(positive(text)?).map_err(|error| error.to_string())
}

fn bytes(text: &str) -> Result<u64, String> {
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let unit: u64 = match text[digits.len()..].to_ascii_lowercase().as_str() {
        "" | "b" => 1,
        "kib" => 1 << 10,
        "mib" => 1 << 20,
        "gib" => 1 << 30,
        "tib" => 1 << 40,
        "kb" => 1_000,
        "mb" => 1_000_000,
        "gb" => 1_000_000_000,
        "tb" => 1_000_000_000_000,
        _ => return Err("bytes are wanted, or KB, MB, GB, TB, KiB, MiB, GiB, TiB of them, like 2GB".into()),
    };
    let bytes = positive(digits.trim_end())? * unit as f64;
    // Beyond this, f64 cannot represent every number of bytes, and no machine has as many.
    if (1.0..=9e15).contains(&bytes) {
        Ok(bytes as u64)
    } else {
        Err("from 1 byte to 8000TiB are wanted".into())
    }
}

/// Parses `auto`, a factor like 0.5, or an exposure value at ISO 100 like 12EV, whose factor is 1 / (1.2 ·
/// 2^EV).
fn exposure(text: &str) -> Result<Exposure, String> {
    let wanted =
        || "auto is wanted, a factor greater than 0 like 0.5, or an exposure value like 12EV".to_owned();
    if text.eq_ignore_ascii_case("auto") {
        return Ok(Exposure::Auto);
    }
    let lower = text.to_ascii_lowercase();
    let factor = match lower.strip_suffix("ev") {
        Some(value) => {
            let value: f64 = value.trim_end().parse().map_err(|_| wanted())?;
            1.0 / (1.2 * value.exp2())
        }
        None => positive(text).map_err(|_| wanted())?,
    } as f32;
    if factor > 0.0 && factor.is_finite() { Ok(Exposure::Factor(factor)) } else { Err(wanted()) }
}

fn size(text: &str) -> Result<(u32, u32), String> {
    let sides = text.split_once(['x', 'X']).and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    match sides {
        Some((width, height)) if (1..=32_768).contains(&width) && (1..=32_768).contains(&height) => {
            Ok((width, height))
        }
        _ => Err("WxH is wanted, each from 1 to 32768, like 1280x720".into()),
    }
}

/// Parses a size that fits on a page and is large enough for FLIP.
fn picture_size(text: &str) -> Result<(u32, u32), String> {
    match size(text) {
        Ok((width, height)) if (8..=4096).contains(&width) && (8..=4096).contains(&height) => {
            Ok((width, height))
        }
        _ => Err("WxH is wanted, each from 8 to 4096, like 480x270".into()),
    }
}

fn factor(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value >= 1.0 && value.is_finite() => Ok(value),
        _ => Err("a number of at least 1 is wanted, like 1.1".into()),
    }
}

fn named<T>(found: Option<T>, all: impl Iterator<Item = &'static str>) -> Result<T, String> {
    found.ok_or_else(|| format!("one of {} is wanted", all.collect::<Vec<_>>().join(", ")))
}

fn shading(text: &str) -> Result<Shading, String> {
    text.parse().map_err(|unknown: NoShading| unknown.to_string())
}

fn reflection(text: &str) -> Result<ReflectionModel, String> {
    named(ReflectionModel::from_name(text), ReflectionModel::ALL.iter().map(|choice| choice.name()))
}

fn rendering_path(text: &str) -> Result<RenderingPath, String> {
    named(RenderingPath::from_name(text), RenderingPath::ALL.iter().map(|choice| choice.name()))
}

fn integrator(text: &str) -> Result<Integrator, String> {
    named(Integrator::from_name(text), Integrator::ALL.iter().map(|choice| choice.name()))
}

fn aov(text: &str) -> Result<Aov, String> {
    Aov::from_name(text).ok_or_else(|| {
        "there are albedo, normal, depth, rays, standard-error, direct, indirect, light:NAME, direct:NAME, indirect:NAME"
            .to_owned()
    })
}

fn filter(text: &str) -> Result<Filter, String> {
    named(Filter::from_name(text), Filter::ALL.iter().map(|choice| choice.name()))
}

fn tree_format(text: &str) -> Result<TreeFormat, String> {
    named(TreeFormat::from_name(text), TreeFormat::ALL.iter().map(|choice| choice.name()))
}

fn weight(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.0..=1.0).contains(&value) => Ok(value),
        _ => Err("a number from 0 to 1 is wanted, like 0.001".into()),
    }
}

fn pixel(text: &str) -> Result<(u32, u32), String> {
    let place =
        text.split_once(',').and_then(|(x, y)| Some((x.trim().parse().ok()?, y.trim().parse().ok()?)));
    place.ok_or_else(|| "X,Y is wanted, like 640,360".into())
}

fn flat_rule(text: &str) -> Result<FlatRule, String> {
    named(FlatRule::from_name(text), FlatRule::ALL.iter().map(|choice| choice.name()))
}

fn ktx2(text: &str) -> Result<Ktx2, String> {
    let formats = PackedFormat::ALL.into_iter().map(|format| (format.name(), Ktx2(Some(format))));
    let choices: Vec<_> = formats.chain([("none", Ktx2(None))]).collect();
    let found = choices.iter().find(|(name, _)| *name == text).map(|(_, choice)| *choice);
    named(found, choices.iter().map(|(name, _)| *name))
}

fn atlas_size(text: &str) -> Result<u32, String> {
    match text.parse() {
        Ok(side) if side == 0 || (16..=8192).contains(&side) => Ok(side),
        _ => Err("a number of texels from 16 to 8192 is wanted, or 0 for no atlases".into()),
    }
}

fn on_or_off(text: &str) -> Result<bool, String> {
    match text {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err("on or off is wanted".into()),
    }
}

fn display(text: &str) -> Result<Display, String> {
    named(Display::from_name(text), Display::ALL.iter().map(|choice| choice.name()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_read_with_their_units() {
        for (text, expected) in [
            ("4GiB", 4 << 30),
            ("512MiB", 512 << 20),
            ("1.5 GiB", 3 << 29),
            ("1000000", 1_000_000),
            ("64kib", 65_536),
            ("2GB", 2_000_000_000),
            ("1.5 kb", 1500),
        ] {
            assert_eq!(bytes(text), Ok(expected), "{text}");
        }
        for text in ["", "GiB", "-1GiB", "4GX", "0", "0.1", "inf", "NaN", "1e300TiB", "4 GiB 3"] {
            assert!(bytes(text).is_err(), "{text}");
        }
    }

    #[test]
    fn errors_are_numbers_or_percentages() {
        assert_eq!((share("0.02"), share("2%"), share("0.5 %")), (Ok(0.02), Ok(0.02), Ok(0.005)));
        for text in ["", "%", "-1%", "0%", "1%%", "nan%", "2 percent"] {
            assert!(share(text).is_err(), "{text}");
        }
    }

    #[test]
    fn exposures_are_factors_or_exposure_values() {
        assert_eq!(exposure("auto"), Ok(Exposure::Auto));
        assert_eq!(exposure("0.25"), Ok(Exposure::Factor(0.25)));
        assert_eq!(exposure("0EV"), Ok(Exposure::Factor(1.0 / 1.2)));
        assert_eq!(exposure("-1 ev"), Ok(Exposure::Factor(2.0 / 1.2)));
        for text in ["", "EV", "-1", "0", "inf", "nan", "1e300EV", "-1e300EV", "nanEV"] {
            assert!(exposure(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_sky_is_one_number_or_three() {
        assert_eq!(sky("0.5"), Ok(glam::Vec3::splat(0.5)));
        assert_eq!(sky("0.5, 1,2"), Ok(glam::Vec3::new(0.5, 1.0, 2.0)));
        for text in ["", "1,2", "-1", "nan", "1,2,3,4", "blue"] {
            assert!(sky(text).is_err(), "{text}");
        }
    }
}
