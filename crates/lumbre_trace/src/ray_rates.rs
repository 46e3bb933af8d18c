//! Measures how fast a picture's primary and shadow rays are found, compared with the bare triangle
//! hierarchy: the cost of alpha masks, exact surfaces, glass and f64. No light is evaluated.

use std::hint::black_box;
use std::time::Instant;

use lumbre_optics::LightKind;
use lumbre_rays::Ray;

use crate::direct_light::{reach, shadow_ray};
use crate::geometry::SpaceRay;
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
}

impl RayRates {
    /// Measures the rates in `rounds` rounds.
    pub(crate) fn of(view: &View, rounds: usize) -> Self {
        let scene = &view.scene;
        let bare = scene.geometry.hierarchy();
        let rays = PictureRays::of(view);
        let seen = |(ray, farthest): &(SpaceRay, f64)| {
            scene.geometry.closest(ray, *farthest, |candidate| scene.is_seen(candidate)).is_some()
        };
        let meets = |ray: &Ray| bare.closest_hit(ray).is_some();
        let primary = rate(rounds, (&rays.primary, seen), (&rays.bare_primary, meets));
        let hidden = |shadow: &Shadow<'_>| shadow.is_hidden(scene);
        let shadow = rate(rounds, (&rays.shadow, hidden), (&rays.bare_shadow, |ray: &Ray| bare.any_hit(ray)));
        Self { primary, shadow }
    }
}

/// The rays of a picture, as the tracer and as the bare hierarchy takes them.
#[derive(Default)]
struct PictureRays<'a> {
    primary: Vec<(SpaceRay, f64)>,
    bare_primary: Vec<Ray>,
    shadow: Vec<Shadow<'a>>,
    bare_shadow: Vec<Ray>,
}

#[derive(Clone)]
struct Shadow<'a> {
    ray: SpaceRay,
    distance: f64,
    media: &'a MediumStack,
    bulbs: &'a [usize],
}

impl Shadow<'_> {
    fn is_hidden(&self, scene: &Scene) -> bool {
        let target =
            Target { distance: self.distance, surface: None, glass: Glass::LetsThrough, bulbs: self.bulbs };
        transmittance(scene, &self.ray, &target, self.media).0.max_element() <= 0.0
    }
}

impl<'a> PictureRays<'a> {
    fn of(view: &'a View) -> Self {
        let scene = &view.scene;
        let (width, height) = view.size();
        let mut rays = Self::default();
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
            let camera = view.camera.through(pixel_middle(x, y));
            rays.primary.push((camera.ray, camera.farthest));
            rays.bare_primary.push(camera.ray.for_triangles(camera.farthest));
            let seen = scene.geometry.closest(&camera.ray, camera.farthest, |at| scene.is_seen(at));
            if let Some(hit) = seen {
                rays.add_shadow_rays(view, &SurfacePoint::new(scene, &camera.ray, &hit));
            }
        }
        rays
    }

    fn add_shadow_rays(&mut self, view: &'a View, point: &SurfacePoint) {
        for placed in &view.scene.lights {
            let direction = match placed.light.kind {
                LightKind::Point => placed.position - point.position,
                LightKind::Directional => -placed.axis,
                LightKind::Ambient => continue,
            };
            if direction.dot(point.geometric) <= 0.0 {
                continue;
            }
            let ray = shadow_ray(point, direction.normalize());
            let distance = reach(placed, point);
            let bare = match distance.is_finite() {
                true => ray.between_triangles(distance),
                false => ray.for_triangles(distance),
            };
            let own = Shadow { ray, distance, media: view.media(), bulbs: &placed.bulbs };
            // The bare hierarchy lets bulbs and glass block rays: that is another question, and quicker to
            // answer.
            if own.is_hidden(&view.scene) == view.scene.geometry.hierarchy().any_hit(&bare) {
                self.shadow.push(own);
                self.bare_shadow.push(bare);
            }
        }
    }
}

/// Number of rays that are timed together: few enough for a core's first-level cache, since the tracer too
/// has each ray in cache when it traces it.
const AT_HAND: usize = 128;

fn rate<A: Clone, B: Clone>(
    rounds: usize,
    (own, own_meets): (&[A], impl Fn(&A) -> bool),
    (bare, bare_meets): (&[B], impl Fn(&B) -> bool),
) -> RayRate {
    let mut best = [f64::INFINITY; 2];
    let mut met = [0; 2];
    let mut ratios = Vec::with_capacity(rounds);
    for _ in 0..rounds {
        let timed = [timed(own, &own_meets), timed(bare, &bare_meets)];
        for which in 0..2 {
            met[which] = timed[which].0;
            best[which] = best[which].min(timed[which].1);
        }
        ratios.push(timed[1].1 / timed[0].1.max(f64::MIN_POSITIVE));
    }
    ratios.sort_by(f64::total_cmp);
    let ratio = ratios.get(ratios.len() / 2).copied().unwrap_or(0.0);
    RayRate {
        rays: own.len(),
        met,
        millions_per_second: best.map(|time| own.len() as f64 / time / 1e6),
        ratio,
    }
}

/// Returns how many rays hit something, and the time that took in seconds.
fn timed<R: Clone>(rays: &[R], meets: impl Fn(&R) -> bool) -> (usize, f64) {
    let (mut met, mut seconds) = (0, 0.0);
    for rays in rays.chunks(AT_HAND) {
        let rays = black_box(rays.to_vec());
        let started = Instant::now();
        met += black_box(rays.iter().filter(|ray| meets(ray)).count());
        seconds += started.elapsed().as_secs_f64();
    }
    (met, seconds)
}
