//! `kincal export`: a robot or measurements in another format.

use anyhow::{Context, bail};
use serde_json::json;

use super::Outcome;
use super::arguments::{ExportOptions, Format, Global};
use super::identify::{input_stem, is_recording};
use super::output;
use crate::kinematics::urdf;
use crate::measurement::{Measurement, table};
use crate::recording::event::Event;
use crate::recording::truth_file::write_whole;
use crate::{recording, scene};

pub(crate) fn command(global: &Global, options: &ExportOptions) -> anyhow::Result<Outcome> {
    let path = &options.input;
    let (extension, text) = if is_recording(path) { from_recording(global, options)? } else { from_scene(options)? };
    std::fs::create_dir_all(&global.out)
        .with_context(|| format!("creating {}; choose another folder with --out", global.out.display()))?;
    let written = global.out.join(format!("{}.{extension}", input_stem(path, "")));
    if written.exists() && std::fs::canonicalize(&written)? == std::fs::canonicalize(path)? {
        bail!("{} would overwrite its own input; choose another folder with --out", written.display());
    }
    write_whole(&written, text.as_bytes()).with_context(|| format!("writing {}", written.display()))?;
    output::show(global, &written.display().to_string())?;
    output::show_json(global, &json!({ "written": written }))?;
    Ok(Outcome::Good)
}

fn from_scene(options: &ExportOptions) -> anyhow::Result<(&'static str, String)> {
    let path = &options.input;
    let file = scene::read(path)?;
    match options.to {
        Format::Urdf => Ok(("urdf", urdf::export(&file.scene.arm)?)),
        Format::Toml => Ok(("public.toml", file.public_toml()?)),
        Format::Csv => bail!("{} is a scene and holds no measurements; give a recording", path.display()),
    }
}

fn from_recording(global: &Global, options: &ExportOptions) -> anyhow::Result<(&'static str, String)> {
    let path = &options.input;
    let recording = recording::read::read(path)?;
    if let Some(cut) = &recording.cut {
        if !options.partial {
            bail!("{cut}; --partial uses what is there");
        }
        output::note(global, &format!("note: {cut}"));
    }
    let file = scene::parse(&recording.start.scene, &format!("{} (scene)", path.display()))?;
    match options.to {
        Format::Toml => Ok(("public.toml", file.public_toml()?)),
        Format::Csv => {
            let measured: Vec<Measurement> = recording
                .events
                .iter()
                .filter_map(|event| match event {
                    Event::Measured(measurement) => Some(measurement.clone()),
                    _ => None,
                })
                .collect();
            if measured.is_empty() {
                bail!("{} holds no measurements", path.display());
            }
            Ok(("csv", table::write(&measured)))
        }
        Format::Urdf => {
            let identified = recording.events.iter().rev().find_map(|event| match event {
                Event::Identified(identification) => Some(identification),
                _ => None,
            });
            let arm = &file.scene.arm;
            let text = match identified {
                Some(identification) => {
                    let values: Vec<f64> = identification.parameters.iter().map(|parameter| parameter.identified).collect();
                    urdf::export_with(arm, &values)?
                }
                None => {
                    output::note(global, "note: the recording holds no identification; this is the nominal arm");
                    urdf::export(arm)?
                }
            };
            Ok(("urdf", text))
        }
    }
}
