//! What commands share: scenes with overrides, the file names of a run, listeners, and where text goes.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};

use super::Outcome;
use super::arguments::{Global, SceneOptions};
use super::bar::Bar;
use crate::arm::{Arm, urdf};
use crate::design::problem::DesignProblem;
use crate::design::route::route;
use crate::event::Event;
use crate::identification::outcome::Identification;
use crate::measurement::table;
use crate::progress::{Progress, Stopped};
use crate::recording::truth_file::write_whole;
use crate::recording::write::Recorder;
use crate::scene::{Scene, SceneFile};
use crate::simulation::injected::Injected;

/// Reads a scene and applies the overrides of the command line.
pub(crate) fn scene(global: &Global, options: &SceneOptions) -> anyhow::Result<SceneFile> {
    let mut file = crate::scene::read(&options.scene)?;
    for assignment in &options.set {
        assign(&mut file, assignment)?;
    }
    if let Some(seed) = global.seed {
        file.set_seed(seed)?;
    }
    // Before anything else: a mesh that was skipped or a mass that is not known may be why what follows is refused.
    for text in &file.scene.urdf_notes {
        note(global, &format!("note: {text}"));
    }
    Ok(file)
}

/// Applies an override `KEY=VALUE` of the command line.
pub(crate) fn assign(file: &mut SceneFile, assignment: &str) -> anyhow::Result<()> {
    let Some((key, value)) = assignment.split_once('=') else {
        bail!("--set {assignment}: KEY=VALUE is needed, such as design.count=20");
    };
    let value = value.trim();
    // A shell takes the quotes away: what is no TOML value is a text.
    let is_toml = toml::from_str::<toml::Table>(&format!("value = {value}")).is_ok();
    let text = if is_toml { value.to_owned() } else { toml::Value::String(value.to_owned()).to_string() };
    Ok(file.set(key.trim(), &text)?)
}

/// The hidden part that only a simulated measurement needs.
pub(crate) fn injected<'a>(file: &'a SceneFile, path: &Path) -> anyhow::Result<&'a Injected> {
    file.injected.as_ref().with_context(|| {
        format!(
            "{}: the scene has no [injected] section: there is nothing to simulate; add one, or measure a real arm and use \
             `kincal identify`",
            path.display()
        )
    })
}

/// Says so where the hidden key can be guessed.
pub(crate) fn check_key(global: &Global, injected: &Injected) {
    if injected.seed.len() < 16 {
        note(
            global,
            "note: injected.seed is short: whoever tries all such keys can draw the truth from the recording; `openssl rand -hex 16` \
             makes one that cannot be guessed",
        );
    }
}

/// Stem of a run's files: the scene's name, with the seed where the command line changed it.
pub(crate) fn stem(global: &Global, file: &SceneFile, suffix: &str) -> String {
    let seed = global.seed.map(|seed| format!("-seed{seed}")).unwrap_or_default();
    format!("{}{seed}{suffix}", file.scene.name)
}

/// Tells what should be known of a plan before it is carried out.
pub(crate) fn plan_notes(global: &Global, scene: &Scene, injected: &Injected) {
    crate::simulation::cell::plan::notes(&scene.cell(), injected).iter().for_each(|text| note(global, &format!("note: {text}")));
}

/// A note for people: on stderr, and not at all if they want quiet.
pub(crate) fn note(global: &Global, text: &str) {
    if !global.quiet {
        let _ = writeln!(std::io::stderr().lock(), "{}", plain(text));
    }
}

/// `text` without what a terminal would obey: names in files may hold anything.
pub(crate) fn plain(text: &str) -> std::borrow::Cow<'_, str> {
    let obeyed = |c: char| c.is_control() && c != '\n' && c != '\t';
    if text.contains(obeyed) { text.replace(obeyed, "\u{fffd}").into() } else { text.into() }
}

/// A result for people: on stdout, unless that is for a machine.
pub(crate) fn show(global: &Global, text: &str) -> anyhow::Result<()> {
    if global.json { Ok(()) } else { print(text) }
}

/// The result for a machine.
pub(crate) fn show_json(global: &Global, value: &serde_json::Value) -> anyhow::Result<()> {
    if global.json { print(&serde_json::to_string_pretty(value)?) } else { Ok(()) }
}

