//! `kincal challenge`: blind cases, and the score of whoever diagnoses them.

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, bail, ensure};
use rayon::prelude::*;
use serde_json::json;

use super::Outcome;
use super::arguments::{Baseline, ChallengeCommand, Global, NewOptions, SceneOptions, ScoreOptions};
use super::bar::Bar;
use super::output;
use crate::effects::{Kind, Location, Need};
use crate::lab::challenge::folder::{self, COMMITMENT, MANIFEST, SEAL};
use crate::lab::challenge::score::{self, closes, restorable};
use crate::lab::challenge::verdict::{Diagnose, Gap, Verdict, nothing};
use crate::lab::challenge::{CaseTruth, Folder, Options, TrueEffect, case};
use crate::lab::report;
use crate::lab::reproduce::arms::arm8;
use crate::recording::truth_file::write_whole;
use crate::report::wording;
use crate::scene::SceneFile;
use crate::simulation::cell;

/// What every command writes to if nobody says where.
const USUAL_OUT: &str = "recordings";
/// A seed below this can be found by trying.
const GUESSABLE: u64 = 1 << 40;

/// The diagnosis that finds nothing.
const BASELINE: (&str, Diagnose) = ("the baseline that never finds anything", nothing);

/// Kincal's own diagnosis with its name.
fn diagnosis() -> Option<(&'static str, Diagnose)> {
    Some(("kincal diagnose", diagnosed))
}

/// What `kincal diagnose` says of a case.
fn diagnosed(case: &folder::Case) -> Result<serde_json::Value, String> {
    diagnosed_among(case, None)
}

/// What `kincal diagnose` says of a case, of nothing but some kinds at some places.
fn diagnosed_among(case: &folder::Case, only: Option<Vec<(Kind, Location)>>) -> Result<serde_json::Value, String> {
    let scene = crate::scene::parse(&case.start.scene, &case.name).map_err(|error| error.to_string())?.scene;
    let rows: Vec<_> = case.measurements.iter().collect();
    let without = case.withheld.iter().filter_map(|name| Kind::from_name(name)).collect();
    let usual = crate::diagnosis::Options::new(crate::diagnosis::outcome::NoiseSource::Declared);
    let options = crate::diagnosis::Options { without, only, settings: scene.diagnosis.clone(), ..usual };
    let found = crate::diagnosis::diagnose(&scene.arm, &scene.sensor, &rows, &options).map_err(|error| error.to_string())?;
    serde_json::to_value(wording::diagnosis(found)).map_err(|error| error.to_string())
}

pub(crate) fn command(global: &Global, command: &ChallengeCommand) -> anyhow::Result<Outcome> {
    match command {
        ChallengeCommand::New(options) => new(global, options),
        ChallengeCommand::Score(options) => scored(global, options),
        ChallengeCommand::Power(options) => super::power::command(global, options),
    }
}

/// The scene that cases are made of: as given, or `arm8`.
pub(super) fn base(global: &Global, scene: Option<&Path>, set: &[String]) -> anyhow::Result<SceneFile> {
    match scene {
        Some(scene) => {
            output::scene(&Global { seed: None, ..global.clone() }, &SceneOptions { scene: scene.to_owned(), set: set.to_vec() })
        }
        None => {
            let mut file = arm8()?;
            for assignment in set {
                output::assign(&mut file, assignment)?;
            }
            Ok(file)
        }
    }
}

