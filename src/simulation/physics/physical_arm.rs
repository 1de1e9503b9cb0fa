//! The true arm, from commanded joint coordinates to a pose at rest.

use super::clearance::{Seat, SeatedBy};
use super::conditions::Conditions;
use super::coordinate::{Hold, Law, crept, tangent};
use super::error::PhysicsError;
use super::play::{Decision, Play};
use super::settling::{Settled, Settling, Start, Yield};
use super::static_seat::{static_loads, static_seats};
use super::true_arm::{Placement, TrueArm};
use super::world::{TIME_STEP_S, World, Yielded, indentation};
use crate::arm::Arm;
use crate::arm::frames::{Pose, rotation_vector};
use crate::simulation::effect::Effect;

/// An arm with its true parameters, as a multibody in rapier.
pub struct PhysicalArm {
    arm: TrueArm,
    settling: Settling,
    world: World,
}

/// How many steps a motor takes through the last part of its move where it has play.
const DRIVE_STEPS: usize = 3;

/// The friction that holds the output of a gear with backlash, relative to the load that it must hold.
const FRICTION_OVER_LOAD: f64 = 3.0;

/// Creep of which less than this share is left is forgotten.
const CREPT: f64 = 1e-5;

/// What does not change while one pose settles.
struct Task {
    placement: Placement,
    /// What decides the plays of joints, made once, so that a load near the threshold cannot let a coordinate go and hold it again.
    decisions: Vec<Decision>,
    /// The same for each coordinate that yields.
    by: Vec<SeatedBy>,
    /// Friction of each coordinate, N·m or N.
    friction: Vec<f64>,
    /// Way that the motor still has to go when the simulation begins, for each coordinate: signed, rad or m.
    ways: Vec<f64>,
    /// Where each coordinate stood at the end of the move, as far as it creeps.
    told: Vec<f64>,
    dwell_s: f64,
    /// The placement before anything has answered to the load.
    unloaded: Placement,
}

impl PhysicalArm {
    /// The arm `arm` whose chain has the values `parameters_true` (column order, SI) and to which `effects` happen. What a sensor
    /// does to its readings is not the arm's, and ignored.
    ///
    /// # Errors
    /// If a moving link has no inertial or an impossible one, a count is wrong, an effect is where the arm has no joint, or a number
    /// is out of range.
    pub fn new(arm: &Arm, parameters_true: &[f64], effects: &[Effect], settling: Settling) -> Result<Self, PhysicsError> {
        settling.check()?;
        let arm = TrueArm::new(arm, parameters_true, effects, settling.holding_ratio)?;
        let world = World::new(&arm);
        Ok(PhysicalArm { arm, settling, world })
    }

    /// Moves the joints as `conditions` say, lets the arm settle and returns its pose.
    ///
    /// A link's growth scales the translation from its joint to the next; centres of mass do not move with it.
    ///
    /// The result depends on the arguments alone, to the last bit, not on what was settled before.
    ///
    /// # Panics
    /// If there is not one coordinate per joint, or one temperature per link.
    pub fn settle(&mut self, conditions: &Conditions) -> Settled {
        let count = self.arm.joint_count();
        assert_eq!(conditions.joints.len(), count, "one coordinate per joint");
        assert_eq!(conditions.from.len(), count, "one coordinate per joint");
        assert_eq!(conditions.rise_k.len(), count + 1, "one temperature per link");
        let mut placement = self.arm.placement(conditions);
        let unloaded = placement.clone();
        let mut plays = vec![Play::CENTRE; count];
        let mut coordinates = vec![0.0; self.arm.coordinates.len()];
        let told = self.told(conditions);
        let first = self.holds(&coordinates, &[], &told, conditions.dwell_s, 0);
        self.world.place(&self.arm, &placement, &Yielded { plays: &plays, coordinates: &coordinates, holds: &first });
        let answers = !self.arm.reactions.is_none();
        if answers {
            self.arm.reactions.answer(&self.arm, &self.world, &unloaded, &mut placement);
            self.world.place(&self.arm, &placement, &Yielded { plays: &plays, coordinates: &coordinates, holds: &first });
        }
        let mut loads = self.world.loads();
        let mut turning = self.world.coordinate_loads();
        let decisions = self.arm.decisions(&loads, placement.payload_kg);
        let by = self.decided(&turning);
        let friction = self.friction(&turning);
        let mut task = Task {
            placement,
            decisions,
            by,
            friction,
            ways: vec![0.0; coordinates.len()],
            told,
            dwell_s: conditions.dwell_s,
            unloaded,
        };
        (task.ways, coordinates) = self.before_the_move(conditions);
        if self.settling.start == Start::Predicted && self.world.freedoms() > 0 {
            plays = self.predicted(&task);
        }
        let drives = task.ways.iter().any(|way| *way != 0.0);
        let least = if drives { DRIVE_STEPS + 1 } else { 1 };
        if self.world.freedoms() > 0 {
            self.put(&task, &plays, &coordinates, 0);
            loads = self.world.loads();
            turning = self.world.coordinate_loads();
        }
        let mut base_from_tool = self.world.base_from_tool();
        let (mut steps, mut moved_m, mut moved_rad) = (0, 0.0, 0.0);
        let mut converged = self.world.freedoms() == 0 && !answers;
        while !converged && steps < self.settling.steps_max.max(least) {
            if self.world.freedoms() > 0 {
                self.world.damp(&self.arm, &loads, &task.decisions);
                self.world.damp_coordinates(&self.arm, &turning, &task.by, &task.friction);
                self.world.step();
                plays = self.world.plays();
                coordinates = self.world.coordinates();
            }
            if answers {
                self.arm.reactions.answer(&self.arm, &self.world, &task.unloaded, &mut task.placement);
            }
            steps += 1;
            self.put(&task, &plays, &coordinates, steps);
            loads = self.world.loads();
            turning = self.world.coordinate_loads();
            let reached = self.world.base_from_tool();
            (moved_m, moved_rad) = distance(&reached, &base_from_tool);
            base_from_tool = reached;
            converged = steps >= least && moved_m < self.settling.tolerance_m && moved_rad < self.settling.tolerance_rad;
        }
        let standing =
            task.placement.base_shift.map_or(self.arm.base_from_base_link, |shift| shift * self.arm.base_from_base_link);
        let base_from_link = std::iter::once(standing)
            .chain((0..count).map(|joint| self.world.base_from_link(joint) * self.arm.joint_from_link[joint]))
            .collect();
        let seats = plays.iter().zip(&task.decisions).enumerate().map(|(joint, (play, by))| seat(joint, play, by)).collect();
        let yields = self.arm.coordinates.iter().zip(coordinates.iter().zip(&task.by)).map(|(coordinate, (value, by))| Yield {
            joint: coordinate.joint,
            effect: coordinate.law.name(coordinate.direction),
            value: *value,
            by: *by,
        });
        Settled {
            base_from_tool,
            base_from_link,
            settling_error_m: moved_m,
            settling_error_rad: moved_rad,
            steps,
            simulated_time_s: steps as f64 * TIME_STEP_S,
            converged,
            seats,
            yields: yields.collect(),
        }
    }

