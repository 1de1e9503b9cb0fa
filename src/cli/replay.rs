//! `kincal replay`: recompute a recording and compare bit for bit.

use anyhow::{Context, ensure};
use serde_json::json;

use super::Outcome;
use super::arguments::{Global, ReplayOptions};
use super::output::{self, Audience};
use crate::event::{self, Event};
use crate::progress::{Progress, Stopped};
use crate::recording::compare::Comparer;
use crate::recording::truth_file::TruthFile;
use crate::session::{self, Subject};
use crate::simulation::cell::Truth;
use crate::{recording, scene};

pub(crate) fn command(global: &Global, options: &ReplayOptions) -> anyhow::Result<Outcome> {
    let path = &options.recording;
    let recorded = recording::read::read(path)?;
    let measurements = event::measurements(&recorded.events);
    let (file, real) = match &recorded.start.real {
        Some(real) => {
            if let Some(cut) = &recorded.cut {
                anyhow::bail!("{cut}; nothing was compared, because all rows of a table together say where its arm stands");
            }
            let robot = session::real_robot(&recorded.start, real).with_context(|| path.display().to_string())?;
            (None, Some(session::real_arm(real, robot, &measurements).with_context(|| path.display().to_string())?))
        }
        None => (Some(scene::parse(&recorded.start.scene, &format!("{} (scene)", path.display()))?), None),
    };
    let (subject, arm, name) = match (&file, &real) {
        (Some(file), _) => (Subject::Scene(&file.scene), &file.scene.arm, file.scene.name.clone()),
        (None, Some(real)) => (Subject::Real(real), &real.arm, real.arm.name.clone()),
        (None, None) => anyhow::bail!("{} names neither a scene nor a robot", path.display()),
    };

    let truth = options.truth.as_ref().map(|truth| -> anyhow::Result<_> {
        let truth_file = TruthFile::read(truth)?;
        let Subject::Scene(scene) = subject else { anyhow::bail!("--truth: a recording of a real arm has no truth file") };
        ensure!(
            truth_file.scene == scene.name && truth_file.seed == scene.seed,
            "{} belongs to scene `{}` with seed {}, the recording to `{}` with seed {}: give the truth file of this run",
            truth.display(),
            truth_file.scene,
            truth_file.seed,
            scene.name,
            scene.seed
        );
        let section = toml::Table::from_iter([("injected".to_owned(), truth_file.injected.clone().into())]);
        let text = toml::to_string(&section)?;
        let injected = scene::parse_injected(&text, &truth.display().to_string(), &scene.arm)?;
        Ok((injected, truth_file.truth()))
    });
    let truth = truth.transpose()?;

    let problem = file.as_ref().map(|file| &file.scene.design);
    let mut replayer = Replayer {
        comparer: Comparer::open(path, arm)?,
        audience: Audience::open(global, arm, problem, None, &format!("replay of {name}"))?,
    };
    let recomputed = session::replay(subject, &recorded.events, truth.as_ref().map(|(injected, _)| injected), &mut replayer);
    let cut = recorded.cut.is_some();
    let new_truth = match recomputed {
        Ok(truth) => truth,
        // A cut recording ends the repeated run; it may end where too little was measured.
        Err(_) if cut => None,
        Err(error) => return Err(error).with_context(|| format!("replaying {}", path.display())),
    };
    replayer.audience.finish()?;
    let comparison = replayer.comparer.finish()?;
    let truth_equal = match (&truth, &new_truth) {
        (Some((_, recorded)), Some(new)) if !cut => recorded == new,
        _ => true,
    };

    let physics = match (&truth, recorded.events.iter().any(|event| matches!(event, Event::Measured(_)))) {
        (_, false) => "nothing was measured in it",
        (Some(_), true) => "physics recomputed from the truth file",
        (None, true) => "measurements taken as recorded (give --truth to recompute the physics)",
    };
    let identical = comparison.identical() && truth_equal;
    let text = match &comparison.first_difference {
        None if comparison.other_version > 0 => format!(
            "identical as far as it can be compared: {} messages; {} more were recorded by kincal {}, which identifies and diagnoses by \
             other methods than this version ({}): compare those with that version; {physics}",
            comparison.compared,
            comparison.other_version,
            recorded.start.version,
            env!("CARGO_PKG_VERSION")
        ),
        None if cut => format!("identical up to where the recording breaks off: {} messages; {physics}", comparison.compared),
        None if truth_equal => format!("identical: {} messages compared bit for bit; {physics}", comparison.compared),
        None => format!(
            "the recording is identical, but the truth file differs from the physics: {}",
            match (&truth, &new_truth) {
                (Some((_, recorded)), Some(new)) => truth_difference(recorded, new),
                _ => String::new(),
            }
        ),
        Some(difference) => format!("different: {difference}"),
    };
    output::show(global, &text)?;
    output::show_json(
        global,
        &json!({
            "identical": identical && !cut,
            "complete": !cut,
            "messages_compared": comparison.compared,
            "recorded_by": recorded.start.version,
            "not_comparable": comparison.other_version,
            "first_difference": comparison.first_difference.as_ref().map(ToString::to_string),
            "truth_identical": truth.is_some().then_some(truth_equal),
        }),
    )?;
    if let Some(cut) = &recorded.cut {
        anyhow::bail!("{cut}; only what is there was compared");
    }
    Ok(if identical { Outcome::Good } else { Outcome::Bad })
}

/// The first parameter or pose in which two truths differ.
fn truth_difference(recorded: &Truth, recomputed: &Truth) -> String {
    let parameters = recorded.parameters.iter().zip(&recomputed.parameters);
    if let Some((recorded, new)) = parameters.into_iter().find(|(recorded, new)| recorded != new) {
        return format!("{} is {:?} there, {:?} recomputed", recorded.name, recorded.true_value, new.true_value);
    }
    let poses = recorded.poses.iter().zip(&recomputed.poses);
    match poses.into_iter().find(|(recorded, new)| recorded != new) {
        Some((pose, _)) => format!("pose {}", pose.index),
        None => format!("{} poses there, {} recomputed", recorded.poses.len(), recomputed.poses.len()),
    }
}

struct Replayer {
    comparer: Comparer,
    audience: Audience,
}

impl Progress<&Event> for Replayer {
    fn report(&mut self, event: &Event) -> Result<(), Stopped> {
        self.comparer.report(event)?;
        if self.comparer.is_past_cut() {
            // A swarm that was killed early would run to its end for nothing.
            return Err(Stopped("the recording ends here".to_owned()));
        }
        self.audience.report(event)
    }
}
