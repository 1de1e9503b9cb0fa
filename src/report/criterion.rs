//! What a criterion's value means to people.

use crate::design::problem::Criterion;
use crate::units::number;

/// How values of a criterion are told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Words {
    criterion: Option<Criterion>,
}

impl Words {
    /// Those of `criterion`; where it is not known, values are told as they are.
    #[must_use]
    pub fn new(criterion: Option<Criterion>) -> Self {
        Words { criterion }
    }

    /// Those of the criterion with this name in scenes and results.
    #[must_use]
    pub fn of(name: &str) -> Self {
        Words::new(Criterion::from_name(name))
    }

    /// The criterion's name in scenes and results.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.criterion.map_or("its criterion", Criterion::name)
    }

    /// The quantity that is told, for the title of a chart.
    #[must_use]
    pub fn quantity(self) -> &'static str {
        match self.criterion {
            Some(Criterion::Comprehensive) => "O_C",
            Some(Criterion::O1) => "O1",
            Some(Criterion::O2) => "O2",
            Some(Criterion::O3) => "O3",
            Some(Criterion::O4) => "O4",
            Some(Criterion::O5) => "O5",
            Some(Criterion::O6) => "O6",
            Some(Criterion::Dispersion) => "D, m²",
            Some(Criterion::Evenness) => "U",
            Some(Criterion::DOptimality) => "root of the information's determinant",
            Some(Criterion::IOptimality) => "predicted position error (RMS), mm, less is better",
            Some(Criterion::GOptimality) => "predicted error at the worst point, mm, less is better",
            None => "criterion",
        }
    }

    /// Whether the quantity falls as the value rises.
    #[must_use]
    pub fn falls(self) -> bool {
        matches!(self.criterion, Some(Criterion::IOptimality | Criterion::GOptimality))
    }

    /// The quantity of a value (as in [`crate::design::outcome::SearchStep::value`]), in the unit that it is told in. Infinite where
    /// a set determines nothing.
    #[must_use]
    pub fn scaled(self, value: f64) -> f64 {
        match self.criterion {
            _ if self.falls() => 1e3 * libm::exp(-0.5 * value),
            Some(Criterion::DOptimality) => libm::exp(value),
            _ => value,
        }
    }

    /// A value in words: `predicted 0.052 mm`, `O_C 1.426`.
    #[must_use]
    pub fn value(self, value: f64) -> String {
        let scaled = self.scaled(value);
        if value == f64::MIN || !scaled.is_finite() {
            return "not all parameters determined".to_owned();
        }
        let number = number(scaled);
        match self.criterion {
            Some(Criterion::IOptimality) => format!("predicted {number} mm"),
            Some(Criterion::GOptimality) => format!("predicted {number} mm at worst"),
            Some(Criterion::DOptimality) => format!("root determinant {number}"),
            Some(Criterion::Dispersion) => format!("D {number} m²"),
            _ => format!("{} {number}", self.quantity()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variances_are_told_as_errors_and_indexes_as_they_are() {
        let of = |criterion, value| Words::new(Some(criterion)).value(value);
        // A variance of (0.052 mm)².
        let value = -2.0 * libm::log(0.052e-3);
        assert_eq!(of(Criterion::IOptimality, value), "predicted 0.0520 mm");
        assert_eq!(of(Criterion::GOptimality, value), "predicted 0.0520 mm at worst");
        assert_eq!(of(Criterion::DOptimality, libm::log(250.0)), "root determinant 250.0");
        assert_eq!(of(Criterion::Comprehensive, 1.425_94), "O_C 1.426");
        assert_eq!(of(Criterion::Dispersion, 0.5), "D 0.5000 m²");
        assert_eq!(Words::of("of_tomorrow").value(0.5), "criterion 0.5000");
        for criterion in Criterion::ALL {
            assert_eq!(of(criterion, f64::MIN), "not all parameters determined");
            assert_eq!(Words::of(criterion.name()), Words::new(Some(criterion)));
        }
    }
}
