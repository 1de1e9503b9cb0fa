//! Chen et al. 2019, section V.C.2.b, Table 7, Fig. 16 and abstract: what choosing the configurations is worth.
//!
//! As in the paper, every calibration has a random set of its own or the one set that is optimal for O_C. A third set is optimal for
//! the variance of the predicted position (I-optimality): what a choice can gain if it looks at the error itself. All calibrations of a
//! trial share the true arm, the verification and the noise. Beside the gains stands what noise lets expect without a fit, and the
//! largest gain that any set of as many configurations can have.
//!
//! The same is then done where choosing can gain most: few configurations, positions only, joints that move little.

use super::Experiment;
use super::arms::cut;
use super::bench::{Bench, Choice, DEG, Fit, MM, choose, fewest, mean, mean_of, percent, plain, tally};
use super::findings::{Claim, Data, Found, flag};
use super::limits::Limits;
use super::published::Published;
use crate::design::candidates::{Rules, Sampler};
use crate::design::objective::Models;
use crate::design::problem::{Criterion, Method};
use crate::figure::{Axis, Colour, Figure, Kind, Marker, Panel, Series};
use crate::lab::trial::Trial;
use crate::scene::Scene;
use crate::seed::stream;
use crate::session::SessionError;
use crate::statistics::Mean;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "headline",
    place: "Table 7, Fig. 16, abstract",
    about: "what choosing the configurations is worth",
    trials: 100,
    work: run,
};

/// Values of the criterion for the search on I-optimality, in budgets of the swarm.
const BUDGETS: u64 = 25;
/// Few configurations with full poses: eq. 30's number for the paper's arm.
const FEW: usize = 8;
/// Cut joint ranges, °.
const CUT_DEG: f64 = 60.0;
/// Configurations where positions only are measured, beside the fewest that do.
const POSITIONS: usize = 20;
/// The sets, in the order of [`Situation::fits`].
const SETS: [&str; 3] = ["random", "optimal for O_C", "I-optimal"];

/// An arm, a sensor and their rules.
struct Cell<'a> {
    scene: &'a Scene,
    models: &'a Models,
    limits: &'a Limits,
    label: String,
}

/// A cell with a number of configurations, and what came out.
struct Situation {
    label: String,
    count: usize,
    /// Fits of each trial with each set.
    fits: Vec<[Fit; 3]>,
    /// Position RMS that noise lets expect, mm: random sets, optimal for O_C, I-optimal.
    predicted: [Option<Mean>; 3],
    /// The same for the orientation, °.
    predicted_orientation: [Option<Mean>; 3],
    /// The least of any set, mm.
    least: Option<f64>,
}

