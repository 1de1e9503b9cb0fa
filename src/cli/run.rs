//! `kincal run`: the whole chain.

use anyhow::Context;
use serde_json::json;

use super::Outcome;
use super::arguments::{Global, SceneOptions};
use super::output::{self, Audience};
use crate::arm::urdf;
use crate::recording::truth_file::TruthFile;
use crate::simulation::cell;
use crate::{report, session};

pub(crate) fn command(global: &Global, options: &SceneOptions) -> anyhow::Result<Outcome> {
    let file = output::scene(global, options)?;
    let injected = output::injected(&file, &options.scene)?;
    let scene = &file.scene;
    let stem = output::stem(global, &file, "");
    let urdf_text = urdf::export(&scene.arm)?;
    let [truth_path, urdf_path, calibrated_path] =
        ["truth.toml", "urdf", "calibrated.urdf"].map(|extension| global.out.join(format!("{stem}.{extension}")));
    output::check_key(global, injected);
    cell::measure::check(&scene.cell(), injected).with_context(|| options.scene.display().to_string())?;
    [&truth_path, &urdf_path, &calibrated_path].into_iter().try_for_each(|path| output::check_target(path))?;
    output::plan_notes(global, scene, injected);

    let mut audience = Audience::open(global, &scene.arm, Some(&scene.design), Some(&stem), &stem)?;
    let run = session::run(scene, &file.public_toml()?, injected, &mut audience)?;
    // Before the recording gets its final name, so that none is ever there without its truth.
    truth_file(&file, &run.truth)?.write(&truth_path)?;
    let recording = audience.finish()?;

    output::write(&urdf_path, &urdf_text)?;
    let calibrated_path = output::write_calibrated(calibrated_path, &scene.arm, None, false, &run.identification)?;

    let parameter_count = scene.arm.chain.parameters.len();
    output::show(global, &format!("{}: {}\n{}\n", scene.name, scene.description, scene.arm_note))?;
    output::show(global, &report::design(&run.design, parameter_count, scene.design.jacobian_scaling))?;
    output::show(global, &report::settling(&run.truth).text)?;
    output::show(global, &report::identification(&run.identification))?;
    let diagnosed = match &run.diagnosis {
        Ok(diagnosis) => report::diagnosis::answer(diagnosis),
        // That nothing can be said of the rest does not make the calibration a bad one.
        Err(error) => {
            let error = error.to_string();
            format!("Note: no diagnosis: {error}{}\n", if error.ends_with('?') { "" } else { "." })
        }
    };
    output::show(global, &diagnosed)?;
    if let Some(recording) = &recording {
        output::show(
            global,
            &format!(
                "Recording   {}\nTruth       {}\nNominal     {}\nCalibrated  {}",
                recording.display(),
                truth_path.display(),
                urdf_path.display(),
                output::written(calibrated_path.as_deref())
            ),
        )?;
    }
    output::show_json(
        global,
        &json!({
            "scene": scene.name,
            "seed": scene.seed,
            "design": run.design,
            "identification": run.identification,
            "diagnosis": run.diagnosis.as_ref().ok(),
            "no_diagnosis": run.diagnosis.as_ref().err().map(ToString::to_string),
            "recording": recording,
            "truth": truth_path,
            "urdf": urdf_path,
            "calibrated_urdf": calibrated_path,
        }),
    )?;
    Ok(output::judged(&run.identification))
}

/// The truth file of a run of `file`.
pub(crate) fn truth_file(file: &crate::scene::SceneFile, truth: &crate::simulation::cell::Truth) -> anyhow::Result<TruthFile> {
    let mut section: toml::Table = toml::from_str(&file.injected_toml()?.unwrap_or_default())?;
    let injected = match section.remove("injected") {
        Some(toml::Value::Table(injected)) => injected,
        _ => toml::Table::new(),
    };
    Ok(TruthFile {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        scene: file.scene.name.clone(),
        seed: file.scene.seed,
        injected,
        parameters: truth.parameters.clone(),
        effects: truth.effects.clone(),
        poses: truth.poses.clone(),
    })
}
