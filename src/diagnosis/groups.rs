//! Readings that are not independent: several targets of one pose, repeats without a move, and the same configuration read again.
//! What geometry and effects leave there is the arm's, once, and the sensor's, each time: such readings tell the sensor's noise, and count
//! for less than as many that are independent.

use nalgebra::{UnitQuaternion, Vector3};

use super::conditions::centre;
use super::settings::Noise;
use crate::arm::frames::rotation_vector;
use crate::measurement::Measurement;
use crate::measurement::equations::{COMPONENTS, Equations};
use crate::solver::robust::{median, rare};

/// Rows of the same configuration.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Groups {
    /// Group of each row, numbered by first appearance.
    pub(crate) of: Vec<usize>,
    /// Rows of each group.
    pub(crate) rows: Vec<Vec<usize>>,
}

/// Noise from repeats.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Repeats {
    /// One sigma per axis, m.
    pub(crate) position_m: f64,
    /// One sigma of an orientation about an axis, rad, where orientations were read.
    pub(crate) orientation_rad: Option<f64>,
    /// Degrees of freedom.
    pub(crate) degrees_of_freedom: f64,
    /// Whether the arm moved between the readings: if not, they show the sensor alone.
    pub(crate) moved: bool,
}

impl Groups {
    /// Rows of each group that carry the same.
    #[must_use]
    pub(crate) fn alike(&self, measurements: &[&Measurement]) -> Vec<Vec<usize>> {
        let mut units: Vec<Vec<usize>> = Vec::new();
        for rows in &self.rows {
            let first = units.len();
            for row in rows {
                let payload = measurements[*row].payload_kg;
                match units[first..].iter_mut().find(|unit| measurements[unit[0]].payload_kg == payload) {
                    Some(unit) => unit.push(*row),
                    None => units.push(vec![*row]),
                }
            }
        }
        units
    }
}

/// Groups `measurements` by configuration.
#[must_use]
pub(crate) fn groups(measurements: &[&Measurement], settings: &Noise) -> Groups {
    let total = measurements.len();
    let mut by_first: Vec<usize> = (0..total).collect();
    let first = |row: usize| measurements[row].joints.first().copied().unwrap_or(0.0);
    by_first.sort_by(|a, b| first(*a).total_cmp(&first(*b)).then(a.cmp(b)));
    let alike = |a: usize, b: usize| {
        let (a, b) = (&measurements[a].joints, &measurements[b].joints);
        a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= settings.same_configuration)
    };
    // Each row joins the first row that is like it and has no other to join.
    let mut head: Vec<Option<usize>> = vec![None; total];
    for (place, row) in by_first.iter().enumerate() {
        if head[*row].is_some() {
            continue;
        }
        head[*row] = Some(*row);
        for other in &by_first[place + 1..] {
            if first(*other) - first(*row) > settings.same_configuration {
                break;
            }
            if head[*other].is_none() && alike(*row, *other) {
                head[*other] = Some(*row);
            }
        }
    }
    let mut heads: Vec<usize> = Vec::new();
    let mut rows: Vec<Vec<usize>> = Vec::new();
    let mut of = vec![0; total];
    for row in 0..total {
        let head = head[row].unwrap_or(row);
        let group = heads.iter().rposition(|known| *known == head).unwrap_or_else(|| {
            heads.push(head);
            rows.push(Vec::new());
            heads.len() - 1
        });
        of[row] = group;
        rows[group].push(row);
    }
    Groups { of, rows }
}

