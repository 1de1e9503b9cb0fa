//! One blind case: what is public of it, what is hidden, what is measured, and the truth about it.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::folder::ChallengeError;
use crate::design::candidates::{Rules, Sampler};
use crate::design::search::split;
use crate::effects::{Kind, Location, Need};
use crate::event::{Event, Start};
use crate::lab::conditions::course;
use crate::lab::detectability::{difference, geometry_of_cell, has_signal, noiseless, without};
use crate::lab::injection::{is_its_own, places};
use crate::measurement::Measurement;
use crate::progress::{Progress as _, Silent};
use crate::recording::write::Recorder;
use crate::scene::SceneFile;
use crate::seed::{Stream, hidden_key, hidden_stream};
use crate::session::{SessionError, start_event};
use crate::simulation::cell::measure;
use crate::simulation::cell::plan::{Planned, plan};
use crate::simulation::effect::Effect;
use crate::simulation::injected::{Injected, Noise};
use crate::simulation::plan::Temperature;

/// Half width of the errors of length parameters, m, and of angle parameters, rad.
pub(super) const PARAMETER_ERRORS: [f64; 2] = [1e-3, 0.2 * std::f64::consts::PI / 180.0];
/// Heavy tails: so many of the readings have a noise so many times the declared one.
const TAILS: Tails = Tails { share: 0.05, factor: 5.0 };
/// Noise that is larger than declared is so many times as large.
const UNDERSTATED: f64 = 1.3;
/// Course of the temperature.
const COURSE: &str = "heat-and-cool";
/// Payloads that take turns, kg.
const PAYLOADS_KG: [f64; 2] = [0.0, 4.0];

/// How cases are drawn.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Options {
    /// Number of cases.
    pub cases: usize,
    /// Names of the effects to draw from.
    pub kinds: Vec<String>,
    /// Fewest and most effects of a case.
    pub effects: [usize; 2],
    /// Share of cases without an effect; absent: every number of effects is as likely.
    pub base_rate: Option<f64>,
    /// Declared position noises to draw from, one sigma per axis, m.
    pub noise_m: Vec<f64>,
    /// Share of cases whose noise has heavy tails.
    pub heavy_tails: f64,
    /// Share of cases whose noise is 1.3 times what is declared.
    pub understated: f64,
    /// Readings of a case.
    pub poses: usize,
    /// Of them, those that repeat a configuration.
    pub repeats: usize,
    /// Kinds that whoever diagnoses is not to use: they count as unknown ones.
    pub withheld: Vec<String>,
    /// Effects outside the analyser's library beside those drawn from `kinds`.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub outside: usize,
    /// Magnitudes up to those of hobby and cable-driven arms ([`Descriptor::softest`](crate::effects::Descriptor::softest)).
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub soft: bool,
    /// The arm comes to each configuration straight from the one before, so that lengths of moves are known.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub direct: bool,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks for it so")]
fn is_zero(number: &usize) -> bool {
    *number == 0
}

impl Options {
    /// One case without an effect, with noise as declared (m), of so many readings, of which so many repeat another.
    #[must_use]
    pub fn quiet(noise_m: f64, poses: usize, repeats: usize) -> Options {
        Options {
            cases: 1,
            kinds: Vec::new(),
            effects: [0, 0],
            base_rate: None,
            noise_m: vec![noise_m],
            heavy_tails: 0.0,
            understated: 0.0,
            poses,
            repeats,
            withheld: Vec::new(),
            outside: 0,
            soft: false,
            direct: false,
        }
    }
}

/// Heavy tails of the noise.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tails {
    /// Of the readings.
    pub share: f64,
    /// Their noise over the declared one.
    pub factor: f64,
}

