//! Tables of strangers, made here from an arm that is known: planes, other tools, sensors that stood still, driven joints, and what is said
//! of the geometry beforehand.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use kincal::arm::frames::{Pose, rotation_from_vector};
use kincal::arm::urdf;
use kincal::seed::{Stream, stream};
use nalgebra::Vector3;
use serde_json::Value;

use crate::harness::{kincal, number};

/// An arm of six joints with an elbow.
fn six_joints() -> String {
    let frames = [
        ("waist", "0 0 0.3", "0 0 0"),
        ("shoulder", "0.05 0 0.1", "-1.5708 0 0"),
        ("elbow", "0.4 0 0", "0 0 0"),
        ("forearm", "0.04 0.35 0", "-1.5708 0 0"),
        ("wrist", "0 0 0", "1.5708 0 0"),
        ("flange", "0 -0.08 0", "-1.5708 0 0"),
    ];
    let mut text = String::from("<robot name=\"six\">\n<link name=\"l0\"/>\n");
    for (number, (name, xyz, rpy)) in frames.iter().enumerate() {
        let _ = writeln!(
            text,
            "<link name=\"l{0}\"/>\n<joint name=\"{name}\" type=\"revolute\"><parent link=\"l{number}\"/><child link=\"l{0}\"/>\
             <origin xyz=\"{xyz}\" rpy=\"{rpy}\"/><axis xyz=\"0 0 1\"/><limit lower=\"-2.6\" upper=\"2.6\" effort=\"1\" velocity=\"1\"/></joint>",
            number + 1
        );
    }
    text + "</robot>\n"
}

struct Cell {
    folder: tempfile::TempDir,
    robot: PathBuf,
    /// Pose of the tip in the measurement frame.
    chain: kincal::arm::ChainAt,
    base: Pose,
    draws: Stream,
}

impl Cell {
    /// Half a millimetre and half a milliradian off.
    fn new(name: &str) -> Cell {
        let folder = tempfile::tempdir().unwrap();
        let robot = folder.path().join("six.urdf");
        std::fs::write(&robot, six_joints()).unwrap();
        let nominal = urdf::import(&six_joints(), "six", None, None).unwrap().arm;
        let mut draws = stream(1, &format!("test/tables/{name}"));
        let values: Vec<f64> = nominal.chain.nominal().iter().map(|value| value + 5e-4 * draws.normal()).collect();
        let base = Pose::from_parts(Vector3::new(0.8, -0.3, 0.2).into(), rotation_from_vector(&Vector3::new(0.2, -0.1, 1.1)));
        Cell { folder, robot, chain: nominal.chain.at(&values), base, draws }
    }

    fn joints(&mut self) -> Vec<f64> {
        (0..6).map(|_| self.draws.uniform(-2.4, 2.4)).collect()
    }

    fn target(&self, joints: &[f64], on_tool: Vector3<f64>) -> Vector3<f64> {
        (self.base * self.chain.forward(joints) * nalgebra::Point3::from(on_tool)).coords
    }

    fn noise(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| 2e-5 * self.draws.normal())
    }

    /// Rows of joints and position, the target at `on_tool`.
    fn rows(&mut self, count: usize, on_tool: impl Fn(usize) -> Vector3<f64>) -> Vec<(Vec<f64>, Vector3<f64>)> {
        (0..count)
            .map(|row| {
                let joints = self.joints();
                let at = self.target(&joints, on_tool(row)) + self.noise();
                (joints, at)
            })
            .collect()
    }

    fn write(&self, name: &str, text: &str) -> String {
        let path = self.folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path.to_str().unwrap().to_owned()
    }

    fn identified(&self, table: &str, more: &[&str]) -> Value {
        let robot = self.robot.to_str().unwrap();
        let arguments = [&["identify", table, "--robot", robot, "--position-noise-um", "20", "--json"], more].concat();
        kincal(self.folder.path(), &arguments).ends(0).json()
    }

    /// RMS, mm, by which the arm in the file `urdf` is off where nobody measured, base and target placed.
    fn off(&mut self, urdf_file: &Path) -> f64 {
        let rows = self.rows(80, |_| Vector3::new(0.02, 0.01, 0.1));
        let text = csv(&rows);
        let table = self.write("fresh.csv", &text);
        let arguments = ["identify", &table, "--robot", urdf_file.to_str().unwrap(), "--only", "base", "--json"];
        let json = kincal(&self.folder.path().join("off"), &arguments).ends(0).json();
        1e3 * number(&json, "/fitted/position_m/rms")
    }
}

