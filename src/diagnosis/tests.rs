//! The diagnosis of arms whose fault is known, made by other means than the signatures: joint angles that are off, with torques from
//! the slope of the potential energy.

use nalgebra::{Cholesky, DMatrix, DVector, UnitQuaternion, Vector3};

use super::conclusion::{Trend, Variable};
use super::held_out::{Fold, used};
use super::outcome::{Diagnosis, NoiseSource, Verdict};
use super::search::Belief;
use super::{Options, diagnose};
use crate::arm::Arm;
use crate::effects::Kind;
use crate::effects::signature::library::Hypothesis;
use crate::effects::signature::posture::Mechanism;
use crate::measurement::{Measurement, Sensor};
use crate::recording::schema::{check, json_schema};
use crate::report::wording;
use crate::scene;
use crate::seed::{Stream, stream};

pub(crate) const SIGMA: f64 = 20e-6;
const ORIENTATION_SIGMA: f64 = 2e-5;

fn arm() -> Arm {
    scene::read(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/arm8.toml")).unwrap().scene.arm
}

pub(crate) fn sensor() -> Sensor {
    Sensor {
        position_in_base: nalgebra::Point3::origin(),
        position_sigma_m: SIGMA,
        position_sigma_per_m: 0.0,
        orientation_sigma_rad: None,
        temperature_sigma_k: None,
        distances: Vec::new(),
        view: None,
    }
}

/// Energy of the arm in the field of gravity, J.
fn energy(arm: &Arm, joints: &[f64], payload_kg: f64) -> f64 {
    let at = arm.chain.at_nominal();
    let names = arm.chain.frame_names();
    let frames = at.frames(joints);
    let mut moment = at.forward(joints).translation.vector * payload_kg;
    for link in &arm.links[1..] {
        let inertial = link.inertial.as_ref().unwrap();
        let frame = names.iter().position(|name| *name == link.name).unwrap();
        moment += (frames[frame] * inertial.centre_of_mass_in_link).coords * inertial.mass_kg;
    }
    -arm.gravity_in_base.dot(&moment)
}

pub(crate) fn torque(arm: &Arm, joints: &[f64], joint: usize, payload_kg: f64) -> f64 {
    let at = |shift: f64| {
        let mut moved = joints.to_vec();
        moved[joint] += shift;
        energy(arm, &moved, payload_kg)
    };
    -(at(1e-5) - at(-1e-5)) / 2e-5
}

pub(crate) fn readings(label: &str, off: impl Fn(&Arm, &[f64], &[i8], usize, f64) -> f64) -> (Arm, Vec<Measurement>) {
    let arm = arm();
    let (mut stream, mut turns): (Stream, Stream) = (stream(5, label), stream(6, label));
    let mut values = arm.chain.nominal();
    for (value, parameter) in values.iter_mut().zip(&arm.chain.parameters) {
        let half = if parameter.quantity.unit() == "m" { 1e-3 } else { 3e-3 };
        *value += stream.uniform(-half, half);
    }
    let at = arm.chain.at(&values);
    let rows = (0..60)
        .map(|index| {
            let joints: Vec<f64> = arm.chain.joints.iter().map(|joint| stream.uniform(joint.lower, joint.upper)).collect();
            let approach: Vec<i8> = joints.iter().map(|_| if stream.unit() < 0.5 { -1 } else { 1 }).collect();
            let payload_kg = if index % 2 == 0 { 0.0 } else { 4.0 };
            let true_joints: Vec<f64> =
                (0..joints.len()).map(|joint| joints[joint] + off(&arm, &joints, &approach, joint, payload_kg)).collect();
            let noise = Vector3::from_fn(|_, _| SIGMA * stream.normal());
            let pose = at.forward(&true_joints);
            let position = pose.translation.vector + noise;
            // Read only where the sensor has orientations.
            let turn = Vector3::from_fn(|_, _| ORIENTATION_SIGMA * turns.normal());
            let orientation = pose.rotation * UnitQuaternion::from_scaled_axis(turn);
            Measurement {
                index,
                pose_id: index,
                time_s: 60.0 * index as f64,
                joints,
                position_m: position.into(),
                orientation_xyzw: Some(orientation.coords.into()),
                approach,
                payload_kg: Some(payload_kg),
                ..Measurement::default()
            }
        })
        .collect();
    (arm, rows)
}

/// An analysis of readings whose joint angles are `off`, in which nothing is found yet: a test changes in it what it asks about.
pub(crate) fn with_analysis(off: impl Fn(&Arm, &[f64], &[i8], usize, f64) -> f64, ask: impl FnOnce(super::Analysis<'_>)) {
    let (arm, rows) = readings("test/analysis", off);
    let rows: Vec<&Measurement> = rows.iter().collect();
    let (options, sensor) = (Options::new(NoiseSource::Declared), sensor());
    let data = super::Data::new(&arm, &sensor, &rows, &options);
    let pass = super::Pass::new(&data, &super::State::nominal(&data), options.settings.model.passes).unwrap();
    let linear = pass.linear();
    let marginal = super::Marginal::new(&pass.products, None, &linear.prior).unwrap();
    let evidence =
        super::Evidence { marginal: &marginal, candidates: &pass.candidates, noise: data.noise, settings: &options.settings };
    let nothing = DVector::zeros(linear.residual.len());
    ask(super::Analysis {
        moved: super::moved(&linear, &evidence, &[]),
        residuals: super::residuals(&pass.rows, &rows, &nothing, &nothing),
        maps: Vec::new(),
        linear: &linear,
        conditions: &pass.conditions,
        evidence,
        found: super::Found::default(),
        held_out: Vec::new(),
        structure: super::open_set::Structure {
            p_value: 0.5,
            strongest: Trend { along: None, follows: Variable::Time },
            strength: 0.0,
        },
        outliers: super::outliers::Outliers { probability: 0.0, share: 0.0, share_ci95: [0.0; 2], factor: 1.0, rows: Vec::new() },
        left: 1.0,
        scatter: Vec::new(),
        orientation: 1.0,
        measurements: &rows,
        sensor: &sensor,
        repeats: None,
        correlation: None,
        astray: false,
        gravity: None,
        options: &options,
    });
}

/// The first hypothesis of `kind` at joint or link number `index`.
pub(crate) fn hypothesis(analysis: &super::Analysis<'_>, kind: Option<Kind>, index: usize) -> usize {
    let is = |of: &Hypothesis| of.kind == kind && of.location.index == Some(index);
    analysis.evidence.candidates.hypotheses.iter().position(is).unwrap()
}

/// A belief in it.
pub(crate) fn belief(analysis: &super::Analysis<'_>, kind: Option<Kind>, index: usize, probability: f64) -> Belief {
    let hypothesis = hypothesis(analysis, kind, index);
    let of = &analysis.evidence.candidates.hypotheses[hypothesis];
    Belief { claim: (of.kind, of.location), hypothesis, probability }
}

/// A fold of ten readings with these sums of squares, for which `chosen` was chosen.
pub(crate) fn fold_of([nominal, geometry, explained]: [f64; 3], with_best: &[f64], chosen: Vec<usize>) -> Fold {
    Fold {
        name: String::new(),
        rows: 10,
        nominal,
        geometry,
        with_best: with_best.to_vec(),
        explained,
        with_chosen: vec![explained; chosen.len()],
        used: chosen.len(),
        chosen,
    }
}

pub(crate) fn diagnosed(arm: &Arm, rows: &[Measurement], without: Vec<Kind>) -> Diagnosis {
    let rows: Vec<&Measurement> = rows.iter().collect();
    wording::diagnosis(diagnose(arm, &sensor(), &rows, &Options { without, ..Options::new(NoiseSource::Declared) }).unwrap())
}

#[test]
fn torques_are_the_slope_of_the_energy() {
    let arm = arm();
    let mechanism = Mechanism::new(&arm);
    let mut stream = stream(2, "test/torque");
    for _ in 0..20 {
        let joints: Vec<f64> = (0..8).map(|_| stream.uniform(-2.0, 2.0)).collect();
        let posture = mechanism.posture(&joints, 3.0);
        for joint in 0..8 {
            let expected = torque(&arm, &joints, joint, 3.0);
            assert!((posture.torque(joint) - expected).abs() < 1e-4, "{} against {expected}", posture.torque(joint));
        }
        let tool = arm.chain.at_nominal().forward(&joints).translation.vector;
        assert!((posture.tool - tool).norm() < 1e-12);
    }
}

#[test]
fn an_arm_without_a_fault_has_no_gap() {
    let (arm, rows) = readings("test/nothing", |_, _, _, _, _| 0.0);
    let found = diagnosed(&arm, &rows, Vec::new());
    assert!(matches!(found.verdict, Verdict::NoGap | Verdict::NotDetectable), "{}", found.sentence);
    assert!(found.effects.is_empty() && !found.unknown.present);
    // Held-out poses carry the noise and what the fit makes of it.
    assert!((SIGMA..5.0 * SIGMA).contains(&found.gap.geometry_rms_m), "{}", found.gap.geometry_rms_m);
    assert!(found.gap.nominal_rms_m > 1e-3);
}

#[test]
fn backlash_and_compliance_are_named_with_place_and_size() {
    let width = 4e-4;
    let compliance = 5e-5;
    let (arm, rows) = readings("test/two", |arm, joints, approach, joint, payload_kg| match joint {
        2 => 0.5 * width * f64::from(approach[2]),
        3 => compliance * torque(arm, joints, 3, payload_kg),
        _ => 0.0,
    });
    let found = diagnosed(&arm, &rows, Vec::new());
    assert_eq!(found.verdict, Verdict::Explained, "{}", found.sentence);
    assert_eq!(found.effects.len(), 2, "{}", found.sentence);
    for (kind, index, size) in [(Kind::Backlash, 3, width), (Kind::JointCompliance, 4, compliance)] {
        let effect = found.effects.iter().find(|effect| effect.kind == kind).unwrap();
        assert_eq!(effect.location.index, Some(index));
        assert!((effect.magnitude.value / size - 1.0).abs() < 0.15, "{kind}: {} against {size}", effect.magnitude.value);
        assert!(effect.held_out_rms_after_m < effect.held_out_rms_before_m);
    }
    assert!(found.gap.gap_closed.unwrap() > 0.8, "{:?}", found.gap);
}

#[test]
fn a_fault_that_has_no_name_is_unknown() {
    let (arm, rows) = readings("test/sector", |_, joints, _, joint, _| {
        let off = (joints[joint] - 0.4).abs() / 0.5;
        if joint == 3 && off < 1.0 { 8e-4 * (1.0 - off * off) } else { 0.0 }
    });
    let found = diagnosed(&arm, &rows, Vec::new());
    assert_eq!(found.verdict, Verdict::UnknownRemains, "{}", found.sentence);
    assert!(found.unknown.r#where.unwrap().contains("joint 4"));
}

#[test]
fn a_joint_that_does_not_repeat_is_no_ripple() {
    // Backlash whose side nobody recorded.
    let (arm, mut rows) =
        readings("test/scatter", |_, _, approach, joint, _| if joint == 3 { 2e-4 * f64::from(approach[3]) } else { 0.0 });
    for row in &mut rows {
        row.approach.clear();
    }
    let found = diagnosed(&arm, &rows, Vec::new());
    assert_eq!(found.verdict, Verdict::UnknownRemains, "{}", found.sentence);
    let place = found.unknown.r#where.unwrap_or_default();
    assert!(found.effects.is_empty() && place.starts_with("joint 4 does not repeat"), "{}", found.sentence);
    assert!(found.next_measurements.iter().any(|advice| advice.contains("joint 4")), "{:?}", found.next_measurements);
}

#[test]
fn orientations_that_are_better_than_said_are_no_effect() {
    let (arm, rows) = readings("test/attitudes", |_, _, _, _, _| 0.0);
    let sensor = Sensor { orientation_sigma_rad: Some(4.5 * ORIENTATION_SIGMA), ..sensor() };
    let rows: Vec<&Measurement> = rows.iter().collect();
    let options = Options { without: Vec::new(), ..Options::new(NoiseSource::Declared) };
    let found = wording::diagnosis(diagnose(&arm, &sensor, &rows, &options).unwrap());
    assert!(found.effects.is_empty() && !found.unknown.present, "{}", found.sentence);
    let sigma = found.noise_floor.rotation_rad.unwrap();
    assert!((sigma / ORIENTATION_SIGMA - 1.0).abs() < 0.25, "{sigma}");
    assert!(found.notes.iter().any(|note| note.contains("orientations are taken to be read")), "{:?}", found.notes);
}

#[test]
fn too_few_readings_are_refused_and_swapped_joints_are_said() {
    let (arm, mut rows) = readings("test/bad", |_, _, _, _, _| 0.0);
    let options = Options::new(NoiseSource::Declared);
    let few: Vec<&Measurement> = rows[..5].iter().collect();
    assert!(diagnose(&arm, &sensor(), &few, &options).unwrap_err().to_string().contains("at least 6"));
    let same = rows[0].clone();
    let alike: Vec<&Measurement> = (0..20).map(|_| &same).collect();
    assert!(diagnose(&arm, &sensor(), &alike, &options).is_err());
    for row in &mut rows {
        row.joints.swap(1, 2);
    }
    let swapped: Vec<&Measurement> = rows.iter().collect();
    let message = diagnose(&arm, &sensor(), &swapped, &options).unwrap_err().to_string();
    assert!(message.contains("order:1,3,2,4,5,6,7,8"), "{message}");
}

#[test]
fn what_is_said_is_as_the_schema_has_it() {
    let schema = json_schema::<Diagnosis>("kincal diagnose --json");
    let (arm, rows) =
        readings("test/schema", |_, _, approach, joint, _| if joint == 4 { 2e-4 * f64::from(approach[4]) } else { 0.0 });
    let mut value = serde_json::to_value(diagnosed(&arm, &rows, Vec::new())).unwrap();
    check(&schema, &value).unwrap();
    assert!(!value["effects"].as_array().unwrap().is_empty() && !value["undetectable"].as_array().unwrap().is_empty());
    // The check can fail.
    value["effects"][0]["kind"] = "gremlins".into();
    assert!(check(&schema, &value).unwrap_err().contains("/effects/0/kind"));
}

#[test]
fn several_targets_of_a_pose_do_not_make_it_surer() {
    // Each visit has an error of its own that its three targets share: nothing that a kind of effect makes.
    let (arm, rows) = readings("test/targets", |_, _, _, _, _| 0.0);
    let mut shared = stream(7, "test/shared");
    let mut sensor_noise = stream(8, "test/noise");
    // The true arm of these readings, drawn as there.
    let mut draws: Stream = stream(5, "test/targets");
    let mut values = arm.chain.nominal();
    for (value, parameter) in values.iter_mut().zip(&arm.chain.parameters) {
        let half = if parameter.quantity.unit() == "m" { 1e-3 } else { 3e-3 };
        *value += draws.uniform(-half, half);
    }
    let at = arm.chain.at(&values);
    let offsets = [Vector3::zeros(), Vector3::new(0.1, 0.0, 0.02), Vector3::new(-0.04, 0.09, 0.0)];
    let mut read = Vec::new();
    for row in &rows {
        let error = Vector3::from_fn(|_, _| 3.0 * SIGMA * shared.normal());
        for (target, offset) in offsets.iter().enumerate() {
            let lever = at.forward(&row.joints).rotation * offset;
            let noise = Vector3::from_fn(|_, _| SIGMA * sensor_noise.normal());
            let position = Vector3::from(row.position_m) + lever + error + noise;
            read.push(Measurement {
                index: read.len(),
                position_m: position.into(),
                target: Some(format!("T{target}")),
                ..row.clone()
            });
        }
    }
    let found = diagnosed(&arm, &read, Vec::new());
    assert!(found.effects.is_empty(), "{}", found.sentence);
    assert!(found.unknown.p_value > 0.003, "{:?}", found.unknown);
    assert!(found.notes.iter().any(|note| note.contains("weighted down")), "{:?}", found.notes);
}

#[test]
fn sessions_with_bases_of_their_own_are_no_step() {
    let (arm, mut rows) = readings("test/sessions", |_, _, _, _, _| 0.0);
    let moved = nalgebra::Isometry3::new(Vector3::new(0.4, -0.2, 0.05), Vector3::new(0.02, 0.0, 0.3));
    for row in &mut rows {
        let second = row.index >= 25;
        row.session = Some(if second { "b" } else { "a" }.to_owned());
        if second {
            row.position_m = (moved * row.position()).coords.into();
        }
    }
    let found = diagnosed(&arm, &rows, Vec::new());
    assert!(found.effects.is_empty() && !found.unknown.present, "{}", found.sentence);
    assert!(found.notes.iter().any(|note| note.contains("bases of their own")), "{:?}", found.notes);
    let by_session = found.gap.blocked.iter().find(|blocked| blocked.by == super::held_out::Block::Session).unwrap();
    assert_eq!(by_session.left_out.iter().map(|one| one.readings).collect::<Vec<_>>(), [25, 35]);
    // Where the base stays, one is fitted.
    let (arm, mut rows) = readings("test/sessions", |_, _, _, _, _| 0.0);
    rows.iter_mut().for_each(|row| row.session = Some(if row.index >= 25 { "b" } else { "a" }.to_owned()));
    let found = diagnosed(&arm, &rows, Vec::new());
    assert!(found.notes.iter().any(|note| note.contains("share one base")), "{:?}", found.notes);
}

#[test]
fn a_fold_uses_what_helped_the_others() {
    // Squares with geometry alone, and with one effect and two.
    let fold = |[geometry, one, two]: [f64; 3]| Fold {
        name: String::new(),
        rows: 10,
        nominal: 100.0,
        geometry,
        with_best: vec![one],
        explained: geometry,
        with_chosen: vec![one, two],
        chosen: vec![3, 5],
        used: 0,
    };
    let with = |squares: &[[f64; 3]]| -> Vec<usize> {
        let folds: Vec<Fold> = squares.iter().map(|squares| fold(*squares)).collect();
        (0..folds.len()).map(|number| used(&folds, number, &super::settings::Validation::default())).collect()
    };
    // Both help everywhere.
    assert_eq!(with(&[[9.0, 5.0, 4.0], [8.0, 4.0, 3.0], [9.0, 6.0, 5.0], [7.0, 4.0, 2.0]]), [2; 4]);
    // The second makes worse what geometry leaves; so do both.
    assert_eq!(with(&[[9.0, 8.0, 12.0], [8.0, 7.5, 11.0], [9.0, 9.0, 13.0], [7.0, 6.0, 9.5]]), [1; 4]);
    assert_eq!(with(&[[9.0, 10.0, 12.0], [8.0, 9.5, 11.0], [9.0, 11.0, 13.0], [7.0, 9.0, 9.5]]), [0; 4]);
    // What one fold loses counts against the gains of the others, to the fold itself its own loss says nothing.
    assert_eq!(with(&[[9.0, 8.0, 7.0], [8.0, 7.0, 6.0], [9.0, 8.0, 16.0], [7.0, 6.0, 6.0]]), [1, 1, 2, 1]);
    // However wild a fold goes, the guard fires.
    assert_eq!(with(&[[9.0, 5.0, 4.0], [8.0, 4.0, 3.0], [9.0, 6.0, 5.0], [7.0, 4.0, 2.0], [7.0, 4.0, 1e9]]), [1, 1, 1, 1, 2]);
    // Two folds cannot tell.
    assert_eq!(with(&[[9.0, 10.0, 12.0], [8.0, 9.5, 11.0]]), [2; 2]);
    assert!(fold([9.0, 10.0, 12.0]).with(1) == 10.0 && fold([9.0, 10.0, 12.0]).with(0) == 9.0);
}

#[test]
fn what_a_table_got_wrong_is_named() {
    let (arm, rows) = readings("test/mistakes", |_, _, _, _, _| 0.0);
    let says = |change: &dyn Fn(&mut Measurement), expected: &str| {
        let mut rows = rows.clone();
        rows.iter_mut().for_each(change);
        let rows: Vec<&Measurement> = rows.iter().collect();
        let options = Options::new(NoiseSource::Declared);
        let error = diagnose(&arm, &sensor(), &rows, &options).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    };
    says(&|row| row.joints.swap(3, 5), "--fix-columns order:1,2,3,6,5,4,7,8");
    says(&|row| row.joints[4] = -row.joints[4], "--fix-columns reverse:5");
    says(&|row| row.joints[3] = 0.3, "never change: was the arm");
    says(&|row| row.joints.iter_mut().for_each(|joint| *joint *= 57.295_779_5), "--fix-columns angles:deg");
    says(&|row| row.position_m = row.position_m.map(|value| value * 1e-3), "--fix-columns positions:1000");
    says(&|row| row.joints = vec![0.1; 8], "1 different configurations");
}

/// Everything that evidence is made of, against the whole system solved at once.
#[test]
fn what_survives_of_the_geometry_is_that_of_the_whole_system() {
    let (arm, rows) =
        readings("test/singles", |_, _, approach, joint, _| if joint == 2 { -2e-4 * f64::from(approach[2]) } else { 0.0 });
    let rows: Vec<&Measurement> = rows.iter().collect();
    let (options, sensor) = (Options::new(NoiseSource::Declared), sensor());
    let data = super::Data::new(&arm, &sensor, &rows, &options);
    let state = super::State { scale: 0.3, ..super::State::nominal(&data) };
    let pass = super::Pass::new(&data, &state, options.settings.model.passes).unwrap();
    let linear = pass.linear();
    let out = 1;
    let marginal = super::Marginal::new(&pass.products, Some(out), &linear.prior).unwrap();
    let kept: Vec<usize> = (0..rows.len()).filter(|row| pass.scheme.fold[*row] != out).collect();
    let geometry = pass.rows.jacobian.ncols();
    let active: Vec<usize> = (0..pass.candidates.hypotheses.len()).filter(|number| pass.candidates.active[*number]).collect();
    let chosen = [(active[2], 1), (active[40], 0), (active[130], 2)];
    let columns: Vec<usize> = chosen.iter().flat_map(|(member, _)| pass.candidates.columns(*member)).collect();
    // [geometry | signatures | residual], then the geometry's prior as rows of its own.
    let mut whole = DMatrix::zeros(3 * rows.len(), geometry + columns.len() + 1);
    whole.columns_mut(0, geometry).copy_from(&pass.rows.jacobian);
    for (at, column) in columns.iter().enumerate() {
        whole.set_column(geometry + at, &linear.made(&[(*column, 1.0)]));
    }
    whole.set_column(geometry + columns.len(), &linear.residual);
    let mut whole = pass.rows.whitening.of_rows(&whole, &kept);
    let first = whole.nrows();
    whole = whole.insert_rows(first, geometry, 0.0);
    for parameter in 0..geometry {
        let sigma = if linear.prior.free[parameter] { 1.0 } else { 0.3 };
        whole[(first + parameter, parameter)] = 1.0 / sigma;
        whole[(first + parameter, geometry + columns.len())] = -linear.prior.offset[parameter] / sigma;
    }
    let jacobian = whole.columns(0, geometry).into_owned();
    let rest = whole.columns(geometry, columns.len() + 1).into_owned();
    let normal = Cholesky::new(jacobian.transpose() * &jacobian).unwrap();
    let left = &rest - &jacobian * normal.solve(&(jacobian.transpose() * &rest));
    let products = left.transpose() * &left;
    let near = |a: f64, b: f64, size: f64| assert!((a - b).abs() < 1e-8 * size, "{a} {b}");
    let last = columns.len();
    for (i, column) in columns.iter().enumerate() {
        let size = products[(i, i)].max(1e-9);
        for (j, other) in columns.iter().enumerate() {
            near(marginal.row(*column)[*other], products[(i, j)], libm::sqrt(size * products[(j, j)].max(1e-9)) * 10.0);
        }
        near(marginal.with_residual[*column], products[(i, last)], libm::sqrt(size * products[(last, last)]) * 10.0);
    }
    near(marginal.residual, products[(last, last)], products[(last, last)]);
    // The geometry beside effects of given size.
    let coefficients: Vec<(usize, f64)> = columns.iter().map(|column| (*column, 0.7)).collect();
    let effects = rest.columns(0, last) * DVector::from_element(last, 0.7);
    let change = normal.solve(&(jacobian.transpose() * (rest.column(last) - effects)));
    assert!((marginal.geometry(&coefficients) - &change).norm() < 1e-8 * change.norm().max(1.0));
    // An effect more is worth what the pair is.
    let evidence =
        super::Evidence { marginal: &marginal, candidates: &pass.candidates, noise: data.noise, settings: &options.settings };
    for extension in evidence
        .extensions(&chosen[..1])
        .iter()
        .filter(|one| !super::evidence::one_signed(&pass.candidates.hypotheses[one.member.0]))
        .step_by(37)
    {
        let pair = evidence.log_posterior(&[chosen[0], extension.member]);
        near(extension.log_posterior, pair, pair.abs().max(1.0) * 1e3);
    }
    let singles = super::Singles::new(&arm, &sensor, &rows, &options).unwrap().evidence();
    let best = singles.iter().max_by(|a, b| a.log_posterior.total_cmp(&b.log_posterior)).unwrap();
    assert_eq!(pass.candidates.hypotheses[best.member.0].kind, Some(Kind::Backlash));
}
