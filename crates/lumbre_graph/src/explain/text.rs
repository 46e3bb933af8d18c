//! The explanation as text: a table of passes, a table of resources, and the memory use.

use std::fmt::Write;

use crate::explain::{Explanation, PassExplanation, ResourceExplanation, Use};

pub(super) fn render(explanation: &Explanation) -> String {
    let mut text = String::new();
    let running = explanation.passes.iter().filter(|pass| pass.status.runs()).count();
    let groups = explanation.passes.iter().filter_map(|pass| pass.group).max().map_or(0, |last| last + 1);
    // Writing to a String does not fail.
    let _ = writeln!(
        text,
        "graph `{}`: {running} of {} passes run, in {groups} groups",
        explanation.graph,
        explanation.passes.len()
    );
    let width = explanation.passes.iter().map(|pass| pass.name.len()).max().unwrap_or(0);
    for pass in &explanation.passes {
        render_pass(&mut text, pass, width);
    }
    let _ = writeln!(text, "resources");
    let width = explanation.resources.iter().map(|resource| resource.name.len()).max().unwrap_or(0);
    for resource in &explanation.resources {
        render_resource(&mut text, resource, width);
    }
    let memory = &explanation.memory;
    let _ = writeln!(
        text,
        "memory: transients peak at {}, the pool provides {} (unshared: {}); retained {}",
        bytes(memory.peak_bytes),
        bytes(memory.pool_bytes),
        bytes(memory.unshared_bytes),
        bytes(memory.retained_bytes)
    );
    text
}

fn render_pass(text: &mut String, pass: &PassExplanation, width: usize) {
    let group = pass.group.map_or("-".into(), |group| group.to_string());
    // The owner is only mentioned if it differs from the pass's name, which it usually does not.
    let owner = pass.owner.as_ref().filter(|owner| **owner != pass.name);
    let owner = owner.map_or_else(String::new, |owner| format!(" ({owner}'s)"));
    let _ = writeln!(
        text,
        "  {group:>3} {:width$}  {:8}  {:9}  {}{owner}",
        pass.name,
        pass.kind.name(),
        pass.status.word(),
        pass.status.reason()
    );
    for (word, uses) in [("reads", &pass.reads), ("writes", &pass.writes)] {
        if !uses.is_empty() {
            let list: Vec<String> = uses.iter().map(render_use).collect();
            let _ = writeln!(text, "      {:width$}  {word} {}", "", list.join(", "));
        }
    }
}

fn render_use(used: &Use) -> String {
    let from = used.from.as_ref().map_or(String::new(), |from| format!(" of `{from}`"));
    format!("{}#{} ({}{from})", used.resource, used.version, used.access)
}

fn render_resource(text: &mut String, resource: &ResourceExplanation, width: usize) {
    let slot = resource.slot.map_or(String::new(), |slot| format!(", slot {slot}"));
    let lifetime = match resource.lifetime {
        Some([first, last]) => format!("groups {first}..{last}"),
        None => "unused".into(),
    };
    let _ = writeln!(
        text,
        "  {:width$}  {:?}  {}  {}  {lifetime}{slot}",
        resource.name,
        resource.origin,
        resource.shape,
        bytes(resource.bytes)
    );
}

/// Formats a number of bytes with one decimal and a binary unit.
fn bytes(count: u64) -> String {
    const UNITS: [&str; 5] = ["B", "KiB", "MiB", "GiB", "TiB"];
    let mut value = count as f64;
    let mut unit = 0;
    while value >= 1024.0 && unit + 1 < UNITS.len() {
        value /= 1024.0;
        unit += 1;
    }
    if unit == 0 { format!("{count} B") } else { format!("{value:.1} {}", UNITS[unit]) }
}

#[cfg(test)]
mod tests {
    use super::bytes;

    #[test]
    fn bytes_have_units() {
        assert_eq!(bytes(0), "0 B");
        assert_eq!(bytes(1023), "1023 B");
        assert_eq!(bytes(1536), "1.5 KiB");
        assert_eq!(bytes(8 << 20), "8.0 MiB");
        assert_eq!(bytes(u64::MAX), "16777216.0 TiB");
    }
}
