//! The calibration of a real arm, whose frame of measurement and whose target nobody knows: the geometry that a diagnosis fits too
//! ([`super::geometry`]), told in the parameters of the arm's own description.

use nalgebra::{Cholesky, DMatrix, DVector, Vector3};

use super::geometry::{FREE, Geometry, Readings};
use super::known::Known;
use super::ladder::{Climbed, Freedom, climb};
use super::least_squares::{FOREIGN_ROBOT, IdentificationError, MAX_STEPS, Plain, Solved, check_joints, conclude};
use super::outcome::{Identification, JointFrame, LeftOut};
use super::prior::{FRAME_SHIFT, FRAME_TURN, Sizes};
use super::{alignment, frames};
use crate::arm::chain::FrameErrors;
use crate::arm::{Arm, Quantity};
use crate::measurement::equations::Equations;
use crate::measurement::{Feature, Measurement, Role, Sensor, Weights};
use crate::numerics;
use crate::numerics::distribution::student_quantile;
use crate::quality::subspace::{Subspace, late};
use crate::seed::stream;
use crate::solver::{Problem, robust, solve};

/// Configurations beside the measured ones at which the arm's own parameters must put the target where the fitted geometry has it.
const SAMPLES: usize = 60;
/// Largest distance (m) by which they may miss it.
const EXPRESSED: f64 = 1e-9;
/// Least size of a prior that is reported of: what is held is known to this share of manufacturing.
const LEAST_SIZE: f64 = 1e-6;
/// Weight of a reading that is far off from what the others say where what is left is the declared noise, whose distribution is known: its
/// square is twice the one that is rare. What no model explains has longer tails.
const FAR_FROM_NOISE: f64 = 0.25;
/// Mean square of what is left, in declared sigmas, up to which it is noise.
const IS_NOISE: f64 = 1.5;
/// Beyond what is rare lies one in a thousand; of normal noise beyond this many standard deviations.
const RARE: f64 = 1e-3;
const NORMAL_RARE: f64 = 3.290_526_7;
/// Rounds of fitting without the readings that are far off, and of looking which these are.
const ROUNDS_OF_FAR: usize = 5;
/// Readings that are far off of which the number is said, at most.
const FAR_SAID: usize = 12;
/// A combination whose standard error is above this share of what was known of it beforehand is told by that, not by the data.
const HARDLY_SEEN: f64 = 0.5;

/// What somebody said about a calibration.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wishes<'a> {
    /// What is to be let loose; the readings choose where nobody says.
    pub only: Option<Freedom>,
    /// Where the joints' zeros are looked for, rad or m; empty for nominal.
    pub zeros: &'a [f64],
    /// What is known of the arm beforehand.
    pub known: &'a [Known],
}

/// Identifies `robot` from `measurements` with [`Role::Fit`] in any frame. How much of the geometry is let loose is what predicts readings
/// best that were left out ([`super::ladder`]); sessions may have bases of their own, and several targets may be read: the parameters of
/// base and target are then those of the first.
///
/// Readings that are far off from what the others say together (by the median of all) are left out, and named in the notes.
///
/// Parameters that the data hardly show stay near their nominal values, for a prior whose size the readings choose
/// ([`super::prior`]) says how far this arm is off; the notes name them.
///
/// # Errors
/// If there are too few measurements or they do not fit the arm.
pub fn identify_real(
    robot: &Arm,
    sensor: &Sensor,
    measurements: &[Measurement],
    wishes: Wishes<'_>,
) -> Result<Identification, IdentificationError> {
    identify_with(robot, sensor, measurements, wishes, true)
}

