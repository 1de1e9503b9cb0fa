use std::path::{Path, PathBuf};

use nalgebra::{DMatrix, Point3, Vector3};

use super::effect::{Effect, Moves};
use super::effect_file::KINDS;
use super::*;
use crate::arm::Geometry;
use crate::kinematics::Quantity;
use crate::quality::subspace::Subspace;
use crate::seed::{Stream, stream};
use crate::self_collision::{CollisionCheck, Scratch};

const ARM8: &str = include_str!("../../scenes/arm8.toml");
const PAPER: &str = include_str!("../../scenes/paper.toml");
const PANDA: &str = include_str!("../../scenes/panda.toml");
const PANDA_URDF: &str = include_str!("../../scenes/panda.urdf");
/// Every method and every criterion, as an error names them.
const METHODS: &str =
    "pso, improved_pso, detmax, annealing, genetic, genetic_repeated, perturbation, coordinate_exchange, best_of_random, random";
const CRITERIA: &str = "comprehensive, o1, o2, o3, o4, o5, o6, dispersion, evenness, d_optimality, i_optimality, g_optimality";

fn shipped() -> [(SceneFile, &'static str); 2] {
    [("arm8.toml", ARM8), ("paper.toml", PAPER)].map(|(name, text)| match parse(text, name) {
        Ok(scene) => (scene, text),
        Err(error) => panic!("{error}"),
    })
}

fn message(text: &str) -> String {
    match parse(text, "cell.toml") {
        Ok(_) => panic!("accepted"),
        Err(error) => error.to_string(),
    }
}

/// Replaces the `nth` (from 0) line of arm8.toml that contains `old`, in that line, and checks the message: it names the line.
fn check(old: &str, nth: usize, new: &str, expected: &[&str]) {
    let line = ARM8.lines().enumerate().filter(|(_, line)| line.contains(old)).nth(nth).expect("the line exists").0;
    let text: String = ARM8
        .lines()
        .enumerate()
        .map(|(index, text)| if index == line { text.replacen(old, new, 1) + "\n" } else { text.to_owned() + "\n" })
        .collect();
    let message = message(&text);
    let place = format!("cell.toml:{}:", line + 1);
    for fragment in expected.iter().copied().chain([place.as_str()]) {
        assert!(message.contains(fragment), "{old:?} -> {new:?}: {fragment:?} is not in\n{message}");
    }
}

#[test]
fn what_is_wrong_is_named_with_line_key_and_remedy() {
    let cases: &[(&str, usize, &str, &[&str])] = &[
        // Keys.
        (
            "a_mm = 25",
            0,
            "a_m = 0.025",
            &["arm.frame[3].a_m", "unknown key `a_m`", "did you mean `a_mm`? lengths are in mm here"],
        ),
        ("alpha_deg = 90", 0, "alpha_rad = 1.57", &["did you mean `alpha_deg`? angles are in degrees here"]),
        ("description", 0, "descripton", &["unknown key `descripton`", "did you mean `description`?"]),
        ("held_out_count = 50", 0, "held_out = 50\nheld_out_count = 50", &["plan.held_out", "held_out_count, held_out_exact"]),
        (
            "position_noise_um = 15",
            0,
            "position_noise_mm = 0.015",
            &["did you mean `position_noise_um`? small lengths are in µm here"],
        ),
        ("radial_um = 30", 1, "radial_mm = 0.03", &["injected.effect[2].radial_mm", "did you mean `radial_um`?"]),
        ("xx = 0.1119", 0, "xxx = 0.1119", &["arm.frame[1].link.inertia_kg_m2.xxx", "xx, yy, zz, xy, xz, yz"]),
        ("capsule", 0, "pill", &["arm.frame[1].link.shapes[1]", "`pill`", "capsule, cylinder, box, sphere"]),
        ("radius_mm = 65", 0, "radius_mm = 65, height_mm = 3", &["height_mm", "from_mm, to_mm, radius_mm"]),
        // Types.
        ("a_mm = 25", 0, "a_mm = \"25\"", &["arm.frame[3].a_mm", "string \"25\"", "a number"]),
        ("seed = 2019", 0, "seed = -1", &["seed", "a whole number, not negative"]),
        ("count = 40", 0, "count = 40.5", &["design.count", "a whole number, not negative"]),
        ("gravity_m_s2 = [0, 0, -9.81]", 0, "gravity_m_s2 = [0, -9.81]", &["arm.gravity_m_s2", "a list of three numbers"]),
        ("method = \"pso\"", 0, "method = \"psa\"", &["design.method", "`psa`", METHODS, "did you mean `pso`?"]),
        (
            "profile = \"heat-and-cool\"",
            0,
            "profile = \"warmup\"",
            &["constant, warm-up, heat-and-cool", "did you mean `warm-up`?"],
        ),
        ("convention = \"mdh5\"", 0, "convention = \"dh\"", &["arm.convention", "`dh`", "mdh5"]),
        ("rise_k = [3,", 0, "rise_k = [\"3\",", &["plan.temperature.rise_k[1]", "a number"]),
        ("rise_k = [3, 8,", 0, "rise_k = [3,", &["plan.temperature.rise_k", "8 numbers", "one number, or 9"]),
        ("profile = \"heat-and-cool\"", 0, "profile = heat", &["TOML"]),
        ("[sensor]", 0, "[sensor", &["TOML"]),
        // Values.
        ("a_mm = 25", 0, "a_mm = nan", &["arm.frame[3].a_mm", "nan", "a finite number"]),
        ("tau = 1.0", 0, "tau = -inf", &["design.swarm.tau", "-inf", "a finite number"]),
        ("to_mm = [0, 0, 280]", 0, "to_mm = [0, 0, 1e999]", &["arm.frame[3].link.shapes[1].capsule.to_mm[3]", "a finite number"]),
        (
            "lower_deg = -170",
            1,
            "lower_deg = 175",
            &["arm.frame[3].joint.lower_deg", "lower limit 175, upper limit 170", "below"],
        ),
        ("lower_deg = -170", 0, "lower_mm = -170", &["did you mean `lower_deg`? limits of revolute joints are in deg here"]),
        ("lower_deg = -170", 0, "kind = \"prismatic\", lower_deg = -170", &["limits of prismatic joints are in mm here"]),
        ("lower_deg = -170, ", 0, "", &["arm.frame[1].joint.lower_deg", "`lower_deg` is missing"]),
        ("joint3", 0, "joint1", &["arm.frame[3].joint.name", "the name of joint 1 too"]),
        ("count = 40", 0, "count = 7", &["design.count", "7", "8 or more", "45 parameters (eq. 30)"]),
        ("mass_kg = 10", 0, "mass_kg = -10", &["arm.frame[2].link.mass_kg", "-10", "more than 0"]),
        ("xx = 0.0471", 0, "xx = -0.0471", &["arm.frame[2].link.inertia_kg_m2", "a positive definite inertia"]),
        ("xx = 0.0471", 0, "xx = 0.2471", &["arm.frame[2].link.inertia_kg_m2", "none exceeds the sum of the other two"]),
        ("radius_mm = 65", 0, "radius_mm = 0", &["arm.frame[1].link.shapes[1].capsule.radius_mm", "more than 0"]),
        ("to_mm = [0, 0, 280]", 0, "to_mm = [0, 0, 0]", &["both ends at one point", "sphere"]),
        ("position_noise_um = 15", 0, "position_noise_um = -15", &["sensor.position_noise_um", "0 or more"]),
        ("attitude_noise_deg = 0.003", 0, "attitude_noise_deg = 0", &["sensor.attitude_noise_deg", "weights = \"unit\""]),
        (
            "may_touch = [\"base_link\"]",
            0,
            "may_touch = [\"base\"]",
            &["arm.fixture[1].may_touch[1]", "did you mean `base_link`?"],
        ),
        ("name = \"floor\"", 0, "name = \"plate\"", &["arm.fixture[2].name", "another fixture"]),
        ("name = \"arm8\"", 0, "name = \"Arm 8\"", &["name", "\"Arm 8\"", "a-z 0-9 - _"]),
        ("inertia = [0.4, 0.95]", 0, "inertia = [0.95, 0.4]", &["design.swarm.inertia", "put the smaller one first"]),
        ("seconds_per_pose = 20", 0, "seconds_per_pose = 0", &["plan.seconds_per_pose", "more than 0"]),
        ("# repeats = 2", 0, "repeats = 0", &["plan.repeats", "1 or more, 1000 at most"]),
        ("# repeats = 2", 0, "repeats = 1001", &["plan.repeats", "1001", "1000 at most"]),
        ("# repeats = 2", 0, "dwell_s = 21", &["plan.dwell_s", "21", "seconds_per_pose = 20 at most"]),
        ("# repeats = 2", 0, "dwell_s = -1", &["plan.dwell_s", "0 or more"]),
        ("# approach = \"random\"", 0, "approach = \"sideways\"", &["plan.approach", "direct, up, down, alternate, random"]),
        ("# approach = \"random\"", 0, "approach_travel_deg = 0", &["plan.approach_travel_deg", "more than 0"]),
        ("# approach = \"random\"", 0, "approach_travel_mm = -5", &["plan.approach_travel_mm", "more than 0"]),
        ("# approach = \"random\"", 0, "approach_travel = 5", &["did you mean `approach_travel_"]),
        ("# payloads_kg = [0, 5]", 0, "payloads_kg = []", &["plan.payloads_kg", "an empty list", "[0]"]),
        ("# payloads_kg = [0, 5]", 0, "payloads_kg = [0, -5]", &["plan.payloads_kg[2]", "-5", "0 or more"]),
        ("# payloads_kg = [0, 5]", 0, "payloads_kg = [0, 1001]", &["plan.payloads_kg[2]", "1000 at most"]),
        ("# payloads_kg = [0, 5]", 0, "payload_blocks = 1", &["plan.payload_blocks", "a boolean"]),
        (
            "rise_k = [3, 8,",
            0,
            "rise_k = [3, -293.5,",
            &["plan.temperature.rise_k[2]", "-293.5", "of link 1", "more than -293.15"],
        ),
        ("rise_k = [3, 8, 10, 10, 9, 8, 7, 6, 5]", 0, "rise_k = -300", &["plan.temperature.rise_k", "of every link"]),
        ("profile = \"heat", 0, "lag_s = -1\nprofile = \"heat", &["plan.temperature.lag_s", "0 or more"]),
        ("profile = \"heat", 0, "lag_s = [1, 2]\nprofile = \"heat", &["plan.temperature.lag_s", "one number, or 9"]),
        (
            "profile = \"heat",
            0,
            "lag_s = [0, 0, 0, 0, 0, 0, 0, 0, -2]\nprofile = \"heat",
            &["plan.temperature.lag_s[9]", "-2", "0 or more"],
        ),
        (
            "profile = \"heat",
            0,
            "ambient_rise_k = -300\nprofile = \"heat",
            &["plan.temperature.ambient_rise_k", "of the air", "more than -293.15"],
        ),
        // The hidden section.
        ("joint = \"joint4\"", 0, "joint = \"joint9\"", &["injected.effect[2].joint", "\"joint9\"", "joint7, joint8"]),
        ("tilt_urad = 100", 2, "tilt_urad = -1", &["injected.effect[3].tilt_urad", "0 or more"]),
        ("length_mm = 1.0", 0, "length_mm = -1.0", &["injected.parameters.length_mm", "0 or more"]),
        (
            "angle_deg = 0.2",
            0,
            "errors = { theta3_rad = 0.1 }",
            &["injected.parameters.errors.theta3_rad", "did you mean `theta3_deg`?"],
        ),
        ("angle_deg = 0.2", 0, "errors = { theta12_deg = 0.1 }", &["unknown parameter `theta12_deg`", "alpha1_deg, a1_mm"]),
        ("factor = 1.0", 0, "position_mm = 1.0", &["injected.noise.position_mm", "kind = \"declared\""]),
        ("kind = \"declared\"", 0, "kind = \"none\"", &["injected.noise.kind", "declared, uniform, off"]),
    ];
    for (old, nth, new, expected) in cases {
        check(old, *nth, new, expected);
    }
}

#[test]
fn what_is_missing_is_named_with_the_line_of_its_table() {
    let without = |line: &str| ARM8.replacen(&format!("{line}\n"), "", 1);
    let cases = [
        ("alpha_deg = -90", "[[arm.frame]]", "arm.frame[2]", "`alpha_deg` is missing"),
        ("mass_kg = 10", "[arm.frame.link]", "arm.frame[2].link", "`mass_kg` missing"),
        ("count = 40", "[design]", "design", "`count` is missing"),
        ("profile = \"heat-and-cool\"", "[plan.temperature]", "plan.temperature", "`profile` is missing"),
    ];
    for (line, header, key, found) in cases {
        let message = message(&without(line));
        let gap = ARM8.lines().position(|text| text == line).expect("the line exists");
        let header_line = ARM8.lines().take(gap).enumerate().filter(|(_, text)| *text == header).last().expect("a header").0 + 1;
        for fragment in [key, found, &format!("cell.toml:{header_line}:")] {
            assert!(message.contains(fragment), "{line}: {fragment:?} is not in\n{message}");
        }
    }
    let message = message(&ARM8.replacen("seed = 2019", "#", 1));
    assert!(message.contains("(top level)") && message.contains("`seed` is missing"), "{message}");
}

#[test]
fn there_is_one_frame_more_than_there_are_joints() {
    let last = ARM8.rfind("[[arm.frame]]").expect("frames");
    let end = last + ARM8[last..].find("# The cell").expect("the cell follows");
    let tool = &ARM8[last..end];
    let message_without = message(&(ARM8[..last].to_owned() + &ARM8[end..]));
    assert!(message_without.contains("a joint in the last of 8 frames"), "{message_without}");
    let message_twice = message(&(ARM8[..end].to_owned() + tool + &ARM8[end..]));
    assert!(message_twice.contains("no joint in frame 9 of 10"), "{message_twice}");
}

#[test]
fn a_missing_file_is_named() {
    let error = read(Path::new("scenes/nowhere.toml")).expect_err("there is no such file");
    assert!(error.to_string().starts_with("scenes/nowhere.toml: "), "{error}");
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("scenes/arm8.toml");
    assert_eq!(read(&path).expect("the shipped scene is valid").scene.name, "arm8");
}

#[test]
fn the_public_part_parses_back_to_the_same_scene_and_hides_the_rest() {
    for (file, text) in shipped() {
        let public = file.public_toml().expect("it can be written");
        let back = parse(&public, "public").unwrap_or_else(|error| panic!("{error}\n{public}"));
        assert_eq!(back.scene, file.scene);
        // The shortest text that reads back as the same bits: equal texts are equal bits, zeros' signs included.
        assert_eq!(format!("{:?}", back.scene), format!("{:?}", file.scene));
        assert_eq!(back.injected, None);
        assert_eq!(back.public_toml().expect("it can be written"), public);
        let (_, hidden) = text.split_once("[injected]").expect("the scenes inject");
        assert!(hidden.contains("seed = \""));
        for word in [
            "injected",
            "5a09f3c1",
            "c83e17b0",
            "error",
            "length_mm",
            "angle_deg",
            "clearance",
            "play",
            "thermal",
            "expansion",
            "#",
        ] {
            assert!(!public.contains(word), "{word:?} is in the public text");
        }
        let injected = file.injected_toml().expect("it can be written").expect("the scenes inject");
        let back = parse_injected(&injected, "truth", &file.scene.arm).unwrap_or_else(|error| panic!("{error}\n{injected}"));
        assert_eq!(Some(back), file.injected);
    }
}

#[test]
fn methods_and_criteria_go_by_the_names_that_errors_list() {
    assert_eq!(Method::ALL.map(Method::name).join(", "), METHODS);
    assert_eq!(Criterion::ALL.map(Criterion::name).join(", "), CRITERIA);
    let [(mut file, _), _] = shipped();
    for method in Method::ALL {
        file.set("design.method", &format!("{:?}", method.name())).expect("allowed");
        assert_eq!(file.scene.design.method, method);
    }
    for criterion in Criterion::ALL {
        file.set("design.criterion", &format!("{:?}", criterion.name())).expect("allowed");
        assert_eq!(file.scene.design.criterion, criterion);
    }
}

#[test]
fn overrides_are_validated_and_written() {
    let [(mut file, _), _] = shipped();
    file.set_seed(7).expect("allowed");
    file.set_count(12).expect("allowed");
    file.set_held_out_count(3).expect("allowed");
    file.set_method(super::Method::Random).expect("allowed");
    file.set_weights(file::WeightsToml::Unit).expect("allowed");
    file.set_injected_seed("99").expect("allowed");
    file.set("design.swarm.particles", "5").expect("allowed");
    file.set("arm.frame[3].joint.upper_deg", "100.5").expect("allowed");
    file.set("injected.effect[2].radial_um", "0").expect("allowed");
    file.set("arm.frame[1].link.shapes[1].capsule.to_mm[3]", "240").expect("allowed");
    assert_eq!((file.scene.seed, file.scene.design.count, file.scene.plan.held_out_count), (7, 12, 3));
    assert_eq!(file.scene.design.swarm.particles, 5);
    assert_eq!(file.scene.arm.chain.joints[2].upper, 100.5f64.to_radians());
    let injected = file.injected.clone().expect("still there");
    assert_eq!(
        (injected.seed.as_str(), &injected.effects[1]),
        ("99", &Effect::Clearance { joint: 3, radial: 0.0, axial: 10e-6, tilt: 100e-6 })
    );
    let back = parse(&file.public_toml().expect("it can be written"), "public").expect("valid");
    assert_eq!(back.scene, file.scene);

    let before = file.clone();
    let refused = [
        (file.set_count(3), "override design.count = 3: design.count", "8 or more"),
        (file.set_seed(u64::MAX), "override seed = ", "TOML has no larger integers"),
        (file.set("design.cuont", "9"), "override design.cuont = 9", "did you mean `count`?"),
        (file.set("desing.count", "9"), "override desing.count = 9", "no `desing` in this scene"),
        (file.set("design.method", "pso"), "override design.method = pso", "TOML"),
        (file.set("design.method", "\"ga\""), "design.method", METHODS),
        (file.set("design.criterion", "\"oc\""), "design.criterion", CRITERIA),
        (file.set("arm.frame[12].a_mm", "9"), "override arm.frame[12].a_mm = 9", "no `frame[12]`"),
    ];
    for (result, origin, fragment) in refused {
        let message = result.expect_err("refused").to_string();
        assert!(message.contains(origin) && message.contains(fragment), "{origin}, {fragment}: {message}");
    }
    assert_eq!(file.public_toml().expect("it can be written"), before.public_toml().expect("it can be written"));

    let mut public = parse(&file.public_toml().expect("it can be written"), "public").expect("valid");
    for result in [public.set_injected_seed("1"), public.set("injected.seed", "1")] {
        assert!(result.expect_err("nothing is injected").to_string().contains("a public scene"));
    }
}

#[test]
fn units_become_si_once() {
    let [(file, _), (paper, _)] = shipped();
    let scene = &file.scene;
    assert_eq!(scene.arm.chain.parameters.len(), 45);
    assert_eq!(scene.arm.chain.parameters[5].nominal, -std::f64::consts::FRAC_PI_2);
    assert_eq!(scene.arm.chain.parameters[6].nominal, 0.030);
    assert_eq!(scene.sensor.position_sigma_m, 15e-6);
    assert_eq!(scene.sensor.position_sigma_per_m, 6e-6);
    assert_eq!(scene.design.evenness_step_m, 0.1);
    let injected = file.injected.as_ref().expect("injected");
    assert_eq!(injected.effects[0], Effect::Clearance { joint: 1, radial: 30e-6, axial: 10e-6, tilt: 100e-6 });
    assert_eq!(injected.length_error_m, 1e-3);
    // All as the foot, and every link by what it exceeds the foot.
    assert_eq!(injected.effects[3], Effect::LinkThermalGrowth { link: None, expansion: 12e-6 });
    assert_eq!(injected.effects[11], Effect::LinkThermalGrowth { link: Some(7), expansion: 11e-6 });
    let temperature = scene.plan.temperature.as_ref().expect("it warms");
    assert_eq!((temperature.rise_k[2], temperature.rise_k.len(), temperature.lag_s.clone()), (10.0, 9, vec![0.0; 9]));
    let Noise::Uniform { position_m, attitude_rad } = paper.injected.as_ref().expect("injected").noise else {
        panic!("the paper's noise is uniform")
    };
    assert_eq!(position_m, 0.002);
    assert!((attitude_rad - 0.002).abs() < 1e-17);
    let attitude_sigma_rad = paper.scene.sensor.attitude_sigma_rad.expect("poses");
    assert!((attitude_sigma_rad - 0.002 / 3f64.sqrt()).abs() < 1e-17);
    assert!((paper.scene.sensor.position_sigma_m - 0.002 / 3f64.sqrt()).abs() < 1e-18);
    // Shapes: the ends that were given.
    let shape = &scene.arm.links[8].shapes[1];
    let Geometry::Capsule { half_length, radius } = shape.geometry else { panic!("a capsule") };
    let end = shape.link_from_shape * Point3::new(0.0, 0.0, half_length);
    assert!((end - Point3::new(0.020, -0.085, -0.100)).norm() < 1e-15 && radius == 0.025);
    // A capsule that runs down is turned right round.
    let shape = &scene.arm.links[4].shapes[0];
    let Geometry::Capsule { half_length, .. } = shape.geometry else { panic!("a capsule") };
    let end = shape.link_from_shape * Point3::new(0.0, 0.0, half_length);
    assert!((end - Point3::new(0.0, 0.0, -0.130)).norm() < 1e-15);
}

#[test]
fn optional_parts_are_read() {
    let text = ARM8
        .replacen("[arm.base_link]", "[arm.base]\nxyz_mm = [1, 2, 3]\nrpy_deg = [0, 0, 90]\n\n[arm.base_link]", 1)
        .replacen("gravity_m_s2 = [0, 0, -9.81]", "uncollidable = [[\"link4\", \"link2\"]]", 1)
        .replacen("angle_deg = 0.2", "errors = { base_yaw_deg = 1, a2_mm = -0.3, theta3_deg = 0.1 }", 1)
        .replacen("rise_k = [3, 8, 10, 10, 9, 8, 7, 6, 5]", "rise_k = 10", 1)
        .replacen("attitude_noise_deg = 0.003", "", 1);
    let file = parse(&text, "test").unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(file.scene.arm.chain.parameters.len(), 51);
    assert_eq!(file.scene.arm.uncollidable, [(2, 4)]);
    assert_eq!(file.scene.arm.gravity_in_base, Vector3::new(0.0, 0.0, -9.81));
    assert_eq!(file.scene.sensor.attitude_sigma_rad, None);
    let injected = file.injected.expect("injected");
    assert_eq!(file.scene.plan.temperature.expect("it warms").rise_k, [10.0; 9]);
    let names: Vec<&str> = injected.parameter_errors.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["base_yaw", "a2", "theta3"]);
    assert_eq!(injected.parameter_errors[1].1, -0.3e-3);
    // Positions only: three equations each.
    assert!(message(&text.replacen("count = 40", "count = 16", 1)).contains("17 or more: a position gives 3 equations"));
}

