//! Springs across the joint's axis (a Cardan joint) at the joint, outboard of its motion; or, of a link that is a slender beam, two
//! such joints of half the compliance each across the beam, where Gauss's rule with two points wants them: rotation and deflection at
//! the beam's end are integrals of at most cubic polynomials along it, for which that rule is exact.

use crate::simulation::physics::PhysicsError;
use crate::simulation::physics::coordinate::BEAM_POINTS;
use crate::simulation::physics::coordinate::{Axis, Bend, Direction, Law};
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
    let places = if beam { (0..BEAM_POINTS.len()).map(|point| Bend::Beam { point }).collect() } else { vec![Bend::Joint] };
    for bend in &places {
        for axis in Axis::ALL {
            let stiffness = places.len() as f64 / (compliance * axis.share());
            parts.yields(link, Direction::Across { bend: *bend, axis }, Law::Spring { stiffness });
        }
    }
    Ok(())
}