fn run(bench: &Bench<'_>, trials: usize) -> Result<Found, SessionError> {
    let published = Published::get().headline;
    let scene = bench.scene;
    let models = bench.models()?;
    let mut positions = scene.clone();
    positions.arm = cut(&scene.arm, CUT_DEG / DEG);
    positions.sensor.orientation_sigma_rad = None;
    let position_models = Models::new(&positions.request())?;
    let (few, fewest_positions) = (FEW.max(fewest(models)), fewest(&position_models) + 1);

    bench.progress.begin("calibrating", 4 * (trials + 2))?;
    let poses = Cell {
        scene,
        models,
        limits: &bench.limits,
        label: if scene.sensor.orientation_sigma_rad.is_some() { "full poses" } else { "positions only" }.to_owned(),
    };
    let limits = Limits::default();
    let label = format!("positions only, joints ±{CUT_DEG}°");
    let positions = Cell { scene: &positions, models: &position_models, limits: &limits, label };
    let situations = [
        compare(bench, &poses, scene.design.count, trials, Some(&bench.optimum()?.configurations))?,
        compare(bench, &poses, few, trials, None)?,
        compare(bench, &positions, fewest_positions, trials, None)?,
        compare(bench, &positions, POSITIONS.max(fewest_positions), trials, None)?,
    ];

    let mut claims = Vec::new();
    for (number, situation) in situations.iter().enumerate() {
        situation.claims(if number == 0 { Some(&published) } else { None }, &mut claims);
    }
    let [own, few, fewest_only, more_only] = &situations;
    let (gain, orientation_gain) = (own.gain(1, Fit::position_mm), own.gain(1, Fit::orientation_deg));
    let paper = published.position_gain_percent / 100.0;
    let judgement = match gain.and_then(|gain| gain.interval95) {
        Some([_, high]) if high < paper => "does not hold",
        Some([low, _]) if low > 0.0 => "holds",
        _ => "is not decided by so few trials",
    };
    let most = own.most();
    let why = match most {
        Some(most) if most < paper => format!(
            "; it cannot be had: no set of {} lets noise leave an RMS more than {:.1} % below that of random sets",
            own.count,
            100.0 * most
        ),
        _ => String::new(),
    };
    let verdict = format!(
        "That the set optimal for O_C makes positions {} % better at m = {} {}: it is {}, orientations {} (paper {} %), the I-optimal set \
         {}{why}. Where choosing matters the I-optimal set gains {} ({}, m = {}), {} and {} (positions only, joints ±{CUT_DEG}°, \
         m = {} and {}), the set optimal for O_C {}, {} and {}.",
        published.position_gain_percent,
        own.count,
        judgement,
        percent(gain),
        percent(orientation_gain),
        published.orientation_gain_percent,
        percent(own.gain(2, Fit::position_mm)),
        percent(few.gain(2, Fit::position_mm)),
        few.label,
        few.count,
        percent(fewest_only.gain(2, Fit::position_mm)),
        percent(more_only.gain(2, Fit::position_mm)),
        fewest_only.count,
        more_only.count,
        percent(few.gain(1, Fit::position_mm)),
        percent(fewest_only.gain(1, Fit::position_mm)),
        percent(more_only.gain(1, Fit::position_mm)),
    );
    let mut notes = vec![
        format!("{trials} calibrations for every set; gain: one minus the ratio of the mean errors, in pairs that share the true arm, the \
                 verification and the noise."),
        "The bound of a gain is that of the RMS that noise alone lets expect, the predicted mean over random sets against the least of \
         any set; it is not one of the mean error of a few calibrations."
            .to_owned(),
    ];
    for situation in &situations {
        let counts = tally(situation.fits.iter().flatten());
        if counts.not_converged + counts.held > 0 {
            notes.push(format!(
                "{}: of {} fits {} did not converge and {} held combinations at nominal.",
                situation.name(),
                counts.fits,
                counts.not_converged,
                counts.held
            ));
        }
    }
    let arm = &scene.arm.name;
    Ok(Found {
        claims,
        verdict,
        notes,
        fits: tally(situations.iter().flat_map(|situation| &situation.fits).flatten()),
        data: vec![data(&situations)],
        figures: vec![
            ("headline-errors".to_owned(), error_figure(arm, &situations[0])),
            ("headline-gains".to_owned(), gain_figure(arm, &situations, paper)),
        ],
    })
}

