//! `[[injected.effect]]`: what the keys of a table become. Which keys a kind has is in the table of kinds
//! ([`Kind::descriptor`]).

use nalgebra::Vector3;

use super::convert::{Checked, at_most, each_link, not_negative, positive};
use super::error::{Invalid, suggestion};
use super::file::{EffectToml, OneOrEach};
use crate::arm::Arm;
use crate::arm::JointKind;
use crate::effects::{Foot, Kind, SceneKeys, ScenePlace};
use crate::simulation::effect::{Effect, Growing, Values};
use crate::units::ARCSEC;

/// All plays of a bearing in one table, besides the kinds that have one each.
pub const CLEARANCE: &str = "clearance";
/// What happens there.
pub const CLEARANCE_ABOUT: &str = "all plays of a bearing together";
/// Its keys.
pub const CLEARANCE_KEYS: SceneKeys =
    SceneKeys { place: ScenePlace::Joint, required: &[], optional: &["radial_um", "axial_um", "tilt_urad"] };

/// What a table may say as its `kind`: the name, its keys, and what happens.
pub fn kinds() -> impl Iterator<Item = (&'static str, SceneKeys, &'static str)> {
    let of = |kind: Kind| (kind.name(), kind.descriptor().scene, kind.descriptor().about);
    Kind::ALL.into_iter().map(of).chain([(CLEARANCE, CLEARANCE_KEYS, CLEARANCE_ABOUT)])
}

/// Largest play of a turn, rad, and of a shift, m: beyond these a unit was probably mistaken.
const LARGEST_TURN_URAD: f64 = 1e4;
const LARGEST_SHIFT_UM: f64 = 1e3;
/// The play above, in arc seconds.
const LARGEST_TURN_ARCSEC: f64 = 2060.0;

/// The effects that one table asks for: one, or one per link where a list of expansions is given.
pub(super) fn effects(file: &EffectToml, key: &str, arm: &Arm) -> Checked<Vec<Effect>> {
    let Some((name, keys, _)) = kinds().find(|(name, _, _)| *name == file.kind) else {
        let names: Vec<&str> = kinds().map(|(name, _, _)| name).collect();
        let remedy =
            suggestion(&file.kind, &names).unwrap_or_else(|| "use one of these kinds; `kincal effects` tells of each".to_owned());
        return Err(Invalid::new(format!("{key}.kind"), format!("{:?}", file.kind), names.join(", "), remedy));
    };
    check_keys(file, name, &keys, key)?;
    let place = place(file, name, &keys, key, arm)?;
    let values = values(file, key, place, arm)?;
    Ok(match Kind::from_name(name) {
        None => vec![Effect::clearance(place.unwrap_or(0), &values)],
        Some(Kind::LinkThermalGrowth) => growth(file, &format!("{key}.expansion_um_per_m_per_k"), place, arm)?,
        Some(kind) => vec![Effect::from_values(kind, place, &values)],
    })
}

