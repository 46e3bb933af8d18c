//! Document \[I\]'s matrices of one light source: the light that it emits, and the part that a surface reflects,
//! each by kind (ambient, diffuse, specular) and colour channel. The reflection equations themselves do not need
//! them: `shade` works without any matrix.

use glam::{DMat3, DVec3};

use crate::lambert::lambert;
use crate::shade::{SurfaceSample, specular_reflection};
use crate::{Light, LightSample, ReflectionModel};

/// L_i of document \[I\]: a row for each kind of light, a column for each channel.
///
/// ```text
///        red   green  blue
///     ┌ L_ra   L_ga   L_ba ┐  ambient
///     │ L_rd   L_gd   L_bd │  diffuse
///     └ L_rs   L_gs   L_bs ┘  specular
/// ```
///
/// The matrix is not attenuated, as in the document: [`scaled`](Self::scaled) by a light's distance and spot
/// factors, it is the light that arrives. Channels never mix.
///
/// ```
/// use glam::{DVec3, Vec3};
/// use lumbre_optics::{Light, LightMatrix, Material, ReflectionMatrix, ReflectionModel};
///
/// let mut lamp = Light::point(Vec3::ONE);
/// LightMatrix::from_rows([[0.1, 0.1, 0.2], [4.0, 3.0, 2.0], [1.0, 1.0, 1.0]]).put_into(&mut lamp);
/// let arriving = LightMatrix::from(&lamp).scaled(lamp.attenuation.factor(2.0));
///
/// let paper = Material::matt(Vec3::splat(0.5));
/// let reflected = ReflectionMatrix::new(ReflectionModel::Phong, &paper.front, DVec3::Y, DVec3::Y, DVec3::Y);
/// // Red: (0.5 · 0.1 + 0.5 · 4) / 2².
/// assert!((arriving.intensity(&reflected).x - 0.5125).abs() < 1e-8);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct LightMatrix {
    /// L_a: the first row, linear RGB, in the units of [`Light`].
    pub ambient: DVec3,
    /// L_d: the second row.
    pub diffuse: DVec3,
    /// L_s: the third row.
    pub specular: DVec3,
}

impl LightMatrix {
    /// No light.
    pub const BLACK: Self = Self { ambient: DVec3::ZERO, diffuse: DVec3::ZERO, specular: DVec3::ZERO };

    /// The matrix as the document writes it, row by row: ambient, diffuse, specular.
    pub fn from_rows([ambient, diffuse, specular]: [[f64; 3]; 3]) -> Self {
        Self { ambient: DVec3::from(ambient), diffuse: DVec3::from(diffuse), specular: DVec3::from(specular) }
    }

    /// The rows: ambient, diffuse, specular.
    pub fn rows(&self) -> [[f64; 3]; 3] {
        [self.ambient, self.diffuse, self.specular].map(|row| row.to_array())
    }

    /// The columns red, green and blue, each one (L_a, L_d, L_s).
    pub fn columns(&self) -> [DVec3; 3] {
        let (a, d, s) = (self.ambient, self.diffuse, self.specular);
        [DVec3::new(a.x, d.x, s.x), DVec3::new(a.y, d.y, s.y), DVec3::new(a.z, d.z, s.z)]
    }

    /// The same as one of glam's column-major matrices.
    pub fn to_matrix(&self) -> DMat3 {
        let [red, green, blue] = self.columns();
        DMat3::from_cols(red, green, blue)
    }

    /// Returns every entry times a factor, such as distance attenuation, a spot factor or a dimmer.
    pub fn scaled(self, factor: f64) -> Self {
        Self {
            ambient: self.ambient * factor,
            diffuse: self.diffuse * factor,
            specular: self.specular * factor,
        }
    }

    /// Returns every row times a colour, channel by channel, like a gel in front of the lamp.
    pub fn filtered(self, color: DVec3) -> Self {
        Self { ambient: self.ambient * color, diffuse: self.diffuse * color, specular: self.specular * color }
    }

    /// Returns I = R_a L_a + R_d L_d + R_s L_s, channel by channel, which is the diagonal of the product R L.
    pub fn intensity(&self, reflection: &ReflectionMatrix) -> DVec3 {
        reflection.ambient * self.ambient
            + reflection.diffuse * self.diffuse
            + reflection.specular * self.specular
    }

    /// Sets the colours of a light, rounded to f32, and leaves the rest of it unchanged.
    pub fn put_into(&self, light: &mut Light) {
        light.ambient = self.ambient.as_vec3();
        light.diffuse = self.diffuse.as_vec3();
        light.specular = self.specular.as_vec3();
    }
}

impl From<&Light> for LightMatrix {
    /// Takes the colours of a light before any attenuation, whether it is on or off.
    fn from(light: &Light) -> Self {
        Self {
            ambient: light.ambient.as_dvec3(),
            diffuse: light.diffuse.as_dvec3(),
            specular: light.specular.as_dvec3(),
        }
    }
}

impl From<&LightSample> for LightMatrix {
    /// Takes the light that arrives at a point, with its distance and spot factors.
    fn from(light: &LightSample) -> Self {
        let colors = Self { ambient: light.ambient, diffuse: light.diffuse, specular: light.specular };
        colors.scaled(light.attenuation * light.spot)
    }
}

impl std::ops::Add for LightMatrix {
    type Output = Self;

