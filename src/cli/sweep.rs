//! `kincal sweep`: what un-modelled effects do to a calibration.

use std::ops::Range;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use serde::Deserialize;
use serde_json::json;

use super::Outcome;
use super::arguments::{Global, SceneOptions, SweepOptions};
use super::bar::Bar;
use super::output;
use crate::arm::Arm;
use crate::design::problem::Method;
use crate::effects::Kind;
use crate::effects::Level;
use crate::lab::injection::{self, magnitudes, written};
use crate::lab::report;
use crate::lab::sweep::grid::{COURSES, Injecting, SCENES_COURSE};
use crate::lab::sweep::results::{Reader, merge};
use crate::lab::sweep::{Background, CellSummary, Grid, Header, Reduction, Results, Sweep};
use crate::recording::tables::{self, Table};
use crate::recording::truth_file::write_whole;
use crate::scene::Scene;
use crate::simulation::cell;

/// A magnitude so many times the largest realistic one is a mistake in its unit.
const ABSURD: f64 = 100.0;
/// Trials in every cell if nobody asks for another number.
const TRIALS: u64 = 100;

pub(crate) fn command(global: &Global, options: &SweepOptions) -> anyhow::Result<Outcome> {
    if !options.merge.is_empty() {
        return merged(global, options);
    }
    let scene =
        options.scene.clone().context("which scene? `kincal sweep scenes/arm8.toml`, or --merge with files of results")?;
    let axes = Axes::new(options)?;
    let trials = trials(axes.trials.as_deref())?;
    let file = output::scene(global, &SceneOptions { scene: scene.clone(), set: options.set.clone() })?;
    let injected = output::injected(&file, &scene)?;
    cell::measure::check(&file.scene.cell(), injected).with_context(|| scene.display().to_string())?;
    let grid = axes.grid(&file.scene)?;
    let stem = output::stem(global, &file, "-sweep");
    let path = global.out.join(format!("{stem}.jsonl"));
    output::check_target(&path)?;
    let bar = Bar::new(global, None);
    let sweep = Sweep::new(&file, injected, &grid, &bar.steps())?;
    let mut results = Results::open(&path, sweep.header(), trials.clone())?;
    let cells = sweep.header().cells.len() as u64;
    if results.count() > 0 {
        output::note(
            global,
            &format!(
                "going on behind {} of {} trials in {}",
                results.count(),
                cells * (trials.end - trials.start),
                path.display()
            ),
        );
    }
    sweep.run(trials.clone(), &mut results, &bar.steps())?;
    bar.end();
    drop(results);
    told(global, &stem, &path, trials)
}

/// Merges parts, and tells what they say together.
fn merged(global: &Global, options: &SweepOptions) -> anyhow::Result<Outcome> {
    ensure!(
        options.scene.is_none() && options.set.is_empty(),
        "--merge takes files of results and no scene: what was swept stands in them"
    );
    let mut parts = Vec::new();
    for part in &options.merge {
        parts.push(if part.is_dir() { only_results(part)? } else { part.clone() });
    }
    let header = Reader::open(&parts[0])?.header()?.with_context(|| format!("{} is empty", parts[0].display()))?;
    let name = parts[0].file_stem().map(|name| name.to_string_lossy().into_owned());
    let stem = name.unwrap_or_else(|| format!("{}-sweep", header.scene));
    let path = global.out.join(format!("{stem}.jsonl"));
    output::check_target(&path)?;
    for part in &parts {
        let same =
            std::fs::canonicalize(part).ok().zip(std::fs::canonicalize(&path).ok()).is_some_and(|(part, path)| part == path);
        ensure!(!same, "{} would be overwritten by what it is merged into; choose another folder with --out", part.display());
    }
    let trials = merge(&parts, &path)?;
    told(global, &stem, &path, trials)
}

/// The only file of results in a folder.
fn only_results(folder: &Path) -> anyhow::Result<PathBuf> {
    let entries = std::fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    let mut found: Vec<PathBuf> = entries
        .filter_map(Result::ok)
        .map(|entry| entry.path())
        .filter(|path| path.file_name().is_some_and(|name| name.to_string_lossy().ends_with("-sweep.jsonl")))
        .collect();
    found.sort();
    match found.as_slice() {
        [one] => Ok(one.clone()),
        [] => bail!("{}: no file of results (*-sweep.jsonl) is in it", folder.display()),
        _ => bail!("{}: {} files of results are in it; name the one", folder.display(), found.len()),
    }
}