/// Every number of a table that is given, checked and in SI.
fn values(file: &EffectToml, key: &str, place: Option<usize>, arm: &Arm) -> Checked<Values> {
    let path = |name: &str| format!("{key}.{name}");
    type Least = fn(f64, &str) -> Checked<f64>;
    // A number that is not given is none to complain of.
    let given = |name: &str, value: Option<f64>, least: Least, most: f64| -> Checked<f64> {
        value.map_or(Ok(0.0), |value| at_most(least(value, &path(name))?, most, &path(name)))
    };
    let signed = |name: &str, value: Option<f64>, most: f64| -> Checked<f64> {
        let value = value.unwrap_or(0.0);
        at_most(value.abs(), most, &path(name))?;
        Ok(value)
    };
    let vector = |name: &str, value: Option<[f64; 3]>, most: f64| -> Checked<Vector3<f64>> {
        let value = Vector3::from(value.unwrap_or_default());
        at_most(value.norm(), most, &path(name))?;
        Ok(value / 1e6)
    };
    let order = file.order.unwrap_or(1);
    if !(1..=2).contains(&order) {
        let remedy = "an encoder off its axis has 1, a tilted one 2";
        return Err(Invalid::new(path("order"), order.to_string(), "1 or 2", remedy));
    }
    let (angles, errors) = table(file, key)?;
    let at = place.unwrap_or(0);
    let source = match (&file.source, file.coupling_urad_per_rad) {
        (Some(name), _) => source(name, at, &path("source"), arm)?,
        (None, None) => at,
        (None, Some(_)) => {
            let remedy = "name the joint whose motion leaks: source = \"…\"";
            return Err(Invalid::new(path("source"), "`source` is missing", "the name of a joint", remedy));
        }
    };
    Ok(Values {
        stiffness: given("stiffness_nm_per_rad", file.stiffness_nm_per_rad, positive, 1e12)?,
        cubic: given("cubic_nm_per_mrad3", file.cubic_nm_per_mrad3, not_negative, 1e9)? * 1e9,
        compliance: given("compliance_urad_per_nm", file.compliance_urad_per_nm, positive, 1e4)? / 1e6,
        beam: file.beam.unwrap_or(false),
        gain: signed("gain_urad_per_nm", file.gain_urad_per_nm, 1e4)? / 1e6,
        width: given("width_arcsec", file.width_arcsec, positive, LARGEST_TURN_ARCSEC)? * ARCSEC,
        amplitude: given("amplitude_arcsec", file.amplitude_arcsec, positive, LARGEST_TURN_ARCSEC)? * ARCSEC,
        order,
        phase: file.phase_deg.unwrap_or(0.0).to_radians(),
        ratio: given("ratio", file.ratio, positive, 1e4)?,
        ratio_error: signed("ratio_error_urad_per_rad", file.ratio_error_urad_per_rad, 1e5)? / 1e6,
        coupling: signed("coupling_urad_per_rad", file.coupling_urad_per_rad, 1e5)? / 1e6,
        source,
        // A list of them is read by itself.
        expansion: 0.0,
        foot: Foot::default(),
        drift: signed("drift_urad_per_k", file.drift_urad_per_k, 1e4)? / 1e6,
        radial: given("radial_um", file.radial_um, not_negative, LARGEST_SHIFT_UM)? / 1e6,
        axial: given("axial_um", file.axial_um, not_negative, LARGEST_SHIFT_UM)? / 1e6,
        tilt: given("tilt_urad", file.tilt_urad, not_negative, LARGEST_TURN_URAD)? / 1e6,
        held: None,
        moves: file.moves.unwrap_or_default(),
        translation: vector("translation_um", file.translation_um, 5e4)?,
        rotation: vector("rotation_urad", file.rotation_urad, 5e4)?,
        after: given("after", file.after, not_negative, 1.0)?,
        scale: signed("scale_ppm", file.scale_ppm, 1e5)? / 1e6,
        share: given("share", file.share, not_negative, 1.0)?,
        factor: given("factor", file.factor, positive, 1e6)?,
        depth: given("depth_arcsec", file.depth_arcsec, positive, LARGEST_TURN_ARCSEC)? * ARCSEC,
        centre: file.centre_deg.unwrap_or(0.0).to_radians(),
        half_width: given("half_width_deg", file.half_width_deg, positive, 180.0)?.to_radians(),
        time_constant: given("time_constant_s", file.time_constant_s, not_negative, 1e6)?,
        travel: given("travel_deg", file.travel_deg, positive, 36e3)?.to_radians(),
        excess: signed("excess_kg", file.excess_kg, 1e3)?,
        lag: signed("lag_ppm", file.lag_ppm, 1e5)? / 1e6,
        angles,
        errors,
    })
}

/// Angles (rad, rising) and the error at each of them (rad).
fn table(file: &EffectToml, key: &str) -> Checked<(Vec<f64>, Vec<f64>)> {
    let (Some(angles), Some(errors)) = (&file.angles_deg, &file.errors_arcsec) else {
        return Ok((Vec::new(), Vec::new()));
    };
    let path = format!("{key}.angles_deg");
    if let Some(pair) = angles.windows(2).find(|pair| pair[0] >= pair[1]) {
        let found = format!("{} before {}", pair[0], pair[1]);
        return Err(Invalid::new(path, found, "angles that rise", "sort them, each once"));
    }
    if angles.len() < 2 || angles.len() != errors.len() {
        let found = format!("{} angles and {} errors", angles.len(), errors.len());
        return Err(Invalid::new(path, found, "two angles or more, and as many errors", "give one error for each angle"));
    }
    for (value, most, name) in angles
        .iter()
        .map(|angle| (angle, 36e3, "angles_deg"))
        .chain(errors.iter().map(|error| (error, LARGEST_TURN_ARCSEC, "errors_arcsec")))
    {
        at_most(value.abs(), most, &format!("{key}.{name}"))?;
    }
    Ok((angles.iter().map(|angle| angle.to_radians()).collect(), errors.iter().map(|error| error * ARCSEC).collect()))
}

/// Growth of the whole arm, of one link, or of each link by its own number.
fn growth(file: &EffectToml, key: &str, link: Option<usize>, arm: &Arm) -> Checked<Vec<Effect>> {
    let Some(values) = &file.expansion_um_per_m_per_k else {
        return Ok(Vec::new());
    };
    if let (Some(_), OneOrEach::Each(_)) = (link, values) {
        return Err(Invalid::new(key, "a list", "one number where a link is named", "leave `link` out, or give one number"));
    }
    let each = each_link(values, key, arm)?;
    for value in &each {
        at_most(not_negative(*value, key)?, 1e3, key)?;
    }
    let grows = |link, expansion: f64| Effect::LinkThermalGrowth { of: Growing::of(link), expansion: expansion / 1e6 };
    if let OneOrEach::One(value) = values {
        return Ok(vec![grows(link, *value)]);
    }
    // All links as the foot, and each link by what it exceeds the foot.
    let (foot, links) = (each[0], each.iter().skip(1).enumerate());
    let more = links.filter(|(_, value)| **value != foot).map(|(link, value)| grows(Some(link), value - foot));
    Ok(std::iter::once(grows(None, foot)).chain(more).collect())
}

