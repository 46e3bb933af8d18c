//! Predicts the errors of flat and Gouraud shading on an object from the lights that reach it. Which shading
//! is chosen is decided by the caller.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec3, Vec3};
use lumbre_optics::{
    ConeOverObject, Highlight, InterpolationError, LightKind, LightOverObject, MINIMUM_COSINE_DIFFERENCE,
    ReflectionModel, SpotCone, Surface, interpolation_error, metal_reflectance,
};

use super::Conditions;
use super::surface::{LitSurface, WorldPatch};
use crate::extract::{CameraView, Lamp, ViewVolume};
use crate::shader::Feature;
use crate::shading_need::Reason;
use crate::texture_sets;

/// A prediction is valid for all eye positions within this fraction of the distance to the object, so that a
/// moving camera rarely needs a new one.
const ROOM: f64 = 0.2;
/// By how much cones are widened, in radians, to allow for rounding on the device.
const MARGIN: f64 = 1e-3;

/// The prediction for one object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Prediction {
    pub reason: Reason,
    /// Upper bounds on the difference of flat and of Gouraud shading from Phong shading, in radiance, for any
    /// pixel and channel. If both exceed the requested bound, the prediction stopped there, and the values
    /// may be too low.
    pub errors: [f64; 2],
    /// The bound at which the prediction stopped because both errors exceed it; infinite if it was completed.
    enough: f64,
    /// How far the eye may move from its position, in metres.
    room: f64,
}

impl Prediction {
    /// Evaluates the whole surface, and then each patch if that does not show both errors to be within
    /// `enough`. Stops when both errors exceed it.
    pub fn new<'l>(
        surface: &LitSurface<'_>,
        conditions: &Conditions,
        view: &CameraView,
        enough: f64,
        lamps: impl Iterator<Item = &'l Lamp>,
    ) -> Self {
        let nothing = |reason| Self { reason, errors: [0.0; 2], enough: f64::INFINITY, room: f64::INFINITY };
        let unknown = |reason| Self { errors: [f64::INFINITY; 2], ..nothing(reason) };
        let traits = surface.traits;
        let has =
            |feature| texture_sets::features(traits.texture_mask).any(|(of, bound)| bound && of == feature);
        if traits.unlit {
            return nothing(Reason::Unlit);
        }
        if has(Feature::MetallicRoughnessTexture) {
            return unknown(Reason::MetallicRoughnessTexture);
        }
        if conditions.irradiance_volumes && traits.is_lit_by_irradiance_volume() {
            return unknown(Reason::IrradianceVolume);
        }
        let Some(whole) = surface.whole() else { return nothing(Reason::NoLight) };
        let scenes = conditions.settings.reflection;
        let model = conditions.reflection.or(traits.reflection).unwrap_or(scenes);
        let sides = Sides::new(surface, conditions);
        let room = match conditions.settings.local_viewer {
            true => ROOM * whole.distances(view.eye)[0],
            false => 0.0,
        };
        let lit = LitPatch { surface, sides: &sides, conditions, view, model, room };
        let mut reaching = Vec::new();
        let mut shiny = false;
        for lamp in lamps {
            if lamp.reach.polygon.is_some() {
                return unknown(Reason::PolygonLight);
            }
            if let Some(light) = lit.light_over(lamp, &whole) {
                shiny |= light.specular > 0.0;
                reaching.push(lamp);
            }
        }
        if reaching.is_empty() {
            return nothing(Reason::NoLight);
        }
        if has(Feature::NormalTexture) {
            return unknown(Reason::NormalTexture);
        }
        if traits.vertex_color {
            return unknown(Reason::VertexColors);
        }
        if conditions.specular_antialiasing && traits.specular {
            return unknown(Reason::SpecularAntialiasing);
        }
        let of_vertices = conditions.clamp.then(|| {
            let modulated = has(Feature::BaseColorTexture) || has(Feature::OcclusionTexture);
            ClampedVertices { constant: sides.constant(conditions), modulated }
        });
        let of_patch = |patch: &WorldPatch| {
            let all = lit.errors(&reaching, patch);
            let errors = of_vertices.as_ref().map_or([all.flat, all.gouraud], |of| of.errors(&all));
            // Infinity times 0 means that nothing is known.
            errors.map(|error| if error.is_nan() { f64::INFINITY } else { error })
        };
        let room = if shiny { room } else { f64::INFINITY };
        let predicted = |errors, enough| Self { reason: Reason::Predicted, errors, enough, room };
        let of_whole = of_patch(&whole);
        if of_whole.iter().all(|error| *error <= enough) {
            return predicted(of_whole, f64::INFINITY);
        }
        let mut errors = [0.0_f64; 2];
        // With highlights the prediction depends on the eye anyway, so patches that it cannot see are
        // skipped.
        for patch in surface.patches().filter(|patch| !shiny || lit.may_be_seen(patch)) {
            let one = of_patch(&patch);
            errors = [errors[0].max(one[0]), errors[1].max(one[1])];
            if errors.iter().all(|error| *error > enough) {
                return predicted(errors, enough);
            }
        }
        predicted([errors[0].min(of_whole[0]), errors[1].min(of_whole[1])], f64::INFINITY)
    }

    /// Returns true if the prediction is sufficient for errors up to this bound.
    pub fn suffices(&self, enough: f64) -> bool {
        enough <= self.enough
    }

    /// Returns true if a prediction for an eye position is still valid for a view.
    pub fn holds_from(&self, eye: DVec3, backward: DVec3, view: &CameraView, local_viewer: bool) -> bool {
        if self.room.is_infinite() {
            return true;
        }
        match local_viewer {
            true => (view.eye - eye).length() <= self.room,
            false => view.basis.z_axis == backward,
        }
    }
}

