//! What is looked for: every kind at every place, and shapes that have no name.

use super::posture::Mechanism;
use super::shape::{FORGETTING_S, MAP_ORDERS, MEMORIES, Shape};
use crate::effects::{Kind, Location};

/// One second of arc, rad.
const ARCSEC: f64 = std::f64::consts::PI / 648_000.0;
/// Teeth counts (2 N) behind strain-wave errors that are common.
pub const WAVES_PER_TURN: [f64; 3] = [160.0, 200.0, 240.0];

/// Shares of the load that the friction of a fit may hold in the middle of its play.
pub const HELD: [f64; 4] = [0.0, 0.02, 0.05, 0.1];

/// Something that may be there.
#[derive(Clone, Debug, PartialEq)]
pub struct Hypothesis {
    /// What it is; `None` for a shape without a name.
    pub kind: Option<Kind>,
    /// Where.
    pub location: Location,
    /// What it does.
    pub shape: Shape,
    /// Realistic magnitudes, SI, least and most.
    pub range: [f64; 2],
    /// Of each column, its standard deviation in units of the magnitude.
    pub spread: Vec<f64>,
    /// In words: harmonic order, source joint, shape without a name; empty where the kind says all.
    pub detail: String,
}

/// What the data have.
#[derive(Clone, Debug, PartialEq)]
pub struct Columns {
    /// Directions of the last moves.
    pub approach: bool,
    /// Temperatures.
    pub temperature: bool,
    /// Attitudes.
    pub attitude: bool,
    /// Rows are in the order of time.
    pub time: bool,
    /// Rows in time.
    pub rows: usize,
    /// Smallest and largest coordinate of each joint.
    pub travel: Vec<[f64; 2]>,
    /// Candidates for a change point, as places in time.
    pub changes: Vec<usize>,
}

fn simple(kind: Kind, index: Option<usize>, shape: Shape, range: [f64; 2]) -> Hypothesis {
    let location = Location { level: kind.level(), index: index.map(|index| index + 1) };
    Hypothesis { kind: Some(kind), location, shape, range, spread: vec![1.0], detail: String::new() }
}

/// Everything that may be there in an arm like `mechanism`, seen through `columns`.
#[must_use]
pub fn library(mechanism: &Mechanism, columns: &Columns) -> Vec<Hypothesis> {
    let count = mechanism.joint_count();
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let mut all = Vec::new();
    for joint in 0..count {
        let turns = !mechanism.slides[joint];
        let at = Some(joint);
        // Without masses each link weighs 1 kg: a tenth of what it does.
        let load = if mechanism.masses_known { 1.0 } else { 10.0 };
        let soft = if 2 * joint < count { [1.0 / 6e4, 1.0 / 1e4] } else { [1.0 / 1.5e4, 1.0 / 2e3] };
        let soft = soft.map(|compliance| compliance * load);
        all.push(simple(Kind::JointCompliance, at, Shape::Torque(joint), soft));
        all.push(simple(Kind::LinkBending, at, Shape::MomentAcross(joint), [0.5e-5 * load, 5e-5 * load]));
        let width = [20.0 * ARCSEC, 120.0 * ARCSEC];
        if columns.approach {
            all.push(simple(Kind::Backlash, at, Shape::Direction(joint), width));
        }
        all.push(simple(Kind::GravityLostMotion, at, Shape::TorqueSign(joint), width));
        if turns {
            for order in [1.0, 2.0] {
                let shape = Shape::Harmonic(joint, order);
                let detail = format!("{order} period{} per turn", if order > 1.0 { "s" } else { "" });
                let eccentricity = simple(Kind::JointEccentricity, at, shape, [10.0 * ARCSEC, 100.0 * ARCSEC]);
                all.push(Hypothesis { spread: vec![half; 2], detail, ..eccentricity });
            }
            for waves in WAVES_PER_TURN {
                let wave = simple(Kind::StrainWaveError, at, Shape::Harmonic(joint, waves), [8.0 * ARCSEC, 40.0 * ARCSEC]);
                all.push(Hypothesis { spread: vec![half; 2], detail: format!("{waves} periods per turn"), ..wave });
            }
        }
        // Motion leaks from the joint before, whose drive shares the housing; the first has none before it.
        let before = if joint == 0 { 1.min(count - 1) } else { joint - 1 };
        for source in if before == joint { vec![joint] } else { vec![joint, before] } {
            let detail = if source == joint { "its own angle".to_owned() } else { format!("angle of joint {}", source + 1) };
            let coupling = simple(Kind::GearCoupling, at, Shape::Ratio { joint, source }, [5e-5, 40e-5]);
            all.push(Hypothesis { detail, ..coupling });
        }
        if columns.temperature {
            all.push(simple(Kind::LinkThermalGrowth, at, Shape::Growth(at), [12e-6, 24e-6]));
            all.push(simple(Kind::JointThermalDrift, at, Shape::Warmth(joint), [3e-6, 30e-6]));
        }
        for held in HELD {
            let detail = if held > 0.0 { format!("friction holds loads below {:.0} %", 100.0 * held) } else { String::new() };
            let radial = simple(Kind::RadialClearance, at, Shape::ForceAcrossSign { joint, held }, [10e-6, 60e-6]);
            all.push(Hypothesis { detail: detail.clone(), ..radial });
            let tilt = simple(Kind::TiltClearance, at, Shape::MomentAcrossSign { joint, held }, [20e-6, 200e-6]);
            all.push(Hypothesis { detail, ..tilt });
        }
        nameless(joint, turns, columns, &mut all);
    }
    if columns.temperature {
        all.push(simple(Kind::LinkThermalGrowth, None, Shape::Growth(None), [12e-6, 24e-6]));
    }
    // A translation of so many metres comes with a rotation of up to as many radians.
    let third = 1.0 / libm::sqrt(3.0);
    let twist: Vec<f64> = [third; 3].into_iter().chain([0.6 * third; 3]).collect();
    if columns.time {
        all.push(Hypothesis { spread: twist.clone(), ..simple(Kind::BaseDrift, None, Shape::BaseDrift, [15e-6, 80e-6]) });
    }
    let tool = if columns.attitude { twist.clone() } else { vec![third; 3] };
    for row in &columns.changes {
        all.push(Hypothesis { spread: twist.clone(), ..simple(Kind::BaseStep, None, Shape::BaseStep(*row), [15e-6, 80e-6]) });
        all.push(Hypothesis { spread: tool.clone(), ..simple(Kind::ToolStep, None, Shape::ToolStep(*row), [0.05e-3, 0.5e-3]) });
    }
    all.push(Hypothesis {
        kind: None,
        location: Location { level: crate::effects::Level::Tool, index: None },
        shape: Shape::AllYield,
        range: [2e-5, 1.5e-4],
        spread: vec![1.0; 2],
        detail: "all joints yield, as under a payload that is not the recorded one".to_owned(),
    });
    all.push(simple(Kind::MeasurementScale, None, Shape::Scale, [10e-6, 100e-6]));
    all
}

