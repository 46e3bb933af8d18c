//! What the study of the documents' claims has to find: what infinite distances lose shrinks with the distance,
//! only Phong shading keeps the brightest pixel, and all pairs of patches are n (n - 1).

use lumbre_cost::{CostOptions, Point};

use super::{measured, options};

#[test]
fn what_the_documents_claim_is_measured_with_known_answers() {
    let folder = tempfile::tempdir().unwrap();
    let asked = CostOptions { size: (96, 54), ..options(&["documents"], Vec::new()) };
    let report = measured(&asked, folder.path());
    let study = report.study("documents").unwrap();
    let errors = |series: &str| -> Vec<f64> {
        study.of_series(series).map(|point| point.error.unwrap().relative_rmse).collect()
    };
    for (exact, approximate) in [("local viewer", "infinite viewer"), ("point lamps", "distant sources")] {
        assert!(errors(exact).iter().all(|error| *error == 0.0), "{exact}: {:?}", errors(exact));
        let [near, far] = errors(approximate)[..] else { panic!("a quick report has two distances") };
        // The difference of the directions falls with the first power of the distance, which grows fourfold.
        assert!(near > 2.0 * far && far > 1e-3, "{approximate}: {near} {far}");
    }
    let brightest = |series: &str| -> f64 {
        let point: &Point = study.of_series(series).next().unwrap();
        point.figures["brightest pixel, % of the exact sphere's"]
    };
    assert!((brightest("Phong") - 100.0).abs() < 1.0, "{}", brightest("Phong"));
    assert!(brightest("Gouraud") < 95.0 && brightest("flat") < 95.0);
    for point in study.of_series("form factors of all pairs") {
        let patches = point.counts["patches"];
        assert_eq!(point.counts["form factors"], patches * (patches - 1.0));
    }
    // More patches are closer to the closed form.
    let pairs = errors("form factors of all pairs");
    assert!(pairs.is_sorted_by(|coarse, fine| coarse > fine) && pairs.last() < Some(&0.1), "{pairs:?}");
    // A picture by rays lacks the light between surfaces, which a bake has.
    let [bake, picture] = ["radiosity", "ray tracing"].map(|series| errors(series)[0]);
    assert!(bake < 0.1 && picture > 0.2, "{bake} {picture}");
    let power = study.findings.iter().find(|finding| finding.starts_with("With form factors of all pairs"));
    assert!(power.unwrap().contains("grows with their power 2.00"), "{power:?}");
}
