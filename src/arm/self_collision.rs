//! Whether an arm touches itself or its cell in a configuration. The only module, besides the physics, that sees parry.

use nalgebra::Vector3;
use parry3d::math::{Pose as ParryPose, Rotation as ParryRotation, Vector as ParryVector};
use parry3d::query::details::closest_points_segment_segment_with_locations_nD as closest_on_segments;
use parry3d::query::intersection_test;
use parry3d::shape::{Capsule, Cuboid, Cylinder, SegmentPointLocation, Shape as ParryShape};

use crate::arm::ChainAt;
use crate::arm::frames::Pose;
use crate::arm::{Arm, Geometry, Shape};

/// Checks configurations of one arm. Links joined by a joint are never checked against each other, nor are the pairs that the arm
/// lists as uncollidable; every other pair of shapes is.
pub struct CollisionCheck {
    chain: ChainAt,
    /// Bodies: links that have shapes, by frame number, then the fixtures in base.
    bodies: Vec<Body>,
    /// Pairs of bodies to check, those that touch most often first.
    pairs: Vec<(usize, usize)>,
}

struct Body {
    name: String,
    /// Number of the chain's frame that carries the body; `None` for a fixture.
    frame: Option<usize>,
    shapes: Vec<Prepared>,
    /// Where its shapes stand among the placed shapes of all bodies.
    first: usize,
}

struct Prepared {
    /// Centre and radius of a ball around the shape, in the body's frame.
    centre: Vector3<f64>,
    radius: f64,
    kind: Kind,
}

enum Kind {
    /// A swept ball: the ends of its segment in the body's frame. Balls have both ends in one point.
    Round { a: Vector3<f64>, b: Vector3<f64>, radius: f64 },
    /// Anything else, with its axes in the body's frame.
    Other { body_from_shape: Pose, axes: [Vector3<f64>; 3], shape: Box<dyn ParryShape> },
}

/// Two bodies that touch.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Contact {
    /// A link.
    pub first: String,
    /// Another link or a fixture.
    pub second: String,
}

/// Memory for the checks of one thread.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    frames: Vec<Frame>,
    placed: Vec<Placed>,
}

/// A shape in base.
#[derive(Clone, Copy, Debug)]
struct Placed {
    centre: Vector3<f64>,
    /// Ends of a swept ball's segment; the centre twice for other shapes.
    a: Vector3<f64>,
    b: Vector3<f64>,
}

impl CollisionCheck {
    /// Prepares the check of `arm` at its nominal parameters.
    #[must_use]
    pub fn new(arm: &Arm) -> Self {
        let names = arm.chain.frame_names();
        let mut bodies = Vec::new();
        let mut link_of_body = Vec::new();
        for (index, link) in arm.links.iter().enumerate() {
            if link.shapes.is_empty() {
                continue;
            }
            let frame = names.iter().position(|name| *name == link.name);
            bodies.push(Body::new(link.name.clone(), frame, &link.shapes, &bodies));
            link_of_body.push(index);
        }
        let mut pairs = Vec::new();
        // Distant links meet more often than near ones, so that a colliding configuration is known soon.
        for distance in (2..arm.links.len()).rev() {
            for (first, first_link) in link_of_body.iter().enumerate() {
                for (second, second_link) in link_of_body.iter().enumerate().skip(first + 1) {
                    if second_link - first_link == distance && !arm.uncollidable.contains(&(*first_link, *second_link)) {
                        pairs.push((first, second));
                    }
                }
            }
        }
        for fixture in &arm.fixtures {
            let body = bodies.len();
            bodies.push(Body::new(fixture.name.clone(), None, std::slice::from_ref(&fixture.shape), &bodies));
            for (first, link) in link_of_body.iter().enumerate() {
                if !fixture.may_touch.contains(link) {
                    pairs.push((first, body));
                }
            }
        }
        CollisionCheck { chain: arm.chain.at_nominal(), bodies, pairs }
    }

    /// Whether any checked pair touches at `joints` (rad or m).
    #[must_use]
    pub fn collides(&self, joints: &[f64], scratch: &mut Scratch) -> bool {
        self.first_pair(joints, scratch).is_some()
    }

    /// The first checked pair that touches at `joints`.
    #[must_use]
    pub fn contact(&self, joints: &[f64]) -> Option<Contact> {
        self.first_pair(joints, &mut Scratch::default())
            .map(|(first, second)| Contact { first: self.bodies[first].name.clone(), second: self.bodies[second].name.clone() })
    }

    fn first_pair(&self, joints: &[f64], scratch: &mut Scratch) -> Option<(usize, usize)> {
        let Scratch { frames, placed } = scratch;
        frames.clear();
        self.chain.visit_frames(joints, |_, axes, origin| frames.push((*axes, *origin)));
        place(&self.bodies, frames, placed);
        self.pairs.iter().copied().find(|(first, second)| touch(&self.bodies[*first], &self.bodies[*second], frames, placed))
    }
}