    /// Puts everything where `task` wants it after `steps` steps.
    fn put(&mut self, task: &Task, plays: &[Play], coordinates: &[f64], steps: usize) {
        let holds = self.holds(coordinates, &task.ways, &task.told, task.dwell_s, steps + 1);
        self.world.place(&self.arm, &task.placement, &Yielded { plays, coordinates, holds: &holds });
    }

    /// What holds each coordinate during step number `step`, from 1: a motor has then gone that part of its way.
    fn holds(&self, coordinates: &[f64], ways: &[f64], told: &[f64], dwell_s: f64, step: usize) -> Vec<Hold> {
        let hold = |(index, coordinate): (usize, &super::coordinate::Coordinate)| match coordinate.law {
            Law::Spring { stiffness } => Hold::Spring { stiffness, rest: 0.0 },
            Law::Compensated { stiffness } => Hold::Spring { stiffness, rest: -told[index] / stiffness },
            Law::Hardening { stiffness, cubic } => tangent(stiffness, cubic, coordinates[index]),
            Law::Creep { compliance, time_constant } => crept(compliance, time_constant, told[index], dwell_s),
            Law::LostMotion { half_width } => Hold::Between { lower: -half_width, upper: half_width },
            Law::Backlash { half_width } => {
                let left = 1.0 - step.min(DRIVE_STEPS) as f64 / DRIVE_STEPS as f64;
                let motor = -ways.get(index).copied().unwrap_or(0.0) * left;
                Hold::Between { lower: motor - half_width, upper: motor + half_width }
            }
        };
        self.arm.coordinates.iter().enumerate().map(hold).collect()
    }

    /// What decides where each coordinate rests under the loads `turning`.
    fn decided(&self, turning: &[f64]) -> Vec<SeatedBy> {
        let by = |(coordinate, load): (&super::coordinate::Coordinate, &f64)| match coordinate.law {
            Law::Backlash { .. } => SeatedBy::Friction,
            Law::LostMotion { .. } if load.abs() < self.arm.turn_holding(coordinate.joint) => SeatedBy::Friction,
            _ => SeatedBy::Load,
        };
        self.arm.coordinates.iter().zip(turning).map(by).collect()
    }

    /// The friction of each coordinate: more than gravity can overcome, as gears with friction are.
    fn friction(&self, turning: &[f64]) -> Vec<f64> {
        let friction = |(coordinate, load): (&super::coordinate::Coordinate, &f64)| match coordinate.law {
            Law::Backlash { .. } => FRICTION_OVER_LOAD * load.abs() + self.arm.turn_friction(coordinate.joint),
            _ => 0.0,
        };
        self.arm.coordinates.iter().zip(turning).map(friction).collect()
    }

