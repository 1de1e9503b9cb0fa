//! Situations of strangers (`../shared/cases` beside the folder of `KINCAL_DATA_DIR`): for each what is right is what is printed.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::harness::{Ran, kincal, number};

fn cases() -> Option<PathBuf> {
    let folder = std::env::var_os("KINCAL_DATA_DIR").map(|data| Path::new(&data).join("../cases")).filter(|cases| cases.is_dir());
    if folder.is_none() {
        println!("skipped: KINCAL_DATA_DIR is not set, or there are no cases beside it");
    }
    folder
}

/// Runs `command` on a table of case `folder`, with the case's own robot, or the UR5.
fn ran(cases: &Path, command: &str, folder: &str, table: &str, more: &[&str]) -> (tempfile::TempDir, Ran) {
    let out = tempfile::tempdir().unwrap();
    let own = ["robot.urdf", "ar4_mk3.urdf"].map(|name| cases.join(folder).join(name)).into_iter().find(|path| path.exists());
    let robot = own.unwrap_or_else(|| cases.join("../data/ur5_tracker/ur5.urdf"));
    let table = cases.join(folder).join(table);
    let arguments = [&[command, table.to_str().unwrap(), "--robot", robot.to_str().unwrap()], more].concat();
    let ran = kincal(out.path(), &arguments);
    (out, ran)
}

fn identified(cases: &Path, folder: &str, table: &str, more: &[&str]) -> Value {
    let (_out, ran) = ran(cases, "identify", folder, table, &[more, &["--json"]].concat());
    ran.ends(0).json()
}

fn rms_mm(json: &Value) -> f64 {
    1e3 * number(json, "/fitted/position_m/rms")
}

fn notes(json: &Value) -> String {
    json["notes"].as_array().unwrap().iter().map(|note| note.as_str().unwrap()).collect::<Vec<_>>().join("\n")
}

/// The zero of a joint, degrees.
fn zero(json: &Value, joint: &str) -> f64 {
    let frames = json["joint_frames"].as_array().unwrap();
    let frame = frames.iter().find(|frame| frame["joint"] == joint).unwrap();
    number(frame, "/zero/estimate").to_degrees()
}

#[test]
fn zeros_are_named_at_their_joint() {
    let Some(cases) = cases() else { return };
    for joint in ["joint3", "joint4"] {
        let json = identified(&cases, "one_zero_10deg", &format!("j{}.csv", &joint[5..]), &[]);
        assert!((zero(&json, joint) - 10.0).abs() < 0.02, "{}", zero(&json, joint));
        let others = json["joint_frames"].as_array().unwrap().iter().filter(|frame| frame["joint"] != joint);
        assert!(others.into_iter().all(|frame| number(frame, "/zero/estimate").abs().to_degrees() < 0.02));
        assert!(notes(&json).contains(&format!("joint `{joint}` reads")) && notes(&json).contains("too low"), "{}", notes(&json));
    }
    let json = identified(&cases, "zeros_of_wrist", "m.csv", &["--position-noise-um", "300", "--attitude-noise-deg", "0.1"]);
    assert!((zero(&json, "joint_4") - 10.0).abs() < 0.3 && (zero(&json, "joint_5") + 6.8).abs() < 0.3);
    assert!(notes(&json).contains("joint `joint_5` reads") && notes(&json).contains("too high"));
}

#[test]
fn targets_sessions_and_few_axes_are_identified() {
    let Some(cases) = cases() else { return };
    let noise = ["--position-noise-um", "50"];
    for folder in ["three_targets", "two_sessions"] {
        let json = identified(&cases, folder, "m.csv", &noise);
        assert!(rms_mm(&json) < 0.1 && 1e3 * number(&json, "/nominal/position_m/rms") < 5.0, "{folder}: {}", rms_mm(&json));
    }
    let json =
        identified(&cases, "two_axis_positioner", "m.csv", &["--position-noise-um", "100", "--attitude-noise-deg", "0.02"]);
    assert!(rms_mm(&json) < 0.2, "{}", rms_mm(&json));
}

#[test]
fn few_poses_leave_a_nominal_arm_nominal() {
    let Some(cases) = cases() else { return };
    let json = identified(&cases, "few_poses_camera", "m.csv", &["--position-noise-um", "1000", "--attitude-noise-deg", "0.3"]);
    assert!(notes(&json).contains("stays as the file has it"), "{}", notes(&json));
    let taken = json["ladder"].as_array().unwrap().iter().find(|rung| rung["chosen"] == true).unwrap();
    assert_eq!(taken["free"], "base_and_target");
}

