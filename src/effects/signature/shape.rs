//! What an effect of unit magnitude does to the target: true pose = pose at the joint readings + effect, to first order.

use nalgebra::{Matrix3, Vector3};

use super::posture::Posture;

/// What an effect follows. Joints and links count from 0; link `i` moves with joint `i`. One column per number in brackets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// \[1\] A joint turns in proportion to the torque about it.
    Torque(usize),
    /// \[1\] A turn about a joint's origin in proportion to the moment across its axis.
    MomentAcross(usize),
    /// \[1\] A link bends as a beam from its joint to the next under the moment across its own direction, which may change along
    /// it: a turn in proportion to the mean moment, about where a beam turns.
    Beam(usize),
    /// \[1\] A joint is off by half a unit in the direction of its last move.
    Direction(usize),
    /// \[1\] A joint is off by half a unit in the direction of its torque.
    TorqueSign(usize),
    /// \[2\] Cosine and sine of so many times a joint's angle turn it.
    Harmonic(usize, f64),
    /// \[4\] Cosine and sine of a joint's angle, and of twice the angle, turn it.
    TwoHarmonics(usize),
    /// \[1\] A joint turns by the angle of another, or of its own.
    Ratio {
        /// The joint that errs.
        joint: usize,
        /// Whose angle counts.
        source: usize,
    },
    /// \[1\] A link grows with its temperature; all, and the foot, where there is none.
    Growth(Option<usize>),
    /// \[1\] All links grow with their temperatures, and the foot with that of the first link, or not at all.
    GrowthOnFoot {
        /// Whether the foot grows.
        grows: bool,
    },
    /// \[1\] A joint turns with the temperature of its link.
    Warmth(usize),
    /// \[1\] A shift along the force across a joint's axis. Friction of the fit holds what carries less than the share `held` of the
    /// force in the middle of its play.
    ForceAcrossSign {
        /// Joint.
        joint: usize,
        /// Share.
        held: f64,
    },
    /// \[1\] A turn along the moment across a joint's axis. Friction of the fit holds what carries less than the share `held` of the
    /// force times the length of the arm outboard.
    MomentAcrossSign {
        /// Joint.
        joint: usize,
        /// Share.
        held: f64,
    },
    /// \[1\] As [`Shape::TorqueSign`], where gravity is not along the nominal direction but leans (rad) towards an azimuth about the
    /// joint's axis: what decides the side that an upright joint's play is seated on.
    LeaningTorqueSign {
        /// The joint.
        joint: usize,
        /// rad, from the first axis across ([`across`]).
        azimuth: f64,
        /// Friction holds the play in the middle where the lever towards which gravity leans carries less than this share of the force
        /// times the length of the arm outboard.
        held: f64,
    },
    /// \[2\] A turn about a joint's origin: the moments about the x and y axes of its link bend it unequally.
    UnequalBend(usize),
    /// \[2\] A turn about a joint's origin: the moment across seats it, about the x and y axes of its link unequally.
    UnequalSeat(usize),
    /// \[2\] A shift: the force across a joint seats it, along the x and y axes of its link unequally.
    UnequalShift(usize),
    /// \[1\] A turn about a joint's origin along the moment across its axis, with the root of its size.
    RootAcross(usize),
    /// \[6\] A twist of the base over a course of time.
    BaseCourse(Course),
    /// \[3, 6 with orientations\] A twist of the tool over a course of time.
    ToolCourse(Course),
    /// \[6\] A twist of the base in proportion to time.
    BaseDrift,
    /// \[6\] A twist of the base from a row on.
    BaseStep(usize),
    /// \[3, 6 with orientations\] A twist of the tool from a row on.
    ToolStep(usize),
    /// \[1\] Positions in proportion to themselves.
    Scale,
    /// \[1\] A joint is off where its angle is near a value (rad), within a half width (rad): a raised cosine.
    Bump {
        /// The joint.
        joint: usize,
        /// rad.
        centre: f64,
        /// rad.
        half_width: f64,
    },
    /// \[3\] A joint turns with its angle, the square and the cube of it.
    AngleCurve(usize),
    /// \[[`MAP_ORDERS`]\] A joint is off by a free function of its angle: cosines over its travel.
    AngleMap {
        /// Joint.
        joint: usize,
        /// Smallest angle, rad.
        low: f64,
        /// Largest angle, rad.
        high: f64,
    },
    /// \[2\] The moments about the x and y axes of a joint's frame turn it about z; the frame is that of the moving side or of the
    /// side that the joint moves on.
    Crosstalk {
        /// The joint.
        joint: usize,
        /// The moving side.
        moving: bool,
    },
    /// \[2\] Torque, and its cube, turn a joint.
    Softening(usize),
    /// \[2\] Torque, and the root of its size with its sign, turn a joint.
    Hardening(usize),
    /// \[1\] The torque of past readings, forgotten over a time ([`FORGETTING_S`]), turns a joint.
    TorqueMemory(usize, usize),
    /// \[2\] All joints yield alike, to the torque and to that of a mass that the tool carries besides.
    AllYield,
    /// \[1\] The direction of the last move, times the size of the torque.
    DirectionLoad(usize),
    /// \[1\] The direction of the last move that was long enough fades with a joint's way: Dahl's memory of a way (rad).
    Memory(usize, f64),
    /// \[2\] A joint turns with time and its square.
    TimeCurve(usize),
}

