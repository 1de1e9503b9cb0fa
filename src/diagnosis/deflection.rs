//! The arm with the effects found so far: each moves what is outboard of it as a rigid body, by as much as it has, and loads are those of
//! the arm so moved, until nothing changes. Signatures are taken there, so that a kind is exact at any magnitude.

use nalgebra::{Rotation3, UnitQuaternion, Vector3};

use super::evidence::Candidates;
use super::rows::Rows;
use crate::arm::frames::rotation_vector;
use crate::effects::signature::posture::{Motion, Posture};
use crate::effects::signature::shape::{Displacement, Reading, Shape};
use crate::effects::{Level, Location};

/// Rounds of loads and motions.
const ROUNDS: usize = 30;
/// Movement of the target, m, below which nothing changes any more.
const SETTLED_M: f64 = 1e-10;

/// On which arm the loads act that effects answer to. Physics leaves no choice; data from other simulations, and arms whose controllers
/// compensate part of it, do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Loads {
    /// The arm as it stands, with all that moves it.
    AsItStands,
    /// The arm as its joint readings have it.
    AsRead,
}

impl Loads {
    pub(super) fn other(self) -> Loads {
        match self {
            Loads::AsItStands => Loads::AsRead,
            Loads::AsRead => Loads::AsItStands,
        }
    }
}

/// Something that is there: where, what it follows, and the coefficients of its columns, SI.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Present {
    pub(super) location: Location,
    pub(super) shape: Shape,
    pub(super) coefficients: Vec<f64>,
}

/// What is there according to `coefficients` (column and value).
pub(super) fn present(candidates: &Candidates, coefficients: &[(usize, f64)]) -> Vec<Present> {
    let of = |number: usize| {
        let columns = candidates.columns(number);
        let value = |(at, column): (usize, usize)| {
            let known = coefficients.iter().find(|(known, _)| *known == column).map_or(0.0, |(_, value)| *value);
            known * candidates.unit[number] * candidates.hypotheses[number].spread[at]
        };
        let coefficients: Vec<f64> = columns.enumerate().map(value).collect();
        coefficients.iter().any(|value| *value != 0.0).then(|| Present {
            location: candidates.hypotheses[number].location,
            shape: candidates.hypotheses[number].shape,
            coefficients,
        })
    };
    (0..candidates.hypotheses.len()).filter_map(of).collect()
}

/// Where a motion acts: on everything, outboard of a joint, or on the target alone.
fn place(location: &Location, joints: usize) -> Option<usize> {
    match (location.level, location.index) {
        (Level::Joint | Level::Link, Some(index)) => Some(index.min(joints)),
        (Level::Base, _) => Some(0),
        (Level::Joint | Level::Link | Level::Tool | Level::Sensor, _) => None,
    }
}

/// What is known of a deflected reading.
pub(super) struct Deflected {
    /// The reading with its posture and its target where they are.
    pub(super) reading: Reading,
    /// What the effects do to the target: shift (m) and turn (rad), in root.
    pub(super) displacement: Displacement,
}

/// Twists (shift of the target of `reading` in m, turn in rad) by what is `present`: before the first joint, after each joint, and of the
/// target alone.
fn twists(reading: &Reading, orientation: bool, present: &[Present]) -> Vec<Displacement> {
    let joints = reading.joints.len();
    let mut twists = vec![[0.0; 6]; joints + 2];
    for one in present {
        let at = place(&one.location, joints).unwrap_or(joints + 1);
        let columns = one.shape.columns(reading, orientation);
        for (column, value) in columns.iter().zip(&one.coefficients) {
            twists[at].iter_mut().zip(column).for_each(|(sum, moved)| *sum += moved * value);
        }
    }
    twists
}

