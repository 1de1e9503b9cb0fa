//! The moments about the x and y axes of a joint's frame turn it about z; the frame is that of the moving side or of the side that the
//! joint moves on.

use std::num::NonZeroUsize;

use nalgebra::{Matrix3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{Displacement, Family, Follows, Form, Reading, Recorded, Size, Unnamed, from_one};

use super::Nameless;

/// rad/(N·m)
const RANGE: [f64; 2] = [0.3e-5, 3e-5];

/// \[2\] The moments about the x and y axes of a joint's frame turn it about z; the frame is that of the moving side or of the
/// side that the joint moves on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Crosstalk {
    /// Joint, or the link that it moves.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub joint: usize,
    /// The moving side.
    pub moving: bool,
}

impl Follows for Crosstalk {
    fn form(&self, _: bool) -> Form {
        Form {
            columns: 2,
            of_magnitude: 2,
            size: Size::Length,
            needs: Recorded::Pose,
            unnamed: Some(Unnamed { family: Family::Crosstalk, contains: None, near: None }),
        }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        let joint = self.joint;
        let posture = &reading.posture;
        let mut frame = posture.frames[joint];
        if !self.moving {
            // Back by the joint's angle about z.
            let (sine, cosine) = libm::sincos(reading.joints[joint]);
            let (x, y): (Vector3<f64>, Vector3<f64>) = (frame.column(0).into(), frame.column(1).into());
            frame = Matrix3::from_columns(&[x * cosine - y * sine, y * cosine + x * sine, posture.axes[joint]]);
        }
        [0, 1].map(|axis| reading.moved(joint, frame.column(axis).dot(&posture.moments[joint]))).to_vec()
    }
}

pub(super) fn hypotheses(site: &Site<'_>, joint: usize, all: &mut Vec<Hypothesis>) {
    if site.turns() {
        for moving in [false, true] {
            let detail = format!("moment across the axis of joint {} turns it", joint + 1);
            let spread = vec![std::f64::consts::FRAC_1_SQRT_2; 2];
            all.push(site.unnamed(Nameless::Crosstalk(Crosstalk { joint, moving }), RANGE, spread, detail));
        }
    }
}
