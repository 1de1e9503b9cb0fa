//! From measurements to causes: what geometry leaves, which effects explain it with what probability, how far that goes on poses
//! that were not used, what could not have been seen, and what remains unknown.
//!
//! Data (`groups`, `conditions`) → a linear problem about the fitted geometry and the effects found so far (`rows`, `linear`), made
//! again until nothing changes → sets of effects with their probabilities, for which inner products suffice (`signatures`, `products`,
//! `evidence`, `fitted`, `search`) → what they are worth on readings that were not used (`held_out`) → what that comes to ([`conclusion`]), which
//! [`crate::report::wording`] puts into words ([`outcome`]).

mod advice;
mod candidates;
mod claims;
pub mod conclusion;
pub(crate) mod conditions;
mod confusion;
pub mod correction;
pub(crate) mod deflection;
mod detectability;
mod evidence;
mod fitted;
mod gap;
pub mod gravity;
mod groups;
pub(crate) mod held_out;
mod linear;
mod magnitude;
mod misfit;
mod naming;
mod notes;
mod open_set;
pub mod outcome;
mod outliers;
pub(crate) mod parameters;
mod power;
mod products;
mod ripple;
pub(crate) mod rows;
mod scatter;
mod search;
pub mod settings;
mod signatures;
#[cfg(test)]
pub(crate) mod tests;
mod unknown;
mod verdict;
pub mod waterfall;
mod weights;

pub use evidence::Extension;
pub use held_out::Block;
pub use rows::{DiagnosisError, check_robot};

use nalgebra::{DVector, Vector3};

use crate::arm::Arm;
use crate::effects::signature::library::{Hypothesis, library, ripple, strongest};
use crate::effects::signature::shape::Displacement;
use crate::effects::{Kind, Location};
use crate::identification::geometry::GeometryError;
use crate::identification::mistake::Said;
use crate::measurement::{Measurement, Sensor};
use candidates::{candidates, weigh};
use conclusion::Conclusion;
use conditions::Conditions;
use deflection::{Loads, Present, present};
use evidence::{Candidates, Evidence, NoisePrior};
use gravity::Gravity;
use groups::{Groups, Repeats};
use held_out::{HeldOut, Scheme, Validation};
use linear::Linear;
use outcome::NoiseSource;
use products::{Marginal, Products};
use ripple::Ripple;
use rows::{Readings, Rows};
use scatter::Scatter;
use search::{Found, climb};
use settings::Settings;

/// How to diagnose.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Where the sensor's declared noise comes from.
    pub noise: NoiseSource,
    /// Kinds that are left out of the library.
    pub without: Vec<Kind>,
    /// Nothing but these kinds at these places, for who knows what is there.
    pub only: Option<Vec<(Kind, Location)>>,
    /// Where gravity's direction comes from.
    pub gravity: Gravity,
    /// Every number that decides.
    pub settings: Settings,
}

impl Options {
    /// The whole library.
    #[must_use]
    pub fn new(noise: NoiseSource) -> Options {
        Options { noise, without: Vec::new(), only: None, gravity: Gravity::Known, settings: Settings::default() }
    }

    /// Whether `kind` (`None`: a shape without a name) is looked for at `place`.
    fn wants(&self, kind: Option<Kind>, place: Location) -> bool {
        kind.is_none_or(|kind| !self.without.contains(&kind))
            && self.only.as_ref().is_none_or(|only| only.iter().any(|one| Some(one.0) == kind && one.1 == place))
    }

    /// What is looked for.
    fn candidates(&self, rows: &Rows, conditions: &Conditions, scanned: &[Hypothesis]) -> Candidates {
        let wanted = |hypothesis: &Hypothesis| self.wants(hypothesis.kind, hypothesis.location);
        let library = library(&rows.mechanism, &conditions.columns).into_iter();
        candidates(library.filter(wanted).collect(), scanned.iter().filter(|one| wanted(one)).cloned().collect())
    }
}

/// The readings, and what is known of them before any model.
struct Data<'a> {
    arm: &'a Arm,
    sensor: &'a Sensor,
    measurements: &'a [&'a Measurement],
    options: &'a Options,
    groups: Groups,
    repeats: Option<Repeats>,
    noise: NoisePrior,
    /// Noise of the orientations beside that of the positions, over what is said of both, where repeats tell it.
    orientation: Option<f64>,
}

