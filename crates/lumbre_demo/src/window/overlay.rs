//! The contents of the overlay: frame times, passes, counts and settings. The section on the file is in
//! `overlay_file`, and the painting in `overlay_painter`.

use std::collections::VecDeque;

use egui::{Color32, RichText, Sense, Stroke, Ui, pos2, vec2};
use lumbre_graph::{GpuTime, PassExplanation, PassReport};
use lumbre_render::FrameReport;

use super::accuracy::AccuracyFacts;
use super::overlay_accuracy::Wishes;
pub use super::overlay_file::FileFacts;
use super::overlay_file::{DIM, GOOD, WARM};
use super::{overlay_accounting, overlay_accuracy, overlay_file};
use crate::ViewSettings;

/// Frames in the graph: two seconds at 60 frames per second.
const GRAPH_FRAMES: usize = 120;
/// Size of the graph in logical pixels.
const GRAPH_SIZE: egui::Vec2 = vec2(330.0, 56.0);

/// The state that the overlay shows, apart from the report on the frame.
#[derive(Clone, Debug, Default)]
pub struct Facts {
    /// The names of the adapter and its driver.
    pub device: String,
    /// Size of the frame in pixels.
    pub size: (u32, u32),
    /// The choices made by keys.
    pub view: ViewSettings,
    /// Whether the torch is on.
    pub torch: bool,
    /// Whether the picture is taken from the player's eyes.
    pub is_player: bool,
    /// Whether the player flies.
    pub flying: bool,
    /// Whether the mouse is grabbed and turns the view.
    pub grabbed: bool,
    /// Position of the player's feet, metres.
    pub feet: glam::DVec3,
    /// Whether the file is a level to walk through.
    pub is_level: bool,
    /// The factor on radiance, if it differs from the camera's.
    pub exposure: Option<f32>,
    /// Whether the exposure adapts.
    pub adapts: bool,
    /// The file.
    pub file: FileFacts,
    /// The results of the accuracy measurements.
    pub accuracy: AccuracyFacts,
}

/// The overlay and its state.
pub struct Overlay {
    /// egui's context; created again with every device, because it tracks which fonts were uploaded.
    pub context: egui::Context,
    /// Whether panels fade in over a few frames.
    fades: bool,
    frame_ms: VecDeque<f32>,
    /// The reference picture of the view.
    reference: Option<egui::TextureHandle>,
    /// Where the frame ends and the reference begins, as a fraction of the width from the left.
    split: f32,
}

impl Default for Overlay {
    fn default() -> Self {
        Self {
            context: egui::Context::default(),
            fades: true,
            frame_ms: VecDeque::default(),
            reference: None,
            split: 0.5,
        }
    }
}

/// The layout of one frame of the overlay, and the user's requests in it.
pub struct LaidOut {
    /// What is to be painted; its texture changes have to be applied.
    pub output: egui::FullOutput,
    /// The user's requests.
    pub wishes: Wishes,
}

impl Overlay {
    /// Creates an overlay whose panels are fully there from the first frame that shows them.
    pub fn without_fading() -> Self {
        let mut overlay = Self { fades: false, ..Self::default() };
        overlay.forget_device();
        overlay
    }

    /// Adds the duration of a frame, milliseconds.
    pub fn note_frame(&mut self, milliseconds: f32) {
        self.frame_ms.push_back(milliseconds);
        while self.frame_ms.len() > GRAPH_FRAMES {
            self.frame_ms.pop_front();
        }
    }

    /// Starts with a new context for a new device, to which the fonts have to be uploaded.
    pub fn forget_device(&mut self) {
        // The texture belongs to the old context.
        self.reference = None;
        self.context = egui::Context::default();
        if !self.fades {
            self.context.all_styles_mut(|style| style.animation_time = 0.0);
        }
    }