/// How something goes with the share of the session that has passed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Course {
    /// From 0 to 1 about a moment, along a raised cosine that is so wide.
    Ramp {
        /// Middle, share of the session.
        centre: f64,
        /// Whole width, share of the session.
        width: f64,
    },
    /// There and back: half a sine.
    Return,
    /// In proportion.
    Steady,
}

impl Course {
    /// At the share `share` of the session.
    #[must_use]
    pub fn at(self, share: f64) -> f64 {
        use std::f64::consts::PI;
        match self {
            Course::Ramp { centre, width } => 0.5 * (1.0 + libm::sin(PI * ((share - centre) / width).clamp(-0.5, 0.5))),
            Course::Return => libm::sin(PI * share),
            Course::Steady => share,
        }
    }
}

/// A row of measurements as signatures see it.
#[derive(Clone, Debug)]
pub struct Reading {
    /// The configuration.
    pub posture: Posture,
    /// Coordinates, rad or m.
    pub joints: Vec<f64>,
    /// Which joints slide.
    pub slides: Vec<bool>,
    /// Target on the tool, in root, m.
    pub target: Vector3<f64>,
    /// Direction of each joint's last move; empty where unknown.
    pub approach: Vec<f64>,
    /// Rise of each link's temperature, K; empty where unknown.
    pub rise_k: Vec<f64>,
    /// Rise of the foot's temperature, K.
    pub foot_rise_k: f64,
    /// Share of the session that has passed.
    pub share: f64,
    /// Place in time.
    pub order: usize,
    /// Each joint's torque as it is remembered, by [`FORGETTING_S`], N·m.
    pub torque_memory: Vec<[f64; FORGETTING_S.len()]>,
    /// Free fall, m/s².
    pub gravity: Vector3<f64>,
    /// Memory of each joint's moves, by [`MEMORIES`].
    pub memory: Vec<[f64; MEMORIES.len()]>,
}

/// Ways (rad) over which a joint may forget.
pub const MEMORIES: [f64; 2] = [0.4, 1.2];

/// Cosines of a free map of a joint's angle.
pub const MAP_ORDERS: usize = 8;

/// Times (s) over which a joint may yield.
pub const FORGETTING_S: [f64; 3] = [25.0, 60.0, 150.0];

/// Displacement of the target: shift (m) and turn (rad), in root.
pub type Displacement = [f64; 6];

fn twist(shift: Vector3<f64>, turn: Vector3<f64>) -> Displacement {
    [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z]
}

impl Reading {
    /// Torque (N·m) or, where the joint slides, the force along it (N).
    fn effort(&self, joint: usize) -> f64 {
        if self.slides[joint] { self.posture.forces[joint].dot(&self.posture.axes[joint]) } else { self.posture.torque(joint) }
    }

    /// The joint moves by `amount`.
    #[must_use]
    pub fn moved(&self, joint: usize, amount: f64) -> Displacement {
        self.posture.moved(joint, self.slides[joint], &self.target).map(|value| value * amount)
    }

    /// Everything from the origin of `joint` on turns by the rotation vector `turn`.
    fn turned(&self, joint: usize, turn: Vector3<f64>) -> Displacement {
        twist(turn.cross(&(self.target - self.posture.origins[joint])), turn)
    }
}

