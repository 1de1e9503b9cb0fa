//! Measurement tables (CSV): what a real cell writes down.
//!
//! A header names the columns and their units; `#` starts a comment line; columns stand in any order; an unknown column is an error. Columns
//! are separated by commas, semicolons or tabs, numbers may have decimal commas, the file may be UTF-8 or UTF-16.
//! `pose_id`, `time_s`, `q1_rad`…`qN_rad` (or `_deg`; `_m`, `_mm` for prismatic joints), `x_m, y_m, z_m` (or `_mm`; those that were
//! read, a cell may be empty), optional `qx, qy, qz, qw`, `role` (`fit`, `held_out`), and the conditions: `approach1`… (-1, 0, 1), `temp_ambient_c`, `temp1_c`…, `payload_kg`,
//! `dwell_s`, `session`, `target`, `gravity_x, gravity_y, gravity_z` (m/s², in the robot's root). Rows are in the order of measuring unless
//! the comment `# order: unknown` stands in the file.

mod header;
mod sense;
mod text;

use std::path::Path;

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use header::{Column, Header, Orientation};

use super::{Distance, Measurement, Role};
use crate::arm::frames::rotation_from_vector;

/// A table that has been read.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Rows in the order of the file.
    pub measurements: Vec<Measurement>,
    /// Of each joint column, whether its unit is a length.
    pub joint_is_length: Vec<bool>,
    /// What the numbers of joints that turn were multiplied by, rad per unit; of those that slide, m per unit.
    pub joint_factor: Vec<f64>,
    /// The same of positions, m per unit.
    pub position_factor: [f64; 3],
    /// How three angles were taken to make orientations; absent where no angles were read.
    pub euler: Option<Euler>,
    /// Columns of conditions: an identification uses [`TO_IDENTIFY`] of them, a diagnosis all.
    pub conditions: Vec<String>,
    /// What was taken to be meant, and rows that were left out.
    pub notes: Vec<String>,
    /// Whether the order of measuring is known: that of the rows, or of their times.
    pub in_order: bool,
}

/// A joint that moves by less has not moved, rad or m: joint readings come back rounded, or as encoders see them.
pub(crate) const MOVED: f64 = 2e-4;

impl Table {
    /// Orientations are what they were taken to be from here on: the angles that they were read as are not recorded.
    pub fn forget_angles(&mut self) {
        self.measurements.iter_mut().for_each(|row| row.angles_rad = None);
    }

    /// Where no sides of approach were recorded and rows are in the order of measuring, fills them in: a joint comes from where it was in
    /// the row before, or where it stays, from where it came last. Returns whether it did.
    pub fn fill_in_approach(&mut self) -> bool {
        let rows = &mut self.measurements;
        if !self.in_order || rows.len() < 2 || rows.iter().any(|row| !row.approach.is_empty()) {
            return false;
        }
        let mut order: Vec<usize> = (0..rows.len()).collect();
        order.sort_by(|a, b| rows[*a].time_s.total_cmp(&rows[*b].time_s).then(a.cmp(b)));
        let mut before: Option<usize> = None;
        for row in order {
            let last = before.filter(|last| rows[*last].session == rows[row].session);
            let side = |joint: usize| -> i8 {
                let Some(last) = last.map(|last| &rows[last]) else {
                    return 0;
                };
                let moved = rows[row].joints[joint] - last.joints[joint];
                if moved.abs() < MOVED { last.approach[joint] } else { moved.signum() as i8 }
            };
            rows[row].approach = (0..rows[row].joints.len()).map(side).collect();
            before = Some(row);
        }
        true
    }

    /// Gravity in the robot's root, m/s², for all rows.
    ///
    /// # Errors
    /// If it is none, or the table has columns of its own.
    pub fn set_gravity(&mut self, gravity: [f64; 3]) -> Result<(), String> {
        if self.measurements.iter().any(|row| row.gravity_m_s2.is_some()) {
            return Err("the table has gravity_x, gravity_y, gravity_z: one of both is enough".to_owned());
        }
        let gravity = free_fall(gravity)?;
        self.measurements.iter_mut().for_each(|row| row.gravity_m_s2 = Some(gravity));
        Ok(())
    }
}

/// Free fall, m/s².
const FREE_FALL: f64 = 9.81;
/// A tilt sensor's length may be off by so much: its direction counts.
const OFF: f64 = 0.05;

/// Gravity of the usual length in the direction of `read`.
fn free_fall(read: [f64; 3]) -> Result<[f64; 3], String> {
    let length = read.iter().map(|value| value * value).sum::<f64>().sqrt();
    if (length / FREE_FALL - 1.0).abs() <= OFF {
        return Ok(read.map(|value| value * FREE_FALL / length));
    }
    let hint = if (length - 1.0).abs() <= OFF { ": these seem to be multiples of g" } else { "" };
    Err(format!("gravity is {length:.3} m/s² long; {FREE_FALL} is needed{hint}"))
}

/// Conditions that an identification uses: which base, and which point of the tool.
pub const TO_IDENTIFY: [&str; 2] = ["session", "target"];

/// A table that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// The file cannot be read.
    #[error("cannot read {file}: {source}; give {wanted}")]
    Unreadable {
        /// Path.
        file: String,
        /// Cause.
        source: std::io::Error,
        /// What is needed.
        wanted: &'static str,
    },
    /// Something in the header or a row is wrong.
    #[error("{file}, line {line}: {message}")]
    Wrong {
        /// Path.
        file: String,
        /// Line, from 1.
        line: u64,
        /// What was found, what is allowed.
        message: String,
    },
}

