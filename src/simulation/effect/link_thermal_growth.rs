//! Segments that scale with the temperature of the link that they are on.

use crate::simulation::effect::{Foot, Growing};
use crate::simulation::physics::PhysicsError;
use crate::simulation::physics::mechanism::{Checks, Mechanisms};

pub(super) fn add(parts: &mut Mechanisms, checks: &Checks<'_>, of: Growing, expansion: f64) -> Result<(), PhysicsError> {
    if expansion.abs() > 1e-3 || !expansion.is_finite() {
        return checks.bad("expansion", expansion, "between -0.001 and 0.001 (1/K)");
    }
    match of {
        Growing::Link(link) => {
            checks.exists("link", link)?;
            parts.expansion_per_k[link + 1] += expansion;
        }
        Growing::Arm(foot) => {
            parts.expansion_per_k[1..].iter_mut().for_each(|of_link| *of_link += expansion);
            match foot {
                Foot::Own => parts.expansion_per_k[0] += expansion,
                Foot::AsFirstLink => parts.foot_expansion_with_first_link_per_k += expansion,
                Foot::Still => {}
            }
        }
    }
    Ok(())
}
