//! A serial arm from URDF.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{Matrix3, Point3, Translation3, Vector3};
use urdf_rs::JointType;

use super::locate::{DEEPEST, Element, Malformed, Outline, line_of, outline};
use super::plausible::too_large;
use super::rpy::{rotation_from_rpy, z_onto};
use super::{UrdfError, UrdfProblem};
use crate::arm::frames::Pose;
use crate::arm::{Arm, Geometry, Inertial, Link, Shape};
use crate::arm::{Chain, Joint, JointKind, Mimic, Step};

/// Radius of the ball whose inertia a link gets that has an impossible one, m.
const BALL_M: f64 = 0.05;

/// Joints beside the chain that are named.
const NAMED: usize = 6;

/// Largest number of an origin, m or rad, that is taken for meant.
const LARGEST: f64 = 1000.0;

/// An arm and what of its URDF could not be taken over as it stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Imported {
    /// The arm, without fixtures; gravity along −z of the base link.
    pub arm: Arm,
    /// Sentences for the user: meshes that were skipped, joints beside the chain that were frozen, and so on.
    pub notes: Vec<String>,
}

/// Reads the URDF file at `path`; see [`import`].
///
/// # Errors
/// If the file cannot be read or is not the URDF of a serial arm.
pub fn read(path: &Path, base_link: Option<&str>, tip_link: Option<&str>) -> Result<Imported, UrdfError> {
    let text = crate::files::text(path, crate::files::LARGEST_TEXT)
        .map_err(|source| UrdfError::Read { path: path.to_owned(), source })?;
    import(&text, &path.display().to_string(), base_link, tip_link)
}

/// The serial chain from `base_link` (default: the root) to `tip_link` (default: the only leaf) of the URDF `text`; `origin` is
/// what messages call it.
///
/// Parameters are the six of each moving joint's origin, `{joint}_x` … `{joint}_roll`, and last the six of the tool, `tool_x` …:
/// those of the last fixed joint before the tip, or zeros where the tip moves with the last joint. Other fixed joints are
/// exact. Frames are the base link, the child link of each moving joint, and the tip (`tool` where the tip is such a child).
/// Masses and shapes of links that are fixed to one another become one link; what hangs beside the chain on moving joints is
/// frozen at zero.
///
/// # Errors
/// If the text is no URDF, or the chain has joints other than revolute, continuous, prismatic and fixed, joints that mimic one beside the
/// chain, or if the links do not form a tree from base to tip. The message names the joint or link, the line and a remedy.
pub fn import(text: &str, origin: &str, base_link: Option<&str>, tip_link: Option<&str>) -> Result<Imported, UrdfError> {
    let outline = outline(text);
    foreign(text, origin, &outline)?;
    if let Err(Malformed { offset, found, deep: true }) = &outline {
        // The parser would walk down with its own stack.
        let elements: &[Element] = &[];
        let source = Source { text, origin, elements };
        let allowed = format!("elements within {DEEPEST} others at most");
        return Err(source.error(Some(line_of(text, *offset)), "", found, allowed, "give the URDF of an arm"));
    }
    let source = Source { text, origin, elements: outline.as_ref().map_or(&[], |outline| outline.elements.as_slice()) };
    let robot = urdf_rs::read_from_string(text).map_err(|error| source.parse_error(&error, &outline))?;
    let tree = Tree::of(&source, &robot)?;
    let (base, path) = tree.path(base_link, tip_link)?;
    Build::new(&tree, base, &path).run()
}