impl Shape {
    /// The columns at `reading`. `orientation`: whether orientations are measured.
    #[must_use]
    pub fn columns(&self, reading: &Reading, orientation: bool) -> Vec<Displacement> {
        let posture = &reading.posture;
        match *self {
            Shape::Torque(joint) => vec![reading.moved(joint, reading.effort(joint))],
            Shape::MomentAcross(joint) => vec![reading.turned(joint, posture.moment_across(joint))],
            Shape::Beam(joint) => {
                let next = if joint + 1 < reading.joints.len() { posture.origins[joint + 1] } else { posture.tool };
                let along = next - posture.origins[joint];
                let square = along.norm_squared();
                // Too short to have a direction: a hinge.
                if square < 1e-6 {
                    return vec![reading.turned(joint, posture.moment_across(joint))];
                }
                let across = |moment: Vector3<f64>| moment - along * (along.dot(&moment) / square);
                // Its own weight is a small part of what it carries: the moment at its end is that at its root without the lever.
                let near = across(posture.moments[joint]);
                let far = across(posture.moments[joint] - along.cross(&posture.forces[joint]));
                let turn = (near + far) / 2.0;
                let bow = (near / 3.0 + far / 6.0).cross(&along);
                vec![twist(bow + turn.cross(&(reading.target - next)), turn)]
            }
            Shape::Direction(joint) => vec![reading.moved(joint, 0.5 * reading.approach[joint])],
            Shape::TorqueSign(joint) => {
                let effort = reading.effort(joint);
                let sigma = if reading.slides[joint] { posture.force_sigma(joint) } else { posture.moment_sigma(joint) };
                vec![reading.moved(joint, 0.5 * effort / libm::hypot(effort, sigma).max(1e-9))]
            }
            Shape::Harmonic(joint, order) => {
                let (sine, cosine) = libm::sincos(order * reading.joints[joint]);
                vec![reading.moved(joint, cosine), reading.moved(joint, sine)]
            }
            Shape::TwoHarmonics(joint) => {
                [1.0, 2.0].iter().flat_map(|order| Shape::Harmonic(joint, *order).columns(reading, orientation)).collect()
            }
            Shape::Ratio { joint, source } => vec![reading.moved(joint, reading.joints[source])],
            Shape::Growth(link) => {
                let count = reading.joints.len();
                let end = |link: usize| if link + 1 < count { posture.origins[link + 1] } else { reading.target };
                let grown = |link: usize| (end(link) - posture.origins[link]) * reading.rise_k[link];
                let shift = match link {
                    Some(link) => grown(link),
                    None => posture.origins[0] * reading.foot_rise_k + (0..count).map(grown).sum::<Vector3<f64>>(),
                };
                vec![twist(shift, Vector3::zeros())]
            }
            Shape::GrowthOnFoot { grows } => {
                let foot = if grows { reading.rise_k[0] } else { 0.0 };
                let change = posture.origins[0] * (foot - reading.foot_rise_k);
                let mut column = Shape::Growth(None).columns(reading, orientation)[0];
                for (value, change) in column.iter_mut().zip(change.iter()) {
                    *value += change;
                }
                vec![column]
            }
            Shape::Warmth(joint) => vec![reading.moved(joint, reading.rise_k[joint])],
            Shape::ForceAcrossSign { joint, held } => {
                let (load, sigma) = (posture.force_across(joint), posture.force_sigma(joint));
                vec![twist(seated(load, sigma, held * posture.forces[joint].norm()), Vector3::zeros())]
            }
            Shape::MomentAcrossSign { joint, held } => {
                let (load, sigma) = (posture.moment_across(joint), posture.moment_sigma(joint));
                vec![reading.turned(joint, seated(load, sigma, held * posture.forces[joint].norm() * posture.reaches[joint]))]
            }
            Shape::LeaningTorqueSign { joint, azimuth, held } => {
                // First moment of the mass outboard, across gravity; where gravity leans towards `lean` the torque follows `lean · lever`.
                let gravity = reading.gravity;
                let lever = gravity.cross(&posture.moments[joint]) / gravity.norm().max(1e-12);
                let (x, y) = across(&posture.axes[joint]);
                let lean = x * libm::cos(azimuth) + y * libm::sin(azimuth);
                let all = posture.forces[joint].norm() * posture.reaches[joint];
                let seat = seated(lean * lean.dot(&lever), LEAN_EDGE * lever.norm(), held * all);
                vec![reading.moved(joint, 0.5 * lean.dot(&seat))]
            }
            Shape::UnequalBend(joint) => {
                let moment = posture.moment_across(joint);
                across_link(posture, joint).map(|axis| reading.turned(joint, axis * axis.dot(&moment))).to_vec()
            }
            Shape::UnequalSeat(joint) => {
                let seat = seated(posture.moment_across(joint), posture.moment_sigma(joint), 0.0);
                across_link(posture, joint).map(|axis| reading.turned(joint, axis * axis.dot(&seat))).to_vec()
            }
            Shape::UnequalShift(joint) => {
                let seat = seated(posture.force_across(joint), posture.force_sigma(joint), 0.0);
                across_link(posture, joint).map(|axis| twist(axis * axis.dot(&seat), Vector3::zeros())).to_vec()
            }
            Shape::RootAcross(joint) => {
                let moment = posture.moment_across(joint);
                vec![reading.turned(joint, moment / libm::sqrt(moment.norm().max(1e-9)))]
            }
            Shape::BaseCourse(course) => base_twist(reading, course.at(reading.share)),
            Shape::ToolCourse(course) => tool_twist(reading, course.at(reading.share), orientation),
            Shape::BaseDrift => base_twist(reading, reading.share),
            Shape::BaseStep(row) => base_twist(reading, f64::from(u8::from(reading.order >= row))),
            Shape::ToolStep(row) => tool_twist(reading, f64::from(u8::from(reading.order >= row)), orientation),
            Shape::Scale => vec![twist(reading.target, Vector3::zeros())],
            Shape::Bump { joint, centre, half_width } => {
                let distance = (reading.joints[joint] - centre).abs() / half_width;
                let height = if distance < 1.0 { 0.5 * (1.0 + libm::cos(std::f64::consts::PI * distance)) } else { 0.0 };
                vec![reading.moved(joint, height)]
            }
            Shape::AngleCurve(joint) => {
                let angle = reading.joints[joint];
                [angle, angle * angle, angle * angle * angle / 3.0].map(|amount| reading.moved(joint, amount)).to_vec()
            }
            Shape::AngleMap { joint, low, high } => {
                let part = std::f64::consts::PI * (reading.joints[joint] - low) / (high - low).max(1e-9);
                (1..=MAP_ORDERS).map(|order| reading.moved(joint, libm::cos(order as f64 * part))).collect()
            }
            Shape::Crosstalk { joint, moving } => {
                let mut frame = posture.frames[joint];
                if !moving {
                    // Back by the joint's angle about z.
                    let (sine, cosine) = libm::sincos(reading.joints[joint]);
                    let (x, y): (Vector3<f64>, Vector3<f64>) = (frame.column(0).into(), frame.column(1).into());
                    frame = Matrix3::from_columns(&[x * cosine - y * sine, y * cosine + x * sine, posture.axes[joint]]);
                }
                [0, 1].map(|axis| reading.moved(joint, frame.column(axis).dot(&posture.moments[joint]))).to_vec()
            }
            Shape::Softening(joint) => {
                let effort = reading.effort(joint);
                vec![reading.moved(joint, effort), reading.moved(joint, effort * effort * effort / 1e4)]
            }
            Shape::Hardening(joint) => {
                let effort = reading.effort(joint);
                let root = 10.0 * libm::sqrt(effort.abs()) * effort.signum();
                vec![reading.moved(joint, effort), reading.moved(joint, root)]
            }
            Shape::TorqueMemory(joint, which) => vec![reading.moved(joint, reading.torque_memory[joint][which])],
            Shape::AllYield => {
                let joints = 0..reading.joints.len();
                let own: Vec<Displacement> = joints.clone().map(|joint| reading.moved(joint, reading.effort(joint))).collect();
                let of_mass = joints
                    .map(|joint| {
                        let axis = posture.axes[joint];
                        let lever = posture.tool - posture.origins[joint];
                        let force = reading.gravity;
                        let effort = if reading.slides[joint] { force.dot(&axis) } else { axis.dot(&lever.cross(&force)) };
                        reading.moved(joint, effort)
                    })
                    .collect::<Vec<_>>();
                let sum = |parts: Vec<Displacement>| {
                    parts.iter().fold([0.0; 6], |sum, part| std::array::from_fn(|at| sum[at] + part[at]))
                };
                vec![sum(own), sum(of_mass)]
            }
            Shape::DirectionLoad(joint) => {
                vec![reading.moved(joint, 0.5 * reading.approach[joint] * reading.effort(joint).abs())]
            }
            Shape::Memory(joint, way) => {
                let which = MEMORIES.iter().position(|known| *known == way).unwrap_or(0);
                vec![reading.moved(joint, reading.memory[joint][which])]
            }
            Shape::TimeCurve(joint) => {
                vec![reading.moved(joint, reading.share), reading.moved(joint, reading.share * reading.share)]
            }
        }
    }

