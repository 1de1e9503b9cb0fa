//! `kincal replay`: identical, different, cut off, damaged, not a recording.

use std::fs;

use crate::harness::{Ran, Run, kincal, next_up, quick_run, rewrite_text, without_topic};

fn replay(run: &Run, recording: &str, more: &[&str]) -> Ran {
    let path = run.text(recording);
    kincal(&run.path("replayed"), &[&["replay", path.as_str()], more].concat())
}

#[test]
fn a_recording_replays_bit_for_bit_with_and_without_its_truth() {
    let run = quick_run(&[]);
    let without = replay(&run, "arm8.mcap", &["--json"]).ends(0).json();
    assert_eq!((&without["identical"], &without["complete"]), (&true.into(), &true.into()));
    assert!(without["truth_identical"].is_null() && without["first_difference"].is_null());
    assert_eq!(without["messages_compared"], crate::harness::messages(&run.path("arm8.mcap")).len());
    let with = replay(&run, "arm8.mcap", &["--truth", &run.text("arm8.truth.toml"), "--json", "--threads", "1"]).ends(0).json();
    assert_eq!((&with["identical"], &with["truth_identical"]), (&true.into(), &true.into()));
    // Replaying leaves no files.
    assert_eq!(crate::harness::names(&run.path("replayed")), Vec::<String>::new());
}

/// As versions before the diagnosis recorded: without it, and nothing is missing.
#[test]
fn a_recording_without_a_diagnosis_replays() {
    let run = quick_run(&[]);
    let (old, new) = (run.path("old.mcap"), run.path("arm8.mcap"));
    let dropped = without_topic(&new, &old, "/diagnosis");
    assert_eq!(dropped, 1);
    let json = replay(&run, "old.mcap", &["--truth", &run.text("arm8.truth.toml"), "--json"]).ends(0).json();
    let count = crate::harness::messages(&new).len() - 1;
    assert_eq!((&json["identical"], &json["messages_compared"]), (&true.into(), &count.into()));
}

/// Whatever chooses, the number of threads changes no byte, every step is recorded, and the recording replays.
#[test]
fn every_method_is_recorded_and_replays_bit_for_bit() {
    for method in kincal::design::problem::Method::ALL.map(kincal::design::problem::Method::name) {
        let assignment = format!("design.method={method}");
        let set = [&assignment, "design.budget=300", "design.pool=60", "design.count=8", "plan.held_out_count=5"];
        let set: Vec<&str> = set.into_iter().flat_map(|assignment| ["--set", assignment]).collect();
        let [one, two] = ["1", "2"].map(|threads| quick_run(&[&set[..], &["--threads", threads]].concat()));
        for name in ["arm8.mcap", "arm8.truth.toml"] {
            let [one, two] = [&one, &two].map(|run| fs::read(run.path(name)).unwrap());
            assert!(one == two, "{method}: {name} differs between one thread and two");
        }
        let messages = crate::harness::messages(&one.path("arm8.mcap"));
        let count = |topic: &str| messages.iter().filter(|(at, _)| at == topic).count();
        let steps = if method == "pso" { ["/design/swarm", "/design/search"] } else { ["/design/search", "/design/swarm"] };
        assert!(count(steps[0]) > 0 && count(steps[1]) == 0, "{method}");
        assert!(count("/design/best/end_points") > 1, "{method}: the start's and one with points");
        // The last step told the set that is measured.
        let last = messages.iter().rfind(|(topic, _)| topic == steps[0]).unwrap();
        let last: serde_json::Value = serde_json::from_slice(&last.1).unwrap();
        let design = &one.json["design"];
        if method != "pso" {
            assert_eq!(last["best"], design["value"], "{method}");
            assert!(last["evaluations"].as_u64() <= design["evaluations"].as_u64(), "{method}");
        }
        assert_eq!((&design["method"], &design["criterion"]), (&method.into(), &"comprehensive".into()));
        let truth = one.text("arm8.truth.toml");
        let json = replay(&one, "arm8.mcap", &["--truth", &truth, "--threads", "1", "--json"]).ends(0).json();
        assert_eq!((&json["identical"], &json["messages_compared"]), (&true.into(), &messages.len().into()), "{method}");
    }
}

