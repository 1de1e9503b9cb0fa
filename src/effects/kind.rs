//! The kinds of un-modelled effects, the one table that says everything about each, and the shapes that they follow. The signature of a
//! kind (its shapes and its hypotheses) is in the file of its name.

pub mod backlash;
pub mod base_drift;
pub mod base_step;
pub mod base_tilt;
pub mod creep;
pub mod direction_of_move;
pub mod gear_coupling;
pub mod gravity_lost_motion;
pub mod joint_angle_map;
pub mod joint_compliance;
pub mod joint_eccentricity;
pub mod joint_thermal_drift;
pub mod link_bending;
pub mod link_thermal_growth;
pub mod measurement_scale;
pub mod radial_clearance;
pub mod strain_wave_error;
pub mod tilt_clearance;
pub mod tool_step;
pub mod unsettled_reading;

use std::fmt;

use schemars::{JsonSchema, Schema};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::descriptor::{
    Advice, Descriptor, Known, Load, Measure, Misses, Need, Neighbour, Range, SceneKeys, ScenePlace, Source, Unit,
};
use super::location::Level;
use super::signature::library::{Hypothesis, Site};
use super::signature::shape::Named;
use super::signature::unnamed::Nameless;
use crate::units::ARCSEC;

/// A kind of un-modelled effect; those that the diagnosis has a name for come first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// A joint turns under the torque about its axis.
    JointCompliance,
    /// A link bends under the moment across its joint's axis; the sum along the link.
    LinkBending,
    /// Play in a gear whose output is held by friction: the output lags by half the width. Full width.
    Backlash,
    /// The same play, seated by gravity. Full width.
    GravityLostMotion,
    /// First or second harmonic of the joint angle in the angle read.
    JointEccentricity,
    /// Ripple of a gear: once, twice or four times per turn of its motor; of a strain-wave gear mostly twice.
    StrainWaveError,
    /// Gear ratio error, and motion that leaks from a neighbouring joint or, as in wrists, from the one before it.
    GearCoupling,
    /// Links that grow with temperature.
    LinkThermalGrowth,
    /// Joint zeros that drift with temperature.
    JointThermalDrift,
    /// Radial play of a bearing, seated by the load. Radius.
    RadialClearance,
    /// Tilting play of a bearing, seated by the moment. Radius.
    TiltClearance,
    /// The base or the sensor moves steadily.
    BaseDrift,
    /// The base or the sensor has moved at one moment.
    BaseStep,
    /// The base leans under the moment of arm and payload about it.
    BaseTilt,
    /// The tool or its reflector has been seated anew at one moment.
    ToolStep,
    /// The sensor's lengths are wrong by a factor.
    MeasurementScale,
    /// A fixed error of the joint angle that follows it in no simple way: encoder or transmission. Root mean square over the readings.
    JointAngleMap,
    /// A joint goes on moving after each move: behind by a share of the way that fades with time.
    Creep,
    /// A joint lags behind its last move by an angle that grows with its torque; from side to side.
    DirectionOfMove,
    /// All joints were read before the arm had settled: behind by one share of the last move.
    UnsettledReading,
    /// Some readings are far off.
    MeasurementOutliers,
    /// Not known to the diagnosis: a sector of worn teeth, in which the output falls behind.
    WornToothSector,
    /// Not known to the diagnosis: a joint that yields slowly after a move.
    CreepAfterMotion,
    /// Not known to the diagnosis: a moment across the axis that turns the joint.
    MomentCrosstalk,
    /// Not known to the diagnosis: a joint that remembers its last moves.
    MemoryHysteresis,
    /// Not known to the diagnosis: a payload that weighs more than the cell believes.
    WrongPayload,
    /// Not known to the diagnosis: a joint that stiffens under load.
    HardeningStiffness,
}

/// What an effect follows. Joints and links count from 0 here, and from 1 where it is written; link `i` moves with joint `i`. One column
/// per number in brackets.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "shape", rename_all = "snake_case", expecting = "a shape, with joints and links that count from 1")]
#[schemars(transform = one_list)]
#[expect(missing_docs, reason = "each is described in its file")]
pub enum Shape {
    Torque(joint_compliance::Torque),
    FreeLoad(joint_compliance::FreeLoad),
    MomentAcross(link_bending::MomentAcross),
    Beam(link_bending::Beam),
    Direction(backlash::Direction),
    TorqueSign(gravity_lost_motion::TorqueSign),
    LeaningTorqueSign(gravity_lost_motion::LeaningTorqueSign),
    Harmonic(joint_eccentricity::Harmonic),
    TwoHarmonics(joint_eccentricity::TwoHarmonics),
    Ratio(gear_coupling::Ratio),
    Growth(link_thermal_growth::Growth),
    GrowthOnFoot(link_thermal_growth::GrowthOnFoot),
    Warmth(joint_thermal_drift::Warmth),
    ForceAcrossSign(radial_clearance::ForceAcrossSign),
    MomentAcrossSign(tilt_clearance::MomentAcrossSign),
    BaseDrift(base_drift::BaseDrift),
    BaseStep(base_step::BaseStep),
    BaseTilt(base_tilt::BaseTilt),
    ToolStep(tool_step::ToolStep),
    Scale(measurement_scale::Scale),
    AngleTable(joint_angle_map::AngleTable),
    Gear(strain_wave_error::Gear),
    Behind(creep::Behind),
    DirectionLoad(direction_of_move::DirectionLoad),
    Unsettled(unsettled_reading::Unsettled),
    /// One that no kind has.
    #[serde(untagged)]
    Nameless(Nameless),
}

