//! Path tracing, an unbiased estimate of all light. At every point the light of one lamp and of one emissive
//! triangle is sampled, and the path goes on by the lobes of the surface, its mirror or its glass; both
//! strategies are combined by the balance heuristic (Veach and Guibas 1995), and long paths end by Russian
//! roulette. Nothing is left out or clamped, so that the mean over many paths converges to the light.
//!
//! Lamps are lights and not surfaces: the eye does not see them, neither directly nor in mirrors nor through
//! glass, as in frames. Lamps with a size light what a mirror or glass lies in between by the paths that meet
//! them. Not found: the light of lamps without a size through glass that refracts, and by mirrors. Such caustics
//! would need paths that start at the lamp.

use glam::{DVec2, DVec3};
use lumbre_optics::{apply_fog, fog_weight};

use crate::camera_ray::{CameraRay, CameraRays};
use crate::coplanar::{Layer, nearest_layers};
use crate::film::Sample;
use crate::geometry::{Place, RayOrigin, SpaceRay};
use crate::interface::RaySplit;
use crate::light_sampling::{LightSampler, MetLamp, emitted};
use crate::light_terms::{LightTerms, Source};
use crate::lobe_sampling::Lobes;
use crate::medium::MediumStack;
use crate::random::Numbers;
use crate::scene::Scene;
use crate::shadow_ray::{Glass, Target, transmittance};
use crate::surface_point::SurfacePoint;

/// Traces the paths of a picture.
pub(crate) struct Paths<'a> {
    scene: &'a Scene,
    camera: &'a CameraRays,
    lights: LightSampler,
    /// Largest number of reflections and refractions; `None` leaves the end to Russian roulette.
    depth: Option<u32>,
    shadows: bool,
}

/// Number of reflections and refractions before Russian roulette may end a path.
const SAFE_DEPTH: u32 = 4;
/// Largest probability of going on: otherwise a path between two perfect mirrors would never end.
const LIKELIEST: f64 = 0.95;
/// Largest number of surfaces of a path, including those that it goes straight through: thin sheets and
/// partly covering surfaces.
const MAX_SURFACES: u32 = 100_000;

/// The state of a path while it is traced.
struct Walk {
    ray: SpaceRay,
    farthest: f64,
    /// The surfaces where the ray starts, below a partly covering one in the same plane, the lowest first: it
    /// hits the last of them.
    below: Vec<Layer>,
    media: MediumStack,
    throughput: DVec3,
    /// The product of η² over the interfaces that the path was refracted at, by which refraction has lessened
    /// `throughput`. It is 1 again once the path has left the glass.
    eta_scale: f64,
    /// The radiance found so far.
    radiance: DVec3,
    /// The terms that the radiance is the sum of, if they are wanted.
    terms: LightTerms,
    /// The last point at which a direction was sampled; `None` after the camera, a mirror or glass, whose
    /// directions are not sampled.
    last: Option<Scattering>,
    /// The specular lobe's share of the last reflection by lobes, per channel, since lamps may have a colour of
    /// their own for it. `None` while the path has only met mirrors and glass.
    shine: Option<DVec3>,
    reflections: u32,
    rays: u32,
    fog: FogBegins,
}

/// Where the fog on a path's current ray begins. As in frames and ray trees, it lies before what is seen:
/// directly, in mirrors and through glass. Light between the surfaces themselves passes it undimmed.
#[derive(Clone, Copy)]
enum FogBegins {
    /// At the eye; the fog is that of a frame, which depends on the depth.
    AtTheEye,
    /// This many metres before the start of the ray, where the path was last reflected or refracted.
    Before(f64),
    /// The path has been scattered.
    Nowhere,
}

/// A point at which the path's direction was sampled.
#[derive(Clone, Copy)]
struct Scattering {
    position: DVec3,
    /// Shading normal.
    normal: DVec3,
    /// Density per steradian with which the direction was sampled.
    density: f64,
    /// Metres of the path since then.
    distance: f64,
}

/// Whether a path goes on.
#[derive(PartialEq, Eq)]
enum Next {
    Goes,
    Ends,
}

impl<'a> Paths<'a> {
    pub fn new(scene: &'a Scene, camera: &'a CameraRays, depth: Option<u32>, shadows: bool) -> Self {
        Self { scene, camera, lights: LightSampler::new(scene), depth, shadows }
    }

