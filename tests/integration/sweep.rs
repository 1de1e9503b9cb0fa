//! `kincal sweep`: what it says, and that neither a kill nor shards change a byte of it.

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::harness::{Ran, command, kincal, messages, names, number};

/// A quick sweep: two cells, 12 configurations.
const QUICK: [&str; 12] = [
    "sweep",
    "scenes/arm8.toml",
    "--effect",
    "radial_clearance",
    "--at",
    "joint3",
    "--magnitudes",
    "0,60um",
    "--poses",
    "12",
    "--method",
    "random",
];

fn sweep(out: &Path, more: &[&str]) -> Ran {
    kincal(out, &[&QUICK[..], more].concat())
}

/// Every file of a sweep with its bytes.
fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    names(folder).into_iter().map(|name| (name.clone(), fs::read(folder.join(name)).unwrap())).collect()
}

fn assert_same(one: &Path, other: &Path) {
    let (one, other) = (files(one), files(other));
    let listed = |files: &[(String, Vec<u8>)]| files.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    assert_eq!(listed(&one), listed(&other));
    assert_eq!(one.len(), 6, "{:?}", listed(&one));
    for ((name, one), (_, other)) in one.iter().zip(&other) {
        assert!(one == other, "{name} differs");
    }
}

#[test]
fn play_of_a_joint_biases_what_is_identified_and_geometry_swallows_most_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let mut arguments = QUICK.to_vec();
    arguments[9] = "40";
    arguments.extend(["--trials", "60", "--json", "--set", "plan.held_out_count=10"]);
    let json = kincal(folder.path(), &arguments).ends(0).json();
    let [none, play] = [&json["cells"][0], &json["cells"][1]];
    assert_eq!((none["effect"].as_str(), play["effect"].as_str()), (Some("none"), Some("radial_clearance")));
    assert!(number(none, "/held_out_m/mean") < number(play, "/held_out_m/mean"));
    // A disc of 60 µm, seated anywhere in it by the load, moves the tool by 60 µm or not at all.
    assert!((30e-6..60e-6 + 1e-9).contains(&number(play, "/displacement_m/mean")));
    assert!((0.2..1.0).contains(&number(play, "/swallowed/mean")), "{}", play["swallowed"]);
    // Without effects nothing is biased: the mean of 60 errors is within 0.13 standard errors, four times that for 36 of them at once.
    let worst = |cell: &Value| {
        let combinations = cell["combinations"].as_array().unwrap();
        combinations.iter().map(|one| number(one, "/bias_in_standard_errors").abs()).fold(0.0, f64::max)
    };
    assert!(worst(none) < 0.55, "{}", worst(none));
    assert!(worst(play) > 2.0, "{}", worst(play));
    assert!(none["displacement_m"].is_null() && none["swallowed"].is_null());
    // The table is in the recording, with the text that people read.
    let recorded = messages(&folder.path().join("arm8-sweep.mcap"));
    let topics: Vec<&str> = recorded.iter().map(|(topic, _)| topic.as_str()).collect();
    assert_eq!(topics.iter().filter(|topic| **topic == "/sweep/cell").count(), 2);
    let cell: Value = serde_json::from_slice(&recorded.iter().rfind(|(topic, _)| topic == "/sweep/cell").unwrap().1).unwrap();
    assert_eq!(&cell, play);
    let log = &recorded.iter().find(|(topic, _)| topic == "/log").unwrap().1;
    assert!(String::from_utf8_lossy(log).contains("swallowed (%)"));
}

