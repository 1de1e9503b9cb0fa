//! From events to messages.

use std::collections::BTreeMap;

use foxglove::messages::{
    Color, CubePrimitive, CylinderPrimitive, FrameTransform, FrameTransforms, JointState, JointStates, Log, PoseInFrame,
    PosesInFrame, Quaternion, SceneEntity, SceneUpdate, SpherePrimitive, Timestamp, Vector3, log,
};

use super::cloud;
use super::json::Source;
use super::skeleton::Skeleton;
use super::topic::Topic;
use crate::arm::chain::{Chain, ChainAt, Step};
use crate::arm::frames::Pose;
use crate::arm::{Arm, Fixture, Geometry, Shape};
use crate::design::outcome::{DesignOutcome, SearchStep, SwarmIteration};
use crate::event::{Event, Start};
use crate::identification::outcome::Identification;
use crate::measurement::Measurement;

/// Name of a log message that is a note.
pub(super) const NOTE: &str = "kincal";
/// Name of a log message that says why there is no diagnosis.
pub(super) const NOT_DIAGNOSED: &str = "kincal.no_diagnosis";
/// Simulated time from one event of the design to the next, and around each phase, ns.
const STEP_NS: u64 = 100_000_000;

/// A message of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    /// Where it belongs.
    pub topic: Topic,
    /// Number of the event it comes from, from 0; its MCAP sequence number.
    pub event: u32,
    /// Simulated time since the start, ns. Never goes backwards.
    pub log_time_ns: u64,
    /// JSON or protobuf.
    pub data: Vec<u8>,
}

/// An event cannot be put into a message.
#[derive(Debug, thiserror::Error)]
pub enum EncodeError {
    /// JSON could not hold the event: a number is NaN or infinite.
    #[error("{topic}: {field} is NaN or infinite and cannot be recorded ({reason})")]
    NotFinite {
        /// Name of the topic.
        topic: &'static str,
        /// The innermost named field.
        field: String,
        /// What the JSON reader says.
        reason: String,
    },
    /// A configuration of another arm.
    #[error("{topic}: a configuration has {got} joint coordinates, the arm has {expected} joints")]
    Joints {
        /// Name of the topic.
        topic: &'static str,
        /// Length of the configuration.
        got: usize,
        /// Joints of the arm.
        expected: usize,
    },
}

/// Turns the events of one run, in order, into messages. The bytes are a function of the arm and the events alone.
pub struct Encoder {
    arm: Arm,
    nominal: ChainAt,
    /// Frame in which poses and points are given: the chain's first.
    root: String,
    skeleton: Skeleton,
    frame_names: Vec<String>,
    event: u32,
    now_ns: u64,
    session_start_ns: Option<u64>,
    /// Joint readings by index of the measurement.
    readings: BTreeMap<usize, Vec<f64>>,
}

impl Encoder {
    /// An encoder for a run with the nominal arm `arm`.
    #[must_use]
    pub fn new(arm: &Arm) -> Self {
        let frame_names: Vec<String> = arm.chain.frame_names().into_iter().map(str::to_owned).collect();
        Encoder {
            nominal: arm.chain.at_nominal(),
            root: root(&arm.chain),
            skeleton: Skeleton::new(arm),
            arm: arm.clone(),
            frame_names,
            event: 0,
            now_ns: 0,
            session_start_ns: None,
            readings: BTreeMap::new(),
        }
    }

    /// The messages of the next event: its source message first, then what is derived from it.
    ///
    /// # Errors
    /// If a number is not finite (JSON has no such numbers) or a configuration does not fit the arm.
    pub fn encode(&mut self, event: &Event) -> Result<Vec<Message>, EncodeError> {
        self.advance(event);
        let mut messages = Messages { event: self.event, log_time_ns: self.now_ns, list: Vec::new() };
        match event {
            Event::Start(start) => self.start(start, &mut messages)?,
            Event::Swarm(swarm) => self.swarm(swarm, &mut messages)?,
            Event::Search(step) => self.search(step, &mut messages)?,
            Event::Designed(outcome) => self.designed(outcome, &mut messages)?,
            Event::Measured(measurement) => self.measured(measurement, &mut messages)?,
            Event::Identified(identification) => self.identified(identification, &mut messages)?,
            Event::Diagnosed(diagnosis) => messages.json(Topic::Diagnosis, diagnosis.as_ref())?,
            Event::Note(note) => messages.protobuf(Topic::Log, &self.log_message(NOTE, note)),
            Event::NotDiagnosed(reason) => messages.protobuf(Topic::Log, &self.log_message(NOT_DIAGNOSED, reason)),
        }
        self.event = self.event.saturating_add(1);
        Ok(messages.list)
    }