/// Calibrates with random sets, the set optimal for O_C (`optimum`, or searched for) and the I-optimal set.
fn compare(
    bench: &Bench<'_>,
    cell: &Cell<'_>,
    count: usize,
    trials: usize,
    optimum: Option<&[f64]>,
) -> Result<Situation, SessionError> {
    let Cell { scene, models, limits, label } = cell;
    let joint_count = scene.arm.joint_count();
    let budget = scene.design.swarm.evaluations();
    let search = |method, criterion, budget| -> Result<Vec<f64>, SessionError> {
        let choice = Choice { method, criterion, count, budget };
        let label = format!("headline/{label}/{count}/{}", criterion.name());
        Ok(choose(scene, models, choice, &label, &mut |_| {})?.0.configurations)
    };
    let comprehensive = match optimum {
        Some(optimum) => optimum.to_vec(),
        None => search(Method::Pso, Criterion::Comprehensive, budget)?,
    };
    bench.progress.done()?;
    let i_optimal = search(Method::CoordinateExchange, Criterion::IOptimality, BUDGETS * budget)?;
    bench.progress.done()?;

    let rules = Rules::measurable(&scene.arm, &scene.sensor);
    let rank = models.information.rank();
    let done: Vec<([Fit; 3], [f64; 2])> = bench.parts(trials, |number| {
        let trial = Trial::new(scene, bench.injected, number)?;
        let random = Sampler::new(&rules).draw(&mut stream(trial.seed(), &format!("headline/random/{count}")), count)?;
        let fits =
            [Fit::new(&trial, &random, rank)?, Fit::new(&trial, &comprehensive, rank)?, Fit::new(&trial, &i_optimal, rank)?];
        let predicted = models
            .predict(&random, joint_count)
            .map_or([f64::NAN; 2], |found| [MM * found.position_rms_m, DEG * found.orientation_rms_rad]);
        Ok((fits, predicted))
    })?;
    let random = |kind: usize| mean_of(done.iter().map(|(_, predicted)| predicted[kind]));
    let single = |set: &[f64], kind: usize| {
        models
            .predict(set, joint_count)
            .and_then(|found| mean_of([[MM * found.position_rms_m, DEG * found.orientation_rms_rad][kind]]))
    };
    let predicted = |kind: usize| [random(kind), single(&comprehensive, kind), single(&i_optimal, kind)];
    let (position, orientation) = (predicted(0), predicted(1));
    Ok(Situation {
        label: label.clone(),
        count,
        fits: done.into_iter().map(|(fits, _)| fits).collect(),
        predicted: position,
        predicted_orientation: orientation,
        least: limits.least_rms_m(scene, models, count).map(|least| MM * least),
    })
}

impl Situation {
    fn name(&self) -> String {
        format!("{}, m = {}", self.label, self.count)
    }

    /// By which share errors with set number `set` are smaller than with random sets.
    fn gain(&self, set: usize, error: fn(&Fit) -> f64) -> Option<Mean> {
        let pairs = self.fits.iter().filter(|fits| fits[0].converged && fits[set].converged);
        let (better, worse): (Vec<f64>, Vec<f64>) = pairs.map(|fits| (error(&fits[set]), error(&fits[0]))).unzip();
        Mean::gain(&better, &worse).filter(|gain| gain.mean.is_finite())
    }

    /// The same of what noise lets expect.
    fn predicted_gain(&self, predicted: &[Option<Mean>; 3], set: usize) -> Option<f64> {
        Some(1.0 - predicted[set]?.mean / predicted[0]?.mean)
    }

    /// The largest gain that any set can have, of what noise lets expect.
    fn most(&self) -> Option<f64> {
        Some(1.0 - self.least? / self.predicted[0]?.mean)
    }

    fn claims(&self, published: Option<&super::published::Headline>, claims: &mut Vec<Claim>) {
        let (name, most) = (self.name(), self.most().map(|most| 100.0 * most));
        for (set, label) in SETS.iter().enumerate().skip(1) {
            // The paper has a set for O_C only.
            let paper = published.filter(|_| set == 1);
            let percent = |gain: Option<Mean>| gain.map(|gain| gain.times(100.0));
            claims.push(
                Claim::new(
                    format!("gain in position error, {}, {name} (%)", label),
                    paper.map(|paper| paper.position_gain_percent),
                    percent(self.gain(set, Fit::position_mm)),
                )
                .bounded(most),
            );
            let predicted = self.predicted_gain(&self.predicted, set).map(|gain| 100.0 * gain);
            claims
                .push(Claim::single(format!("  as predicted from noise, {}, {name} (%)", label), None, predicted).bounded(most));
            if let Some(gain) = percent(self.gain(set, Fit::orientation_deg)) {
                let paper = paper.map(|paper| paper.orientation_gain_percent);
                claims.push(Claim::new(format!("gain in orientation error, {}, {name} (%)", label), paper, Some(gain)));
                let predicted = self.predicted_gain(&self.predicted_orientation, set).map(|gain| 100.0 * gain);
                claims.push(Claim::single(
                    format!("  as predicted from noise, orientation, {}, {name} (%)", label),
                    None,
                    predicted,
                ));
            }
        }
        for (set, label) in SETS.iter().enumerate() {
            let fits = || self.fits.iter().map(|fits| &fits[set]);
            claims.push(Claim::new(format!("position error, {label}, {name} (mm)"), None, mean(fits(), Fit::position_mm)));
            claims.push(
                Claim::new(format!("position RMS predicted, {label}, {name} (mm)"), None, self.predicted[set])
                    .bounded(self.least),
            );
        }
    }
}

