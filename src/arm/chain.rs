//! A serial chain of elementary motions.

use nalgebra::{Matrix3, Vector3, Vector6};

use super::parameters::{Parameter, Quantity};
use crate::arm::frames::{Pose, pose_from_parts};

/// An axis of the moving frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// First column of the frame's rotation.
    X,
    /// Second column.
    Y,
    /// Third column.
    Z,
}

impl Axis {
    fn index(self) -> usize {
        self as usize
    }
}

/// How a joint moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// Turns about the z axis of its frame; coordinate in rad.
    Revolute,
    /// Slides along the z axis of its frame; coordinate in m.
    Prismatic,
}

/// A joint: name, kind and limits (rad or m).
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// As in the scene or the URDF.
    pub name: String,
    /// Revolute or prismatic.
    pub kind: JointKind,
    /// Smallest coordinate that may be commanded.
    pub lower: f64,
    /// Largest coordinate that may be commanded.
    pub upper: f64,
    /// Another joint that drives it; absent where it moves on its own.
    pub mimic: Option<Mimic>,
}

/// How a joint is driven by another one: its coordinate is `multiplier` times that one's plus `offset`.
#[derive(Clone, Debug, PartialEq)]
pub struct Mimic {
    /// The other joint's number, from 0.
    pub joint: usize,
    /// Of its coordinate.
    pub multiplier: f64,
    /// Added to that, rad or m.
    pub offset: f64,
}

/// One elementary motion of the chain, in the frame that the steps before it have reached.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// Turn about `axis` by parameter number `parameter` (rad).
    Rotate {
        /// Of the moving frame.
        axis: Axis,
        /// Index into the chain's parameters.
        parameter: usize,
    },
    /// Shift along `axis` by parameter number `parameter` (m).
    Translate {
        /// Of the moving frame.
        axis: Axis,
        /// Index into the chain's parameters.
        parameter: usize,
    },
    /// The motion of joint number `joint`, about or along the moving frame's z axis.
    Joint {
        /// Index into the chain's joints.
        joint: usize,
    },
    /// A transform without parameters, known exactly.
    Fixed(Pose),
    /// Names the frame that has been reached: link frames, in order from the base to the tool.
    Frame {
        /// The frame's name; as the link in an exported URDF.
        name: String,
    },
}

/// A serial chain with its nominal parameters. The end frame (tool) is what the last step reaches.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain {
    /// Elementary motions from the base outwards.
    pub steps: Vec<Step>,
    /// Parameters in column order.
    pub parameters: Vec<Parameter>,
    /// Joints from the base outwards.
    pub joints: Vec<Joint>,
}

impl Chain {
    /// An empty chain, to which the steps are pushed.
    #[must_use]
    pub fn new() -> Self {
        Chain { steps: Vec::new(), parameters: Vec::new(), joints: Vec::new() }
    }

    /// Adds a parameter and its rotation about `axis`.
    pub fn rotate(&mut self, axis: Axis, name: impl Into<String>, nominal_rad: f64) {
        let parameter = self.parameters.len();
        self.parameters.push(Parameter { name: name.into(), quantity: Quantity::Angle, nominal: nominal_rad });
        self.steps.push(Step::Rotate { axis, parameter });
    }

    /// Adds a parameter and its translation along `axis`.
    pub fn translate(&mut self, axis: Axis, name: impl Into<String>, nominal_m: f64) {
        let parameter = self.parameters.len();
        self.parameters.push(Parameter { name: name.into(), quantity: Quantity::Length, nominal: nominal_m });
        self.steps.push(Step::Translate { axis, parameter });
    }

    /// Adds a joint that moves about or along the z axis of the frame reached so far.
    pub fn joint(&mut self, joint: Joint) {
        self.steps.push(Step::Joint { joint: self.joints.len() });
        self.joints.push(joint);
    }

    /// Names the frame reached so far.
    pub fn frame(&mut self, name: impl Into<String>) {
        self.steps.push(Step::Frame { name: name.into() });
    }