    fn log_message(&self, name: &str, message: &str) -> Log {
        Log {
            timestamp: Some(timestamp(self.now_ns)),
            level: log::Level::Info as i32,
            message: message.to_owned(),
            name: name.to_owned(),
            ..Log::default()
        }
    }

    fn advance(&mut self, event: &Event) {
        let next = self.now_ns.saturating_add(STEP_NS);
        match event {
            Event::Swarm(_) | Event::Search(_) | Event::Identified(_) | Event::Diagnosed(_) => self.now_ns = next,
            Event::Designed(_) => {
                self.now_ns = next;
                self.session_start_ns = None;
            }
            Event::Measured(measurement) => {
                let start = *self.session_start_ns.get_or_insert(next);
                // A float cast saturates; what is no time at all counts as none.
                let since = (measurement.time_s * 1e9).round() as u64;
                self.now_ns = self.now_ns.max(start.saturating_add(since));
            }
            Event::Start(_) | Event::Note(_) | Event::NotDiagnosed(_) => {}
        }
    }

    fn start(&self, start: &Start, messages: &mut Messages) -> Result<(), EncodeError> {
        messages.json(Topic::Run, start)?;
        messages.protobuf(Topic::Shapes, &self.shapes());
        let zero = vec![0.0; self.arm.joint_count()];
        messages.protobuf(Topic::Transforms, &self.transforms(&zero));
        self.arm_points(&zero, None, messages);
        // Rerun complains of clouds whose frame it has not been told yet, however late they appear.
        let time = timestamp(self.now_ns);
        messages.protobuf(Topic::SwarmEndPoints, &cloud::no_end_points(time, &self.root));
        messages.protobuf(Topic::BestEndPoints, &cloud::best(std::iter::empty(), time, &self.root));
        for topic in [Topic::ResidualsBefore, Topic::ResidualsAfter] {
            messages.protobuf(topic, &cloud::residuals(&[], |residual| &residual.nominal, 0.0, time, &self.root));
        }
        Ok(())
    }

    fn swarm(&self, swarm: &SwarmIteration, messages: &mut Messages) -> Result<(), EncodeError> {
        messages.json(Topic::Swarm, swarm)?;
        if !swarm.end_points.is_empty() {
            messages.protobuf(Topic::SwarmEndPoints, &cloud::end_points(swarm, timestamp(self.now_ns), &self.root));
        }
        self.best(Topic::Swarm, &swarm.best_configurations, messages)
    }

    fn search(&self, step: &SearchStep, messages: &mut Messages) -> Result<(), EncodeError> {
        messages.json(Topic::Search, step)?;
        self.best(Topic::Search, &step.best_configurations, messages)
    }

    /// The end points of the best set, where `topic` tells a new one.
    fn best(&self, topic: Topic, configurations: &[Vec<f64>], messages: &mut Messages) -> Result<(), EncodeError> {
        if !configurations.is_empty() {
            self.check_joints(topic, configurations)?;
            let points = configurations.iter().map(|joints| self.nominal.forward(joints).translation.vector.into());
            messages.protobuf(Topic::BestEndPoints, &cloud::best(points, timestamp(self.now_ns), &self.root));
        }
        Ok(())
    }

    fn designed(&self, outcome: &DesignOutcome, messages: &mut Messages) -> Result<(), EncodeError> {
        messages.json(Topic::Design, outcome)?;
        self.check_joints(Topic::Design, &outcome.configurations)?;
        let poses = outcome.configurations.iter().map(|joints| pose(&self.nominal.forward(joints))).collect();
        messages.protobuf(Topic::Chosen, &self.poses_in_frame(poses));
        Ok(())
    }