    /// Whether nobody knows to which side this is seated at `reading`: the load is next to nothing, and friction or a base that is not
    /// level may decide.
    #[must_use]
    pub fn undecided(&self, reading: &Reading) -> bool {
        let posture = &reading.posture;
        let little = |load: f64, sigma: f64, all: f64| load < f64::max(4.0 * sigma, 0.02 * all);
        match *self {
            Shape::TorqueSign(joint) if reading.slides[joint] => {
                little(reading.effort(joint).abs(), posture.force_sigma(joint), posture.forces[joint].norm())
            }
            Shape::TorqueSign(joint) => {
                little(reading.effort(joint).abs(), posture.moment_sigma(joint), posture.moments[joint].norm())
            }
            Shape::LeaningTorqueSign { joint, .. } => {
                let [x, y, z, ..] = self.columns(reading, false)[0];
                let [a, b, c, ..] = reading.moved(joint, 0.5);
                Vector3::new(x, y, z).norm() < 0.9 * Vector3::new(a, b, c).norm()
            }
            Shape::ForceAcrossSign { joint, .. } => {
                little(posture.force_across(joint).norm(), posture.force_sigma(joint), posture.forces[joint].norm())
            }
            Shape::MomentAcrossSign { joint, .. } => {
                let reach = posture.forces[joint].norm() * posture.reaches[joint];
                little(posture.moment_across(joint).norm(), posture.moment_sigma(joint), reach)
            }
            _ => false,
        }
    }

