//! An SVG drawing of a recorded ray tree: the rays, the names of what they meet, and the outlines of the objects
//! around them, from above and from the side. The outlines are found in `scene_outline`.

use std::collections::BTreeSet;
use std::fmt::Write;

use glam::{DVec2, DVec3};

use crate::branch::{Branch, Kind};
use crate::scene::Scene;
use crate::scene_outline::outline;

fn escaped_markup(name: &str) -> String {
    let printable: String = name.chars().filter(|c| !c.is_control()).collect();
    printable.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Width and height of a view in pixels.
const SIDE: f64 = 480.0;
/// Margin around a view in pixels.
const MARGIN: f64 = 24.0;
/// Room around the ends of the rays in which objects are drawn, as a fraction of the rays' extent.
const ROOM: f64 = 0.15;
/// Drawn length of a ray that hits nothing, as a fraction of the rays' extent.
const OPEN_RAY: f64 = 0.15;
/// Largest number of outline edges of one view, about 25 bytes each.
const MAX_EDGES: usize = 2000;
/// Edges that are drawn shorter than this, in pixels, are left out.
const SHORTEST: f64 = 0.5;

/// A parallel view.
struct Projection {
    name: &'static str,
    /// Axes in the world, unit vectors: to the right and downwards in the drawing, and away from the viewer.
    axes: [DVec3; 3],
    /// The point in the world at the middle of the view, and the view's place in the drawing.
    middle: DVec3,
    at: DVec2,
    /// Pixels per metre.
    scale: f64,
}

impl Projection {
    fn point(&self, point: DVec3) -> DVec2 {
        let off = (point - self.middle) * self.scale;
        self.at + DVec2::new(off.dot(self.axes[0]), off.dot(self.axes[1]))
    }
}

/// Writes the drawing.
pub(crate) fn svg(out: &mut String, scene: &Scene, tree: &Branch) -> std::fmt::Result {
    let mut points = Vec::new();
    ends(tree, &mut points);
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for point in &points {
        (low, high) = (low.min(*point), high.max(*point));
    }
    let extent = (high - low).max_element().max(1e-9);
    let (middle, half) = (0.5 * (low + high), (0.5 + ROOM) * extent);
    let (width, height) = (2.0 * (SIDE + 2.0 * MARGIN), SIDE + 2.0 * MARGIN);
    writeln!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>"
    )?;
    let mut met = BTreeSet::new();
    names(tree, &mut met);
    for (name, axes, left) in [
        ("from above (x to the right, z down)", [DVec3::X, DVec3::Z, DVec3::NEG_Y], 0.0),
        ("from the side (z to the left, y up)", [DVec3::NEG_Z, DVec3::NEG_Y, DVec3::NEG_X], width / 2.0),
    ] {
        let view = Projection {
            name,
            axes,
            middle,
            at: DVec2::new(left + MARGIN + 0.5 * SIDE, MARGIN + 0.5 * SIDE),
            scale: 0.5 * SIDE / half,
        };
        // The view is a square, but along the line of sight it shows only what is as deep as the rays.
        let depth = axes[2].abs();
        let around = half * (DVec3::ONE - depth) + (0.5 * (high - low) + ROOM * extent) * depth;
        let region = [middle - around, middle + around];
        svg_objects(out, scene, &view, region, &met)?;
        writeln!(out, "<text x=\"{}\" y=\"16\">{}</text>", left + MARGIN, view.name)?;
        svg_branch(out, tree, OPEN_RAY * extent, &view)?;
    }
    writeln!(out, "</svg>")
}

/// Draws the outlines: those of objects that rays meet in dark grey, the others in light grey. If there are too
/// many edges, the shortest are left out, of other objects first, and the drawing says so.
fn svg_objects(
    out: &mut String,
    scene: &Scene,
    view: &Projection,
    region: [DVec3; 2],
    met: &BTreeSet<&str>,
) -> std::fmt::Result {
    let mut edges: Vec<(bool, f64, [DVec2; 2])> = outline(scene, view.axes[2], region)
        .iter()
        .map(|edge| {
            let ends = edge.ends.map(|end| view.point(end));
            (met.contains(scene.objects[edge.object].name.as_str()), ends[0].distance(ends[1]), ends)
        })
        .filter(|edge| edge.1 >= SHORTEST)
        .collect();
    // Stable, so that the same scene always gives the same drawing.
    edges.sort_by(|a, b| b.0.cmp(&a.0).then(b.1.total_cmp(&a.1)));
    let left_out = edges.len().saturating_sub(MAX_EDGES);
    edges.truncate(MAX_EDGES);
    for (is_met, stroke) in [(false, "#d0d0d0"), (true, "#909090")] {
        let mut path = String::new();
        for (_, _, [from, to]) in edges.iter().filter(|edge| edge.0 == is_met) {
            write!(path, "M{:.1} {:.1}L{:.1} {:.1}", from.x, from.y, to.x, to.y)?;
        }
        if !path.is_empty() {
            writeln!(out, "<path d=\"{path}\" stroke=\"{stroke}\" stroke-width=\"0.7\" fill=\"none\"/>")?;
        }
    }
    if left_out > 0 {
        let (x, y) = (view.at.x - 0.5 * SIDE, view.at.y + 0.5 * SIDE + 14.0);
        writeln!(
            out,
            "<text x=\"{x}\" y=\"{y}\" fill=\"#909090\">without the {left_out} shortest edges of objects</text>"
        )?;
    }
    Ok(())
}

/// Collects the names of the objects that rays meet.
fn names<'t>(branch: &'t Branch, met: &mut BTreeSet<&'t str>) {
    met.extend(branch.point.as_ref().map(|point| point.object.as_str()));
    branch.branches.iter().for_each(|next| names(next, met));
}

fn ends(branch: &Branch, points: &mut Vec<DVec3>) {
    points.push(branch.origin);
    points.extend(branch.point.as_ref().map(|point| point.position));
    branch.branches.iter().for_each(|next| ends(next, points));
}

fn svg_branch(out: &mut String, branch: &Branch, open: f64, view: &Projection) -> std::fmt::Result {
    let end = match &branch.point {
        Some(point) => point.position,
        None => branch.origin + branch.direction * open,
    };
    let (from, to) = (view.point(branch.origin), view.point(end));
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
    branch.branches.iter().try_for_each(|next| svg_branch(out, next, open, view))
}