const HEAD: &str = "q1_rad,q2_rad,q3_rad,q4_rad,q5_rad,q6_rad";

fn cells(joints: &[f64]) -> String {
    joints.iter().map(|value| format!("{value:.8}")).collect::<Vec<_>>().join(",")
}

fn csv(rows: &[(Vec<f64>, Vector3<f64>)]) -> String {
    let mut text = format!("{HEAD},x_m,y_m,z_m\n");
    for (joints, at) in rows {
        let _ = writeln!(text, "{},{:.7},{:.7},{:.7}", cells(joints), at.x, at.y, at.z);
    }
    text
}

fn notes(json: &Value) -> String {
    json["notes"].as_array().unwrap().iter().map(|note| note.as_str().unwrap()).collect::<Vec<_>>().join("\n")
}

/// A tip that touches three plates of which nobody knows where they are: the arm is better by far, but for its size.
#[test]
fn touched_planes_calibrate_an_arm() {
    let mut cell = Cell::new("planes");
    let planes = [(Vector3::new(0.1, 0.05, 1.0), 0.4), (Vector3::new(1.0, 0.1, 0.2), 1.0), (Vector3::new(-0.1, 1.0, 0.1), 0.1)];
    let mut text = format!("{HEAD},plane\n");
    let tip = Vector3::new(0.01, -0.02, 0.12);
    for (number, (normal, height)) in planes.iter().enumerate() {
        let normal = normal.normalize();
        let mut found = 0;
        while found < 40 {
            let mut joints = cell.joints();
            let wanted = height + 2e-5 * cell.draws.normal();
            let off = |joints: &[f64]| normal.dot(&cell.target(joints, tip)) - wanted;
            // Newton along the slope.
            for _ in 0..60 {
                let now = off(&joints);
                let slope: Vec<f64> = (0..6)
                    .map(|joint| {
                        let mut there = joints.clone();
                        there[joint] += 1e-6;
                        (off(&there) - now) / 1e-6
                    })
                    .collect();
                let square: f64 = slope.iter().map(|value| value * value).sum();
                joints.iter_mut().zip(&slope).for_each(|(value, slope)| *value -= (now / square * slope).clamp(-0.3, 0.3));
            }
            if off(&joints).abs() < 1e-9 && joints.iter().all(|value| value.abs() < 2.6) {
                let _ = writeln!(text, "{},plate {number}", cells(&joints));
                found += 1;
            }
        }
    }
    let table = cell.write("planes.csv", &text);
    let json = cell.identified(&table, &[]);
    assert!(notes(&json).contains("3 planes: errors are the distances"), "{}", notes(&json));
    // A reading is one number: its noise is all that is left.
    let left = 1e3 * number(&json, "/fitted/position_m/rms");
    assert!((0.008..0.025).contains(&left), "{left}");
    let calibrated = cell.folder.path().join("planes-identified.urdf");
    let nominal = cell.robot.clone();
    let (before, after) = (cell.off(&nominal), cell.off(&calibrated));
    assert!(after < 0.6 * before, "{after} of {before} mm");
    // Its size is what the file says; a dozen measured positions tell that, and are better with the touches than alone.
    let measured = cell.rows(12, |_| tip);
    let alone = cell.write("few.csv", &csv(&measured));
    cell.identified(&alone, &[]);
    let path = |name: &str| cell.folder.path().join(name);
    let (few, together) = (path("few-identified.urdf"), path("both-identified.urdf"));
    let few = cell.off(&few);
    let mut both = text.replace(",plane\n", ",plane,x_m,y_m,z_m\n").replace("plate 0\n", "plate 0,,,\n");
    both = both.replace("plate 1\n", "plate 1,,,\n").replace("plate 2\n", "plate 2,,,\n");
    for (joints, at) in &measured {
        let _ = writeln!(both, "{},,{:.7},{:.7},{:.7}", cells(joints), at.x, at.y, at.z);
    }
    let both = cell.write("both.csv", &both);
    cell.identified(&both, &[]);
    let together = cell.off(&together);
    assert!(together < 0.05 * before && together < 0.9 * few, "{before} {after} {few} {together}");
    // A plate whose touches are all held out is laid where the calibrated arm has them.
    let held =
        text.replace(",plane\n", ",plane,role\n").replace("plate 0\n", "plate 0,fit\n").replace("plate 1\n", "plate 1,fit\n");
    let held = cell.write("held.csv", &held.replace("plate 2\n", "plate 2,held_out\n"));
    let json = cell.identified(&held, &[]);
    let (before, after) = (number(&json, "/held_out_nominal/position_m/rms"), number(&json, "/held_out/position_m/rms"));
    assert!(after < before, "{after} of {before} m");
    let robot = cell.robot.to_str().unwrap();
    let diagnosed = kincal(cell.folder.path(), &["diagnose", &table, "--robot", robot, "--position-noise-um", "20", "--json"]);
    assert!(diagnosed.code != Some(2), "{}", diagnosed.stderr);
    assert_eq!(diagnosed.json()["effects"].as_array().unwrap().len(), 0);
    let wrong = format!("{HEAD},x_m,y_m,z_m,plane\n0,0,0,0,0,0,1,2,3,a\n");
    let wrong = cell.write("wrong.csv", &wrong);
    // Lines are counted as an editor does, whatever ends them.
    let lines =
        cell.write("lines.csv", "q1_rad,q2_rad,q3_rad,q4_rad,q5_rad,q6_rad,x_m\r\n0,0,0,0,0,0,1\r\n0,0,0,0,0,0,\"1,5\"\r\n");
    let refused_line = kincal(cell.folder.path(), &["identify", &lines, "--robot", robot]).ends(2);
    assert!(refused_line.stderr.contains("line 3: `x_m` is `1,5`"), "{}", refused_line.stderr);
    let refused = kincal(cell.folder.path(), &["identify", &wrong, "--robot", robot]).ends(2);
    assert!(refused.stderr.contains("line 2: a position and the plane `a`"), "{}", refused.stderr);
}

