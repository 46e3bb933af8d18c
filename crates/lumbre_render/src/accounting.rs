//! The account of one frame: where its wall-clock time was spent, by CPU stages, by passes on the device and
//! by effects, and what is left over. Plain data and its text form. Which frames are still being measured is
//! tracked in `ledger`.

use std::collections::BTreeMap;
use std::fmt::Write;

use lumbre_graph::{GpuTime, GraphReport, Invocations};

use crate::lightmap_texels::LightmapMemory;
use crate::statistics::{CpuStages, Uploads};

/// What a frame cost, and where.
///
/// The CPU stages follow each other without a gap, and so do the passes on the device. A frame that was
/// waited for therefore takes as long as its stages and its passes together, minus the device's work that
/// overlapped with the CPU's ([`overlapped_ms`](Self::overlapped_ms)), plus a
/// [`remainder`](Self::remainder_ms): the device's work between passes and before the first one, and CPU time
/// that belongs to no stage. A frame that was not waited for overlaps with its neighbours, so its parts have
/// no sum.
///
/// [`effects`](Self::effects) splits the same cost by effect; these accounts sum to all CPU time, device time
/// and uploaded bytes. What all passes draw with (light lists, buffers, meshes, textures, irradiance volumes,
/// pipelines of lit surfaces) is attributed to [`SCENE`]. An effect that is a feature of the lit shaders
/// (spot lights, fog, textures) has no time of its own within the pass that draws with it;
/// [`effect_costs`](crate::effect_costs()) (`lumbre explain --measure`) measures it by leaving it out.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Accounting {
    /// Number of the frame, counted from 1 by its renderer.
    pub frame: u64,
    /// Milliseconds from the call of `render` until the device had finished, if the frame was waited for.
    pub wall_ms: Option<f64>,
    /// CPU milliseconds until `render` returned.
    pub cpu_ms: f64,
    /// The stages that this time consists of, in the order of the frame.
    pub stages: Vec<StageAccount>,
    /// Milliseconds between the return of `render` and the call of `wait`, spent by the caller.
    pub between_ms: Option<f64>,
    /// Milliseconds in which the CPU waited for the device.
    pub waiting_ms: Option<f64>,
    /// Milliseconds of passes that the device ran while the CPU was still working, if the frame was waited
    /// for. This is a lower bound: the time of the passes minus the time of waiting.
    pub overlapped_ms: Option<f64>,
    /// Device milliseconds from the beginning of the first pass to the end of the last one.
    pub gpu_ms: Option<f64>,
    /// Device milliseconds within passes.
    pub passes_ms: Option<f64>,
    /// The passes that this time consists of, in the order of the frame.
    pub passes: Vec<PassAccount>,
    /// The same cost by the effect that declared the passes, together with what each effect did outside of
    /// its passes.
    pub effects: Vec<EffectAccount>,
    /// What was uploaded, by kind.
    pub uploads: Uploads,
    /// The lightmaps that the renderer keeps on the device, with their format.
    pub lightmaps: LightmapMemory,
    /// What could not be measured, and why.
    pub notes: Vec<String>,
}

/// One CPU stage.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct StageAccount {
    /// Its name.
    pub stage: &'static str,
    /// Milliseconds.
    pub ms: f64,
}

/// One pass.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct PassAccount {
    /// Its name.
    pub pass: String,
    /// The effect that declared it.
    pub effect: String,
    /// Passes with the same group were merged into one wgpu pass.
    pub group: usize,
    /// CPU milliseconds for recording its commands.
    pub cpu_ms: Option<f64>,
    /// Device milliseconds; of the whole group if `shared` is true.
    pub gpu_ms: Option<f64>,
    /// True if the device cannot time the passes of the group separately. Each of them then has the time of
    /// the whole group.
    pub shared: bool,
    /// Shader invocations.
    pub invocations: Option<Invocations>,
    /// Lights that its vertices, fragments or pixels (in compute shaders) tested, if they were counted.
    pub lights: Option<LightCount>,
}