#[test]
fn a_changed_step_of_a_search_is_found_and_a_cut_one_is_compared_up_to_the_cut() {
    let set = ["design.method=detmax", "design.criterion=i_optimality", "design.budget=3000", "design.pool=60"];
    let set: Vec<&str> = set.into_iter().flat_map(|assignment| ["--set", assignment]).collect();
    let run = quick_run(&set);
    let changed = run.path("changed.mcap");
    rewrite_text(&run.path("arm8.mcap"), &changed, "/design/search", 1, |text| next_up(text, "/best_configurations/3/joints/2"));
    let ran = replay(&run, "changed.mcap", &[]).ends(1);
    assert!(ran.stdout.starts_with("different: /design/search[1].best_configurations[3].joints[2]: recorded "), "{}", ran.stdout);
    let bytes = fs::read(run.path("arm8.mcap")).unwrap();
    for share in [5, 3, 2] {
        fs::write(run.path("cut.mcap"), &bytes[..bytes.len() / share]).unwrap();
        let json = replay(&run, "cut.mcap", &["--json"]).ends(2).json();
        assert!(json["first_difference"].is_null() && json["messages_compared"].as_u64().unwrap() > 0, "{json}");
    }
}

#[test]
fn a_truth_file_of_another_run_is_refused() {
    let (run, other) = (quick_run(&[]), quick_run(&["--seed", "7"]));
    let ran = replay(&run, "arm8.mcap", &["--truth", &other.text("arm8-seed7.truth.toml")]).ends(2);
    assert!(ran.stderr.contains("with seed 7, the recording to `arm8` with seed 2019"), "{}", ran.stderr);
    for wrong in ["arm8.mcap", "arm8.urdf", "missing.toml"] {
        let ran = replay(&run, "arm8.mcap", &["--truth", &run.text(wrong)]).ends(2);
        assert!(ran.stderr.contains(wrong), "{}", ran.stderr);
    }
}

#[test]
fn an_edited_truth_file_differs() {
    let run = quick_run(&[]);
    let text = fs::read_to_string(run.path("arm8.truth.toml")).unwrap();
    let check = |old: &str, new: &str, code: i32, expected: &str| {
        assert!(text.contains(old), "{old}");
        fs::write(run.path("edited.toml"), text.replacen(old, new, 1)).unwrap();
        let ran = replay(&run, "arm8.mcap", &["--truth", &run.text("edited.toml")]).ends(code);
        assert!(format!("{}{}", ran.stdout, ran.stderr).contains(expected), "{}{}", ran.stdout, ran.stderr);
    };
    check("length_mm = 1.0", "length_mm = 1.000001", 1, "different: /measurement[0].");
    check("radial_um = 30.0", "radial_um = 31.0", 1, "different: /measurement[");
    check("true_value = ", "true_value = 0.125 # ", 1, "the truth file differs from the physics: alpha1 is 0.125 there");
    check("length_mm = 1.0", "length_mm = -1.0", 2, "injected.parameters.length_mm");
    check("length_mm = 1.0", "length_mm = \"1\"", 2, "injected.parameters.length_mm");
    check("radial_um = 30.0", "radial_um = 1e5", 2, "radial_um");
    check("version = ", "versions = ", 2, "not a truth file");
}