/// Reads known distances of fixed points: `point_a,point_b,distance_mm,sigma_mm` (or `_m`).
///
/// # Errors
/// If the file cannot be read, or names the line and what is wrong with it.
pub fn read_distances(path: impl AsRef<Path>) -> Result<Vec<Distance>, TableError> {
    let file = path.as_ref().display().to_string();
    let text = crate::files::text(path.as_ref(), crate::files::LARGEST_TABLE).map_err(|source| TableError::Unreadable {
        file: file.clone(),
        source,
        wanted: "a table of distances (.csv)",
    })?;
    let wrong = |line, message| TableError::Wrong { file: file.clone(), line, message };
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(text.as_bytes());
    let header = reader.headers().map_err(|error| wrong(1, error.to_string()))?.clone();
    let column = |name: &str| header.iter().position(|known| known == name);
    let length = |name: &str| {
        [("_mm", 1e-3), ("_m", 1.0)].into_iter().find_map(|(end, unit)| Some((column(&format!("{name}{end}"))?, unit)))
    };
    let (Some(a), Some(b), Some(distance), Some(sigma), 4) =
        (column("point_a"), column("point_b"), length("distance"), length("sigma"), header.len())
    else {
        let found: Vec<&str> = header.iter().collect();
        let message = format!("columns {}; point_a, point_b, distance_mm, sigma_mm are needed (or _m)", found.join(", "));
        return Err(wrong(header.position().map_or(1, csv::Position::line), message));
    };
    let mut distances = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| wrong(error.position().map_or(0, csv::Position::line), error.to_string()))?;
        let line = record.position().map_or(0, csv::Position::line);
        let number = |(column, unit): (usize, f64)| -> Result<f64, TableError> {
            let text = record.get(column).unwrap_or_default();
            let value = text.parse::<f64>().ok().filter(|value| *value > 0.0 && *value <= LARGEST);
            let name = header.get(column).unwrap_or_default();
            Ok(value.ok_or_else(|| wrong(line, format!("`{name}` is `{text}`; a positive number is needed")))? * unit)
        };
        let point = |column: usize| record.get(column).unwrap_or_default().to_owned();
        distances.push(Distance { point_a: point(a), point_b: point(b), distance_m: number(distance)?, sigma_m: number(sigma)? });
    }
    Ok(distances)
}

/// Largest number, in the unit of its column, that is taken for meant. Times since 1970 in ms are smaller.
const LARGEST: f64 = 1e13;

/// What is known of a table beside its text.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hints {
    /// Names of the robot's joints, which its columns may have, and which of them slide.
    pub joints: Vec<(String, bool)>,
    /// How three angles make an orientation.
    pub euler: Option<Euler>,
    /// Ticks of the encoders per turn.
    pub ticks_per_turn: Option<f64>,
    /// Columns that are not to be read.
    pub ignored: Vec<String>,
    /// What every row must have.
    pub needs: Needs,
}

/// What every row of a table must have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Needs {
    /// Joints and what was read of the target.
    #[default]
    Both,
    /// A pose: it is to be reached.
    Pose,
    /// Joints: they are to be measured.
    Joints,
}

/// How three numbers make an orientation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Euler {
    /// Turns about these axes (0, 1, 2), one after the other; of the moving frame, or of the fixed one.
    Turns {
        /// In the order in which they are made.
        axes: [usize; 3],
        /// Whether about the axes that move with the frame.
        moving: bool,
    },
    /// They are a rotation vector: axis times angle.
    Vector,
}

impl std::str::FromStr for Euler {
    type Err = String;

    fn from_str(text: &str) -> Result<Euler, String> {
        let named = match text {
            "rpy" | "wpr" => "xyz",
            "abc" => "ZYX",
            "rotvec" => return Ok(Euler::Vector),
            other => other,
        };
        let moving = named.chars().all(|c| c.is_ascii_uppercase());
        let axes: Vec<usize> = named.chars().filter_map(|c| "xyz".find(c.to_ascii_lowercase())).collect();
        let same_case = moving || named.chars().all(|c| c.is_ascii_lowercase());
        match axes.as_slice() {
            [a, b, c] if named.len() == 3 && same_case && a != b && b != c && a != c => {
                Ok(Euler::Turns { axes: [*a, *b, *c], moving })
            }
            _ => Err(format!(
                "{text}: rpy (URDF, ROS: fixed x, y, z), abc (KUKA), wpr (FANUC), rotvec (Universal Robots), or the order of the turns, such as \
                 xyz about fixed axes or ZYX about moving ones, is needed"
            )),
        }
    }
}

impl std::fmt::Display for Euler {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Euler::Vector => f.write_str("rotvec"),
            Euler::Turns { axes, moving } => {
                let names = if *moving { ["X", "Y", "Z"] } else { ["x", "y", "z"] };
                axes.iter().try_for_each(|axis| f.write_str(names[*axis]))
            }
        }
    }
}

impl Euler {
    /// All ways that differ: turns about the fixed axes in every order (about moving ones they are the same in the other order), and the
    /// rotation vector.
    #[must_use]
    pub fn all() -> Vec<Euler> {
        let orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
        orders.map(|axes| Euler::Turns { axes, moving: false }).into_iter().chain([Euler::Vector]).collect()
    }