impl<'a> Data<'a> {
    fn new(arm: &'a Arm, sensor: &'a Sensor, measurements: &'a [&'a Measurement], options: &'a Options) -> Data<'a> {
        let settings = &options.settings.noise;
        let groups = groups::groups(measurements, settings);
        let repeats = groups::repeats(measurements, &groups, settings);
        let sigma_m = sensor.mean_position_sigma(measurements.iter().copied());
        let noise = noise_prior(repeats, sigma_m, options.noise, settings);
        let orientation = weights::orientation_of_repeats(sensor, repeats, sigma_m, settings);
        Data { arm, sensor, measurements, options, groups, repeats, noise, orientation }
    }
}

/// What a pass is made around.
#[derive(Clone)]
struct State {
    /// Weight of each row for being far off.
    far: Vec<f64>,
    /// Weight of each row for being like others of its configuration.
    dependent: Vec<f64>,
    /// What the effects found so far do.
    displacement: Vec<Displacement>,
    /// Their coefficients: column and value.
    coefficients: Vec<(usize, f64)>,
    /// The same with the hypotheses.
    present: Vec<Present>,
    /// The best set so far.
    members: Vec<(usize, usize)>,
    /// What scans, and a closer look at what was found, have added to the library.
    scanned: Vec<Hypothesis>,
    /// Joints that do not repeat.
    scatter: Vec<Scatter>,
    /// Noise of the orientations over what is said of it, beside that of the positions.
    orientation: f64,
    /// Sigma of the geometry's prior over that of manufacturing.
    scale: f64,
    /// Where loads act.
    loads: Loads,
    /// Joints that stand upright, as the first pass found: members and coefficients are numbers in the library, which hangs on them.
    upright: Option<Vec<bool>>,
    /// Whether what was found about it could not be taken as it is.
    astray: bool,
    /// What a calibration leaves ([`rows::First`]).
    calibrated: DVector<f64>,
}

impl State {
    /// Nothing found, all rows good.
    fn nominal(data: &Data<'_>) -> State {
        let rows = data.measurements.len();
        State {
            far: vec![1.0; rows],
            dependent: vec![1.0; rows],
            displacement: Vec::new(),
            coefficients: Vec::new(),
            present: Vec::new(),
            members: Vec::new(),
            scanned: Vec::new(),
            scatter: Vec::new(),
            orientation: data.orientation.unwrap_or(1.0),
            scale: 1.0,
            loads: Loads::AsItStands,
            upright: None,
            astray: false,
            calibrated: DVector::zeros(0),
        }
    }

    /// Nothing found; rows that are far off from what geometry makes of the others count little, as what they pull awry hides all else.
    fn robust(data: &Data<'_>) -> Result<State, DiagnosisError> {
        let state = State::nominal(data);
        let first = rows::first_fit(data.arm, data.sensor, data.measurements, &data.options.settings.model, &Said::default())?;
        let calibrated = first.calibrated(data.arm, data.sensor, data.measurements)?;
        let far = first.far;
        Ok(State { far: if far.is_empty() { state.far } else { far }, calibrated, ..state })
    }

    fn weights(&self) -> Vec<f64> {
        self.dependent.iter().zip(&self.far).map(|(a, b)| a * b).collect()
    }

    /// Around what `pass` found.
    fn after(&self, pass: &Pass) -> State {
        State {
            far: pass.weighed.far.clone(),
            dependent: pass.weighed.dependent.clone(),
            displacement: pass.displacement.clone(),
            coefficients: pass.coefficients.clone(),
            present: pass.present.clone(),
            members: pass.members.clone(),
            scale: pass.scale,
            loads: pass.loads,
            upright: Some(pass.conditions.columns.upright.clone()),
            ..self.clone()
        }
    }

    /// With half of the effects of this one and half of those of `other`.
    fn halfway(&self, other: &State) -> State {
        let half =
            |of: &State| -> Vec<(usize, f64)> { of.coefficients.iter().map(|(column, value)| (*column, 0.5 * value)).collect() };
        let half_present = |of: &State| -> Vec<Present> {
            let halved = |one: &Present| Present {
                coefficients: one.coefficients.iter().map(|value| 0.5 * value).collect(),
                ..one.clone()
            };
            of.present.iter().map(halved).collect()
        };
        let of = |state: &State, row: usize| state.displacement.get(row).copied().unwrap_or_default();
        let middle = |row: usize| -> Displacement {
            let (a, b) = (of(self, row), of(other, row));
            std::array::from_fn(|axis| 0.5 * (a[axis] + b[axis]))
        };
        State {
            displacement: (0..self.far.len()).map(middle).collect(),
            coefficients: [half(self), half(other)].concat(),
            present: [half_present(self), half_present(other)].concat(),
            ..other.clone()
        }
    }