#[test]
fn a_plan_is_read_and_its_defaults_are_what_was_before() {
    let [(arm8, _), (paper, _)] = shipped();
    let plan = &paper.scene.plan;
    assert_eq!((plan.repeats, plan.dwell_s, plan.payload_blocks), (1, 0.0, false));
    assert_eq!((plan.payloads_kg.as_slice(), plan.approach.policy), (&[0.0][..], ApproachPolicy::Direct));
    assert_eq!(plan.temperature, None);

    let mut file = arm8;
    for (key, value) in [
        ("plan.repeats", "3"),
        ("plan.approach", "\"alternate\""),
        ("plan.approach_travel_deg", "18"),
        ("plan.approach_travel_mm", "2"),
        ("plan.dwell_s", "20"),
        ("plan.payloads_kg", "[0, 2.5]"),
        ("plan.payload_blocks", "true"),
        ("plan.temperature", "{ profile = \"warm-up\", rise_k = 4, lag_s = [0, 1, 2, 3, 4, 5, 6, 7, 8], ambient_rise_k = 1.5 }"),
    ] {
        file.set(key, value).unwrap_or_else(|error| panic!("{error}"));
    }
    let plan = &file.scene.plan;
    assert_eq!((plan.repeats, plan.dwell_s, plan.payload_blocks, &plan.payloads_kg), (3, 20.0, true, &vec![0.0, 2.5]));
    let approach = Approach { policy: ApproachPolicy::Alternate, travel_rad: 18f64.to_radians(), travel_m: 0.002 };
    assert_eq!(plan.approach, approach);
    let temperature = Temperature {
        profile: ThermalProfile::WarmUp,
        rise_k: vec![4.0; 9],
        lag_s: (0..9).map(f64::from).collect(),
        ambient_rise_k: 1.5,
    };
    assert_eq!(plan.temperature, Some(temperature));
    let public = file.public_toml().expect("it can be written");
    assert_eq!(parse(&public, "public").unwrap_or_else(|error| panic!("{error}")).scene, file.scene);
}

