//! Which way gravity acts, as far as the readings tell. Robots hang from ceilings and stand on walls, and neither their files nor the
//! tables say so; then what yields to load looks like joints that do not repeat.
//!
//! Whatever yields does so in proportion to the moments that gravity makes, and these are linear in it. So for every direction of gravity
//! there is one linear problem, in which every joint yields and every link bends, geometry and errors of the joints' angles taken out, and its evidence says
//! how likely the direction makes the readings.

use nalgebra::{Cholesky, DMatrix, DVector, Matrix3, Vector3};

use super::rows::{self, DiagnosisError, Readings, Rows};
use super::{Data, settings};
use crate::effects::Kind;
use crate::effects::signature::posture::Posture;
use crate::effects::signature::shape::Displacement;
use crate::numerics::matrix::{gram, transposed_product};

/// Where gravity's direction comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gravity {
    /// It is known.
    Known,
    /// The robot's file has one because robots usually stand upright.
    Assumed,
}

/// Harmonics of each joint's angle that its reading may be off by,
const HARMONICS: u8 = 3;
/// and their prior's sigma, rad: that of poor encoders.
const ANGLE_ERROR: f64 = 2e-3;
/// Directions that are tried before the best of them is made better.
const DIRECTIONS: usize = 400;
/// Widths of the search about the best of them, rad.
const STEPS: [f64; 5] = [0.1, 0.03, 0.01, 0.003, 0.001];

/// Joints that yield and links that bend, under gravity along each axis of the root.
struct Yielding {
    /// Inner products of what survives of the geometry, by axis and joint or link (axis is the slower one).
    products: DMatrix<f64>,
    with_residual: DVector<f64>,
    residual: f64,
    degrees_of_freedom: f64,
    /// Joints and links together.
    count: usize,
}

impl Yielding {
    fn new(rows: &Rows, payloads: &[f64], joints: &[&[f64]]) -> Option<Yielding> {
        let mechanism = &rows.mechanism;
        let (of_arm, equations) = (mechanism.joint_count(), rows.equations.len());
        let size = mechanism.gravity.norm();
        let count = 2 * of_arm;
        let units: Vec<f64> = [Kind::JointCompliance, Kind::LinkBending]
            .into_iter()
            .flat_map(|kind| (0..of_arm).map(move |joint| kind.range(Some(joint), of_arm)))
            .map(|[low, high]| libm::sqrt(low * high))
            .collect();
        let mut columns = DMatrix::zeros(equations, 3 * count);
        for row in 0..rows.equations.readings() {
            let weight = libm::sqrt(rows.far.get(row).copied().unwrap_or(1.0));
            for axis in 0..3 {
                let gravity = Vector3::ith(axis, size);
                let posture = mechanism.posture_moved(joints[row], payloads[row], &gravity, &[]);
                for (at, unit) in units.iter().enumerate() {
                    let moved = yielded(&posture, at % of_arm, at >= of_arm, mechanism.slides[at % of_arm], &rows.targets[row]);
                    let mut values: Vec<f64> = rows.read(row, &moved.map(|value| value * unit)).collect();
                    rows.whitening.apply(row, &mut values);
                    for (equation, value) in rows.equations.of(row).zip(values) {
                        columns[(equation, axis * count + at)] = value * weight;
                    }
                }
            }
        }
        let weigh = |of: &DVector<f64>| -> DVector<f64> {
            let mut weighed = DVector::zeros(equations);
            for row in 0..rows.equations.readings() {
                let weight = libm::sqrt(rows.far.get(row).copied().unwrap_or(1.0));
                let mut values: Vec<f64> = rows.equations.of(row).map(|equation| of[equation]).collect();
                rows.whitening.apply(row, &mut values);
                for (equation, value) in rows.equations.of(row).zip(values) {
                    weighed[equation] = value * weight;
                }
            }
            weighed
        };
        let parameters = rows.jacobian.ncols();
        let mut beside: Vec<DVector<f64>> = rows.jacobian.column_iter().map(|column| weigh(&column.into_owned())).collect();
        // Encoders and gears err with the angle, as torques do; what such errors explain is no evidence of gravity.
        for joint in (0..of_arm).filter(|joint| !mechanism.slides[*joint]) {
            for order in 1..=HARMONICS {
                for phase in [0.0, std::f64::consts::FRAC_PI_2] {
                    let mut column = DVector::zeros(equations);
                    for (row, joints) in joints.iter().enumerate() {
                        let size = ANGLE_ERROR * libm::cos(f64::from(order) * joints[joint] - phase);
                        column.rows_range_mut(rows.equations.of(row)).copy_from(&(rows.moved(row, joint) * size));
                    }
                    beside.push(weigh(&column));
                }
            }
        }
        let jacobian = DMatrix::from_columns(&beside);
        let residual = weigh(&rows.residual);
        // The prior of the geometry, about where it is now.
        let is_free = |parameter: usize| rows.free.get(parameter) == Some(&true);
        let mut normal = gram(&jacobian);
        (0..beside.len()).for_each(|at| normal[(at, at)] += if is_free(at) { 1e-6 } else { 1.0 });
        let pull =
            DVector::from_fn(beside.len(), |at, _| if at >= parameters || is_free(at) { 0.0 } else { rows.parameters[at] });
        let cholesky = Cholesky::new(normal)?;
        let with_geometry = transposed_product(&jacobian, &columns);
        let geometry_with_residual = jacobian.tr_mul(&residual) - &pull;
        let absorbed = cholesky.solve(&with_geometry);
        let at_rest = cholesky.solve(&geometry_with_residual);
        Some(Yielding {
            products: gram(&columns) - transposed_product(&with_geometry, &absorbed),
            with_residual: columns.tr_mul(&residual) - with_geometry.tr_mul(&at_rest),
            residual: (residual.norm_squared() + pull.norm_squared() - geometry_with_residual.dot(&at_rest)).max(1e-12),
            degrees_of_freedom: (rows.far.iter().sum::<f64>() / rows.far.len().max(1) as f64 * equations as f64
                - rows.free.iter().filter(|free| **free).count() as f64)
                .max(1.0),
            count,
        })
    }

