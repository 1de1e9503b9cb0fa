//! `kincal diagnose`: recordings and tables in, one object and an exit code out.

use std::fs;
use std::path::Path;

use kincal::measurement::Measurement;
use kincal::seed::stream;
use serde_json::Value;

use crate::harness::kincal;

/// A case with backlash, as a recording in `folder`.
fn case(folder: &Path) -> String {
    let arguments = ["challenge", "new", "--seed", "7391284650193849", "--cases", "1", "--kinds", "backlash", "--effects", "1"];
    kincal(folder, &arguments).ends(0);
    folder.join("case-0001.mcap").to_str().unwrap().to_owned()
}

#[test]
fn a_recording_and_its_table_get_the_same_answer() {
    let folder = tempfile::tempdir().unwrap();
    let case = case(folder.path());
    let ran = kincal(folder.path(), &["diagnose", &case, "--json"]);
    let json = ran.json();
    let verdict = json["verdict"].as_str().unwrap();
    let good = ["no_gap", "explained"].contains(&verdict);
    assert_eq!(ran.code, Some(i32::from(!good)), "{verdict}");
    // Bytes do not depend on the number of threads.
    assert_eq!(kincal(folder.path(), &["diagnose", &case, "--json", "--threads", "1"]).stdout, ran.stdout);

    kincal(folder.path(), &["export", &case, "--to", "csv"]).ends(0);
    kincal(folder.path(), &["export", &case, "--to", "toml"]).ends(0);
    let [table, scene] = ["csv", "toml"].map(|end| {
        let path = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().path());
        path.into_iter().find(|path| path.extension().is_some_and(|found| found == end)).unwrap().to_str().unwrap().to_owned()
    });
    let sigma = format!("{}", json["noise_floor"]["position_m"].as_f64().unwrap() * 1e6);
    let from_table =
        kincal(folder.path(), &["diagnose", &table, "--robot", &scene, "--position-noise-um", &sigma, "--json"]).json();
    assert_eq!(from_table["verdict"], json["verdict"]);
    let causes = |json: &Value| -> Vec<(Value, Value)> {
        json["effects"]
            .as_array()
            .unwrap()
            .iter()
            .map(|effect| (effect["kind"].clone(), effect["location"]["index"].clone()))
            .collect()
    };
    assert_eq!(causes(&from_table), causes(&json));

    // Without the columns that it needs a kind is switched off, and that is said.
    let text = fs::read_to_string(&table).unwrap();
    let names: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let keep: Vec<usize> = (0..names.len()).filter(|at| !names[*at].starts_with("approach")).collect();
    let fewer: Vec<String> = text
        .lines()
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            keep.iter().map(|at| cells[*at]).collect::<Vec<_>>().join(",")
        })
        .collect();
    let bare = folder.path().join("bare.csv");
    fs::write(&bare, fewer.join("\n")).unwrap();
    let diagnose = || kincal(folder.path(), &["diagnose", bare.to_str().unwrap(), "--robot", &scene, "--json"]).json();
    // Sides follow from the order of the rows, unless they have none.
    let notes = diagnose()["notes"].to_string();
    assert!(notes.contains("no columns of approach") && !notes.contains("no approach directions"), "{notes}");
    fs::write(&bare, format!("{}\n# order: unknown\n{}", fewer[0], fewer[1..].join("\n"))).unwrap();
    let blind = diagnose();
    let notes = blind["notes"].to_string();
    assert!(notes.contains("no approach directions"), "{notes}");
    assert!(blind["effects"].as_array().unwrap().iter().all(|effect| effect["kind"] != "backlash"));
    let undetectable = blind["undetectable"].as_array().unwrap();
    assert!(undetectable.iter().any(|one| one["kind"] == "backlash" && one["reason"] == "no approach directions were recorded"));
}

#[test]
fn the_report_begins_with_the_verdict_and_bad_input_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let case = case(folder.path());
    let report = kincal(folder.path(), &["diagnose", &case]).stdout;
    assert!(report.lines().next().unwrap().ends_with('.'), "{report}");
    assert!(report.contains("noise floor"), "{report}");
    let refused = |arguments: &[&str]| kincal(folder.path(), &[&["diagnose"], arguments].concat()).ends(2).stderr;
    assert!(refused(&[&case, "--without", "gremlins"]).contains("no such kind; known are joint_compliance"));
    assert!(refused(&[&case, "--robot", "x.urdf"]).contains("carries its own nominal arm"));
    let table = folder.path().join("few.csv");
    fs::write(&table, "q1_rad,x_m,y_m,z_m\n0,1,0,0\n").unwrap();
    assert!(refused(&[table.to_str().unwrap()]).contains("give its nominal robot with --robot"));
    assert!(refused(&[&case, "--gravity", "0,0,9.81"]).contains("a recording has its own; leave it out"));
    let gravity = |said: &str| refused(&["scenes/tutorial.csv", "--robot", "scenes/tutorial.urdf", "--gravity", said]);
    assert!(gravity("9.81,0").contains("--gravity 9.81,0: three numbers are needed, such as 0,0,-9.81"));
    assert!(gravity("0,0,-1").contains("gravity is 1.000 m/s² long; 9.81 is needed: these seem to be multiples of g"));
}

