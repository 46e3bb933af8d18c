//! One hash of the source code that a baked texel depends on: the sources of the project's own crates, and the versions
//! and checksums that the lock file states for all others. With it, checkpoints and maps of another version of the
//! baker are recognized without a version number that somebody would have to increment.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

const THIS_CRATE: &str = "lumbre_bake";
/// The prefix of the names of the project's crates.
const PROJECT_PREFIX: &str = "lumbre_";

/// The sources that a baked texel depends on.
pub struct Sources {
    pub hash: u64,
    /// The files and folders that were read; the build script has to run again when one of them changes.
    pub watched: Vec<PathBuf>,
}

impl Sources {
    /// Reads the sources of the crate whose manifest is in `crate_folder`. In a workspace, the lock file names the
    /// dependencies, and the sources of the project's other crates are in the folders beside this one. A package that
    /// was published by itself has neither: its sources and its manifest, which names the versions, are hashed.
    pub fn of(crate_folder: &Path) -> std::io::Result<Self> {
        let lock = ["Cargo.lock", "../../Cargo.lock"].map(|path| crate_folder.join(path));
        let lock = lock.into_iter().find(|path| path.is_file());
        let packages = match &lock {
            Some(path) => packages(&std::fs::read_to_string(path)?),
            None => BTreeMap::new(),
        };
        let dependencies = transitive_dependencies(&packages);
        let mut files = vec![("manifest".to_owned(), std::fs::read(crate_folder.join("Cargo.toml"))?)];
        let mut watched = vec![crate_folder.join("Cargo.toml")];
        watched.extend(lock);
        let mut crates = vec![THIS_CRATE.to_owned()];
        crates.extend(
            dependencies
                .iter()
                .filter(|name| name.starts_with(PROJECT_PREFIX) && *name != THIS_CRATE)
                .cloned(),
        );
        for name in &crates {
            let root =
                if name == THIS_CRATE { crate_folder.to_owned() } else { crate_folder.with_file_name(name) };
            let folder = root.join("src");
            // A crate whose sources are not there is represented by its version.
            if folder.is_dir() {
                collect(&folder, &folder, name, &mut files)?;
                watched.push(folder);
            }
        }
        for name in &dependencies {
            for package in &packages[name] {
                files.push((format!("package {name}"), package.identity.clone().into_bytes()));
            }
        }
        files.sort();
        // FNV-1a is enough: the hash has to reveal accidental changes, not attacks.
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        for (name, text) in files {
            // Line endings differ between checkouts.
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
    /// The concatenation of its version, source and checksum.
    identity: String,
    /// Names without versions: a dependency stands for all versions of that name in the lock file.
    dependencies: Vec<String>,
}

/// Parses a lock file and returns its packages by name; a name has several packages if several versions are in use.
fn packages(lock: &str) -> BTreeMap<String, Vec<Package>> {
    let mut packages: BTreeMap<String, Vec<Package>> = BTreeMap::new();
    for block in lock.split("[[package]]").skip(1) {
        let (mut name, mut package) = (String::new(), Package::default());
        for line in block.lines().map(str::trim) {
            match line.split_once(" = ") {
                Some(("name", value)) => name = value.trim_matches('"').to_owned(),
                Some(("version" | "source" | "checksum", value)) => package.identity += value,
                Some(_) => {}
                // A dependency is written as "name", or as "name version" if the name has several versions.
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

/// Returns the names of this crate and of all packages that it depends on, directly or indirectly.
fn transitive_dependencies(packages: &BTreeMap<String, Vec<Package>>) -> BTreeSet<String> {
    let mut dependencies = BTreeSet::new();
    let mut pending = vec![THIS_CRATE.to_owned()];
    while let Some(name) = pending.pop() {
        let Some(versions) = packages.get(&name) else { continue };
        if dependencies.insert(name) {
            pending.extend(versions.iter().flat_map(|package| package.dependencies.iter().cloned()));
        }
    }
    dependencies
}

/// Reads all Rust files below a folder. Each is named by the crate's name and its path relative to `root`.
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
            let relative = path.strip_prefix(root).unwrap_or(&path).to_string_lossy().replace('\\', "/");
            files.push((format!("{name}/{relative}"), std::fs::read(&path)?));
        }
    }
    Ok(())
}
