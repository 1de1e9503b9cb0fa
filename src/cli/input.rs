//! What commands that take measurements share: recordings, tables, and the robot that a table is of.

use std::path::Path;

use anyhow::{Context, bail, ensure};

use super::arguments::{Global, LayoutOptions, RobotOptions};
use super::output;
use crate::arm::Arm;
use crate::arm::{JointKind, urdf};
use crate::diagnosis::rows::check_robot;
use crate::diagnosis::settings::Model;
use crate::event::{self, RealCell, Start};
use crate::identification::mistake::{Fix, Said};
use crate::measurement::{Measurement, table};
use crate::{recording, scene, session};

/// Position noise that is assumed where none is declared, µm.
pub(crate) const POSITION_NOISE_UM: f64 = 20.0;
/// Orientation noise that is assumed where none is declared, degrees.
pub(crate) const ORIENTATION_NOISE_DEG: f64 = 0.005;

/// The first event and the measurements of a recording.
pub(crate) fn recorded(global: &Global, path: &Path, partial: bool) -> anyhow::Result<(Start, Vec<Measurement>)> {
    let recording = recording::read::read(path)?;
    if let Some(cut) = &recording.cut {
        if !partial {
            bail!("{cut}; --partial uses what is there");
        }
        output::note(global, &format!("note: {cut}"));
    }
    if let Some(warning) = &recording.version_warning {
        output::note(global, &format!("note: {warning}"));
    }
    let measurements = event::measurements(&recording.events);
    ensure!(
        !measurements.is_empty(),
        "{} holds no measurements; make some with `kincal measure` or `kincal run`",
        path.display()
    );
    Ok((recording.start, measurements))
}

/// The first event of a table's recording: the robot as its file stands, and the sensor as declared.
fn described(command: &str, robot: &Path, options: &RobotOptions) -> anyhow::Result<(Start, RealCell)> {
    let is_scene = robot.extension().is_some_and(|extension| extension == "toml");
    let scene = if is_scene { scene::read(robot)?.public_toml()? } else { String::new() };
    let urdf = if is_scene {
        None
    } else {
        // Read as a file first: its errors name lines.
        urdf::read(robot, options.base_link.as_deref(), options.tip_link.as_deref())?;
        Some(crate::files::text(robot, crate::files::LARGEST_TEXT).with_context(|| robot.display().to_string())?)
    };
    let real = RealCell {
        urdf,
        base_link: options.base_link.clone(),
        tip_link: options.tip_link.clone(),
        position_sigma_m: options.position_noise_um.unwrap_or(POSITION_NOISE_UM) * 1e-6,
        noise_assumed: options.position_noise_um.is_none(),
        orientation_sigma_rad: options.orientation_noise_deg.unwrap_or(ORIENTATION_NOISE_DEG).to_radians(),
        only: None,
        zeros: Vec::new(),
        known: Vec::new(),
        notes: Vec::new(),
        distances: options.distances.as_ref().map(table::read_distances).transpose()?.unwrap_or_default(),
    };
    Ok((Start { real: Some(real.clone()), ..session::start_event(command, &scene) }, real))
}

/// A table and the robot that it is of, checked against one another.
pub(crate) struct Front {
    /// What a recording of it would begin with.
    pub(crate) start: Start,
    /// The robot and the sensor; joints whose zeros are far off are looked for there.
    pub(crate) real: RealCell,
    /// The nominal arm.
    pub(crate) arm: Arm,
    /// The rows, corrected as the command line says.
    pub(crate) table: table::Table,
    /// What is to be known of robot and table.
    pub(crate) notes: Vec<String>,
}

