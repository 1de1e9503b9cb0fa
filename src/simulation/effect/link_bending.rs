//! Two springs across the joint's axis (a Cardan joint) at the joint, outboard of its motion; or, of a link that is a slender beam, two
//! Cardan joints of half the compliance each across the beam, where Gauss's rule with two points wants them: rotation and deflection at
//! the beam's end are integrals of at most cubic polynomials along it, for which that rule is exact.

use crate::simulation::physics::PhysicsError;
use crate::simulation::physics::coordinate::BEAM_POINTS;
use crate::simulation::physics::coordinate::{Direction, Law};
use crate::simulation::physics::mechanism::{Checks, Mechanisms};

pub(super) fn add(
    parts: &mut Mechanisms,
    checks: &Checks<'_>,
    link: usize,
    compliance: f64,
    beam: bool,
) -> Result<(), PhysicsError> {
    checks.exists("link", link)?;
    checks.soft("compliance", compliance)?;
    if beam {
        let stiffness = BEAM_POINTS.len() as f64 / compliance;
        for point in 0..BEAM_POINTS.len() {
            for direction in [Direction::AcrossBeamX { point }, Direction::AcrossBeamY { point }] {
                parts.yields(link, direction, Law::Spring { stiffness });
            }
        }
    } else {
        for direction in [Direction::AcrossX, Direction::AcrossY] {
            parts.yields(link, direction, Law::Spring { stiffness: 1.0 / compliance });
        }
    }
    Ok(())
}
