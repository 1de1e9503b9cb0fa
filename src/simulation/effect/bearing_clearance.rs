//! Radial, axial and tilting play of a bearing: free, limited coordinates that gravity seats, unless friction holds them in the middle.

use crate::simulation::physics::PhysicsError;
use crate::simulation::physics::clearance::Clearance;
use crate::simulation::physics::mechanism::{Checks, Mechanisms};

pub(super) fn add(
    parts: &mut Mechanisms,
    checks: &Checks<'_>,
    joint: usize,
    clearance: Clearance,
    held: Option<f64>,
) -> Result<(), PhysicsError> {
    checks.exists("joint", joint)?;
    clearance.check(joint)?;
    if let Some(share) = held {
        checks.share("share of the load that friction holds", share)?;
        let of_joint = &mut parts.held[joint];
        if clearance.radial_m > 0.0 || clearance.axial_m > 0.0 {
            of_joint.force = Some(share);
        }
        if clearance.tilt_rad > 0.0 {
            of_joint.moment = Some(share);
        }
    }
    let sum = &mut parts.clearances[joint];
    sum.radial_m += clearance.radial_m;
    sum.axial_m += clearance.axial_m;
    sum.tilt_rad += clearance.tilt_rad;
    Ok(())
}
