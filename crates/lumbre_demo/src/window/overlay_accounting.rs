//! The overlay's account of a frame: the cost of its effects, and the time of the CPU's stages. The passes
//! are listed in `overlay`.

use egui::{RichText, Ui};
use lumbre_render::{Accounting, EffectAccount, PassAccount, StageAccount};

use super::overlay_file::{DIM, WARM};

/// Stages shorter than this are summed up, in milliseconds.
const SHORT: f64 = 0.02;

/// Lays out the account of the latest frame whose measurements have arrived.
pub fn account(ui: &mut Ui, accounting: &Accounting) {
    // Collapsed, so that the keys below stay visible in a small window.
    let gpu = accounting.gpu_ms.map_or_else(String::new, |ms| format!(", {ms:.1} ms on the GPU"));
    let by_effect = format!("by effect: {:.1} ms on the CPU{gpu}", accounting.cpu_ms);
    let heading = |text: String, name| egui::CollapsingHeader::new(text).id_salt(name).default_open(false);
    heading(by_effect, "by effect").show(ui, |ui| effects(ui, accounting));
    heading("by stage on the CPU".to_owned(), "by stage").show(ui, |ui| stages(ui, accounting));
    for note in &accounting.notes {
        ui.label(RichText::new(note).color(WARM).small());
    }
}

/// Formats the number of lights that a pass tested, and the percentage that contributed, if they were
/// counted.
pub fn lights(pass: Option<&PassAccount>) -> String {
    let counts = pass.and_then(|pass| pass.lights);
    counts.map_or_else(String::new, |counts| {
        let part = 100.0 * counts.contributing as f64 / counts.tested.max(1) as f64;
        format!("{} ({part:.0} %)", short_count(counts.tested))
    })
}

fn effects(ui: &mut Ui, accounting: &Accounting) {
    egui::Grid::new("effects").num_columns(6).spacing([10.0, 2.0]).show(ui, |ui| {
        for heading in ["", "CPU ms", "GPU ms", "fragments", "bytes", "pipelines"] {
            ui.label(RichText::new(heading).color(DIM).small());
        }
        ui.end_row();
        for effect in accounting.effects.iter().filter(|effect| does_something(effect)) {
            ui.label(&effect.effect);
            ui.label(format!("{:.2}", effect.cpu_ms));
            ui.label(effect.gpu_ms.map_or_else(String::new, |ms| format!("{ms:.2}")));
            ui.label(
                effect
                    .invocations
                    .map_or_else(String::new, |counts| short_count(counts.fragment + counts.compute)),
            );
            let but_zero = |count: u64| if count == 0 { String::new() } else { count.to_string() };
            ui.label(but_zero(effect.uploaded_bytes));
            ui.label(but_zero(effect.pipelines_made as u64));
            ui.end_row();
        }
    });
}

fn does_something(effect: &EffectAccount) -> bool {
    !effect.passes.is_empty() || effect.gpu_ms.is_some() || effect.uploaded_bytes > 0 || effect.cpu_ms > SHORT
}

fn stages(ui: &mut Ui, accounting: &Accounting) {
    let is_short = |stage: &&StageAccount| stage.ms < SHORT;
    let shown = accounting.stages.iter().filter(|stage| !is_short(stage));
    let rest: f64 = accounting.stages.iter().filter(is_short).map(|stage| stage.ms).sum();
    let sum: f64 = accounting.stages.iter().map(|stage| stage.ms).sum();
    let others =
        [("shorter ones", rest), ("of no stage", accounting.cpu_ms - sum), ("all", accounting.cpu_ms)];
    egui::Grid::new("stages").num_columns(2).spacing([10.0, 2.0]).show(ui, |ui| {
        for (stage, ms) in shown.map(|stage| (stage.stage, stage.ms)).chain(others) {
            ui.label(stage);
            ui.label(format!("{ms:.3} ms"));
            ui.end_row();
        }
    });
}

/// Formats a count in short form.
fn short_count(count: u64) -> String {
    match count {
        0..10_000 => count.to_string(),
        10_000..10_000_000 => format!("{} thousand", count / 1000),
        _ => format!("{} million", count / 1_000_000),
    }
}

#[cfg(test)]
mod tests {
    use lumbre_render::LightCount;

    use super::*;

    /// Collects all text of the overlay.
    fn texts(shape: &egui::Shape, text: &mut String) {
        match shape {
            egui::Shape::Text(one) => *text += &(one.galley.text().to_owned() + "\n"),
            egui::Shape::Vec(shapes) => shapes.iter().for_each(|shape| texts(shape, text)),
            _ => {}
        }
    }

    #[test]
    fn effects_that_do_something_are_said_with_what_they_cost() {
        let effect = |name: &str, gpu_ms, uploaded_bytes| EffectAccount {
            effect: name.to_owned(),
            gpu_ms,
            uploaded_bytes,
            pipelines_made: 7,
            ..EffectAccount::default()
        };
        let accounting = Accounting {
            frame: 1,
            wall_ms: None,
            cpu_ms: 2.5,
            stages: vec![
                StageAccount { stage: "recording", ms: 2.0 },
                StageAccount { stage: "census", ms: 0.001 },
            ],
            between_ms: None,
            waiting_ms: None,
            overlapped_ms: None,
            gpu_ms: Some(13.5),
            passes_ms: None,
            passes: Vec::new(),
            effects: vec![
                effect("forward", Some(12.25), 0),
                effect("glow", None, 4321),
                effect("idle", None, 0),
            ],
            uploads: lumbre_render::Uploads::default(),
            lightmaps: lumbre_render::LightmapMemory::default(),
            notes: vec!["not measured: something".to_owned()],
        };
        let context = egui::Context::default();
        let mut text = String::new();
        // egui shows in the second frame what it lays out in the first.
        for _ in 0..2 {
            text.clear();
            let output = context.run_ui(egui::RawInput::default(), |ui| {
                account(ui, &accounting);
                effects(ui, &accounting);
                stages(ui, &accounting);
            });
            output.shapes.iter().for_each(|clipped| texts(&clipped.shape, &mut text));
            output.drop_without_applying_deltas();
        }
        for wanted in [
            "by effect: 2.5 ms on the CPU, 13.5 ms on the GPU",
            "by stage",
            "forward",
            "12.25",
            "glow",
            "4321",
            "recording",
            "2.000 ms",
            "of no stage",
            "0.499 ms",
            "not measured: something",
        ] {
            assert!(text.contains(wanted), "{wanted} is not in:\n{text}");
        }
        assert!(!text.contains("idle"), "{text}");
    }

    #[test]
    fn counts_are_short() {
        let counts = [0, 9_999, 10_000, 9_999_999, 10_000_000].map(short_count);
        assert_eq!(counts, ["0", "9999", "10 thousand", "9999 thousand", "10 million"]);
        let pass = |tested, contributing| PassAccount {
            pass: "forward".to_owned(),
            effect: "forward".to_owned(),
            group: 0,
            cpu_ms: None,
            gpu_ms: None,
            shared: false,
            invocations: None,
            lights: Some(LightCount { tested, contributing }),
        };
        assert_eq!(lights(Some(&pass(20_000, 5_000))), "20 thousand (25 %)");
        assert_eq!(lights(Some(&pass(0, 0))), "0 (0 %)");
        assert_eq!(lights(None), "");
    }
}