#[test]
fn rows_of_another_tool_and_of_a_moved_base_are_named_as_such() {
    let mut cell = Cell::new("tool");
    let rows = cell.rows(60, |row| Vector3::new(0.02, 0.01, if (40..52).contains(&row) { 0.135 } else { 0.1 }));
    let text = csv(&rows);
    let table = cell.write("tool.csv", &text);
    let json = cell.identified(&table, &[]);
    let said = notes(&json);
    assert!(said.contains("off alike, by 35.") && said.contains("A column `target`"), "{said}");
    assert_eq!(json["left_out"].as_array().unwrap().len(), 12);
    let mut rows = cell.rows(60, |_| Vector3::new(0.02, 0.01, 0.1));
    rows[30..40].iter_mut().for_each(|(_, at)| *at += Vector3::new(2e-3, -1e-3, 5e-4));
    let text = csv(&rows);
    let table = cell.write("base.csv", &text);
    let said = notes(&cell.identified(&table, &[]));
    assert!(said.contains("(2.0, -1.0, 0.5) in the measurement frame") && said.contains("A column `session`"), "{said}");
}

#[test]
fn readings_of_a_sensor_that_stood_still_are_left_out_and_named() {
    let mut cell = Cell::new("frozen");
    let mut rows = cell.rows(60, |_| Vector3::new(0.02, 0.01, 0.1));
    for row in [10, 11, 12, 40] {
        rows[row].1 = rows[row - 1].1;
    }
    // The same pose measured twice without a move is a repeat.
    rows[20] = rows[19].clone();
    let text = csv(&rows);
    let table = cell.write("frozen.csv", &text);
    let json = cell.identified(&table, &[]);
    let said = notes(&json);
    assert!(said.contains("readings 11, 12, 13, 41 repeat the one before to the last digit"), "{said}");
    assert!(1e3 * number(&json, "/fitted/position_m/rms") < 0.05);
    // What was said of the table is in the recording, too.
    let recording = cell.folder.path().join("frozen-identified.mcap");
    kincal(cell.folder.path(), &["replay", recording.to_str().unwrap()]).ends(0);
    let robot = cell.robot.to_str().unwrap();
    let diagnosed = kincal(cell.folder.path(), &["diagnose", &table, "--robot", robot, "--position-noise-um", "20", "--json"]);
    assert!(notes(&diagnosed.json()).contains("repeat the one before"), "{}", diagnosed.stderr);
}