/// How many lights a pass tests, and how many of these contribute. They are counted while the pass draws, by
/// vertices under flat and Gouraud shading and by fragments under Phong shading, or by the pass that lights the
/// G-buffer in compute shaders, which counts visible pixels. Fragments that a later draw
/// covers are included. Fragments that are already hidden are not, because they are not shaded; masked
/// surfaces are the exception, because their fragments run before the depth test.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct LightCount {
    /// Evaluations of a light at a point, for lights of the object's list and of the cluster's list. Neither
    /// ambient lights nor the padding of a cluster's list count.
    pub tested: u64,
    /// Evaluations whose light contributes more than 1/255 in at least one channel: the ambient, diffuse and
    /// specular parts that the shader adds to the surface's colour at this point, including shadow and
    /// textures, times the exposure. Other lights, clamps, fog, blending and tone curve are not considered.
    /// At a vertex, a texture that the fragments modulate by is not considered either.
    pub contributing: u64,
}

/// The cost of one effect.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct EffectAccount {
    /// Name of the effect, or [`SCENE`]. For merged passes that the device cannot time separately, the names
    /// of all effects that share them, joined by " + ".
    pub effect: String,
    /// Its passes that ran.
    pub passes: Vec<String>,
    /// Milliseconds on the CPU.
    pub cpu_ms: f64,
    /// Milliseconds on the device.
    pub gpu_ms: Option<f64>,
    /// Shader invocations.
    pub invocations: Option<Invocations>,
    /// Bytes uploaded.
    pub uploaded_bytes: u64,
    /// Pipelines that were made.
    pub pipelines_made: usize,
}

/// Name of the account for what all lit passes share and for what no effect did.
pub const SCENE: &str = "scene";

/// What an effect did in a frame outside of its passes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct EffectShare {
    pub name: &'static str,
    pub cpu_ms: f64,
    pub uploaded_bytes: u64,
    pub pipelines_made: usize,
}

/// What is known about a frame when it is submitted.
#[derive(Clone, Debug)]
pub(crate) struct FrameShares {
    pub stages: CpuStages,
    pub uploads: Uploads,
    pub lightmaps: LightmapMemory,
    pub effects: Vec<EffectShare>,
    /// Pipelines of lit surfaces.
    pub pipelines_made: usize,
}

/// The wall-clock times of a frame that was waited for, in milliseconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Waited {
    pub wall_ms: f64,
    pub waiting_ms: f64,
}

impl Accounting {
    pub(crate) fn new(
        shares: &FrameShares,
        report: &GraphReport,
        lights: impl Fn(&str) -> Option<LightCount>,
        waited: Option<Waited>,
    ) -> Self {
        let stages = shares.stages.named().map(|(stage, ms)| StageAccount { stage, ms }).to_vec();
        let passes: Vec<PassAccount> = report
            .passes
            .iter()
            .map(|pass| PassAccount {
                pass: pass.name.to_string(),
                effect: pass.owner.as_deref().unwrap_or(SCENE).to_owned(),
                group: pass.group,
                cpu_ms: pass.cpu_ms,
                gpu_ms: pass.gpu.ms(),
                shared: matches!(pass.gpu, GpuTime::Group { .. }),
                invocations: pass.invocations,
                lights: lights(&pass.name),
            })
            .collect();
        let cpu_ms = shares.stages.total_ms;
        Self {
            frame: report.frame,
            wall_ms: waited.map(|waited| waited.wall_ms),
            cpu_ms,
            stages,
            between_ms: waited.map(|waited| waited.wall_ms - cpu_ms - waited.waiting_ms),
            waiting_ms: waited.map(|waited| waited.waiting_ms),
            overlapped_ms: waited
                .zip(report.passes_gpu_ms())
                .map(|(waited, passes)| (passes - waited.waiting_ms).max(0.0)),
            gpu_ms: report.gpu_ms,
            passes_ms: report.passes_gpu_ms(),
            effects: by_effect(shares, &passes),
            passes,
            uploads: shares.uploads,
            lightmaps: shares.lightmaps,
            notes: report.notes.clone(),
        }
    }

