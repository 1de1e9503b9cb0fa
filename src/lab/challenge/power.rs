//! Whether the minimum detectable magnitudes that a diagnosis states are true: cells with effects about that size, through the whole
//! simulation and the whole analyser, and how often the effect is named.

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde::Serialize;

use super::case::{self, PARAMETER_ERRORS, Public};
use super::folder::ChallengeError;
use crate::diagnosis::outcome::{Diagnosis, NoiseSource, Place};
use crate::diagnosis::{Options as DiagnosisOptions, diagnose};
use crate::effects::Kind;
use crate::progress::{Silent, Steps};
use crate::report::wording;
use crate::scene::SceneFile;
use crate::seed::hidden_stream;
use crate::session::SessionError;
use crate::simulation::cell::measure;
use crate::simulation::effect::Effect;
use crate::simulation::injected::{Injected, Noise};
use crate::statistics::nearest_rank;

/// Share of cases at which a magnitude counts as detectable.
const POWER: f64 = 0.8;
/// From this probability on an effect counts as named.
const NAMED: f64 = 0.5;
/// What is checked.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Options {
    /// Kind, and its joint or link (from 0) where it is given.
    pub what: Vec<(Kind, Option<usize>)>,
    /// Cells at every magnitude.
    pub trials: usize,
    /// Sets without an effect from which the stated magnitude comes: each has its own noise, and its own estimate of it.
    pub sets: usize,
    /// Magnitudes, over the stated one.
    pub levels: Vec<f64>,
    /// The plan: readings, of them repeats, and the declared noise.
    pub plan: case::Options,
    /// Of everything.
    pub seed: u64,
}

/// What was found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// One for each kind.
    pub curves: Vec<Curve>,
    /// Data sets without an effect.
    pub sets: usize,
    /// Of them, those in which an effect is named.
    pub false_alarms: usize,
    /// Readings of a set.
    pub readings: usize,
    /// One sigma per axis, m.
    pub noise_m: f64,
}

/// How often an effect is named, by its magnitude.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Curve {
    /// Kind.
    pub kind: Kind,
    /// Where.
    pub location: Place,
    /// Of the magnitudes.
    pub unit: String,
    /// The minimum detectable magnitude that the analyser states: median over sets without an effect.
    pub stated: Option<f64>,
    /// Where 80 % of these stated magnitudes lie.
    pub stated_range: Option<[f64; 2]>,
    /// Magnitudes tried.
    pub levels: Vec<Level>,
    /// The magnitude that is named in 80 % of cases, by a logistic curve through the levels.
    pub measured: Option<f64>,
    /// Its 95 % interval.
    pub interval95: Option<[f64; 2]>,
    /// Intercept and slope of the curve against magnitude over the stated one.
    pub logistic: Option<[f64; 2]>,
}

impl Curve {
    /// Measured over stated.
    #[must_use]
    pub fn ratio(&self) -> Option<f64> {
        Some(self.measured? / self.stated?)
    }
}

/// A magnitude and how often it is named.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Level {
    /// SI.
    pub magnitude: f64,
    /// Cells.
    pub trials: usize,
    /// Right kind at the right place.
    pub named: usize,
    /// Another kind or place named: which, and how often.
    pub wrong: BTreeMap<String, usize>,
    /// Called unknown.
    pub unknown: usize,
}

/// A curve `1 / (1 + exp(−a − b x))` and where it reaches a share.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Logistic {
    curve: [f64; 2],
    at: f64,
    interval95: [f64; 2],
}

