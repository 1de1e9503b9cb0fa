//! A twist of the tool from a reading on; without orientations its rotation cannot be seen.

use super::library::{Hypothesis, Site, twist_spread};
use super::shape::{Displacement, Reading, Shape};
use crate::effects::Kind;

pub(super) fn columns(reading: &Reading, row: usize, orientation: bool) -> Vec<Displacement> {
    let after = f64::from(u8::from(reading.order >= row));
    reading.tool_twist(after, orientation)
}

pub(super) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    if site.place.is_none() {
        all.extend(site.columns.changes.iter().map(|row| {
            let step = site.hypothesis(Kind::ToolStep, Shape::ToolStep { row: *row });
            Hypothesis { spread: twist_spread(site.columns.orientation), ..step }
        }));
    }
}
