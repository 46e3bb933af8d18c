//! The picture viewer of the page: a large picture with a slider between it and its reference or its heat
//! map, and thumbnails of all pictures.

use maud::{Markup, html};

use super::Images;
use crate::findings::cost_of;
use crate::{Point, PointPicture, Study};

/// Returns the viewer of a study; empty for a study without pictures.
pub fn viewer(study: &Study, images: &Images<'_>) -> Markup {
    let shown: Vec<Shown<'_>> =
        study.points.iter().enumerate().filter_map(|point| Shown::of(point, images)).collect();
    let mut references: Vec<(&str, String)> = Vec::new();
    for shown in &shown {
        let name = shown.files.reference.as_str();
        if references.iter().any(|(known, _)| *known == name) {
            continue;
        }
        if let Some(picture) = images(name) {
            references.push((name, inline(&picture)));
        }
    }
    let reference_of = |shown: &Shown<'_>| {
        references.iter().find(|(name, _)| *name == shown.files.reference).map(|(_, inline)| inline.as_str())
    };
    let Some((first, reference)) = shown.first().and_then(|first| Some((first, reference_of(first)?))) else {
        return html! {};
    };
    let name = &study.name;
    html! {
        div class="viewer" {
            figure {
                div class="pair" {
                    img class="picture" src=(first.picture) alt=(format!("The picture of {}", first.title));
                    img class="other" src=(reference) alt="The reference, or a map of the differences from it";
                }
                label class="slider" {
                    span { "picture" }
                    input type="range" min="0" max="100" value="50" aria-label="Position of the boundary between the picture and what it is compared with";
                    span { "compared with" }
                }
                div class="choice" role="group" aria-label="What the picture is compared with" {
                    label { input type="radio" name=(format!("{name}-other")) value="reference" checked; "reference" }
                    label { input type="radio" name=(format!("{name}-other")) value="heat"; "heat map (FLIP)" }
                }
                figcaption { (first.title) ": " (first.cost) }
            }
            div class="gallery" {
                @for (place, shown) in shown.iter().enumerate() {
                    button type="button" aria-pressed=(if place == 0 { "true" } else { "false" })
                        data-point=(shown.number) data-reference=(shown.files.reference) data-heat=(shown.heat) data-cost=(shown.cost) {
                        img src=(shown.picture) alt="";
                        span { (shown.title) }
                    }
                }
                @for (name, picture) in &references {
                    figure class="reference" {
                        img src=(picture) alt="" data-name=(name);
                        figcaption { "reference" }
                    }
                }
            }
        }
    }
}

/// A point's picture, ready for the page.
struct Shown<'a> {
    /// Index of the point in its study.
    number: usize,
    files: &'a PointPicture,
    title: String,
    cost: String,
    picture: String,
    heat: String,
}

impl<'a> Shown<'a> {
    fn of((number, point): (usize, &'a Point), images: &Images<'_>) -> Option<Self> {
        let files = point.picture.as_ref()?;
        Some(Self {
            number,
            files,
            title: format!("{}, {}", point.series, point.label),
            cost: cost_of(point),
            picture: inline(&images(&files.picture)?),
            heat: inline(&images(&format!("{}.heat", files.picture))?),
        })
    }
}

/// The first bytes of every JPEG file.
const JPEG: &[u8] = &[0xff, 0xd8];

/// Returns a picture, a JPEG or a PNG, as a data URI.
fn inline(picture: &[u8]) -> String {
    let kind = if picture.starts_with(JPEG) { "jpeg" } else { "png" };
    format!("data:image/{kind};base64,{}", base64::encode(picture))
}
