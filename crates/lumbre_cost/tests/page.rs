//! The page and the JSON of a report: they are well-formed, complete and self-contained.

#![allow(clippy::unwrap_used, reason = "helpers of tests, which clippy does not count as tests")]

use lumbre_cost::{
    CostReport, ErrorOf, ErrorOver, Plot, Point, PointPicture, Quantity, Settings, Spread, Study, page,
};

/// Studies with everything that a page may have to show: pictures, zeros, names that need escaping, a plot
/// without points.
fn report() -> CostReport {
    let point = |series: &str, label: &str, ms: f64, error: f64| Point {
        series: series.into(),
        label: label.into(),
        milliseconds: Spread::of(&[ms, 1.1 * ms, 1.2 * ms]),
        error: Some(ErrorOf {
            relative_rmse: error,
            largest: error,
            flip: Some(error / 2.0),
            uncertainty: 0.1 * error,
        }),
        parameters: [("lamps".to_owned(), 16.0)].into(),
        counts: [("rays".to_owned(), 1e6)].into(),
        figures: [("saved, ms".to_owned(), -0.5)].into(),
        command: "lumbre render 'a & b.glb' -o <frame>.exr".into(),
        picture: Some(PointPicture {
            picture: format!("pictures/x/{label}"),
            reference: "pictures/x/reference".into(),
            error_of: ErrorOver::Picture,
            maps: None,
        }),
    };
    let plot = |across, up| Plot {
        title: "A plot".into(),
        across,
        up,
        joined: true,
        front: true,
        ..Plot::default()
    };
    let study = |name: &str| Study {
        name: name.into(),
        title: format!("Study <{name}> & more"),
        plots: vec![
            plot(Quantity::Milliseconds, Quantity::Error),
            plot(Quantity::Parameter("lamps".into()), Quantity::Milliseconds),
            plot(Quantity::Figure("not there".into()), Quantity::Error),
        ],
        points: vec![
            point("a <b>", "one", 1.0, 0.5),
            point("a <b>", "two", 30.0, 0.0),
            point("c & d", "three", 4.0, 1e-7),
        ],
        findings: vec!["From 1 % on \"a <b>\" is the cheapest.".into()],
        ..Study::default()
    };
    CostReport {
        settings: Settings {
            quick: true,
            counts_only: false,
            size: (64, 48),
            seed: 3,
            files: vec!["room & board.glb".into()],
        },
        studies: vec![study("first"), study("second")],
        ..CostReport::default()
    }
}

fn drawn() -> String {
    page(&report(), &|name| Some(format!("png of {name}").into_bytes())).unwrap()
}

/// Checks that elements are closed in the right order, and that text and attributes are escaped.
fn check_nesting(page: &str) {
    const VOID: [&str; 3] = ["meta", "img", "input"];
    // Scripts and styles have rules of their own.
    let mut text = page.to_owned();
    for raw in ["script", "style"] {
        while let Some(start) = text.find(&format!("<{raw}>")) {
            let end = text.find(&format!("</{raw}>")).unwrap();
            text.replace_range(start..end + raw.len() + 3, "");
        }
    }
    let mut open: Vec<String> = Vec::new();
    let mut rest = text.as_str();
    let mut elements = 0;
    while let Some(start) = rest.find('<') {
        let end = start + rest[start..].find('>').unwrap_or_else(|| panic!("no end: {}", &rest[start..]));
        let inside = &rest[start + 1..end];
        assert!(!inside.contains('<'), "an unescaped < in {inside}");
        rest = &rest[end + 1..];
        if inside.starts_with('!') || inside.ends_with('/') {
            continue;
        }
        if let Some(name) = inside.strip_prefix('/') {
            let last = open.pop();
            assert_eq!(last.as_deref(), Some(name.trim()), "closed in the wrong order");
            continue;
        }
        elements += 1;
        let name = inside.split(|c: char| c.is_whitespace()).next().unwrap();
        assert_eq!(inside.matches('"').count() % 2, 0, "quotes of {inside}");
        if !VOID.contains(&name) {
            open.push(name.to_owned());
        }
    }
    assert!(open.is_empty(), "never closed: {open:?}");
    assert!(elements > 100, "only {elements} elements");
}

#[test]
fn the_page_is_well_formed_and_holds_every_study() {
    let page = drawn();
    check_nesting(&page);
    for name in ["first", "second"] {
        assert!(page.contains(&format!("<section id=\"{name}\">")), "{name} is missing");
        assert!(page.contains(&format!("href=\"#{name}\"")));
        assert!(page.contains(&format!("Study &lt;{name}&gt; &amp; more")));
    }
    assert_eq!(page.matches("<figure class=\"plot\">").count(), 4, "two plots of each study have points");
    assert_eq!(page.matches("<button type=\"button\" aria-pressed=\"true\"").count(), 2);
    assert!(page.contains("From 1 % on &quot;a &lt;b&gt;&quot; is the cheapest."));
    assert!(page.contains("lumbre render 'a &amp; b.glb' -o &lt;frame&gt;.exr"));
}

#[test]
fn nothing_comes_from_elsewhere() {
    let page = drawn();
    for source in page.match_indices("src=\"").map(|(at, found)| &page[at + found.len()..]) {
        assert!(source.starts_with("data:image/png;base64,"), "{}", &source[..40]);
    }
    for link in page.match_indices("href=\"").map(|(at, found)| &page[at + found.len()..]) {
        assert!(link.starts_with('#'), "{}", &link[..40]);
    }
    let without_names_of_formats = page.replace("http://www.w3.org/", "");
    for scheme in ["http:", "https:", "@import", "url("] {
        assert!(!without_names_of_formats.contains(scheme), "{scheme}");
    }
}

#[test]
fn plots_take_their_colours_from_the_page() {
    let page = drawn();
    let plots = page.split("<svg ").skip(1);
    for plot in plots {
        let drawing = plot.split("</svg>").next().unwrap();
        assert!(!drawing.contains("=\"#"), "a colour of its own: {drawing}");
        assert!(drawing.contains("var(--"));
    }
}

#[test]
fn the_nesting_check_sees_faults() {
    let caught = |page: &str| std::panic::catch_unwind(|| check_nesting(page)).is_err();
    let padding = "<p></p>".repeat(101);
    assert!(!caught(&padding));
    assert!(caught(&format!("{padding}<b><i></b></i>")));
    assert!(caught(&format!("{padding}<b>")));
    assert!(caught(&format!("{padding}<a href=\"x<y\"></a>")));
}

#[test]
fn a_report_goes_through_json_unchanged() {
    let report = report();
    let text = serde_json::to_string(&report).unwrap();
    let again: CostReport = serde_json::from_str(&text).unwrap();
    assert_eq!(again, report);
}

#[test]
fn a_picture_that_is_not_there_is_left_out() {
    let page = page(&report(), &|_| None).unwrap();
    check_nesting(&page);
    assert!(!page.contains("class=\"viewer\""));
}
