//! What is looked for: every kind at every place, and shapes that have no name.

use super::posture::Mechanism;
use super::shape::{Course, FORGETTING_S, MAP_ORDERS, MEMORIES, Shape};
use crate::effects::{Kind, Level, Location};
use crate::units::ARCSEC;

/// Periods per turn (2 N) of the ratios N in which strain-wave gears are sold: 30, 50, 80, 100, 120, 160.
pub const WAVES_PER_TURN: [u16; 6] = [60, 100, 160, 200, 240, 320];
/// Periods per turn of which a ripple is looked for.
pub const RIPPLES: std::ops::RangeInclusive<u16> = 5..=400;
/// Of the prior of strain-wave errors, the share of ratios that are not sold off the shelf.
const OTHER_RATIOS: f64 = 0.3;
/// Of the prior of bending, the share of a link that is a slender beam; others yield where they are bolted to their joint.
const BEAM: f64 = 0.2;
/// Shares of the load that friction may hold where only a lean seats the play: far more than where the load itself does.
const LEANING_HELD: [f64; 5] = [0.0, 0.08, 0.16, 0.24, 0.32];
/// Azimuths in which gravity may lean.
const LEANS: usize = 24;

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
    /// Of the prior of its kind at its place, the share that is its own; `None`: those that say nothing share alike what is left. A
    /// ripple found by a scan has that of one of all that were scanned.
    pub share: Option<f64>,
}

/// What the data have.
#[derive(Clone, Debug, PartialEq)]
pub struct Columns {
    /// Directions of the last moves.
    pub approach: bool,
    /// Temperatures.
    pub temperature: bool,
    /// Orientations.
    pub orientation: bool,
    /// Rows are in the order of time.
    pub time: bool,
    /// Rows in time.
    pub rows: usize,
    /// Smallest and largest coordinate of each joint.
    pub travel: Vec<[f64; 2]>,
    /// Joints whose torque is not known to differ from zero in any reading.
    pub upright: Vec<bool>,
    /// Candidates for a change point, as places in time.
    pub changes: Vec<usize>,
}

fn simple(kind: Kind, index: Option<usize>, shape: Shape, range: [f64; 2]) -> Hypothesis {
    let location = Location { level: kind.level(), index: index.map(|index| index + 1) };
    Hypothesis { kind: Some(kind), location, shape, range, spread: vec![1.0], detail: String::new(), share: None }
}

/// A ripple of a joint that turns: `waves` periods per turn. Even counts are twice the ratio of a strain-wave gear; others, and all where
/// strain-wave errors are not to be named, have no name.
#[must_use]
pub fn ripple(joint: usize, waves: u16, nameless: bool) -> Hypothesis {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let shape = Shape::Harmonic(joint, f64::from(waves));
    let wave = simple(Kind::StrainWaveError, Some(joint), shape, [8.0 * ARCSEC, 40.0 * ARCSEC]);
    let spread = vec![half; 2];
    let (least, most) = (WAVES_PER_TURN[0], WAVES_PER_TURN[WAVES_PER_TURN.len() - 1]);
    if nameless || waves % 2 == 1 || !(least..=most).contains(&waves) {
        let detail = format!("{waves} periods per turn of joint {}", joint + 1);
        return Hypothesis { kind: None, spread, detail, share: Some(1.0 / RIPPLES.len() as f64), ..wave };
    }
    let sold = WAVES_PER_TURN.contains(&waves);
    let share =
        if sold { (1.0 - OTHER_RATIOS) / WAVES_PER_TURN.len() as f64 } else { OTHER_RATIOS / f64::from((most - least) / 2) };
    Hypothesis { spread, detail: format!("{waves} periods per turn"), share: Some(share), ..wave }
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
        let bends = simple(Kind::LinkBending, at, Shape::MomentAcross(joint), [0.5e-5 * load, 5e-5 * load]);
        all.push(Hypothesis { share: Some(1.0 - BEAM), ..bends.clone() });
        all.push(Hypothesis { shape: Shape::Beam(joint), share: Some(BEAM), detail: "as a beam".to_owned(), ..bends });
        let width = [20.0 * ARCSEC, 120.0 * ARCSEC];
        if columns.approach {
            all.push(simple(Kind::Backlash, at, Shape::Direction(joint), width));
        }
        all.push(simple(Kind::GravityLostMotion, at, Shape::TorqueSign(joint), width));
        if turns && columns.upright[joint] {
            for (step, held) in (0..LEANS).flat_map(|step| LEANING_HELD.map(|held| (step, held))) {
                let azimuth = step as f64 * std::f64::consts::TAU / LEANS as f64;
                let leaning = simple(Kind::GravityLostMotion, at, Shape::LeaningTorqueSign { joint, azimuth, held }, width);
                let detail = format!("seated as if the axis leant towards {:.0}°", azimuth.to_degrees());
                all.push(Hypothesis { detail, ..leaning });
            }
        }
        if turns {
            for order in [1.0, 2.0] {
                let shape = Shape::Harmonic(joint, order);
                let detail = format!("{order} period{} per turn", if order > 1.0 { "s" } else { "" });
                let eccentricity = simple(Kind::JointEccentricity, at, shape, [10.0 * ARCSEC, 100.0 * ARCSEC]);
                all.push(Hypothesis { spread: vec![half; 2], detail, ..eccentricity });
            }
            let both = simple(Kind::JointEccentricity, at, Shape::TwoHarmonics(joint), [10.0 * ARCSEC, 100.0 * ARCSEC]);
            let detail = "1 and 2 periods per turn; the magnitude is that of the first".to_owned();
            all.push(Hypothesis { spread: vec![half; 4], detail, ..both });
            all.extend(WAVES_PER_TURN.map(|waves| ripple(joint, waves, false)));
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
        for (grows, detail) in [(true, "the foot as warm as the first link"), (false, "the foot does not grow")] {
            let growth = simple(Kind::LinkThermalGrowth, None, Shape::GrowthOnFoot { grows }, [12e-6, 24e-6]);
            all.push(Hypothesis { detail: detail.to_owned(), ..growth });
        }
    }
    // A translation of so many metres comes with a rotation of up to as many radians.
    let third = 1.0 / libm::sqrt(3.0);
    let twist: Vec<f64> = [third; 3].into_iter().chain([0.6 * third; 3]).collect();
    if columns.time {
        all.push(Hypothesis { spread: twist.clone(), ..simple(Kind::BaseDrift, None, Shape::BaseDrift, [15e-6, 80e-6]) });
    }
    let tool = if columns.orientation { twist.clone() } else { vec![third; 3] };
    if columns.time {
        courses(&twist, &tool, &mut all);
    }
    for row in &columns.changes {
        all.push(Hypothesis { spread: twist.clone(), ..simple(Kind::BaseStep, None, Shape::BaseStep(*row), [15e-6, 80e-6]) });
        all.push(Hypothesis { spread: tool.clone(), ..simple(Kind::ToolStep, None, Shape::ToolStep(*row), [0.05e-3, 0.5e-3]) });
    }
    all.push(Hypothesis {
        kind: None,
        location: Location { level: Level::Tool, index: None },
        shape: Shape::AllYield,
        range: [2e-5, 1.5e-4],
        spread: vec![1.0; 2],
        detail: "all joints yield alike, or carry what is not recorded".to_owned(),
        share: None,
    });
    all.push(simple(Kind::MeasurementScale, None, Shape::Scale, [10e-6, 100e-6]));
    all
}

