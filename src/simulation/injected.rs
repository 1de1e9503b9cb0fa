//! What is injected: the truth that only the simulated measurement sees.

use super::effect::Effect;

/// What is injected: the hidden part of a scene, with its own seed. Only the simulated measurement sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct Injected {
    /// Key of everything that is drawn for the truth; combined with the scene's seed.
    pub seed: String,
    /// Half width of the uniform errors of length parameters, m.
    pub length_error_m: f64,
    /// Half width of the uniform errors of angle parameters, rad.
    pub angle_error_rad: f64,
    /// Errors given by name (m or rad), in place of drawn ones; in column order.
    pub parameter_errors: Vec<(String, f64)>,
    /// What is wrong with arm, cell and sensor besides the parameters; effects of one kind at one place add up.
    pub effects: Vec<Effect>,
    /// True noise of the readings.
    pub noise: Noise,
}

impl Injected {
    /// An arm whose parameters are the nominal ones, read with the declared noise, and these `effects`; whatever they leave open is
    /// drawn from `seed`.
    #[must_use]
    pub fn of_effects(seed: &str, effects: Vec<Effect>) -> Self {
        Injected {
            seed: seed.to_owned(),
            length_error_m: 0.0,
            angle_error_rad: 0.0,
            parameter_errors: Vec::new(),
            effects,
            noise: Noise::Declared { factor: 1.0 },
        }
    }
}

/// Noise that the readings really have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Noise {
    /// Normal, with the declared sigmas times a factor.
    Declared {
        /// 1: as declared.
        factor: f64,
    },
    /// Uniform within ± the given half widths, the same for every axis.
    Uniform {
        /// Position, m.
        position_m: f64,
        /// Orientation (rotation vector), rad.
        orientation_rad: f64,
    },
    /// None.
    Off,
}
