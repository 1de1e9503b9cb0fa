//! `[[injected.effect]]`: which keys belong to which kind of effect, and what they become.

use nalgebra::Vector3;

use super::convert::{Checked, at_most, each_link, not_negative, positive};
use super::error::{Invalid, suggestion};
use super::file::{EffectToml, OneOrEach};
use crate::arm::Arm;
use crate::arm::JointKind;
use crate::simulation::effect::Effect;
use crate::units::ARCSEC;

/// What a kind of effect sits on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// `joint = "…"`, one that turns.
    TurningJoint,
    /// `joint = "…"`.
    Joint,
    /// `link = "…"`.
    Link,
    /// `link = "…"`, or none: the whole arm.
    LinkOrArm,
    /// Nothing that has a name.
    Nowhere,
}

/// A kind of effect as it is written in a scene.
#[derive(Clone, Copy, Debug)]
pub struct KindKeys {
    /// Value of `kind`.
    pub kind: &'static str,
    /// What it sits on.
    pub place: Place,
    /// Keys that it needs.
    pub required: &'static [&'static str],
    /// Keys that it may have.
    pub optional: &'static [&'static str],
    /// What happens.
    pub about: &'static str,
}

const fn kind(
    kind: &'static str,
    place: Place,
    required: &'static [&'static str],
    optional: &'static [&'static str],
    about: &'static str,
) -> KindKeys {
    KindKeys { kind, place, required, optional, about }
}

/// Every kind. Those after `measurement_outliers` are not in the analyser's library.
pub const KINDS: [KindKeys; 23] = [
    kind("joint_compliance", Place::TurningJoint, &["stiffness_nm_per_rad"], &[], "a spring between servo and joint"),
    kind("link_bending", Place::Link, &["compliance_urad_per_nm"], &[], "an elastic hinge across the joint's axis"),
    kind("backlash", Place::TurningJoint, &["width_arcsec"], &[], "play in a gear whose output friction holds: it lags"),
    kind("gravity_lost_motion", Place::TurningJoint, &["width_arcsec"], &[], "the same play, seated by gravity"),
    kind(
        "joint_eccentricity",
        Place::TurningJoint,
        &["amplitude_arcsec"],
        &["order", "phase_deg"],
        "encoder off or tilted on its axis",
    ),
    kind("strain_wave_error", Place::TurningJoint, &["amplitude_arcsec", "ratio"], &["phase_deg"], "ripple twice per motor turn"),
    kind(
        "gear_coupling",
        Place::TurningJoint,
        &[],
        &["ratio_error_urad_per_rad", "coupling_urad_per_rad", "source"],
        "ratio error, and motion that leaks from another joint",
    ),
    kind("link_thermal_growth", Place::LinkOrArm, &["expansion_um_per_m_per_k"], &[], "links grow with their temperature"),
    kind("joint_thermal_drift", Place::TurningJoint, &["drift_urad_per_k"], &[], "joint zero drifts with its link's temperature"),
    kind("radial_clearance", Place::Joint, &["radial_um"], &[], "radial play of a bearing, seated by the load"),
    kind("tilt_clearance", Place::Joint, &["tilt_urad"], &[], "tilting play of a bearing, seated by the moment"),
    kind("clearance", Place::Joint, &[], &["radial_um", "axial_um", "tilt_urad"], "all plays of a bearing together"),
    kind("base_drift", Place::Nowhere, &["translation_um"], &["rotation_urad", "moves"], "base or sensor move over the session"),
    kind("base_step", Place::Nowhere, &["translation_um", "after"], &["rotation_urad", "moves"], "base or sensor move at once"),
    kind("tool_step", Place::Nowhere, &["translation_um", "after"], &["rotation_urad"], "tool or reflector seated anew"),
    kind("measurement_scale", Place::Nowhere, &["scale_ppm"], &[], "the sensor's distances are wrong by a factor"),
    kind("measurement_outliers", Place::Nowhere, &["share", "factor"], &[], "some readings have a larger noise"),
    kind(
        "worn_tooth_sector",
        Place::TurningJoint,
        &["depth_arcsec", "centre_deg", "half_width_deg"],
        &[],
        "the output falls behind in a sector",
    ),
    kind(
        "creep_after_motion",
        Place::TurningJoint,
        &["compliance_urad_per_nm", "time_constant_s"],
        &[],
        "the joint yields slowly after a move",
    ),
    kind("moment_crosstalk", Place::TurningJoint, &["gain_urad_per_nm"], &[], "a moment across the axis turns the joint"),
    kind(
        "memory_hysteresis",
        Place::TurningJoint,
        &["amplitude_arcsec", "travel_deg"],
        &[],
        "the joint remembers its last moves",
    ),
    kind(
        "wrong_payload",
        Place::Nowhere,
        &["excess_kg", "stiffness_nm_per_rad"],
        &[],
        "the payload weighs more than is believed",
    ),
    kind(
        "hardening_stiffness",
        Place::TurningJoint,
        &["stiffness_nm_per_rad", "cubic_nm_per_mrad3"],
        &[],
        "a joint that stiffens under load",
    ),
];

