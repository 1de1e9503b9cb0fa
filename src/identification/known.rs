//! What somebody knows of an arm beforehand: which parts of its geometry are as the file says, which are free, and how far the others may be off.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::prior::{FREE_SHIFT, FREE_TURN};
use crate::arm::Arm;
use crate::arm::chain::FrameErrors;
use crate::units::{ANGLES, LENGTHS, unit_named};

/// What a number that is known is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Place {
    /// Where the arm's root stands in the measurement frame: the same frame.
    Base,
    /// Where the target sits on the tool: at its origin.
    Target,
    /// An error of the joints' frames from the second on, six each: shifts along x, y, z, turns about z, y, x.
    Frame(usize),
}

/// How far something may be off what the file says.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Known {
    /// What.
    pub place: Place,
    /// One sigma, m or rad; zero where it is as the file says.
    pub sigma: f64,
}

/// What can be named.
pub const NAMES: &str = "a joint by its name or number, such as elbow_joint or 3; a part of it, such as 3.zero, 3.length or 3.twist; \
                         zeros, lengths or twists of all joints; base or target";

/// What was said with `--fix`, `--free` and `--prior`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Words<'a> {
    /// Names of what is as the file says.
    pub fix: &'a [String],
    /// Names of what is free.
    pub free: &'a [String],
    /// `NAME=SIGMA`, with a unit.
    pub prior: &'a [String],
}

/// How much a name says of one place: what is said of one joint stands over what is said of all, and of a part over the whole.
type Rank = u8;

/// What `words` say of `arm`, place by place.
///
/// # Errors
/// What is wrong, what is allowed and what to do.
pub fn known(arm: &Arm, words: Words<'_>) -> Result<Vec<Known>, String> {
    let frames = FrameErrors::new(&arm.chain);
    let mut said: BTreeMap<Place, (Rank, f64, String)> = BTreeMap::new();
    let mut say = |option: &str, name: &str, sigma: &dyn Fn(bool) -> Option<f64>| -> Result<(), String> {
        let (rank, places) = places(arm, &frames, name).map_err(|wrong| format!("{option} {name}: {wrong}"))?;
        let mut any = false;
        for place in places {
            let turns = matches!(place, Place::Frame(at) if turns(at));
            let Some(sigma) = sigma(turns) else {
                continue;
            };
            any = true;
            let of = format!("{option} {name}");
            match said.get(&place) {
                Some((before, other, by)) if *before == rank && *other != sigma => {
                    return Err(format!("{of} and {by} say different things of one joint; leave one out"));
                }
                Some((before, ..)) if *before > rank => {}
                _ => {
                    said.insert(place, (rank, sigma, of));
                }
            }
        }
        if any {
            Ok(())
        } else {
            Err(format!("{option} {name}: no part of it has that unit; lengths take mm, zeros and twists deg"))
        }
    };
    for name in words.fix {
        say("--fix", name, &|_| Some(0.0))?;
    }
    for name in words.free {
        if ["base", "target"].contains(&name.as_str()) {
            return Err(format!("--free {name}: it is free unless --fix {name} holds it; leave it out"));
        }
        say("--free", name, &|turns| Some(if turns { FREE_TURN } else { FREE_SHIFT }))?;
    }
    for text in words.prior {
        let wrong = || {
            format!(
                "--prior {text}: a name and one sigma with its unit are needed, such as lengths=0.2mm or elbow_joint.zero=0.5deg"
            )
        };
        let (name, size) = text.split_once('=').ok_or_else(wrong)?;
        let size = size.trim();
        let end = size.find(|c: char| !(c.is_ascii_digit() || ".eE+-".contains(c))).ok_or_else(wrong)?;
        let value: f64 = size[..end].parse().map_err(|_| wrong())?;
        let unit = size[end..].trim();
        let (length, angle) = (unit_named(&LENGTHS, unit), unit_named(&ANGLES, unit));
        if !(value > 0.0 && value.is_finite()) || (length.is_none() && angle.is_none()) {
            return Err(wrong());
        }
        let name = name.trim();
        if ["base", "target"].contains(&name) {
            return Err(format!("--prior {text}: base and target are free, or held with --fix {name}"));
        }
        say("--prior", name, &|turns| {
            let unit = if turns { angle } else { length };
            unit.map(|(_, unit)| value * unit)
        })?;
    }
    Ok(said.into_iter().map(|(place, (_, sigma, _))| Known { place, sigma }).collect())
}

