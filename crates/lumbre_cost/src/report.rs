//! What a report is made of: studies, each of points that have a time, an error and counts. Plain data, kept as JSON; not its measuring and
//! not its drawing.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::Spread;

/// Studies of one machine.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CostReport {
    /// What they were measured on.
    pub machine: Machine,
    /// How they were measured.
    pub settings: Settings,
    /// The studies that are finished, in their order.
    pub studies: Vec<Study>,
}

/// A machine: times mean little without it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Machine {
    /// The processor, as the system names it.
    pub processor: String,
    /// Threads that the process may use.
    pub threads: usize,
    /// Operating system and architecture.
    pub system: String,
    /// The GPU, or the software in its place, with its driver.
    pub adapter: String,
    /// Of Lumbre, and whether it was optimized.
    pub version: String,
}

/// How a report was measured; reports with other settings hold other numbers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Fewer points and rounds.
    pub quick: bool,
    /// Nothing but counts.
    #[serde(default)]
    pub counts_only: bool,
    /// Width and height of the pictures in pixels.
    pub size: (u32, u32),
    /// Of everything that draws random numbers.
    pub seed: u32,
    /// The scenes that were given; without any the studies make their own.
    pub files: Vec<String>,
}

/// One question, and what was measured about it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Study {
    /// The name on the command line.
    pub name: String,
    /// A headline.
    pub title: String,
    /// What was asked, in a sentence or two.
    pub question: String,
    /// What errors are against.
    pub reference: String,
    /// What is drawn, each over a pair of axes.
    pub plots: Vec<Plot>,
    /// What was measured.
    pub points: Vec<Point>,
    /// What was found, a sentence each, worked out from the points.
    pub findings: Vec<String>,
    /// What was left out, and why.
    pub notes: Vec<String>,
    /// Seconds that the study took.
    pub seconds: f64,
    /// Which way of measuring it was ([`StudyKind::method`](crate::StudyKind)); 0 where a report does not say so.
    #[serde(default)]
    pub method: u32,
    /// The program that measured it.
    #[serde(default)]
    pub version: String,
}

/// A choice, with what it costs and how far it is from the reference.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// What it has in common with the points that it is joined to.
    pub series: String,
    /// What tells it from the others of its series. The two together name it within its study.
    pub label: String,
    /// What was varied, by quantity.
    pub parameters: BTreeMap<String, f64>,
    /// The time of it.
    pub milliseconds: Option<Spread>,
    /// How far it is from the reference.
    pub error: Option<ErrorOf>,
    /// What does not depend on the hour: invocations, lights, rays, bytes.
    pub counts: BTreeMap<String, f64>,
    /// Other numbers, by what they are.
    pub figures: BTreeMap<String, f64>,
    /// The command that makes it again, in the folder of the report.
    pub command: String,
    /// Its picture, if it has one.
    pub picture: Option<PointPicture>,
}

/// How far something is from its reference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ErrorOf {
    /// Root mean square of the difference over that of the reference; of lightmaps over the reference's mean, as bakes state it.
    pub relative_rmse: f64,
    /// Largest difference of a channel, in the unit of what is compared.
    pub largest: f64,
    /// Mean of FLIP (0 to 1) where it is a picture.
    pub flip: Option<f64>,
    /// Of the relative RMSE, what the reference's own error may make of it: plus or minus so much.
    pub uncertainty: f64,
}

/// Files of a point's picture, below the folder of the report. `.exr` holds light; `.png`, as it is shown; and `.heat.png`, where it differs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PointPicture {
    /// The picture, without its extension.
    pub picture: String,
    /// The reference, without its extension.
    pub reference: String,
    /// What of it the point's error is.
    pub error_of: ErrorOver,
    /// Where the error is of lightmaps: their texels, which have no picture to be shown.
    #[serde(default)]
    pub maps: Option<KeptMaps>,
}

/// Files of lightmaps, below the folder of the report, as `.exr`: the texels of all maps of a level one after the other, not a number where a texel shows no surface.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct KeptMaps {
    /// Those of the point, without the extension.
    pub picture: String,
    /// Those that they are compared with.
    pub reference: String,
}

/// What a point's relative RMSE and largest difference are of. FLIP is of the whole picture always.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ErrorOver {
    /// All pixels.
    #[default]
    Picture,
    /// Pixels that are not black in either picture: what a shape lacks at its rim does not count.
    WhereBothAreLit,
    /// Something that the picture only shows: the texels of a lightmap.
    Beyond,
}

/// A pair of axes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Plot {
    /// What it shows.
    pub title: String,
    /// To the right.
    pub across: Quantity,
    /// Upwards.
    pub up: Quantity,
    /// Series that are drawn; all of them if empty.
    pub series: Vec<String>,
    /// Points of a series are joined by a line, in the order of the quantity across.
    pub joined: bool,
    /// Those points are marked that no other one beats in both quantities.
    pub front: bool,
    /// A line marks where both quantities are equal.
    pub equal: bool,
}

/// What an axis measures.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Median time in milliseconds.
    #[default]
    Milliseconds,
    /// Relative RMSE.
    Error,
    /// Mean of FLIP.
    Flip,
    /// A parameter of that name, with its unit.
    Parameter(String),
    /// A figure of that name, with its unit.
    Figure(String),
    /// A count of that name.
    Count(String),
}

impl Quantity {
    /// A point's number; nothing where it has none.
    pub fn of(&self, point: &Point) -> Option<f64> {
        match self {
            Self::Milliseconds => point.milliseconds.map(|time| time.median),
            Self::Error => point.error.map(|error| error.relative_rmse),
            Self::Flip => point.error.and_then(|error| error.flip),
            Self::Parameter(name) => point.parameters.get(name).copied(),
            Self::Figure(name) => point.figures.get(name).copied(),
            Self::Count(name) => point.counts.get(name).copied(),
        }
    }

    /// What is written beside its axis.
    pub fn title(&self) -> &str {
        match self {
            Self::Milliseconds => "time, ms",
            Self::Error => "relative RMSE, %",
            Self::Flip => "FLIP, 0 to 1",
            Self::Parameter(name) | Self::Figure(name) | Self::Count(name) => name,
        }
    }

    /// The factor from its numbers to those that are written.
    pub fn shown(&self) -> f64 {
        if *self == Self::Error { 100.0 } else { 1.0 }
    }
}

impl Study {
    /// Its series, in the order in which they come.
    pub fn series(&self) -> Vec<&str> {
        let mut series: Vec<&str> = Vec::new();
        for point in &self.points {
            if !series.contains(&point.series.as_str()) {
                series.push(&point.series);
            }
        }
        series
    }

    /// Its points with nothing but what was varied and counted. Those of which nothing was counted are left out.
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

    /// The points of a series.
    pub fn of_series<'a>(&'a self, series: &'a str) -> impl Iterator<Item = &'a Point> {
        self.points.iter().filter(move |point| point.series == series)
    }
}

impl Machine {
    /// Whether both are the same machine with the same device; the programs that measured on it may differ.
    pub fn is_same_place(&self, other: &Self) -> bool {
        Self { version: String::new(), ..self.clone() } == Self { version: String::new(), ..other.clone() }
    }
}

impl CostReport {
    /// The study of that name.
    pub fn study(&self, name: &str) -> Option<&Study> {
        self.studies.iter().find(|study| study.name == name)
    }
}
