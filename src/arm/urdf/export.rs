//! An arm as URDF.

use std::fmt::Write;

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::UrdfError;
use super::rpy::rpy_from_matrix;
use crate::arm::frames::Pose;
use crate::arm::{Arm, Geometry, Link, Shape};
use crate::arm::{Axis, Joint, JointKind, Step};

/// The arm at its nominal parameters as URDF text; see [`export_with`].
///
/// # Errors
/// If a nominal parameter is not finite.
pub fn export(arm: &Arm) -> Result<String, UrdfError> {
    export_with(arm, &arm.chain.nominal())
}

/// The arm at the parameters `values` (column order, SI) as URDF text: calibrated, for instance.
///
/// Every named frame of the chain is a link; joints keep names, kinds and limits, so a configuration means the same in both.
/// Origins of five-parameter chains hold the parameters themselves, `rpy = (α, β, θ)`; elsewhere angles are taken from the
/// product. A capsule, which few programs know, is written as a cylinder and two spheres. Fixtures belong to the cell, not to the
/// robot, and are left out. Efforts and velocities are placeholders.
///
/// # Errors
/// If there is not one finite value per parameter.
pub fn export_with(arm: &Arm, values: &[f64]) -> Result<String, UrdfError> {
    let parameters = &arm.chain.parameters;
    if values.len() != parameters.len() {
        return Err(UrdfError::ValueCount { found: values.len(), expected: parameters.len() });
    }
    if let Some((parameter, value)) = parameters.iter().zip(values).find(|(_, value)| !value.is_finite()) {
        return Err(UrdfError::NotFinite { name: parameter.name.clone(), value: *value });
    }
    let mut text = String::from("<?xml version=\"1.0\"?>\n");
    push(&mut text, format_args!("<robot name=\"{}\">\n", escaped(&arm.name)));
    text.push_str("  <!-- Written by kincal. Units: m, rad, kg. Efforts and velocities are placeholders. -->\n");
    let tree = Tree::of(arm, values);
    for name in &tree.links {
        match arm.links.iter().find(|link| link.name == *name) {
            Some(link) => push_link(&mut text, link),
            None => push(&mut text, format_args!("  <link name=\"{}\"/>\n", escaped(name))),
        }
    }
    for edge in &tree.edges {
        push_joint(&mut text, edge);
    }
    text.push_str("</robot>\n");
    Ok(text)
}

/// Writing to a `String` cannot fail.
fn push(text: &mut String, arguments: std::fmt::Arguments<'_>) {
    let _ = text.write_fmt(arguments);
}

/// Translation (m) and roll, pitch, yaw (rad).
struct Origin {
    xyz: Vector3<f64>,
    rpy: [f64; 3],
}

/// A joint of the URDF; fixed where `moves` is absent.
struct Edge {
    name: String,
    parent: String,
    child: String,
    origin: Origin,
    moves: Option<(Joint, Vector3<f64>)>,
}

struct Tree {
    links: Vec<String>,
    edges: Vec<Edge>,
}

impl Tree {
    fn of(arm: &Arm, values: &[f64]) -> Self {
        let taken: Vec<&str> = arm.chain.frame_names();
        let unused = |wanted: String| {
            let mut name = wanted;
            while taken.contains(&name.as_str()) {
                name.push('_');
            }
            name
        };
        let steps = &arm.chain.steps;
        let (root, steps) = match steps.split_first() {
            Some((Step::Frame { name }, rest)) => (name.clone(), rest),
            _ => (unused("base".to_owned()), steps.as_slice()),
        };
        let mut tree = Tree { links: vec![root], edges: Vec::new() };
        let mut before: Vec<&Step> = Vec::new();
        let mut moving: Option<(usize, Vec<&Step>)> = None;
        for step in steps {
            match step {
                Step::Frame { name } => {
                    tree.close(arm, values, &before, moving.as_ref(), name.clone());
                    before.clear();
                    moving = None;
                }
                Step::Joint { joint } => {
                    if let Some((earlier, after)) = moving.take() {
                        let name = unused(format!("{}_link", arm.chain.joints[earlier].name));
                        tree.close(arm, values, &before, Some(&(earlier, Vec::new())), name);
                        before = after;
                    }
                    moving = Some((*joint, Vec::new()));
                }
                other => match &mut moving {
                    Some((_, after)) => after.push(other),
                    None => before.push(other),
                },
            }
        }
        if moving.is_some() || !before.is_empty() {
            tree.close(arm, values, &before, moving.as_ref(), unused("tool".to_owned()));
        }
        tree
    }

