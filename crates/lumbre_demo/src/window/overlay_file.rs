//! The overlay's information on the file: its name, cameras and notes, the running bake, and errors. Frame
//! times and settings are in `overlay`.

use egui::{Align2, Color32, ProgressBar, RichText, ScrollArea, Ui, vec2};

use super::viewing::{LightFacts, Message};
use crate::BakeStatus;

/// Height of the list of notes in logical pixels; longer lists scroll.
const NOTES_HEIGHT: f32 = 90.0;
/// Width of the bake's progress bar in logical pixels.
const BAR_WIDTH: f32 = 420.0;
/// Text colours of the overlay: secondary text, success, attention, and errors.
pub const DIM: Color32 = Color32::from_gray(150);
pub const GOOD: Color32 = Color32::from_rgb(140, 210, 120);
pub const WARM: Color32 = Color32::from_rgb(235, 180, 90);
const BAD: Color32 = Color32::from_rgb(255, 120, 100);

/// The state of the file for the overlay.
#[derive(Clone, Debug, Default)]
pub struct FileFacts {
    /// The file's name, without its folder.
    pub name: String,
    /// What was repaired, left out or added.
    pub notes: Vec<String>,
    /// A description of where the picture is taken from.
    pub viewpoint: String,
    /// The names of the cameras.
    pub cameras: Vec<String>,
    /// Whether another file is being dragged over the window.
    pub hovered: bool,
    /// The latest message.
    pub message: Option<Message>,
    /// Progress of the bake, if one runs.
    pub bake: Option<BakeStatus>,
    /// The light baked in this session, if it is shown.
    pub light: Option<LightFacts>,
    /// Whether the bake can be saved.
    pub can_save: bool,
}

/// Lays out the section on the file.
pub fn about(ui: &mut Ui, file: &FileFacts) {
    ui.label(RichText::new(&file.name).strong());
    if !file.cameras.is_empty() {
        let cameras = format!("cameras: {}", file.cameras.join(", "));
        ui.label(RichText::new(cameras).color(DIM).small());
    }
    if let Some(light) = file.light {
        let sky = if light.under_a_sky { ", under an even white sky, as nothing in it shines" } else { "" };
        let (pass, error, surfaces) = (light.pass, 100.0 * light.error, light.surfaces);
        let text = format!("baked light ({pass}) on {surfaces} surfaces, {error:.1} % off{sky}");
        ui.label(RichText::new(text).color(GOOD).small());
    }
    if !file.notes.is_empty() {
        let count = file.notes.len();
        let heading = if count == 1 { "1 note".to_owned() } else { format!("{count} notes on this file") };
        ui.label(RichText::new(heading).color(WARM).small());
        ScrollArea::vertical().id_salt("notes").max_height(NOTES_HEIGHT).show(ui, |ui| {
            for note in &file.notes {
                ui.label(RichText::new(note).small());
            }
        });
    }
}

/// Lays out the status line at the foot of the window, which is shown even if the overlay is off: what runs,
/// and what went wrong.
pub fn status(root: &Ui, file: &FileFacts) {
    if file.message.is_none() && file.bake.is_none() && !file.hovered {
        return;
    }
    let frame = egui::Frame::window(root.style()).fill(Color32::from_black_alpha(200));
    egui::Area::new(egui::Id::unique("status"))
        .anchor(Align2::CENTER_BOTTOM, vec2(0.0, -12.0))
        .interactable(false)
        .show(root.ctx(), |ui| {
            frame.show(ui, |ui| {
                ui.set_max_width(BAR_WIDTH);
                if file.hovered {
                    ui.label(RichText::new("let go to open the file").strong());
                }
                if let Some(message) = &file.message {
                    let color = if message.is_error { BAD } else { GOOD };
                    ui.label(RichText::new(&message.text).color(color));
                }
                if let Some(bake) = &file.bake {
                    progress(ui, bake);
                }
            })
        });
}

fn progress(ui: &mut Ui, bake: &BakeStatus) {
    let seconds = bake.elapsed.as_secs();
    let error = bake.error.map_or_else(String::new, |error| format!(", {:.1} % off", 100.0 * error));
    let text = format!("baking, {}: {}{error}, {seconds} s (Esc cancels)", bake.pass, bake.stage);
    ui.label(text);
    let percent = format!("{:.0} %", 100.0 * bake.fraction);
    ui.add(ProgressBar::new(bake.fraction).desired_width(BAR_WIDTH).text(percent));
}