fn configuration(arm: &Arm, stream: &mut Stream) -> Vec<f64> {
    arm.chain.joints.iter().map(|joint| stream.uniform(joint.lower, joint.upper)).collect()
}

#[test]
fn errors_like_the_papers_move_the_tool_as_far_as_there() {
    let [_, (paper, _)] = shipped();
    let arm = &paper.scene.arm;
    let injected = paper.injected.as_ref().expect("injected");
    let mut stream = stream(11, "test/scene/before");
    let nominal = arm.chain.at_nominal();
    let (mut sum, mut count) = (0.0, 0);
    for _ in 0..200 {
        let values: Vec<f64> = (arm.chain.parameters.iter())
            .map(|parameter| {
                let half_width = match parameter.quantity {
                    Quantity::Length => injected.length_error_m,
                    Quantity::Angle => injected.angle_error_rad,
                };
                parameter.nominal + stream.uniform(-half_width, half_width)
            })
            .collect();
        let at = arm.chain.at(&values);
        for _ in 0..30 {
            let joints = configuration(arm, &mut stream);
            sum += (at.forward(&joints).translation.vector - nominal.forward(&joints).translation.vector).norm();
            count += 1;
        }
    }
    let mean_mm = 1e3 * sum / f64::from(count);
    println!("mean position error before calibration: {mean_mm:.2} mm");
    assert!((60.0..80.0).contains(&mean_mm), "{mean_mm} mm");
}

