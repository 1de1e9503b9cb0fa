//! Effects by their names: what can be switched on, where, how large it realistically is, and what else of it is drawn.
//!
//! The magnitude of an effect is that of [`crate::effects::Kind::unit`]: a compliance where the physics takes a stiffness, the length
//! of the translation of a drift or step, the amplitude of a ripple. What the name and the magnitude leave open (sign, phase,
//! direction, moment) is drawn.

use std::f64::consts::{PI, TAU};

use nalgebra::Vector3;

use crate::arm::Arm;
use crate::arm::JointKind;
use crate::effects::{Kind, Level, Location};
use crate::seed::Stream;
use crate::simulation::effect::{Effect, Moves};
use crate::units::ARCSEC;

/// A kind of effect that can be switched on: one that the analyser knows by name, or one that it is not to know.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Sort {
    /// In the analyser's library.
    Known(Kind),
    /// A sector of worn teeth.
    WornToothSector,
    /// The joint yields slowly after a move.
    CreepAfterMotion,
    /// A moment across the axis turns the joint.
    MomentCrosstalk,
    /// A joint that remembers its last moves.
    MemoryHysteresis,
    /// The payload weighs more than the cell believes.
    WrongPayload,
    /// A joint that stiffens under load.
    HardeningStiffness,
}

impl Sort {
    /// Those outside the analyser's library.
    pub const FOREIGN: [Sort; 6] = [
        Sort::WornToothSector,
        Sort::CreepAfterMotion,
        Sort::MomentCrosstalk,
        Sort::MemoryHysteresis,
        Sort::WrongPayload,
        Sort::HardeningStiffness,
    ];

    /// Every sort, those in the library first.
    #[must_use]
    pub fn all() -> Vec<Sort> {
        Kind::ALL.into_iter().map(Sort::Known).chain(Sort::FOREIGN).collect()
    }