/// As [`identify_real`]; whether the noise was `declared`.
fn identify_with(
    robot: &Arm,
    sensor: &Sensor,
    measurements: &[Measurement],
    wishes: Wishes<'_>,
    declared: bool,
) -> Result<Identification, IdentificationError> {
    check_joints(robot, measurements)?;
    let near = |far: &[usize]| -> Vec<Measurement> {
        measurements.iter().enumerate().filter(|(at, _)| !far.contains(at)).map(|(_, row)| row.clone()).collect()
    };
    let mut far: Vec<usize> = Vec::new();
    let mut good = measurements.to_vec();
    let mut climbed = climb_with(robot, sensor, &good, wishes)?;
    for _ in 0..ROUNDS_OF_FAR {
        let now = far_off(sensor, measurements, &good, &far, &climbed.geometry, declared);
        if now == far {
            break;
        }
        let rest = near(&now);
        // Where the rest does not tell an arm, all readings have to.
        let Ok(next) = climb_with(robot, sensor, &rest, wishes) else {
            break;
        };
        (far, good, climbed) = (now, rest, next);
    }
    if far.is_empty() {
        return tell(robot, sensor, measurements, wishes, climbed, Vec::new());
    }
    let geometry = climbed.geometry.clone().with_features_of(measurements);
    let off = |row: &usize| {
        let of = &measurements[*row];
        (*row, super::least_squares::difference(of, &geometry.predict(of)).fixed_rows::<3>(0).norm())
    };
    let far: Vec<(usize, f64)> = far.iter().map(off).collect();
    let said = |(row, off): &(usize, f64)| format!("{} ({:.1} mm)", measurements[*row].index + 1, off * 1e3);
    let mut list: Vec<String> = far.iter().take(FAR_SAID).map(said).collect();
    if far.len() > FAR_SAID {
        list.push(format!("{} more", far.len() - FAR_SAID));
    }
    let note = format!(
        "{} of {} readings are far off from what the others say and were left out: number {}",
        far.len(),
        measurements.len(),
        list.join(", ")
    );
    let left_out = far.iter().map(|(row, off)| LeftOut { index: measurements[*row].index, off_m: *off }).collect();
    let mut notes = vec![note];
    notes.extend(exchanged(measurements, &far, &climbed.geometry, sensor));
    notes.extend(elsewhere(measurements, &far, &climbed.geometry));
    match tell(robot, sensor, &good, wishes, climbed, notes) {
        Ok(told) => Ok(Identification { left_out, ..told }),
        // Where the rest does not tell an arm, all readings have to.
        Err(wrong) => {
            let climbed = climb_with(robot, sensor, measurements, wishes)?;
            let note = format!(
                "readings look far off from what the others say, but without them too little is left: number {}",
                list.join(", ")
            );
            tell(robot, sensor, measurements, wishes, climbed, vec![note]).map_err(|_| wrong)
        }
    }
}

/// A pose is that of another row where it is nearer to that one's than this share of how far it is off.
const THAT_OF_ANOTHER: f64 = 0.02;

/// Readings that are far off and carry the pose of another row: rows that were exchanged, or a pose that was written twice.
fn exchanged(measurements: &[Measurement], far: &[(usize, f64)], geometry: &Geometry, sensor: &Sensor) -> Vec<String> {
    let predicted: Vec<_> = measurements.iter().map(|row| geometry.predict(row).translation.vector).collect();
    let of_another = |(row, off): &(usize, f64)| {
        let read = measurements[*row].position().coords;
        let near = sensor.position_sigma_at(&read) * 10.0 + THAT_OF_ANOTHER * off;
        let other = (0..measurements.len()).filter(|other| other != row);
        let away = |other: usize| (predicted[other] - read).norm();
        let nearest = other.min_by(|a, b| away(*a).total_cmp(&away(*b)))?;
        (away(nearest) < near).then(|| format!("reading {} carries the pose of number {}", row + 1, nearest + 1))
    };
    let said: Vec<String> =
        far.iter().filter(|(row, _)| measurements[*row].is_in_frame()).filter_map(of_another).take(FAR_SAID).collect();
    if said.is_empty() { Vec::new() } else { vec![format!("{}: were rows exchanged, or a pose written twice?", said.join(", "))] }
}

/// Readings that are far off alike, of which it is said that they are.
const ALIKE: usize = 4;
/// They are alike where their offsets differ by no more than this share of them, root mean square.
const SPREAD_OF_ALIKE: f64 = 0.05;

