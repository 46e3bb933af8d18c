//! The robustness of `lumbre bake`: killed, interrupted, out of disk space, out of time, and run twice. The
//! light itself is tested in `lumbre_bake`.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "helpers of tests, which clippy does not count as tests")]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use bevy_ecs::world::World;
use glam::{DVec3, Vec3};
use lumbre::optics::{Material, Surface};
use lumbre::scene::{
    Camera, Lightmap, MaterialTextures, Mesh, MetallicRoughnessTexture, Name, StaticObject, TextureReference,
    Transform,
};

const LUMBRE: &str = env!("CARGO_BIN_EXE_lumbre");

/// Writes a level with a floor, a box and a lamp panel.
fn level(path: &Path, camera: f64) {
    level_with_box_at(path, camera, 0.0);
}

fn level_with_box_at(path: &Path, camera: f64, x: f64) {
    let mut world = World::new();
    let mut add = |size: Vec3, at: DVec3, material: Material| {
        let mesh = Mesh(Arc::new(lumbre::mesh::shapes::cuboid(size, 1)));
        world.spawn((mesh, material, StaticObject, Transform::from_xyz(at.x, at.y, at.z)));
    };
    add(Vec3::new(4.0, 0.2, 4.0), DVec3::Y * -0.1, Material::matt(Vec3::new(0.6, 0.5, 0.4)));
    add(Vec3::new(0.8, 1.0, 0.8), DVec3::new(x, 0.5, 0.0), Material::matt(Vec3::new(0.8, 0.2, 0.2)));
    let glow = Surface { emission: Vec3::splat(8.0), ..Surface::default() };
    add(Vec3::new(1.0, 0.1, 1.0), DVec3::Y * 3.0, Material { front: glow, ..Material::default() });
    let eye = Transform::from_xyz(0.0, 2.5, camera).looking_at(DVec3::ZERO, DVec3::Y);
    world.spawn((Camera::default(), eye));
    lumbre::scene::save(&mut world, path).unwrap();
}

/// A temporary folder with the level in it.
struct Place {
    folder: tempfile::TempDir,
    level: PathBuf,
    output: PathBuf,
}

fn place() -> Place {
    let folder = tempfile::tempdir().unwrap();
    let (input, output) = (folder.path().join("level.glb"), folder.path().join("baked").join("level.glb"));
    fs::create_dir(output.parent().unwrap()).unwrap();
    level(&input, 6.0);
    Place { folder, level: input, output }
}

impl Place {
    /// Returns the command, with two threads and maps of 48 x 48 texels.
    fn bake(&self, more: &[&str]) -> Command {
        self.bake_by(Command::new(LUMBRE), more)
    }

    /// Returns the same command with default signal handlers, as in a terminal. A process that a script runs
    /// in the background inherits an ignored SIGINT, and an interrupt that arrives before the program
    /// installs its handler would be lost.
    fn bake_with_signals(&self, more: &[&str]) -> Command {
        let mut command = Command::new("env");
        command.args(["--default-signal=INT,TERM", LUMBRE]);
        self.bake_by(command, more)
    }

