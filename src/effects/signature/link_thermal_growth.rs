//! A link grows with its temperature; or all do, and the foot with its own, with that of the first link, or not at all.

use nalgebra::Vector3;

use super::library::{Hypothesis, Site};
use super::shape::{Displacement, Reading, Shape, twist};
use crate::effects::Kind;

/// One link, or all and the foot.
pub(super) fn columns(reading: &Reading, link: Option<usize>) -> Vec<Displacement> {
    vec![twist(growth(reading, link), Vector3::zeros())]
}

/// All links, and the foot as warm as the first of them, or without growth.
pub(super) fn on_foot_columns(reading: &Reading, grows: bool) -> Vec<Displacement> {
    let foot_k = if grows { reading.rise_k[0] } else { 0.0 };
    let change = reading.posture.origins[0] * (foot_k - reading.foot_rise_k);
    vec![twist(growth(reading, None) + change, Vector3::zeros())]
}

fn growth(reading: &Reading, link: Option<usize>) -> Vector3<f64> {
    let posture = &reading.posture;
    let count = reading.joints.len();
    let end = |link: usize| if link + 1 < count { posture.origins[link + 1] } else { reading.target };
    let grown = |link: usize| (end(link) - posture.origins[link]) * reading.rise_k[link];
    match link {
        Some(link) => grown(link),
        None => posture.origins[0] * reading.foot_rise_k + (0..count).map(grown).sum::<Vector3<f64>>(),
    }
}

pub(super) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    if !site.columns.temperature {
        return;
    }
    all.push(site.hypothesis(Kind::LinkThermalGrowth, Shape::Growth { link: site.place }));
    if site.place.is_none() {
        for (grows, detail) in [(true, "the foot as warm as the first link"), (false, "the foot does not grow")] {
            let growth = site.hypothesis(Kind::LinkThermalGrowth, Shape::GrowthOnFoot { grows });
            all.push(Hypothesis { detail: detail.to_owned(), ..growth });
        }
    }
}