/// Reads the results trial by trial, and writes and prints what they say together.
fn told(global: &Global, stem: &str, path: &Path, trials: Range<u64>) -> anyhow::Result<Outcome> {
    let (header, cells) = reduced(path)?;
    let text = report::sweep::sweep(&cells);
    let at = |extension: &str| global.out.join(format!("{stem}.{extension}"));
    let mut written = vec![path.to_owned()];
    let mut put = |path: PathBuf, bytes: &[u8]| -> anyhow::Result<()> {
        output::check_target(&path)?;
        write_whole(&path, bytes)
            .with_context(|| format!("cannot write {}; choose another folder with --out", path.display()))?;
        written.push(path);
        Ok(())
    };
    let [table, combinations] = report::sweep::data(&cells);
    put(at("csv"), &report::findings::csv(&table)?)?;
    put(global.out.join(format!("{stem}-combinations.csv")), &report::findings::csv(&combinations)?)?;
    let figure = report::sweep::figure(&header.scene, &cells);
    put(at("svg"), figure.svg()?.as_bytes())?;
    put(at("png"), &figure.png()?)?;
    let recording = at("mcap");
    let tables = [
        Table::new("/sweep", "kincal.Sweep", std::slice::from_ref(&header))?,
        Table::new("/sweep/cell", "kincal.SweepCell", &cells)?,
    ];
    tables::write(&recording, &tables, &text)?;
    written.push(recording);
    output::show(global, &format!("{}: {}\n{text}", header.scene, header.arm_note))?;
    let names: Vec<_> = written.iter().filter_map(|path| path.file_name()).map(|name| name.to_string_lossy()).collect();
    output::show(global, &format!("Written to {}: {}", global.out.display(), names.join(", ")))?;
    output::show_json(
        global,
        &json!({ "scene": header.scene, "hash": header.hash, "trials": [trials.start, trials.end], "cells": cells, "files": written }),
    )?;
    Ok(if cells.iter().any(|cell| cell.not_converged > 0) { Outcome::Bad } else { Outcome::Good })
}

fn reduced(path: &Path) -> anyhow::Result<(Header, Vec<CellSummary>)> {
    let mut reader = Reader::open(path)?;
    let header = reader.header()?.with_context(|| format!("{} is empty", path.display()))?;
    let mut reduction = Reduction::new(&header);
    while let Some(record) = reader.next()? {
        reduction.take(&record);
    }
    let cells = reduction.finish();
    Ok((header, cells))
}

/// `100` or `1000..2000`.
fn trials(text: Option<&str>) -> anyhow::Result<Range<u64>> {
    let Some(text) = text else { return Ok(0..TRIALS) };
    let number = |text: &str| text.trim().parse::<u64>().ok().filter(|number| *number <= 1_000_000_000);
    let range = match text.split_once("..") {
        Some((from, to)) => number(from).zip(number(to)).map(|(from, to)| from..to),
        None => number(text).map(|count| 0..count),
    };
    match range {
        Some(range) if !range.is_empty() => Ok(range),
        _ => bail!("--trials {text}: give a number such as 100, or numbers from and to (excluded) such as 1000..2000"),
    }
}

/// The axes as they were written, in options or in a file; the names are the same.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "snake_case")]
struct Axes {
    effect: Vec<String>,
    at: Vec<String>,
    magnitudes: Option<String>,
    poses: Vec<usize>,
    method: Vec<String>,
    approach: Vec<String>,
    temperature: Vec<String>,
    payloads_kg: Vec<Vec<f64>>,
    repeats: Vec<usize>,
    keep_injected: bool,
    trials: Option<String>,
}

impl Axes {
    fn new(options: &SweepOptions) -> anyhow::Result<Axes> {
        let mut axes = match &options.grid {
            Some(path) => {
                let text = crate::files::text(path, crate::files::LARGEST_TEXT)
                    .with_context(|| format!("cannot read {}", path.display()))?;
                toml::from_str(&text).map_err(|error| anyhow::anyhow!("{}: {}", path.display(), error.to_string().trim_end()))?
            }
            None => Axes::default(),
        };
        // An option stands over the file.
        let over = |into: &mut Vec<String>, from: &[String]| {
            if !from.is_empty() {
                *into = from.to_vec();
            }
        };
        over(&mut axes.effect, &options.effect);
        over(&mut axes.at, &options.at);
        over(&mut axes.method, &options.method);
        over(&mut axes.approach, &options.approach);
        over(&mut axes.temperature, &options.temperature);
        if !options.poses.is_empty() {
            axes.poses.clone_from(&options.poses);
        }
        if !options.repeats.is_empty() {
            axes.repeats.clone_from(&options.repeats);
        }
        if !options.payloads.is_empty() {
            axes.payloads_kg = options
                .payloads
                .iter()
                .map(|text| {
                    let masses = text.split(',').map(|mass| mass.trim().trim_end_matches("kg").trim().parse::<f64>());
                    masses.collect::<Result<Vec<f64>, _>>().ok().with_context(|| {
                        format!(
                            "--payloads {text}: masses in kg that take turns, such as 0,5; give the option again for another set"
                        )
                    })
                })
                .collect::<anyhow::Result<_>>()?;
        }
        axes.magnitudes = options.magnitudes.clone().or(axes.magnitudes);
        axes.trials = options.trials.clone().or(axes.trials);
        axes.keep_injected |= options.keep_injected;
        Ok(axes)
    }