/// The one door through which tables come in: reads `path` and its robot, applies the corrections of the command line, and refuses what
/// cannot be of this robot (as `model` decides it) with what would explain it.
pub(crate) fn front(command: &str, path: &Path, options: &RobotOptions, model: &Model) -> anyhow::Result<Front> {
    let robot = robot_of_table(path, options)?;
    let (start, mut real) = described(command, robot, options)?;
    let (arm, mut notes) = session::real_robot(&start, &real).with_context(|| robot.display().to_string())?;
    let of_robot = notes.len();
    let mut table = read_table(path, &arm, options)?;
    notes.extend(table.notes.iter().cloned());
    notes.extend(without_frozen(&mut table, &arm));
    check_units(path, &table, &arm)?;
    check_joints(path, &table.measurements, arm.joint_count())?;
    for distance in &real.distances {
        for label in [&distance.point_a, &distance.point_b] {
            ensure!(
                table.measurements.iter().any(|row| row.fixed_point.as_ref() == Some(label)),
                "{}: `{label}` is no fixed_point of {}",
                options.distances.as_deref().unwrap_or(path).display(),
                path.display()
            );
        }
    }
    let (said, corrections) = corrected(&mut table, &arm, options)?;
    notes.extend(corrections);
    let slides = arm.slides();
    // All rows, whatever they are for: a correction counts them as the table does.
    let rows: Vec<&Measurement> = table.measurements.iter().collect();
    let sensor = session::real_sensor(&real, &table.measurements);
    // Parameters that are free enough explain wrong units, too.
    match check_robot(&arm, &sensor, &rows, model, &said) {
        Ok(()) => {}
        Err(wrong) => match wrong.explanations() {
            [only] if only.is_of_zeros() => {
                real.zeros = vec![0.0; slides.len()];
                for fix in &only.fixes {
                    if let Fix::Zero(joint, zero) = fix {
                        real.zeros[*joint] += zero;
                    }
                }
                notes.push(format!("{}: its zero is looked for there", only.words(&arm)));
            }
            _ => return Err(wrong).with_context(|| path.display().to_string()),
        },
    }
    real.notes = notes[of_robot..].to_vec();
    table.forget_angles();
    let start = Start { real: Some(real.clone()), ..start };
    Ok(Front { start, real, arm, table, notes })
}

/// An arm that moved by so much (m; rad) between two readings cannot have left a pose the same to its last digit.
const SURELY_MOVED: f64 = 1e-3;

/// Takes out readings that repeat the one before to the last digit although the arm has moved: the sensor, or its driver, had stopped. Says
/// which.
fn without_frozen(table: &mut table::Table, arm: &Arm) -> Option<String> {
    let rows = &mut table.measurements;
    if rows.iter().any(|row| row.joints.len() != arm.joint_count()) {
        return None;
    }
    let nominal = arm.chain.at_nominal();
    let mut frozen: Vec<usize> = Vec::new();
    let mut last = 0;
    for row in 1..rows.len() {
        let (before, now) = (&rows[last], &rows[row]);
        let same = now.is_in_frame()
            && now.position_m == before.position_m
            && now.unread == before.unread
            && now.orientation_xyzw == before.orientation_xyzw
            && (&now.session, &now.target) == (&before.session, &before.target);
        let (from, to) = (nominal.forward(&before.joints), nominal.forward(&now.joints));
        let moved = (to.translation.vector - from.translation.vector).norm();
        let turned = if now.orientation_xyzw.is_some() { to.rotation.angle_to(&from.rotation) } else { 0.0 };
        if same && moved.max(turned) > SURELY_MOVED {
            frozen.push(row);
        } else {
            last = row;
        }
    }
    if frozen.is_empty() || 2 * frozen.len() > rows.len() {
        return None;
    }
    let numbers: Vec<String> = frozen.iter().take(12).map(|row| (row + 1).to_string()).collect();
    let more = if frozen.len() > numbers.len() { format!(" and {} more", frozen.len() - numbers.len()) } else { String::new() };
    let mut number = 0;
    rows.retain(|_| {
        number += 1;
        frozen.binary_search(&(number - 1)).is_err()
    });
    rows.iter_mut().enumerate().for_each(|(index, row)| row.index = index);
    Some(format!(
        "readings {}{more} repeat the one before to the last digit although the arm had moved: the sensor had stopped; they were left out, \
         and numbers below count what is left",
        numbers.join(", ")
    ))
}

/// Corrects `table` as `--fix-columns` says; the units that its columns say, and what was corrected.
pub(crate) fn corrected(table: &mut table::Table, arm: &Arm, options: &RobotOptions) -> anyhow::Result<(Said, Vec<String>)> {
    let slides = arm.slides();
    let turning = table.joint_factor.iter().zip(&slides).find(|(_, slides)| !**slides);
    let said = Said { angle: turning.map_or(1.0, |(factor, _)| *factor), position: table.position_factor, euler: table.euler };
    let mut notes = Vec::new();
    for text in &options.fix_columns {
        let fix: Fix = text.parse().map_err(|wrong| anyhow::anyhow!("--fix-columns {wrong}"))?;
        fix.apply(&mut table.measurements, &said, &slides).map_err(|wrong| anyhow::anyhow!("--fix-columns {text}: {wrong}"))?;
        let names: Vec<String> = arm.chain.joints.iter().map(|joint| joint.name.clone()).collect();
        notes.push(format!("corrected as --fix-columns {text} says: {}", fix.words(&names)));
    }
    Ok((said, notes))
}

