//! The paper's five-parameter modified Denavit–Hartenberg convention (Veitschegger and Wu 1986; Chen et al. 2019, eq. 39):
//!
//! `T_i = Rot(x, α_i) Trans(x, a_i) Rot(z, θ_i) Trans(z, d_i) Rot(y, β_i)`, with the joint's motion in θ_i (in d_i if it slides).
//!
//! β takes up the angle between consecutive axes that are nominally parallel, where α, a, θ, d alone would jump.

use super::chain::{Axis, Chain, Joint};

/// Nominal parameters of one frame (m, rad).
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Frame {
    /// Rotation about x, first.
    pub alpha: f64,
    /// Translation along x.
    pub a: f64,
    /// Rotation about z; the zero of a revolute joint.
    pub theta: f64,
    /// Translation along z; the zero of a prismatic joint.
    pub d: f64,
    /// Rotation about y, last.
    pub beta: f64,
}

/// Pose of a frame with six parameters: translation (m) and roll, pitch, yaw (rad).
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct SixParameters {
    /// Translation, m.
    pub xyz: [f64; 3],
    /// Rotation `Rot(z, yaw) Rot(y, pitch) Rot(x, roll)` as `[roll, pitch, yaw]`, rad.
    pub rpy: [f64; 3],
}

/// Builds the chain of an arm whose joints are `joints` and whose frames are one per joint and one for the tool.
///
/// Parameters are `alpha1, a1, theta1, d1, beta1, alpha2, …`: five per frame in this order, the tool's last; before them the six
/// of `base` (`base_x` … `base_roll`) and after them the six of `tool` (`tool_x` …) where these are given.
///
/// Link frame `i` is on the axis of joint `i`, after its motion and before θ_i's zero, d_i and β_i: that is the link frame of the
/// exported URDF, whose joint origins are then exact (`rpy = (α_{i+1}, β_i, θ_i)`, no angle is ever extracted from a matrix).
/// Frames are named `base_link`, `link1` … `linkN`, `tool` (and `world` before them all with a six-parameter base).
///
/// # Panics
/// If there is not one frame more than there are joints.
#[must_use]
pub fn chain(frames: &[Frame], joints: Vec<Joint>, base: Option<SixParameters>, tool: Option<SixParameters>) -> Chain {
    assert_eq!(frames.len(), joints.len() + 1, "one frame per joint and one for the tool");
    let mut chain = Chain::new();
    if let Some(base) = base {
        chain.frame("world");
        chain.six_parameters("base", base.xyz, base.rpy);
    }
    chain.frame("base_link");
    let mut joints = joints.into_iter();
    for (index, frame) in frames.iter().enumerate() {
        let number = index + 1;
        chain.rotate(Axis::X, format!("alpha{number}"), frame.alpha);
        chain.translate(Axis::X, format!("a{number}"), frame.a);
        if let Some(joint) = joints.next() {
            chain.joint(joint);
            chain.frame(format!("link{number}"));
        }
        chain.rotate(Axis::Z, format!("theta{number}"), frame.theta);
        chain.translate(Axis::Z, format!("d{number}"), frame.d);
        chain.rotate(Axis::Y, format!("beta{number}"), frame.beta);
    }
    if let Some(tool) = tool {
        chain.six_parameters("tool", tool.xyz, tool.rpy);
    }
    chain.frame("tool");
    chain
}

#[cfg(test)]
mod tests {
    use super::super::chain::JointKind;
    use super::*;
    use crate::arm::frames::{pose_error, pose_from_parts};
    use crate::seed::{Stream, stream};
    use nalgebra::{DMatrix, Matrix3, Matrix4, Vector3};

    fn random_arm(stream: &mut Stream, base_and_tool: bool) -> Chain {
        let frames: Vec<Frame> = (0..9)
            .map(|_| Frame {
                alpha: stream.uniform(-2.0, 2.0),
                a: stream.uniform(-0.3, 0.3),
                theta: stream.uniform(-3.0, 3.0),
                d: stream.uniform(-0.3, 0.3),
                beta: stream.uniform(-0.5, 0.5),
            })
            .collect();
        let joints = (0..8)
            .map(|joint| Joint {
                name: format!("joint{}", joint + 1),
                kind: if joint == 4 { JointKind::Prismatic } else { JointKind::Revolute },
                lower: -3.0,
                upper: 3.0,
                mimic: None,
            })
            .collect();
        let six = SixParameters { xyz: [0.1, -0.2, 0.3], rpy: [0.4, -0.5, 2.6] };
        chain(&frames, joints, base_and_tool.then_some(six), base_and_tool.then_some(six))
    }

    fn configuration(stream: &mut Stream) -> Vec<f64> {
        (0..8).map(|_| stream.uniform(-3.0, 3.0)).collect()
    }

    /// Eq. 39 as homogeneous matrices, by the book.
    fn matrix(frame: &[f64], joint: f64, prismatic: bool) -> Matrix4<f64> {
        let (theta, d) = if prismatic { (frame[2], frame[3] + joint) } else { (frame[2] + joint, frame[3]) };
        let rotation = |axis: Vector3<f64>, angle: f64| Matrix4::new_rotation(axis * angle);
        let shift = |by: Vector3<f64>| Matrix4::new_translation(&by);
        rotation(Vector3::x(), frame[0])
            * shift(Vector3::x() * frame[1])
            * rotation(Vector3::z(), theta)
            * shift(Vector3::z() * d)
            * rotation(Vector3::y(), frame[4])
    }