    /// Adds the six parameters of a frame: `{prefix}_x`, `_y`, `_z` (m), then `_yaw`, `_pitch`, `_roll` (rad), as
    /// `Trans(x, y, z) Rot(z) Rot(y) Rot(x)`: the order of a URDF origin.
    pub fn six_parameters(&mut self, prefix: &str, xyz: [f64; 3], rpy: [f64; 3]) {
        self.translate(Axis::X, format!("{prefix}_x"), xyz[0]);
        self.translate(Axis::Y, format!("{prefix}_y"), xyz[1]);
        self.translate(Axis::Z, format!("{prefix}_z"), xyz[2]);
        self.rotate(Axis::Z, format!("{prefix}_yaw"), rpy[2]);
        self.rotate(Axis::Y, format!("{prefix}_pitch"), rpy[1]);
        self.rotate(Axis::X, format!("{prefix}_roll"), rpy[0]);
    }

    /// The chain seen from a measurement frame: six parameters `base_x` … `base_roll` before everything else, and six parameters
    /// `target_x` … of the target on the tool after everything else, all zero; `measurement_x` … and `target_on_tool_x` … where the
    /// chain has parameters of these names already.
    #[must_use]
    pub fn in_measurement_frame(&self) -> Chain {
        let free = |preferred: &'static str, other: &'static str| {
            let taken = |name: &str| name == preferred || name.strip_prefix(preferred).is_some_and(|rest| rest.starts_with('_'));
            let names = self.parameters.iter().map(|parameter| parameter.name.as_str()).chain(self.frame_names());
            if names.into_iter().any(taken) { other } else { preferred }
        };
        let mut chain = Chain::new();
        chain.frame(free("measurement", "measurement_frame"));
        chain.six_parameters(free("base_x", "measurement_x").trim_end_matches("_x"), [0.0; 3], [0.0; 3]);
        let shift = chain.parameters.len();
        chain.steps.extend(self.steps.iter().cloned().map(|step| match step {
            Step::Rotate { axis, parameter } => Step::Rotate { axis, parameter: parameter + shift },
            Step::Translate { axis, parameter } => Step::Translate { axis, parameter: parameter + shift },
            other => other,
        }));
        chain.parameters.extend(self.parameters.iter().cloned());
        chain.joints.clone_from(&self.joints);
        let target = free("target", "target_on_tool");
        chain.six_parameters(target, [0.0; 3], [0.0; 3]);
        chain.frame(target);
        chain
    }

    /// Nominal values in column order.
    #[must_use]
    pub fn nominal(&self) -> Vec<f64> {
        self.parameters.iter().map(|parameter| parameter.nominal).collect()
    }

    /// Names of the frames from base to tool.
    #[must_use]
    pub fn frame_names(&self) -> Vec<&str> {
        self.steps
            .iter()
            .filter_map(|step| match step {
                Step::Frame { name } => Some(name.as_str()),
                _ => None,
            })
            .collect()
    }

    /// The chain with the parameter values `values` (column order, SI), ready for many configurations.
    ///
    /// # Panics
    /// If `values` has not one entry per parameter.
    #[must_use]
    pub fn at(&self, values: &[f64]) -> ChainAt {
        assert_eq!(values.len(), self.parameters.len(), "one value per parameter");
        let steps = self
            .steps
            .iter()
            .map(|step| match step {
                Step::Rotate { axis, parameter } => {
                    let (sine, cosine) = libm::sincos(values[*parameter]);
                    Prepared::Rotate { axis: *axis, sine, cosine }
                }
                Step::Translate { axis, parameter } => Prepared::Translate { axis: *axis, distance: values[*parameter] },
                Step::Joint { joint } => match self.joints[*joint].kind {
                    JointKind::Revolute => Prepared::Turn { joint: *joint },
                    JointKind::Prismatic => Prepared::Slide { joint: *joint },
                },
                Step::Fixed(pose) => fixed(pose),
                Step::Frame { .. } => Prepared::Frame,
            })
            .collect();
        ChainAt { steps, parameter_count: self.parameters.len(), joint_count: self.joints.len() }
    }