/// Checks what `base` would show.
///
/// # Errors
/// If a cell cannot be simulated or diagnosed.
pub fn check(base: &SceneFile, options: &Options, progress: &Steps) -> Result<Report, ChallengeError> {
    let key = case::key(options.seed);
    let public = case::public(base, &options.plan, &key, 0)?;
    progress.begin("no effect", options.sets)?;
    let quiet: Vec<Diagnosis> = (0..options.sets)
        .into_par_iter()
        .map(|set| {
            let found = cell(&public, Vec::new(), &injected_key(&key, &format!("power/quiet/{set}")))?;
            progress.done()?;
            Ok(found)
        })
        .collect::<Result<_, ChallengeError>>()?;
    let mut curves: Vec<Curve> = options.what.iter().filter_map(|(kind, place)| stated(*kind, *place, &quiet)).collect();
    let jobs: Vec<(usize, usize, usize)> = (0..curves.len())
        .filter(|curve| curves[*curve].stated.is_some())
        .flat_map(|curve| {
            (0..options.levels.len()).flat_map(move |level| (0..options.trials).map(move |trial| (curve, level, trial)))
        })
        .collect();
    progress.begin("with effects", jobs.len())?;
    let seen: Vec<Judged> = jobs
        .par_iter()
        .map(|(curve, level, trial)| {
            let curve = &curves[*curve];
            let size = curve.stated.unwrap_or(0.0) * options.levels[*level];
            let place = curve.location.index.map(|index| index - 1);
            let label = format!("power/{}/{place:?}/{level}/{trial}", curve.kind.name());
            let arm = &public.file.scene.arm;
            let effect = Effect::drawn(curve.kind, place, size, arm, &mut hidden_stream(&key, &label));
            let found = cell(&public, vec![effect], &injected_key(&key, &label))?;
            progress.done()?;
            Ok(judged(&found, curve))
        })
        .collect::<Result<_, ChallengeError>>()?;
    for ((curve, level, _), judged) in jobs.iter().zip(seen) {
        let curve = &mut curves[*curve];
        let magnitude = curve.stated.unwrap_or(0.0) * options.levels[*level];
        if curve.levels.len() <= *level {
            curve.levels.push(Level { magnitude, trials: 0, named: 0, wrong: BTreeMap::new(), unknown: 0 });
        }
        let level = &mut curve.levels[*level];
        level.trials += 1;
        level.named += usize::from(judged.named);
        level.unknown += usize::from(judged.unknown);
        for name in judged.wrong {
            *level.wrong.entry(name).or_default() += 1;
        }
    }
    for curve in &mut curves {
        let Some(stated) = curve.stated else { continue };
        let points: Vec<(f64, usize, usize)> =
            curve.levels.iter().map(|level| (level.magnitude / stated, level.named, level.trials)).collect();
        if let Some(fit) = logistic(&points, POWER) {
            curve.logistic = Some(fit.curve);
            curve.measured = Some(fit.at * stated);
            curve.interval95 = Some(fit.interval95.map(|end| end * stated));
        }
    }
    Ok(Report {
        curves,
        sets: options.sets,
        false_alarms: quiet.iter().filter(|found| !found.effects.is_empty()).count(),
        readings: public.planned.len(),
        noise_m: public.file.scene.sensor.position_sigma_m,
    })
}

fn injected_key(key: &[u8; 32], label: &str) -> String {
    let mut stream = hidden_stream(key, &format!("{label}/cell"));
    (0..4).map(|_| format!("{:013x}", (stream.unit() * (1u64 << 52) as f64) as u64)).collect()
}

/// A cell with `effects`, its parameters and its noise drawn anew, measured and diagnosed.
fn cell(public: &Public, effects: Vec<Effect>, key: &str) -> Result<Diagnosis, ChallengeError> {
    let injected = Injected {
        seed: key.to_owned(),
        length_error_m: PARAMETER_ERRORS[0],
        angle_error_rad: PARAMETER_ERRORS[1],
        parameter_errors: Vec::new(),
        effects,
        noise: Noise::Declared { factor: 1.0 },
    };
    let (scene, planned) = (&public.file.scene, &public.planned);
    let (measurements, _) = measure(&scene.cell(), &injected, planned, planned.len(), &mut Silent).map_err(SessionError::from)?;
    let rows: Vec<_> = measurements.iter().collect();
    let options = DiagnosisOptions::new(NoiseSource::Declared);
    let conclusion = diagnose(&scene.arm, &scene.sensor, &rows, &options);
    conclusion.map(wording::diagnosis).map_err(|error| ChallengeError::Diagnosis { reason: error.to_string() })
}

/// What sets without an effect state about a kind: at its place, or at that in the middle of those where it would show.
fn stated(kind: Kind, place: Option<usize>, quiet: &[Diagnosis]) -> Option<Curve> {
    let value = |diagnosis: &Diagnosis, location: &Place| {
        let same = |entry: &&crate::diagnosis::outcome::Undetectable| {
            entry.kind == kind && (entry.location.level, entry.location.index) == (location.level, location.index)
        };
        let entry = diagnosis.detectable.iter().chain(&diagnosis.undetectable).find(same);
        entry.and_then(|entry| entry.minimum_detectable.value)
    };
    let first = quiet.first()?;
    let location = match place {
        Some(place) => Place::of(kind.level(), Some(place + 1)),
        None => {
            let of_kind = |list: &[crate::diagnosis::outcome::Undetectable]| {
                list.iter().filter(|entry| entry.kind == kind).cloned().collect::<Vec<_>>()
            };
            let mut shown = of_kind(&first.detectable);
            if shown.is_empty() {
                shown = of_kind(&first.undetectable);
            }
            let size = |entry: &crate::diagnosis::outcome::Undetectable| entry.minimum_detectable.value.unwrap_or(f64::INFINITY);
            shown.sort_by(|a, b| size(a).total_cmp(&size(b)));
            shown.get(shown.len().saturating_sub(1) / 2)?.location
        }
    };
    let values: Vec<f64> = quiet.iter().filter_map(|diagnosis| value(diagnosis, &location)).collect();
    let at = |share: f64| nearest_rank(values.iter().copied(), share).filter(|_| 2 * values.len() > quiet.len());
    Some(Curve {
        kind,
        location,
        unit: kind.unit().to_owned(),
        stated: at(0.5),
        stated_range: at(0.1).zip(at(0.9)).map(|(low, high)| [low, high]),
        levels: Vec::new(),
        measured: None,
        interval95: None,
        logistic: None,
    })
}

