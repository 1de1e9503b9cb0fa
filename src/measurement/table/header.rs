//! The header of a table: what each column is about, and in which unit, under the names that people give them.

use super::{Euler, Hints, Needs};
use crate::units::{ANGLES, LENGTHS, unit_named};

/// What a column is about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Column {
    PoseId,
    /// Seconds per unit; a text may be a date and a time.
    Time {
        factor: f64,
    },
    Joint {
        joint: usize,
        factor: f64,
        is_length: bool,
    },
    /// Ticks of an encoder, whose number per turn somebody says.
    Ticks {
        joint: usize,
    },
    Position {
        axis: usize,
        factor: f64,
    },
    Quaternion {
        component: usize,
    },
    /// An angle of a turn about an axis, or a part of a rotation vector.
    Euler {
        axis: usize,
        factor: f64,
    },
    /// An entry of a rotation matrix.
    Matrix {
        row: usize,
        column: usize,
    },
    Role,
    Temperature {
        sensor: usize,
    },
    Approach {
        joint: usize,
    },
    Ambient,
    Payload,
    Dwell,
    Session,
    Target,
    FixedPoint,
    Plane,
    Gravity {
        axis: usize,
    },
    /// Somebody said that it is not to be read.
    Ignored,
}

pub(super) const ALLOWED: &str = "pose_id, time_s, q1_rad… (or _deg, _m, _mm, _ticks), x_m, y_m, z_m (or _mm, _inch …), qx, qy, qz, qw, \
                                  rx_deg, ry_deg, rz_deg (with --euler), rvec_x …, r11 … r33 (or T00 … T33 with T03_m …), role, target, fixed_point, plane, approach1…, temp_ambient_c, \
                                  temp1_c…, payload_kg, dwell_s, session, gravity_x, gravity_y, gravity_z; joints may have their names in \
                                  the robot's file, units may stand in brackets";

/// The header as it was understood.
#[derive(Debug)]
pub(super) struct Header {
    pub(super) columns: Vec<Column>,
    pub(super) joints: usize,
    pub(super) sensors: usize,
    pub(super) approaches: usize,
    pub(super) orientation: Orientation,
    /// Which of x, y, z have a column.
    pub(super) read: [bool; 3],
    /// What three angles are where their names say it: `rvec_x` is a part of a rotation vector.
    pub(super) implied: Option<Euler>,
    /// What was taken to be meant.
    pub(super) notes: Vec<String>,
}

/// How an orientation is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Orientation {
    None,
    Quaternion,
    Euler,
    Matrix,
}

/// A name in lower case, words joined by underscores, and its unit where one stands in brackets or at its end.
struct Name {
    base: String,
    unit: Option<String>,
}

impl Name {
    fn of(text: &str) -> Name {
        let lower = text.trim().trim_matches(['"', '\'']).to_lowercase();
        let (rest, bracketed) = match (lower.rfind(['[', '(']), lower.ends_with([']', ')'])) {
            (Some(at), true) => {
                let opening = lower[at..].chars().next().map_or(1, char::len_utf8);
                (lower[..at].to_owned(), Some(lower[at + opening..lower.len() - 1].trim().to_owned()))
            }
            _ => (lower.clone(), None),
        };
        let base: String = rest.trim().chars().map(|c| if matches!(c, ' ' | '-' | '.' | '/') { '_' } else { c }).collect();
        if bracketed.is_some() {
            return Name { base: base.trim_end_matches('_').to_owned(), unit: bracketed };
        }
        let is_unit = |unit: &str| {
            unit_named(&LENGTHS, unit).is_some()
                || unit_named(&ANGLES, unit).is_some()
                || matches!(unit, "ticks" | "s" | "ms" | "us" | "ns")
        };
        match base.rsplit_once('_') {
            Some((rest, unit)) if is_unit(unit) && !rest.is_empty() => {
                Name { base: rest.to_owned(), unit: Some(unit.to_owned()) }
            }
            _ => Name { base, unit: None },
        }
    }
}

/// What a column may be beside its plain name.
enum Meant {
    Column(Column),
    /// A joint without a unit.
    Joint(usize),
    NoUnit(String),
    /// It counts the rows.
    Counter,
    Unknown,
}

