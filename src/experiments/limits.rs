//! What no choice of configurations can go beyond.

use crate::design::candidates::Rules;
use crate::design::objective::Models;

/// Bounds for one arm, its rules and its sensor.
pub struct Limits {}

impl Limits {
    /// The bounds of `models` under `rules`, among `pool` random candidates.
    #[must_use]
    pub fn new(models: &Models, rules: &Rules<'_>, pool: usize) -> Self {
        let _ = (models, rules, pool);
        Limits {}
    }

    /// The least position error over the workspace (RMS, m) that noise leaves after a calibration with `count` configurations.
    #[must_use]
    pub fn least_rms_m(&self, count: usize) -> Option<f64> {
        let _ = count;
        None
    }

    /// The largest value that the criterion of D-optimality has for `count` configurations.
    #[must_use]
    pub fn largest_d(&self, count: usize) -> Option<f64> {
        let _ = count;
        None
    }
}
