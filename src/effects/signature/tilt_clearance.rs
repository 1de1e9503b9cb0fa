//! A turn along the moment across a joint's axis, whatever its size. Friction of the fit holds what carries less than a share of the
//! force times the length of the arm outboard.

use super::library::{Hypothesis, Site};
use super::shape::{Displacement, Reading, Shape, little, seated};
use crate::effects::Kind;

use super::radial_clearance::HELD;

pub(super) fn columns(reading: &Reading, joint: usize, held: f64) -> Vec<Displacement> {
    let posture = &reading.posture;
    let (load, sigma) = (posture.moment_across(joint), posture.moment_sigma(joint));
    vec![reading.turned(joint, seated(load, sigma, held * posture.forces[joint].norm() * posture.reaches[joint]))]
}

pub(super) fn undecided(reading: &Reading, joint: usize) -> bool {
    let posture = &reading.posture;
    let reach = posture.forces[joint].norm() * posture.reaches[joint];
    little(posture.moment_across(joint).norm(), posture.moment_sigma(joint), reach)
}

pub(super) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    let Some(joint) = site.place else {
        return;
    };
    for held in HELD {
        let detail = if held > 0.0 { format!("friction holds loads below {:.0} %", 100.0 * held) } else { String::new() };
        all.push(Hypothesis { detail, ..site.hypothesis(Kind::TiltClearance, Shape::MomentAcrossSign { joint, held }) });
    }
}