    /// The orientation of `angles` about (or along) x, y and z, rad.
    #[must_use]
    pub fn turn(self, angles: [f64; 3]) -> UnitQuaternion<f64> {
        let about = |axis: usize| {
            let mut vector = Vector3::zeros();
            vector[axis] = angles[axis];
            rotation_from_vector(&vector)
        };
        match self {
            Euler::Vector => rotation_from_vector(&Vector3::from(angles)),
            Euler::Turns { axes: [a, b, c], moving: true } => about(a) * about(b) * about(c),
            Euler::Turns { axes: [a, b, c], moving: false } => about(c) * about(b) * about(a),
        }
    }
}

/// Reads the table at `path`.
///
/// # Errors
/// If it cannot be read, or names the line and what is wrong with it.
pub fn read(path: impl AsRef<Path>) -> Result<Table, TableError> {
    read_as(path, &Hints::default())
}

/// The same with what is known of it.
///
/// # Errors
/// As [`read`].
pub fn read_as(path: impl AsRef<Path>, hints: &Hints) -> Result<Table, TableError> {
    let path = path.as_ref();
    let file = path.display().to_string();
    let unreadable =
        |source: std::io::Error| TableError::Unreadable { file: file.clone(), source, wanted: "a table of measurements (.csv)" };
    let bytes = crate::files::bytes(path, crate::files::LARGEST_TABLE).map_err(unreadable)?;
    if let Some(what) = text::foreign(&bytes) {
        return Err(unreadable(std::io::Error::other(what)));
    }
    let decoded = text::decoded(&bytes).map_err(|(line, message)| TableError::Wrong { file: file.clone(), line, message })?;
    parse_as(&decoded, &file, hints)
}

/// Reads a table from `text`; `file` is its name in messages.
///
/// # Errors
/// Names the line and what is wrong with it.
pub fn parse(text: &str, file: &str) -> Result<Table, TableError> {
    parse_as(text, file, &Hints::default())
}

/// Largest share of the rows that may be without a reading.
const MOST_EMPTY: f64 = 0.5;
/// Lines that are named, at most.
const NAMED: usize = 8;
/// Times (s) beyond this are since 1970.
const SINCE_1970: f64 = 1e8;

