//! The panel on the cost of accuracy: the reference beside the frame, its error, bars for the time of passes
//! and lights, and two coupled sliders for milliseconds and error. The measuring is in `accuracy`.

use egui::{
    Align2, Color32, CornerRadius, CursorIcon, LayerId, ProgressBar, Rect, RichText, ScrollArea, Sense,
    Slider, Stroke, Ui, pos2, vec2,
};
use lumbre_cost::{LightCost, Priced, ViewFront};
use lumbre_render::Accounting;

use super::accuracy::AccuracyFacts;
use super::overlay_file::{DIM, GOOD, WARM};

/// Width of the panel and of its bars in logical pixels.
const WIDTH: f32 = 290.0;
const BAR_WIDTH: f32 = 110.0;
/// Half of the width in which the dividing line can be grabbed, in logical pixels.
const GRIP: f32 = 6.0;
/// The smallest error on a slider that differs from none, per cent.
const SMALLEST_PERCENT: f64 = 1e-3;

/// The user's requests in the overlay.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wishes {
    /// Settings, by their index on the front.
    pub settings: Option<usize>,
}

/// Shows the reference over the part of the frame to the right of a dividing line that can be dragged.
/// `split` is its place, 0 to 1.
pub fn reference_beside(root: &Ui, reference: &egui::TextureHandle, split: &mut f32) {
    let screen = root.ctx().content_rect();
    let line = screen.left() + *split * screen.width();
    let area = Rect::from_min_max(pos2(line, screen.top()), screen.max);
    let painter = root.ctx().layer_painter(LayerId::background());
    let texels = Rect::from_min_max(pos2(*split, 0.0), pos2(1.0, 1.0));
    painter.image(reference.id(), area, texels, Color32::WHITE);
    painter.vline(line, screen.y_range(), Stroke::new(2.0, Color32::from_white_alpha(200)));
    let foot = screen.bottom() - 8.0;
    for (text, align, x) in
        [("this frame", Align2::RIGHT_BOTTOM, line - 8.0), ("reference", Align2::LEFT_BOTTOM, line + 8.0)]
    {
        let font = egui::FontId::proportional(13.0);
        let letters = painter.layout_no_wrap(text.to_owned(), font, Color32::WHITE);
        let place = align.anchor_size(pos2(x, foot), letters.size());
        painter.rect_filled(place.expand(3.0), 3.0, Color32::from_black_alpha(170));
        painter.galley(place.min, letters, Color32::WHITE);
    }
    egui::Area::new(egui::Id::unique("divider")).fixed_pos(pos2(line - GRIP, screen.top())).show(
        root.ctx(),
        |ui| {
            let (_, grip) = ui.allocate_exact_size(vec2(2.0 * GRIP, screen.height()), Sense::drag());
            let grip = grip.on_hover_and_drag_cursor(CursorIcon::ResizeHorizontal);
            if let Some(pointer) = grip.interact_pointer_pos() {
                *split = ((pointer.x - screen.left()) / screen.width().max(1.0)).clamp(0.0, 1.0);
            }
        },
    );
}

/// Lays out the panel and returns the user's requests.
pub fn panel(root: &Ui, facts: &AccuracyFacts, accounting: Option<&Accounting>) -> Wishes {
    let mut wishes = Wishes::default();
    let frame = egui::Frame::window(root.style()).fill(Color32::from_black_alpha(190));
    egui::Window::new("What accuracy costs")
        .frame(frame)
        .anchor(Align2::RIGHT_TOP, [-10.0, 10.0])
        .resizable(false)
        .default_width(WIDTH)
        .show(root.ctx(), |ui| {
            let height = (root.ctx().content_rect().height() - 70.0).max(60.0);
            // Without a least height, the window keeps egui's default height, and the sliders at the end are out of sight.
            ScrollArea::vertical().max_height(height).min_scrolled_height(height).show(ui, |ui| {
                ui.set_max_width(WIDTH);
                wishes = contents(ui, facts, accounting);
            });
        });
    wishes
}

