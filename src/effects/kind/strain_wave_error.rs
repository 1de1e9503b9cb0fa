//! Cosine and sine of so many times a joint's angle turn it: twice the ratio of a strain-wave gear.

use super::joint_eccentricity::Harmonic;
use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::Shape;
use crate::effects::{Kind, Level, Location};

/// Periods per turn (2 N) of the ratios N in which strain-wave gears are sold: 30, 50, 80, 100, 120, 160.
pub const WAVES_PER_TURN: [u16; 6] = [60, 100, 160, 200, 240, 320];
/// Periods per turn of which a ripple is looked for.
pub const RIPPLES: std::ops::RangeInclusive<u16> = 5..=400;
/// Of the prior, the share of ratios that are not sold off the shelf.
const OTHER_RATIOS: f64 = 0.3;

/// A ripple of a joint that turns: `waves` periods per turn. Even counts are twice the ratio of a strain-wave gear; others, and all where
/// strain-wave errors are not to be named, have no name.
#[must_use]
pub fn ripple(joint: usize, waves: u16, nameless: bool) -> Hypothesis {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let wave = Hypothesis {
        kind: Some(Kind::StrainWaveError),
        location: Location { level: Level::Joint, index: Some(joint + 1) },
        shape: Shape::Harmonic(Harmonic { joint, order: f64::from(waves) }),
        // The same at all joints.
        range: Kind::StrainWaveError.range(Some(joint), joint + 1),
        spread: vec![half; 2],
        detail: String::new(),
        share: None,
    };
    let (least, most) = (WAVES_PER_TURN[0], WAVES_PER_TURN[WAVES_PER_TURN.len() - 1]);
    if nameless || waves % 2 == 1 || !(least..=most).contains(&waves) {
        let detail = format!("{waves} periods per turn of joint {}", joint + 1);
        return Hypothesis { kind: None, detail, share: Some(1.0 / RIPPLES.len() as f64), ..wave };
    }
    let sold = WAVES_PER_TURN.contains(&waves);
    let share =
        if sold { (1.0 - OTHER_RATIOS) / WAVES_PER_TURN.len() as f64 } else { OTHER_RATIOS / f64::from((most - least) / 2) };
    Hypothesis { detail: format!("{waves} periods per turn"), share: Some(share), ..wave }
}

pub(in crate::effects) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    if let Some(joint) = site.place.filter(|_| site.turns()) {
        all.extend(WAVES_PER_TURN.map(|waves| ripple(joint, waves, false)));
    }
}
