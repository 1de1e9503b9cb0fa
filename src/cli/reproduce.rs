//! `kincal reproduce`: experiments of the paper beside its numbers.

use serde_json::json;

use super::Outcome;
use super::arguments::{Global, Item, ReproduceOptions};
use super::output;
use crate::{experiments, report, scene};

pub(crate) fn command(global: &Global, options: &ReproduceOptions) -> anyhow::Result<Outcome> {
    let mut file = scene::read(&options.arm)?;
    if let Some(seed) = global.seed {
        file.set_seed(seed)?;
    }
    let injected = output::injected(&file, &options.arm)?;
    match options.item {
        Item::CountError => {
            let trials = options.trials as usize;
            let bar = output::progress(global, "calibrating", (experiments::count_error::ROWS * trials) as u64);
            let rows = experiments::count_error::run(&file.scene, injected, trials, &|| bar.inc(1))?;
            bar.finish_and_clear();
            output::show(global, &format!("{}\n{}", file.scene.arm_note, report::count_error(&rows)))?;
            output::show_json(global, &json!({ "item": "count-error", "arm": file.scene.arm.name, "rows": rows }))?;
            if rows.iter().any(|row| row.not_converged > 0) {
                return Ok(Outcome::Bad);
            }
        }
    }
    Ok(Outcome::Good)
}