/// The truth about a case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CaseTruth {
    /// File of the case.
    pub file: String,
    /// What is wrong; empty where nothing is.
    pub effects: Vec<TrueEffect>,
    /// The noise.
    pub noise: TrueNoise,
    /// ‖P⊥ s‖²/σ² of all effects together; absent where nothing could be seen.
    pub lambda: Option<f64>,
    /// From the start to the last reading, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub session_s: Option<f64>,
    /// Name, true value (SI) of every parameter.
    pub parameters: Vec<(String, f64)>,
    /// Key of the hidden draws.
    pub key: String,
}

/// An effect of a case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrueEffect {
    /// Name.
    pub kind: String,
    /// Whether the analyser may know it.
    pub known: bool,
    /// Where.
    pub location: Location,
    /// SI, positive.
    pub magnitude: f64,
    /// Of the magnitude.
    pub unit: String,
    /// ‖P⊥ s‖²/σ² of this effect, the others present; absent for outliers, which are noise.
    pub lambda: Option<f64>,
    /// ‖s‖²/σ².
    pub signal: Option<f64>,
    /// Share of the session after which a step happens.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub after: Option<f64>,
    /// Everything that it is.
    pub detail: String,
}

/// The noise of a case.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrueNoise {
    /// Declared, one sigma per axis, m.
    pub declared_m: f64,
    /// True over declared.
    pub factor: f64,
    /// Heavy tails.
    pub tails: Option<Tails>,
}

/// What a cell would tell about itself, and what it was told to measure.
pub struct Public {
    /// The scene without anything injected.
    pub file: SceneFile,
    /// The readings to be taken.
    pub planned: Vec<Planned>,
}

/// What is hidden of a case.
pub struct Hidden {
    /// For the cell.
    pub injected: Injected,
    /// Kinds of the effects, in their order; heavy tails of the noise are none of them.
    pub kinds: Vec<Kind>,
    /// The noise.
    pub noise: TrueNoise,
}

/// The name of case `index` (from 0): it tells nothing.
#[must_use]
pub fn name(index: usize) -> String {
    format!("case-{:04}", index + 1)
}

/// The key of a challenge: everything in it is drawn from this.
#[must_use]
pub fn key(seed: u64) -> [u8; 32] {
    hidden_key("kincal challenge 1", seed)
}

fn stream(key: &[u8; 32], what: &str, index: usize) -> Stream {
    hidden_stream(key, &format!("challenge/{what}/{index}"))
}

/// Draws what is public of case `index`. Nothing hidden goes in here.
///
/// # Errors
/// If `base` cannot be changed as options ask, or no configuration may be measured.
pub fn public(base: &SceneFile, options: &Options, key: &[u8; 32], index: usize) -> Result<Public, ChallengeError> {
    let mut stream = stream(key, "public", index);
    let declared_m = options.noise_m[stream.index(options.noise_m.len())];
    let mut file = base.clone();
    file.set("name", &format!("\"{}\"", name(index)))?;
    file.set("description", "\"A cell whose fault is sought.\"")?;
    // A public seed that tells nothing of the challenge's.
    file.set_seed((stream.unit() * 9e15) as u64)?;
    let configurations = options.poses - options.repeats;
    file.set_count(configurations)?;
    file.set("sensor.position_noise_um", &(declared_m * 1e6).to_string())?;
    file.set("sensor.position_noise_um_per_m", "0")?;
    conditions(&mut file, options)?;
    let scene = &file.scene;
    let rules = Rules::measurable(&scene.arm, &scene.sensor);
    let drawn = Sampler::new(&rules).draw(&mut stream, configurations).map_err(SessionError::from)?;
    let chosen = split(&drawn, scene.arm.joint_count());
    let mut planned = thinned(plan(&scene.cell(), &chosen, &[]), options.repeats, scene.plan.seconds_per_pose);
    if options.direct {
        // Straight from the reading before among those that are left.
        for row in 1..planned.len() {
            planned[row].from = planned[row - 1].joints.clone();
        }
    }
    Ok(Public { file, planned })
}