    /// Shows this reference from now on: `size` in pixels, and RGBA bytes.
    pub fn show_reference(&mut self, size: (u32, u32), rgba: &[u8]) {
        let image = egui::ColorImage::from_rgba_unmultiplied([size.0 as usize, size.1 as usize], rgba);
        let options = egui::TextureOptions::NEAREST;
        match &mut self.reference {
            Some(texture) => texture.set(image, options),
            None => self.reference = Some(self.context.load_texture("reference", image, options)),
        }
    }

    /// Removes the reference.
    pub fn forget_reference(&mut self) {
        self.reference = None;
    }

    /// Lays out the overlay of one frame.
    #[must_use]
    pub fn lay_out(&mut self, input: egui::RawInput, facts: &Facts, report: Option<&FrameReport>) -> LaidOut {
        let (context, mut split, mut wishes) = (self.context.clone(), self.split, Wishes::default());
        let output = context.run_ui(input, |root| {
            if let (true, Some(reference)) = (facts.accuracy.is_shown, &self.reference) {
                overlay_accuracy::reference_beside(root, reference, &mut split);
            }
            overlay_file::status(root, &facts.file);
            if facts.accuracy.is_shown {
                let accounting = report.and_then(|report| report.accounting.as_deref());
                // egui may lay out a frame twice; the first request counts.
                let asked = overlay_accuracy::panel(root, &facts.accuracy, accounting);
                wishes = Wishes { settings: wishes.settings.or(asked.settings) };
            }
            if !facts.view.overlay {
                return;
            }
            let frame = egui::Frame::window(root.style()).fill(Color32::from_black_alpha(190));
            egui::Window::new("Lumbre")
                .frame(frame)
                .default_pos([10.0, 10.0])
                .resizable(false)
                .default_width(GRAPH_SIZE.x)
                .show(root.ctx(), |ui| self.contents(ui, facts, report));
        });
        self.split = split;
        LaidOut { output, wishes }
    }

    fn contents(&self, ui: &mut Ui, facts: &Facts, report: Option<&FrameReport>) {
        overlay_file::about(ui, &facts.file);
        ui.separator();
        let mean = self.frame_ms.iter().sum::<f32>() / self.frame_ms.len().max(1) as f32;
        let worst = self.frame_ms.iter().copied().fold(0.0, f32::max);
        let rate = if mean > 0.0 { 1000.0 / mean } else { 0.0 };
        ui.label(
            RichText::new(format!("{mean:.2} ms  ({rate:.0} per second, worst {worst:.1} ms)")).strong(),
        );
        graph(ui, &self.frame_ms, mean);
        ui.label(
            RichText::new(format!("{}, {} x {}", facts.device, facts.size.0, facts.size.1))
                .color(DIM)
                .small(),
        );
        if let Some(report) = report {
            let heading = egui::CollapsingHeader::new("what a frame does and costs");
            heading.default_open(facts.is_level).show(ui, |ui| {
                passes(ui, report, facts.view.count_lights);
                if let Some(accounting) = &report.accounting {
                    overlay_accounting::account(ui, accounting);
                }
                ui.separator();
                counts(ui, report);
            });
        }
        ui.separator();
        choices(ui, facts);
    }
}

/// Draws the durations of the last frames as a graph, with lines at 60 and 30 frames per second if they fit.
fn graph(ui: &mut Ui, frame_ms: &VecDeque<f32>, mean: f32) {
    let (response, painter) = ui.allocate_painter(GRAPH_SIZE, Sense::hover());
    let area = response.rect;
    painter.rect_filled(area, 2.0, Color32::from_black_alpha(120));
    let top = (2.0 * mean).max(20.0);
    let height = |milliseconds: f32| area.bottom() - area.height() * (milliseconds / top).min(1.0);
    for mark in [1000.0 / 60.0, 1000.0 / 30.0] {
        if mark < top {
            painter.hline(area.x_range(), height(mark), Stroke::new(1.0, Color32::from_gray(70)));
        }
    }
    let step = area.width() / (GRAPH_FRAMES - 1) as f32;
    let first = area.right() - step * frame_ms.len().saturating_sub(1) as f32;
    let line =
        frame_ms.iter().enumerate().map(|(i, &ms)| pos2(first + step * i as f32, height(ms))).collect();
    painter.line(line, Stroke::new(1.5, GOOD));
}

