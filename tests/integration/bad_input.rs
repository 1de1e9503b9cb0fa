//! Wrong input: exit code 2, a message that names what is wrong and what to do, and no file left behind.

use std::fs;
use std::path::Path;

use crate::harness::{Run, kincal, names, quick_run};

const SCENE: &str = include_str!("../../scenes/arm8.toml");
/// Every method and every criterion, as an error names them.
const METHODS: &str =
    "pso, improved_pso, detmax, annealing, genetic, genetic_repeated, perturbation, coordinate_exchange, best_of_random, random";
const CRITERIA: &str = "comprehensive, o1, o2, o3, o4, o5, o6, dispersion, evenness, d_optimality, i_optimality, g_optimality";

/// Runs `kincal` with `arguments` into a folder of its own, which must stay empty.
#[track_caller]
fn refuse(arguments: &[&str], expected: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    for more in [&[][..], &["--json"]] {
        let ran = kincal(&folder.path().join("out"), &[arguments, more].concat()).ends(2);
        check(&ran.stderr, expected);
        assert_eq!(ran.stdout, "", "{}", ran.arguments);
        assert_eq!(names(&folder.path().join("out")), Vec::<String>::new(), "left by kincal {}", ran.arguments);
    }
}

#[track_caller]
fn check(stderr: &str, expected: &[&str]) {
    for fragment in expected {
        assert!(stderr.contains(fragment), "{fragment:?} is not in: {stderr}");
    }
    // The system's words are said once, and nobody is shown the insides.
    assert!(stderr.matches("os error").count() <= 1, "{stderr}");
    for inside in ["RUST_BACKTRACE", "Error {", "src/"] {
        assert!(!stderr.contains(inside), "{stderr}");
    }
}

/// The shipped scene with `old` replaced, and the line of that.
fn changed(old: &str, new: &str) -> (String, usize) {
    assert!(SCENE.contains(old), "{old}");
    (SCENE.replacen(old, new, 1), SCENE[..SCENE.find(old).unwrap()].matches('\n').count() + 1)
}

#[test]
fn scenes_that_are_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wrong.toml");
    let path = path.to_str().unwrap();
    for (old, new, expected) in [
        ("count = 40", "cuont = 40", "did you mean `count`?"),
        ("random_sets = 30", "colour = 30", "unknown key `colour`"),
        ("count = 40\n", "count = 5\n", "8 or more"),
        ("a_mm = 30", "a_m = 30", "did you mean `a_mm`? lengths are in mm here"),
        ("alpha_deg = -90", "alpha_rad = -1.57", "did you mean `alpha_deg`?"),
        ("a_mm = 30", "a_mm = nan", "a finite number"),
        ("a_mm = 30", "a_mm = inf", "a finite number"),
        ("a_mm = 30", "a_mm = \"30\"", "a number"),
        ("a_mm = 30", "a_mm = 1e300", "-100000 to 100000"),
        ("lower_deg = -170, upper_deg = 170", "lower_deg = 170, upper_deg = -170", "a lower limit below the upper one"),
        ("count = 40\n", "count = 40\ncount = 41\n", "duplicate key"),
        ("[design]", "[design", "TOML"),
        ("joint = \"joint2\"", "joint = \"joint9\"", "joint1, joint2"),
        ("mass_kg = 12", "mass_kg = -12", "more than 0"),
    ] {
        let (text, line) = changed(old, new);
        fs::write(path, text).unwrap();
        // Where two keys are needed to see that it is wrong, the line is that of one of them.
        let lines = [line - 1, line, line + 1].map(|line| format!("wrong.toml:{line}:"));
        let folder = tempfile::tempdir().unwrap();
        let ran = kincal(folder.path(), &["run", path]).ends(2);
        assert!(lines.iter().any(|line| ran.stderr.contains(line)) || expected == "8 or more", "{lines:?}: {}", ran.stderr);
        check(&ran.stderr, &["wrong.toml:", expected]);
        assert_eq!(names(folder.path()), Vec::<String>::new());
    }
    for (old, missing) in [("count = 40\n", "`count` is missing"), ("name = \"arm8\"\n", "`name` is missing")] {
        fs::write(path, changed(old, "\n").0).unwrap();
        for command in ["run", "design"] {
            refuse(&[command, path], &["wrong.toml:", missing, "do: add"]);
        }
    }
    fs::write(path, SCENE.split("# What is hidden").next().unwrap()).unwrap();
    refuse(&["run", path], &["wrong.toml: the scene has no [injected] section", "add one"]);
    refuse(&["reproduce", "count-error", "--arm", path], &["wrong.toml: the scene has no [injected] section"]);
    refuse(&["export", path, "--to", "csv"], &["wrong.toml is a scene and holds no measurements; give a recording"]);
    fs::write(path, b"\xff\xfe").unwrap();
    refuse(&["run", path], &["wrong.toml", "UTF-8"]);
    fs::write(path, "").unwrap();
    refuse(&["run", path], &["wrong.toml:1:1", "`name` is missing"]);
    refuse(&["run", "missing.toml"], &["missing.toml: No such file", "do: check the path"]);
    refuse(&["run", "scenes"], &["scenes: Is a directory"]);
}