/// Backlash of 120″ in joint 3 of the session of `scenes/gap.toml`: named, simulated, confirmed; from a table, too, with a robot that has
/// no masses.
#[test]
fn what_is_named_is_confirmed_by_the_physics() {
    let folder = tempfile::tempdir().unwrap();
    let scene = "scenes/gap.toml";
    let settings = [
        "injected.effect=[{kind=\"backlash\",joint=\"joint3\",width_arcsec=120}]",
        "design.method=random",
        "design.count=50",
        "plan.held_out_count=10",
        "plan.repeats=1",
    ];
    let run: Vec<&str> = ["run", scene].into_iter().chain(settings.iter().flat_map(|setting| ["--set", setting])).collect();
    kincal(folder.path(), &run).ends(0);
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let recording = path("gap.mcap");
    let plain = kincal(folder.path(), &["diagnose", &recording, "--json"]).ends(0).json();
    // What the run has said of it, and shown, is the same.
    let again = kincal(folder.path(), &[&run[..], &["--json"]].concat()).ends(0).json();
    assert_eq!(again["diagnosis"], plain);
    if cfg!(feature = "viewer") {
        let shown = path("shown.rrd");
        kincal(folder.path(), &["diagnose", &recording, "--quiet", "--rerun", &shown]).ends(0);
        let bytes = fs::read(shown).unwrap();
        for entity in ["/world/diagnosis/1_backlash_joint_3/before", "/diagnosis/waterfall/bars", "/diagnosis/report"] {
            assert!(bytes.windows(entity.len()).any(|window| window == entity.as_bytes()), "{entity}");
        }
    }
    assert!(plain.get("confirmation").is_none());
    let ran = kincal(folder.path(), &["diagnose", &recording, "--confirm", "--json"]).ends(0);
    assert_eq!(kincal(folder.path(), &["diagnose", &recording, "--confirm", "--json", "--threads", "1"]).stdout, ran.stdout);
    let agrees = |json: &Value, noise: f64| {
        let confirmation = &json["confirmation"];
        assert_eq!(confirmation["verdict"], "confirmed", "{confirmation}");
        let steps = confirmation["steps"].as_array().unwrap();
        assert_eq!((steps.len(), &steps[0]["kind"], &steps[0]["location"]["index"]), (1, &"backlash".into(), &3.into()));
        let number = |key: &str| steps[0][key].as_f64().unwrap();
        assert!((number("physics_rms_m") - number("analytic_rms_m")).abs() < 0.01 * noise);
        assert!((number("physics_rms_m") - number("diagnosed_rms_m")).abs() < 0.2 * noise);
        assert!(number("physics_rms_m") < 0.6 * confirmation["geometry_rms_m"].as_f64().unwrap());
        assert!(number("displacement_rms_m") > 50e-6 && number("difference_max_m") < 0.1e-6);
    };
    let json = ran.json();
    agrees(&json, json["gap"]["noise_rms_m"].as_f64().unwrap());
    let report = kincal(folder.path(), &["diagnose", &recording, "--confirm"]).ends(0).stdout;
    assert!(report.contains("The physics does what the formulas say") && report.contains("+ backlash joint 3"), "{report}");

    kincal(folder.path(), &["export", &recording, "--to", "csv"]).ends(0);
    kincal(folder.path(), &["export", scene, "--to", "urdf"]).ends(0);
    let urdf = fs::read_to_string(path("gap.urdf")).unwrap();
    let parts: Vec<&str> = urdf.split("<inertial>").collect();
    assert!(parts.len() > 8);
    let rest = parts[1..].iter().map(|part| part.split_once("</inertial>").unwrap().1);
    fs::write(path("bare.urdf"), parts[..1].iter().copied().chain(rest).collect::<String>()).unwrap();
    let arguments =
        ["diagnose", &path("gap.csv"), "--robot", &path("bare.urdf"), "--position-noise-um", "30", "--confirm", "--json"];
    let json = kincal(folder.path(), &arguments).json();
    agrees(&json, json["gap"]["noise_rms_m"].as_f64().unwrap());
}

