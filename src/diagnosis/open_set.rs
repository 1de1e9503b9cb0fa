//! Whether structure remains in the residual of the best model: along each joint's motion, and as a vector, against everything
//! that was recorded.

use nalgebra::Vector3;

use super::conclusion::{Trend, Variable};
use super::conditions::Conditions;
use super::outcome::Map;
use crate::effects::signature::shape::Reading;
use crate::seed::stream;

/// What the tests say.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Structure {
    /// Of there being none, the best of all tests accounted for.
    pub(crate) p_value: f64,
    /// The strongest.
    pub(crate) strongest: Trend,
    /// By how many standard deviations it stands out.
    pub(crate) strength: f64,
}

/// Neighbours in a variable, and what they say.
struct Order {
    variable: Variable,
    /// Rows from the smallest value on.
    rows: Vec<usize>,
}

/// Orders of the readings `rows` of `conditions` by everything that was recorded; as places in `rows`.
fn orders(conditions: &Conditions, rows: &[usize]) -> Vec<Order> {
    let readings: Vec<&Reading> = rows.iter().map(|row| &conditions.readings[*row]).collect();
    let by = |variable: Variable, value: &dyn Fn(usize) -> f64| {
        let mut rows: Vec<usize> = (0..readings.len()).collect();
        rows.sort_by(|a, b| value(*a).total_cmp(&value(*b)).then(a.cmp(b)));
        Order { variable, rows }
    };
    let mut orders = Vec::new();
    for joint in 0..conditions.columns.travel.len() {
        orders.push(by(Variable::Angle(joint + 1), &|row| readings[row].joints[joint]));
        orders.push(by(Variable::Torque(joint + 1), &|row| readings[row].posture.torque(joint)));
    }
    if conditions.columns.time {
        orders.push(by(Variable::Time, &|row| readings[row].share));
    }
    if conditions.columns.temperature {
        orders.push(by(Variable::Temperature, &|row| readings[row].rise_k[0]));
    }
    orders
}

/// Tests `residual` (one vector per row, in sigmas times the root of the row's weight) for likeness of neighbours in every order. The
/// rows of each of `units` count as one: readings of one configuration are alike without any structure between configurations.
#[must_use]
pub(crate) fn structure(
    conditions: &Conditions,
    residual: &[Vector3<f64>],
    units: &[Vec<usize>],
    permutations: usize,
) -> Structure {
    let rows: Vec<usize> = units.iter().map(|unit| unit[0]).collect();
    let residual: Vec<Vector3<f64>> = units
        .iter()
        .map(|unit| unit.iter().map(|row| residual[*row]).sum::<Vector3<f64>>() / (unit.len() as f64).sqrt())
        .collect();
    let residual = residual.as_slice();
    let total = residual.len();
    let orders = orders(conditions, &rows);
    // Along each joint's motion, too: a joint's error is a scalar that may change sign with the pose as a vector does.
    let joints = conditions.columns.travel.len();
    let directions: Vec<Vec<Vector3<f64>>> = (0..joints)
        .map(|joint| {
            let moved = |row: usize| {
                let [x, y, z, ..] = conditions.readings[rows[row]].moved(joint, 1.0);
                Vector3::new(x, y, z)
            };
            let all: Vec<Vector3<f64>> = (0..total).map(moved).collect();
            let size = (all.iter().map(Vector3::norm_squared).sum::<f64>() / total.max(1) as f64).sqrt().max(1e-9);
            all.into_iter().map(|direction| direction / size).collect()
        })
        .collect();
    let statistics = |residual: &[Vector3<f64>]| -> Vec<f64> {
        let mut values = Vec::new();
        let scalars: Vec<Vec<f64>> = directions
            .iter()
            .map(|of_joint| of_joint.iter().zip(residual).map(|(direction, residual)| direction.dot(residual)).collect())
            .collect();
        for order in &orders {
            let pairs = || order.rows.windows(2).chain(order.rows.windows(3));
            let alike: f64 = pairs().map(|pair| residual[pair[0]].dot(&residual[pair[pair.len() - 1]])).sum();
            values.push(alike);
            for scalar in &scalars {
                values.push(pairs().map(|pair| scalar[pair[0]] * scalar[pair[pair.len() - 1]]).sum());
            }
        }
        values
    };
    let observed = statistics(residual);
    let mut stream = stream(1, "diagnosis/permutations");
    let mut shuffled = residual.to_vec();
    let permuted: Vec<Vec<f64>> = (0..permutations)
        .map(|_| {
            stream.shuffle(&mut shuffled);
            statistics(&shuffled)
        })
        .collect();
    let count = observed.len();
    let (mut mean, mut deviation) = (vec![0.0; count], vec![0.0; count]);
    for at in 0..count {
        mean[at] = permuted.iter().map(|values| values[at]).sum::<f64>() / permutations as f64;
        let variance = permuted.iter().map(|values| (values[at] - mean[at]) * (values[at] - mean[at])).sum::<f64>();
        deviation[at] = (variance / permutations as f64).sqrt().max(1e-12);
    }
    let strongest = |values: &[f64]| {
        let standard = |at: usize| (values[at] - mean[at]) / deviation[at];
        (0..count).map(|at| (at, standard(at))).max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0))
    };
    let (at, strength) = strongest(&observed);
    let above = permuted.iter().filter(|values| strongest(values).1 >= strength).count();
    let per_order = 1 + joints;
    // The vector itself stands first.
    let along = Some(at % per_order).filter(|joint| *joint > 0);
    Structure {
        p_value: (above + 1) as f64 / (permutations + 1) as f64,
        strongest: Trend { along, follows: orders[at / per_order].variable },
        strength,
    }
}

