//! Cosine and sine of a joint's angle, of twice the angle, or of both, turn it.

use std::num::NonZeroUsize;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{
    Coefficients, Displacement, Family, Follows, Form, Named, Reading, Recorded, Shape, Size, Unnamed, from_one,
};
use crate::effects::{Kind, Parameters, Values};

use super::strain_wave_error::RIPPLES;

/// \[2\] Cosine and sine of so many times a joint's angle turn it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Harmonic {
    /// Joint, or the link that it moves.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub joint: usize,
    /// Periods per turn.
    pub order: f64,
}

impl Follows for Harmonic {
    fn form(&self, _: bool) -> Form {
        let family = if self.order >= f64::from(*RIPPLES.start()) { Family::Ripple } else { Family::Harmonic };
        Form {
            columns: 2,
            of_magnitude: 2,
            size: Size::Length,
            needs: Recorded::Pose,
            unnamed: Some(Unnamed { family, contains: None, near: None }),
        }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        let (sine, cosine) = libm::sincos(self.order * reading.joints[self.joint]);
        vec![reading.moved(self.joint, cosine), reading.moved(self.joint, sine)]
    }

    fn of_angle(&self) -> Option<usize> {
        Some(self.joint)
    }
}

impl Named for Harmonic {
    fn undecided(&self, _: &Reading) -> bool {
        false
    }

    fn parameters(&self, of: Coefficients<'_>) -> Parameters {
        // a cos + b sin = amplitude · cos(order · q + phase)
        let phase = libm::atan2(-of.or_zero(1), of.or_zero(0));
        Parameters { order: Some(self.order), phase_rad: Some(phase), ..Parameters::default() }
    }

    fn values(&self, of: Coefficients<'_>) -> Result<Vec<Values>, String> {
        let (amplitude, phase) = of.wave(0)?;
        // An eccentric encoder has an order, a strain-wave gear, which makes two periods per turn of its motor, a ratio.
        Ok(vec![Values { amplitude, phase, order: self.order as u8, ratio: 0.5 * self.order, ..Values::default() }])
    }
}

/// \[4\] Cosine and sine of a joint's angle, and of twice the angle, turn it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TwoHarmonics {
    /// Joint, or the link that it moves.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub joint: usize,
}

impl Follows for TwoHarmonics {
    fn form(&self, _: bool) -> Form {
        // The magnitude is that of the first harmonic.
        Form { columns: 4, of_magnitude: 2, size: Size::Length, needs: Recorded::Pose, unnamed: None }
    }

    fn columns(&self, reading: &Reading, orientation: bool) -> Vec<Displacement> {
        let of = |order: f64| Harmonic { joint: self.joint, order }.columns(reading, orientation);
        [1.0, 2.0].into_iter().flat_map(of).collect()
    }

    fn of_angle(&self) -> Option<usize> {
        Some(self.joint)
    }
}

impl Named for TwoHarmonics {
    fn undecided(&self, _: &Reading) -> bool {
        false
    }

    fn parameters(&self, _: Coefficients<'_>) -> Parameters {
        Parameters::default()
    }

    fn values(&self, of: Coefficients<'_>) -> Result<Vec<Values>, String> {
        let harmonic = |order: u8| {
            let (amplitude, phase) = of.wave(2 * usize::from(order - 1))?;
            Ok(Values { amplitude, phase, order, ..Values::default() })
        };
        [1, 2].into_iter().map(harmonic).collect()
    }
}

pub(in crate::effects) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    let Some(joint) = site.place.filter(|_| site.turns()) else {
        return;
    };
    let half = std::f64::consts::FRAC_1_SQRT_2;
    for order in [1.0, 2.0] {
        let detail = format!("{order} period{} per turn", if order > 1.0 { "s" } else { "" });
        let one = site.hypothesis(Kind::JointEccentricity, Shape::Harmonic(Harmonic { joint, order }));
        all.push(Hypothesis { spread: vec![half; 2], detail, ..one });
    }
    let both = site.hypothesis(Kind::JointEccentricity, Shape::TwoHarmonics(TwoHarmonics { joint }));
    let detail = "1 and 2 periods per turn; the magnitude is that of the first".to_owned();
    all.push(Hypothesis { spread: vec![half; 4], detail, ..both });
}
