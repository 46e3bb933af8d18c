//! The data of a report: studies consisting of points, each with a time, an error and counts. It is stored as
//! JSON. Measuring is in `studies`, drawing in `page`.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::Spread;

/// The studies measured on one machine.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CostReport {
    /// The machine they were measured on.
    pub machine: Machine,
    /// The settings they were measured with.
    pub settings: Settings,
    /// The finished studies, in the order of the page.
    pub studies: Vec<Study>,
}

/// A machine. Times can only be compared between reports from the same machine.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Machine {
    /// Name of the processor, as the operating system reports it.
    pub processor: String,
    /// Number of threads available to the process.
    pub threads: usize,
    /// Operating system and architecture.
    pub system: String,
    /// The GPU or software rasterizer, with its driver.
    pub adapter: String,
    /// Version of Lumbre, whether it was built with optimizations, and a hash of the program's file.
    pub version: String,
}

/// The settings of a report. Numbers of reports with different settings cannot be compared.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Whether it was measured with fewer points and rounds.
    pub quick: bool,
    /// Whether only counts were recorded.
    #[serde(default)]
    pub counts_only: bool,
    /// Width and height of the pictures in pixels.
    pub size: (u32, u32),
    /// Seed of all random numbers.
    pub seed: u32,
    /// The scene files that were passed; if there are none, the studies create their own scenes.
    pub files: Vec<String>,
}

/// A question, and the measurements that answer it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Study {
    /// Its name on the command line.
    pub name: String,
    /// Its headline.
    pub title: String,
    /// The question, in a sentence or two.
    pub question: String,
    /// The reference that errors are measured against.
    pub reference: String,
    /// The plots to be drawn.
    pub plots: Vec<Plot>,
    /// The measurements.
    pub points: Vec<Point>,
    /// What was found: sentences derived from the points.
    pub findings: Vec<String>,
    /// What was left out, and why; and other remarks.
    pub notes: Vec<String>,
    /// Duration of the study in seconds.
    pub seconds: f64,
    /// Version of the way of measuring ([`StudyKind::method`](crate::StudyKind)); 0 if the report does not
    /// state it.
    #[serde(default)]
    pub method: u32,
    /// Version and build of the program that measured it.
    #[serde(default)]
    pub version: String,
}

/// One measured choice, with its cost and its error against the reference.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Name of its series; the points of a series may be joined by a line.
    pub series: String,
    /// What distinguishes it from the other points of its series. Series and label together identify a point
    /// within its study.
    pub label: String,
    /// The values that were varied, by quantity.
    pub parameters: BTreeMap<String, f64>,
    /// Its time.
    pub milliseconds: Option<Spread>,
    /// Its error against the reference.
    pub error: Option<ErrorOf>,
    /// Counts that do not depend on when they are taken: shader invocations, lights, rays, bytes.
    pub counts: BTreeMap<String, f64>,
    /// Other numbers, by name.
    pub figures: BTreeMap<String, f64>,
    /// The command that reproduces it, to be run in the report's folder.
    pub command: String,
    /// Its picture, if it has one.
    pub picture: Option<PointPicture>,
}

/// The difference from a reference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ErrorOf {
    /// Root mean square of the difference divided by that of the reference. For lightmaps it is divided by
    /// the reference's mean, as in the error that a bake states.
    pub relative_rmse: f64,
    /// Largest difference of a channel, in the unit of the compared values.
    pub largest: f64,
    /// Mean of FLIP, from 0 to 1, for pictures.
    pub flip: Option<f64>,
    /// By how much the relative RMSE may be off, in either direction, because the reference itself has an
    /// error.
    pub uncertainty: f64,
}

impl ErrorOf {
    /// Returns whether the reference is too uncertain to tell this error from none.
    pub fn is_below_uncertainty(&self) -> bool {
        self.uncertainty > 0.0 && self.uncertainty >= self.relative_rmse
    }

    /// Returns the error that can be relied on: the relative RMSE, or the most that it may be where the reference is
    /// too uncertain to tell it from none. In between, an error of less than twice its uncertainty counts as that
    /// much, so that a larger error never counts less.
    pub fn reached(&self) -> f64 {
        let Self { relative_rmse, uncertainty, .. } = *self;
        relative_rmse.max(uncertainty + relative_rmse.min(uncertainty))
    }
}

/// The files of a point's picture, relative to the report's folder. `.exr` holds radiance, `.png` the picture
/// as displayed, and `.heat.png` a map of the differences from the reference.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PointPicture {
    /// Path of the picture, without extension.
    pub picture: String,
    /// Path of the reference, without extension.
    pub reference: String,
    /// What the point's error was computed from.
    pub error_of: ErrorOver,
    /// The texels that the error was computed from, if it is an error of lightmaps.
    #[serde(default)]
    pub maps: Option<KeptMaps>,
}