/// The same with what is known of it.
///
/// # Errors
/// As [`parse`].
pub fn parse_as(text: &str, file: &str, hints: &Hints) -> Result<Table, TableError> {
    let wrong = |line, message| TableError::Wrong { file: file.to_owned(), line, message };
    let layout = text::layout(text);
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .delimiter(layout.separator)
        .trim(csv::Trim::All)
        .flexible(true)
        .from_reader(text.as_bytes());
    let header = reader.headers().map_err(|error| wrong(1, error.to_string()))?.clone();
    let header_line = header.position().map_or(1, csv::Position::line);
    let (names, slides): (Vec<String>, Vec<bool>) = hints.joints.iter().cloned().unzip();
    // A separator at the end of every line makes a column without a name.
    let trailing = header.len() > 1 && header.iter().next_back() == Some("");
    let header: csv::StringRecord = if trailing { header.iter().take(header.len() - 1).collect() } else { header };
    let understood = Header::new(&header, &names, &slides, hints).map_err(|message| wrong(header_line, message))?;
    let Header { columns, notes, .. } = &understood;
    let euler = match (understood.orientation, hints.euler.or(understood.implied)) {
        (Orientation::Euler, None) => {
            let message = "three angles make an orientation in many ways: say with --euler which, such as rpy (URDF, ROS), abc (KUKA), wpr \
                           (FANUC), rotvec (Universal Robots) or ZYX";
            return Err(wrong(header_line, message.to_owned()));
        }
        (_, euler) => euler.unwrap_or(Euler::Vector),
    };
    let per_turn = hints.ticks_per_turn.unwrap_or(1.0);
    if hints.ticks_per_turn.is_none() && columns.iter().any(|column| matches!(column, Column::Ticks { .. })) {
        return Err(wrong(
            header_line,
            "columns of encoder ticks: say with --ticks-per-turn how many there are per turn of the joint".to_owned(),
        ));
    }
    let mut notes = notes.clone();
    let mut empty: Vec<(u64, String)> = Vec::new();

    let mut measurements: Vec<Measurement> = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| wrong(error.position().map_or(0, csv::Position::line), error.to_string()))?;
        let line = record.position().map_or(0, csv::Position::line);
        let beyond = record.iter().skip(columns.len()).any(|cell| !cell.is_empty());
        if record.len() < columns.len() || beyond {
            let message = format!(
                "{} values, but the header names {} columns: give each column a value, or leave the row out",
                record.len(),
                columns.len()
            );
            return Err(wrong(line, message));
        }
        let index = measurements.len();
        let mut row = Measurement {
            index,
            pose_id: index,
            role: Role::Fit,
            time_s: index as f64,
            joints: vec![0.0; understood.joints],
            temperatures_c: vec![0.0; understood.sensors],
            position_m: [0.0; 3],
            unread: understood.read.map(|read| !read),
            orientation_xyzw: (understood.orientation != Orientation::None).then_some([0.0; 4]),
            approach: vec![0; understood.approaches],
            ..Measurement::default()
        };
        let (mut angles, mut matrix) = ([0.0; 3], Matrix3::zeros());
        let mut missing: Option<String> = None;
        for ((column, text), name) in columns.iter().zip(record.iter()).zip(header.iter()) {
            let reads = matches!(
                column,
                Column::Joint { .. }
                    | Column::Ticks { .. }
                    | Column::Quaternion { .. }
                    | Column::Euler { .. }
                    | Column::Matrix { .. }
            );
            if reads && text::is_missing(text) {
                missing.get_or_insert_with(|| name.to_owned());
                continue;
            }
            let point = layout.number(text);
            let number = || match point.parse::<f64>() {
                Ok(value) if value.abs() <= LARGEST => Ok(value),
                Ok(value) if value.is_finite() => {
                    Err(wrong(line, format!("`{name}` is `{}`; at most {LARGEST} is allowed: check the number", short(text))))
                }
                _ => Err(wrong(line, format!("`{name}` is `{}`; a finite number is needed", short(text)))),
            };
            match column {
                Column::PoseId => {
                    row.pose_id = text
                        .parse()
                        .map_err(|_| wrong(line, format!("`pose_id` is `{text}`; a whole number from 0 is needed")))?;
                }
                Column::Ignored => {}
                Column::Time { factor } => {
                    row.time_s = match point.parse::<f64>() {
                        Ok(value) if value.is_finite() => value * factor,
                        Ok(_) => number()?,
                        Err(_) => moment(text).ok_or_else(|| {
                            wrong(
                                line,
                                format!(
                                    "`{name}` is `{}`; seconds, or a date and time such as 2026-05-01T12:30:00.5 are needed",
                                    short(text)
                                ),
                            )
                        })?,
                    }
                }
                Column::Joint { joint, factor, .. } => row.joints[*joint] = number()? * factor,
                Column::Ticks { joint } => row.joints[*joint] = number()? / per_turn * 2.0 * std::f64::consts::PI,
                Column::Euler { axis, factor } => angles[*axis] = number()? * factor,
                Column::Matrix { row, column } => matrix[(*row, *column)] = number()?,
                Column::Position { axis, .. } if text::is_missing(text) => row.unread[*axis] = true,
                Column::Position { axis, factor } => row.position_m[*axis] = number()? * factor,
                Column::Quaternion { component } => {
                    let value = number()?;
                    if let Some(quaternion) = &mut row.orientation_xyzw {
                        quaternion[*component] = value;
                    }
                }
                Column::Role => {
                    row.role = match text {
                        "fit" => Role::Fit,
                        "held_out" => Role::HeldOut,
                        _ => return Err(wrong(line, format!("`role` is `{text}`; `fit` or `held_out` is needed"))),
                    }
                }
                Column::Temperature { sensor } => {
                    row.temperatures_c[*sensor] =
                        sense::temperature(number()?, false).map_err(|what| wrong(line, format!("`{name}` {what}")))?;
                }
                Column::Approach { joint } => {
                    row.approach[*joint] = match number()? {
                        -1.0 => -1,
                        0.0 => 0,
                        1.0 => 1,
                        _ => {
                            return Err(wrong(
                                line,
                                format!("`{name}` is `{text}`; -1, 0 or 1 is needed: the direction of the last move"),
                            ));
                        }
                    }
                }
                Column::Ambient => {
                    row.ambient_c =
                        Some(sense::temperature(number()?, true).map_err(|what| wrong(line, format!("`{name}` {what}")))?)
                }
                Column::Payload => {
                    row.payload_kg = Some(sense::payload(number()?).map_err(|what| wrong(line, format!("`{name}` {what}")))?)
                }
                Column::Dwell => {
                    row.dwell_s = Some(not_negative(number()?).map_err(|what| wrong(line, format!("`{name}` {what}")))?)
                }
                Column::Session => row.session = Some(text.to_owned()),
                Column::Target => row.target = Some(text.to_owned()),
                Column::FixedPoint => row.fixed_point = (!text::is_missing(text)).then(|| text.to_owned()),
                Column::Plane => row.plane = (!text::is_missing(text)).then(|| text.to_owned()),
                Column::Gravity { axis } => {
                    let value = number()?;
                    row.gravity_m_s2.get_or_insert_default()[*axis] = value;
                }
            }
        }
        if let Some(name) = missing {
            empty.push((line, name));
            continue;
        }
        if let Some(read) = row.gravity_m_s2 {
            row.gravity_m_s2 = Some(free_fall(read).map_err(|what| wrong(line, what))?);
        }
        let labels = [("the fixed point", &row.fixed_point), ("the plane", &row.plane)];
        let said: Vec<String> = labels.iter().filter_map(|(what, of)| Some(format!("{what} `{}`", (*of).as_ref()?))).collect();
        if !said.is_empty() {
            let others = if row.unread == [true; 3] { &said[1..] } else { &said[..] };
            if let Some(other) = others.first() {
                let first = if others.len() == said.len() { "a position" } else { said[0].as_str() };
                let message = format!(
                    "{first} and {other}: a reading is of one or the other; leave x, y, z empty, or `fixed_point` and `plane`"
                );
                return Err(wrong(line, message));
            }
            // Of a plane only the distance from it is known.
            row.unread = if row.plane.is_some() { [true, true, false] } else { [false; 3] };
        }
        if row.unread == [true; 3] && hints.needs != Needs::Joints {
            empty.push((line, "x, y, z".to_owned()));
            continue;
        }
        match understood.orientation {
            Orientation::Euler => {
                row.angles_rad = Some(angles);
                row.orientation_xyzw = Some(euler.turn(angles).coords.into());
            }
            Orientation::Matrix => {
                let off = (matrix * matrix.transpose() - Matrix3::identity()).amax();
                if off > 1e-3 || matrix.determinant() < 0.0 {
                    return Err(wrong(
                        line,
                        format!(
                            "r11 … r33 are no rotation: their product with their transpose is off one by {off:.3}, or they mirror"
                        ),
                    ));
                }
                let rotation = Rotation3::from_matrix_eps(&matrix, 1e-15, 100, Rotation3::identity());
                row.orientation_xyzw = Some(UnitQuaternion::from_rotation_matrix(&rotation).coords.into());
            }
            Orientation::None | Orientation::Quaternion => {}
        }
        if let Some(quaternion) = &mut row.orientation_xyzw {
            let norm = quaternion.iter().map(|component| component * component).sum::<f64>().sqrt();
            if (norm - 1.0).abs() > 1e-3 {
                return Err(wrong(line, format!("the quaternion (qx, qy, qz, qw) has length {norm:.6}; it must be 1")));
            }
            // Files carry few digits; readings already exact keep their bits.
            if (norm - 1.0).abs() > 1e-15 {
                quaternion.iter_mut().for_each(|component| *component /= norm);
            }
        }
        measurements.push(row);
    }
    if measurements.is_empty() && empty.is_empty() {
        return Err(wrong(header_line, "the table has a header but no rows".to_owned()));
    }
    if let Some((line, name)) = empty.first() {
        let total = measurements.len() + empty.len();
        if empty.len() as f64 > MOST_EMPTY * total as f64 {
            let message =
                format!("`{name}` has no number here, and {} of {total} rows lack some: is it the right column?", empty.len());
            return Err(wrong(*line, message));
        }
        let said: Vec<String> = empty.iter().take(NAMED).map(|(line, name)| format!("{line} ({name})")).collect();
        let more = if empty.len() > NAMED { format!(" and {} more", empty.len() - NAMED) } else { String::new() };
        let plural = if empty.len() == 1 { "row without a reading is" } else { "rows without a reading are" };
        notes.push(format!("{} {plural} left out: line {}{more}", empty.len(), said.join(", ")));
    }
    if columns.iter().any(|column| matches!(column, Column::Time { .. })) {
        notes.extend(sense::order_of_times(&measurements));
    }
    let first = measurements.iter().map(|row| row.time_s).fold(f64::INFINITY, f64::min);
    if first > SINCE_1970 {
        // Since the first reading: seconds since 1970 would lose their fractions.
        measurements.iter_mut().for_each(|row| row.time_s -= first);
    }
    let is_condition = |column: &Column| {
        use Column::{Ambient, Approach, Dwell, Gravity, Payload, Session, Target};
        matches!(column, Approach { .. } | Gravity { .. } | Ambient | Payload | Dwell | Session | Target)
    };
    let conditions =
        header.iter().zip(columns).filter(|(_, column)| is_condition(column)).map(|(name, _)| name.to_owned()).collect();
    let mut joint_is_length = vec![false; understood.joints];
    let (mut joint_factor, mut position_factor) = (vec![1.0; understood.joints], [1.0; 3]);
    for column in columns {
        match column {
            Column::Joint { joint, is_length, factor } => {
                (joint_is_length[*joint], joint_factor[*joint]) = (*is_length, *factor);
            }
            Column::Ticks { joint } => joint_factor[*joint] = 2.0 * std::f64::consts::PI / per_turn,
            Column::Position { axis, factor } => position_factor[*axis] = *factor,
            _ => {}
        }
    }
    let is_unknown = |line: &str| {
        let said = line.trim_start().strip_prefix('#').map(|said| said.replace(char::is_whitespace, "").to_lowercase());
        said.is_some_and(|said| said == "order:unknown")
    };
    let in_order = !text.lines().any(is_unknown);
    let euler = (understood.orientation == Orientation::Euler).then_some(euler);
    Ok(Table { measurements, joint_is_length, joint_factor, position_factor, euler, conditions, in_order, notes })
}

