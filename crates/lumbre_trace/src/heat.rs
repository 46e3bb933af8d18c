//! Colour map of the heat maps that show differences.

/// Maps 0 to black, 1 to white, and values between to violet, red and yellow, brighter with increasing value,
/// so that it also works in print without colours. Values outside [0, 1] are clamped.
pub fn heat_color(value: f64) -> [u8; 3] {
    const STOPS: [[f64; 3]; 5] =
        [[0.0, 0.0, 0.02], [0.34, 0.06, 0.43], [0.74, 0.21, 0.33], [0.98, 0.56, 0.04], [0.99, 1.0, 0.64]];
    let place = value.clamp(0.0, 1.0) * (STOPS.len() - 1) as f64;
    let below = (place as usize).min(STOPS.len() - 2);
    let part = place - below as f64;
    [0, 1, 2].map(|channel| {
        let (low, high) = (STOPS[below][channel], STOPS[below + 1][channel]);
        (255.0 * (low + (high - low) * part)).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::heat_color;

    #[test]
    fn the_farther_apart_the_brighter() {
        let brightness = |value: f64| heat_color(value).map(u32::from).iter().sum::<u32>();
        for step in 0..20 {
            let (low, high) = (f64::from(step) / 20.0, f64::from(step + 1) / 20.0);
            assert!(brightness(low) < brightness(high), "{low} and {high}");
        }
        assert_eq!((heat_color(-1.0), heat_color(9.0)), (heat_color(0.0), heat_color(1.0)));
    }
}
