//! A turn along the moment across a joint's axis, whatever its size. Friction of the fit holds what carries less than a share of the
//! force times the length of the arm outboard.

use std::num::NonZeroUsize;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{
    Coefficients, Displacement, Follows, Form, Named, Reading, Recorded, Shape, Size, from_one, little, seated,
};
use crate::effects::{Kind, Parameters, Values};

use super::radial_clearance::{HELD, is_near};

/// \[1\] A turn along the moment across a joint's axis. Friction of the fit holds what carries less than the share `held` of the
/// force times the length of the arm outboard.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MomentAcrossSign {
    /// Joint, or the link that it moves.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub joint: usize,
    /// Share.
    pub held: f64,
}

impl Follows for MomentAcrossSign {
    fn form(&self, _: bool) -> Form {
        Form { columns: 1, of_magnitude: 1, size: Size::Length, needs: Recorded::Pose, unnamed: None }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        let joint = self.joint;
        let posture = &reading.posture;
        let (load, sigma) = (posture.moment_across(joint), posture.moment_sigma(joint));
        vec![reading.turned(joint, seated(load, sigma, self.held * posture.forces[joint].norm() * posture.reaches[joint]))]
    }
}

impl Named for MomentAcrossSign {
    fn undecided(&self, reading: &Reading) -> bool {
        let joint = self.joint;
        let posture = &reading.posture;
        let (load, all) = (posture.moment_across(joint).norm(), posture.forces[joint].norm() * posture.reaches[joint]);
        little(load, posture.moment_sigma(joint), all) || is_near(self.held, load / all)
    }

    fn parameters(&self, _: Coefficients<'_>) -> Parameters {
        Parameters { held: Some(self.held), ..Parameters::default() }
    }

    fn values(&self, of: Coefficients<'_>) -> Result<Vec<Values>, String> {
        Ok(vec![Values { tilt: of.at(0)?, held: Some(self.held), ..Values::default() }])
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
            ..site.hypothesis(Kind::TiltClearance, Shape::MomentAcrossSign(MomentAcrossSign { joint, held }))
        });
    }
}
