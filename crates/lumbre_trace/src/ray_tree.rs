//! Whitted's recursive ray tracing: at every point the direct light of the lamps, plus one mirrored and one
//! transmitted ray, I = I_a k_a O_d + Σ S_i f_att I_p (…) + k_r I_r + k_t I_t. Diffuse light from other
//! surfaces comes from lightmaps and irradiance volumes only; `path` has all light.
//!
//! The ray with the largest weight is traced first, so that where the number of rays ends a tree, as little weight
//! as possible is cut off. What the rays bring is added up in `ray_tree_node`.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

use glam::DVec3;
use lumbre_optics::{apply_fog, fog_weight};

use crate::branch::{Branch, Kind};
use crate::camera_ray::CameraRays;
use crate::coplanar::{Layer, Layers, nearest_layers};
use crate::direct_light::{DirectLight, Lighting, direct_light};
use crate::geometry::{Candidate, SpaceRay};
use crate::interface::RaySplit;
use crate::light_terms::{BOUNCED, LightTerms, Source};
use crate::medium::MediumStack;
use crate::options::MAXIMUM_DEPTH;
use crate::ray_tree_node::{Node, radiances, recorded, weights};
use crate::scene::Scene;
use crate::surface_point::SurfacePoint;

/// Limits at which a tree ends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    /// Largest number of mirrored and transmitted rays in succession.
    pub depth: u32,
    /// Rays with a smaller weight in every channel are not traced.
    pub weight: f64,
    /// Largest number of rays of one tree, shadow rays not counted.
    pub rays: u32,
}

/// Largest number of rays in succession, those behind partly covering surfaces included, which do not count as depth:
/// a recorded tree is drawn by recursion.
pub(crate) const LONGEST_CHAIN: u32 = 2 * MAXIMUM_DEPTH;

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
struct Twig {
    kind: Kind,
    /// Index of the node where it starts, and the factor on its radiance there; `None` for the camera ray.
    from: Option<(usize, DVec3)>,
    ray: SpaceRay,
    farthest: f64,
    media: MediumStack,
    weight: DVec3,
    depth: u32,
    /// Number of rays before it, from the camera on.
    length: u32,
    /// Surfaces that reflected or refracted it so far. Going straight through a thin sheet or a partly
    /// covering surface does not count.
    turns: u32,
    /// Whether it is the camera ray, or its straight continuation behind a partly covering surface.
    first: bool,
    /// Metres from the last surface that reflected or refracted it to its start, which is behind a partly
    /// covering surface if they are not 0.
    passed: f64,
    /// The surfaces where it starts, below a partly covering one in the same plane: it hits the first of them.
    below: Vec<Layer>,
}

/// A ray in the queue of those that are still to be traced.
struct Waiting {
    heaviness: f64,
    /// In the order in which the rays of the tree were found.
    number: usize,
    /// (Boxed because queues move what they hold.)
    twig: Box<Twig>,
}

/// A tree that is being traced.
struct Growth {
    seen: Seen,
    /// A node for each traced ray, in the order in which they were traced.
    nodes: Vec<Node>,
    /// The rays that are still to be traced, the heaviest first, and of equal ones the one found first.
    waiting: BinaryHeap<Waiting>,
    /// Number of rays found so far.
    found: usize,
    is_recorded: bool,
}