    /// Number of columns.
    #[must_use]
    pub fn width(&self, orientation: bool) -> usize {
        match self {
            Shape::Harmonic(..)
            | Shape::Crosstalk { .. }
            | Shape::Softening(_)
            | Shape::Hardening(_)
            | Shape::UnequalBend(_)
            | Shape::UnequalSeat(_)
            | Shape::UnequalShift(_)
            | Shape::AllYield
            | Shape::TimeCurve(_) => 2,
            Shape::AngleCurve(_) => 3,
            Shape::TwoHarmonics(_) => 4,
            Shape::AngleMap { .. } => MAP_ORDERS,
            Shape::BaseDrift | Shape::BaseStep(_) | Shape::BaseCourse(_) => 6,
            Shape::ToolStep(_) | Shape::ToolCourse(_) => {
                if orientation {
                    6
                } else {
                    3
                }
            }
            _ => 1,
        }
    }
}

/// The direction of a load that seats something, as far as it is known: shorter than one where the load is as small as the `sigma` of
/// its components, so that a reading whose side nobody knows says little, and zero where friction up to `friction` holds.
fn seated(load: Vector3<f64>, sigma: f64, friction: f64) -> Vector3<f64> {
    let size = load.norm();
    // No fit's friction is known to better than some hundredths; neither is the load.
    let edge = libm::hypot(sigma, 0.15 * friction).max(1e-9);
    let free = if friction > 0.0 { (0.5 + 0.5 * (size - friction) / edge).clamp(0.0, 1.0) } else { 1.0 };
    load * free / libm::hypot(size, sigma).max(1e-9)
}

/// Share of the largest torque below which nobody knows on which side a leaning joint's play is seated: the azimuth of the lean is
/// known to half a step between those that are tried.
const LEAN_EDGE: f64 = 0.1;

/// Two directions across `axis` that do not turn with the joint.
#[must_use]
pub fn across(axis: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let other = if axis.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    let y = axis.cross(&other).normalize();
    (y.cross(axis), y)
}

/// The x and y axes of the frame that moves with `joint`.
fn across_link(posture: &Posture, joint: usize) -> [Vector3<f64>; 2] {
    [0, 1].map(|axis| posture.frames[joint].column(axis).into())
}

fn base_twist(reading: &Reading, factor: f64) -> Vec<Displacement> {
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| axis * factor);
    let shifts = axes.map(|axis| twist(axis, Vector3::zeros()));
    let turns = axes.map(|axis| twist(axis.cross(&reading.target), axis));
    [shifts, turns].concat()
}

fn tool_twist(reading: &Reading, factor: f64, orientation: bool) -> Vec<Displacement> {
    let lever = reading.target - reading.posture.tool;
    let axes = [0, 1, 2].map(|axis| Vector3::from(reading.posture.tool_axes.column(axis)) * factor);
    let mut columns = axes.map(|axis| twist(axis, Vector3::zeros())).to_vec();
    if orientation {
        columns.extend(axes.map(|axis| twist(axis.cross(&lever), axis)));
    }
    columns
}