#[test]
fn of_45_parameters_36_can_be_identified() {
    for (file, _) in shipped() {
        let arm = &file.scene.arm;
        let at = arm.chain.at_nominal();
        let mut stream = stream(12, "test/scene/rank");
        let mut stacked = DMatrix::zeros(600, 45);
        for row in 0..100 {
            let (_, jacobian) = at.jacobian(&configuration(arm, &mut stream));
            stacked.view_mut((6 * row, 0), (6, 45)).copy_from(&jacobian);
        }
        let mut singular: Vec<f64> = stacked.singular_values().iter().copied().collect();
        singular.sort_by(|a, b| b.total_cmp(a));
        let rank = singular.iter().filter(|value| **value > 1e-9 * singular[0]).count();
        println!("{}: rank {rank}, σ1 {:.3}, σ36 {:.3e}, σ37 {:.1e}", file.scene.name, singular[0], singular[35], singular[36]);
        assert_eq!(rank, 36);
    }
}

fn segment_distance(a: [Point3<f64>; 2], b: [Point3<f64>; 2]) -> f64 {
    // Alternating projection onto the two segments converges to the distance of these convex sets.
    let closest = |segment: &[Point3<f64>; 2], to: &Point3<f64>| {
        let along = segment[1] - segment[0];
        let share = ((to - segment[0]).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
        segment[0] + along * share
    };
    let mut on_a = nalgebra::center(&a[0], &a[1]);
    let mut on_b = closest(&b, &on_a);
    for _ in 0..50 {
        on_a = closest(&a, &on_b);
        on_b = closest(&b, &on_a);
    }
    (on_a - on_b).norm()
}

/// Share of random configurations that collide, with cylinders taken as capsules and of fixtures only the top.
fn colliding_share(file: &SceneFile) -> (f64, f64) {
    let arm = &file.scene.arm;
    let at = arm.chain.at_nominal();
    let mut stream = stream(13, "test/scene/collisions");
    let (mut with_links, mut with_floor, draws) = (0, 0, 3000);
    let names = arm.chain.frame_names();
    for _ in 0..draws {
        let frames = at.frames(&configuration(arm, &mut stream));
        let segments: Vec<Vec<([Point3<f64>; 2], f64)>> = (arm.links.iter())
            .map(|link| {
                let frame = names.iter().position(|name| *name == link.name).expect("every link has a frame");
                (link.shapes.iter())
                    .map(|shape| {
                        let (half_length, radius) = match shape.geometry {
                            Geometry::Capsule { half_length, radius } | Geometry::Cylinder { half_length, radius } => {
                                (half_length, radius)
                            }
                            _ => panic!("the shipped links are capsules and cylinders"),
                        };
                        let base_from_shape = frames[frame] * shape.link_from_shape;
                        ([-half_length, half_length].map(|z| base_from_shape * Point3::new(0.0, 0.0, z)), radius)
                    })
                    .collect()
            })
            .collect();
        let collides = |first: usize, second: usize| {
            segments[first]
                .iter()
                .any(|(a, radius_a)| segments[second].iter().any(|(b, radius_b)| segment_distance(*a, *b) < radius_a + radius_b))
        };
        let count = segments.len();
        with_links += i32::from((0..count).any(|first| (first + 2..count).any(|second| collides(first, second))));
        let low = |(ends, radius): &([Point3<f64>; 2], f64)| ends.iter().any(|end| end.z - radius < -0.030);
        with_floor += i32::from(!arm.fixtures.is_empty() && segments[1..].iter().flatten().any(low));
    }
    (f64::from(with_links) / f64::from(draws), f64::from(with_floor) / f64::from(draws))
}

#[test]
fn collisions_bind_in_the_cell_and_hardly_in_the_papers_scene() {
    let [(arm8, _), (paper, _)] = shipped();
    let (links, floor) = colliding_share(&arm8);
    println!("arm8: {links:.3} of random configurations collide with themselves, {floor:.3} with the floor");
    assert!((0.02..0.5).contains(&links) && (0.05..0.6).contains(&floor));
    let (links, _) = colliding_share(&paper);
    println!("paper: {links:.3} of random configurations collide with themselves");
    assert!(links < 0.2);
    for file in [arm8, paper] {
        let name = file.scene.name.clone();
        let home = vec![0.0; 8];
        assert!(file.scene.arm.within_limits(&home), "{name}");
    }
}

/// A scene of the repository's folder.
fn of_folder(name: &str) -> SceneFile {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    read(&path).unwrap_or_else(|error| panic!("{error}"))
}

/// panda.toml with the URDF `urdf` in place of its file's name.
fn with_urdf(urdf: &str) -> String {
    assert!(!urdf.contains("'''"));
    PANDA.replacen("urdf_file = \"panda.urdf\"", &format!("urdf = '''\n{urdf}'''"), 1)
}

#[test]
fn an_arm_from_a_urdf_is_the_same_from_the_file_and_inline() {
    let file = of_folder("panda.toml");
    let inline = parse(&with_urdf(PANDA_URDF), "inline").unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(file.scene, inline.scene);
    assert_eq!(file.toml().arm.urdf.as_deref(), Some(PANDA_URDF));
    let arm = &file.scene.arm;
    assert_eq!((arm.name.as_str(), arm.chain.parameters.len(), arm.joint_count()), ("panda", 48, 7));
    assert_eq!(file.scene.urdf_notes, Vec::<String>::new());
    assert!(arm.links[1..].iter().all(|link| link.inertial.as_ref().is_some_and(|inertial| inertial.impossible().is_none())));
    assert!(arm.links.iter().all(|link| !link.shapes.is_empty()));

    // What is public needs no file, and is what it was.
    let public = file.public_toml().expect("it can be written");
    assert!(!public.contains("urdf_file") && !public.contains("ab9fe3e0"));
    let back = parse(&public, "public").unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(format!("{:?}", back.scene), format!("{:?}", file.scene));
    assert_eq!(back.public_toml().expect("it can be written"), public);

    // Whatever stands in the text.
    for odd in ["\r\n", "\"\"\"", "\\u0041\t", "\u{7f} µ°", "''' \"\"\" \\"] {
        let text = PANDA_URDF.replace("-->\n<robot", &format!("{odd}-->\n<robot"));
        assert_ne!(text, PANDA_URDF);
        let mut changed = file.clone();
        changed.set("arm.urdf", &toml::Value::String(text.clone()).to_string()).unwrap_or_else(|error| panic!("{error}"));
        let back = parse(&changed.public_toml().expect("it can be written"), "public").unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(back.toml().arm.urdf.as_deref(), Some(text.as_str()));
    }
}

#[test]
fn overrides_of_an_arm_from_a_urdf() {
    let mut file = of_folder("panda.toml");
    file.set_seed(7).expect("allowed");
    file.set("arm.gravity_m_s2", "[0, 0, 9.81]").expect("allowed");
    file.set("arm.uncollidable", "[[\"panda_link7\", \"panda_link5\"]]").expect("allowed");
    file.set("injected.parameters.errors", "{ panda_joint4_x_mm = 1, tool_roll_deg = -0.5 }").expect("allowed");
    file.set("injected.effect", "[{ kind = \"radial_clearance\", joint = \"panda_joint2\", radial_um = 30 }]").expect("allowed");
    let fixture =
        "{ name = \"floor\", may_touch = [\"panda_link0\"], shape = { sphere = { centre_mm = [0, 0, -90], radius_mm = 99 } } }";
    file.set("arm.fixture", &format!("[{fixture}]")).expect("allowed");
    assert_eq!(file.scene.arm.uncollidable, [(5, 7)]);
    assert_eq!(file.scene.arm.fixtures[0].may_touch, [0]);
    assert_eq!(file.scene.arm.gravity_in_base.z, 9.81);
    let injected = file.injected.clone().expect("injected");
    assert_eq!(injected.parameter_errors[0], ("panda_joint4_x".to_owned(), 1e-3));
    assert_eq!(injected.effects[0], Effect::Clearance { joint: 1, radial: 30e-6, axial: 0.0, tilt: 0.0 });
    // The arm ends earlier: what hangs behind is frozen, and its links are none of the arm's.
    let refused = file.set("arm.urdf_tip_link", "\"panda_link6\"").expect_err("link 7 is in uncollidable").to_string();
    assert!(refused.contains("arm.uncollidable[1][1]") && refused.contains("did you mean `panda_link"), "{refused}");
    file.set("arm.uncollidable", "[]").expect("allowed");
    file.set("arm.urdf_tip_link", "\"panda_link6\"").expect("allowed");
    assert_eq!(file.scene.arm.joint_count(), 6);
    assert!(file.scene.urdf_notes[0].contains("joint panda_joint7 is not in the chain"), "{:?}", file.scene.urdf_notes);
    // A file is looked for where the scene is, and takes the place of the text.
    let refused = file.set("arm.urdf_file", "\"ur5.urdf\"").expect_err("there is none").to_string();
    assert!(refused.contains("scenes/ur5.urdf: No such file") && refused.contains("relative to the scene's folder"), "{refused}");
    file.set("arm.urdf_file", "\"panda.urdf\"").expect("allowed");
    assert_eq!(file.toml().arm.urdf.as_deref(), Some(PANDA_URDF));
}

#[test]
fn what_is_wrong_with_an_arm_from_a_urdf_is_named() {
    let inline = with_urdf(PANDA_URDF);
    let key = "urdf_file = \"panda.urdf\" # from this file's folder\n";
    let frame = "[[arm.frame]]\nalpha_deg = 0\na_mm = 0\ntheta_deg = 0\nd_mm = 0\n[sensor]";
    let six = "base = { xyz_mm = [0, 0, 0], rpy_deg = [0, 0, 0] }\nconvention = \"urdf\"";
    let urdf = |old: &str, new: &str| {
        assert!(PANDA_URDF.contains(old), "{old}");
        with_urdf(&PANDA_URDF.replacen(old, new, 1))
    };
    let line_in_urdf =
        |of: &str| format!("line {}: ", PANDA_URDF[..PANDA_URDF.find(of).expect("it is there")].matches('\n').count() + 1);
    let joint1 = line_in_urdf("<joint name=\"panda_joint1\"");
    let link2 = line_in_urdf("<link name=\"panda_link2\"");
    let cases: &[(String, &[&str])] = &[
        // Keys.
        (PANDA.replacen(key, "", 1), &["arm.convention", "neither `urdf_file` nor `urdf`", "add `urdf_file"]),
        (inline.replacen("urdf = ", &format!("{key}urdf = "), 1), &["arm.urdf_file", "`urdf_file` and `urdf`", "remove one"]),
        (PANDA.to_owned(), &["arm.urdf_file", "\"panda.urdf\", but no folder", "write the text itself"]),
        (inline.replacen("[sensor]", frame, 1), &["arm.frame", "with convention = \"urdf\"", "remove the key"]),
        (inline.replacen("convention = \"urdf\"", six, 1), &["arm.base", "with convention = \"urdf\"", "the URDF's"]),
        (inline.replacen("[sensor]", "[arm.base_link]\n[sensor]", 1), &["arm.base_link", "where it begins is urdf_base_link"]),
        (inline.replacen("urdf = '", "base_link = 'foot'\nurdf = '", 1), &["arm.base_link", "did you mean `urdf_base_link`?"]),
        (inline.replacen("urdf = '", "tip_link = 'nest'\nurdf = '", 1), &["arm.tip_link", "did you mean `urdf_tip_link`?"]),
        (inline.replacen("urdf = '", "urdf_tip = 'nest'\nurdf = '", 1), &["arm.urdf_tip", "did you mean `urdf_tip_link`?"]),
        (PANDA.replacen("urdf_file = \"panda.urdf\"", "urdf = 5", 1), &["arm.urdf", "a string"]),
        (ARM8.replacen("note = ", "urdf_file = \"x\"\nnote = ", 1), &["arm.urdf_file", "with convention = \"mdh5\""]),
        (ARM8.replacen("note = ", "urdf_tip_link = \"x\"\nnote = ", 1), &["arm.urdf_tip_link", "set convention = \"urdf\""]),
        (inline.replacen("\"urdf\"", "\"dh\"", 1), &["arm.convention", "`dh`", "mdh5, urdf"]),
        // Links.
        (
            inline.replacen("urdf = '", "urdf_tip_link = 'tip'\nurdf = '", 1),
            &["arm.urdf_tip_link", "no link \"tip\"", "panda_flange", "do: give one of these to urdf_tip_link"],
        ),
        (inline.replacen("urdf = '", "urdf_base_link = 'foot'\nurdf = '", 1), &["arm.urdf_base_link", "no link \"foot\""]),
        (
            urdf("<link name=\"nest\"/>", "<link name=\"nest\"/><link name=\"lost\"/>"),
            &["arm.urdf", "links that no joint connects", "urdf_base_link"],
        ),
        // The text.
        (
            urdf("<limit lower=\"-2.8973\" upper=\"2.8973\" ", "<limit "),
            &["arm.urdf", &joint1, "joint \"panda_joint1\": no limits", "do: add <limit"],
        ),
        (urdf("</link>", "</lnik>"), &["arm.urdf", "`</lnik>`", "well-formed XML"]),
        (inline.replacen("<robot", "<!-- <robot", 1), &["arm.urdf"]),
        (urdf("<mass value=\"0.646926\"/>", "<mass value=\"-1\"/>"), &["arm.urdf", &link2, "link \"panda_link2\": mass -1"]),
        (
            urdf("<mass value=\"0.646926\"/>", "<mass value=\"1e300\"/>"),
            &["arm.urdf", "link \"panda_link2\": mass 1", "100000 kg at most"],
        ),
        (urdf("xyz=\"0 -0.316 0\"", "xyz=\"0 -316 0\""), &["arm.urdf", "panda_joint3_y -316 m", "100 m at most"]),
        (urdf("lower=\"-1.7628\"", "lower=\"-1e9\""), &["arm.urdf", "joint \"panda_joint2\": limit", "rad at most"]),
        (
            urdf(
                "ixx=\"0.00315\" ixy=\"8.2904e-07\" ixz=\"0.00015\" iyy=\"0.00388\" iyz=\"8.2299e-06\" izz=\"0.004285\"",
                "ixx=\"1e9\" ixy=\"0\" ixz=\"0\" iyy=\"1e9\" iyz=\"0\" izz=\"1e9\"",
            ),
            &["arm.urdf", "link \"panda_link0\": inertia 1000000000 kg", "check the number"],
        ),
        (urdf("cylinder radius=\"0.06\"", "cylinder radius=\"1e9\""), &["arm.urdf", "a shape of"]),
        (
            inline.replacen("note = ", "uncollidable = [[\"link1\", \"link3\"]]\nnote = ", 1),
            &["arm.uncollidable[1][1]", "\"link1\"", "panda_link0, panda_link1"],
        ),
        (inline.replacen("count = 40", "count = 7", 1), &["design.count", "8 or more", "48 parameters"]),
    ];
    for (text, expected) in cases {
        let message = message(text);
        for fragment in expected.iter().copied().chain(["cell.toml:", "\n  found: ", "\n  do: "]) {
            assert!(message.contains(fragment), "{fragment:?} is not in\n{message}");
        }
        assert!(!message.contains("--tip-link") && !message.contains("--base-link"), "{message}");
    }
}

#[test]
fn what_is_wrong_in_a_urdf_file_is_named_with_both_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = folder.path().join("cell.toml");
    std::fs::write(&scene, PANDA).expect("written");
    let message = || read(&scene).expect_err("refused").to_string();
    let key = format!(
        "cell.toml:{}:1: arm.urdf_file",
        PANDA[..PANDA.find("urdf_file").expect("it is there")].matches('\n').count() + 1
    );
    let missing = message();
    assert!(missing.contains(&key) && missing.contains("panda.urdf: No such file"), "{missing}");
    std::fs::write(folder.path().join("panda.urdf"), PANDA_URDF.replacen("type=\"revolute\"", "type=\"planar\"", 1))
        .expect("written");
    let line = PANDA_URDF[..PANDA_URDF.find("<joint").expect("joints")].matches('\n').count() + 1;
    let wrong = message();
    assert!(wrong.contains(&key) && wrong.contains(&format!("panda.urdf, line {line}: joint \"panda_joint1\"")), "{wrong}");
    std::fs::write(folder.path().join("panda.urdf"), b"\xff\xfe").expect("written");
    assert!(message().contains("UTF-8"));
    std::fs::write(folder.path().join("panda.urdf"), PANDA_URDF).expect("written");
    assert_eq!(read(&scene).expect("right").scene, of_folder("panda.toml").scene);
}