/// Row and column of an entry of a matrix: `r11`, `m00`, `t_23`.
fn entry(base: &str) -> Option<[usize; 2]> {
    let digits = base.strip_prefix(['r', 'm', 't'])?.trim_start_matches('_').as_bytes();
    match digits {
        [row @ b'0'..=b'4', column @ b'0'..=b'4'] => Some([usize::from(row - b'0'), usize::from(column - b'0')]),
        _ => None,
    }
}

/// The number at the end of `text` behind one of `prefixes`.
fn numbered_name(base: &str, prefixes: &[&str]) -> Option<usize> {
    prefixes.iter().find_map(|prefix| base.strip_prefix(prefix)?.trim_start_matches('_').parse().ok())
}

/// What was added to a joint's name says that it is its reading.
fn bare(base: &str) -> &str {
    ["_position", "_pos", "_angle", "_actual", "_rad", "_deg"].iter().find_map(|end| base.strip_suffix(end)).unwrap_or(base)
}

fn meant(text: &str, joints: &[String], from_zero: bool, matrix_from_zero: bool) -> Meant {
    let Name { base, unit } = Name::of(text);
    let unit = unit.as_deref();
    let own = joints.iter().position(|joint| {
        let joint = joint.to_lowercase();
        joint == text.trim().to_lowercase() || joint == base || joint == bare(&base)
    });
    let number = numbered_name(bare(&base), &["q", "joint", "axis", "theta", "j", "a"])
        .and_then(|number| if from_zero { Some(number) } else { number.checked_sub(1) })
        .filter(|joint| *joint < 1000);
    if let Some(joint) = own.or(number) {
        let as_length = unit.and_then(|unit| unit_named(&LENGTHS, unit).map(|(_, factor)| factor));
        let as_angle = unit.and_then(|unit| unit_named(&ANGLES, unit).map(|(_, factor)| factor));
        return match (unit, as_length, as_angle) {
            (None, ..) => Meant::Joint(joint),
            (Some("ticks" | "counts"), ..) => Meant::Column(Column::Ticks { joint }),
            (_, Some(factor), _) => Meant::Column(Column::Joint { joint, factor, is_length: true }),
            (_, _, Some(factor)) => Meant::Column(Column::Joint { joint, factor, is_length: false }),
            _ => Meant::NoUnit(format!("rad, deg, m, mm or ticks after the name of joint {}", joint + 1)),
        };
    }
    let axis_of = |prefixes: &[&str], names: [&str; 3]| {
        names.iter().position(|name| prefixes.iter().any(|prefix| base == format!("{prefix}{name}")))
    };
    let positions =
        ["", "p", "t", "pos_", "position_", "p_", "t_", "tcp_", "ee_", "translation_", "target_", "measured_", "tvec_", "trans_"];
    if let Some(axis) = axis_of(&positions, ["x", "y", "z"]) {
        return match unit.and_then(|unit| unit_named(&LENGTHS, unit).map(|(_, factor)| factor)) {
            Some(factor) => Meant::Column(Column::Position { axis, factor }),
            None => Meant::NoUnit(format!("{0}_m, {0}_mm or another length", ["x", "y", "z"][axis])),
        };
    }
    let quaternions = ["q", "q_", "quat_", "quat", "quaternion_", "ori_", "orientation_"];
    let component =
        ["x", "y", "z", "w"].iter().position(|name| quaternions.iter().any(|prefix| base == format!("{prefix}{name}")));
    if let Some(component) = component {
        return Meant::Column(Column::Quaternion { component });
    }
    if let (Some(axis), None) = (axis_of(&["rvec_", "rotvec_"], ["x", "y", "z"]), unit) {
        // OpenCV's and Universal Robots' rotation vectors are in rad.
        return Meant::Column(Column::Euler { axis, factor: 1.0 });
    }
    let turn = axis_of(&["r", "rot_", "rotvec_", "rvec_", "euler_", "r_"], ["x", "y", "z"])
        .or_else(|| ["roll", "pitch", "yaw"].iter().position(|name| base == *name))
        .or_else(|| ["w", "p", "r"].iter().position(|name| base == *name))
        // KUKA: A about z, B about y, C about x.
        .or_else(|| ["c", "b", "a"].iter().position(|name| base == *name));
    if let Some(axis) = turn {
        return match unit.and_then(|unit| unit_named(&ANGLES, unit).map(|(_, factor)| factor)) {
            Some(factor) => Meant::Column(Column::Euler { axis, factor }),
            None => Meant::NoUnit(format!("{base}_deg or {base}_rad")),
        };
    }
    if let Some([row, column]) = entry(&base) {
        let first = usize::from(!matrix_from_zero);
        return match (row.wrapping_sub(first), column.wrapping_sub(first)) {
            (row @ 0..3, column @ 0..3) => Meant::Column(Column::Matrix { row, column }),
            // Of a matrix of four rows the last column is the position, and the last row 0, 0, 0, 1.
            (axis @ 0..3, 3) => match unit.and_then(|unit| unit_named(&LENGTHS, unit).map(|(_, factor)| factor)) {
                Some(factor) => Meant::Column(Column::Position { axis, factor }),
                None => Meant::NoUnit(format!("{0}_m or {0}_mm: it is a position", text.trim())),
            },
            (3, 0..4) => Meant::Column(Column::Ignored),
            _ => Meant::Unknown,
        };
    }
    match (base.as_str(), unit) {
        ("time" | "t" | "timestamp" | "stamp" | "datetime" | "date_time", None | Some("s")) => {
            Meant::Column(Column::Time { factor: 1.0 })
        }
        ("time" | "t" | "timestamp" | "stamp", Some("ms")) => Meant::Column(Column::Time { factor: 1e-3 }),
        ("time" | "t" | "timestamp" | "stamp", Some("us")) => Meant::Column(Column::Time { factor: 1e-6 }),
        ("time" | "t" | "timestamp" | "stamp", Some("ns")) => Meant::Column(Column::Time { factor: 1e-9 }),
        ("sample" | "index" | "idx" | "id" | "no" | "nr" | "number" | "row" | "point" | "measurement" | "reading", None) => {
            Meant::Counter
        }
        _ => Meant::Unknown,
    }
}

