//! Shapes that no kind has: where one wins, the cause is unknown.

pub mod all_yield;
pub mod angle_curve;
pub mod angle_map;
pub mod bump;
pub mod course;
pub mod crosstalk;
mod harmonic;
pub mod memory;
pub mod nonlinear_torque;
pub mod time_curve;
pub mod torque_memory;
pub mod unequal_bend;
pub mod unequal_seat;
pub mod unequal_shift;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use all_yield::AllYield;
use angle_curve::AngleCurve;
use angle_map::AngleMap;
use bump::Bump;
use course::{BaseCourse, ToolCourse};
use crosstalk::Crosstalk;
use memory::Memory;
use nonlinear_torque::{Hardening, Softening};
use time_curve::TimeCurve;
use torque_memory::TorqueMemory;
use unequal_bend::UnequalBend;
use unequal_seat::UnequalSeat;
use unequal_shift::UnequalShift;

use super::library::{Hypothesis, Site};
use super::shape::{Follows, Shape};
use crate::units::ARCSEC;

/// Sizes of an error of a joint's angle, rad.
const ANGLE_ERROR: [f64; 2] = [20.0 * ARCSEC, 160.0 * ARCSEC];

/// A shape that no kind has.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "shape", rename_all = "snake_case")]
#[schemars(inline)]
#[expect(missing_docs, reason = "each is described in its file")]
pub enum Nameless {
    UnequalBend(UnequalBend),
    UnequalSeat(UnequalSeat),
    UnequalShift(UnequalShift),
    BaseCourse(BaseCourse),
    ToolCourse(ToolCourse),
    Bump(Bump),
    AngleCurve(AngleCurve),
    AngleMap(AngleMap),
    Crosstalk(Crosstalk),
    Softening(Softening),
    Hardening(Hardening),
    TorqueMemory(TorqueMemory),
    AllYield(AllYield),
    Memory(Memory),
    TimeCurve(TimeCurve),
}

impl Nameless {
    pub(super) fn follows(&self) -> &dyn Follows {
        match self {
            Nameless::UnequalBend(of) => of,
            Nameless::UnequalSeat(of) => of,
            Nameless::UnequalShift(of) => of,
            Nameless::BaseCourse(of) => of,
            Nameless::ToolCourse(of) => of,
            Nameless::Bump(of) => of,
            Nameless::AngleCurve(of) => of,
            Nameless::AngleMap(of) => of,
            Nameless::Crosstalk(of) => of,
            Nameless::Softening(of) => of,
            Nameless::Hardening(of) => of,
            Nameless::TorqueMemory(of) => of,
            Nameless::AllYield(of) => of,
            Nameless::Memory(of) => of,
            Nameless::TimeCurve(of) => of,
        }
    }
}

impl From<Nameless> for Shape {
    fn from(nameless: Nameless) -> Shape {
        Shape::Nameless(nameless)
    }
}

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
}
