//! A joint is off by half a unit in the direction of its torque; an upright joint, which has none, in that of the torque that it would
//! have if its axis leant.

use nalgebra::Vector3;

use super::library::{Hypothesis, Site};
use super::shape::{Displacement, Reading, Shape, across, little, seated};
use crate::effects::Kind;

/// Shares of the load that friction may hold where only a lean seats the play: far more than where the load itself does.
const LEANING_HELD: [f64; 5] = [0.0, 0.08, 0.16, 0.24, 0.32];
/// Azimuths in which gravity may lean.
const LEANS: usize = 24;
/// Share of the largest torque below which nobody knows on which side a leaning joint's play is seated: the azimuth of the lean is
/// known to half a step between those that are tried.
const LEAN_EDGE: f64 = 0.1;

pub(super) fn columns(reading: &Reading, joint: usize) -> Vec<Displacement> {
    let posture = &reading.posture;
    let effort = reading.effort(joint);
    let sigma = if reading.slides[joint] { posture.force_sigma(joint) } else { posture.moment_sigma(joint) };
    vec![reading.moved(joint, 0.5 * effort / libm::hypot(effort, sigma).max(1e-9))]
}

pub(super) fn leaning_columns(reading: &Reading, joint: usize, azimuth: f64, held: f64) -> Vec<Displacement> {
    let posture = &reading.posture;
    // First moment of the mass outboard, across gravity; where gravity leans towards `lean` the torque follows `lean · lever`.
    let gravity = reading.gravity;
    let lever = gravity.cross(&posture.moments[joint]) / gravity.norm().max(1e-12);
    let (x, y) = across(&posture.axes[joint]);
    let lean = x * libm::cos(azimuth) + y * libm::sin(azimuth);
    let all = posture.forces[joint].norm() * posture.reaches[joint];
    let seat = seated(lean * lean.dot(&lever), LEAN_EDGE * lever.norm(), held * all);
    vec![reading.moved(joint, 0.5 * lean.dot(&seat))]
}

pub(super) fn undecided(reading: &Reading, joint: usize) -> bool {
    let posture = &reading.posture;
    let (sigma, all) = if reading.slides[joint] {
        (posture.force_sigma(joint), posture.forces[joint].norm())
    } else {
        (posture.moment_sigma(joint), posture.moments[joint].norm())
    };
    little(reading.effort(joint).abs(), sigma, all)
}

pub(super) fn leaning_undecided(reading: &Reading, joint: usize, azimuth: f64, held: f64) -> bool {
    let [x, y, z, ..] = leaning_columns(reading, joint, azimuth, held)[0];
    let [a, b, c, ..] = reading.moved(joint, 0.5);
    Vector3::new(x, y, z).norm() < 0.9 * Vector3::new(a, b, c).norm()
}

pub(super) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    let Some(joint) = site.place else {
        return;
    };
    let seated = site.hypothesis(Kind::GravityLostMotion, Shape::TorqueSign { joint });
    all.push(seated.clone());
    if site.turns() && site.columns.upright[joint] {
        for (step, held) in (0..LEANS).flat_map(|step| LEANING_HELD.map(|held| (step, held))) {
            let azimuth = step as f64 * std::f64::consts::TAU / LEANS as f64;
            let shape = Shape::LeaningTorqueSign { joint, azimuth, held };
            let detail = format!("seated as if the axis leant towards {:.0}°", azimuth.to_degrees());
            all.push(Hypothesis { shape, detail, ..seated.clone() });
        }
    }
}