    /// The way that the motor of each coordinate with backlash still has to go when the simulation begins, and where each coordinate
    /// then is. Only the last part of a move counts: from there on the output is pushed, wherever in the play it was.
    fn before_the_move(&self, conditions: &Conditions) -> (Vec<f64>, Vec<f64>) {
        let before = |coordinate: &super::coordinate::Coordinate| match coordinate.law {
            Law::Backlash { half_width } => {
                let moves = conditions.moves_backwards(coordinate.joint);
                let last = conditions.joints[coordinate.joint] - conditions.from[coordinate.joint];
                let way = last.clamp(-4.0 * half_width, 4.0 * half_width);
                // If the whole move is shorter than the play, what was before it decides.
                let seat = if way == last { seat_before(moves.skip(1), half_width) } else { 0.0 };
                (way, seat - way)
            }
            _ => (0.0, 0.0),
        };
        self.arm.coordinates.iter().map(before).unzip()
    }

    /// What each coordinate's law needs to be told of the conditions. Of one with a compensating servo, the load that this expects
    /// (N·m): the rigid arm's own, and the payload's as far as the cell knows it. Of one that creeps, where it stood at the end of the
    /// last move, after all that was before it in the session: at its beginning nothing has crept. Each stop is exact for its own
    /// load, without play; moves take no time.
    fn told(&self, conditions: &Conditions) -> Vec<f64> {
        let arrival = conditions.time_s - conditions.dwell_s;
        let told = |coordinate: &super::coordinate::Coordinate| {
            if let Law::Compensated { .. } = coordinate.law {
                let believed = Placement { payload_kg: conditions.payload_kg, ..self.arm.placement(conditions) };
                return static_loads(&self.arm, &believed, &vec![Play::CENTRE; self.arm.joint_count()])[coordinate.joint].along;
            }
            let Law::Creep { compliance, time_constant } = coordinate.law else {
                return 0.0;
            };
            let (mut state, mut kept, mut until_s) = (0.0, 1.0, arrival);
            for (index, stop) in conditions.history.iter().enumerate().rev() {
                let from_s = stop.time_s - stop.dwell_s;
                let earlier = Conditions {
                    joints: stop.joints,
                    from: stop.from,
                    payload_kg: stop.payload_kg,
                    time_s: stop.time_s,
                    dwell_s: stop.dwell_s,
                    history: &conditions.history[..index],
                    ..*conditions
                };
                let faded = libm::exp(-(until_s - from_s).max(0.0) / time_constant);
                let plays = vec![Play::CENTRE; self.arm.joint_count()];
                let loads = static_loads(&self.arm, &self.arm.placement(&earlier), &plays);
                state += kept * (1.0 - faded) * compliance * loads[coordinate.joint].along;
                kept *= faded;
                until_s = from_s;
                if kept < CREPT {
                    break;
                }
            }
            state
        };
        self.arm.coordinates.iter().map(told).collect()
    }

    /// Where statics puts the joints, pressed against the limits as rapier holds them.
    fn predicted(&self, task: &Task) -> Vec<Play> {
        let mut plays = static_seats(&self.arm, &task.placement, &task.decisions, 2);
        for play in &mut plays {
            play.radial *= indentation();
            play.axial *= indentation();
            play.tilt *= indentation();
        }
        plays
    }
}

/// Where the output lies in a play of `half_width` after the moves `backwards` (newest first; the middle before the first of them).
fn seat_before(backwards: impl Iterator<Item = (f64, f64)>, half_width: f64) -> f64 {
    let mut moves = Vec::new();
    for (from, to) in backwards {
        moves.push(to - from);
        // Whatever was before, this one has pushed the output along.
        if (to - from).abs() >= 2.0 * half_width {
            break;
        }
    }
    moves.iter().rev().fold(0.0, |seat: f64, moved| (seat - moved).clamp(-half_width, half_width))
}

fn seat(joint: usize, play: &Play, by: &Decision) -> Seat {
    Seat {
        joint,
        radial_in_joint: play.radial.into(),
        axial_in_joint: play.axial,
        tilt_in_joint: play.tilt.into(),
        radial_by: by.radial,
        axial_by: by.axial,
        tilt_by: by.tilt,
    }
}

/// How far `reached` is from `left`, in m and rad.
fn distance(reached: &Pose, left: &Pose) -> (f64, f64) {
    let shift = reached.translation.vector - left.translation.vector;
    (shift.norm(), rotation_vector(&(reached.rotation * left.rotation.inverse())).norm())
}

#[cfg(test)]
mod tests {
    use super::super::clearance::{Clearance, LARGEST_LENGTH_M, LARGEST_TILT_RAD, SeatedBy};
    use super::super::static_seat::{seats_about, static_loads};
    use super::super::test_arms;
    use super::*;
    use crate::arm::JointKind;
    use crate::arm::frames::pose_error;
    use crate::seed::{Stream, stream};
    use crate::simulation::effect::{Foot, Growing};
    use nalgebra::{Translation3, Vector2};

    /// Expansion of every link in these tests, 1/K.
    const EXPANSION: f64 = 1e-5;

