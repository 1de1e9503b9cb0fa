//! Identity of the geometric parameters. The order of a chain's parameters is the column order of every Jacobian.

use serde::{Deserialize, Serialize};

/// What a parameter measures; fixes its unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Quantity {
    /// Metres.
    Length,
    /// Radians.
    Angle,
}

impl Quantity {
    /// The SI unit of the parameter: `m` or `rad`.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Quantity::Length => "m",
            Quantity::Angle => "rad",
        }
    }
}

/// A geometric parameter: its name (`alpha3`, `base_x`, `wrist_roll`), what it measures, and its nominal value (m or rad).
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Unique within the chain.
    pub name: String,
    /// Length or angle.
    pub quantity: Quantity,
    /// The value of the nominal model, SI.
    pub nominal: f64,
}