/// The noise of readings that should be equal: same configuration, target, session, payload, approach and temperature. Robust: pairs
/// that disagree by far do not count. Readings between which the arm moved come first; where there are too few, those between which
/// it did not.
#[must_use]
pub(crate) fn repeats(measurements: &[&Measurement], groups: &Groups, settings: &Noise) -> Option<Repeats> {
    let mut in_time: Vec<usize> = (0..measurements.len()).collect();
    in_time.sort_by(|a, b| measurements[*a].time_s.total_cmp(&measurements[*b].time_s).then(a.cmp(b)));
    let mut place = vec![0; measurements.len()];
    for (at, row) in in_time.iter().enumerate() {
        place[*row] = at;
    }
    // Coordinates that every reading has.
    // A ball that is put into its socket again tells nothing of the sensor.
    let read = [0, 1, 2].map(|axis| measurements.iter().all(|row| !row.unread[axis] && row.is_in_frame()));
    let axes = read.iter().filter(|read| **read).count();
    let equal = |a: &Measurement, b: &Measurement| {
        let near = |a: Option<f64>, b: Option<f64>| match (a, b) {
            (Some(a), Some(b)) => (a - b).abs() <= settings.same_temperature_k,
            (a, b) => a.is_none() && b.is_none(),
        };
        a.target == b.target
            && a.session == b.session
            && a.payload_kg == b.payload_kg
            && a.approach == b.approach
            && near(a.ambient_c, b.ambient_c)
            && a.temperatures_c.iter().zip(&b.temperatures_c).all(|(a, b)| near(Some(*a), Some(*b)))
    };
    let (mut of_visits, mut between) = (Vec::new(), Vec::new());
    let (mut turns_of_visits, mut turns_between) = (Vec::new(), Vec::new());
    for rows in &groups.rows {
        let mut left = rows.clone();
        left.sort_by_key(|row| place[*row]);
        while let Some(first) = left.first().copied() {
            let (alike, others): (Vec<usize>, Vec<usize>) =
                left.iter().partition(|row| equal(measurements[first], measurements[**row]));
            left = others;
            // Readings in a row are of one visit.
            let mut visits: Vec<Vec<usize>> = Vec::new();
            for row in alike {
                let visit = visits.last_mut().filter(|visit| {
                    let last = visit.last().copied().unwrap_or(row);
                    (place[last] + 1..place[row]).all(|at| groups.of[in_time[at]] == groups.of[row])
                });
                match visit {
                    Some(visit) => visit.push(row),
                    None => visits.push(vec![row]),
                }
            }
            let point =
                |row: &usize| Vector3::from_fn(|axis, _| if read[axis] { measurements[*row].position_m[axis] } else { 0.0 });
            let points = |rows: &[usize]| rows.iter().map(point).collect::<Vec<_>>();
            // From the orientation of the first.
            let turns = |rows: &[usize]| -> Vec<Vector3<f64>> {
                let orientations: Option<Vec<UnitQuaternion<f64>>> =
                    rows.iter().map(|row| measurements[*row].orientation()).collect();
                let orientations = orientations.unwrap_or_default();
                orientations.iter().map(|orientation| rotation_vector(&(orientations[0].inverse() * orientation))).collect()
            };
            for visit in &visits {
                of_visits.extend(contrasts(&points(visit)));
                turns_of_visits.extend(contrasts(&turns(visit)));
            }
            // One reading of each visit, so that the sensor's noise is there once.
            let firsts: Vec<usize> = visits.iter().filter_map(|visit| visit.first().copied()).collect();
            between.extend(contrasts(&points(&firsts)));
            turns_between.extend(contrasts(&turns(&firsts)));
        }
    }
    // One sigma and its degrees of freedom.
    let sigma = |squares: &[f64], axes: usize| {
        if squares.len() < settings.contrasts || axes == 0 {
            return None;
        }
        let mut sorted = squares.to_vec();
        sorted.sort_by(f64::total_cmp);
        let level = sorted[sorted.len() / 2] / median(axes);
        let good: Vec<f64> = sorted.into_iter().filter(|square| *square <= rare(axes) * level).collect();
        let degrees_of_freedom = axes as f64 * good.len() as f64;
        let mean = good.iter().sum::<f64>() / degrees_of_freedom;
        (mean > 0.0).then(|| (libm::sqrt(mean), degrees_of_freedom))
    };
    let noise = |squares: &[f64], turns: &[f64], moved: bool| {
        let (position_m, degrees_of_freedom) = sigma(squares, axes)?;
        Some(Repeats { position_m, orientation_rad: sigma(turns, 3).map(|(sigma, _)| sigma), degrees_of_freedom, moved })
    };
    noise(&between, &turns_between, true).or_else(|| noise(&of_visits, &turns_of_visits, false))
}

/// Squares of orthonormal contrasts (Helmert's) of readings of the same point: each is χ² with three degrees of freedom times the
/// variance of an axis.
fn contrasts(points: &[Vector3<f64>]) -> Vec<f64> {
    (1..points.len())
        .map(|count| {
            let before = centre(&points[..count]);
            (points[count] - before).norm_squared() * count as f64 / (count + 1) as f64
        })
        .collect()
}

