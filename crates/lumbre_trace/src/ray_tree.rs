//! Whitted's recursive ray tracing: at every point the direct light of the lamps, plus one mirrored and one
//! transmitted ray, I = I_a k_a O_d + Σ S_i f_att I_p (…) + k_r I_r + k_t I_t. Diffuse light from other
//! surfaces comes from lightmaps and irradiance volumes only; `path` has all light.

use glam::DVec3;
use lumbre_optics::{apply_fog, fog_weight};

use crate::branch::{Branch, Kind};
use crate::camera_ray::CameraRays;
use crate::coplanar::{Layer, nearest_layers};
use crate::direct_light::{DirectLight, Lighting, direct_light};
use crate::geometry::{Candidate, SpaceRay};
use crate::interface::RaySplit;
use crate::light_terms::{BOUNCED, LightTerms, Source};
use crate::medium::MediumStack;
use crate::scene::Scene;
use crate::surface_point::SurfacePoint;

/// Limits at which the recursion ends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    /// Largest number of mirrored and transmitted rays in succession.
    pub depth: u32,
    /// Rays with a smaller weight in every channel are not traced.
    pub weight: f64,
    /// Largest number of rays of one tree, shadow rays not counted.
    pub rays: u32,
}

/// Traces the trees of a picture.
pub(crate) struct RayTree<'a> {
    pub scene: &'a Scene,
    pub camera: &'a CameraRays,
    pub limits: Limits,
    pub lighting: Lighting,
}

/// The result of one tree.
#[derive(Clone, Debug, Default)]
pub(crate) struct Seen {
    pub radiance: DVec3,
    /// Sum of the weights of the rays that were cut off. Times the radiance that they would have returned, it
    /// is the error.
    pub cut: f64,
    /// Number of rays, shadow rays included.
    pub rays: u32,
    /// The brightest radiance that any ray of the tree returned.
    pub brightest: f64,
    /// Upper bound of the radiance that any ray of the tree could return at any depth: the largest over all
    /// points of the point's own light over 1 - (k_r + k_t). Infinite where a point that passes on all light
    /// adds some.
    pub limit: f64,
    /// The terms that the radiance is the sum of, if they are wanted.
    pub terms: LightTerms,
}

impl Seen {
    /// Updates the bound for a point that adds light of its own and passes on a part of what arrives.
    fn meets(&mut self, own: DVec3, passed_on: DVec3) {
        for channel in 0..3 {
            let (own, left) = (own[channel], 1.0 - passed_on[channel]);
            if own > 0.0 {
                self.limit = self.limit.max(if left > 0.0 { own / left } else { f64::INFINITY });
            } else if left < 0.0 {
                self.limit = f64::INFINITY;
            }
        }
    }
}

/// A ray that is still to be traced.
struct Twig<'m> {
    ray: SpaceRay,
    farthest: f64,
    media: &'m MediumStack,
    weight: DVec3,
    depth: u32,
    /// Surfaces that reflected or refracted it so far. Going straight through a thin sheet or a partly
    /// covering surface does not count.
    turns: u32,
    /// Whether it is the camera ray, or its straight continuation behind a partly covering surface.
    first: bool,
    /// Metres from the last surface that reflected or refracted it to its start, which is behind a partly
    /// covering surface if they are not 0.
    passed: f64,
    /// The surfaces where it starts, below a partly covering one in the same plane: it hits the first of them.
    below: &'m [Layer],
}