fn contents(ui: &mut Ui, facts: &AccuracyFacts, accounting: Option<&Accounting>) -> Wishes {
    let dim = |text: &str| RichText::new(text.to_owned()).color(DIM).small();
    match facts.error {
        Some((error, flip)) => {
            let flip = flip.map_or_else(String::new, |flip| format!(", FLIP {flip:.3}"));
            ui.label(RichText::new(format!("{} % off{flip}", percent(error))).strong());
        }
        None => {
            ui.label("being compared with the reference …");
        }
    }
    ui.label(dim(
        "against Phong shading everywhere, soft shadows of twice the resolution, lamps without an end, four samples a pixel; relative RMSE of light",
    ));
    if let Some((what, fraction)) = facts.progress {
        ui.label(format!("measuring {what}; all stands still (Esc ends it)"));
        ui.add(ProgressBar::new(fraction as f32).desired_width(WIDTH).show_percentage());
    }
    if let Some(accounting) = accounting {
        ui.separator();
        passes(ui, accounting);
    }
    if !facts.lights.is_empty() {
        ui.separator();
        lights(ui, &facts.lights);
    }
    ui.separator();
    let Some(front) = &facts.front else {
        ui.label(dim("P measures what each light and other settings would cost here"));
        return Wishes::default();
    };
    settings(ui, front, facts)
}

/// Lists the GPU time of the passes; those that cannot be measured separately share a row.
fn passes(ui: &mut Ui, accounting: &Accounting) {
    let mut groups: Vec<(usize, String, f64)> = Vec::new();
    for pass in &accounting.passes {
        let Some(ms) = pass.gpu_ms else { continue };
        match groups.iter_mut().find(|(group, ..)| pass.shared && *group == pass.group) {
            Some((_, names, _)) => *names += &format!(" + {}", pass.pass),
            None => groups.push((pass.group, pass.pass.clone(), ms)),
        }
    }
    groups.sort_by(|a, b| b.2.total_cmp(&a.2));
    let most = groups.first().map_or(0.0, |(.., ms)| *ms);
    ui.label(RichText::new("passes on the GPU").color(DIM).small());
    egui::Grid::new("bars of passes").num_columns(3).spacing([8.0, 2.0]).show(ui, |ui| {
        for (_, names, ms) in &groups {
            row(ui, names, [0.0, *ms, 0.0], most, "");
        }
    });
}

fn lights(ui: &mut Ui, lights: &[LightCost]) {
    let most = lights.iter().map(|light| light.milliseconds.upper).fold(0.0, f64::max);
    ui.label(
        RichText::new("lights: what a frame saves without, and how far it is off then").color(DIM).small(),
    );
    egui::Grid::new("bars of lights").num_columns(4).spacing([8.0, 2.0]).show(ui, |ui| {
        for light in lights {
            let many = if light.lights > 1 { format!(" ({})", light.lights) } else { String::new() };
            let time = light.milliseconds;
            let lost = format!("{} %", percent(light.difference));
            row(ui, &format!("{}{many}", light.name), [time.lower, time.median, time.upper], most, &lost);
        }
    });
}

/// Adds a row with a name, a bar of milliseconds with its quartiles as a thin line, and a remark.
fn row(ui: &mut Ui, name: &str, [lower, ms, upper]: [f64; 3], most: f64, remark: &str) {
    ui.label(RichText::new(name).small());
    let (response, painter) = ui.allocate_painter(vec2(BAR_WIDTH, 10.0), Sense::hover());
    let area = response.rect;
    let at = |ms: f64| area.left() + area.width() * (ms / most.max(1e-9)).clamp(0.0, 1.0) as f32;
    painter.rect_filled(area, CornerRadius::same(1), Color32::from_black_alpha(120));
    let bar = Rect::from_min_max(area.min, pos2(at(ms), area.bottom()));
    painter.rect_filled(bar, CornerRadius::same(1), GOOD);
    if upper > lower && upper > 0.0 {
        painter.hline(at(lower)..=at(upper), area.center().y, Stroke::new(1.0, Color32::WHITE));
    }
    ui.label(RichText::new(format!("{ms:.2} ms")).small());
    if !remark.is_empty() {
        ui.label(RichText::new(remark).color(DIM).small());
    }
    ui.end_row();
}