#[test]
fn overrides_that_are_wrong() {
    for (assignment, expected) in [
        ("nonsense", "KEY=VALUE is needed"),
        ("", "KEY=VALUE is needed"),
        ("=1", "unknown key"),
        ("nonsense=1", "unknown key `nonsense`"),
        ("design.cuont=1", "did you mean `count`?"),
        ("desing.count=1", "no `desing` in this scene"),
        ("arm.frame[99].a_mm=1", "no `frame[99]`"),
        ("arm.frame[0].a_mm=1", "arm.frame[0].a_mm"),
        ("design.count=", "a whole number"),
        ("design.count=many", "a whole number"),
        ("design.method=ga", METHODS),
        ("design.method=coordinate-exchange", "did you mean `coordinate_exchange`?"),
        ("design.criterion=oc", CRITERIA),
        ("design.criterion=i_optimalty", "did you mean `i_optimality`?"),
        ("design.budget=0", "design.budget"),
        ("design.pool=many", "a whole number"),
        ("design.count=\"40\"", "a whole number"),
        ("design.count=40.5", "a whole number"),
        ("design.count=7", "8 or more"),
        ("design.count=20\nseed=4", "one TOML value"),
        ("design.swarm=5", "a table"),
        ("seed=9223372036854775808", ""),
        ("name=\"../elsewhere\"", "a-z 0-9"),
        ("injected.effect[1].radial_um=2000", "allowed: 1000 at most"),
    ] {
        refuse(&["run", "scenes/arm8.toml", "--set", "design.swarm.iterations=5", "--set", assignment], &[expected]);
    }
}

