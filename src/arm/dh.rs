//! The Denavit–Hartenberg table of any chain, in the five-parameter modified convention of [`super::mdh`] (Chen et al. 2019, eq. 39).
//!
//! Between axes that are well apart in direction the common normal counts (Craig 2005, section 3.4), and β is zero. Between axes that are
//! nearly parallel the common normal is far away or nowhere: there d is zero and β takes up the angle (Hayati and Mirmirani 1985).

use nalgebra::{Rotation3, UnitQuaternion, Vector3};

use super::chain::{ChainAt, JointKind};
use super::frames::Pose;
use super::mdh::Frame;

/// Sine of the angle below which axes count as parallel: some three degrees.
const PARALLEL: f64 = 0.05;
/// A distance that is none, m.
const NO_DISTANCE: f64 = 1e-9;

/// The table of a chain: `base · T_1 · … · T_n · tool` with `T_i = Rot(x, α_i) Trans(x, a_i) Rot(z, θ_i) Trans(z, d_i) Rot(y, β_i)`; a joint's
/// coordinate adds to θ_i, or to d_i where it slides.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// From the chain's first frame to the one in which the first joint moves: its z axis is that joint's.
    pub base: Pose,
    /// One per joint, the first with α = a = 0.
    pub joints: Vec<Frame>,
    /// From the last joint's frame to the tool; its z axis is that joint's.
    pub tool: Pose,
}

/// The axis of a joint: a point on it and its direction.
struct Line {
    point: Vector3<f64>,
    direction: Vector3<f64>,
}

/// The table of `chain`, whose joints are of these `kinds`. Exact: it makes the same poses at all joint coordinates.
#[must_use]
pub fn table(chain: &ChainAt, kinds: &[JointKind]) -> Table {
    let segments = chain.segments();
    let mut at = Pose::identity();
    let mut lines = Vec::new();
    for segment in &segments[..kinds.len()] {
        at *= segment;
        lines.push(Line { point: at.translation.vector, direction: at.rotation * Vector3::z() });
    }
    at *= &segments[kinds.len()];
    let end = at;
    // The frame that has been reached: on the first axis, at the foot of the first frame's origin, x as near to that frame's as may be.
    let first = &lines[0];
    let foot = |line: &Line, from: &Vector3<f64>| line.point + line.direction * line.direction.dot(&(from - line.point));
    let upright = |z: &Vector3<f64>, x: Vector3<f64>| {
        let across = x - z * z.dot(&x);
        let x = if across.norm() > 1e-6 { across.normalize() } else { z.cross(&some_across(z)).normalize() };
        frame(&x, z)
    };
    let base = Pose::from_parts(foot(first, &Vector3::zeros()).into(), upright(&first.direction, Vector3::x()));
    let mut here = base;
    let mut joints = Vec::new();
    let mut before = Frame::default();
    for (number, line) in lines.iter().enumerate() {
        let mut row = Frame { alpha: before.alpha, a: before.a, ..Frame::default() };
        let Some(next) = lines.get(number + 1) else {
            joints.push(row);
            break;
        };
        let (z, to) = (line.direction, next.direction);
        let normal = z.cross(&to);
        // A slide has a direction and no place: its axis is where the frame is.
        let next = match kinds[number + 1] {
            JointKind::Prismatic => Line { point: here.translation.vector, direction: to },
            JointKind::Revolute => Line { point: next.point, direction: to },
        };
        let (origin, x, end_of_normal);
        if normal.norm() > PARALLEL {
            x = orient(normal.normalize(), &here);
            // Where the common normal meets both axes.
            let between = next.point - here.translation.vector;
            let square = normal.norm_squared();
            let along = between.cross(&to).dot(&normal) / square;
            let along_next = between.cross(&z).dot(&normal) / square;
            origin = here.translation.vector + z * along;
            end_of_normal = next.point + to * along_next;
            row.d = along;
        } else {
            origin = here.translation.vector;
            end_of_normal = foot(&next, &origin);
            let between = end_of_normal - origin;
            // Axes that are one: any direction across the next will do.
            let across = if between.norm() > NO_DISTANCE { between } else { here.rotation * Vector3::x() };
            x = upright(&to, across) * Vector3::x();
        }
        let local = here.rotation.inverse() * x;
        row.theta = libm::atan2(local.y, local.x);
        row.beta = -libm::asin(local.z.clamp(-1.0, 1.0));
        if normal.norm() > PARALLEL {
            row.beta = 0.0;
        }
        let turned = here.rotation * about(Vector3::z(), row.theta) * about(Vector3::y(), row.beta);
        let z_now = turned * Vector3::z();
        before = Frame {
            alpha: libm::atan2(x.dot(&z_now.cross(&to)), z_now.dot(&to)),
            a: x.dot(&(end_of_normal - origin)),
            ..Frame::default()
        };
        here = Pose::from_parts((origin + x * before.a).into(), turned * about(Vector3::x(), before.alpha));
        joints.push(row);
    }
    Table { base, joints, tool: here.inverse() * end }
}