    /// Clearances of the joints, and links that grow.
    fn effects(clearances: &[Clearance]) -> Vec<Effect> {
        let growth = [Effect::LinkThermalGrowth { of: Growing::Arm(Foot::Own), expansion: EXPANSION }];
        let of = |(joint, clearance): (usize, &Clearance)| Effect::Clearance {
            joint,
            radial: clearance.radial_m,
            axial: clearance.axial_m,
            tilt: clearance.tilt_rad,
            held: None,
        };
        growth.into_iter().chain(clearances.iter().enumerate().map(of)).collect()
    }

    fn rises(growth: &[f64]) -> Vec<f64> {
        growth.iter().map(|growth| (growth - 1.0) / EXPANSION).collect()
    }

    /// Settles at `joints` with links that have grown by `growth`.
    fn settle(physical: &mut PhysicalArm, joints: &[f64], growth: &[f64]) -> Settled {
        physical.settle(&Conditions::still(joints, &rises(growth)))
    }

    fn placement(arm: &TrueArm, joints: &[f64], growth: &[f64]) -> Placement {
        arm.placement(&Conditions::still(joints, &rises(growth)))
    }

    #[test]
    fn without_effects_it_is_forward_kinematics() {
        use JointKind::{Prismatic, Revolute};
        let mut stream = stream(1, "test/physics/forward");
        let mut worst: f64 = 0.0;
        for configuration in 0..200 {
            let kinds = if configuration % 2 == 0 {
                [Revolute; 8]
            } else {
                [Revolute, Revolute, Prismatic, Revolute, Prismatic, Revolute, Revolute, Revolute]
            };
            let arm = test_arms::arm(&kinds, configuration % 3 == 0);
            let parameters = test_arms::parameters_true(&arm, &mut stream);
            let joints = test_arms::configuration(&arm, &mut stream);
            let growth = test_arms::growth(&arm, &mut stream);
            let at = arm.chain.at(&parameters);
            // Where the arm stands does not grow, so that the foot begins at the base link.
            let standing = arm.chain.frame_names().iter().position(|frame| *frame == arm.links[0].name).unwrap();
            let base_from_foot = at.frames(&joints)[standing];
            let mut expected = base_from_foot;
            for (index, segment) in at.segments().iter().enumerate() {
                let segment = if index == 0 { base_from_foot.inverse() * segment } else { *segment };
                expected *= Pose::from_parts(Translation3::from(segment.translation.vector * growth[index]), segment.rotation);
                if let Some(q) = joints.get(index) {
                    expected *= match kinds[index] {
                        Revolute => Pose::rotation(nalgebra::Vector3::z() * *q),
                        Prismatic => Pose::translation(0.0, 0.0, *q),
                    };
                }
            }
            let mut physical = PhysicalArm::new(&arm, &parameters, &effects(&[]), Settling::default()).unwrap();
            let settled = settle(&mut physical, &joints, &growth);
            worst = worst.max(pose_error(&settled.base_from_tool, &expected).amax());
            assert!(settled.converged && settled.steps == 0);
            let still = settle(&mut physical, &joints, &[1.0; 9]);
            worst = worst.max(pose_error(&still.base_from_tool, &at.forward(&joints)).amax());
            for (link, name) in arm.links.iter().zip(&still.base_from_link) {
                let frame = arm.chain.frame_names().iter().position(|frame| *frame == link.name).unwrap();
                worst = worst.max(pose_error(name, &at.frames(&joints)[frame]).amax());
            }
        }
        println!("worst deviation from forward kinematics: {worst:e}");
        assert!(worst < 1e-9);
    }

    const KINDS: [(&str, Clearance); 4] = [
        ("radial", Clearance { radial_m: 60e-6, axial_m: 0.0, tilt_rad: 0.0 }),
        ("axial", Clearance { radial_m: 0.0, axial_m: 60e-6, tilt_rad: 0.0 }),
        ("tilt", Clearance { radial_m: 0.0, axial_m: 0.0, tilt_rad: 200e-6 }),
        ("all", Clearance { radial_m: 60e-6, axial_m: 60e-6, tilt_rad: 200e-6 }),
    ];

    fn fractions(largest: Clearance, stream: &mut Stream) -> Vec<Clearance> {
        let mut fraction = || stream.uniform(0.2, 1.0);
        (0..8)
            .map(|_| Clearance {
                radial_m: fraction() * largest.radial_m,
                axial_m: fraction() * largest.axial_m,
                tilt_rad: fraction() * largest.tilt_rad,
            })
            .collect()
    }

    fn mixed(configuration: usize) -> Arm {
        use JointKind::{Prismatic, Revolute};
        let slide = if configuration.is_multiple_of(2) { Prismatic } else { Revolute };
        test_arms::arm(
            &[Revolute, Revolute, slide, Revolute, Revolute, slide, Revolute, Revolute],
            configuration.is_multiple_of(3),
        )
    }