/// Lays out the two sliders, and the next settings in both directions.
fn settings(ui: &mut Ui, front: &ViewFront, facts: &AccuracyFacts) -> Wishes {
    let mut wishes = Wishes::default();
    let (Some(first), Some(last)) = (front.ways.first(), front.ways.last()) else { return wishes };
    let known = facts.settings.as_ref().and_then(|settings| AccuracyFacts::priced(front, settings));
    match known {
        Some(now) => ui.label(format!("{}: {}", now.label, prices(now))),
        None => ui.label(RichText::new("these settings were not measured; P measures them").color(WARM)),
    };
    let now = known.unwrap_or(&front.now);
    if facts.is_elsewhere {
        ui.label(RichText::new("measured from another place; P measures again").color(WARM).small());
    }
    if front.ways.len() > 1 {
        // Each slider shows the price of the current settings, so that moving one also moves the other.
        let mut ms = now.milliseconds.median;
        let range = first.milliseconds.median.min(ms)..=last.milliseconds.median.max(ms);
        let slider = Slider::new(&mut ms, range)
            .logarithmic(true)
            .text("ms a frame")
            .custom_formatter(|ms, _| decimals(ms, 2));
        if ui.add(slider).changed() {
            wishes.settings = Some(front.within_milliseconds(ms));
        }
        let mut error = 100.0 * now.error;
        let range = (100.0 * last.error).min(error)..=(100.0 * first.error).max(error);
        let slider = Slider::new(&mut error, range)
            .logarithmic(true)
            .smallest_positive(SMALLEST_PERCENT)
            .text("% of error")
            .custom_formatter(|error, _| decimals(error, 3));
        if ui.add(slider).changed() {
            wishes.settings = Some(front.within_error(error / 100.0));
        }
    }
    let place = |place: Option<usize>| place.and_then(|place| front.ways.get(place));
    for (key, what, next) in [
        ("[,]", "next cheaper", place(front.next_cheaper(now))),
        ("[.]", "next better", place(front.next_better(now))),
    ] {
        ui.horizontal_wrapped(|ui| {
            ui.label(RichText::new(key).color(WARM).strong());
            match next {
                Some(next) => {
                    ui.label(RichText::new(format!("{what}: {}: {}", next.label, prices(next))).small())
                }
                None => ui.label(RichText::new(format!("{what}: none")).color(DIM).small()),
            };
        });
    }
    wishes
}

fn prices(way: &Priced) -> String {
    format!("{:.1} ms, {} % off", way.milliseconds.median, percent(way.error))
}

/// Formats a number with at most `most` decimals. `Slider::max_decimals` would also round the value, which
/// counts as a change that the user did not make.
fn decimals(value: f64, most: i32) -> String {
    let scale = 10f64.powi(most);
    ((value * scale).round() / scale).to_string()
}

/// Formats a fraction as a percentage with about three digits.
fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    match percent {
        _ if percent == 0.0 => "0".to_owned(),
        _ if percent < 0.01 => "under 0.01".to_owned(),
        _ if percent < 1.0 => format!("{percent:.2}"),
        _ => format!("{percent:.1}"),
    }
}

#[cfg(test)]
mod tests {
    use egui::{Event, Modifiers, PointerButton, Pos2, RawInput};
    use lumbre_cost::{DrawSettings, Spread};
    use lumbre_optics::Shading;
    use lumbre_scene::{LightmapEncoding, ShadowFilter};

    use super::*;

    const SCREEN: egui::Vec2 = vec2(1000.0, 700.0);

    fn way(label: &str, shading: Shading, milliseconds: f64, error: f64) -> Priced {
        let settings = DrawSettings {
            shading,
            shadows: true,
            shadow_filter: ShadowFilter::Soft,
            shadow_resolution: 1.0,
            light_threshold: 0.0,
            multisample: false,
            lightmap_reduction: 1,
            lightmap_format: LightmapEncoding::Rgb16Float,
        };
        let times = [0.98 * milliseconds, milliseconds, 1.02 * milliseconds];
        let milliseconds = Spread::of(&times).expect("there are times");
        Priced { label: label.to_owned(), settings, milliseconds, error }
    }

    /// Three settings, of which the middle one is current.
    fn facts() -> AccuracyFacts {
        let ways = vec![
            way("the cheapest", Shading::Flat, 10.0, 0.4),
            way("the middle", Shading::Gouraud, 20.0, 0.05),
            way("the best", Shading::Phong, 80.0, 0.0),
        ];
        let time = |lower, median, upper| Spread { lower, median, upper, rounds: 5 };
        let light = |name: &str, lights, milliseconds, difference| LightCost {
            name: name.to_owned(),
            lights,
            milliseconds,
            difference,
        };
        AccuracyFacts {
            is_shown: true,
            error: Some((0.0512, Some(0.0321))),
            lights: vec![
                light("spot lights", 7, time(4.0, 5.0, 6.0), 0.25),
                light("sun", 1, time(-0.2, 0.1, 0.3), 0.0),
            ],
            settings: Some(ways[1].settings),
            front: Some(ViewFront { now: ways[1].clone(), ways }),
            ..AccuracyFacts::default()
        }
    }

