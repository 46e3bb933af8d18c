//! A light as the frames of a scene show it: its range is limited where it becomes too dim, it casts a shadow
//! only if the scene's frames have shadows, and it has a size only if these have a penumbra. Light records and bakes are not handled here.

use std::borrow::Cow;

use lumbre_optics::{Light, LightKind};
use lumbre_scene::{FrameSettings, ShadowFilter};

/// Returns the light with the range that follows from the threshold, if that is less than its own, without a
/// shadow if the settings leave shadows out, and with a size only for soft shadows. The light is cloned only if something differs.
pub(super) fn shown_light<'a>(light: &'a Light, settings: &FrameSettings) -> Cow<'a, Light> {
    let mut shown = Cow::Borrowed(light);
    let range = range(light, settings.light_threshold);
    if range < light.attenuation.range {
        shown.to_mut().attenuation.range = range;
    }
    if light.shadow && !settings.shadows {
        shown.to_mut().shadow = false;
    }
    let has_size = light.shadow && (light.radius > 0.0 || light.angle > 0.0);
    if has_size && settings.shadow_filter != ShadowFilter::Soft {
        let shown = shown.to_mut();
        (shown.radius, shown.angle) = (0.0, 0.0);
    }
    shown
}

/// Returns the distance in metres at which the strongest channel falls to the threshold on a white surface
/// that faces the light; infinity if it never does or if there is no threshold.
fn range(light: &Light, threshold: f32) -> f32 {
    let strongest = light.ambient.max(light.diffuse).max(light.specular).max_element();
    // Neither a threshold of NaN nor a black light limits the range.
    if light.kind != LightKind::Point || !(threshold > 0.0 && strongest > 0.0) {
        return f32::INFINITY;
    }
    let reach = light.attenuation.reach(f64::from(threshold) / f64::from(strongest));
    // A range must be positive, so a light that ends at once gets a tiny range.
    (reach as f32).max(1e-6)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use lumbre_optics::Attenuation;

    use super::*;

    fn ended(light: &Light, light_threshold: f32) -> f32 {
        let settings = FrameSettings { light_threshold, ..FrameSettings::default() };
        shown_light(light, &settings).attenuation.range
    }

    #[test]
    fn a_lamp_ends_where_it_falls_to_the_threshold() {
        let lamp = Light::point(Vec3::new(1.0, 4.0, 2.0));
        // 4 / d² = 0.01.
        assert!((ended(&lamp, 0.01) - 20.0).abs() < 1e-4);
        assert_eq!(ended(&lamp, 0.0), f32::INFINITY);
        assert_eq!(ended(&lamp, f32::NAN), f32::INFINITY);
        assert_eq!(ended(&lamp.clone().with_range(3.0), 0.01), 3.0);
        assert_eq!(ended(&Light { attenuation: Attenuation::NONE, ..lamp.clone() }, 0.01), f32::INFINITY);
        // The light is nowhere as bright as the threshold.
        let faint = Attenuation { constant: 1.0, ..Attenuation::INVERSE_SQUARE };
        assert!(ended(&Light { attenuation: faint, ..lamp }, 5.0) < 1e-3);
        assert_eq!(ended(&Light::directional(Vec3::ONE), 5.0), f32::INFINITY);
    }

    #[test]
    fn only_soft_shadows_know_a_size() {
        let lamp = Light { radius: 0.3, shadow: true, ..Light::point(Vec3::ONE) };
        let radius = |light: &Light, shadow_filter| {
            shown_light(light, &FrameSettings { shadow_filter, ..FrameSettings::default() }).radius
        };
        assert_eq!(radius(&lamp, ShadowFilter::Soft), 0.3);
        assert_eq!(radius(&lamp, ShadowFilter::PercentageCloser), 0.0);
        assert_eq!(radius(&lamp, ShadowFilter::Hard), 0.0);
        assert_eq!(radius(&Light { shadow: false, ..lamp }, ShadowFilter::Hard), 0.3);
    }
}