    /// Returns the milliseconds of the stages, the passes, and the caller's work between drawing and waiting.
    /// Overlapping work counts once. On a device without timestamps, the time of waiting stands for the
    /// passes.
    pub fn accounted_ms(&self) -> f64 {
        let stages: f64 = self.stages.iter().map(|stage| stage.ms).sum();
        let passes = self.passes_ms.or(self.waiting_ms).unwrap_or(0.0) - self.overlapped_ms.unwrap_or(0.0);
        stages + self.between_ms.unwrap_or(0.0) + passes
    }

    /// Returns the milliseconds of the wall-clock time that neither stages nor passes account for; `None` if
    /// the frame was not waited for.
    pub fn remainder_ms(&self) -> Option<f64> {
        Some(self.wall_ms? - self.accounted_ms())
    }

    /// Copies the light counts, pass by pass, of another frame of the same scene. Counting slows a frame
    /// down, so times and counts are best taken from two frames.
    pub fn take_lights_of(&mut self, counted: &Self) {
        for pass in &mut self.passes {
            let same = counted.passes.iter().find(|other| other.pass == pass.pass);
            pass.lights = same.and_then(|same| same.lights);
        }
        self.notes.extend(
            counted.notes.iter().filter(|note| !self.notes.contains(note)).cloned().collect::<Vec<_>>(),
        );
    }

    /// Copies the shader invocations, pass by pass and effect by effect, of another frame of the same scene:
    /// counting them slows a frame down, too.
    pub fn take_invocations_of(&mut self, counted: &Self) {
        for pass in &mut self.passes {
            let same = counted.passes.iter().find(|other| other.pass == pass.pass);
            pass.invocations = same.and_then(|same| same.invocations);
        }
        for effect in &mut self.effects {
            let passes = self.passes.iter().filter(|pass| effect.passes.contains(&pass.pass));
            effect.invocations = passes.filter_map(|pass| pass.invocations).reduce(|sum, own| Invocations {
                vertex: sum.vertex + own.vertex,
                fragment: sum.fragment + own.fragment,
                compute: sum.compute + own.compute,
            });
        }
    }

    /// Formats the account as text: stages, passes, their sum, effects.
    pub fn to_text(&self) -> String {
        let mut text = String::new();
        // Writing to a String cannot fail, here and below.
        let _ = writeln!(text, "frame {}, stage by stage on the CPU{:>30}", self.frame, "ms");
        let short = |stage: &&StageAccount| stage.ms < 0.0005;
        for stage in self.stages.iter().filter(|stage| !short(stage)) {
            let _ = writeln!(text, "  {:<56} {:>9.3}", stage.stage, stage.ms);
        }
        let (count, rest) = self
            .stages
            .iter()
            .filter(short)
            .fold((0, 0.0), |(count, sum), stage| (count + 1, sum + stage.ms));
        if count > 0 {
            let stages = if count == 1 { "stage" } else { "stages" };
            let _ = writeln!(text, "  {:<56} {rest:>9.3}", format!("{count} {stages} under 0.0005 ms"));
        }
        if let Some(ms) = self.between_ms {
            let _ = writeln!(text, "  {:<56} {ms:>9.3}", "between drawing and waiting (the caller's own)");
        }
        self.write_passes(&mut text);
        self.write_sum(&mut text);
        self.write_effects(&mut text);
        if self.lightmaps.textures > 0 {
            let _ = writeln!(text, "lightmaps on the device: {}", self.lightmaps);
        }
        for note in &self.notes {
            let _ = writeln!(text, "note: {note}");
        }
        text
    }

