//! The torque of past readings, forgotten over a time, turns a joint.

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{Displacement, Reading, Shape};

/// Times over which a joint may yield, s.
pub const FORGETTING_S: [f64; 3] = [25.0, 60.0, 150.0];
/// rad/(N·m)
const RANGE: [f64; 2] = [0.5e-5, 5e-5];

pub(in crate::effects::signature) fn columns(reading: &Reading, joint: usize, which: usize) -> Vec<Displacement> {
    vec![reading.moved(joint, reading.torque_memory[joint][which])]
}

pub(super) fn hypotheses(site: &Site<'_>, joint: usize, all: &mut Vec<Hypothesis>) {
    if site.columns.time {
        for (which, time) in FORGETTING_S.iter().enumerate() {
            let detail = format!("joint {} yields slowly, over about {time:.0} s", joint + 1);
            all.push(site.unnamed(Shape::TorqueMemory { joint, which }, RANGE, vec![1.0], detail));
        }
    }
}