    /// The chain at its nominal parameters.
    #[must_use]
    pub fn at_nominal(&self) -> ChainAt {
        self.at(&self.nominal())
    }
}

impl Default for Chain {
    fn default() -> Self {
        Chain::new()
    }
}

/// An elementary motion whose sine and cosine are known. Parameters appear in column order.
#[derive(Clone, Debug)]
enum Prepared {
    Rotate { axis: Axis, sine: f64, cosine: f64 },
    Translate { axis: Axis, distance: f64 },
    Turn { joint: usize },
    Slide { joint: usize },
    Fixed { rotation: Matrix3<f64>, translation: Vector3<f64> },
    Frame,
}

/// A chain at given parameter values.
#[derive(Clone, Debug)]
pub struct ChainAt {
    steps: Vec<Prepared>,
    parameter_count: usize,
    joint_count: usize,
}

/// The frame that a walk along the chain has reached: axes as columns, and the origin, in base.
#[derive(Clone, Copy)]
struct Walker {
    axes: [Vector3<f64>; 3],
    origin: Vector3<f64>,
}

impl Walker {
    fn at_base() -> Self {
        Walker { axes: [Vector3::x(), Vector3::y(), Vector3::z()], origin: Vector3::zeros() }
    }

    #[inline]
    fn rotate(&mut self, axis: Axis, sine: f64, cosine: f64) {
        // Turning about one axis mixes the two that follow it in cyclic order.
        let (first, second) = ((axis.index() + 1) % 3, (axis.index() + 2) % 3);
        let (u, v) = (self.axes[first], self.axes[second]);
        self.axes[first] = u * cosine + v * sine;
        self.axes[second] = v * cosine - u * sine;
    }

    #[inline]
    fn translate(&mut self, axis: Axis, distance: f64) {
        self.origin += self.axes[axis.index()] * distance;
    }

    #[inline]
    fn step(&mut self, step: &Prepared, joints: &[f64]) {
        match step {
            Prepared::Rotate { axis, sine, cosine } => self.rotate(*axis, *sine, *cosine),
            Prepared::Translate { axis, distance } => self.translate(*axis, *distance),
            Prepared::Turn { joint } => {
                let (sine, cosine) = libm::sincos(joints[*joint]);
                self.rotate(Axis::Z, sine, cosine);
            }
            Prepared::Slide { joint } => self.translate(Axis::Z, joints[*joint]),
            Prepared::Fixed { rotation, translation } => {
                let axes = Matrix3::from_columns(&self.axes);
                self.origin += axes * translation;
                let turned = axes * rotation;
                self.axes = [turned.column(0).into(), turned.column(1).into(), turned.column(2).into()];
            }
            Prepared::Frame => {}
        }
    }

    fn pose(&self) -> Pose {
        pose_from_parts(&Matrix3::from_columns(&self.axes), &self.origin)
    }
}

impl ChainAt {
    /// Number of parameters: columns of the Jacobian.
    #[must_use]
    pub fn parameter_count(&self) -> usize {
        self.parameter_count
    }

    /// Number of joints: length of a configuration.
    #[must_use]
    pub fn joint_count(&self) -> usize {
        self.joint_count
    }

    /// `base_from_tool` at the joint coordinates `joints` (rad or m).
    #[must_use]
    pub fn forward(&self, joints: &[f64]) -> Pose {
        debug_assert_eq!(joints.len(), self.joint_count);
        let mut walker = Walker::at_base();
        for step in &self.steps {
            walker.step(step, joints);
        }
        walker.pose()
    }