    fn measured(&mut self, measurement: &Measurement, messages: &mut Messages) -> Result<(), EncodeError> {
        messages.json(Topic::Measurement, measurement)?;
        self.check_joints(Topic::Measurement, std::slice::from_ref(&measurement.joints))?;
        messages.protobuf(Topic::Transforms, &self.transforms(&measurement.joints));
        let [x, y, z] = measurement.position_m;
        let [qx, qy, qz, qw] = measurement.orientation_xyzw.unwrap_or([0.0, 0.0, 0.0, 1.0]);
        let measured = foxglove::messages::Pose {
            position: Some(Vector3 { x, y, z }),
            orientation: Some(Quaternion { x: qx, y: qy, z: qz, w: qw }),
        };
        let orientation = nalgebra::UnitQuaternion::new_normalize(nalgebra::Quaternion::new(qw, qx, qy, qz));
        self.arm_points(&measurement.joints, Some(&Pose::from_parts([x, y, z].into(), orientation)), messages);
        let readings = self.arm.chain.joints.iter().zip(&measurement.joints);
        let joints = readings.map(|(joint, value)| JointState {
            name: joint.name.clone(),
            position: Some(*value),
            ..JointState::default()
        });
        let timestamp = Some(timestamp(self.now_ns));
        messages.protobuf(Topic::JointReadings, &JointStates { timestamp, joints: joints.collect() });
        messages.protobuf(Topic::PoseMeasured, &self.pose_in_frame(measured));
        messages.protobuf(Topic::PoseNominal, &self.pose_in_frame(pose(&self.nominal.forward(&measurement.joints))));
        self.readings.insert(measurement.index, measurement.joints.clone());
        Ok(())
    }

    fn identified(&self, identification: &Identification, messages: &mut Messages) -> Result<(), EncodeError> {
        messages.json(Topic::Identification, identification)?;
        let (residuals, time) = (&identification.residuals, timestamp(self.now_ns));
        // One scale for both clouds, so that what the identification has gained shows in the colours.
        let longest = residuals.iter().fold(0.0, |longest: f64, residual| longest.max(cloud::length(&residual.nominal)));
        let before = cloud::residuals(residuals, |residual| &residual.nominal, longest, time, &self.root);
        messages.protobuf(Topic::ResidualsBefore, &before);
        let after = cloud::residuals(residuals, |residual| &residual.identified, longest, time, &self.root);
        messages.protobuf(Topic::ResidualsAfter, &after);
        let values: Vec<f64> = identification.parameters.iter().map(|parameter| parameter.identified).collect();
        if values.len() == self.arm.chain.parameters.len() {
            let identified = self.arm.chain.at(&values);
            let readings = residuals.iter().filter_map(|residual| self.readings.get(&residual.index));
            let poses = readings.map(|joints| pose(&identified.forward(joints))).collect();
            messages.protobuf(Topic::PosesPredicted, &self.poses_in_frame(poses));
        }
        Ok(())
    }

    fn arm_points(&self, joints: &[f64], measured: Option<&Pose>, messages: &mut Messages) {
        let dots = self.skeleton.dots(&self.nominal.frames(joints), measured);
        messages.protobuf(Topic::ArmPoints, &cloud::dots(&dots, timestamp(self.now_ns), &self.root));
    }

    fn check_joints(&self, topic: Topic, configurations: &[Vec<f64>]) -> Result<(), EncodeError> {
        let expected = self.arm.joint_count();
        match configurations.iter().find(|joints| joints.len() != expected) {
            Some(joints) => Err(EncodeError::Joints { topic: topic.name(), got: joints.len(), expected }),
            None => Ok(()),
        }
    }

    fn transforms(&self, joints: &[f64]) -> FrameTransforms {
        let frames = self.nominal.frames(joints);
        let mut parent = (self.root.as_str(), Pose::identity());
        let mut transforms = Vec::new();
        for (name, base_from_frame) in self.frame_names.iter().zip(frames) {
            if *name != self.root {
                let parent_from_child = parent.1.inverse() * base_from_frame;
                let in_parent = pose(&parent_from_child);
                transforms.push(FrameTransform {
                    timestamp: Some(timestamp(self.now_ns)),
                    parent_frame_id: parent.0.to_owned(),
                    child_frame_id: name.clone(),
                    translation: in_parent.position,
                    rotation: in_parent.orientation,
                });
            }
            parent = (name, base_from_frame);
        }
        FrameTransforms { transforms }
    }

    fn shapes(&self) -> SceneUpdate {
        let links = self.arm.links.iter().enumerate().map(|(number, link)| {
            let shade = if number % 2 == 0 { 0.75 } else { 0.55 };
            let colour = Color { r: shade, g: shade, b: shade, a: 1.0 };
            self.entity(&format!("link:{}", link.name), &link.name, &link.shapes, colour)
        });
        let fixtures = self.arm.fixtures.iter().map(|Fixture { name, shape, .. }| {
            let colour = Color { r: 0.35, g: 0.45, b: 0.6, a: 0.5 };
            self.entity(&format!("fixture:{name}"), &self.root, std::slice::from_ref(shape), colour)
        });
        SceneUpdate { deletions: Vec::new(), entities: links.chain(fixtures).collect() }
    }

