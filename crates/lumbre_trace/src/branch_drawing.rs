//! Output of a recorded ray tree: as indented text, as JSON and as a Graphviz graph. The drawing of the rays in
//! the scene is in `branch_svg`, the tree itself in `branch`.

use std::fmt::Write;

use glam::DVec3;

use crate::branch::{Branch, Kind};
use crate::branch_svg::svg;
use crate::scene::Scene;

/// An output format of a ray tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TreeFormat {
    /// One line for each ray and for each of its terms.
    Text,
    /// All data of the tree as JSON.
    Json,
    /// A graph in Graphviz's language.
    Dot,
    /// An SVG drawing of the rays and the outlines of the objects around them, from above and from the side.
    Svg,
}

impl TreeFormat {
    /// All formats.
    pub const ALL: &'static [Self] = &[Self::Text, Self::Json, Self::Dot, Self::Svg];

    /// Returns the name used on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Text => "text",
            Self::Json => "json",
            Self::Dot => "dot",
            Self::Svg => "svg",
        }
    }

    /// Returns the format with that name on the command line, or `None` if there is none.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|choice| choice.name() == name)
    }
}

/// Returns the tree in a format, with a newline at its end.
pub(crate) fn draw_tree(scene: &Scene, tree: &Branch, format: TreeFormat) -> String {
    let mut out = String::new();
    let written = match format {
        TreeFormat::Text => text(&mut out, tree, 0),
        TreeFormat::Json => {
            // The tree holds only numbers, names and lists, which JSON can always represent.
            out = serde_json::to_string_pretty(tree).unwrap_or_default() + "\n";
            Ok(())
        }
        TreeFormat::Dot => dot(&mut out, tree),
        TreeFormat::Svg => svg(&mut out, scene, tree),
    };
    // Writing to a String cannot fail.
    debug_assert!(written.is_ok());
    out
}

fn color(value: DVec3) -> String {
    let channel = |value: f64| match value {
        0.0 => "0".to_owned(),
        value if (1e-3..1e4).contains(&value.abs()) => format!("{value:.4}"),
        value => format!("{value:.2e}"),
    };
    if value.x == value.y && value.y == value.z {
        return channel(value.x);
    }
    format!("({} {} {})", channel(value.x), channel(value.y), channel(value.z))
}

fn place(value: DVec3) -> String {
    format!("({:.3}, {:.3}, {:.3})", value.x, value.y, value.z)
}

fn text(out: &mut String, branch: &Branch, depth: usize) -> std::fmt::Result {
    let indent = "  ".repeat(depth);
    let kind = branch.kind.name();
    let weights = match branch.kind {
        Kind::Camera => String::new(),
        _ => format!(", times {}, counts {}", color(branch.factor), color(branch.weight)),
    };
    if branch.cut {
        return writeln!(out, "{indent}{kind}: cut off{weights}");
    }
    let Some(point) = &branch.point else {
        return writeln!(out, "{indent}{kind}: background {}{weights}", color(branch.radiance));
    };
    let side = if point.front { "front" } else { "back" };
    writeln!(
        out,
        "{indent}{kind}: {} ({side}) at {}, {:.4} m through {} (index {:.3}){weights}",
        point.object,
        place(point.position),
        point.distance,
        point.medium,
        point.index
    )?;
    for term in terms(branch) {
        writeln!(out, "{indent}  {term}")?;
    }
    for next in &branch.branches {
        text(out, next, depth + 1)?;
    }
    writeln!(out, "{indent}  = {}", color(branch.radiance))
}

/// Returns what the light at a branch's point is made up of, a line for each term and each lamp; the lines of
/// lamps are indented.
fn terms(branch: &Branch) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(point) = branch.point.as_ref().filter(|point| point.transmittance != DVec3::ONE) {
        lines.push(format!("left by the way: {}", color(point.transmittance)));
    }
    let Some(light) = &branch.light else { return lines };
    for (name, value) in [
        ("emission", light.emission),
        ("ambient", light.ambient),
        ("lightmap", light.baked),
        ("diffuse", light.diffuse),
        ("specular", light.specular),
        ("transmitted highlight", light.transmitted),
    ] {
        if value != DVec3::ZERO {
            lines.push(format!("+ {name} {}", color(value)));
        }
    }
    for lamp in &light.lights {
        let transmitted = match lamp.transmitted {
            DVec3::ZERO => String::new(),
            passing => format!(", transmitted {}", color(passing)),
        };
        lines.push(format!(
            "  {}: S = {}, diffuse {}, specular {}{transmitted}",
            lamp.light,
            color(lamp.visibility),
            color(lamp.diffuse),
            color(lamp.specular)
        ));
    }
    lines
}

fn dot(out: &mut String, tree: &Branch) -> std::fmt::Result {
    writeln!(out, "digraph rays {{\n  node [shape=box, fontname=\"sans-serif\"];\n  eye [shape=circle];")?;
    let mut count = 0;
    dot_branch(out, tree, "eye", &mut count)?;
    writeln!(out, "}}")
}

fn dot_branch(out: &mut String, branch: &Branch, parent: &str, count: &mut usize) -> std::fmt::Result {
    let own = format!("n{count}");
    *count += 1;
    let label = match (&branch.point, branch.cut) {
        (_, true) => "cut off".to_owned(),
        (None, false) => format!("background\\n{}", color(branch.radiance)),
        (Some(point), false) => {
            let side = if point.front { "front" } else { "back" };
            let mut lines = vec![
                format!("{} ({side})", point.object),
                place(point.position),
                format!("{:.4} m through {} (index {:.3})", point.distance, point.medium, point.index),
            ];
            lines.extend(terms(branch));
            lines.push(format!("I = {}", color(branch.radiance)));
            // The sequence \l ends a line that is aligned to the left.
            lines.iter().map(|line| escaped(line) + "\\l").collect()
        }
    };
    writeln!(out, "  {own} [label=\"{label}\"];")?;
    let kind = branch.kind.name();
    let weights = match branch.kind {
        Kind::Camera => kind.to_owned(),
        _ => format!("{kind}\\ntimes {}\\ncounts {}", color(branch.factor), color(branch.weight)),
    };
    let style = if branch.cut { ", style=dashed" } else { "" };
    writeln!(out, "  {parent} -> {own} [label=\"{weights}\"{style}];")?;
    for next in &branch.branches {
        dot_branch(out, next, &own, count)?;
    }
    Ok(())
}

fn escaped(name: &str) -> String {
    name.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', " ")
}