#[test]
fn notes_of_a_urdf_are_kept() {
    // The inertia of a rod a thousand times as long as it is said to be: no body has it.
    let text = with_urdf(&PANDA_URDF.replacen("izz=\"0.009117\"", "izz=\"9.117\"", 1));
    let file = parse(&text, "inline").unwrap_or_else(|error| panic!("{error}"));
    assert!(file.scene.urdf_notes.iter().any(|note| note.contains("panda_link1: principal moments")));
    let inertial = file.scene.arm.links[1].inertial.as_ref().expect("mass and centre are right");
    assert!(inertial.impossible().is_none());
}

/// Names of the parameters that the arm's structure hides, for full poses and for positions only; and the ranks.
fn structure(arm: &Arm) -> ([usize; 2], Vec<Vec<String>>) {
    let subspaces = [true, false].map(|attitude| Subspace::of_structure(arm, attitude));
    let dropped = subspaces
        .iter()
        .map(|subspace| subspace.dropped.iter().map(|column| arm.chain.parameters[*column].name.clone()).collect());
    (subspaces.each_ref().map(Subspace::rank), dropped.collect())
}

#[test]
fn a_chain_from_a_urdf_has_4n_and_6_parameters() {
    let arm = of_folder("panda.toml").scene.arm;
    let ([poses, positions], dropped) = structure(&arm);
    println!("panda: rank {poses}, without {}; positions {positions}, without {}", dropped[0].join(" "), dropped[1].join(" "));
    // Of a point's position the three angles of the tool are not seen.
    assert_eq!((poses, positions), (4 * 7 + 6, 4 * 7 + 3));
    for number in 2..=7 {
        for hidden in ["z", "yaw"] {
            assert!(dropped[0].contains(&format!("panda_joint{number}_{hidden}")), "{dropped:?}");
        }
    }
}

