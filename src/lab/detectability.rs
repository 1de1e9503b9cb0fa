//! How much of an effect no geometry can explain: λ = ‖P⊥ s‖²/σ², the effect's signal in sigmas of the declared noise after everything
//! that the identifiable geometric parameters can absorb has been projected out.

use nalgebra::{DMatrix, DVector};

use crate::arm::Arm;
use crate::arm::Chain;
use crate::arm::frames::{Pose, pose_error};
use crate::measurement::{Measurement, Sensor};
use crate::progress::Silent;
use crate::scene::Scene;
use crate::simulation::cell::measure::{MeasureError, measure};
use crate::simulation::cell::plan::Planned;
use crate::simulation::effect::Effect;
use crate::simulation::injected::{Injected, Noise};

/// Singular values of the column-scaled Jacobian below this share of the largest are redundancies of the parameters, which rounding
/// leaves near 1e-15; what real configurations show is above 1e-6.
const RELATIVE_TOLERANCE: f64 = 1e-9;

/// What geometry can absorb on a set of readings: an orthonormal basis of it, in sigmas.
#[derive(Clone, Debug)]
pub struct Geometry {
    basis: DMatrix<f64>,
    /// One over the declared sigma of every row.
    whitening: DVector<f64>,
    rows_per_pose: usize,
}

impl Geometry {
    /// Everything that `chain`'s parameters can do to first order about `values` at the `joints` of every reading; positions alone
    /// where the sensor sees no orientation. Repeats are rows like others.
    #[must_use]
    pub fn new(chain: &Chain, values: &[f64], sensor: &Sensor, joints: &[&[f64]]) -> Geometry {
        let rows_per_pose = if sensor.orientation_sigma_rad.is_some_and(|sigma| sigma > 0.0) { 6 } else { 3 };
        let chain = chain.at(values);
        let mut jacobian = DMatrix::zeros(rows_per_pose * joints.len(), chain.parameter_count());
        let mut whitening = DVector::zeros(jacobian.nrows());
        for (index, joints) in joints.iter().enumerate() {
            let (pose, rows) = chain.jacobian(joints);
            let position = sensor.position_sigma_at(&pose.translation.vector);
            for row in 0..rows_per_pose {
                let sigma = if row < 3 { position } else { sensor.orientation_sigma_rad.unwrap_or(0.0) };
                // A reading that is declared exact is taken to a nanometre, as the identification does.
                let weight = 1.0 / sigma.max(1e-9);
                whitening[index * rows_per_pose + row] = weight;
                jacobian.row_mut(index * rows_per_pose + row).copy_from(&(rows.row(row) * weight));
            }
        }
        Geometry { basis: column_space(jacobian), whitening, rows_per_pose }
    }

    /// Dimension of the identifiable subspace.
    #[must_use]
    pub fn rank(&self) -> usize {
        self.basis.ncols()
    }

    /// Of a signal, given as pose differences (m, rad): its squared length in sigmas, and that of what no geometry absorbs (λ).
    #[must_use]
    pub fn surviving(&self, signal: &[[f64; 6]]) -> Surviving {
        let whole = DVector::from_fn(self.whitening.len(), |row, _| {
            signal[row / self.rows_per_pose][row % self.rows_per_pose] * self.whitening[row]
        });
        let mut rest = whole.clone();
        // Twice, so that rounding leaves nothing along the basis.
        for _ in 0..2 {
            for column in self.basis.column_iter() {
                let along = column.dot(&rest);
                rest.axpy(-along, &column, 1.0);
            }
        }
        Surviving { signal: whole.norm_squared(), lambda: rest.norm_squared() }
    }
}

/// What is left of a signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surviving {
    /// Squared length of the whole signal, in sigmas.
    pub signal: f64,
    /// Squared length of what no geometry absorbs, in sigmas.
    pub lambda: f64,
}