    /// Whether `pass` found what it was made around. `sigma_m`: noise of a position about an axis.
    fn is_settled(&self, pass: &Pass, sigma_m: f64, settings: &settings::Model) -> bool {
        let same = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < settings.settled_weight);
        let sorted = |members: &[(usize, usize)]| {
            let mut sorted = members.to_vec();
            sorted.sort_unstable();
            sorted
        };
        same(&pass.weighed.far, &self.far)
            && same(&pass.weighed.dependent, &self.dependent)
            && sorted(&pass.members) == sorted(&self.members)
            && pass.scale == self.scale
            && pass.complete
            && pass.loads == self.loads
            && pass.changed_m < settings.settled * sigma_m
    }
}

/// A pass that went well, to go back to.
struct Before {
    number: usize,
    /// What it was made around.
    state: State,
    /// [`Pass::typical_m`].
    typical_m: f64,
    /// How often the way from it has been halved.
    halvings: usize,
}

/// The linear problem about `state`. The effects found so far are taken out as large as they are (`displaced`) on the arm as it is
/// fitted now (`rows`), and put back along their signatures.
fn around<'a>(
    state: &State,
    rows: &'a Rows,
    conditions: &'a Conditions,
    displaced: &[Displacement],
    candidates: &'a Candidates,
) -> Linear<'a> {
    let mut total = rows.residual.clone();
    for (row, now) in displaced.iter().enumerate() {
        let before = state.displacement.get(row).copied().unwrap_or_default();
        let less: Displacement = std::array::from_fn(|axis| before[axis] - now[axis]);
        for (equation, value) in rows.equations.of(row).zip(rows.read(row, &less)) {
            total[equation] += value;
        }
    }
    let linear = Linear::new(rows, &conditions.readings, candidates, total, state.scale);
    let total = &linear.residual + linear.made(&state.coefficients);
    Linear { residual: total, ..linear }
}

/// One round: everything about the arm as it is with the effects found so far.
struct Pass {
    rows: Rows,
    conditions: Conditions,
    candidates: Candidates,
    /// Folds by region.
    scheme: Scheme,
    products: Products,
    /// Sigma of the geometry's prior over that of manufacturing.
    scale: f64,
    /// The likeliest set.
    members: Vec<(usize, usize)>,
    /// Its coefficients: column and value.
    coefficients: Vec<(usize, f64)>,
    /// The same with the hypotheses.
    present: Vec<Present>,
    /// What it does to each row, as large as it is.
    displacement: Vec<Displacement>,
    /// By how much that moves a target more or less than what the pass was made around, at most, m.
    changed_m: f64,
    /// Whether nothing more was to be found.
    complete: bool,
    /// Where loads act.
    loads: Loads,
    /// By how much a target would be elsewhere if they acted otherwise, at most, m.
    loads_matter_m: f64,
    /// Of the readings with the likeliest set.
    log_likelihood: f64,
    /// Residual with no effect taken out ([`Linear::residual`]).
    total: DVector<f64>,
    /// What it leaves, m and rad.
    residual: DVector<f64>,
    weighed: weights::Weighed,
}

