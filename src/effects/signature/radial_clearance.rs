//! A shift along the force across a joint's axis, whatever its size. Friction of the fit holds what carries less than a share of the force
//! in the middle of its play.

use nalgebra::Vector3;

use super::library::{Hypothesis, Site};
use super::shape::{Displacement, Reading, Shape, little, seated, twist};
use crate::effects::Kind;

/// Shares of the load that the friction of a fit may hold in the middle of its play.
pub const HELD: [f64; 4] = [0.0, 0.02, 0.05, 0.1];

pub(super) fn columns(reading: &Reading, joint: usize, held: f64) -> Vec<Displacement> {
    let posture = &reading.posture;
    let (load, sigma) = (posture.force_across(joint), posture.force_sigma(joint));
    vec![twist(seated(load, sigma, held * posture.forces[joint].norm()), Vector3::zeros())]
}

pub(super) fn undecided(reading: &Reading, joint: usize) -> bool {
    let posture = &reading.posture;
    little(posture.force_across(joint).norm(), posture.force_sigma(joint), posture.forces[joint].norm())
}

pub(super) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    let Some(joint) = site.place else {
        return;
    };
    for held in HELD {
        let detail = if held > 0.0 { format!("friction holds loads below {:.0} %", 100.0 * held) } else { String::new() };
        all.push(Hypothesis { detail, ..site.hypothesis(Kind::RadialClearance, Shape::ForceAcrossSign { joint, held }) });
    }
}