impl RayTree<'_> {
    /// Traces the tree of a camera ray. `terms` is an empty list of the terms of its light.
    pub fn grow(&self, ray: SpaceRay, farthest: f64, media: &MediumStack, terms: LightTerms) -> Seen {
        let mut growth = Growth::new(terms, false);
        self.trace_all(ray, farthest, media, &mut growth);
        let Growth { seen, nodes, .. } = &mut growth;
        let radiances = radiances(nodes);
        seen.radiance = radiances.first().copied().unwrap_or_default();
        seen.brightest =
            radiances.iter().fold(0.0, |brightest, radiance| brightest.max(radiance.max_element()));
        if seen.terms.are_wanted() {
            for (node, weight) in nodes.iter().zip(weights(nodes)) {
                seen.terms.scale(node.terms.clone(), weight);
            }
        }
        growth.seen
    }

    /// Traces the tree of a camera ray and returns all its branches; `None` if the limits allow no ray at all.
    pub fn record(&self, ray: SpaceRay, farthest: f64, media: &MediumStack) -> Option<Branch> {
        let mut growth = Growth::new(LightTerms::default(), true);
        self.trace_all(ray, farthest, media, &mut growth);
        let radiances = radiances(&growth.nodes);
        recorded(growth.nodes, &radiances)
    }

    /// Traces all rays of a tree, as far as its limits allow.
    fn trace_all(&self, ray: SpaceRay, farthest: f64, media: &MediumStack, growth: &mut Growth) {
        let mut next = Some(Box::new(Twig {
            kind: Kind::Camera,
            from: None,
            ray,
            farthest,
            media: media.clone(),
            weight: DVec3::ONE,
            depth: 0,
            length: 0,
            turns: 0,
            first: true,
            passed: 0.0,
            below: Vec::new(),
        }));
        while let Some(twig) = next {
            self.trace(twig, growth);
            next = growth.waiting.pop().map(|waiting| waiting.twig);
            if growth.nodes.len() >= self.limits.rays as usize {
                break;
            }
        }
        let untraced = std::mem::take(&mut growth.waiting).into_iter().map(|waiting| waiting.twig);
        next.into_iter().chain(untraced).for_each(|twig| growth.cut(&twig));
    }

    /// Traces one ray: adds its node to the tree, and the rays that start where it ends to those that wait.
    fn trace(&self, mut twig: Box<Twig>, growth: &mut Growth) {
        let scene = self.scene;
        let index = growth.nodes.len();
        if let Some((parent, factor)) = twig.from {
            growth.nodes[parent].add(twig.kind, factor, index);
        }
        let first_term = growth.seen.terms.len();
        let mut record = growth.is_recorded.then(|| {
            let factor = twig.from.map_or(DVec3::ONE, |(_, factor)| factor);
            Box::new(Branch::new(twig.kind, &twig.ray, scene.origin, twig.weight, factor))
        });
        let Some(layers) = self.next_layers(&mut twig, &mut growth.seen) else {
            let radiance = self.background(&twig.media);
            growth.seen.meets(radiance, DVec3::ZERO);
            growth.seen.terms.add(Source::Background, twig.turns, radiance);
            let terms = first_term..growth.seen.terms.len();
            growth.nodes.push(Node { record, ..Node::of_radiance(radiance, terms) });
            return;
        };
        let point = &layers.top.point;
        let object = &scene.objects[point.object];
        let clear = twig.media.transmittance(point.distance);
        if let Some(branch) = record.as_deref_mut() {
            branch.meets(scene, point, &twig.media, clear);
        }
        growth.nodes.push(Node { record, clear, ..Node::of_radiance(DVec3::ZERO, 0..0) });
        let local = if object.material.unlit {
            growth.seen.meets(point.surface.diffuse, DVec3::ZERO);
            growth.seen.terms.add(Source::Object(point.object), twig.turns, point.surface.diffuse);
            point.surface.diffuse
        } else {
            self.lit(&twig, point, (index, clear), growth)
        };
        let fog = scene.settings.fog.as_ref().map(|fog| {
            let distance =
                if twig.first { self.camera.depth(point.position) } else { twig.passed + point.distance };
            (fog_weight(&fog.mode, distance), fog.color.as_dvec3())
        });
        let terms = &mut growth.seen.terms;
        if let Some((weight, color)) = fog {
            terms.scale(first_term..terms.len(), DVec3::splat(weight));
            terms.add(Source::Background, twig.turns, apply_fog(weight, DVec3::ZERO, color));
            growth.seen.meets(color, DVec3::ZERO);
        }
        let terms = &mut growth.seen.terms;
        terms.scale(first_term..terms.len(), clear * point.coverage);
        let node = &mut growth.nodes[index];
        (node.local, node.fog, node.coverage) = (local, fog, point.coverage);
        node.terms = first_term..terms.len();
        if point.coverage < 1.0 {
            let behind = DVec3::splat(1.0 - point.coverage);
            let next = Twig {
                kind: Kind::Behind,
                from: Some((index, behind)),
                ray: SpaceRay::leaving(point.position, twig.ray.direction, point.geometric, point.extent),
                farthest: twig.farthest - point.distance,
                weight: twig.weight * behind * clear,
                length: twig.length + 1,
                passed: twig.passed + point.distance,
                below: layers.below,
                ..*twig
            };
            self.branch_off(next, growth);
        }
    }

    /// Returns the surface that a ray hits, if it hits one, with those below it.
    fn next_layers(&self, twig: &mut Twig, seen: &mut Seen) -> Option<Layers> {
        let mut below = std::mem::take(&mut twig.below).into_iter();
        if let Some(top) = below.next() {
            return Some(Layers { top, below: below.collect() });
        }
        seen.rays += 1;
        let seen_by_eyes = |candidate: &Candidate| self.scene.is_seen(candidate);
        nearest_layers(self.scene, &twig.ray, twig.farthest, seen_by_eyes)
    }

    /// Returns the radiance of the background through a medium without an end, which leaves nothing in the
    /// channels that it absorbs.
    fn background(&self, media: &MediumStack) -> DVec3 {
        let background = self.scene.settings.shown_background().as_dvec3();
        match media.transmittance(f64::INFINITY) {
            clear if clear == DVec3::ONE => background,
            clear => background * DVec3::select(clear.cmpgt(DVec3::ZERO), clear, DVec3::ZERO),
        }
    }

    /// Returns the direct light that a lit surface sends back along the ray, and adds the mirrored and the transmitted
    /// ray to those that wait. `index` is the ray's node, and `clear` the transmittance before the surface.
    fn lit(
        &self,
        twig: &Twig,
        point: &SurfacePoint,
        (index, clear): (usize, DVec3),
        growth: &mut Growth,
    ) -> DVec3 {
        let scene = self.scene;
        let object = &scene.objects[point.object];
        let viewer = match (twig.first, scene.settings.local_viewer) {
            (true, false) => self.camera.basis.z_axis,
            _ => -twig.ray.direction,
        };
        let splits = object.mirror() != DVec3::ZERO || object.transmission() != DVec3::ZERO;
        let split = splits.then(|| RaySplit::new(scene, &twig.ray, point, &twig.media));
        let (behind, eta) = split.as_ref().map_or((&twig.media, 1.0), |found| (&found.behind, found.eta));
        let light: DirectLight =
            direct_light(scene, point, viewer, (&twig.media, behind, eta), self.lighting);
        let seen = &mut growth.seen;
        seen.rays += light.rays;
        let radiance = light.total();
        seen.meets(radiance, object.mirror() + object.transmission());
        if let Some(branch) = growth.nodes[index].record.as_deref_mut() {
            branch.lit(scene, &light);
        }
        if seen.terms.are_wanted() {
            self.add_terms(&mut seen.terms, point, &light, twig.turns);
        }
        let Some(split) = split else { return radiance };
        let weight = twig.weight * clear * point.coverage;
        let branch = |kind: Kind, factor: DVec3, ray: SpaceRay, media: MediumStack, turns: u32| Twig {
            kind,
            from: Some((index, factor)),
            ray,
            farthest: f64::INFINITY,
            media,
            weight: weight * factor,
            depth: twig.depth + 1,
            length: twig.length + 1,
            turns: twig.turns + turns,
            first: false,
            passed: 0.0,
            below: Vec::new(),
        };
        if split.mirrored != DVec3::ZERO {
            let (ray, media) = (split.mirrored_ray(point), twig.media.clone());
            self.branch_off(branch(Kind::Mirrored, split.mirrored, ray, media, 1), growth);
        }
        if split.transmitted != DVec3::ZERO {
            let ray = split.transmitted_ray(point);
            let turns = u32::from(!object.medium.thin);
            self.branch_off(branch(Kind::Transmitted, split.transmitted, ray, split.behind, turns), growth);
        }
        radiance
    }

    /// Adds a ray to those that wait, unless the limits of depth and weight cut it off.
    fn branch_off(&self, twig: Twig, growth: &mut Growth) {
        let heaviness = twig.heaviness();
        let is_too_deep = twig.depth > self.limits.depth || twig.length > LONGEST_CHAIN;
        if is_too_deep || heaviness < self.limits.weight {
            growth.cut(&twig);
            return;
        }
        growth.found += 1;
        growth.waiting.push(Waiting { heaviness, number: growth.found, twig: Box::new(twig) });
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

impl Growth {
    fn new(terms: LightTerms, is_recorded: bool) -> Self {
        Self {
            seen: Seen { terms, ..Seen::default() },
            nodes: Vec::new(),
            waiting: BinaryHeap::new(),
            found: 0,
            is_recorded,
        }
    }

    /// Counts a ray that is not traced.
    fn cut(&mut self, twig: &Twig) {
        self.seen.cut += twig.heaviness();
        let Some((parent, factor)) = twig.from else { return };
        if let Some(branch) = self.nodes[parent].record.as_deref_mut() {
            branch.cuts(twig.kind, &twig.ray, twig.weight, factor);
        }
    }
}

impl Twig {
    /// The largest weight of a channel.
    fn heaviness(&self) -> f64 {
        self.weight.max_element()
    }
}

impl Ord for Waiting {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_age = Reverse(self.number).cmp(&Reverse(other.number));
        self.heaviness.total_cmp(&other.heaviness).then(by_age)
    }
}

impl PartialOrd for Waiting {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Waiting {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Waiting {}