/// Lists every pass of the frame's plan: how long it took, or why it does not run.
fn passes(ui: &mut Ui, report: &FrameReport, counts_lights: bool) {
    let explanation = report.plan.explain();
    let measured = report.measured.as_ref();
    let lights = if counts_lights { "lights tested (contributing)" } else { "" };
    egui::Grid::new("passes").num_columns(5).spacing([10.0, 2.0]).show(ui, |ui| {
        for heading in ["pass", "CPU ms", "GPU ms", lights, ""] {
            ui.label(RichText::new(heading).color(DIM).small());
        }
        ui.end_row();
        for pass in &explanation.passes {
            let times = measured.and_then(|frame| frame.passes.iter().find(|one| *one.name == *pass.name));
            let account = report.accounting.as_ref();
            let account = account.and_then(|account| account.passes.iter().find(|one| one.pass == pass.name));
            pass_row(ui, pass, times, &overlay_accounting::lights(account));
        }
        if let Some(frame) = measured {
            ui.label(RichText::new("whole frame").strong());
            ui.label(milliseconds(frame.cpu_ms));
            ui.label(milliseconds(frame.gpu_ms));
            ui.end_row();
        }
    });
}

fn pass_row(ui: &mut Ui, pass: &PassExplanation, times: Option<&PassReport>, lights: &str) {
    if pass.status.runs() {
        ui.label(RichText::new(&pass.name).color(GOOD));
        ui.label(milliseconds(times.and_then(|times| times.cpu_ms)));
        let shared = matches!(times.map(|times| times.gpu), Some(GpuTime::Group { .. }));
        let mark = if shared { " (with others)" } else { "" };
        ui.label(milliseconds(times.and_then(|times| times.gpu.ms())) + mark);
        ui.label(lights);
        ui.label(RichText::new(pass.status.reason()).color(DIM).small());
    } else {
        ui.label(RichText::new(&pass.name).color(DIM));
        ui.label("");
        ui.label("");
        ui.label("");
        let reason = format!("{}: {}", pass.status.word(), pass.status.reason());
        ui.label(RichText::new(reason).color(WARM).small());
    }
    ui.end_row();
}

fn milliseconds(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.3}"))
}

fn counts(ui: &mut Ui, report: &FrameReport) {
    let counts = &report.statistics;
    let lights = counts.lights;
    ui.label(format!("{lights} lights, {} of them static", counts.static_lights));
    ui.label(format!(
        "{} triangles of {} objects in {} draw calls",
        counts.triangles, counts.objects, counts.draws
    ));
    let (outside, pipelines, bytes) = (counts.objects_outside, counts.pipelines_made, counts.uploads.total());
    let awaited = match counts.pipelines_awaited {
        0 => String::new(),
        awaited => format!(" and {awaited} being made"),
    };
    let rest =
        format!("{outside} objects out of view, {pipelines} pipelines{awaited}, {bytes} bytes uploaded");
    ui.label(RichText::new(rest).color(DIM).small());
    let lines = report.census.lines();
    let called_for: Vec<_> = lines.iter().filter(|line| line.called_for).map(|line| line.effect).collect();
    ui.label(RichText::new(format!("the scene calls for {}", called_for.join(", "))).color(DIM).small());
}

