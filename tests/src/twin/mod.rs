//! The f64 twin of a frame: the same scene rasterized and shaded on the CPU with `lumbre_optics`, exactly at pixel
//! centres. It has no multisampling, no textures except lightmaps, normal maps and occlusion textures (first level
//! only), no transparency, and at most one irradiance volume. It shares no code with the renderer except the
//! components.

mod raster;
mod scene;
mod shading;
mod texture;
mod volume;

use glam::DVec3;
use lumbre_optics::{FlatRule, ReflectionModel, Shading};

use crate::device::subpixel_bits;

pub use raster::{by_moved_corners, draw, reflected_by_corner, reflected_by_pixel};

/// A frame drawn by the twin.
pub struct TwinFrame {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Radiance, top row first; the background's where there is no surface.
    pub color: Vec<DVec3>,
    /// Index of the object and triangle that each pixel shows, or `None` for the background.
    pub surface: Vec<Option<(usize, usize)>>,
    /// Whether rounding decides which of two neighbouring places a rasterizer moves a corner of that triangle to.
    pub uncertain: Vec<bool>,
}

/// Options of the twin, like those of the renderer.
#[derive(Clone, Copy, Debug)]
pub struct TwinOptions {
    /// Overrides each object's own shading.
    pub shading: Option<Shading>,
    /// Overrides the scene's reflection model.
    pub reflection: Option<ReflectionModel>,
    /// Overrides the scene's flat rule.
    pub flat_rule: Option<FlatRule>,
    /// Overrides the scene's specular antialiasing.
    pub specular_antialiasing: Option<bool>,
    /// Bits within a pixel of the grid that corners are moved to before coverage and interpolation; `None` leaves
    /// them where they are. By default that of the tests' device ([`subpixel_bits`]).
    pub subpixel_bits: Option<u32>,
}

impl Default for TwinOptions {
    fn default() -> Self {
        Self {
            shading: None,
            reflection: None,
            flat_rule: None,
            specular_antialiasing: None,
            subpixel_bits: subpixel_bits(),
        }
    }
}

impl TwinFrame {
    /// Returns the pixels whose whole 3x3 neighbourhood shows one surface (for flat shading, one triangle), so that
    /// no rounding of coverage can show another one there, and whose triangle is certain to be drawn in its place.
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
                && !self.uncertain[y * self.width + x]
        };
        (0..self.height)
            .flat_map(|y| (0..self.width).map(move |x| (x, y)))
            .map(|(x, y)| inside(x, y).then(|| self.color[y * self.width + x]))
            .collect()
    }

    /// The same as [`interior`](Self::interior) without the background, which agrees too easily to be counted.
    pub fn inside_surfaces(&self, one_triangle: bool) -> Vec<Option<DVec3>> {
        let interior = self.interior(one_triangle);
        interior
            .iter()
            .zip(&self.surface)
            .map(|(color, surface)| color.filter(|_| surface.is_some()))
            .collect()
    }
}
