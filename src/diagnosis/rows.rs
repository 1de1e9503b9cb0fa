//! Measurements as rows of a linear problem: the fitted geometry ([`crate::identification::geometry`]), residuals, and what each
//! geometric error does to them.
//!
//! Postures and targets are in the root frame, the chain's first; equations are in the measurement frame, in which they were read.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::scatter::Scatter;
use super::settings::Model;
use crate::arm::frames::Pose;
use crate::arm::{Arm, ChainAt};
use crate::effects::signature::posture::{Mechanism, Posture};
use crate::effects::signature::shape::Displacement;
use crate::identification::geometry::{self, GeometryError};
use crate::identification::mistake::{self, Explanation, Fix, Said};
use crate::measurement::equations::Equations;
use crate::measurement::{Feature, Measurement, Sensor};
use crate::solver::robust;
use crate::solver::whitening::Whitening;

/// Why nothing can be diagnosed.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum DiagnosisError {
    /// The geometry cannot be fitted.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// A setting is out of its range.
    #[error(transparent)]
    Setting(#[from] super::settings::NotAllowed),
    /// The fit went astray.
    #[error(
        "no arm of this kind makes these readings: with base, target and geometry fitted, {rms_mm:.0} mm{} RMS remain. {hint}",
        of_turns(*turn_deg)
    )]
    NotThisRobot {
        /// Remaining, mm.
        rms_mm: f64,
        /// Remaining of orientations, degrees; zero where none was measured.
        turn_deg: f64,
        /// What would fit, if anything simple does.
        hint: String,
        /// The same for machines.
        explanations: Vec<Explanation>,
    },
    /// The fit bent the arm out of shape.
    #[error(
        "these readings fit only an arm whose frames are up to {shift_mm:.0} mm and {turn_deg:.1}° off its nominal model, which no arm of \
         this kind is. {hint}"
    )]
    NotThisGeometry {
        /// Largest shift of a frame along an axis, mm.
        shift_mm: f64,
        /// Largest turn of a frame about an axis, degrees.
        turn_deg: f64,
        /// What would fit, if anything simple does.
        hint: String,
        /// The same for machines.
        explanations: Vec<Explanation>,
    },
}

impl DiagnosisError {
    /// What would make the readings those of the robot.
    #[must_use]
    pub fn explanations(&self) -> &[Explanation] {
        match self {
            DiagnosisError::NotThisRobot { explanations, .. } | DiagnosisError::NotThisGeometry { explanations, .. } => {
                explanations
            }
            _ => &[],
        }
    }
}

fn of_turns(degrees: f64) -> String {
    if degrees > 0.0 { format!(" and {degrees:.1}°") } else { String::new() }
}

/// The fitted geometry and what it leaves.
#[derive(Clone, Debug)]
pub(crate) struct Rows {
    /// Fitted arm.
    pub(crate) mechanism: Mechanism,
    /// Arm in each row.
    pub(crate) postures: Vec<Posture>,
    /// Target in root of each row, m.
    pub(crate) targets: Vec<Vector3<f64>>,
    /// What the rows tell.
    pub(crate) equations: Equations,
    /// Residuals of the equations, m and rad.
    pub(crate) residual: DVector<f64>,
    /// What makes the equations alike in noise.
    pub(crate) whitening: Whitening,
    /// What each geometric parameter, scaled by its prior's sigma, does.
    pub(crate) jacobian: DMatrix<f64>,
    /// The fitted parameters over the sigmas of their priors.
    pub(crate) parameters: DVector<f64>,
    /// Weight of each row for being far off from what geometry alone makes of the others.
    pub(crate) far: Vec<f64>,
    /// Largest error of a frame along an axis (m) and about one (rad).
    pub(crate) largest_errors: [f64; 2],
    /// Which parameters are free (base and target).
    pub(crate) free: Vec<bool>,
    /// What known distances of fixed points say ([`geometry::Geometry::known`]).
    pub(crate) known: (DVector<f64>, DMatrix<f64>),
    /// What is worth knowing about the sessions.
    pub(crate) notes: Vec<String>,
    /// Axes of the root in measurement of each row.
    turn: Vec<Matrix3<f64>>,
    /// From the measurement frame to the target, of the first session and target.
    pub(crate) measurement_to_target: ChainAt,
    /// Where the root stands, session by session.
    pub(crate) measurement_from_root: Vec<Pose>,
    /// Where each target sits on the tool.
    pub(crate) tool_from_target: Vec<Pose>,
}