    #[test]
    fn cold_seats_are_those_of_the_linear_programme() {
        for (name, largest) in KINDS {
            let mut stream = stream(2, &format!("test/physics/seats/{name}"));
            let (mut first_m, mut first_rad, mut last_m, mut last_rad): (f64, f64, f64, f64) = (0.0, 0.0, 0.0, 0.0);
            let mut steps_all = 0;
            let (mut steps, mut error_m, mut error_rad, mut decided, mut held): (usize, f64, f64, usize, usize) =
                (0, 0.0, 0.0, 0, 0);
            for configuration in 0..300 {
                let arm = mixed(configuration);
                let parameters = test_arms::parameters_true(&arm, &mut stream);
                let clearances = fractions(largest, &mut stream);
                let joints = test_arms::configuration(&arm, &mut stream);
                let growth = test_arms::growth(&arm, &mut stream);
                let settling = Settling { start: Start::Centre, ..Settling::default() };
                let settled =
                    settle(&mut PhysicalArm::new(&arm, &parameters, &effects(&clearances), settling).unwrap(), &joints, &growth);
                assert!(settled.converged);
                steps = steps.max(settled.steps);
                steps_all += settled.steps;
                error_m = error_m.max(settled.settling_error_m);
                error_rad = error_rad.max(settled.settling_error_rad);
                // The oracle holds nothing: every load decides.
                let oracle = TrueArm::new(&arm, &parameters, &effects(&clearances), 1e-12).unwrap();
                let placed = placement(&oracle, &joints, &growth);
                let all = oracle.decisions(&static_loads(&oracle, &placed, &[Play::CENTRE; 8]), placed.payload_kg);
                let first = static_seats(&oracle, &placed, &all, 1);
                let last = seats_about(&oracle, &placed, &all, &plays(&settled));
                for (seat, (first, last)) in settled.seats.iter().zip(first.iter().zip(&last)) {
                    let mut compare = |by, ours: Vector2<f64>, first: Vector2<f64>, last: Vector2<f64>, tilt| match by {
                        SeatedBy::Fit => assert_eq!(ours, Vector2::zeros()),
                        SeatedBy::Friction => {
                            held += 1;
                            assert!(ours.norm() < 1e-15, "{name}: an undecided coordinate went to {ours}");
                        }
                        SeatedBy::Load => {
                            decided += 1;
                            let (worst_first, worst_last) =
                                if tilt { (&mut first_rad, &mut last_rad) } else { (&mut first_m, &mut last_m) };
                            *worst_first = worst_first.max((ours - first).norm());
                            *worst_last = worst_last.max((ours - last).norm());
                        }
                    };
                    compare(seat.radial_by, seat.radial_in_joint.into(), first.radial, last.radial, false);
                    let along = |x| Vector2::new(x, 0.0);
                    compare(seat.axial_by, along(seat.axial_in_joint), along(first.axial), along(last.axial), false);
                    compare(seat.tilt_by, seat.tilt_in_joint.into(), first.tilt, last.tilt, true);
                }
            }
            println!(
                "{name}: against the programme about the middle {first_m:.2e} m, {first_rad:.2e} rad, about the seat {last_m:.2e} m, \
                 {last_rad:.2e} rad; {decided} decided, {held} held; at most {steps} steps ({} on average), settling error {error_m:.1e} m, \
                 {error_rad:.1e} rad",
                steps_all as f64 / 300.0
            );
            assert!(first_m < 1e-6 && first_rad < 1e-6, "{name}: {first_m:e} m, {first_rad:e} rad");
            assert!(last_m < 1e-9 && last_rad < 1e-7, "{name}: {last_m:e} m, {last_rad:e} rad");
        }
    }

    #[test]
    fn no_other_seat_has_less_potential_energy() {
        let mut stream = stream(3, "test/physics/energy");
        for configuration in 0..20 {
            let mut arm = mixed(configuration);
            arm.gravity_in_base = nalgebra::Vector3::new(stream.uniform(-5.0, 5.0), stream.uniform(-5.0, 5.0), -8.0);
            let parameters = test_arms::parameters_true(&arm, &mut stream);
            let clearances = fractions(KINDS[3].1, &mut stream);
            let joints = test_arms::configuration(&arm, &mut stream);
            let settling = Settling { start: Start::Centre, ..Settling::default() };
            let settled =
                settle(&mut PhysicalArm::new(&arm, &parameters, &effects(&clearances), settling).unwrap(), &joints, &[1.0; 9]);
            let segments = arm.chain.at(&parameters).segments();
            let energy = |plays: &[Play]| {
                let mut base_from_link = Pose::identity();
                let mut energy = 0.0;
                for (joint, q) in joints.iter().enumerate() {
                    let turn = Pose::rotation(nalgebra::Vector3::z() * *q);
                    let (before, after) = match arm.chain.joints[joint].kind {
                        JointKind::Revolute => (Pose::identity(), turn),
                        JointKind::Prismatic => (Pose::translation(0.0, 0.0, *q), Pose::identity()),
                    };
                    base_from_link = base_from_link * segments[joint] * before * plays[joint].pose() * after;
                    let inertial = arm.links[joint + 1].inertial.as_ref().unwrap();
                    let centre = base_from_link * inertial.centre_of_mass_in_link;
                    energy -= inertial.mass_kg * arm.gravity_in_base.dot(&centre.coords);
                }
                energy
            };
            let rest = plays(&settled);
            for (play, clearance) in rest.iter().zip(&clearances) {
                let allowed = 1.0 + 1e-9;
                assert!(play.radial.norm() <= allowed * clearance.radial_m && play.tilt.norm() <= allowed * clearance.tilt_rad);
                assert!(play.axial.abs() <= allowed * clearance.axial_m);
            }
            let mut disc = |radius: f64, by, at: Vector2<f64>| {
                let (angle, share) = (stream.uniform(0.0, 6.3), stream.unit());
                // Half of the samples are anywhere, half on the edge near the seat, where the energy is flattest.
                let near = nalgebra::Rotation2::new(0.01 * stream.normal()) * at;
                let anywhere = Vector2::new(angle.cos(), angle.sin()) * radius * share.sqrt();
                if by != SeatedBy::Load {
                    at
                } else if stream.unit() < 0.5 {
                    near
                } else {
                    anywhere
                }
            };
            for _ in 0..2000 {
                let other: Vec<Play> = settled
                    .seats
                    .iter()
                    .zip(rest.iter().zip(&clearances))
                    .map(|(seat, (rest, clearance))| Play {
                        radial: disc(clearance.radial_m, seat.radial_by, rest.radial),
                        axial: disc(clearance.axial_m, seat.axial_by, Vector2::new(rest.axial, 0.0)).x,
                        tilt: disc(clearance.tilt_rad, seat.tilt_by, rest.tilt),
                    })
                    .collect();
                // The differences are 1e-7 J and more; 1e-12 J is the rounding of about 60 J.
                assert!(energy(&other) > energy(&rest) - 1e-12, "{:e} J lower", energy(&rest) - energy(&other));
            }
        }
    }

