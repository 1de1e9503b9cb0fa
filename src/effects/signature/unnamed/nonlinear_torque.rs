//! A joint that turns with its torque, but not in proportion: torque and its cube, or torque and the root of its size.

use std::num::NonZeroUsize;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::Kind;
use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{Displacement, Family, Follows, Form, Reading, Recorded, Size, Unnamed, from_one};

use super::Nameless;

/// rad/(N·m) at no load.
const RANGE: [f64; 2] = [2e-5, 2e-4];

/// \[2\] Torque, and its cube, turn a joint.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Softening {
    /// Joint, or the link that it moves.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub joint: usize,
}

impl Follows for Softening {
    fn form(&self, _: bool) -> Form {
        Form {
            columns: 2,
            of_magnitude: 2,
            size: Size::Length,
            needs: Recorded::Pose,
            unnamed: Some(Unnamed { family: Family::NonlinearTorque, contains: Some(Kind::JointCompliance), near: None }),
        }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        let joint = self.joint;
        let effort = reading.effort(joint);
        vec![reading.moved(joint, effort), reading.moved(joint, effort * effort * effort / 1e4)]
    }
}

/// \[2\] Torque, and the root of its size with its sign, turn a joint.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Hardening {
    /// Joint, or the link that it moves.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub joint: usize,
}

impl Follows for Hardening {
    fn form(&self, _: bool) -> Form {
        Form {
            columns: 2,
            of_magnitude: 2,
            size: Size::Length,
            needs: Recorded::Pose,
            unnamed: Some(Unnamed { family: Family::NonlinearTorque, contains: Some(Kind::JointCompliance), near: None }),
        }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        let joint = self.joint;
        let effort = reading.effort(joint);
        let root = 10.0 * libm::sqrt(effort.abs()) * effort.signum();
        vec![reading.moved(joint, effort), reading.moved(joint, root)]
    }
}

pub(super) fn hypotheses(site: &Site<'_>, joint: usize, all: &mut Vec<Hypothesis>) {
    // Without masses nobody knows the torque, and what else it may do.
    if !site.mechanism.masses_known {
        return;
    }
    let detail = format!("turn of joint {} not proportional to its torque", joint + 1);
    all.push(site.unnamed(Nameless::Softening(Softening { joint }), RANGE, vec![1.0, 0.5], detail.clone()));
    all.push(site.unnamed(Nameless::Hardening(Hardening { joint }), RANGE, vec![1.0; 2], detail));
}
