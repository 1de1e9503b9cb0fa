//! A joint is off where its angle is near a value, within a half width: a raised cosine.

use std::num::NonZeroUsize;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{Displacement, Family, Follows, Form, Reading, Recorded, Size, Unnamed, from_one};

use super::{ANGLE_ERROR, Nameless};

/// rad
const HALF_WIDTHS: [f64; 2] = [0.3, 0.55];

/// \[1\] A joint is off where its angle is near a value, within a half width: a raised cosine.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Bump {
    /// Joint, or the link that it moves.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub joint: usize,
    /// rad
    pub centre: f64,
    /// rad
    pub half_width: f64,
}

impl Follows for Bump {
    fn form(&self, _: bool) -> Form {
        Form {
            columns: 1,
            of_magnitude: 1,
            size: Size::Length,
            needs: Recorded::Pose,
            unnamed: Some(Unnamed { family: Family::Bump, contains: None, near: Some([self.centre, self.half_width]) }),
        }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        let distance = (reading.joints[self.joint] - self.centre).abs() / self.half_width;
        let height = if distance < 1.0 { 0.5 * (1.0 + libm::cos(std::f64::consts::PI * distance)) } else { 0.0 };
        vec![reading.moved(self.joint, height)]
    }

    fn of_angle(&self) -> Option<usize> {
        Some(self.joint)
    }
}

pub(super) fn hypotheses(site: &Site<'_>, joint: usize, all: &mut Vec<Hypothesis>) {
    if !site.turns() {
        return;
    }
    let [low, high] = site.columns.travel[joint];
    for half_width in HALF_WIDTHS {
        let steps = libm::ceil((high - low) / half_width).clamp(1.0, 40.0);
        for step in 0..=(steps as usize) {
            let centre = low + (high - low) * step as f64 / steps;
            let detail = format!("angle of joint {} near {:.0}°", joint + 1, centre.to_degrees());
            all.push(site.unnamed(Nameless::Bump(Bump { joint, centre, half_width }), ANGLE_ERROR, vec![1.0], detail));
        }
    }
}