#[test]
fn a_changed_number_is_found_and_named() {
    let run = quick_run(&[]);
    let changed = run.path("changed.mcap");
    let truth = run.text("arm8.truth.toml");
    let check = |topic: &str, number, pointer: &'static str, more: &[&str], expected: &str| {
        rewrite_text(&run.path("arm8.mcap"), &changed, topic, number, |text| next_up(text, pointer));
        let ran = replay(&run, "changed.mcap", more).ends(1);
        assert!(ran.stdout.starts_with(&format!("different: {expected}: recorded ")), "{expected}: {}", ran.stdout);
        let json = replay(&run, "changed.mcap", &[more, &["--json"]].concat()).ends(1).json();
        assert!(json["identical"] == false && json["first_difference"].as_str().unwrap().starts_with(expected), "{json}");
    };
    check("/measurement", 3, "/position_m/1", &["--truth", &truth], "/measurement[3].position_m[1]");
    check("/measurement", 5, "/joints/7", &["--truth", &truth], "/measurement[5].joints[7]");
    check("/design/swarm", 2, "/best/o1", &[], "/design/swarm[2].best.o1");
    check("/design/outcome", 0, "/configurations/4/joints/2", &[], "/design/outcome[0].configurations[4].joints[2]");
    check("/diagnosis", 0, "/residuals/5/before_m/1", &[], "/diagnosis[0].residuals[5].before_m[1]");
    check("/identification", 0, "/parameters/3/identified", &[], "/identification[0].parameters[3].identified");
    // Without the truth a measurement is taken as recorded, but what was derived from it no longer fits.
    rewrite_text(&run.path("arm8.mcap"), &changed, "/measurement", 3, |text| next_up(text, "/position_m/1"));
    let ran = replay(&run, "changed.mcap", &[]).ends(1);
    assert!(ran.stdout.starts_with("different: /measurement/pose_measured[3]."), "{}", ran.stdout);
}

#[test]
fn a_changed_scene_is_found_or_refused() {
    let run = quick_run(&[]);
    let changed = run.path("changed.mcap");
    let with_scene = |old: &str, new: &str| {
        rewrite_text(&run.path("arm8.mcap"), &changed, "/run", 0, |text| text.replacen(old, new, 1));
        replay(&run, "changed.mcap", &[])
    };
    let ran = with_scene("seed = 2019", "seed = 2020").ends(1);
    assert!(ran.stdout.starts_with("different: /design/swarm"), "{}", ran.stdout);
    let ran = with_scene("random_sets = 30", "random_sets = 29").ends(1);
    assert!(ran.stdout.starts_with("different: /design/outcome[0].advice.random."), "{}", ran.stdout);
    let ran = with_scene("random_sets = 30", "random_sets = -1").ends(2);
    assert!(ran.stderr.contains("changed.mcap (scene)") && ran.stderr.contains("design.random_sets"), "{}", ran.stderr);
    with_scene("seed = 2019", "seed = 2019 # a comment").ends(0);
    // What another version makes by other methods is not compared, and that is said; all else is.
    let version = |changed: &str| changed.replacen("0.0.0", env!("CARGO_PKG_VERSION"), 1);
    let older = "\"version\":\"0.0.0";
    let ran = with_scene(&version(older), older).ends(0);
    assert!(ran.stdout.contains("identical as far as it can be compared"), "{}", ran.stdout);
    assert!(ran.stdout.contains("recorded by kincal 0.0.0"), "{}", ran.stdout);
}

#[test]
fn a_damaged_recording_is_called_damaged() {
    let run = quick_run(&[]);
    let bytes = fs::read(run.path("arm8.mcap")).unwrap();
    // Anywhere but in the magic at both ends, which is what tells a recording from other files.
    for at in (1..10).map(|tenth| bytes.len() * tenth / 10).chain([bytes.len() - 9]) {
        let mut altered = bytes.clone();
        altered[at] ^= 0x10;
        fs::write(run.path("damaged.mcap"), &altered).unwrap();
        let ran = replay(&run, "damaged.mcap", &[]).ends(2);
        assert!(ran.stderr.contains("is damaged at byte") && !ran.stderr.contains("cut off"), "{at}: {}", ran.stderr);
        assert_eq!(ran.stderr.matches("damaged.mcap").count(), 1, "{}", ran.stderr);
    }
}

