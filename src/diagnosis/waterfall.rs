//! What named effects are worth on held-out poses, once what they do to each reading is known: by the formulas of first order
//! ([`Waterfall::displacements`]), or told by somebody else, such as a simulation.

use nalgebra::Vector3;

use super::conditions::{Conditions, conditions};
use super::outcome::Effect;
use super::rows::{self, DiagnosisError, Rows};
use super::{FOLDS, held_out, outliers};
use crate::arm::Arm;
use crate::effects::Kind;
use crate::effects::signature::shape::{Displacement, Shape};
use crate::frames::rotation_from_vector;
use crate::measurement::{Measurement, Sensor};

/// Rounds of weighting outliers down.
const PASSES: usize = 4;

/// Readings with the folds of their diagnosis, and the weights of those that are far off: the same for every step of a waterfall.
#[derive(Clone, Debug)]
pub struct Waterfall<'a> {
    arm: &'a Arm,
    sensor: &'a Sensor,
    measurements: &'a [&'a Measurement],
    /// Geometry fitted to the readings as they are.
    pub rows: Rows,
    /// Readings as signatures see them.
    pub conditions: Conditions,
    fold: Vec<usize>,
    weights: Vec<f64>,
    good: Vec<bool>,
}

impl<'a> Waterfall<'a> {
    /// Of `measurements` of `arm`, read by `sensor`.
    ///
    /// # Errors
    /// If the measurements cannot tell where the arm stands, or are not this robot's.
    pub fn new(arm: &'a Arm, sensor: &'a Sensor, measurements: &'a [&'a Measurement]) -> Result<Self, DiagnosisError> {
        let total = measurements.len();
        let rows = rows::fit(arm, sensor, measurements, &vec![1.0; total])?;
        let conditions = conditions(measurements, &rows);
        let fold = held_out::regions(&rows.targets, FOLDS.min(total / 4).max(2));
        Ok(Waterfall { arm, sensor, measurements, rows, conditions, fold, weights: vec![1.0; total], good: vec![true; total] })
    }

    /// Readings that are far off although `displacements` (as in [`Waterfall::after`]) are taken away are weighted down from now on,
    /// and do not count where they are held out, as in a diagnosis.
    ///
    /// # Errors
    /// As [`Waterfall::after`].
    pub fn weigh(&mut self, displacements: &[Displacement]) -> Result<(), DiagnosisError> {
        let changed = self.without(displacements);
        let changed: Vec<&Measurement> = changed.iter().collect();
        let mut squares = Vec::new();
        for _ in 0..PASSES {
            let fitted = rows::fit(self.arm, self.sensor, &changed, &self.weights)?;
            squares = (0..changed.len())
                .map(|row| {
                    let (first, count) = (row * fitted.per_row, fitted.per_row);
                    let whitened = fitted.residual.rows(first, count).component_mul(&fitted.whitening.rows(first, count));
                    whitened.norm_squared() / self.weights[row]
                })
                .collect();
            let next = outliers::weights(&squares, fitted.per_row);
            let same = next.iter().zip(&self.weights).all(|(a, b)| (a - b).abs() < 1e-3);
            self.weights = next;
            if same {
                break;
            }
        }
        let far = outliers::look(&squares, self.rows.per_row, 1.0).rows;
        self.good = (0..changed.len()).map(|row| !far.contains(&row)).collect();
        Ok(())
    }

    /// What `effect` does to the target in each reading (shift in m, turn in rad, in root), to first order; `None` where there is no
    /// formula for it, or where the readings lack what it needs.
    #[must_use]
    pub fn displacements(&self, effect: &Effect) -> Option<Vec<Displacement>> {
        let (shape, values) = formula(effect, self.rows.mechanism.joint_count())?;
        let attitude = self.rows.per_row == 6;
        let known = |joint: usize, values: &[f64]| joint < values.len();
        self.conditions
            .readings
            .iter()
            .map(|reading| {
                match shape {
                    Shape::Direction(joint) if !known(joint, &reading.approach) => return None,
                    Shape::Warmth(_) | Shape::Growth(_) if reading.rise_k.is_empty() => return None,
                    _ => {}
                }
                let columns = shape.columns(reading, attitude);
                Some(std::array::from_fn(|axis| columns.iter().zip(&values).map(|(column, value)| column[axis] * value).sum()))
            })
            .collect()
    }

    /// 3-D position RMS on held-out poses, m, of base, target and geometry fitted to what the readings are without `displacements`
    /// (of each reading: shift of the target in m, turn in rad, in root).
    ///
    /// # Errors
    /// If what remains is not this robot's.
    pub fn after(&self, displacements: &[Displacement]) -> Result<f64, DiagnosisError> {
        use rayon::prelude::*;
        let changed = self.without(displacements);
        let changed: Vec<&Measurement> = changed.iter().collect();
        let folds = self.fold.iter().max().map_or(1, |most| most + 1);
        let squares: Vec<(f64, usize)> = (0..folds)
            .into_par_iter()
            .map(|number| {
                let held = |row: &usize| self.fold[*row] == number;
                // What weighs nothing has no part in the fit, and its residual is the prediction's error.
                let weights: Vec<f64> = (0..changed.len()).map(|row| if held(&row) { 0.0 } else { self.weights[row] }).collect();
                let fitted = rows::fit(self.arm, self.sensor, &changed, &weights)?;
                let counted: Vec<usize> = (0..changed.len()).filter(|row| held(row) && self.good[*row]).collect();
                let square = |row: &usize| fitted.residual.fixed_rows::<3>(row * fitted.per_row).norm_squared();
                Ok((counted.iter().map(square).sum::<f64>(), counted.len()))
            })
            .collect::<Result<_, DiagnosisError>>()?;
        let (sum, count) = squares.iter().fold((0.0, 0), |(sum, count), one| (sum + one.0, count + one.1));
        Ok(libm::sqrt(sum / count.max(1) as f64))
    }

    /// The readings as they would be without `displacements`.
    fn without(&self, displacements: &[Displacement]) -> Vec<Measurement> {
        let measurement_from_root = self.rows.measurement_from_root.rotation;
        let changed = |(measurement, displacement): (&&Measurement, &Displacement)| {
            let [x, y, z, turn @ ..] = *displacement;
            let mut changed = (*measurement).clone();
            changed.position_m = (measurement.position() - measurement_from_root * Vector3::new(x, y, z)).coords.into();
            if let Some(attitude) = measurement.attitude() {
                let back = rotation_from_vector(&(measurement_from_root * -Vector3::from(turn)));
                let q = *(back * attitude).quaternion();
                changed.attitude_xyzw = Some([q.i, q.j, q.k, q.w]);
            }
            changed
        };
        self.measurements.iter().zip(displacements).map(changed).collect()
    }
}