/// Refuses other descriptions of robots, by their names, with what makes a URDF of them.
fn foreign(text: &str, origin: &str, outline: &Result<Outline, Malformed>) -> Result<(), UrdfError> {
    let root =
        text.match_indices('<').map(|(at, _)| &text[at + 1..]).find(|rest| rest.starts_with(|c: char| c.is_ascii_alphabetic()));
    let tag = root.unwrap_or_default().split(|c: char| !c.is_ascii_alphanumeric()).next().unwrap_or_default();
    let begins = text.trim_start();
    let (found, remedy) = match tag {
        "mujoco" | "mujocoinclude" => (
            "an MJCF model (MuJoCo)",
            "convert it: pip install mjcf-urdf-simple-converter, then python -c 'from mjcf_urdf_simple_converter import convert; \
             convert(\"robot.xml\", \"robot.urdf\")'",
        ),
        "sdf" | "gazebo" => (
            "an SDF model (Gazebo)",
            "give the URDF or xacro that it was made of; if there is none, write one, joint by joint: only origins, axes and limits are needed",
        ),
        "COLLADA" => ("a COLLADA mesh", "give the URDF that uses it"),
        "robot" if outline.as_ref().is_ok_and(|outline| outline.elements.iter().any(|of| of.tag.starts_with("xacro:"))) => {
            ("a xacro", "expand it: pip install xacro, then xacro robot.urdf.xacro > robot.urdf")
        }
        "" if begins.starts_with("#usda") || begins.starts_with("PXR-USDC") => {
            ("a USD stage (Isaac Sim)", "export a URDF: in Isaac Sim, File > Export to URDF")
        }
        "" if begins.starts_with('{') => ("JSON", "give the robot as a URDF"),
        "" => ("no XML", "give the robot as a URDF; a xacro is expanded with: xacro robot.urdf.xacro > robot.urdf"),
        _ => return Ok(()),
    };
    let line = root.map(|root| line_of(text, text.len() - root.len()));
    Err(UrdfError::Invalid(Box::new(UrdfProblem {
        origin: origin.to_owned(),
        line,
        element: String::new(),
        found: found.to_owned(),
        allowed: "URDF: <robot> with <link>s and <joint>s".to_owned(),
        remedy: remedy.to_owned(),
    })))
}

struct Source<'a> {
    text: &'a str,
    origin: &'a str,
    /// Directly below the root; none where the text is no XML.
    elements: &'a [Element],
}

impl Source<'_> {
    fn error(
        &self,
        line: Option<usize>,
        element: impl Into<String>,
        found: impl Into<String>,
        allowed: impl Into<String>,
        remedy: impl Into<String>,
    ) -> UrdfError {
        UrdfError::Invalid(Box::new(UrdfProblem {
            origin: self.origin.to_owned(),
            line,
            element: element.into(),
            found: found.into(),
            allowed: allowed.into(),
            remedy: remedy.into(),
        }))
    }

    fn joint_error(&self, name: &str, found: impl Into<String>, allowed: &str, remedy: impl Into<String>) -> UrdfError {
        self.error(self.line("joint", name, 0), format!("joint {name:?}"), found, allowed, remedy)
    }

    fn link_error(&self, name: &str, found: impl Into<String>, allowed: &str, remedy: impl Into<String>) -> UrdfError {
        self.error(self.line("link", name, 0), format!("link {name:?}"), found, allowed, remedy)
    }

    /// Line of the `nth` element `tag` called `name`.
    fn line(&self, tag: &str, name: &str, nth: usize) -> Option<usize> {
        let mut named = self.elements.iter().filter(|element| element.tag == tag && element.name == name);
        Some(line_of(self.text, named.nth(nth)?.range.start))
    }

    /// The parser's error with the place that the parser does not tell.
    fn parse_error(&self, error: &urdf_rs::UrdfError, outline: &Result<Outline, Malformed>) -> UrdfError {
        let allowed = "URDF: <robot> with <link>s and <joint>s";
        let found = |error: &urdf_rs::UrdfError| error.to_string().replace('\n', ", ").replace("custom: ", "");
        let outline = match outline {
            Ok(outline) => outline,
            Err(malformed) => {
                let line = Some(line_of(self.text, malformed.offset));
                return self.error(line, "", malformed.found.clone(), "well-formed XML", "correct the file");
            }
        };
        // Each element alone in the robot: the first that is refused is the culprit.
        for element in outline.elements.iter().filter(|element| matches!(element.tag.as_str(), "link" | "joint")) {
            let alone = format!("{}{}</robot>", &self.text[outline.root.clone()], &self.text[element.range.clone()]);
            if let Err(error) = urdf_rs::read_from_string(&alone) {
                let line = Some(line_of(self.text, element.range.start));
                let allowed = format!("a <{}> as URDF defines it", element.tag);
                return self.error(
                    line,
                    format!("{} {:?}", element.tag, element.name),
                    found(&error),
                    allowed,
                    self.xacro_or("correct the element"),
                );
            }
        }
        self.error(None, "", found(error), allowed, self.xacro_or("correct the file"))
    }

    fn xacro_or(&self, remedy: &'static str) -> &'static str {
        let is_xacro = self.text.contains("<xacro:") || self.text.contains("${");
        if is_xacro { "expand the xacro first: pip install xacro, then xacro robot.urdf.xacro > robot.urdf" } else { remedy }
    }
}