/// A table of an arm of `robot`'s kind that only its geometry has wrong, read with uniform noise (so that no reading is far off and
/// weighted down) in a frame of its own; `tilt`: share of 1.5 rad by which that may lean.
fn clean_table(robot: &kincal::arm::Arm, orientation: bool, tilt: f64) -> Vec<Measurement> {
    let mut stream = stream(7, "test/diagnose/clean");
    let mut noise = |size: f64| nalgebra::Vector3::from_fn(|_, _| stream.uniform(-size, size));
    let base = nalgebra::Isometry3::new(noise(2.0), noise(1.5).component_mul(&nalgebra::Vector3::new(tilt, tilt, 1.0)));
    let target = nalgebra::Isometry3::new(noise(0.1), noise(1.5));
    let mut values = robot.chain.nominal();
    for (value, parameter) in values.iter_mut().zip(&robot.chain.parameters) {
        *value += noise(if parameter.quantity.unit() == "m" { 1e-3 } else { 2e-3 }).x;
    }
    let chain = robot.chain.at(&values);
    (0..80)
        .map(|index| {
            let joints: Vec<f64> = robot
                .chain
                .joints
                .iter()
                .map(|joint| 0.5 * (joint.lower + joint.upper) + 0.5 * (joint.upper - joint.lower) * noise(1.0).x)
                .collect();
            let pose = base * chain.forward(&joints) * target;
            let turn = nalgebra::UnitQuaternion::from_scaled_axis(noise(3f64.sqrt() * 1e-4)) * pose.rotation;
            Measurement {
                index,
                pose_id: index,
                time_s: index as f64,
                joints,
                position_m: (pose.translation.vector + noise(3f64.sqrt() * 2e-5)).into(),
                orientation_xyzw: orientation.then(|| turn.coords.into()),
                ..Measurement::default()
            }
        })
        .collect()
}

/// The same is left of every reading, to a nanometre.
fn check_same_geometry(identified: &Value, diagnosed: &Value) {
    let residuals = |json: &Value, key: &str| -> Vec<f64> {
        let rows = json["residuals"].as_array().unwrap().iter();
        rows.flat_map(|row| row[key].as_array().unwrap()[..3].iter().map(|value| value.as_f64().unwrap())).collect()
    };
    let (one, other) = (residuals(identified, "identified"), residuals(diagnosed, "before_m"));
    let apart = one.iter().zip(&other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    println!("at most {apart:.1e} m apart; {}", diagnosed["sentence"]);
    assert!(one.len() == 240 && other.len() == 240 && apart < 1e-9, "{apart:e} m");
}

/// A camera above sees x and y; or some readings lack z.
#[test]
fn x_and_y_alone_are_identified_and_diagnosed() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    let table = out.join("table.csv").to_str().unwrap().to_owned();
    let arm = kincal::scene::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/arm8.toml")).unwrap().scene.arm;
    for all in [true, false] {
        let mut rows = clean_table(&arm, false, 0.05);
        for row in rows.iter_mut().filter(|row| all || row.index % 3 == 0) {
            row.unread[2] = true;
        }
        let text = kincal::measurement::table::write(&rows, &[]).unwrap();
        assert_eq!(text.lines().next().unwrap().contains("z_m"), !all);
        fs::write(&table, text).unwrap();
        let run = |command: &str| {
            kincal(out, &[command, &table, "--robot", "scenes/arm8.toml", "--position-noise-um", "20", "--json"]).json()
        };
        let (identified, diagnosed) = (run("identify"), run("diagnose"));
        check_same_geometry(&identified, &diagnosed);
        assert!(identified["converged"] == true, "{}", identified["reason"]);
        assert_eq!(identified["equations"], if all { 160 } else { 240 - 27 });
        // Noise of two axes or three is left, and what cannot be known of the base is said.
        let rms = identified["fitted"]["position_m"]["rms"].as_f64().unwrap();
        assert!((5e-6..4e-5).contains(&rms), "{rms}");
        assert_eq!(identified["notes"].to_string().contains("z was never read"), all, "{}", identified["notes"]);
        assert_eq!(diagnosed["readings"], 80);
    }
}