impl KindKeys {
    /// Its keys, place included, in a line.
    #[must_use]
    pub fn keys(&self) -> String {
        let place: &[&str] = match self.place {
            Place::TurningJoint | Place::Joint => &["joint"],
            Place::Link => &["link"],
            Place::LinkOrArm => &["[link]"],
            Place::Nowhere => &[],
        };
        let optional = self.optional.iter().map(|key| format!("[{key}]"));
        let keys: Vec<String> = place.iter().chain(self.required).map(|key| (*key).to_owned()).chain(optional).collect();
        keys.join(", ")
    }
}

/// Largest play of a turn, rad, and of a shift, m: beyond these a unit was probably mistaken.
const LARGEST_TURN_URAD: f64 = 1e4;
const LARGEST_SHIFT_UM: f64 = 1e3;
/// The play above, in arc seconds.
const LARGEST_TURN_ARCSEC: f64 = 2060.0;

/// The effects that one table asks for: one, or one per link where a list of expansions is given.
pub(super) fn effects(file: &EffectToml, key: &str, arm: &Arm) -> Checked<Vec<Effect>> {
    let names: Vec<&str> = KINDS.iter().map(|kind| kind.kind).collect();
    let Some(kind) = KINDS.iter().find(|kind| kind.kind == file.kind) else {
        let remedy =
            suggestion(&file.kind, &names).unwrap_or_else(|| "use one of these kinds; `kincal effects` tells of each".to_owned());
        return Err(Invalid::new(format!("{key}.kind"), format!("{:?}", file.kind), names.join(", "), remedy));
    };
    check_keys(file, kind, key)?;
    let place = place(file, kind, key, arm)?;
    let at = place.unwrap_or(0);
    let path = |name: &str| format!("{key}.{name}");
    let given = |name: &str, value: Option<f64>, least: fn(f64, &str) -> Checked<f64>, most: f64| -> Checked<f64> {
        at_most(least(value.unwrap_or(0.0), &path(name))?, most, &path(name))
    };
    let stiffness = || given("stiffness_nm_per_rad", file.stiffness_nm_per_rad, positive, 1e12);
    let width = || Ok(given("width_arcsec", file.width_arcsec, positive, LARGEST_TURN_ARCSEC)? * ARCSEC);
    let amplitude = || Ok(given("amplitude_arcsec", file.amplitude_arcsec, positive, LARGEST_TURN_ARCSEC)? * ARCSEC);
    let phase = file.phase_deg.unwrap_or(0.0).to_radians();
    let compliance = || Ok(given("compliance_urad_per_nm", file.compliance_urad_per_nm, positive, 1e4)? / 1e6);
    let radial = || Ok(given("radial_um", file.radial_um, not_negative, LARGEST_SHIFT_UM)? / 1e6);
    let tilt = || Ok(given("tilt_urad", file.tilt_urad, not_negative, LARGEST_TURN_URAD)? / 1e6);
    let signed = |name: &str, value: Option<f64>, most: f64| -> Checked<f64> {
        let value = value.unwrap_or(0.0);
        at_most(value.abs(), most, &path(name))?;
        Ok(value / 1e6)
    };
    let vector = |name: &str, value: Option<[f64; 3]>, most: f64| -> Checked<Vector3<f64>> {
        let value = Vector3::from(value.unwrap_or_default());
        at_most(value.norm(), most, &path(name))?;
        Ok(value / 1e6)
    };
    let translation = || vector("translation_um", file.translation_um, 5e4);
    let rotation = || vector("rotation_urad", file.rotation_urad, 5e4);
    let within_one = |name: &str, value: Option<f64>| given(name, value, not_negative, 1.0);
    let moves = file.moves.unwrap_or_default();
    let effect = match kind.kind {
        "joint_compliance" => Effect::JointCompliance { joint: at, stiffness: stiffness()? },
        "link_bending" => Effect::LinkBending { link: at, compliance: compliance()? },
        "backlash" => Effect::Backlash { joint: at, width: width()? },
        "gravity_lost_motion" => Effect::GravityLostMotion { joint: at, width: width()? },
        "joint_eccentricity" => {
            let order = file.order.unwrap_or(1);
            if !(1..=2).contains(&order) {
                return Err(Invalid::new(
                    path("order"),
                    order.to_string(),
                    "1 or 2",
                    "an encoder off its axis has 1, a tilted one 2",
                ));
            }
            Effect::JointEccentricity { joint: at, amplitude: amplitude()?, order, phase }
        }
        "strain_wave_error" => {
            let ratio = given("ratio", file.ratio, positive, 1e4)?;
            Effect::StrainWaveError { joint: at, amplitude: amplitude()?, ratio, phase }
        }
        "gear_coupling" => {
            let source = match (&file.source, file.coupling_urad_per_rad) {
                (Some(name), _) => source(name, at, &path("source"), arm)?,
                (None, None) => at,
                (None, Some(_)) => {
                    let remedy = "name the joint whose motion leaks: source = \"…\"";
                    return Err(Invalid::new(path("source"), "`source` is missing", "the name of a joint", remedy));
                }
            };
            let ratio_error = signed("ratio_error_urad_per_rad", file.ratio_error_urad_per_rad, 1e5)?;
            let coupling = signed("coupling_urad_per_rad", file.coupling_urad_per_rad, 1e5)?;
            Effect::GearCoupling { joint: at, ratio_error, coupling, source }
        }
        "link_thermal_growth" => return growth(file, &path("expansion_um_per_m_per_k"), place, arm),
        "joint_thermal_drift" => {
            Effect::JointThermalDrift { joint: at, drift: signed("drift_urad_per_k", file.drift_urad_per_k, 1e4)? }
        }
        "radial_clearance" | "tilt_clearance" | "clearance" => {
            let axial = given("axial_um", file.axial_um, not_negative, LARGEST_SHIFT_UM)? / 1e6;
            Effect::Clearance { joint: at, radial: radial()?, axial, tilt: tilt()? }
        }
        "base_drift" => Effect::BaseDrift { moves, translation: translation()?, rotation: rotation()? },
        "base_step" => Effect::BaseStep {
            moves,
            translation: translation()?,
            rotation: rotation()?,
            after: within_one("after", file.after)?,
        },
        "tool_step" => {
            Effect::ToolStep { translation: translation()?, rotation: rotation()?, after: within_one("after", file.after)? }
        }
        "measurement_scale" => Effect::MeasurementScale { scale: signed("scale_ppm", file.scale_ppm, 1e5)? },
        "measurement_outliers" => Effect::MeasurementOutliers {
            share: within_one("share", file.share)?,
            factor: given("factor", file.factor, positive, 1e6)?,
        },
        "worn_tooth_sector" => Effect::WornToothSector {
            joint: at,
            depth: given("depth_arcsec", file.depth_arcsec, positive, LARGEST_TURN_ARCSEC)? * ARCSEC,
            centre: file.centre_deg.unwrap_or(0.0).to_radians(),
            half_width: given("half_width_deg", file.half_width_deg, positive, 180.0)?.to_radians(),
        },
        "creep_after_motion" => Effect::CreepAfterMotion {
            joint: at,
            compliance: compliance()?,
            time_constant: given("time_constant_s", file.time_constant_s, positive, 1e6)?,
        },
        "moment_crosstalk" => {
            Effect::MomentCrosstalk { joint: at, gain: signed("gain_urad_per_nm", file.gain_urad_per_nm, 1e4)? }
        }
        "memory_hysteresis" => Effect::MemoryHysteresis {
            joint: at,
            amplitude: amplitude()?,
            travel: given("travel_deg", file.travel_deg, positive, 36e3)?.to_radians(),
        },
        "wrong_payload" => {
            let excess = file.excess_kg.unwrap_or(0.0);
            at_most(excess.abs(), 1e3, &path("excess_kg"))?;
            Effect::WrongPayload { excess, stiffness: stiffness()? }
        }
        _ => Effect::HardeningStiffness {
            joint: at,
            stiffness: stiffness()?,
            cubic: given("cubic_nm_per_mrad3", file.cubic_nm_per_mrad3, not_negative, 1e9)? * 1e9,
        },
    };
    Ok(vec![effect])
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
    let grows = |link, expansion: f64| Effect::LinkThermalGrowth { link, expansion: expansion / 1e6 };
    if let OneOrEach::One(value) = values {
        return Ok(vec![grows(link, *value)]);
    }
    // All links as the foot, and each link by what it exceeds the foot.
    let (foot, links) = (each[0], each.iter().skip(1).enumerate());
    let more = links.filter(|(_, value)| **value != foot).map(|(link, value)| grows(Some(link), value - foot));
    Ok(std::iter::once(grows(None, foot)).chain(more).collect())
}