/// Columns whose names are those of kincal alone.
fn plain(name: &str) -> Option<Column> {
    let fixed = match name {
        "pose_id" => Some(Column::PoseId),
        "role" => Some(Column::Role),
        "target" => Some(Column::Target),
        "fixed_point" => Some(Column::FixedPoint),
        "plane" => Some(Column::Plane),
        "temp_ambient_c" => Some(Column::Ambient),
        "payload_kg" => Some(Column::Payload),
        "dwell_s" => Some(Column::Dwell),
        "session" => Some(Column::Session),
        _ => None,
    };
    let without_unit = name.strip_suffix("_m_s2").unwrap_or(name);
    let gravity = ["gravity_x", "gravity_y", "gravity_z"].iter().position(|known| *known == without_unit);
    let numbered = |rest: &str| rest.parse::<usize>().ok().filter(|number| (1..=1000).contains(number)).map(|number| number - 1);
    fixed
        .or(gravity.map(|axis| Column::Gravity { axis }))
        .or_else(|| numbered(name.strip_prefix("approach")?).map(|joint| Column::Approach { joint }))
        .or_else(|| numbered(name.strip_prefix("temp")?.strip_suffix("_c")?).map(|sensor| Column::Temperature { sensor }))
}

impl Header {
    /// Understands `names`, for a robot whose joints are called `joints`; `slides` of these.
    ///
    /// # Errors
    /// What is wrong, and what is allowed.
    pub(super) fn new(names: &csv::StringRecord, joints: &[String], slides: &[bool], hints: &Hints) -> Result<Header, String> {
        let ignored = &hints.ignored;
        for (index, name) in names.iter().enumerate() {
            if !name.is_empty() && names.iter().take(index).any(|other| other == name) {
                return Err(format!("column `{name}` stands there twice"));
            }
        }
        if let Some(missing) = ignored.iter().find(|name| !names.iter().any(|known| known == name.as_str())) {
            return Err(format!("--ignore-columns {missing}: the table has no such column"));
        }
        // `q0 … q5` are six joints.
        let zero = |name: &str| {
            matches!(
                meant(name, &[], true, true),
                Meant::Joint(0) | Meant::Column(Column::Joint { joint: 0, .. } | Column::Ticks { joint: 0 })
            )
        };
        let from_zero =
            names.iter().any(|name| zero(name) && !joints.iter().any(|joint| joint.eq_ignore_ascii_case(name.trim())));
        let matrix_from_zero = names.iter().filter_map(|name| entry(&Name::of(name).base)).any(|entry| entry.contains(&0));
        let rotation_vector = |name: &str| ["rvec_", "rotvec_"].iter().any(|prefix| Name::of(name).base.starts_with(prefix));
        let implied = names.iter().any(rotation_vector).then_some(Euler::Vector);
        let mut notes = Vec::new();
        let mut counters: Vec<&str> = Vec::new();
        let mut unitless: Vec<&str> = Vec::new();
        let mut columns = Vec::with_capacity(names.len());
        for name in names {
            if ignored.iter().any(|other| other == name) {
                columns.push(Column::Ignored);
                continue;
            }
            let lower = name.trim().to_lowercase();
            if let Some(column) = plain(&lower) {
                columns.push(column);
                continue;
            }
            columns.push(match meant(name, joints, from_zero, matrix_from_zero) {
                Meant::Column(column) => column,
                // ROS gives joints by their names, in rad and m.
                Meant::Joint(joint) if joints.iter().any(|known| known.eq_ignore_ascii_case(bare(name.trim()))) => {
                    unitless.push(name);
                    Column::Joint { joint, factor: 1.0, is_length: slides.get(joint).copied().unwrap_or(false) }
                }
                Meant::Joint(joint) => {
                    return Err(format!("column `{name}` has no known unit; write q{0}_rad, _deg, _m, _mm or _ticks", joint + 1));
                }
                Meant::Counter => {
                    counters.push(name);
                    Column::Ignored
                }
                Meant::NoUnit(allowed) => return Err(format!("column `{name}` has no known unit; write {allowed}")),
                Meant::Unknown => return Err(unknown(name, joints)),
            });
        }
        if !unitless.is_empty() {
            notes.push(format!("columns {} are taken as rad (m of a joint that slides), as ROS has them", unitless.join(", ")));
        }
        if !counters.is_empty() {
            notes.push(format!(
                "column {} is taken to count the rows, and is not read; pose_id says which rows are repeats",
                counters.join(", ")
            ));
        }
        if from_zero {
            notes.push("joint columns are numbered from 0: the first joint is number 0 in the table, and 1 here".to_owned());
        }
        Ok(Header { implied, ..Header::laid_out(columns, notes, hints.needs)? })
    }

