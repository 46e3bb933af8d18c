//! `lumbre bake`: bakes lightmaps for a level and writes it with them.

use std::ffi::OsString;
use std::io::Write;
use std::ops::ControlFlow;
use std::panic::resume_unwind;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, bail};
use bevy_ecs::entity::Entity;
use bevy_ecs::query::With;
use bevy_ecs::world::World;
use glam::DVec3;
use lumbre::bake::{
    BakeError, BakeOptions, BakeReport, Checkpoint, Density, FormFactorMethod, PackedSamples, Probes,
    Quality, Samples, SamplesError, Solver, content_hash,
};
use lumbre::demo::{ATLAS_SIDE, has_light_to_bake};
use lumbre::optics::{Material, SurfaceSample};
use lumbre::scene::{
    LightmapEncoding, MaterialTextures, MetallicRoughnessTexture, SaveOptions, SceneSettings, StaticObject,
    Supercompression, hidden_entities, save_baked,
};

use crate::arguments::{Bake, BakeFormFactors, BakeProbes, BakeQuality, BakeSolver, ExrTexels};
use crate::bake_record::{Asked, BakeRecord, folder_of_bake, hash_of_files};
use crate::interruption::Interruption;
use crate::lightmap_report::{FileLine, summary_of_files, warnings_of_files};
use crate::loading::{Loaded, extension, load_source};
use crate::progress::Shown;
use crate::warnings::shortened;

/// Runs the command.
pub fn run(asked: &Bake) -> anyhow::Result<()> {
    check_output(asked)?;
    let (source, Loaded { mut world, report: loaded }) = load_source(&asked.input, &asked.reading)?;
    if let Some(sky) = asked.sky {
        world.resource_mut::<SceneSettings>().sky = sky;
    }
    check_unlit(&mut world, &asked.input)?;
    check_light(&mut world, asked)?;
    note_metals(&mut world, &asked.input);
    let options = options(asked);
    let files = save_options(asked);
    let what = Asked {
        content: content_hash(&mut world, &options)?.to_string(),
        files: format!("{files:?}"),
        input: hash_of_files(std::iter::once(&asked.input).chain(&loaded.files))
            .with_context(|| format!("{} cannot be read", asked.input.display()))?,
        time: options.time.as_ref().map(Duration::as_secs_f64),
    };
    if let Some(record) = BakeRecord::unchanged(&asked.output, &what).filter(|_| !asked.no_reuse) {
        eprintln!(
            "lumbre: note: {}: unchanged: it is of this level and these options already",
            asked.output.display()
        );
        return print(&record.report, &record.lightmaps, asked.json);
    }
    let checkpoint = Checkpoint {
        interval: asked.checkpoint_every,
        ..Checkpoint::new(checkpoint_path(&asked.output), asked.resume)
    };
    let former = if asked.no_reuse { None } else { former_samples(&asked.output) };
    let interruption = Interruption::handle();
    let (report, samples) =
        interruptible(&interruption, &mut world, &options, former.as_ref(), &checkpoint, asked)?;
    // Compressing the samples takes as long as saving the level. If no thread can be started, they are not kept.
    let packing = samples
        .filter(|_| !asked.no_reuse)
        .map(|samples| std::thread::Builder::new().name("samples".into()).spawn(move || samples.packed()));
    let saved = save_baked(&mut world, &source, &asked.output, &files)
        .with_context(|| format!("what was baked is kept: {}", how_to_continue(&checkpoint.path)))?;
    for note in saved.notes {
        eprintln!("lumbre: note: {}: {note}", asked.output.display());
    }
    let warnings = report.warnings.iter().cloned().chain(warnings_of_files(&saved.lightmaps));
    for warning in shortened(warnings) {
        eprintln!("lumbre: warning: {warning}");
    }
    let lightmaps: Vec<FileLine> = saved.lightmaps.iter().map(FileLine::from).collect();
    BakeRecord::write(&asked.output, what, &saved.files, &lightmaps, &report)?;
    // The samples are written last: a bake that is continued has to start from the same previous samples.
    let packed = packing.map(|thread| thread?.join().unwrap_or_else(|panic| resume_unwind(panic)));
    keep_samples(asked, packed);
    checkpoint.remove().with_context(|| format!("{} cannot be removed", checkpoint.path.display()))?;
    print(&report, &lightmaps, asked.json)
}