/// The mean residual (m) along each joint's motion by its angle, as an angle of the joint.
#[must_use]
pub(crate) fn maps(conditions: &Conditions, residual_m: &[Vector3<f64>], bins: usize) -> Vec<Map> {
    let joints = conditions.columns.travel.len();
    (0..joints)
        .map(|joint| {
            let [low, high] = conditions.columns.travel[joint];
            let width = ((high - low) / bins as f64).max(1e-12);
            let [mut over, mut under, mut squares] = [0, 1, 2].map(|_| vec![0.0; bins]);
            for (reading, residual) in conditions.readings.iter().zip(residual_m) {
                let bin = (((reading.joints[joint] - low) / width) as usize).min(bins - 1);
                let [x, y, z, ..] = reading.moved(joint, 1.0);
                let direction = Vector3::new(x, y, z);
                over[bin] += direction.dot(residual);
                under[bin] += direction.norm_squared();
                squares[bin] += residual.norm_squared() / 3.0 * direction.norm_squared();
            }
            let of = |value: fn(f64, f64, f64) -> f64| -> Vec<f64> {
                (0..bins).map(|bin| if under[bin] > 1e-9 { value(over[bin], under[bin], squares[bin]) } else { 0.0 }).collect()
            };
            Map {
                joint: joint + 1,
                angle: (0..bins).map(|bin| low + (bin as f64 + 0.5) * width).collect(),
                mean: of(|over, under, _| over / under),
                standard_error: of(|_, under, squares| squares.sqrt() / under),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::tests::with_analysis;

    /// Displacement of the target of each reading by a turn of `joint` that `of` gives by that joint's angle, m.
    fn turned(conditions: &Conditions, joint: usize, of: impl Fn(f64) -> f64) -> Vec<Vector3<f64>> {
        let moved = |reading: &Reading| {
            let [x, y, z, ..] = reading.moved(joint, of(reading.joints[joint]));
            Vector3::new(x, y, z)
        };
        conditions.readings.iter().map(moved).collect()
    }

    #[test]
    fn structure_is_seen_where_it_is_and_not_in_noise() {
        with_analysis(
            |_, _, _, _, _| 0.0,
            |analysis| {
                let conditions = analysis.conditions;
                let units: Vec<Vec<usize>> = (0..conditions.readings.len()).map(|row| vec![row]).collect();
                let size = |residual: &[Vector3<f64>]| residual.iter().map(Vector3::norm).sum::<f64>() / residual.len() as f64;
                let residual = turned(conditions, 2, |angle| (2.0 * angle).sin());
                let scale = 1.0 / size(&residual);
                let residual: Vec<Vector3<f64>> = residual.into_iter().map(|one| one * scale).collect();
                let found = structure(conditions, &residual, &units, 99);
                assert_eq!(found.p_value, 0.01);
                assert_eq!((found.strongest.along, found.strongest.follows), (Some(3), Variable::Angle(3)));
                // Of noise, whatever is seen first is seen as often as its p value says: below 0.1 in a tenth of the draws.
                let mut draws = stream(8, "test/open-set");
                let low = (0..40)
                    .filter(|_| {
                        let noise: Vec<Vector3<f64>> = residual.iter().map(|_| Vector3::from_fn(|_, _| draws.normal())).collect();
                        structure(conditions, &noise, &units, 99).p_value <= 0.1
                    })
                    .count();
                // Of 40 more than 10 in one of 200 cases.
                assert!(low <= 10, "{low}");
            },
        );
    }

    #[test]
    fn a_map_is_the_turn_by_angle() {
        with_analysis(
            |_, _, _, _, _| 0.0,
            |analysis| {
                let conditions = analysis.conditions;
                for joint in [0, 4] {
                    let [low, high] = conditions.columns.travel[joint];
                    let slope = |angle: f64| 1e-3 * (angle - low) / (high - low);
                    let map = &maps(conditions, &turned(conditions, joint, slope), 8)[joint];
                    assert_eq!((map.joint, map.angle.len()), (joint + 1, 8));
                    for (bin, (angle, mean)) in map.angle.iter().zip(&map.mean).enumerate() {
                        assert!((slope(*angle) - 1e-3 * (bin as f64 + 0.5) / 8.0).abs() < 1e-12);
                        // Somewhere in the bin.
                        assert!((mean - slope(*angle)).abs() <= 1e-3 / 16.0 + 1e-12, "{mean} at {angle}");
                    }
                }
            },
        );
    }
}
