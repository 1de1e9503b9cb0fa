//! Chen et al. 2019, section V.C.1.b and Table 4: calibration error against the number of configurations.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::cell::measure;
use crate::cell::measure::plan;
use crate::design::candidates::{Rules, Sampler};
use crate::design::search::split;
use crate::identification::identify;
use crate::recording::event::Nobody;
use crate::scene::{Injected, Scene};
use crate::seed::{derive, stream};
use crate::session::SessionError;

const PUBLISHED: &str = include_str!("../../tests/reference/chen2019-table4.toml");

/// Rows of Table 4.
pub const ROWS: usize = 4;

/// One row of the table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Configurations m.
    pub count: usize,
    /// Mean position error as published, m.
    pub paper_position_m: f64,
    /// Mean attitude error as published, rad.
    pub paper_attitude_rad: f64,
    /// Calibrations made.
    pub trials: usize,
    /// Calibrations that did not converge; they are left out of the means.
    pub not_converged: usize,
    /// Our mean position error over held-out configurations, m, and its 95 % interval over the trials.
    pub position_m: Option<Mean>,
    /// The same for the attitude, rad.
    pub attitude_rad: Option<Mean>,
    /// Mean position error of the nominal model, m.
    pub nominal_position_m: Option<Mean>,
}

/// A mean over trials.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Mean {
    /// Mean.
    pub mean: f64,
    /// 95 % confidence interval of the mean (Student); absent for a single trial.
    pub interval95: Option<[f64; 2]>,
}

#[derive(Deserialize)]
struct Published {
    row: Vec<PublishedRow>,
}

#[derive(Deserialize)]
struct PublishedRow {
    count: usize,
    position_mm: f64,
    attitude_deg: f64,
}

/// Calibrates `trials` times with random configurations for each number of configurations of Table 4. Every trial has its own true
/// arm, configurations and noise, drawn from the scene's seed and the trial's number. `done` is called after each.
///
/// # Errors
/// Whatever a step reports.
pub fn run(scene: &Scene, injected: &Injected, trials: usize, done: &(dyn Fn() + Sync)) -> Result<Vec<Row>, SessionError> {
    // The file is part of the program, and a test parses it.
    #[allow(clippy::expect_used, reason = "checked by a test")]
    let published: Published = toml::from_str(PUBLISHED).expect("the published table is part of the program");
    published
        .row
        .into_iter()
        .map(|published| {
            let results: Vec<Option<[f64; 3]>> = (0..trials)
                .into_par_iter()
                .map(|trial| one(scene, injected, published.count, trial).inspect(|_| done()))
                .collect::<Result<_, _>>()?;
            let converged: Vec<[f64; 3]> = results.iter().copied().flatten().collect();
            let mean = |component: usize| Mean::of(converged.iter().map(|result| result[component]));
            Ok(Row {
                count: published.count,
                paper_position_m: published.position_mm * 1e-3,
                paper_attitude_rad: published.attitude_deg.to_radians(),
                trials,
                not_converged: trials - converged.len(),
                position_m: mean(0),
                attitude_rad: mean(1),
                nominal_position_m: mean(2),
            })
        })
        .collect()
}

/// Mean held-out position error, attitude error, and position error of the nominal model of one calibration.
fn one(scene: &Scene, injected: &Injected, count: usize, trial: usize) -> Result<Option<[f64; 3]>, SessionError> {
    let mut scene = scene.clone();
    scene.seed = derive(scene.seed, trial as u64);
    let rules = Rules::measurable(&scene.arm, &scene.sensor);
    let chosen = Sampler::new(&rules).draw(&mut stream(scene.seed, &format!("count_error/{count}")), count)?;
    let held_out = crate::design::held_out(&scene)?;
    let planned = plan(&scene, &split(&chosen, scene.arm.joint_count()), &held_out);
    let (measurements, _) = measure(&scene, injected, &planned, planned.len(), &mut Nobody)?;
    let result = identify(&scene.arm, &scene.sensor, scene.weights, &measurements)?;
    Ok(match (result.converged, result.held_out, result.held_out_nominal) {
        (true, Some(after), Some(before)) => {
            Some([after.position_m.mean, after.rotation_rad.map_or(0.0, |rotation| rotation.mean), before.position_m.mean])
        }
        _ => None,
    })
}

impl Mean {
    /// `None` where there are no values.
    fn of(values: impl Iterator<Item = f64> + Clone) -> Option<Mean> {
        let count = values.clone().count();
        if count == 0 {
            return None;
        }
        let mean = values.clone().sum::<f64>() / count as f64;
        let interval95 = StudentsT::new(0.0, 1.0, count as f64 - 1.0).ok().map(|distribution| {
            let variance = values.map(|value| (value - mean).powi(2)).sum::<f64>() / (count as f64 - 1.0);
            let half = distribution.inverse_cdf(0.975) * (variance / count as f64).sqrt();
            [mean - half, mean + half]
        });
        Some(Mean { mean, interval95 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_published_table_is_there() {
        let published: Published = toml::from_str(PUBLISHED).unwrap();
        assert_eq!(published.row.iter().map(|row| row.count).collect::<Vec<_>>(), [8, 20, 60, 200]);
        assert_eq!(published.row.len(), ROWS);
    }
}