impl Rows {
    /// The same arm without its readings.
    #[must_use]
    pub(crate) fn without_readings(&self) -> Rows {
        Rows {
            postures: Vec::new(),
            targets: Vec::new(),
            turn: Vec::new(),
            residual: DVector::zeros(0),
            jacobian: DMatrix::zeros(0, 0),
            far: Vec::new(),
            ..self.clone()
        }
    }

    /// Adds the arm at the joints of `row`, of the first session and target; nothing was read of it.
    pub(crate) fn push(&mut self, row: &Measurement) {
        let gravity = row.gravity(&self.mechanism.gravity);
        let posture = self.mechanism.posture_moved(&row.joints, row.payload_kg.unwrap_or(0.0), &gravity, &[]);
        self.targets.push(posture.tool + posture.tool_axes * self.tool_from_target[0].translation.vector);
        self.postures.push(posture);
        self.turn.push(self.measurement_from_root[0].rotation.to_rotation_matrix().into_inner());
    }

    /// What the equations of `row` say of a displacement of its target (m, rad, in root).
    pub(crate) fn read(&self, row: usize, displacement: &Displacement) -> impl Iterator<Item = f64> {
        let [x, y, z, rx, ry, rz] = *displacement;
        let (shift, turn) = (self.turn[row] * Vector3::new(x, y, z), self.turn[row] * Vector3::new(rx, ry, rz));
        self.equations.pick(row, [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z])
    }

    /// The displacement (m, rad, in root) that `row` has in the equations' `values` (all of them); nothing in what was not read.
    #[must_use]
    pub(crate) fn displacement(&self, row: usize, values: &DVector<f64>) -> Displacement {
        let [x, y, z, rx, ry, rz] = self.in_measurement(row, values);
        let (shift, turn) = (self.turn[row].tr_mul(&Vector3::new(x, y, z)), self.turn[row].tr_mul(&Vector3::new(rx, ry, rz)));
        [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z]
    }

    /// The same in the measurement frame.
    #[must_use]
    pub(crate) fn in_measurement(&self, row: usize, values: &DVector<f64>) -> Displacement {
        self.equations.pose(row, &values.as_slice()[self.equations.of(row)])
    }

    /// Shift of the target (m, in root) that each row has in the equations' `values`.
    #[must_use]
    pub(crate) fn shifts(&self, values: &DVector<f64>) -> Vec<Vector3<f64>> {
        let of = |row: usize| {
            let [x, y, z, ..] = self.displacement(row, values);
            Vector3::new(x, y, z)
        };
        (0..self.equations.readings()).map(of).collect()
    }

    /// What a unit move of `joint` does to the equations of `row`, m and rad.
    #[must_use]
    pub(crate) fn moved(&self, row: usize, joint: usize) -> DVector<f64> {
        let moved = self.postures[row].moved(joint, self.mechanism.slides[joint], &self.targets[row]);
        DVector::from_vec(self.read(row, &moved).collect())
    }
}

/// Readings to be fitted.
#[derive(Clone, Copy)]
pub(crate) struct Readings<'a> {
    /// The sensor.
    pub(crate) sensor: &'a Sensor,
    /// What was read.
    pub(crate) measurements: &'a [&'a Measurement],
    /// Weight of each row: 1 for a good one that stands for itself.
    pub(crate) weights: &'a [f64],
    /// What effects that are already known do to the target: shift (m) and turn (rad) in root, row by row; empty for nothing.
    pub(crate) displacement: &'a [Displacement],
    /// Joints that do not repeat.
    pub(crate) scatter: &'a [Scatter],
}