/// Links and joints with their neighbours looked up.
struct Tree<'a> {
    source: &'a Source<'a>,
    robot: &'a urdf_rs::Robot,
    links: BTreeMap<&'a str, &'a urdf_rs::Link>,
    /// The joint above each link.
    above: BTreeMap<&'a str, &'a urdf_rs::Joint>,
    /// The joints below each link, in the file's order.
    below: BTreeMap<&'a str, Vec<&'a urdf_rs::Joint>>,
}

impl<'a> Tree<'a> {
    fn of(source: &'a Source<'a>, robot: &'a urdf_rs::Robot) -> Result<Self, UrdfError> {
        let mut tree = Tree { source, robot, links: BTreeMap::new(), above: BTreeMap::new(), below: BTreeMap::new() };
        for link in &robot.links {
            if tree.links.insert(&link.name, link).is_some() {
                let line = source.line("link", &link.name, 1);
                let element = format!("link {:?}", link.name);
                return Err(source.error(line, element, "two links of this name", "names that are unique", "rename one"));
            }
        }
        let mut joints: BTreeMap<&str, ()> = BTreeMap::new();
        for joint in &robot.joints {
            if joints.insert(&joint.name, ()).is_some() {
                let line = source.line("joint", &joint.name, 1);
                let element = format!("joint {:?}", joint.name);
                return Err(source.error(line, element, "two joints of this name", "names that are unique", "rename one"));
            }
            for (role, name) in [("parent", &joint.parent.link), ("child", &joint.child.link)] {
                if !tree.links.contains_key(name.as_str()) {
                    let found = format!("{role} link {name:?}, which is not in the file");
                    return Err(source.joint_error(
                        &joint.name,
                        found,
                        "names of links in the file",
                        format!("add <link name=\"{name}\"/>, or correct the name"),
                    ));
                }
            }
            if let Some(other) = tree.above.insert(&joint.child.link, joint) {
                let found = format!("child link {:?}, which is the child of joint {:?} too", joint.child.link, other.name);
                return Err(source.joint_error(
                    &joint.name,
                    found,
                    "one parent per link: a tree (closed kinematic loops are not supported)",
                    "cut the loop: give one of the joints another child link",
                ));
            }
            tree.below.entry(&joint.parent.link).or_default().push(joint);
        }
        for link in &robot.links {
            // Each link has at most one joint above it, so a walk that outlasts the joints goes round in a circle.
            let mut here = link.name.as_str();
            let mut left = robot.joints.len();
            while let Some(joint) = tree.above.get(here) {
                here = &joint.parent.link;
                if left == 0 {
                    let found = format!("a circle of joints: {here:?} is below itself");
                    return Err(source.joint_error(
                        &joint.name,
                        found,
                        "a tree",
                        "cut the loop: one link must be no joint's child",
                    ));
                }
                left -= 1;
            }
        }
        if robot.joints.is_empty() {
            let remedy = source.xacro_or("give a file with joints");
            return Err(source.error(None, "", "no joints", "an arm with at least one joint that moves", remedy));
        }
        Ok(tree)
    }