/// Overrides of the scene with the play, each with what the message says. That of a file is tried where scenes are parsed.
const PLANS_AND_EFFECTS: [(&str, &[&str]); 36] = [
    ("plan.repeats=0", &["plan.repeats", "1 or more"]),
    ("plan.repeats=2.5", &["plan.repeats", "a whole number"]),
    ("plan.repeat=2", &["did you mean `repeats`?"]),
    ("plan.approach=sideways", &["plan.approach", "direct, up, down, alternate, random"]),
    ("plan.approach_travel_deg=0", &["plan.approach_travel_deg", "more than 0"]),
    ("plan.approach_travel_rad=0.1", &["did you mean `approach_travel_deg`?"]),
    ("plan.dwell_s=-1", &["plan.dwell_s", "0 or more"]),
    ("plan.dwell_s=21", &["plan.dwell_s", "20 at most"]),
    ("plan.payloads_kg=[]", &["plan.payloads_kg", "[0]"]),
    ("plan.payloads_kg=[0,-5]", &["plan.payloads_kg", "0 or more"]),
    ("plan.payloads_kg=5", &["plan.payloads_kg", "a list"]),
    ("plan.temperature.profile=cool", &["plan.temperature.profile", "constant, warm-up, heat-and-cool"]),
    ("plan.temperature.rise_k=[1,2]", &["plan.temperature.rise_k", "9"]),
    ("plan.temperature.rise_k=-300", &["plan.temperature.rise_k", "absolute zero"]),
    ("plan.temperature.ambient_rise_k=-294", &["plan.temperature.ambient_rise_k", "absolute zero"]),
    ("plan.reference_temperature_c=-274", &["plan.reference_temperature_c", "more than -273.15"]),
    ("plan.temperature.lag_s=-1", &["plan.temperature.lag_s", "0 or more"]),
    ("plan.temperature.lag_s=[1,2,3]", &["plan.temperature.lag_s", "9"]),
    ("injected.effect[1].kind=wear", &["injected.effect[1].kind", "joint_compliance, link_bending, backlash"]),
    ("injected.effect[1].joint=joint9", &["injected.effect[1].joint", "joint1, joint2"]),
    ("injected.effect[1].radial_um=-30", &["injected.effect[1].radial_um", "0 or more"]),
    ("injected.effect[1].radial_um=1001", &["injected.effect[1].radial_um", "1000 at most"]),
    ("injected.effect[1].radial_um=\"thick\"", &["injected.effect[1].radial_um", "a number"]),
    ("injected.effect[1].width_arcsec=90", &["injected.effect[1].width_arcsec", "radial_clearance", "kind, joint, radial_um"]),
    ("injected.effect[1].colour=3", &["unknown key `colour`"]),
    ("injected.effect[2].radial_um=3", &["no `effect[2]`"]),
    (
        "injected.effect=[{kind=\"joint_compliance\",joint=\"joint2\",stiffness_nm_per_rad=0}]",
        &["stiffness_nm_per_rad", "more than 0"],
    ),
    (
        "injected.effect=[{kind=\"joint_compliance\",joint=\"joint2\",stiffness_nm_per_rad=-9}]",
        &["stiffness_nm_per_rad", "more than 0"],
    ),
    ("injected.effect=[{kind=\"joint_compliance\",joint=\"joint2\",stiffness_nm_per_rad=9}]", &["joint_compliance", "100"]),
    ("injected.effect=[{kind=\"tilt_clearance\",joint=\"joint2\",tilt_urad=10001}]", &["tilt_urad", "10000 at most"]),
    (
        "injected.effect=[{kind=\"gear_coupling\",joint=\"joint2\",coupling_urad_per_rad=9,source=\"joint2\"}]",
        &["injected.effect[1].source", "the joint that errs"],
    ),
    (
        "injected.effect=[{kind=\"wrong_payload\",excess_kg=-1,stiffness_nm_per_rad=2e4}]",
        &["injected.effect[1].excess_kg", "0 or more"],
    ),
    (
        "injected.effect=[{kind=\"joint_compliance\",joint=\"joint2\",stiffness_nm_per_mrad=9}]",
        &["did you mean `stiffness_nm_per_rad`?"],
    ),
    ("injected.clearance=[{joint=\"joint2\",radial_um=30}]", &["injected.clearance", "kind = \"clearance\""]),
    ("injected.thermal={rise_k=3}", &["injected.thermal", "[plan.temperature]"]),
    ("injected.thermal.rise_k=3", &["injected.thermal"]),
];

#[test]
fn plans_and_effects_that_are_wrong() {
    for (assignment, expected) in PLANS_AND_EFFECTS {
        refuse(&["run", "scenes/gap.toml", "--set", assignment], expected);
    }
    // Sliding joints have neither gears nor encoders that turn.
    let slide = ["arm.frame[3].joint={name=\"slide\",kind=\"prismatic\",lower_mm=0,upper_mm=100}"];
    for effect in [
        "kind=\"backlash\",joint=\"slide\",width_arcsec=60",
        "kind=\"joint_compliance\",joint=\"slide\",stiffness_nm_per_rad=2e4",
    ] {
        let effect = format!("injected.effect=[{{{effect}}}]");
        let none = ["--set", "injected.effect=[]", "--set", slide[0], "--set", &effect];
        refuse(&[&["run", "scenes/gap.toml"], &none[..]].concat(), &["injected.effect[1].joint", "\"slide\", which slides"]);
    }
}