/// Whether `measurements` can be of `arm` at all, as its file and the table's units (`said`) say.
///
/// # Errors
/// If not: with what would explain it. Measurements that tell too little are no error here.
pub fn check_robot(
    arm: &Arm,
    sensor: &Sensor,
    measurements: &[&Measurement],
    settings: &Model,
    said: &Said,
) -> Result<(), DiagnosisError> {
    // Some hundred rows are enough to see that nothing is wrong; what is, is looked at in all.
    let few = thinned(measurements);
    if few.len() < measurements.len()
        && first_fit(arm, sensor, &few, settings, said).is_ok()
        && !mistake::is_suspicious(arm, &few)
    {
        return Ok(());
    }
    let first = match first_fit(arm, sensor, measurements, settings, said) {
        Ok(first) => first,
        Err(DiagnosisError::Geometry(_)) => return Ok(()),
        Err(wrong) => return Err(wrong),
    };
    // A geometry that is free enough bends itself to wrong columns: where the nominal arm is far off, a mistake may fit better.
    let corrected = |fixes: &[Fix]| -> Option<f64> {
        let mut rows: Vec<Measurement> = measurements.iter().map(|row| (*row).clone()).collect();
        fixes.iter().try_for_each(|fix| fix.apply(&mut rows, said, &arm.slides())).ok()?;
        Some(first_fit(arm, sensor, &rows.iter().collect::<Vec<_>>(), settings, said).ok()?.rms_m)
    };
    let near = without_far(measurements, &first.far);
    let near = if near.len() as f64 >= settings.of_this_robot * measurements.len() as f64 { near } else { measurements.to_vec() };
    if mistake::is_suspicious(arm, &near) {
        let mistake::Hint { text: hint, explanations, another_robot } = mistake::hint(arm, said, measurements);
        let best = explanations.iter().filter_map(|found| corrected(&found.fixes)).fold(f64::INFINITY, f64::min);
        if best < FITS_BETTER * first.rms_m || another_robot {
            return Err(DiagnosisError::NotThisRobot {
                rms_mm: first.rms_m * 1e3,
                turn_deg: first.turn_rad.to_degrees(),
                hint,
                explanations,
            });
        }
    }
    Ok(())
}

/// `measurements` without those that are far off by themselves; where all are from some row on, joints and poses may have slipped, and they
/// stay.
fn without_far<'a>(measurements: &[&'a Measurement], far: &[f64]) -> Vec<&'a Measurement> {
    let is_far = |row: usize| far.get(row).is_some_and(|weight| *weight < robust::FAR);
    let tail = (0..measurements.len()).rev().take_while(|row| is_far(*row)).count();
    let last = if tail > 1 { measurements.len() - tail } else { measurements.len() };
    (0..measurements.len()).filter(|row| *row >= last || !is_far(*row)).map(|row| measurements[row]).collect()
}

/// Rows from which on some of them are looked at first, and how many of a set-up and a target at least.
const MANY: usize = 400;
const OF_EACH: usize = 40;

/// Some hundred of `measurements`, evenly of each session, target and fixed point or plane.
fn thinned<'a>(measurements: &[&'a Measurement]) -> Vec<&'a Measurement> {
    type Key<'k> = (Option<&'k str>, Option<&'k str>, Option<Feature>);
    let key = |row: &&'a Measurement| -> Key<'a> { (row.session.as_deref(), row.target.as_deref(), row.feature()) };
    let mut counts: BTreeMap<Key<'_>, usize> = BTreeMap::new();
    measurements.iter().for_each(|row| *counts.entry(key(row)).or_default() += 1);
    let mut seen: BTreeMap<Key<'_>, usize> = BTreeMap::new();
    let stride = measurements.len().div_ceil(MANY);
    let mut kept = |row: &&&'a Measurement| {
        let key = key(row);
        let own = stride.min(counts.get(&key).map_or(1, |count| count / OF_EACH)).max(1);
        let number = seen.entry(key).or_default();
        *number += 1;
        (*number - 1).is_multiple_of(own)
    };
    measurements.iter().filter(|row| kept(row)).copied().collect()
}

/// A corrected table is taken for the right one where a calibration leaves so much less of it.
const FITS_BETTER: f64 = 0.5;

