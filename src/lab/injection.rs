//! Where effects can be switched on in an arm, and how people write their magnitudes.
//!
//! The magnitude of an effect is that of [`crate::effects::Kind::unit`]: a compliance where the physics takes a stiffness, the length
//! of the translation of a drift or step, the amplitude of a ripple. What the name and the magnitude leave open (sign, phase,
//! direction, moment) is drawn ([`Effect::drawn`](crate::simulation::effect::Effect::drawn)).

use std::f64::consts::PI;

use crate::arm::Arm;
use crate::arm::JointKind;
use crate::effects::{Kind, Level, Location, Unit};
use crate::units::ARCSEC;

/// The joints or links (from 0) of `arm` that can have an effect of `kind`; `[None]` for what has no number. Ripple and wear of gears
/// are for joints that turn.
#[must_use]
pub fn places(kind: Kind, arm: &Arm) -> Vec<Option<usize>> {
    match kind.level() {
        Level::Joint => {
            let turns = |joint: &usize| arm.chain.joints[*joint].kind == JointKind::Revolute;
            (0..arm.joint_count()).filter(turns).map(Some).collect()
        }
        Level::Link => (0..arm.joint_count()).map(Some).collect(),
        Level::Base | Level::Tool | Level::Sensor => vec![None],
    }
}

/// Whether an effect of `kind` on `arm` is no other kind's as well: a case of one would be a case of the other.
#[must_use]
pub fn is_its_own(kind: Kind, arm: &Arm) -> bool {
    kind.descriptor().known.and_then(|known| known.doubles).is_none_or(|doubles| !doubles(arm))
}

/// Where an effect of `kind` at `place` (from 0) sits, as results say it.
#[must_use]
pub fn location(kind: Kind, place: Option<usize>) -> Location {
    Location { level: kind.level(), index: place.map(|place| place + 1) }
}

/// Units in which magnitudes of `kind` are written, with their factor to SI; the first is used where results are printed.
#[must_use]
pub fn units(kind: Kind) -> &'static [(&'static str, f64)] {
    match kind.descriptor().unit {
        Unit::Metre => &[("µm", 1e-6), ("um", 1e-6), ("mm", 1e-3), ("m", 1.0)],
        Unit::Radian => &[
            ("µrad", 1e-6),
            ("urad", 1e-6),
            ("mrad", 1e-3),
            ("rad", 1.0),
            ("arcsec", ARCSEC),
            ("arcmin", 60.0 * ARCSEC),
            ("deg", PI / 180.0),
        ],
        Unit::RadianPerNewtonMetre => &[("µrad/Nm", 1e-6), ("urad/Nm", 1e-6), ("rad/Nm", 1.0), ("rad/(N·m)", 1.0)],
        Unit::RadianPerRadian => &[("µrad/rad", 1e-6), ("urad/rad", 1e-6), ("ppm", 1e-6), ("rad/rad", 1.0)],
        Unit::PerKelvin => &[("µm/m/K", 1e-6), ("um/m/K", 1e-6), ("ppm/K", 1e-6), ("1/K", 1.0)],
        Unit::RadianPerKelvin => &[("µrad/K", 1e-6), ("urad/K", 1e-6), ("rad/K", 1.0), ("arcsec/K", ARCSEC)],
        Unit::Kilogram => &[("kg", 1.0), ("g", 1e-3)],
        Unit::Share => &[("%", 1e-2), ("1", 1.0)],
        Unit::Ratio => &[("ppm", 1e-6), ("1", 1.0)],
    }
}

/// A list of magnitudes such as `0,10,30,60um`: each in its own unit, or in that of the next one that has one; SI.
///
/// # Errors
/// In words, if a number or a unit is none.
pub fn magnitudes(text: &str, kind: Kind) -> Result<Vec<f64>, String> {
    let known = units(kind);
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
            unit = Some(factor.ok_or_else(|| format!("`{suffix}` is no unit of {}; allowed: {}", kind.name(), names()))?.1);
        }
        if !number.is_finite() || number < 0.0 {
            return Err(format!("`{part}` is no magnitude of {}: it must be finite and not negative", kind.name()));
        }
        let factor = match unit {
            Some(factor) => factor,
            None if number == 0.0 => 1.0,
            None => return Err(format!("the unit of `{part}` is missing; units of {}: {}", kind.name(), names())),
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
pub fn written(value: f64, kind: Kind) -> String {
    let (unit, factor) = units(kind)[0];
    format!("{} {unit}", crate::units::number(value / factor))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::stream;
    use crate::simulation::effect::Effect;

    fn arm() -> Arm {
        crate::lab::reproduce::arms::arms().unwrap().swap_remove(0).scene.arm
    }

    #[test]
    fn an_effect_has_the_kind_the_place_and_the_magnitude_that_was_asked_for() {
        let arm = arm();
        for kind in Kind::ALL {
            for place in places(kind, &arm) {
                let [low, high] = kind.range(place, arm.joint_count());
                assert!(0.0 < low && low < high, "{}", kind.name());
                let effect = Effect::drawn(kind, place, low, &arm, &mut stream(3, kind.name()));
                assert_eq!(effect.location(), location(kind, place));
                assert_eq!((effect.kinds(), effect.name()), (vec![kind], kind.name()));
                assert!((effect.magnitude(Some(kind)) / low - 1.0).abs() < 1e-12, "{} at {place:?}", kind.name());
            }
        }
    }

    #[test]
    fn magnitudes_take_the_unit_that_follows() {
        let play = Kind::RadialClearance;
        assert_eq!(magnitudes("0,10,30,60um", play).unwrap(), [0.0, 10e-6, 30e-6, 60e-6]);
        assert_eq!(magnitudes("0, 1e-2 mm", play).unwrap(), [0.0, 1e-2 * 1e-3]);
        assert_eq!(magnitudes("0", play).unwrap(), [0.0]);
        for (wrong, says) in
            [("10", "unit of `10` is missing"), ("-3um", "not negative"), ("3urad", "no unit"), ("x", "no magnitude")]
        {
            assert!(magnitudes(wrong, play).unwrap_err().contains(says), "{wrong}");
        }
        assert_eq!(magnitudes("2e-5rad/Nm", Kind::LinkBending).unwrap(), [2e-5]);
    }
}
