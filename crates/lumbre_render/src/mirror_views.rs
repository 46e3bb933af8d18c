//! Chooses the views that the planar mirrors of a frame need: which mirrors are visible from where, directly
//! or in other mirrors, and what each contributes to its surface. How a view is drawn is in
//! `effects::mirrors`, its geometry in `extract::CameraView::reflected`.
//!
//! ```text
//!   camera ──┬── mirror A ──── mirror B in A        a tree: each view is its parent's reflection in a plane
//!            └── mirror B ──── mirror A in B        that the parent sees, and is drawn before the parent
//! ```

use glam::{DVec4, Vec3};
use lumbre_scene::SceneSettings;

use crate::FrameOptions;
use crate::draws::{Draws, VisibleObjects};
use crate::extract::{CameraView, MirrorData, MirrorSurface, Object, Objects, Window};
use crate::frame_plan::MirrorShape;
use crate::layout::radiance;
use crate::light_lists::ObjectLightLists;

/// Largest number of views in mirrors in a frame.
pub(crate) const MAX_VIEWS: usize = 16;
/// Mirrors in the same plane share a view. Their normals may differ by at most this much, as the sine of the
/// angle.
const SAME_DIRECTION: f64 = 1e-6;
/// Largest distance between such planes at the mirror's centre, relative to 1 m plus the radius of the
/// mirror's bounding sphere.
const SAME_PLACE: f64 = 1e-5;

/// The view in one plane of mirrors.
#[derive(Debug)]
pub(crate) struct MirrorView {
    /// The view that sees the mirrors: 0 is the camera's, 1 is the first view in a mirror.
    pub parent: usize,
    pub view: CameraView,
    pub mirrors: Vec<MirrorSurface>,
    /// What is drawn in it.
    pub draws: Draws,
}

impl MirrorView {
    /// Returns what effects need to know about it, in a frame of this size.
    pub fn shape(&self, size: [u32; 2]) -> MirrorShape {
        MirrorShape {
            parent: self.parent,
            pixels: self.view.window.pixels(size),
            transparent: !self.draws.transparent.is_empty(),
            surfaces: self.mirrors.clone(),
        }
    }
}

/// Settings that all mirrors of a frame share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MirrorLook {
    /// Whether back faces are drawn where materials ask for it.
    pub two_sided: bool,
    /// Whether what lies behind glass is drawn.
    pub refraction: bool,
    /// Background radiance.
    pub background: Vec3,
}

impl MirrorLook {
    pub fn new(settings: &SceneSettings, options: &FrameOptions) -> Self {
        Self {
            two_sided: settings.two_sided,
            refraction: options.refraction,
            background: radiance(SceneSettings::shown_background(settings)),
        }
    }
}

/// A plane of mirrors that a view sees.
struct SeenPlane {
    plane: DVec4,
    /// The part of the frame that its mirrors cover.
    window: Window,
    mirrors: Vec<MirrorSurface>,
    /// The largest fraction of light that it reflects to the camera, times the fraction of the frame that it
    /// covers.
    weight: f64,
}

