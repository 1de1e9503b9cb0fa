//! All joints yield alike, to the torque and to that of a mass that the tool carries besides.

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{Displacement, Reading, Shape};
use crate::effects::{Level, Location};

/// rad/(N·m)
const RANGE: [f64; 2] = [2e-5, 1.5e-4];

pub(in crate::effects::signature) fn columns(reading: &Reading) -> Vec<Displacement> {
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

pub(super) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    let detail = "all joints yield alike, or carry what is not recorded".to_owned();
    let hypothesis = site.unnamed(Shape::AllYield, RANGE, vec![1.0; 2], detail);
    all.push(Hypothesis { location: Location { level: Level::Tool, index: None }, ..hypothesis });
}