/// `reading` (of the arm without effects) with the effects `present`. `payload_kg`: what the tool carries.
pub(super) fn deflected(rows: &Rows, reading: &Reading, payload_kg: f64, present: &[Present], loads: Loads) -> Deflected {
    if present.is_empty() {
        return Deflected { reading: reading.clone(), displacement: [0.0; 6] };
    }
    let orientation = rows.equations.has_orientation();
    let joints = reading.joints.len();
    let still = &reading.posture;
    let offset_in_tool = still.tool_axes.transpose() * (reading.target - still.tool);
    let moved = |motions: &[Motion]| -> (Posture, Vector3<f64>, Displacement) {
        let posture = rows.mechanism.posture_moved(&reading.joints, payload_kg, &reading.gravity, &motions[..=joints]);
        let target = motions[joints + 1].of_point(&(posture.tool + posture.tool_axes * offset_in_tool));
        let turned = motions[joints + 1].rotation * posture.tool_axes * still.tool_axes.transpose();
        let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turned));
        let (shift, turn) = (target - reading.target, rotation_vector(&turn));
        (posture, target, [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z])
    };
    let mut now = reading.clone();
    match loads {
        Loads::AsRead => {
            // Each acts on the arm as it is read, and is carried along by those inboard of it.
            let mut carried = Motion::IDENTITY;
            let motions: Vec<Motion> = twists(reading, orientation, present)
                .iter()
                .map(|twist| {
                    let own = Motion::of_twist(twist, &reading.target);
                    let motion = carried.after(&own).after(&carried.inverse());
                    carried = carried.after(&own);
                    motion
                })
                .collect();
            Deflected { displacement: moved(&motions).2, reading: now }
        }
        Loads::AsItStands => {
            let mut displacement = [0.0; 6];
            for _ in 0..ROUNDS {
                let motions: Vec<Motion> =
                    twists(&now, orientation, present).iter().map(|twist| Motion::of_twist(twist, &now.target)).collect();
                let (posture, target, change) = moved(&motions);
                let moved = (target - now.target).norm();
                (now.posture, now.target, displacement) = (posture, target, change);
                if moved < SETTLED_M {
                    break;
                }
            }
            Deflected { reading: now, displacement }
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;
    use crate::diagnosis::tests::with_analysis;
    use crate::measurement::Measurement;

    #[test]
    fn a_twist_is_a_turn_about_its_axis() {
        let point = Vector3::new(0.3, -0.2, 0.9);
        let centre = Vector3::new(0.1, 0.4, 0.2);
        let turn = Vector3::new(0.2, -0.5, 0.3);
        let shift = turn.cross(&(point - centre));
        let motion = Motion::of_twist(&[shift.x, shift.y, shift.z, turn.x, turn.y, turn.z], &point);
        let rotation: Matrix3<f64> = Rotation3::from_scaled_axis(turn).into_inner();
        let expected = centre + rotation * (point - centre);
        assert!((motion.of_point(&point) - expected).norm() < 1e-14);
        assert!((motion.of_point(&centre) - centre).norm() < 1e-14);
    }

    fn shift(of: &Displacement) -> Vector3<f64> {
        Vector3::new(of[0], of[1], of[2])
    }

    /// Play of a joint is a turn of the joint, which the chain itself can make; no load changes it.
    #[test]
    fn play_is_what_the_chain_does_when_its_joint_turns() {
        with_analysis(
            |_, _, _, _, _| 0.0,
            |analysis| {
                let rows = analysis.linear.rows;
                let width = 2e-3;
                let location = Location { level: Level::Joint, index: Some(3) };
                let play = [Present {
                    location,
                    shape: Shape::Direction(crate::effects::kind::backlash::Direction { joint: 2 }),
                    coefficients: vec![width],
                }];
                for reading in analysis.linear.readings {
                    let mut joints = reading.joints.clone();
                    joints[2] += 0.5 * width * reading.approach[2];
                    let [still, turned] = [&reading.joints, &joints].map(|joints| rows.mechanism.posture(joints, 0.0));
                    let offset = still.tool_axes.transpose() * (reading.target - still.tool);
                    let expected = turned.tool + turned.tool_axes * offset - reading.target;
                    assert!(expected.norm() > 1e-6);
                    for loads in [Loads::AsItStands, Loads::AsRead] {
                        let found = deflected(rows, reading, 0.0, &play, loads).displacement;
                        assert!((shift(&found) - expected).norm() < 1e-9, "{found:?} against {expected}");
                    }
                }
            },
        );
    }

    /// Where a joint yields, the load moves with the arm: what the signature at the undeflected arm misses is of second order.
    #[test]
    fn what_first_order_misses_goes_with_the_square() {
        with_analysis(
            |_, _, _, _, _| 0.0,
            |analysis| {
                let rows = analysis.linear.rows;
                let shape = Shape::Torque(crate::effects::kind::joint_compliance::Torque { joint: 1 });
                let location = Location { level: Level::Joint, index: Some(2) };
                let missed = |compliance: f64| -> f64 {
                    let yields = [Present { location, shape, coefficients: vec![compliance] }];
                    let of = |(reading, row): (&Reading, &&Measurement)| {
                        let payload_kg = row.payload_kg.unwrap_or(0.0);
                        let found = deflected(rows, reading, payload_kg, &yields, Loads::AsItStands).displacement;
                        (shift(&found) - shift(&shape.columns(reading, false)[0]) * compliance).norm_squared()
                    };
                    analysis.linear.readings.iter().zip(analysis.measurements).map(of).sum::<f64>().sqrt()
                };
                let ratio = missed(2e-5) / missed(1e-5);
                assert!((3.8..4.2).contains(&ratio), "{ratio}");
            },
        );
    }
}
