//! The light of an irradiance volume as its documentation defines it, computed probe by probe.

use bevy_ecs::prelude::*;
use glam::{DVec3, UVec3};
use lumbre_scene::{GlobalTransform, IrradianceVolume};

pub(super) struct Volume {
    volume: IrradianceVolume,
    /// The box in world space.
    low: DVec3,
    size: DVec3,
}

impl Volume {
    /// Returns the only volume of a world, whose transform must not rotate.
    pub(super) fn of(world: &mut World) -> Option<Self> {
        let mut query = world.query::<(&IrradianceVolume, &GlobalTransform)>();
        let (volume, place) = query.iter(world).next()?;
        let matrix = place.0.matrix3;
        let size = DVec3::new(matrix.x_axis.x, matrix.y_axis.y, matrix.z_axis.z);
        Some(Self { volume: volume.clone(), low: place.translation() - 0.5 * size, size })
    }

    /// Returns E/π for a surface with this normal.
    pub(super) fn light(&self, point: DVec3, normal: DVec3) -> DVec3 {
        let cells = self.volume.resolution.as_dvec3();
        let at = (point - self.low) / self.size * cells - 0.5;
        let at = at.clamp(DVec3::ZERO, cells - 1.0);
        let (mut light, mut weights) = (DVec3::ZERO, 0.0);
        let UVec3 { x: width, y: height, z: depth } = self.volume.resolution;
        for (index, cube) in self.volume.cubes.iter().enumerate() {
            let index = index as u32;
            let probe = UVec3::new(index % width, index / width % height, index / (width * height) % depth);
            // A tent of one cell around the probe.
            let mut weight = (DVec3::ONE - (probe.as_dvec3() - at).abs()).max(DVec3::ZERO).element_product();
            if self.volume.inside.get(index as usize) == Some(&true) {
                weight /= 1024.0;
            }
            weights += weight;
            for axis in 0..3 {
                let side = cube.0[2 * axis + usize::from(normal[axis] < 0.0)].as_dvec3();
                light += weight * normal[axis] * normal[axis] * side;
            }
        }
        light / weights
    }
}