#[test]
fn what_a_plan_cannot_tell_is_noted() {
    let folder = tempfile::tempdir().unwrap();
    let quick = ["--set", "design.method=random", "--set", "design.random_sets=1", "--set", "design.pool=60"];
    let run = |more: &[&str]| kincal(folder.path(), &[&["run", "scenes/gap.toml"], &quick[..], more].concat()).ends(0).stderr;
    assert!(!run(&[]).contains("note: every configuration is read once"));
    assert!(run(&["--set", "plan.repeats=1"]).contains("note: every configuration is read once"));
}

#[test]
fn numbers_beyond_all_measure_are_refused_at_once() {
    for assignment in [
        "design.count=1000000000000000000",
        "design.random_sets=1000000000000000000",
        "design.swarm.particles=1000000000000000000",
        "design.swarm.iterations=1000000000000000000",
        "design.swarm.inertia=[0,1e300]",
        "design.swarm.velocity_factor=1e300",
        "design.swarm.tau=1e300",
        "design.evenness_step_mm=0.01",
        "design.evenness_step_mm=1e-300",
        "design.evenness_step_mm=1e300",
        "plan.held_out_count=1000000000000000000",
        "plan.seconds_per_pose=1e300",
        "arm.frame[3].a_mm=1e9",
        "arm.frame[3].a_mm=90000",
        "arm.frame[3].alpha_deg=1e300",
        "arm.frame[1].joint.upper_deg=1e300",
        "arm.frame[3].link.mass_kg=1e300",
        "arm.frame[3].link.inertia_kg_m2={xx=1e300,yy=1e300,zz=1e300}",
        "arm.gravity_m_s2=[0,0,1e300]",
        "sensor.position_noise_um=1e300",
        "sensor.position_noise_um=1e-300",
        "sensor.attitude_noise_deg=1e-300",
        "sensor.position_mm=[1e300,0,0]",
        "injected.parameters.length_mm=1e300",
        "injected.parameters.errors={a2_mm=1e300}",
        "injected.noise.factor=1e300",
        "plan.temperature.rise_k=1e300",
        "plan.temperature.rise_k=[0,0,0,0,0,0,0,0,1e300]",
    ] {
        let key = assignment.split('=').next().unwrap();
        let begun = std::time::Instant::now();
        refuse(&["run", "scenes/arm8.toml", "--set", assignment], &[key, "allowed: ", "do: "]);
        assert!(begun.elapsed().as_secs() < 5, "{assignment}");
    }
}

#[test]
fn a_cell_in_which_everything_collides() {
    let floor = "arm.fixture[2].shape={box={centre_mm=[0,0,300],size_mm=[4000,4000,100]}}";
    for command in ["run", "design"] {
        refuse(&[command, "scenes/arm8.toml", "--set", floor], &["link1 touches floor", "may_touch"]);
    }
}

#[test]
fn options_that_are_wrong() {
    let scene = "scenes/arm8.toml";
    refuse(&["frobnicate"], &["unrecognized subcommand", "--help"]);
    refuse(&[], &["subcommand"]);
    refuse(&["run"], &["<SCENE>"]);
    refuse(&["run", scene, "--nonsense"], &["--nonsense"]);
    refuse(&["run", scene, "--threads", "0"], &["--threads"]);
    refuse(&["run", scene, "--threads", "100000"], &["--threads", "1..=1024"]);
    refuse(&["run", scene, "--seed", "-1"], &["-1"]);
    refuse(&["run", scene, "--seed", "18446744073709551616"], &["--seed"]);
    refuse(&["run", scene, "--seed", "18446744073709551615"], &["seed = 18446744073709551615", "0 to 9223372036854775807"]);
    refuse(&["design", scene, "--seed", "9223372036854775808"], &["choose a smaller seed"]);
    refuse(&["export", scene, "--to", "yaml"], &["urdf, csv, toml"]);
    refuse(&["export", scene, "--to", "urdf", "--seed", "3"], &["--seed 3: this command draws nothing"]);
    refuse(&["measure", scene], &["--design"]);
    refuse(&["measure", scene, "--design", "missing.mcap"], &["missing.mcap", "No such file"]);
    refuse(&["measure", scene, "--design", scene], &["scenes/arm8.toml is no MCAP file"]);
    refuse(&["reproduce", "everything"], &["count-error"]);
    refuse(&["reproduce", "count-error", "--trials", "0"], &["--trials"]);
    refuse(&["reproduce", "count-error", "--trials", "1000000000"], &["--trials"]);
    // Whether or not the command shows anything, and whether or not there is a viewer.
    for arguments in [&["run", scene][..], &["export", scene, "--to", "urdf"], &["reproduce", "count-error"]] {
        refuse(&[arguments, &["--rerun", "nonsense"]].concat(), &["--rerun nonsense: "]);
    }
}

