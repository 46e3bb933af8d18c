//! One number for the source of everything that a baked texel depends on, so that a checkpoint or a finished map of another baker is
//! told apart without anybody having to remember to count a version up: the sources of the project's own crates, and the versions and checksums
//! that the lock file names for all others.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// This crate.
const OWN: &str = "lumbre_bake";
/// What those of the project are called.
const PROJECT: &str = "lumbre_";

/// The sources.
pub struct Sources {
    /// Of all of them.
    pub hash: u64,
    /// Files and folders that they were read from.
    pub watched: Vec<PathBuf>,
}

impl Sources {
    /// Of the crate whose manifest is in `own`. In a workspace its lock file says on what that depends, and the sources of the project's crates lie
    /// beside this one. In a package of its own, where both are missing, its sources and its manifest count: the manifest names the versions.
    pub fn of(own: &Path) -> std::io::Result<Self> {
        let lock = ["Cargo.lock", "../../Cargo.lock"].map(|place| own.join(place));
        let lock = lock.into_iter().find(|place| place.is_file());
        let packages = match &lock {
            Some(place) => packages(&std::fs::read_to_string(place)?),
            None => BTreeMap::new(),
        };
        let needed = needed(&packages);
        let mut files = vec![("manifest".to_owned(), std::fs::read(own.join("Cargo.toml"))?)];
        let mut watched = vec![own.join("Cargo.toml")];
        watched.extend(lock);
        let mut crates = vec![OWN.to_owned()];
        crates.extend(needed.iter().filter(|name| name.starts_with(PROJECT) && *name != OWN).cloned());
        for name in &crates {
            let beside = if name == OWN { own.to_owned() } else { own.with_file_name(name) };
            let folder = beside.join("src");
            // Elsewhere the version stands for it.
            if folder.is_dir() {
                collect(&folder, &folder, name, &mut files)?;
                watched.push(folder);
            }
        }
        for name in &needed {
            for package in &packages[name] {
                files.push((format!("package {name}"), package.told.clone().into_bytes()));
            }
        }
        files.sort();
        // FNV-1a: mistakes are to be told apart here, not attacks.
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        for (name, text) in files {
            // Line ends differ between checkouts.
            let text = text.into_iter().filter(|byte| *byte != b'\r');
            for byte in name.bytes().chain([0]).chain(text).chain([0]) {
                hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
            }
        }
        Ok(Self { hash, watched })
    }
}

/// A package of a lock file.
#[derive(Default)]
struct Package {
    /// Its version, where it comes from, and its checksum.
    told: String,
    /// By name: of several versions each counts.
    dependencies: Vec<String>,
}

/// The packages of a lock file, by name.
fn packages(lock: &str) -> BTreeMap<String, Vec<Package>> {
    let mut packages: BTreeMap<String, Vec<Package>> = BTreeMap::new();
    for block in lock.split("[[package]]").skip(1) {
        let (mut name, mut package) = (String::new(), Package::default());
        for line in block.lines().map(str::trim) {
            match line.split_once(" = ") {
                Some(("name", value)) => name = value.trim_matches('"').to_owned(),
                Some(("version" | "source" | "checksum", value)) => package.told += value,
                Some(_) => {}
                // "name", or "name version" where there are several.
                None if line.starts_with('"') => {
                    let dependency = line.trim_matches(['"', ',']).split(' ').next().unwrap_or_default();
                    package.dependencies.push(dependency.to_owned());
                }
                None => {}
            }
        }
        packages.entry(name).or_default().push(package);
    }
    packages
}

/// The names of all packages on which this crate depends, itself among them.
fn needed(packages: &BTreeMap<String, Vec<Package>>) -> BTreeSet<String> {
    let mut needed = BTreeSet::new();
    let mut open = vec![OWN.to_owned()];
    while let Some(name) = open.pop() {
        let Some(versions) = packages.get(&name) else { continue };
        if needed.insert(name) {
            open.extend(versions.iter().flat_map(|package| package.dependencies.iter().cloned()));
        }
    }
    needed
}

fn collect(
    folder: &Path,
    root: &Path,
    name: &str,
    files: &mut Vec<(String, Vec<u8>)>,
) -> std::io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            collect(&path, root, name, files)?;
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let below = path.strip_prefix(root).unwrap_or(&path).to_string_lossy().replace('\\', "/");
            files.push((format!("{name}/{below}"), std::fs::read(&path)?));
        }
    }
    Ok(())
}
