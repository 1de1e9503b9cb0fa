//! A periodogram of what remains, against each joint's angle: gear ripple of any tooth count, which a library that lists them all at
//! every joint would pay for in each (Lomb and Scargle's, along the joint's motion and with the geometry fitted beside it).

use nalgebra::{Cholesky, DMatrix, DVector};

use super::evidence::Evidence;
use super::linear::Linear;
use super::settings;
use crate::effects::kind::joint_eccentricity::Harmonic;
use crate::effects::signature::library::RIPPLES;
use crate::effects::signature::shape::Shape;
use crate::numerics::gram;

/// Sine squared of the angle between two columns below which they are one thing: products of thousands of readings are no more exact.
const SINGULAR: f64 = 1e-6;

/// A ripple found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ripple {
    /// The joint, from 0.
    pub(super) joint: usize,
    /// Periods per turn.
    pub(super) waves: u16,
    /// By how much the residual's square drops, in squares of the noise.
    pub(super) drop: f64,
}

/// Cosine and sine of whole multiples of angles, one multiple after the other: each is the last one turned by the angle itself.
struct Turning {
    /// Cosine and sine of each angle.
    step: Vec<(f64, f64)>,
    /// Of the next multiple.
    next: Vec<(f64, f64)>,
}

impl Turning {
    /// From multiple `first` on.
    fn new(angles: impl Iterator<Item = f64> + Clone, first: u16) -> Turning {
        let of = |factor: f64| {
            let cosine_sine = |angle: f64| {
                let (sine, cosine) = libm::sincos(factor * angle);
                (cosine, sine)
            };
            angles.clone().map(cosine_sine).collect()
        };
        Turning { step: of(1.0), next: of(f64::from(first)) }
    }

    /// Puts cosine and sine of the next multiple of each angle into the columns of `wave`.
    fn next(&mut self, wave: &mut DMatrix<f64>) {
        let (cosines, sines) = wave.as_mut_slice().split_at_mut(self.step.len());
        for (((now, (c, s)), cosine), sine) in self.next.iter_mut().zip(&self.step).zip(cosines).zip(sines) {
            (*cosine, *sine) = *now;
            *now = (now.0 * c - now.1 * s, now.0 * s + now.1 * c);
        }
    }
}

/// Angles that differ by less are one, rad.
const ONE_ANGLE: f64 = 1e-6;

/// Periods per turn up to which a ripple shows in readings at these angles (rad): finer ones look like coarser ones where all angles lie
/// on a grid, or do not differ at all.
pub(super) fn finest(angles: impl Iterator<Item = f64>) -> u16 {
    let mut angles: Vec<f64> = angles.collect();
    angles.sort_by(f64::total_cmp);
    let gaps = angles.windows(2).map(|pair| pair[1] - pair[0]).filter(|gap| *gap > ONE_ANGLE);
    let limit = std::f64::consts::PI / gaps.fold(f64::INFINITY, f64::min);
    limit.min(f64::from(*RIPPLES.end())) as u16
}

/// The strongest ripples in what geometry and `members` leave of the rows that `counts`: beside those members that follow a joint's angle,
/// and in their place, for a map, or ripples that are in play already, may stand for one that is not.
pub(super) fn look(
    linear: &Linear<'_>,
    evidence: &Evidence<'_>,
    members: &[(usize, usize)],
    counts: &(dyn Fn(usize) -> bool + Sync),
) -> Vec<Ripple> {
    let coefficients = evidence.coefficients(members);
    let residual = linear.left(&evidence.marginal.geometry(&coefficients), &linear.made(&coefficients));
    let (level, settings) = (evidence.noise_level(members), &evidence.settings.ripple);
    let mut found = scan(linear, &residual, level, counts, settings);
    let follows_angle = |member: usize| evidence.candidates.hypotheses[member].shape.of_angle().is_some();
    let of_angles = members.iter().filter(|(member, _)| follows_angle(*member));
    let columns: Vec<_> = of_angles.map(|(member, _)| evidence.candidates.columns(*member)).collect();
    if !columns.is_empty() {
        let of_angles: Vec<(usize, f64)> =
            coefficients.into_iter().filter(|(column, _)| columns.iter().any(|columns| columns.contains(column))).collect();
        let put_back = residual + linear.made(&of_angles);
        found.extend(scan(linear, &put_back, level, counts, settings));
        found.dedup_by_key(|one| (one.joint, one.waves));
    }
    found
}

