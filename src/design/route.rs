//! An order of configurations in which the moves between them are short.

/// Rounds of turning parts of the route round, at most.
const ROUNDS: usize = 200;
/// A gain that is none.
const NO_GAIN: f64 = 1e-12;

/// The configurations' numbers in an order in which the arm, which begins at `start`, moves little: nearest neighbours, then parts of the route
/// turned round as long as that shortens it (2-opt, Croes 1958). A move is as long as that of the joint that takes longest, in shares of its
/// `travel`.
#[must_use]
pub fn route(configurations: &[Vec<f64>], start: &[f64], travel: &[f64]) -> Vec<usize> {
    let longest = |a: &[f64], b: &[f64]| {
        a.iter().zip(b).zip(travel).map(|((a, b), travel)| (a - b).abs() / travel.max(f64::MIN_POSITIVE)).fold(0.0, f64::max)
    };
    // The start is number 0.
    let count = configurations.len() + 1;
    let at = |number: usize| if number == 0 { start } else { configurations[number - 1].as_slice() };
    let between: Vec<f64> = (0..count * count).map(|pair| longest(at(pair / count), at(pair % count))).collect();
    let far = |a: usize, b: usize| between[a * count + b];
    let mut order = vec![0];
    let mut left: Vec<usize> = (1..count).collect();
    while let Some((nearest, _)) = left
        .iter()
        .enumerate()
        .min_by(|a, b| far(order[order.len() - 1], *a.1).total_cmp(&far(order[order.len() - 1], *b.1)).then(a.1.cmp(b.1)))
    {
        order.push(left.remove(nearest));
    }
    for _ in 0..ROUNDS {
        let mut shorter = false;
        for first in 1..count {
            for last in first + 1..count {
                let (before, after) = (order[first - 1], order.get(last + 1).copied());
                let now = far(before, order[first]) + after.map_or(0.0, |after| far(order[last], after));
                let then = far(before, order[last]) + after.map_or(0.0, |after| far(order[first], after));
                if then < now - NO_GAIN {
                    order[first..=last].reverse();
                    shorter = true;
                }
            }
        }
        if !shorter {
            break;
        }
    }
    order[1..].iter().map(|number| number - 1).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::stream;

    #[test]
    fn every_configuration_is_visited_once_and_on_a_line_there_is_no_way_back() {
        let mut draws = stream(1, "test/route");
        let line: Vec<Vec<f64>> = (0..30).map(|_| vec![draws.uniform(0.0, 1.0), 0.3]).collect();
        let order = route(&line, &[0.0, 0.3], &[1.0, 1.0]);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..30).collect::<Vec<_>>());
        assert!(order.windows(2).all(|pair| line[pair[0]][0] <= line[pair[1]][0]));
        // In six dimensions much shorter than as drawn.
        let drawn: Vec<Vec<f64>> = (0..60).map(|_| (0..6).map(|_| draws.uniform(-3.0, 3.0)).collect()).collect();
        let length = |order: &[usize]| -> f64 {
            let far = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            order.windows(2).map(|pair| far(&drawn[pair[0]], &drawn[pair[1]])).sum()
        };
        let order = route(&drawn, &[0.0; 6], &[6.0; 6]);
        assert!(length(&order) < 0.75 * length(&(0..60).collect::<Vec<_>>()));
    }
}
