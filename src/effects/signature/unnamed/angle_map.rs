//! A joint is off by a free function of its angle: cosines over its travel.

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{Displacement, Reading, Shape};

use super::ANGLE_ERROR;

/// Cosines of the map.
pub const MAP_ORDERS: usize = 8;

pub(in crate::effects::signature) fn columns(reading: &Reading, joint: usize, low: f64, high: f64) -> Vec<Displacement> {
    let part = std::f64::consts::PI * (reading.joints[joint] - low) / (high - low).max(1e-9);
    (1..=MAP_ORDERS).map(|order| reading.moved(joint, libm::cos(order as f64 * part))).collect()
}

pub(super) fn hypotheses(site: &Site<'_>, joint: usize, all: &mut Vec<Hypothesis>) {
    if site.turns() {
        let [low, high] = site.columns.travel[joint];
        // Smooth: the higher, the smaller.
        let spread = (1..=MAP_ORDERS).map(|order| 1.0 / order as f64).collect();
        let detail = format!("error of joint {} follows its angle", joint + 1);
        all.push(site.unnamed(Shape::AngleMap { joint, low, high }, ANGLE_ERROR, spread, detail));
    }
}