#[test]
fn places_that_cannot_be_written() {
    let folder = tempfile::tempdir().unwrap();
    let out = |name: &str| folder.path().join(name);
    fs::write(out("file"), "mine").unwrap();
    let run = quick_run(&[]);
    let recording = run.text("arm8.mcap");
    kincal(run.folder.path(), &["export", &recording, "--to", "csv"]).ends(0);
    let (table, robot) = (run.text("arm8.csv"), run.text("arm8.urdf"));
    let commands: [&[&str]; 5] = [
        &["run", "scenes/arm8.toml", "--set", "design.swarm.iterations=5"],
        &["measure", "scenes/arm8.toml", "--design", &recording],
        &["export", "scenes/arm8.toml", "--to", "urdf"],
        &["identify", &recording],
        &["identify", &table, "--robot", &robot],
    ];
    let mut places = vec![out("file"), out("file/below")];
    if Path::new("/proc/self").exists() {
        places.push("/proc/nowhere".into());
    }
    for place in &places {
        for command in commands {
            let ran = kincal(place, command).ends(2);
            check(&ran.stderr, &[place.to_str().unwrap()]);
            assert!(ran.stderr.contains("--out") || ran.stderr.contains("choose an"), "{}", ran.stderr);
        }
    }
    assert_eq!((names(folder.path()), fs::read(out("file")).unwrap()), (vec!["file".to_owned()], b"mine".to_vec()));
    // A folder where a file is to be: seen before anything is computed.
    for name in ["arm8.mcap", "arm8.truth.toml", "arm8.urdf", "arm8.calibrated.urdf"] {
        let place = out("taken").join(name);
        fs::create_dir_all(&place).unwrap();
        let ran = kincal(&out("taken"), commands[0]).ends(2);
        check(&ran.stderr, &[name]);
        assert_eq!(names(&out("taken")), [name]);
        fs::remove_dir(place).unwrap();
    }
    // An export never takes its own input's place.
    let public = out("same.public.toml");
    fs::write(&public, SCENE).unwrap();
    let ran = kincal(folder.path(), &["export", public.to_str().unwrap(), "--to", "toml"]);
    assert_eq!((ran.code, fs::read_to_string(&public).unwrap().as_str()), (Some(0), SCENE));
}

fn tables(run: &Run) -> String {
    kincal(run.folder.path(), &["export", &run.text("arm8.mcap"), "--to", "csv"]).ends(0);
    fs::read_to_string(run.path("arm8.csv")).unwrap()
}

