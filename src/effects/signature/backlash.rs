//! A joint is off by half a unit in the direction of its last move; a positive coefficient leads, a negative one lags, as play does.

use super::library::{Hypothesis, Site};
use super::shape::{Displacement, Reading, Shape};
use crate::effects::Kind;

pub(super) fn columns(reading: &Reading, joint: usize) -> Vec<Displacement> {
    vec![reading.moved(joint, 0.5 * reading.approach[joint])]
}

pub(super) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    if let Some(joint) = site.place.filter(|_| site.columns.approach) {
        all.push(site.hypothesis(Kind::Backlash, Shape::Direction { joint }));
    }
}
