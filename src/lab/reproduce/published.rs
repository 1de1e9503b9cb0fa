//! The numbers of Chen et al. 2019 that survive, from `tests/reference/chen2019.toml`, which says where each stands.

use serde::Deserialize;

const TEXT: &str = include_str!("../../../tests/reference/chen2019.toml");

/// All of them; the names are those of the experiments.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Published {
    /// What holds for all experiments.
    pub conditions: Conditions,
    /// Tables 2 and 3.
    pub globality: Globality,
    /// Fig. 8.
    pub quality: Quality,
    /// Figs. 9 and 10.
    pub count_index: CountIndex,
    /// Table 4.
    pub count_error: CountError,
    /// Table 5.
    pub optimise: Optimise,
    /// Table 6.
    pub sets: Sets,
    /// Table 7.
    pub headline: Headline,
}

/// What is injected, and how many configurations verify.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Conditions {
    /// Half width of the errors of lengths, mm.
    pub length_error_mm: f64,
    /// Half width of the errors of angles, °.
    pub angle_error_deg: f64,
    /// Half width of the measurement error, mm.
    pub noise_mm: f64,
    /// Configurations that verify.
    pub verification: usize,
    /// Kinematic parameters of the arm.
    pub parameters: usize,
    /// Fewest configurations (eq. 30).
    pub fewest_configurations: usize,
}

/// Tables 2 and 3: two sets of different globality.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Globality {
    /// Configurations of a set.
    pub configurations: usize,
    /// The concentrated set.
    pub a: GlobalityIndexes,
    /// The set that covers the workspace.
    pub b: GlobalityIndexes,
    /// Errors of the nominal model.
    pub before: Residuals,
    /// Errors after calibration with A.
    pub after_a: Residuals,
    /// Errors after calibration with B.
    pub after_b: Residuals,
}

/// Globality of a set.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GlobalityIndexes {
    /// D, m².
    pub dispersion: f64,
    /// U.
    pub evenness: f64,
}

/// Errors over the verification.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Residuals {
    /// Position, mm.
    pub position_mm: Extremes,
    /// Orientation, °.
    #[serde(rename = "attitude_deg")]
    pub orientation_deg: Extremes,
}

/// Largest, smallest and mean.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Extremes {
    /// Largest.
    pub max: f64,
    /// Smallest.
    pub min: f64,
    /// Mean.
    pub mean: f64,
}

/// Fig. 8: sets of growing O_C.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Quality {
    /// Configurations of a set.
    pub configurations: usize,
    /// Half width of the narrowest joint ranges, °.
    pub narrowest_deg: usize,
    /// Half width of the widest, °.
    pub widest_deg: usize,
    /// From one to the next, °.
    pub step_deg: usize,
    /// Sets.
    pub sets: usize,
    /// Smallest and largest O_C.
    pub comprehensive: [f64; 2],
    /// Mean position error there, mm.
    pub position_mm: [f64; 2],
    /// Mean orientation error there, °.
    #[serde(rename = "attitude_deg")]
    pub orientation_deg: [f64; 2],
}

/// Figs. 9 and 10: O_C against the number of configurations.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CountIndex {
    /// Numbers of configurations that the text names.
    pub configurations: [usize; 4],
    /// Growth of O_C from each to the next, %.
    pub growth_percent: [f64; 3],
    /// From here on the gradient is said to fall.
    pub gradient_falls: usize,
    /// From here on O_C is said to hardly grow.
    pub hardly_grows: usize,
}

/// Table 4: errors against the number of configurations.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CountError {
    /// Its rows.
    pub row: Vec<CountErrorRow>,
    /// The numbers of configurations that the paper calls suitable.
    pub suitable: [usize; 2],
}

/// A row of Table 4.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CountErrorRow {
    /// m.
    pub configurations: usize,
    /// Mean position error, mm.
    pub position_mm: f64,
    /// Mean orientation error, °.
    #[serde(rename = "attitude_deg")]
    pub orientation_deg: f64,
}

/// Table 5 and the optimum.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Optimise {
    /// m.
    pub configurations: usize,
    /// Joint angles of a particle.
    pub dimension: usize,
    /// N_Swrm.
    pub particles: usize,
    /// N_Iter.
    pub iterations: usize,
    /// ξ.
    pub velocity_factor: f64,
    /// ω.
    pub inertia: [f64; 2],
    /// c1 and c2.
    pub acceleration: [f64; 2],
    /// O_C of the optimum.
    pub comprehensive: f64,
}

/// Table 6.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sets {
    /// Random sets.
    pub sets: usize,
}

/// Table 7.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Headline {
    /// Calibrations.
    pub calibrations: usize,
    /// By how much the mean position error is smaller with the optimal set than with random ones, %.
    pub position_gain_percent: f64,
    /// The same for the orientation, %.
    #[serde(rename = "attitude_gain_percent")]
    pub orientation_gain_percent: f64,
}

impl Published {
    /// The published numbers.
    #[must_use]
    pub fn get() -> Published {
        // The file is part of the program, and a test parses it.
        #[allow(clippy::expect_used, reason = "checked by a test")]
        toml::from_str(TEXT).expect("the published numbers are part of the program")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_fit_each_other() {
        let published = Published::get();
        // Section V.B.1 tells the improvements, too.
        let globality = &published.globality;
        let improvement = |after: f64, before: f64| (1e4 * (1.0 - after / before)).round() / 100.0;
        let position = |residuals: &Residuals| improvement(residuals.position_mm.mean, globality.before.position_mm.mean);
        let orientation =
            |residuals: &Residuals| improvement(residuals.orientation_deg.mean, globality.before.orientation_deg.mean);
        assert_eq!((position(&globality.after_a), position(&globality.after_b)), (82.55, 97.89));
        assert_eq!((orientation(&globality.after_a), orientation(&globality.after_b)), (90.0, 98.18));
        // Section V.B.2: 98.68 % (the printed 1.32 mm of 98.23 mm is 98.66 %) and 99.75 %.
        let quality = &published.quality;
        assert!((improvement(quality.position_mm[1], quality.position_mm[0]) - 98.68).abs() < 0.03);
        assert_eq!(improvement(quality.orientation_deg[1], quality.orientation_deg[0]), 99.75);
        assert_eq!((quality.widest_deg - quality.narrowest_deg) / quality.step_deg + 1, quality.sets);
        // Table 4: "compared with the situation of 8 configurations".
        let rows = &published.count_error.row;
        let lower = |row: usize| improvement(rows[row].position_mm, rows[0].position_mm);
        assert_eq!([lower(1), lower(2), lower(3)], [53.13, 76.56, 86.33]);
        let lower = |row: usize| improvement(rows[row].orientation_deg, rows[0].orientation_deg);
        assert_eq!([lower(1), lower(2), lower(3)], [68.18, 81.82, 90.91]);
        let optimise = &published.optimise;
        assert_eq!(optimise.dimension, 8 * optimise.configurations);
        assert_eq!(published.count_index.configurations[0], published.conditions.fewest_configurations);
    }
}