/// The texels of lightmaps, as `.exr` files relative to the report's folder: those of all maps of a level one
/// after the other, NaN where a texel shows no surface.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct KeptMaps {
    /// Path of the point's texels, without extension.
    pub picture: String,
    /// Path of the reference's texels, without extension.
    pub reference: String,
}

/// The pixels that a point's relative RMSE and largest difference are computed from. FLIP always covers the
/// whole picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ErrorOver {
    /// All pixels.
    #[default]
    Picture,
    /// Pixels that are not black in either of the two pictures. Missing pixels at a silhouette do not count.
    WhereBothAreLit,
    /// The error is not one of the picture, but of something that the picture shows: the texels of lightmaps.
    Beyond,
}

/// A plot: a pair of axes and what is drawn over them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Plot {
    /// Its title.
    pub title: String,
    /// The quantity of the horizontal axis.
    pub across: Quantity,
    /// The quantity of the vertical axis.
    pub up: Quantity,
    /// The series to be drawn; all of them if empty.
    pub series: Vec<String>,
    /// If given, only the points that vary the parameter with this name are drawn.
    #[serde(default)]
    pub varied: Option<String>,
    /// Whether the points of a series are joined by a line, ordered by the horizontal quantity.
    pub joined: bool,
    /// Whether the points that no other point with the same reference beats in both quantities are marked.
    pub front: bool,
    /// Whether a line marks where both quantities are equal.
    pub equal: bool,
}

/// The quantity that an axis shows.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Median time in milliseconds.
    #[default]
    Milliseconds,
    /// Relative RMSE, as far as it can be relied on ([`ErrorOf::reached`]).
    Error,
    /// Mean of FLIP.
    Flip,
    /// The parameter with this name, which includes its unit.
    Parameter(String),
    /// The figure with this name, which includes its unit.
    Figure(String),
    /// The count with this name.
    Count(String),
}

impl Quantity {
    /// Returns the value of a point, or `None` if the point has no such value.
    pub fn of(&self, point: &Point) -> Option<f64> {
        match self {
            Self::Milliseconds => point.milliseconds.map(|time| time.median),
            Self::Error => point.error.map(|error| error.reached()),
            Self::Flip => point.error.and_then(|error| error.flip),
            Self::Parameter(name) => point.parameters.get(name).copied(),
            Self::Figure(name) => point.figures.get(name).copied(),
            Self::Count(name) => point.counts.get(name).copied(),
        }
    }

    /// Returns the title of an axis with this quantity.
    pub fn title(&self) -> &str {
        match self {
            Self::Milliseconds => "time, ms",
            Self::Error => "relative RMSE, %",
            Self::Flip => "FLIP, 0 to 1",
            Self::Parameter(name) | Self::Figure(name) | Self::Count(name) => name,
        }
    }

    /// Returns the factor from stored to displayed values.
    pub fn shown(&self) -> f64 {
        if *self == Self::Error { 100.0 } else { 1.0 }
    }
}

impl Study {
    /// Returns the names of its series, in order of first occurrence.
    pub fn series(&self) -> Vec<&str> {
        let mut series: Vec<&str> = Vec::new();
        for point in &self.points {
            if !series.contains(&point.series.as_str()) {
                series.push(&point.series);
            }
        }
        series
    }

    /// Reduces its points to what was varied and counted. Points without counts are dropped.
    pub fn counts_alone(self) -> Self {
        let counted = self.points.into_iter().filter(|point| !point.counts.is_empty());
        let counts = |Point { series, label, parameters, counts, command, .. }| Point {
            series,
            label,
            parameters,
            counts,
            command,
            ..Point::default()
        };
        let points = counted.map(counts).collect();
        let Self { name, title, question, method, version, .. } = self;
        Self { name, title, question, points, method, version, ..Self::default() }
    }

    /// Returns the points of a series.
    pub fn of_series<'a>(&'a self, series: &'a str) -> impl Iterator<Item = &'a Point> {
        self.points.iter().filter(move |point| point.series == series)
    }
}

impl Machine {
    /// Returns true if both are the same machine with the same device. The programs may differ.
    pub fn is_same_place(&self, other: &Self) -> bool {
        Self { version: String::new(), ..self.clone() } == Self { version: String::new(), ..other.clone() }
    }
}

impl CostReport {
    /// Returns the study with this name.
    pub fn study(&self, name: &str) -> Option<&Study> {
        self.studies.iter().find(|study| study.name == name)
    }
}
