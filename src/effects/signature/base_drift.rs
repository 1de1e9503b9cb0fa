//! A twist of the base in proportion to time.

use super::library::{Hypothesis, Site, twist_spread};
use super::shape::{Displacement, Reading, Shape};
use crate::effects::Kind;

pub(super) fn columns(reading: &Reading) -> Vec<Displacement> {
    reading.base_twist(reading.share)
}

pub(super) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    if site.place.is_none() && site.columns.time {
        let drift = site.hypothesis(Kind::BaseDrift, Shape::BaseDrift);
        all.push(Hypothesis { spread: twist_spread(true), ..drift });
    }
}
