//! Measured data of real robots, where there are any: `KINCAL_DATA_DIR` names their folder, whose README.md says what they are.
//! The expected numbers are that README's: 3-D RMS in mm, made with other programs.

use std::path::PathBuf;

use serde_json::Value;

use crate::harness::{kincal, number};

fn data() -> Option<PathBuf> {
    let folder = std::env::var_os("KINCAL_DATA_DIR").map(PathBuf::from);
    if folder.is_none() {
        println!("skipped: KINCAL_DATA_DIR is not set");
    }
    folder
}

fn identify(data: &std::path::Path, robot: &str, table: &str, more: &[&str]) -> Value {
    let out = tempfile::tempdir().unwrap();
    let [robot, table] = [robot, table].map(|name| data.join(name).to_str().unwrap().to_owned());
    kincal(out.path(), &[&["identify", table.as_str(), "--robot", &robot, "--json"], more].concat()).ends(0).json()
}

#[track_caller]
fn near(json: &Value, pointer: &str, expected_mm: f64, tolerance: f64) {
    let found_mm = number(json, pointer) * 1e3;
    println!("{pointer}: {found_mm:.4} mm, expected {expected_mm} mm");
    assert!((found_mm / expected_mm - 1.0).abs() < tolerance, "{pointer}: {found_mm} mm, expected {expected_mm} mm");
}

#[test]
fn ur5_grid_predicts_random_poses() {
    let Some(data) = data() else { return };
    let random = data.join("ur5_tracker/random.csv");
    let more = ["--evaluate", random.to_str().unwrap(), "--position-noise-um", "25"];
    let json = identify(&data, "ur5_tracker/ur5.urdf", "ur5_tracker/grid.csv", &more);
    assert_eq!((&json["nominal"]["count"], &json["held_out"]["count"]), (&1000.into(), &20.into()));
    near(&json, "/nominal/position_m/rms", 0.701, 1e-3);
    near(&json, "/held_out/position_m/rms", 0.104, 0.03);
    near(&json, "/held_out/position_m/mean", 0.1005, 0.03);
    assert!(json["held_out"]["rotation_rad"].is_null());
}

#[test]
fn ur10_series_with_the_nominal_robot() {
    let Some(data) = data() else { return };
    for (table, nominal_mm) in [("series_b", 1.085), ("series_d", 0.772)] {
        // The reference fits base and target to positions alone; so does this where orientations weigh nothing.
        let table = format!("ur10_tracker/{table}.csv");
        let json = identify(&data, "ur10_tracker/ur10.urdf", &table, &["--attitude-noise-deg", "10"]);
        near(&json, "/nominal/position_m/rms", nominal_mm, 1e-3);
        assert!(number(&json, "/fitted/position_m/rms") < 0.6 * number(&json, "/nominal/position_m/rms"));
    }
}

#[test]
fn the_wrong_robot_shows() {
    let Some(data) = data() else { return };
    let right = identify(&data, "ur10_tracker/ur10.urdf", "ur10_tracker/series_d.csv", &[]);
    let out = tempfile::tempdir().unwrap();
    let [robot, table] =
        ["ur5_tracker/ur5.urdf", "ur10_tracker/series_d.csv"].map(|name| data.join(name).to_str().unwrap().to_owned());
    let ran = kincal(out.path(), &["identify", &table, "--robot", &robot, "--json"]);
    if ran.code != Some(2) {
        let wrong = number(&ran.json(), "/nominal/position_m/rms");
        assert!(wrong > 10.0 * number(&right, "/nominal/position_m/rms"), "{wrong} m");
    }
}