/// Poses as OpenCV has them, semicolons, decimal commas, a count of the rows; and as matrices of four rows.
#[test]
fn poses_are_read_as_programs_write_them() {
    let mut cell = Cell::new("opencv");
    let comma =
        |values: Vec<f64>| values.iter().map(|value| format!("{value:.6}").replace('.', ",")).collect::<Vec<_>>().join(";");
    let mut vectors = String::from(
        "sample;waist;shoulder;elbow;forearm;wrist;flange;tvec_x [mm];tvec_y [mm];tvec_z [mm];rvec_x;rvec_y;rvec_z\n",
    );
    let entries: Vec<String> =
        (0..16).map(|at| format!("T{}{}{}", at / 4, at % 4, if at % 4 == 3 { "_m" } else { "" })).collect();
    let mut matrices = format!("{HEAD},{}\n", entries.join(","));
    for number in 0..40 {
        let joints = cell.joints();
        let pose = cell.base * cell.chain.forward(&joints) * Pose::translation(0.02, 0.01, 0.1);
        let turn = kincal::arm::frames::rotation_vector(&pose.rotation);
        let at = pose.translation.vector * 1e3;
        let own = [joints.clone(), at.iter().copied().collect(), turn.iter().copied().collect()].concat();
        let _ = writeln!(vectors, "{number};{}", comma(own));
        let matrix = pose.to_homogeneous();
        let own: Vec<String> = (0..16).map(|at| format!("{:.8}", matrix[(at / 4, at % 4)])).collect();
        let _ = writeln!(matrices, "{},{}", cells(&joints), own.join(","));
    }
    for (name, text) in [("vectors.csv", vectors), ("matrices.csv", matrices)] {
        let table = cell.write(name, &text);
        let json = cell.identified(&table, &[]);
        assert!(
            1e3 * number(&json, "/fitted/position_m/rms") < 0.01 && number(&json, "/fitted/rotation_rad/rms") < 1e-5,
            "{name}"
        );
    }
}

#[test]
fn what_is_said_of_the_geometry_beforehand_holds() {
    let mut cell = Cell::new("known");
    let rows = cell.rows(60, |_| Vector3::new(0.02, 0.01, 0.1));
    let text = csv(&rows);
    let table = cell.write("known.csv", &text);
    let frame = |json: &Value, joint: &str| {
        json["joint_frames"].as_array().unwrap().iter().find(|frame| frame["joint"] == joint).unwrap().clone()
    };
    let json = cell.identified(&table, &["--only", "geometry", "--fix", "elbow,wrist.twist"]);
    let elbow = frame(&json, "elbow");
    assert_eq!((number(&elbow, "/zero/estimate"), number(&elbow, "/shift_m/0/estimate")), (0.0, 0.0));
    let wrist = frame(&json, "wrist");
    assert!(number(&wrist, "/turn_rad/0/estimate") == 0.0 && number(&wrist, "/zero/estimate") != 0.0);
    assert!(notes(&json).contains("held as the file has it, as --fix says: elbow, wrist.twist"));
    // What is free is so on every rung.
    let json = cell.identified(&table, &["--only", "base", "--free", "forearm"]);
    assert!(number(&frame(&json, "forearm"), "/zero/estimate") != 0.0 && number(&frame(&json, "elbow"), "/zero/estimate") == 0.0);
    // A narrow prior keeps lengths where the file has them.
    let length = |json: &Value| {
        let frames = json["joint_frames"].as_array().unwrap().clone();
        frames.iter().map(|frame| number(frame, "/shift_m/0/estimate").abs()).fold(0.0, f64::max)
    };
    let wide = length(&cell.identified(&table, &["--only", "geometry"]));
    let narrow = length(&cell.identified(&table, &["--only", "geometry", "--prior", "lengths=0.001mm"]));
    assert!(narrow < 0.1 * wide, "{narrow} {wide}");
    // Readings in the robot's own frame.
    let own: Vec<(Vec<f64>, Vector3<f64>)> =
        rows.iter().map(|(joints, at)| (joints.clone(), (cell.base.inverse() * nalgebra::Point3::from(*at)).coords)).collect();
    let own = cell.write("own.csv", &csv(&own));
    let json = cell.identified(&own, &["--fix", "base"]);
    let of = |name: &str| {
        let all = json["parameters"].as_array().unwrap();
        number(all.iter().find(|parameter| parameter["name"] == name).unwrap(), "/identified")
    };
    assert_eq!((of("base_x"), of("base_yaw")), (0.0, 0.0));
    // The first joint's frame is off by half a millimetre, which is held, too.
    assert!(1e3 * number(&json, "/fitted/position_m/rms") < 2.0);
    let robot = cell.robot.to_str().unwrap();
    let refused = kincal(cell.folder.path(), &["identify", &table, "--robot", robot, "--fix", "elbw"]).ends(2);
    assert!(
        refused.stderr.contains("--fix elbw: nothing of that name") && refused.stderr.contains("elbow"),
        "{}",
        refused.stderr
    );
}