/// Weights of rows whose residuals (of all `equations`, whitened) are alike within a group: a group of `n` rows with the
/// intraclass correlation ρ tells as much as `n / (1 + (n − 1) ρ)` independent ones. `good`: rows that are no outliers. Also ρ.
#[must_use]
pub(crate) fn weights(
    groups: &Groups,
    residual: &[f64],
    equations: &Equations,
    good: &[bool],
    settings: &Noise,
) -> (Vec<f64>, f64) {
    // What was read of a component of the pose.
    let of = |row: usize, component: usize| {
        let at = equations.of(row).find(|equation| equations.component(*equation) == component);
        at.map(|equation| residual[equation])
    };
    // Analysis of variance: within groups, and all.
    let (mut within, mut of_within, mut all, mut of_all, mut degrees_of_freedom) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for rows in &groups.rows {
        let rows: Vec<usize> = rows.iter().copied().filter(|row| good[*row]).collect();
        if rows.len() < 2 {
            continue;
        }
        for component in 0..COMPONENTS {
            let values: Vec<f64> = rows.iter().filter_map(|row| of(*row, component)).collect();
            if values.len() < 2 {
                continue;
            }
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            for value in &values {
                within += (value - mean) * (value - mean);
                all += value * value;
            }
            of_within += (values.len() - 1) as f64;
            of_all += values.len() as f64;
        }
        degrees_of_freedom += (rows.len() - 1) as f64;
    }
    if degrees_of_freedom == 0.0 {
        return (vec![1.0; groups.of.len()], 0.0);
    }
    let correlation = if degrees_of_freedom < settings.pairs || all <= 0.0 {
        settings.few_pairs_correlation
    } else {
        (1.0 - (within / of_within) / (all / of_all)).clamp(0.0, 1.0)
    };
    let weight = |row: usize| 1.0 / (1.0 + (groups.rows[groups.of[row]].len() - 1) as f64 * correlation);
    ((0..groups.of.len()).map(weight).collect(), correlation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::stream;

    fn row(index: usize, joint: f64, x: f64) -> Measurement {
        Measurement { index, time_s: index as f64, joints: vec![joint, 0.0], position_m: [x, 0.0, 0.0], ..Measurement::default() }
    }

    #[test]
    fn repeats_are_recognised_through_rounding_and_outliers() {
        let mut stream = stream(1, "test/repeats");
        let mut rows = Vec::new();
        for index in 0..400 {
            let mut point = row(index, 0.01 * (index % 40) as f64 + 1e-5 * stream.normal(), 0.0);
            point.position_m = [0, 1, 2].map(|_| 20e-6 * stream.normal());
            let turn = Vector3::from_fn(|_, _| 5e-5 * stream.normal());
            point.orientation_xyzw = Some(UnitQuaternion::from_scaled_axis(turn).coords.into());
            // A few are two millimetres off, as in a real file.
            if index % 100 == 7 {
                point.position_m[0] += 2e-3;
            }
            rows.push(point);
        }
        let rows: Vec<&Measurement> = rows.iter().collect();
        let groups = groups(&rows, &Noise::default());
        assert_eq!(groups.rows.len(), 40);
        let found = repeats(&rows, &groups, &Noise::default()).unwrap();
        assert!(found.moved && (found.position_m / 20e-6 - 1.0).abs() < 0.05, "{found:?}");
        assert!(found.degrees_of_freedom > 950.0);
        assert!((found.orientation_rad.unwrap() / 5e-5 - 1.0).abs() < 0.05, "{found:?}");
    }

    #[test]
    fn readings_without_a_move_show_the_sensor_alone() {
        let mut stream = stream(2, "test/repeats");
        let mut rows: Vec<Measurement> = (0..120).map(|index| row(index, (index / 3) as f64, 0.0)).collect();
        rows.iter_mut().for_each(|row| row.position_m = [0, 1, 2].map(|_| 1e-5 * stream.normal()));
        let rows: Vec<&Measurement> = rows.iter().collect();
        let found = repeats(&rows, &groups(&rows, &Noise::default()), &Noise::default()).unwrap();
        assert!(!found.moved && (found.position_m / 1e-5 - 1.0).abs() < 0.15, "{found:?}");
    }

    #[test]
    fn alike_residuals_count_once_and_independent_ones_each_time() {
        let rows: Vec<Measurement> = (0..80).map(|index| row(index, (index / 4) as f64, 0.0)).collect();
        let rows: Vec<&Measurement> = rows.iter().collect();
        let groups = groups(&rows, &Noise::default());
        let sensor = crate::measurement::Sensor {
            position_in_base: nalgebra::Point3::origin(),
            position_sigma_m: 1.0,
            position_sigma_per_m: 0.0,
            orientation_sigma_rad: None,
            temperature_sigma_k: None,
            distances: Vec::new(),
            view: None,
        };
        let equations = Equations::new(&sensor, &rows);
        let mut stream = stream(3, "test/repeats");
        let shared: Vec<f64> = (0..20).map(|_| stream.normal()).collect();
        let alike: Vec<f64> = (0..240).map(|at| shared[at / 12]).collect();
        let (weights_alike, correlation) = weights(&groups, &alike, &equations, &[true; 80], &Noise::default());
        assert!((correlation - 1.0).abs() < 1e-9 && (weights_alike[0] - 0.25).abs() < 1e-9);
        let independent: Vec<f64> = (0..240).map(|_| stream.normal()).collect();
        let (free, correlation) = weights(&groups, &independent, &equations, &[true; 80], &Noise::default());
        assert!(correlation < 0.1 && free[0] > 0.75, "{correlation}");
    }
}