/// What geometry alone makes of readings.
pub(crate) struct First {
    /// Weight of each row for being far off from what the others say.
    pub(crate) far: Vec<f64>,
    /// What was fitted.
    loose: geometry::Geometry,
    /// What geometry leaves of readings that are not far off (RMS): of positions, m, and of orientations, rad.
    rms_m: f64,
    turn_rad: f64,
}

/// Fits `arm` alone to `measurements`, and refuses those that are none of its. What effects and geometry do together later is no reason to
/// doubt the robot.
///
/// # Errors
/// If the measurements cannot tell, or are not this robot's.
pub(crate) fn first_fit(
    arm: &Arm,
    sensor: &Sensor,
    measurements: &[&Measurement],
    settings: &Model,
    said: &Said,
) -> Result<First, DiagnosisError> {
    let weights = vec![1.0; measurements.len()];
    let readings =
        geometry::Readings { events: robust::Events::Counted, ..geometry::Readings::new(sensor, measurements, &weights) };
    let loose = geometry::fit(arm, readings)?;
    let rows = of_geometry(arm, measurements, loose.clone());
    let mechanism = Mechanism::new(arm);
    let reach: f64 = mechanism.segments.iter().map(|segment| segment.translation.vector.norm()).sum();
    let equations = &rows.equations;
    let of_position = |row: usize| rows.residual.rows_range(equations.of_position(row)).norm_squared();
    let near: Vec<usize> =
        (0..equations.readings()).filter(|row| rows.far.get(*row).is_none_or(|weight| *weight >= robust::FAR)).collect();
    // Readings that are far off are not the robot's doing while they are few.
    let counted = if near.len() as f64 >= settings.of_this_robot * equations.readings() as f64 {
        near
    } else {
        (0..equations.readings()).collect()
    };
    let rms = libm::sqrt(counted.iter().map(|row| of_position(*row)).sum::<f64>() / counted.len() as f64);
    let of_all = |row: usize| rows.residual.rows_range(equations.of(row)).norm_squared();
    let turns = counted.iter().map(|row| of_all(*row) - of_position(*row)).sum::<f64>().max(0.0);
    let turn_rad = libm::sqrt(turns / counted.len() as f64);
    if turn_rad > settings.astray_rad || rms.is_nan() || rms >= settings.astray * reach.max(settings.small_arm_m) {
        let mistake::Hint { text: hint, explanations, .. } = mistake::hint(arm, said, measurements);
        return Err(DiagnosisError::NotThisRobot { rms_mm: rms * 1e3, turn_deg: turn_rad.to_degrees(), hint, explanations });
    }
    if rows.parameters.amax() > settings.implausible {
        let [shift, turn] = rows.largest_errors;
        let mistake::Hint { text: hint, explanations, .. } = mistake::hint(arm, said, measurements);
        return Err(DiagnosisError::NotThisGeometry { shift_mm: shift * 1e3, turn_deg: turn.to_degrees(), hint, explanations });
    }
    Ok(First { far: rows.far, loose, rms_m: rms, turn_rad })
}

impl First {
    /// What a calibration of `arm` leaves of the same `measurements` ([`crate::identification::identify_real`]), m and rad.
    ///
    /// # Errors
    /// As [`first_fit`].
    pub(crate) fn calibrated(
        &self,
        arm: &Arm,
        sensor: &Sensor,
        measurements: &[&Measurement],
    ) -> Result<DVector<f64>, DiagnosisError> {
        let weights = vec![1.0; measurements.len()];
        let readings =
            geometry::Readings { events: robust::Events::Counted, ..geometry::Readings::new(sensor, measurements, &weights) };
        Ok(geometry::shrunk_residual(arm, readings, &self.loose)?)
    }
}

/// Fits base, target and geometry of `arm` to `readings`. Sessions get bases of their own where that is worth it.
///
/// # Errors
/// If the measurements cannot tell.
pub(crate) fn fit(arm: &Arm, readings: Readings<'_>) -> Result<Rows, DiagnosisError> {
    let Readings { sensor, measurements, weights, displacement, scatter } = readings;
    let scatter: Vec<(usize, f64)> = scatter.iter().map(|one| (one.joint, one.sigma)).collect();
    let fitted = geometry::fit(
        arm,
        geometry::Readings {
            sensor,
            measurements,
            weights,
            displacement,
            scatter: &scatter,
            zeros: &[],
            known: &[],
            events: robust::Events::Counted,
        },
    )?;
    Ok(of_geometry(arm, measurements, fitted))
}