/// Readings that are far off by the same shift of the target on the tool, or in the measurement frame: another tool, or a base or a sensor
/// that was moved.
fn elsewhere(measurements: &[Measurement], far: &[(usize, f64)], geometry: &Geometry) -> Option<String> {
    let offsets: Vec<(usize, Vector3<f64>, Vector3<f64>)> = far
        .iter()
        .filter(|(row, _)| measurements[*row].is_in_frame() && measurements[*row].unread == [false; 3])
        .map(|(row, _)| {
            let predicted = geometry.predict(&measurements[*row]);
            let off = measurements[*row].position().coords - predicted.translation.vector;
            (*row, predicted.rotation.inverse() * off, off)
        })
        .collect();
    // About the median of each coordinate, those that are near it.
    let alike = |of: &dyn Fn(usize) -> Vector3<f64>| -> (Vec<usize>, Vector3<f64>) {
        let median = |axis: usize| {
            let mut values: Vec<f64> = (0..offsets.len()).map(|at| of(at)[axis]).collect();
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied().unwrap_or(0.0)
        };
        let middle = Vector3::new(median(0), median(1), median(2));
        let near = |at: &usize| (of(*at) - middle).norm() < SPREAD_OF_ALIKE * middle.norm();
        ((0..offsets.len()).filter(near).map(|at| offsets[at].0 + 1).collect(), middle)
    };
    let on_tool = alike(&|at| offsets[at].1);
    let in_frame = alike(&|at| offsets[at].2);
    let (is_tool, (rows, by)) = if on_tool.0.len() >= in_frame.0.len() { (true, on_tool) } else { (false, in_frame) };
    if rows.len() < ALIKE || 2 * rows.len() < far.len() {
        return None;
    }
    let numbers: Vec<String> = rows.iter().take(FAR_SAID).map(usize::to_string).collect();
    let more = if rows.len() > FAR_SAID { format!(" and {} more", rows.len() - FAR_SAID) } else { String::new() };
    let (what, remedy) = if is_tool {
        ("on the tool", "was it another tool or target? A column `target` with a label for each fits them all")
    } else {
        (
            "in the measurement frame",
            "was the base or the sensor moved? A column `session` with a label for each set-up fits them all",
        )
    };
    Some(format!(
        "readings {}{more} are off alike, by {:.1} mm ({:.1}, {:.1}, {:.1}) {what}: {remedy}",
        numbers.join(", "),
        by.norm() * 1e3,
        by.x * 1e3,
        by.y * 1e3,
        by.z * 1e3
    ))
}

fn climb_with(robot: &Arm, sensor: &Sensor, rows: &[Measurement], wishes: Wishes<'_>) -> Result<Climbed, IdentificationError> {
    let fit: Vec<&Measurement> = rows.iter().filter(|row| row.role == Role::Fit).collect();
    let weights = vec![1.0; fit.len()];
    let readings = Readings {
        sensor,
        measurements: &fit,
        weights: &weights,
        displacement: &[],
        scatter: &[],
        zeros: wishes.zeros,
        known: wishes.known,
        events: robust::Events::LeftOut,
    };
    Ok(climb(robot, readings, wishes.only)?)
}

/// Smallest estimated noise over what is assumed first: below it readings are made by a computer, and any number would do.
const LEAST_NOISE: f64 = 1e-3;

/// As [`identify_real`], where nobody declared the noise: what is left of a first fit tells it, for positions and orientations in the
/// proportion that `sensor` has them.
///
/// # Errors
/// As [`identify_real`].
pub fn identify_real_without_noise(
    robot: &Arm,
    sensor: &Sensor,
    measurements: &[Measurement],
    wishes: Wishes<'_>,
) -> Result<Identification, IdentificationError> {
    let first = identify_with(robot, sensor, measurements, wishes, false)?;
    let Some(scale) = first.residual_scale.filter(|scale| scale.is_finite()) else {
        return Ok(first);
    };
    let scale = scale.max(LEAST_NOISE);
    let estimated = Sensor {
        position_sigma_m: scale * sensor.position_sigma_m,
        position_sigma_per_m: scale * sensor.position_sigma_per_m,
        orientation_sigma_rad: sensor.orientation_sigma_rad.map(|sigma| scale * sigma),
        ..sensor.clone()
    };
    let mut identification = identify_with(robot, &estimated, measurements, wishes, false)?;
    identification.noise_estimated = true;
    identification.notes.insert(
        0,
        format!(
            "no noise was declared: it is estimated from what is left, {:.3} mm per axis, with all in it that is not modelled; \
             --position-noise-um says what the sensor's is",
            estimated.position_sigma_m * 1e3
        ),
    );
    if scale > FOREIGN_ROBOT {
        identification.notes.push(
            "if the sensor is better than that: is it this robot, are the units right, and are the joint readings in the robot's order?"
                .to_owned(),
        );
    }
    Ok(identification)
}

