//! Lights that cast shadows, and how many views each kind of light has, for both the light records and the
//! shadow maps. What the views show is decided in `shadows`.

use bevy_ecs::entity::Entity;
use glam::DVec3;
use lumbre_optics::{Light, LightKind};
use lumbre_scene::GlobalTransform;

use crate::layout::InverseSquareLightData;

/// Largest number of views of all lights of a frame.
pub(crate) const MAX_VIEWS: usize = 128;
/// Number of the compact record that is black, whatever lights there are: as many lights as there can be come
/// before it.
pub(crate) const BLACK_SHADOWED: u32 = MAX_VIEWS as u32;
/// Number of cascades of a directional light.
pub(crate) const CASCADES: usize = 3;
/// A spotlight with a larger half angle than this, in radians, has six views like a point light.
pub(crate) const WIDEST_CONE: f64 = 1.2;

/// How a shader chooses one of a light's views.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ShadowKind {
    /// One view.
    Cone,
    /// The face that the direction from the light points through: +X, -X, +Y, -Y, +Z, -Z.
    Cube,
    /// The first cascade that contains the depth.
    Cascades,
}

impl ShadowKind {
    /// Returns the kind of a light; `None` for an ambient one, which casts no shadow.
    pub fn of(light: &Light) -> Option<Self> {
        match (light.kind, light.spot.filter(|cone| !cone.is_everywhere())) {
            (LightKind::Ambient, _) => None,
            (LightKind::Directional, _) => Some(Self::Cascades),
            (LightKind::Point, Some(cone)) if cone.cosines().outer.acos() <= WIDEST_CONE => Some(Self::Cone),
            (LightKind::Point, _) => Some(Self::Cube),
        }
    }

    pub fn views(self) -> usize {
        match self {
            Self::Cone => 1,
            Self::Cube => 6,
            Self::Cascades => CASCADES,
        }
    }
}

/// A light that casts shadows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShadowLight {
    /// Index of its first view among all views, and how one of its views is chosen.
    pub first_view: u32,
    pub kind: ShadowKind,
    pub entity: Entity,
    pub position: DVec3,
    pub axis: DVec3,
    pub cone: f64,
    pub range: f64,
    /// Radius in metres; for a directional light the tangent of half its angle.
    pub size: f64,
    /// Its record, if its class has compact ones.
    pub compact: Option<InverseSquareLightData>,
}

impl ShadowLight {
    /// Creates the shadow of a light that asks for one; `None` if there is no room for its views.
    pub fn new(
        entity: Entity,
        light: &Light,
        transform: &GlobalTransform,
        first_view: usize,
    ) -> Option<Self> {
        let kind = light.shadow.then(|| ShadowKind::of(light))??;
        if first_view + kind.views() > MAX_VIEWS {
            return None;
        }
        let cone =
            light.spot.filter(|cone| !cone.is_everywhere()).map_or(0.0, |cone| cone.cosines().outer.acos());
        let size = light_size(kind, light);
        Some(Self {
            // Less than MAX_VIEWS.
            first_view: first_view as u32,
            kind,
            entity,
            position: transform.translation(),
            axis: transform.forward(),
            cone,
            range: f64::from(light.attenuation.range),
            size,
            compact: None,
        })
    }

    pub fn views(&self) -> usize {
        self.kind.views()
    }

    /// Returns the shadow flags of a light's record: how one of its views is chosen, and its first view.
    pub fn flags(&self) -> u32 {
        let kind = match self.kind {
            ShadowKind::Cone => 1,
            ShadowKind::Cube => 2,
            ShadowKind::Cascades => 3,
        };
        kind << 1 | self.first_view << 8
    }
}

/// Returns the radius of a light in metres, or the tangent of half the angle of a directional one. A light
/// with a size has shadows with a penumbra.
pub(crate) fn light_size(kind: ShadowKind, light: &Light) -> f64 {
    match kind {
        ShadowKind::Cascades => (0.5 * f64::from(light.angle)).tan(),
        ShadowKind::Cone | ShadowKind::Cube => f64::from(light.radius),
    }
}
