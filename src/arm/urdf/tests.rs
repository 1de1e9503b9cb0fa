use std::path::PathBuf;

use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};

use super::*;
use crate::arm::frames::{Pose, pose_error};
use crate::arm::{Arm, Geometry};
use crate::arm::{JointKind, Quantity};
use crate::scene;
use crate::seed::{Stream, stream};

fn shipped() -> [Arm; 2] {
    [include_str!("../../../scenes/arm8.toml"), include_str!("../../../scenes/paper.toml")]
        .map(|text| scene::parse(text, "shipped").expect("the shipped scenes are valid").scene.arm)
}

fn imported(text: &str) -> Imported {
    import(text, "robot.urdf", None, None).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

fn configuration(arm: &Arm, stream: &mut Stream) -> Vec<f64> {
    arm.chain.joints.iter().map(|joint| stream.uniform(joint.lower, joint.upper)).collect()
}

/// Largest difference of any frame that both have (by name), m or rad, over `count` configurations.
fn largest_difference(one: &Arm, values: &[f64], other: &Arm, count: usize, stream: &mut Stream) -> f64 {
    let (at_one, at_other) = (one.chain.at(values), other.chain.at_nominal());
    let (names_one, names_other) = (one.chain.frame_names(), other.chain.frame_names());
    assert_eq!(names_one, names_other);
    let mut largest = 0.0f64;
    for _ in 0..count {
        let joints = configuration(one, stream);
        for (a, b) in at_one.frames(&joints).iter().zip(&at_other.frames(&joints)) {
            largest = largest.max(pose_error(a, b).abs().max());
        }
        largest = largest.max(pose_error(&at_one.forward(&joints), &at_other.forward(&joints)).abs().max());
    }
    largest
}

#[test]
fn an_exported_arm_is_imported_with_the_same_poses() {
    let mut stream = stream(1, "test/urdf/round");
    for arm in shipped() {
        let back = imported(&export(&arm).expect("it can be written"));
        let nominal = largest_difference(&arm, &arm.chain.nominal(), &back.arm, 200, &mut stream);
        let mut worst = 0.0f64;
        for _ in 0..20 {
            let values: Vec<f64> = (arm.chain.parameters.iter())
                .map(|parameter| match parameter.quantity {
                    Quantity::Length => parameter.nominal + stream.uniform(-0.1, 0.1),
                    Quantity::Angle => parameter.nominal + stream.uniform(-3.0, 3.0),
                })
                .collect();
            let back = imported(&export_with(&arm, &values).expect("it can be written"));
            worst = worst.max(largest_difference(&arm, &values, &back.arm, 200, &mut stream));
        }
        println!("{}: poses differ by {nominal:.1e} at most, {worst:.1e} with random parameters", arm.name);
        assert!(nominal < 1e-12 && worst < 1e-12);
        // A second round changes nothing any more.
        let again = imported(&export(&back.arm).expect("it can be written"));
        assert!(largest_difference(&back.arm, &back.arm.chain.nominal(), &again.arm, 50, &mut stream) < 1e-12);
    }
}

#[test]
fn origins_of_five_parameter_chains_hold_the_parameters_themselves() {
    let [arm, _] = shipped();
    let mut values = arm.chain.nominal();
    // alpha4, theta3, d3, beta3: joint 4's origin.
    (values[15], values[12], values[13], values[14]) = (-1.5701, 0.0123, 0.2811, 0.0045);
    let text = export_with(&arm, &values).expect("it can be written");
    let joint4 = &text[text.find("<joint name=\"joint4\"").expect("joint 4")..];
    let origin = joint4.lines().nth(1).expect("its origin");
    assert!(origin.contains("rpy=\"-1.5701 0.0045 0.0123\""), "{origin}");
}

#[test]
fn masses_shapes_joints_and_names_survive() {
    for arm in shipped() {
        let back = imported(&export(&arm).expect("it can be written")).arm;
        assert_eq!(back.name, arm.name);
        assert_eq!(back.chain.joints, arm.chain.joints);
        assert_eq!(back.links.len(), arm.links.len());
        for (one, other) in arm.links.iter().zip(&back.links) {
            assert_eq!((&one.name, &one.inertial), (&other.name, &other.inertial));
            assert_eq!(one.shapes.len(), other.shapes.len());
            for (one, other) in one.shapes.iter().zip(&other.shapes) {
                match (one.geometry, other.geometry) {
                    (Geometry::Capsule { half_length: a, radius: r }, Geometry::Capsule { half_length: b, radius: s })
                    | (Geometry::Cylinder { half_length: a, radius: r }, Geometry::Cylinder { half_length: b, radius: s }) => {
                        assert_eq!((a, r), (b, s));
                    }
                    other => panic!("{other:?}"),
                }
                assert!(pose_error(&one.link_from_shape, &other.link_from_shape).norm() < 1e-14);
            }
        }
    }
}

/// Every way in which a chain can go on: axes that are not z, fixed joints before, between and after, a slide, side branches.
const ODD: &str = r#"<?xml version="1.0"?>
<robot name="odd">
  <link name="base"/>
  <link name="foot"><inertial><origin xyz="0 0 0.1"/><mass value="4"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <joint name="foot_fixed" type="fixed"><parent link="base"/><child link="foot"/><origin xyz="0.1 0 0.2" rpy="0.3 -0.2 1"/></joint>
  <link name="a"><inertial><origin xyz="0 0 0.2" rpy="0 0 1.5"/><mass value="2"/><inertia ixx="0.02" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.04"/></inertial>
    <collision><origin xyz="0 0 0.1"/><geometry><box size="0.1 0.2 0.3"/></geometry></collision>
    <collision><geometry><mesh filename="a.stl"/></geometry></collision>
  </link>
  <joint name="shoulder" type="continuous"><parent link="foot"/><child link="a"/><origin xyz="0 0.1 0.3" rpy="0 0.5 0"/><axis xyz="0 0 2"/></joint>
  <link name="motor"><inertial><origin xyz="0 0 0"/><mass value="1"/><inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/></inertial></link>
  <joint name="motor_fixed" type="fixed"><parent link="a"/><child link="motor"/><origin xyz="0 0 0.5"/></joint>
  <link name="b"/>
  <joint name="slide" type="prismatic"><parent link="a"/><child link="b"/><origin xyz="0.1 0 0" rpy="1 1.5707963267948966 0.2"/><axis xyz="1 0 1"/><limit lower="-0.1" upper="0.3" effort="1" velocity="1"/></joint>
  <link name="c"/>
  <joint name="down" type="revolute"><parent link="b"/><child link="c"/><origin xyz="0 0 0.2"/><axis xyz="0 0 -1"/><limit lower="-1" upper="2" effort="1" velocity="1"/></joint>
  <link name="d"/>
  <joint name="bridge" type="fixed"><parent link="c"/><child link="d"/><origin xyz="0.01 0.02 0.03" rpy="0.1 0.2 0.3"/></joint>
  <link name="e"><collision><geometry><cylinder radius="0.05" length="0.2"/></geometry></collision></link>
  <joint name="wrist" type="revolute"><parent link="d"/><child link="e"/><origin xyz="0 0 0.1" rpy="0 0 0.4"/><axis xyz="0.6 -0.8 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
  <link name="flange"/>
  <joint name="flange_fixed" type="fixed"><parent link="e"/><child link="flange"/><origin xyz="0 0 0.08" rpy="0 0.7 0"/></joint>
  <link name="probe"/>
  <joint name="probe_fixed" type="fixed"><parent link="flange"/><child link="probe"/><origin xyz="0 0.01 0.03" rpy="0.2 0 0"/></joint>
  <link name="finger"><inertial><origin xyz="0 0 0"/><mass value="0.2"/><inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/></inertial></link>
  <joint name="grip" type="prismatic"><parent link="flange"/><child link="finger"/><origin xyz="0.02 0 0"/><axis xyz="1 0 0"/><limit lower="0" upper="0.1" effort="1" velocity="1"/><mimic joint="slide"/></joint>
</robot>"#;

/// Forward kinematics straight from the file: nalgebra's own rotations, along the way up from `tip`.
fn by_the_book(robot: &urdf_rs::Robot, tip: &str, value_of: &dyn Fn(&str) -> f64) -> Pose {
    let Some(joint) = robot.joints.iter().find(|joint| joint.child.link == tip) else { return Pose::identity() };
    let [roll, pitch, yaw] = *joint.origin.rpy;
    let origin = Isometry3::from_parts(
        Translation3::from(Vector3::from(*joint.origin.xyz)),
        UnitQuaternion::from_euler_angles(roll, pitch, yaw),
    );
    let axis = Unit::new_normalize(Vector3::from(*joint.axis.xyz));
    let motion = match joint.joint_type {
        urdf_rs::JointType::Fixed => Isometry3::identity(),
        urdf_rs::JointType::Prismatic => {
            Isometry3::from_parts(Translation3::from(axis.into_inner() * value_of(&joint.name)), UnitQuaternion::identity())
        }
        _ => Isometry3::rotation(axis.into_inner() * value_of(&joint.name)),
    };
    by_the_book(robot, &joint.parent.link, value_of) * origin * motion
}

fn assert_by_the_book(text: &str, arm: &Arm, seed: u64) -> f64 {
    let robot = urdf_rs::read_from_string(text).expect("a valid URDF");
    let mut stream = stream(seed, "test/urdf/book");
    let at = arm.chain.at_nominal();
    let names = arm.chain.frame_names();
    let mut largest = 0.0f64;
    for _ in 0..100 {
        let joints = configuration(arm, &mut stream);
        let value_of =
            |name: &str| arm.chain.joints.iter().position(|joint| joint.name == name).map_or(0.0, |joint| joints[joint]);
        for (name, frame) in names.iter().zip(at.frames(&joints)) {
            if robot.links.iter().any(|link| link.name == *name) {
                largest = largest.max(pose_error(&by_the_book(&robot, name, &value_of), &frame).abs().max());
            }
        }
    }
    assert!(largest < 1e-12, "{largest:e}");
    largest
}

#[test]
fn any_axis_and_any_place_of_fixed_joints_keep_the_poses_of_the_file() {
    let result = import(ODD, "odd.urdf", None, Some("probe")).unwrap_or_else(|error| panic!("{error}"));
    let arm = &result.arm;
    assert_by_the_book(ODD, arm, 1);
    assert_eq!(arm.chain.frame_names(), ["base", "a", "b", "c", "e", "probe"]);
    let names: Vec<&str> = arm.chain.parameters.iter().map(|parameter| parameter.name.as_str()).collect();
    assert_eq!(names.len(), 30);
    assert_eq!((names[0], names[11], names[24], names[29]), ("shoulder_x", "slide_roll", "tool_x", "tool_roll"));
    assert_eq!(arm.chain.joints[1].kind, JointKind::Prismatic);
    assert_eq!((arm.chain.joints[0].lower, arm.chain.joints[3].upper), (-std::f64::consts::PI, 2.0));
    // 2 kg at 0.2 m and 1 kg at 0.5 m.
    let inertial = arm.links[1].inertial.as_ref().expect("a mass");
    assert_eq!(inertial.mass_kg, 3.0);
    assert!((inertial.centre_of_mass_in_link.z - 0.3).abs() < 1e-15);
    assert!((inertial.inertia_in_link.trace() - (0.09 + 0.003 + 2.0 * (2.0 * 0.01 + 0.04))).abs() < 1e-15);
    assert_eq!(arm.links[4].inertial.as_ref().map(|inertial| inertial.mass_kg), Some(0.2));
    let notes = result.notes.join("\n");
    for fragment in [
        "shoulder is continuous",
        "joint grip is not in the chain, and frozen at 0",
        "collisions of these links are not seen: a",
        "no mass is known of b, c",
    ] {
        assert!(notes.contains(fragment), "{fragment:?} is not in\n{notes}");
    }
    // And back.
    let text = export(arm).expect("it can be written");
    let again = imported(&text).arm;
    assert_by_the_book(&text, &again, 2);
    let mut stream = stream(3, "test/urdf/odd");
    assert!(largest_difference(arm, &arm.chain.nominal(), &again, 100, &mut stream) < 1e-12);
    // Calibrated values, too.
    let values: Vec<f64> = arm.chain.nominal().iter().map(|value| value + stream.uniform(-0.05, 0.05)).collect();
    let again = imported(&export_with(arm, &values).expect("it can be written")).arm;
    assert!(largest_difference(arm, &values, &again, 100, &mut stream) < 1e-12);
    // A tip that moves with the last joint still has a tool to calibrate.
    let bare = import(ODD, "odd.urdf", Some("foot"), Some("e")).expect("a chain").arm;
    assert_eq!(bare.chain.frame_names(), ["foot", "a", "b", "c", "e", "tool"]);
    assert_eq!(bare.chain.parameters.len(), 30);
}

#[test]
fn a_chain_with_any_steps_between_frames_is_exported() {
    use crate::arm::{Axis, Chain, Joint, Step};
    let joint = |name: &str, kind| Joint { name: name.to_owned(), kind, lower: -1.0, upper: 1.0, mimic: None };
    let mut chain = Chain::new();
    chain.frame("base");
    chain.rotate(Axis::X, "r1", 0.3);
    chain.rotate(Axis::Z, "r2", -0.4);
    chain.joint(joint("one", JointKind::Revolute));
    chain.translate(Axis::X, "t1", 0.2);
    chain.joint(joint("two", JointKind::Revolute));
    chain.rotate(Axis::Y, "r3", 0.5);
    chain.translate(Axis::Y, "t2", 0.1);
    chain.frame("off_axis");
    chain.joint(joint("three", JointKind::Prismatic));
    chain.rotate(Axis::Y, "r4", 1.5);
    chain.translate(Axis::Y, "t3", 0.1);
    chain.frame("slid");
    chain.steps.push(Step::Fixed(Pose::translation(0.1, 0.2, 0.3)));
    chain.translate(Axis::Z, "t4", 0.05);
    let arm = Arm {
        name: "any".to_owned(),
        chain,
        links: Vec::new(),
        fixtures: Vec::new(),
        uncollidable: Vec::new(),
        gravity_in_base: Vector3::zeros(),
    };
    let text = export(&arm).expect("it can be written");
    let back = imported(&text).arm;
    let mut stream = stream(4, "test/urdf/any");
    let (at, at_back) = (arm.chain.at_nominal(), back.chain.at_nominal());
    for _ in 0..100 {
        let joints = configuration(&arm, &mut stream);
        assert!(pose_error(&at.forward(&joints), &at_back.forward(&joints)).abs().max() < 1e-14, "{text}");
    }
    assert!(matches!(export_with(&arm, &[0.0]), Err(UrdfError::ValueCount { found: 1, expected: 8 })));
    assert!(export_with(&arm, &[f64::NAN; 8]).expect_err("not finite").to_string().contains("parameter r1 is NaN"));
}

#[test]
fn what_is_wrong_is_named_with_line_element_and_remedy() {
    let cases: &[(&str, &str, &[&str])] = &[
        ("", "", &["robot.urdf: (robot)", "probe, finger", "--tip-link"]),
        (
            "<link name=\"c\"/>",
            "",
            &["robot.urdf:16: joint \"down\"", "child link \"c\", which is not in the file", "add <link name=\"c\"/>"],
        ),
        (
            "<child link=\"d\"/>",
            "<child link=\"c\"/>",
            &["robot.urdf:18: joint \"bridge\"", "the child of joint \"down\" too", "cut the loop"],
        ),
        ("<parent link=\"foot\"/>", "<parent link=\"e\"/>", &["a circle of joints", "is below itself"]),
        ("<link name=\"c\"/>", "<link name=\"b\"/>", &["robot.urdf:15: link \"b\"", "two links of this name"]),
        ("joint name=\"down\"", "joint name=\"slide\"", &["robot.urdf:16: joint \"slide\"", "two joints of this name"]),
        (
            "<link name=\"c\"/>",
            "<link name=\"c\"/><link name=\"lost\"/>",
            &["robot.urdf:15: link \"lost\"", "base, lost", "--base-link"],
        ),
        ("<robot name=\"odd\">", "<robot name=\"odd\"><oops>", &["robot.urdf", "correct the file"]),
    ];
    for (old, new, expected) in cases {
        let text = ODD.replacen(old, new, 1);
        let error = import(&text, "robot.urdf", None, None).expect_err("refused").to_string();
        for fragment in *expected {
            assert!(error.contains(fragment), "{old:?} -> {new:?}: {fragment:?} is not in\n{error}");
        }
    }
    let with_tip: &[(&str, &str, &[&str])] = &[
        (
            "type=\"continuous\"",
            "type=\"floating\"",
            &["robot.urdf:10: joint \"shoulder\"", "a floating joint", "revolute, continuous"],
        ),
        ("type=\"continuous\"", "type=\"planar\"", &["a planar joint"]),
        (
            "lower=\"-1\" upper=\"2\"",
            "lower=\"2\" upper=\"-1\"",
            &["joint \"down\"", "limits from 2 to -1 rad", "the lower one below"],
        ),
        ("lower=\"-0.1\" upper=\"0.3\"", "lower=\"-0.1\" upper=\"inf\"", &["joint \"slide\"", "limits from -0.1 to inf m"]),
        (
            "<axis xyz=\"0 0 -1\"/>",
            "<axis xyz=\"0 0 0\"/>",
            &["robot.urdf:16: joint \"down\"", "axis [0.0, 0.0, 0.0]", "correct the <axis>"],
        ),
        (
            "<origin xyz=\"0 0 0.2\"/><axis",
            "<origin xyz=\"0 0 nan\"/><axis",
            &["joint \"down\"", "finite numbers", "correct the <origin>"],
        ),
        (
            "<axis xyz=\"0 0 -1\"/>",
            "<axis xyz=\"0 0 -1\"/><mimic joint=\"grip\"/>",
            &["joint \"down\"", "mimics \"grip\", which is not in the chain", "remove <mimic>"],
        ),
        ("<mass value=\"2\"/>", "<mass value=\"-2\"/>", &["robot.urdf:6: link \"a\"", "mass -2 kg", "correct the <inertial>"]),
    ];
    for (old, new, expected) in with_tip {
        let text = ODD.replacen(old, new, 1);
        assert!(text != ODD, "{old:?} is not in the text");
        let error = import(&text, "robot.urdf", None, Some("probe")).expect_err("refused").to_string();
        for fragment in *expected {
            assert!(error.contains(fragment), "{old:?} -> {new:?}: {fragment:?} is not in\n{error}");
        }
    }
    let refused = |base: Option<&str>, tip: Option<&str>| import(ODD, "robot.urdf", base, tip).expect_err("refused").to_string();
    assert!(refused(None, Some("toll")).contains("--tip-link toll") && refused(None, Some("toll")).contains("base, foot, a"));
    assert!(refused(Some("bass"), None).contains("give one of these to --base-link"));
    assert!(refused(Some("e"), Some("a")).contains("no way from \"e\" to \"a\""));
    assert!(refused(Some("e"), Some("probe")).contains("no joint that moves between"));
    let only_a_link = import("<robot name=\"r\"><link name=\"l\"/></robot>", "r.urdf", None, None).expect_err("no joints");
    assert!(only_a_link.to_string().contains("no joints"), "{only_a_link}");
    let xacro = import("<robot name=\"r\"><xacro:include filename=\"x\"/></robot>", "r.urdf", None, None).expect_err("xacro");
    assert!(
        xacro.to_string().contains("r.urdf:1: (robot)") && xacro.to_string().contains("xacro robot.urdf.xacro > robot.urdf"),
        "{xacro}"
    );
    for (text, found, remedy) in [
        ("<?xml version=\"1.0\"?>\n<mujoco model=\"m\"/>", "an MJCF model", "mjcf_urdf_simple_converter"),
        ("<sdf version=\"1.7\"><model name=\"m\"/></sdf>", "an SDF model", "the URDF or xacro that it was made of"),
        ("#usda 1.0\n", "a USD stage", "Export to URDF"),
        ("{\"a\": 1}", "JSON", "URDF"),
        ("solid part", "no XML", "URDF"),
    ] {
        let error = import(text, "robot.xml", None, None).expect_err("refused").to_string();
        assert!(error.contains(found) && error.contains(remedy), "{error}");
    }
    let free = ODD.replacen("type=\"continuous\"", "type=\"revolute\"", 1);
    let imported = import(&free, "robot.urdf", None, Some("probe")).unwrap();
    assert!(
        imported.notes.iter().any(|note| note.contains("joint shoulder has no limits: ±180° is taken")),
        "{:?}",
        imported.notes
    );
    for text in ["", "not XML", "<robot", "<sdf><model/></sdf>"] {
        let error = import(text, "r.urdf", None, None).expect_err("not a URDF").to_string();
        println!("{error}");
        assert!(error.starts_with("r.urdf"), "{error}");
    }
    assert!(read(&PathBuf::from("nowhere.urdf"), None, None).expect_err("no file").to_string().starts_with("nowhere.urdf: "));
}

#[test]
fn an_inertia_of_no_body_is_noted_and_its_mass_kept() {
    let text = ODD.replacen("izz=\"0.04\"", "izz=\"4\"", 1);
    let result = import(&text, "robot.urdf", None, Some("probe")).expect("good enough for kinematics");
    let right = import(ODD, "robot.urdf", None, Some("probe")).expect("right").arm.links[1].inertial.clone().expect("a mass");
    let kept = result.arm.links[1].inertial.as_ref().expect("a mass");
    assert_eq!((kept.mass_kg, kept.centre_of_mass_in_link), (right.mass_kg, right.centre_of_mass_in_link));
    assert!(kept.impossible().is_none());
    assert!(result.notes.iter().any(|note| note.starts_with("link a: principal moments")), "{:?}", result.notes);
}

#[test]
fn urdfs_of_real_robots_are_imported() {
    let Some(folder) = std::env::var_os("KINCAL_DATA_DIR").map(PathBuf::from) else {
        println!("skipped: KINCAL_DATA_DIR is not set");
        return;
    };
    let cases = [
        ("ur5_tracker/ur5.urdf", 6, "tool", true),
        ("ur10_tracker/ur10.urdf", 6, "flange", true),
        ("fr3_camera/fr3.urdf", 7, "flange", false),
    ];
    for (index, (path, joints, tip, masses)) in cases.into_iter().enumerate() {
        let path = folder.join(path);
        let result = read(&path, None, None).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(result.arm.joint_count(), joints);
        assert_eq!(result.arm.chain.parameters.len(), 6 * (joints + 1));
        assert_eq!(result.arm.chain.frame_names().last(), Some(&tip));
        assert!(result.arm.links[1..].iter().all(|link| link.inertial.is_some() == masses));
        let text = std::fs::read_to_string(&path).expect("it was read before");
        let largest = assert_by_the_book(&text, &result.arm, index as u64);
        println!("{}: {largest:.1e} from the file's own kinematics; {:?}", result.arm.name, result.notes);
    }
}

#[test]
fn what_the_parser_refuses_is_given_its_line() {
    let cases = [
        ("<robot name=\"odd\">", "<robot name=\"odd\"><oops>", "r.urdf:27: ", "`</robot>` where `<oops>` of line 2 is open"),
        ("<link name=\"b\"/>", "<link name=\"b\" <", "r.urdf:13: ", "`<` without `>`"),
        ("upper=\"0.3\" effort=\"1\" velocity=\"1\"", "upper=\"0.3\"", "r.urdf:14: joint \"slide\"", "missing field `velocity`"),
        ("<axis xyz=\"1 0 1\"/>", "<axis xyz=\"1 0\"/>", "r.urdf:14: joint \"slide\"", "expected 3 found 2 for [1 0]"),
        (
            "<joint name=\"bridge\" type=\"fixed\">",
            "<joint name=\"bridge\" type=\"glued\">",
            "r.urdf:18: joint \"bridge\"",
            "unknown variant `glued`",
        ),
        ("<link name=\"c\"/>", "<link/>", "r.urdf:15: link \"\"", "missing field `name`"),
        ("<mass value=\"2\"/>", "<mass value=\"x\"/>", "r.urdf:6: link \"a\"", "invalid float literal"),
        ("  </link>", "  </lonk>", "r.urdf:9: ", "`</lonk>` where `<link>` of line 6 is open"),
    ];
    for (old, new, place, found) in cases {
        let error = import(&ODD.replacen(old, new, 1), "r.urdf", None, Some("probe")).expect_err("refused").to_string();
        assert!(error.starts_with(place) && error.contains(found), "{old:?} -> {new:?}: {place}, {found}\n{error}");
    }
}