/// What an effect follows, and the coefficients of its columns.
fn formula(effect: &Effect, joints: usize) -> Option<(Shape, Vec<f64>)> {
    let (parameters, size) = (&effect.parameters, effect.magnitude.value);
    // Joints and links count from 0 in here.
    let index = effect.location.index.and_then(|index| index.checked_sub(1)).filter(|index| *index < joints);
    let twist = || Some([parameters.translation_m?, parameters.rotation_rad?].concat());
    Some(match Kind::from_name(&effect.kind)? {
        Kind::JointCompliance => (Shape::Torque(index?), vec![size]),
        Kind::LinkBending => (Shape::MomentAcross(index?), vec![size]),
        Kind::Backlash => (Shape::Direction(index?), vec![size * parameters.sign?]),
        Kind::GravityLostMotion => (Shape::TorqueSign(index?), vec![size]),
        Kind::JointEccentricity | Kind::StrainWaveError => {
            let (sine, cosine) = libm::sincos(parameters.phase_rad?);
            (Shape::Harmonic(index?, parameters.order?), vec![size * cosine, -size * sine])
        }
        Kind::GearCoupling => {
            let source = parameters.source?.checked_sub(1).filter(|source| *source < joints)?;
            (Shape::Ratio { joint: index?, source }, vec![size])
        }
        Kind::LinkThermalGrowth => (Shape::Growth(index), vec![size]),
        Kind::JointThermalDrift => (Shape::Warmth(index?), vec![size]),
        Kind::RadialClearance => (Shape::ForceAcrossSign(index?), vec![size]),
        Kind::TiltClearance => (Shape::MomentAcrossSign(index?), vec![size]),
        Kind::BaseDrift => (Shape::BaseDrift, twist()?),
        Kind::BaseStep => (Shape::BaseStep(parameters.row?), twist()?),
        Kind::ToolStep => (Shape::ToolStep(parameters.row?), twist()?),
        Kind::MeasurementScale => (Shape::Scale, vec![size]),
        Kind::MeasurementOutliers => return None,
    })
}
