//! A joint turns with time and its square.

use std::num::NonZeroUsize;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{Displacement, Family, Follows, Form, Reading, Recorded, Size, Unnamed, from_one};

use super::Nameless;

/// rad over the session.
const RANGE: [f64; 2] = [20e-6, 200e-6];

/// \[2\] A joint turns with time and its square.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TimeCurve {
    /// Joint, or the link that it moves.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub joint: usize,
}

impl Follows for TimeCurve {
    fn form(&self, _: bool) -> Form {
        Form {
            columns: 2,
            of_magnitude: 2,
            size: Size::Length,
            needs: Recorded::Pose,
            unnamed: Some(Unnamed { family: Family::TimeCurve, contains: None, near: None }),
        }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        vec![reading.moved(self.joint, reading.share), reading.moved(self.joint, reading.share * reading.share)]
    }
}

pub(super) fn hypotheses(site: &Site<'_>, joint: usize, all: &mut Vec<Hypothesis>) {
    if site.columns.time {
        let detail = format!("joint {} drifts with time", joint + 1);
        all.push(site.unnamed(Nameless::TimeCurve(TimeCurve { joint }), RANGE, vec![1.0; 2], detail));
    }
}