/// The joint or link that the effect sits on.
fn place(file: &EffectToml, kind: &KindKeys, key: &str, arm: &Arm) -> Checked<Option<usize>> {
    let missing = |name: &str, what: &str| {
        let (found, remedy) = (format!("`{name}` is missing"), format!("add `{name} = \"…\"`"));
        Err(Invalid::new(format!("{key}.{name}"), found, format!("the name of a {what}"), remedy))
    };
    match kind.place {
        Place::Nowhere => Ok(None),
        Place::Joint | Place::TurningJoint => {
            let Some(name) = &file.joint else {
                return missing("joint", "joint");
            };
            let path = format!("{key}.joint");
            let joint = joint(name, &path, arm)?;
            if kind.place == Place::TurningJoint && arm.chain.joints[joint].kind != JointKind::Revolute {
                let found = format!("{name:?}, which slides");
                return Err(Invalid::new(path, found, format!("a joint that turns for {}", kind.kind), "name another joint"));
            }
            Ok(Some(joint))
        }
        Place::Link | Place::LinkOrArm => match &file.link {
            Some(name) => link(name, &format!("{key}.link"), arm).map(Some),
            None if kind.place == Place::LinkOrArm => Ok(None),
            None => missing("link", "link"),
        },
    }
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
fn check_keys(file: &EffectToml, kind: &KindKeys, key: &str) -> Checked<()> {
    let table = toml::Value::try_from(file).ok();
    let given: Vec<&str> = table
        .as_ref()
        .and_then(toml::Value::as_table)
        .map(|table| table.keys().map(String::as_str).collect())
        .unwrap_or_default();
    let place: &[&str] = match kind.place {
        Place::TurningJoint | Place::Joint => &["joint"],
        Place::Link | Place::LinkOrArm => &["link"],
        Place::Nowhere => &[],
    };
    let allowed: Vec<&str> = ["kind"].iter().chain(place).chain(kind.required).chain(kind.optional).copied().collect();
    if let Some(foreign) = given.iter().find(|name| !allowed.contains(name)) {
        let found = format!("`{foreign}`, which {} does not have", kind.kind);
        let remedy = suggestion(foreign, &allowed).unwrap_or_else(|| "remove the key, or change the kind".to_owned());
        return Err(Invalid::new(format!("{key}.{foreign}"), found, allowed.join(", "), remedy));
    }
    if let Some(missing) = kind.required.iter().find(|name| !given.contains(name)) {
        let (found, remedy) = (format!("`{missing}` is missing"), format!("add `{missing} = …`"));
        return Err(Invalid::new(key, found, format!("{} needs {}", kind.kind, kind.required.join(", ")), remedy));
    }
    if kind.required.is_empty() && !kind.optional.iter().any(|name| given.contains(name)) {
        let allowed = format!("at least one of {}", kind.optional.join(", "));
        return Err(Invalid::new(key, "no magnitude", allowed, "say how large it is"));
    }
    Ok(())
}
