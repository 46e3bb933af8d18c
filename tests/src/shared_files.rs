//! Models and reference data beside the checkout, if there are any. They are not part of the project.

use std::path::PathBuf;

/// Returns the path of a shared file, or `None`, with a message, if it does not exist.
pub fn shared_file(name: &str) -> Option<PathBuf> {
    let path = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared")).join(name);
    if path.exists() {
        return Some(path);
    }
    eprintln!("SKIPPED: {name} is not there (the folder `shared` beside the checkout holds it)");
    None
}