    fn grid(&self, scene: &Scene) -> anyhow::Result<Grid> {
        let plan = &scene.plan;
        let or = |given: &[usize], default: usize| if given.is_empty() { vec![default] } else { given.to_vec() };
        let masses = |masses: &[f64]| {
            ensure!(
                !masses.is_empty() && masses.iter().all(|mass| (0.0..=1000.0).contains(mass)),
                "payloads {masses:?}: one or more masses from 0 to 1000 kg are needed"
            );
            Ok(())
        };
        self.payloads_kg.iter().try_for_each(|set| masses(set))?;
        let repeats = or(&self.repeats, plan.repeats);
        ensure!(
            repeats.iter().all(|repeats| (1..=100).contains(repeats)),
            "repeats {repeats:?}: 1 to 100 readings of a configuration"
        );
        Ok(Grid {
            effects: self.effects(&scene.arm)?,
            poses: or(&self.poses, scene.design.count),
            methods: named("method", &self.method, scene.design.method, &Method::ALL.map(Method::name))?,
            approaches: named(
                "approach",
                &self.approach,
                plan.approach.policy,
                &["direct", "up", "down", "alternate", "random"],
            )?,
            temperatures: named("temperature", &self.temperature, SCENES_COURSE.to_owned(), &COURSES)?,
            payloads_kg: if self.payloads_kg.is_empty() { vec![plan.payloads_kg.clone()] } else { self.payloads_kg.clone() },
            repeats,
            background: if self.keep_injected { Background::Scene } else { Background::Nothing },
        })
    }

    fn effects(&self, arm: &Arm) -> anyhow::Result<Vec<Injecting>> {
        if self.effect.is_empty() {
            ensure!(
                self.at.is_empty() && self.magnitudes.is_none(),
                "at and magnitudes say where and how much of which effect? Name it: --effect radial_clearance"
            );
            return Ok(vec![Injecting::nothing(), Injecting::as_the_scene()]);
        }
        let mut effects: Vec<Injecting> = Vec::new();
        for name in &self.effect {
            let kind = Kind::from_name(name).with_context(|| {
                format!(
                    "effect {name}: no such effect; there are {}",
                    Kind::ALL.into_iter().map(Kind::name).collect::<Vec<_>>().join(", ")
                )
            })?;
            let places = places(kind, &self.at, arm)?;
            let [low, high] = kind.range(places[0], arm.joint_count());
            let values = match &self.magnitudes {
                Some(text) => magnitudes(text, kind).map_err(|why| anyhow::anyhow!("magnitudes {text}: {why}"))?,
                None => vec![0.0, low, (low * high).sqrt(), high],
            };
            for value in &values {
                ensure!(
                    *value <= ABSURD * high,
                    "magnitudes: {} of {name} is no fault but another machine; realistic are {} to {}, and up to {ABSURD} times that is \
                     taken",
                    written(*value, kind),
                    written(low, kind),
                    written(high, kind)
                );
            }
            for injecting in Injecting::all(kind, &places, &values) {
                if !effects.contains(&injecting) {
                    effects.push(injecting);
                }
            }
        }
        Ok(effects)
    }
}

/// Values by their names, or the default.
fn named<T: serde::de::DeserializeOwned + Clone>(
    what: &str,
    given: &[String],
    default: T,
    allowed: &[&str],
) -> anyhow::Result<Vec<T>> {
    if given.is_empty() {
        return Ok(vec![default]);
    }
    given
        .iter()
        .map(|name| {
            let found = allowed.contains(&name.as_str()).then(|| serde_json::from_value(json!(name)).ok()).flatten();
            found.with_context(|| format!("{what} {name}: no such {what}; there are {}", allowed.join(", ")))
        })
        .collect()
}

/// Places (from 0) by names or numbers from 1; all if none is given.
fn places(kind: Kind, given: &[String], arm: &Arm) -> anyhow::Result<Vec<Option<usize>>> {
    let possible = injection::places(kind, arm);
    if given.is_empty() || given.iter().any(|name| name == "all") || possible == [None] {
        return Ok(possible);
    }
    let name = |place: usize| match kind.level() {
        Level::Link => arm.links[place + 1].name.as_str(),
        _ => arm.chain.joints[place].name.as_str(),
    };
    given
        .iter()
        .map(|text| {
            let number = text.trim_start_matches("joint").trim_start_matches("link").parse::<usize>().ok();
            let found = possible.iter().flatten().find(|place| name(**place) == text || number == Some(**place + 1));
            found.map(|place| Some(*place)).with_context(|| {
                let names: Vec<&str> = possible.iter().flatten().map(|place| name(*place)).collect();
                format!("at {text}: {} cannot sit there; this arm has {}", kind.name(), names.join(", "))
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trials_are_a_number_or_a_range() {
        assert_eq!(trials(None).unwrap(), 0..TRIALS);
        assert_eq!(trials(Some("7")).unwrap(), 0..7);
        assert_eq!(trials(Some("1000..2000")).unwrap(), 1000..2000);
        for wrong in ["0", "5..5", "9..3", "-1", "many", "1..", "1e3"] {
            assert!(trials(Some(wrong)).unwrap_err().to_string().contains(wrong));
        }
    }
}