fn options(asked: &Bake) -> BakeOptions {
    let density = match (asked.texels_per_meter, asked.map_size) {
        (Some(density), _) => Density::TexelsPerMeter(density),
        (None, Some(side)) => Density::MapSize(side),
        (None, None) => Density::Automatic,
    };
    BakeOptions {
        density,
        error: asked.error,
        time: asked.time,
        quality: match asked.quality {
            BakeQuality::Draft => Quality::Draft,
            BakeQuality::Final => Quality::Final,
        },
        threads: asked.threads.map(usize::from),
        memory: asked.memory,
        probes: match asked.probes {
            BakeProbes::Auto => Probes::Automatic,
            BakeProbes::Always => Probes::Always,
            BakeProbes::Never => Probes::Never,
        },
        probe_spacing: asked.probe_spacing,
        patch_texels: asked.patch_texels,
        gap: asked.gap,
        atlas_size: match (asked.atlas_size, asked.map_size) {
            (Some(0), _) | (None, Some(_)) => None,
            (Some(side), _) => Some(side),
            (None, None) => Some(ATLAS_SIDE),
        },
        seams: !asked.no_seams,
        resolution_error: !asked.no_resolution_error,
        separate_light: asked.separate_light,
        form_factors: match asked.form_factors {
            BakeFormFactors::Cosine => FormFactorMethod::CosineRays,
            BakeFormFactors::Lines => FormFactorMethod::GlobalLines,
        },
        solver: match asked.solver {
            BakeSolver::ConjugateGradients => Solver::ConjugateGradients,
            BakeSolver::GaussSeidel => Solver::GaussSeidel,
            BakeSolver::Jacobi => Solver::Jacobi,
        },
        ..BakeOptions::default()
    }
}

fn save_options(asked: &Bake) -> SaveOptions {
    SaveOptions {
        encoding: match asked.exr {
            ExrTexels::Float => None,
            ExrTexels::Half => Some(LightmapEncoding::Rgb16Float),
        },
        ktx2: asked.ktx2.0,
        supercompression: if asked.ktx2_raw { Supercompression::None } else { Supercompression::Zstandard },
    }
}

fn samples_path(output: &Path) -> PathBuf {
    folder_of_bake(output).join("samples")
}

/// Reads the samples of the previous bake of this output, if they exist and are valid.
fn former_samples(output: &Path) -> Option<Samples> {
    let path = samples_path(output);
    match Samples::read(&path) {
        Ok(samples) => Some(samples),
        Err(SamplesError::Io(error)) if error.kind() == std::io::ErrorKind::NotFound => None,
        Err(error) => {
            eprintln!("lumbre: warning: {}: {error}; everything is baked", path.display());
            None
        }
    }
}

/// Writes the samples for the next bake. Without new samples, for example because the time ran out, those of
/// the previous bake stay valid.
fn keep_samples(asked: &Bake, samples: Option<Result<PackedSamples, SamplesError>>) {
    let path = samples_path(&asked.output);
    let done = match samples {
        _ if asked.no_reuse => match std::fs::remove_file(&path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(error.into()),
            _ => Ok(()),
        },
        Some(samples) => samples.and_then(|samples| samples.write(&path)),
        None => Ok(()),
    };
    if let Err(error) = done {
        // The lightmaps are complete; only the next bake has to start from the beginning.
        eprintln!(
            "lumbre: warning: {}: {error}; the next bake cannot keep what this one found",
            path.display()
        );
    }
}

