//! More periods per turn than an encoder makes, and fewer than a gear does. The columns are those of an eccentric encoder.

use crate::effects::Kind;
use crate::effects::kind::joint_eccentricity::Harmonic;
use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::Shape;

/// Periods per turn.
const ORDERS: [f64; 2] = [3.0, 4.0];

pub(super) fn hypotheses(site: &Site<'_>, joint: usize, all: &mut Vec<Hypothesis>) {
    if site.turns() {
        for order in ORDERS {
            let detail = format!("{order} periods per turn of joint {}", joint + 1);
            let spread = vec![std::f64::consts::FRAC_1_SQRT_2; 2];
            all.push(site.unnamed(
                Shape::Harmonic(Harmonic { joint, order }),
                site.range(Kind::JointEccentricity),
                spread,
                detail,
            ));
        }
    }
}