impl Surviving {
    /// Share of the signal's energy that geometry swallows; `None` where there is none to speak of.
    #[must_use]
    pub fn swallowed(self) -> Option<f64> {
        (self.signal > 1e-6).then(|| (1.0 - self.lambda / self.signal).clamp(0.0, 1.0))
    }
}

/// An orthonormal basis of what the columns span.
fn column_space(mut matrix: DMatrix<f64>) -> DMatrix<f64> {
    let largest = matrix.column_iter().map(|column| column.norm()).fold(0.0, f64::max);
    for mut column in matrix.column_iter_mut() {
        let norm = column.norm();
        column *= if norm > largest * RELATIVE_TOLERANCE { 1.0 / norm } else { 0.0 };
    }
    let rows = matrix.nrows();
    let svd = matrix.svd(true, false);
    let threshold = svd.singular_values.max() * RELATIVE_TOLERANCE;
    let kept: Vec<usize> = (0..svd.singular_values.len()).filter(|index| svd.singular_values[*index] > threshold).collect();
    svd.u.map_or_else(|| DMatrix::zeros(rows, 0), |u| u.select_columns(&kept))
}

/// What geometry can absorb with base and target free too, about the true parameters `values` of `arm`: a cell whose frames nobody
/// has measured.
#[must_use]
pub fn geometry_of_cell(arm: &Arm, values: &[f64], sensor: &Sensor, joints: &[&[f64]]) -> Geometry {
    let chain = arm.chain.in_measurement_frame();
    let framed: Vec<f64> = [0.0; 6].into_iter().chain(values.iter().copied()).chain([0.0; 6]).collect();
    Geometry::new(&chain, &framed, sensor, joints)
}

/// What would be read without noise.
///
/// # Errors
/// If the arm cannot be simulated.
pub fn noiseless(scene: &Scene, injected: &Injected, planned: &[Planned]) -> Result<Vec<Pose>, MeasureError> {
    let silent = Injected { noise: Noise::Off, ..injected.clone() };
    let (measurements, _) = measure(&scene.cell(), &silent, planned, planned.len(), &mut Silent)?;
    Ok(measurements.iter().map(pose_read).collect())
}

/// The measured pose; identity orientation where none is measured.
fn pose_read(measurement: &Measurement) -> Pose {
    let orientation = measurement.orientation().unwrap_or_else(nalgebra::UnitQuaternion::identity);
    Pose::from_parts(measurement.position().into(), orientation)
}

/// Pose differences with minus without, reading by reading (m, rad, in base).
#[must_use]
pub fn difference(with: &[Pose], without: &[Pose]) -> Vec<[f64; 6]> {
    with.iter().zip(without).map(|(with, without)| pose_error(with, without).into()).collect()
}

/// `injected` without its effect number `index`.
#[must_use]
pub fn without(injected: &Injected, index: usize) -> Injected {
    let mut other = injected.clone();
    other.effects.remove(index);
    other
}