/// Writes to stdout; a reader that went away (`| head`) is no error.
pub(crate) fn print(text: &str) -> anyhow::Result<()> {
    match writeln!(std::io::stdout().lock(), "{}", plain(text)) {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        other => Ok(other?),
    }
}

/// Refuses a target for `--rerun` that cannot be, whether or not the command shows anything.
pub(crate) fn check_rerun(global: &Global) -> anyhow::Result<()> {
    #[cfg(feature = "viewer")]
    let _: crate::viewing::Target = global.rerun.parse().with_context(|| format!("--rerun {}", global.rerun))?;
    #[cfg(not(feature = "viewer"))]
    if !["auto", "off"].contains(&global.rerun.as_str()) {
        bail!("--rerun {}: this kincal was built without the viewer; build it with the default features", global.rerun);
    }
    Ok(())
}

/// Refuses, before anything is computed, to write where a folder stands.
pub(crate) fn check_target(path: &Path) -> anyhow::Result<()> {
    ensure!(!path.is_dir(), "{} is a folder: remove it, or choose another folder for what is written with --out", path.display());
    Ok(())
}

/// Writes a small file whole, and its folder where there is none.
pub(crate) fn write(path: &Path, text: &str) -> anyhow::Result<()> {
    let folder = path.parent().map_or(Ok(()), std::fs::create_dir_all);
    folder
        .and_then(|()| write_whole(path, text.as_bytes()))
        .with_context(|| format!("cannot write {}; choose another folder with --out", path.display()))
}

/// Writes the calibrated arm to `path` as URDF; the path, and `None` where the fit did not converge: an arm that is none must not be
/// found there, not even that of an earlier run.
///
/// Where the arm came from the URDF `own`, that is what is written, with new origins and nothing else changed; `frames` adds the measurement
/// frame and the target to it.
pub(crate) fn write_calibrated(
    path: PathBuf,
    arm: &Arm,
    own: Option<&str>,
    frames: bool,
    identification: &Identification,
) -> anyhow::Result<Option<PathBuf>> {
    if !identification.converged {
        if path.exists() {
            std::fs::remove_file(&path).with_context(|| format!("cannot remove {}", path.display()))?;
        }
        return Ok(None);
    }
    write(&path, &calibrated(arm, own, frames, identification)?)?;
    Ok(Some(path))
}

/// The calibrated arm as URDF; see [`write_calibrated`].
pub(crate) fn calibrated(arm: &Arm, own: Option<&str>, frames: bool, identification: &Identification) -> anyhow::Result<String> {
    let values: Vec<f64> = identification.parameters.iter().map(|parameter| parameter.identified).collect();
    let added = if frames { added(arm, &values) } else { Vec::new() };
    let rewritten = own.map(|text| urdf::rewrite(text, arm, &values, &added)).transpose()?.flatten();
    match rewritten {
        Some((text, _)) => Ok(text),
        None => Ok(urdf::export_with(arm, &values)?),
    }
}

/// The measurement frame before the robot's root, and the target behind its tip. `arm` is the arm in the measurement frame: its first frame
/// is that, its last one the target.
fn added(arm: &Arm, values: &[f64]) -> Vec<urdf::Added> {
    let names = arm.chain.frame_names();
    let [measurement, root, .., tip, target] = names.as_slice() else {
        return Vec::new();
    };
    let six = |first: usize| {
        let [x, y, z, yaw, pitch, roll] = std::array::from_fn(|at| values[first + at]);
        [x, y, z, roll, pitch, yaw]
    };
    let last = values.len() - 6;
    let new = |parent: &str, child: &str, first: usize, new_link: &str| urdf::Added {
        parent: parent.to_owned(),
        child: child.to_owned(),
        origin: six(first),
        new_link: new_link.to_owned(),
    };
    vec![new(measurement, root, 0, measurement), new(tip, target, last, target)]
}

/// What to print of a path that may not have been written.
pub(crate) fn written(path: Option<&Path>) -> String {
    path.map_or_else(|| "not written: the fit did not converge".to_owned(), |path| path.display().to_string())
}