    /// Logarithm of the evidence of gravity along `direction` over that of nothing that yields, and by how much the sum of squares drops.
    fn evidence(&self, data: &Data<'_>, direction: &Vector3<f64>) -> (f64, f64) {
        let count = self.count;
        let along = |i: usize, j: usize| -> f64 {
            let of = |a: usize, b: usize| direction[a] * direction[b] * self.products[(a * count + i, b * count + j)];
            (0..3).flat_map(|a| (0..3).map(move |b| (a, b))).map(|(a, b)| of(a, b)).sum()
        };
        let products = DMatrix::from_fn(count, count, along);
        let right = DVector::from_fn(count, |i, _| (0..3).map(|a| direction[a] * self.with_residual[a * count + i]).sum());
        let noise = data.noise;
        let before = noise.degrees_of_freedom * noise.level + self.residual;
        let degrees = noise.degrees_of_freedom + self.degrees_of_freedom;
        let of_scale = |size: f64| -> Option<(f64, f64)> {
            let precision = 1.0 / (size * size);
            let mut normal = products.clone();
            (0..count).for_each(|at| normal[(at, at)] += precision);
            let factor = Cholesky::new(normal.clone())?.unpack();
            let determinant: f64 = (0..count).map(|at| 2.0 * libm::log(factor[(at, at)]) - libm::log(precision)).sum();
            // Nothing yields upwards.
            let mut down: Vec<usize> = (0..count).collect();
            let drop = loop {
                if down.is_empty() {
                    break 0.0;
                }
                let part = right.select_rows(&down);
                let found = Cholesky::new(normal.select_rows(&down).select_columns(&down))?.solve(&part);
                let kept: Vec<usize> =
                    down.iter().zip(found.iter()).filter(|(_, value)| **value > 0.0).map(|(at, _)| *at).collect();
                if kept.len() == down.len() {
                    break part.dot(&found);
                }
                down = kept;
            };
            let after = (before - drop).max(1e-9 * before);
            Some((-0.5 * determinant - 0.5 * degrees * libm::log(after / before), drop))
        };
        let scales = data.options.settings.prior.scales.into_iter().filter_map(of_scale);
        scales.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f64::NEG_INFINITY, 0.0))
    }
}

