//! The f64 twin of a frame: the same scene rasterized and shaded on the CPU with `lumbre_optics`, pixel centres exactly, no
//! multisampling, no textures but lightmaps, normal maps and occlusion textures (first level only), no transparency, one irradiance volume at
//! most. It shares no code with the renderer but the components.

mod raster;
mod scene;
mod shading;
mod texture;
mod volume;

use glam::DVec3;
use lumbre_optics::{FlatRule, ReflectionModel, Shading};

pub use raster::{draw, reflected_by_corner, reflected_by_pixel};

/// A frame of the twin.
pub struct TwinFrame {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Radiance, top row first; the background where no surface is.
    pub color: Vec<DVec3>,
    /// What each pixel shows: object and triangle, or `None` for the background.
    pub surface: Vec<Option<(usize, usize)>>,
}

/// Choices of the twin, as the renderer's.
#[derive(Clone, Copy, Debug, Default)]
pub struct TwinOptions {
    /// Instead of each object's own.
    pub shading: Option<Shading>,
    /// Instead of the scene's.
    pub reflection: Option<ReflectionModel>,
    /// Instead of the scene's.
    pub flat_rule: Option<FlatRule>,
    /// Instead of the scene's.
    pub specular_antialiasing: Option<bool>,
}

impl TwinFrame {
    /// The pixels whose whole 3x3 neighbourhood shows one surface, or for flat shading one triangle: there no rounding of
    /// coverage can show another.
    pub fn interior(&self, one_triangle: bool) -> Vec<Option<DVec3>> {
        let key = |x: usize, y: usize| {
            self.surface[y * self.width + x]
                .map(|(object, triangle)| (object, if one_triangle { triangle } else { 0 }))
        };
        let inside = |x: usize, y: usize| {
            if x == 0 || y == 0 || x + 1 == self.width || y + 1 == self.height {
                return false;
            }
            (x - 1..=x + 1).all(|i| (y - 1..=y + 1).all(|j| key(i, j) == key(x, y)))
        };
        (0..self.height)
            .flat_map(|y| (0..self.width).map(move |x| (x, y)))
            .map(|(x, y)| inside(x, y).then(|| self.color[y * self.width + x]))
            .collect()
    }

    /// As [`interior`](Self::interior), without the background: that agrees too easily to be counted.
    pub fn inside_surfaces(&self, one_triangle: bool) -> Vec<Option<DVec3>> {
        let interior = self.interior(one_triangle);
        interior
            .iter()
            .zip(&self.surface)
            .map(|(color, surface)| color.filter(|_| surface.is_some()))
            .collect()
    }
}