/// Shapes that no kind has: where one wins, the cause is unknown.
fn nameless(joint: usize, turns: bool, columns: &Columns, all: &mut Vec<Hypothesis>) {
    let location = Location { level: crate::effects::Level::Joint, index: Some(joint + 1) };
    let mut push = |shape: Shape, range: [f64; 2], spread: Vec<f64>, detail: String| {
        all.push(Hypothesis { kind: None, location, shape, range, spread, detail });
    };
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let angle = [20.0 * ARCSEC, 160.0 * ARCSEC];
    if turns {
        for order in [3.0, 4.0] {
            let detail = format!("{order} periods per turn of joint {}", joint + 1);
            push(Shape::Harmonic(joint, order), [10.0 * ARCSEC, 100.0 * ARCSEC], vec![half; 2], detail);
        }
        let [low, high] = columns.travel[joint];
        for half_width in [0.3, 0.55] {
            let steps = libm::ceil((high - low) / half_width).clamp(1.0, 40.0);
            for step in 0..=(steps as usize) {
                let centre = low + (high - low) * step as f64 / steps;
                let detail = format!("angle of joint {} near {:.0}°", joint + 1, centre.to_degrees());
                push(Shape::Bump { joint, centre, half_width }, angle, vec![1.0], detail);
            }
        }
        push(
            Shape::AngleCurve(joint),
            [5e-5, 40e-5],
            vec![1.0, 0.5, 0.5],
            format!("error of joint {} grows with its angle", joint + 1),
        );
        // Smooth: the higher, the smaller.
        let spread = (1..=MAP_ORDERS).map(|order| 1.0 / order as f64).collect();
        push(Shape::AngleMap { joint, low, high }, angle, spread, format!("error of joint {} follows its angle", joint + 1));
        for moving in [false, true] {
            let detail = format!("moment across the axis of joint {} turns it", joint + 1);
            push(Shape::Crosstalk { joint, moving }, [0.3e-5, 3e-5], vec![half; 2], detail);
        }
    }
    let detail = format!("turn of joint {} not proportional to its torque", joint + 1);
    push(Shape::Softening(joint), [2e-5, 2e-4], vec![1.0, 0.5], detail.clone());
    push(Shape::Hardening(joint), [2e-5, 2e-4], vec![1.0; 2], detail);
    if columns.time {
        for (which, time) in FORGETTING_S.iter().enumerate() {
            let detail = format!("joint {} yields slowly, over about {time:.0} s", joint + 1);
            push(Shape::TorqueMemory(joint, which), [0.5e-5, 5e-5], vec![1.0], detail);
        }
        for way in MEMORIES {
            push(Shape::Memory(joint, way), angle, vec![0.5], format!("joint {} remembers its last moves", joint + 1));
        }
        push(Shape::TimeCurve(joint), [20e-6, 200e-6], vec![1.0; 2], format!("joint {} drifts with time", joint + 1));
    }
    if columns.approach {
        let detail = format!("direction of joint {}'s last move, growing with its torque", joint + 1);
        push(Shape::DirectionLoad(joint), [0.5e-5, 5e-5], vec![1.0], detail);
    }
}