/// What a unit of yielding does to `target`: of a joint, or of the link that it moves (`bends`).
fn yielded(posture: &Posture, joint: usize, bends: bool, slides: bool, target: &Vector3<f64>) -> Displacement {
    if bends {
        let turn = posture.moment_across(joint);
        let shift = turn.cross(&(target - posture.origins[joint]));
        return [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z];
    }
    let effort = if slides { posture.forces[joint].dot(&posture.axes[joint]) } else { posture.torque(joint) };
    posture.moved(joint, slides, target).map(|value| value * effort)
}

/// Directions spread evenly over the sphere, and the axes.
fn directions() -> impl Iterator<Item = Vector3<f64>> {
    let golden = std::f64::consts::PI * (3.0 - libm::sqrt(5.0));
    let spread = (0..DIRECTIONS).map(move |number| {
        let height = 1.0 - (2.0 * number as f64 + 1.0) / DIRECTIONS as f64;
        let (sine, cosine) = libm::sincos(golden * number as f64);
        let radius = libm::sqrt(1.0 - height * height);
        Vector3::new(radius * cosine, radius * sine, height)
    });
    spread.chain(axes())
}

/// Both ways along each axis of the root: walls, ceilings, floors.
fn axes() -> impl Iterator<Item = Vector3<f64>> {
    (0..3).flat_map(|axis| [1.0, -1.0].map(|sign| Vector3::ith(axis, sign)))
}

