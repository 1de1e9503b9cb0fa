//! Quantiles and tails, rounded so that they are the same everywhere.

use statrs::distribution::{ChiSquared, ContinuousCDF, StudentsT};

/// Quantile 0.975 of the normal distribution: half the width of a 95 % interval, in sigmas.
pub const NORMAL_95: f64 = 1.959_963_984_540_054;

/// Student's quantile at `probability`; `None` where there are no degrees of freedom.
#[must_use]
pub fn student_quantile(probability: f64, degrees_of_freedom: f64) -> Option<f64> {
    let distribution = StudentsT::new(0.0, 1.0, degrees_of_freedom).ok()?;
    Some(pinned(distribution.inverse_cdf(probability)))
}

/// Probability that a χ² with `degrees_of_freedom` is larger than `value`; one where there are none.
#[must_use]
pub fn chi_squared_tail(value: f64, degrees_of_freedom: f64) -> f64 {
    ChiSquared::new(degrees_of_freedom).map_or(1.0, |distribution| distribution.sf(value))
}

/// Rounded to ten significant digits: the last ones depend on the platform's mathematics.
fn pinned(value: f64) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return value;
    }
    let digits = 9 - libm::floor(libm::log10(value.abs())) as i32;
    let scale = libm::pow(10.0, f64::from(digits));
    libm::round(value * scale) / scale
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        // NIST/SEMATECH e-Handbook of Statistical Methods, tables of Student's t and χ².
        for (degrees, expected) in [(1.0, 12.706), (2.0, 4.303), (10.0, 2.228), (100.0, 1.984)] {
            assert!((student_quantile(0.975, degrees).unwrap() - expected).abs() < 5e-4);
        }
        assert!(student_quantile(0.975, 0.0).is_none());
        for (value, degrees, expected) in [(7.815, 3.0, 0.05), (22.458, 6.0, 0.001), (18.307, 10.0, 0.05)] {
            assert!((chi_squared_tail(value, degrees) / expected - 1.0).abs() < 1e-3);
        }
        assert_eq!(chi_squared_tail(1.0, 0.0), 1.0);
    }

    #[test]
    fn ten_digits_are_kept() {
        assert_eq!(pinned(1.234_567_890_123_4), 1.234_567_89);
        assert_eq!(pinned(-123.456_789_012_345), -123.456_789_0);
        assert_eq!((pinned(0.0), pinned(f64::INFINITY)), (0.0, f64::INFINITY));
    }
}