    fn entity(&self, id: &str, frame: &str, shapes: &[Shape], colour: Color) -> SceneEntity {
        let mut entity = SceneEntity {
            timestamp: Some(timestamp(self.now_ns)),
            frame_id: frame.to_owned(),
            id: id.to_owned(),
            frame_locked: true,
            ..SceneEntity::default()
        };
        let color = Some(colour);
        let ball = |at: &Pose, radius: f64| SpherePrimitive { pose: Some(pose(at)), size: Some(cube(2.0 * radius)), color };
        let cylinder = |at: &Pose, half_length: f64, radius: f64| CylinderPrimitive {
            pose: Some(pose(at)),
            size: Some(Vector3 { x: 2.0 * radius, y: 2.0 * radius, z: 2.0 * half_length }),
            bottom_scale: 1.0,
            top_scale: 1.0,
            color,
        };
        for Shape { link_from_shape, geometry } in shapes {
            match *geometry {
                Geometry::Capsule { half_length, radius } => {
                    entity.cylinders.push(cylinder(link_from_shape, half_length, radius));
                    for end in [-half_length, half_length] {
                        entity.spheres.push(ball(&(link_from_shape * nalgebra::Translation3::new(0.0, 0.0, end)), radius));
                    }
                }
                Geometry::Cylinder { half_length, radius } => {
                    entity.cylinders.push(cylinder(link_from_shape, half_length, radius));
                }
                Geometry::Sphere { radius } => entity.spheres.push(ball(link_from_shape, radius)),
                Geometry::Box { half_extents: [x, y, z] } => entity.cubes.push(CubePrimitive {
                    pose: Some(pose(link_from_shape)),
                    size: Some(Vector3 { x: 2.0 * x, y: 2.0 * y, z: 2.0 * z }),
                    color,
                }),
            }
        }
        entity
    }

    fn pose_in_frame(&self, pose: foxglove::messages::Pose) -> PoseInFrame {
        PoseInFrame { timestamp: Some(timestamp(self.now_ns)), frame_id: self.root.clone(), pose: Some(pose) }
    }

    fn poses_in_frame(&self, poses: Vec<foxglove::messages::Pose>) -> PosesInFrame {
        PosesInFrame { timestamp: Some(timestamp(self.now_ns)), frame_id: self.root.clone(), poses }
    }
}

/// Name of the frame that the chain starts from.
fn root(chain: &Chain) -> String {
    match chain.steps.first() {
        Some(Step::Frame { name }) => name.clone(),
        _ => "base".to_owned(),
    }
}

fn timestamp(ns: u64) -> Timestamp {
    let seconds = u32::try_from(ns / 1_000_000_000);
    seconds.ok().and_then(|seconds| Timestamp::new_checked(seconds, (ns % 1_000_000_000) as u32)).unwrap_or(Timestamp::MAX)
}

fn cube(edge: f64) -> Vector3 {
    Vector3 { x: edge, y: edge, z: edge }
}

fn pose(pose: &Pose) -> foxglove::messages::Pose {
    let (t, q) = (pose.translation.vector, pose.rotation.coords);
    foxglove::messages::Pose {
        position: Some(Vector3 { x: t.x, y: t.y, z: t.z }),
        orientation: Some(Quaternion { x: q.x, y: q.y, z: q.z, w: q.w }),
    }
}

/// The messages of one event.
struct Messages {
    event: u32,
    log_time_ns: u64,
    list: Vec<Message>,
}

impl Messages {
    fn push(&mut self, topic: Topic, data: Vec<u8>) {
        self.list.push(Message { topic, event: self.event, log_time_ns: self.log_time_ns, data });
    }

    fn protobuf(&mut self, topic: Topic, message: &impl prost::Message) {
        self.push(topic, message.encode_to_vec());
    }

    fn json<T: Source>(&mut self, topic: Topic, value: &T) -> Result<(), EncodeError> {
        let not_finite =
            |field: &str, reason: String| EncodeError::NotFinite { topic: topic.name(), field: field.to_owned(), reason };
        let data = value.to_json().map_err(|error| not_finite("a number", error.to_string()))?;
        // serde_json writes what is not finite as null without a word: reading back is the only check that sees all fields.
        match T::from_json(&data) {
            Ok(restored) if value.is_same(&restored) => {
                self.push(topic, data);
                Ok(())
            }
            Ok(_) => Err(not_finite("a number", "an optional one".to_owned())),
            Err(error) => {
                let text = String::from_utf8_lossy(&data[..error.column().min(data.len())]);
                let field = text.rsplit("\":").nth(1).and_then(|before| before.rsplit('"').next()).unwrap_or("a number");
                Err(not_finite(field, error.to_string()))
            }
        }
    }
}
