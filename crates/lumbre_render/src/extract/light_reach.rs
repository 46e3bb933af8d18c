//! How far a light reaches and which lists it belongs to: its class, and the sphere or the plane that bounds
//! what it lights. The amount of light is computed elsewhere.

use bevy_ecs::entity::Entity;
use glam::{DVec3, Vec3};
use lumbre_optics::{Attenuation, BakeMode, Light, LightKind, SpotCone};
use lumbre_scene::GlobalTransform;

use super::emitters::EmissivePolygon;

/// Which lists a light belongs to, and what its shaders have to evaluate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LightClass {
    /// A light without a range, a directional light or a polygon. It is in the lists of objects.
    Unbounded,
    /// A point light without a shadow, with a smooth cone or none, of one colour, whose attenuation is the
    /// inverse square within a range, with or without a constant term. Most lights of a game are of this
    /// class.
    InverseSquare,
    /// A light that would be of this class, but casts a shadow.
    Shadowed,
    /// Any other point light with a range: with OpenGL's cone, a linear attenuation term, or different
    /// colours.
    Ranged,
}

impl LightClass {
    /// Returns the class of a light. An ambient one has no range either.
    pub(super) fn of(light: &Light) -> Self {
        let Attenuation { range, constant, linear, quadratic, clamp } = light.attenuation;
        if light.kind != LightKind::Point || !range.is_finite() {
            return Self::Unbounded;
        }
        // In these ranges the quotients are as accurate as the coefficients themselves.
        let inverse_square =
            linear == 0.0 && !clamp && (1e-3..=1e3).contains(&quadratic) && (0.0..=1e3).contains(&constant);
        let one_color = light.ambient == Vec3::ZERO && light.specular == light.diffuse;
        let narrowed = cone(light).is_some_and(|cone| !matches!(cone, SpotCone::Smooth { .. }));
        // The range that `attenuate_quadratic` supports.
        let usual_range = (1e-9..=1e15).contains(&range);
        match (inverse_square && one_color && !narrowed && usual_range, light.shadow) {
            (true, false) => Self::InverseSquare,
            (true, true) => Self::Shadowed,
            (false, _) => Self::Ranged,
        }
    }

    /// Returns the class in frames with or without shadows.
    pub(super) fn in_frames(self, shadows: bool) -> Self {
        match self {
            Self::Shadowed if !shadows => Self::InverseSquare,
            class => class,
        }
    }
}

/// Returns the cone of a light, if it restricts the light.
pub(super) fn cone(light: &Light) -> Option<SpotCone> {
    light.spot.filter(|cone| !cone.is_everywhere())
}

/// How far a light reaches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LightReach {
    pub class: LightClass,
    /// Centre of the sphere that contains everything it reaches, in the world; for a polygon light one of its
    /// corners.
    pub center: DVec3,
    /// Radius of that sphere in metres; infinite for a light without a range.
    pub radius: f64,
    /// The cone of a spotlight with a range, whose bounding sphere the sphere is.
    pub cone: Option<ConeReach>,
    /// Whether it is baked into the lightmaps in use.
    pub baked: bool,
    /// The plane that a polygon light shines from.
    pub polygon: Option<PolygonReach>,
}

/// The cone that a spotlight does not leave. Its apex follows from its bounding sphere ([`Self::apex`]), so that
/// it takes little memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ConeReach {
    /// Unit vector along which it shines, in the world.
    pub axis: Vec3,
    /// Cosine of the angle between the axis and the outermost direction, from 0 to 1.
    pub cosine: f32,
}

impl ConeReach {
    /// Returns the place of the light whose cone has this bounding sphere.
    pub fn apex(&self, center: DVec3, radius: f64) -> DVec3 {
        let cosine = f64::from(self.cosine);
        let sine = (1.0 - cosine * cosine).sqrt();
        let offset = if cosine > sine { radius } else { radius * cosine / sine };
        center - self.axis.as_dvec3() * offset
    }
}

/// Where a polygon light shines: in front of its plane, on everything except the object whose face it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PolygonReach {
    /// Normal towards the front, of any length.
    pub front: DVec3,
    pub emitter: Entity,
}

impl LightReach {
    pub(super) fn new(light: &Light, transform: &GlobalTransform, class: LightClass) -> Self {
        let (center, radius, cone) = match light.kind {
            LightKind::Point => bounding_sphere(light, transform),
            LightKind::Ambient | LightKind::Directional => (transform.translation(), f64::INFINITY, None),
        };
        Self { class, center, radius, cone, baked: light.bake == BakeMode::Static, polygon: None }
    }

    pub(super) fn of_polygon(EmissivePolygon { light, emitter, baked }: &EmissivePolygon) -> Self {
        let reach = PolygonReach { front: light.area_vector(), emitter: *emitter };
        let (class, center) = (LightClass::Unbounded, light.corner);
        Self { class, center, radius: f64::INFINITY, cone: None, baked: *baked, polygon: Some(reach) }
    }

    /// Returns true if it may light any part of an object with this bounding box in the world.
    pub fn touches(&self, entity: Entity, center: DVec3, half_size: DVec3) -> bool {
        if let Some(polygon) = self.polygon {
            return polygon.shines_on(self.center, entity, center, half_size);
        }
        let outside = ((self.center - center).abs() - half_size).max(DVec3::ZERO);
        self.radius.is_infinite() || outside.length() < self.radius
    }
}

impl PolygonReach {
    /// Returns true if any part of an object with this bounding box lies in front of the polygon with this
    /// corner, and the object is not the emitter itself.
    pub fn shines_on(&self, corner: DVec3, entity: Entity, center: DVec3, half_size: DVec3) -> bool {
        let farthest = (center - corner).dot(self.front) + half_size.dot(self.front.abs());
        self.emitter != entity && farthest > 0.0
    }
}