/// The coefficients of the sides that may be visible.
struct Sides {
    seen: [Surface; 2],
    /// Whether both sides are lit.
    both: bool,
    lightmapped: bool,
}

impl Sides {
    fn new(surface: &LitSurface<'_>, conditions: &Conditions) -> Self {
        let front = surface.reflectance.front;
        let both = surface.traits.double_sided && conditions.settings.two_sided;
        let back = surface.reflectance.back.filter(|_| both).unwrap_or(front);
        let lightmapped = conditions.lightmaps && surface.traits.is_lit_by_lightmap();
        Self { seen: [front, back], both, lightmapped }
    }

    /// Returns the largest channel of a coefficient times a colour, over both sides.
    fn reflected(&self, color: Vec3, coefficient: fn(&Surface) -> Vec3) -> f64 {
        let of = |side: &Surface| f64::from((coefficient(side) * color).abs().max_element());
        of(&self.seen[0]).max(of(&self.seen[1]))
    }

    /// Returns the largest channel of the light that does not come from lights.
    fn constant(&self, conditions: &Conditions) -> f64 {
        let ambient = conditions.settings.ambient_with_sky();
        self.reflected(ambient, |side| side.ambient) + self.reflected(Vec3::ONE, |side| side.emission)
    }
}

/// With OpenGL's clamped display, vertex colours are clamped before they are interpolated and before a
/// texture modulates them.
struct ClampedVertices {
    constant: f64,
    modulated: bool,
}

impl ClampedVertices {
    fn errors(&self, all: &InterpolationError) -> [f64; 2] {
        let beyond = (self.constant + all.brightest - 1.0).max(0.0);
        let lost = if self.modulated { beyond } else { 0.0 };
        // The upper limit causes a corner, like the terminator.
        let corner = if beyond > 0.0 { 0.25 * all.change } else { 0.0 };
        [all.flat + lost, all.gouraud + lost + corner]
    }
}

/// What the light on a patch follows from, except the lights.
struct LitPatch<'a> {
    surface: &'a LitSurface<'a>,
    sides: &'a Sides,
    conditions: &'a Conditions,
    view: &'a CameraView,
    model: ReflectionModel,
    /// How far the eye may move, in metres.
    room: f64,
}

