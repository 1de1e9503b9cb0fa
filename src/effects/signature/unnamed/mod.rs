//! Shapes that no kind has: where one wins, the cause is unknown.

pub(super) mod all_yield;
pub(super) mod angle_curve;
pub mod angle_map;
pub(super) mod bump;
pub(super) mod course;
pub(super) mod crosstalk;
pub(super) mod direction_load;
mod harmonic;
pub mod memory;
pub(super) mod nonlinear_torque;
pub(super) mod time_curve;
pub mod torque_memory;
pub(super) mod unequal_bend;
pub(super) mod unequal_seat;
pub(super) mod unequal_shift;

use super::library::{Hypothesis, Site};
use crate::units::ARCSEC;

/// Sizes of an error of a joint's angle, rad.
const ANGLE_ERROR: [f64; 2] = [20.0 * ARCSEC, 160.0 * ARCSEC];

/// All of them at `site`.
pub(super) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    let Some(joint) = site.place else {
        course::hypotheses(site, all);
        all_yield::hypotheses(site, all);
        return;
    };
    harmonic::hypotheses(site, joint, all);
    bump::hypotheses(site, joint, all);
    angle_curve::hypotheses(site, joint, all);
    angle_map::hypotheses(site, joint, all);
    crosstalk::hypotheses(site, joint, all);
    unequal_bend::hypotheses(site, joint, all);
    unequal_seat::hypotheses(site, joint, all);
    unequal_shift::hypotheses(site, joint, all);
    nonlinear_torque::hypotheses(site, joint, all);
    torque_memory::hypotheses(site, joint, all);
    memory::hypotheses(site, joint, all);
    time_curve::hypotheses(site, joint, all);
    direction_load::hypotheses(site, joint, all);
}