    #[test]
    fn the_same_arguments_give_the_same_bits() {
        let mut stream = stream(4, "test/physics/determinism");
        let arm = mixed(0);
        let parameters = test_arms::parameters_true(&arm, &mut stream);
        let clearances = fractions(KINDS[3].1, &mut stream);
        let configurations: Vec<Vec<f64>> = (0..20).map(|_| test_arms::configuration(&arm, &mut stream)).collect();
        for start in [Start::Centre, Start::Predicted] {
            let fresh =
                || PhysicalArm::new(&arm, &parameters, &effects(&clearances), Settling { start, ..Settling::default() }).unwrap();
            let settle = |physical: &mut PhysicalArm, joints: &Vec<f64>| bits(&settle(physical, joints, &[1.0; 9]));
            let alone: Vec<_> = configurations.iter().map(|joints| settle(&mut fresh(), joints)).collect();
            let mut used = fresh();
            let in_order: Vec<_> = configurations.iter().map(|joints| settle(&mut used, joints)).collect();
            let mut backwards: Vec<_> = configurations.iter().rev().map(|joints| settle(&mut used, joints)).collect();
            backwards.reverse();
            let threads: Vec<_> = std::thread::scope(|scope| {
                let spawn = |joints| {
                    let mut moved = fresh();
                    scope.spawn(move || settle(&mut moved, joints))
                };
                let handles: Vec<_> = configurations.iter().map(spawn).collect();
                handles.into_iter().map(|handle| handle.join().unwrap()).collect()
            });
            assert_eq!(alone, in_order);
            assert_eq!(alone, backwards);
            assert_eq!(alone, threads);
        }
    }

    #[test]
    fn the_settling_error_bounds_what_is_left() {
        let mut stream = stream(5, "test/physics/error");
        for configuration in 0..40 {
            let arm = mixed(configuration);
            let parameters = test_arms::parameters_true(&arm, &mut stream);
            let clearances = fractions(KINDS[3].1, &mut stream);
            let joints = test_arms::configuration(&arm, &mut stream);
            let settle = |settling| {
                settle(&mut PhysicalArm::new(&arm, &parameters, &effects(&clearances), settling).unwrap(), &joints, &[1.0; 9])
            };
            let rest = settle(Settling { tolerance_m: 1e-13, tolerance_rad: 1e-13, ..Settling::default() });
            assert!(rest.converged);
            for (start, steps_max) in [(Start::Centre, 2), (Start::Centre, 3), (Start::Predicted, 1), (Start::Predicted, 50)] {
                let settled = settle(Settling { start, steps_max, ..Settling::default() });
                let (left_m, left_rad) = distance(&settled.base_from_tool, &rest.base_from_tool);
                assert!(
                    left_m <= settled.settling_error_m + 1e-13,
                    "{start:?}: {left_m:e} m left, {:e}",
                    settled.settling_error_m
                );
                assert!(left_rad <= settled.settling_error_rad + 1e-13, "{start:?}: {left_rad:e} rad left");
                assert_eq!(settled.converged, steps_max == 50);
            }
        }
    }

