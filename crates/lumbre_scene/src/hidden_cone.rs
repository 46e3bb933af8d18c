//! Finds spotlights that per-vertex or per-face shading misses: the axis of the cone hits the inside of a
//! triangle, but no point at which the lighting of that triangle is evaluated lies in the cone. The result is
//! correct for such shading but surprising, so it is reported. This does not measure the error of the whole
//! picture.

use bevy_ecs::name::NameOrEntity;
use bevy_ecs::prelude::*;
use glam::DVec3;
use lumbre_optics::{FlatRule, Light, LightKind, Material, Shading};
use serde::Serialize;

use crate::{Bounds, ChildOf, GlobalTransform, Mesh, Name, SceneSettings, hidden_entities};

/// Most triangles that are tested in all, so that the search ends within a second.
const MAX_TRIANGLES: usize = 20_000_000;
/// Most cones that are reported.
const MAX_CONES: usize = 20;

/// A cone that hits the inside of a triangle but contains none of the points where its lighting is evaluated.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HiddenCone {
    /// Name of the light, or its entity id.
    pub light: String,
    /// Name of the object or of its parent, or its entity id.
    pub object: String,
    /// How the object is shaded.
    pub shading: &'static str,
    /// Radius of the cone where its axis meets the triangle, metres.
    pub radius: f64,
    /// Longest edge of that triangle, metres.
    pub edge: f64,
}

impl std::fmt::Display for HiddenCone {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { light, object, shading, radius, edge } = self;
        write!(
            f,
            "the cone of \"{light}\" is {radius:.3} m in radius on \"{object}\", between points {edge:.3} m apart where {shading} \
             shading evaluates light, and all of its light is missing there: use Phong shading, or edges below the radius"
        )
    }
}

/// The spotlights whose cone falls between the points where an object's lighting is evaluated: its vertices
/// (Gouraud) or the point of the flat rule (flat). Returns at most twenty and stops after twenty million
/// triangle tests. Global transforms must be up to date.
pub fn hidden_cones(world: &mut World) -> Vec<HiddenCone> {
    let settings = world.get_resource::<SceneSettings>().copied().unwrap_or_default();
    let cones = cones(world);
    if cones.is_empty() {
        return Vec::new();
    }
    let mut found = Vec::new();
    let mut left = MAX_TRIANGLES;
    let hidden = hidden_entities(world);
    let mut query =
        world
            .query::<(NameOrEntity, Option<&ChildOf>, &Mesh, &Material, &GlobalTransform, Option<&Shading>)>(
            );
    let shown = query.iter(world).filter(|object| !hidden.contains(&object.0.entity));
    for (name, parent, mesh, material, transform, shading) in shown {
        let shading = shading.copied().unwrap_or(settings.shading);
        // Shading by need switches to Phong where a cone falls between vertices.
        let per_fragment = matches!(shading, Shading::Phong | Shading::Auto { .. });
        if per_fragment || material.unlit || !transform.0.is_finite() {
            continue;
        }
        let place = |vertex: u32| {
            let at = mesh.0.positions.get(vertex as usize).copied().unwrap_or_default();
            transform.0.transform_point3(at.as_dvec3())
        };
        let mut bounds = Bounds::EMPTY;
        mesh.0.positions.iter().for_each(|at| bounds.include(transform.0.transform_point3(at.as_dvec3())));
        for cone in cones.iter().filter(|cone| cone.meets(&bounds)) {
            left = left.saturating_sub(mesh.0.triangle_count());
            if left == 0 || found.len() == MAX_CONES {
                return found;
            }
            let hidden = mesh.0.triangles().find_map(|corners| {
                let corners = corners.map(place);
                let lit_at = evaluated(shading, settings.flat_rule, corners);
                let distance = cone.pierces(&corners)?;
                let missed = !lit_at.into_iter().any(|point| cone.contains(point));
                missed.then_some((distance, longest_edge(&corners)))
            });
            if let Some((distance, edge)) = hidden {
                // A primitive from a file has no name of its own; its node does.
                let of_parent = parent.and_then(|parent| world.get::<Name>(parent.parent()));
                let named = name.name.or(of_parent).map(ToString::to_string);
                let (light, object) = (cone.light.clone(), named.unwrap_or_else(|| name.entity.to_string()));
                let radius = distance * cone.tangent;
                found.push(HiddenCone { light, object, shading: shading.name(), radius, edge });
            }
        }
    }
    found
}

/// The points at which the lighting of a triangle is evaluated.
fn evaluated(shading: Shading, rule: FlatRule, corners: [DVec3; 3]) -> [DVec3; 3] {
    match (shading, rule) {
        (Shading::Flat, FlatRule::Centroid) => [(corners[0] + corners[1] + corners[2]) / 3.0; 3],
        (Shading::Flat, FlatRule::FirstVertex) => [corners[0]; 3],
        (Shading::Flat, FlatRule::LastVertex) => [corners[2]; 3],
        _ => corners,
    }
}

fn longest_edge([a, b, c]: &[DVec3; 3]) -> f64 {
    (*b - *a).length().max((*c - *b).length()).max((*a - *c).length())
}

