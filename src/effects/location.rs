//! Where an effect sits.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What an effect belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Level {
    /// A joint.
    Joint,
    /// A link; link `i` moves with joint `i` and reaches to joint `i + 1`, the last to the tip.
    Link,
    /// The base, or the sensor against it.
    Base,
    /// The tool, or the reflector on it.
    Tool,
    /// The sensor.
    Sensor,
}

/// Where an effect sits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
pub struct Location {
    /// What it belongs to.
    pub level: Level,
    /// Number of the joint or link, from 1; `None` for the whole arm and for what has no number.
    pub index: Option<usize>,
}