    #[test]
    fn the_largest_clearances_still_settle() {
        let mut stream = stream(6, "test/physics/largest");
        let largest = Clearance { radial_m: LARGEST_LENGTH_M, axial_m: LARGEST_LENGTH_M, tilt_rad: LARGEST_TILT_RAD };
        for configuration in 0..40 {
            let arm = mixed(configuration);
            let parameters = test_arms::parameters_true(&arm, &mut stream);
            let joints = test_arms::configuration(&arm, &mut stream);
            let settled = |start| {
                let settling = Settling { start, ..Settling::default() };
                let settled = settle(
                    &mut PhysicalArm::new(&arm, &parameters, &effects(&[largest; 8]), settling).unwrap(),
                    &joints,
                    &[1.0; 9],
                );
                assert!(settled.converged && settled.steps < 20, "{} steps", settled.steps);
                for seat in settled.seats.iter().filter(|seat| seat.radial_by == SeatedBy::Load) {
                    let reached = Vector2::from(seat.radial_in_joint).norm() / largest.radial_m;
                    assert!((reached - 1.0).abs() < 1e-6, "joint {} at {reached} of its clearance", seat.joint);
                }
            };
            settled(Start::Centre);
            settled(Start::Predicted);
        }
    }

    #[test]
    fn without_gravity_nothing_seats() {
        let mut arm = test_arms::eight();
        arm.gravity_in_base.fill(0.0);
        let clearance = Clearance { radial_m: 30e-6, axial_m: 20e-6, tilt_rad: 100e-6 };
        let nominal = arm.chain.nominal();
        let settled = settle(
            &mut PhysicalArm::new(&arm, &nominal, &effects(&[clearance; 8]), Settling::default()).unwrap(),
            &[0.5; 8],
            &[1.0; 9],
        );
        assert!(settled.converged);
        assert!(pose_error(&settled.base_from_tool, &arm.chain.at_nominal().forward(&[0.5; 8])).amax() < 1e-14);
        assert!(settled.seats.iter().all(|seat| seat.radial_by == SeatedBy::Friction && seat.tilt_by == SeatedBy::Friction));
    }

    #[test]
    fn a_vertical_axis_does_not_seat_radially() {
        // Joint 1 of the test arm is vertical; its parameters are nominal, so that its load is exactly axial and tilting.
        let arm = test_arms::eight();
        let clearance = Clearance { radial_m: 30e-6, axial_m: 20e-6, tilt_rad: 100e-6 };
        let mut clearances = [Clearance::NONE; 8];
        clearances[0] = clearance;
        for start in [Start::Centre, Start::Predicted] {
            let settling = Settling { start, ..Settling::default() };
            let mut physical = PhysicalArm::new(&arm, &arm.chain.nominal(), &effects(&clearances), settling).unwrap();
            let settled = settle(&mut physical, &[0.3, 0.8, -0.5, 1.0, 0.2, -0.4, 0.1, 0.6], &[1.0; 9]);
            let seat = settled.seats[0];
            assert!(settled.converged);
            assert_eq!((seat.radial_by, seat.axial_by, seat.tilt_by), (SeatedBy::Friction, SeatedBy::Load, SeatedBy::Load));
            assert!(Vector2::from(seat.radial_in_joint).norm() < 1e-15, "{:?}", seat.radial_in_joint);
            assert!((seat.axial_in_joint + clearance.axial_m).abs() < 1e-12);
            assert!(settled.seats[1..].iter().all(|seat| seat.radial_by == SeatedBy::Fit && seat.radial_in_joint == [0.0; 2]));
        }
    }

    #[test]
    fn the_pendulum_of_a_urdf_hangs_so_too() {
        // As below, but the axis is y of the joint's frame, as only a URDF can say it: the mass is given in a frame that is not
        // turned.
        let urdf = r#"<robot name="pendulum"><link name="base"/><link name="bob"><inertial>
            <origin xyz="0.1 0.3 0"/><mass value="2"/>
            <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link><link name="tip"/>
            <joint name="swing" type="revolute"><parent link="base"/><child link="bob"/><axis xyz="0 1 0"/>
            <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
            <joint name="end" type="fixed"><parent link="bob"/><child link="tip"/><origin xyz="0 0.3 0"/></joint></robot>"#;
        let arm = crate::arm::urdf::import(urdf, "pendulum", None, None).unwrap().arm;
        let (c, gamma) = (40e-6, 150e-6);
        let clearance = Clearance { radial_m: c, axial_m: 25e-6, tilt_rad: gamma };
        for q in [0.0, 1.0, -2.0] {
            let settling = Settling { start: Start::Centre, ..Settling::default() };
            let settled = settle(
                &mut PhysicalArm::new(&arm, &arm.chain.nominal(), &effects(&[clearance]), settling).unwrap(),
                &[q],
                &[1.0; 2],
            );
            let seat = settled.seats[0];
            assert_eq!((seat.radial_by, seat.axial_by, seat.tilt_by), (SeatedBy::Load, SeatedBy::Friction, SeatedBy::Load));
            let tool = settled.base_from_tool.translation.vector;
            let by_hand = nalgebra::Vector3::new(0.0, 0.3 * gamma.cos(), -c - 0.3 * gamma.sin());
            assert!((tool - by_hand).norm() < 3e-8, "{tool} instead of {by_hand}");
            // Links are told in their own frames: about y turned by the reading, but for the play.
            let turned = Pose::rotation(nalgebra::Vector3::y() * q);
            assert!(pose_error(&settled.base_from_link[1], &turned).amax() < 2.0 * gamma);
        }
    }