/// Returns centre and radius of the smallest sphere around everything that a point light reaches: the sphere
/// of its range, or one around the spotlight's part of that, with the cone.
fn bounding_sphere(light: &Light, transform: &GlobalTransform) -> (DVec3, f64, Option<ConeReach>) {
    let (place, range) = (transform.translation(), f64::from(light.attenuation.range));
    let Some(cone) = cone(light).filter(|_| range.is_finite()) else { return (place, range, None) };
    // The device rounds the cosine to f32 and lights only points strictly inside, so a small margin is
    // sufficient.
    let cosine = (cone.cosines().outer - 1e-6).max(0.0);
    let axis = transform.forward();
    let cone = ConeReach { axis: axis.as_vec3(), cosine: cosine as f32 };
    // The rounded cosine, from which the apex is found again.
    let cosine = f64::from(cone.cosine);
    let sine = (1.0 - cosine * cosine).sqrt();
    let (center, radius) = match cosine > sine {
        // Through the apex and the rim of the spherical cap.
        true => (place + axis * (0.5 * range / cosine), 0.5 * range / cosine),
        // Around the rim of the spherical cap.
        false => (place + axis * (range * cosine), range * sine),
    };
    (center, radius, Some(cone))
}

#[cfg(test)]
mod tests {
    use lumbre_scene::Transform;

    use super::*;

    #[test]
    fn the_ball_around_a_cone_holds_what_it_lights_and_no_more() {
        let transform = Transform::from_xyz(1.0, 2.0, 3.0).looking_at(DVec3::new(-1.0, 0.5, 2.0), DVec3::Y);
        let place = GlobalTransform(transform.affine());
        let axis = place.forward();
        let side = axis.any_orthonormal_vector();
        for outer in [0.01_f32, 0.5, 0.785, 0.786, 1.2, 1.57] {
            let attenuation = Attenuation { range: 4.0, ..Attenuation::INVERSE_SQUARE };
            let cone = SpotCone::Smooth { inner: 0.0, outer };
            let (center, radius, cone) =
                bounding_sphere(&Light { attenuation, ..Light::spot(Vec3::ONE, cone) }, &place);
            let apex = cone.map(|cone| cone.apex(center, radius));
            assert!(apex.is_some_and(|apex| apex.distance(place.translation()) < 1e-6), "{outer}: {apex:?}");
            // The farthest points are the apex, the middle of the cap and its rim.
            let rim = |angle: f64| axis * angle.cos() + side * angle.sin();
            let outer = f64::from(outer);
            let mut farthest: f64 = if outer < 0.786 { center.distance(place.translation()) } else { 0.0 };
            for step in 0..=100 {
                let at = place.translation() + rim(outer * (f64::from(step) / 50.0 - 1.0)) * 4.0;
                farthest = farthest.max(center.distance(at));
            }
            assert!(center.distance(place.translation()) <= radius * (1.0 + 1e-12), "{outer}");
            assert!(farthest <= radius + 1e-9, "{outer}: {farthest} is outside of {radius}");
            assert!(radius < farthest * (1.0 + 1e-4), "{outer}: {radius} is wider than {farthest}");
        }
    }

    #[test]
    fn lights_are_classed_by_what_has_to_be_asked_of_them() {
        let ranged = Attenuation { range: 3.0, ..Attenuation::INVERSE_SQUARE };
        let lamp = Light { attenuation: ranged, ..Light::point(Vec3::ONE) };
        assert_eq!(LightClass::of(&lamp), LightClass::InverseSquare);
        let smooth = Some(SpotCone::Smooth { inner: 0.1, outer: 0.2 });
        let softened = Attenuation { constant: 0.1, quadratic: 1.2, ..ranged };
        for other in [Light { spot: smooth, ..lamp.clone() }, Light { attenuation: softened, ..lamp.clone() }]
        {
            assert_eq!(LightClass::of(&other), LightClass::InverseSquare, "{other:?}");
        }
        let cone = Some(SpotCone::Exponent { cutoff: 0.2, exponent: 3.0 });
        let linear = Attenuation { linear: 0.1, ..ranged };
        let faint = Attenuation { quadratic: 1e-6, ..ranged };
        let clamped = Attenuation { clamp: true, ..ranged };
        let tiny = Attenuation { range: 1e-12, ..ranged };
        for other in [
            Light { spot: cone, ..lamp.clone() },
            Light { ambient: Vec3::X, ..lamp.clone() },
            Light { specular: Vec3::ZERO, ..lamp.clone() },
            Light { attenuation: linear, ..lamp.clone() },
            Light { attenuation: faint, ..lamp.clone() },
            Light { attenuation: clamped, ..lamp.clone() },
            Light { attenuation: tiny, ..lamp.clone() },
        ] {
            assert_eq!(LightClass::of(&other), LightClass::Ranged, "{other:?}");
            assert_eq!(LightClass::of(&Light { shadow: true, ..other }), LightClass::Ranged);
        }
        let shadowed = LightClass::of(&Light { shadow: true, ..lamp.clone() });
        assert_eq!(shadowed, LightClass::Shadowed);
        assert_eq!([true, false].map(|on| shadowed.in_frames(on)), [shadowed, LightClass::InverseSquare]);
        for other in [Light::point(Vec3::ONE), Light { kind: LightKind::Directional, ..lamp }] {
            assert_eq!(LightClass::of(&other), LightClass::Unbounded, "{other:?}");
        }
    }
}