#[test]
fn between_parallel_axes_beta_is_kept_and_d_is_not() {
    let arm = of_folder("parallel8.toml").scene.arm;
    let ([poses, positions], dropped) = structure(&arm);
    println!(
        "parallel8: rank {poses}, without {}; positions {positions}, without {}",
        dropped[0].join(" "),
        dropped[1].join(" ")
    );
    // 4·8 + 6 less the two of the base that the first frame of the convention does not have: its theta and d are the joint's.
    assert_eq!((poses, positions), (36, 33));
    for dropped in &dropped {
        // Axes 2, 3 and 4 are parallel, 6 and 7 are.
        for name in ["beta2", "beta3", "beta6"] {
            assert!(!dropped.contains(&name.to_owned()), "{name} is dropped: {dropped:?}");
        }
        for name in ["d3", "d4", "d7", "beta1", "beta4", "beta5", "beta7", "beta8"] {
            assert!(dropped.contains(&name.to_owned()), "{name} is kept: {dropped:?}");
        }
    }
}

#[test]
fn most_configurations_of_the_papers_arms_are_free() {
    for (name, most) in [("panda.toml", 0.05), ("parallel8.toml", 0.05)] {
        let arm = of_folder(name).scene.arm;
        let check = CollisionCheck::new(&arm);
        let (mut stream, mut scratch) = (stream(14, "test/scene/free"), Scratch::default());
        let draws = 5000;
        let mut pairs = std::collections::BTreeMap::<String, usize>::new();
        let mut refused = 0;
        for _ in 0..draws {
            let joints = configuration(&arm, &mut stream);
            if check.collides(&joints, &mut scratch) {
                refused += 1;
                let contact = check.contact(&joints).expect("it collides");
                *pairs.entry(format!("{} and {}", contact.first, contact.second)).or_default() += 1;
            }
        }
        let share = f64::from(refused) / f64::from(draws);
        println!("{name}: {share:.4} of random configurations are refused: {pairs:?}");
        assert!(share > 0.0 && share < most, "{name}: {share}");
    }
}

