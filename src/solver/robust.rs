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

/// Readings that are far off in a row: a step or another session.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Events {
    /// They count like all others: what they are is to be found out.
    Counted,
    /// They count as little as single ones: the rest is to be told without them.
    #[default]
    LeftOut,
}

/// Weights of readings with these squared residuals, of so many equations each, in the order of measuring (Huber's, on the squares): one
/// for all but rare ones, and for those of an [`event`] where these are counted.
#[must_use]
pub(crate) fn weights(squares: &[f64], counts: &[usize], events: Events) -> Vec<f64> {
    let mut weights = by_size(squares, counts);
    if events == Events::LeftOut {
        return weights;
    }
    weights.iter_mut().zip(event(squares, counts)).filter(|(_, event)| *event).for_each(|(weight, _)| *weight = 1.0);
    weights
}

fn by_size(squares: &[f64], counts: &[usize]) -> Vec<f64> {
    let level = level(squares, counts);
    // Twice as far off counts a sixteenth, then less and less: an outlier tells nothing.
    let weight = |(square, count): (&f64, &usize)| {
        let limit = rare(*count) * level;
        if *square <= limit { 1.0 } else { (limit / square) * (limit / square) }
    };
    squares.iter().zip(counts).map(weight).collect()
}

/// Weights with which no reading pulls more than a typical one does (Huber's, with half of the readings beyond the bend): the loss is
/// convex, so that a fit with them ends at the same place wherever it starts, and good readings outvote bad ones.
#[must_use]
pub(crate) fn bounded(squares: &[f64], counts: &[usize]) -> Vec<f64> {
    let level = level(squares, counts);
    let weight = |(square, count): (&f64, &usize)| libm::sqrt((level * median(*count) / square.max(1e-300)).min(1.0));
    squares.iter().zip(counts).map(weight).collect()
}

/// Which readings are far off in a run of neighbours, in the order of measuring, that is longer than chance would have it: a step, or
/// another session, and no errors of single readings.
#[must_use]
pub(crate) fn event(squares: &[f64], counts: &[usize]) -> Vec<bool> {
    let far: Vec<bool> = by_size(squares, counts).into_iter().map(|weight| weight < FAR).collect();
    let total = far.len() as f64;
    let share = far.iter().filter(|far| **far).count() as f64 / total.max(1.0);
    let mut event = vec![false; far.len()];
    let mut begin = 0;
    while begin < far.len() {
        let run = far[begin..].iter().take_while(|far| **far).count();
        if run > 1 && total * libm::pow(share, run as f64) < BY_CHANCE {
            event[begin..begin + run].fill(true);
        }
        begin += run + 1;
    }
    event
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::distribution::chi_squared_tail;

    /// Both tables against the distribution itself.
    #[test]
    fn one_square_in_a_thousand_is_rare_and_half_of_them_are_below_the_median() {
        for equations in 1..=6 {
            let tail = |value: f64| chi_squared_tail(value, equations as f64);
            assert!((tail(rare(equations)) - 1e-3).abs() < 1e-5, "{equations}: {}", tail(rare(equations)));
            assert!((tail(median(equations)) - 0.5).abs() < 2e-4, "{equations}: {}", tail(median(equations)));
        }
    }

    /// However large the noise is that all share, a reading twice as far off as is rare counts a sixteenth: its square is four times too
    /// large.
    #[test]
    fn weights_do_not_hang_on_the_unit_of_the_noise() {
        for unit in [1e-3, 1.0, 50.0] {
            let mut squares = vec![median(3) * unit; 20];
            squares.extend([4.0 * rare(3) * unit, rare(3) * unit]);
            let found = weights(&squares, &[3; 22], Events::Counted);
            assert!(found[..20].iter().all(|weight| *weight == 1.0));
            assert!((found[20] - 1.0 / 16.0).abs() < 1e-12 && (found[21] - 1.0).abs() < 1e-9, "{found:?}");
        }
    }

    #[test]
    fn the_level_is_that_of_most_readings() {
        // Squares of three equations with sigma 3: the median is 9 times the table's.
        let squares: Vec<f64> = (0..100).map(|at| if at % 9 == 0 { 1e6 } else { 9.0 * median(3) }).collect();
        assert!((level(&squares, &[3; 100]) - 9.0).abs() < 1e-12);
        let weights = weights(&squares, &[3; 100], Events::Counted);
        assert!(weights.iter().enumerate().all(|(at, weight)| if at % 9 == 0 { *weight < 1e-6 } else { *weight == 1.0 }));
    }

    #[test]
    fn neighbours_that_are_far_off_together_are_one_event() {
        let of = |far: &dyn Fn(usize) -> bool| {
            let squares: Vec<f64> = (0..200).map(|row| if far(row) { 1e6 } else { median(3) }).collect();
            event(&squares, &[3; 200])
        };
        // One in ten here and there: two neighbours are chance.
        assert!(!of(&|row| row % 10 == 0 || row == 51).contains(&true));
        // The last forty of two hundred.
        assert_eq!(of(&|row| row >= 160), (0..200).map(|row| row >= 160).collect::<Vec<_>>());
        // A block beside some that are alone.
        let both = of(&|row| row % 25 == 0 || (60..68).contains(&row));
        assert_eq!((both[25], both[61]), (false, true));
    }
}
