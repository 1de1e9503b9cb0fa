//! Chen et al. 2019, section V.C.1.b and Table 4: calibration error against the number of configurations.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::statistics::Mean;
use super::trial::Trial;
use crate::design::candidates::{Rules, Sampler};
use crate::identification::outcome::Errors;
use crate::scene::{Injected, Scene};
use crate::seed::stream;
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
            let mean = |component: usize| Mean::of(&converged.iter().map(|result| result[component]).collect::<Vec<_>>());
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
fn one(scene: &Scene, injected: &Injected, count: usize, number: usize) -> Result<Option<[f64; 3]>, SessionError> {
    let trial = Trial::new(scene, injected, number)?;
    let rules = Rules::measurable(&scene.arm, &scene.sensor);
    let chosen = Sampler::new(&rules).draw(&mut stream(trial.seed(), &format!("count_error/{count}")), count)?;
    let result = trial.calibrate(&chosen)?;
    let rotation = |errors: &Errors| errors.rotation_rad.map_or(0.0, |rotation| rotation.mean);
    Ok(result.converged.then(|| [result.after.position_m.mean, rotation(&result.after), result.before.position_m.mean]))
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