    #[test]
    fn forward_kinematics_is_the_product_of_equation_39() {
        let mut stream = stream(1, "test/mdh/forward");
        for _ in 0..50 {
            let chain = random_arm(&mut stream, false);
            let joints = configuration(&mut stream);
            let values = chain.nominal();
            let product = values.chunks(5).enumerate().fold(Matrix4::identity(), |product, (index, frame)| {
                product * matrix(frame, joints.get(index).copied().unwrap_or(0.0), index == 4)
            });
            let ours = chain.at_nominal().forward(&joints);
            assert!((ours.to_homogeneous() - product).norm() < 1e-13);
        }
    }

    /// Eqs. 44 and 51 as printed: an independent derivation, in the tool's axes.
    fn jacobian_of_the_paper(values: &[f64], joints: &[f64]) -> DMatrix<f64> {
        let transforms: Vec<Matrix4<f64>> = values
            .chunks(5)
            .enumerate()
            .map(|(index, frame)| matrix(frame, joints.get(index).copied().unwrap_or(0.0), index == 4))
            .collect();
        let mut jacobian = DMatrix::zeros(6, values.len());
        let mut after = Matrix4::identity();
        for index in (0..transforms.len()).rev() {
            let frame = &values[5 * index..5 * index + 5];
            let joint = joints.get(index).copied().unwrap_or(0.0);
            let (theta, d) = if index == 4 { (frame[2], frame[3] + joint) } else { (frame[2] + joint, frame[3]) };
            let (st, ct, sb, cb) = (theta.sin(), theta.cos(), frame[4].sin(), frame[4].cos());
            let k1 = Vector3::new(-d * st * cb, -d * ct, -d * st * sb);
            let (k2, k4) = (Vector3::new(ct * cb, -st, ct * sb), Vector3::new(-sb, 0.0, cb));
            let (k6, k8, k10) = (k2, k4, Vector3::y());
            let zero = Vector3::zeros();
            // Columns (d_i, δ_i) of eq. 44 for α, a, θ, d, β.
            let columns = [(k1, k6), (k2, zero), (zero, k8), (k4, zero), (zero, k10)];
            let p = Vector3::new(after[(0, 3)], after[(1, 3)], after[(2, 3)]);
            for (offset, (linear, angular)) in columns.iter().enumerate() {
                for axis in 0..3 {
                    let n = Vector3::new(after[(0, axis)], after[(1, axis)], after[(2, axis)]);
                    jacobian[(axis, 5 * index + offset)] = n.dot(linear) + p.cross(&n).dot(angular);
                    jacobian[(3 + axis, 5 * index + offset)] = n.dot(angular);
                }
            }
            after = transforms[index] * after;
        }
        jacobian
    }

    #[test]
    fn the_jacobian_is_equation_52_turned_into_base_axes() {
        let mut stream = stream(2, "test/mdh/jacobian");
        for _ in 0..50 {
            let chain = random_arm(&mut stream, false);
            let joints = configuration(&mut stream);
            let (pose, ours) = chain.at_nominal().jacobian(&joints);
            let paper = jacobian_of_the_paper(&chain.nominal(), &joints);
            let mut turn = DMatrix::zeros(6, 6);
            let rotation = pose.rotation.to_rotation_matrix().into_inner();
            turn.view_mut((0, 0), (3, 3)).copy_from(&rotation);
            turn.view_mut((3, 3), (3, 3)).copy_from(&rotation);
            let difference = (&ours - turn * &paper).norm() / paper.norm();
            assert!(difference < 1e-14, "relative difference {difference:e}");
        }
    }

    #[test]
    fn the_jacobian_is_the_derivative_of_the_pose() {
        let mut stream = stream(3, "test/mdh/differences");
        for _ in 0..20 {
            let chain = random_arm(&mut stream, true);
            let joints = configuration(&mut stream);
            let values = chain.nominal();
            let (_, jacobian) = chain.at(&values).jacobian(&joints);
            assert_eq!(jacobian.ncols(), 57);
            for column in 0..values.len() {
                let shifted = |by: f64| {
                    let mut values = values.clone();
                    values[column] += by;
                    chain.at(&values).forward(&joints)
                };
                // Five-point central difference: truncation h⁴ and rounding ε/h are both near 1e-11 here.
                let h = 1e-3;
                let slope = (pose_error(&shifted(h), &shifted(-h)) * 8.0 - pose_error(&shifted(2.0 * h), &shifted(-2.0 * h)))
                    / (12.0 * h);
                let difference = (slope - jacobian.column(column)).norm() / jacobian.column(column).norm();
                assert!(difference < 1e-9, "{}: {difference:e}", chain.parameters[column].name);
            }
        }
    }

    #[test]
    fn segments_and_joint_motions_multiply_to_the_tool() {
        let mut stream = stream(4, "test/mdh/segments");
        let chain = random_arm(&mut stream, true);
        let joints = configuration(&mut stream);
        let at = chain.at_nominal();
        let segments = at.segments();
        assert_eq!(segments.len(), 9);
        let mut pose = segments[0];
        for (index, segment) in segments[1..].iter().enumerate() {
            let motion = if index == 4 {
                pose_from_parts(&Matrix3::identity(), &Vector3::new(0.0, 0.0, joints[index]))
            } else {
                pose_from_parts(&Matrix3::new_rotation_z(joints[index]), &Vector3::zeros())
            };
            pose = pose * motion * segment;
        }
        assert!(pose_error(&pose, &at.forward(&joints)).norm() < 1e-14);
        assert_eq!(at.frames(&joints).len(), chain.frame_names().len());
    }

    trait NewRotationZ {
        fn new_rotation_z(angle: f64) -> Self;
    }
    impl NewRotationZ for Matrix3<f64> {
        fn new_rotation_z(angle: f64) -> Self {
            nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), angle).into_inner()
        }
    }
}