impl Pass {
    /// `number`: of the pass. The geometry's prior is chosen in the first ones, and few effects are looked for, so that the largest
    /// ones are taken as large as they are before anything is looked for beside them.
    fn new(data: &Data<'_>, state: &State, number: usize) -> Result<Pass, DiagnosisError> {
        let settings = &data.options.settings;
        let weights = state.weights();
        let measurements = data.measurements;
        let orientation_sigma_rad = data.sensor.orientation_sigma_rad.map(|sigma| sigma * state.orientation);
        let sensor = &Sensor { orientation_sigma_rad, ..data.sensor.clone() };
        let readings =
            Readings { sensor, measurements, weights: &weights, displacement: &state.displacement, scatter: &state.scatter };
        let rows = rows::fit(data.arm, readings)?;
        let (conditions, displaced) =
            conditions::conditions(measurements, &rows, &state.present, state.loads, state.upright.as_deref(), &settings.model);
        let mut candidates = data.options.candidates(&rows, &conditions, &state.scanned);
        let scheme = held_out::schemes(measurements, &rows.targets, &data.groups, &settings.validation).swap_remove(0);
        let linear = around(state, &rows, &conditions, &displaced, &candidates);
        let products = linear.products(&scheme.fold, scheme.folds);
        let Linear { residual: total, prior, .. } = linear;
        let marginal = Marginal::new(&products, None, &prior).ok_or(GeometryError::Degenerate)?;
        let information: Vec<f64> = (0..candidates.hypotheses.len()).map(|number| marginal.information(number)).collect();
        weigh(&mut candidates, &information, &settings.prior);
        let evidence = Evidence { marginal: &marginal, candidates: &candidates, noise: data.noise, settings };
        let most = settings.search.most.min(settings.model.first << number.min(8));
        let (mut members, _) = climb(&evidence, &state.members, most);
        let mut scale = state.scale;
        if number < settings.model.choosing {
            let likelihood = |scale: f64| -> f64 {
                let other = Marginal::new(&products, None, &prior.scaled(scale));
                other.map_or(f64::NEG_INFINITY, |other| Evidence { marginal: &other, ..evidence }.log_likelihood(&members))
            };
            let best = settings
                .model
                .geometry_scales
                .iter()
                .map(|scale| (likelihood(*scale), *scale))
                .max_by(|a, b| a.0.total_cmp(&b.0));
            scale = best.map_or(scale, |(_, scale)| scale);
        }
        let again;
        let marginal = if scale == state.scale {
            &marginal
        } else {
            again = Marginal::new(&products, None, &prior.scaled(scale)).ok_or(GeometryError::Degenerate)?;
            &again
        };
        let evidence = Evidence { marginal, candidates: &candidates, noise: data.noise, settings };
        if scale != state.scale {
            members = climb(&evidence, &members, most).0;
        }
        let coefficients = evidence.coefficients(&members);
        let geometry = marginal.geometry(&coefficients);
        let linear = Linear::new(&rows, &conditions.readings, &candidates, total, scale);
        let residual = linear.left(&geometry, &linear.made(&coefficients));
        let weighed = weights::weigh(&rows, &residual, &weights, &data.groups, &settings.noise);
        let total = linear.residual;
        let present = present(&candidates, &coefficients);
        let made = |loads: Loads| {
            conditions::conditions(measurements, &rows, &present, loads, state.upright.as_deref(), &settings.model).1
        };
        let displacement = made(state.loads);
        let apart = |one: &[Displacement], other: &[Displacement]| {
            let change = |(a, b): (&Displacement, &Displacement)| libm::hypot(libm::hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]);
            one.iter().zip(other).map(change).fold(0.0, f64::max)
        };
        let changed_m = apart(&displacement, &displaced);
        let loads_matter_m = apart(&displacement, &made(state.loads.other()));
        Ok(Pass {
            complete: members.len() < most || most == settings.search.most,
            log_likelihood: evidence.log_likelihood(&members),
            loads: state.loads,
            loads_matter_m,
            rows,
            conditions,
            candidates,
            scheme,
            products,
            scale,
            members,
            coefficients,
            present,
            displacement,
            changed_m,
            total,
            residual,
            weighed,
        })
    }

    /// What geometry leaves of the positions beside the effects that the pass was made around, as large as they are: median over the
    /// readings, m.
    fn typical_m(&self) -> f64 {
        let rows = &self.rows;
        let of = |row: usize| rows.residual.rows_range(rows.equations.of_position(row)).norm();
        let mut left: Vec<f64> = (0..rows.equations.readings()).map(of).collect();
        left.sort_by(f64::total_cmp);
        left.get(left.len() / 2).copied().unwrap_or(0.0)
    }

    /// Logarithm of the likelihood of the readings with the same set, if loads acted as in `state`, which is else what the pass was made
    /// around. `None` where the rows do not tell where the arm stands.
    fn log_likelihood_around(&self, data: &Data<'_>, state: &State) -> Option<f64> {
        let settings = &data.options.settings;
        let (conditions, displaced) = conditions::conditions(
            data.measurements,
            &self.rows,
            &state.present,
            state.loads,
            state.upright.as_deref(),
            &settings.model,
        );
        let linear = around(state, &self.rows, &conditions, &displaced, &self.candidates);
        // Nothing but the members: thousands of signatures for one number would double the memory of a diagnosis.
        let hypotheses = self.members.iter().map(|(hypothesis, _)| self.candidates.hypotheses[*hypothesis].clone()).collect();
        let members: Vec<(usize, usize)> = self.members.iter().enumerate().map(|(at, (_, scale))| (at, *scale)).collect();
        let own = candidates(hypotheses, Vec::new());
        let linear = Linear { candidates: &own, prior: linear.prior.scaled(self.scale), ..linear };
        let products = linear.products(&vec![0; data.measurements.len()], 1);
        let marginal = Marginal::new(&products, None, &linear.prior)?;
        Some(Evidence { marginal: &marginal, candidates: &own, noise: data.noise, settings }.log_likelihood(&members))
    }

    fn linear(&self) -> Linear<'_> {
        Linear::new(&self.rows, &self.conditions.readings, &self.candidates, self.total.clone(), self.scale)
    }
}

