//! A joint is off by a free function of its angle: cosines over its travel.

use std::num::NonZeroUsize;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{Displacement, Family, Follows, Form, Reading, Recorded, Size, Unnamed, from_one};

use super::{ANGLE_ERROR, Nameless};

/// Cosines of the map.
pub const MAP_ORDERS: usize = 8;

/// \[[`MAP_ORDERS`]\] A joint is off by a free function of its angle: cosines over its travel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AngleMap {
    /// Joint, or the link that it moves.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub joint: usize,
    /// Smallest angle, rad.
    pub low: f64,
    /// Largest angle, rad.
    pub high: f64,
}

impl Follows for AngleMap {
    fn form(&self, _: bool) -> Form {
        Form {
            columns: MAP_ORDERS,
            of_magnitude: MAP_ORDERS,
            size: Size::Length,
            needs: Recorded::Pose,
            unnamed: Some(Unnamed { family: Family::AngleMap, contains: None, near: None }),
        }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        let AngleMap { joint, low, high } = *self;
        let part = std::f64::consts::PI * (reading.joints[joint] - low) / (high - low).max(1e-9);
        (1..=MAP_ORDERS).map(|order| reading.moved(joint, libm::cos(order as f64 * part))).collect()
    }

    fn of_angle(&self) -> Option<usize> {
        Some(self.joint)
    }
}

pub(super) fn hypotheses(site: &Site<'_>, joint: usize, all: &mut Vec<Hypothesis>) {
    if site.turns() {
        let [low, high] = site.columns.travel[joint];
        // Smooth: the higher, the smaller.
        let spread = (1..=MAP_ORDERS).map(|order| 1.0 / order as f64).collect();
        let detail = format!("error of joint {} follows its angle", joint + 1);
        all.push(site.unnamed(Nameless::AngleMap(AngleMap { joint, low, high }), ANGLE_ERROR, spread, detail));
    }
}