/// The strongest ripple of each joint in `residual` (m, rad), whose noise has the mean square `level` in declared sigmas; the strongest
/// first, none that is weak or a candidate in play already. `counts`: rows that are looked at.
fn scan(
    linear: &Linear<'_>,
    residual: &DVector<f64>,
    level: f64,
    counts: &(dyn Fn(usize) -> bool + Sync),
    settings: &settings::Ripple,
) -> Vec<Ripple> {
    use rayon::prelude::*;
    let (readings, candidates) = (linear.readings, linear.candidates);
    let geometry = linear.rows.jacobian.ncols();
    let mut jacobian = linear.rows.whitening.of(&linear.rows.jacobian);
    for row in (0..readings.len()).filter(|row| !counts(*row)) {
        linear.rows.equations.of(row).for_each(|equation| jacobian.row_mut(equation).fill(0.0));
    }
    let residual = linear.in_sigmas(residual);
    let Some(normal) = Cholesky::new(gram(&jacobian) + DMatrix::identity(geometry, geometry)) else {
        return Vec::new();
    };
    let jacobian = jacobian.transpose();
    let lower = normal.l();
    let joints = readings.first().map_or(0, |reading| reading.joints.len());
    let known = |joint: usize, waves: u16| {
        let wave = Shape::Harmonic(Harmonic { joint, order: f64::from(waves) });
        candidates.hypotheses.iter().zip(&candidates.active).any(|(of, active)| *active && of.shape == wave)
    };
    let mut found: Vec<Ripple> = (0..joints)
        .into_par_iter()
        .filter(|joint| !readings[0].slides[*joint])
        .filter_map(|joint| {
            // Of each reading: what a unit turn of the joint does, against geometry, itself and the residual.
            let mut mixed = DMatrix::zeros(geometry, readings.len());
            let (mut own, mut with) = (vec![0.0; readings.len()], vec![0.0; readings.len()]);
            for row in (0..readings.len()).filter(|row| counts(*row)) {
                let moved = linear.rows.whitening.of_row(row, linear.rows.moved(row, joint).as_view());
                for (value, equation) in moved.iter().zip(linear.rows.equations.of(row)) {
                    own[row] += value * value;
                    with[row] += value * residual[equation];
                    mixed.column_mut(row).axpy(*value, &jacobian.column(equation), 1.0);
                }
            }
            let absorbed = lower.solve_lower_triangular(&mixed)?;
            let mut turning = Turning::new(readings.iter().map(|reading| reading.joints[joint]), *RIPPLES.start());
            let mut wave = DMatrix::zeros(readings.len(), 2);
            let mut drop = || -> f64 {
                turning.next(&mut wave);
                let taken = &absorbed * &wave;
                let product = |a: usize, b: usize| -> f64 {
                    let all: f64 = (0..readings.len()).map(|row| wave[(row, a)] * wave[(row, b)] * own[row]).sum();
                    all - taken.column(a).dot(&taken.column(b))
                };
                let right = [0, 1].map(|a| (0..readings.len()).map(|row| wave[(row, a)] * with[row]).sum::<f64>());
                let (aa, ab, bb) = (product(0, 0), product(0, 1), product(1, 1));
                let determinant = aa * bb - ab * ab;
                // Where both are nearly one thing, or geometry, there is no ripple to be seen.
                if determinant <= SINGULAR * aa * bb || aa <= 0.0 || bb <= 0.0 {
                    return 0.0;
                }
                (bb * right[0] * right[0] - 2.0 * ab * right[0] * right[1] + aa * right[1] * right[1]) / determinant / level
            };
            (*RIPPLES.start()..=finest(readings.iter().map(|reading| reading.joints[joint])))
                .map(|waves| Ripple { joint, waves, drop: drop() })
                .filter(|one| one.drop >= settings.worth)
                .max_by(|a, b| a.drop.total_cmp(&b.drop).then(b.waves.cmp(&a.waves)))
        })
        .filter(|one| !known(one.joint, one.waves))
        .collect();
    found.sort_by(|a, b| b.drop.total_cmp(&a.drop).then(a.joint.cmp(&b.joint)));
    found.truncate(settings.most);
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::tests::with_analysis;
    use crate::seed::stream;

    #[test]
    fn a_grid_of_angles_shows_half_as_many_periods_as_it_has_points_per_turn() {
        let grid = |step: f64| finest((0..20).map(|at| f64::from(at * 7 % 20) * step.to_radians()));
        assert_eq!([grid(10.0), grid(2.5), grid(0.01)], [18, 72, *RIPPLES.end()]);
        assert_eq!(finest([0.3; 9].into_iter()), 0);
    }

    #[test]
    fn a_multiple_that_is_turned_to_is_the_one_that_is_computed() {
        let mut draws = stream(1, "test/turning");
        let angles: Vec<f64> = (0..40).map(|_| draws.uniform(-4.0, 4.0)).collect();
        let (first, last) = (*RIPPLES.start(), *RIPPLES.end());
        let mut turning = Turning::new(angles.iter().copied(), first);
        let mut wave = DMatrix::zeros(angles.len(), 2);
        for multiple in first..=last {
            turning.next(&mut wave);
            for (row, angle) in angles.iter().enumerate() {
                let (sine, cosine) = (f64::from(multiple) * angle).sin_cos();
                assert!(
                    (wave[(row, 0)] - cosine).abs() < 1e-11 && (wave[(row, 1)] - sine).abs() < 1e-11,
                    "{multiple} of {angle}"
                );
            }
        }
    }

    /// The drop is that of the least squares of the readings by geometry (with its prior) and the two waves, made in one piece.
    #[test]
    fn a_ripple_is_found_with_the_drop_of_the_dense_least_squares() {
        let (joint, waves) = (2, 37_u16);
        with_analysis(
            |_, joints, _, of, _| if of == joint { 2e-4 * (f64::from(waves) * joints[of] + 0.4).sin() } else { 0.0 },
            |analysis| {
                let linear = analysis.linear;
                let settings = &analysis.options.settings.ripple;
                let found = scan(linear, &linear.residual, 1.0, &|_| true, settings);
                assert_eq!((found[0].joint, found[0].waves), (joint, waves));
                let jacobian = linear.rows.whitening.of(&linear.rows.jacobian);
                let (height, width) = jacobian.shape();
                let left = |more: &DMatrix<f64>| -> f64 {
                    let columns = width + more.ncols();
                    let mut matrix = DMatrix::zeros(height + width, columns);
                    matrix.view_mut((0, 0), (height, width)).copy_from(&jacobian);
                    matrix.view_mut((0, width), (height, more.ncols())).copy_from(more);
                    matrix.view_mut((height, 0), (width, width)).fill_with_identity();
                    let mut right = DVector::zeros(height + width);
                    right.rows_mut(0, height).copy_from(&linear.in_sigmas(&linear.residual));
                    // The prior holds the whole geometry, not its change.
                    right.rows_mut(height, width).copy_from(&-&linear.rows.parameters);
                    let on_columns = matrix.qr().q().tr_mul(&right);
                    right.norm_squared() - on_columns.norm_squared()
                };
                let mut wave = DMatrix::zeros(linear.rows.residual.len(), 2);
                for (row, reading) in linear.readings.iter().enumerate() {
                    let (sine, cosine) = (f64::from(waves) * reading.joints[joint]).sin_cos();
                    for (equation, moved) in linear.rows.equations.of(row).zip(linear.rows.moved(row, joint).iter()) {
                        wave[(equation, 0)] = moved * cosine;
                        wave[(equation, 1)] = moved * sine;
                    }
                }
                let drop = left(&DMatrix::zeros(height, 0)) - left(&linear.rows.whitening.of(&wave));
                assert!((found[0].drop / drop - 1.0).abs() < 1e-6, "{} against {drop}", found[0].drop);
                // Rows that do not count are not looked at.
                assert!(scan(linear, &linear.residual, 1.0, &|_| false, settings).is_empty());
            },
        );
    }
}