/// The joint or link that an effect of kind `name` sits on.
fn place(file: &EffectToml, name: &str, keys: &SceneKeys, key: &str, arm: &Arm) -> Checked<Option<usize>> {
    let missing = |name: &str, what: &str| {
        let (found, remedy) = (format!("`{name}` is missing"), format!("add `{name} = \"…\"`"));
        Err(Invalid::new(format!("{key}.{name}"), found, format!("the name of a {what}"), remedy))
    };
    let turning = match keys.place {
        ScenePlace::Nowhere => return Ok(None),
        ScenePlace::Link | ScenePlace::LinkOrArm => {
            return match &file.link {
                Some(name) => link(name, &format!("{key}.link"), arm).map(Some),
                None if keys.place == ScenePlace::LinkOrArm => Ok(None),
                None => missing("link", "link"),
            };
        }
        ScenePlace::Joint => false,
        ScenePlace::TurningJoint => true,
    };
    let Some(joint_name) = &file.joint else {
        return missing("joint", "joint");
    };
    let path = format!("{key}.joint");
    let joint = joint(joint_name, &path, arm)?;
    if turning && arm.chain.joints[joint].kind != JointKind::Revolute {
        let found = format!("{joint_name:?}, which slides");
        return Err(Invalid::new(path, found, format!("a joint that turns for {name}"), "name another joint"));
    }
    Ok(Some(joint))
}

fn joint(name: &str, key: &str, arm: &Arm) -> Checked<usize> {
    let names: Vec<&str> = arm.chain.joints.iter().map(|joint| joint.name.as_str()).collect();
    named(name, &names, key, "joint")
}

/// The joint whose motion leaks into joint `of`.
fn source(name: &str, of: usize, key: &str, arm: &Arm) -> Checked<usize> {
    let source = joint(name, key, arm)?;
    let wrong =
        |found: &str, remedy: &str| Err(Invalid::new(key, format!("{name:?}, {found}"), "another joint, one that turns", remedy));
    if source == of {
        return wrong("the joint that errs", "what its own gear does is ratio_error_urad_per_rad");
    }
    if arm.chain.joints[source].kind != JointKind::Revolute {
        return wrong("which slides", "name another joint");
    }
    Ok(source)
}

/// A moving link, from 0.
fn link(name: &str, key: &str, arm: &Arm) -> Checked<usize> {
    let names: Vec<&str> = arm.links.iter().skip(1).map(|link| link.name.as_str()).collect();
    named(name, &names, key, "link that moves")
}

fn named(name: &str, names: &[&str], key: &str, what: &str) -> Checked<usize> {
    names.iter().position(|known| *known == name).ok_or_else(|| {
        let remedy = suggestion(name, names).unwrap_or_else(|| format!("name a {what} of this arm"));
        Invalid::new(key, format!("{name:?}"), names.join(", "), remedy)
    })
}

/// Refuses keys that belong to other kinds, and missing ones.
fn check_keys(file: &EffectToml, name: &str, keys: &SceneKeys, key: &str) -> Checked<()> {
    let table = toml::Value::try_from(file).ok();
    let given: Vec<&str> = table
        .as_ref()
        .and_then(toml::Value::as_table)
        .map(|table| table.keys().map(String::as_str).collect())
        .unwrap_or_default();
    let allowed: Vec<&str> =
        ["kind"].into_iter().chain(keys.place_key()).chain(keys.required.iter().chain(keys.optional).copied()).collect();
    if let Some(foreign) = given.iter().find(|other| !allowed.contains(other)) {
        let found = format!("`{foreign}`, which {name} does not have");
        let remedy = suggestion(foreign, &allowed).unwrap_or_else(|| "remove the key, or change the kind".to_owned());
        return Err(Invalid::new(format!("{key}.{foreign}"), found, allowed.join(", "), remedy));
    }
    if let Some(missing) = keys.required.iter().find(|needed| !given.contains(needed)) {
        let (found, remedy) = (format!("`{missing}` is missing"), format!("add `{missing} = …`"));
        return Err(Invalid::new(key, found, format!("{name} needs {}", keys.required.join(", ")), remedy));
    }
    if keys.required.is_empty() && !keys.optional.iter().any(|other| given.contains(other)) {
        let allowed = format!("at least one of {}", keys.optional.join(", "));
        return Err(Invalid::new(key, "no magnitude", allowed, "say how large it is"));
    }
    Ok(())
}