#[test]
fn stated_intervals_hold_the_truth_where_nothing_is_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["--magnitudes", "0um", "--poses", "15", "--method", "random", "--trials", "500", "--json"];
    let arguments =
        [&["sweep", "scenes/arm8.toml", "--effect", "radial_clearance", "--set", "plan.held_out_count=1"][..], &arguments]
            .concat();
    let json = kincal(folder.path(), &arguments).ends(0).json();
    let coverage = &json["cells"][0]["coverage"];
    assert_eq!(number(coverage, "/trials"), 500.0);
    let mean = number(coverage, "/mean");
    assert!((0.93..=0.97).contains(&mean), "{coverage}");
    // Each combination by itself: four standard deviations of a share of 500.
    for combination in json["cells"][0]["combinations"].as_array().unwrap() {
        let share = number(combination, "/coverage");
        assert!((0.95 - 0.039..=0.95 + 0.039).contains(&share), "{combination}");
    }
}

#[test]
fn shards_and_threads_change_no_byte() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    sweep(&at("whole"), &["--trials", "3..12"]).ends(0);
    sweep(&at("a"), &["--trials", "3..7", "--threads", "1"]).ends(0);
    sweep(&at("b"), &["--trials", "6..10"]).ends(0);
    sweep(&at("c"), &["--trials", "10..12"]).ends(0);
    let part = |name: &str| at(name).join("arm8-sweep.jsonl").to_str().unwrap().to_owned();
    // In any order, folders or files; trial 6 is in two parts.
    let [b, c] = [part("b"), at("c").to_str().unwrap().to_owned()];
    kincal(&at("merged"), &["sweep", "--merge", &c, &part("a"), &b]).ends(0);
    assert_same(&at("whole"), &at("merged"));
    let gap = kincal(&at("gap"), &["sweep", "--merge", &part("a"), &c]).ends(2);
    assert!(gap.stderr.contains("--trials 7..10"), "{}", gap.stderr);
    assert!(names(&at("gap")).is_empty());
    let within = kincal(&at("a"), &["sweep", "--merge", &part("a"), &b]).ends(2);
    assert!(within.stderr.contains("would be overwritten"), "{}", within.stderr);
}

#[test]
fn a_killed_sweep_goes_on_behind_what_it_had_finished() {
    let folder = tempfile::tempdir().unwrap();
    let (whole, killed) = (folder.path().join("whole"), folder.path().join("killed"));
    let trials = ["--trials", "150"];
    sweep(&whole, &trials).ends(0);
    let results = killed.join("arm8-sweep.jsonl");
    let lines = || fs::read(&results).map_or(0, |bytes| bytes.iter().filter(|byte| **byte == b'\n').count());
    let mut child = command(&[&QUICK[..], &trials, &["--out", killed.to_str().unwrap()]].concat())
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let start = Instant::now();
    while lines() < 20 && start.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let finished = lines();
    assert!((20..301).contains(&finished), "{finished} lines when it was killed");
    // What was being written when it was killed may be torn anywhere.
    let mut bytes = fs::read(&results).unwrap();
    bytes.extend(b"{\"trial\":77,\"cel");
    fs::write(&results, bytes).unwrap();
    let before = fs::read(&results).unwrap();
    let ran = sweep(&killed, &trials).ends(0);
    assert!(ran.stderr.contains(&format!("going on behind {} of 300 trials", finished - 1)), "{}", ran.stderr);
    let kept = before.len() - 16;
    assert!(fs::read(&results).unwrap()[..kept] == before[..kept], "what was finished has changed");
    assert_same(&whole, &killed);
    // Again: nothing is left to do.
    sweep(&killed, &trials).ends(0);
    assert_same(&whole, &killed);
}

