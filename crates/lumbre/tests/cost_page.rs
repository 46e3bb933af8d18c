//! The page of a report with all studies in a browser: `scripts/cost_page`, where Chromium and what drives it are there. Elsewhere it is skipped, and says so.

#![allow(clippy::unwrap_used, reason = "helpers of tests, which clippy does not count as tests")]

use std::path::{Path, PathBuf};
use std::process::Command;

/// Where a program is, by the search path.
fn found(name: &str) -> Option<PathBuf> {
    let folders = std::env::var_os("PATH")?;
    std::env::split_paths(&folders).map(|folder| folder.join(name)).find(|path| path.is_file())
}

/// What is missing for a browser to be driven, if anything is.
fn missing(root: &Path) -> Option<String> {
    let browser = std::env::var_os("CHROMIUM").map(PathBuf::from).or_else(|| found("chromium"));
    if browser.is_none_or(|browser| !browser.exists()) {
        return Some("there is no Chromium (apt-get install chromium, or name one by CHROMIUM)".into());
    }
    if found("node").is_none() {
        return Some("there is no Node.js (apt-get install nodejs)".into());
    }
    let driver = root.join("integrations/cost_page/node_modules/playwright-core");
    (!driver.exists()).then(|| format!("{} is missing (npm ci in integrations/cost_page)", driver.display()))
}

#[test]
fn a_browser_clicks_through_the_page() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().unwrap();
    if let Some(why) = missing(&root) {
        // Where a build server has a browser, a test that skips is a fault.
        assert!(std::env::var_os("LUMBRE_REQUIRE_BROWSER").is_none(), "{why}");
        eprintln!("SKIPPED: the page was not looked at in a browser: {why}");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let report = folder.path().join("report");
    let asked = ["cost", "-o", report.to_str().unwrap(), "--quick", "--size", "64x40"];
    let lumbre = Command::new(env!("CARGO_BIN_EXE_lumbre")).args(asked).output().unwrap();
    assert!(lumbre.status.success(), "{}", String::from_utf8_lossy(&lumbre.stderr));
    let checked = Command::new(root.join("scripts/cost_page")).arg(&report).output().unwrap();
    let said =
        [&checked.stdout, &checked.stderr].map(|said| String::from_utf8_lossy(said).into_owned()).concat();
    assert!(checked.status.success(), "{said}");
    assert!(said.trim_end().ends_with(": 0 faults"), "{said}");
}