    /// Traces one path, with the terms of its light.
    pub fn sample(
        &self,
        camera: &CameraRay,
        media: MediumStack,
        numbers: &mut Numbers,
        terms: LightTerms,
    ) -> Sample {
        let mut walk = Walk {
            ray: camera.ray,
            farthest: camera.farthest,
            below: Vec::new(),
            media,
            throughput: DVec3::ONE,
            eta_scale: 1.0,
            radiance: DVec3::ZERO,
            terms,
            last: None,
            shine: None,
            reflections: 0,
            rays: 0,
            fog: FogBegins::AtTheEye,
        };
        for _ in 0..MAX_SURFACES {
            if self.step(&mut walk, numbers) == Next::Ends {
                break;
            }
        }
        // With lights near the limits of f64 the product of factors may overflow.
        let mut radiance = walk.radiance;
        if !radiance.is_finite() {
            radiance = DVec3::ZERO;
            walk.terms.clear();
        }
        let brightest = radiance.max_element();
        Sample { radiance, rays: walk.rays, cut: 0.0, brightest, limit: 0.0, terms: walk.terms }
    }

    fn step(&self, walk: &mut Walk, numbers: &mut Numbers) -> Next {
        let scene = self.scene;
        // Whether the ray comes from the eye, a mirror or glass.
        let is_specular = walk.last.is_none();
        let Some(Layer { hit, point }) = walk.next_surface(scene, is_specular) else {
            walk.escapes(scene);
            return Next::Ends;
        };
        let object = &scene.objects[point.object];
        walk.throughput *= walk.media.transmittance(point.distance);
        let since = walk.last.map_or(0.0, |last| last.distance) + point.distance;
        if point.coverage < 1.0 && numbers.next() >= point.coverage {
            if let FogBegins::Before(metres) = &mut walk.fog {
                *metres += point.distance;
            }
            return walk.goes_straight(&point, since);
        }
        self.add_fog(walk, &point);
        if object.material.unlit {
            if is_specular {
                walk.brings(Source::Object(point.object), walk.reflections, point.surface.diffuse);
            }
            return Next::Ends;
        }
        if !(point.front || object.shows_back()) {
            return Next::Ends;
        }
        self.add_emission(walk, &point, &hit.candidate.place, since);
        self.scatter(walk, &point, since, numbers)
    }

    /// Adds the fog before a surface.
    fn add_fog(&self, walk: &mut Walk, point: &SurfacePoint) {
        let Some(fog) = &self.scene.settings.fog else { return };
        let distance = match walk.fog {
            FogBegins::AtTheEye => self.camera.depth(point.position),
            FogBegins::Before(metres) => metres + point.distance,
            FogBegins::Nowhere => return,
        };
        let clear = fog_weight(&fog.mode, distance);
        let color = apply_fog(clear, DVec3::ZERO, fog.color.as_dvec3());
        walk.brings(Source::Background, walk.reflections, color);
        walk.throughput *= clear;
    }

    /// Adds the emission of the surface: all of it after the camera, a mirror or glass, where light sampling
    /// cannot find it, and otherwise weighted by the balance heuristic.
    fn add_emission(&self, walk: &mut Walk, point: &SurfacePoint, place: &Place, since: f64) {
        let Some(last) = walk.last else {
            walk.brings(Source::Object(point.object), walk.reflections, point.emission);
            return;
        };
        let object = &self.scene.objects[point.object];
        let radiance = match *place {
            Place::Triangle { triangle, weights } => emitted(object, triangle, weights, point.front),
            Place::Exact { .. } => emitted(object, 0, [0.0; 2], point.front),
        };
        if radiance == DVec3::ZERO {
            return;
        }
        let cosine = point.geometric.dot(walk.ray.direction);
        let receiver = (last.position, last.normal);
        let by_lights = self.lights.density(point.triangle, receiver, since, cosine);
        let share = last.density / (last.density + by_lights);
        walk.brings(Source::Object(point.object), walk.reflections, radiance * share);
    }