    fn write_passes(&self, text: &mut String) {
        let _ = writeln!(
            text,
            "pass by pass on the device{:>42} {:>11} {:>11}{} {:>13} {:>13}",
            "ms",
            "vertices",
            "fragments",
            self.compute_column("compute"),
            "lights tested",
            "contributing"
        );
        let mut group = None;
        for pass in &self.passes {
            let again = pass.shared && group == Some(pass.group);
            group = Some(pass.group);
            let ms = match pass.gpu_ms {
                Some(_) if again => "with it".to_owned(),
                ms => milliseconds(ms),
            };
            let name = if pass.pass == pass.effect {
                pass.pass.clone()
            } else {
                format!("{} ({})", pass.pass, pass.effect)
            };
            let _ = writeln!(
                text,
                "  {name:<56} {ms:>9} {:>11} {:>11}{} {:>13} {:>13}",
                count(pass.invocations.map(|counts| counts.vertex)),
                count(pass.invocations.map(|counts| counts.fragment)),
                self.compute_column(&count(pass.invocations.map(|counts| counts.compute))),
                count(pass.lights.map(|lights| lights.tested)),
                count(pass.lights.map(|lights| lights.contributing)),
            );
        }
    }

    /// Returns a cell of the column for invocations of compute shaders, which only frames that have any show.
    fn compute_column(&self, cell: &str) -> String {
        let computes = |pass: &PassAccount| pass.invocations.is_some_and(|counts| counts.compute > 0);
        if self.passes.iter().any(computes) { format!(" {cell:>11}") } else { String::new() }
    }

    fn write_sum(&self, text: &mut String) {
        let Some((wall, remainder)) = self.wall_ms.zip(self.remainder_ms()) else {
            let _ = writeln!(
                text,
                "{:.3} ms on the CPU, {} ms on the device: it was not waited for, and frames overlap",
                self.cpu_ms,
                milliseconds(self.gpu_ms)
            );
            return;
        };
        let _ = writeln!(
            text,
            "stages and passes: {:.3} ms; wall clock: {wall:.3} ms; remainder: {remainder:.3} ms, {:.1} % of it",
            self.accounted_ms(),
            100.0 * remainder / wall
        );
        if let Some((waiting, passes)) = self.waiting_ms.zip(self.passes_ms) {
            let _ = writeln!(
                text,
                "  of the remainder {:.3} ms are of no stage, and {:.3} ms are what waiting for the device ({waiting:.3} ms) took beyond its passes",
                self.cpu_ms - self.stages.iter().map(|stage| stage.ms).sum::<f64>(),
                (waiting - passes).max(0.0)
            );
        }
        if let Some(overlapped) = self.overlapped_ms.filter(|ms| *ms > 0.0) {
            let _ = writeln!(
                text,
                "  {overlapped:.3} ms of the passes, which count once, ran while the CPU still worked: the wait was shorter than the passes"
            );
        }
    }

    fn write_effects(&self, text: &mut String) {
        let _ = writeln!(
            text,
            "by effect{:>50} {:>9} {:>11} {:>11}{} {:>13} {:>13}",
            "CPU ms",
            "GPU ms",
            "vertices",
            "fragments",
            self.compute_column("compute"),
            "bytes",
            "pipelines"
        );
        for effect in &self.effects {
            let _ = writeln!(
                text,
                "  {:<46} {:>9.3} {:>9} {:>11} {:>11}{} {:>13} {:>13}",
                effect.effect,
                effect.cpu_ms,
                milliseconds(effect.gpu_ms),
                count(effect.invocations.map(|counts| counts.vertex)),
                count(effect.invocations.map(|counts| counts.fragment)),
                self.compute_column(&count(effect.invocations.map(|counts| counts.compute))),
                effect.uploaded_bytes,
                effect.pipelines_made,
            );
        }
        let _ = writeln!(
            text,
            "  features of the lit shaders (kinds of lights, textures, fog) have no time of their own in a pass: `lumbre explain --measure` leaves them out"
        );
    }
}

fn milliseconds(ms: Option<f64>) -> String {
    ms.map_or_else(|| "-".to_owned(), |ms| format!("{ms:.3}"))
}

fn count(count: Option<u64>) -> String {
    count.map_or_else(|| "-".to_owned(), |count| count.to_string())
}

