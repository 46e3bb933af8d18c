//! The hard cases of lighting and rasterizing, each with the value that it must give and the bound that it must
//! keep. `cargo test --workspace --test hard_cases -- --nocapture table` prints them all; each is also a separate
//! test.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

#[path = "../frames/adapter.rs"]
#[allow(dead_code, reason = "shared with the frame tests, which use all of it")]
mod adapter;
mod case;
mod files;
mod frames;
mod functions;
mod highlights;
mod lists;
mod many_lights;
mod normals;
mod overflow;
mod places;
mod probe;
mod spots;
mod table;

use table::Table;

/// The rows of the list in order, each with how it is handled; and two that hold for every frame.
const ROWS: [(&str, &str); 19] = [
    (
        "normal of length 0",
        "Such a vector stays the zero vector (`v * inverseSqrt(max(v.v, 1e-30))`). A file's zero normals and averages that cancel become those of the faces around them, and the mesh is named once; a zero that code puts into a mesh takes ambient light only, as in OpenGL, and flat shading has the face's own.",
    ),
    (
        "light at the surface, d = 0 and a = b = 0",
        "The denominator never falls below what b and c give at a centimetre, so an inverse-square light is at most 10^4 times its colour; at its very place it has no direction and adds its ambient part. OpenGL's division by zero shows 1 after its clamp, and so does ours.",
    ),
    (
        "l = -v, half vector 0",
        "l + v is added first and made unit from its own length; everything is gated on n.l > 0.",
    ),
    (
        "pow(0, 0), pow(negative, n), n = 0",
        "x^0 is 1, x^n of a base of 0 or less is 0, chosen and not left to the device.",
    ),
    (
        "n = 1 to 10^6",
        "Plain pow up to 256; above it cos^n comes from the sine, |n x h|^2. Frames are looked at where the highlight has 100, 99, 90, 50, 10 and 1 % of its peak, for Phong and Blinn-Phong; the farthest is shown.",
    ),
    (
        "specular aliasing",
        "Where the scene asks for it the lobe is widened by what the normals change within a pixel, and its peak falls, so that the light in the frame stays.",
    ),
    (
        "grazing v, Fresnel at 90 degrees, the critical angle",
        "Divisors have floors, total reflection is a branch, (1 - s)(1 + s) is not 1 - s^2.",
    ),
    (
        "spot cutoff 0, 90, 180; inner = outer; exponent 0, 128; direction 0",
        "Cosines come from the CPU; the smooth edge is at least .001 wide in the cosine; an axis that a transform scales away is -Z. Frames are compared with f64 at every pixel, the farthest is shown.",
    ),
    (
        "attenuation (0,0,0), negative, not a number; intensity 0, 1e-30, 1e30; colour infinite",
        "Refused at load, by the light's name.",
    ),
    (
        "the largest product stays below the target's overflow",
        "Lights are at most 10^30 at their strongest, coefficients and vertex colours are used up to 1000, emission, ambient light and fog up to 10^30, so no product leaves f32 (times a cosine of 0 it would be no number); half floats take what is brighter than 65504 as that.",
    ),
    (
        "0, 1, 10 000 lights; all in one place; all behind the camera; a light larger than the world",
        "No light is left out but where its range window is 0: the closed-form sum at every pixel. More entries than the device's buffer holds are refused by name and never stored (`light_lists::tests::lists_beyond_the_devices_buffer_are_refused_and_not_stored`).",
    ),
    (
        "lists of lights: around, beside and behind the camera, at the end of a range, empty",
        "In place of clusters each object has the exact list of lights whose range reaches its box; no logarithm of a depth is taken anywhere.",
    ),
    (
        "depth: near 1e-3, far 1e6; coplanar faces",
        "Reversed-Z in f32, infinitely far: planes a millionth of their distance apart are told apart from 2 mm to 1000 km. Of fragments equally far the one drawn last is seen; objects are drawn nearest first (by the farthest depth of their boxes, then the smaller ones), as near ones in the order of their making.",
    ),
    (
        "world at 10^5 to 10^7 m from the origin",
        "Places are f64 until the camera's is subtracted: the frame is that at the origin.",
    ),
    (
        "singular or mirroring transform, scale 0 or negative, non-uniform scale",
        "Normals by the cofactor matrix, winding by the determinant's sign.",
    ),
    (
        "Gouraud with a spot inside one triangle",
        "An unlit middle is what shading per vertex means; `lumbre explain` names each cone whose axis meets a triangle between the points where it is lit.",
    ),
    (
        "zero-size window, 1x1, minimised, resize each frame, device lost",
        "Typed errors, or the right picture. The window itself, minimised, resized and losing its device twice, is in crates/lumbre_demo/tests/window.rs.",
    ),
    (
        "NaN in any frame",
        "No number that code can put into a light, a material, a mesh or a fog reaches a frame as NaN or infinity; what is left out is named in `FrameReport::left_out` and logged once. The probe looks into every float texture after the pass that wrote it, and finds what is put there.",
    ),
    ("fog", "A fog of no length is a step, and nothing overflows at any distance."),
];

/// Returns every case, by row.
fn whole() -> Table {
    let cases = [
        functions::cases(),
        normals::cases(),
        highlights::cases(),
        spots::cases(),
        files::cases(),
        frames::cases(),
        places::cases(),
        many_lights::cases(),
        lists::cases(),
        overflow::cases(),
        probe::cases(),
    ];
    Table::new("Hard cases of lighting and rasterizing", &ROWS, cases.concat())
}

/// Runs all cases and prints the table. With LUMBRE_WRITE_TABLES=1 it is also written to its part of
/// docs/hard-cases.md.
#[test]
fn table() {
    let about = format!(
        ", on {}. Where a case compares many values, the one farthest from its expectation is shown. u is 2^-24, a rounding of f32.",
        adapter::gpu().describe()
    );
    whole().print("cargo test --workspace --test hard_cases -- --nocapture table", &about);
}

#[test]
fn the_page_lists_these_cases() {
    whole().in_step();
}

#[test]
fn a_case_can_fail() {
    use case::Outcome;
    assert!(!Outcome::number(1.0, 1.1, 0.05, "").passes());
    assert!(!Outcome::number(1.0, f64::NAN, 10.0, "").passes());
    assert!(!Outcome::number(1.0, f64::INFINITY, f64::INFINITY, "").passes());
    assert!(!Outcome::text("lamp", "some light is wrong".to_owned()).passes());
}