#[test]
fn a_cut_recording_is_compared_up_to_the_cut() {
    let run = quick_run(&[]);
    let bytes = fs::read(run.path("arm8.mcap")).unwrap();
    let mut last = 0;
    for share in [4, 3, 2] {
        fs::write(run.path("cut.mcap"), &bytes[..bytes.len() / share]).unwrap();
        for more in [vec![], vec!["--truth".to_owned(), run.text("arm8.truth.toml")]] {
            let more: Vec<&str> = more.iter().map(String::as_str).collect();
            let ran = replay(&run, "cut.mcap", &[&more[..], &["--json"]].concat()).ends(2);
            assert!(ran.stderr.contains("cut.mcap is cut off") && !ran.stderr.contains("damaged"), "{}", ran.stderr);
            let json = ran.json();
            assert!(json["identical"] == false && json["complete"] == false && json["first_difference"].is_null(), "{json}");
            let compared = json["messages_compared"].as_u64().unwrap();
            assert!(compared >= last && compared > 0, "{json}");
            last = compared;
        }
    }
    // What is there can be used when that is asked for, and is not when it is not.
    for command in [&["export", "--to", "csv"][..], &["identify"]] {
        let path = run.text("cut.mcap");
        let arguments = [&command[..1], &[&path], &command[1..]].concat();
        let ran = kincal(&run.path("refused"), &arguments).ends(2);
        assert!(ran.stderr.contains("cut off") && ran.stderr.contains("--partial"), "{}", ran.stderr);
        assert_eq!(crate::harness::names(&run.path("refused")), Vec::<String>::new());
        kincal(&run.path("used"), &[&arguments[..], &["--partial"]].concat()).ends(0);
    }
    assert_eq!(crate::harness::names(&run.path("used")), ["cut-identified.mcap", "cut-identified.urdf", "cut.csv"]);
}

#[test]
fn a_recording_of_a_table_replays_and_can_be_identified_and_exported() {
    let run = quick_run(&[]);
    let out = run.path("table");
    kincal(&out, &["export", &run.text("arm8.mcap"), "--to", "csv"]).ends(0);
    let identify = ["identify", &run.text("table/arm8.csv"), "--robot", &run.text("arm8.urdf"), "--json"];
    let first = kincal(&out, &identify).ends(0).json();
    let recording = first["recording"].as_str().unwrap();
    assert_eq!(replay(&run, "table/arm8-identified.mcap", &["--json"]).ends(0).json()["identical"], true);
    let again = kincal(&run.path("again"), &["identify", recording, "--json"]).ends(0).json();
    assert_eq!(again["parameters"], first["parameters"]);
    assert_eq!(again["held_out"], first["held_out"]);
    // Its measurements and its calibrated arm come out as they went in; a scene it never had.
    for (format, name, same) in [("csv", "csv", "table/arm8.csv"), ("urdf", "calibrated.urdf", "table/arm8-identified.urdf")] {
        kincal(&run.path("exported"), &["export", recording, "--to", format]).ends(0);
        let read = |path: &str| fs::read(run.path(path)).unwrap();
        assert!(read(&format!("exported/arm8-identified.{name}")) == read(same), "{format}");
    }
    let ran = kincal(&run.path("exported"), &["export", recording, "--to", "toml"]).ends(2);
    assert!(ran.stderr.contains("holds no scene"), "{}", ran.stderr);
    let ran = replay(&run, "table/arm8-identified.mcap", &["--truth", &run.text("arm8.truth.toml")]).ends(2);
    assert!(ran.stderr.contains("--truth"), "{}", ran.stderr);
    // Cut off, it does not pretend to differ.
    let bytes = fs::read(recording).unwrap();
    for share in [6, 3, 2] {
        fs::write(run.path("cut.mcap"), &bytes[..bytes.len() / share]).unwrap();
        let ran = replay(&run, "cut.mcap", &[]).ends(2);
        assert!(ran.stderr.contains("cut.mcap is cut off") && !ran.stdout.contains("different"), "{}{}", ran.stdout, ran.stderr);
    }
}

