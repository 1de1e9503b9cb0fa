//! Readings that are far off: how far is far, by the median of all, and how little such a reading may count.

/// Squares (in sigmas) beyond which one reading in a thousand lies where the noise is Gaussian, by the number of its equations.
const RARE: [f64; 7] = [1.0, 10.83, 13.82, 16.27, 18.47, 20.52, 22.46];
/// Medians of the same squares.
const MEDIAN: [f64; 7] = [1.0, 0.455, 1.386, 2.366, 3.357, 4.351, 5.348];
/// A row that counts less than this is far off by twice the distance that is rare.
pub(crate) const FAR: f64 = 1.0 / 16.0;
/// Expected number of runs as long by chance below which neighbours that are far off are one event: a step or a session, not errors
/// of single readings.
const BY_CHANCE: f64 = 1e-3;

/// Beyond what one square in a thousand lies where `equations` numbers have Gaussian noise, in sigmas.
#[must_use]
pub(crate) fn rare(equations: usize) -> f64 {
    RARE[equations.min(RARE.len() - 1)]
}

/// The median of the squares of `equations` numbers with Gaussian noise, in sigmas.
#[must_use]
pub(crate) fn median(equations: usize) -> f64 {
    MEDIAN[equations.min(MEDIAN.len() - 1)]
}

/// The typical square of a good reading, over one sigma's. `counts`: equations of each.
#[must_use]
pub(crate) fn level(squares: &[f64], counts: &[usize]) -> f64 {
    let mut sorted: Vec<f64> =
        squares.iter().zip(counts).filter(|(_, count)| **count > 0).map(|(square, count)| square / median(*count)).collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(1.0).max(1e-12)
}

/// Weights of readings with these squared residuals, of so many equations each, in the order of measuring (Huber's, on the squares): one
/// for all but rare ones, and for those that have neighbours like them ([`alone`]).
#[must_use]
pub(crate) fn weights(squares: &[f64], counts: &[usize]) -> Vec<f64> {
    let level = level(squares, counts);
    // Twice as far off counts a quarter, then less and less: an outlier tells nothing.
    let weight = |(square, count): (&f64, &usize)| {
        let limit = rare(*count) * level;
        if *square <= limit { 1.0 } else { (limit / square) * (limit / square) }
    };
    let mut weights: Vec<f64> = squares.iter().zip(counts).map(weight).collect();
    let far: Vec<bool> = weights.iter().map(|weight| *weight < FAR).collect();
    for (weight, (far, alone)) in weights.iter_mut().zip(far.iter().zip(alone(&far))) {
        if *far && !alone {
            *weight = 1.0;
        }
    }
    weights
}

/// Which of the rows that are `far` off are so by themselves: not in a run of neighbours, in the order of measuring, that is longer than
/// chance would have it.
#[must_use]
pub(crate) fn alone(far: &[bool]) -> Vec<bool> {
    let total = far.len() as f64;
    let share = far.iter().filter(|far| **far).count() as f64 / total.max(1.0);
    let mut alone = far.to_vec();
    let mut begin = 0;
    while begin < far.len() {
        let run = far[begin..].iter().take_while(|far| **far).count();
        if run > 1 && total * libm::pow(share, run as f64) < BY_CHANCE {
            alone[begin..begin + run].fill(false);
        }
        begin += run + 1;
    }
    alone
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_level_is_that_of_most_readings() {
        // Squares of three equations with sigma 3: the median is 9 times the table's.
        let squares: Vec<f64> = (0..100).map(|at| if at % 9 == 0 { 1e6 } else { 9.0 * 2.366 }).collect();
        assert!((level(&squares, &[3; 100]) - 9.0).abs() < 1e-12);
        let weights = weights(&squares, &[3; 100]);
        assert!(weights.iter().enumerate().all(|(at, weight)| if at % 9 == 0 { *weight < 1e-6 } else { *weight == 1.0 }));
    }

    #[test]
    fn neighbours_that_are_far_off_together_are_no_errors_of_single_readings() {
        let far = |rows: &dyn Fn(usize) -> bool| (0..200).map(rows).collect::<Vec<bool>>();
        // One in ten here and there: two neighbours are chance.
        let scattered = far(&|row| row % 10 == 0 || row == 51);
        assert_eq!(alone(&scattered), scattered);
        // The last forty of two hundred.
        assert!(!alone(&far(&|row| row >= 160)).contains(&true));
        // A block beside some that are alone.
        let both = alone(&far(&|row| row % 25 == 0 || (60..68).contains(&row)));
        assert_eq!((both[25], both[61]), (true, false));
    }
}
