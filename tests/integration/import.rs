//! Bags of ROS 2 as tables. `tests/reference/ros2_bag.mcap` was written by `tests/python/ros_bag.py` with the package rosbags: the tutorial's arm
//! stands for a second and moves for one, twelve times, and its poses are stamped 50 ms late.

use std::fs;

use crate::harness::{kincal, number};

const BAG: &str = "tests/reference/ros2_bag.mcap";

#[test]
fn a_bag_is_a_table_and_its_late_poses_are_found() {
    let out = tempfile::tempdir().unwrap();
    let json = kincal(out.path(), &["import", BAG, "--robot", "scenes/tutorial.urdf", "--json"]).ends(0).json();
    let late = number(&json, "/latency_found/seconds");
    assert!((late - 0.05).abs() < 1e-3 && json["latency_found"]["taken"] == true, "{late}");
    assert_eq!((&json["rows"], &json["still"]), (&12.into(), &true.into()));
    let table = out.path().join("ros2_bag.csv");
    let json =
        kincal(out.path(), &["identify", table.to_str().unwrap(), "--robot", "scenes/tutorial.urdf", "--only", "base", "--json"])
            .ends(0)
            .json();
    // Each frame is off by 0.3 mm and 0.3 mrad: the nominal arm is near.
    assert!(number(&json, "/fitted/position_m/rms") < 3e-3);
    // While it moves, every pose counts; late ones are those of no arm.
    let moving = |more: &[&str]| {
        let all = [&["import", BAG, "--robot", "scenes/tutorial.urdf", "--moving"], more].concat();
        kincal(out.path(), &all).ends(0);
        let table = table.to_str().unwrap();
        kincal(out.path(), &["identify", table, "--robot", "scenes/tutorial.urdf", "--only", "base", "--json"])
    };
    assert!(number(&moving(&[]).ends(0).json(), "/fitted/position_m/rms") < 3e-3);
    assert!(moving(&["--latency", "0"]).ends(2).stderr.contains("no arm of this kind makes these readings"));
}

#[test]
fn bags_that_cannot_be_used_say_why() {
    let out = tempfile::tempdir().unwrap();
    let refused = |bag: &str, more: &[&str], said: &[&str]| {
        let ran = kincal(out.path(), &[&["import", bag], more].concat()).ends(2);
        said.iter().for_each(|said| assert!(ran.stderr.contains(said), "{said}: {}", ran.stderr));
    };
    let robot = ["--robot", "scenes/tutorial.urdf"];
    let with = |more: [&'static str; 2]| [robot, more].concat();
    refused(BAG, &with(["--poses", "/other"]), &["no poses on `/other`", "/tracker/pose"]);
    refused(BAG, &with(["--joints", "/other"]), &["no topic `/other` of sensor_msgs/JointState", "/joint_states", "gripper"]);
    refused(BAG, &with(["--latency", "1e9"]), &["--latency 1000000000: seconds are needed"]);
    refused("nothing.mcap", &robot, &["cannot read nothing.mcap"]);
    refused("scenes", &robot, &["no .mcap file is in this folder"]);
    refused("scenes/tutorial.urdf", &robot, &["is no bag of ROS 2"]);
    let database = out.path().join("bag.db3");
    fs::write(&database, b"SQLite format 3\0and more").unwrap();
    refused(database.to_str().unwrap(), &robot, &["stored in SQLite", "rosbags-convert"]);
    // A bag that was cut off is read up to there; a recording of kincal has no joint states.
    let cut = out.path().join("cut.mcap");
    let bytes = fs::read(BAG).unwrap();
    fs::write(&cut, &bytes[..bytes.len() / 2]).unwrap();
    let ran = kincal(out.path(), &["import", cut.to_str().unwrap(), robot[0], robot[1], "--json"]).ends(0);
    assert!(ran.stderr.contains("reading ended after message") && number(&ran.json(), "/rows") >= 1.0, "{}", ran.stderr);
}