fn new(global: &Global, options: &NewOptions) -> anyhow::Result<Outcome> {
    let seed = global.seed.context(
        "a challenge needs a seed that nobody guesses: --seed N, such as that of `od -An -N8 -tu8 /dev/urandom`; the same seed makes \
         the same challenge again",
    )?;
    let cases = Options {
        cases: options.cases,
        kinds: kinds(&options.kinds, &options.withheld)?,
        effects: effects(&options.effects)?,
        base_rate: options.base_rate.map(|rate| share(rate, "base-rate")).transpose()?,
        noise_m: noise(&options.noise)?,
        heavy_tails: share(options.heavy_tails, "heavy-tails")?,
        understated: share(options.understated, "understated")?,
        poses: options.poses,
        repeats: options.repeats.unwrap_or(options.poses / 6),
        withheld: withheld(&options.withheld)?,
        outside: options.outside,
        soft: options.soft,
        direct: options.direct,
    };
    let of_moves = |name: &&String| Kind::from_name(name).is_some_and(|kind| kind.descriptor().needs.contains(&Need::Moves));
    let unseen: Vec<&str> = options.kinds.iter().filter(of_moves).map(String::as_str).collect();
    ensure!(
        options.direct || unseen.is_empty(),
        "--kinds {}: nothing tells these from play where the arm comes over a point beside each configuration; add --direct",
        unseen.join(",")
    );
    ensure!((1..=9999).contains(&cases.cases), "--cases {}: 1 to 9999", cases.cases);
    ensure!(cases.outside <= MOST_OUTSIDE, "--outside {}: {MOST_OUTSIDE} at most", cases.outside);
    ensure!(
        cases.heavy_tails + cases.understated <= 1.0,
        "--heavy-tails and --understated are shares of all cases: together 1 at most"
    );
    ensure!(
        cases.poses <= 10_000 && 2 * cases.repeats <= cases.poses,
        "--poses {} --repeats {}: 10000 readings at most, of which half at most repeat another",
        cases.poses,
        cases.repeats
    );
    let base = base(global, options.scene.as_deref(), &options.set)?;
    let path = if global.out == Path::new(USUAL_OUT) { global.out.join("challenge") } else { global.out.clone() };
    // What is wrong with the scene is said before anything is written.
    let key = case::key(seed);
    let public = case::public(&base, &cases, &key, 0)?;
    cell::measure::check(&public.file.scene.cell(), &case::hidden(&public, &cases, &key, 0).injected)?;
    if seed < GUESSABLE {
        output::note(
            global,
            "note: whoever tries all small seeds finds this one, and with it the truth; take one of 19 digits where it matters",
        );
    }
    if cases.repeats == 0 {
        output::note(global, "note: no configuration is read twice: the noise cannot be estimated from repeats");
    }
    let bar = Bar::new(global, None);
    let start = Instant::now();
    let manifest = folder::create(&path, &base, &cases, seed, &bar.steps())?;
    bar.end();
    output::note(global, &format!("{:.1} s", start.elapsed().as_secs_f64()));
    output::show(
        global,
        &format!(
            "{} cases in {}: {} … {}\nManifest    {}\nTruth       {} (sealed: do not open it before the diagnosis is made)\n\
             Commitment  {} (SHA-256 of the truth; also in {COMMITMENT})",
            manifest.cases.len(),
            path.display(),
            manifest.cases[0].file,
            manifest.cases[manifest.cases.len() - 1].file,
            path.join(MANIFEST).display(),
            path.join(SEAL).display(),
            manifest.commitment
        ),
    )?;
    output::show_json(
        global,
        &json!({ "folder": path, "cases": manifest.cases.len(), "commitment": manifest.commitment, "seal": path.join(SEAL) }),
    )?;
    Ok(Outcome::Good)
}

/// Names of effects to draw from: `known`, `foreign`, `all`, or kinds. Withheld ones are drawn as well.
fn kinds(given: &[String], withheld: &[String]) -> anyhow::Result<Vec<String>> {
    let mut kinds: Vec<Kind> = Vec::new();
    for name in given {
        match name.as_str() {
            "known" => kinds.extend(Kind::known()),
            "foreign" => kinds.extend(Kind::foreign()),
            "all" => kinds.extend(Kind::ALL),
            name => kinds.push(Kind::from_name(name).with_context(|| {
                let all: Vec<&str> = Kind::ALL.into_iter().map(Kind::name).collect();
                format!("--kinds {name}: no such kind; there are known, foreign, all, {}", all.join(", "))
            })?),
        }
    }
    if given.is_empty() {
        kinds.extend(Kind::known());
    }
    kinds.extend(withheld.iter().filter_map(|name| Kind::from_name(name)));
    kinds.sort_unstable();
    kinds.dedup();
    Ok(kinds.into_iter().map(|kind| kind.name().to_owned()).collect())
}

fn withheld(given: &[String]) -> anyhow::Result<Vec<String>> {
    for name in given {
        ensure!(
            Kind::known_from_name(name).is_some(),
            "--withheld {name}: no such kind; there are {}",
            Kind::known().map(Kind::name).collect::<Vec<_>>().join(", ")
        );
    }
    Ok(given.to_vec())
}

/// Effects of a case at most.
const MOST_EFFECTS: usize = 24;
/// Of those outside the library.
const MOST_OUTSIDE: usize = 4;

