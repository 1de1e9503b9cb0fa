//! The arm and its cell as shapes, and the transforms that move them.

use re_sdk_types::archetypes::{Boxes3D, Capsules3D, Cylinders3D, Ellipsoids3D, LineStrips3D, Transform3D, TransformAxes3D};
use re_sdk_types::components::FillMode;
use re_sdk_types::datatypes::Quaternion;
use rerun::{EntityPath, RecordingStream, RecordingStreamResult, entity_path};

use super::viewer::ViewerError;
use crate::arm::ChainAt;
use crate::arm::frames::Pose;
use crate::arm::{Arm, Geometry, Shape};

/// Colours of the links, base first, in turn: calm, and different enough to tell neighbours apart.
const LINKS: [[u8; 3]; 4] = [[124, 138, 158], [176, 188, 204], [146, 164, 170], [198, 204, 196]];
const FIXTURE: [u8; 3] = [74, 78, 88];
const SKELETON: [u8; 3] = [92, 104, 122];

/// Draws an arm.
#[derive(Debug)]
pub(super) struct Body {
    arm: Arm,
    chain: ChainAt,
    /// Index of each link's frame among the chain's frames.
    frame_of_link: Vec<usize>,
    /// Length of the arm stretched out, m: the scale of the scene.
    pub(super) stretch: f64,
}

impl Body {
    pub(super) fn new(arm: &Arm) -> Result<Body, ViewerError> {
        let names = arm.chain.frame_names();
        let frame_of_link = arm
            .links
            .iter()
            .map(|link| {
                names
                    .iter()
                    .position(|name| *name == link.name)
                    .ok_or_else(|| ViewerError::LinkWithoutFrame { link: link.name.clone(), frames: names.join(", ") })
            })
            .collect::<Result<_, _>>()?;
        let chain = arm.chain.at_nominal();
        let stretch: f64 = chain.segments().iter().map(|segment| segment.translation.vector.norm()).sum();
        let slide = arm.chain.joints.iter().filter(|joint| joint.kind == crate::arm::JointKind::Prismatic);
        let stretch = stretch + slide.map(|joint| (joint.upper - joint.lower).min(10.0)).sum::<f64>();
        // An arm without any length is still to be looked at from somewhere.
        let stretch = if stretch > 1e-3 { stretch } else { 1.0 };
        Ok(Body { arm: arm.clone(), chain, frame_of_link, stretch })
    }

    pub(super) fn arm(&self) -> &Arm {
        &self.arm
    }

    /// The nominal `base_from_tool`.
    pub(super) fn tool(&self, joints: &[f64]) -> Option<Pose> {
        (joints.len() == self.chain.joint_count()).then(|| self.chain.forward(joints))
    }

    /// Shapes of links and cell, at all times; the arm in the middle of its limits.
    pub(super) fn log_shapes(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        let axis = (0.12 * self.stretch) as f32;
        stream.log_static("world/base", &Transform3D::from_translation([0.0, 0.0, 0.0]))?;
        stream.log_static("world/base", &TransformAxes3D::new(axis))?;
        for fixture in &self.arm.fixtures {
            log_shape(stream, entity_path!["world", "cell", fixture.name.as_str()], &fixture.shape, FIXTURE)?;
        }
        for (index, link) in self.arm.links.iter().enumerate() {
            for (number, shape) in link.shapes.iter().enumerate() {
                let path = entity_path!["world", "arm", link.name.as_str(), format!("shape{number}")];
                log_shape(stream, path, shape, LINKS[index % LINKS.len()])?;
            }
        }
        let middle: Vec<f64> = self
            .arm
            .chain
            .joints
            .iter()
            .map(|joint| if (joint.upper - joint.lower).is_finite() { (joint.lower + joint.upper) / 2.0 } else { 0.0 })
            .collect();
        self.log_configuration(stream, &middle)
    }

    /// Moves the links to where they are at the joint readings `joints`.
    pub(super) fn log_configuration(&self, stream: &RecordingStream, joints: &[f64]) -> RecordingStreamResult<()> {
        if joints.len() != self.chain.joint_count() {
            return Ok(());
        }
        let frames = self.chain.frames(joints);
        for (link, frame) in self.arm.links.iter().zip(&self.frame_of_link) {
            stream.log(entity_path!["world", "arm", link.name.as_str()], &transform(&frames[*frame]))?;
        }
        // Reaches the tool also where links have no shapes.
        let line = LineStrips3D::new([self.skeleton(joints)]).with_colors([SKELETON]).with_radii([0.006 * self.stretch as f32]);
        stream.log("world/arm_line", &line)
    }

    /// Origins of the frames from base to tool.
    pub(super) fn skeleton(&self, joints: &[f64]) -> Vec<[f32; 3]> {
        if joints.len() != self.chain.joint_count() {
            return Vec::new();
        }
        let mut points: Vec<[f32; 3]> = self.chain.frames(joints).iter().map(|frame| point(&frame.translation.vector)).collect();
        points.push(point(&self.chain.forward(joints).translation.vector));
        points
    }
}

/// Coordinates for Rerun, which draws in single precision.
pub(super) fn point(vector: &nalgebra::Vector3<f64>) -> [f32; 3] {
    [vector.x as f32, vector.y as f32, vector.z as f32]
}

pub(super) fn transform(pose: &Pose) -> Transform3D {
    Transform3D::from_translation_rotation(point(&pose.translation.vector), quaternion(pose))
}

fn quaternion(pose: &Pose) -> Quaternion {
    let q = pose.rotation.quaternion();
    Quaternion::from_xyzw([q.i as f32, q.j as f32, q.k as f32, q.w as f32])
}

fn log_shape(stream: &RecordingStream, path: EntityPath, shape: &Shape, colour: [u8; 3]) -> RecordingStreamResult<()> {
    let pose = &shape.link_from_shape;
    let (centre, rotation) = (point(&pose.translation.vector), quaternion(pose));
    match shape.geometry {
        Geometry::Capsule { half_length, radius } => {
            // Rerun's capsule begins at its origin, ours is centred on it.
            let foot = point(&(pose.translation.vector - pose.rotation * nalgebra::Vector3::z() * half_length));
            let capsule = Capsules3D::from_lengths_and_radii([(2.0 * half_length) as f32], [radius as f32])
                .with_translations([foot])
                .with_quaternions([rotation])
                .with_colors([colour])
                .with_fill_mode(FillMode::Solid);
            stream.log_static(path, &capsule)
        }
        Geometry::Cylinder { half_length, radius } => {
            let cylinder = Cylinders3D::from_lengths_and_radii([(2.0 * half_length) as f32], [radius as f32])
                .with_centers([centre])
                .with_quaternions([rotation])
                .with_colors([colour])
                .with_fill_mode(FillMode::Solid);
            stream.log_static(path, &cylinder)
        }
        Geometry::Box { half_extents } => {
            let cuboid = Boxes3D::from_centers_and_half_sizes([centre], [half_extents.map(|half| half as f32)])
                .with_quaternions([rotation])
                .with_colors([colour])
                .with_fill_mode(FillMode::Solid);
            stream.log_static(path, &cuboid)
        }
        Geometry::Sphere { radius } => {
            let ball = Ellipsoids3D::from_centers_and_radii([centre], [radius as f32])
                .with_colors([colour])
                .with_fill_mode(FillMode::Solid);
            stream.log_static(path, &ball)
        }
    }
}