/// A parallelogram: the third joint is driven by the second, and has no column.
#[test]
fn driven_joints_follow_those_that_drive_them() {
    let mut cell = Cell::new("driven");
    let text = six_joints().replacen(
        "<limit lower=\"-2.6\" upper=\"2.6\" effort=\"1\" velocity=\"1\"/></joint>\n<link name=\"l4\"/>",
        "<limit lower=\"-2.6\" upper=\"2.6\" effort=\"1\" velocity=\"1\"/><mimic joint=\"shoulder\" multiplier=\"-1\" offset=\"0.5\"/></joint>\n\
         <link name=\"l4\"/>",
        1,
    );
    assert!(text.contains("<mimic"));
    std::fs::write(&cell.robot, &text).unwrap();
    let mut table = String::from("q1_rad,q2_rad,q3_rad,q4_rad,q5_rad,x_m,y_m,z_m\n");
    let mut by_name = String::from("waist [rad],shoulder [rad],forearm [rad],wrist [rad],flange [rad],x_m,y_m,z_m\n");
    for _ in 0..60 {
        let mut joints = cell.joints();
        joints[2] = 0.5 - joints[1];
        let at = cell.target(&joints, Vector3::new(0.02, 0.01, 0.1)) + cell.noise();
        joints.remove(2);
        let line = format!("{},{:.7},{:.7},{:.7}\n", cells(&joints), at.x, at.y, at.z);
        table.push_str(&line);
        by_name.push_str(&line);
    }
    for text in [table, by_name] {
        let table = cell.write("driven.csv", &text);
        let json = cell.identified(&table, &[]);
        assert!(1e3 * number(&json, "/fitted/position_m/rms") < 0.05);
        assert!(notes(&json).contains("elbow of the robot have no columns"), "{}", notes(&json));
    }
    let calibrated = std::fs::read_to_string(cell.folder.path().join("driven-identified.urdf")).unwrap();
    assert!(calibrated.contains("<mimic joint=\"shoulder\""));
}

/// The readings of one robot with the file of another of its family.
#[test]
fn another_variant_of_the_robot_is_named() {
    let Some(data) = std::env::var_os("KINCAL_DATA_DIR").map(PathBuf::from) else {
        println!("skipped: KINCAL_DATA_DIR is not set");
        return;
    };
    let out = tempfile::tempdir().unwrap();
    for (table, robot, name) in [
        ("ur10_tracker/series_b.csv", "ur5_tracker/ur5.urdf", "UR10:"),
        ("ur10_tracker/series_d.csv", "ur5_tracker/ur5.urdf", "UR10:"),
        ("ur5_tracker/grid.csv", "ur10_tracker/ur10.urdf", "UR5:"),
        ("ur5_tracker/random.csv", "ur10_tracker/ur10.urdf", "UR5:"),
    ] {
        for command in ["identify", "diagnose"] {
            let (table, robot) = (data.join(table), data.join(robot));
            let ran = kincal(out.path(), &[command, table.to_str().unwrap(), "--robot", robot.to_str().unwrap()]).ends(2);
            assert!(ran.stderr.contains(&format!("those of another robot, {name}")), "{}", ran.stderr);
        }
    }
}

