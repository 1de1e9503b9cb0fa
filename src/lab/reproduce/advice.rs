//! Whether the advice of a design comes true: the gain that it predicts before anything is measured, and the gain that calibrations
//! then have.
//!
//! The prediction has no knob that could have been fitted. The situations are others than those of the bake-off all the same: other
//! numbers of configurations, other joint ranges, another cone; and the experiment runs on whatever arm it is given.

use super::Experiment;
use super::arms::cut;
use super::bench::Bench;
use super::findings::{Claim, Data, Found, Tally, with_ends};
use super::situation::{Reach, Sees, Situation};
use crate::design::candidates::{Rules, Sampler};
use crate::design::design;
use crate::design::problem::{Criterion, Method};
use crate::figure::{Axis, Colour, Estimate, Figure, Kind, Panel, Series};
use crate::lab::trial::Trial;
use crate::progress::Silent;
use crate::quality::information::InformationModel;
use crate::scene::Scene;
use crate::seed::stream;
use crate::session::SessionError;
use crate::statistics::{Mean, rank_correlation};

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "advice",
    place: "beyond the paper",
    about: "the gain that kincal design predicts against the gain that calibrations then have",
    trials: 100,
    work: run,
};

/// Numbers of configurations.
const COUNTS: [usize; 3] = [10, 16, 30];
/// Half joint ranges, rad.
const HALF_RANGES: [f64; 2] = [std::f64::consts::FRAC_PI_4, std::f64::consts::FRAC_PI_2];
/// Random sets whose mean the prediction is compared with.
const RANDOM_SETS: usize = 100;
/// Half angle of the cone, rad.
const CONE_RAD: f64 = 20.0 * std::f64::consts::PI / 180.0;

/// A situation and what came out.
struct Outcome {
    label: String,
    effects: bool,
    predicted: f64,
    possible: f64,
    measured: Option<Mean>,
    random_mm: Option<Mean>,
    predicted_random_mm: f64,
    fits: Tally,
}

fn run(bench: &Bench<'_>, trials: usize) -> Result<Found, SessionError> {
    let cells = cells(bench.scene);
    bench.progress.begin("advice", cells.len() * (trials + 1))?;
    let (mut outcomes, mut skipped) = (Vec::new(), Vec::new());
    for (label, scene, situation) in cells {
        let information = InformationModel::new(&scene.arm, &scene.sensor, scene.weights);
        if scene.design.count * information.rows_per_pose() < information.rank() {
            skipped.push(format!("{label}: left out, so few configurations do not determine the parameters."));
            (0..=trials).try_for_each(|_| bench.progress.done())?;
            continue;
        }
        let chosen = design(&scene.request(), &mut Silent);
        bench.progress.done()?;
        let outcome = chosen?;
        let told = outcome.advice.and_then(|advice| Some((advice, advice.chosen?, advice.random?)));
        // Too few configurations for this arm, most likely.
        let Some((advice, set, random)) = told else {
            let why = outcome.no_advice.unwrap_or_else(|| "so few configurations do not determine the parameters".to_owned());
            skipped.push(format!("{label}: left out, {why}."));
            (0..trials).try_for_each(|_| bench.progress.done())?;
            continue;
        };
        let chosen = outcome.configurations.concat();
        let rules = Rules::measurable(&scene.arm, &scene.sensor);
        let injected = situation.injected(bench.scene);
        let rank = outcome.indexes.rank;
        let fits: Vec<[(Option<f64>, bool); 2]> = bench.parts(trials, |number| {
            let trial = Trial::new(&scene, &injected, number)?;
            let drawn = Sampler::new(&rules).draw(&mut stream(trial.seed(), "advice/random"), scene.design.count)?;
            let rms = |set: &[f64]| {
                let result = trial.calibrate(set)?;
                let held = result.identification.rank < rank;
                Ok::<_, SessionError>((result.converged.then_some(result.after.position_m.rms), held))
            };
            Ok([rms(&chosen)?, rms(&drawn)?])
        })?;
        let (ours, theirs): (Vec<f64>, Vec<f64>) = fits.iter().filter_map(|[ours, theirs]| Some((ours.0?, theirs.0?))).unzip();
        outcomes.push(Outcome {
            label,
            effects: situation.effects,
            predicted: 1.0 - set.position_rms_m / random.position_rms_m,
            possible: 1.0 - advice.bound_m / random.position_rms_m,
            measured: Mean::gain(&ours, &theirs),
            random_mm: Mean::of(&theirs).map(|mean| mean.times(1e3)),
            predicted_random_mm: 1e3 * random.position_rms_m,
            fits: Tally {
                fits: 2 * trials,
                not_converged: fits.iter().flatten().filter(|(error, _)| error.is_none()).count(),
                held: fits.iter().flatten().filter(|(_, held)| *held).count(),
            },
        });
    }
    let mut found = found(&outcomes);
    found.notes.extend(skipped);
    Ok(found)
}

