//! A report from end to end: which studies are still to be done, each of them, and what is kept after each.

use std::cell::RefCell;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use lumbre_render::{Gpu, Renderer};

use crate::compile_ahead::device_ahead;
use crate::converged::ConvergedBakes;
use crate::folder::{Folder, has_pictures};
use crate::machine::machine;
use crate::studies::{STUDIES, StudyKind};
use crate::{Conditions, CostError, CostReport, Machine, Settings, Study};

/// What a report is asked for.
#[derive(Clone, Debug)]
pub struct CostOptions {
    /// The scenes; without any the studies make their own.
    pub files: Vec<PathBuf>,
    /// The studies, in their order.
    pub studies: Vec<StudyKind>,
    /// Fewer points and rounds.
    pub quick: bool,
    /// Counts alone, which are the same on every machine: nothing is timed, and no picture kept.
    pub counts_only: bool,
    /// Width and height of the pictures in pixels.
    pub size: (u32, u32),
    /// Of everything that draws random numbers.
    pub seed: u32,
    /// Keeps what the folder holds already of this machine and these settings: of the studies that are asked for those that this program has measured by the same method, and all others.
    pub resume: bool,
}

/// How far a report is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CostProgress {
    /// The study that is measured.
    pub study: &'static str,
    /// Which of the studies that is, from 0.
    pub number: usize,
    /// How many there are.
    pub of: usize,
    /// How much of it is done, 0 to 1; nothing if there is nothing new to say.
    pub fraction: Option<f64>,
}

/// Measures what is asked for into a folder. After each study everything is written, so that an end at any time keeps what is finished. `told` is
/// called often, from several threads.
///
/// # Errors
/// [`CostError`], the first; [`CostError::Interrupted`] if `told` answers with `Break`.
pub fn measure(
    gpu: &Gpu,
    options: &CostOptions,
    path: &Path,
    told: &(dyn Fn(CostProgress) -> ControlFlow<()> + Sync),
) -> Result<CostReport, CostError> {
    let folder = Folder::open(path)?;
    // Counts are nobody's: what they were counted on would be all that differs between two such reports.
    let machine = if options.counts_only { Machine::default() } else { machine(gpu) };
    let settings = settings(options);
    let former = if options.resume { folder.report()? } else { None };
    let former = former.filter(|kept| kept.machine.is_same_place(&machine) && kept.settings == settings);
    let mut studies = former.map_or_else(Vec::new, |former| former.studies);
    // What is to be measured anew does not stand beside what is new meanwhile.
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
    let converged = ConvergedBakes::default();
    let ahead = device_ahead(gpu).filter(|_| !options.counts_only);
    for (number, kind) in options.studies.iter().enumerate() {
        if report.study(kind.name).is_some() {
            continue;
        }
        let listener = |fraction| told(CostProgress { study: kind.name, number, of, fraction });
        // One for each study: what it uploads does not depend on the studies before it.
        let pictures = RefCell::new(Renderer::new(gpu));
        let conditions = Conditions {
            gpu,
            ahead: ahead.as_ref(),
            pictures: &pictures,
            converged: &converged,
            quick: options.quick,
            counts_only: options.counts_only,
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

/// Puts a study in the place that it has on the page.
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
