//! The whole arm turns about the base's origin along the horizontal moment that arm and payload have about it.
//!
//! Where the first joint stands upright on that origin this is what bending of the first link does: no reading of the arm tells the two
//! apart, and both are then said.

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::arm::Arm;
use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{Coefficients, Displacement, Follows, Form, Named, Reading, Recorded, Shape, Size, twist};
use crate::effects::{Kind, Parameters, Values};

/// \[1\] A turn about the base's origin along the horizontal moment about it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BaseTilt {}

impl Follows for BaseTilt {
    fn form(&self, _: bool) -> Form {
        Form { columns: 1, of_magnitude: 1, size: Size::Length, needs: Recorded::Pose, unnamed: None }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        let posture = &reading.posture;
        let (Some(origin), Some(force), Some(moment)) =
            (posture.origins.first(), posture.forces.first(), posture.moments.first())
        else {
            return vec![[0.0; 6]];
        };
        let about_base: Vector3<f64> = moment + origin.cross(force);
        let up = reading.gravity / reading.gravity.norm().max(1e-12);
        let turn = about_base - up * up.dot(&about_base);
        vec![twist(turn.cross(&reading.target), turn)]
    }
}

impl Named for BaseTilt {
    fn undecided(&self, _: &Reading) -> bool {
        false
    }

    fn parameters(&self, _: Coefficients<'_>) -> Parameters {
        Parameters::default()
    }

    fn values(&self, of: Coefficients<'_>) -> Result<Vec<Values>, String> {
        Ok(vec![Values { compliance: of.at(0)?, ..Values::default() }])
    }
}

pub(in crate::effects) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    if site.place.is_none() {
        let tilt = site.hypothesis(Kind::BaseTilt, Shape::BaseTilt(BaseTilt {}));
        // As likely as that one of the links bends: the first may be the same thing.
        all.push(Hypothesis { share: Some(1.0 / site.joints() as f64), ..tilt });
    }
}

/// Whether bending of the first link does the same: where the first joint stands upright on the base's origin.
pub(in crate::effects) fn doubles(arm: &Arm) -> bool {
    let first = arm.chain.at_nominal().segments()[0];
    let axis = first.rotation * Vector3::z();
    let (up, foot) = (arm.gravity_in_base.normalize(), first.translation.vector);
    // Within a tenth of a degree and a tenth of a millimetre.
    let apart = axis.cross(&up).norm() > 2e-3 || (foot - up * up.dot(&foot)).norm() > 1e-4;
    !apart
}
