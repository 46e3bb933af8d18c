//! Makes a whole report: determines which studies have to be run, runs them, and writes the folder after
//! each.

use std::cell::RefCell;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use lumbre_render::{Gpu, Renderer};

use crate::compile_ahead::device_ahead;
use crate::converged::ConvergedBakes;
use crate::folder::{Folder, has_pictures};
use crate::machine::machine;
use crate::shared_bakes::SharedBakes;
use crate::studies::{STUDIES, StudyKind};
use crate::{Conditions, CostError, CostReport, Machine, Settings, Study};

/// The options of a report.
#[derive(Clone, Debug)]
pub struct CostOptions {
    /// The scene files; if there are none, the studies create their own scenes.
    pub files: Vec<PathBuf>,
    /// The studies, in the order of the page.
    pub studies: Vec<StudyKind>,
    /// Whether to measure fewer points and rounds.
    pub quick: bool,
    /// Whether to record only counts, which are the same on every machine: nothing is timed, and no picture
    /// is kept.
    pub counts_only: bool,
    /// Width and height of the pictures in pixels.
    pub size: (u32, u32),
    /// Seed of all random numbers.
    pub seed: u32,
    /// Whether to keep the studies that the folder contains from the same machine with the same settings.
    /// Requested studies are kept only if this version of the program measured them by the same method.
    pub resume: bool,
}

/// The progress of a report.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CostProgress {
    /// The name of the study that is being measured.
    pub study: &'static str,
    /// Its index among the studies.
    pub number: usize,
    /// Number of studies.
    pub of: usize,
    /// Fraction of the study that is done; `None` if it has not changed.
    pub fraction: Option<f64>,
}

/// Measures a report into a folder. The folder is written after each study, so that an interruption keeps all
/// finished studies. `told` is called often, from several threads.
///
/// # Errors
/// The first [`CostError`]; [`CostError::Interrupted`] if `told` returns `Break`.
pub fn measure(
    gpu: &Gpu,
    options: &CostOptions,
    path: &Path,
    told: &(dyn Fn(CostProgress) -> ControlFlow<()> + Sync),
) -> Result<CostReport, CostError> {
    let folder = Folder::open(path)?;
    // Reports of counts do not name a machine, so that those of different machines are equal.
    let machine = if options.counts_only { Machine::default() } else { machine(gpu) };
    let settings = settings(options);
    let former = if options.resume { folder.report()? } else { None };
    let former = former.filter(|kept| kept.machine.is_same_place(&machine) && kept.settings == settings);
    let mut studies = former.map_or_else(Vec::new, |former| former.studies);
    // Studies that are to be measured again are removed first, so that old results do not stand beside new
    // ones.
    let is_current = |study: &Study, kind: &StudyKind| {
        let is_whole = || study.points.iter().all(|point| has_pictures(folder.path(), point));
        study.method == kind.method && study.version == machine.version && is_whole()
    };
    studies.retain(|study| {
        let asked = options.studies.iter().find(|kind| kind.name == study.name);
        asked.is_none_or(|kind| is_current(study, kind))
    });
    let mut report = CostReport { machine, settings, studies };
    let of = options.studies.len();
    let (converged, bakes) = (ConvergedBakes::default(), SharedBakes::default());
    let ahead = device_ahead(gpu).filter(|_| !options.counts_only);
    for (number, kind) in options.studies.iter().enumerate() {
        if report.study(kind.name).is_some() {
            continue;
        }
        let listener = |fraction| told(CostProgress { study: kind.name, number, of, fraction });
        // Each study has a renderer of its own, so that its uploads do not depend on earlier studies.
        let pictures = RefCell::new(Renderer::new(gpu));
        let conditions = Conditions {
            gpu,
            ahead: ahead.as_ref(),
            pictures: &pictures,
            converged: &converged,
            bakes: &bakes,
            quick: options.quick,
            counts_only: options.counts_only,
            counts_lights: !options.counts_only,
            size: options.size,
            size_of_report: options.size,
            as_shown: !options.quick,
            seed: options.seed,
            folder: folder.path(),
            files: &options.files,
            listener: &listener,
        };
        conditions.tell(0.0)?;
        let begun = Instant::now();
        let measured = (kind.run)(&conditions)?;
        let (method, version) = (kind.method, report.machine.version.clone());
        let mut study = Study { method, version, ..measured.study.clone() };
        if options.counts_only {
            study = study.counts_alone();
        } else {
            folder.write_pictures(&measured)?;
            study.seconds = begun.elapsed().as_secs_f64();
        }
        insert(&mut report.studies, study);
        folder.write(&report)?;
    }
    folder.write(&report)?;
    Ok(report)
}

/// Inserts a study at its position in the order of the page.
fn insert(studies: &mut Vec<Study>, study: Study) {
    let place = |name: &str| STUDIES.iter().position(|kind| kind.name == name);
    let at = studies.iter().position(|other| place(&other.name) > place(&study.name));
    studies.insert(at.unwrap_or(studies.len()), study);
}

fn settings(options: &CostOptions) -> Settings {
    let whole = |path: &PathBuf| path.canonicalize().unwrap_or_else(|_| path.clone());
    Settings {
        quick: options.quick,
        counts_only: options.counts_only,
        size: options.size,
        seed: options.seed,
        files: options.files.iter().map(|path| whole(path).display().to_string()).collect(),
    }
}