/// `2` or `0..3`, both ends included.
fn effects(text: &str) -> anyhow::Result<[usize; 2]> {
    let number = |text: &str| text.trim().trim_start_matches('=').parse::<usize>().ok().filter(|number| *number <= MOST_EFFECTS);
    let range = match text.split_once("..") {
        Some((from, to)) => number(from).zip(number(to)),
        None => number(text).map(|number| (number, number)),
    };
    match range {
        Some((from, to)) if from <= to => Ok([from, to]),
        _ => bail!(
            "--effects {text}: a number of effects such as 1, or fewest and most such as 0..3 (both included, {MOST_EFFECTS} at most)"
        ),
    }
}

fn noise(given: &[f64]) -> anyhow::Result<Vec<f64>> {
    for noise in given {
        ensure!((0.1..=10_000.0).contains(noise), "--noise {noise}: one sigma per axis in µm, 0.1 to 10000");
    }
    Ok(given.iter().map(|noise| noise * 1e-6).collect())
}

fn share(value: f64, name: &str) -> anyhow::Result<f64> {
    ensure!((0.0..=1.0).contains(&value), "--{name} {value}: a share of the cases, 0 to 1");
    Ok(value)
}

fn scored(global: &Global, options: &ScoreOptions) -> anyhow::Result<Outcome> {
    let folder = Folder::open(&options.folder)?;
    let count = folder.manifest.cases.len();
    let mut seconds = Vec::new();
    let (who, verdicts): (String, Vec<Verdict>) = match &options.verdicts {
        Some(verdicts) => {
            let read = |case: &folder::ManifestCase| {
                let path = verdicts.join(case.file.replace(".mcap", ".json"));
                let text = std::fs::read(&path).with_context(|| {
                    format!(
                        "cannot read {}; --verdicts takes a folder with the verdict of every case as case-0001.json …",
                        path.display()
                    )
                })?;
                serde_json::from_slice(&text).with_context(|| format!("{} is no verdict", path.display()))
            };
            let all = folder.manifest.cases.iter().map(read).collect::<anyhow::Result<_>>()?;
            (verdicts.display().to_string(), all)
        }
        None => {
            let (who, diagnose) = match (options.baseline, diagnosis()) {
                (Some(Baseline::None), _) => BASELINE,
                (None, Some(diagnosis)) => diagnosis,
                (None, None) => {
                    output::note(global, "note: kincal has no diagnosis yet: a trivial baseline is scored");
                    BASELINE
                }
            };
            let all = diagnoses(global, &folder, diagnose, "diagnosing", "verdicts")?;
            seconds = all.iter().map(|(_, seconds)| *seconds).collect();
            (who.to_owned(), all.into_iter().map(|(verdict, _)| verdict).collect())
        }
    };
    // What was withheld is put back; of another tool nobody can ask that.
    let whole = folder.whole();
    let own = options.verdicts.is_none() && options.baseline.is_none();
    let restored: Option<Vec<Verdict>> = match diagnosis().filter(|_| own && !folder.manifest.withheld.is_empty()) {
        Some((_, diagnose)) => {
            let all = diagnoses(global, &whole, diagnose, "restoring", "restored")?;
            Some(all.into_iter().map(|(verdict, _)| verdict).collect())
        }
        None => None,
    };
    let sealed = folder.unseal()?;
    let withheld = &folder.manifest.withheld;
    let mut score = score::score(&sealed.cases, &verdicts, withheld);
    let told = told(global, &whole, &sealed.cases, &|index| {
        let truth = &sealed.cases[index];
        closes(truth, withheld) && verdicts[index].gap.is_some() || restored.is_some() && restorable(truth, withheld)
    })?;
    let pairs: Vec<(Gap, Gap)> = (0..count)
        .filter(|index| closes(&sealed.cases[*index], withheld))
        .filter_map(|index| verdicts[index].gap.zip(told[index]))
        .collect();
    score.closure = (!pairs.is_empty()).then(|| score::closure(&pairs));
    score.restored = restored.map(|restored| score::restored(&sealed.cases, [&verdicts, &restored], &told, withheld));
    let text = report::challenge::score(&score, &who, &seconds);
    let figure = report::challenge::figure(&score);
    let mut written = Vec::new();
    let mut put = |name: &str, bytes: &[u8]| -> anyhow::Result<()> {
        let path = folder.path.join(name);
        write_whole(&path, bytes).with_context(|| format!("cannot write {}", path.display()))?;
        written.push(path);
        Ok(())
    };
    // Opened: from here on it can be looked at case by case.
    put("truth.json", format!("{}\n", serde_json::to_string_pretty(&sealed.cases)?).as_bytes())?;
    put("score.json", format!("{}\n", serde_json::to_string_pretty(&score)?).as_bytes())?;
    put("score-confusion.csv", &report::challenge::confusion(&score.confusion)?)?;
    put("score.svg", figure.svg()?.as_bytes())?;
    put("score.png", &figure.png()?)?;
    output::show(global, &format!("Commitment  {} (the truth is what was committed to)\n\n{text}", folder.manifest.commitment))?;
    let names: Vec<_> = written.iter().filter_map(|path| path.file_name()).map(|name| name.to_string_lossy()).collect();
    output::show(global, &format!("Written to {}: {}", folder.path.display(), names.join(", ")))?;
    output::show_json(
        global,
        &json!({ "commitment": folder.manifest.commitment, "diagnosed_by": who, "score": score, "seconds": seconds, "files": written }),
    )?;
    Ok(Outcome::Good)
}