#[test]
fn what_is_no_recording_is_named_for_what_it_is() {
    let run = quick_run(&[]);
    fs::write(run.path("empty.mcap"), "").unwrap();
    fs::create_dir(run.path("folder.mcap")).unwrap();
    fs::write(run.path("start.mcap"), &fs::read(run.path("arm8.mcap")).unwrap()[..20]).unwrap();
    for (name, expected) in [
        ("arm8.urdf", "is no MCAP file"),
        ("empty.mcap", "is empty"),
        ("folder.mcap", "Is a directory"),
        ("missing.mcap", "No such file"),
        ("start.mcap", "is cut off"),
    ] {
        let ran = replay(&run, name, &[]).ends(2);
        assert!(ran.stderr.contains(expected) && ran.stdout.is_empty(), "{}", ran.stderr);
        assert_eq!(ran.stderr.matches(name).count(), 1, "{}", ran.stderr);
    }
}

#[test]
fn a_measurement_with_conditions_is_measured_again() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    let path = |name: &str| out.join(name).to_str().unwrap().to_owned();
    let quick = [
        "--set",
        "design.method=random",
        "--set",
        "design.random_sets=1",
        "--set",
        "design.pool=60",
        "--set",
        "plan.held_out_count=7",
        "--set",
        "design.count=12",
        "--set",
        "plan.seconds_per_pose=7.3",
        "--set",
        "injected.effect=[{kind=\"backlash\",joint=\"joint3\",\
        width_arcsec=60},{kind=\"joint_compliance\",joint=\"joint2\",stiffness_nm_per_rad=2e4},{kind=\"link_thermal_growth\",\
        expansion_um_per_m_per_k=23}]",
    ];
    for (approach, blocks) in [("random", "false"), ("direct", "true")] {
        let (approach, blocks) = (format!("plan.approach={approach}"), format!("plan.payload_blocks={blocks}"));
        let more = [&quick[..], &["--set", &approach, "--set", &blocks]].concat();
        kincal(out, &[&["design", "scenes/gap.toml"], &more[..]].concat()).ends(0);
        kincal(out, &[&["measure", "scenes/gap.toml", "--design", &path("gap-design.mcap")], &more[..]].concat()).ends(0);
        let measurements: Vec<serde_json::Value> = crate::harness::messages(&out.join("gap-measure.mcap"))
            .into_iter()
            .filter(|(topic, _)| topic == "/measurement")
            .map(|(_, bytes)| serde_json::from_slice(&bytes).unwrap())
            .collect();
        assert_eq!(measurements.len(), 38);
        let loaded = measurements.iter().filter(|row| row["payload_kg"] == 5.0).count();
        assert_eq!(loaded, 2 * (12 / 2 + 7 / 2));
        assert!(measurements.iter().all(|row| row["ambient_c"].is_f64() && row["dwell_s"] == 2.0));
        let truth = path("gap-measure.truth.toml");
        let json = kincal(out, &["replay", &path("gap-measure.mcap"), "--truth", &truth, "--json"]).ends(0).json();
        assert_eq!((&json["identical"], &json["truth_identical"]), (&true.into(), &true.into()));
        // The beginning of a session knows how long it would have been.
        let bytes = fs::read(path("gap-measure.mcap")).unwrap();
        fs::write(path("cut.mcap"), &bytes[..bytes.len() * 2 / 3]).unwrap();
        let json = kincal(out, &["replay", &path("cut.mcap"), "--truth", &truth, "--json"]).ends(2).json();
        assert!(json["first_difference"].is_null() && json["messages_compared"].as_u64().unwrap() > 100, "{json}");
        // What the table says of its conditions is what the recording says.
        kincal(out, &["export", &path("gap-measure.mcap"), "--to", "csv"]).ends(0);
        let table = fs::read_to_string(path("gap-measure.csv")).unwrap();
        for column in ["approach8", "temp_ambient_c", "temp8_c", "payload_kg", "dwell_s"] {
            assert!(table.lines().next().unwrap().split(',').any(|name| name == column), "{column}");
        }
    }
}