/// Rows of `measurements` that are far off from what others say, where `geometry` was fitted to those of `good` that are for fitting: all
/// but the rows `left_out`. `declared`: whether somebody said what the noise is.
fn far_off(
    sensor: &Sensor,
    measurements: &[Measurement],
    good: &[Measurement],
    left_out: &[usize],
    geometry: &Geometry,
    declared: bool,
) -> Vec<usize> {
    let all: Vec<&Measurement> = measurements.iter().collect();
    let equations = Equations::new(sensor, &all);
    let known = geometry.clone().with_features_of(measurements);
    let of_prediction = |row: usize| -> DVector<f64> {
        let left = super::least_squares::difference(all[row], &known.predict(all[row]));
        let of = equations.of(row);
        let error = |equation: usize| left[equations.component(equation)] / equations.sigmas()[equation].max(1e-9);
        DVector::from_iterator(of.len(), of.map(error))
    };
    let (of_fit, freedom) = geometry.errors_without().unwrap_or_default();
    let mut of_fit = of_fit.into_iter();
    // Few readings hardly tell the noise, and what is rare beside it: Student's quantile over the normal one.
    let longer = student_quantile(1.0 - RARE / 2.0, freedom.max(1.0)).unwrap_or(f64::INFINITY) / NORMAL_RARE;
    let unsure = longer.powi(4);
    let mut kept = good.iter();
    let error = |row: usize| {
        let fitted = !left_out.contains(&row) && kept.next().is_some_and(|row| row.role == Role::Fit);
        let own = if fitted { of_fit.next() } else { None };
        own.unwrap_or_else(|| of_prediction(row))
    };
    let errors: Vec<DVector<f64>> = (0..all.len()).map(error).collect();
    // Position and orientation each by its own level: what is declared of one may be far from what is declared of the other.
    let positions: Vec<usize> = (0..all.len()).map(|row| equations.of_position(row).len()).collect();
    let orientations: Vec<usize> = (0..all.len()).map(|row| equations.of(row).len() - positions[row]).collect();
    let far_in = |counts: &[usize], first: &dyn Fn(usize) -> usize| -> Vec<bool> {
        let squares: Vec<f64> = (0..all.len()).map(|row| errors[row].rows(first(row), counts[row]).norm_squared()).collect();
        let weights = robust::weights(&squares, counts, robust::Events::LeftOut);
        let is_noise = declared && robust::level(&squares, counts) < IS_NOISE;
        let limit = |row: usize| if is_noise && all[row].role == Role::Fit { FAR_FROM_NOISE } else { robust::FAR };
        (0..all.len()).map(|row| counts[row] > 0 && weights[row] * unsure < limit(row)).collect()
    };
    let (by_position, by_orientation) = (far_in(&positions, &|_| 0), far_in(&orientations, &|row| positions[row]));
    (0..all.len()).filter(|row| by_position[*row] || by_orientation[*row]).collect()
}