/// Who answers for a shape.
pub(super) enum Answers<'a> {
    /// It has a name, or may have.
    Named(&'a dyn Named),
    /// It never has.
    Nameless(&'a Nameless),
}

impl Shape {
    /// Whoever answers for it.
    pub(super) fn answers(&self) -> Answers<'_> {
        Answers::Named(match self {
            Shape::Torque(of) => of,
            Shape::FreeLoad(of) => of,
            Shape::MomentAcross(of) => of,
            Shape::Beam(of) => of,
            Shape::Direction(of) => of,
            Shape::TorqueSign(of) => of,
            Shape::LeaningTorqueSign(of) => of,
            Shape::Harmonic(of) => of,
            Shape::TwoHarmonics(of) => of,
            Shape::Ratio(of) => of,
            Shape::Growth(of) => of,
            Shape::GrowthOnFoot(of) => of,
            Shape::Warmth(of) => of,
            Shape::ForceAcrossSign(of) => of,
            Shape::MomentAcrossSign(of) => of,
            Shape::BaseDrift(of) => of,
            Shape::BaseStep(of) => of,
            Shape::BaseTilt(of) => of,
            Shape::ToolStep(of) => of,
            Shape::Scale(of) => of,
            Shape::AngleTable(of) => of,
            Shape::Gear(of) => of,
            Shape::Behind(of) => of,
            Shape::DirectionLoad(of) => of,
            Shape::Unsettled(of) => of,
            Shape::Nameless(of) => return Answers::Nameless(of),
        })
    }
}

/// In the schema all shapes are alternatives in one list, as they are written; those of no kind, which are last, are a list of their own
/// until here.
fn one_list(schema: &mut Schema) {
    let Some(mut shapes) = ["oneOf", "anyOf"].into_iter().find_map(|key| schema.remove(key)) else { return };
    let nameless = shapes.as_array_mut().and_then(Vec::pop).and_then(|mut nameless| nameless.get_mut("oneOf").map(Value::take));
    if let (Some(shapes), Some(Value::Array(nameless))) = (shapes.as_array_mut(), nameless) {
        shapes.extend(nameless);
    }
    schema.insert("oneOf".to_owned(), shapes);
}

/// Angle per torque of joints, rad/(N·m).
const SOFTNESS: Range = Range::ByHalf { proximal: [1.0 / 6e4, 1.0 / 1e4], distal: [1.0 / 1.5e4, 1.0 / 2e3] };
/// Play of gears, full width, rad.
const PLAY: Range = Range::Everywhere([20.0 * ARCSEC, 120.0 * ARCSEC]);
/// Ways that a base or a sensor moves, m.
const MOVES: Range = Range::Everywhere([15e-6, 80e-6]);

const STRAIN_WAVE_CATALOGUE: &str = "Harmonic Drive LLC, catalogue CSF/CSG, table 40 (positional accuracy): 1.5 to 5.8·10⁻⁴ rad from \
     peak to peak over a turn, so that an amplitude is at most half of that; of the lower end: assumed";
const EXPANSION_TABLE: &str = "Engineering ToolBox, volume expansion of solids: carbon steel 32.4, aluminium 69·10⁻⁶/K, a third of it \
     along a line";
const BEARING_STANDARD: &str = "ISO 5753:1991, deep groove ball bearings of 30 to 80 mm bore, groups N to C5: 6 to 105 µm from side to \
     side, so that a radius is at most half of that; what exceeds it is wear, assumed";
const UR_MAPS: &str = "laser tracker series of a UR5 and a UR10 (P. Jacobi 2025; series B and D), measured by us: 0.3 mrad, with \
     peaks of 0.6 to 0.9 mrad; of the ends: assumed";
/// What tells a linear effect of load from one that saturates.
const PAYLOADS: &str = "several payloads: one is linear in the load, the other saturates";
/// What tells a joint that yields from a link that does.
const SIDEWAYS: &str = "a load from the side, a tilted base, or a target on a link in between";
const BOTH_SIDES: &str = "approach from both sides: friction lets the side of approach decide, gravity does not";
const HEAT_AND_COOL: &str = "heating and cooling in one session, so that temperatures return while time goes on";
const OTHER_PACES: &str = "links that warm at different paces";
const OTHER_DISTANCES: &str = "targets at several distances from the joint";
const OTHER_ORIENTATIONS: &str = "the same few configurations again with another orientation of the tool";
const ON_THE_FOOT: &str = "a target on the base, or on the first link near it";
const WHOLE_TRAVEL: &str = "the whole travel of the joint";
const LONG_AND_SHORT: &str = "long and short moves to the reading: play does not grow with them";
const ONE_BY_ONE: &str = "moves of one joint at a time";
const DENSE_ANGLES: &str = "readings at many angles of the joint, a degree or less apart";
const SPREAD_OVER_TIME: &str = "readings spread evenly over the session";
const ENCODERS_FEEL_NO_LOAD: &str = "several payloads: an encoder does not feel them";

/// On hobby and cable-driven arms joints yield by a degree under their load, encoders and gears are ten times worse (assumed),
const TENFOLD: f64 = 10.0;
/// and gears have one to two degrees of play (assumed).
const PLAY_OF_DEGREES: f64 = 60.0;
/// What nothing is known to be larger of.
const AS_ELSEWHERE: f64 = 1.0;

/// No limit is known that a diagnosis would ever meet.
const UNLIMITED: f64 = f64::INFINITY;
/// Plastics grow five times as much as aluminium with temperature (Engineering ToolBox, linear expansion: ABS 72 to 108, nylon 80,
/// polyethylene up to 200·10⁻⁶/K), and nothing that arms are made of grows more.
const OF_PLASTIC: f64 = 5.0;
/// A base, sensor or tool that was knocked has moved by some millimetres (1 to 4 mm on real arms).
const KNOCKED: f64 = 50.0;

/// A signature of first order.
const FIRST_ORDER: Misses = Misses { fitted: 0.005, as_said: 2e-3 };
/// Straight between values some degrees apart.
const STRAIGHT_BETWEEN: Misses = Misses { fitted: 0.25, as_said: 0.25 };
/// It fades over one of a few times, and nobody knows from where the arm came to the first reading.
const FADING: Misses = Misses { fitted: 0.1, as_said: 0.05 };
/// A deflected arm bends its own torques.
const DEFLECTED: Misses = Misses { fitted: 0.01, as_said: 0.02 };
/// Where the load that seats is as small as it is unknown, or near to what friction holds, the formula knows the side less well.
const SEATED: Misses = Misses { fitted: 0.15, as_said: 0.15 };
/// The same of a bearing.
const SEATED_BEARING: Misses = Misses { fitted: 0.15, as_said: 0.2 };
/// The sensors of temperature are off by some hundredths of a degree.
const WARMED: Misses = Misses { fitted: 0.05, as_said: 2e-3 };
/// Besides, a link grows to the target in the formula, to the tool's origin in the physics.
const GROWN: Misses = Misses { fitted: 0.05, as_said: 0.02 };