/// Lists what can be changed, with the keys.
fn choices(ui: &mut Ui, facts: &Facts) {
    let view = &facts.view;
    let shading = view.shading.map_or("as the file asks".to_owned(), |shading| shading.to_string());
    let reflection = view.reflection.map_or("as the file asks", |model| model.name());
    let switch = |on: bool| if on { "on" } else { "off" };
    let exposure = match (facts.exposure, facts.adapts) {
        (Some(factor), true) => format!("{factor:.3e} ({:.1} EV), adapts", exposure_value(factor)),
        (Some(factor), false) => format!("{factor:.3e}"),
        (None, _) => "the camera's".to_owned(),
    };
    let bake = if facts.file.bake.is_some() { "runs; again or Esc cancels" } else { "in the background" };
    egui::Grid::new("choices").num_columns(3).spacing([10.0, 2.0]).show(ui, |ui| {
        for (key, what, state) in [
            ("O, Home", "show everything", facts.file.viewpoint.as_str()),
            ("V", "next camera", if facts.file.cameras.is_empty() { "the file has none" } else { "" }),
            ("B", "bake", bake),
            ("K", "keep the bake", if facts.file.can_save { "ready" } else { "when it is done" }),
            ("E", "exposure", &exposure),
            ("1 2 3, G", "shading", shading.as_str()),
            ("R", "reflection", reflection),
            ("L", "baked light", switch(view.lightmaps)),
            ("M", "multisampling", switch(view.multisample)),
            ("X", "reference beside it", switch(facts.accuracy.is_shown)),
            ("P", "price of lights, settings", if facts.accuracy.front.is_some() { "measured" } else { "" }),
            (", .", "cheaper, better", if facts.accuracy.front.is_some() { "" } else { "once measured" }),
            ("T", "torch", switch(facts.torch)),
            ("F", "flight", if facts.is_player { switch(facts.flying) } else { "" }),
            ("N", "counts of lights", switch(view.count_lights)),
            ("Tab, F1", "this overlay", "on"),
        ] {
            ui.label(RichText::new(key).color(WARM));
            ui.label(what);
            ui.label(state);
            ui.end_row();
        }
    });
    let keys = match (facts.is_player, facts.grabbed) {
        (true, true) => "Esc frees the mouse; W A S D walk, Shift runs, Space jumps, Q quits",
        (true, false) => "click to look around; W A S D walk, Shift runs, Space jumps, Q quits",
        (false, _) => {
            "drag: left turns, right or middle shifts, the wheel zooms; W A S D set out; drop a file to open it; Q quits"
        }
    };
    ui.label(RichText::new(keys).color(DIM).small());
    if facts.is_player {
        let feet = facts.feet;
        let place = format!("at {:.1}, {:.1}, {:.1} m", feet.x, feet.y, feet.z);
        ui.label(RichText::new(place).color(DIM).small());
    }
}

