//! The steps one by one, on the files that each leaves for the next.

use std::fs;

use serde_json::Value;

use crate::harness::{QUICK, kincal, number, quick_run};

/// What `identify --json` prints, without the paths of what it wrote.
fn identification(mut json: Value) -> Value {
    let object = json.as_object_mut().unwrap();
    object.remove("recording").unwrap();
    object.remove("calibrated_urdf").unwrap();
    json
}

#[test]
fn design_measure_identify_is_what_run_does() {
    let run = quick_run(&[]);
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    let path = |name: &str| out.join(name).to_str().unwrap().to_owned();
    let design = kincal(out, &[&["design", "scenes/arm8.toml", "--json"], &QUICK[..]].concat()).ends(0).json();
    assert_eq!(design["design"], run.json["design"]);
    let designed = path("arm8-design.mcap");
    let measure = [&["measure", "scenes/arm8.toml", "--design", &designed, "--json"], &QUICK[..]].concat();
    let measured = kincal(out, &measure).ends(0).json();
    assert_eq!((&measured["poses"], &measured["settled"]), (&90.into(), &90.into()));
    let json = kincal(out, &["identify", &path("arm8-measure.mcap"), "--json"]).ends(0).json();
    assert!(json["parameters"].as_array().unwrap().iter().filter_map(|p| p["standard_error"].as_f64()).all(f64::is_finite));
    assert_eq!(identification(json), run.json["identification"]);
    let [steps, whole] = [out.join("arm8-measure.truth.toml"), run.path("arm8.truth.toml")].map(|path| fs::read(path).unwrap());
    assert!(steps == whole, "the truth differs");
    // What each step recorded replays.
    let truth = path("arm8-measure.truth.toml");
    for name in ["arm8-design.mcap", "arm8-measure.mcap", "arm8-measure-identified.mcap"] {
        kincal(out, &["replay", &path(name)]).ends(0);
        kincal(out, &["replay", &path(name), "--truth", &truth]).ends(0);
    }
}

#[test]
fn identifying_a_runs_recording_again_gives_the_same_numbers() {
    let run = quick_run(&[]);
    let json = kincal(run.folder.path(), &["identify", &run.text("arm8.mcap"), "--json"]).ends(0).json();
    assert_eq!(identification(json), run.json["identification"]);
    let urdf = |name: &str| fs::read(run.path(name)).unwrap();
    assert_eq!(urdf("arm8-identified.urdf"), urdf("arm8.calibrated.urdf"));
}

#[test]
fn another_recording_carries_the_held_out_error() {
    let run = quick_run(&[]);
    let other = quick_run(&["--set", "plan.held_out_count=60"]);
    let arguments = ["identify", &run.text("arm8.mcap"), "--evaluate", &other.text("arm8.mcap"), "--json"];
    let json = kincal(run.folder.path(), &arguments).ends(0).json();
    // All of the other's rows, whatever they were for there; the fit is the same.
    assert_eq!(json["held_out"]["count"], 100);
    assert_eq!(json["parameters"], run.json["identification"]["parameters"]);
    assert!(number(&json, "/held_out/position_m/mean") * 10.0 < number(&json, "/held_out_nominal/position_m/mean"));
}

#[test]
fn a_table_of_the_same_measurements_gives_about_the_same_error() {
    let run = quick_run(&[]);
    let out = run.folder.path();
    kincal(out, &["export", &run.text("arm8.mcap"), "--to", "csv"]).ends(0);
    let arguments = ["identify", &run.text("arm8.csv"), "--robot", &run.text("arm8.urdf"), "--json"];
    let json = kincal(out, &arguments).ends(0).json();
    let of_recording = &run.json["identification"];
    assert_eq!(json["held_out"]["count"], 50);
    for pointer in ["/held_out/position_m/mean", "/held_out/rotation_rad/mean"] {
        let ratio = number(&json, pointer) / number(of_recording, pointer);
        println!("{pointer}: {ratio:.4} times the recording's");
        assert!((0.8..1.25).contains(&ratio), "{pointer}: {ratio}");
    }
    // The scene as robot is the same robot.
    let of_scene = kincal(out, &["identify", &run.text("arm8.csv"), "--robot", "scenes/arm8.toml", "--json"]).ends(0).json();
    let ratio = number(&of_scene, "/held_out/position_m/mean") / number(&json, "/held_out/position_m/mean");
    assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
}

