//! Observability indexes O1–O6 from the singular values of the stacked error Jacobian.

/// Exponent of [`o6`] used in reports: with 2 it is the A-optimality of the information matrix, scaled to a singular value.
pub const O6_EXPONENT: f64 = 2.0;

/// The six indexes; `values` are the singular values that count, largest first, and positive.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Observability {
    /// [`o1`].
    pub o1: f64,
    /// [`o2`].
    pub o2: f64,
    /// [`o3`].
    pub o3: f64,
    /// [`o4`].
    pub o4: f64,
    /// [`o5`].
    pub o5: f64,
    /// [`o6`] with [`O6_EXPONENT`].
    pub o6: f64,
}

/// All six indexes of singular values, largest first. Every index is zero where the smallest value is.
#[must_use]
pub fn observability(values: &[f64]) -> Observability {
    if values.last().is_none_or(|last| *last <= 0.0) {
        return Observability::default();
    }
    Observability { o1: o1(values), o2: o2(values), o3: o3(values), o4: o4(values), o5: o5(values), o6: o6(values, O6_EXPONENT) }
}

/// Geometric mean of the singular values over the root of their number (Chen et al. 2019, eq. 15; Menq, Borm and Lai 1989).
#[must_use]
pub fn o1(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    // Products of a few values at a time: one logarithm each would cost more than all the rest.
    let logarithms: f64 = values.chunks(8).map(|chunk| libm::log(chunk.iter().product::<f64>())).sum();
    libm::exp(logarithms / count) / count.sqrt()
}

/// Smallest over largest singular value (eq. 16; Driels and Pathre 1990).
#[must_use]
pub fn o2(values: &[f64]) -> f64 {
    values[values.len() - 1] / values[0]
}

/// Smallest singular value (eq. 17; Nahvi, Hollerbach and Hayward 1994).
#[must_use]
pub fn o3(values: &[f64]) -> f64 {
    values[values.len() - 1]
}

/// Noise amplification index: smallest singular value squared over the largest (Nahvi and Hollerbach 1996).
#[must_use]
pub fn o4(values: &[f64]) -> f64 {
    o2(values) * o3(values)
}

/// One over the sum of the reciprocal singular values (Sun and Hollerbach 2008).
#[must_use]
pub fn o5(values: &[f64]) -> f64 {
    1.0 / values.iter().map(|value| 1.0 / value).sum::<f64>()
}

/// Generalised mean `(Σ σ^(−p) / n)^(−1/p)`, after the improved Φp-optimality of Wang et al. 2018: up to a factor it is O1 for
/// p → 0, O5 for p = 1 and O3 for p → ∞, the special cases that Chen et al. name. The paper of Wang et al. could not be had, so
/// that its normalisation may differ.
#[must_use]
pub fn o6(values: &[f64], exponent: f64) -> f64 {
    let mean = values.iter().map(|value| libm::pow(*value, -exponent)).sum::<f64>() / values.len() as f64;
    libm::pow(mean, -1.0 / exponent)
}

#[cfg(test)]
mod tests {
    use super::*;

    const VALUES: [f64; 4] = [4.0, 2.0, 1.0, 0.5];

    #[test]
    fn indexes_by_hand() {
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-15, "{a} is not {b}");
        close(o1(&VALUES), 2f64.sqrt() / 2.0);
        close(o2(&VALUES), 0.125);
        close(o3(&VALUES), 0.5);
        close(o4(&VALUES), 0.0625);
        close(o5(&VALUES), 1.0 / 3.75);
        close(o6(&VALUES, 1.0), 4.0 / 3.75);
    }

    #[test]
    fn o6_runs_from_the_geometric_mean_to_the_smallest_value() {
        assert!((o6(&VALUES, 1e-6) - 2.0 * o1(&VALUES)).abs() < 1e-5);
        assert!((o6(&VALUES, 300.0) - o3(&VALUES)).abs() < 0.01);
    }

    #[test]
    fn nothing_is_observable_when_a_singular_value_is_zero() {
        assert_eq!(observability(&[1.0, 0.0]), Observability::default());
    }
}