    /// Adds the link `child`, reached from the last one by `before`, a joint's motion and what follows it.
    fn close(&mut self, arm: &Arm, values: &[f64], before: &[&Step], moving: Option<&(usize, Vec<&Step>)>, child: String) {
        let Some((joint, after)) = moving else {
            return self.add(format!("{child}_fixed"), child, origin(before, values), None);
        };
        let joint = arm.chain.joints[*joint].clone();
        let name = joint.name.clone();
        if after.is_empty() {
            return self.add(name, child, origin(before, values), Some((joint, Vector3::z())));
        }
        // An imported joint turns z onto its axis, moves, and turns back: nothing of that needs to be multiplied.
        if let ([early @ .., Step::Fixed(turn)], [Step::Fixed(back)]) = (before, after.as_slice())
            && turn.translation.vector == Vector3::zeros()
            && back.translation.vector == Vector3::zeros()
            && back.rotation == turn.rotation.inverse()
        {
            return self.add(name, child, origin(early, values), Some((joint, turn.rotation * Vector3::z())));
        }
        let (turned, shift) = product(after, values);
        if joint.kind == JointKind::Prismatic || (shift.x == 0.0 && shift.y == 0.0) {
            // The child's origin stays on the axis, so the joint can be given in the child's frame.
            let all: Vec<&Step> = before.iter().chain(after).copied().collect();
            return self.add(name, child, origin(&all, values), Some((joint, turned.transpose() * Vector3::z())));
        }
        let between = format!("{name}_link");
        self.add(name, between, origin(before, values), Some((joint, Vector3::z())));
        self.add(format!("{child}_fixed"), child, origin(after, values), None);
    }

    fn add(&mut self, name: String, child: String, origin: Origin, moves: Option<(Joint, Vector3<f64>)>) {
        let parent = self.links.last().cloned().unwrap_or_default();
        self.edges.push(Edge { name, parent, child: child.clone(), origin, moves });
        self.links.push(child);
    }
}

/// Rotation and translation of a sequence of steps without joints.
fn product(steps: &[&Step], values: &[f64]) -> (Matrix3<f64>, Vector3<f64>) {
    let mut rotation = Matrix3::identity();
    let mut translation = Vector3::zeros();
    for step in steps {
        match step {
            Step::Rotate { axis, parameter } => rotation *= rotation_about(*axis, values[*parameter]),
            Step::Translate { axis, parameter } => translation += rotation.column(*axis as usize) * values[*parameter],
            Step::Fixed(pose) => {
                translation += rotation * pose.translation.vector;
                rotation *= pose.rotation.to_rotation_matrix().into_inner();
            }
            Step::Joint { .. } | Step::Frame { .. } => {}
        }
    }
    (rotation, translation)
}

fn rotation_about(axis: Axis, angle: f64) -> Matrix3<f64> {
    let (sine, cosine) = libm::sincos(angle);
    let (first, second) = ((axis as usize + 1) % 3, (axis as usize + 2) % 3);
    let mut matrix = Matrix3::identity();
    matrix[(first, first)] = cosine;
    matrix[(second, second)] = cosine;
    matrix[(second, first)] = sine;
    matrix[(first, second)] = -sine;
    matrix
}

fn origin(steps: &[&Step], values: &[f64]) -> Origin {
    let (rotation, xyz) = product(steps, values);
    Origin { xyz, rpy: angles(steps, values).unwrap_or_else(|| rpy_from_matrix(&rotation)) }
}

/// Roll, pitch and yaw where the steps turn at most once about z, then y, then x: the very angles, none taken from a matrix.
fn angles(steps: &[&Step], values: &[f64]) -> Option<[f64; 3]> {
    let mut rpy = [0.0; 3];
    let mut free = 3;
    for step in steps {
        match step {
            Step::Rotate { axis, parameter } if (*axis as usize) < free => {
                free = *axis as usize;
                rpy[free] = values[*parameter];
            }
            Step::Fixed(pose) if pose.rotation == UnitQuaternion::identity() => {}
            Step::Translate { .. } => {}
            _ => return None,
        }
    }
    Some(rpy)
}