impl Kind {
    /// Every kind, those that the diagnosis knows first.
    pub const ALL: [Kind; 27] = [
        Kind::JointCompliance,
        Kind::LinkBending,
        Kind::Backlash,
        Kind::GravityLostMotion,
        Kind::JointEccentricity,
        Kind::StrainWaveError,
        Kind::GearCoupling,
        Kind::LinkThermalGrowth,
        Kind::JointThermalDrift,
        Kind::RadialClearance,
        Kind::TiltClearance,
        Kind::BaseDrift,
        Kind::BaseStep,
        Kind::BaseTilt,
        Kind::ToolStep,
        Kind::MeasurementScale,
        Kind::JointAngleMap,
        Kind::Creep,
        Kind::DirectionOfMove,
        Kind::UnsettledReading,
        Kind::MeasurementOutliers,
        Kind::WornToothSector,
        Kind::CreepAfterMotion,
        Kind::MomentCrosstalk,
        Kind::MemoryHysteresis,
        Kind::WrongPayload,
        Kind::HardeningStiffness,
    ];

    /// What the table says of it.
    #[must_use]
    pub const fn descriptor(self) -> &'static Descriptor {
        match self {
            Kind::JointCompliance => &Descriptor {
                name: "joint_compliance",
                about: "a spring between servo and joint",
                level: Level::Joint,
                unit: Unit::RadianPerNewtonMetre,
                magnitude: "angle per torque",
                range: SOFTNESS,
                source: Source::Assumed,
                softest: TENFOLD,
                most: UNLIMITED,
                one_signed: true,
                sign_apart: false,
                load: Load::Drives,
                needs: &[Need::Masses],
                case_of: None,
                known: Some(Known {
                    hypotheses: joint_compliance::hypotheses,
                    misses: DEFLECTED,
                    doubles: None,
                    advice: &[Advice::Beside(Kind::LinkBending, Measure::Sideways), Advice::Alone(Measure::Payloads)],
                }),
                may_repeat: false,
                neighbours: &[
                    Neighbour { kind: Kind::LinkBending, told_apart_by: SIDEWAYS },
                    Neighbour { kind: Kind::GravityLostMotion, told_apart_by: PAYLOADS },
                    Neighbour { kind: Kind::JointEccentricity, told_apart_by: ENCODERS_FEEL_NO_LOAD },
                ],
                scene: SceneKeys { place: ScenePlace::TurningJoint, required: &["stiffness_nm_per_rad"], optional: &[] },
            },
            Kind::LinkBending => &Descriptor {
                name: "link_bending",
                about: "an elastic hinge across the joint's axis",
                level: Level::Link,
                unit: Unit::RadianPerNewtonMetre,
                magnitude: "angle per moment, summed along the link",
                range: Range::Everywhere([0.5e-5, 5e-5]),
                source: Source::Assumed,
                softest: TENFOLD,
                most: UNLIMITED,
                one_signed: true,
                sign_apart: false,
                load: Load::Drives,
                needs: &[Need::Masses],
                case_of: None,
                known: Some(Known {
                    hypotheses: link_bending::hypotheses,
                    misses: DEFLECTED,
                    doubles: None,
                    advice: &[Advice::Beside(Kind::TiltClearance, Measure::Payloads)],
                }),
                may_repeat: false,
                neighbours: &[
                    Neighbour { kind: Kind::JointCompliance, told_apart_by: SIDEWAYS },
                    Neighbour { kind: Kind::TiltClearance, told_apart_by: PAYLOADS },
                ],
                scene: SceneKeys { place: ScenePlace::Link, required: &["compliance_urad_per_nm"], optional: &["beam"] },
            },
            Kind::Backlash => &Descriptor {
                name: "backlash",
                about: "play in a gear whose output friction holds: it lags",
                level: Level::Joint,
                unit: Unit::Radian,
                magnitude: "full width",
                range: PLAY,
                source: Source::Assumed,
                softest: PLAY_OF_DEGREES,
                most: UNLIMITED,
                one_signed: false,
                sign_apart: true,
                load: Load::None,
                needs: &[Need::ApproachSides],
                case_of: None,
                known: Some(Known { hypotheses: backlash::hypotheses, misses: FIRST_ORDER, doubles: None, advice: &[] }),
                may_repeat: false,
                neighbours: &[
                    Neighbour { kind: Kind::GravityLostMotion, told_apart_by: BOTH_SIDES },
                    Neighbour { kind: Kind::Creep, told_apart_by: LONG_AND_SHORT },
                    Neighbour { kind: Kind::DirectionOfMove, told_apart_by: PAYLOADS },
                ],
                scene: SceneKeys { place: ScenePlace::TurningJoint, required: &["width_arcsec"], optional: &[] },
            },
            Kind::GravityLostMotion => &Descriptor {
                name: "gravity_lost_motion",
                about: "the same play, seated by gravity",
                level: Level::Joint,
                unit: Unit::Radian,
                magnitude: "full width",
                range: PLAY,
                source: Source::Assumed,
                softest: PLAY_OF_DEGREES,
                most: UNLIMITED,
                one_signed: true,
                sign_apart: false,
                load: Load::Seats,
                needs: &[Need::Masses],
                case_of: None,
                known: Some(Known {
                    hypotheses: gravity_lost_motion::hypotheses,
                    misses: SEATED,
                    doubles: None,
                    advice: &[Advice::Alone(Measure::Payloads)],
                }),
                may_repeat: false,
                neighbours: &[
                    Neighbour { kind: Kind::JointCompliance, told_apart_by: PAYLOADS },
                    Neighbour { kind: Kind::Backlash, told_apart_by: BOTH_SIDES },
                ],
                scene: SceneKeys { place: ScenePlace::TurningJoint, required: &["width_arcsec"], optional: &[] },
            },
            Kind::JointEccentricity => &Descriptor {
                name: "joint_eccentricity",
                about: "encoder off or tilted on its axis",
                level: Level::Joint,
                unit: Unit::Radian,
                magnitude: "amplitude of the angle error",
                range: Range::Everywhere([10.0 * ARCSEC, 100.0 * ARCSEC]),
                source: Source::Assumed,
                softest: TENFOLD,
                most: UNLIMITED,
                one_signed: false,
                sign_apart: false,
                load: Load::None,
                needs: &[],
                case_of: None,
                known: Some(Known {
                    hypotheses: joint_eccentricity::hypotheses,
                    misses: FIRST_ORDER,
                    doubles: None,
                    advice: &[Advice::Alone(Measure::WholeTravel)],
                }),
                may_repeat: false,
                neighbours: &[
                    Neighbour { kind: Kind::JointCompliance, told_apart_by: ENCODERS_FEEL_NO_LOAD },
                    Neighbour { kind: Kind::GearCoupling, told_apart_by: WHOLE_TRAVEL },
                ],
                scene: SceneKeys {
                    place: ScenePlace::TurningJoint,
                    required: &["amplitude_arcsec"],
                    optional: &["order", "phase_deg"],
                },
            },
            Kind::StrainWaveError => &Descriptor {
                name: "strain_wave_error",
                about: "ripple once, twice or four times per motor turn",
                level: Level::Joint,
                unit: Unit::Radian,
                magnitude: "amplitude of the angle error",
                range: Range::Everywhere([8.0 * ARCSEC, 40.0 * ARCSEC]),
                source: Source::Cited(STRAIN_WAVE_CATALOGUE),
                softest: TENFOLD,
                most: UNLIMITED,
                one_signed: false,
                sign_apart: false,
                load: Load::None,
                needs: &[],
                case_of: None,
                known: Some(Known { hypotheses: strain_wave_error::hypotheses, misses: FIRST_ORDER, doubles: None, advice: &[] }),
                may_repeat: true,
                neighbours: &[Neighbour {
                    kind: Kind::MeasurementOutliers,
                    told_apart_by: "configurations a few degrees apart in one joint, so that the ripple is sampled",
                }],
                scene: SceneKeys {
                    place: ScenePlace::TurningJoint,
                    required: &["amplitude_arcsec", "ratio"],
                    optional: &["phase_deg"],
                },
            },
            Kind::GearCoupling => &Descriptor {
                name: "gear_coupling",
                about: "ratio error, and motion that leaks from another joint",
                level: Level::Joint,
                unit: Unit::RadianPerRadian,
                magnitude: "angle per angle of the source",
                range: Range::Everywhere([5e-5, 40e-5]),
                source: Source::Assumed,
                softest: TENFOLD,
                most: UNLIMITED,
                one_signed: false,
                sign_apart: false,
                load: Load::None,
                needs: &[],
                case_of: None,
                known: Some(Known {
                    hypotheses: gear_coupling::hypotheses,
                    misses: FIRST_ORDER,
                    doubles: None,
                    advice: &[Advice::Alone(Measure::WholeTravel)],
                }),
                may_repeat: true,
                neighbours: &[Neighbour { kind: Kind::JointEccentricity, told_apart_by: WHOLE_TRAVEL }],
                scene: SceneKeys {
                    place: ScenePlace::TurningJoint,
                    required: &[],
                    optional: &["ratio_error_urad_per_rad", "coupling_urad_per_rad", "source"],
                },
            },
            Kind::LinkThermalGrowth => &Descriptor {
                name: "link_thermal_growth",
                about: "links grow with their temperature",
                level: Level::Link,
                unit: Unit::PerKelvin,
                magnitude: "growth per length and kelvin",
                range: Range::Everywhere([12e-6, 24e-6]),
                source: Source::Cited(EXPANSION_TABLE),
                softest: AS_ELSEWHERE,
                most: OF_PLASTIC,
                one_signed: true,
                sign_apart: false,
                load: Load::None,
                needs: &[Need::Temperatures],
                case_of: None,
                known: Some(Known {
                    hypotheses: link_thermal_growth::hypotheses,
                    misses: GROWN,
                    doubles: None,
                    advice: &[Advice::Alone(Measure::HeatAndCool)],
                }),
                may_repeat: false,
                neighbours: &[
                    Neighbour { kind: Kind::JointThermalDrift, told_apart_by: OTHER_PACES },
                    Neighbour { kind: Kind::BaseDrift, told_apart_by: HEAT_AND_COOL },
                ],
                scene: SceneKeys { place: ScenePlace::LinkOrArm, required: &["expansion_um_per_m_per_k"], optional: &[] },
            },
            Kind::JointThermalDrift => &Descriptor {
                name: "joint_thermal_drift",
                about: "joint zero drifts with its link's temperature",
                level: Level::Joint,
                unit: Unit::RadianPerKelvin,
                magnitude: "angle per kelvin",
                range: Range::Everywhere([3e-6, 30e-6]),
                source: Source::Assumed,
                softest: AS_ELSEWHERE,
                most: OF_PLASTIC,
                one_signed: false,
                sign_apart: false,
                load: Load::None,
                needs: &[Need::Temperatures],
                case_of: None,
                known: Some(Known {
                    hypotheses: joint_thermal_drift::hypotheses,
                    misses: WARMED,
                    doubles: None,
                    advice: &[Advice::Alone(Measure::HeatAndCool)],
                }),
                may_repeat: false,
                neighbours: &[
                    Neighbour { kind: Kind::LinkThermalGrowth, told_apart_by: OTHER_PACES },
                    Neighbour { kind: Kind::BaseDrift, told_apart_by: HEAT_AND_COOL },
                ],
                scene: SceneKeys { place: ScenePlace::TurningJoint, required: &["drift_urad_per_k"], optional: &[] },
            },
            Kind::RadialClearance => &Descriptor {
                name: "radial_clearance",
                about: "radial play of a bearing, seated by the load",
                level: Level::Joint,
                unit: Unit::Metre,
                magnitude: "radius",
                range: Range::Everywhere([10e-6, 60e-6]),
                source: Source::Cited(BEARING_STANDARD),
                softest: TENFOLD,
                most: UNLIMITED,
                one_signed: true,
                sign_apart: false,
                load: Load::Seats,
                needs: &[Need::Masses],
                case_of: None,
                known: Some(Known {
                    hypotheses: radial_clearance::hypotheses,
                    misses: SEATED_BEARING,
                    doubles: None,
                    advice: &[],
                }),
                may_repeat: false,
                neighbours: &[Neighbour { kind: Kind::TiltClearance, told_apart_by: OTHER_DISTANCES }],
                scene: SceneKeys { place: ScenePlace::Joint, required: &["radial_um"], optional: &[] },
            },
            Kind::TiltClearance => &Descriptor {
                name: "tilt_clearance",
                about: "tilting play of a bearing, seated by the moment",
                level: Level::Joint,
                unit: Unit::Radian,
                magnitude: "radius",
                range: Range::Everywhere([20e-6, 200e-6]),
                source: Source::Assumed,
                softest: TENFOLD,
                most: UNLIMITED,
                one_signed: true,
                sign_apart: false,
                load: Load::Seats,
                needs: &[Need::Masses],
                case_of: None,
                known: Some(Known { hypotheses: tilt_clearance::hypotheses, misses: SEATED_BEARING, doubles: None, advice: &[] }),
                may_repeat: false,
                neighbours: &[
                    Neighbour { kind: Kind::LinkBending, told_apart_by: PAYLOADS },
                    Neighbour { kind: Kind::RadialClearance, told_apart_by: OTHER_DISTANCES },
                ],
                scene: SceneKeys { place: ScenePlace::Joint, required: &["tilt_urad"], optional: &[] },
            },
            Kind::BaseDrift => &Descriptor {
                name: "base_drift",
                about: "base or sensor move over the session",
                level: Level::Base,
                unit: Unit::Metre,
                magnitude: "length of the translation over the whole session",
                range: MOVES,
                source: Source::Assumed,
                softest: AS_ELSEWHERE,
                most: KNOCKED,
                one_signed: false,
                sign_apart: false,
                load: Load::None,
                needs: &[Need::Times],
                case_of: None,
                known: Some(Known {
                    hypotheses: base_drift::hypotheses,
                    misses: FIRST_ORDER,
                    doubles: None,
                    advice: &[Advice::Alone(Measure::HeatAndCool)],
                }),
                may_repeat: false,
                neighbours: &[
                    Neighbour { kind: Kind::LinkThermalGrowth, told_apart_by: HEAT_AND_COOL },
                    Neighbour { kind: Kind::BaseStep, told_apart_by: SPREAD_OVER_TIME },
                ],
                scene: SceneKeys {
                    place: ScenePlace::Nowhere,
                    required: &["translation_um"],
                    optional: &["rotation_urad", "moves"],
                },
            },
            Kind::BaseStep => &Descriptor {
                name: "base_step",
                about: "base or sensor move at once",
                level: Level::Base,
                unit: Unit::Metre,
                magnitude: "length of the translation",
                range: MOVES,
                source: Source::Assumed,
                softest: AS_ELSEWHERE,
                most: KNOCKED,
                one_signed: false,
                sign_apart: false,
                load: Load::None,
                needs: &[Need::Times],
                case_of: None,
                known: Some(Known {
                    hypotheses: base_step::hypotheses,
                    misses: FIRST_ORDER,
                    doubles: None,
                    advice: &[Advice::Alone(Measure::OtherOrientations)],
                }),
                may_repeat: true,
                neighbours: &[
                    Neighbour { kind: Kind::ToolStep, told_apart_by: OTHER_ORIENTATIONS },
                    Neighbour { kind: Kind::BaseDrift, told_apart_by: SPREAD_OVER_TIME },
                ],
                scene: SceneKeys {
                    place: ScenePlace::Nowhere,
                    required: &["translation_um", "after"],
                    optional: &["rotation_urad", "moves"],
                },
            },
            Kind::BaseTilt => &Descriptor {
                name: "base_tilt",
                about: "the base leans under the moment of arm and payload",
                level: Level::Base,
                unit: Unit::RadianPerNewtonMetre,
                magnitude: "angle per moment about the base's origin",
                range: Range::Everywhere([2e-8, 2e-7]),
                source: Source::Assumed,
                softest: TENFOLD,
                most: UNLIMITED,
                one_signed: true,
                sign_apart: false,
                load: Load::Drives,
                needs: &[Need::Masses],
                case_of: None,
                known: Some(Known {
                    hypotheses: base_tilt::hypotheses,
                    misses: DEFLECTED,
                    doubles: Some(base_tilt::doubles),
                    advice: &[],
                }),
                may_repeat: false,
                neighbours: &[
                    Neighbour { kind: Kind::LinkBending, told_apart_by: ON_THE_FOOT },
                    Neighbour { kind: Kind::JointCompliance, told_apart_by: ON_THE_FOOT },
                ],
                scene: SceneKeys { place: ScenePlace::Nowhere, required: &["compliance_urad_per_nm"], optional: &[] },
            },
            Kind::ToolStep => &Descriptor {
                name: "tool_step",
                about: "tool or reflector seated anew",
                level: Level::Tool,
                unit: Unit::Metre,
                magnitude: "length of the translation",
                range: Range::Everywhere([0.05e-3, 0.5e-3]),
                source: Source::Assumed,
                softest: AS_ELSEWHERE,
                most: TENFOLD,
                one_signed: false,
                sign_apart: false,
                load: Load::None,
                needs: &[Need::Times, Need::Orientations],
                case_of: None,
                known: Some(Known {
                    hypotheses: tool_step::hypotheses,
                    misses: FIRST_ORDER,
                    doubles: None,
                    advice: &[Advice::Alone(Measure::OtherOrientations)],
                }),
                may_repeat: true,
                neighbours: &[Neighbour { kind: Kind::BaseStep, told_apart_by: OTHER_ORIENTATIONS }],
                scene: SceneKeys {
                    place: ScenePlace::Nowhere,
                    required: &["translation_um", "after"],
                    optional: &["rotation_urad"],
                },
            },
            Kind::MeasurementScale => &Descriptor {
                name: "measurement_scale",
                about: "the sensor's distances are wrong by a factor",
                level: Level::Sensor,
                unit: Unit::Ratio,
                magnitude: "relative error",
                range: Range::Everywhere([10e-6, 100e-6]),
                source: Source::Assumed,
                softest: AS_ELSEWHERE,
                most: UNLIMITED,
                one_signed: false,
                sign_apart: false,
                load: Load::None,
                needs: &[],
                case_of: None,
                known: Some(Known { hypotheses: measurement_scale::hypotheses, misses: FIRST_ORDER, doubles: None, advice: &[] }),
                may_repeat: false,
                neighbours: &[Neighbour {
                    kind: Kind::LinkThermalGrowth,
                    told_apart_by: "a scale bar: link lengths that are fitted absorb it wholly",
                }],
                scene: SceneKeys { place: ScenePlace::Nowhere, required: &["scale_ppm"], optional: &[] },
            },
            Kind::JointAngleMap => &Descriptor {
                name: "joint_angle_map",
                about: "an error of the joint angle that follows it irregularly",
                level: Level::Joint,
                unit: Unit::Radian,
                magnitude: "root mean square over the readings",
                range: Range::Everywhere([20.0 * ARCSEC, 160.0 * ARCSEC]),
                source: Source::Cited(UR_MAPS),
                softest: TENFOLD,
                most: UNLIMITED,
                one_signed: false,
                sign_apart: false,
                load: Load::None,
                needs: &[],
                case_of: None,
                known: Some(Known {
                    hypotheses: joint_angle_map::hypotheses,
                    misses: STRAIGHT_BETWEEN,
                    doubles: None,
                    advice: &[],
                }),
                may_repeat: false,
                neighbours: &[
                    Neighbour { kind: Kind::JointEccentricity, told_apart_by: WHOLE_TRAVEL },
                    Neighbour { kind: Kind::StrainWaveError, told_apart_by: DENSE_ANGLES },
                ],
                scene: SceneKeys { place: ScenePlace::TurningJoint, required: &["angles_deg", "errors_arcsec"], optional: &[] },
            },
            Kind::Creep => &Descriptor {
                name: "creep",
                about: "the joint goes on moving after each move",
                level: Level::Joint,
                unit: Unit::Ratio,
                magnitude: "share of the move left at the reading",
                range: Range::Everywhere([0.5e-4, 10e-4]),
                source: Source::Assumed,
                softest: TENFOLD,
                most: UNLIMITED,
                one_signed: false,
                sign_apart: false,
                load: Load::None,
                needs: &[Need::Moves],
                case_of: None,
                known: Some(Known { hypotheses: creep::hypotheses, misses: FADING, doubles: None, advice: &[] }),
                may_repeat: false,
                neighbours: &[
                    Neighbour { kind: Kind::Backlash, told_apart_by: LONG_AND_SHORT },
                    Neighbour { kind: Kind::UnsettledReading, told_apart_by: ONE_BY_ONE },
                ],
                scene: SceneKeys { place: ScenePlace::Joint, required: &["lag_ppm", "time_constant_s"], optional: &[] },
            },
            Kind::DirectionOfMove => &Descriptor {
                name: "direction_of_move",
                about: "friction that grows with the torque winds the joint up",
                level: Level::Joint,
                unit: Unit::RadianPerNewtonMetre,
                magnitude: "angle per torque, from side to side",
                range: Range::Everywhere([0.5e-5, 5e-5]),
                source: Source::Assumed,
                softest: TENFOLD,
                most: UNLIMITED,
                one_signed: false,
                sign_apart: true,
                load: Load::Drives,
                needs: &[Need::ApproachSides, Need::Masses],
                case_of: None,
                known: Some(Known { hypotheses: direction_of_move::hypotheses, misses: DEFLECTED, doubles: None, advice: &[] }),
                may_repeat: false,
                neighbours: &[Neighbour { kind: Kind::Backlash, told_apart_by: PAYLOADS }],
                scene: SceneKeys { place: ScenePlace::TurningJoint, required: &["gain_urad_per_nm"], optional: &[] },
            },
            Kind::UnsettledReading => &Descriptor {
                name: "unsettled_reading",
                about: "read before the arm has settled: all joints lag",
                level: Level::Sensor,
                unit: Unit::Ratio,
                magnitude: "share of the last move",
                range: Range::Everywhere([0.5e-4, 10e-4]),
                source: Source::Assumed,
                softest: TENFOLD,
                most: UNLIMITED,
                one_signed: false,
                sign_apart: false,
                load: Load::None,
                needs: &[Need::Moves],
                case_of: None,
                known: Some(Known { hypotheses: unsettled_reading::hypotheses, misses: FADING, doubles: None, advice: &[] }),
                may_repeat: false,
                neighbours: &[Neighbour { kind: Kind::Creep, told_apart_by: ONE_BY_ONE }],
                scene: SceneKeys { place: ScenePlace::Nowhere, required: &["lag_ppm"], optional: &[] },
            },
            Kind::MeasurementOutliers => &Descriptor {
                name: "measurement_outliers",
                about: "some readings have a larger noise",
                level: Level::Sensor,
                unit: Unit::Share,
                magnitude: "share of the readings",
                range: Range::Everywhere([0.03, 0.15]),
                source: Source::Assumed,
                softest: AS_ELSEWHERE,
                most: UNLIMITED,
                one_signed: false,
                sign_apart: false,
                load: Load::None,
                needs: &[],
                case_of: None,
                known: Some(Known { hypotheses: move_nothing, misses: FIRST_ORDER, doubles: None, advice: &[] }),
                may_repeat: false,
                neighbours: &[],
                scene: SceneKeys { place: ScenePlace::Nowhere, required: &["share", "factor"], optional: &[] },
            },
            Kind::WornToothSector => &Descriptor {
                name: "worn_tooth_sector",
                about: "the output falls behind in a sector",
                level: Level::Joint,
                unit: Unit::Radian,
                magnitude: "how far it falls behind in the middle",
                range: Range::Everywhere([40.0 * ARCSEC, 160.0 * ARCSEC]),
                source: Source::Assumed,
                softest: AS_ELSEWHERE,
                most: UNLIMITED,
                one_signed: false,
                sign_apart: false,
                load: Load::None,
                needs: &[],
                case_of: Some(Kind::JointAngleMap),
                known: None,
                may_repeat: false,
                neighbours: &[],
                scene: SceneKeys {
                    place: ScenePlace::TurningJoint,
                    required: &["depth_arcsec", "centre_deg", "half_width_deg"],
                    optional: &[],
                },
            },
            Kind::CreepAfterMotion => &Descriptor {
                name: "creep_after_motion",
                about: "the joint yields slowly after a move",
                level: Level::Joint,
                unit: Unit::RadianPerNewtonMetre,
                magnitude: "angle per torque that comes with time",
                range: Range::Everywhere([0.5e-5, 5e-5]),
                source: Source::Assumed,
                softest: AS_ELSEWHERE,
                most: UNLIMITED,
                one_signed: false,
                sign_apart: false,
                load: Load::Drives,
                needs: &[],
                case_of: None,
                known: None,
                may_repeat: false,
                neighbours: &[],
                scene: SceneKeys {
                    place: ScenePlace::TurningJoint,
                    required: &["compliance_urad_per_nm", "time_constant_s"],
                    optional: &[],
                },
            },
            Kind::MomentCrosstalk => &Descriptor {
                name: "moment_crosstalk",
                about: "a moment across the axis turns the joint",
                level: Level::Joint,
                unit: Unit::RadianPerNewtonMetre,
                magnitude: "angle per moment",
                range: Range::Everywhere([0.3e-5, 3e-5]),
                source: Source::Assumed,
                softest: AS_ELSEWHERE,
                most: UNLIMITED,
                one_signed: false,
                sign_apart: false,
                load: Load::Drives,
                needs: &[],
                case_of: None,
                known: None,
                may_repeat: false,
                neighbours: &[],
                scene: SceneKeys { place: ScenePlace::TurningJoint, required: &["gain_urad_per_nm"], optional: &[] },
            },
            Kind::MemoryHysteresis => &Descriptor {
                name: "memory_hysteresis",
                about: "the joint remembers its last moves",
                level: Level::Joint,
                unit: Unit::Radian,
                magnitude: "full width",
                range: PLAY,
                source: Source::Assumed,
                softest: AS_ELSEWHERE,
                most: UNLIMITED,
                one_signed: false,
                sign_apart: false,
                load: Load::None,
                needs: &[],
                case_of: None,
                known: None,
                may_repeat: false,
                neighbours: &[],
                scene: SceneKeys {
                    place: ScenePlace::TurningJoint,
                    required: &["amplitude_arcsec", "travel_deg"],
                    optional: &[],
                },
            },
            Kind::WrongPayload => &Descriptor {
                name: "wrong_payload",
                about: "the payload weighs more than is believed",
                level: Level::Tool,
                unit: Unit::Kilogram,
                magnitude: "true minus recorded mass",
                range: Range::Everywhere([0.5, 3.0]),
                source: Source::Assumed,
                softest: AS_ELSEWHERE,
                most: UNLIMITED,
                one_signed: false,
                sign_apart: false,
                load: Load::Drives,
                needs: &[],
                case_of: None,
                known: None,
                may_repeat: false,
                neighbours: &[],
                scene: SceneKeys { place: ScenePlace::Nowhere, required: &["excess_kg", "stiffness_nm_per_rad"], optional: &[] },
            },
            Kind::HardeningStiffness => &Descriptor {
                name: "hardening_stiffness",
                about: "a joint that stiffens under load",
                level: Level::Joint,
                unit: Unit::RadianPerNewtonMetre,
                magnitude: "angle per torque at no load",
                range: SOFTNESS,
                source: Source::Assumed,
                softest: TENFOLD,
                most: UNLIMITED,
                one_signed: false,
                sign_apart: false,
                load: Load::Drives,
                needs: &[],
                case_of: None,
                known: None,
                may_repeat: false,
                neighbours: &[],
                scene: SceneKeys {
                    place: ScenePlace::TurningJoint,
                    required: &["stiffness_nm_per_rad", "cubic_nm_per_mrad3"],
                    optional: &[],
                },
            },
        }
    }

    /// The kinds that the diagnosis has a name for.
    pub fn known() -> impl Iterator<Item = Kind> {
        Kind::ALL.into_iter().filter(|kind| kind.descriptor().known.is_some())
    }

    /// The kinds that it has none for: outside its library on purpose.
    pub fn foreign() -> impl Iterator<Item = Kind> {
        Kind::ALL.into_iter().filter(|kind| kind.descriptor().known.is_none())
    }

    /// Its name in scenes, options and results.
    #[must_use]
    pub const fn name(self) -> &'static str {
        self.descriptor().name
    }

    /// The kind with this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Kind> {
        Kind::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// The kind with this name, if the diagnosis knows it.
    #[must_use]
    pub fn known_from_name(name: &str) -> Option<Kind> {
        Kind::from_name(name).filter(|kind| kind.descriptor().known.is_some())
    }

    /// What it belongs to.
    #[must_use]
    pub const fn level(self) -> Level {
        self.descriptor().level
    }

    /// Unit of its magnitude: drift and steps are the length of the translation, at the base or at the tool; of a drift, over the
    /// whole session. Outliers are the share of the readings.
    #[must_use]
    pub fn unit(self) -> &'static str {
        self.descriptor().unit.name()
    }

    /// Realistic magnitudes, SI, at a joint or link (from 0; `None` for what has no number) of an arm of `joints` joints.
    #[must_use]
    pub fn range(self, place: Option<usize>, joints: usize) -> [f64; 2] {
        self.descriptor().range.at(place, joints)
    }
}