/// What was found, before it is decided what that comes to.
pub(crate) struct Analysis<'a> {
    pub(crate) linear: &'a Linear<'a>,
    pub(crate) conditions: &'a Conditions,
    pub(crate) evidence: Evidence<'a>,
    pub(crate) found: Found,
    pub(crate) held_out: Vec<HeldOut>,
    pub(crate) structure: open_set::Structure,
    pub(crate) outliers: outliers::Outliers,
    /// Mean square of what is left of the readings that are no outliers, however little they count, in declared sigmas.
    pub(crate) left: f64,
    /// Joints that do not repeat.
    pub(crate) scatter: Vec<Scatter>,
    /// Noise of the orientations over what was said of it.
    pub(crate) orientation: f64,
    pub(crate) maps: Vec<outcome::Map>,
    pub(crate) residuals: Vec<outcome::Residual>,
    /// What each member of the best set does.
    pub(crate) moved: Moved,
    pub(crate) measurements: &'a [&'a Measurement],
    pub(crate) sensor: &'a Sensor,
    pub(crate) repeats: Option<Repeats>,
    /// Correlation of residuals of the same configuration, where there are any.
    pub(crate) correlation: Option<f64>,
    /// Whether the fit around what was found went astray.
    pub(crate) astray: bool,
    /// Gravity in root, m/s², where the readings have told.
    pub(crate) gravity: Option<Vector3<f64>>,
    pub(crate) options: &'a Options,
}

impl Analysis<'_> {
    /// One sigma of a position about an axis, as it is said of the sensor, m.
    fn sigma_m(&self) -> f64 {
        self.sensor.mean_position_sigma(self.measurements.iter().copied())
    }
}

/// Diagnoses `measurements` of `arm`, read by `sensor`. [`crate::report::wording::diagnosis`] puts what it comes to into words.
///
/// # Errors
/// If the measurements cannot tell where the arm stands, or are not this robot's.
pub fn diagnose(
    arm: &Arm,
    sensor: &Sensor,
    measurements: &[&Measurement],
    options: &Options,
) -> Result<Conclusion, DiagnosisError> {
    let settings = &options.settings;
    settings.check()?;
    let mut data = Data::new(arm, sensor, measurements, options);
    let sought = if options.gravity == Gravity::Assumed { gravity::sought(&data)? } else { None };
    let turned = sought.map(|gravity_in_base| Arm { gravity_in_base, ..arm.clone() });
    data.arm = turned.as_ref().unwrap_or(arm);
    let (state, pass) = settle(&data)?;
    let linear = pass.linear();
    let marginal = Marginal::new(&pass.products, None, &linear.prior).ok_or(GeometryError::Degenerate)?;
    let evidence = Evidence { marginal: &marginal, candidates: &pass.candidates, noise: data.noise, settings };
    let found = misfit::doubt(&evidence, search::search(&evidence, &pass.members, settings.search.most));
    let coefficients = evidence.coefficients(&found.best);
    let residual = linear.left(&marginal.geometry(&coefficients), &linear.made(&coefficients));
    let outliers = outliers_of(&data, &pass, &found);
    let good: Vec<bool> = (0..measurements.len()).map(|row| !outliers.rows.contains(&row)).collect();
    let validation = Validation { linear: &linear, noise: data.noise, good: &good, best: &found.best, settings };
    let held_out: Vec<HeldOut> = held_out::schemes(measurements, &pass.rows.targets, &data.groups, &settings.validation)
        .iter()
        .map(|scheme| match scheme.by {
            Block::Region => validation.run(scheme, &pass.products),
            Block::Payload | Block::Session => validation.run(scheme, &linear.products(&scheme.fold, scheme.folds)),
        })
        .collect();
    let counts = pass.rows.equations.counts();
    let of_good = |of: &dyn Fn(usize) -> f64| (0..good.len()).filter(|row| good[*row]).map(of).sum::<f64>();
    let left = of_good(&|row| pass.weighed.squares[row]) / of_good(&|row| counts[row] as f64).max(1.0);
    let units = data.groups.alike(measurements);
    let structure = open_set::structure(
        &pass.conditions,
        &pass.rows.shifts(&linear.in_sigmas(&residual)),
        &units,
        settings.validation.permutations,
    );
    let orientation_sigma_rad = sensor.orientation_sigma_rad.map(|sigma| sigma * state.orientation);
    let analysis = Analysis {
        moved: moved(&linear, &evidence, &found.best),
        residuals: residuals(&pass.rows, measurements, &state.calibrated, &residual),
        maps: open_set::maps(&pass.conditions, &pass.rows.shifts(&residual), settings.validation.bins),
        linear: &linear,
        conditions: &pass.conditions,
        evidence,
        found,
        held_out,
        structure,
        outliers,
        left,
        scatter: state.scatter.clone(),
        orientation: state.orientation,
        measurements,
        sensor: &Sensor { orientation_sigma_rad, ..sensor.clone() },
        repeats: data.repeats,
        astray: state.astray,
        gravity: sought,
        correlation: (data.groups.rows.len() < measurements.len()).then_some(pass.weighed.correlation),
        options,
    };
    Ok(verdict::conclude(&analysis))
}

