//! What no choice of configurations can go beyond, computed when it is first asked for.

use std::sync::OnceLock;

use crate::design::bound::{Bound, bound};
use crate::design::candidates::Rules;
use crate::design::objective::Models;
use crate::design::problem::Criterion;
use crate::scene::Scene;

/// Bounds for one arm, sensor and rules: always to be asked with the same scene and models.
#[derive(Default)]
pub struct Limits {
    variance: OnceLock<Option<Bound>>,
    determinant: OnceLock<Option<Bound>>,
}

impl Limits {
    /// The least position error over the workspace (RMS, m) that noise leaves after a calibration with `count` configurations;
    /// `None` where no choice determines the parameters.
    #[must_use]
    pub fn least_rms_m(&self, scene: &Scene, models: &Models, count: usize) -> Option<f64> {
        let found = self.variance.get_or_init(|| compute(scene, models, Criterion::IOptimality));
        found.as_ref().map(|bound| bound.least_rms_m(count))
    }

    /// The largest value that the criterion of D-optimality has for `count` configurations; `None` where no choice determines the
    /// parameters.
    #[must_use]
    pub fn largest_d(&self, scene: &Scene, models: &Models, count: usize) -> Option<f64> {
        let found = self.determinant.get_or_init(|| compute(scene, models, Criterion::DOptimality));
        found.as_ref().map(|bound| bound.largest_d(count))
    }
}

fn compute(scene: &Scene, models: &Models, criterion: Criterion) -> Option<Bound> {
    bound(models, &Rules::measurable(&scene.arm, &scene.sensor), criterion, scene.design.pool).ok()
}
