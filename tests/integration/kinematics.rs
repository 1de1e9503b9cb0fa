//! Forward kinematics against an independent description: the exported URDF, read by `urdf-rs` and multiplied with nalgebra.

use kincal::seed::stream;
use nalgebra::{Isometry3, Matrix4, Translation3, Unit, UnitQuaternion, Vector3};

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
    for scene in ["arm8", "paper", "parallel8", "panda"] {
        let out = tempfile::tempdir().unwrap();
        let path = format!("{}/scenes/{scene}.toml", env!("CARGO_MANIFEST_DIR"));
        kincal(out.path(), &["export", &path, "--to", "urdf"]).ends(0);
        let robot = urdf_rs::read_file(out.path().join(format!("{scene}.urdf"))).unwrap();
        let arm = kincal::scene::read(&path).unwrap().scene.arm;
        let tip = *arm.chain.frame_names().last().unwrap();
        let chain = arm.chain.at_nominal();
        let mut stream = stream(1, "test/integration/kinematics");
        let (mut worst_m, mut worst_rad) = (0.0f64, 0.0f64);
        for _ in 0..CONFIGURATIONS {
            let joints: Vec<f64> = arm.chain.joints.iter().map(|joint| stream.uniform(joint.lower, joint.upper)).collect();
            let coordinate = |name: &str| joints[arm.chain.joints.iter().position(|joint| joint.name == name).unwrap()];
            let (ours, theirs) = (chain.forward(&joints), forward(&robot, tip, &coordinate));
            worst_m = worst_m.max((ours.translation.vector - theirs.translation.vector).norm());
            // The chord of the rotation matrices: an arc cosine would round away what is looked for.
            let chord = ours.rotation.to_rotation_matrix().into_inner() - theirs.rotation.to_rotation_matrix().into_inner();
            worst_rad = worst_rad.max(chord.norm() / 2.0f64.sqrt());
        }
        println!("{scene}: {CONFIGURATIONS} configurations, at most {worst_m:.1e} m and {worst_rad:.1e} rad apart");
        assert!(worst_m < 1e-12 && worst_rad < 1e-12, "{scene}: {worst_m:e} m, {worst_rad:e} rad");
    }
}

/// The Panda's table as the Franka Control Interface documents it: a (m), d (m), α (°) of Craig's convention, joint 1 first.
const PANDA: [[f64; 3]; 7] = [
    [0.0, 0.333, 0.0],
    [0.0, 0.0, -90.0],
    [0.0, 0.316, 90.0],
    [0.0825, 0.0, 90.0],
    [-0.0825, 0.384, -90.0],
    [0.0, 0.0, 90.0],
    [0.088, 0.0, 90.0],
];

/// `link i−1 from link i` after Craig, written out.
fn craig([a, d, alpha]: [f64; 3], theta: f64) -> Matrix4<f64> {
    let ((s, c), (sa, ca)) = (theta.sin_cos(), alpha.to_radians().sin_cos());
    Matrix4::new(
        c,
        -s,
        0.0,
        a, //
        s * ca,
        c * ca,
        -sa,
        -d * sa, //
        s * sa,
        c * sa,
        ca,
        d * ca, //
        0.0,
        0.0,
        0.0,
        1.0,
    )
}

#[test]
fn the_panda_is_the_published_one() {
    let path = format!("{}/scenes/panda.toml", env!("CARGO_MANIFEST_DIR"));
    let arm = kincal::scene::read(&path).unwrap().scene.arm;
    let chain = arm.chain.at_nominal();
    let flange_from_nest = Matrix4::new_translation(&Vector3::new(0.05, 0.0, 0.107 + 0.02));
    // Stretched, ready as Franka's examples have it, and anywhere.
    let ready = [0.0, -45.0, 0.0, -135.0, 0.0, 90.0, 45.0].map(f64::to_radians);
    let mut stream = stream(2, "test/integration/panda");
    let anywhere =
        (0..200).map(|_| -> Vec<f64> { arm.chain.joints.iter().map(|joint| stream.uniform(joint.lower, joint.upper)).collect() });
    for joints in [vec![0.0; 7], ready.to_vec()].into_iter().chain(anywhere) {
        let expected = PANDA.iter().zip(&joints).fold(Matrix4::<f64>::identity(), |so_far, (row, q)| so_far * craig(*row, *q))
            * flange_from_nest;
        let difference: f64 = (chain.forward(&joints).to_homogeneous() - expected).abs().max();
        assert!(difference < 1e-13, "{joints:?}: {difference:e}");
    }
    // Stretched: the flange hangs 107 mm below the wrist, which is 1033 mm up and 88 mm out.
    let stretched = chain.end_point(&[0.0; 7]);
    assert!((stretched - Vector3::new(0.088 + 0.05, 0.0, 1.033 - 0.127)).norm() < 1e-12, "{stretched}");
    let limits = [2.8973, 1.7628, 2.8973, 0.0, 2.8973, 0.0, 2.8973];
    for (joint, limit) in arm.chain.joints.iter().zip(limits).filter(|(_, limit)| *limit != 0.0) {
        assert_eq!((joint.lower, joint.upper), (-limit, limit), "{}", joint.name);
    }
    let [_, _, _, fourth, _, sixth, _] = arm.chain.joints.as_slice() else { panic!("seven joints") };
    assert_eq!([fourth.lower, fourth.upper, sixth.lower, sixth.upper], [-3.0718, -0.0698, -0.0175, 3.7525]);
}