impl LitPatch<'_> {
    /// Returns the errors with all of these lights.
    fn errors(&self, lamps: &[&Lamp], patch: &WorldPatch) -> InterpolationError {
        let rule = self.conditions.settings.flat_rule;
        let lights = lamps.iter().filter_map(|lamp| self.light_over(lamp, patch));
        let one = lights.map(|light| interpolation_error(&light, &patch.triangle, rule));
        one.fold(InterpolationError::default(), |sum, one| sum + one)
    }

    /// Returns the bounds on a light's effect on a patch; `None` if it does not light the patch.
    fn light_over(&self, lamp: &Lamp, patch: &WorldPatch) -> Option<LightOverObject> {
        let Self { surface, sides, model, .. } = *self;
        let light = &lamp.light;
        let directional = light.kind == LightKind::Directional;
        let to_light = lamp.position - patch.center;
        let (distances, direction, half_angle) = match directional {
            true => ([f64::INFINITY; 2], -lamp.axis, 0.0),
            false => {
                let direction = to_light.try_normalize().unwrap_or(DVec3::Y);
                (patch.distances(lamp.position), direction, patch.half_angle(to_light.length(), 0.0))
            }
        };
        if !directional && distances[0] >= f64::from(light.attenuation.range) {
            return None;
        }
        let cone = match light.spot.filter(|cone| !cone.is_everywhere()) {
            _ if light.shadow => ConeOverObject::Step,
            None => ConeOverObject::Everywhere,
            Some(cone) => cone_over(cone, lamp.axis.angle_between(-direction), half_angle)?,
        };
        let facing = patch.normals.map_or(Facing::Anywhere, |normals| {
            let room = normals.half_angle + half_angle + MARGIN;
            let angle = normals.axis.angle_between(direction);
            match () {
                () if angle + room < FRAC_PI_2 => Facing::Front,
                () if angle - room > FRAC_PI_2 => Facing::Back,
                () => Facing::Anywhere,
            }
        });
        let dark = facing == Facing::Back && !sides.both;
        let of = |lit: bool, color: Vec3, coefficient: fn(&Surface) -> Vec3| {
            if lit && !dark { sides.reflected(color, coefficient) } else { 0.0 }
        };
        let diffuse = match lamp.reach.baked && sides.lightmapped {
            false => of(true, light.diffuse, |side| side.diffuse),
            // A metal takes back what its lightmap holds of the light.
            true => of(surface.traits.metal, light.diffuse, reflectance_as_metal),
        };
        let (ambient, specular) = (
            sides.reflected(light.ambient, |side| side.ambient),
            of(true, light.specular, |side| side.specular),
        );
        if ambient == 0.0 && diffuse == 0.0 && specular == 0.0 {
            return None;
        }
        // The sharper highlight of both sides is a bound for both.
        let shininess = |side: &Surface| f64::from(side.shininess_in_range());
        let [front, back] = sides.seen.each_ref().map(shininess);
        let (to_viewer, viewer_half_angle, viewer_distance) = self.viewer(patch);
        let between = to_viewer.angle_between(direction) + viewer_half_angle + half_angle;
        Some(LightOverObject {
            ambient,
            diffuse,
            specular,
            highlight: Highlight { model, lobe: surface.reflectance.lobe, shininess: front.max(back) },
            attenuation: light.attenuation,
            distances,
            cone: if front == back { cone } else { ConeOverObject::Step },
            viewer_distance,
            light_to_viewer: between.min(PI),
            terminator: facing == Facing::Anywhere,
        })
    }

    /// Returns true if an eye position may see its front, or its back if that is drawn.
    fn may_be_seen(&self, patch: &WorldPatch) -> bool {
        let perspective = matches!(self.view.volume, ViewVolume::Perspective { .. });
        let one_sided =
            perspective && self.conditions.settings.local_viewer && !self.surface.traits.double_sided;
        let Some(normals) = patch.normals.filter(|_| one_sided) else { return true };
        let (to_viewer, half_angle, _) = self.viewer(patch);
        normals.axis.angle_between(to_viewer) - normals.half_angle - half_angle - MARGIN <= FRAC_PI_2
    }

    /// Returns the direction from a patch's centre to the viewer, the largest angle in radians between it and
    /// the direction from any point of the patch to any eye position, and the least distance between such
    /// points in metres.
    fn viewer(&self, patch: &WorldPatch) -> (DVec3, f64, f64) {
        if !self.conditions.settings.local_viewer {
            return (self.view.basis.z_axis, 0.0, f64::INFINITY);
        }
        let to_eye = self.view.eye - patch.center;
        let distance = (patch.distances(self.view.eye)[0] - self.room).max(0.0);
        let direction = to_eye.try_normalize().unwrap_or(DVec3::Y);
        (direction, patch.half_angle(to_eye.length(), self.room), distance)
    }
}

/// Returns the diffuse reflectance that stands for a side's highlight.
fn reflectance_as_metal(side: &Surface) -> Vec3 {
    metal_reflectance(side.diffuse.as_dvec3(), side.specular.as_dvec3(), f64::from(side.shininess_in_range()))
        .as_vec3()
}

/// Which side of a surface a light may reach.
#[derive(Clone, Copy, PartialEq)]
enum Facing {
    Front,
    Back,
    Anywhere,
}

/// Returns the bounds on a spot cone over an object. `angle` is the angle between its axis and the object's
/// centre, `half_angle` that of the cone around the object, both in radians. `None` if the object is outside
/// the cone.
fn cone_over(cone: SpotCone, angle: f64, half_angle: f64) -> Option<ConeOverObject> {
    let (least, most) = (angle - half_angle - MARGIN, angle + half_angle + MARGIN);
    if least > f64::from(cone.outer_angle()) {
        return None;
    }
    Some(match cone {
        SpotCone::Smooth { inner, .. } if most < f64::from(inner) => ConeOverObject::Everywhere,
        SpotCone::Smooth { .. } => {
            let cosines = cone.cosines();
            let width = (cosines.inner_or_exponent - cosines.outer).max(MINIMUM_COSINE_DIFFERENCE);
            ConeOverObject::Slope(2.0 / width)
        }
        SpotCone::Exponent { cutoff, .. } if most >= f64::from(cutoff) => ConeOverObject::Step,
        SpotCone::Exponent { exponent, .. } => match f64::from(exponent) {
            0.0 => ConeOverObject::Everywhere,
            ..1.0 => ConeOverObject::Step,
            exponent => ConeOverObject::Slope(exponent),
        },
    })
}
