//! Kinds of un-modelled effects, and places.

use serde::{Deserialize, Serialize};

/// A kind of un-modelled effect that kincal knows by name. Conventions are those of [`Kind::unit`] and [`Kind::level`]: true pose =
/// pose at the joint readings + effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
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
    /// Gear ratio error, and motion that leaks from another joint.
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
    /// The tool or its reflector has been seated anew at one moment.
    ToolStep,
    /// The sensor's lengths are wrong by a factor.
    MeasurementScale,
    /// Some readings are far off.
    MeasurementOutliers,
}

/// What an effect belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Level {
    /// A joint.
    Joint,
    /// A link; link `i` moves with joint `i` and reaches to joint `i + 1`, the last to the tip.
    Link,
    /// The base, or the sensor against it.
    Base,
    /// The tool, or the reflector on it.
    Tool,
    /// The sensor.
    Sensor,
}

/// Where an effect sits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Location {
    /// What it belongs to.
    pub level: Level,
    /// Number of the joint or link, from 1; `None` for the whole arm and for what has no number.
    pub index: Option<usize>,
}

impl Kind {
    /// Every kind.
    pub const ALL: [Kind; 16] = [
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
        Kind::ToolStep,
        Kind::MeasurementScale,
        Kind::MeasurementOutliers,
    ];

    /// Its name in scenes and results.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Kind::JointCompliance => "joint_compliance",
            Kind::LinkBending => "link_bending",
            Kind::Backlash => "backlash",
            Kind::GravityLostMotion => "gravity_lost_motion",
            Kind::JointEccentricity => "joint_eccentricity",
            Kind::StrainWaveError => "strain_wave_error",
            Kind::GearCoupling => "gear_coupling",
            Kind::LinkThermalGrowth => "link_thermal_growth",
            Kind::JointThermalDrift => "joint_thermal_drift",
            Kind::RadialClearance => "radial_clearance",
            Kind::TiltClearance => "tilt_clearance",
            Kind::BaseDrift => "base_drift",
            Kind::BaseStep => "base_step",
            Kind::ToolStep => "tool_step",
            Kind::MeasurementScale => "measurement_scale",
            Kind::MeasurementOutliers => "measurement_outliers",
        }
    }

    /// The kind with this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Kind> {
        Kind::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// What it belongs to.
    #[must_use]
    pub fn level(self) -> Level {
        match self {
            Kind::JointCompliance
            | Kind::Backlash
            | Kind::GravityLostMotion
            | Kind::JointEccentricity
            | Kind::StrainWaveError
            | Kind::GearCoupling
            | Kind::JointThermalDrift
            | Kind::RadialClearance
            | Kind::TiltClearance => Level::Joint,
            Kind::LinkBending | Kind::LinkThermalGrowth => Level::Link,
            Kind::BaseDrift | Kind::BaseStep => Level::Base,
            Kind::ToolStep => Level::Tool,
            Kind::MeasurementScale | Kind::MeasurementOutliers => Level::Sensor,
        }
    }

    /// Unit of its magnitude: drift and steps are the length of the translation, at the base or at the tool; of a drift, over the
    /// whole session. Outliers are the share of the readings.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Kind::JointCompliance | Kind::LinkBending => "rad/(N·m)",
            Kind::Backlash | Kind::GravityLostMotion | Kind::JointEccentricity | Kind::StrainWaveError | Kind::TiltClearance => {
                "rad"
            }
            Kind::GearCoupling => "rad/rad",
            Kind::LinkThermalGrowth => "1/K",
            Kind::JointThermalDrift => "rad/K",
            Kind::RadialClearance | Kind::BaseDrift | Kind::BaseStep | Kind::ToolStep => "m",
            Kind::MeasurementScale | Kind::MeasurementOutliers => "1",
        }
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
    }
}