#[test]
fn a_sensor_sees_its_cone() {
    let [(arm8, _), _] = shipped();
    let everywhere = arm8.scene.sensor;
    assert_eq!(everywhere.view, None);
    assert!(everywhere.sees(&Vector3::new(1e3, -1e3, 5.0)) && everywhere.sees(&everywhere.position_in_base.coords));

    // From (2.4, 0.7, 0.3) along −x.
    let with = |view: &str| ARM8.replacen("temperature_noise_k = 0.1", &format!("temperature_noise_k = 0.1\nview = {view}"), 1);
    let file =
        parse(&with("{ towards_mm = [0, 700, 300], half_angle_deg = 30 }"), "cone").unwrap_or_else(|error| panic!("{error}"));
    let sensor = &file.scene.sensor;
    let edge = 30f64.to_radians().tan();
    let from = |x: f64, y: f64, z: f64| sensor.sees(&(sensor.position_in_base.coords + Vector3::new(x, y, z)));
    assert!(from(0.0, 0.0, 0.0) && from(-1.0, 0.0, 0.0) && from(-5.0, 0.0, 0.0));
    for (y, z) in [(1.0, 0.0), (0.0, -1.0), (0.6, 0.8), (-0.8, 0.6)] {
        for distance in [0.1, 1.0, 7.0] {
            let at = |share: f64| from(-distance, share * edge * distance * y, share * edge * distance * z);
            assert!(at(0.999) && !at(1.001), "{y} {z} {distance}");
        }
    }
    assert!(!from(1.0, 0.0, 0.0) && !from(0.0, 1.0, 0.0));
    // The same from the public text.
    let public = file.public_toml().expect("it can be written");
    assert_eq!(parse(&public, "public").unwrap_or_else(|error| panic!("{error}")).scene, file.scene);

    // Half of space, and all of it.
    let [half, all] = ["90", "180"].map(|angle| {
        let text = with(&format!("{{ towards_mm = [0, 700, 300], half_angle_deg = {angle} }}"));
        parse(&text, "cone").unwrap_or_else(|error| panic!("{error}")).scene.sensor
    });
    let behind = half.position_in_base.coords + Vector3::new(1.0, 0.0, 0.0);
    assert!(half.sees(&Vector3::zeros()) && !half.sees(&behind) && all.sees(&behind));

    let refused: &[(&str, &[&str])] = &[
        ("{ towards_mm = [2400, 700, 300], half_angle_deg = 20 }", &["sensor.view.towards_mm", "where the sensor stands"]),
        ("{ towards_mm = [0, 0, 0], half_angle_deg = 0 }", &["sensor.view.half_angle_deg", "more than 0, 180 at most"]),
        ("{ towards_mm = [0, 0, 0], half_angle_deg = -5 }", &["sensor.view.half_angle_deg", "found: -5"]),
        ("{ towards_mm = [0, 0, 0], half_angle_deg = 180.5 }", &["sensor.view.half_angle_deg", "180.5"]),
        ("{ towards_mm = [0, 0, 0] }", &["sensor.view", "`half_angle_deg` is missing"]),
        ("{ towards_mm = [0, 0], half_angle_deg = 20 }", &["sensor.view.towards_mm", "a list of three numbers"]),
        ("{ towards_mm = [0, 0, 1e9], half_angle_deg = 20 }", &["sensor.view.towards_mm[3]", "-100000 to 100000"]),
        ("{ towards_mm = [0, 0, 0], half_angle_rad = 1 }", &["did you mean `half_angle_deg`?"]),
        ("20", &["sensor.view", "a table"]),
    ];
    for (view, expected) in refused {
        let message = message(&with(view));
        for fragment in *expected {
            assert!(message.contains(fragment), "{fragment:?} is not in\n{message}");
        }
    }
}

/// arm8 with the effects of `tables` in place of its own.
fn with_effects(tables: &str) -> Result<SceneFile, SceneError> {
    let own = ARM8.find("# Play of the bearings").expect("the effects come last");
    parse(&format!("{}{tables}", &ARM8[..own]), "cell.toml")
}

