//! Cosine and sine of so many times a joint's angle turn it: once, twice or four times per turn of the motor, as gears err.

use std::num::NonZeroUsize;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::joint_eccentricity::Harmonic;
use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{
    Coefficients, Displacement, Follows, Form, Named, Reading, Recorded, Shape, Size, from_one,
};
use crate::effects::{Kind, Level, Location, Parameters, Values};

/// Ratios in which gears of joints are sold: the series of strain-wave gears, and planetary stages that desktop arms have.
const RATIOS: [u16; 8] = [20, 30, 50, 80, 100, 120, 150, 160];
/// Periods per turn of the motor: an eccentric shaft, the two lobes of a wave generator, and both once more.
const PER_MOTOR_TURN: [u16; 3] = [1, 2, 4];
/// Periods per turn of which a ripple is looked for, as far as the readings tell.
pub const RIPPLES: std::ops::RangeInclusive<u16> = 5..=640;
/// Of the prior, the share of ratios that are not sold off the shelf.
const OTHER_RATIOS: f64 = 0.3;
/// Encoders divide a turn by two over and over: so many periods per turn and their doubles are an encoder's, no gear's.
const ENCODERS: u16 = 64;
/// What else a gear does beside its strongest ripple, over that.
const WEAKER: f64 = 0.5;

/// Periods per turn that gears which are sold make.
pub fn sold() -> Vec<u16> {
    let mut all: Vec<u16> = RATIOS.iter().flat_map(|ratio| PER_MOTOR_TURN.map(|times| ratio * times)).collect();
    all.sort_unstable();
    all.dedup();
    all.retain(|waves| is_a_gears(*waves));
    all
}

/// Whether so many periods per turn may be a gear's.
fn is_a_gears(waves: u16) -> bool {
    (RATIOS[0]..=*RIPPLES.end()).contains(&waves) && !(waves.is_power_of_two() && waves >= ENCODERS)
}

/// \[6\] Cosine and sine of once, twice and four times a motor's angle turn its joint: those of the strongest ripple first.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Gear {
    /// Joint, or the link that it moves.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub joint: usize,
    /// Turns of the motor per turn of the joint.
    pub ratio: f64,
    /// Periods of the strongest ripple per turn of the motor: 1, 2 or 4.
    pub strongest: f64,
}

impl Gear {
    /// Periods per turn of the joint, the strongest first.
    fn orders(&self) -> [f64; 3] {
        let mut times = PER_MOTOR_TURN.map(f64::from);
        times.sort_by_key(|times| *times != self.strongest);
        times.map(|times| times * self.ratio)
    }

    fn waves(&self) -> [Harmonic; 3] {
        self.orders().map(|order| Harmonic { joint: self.joint, order })
    }
}

impl Follows for Gear {
    fn form(&self, _: bool) -> Form {
        // The magnitude is that of the strongest.
        Form { columns: 6, of_magnitude: 2, size: Size::Length, needs: Recorded::Pose, unnamed: None }
    }

    fn columns(&self, reading: &Reading, orientation: bool) -> Vec<Displacement> {
        self.waves().iter().flat_map(|wave| wave.columns(reading, orientation)).collect()
    }

    fn of_angle(&self) -> Option<usize> {
        Some(self.joint)
    }
}

impl Named for Gear {
    fn undecided(&self, _: &Reading) -> bool {
        false
    }

    fn parameters(&self, of: Coefficients<'_>) -> Parameters {
        self.waves()[0].parameters(of)
    }

    fn values(&self, of: Coefficients<'_>) -> Result<Vec<Values>, String> {
        let wave = |(number, order): (usize, f64)| {
            let (amplitude, phase) = of.wave(2 * number)?;
            Ok(Values { amplitude, phase, ratio: 0.5 * order, ..Values::default() })
        };
        self.orders().into_iter().enumerate().map(wave).collect()
    }
}

/// The joint (from 0) that a ripple turns, and its periods per turn (of a gear, of the strongest).
#[must_use]
pub fn strongest(shape: &Shape) -> Option<(usize, f64)> {
    match shape {
        Shape::Harmonic(wave) => Some((wave.joint, wave.order)),
        Shape::Gear(gear) => Some((gear.joint, gear.orders()[0])),
        _ => None,
    }
}

/// What a ripple of a joint that turns may be, `waves` periods per turn: alone, and as the strongest of a gear's. Those that no gear makes,
/// and all where strain-wave errors are not to be named, have no name.
#[must_use]
pub fn ripple(joint: usize, waves: u16, nameless: bool) -> Vec<Hypothesis> {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let alone = Hypothesis {
        kind: Some(Kind::StrainWaveError),
        location: Location { level: Level::Joint, index: Some(joint + 1) },
        shape: Shape::Harmonic(Harmonic { joint, order: f64::from(waves) }),
        // The same at all joints.
        range: Kind::StrainWaveError.range(Some(joint), joint + 1),
        spread: vec![half; 2],
        detail: format!("{waves} periods per turn"),
        share: None,
    };
    if nameless || !is_a_gears(waves) {
        let detail = format!("{waves} periods per turn of joint {}", joint + 1);
        return vec![Hypothesis { kind: None, detail, share: Some(1.0 / RIPPLES.len() as f64), ..alone }];
    }
    let sold = sold();
    let share = if sold.contains(&waves) {
        (1.0 - OTHER_RATIOS) / sold.len() as f64
    } else {
        OTHER_RATIOS / (RIPPLES.len() - sold.len()) as f64
    };
    let gear = |times: &u16| {
        let ratio = waves.is_multiple_of(*times).then(|| waves / times).filter(|ratio| *ratio >= RATIOS[0])?;
        let weaker = half * WEAKER;
        Some(Hypothesis {
            shape: Shape::Gear(Gear { joint, ratio: f64::from(ratio), strongest: f64::from(*times) }),
            spread: vec![half, half, weaker, weaker, weaker, weaker],
            detail: format!(
                "1, 2 and 4 per turn of a motor that turns {ratio} times; the magnitude is that of {waves} periods per turn"
            ),
            ..alone.clone()
        })
    };
    let gears: Vec<Hypothesis> = PER_MOTOR_TURN.iter().filter_map(gear).collect();
    let each = Some(0.5 * share / gears.len().max(1) as f64);
    let gears = gears.into_iter().map(|gear| Hypothesis { share: each, ..gear });
    std::iter::once(Hypothesis { share: Some(0.5 * share), ..alone.clone() }).chain(gears).collect()
}

pub(in crate::effects) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    if let Some(joint) = site.place.filter(|_| site.turns()) {
        all.extend(sold().into_iter().filter_map(|waves| ripple(joint, waves, false).into_iter().next()));
    }
}