/// Outliers move nothing: readings are weighted instead.
fn move_nothing(_: &Site<'_>, _: &mut Vec<Hypothesis>) {}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Parameters;
    use crate::effects::signature::shape::Coefficients;
    use crate::effects::signature::unnamed::all_yield::AllYield;
    use crate::effects::signature::unnamed::bump::Bump;

    #[test]
    fn names_in_results_are_those_of_the_serialisation() {
        for kind in Kind::ALL {
            assert_eq!(serde_json::to_value(kind).unwrap(), kind.name());
            assert_eq!(Kind::from_name(kind.name()), Some(kind));
        }
        assert!(Kind::known().chain(Kind::foreign()).eq(Kind::ALL), "those that are known come first");
        // The error lists every variant of the enumeration.
        let error = serde_json::from_value::<Kind>("none such".into()).unwrap_err().to_string();
        assert_eq!(error.matches('`').count() / 2 - 1, Kind::ALL.len(), "a kind is not in ALL: {error}");
    }

    #[test]
    fn every_row_of_the_table_is_complete() {
        for kind in Kind::ALL {
            let of = kind.descriptor();
            for place in [None, Some(0), Some(7)] {
                let [low, high] = of.range.at(place, 8);
                assert!(0.0 < low && low < high, "{kind:?}");
            }
            for neighbour in of.neighbours {
                assert!(
                    neighbour.kind != kind && neighbour.kind.descriptor().known.is_some() && !neighbour.told_apart_by.is_empty()
                );
            }
            assert!(!(of.one_signed && of.sign_apart), "{kind:?}: what has one sign has none to tell");
            assert!(of.softest >= 1.0, "{kind:?}");
            for advice in of.known.iter().flat_map(|known| known.advice) {
                let other = if let Advice::Beside(other, _) = advice { Some(*other) } else { None };
                assert!(other.is_none_or(|other| of.neighbours.iter().any(|neighbour| neighbour.kind == other)), "{kind:?}");
            }
            assert!(of.case_of.is_none_or(|named| of.known.is_none() && named.descriptor().known.is_some()), "{kind:?}");
            assert!(of.known.is_some() || of.neighbours.is_empty(), "{kind:?}: nothing is confused with what has no name");
            assert!(!of.scene.required.is_empty() || !of.scene.optional.is_empty(), "{kind:?} has no magnitude in scenes");
        }
    }

    /// Other people's scripts and recordings read it.
    #[test]
    fn shapes_are_written_flat_whether_they_have_a_name_or_not() {
        let written = [
            (r#"{"shape":"torque","joint":1}"#, Shape::Torque(joint_compliance::Torque { joint: 0 })),
            (r#"{"shape":"growth"}"#, Shape::Growth(link_thermal_growth::Growth { link: None })),
            (r#"{"shape":"growth","link":3}"#, Shape::Growth(link_thermal_growth::Growth { link: Some(2) })),
            (r#"{"shape":"base_drift"}"#, Shape::BaseDrift(base_drift::BaseDrift {})),
            (r#"{"shape":"tool_step","row":7}"#, Shape::ToolStep(tool_step::ToolStep { row: 7 })),
            (
                r#"{"shape":"bump","joint":2,"centre":0.5,"half_width":0.3}"#,
                Nameless::Bump(Bump { joint: 1, centre: 0.5, half_width: 0.3 }).into(),
            ),
            (r#"{"shape":"all_yield"}"#, Nameless::AllYield(AllYield {}).into()),
        ];
        for (text, shape) in written {
            assert_eq!(serde_json::to_string(&shape).unwrap(), text);
            assert_eq!(serde_json::from_str::<Shape>(text).unwrap(), shape);
        }
        let wrong = serde_json::from_str::<Shape>(r#"{"shape":"torque","joint":0}"#).unwrap_err().to_string();
        assert!(wrong.contains("count from 1"), "{wrong}");
    }

    #[test]
    fn the_schema_has_all_shapes_in_one_list() {
        let schema = schemars::schema_for!(Shape);
        let shapes = schema.get("oneOf").and_then(Value::as_array).unwrap();
        let names: Vec<&str> = shapes.iter().filter_map(|shape| shape["properties"]["shape"]["const"].as_str()).collect();
        assert_eq!((names.len(), shapes.len()), (40, 40), "{schema:?}");
        assert_eq!((names[0], names[24], names[25], names[39]), ("torque", "unsettled", "unequal_bend", "time_curve"));
        assert!(schema.get("anyOf").is_none());
    }

    #[test]
    fn only_shapes_that_some_kind_has_say_how_to_make_them_happen() {
        let bump = Shape::from(Nameless::Bump(Bump { joint: 1, centre: 0.5, half_width: 0.3 }));
        assert_eq!(bump.values(Coefficients(&[1e-3])).unwrap_err(), "a shape without a name");
        assert_eq!((bump.row(), bump.parameters(Coefficients(&[1e-3]))), (None, Parameters::default()));
        let beside = Shape::from(Nameless::Bump(Bump { joint: 1, centre: 0.7, half_width: 0.1 }));
        let far = Shape::from(Nameless::Bump(Bump { joint: 1, centre: 0.9, half_width: 0.3 }));
        assert!(bump.overlaps(&beside) && beside.overlaps(&bump) && !bump.overlaps(&far));
        let step = Shape::ToolStep(tool_step::ToolStep { row: 7 });
        assert!(!bump.overlaps(&step) && !step.overlaps(&step));
        assert_eq!(step.row(), Some(7));
        // Without coefficients there is nothing to make.
        assert_eq!(step.values(Coefficients(&[])).unwrap_err(), "the diagnosis lacks a coefficient");
        let moved = &step.values(Coefficients(&[1e-3, 2e-3, 3e-3])).unwrap()[0];
        assert_eq!((moved.translation, moved.rotation), ([1e-3, 2e-3, 3e-3].into(), [0.0; 3].into()));
    }
}