/// Bakes until the end or the first interruption.
fn interruptible(
    interruption: &Interruption,
    world: &mut World,
    options: &BakeOptions,
    former: Option<&Samples>,
    checkpoint: &Checkpoint,
    asked: &Bake,
) -> anyhow::Result<(BakeReport, Option<Samples>)> {
    if !checkpoint.resume && checkpoint.path.exists() {
        eprintln!(
            "lumbre: note: {}: a checkpoint of an interrupted bake is replaced (--resume would continue it)",
            checkpoint.path.display()
        );
    }
    interruption.say(format!("interrupted; {}", how_to_continue(&checkpoint.path)));
    let (mut shown, mut samples) = (Shown::new(asked.quiet), None);
    let baked = interruption.told(|is_asked| {
        let progress = |progress| {
            shown.update(progress);
            if is_asked() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let bake = lumbre::bake::Bake::new(options).former(former).checkpoint(checkpoint);
        bake.keep_samples(&mut samples).progress(progress).run(world)
    });
    shown.finish();
    match baked {
        Ok(report) => Ok((report, samples)),
        Err(BakeError::Cancelled { stage }) => {
            bail!(
                "interrupted during {stage}; {} is as it was; {}",
                asked.output.display(),
                how_to_continue(&checkpoint.path)
            )
        }
        Err(error) => {
            if !matches!(error, BakeError::Checkpoint { .. }) {
                // The checkpoint could not be continued from. If it cannot be removed either, the first error
                // is the one to report.
                let _ = checkpoint.remove();
            }
            Err(error.into())
        }
    }
}

fn how_to_continue(checkpoint: &Path) -> String {
    format!("the same command with --resume continues from {}", checkpoint.display())
}

/// Returns the checkpoint of an output: `room.baked.glb.checkpoint` for `room.baked.glb`.
fn checkpoint_path(output: &Path) -> PathBuf {
    let mut name = OsString::from(output);
    name.push(".checkpoint");
    name.into()
}

/// Prints the report as text or JSON.
fn print(report: &BakeReport, files: &[FileLine], json: bool) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    if json {
        let mut json = serde_json::to_value(report)?;
        json["files"] = serde_json::to_value(files)?;
        serde_json::to_writer_pretty(&mut out, &json)?;
        writeln!(out)?;
    } else {
        write!(out, "{}{}", summary(report), summary_of_files(files))?;
    }
    Ok(())
}

/// Refuses a level without any light: its bake would take its time and be black.
fn check_light(world: &mut World, asked: &Bake) -> anyhow::Result<()> {
    if has_light_to_bake(world) {
        return Ok(());
    }
    let (input, output) = (asked.input.display(), asked.output.display());
    bail!(
        "{input}: there is nothing to bake: it has no light that is baked, no emission and no sky; \
         `lumbre bake {input} -o {output} --sky 1` bakes it under an even white sky"
    )
}

/// Says how many static meshes are unlit, which a bake leaves out.
///
/// # Errors
/// If all of those that are shown are: then there is nothing to bake.
fn check_unlit(world: &mut World, input: &Path) -> anyhow::Result<()> {
    let hidden = hidden_entities(world);
    let mut materials = world.query_filtered::<(Entity, &Material), With<StaticObject>>();
    let shown = materials.iter(world).filter(|(entity, _)| !hidden.contains(entity));
    let (count, unlit) =
        shown.fold((0, 0), |(count, unlit), (_, material)| (count + 1, unlit + u32::from(material.unlit)));
    let input = input.display();
    if unlit > 0 && unlit == count {
        bail!(
            "{input}: there is nothing to bake: every static mesh is unlit (KHR_materials_unlit), and shows its colour as it is; \
             give those that are to be lit another material"
        );
    }
    if unlit > 0 {
        eprintln!(
            "lumbre: note: {input}: {unlit} of {count} static meshes are unlit: they show their colour as it is, and neither \
             take baked light nor block it"
        );
    }
    Ok(())
}

/// Says how many static meshes are metal: without diffuse reflection, they take baked light by what stands for their
/// highlight. Many programs export painted surfaces so.
fn note_metals(world: &mut World, input: &Path) {
    let mut objects = world.query_filtered::<(&Material, Option<&MaterialTextures>), With<StaticObject>>();
    let (mut count, mut metals) = (0, 0);
    for (material, textures) in objects.iter(world) {
        let whole = |slot: &MetallicRoughnessTexture| {
            slot.metallic == 1.0 && slot.texture.image.rgba.chunks(4).all(|texel| texel[2] == u8::MAX)
        };
        let by_texture = textures.and_then(|textures| textures.metallic_roughness.as_ref()).map(whole);
        count += 1;
        let of_one_colour = || {
            let front = SurfaceSample::new(material, true);
            front.diffuse == DVec3::ZERO && front.reflectance_as_metal() != DVec3::ZERO
        };
        let is_metal = by_texture.unwrap_or_else(of_one_colour);
        metals += u32::from(is_metal && material.reflects_as_metal() && !material.unlit);
    }
    if metals > 0 {
        eprintln!(
            "lumbre: note: {}: {metals} of {count} static meshes are metal, which reflects baked light only by its \
             highlight and is darker for it; for paint, cloth or wood set metallicFactor to 0",
            input.display()
        );
    }
}

