//! Cosine and sine of a joint's angle, of twice the angle, or of both, turn it.

use super::library::{Hypothesis, Site};
use super::shape::{Displacement, Reading, Shape};
use crate::effects::Kind;

/// Cosine and sine of `order` times the angle.
pub(super) fn columns(reading: &Reading, joint: usize, order: f64) -> Vec<Displacement> {
    let (sine, cosine) = libm::sincos(order * reading.joints[joint]);
    vec![reading.moved(joint, cosine), reading.moved(joint, sine)]
}

pub(super) fn both_columns(reading: &Reading, joint: usize) -> Vec<Displacement> {
    [1.0, 2.0].into_iter().flat_map(|order| columns(reading, joint, order)).collect()
}

pub(super) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    let Some(joint) = site.place.filter(|_| site.turns()) else {
        return;
    };
    let half = std::f64::consts::FRAC_1_SQRT_2;
    for order in [1.0, 2.0] {
        let detail = format!("{order} period{} per turn", if order > 1.0 { "s" } else { "" });
        let one = site.hypothesis(Kind::JointEccentricity, Shape::Harmonic { joint, order });
        all.push(Hypothesis { spread: vec![half; 2], detail, ..one });
    }
    let both = site.hypothesis(Kind::JointEccentricity, Shape::TwoHarmonics { joint });
    let detail = "1 and 2 periods per turn; the magnitude is that of the first".to_owned();
    all.push(Hypothesis { spread: vec![half; 4], detail, ..both });
}