    /// Its name in scenes, options and results.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Sort::Known(kind) => kind.name(),
            Sort::WornToothSector => "worn_tooth_sector",
            Sort::CreepAfterMotion => "creep_after_motion",
            Sort::MomentCrosstalk => "moment_crosstalk",
            Sort::MemoryHysteresis => "memory_hysteresis",
            Sort::WrongPayload => "wrong_payload",
            Sort::HardeningStiffness => "hardening_stiffness",
        }
    }

    /// The sort with this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Sort> {
        Sort::all().into_iter().find(|sort| sort.name() == name)
    }

    /// What it belongs to.
    #[must_use]
    pub fn level(self) -> Level {
        match self {
            Sort::Known(kind) => kind.level(),
            Sort::WrongPayload => Level::Tool,
            _ => Level::Joint,
        }
    }

    /// Unit of its magnitude, SI.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Sort::Known(kind) => kind.unit(),
            Sort::WornToothSector | Sort::MemoryHysteresis => "rad",
            Sort::CreepAfterMotion | Sort::MomentCrosstalk | Sort::HardeningStiffness => "rad/(N·m)",
            Sort::WrongPayload => "kg",
        }
    }

    /// Realistic magnitudes at `place` (joint or link, from 0) of an arm of about 1 m reach, SI, smallest and largest
    /// (`design/effects.md`; those of what the analyser does not know are of the same size at the arm's end).
    #[must_use]
    pub fn range(self, place: Option<usize>, arm: &Arm) -> [f64; 2] {
        match self {
            // The proximal half carries the arm; the wrist's gears are smaller.
            Sort::Known(Kind::JointCompliance) | Sort::HardeningStiffness => {
                let base = place.is_none_or(|joint| 2 * joint < arm.joint_count());
                if base { [1.0 / 6e4, 1.0 / 1e4] } else { [1.0 / 1.5e4, 1.0 / 2e3] }
            }
            Sort::Known(Kind::LinkBending) => [0.5e-5, 5e-5],
            Sort::Known(Kind::Backlash | Kind::GravityLostMotion) => [20.0 * ARCSEC, 120.0 * ARCSEC],
            Sort::Known(Kind::JointEccentricity) => [10.0 * ARCSEC, 100.0 * ARCSEC],
            Sort::Known(Kind::StrainWaveError) => [8.0 * ARCSEC, 40.0 * ARCSEC],
            Sort::Known(Kind::GearCoupling) => [5e-5, 40e-5],
            Sort::Known(Kind::LinkThermalGrowth) => [12e-6, 24e-6],
            Sort::Known(Kind::JointThermalDrift) => [3e-6, 30e-6],
            Sort::Known(Kind::RadialClearance) => [10e-6, 60e-6],
            Sort::Known(Kind::TiltClearance) => [20e-6, 200e-6],
            Sort::Known(Kind::BaseDrift | Kind::BaseStep) => [15e-6, 80e-6],
            Sort::Known(Kind::ToolStep) => [0.05e-3, 0.5e-3],
            Sort::Known(Kind::MeasurementScale) => [10e-6, 100e-6],
            Sort::Known(Kind::MeasurementOutliers) => [0.03, 0.15],
            Sort::WornToothSector => [40.0 * ARCSEC, 160.0 * ARCSEC],
            Sort::CreepAfterMotion => [0.5e-5, 5e-5],
            Sort::MomentCrosstalk => [0.3e-5, 3e-5],
            Sort::MemoryHysteresis => [20.0 * ARCSEC, 120.0 * ARCSEC],
            Sort::WrongPayload => [0.5, 3.0],
        }
    }

    /// The joints or links (from 0) of `arm` that can have it; `[None]` for what has no number. Ripple and wear of gears are for
    /// joints that turn.
    #[must_use]
    pub fn places(self, arm: &Arm) -> Vec<Option<usize>> {
        match self.level() {
            Level::Joint => {
                let turns = |joint: &usize| arm.chain.joints[*joint].kind == JointKind::Revolute;
                (0..arm.joint_count()).filter(turns).map(Some).collect()
            }
            Level::Link => (0..arm.joint_count()).map(Some).collect(),
            Level::Base | Level::Tool | Level::Sensor => vec![None],
        }
    }

    /// Where it sits, as results say it.
    #[must_use]
    pub fn location(self, place: Option<usize>) -> Location {
        Location { level: self.level(), index: place.map(|place| place + 1) }
    }

    /// The effect of this magnitude (SI, positive) at `place`; what else it has is drawn from `stream`, as many numbers whatever
    /// the magnitude.
    #[must_use]
    pub fn effect(self, place: Option<usize>, magnitude: f64, arm: &Arm, stream: &mut Stream) -> Effect {
        let joint = place.unwrap_or(0);
        let mut sign = || if stream.unit() < 0.5 { -1.0 } else { 1.0 };
        match self {
            Sort::Known(Kind::JointCompliance) => Effect::JointCompliance { joint, stiffness: 1.0 / magnitude },
            Sort::Known(Kind::LinkBending) => Effect::LinkBending { link: joint, compliance: magnitude },
            Sort::Known(Kind::Backlash) => Effect::Backlash { joint, width: magnitude },
            Sort::Known(Kind::GravityLostMotion) => Effect::GravityLostMotion { joint, width: magnitude },
            Sort::Known(Kind::JointEccentricity) => {
                let order = 1 + stream.index(2) as u8;
                Effect::JointEccentricity { joint, amplitude: magnitude, order, phase: stream.uniform(-PI, PI) }
            }
            Sort::Known(Kind::StrainWaveError) => {
                let ratio = [80.0, 100.0, 120.0][stream.index(3)];
                Effect::StrainWaveError { joint, amplitude: magnitude, ratio, phase: stream.uniform(-PI, PI) }
            }
            Sort::Known(Kind::GearCoupling) => {
                let (signed, of_its_own) = (sign() * magnitude, stream.unit() < 0.5);
                // Motion leaks from the joint before, whose drive shares the housing; the first has none before it.
                let source = if joint == 0 { 1.min(arm.joint_count() - 1) } else { joint - 1 };
                if of_its_own || source == joint {
                    Effect::GearCoupling { joint, ratio_error: signed, coupling: 0.0, source }
                } else {
                    Effect::GearCoupling { joint, ratio_error: 0.0, coupling: signed, source }
                }
            }
            Sort::Known(Kind::LinkThermalGrowth) => Effect::LinkThermalGrowth { link: place, expansion: magnitude },
            Sort::Known(Kind::JointThermalDrift) => Effect::JointThermalDrift { joint, drift: sign() * magnitude },
            Sort::Known(Kind::RadialClearance) => Effect::Clearance { joint, radial: magnitude, axial: 0.0, tilt: 0.0 },
            Sort::Known(Kind::TiltClearance) => Effect::Clearance { joint, radial: 0.0, axial: 0.0, tilt: magnitude },
            Sort::Known(Kind::BaseDrift) => Effect::BaseDrift {
                moves: Moves::Base,
                translation: magnitude * direction(stream),
                rotation: turn(magnitude, stream),
            },
            Sort::Known(Kind::BaseStep) => Effect::BaseStep {
                moves: Moves::Base,
                translation: magnitude * direction(stream),
                rotation: turn(magnitude, stream),
                after: stream.uniform(0.25, 0.75),
            },
            Sort::Known(Kind::ToolStep) => Effect::ToolStep {
                translation: magnitude * direction(stream),
                rotation: turn(magnitude, stream),
                after: stream.uniform(0.25, 0.75),
            },
            Sort::Known(Kind::MeasurementScale) => Effect::MeasurementScale { scale: sign() * magnitude },
            Sort::Known(Kind::MeasurementOutliers) => {
                Effect::MeasurementOutliers { share: magnitude, factor: stream.uniform(6.0, 20.0) }
            }
            Sort::WornToothSector => {
                let [lower, upper] = [arm.chain.joints[joint].lower, arm.chain.joints[joint].upper].map(|end| 0.6 * end);
                let centre = stream.uniform(lower, upper);
                Effect::WornToothSector { joint, depth: magnitude, centre, half_width: stream.uniform(0.2, 0.6) }
            }
            Sort::CreepAfterMotion => {
                Effect::CreepAfterMotion { joint, compliance: magnitude, time_constant: stream.uniform(20.0, 200.0) }
            }
            Sort::MomentCrosstalk => Effect::MomentCrosstalk { joint, gain: sign() * magnitude },
            Sort::MemoryHysteresis => {
                Effect::MemoryHysteresis { joint, amplitude: 0.5 * magnitude, travel: stream.uniform(0.3, 1.5) }
            }
            Sort::WrongPayload => Effect::WrongPayload { excess: magnitude, stiffness: stream.uniform(1e4, 3e4) },
            Sort::HardeningStiffness => {
                // The cubic part is as large as the linear one at this angle.
                let angle = stream.uniform(0.3e-3, 1.5e-3);
                Effect::HardeningStiffness { joint, stiffness: 1.0 / magnitude, cubic: 1.0 / (magnitude * angle * angle) }
            }
        }
    }
}