/// Fits around what is found until nothing changes: signatures are those of the fitted arm, readings that are far off from the best model
/// or that repeat others are weighted down, geometry and effects are fitted together, and joints that do not repeat get a variance of
/// their own. The last pass, and what it was made around.
fn settle(data: &Data<'_>) -> Result<(State, Pass), DiagnosisError> {
    let settings = &data.options.settings;
    let mut state = State::robust(data)?;
    let sigma_m = data.sensor.mean_position_sigma(data.measurements.iter().copied());
    let (mut last, mut looks) = (settings.model.passes - 1, 0);
    // Without any scatter: held-out errors, and the state to go back to.
    let mut plain: Option<(f64, State)> = None;
    let mut before: Option<Before> = None;
    for number in 0.. {
        let pass = match (Pass::new(data, &state, number), before.take()) {
            (Ok(pass), Some(last)) if pass.typical_m() > settings.model.grows * last.typical_m => Err(last),
            (Err(DiagnosisError::Geometry(GeometryError::Degenerate)), Some(last)) => Err(last),
            (pass, _) => Ok(pass?),
        };
        let mut pass = match pass {
            Ok(pass) => pass,
            // What was found is too large to be taken as first order has it: half the way, or where that does not help, none.
            Err(last) if last.halvings < settings.model.halvings => {
                state = last.state.halfway(&state);
                before = Some(Before { halvings: last.halvings + 1, ..last });
                continue;
            }
            Err(last) => {
                let pass = Pass::new(data, &last.state, last.number)?;
                return Ok((State { astray: true, ..last.state }, pass));
            }
        };
        before = Some(Before { number, state: state.clone(), typical_m: pass.typical_m(), halvings: 0 });
        if number < settings.model.loads_passes && pass.loads_matter_m > settings.model.loads_matter * sigma_m {
            let other = State { loads: state.loads.other(), ..state.clone() };
            if pass.log_likelihood_around(data, &other).is_some_and(|otherwise| otherwise > pass.log_likelihood) {
                state = other;
                drop(pass);
                pass = Pass::new(data, &state, number)?;
            }
        }
        let linear = pass.linear();
        let marginal = Marginal::new(&pass.products, None, &linear.prior).ok_or(GeometryError::Degenerate)?;
        let evidence = Evidence { marginal: &marginal, candidates: &pass.candidates, noise: data.noise, settings };
        if number < last {
            let may_tell = state.scatter.is_empty() && data.orientation.is_none();
            let known = state.orientation != 1.0;
            let ratio =
                weights::orientation_over_position(&pass.rows, &pass.residual, known, &settings.noise).filter(|_| may_tell);
            let mut more = closer(&pass, &state.scanned);
            // Those that are not looked for stay out of the library, and come again.
            let known = |found: &&Ripple| {
                state.scanned.iter().any(|known| strongest(&known.shape) == Some((found.joint, f64::from(found.waves))))
            };
            let nameless = data.options.without.contains(&Kind::StrainWaveError);
            let ripples = ripple::look(&linear, &evidence, &pass.members, &|_| true);
            more.extend(
                ripples.iter().filter(|found| !known(found)).flat_map(|found| ripple(found.joint, found.waves, nameless)),
            );
            if !state.is_settled(&pass, sigma_m, &settings.model) || !more.is_empty() || ratio.is_some() {
                state = state.after(&pass);
                state.scanned.extend(more);
                state.orientation *= ratio.unwrap_or(1.0);
                continue;
            }
        }
        // Then, whether a joint does not repeat: its errors are no evidence of anything else. An error that comes again with the
        // configuration is no scatter.
        let comes_again = data.repeats.is_some_and(|repeats| repeats.moved) && pass.weighed.correlation > settings.noise.alike;
        let may_scatter = looks < settings.scatter.looks && data.options.only.is_none() && !comes_again;
        // Repeats between which the arm moved have the scatter in them.
        let of_sensor =
            NoisePrior { degrees_of_freedom: data.noise.degrees_of_freedom.min(settings.noise.unmoved_degrees), ..data.noise };
        let found = Found { best: pass.members.clone(), ..Found::default() };
        let looked = may_scatter
            .then(|| scatter::look(&linear, &Evidence { noise: of_sensor, ..evidence }, &found, !state.scatter.is_empty()));
        let held_out = |without_contested: bool| -> f64 {
            // Ripples were chosen with the readings that a fold leaves out: they seem to help there.
            let mut others = pass.candidates.clone();
            for (active, of) in others.active.iter_mut().zip(&others.hypotheses) {
                *active &= !(without_contested && scatter::is_contested(of));
            }
            let outliers = outliers_of(data, &pass, &found);
            let good: Vec<bool> = (0..linear.count()).map(|row| !outliers.rows.contains(&row)).collect();
            let linear = Linear { candidates: &others, ..linear.clone() };
            let validation = Validation { linear: &linear, noise: data.noise, good: &good, best: &[], settings };
            validation.run(&pass.scheme, &pass.products).explained()
        };
        if let Some(scatter) = looked.filter(|scatter| !scatter::alike(scatter, &state.scatter, &settings.scatter)) {
            if state.scatter.is_empty() && plain.is_none() {
                plain = Some((held_out(true), state.clone()));
            }
            state = State { scatter, ..state.after(&pass) };
            (last, looks) = (number + settings.model.passes, looks + 1);
            continue;
        }
        // Scatter has no order: where readings that were not used are predicted worse with it, it took the place of one that there is.
        if let Some((left, without)) = plain.take_if(|_| !state.scatter.is_empty())
            && held_out(false) > settings.scatter.worse * settings.scatter.worse * left
        {
            state = without;
            (last, looks) = (number + 1, settings.scatter.looks);
            continue;
        }
        return Ok((state, pass));
    }
    unreachable!("the loop ends by returning")
}

