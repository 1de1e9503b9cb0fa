//! A joint is off where its angle is near a value, within a half width: a raised cosine.

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{Displacement, Reading, Shape};

use super::ANGLE_ERROR;

/// rad
const HALF_WIDTHS: [f64; 2] = [0.3, 0.55];

pub(in crate::effects::signature) fn columns(reading: &Reading, joint: usize, centre: f64, half_width: f64) -> Vec<Displacement> {
    let distance = (reading.joints[joint] - centre).abs() / half_width;
    let height = if distance < 1.0 { 0.5 * (1.0 + libm::cos(std::f64::consts::PI * distance)) } else { 0.0 };
    vec![reading.moved(joint, height)]
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
            all.push(site.unnamed(Shape::Bump { joint, centre, half_width }, ANGLE_ERROR, vec![1.0], detail));
        }
    }
}
