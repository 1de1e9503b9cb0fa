//! Where an effect sits.

use std::fmt;

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

/// As it is said everywhere: `joint 3`, `link 2`, `the whole arm`, `the base`.
impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let level = match (self.level, self.index) {
            (Level::Joint, _) => "joint",
            (Level::Link, Some(_)) => "link",
            (Level::Link, None) => "the whole arm",
            (Level::Base, _) => "the base",
            (Level::Tool, _) => "the tool",
            (Level::Sensor, _) => "the sensor",
        };
        match self.index {
            Some(index) => write!(f, "{level} {index}"),
            None => f.write_str(level),
        }
    }
}