    #[test]
    fn a_pendulum_hangs_as_computed_by_hand() {
        // One horizontal axis at the origin, along base y, carrying 2 kg at 0.3 m along it and 0.1 m beside it. The weight presses
        // the bore down by c; its moment 2 g · 0.3 about base x bends the axis down by γ, to whichever side the mass hangs.
        let mut arm = test_arms::arm(&[JointKind::Revolute], false);
        let mut parameters = arm.chain.nominal();
        parameters.fill(0.0);
        parameters[0] = -std::f64::consts::FRAC_PI_2;
        // The tool is 0.3 m out on the axis: d2.
        parameters[8] = 0.0;
        parameters[3] = 0.3;
        let inertial = arm.links[1].inertial.as_mut().unwrap();
        inertial.mass_kg = 2.0;
        inertial.centre_of_mass_in_link = nalgebra::Point3::new(0.1, 0.0, 0.3);
        let (c, gamma) = (40e-6, 150e-6);
        let clearance = Clearance { radial_m: c, axial_m: 25e-6, tilt_rad: gamma };
        for q in [0.0, 1.0, -2.0] {
            let settling = Settling { start: Start::Centre, ..Settling::default() };
            let settled =
                settle(&mut PhysicalArm::new(&arm, &parameters, &effects(&[clearance]), settling).unwrap(), &[q], &[1.0; 2]);
            let seat = settled.seats[0];
            // The joint's frame has x along base x, y down, z along base y; nothing pushes along the axis.
            assert_eq!((seat.radial_by, seat.axial_by, seat.tilt_by), (SeatedBy::Load, SeatedBy::Friction, SeatedBy::Load));
            assert!((Vector2::from(seat.radial_in_joint) - Vector2::new(0.0, c)).norm() < 1e-11, "{:?}", seat.radial_in_joint);
            assert!((Vector2::from(seat.tilt_in_joint) - Vector2::new(-gamma, 0.0)).norm() < 1e-7, "{:?}", seat.tilt_in_joint);
            let tool = settled.base_from_tool.translation.vector;
            let by_hand = nalgebra::Vector3::new(0.0, 0.3 * gamma.cos(), -c - 0.3 * gamma.sin());
            assert!((tool - by_hand).norm() < 3e-8, "{tool} instead of {by_hand}");
        }
    }

    #[test]
    fn what_cannot_be_simulated_is_refused() {
        let arm = test_arms::eight();
        let nominal = arm.chain.nominal();
        let new = |arm: &Arm, clearances: &[Clearance], settling| {
            PhysicalArm::new(arm, &nominal, &effects(clearances), settling).err().unwrap()
        };
        let mut bare = arm.clone();
        bare.links[3].inertial = None;
        let error = new(&bare, &[Clearance::NONE; 8], Settling::default());
        assert_eq!(error, PhysicsError::MissingInertial { link: "link3".to_owned() });
        let error = new(&arm, &[Clearance { radial_m: 1e-6, ..Clearance::NONE }; 9], Settling::default());
        assert_eq!(error.to_string(), "radial_clearance is at joint number 9, but the arm has 8 joints");
        let error = new(&arm, &[Clearance { radial_m: -1e-6, ..Clearance::NONE }; 8], Settling::default());
        assert_eq!(error.to_string(), "radial clearance of joint number 1 is -0.000001, allowed is 0 to 0.001 (m)");
        let error = new(&arm, &[Clearance::NONE; 8], Settling { tolerance_m: f64::NAN, ..Settling::default() });
        assert!(matches!(error, PhysicsError::BadSetting { what: "tolerance_m", .. }));
        let mut heavy = arm.clone();
        heavy.links[8].inertial.as_mut().unwrap().inertia_in_link[(0, 0)] = -1.0;
        assert!(matches!(new(&heavy, &[Clearance::NONE; 8], Settling::default()), PhysicsError::BadInertial { .. }));
    }

    fn plays(settled: &Settled) -> Vec<Play> {
        let play = |seat: &Seat| Play {
            radial: seat.radial_in_joint.into(),
            axial: seat.axial_in_joint,
            tilt: seat.tilt_in_joint.into(),
        };
        settled.seats.iter().map(play).collect()
    }

    /// Every number of the result, and the rest as text.
    fn bits(settled: &Settled) -> (Vec<u64>, String) {
        let mut numbers = vec![settled.settling_error_m, settled.settling_error_rad];
        for pose in std::iter::once(&settled.base_from_tool).chain(&settled.base_from_link) {
            numbers.extend(pose.translation.vector.iter().chain(pose.rotation.coords.iter()));
        }
        for seat in &settled.seats {
            numbers.extend(seat.radial_in_joint.iter().chain(&seat.tilt_in_joint).chain([&seat.axial_in_joint]));
        }
        (numbers.iter().map(|number| number.to_bits()).collect(), format!("{settled:?}"))
    }
}