/// What is known of a table of `arm` before it is read.
pub(crate) fn hints(arm: &Arm, layout: &LayoutOptions) -> anyhow::Result<table::Hints> {
    let euler = layout.euler.as_ref().map(|text| text.parse().map_err(|wrong| anyhow::anyhow!("--euler {wrong}"))).transpose()?;
    let joints = arm.chain.joints.iter().map(|joint| (joint.name.clone(), joint.kind == JointKind::Prismatic)).collect();
    Ok(table::Hints { joints, euler, ignored: layout.ignore_columns.clone(), ..table::Hints::default() })
}

/// Reads the table of `input`, with gravity as it was said on the command line.
pub(crate) fn read_table(path: &Path, arm: &Arm, options: &RobotOptions) -> anyhow::Result<table::Table> {
    if let Some(ticks) = options.ticks_per_turn {
        ensure!(
            ticks.is_finite() && ticks.abs() >= 1.0,
            "--ticks-per-turn {ticks}: a number of at least 1 is needed, such as 4096"
        );
    }
    let hints = table::Hints { ticks_per_turn: options.ticks_per_turn, ..hints(arm, &options.layout)? };
    let mut table = with_driven(path, arm, &hints)?;
    if !options.gravity.is_empty() {
        let said = options.gravity.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
        let Ok(gravity) = <[f64; 3]>::try_from(options.gravity.as_slice()) else {
            bail!("--gravity {said}: three numbers are needed, such as 0,0,-9.81 for a robot that stands upright");
        };
        table.set_gravity(gravity).map_err(|what| anyhow::anyhow!("--gravity {said}: {what}"))?;
    }
    Ok(table)
}

/// The table at `path`, in which joints that are driven by others may be missing: their coordinates follow from those.
fn with_driven(path: &Path, arm: &Arm, hints: &table::Hints) -> anyhow::Result<table::Table> {
    let all = table::read_as(path, hints);
    let joints = &arm.chain.joints;
    let own: Vec<usize> = (0..joints.len()).filter(|joint| joints[*joint].mimic.is_none()).collect();
    if own.len() == joints.len() || all.as_ref().is_ok_and(|table| table.joint_factor.len() == joints.len()) {
        return Ok(all?);
    }
    let of_own = own.iter().map(|joint| hints.joints[*joint].clone()).collect();
    let Ok(mut table) = table::read_as(path, &table::Hints { joints: of_own, ..hints.clone() }) else {
        return Ok(all?);
    };
    if table.joint_factor.len() != own.len() {
        return Ok(all?);
    }
    // Of each joint, the column that says where it is, and how: driven ones may be driven by driven ones.
    let source = |joint: usize| -> Option<(usize, f64, f64)> {
        let (mut at, mut multiplier, mut offset) = (joint, 1.0, 0.0);
        for _ in 0..joints.len() {
            match &joints[at].mimic {
                None => return Some((own.binary_search(&at).ok()?, multiplier, offset)),
                Some(mimic) => {
                    offset += multiplier * mimic.offset;
                    multiplier *= mimic.multiplier;
                    at = mimic.joint;
                }
            }
        }
        None
    };
    let Some(sources) = (0..joints.len()).map(source).collect::<Option<Vec<_>>>() else {
        bail!("joints of the robot drive one another in a circle: correct the <mimic> elements");
    };
    for row in &mut table.measurements {
        let read = row.joints.clone();
        row.joints = sources.iter().map(|(column, multiplier, offset)| multiplier * read[*column] + offset).collect();
        if row.approach.len() == own.len() {
            let sides = row.approach.clone();
            row.approach = sources
                .iter()
                .map(|(column, multiplier, _)| if *multiplier < 0.0 { -sides[*column] } else { sides[*column] })
                .collect();
        }
    }
    table.joint_factor = sources.iter().map(|(column, ..)| table.joint_factor[*column]).collect();
    table.joint_is_length = joints.iter().map(|joint| joint.kind == JointKind::Prismatic).collect();
    let driven: Vec<&str> = joints.iter().filter(|joint| joint.mimic.is_some()).map(|joint| joint.name.as_str()).collect();
    table.notes.push(format!("{} of the robot have no columns: they follow the joints that drive them", driven.join(", ")));
    Ok(table)
}