    fn unknown_link(&self, option: &str, name: &str) -> UrdfError {
        let names: Vec<&str> = self.robot.links.iter().map(|link| link.name.as_str()).collect();
        self.source.error(
            None,
            format!("{option} {name}"),
            format!("no link {name:?}"),
            names.join(", "),
            format!("give one of these to {option}"),
        )
    }

    /// The base link's name and the joints from there to the tip.
    fn path(&self, base: Option<&str>, tip: Option<&str>) -> Result<(&'a str, Vec<&'a urdf_rs::Joint>), UrdfError> {
        let known = |option: &str, name: &str| {
            self.links.get_key_value(name).map(|(name, _)| *name).ok_or_else(|| self.unknown_link(option, name))
        };
        let base = match base {
            Some(base) => known("--base-link", base)?,
            None => {
                let roots: Vec<&'a str> = self
                    .robot
                    .links
                    .iter()
                    .map(|link| link.name.as_str())
                    .filter(|name| !self.above.contains_key(name))
                    .collect();
                match roots.as_slice() {
                    [root] => *root,
                    [] => return Err(self.source.error(None, "", "no links", "links and joints", "give the URDF of an arm")),
                    [_, second, ..] => {
                        let found = format!("links that no joint connects: {}", roots.join(", "));
                        let remedy = "connect them with a joint, or say which is the base with --base-link";
                        let line = self.source.line("link", second, 0);
                        return Err(self.source.error(line, format!("link {second:?}"), found, "a tree with one root", remedy));
                    }
                }
            }
        };
        let tip = match tip {
            Some(tip) => known("--tip-link", tip)?,
            None => {
                let leaves = self.leaves(base);
                match leaves.as_slice() {
                    [leaf] => *leaf,
                    _ => {
                        let found = format!("several links where the chain may end: {}", leaves.join(", "));
                        let remedy = "say which one with --tip-link";
                        return Err(self.source.error(None, "", found, "one tip", remedy));
                    }
                }
            }
        };
        let mut joints = Vec::new();
        let mut link = tip;
        while link != base {
            let Some(joint) = self.above.get(link) else {
                let found = format!("no way from {base:?} to {tip:?}: {tip:?} hangs on {link:?}");
                return Err(self.source.link_error(
                    tip,
                    found,
                    "a tip below the base",
                    "choose another --tip-link or --base-link",
                ));
            };
            joints.push(*joint);
            link = &joint.parent.link;
        }
        joints.reverse();
        if joints.iter().all(|joint| joint.joint_type == JointType::Fixed) {
            let found = format!("no joint that moves between {base:?} and {tip:?}");
            return Err(self.source.link_error(
                tip,
                found,
                "a chain with at least one",
                "choose another --tip-link or --base-link",
            ));
        }
        Ok((base, joints))
    }

    /// Links without a link below them, below `base`.
    fn leaves(&self, base: &'a str) -> Vec<&'a str> {
        let mut leaves = Vec::new();
        let mut open = vec![base];
        while let Some(link) = open.pop() {
            match self.below.get(link) {
                Some(joints) => open.extend(joints.iter().rev().map(|joint| joint.child.link.as_str())),
                None => leaves.push(link),
            }
        }
        leaves
    }
}

/// A part of a rigid link: a URDF link at a pose in it.
struct Body<'a> {
    link_from_body: Pose,
    body: &'a urdf_rs::Link,
}

struct Build<'a> {
    tree: &'a Tree<'a>,
    path: &'a [&'a urdf_rs::Joint],
    base: &'a str,
    chain: Chain,
    /// Links of which meshes were skipped.
    with_meshes: Vec<String>,
    /// Joints beside the chain.
    frozen: Vec<&'a str>,
    notes: Vec<String>,
}