    fn bake_by(&self, mut command: Command, more: &[&str]) -> Command {
        command.arg("bake").arg(&self.level).arg("-o").arg(&self.output);
        command.args(["--map-size", "48", "--error", "0.01", "--threads", "2"]).args(more);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    fn checkpoint(&self) -> PathBuf {
        self.output.with_file_name("level.glb.checkpoint")
    }

    /// Returns name and content of all files beside the output and in the folders there, except for the
    /// record, which contains times.
    fn files(&self) -> BTreeMap<String, Vec<u8>> {
        let output = self.output.parent().unwrap();
        let (mut files, mut folders) = (BTreeMap::new(), vec![output.to_owned()]);
        while let Some(folder) = folders.pop() {
            for path in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
                let name = path.strip_prefix(output).unwrap().to_str().unwrap().to_owned();
                if path.is_dir() {
                    folders.push(path);
                } else if name != "level.bake/record.json" {
                    // A file that is being written may be renamed in between.
                    files.extend(fs::read(&path).ok().map(|content| (name, content)));
                }
            }
        }
        files
    }
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn done(command: &mut Command) -> Output {
    let output = command.output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    output
}

/// Returns the files that an undisturbed bake writes.
fn expected() -> BTreeMap<String, Vec<u8>> {
    static EXPECTED: OnceLock<BTreeMap<String, Vec<u8>>> = OnceLock::new();
    let bake = || {
        let place = place();
        done(&mut place.bake(&[]));
        place.files()
    };
    let files = EXPECTED.get_or_init(bake);
    // Three maps in two formats each, the level, and the samples.
    assert!(
        files.len() == 8 && files.contains_key("level.bake/samples") && files.contains_key("level.glb"),
        "{:?}",
        files.keys()
    );
    files.clone()
}

#[test]
fn killed_again_and_again_it_ends_with_the_same_bytes() {
    let (expected, place) = (expected(), place());
    let length = || fs::metadata(place.checkpoint()).map_or(0, |about| about.len());
    let mut kills = 0;
    let last = loop {
        let before = length();
        let mut child = place.bake(&["--resume", "--checkpoint-every", "0.001"]).spawn().unwrap();
        // Kills the bake as soon as its checkpoint has grown.
        let ended = loop {
            if let Some(status) = child.try_wait().unwrap() {
                break Some(status);
            }
            // The first time right at the start.
            if (kills == 0 && place.checkpoint().exists()) || length() > before + 30_000 {
                break None;
            }
            std::thread::sleep(Duration::from_millis(1));
        };
        if ended.is_some() {
            break child.wait_with_output().unwrap();
        }
        // SIGKILL: the process cannot clean up.
        child.kill().unwrap();
        child.wait().unwrap();
        kills += 1;
        assert!(!place.output.exists(), "half a result under the final name");
    };
    assert!(last.status.success(), "{}", stderr(&last));
    assert!(kills >= 4, "only {kills} times was there a chance to kill it");
    assert!(place.files() == expected, "other bytes after {kills} kills: {:?}", place.files().keys());
}

#[test]
fn an_interruption_keeps_the_work_and_says_how_to_go_on() {
    let (expected, place) = (expected(), place());
    let child = place.bake(&["--checkpoint-every", "3600"]).spawn().unwrap();
    while !place.checkpoint().exists() {
        std::thread::sleep(Duration::from_millis(1));
    }
    let interrupt = ["-INT".to_owned(), child.id().to_string()];
    assert!(Command::new("kill").args(interrupt).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let said = stderr(&output);
    assert!(
        said.contains("interrupted") && said.contains("--resume") && said.contains("level.glb.checkpoint"),
        "{said}"
    );
    assert!(output.stdout.is_empty() && !place.output.exists());
    assert_eq!(place.files().len(), 1, "the checkpoint and nothing else");
    done(&mut place.bake(&["--resume"]));
    assert!(place.files() == expected);
}

#[test]
fn whenever_it_is_interrupted_it_ends_soon_and_goes_on_to_the_same_bytes() {
    let (expected, place) = (expected(), place());
    // The delays range from loading to saving, and beyond the end.
    for (delay, signal) in
        [(0, "-INT"), (10, "-TERM"), (40, "-INT"), (120, "-TERM"), (350, "-INT"), (900, "-INT")]
    {
        let mut child = place.bake_with_signals(&["--resume", "--quiet"]).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(delay));
        let told = Command::new("kill").args([signal.to_owned(), child.id().to_string()]).status().unwrap();
        let begun = std::time::Instant::now();
        // An idle machine takes a tenth of that time.
        while child.try_wait().unwrap().is_none() && begun.elapsed() < Duration::from_secs(5) {
            std::thread::sleep(Duration::from_millis(1));
        }
        let ended = child.try_wait().unwrap();
        child.kill().ok();
        assert!(ended.is_some(), "it still runs {:?} after {signal} at {delay} ms", begun.elapsed());
        println!("{signal} at {delay} ms ({told}): {ended:?} after {:?}", begun.elapsed());
    }
    done(&mut place.bake(&["--resume"]));
    assert!(place.files() == expected, "{:?}", place.files().keys());
}

#[test]
fn in_a_pipe_it_says_how_far_it_is_in_lines_and_quietly_nothing() {
    let said = |more: &[&str]| stderr(&done(&mut place().bake(more)));
    let is_progress = |line: &&str| line.starts_with("lumbre: ") && line.contains(" % of the bake) after ");
    let lines = said(&[]);
    assert_eq!(
        lines.lines().find(is_progress),
        Some("lumbre: layout: 0 % (0 % of the bake) after 0 s"),
        "{lines}"
    );
    assert!(!lines.contains('\r'), "a bar in a pipe: {lines}");
    let quiet = said(&["--quiet"]);
    assert_eq!(quiet.lines().find(is_progress), None, "{quiet}");
}

#[test]
fn an_unchanged_level_is_left_as_it_is() {
    let place = place();
    let first = done(&mut place.bake(&["--json"]));
    let written = || fs::metadata(&place.output).unwrap().modified().unwrap();
    let (files, time) = (place.files(), written());
    let again = |more: &[&str]| {
        let mut arguments = vec!["--json"];
        arguments.extend(more);
        let output = done(&mut place.bake(&arguments));
        (stderr(&output).contains("unchanged"), output)
    };
    let (unchanged, second) = again(&[]);
    assert!(unchanged && second.stdout == first.stdout, "{}", stderr(&second));
    assert!(place.files() == files && written() == time);
    assert!(again(&["--resume"]).0 && again(&["--time", "1000"]).0);

    // A lightmap that is truncated or missing is baked again.
    let map = files.keys().find(|name| name.ends_with(".exr")).unwrap();
    let map = place.output.with_file_name(map);
    let whole = fs::read(&map).unwrap();
    fs::write(&map, &whole[..whole.len() / 2]).unwrap();
    assert!(!again(&[]).0 && place.files() == files);
    fs::remove_file(&map).unwrap();
    assert!(!again(&[]).0 && place.files() == files);
    // An invalid record.
    fs::write(place.output.with_file_name("level.bake/record.json"), "{").unwrap();
    assert!(!again(&[]).0 && again(&[]).0);
    // The baked file also contains what the light does not depend on, such as cameras.
    level(&place.level, 7.0);
    assert!(!again(&[]).0 && place.files() != files);
    assert!(!again(&["--quality", "draft"]).0, "other options");
}

#[test]
fn lightmaps_have_a_folder_of_their_own_and_no_picture_outlives_its_node() {
    let place = place();
    let lightmaps = |more: &[&str]| {
        let mut command = Command::new(LUMBRE);
        command.arg("bake").arg(&place.level).arg("-o").arg(&place.output);
        done(command.args(["--texels-per-meter", "4", "--error", "0.1"]).args(more));
        let names = place.files().into_keys();
        names.filter_map(|name| Some(name.strip_prefix("level.lightmaps/")?.to_owned())).collect::<Vec<_>>()
    };
    assert_eq!(lightmaps(&["--atlas-size", "0", "--ktx2", "none"]), ["0.exr", "1.exr", "2.exr"]);
    // A file that somebody else has put there is kept.
    fs::write(place.output.with_file_name("level.lightmaps/1.exr"), "mine").unwrap();
    assert_eq!(lightmaps(&[]), ["1.exr", "atlas-1.exr", "atlas-1.ktx2"]);
    assert_eq!(fs::read(place.output.with_file_name("level.lightmaps/1.exr")).unwrap(), b"mine");
    let mut world = World::new();
    assert_eq!(lumbre::scene::load(&mut world, &place.output).unwrap().notes, []);
    assert_eq!(world.query::<&lumbre::scene::Lightmap>().iter(&world).count(), 3);
}

#[test]
fn direct_and_bounced_light_lie_beside_the_maps_when_asked_for() {
    let place = place();
    let bake = |more: &[&str]| done(place.bake(&["--ktx2", "none"]).args(more));
    let files = || {
        place.files().into_keys().filter_map(|name| Some(name.strip_prefix("level.lightmaps/")?.to_owned()))
    };
    bake(&["--separate-light"]);
    let expected = ["0", "1", "2"]
        .map(|map| ["bounced.", "direct.", ""].map(|light| format!("{map}.{light}exr")))
        .concat();
    assert_eq!(files().collect::<Vec<_>>(), expected);
    let texels = |name: &str| {
        let path = place.output.with_file_name("level.lightmaps").join(name);
        image::open(path).unwrap().into_rgb32f().into_raw()
    };
    for map in ["0", "1"] {
        let [whole, direct, bounced] =
            ["", "direct.", "bounced."].map(|light| texels(&format!("{map}.{light}exr")));
        assert!(direct.iter().any(|light| *light > 0.0) && bounced.iter().any(|light| *light > 0.0), "{map}");
        for ((whole, direct), bounced) in whole.iter().zip(direct).zip(bounced) {
            assert!(
                (direct + bounced - whole).abs() <= 2.0 * f32::EPSILON * whole,
                "{map}: {whole} {direct} {bounced}"
            );
        }
    }
    // Without the option, they are removed.
    bake(&[]);
    assert_eq!(files().collect::<Vec<_>>(), ["0.exr", "1.exr", "2.exr"]);
}

#[test]
fn a_box_that_moves_leaves_what_it_cannot_affect() {
    let place = place();
    done(&mut place.bake(&[]));
    let samples = place.output.with_file_name("level.bake/samples");
    let bake = |x: f64, more: &[&str]| {
        level_with_box_at(&place.level, 6.0, x);
        let mut arguments = vec!["--json"];
        arguments.extend(more);
        let output = done(&mut place.bake(&arguments));
        let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        (report["rebake"].clone(), stderr(&output))
    };
    let (rebake, _) = bake(0.2, &[]);
    assert_eq!(rebake["whole"], "", "{rebake}");
    let count = |of: &str| rebake[of].as_u64().unwrap();
    assert!(rebake["changed"].as_array().is_some_and(|changed| changed.len() == 1), "{rebake}");
    assert!(count("gathered") < count("texels") && count("relit") < count("texels"), "{rebake}");
    assert!(rebake["neglected"].as_f64().unwrap() < 0.01, "{rebake}");
    // The text report says the same.
    level_with_box_at(&place.level, 6.0, 0.3);
    let said = String::from_utf8(done(&mut place.bake(&[])).stdout).unwrap();
    assert!(
        said.contains("baked again what changed:") && said.contains("of the texels gathered anew"),
        "{said}"
    );

    // Damaged samples are not used, and a warning says so.
    let whole = fs::read(&samples).unwrap();
    fs::write(&samples, &whole[..whole.len() - 9]).unwrap();
    let (rebake, said) = bake(0.4, &[]);
    assert!(rebake.is_null(), "{rebake}");
    assert!(said.contains("level.bake/samples: it is damaged or cut short; everything is baked"), "{said}");
    assert!(bake(0.5, &[]).0["whole"] == "", "the next bake has samples again");
    let (rebake, _) = bake(0.6, &["--no-reuse"]);
    assert!(rebake.is_null() && !samples.exists(), "{rebake}");
}

#[test]
fn what_a_kill_in_the_midst_of_saving_leaves_goes_with_the_next_bake() {
    let (expected, place) = (expected(), place());
    // Kills the bake as soon as a file is being saved, repeatedly: some kills come too late, and the next
    // bake starts from the beginning.
    let saving = || place.files().into_keys().any(|name| name.ends_with(".partial") && name.starts_with('.'));
    let mut left = false;
    for _ in 0..20 {
        let _ = fs::remove_file(&place.output);
        let mut child = place.bake(&["--resume", "--checkpoint-every", "0.001"]).spawn().unwrap();
        while child.try_wait().unwrap().is_none() && !saving() {
            std::thread::yield_now();
        }
        child.kill().unwrap();
        child.wait().unwrap();
        left = saving();
        if left {
            break;
        }
    }
    if !left {
        // If the bake was always too quick, the leftover is created here.
        fs::write(place.output.with_file_name(".level.glb.77-0.partial"), "half").unwrap();
    }
    let _ = fs::remove_file(&place.output);
    done(&mut place.bake(&["--resume"]));
    assert!(place.files() == expected, "{:?}", place.files().keys());
}

#[test]
fn what_cannot_work_is_said_before_the_bake() {
    let place = place();
    let refused = |output: &Path, more: &[&str]| {
        let mut command = Command::new(LUMBRE);
        let output = command.arg("bake").arg(&place.level).arg("-o").arg(output).args(more).output().unwrap();
        assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
        stderr(&output)
    };
    let folder = place.folder.path().join("folder.glb");
    fs::create_dir(&folder).unwrap();
    assert!(refused(&folder, &[]).contains("this is a folder"));
    let missing = refused(&place.folder.path().join("no/such/level.glb"), &[]);
    assert!(missing.contains("there is no folder") && missing.contains("no/such"), "{missing}");
    let memory = refused(&place.output, &["--memory", "1MiB"]);
    assert!(memory.contains("would need") && memory.contains("lower the density"), "{memory}");
    assert!(place.files().is_empty(), "{:?}", place.files().keys());
    fs::write(place.checkpoint(), "mine").unwrap();
    assert!(refused(&place.output, &[]).contains("no checkpoint of Lumbre"));
    assert_eq!(fs::read(place.checkpoint()).unwrap(), b"mine");
}

#[test]
fn metals_are_counted() {
    let place = place();
    assert!(!stderr(&done(&mut place.bake(&[]))).contains("metal"));
    let mut world = World::new();
    let cube = Mesh(Arc::new(lumbre::mesh::shapes::cuboid(Vec3::ONE, 1)));
    let metal = Material::from_metallic_roughness(Vec3::new(0.6, 0.4, 0.3), 1.0, 1.0);
    world.spawn((cube.clone(), metal.clone(), StaticObject, Transform::default()));
    // By a texture, a mesh may be metal as a whole or in parts.
    for (blue, x) in [(255, 3.0), (0, -3.0)] {
        let rgba = vec![255, 255, 255, 255, 255, 255, blue, 255];
        let image = lumbre::scene::Image { name: "metal".into(), width: 2, height: 1, rgba };
        let slot = MetallicRoughnessTexture {
            texture: TextureReference::new(Arc::new(image)),
            base_color: Vec3::ONE,
            metallic: 1.0,
            roughness: 1.0,
            dielectric: Vec3::splat(0.04),
        };
        let textures = MaterialTextures { metallic_roughness: Some(slot), ..MaterialTextures::default() };
        world.spawn((cube.clone(), metal.clone(), textures, StaticObject, Transform::from_xyz(x, 0.0, 0.0)));
    }
    // Black plastic has no diffuse reflection, either.
    for (plastic, y) in [(Vec3::ONE, 3.0), (Vec3::ZERO, -3.0)] {
        let plastic = Material::from_metallic_roughness(plastic, 0.0, 0.5);
        world.spawn((cube.clone(), plastic, StaticObject, Transform::from_xyz(0.0, y, 0.0)));
    }
    lumbre::scene::save(&mut world, &place.level).unwrap();
    let said = stderr(&done(&mut place.bake(&["--sky", "1"])));
    assert!(said.contains("2 of 5 static meshes are metal"), "{said}");
}

/// A sky dome around a level would leave it black, and take most of its texels.
#[test]
fn unlit_meshes_neither_take_light_nor_block_it() {
    let place = place();
    let dome = |unlit| Material { unlit, double_sided: true, ..Material::matt(Vec3::splat(0.5)) };
    let level = |unlit: bool, with_floor: bool| {
        let mut world = World::new();
        let sphere = Mesh(Arc::new(lumbre::mesh::shapes::uv_sphere(20.0, 16, 8)));
        world.spawn((sphere, dome(unlit), StaticObject, Transform::default(), Name::new("dome")));
        if with_floor {
            let floor = Mesh(Arc::new(lumbre::mesh::shapes::cuboid(Vec3::new(4.0, 0.2, 4.0), 1)));
            world.spawn((floor, Material::matt(Vec3::splat(0.5)), StaticObject, Transform::default()));
        }
        lumbre::scene::save(&mut world, &place.level).unwrap();
    };
    level(true, true);
    let said = stderr(&done(&mut place.bake(&["--sky", "1"])));
    assert!(said.contains("1 of 2 static meshes are unlit"), "{said}");
    let mut world = World::new();
    lumbre::scene::load(&mut world, &place.output).unwrap();
    let mut maps = world.query::<(&Material, Option<&Lightmap>)>();
    for (material, map) in maps.iter(&world) {
        assert_eq!(map.is_none(), material.unlit);
    }
    // The top of the floor sees nothing but the sky, of radiance 1: E/π is 1, and nowhere is more.
    let mut maps = world.query::<&Lightmap>();
    let texels = maps.iter(&world).flat_map(|map| map.image.texels.clone());
    let brightest = texels.map(Vec3::max_element).fold(0.0, f32::max);
    assert!((brightest - 1.0).abs() < 0.01, "{brightest}");

    level(false, true);
    assert!(!stderr(&done(&mut place.bake(&["--sky", "1"]))).contains("unlit"));
    level(true, false);
    let refused = place.bake(&["--sky", "1"]).output().unwrap();
    assert!(!refused.status.success());
    let said = stderr(&refused);
    assert!(said.contains("every static mesh is unlit"), "{said}");
}

#[test]
fn a_folder_that_takes_no_files_is_said_before_the_bake() {
    use std::os::unix::fs::PermissionsExt;
    let place = place();
    let folder = place.folder.path().join("locked");
    fs::create_dir(&folder).unwrap();
    fs::set_permissions(&folder, fs::Permissions::from_mode(0o555)).unwrap();
    // Permissions do not apply to the superuser, but a file system of the kernel refuses files from
    // everybody.
    let binds = tempfile::tempfile_in(&folder).is_err();
    let folder = if binds { folder } else { PathBuf::from("/sys/kernel") };
    if !folder.is_dir() {
        eprintln!("SKIPPED: as the superuser, without /sys, every folder takes files");
        return;
    }
    let mut command = Command::new(LUMBRE);
    let output =
        command.arg("bake").arg(&place.level).arg("-o").arg(folder.join("level.glb")).output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let said = stderr(&output);
    assert!(said.contains("cannot be written to") && said.contains(&*folder.to_string_lossy()), "{said}");
    assert!(output.stdout.is_empty() && !folder.join("level.glb").exists());
}

#[test]
fn a_full_disk_leaves_nothing_half_written() {
    let (expected, place) = (expected(), place());
    let mut limited = Command::new("sh");
    // Writes beyond 4 or 8 KiB of a file fail, as on a full disk.
    limited.args(["-c", "trap '' XFSZ; ulimit -f 8; exec \"$0\" \"$@\"", LUMBRE, "bake"]);
    limited.arg(&place.level).arg("-o").arg(&place.output);
    limited.args(["--map-size", "48", "--error", "0.01", "--checkpoint-every", "0.001"]);
    let output = limited.output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let said = stderr(&output);
    assert!(said.contains("cannot write") && said.contains("--resume"), "{said}");
    let left = place.files();
    assert!(left.keys().all(|name| name == "level.glb.checkpoint"), "{:?}", left.keys());
    done(&mut place.bake(&["--resume"]));
    assert!(place.files() == expected);
}

#[test]
fn when_the_time_is_up_there_is_a_map_and_the_reason() {
    let place = place();
    let output = done(&mut place.bake(&["--time", "0.001", "--json"]));
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&report["ended"], &report["error_reached"]), (&"time".into(), &false.into()));
    let curve = report["curve"].as_array().unwrap();
    assert_eq!(curve.last().unwrap()["error"], report["estimated_error"]);
    assert_eq!(place.files().len(), 7, "without samples: {:?}", place.files().keys());
    // With the same time limit or less the result would not be better; without a limit it would.
    assert!(stderr(&done(&mut place.bake(&["--time", "0.0005"]))).contains("unchanged"));
    let more = done(&mut place.bake(&[]));
    assert!(!stderr(&more).contains("unchanged"));
    assert!(!String::from_utf8_lossy(&more.stdout).contains("the time ran out"));
}