impl RayTree<'_> {
    /// Traces the tree of a camera ray, and records all its branches if `record` is given.
    pub fn grow(
        &self,
        ray: SpaceRay,
        farthest: f64,
        media: &MediumStack,
        record: Option<&mut Branch>,
        terms: LightTerms,
    ) -> Seen {
        let mut seen = Seen { terms, ..Seen::default() };
        let mut left = self.limits.rays;
        let root = Twig {
            ray,
            farthest,
            media,
            weight: DVec3::ONE,
            depth: 0,
            turns: 0,
            first: true,
            passed: 0.0,
            below: &[],
        };
        seen.radiance = self.radiance(root, &mut left, &mut seen, record);
        seen
    }

    fn radiance(
        &self,
        twig: Twig<'_>,
        left: &mut u32,
        seen: &mut Seen,
        mut record: Option<&mut Branch>,
    ) -> DVec3 {
        *left = left.saturating_sub(1);
        let own_terms = seen.terms.len();
        let scene = self.scene;
        let layers;
        let (found, below) = if let [next, below @ ..] = twig.below {
            (Some(&next.point), below)
        } else {
            seen.rays += 1;
            let seen_by_eyes = |candidate: &Candidate| scene.is_seen(candidate);
            layers = nearest_layers(scene, &twig.ray, twig.farthest, seen_by_eyes);
            layers.as_ref().map_or((None, &[][..]), |layers| (Some(&layers.top.point), &layers.below))
        };
        let Some(point) = found else {
            // An absorbing medium without an end leaves nothing in the channels that it absorbs.
            let background = scene.settings.shown_background().as_dvec3();
            let radiance = match twig.media.transmittance(f64::INFINITY) {
                clear if clear == DVec3::ONE => background,
                clear => background * DVec3::select(clear.cmpgt(DVec3::ZERO), clear, DVec3::ZERO),
            };
            if let Some(branch) = record {
                branch.meets_nothing(radiance);
            }
            seen.brightest = seen.brightest.max(radiance.max_element());
            seen.meets(radiance, DVec3::ZERO);
            seen.terms.add(Source::Background, twig.turns, radiance);
            return radiance;
        };
        let object = &scene.objects[point.object];
        let clear = twig.media.transmittance(point.distance);
        if let Some(branch) = record.as_deref_mut() {
            branch.meets(scene, point, twig.media, clear);
        }

        let mut radiance = if object.material.unlit {
            seen.meets(point.surface.diffuse, DVec3::ZERO);
            seen.terms.add(Source::Object(point.object), twig.turns, point.surface.diffuse);
            point.surface.diffuse
        } else {
            self.lit(&twig, point, clear, left, seen, record.as_deref_mut())
        };
        if let Some(fog) = &scene.settings.fog {
            let distance =
                if twig.first { self.camera.depth(point.position) } else { twig.passed + point.distance };
            let (weight, color) = (fog_weight(&fog.mode, distance), fog.color.as_dvec3());
            radiance = apply_fog(weight, radiance, color);
            seen.meets(color, DVec3::ZERO);
            seen.terms.scale_since(own_terms, DVec3::splat(weight));
            seen.terms.add(Source::Background, twig.turns, apply_fog(weight, DVec3::ZERO, color));
        }
        if point.coverage < 1.0 {
            let behind = DVec3::splat(1.0 - point.coverage);
            seen.terms.scale_since(own_terms, DVec3::splat(point.coverage));
            let ray = SpaceRay::leaving(point.position, twig.ray.direction, point.geometric, point.extent);
            let next = Twig {
                ray,
                farthest: twig.farthest - point.distance,
                media: twig.media,
                weight: twig.weight * behind * clear,
                passed: twig.passed + point.distance,
                below,
                ..twig
            };
            radiance = radiance * point.coverage
                + self.branch_off(Kind::Behind, next, behind, left, seen, record.as_deref_mut());
        }
        let radiance = radiance * clear;
        seen.terms.scale_since(own_terms, clear);
        seen.brightest = seen.brightest.max(radiance.max_element());
        if let Some(branch) = record {
            branch.radiance = radiance;
        }
        radiance
    }

    /// Returns the radiance that a lit surface sends back along the ray: direct light, mirror and
    /// transmission.
    fn lit(
        &self,
        twig: &Twig<'_>,
        point: &SurfacePoint,
        clear: DVec3,
        left: &mut u32,
        seen: &mut Seen,
        mut record: Option<&mut Branch>,
    ) -> DVec3 {
        let scene = self.scene;
        let object = &scene.objects[point.object];
        let viewer = match (twig.first, scene.settings.local_viewer) {
            (true, false) => self.camera.basis.z_axis,
            _ => -twig.ray.direction,
        };
        let splits = object.mirror() != DVec3::ZERO || object.transmission() != DVec3::ZERO;
        let split = splits.then(|| RaySplit::new(scene, &twig.ray, point, twig.media));
        let (behind, eta) = split.as_ref().map_or((twig.media, 1.0), |found| (&found.behind, found.eta));
        let light: DirectLight = direct_light(scene, point, viewer, (twig.media, behind, eta), self.lighting);
        seen.rays += light.rays;
        let mut radiance = light.total();
        seen.meets(radiance, object.mirror() + object.transmission());
        if let Some(branch) = record.as_deref_mut() {
            branch.lit(scene, &light);
        }
        if seen.terms.are_wanted() {
            self.add_terms(&mut seen.terms, point, &light, twig.turns);
        }
        let Some(split) = split else { return radiance };
        let share = point.coverage;
        if split.mirrored != DVec3::ZERO {
            let next = Twig {
                ray: split.mirrored_ray(point),
                farthest: f64::INFINITY,
                media: twig.media,
                weight: twig.weight * split.mirrored * clear * share,
                depth: twig.depth + 1,
                turns: twig.turns + 1,
                first: false,
                passed: 0.0,
                below: &[],
            };
            radiance +=
                self.branch_off(Kind::Mirrored, next, split.mirrored, left, seen, record.as_deref_mut());
        }
        if split.transmitted != DVec3::ZERO {
            let next = Twig {
                ray: split.transmitted_ray(point),
                farthest: f64::INFINITY,
                media: &split.behind,
                weight: twig.weight * split.transmitted * clear * share,
                depth: twig.depth + 1,
                turns: twig.turns + u32::from(!object.medium.thin),
                first: false,
                passed: 0.0,
                below: &[],
            };
            radiance += self.branch_off(Kind::Transmitted, next, split.transmitted, left, seen, record);
        }
        radiance
    }

    /// Traces one more ray and returns its radiance times `factor`; 0 if the limits cut it off, which is
    /// counted.
    fn branch_off(
        &self,
        kind: Kind,
        twig: Twig<'_>,
        factor: DVec3,
        left: &mut u32,
        seen: &mut Seen,
        record: Option<&mut Branch>,
    ) -> DVec3 {
        let weight = twig.weight.max_element();
        if twig.depth > self.limits.depth || weight < self.limits.weight || *left == 0 {
            seen.cut += weight;
            if let Some(branch) = record {
                branch.cuts(kind, &twig.ray, twig.weight, factor);
            }
            return DVec3::ZERO;
        }
        let first = seen.terms.len();
        let mut own =
            record.is_some().then(|| Branch::new(kind, &twig.ray, self.scene.origin, twig.weight, factor));
        let radiance = factor * self.radiance(twig, left, seen, own.as_mut());
        seen.terms.scale_since(first, factor);
        if let Some((branch, own)) = record.zip(own) {
            branch.branches.push(own);
        }
        radiance
    }

    /// Adds the terms of the light at a point, each with its source.
    fn add_terms(&self, terms: &mut LightTerms, point: &SurfacePoint, light: &DirectLight, turns: u32) {
        let lights = self.scene.lights.len();
        for term in &light.lights {
            let source = match term.light.checked_sub(lights) {
                None => Source::Light(term.light),
                Some(polygon) => Source::Object(self.scene.polygons[polygon].emitter),
            };
            terms.add(source, turns + 1, term.diffuse + term.specular + term.transmitted);
            terms.add(source, turns + BOUNCED, term.ambient);
        }
        terms.add(Source::Object(point.object), turns, light.emission);
        let ambient = if point.from_volume.is_some() { Source::Baked } else { Source::Ambient };
        terms.add(ambient, turns + BOUNCED, light.ambient_of_scene);
        terms.add(Source::Baked, turns + BOUNCED, light.baked);
    }
}