fn of_geometry(arm: &Arm, measurements: &[&Measurement], fitted: geometry::Geometry) -> Rows {
    let mechanism = Mechanism::new(arm).with_chain(fitted.root_to_tool());
    let posture = |row: &&Measurement| {
        mechanism.posture_moved(&row.joints, row.payload_kg.unwrap_or(0.0), &row.gravity(&mechanism.gravity), &[])
    };
    let postures: Vec<Posture> = measurements.iter().map(posture).collect();
    let places = fitted.tool_from_target();
    let targets = postures
        .iter()
        .zip(&fitted.target)
        .map(|(posture, target)| posture.tool + posture.tool_axes * places[*target].translation.vector)
        .collect();
    let turns: Vec<Matrix3<f64>> =
        fitted.measurement_from_root().iter().map(|base| base.rotation.to_rotation_matrix().into_inner()).collect();
    let known = fitted.known().clone();
    let (measurement_from_root, tool_from_target) = (fitted.measurement_from_root().to_vec(), fitted.tool_from_target().to_vec());
    Rows {
        measurement_to_target: fitted.measurement_to_target(),
        measurement_from_root,
        tool_from_target,
        mechanism,
        turn: fitted.session.iter().map(|session| turns[*session]).collect(),
        parameters: fitted.parameters().clone(),
        largest_errors: fitted.largest_errors(),
        postures,
        targets,
        equations: fitted.equations,
        residual: fitted.residual,
        whitening: fitted.whitening,
        jacobian: fitted.jacobian,
        far: fitted.far,
        known,
        free: fitted.free,
        notes: fitted.notes,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::settings::Settings;
    use crate::diagnosis::tests::{readings, sensor};
    use crate::seed::stream;

    #[test]
    fn a_displacement_is_read_in_measurement_and_found_again_in_root() {
        let (arm, rows) = readings("test/rows", |_, _, _, _, _| 0.0);
        let rows: Vec<&Measurement> = rows.iter().collect();
        let sensor = Sensor { orientation_sigma_rad: Some(2e-5), ..sensor() };
        let weights = vec![1.0; rows.len()];
        let fitted =
            fit(&arm, Readings { sensor: &sensor, measurements: &rows, weights: &weights, displacement: &[], scatter: &[] })
                .unwrap();
        let mut draws = stream(6, "test/rows");
        let moved: Vec<Displacement> = rows.iter().map(|_| std::array::from_fn(|_| draws.normal())).collect();
        let read: Vec<f64> =
            moved.iter().enumerate().flat_map(|(row, moved)| fitted.read(row, moved).collect::<Vec<_>>()).collect();
        let read = DVector::from_vec(read);
        for (row, moved) in moved.iter().enumerate() {
            let found = fitted.displacement(row, &read);
            assert!(found.iter().zip(moved).all(|(a, b)| (a - b).abs() < 1e-12));
            // A turn of the frame keeps lengths.
            let length = |of: &[f64]| of[..3].iter().map(|value| value * value).sum::<f64>();
            assert!((length(&fitted.in_measurement(row, &read)) - length(moved)).abs() < 1e-12);
        }
    }

    #[test]
    fn another_unit_is_no_arm_of_this_kind_and_a_few_wild_readings_are() {
        let settings = &Settings::default().model;
        let (arm, mut rows) = readings("test/robot", |_, _, _, _, _| 0.0);
        let check =
            |rows: &[Measurement]| check_robot(&arm, &sensor(), &rows.iter().collect::<Vec<_>>(), settings, &Said::default());
        rows[7].position_m[0] += 3.0;
        rows[30].position_m[2] -= 5.0;
        assert!(check(&rows).is_ok());
        rows.iter_mut().for_each(|row| row.position_m = row.position_m.map(|value| 1e3 * value));
        assert!(matches!(check(&rows), Err(DiagnosisError::NotThisRobot { .. } | DiagnosisError::NotThisGeometry { .. })));
    }
}