/// What lies between the members of the likeliest set and their neighbours in the library, but for what is `known`: times at which
/// something happens, and over which it fades.
fn closer(pass: &Pass, known: &[Hypothesis]) -> Vec<Hypothesis> {
    let mut found: Vec<Hypothesis> = Vec::new();
    for (member, _) in &pass.members {
        let of = &pass.candidates.hypotheses[*member];
        for (shape, detail) in of.shape.closer(&pass.conditions.columns) {
            let same = |one: &Hypothesis| one.shape == shape;
            if !known.iter().chain(&found).chain(&pass.candidates.hypotheses).any(same) {
                found.push(Hypothesis { shape, detail, ..of.clone() });
            }
        }
    }
    found
}

/// Readings that are far off beside what was found.
fn outliers_of(data: &Data<'_>, pass: &Pass, found: &Found) -> outliers::Outliers {
    let settings = &data.options.settings.outliers;
    let squares = &pass.weighed.squares;
    let counts = pass.rows.equations.counts();
    let mut outliers = outliers::look(squares, &counts, settings);
    // What play makes of a reading whose side nobody knows says nothing about the sensor.
    let seated = |row: &usize| {
        let undecided =
            |hypothesis: usize| pass.candidates.hypotheses[hypothesis].shape.undecided(&pass.conditions.readings[*row]);
        !found.best.iter().any(|(hypothesis, _)| undecided(*hypothesis))
    };
    let (sure, sure_counts): (Vec<f64>, Vec<usize>) =
        (0..squares.len()).filter(seated).map(|row| (squares[row], counts[row])).unzip();
    if sure.len() < squares.len() && sure.len() as f64 >= settings.decided * data.measurements.len() as f64 {
        let far_off = std::mem::take(&mut outliers.rows);
        outliers = outliers::Outliers { rows: far_off, ..outliers::look(&sure, &sure_counts, settings) };
    }
    outliers
}

/// A data set around its calibrated geometry, ready for the evidence of single effects.
pub struct Singles {
    pass: Pass,
    noise: NoisePrior,
    settings: Settings,
}

impl Singles {
    /// Prepares `measurements` as [`diagnose`] does, around no effect and the geometry's usual prior.
    ///
    /// # Errors
    /// As [`diagnose`].
    pub fn new(arm: &Arm, sensor: &Sensor, measurements: &[&Measurement], options: &Options) -> Result<Singles, DiagnosisError> {
        options.settings.check()?;
        let data = Data::new(arm, sensor, measurements, options);
        let state = State::nominal(&data);
        Ok(Singles {
            pass: Pass::new(&data, &state, options.settings.model.passes)?,
            noise: data.noise,
            settings: options.settings.clone(),
        })
    }

