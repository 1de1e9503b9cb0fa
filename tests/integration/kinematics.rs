//! Forward kinematics against an independent description: the exported URDF, read by `urdf-rs` and multiplied with nalgebra.

use kincal::seed::stream;
use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};

use crate::harness::kincal;

const CONFIGURATIONS: usize = 1000;

/// From the root of the file to `tip`, as the URDF specification says.
fn forward(robot: &urdf_rs::Robot, tip: &str, coordinate: &dyn Fn(&str) -> f64) -> Isometry3<f64> {
    let Some(joint) = robot.joints.iter().find(|joint| joint.child.link == tip) else { return Isometry3::identity() };
    let [roll, pitch, yaw] = *joint.origin.rpy;
    let origin = Isometry3::from_parts(
        Translation3::from(Vector3::from(*joint.origin.xyz)),
        UnitQuaternion::from_euler_angles(roll, pitch, yaw),
    );
    let axis = Unit::new_normalize(Vector3::from(*joint.axis.xyz));
    let motion = match joint.joint_type {
        urdf_rs::JointType::Fixed => Isometry3::identity(),
        urdf_rs::JointType::Revolute => {
            Isometry3::from_parts(Translation3::identity(), UnitQuaternion::from_axis_angle(&axis, coordinate(&joint.name)))
        }
        ref other => panic!("{other:?}"),
    };
    forward(robot, &joint.parent.link, coordinate) * origin * motion
}

#[test]
fn the_exported_arm_stands_where_kincal_says() {
    for scene in ["arm8", "paper"] {
        let out = tempfile::tempdir().unwrap();
        let path = format!("{}/scenes/{scene}.toml", env!("CARGO_MANIFEST_DIR"));
        kincal(out.path(), &["export", &path, "--to", "urdf"]).ends(0);
        let robot = urdf_rs::read_file(out.path().join(format!("{scene}.urdf"))).unwrap();
        let arm = kincal::scene::read(path.as_ref()).unwrap().scene.arm;
        let chain = arm.chain.at_nominal();
        let mut stream = stream(1, "test/integration/kinematics");
        let (mut worst_m, mut worst_rad) = (0.0f64, 0.0f64);
        for _ in 0..CONFIGURATIONS {
            let joints: Vec<f64> = arm.chain.joints.iter().map(|joint| stream.uniform(joint.lower, joint.upper)).collect();
            let coordinate = |name: &str| joints[arm.chain.joints.iter().position(|joint| joint.name == name).unwrap()];
            let (ours, theirs) = (chain.forward(&joints), forward(&robot, "tool", &coordinate));
            worst_m = worst_m.max((ours.translation.vector - theirs.translation.vector).norm());
            // The chord of the rotation matrices: an arc cosine would round away what is looked for.
            let chord = ours.rotation.to_rotation_matrix().into_inner() - theirs.rotation.to_rotation_matrix().into_inner();
            worst_rad = worst_rad.max(chord.norm() / 2.0f64.sqrt());
        }
        println!("{scene}: {CONFIGURATIONS} configurations, at most {worst_m:.1e} m and {worst_rad:.1e} rad apart");
        assert!(worst_m < 1e-12 && worst_rad < 1e-12, "{scene}: {worst_m:e} m, {worst_rad:e} rad");
    }
}
