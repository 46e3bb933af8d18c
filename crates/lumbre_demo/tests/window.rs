//! The game in a window of a virtual X server: pictures with the overlay, a change of size, a lost device, recorded input.
//!
//! A window needs the main thread and an event loop of its own, so every scenario is a process: this program starts itself.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use lumbre_demo::{PlayOptions, Trial};

/// Says to a child process which scenario it is.
const SCENARIO: &str = "LUMBRE_WINDOW_SCENARIO";
/// Says to a child process where its picture goes.
const PICTURE: &str = "LUMBRE_WINDOW_PICTURE";
/// A folder to keep the pictures in, for looking at.
const KEEP: &str = "LUMBRE_WINDOW_KEEP";
const SIZE: (u32, u32) = (640, 400);

/// Looks at a scenario's picture.
type Judge = fn(&Path);
/// Every scenario by name, and how its picture is judged.
const SCENARIOS: [(&str, Judge); 5] = [
    ("overlay", picture_with_overlay),
    ("no overlay", picture_without_overlay),
    ("resize", picture_of_other_size),
    ("lost device", picture_with_overlay),
    ("recorded input", picture_with_overlay),
];

fn main() {
    if let Ok(scenario) = std::env::var(SCENARIO) {
        let picture = PathBuf::from(std::env::var_os(PICTURE).expect("the parent process sets it"));
        play(&scenario, &picture).expect("the window works");
        return;
    }
    let Some(server) = Server::start() else {
        eprintln!(
            "SKIPPED: Xvfb is not installed, no window was opened (Debian and Ubuntu: apt-get install xvfb)"
        );
        return;
    };
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (scenario, judge) in SCENARIOS {
        let picture = folder.path().join("picture.png");
        let status = Command::new(std::env::current_exe().expect("this program"))
            .env(SCENARIO, scenario)
            .env(PICTURE, &picture)
            .env("DISPLAY", &server.display)
            // Mesa complains without one.
            .env("XDG_RUNTIME_DIR", folder.path())
            .env_remove("WAYLAND_DISPLAY")
            .env_remove("WAYLAND_SOCKET")
            .status()
            .expect("this program starts");
        assert!(status.success(), "{scenario}: {status}");
        judge(&picture);
        if let Some(folder) = std::env::var_os(KEEP) {
            let kept = Path::new(&folder).join(format!("{scenario}.png"));
            std::fs::copy(&picture, kept).expect("the folder to keep pictures in");
        }
        std::fs::remove_file(&picture).expect("the picture was there");
        eprintln!("test {scenario} ... ok");
    }
}

fn play(scenario: &str, picture: &Path) -> anyhow::Result<()> {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let level = here.join("../../assets/demo.glb");
    let mut options = PlayOptions {
        size: SIZE,
        screenshot: Some(picture.to_owned()),
        quit_after: Some(10),
        ..PlayOptions::default()
    };
    match scenario {
        "no overlay" => options.input = Some(here.join("tests/walks/no_overlay.json")),
        "recorded input" => options.input = Some(here.join("tests/walks/hall_to_corridor.json")),
        "resize" => {
            options.trials =
                vec![(2, Trial::Resize(500, 300)), (4, Trial::Vanish), (4, Trial::Resize(420, 300))]
        }
        "lost device" => options.trials = vec![(3, Trial::LoseDevice), (5, Trial::LoseDevice)],
        _ => {}
    }
    lumbre_demo::run(&level, options)
}

fn open(path: &Path) -> image::RgbImage {
    image::open(path).expect("a picture").to_rgb8()
}

/// Light texels on the dark panel in the upper left, where the overlay writes.
fn letters(picture: &image::RgbImage) -> usize {
    let corner = picture.enumerate_pixels().filter(|(x, y, _)| *x < 330 && *y < 250);
    corner.filter(|(_, _, p)| p.0.iter().all(|&c| c > 120) && p.0.iter().max() == p.0.iter().min()).count()
}

/// The part of a picture that no overlay covers is neither black nor of one colour.
fn shows_the_level(picture: &image::RgbImage) {
    let right: Vec<u8> = picture
        .enumerate_pixels()
        .filter(|(x, _, _)| *x > picture.width() * 4 / 5)
        .map(|(_, _, p)| p.0[1])
        .collect();
    let (least, most) = (right.iter().min().expect("texels"), right.iter().max().expect("texels"));
    assert!(most - least > 30, "from {least} to {most}");
}

fn picture_with_overlay(path: &Path) {
    let picture = open(path);
    assert_eq!(picture.dimensions(), SIZE);
    shows_the_level(&picture);
    // A few hundred letters of some twenty grey texels each.
    assert!(letters(&picture) > 1000, "{} texels of letters", letters(&picture));
}

fn picture_without_overlay(path: &Path) {
    let picture = open(path);
    shows_the_level(&picture);
    assert!(letters(&picture) < 400, "{} texels of letters", letters(&picture));
}

fn picture_of_other_size(path: &Path) {
    let picture = open(path);
    assert_eq!(picture.dimensions(), (420, 300));
}

/// A virtual X server that ends with this value.
struct Server {
    process: Child,
    display: String,
}

impl Server {
    fn start() -> Option<Self> {
        // It chooses a free display itself and writes its number.
        let mut process = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1280x1024x24", "-nolisten", "tcp"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .ok()?;
        let mut number = String::new();
        let mut output = process.stdout.take()?;
        let mut byte = [0];
        while output.read(&mut byte).ok()? == 1 && byte != *b"\n" {
            number.push(char::from(byte[0]));
        }
        Some(Self { process, display: format!(":{number}") })
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
