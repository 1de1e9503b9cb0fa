//! What a scene says of an effect besides kind and place. Neither the physics nor the signatures are here: it is what both are told.

use nalgebra::Vector3;

/// What a scene gives of an effect besides kind and place, SI; zero where it says nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Values {
    /// N·m/rad
    pub stiffness: f64,
    /// N·m/rad³
    pub cubic: f64,
    /// rad/(N·m)
    pub compliance: f64,
    /// Whether a link bends as a beam.
    pub beam: bool,
    /// rad/(N·m)
    pub gain: f64,
    /// Full width of a play, rad.
    pub width: f64,
    /// rad
    pub amplitude: f64,
    /// Periods per turn.
    pub order: u8,
    /// rad
    pub phase: f64,
    /// Gear ratio.
    pub ratio: f64,
    /// rad/rad
    pub ratio_error: f64,
    /// rad/rad
    pub coupling: f64,
    /// Joint whose motion leaks, from 0.
    pub source: usize,
    /// 1/K
    pub expansion: f64,
    /// How the foot grows with the whole arm.
    pub foot: Foot,
    /// rad/K
    pub drift: f64,
    /// m
    pub radial: f64,
    /// m
    pub axial: f64,
    /// rad
    pub tilt: f64,
    /// Share of the load up to which friction holds a play in its middle; `None`: as in all joints.
    pub held: Option<f64>,
    /// What a drift or a step moves.
    pub moves: Moves,
    /// m
    pub translation: Vector3<f64>,
    /// Rotation vector, rad.
    pub rotation: Vector3<f64>,
    /// Share of the session.
    pub after: f64,
    /// Relative error.
    pub scale: f64,
    /// Share of the readings.
    pub share: f64,
    /// Of the noise.
    pub factor: f64,
    /// rad
    pub depth: f64,
    /// rad
    pub centre: f64,
    /// rad
    pub half_width: f64,
    /// s
    pub time_constant: f64,
    /// rad
    pub travel: f64,
    /// Share of a move that is left at the reading.
    pub lag: f64,
    /// kg
    pub excess: f64,
    /// Angles of a table of errors, rising, rad.
    pub angles: Vec<f64>,
    /// Error at each of them, rad.
    pub errors: Vec<f64>,
}

/// What a drift or a step of the measurement frame moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Moves {
    /// The robot's base.
    #[default]
    Base,
    /// The sensor.
    Sensor,
}

/// How the foot grows with the arm: from the base link's frame to the first joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Foot {
    /// With its own temperature.
    #[default]
    Own,
    /// As warm as the first link that moves.
    AsFirstLink,
    /// Not at all.
    Still,
}