#[test]
fn noise_that_nobody_declared_is_estimated() {
    let Some(cases) = cases() else { return };
    let json = identified(&cases, "noise_not_declared", "m.csv", &[]);
    assert_eq!(json["noise_estimated"], true);
    let sigma = 1e3 * number(&json, "/declared_noise/position_m") / 3f64.sqrt();
    assert!((sigma - 1.0).abs() < 0.15 && !notes(&json).contains("declared noise allows"), "{sigma}");
}

#[test]
fn outliers_that_hide_each_other_are_named() {
    let Some(cases) = cases() else { return };
    let noise = ["--position-noise-um", "50"];
    let json = identified(&cases, "outliers_hide_each_other", "m.csv", &noise);
    assert!(rms_mm(&json) < 0.1 && notes(&json).contains("3 of 60 readings are far off"), "{}", notes(&json));
    for reading in ["6 (", "18 (", "41 ("] {
        assert!(notes(&json).contains(reading), "{}", notes(&json));
    }
    let (_out, ran) = ran(&cases, "diagnose", "outliers_hide_each_other", "m.csv", &noise);
    assert!(ran.stdout.contains("measurement outliers"), "{}", ran.stdout);
}

#[test]
fn what_tables_got_wrong_is_said_with_what_corrects_it() {
    let Some(cases) = cases() else { return };
    for (folder, fix) in [
        ("inches", "positions:inch"),
        ("columns_permuted", "order:1,2,4,5,3,6"),
        ("two_joints_reversed", "reverse:2,5"),
        ("mirrored", "axes:x,-y,z"),
        ("quaternion_w_first", "quaternion:wxyz"),
        ("poses_shifted_from_row", "shift:31=+2"),
    ] {
        let noise = ["--position-noise-um", "50", "--attitude-noise-deg", "0.01"];
        for command in ["identify", "diagnose"] {
            let (_out, ran) = ran(&cases, command, folder, "m.csv", &noise);
            let ran = ran.ends(2);
            assert!(ran.stderr.contains(&format!("correct it with --fix-columns {fix})")), "{folder}: {}", ran.stderr);
        }
        // And with it, it fits.
        let json = identified(&cases, folder, "m.csv", &[&noise[..], &["--fix-columns", fix]].concat());
        assert!(rms_mm(&json) < 0.15, "{folder}: {}", rms_mm(&json));
        assert!(notes(&json).contains(&format!("corrected as --fix-columns {fix} says")));
    }
}

#[test]
fn causes_of_strangers_are_named() {
    let Some(cases) = cases() else { return };
    for (folder, noise, expected) in [
        ("wall_mounted", "30", "joint compliance of joint 2"),
        ("soft_joint2_1e-3", "50", "joint compliance of joint 2"),
        ("soft_joint3_2e-3", "50", "joint compliance of joint 3"),
        ("backlash_side_in_row_order", "50", "backlash of joint 2"),
    ] {
        let (_out, ran) = ran(&cases, "diagnose", folder, "m.csv", &["--position-noise-um", noise]);
        let sentence = ran.stdout.lines().next().unwrap_or_default();
        assert!(sentence.contains(expected), "{folder}: {sentence}");
    }
}

/// The user's file comes back: apart from numbers in origins every line is the same.
#[test]
fn a_urdf_comes_back_with_new_origins_only() {
    let Some(cases) = cases() else { return };
    let more = ["--tip-link", "gripper_frame_link", "--position-noise-um", "50"];
    let (out, ran) = ran(&cases, "identify", "urdf_back", "m.csv", &more);
    ran.ends(0);
    let before = std::fs::read_to_string(cases.join("urdf_back/robot.urdf")).unwrap();
    let after = std::fs::read_to_string(out.path().join("m-identified.urdf")).unwrap();
    assert_eq!(before.lines().count(), after.lines().count());
    let changed: Vec<&str> = before.lines().zip(after.lines()).filter(|(a, b)| a != b).map(|(a, _)| a.trim()).collect();
    assert!((1..=5).contains(&changed.len()) && changed.iter().all(|line| line.starts_with("<origin ")), "{changed:?}");
}
