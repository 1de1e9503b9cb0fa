//! What a table got wrong, as a correction that can be written on a command line and applied to its rows.

use std::fmt;
use std::str::FromStr;

use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

use crate::measurement::Measurement;
use crate::measurement::table::Euler;
use crate::units::{ANGLES, LENGTHS, unit_named};

/// A correction of a table. Joints and readings count from 0 here, from 1 in words.
#[derive(Clone, Debug, PartialEq)]
pub enum Fix {
    /// Column `k` holds joint `order[k]`.
    Order(Vec<usize>),
    /// These joints count the other way round.
    Reverse(Vec<usize>),
    /// The column of `joint` holds `joint + sign · other`.
    Couple {
        /// The joint of the column.
        joint: usize,
        /// What is added to it.
        other: usize,
        /// 1 or -1.
        sign: f64,
    },
    /// The readings of a joint are to be multiplied by this.
    Factor(usize, f64),
    /// This is to be added to the readings of a joint, rad or m.
    Zero(usize, f64),
    /// Angles are in this unit, whatever the columns say.
    Angles(&'static str),
    /// Positions are in this unit, whatever the columns say.
    Positions(&'static str),
    /// Positions are to be multiplied by this.
    Scale(f64),
    /// Of one axis.
    PositionsOf(usize, &'static str),
    /// x, y, z of a right-handed frame are these columns, with these signs; of positions alone.
    Axes([(usize, f64); 3]),
    /// Poses are of the measurement frame in the target's.
    Inverse,
    /// Quaternions stand in the order w, x, y, z.
    RealPartFirst,
    /// Quaternions turn the other way.
    Conjugate,
    /// Three angles make an orientation in this way.
    Angled(Euler),
    /// From this reading on, poses belong to the joints so many rows further down.
    Shift(usize, isize),
    /// These readings are to be left out.
    Drop(Vec<usize>),
}

/// Units that a table's columns say: what a number was multiplied by, rad and m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Said {
    /// Of joints that turn.
    pub angle: f64,
    /// Of positions.
    pub position: [f64; 3],
    /// How three angles were taken to make orientations; absent where there are none.
    pub euler: Option<Euler>,
}

impl Default for Said {
    fn default() -> Self {
        Said { angle: 1.0, position: [1.0; 3], euler: None }
    }
}

impl Fix {
    /// Applies it to `rows`, of an arm of whose joints `slides` says which slide.
    ///
    /// # Errors
    /// If it is about joints, readings or orientations that are not there.
    pub fn apply(&self, rows: &mut Vec<Measurement>, said: &Said, slides: &[bool]) -> Result<(), String> {
        let count = slides.len();
        let joint_in = |joint: usize| {
            if joint < count { Ok(()) } else { Err(format!("joint {}: there are {count} joints", joint + 1)) }
        };
        let oriented = |rows: &[Measurement]| {
            if rows.iter().all(|row| row.orientation_xyzw.is_some()) {
                Ok(())
            } else {
                Err("the table has no orientations".to_owned())
            }
        };
        match self {
            Fix::Order(order) => {
                let mut sorted = order.clone();
                sorted.sort_unstable();
                if sorted != (0..count).collect::<Vec<_>>() {
                    return Err(format!("each of the joints 1 to {count} is needed once"));
                }
                for row in rows {
                    let read = row.joints.clone();
                    order.iter().zip(read).for_each(|(joint, value)| row.joints[*joint] = value);
                    // Sides of approach have columns of their own, whose numbers are believed.
                }
            }
            Fix::Reverse(joints) => {
                joints.iter().try_for_each(|joint| joint_in(*joint))?;
                for row in rows {
                    for joint in joints {
                        row.joints[*joint] = -row.joints[*joint];
                        if let Some(side) = row.approach.get_mut(*joint) {
                            *side = -*side;
                        }
                    }
                }
            }
            Fix::Couple { joint, other, sign } => {
                joint_in(*joint)?;
                joint_in(*other)?;
                rows.iter_mut().for_each(|row| row.joints[*joint] -= sign * row.joints[*other]);
            }
            Fix::Factor(joint, factor) => {
                joint_in(*joint)?;
                rows.iter_mut().for_each(|row| row.joints[*joint] *= factor);
            }
            Fix::Zero(joint, zero) => {
                joint_in(*joint)?;
                rows.iter_mut().for_each(|row| row.joints[*joint] += zero);
            }
            Fix::Angles(name) => {
                let factor = unit_named(&ANGLES, name).map_or(1.0, |(_, unit)| unit) / said.angle;
                for row in rows {
                    for (value, slides) in row.joints.iter_mut().zip(slides) {
                        *value *= if *slides { 1.0 } else { factor };
                    }
                }
            }
            Fix::Positions(name) => {
                let unit = unit_named(&LENGTHS, name).map_or(1.0, |(_, unit)| unit);
                for row in rows {
                    (0..3).for_each(|axis| row.position_m[axis] *= unit / said.position[axis]);
                }
            }
            Fix::Scale(factor) => rows.iter_mut().for_each(|row| row.position_m = row.position_m.map(|value| value * factor)),
            Fix::PositionsOf(axis, name) => {
                let unit = unit_named(&LENGTHS, name).map_or(1.0, |(_, unit)| unit);
                rows.iter_mut().for_each(|row| row.position_m[*axis] *= unit / said.position[*axis]);
            }
            Fix::Axes(axes) => {
                for row in rows {
                    let (read, unread) = (row.position_m, row.unread);
                    for (to, (from, sign)) in axes.iter().enumerate() {
                        row.position_m[to] = sign * read[*from];
                        row.unread[to] = unread[*from];
                    }
                }
            }
            Fix::Inverse => {
                oriented(rows)?;
                for row in rows {
                    let turn = row.orientation().unwrap_or_default().inverse();
                    row.position_m = (-(turn * Vector3::from(row.position_m))).into();
                    row.orientation_xyzw = Some(turn.coords.into());
                }
            }
            Fix::RealPartFirst => {
                oriented(rows)?;
                for row in rows {
                    row.orientation_xyzw = row.orientation_xyzw.map(|[w, x, y, z]| [x, y, z, w]);
                }
            }
            Fix::Conjugate => {
                oriented(rows)?;
                for row in rows {
                    row.orientation_xyzw = row.orientation_xyzw.map(|[x, y, z, w]| [-x, -y, -z, w]);
                }
            }
            Fix::Angled(euler) => {
                for row in rows {
                    let angles = row.angles_rad.ok_or("the table has no three angles that make an orientation")?;
                    row.orientation_xyzw = Some(euler.turn(angles).coords.into());
                }
            }
            Fix::Shift(first, by) => {
                if *first >= rows.len() || by.unsigned_abs() >= rows.len() || *by == 0 {
                    return Err(format!("there are {} readings", rows.len()));
                }
                let read = rows.clone();
                // What was before the shift keeps its pose; beyond, a pose finds its joints further down, or is lost.
                let kept = read[..*first].iter().cloned();
                let moved = (*first..read.len()).filter_map(|row| {
                    let from = row.checked_add_signed(*by).filter(|from| *from >= *first && *from < read.len())?;
                    let pose = &read[row];
                    Some(Measurement {
                        position_m: pose.position_m,
                        unread: pose.unread,
                        orientation_xyzw: pose.orientation_xyzw,
                        angles_rad: pose.angles_rad,
                        ..read[from].clone()
                    })
                });
                *rows = kept.chain(moved).collect();
                rows.iter_mut().enumerate().for_each(|(index, row)| row.index = index);
            }
            Fix::Drop(readings) => {
                if let Some(missing) = readings.iter().find(|reading| **reading >= rows.len()) {
                    return Err(format!("reading {}: there are {}", missing + 1, rows.len()));
                }
                let mut number = 0;
                rows.retain(|_| {
                    number += 1;
                    !readings.contains(&(number - 1))
                });
                rows.iter_mut().enumerate().for_each(|(index, row)| row.index = index);
            }
        }
        Ok(())
    }

    /// What it says of the table, as half a sentence: "the joint columns stand in the order 1, 2, 4, 5, 3, 6". `names` of the joints.
    #[must_use]
    pub fn words(&self, names: &[String]) -> String {
        let name = |joint: &usize| names.get(*joint).map_or_else(|| format!("{}", joint + 1), |name| format!("`{name}`"));
        let listed = |joints: &[usize]| joints.iter().map(name).collect::<Vec<_>>().join(", ");
        match self {
            Fix::Order(order) => {
                let numbers: Vec<String> = order.iter().map(|joint| (joint + 1).to_string()).collect();
                format!("the joint columns hold the joints in the order {}", numbers.join(" "))
            }
            Fix::Reverse(joints) if joints.len() == 1 => format!("joint {} counts the other way round", listed(joints)),
            Fix::Reverse(joints) => format!("joints {} count the other way round", listed(joints)),
            Fix::Couple { joint, other, sign } => format!(
                "the column of joint {} holds its angle {} that of joint {}",
                name(joint),
                if *sign > 0.0 { "plus" } else { "minus" },
                name(other)
            ),
            Fix::Factor(joint, factor) => {
                format!("joint {} turns {factor} times what is read (a gear ratio or a unit)", name(joint))
            }
            Fix::Zero(joint, zero) => format!(
                "joint {} reads {:.3}° too {}",
                name(joint),
                zero.to_degrees().abs(),
                if *zero > 0.0 { "low" } else { "high" }
            ),
            Fix::Angles(unit) => format!("the joint angles are {}, whatever the columns say", spelt(unit)),
            Fix::Positions(unit) => format!("the positions are {}, whatever the columns say", spelt(unit)),
            Fix::Scale(factor) if *factor > 1.0 => format!("the positions are {factor} times too small"),
            Fix::Scale(factor) => format!("the positions are {} times too large", (1e4 / factor).round() / 1e4),
            Fix::PositionsOf(axis, unit) => {
                format!("{} of the positions is {}, whatever the column says", ["x", "y", "z"][*axis], spelt(unit))
            }
            Fix::Axes(_) => {
                "the measurement frame is left-handed or mirrored: an axis has the wrong sign, or two are swapped".to_owned()
            }
            Fix::Inverse => {
                "the poses are those of the measurement frame in the target's: the inverse of what is wanted".to_owned()
            }
            Fix::RealPartFirst => "the quaternions stand in the order w, x, y, z".to_owned(),
            Fix::Conjugate => "the quaternions are conjugate: they turn the other way".to_owned(),
            Fix::Angled(Euler::Vector) => "the three angles are a rotation vector (axis times angle)".to_owned(),
            Fix::Angled(euler) => {
                let named = match euler {
                    Euler::Turns { axes: [0, 1, 2], moving: false } => " (roll, pitch, yaw; KUKA's A, B, C; FANUC's W, P, R)",
                    _ => "",
                };
                format!("the three angles are turns about fixed axes in the order {euler}{named}")
            }
            Fix::Shift(first, by) => format!(
                "from reading {} on, joints stand beside the pose of {} {} {}",
                first + 1,
                by.unsigned_abs(),
                if by.unsigned_abs() == 1 { "row" } else { "rows" },
                if *by > 0 { "later" } else { "before" }
            ),
            Fix::Drop(readings) => {
                let numbers: Vec<String> = readings.iter().map(|reading| (reading + 1).to_string()).collect();
                format!("readings {} do not belong", numbers.join(", "))
            }
        }
    }
}

fn spelt(unit: &str) -> &str {
    match unit {
        "m" => "metres",
        "mm" => "millimetres",
        "cm" => "centimetres",
        "um" => "micrometres",
        "inch" => "inches",
        "ft" => "feet",
        "rad" => "rad",
        "deg" => "degrees",
        "turn" => "turns",
        "mrad" => "mrad",
        other => other,
    }
}

impl fmt::Display for Fix {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let list = |all: &[usize]| all.iter().map(|one| (one + 1).to_string()).collect::<Vec<_>>().join(",");
        match self {
            Fix::Order(order) => write!(f, "order:{}", list(order)),
            Fix::Reverse(joints) => write!(f, "reverse:{}", list(joints)),
            Fix::Couple { joint, other, sign } => {
                write!(f, "couple:{}{}{}", joint + 1, if *sign > 0.0 { '+' } else { '-' }, other + 1)
            }
            Fix::Factor(joint, factor) => write!(f, "factor:{}={factor}", joint + 1),
            Fix::Zero(joint, zero) => write!(f, "zero:{}={}", joint + 1, (zero.to_degrees() * 1e4).round() / 1e4),
            Fix::Angles(unit) => write!(f, "angles:{unit}"),
            Fix::Positions(unit) => write!(f, "positions:{unit}"),
            Fix::Scale(factor) => write!(f, "positions:{factor}"),
            Fix::PositionsOf(axis, unit) => write!(f, "{}:{unit}", ["x", "y", "z"][*axis]),
            Fix::Axes(axes) => {
                let one =
                    |(axis, sign): &(usize, f64)| format!("{}{}", if *sign < 0.0 { "-" } else { "" }, ["x", "y", "z"][*axis]);
                write!(f, "axes:{}", axes.iter().map(one).collect::<Vec<_>>().join(","))
            }
            Fix::Inverse => f.write_str("pose:inverse"),
            Fix::RealPartFirst => f.write_str("quaternion:wxyz"),
            Fix::Conjugate => f.write_str("quaternion:conjugate"),
            Fix::Angled(euler) => write!(f, "euler:{euler}"),
            Fix::Shift(first, by) => write!(f, "shift:{}={by:+}", first + 1),
            Fix::Drop(readings) => write!(f, "drop:{}", list(readings)),
        }
    }
}

/// What can be written.
pub const GRAMMAR: &str = "order:1,2,4,5,3,6 (which joint each column holds), reverse:2,5, couple:3+2 (column 3 holds joint 3 plus joint 2), \
                           factor:4=0.5, zero:3=90 (degrees to be added), angles:deg, positions:inch, positions:39.37 (a factor), z:cm, axes:x,-y,z, pose:inverse, \
                           quaternion:wxyz, quaternion:conjugate, euler:xyz (or rotvec …), shift:31=+2 (from reading 31 on, a pose belongs to the joints two rows \
                           further down), drop:5,17";

impl FromStr for Fix {
    type Err = String;