/// Random approach, heat and cool with a lag for each link, payloads that take turns, two readings of some configurations: whatever
/// the scene's own plan is.
fn conditions(file: &mut SceneFile, options: &Options) -> Result<(), ChallengeError> {
    let session_s = options.poses as f64 * file.scene.plan.seconds_per_pose;
    file.set("plan.approach", if options.direct { "\"direct\"" } else { "\"random\"" })?;
    file.set("plan.payloads_kg", &format!("{PAYLOADS_KG:?}"))?;
    file.set("plan.payload_blocks", "false")?;
    file.set("plan.repeats", if options.repeats > 0 { "2" } else { "1" })?;
    if let Some(Temperature { rise_k, lag_s, ambient_rise_k, .. }) = course(COURSE, &file.scene.arm, session_s) {
        let course =
            format!("{{ profile = \"{COURSE}\", rise_k = {rise_k:?}, lag_s = {lag_s:?}, ambient_rise_k = {ambient_rise_k:?} }}");
        file.set("plan.temperature", &course)?;
    }
    Ok(())
}

/// The plan with the second readings of the first `repeats` configurations only, at the pace of the session.
fn thinned(planned: Vec<Planned>, repeats: usize, seconds_per_pose: f64) -> Vec<Planned> {
    let mut seen = std::collections::BTreeSet::new();
    let kept = planned.into_iter().filter(|planned| seen.insert(planned.pose_id) || planned.pose_id < repeats);
    kept.enumerate().map(|(row, planned)| Planned { time_s: row as f64 * seconds_per_pose, ..planned }).collect()
}

/// Draws what is hidden of case `index`.
#[must_use]
pub fn hidden(public: &Public, options: &Options, key: &[u8; 32], index: usize) -> Hidden {
    let mut stream = stream(key, "hidden", index);
    let mut key_of_case = String::new();
    for _ in 0..4 {
        key_of_case.push_str(&format!("{:013x}", (stream.unit() * (1u64 << 52) as f64) as u64));
    }
    let [fewest, most] = options.effects;
    let without_effect = options.base_rate.is_some_and(|rate| stream.unit() < rate);
    let fewest = if options.base_rate.is_some() { fewest.max(1) } else { fewest };
    let count = if without_effect { 0 } else { fewest + stream.index(most.max(fewest) - fewest + 1) };
    let which = stream.unit();
    let arm = &public.file.scene.arm;
    let mut choice: Vec<Kind> = options.kinds.iter().filter_map(|name| Kind::from_name(name)).collect();
    // What hangs on the length of the last move looks like play where the arm always comes over a point beside.
    choice.retain(|kind| options.direct || !kind.descriptor().needs.contains(&Need::Moves));
    if choice.len() > 1 {
        choice.retain(|kind| is_its_own(*kind, arm));
    }
    let (mut kinds, mut effects): (Vec<Kind>, Vec<Effect>) = (Vec::new(), Vec::new());
    let foreign: Vec<Kind> = Kind::foreign().collect();
    while effects.len() < count + options.outside {
        // Those outside the library come last.
        let choice = if effects.len() < count { &choice } else { &foreign };
        let kind = choice[stream.index(choice.len())];
        let places = places(kind, arm);
        let place = places[stream.index(places.len())];
        let [low, high] = kind.range(place, arm.joint_count());
        let high = if options.soft { high * kind.descriptor().softest } else { high };
        let magnitude = low * libm::pow(high / low, stream.unit());
        let effect = Effect::drawn(kind, place, magnitude, arm, &mut stream);
        // The same twice would be one of another size; there may be too few others.
        let there = |other: &Effect| other.name() == effect.name() && other.location() == effect.location();
        let others = choice.iter().map(|kind| self::places(*kind, arm).len()).sum::<usize>();
        if !effects.iter().any(there) || effects.len() >= others {
            kinds.push(kind);
            effects.push(effect);
        }
    }
    let factor =
        if (options.heavy_tails..options.heavy_tails + options.understated).contains(&which) { UNDERSTATED } else { 1.0 };
    let tails = (which < options.heavy_tails).then_some(TAILS);
    if let Some(Tails { share, factor }) = tails {
        effects.push(Effect::MeasurementOutliers { share, factor });
    }
    let injected = Injected {
        seed: key_of_case,
        length_error_m: PARAMETER_ERRORS[0],
        angle_error_rad: PARAMETER_ERRORS[1],
        parameter_errors: Vec::new(),
        effects,
        noise: Noise::Declared { factor },
    };
    let declared_m = public.file.scene.sensor.position_sigma_m;
    Hidden { injected, kinds, noise: TrueNoise { declared_m, factor, tails } }
}