    /// The light of two lamps in one place.
    fn add(self, other: Self) -> Self {
        Self {
            ambient: self.ambient + other.ambient,
            diffuse: self.diffuse + other.diffuse,
            specular: self.specular + other.specular,
        }
    }
}

/// R_i of document \[I\]: the fraction of each kind of light that a point of a surface reflects to the viewer. In
/// the document a row is a channel and a column is a kind; here each field is a kind, as in [`LightMatrix`].
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct ReflectionMatrix {
    /// R_a = k_a.
    pub ambient: DVec3,
    /// R_d = k_d (n·l).
    pub diffuse: DVec3,
    /// R_s = k_s times the model's factor.
    pub specular: DVec3,
}

impl ReflectionMatrix {
    /// Returns the reflection terms of a point for light from the unit direction `light` (zero for ambient light
    /// alone) and a viewer in the unit direction `viewer`. The [`intensity`](LightMatrix::intensity) of an
    /// attenuated [`LightMatrix`] with it is the total of [`light_contribution`](crate::light_contribution).
    pub fn new(
        model: ReflectionModel,
        surface: impl Into<SurfaceSample>,
        normal: DVec3,
        light: DVec3,
        viewer: DVec3,
    ) -> Self {
        let surface = surface.into();
        Self {
            ambient: surface.ambient,
            diffuse: surface.diffuse * lambert(normal, light),
            specular: specular_reflection(model, &surface, normal, light, viewer),
        }
    }

    /// The matrix as the document writes it: rows red, green, blue, columns ambient, diffuse, specular.
    pub fn to_matrix(&self) -> DMat3 {
        DMat3::from_cols(self.ambient, self.diffuse, self.specular)
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::{Surface, evaluate_light, light_contribution};

    const ROWS: [[f64; 3]; 3] = [[0.125, 0.25, 0.5], [1.0, 2.0, 4.0], [8.0, 16.0, 32.0]];

    #[test]
    fn rows_are_kinds_and_columns_are_channels() {
        let matrix = LightMatrix::from_rows(ROWS);
        assert_eq!(matrix.rows(), ROWS);
        assert_eq!(matrix.diffuse, DVec3::new(1.0, 2.0, 4.0));
        assert_eq!(matrix.columns()[1], DVec3::new(0.25, 2.0, 16.0));
        assert_eq!(matrix.to_matrix().row(2), DVec3::new(8.0, 16.0, 32.0));
    }

    #[test]
    fn a_light_there_and_back() {
        let mut light = Light::point(Vec3::splat(9.0));
        LightMatrix::from_rows(ROWS).put_into(&mut light);
        assert_eq!(LightMatrix::from(&light), LightMatrix::from_rows(ROWS));
        assert_eq!(light.attenuation, Light::point(Vec3::ONE).attenuation);
        light.enabled = false;
        assert_eq!(LightMatrix::from(&light), LightMatrix::from_rows(ROWS));
    }

    #[test]
    fn factors_colours_and_sums() {
        let matrix = LightMatrix::from_rows(ROWS);
        assert_eq!(matrix.scaled(0.5) + matrix.scaled(0.5), matrix);
        assert_eq!(matrix.scaled(0.0), LightMatrix::BLACK);
        let red = matrix.filtered(DVec3::X);
        assert_eq!(red.columns(), [matrix.columns()[0], DVec3::ZERO, DVec3::ZERO]);
    }

    #[test]
    fn the_intensity_is_the_diagonal_of_the_product() {
        let light = LightMatrix::from_rows(ROWS);
        let (ambient, diffuse) = (DVec3::new(0.5, 0.25, 1.0), DVec3::new(1.0, 0.5, 0.25));
        let reflection = ReflectionMatrix { ambient, diffuse, specular: DVec3::splat(0.125) };
        let product = reflection.to_matrix() * light.to_matrix();
        let diagonal = DVec3::new(product.x_axis.x, product.y_axis.y, product.z_axis.z);
        // The numbers are exact binary fractions: red is .5 · .125 + 1 · 1 + .125 · 8.
        assert_eq!(light.intensity(&reflection), diagonal);
        assert_eq!(diagonal.x, 2.0625);
    }

    #[test]
    fn it_is_the_lighting_equation() {
        let surface = Surface {
            ambient: Vec3::new(0.3, 0.2, 0.1),
            diffuse: Vec3::new(0.5, 0.6, 0.7),
            specular: Vec3::new(0.9, 0.8, 0.4),
            shininess: 9.0,
            ..Surface::default()
        };
        let mut light = Light::point(Vec3::ONE);
        LightMatrix::from_rows(ROWS).put_into(&mut light);
        let sample = evaluate_light(&light, DVec3::new(1.0, 2.0, 0.5), -DVec3::Y, DVec3::ZERO);
        let viewer = DVec3::new(-0.6, 0.8, 0.0);
        for &model in ReflectionModel::ALL {
            let reflection = ReflectionMatrix::new(model, &surface, DVec3::Y, sample.direction, viewer);
            let arriving = LightMatrix::from(&light).scaled(sample.attenuation * sample.spot);
            assert_eq!(arriving, LightMatrix::from(&sample));
            let expected = light_contribution(model, &surface, &sample, DVec3::Y, viewer).total();
            // The same products in another order.
            let got = arriving.intensity(&reflection);
            assert!((got - expected).abs().max_element() < 1e-14, "{model:?}: {got} {expected}");
        }
    }
}