/// Returns true if two paths lead to the same existing file, through links or not.
fn is_same_file(one: &Path, other: &Path) -> bool {
    match (std::fs::canonicalize(one), std::fs::canonicalize(other)) {
        (Ok(one), Ok(other)) => one == other,
        // A file that does not exist is not the same as any other.
        _ => false,
    }
}

/// Checks the output before the work starts rather than after it.
fn check_output(asked: &Bake) -> anyhow::Result<()> {
    let path = &asked.output;
    if !asked.overwrite && is_same_file(&asked.input, path) {
        bail!(
            "{}: this is the level itself, which the baked one would replace; name another output, or allow it with --overwrite",
            path.display()
        );
    }
    let extension = extension(path)?;
    if !["glb", "gltf"].contains(&extension.as_str()) {
        bail!("{}: .{extension} is not written, only .glb and .gltf", path.display());
    }
    if path.is_dir() {
        bail!("{}: this is a folder; name a file", path.display());
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        bail!("{}: there is no folder {}; make it first", path.display(), folder.display());
    }
    for own in [path.with_extension("lightmaps"), folder_of_bake(path)] {
        if own.exists() && !own.is_dir() {
            bail!("{}: this is to be a folder, but it is a file; move it away", own.display());
        }
    }
    tempfile::tempfile_in(folder)
        .map(drop)
        .with_context(|| format!("{}: the folder {} cannot be written to", path.display(), folder.display()))
}

/// Returns the report as text.
fn summary(report: &BakeReport) -> String {
    let mut text = format!(
        "{} maps, {} texels ({:.0} % covered), {} patches, {:.1} million rays at {:.2} Mrays/s\n\
         estimated error {:.2} % of the light around, {:.2} % in the worst room's view, {:.2} % of the level's mean ({}), \
         {:.1} s on {} threads\n",
        report.maps,
        report.texels,
        100.0 * report.coverage,
        report.patches,
        report.rays as f64 * 1e-6,
        report.mega_rays_per_second,
        100.0 * report.estimated_error,
        100.0 * report.error_in_worst_view,
        100.0 * report.error_of_mean,
        report.ended,
        report.seconds,
        report.threads,
    );
    if let Some(parts) = report.error_parts_in_words() {
        text.push_str(&format!("  {parts}\n"));
    }
    for place in &report.worst {
        text.push_str(&format!("  {place}\n"));
    }
    if let Some(rebake) = &report.rebake {
        text.push_str(&format!("{rebake}\n"));
    }
    if report.probes.resolution != [0; 3] {
        let [x, y, z] = report.probes.resolution;
        text.push_str(&format!(
            "{x} x {y} x {z} probes ({} inside geometry), estimated error {:.2} %\n",
            report.probes.inside,
            100.0 * report.probes.estimated_error
        ));
    }
    if report.resolution.points > 0 {
        text.push_str(&format!(
            "the map's resolution leaves {:.2} % ± {:.2} % beside that\n",
            100.0 * report.resolution.error,
            100.0 * report.resolution.standard_error
        ));
    }
    for lumbre::bake::ErrorAtTime { seconds, error, .. } in &report.curve {
        let line = format!("  after {seconds:8.2} s the error was {:.2} %\n", 100.0 * error);
        if !text.ends_with(&line) {
            text.push_str(&line);
        }
    }
    for stage in &report.stages {
        text.push_str(&format!("  {:24} {:7.2} s\n", stage.stage, stage.seconds));
    }
    for skipped in &report.skipped {
        text.push_str(&format!("  skipped: {skipped}\n"));
    }
    text
}