/// Held-out errors so many times the fitted ones are no calibration of what was held out.
const HELD_OUT_FROM_ELSEWHERE: f64 = 10.0;

/// How well an identification ended. One that converged on nothing, or predicts worse than the nominal model, is no good answer.
pub(crate) fn judged(identification: &Identification) -> Outcome {
    let worse = match (&identification.held_out, &identification.held_out_nominal) {
        (Some(after), Some(before)) => {
            let expected = identification.fitted.position_m.rms.max(identification.declared_noise.position_m);
            after.position_m.rms > before.position_m.rms || after.position_m.rms > HELD_OUT_FROM_ELSEWHERE * expected
        }
        _ => false,
    };
    if identification.converged && identification.rank > 0 && !worse { Outcome::Good } else { Outcome::Bad }
}

/// Everyone who listens to a run: the recording, the viewer, the progress bar.
pub(crate) struct Audience {
    recorder: Option<Recorder>,
    #[cfg(feature = "viewer")]
    viewer: Option<crate::viewing::Viewer>,
    bar: Bar,
}

impl Audience {
    /// Opens the viewer, then the recording (if `stem` is given): what can fail without leaving anything comes first.
    /// `design` is the problem whose solving they will hear, if any.
    pub(crate) fn open(
        global: &Global,
        arm: &Arm,
        design: Option<&DesignProblem>,
        stem: Option<&str>,
        name: &str,
    ) -> anyhow::Result<Audience> {
        #[cfg(feature = "viewer")]
        let viewer = {
            let viewer = crate::viewing::open(&global.rerun.parse()?, arm, design, name)?;
            if let Some(viewer) = &viewer {
                note(global, &viewer.describe());
            }
            viewer
        };
        #[cfg(not(feature = "viewer"))]
        let _ = name;
        let recorder = stem.map(|stem| Recorder::create(&global.out, stem, arm)).transpose()?;
        Ok(Audience {
            recorder,
            #[cfg(feature = "viewer")]
            viewer,
            bar: Bar::new(global, design.map(|design| design.criterion)),
        })
    }

    /// Ends the progress bar, the viewer and the recording; the path of the recording.
    pub(crate) fn finish(mut self) -> anyhow::Result<Option<PathBuf>> {
        self.bar.end();
        // The recording first: whatever becomes of the viewer, it is worth keeping.
        let recording = self.recorder.take().map(Recorder::finish).transpose()?;
        #[cfg(feature = "viewer")]
        if let Some(viewer) = self.viewer.take() {
            match viewer.finish() {
                // Silent watches any more: no reason to call the run a failure.
                Err(error @ crate::viewing::ViewerError::Lost { .. }) => eprintln!("note: {}", plain(&error.to_string())),
                other => other?,
            }
        }
        Ok(recording)
    }
}

impl Drop for Audience {
    fn drop(&mut self) {
        // Dropped without an end: the command failed, and half a recording of a refused input helps nobody. A panic, like a
        // killed process, leaves what it has.
        if let Some(recorder) = self.recorder.take().filter(|_| !std::thread::panicking()) {
            recorder.discard();
        }
    }
}

impl Progress<&Event> for Audience {
    fn report(&mut self, event: &Event) -> Result<(), Stopped> {
        self.bar.report(event)?;
        if let Some(recorder) = &mut self.recorder {
            recorder.report(event)?;
        }
        #[cfg(feature = "viewer")]
        if let Some(viewer) = &mut self.viewer {
            viewer.report(event)?;
        }
        Ok(())
    }
}

/// A table of `configurations` of `arm` in an order in which the moves are short, from the middle of the joints' limits on.
pub(crate) fn to_visit(arm: &Arm, configurations: &[Vec<f64>]) -> anyhow::Result<String> {
    let joints = &arm.chain.joints;
    let middle: Vec<f64> = joints.iter().map(|joint| 0.5 * (joint.lower + joint.upper)).collect();
    let travel: Vec<f64> = joints.iter().map(|joint| joint.upper - joint.lower).collect();
    Ok(table::write_configurations(configurations, &route(configurations, &middle, &travel), &arm.slides())?)
}