#[test]
fn tables_that_are_wrong() {
    let run = quick_run(&[]);
    let table = tables(&run);
    let rows: Vec<&str> = table.lines().collect();
    let bad = run.text("bad.csv");
    let robot = run.text("arm8.urdf");
    let with = |text: String, expected: &[&str]| {
        fs::write(&bad, text).unwrap();
        refuse(&["identify", &bad, "--robot", &robot], &[&["bad.csv"], expected].concat());
    };
    // Row 3 of the file with one value replaced.
    let value = |column: &str, value: &str| {
        let at = rows[0].split(',').position(|name| name == column).unwrap();
        let row = rows[2].split(',').enumerate().map(|(index, old)| if index == at { value } else { old });
        let row = row.collect::<Vec<_>>().join(",");
        [&rows[..2], &[&row], &rows[3..]].concat().join("\n")
    };
    with(String::new(), &["line 1"]);
    with(rows[0].to_owned(), &["line 1", "no rows"]);
    with(rows[..3].join("\n"), &["at least 6 different ones are needed"]);
    with(table.replace(",fit,", ",held_out,"), &["0 rows at 0 different configurations"]);
    with(rows[0].replace("x_m", "x_furlong"), &["line 1", "x_furlong"]);
    let wrong_units = ["x_m", "y_m", "z_m"].iter().fold(table.clone(), |table, name| table.replace(name, &format!("{name}m")));
    with(wrong_units, &["the positions are metres", "--fix-columns positions:m)"]);
    with(rows[0].replace("q3_rad", "q3"), &["line 1", "`q3` has no known unit"]);
    with(rows[0].replace("q3_rad,", ""), &["line 1", "q3 is missing"]);
    with(value("x_m", "1e300"), &["line 3", "1e300", "check the number"]);
    with(value("role", "test"), &["line 3", "`fit` or `held_out`"]);
    with(value("pose_id", "-1"), &["line 3", "a whole number"]);
    with(value("qw", "7"), &["line 3", "quaternion"]);
    with([&rows[..3], &["1,2,3"], &rows[3..]].concat().join("\n"), &["line 4", "3 values", "37 columns"]);
    let same: Vec<&str> = std::iter::once(rows[0])
        .chain(std::iter::repeat_n(*rows.iter().find(|row| row.contains(",fit,")).unwrap(), 60))
        .collect();
    with(same.join("\n"), &["1 different configurations"]);
    fs::write(&bad, b"q1_rad\xff").unwrap();
    refuse(&["identify", &bad, "--robot", &robot], &["bad.csv", "UTF-8"]);

    let table = run.text("arm8.csv");
    refuse(&["identify", &table], &["arm8.csv is a table: give its nominal robot with --robot"]);
    refuse(&["identify", &run.text("missing.csv"), "--robot", &robot], &["missing.csv", "No such file"]);
    refuse(&["identify", &table, "--robot", &robot, "--evaluate", &run.text("missing.csv")], &["missing.csv", "No such file"]);
    for (option, wrong) in [
        ("--position-noise-um", "0"),
        ("--position-noise-um", "nan"),
        ("--position-noise-um", "1e-300"),
        ("--attitude-noise-deg", "-1"),
    ] {
        refuse(&["identify", &table, "--robot", &robot, option, wrong], &[option, "a positive number"]);
    }
    refuse(&["identify", &table, "--robot", &robot, "--tip-link", "hand"], &["--tip-link", "link8, tool"]);
    refuse(&["identify", &table, "--robot", &robot, "--tip-link", "link5"], &["8 joint columns, the robot has 5 joints"]);
    refuse(&["identify", &table, "--robot", "scenes/arm8.toml", "--tip-link", "link5"], &["--tip-link link5"]);
    let recording = run.text("arm8.mcap");
    refuse(&["identify", &recording, "--robot", &robot], &["a recording carries its own nominal arm"]);
    refuse(&["identify", &recording, "--base-link", "link1"], &["--base-link link1"]);
    refuse(&["identify", &recording, "--evaluate", &robot], &["arm8.urdf: it is XML or HTML: write it as CSV"]);
    refuse(&["identify", &recording, "--seed", "3"], &["--seed 3"]);
    refuse(&["export", &robot, "--to", "urdf"], &["arm8.urdf: give a scene (.toml) or a recording"]);
    // A byte order mark and the line ends of other systems are no error, nor is a reading without one of its coordinates.
    // Semicolons separate as well, and a number that is none was not read.
    let semicolons = rows.join("\n").replace(',', ";");
    for text in [format!("\u{feff}{}", rows.join("\n")), rows.join("\r\n"), semicolons, value("x_m", ""), value("x_m", "NaN")] {
        fs::write(&bad, text).unwrap();
        kincal(&run.path("good"), &["identify", &bad, "--robot", &robot]).ends(0);
    }
}

#[test]
fn too_few_measurements_leave_nothing_behind() {
    let run = quick_run(&["--set", "design.count=8", "--set", "design.method=\"random\""]);
    // The first measurements of a recording that was cut off.
    let bytes = fs::read(run.path("arm8.mcap")).unwrap();
    let cut = run.text("cut.mcap");
    let mut refused = 0;
    for share in 1..20 {
        fs::write(&cut, &bytes[..bytes.len() * share / 20]).unwrap();
        let out = tempfile::tempdir().unwrap();
        let ran = kincal(out.path(), &["identify", &cut, "--partial"]);
        if ran.code == Some(2) {
            refused += u32::from(ran.stderr.contains("cannot determine 36 independent parameters"));
            assert_eq!(names(out.path()), Vec::<String>::new(), "{}", ran.stderr);
        }
    }
    assert!(refused > 0);
}