    /// `base_from_frame` of every named frame, base first, at the joint coordinates `joints`.
    #[must_use]
    pub fn frames(&self, joints: &[f64]) -> Vec<Pose> {
        let mut frames = Vec::new();
        self.frames_into(joints, &mut frames);
        frames
    }

    /// Like [`ChainAt::frames`], into a buffer that is cleared first.
    pub fn frames_into(&self, joints: &[f64], frames: &mut Vec<Pose>) {
        debug_assert_eq!(joints.len(), self.joint_count);
        frames.clear();
        let mut walker = Walker::at_base();
        for step in &self.steps {
            walker.step(step, joints);
            if matches!(step, Prepared::Frame) {
                frames.push(walker.pose());
            }
        }
    }

    /// Visits every named frame, base first: its number, its axes (columns, in base) and its origin in base (m).
    pub fn visit_frames(&self, joints: &[f64], mut visit: impl FnMut(usize, &[Vector3<f64>; 3], &Vector3<f64>)) {
        let mut walker = Walker::at_base();
        let mut number = 0;
        for step in &self.steps {
            walker.step(step, joints);
            if matches!(step, Prepared::Frame) {
                visit(number, &walker.axes, &walker.origin);
                number += 1;
            }
        }
    }

    /// The tool's origin in base, m.
    #[must_use]
    pub fn end_point(&self, joints: &[f64]) -> Vector3<f64> {
        let mut walker = Walker::at_base();
        for step in &self.steps {
            walker.step(step, joints);
        }
        walker.origin
    }

    /// The frames in which the joints move, before their motion, each relative to the frame after the motion of the joint
    /// before it (the base for the first), and last the tool relative to the frame after the last joint's motion:
    /// `joint_count + 1` transforms. Their product with the joint motions in between is [`ChainAt::forward`].
    #[must_use]
    pub fn segments(&self) -> Vec<Pose> {
        let mut segments = Vec::with_capacity(self.joint_count + 1);
        let mut walker = Walker::at_base();
        for step in &self.steps {
            if matches!(step, Prepared::Turn { .. } | Prepared::Slide { .. }) {
                segments.push(walker.pose());
                walker = Walker::at_base();
            } else {
                walker.step(step, &[]);
            }
        }
        segments.push(walker.pose());
        segments
    }

    /// Visits every joint from the base to the tool: its number, the frame in which it moves before its motion, and the same frame
    /// after it; axes (columns) and origin (m) of both, in base. Returns the tool's.
    pub fn visit_joints(
        &self,
        joints: &[f64],
        mut visit: impl FnMut(usize, (&[Vector3<f64>; 3], &Vector3<f64>), (&[Vector3<f64>; 3], &Vector3<f64>)),
    ) -> (Matrix3<f64>, Vector3<f64>) {
        debug_assert_eq!(joints.len(), self.joint_count);
        let mut walker = Walker::at_base();
        for step in &self.steps {
            let before = walker;
            walker.step(step, joints);
            if let Prepared::Turn { joint } | Prepared::Slide { joint } = step {
                visit(*joint, (&before.axes, &before.origin), (&walker.axes, &walker.origin));
            }
        }
        (Matrix3::from_columns(&walker.axes), walker.origin)
    }

    /// How the tool moves per unit of each joint coordinate, base to tool: its origin's velocity (m) and its turn (rad), both in
    /// base axes, per rad or m.
    #[must_use]
    pub fn joint_jacobian(&self, joints: &[f64]) -> Vec<Vector6<f64>> {
        debug_assert_eq!(joints.len(), self.joint_count);
        let mut walker = Walker::at_base();
        let mut axes = Vec::with_capacity(self.joint_count);
        for step in &self.steps {
            if let Prepared::Turn { .. } | Prepared::Slide { .. } = step {
                axes.push((matches!(step, Prepared::Turn { .. }), walker.axes[Axis::Z.index()], walker.origin));
            }
            walker.step(step, joints);
        }
        let tool = walker.origin;
        let column = |(turns, axis, origin): (bool, Vector3<f64>, Vector3<f64>)| {
            let (linear, angular) = if turns { (axis.cross(&(tool - origin)), axis) } else { (axis, Vector3::zeros()) };
            Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
        };
        axes.into_iter().map(column).collect()
    }