/// A design's table is in an order with short moves; the simulator measures it, and a Denavit-Hartenberg table is written of the arm.
#[test]
fn a_design_is_written_to_be_visited_and_an_arm_as_a_table() {
    let out = tempfile::tempdir().unwrap();
    let json = kincal(out.path(), &["design", "scenes/arm8.toml", "--set", "design.method=random", "--json"]).ends(0).json();
    let text = std::fs::read_to_string(json["to_visit"].as_str().unwrap()).unwrap();
    let rows: Vec<Vec<f64>> =
        text.lines().skip(1).map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect()).collect();
    let chosen = json["design"]["configurations"].as_array().unwrap();
    assert_eq!(rows.len(), chosen.len());
    for row in &rows {
        let own: Vec<f64> = chosen[row[0] as usize].as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect();
        assert_eq!(row[1..], own);
    }
    let far = |a: &[f64], b: &[f64]| a[1..].iter().zip(&b[1..]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let length = |rows: &[Vec<f64>]| rows.windows(2).map(|pair| far(&pair[0], &pair[1])).sum::<f64>();
    let mut drawn = rows.clone();
    drawn.sort_by(|a, b| a[0].total_cmp(&b[0]));
    assert!(length(&rows) < 0.85 * length(&drawn), "{} of {}", length(&rows), length(&drawn));
    kincal(out.path(), &["export", "scenes/arm8.toml", "--to", "dh"]).ends(0);
    let table = std::fs::read_to_string(out.path().join("arm8.dh.csv")).unwrap();
    assert!(table.starts_with("# Modified Denavit-Hartenberg") && table.lines().count() == 12, "{table}");
    let wrong = kincal(out.path(), &["export", "scenes/arm8.toml", "--to", "dh", "--tip-link", "x"]).ends(2);
    assert!(wrong.stderr.contains("--tip-link"), "{}", wrong.stderr);
}

/// Joints that reach wanted poses with the geometry of a table and with the effect that its diagnosis names: the play of a joint.
#[test]
fn named_effects_are_corrected_for() {
    let mut cell = Cell::new("correct");
    let on_tool = Vector3::new(0.02, 0.01, 0.1);
    // Play of the elbow: half of 4 mrad to the side from which it came.
    let play = 4e-3;
    let mut text = format!("{HEAD},x_m,y_m,z_m\n");
    let mut before = vec![0.0_f64; 6];
    for _ in 0..80 {
        let joints = cell.joints();
        let mut real = joints.clone();
        real[2] += 0.5 * play * (joints[2] - before[2]).signum();
        let at = cell.target(&real, on_tool) + cell.noise();
        let _ = writeln!(text, "{},{:.7},{:.7},{:.7}", cells(&joints), at.x, at.y, at.z);
        before = joints;
    }
    let table = cell.write("play.csv", &text);
    // Poses of the target in the measurement frame, within reach.
    let wanted: Vec<(Vec<f64>, Vector3<f64>)> = (0..20)
        .map(|_| {
            let joints = cell.joints();
            let at = cell.target(&joints, on_tool);
            (joints, at)
        })
        .collect();
    let poses = cell.write("wanted.csv", &csv(&wanted));
    let robot = cell.robot.to_str().unwrap().to_owned();
    let out = cell.folder.path().to_owned();
    let arguments = [
        "correct",
        "--measurements",
        &table,
        "--robot",
        &robot,
        "--targets",
        &poses,
        "--in-measurement-frame",
        "--position-noise-um",
        "20",
        "--json",
    ];
    let json = kincal(&out, &arguments).ends(0).json();
    assert_eq!(json["effects"][0], "backlash 3", "{json}");
    // The real arm, told these joints.
    let (mut square, mut plain) = (0.0, 0.0);
    for (number, (joints, at)) in json["joints"].as_array().unwrap().iter().zip(wanted.iter().map(|(_, at)| at)).enumerate() {
        let told: Vec<f64> = joints.as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect();
        let way = told[2] - before[2];
        let mut real = told.clone();
        real[2] += 0.5 * play * way.signum();
        square += (cell.target(&real, on_tool) - at).norm_squared();
        // Without knowing of the play: the joints that would do without it.
        let mut naive = wanted[number].0.clone();
        naive[2] += 0.5 * play;
        plain += (cell.target(&naive, on_tool) - at).norm_squared();
        before = told;
    }
    let [off, plain] = [square, plain].map(|sum: f64| 1e3 * (sum / 20.0).sqrt());
    assert!(off < 0.1 && plain > 0.5, "{off} mm, {plain} mm with the play");
}
