//! Writes the held-out scenes and, if asked, their reference: `held_out_scenes FOLDER [--points N [NAME …]]`.
//! FOLDER gets NAME.glb, NAME_small.glb (2⁻⁷) and NAME_large.glb (2¹⁰); with `--points` NAME.csv in the columns of the
//! conformance suite, by 48 batches of 1024 paths a point.

use std::error::Error;
use std::fmt::Write;
use std::path::PathBuf;

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/held_out/mod.rs"]
mod held_out;

use held_out::path_tracer::PathTracer;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = PathBuf::from(arguments.next().ok_or("give a folder")?);
    let points = match arguments.next().as_deref() {
        Some("--points") => Some(arguments.next().ok_or("--points needs a number")?.parse::<usize>()?),
        _ => None,
    };
    let names: Vec<String> = arguments.collect();
    std::fs::create_dir_all(&folder)?;
    for (name, scene, layout) in held_out::scenes::all() {
        if !names.is_empty() && !names.iter().any(|wanted| wanted == name) {
            continue;
        }
        for (suffix, scale) in [("", 1.0), ("_small", 1.0 / 128.0), ("_large", 1024.0)] {
            let mut world = scene(layout, scale);
            lumbre_scene::save(&mut world, &folder.join(format!("{name}{suffix}.glb")))?;
        }
        if let Some(count) = points {
            let found = PathTracer::new(&mut scene(layout, 1.0)).points(count, 48, 32, 7 + layout);
            let mut text = String::from("x,y,z,nx,ny,nz,E_r,E_g,E_b,se_r,se_g,se_b\n");
            for p in &found {
                let fields: Vec<String> = p
                    .position
                    .to_array()
                    .iter()
                    .map(|x| format!("{x:.9}"))
                    .chain(p.normal.to_array().iter().map(|x| format!("{x:.7}")))
                    .chain([p.value, p.error].iter().flat_map(|v| v.to_array()).map(|x| format!("{x:.6}")))
                    .collect();
                writeln!(text, "{}", fields.join(","))?;
            }
            std::fs::write(folder.join(format!("{name}.csv")), text)?;
            let mean = found.iter().map(|p| p.value.element_sum() / 3.0).sum::<f64>() / count as f64;
            let mut errors: Vec<f64> = found.iter().map(|p| p.error.max_element() / mean).collect();
            errors.sort_by(f64::total_cmp);
            eprintln!("{name}: mean {mean:.4}, median error {:.3} %", 100.0 * errors[count / 2]);
        }
    }
    Ok(())
}