    /// Forward kinematics and the error Jacobian (eq. 52, in base axes): how the tool's position (m, rows 0–2) and orientation
    /// (rotation vector, rad, rows 3–5) change per unit of each parameter. Both parts are expressed in base; eq. 52 expresses
    /// them in the tool's axes, which changes no singular value.
    ///
    /// `rows` receives 6 rows of `stride` values (row-major, `stride ≥ parameter_count`); what lies past the last parameter
    /// in each row is left as it was. Returns `base_from_tool`'s axes and origin.
    ///
    /// # Panics
    /// If `stride` is below the number of parameters or `rows` shorter than six rows.
    pub fn jacobian_into(&self, joints: &[f64], rows: &mut [f64], stride: usize) -> (Matrix3<f64>, Vector3<f64>) {
        assert!(stride >= self.parameter_count && rows.len() >= 6 * stride, "six rows of one entry per parameter");
        debug_assert_eq!(joints.len(), self.joint_count);
        let mut walker = Walker::at_base();
        let mut column = 0;
        for step in &self.steps {
            match step {
                Prepared::Rotate { axis, .. } => {
                    let direction = walker.axes[axis.index()];
                    // The lever to the tool is not known yet: keep axis and point, finish below.
                    let moment = walker.origin.cross(&direction);
                    put(rows, stride, column, &moment, &direction);
                    column += 1;
                }
                Prepared::Translate { axis, .. } => {
                    put(rows, stride, column, &walker.axes[axis.index()], &Vector3::zeros());
                    column += 1;
                }
                _ => {}
            }
            walker.step(step, joints);
        }
        // Velocity of the tool: moment of the axis about the base origin, shifted to the tool's origin.
        let p = walker.origin;
        let (linear, angular) = rows.split_at_mut(3 * stride);
        let (x, yz) = linear.split_at_mut(stride);
        let (y, z) = yz.split_at_mut(stride);
        for column in 0..self.parameter_count {
            let (wx, wy, wz) = (angular[column], angular[stride + column], angular[2 * stride + column]);
            x[column] += wy * p.z - wz * p.y;
            y[column] += wz * p.x - wx * p.z;
            z[column] += wx * p.y - wy * p.x;
        }
        (Matrix3::from_columns(&walker.axes), walker.origin)
    }

    /// The error Jacobian as a 6 × parameters matrix with `base_from_tool`; see [`ChainAt::jacobian_into`].
    #[must_use]
    pub fn jacobian(&self, joints: &[f64]) -> (Pose, nalgebra::DMatrix<f64>) {
        let mut rows = vec![0.0; 6 * self.parameter_count];
        let (axes, origin) = self.jacobian_into(joints, &mut rows, self.parameter_count);
        (pose_from_parts(&axes, &origin), nalgebra::DMatrix::from_row_slice(6, self.parameter_count, &rows))
    }
}

/// The arm of a chain whose joint frames are off by six small errors each, from the second joint on: `Trans(x, y, z) Rot(z) Rot(y) Rot(x)`
/// after the nominal frame. Complete whatever parameters the chain itself has, and regular where roll, pitch and yaw are not. The frames of
/// the first joint and of the tool are those of base and target.
#[derive(Clone, Debug)]
pub struct FrameErrors {
    segments: Vec<Prepared>,
    kinds: Vec<JointKind>,
}

impl FrameErrors {
    /// Parameters of a frame: x, y, z (m), then turns about z, y, x (rad).
    pub const PER_FRAME: usize = 6;

    /// Of the nominal `chain`.
    #[must_use]
    pub fn new(chain: &Chain) -> FrameErrors {
        let segments = chain.at_nominal().segments().iter().map(fixed).collect();
        FrameErrors { segments, kinds: chain.joints.iter().map(|joint| joint.kind).collect() }
    }