/// Whether an effect acts on the poses or on true readings at all: outliers are noise, and have no signal.
#[must_use]
pub fn has_signal(effect: &Effect) -> bool {
    !matches!(effect, Effect::MeasurementOutliers { .. })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::candidates::{Rules, Sampler};
    use crate::lab::reproduce::arms::arms;
    use crate::seed::stream;

    /// λ of a signal is the smallest sum of squares that any parameters leave: brute force by Gauss–Newton on a model of its own,
    /// whose poses are shifted by the signal, with numerical derivatives and a pseudo-inverse.
    #[test]
    fn lambda_is_what_the_best_fit_leaves() {
        let mut scene = arms().unwrap().swap_remove(0).scene;
        scene.sensor.position_sigma_m = 20e-6;
        scene.sensor.position_sigma_per_m = 0.0;
        scene.sensor.orientation_sigma_rad = Some(50e-6);
        let rules = Rules::measurable(&scene.arm, &scene.sensor);
        let mut draws = stream(11, "test/configurations");
        let flat = Sampler::new(&rules).draw(&mut draws, 25).unwrap();
        let mut joints: Vec<&[f64]> = flat.chunks(scene.arm.joint_count()).collect();
        // A repeat counts as a row of its own.
        joints.push(joints[3]);
        let values: Vec<f64> = scene.arm.chain.nominal().iter().map(|value| value + draws.uniform(-1e-3, 1e-3)).collect();
        let geometry = geometry_of_cell(&scene.arm, &values, &scene.sensor, &joints);

        // A signal that is partly geometry (a joint zero) and partly not (an eccentricity), small enough to be linear.
        let chain = scene.arm.chain.in_measurement_frame();
        let framed: Vec<f64> = [0.0; 6].into_iter().chain(values.iter().copied()).chain([0.0; 6]).collect();
        let truth = chain.at(&framed);
        let shifted: Vec<Pose> = joints
            .iter()
            .map(|joints| {
                let mut shifted = joints.to_vec();
                shifted[2] += 30e-6 + 40e-6 * joints[2].cos();
                truth.forward(&shifted)
            })
            .collect();
        let plain: Vec<Pose> = joints.iter().map(|joints| truth.forward(joints)).collect();
        let found = geometry.surviving(&difference(&shifted, &plain));

        let sigma = |row: usize| if row % 6 < 3 { 20e-6 } else { 50e-6 };
        let residuals = |values: &[f64]| {
            let chain = chain.at(values);
            let rows: Vec<f64> = joints
                .iter()
                .zip(&shifted)
                .flat_map(|(joints, shifted)| <[f64; 6]>::from(pose_error(shifted, &chain.forward(joints))))
                .collect();
            DVector::from_iterator(rows.len(), rows.iter().enumerate().map(|(row, value)| value / sigma(row)))
        };
        let mut fitted = framed;
        for _ in 0..4 {
            let here = residuals(&fitted);
            let jacobian = DMatrix::from_columns(
                &(0..fitted.len())
                    .map(|column| {
                        let [mut up, mut down] = [fitted.clone(), fitted.clone()];
                        up[column] += 1e-6;
                        down[column] -= 1e-6;
                        (residuals(&down) - residuals(&up)) / 2e-6
                    })
                    .collect::<Vec<_>>(),
            );
            let step = jacobian.pseudo_inverse(1e-2).unwrap() * here;
            fitted.iter_mut().zip(step.iter()).for_each(|(value, step)| *value += step);
        }
        let left = residuals(&fitted).norm_squared();
        assert!(left > 1.0 && found.signal > 3.0 * left, "{left} of {found:?}");
        assert!((found.lambda / left - 1.0).abs() < 1e-3, "{} against {left}", found.lambda);
    }

    #[test]
    fn geometry_leaves_nothing_of_geometry() {
        let scene = arms().unwrap().swap_remove(0).scene;
        let rules = Rules::measurable(&scene.arm, &scene.sensor);
        let flat = Sampler::new(&rules).draw(&mut stream(12, "test/configurations"), 30).unwrap();
        let joints: Vec<&[f64]> = flat.chunks(scene.arm.joint_count()).collect();
        let nominal = scene.arm.chain.nominal();
        let geometry = geometry_of_cell(&scene.arm, &nominal, &scene.sensor, &joints);
        let plain = scene.arm.chain.at(&nominal);
        for column in 0..nominal.len() {
            let mut changed = nominal.clone();
            changed[column] += 1e-7;
            let changed = scene.arm.chain.at(&changed);
            let poses = |chain: &crate::arm::ChainAt| joints.iter().map(|joints| chain.forward(joints)).collect::<Vec<_>>();
            let found = geometry.surviving(&difference(&poses(&changed), &poses(&plain)));
            assert!(found.lambda <= 1e-9 * found.signal.max(1e-3), "parameter {column}: {found:?}");
        }
    }
}