/// A unit vector, uniform on the sphere.
fn direction(stream: &mut Stream) -> Vector3<f64> {
    let z = stream.uniform(-1.0, 1.0);
    let (sine, cosine) = libm::sincos(stream.uniform(0.0, TAU));
    let across = (1.0 - z * z).sqrt();
    Vector3::new(across * cosine, across * sine, z)
}

/// The rotation that comes with a translation of `magnitude` metres: up to as many radians.
fn turn(magnitude: f64, stream: &mut Stream) -> Vector3<f64> {
    let size = stream.uniform(0.2, 1.0) * magnitude;
    size * direction(stream)
}

/// The magnitude of `effect` in the unit of its kind, positive; of a clearance, of the part that `kind` names.
#[must_use]
pub fn magnitude(effect: &Effect, kind: Option<Kind>) -> f64 {
    match effect {
        Effect::JointCompliance { stiffness, .. } | Effect::HardeningStiffness { stiffness, .. } => 1.0 / stiffness,
        Effect::LinkBending { compliance, .. } | Effect::CreepAfterMotion { compliance, .. } => *compliance,
        Effect::Backlash { width, .. } | Effect::GravityLostMotion { width, .. } => *width,
        Effect::JointEccentricity { amplitude, .. } | Effect::StrainWaveError { amplitude, .. } => amplitude.abs(),
        Effect::GearCoupling { ratio_error, coupling, .. } => ratio_error.abs().max(coupling.abs()),
        Effect::LinkThermalGrowth { expansion, .. } => expansion.abs(),
        Effect::JointThermalDrift { drift, .. } => drift.abs(),
        Effect::Clearance { radial, tilt, .. } => {
            if kind == Some(Kind::TiltClearance) {
                *tilt
            } else {
                *radial
            }
        }
        Effect::BaseDrift { translation, .. } | Effect::BaseStep { translation, .. } | Effect::ToolStep { translation, .. } => {
            translation.norm()
        }
        Effect::MeasurementScale { scale } => scale.abs(),
        Effect::MeasurementOutliers { share, .. } => *share,
        Effect::WornToothSector { depth, .. } => *depth,
        Effect::MomentCrosstalk { gain, .. } => gain.abs(),
        Effect::MemoryHysteresis { amplitude, .. } => 2.0 * amplitude,
        Effect::WrongPayload { excess, .. } => excess.abs(),
    }
}

/// Units in which magnitudes of `sort` are written, with their factor to SI; the first is used where results are printed.
#[must_use]
pub fn units(sort: Sort) -> &'static [(&'static str, f64)] {
    match sort.unit() {
        "m" => &[("µm", 1e-6), ("um", 1e-6), ("mm", 1e-3), ("m", 1.0)],
        "rad" => &[
            ("µrad", 1e-6),
            ("urad", 1e-6),
            ("mrad", 1e-3),
            ("rad", 1.0),
            ("arcsec", ARCSEC),
            ("arcmin", 60.0 * ARCSEC),
            ("deg", PI / 180.0),
        ],
        "rad/(N·m)" => &[("µrad/Nm", 1e-6), ("urad/Nm", 1e-6), ("rad/Nm", 1.0), ("rad/(N·m)", 1.0)],
        "rad/rad" => &[("µrad/rad", 1e-6), ("urad/rad", 1e-6), ("ppm", 1e-6), ("rad/rad", 1.0)],
        "1/K" => &[("µm/m/K", 1e-6), ("um/m/K", 1e-6), ("ppm/K", 1e-6), ("1/K", 1.0)],
        "rad/K" => &[("µrad/K", 1e-6), ("urad/K", 1e-6), ("rad/K", 1.0), ("arcsec/K", ARCSEC)],
        "kg" => &[("kg", 1.0), ("g", 1e-3)],
        _ if sort == Sort::Known(Kind::MeasurementOutliers) => &[("%", 1e-2), ("1", 1.0)],
        _ => &[("ppm", 1e-6), ("1", 1.0)],
    }
}