/// What `climbed` says of readings none of which is far off.
fn tell(
    robot: &Arm,
    sensor: &Sensor,
    measurements: &[Measurement],
    wishes: Wishes<'_>,
    climbed: Climbed,
    mut notes: Vec<String>,
) -> Result<Identification, IdentificationError> {
    let fit: Vec<&Measurement> = measurements.iter().filter(|row| row.role == Role::Fit).collect();
    let Climbed { geometry, rungs } = climbed;
    let weights = vec![1.0; fit.len()];
    let readings = Readings::new(sensor, &fit, &weights);
    let nominal = geometry.refit(robot, readings, Sizes::NOMINAL)?.with_features_of(measurements);
    let geometry = geometry.with_features_of(measurements);
    let aligned = &alignment::placed(robot, &nominal);
    let problem = Plain::new(aligned, sensor, Weights::Noise, &fit)?;
    let problem = problem.with_features(&geometry);
    let features = fit.iter().filter_map(|row| row.feature()).collect::<std::collections::BTreeSet<_>>().len();
    let structure = if features == 0 {
        Subspace::of_components(aligned, problem.equations().components())
    } else {
        // What a ball in a socket or a touched plane tells is no component of a pose.
        let nominal_chain = aligned.chain.nominal();
        Subspace::reveal(&problem.linearise(&nominal_chain).jacobian, &late(aligned), 0.0, usize::MAX)
    };
    problem.enough(structure.rank())?;

    notes.extend(geometry.notes.iter().cloned());
    let covariance_of_all = geometry.covariance();
    let told = covariance_of_all.as_ref().and_then(|covariance| frames::parameters(aligned, &geometry, covariance));
    let (values, errors) = match told {
        Some((values, errors)) => (values, Some(errors)),
        None => {
            let (values, missed) = expressed(aligned, sensor, &structure, &geometry, &fit);
            if missed > EXPRESSED {
                notes.push(format!(
                    "the parameters of the robot's file cannot say all that was identified: the calibrated file is off by up to {:.3} mm",
                    missed * 1e3
                ));
            }
            (values, None)
        }
    };
    let joint_frames =
        covariance_of_all.as_ref().map_or_else(Vec::new, |covariance| frames::joint_frames(robot, &geometry, covariance));
    let linearised = problem.linearise(&values);
    let subspace = structure.at(&linearised.jacobian);
    let (precision, known) = prior(aligned, &subspace, &geometry);
    let covariance = problem.covariance(&linearised.jacobian, &subspace, Some(&precision));
    // What the prior tells is no equation's doing.
    let told: f64 = numerics::product(&precision, &covariance).trace();
    let seen = subspace.rank() - (told.max(0.0).round() as usize).min(subspace.rank());
    let hardly: Vec<&str> = (0..subspace.rank())
        .filter(|at| known[*at].is_some_and(|known| covariance[(*at, *at)].max(0.0).sqrt() > HARDLY_SEEN * known))
        .map(|at| aligned.chain.parameters[subspace.independent[at]].name.as_str())
        .collect();
    let sizes = geometry.sizes();
    let [shift, turn] = [sizes.lengths * FRAME_SHIFT * 1e3, sizes.turns * FRAME_TURN * 1e3];
    let taken = rungs.iter().find(|rung| rung.chosen).map_or(Freedom::Geometry, |rung| rung.free);
    if taken != Freedom::Geometry {
        if wishes.only.is_none() {
            notes.push(format!(
                "more of the geometry than {} predicts readings that were left out worse: it stays as the file has it",
                match taken {
                    Freedom::Zeros => "the joints' zeros",
                    Freedom::Lengths => "zeros and lengths",
                    _ => "base and target, which are no part of the arm,",
                }
            ));
        }
    } else if 2 * hardly.len() > known.iter().flatten().count() {
        notes.push(format!(
            "these readings tell little of the arm's geometry: it is taken to be within about {shift:.2} mm and {turn:.2} mrad of nominal \
             frame by frame, which is what they speak for; a calibration needs more different configurations, or a better sensor"
        ));
    } else if !hardly.is_empty() {
        notes.push(format!(
            "these configurations hardly show {}: what is said there is mostly that this arm's frames are within about {shift:.2} mm and \
             {turn:.2} mrad of nominal; measure more different configurations, or a target further from the last axis",
            hardly.join(", ")
        ));
    }
    if features > 0 {
        let known = sensor.distances.len();
        let planes = geometry.features.iter().filter(|of| matches!(of, Feature::Plane(_))).count();
        let of = |count: usize, what: &str| (count > 0).then(|| format!("{count} {what}{}", if count == 1 { "" } else { "s" }));
        let both = [of(features - planes, "fixed point"), of(planes, "plane")];
        notes.push(format!(
            "{}: errors are the distances of the readings from where the arm has {}{}{}",
            both.into_iter().flatten().collect::<Vec<_>>().join(" and "),
            if features == 1 { "it" } else { "them" },
            if geometry.is_placed() {
                ""
            } else {
                "; where the arm stands is not known from these readings, nor is its first joint's zero"
            },
            match known {
                0 => "; without a known distance (--distances) the size of the arm is what its file says".to_owned(),
                1 => "; 1 known distance".to_owned(),
                _ => format!("; {known} known distances"),
            }
        ));
    }
    let unread: Vec<&str> = ["x", "y", "z"]
        .into_iter()
        .zip(problem.equations().components())
        .filter(|(_, read)| !read)
        .map(|(name, _)| name)
        .collect();
    if !unread.is_empty() && geometry.is_placed() {
        notes.push(format!(
            "{} was never read: where the arm stands along it is not known, and held at where it was taken to be",
            unread.join(", ")
        ));
    }
    notes.extend(off_zero(&joint_frames));
    notes.extend(absurd(&joint_frames));
    let predict = |measurement: &Measurement| geometry.predict(measurement);
    let at_nominal = |measurement: &Measurement| nominal.predict(measurement);
    let identification = conclude(
        &problem,
        Weights::Noise,
        measurements,
        Solved {
            values: &values,
            nominal: &at_nominal,
            predict: &predict,
            errors,
            degrees_of_freedom: problem.equations().len().saturating_sub(seen + 3 * features),
            subspace,
            covariance,
            converged: geometry.stop == crate::solver::Stop::Converged,
            reason: geometry.stop.to_string(),
            steps: geometry.steps,
            notes,
        },
    );
    Ok(Identification { joint_frames, ladder: rungs, ..identification })
}

