//! A joint turns with time and its square.

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{Displacement, Reading, Shape};

/// rad over the session.
const RANGE: [f64; 2] = [20e-6, 200e-6];

pub(in crate::effects::signature) fn columns(reading: &Reading, joint: usize) -> Vec<Displacement> {
    vec![reading.moved(joint, reading.share), reading.moved(joint, reading.share * reading.share)]
}

pub(super) fn hypotheses(site: &Site<'_>, joint: usize, all: &mut Vec<Hypothesis>) {
    if site.columns.time {
        let detail = format!("joint {} drifts with time", joint + 1);
        all.push(site.unnamed(Shape::TimeCurve { joint }, RANGE, vec![1.0; 2], detail));
    }
}