    /// Number of joint frames that are off.
    #[must_use]
    pub fn frames(&self) -> usize {
        self.kinds.len() - 1
    }

    /// The frames' errors when the arm is larger by its own size: as much as each joint frame is away from the one before.
    #[must_use]
    pub fn growth(&self) -> Vec<f64> {
        let of = |segment: &Prepared| match segment {
            Prepared::Fixed { rotation, translation } => {
                let own = rotation.transpose() * translation;
                [own.x, own.y, own.z, 0.0, 0.0, 0.0]
            }
            _ => [0.0; 6],
        };
        self.segments[1..self.kinds.len()].iter().flat_map(of).collect()
    }

    /// Which error of the frames is the zero of `joint` (from 0): the turn about its axis, or the shift along it where it slides. That of
    /// the first joint is part of the base.
    #[must_use]
    pub fn zero_of(&self, joint: usize) -> Option<usize> {
        let frame = joint.checked_sub(1)?;
        Some(Self::PER_FRAME * frame + if *self.kinds.get(joint)? == JointKind::Revolute { 3 } else { 2 })
    }

    /// Whether error number `at` is a joint's zero.
    #[must_use]
    pub fn is_zero(&self, at: usize) -> bool {
        self.zero_of(at / Self::PER_FRAME + 1) == Some(at)
    }

    /// The arm with the frame errors `errors` (six each), its root at `measurement_from_root` and a target at `tool_from_target`. The
    /// Jacobian's columns are: six of the root's pose, the frames', six of the target's pose, each in the frame itself.
    ///
    /// # Panics
    /// If there are not six errors per frame.
    #[must_use]
    pub fn at(&self, measurement_from_root: &Pose, errors: &[f64], tool_from_target: &Pose) -> ChainAt {
        assert_eq!(errors.len(), Self::PER_FRAME * self.frames(), "six errors per frame");
        let count = self.kinds.len();
        let mut steps = vec![fixed(measurement_from_root)];
        steps.extend(six(&[0.0; 6]));
        for (joint, kind) in self.kinds.iter().enumerate() {
            steps.push(self.segments[joint].clone());
            if let Some(frame) = joint.checked_sub(1) {
                steps.extend(six(&errors[Self::PER_FRAME * frame..Self::PER_FRAME * (frame + 1)]));
            }
            steps.push(match kind {
                JointKind::Revolute => Prepared::Turn { joint },
                JointKind::Prismatic => Prepared::Slide { joint },
            });
        }
        steps.push(self.segments[count].clone());
        steps.push(fixed(tool_from_target));
        steps.extend(six(&[0.0; 6]));
        ChainAt { steps, parameter_count: Self::PER_FRAME * (count + 1), joint_count: count }
    }

    /// The pose that six errors make.
    #[must_use]
    pub fn pose(errors: &[f64]) -> Pose {
        let mut walker = Walker::at_base();
        six(errors).iter().for_each(|step| walker.step(step, &[]));
        walker.pose()
    }
}

fn fixed(pose: &Pose) -> Prepared {
    Prepared::Fixed { rotation: pose.rotation.to_rotation_matrix().into_inner(), translation: pose.translation.vector }
}

/// As [`Chain::six_parameters`].
fn six(errors: &[f64]) -> [Prepared; 6] {
    let shift = |at: usize, axis: Axis| Prepared::Translate { axis, distance: errors[at] };
    let turn = |at: usize, axis: Axis| {
        let (sine, cosine) = libm::sincos(errors[at]);
        Prepared::Rotate { axis, sine, cosine }
    };
    [shift(0, Axis::X), shift(1, Axis::Y), shift(2, Axis::Z), turn(3, Axis::Z), turn(4, Axis::Y), turn(5, Axis::X)]
}