/// Refuses lengths for joints that turn and angles for joints that slide.
pub(crate) fn check_units(path: &Path, table: &table::Table, arm: &Arm) -> anyhow::Result<()> {
    for (number, (is_length, joint)) in table.joint_is_length.iter().zip(&arm.chain.joints).enumerate() {
        let slides = joint.kind == JointKind::Prismatic;
        let (verb, units) = if slides { ("slides", "_m or _mm") } else { ("turns", "_rad or _deg") };
        ensure!(
            *is_length == slides,
            "{}: column q{} has the unit of {}, but joint `{}` of the robot {verb}: its column must end in {units}",
            path.display(),
            number + 1,
            if *is_length { "a length" } else { "an angle" },
            joint.name
        );
    }
    Ok(())
}

pub(crate) fn check_joints(path: &Path, measurements: &[Measurement], joint_count: usize) -> anyhow::Result<()> {
    let found = measurements.iter().map(|row| row.joints.len()).find(|found| *found != joint_count).unwrap_or(joint_count);
    ensure!(
        found == joint_count,
        "{} has {found} joint columns, the robot has {joint_count} joints: is it the right robot, and are its links from --base-link \
         to --tip-link?",
        path.display()
    );
    Ok(())
}

/// Refuses `--base-link` and `--tip-link` where they would do nothing.
pub(crate) fn no_links(options: &RobotOptions, why: &str) -> anyhow::Result<()> {
    for (name, link) in [("--base-link", &options.base_link), ("--tip-link", &options.tip_link)] {
        ensure!(link.is_none(), "{name} {}: {why}", link.as_deref().unwrap_or_default());
    }
    Ok(())
}

/// Refuses a robot beside a recording, which has its own.
pub(crate) fn no_robot(options: &RobotOptions) -> anyhow::Result<()> {
    no_links(options, "a recording carries its own nominal arm; leave it out")?;
    ensure!(options.gravity.is_empty(), "--gravity: a recording has its own; leave it out");
    let layout = &options.layout;
    let of_tables = layout.euler.is_some() || options.ticks_per_turn.is_some() || !layout.ignore_columns.is_empty();
    ensure!(!of_tables, "--euler, --ticks-per-turn, --ignore-columns: a recording has been read already; leave them out");
    ensure!(options.distances.is_none(), "--distances: a recording has its own; leave it out");
    ensure!(options.fix_columns.is_empty(), "--fix-columns: a recording has been corrected already; leave it out");
    ensure!(
        options.robot.is_none(),
        "--robot {}: a recording carries its own nominal arm; give --robot with a table (.csv) only",
        options.robot.as_deref().unwrap_or(Path::new("")).display()
    );
    Ok(())
}

/// The nominal robot of a table.
fn robot_of_table<'a>(input: &Path, options: &'a RobotOptions) -> anyhow::Result<&'a Path> {
    let Some(robot) = &options.robot else {
        bail!("{} is a table: give its nominal robot with --robot FILE (a URDF or a scene)", input.display());
    };
    if robot.extension().is_some_and(|extension| extension == "toml") {
        no_links(options, "the arm of a scene is taken whole; leave it out or give a URDF")?;
    }
    for (name, value) in
        [("--position-noise-um", options.position_noise_um), ("--attitude-noise-deg", options.orientation_noise_deg)]
    {
        if let Some(value) = value {
            ensure!((1e-6..=1e6).contains(&value), "{name} {value}: a positive number is needed, from 0.000001 to 1000000");
        }
    }
    Ok(robot)
}

pub(crate) fn is_recording(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "mcap")
}

pub(crate) fn input_stem(path: &Path, suffix: &str) -> String {
    let stem = path.file_stem().map_or_else(|| "input".to_owned(), |stem| stem.to_string_lossy().into_owned());
    format!("{stem}{suffix}")
}