/// A shift (m) or turn (rad) of a joint's frame that no real arm has.
const ABSURD: f64 = 0.06;

/// Frames that are off by more than any arm's.
fn absurd(joints: &[JointFrame]) -> Vec<String> {
    let largest = |joint: &JointFrame| {
        let all =
            joint.shift_m.iter().map(|of| (of.estimate, " mm")).chain(joint.turn_rad.iter().map(|of| (of.estimate, " mrad")));
        all.max_by(|a, b| a.0.abs().total_cmp(&b.0.abs())).filter(|(size, _)| size.abs() > ABSURD)
    };
    let said = |joint: &JointFrame| {
        let (size, unit) = largest(joint)?;
        let name = &joint.joint;
        Some(format!(
            "the frame of joint `{name}` is {:.0}{unit} from nominal: is it this robot, and are the units right?",
            size.abs() * 1e3
        ))
    };
    joints.iter().filter_map(said).collect()
}

/// A zero so many standard errors off is off.
const OFF_ZERO: f64 = 5.0;
/// The least error of a zero that is worth a note of its own, rad or m: what a joint's frame is off by machining, three times over.
const WORTH_SAYING: f64 = 3.0 * FRAME_TURN;

/// Joints whose zeros are far off.
fn off_zero(joints: &[JointFrame]) -> Vec<String> {
    let off = |joint: &&JointFrame| {
        let size = joint.zero.estimate.abs();
        size > WORTH_SAYING && size > OFF_ZERO * joint.zero.standard_error
    };
    let said = |joint: &JointFrame| {
        let (factor, unit) = if joint.zero_unit == "rad" { (1f64.to_degrees(), "°") } else { (1e3, " mm") };
        let way = if joint.zero.estimate > 0.0 { "low" } else { "high" };
        format!(
            "joint `{}` reads {:.3}{unit} too {way} (standard error {:.3}{unit}): its zero is off",
            joint.joint,
            joint.zero.estimate.abs() * factor,
            joint.zero.standard_error * factor
        )
    };
    joints.iter().filter(off).map(said).collect()
}