impl Body {
    fn new(name: String, frame: Option<usize>, shapes: &[Shape], before: &[Body]) -> Self {
        let first = before.last().map_or(0, |body| body.first + body.shapes.len());
        Body { name, frame, shapes: shapes.iter().map(prepare).collect(), first }
    }
}

/// Every shape of `bodies` in base, once for all its pairs.
fn place(bodies: &[Body], frames: &[Frame], placed: &mut Vec<Placed>) {
    placed.clear();
    for body in bodies {
        let frame = frame_of(body, frames);
        placed.extend(body.shapes.iter().map(|shape| {
            let centre = to_base(&frame, &shape.centre);
            match &shape.kind {
                Kind::Round { a, b, .. } => Placed { centre, a: to_base(&frame, a), b: to_base(&frame, b) },
                Kind::Other { .. } => Placed { centre, a: centre, b: centre },
            }
        }));
    }
}

type Frame = ([Vector3<f64>; 3], Vector3<f64>);

fn frame_of(body: &Body, frames: &[Frame]) -> Frame {
    body.frame.map_or(([Vector3::x(), Vector3::y(), Vector3::z()], Vector3::zeros()), |frame| frames[frame])
}

fn to_base((axes, origin): &Frame, point: &Vector3<f64>) -> Vector3<f64> {
    origin + axes[0] * point.x + axes[1] * point.y + axes[2] * point.z
}

fn touch(first: &Body, second: &Body, frames: &[Frame], placed: &[Placed]) -> bool {
    first.shapes.iter().zip(&placed[first.first..]).any(|(one, one_at)| {
        second.shapes.iter().zip(&placed[second.first..]).any(|(other, other_at)| {
            let reach = one.radius + other.radius;
            (other_at.centre - one_at.centre).norm_squared() <= reach * reach
                && shapes_touch((one, one_at, first), (other, other_at, second), frames)
        })
    })
}

fn shapes_touch(
    (one, one_at, first): (&Prepared, &Placed, &Body),
    (other, other_at, second): (&Prepared, &Placed, &Body),
    frames: &[Frame],
) -> bool {
    if let (Kind::Round { radius, .. }, Kind::Round { radius: other_radius, .. }) = (&one.kind, &other.kind) {
        let (a, b) = (vector(&one_at.a), vector(&one_at.b));
        let (c, d) = (vector(&other_at.a), vector(&other_at.b));
        let (on_one, on_other) = closest_on_segments((&a, &b), (&c, &d));
        let reach = radius + other_radius;
        return (at(&on_one, a, b) - at(&on_other, c, d)).length_squared() <= reach * reach;
    }
    if apart_of_box(one, one_at, (other, other_at, second), frames) || apart_of_box(other, other_at, (one, one_at, first), frames)
    {
        return false;
    }
    let (one_frame, other_frame) = (&frame_of(first, frames), &frame_of(second, frames));
    let round;
    let (one_pose, one_shape) = match &one.kind {
        Kind::Round { a, b, radius } => {
            round = Capsule::new(vector(a), vector(b), *radius);
            (parry_pose(one_frame, &Pose::identity()), &round as &dyn ParryShape)
        }
        Kind::Other { body_from_shape, shape, .. } => (parry_pose(one_frame, body_from_shape), &**shape),
    };
    let other_round;
    let (other_pose, other_shape) = match &other.kind {
        Kind::Round { a, b, radius } => {
            other_round = Capsule::new(vector(a), vector(b), *radius);
            (parry_pose(other_frame, &Pose::identity()), &other_round as &dyn ParryShape)
        }
        Kind::Other { body_from_shape, shape, .. } => (parry_pose(other_frame, body_from_shape), &**shape),
    };
    // Every pair of these convex shapes is supported; where parry could not tell, the pair counts as touching.
    intersection_test(&one_pose, one_shape, &other_pose, other_shape).map_or(true, |answer| answer.intersecting)
}

/// Whether a swept ball lies beyond one face of a box: a cheap test that spares most of the calls for a floor.
fn apart_of_box(
    round: &Prepared,
    round_at: &Placed,
    (cuboid, cuboid_at, cuboid_body): (&Prepared, &Placed, &Body),
    frames: &[Frame],
) -> bool {
    let (Kind::Round { radius, .. }, Kind::Other { axes, shape, .. }) = (&round.kind, &cuboid.kind) else {
        return false;
    };
    let Some(half) = shape.as_cuboid().map(|cuboid| cuboid.half_extents) else {
        return false;
    };
    let (a, b) = (round_at.a - cuboid_at.centre, round_at.b - cuboid_at.centre);
    [half.x, half.y, half.z].into_iter().zip(axes).any(|(half, axis)| {
        let axis = match cuboid_body.frame {
            None => *axis,
            Some(_) => turn(&frame_of(cuboid_body, frames), axis),
        };
        let (along_a, along_b) = (axis.dot(&a), axis.dot(&b));
        along_a.min(along_b) - radius > half || along_a.max(along_b) + radius < -half
    })
}