impl<'a> Build<'a> {
    fn new(tree: &'a Tree<'a>, base: &'a str, path: &'a [&'a urdf_rs::Joint]) -> Self {
        Build { tree, path, base, chain: Chain::new(), with_meshes: Vec::new(), frozen: Vec::new(), notes: Vec::new() }
    }

    fn run(mut self) -> Result<Imported, UrdfError> {
        let last_moving = self.path.iter().rposition(|joint| joint.joint_type != JointType::Fixed).unwrap_or(0);
        let mut links: Vec<(&'a str, Vec<Body<'a>>)> = vec![(self.base, Vec::new())];
        self.chain.frame(self.base);
        self.add_bodies(&mut links, self.base, Pose::identity())?;
        // From the last moving link to the URDF link that the walk has reached.
        let mut link_from_here = Pose::identity();
        for (index, joint) in self.path.iter().copied().enumerate() {
            let origin = self.origin(joint)?;
            let child = joint.child.link.as_str();
            if joint.joint_type == JointType::Fixed {
                let is_tool = index == self.path.len() - 1 && index > last_moving;
                if is_tool {
                    self.push_fixed(&link_from_here);
                    self.push_tool(*joint.origin.xyz, *joint.origin.rpy, child.to_owned());
                }
                link_from_here *= origin;
                self.add_bodies(&mut links, child, link_from_here)?;
                continue;
            }
            let (moving, axis) = self.moving(joint)?;
            self.push_fixed(&link_from_here);
            self.chain.six_parameters(&joint.name, *joint.origin.xyz, *joint.origin.rpy);
            let turn = z_onto(&axis);
            if axis == Vector3::z() {
                self.chain.joint(moving);
            } else {
                self.chain.steps.push(Step::Fixed(Pose::from_parts(Translation3::identity(), turn)));
                self.chain.joint(moving);
                self.chain.steps.push(Step::Fixed(Pose::from_parts(Translation3::identity(), turn.inverse())));
            }
            self.chain.frame(child);
            link_from_here = Pose::identity();
            links.push((child, Vec::new()));
            self.add_bodies(&mut links, child, link_from_here)?;
        }
        if last_moving == self.path.len() - 1 {
            let mut name = "tool".to_owned();
            while self.tree.links.contains_key(name.as_str()) {
                name.push('_');
            }
            self.push_tool([0.0; 3], [0.0; 3], name);
        }
        let links = links.into_iter().map(|(name, bodies)| self.link(name, &bodies)).collect::<Result<Vec<Link>, UrdfError>>()?;
        if !self.frozen.is_empty() {
            let more = if self.frozen.len() > NAMED { format!(" and {} more", self.frozen.len() - NAMED) } else { String::new() };
            let names: Vec<&str> = self.frozen.iter().take(NAMED).copied().collect();
            let (what, is) = if self.frozen.len() == 1 { ("joint", "is") } else { ("joints", "are") };
            self.notes.push(format!("{what} {}{more} {is} not in the chain, and frozen at 0", names.join(", ")));
        }
        if !self.with_meshes.is_empty() {
            let names = self.with_meshes.join(", ");
            self.notes.push(format!("meshes are skipped, so that collisions of these links are not seen: {names}"));
        }
        let without: Vec<&str> =
            links[1..].iter().filter(|link| link.inertial.is_none()).map(|link| link.name.as_str()).collect();
        if !without.is_empty() {
            self.notes.push(format!("no mass is known of {}: enough for kinematics, not for physics", without.join(", ")));
        }
        let robot = &self.tree.robot.name;
        let arm = Arm {
            name: if robot.is_empty() { "robot".to_owned() } else { robot.clone() },
            chain: self.chain,
            links,
            fixtures: Vec::new(),
            uncollidable: Vec::new(),
            gravity_in_base: Vector3::new(0.0, 0.0, -9.81),
        };
        if let Some((found, largest)) = too_large(&arm) {
            let remedy = "check the number: units of a URDF are m, rad and kg";
            return Err(self.tree.source.error(None, "", found, format!("{largest} at most"), remedy));
        }
        Ok(Imported { arm, notes: self.notes })
    }

    fn push_fixed(&mut self, pose: &Pose) {
        if *pose != Pose::identity() {
            self.chain.steps.push(Step::Fixed(*pose));
        }
    }

    fn push_tool(&mut self, xyz: [f64; 3], rpy: [f64; 3], frame: String) {
        // The names of parameters are unique: a joint called tool has taken these.
        let prefix = if self.chain.joints.iter().any(|joint| joint.name == "tool") { "tip" } else { "tool" };
        self.chain.six_parameters(prefix, xyz, rpy);
        self.chain.frame(frame);
    }

    fn origin(&self, joint: &urdf_rs::Joint) -> Result<Pose, UrdfError> {
        if joint.origin.xyz.iter().chain(joint.origin.rpy.iter()).all(|value| value.abs() <= LARGEST) {
            return Ok(pose(&joint.origin));
        }
        let found = format!("origin xyz {:?} rpy {:?}", *joint.origin.xyz, *joint.origin.rpy);
        Err(self.tree.source.joint_error(&joint.name, found, "finite numbers of 1000 (m, rad) at most", "correct the <origin>"))
    }

    /// A joint of the chain and the unit vector along its axis in its own frame.
    fn moving(&mut self, joint: &urdf_rs::Joint) -> Result<(Joint, Vector3<f64>), UrdfError> {
        let source = self.tree.source;
        let name = &joint.name;
        let mimic = match &joint.mimic {
            None => None,
            Some(of) => {
                let moving = |joint: &&&urdf_rs::Joint| joint.joint_type != JointType::Fixed;
                let place = self.path.iter().filter(moving).position(|joint| joint.name == of.joint);
                let Some(source) = place.filter(|_| of.joint != *name) else {
                    return Err(source.joint_error(
                        name,
                        format!("a joint in the chain that mimics {:?}, which is not in the chain", of.joint),
                        "joints that move independently, or with another one of the chain",
                        "end the chain before it with --tip-link, or remove <mimic> if it is driven on its own",
                    ));
                };
                let (multiplier, offset) = (of.multiplier.unwrap_or(1.0), of.offset.unwrap_or(0.0));
                self.notes
                    .push(format!("joint {name} is driven by {}: {multiplier} times its coordinate, plus {offset}", of.joint));
                Some(Mimic { joint: source, multiplier, offset })
            }
        };
        let kind = match joint.joint_type {
            JointType::Revolute | JointType::Continuous => JointKind::Revolute,
            JointType::Prismatic => JointKind::Prismatic,
            JointType::Fixed | JointType::Floating | JointType::Planar | JointType::Spherical => {
                let found = format!("a {} joint in the chain", format!("{:?}", joint.joint_type).to_lowercase());
                let remedy = "start the chain behind it with --base-link, or write it as single joints";
                return Err(source.joint_error(name, found, "revolute, continuous, prismatic, fixed", remedy));
            }
        };
        let axis = Vector3::from(*joint.axis.xyz);
        let length = axis.norm();
        if !(length.is_finite() && length > 1e-6) {
            let found = format!("axis {:?}", *joint.axis.xyz);
            return Err(source.joint_error(name, found, "a vector of some length, such as 0 0 1", "correct the <axis>"));
        }
        let (lower, upper) = if joint.joint_type == JointType::Continuous {
            self.notes.push(format!("joint {name} is continuous: its limits are taken as ±180°"));
            (-std::f64::consts::PI, std::f64::consts::PI)
        } else {
            (joint.limit.lower, joint.limit.upper)
        };
        let unit = if kind == JointKind::Revolute { "rad" } else { "m" };
        let (lower, upper) = if lower == 0.0 && upper == 0.0 {
            let (reach, said) = if kind == JointKind::Revolute { (std::f64::consts::PI, "±180°") } else { (1.0, "±1 m") };
            self.notes
                .push(format!("joint {name} has no limits: {said} is taken; a measured table does not need them, a design does"));
            (-reach, reach)
        } else {
            (lower, upper)
        };
        if !(lower.is_finite() && upper.is_finite() && lower < upper) {
            let found = format!("limits from {lower} to {upper} {unit}");
            return Err(source.joint_error(name, found, "finite limits, the lower one below the upper", "correct the <limit>"));
        }
        // Dividing by a length of one changes nothing, so (0, 0, 1) stays exact.
        Ok((Joint { name: name.clone(), kind, lower, upper, mimic }, axis / length))
    }

    /// Adds a URDF link to the last rigid link, and with it what hangs on it beside the chain.
    fn add_bodies(
        &mut self,
        links: &mut [(&'a str, Vec<Body<'a>>)],
        name: &'a str,
        link_from_body: Pose,
    ) -> Result<(), UrdfError> {
        let Some((_, bodies)) = links.last_mut() else { return Ok(()) };
        let mut open = vec![(name, link_from_body)];
        while let Some((name, link_from_body)) = open.pop() {
            if let Some(body) = self.tree.links.get(name) {
                bodies.push(Body { link_from_body, body });
            }
            for joint in self.tree.below.get(name).into_iter().flatten() {
                if self.path.iter().any(|on_path| on_path.name == joint.name) {
                    continue;
                }
                if joint.joint_type != JointType::Fixed {
                    self.frozen.push(&joint.name);
                }
                open.push((&joint.child.link, link_from_body * self.origin(joint)?));
            }
        }
        Ok(())
    }

    fn link(&mut self, name: &str, bodies: &[Body<'a>]) -> Result<Link, UrdfError> {
        let mut shapes = Vec::new();
        let mut masses: Vec<Inertial> = Vec::new();
        for Body { link_from_body, body } in bodies {
            shapes.extend(
                self.shapes(body)
                    .into_iter()
                    .map(|shape| Shape { link_from_shape: link_from_body * shape.link_from_shape, geometry: shape.geometry }),
            );
            if let Some(inertial) = self.inertial(body)? {
                masses.push(inertial.moved(link_from_body));
            }
        }
        let inertial = sum(&masses);
        // Rounded tables break the tensor; weight and where it acts are right all the same.
        let inertial = match inertial.as_ref().and_then(Inertial::impossible) {
            None => inertial,
            Some((found, _)) => {
                self.notes.push(format!(
                    "link {name}: {found} belong to no body; mass and centre are kept, with the inertia of a ball"
                ));
                inertial.map(|inertial| Inertial {
                    inertia_in_link: Matrix3::identity() * (0.4 * BALL_M * BALL_M * inertial.mass_kg),
                    ..inertial
                })
            }
        };
        Ok(Link { name: name.to_owned(), inertial, shapes })
    }

    fn inertial(&self, link: &urdf_rs::Link) -> Result<Option<Inertial>, UrdfError> {
        let urdf_rs::Inertial { origin, mass, inertia: i } = &link.inertial;
        let numbers = [mass.value, i.ixx, i.ixy, i.ixz, i.iyy, i.iyz, i.izz];
        if mass.value < 0.0 || !numbers.iter().chain(origin.xyz.iter()).chain(origin.rpy.iter()).all(|value| value.is_finite()) {
            let found = format!("mass {} kg, inertia {:?}", mass.value, &numbers[1..]);
            return Err(self.tree.source.link_error(
                &link.name,
                found,
                "finite numbers, a mass of 0 or more",
                "correct the <inertial>",
            ));
        }
        if mass.value == 0.0 {
            return Ok(None);
        }
        let inertia_in_body = Matrix3::new(i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz);
        let at_centre =
            Inertial { mass_kg: mass.value, centre_of_mass_in_link: Point3::origin(), inertia_in_link: inertia_in_body };
        Ok(Some(at_centre.moved(&pose(origin))))
    }

    /// Shapes in the URDF link's frame: its collision elements, or if it has none, what is drawn.
    fn shapes(&mut self, link: &urdf_rs::Link) -> Vec<Shape> {
        let elements: Vec<(&urdf_rs::Pose, &urdf_rs::Geometry)> = if link.collision.is_empty() {
            link.visual.iter().map(|visual| (&visual.origin, &visual.geometry)).collect()
        } else {
            link.collision.iter().map(|collision| (&collision.origin, &collision.geometry)).collect()
        };
        let mut shapes = Vec::new();
        let mut meshes = 0;
        for (origin, geometry) in elements {
            let geometry = match geometry {
                urdf_rs::Geometry::Box { size } => Geometry::Box { half_extents: size.map(|edge| edge / 2.0) },
                urdf_rs::Geometry::Cylinder { radius, length } => {
                    Geometry::Cylinder { half_length: length / 2.0, radius: *radius }
                }
                urdf_rs::Geometry::Capsule { radius, length } => Geometry::Capsule { half_length: length / 2.0, radius: *radius },
                urdf_rs::Geometry::Sphere { radius } => Geometry::Sphere { radius: *radius },
                urdf_rs::Geometry::Mesh { .. } => {
                    meshes += 1;
                    continue;
                }
            };
            let positive = match geometry {
                Geometry::Capsule { half_length, radius } | Geometry::Cylinder { half_length, radius } => {
                    vec![half_length, radius]
                }
                Geometry::Box { half_extents } => half_extents.to_vec(),
                Geometry::Sphere { radius } => vec![radius],
            };
            if !positive.iter().all(|size| size.is_finite() && *size > 0.0) {
                self.notes.push(format!("link {}: a shape of no extent is left out ({geometry:?})", link.name));
                continue;
            }
            shapes.push(Shape { link_from_shape: pose(origin), geometry });
        }
        if meshes > 0 {
            self.with_meshes.push(link.name.clone());
        }
        with_capsules(shapes)
    }
}

fn pose(origin: &urdf_rs::Pose) -> Pose {
    Pose::from_parts(Translation3::from(Vector3::from(*origin.xyz)), rotation_from_rpy(*origin.rpy))
}

/// Several masses of one rigid link as one (parallel axes).
fn sum(masses: &[Inertial]) -> Option<Inertial> {
    if let [] | [_] = masses {
        return masses.first().cloned();
    }
    let mass_kg: f64 = masses.iter().map(|part| part.mass_kg).sum();
    let centre =
        masses.iter().fold(Vector3::zeros(), |sum, part| sum + part.centre_of_mass_in_link.coords * part.mass_kg) / mass_kg;
    let inertia = masses.iter().fold(Matrix3::zeros(), |sum, part| {
        let arm = part.centre_of_mass_in_link.coords - centre;
        sum + part.inertia_in_link + (Matrix3::identity() * arm.norm_squared() - arm * arm.transpose()) * part.mass_kg
    });
    Some(Inertial { mass_kg, centre_of_mass_in_link: Point3::from(centre), inertia_in_link: inertia })
}

/// Cylinders that are followed by a sphere of their radius at either end are the capsules that [`super::export`] writes so.
fn with_capsules(shapes: Vec<Shape>) -> Vec<Shape> {
    let mut result = Vec::with_capacity(shapes.len());
    let mut rest = shapes.as_slice();
    while let Some((first, others)) = rest.split_first() {
        if let (Geometry::Cylinder { half_length, radius }, [low, high, after @ ..]) = (first.geometry, others) {
            let is_cap = |cap: &Shape, z: f64| {
                let end = first.link_from_shape * Point3::new(0.0, 0.0, z);
                cap.geometry == Geometry::Sphere { radius } && (cap.link_from_shape.translation.vector - end.coords).norm() < 1e-9
            };
            if is_cap(low, -half_length) && is_cap(high, half_length) {
                result
                    .push(Shape { link_from_shape: first.link_from_shape, geometry: Geometry::Capsule { half_length, radius } });
                rest = after;
                continue;
            }
        }
        result.push(first.clone());
        rest = others;
    }
    result
}
