//! `kincal design`: choosing alone.

use serde_json::json;

use super::Outcome;
use super::arguments::{Global, SceneOptions};
use super::output::{self, Audience};
use crate::{report, session};

pub(crate) fn command(global: &Global, options: &SceneOptions) -> anyhow::Result<Outcome> {
    let file = output::scene(global, options)?;
    let stem = output::stem(global, &file, "-design");
    let mut audience = Audience::open(global, &file.scene.arm, Some(&file.scene.design), Some(&stem), &stem)?;
    session::start("design", &file.public_toml()?, &mut audience)?;
    let outcome = session::design_and_tell(&file.scene, &mut audience)?;
    let recording = audience.finish()?;
    output::show(global, &report::design(&outcome, file.scene.arm.chain.parameters.len(), file.scene.design.jacobian_scaling))?;
    if let Some(recording) = &recording {
        output::show(global, &format!("Recording   {}", recording.display()))?;
    }
    let arm = &file.scene.arm;
    let path = global.out.join(format!("{stem}.csv"));
    output::check_target(&path)?;
    output::write(&path, &output::to_visit(arm, &outcome.configurations)?)?;
    output::show(global, &format!("To visit    {}", path.display()))?;
    output::show_json(global, &json!({ "design": outcome, "recording": recording, "to_visit": path }))?;
    Ok(Outcome::Good)
}