    fn from_str(text: &str) -> Result<Fix, String> {
        let wrong = || format!("`{text}` is no correction; allowed are {GRAMMAR}");
        let (what, how) = text.split_once(':').ok_or_else(wrong)?;
        let (what, how) = (what.trim(), how.trim());
        let number = |text: &str| text.trim().parse::<usize>().ok().and_then(|number| number.checked_sub(1));
        let list = || how.split(',').map(number).collect::<Option<Vec<usize>>>().ok_or_else(wrong);
        let pair = || how.split_once('=').and_then(|(joint, value)| Some((number(joint)?, value.trim()))).ok_or_else(wrong);
        let finite = |text: &str| text.parse::<f64>().ok().filter(|value| value.is_finite()).ok_or_else(wrong);
        let of_unit = |units: &[(&'static [&'static str], f64)]| unit_named(units, how).map(|(name, _)| name).ok_or_else(wrong);
        Ok(match what {
            "order" => Fix::Order(list()?),
            "reverse" => Fix::Reverse(list()?),
            "euler" => Fix::Angled(how.parse().map_err(|_| wrong())?),
            "couple" => {
                let at = how.find(['+', '-']).ok_or_else(wrong)?;
                let sign = if how.as_bytes()[at] == b'+' { 1.0 } else { -1.0 };
                let (joint, other) = (number(&how[..at]).ok_or_else(wrong)?, number(&how[at + 1..]).ok_or_else(wrong)?);
                if joint == other {
                    return Err(wrong());
                }
                Fix::Couple { joint, other, sign }
            }
            "factor" => {
                let (joint, value) = pair()?;
                Fix::Factor(joint, finite(value)?)
            }
            "zero" => {
                let (joint, value) = pair()?;
                Fix::Zero(joint, finite(value)?.to_radians())
            }
            "angles" => Fix::Angles(of_unit(&ANGLES)?),
            "positions" => match how.parse::<f64>() {
                Ok(factor) if factor.is_finite() && factor > 0.0 => Fix::Scale(factor),
                _ => Fix::Positions(of_unit(&LENGTHS)?),
            },
            "x" | "y" | "z" => {
                Fix::PositionsOf(["x", "y", "z"].iter().position(|axis| *axis == what).unwrap_or(0), of_unit(&LENGTHS)?)
            }
            "axes" => {
                let axis = |text: &str| {
                    let text = text.trim();
                    let (sign, name) = text.strip_prefix('-').map_or((1.0, text), |rest| (-1.0, rest));
                    ["x", "y", "z"].iter().position(|axis| *axis == name).map(|axis| (axis, sign))
                };
                let axes = how.split(',').map(axis).collect::<Option<Vec<_>>>().ok_or_else(wrong)?;
                let axes: [(usize, f64); 3] = axes.try_into().map_err(|_| wrong())?;
                if (0..3).any(|axis| !axes.iter().any(|(of, _)| *of == axis)) {
                    return Err(wrong());
                }
                Fix::Axes(axes)
            }
            "pose" if how == "inverse" => Fix::Inverse,
            "quaternion" if how == "wxyz" => Fix::RealPartFirst,
            "quaternion" if how == "conjugate" => Fix::Conjugate,
            "shift" => {
                let (first, by) = pair()?;
                let by = by.parse::<isize>().ok().filter(|by| *by != 0).ok_or_else(wrong)?;
                Fix::Shift(first, by)
            }
            "drop" => Fix::Drop(list()?),
            _ => return Err(wrong()),
        })
    }
}

