//! Conversion from glTF's roughness to Phong's exponent. The rest of the mapping is
//! `Material::from_metallic_roughness`.

/// Largest exponent in use: 10⁶. Larger ones are clamped.
pub const MAX_SHININESS: f32 = 1e6;

/// Returns the Phong exponent for a glTF roughness: n = 2/α² - 2 with α = roughness², clamped to [0, 10⁶] (beyond
/// which f32 cannot tell the highlight from a point).
///
/// # Error of the f32 twin
///
/// 9 u of n + 2: α is off by u, its square by 3 u, the quotient 2/α² by 8 u, from which 2 is subtracted.
pub fn shininess_from_roughness(roughness: f32) -> f32 {
    let alpha = roughness.clamp(0.0, 1.0).powi(2).max(1e-6);
    (2.0 / (alpha * alpha) - 2.0).clamp(0.0, MAX_SHININESS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shininess_from_roughness_at_its_ends() {
        assert_eq!(shininess_from_roughness(1.0), 0.0);
        assert_eq!(shininess_from_roughness(2.0), 0.0);
        assert_eq!(shininess_from_roughness(0.0), MAX_SHININESS);
        assert_eq!(shininess_from_roughness(-1.0), MAX_SHININESS);
        // α = 1/4: 2·16 - 2.
        assert_eq!(shininess_from_roughness(0.5), 30.0);
    }
}
