//! A joint goes on moving after each move: it is behind by a share of the way, which fades with time.

use std::num::NonZeroUsize;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{
    Coefficients, Displacement, FADING_S, Follows, Form, Named, Reading, Recorded, Shape, Size, from_one,
};
use crate::effects::{Kind, Parameters, Values};

/// \[1, 2 where more than the last move counts\] A joint is behind by a share of its ways from reading to reading, each faded since; and by
/// what was left of those before the first.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Behind {
    /// Joint, or the link that it moves.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub joint: usize,
    /// Which time it takes to fade, from 0: at once (only the last move counts), then longer and longer.
    pub which: usize,
}

impl Behind {
    /// Time over which it fades, s.
    fn fading_s(&self) -> f64 {
        FADING_S.get(self.which).copied().unwrap_or(0.0)
    }
}

impl Follows for Behind {
    fn form(&self, _: bool) -> Form {
        Form {
            columns: if self.which == 0 { 1 } else { 2 },
            of_magnitude: 1,
            size: Size::Length,
            needs: Recorded::Moves,
            unnamed: None,
        }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        let own = reading.moved(self.joint, -reading.behind[self.joint][self.which.min(FADING_S.len() - 1)]);
        if self.which == 0 {
            return vec![own];
        }
        vec![own, reading.moved(self.joint, -libm::exp(-reading.since_begin_s / self.fading_s()))]
    }
}

impl Named for Behind {
    fn undecided(&self, reading: &Reading) -> bool {
        reading.since_begin_s == 0.0
    }

    fn parameters(&self, _: Coefficients<'_>) -> Parameters {
        Parameters { time_constant_s: Some(self.fading_s()), ..Parameters::default() }
    }

    fn values(&self, of: Coefficients<'_>) -> Result<Vec<Values>, String> {
        Ok(vec![Values { lag: of.at(0)?, time_constant: self.fading_s(), ..Values::default() }])
    }
}

pub(in crate::effects) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    let Some(joint) = site.place.filter(|_| site.columns.moves) else {
        return;
    };
    for (which, time) in FADING_S.iter().enumerate() {
        let detail = if which == 0 { "gone by the next reading".to_owned() } else { format!("fading over about {time:.0} s") };
        let spread = vec![1.0; if which == 0 { 1 } else { 2 }];
        all.push(Hypothesis { detail, spread, ..site.hypothesis(Kind::Creep, Shape::Behind(Behind { joint, which })) });
    }
}
