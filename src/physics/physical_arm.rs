//! The true arm, from commanded joint coordinates to a pose at rest.

use super::clearance::{Clearance, Seat};
use super::error::PhysicsError;
use super::play::{Load, Play};
use super::settling::{Settled, Settling, Start};
use super::static_seat::static_seats;
use super::true_arm::TrueArm;
use super::world::{World, indentation};
use crate::arm::Arm;
use crate::frames::{Pose, rotation_vector};

/// An arm with its true parameters, as a multibody in rapier.
pub struct PhysicalArm {
    arm: TrueArm,
    settling: Settling,
    world: World,
}

impl PhysicalArm {
    /// The arm `arm` whose chain has the values `parameters_true` (column order, SI) and whose joints have the `clearances` (one
    /// per joint).
    ///
    /// # Errors
    /// If a moving link has no inertial or an impossible one, a count is wrong, or a number is out of range.
    pub fn new(arm: &Arm, parameters_true: &[f64], clearances: &[Clearance], settling: Settling) -> Result<Self, PhysicsError> {
        settling.check()?;
        let arm = TrueArm::new(arm, parameters_true, clearances, settling.holding_ratio)?;
        let world = World::new(&arm, settling.time_step_s);
        Ok(PhysicalArm { arm, settling, world })
    }

    /// Moves the joints to `joints` (rad or m, ideal servos), lets the arm settle and returns its pose.
    ///
    /// `growth[i]` scales the translation from joint `i` to joint `i + 1` (counted from 1; `growth[0]` is base to first joint,
    /// the last is last joint to tool): `1 + α ΔT` of link `i`, 1 without thermal growth. Centres of mass do not move with it.
    ///
    /// The result depends on the arguments alone, to the last bit, not on what was settled before.
    ///
    /// # Panics
    /// If there is not one coordinate per joint and one growth per segment.
    pub fn settle(&mut self, joints: &[f64], growth: &[f64]) -> Settled {
        let count = self.arm.joint_count();
        assert_eq!(joints.len(), count, "one coordinate per joint");
        assert_eq!(growth.len(), count + 1, "one growth per segment");
        let mut plays = match self.settling.start {
            Start::Centre => vec![Play::CENTRE; count],
            Start::Predicted => self.predicted(joints, growth),
        };
        self.world.place(&self.arm, joints, growth, &plays);
        let mut base_from_tool = self.world.base_from_tool();
        let (mut steps, mut moved_m, mut moved_rad, mut converged) = (0, 0.0, 0.0, true);
        if self.world.freedoms() > 0 {
            converged = false;
            while !converged && steps < self.settling.steps_max {
                let loads = self.world.loads(&self.arm);
                self.world.damp(&self.arm, &loads);
                self.world.step();
                steps += 1;
                plays = self.world.plays(&self.arm);
                self.world.place(&self.arm, joints, growth, &plays);
                let reached = self.world.base_from_tool();
                (moved_m, moved_rad) = distance(&reached, &base_from_tool);
                base_from_tool = reached;
                converged = moved_m < self.settling.tolerance_m && moved_rad < self.settling.tolerance_rad;
            }
        }
        let base_from_link = std::iter::once(self.arm.base_from_base_link)
            .chain((0..count).map(|joint| self.world.base_from_link(joint)))
            .collect();
        let loads = self.world.loads(&self.arm);
        let seats = plays.iter().zip(&loads).enumerate().map(|(joint, (play, load))| self.seat(joint, play, load)).collect();
        Settled {
            base_from_tool,
            base_from_link,
            settling_error_m: moved_m,
            settling_error_rad: moved_rad,
            steps,
            simulated_time_s: steps as f64 * self.settling.time_step_s,
            converged,
            seats,
        }
    }

    /// Where statics puts the joints, pressed against the limits as rapier holds them.
    fn predicted(&self, joints: &[f64], growth: &[f64]) -> Vec<Play> {
        let mut plays = static_seats(&self.arm, joints, growth, 1);
        for play in &mut plays {
            play.radial *= indentation();
            play.axial *= indentation();
            play.tilt *= indentation();
        }
        plays
    }

    fn seat(&self, joint: usize, play: &Play, load: &Load) -> Seat {
        let [radial_by, axial_by, tilt_by] = self.arm.seated_by(joint, load.radial.norm(), load.axial, load.tilt.norm());
        Seat {
            joint,
            radial_in_joint: play.radial.into(),
            axial_in_joint: play.axial,
            tilt_in_joint: play.tilt.into(),
            radial_by,
            axial_by,
            tilt_by,
        }
    }
}

/// How far `reached` is from `left`, in m and rad.
fn distance(reached: &Pose, left: &Pose) -> (f64, f64) {
    let shift = reached.translation.vector - left.translation.vector;
    (shift.norm(), rotation_vector(&(reached.rotation * left.rotation.inverse())).norm())
}

#[cfg(test)]
mod tests {
    use super::super::test_arms;
    use super::*;
    use crate::frames::pose_error;
    use crate::kinematics::JointKind;
    use crate::seed::stream;
    use nalgebra::Translation3;

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
            let mut expected = Pose::identity();
            for (index, segment) in at.segments().iter().enumerate() {
                expected *= Pose::from_parts(Translation3::from(segment.translation.vector * growth[index]), segment.rotation);
                if let Some(q) = joints.get(index) {
                    expected *= match kinds[index] {
                        Revolute => Pose::rotation(nalgebra::Vector3::z() * *q),
                        Prismatic => Pose::translation(0.0, 0.0, *q),
                    };
                }
            }
            let mut physical = PhysicalArm::new(&arm, &parameters, &[Clearance::NONE; 8], Settling::default()).unwrap();
            let settled = physical.settle(&joints, &growth);
            worst = worst.max(pose_error(&settled.base_from_tool, &expected).amax());
            assert!(settled.converged && settled.steps == 0);
            let still = physical.settle(&joints, &[1.0; 9]);
            worst = worst.max(pose_error(&still.base_from_tool, &at.forward(&joints)).amax());
            for (link, name) in arm.links.iter().zip(&still.base_from_link) {
                let frame = arm.chain.frame_names().iter().position(|frame| *frame == link.name).unwrap();
                worst = worst.max(pose_error(name, &at.frames(&joints)[frame]).amax());
            }
        }
        println!("worst deviation from forward kinematics: {worst:e}");
        assert!(worst < 1e-9);
    }
}