    /// Lays out the panel; returns all its text that is in sight with positions, and the request.
    fn laid_out(
        context: &egui::Context,
        facts: &AccuracyFacts,
        events: Vec<Event>,
    ) -> (Vec<(Pos2, String)>, Wishes) {
        fn texts(shape: &egui::Shape, found: &mut Vec<(Pos2, String)>) {
            match shape {
                egui::Shape::Text(one) => found.push((one.pos, one.galley.text().to_owned())),
                egui::Shape::Vec(shapes) => shapes.iter().for_each(|shape| texts(shape, found)),
                _ => {}
            }
        }
        let screen_rect = Some(Rect::from_min_size(Pos2::ZERO, SCREEN));
        let input = RawInput { screen_rect, events, ..RawInput::default() };
        let mut wishes = Wishes::default();
        let output = context.run_ui(input, |root| wishes = panel(root, facts, None));
        let mut found = Vec::new();
        for clipped in &output.shapes {
            let mut of_shape = Vec::new();
            texts(&clipped.shape, &mut of_shape);
            found.extend(of_shape.into_iter().filter(|(place, _)| clipped.clip_rect.contains(*place)));
        }
        output.drop_without_applying_deltas();
        (found, wishes)
    }

    fn press(at: Pos2) -> Vec<Event> {
        let (button, modifiers) = (PointerButton::Primary, Modifiers::default());
        vec![Event::PointerMoved(at), Event::PointerButton { pos: at, button, pressed: true, modifiers }]
    }

    /// Returns the request after pressing a slider at a distance from the left end of its rail, in logical
    /// pixels.
    fn pressed(slider: &str, along: f32) -> Option<usize> {
        let (context, facts) = (egui::Context::default(), facts());
        laid_out(&context, &facts, Vec::new());
        let (texts, _) = laid_out(&context, &facts, Vec::new());
        let place =
            |wanted: &str| texts.iter().find(|(_, text)| text.contains(wanted)).map(|(place, _)| *place);
        let left = place("the middle: 20.0 ms").expect("it is said what is drawn").x;
        let row = place(slider).expect("the slider has its name").y + 6.0;
        let at = pos2(left + along, row);
        // The pointer hovers in one frame and presses in the next.
        laid_out(&context, &facts, vec![Event::PointerMoved(at)]);
        laid_out(&context, &facts, press(at)).1.settings
    }

    #[test]
    fn each_slider_chooses_what_keeps_it_and_the_other_follows() {
        // A rail is 100 logical pixels long: 10 to 80 ms, and no error to 40 %.
        assert_eq!(pressed("ms a frame", 3.0), Some(0));
        assert_eq!(pressed("ms a frame", 60.0), Some(1), "some 35 ms: the best takes 80");
        assert_eq!(pressed("ms a frame", 95.0), Some(2));
        assert_eq!(pressed("% of error", 4.0), Some(2));
        assert_eq!(pressed("% of error", 95.0), Some(0));
        // Whatever is chosen, both sliders show its price.
        for (place, [ms, error]) in [["10", "40"], ["20", "5"], ["80", "0"]].into_iter().enumerate() {
            let mut facts = facts();
            let settings = |front: &ViewFront| front.ways[place].settings;
            facts.settings = facts.front.as_ref().map(settings);
            let context = egui::Context::default();
            laid_out(&context, &facts, Vec::new());
            let (texts, _) = laid_out(&context, &facts, Vec::new());
            let values: Vec<f64> = texts.iter().filter_map(|(_, text)| text.trim().parse().ok()).collect();
            let expected = [ms, error].map(|text| text.parse::<f64>().expect("a number"));
            assert_eq!(values, expected, "{texts:?}");
        }
    }

