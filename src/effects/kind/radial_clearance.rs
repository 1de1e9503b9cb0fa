//! A shift along the force across a joint's axis, whatever its size. Friction of the fit holds what carries less than a share of the force
//! in the middle of its play.

use std::num::NonZeroUsize;

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{
    Coefficients, Displacement, Follows, Form, Named, Reading, Recorded, Shape, Size, from_one, little, seated, twist,
};
use crate::effects::{Kind, Parameters, Values};

/// Shares of the load that the friction of a fit may hold in the middle of its play.
pub const HELD: [f64; 4] = [0.0, 0.02, 0.05, 0.1];

/// Whether a share of the load is as near to what friction holds (`held`, one of [`HELD`]) as the next values that are looked at: where
/// friction really ends lies anywhere between them, and with it whether such a load seats anything. Beyond the last one friction is
/// known to a factor of two.
pub(super) fn is_near(held: f64, share: f64) -> bool {
    let below = HELD.iter().copied().filter(|other| *other < held).fold(0.0, f64::max);
    let above = HELD.iter().copied().filter(|other| *other > held).fold(f64::INFINITY, f64::min);
    share >= below && share <= if above.is_finite() { above } else { 2.0 * held }
}

/// \[1\] A shift along the force across a joint's axis. Friction of the fit holds what carries less than the share `held` of the
/// force in the middle of its play.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ForceAcrossSign {
    /// Joint, or the link that it moves.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub joint: usize,
    /// Share.
    pub held: f64,
}

impl Follows for ForceAcrossSign {
    fn form(&self, _: bool) -> Form {
        Form { columns: 1, of_magnitude: 1, size: Size::Length, needs: Recorded::Pose, unnamed: None }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        let joint = self.joint;
        let posture = &reading.posture;
        let (load, sigma) = (posture.force_across(joint), posture.force_sigma(joint));
        vec![twist(seated(load, sigma, self.held * posture.forces[joint].norm()), Vector3::zeros())]
    }
}

impl Named for ForceAcrossSign {
    fn undecided(&self, reading: &Reading) -> bool {
        let joint = self.joint;
        let posture = &reading.posture;
        let (load, all) = (posture.force_across(joint).norm(), posture.forces[joint].norm());
        little(load, posture.force_sigma(joint), all) || is_near(self.held, load / all)
    }

    fn parameters(&self, _: Coefficients<'_>) -> Parameters {
        Parameters { held: Some(self.held), ..Parameters::default() }
    }

    fn values(&self, of: Coefficients<'_>) -> Result<Vec<Values>, String> {
        Ok(vec![Values { radial: of.at(0)?, held: Some(self.held), ..Values::default() }])
    }
}

pub(in crate::effects) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    let Some(joint) = site.place else {
        return;
    };
    for held in HELD {
        let detail = if held > 0.0 { format!("friction holds loads below {:.0} %", 100.0 * held) } else { String::new() };
        all.push(Hypothesis {
            detail,
            ..site.hypothesis(Kind::RadialClearance, Shape::ForceAcrossSign(ForceAcrossSign { joint, held }))
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_load_is_near_what_friction_holds_up_to_the_next_values() {
        let near = |held: f64| -> Vec<f64> {
            [0.001, 0.019, 0.03, 0.049, 0.07, 0.15, 0.25].into_iter().filter(|share| is_near(held, *share)).collect()
        };
        assert_eq!(near(0.0), [0.001, 0.019]);
        assert_eq!(near(0.02), [0.001, 0.019, 0.03, 0.049]);
        assert_eq!(near(0.05), [0.03, 0.049, 0.07]);
        assert_eq!(near(0.1), [0.07, 0.15]);
    }
}
