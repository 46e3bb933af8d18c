//! Describes the machine that a report is measured on.

use lumbre_render::Gpu;

use crate::Machine;

/// Returns the description of this machine with this device.
pub fn machine(gpu: &Gpu) -> Machine {
    let optimized = if cfg!(debug_assertions) { "development profile" } else { "release profile" };
    Machine {
        processor: processor(),
        threads: std::thread::available_parallelism().map_or(1, usize::from),
        system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
        adapter: gpu.describe(),
        version: format!("Lumbre {}, {optimized}, build {}", env!("CARGO_PKG_VERSION"), build()),
    }
}

/// Returns the first digits of a hash of the running program's file, by which two builds of one version are
/// told apart.
fn build() -> String {
    let program = std::env::current_exe().and_then(std::fs::read);
    program.map_or_else(|_| "unknown".to_owned(), |bytes| blake3::hash(&bytes).to_hex()[..12].to_owned())
}

/// Returns the name of the processor if the system states it in a file, as Linux does, and its architecture
/// otherwise.
fn processor() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let named = text.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    named.map_or_else(|| std::env::consts::ARCH.to_owned(), |(_, name)| name.trim().to_owned())
}