/// Gravity (in root, m/s²) as the readings have it, where that is far likelier than as the arm's file has it and explains most of what
/// geometry and yielding under that leave.
///
/// # Errors
/// If the readings cannot tell where the arm stands.
pub(super) fn sought(data: &Data<'_>) -> Result<Option<Vector3<f64>>, DiagnosisError> {
    let measurements = data.measurements;
    let usual = data.arm.gravity_in_base;
    let settings: &settings::Gravity = &data.options.settings.gravity;
    if usual.norm() < 1e-6 || measurements.iter().any(|row| row.gravity_m_s2.is_some()) {
        return Ok(None);
    }
    let weights = vec![1.0; measurements.len()];
    let readings = Readings { sensor: data.sensor, measurements, weights: &weights, displacement: &[], scatter: &[] };
    let rows = rows::fit(data.arm, readings)?;
    if !rows.mechanism.masses_known {
        return Ok(None);
    }
    let payloads: Vec<f64> = measurements.iter().map(|row| row.payload_kg.unwrap_or(0.0)).collect();
    let joints: Vec<&[f64]> = measurements.iter().map(|row| row.joints.as_slice()).collect();
    let Some(yielding) = Yielding::new(&rows, &payloads, &joints) else {
        return Ok(None);
    };
    let of = |direction: &Vector3<f64>| yielding.evidence(data, direction).0;
    let better = |(a, value): (Vector3<f64>, f64), b: Vector3<f64>| {
        let other = of(&b);
        if other > value { (b, other) } else { (a, value) }
    };
    let first = usual.normalize();
    let mut best = directions().fold((first, of(&first)), better);
    for step in STEPS {
        loop {
            let across = best.0.cross(&Vector3::ith(best.0.iamin(), 1.0)).normalize();
            let frame = Matrix3::from_columns(&[across, best.0.cross(&across), best.0]);
            let tried = (0..8).map(|number| {
                let (sine, cosine) = libm::sincos(std::f64::consts::FRAC_PI_4 * f64::from(number));
                (frame * Vector3::new(step * cosine, step * sine, 1.0)).normalize()
            });
            let next = tried.fold(best, better);
            if next.1 <= best.1 {
                break;
            }
            best = next;
        }
    }
    // A floor, a wall or a ceiling is likelier than a slope.
    let nearest = axes().map(|axis| (axis, of(&axis) - settings.wall)).max_by(|a, b| a.1.total_cmp(&b.1));
    let chosen = nearest.filter(|axis| axis.1 >= best.1 - settings.slope).unwrap_or((best.0, best.1 - settings.slope));
    let (upright, upright_drop) = yielding.evidence(data, &first);
    let (_, drop) = yielding.evidence(data, &chosen.0);
    let over_noise = (yielding.residual - yielding.degrees_of_freedom * data.noise.level).max(1e-12);
    let explains = drop - upright_drop >= settings.explains * (over_noise - upright_drop).max(0.0) && over_noise > upright_drop;
    let apart = chosen.0.dot(&first) < libm::cos(settings.apart_rad);
    Ok((chosen.1 > upright && explains && apart).then(|| chosen.0 * usual.norm()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::Arm;
    use crate::diagnosis::outcome::NoiseSource;
    use crate::diagnosis::tests::{readings, sensor, torque};
    use crate::diagnosis::{Options, diagnose};
    use crate::measurement::Measurement;

    fn found(arm: &Arm, rows: &[Measurement]) -> Option<Vector3<f64>> {
        let rows: Vec<&Measurement> = rows.iter().collect();
        let options = Options { gravity: Gravity::Assumed, ..Options::new(NoiseSource::Declared) };
        sought(&Data::new(arm, &sensor(), &rows, &options)).unwrap()
    }

    /// On a wall, under a ceiling and on a slope: the torques are those of the potential energy.
    #[test]
    fn gravity_is_found_where_an_arm_yields() {
        for (gravity, within) in [([9.81, 0.0, 0.0], 1e-12), ([0.0, 0.0, 9.81], 1e-12), ([0.0, 5.886, -7.848], 0.05)] {
            let gravity = Vector3::from(gravity);
            let (arm, rows) = readings("test/gravity", |arm, joints, _, joint, payload| {
                let mounted = Arm { gravity_in_base: gravity, ..arm.clone() };
                let size = if joint == 1 { 2e-5 } else { 3e-5 };
                if joint == 1 || joint == 3 { size * torque(&mounted, joints, joint, payload) } else { 0.0 }
            });
            let found = found(&arm, &rows).unwrap_or_else(|| panic!("{gravity}"));
            assert!((found - gravity).norm() < within * 9.81, "{found}");
        }
    }

    #[test]
    fn who_stands_upright_is_left_there() {
        type Off = fn(&Arm, &[f64], &[i8], usize, f64) -> f64;
        let nothing: Off = |_, _, _, _, _| 0.0;
        let yields: Off = |arm, joints, _, joint, payload| {
            if joint == 1 { 2e-5 * torque(arm, joints, joint, payload) } else { 0.0 }
        };
        // As smooth in the angles as a torque, and none.
        let eccentric: Off = |_, joints, _, joint, _| if joint < 4 { 2e-3 * (joints[joint] + 1.0).sin() } else { 0.0 };
        let plays: Off = |_, _, approach, joint, _| 1e-3 * f64::from(approach[joint]);
        for off in [nothing, yields, eccentric, plays] {
            let (arm, rows) = readings("test/upright", off);
            assert_eq!(found(&arm, &rows), None);
        }
    }

    #[test]
    fn a_diagnosis_takes_loads_as_gravity_has_them() {
        let (arm, rows) = readings("test/wall", |arm, joints, _, joint, payload| {
            let mounted = Arm { gravity_in_base: Vector3::new(0.0, 9.81, 0.0), ..arm.clone() };
            if joint == 1 { 3e-5 * torque(&mounted, joints, joint, payload) } else { 0.0 }
        });
        let rows: Vec<&Measurement> = rows.iter().collect();
        let options = Options { gravity: Gravity::Assumed, ..Options::new(NoiseSource::Declared) };
        let conclusion = diagnose(&arm, &sensor(), &rows, &options).unwrap();
        let [effect] = &conclusion.effects[..] else { panic!("{:?}", conclusion.effects) };
        assert_eq!((effect.kind, effect.location.index), (Kind::JointCompliance, Some(2)));
        assert!((effect.magnitude.value / 3e-5 - 1.0).abs() < 0.03, "{:?}", effect.magnitude);
        let told = conclusion.gravity_m_s2.map(Vector3::from).unwrap();
        assert!((told - Vector3::new(0.0, 9.81, 0.0)).norm() < 1e-9);
        // The same where each reading says it.
        let said: Vec<Measurement> =
            rows.iter().map(|row| Measurement { gravity_m_s2: Some([0.0, 9.81, 0.0]), ..(*row).clone() }).collect();
        let said: Vec<&Measurement> = said.iter().collect();
        let other = diagnose(&arm, &sensor(), &said, &options).unwrap();
        assert!(other.gravity_m_s2.is_none());
        assert!((other.effects[0].magnitude.value / effect.magnitude.value - 1.0).abs() < 1e-9);
    }
}