/// Every number that `identify` leaves of a reading is what `diagnose` leaves of it.
#[test]
fn the_geometry_is_the_one_that_identify_fits() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    let path = |name: &str| out.join(name).to_str().unwrap().to_owned();
    let scene = "scenes/arm8.toml".to_owned();
    kincal(out, &["export", &scene, "--to", "urdf"]).ends(0);
    let arm = kincal::scene::read(Path::new(env!("CARGO_MANIFEST_DIR")).join(&scene)).unwrap().scene.arm;
    for orientation in [false, true] {
        fs::write(
            path("table.csv"),
            kincal::measurement::table::write(&clean_table(&arm, orientation, 1.0), &arm.slides()).unwrap(),
        )
        .unwrap();
        for robot in [path("arm8.urdf"), scene.clone()] {
            let run = |command: &str| {
                let noise = ["--position-noise-um", "20", "--attitude-noise-deg", "0.00573", "--json"];
                kincal(out, &[&[command, &path("table.csv"), "--robot", &robot], &noise[..]].concat()).json()
            };
            let (identified, diagnosed) = (run("identify"), run("diagnose"));
            println!("{robot}, orientations {orientation}");
            check_same_geometry(&identified, &diagnosed);
            assert!(identified["converged"] == true, "{}", identified["reason"]);
            let notes = identified["notes"].to_string();
            assert!(!notes.contains("the calibrated file is off"), "{notes}");
        }
    }
}

/// Tables by other people's kinematics and formulas (`tests/python/foreign_tables.py`): each cause is named, where it is, as large as it is.
#[test]
fn causes_in_tables_by_pinocchio_are_named() {
    let of = |kind: &str, index: u64, magnitude: f64| (kind.to_owned(), (index > 0).then_some(index), magnitude);
    let root_of_lines = 5e-4 * (2.0_f64 / 3.0).sqrt();
    let tables = [
        // Straight between lines of 0.5 mrad: two thirds of their variance.
        ("map_joint_3", of("joint_angle_map", 3, root_of_lines), 0.3),
        ("gear_joint_2_once_twice_four_times", of("strain_wave_error", 2, 1.5e-4), 0.1),
        ("gear_joint_4_once", of("strain_wave_error", 4, 1.5e-4), 0.1),
        ("coupling_joint_7_of_joint_5", of("gear_coupling", 7, 3e-4), 0.1),
        ("unsettled", of("unsettled_reading", 0, 6e-4), 0.1),
        ("creep_joint_2", of("creep", 2, 7e-4), 0.1),
        ("wound_up_joint_2", of("direction_of_move", 2, 2e-5), 0.1),
        ("base_away_for_25_rows", of("base_step", 0, 3.74e-4), 0.3),
        ("tool_knocked_at_row_6", of("tool_step", 0, 5.1e-4), 0.2),
        ("yields_joint_4_without_masses", of("joint_compliance", 4, 0.0), 0.0),
        ("yields_joint_2_on_a_wall", of("joint_compliance", 2, 4e-5), 0.1),
    ];
    for (name, (kind, index, magnitude), within) in tables {
        let out = tempfile::tempdir().unwrap();
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let table = root.join(format!("tests/reference/pinocchio/{name}.csv"));
        let mut robot = root.join("scenes/panda.urdf");
        if name.contains("without_masses") {
            let with = fs::read_to_string(&robot).unwrap();
            let mut parts = with.split("<inertial>");
            let first = parts.next().unwrap().to_owned();
            let rest = parts.map(|part| part.split_once("</inertial>").unwrap().1);
            robot = out.path().join("without_masses.urdf");
            fs::write(&robot, rest.fold(first, |all, part| all + part)).unwrap();
        }
        let [table, robot] = [&table, &robot].map(|path| path.to_str().unwrap());
        let json = kincal(out.path(), &["diagnose", table, "--robot", robot, "--position-noise-um", "20", "--json"]).json();
        let effects = json["effects"].as_array().unwrap();
        assert!(!effects.is_empty(), "{name}: nothing is named");
        for effect in effects {
            assert_eq!((effect["kind"].as_str(), effect["location"]["index"].as_u64()), (Some(kind.as_str()), index), "{name}");
            // Without masses nobody knows how much.
            assert_eq!(effect["magnitude"]["unit"].as_str().unwrap().contains("no masses"), magnitude == 0.0, "{effect}");
        }
        // Ripples of a gear may be told one by one: the largest is meant.
        let sizes = effects.iter().map(|effect| effect["magnitude"]["value"].as_f64().unwrap().abs());
        let found = sizes.fold(0.0, f64::max);
        assert!(magnitude == 0.0 || (found / magnitude - 1.0).abs() < within, "{name}: {found} against {magnitude}");
    }
}