/// Returns the accounts of the effects in their order, then those of merged passes that cannot be timed
/// separately, then the scene's.
fn by_effect(shares: &FrameShares, passes: &[PassAccount]) -> Vec<EffectAccount> {
    let mut accounts: Vec<EffectAccount> = Vec::new();
    for share in &shares.effects {
        let account = account(&mut accounts, share.name);
        account.cpu_ms += share.cpu_ms;
        account.uploaded_bytes += share.uploaded_bytes;
        account.pipelines_made += share.pipelines_made;
    }
    // The effects that share a wgpu pass whose parts cannot be timed.
    let mut sharers: BTreeMap<usize, Vec<&str>> = BTreeMap::new();
    for pass in passes.iter().filter(|pass| pass.shared) {
        let names = sharers.entry(pass.group).or_default();
        if !names.contains(&pass.effect.as_str()) {
            names.push(&pass.effect);
        }
    }
    let mut timed = Vec::new();
    for pass in passes {
        let own = account(&mut accounts, &pass.effect);
        own.passes.push(pass.pass.clone());
        own.cpu_ms += pass.cpu_ms.unwrap_or(0.0);
        if let Some(counts) = pass.invocations {
            let sum = own.invocations.get_or_insert_default();
            sum.vertex += counts.vertex;
            sum.fragment += counts.fragment;
            sum.compute += counts.compute;
        }
        let of_group = pass.shared && timed.contains(&pass.group);
        if let Some(ms) = pass.gpu_ms.filter(|_| !of_group) {
            let joint = sharers.get(&pass.group).map(|names| names.join(" + "));
            let owner = account(&mut accounts, joint.as_deref().unwrap_or(&pass.effect));
            owner.gpu_ms = Some(owner.gpu_ms.unwrap_or(0.0) + ms);
        }
        timed.push(pass.group);
    }
    let (cpu_ms, bytes) = accounts
        .iter()
        .fold((0.0, 0), |(ms, bytes), account| (ms + account.cpu_ms, bytes + account.uploaded_bytes));
    let scene = account(&mut accounts, SCENE);
    scene.cpu_ms += shares.stages.total_ms - cpu_ms;
    scene.uploaded_bytes += shares.uploads.total().saturating_sub(bytes);
    scene.pipelines_made += shares.pipelines_made;
    accounts
}

/// Returns the account with this name; adds an empty one if there is none.
fn account<'a>(accounts: &'a mut Vec<EffectAccount>, name: &str) -> &'a mut EffectAccount {
    let index = accounts.iter().position(|account| account.effect == name).unwrap_or_else(|| {
        accounts.push(EffectAccount { effect: name.to_owned(), ..EffectAccount::default() });
        accounts.len() - 1
    });
    &mut accounts[index]
}

#[cfg(test)]
mod tests {
    use lumbre_graph::PassReport;

    use super::*;

    fn pass(name: &'static str, owner: &'static str, group: usize, gpu: GpuTime) -> PassReport {
        let invocations = Some(Invocations { vertex: 3, fragment: 10, compute: 0 });
        PassReport {
            name: name.into(),
            owner: Some(owner.into()),
            group,
            cpu_ms: Some(0.25),
            gpu,
            invocations,
        }
    }

    fn shares() -> FrameShares {
        let effect =
            |name, uploaded_bytes| EffectShare { name, cpu_ms: 0.5, uploaded_bytes, pipelines_made: 1 };
        FrameShares {
            stages: CpuStages { objects_ms: 1.0, encoding_ms: 2.0, total_ms: 3.5, ..CpuStages::default() },
            uploads: Uploads { lights: 100, shadows: 40, effects: 2, ..Uploads::default() },
            lightmaps: LightmapMemory::default(),
            effects: vec![effect("shadow maps", 40), effect("forward", 0), effect("glow", 2)],
            pipelines_made: 4,
        }
    }

    fn settled(passes: Vec<PassReport>) -> Accounting {
        let waited = Waited { wall_ms: 14.0, waiting_ms: 10.0 };
        settled_after(passes, waited)
    }

