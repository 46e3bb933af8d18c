//! Occlusion textures: the fraction of the indirect light that reaches a texel. These are not shadows: direct light
//! is not affected.

/// Returns 1 + strength (texel - 1), as glTF defines it: the factor for ambient terms and lightmaps.
///
/// # Error of the f32 twin
///
/// 3 u of 1 + 2 |strength|.
pub fn occlusion(texel: f64, strength: f64) -> f64 {
    1.0 + strength * (texel - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strength_goes_from_none_to_all() {
        assert_eq!(occlusion(0.25, 0.0), 1.0);
        assert_eq!(occlusion(0.25, 1.0), 0.25);
        assert_eq!(occlusion(0.25, 0.5), 0.625);
        assert_eq!(occlusion(1.0, 1.0), 1.0);
    }
}
