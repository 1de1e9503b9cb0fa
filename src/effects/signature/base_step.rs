//! A twist of the base from a reading on.

use super::library::{Hypothesis, Site, twist_spread};
use super::shape::{Displacement, Reading, Shape};
use crate::effects::Kind;

pub(super) fn columns(reading: &Reading, row: usize) -> Vec<Displacement> {
    let after = f64::from(u8::from(reading.order >= row));
    reading.base_twist(after)
}

pub(super) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    if site.place.is_none() {
        all.extend(site.columns.changes.iter().map(|row| {
            let step = site.hypothesis(Kind::BaseStep, Shape::BaseStep { row: *row });
            Hypothesis { spread: twist_spread(true), ..step }
        }));
    }
}