/// Diagnoses every case, side by side, and writes what is said of each into `name` within the folder: before the seal is opened. With
/// every verdict the seconds it took.
fn diagnoses(
    global: &Global,
    folder: &Folder,
    diagnose: Diagnose,
    doing: &'static str,
    name: &str,
) -> anyhow::Result<Vec<(Verdict, f64)>> {
    let count = folder.manifest.cases.len();
    let bar = Bar::new(global, None);
    let steps = bar.steps();
    steps.begin(doing, count)?;
    let said: Vec<(serde_json::Value, f64)> = (0..count)
        .into_par_iter()
        .map(|index| {
            let case = folder.case(index)?;
            let start = Instant::now();
            let verdict = diagnose(&case).map_err(|why| anyhow::anyhow!("{}: {why}", case.path.display()))?;
            steps.done()?;
            Ok((verdict, start.elapsed().as_secs_f64()))
        })
        .collect::<anyhow::Result<_>>()?;
    bar.end();
    for (case, (verdict, _)) in folder.manifest.cases.iter().zip(&said) {
        let path = folder.path.join(name).join(case.file.replace(".mcap", ".json"));
        output::write(&path, &format!("{}\n", serde_json::to_string_pretty(verdict)?))?;
    }
    let read = |(verdict, seconds)| Ok((serde_json::from_value(verdict).context("the diagnosis is no verdict")?, seconds));
    said.into_iter().map(read).collect()
}

/// Of each case that is `asked`, the gap of kincal's diagnosis that looks for nothing but what is there.
fn told(
    global: &Global,
    folder: &Folder,
    truths: &[CaseTruth],
    asked: &(dyn Fn(usize) -> bool + Sync),
) -> anyhow::Result<Vec<Option<Gap>>> {
    let count = (0..truths.len()).filter(|index| asked(*index)).count();
    if count == 0 {
        return Ok(vec![None; truths.len()]);
    }
    let bar = Bar::new(global, None);
    let steps = bar.steps();
    steps.begin("knowing", count)?;
    let gaps = (0..truths.len())
        .into_par_iter()
        .map(|index| {
            if !asked(index) {
                return Ok(None);
            }
            let case = folder.case(index)?;
            let is = |effect: &TrueEffect| Some((Kind::known_from_name(&effect.kind)?, effect.location));
            let only = truths[index].effects.iter().filter_map(is).collect();
            let found = diagnosed_among(&case, Some(only)).map_err(|why| anyhow::anyhow!("{}: {why}", case.path.display()))?;
            let found: Verdict = serde_json::from_value(found).context("the diagnosis is no verdict")?;
            steps.done()?;
            Ok(found.gap)
        })
        .collect::<anyhow::Result<_>>()?;
    bar.end();
    Ok(gaps)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_effects_include_both_ends() {
        assert_eq!(effects("1").unwrap(), [1, 1]);
        assert_eq!(effects("0..3").unwrap(), [0, 3]);
        assert_eq!(effects("0..=3").unwrap(), [0, 3]);
        for wrong in ["", "3..1", "-1", "25", "a..b"] {
            assert!(effects(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn withheld_kinds_are_drawn_too() {
        let names = |given: &[&str]| given.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        assert_eq!(kinds(&names(&["backlash"]), &names(&["tool_step"])).unwrap(), ["backlash", "tool_step"]);
        assert_eq!(kinds(&[], &[]).unwrap().len(), Kind::known().count());
        assert_eq!(kinds(&names(&["all"]), &[]).unwrap().len(), Kind::ALL.len());
        assert!(kinds(&names(&["rust"]), &[]).is_err() && withheld(&names(&["worn_tooth_sector"])).is_err());
    }
}