pub(super) fn escaped(name: &str) -> String {
    name.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Three numbers that read back as the same bits. Adding zero takes the sign off a zero.
fn three(values: [f64; 3]) -> String {
    values.map(|value| (value + 0.0).to_string()).join(" ")
}

fn origin_element(xyz: &Vector3<f64>, rpy: [f64; 3]) -> String {
    format!("<origin xyz=\"{}\" rpy=\"{}\"/>", three([xyz.x, xyz.y, xyz.z]), three(rpy))
}

fn push_link(text: &mut String, link: &Link) {
    if link.inertial.is_none() && link.shapes.is_empty() {
        return push(text, format_args!("  <link name=\"{}\"/>\n", escaped(&link.name)));
    }
    push(text, format_args!("  <link name=\"{}\">\n", escaped(&link.name)));
    if let Some(inertial) = &link.inertial {
        let i = &inertial.inertia_in_link;
        push(text, format_args!("    <inertial>\n"));
        push(text, format_args!("      {}\n", origin_element(&inertial.centre_of_mass_in_link.coords, [0.0; 3])));
        push(text, format_args!("      <mass value=\"{}\"/>\n", inertial.mass_kg));
        push(
            text,
            format_args!(
                "      <inertia ixx=\"{}\" ixy=\"{}\" ixz=\"{}\" iyy=\"{}\" iyz=\"{}\" izz=\"{}\"/>\n",
                i[(0, 0)],
                i[(0, 1)],
                i[(0, 2)],
                i[(1, 1)],
                i[(1, 2)],
                i[(2, 2)]
            ),
        );
        push(text, format_args!("    </inertial>\n"));
    }
    for element in ["visual", "collision"] {
        for shape in &link.shapes {
            for (pose, geometry) in primitives(shape) {
                let rotation = pose.rotation.to_rotation_matrix().into_inner();
                let origin = origin_element(&pose.translation.vector, rpy_from_matrix(&rotation));
                push(text, format_args!("    <{element}>{origin}<geometry>{geometry}</geometry></{element}>\n"));
            }
        }
    }
    push(text, format_args!("  </link>\n"));
}

/// The shape in primitives that URDF has always had.
fn primitives(shape: &Shape) -> Vec<(Pose, String)> {
    let pose = shape.link_from_shape;
    let cylinder = |half_length: f64, radius: f64| format!("<cylinder radius=\"{radius}\" length=\"{}\"/>", 2.0 * half_length);
    let sphere = |radius: f64| format!("<sphere radius=\"{radius}\"/>");
    match shape.geometry {
        Geometry::Capsule { half_length, radius } => {
            let cap = |z: f64| {
                let centre = pose * nalgebra::Point3::new(0.0, 0.0, z);
                (Pose::translation(centre.x, centre.y, centre.z), sphere(radius))
            };
            vec![(pose, cylinder(half_length, radius)), cap(-half_length), cap(half_length)]
        }
        Geometry::Cylinder { half_length, radius } => vec![(pose, cylinder(half_length, radius))],
        Geometry::Box { half_extents } => {
            vec![(pose, format!("<box size=\"{}\"/>", three(half_extents.map(|half| 2.0 * half))))]
        }
        Geometry::Sphere { radius } => vec![(pose, sphere(radius))],
    }
}

fn push_joint(text: &mut String, edge: &Edge) {
    let kind = match &edge.moves {
        None => "fixed",
        Some((Joint { kind: JointKind::Revolute, .. }, _)) => "revolute",
        Some((Joint { kind: JointKind::Prismatic, .. }, _)) => "prismatic",
    };
    push(text, format_args!("  <joint name=\"{}\" type=\"{kind}\">\n", escaped(&edge.name)));
    push(text, format_args!("    {}\n", origin_element(&edge.origin.xyz, edge.origin.rpy)));
    let (parent, child) = (escaped(&edge.parent), escaped(&edge.child));
    push(text, format_args!("    <parent link=\"{parent}\"/>\n    <child link=\"{child}\"/>\n"));
    if let Some((joint, axis)) = &edge.moves {
        push(text, format_args!("    <axis xyz=\"{}\"/>\n", three([axis.x, axis.y, axis.z])));
        let (lower, upper) = (joint.lower, joint.upper);
        push(text, format_args!("    <limit lower=\"{lower}\" upper=\"{upper}\" effort=\"1000\" velocity=\"10\"/>\n"));
    }
    push(text, format_args!("  </joint>\n"));
}