/// Returns the exposure value at ISO 100 of a factor on radiance.
fn exposure_value(factor: f32) -> f64 {
    -(1.2 * f64::from(factor)).log2()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the texts of a frame, and the opacity of the faintest, 0 to 1.
    fn texts_and_opacity(overlay: &mut Overlay, facts: &Facts) -> (String, f32) {
        fn collect(shape: &egui::Shape, text: &mut String, opacity: &mut f32) {
            match shape {
                egui::Shape::Text(one) => {
                    text.push_str(one.galley.text());
                    text.push('\n');
                    let vertices = one.galley.rows.iter().flat_map(|row| &row.visuals.mesh.vertices);
                    let strongest = vertices.map(|vertex| vertex.color.a()).max().unwrap_or(u8::MAX);
                    *opacity = opacity.min(f32::from(strongest) / 255.0);
                }
                egui::Shape::Vec(shapes) => shapes.iter().for_each(|shape| collect(shape, text, opacity)),
                _ => {}
            }
        }
        let input = || egui::RawInput {
            screen_rect: Some(egui::Rect::from_min_size(egui::Pos2::ZERO, vec2(1280.0, 900.0))),
            ..egui::RawInput::default()
        };
        // egui lays out a window in its first frame and shows it in its second.
        overlay.lay_out(input(), facts, None).output.drop_without_applying_deltas();
        let (mut text, mut opacity) = (String::new(), 1.0);
        let output = overlay.lay_out(input(), facts, None).output;
        for clipped in &output.shapes {
            collect(&clipped.shape, &mut text, &mut opacity);
        }
        output.drop_without_applying_deltas();
        (text, opacity)
    }

    fn texts(overlay: &mut Overlay, facts: &Facts) -> String {
        texts_and_opacity(overlay, facts).0
    }

    /// Facts of a frame without the overlay, after a file could not be opened.
    fn with_an_error(text: &str) -> Facts {
        let mut facts =
            Facts { view: ViewSettings { overlay: false, ..ViewSettings::default() }, ..Facts::default() };
        facts.file.message = Some(super::super::viewing::Message { text: text.to_owned(), is_error: true });
        facts
    }

    #[test]
    fn says_how_long_frames_take_and_what_is_chosen() {
        let mut overlay = Overlay::default();
        for _ in 0..500 {
            overlay.note_frame(20.0);
        }
        assert_eq!(overlay.frame_ms.len(), GRAPH_FRAMES);
        let mut facts = Facts { device: "a test device".into(), size: (640, 480), ..Facts::default() };
        facts.view.shading = Some(lumbre_optics::Shading::Gouraud);
        facts.torch = true;
        let text = texts(&mut overlay, &facts);
        for wanted in
            ["20.00 ms  (50 per second", "a test device, 640 x 480", "gouraud", "torch", "as the file asks"]
        {
            assert!(text.contains(wanted), "{wanted} is not in:\n{text}");
        }
    }

    #[test]
    fn says_what_is_known_of_the_file_and_what_the_bake_does() {
        let mut facts = Facts { exposure: Some(1e-3), adapts: true, ..Facts::default() };
        facts.file = FileFacts {
            name: "room.glb".into(),
            notes: (0..20).map(|index| format!("node {index}: left out")).collect(),
            cameras: vec!["door".into(), "window".into()],
            viewpoint: "camera door".into(),
            bake: Some(crate::BakeStatus {
                pass: "draft",
                stage: "final gather",
                fraction: 0.37,
                error: Some(0.042),
                elapsed: std::time::Duration::from_secs(12),
            }),
            ..FileFacts::default()
        };
        let text = texts(&mut Overlay::default(), &facts);
        for wanted in [
            "room.glb",
            "node 0: left out",
            "20 notes",
            "door, window",
            "camera door",
            "draft",
            "final gather",
            "37 %",
            "4.2 %",
            "12 s",
            "Esc cancels",
            "9.7 EV",
        ] {
            assert!(text.contains(wanted), "{wanted} is not in:\n{text}");
        }
    }

    #[test]
    fn an_error_is_said_even_if_the_overlay_is_off() {
        let text = "broken.glb: is no glTF file";
        assert_eq!(texts(&mut Overlay::default(), &with_an_error(text)).trim(), text);
    }

    #[test]
    fn without_fading_a_text_is_fully_there_at_once_on_every_device() {
        let facts = with_an_error("broken.glb: is no glTF file");
        let (_, opacity) = texts_and_opacity(&mut Overlay::default(), &facts);
        assert!(opacity < 1.0, "this test sees no fading: {opacity}");
        let mut overlay = Overlay::without_fading();
        for device in 0..2 {
            let (text, opacity) = texts_and_opacity(&mut overlay, &facts);
            assert_eq!((text.is_empty(), opacity), (false, 1.0), "device {device}");
            overlay.forget_device();
        }
    }

    #[test]
    fn says_nothing_when_it_is_off() {
        let facts =
            Facts { view: ViewSettings { overlay: false, ..ViewSettings::default() }, ..Facts::default() };
        assert_eq!(texts(&mut Overlay::default(), &facts), "");
    }
}
