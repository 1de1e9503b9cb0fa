//! A link grows with its temperature; or all do, and the foot with its own, with that of the first link, or not at all.

use std::num::NonZeroUsize;

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{
    Coefficients, Displacement, Follows, Form, Named, Reading, Recorded, Shape, Size, from_one_or_none, twist,
};
use crate::effects::{Foot, Kind, Parameters, Values};

/// \[1\] A link grows with its temperature; all, and the foot, where there is none.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Growth {
    /// Link.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "from_one_or_none")]
    #[schemars(with = "Option<NonZeroUsize>")]
    pub link: Option<usize>,
}

impl Follows for Growth {
    fn form(&self, _: bool) -> Form {
        Form { columns: 1, of_magnitude: 1, size: Size::Length, needs: Recorded::Temperatures, unnamed: None }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        vec![twist(growth(reading, self.link), Vector3::zeros())]
    }
}

impl Named for Growth {
    fn undecided(&self, _: &Reading) -> bool {
        false
    }

    fn parameters(&self, _: Coefficients<'_>) -> Parameters {
        Parameters::default()
    }

    fn values(&self, of: Coefficients<'_>) -> Result<Vec<Values>, String> {
        Ok(vec![Values { expansion: of.at(0)?, ..Values::default() }])
    }
}

/// \[1\] All links grow with their temperatures, and the foot with that of the first link, or not at all.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct GrowthOnFoot {
    /// Whether the foot grows.
    pub grows: bool,
}

impl Follows for GrowthOnFoot {
    fn form(&self, _: bool) -> Form {
        Form { columns: 1, of_magnitude: 1, size: Size::Length, needs: Recorded::Temperatures, unnamed: None }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        let foot_k = if self.grows { reading.rise_k[0] } else { 0.0 };
        let change = reading.posture.origins[0] * (foot_k - reading.foot_rise_k);
        vec![twist(growth(reading, None) + change, Vector3::zeros())]
    }
}

impl Named for GrowthOnFoot {
    fn undecided(&self, _: &Reading) -> bool {
        false
    }

    fn parameters(&self, _: Coefficients<'_>) -> Parameters {
        Parameters::default()
    }

    fn values(&self, of: Coefficients<'_>) -> Result<Vec<Values>, String> {
        let foot = if self.grows { Foot::AsFirstLink } else { Foot::Still };
        Ok(vec![Values { expansion: of.at(0)?, foot, ..Values::default() }])
    }
}

fn growth(reading: &Reading, link: Option<usize>) -> Vector3<f64> {
    let posture = &reading.posture;
    let count = reading.joints.len();
    let end = |link: usize| if link + 1 < count { posture.origins[link + 1] } else { reading.target };
    let grown = |link: usize| (end(link) - posture.origins[link]) * reading.rise_k[link];
    match link {
        Some(link) => grown(link),
        None => posture.origins[0] * reading.foot_rise_k + (0..count).map(grown).sum::<Vector3<f64>>(),
    }
}

pub(in crate::effects) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    if !site.columns.temperature {
        return;
    }
    all.push(site.hypothesis(Kind::LinkThermalGrowth, Shape::Growth(Growth { link: site.place })));
    if site.place.is_none() {
        for (grows, detail) in [(true, "the foot as warm as the first link"), (false, "the foot does not grow")] {
            let growth = site.hypothesis(Kind::LinkThermalGrowth, Shape::GrowthOnFoot(GrowthOnFoot { grows }));
            all.push(Hypothesis { detail: detail.to_owned(), ..growth });
        }
    }
}