    /// Without the least height of the scrolled area this fails.
    #[test]
    fn the_sliders_are_in_sight_under_the_bars_of_many_lights() {
        let mut facts = facts();
        let one = facts.lights[0].clone();
        facts.lights = vec![one; 14];
        let context = egui::Context::default();
        laid_out(&context, &facts, Vec::new());
        let (texts, _) = laid_out(&context, &facts, Vec::new());
        for wanted in ["ms a frame", "% of error", "next better"] {
            assert!(texts.iter().any(|(_, text)| text.contains(wanted)), "{wanted} is not in {texts:?}");
        }
    }

    #[test]
    fn nothing_is_chosen_that_nobody_chose() {
        for place in 0..3 {
            let mut facts = facts();
            let front = facts.front.as_mut().expect("it was measured");
            // Prices that are not round numbers.
            for way in &mut front.ways {
                way.milliseconds.median *= 1.000_123_4;
                way.error *= 0.999_123_4;
            }
            front.now = front.ways[place].clone();
            facts.settings = Some(front.ways[place].settings);
            let context = egui::Context::default();
            for _ in 0..4 {
                assert_eq!(laid_out(&context, &facts, Vec::new()).1.settings, None, "at {place}");
            }
        }
    }

    #[test]
    fn it_says_what_was_measured_and_what_is_next() {
        let context = egui::Context::default();
        let said = |facts: &AccuracyFacts| {
            laid_out(&context, facts, Vec::new());
            let (texts, _) = laid_out(&context, facts, Vec::new());
            texts.into_iter().map(|(_, text)| text).collect::<Vec<_>>().join("\n")
        };
        let text = said(&facts());
        for wanted in [
            "5.1 % off, FLIP 0.032",
            "spot lights (7)",
            "5.00 ms",
            "25.0 %",
            "the middle: 20.0 ms, 5.0 % off",
            "next cheaper: the cheapest: 10.0 ms, 40.0 % off",
            "next better: the best: 80.0 ms, 0 % off",
        ] {
            assert!(text.contains(wanted), "{wanted} is not in:\n{text}");
        }
        let elsewhere = said(&AccuracyFacts { is_elsewhere: true, ..facts() });
        assert!(elsewhere.contains("measured from another place"), "{elsewhere}");
        let unknown = way("", Shading::Phong, 1.0, 0.0).settings;
        let unknown = DrawSettings { shadows: false, ..unknown };
        let unknown = said(&AccuracyFacts { settings: Some(unknown), ..facts() });
        assert!(unknown.contains("these settings were not measured"), "{unknown}");
        let progress = Some(("what lights cost", 0.25));
        let nothing = said(&AccuracyFacts { is_shown: true, progress, ..AccuracyFacts::default() });
        assert!(nothing.contains("P measures") && nothing.contains("what lights cost"), "{nothing}");
        assert!(nothing.contains("25%"), "{nothing}");
    }

    #[test]
    fn passes_that_are_not_told_apart_have_one_bar() {
        let pass = |name: &str, group, gpu_ms, shared| lumbre_render::PassAccount {
            pass: name.to_owned(),
            effect: name.to_owned(),
            group,
            cpu_ms: None,
            gpu_ms: Some(gpu_ms),
            shared,
            invocations: None,
            lights: None,
        };
        let accounting = Accounting {
            frame: 1,
            wall_ms: None,
            cpu_ms: 1.0,
            stages: Vec::new(),
            between_ms: None,
            waiting_ms: None,
            overlapped_ms: None,
            gpu_ms: Some(9.0),
            passes_ms: None,
            passes: vec![
                pass("shadow", 0, 2.0, false),
                pass("background", 1, 7.0, true),
                pass("forward", 1, 7.0, true),
            ],
            effects: Vec::new(),
            uploads: lumbre_render::Uploads::default(),
            lightmaps: lumbre_render::LightmapMemory::default(),
            notes: Vec::new(),
        };
        let context = egui::Context::default();
        let mut texts = String::new();
        for _ in 0..2 {
            texts.clear();
            let output = context.run_ui(RawInput::default(), |ui| passes(ui, &accounting));
            for clipped in &output.shapes {
                if let egui::Shape::Text(text) = &clipped.shape {
                    texts += &format!("{}\n", text.galley.text());
                }
            }
            output.drop_without_applying_deltas();
        }
        assert!(texts.contains("background + forward\n7.00 ms\nshadow\n2.00 ms"), "{texts}");
    }
}
