//! `kincal measure`: measuring alone, of configurations that a design chose.

use anyhow::{Context, ensure};
use serde_json::json;

use super::Outcome;
use super::arguments::{Global, LayoutOptions, MeasureOptions};
use super::input;
use super::output::{self, Audience};
use crate::event::{Event, Start};
use crate::measurement::table;
use crate::progress::Progress as _;
use crate::scene::Scene;
use crate::simulation::cell;
use crate::{recording, report, session};

/// How names of tables end.
const TABLES: [&str; 3] = ["csv", "tsv", "txt"];

pub(crate) fn command(global: &Global, options: &MeasureOptions) -> anyhow::Result<Outcome> {
    let file = output::scene(global, &options.scene)?;
    let injected = output::injected(&file, &options.scene.scene)?;
    let scene = &file.scene;
    let ending = options.design.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
    let configurations = if !TABLES.contains(&ending.as_str()) {
        of_recording(options, scene)?
    } else {
        let hints = table::Hints { needs: table::Needs::Joints, ..input::hints(&scene.arm, &LayoutOptions::default())? };
        let table = table::read_as(&options.design, &hints)?;
        input::check_units(&options.design, &table, &scene.arm)?;
        table.measurements.into_iter().map(|row| row.joints).collect()
    };
    for (index, joints) in configurations.iter().enumerate() {
        ensure!(
            joints.len() == scene.arm.joint_count() && scene.arm.within_limits(joints),
            "configuration {} of {} does not fit the arm of {}: {} joints within the scene's limits are needed; was it made for \
             another scene?",
            index + 1,
            options.design.display(),
            options.scene.scene.display(),
            scene.arm.joint_count(),
        );
    }

    let stem = output::stem(global, &file, "-measure");
    let truth_path = global.out.join(format!("{stem}.truth.toml"));
    output::check_key(global, injected);
    cell::measure::check(&scene.cell(), injected).with_context(|| options.scene.scene.display().to_string())?;
    output::check_target(&truth_path)?;
    output::plan_notes(global, scene, injected);
    let mut audience = Audience::open(global, &scene.arm, None, Some(&stem), &stem)?;
    let poses = Some((configurations.len() + scene.plan.held_out_count) * scene.plan.repeats);
    audience.report(&Event::Start(Start { poses, ..session::start_event("measure", &file.public_toml()?) }))?;
    let (measurements, truth) = session::measure_design(scene, injected, &configurations, &mut audience)?;
    super::run::truth_file(&file, &truth)?.write(&truth_path)?;
    let recording = audience.finish()?;

    let settling = report::settling(&truth);
    output::show(global, &settling.text)?;
    if let Some(recording) = &recording {
        output::show(global, &format!("Recording   {}\nTruth       {}", recording.display(), truth_path.display()))?;
    }
    output::show_json(
        global,
        &json!({ "poses": measurements.len(), "settled": settling.settled, "recording": recording, "truth": truth_path }),
    )?;
    Ok(if settling.settled == measurements.len() { Outcome::Good } else { Outcome::Bad })
}

/// The configurations that a recorded design chose for the arm of `scene`.
fn of_recording(options: &MeasureOptions, scene: &Scene) -> anyhow::Result<Vec<Vec<f64>>> {
    let designed = recording::read::read(&options.design)?;
    let outcome = designed
        .events
        .iter()
        .find_map(|event| match event {
            Event::Designed(outcome) => Some(outcome),
            _ => None,
        })
        .with_context(|| format!("{} holds no design; make one with `kincal design`", options.design.display()))?;
    let designed_for = crate::scene::parse(&designed.start.scene, &options.design.display().to_string())?;
    ensure!(
        designed_for.scene.arm.chain == scene.arm.chain,
        "{} was designed for the arm of scene `{}`, whose kinematics differ from {}'s: design for this scene",
        options.design.display(),
        designed_for.scene.name,
        options.scene.scene.display()
    );
    Ok(outcome.configurations.clone())
}