/// The matrix of a unit quaternion `[x, y, z, w]`.
pub(super) fn matrix(quaternion: [f64; 4]) -> Matrix3<f64> {
    let [x, y, z, w] = quaternion;
    Rotation3::from(UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z))).into_inner()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_again() {
        for text in [
            "order:1,2,4,5,3,6",
            "reverse:2,5",
            "couple:3+2",
            "couple:3-2",
            "factor:4=0.5",
            "zero:3=-90",
            "angles:deg",
            "positions:inch",
            "positions:39.37",
            "z:cm",
            "axes:x,-y,z",
            "pose:inverse",
            "quaternion:wxyz",
            "quaternion:conjugate",
            "shift:31=+2",
            "shift:3=-1",
            "drop:5,17",
        ] {
            let fix: Fix = text.parse().unwrap();
            assert_eq!(fix.to_string(), text);
        }
        for wrong in [
            "",
            "order",
            "order:",
            "order:0",
            "reverse:x",
            "couple:3",
            "couple:3+3",
            "zero:3",
            "zero:3=nan",
            "angles:mm",
            "axes:x,y",
            "axes:x,x,y",
            "shift:1=0",
            "drop:",
            "pose:other",
        ] {
            assert!(wrong.parse::<Fix>().unwrap_err().contains("is no correction; allowed are order:"), "{wrong}");
        }
    }

    #[test]
    fn corrections_undo_what_was_done() {
        let rows: Vec<Measurement> = (0..6)
            .map(|index| Measurement {
                index,
                joints: (0..3).map(|joint| f64::from(10 * joint) + index as f64).collect(),
                position_m: [index as f64, 1.0, 2.0],
                orientation_xyzw: Some([0.0, 0.6, 0.0, 0.8]),
                ..Measurement::default()
            })
            .collect();
        let fixed = |text: &str, mut rows: Vec<Measurement>| {
            text.parse::<Fix>()
                .unwrap()
                .apply(&mut rows, &Said { angle: 1.0, position: [1e-3; 3], euler: None }, &[false; 3])
                .unwrap();
            rows
        };
        let mut wrong = rows.clone();
        wrong.iter_mut().for_each(|row| row.joints = vec![row.joints[0], row.joints[2], row.joints[1]]);
        assert_eq!(fixed("order:1,3,2", wrong), rows);
        let mut wrong = rows.clone();
        wrong.iter_mut().for_each(|row| row.joints[2] += row.joints[1]);
        assert_eq!(fixed("couple:3+2", wrong), rows);
        assert_eq!(
            fixed("quaternion:wxyz", fixed("quaternion:wxyz", rows.clone()))[0].orientation_xyzw,
            Some([0.0, 0.8, 0.0, 0.6])
        );
        assert_eq!(fixed("positions:inch", rows.clone())[2].position_m[0], 2.0 * 0.0254 / 1e-3);
        // From reading 3 on joints stand beside the pose of two rows later.
        let mut wrong = rows.clone();
        for (row, wrong) in wrong.iter_mut().enumerate().skip(2) {
            wrong.position_m = [(row + 2) as f64, 1.0, 2.0];
        }
        let fixed_rows = fixed("shift:3=+2", wrong);
        assert_eq!(fixed_rows.len(), 4);
        assert!(fixed_rows.iter().all(|row| row.position_m[0] == row.joints[0]), "{fixed_rows:?}");
        assert!("drop:9".parse::<Fix>().unwrap().apply(&mut rows.clone(), &Said::default(), &[false; 3]).is_err());
        assert!("reverse:4".parse::<Fix>().unwrap().apply(&mut rows.clone(), &Said::default(), &[false; 3]).is_err());
    }
}