/// The base or the tool goes neither steadily nor at once.
fn courses(base: &[f64], tool: &[f64], all: &mut Vec<Hypothesis>) {
    let ramps = [0.15, 0.38, 0.62, 0.85].map(|centre| Course::Ramp { centre, width: 0.3 });
    let gradual = Course::Ramp { centre: 0.5, width: 0.8 };
    let mut push = |shape: Shape, range: [f64; 2], spread: &[f64], detail: String| {
        let level = if matches!(shape, Shape::BaseCourse(_)) { Level::Base } else { Level::Tool };
        let location = Location { level, index: None };
        all.push(Hypothesis { kind: None, location, shape, range, spread: spread.to_vec(), detail, share: None });
    };
    for course in ramps.into_iter().chain([gradual, Course::Return, Course::Steady]) {
        let how = match course {
            Course::Ramp { centre, width } => {
                format!(
                    "moves between {:.0} and {:.0} % of the session",
                    100.0 * (centre - width / 2.0),
                    100.0 * (centre + width / 2.0)
                )
            }
            Course::Return => "moves away and comes back".to_owned(),
            Course::Steady => "moves steadily".to_owned(),
        };
        if course != Course::Steady {
            push(Shape::BaseCourse(course), [15e-6, 80e-6], base, format!("the base or the sensor {how}"));
        }
        push(Shape::ToolCourse(course), [0.05e-3, 0.5e-3], tool, format!("the tool {how}"));
    }
}

/// Shapes that no kind has: where one wins, the cause is unknown.
fn nameless(joint: usize, turns: bool, columns: &Columns, all: &mut Vec<Hypothesis>) {
    let location = Location { level: Level::Joint, index: Some(joint + 1) };
    let mut push = |shape: Shape, range: [f64; 2], spread: Vec<f64>, detail: String| {
        all.push(Hypothesis { kind: None, location, shape, range, spread, detail, share: None });
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
    let detail = |how: &str| format!("moment across the axis of joint {} turns its link, {how}", joint + 1);
    push(Shape::UnequalBend(joint), [0.5e-5, 5e-5], vec![1.0; 2], detail("about one axis more than about another"));
    push(
        Shape::UnequalSeat(joint),
        [20e-6, 200e-6],
        vec![1.0; 2],
        detail("whatever its size, about one axis more than about another"),
    );
    let unequally = format!("force across the axis of joint {} shifts it, more one way than another", joint + 1);
    push(Shape::UnequalShift(joint), [10e-6, 60e-6], vec![1.0; 2], unequally);
    push(Shape::RootAcross(joint), [1e-5, 1e-4], vec![1.0], detail("not in proportion"));
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
