//! The explanation as a Graphviz graph. Boxes are passes, ellipses are versions of resources, frames around passes
//! are merged groups, and what does not run is dashed grey.

use std::collections::BTreeSet;
use std::fmt::Write;

use crate::explain::{Explanation, PassExplanation, Use};

pub(super) fn render(explanation: &Explanation) -> String {
    let mut text = String::new();
    // Writing to a String does not fail.
    let _ = writeln!(text, "digraph {} {{", quote(&explanation.graph));
    let _ = writeln!(text, "  rankdir=LR;\n  node [fontname=\"sans-serif\"];");
    let groups = explanation.passes.iter().filter_map(|pass| pass.group).max().map_or(0, |last| last + 1);
    for group in 0..groups {
        let members: Vec<&PassExplanation> =
            explanation.passes.iter().filter(|pass| pass.group == Some(group)).collect();
        if members.len() > 1 {
            let _ = writeln!(text, "  subgraph cluster_{group} {{\n    label=\"one render pass\";");
            for pass in members {
                render_pass(&mut text, pass);
            }
            let _ = writeln!(text, "  }}");
        } else {
            for pass in members {
                render_pass(&mut text, pass);
            }
        }
    }
    for pass in explanation.passes.iter().filter(|pass| pass.group.is_none()) {
        render_pass(&mut text, pass);
    }
    let mut versions = BTreeSet::new();
    for pass in &explanation.passes {
        let style = if pass.status.runs() { "" } else { ", style=dashed, color=grey" };
        for read in &pass.reads {
            versions.insert((&read.resource, read.version));
            edge(&mut text, &version_id(read, read.version), &pass_id(pass), &read.access, style);
        }
        for write in &pass.writes {
            versions.insert((&write.resource, write.version));
            edge(&mut text, &pass_id(pass), &version_id(write, write.version), &write.access, style);
            if write.version > 1 {
                let _ = writeln!(
                    text,
                    "  {} -> {} [style=dotted];",
                    version_id(write, write.version - 1),
                    version_id(write, write.version)
                );
            }
        }
    }
    for (resource, version) in versions {
        let id = quote(&format!("resource {resource} {version}"));
        let _ = writeln!(text, "  {id} [label={}];", quote(&format!("{resource} #{version}")));
    }
    text.push_str("}\n");
    text
}

fn render_pass(text: &mut String, pass: &PassExplanation) {
    let style = if pass.status.runs() { "" } else { ", style=dashed, color=grey" };
    let label = format!("{}\n{}: {}", pass.name, pass.status.word(), pass.status.reason());
    let _ = writeln!(text, "    {} [shape=box, label={}{style}];", pass_id(pass), quote(&label));
}

fn edge(text: &mut String, from: &str, to: &str, label: &str, style: &str) {
    let _ = writeln!(text, "  {from} -> {to} [label={}{style}];", quote(label));
}

fn pass_id(pass: &PassExplanation) -> String {
    quote(&format!("pass {}", pass.name))
}

fn version_id(used: &Use, version: u32) -> String {
    quote(&format!("resource {} {version}", used.resource))
}

/// A DOT string, with quotes, backslashes and line breaks escaped.
fn quote(text: &str) -> String {
    let escaped = text.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n");
    format!("\"{escaped}\"")
}
