//! The system that moves what has a motion, and reading motions from nodes. Not the curves: those are `motion`.

use bevy_ecs::prelude::*;
use glam::Vec3;
use lumbre_optics::Light;
use lumbre_scene::{Extras, Name, Transform};

use crate::motion::{Motion, MotionError};

/// The time that motions are shown at.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct GameTime {
    /// Seconds since the start.
    pub seconds: f64,
}

/// What the file gave: motions are relative to it.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
pub struct Rest {
    /// Where it rests.
    pub transform: Transform,
    /// Ambient, diffuse and specular colour of its light.
    pub light: Option<[Vec3; 3]>,
}

/// Why a node's motion cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExtrasError {
    /// It is not written as a motion is.
    #[error("extras.lumbre_demo.motion of node \"{node}\" cannot be read: {source}")]
    Unreadable {
        /// Name of the node.
        node: String,
        /// What is wrong with it.
        source: serde_json::Error,
    },
    /// Its numbers are out of range.
    #[error("extras.lumbre_demo: {0}")]
    OutOfRange(#[from] MotionError),
}

/// Gives a [`Motion`] to every node whose extras hold one; returns how many there are.
///
/// # Errors
/// [`ExtrasError`] with the node's name where a motion is malformed.
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

/// Puts everything that has a motion where it is at [`GameTime`].
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
