//! A calibrated arm in the words of other programs: the kinematics of Universal Robots' driver, and static transforms of ROS 2.

use std::fmt::Write;

use sha2::{Digest, Sha256};

use crate::arm::{Arm, Step};

/// The bodies of a Universal Robots' arm, from the base outwards, as `ur_description` has them.
const BODIES: [&str; 6] = ["shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3"];

/// `arm` (in the measurement frame or not) at the parameters `values` as the `kinematics:` file that Universal Robots' ROS driver reads: the
/// origin of each joint (m, rad). Its hash is of these numbers: the driver compares it with the controller's.
///
/// # Errors
/// If it has not six turning joints about z, as `ur_description` gives them.
pub fn ur_kinematics(arm: &Arm, values: &[f64]) -> Result<String, String> {
    let joints = &arm.chain.joints;
    if joints.len() != BODIES.len() {
        return Err(format!("the arm has {} joints, and Universal Robots' file is of six", joints.len()));
    }
    let turned = arm.chain.steps.windows(2).find_map(|steps| match steps {
        [Step::Fixed(_), Step::Joint { joint }] => Some(&joints[*joint].name),
        _ => None,
    });
    if let Some(name) = turned {
        return Err(format!(
            "joint `{name}` does not turn about z: the file is of robots whose joints do, as ur_description 2 and later have them"
        ));
    }
    let mut text = String::new();
    for (joint, body) in joints.iter().zip(BODIES) {
        let _ = writeln!(text, "  {body}:");
        for end in ["x", "y", "z", "roll", "pitch", "yaw"] {
            let name = format!("{}_{end}", joint.name);
            let column = arm.chain.parameters.iter().position(|parameter| parameter.name == name);
            let value =
                column.map(|column| values[column]).ok_or_else(|| format!("joint `{}` has no origin of its own", joint.name))?;
            let _ = writeln!(text, "    {end}: {value}");
        }
    }
    let digest = Sha256::digest(text.as_bytes());
    let number = digest.iter().take(8).fold(0_u64, |number, byte| number << 8 | u64::from(*byte));
    Ok(format!("# Written by kincal: joint origins, m and rad.\nkinematics:\n{text}  hash: calib_{number}\n"))
}

/// Where the root of `arm` (in the measurement frame) stands in it, and where the target sits on the tool, as commands that publish them.
#[must_use]
pub fn ros_transforms(arm: &Arm, values: &[f64]) -> String {
    let names = arm.chain.frame_names();
    let [measurement, root, .., tip, target] = names.as_slice() else {
        return String::new();
    };
    let mut text = String::from("#!/bin/sh\n# Written by kincal: m, rad; base and target of a calibrated arm.\n");
    for (parent, child, first) in [(measurement, root, 0), (tip, target, values.len() - 6)] {
        let [x, y, z, yaw, pitch, roll] = std::array::from_fn(|at| values[first + at]);
        let _ = writeln!(
            text,
            "ros2 run tf2_ros static_transform_publisher --x {x} --y {y} --z {z} --roll {roll} --pitch {pitch} --yaw {yaw} \\\n  \
             --frame-id {parent} --child-frame-id {child} &"
        );
    }
    text.push_str("wait\n");
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::urdf::import;

    /// The UR5e of ur_description (github.com/UniversalRobots/Universal_Robots_ROS2_Description, BSD), origins only.
    fn ur5e() -> String {
        let origins = [
            ("shoulder_pan", "0 0 0.1625", "0 0 0"),
            ("shoulder_lift", "0 0 0", "1.570796327 0 0"),
            ("elbow", "-0.425 0 0", "0 0 0"),
            ("wrist_1", "-0.3922 0 0.1333", "0 0 0"),
            ("wrist_2", "0 -0.0997 -2.044881182297852e-11", "1.570796327 0 0"),
            ("wrist_3", "0 0.0996 -2.042830148012698e-11", "1.570796326589793 3.141592653589793 3.141592653589793"),
        ];
        let mut text = String::from("<robot name=\"ur5e\"><link name=\"l0\"/>");
        for (number, (name, xyz, rpy)) in origins.iter().enumerate() {
            let _ = write!(
                text,
                "<link name=\"l{0}\"/><joint name=\"{name}_joint\" type=\"revolute\"><parent link=\"l{number}\"/><child link=\"l{0}\"/>\
                 <origin xyz=\"{xyz}\" rpy=\"{rpy}\"/><axis xyz=\"0 0 1\"/><limit lower=\"-3\" upper=\"3\" effort=\"1\" velocity=\"1\"/></joint>",
                number + 1
            );
        }
        text + "</robot>"
    }

    #[test]
    fn the_kinematics_are_those_of_the_driver() {
        let arm = import(&ur5e(), "ur5e", None, None).unwrap().arm;
        let text = ur_kinematics(&arm, &arm.chain.nominal()).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(
            lines[1..9],
            ["kinematics:", "  shoulder:", "    x: 0", "    y: 0", "    z: 0.1625", "    roll: 0", "    pitch: 0", "    yaw: 0"]
        );
        assert!(
            text.contains("  forearm:\n    x: -0.425\n")
                && text.contains("  wrist_1:\n    x: -0.3922\n    y: 0\n    z: 0.1333\n")
        );
        let hash = lines.last().unwrap().trim().strip_prefix("hash: calib_").unwrap();
        assert!(hash.parse::<u64>().is_ok());
        let turned = ur5e().replacen("<axis xyz=\"0 0 1\"/>", "<axis xyz=\"0 1 0\"/>", 1);
        let arm = import(&turned, "ur5e", None, None).unwrap().arm;
        assert!(ur_kinematics(&arm, &arm.chain.nominal()).unwrap_err().contains("`shoulder_pan_joint` does not turn about z"));
    }
}