/// Fig. 16.
fn error_figure(arm: &str, situation: &Situation) -> Figure {
    let panel = |title: &str, label: &str, error: fn(&Fit) -> f64| {
        let mut panel = Panel::new(Axis::linear("calibration"), Axis::linear(label).zero()).titled(title);
        let markers = [Marker::Cross, Marker::Circle, Marker::Triangle];
        let mut lines = Vec::new();
        for (set, name) in SETS.iter().enumerate() {
            let fits = || situation.fits.iter().map(|fits| &fits[set]);
            let points = fits().enumerate().filter(|(_, fit)| fit.converged);
            let points = points.map(|(number, fit)| [number as f64 + 1.0, error(fit)]).collect();
            let mean = mean(fits(), error);
            let name = format!("{name}, mean {}", plain(mean, 3));
            panel = panel.with(Series::new(name, Kind::Points(points)).colour(Colour::Palette(set)).marker(markers[set]));
            lines.extend(mean.map(|mean| Series::new("", Kind::Horizontal(mean.mean)).colour(Colour::Palette(set))));
        }
        lines.into_iter().fold(panel, Panel::with)
    };
    Figure::new(format!("{arm}: errors of calibrations with random and with chosen sets, m = {}", situation.count), 2)
        .with(panel("(a) position", "position error (mm)", Fit::position_mm))
        .with(panel("(b) orientation", "orientation error (°)", Fit::orientation_deg))
}

/// What choosing gains in every situation.
fn gain_figure(arm: &str, situations: &[Situation], paper: f64) -> Figure {
    let names = situations.iter().map(Situation::name);
    let gains = |set: usize| {
        situations
            .iter()
            .map(|situation| situation.gain(set, Fit::position_mm).map_or(f64::NAN, |gain| 100.0 * gain.mean))
            .collect()
    };
    let mut panel = Panel::new(Axis::categories("", names), Axis::linear("gain in mean position error (%)").zero())
        .with(Series::new(SETS[1], Kind::Bars(gains(1))).colour(Colour::Palette(1)))
        .with(Series::new(SETS[2], Kind::Bars(gains(2))).colour(Colour::Palette(2)));
    let most: Vec<f64> = situations.iter().map(|situation| situation.most().map_or(f64::NAN, |most| 100.0 * most)).collect();
    if most.iter().any(|most| most.is_finite()) {
        panel = panel.with(Series::new("most of any set (RMS)", Kind::Bars(most)).colour(Colour::Grey));
    }
    panel = panel.with(Series::new("paper, m = 40", Kind::Horizontal(100.0 * paper)).colour(Colour::Dark));
    Figure::new(format!("{arm}: what choosing gains over random sets"), 1).with(panel)
}

fn data(situations: &[Situation]) -> Data {
    let columns = ["situation", "set", "m", "trial", "before_mm", "position_mm", "attitude_deg", "converged", "held"];
    let mut rows = Vec::new();
    for situation in situations {
        for (trial, fits) in situation.fits.iter().enumerate() {
            for (set, fit) in fits.iter().enumerate() {
                let numbers = vec![
                    situation.count as f64,
                    trial as f64,
                    MM * fit.before.position_m.mean,
                    fit.position_mm(),
                    fit.orientation_deg(),
                    flag(fit.converged),
                    flag(fit.held),
                ];
                rows.push((vec![situation.label.clone(), SETS[set].to_owned()], numbers));
            }
        }
    }
    Data::labelled("headline", &columns, rows)
}
