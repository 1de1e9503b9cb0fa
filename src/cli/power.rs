//! `kincal challenge power`: whether stated minimum detectable magnitudes are true.

use std::time::Instant;

use anyhow::{Context, ensure};
use serde_json::json;

use super::Outcome;
use super::arguments::{Global, PowerOptions};
use super::bar::Bar;
use super::output;
use crate::arm::Arm;
use crate::effects::Kind;
use crate::lab::challenge::{case, power};
use crate::lab::injection;
use crate::lab::report;
use crate::recording::truth_file::write_whole;

/// What is checked if nobody says what.
const USUAL: [Kind; 5] = [Kind::Backlash, Kind::JointCompliance, Kind::JointEccentricity, Kind::TiltClearance, Kind::BaseStep];
/// Seed if nobody gives one.
const SEED: u64 = 1;

pub(super) fn command(global: &Global, options: &PowerOptions) -> anyhow::Result<Outcome> {
    ensure!((1..=100_000).contains(&options.trials), "--trials {}: 1 to 100000", options.trials);
    ensure!((0.1..=10_000.0).contains(&options.noise), "--noise {}: one sigma per axis in µm, 0.1 to 10000", options.noise);
    ensure!((1..=10_000).contains(&options.sets), "--sets {}: 1 to 10000", options.sets);
    ensure!((12..=10_000).contains(&options.poses), "--poses {}: 12 to 10000", options.poses);
    let levels = &options.levels;
    ensure!(
        levels.len() >= 2 && levels.iter().all(|level| (0.01..=100.0).contains(level)),
        "--levels: two magnitudes or more, each 0.01 to 100 times the stated one"
    );
    let base = super::challenge::base(global, options.scene.as_deref(), &options.set)?;
    let mut sorted = levels.clone();
    sorted.sort_by(f64::total_cmp);
    let check = power::Options {
        what: what(&options.kinds, &base.scene.arm)?,
        trials: options.trials,
        sets: options.sets,
        levels: sorted,
        plan: case::Options::quiet(options.noise * 1e-6, options.poses, options.poses / 6),
        seed: global.seed.unwrap_or(SEED),
    };
    let path = |extension: &str| global.out.join(format!("power.{extension}"));
    for extension in ["json", "svg", "png"] {
        output::check_target(&path(extension))?;
    }
    let bar = Bar::new(global, None);
    let start = Instant::now();
    let found = power::check(&base, &check, &bar.steps())?;
    bar.end();
    output::note(global, &format!("{:.1} s", start.elapsed().as_secs_f64()));
    let figure = report::power::figure(&found);
    output::write(&path("json"), &format!("{}\n", serde_json::to_string_pretty(&found)?))?;
    output::write(&path("svg"), &figure.svg()?)?;
    write_whole(&path("png"), &figure.png()?).with_context(|| format!("cannot write {}", path("png").display()))?;
    output::show(global, &report::power::power(&found))?;
    output::show(global, &format!("Written to {}: power.json, power.svg, power.png", global.out.display()))?;
    let files = ["json", "svg", "png"].map(path);
    output::show_json(global, &json!({ "power": found, "files": files }))?;
    Ok(Outcome::Good)
}

/// `backlash` or `backlash:3`.
fn what(given: &[String], arm: &Arm) -> anyhow::Result<Vec<(Kind, Option<usize>)>> {
    if given.is_empty() {
        return Ok(USUAL.map(|kind| (kind, None)).to_vec());
    }
    given
        .iter()
        .map(|text| {
            let (name, index) = text.split_once(':').map_or((text.as_str(), None), |(name, index)| (name, Some(index)));
            let kind = Kind::known_from_name(name).filter(|kind| *kind != Kind::MeasurementOutliers).with_context(|| {
                let names = Kind::known().filter(|kind| *kind != Kind::MeasurementOutliers).map(Kind::name);
                format!(
                    "--kinds {text}: no such kind with a magnitude that is stated; there are {}",
                    names.collect::<Vec<_>>().join(", ")
                )
            })?;
            let places = injection::places(kind, arm);
            let place = index
                .map(|index| {
                    let number = index.parse::<usize>().ok().and_then(|number| number.checked_sub(1));
                    number.filter(|number| places.contains(&Some(*number))).with_context(|| {
                        let known: Vec<String> = places.iter().flatten().map(|place| (place + 1).to_string()).collect();
                        match known.is_empty() {
                            true => format!("--kinds {text}: {name} has no number"),
                            false => format!("--kinds {text}: {name} can be at {}", known.join(", ")),
                        }
                    })
                })
                .transpose()?;
            Ok((kind, place))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::reproduce::arms::arm8;

    #[test]
    fn kinds_come_with_or_without_a_place() {
        let arm = arm8().unwrap().scene.arm;
        let of = |text: &str| what(&[text.to_owned()], &arm);
        assert_eq!(of("backlash").unwrap(), [(Kind::Backlash, None)]);
        assert_eq!(of("backlash:3").unwrap(), [(Kind::Backlash, Some(2))]);
        assert_eq!(what(&[], &arm).unwrap().len(), 5);
        for wrong in ["rust", "backlash:0", "backlash:9", "base_step:1", "measurement_outliers", "backlash:x"] {
            assert!(of(wrong).is_err(), "{wrong}");
        }
    }
}