    /// Samples the lights, and then the direction in which the path goes on.
    fn scatter(&self, walk: &mut Walk, point: &SurfacePoint, since: f64, numbers: &mut Numbers) -> Next {
        let scene = self.scene;
        let object = &scene.objects[point.object];
        let viewer = -walk.ray.direction;
        let lobes = Lobes::new(object.model, &point.surface, point.normal, viewer);
        let matt = !lobes.are_black() && point.normal.dot(viewer) > 0.0;
        let last = self.depth.is_some_and(|depth| walk.reflections >= depth);
        let origin = point.ray_origin();
        if matt {
            self.sample_lights(walk, (point, &origin), &lobes, last, numbers);
        }
        // Light that goes straight through a thin sheet is not turned. Light sampling sees through sheets, and so must
        // what it is weighed against.
        let only_straight = last && walk.last.is_some() && object.medium.thin;
        if last && !only_straight {
            return Next::Ends;
        }
        let splits = object.mirror() != DVec3::ZERO || object.transmission() != DVec3::ZERO;
        let split = splits.then(|| RaySplit::new(scene, &walk.ray, point, &walk.media));
        let mean = |color: DVec3| color.element_sum() / 3.0;
        let (mirrored, through) =
            split.as_ref().map_or((0.0, 0.0), |found| (mean(found.mirrored), mean(found.transmitted)));
        let local = if matt { lobes.albedo().max(1e-3) } else { 0.0 };
        let (local, mirrored) = if only_straight { (0.0, 0.0) } else { (local, mirrored) };
        let total = local + mirrored + through;
        if total <= 0.0 {
            return Next::Ends;
        }
        // A lamp's own bulb lets its light pass unturned, wherever it is sampled: it is not found once more in the bulb's
        // glass.
        let beyond = |lamp: &MetLamp| match self.scene.lights[lamp.number].bulbs.contains(&point.object) {
            true => 0.0,
            false => 1.0,
        };
        let choice = numbers.next() * total;
        if let Some(split) = split.filter(|_| choice >= local) {
            return if choice < local + mirrored {
                walk.throughput *= split.mirrored * (total / mirrored);
                let ray = split.mirrored_ray(point);
                self.meet_lamps(walk, &ray, beyond);
                walk.turns(ray, None, numbers)
            } else {
                walk.throughput *= split.transmitted * (total / through);
                if object.medium.thin {
                    if !matches!(walk.fog, FogBegins::Nowhere) {
                        walk.fog = FogBegins::Before(0.0);
                    }
                    return walk.goes_straight(point, since);
                }
                // Refraction changes the solid angle of a beam, and its radiance with it, by 1/η².
                let scale = split.eta * split.eta;
                walk.throughput /= scale;
                walk.eta_scale *= scale;
                walk.media = split.behind.clone();
                let ray = split.transmitted_ray(point);
                self.meet_lamps(walk, &ray, beyond);
                walk.turns(ray, None, numbers)
            };
        }
        let direction = lobes.direction(numbers.next(), numbers.pair());
        let density = lobes.density(direction);
        if direction.dot(point.geometric) <= 0.0 || density <= 0.0 {
            return Next::Ends;
        }
        let [diffuse, specular] = lobes.reflectances(direction);
        let reflectance = diffuse + specular;
        walk.throughput *= reflectance * (total / (local * density));
        let share = specular / reflectance;
        walk.shine = Some(DVec3::select(reflectance.cmpgt(DVec3::ZERO), share, DVec3::ZERO));
        // The density that the balance heuristic compares: the probability of choosing the lobes at all,
        // times their density.
        let chance = density * local / total;
        let scattering =
            Scattering { position: point.position, normal: point.normal, density: chance, distance: 0.0 };
        let ray = origin.towards(direction);
        self.meet_lamps(walk, &ray, |lamp| {
            let by_lights = self.lights.lamp_chance(scene, point, lamp.number) / lamp.solid_angle;
            chance / (chance + by_lights)
        });
        walk.turns(ray, Some(scattering), numbers)
    }

