//! Letters of five by seven dots, like those of character displays.

use image::{Rgb, RgbImage};

/// The columns from left to right, with the lowest bit at the top, from the space to the tilde.
const DOTS: [[u8; 5]; 95] = include!("dots.in");

/// Pixels of a dot, and of a letter including the space after it.
const DOT: u32 = 2;
pub const ADVANCE: u32 = 6 * DOT;
/// Height of a line of letters.
pub const HEIGHT: u32 = 8 * DOT;

/// Returns the width of a text in pixels.
pub fn width(text: &str) -> u32 {
    text.chars().count() as u32 * ADVANCE - DOT
}

/// Writes a text with its upper left corner at a position; characters without a letter are left blank.
pub fn write(picture: &mut RgbImage, text: &str, [left, top]: [i64; 2], color: Rgb<u8>) {
    for (place, letter) in (0i64..).zip(text.chars()) {
        let columns = (letter as usize).checked_sub(32).and_then(|index| DOTS.get(index));
        for (column, bits) in (0i64..).zip(columns.into_iter().flatten()) {
            for row in (0..8i64).filter(|row| bits >> row & 1 == 1) {
                let dot = i64::from(DOT);
                for pixel in 0..dot * dot {
                    let x = left + place * i64::from(ADVANCE) + column * dot + pixel % dot;
                    put(picture, [x, top + row * dot + pixel / dot], color);
                }
            }
        }
    }
}

/// Sets a pixel if it is inside the picture.
pub fn put(picture: &mut RgbImage, [x, y]: [i64; 2], color: Rgb<u8>) {
    let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y)) else { return };
    if let Some(pixel) = picture.get_pixel_mut_checked(x, y) {
        *pixel = color;
    }
}