#[test]
fn a_file_of_another_sweep_is_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    sweep(folder.path(), &["--trials", "2..4"]).ends(0);
    let before = files(folder.path());
    for (more, says) in [
        (&["--trials", "2..4", "--poses", "13"][..], "holds results of another sweep"),
        (&["--trials", "2..4", "--set", "injected.parameters.length_mm=0.5"], "holds results of another sweep"),
        (&["--trials", "0..4"], "holds trials 2..3, asked for are 0..4"),
        (&["--trials", "2..3"], "asked for are 2..3"),
    ] {
        let ran = sweep(folder.path(), more).ends(2);
        assert!(ran.stderr.contains(says), "{}", ran.stderr);
    }
    assert!(files(folder.path()) == before);
    // More of the same goes on.
    sweep(folder.path(), &["--trials", "2..5"]).ends(0);
    let foreign = tempfile::tempdir().unwrap();
    fs::write(foreign.path().join("arm8-sweep.jsonl"), "my notes\n").unwrap();
    let ran = sweep(foreign.path(), &["--trials", "1"]).ends(2);
    assert!(ran.stderr.contains("arm8-sweep.jsonl:1"), "{}", ran.stderr);
    assert_eq!(fs::read_to_string(foreign.path().join("arm8-sweep.jsonl")).unwrap(), "my notes\n");
    fs::write(foreign.path().join("arm8-sweep.jsonl"), "my notes").unwrap();
    sweep(foreign.path(), &["--trials", "1"]).ends(2);
    assert_eq!(fs::read_to_string(foreign.path().join("arm8-sweep.jsonl")).unwrap(), "my notes");
}

#[test]
fn a_grid_in_a_file_is_the_grid_of_the_options() {
    let folder = tempfile::tempdir().unwrap();
    let grid = folder.path().join("grid.toml");
    let text = "effect = [\"radial_clearance\"]\nat = [\"3\"]\nmagnitudes = \"0,60um\"\nposes = [12]\nmethod = [\"random\"]\ntrials = \"2\"\n";
    fs::write(&grid, text).unwrap();
    let [one, other] = ["options", "file"].map(|name| folder.path().join(name));
    sweep(&one, &["--trials", "2"]).ends(0);
    kincal(&other, &["sweep", "scenes/arm8.toml", "--grid", grid.to_str().unwrap()]).ends(0);
    assert_same(&one, &other);
    fs::write(&grid, text.replace("poses", "pose")).unwrap();
    let ran = kincal(&other, &["sweep", "scenes/arm8.toml", "--grid", grid.to_str().unwrap()]).ends(2);
    assert!(ran.stderr.contains("grid.toml") && ran.stderr.contains("unknown field `pose`"), "{}", ran.stderr);
}

#[test]
fn what_cannot_be_swept_is_refused_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    for (more, says) in [
        (&["--effect", "rust"][..], "no such effect; there are joint_compliance"),
        (&["--effect", "backlash", "--at", "joint9"], "this arm has joint1"),
        (&["--effect", "backlash", "--magnitudes", "30"], "the unit of `30` is missing"),
        (&["--effect", "backlash", "--magnitudes", "30um"], "no unit of backlash; allowed: µrad, urad"),
        (&["--effect", "backlash", "--magnitudes", "-3urad"], "must be finite and not negative"),
        (&["--effect", "radial_clearance", "--magnitudes", "30mm"], "is no fault but another machine"),
        (&["--effect", "backlash", "--approach", "sideways"], "there are direct, up, down, alternate, random"),
        (&["--effect", "backlash", "--temperature", "hot"], "no such temperature"),
        (&["--effect", "backlash", "--payloads", "-1"], "0 to 1000 kg"),
        (&["--effect", "backlash", "--poses", "2"], "design.count"),
        (&["--effect", "backlash", "--trials", "0"], "--trials 0"),
        (&["--magnitudes", "30um"], "Name it: --effect"),
        (&["--merge", "nowhere.jsonl"], "--merge takes files of results and no scene"),
    ] {
        let ran = kincal(folder.path(), &[&["sweep", "scenes/arm8.toml"], more].concat()).ends(2);
        assert!(ran.stderr.contains(says), "{}", ran.stderr);
        assert!(names(folder.path()).is_empty(), "{:?}", names(folder.path()));
    }
    let ran = kincal(folder.path(), &["sweep"]).ends(2);
    assert!(ran.stderr.contains("which scene?"), "{}", ran.stderr);
}