/// Situations with their scenes: names, and where the model misses nothing and where it does.
fn cells(base: &Scene) -> Vec<(String, Scene, Situation)> {
    let mut cells = Vec::new();
    for effects in [false, true] {
        for sees in [Sees::Pose, Sees::Position] {
            for count in COUNTS {
                for (reach, name) in
                    [(Some(HALF_RANGES[0]), "joints ±45°"), (Some(HALF_RANGES[1]), "joints ±90°"), (None, "cone ±20°")]
                {
                    let kind = if reach.is_some() { Reach::Free } else { Reach::Cone };
                    let situation = Situation { sees, reach: kind, effects, count };
                    let mut scene = situation.scene(base);
                    match reach {
                        Some(half) => scene.arm = cut(&scene.arm, half),
                        None => scene.sensor.view.iter_mut().for_each(|view| view.half_angle_rad = CONE_RAD),
                    }
                    scene.design.method = Method::default();
                    scene.design.criterion = Criterion::default();
                    scene.design.random_sets = RANDOM_SETS;
                    let sees = if sees == Sees::Pose { "pose" } else { "position" };
                    let effects = if effects { "on" } else { "off" };
                    cells.push((format!("{sees}, {name}, effects {effects}, m = {count}"), scene, situation));
                }
            }
        }
    }
    cells
}

fn found(outcomes: &[Outcome]) -> Found {
    let percent = |share: f64| 100.0 * share;
    let claims = outcomes
        .iter()
        .flat_map(|outcome| {
            [
                Claim::single(format!("{}: predicted gain (%)", outcome.label), None, Some(percent(outcome.predicted)))
                    .bounded(Some(percent(outcome.possible))),
                Claim::new("  measured gain, RMS (%)", None, outcome.measured.map(|mean| mean.times(100.0))),
            ]
        })
        .collect();
    let of = |effects: bool| -> Vec<(&Outcome, Mean)> {
        let of = outcomes.iter().filter(|outcome| outcome.effects == effects);
        of.filter_map(|outcome| Some((outcome, outcome.measured?))).collect()
    };
    let summary = |effects: bool| {
        let pairs = of(effects);
        if pairs.is_empty() {
            return "nobody knows how much: no situation could be judged".to_owned();
        }
        let distance = |(outcome, measured): &(&Outcome, Mean)| percent((outcome.predicted - measured.mean).abs());
        let within = pairs.iter().filter(|(outcome, measured)| {
            measured.interval95.is_some_and(|[low, high]| low <= outcome.predicted && outcome.predicted <= high)
        });
        let mean = pairs.iter().map(distance).sum::<f64>() / pairs.len().max(1) as f64;
        let largest = pairs.iter().map(distance).fold(0.0, f64::max);
        let [predicted, measured]: [Vec<f64>; 2] =
            [pairs.iter().map(|(outcome, _)| outcome.predicted).collect(), pairs.iter().map(|(_, mean)| mean.mean).collect()];
        let rho = rank_correlation(&predicted, &measured).unwrap_or(f64::NAN);
        format!(
            "{mean:.1} points on average and {largest:.1} at most (in {} of {} situations within the 95 % interval of the measured one; \
             rank correlation {rho:.2})",
            within.count(),
            pairs.len()
        )
    };
    let verdict = format!(
        "Where noise is all there is, the predicted gain is off by {}; with play and warming, which no design knows of, by {}.",
        summary(false),
        summary(true)
    );
    let rows = outcomes.iter().map(|outcome| {
        let [measured, low, high] = with_ends(outcome.measured).map(percent);
        let numbers = vec![
            percent(outcome.predicted),
            measured,
            low,
            high,
            percent(outcome.possible),
            outcome.predicted_random_mm,
            outcome.random_mm.map_or(f64::NAN, |mean| mean.mean),
        ];
        (vec![outcome.label.clone()], numbers)
    });
    let columns = [
        "situation",
        "predicted_gain_percent",
        "measured_gain_percent",
        "low95_percent",
        "high95_percent",
        "largest_gain_percent",
        "random_predicted_rms_mm",
        "random_measured_rms_mm",
    ];
    let mut panel = Panel::new(Axis::linear("predicted gain (%)"), Axis::linear("measured gain, held-out RMS (%)"));
    for (effects, name) in [(false, "noise alone"), (true, "play and warming")] {
        let points = of(effects).into_iter().map(|(outcome, measured)| {
            let measured = measured.times(100.0);
            Estimate { x: percent(outcome.predicted), y: measured.mean, x_interval: None, y_interval: measured.interval95 }
        });
        panel = panel.with(Series::new(name, Kind::Estimates(points.collect())));
    }
    panel = panel.with(Series::new("as predicted", Kind::Diagonal).colour(Colour::Dark));
    Found {
        claims,
        verdict,
        notes: vec![format!(
            "Designs by {} on {}; gains over random sets, each calibration with one of its own; bound: what the best set there can be \
             would gain.",
            Method::default().name(),
            Criterion::default().name()
        )],
        fits: outcomes.iter().map(|outcome| outcome.fits).sum(),
        data: vec![Data::labelled("advice", &columns, rows.collect())],
        figures: vec![("advice".to_owned(), Figure::new("Predicted and measured gain over random sets", 1).with(panel))],
    }
}