fn turn((frame, _): &Frame, direction: &Vector3<f64>) -> Vector3<f64> {
    frame[0] * direction.x + frame[1] * direction.y + frame[2] * direction.z
}

fn at(location: &SegmentPointLocation, a: ParryVector, b: ParryVector) -> ParryVector {
    let [first, second] = location.barycentric_coordinates();
    a * first + b * second
}

fn vector(vector: &Vector3<f64>) -> ParryVector {
    ParryVector::new(vector.x, vector.y, vector.z)
}

fn parry_pose(frame: &Frame, body_from_shape: &Pose) -> ParryPose {
    let axes = nalgebra::Matrix3::from_columns(&frame.0);
    let pose = crate::arm::frames::pose_from_parts(&axes, &frame.1) * body_from_shape;
    let q = pose.rotation.quaternion();
    ParryPose::from_parts(vector(&pose.translation.vector), ParryRotation::from_xyzw(q.i, q.j, q.k, q.w))
}

fn other(body_from_shape: Pose, shape: Box<dyn ParryShape>) -> Kind {
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| body_from_shape.rotation * axis);
    Kind::Other { body_from_shape, axes, shape }
}

fn prepare(shape: &Shape) -> Prepared {
    let pose = shape.link_from_shape;
    let centre = pose.translation.vector;
    let along = pose.rotation * Vector3::z();
    match shape.geometry {
        Geometry::Capsule { half_length, radius } => Prepared {
            centre,
            radius: half_length + radius,
            kind: Kind::Round { a: centre - along * half_length, b: centre + along * half_length, radius },
        },
        Geometry::Sphere { radius } => Prepared { centre, radius, kind: Kind::Round { a: centre, b: centre, radius } },
        Geometry::Cylinder { half_length, radius } => {
            // parry's cylinder stands along y.
            let z_from_y = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
            let body_from_shape = Pose::from_parts(pose.translation, pose.rotation * z_from_y);
            let shape: Box<dyn ParryShape> = Box::new(Cylinder::new(half_length, radius));
            Prepared { centre, radius: libm::hypot(half_length, radius), kind: other(body_from_shape, shape) }
        }
        Geometry::Box { half_extents: [x, y, z] } => {
            let shape: Box<dyn ParryShape> = Box::new(Cuboid::new(ParryVector::new(x, y, z)));
            Prepared { centre, radius: Vector3::new(x, y, z).norm(), kind: other(pose, shape) }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::frames::rotation_from_vector;
    use crate::arm::mdh::{Frame as MdhFrame, chain};
    use crate::arm::{Fixture, Link};
    use crate::arm::{Joint, JointKind};
    use crate::seed::{Stream, stream};
    use nalgebra::Translation3;

    /// Three links of one shape each on parallel axes, 0.5 m apart along x.
    fn arm(shape: Geometry, at: Pose) -> Arm {
        let frames = [0.0, 0.5, 0.5, 0.5].map(|a| MdhFrame { a, ..MdhFrame::default() });
        let joints = (1..=3)
            .map(|index| Joint { name: format!("j{index}"), kind: JointKind::Revolute, lower: -3.1, upper: 3.1, mimic: None })
            .collect();
        let link = |name: &str, shapes| Link { name: name.to_owned(), inertial: None, shapes };
        let shape = Shape { link_from_shape: at, geometry: shape };
        Arm {
            name: "planar".to_owned(),
            chain: chain(&frames, joints, None, None),
            links: vec![
                link("base_link", Vec::new()),
                link("link1", vec![shape.clone()]),
                link("link2", Vec::new()),
                link("link3", vec![shape]),
            ],
            fixtures: Vec::new(),
            uncollidable: Vec::new(),
            gravity_in_base: Vector3::new(0.0, 0.0, -9.81),
        }
    }

    #[test]
    fn a_folded_arm_touches_itself_and_a_stretched_one_does_not() {
        let ball = Geometry::Sphere { radius: 0.1 };
        let check = CollisionCheck::new(&arm(ball, Pose::translation(0.25, 0.0, 0.0)));
        assert_eq!(check.contact(&[0.3, 0.0, 0.0]), None);
        // Joints 2 and 3 folded by 180°: the third link's ball lies on the first link's.
        let contact = check.contact(&[0.3, std::f64::consts::PI, std::f64::consts::PI]).unwrap();
        assert_eq!((contact.first.as_str(), contact.second.as_str()), ("link1", "link3"));
    }

    #[test]
    fn pairs_that_may_touch_are_not_checked() {
        let ball = Geometry::Sphere { radius: 0.1 };
        let mut planar = arm(ball, Pose::translation(0.25, 0.0, 0.0));
        planar.fixtures.push(Fixture {
            name: "post".to_owned(),
            shape: Shape { link_from_shape: Pose::identity(), geometry: Geometry::Box { half_extents: [0.2; 3] } },
            may_touch: Vec::new(),
        });
        let folded = [0.3, std::f64::consts::PI, 0.0];
        planar.uncollidable = vec![(1, 3)];
        assert_eq!(CollisionCheck::new(&planar).contact(&folded).unwrap().second, "post");
        planar.fixtures[0].may_touch = vec![1, 3];
        assert_eq!(CollisionCheck::new(&planar).contact(&folded), None);
    }

    fn geometry(stream: &mut Stream) -> Geometry {
        let mut size = || stream.uniform(0.02, 0.2);
        match [size(), size(), size()] {
            [a, b, c] if c < 0.065 => Geometry::Box { half_extents: [a, b, c] },
            [a, b, c] if c < 0.11 => Geometry::Capsule { half_length: a, radius: b / 2.0 },
            [a, b, c] if c < 0.155 => Geometry::Cylinder { half_length: a, radius: b },
            [a, ..] => Geometry::Sphere { radius: a },
        }
    }

    fn sample_surface(stream: &mut Stream, shape: &Shape, shrink: f64) -> Vector3<f64> {
        let direction = Vector3::from_fn(|_, _| stream.normal()).normalize();
        let local = match shape.geometry {
            Geometry::Sphere { radius } => direction * radius,
            Geometry::Capsule { half_length, radius } => {
                direction * radius + Vector3::z() * half_length * stream.uniform(-1.0, 1.0)
            }
            Geometry::Cylinder { half_length, radius } => {
                let across = Vector3::new(direction.x, direction.y, 0.0).normalize() * radius * stream.unit().sqrt();
                across + Vector3::z() * half_length * stream.uniform(-1.0, 1.0)
            }
            Geometry::Box { half_extents } => Vector3::from(half_extents.map(|half| half * stream.uniform(-1.0, 1.0))),
        };
        shape.link_from_shape * nalgebra::Point3::from(local * shrink * stream.unit().cbrt()) - nalgebra::Point3::origin()
    }

    fn contains(shape: &Shape, point: &Vector3<f64>) -> bool {
        let p = shape.link_from_shape.inverse_transform_point(&(*point).into()).coords;
        match shape.geometry {
            Geometry::Sphere { radius } => p.norm() <= radius,
            Geometry::Capsule { half_length, radius } => {
                (p - Vector3::z() * p.z.clamp(-half_length, half_length)).norm() <= radius
            }
            Geometry::Cylinder { half_length, radius } => p.xy().norm() <= radius && p.z.abs() <= half_length,
            Geometry::Box { half_extents } => (0..3).all(|axis| p[axis].abs() <= half_extents[axis]),
        }
    }

    /// Any point inside both shapes proves that they touch; two shapes whose centres are further apart than their bounding balls
    /// prove that they do not. In between, thousands of sampled points find nearly every overlap.
    #[test]
    fn shapes_of_every_kind_touch_where_they_share_a_point() {
        let mut stream = stream(11, "test/collision");
        let identity = ([Vector3::x(), Vector3::y(), Vector3::z()], Vector3::zeros());
        let (mut shared, mut missed) = (0, 0);
        for _ in 0..600 {
            let mut random = || {
                let turn = Vector3::from_fn(|_, _| stream.uniform(-2.0, 2.0));
                let at = Vector3::from_fn(|_, _| stream.uniform(-0.15, 0.15));
                let geometry = geometry(&mut stream);
                Shape { link_from_shape: Pose::from_parts(Translation3::from(at), rotation_from_vector(&turn)), geometry }
            };
            let (one, other) = (random(), random());
            let first = Body::new(String::new(), Some(0), std::slice::from_ref(&one), &[]);
            let second = Body::new(String::new(), Some(0), std::slice::from_ref(&other), std::slice::from_ref(&first));
            let (bodies, mut placed) = ([first, second], Vec::new());
            place(&bodies, &[identity], &mut placed);
            let answer = touch(&bodies[0], &bodies[1], &[identity], &placed);
            let found = (0..2000).any(|_| contains(&other, &sample_surface(&mut stream, &one, 1.0)));
            assert!(answer || !found, "{one:?} and {other:?} share a point but are said to be apart");
            shared += usize::from(found);
            missed += usize::from(answer && !found);
        }
        // Only slight overlaps escape the samples.
        assert!(shared > 200 && missed < 40, "{shared} overlaps found, {missed} claimed without proof");
    }
}
