//! All joints yield alike, to the torque and to that of a mass that the tool carries besides.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{Displacement, Family, Follows, Form, Reading, Recorded, Size, Unnamed};
use crate::effects::{Level, Location};

use super::Nameless;

/// rad/(N·m)
const RANGE: [f64; 2] = [2e-5, 1.5e-4];

/// \[2\] All joints yield alike, to the torque and to that of a mass that the tool carries besides.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AllYield {}

impl Follows for AllYield {
    fn form(&self, _: bool) -> Form {
        Form {
            columns: 2,
            of_magnitude: 2,
            size: Size::Length,
            needs: Recorded::Pose,
            unnamed: Some(Unnamed { family: Family::AllYield, contains: None, near: None }),
        }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        let posture = &reading.posture;
        let joints = 0..reading.joints.len();
        let own = joints.clone().map(|joint| reading.moved(joint, reading.effort(joint)));
        let of_mass = joints.map(|joint| {
            let axis = posture.axes[joint];
            let lever = posture.tool - posture.origins[joint];
            let force = reading.gravity;
            let effort = if reading.slides[joint] { force.dot(&axis) } else { axis.dot(&lever.cross(&force)) };
            reading.moved(joint, effort)
        });
        let added = |sum: Displacement, part: Displacement| std::array::from_fn(|at| sum[at] + part[at]);
        vec![own.fold([0.0; 6], added), of_mass.fold([0.0; 6], added)]
    }
}

pub(super) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    let detail = "all joints yield alike, or carry what is not recorded".to_owned();
    let hypothesis = site.unnamed(Nameless::AllYield(AllYield {}), RANGE, vec![1.0; 2], detail);
    all.push(Hypothesis { location: Location { level: Level::Tool, index: None }, ..hypothesis });
}