/// The cone of a spotlight in world space.
struct Cone {
    light: String,
    apex: DVec3,
    axis: DVec3,
    cosine: f64,
    tangent: f64,
    range: f64,
}

fn cones(world: &mut World) -> Vec<Cone> {
    let mut query = world.query::<(NameOrEntity, &Light, &GlobalTransform)>();
    let spots = query.iter(world).filter_map(|(name, light, transform)| {
        let spot = light.spot.filter(|spot| !spot.is_everywhere() && light.kind == LightKind::Point)?;
        let cosine = spot.cosines().outer;
        let usable = light.enabled && transform.0.is_finite() && light.validate("").is_ok();
        // Half-angles of 90 degrees and more have no finite tangent, and contain every vertex in front of the
        // light.
        (usable && cosine > 0.0).then(|| Cone {
            light: name.to_string(),
            apex: transform.translation(),
            axis: transform.forward(),
            cosine,
            tangent: ((1.0 - cosine) * (1.0 + cosine)).max(0.0).sqrt() / cosine,
            range: f64::from(light.attenuation.range),
        })
    });
    spots.collect()
}

impl Cone {
    fn contains(&self, point: DVec3) -> bool {
        let away = point - self.apex;
        away.dot(self.axis) > self.cosine * away.length()
    }

    /// Returns true if the axis hits a box.
    fn meets(&self, bounds: &Bounds) -> bool {
        let (mut from, mut to) = (0.0_f64, f64::MAX);
        for side in 0..3 {
            // For an axis parallel to the slab these are infinite, or NaN on its boundary, which `max` and
            // `min` ignore.
            let (a, b) = (
                (bounds.min[side] - self.apex[side]) / self.axis[side],
                (bounds.max[side] - self.apex[side]) / self.axis[side],
            );
            from = from.max(a.min(b));
            to = to.min(a.max(b));
        }
        from <= to
    }

    /// The distance at which the axis hits a triangle, if it is within the range (Möller and Trumbore 1997).
    fn pierces(&self, [a, b, c]: &[DVec3; 3]) -> Option<f64> {
        let (first, second, to) = (*b - *a, *c - *a, self.apex - *a);
        let across = self.axis.cross(second);
        let determinant = first.dot(across);
        if determinant == 0.0 {
            return None;
        }
        let u = to.dot(across) / determinant;
        let turned = to.cross(first);
        let v = self.axis.dot(turned) / determinant;
        let distance = second.dot(turned) / determinant;
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0 && distance < self.range).then_some(distance)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::Vec3;
    use lumbre_mesh::shapes;
    use lumbre_optics::SpotCone;

    use super::*;
    use crate::{Transform, propagate_transforms};

    /// A floor of 2 m with `squares` squares along each side, and a lamp 1 m above the inside of one of their
    /// triangles.
    fn lit(squares: u32, shading: Shading, cone: SpotCone) -> Vec<HiddenCone> {
        let mut world = World::new();
        world.spawn((Mesh(Arc::new(shapes::plane(2.0, 2.0, squares, squares))), shading, Name::new("floor")));
        let over = DVec3::new(0.3 / f64::from(squares), 1.0, -0.4 / f64::from(squares));
        let place = Transform::from_translation(over).looking_at(DVec3::new(over.x, 0.0, over.z), DVec3::Z);
        world.spawn((Light::spot(Vec3::ONE, cone), place, Name::new("lamp")));
        let _ = world.run_system_cached(propagate_transforms);
        hidden_cones(&mut world)
    }

    #[test]
    fn a_cone_between_vertices_is_named() {
        let cone = SpotCone::Smooth { inner: 0.0, outer: 0.1 };
        let found = lit(1, Shading::Gouraud, cone);
        assert_eq!(found.len(), 1);
        assert_eq!((&*found[0].light, &*found[0].object), ("lamp", "floor"));
        assert!((found[0].radius - 0.1f64.tan()).abs() < 1e-6 && (found[0].edge - 8f64.sqrt()).abs() < 1e-6);
        assert!(found[0].to_string().contains("use Phong shading"));
    }

    #[test]
    fn what_shows_the_cone_is_not_named() {
        let cone = SpotCone::Smooth { inner: 0.0, outer: 0.1 };
        assert_eq!(lit(1, Shading::Phong, cone), []);
        assert_eq!(lit(64, Shading::Gouraud, cone), [], "vertices 3 cm apart in a cone of 10 cm");
        assert_eq!(lit(64, Shading::Flat, cone), []);
        let wide = SpotCone::Exponent { cutoff: std::f32::consts::FRAC_PI_2, exponent: 0.0 };
        assert_eq!(lit(1, Shading::Gouraud, wide), []);
        assert_eq!(
            lit(1, Shading::Gouraud, SpotCone::Exponent { cutoff: std::f32::consts::PI, exponent: 0.0 }),
            []
        );
    }

    #[test]
    fn flat_shading_is_asked_at_the_centroid() {
        // Wide enough for the near corner of the square, but not for the centroid of the triangle.
        assert_eq!(lit(1, Shading::Flat, SpotCone::Smooth { inner: 0.0, outer: 0.05 }).len(), 1);
    }
}