    fn laid_out(columns: Vec<Column>, notes: Vec<String>, needs: Needs) -> Result<Header, String> {
        let joints = numbered(&columns, |column| match column {
            Column::Joint { joint, .. } | Column::Ticks { joint } => Some(*joint),
            _ => None,
        })
        .map_err(|missing| {
            format!("joint columns must be q1, q2, … without a gap, each once: q{} is missing or doubled", missing + 1)
        })?;
        if joints == 0 && needs != Needs::Pose {
            return Err("no joint columns; q1_rad, q2_rad, … (or _deg, _m, _mm) are needed".to_owned());
        }
        let columns_of =
            |axis: usize| columns.iter().filter(|of| matches!(of, Column::Position { axis: its, .. } if *its == axis)).count();
        let of_axes = [0, 1, 2].map(columns_of);
        let is_fixed = columns.iter().any(|column| matches!(column, Column::FixedPoint | Column::Plane));
        if (of_axes == [0; 3] && !is_fixed && needs != Needs::Joints) || of_axes.iter().any(|count| *count > 1) {
            return Err(
                "the measured position needs x_m, y_m, z_m (or _mm), those that were read, each once; or fixed_point or \
                        plane, a label of the unknown place at which the target was"
                    .to_owned(),
            );
        }
        let quaternion = numbered(&columns, |column| match column {
            Column::Quaternion { component } => Some(*component),
            _ => None,
        });
        let euler = numbered(&columns, |column| match column {
            Column::Euler { axis, .. } => Some(*axis),
            _ => None,
        });
        let matrix = numbered(&columns, |column| match column {
            Column::Matrix { row, column } => Some(3 * row + column),
            _ => None,
        });
        let orientation = match (quaternion, euler, matrix) {
            (Ok(0), Ok(0), Ok(0)) => Orientation::None,
            (Ok(4), Ok(0), Ok(0)) => Orientation::Quaternion,
            (Ok(0), Ok(3), Ok(0)) => Orientation::Euler,
            (Ok(0), Ok(0), Ok(9)) => Orientation::Matrix,
            (_, Ok(0), Ok(0)) => return Err("an orientation needs all of qx, qy, qz, qw".to_owned()),
            (Ok(0), _, Ok(0)) => return Err("an orientation needs three angles: rx_deg, ry_deg, rz_deg (or _rad)".to_owned()),
            (Ok(0), Ok(0), _) => return Err("an orientation needs all of r11 … r33".to_owned()),
            _ => {
                return Err(
                    "one orientation is enough: qx, qy, qz, qw, or three angles, or r11 … r33; leave out the others with \
                            --ignore-columns"
                        .to_owned(),
                );
            }
        };
        let sensors = numbered(&columns, |column| match column {
            Column::Temperature { sensor } => Some(*sensor),
            _ => None,
        })
        .map_err(|missing| {
            format!("temperature columns must be temp1_c, temp2_c, … without a gap: temp{}_c is missing", missing + 1)
        })?;
        let approaches = numbered(&columns, |column| match column {
            Column::Approach { joint } => Some(*joint),
            _ => None,
        });
        let approaches = match approaches {
            Ok(0) => 0,
            Ok(count) if count == joints => count,
            _ => return Err(format!("directions of approach need approach1 … approach{joints}: one column per joint, or none")),
        };
        let axes = numbered(&columns, |column| match column {
            Column::Gravity { axis } => Some(*axis),
            _ => None,
        });
        if !matches!(axes, Ok(0 | 3)) {
            return Err("gravity needs all of gravity_x, gravity_y, gravity_z (m/s²), or none".to_owned());
        }
        let read = of_axes.map(|count| count == 1);
        Ok(Header { columns, joints, sensors, approaches, orientation, read, implied: None, notes })
    }
}