#[test]
fn robots_that_are_wrong() {
    let run = quick_run(&[]);
    tables(&run);
    let (table, bad) = (run.text("arm8.csv"), run.text("bad.urdf"));
    let joint = |name: &str, kind: &str, parent: &str, child: &str| {
        format!(
            "<joint name=\"{name}\" type=\"{kind}\">\n<parent link=\"{parent}\"/>\n<child link=\"{child}\"/>\n<axis xyz=\"0 0 1\"/>\n\
             <limit lower=\"-1\" upper=\"1\" effort=\"1\" velocity=\"1\"/>\n</joint>\n"
        )
    };
    let links = "<link name=\"a\"/>\n<link name=\"b\"/>\n";
    let robot = |inside: &str| format!("<robot name=\"r\">\n{inside}</robot>\n");
    let good = joint("j", "revolute", "a", "b");
    for (text, expected) in [
        (String::new(), vec!["URDF"]),
        ("nonsense".to_owned(), vec!["URDF"]),
        ("<robot name=\"r\">\n<link".to_owned(), vec!["bad.urdf"]),
        (robot(""), vec!["no joints"]),
        (robot("<link name=\"a\"/>"), vec!["no joints"]),
        (
            robot(&format!("{links}{good}{}", joint("k", "revolute", "b", "a"))),
            vec!["bad.urdf:", "a circle of joints", "cut the loop"],
        ),
        (robot(&format!("{links}{}", joint("j", "floating", "a", "b"))), vec!["bad.urdf:4", "a floating joint"]),
        (robot(&format!("{links}{}", joint("j", "revolute", "a", "c"))), vec!["bad.urdf:4", "\"c\", which is not in the file"]),
        (robot(&format!("{links}{}", joint("j", "fixed", "a", "b"))), vec!["no joint that moves"]),
        (robot(&format!("{links}<link name=\"a\"/>\n{good}")), vec!["two links of this name"]),
        (robot(&format!("{links}{}", good.replace("lower=\"-1\"", "lower=\"2\""))), vec!["bad.urdf:4", "limits from 2 to 1"]),
        (robot(&format!("{links}{}", good.replace("0 0 1", "0 0 0"))), vec!["bad.urdf:4", "axis"]),
        (
            robot(&format!("{links}{}", good.replace("<axis", "<origin xyz=\"0 0 nan\"/><axis"))),
            vec!["bad.urdf:4", "finite numbers"],
        ),
        (
            robot(&format!("{links}{}", good.replace("<axis", "<origin xyz=\"0 0 1e300\"/><axis"))),
            vec!["bad.urdf:4", "finite numbers"],
        ),
        (robot(&format!("{links}{good}")), vec!["8 joint columns, the robot has 1 joint"]),
    ] {
        fs::write(&bad, text).unwrap();
        refuse(&["identify", &table, "--robot", &bad], &expected);
    }
    refuse(&["identify", &table, "--robot", &run.text("missing.urdf")], &["missing.urdf: No such file", "do: check the path"]);
    refuse(&["identify", &table, "--robot", &run.text("arm8.mcap")], &["arm8.mcap"]);
}

#[test]
fn a_reader_that_went_away_and_a_full_device_are_no_panic() {
    let folder = tempfile::tempdir().unwrap();
    let Ok(full) = fs::OpenOptions::new().write(true).open("/dev/full") else {
        println!("skipped: there is no /dev/full");
        return;
    };
    let out = folder.path().to_str().unwrap();
    let run = ["run", "scenes/arm8.toml", "--set", "design.swarm.iterations=5", "--out", out];
    let output = crate::harness::command(&run).stdout(full.try_clone().unwrap()).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    check(&String::from_utf8(output.stderr).unwrap(), &["No space left on device"]);
    let status = crate::harness::command(&["run", "missing.toml"]).stderr(full).status().unwrap();
    assert_eq!(status.code(), Some(2));
}