    /// Adds the light of the lamps with a size that lie along a path's next ray, and that nothing but thin sheets
    /// and partly covering surfaces hides. `share` is the weight of this way to find a lamp.
    fn meet_lamps(&self, walk: &mut Walk, ray: &SpaceRay, share: impl Fn(&MetLamp) -> f64) {
        // Without shadows, sampled lamps shine through everything.
        let Some(shine) = walk.shine.filter(|_| self.shadows) else { return };
        for lamp in self.lights.met(self.scene, ray.origin, ray.direction) {
            let [diffuse, specular] = lamp.radiance;
            let light = (diffuse + (specular - diffuse) * shine) * share(&lamp);
            let bulbs = &self.scene.lights[lamp.number].bulbs;
            let target = Target { distance: lamp.distance, surface: None, glass: Glass::OnlySheets, bulbs };
            let arriving = self.arriving(walk, ray, &target, light);
            walk.brings(Source::Light(lamp.number), walk.reflections + 1, arriving);
        }
    }

    /// Next-event estimation: adds the light of one sampled lamp and of one sampled emissive triangle.
    fn sample_lights(
        &self,
        walk: &mut Walk,
        (point, origin): (&SurfacePoint, &RayOrigin),
        lobes: &Lobes,
        last: bool,
        numbers: &mut Numbers,
    ) {
        let (choice, place) =
            if self.scene.lights.is_empty() { (0.0, DVec2::ZERO) } else { (numbers.next(), numbers.pair()) };
        // The density with which the path finds the same light by itself; a path that ends here does not.
        let found = |walk: &Walk, direction: DVec3| match last {
            true => 0.0,
            false => self.chance(walk, point, lobes, direction),
        };
        let is_above = |direction: DVec3| direction.dot(point.geometric) > 0.0;
        let lamp = self.lights.lamp(self.scene, point, choice, place);
        if let Some(lamp) = lamp.filter(|lamp| is_above(lamp.light.direction)) {
            let direction = lamp.light.direction;
            let mut reflected = lobes.reflected(&lamp.light) / lamp.chance;
            if lamp.solid_angle > 0.0 && self.shadows {
                reflected /= 1.0 + found(walk, direction) * lamp.solid_angle / lamp.chance;
            }
            let bulbs = &self.scene.lights[lamp.number].bulbs;
            let target = Target { distance: lamp.distance, surface: None, glass: Glass::OnlySheets, bulbs };
            let seen = self.arriving(walk, &origin.towards(direction), &target, reflected);
            walk.brings(Source::Light(lamp.number), walk.reflections + 1, seen);
        }
        let (choice, place) = (numbers.next(), numbers.pair());
        let emitter = self.lights.emitter(self.scene, point, choice, place);
        if let Some(sample) = emitter.filter(|sample| is_above(sample.direction)) {
            let direction = sample.direction;
            let density = sample.density + found(walk, direction);
            let reflected = lobes.reflectance(direction) * sample.radiance / density;
            let target = Target {
                distance: sample.distance,
                surface: Some(sample.surface),
                glass: Glass::OnlySheets,
                bulbs: &[],
            };
            let seen = self.arriving(walk, &origin.towards(direction), &target, reflected);
            walk.brings(Source::Object(sample.surface.object), walk.reflections + 1, seen);
        }
    }

    /// Returns the density per steradian with which the path itself goes on in a direction by its lobes.
    fn chance(&self, walk: &Walk, point: &SurfacePoint, lobes: &Lobes, direction: DVec3) -> f64 {
        let object = &self.scene.objects[point.object];
        let local = lobes.albedo().max(1e-3);
        let mut total = local;
        if object.mirror() != DVec3::ZERO || object.transmission() != DVec3::ZERO {
            let split = RaySplit::new(self.scene, &walk.ray, point, &walk.media);
            total += (split.mirrored + split.transmitted).element_sum() / 3.0;
        }
        lobes.density(direction) * local / total
    }

    /// Returns how much of a light arrives at the start of a ray towards it.
    fn arriving(&self, walk: &mut Walk, ray: &SpaceRay, target: &Target, light: DVec3) -> DVec3 {
        if light == DVec3::ZERO || !self.shadows {
            return light;
        }
        let (visible, rays) = transmittance(self.scene, ray, target, &walk.media);
        walk.rays += rays;
        let arriving = light * visible;
        match target.surface {
            Some(surface) if arriving != DVec3::ZERO => {
                arriving * surface.uncovered_share(self.scene, ray, target.distance)
            }
            _ => arriving,
        }
    }
}