/// Measures the case, and finds how much of its effects can be seen.
///
/// # Errors
/// If the arm cannot be simulated.
pub fn measured(public: &Public, hidden: &Hidden, index: usize) -> Result<(Vec<Measurement>, CaseTruth), ChallengeError> {
    let (scene, planned, injected) = (&public.file.scene, &public.planned, &hidden.injected);
    let (measurements, truth) =
        measure(&scene.cell(), injected, planned, planned.len(), &mut Silent).map_err(SessionError::from)?;
    let values: Vec<f64> = truth.parameters.iter().map(|parameter| parameter.true_value).collect();
    let mut effects: Vec<TrueEffect> = hidden
        .kinds
        .iter()
        .zip(&injected.effects)
        .map(|(kind, effect)| TrueEffect {
            kind: kind.name().to_owned(),
            known: kind.descriptor().known.is_some(),
            location: effect.location(),
            magnitude: effect.magnitude(Some(*kind)),
            unit: kind.unit().to_owned(),
            lambda: None,
            signal: None,
            after: effect.described().value("after"),
            detail: format!("{effect:?}"),
        })
        .collect();
    let mut lambda = None;
    if hidden.kinds.iter().zip(&injected.effects).any(|(_, effect)| has_signal(effect)) {
        let joints: Vec<&[f64]> = planned.iter().map(|planned| planned.joints.as_slice()).collect();
        let geometry = geometry_of_cell(&scene.arm, &values, &scene.sensor, &joints);
        let poses = |injected: &Injected| noiseless(scene, injected, planned).map_err(SessionError::from);
        let all = poses(injected)?;
        let none = poses(&Injected { effects: Vec::new(), ..injected.clone() })?;
        lambda = Some(geometry.surviving(&difference(&all, &none)).lambda);
        for (position, effect) in effects.iter_mut().enumerate() {
            if has_signal(&injected.effects[position]) {
                let other = if hidden.kinds.len() == 1 { none.clone() } else { poses(&without(injected, position))? };
                let surviving = geometry.surviving(&difference(&all, &other));
                (effect.lambda, effect.signal) = (Some(surviving.lambda), Some(surviving.signal));
            }
        }
    }
    let parameters = truth.parameters.into_iter().map(|parameter| (parameter.name, parameter.true_value)).collect();
    let truth = CaseTruth {
        file: format!("{}.mcap", name(index)),
        effects,
        noise: hidden.noise,
        lambda,
        session_s: planned.last().map(|last| last.time_s),
        parameters,
        key: injected.seed.clone(),
    };
    Ok((measurements, truth))
}

/// Writes the recording of case `index` into `folder`: from what is public and from the measurements, and from nothing else.
///
/// # Errors
/// If it cannot be written.
pub fn write(folder: &Path, index: usize, public: &Public, measurements: &[Measurement]) -> Result<PathBuf, ChallengeError> {
    let mut recorder = Recorder::create(folder, &name(index), &public.file.scene.arm)?.sources_only();
    let poses = Some(measurements.len());
    recorder
        .report(&Event::Start(Start { poses, ..start_event("measure", &public.file.public_toml()?) }))
        .map_err(SessionError::from)?;
    for measurement in measurements {
        recorder.report(&Event::Measured(measurement.clone())).map_err(SessionError::from)?;
    }
    Ok(recorder.finish()?)
}