/// A list of magnitudes such as `0,10,30,60um`: each in its own unit, or in that of the next one that has one; SI.
///
/// # Errors
/// In words, if a number or a unit is none.
pub fn magnitudes(text: &str, sort: Sort) -> Result<Vec<f64>, String> {
    let known = units(sort);
    let names = || known.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
    let mut unit: Option<f64> = None;
    let mut values = Vec::new();
    for part in text.split(',').rev() {
        let part = part.trim();
        // The longest beginning that is a number: `1e-5rad/Nm`.
        let cut =
            (0..=part.len()).rev().find(|cut| part.is_char_boundary(*cut) && part[..*cut].trim_end().parse::<f64>().is_ok());
        let Some(cut) = cut else {
            return Err(format!("`{part}` is no magnitude; write numbers with a unit, such as 0,10,30,60{}", known[0].0));
        };
        let (number, suffix) = (part[..cut].trim_end().parse::<f64>().unwrap_or(f64::NAN), part[cut..].trim());
        if !suffix.is_empty() {
            let factor = known.iter().find(|(name, _)| *name == suffix);
            unit = Some(factor.ok_or_else(|| format!("`{suffix}` is no unit of {}; allowed: {}", sort.name(), names()))?.1);
        }
        if !number.is_finite() || number < 0.0 {
            return Err(format!("`{part}` is no magnitude of {}: it must be finite and not negative", sort.name()));
        }
        let factor = match unit {
            Some(factor) => factor,
            None if number == 0.0 => 1.0,
            None => return Err(format!("the unit of `{part}` is missing; units of {}: {}", sort.name(), names())),
        };
        values.push(in_si(number, factor));
    }
    values.reverse();
    Ok(values)
}

/// `number` times `factor`, rounded once where the factor is one over a whole number: 10 µm are 1e-5 m to the last bit.
fn in_si(number: f64, factor: f64) -> f64 {
    let inverse = (1.0 / factor).round();
    if (inverse * factor - 1.0).abs() < 1e-12 { number / inverse } else { number * factor }
}

/// A magnitude in the unit in which results are printed.
#[must_use]
pub fn written(value: f64, sort: Sort) -> String {
    let (unit, factor) = units(sort)[0];
    format!("{} {unit}", crate::units::number(value / factor))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::stream;

    fn arm() -> Arm {
        crate::lab::reproduce::arms::arms().unwrap().swap_remove(0).scene.arm
    }

    #[test]
    fn an_effect_has_the_kind_the_place_and_the_magnitude_that_was_asked_for() {
        let arm = arm();
        for sort in Sort::all() {
            for place in sort.places(&arm) {
                let [low, high] = sort.range(place, &arm);
                assert!(0.0 < low && low < high, "{}", sort.name());
                let effect = sort.effect(place, low, &arm, &mut stream(3, sort.name()));
                assert_eq!(effect.location(), sort.location(place));
                match sort {
                    Sort::Known(kind) => assert_eq!(effect.kinds(), vec![kind]),
                    foreign => assert_eq!((effect.kinds(), effect.name()), (vec![], foreign.name())),
                }
                let kind = effect.kinds().first().copied();
                assert!((magnitude(&effect, kind) / low - 1.0).abs() < 1e-12, "{effect:?}");
            }
            assert_eq!(Sort::from_name(sort.name()), Some(sort));
        }
    }

    #[test]
    fn magnitudes_take_the_unit_that_follows() {
        let play = Sort::Known(Kind::RadialClearance);
        assert_eq!(magnitudes("0,10,30,60um", play).unwrap(), [0.0, 10e-6, 30e-6, 60e-6]);
        assert_eq!(magnitudes("0, 1e-2 mm", play).unwrap(), [0.0, 1e-2 * 1e-3]);
        assert_eq!(magnitudes("0", play).unwrap(), [0.0]);
        for (wrong, says) in
            [("10", "unit of `10` is missing"), ("-3um", "not negative"), ("3urad", "no unit"), ("x", "no magnitude")]
        {
            assert!(magnitudes(wrong, play).unwrap_err().contains(says), "{wrong}");
        }
        assert_eq!(magnitudes("2e-5rad/Nm", Sort::Known(Kind::LinkBending)).unwrap(), [2e-5]);
    }
}