impl Walk {
    /// Returns the surface that the ray hits next.
    fn next_surface(&mut self, scene: &Scene, is_specular: bool) -> Option<Layer> {
        if let Some(below) = self.below.pop() {
            return Some(below);
        }
        self.rays += 1;
        // Rays from the eye, a mirror or glass pass the culled backs of single-sided surfaces, as a rasterizer
        // does. Rays that carry light are blocked by them.
        let layers = nearest_layers(scene, &self.ray, self.farthest, |candidate| {
            if is_specular { scene.is_seen(candidate) } else { scene.blocks(candidate) }
        })?;
        self.below = layers.below;
        self.below.reverse();
        Some(layers.top)
    }

    /// Adds light that arrives at the path's last point, times the throughput. `turns` counts the surfaces on
    /// its whole way to the eye.
    fn brings(&mut self, source: Source, turns: u32, light: DVec3) {
        let radiance = self.throughput * light;
        self.radiance += radiance;
        self.terms.add(source, turns, radiance);
    }

    fn escapes(&mut self, scene: &Scene) {
        let radiance = match self.last {
            None => scene.settings.shown_background(),
            Some(_) => scene.settings.sky,
        };
        if self.media.transmittance(f64::INFINITY) == DVec3::ONE || self.media.innermost().is_none() {
            self.brings(Source::Background, self.reflections, radiance.as_dvec3());
        }
    }

    /// Goes on in the same direction, through a thin sheet or past a partly covering surface.
    fn goes_straight(&mut self, point: &SurfacePoint, since: f64) -> Next {
        self.farthest -= point.distance;
        self.ray = SpaceRay::leaving(point.position, self.ray.direction, point.geometric, point.extent);
        self.last = self.last.map(|last| Scattering { distance: since, ..last });
        Next::Goes
    }

    /// Goes on along a new ray, unless Russian roulette ends the path. `scattering` is `None` for mirrors
    /// and glass.
    fn turns(&mut self, ray: SpaceRay, scattering: Option<Scattering>, numbers: &mut Numbers) -> Next {
        self.ray = ray;
        self.farthest = f64::INFINITY;
        self.below.clear();
        self.last = scattering;
        self.reflections += 1;
        let scattered = self.last.is_some() || matches!(self.fog, FogBegins::Nowhere);
        self.fog = if scattered { FogBegins::Nowhere } else { FogBegins::Before(0.0) };
        if self.throughput.max_element() <= 0.0 || !self.throughput.is_finite() {
            return Next::Ends;
        }
        if self.reflections > SAFE_DEPTH {
            // By the power that the path carries: radiance is scaled in glass, but a path is worth no less
            // there.
            let chance = (self.throughput.max_element() * self.eta_scale).min(LIKELIEST);
            if numbers.next() >= chance {
                return Next::Ends;
            }
            self.throughput /= chance;
        }
        Next::Goes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A path in glass that has lost no power goes on as likely as one outside, although its radiance is
    /// scaled.
    #[test]
    fn chance_ends_paths_by_their_power_whatever_they_are_in() {
        let goes_on = |throughput: f64, eta_scale: f64| {
            let ray = SpaceRay::new(DVec3::ZERO, DVec3::Z);
            let count = 4096;
            let ends = |sample| {
                let mut walk = Walk {
                    ray,
                    farthest: f64::INFINITY,
                    below: Vec::new(),
                    media: MediumStack::default(),
                    throughput: DVec3::splat(throughput),
                    eta_scale,
                    radiance: DVec3::ZERO,
                    terms: LightTerms::new(false),
                    last: None,
                    shine: None,
                    reflections: SAFE_DEPTH,
                    rays: 0,
                    fog: FogBegins::Before(0.0),
                };
                let next = walk.turns(ray, None, &mut Numbers::new(1, 0, sample));
                assert!(next == Next::Ends || walk.throughput.x >= throughput);
                next == Next::Goes
            };
            (0..count).filter(|&sample| ends(sample)).count() as f64 / f64::from(count)
        };
        let glass = 1.5 * 1.5;
        for (power, chance) in [(1.0, LIKELIEST), (0.5, 0.5), (0.1, 0.1)] {
            for eta_scale in [1.0, glass, 1.0 / glass] {
                let found = goes_on(power / eta_scale, eta_scale);
                assert!((found - chance).abs() < 2e-3, "{power} in {eta_scale}: {found} for {chance}");
            }
        }
    }
}
