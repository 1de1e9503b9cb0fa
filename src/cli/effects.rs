//! `kincal effects`: the un-modelled effects that can be simulated, and each against an independent solution.

use anyhow::Context;
use serde_json::json;

use super::Outcome;
use super::arguments::{EffectsOptions, Global};
use super::bar::Bar;
use super::output;
use crate::lab::effect_validation::{self, Line};
use crate::lab::report;

pub(crate) fn command(global: &Global, options: &EffectsOptions) -> anyhow::Result<Outcome> {
    let Some(path) = &options.scene else {
        output::show(global, &report::effects::library())?;
        output::show_json(global, &report::effects::library_json())?;
        return Ok(Outcome::Good);
    };
    let mut file = crate::scene::read(path)?;
    if let Some(seed) = global.seed {
        file.set_seed(seed)?;
    }
    let scene = &file.scene;
    let planned = effect_validation::session(&scene.arm, usize::from(options.poses), scene.seed);
    let cases = effect_validation::cases(&scene.arm);
    let bar = Bar::new(global, None);
    let steps = bar.steps();
    steps.begin("validating", cases.len())?;
    // One after the other: a clock beside other work tells nothing.
    let mut lines: Vec<Line> = Vec::with_capacity(cases.len());
    for case in &cases {
        let line = effect_validation::validate(scene, case, &planned).with_context(|| path.display().to_string())?;
        lines.push(line);
        steps.done()?;
    }
    bar.end();
    output::show(global, &format!("{}: {}\n", scene.name, scene.arm_note))?;
    output::show(global, &report::effects::validation(&lines))?;
    output::show_json(global, &json!({ "scene": scene.name, "seed": scene.seed, "poses": options.poses, "effects": lines }))?;
    Ok(if lines.iter().all(|line| line.good) { Outcome::Good } else { Outcome::Bad })
}
