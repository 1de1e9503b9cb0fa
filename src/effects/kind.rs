//! The kinds of un-modelled effects, and the one table that says everything about each.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::descriptor::{Descriptor, Load, Need, Neighbour, Range, SceneKeys, ScenePlace, Source, Unit};
use super::location::Level;
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
    /// Transmission error of a strain-wave gear: twice per turn of the wave generator.
    StrainWaveError,
    /// Gear ratio error, and motion that leaks from a neighbouring joint.
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
const SPREAD_OVER_TIME: &str = "readings spread evenly over the session";
const ENCODERS_FEEL_NO_LOAD: &str = "several payloads: an encoder does not feel them";

impl Kind {
    /// Every kind, those that the diagnosis knows first.
    pub const ALL: [Kind; 23] = [
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
                one_signed: true,
                sign_apart: false,
                load: Load::Drives,
                needs: &[Need::Masses],
                known: true,
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
                one_signed: true,
                sign_apart: false,
                load: Load::Drives,
                needs: &[Need::Masses],
                known: true,
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
                one_signed: false,
                sign_apart: true,
                load: Load::None,
                needs: &[Need::ApproachSides],
                known: true,
                may_repeat: false,
                neighbours: &[Neighbour { kind: Kind::GravityLostMotion, told_apart_by: BOTH_SIDES }],
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
                one_signed: true,
                sign_apart: false,
                load: Load::Seats,
                needs: &[Need::Masses],
                known: true,
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
                one_signed: false,
                sign_apart: false,
                load: Load::None,
                needs: &[],
                known: true,
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
                about: "ripple twice per motor turn",
                level: Level::Joint,
                unit: Unit::Radian,
                magnitude: "amplitude of the angle error",
                range: Range::Everywhere([8.0 * ARCSEC, 40.0 * ARCSEC]),
                source: Source::Cited(STRAIN_WAVE_CATALOGUE),
                one_signed: false,
                sign_apart: false,
                load: Load::None,
                needs: &[],
                known: true,
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
                one_signed: false,
                sign_apart: false,
                load: Load::None,
                needs: &[],
                known: true,
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
                one_signed: true,
                sign_apart: false,
                load: Load::None,
                needs: &[Need::Temperatures],
                known: true,
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
                one_signed: false,
                sign_apart: false,
                load: Load::None,
                needs: &[Need::Temperatures],
                known: true,
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
                one_signed: true,
                sign_apart: false,
                load: Load::Seats,
                needs: &[Need::Masses],
                known: true,
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
                one_signed: true,
                sign_apart: false,
                load: Load::Seats,
                needs: &[Need::Masses],
                known: true,
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
                one_signed: false,
                sign_apart: false,
                load: Load::None,
                needs: &[Need::Times],
                known: true,
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
                one_signed: false,
                sign_apart: false,
                load: Load::None,
                needs: &[Need::Times],
                known: true,
                may_repeat: false,
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
                one_signed: true,
                sign_apart: false,
                load: Load::Drives,
                needs: &[Need::Masses],
                known: true,
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
                one_signed: false,
                sign_apart: false,
                load: Load::None,
                needs: &[Need::Times, Need::Orientations],
                known: true,
                may_repeat: false,
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
                one_signed: false,
                sign_apart: false,
                load: Load::None,
                needs: &[],
                known: true,
                may_repeat: false,
                neighbours: &[Neighbour {
                    kind: Kind::LinkThermalGrowth,
                    told_apart_by: "a scale bar: link lengths that are fitted absorb it wholly",
                }],
                scene: SceneKeys { place: ScenePlace::Nowhere, required: &["scale_ppm"], optional: &[] },
            },
            Kind::MeasurementOutliers => &Descriptor {
                name: "measurement_outliers",
                about: "some readings have a larger noise",
                level: Level::Sensor,
                unit: Unit::Share,
                magnitude: "share of the readings",
                range: Range::Everywhere([0.03, 0.15]),
                source: Source::Assumed,
                one_signed: false,
                sign_apart: false,
                load: Load::None,
                needs: &[],
                known: true,
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
                one_signed: false,
                sign_apart: false,
                load: Load::None,
                needs: &[],
                known: false,
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
                one_signed: false,
                sign_apart: false,
                load: Load::Drives,
                needs: &[],
                known: false,
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
                one_signed: false,
                sign_apart: false,
                load: Load::Drives,
                needs: &[],
                known: false,
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
                one_signed: false,
                sign_apart: false,
                load: Load::None,
                needs: &[],
                known: false,
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
                one_signed: false,
                sign_apart: false,
                load: Load::Drives,
                needs: &[],
                known: false,
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
                one_signed: false,
                sign_apart: false,
                load: Load::Drives,
                needs: &[],
                known: false,
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
        Kind::ALL.into_iter().filter(|kind| kind.descriptor().known)
    }

    /// The kinds that it has none for: outside its library on purpose.
    pub fn foreign() -> impl Iterator<Item = Kind> {
        Kind::ALL.into_iter().filter(|kind| !kind.descriptor().known)
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
        Kind::from_name(name).filter(|kind| kind.descriptor().known)
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

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
                assert!(neighbour.kind != kind && neighbour.kind.descriptor().known && !neighbour.told_apart_by.is_empty());
            }
            assert!(!(of.one_signed && of.sign_apart), "{kind:?}: what has one sign has none to tell");
            assert!(of.known || of.neighbours.is_empty(), "{kind:?}: nothing is confused with what has no name");
            assert!(!of.scene.required.is_empty() || !of.scene.optional.is_empty(), "{kind:?} has no magnitude in scenes");
        }
    }
}