fn turns(at: usize) -> bool {
    at % FrameErrors::PER_FRAME >= 3
}

fn places(arm: &Arm, frames: &FrameErrors, name: &str) -> Result<(Rank, Vec<Place>), String> {
    let part = |word: &str| match word {
        "zero" | "zeros" => Some(0),
        "length" | "lengths" => Some(1),
        "twist" | "twists" => Some(2),
        _ => None,
    };
    let about = |at: &usize, part: usize| match part {
        0 => frames.is_zero(*at),
        1 => !frames.is_zero(*at) && !turns(*at),
        _ => !frames.is_zero(*at) && turns(*at),
    };
    let all = FrameErrors::PER_FRAME * frames.frames();
    match name {
        "base" => return Ok((0, vec![Place::Base])),
        "target" => return Ok((0, vec![Place::Target])),
        _ => {}
    }
    if let (Some(part), true) = (part(name), name.ends_with('s')) {
        return Ok((0, (0..all).filter(|at| about(at, part)).map(Place::Frame).collect()));
    }
    let joint = |name: &str| {
        let number = || name.parse::<usize>().ok()?.checked_sub(1).filter(|joint| *joint < arm.joint_count());
        arm.chain.joints.iter().position(|joint| joint.name == name).or_else(number)
    };
    let of_part = name.rsplit_once('.').and_then(|(of, word)| Some((joint(of)?, Some(part(word)?))));
    let Some((joint, part)) = joint(name).map(|joint| (joint, None)).or(of_part) else {
        let joints: Vec<&str> = arm.chain.joints.iter().map(|joint| joint.name.as_str()).collect();
        return Err(format!("nothing of that name; allowed are {NAMES}; the joints are {}", joints.join(", ")));
    };
    let Some(frame) = joint.checked_sub(1) else {
        return Err("the first joint's frame is where the arm stands, and its zero part of that; --fix base holds it".to_owned());
    };
    let own = FrameErrors::PER_FRAME * frame..FrameErrors::PER_FRAME * (frame + 1);
    let rank = if part.is_some() { 2 } else { 1 };
    Ok((rank, own.filter(|at| part.is_none_or(|part| about(at, part))).map(Place::Frame).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene;

    #[test]
    fn names_are_places_and_what_is_said_of_a_part_stands_over_the_whole() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/arm8.toml");
        let arm = scene::read(path).unwrap().scene.arm;
        let of = |fix: &[&str], free: &[&str], prior: &[&str]| {
            let owned = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
            let (fix, free, prior) = (owned(fix), owned(free), owned(prior));
            known(&arm, Words { fix: &fix, free: &free, prior: &prior })
        };
        let second = of(&["2"], &["2.zero"], &["lengths=0.2mm"]).unwrap();
        let at = |place: Place| second.iter().find(|known| known.place == place).map(|known| known.sigma);
        assert_eq!(at(Place::Frame(0)), Some(0.0));
        assert_eq!(at(Place::Frame(3)), Some(FREE_TURN));
        assert_eq!(at(Place::Frame(6)), Some(2e-4));
        assert_eq!(at(Place::Frame(9)), None);
        assert_eq!(of(&["base"], &[], &[]).unwrap(), [Known { place: Place::Base, sigma: 0.0 }]);
        for (fix, free, prior, message) in [
            (vec!["1"], vec![], vec![], "--fix base holds it"),
            (vec!["elbow"], vec![], vec![], "nothing of that name"),
            (vec!["3"], vec!["3"], vec![], "say different things"),
            (vec![], vec![], vec!["3.zero=1mm"], "no part of it has that unit"),
            (vec![], vec![], vec!["3.zero"], "a name and one sigma"),
            (vec![], vec![], vec!["3.zero=-1deg"], "a name and one sigma"),
            (vec![], vec!["base"], vec![], "leave it out"),
        ] {
            let wrong = of(&fix, &free, &prior).unwrap_err();
            assert!(wrong.contains(message), "{wrong}");
        }
    }
}