/// Whether the effect is named, what else is, and whether something is called unknown.
struct Judged {
    named: bool,
    wrong: Vec<String>,
    unknown: bool,
}

fn judged(found: &Diagnosis, curve: &Curve) -> Judged {
    let is = |effect: &crate::diagnosis::outcome::Effect| {
        effect.kind == curve.kind
            && (effect.location.level, effect.location.index) == (curve.location.level, curve.location.index)
    };
    let named = || found.effects.iter().filter(|effect| effect.probability >= NAMED);
    let name = |effect: &crate::diagnosis::outcome::Effect| match effect.location.index {
        Some(index) => format!("{} {index}", effect.kind),
        None => effect.kind.to_string(),
    };
    Judged {
        named: named().any(is),
        wrong: named().filter(|effect| !is(effect)).map(name).collect(),
        unknown: found.unknown.present,
    }
}

/// The logistic curve of largest likelihood through (x, hits, trials), and where it reaches `share`, with the interval of the delta
/// method. `None` where the points do not say where that is.
fn logistic(points: &[(f64, usize, usize)], share: f64) -> Option<Logistic> {
    let (hits, trials) = points.iter().fold((0, 0), |(hits, trials), point| (hits + point.1, trials + point.2));
    if points.len() < 2 || hits == 0 || hits == trials {
        return None;
    }
    let middle = points.iter().map(|point| point.0).sum::<f64>() / points.len() as f64;
    let (mut a, mut b) = (0.0, 0.0);
    let mut covariance = [[0.0; 2]; 2];
    for _ in 0..100 {
        let (mut slope, mut curvature) = ([0.0; 2], [[0.0; 2]; 2]);
        for (x, hits, trials) in points {
            let row = [1.0, x - middle];
            let p = 1.0 / (1.0 + libm::exp(-(a + b * row[1])));
            let weight = (*trials as f64 * p * (1.0 - p)).max(1e-9);
            for i in 0..2 {
                slope[i] += row[i] * (*hits as f64 - *trials as f64 * p);
                for j in 0..2 {
                    curvature[i][j] += weight * row[i] * row[j];
                }
            }
        }
        let determinant = curvature[0][0] * curvature[1][1] - curvature[0][1] * curvature[1][0];
        if !(determinant.is_finite() && determinant > 1e-12) {
            return None;
        }
        covariance = [
            [curvature[1][1] / determinant, -curvature[0][1] / determinant],
            [-curvature[1][0] / determinant, curvature[0][0] / determinant],
        ];
        let step = [0, 1].map(|i| covariance[i][0] * slope[0] + covariance[i][1] * slope[1]);
        // Newton's step may be too long far from the answer.
        let shorter = 1.0 / f64::max(1.0, step[0].abs().max(step[1].abs() / 10.0));
        (a, b) = (a + shorter * step[0], b + shorter * step[1]);
        if step[0].abs() + step[1].abs() < 1e-9 {
            break;
        }
    }
    // A slope that is not clearly upwards places nothing.
    if b <= 2.0 * libm::sqrt(covariance[1][1]) {
        return None;
    }
    let from_middle = (libm::log(share / (1.0 - share)) - a) / b;
    let slope = [-1.0 / b, -from_middle / b];
    let variance: f64 = (0..4).map(|n| slope[n / 2] * covariance[n / 2][n % 2] * slope[n % 2]).sum();
    let half = 1.96 * libm::sqrt(variance);
    let at = middle + from_middle;
    Some(Logistic { curve: [a - b * middle, b], at, interval95: [at - half, at + half] })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::stream;

    #[test]
    fn the_logistic_finds_the_curve_that_made_the_points() {
        let mut draws = stream(1, "test/logistic");
        let (a, b) = (-6.0, 7.0);
        let truth = (libm::log(4.0) - a) / b;
        let mut covered = 0;
        for _ in 0..200 {
            let points: Vec<(f64, usize, usize)> = [0.6, 0.8, 1.0, 1.2, 1.4]
                .into_iter()
                .map(|x: f64| {
                    let p = 1.0 / (1.0 + (-(a + b * x)).exp());
                    (x, (0..200).filter(|_| draws.unit() < p).count(), 200)
                })
                .collect();
            let fit = logistic(&points, 0.8).unwrap();
            assert!((fit.at - truth).abs() < 0.1, "{fit:?} against {truth}");
            covered += usize::from(fit.interval95[0] < truth && truth < fit.interval95[1]);
        }
        assert!((182..=198).contains(&covered), "{covered}");
        assert_eq!(logistic(&[(0.5, 0, 10), (1.0, 0, 10)], 0.8), None);
        assert_eq!(logistic(&[(0.5, 5, 10), (1.0, 5, 10)], 0.8), None);
    }
}
