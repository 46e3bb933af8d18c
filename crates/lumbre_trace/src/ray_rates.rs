//! Measures how fast a picture's primary and shadow rays are found, compared with the bare triangle
//! hierarchy: the cost of alpha masks, exact surfaces, glass and f64. No light is evaluated.

use std::hint::black_box;
use std::time::Instant;

use glam::DVec3;
use lumbre_optics::{LightKind, LightSample, evaluate_light};
use lumbre_rays::Ray;

use crate::camera_ray::CameraRay;
use crate::direct_light::reach;
use crate::geometry::RayOrigin;
use crate::medium::MediumStack;
use crate::scene::Scene;
use crate::shadow_ray::{Glass, Target, transmittance};
use crate::surface_point::SurfacePoint;
use crate::view::{View, pixel_middle};

/// The rate of one kind of rays, on one thread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayRate {
    /// Number of rays.
    pub rays: usize,
    /// Number of rays that hit something or were blocked, as the tracer and as the hierarchy alone finds
    /// them.
    pub met: [usize; 2],
    /// Millions of rays per second of the tracer and of the hierarchy alone, each in its best round.
    pub millions_per_second: [f64; 2],
    /// The tracer's rate over the hierarchy's: the median over the rounds, each of which times both.
    pub ratio: f64,
}

/// The rates of a picture's rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayRates {
    /// Rays through the centres of all pixels, to the nearest surface.
    pub primary: RayRate,
    /// Rays from the points that these hit to every lamp above their horizon, without those about which the
    /// tracer and the hierarchy disagree.
    pub shadow: RayRate,
    /// Those of these rays that a picture takes: to lamps whose light reaches the point. Where they are few for each
    /// point, the offset of their origin from the surface counts for more.
    pub shadow_in_reach: RayRate,
}

impl RayRates {
    /// Measures the rates in `rounds` rounds.
    pub(crate) fn of(view: &View, rounds: usize) -> Self {
        let points = seen_points(view);
        Self {
            primary: primary_rate(view, rounds),
            shadow: ShadowRays::of(view, &points, |_| true).rate(&view.scene, rounds),
            shadow_in_reach: ShadowRays::of(view, &points, arrives).rate(&view.scene, rounds),
        }
    }
}

/// Returns the points that a picture's primary rays hit.
fn seen_points(view: &View) -> Vec<SurfacePoint> {
    let scene = &view.scene;
    let seen = |camera: &CameraRay| {
        let hit = scene.geometry.closest(&camera.ray, camera.farthest, |at| scene.is_seen(at))?;
        Some(SurfacePoint::new(scene, &camera.ray, &hit))
    };
    primary_rays(view).iter().filter_map(seen).collect()
}

fn primary_rays(view: &View) -> Vec<CameraRay> {
    let (width, height) = view.size();
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    pixels.map(|(x, y)| view.camera.through(pixel_middle(x, y))).collect()
}

fn primary_rate(view: &View, rounds: usize) -> RayRate {
    let (scene, geometry) = (&view.scene, &view.scene.geometry);
    let rays = primary_rays(view);
    let bare_rays: Vec<Ray> = rays.iter().map(|camera| camera.ray.for_triangles(camera.farthest)).collect();
    let sees = |camera: &CameraRay| {
        usize::from(geometry.closest(&camera.ray, camera.farthest, |at| scene.is_seen(at)).is_some())
    };
    let meets = |ray: &Ray| usize::from(geometry.hierarchy().closest_hit(ray).is_some());
    let tracer = || timed(&rays, RAYS_AT_HAND, sees);
    rate(rounds, rays.len(), tracer, || timed(&bare_rays, RAYS_AT_HAND, meets))
}

/// Returns true if a lamp's light reaches a point where nothing is in between.
fn arrives(sample: &LightSample) -> bool {
    sample.attenuation * sample.spot > 0.0
}

/// The shadow rays of a picture, as the tracer and as the bare hierarchy takes them.
#[derive(Default)]
struct ShadowRays<'a> {
    points: Vec<LitPoint<'a>>,
    /// The rays of each of these points.
    bare: Vec<Vec<Ray>>,
}

/// A point of a surface with the lamps to which it sends shadow rays. As in a picture, the origin of the rays is
/// prepared once for all of them.
#[derive(Clone)]
struct LitPoint<'a> {
    position: DVec3,
    geometric: DVec3,
    extent: f64,
    media: &'a MediumStack,
    lamps: Vec<LampAbove<'a>>,
}

/// A lamp above a point's horizon.
#[derive(Clone, Copy)]
struct LampAbove<'a> {
    /// Unit vector towards it.
    direction: DVec3,
    /// Metres; infinite for distant lights.
    distance: f64,
    bulbs: &'a [usize],
}

