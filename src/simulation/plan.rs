//! How the measuring is organised: repeats, sides of approach, payloads, temperatures.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The measuring: how many configurations verify, and in what time.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Configurations that are measured but not fitted.
    pub held_out_count: usize,
    /// Whether held-out poses are read by an exact reference instrument instead of the sensor (the paper's eq. 10).
    pub held_out_exact: bool,
    /// From one reading to the next, s.
    pub seconds_per_pose: f64,
    /// Temperature at which the nominal arm is nominal, °C.
    pub reference_temperature_c: f64,
    /// How many times each configuration is read, each time approached anew.
    pub repeats: usize,
    /// From which side the joints come to a configuration.
    pub approach: Approach,
    /// From the end of a move to the reading, s.
    pub dwell_s: f64,
    /// Masses that the tool carries, kg; configurations take them in turn.
    pub payloads_kg: Vec<f64>,
    /// Whether payloads are measured one after the other (true), or in mixed order.
    pub payload_blocks: bool,
    /// Course of the temperatures over the session; absent where nothing warms.
    pub temperature: Option<Temperature>,
}

/// From which side the joints come to a configuration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Approach {
    /// Which side.
    pub policy: ApproachPolicy,
    /// How far the last move of each turning joint is where the policy makes one, rad.
    pub travel_rad: f64,
    /// The same for a sliding joint, m.
    pub travel_m: f64,
}

/// From which side the joints come to a configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ApproachPolicy {
    /// Straight from the configuration measured before it (the first: from zero).
    #[default]
    Direct,
    /// Every joint upwards.
    Up,
    /// Every joint downwards.
    Down,
    /// All joints up for one configuration, down for the next.
    Alternate,
    /// Each joint of each configuration by the throw of a coin; repeats alike.
    Random,
}

/// Course of the temperatures over a session. A link follows the course with a lag of the first order.
#[derive(Clone, Debug, PartialEq)]
pub struct Temperature {
    /// Course over the session.
    pub profile: ThermalProfile,
    /// Largest rise of each link over the reference temperature, base link first, K.
    pub rise_k: Vec<f64>,
    /// Time constant with which each link follows, base link first, s; 0: at once.
    pub lag_s: Vec<f64>,
    /// Largest rise of the air, K.
    pub ambient_rise_k: f64,
}

/// Course of the temperature over the session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ThermalProfile {
    /// At its largest rise all the time.
    Constant,
    /// Rising all the time.
    WarmUp,
    /// Rising, then falling back.
    HeatAndCool,
}