/// A date and time as seconds since 1970; without a zone it is taken as UTC.
fn moment(text: &str) -> Option<f64> {
    let seconds = |stamp: jiff::Timestamp| stamp.as_second() as f64 + f64::from(stamp.subsec_nanosecond()) * 1e-9;
    let zoned = text.parse::<jiff::Timestamp>().ok();
    let plain = || text.parse::<jiff::civil::DateTime>().ok()?.to_zoned(jiff::tz::TimeZone::UTC).ok();
    zoned.or_else(|| Some(plain()?.timestamp())).map(seconds)
}

/// The beginning of a cell, for messages.
fn short(text: &str) -> String {
    text.chars().take(60).collect()
}

fn not_negative(value: f64) -> Result<f64, String> {
    if value >= 0.0 { Ok(value) } else { Err(format!("is {value}; 0 or more is needed")) }
}

/// The column of a joint (from 0).
fn joint_column(joint: usize, slides: &[bool]) -> String {
    format!("q{}_{}", joint + 1, if slides.get(joint).copied().unwrap_or(false) { "m" } else { "rad" })
}

/// Writes `measurements` in the format that [`parse`] reads, bit for bit. Columns that some rows lack are left out. `slides`: which joints
/// slide.
///
/// # Errors
/// If a text cannot be written as CSV, which none that [`parse`] gave causes.
pub fn write(measurements: &[Measurement], slides: &[bool]) -> Result<String, csv::Error> {
    let every = |has: fn(&Measurement) -> bool| measurements.iter().all(has);
    let joints = measurements.first().map_or(0, |row| row.joints.len());
    let sensors = measurements.iter().map(|row| row.temperatures_c.len()).min().unwrap_or(0);
    let orientation = every(|row| row.orientation_xyzw.is_some());
    let approach = every(|row| !row.joints.is_empty() && row.approach.len() == row.joints.len());
    let gravity = every(|row| row.gravity_m_s2.is_some());
    let optional = [
        ("temp_ambient_c", every(|row| row.ambient_c.is_some())),
        ("payload_kg", every(|row| row.payload_kg.is_some())),
        ("dwell_s", every(|row| row.dwell_s.is_some())),
        ("session", every(|row| row.session.is_some())),
        ("target", every(|row| row.target.is_some())),
    ];
    let names =
        |present: bool, names: &[&str]| if present { names.iter().map(|name| (*name).to_owned()).collect() } else { Vec::new() };
    let mut header = names(true, &["pose_id", "role", "time_s"]);
    header.extend((0..joints).map(|joint| joint_column(joint, slides)));
    let is_read = |row: &Measurement, axis: usize| !row.unread[axis] && row.is_in_frame();
    let axes: Vec<usize> = (0..3).filter(|axis| measurements.iter().any(|row| is_read(row, *axis))).collect();
    let fixed = measurements.iter().any(|row| row.fixed_point.is_some());
    let planes = measurements.iter().any(|row| row.plane.is_some());
    header.extend(axes.iter().map(|axis| ["x_m", "y_m", "z_m"][*axis].to_owned()));
    header.extend(names(orientation, &["qx", "qy", "qz", "qw"]));
    header.extend((1..=sensors).map(|sensor| format!("temp{sensor}_c")));
    header.extend((1..=joints).filter(|_| approach).map(|joint| format!("approach{joint}")));
    header.extend(names(gravity, &["gravity_x", "gravity_y", "gravity_z"]));
    header.extend(optional.iter().filter(|(_, present)| *present).map(|(name, _)| (*name).to_owned()));
    header.extend(names(fixed, &["fixed_point"]));
    header.extend(names(planes, &["plane"]));
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(&header)?;
    for row in measurements {
        let role = if row.role == Role::Fit { "fit" } else { "held_out" };
        let mut fields = vec![row.pose_id.to_string(), role.to_owned(), row.time_s.to_string()];
        let quaternion = row.orientation_xyzw.iter().filter(|_| orientation).flatten();
        fields.extend(row.joints.iter().map(f64::to_string));
        fields
            .extend(axes.iter().map(|axis| if is_read(row, *axis) { row.position_m[*axis].to_string() } else { String::new() }));
        fields.extend(quaternion.chain(&row.temperatures_c[..sensors]).map(f64::to_string));
        fields.extend(row.approach.iter().filter(|_| approach).map(i8::to_string));
        fields.extend(row.gravity_m_s2.iter().flatten().filter(|_| gravity).map(f64::to_string));
        let number = |value: Option<f64>| value.map(|value| value.to_string());
        let values =
            [number(row.ambient_c), number(row.payload_kg), number(row.dwell_s), row.session.clone(), row.target.clone()];
        fields.extend(optional.iter().zip(values).filter(|((_, present), _)| *present).filter_map(|(_, value)| value));
        fields.extend(fixed.then(|| row.fixed_point.clone().unwrap_or_default()));
        fields.extend(planes.then(|| row.plane.clone().unwrap_or_default()));
        writer.write_record(&fields)?;
    }
    let bytes = writer.into_inner().map_err(|error| csv::Error::from(error.into_error()))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// Writes configurations (rad; m where a joint of `slides` slides) in this `order` of their numbers, one per row, as the columns `pose_id` (the
/// number), `q1_rad` … that [`parse`] reads: what was read of the target is to be added.
///
/// # Errors
/// None in practice.
pub fn write_configurations(configurations: &[Vec<f64>], order: &[usize], slides: &[bool]) -> Result<String, csv::Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let joints = (0..slides.len()).map(|joint| joint_column(joint, slides));
    writer.write_record(["pose_id".to_owned()].into_iter().chain(joints))?;
    for pose in order {
        writer.write_record([pose.to_string()].into_iter().chain(configurations[*pose].iter().map(f64::to_string)))?;
    }
    let bytes = writer.into_inner().map_err(|error| csv::Error::from(error.into_error()))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_in_any_order_with_units_and_comments() {
        let text = "# by hand\nz_mm,q2_deg,x_mm,y_mm,q1_rad,pose_id,temp_ambient_c\n# note\n3000,180,1000,2000,0.5,7,21\n";
        let table = parse(text, "t.csv").unwrap();
        let row = &table.measurements[0];
        assert_eq!((row.pose_id, row.position_m), (7, [1.0, 2.0, 3.0]));
        assert_eq!(row.joints, [0.5, std::f64::consts::PI]);
        assert_eq!(table.conditions, ["temp_ambient_c"]);
        assert_eq!(row.ambient_c, Some(21.0));
    }

    #[test]
    fn what_is_written_is_read_back_bit_for_bit() {
        let row = |index: usize| Measurement {
            angles_rad: None,
            fixed_point: None,
            plane: None,
            index,
            pose_id: index / 2,
            role: if index == 1 { Role::HeldOut } else { Role::Fit },
            time_s: 0.1 * index as f64,
            joints: vec![0.1 + 0.2, -1e-17, 3.0],
            temperatures_c: vec![20.1, 1.0 / 3.0],
            position_m: [1.0 / 3.0, -2.0 / 7.0, 1e-9],
            unread: [false; 3],
            orientation_xyzw: Some([0.5, -0.5, 0.5, -0.5]),
            approach: vec![-1, 0, 1],
            ambient_c: Some(20.0 + 1.0 / 3.0),
            payload_kg: Some(0.1 + 0.2),
            dwell_s: Some(1.5),
            session: Some("day 2, \"morning\"".to_owned()),
            target: Some("A".to_owned()),
            gravity_m_s2: Some([0.0, 9.81, 0.0]),
        };
        let rows = vec![row(0), row(1), row(2)];
        assert_eq!(parse(&write(&rows, &[]).unwrap(), "t.csv").unwrap().measurements, rows);
        // A coordinate that some rows lack is an empty cell, one that all lack no column.
        let flat = |index: usize, of: &[usize]| Measurement {
            unread: [0, 1, 2].map(|axis| of.contains(&axis)),
            position_m: [0, 1, 2].map(|axis| if of.contains(&axis) { 0.0 } else { 1.5 }),
            ..row(index)
        };
        for rows in [vec![flat(0, &[2]), flat(1, &[2])], vec![flat(0, &[2]), flat(1, &[]), flat(2, &[0])]] {
            let text = write(&rows, &[]).unwrap();
            assert_eq!(text.contains("z_m"), rows.len() == 3);
            assert_eq!(parse(&text, "t.csv").unwrap().measurements, rows);
        }
        // What only some rows have is left out.
        let some = vec![Measurement { payload_kg: None, approach: Vec::new(), ..row(0) }, row(1)];
        let back = parse(&write(&some, &[]).unwrap(), "t.csv").unwrap();
        assert_eq!(back.measurements[1], Measurement { payload_kg: None, approach: Vec::new(), ..row(1) });
    }

    /// A joint that stays keeps the side from which it came; a session begins anew; who says that rows have no order is believed.
    #[test]
    fn sides_of_approach_follow_from_the_order_of_rows() {
        let text = "q1_rad,q2_rad,x_m,y_m,z_m,session\n0,0,0,0,0,a\n0.1,-0.1,0,0,0,a\n0.1,-0.2,0,0,0,a\n0.2,0.3,0,0,0,b\n0,0.30001,0,0,0,b\n";
        let mut table = parse(text, "t.csv").unwrap();
        assert!(table.fill_in_approach());
        let sides = |table: &Table| table.measurements.iter().map(|row| row.approach.clone()).collect::<Vec<_>>();
        assert_eq!(sides(&table), [[0, 0], [1, -1], [1, -1], [0, 0], [-1, 0]]);
        // They are there now, and are not made again.
        assert!(!table.fill_in_approach());
        let (header, rows) = text.split_once('\n').unwrap();
        let mut unknown = parse(&format!("{header}\n# Order: unknown\n{rows}"), "t.csv").unwrap();
        assert!(!unknown.fill_in_approach() && unknown.measurements[1].approach.is_empty());
        // Times tell the order, wherever rows stand.
        let mut back = parse("time_s,q1_rad,x_m,y_m,z_m\n2,0.3,0,0,0\n1,0.5,0,0,0\n", "t.csv").unwrap();
        assert!(back.fill_in_approach());
        assert_eq!(sides(&back), [[-1], [0]]);
    }

    #[test]
    fn tables_are_read_as_people_have_them() {
        let plain = parse("q1_deg,q2_deg,x_mm,y_mm,z_mm,time_s\n10.5,-3,1,2,3,0\n11,4.25,4,5,6,90.5\n", "t.csv").unwrap();
        let german = "\u{feff}J1 [deg];J2 [deg];X (mm);Y (mm);Z (mm);Timestamp;\n\n10,5;-3;1;2;3;2026-05-01T23:59:00;\n11;4,25;4;5;6;2026-05-02T00:00:30.5;\n";
        let found = parse(german.trim_start_matches('\u{feff}'), "t.csv").unwrap();
        assert_eq!(found.measurements, plain.measurements);
        // Rows without a reading are left out and named.
        let holes = parse("q1_rad,x_m,y_m\n0,0,0\nnan,0,0\n1,,\n2,0,\n3,0,0\n4,0,0\n", "t.csv").unwrap();
        assert_eq!(holes.measurements.iter().map(|row| row.joints[0]).collect::<Vec<_>>(), [0.0, 2.0, 3.0, 4.0]);
        assert_eq!(holes.notes, ["2 rows without a reading are left out: line 3 (q1_rad), 4 (x, y, z)"]);
        assert_eq!(holes.measurements[1].unread, [false, true, true]);
    }

    /// Every way to write a turn is the same turn: 0.4 about z, then 0.3 about the new y, then -0.2 about the new x.
    #[test]
    fn orientations_are_the_same_however_they_are_written() {
        let [x, y, z] = [-0.2_f64, 0.3, 0.4];
        let turn = UnitQuaternion::from_euler_angles(x, y, z);
        let vector = turn.scaled_axis();
        let of = |cells: String, euler: &str| {
            let text = format!("q1_rad,x_m,rx_rad,ry_rad,rz_rad\n0,0,{cells}\n");
            let hints = Hints { euler: Some(euler.parse().unwrap()), ..Hints::default() };
            parse_as(&text, "t.csv", &hints).unwrap().measurements[0].orientation().unwrap()
        };
        for (cells, euler) in [
            (format!("{x},{y},{z}"), "rpy"),
            (format!("{x},{y},{z}"), "ZYX"),
            (format!("{x},{y},{z}"), "wpr"),
            (format!("{},{},{}", vector.x, vector.y, vector.z), "rotvec"),
        ] {
            assert!(of(cells, euler).angle_to(&turn) < 1e-12, "{euler}");
        }
        let matrix = turn.to_rotation_matrix();
        let cells: Vec<String> = (0..9).map(|at| matrix[(at / 3, at % 3)].to_string()).collect();
        let text = format!("q1_rad,x_m,r11,r12,r13,r21,r22,r23,r31,r32,r33\n0,0,{}\n", cells.join(","));
        assert!(parse(&text, "t.csv").unwrap().measurements[0].orientation().unwrap().angle_to(&turn) < 1e-9);
        for euler in Euler::all() {
            assert!(euler.to_string().parse() == Ok(euler), "{euler}");
        }
        assert!("zyz".parse::<Euler>().is_err() && "Xyz".parse::<Euler>().is_err());
    }

    #[test]
    fn bad_tables_are_refused_with_line_and_remedy() {
        for (text, expected) in [
            ("q1_rad,x_m,y_m,z_m\n", "line 1: the table has a header but no rows"),
            ("q1,x_m,y_m,z_m\n0,0,0,0\n", "column `q1` has no known unit; write q1_rad, _deg, _m, _mm or _ticks"),
            ("q1_rad,x_m,y_m,z\n0,0,0,0\n", "column `z` has no known unit; write z_m, z_mm or another length"),
            ("q1_rad,time_s\n0,0\n", "needs x_m, y_m, z_m (or _mm), those that were read"),
            ("q1_rad,x_m,x_mm\n0,0,0\n", "needs x_m, y_m, z_m (or _mm), those that were read, each once"),
            ("q1_rad,x_m,y_m\n0,0,0\n0,,\n0,nan,NaN\n", "line 3: `x, y, z` has no number here, and 2 of 3 rows lack some"),
            (
                "q1_rad,x_m,rx_deg,ry_deg,rz_deg\n0,0,0,0,0\n",
                "line 1: three angles make an orientation in many ways: say with --euler",
            ),
            ("q1_ticks,x_m\n0,0\n", "line 1: columns of encoder ticks: say with --ticks-per-turn"),
            ("q1_rad,x_m,fixed_point\n0,0,a\n", "line 2: a position and the fixed point `a`"),
            ("q1_rad,x_m,r11,r12,r13,r21,r22,r23,r31,r32,r33\n0,0,1,0,0,0,1,0,0,0,-1\n", "line 2: r11 … r33 are no rotation"),
            ("q1_rad,x_m,time\n0,0,noon\n", "line 2: `time` is `noon`; seconds, or a date and time such as"),
            ("q1_rad,q3_rad,x_m,y_m,z_m\n", "q2 is missing or doubled"),
            ("0.3,1,2,3\n", "line 1: a number (`0.3`) where the names of the columns should be"),
            ("q1_rad,x_m,,y_m,z_m\n", "line 1: a column without a name"),
            (
                "q1_rad,x_m,y_m,z_m,colour\n",
                "unknown column `colour`: rename it, or leave it out with --ignore-columns; known are pose_id",
            ),
            ("q1_rad,x_m,y_m,z_m,qx\n", "an orientation needs all of qx, qy, qz, qw"),
            ("q1_rad,x_m,y_m,z_m\n0,0,0,0\n0,0,1e400,0\n", "line 3: `y_m` is `1e400`; a finite number is needed"),
            ("q1_rad,x_m,y_m,z_m\n0,0,0\n", "line 2: 3 values, but the header names 4 columns"),
            ("q1_rad,x_m,y_m,z_m,qx,qy,qz,qw\n0,0,0,0,0,0,0,2\n", "line 2: the quaternion (qx, qy, qz, qw) has length 2"),
            ("q1_rad,x_m,y_m,z_m,approach1\n0,0,0,0,2\n", "line 2: `approach1` is `2`; -1, 0 or 1 is needed"),
            ("q1_rad,q2_rad,x_m,y_m,z_m,approach1\n", "approach1 … approach2: one column per joint, or none"),
            ("q1_rad,x_m,y_m,z_m,payload_kg\n0,0,0,0,-1\n", "line 2: `payload_kg` is -1; 0 or more is needed"),
            ("q1_rad,x_m,y_m,z_m,dwell_s\n0,0,0,0,-1\n", "line 2: `dwell_s` is -1; 0 or more is needed"),
            ("q1_rad,x_m,y_m,z_m,temp1_c\n0,0,0,0,-300\n", "line 2: `temp1_c` is -300 °C; from -90 to 200"),
            ("q1_rad,x_m,y_m,z_m,gravity_x\n0,0,0,0,9.81\n", "line 1: gravity needs all of gravity_x, gravity_y, gravity_z"),
            (
                "q1_rad,x_m,y_m,z_m,gravity_x,gravity_y,gravity_z\n0,0,0,0,1,0,0\n",
                "line 2: gravity is 1.000 m/s² long; 9.81 is needed: these seem to be multiples of g",
            ),
            ("q1_rad,x_m,x_m,y_m,z_m\n", "column `x_m` stands there twice"),
        ] {
            let message = parse(text, "t.csv").unwrap_err().to_string();
            assert!(message.contains(expected) && message.starts_with("t.csv, line"), "{message}");
        }
    }
}