    /// The evidence of every hypothesis alone, at every scale of its prior: geometry taken out, marginal likelihoods.
    #[must_use]
    pub fn evidence(&self) -> Vec<Extension> {
        let linear = self.pass.linear();
        let Some(marginal) = Marginal::new(&self.pass.products, None, &linear.prior) else {
            return Vec::new();
        };
        Evidence { marginal: &marginal, candidates: &self.pass.candidates, noise: self.noise, settings: &self.settings }
            .extensions(&[])
    }
}

/// What is known of the noise: from repeats, from what is said, or, where repeats tell less than that, from both together.
fn noise_prior(repeats: Option<Repeats>, declared_m: f64, source: NoiseSource, settings: &settings::Noise) -> NoisePrior {
    let said = match source {
        NoiseSource::Assumed => settings.assumed_degrees,
        NoiseSource::Declared | NoiseSource::Repeats => settings.declared_degrees,
    };
    let Some(repeats) = repeats else {
        return NoisePrior { degrees_of_freedom: said, level: 1.0 };
    };
    let level = (repeats.position_m / declared_m) * (repeats.position_m / declared_m);
    if repeats.degrees_of_freedom < said {
        let both = said + repeats.degrees_of_freedom;
        return NoisePrior { degrees_of_freedom: both, level: (said + repeats.degrees_of_freedom * level) / both };
    }
    // Without a move between them they say little about the arm.
    let most = if repeats.moved { settings.repeats_degrees } else { settings.unmoved_degrees };
    NoisePrior { degrees_of_freedom: repeats.degrees_of_freedom.min(most), level }
}

/// What members of a set do beyond what geometry absorbs.
pub(crate) struct Moved {
    /// Of each row, which member moves it most.
    most: Vec<Option<usize>>,
    /// Of each place with shapes without a name: the first of these members, how many there are, and the 3-D RMS of what they do to the
    /// positions together, m: where several stand for one cause, they may be far larger than it is.
    unnamed: Vec<(usize, usize, f64)>,
}

fn moved(linear: &Linear<'_>, evidence: &Evidence<'_>, members: &[(usize, usize)]) -> Moved {
    let coefficients = evidence.coefficients(members);
    let seen: Vec<DVector<f64>> = members
        .iter()
        .map(|(hypothesis, _)| {
            let columns = evidence.candidates.columns(*hypothesis);
            let own: Vec<(usize, f64)> = coefficients.iter().copied().filter(|(column, _)| columns.contains(column)).collect();
            let mut absorbed = DVector::zeros(linear.rows.jacobian.ncols());
            for (column, value) in &own {
                absorbed.axpy(*value, &evidence.marginal.absorbed(*column), 1.0);
            }
            linear.made(&own) - &linear.rows.jacobian * absorbed
        })
        .collect();
    let square = |member: usize, row: usize| seen[member].rows_range(linear.rows.equations.of_position(row)).norm_squared();
    let most = |row: usize| (0..members.len()).max_by(|a, b| square(*a, row).total_cmp(&square(*b, row)));
    let hypothesis = |member: usize| &evidence.candidates.hypotheses[members[member].0];
    let mut unnamed: Vec<(usize, usize, f64)> = Vec::new();
    for first in (0..members.len()).filter(|member| hypothesis(*member).kind.is_none()) {
        let beside =
            |member: &usize| hypothesis(*member).kind.is_none() && hypothesis(*member).location == hypothesis(first).location;
        if (0..first).any(|member| beside(&member)) {
            continue;
        }
        let of_place: Vec<usize> = (first..members.len()).filter(beside).collect();
        let together: DVector<f64> = of_place.iter().map(|member| &seen[*member]).sum();
        let sum: f64 =
            (0..linear.count()).map(|row| together.rows_range(linear.rows.equations.of_position(row)).norm_squared()).sum();
        unnamed.push((first, of_place.len(), libm::sqrt(sum / linear.count().max(1) as f64)));
    }
    Moved { most: (0..linear.count()).map(most).collect(), unnamed }
}

/// What is left of each reading, in the measurement frame.
fn residuals(rows: &Rows, measurements: &[&Measurement], before: &DVector<f64>, after: &DVector<f64>) -> Vec<outcome::Residual> {
    (0..measurements.len())
        .map(|row| {
            let part = |of: &DVector<f64>| {
                let [x, y, z, ..] = rows.in_measurement(row, of);
                [x, y, z]
            };
            outcome::Residual {
                row: measurements[row].index,
                position_m: measurements[row].position_m,
                before_m: part(before),
                after_m: part(after),
                cause: None,
            }
        })
        .collect()
}