/// The values of all parameters of `aligned` with which it does what `geometry` does, those that others stand in for at nominal; and by
/// how much (m) it fails to.
fn expressed(aligned: &Arm, sensor: &Sensor, structure: &Subspace, geometry: &Geometry, fit: &[&Measurement]) -> (Vec<f64>, f64) {
    let mut stream = stream(0, "identification/expressed");
    let limits = &aligned.chain.joints;
    let first = Measurement {
        session: Some(geometry.sessions[0].clone()),
        target: Some(geometry.targets[0].clone()),
        fixed_point: None,
        plane: None,
        unread: [false; 3],
        ..fit[0].clone()
    };
    let drawn = (0..SAMPLES).map(|_| limits.iter().map(|joint| stream.uniform(joint.lower, joint.upper)).collect::<Vec<f64>>());
    let perfect: Vec<Measurement> = fit
        .iter()
        .map(|row| row.joints.clone())
        .chain(drawn)
        .map(|joints| {
            let asked = Measurement { joints, ..first.clone() };
            let pose = geometry.predict(&asked);
            let orientation_xyzw = asked.orientation_xyzw.map(|_| pose.rotation.coords.into());
            Measurement { position_m: pose.translation.vector.into(), orientation_xyzw, ..asked }
        })
        .collect();
    let perfect: Vec<&Measurement> = perfect.iter().collect();
    let nominal = aligned.chain.nominal();
    let exact = Sensor { position_sigma_per_m: 0.0, ..sensor.clone() };
    let Ok(problem) = Plain::new(aligned, &exact, Weights::Noise, &perfect) else {
        return (nominal, 0.0);
    };
    let values = solve(&problem, &structure.independent, nominal, MAX_STEPS).point;
    let chain = aligned.chain.at(&values);
    let equations: &Equations = problem.equations();
    let missed = perfect.iter().enumerate().map(|(row, measurement)| {
        let off = super::least_squares::difference(measurement, &chain.forward(&measurement.joints));
        equations.of_position(row).map(|equation| off[equations.component(equation)].powi(2)).sum::<f64>().sqrt()
    });
    (values, missed.fold(0.0, f64::max))
}

/// The prior of the independent parameters, which stand for the others too, its sigmas those of the `geometry`'s prior (an angle may be a zero or a twist): its
/// precision, and one sigma of each that is not free.
fn prior(aligned: &Arm, subspace: &Subspace, geometry: &Geometry) -> (DMatrix<f64>, Vec<Option<f64>>) {
    let parameters = &aligned.chain.parameters;
    let sizes = geometry.sizes();
    // Of a URDF's joints, six parameters each, the largest that was said of such an error of the frame.
    let by_joint = parameters.len() == FrameErrors::PER_FRAME * (aligned.joint_count() + 3);
    let largest = |column: usize| {
        let frame = (column / FrameErrors::PER_FRAME).checked_sub(2)?;
        let turns = parameters[column].quantity == Quantity::Angle;
        let own = (0..FrameErrors::PER_FRAME).filter(|at| (*at >= 3) == turns).map(|at| FrameErrors::PER_FRAME * frame + at);
        let known = own.filter(|at| *at < FrameErrors::PER_FRAME * geometry.frames().frames());
        known.map(|at| geometry.sigma_of_frame_error(at)).reduce(f64::max).filter(|_| by_joint)
    };
    // Base and target come first and last ([`crate::arm::Chain::in_measurement_frame`]).
    let free = |column: usize| column < 6 || column + 6 >= parameters.len();
    let sigma = |column: usize| match parameters[column].quantity {
        _ if free(column) => FREE,
        _ if largest(column).is_some() => largest(column).unwrap_or(0.0).max(LEAST_SIZE * FRAME_SHIFT),
        Quantity::Length => sizes.lengths.max(LEAST_SIZE) * FRAME_SHIFT,
        Quantity::Angle => sizes.zeros.max(sizes.turns).max(LEAST_SIZE) * FRAME_TURN,
    };
    let rank = subspace.rank();
    let bound: Vec<usize> = (0..rank).filter(|at| !free(subspace.independent[*at])).collect();
    let covariance = DMatrix::from_fn(bound.len(), bound.len(), |i, j| {
        let (i, j) = (bound[i], bound[j]);
        let own = if i == j { sigma(subspace.independent[i]).powi(2) } else { 0.0 };
        let others = subspace.dropped.iter().enumerate();
        own + others.map(|(at, column)| subspace.share[(i, at)] * subspace.share[(j, at)] * sigma(*column).powi(2)).sum::<f64>()
    });
    let mut known = vec![None; rank];
    bound.iter().enumerate().for_each(|(at, of)| known[*of] = Some(covariance[(at, at)].sqrt()));
    let mut precision = DMatrix::zeros(rank, rank);
    if let Some(inverse) = Cholesky::new(covariance).map(|cholesky| cholesky.inverse()) {
        for (i, row) in bound.iter().enumerate() {
            for (j, column) in bound.iter().enumerate() {
                precision[(*row, *column)] = inverse[(i, j)];
            }
        }
    }
    (precision, known)
}
