//! Reads motions from a file's nodes, and the system that applies them. The curves are in `motion`.

use bevy_ecs::prelude::*;
use glam::Vec3;
use lumbre_optics::Light;
use lumbre_scene::{Extras, Name, Transform};

use crate::motion::{Motion, MotionError};

/// The time at which motions are evaluated.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct GameTime {
    /// Seconds since the start.
    pub seconds: f64,
}

/// The state that the file gave; motions are relative to it.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
pub struct Rest {
    /// The resting transform.
    pub transform: Transform,
    /// Ambient, diffuse and specular colour of the light, if the node is one.
    pub light: Option<[Vec3; 3]>,
}

/// Reasons why a node's motion cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExtrasError {
    /// The motion is not written in the expected form.
    #[error("extras.lumbre_demo.motion of node \"{node}\" cannot be read: {source}")]
    Unreadable {
        /// The name of the node.
        node: String,
        /// The error of the parser.
        source: serde_json::Error,
    },
    /// A number is out of range.
    #[error("extras.lumbre_demo: {0}")]
    OutOfRange(#[from] MotionError),
}

/// Adds a [`Motion`] to every node whose extras contain one; returns the number of such nodes.
///
/// # Errors
/// [`ExtrasError`] with the node's name if a motion is malformed.
pub fn read_motions(world: &mut World) -> Result<usize, ExtrasError> {
    let mut query = world.query::<(Entity, &Extras, Option<&Name>, &Transform, Option<&Light>)>();
    let mut found = Vec::new();
    for (entity, extras, name, transform, light) in query.iter(world) {
        let Some(value) = extras.0.get("lumbre_demo").and_then(|ours| ours.get("motion")) else { continue };
        let node = name.map_or_else(|| entity.to_string(), |name| name.as_str().to_owned());
        let motion: Motion = serde_json::from_value(value.clone())
            .map_err(|source| ExtrasError::Unreadable { node: node.clone(), source })?;
        motion.validate(&node)?;
        let light = light.map(|light| [light.ambient, light.diffuse, light.specular]);
        found.push((entity, motion, Rest { transform: *transform, light }));
    }
    let count = found.len();
    for (entity, motion, rest) in found {
        world.entity_mut(entity).insert((motion, rest));
    }
    Ok(count)
}

/// System that moves everything with a motion to its pose at [`GameTime`].
pub fn move_things(
    time: Res<GameTime>,
    mut moving: Query<(&Motion, &Rest, &mut Transform, Option<&mut Light>)>,
) {
    for (motion, rest, mut transform, light) in &mut moving {
        let pose = motion.pose(time.seconds);
        let place = pose.place.unwrap_or(rest.transform.translation);
        transform.set_if_neq(Transform {
            translation: place + pose.offset,
            rotation: (pose.rotation * rest.transform.rotation).normalize(),
            scale: rest.transform.scale,
        });
        if let (Some(mut light), Some(colors), true) = (light, rest.light, motion.flicker.is_some()) {
            let [ambient, diffuse, specular] = colors.map(|color| color * pose.brightness as f32);
            light.ambient = ambient;
            light.diffuse = diffuse;
            light.specular = specular;
        }
    }
}