/// Returns the views in the mirrors that the camera sees, in the mirrors that are visible in these, and so on
/// up to `depth` reflections; parents come before children. The draws are still empty. Beyond [`MAX_VIEWS`],
/// the views that matter least are left out together with those in them, and a message is added to
/// `left_out`.
pub(crate) fn mirror_views(
    objects: &Objects,
    camera: &CameraView,
    look: MirrorLook,
    depth: u32,
    left_out: &mut Vec<String>,
) -> Vec<MirrorView> {
    let mut views: Vec<MirrorView> = Vec::new();
    // The last generation: number, view, fraction of its light that reaches the camera, and the mirrors in
    // its plane.
    let mut generation = vec![(0, *camera, 1.0, Vec::new())];
    let mut without = 0;
    for _ in 0..depth {
        let seen = generation.iter().flat_map(|(parent, view, weight, own)| {
            let planes = seen_planes(objects, view, look, own);
            planes.into_iter().map(move |seen| (*parent, *view, seen.weight * weight, seen))
        });
        let mut seen: Vec<_> = seen.collect();
        seen.sort_by(|a, b| b.2.total_cmp(&a.2));
        let mut children = Vec::new();
        for (parent, view, weight, seen) in seen {
            let Some(reflected) = view.reflected(seen.plane, seen.window) else { continue };
            if views.len() == MAX_VIEWS {
                without += 1;
                continue;
            }
            let own = seen.mirrors.iter().map(|mirror| mirror.slot).collect();
            let (mirrors, draws) = (seen.mirrors, Draws::default());
            views.push(MirrorView { parent, view: reflected, mirrors, draws });
            children.push((views.len(), reflected, weight / seen.window.area().max(f64::MIN_POSITIVE), own));
        }
        generation = children;
    }
    if without > 0 {
        left_out.push(format!(
            "what {without} more mirrors show: a frame has {MAX_VIEWS} views of mirrors at most, those that cover most of it; let mirrors lie in one plane, or \
             lower `mirror_depth`"
        ));
    }
    views
}

/// Returns the planes of the mirrors that a view sees, except the mirrors that the view itself is reflected
/// in.
fn seen_planes(
    objects: &Objects,
    view: &CameraView,
    MirrorLook { two_sided, refraction, background }: MirrorLook,
    own: &[usize],
) -> Vec<SeenPlane> {
    let mut planes: Vec<SeenPlane> = Vec::new();
    let frustum = view.frustum(objects.origin);
    for (slot, object) in objects.iter() {
        let Some(mirror) = object.planar_mirror.filter(|_| !own.contains(&slot)) else { continue };
        let center = (object.center - objects.origin).extend(1.0);
        if frustum.iter().any(|plane| plane.dot(center) < -object.reach(*plane)) {
            continue;
        }
        let Some((plane, front)) = mirror.facing(view.viewer()) else { continue };
        let shown = front || (two_sided && object.traits.double_sided);
        let Some(window) = view.window_of_box(object.center, object.half_size).filter(|_| shown) else {
            continue;
        };
        let parallel = view.viewer().w == 0.0;
        let data = MirrorData::new(&mirror, plane, front, parallel, background);
        let surface = MirrorSurface { slot, refracts: refraction && object.traits.refracts, data };
        let weight = mirror.weight() * window.area();
        match planes.iter_mut().find(|seen| is_same_plane(seen.plane, plane, object)) {
            Some(seen) => {
                let both =
                    Window { low: seen.window.low.min(window.low), high: seen.window.high.max(window.high) };
                (seen.window, seen.weight) = (both, seen.weight + weight);
                seen.mirrors.push(surface);
            }
            None => planes.push(SeenPlane { plane, window, mirrors: vec![surface], weight }),
        }
    }
    planes
}

/// Returns true if a mirror of this object with plane `b` lies in plane `a`.
fn is_same_plane(a: DVec4, b: DVec4, object: &Object) -> bool {
    let apart = (a - b).dot(object.center.extend(1.0)).abs();
    a.truncate().dot(b.truncate()) > 0.0
        && a.truncate().cross(b.truncate()).length() < SAME_DIRECTION
        && apart < SAME_PLACE * (1.0 + object.radius)
}

/// Finds what is drawn in the views. `visible` returns what a view shows but for these mirrors, which are the
/// view's own, and `first_instance` is the number of instances of the frame before them.
pub(crate) fn draw_mirrors<'a>(
    views: &mut [MirrorView],
    first_instance: usize,
    lists: &mut ObjectLightLists,
    mut visible: impl FnMut(&CameraView, &[usize]) -> VisibleObjects<'a>,
) {
    let mut instances = first_instance;
    for view in views {
        let own: Vec<usize> = view.mirrors.iter().map(|surface| surface.slot).collect();
        let first = u32::try_from(instances).unwrap_or(u32::MAX);
        view.draws = Draws::new(visible(&view.view, &own), lists, first);
        instances += view.draws.instances.len();
    }
}
