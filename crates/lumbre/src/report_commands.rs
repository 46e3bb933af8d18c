//! What the points of a report say that makes them again is what this program understands: every command of every study, read as it reads its own arguments.

use std::ops::ControlFlow;

use clap::Parser;
use lumbre::cost::{CostOptions, STUDIES, command_words, measure};
use lumbre::render::Gpu;

use crate::arguments::{Arguments, Command};

#[test]
fn every_command_of_a_report_is_understood() {
    let folder = tempfile::tempdir().unwrap();
    let gpu = Gpu::headless().unwrap();
    let asked = CostOptions {
        files: Vec::new(),
        studies: STUDIES.to_vec(),
        quick: true,
        counts_only: true,
        size: (24, 16),
        seed: 7,
        resume: false,
    };
    let report = measure(&gpu, &asked, folder.path(), &|_| ControlFlow::Continue(())).unwrap();
    let (mut studies, mut kinds) = (0, [0; 4]);
    for study in &report.studies {
        studies += usize::from(!study.points.is_empty());
        for point in &study.points {
            for words in command_words(&point.command) {
                let read = Arguments::try_parse_from(&words);
                let read = read.unwrap_or_else(|error| panic!("{}: {error}", point.command));
                match read.command {
                    Some(Command::Render(_)) => kinds[0] += 1,
                    Some(Command::Bake(_)) => kinds[1] += 1,
                    Some(Command::Trace(_)) => kinds[2] += 1,
                    // Run again, it is run as it was.
                    Some(Command::Cost(again)) => {
                        assert_eq!(again.studies, [study.name.as_str()]);
                        assert_eq!((again.size, again.seed), (Some((24, 16)), 7), "{}", point.command);
                        assert!(again.quick && again.counts_only, "{}", point.command);
                        kinds[3] += 1;
                    }
                    _ => panic!("{} makes no point", point.command),
                }
            }
        }
    }
    assert_eq!(studies, STUDIES.len(), "a study without points");
    assert!(kinds.iter().all(|count| *count > 0), "{kinds:?}");
}