    fn settled_after(passes: Vec<PassReport>, waited: Waited) -> Accounting {
        let report = GraphReport { frame: 7, gpu_ms: Some(9.5), passes, ..GraphReport::default() };
        Accounting::new(&shares(), &report, |_| None, Some(waited))
    }

    #[test]
    fn parts_and_remainder_sum_to_the_wall_clock_and_effects_to_the_same() {
        let alone = |ms| GpuTime::Pass { ms };
        let accounting = settled(vec![
            pass("shadow maps", "shadow maps", 0, alone(2.0)),
            pass("forward", "forward", 1, alone(6.0)),
            pass("glow down", "glow", 2, alone(0.5)),
            pass("glow up", "glow", 3, alone(0.5)),
        ]);
        assert_eq!(accounting.accounted_ms(), 3.0 + 0.5 + 9.0);
        assert_eq!(accounting.remainder_ms(), Some(1.5));
        let sum = |of: &dyn Fn(&EffectAccount) -> f64| accounting.effects.iter().map(of).sum::<f64>();
        assert_eq!(sum(&|effect| effect.cpu_ms), 3.5);
        assert_eq!(sum(&|effect| effect.gpu_ms.unwrap_or(0.0)), 9.0);
        assert_eq!(sum(&|effect| effect.uploaded_bytes as f64), 142.0);
        let glow = &accounting.effects[2];
        assert_eq!((glow.effect.as_str(), glow.gpu_ms, glow.passes.len()), ("glow", Some(1.0), 2));
        assert_eq!(glow.invocations.unwrap().fragment, 20);
        assert_eq!((glow.uploaded_bytes, glow.pipelines_made), (2, 1));
        let scene = accounting.effects.last().unwrap();
        assert_eq!((scene.effect.as_str(), scene.uploaded_bytes, scene.pipelines_made), (SCENE, 100, 4));
        let text = accounting.to_text();
        assert!(
            text.contains("stages and passes: 12.500 ms; wall clock: 14.000 ms; remainder: 1.500 ms, 10.7 %"),
            "{text}"
        );
    }

    #[test]
    fn what_the_device_did_beside_the_cpu_counts_once() {
        let passes = vec![pass("forward", "forward", 0, GpuTime::Pass { ms: 9.0 })];
        let accounting = settled_after(passes, Waited { wall_ms: 10.0, waiting_ms: 6.0 });
        assert_eq!((accounting.overlapped_ms, accounting.between_ms), (Some(3.0), Some(0.5)));
        // Half a millisecond of CPU time belongs to no stage.
        assert_eq!((accounting.accounted_ms(), accounting.remainder_ms()), (9.5, Some(0.5)));
        assert!(accounting.to_text().contains("3.000 ms of the passes"));
    }

    #[test]
    fn a_time_that_effects_share_is_nobodys_alone_and_counts_once() {
        let group = GpuTime::Group { ms: 6.0 };
        let accounting = settled(vec![
            pass("lightmap", "lightmap", 0, group),
            pass("forward", "forward", 0, group),
            pass("glow down", "glow", 1, GpuTime::Group { ms: 1.0 }),
            pass("glow up", "glow", 1, GpuTime::Group { ms: 1.0 }),
        ]);
        assert_eq!(accounting.passes_ms, Some(7.0));
        let gpu = |name: &str| accounting.effects.iter().find(|effect| effect.effect == name).unwrap().gpu_ms;
        assert_eq!((gpu("lightmap"), gpu("forward"), gpu("lightmap + forward")), (None, None, Some(6.0)));
        assert_eq!(gpu("glow"), Some(1.0), "of an effect alone it is its own");
    }

    #[test]
    fn a_frame_that_nobody_waited_for_has_no_sum() {
        let report = GraphReport {
            passes: vec![pass("forward", "forward", 0, GpuTime::NotMeasured)],
            ..GraphReport::default()
        };
        let accounting = Accounting::new(&shares(), &report, |_| None, None);
        assert_eq!((accounting.remainder_ms(), accounting.passes_ms), (None, None));
        assert!(accounting.to_text().contains("was not waited for"));
    }
}
