//! A joint goes on moving after each move: it is behind by a share of the way, which fades with time.

use std::num::NonZeroUsize;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::signature::library::{Columns, Hypothesis, Site};
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
    /// Time over which it fades, s; zero: it is gone by the next reading.
    pub fading_s: f64,
}

/// Steps of the time from one in the library to the next.
const CLOSER: i32 = 4;

impl Follows for Behind {
    fn form(&self, _: bool) -> Form {
        Form {
            columns: if self.fading_s == 0.0 { 1 } else { 2 },
            of_magnitude: 1,
            size: Size::Length,
            needs: Recorded::Moves,
            unnamed: None,
        }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        let behind = &reading.behind[self.joint];
        if self.fading_s == 0.0 {
            return vec![reading.moved(self.joint, -behind[0])];
        }
        // Between the times that are known, in proportion to their logarithms.
        let next = FADING_S.partition_point(|known| *known < self.fading_s).clamp(2, FADING_S.len() - 1);
        let [from, to] = [FADING_S[next - 1], FADING_S[next]];
        let share = (libm::log(self.fading_s / from) / libm::log(to / from)).clamp(0.0, 1.0);
        let left = behind[next - 1] * (1.0 - share) + behind[next] * share;
        let before = libm::exp(-reading.since_begin_s / self.fading_s);
        vec![reading.moved(self.joint, -left), reading.moved(self.joint, -before)]
    }
}

impl Named for Behind {
    fn undecided(&self, reading: &Reading) -> bool {
        reading.since_begin_s == 0.0
    }

    fn closer(&self, _: &Columns) -> Vec<(Shape, String)> {
        let of = |step: i32| {
            let fading_s = self.fading_s * libm::exp2(0.5 * f64::from(step) / f64::from(CLOSER));
            (Shape::Behind(Behind { fading_s, ..*self }), words(fading_s))
        };
        // What a closer look has found needs none.
        let steps = if FADING_S[1..].contains(&self.fading_s) { 1 - CLOSER..CLOSER } else { 0..0 };
        steps.filter(|step| *step != 0).map(of).collect()
    }

    fn parameters(&self, _: Coefficients<'_>) -> Parameters {
        Parameters { time_constant_s: Some(self.fading_s), ..Parameters::default() }
    }

    fn values(&self, of: Coefficients<'_>) -> Result<Vec<Values>, String> {
        Ok(vec![Values { lag: of.at(0)?, time_constant: self.fading_s, ..Values::default() }])
    }
}

pub(in crate::effects) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    let Some(joint) = site.place.filter(|_| site.columns.moves) else {
        return;
    };
    for fading_s in FADING_S {
        let spread = vec![1.0; if fading_s == 0.0 { 1 } else { 2 }];
        let of = site.hypothesis(Kind::Creep, Shape::Behind(Behind { joint, fading_s }));
        all.push(Hypothesis { detail: words(fading_s), spread, ..of });
    }
}

fn words(fading_s: f64) -> String {
    if fading_s == 0.0 { "gone by the next reading".to_owned() } else { format!("fading over about {fading_s:.0} s") }
}