#[test]
fn every_kind_of_effect_becomes_what_its_table_says() {
    let arcsec = std::f64::consts::PI / 648_000.0;
    let vector = |x, y, z| Vector3::new(x, y, z) / 1e6;
    let cases = [
        (
            "joint_compliance",
            "joint = \"joint2\"\nstiffness_nm_per_rad = 2e4",
            Effect::JointCompliance { joint: 1, stiffness: 2e4 },
        ),
        (
            "link_bending",
            "link = \"link3\"\ncompliance_urad_per_nm = 10",
            Effect::LinkBending { link: 2, compliance: 10.0 / 1e6 },
        ),
        ("backlash", "joint = \"joint3\"\nwidth_arcsec = 60", Effect::Backlash { joint: 2, width: 60.0 * arcsec }),
        (
            "gravity_lost_motion",
            "joint = \"joint8\"\nwidth_arcsec = 60",
            Effect::GravityLostMotion { joint: 7, width: 60.0 * arcsec },
        ),
        (
            "joint_eccentricity",
            "joint = \"joint1\"\namplitude_arcsec = 30\norder = 2\nphase_deg = 180",
            Effect::JointEccentricity { joint: 0, amplitude: 30.0 * arcsec, order: 2, phase: std::f64::consts::PI },
        ),
        (
            "strain_wave_error",
            "joint = \"joint1\"\namplitude_arcsec = 20\nratio = 100",
            Effect::StrainWaveError { joint: 0, amplitude: 20.0 * arcsec, ratio: 100.0, phase: 0.0 },
        ),
        (
            "gear_coupling",
            "joint = \"joint6\"\ncoupling_urad_per_rad = -100\nsource = \"joint5\"",
            Effect::GearCoupling { joint: 5, ratio_error: 0.0, coupling: -100.0 / 1e6, source: 4 },
        ),
        (
            "link_thermal_growth",
            "link = \"link4\"\nexpansion_um_per_m_per_k = 23",
            Effect::LinkThermalGrowth { link: Some(3), expansion: 23.0 / 1e6 },
        ),
        (
            "joint_thermal_drift",
            "joint = \"joint4\"\ndrift_urad_per_k = -9",
            Effect::JointThermalDrift { joint: 3, drift: -9.0 / 1e6 },
        ),
        (
            "radial_clearance",
            "joint = \"joint3\"\nradial_um = 30",
            Effect::Clearance { joint: 2, radial: 30e-6, axial: 0.0, tilt: 0.0 },
        ),
        (
            "tilt_clearance",
            "joint = \"joint3\"\ntilt_urad = 90",
            Effect::Clearance { joint: 2, radial: 0.0, axial: 0.0, tilt: 90.0 / 1e6 },
        ),
        ("clearance", "joint = \"joint3\"\naxial_um = 10", Effect::Clearance { joint: 2, radial: 0.0, axial: 10e-6, tilt: 0.0 }),
        (
            "base_drift",
            "translation_um = [1, 2, 3]\nmoves = \"sensor\"",
            Effect::BaseDrift { moves: Moves::Sensor, translation: vector(1.0, 2.0, 3.0), rotation: Vector3::zeros() },
        ),
        (
            "base_step",
            "translation_um = [1, 2, 3]\nrotation_urad = [4, 5, 6]\nafter = 0.5",
            Effect::BaseStep {
                moves: Moves::Base,
                translation: vector(1.0, 2.0, 3.0),
                rotation: vector(4.0, 5.0, 6.0),
                after: 0.5,
            },
        ),
        (
            "tool_step",
            "translation_um = [100, 0, 0]\nafter = 0.25",
            Effect::ToolStep { translation: vector(100.0, 0.0, 0.0), rotation: Vector3::zeros(), after: 0.25 },
        ),
        ("measurement_scale", "scale_ppm = -40", Effect::MeasurementScale { scale: -40.0 / 1e6 }),
        ("measurement_outliers", "share = 0.05\nfactor = 10", Effect::MeasurementOutliers { share: 0.05, factor: 10.0 }),
        (
            "worn_tooth_sector",
            "joint = \"joint2\"\ndepth_arcsec = 80\ncentre_deg = 90\nhalf_width_deg = 180",
            Effect::WornToothSector {
                joint: 1,
                depth: 80.0 * arcsec,
                centre: std::f64::consts::FRAC_PI_2,
                half_width: std::f64::consts::PI,
            },
        ),
        (
            "creep_after_motion",
            "joint = \"joint2\"\ncompliance_urad_per_nm = 10\ntime_constant_s = 60",
            Effect::CreepAfterMotion { joint: 1, compliance: 10.0 / 1e6, time_constant: 60.0 },
        ),
        ("moment_crosstalk", "joint = \"joint2\"\ngain_urad_per_nm = -8", Effect::MomentCrosstalk { joint: 1, gain: -8.0 / 1e6 }),
        (
            "memory_hysteresis",
            "joint = \"joint2\"\namplitude_arcsec = 30\ntravel_deg = 180",
            Effect::MemoryHysteresis { joint: 1, amplitude: 30.0 * arcsec, travel: std::f64::consts::PI },
        ),
        ("wrong_payload", "excess_kg = 1\nstiffness_nm_per_rad = 2e4", Effect::WrongPayload { excess: 1.0, stiffness: 2e4 }),
        (
            "hardening_stiffness",
            "joint = \"joint2\"\nstiffness_nm_per_rad = 2e4\ncubic_nm_per_mrad3 = 5",
            Effect::HardeningStiffness { joint: 1, stiffness: 2e4, cubic: 5e9 },
        ),
    ];
    assert_eq!(cases.each_ref().map(|case| case.0), KINDS.map(|kind| kind.kind));
    for (kind, keys, expected) in cases {
        let file =
            with_effects(&format!("[[injected.effect]]\nkind = \"{kind}\"\n{keys}\n")).unwrap_or_else(|error| panic!("{error}"));
        let effects = file.injected.clone().expect("injected").effects;
        assert_eq!(effects, [expected], "{kind}");
        assert!(kind == "clearance" || effects[0].name() == kind || kind == "tilt_clearance", "{kind}: {}", effects[0].name());
        // Written and read again it is the same.
        let text = file.injected_toml().expect("it can be written").expect("injected");
        assert_eq!(parse_injected(&text, "truth", &file.scene.arm).unwrap_or_else(|error| panic!("{error}")).effects, effects);
    }
}

#[test]
fn wrong_effects_are_refused_with_line_key_and_remedy() {
    for (table, expected) in [
        ("kind = \"play\"", &["injected.effect[1].kind", "joint_compliance, link_bending", "kincal effects"][..]),
        ("kind = \"backlsh\"", &["did you mean `backlash`?"]),
        ("kind = \"backlash\"\nwidth_arcsec = 60", &["injected.effect[1].joint", "`joint` is missing"]),
        ("kind = \"backlash\"\njoint = \"joint9\"\nwidth_arcsec = 60", &["injected.effect[1].joint", "joint1, joint2"]),
        ("kind = \"backlash\"\njoint = \"joint3\"", &["`width_arcsec` is missing", "backlash needs width_arcsec"]),
        ("kind = \"backlash\"\njoint = \"joint3\"\nwidth_arcsec = -6", &["injected.effect[1].width_arcsec", "more than 0"]),
        ("kind = \"backlash\"\njoint = \"joint3\"\nwidth_arcsec = 6e4", &["2060 at most"]),
        ("kind = \"backlash\"\njoint = \"joint3\"\nwidth_mm = 6", &["unknown key `width_mm`", "did you mean `width_arcsec`?"]),
        (
            "kind = \"backlash\"\njoint = \"joint3\"\nwidth_arcsec = 6\nphase_deg = 3",
            &["injected.effect[1].phase_deg", "which backlash does not have", "kind, joint, width_arcsec"],
        ),
        (
            "kind = \"joint_compliance\"\njoint = \"joint3\"\nstiffness_nm_per_rad = -2e4",
            &["stiffness_nm_per_rad", "more than 0"],
        ),
        ("kind = \"radial_clearance\"\njoint = \"joint3\"\nradial_um = 3000", &["injected.effect[1].radial_um", "1000 at most"]),
        ("kind = \"clearance\"\njoint = \"joint3\"", &["no magnitude", "at least one of radial_um, axial_um, tilt_urad"]),
        ("kind = \"link_bending\"\nlink = \"link9\"\ncompliance_urad_per_nm = 3", &["injected.effect[1].link", "link1, link2"]),
        (
            "kind = \"joint_eccentricity\"\njoint = \"joint3\"\namplitude_arcsec = 3\norder = 3",
            &["injected.effect[1].order", "1 or 2"],
        ),
        ("kind = \"gear_coupling\"\njoint = \"joint3\"\ncoupling_urad_per_rad = 3", &["`source` is missing"]),
        ("kind = \"tool_step\"\ntranslation_um = [9, 9, 9]\nafter = 1.5", &["injected.effect[1].after", "1 at most"]),
        ("kind = \"measurement_outliers\"\nshare = 2\nfactor = 5", &["injected.effect[1].share", "1 at most"]),
        ("kind = \"base_step\"\ntranslation_um = [9, 9, 9]\nafter = 1\nmoves = \"arm\"", &["moves", "base", "sensor"]),
        (
            "kind = \"link_thermal_growth\"\nlink = \"link2\"\nexpansion_um_per_m_per_k = [1, 2]",
            &["injected.effect[1].expansion_um_per_m_per_k", "one number where a link is named"],
        ),
    ] {
        let message = match with_effects(&format!("[[injected.effect]]\n{table}\n")) {
            Ok(_) => panic!("accepted: {table}"),
            Err(error) => error.to_string(),
        };
        for fragment in expected.iter().chain(&["cell.toml:"]) {
            assert!(message.contains(fragment), "{table}: {fragment:?} is not in\n{message}");
        }
    }
    for (section, expected) in [
        ("[injected.thermal]\nrise_k = 3\n", "[plan.temperature]"),
        ("[[injected.clearance]]\njoint = \"joint2\"\n", "kind = \"clearance\""),
    ] {
        let message = with_effects(section).map(drop).unwrap_err().to_string();
        assert!(message.contains("of an earlier version") && message.contains(expected), "{message}");
    }
}