/// Why `name` is no column.
fn unknown(name: &str, joints: &[String]) -> String {
    match name {
        _ if name.split_whitespace().count() > 3 && !name.contains(['[', '(']) => {
            "columns that are separated by blanks: separate them by commas, semicolons or tabs".to_owned()
        }
        "" => "a column without a name: is there a separator at the end of the line?".to_owned(),
        _ if name.replace(',', ".").parse::<f64>().is_ok() => {
            format!("a number (`{name}`) where the names of the columns should be: the header is missing")
        }
        _ => {
            let short: String = name.chars().take(60).collect();
            let own = if joints.is_empty() { String::new() } else { format!("; those of this robot are {}", joints.join(", ")) };
            format!("unknown column `{short}`: rename it, or leave it out with --ignore-columns; known are {ALLOWED}{own}")
        }
    }
}

/// How many of 0, 1, 2, … occur, each once; the first that does not otherwise.
fn numbered(columns: &[Column], number: impl Fn(&Column) -> Option<usize>) -> Result<usize, usize> {
    let mut numbers: Vec<usize> = columns.iter().filter_map(number).collect();
    numbers.sort_unstable();
    match numbers.iter().enumerate().find(|(index, number)| index != *number) {
        Some((missing, _)) => Err(missing),
        None => Ok(numbers.len()),
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    fn header(names: &[&str]) -> Result<Header, String> {
        let ignored = names.iter().filter(|name| **name == "note").map(|name| (*name).to_owned()).collect();
        let joints = ["shoulder_pan_joint".to_owned(), "elbow_joint".to_owned()];
        Header::new(&csv::StringRecord::from(names.to_vec()), &joints, &[false, false], &Hints { ignored, ..Hints::default() })
    }

    #[test]
    fn columns_are_known_under_the_names_that_people_give_them() {
        let joint = |joint, factor| Column::Joint { joint, factor, is_length: false };
        let at = |axis, factor| Column::Position { axis, factor };
        let degree = PI / 180.0;
        for (names, expected) in [
            (
                ["J1 [deg]", "J2 [deg]", "X (mm)", "Y (mm)", "Z (mm)"],
                [joint(0, degree), joint(1, degree), at(0, 1e-3), at(1, 1e-3), at(2, 1e-3)],
            ),
            (
                ["elbow_joint", "shoulder_pan_joint", "pos_x [m]", "pos_y [m]", "pos_z [m]"],
                [joint(1, 1.0), joint(0, 1.0), at(0, 1.0), at(1, 1.0), at(2, 1.0)],
            ),
            (
                ["q0_rad", "q1_rad", "tx_inch", "ty_inch", "tz_inch"],
                [joint(0, 1.0), joint(1, 1.0), at(0, 0.0254), at(1, 0.0254), at(2, 0.0254)],
            ),
            (
                ["joint_1_deg", "Joint 2 (rad)", "x_m", "y_cm", "z_um"],
                [joint(0, degree), joint(1, 1.0), at(0, 1.0), at(1, 1e-2), at(2, 1e-6)],
            ),
            (
                ["A1 [°]", "A2 [°]", "x_m", "y_m", "note"],
                [joint(0, degree), joint(1, degree), at(0, 1.0), at(1, 1.0), Column::Ignored],
            ),
        ] {
            assert_eq!(header(&names).unwrap().columns, expected, "{names:?}");
        }
        let all = header(&["q1_rad", "q2_ticks", "x_m", "Timestamp", "roll [deg]", "pitch [deg]", "yaw [deg]"]).unwrap();
        assert_eq!((all.orientation, all.read), (Orientation::Euler, [true, false, false]));
        assert_eq!(
            header(&["q1_rad", "x_m", "r11", "r12", "r13", "r21", "r22", "r23", "r31", "r32", "r33"]).unwrap().orientation,
            Orientation::Matrix
        );
        // OpenCV's, a matrix of four rows counted from zero, and a count of the rows.
        let board =
            header(&["sample", "q1_rad", "tvec_x [m]", "tvec_y [m]", "tvec_z [m]", "rvec_x", "rvec_y", "rvec_z"]).unwrap();
        assert_eq!(
            (board.orientation, board.implied, board.columns[0]),
            (Orientation::Euler, Some(Euler::Vector), Column::Ignored)
        );
        assert!(board.notes[0].contains("column sample is taken to count the rows"), "{:?}", board.notes);
        for first in [0, 1] {
            let entries = (first..first + 4).flat_map(|row| (first..first + 4).map(move |column| (row, column)));
            let name = |(row, column): (usize, usize)| {
                let unit = if column == first + 3 && row < first + 3 { " [mm]" } else { "" };
                format!("T{row}{column}{unit}")
            };
            let names: Vec<String> = std::iter::once("q1_rad".to_owned()).chain(entries.map(name)).collect();
            let whole = header(&names.iter().map(String::as_str).collect::<Vec<_>>()).unwrap();
            assert_eq!((whole.orientation, whole.read), (Orientation::Matrix, [true; 3]));
            assert_eq!((whole.columns[1], whole.columns[4]), (Column::Matrix { row: 0, column: 0 }, at(0, 1e-3)));
            assert_eq!(whole.columns[16], Column::Ignored);
        }
        for (names, expected) in [
            (["q1_rad", "T03"], "`T03` has no known unit; write T03_m or T03_mm: it is a position"),
            (["q1", "x_m"], "`q1` has no known unit; write q1_rad, _deg"),
            (["q1_rad", "x"], "`x` has no known unit; write x_m, x_mm"),
            (["q1_rad", "foo"], "unknown column `foo`: rename it, or leave it out with --ignore-columns"),
            (["q1_rad", "foo"], "those of this robot are shoulder_pan_joint, elbow_joint"),
            (["q1_rad q2_rad x_m y_m z_m", "foo"], "separated by blanks"),
            (["q1_rad", "1.5"], "the header is missing"),
        ] {
            let error = header(&names).unwrap_err();
            assert!(error.contains(expected), "{error}");
        }
    }
}