#[test]
fn the_exported_scene_repeats_the_design() {
    let run = quick_run(&[]);
    let out = run.folder.path();
    kincal(out, &["export", &run.text("arm8.mcap"), "--to", "toml"]).ends(0);
    let public = run.text("arm8.public.toml");
    let design = kincal(out, &["design", &public, "--json"]).ends(0).json();
    assert_eq!(design["design"], run.json["design"]);
    let refused = kincal(out, &["run", &public]).ends(2);
    assert!(
        refused.stderr.contains("no [injected] section") && refused.stderr.contains("arm8.public.toml"),
        "{}",
        refused.stderr
    );
}

/// A session as one plans it: repeats, payloads, a side to come from. Its recording, its table and its replay know of it.
#[test]
fn a_planned_session_is_measured_exported_identified_and_replayed() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    let path = |name: &str| out.join(name).to_str().unwrap().to_owned();
    kincal(out, &[&["design", "scenes/arm8.toml"], &QUICK[..]].concat()).ends(0);
    let (designed, recording, truth) = (path("arm8-design.mcap"), path("arm8-measure.mcap"), path("arm8-measure.truth.toml"));
    let measure = [&["measure", "scenes/arm8.toml", "--design", &designed, "--json"], &QUICK[..]].concat();
    let note = "the noise cannot be estimated";
    let once = kincal(out, &measure).ends(0);
    assert!(once.stderr.contains(note), "{}", once.stderr);
    let plan = [
        "plan.repeats=2",
        "plan.approach=\"random\"",
        "plan.payloads_kg=[0, 5]",
        "plan.payload_blocks=true",
        "plan.dwell_s=2",
        "plan.temperature.lag_s=300",
        "plan.temperature.ambient_rise_k=2",
    ];
    let planned = [&measure[..], &plan.iter().flat_map(|set| ["--set", set]).collect::<Vec<_>>()].concat();
    let measured = kincal(out, &planned).ends(0);
    assert!(!measured.stderr.contains(note), "{}", measured.stderr);
    assert_eq!(measured.json()["poses"], 180);

    kincal(out, &["export", &recording, "--to", "csv"]).ends(0);
    let table = fs::read_to_string(path("arm8-measure.csv")).unwrap();
    let mut rows = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = rows.next().unwrap();
    let rows: Vec<Vec<&str>> = rows.collect();
    let column = |name: &str| {
        let at = header.iter().position(|column| *column == name).unwrap_or_else(|| panic!("no {name} in {header:?}"));
        rows.iter().map(move |row| row[at]).collect::<Vec<_>>()
    };
    assert_eq!(rows.len(), 180);
    assert_eq!(column("payload_kg"), [["0"; 90], ["5"; 90]].concat());
    assert!(column("dwell_s").iter().all(|dwell| *dwell == "2"));
    for joint in 1..=8 {
        let ups = column(&format!("approach{joint}")).iter().filter(|direction| **direction == "1").count();
        // Pairs of repeats: 90 coins, five sigma.
        assert!((90 - 48..=90 + 48).contains(&ups), "{ups} of 180");
    }
    let air: Vec<f64> = column("temp_ambient_c").iter().map(|air| air.parse().unwrap()).collect();
    // Noise of 0.1 K.
    assert!((air[0] - 20.0).abs() < 0.6 && (air[90] - 22.0).abs() < 0.6 && (air[179] - 20.0).abs() < 0.6, "{air:?}");
    let mut pose_ids: Vec<usize> = column("pose_id").iter().map(|id| id.parse().unwrap()).collect();
    pose_ids.sort_unstable();
    assert_eq!(pose_ids, (0..180).map(|row| row / 2).collect::<Vec<_>>());

    kincal(out, &["export", "scenes/arm8.toml", "--to", "urdf"]).ends(0);
    let identified = kincal(out, &["identify", &path("arm8-measure.csv"), "--robot", &path("arm8.urdf"), "--json"]).ends(0);
    assert!(identified.stderr.contains("an identification does not use approach1"), "{}", identified.stderr);
    assert_eq!(identified.json()["held_out"]["count"], 100);
    // Nobody declared its noise: it is estimated, and called so.
    assert_eq!(identified.json()["noise_estimated"], true);
    assert!(identified.stdout.contains("no noise was declared: it is estimated from what is left"), "{}", identified.stdout);
    let declared = ["identify", &path("arm8-measure.csv"), "--robot", &path("arm8.urdf"), "--json", "--position-noise-um", "30"];
    assert!(kincal(out, &declared).json()["noise_estimated"].is_null());
    kincal(out, &["replay", &recording]).ends(0);
    kincal(out, &["replay", &recording, "--truth", &truth]).ends(0);
}
