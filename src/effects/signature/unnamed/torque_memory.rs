//! The torque of past readings, forgotten over a time, turns a joint.

use std::num::NonZeroUsize;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{Displacement, Family, Follows, Form, Reading, Recorded, Size, Unnamed, from_one};

use super::Nameless;

/// Times over which a joint may yield, s.
pub const FORGETTING_S: [f64; 3] = [25.0, 60.0, 150.0];
/// rad/(N·m)
const RANGE: [f64; 2] = [0.5e-5, 5e-5];

/// \[1\] The torque of past readings, forgotten over a time, turns a joint.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TorqueMemory {
    /// Joint, or the link that it moves.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub joint: usize,
    /// Which of [`FORGETTING_S`].
    pub which: usize,
}

impl Follows for TorqueMemory {
    fn form(&self, _: bool) -> Form {
        Form {
            columns: 1,
            of_magnitude: 1,
            size: Size::Length,
            needs: Recorded::Pose,
            unnamed: Some(Unnamed { family: Family::TorqueMemory, contains: None, near: None }),
        }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        vec![reading.moved(self.joint, reading.torque_memory[self.joint][self.which])]
    }
}

pub(super) fn hypotheses(site: &Site<'_>, joint: usize, all: &mut Vec<Hypothesis>) {
    if site.columns.time {
        for (which, time) in FORGETTING_S.iter().enumerate() {
            let detail = format!("joint {} yields slowly, over about {time:.0} s", joint + 1);
            all.push(site.unnamed(Nameless::TorqueMemory(TorqueMemory { joint, which }), RANGE, vec![1.0], detail));
        }
    }
}
