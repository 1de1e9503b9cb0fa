//! `kincal reproduce`: experiments of the paper beside its numbers.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, ensure};
use serde_json::json;

use super::Outcome;
use super::arguments::{Global, ReproduceOptions};
use super::bar::Bar;
use super::output;
use crate::lab::report::findings as report;
use crate::lab::reproduce::arms::arms;
use crate::lab::reproduce::bench::Bench;
use crate::lab::reproduce::findings::Findings;
use crate::lab::reproduce::{ALL, BEYOND, Experiment};
use crate::recording::truth_file::write_whole;
use crate::scene::{self, SceneFile};
use crate::simulation::cell;

/// The name that stands for all experiments.
pub(super) const EVERYTHING: &str = "all";

pub(crate) fn command(global: &Global, options: &ReproduceOptions) -> anyhow::Result<Outcome> {
    let experiments = chosen(&options.items);
    let scenes = scenes(global, &options.arm)?;
    // Whatever can be refused is refused before hours are spent.
    let folders: Vec<PathBuf> =
        scenes.iter().map(|(file, _)| global.out.join("reproduce").join(output::stem(global, file, ""))).collect();
    for (index, folder) in folders.iter().enumerate() {
        ensure!(
            !folders[..index].contains(folder),
            "two scenes are called {}: their files would overwrite each other; give one at a time",
            scenes[index].0.scene.name
        );
    }
    for folder in &folders {
        std::fs::create_dir_all(folder)
            .with_context(|| format!("cannot make the folder {}; choose another folder with --out", folder.display()))?;
    }
    let (mut found, mut files, mut not_converged) = (Vec::new(), Vec::new(), 0);
    for ((file, path), folder) in scenes.iter().zip(&folders) {
        let injected = output::injected(file, path)?;
        output::show(global, &format!("{}: {}\n", file.scene.name, file.scene.arm_note))?;
        let bar = Bar::new(global, None);
        let steps = bar.steps();
        let bench = Bench::new(&file.scene, injected, &steps);
        for experiment in &experiments {
            let start = Instant::now();
            let trials = options.trials.map_or(experiment.trials, |trials| trials as usize);
            let findings = experiment.run(&bench, trials)?;
            bar.end();
            let written = write(folder, &findings)?;
            output::note(global, &format!("{} on {}: {:.1} s", experiment.name, findings.arm, start.elapsed().as_secs_f64()));
            output::show(global, &report::findings(&findings))?;
            output::show(global, &format!("{}\n", listed(folder, &written)))?;
            not_converged += findings.found.fits.not_converged;
            files.extend(written);
            found.push(findings);
        }
    }
    let notes: Vec<_> = scenes
        .iter()
        .map(|(file, _)| json!({ "scene": file.scene.name, "arm": file.scene.arm.name, "note": file.scene.arm_note }))
        .collect();
    output::show_json(global, &json!({ "arms": notes, "findings": found, "files": files, "not_converged": not_converged }))?;
    if not_converged > 0 {
        output::show(global, &format!("{not_converged} fits did not converge.\n"))?;
        return Ok(Outcome::Bad);
    }
    Ok(Outcome::Good)
}

/// The experiments by their names, each once, in the order of the paper; all of the paper's where there is none.
fn chosen(names: &[String]) -> Vec<&'static Experiment> {
    let all = names.is_empty() || names.iter().any(|name| name == EVERYTHING);
    let named = |experiment: &&Experiment| names.iter().any(|name| name == experiment.name);
    ALL.iter().filter(|experiment| all || named(experiment)).chain(BEYOND.iter().filter(named)).collect()
}

/// Scenes by their paths, or those of all arms.
fn scenes(global: &Global, paths: &[PathBuf]) -> anyhow::Result<Vec<(SceneFile, PathBuf)>> {
    let mut scenes: Vec<(SceneFile, PathBuf)> = if paths.is_empty() {
        arms()?.into_iter().map(|file| (file, PathBuf::new())).collect()
    } else {
        paths.iter().map(|path| Ok((scene::read(path)?, path.clone()))).collect::<anyhow::Result<_>>()?
    };
    for (file, path) in &mut scenes {
        if let Some(seed) = global.seed {
            file.set_seed(seed)?;
        }
        cell::measure::check(&file.scene.cell(), output::injected(file, path)?)?;
    }
    Ok(scenes)
}

/// Writes the data as CSV and the figures as SVG and PNG; the paths.
fn write(folder: &Path, findings: &Findings) -> anyhow::Result<Vec<PathBuf>> {
    let mut written = Vec::new();
    let mut put = |name: &str, extension: &str, bytes: &[u8]| -> anyhow::Result<()> {
        let path = folder.join(format!("{name}.{extension}"));
        output::check_target(&path)?;
        write_whole(&path, bytes)
            .with_context(|| format!("cannot write {}; choose another folder with --out", path.display()))?;
        written.push(path);
        Ok(())
    };
    let claims = report::claims(findings);
    for data in std::iter::once(&claims).chain(&findings.found.data) {
        put(&data.name, "csv", &report::csv(data)?)?;
    }
    for (name, figure) in &findings.found.figures {
        put(name, "svg", figure.svg()?.as_bytes())?;
        put(name, "png", &figure.png()?)?;
    }
    Ok(written)
}

/// The files in a line.
fn listed(folder: &Path, written: &[PathBuf]) -> String {
    let names: Vec<_> = written.iter().filter_map(|path| path.file_name()).map(|name| name.to_string_lossy()).collect();
    format!("Written to {}: {}", folder.display(), names.join(", "))
}