/// Of the two directions of a normal, the one that turns `here` less: a table near to what its maker wrote.
fn orient(normal: Vector3<f64>, here: &Pose) -> Vector3<f64> {
    let local = here.rotation.inverse() * normal;
    if local.x < -1e-9 || (local.x.abs() <= 1e-9 && local.y < 0.0) { -normal } else { normal }
}

fn about(axis: Vector3<f64>, angle: f64) -> UnitQuaternion<f64> {
    super::frames::rotation_from_vector(&(axis * angle))
}

fn some_across(z: &Vector3<f64>) -> Vector3<f64> {
    if z.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() }
}

/// The turn to a frame with these axes.
fn frame(x: &Vector3<f64>, z: &Vector3<f64>) -> UnitQuaternion<f64> {
    let y = z.cross(x);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(nalgebra::Matrix3::from_columns(&[*x, y, *z])))
}

impl Table {
    /// As text, a line per joint between base and tool: mm and degrees. `names` of the joints.
    ///
    /// # Errors
    /// None in practice.
    pub fn csv(&self, names: &[&str], kinds: &[JointKind]) -> Result<String, csv::Error> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record(["joint", "moves", "alpha_deg", "a_mm", "theta_deg", "d_mm", "beta_deg"])?;
        for ((name, kind), row) in names.iter().zip(kinds).zip(&self.joints) {
            let moves = if *kind == JointKind::Revolute { "theta" } else { "d" };
            let numbers = [row.alpha.to_degrees(), row.a * 1e3, row.theta.to_degrees(), row.d * 1e3, row.beta.to_degrees()];
            let cells = [(*name).to_owned(), moves.to_owned()].into_iter().chain(numbers.map(|value| (value + 0.0).to_string()));
            writer.write_record(cells)?;
        }
        let bytes = writer.into_inner().map_err(|error| csv::Error::from(error.into_error()))?;
        let pose = |name: &str, pose: &Pose| {
            let [x, y, z] = (pose.translation.vector * 1e3).into();
            let (roll, pitch, yaw) = pose.rotation.euler_angles();
            let turns = [roll, pitch, yaw].map(f64::to_degrees);
            format!("# {name}: x {x} y {y} z {z} mm, roll {} pitch {} yaw {} deg\n", turns[0], turns[1], turns[2])
        };
        Ok(format!(
            "# Modified Denavit-Hartenberg, pose = base T_1 ... T_n tool with T_i = Rot(x, alpha) Trans(x, a) Rot(z, theta) Trans(z, d) Rot(y, beta)\n\
             {}{}{}",
            pose("base", &self.base),
            pose("tool", &self.tool),
            String::from_utf8_lossy(&bytes)
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::frames::pose_error;
    use crate::arm::mdh;
    use crate::arm::{Joint, urdf};
    use crate::seed::stream;

    /// The table, as eq. 39 has it, makes the poses of the chain: of all arms of the project, off as machining leaves them, and of frames drawn.
    #[test]
    fn the_table_makes_the_poses_of_the_chain() {
        let mut draws = stream(1, "test/dh");
        let mut chains = Vec::new();
        for file in crate::lab::reproduce::arms::arms().unwrap() {
            let chain = file.scene.arm.chain;
            let off: Vec<f64> = chain.nominal().iter().map(|value| value + 2e-3 * draws.normal()).collect();
            chains.push((chain.at_nominal(), chain.joints.clone()));
            chains.push((chain.at(&off), chain.joints));
        }
        let text = std::fs::read_to_string(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/arm8.urdf"));
        if let Ok(text) = text {
            let chain = urdf::import(&text, "arm8", None, None).unwrap().arm.chain;
            chains.push((chain.at_nominal(), chain.joints));
        }
        for (chain, joints) in chains {
            let kinds: Vec<JointKind> = joints.iter().map(|joint| joint.kind).collect();
            let table = table(&chain, &kinds);
            let named = |number: usize| Joint { name: format!("j{number}"), kind: kinds[number], ..joints[number].clone() };
            let frames: Vec<Frame> = table.joints.iter().copied().chain([Frame::default()]).collect();
            let again = mdh::chain(&frames, (0..kinds.len()).map(named).collect(), None, None).at_nominal();
            for _ in 0..20 {
                let at: Vec<f64> = joints.iter().map(|joint| draws.uniform(joint.lower, joint.upper)).collect();
                let error = pose_error(&(table.base * again.forward(&at) * table.tool), &chain.forward(&at));
                assert!(error.amax() < 1e-11, "{error} {table:?}");
            }
            // Numbers are those of an arm: no common normal far away.
            assert!(table.joints.iter().all(|row| row.a.abs() < 3.0 && row.d.abs() < 3.0), "{table:?}");
        }
    }
}