impl<'a> ShadowRays<'a> {
    /// Finds the rays from points to all lamps above their horizon that `wanted` takes.
    fn of(view: &'a View, points: &[SurfacePoint], wanted: impl Fn(&LightSample) -> bool) -> Self {
        let (scene, media) = (&view.scene, view.media());
        let hierarchy = scene.geometry.hierarchy();
        let mut rays = Self::default();
        for point in points {
            let origin = point.ray_origin();
            let (mut lamps, mut bare_rays) = (Vec::new(), Vec::new());
            for placed in scene.lights.iter().filter(|placed| placed.light.kind != LightKind::Ambient) {
                let sample = evaluate_light(&placed.light, placed.position, placed.axis, point.position);
                if sample.direction.dot(point.geometric) <= 0.0 || !wanted(&sample) {
                    continue;
                }
                let (direction, distance) = (sample.direction, reach(placed, point));
                let lamp = LampAbove { direction, distance, bulbs: &placed.bulbs };
                let ray = origin.towards(direction);
                let bare = match distance.is_finite() {
                    true => ray.between_triangles(distance),
                    false => ray.for_triangles(distance),
                };
                // The bare hierarchy lets bulbs and glass block rays: that is another question, and quicker to
                // answer.
                if lamp.is_hidden(scene, &origin, media) == hierarchy.any_hit(&bare) {
                    lamps.push(lamp);
                    bare_rays.push(bare);
                }
            }
            if !lamps.is_empty() {
                let SurfacePoint { position, geometric, extent, .. } = *point;
                rays.points.push(LitPoint { position, geometric, extent, media, lamps });
                rays.bare.push(bare_rays);
            }
        }
        rays
    }

    fn rate(&self, scene: &Scene, rounds: usize) -> RayRate {
        let count = self.bare.iter().map(Vec::len).sum();
        let at_hand = (RAYS_AT_HAND * self.points.len()).div_ceil(usize::max(count, 1)).max(1);
        let is_blocked = |ray: &&Ray| scene.geometry.hierarchy().any_hit(ray);
        rate(
            rounds,
            count,
            || timed(&self.points, at_hand, |point| point.hidden_lamps(scene)),
            || timed(&self.bare, at_hand, |rays| rays.iter().filter(is_blocked).count()),
        )
    }
}

impl LitPoint<'_> {
    /// Returns how many of the lamps are hidden.
    fn hidden_lamps(&self, scene: &Scene) -> usize {
        let origin = RayOrigin::new(self.position, self.geometric, self.extent);
        let is_hidden = |lamp: &&LampAbove<'_>| lamp.is_hidden(scene, &origin, self.media);
        self.lamps.iter().filter(is_hidden).count()
    }
}

impl LampAbove<'_> {
    #[inline]
    fn is_hidden(&self, scene: &Scene, origin: &RayOrigin, media: &MediumStack) -> bool {
        let target =
            Target { distance: self.distance, surface: None, glass: Glass::LetsThrough, bulbs: self.bulbs };
        transmittance(scene, &origin.towards(self.direction), &target, media).0.max_element() <= 0.0
    }
}

/// Number of rays that are timed together: few enough for a core's first-level cache, since the tracer too
/// has each ray in cache when it traces it.
const RAYS_AT_HAND: usize = 128;

/// Rates of the tracer and of the bare hierarchy, each of which is run once a round and returns how many rays met
/// something and the time in seconds.
fn rate(
    rounds: usize,
    rays: usize,
    tracer: impl Fn() -> (usize, f64),
    hierarchy: impl Fn() -> (usize, f64),
) -> RayRate {
    let mut best = [f64::INFINITY; 2];
    let mut met = [0; 2];
    let mut ratios = Vec::with_capacity(rounds);
    for _ in 0..rounds {
        let timed = [tracer(), hierarchy()];
        for which in 0..2 {
            met[which] = timed[which].0;
            best[which] = best[which].min(timed[which].1);
        }
        ratios.push(timed[1].1 / timed[0].1.max(f64::MIN_POSITIVE));
    }
    ratios.sort_by(f64::total_cmp);
    let ratio = ratios.get(ratios.len() / 2).copied().unwrap_or(0.0);
    RayRate { rays, met, millions_per_second: best.map(|time| rays as f64 / time / 1e6), ratio }
}

/// Counts over all items, of which `at_hand` are timed together; returns the sum, and the time in seconds.
fn timed<T: Clone>(items: &[T], at_hand: usize, count: impl Fn(&T) -> usize) -> (usize, f64) {
    let (mut sum, mut seconds) = (0, 0.0);
    for items in items.chunks(at_hand) {
        let items = black_box(items.to_vec());
        let started = Instant::now();
        sum += black_box(items.iter().map(&count).sum::<usize>());
        seconds += started.elapsed().as_secs_f64();
    }
    (sum, seconds)
}
