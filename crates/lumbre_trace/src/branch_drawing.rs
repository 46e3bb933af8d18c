//! Output of a recorded ray tree: as indented text, as JSON, as a Graphviz graph, and as an SVG drawing of
//! the rays, with the names of what they meet, from above and from the side. The tree itself is in `branch`.

use std::fmt::Write;

use glam::{DVec2, DVec3};

use crate::branch::{Branch, Kind};

/// An output format of a ray tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TreeFormat {
    /// One line for each ray and for each of its terms.
    Text,
    /// All data of the tree as JSON.
    Json,
    /// A graph in Graphviz's language.
    Dot,
    /// An SVG drawing of the rays in space, from above and from the side.
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
pub fn draw_tree(tree: &Branch, format: TreeFormat) -> String {
    let mut out = String::new();
    let written = match format {
        TreeFormat::Text => text(&mut out, tree, 0),
        TreeFormat::Json => {
            // The tree holds only numbers, names and lists, which JSON can always represent.
            out = serde_json::to_string_pretty(tree).unwrap_or_default() + "\n";
            Ok(())
        }
        TreeFormat::Dot => dot(&mut out, tree),
        TreeFormat::Svg => svg(&mut out, tree),
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

fn escaped_markup(name: &str) -> String {
    let printable: String = name.chars().filter(|c| !c.is_control()).collect();
    printable.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Width and height of a view in pixels.
const SIDE: f64 = 480.0;
/// Margin around a view in pixels.
const MARGIN: f64 = 24.0;
/// Drawn length of a ray that hits nothing, as a fraction of the drawing.
const OPEN_RAY: f64 = 0.15;

fn svg(out: &mut String, tree: &Branch) -> std::fmt::Result {
    let mut points = Vec::new();
    ends(tree, &mut points);
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for point in &points {
        (low, high) = (low.min(*point), high.max(*point));
    }
    let size = (high - low).max_element().max(1e-9);
    let (width, height) = (2.0 * (SIDE + 2.0 * MARGIN), SIDE + 2.0 * MARGIN);
    writeln!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>"
    )?;
    let middle = 0.5 * (low + high);
    for (view, name, left) in [
        (0, "from above (x to the right, z down)", 0.0),
        (1, "from the side (z to the left, y up)", width / 2.0),
    ] {
        let project = |point: DVec3| {
            let off = (point - middle) / size * SIDE;
            let flat = if view == 0 { DVec2::new(off.x, off.z) } else { DVec2::new(-off.z, -off.y) };
            flat + DVec2::new(left + MARGIN + 0.5 * SIDE, MARGIN + 0.5 * SIDE)
        };
        writeln!(out, "<text x=\"{}\" y=\"16\">{name}</text>", left + MARGIN)?;
        svg_branch(out, tree, OPEN_RAY * size, &project)?;
    }
    writeln!(out, "</svg>")
}

fn ends(branch: &Branch, points: &mut Vec<DVec3>) {
    points.push(branch.origin);
    points.extend(branch.point.as_ref().map(|point| point.position));
    branch.branches.iter().for_each(|next| ends(next, points));
}

fn svg_branch(
    out: &mut String,
    branch: &Branch,
    open: f64,
    project: &impl Fn(DVec3) -> DVec2,
) -> std::fmt::Result {
    let end = match &branch.point {
        Some(point) => point.position,
        None => branch.origin + branch.direction * open,
    };
    let (from, to) = (project(branch.origin), project(end));
    let stroke = match branch.kind {
        Kind::Camera => "#202020",
        Kind::Mirrored => "#c03020",
        Kind::Transmitted => "#2060c0",
        Kind::Behind => "#808080",
    };
    let dashes = if branch.cut { " stroke-dasharray=\"3 3\"" } else { "" };
    let width = 0.5 + 2.0 * branch.weight.max_element().clamp(0.0, 1.0).sqrt();
    writeln!(
        out,
        "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"{stroke}\" stroke-width=\"{width:.2}\"{dashes}/>",
        from.x, from.y, to.x, to.y
    )?;
    if let Some(point) = &branch.point {
        let name = escaped_markup(&point.object);
        writeln!(out, "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"2.5\" fill=\"{stroke}\"/>", to.x, to.y)?;
        writeln!(
            out,
            "<text x=\"{:.1}\" y=\"{:.1}\" fill=\"{stroke}\">{name}</text>",
            to.x + 5.0,
            to.y - 4.0
        )?;
    }
    branch.branches.iter().try_for_each(|next| svg_branch(out, next, open, project))
}