#[inline]
fn put(rows: &mut [f64], stride: usize, column: usize, linear: &Vector3<f64>, angular: &Vector3<f64>) {
    for axis in 0..3 {
        rows[axis * stride + column] = linear[axis];
        rows[(3 + axis) * stride + column] = angular[axis];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::frames::pose_error;
    use crate::seed::stream;

    /// Frame errors do what the same change of the nominal segments does, and their Jacobian is how the pose changes.
    #[test]
    fn frame_errors_change_the_segments_and_the_pose_as_their_jacobian_says() {
        let mut stream = stream(2, "test/chain/frame_errors");
        for file in crate::lab::reproduce::arms::arms().unwrap() {
            let chain = file.scene.arm.chain;
            let frames = FrameErrors::new(&chain);
            let draw = |stream: &mut crate::seed::Stream| (0..6).map(|_| stream.uniform(-0.5, 0.5)).collect::<Vec<f64>>();
            let (base, target) = (FrameErrors::pose(&draw(&mut stream)), FrameErrors::pose(&draw(&mut stream)));
            let errors: Vec<f64> = (0..6 * frames.frames()).map(|_| stream.uniform(-0.1, 0.1)).collect();
            let joints: Vec<f64> = chain.joints.iter().map(|of| stream.uniform(of.lower, of.upper)).collect();
            let at = frames.at(&base, &errors, &target);
            let nominal = chain.at_nominal();
            let none = vec![0.0; errors.len()];
            let difference =
                pose_error(&frames.at(&base, &none, &target).forward(&joints), &(base * nominal.forward(&joints) * target));
            assert!(difference.amax() < 1e-12, "{difference}");
            for (frame, (ours, theirs)) in at.segments().iter().zip(nominal.segments()).enumerate().skip(1) {
                if frame <= frames.frames() {
                    let expected = theirs * FrameErrors::pose(&errors[6 * (frame - 1)..6 * frame]);
                    assert!(pose_error(ours, &expected).amax() < 1e-12);
                }
            }
            let (_, jacobian) = at.jacobian(&joints);
            assert_eq!(jacobian.ncols(), 6 * (frames.frames() + 2));
            let step = 1e-5;
            for column in 0..jacobian.ncols() {
                let moved = |by: f64| {
                    let mut six = [0.0; 6];
                    six[column % 6] = by;
                    let (mut base, mut errors, mut target) = (base, errors.clone(), target);
                    match (column / 6, frames.frames()) {
                        (0, _) => base *= FrameErrors::pose(&six),
                        (block, count) if block > count => target *= FrameErrors::pose(&six),
                        (block, _) => errors[6 * (block - 1) + column % 6] += by,
                    }
                    frames.at(&base, &errors, &target).forward(&joints)
                };
                let difference = pose_error(&moved(step), &moved(-step)) / (2.0 * step);
                assert!((difference - jacobian.column(column)).amax() < 1e-8, "column {column}: {difference}");
            }
        }
    }

    #[test]
    fn the_joint_jacobian_is_how_the_pose_changes_with_the_joints() {
        let mut stream = stream(1, "test/chain/joint_jacobian");
        for file in crate::lab::reproduce::arms::arms().unwrap() {
            let arm = file.scene.arm;
            let chain = arm.chain.at_nominal();
            for _ in 0..20 {
                let joints: Vec<f64> = arm.chain.joints.iter().map(|of| stream.uniform(of.lower, of.upper)).collect();
                for (joint, column) in chain.joint_jacobian(&joints).iter().enumerate() {
                    let moved = |by: f64| {
                        let mut moved = joints.clone();
                        moved[joint] += by;
                        chain.forward(&moved)
                    };
                    // Central differences: off by h² of the third derivative, and by rounding over h.
                    let step = 1e-5;
                    let difference = pose_error(&moved(step), &moved(-step)) / (2.0 * step);
                    assert!((difference - column).amax() < 1e-9, "joint {joint}: {difference} and {column}");
                }
            }
        }
    }
}
