//! Robots whose dimensions are public, to tell readings of another variant from readings with a mistake.
//!
//! Dimensions are those of the makers' data sheets and Denavit–Hartenberg tables: Universal Robots ("DH parameters for calculations of
//! kinematics and dynamics"), Franka Robotics (Craig's convention), KUKA, ABB, FANUC, Yaskawa, Stäubli, UFACTORY, Mecademic, Annin Robotics.
//! Where a joint's zero is and which way it counts differs between files of one robot: every sense is tried, and of arms with an elbow
//! every quarter turn of the second and third joint.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::Vector3;
use rayon::prelude::*;

use super::super::standing;
use super::{ROUNDS, in_frame, spread};
use crate::arm::frames::Pose;
use crate::arm::mdh::{self, Frame};
use crate::arm::{Arm, ChainAt, Joint, JointKind};
use crate::measurement::Measurement;

/// Share of the positions' spread that another robot may leave to be named: it is off by manufacturing alone.
const NAMED: f64 = 0.01;
/// And so much less than this robot leaves.
const BETTER: f64 = 0.2;
/// Rounds where there are few ways to try.
const MORE_ROUNDS: usize = 30;
/// Rounds of placing base and target of those that are nearest, and how many these are.
const FINE_ROUNDS: usize = 100;
const NEAREST: usize = 24;

/// A robot that makes the readings.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Variant {
    /// Its name.
    pub(super) name: &'static str,
    /// RMS distance that it leaves, base and target placed, m.
    pub(super) left_m: f64,
}

/// Robots of Universal Robots by a2, a3, d4, d5, m.
const UR: [(&str, [f64; 4]); 10] = [
    ("UR3", [0.24365, 0.21325, 0.11235, 0.08535]),
    ("UR5", [0.425, 0.39225, 0.10915, 0.09465]),
    ("UR10", [0.612, 0.5723, 0.163941, 0.1157]),
    ("UR3e", [0.24355, 0.2132, 0.13105, 0.08535]),
    ("UR5e or UR7e", [0.425, 0.3922, 0.1333, 0.0997]),
    ("UR10e or UR12e", [0.6127, 0.57155, 0.17415, 0.11985]),
    ("UR16e", [0.4784, 0.36, 0.17415, 0.11985]),
    ("UR15", [0.6475, 0.5164, 0.1824, 0.1361]),
    ("UR20", [0.862, 0.7287, 0.201, 0.1593]),
    ("UR30", [0.637, 0.5037, 0.201, 0.1593]),
];

/// Arms with an elbow and a wrist whose axes meet, by a1, a2, a3, d3, d4, m.
const ELBOW: [(&str, [f64; 5]); 21] = [
    ("ABB IRB 120", [0.0, 0.27, 0.07, 0.0, 0.302]),
    ("ABB IRB 140", [0.07, 0.36, 0.0, 0.0, 0.38]),
    ("ABB IRB 1200-7/0.7", [0.0, 0.35, 0.042, 0.0, 0.351]),
    ("ABB IRB 1200-5/0.9", [0.0, 0.448, 0.042, 0.0, 0.451]),
    ("ABB IRB 1600-1.2", [0.15, 0.475, 0.0, 0.0, 0.6]),
    ("ABB IRB 1600-1.45", [0.15, 0.7, 0.0, 0.0, 0.6]),
    ("ABB IRB 2400", [0.1, 0.705, 0.135, 0.0, 0.755]),
    ("KUKA KR 6 R700", [0.025, 0.315, 0.035, 0.0, 0.365]),
    ("KUKA KR 6 R900", [0.025, 0.455, 0.035, 0.0, 0.42]),
    ("KUKA KR 10 R1100", [0.025, 0.56, 0.035, 0.0, 0.515]),
    ("FANUC LR Mate 200iD", [0.05, 0.33, 0.035, 0.0, 0.335]),
    ("FANUC LR Mate 200iD/7L", [0.05, 0.44, 0.035, 0.0, 0.42]),
    ("Yaskawa GP7", [0.04, 0.445, 0.04, 0.0, 0.44]),
    ("Yaskawa GP8", [0.04, 0.345, 0.04, 0.0, 0.34]),
    ("Stäubli TX2-60", [0.0, 0.29, 0.0, 0.02, 0.31]),
    ("Stäubli TX2-60L", [0.0, 0.4, 0.0, 0.02, 0.45]),
    ("Stäubli TX2-90", [0.05, 0.425, 0.0, 0.05, 0.425]),
    ("Stäubli TX2-90L", [0.05, 0.5, 0.0, 0.05, 0.55]),
    ("Stäubli TX2-90XL", [0.05, 0.65, 0.0, 0.05, 0.65]),
    ("Mecademic Meca500", [0.0, 0.135, 0.038, 0.0, 0.12]),
    ("Annin AR4", [0.0642, 0.305, 0.0, 0.0, 0.22263]),
];

/// A robot of the list.
struct Known {
    name: &'static str,
    frames: Vec<Frame>,
    /// Whether files differ in where the second and third joint are at zero.
    turned: bool,
}

fn frame(alpha: f64, a: f64, theta: f64, d: f64) -> Frame {
    Frame { alpha, a, theta, d, beta: 0.0 }
}

/// All, each with one frame more than joints; what base and target take up is left out.
fn all() -> Vec<Known> {
    let quarter = FRAC_PI_2;
    let ur = UR.iter().map(|(name, [a2, a3, d4, d5])| Known {
        name,
        frames: vec![
            Frame::default(),
            frame(quarter, 0.0, 0.0, 0.0),
            frame(0.0, -a2, 0.0, 0.0),
            frame(0.0, -a3, 0.0, *d4),
            frame(quarter, 0.0, 0.0, *d5),
            frame(-quarter, 0.0, 0.0, 0.0),
            Frame::default(),
        ],
        turned: false,
    });
    let elbow = ELBOW.iter().map(|(name, [a1, a2, a3, d3, d4])| Known {
        name,
        frames: vec![
            Frame::default(),
            frame(-quarter, *a1, 0.0, 0.0),
            frame(0.0, *a2, 0.0, *d3),
            frame(-quarter, *a3, 0.0, *d4),
            frame(quarter, 0.0, 0.0, 0.0),
            frame(-quarter, 0.0, 0.0, 0.0),
            Frame::default(),
        ],
        turned: true,
    });
    let seven = |name: &'static str, d3: f64, d5: f64| Known {
        name,
        frames: vec![
            Frame::default(),
            frame(-quarter, 0.0, 0.0, 0.0),
            frame(quarter, 0.0, 0.0, d3),
            frame(quarter, 0.0, 0.0, 0.0),
            frame(-quarter, 0.0, 0.0, d5),
            frame(-quarter, 0.0, 0.0, 0.0),
            frame(quarter, 0.0, 0.0, 0.0),
            Frame::default(),
        ],
        turned: false,
    };
    let panda = Known {
        name: "Franka Panda or Research 3",
        frames: vec![
            Frame::default(),
            frame(-quarter, 0.0, 0.0, 0.0),
            frame(quarter, 0.0, 0.0, 0.316),
            frame(quarter, 0.0825, 0.0, 0.0),
            frame(-quarter, -0.0825, 0.0, 0.384),
            frame(quarter, 0.0, 0.0, 0.0),
            frame(quarter, 0.088, 0.0, 0.0),
            Frame::default(),
        ],
        turned: false,
    };
    let xarm6 = Known {
        name: "UFACTORY xArm 6",
        frames: vec![
            Frame::default(),
            frame(-quarter, 0.0, -1.384_917_9, 0.0),
            frame(0.0, 0.289_49, 1.384_917_9, 0.0),
            frame(-quarter, 0.0775, 0.0, 0.3425),
            frame(quarter, 0.0, 0.0, 0.0),
            frame(-quarter, 0.076, 0.0, 0.0),
            Frame::default(),
        ],
        turned: false,
    };
    let others = [seven("KUKA LBR iiwa 7", 0.4, 0.4), seven("KUKA LBR iiwa 14", 0.42, 0.4), panda, xarm6];
    ur.chain(elbow).chain(others).collect()
}

impl Known {
    fn joints(&self) -> usize {
        self.frames.len() - 1
    }

    /// With the second and third joint turned by these at zero, rad.
    fn chain(&self, second: f64, third: f64) -> ChainAt {
        let mut frames = self.frames.clone();
        frames[1].theta += second;
        frames[2].theta += third;
        let joint =
            |number: usize| Joint { name: format!("j{number}"), kind: JointKind::Revolute, lower: -PI, upper: PI, mimic: None };
        mdh::chain(&frames, (0..self.joints()).map(joint).collect(), None, None).at_nominal()
    }
}

/// The robot of the list that makes `rows`, where one does and `arm` does not.
pub(super) fn variant(arm: &Arm, rows: &[&Measurement]) -> Option<Variant> {
    if arm.slides().contains(&true) {
        return None;
    }
    let whole: Vec<Measurement> = in_frame(rows).into_iter().filter(|row| row.unread == [false; 3]).collect();
    let few = spread(&whole);
    let positions: Vec<Vector3<f64>> = few.iter().map(|row| row.position().coords).collect();
    let left = |chain: &ChainAt, senses: usize, rounds: usize| {
        let tools: Vec<Pose> = few
            .iter()
            .map(|row| {
                let sense = |joint: usize| if senses >> joint & 1 == 1 { -1.0 } else { 1.0 };
                let joints: Vec<f64> = row.joints.iter().enumerate().map(|(joint, value)| sense(joint) * value).collect();
                chain.forward(&joints)
            })
            .collect();
        standing::in_turn_of(&tools, &positions, rounds).map(|found| (found.share(), found.left_m))
    };
    let (own, _) = left(&arm.chain.at_nominal(), 0, FINE_ROUNDS)?;
    let known: Vec<Known> = all().into_iter().filter(|known| known.joints() == arm.joint_count()).collect();
    let tries: Vec<(usize, f64, f64, usize)> = known
        .iter()
        .enumerate()
        .flat_map(|(number, of)| {
            let quarters: &[f64] = if of.turned { &[0.0, FRAC_PI_2, -FRAC_PI_2] } else { &[0.0] };
            // Which way the first and the last joint count is up to base and target only with others: all are tried.
            let turned = quarters.iter().flat_map(move |second| quarters.iter().map(move |third| (*second, *third)));
            let senses = 1_usize << of.joints();
            turned.flat_map(move |(second, third)| (0..senses).map(move |senses| (number, second, third, senses)))
        })
        .collect();
    type Try = (usize, f64, f64, usize);
    let share =
        |(number, second, third, senses): &Try, rounds: usize| left(&known[*number].chain(*second, *third), *senses, rounds);
    let mut tries: Vec<(f64, Try)> = tries
        .into_par_iter()
        .filter_map(|one| Some((share(&one, if known[one.0].turned { ROUNDS } else { MORE_ROUNDS })?.0, one)))
        .filter(|(share, _)| share.is_finite())
        .collect();
    tries.sort_by(|a, b| a.0.total_cmp(&b.0));
    tries.truncate(NEAREST);
    let fine = tries.iter().filter_map(|(_, one)| Some((share(one, FINE_ROUNDS)?, known[one.0].name)));
    let ((share, left_m), name) = fine.min_by(|a, b| a.0.0.total_cmp(&b.0.0))?;
    (share < NAMED && share < BETTER * own).then_some(Variant { name, left_m })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::stream;

    /// An arm of the list measured, and asked for with the file of another.
    #[test]
    fn readings_of_another_robot_are_known_as_its() {
        let mut draws = stream(1, "test/variant");
        let arm = |known: &Known| Arm {
            name: known.name.to_owned(),
            chain: mdh::chain(
                &known.frames,
                (0..known.joints())
                    .map(|number| Joint {
                        name: format!("j{number}"),
                        kind: JointKind::Revolute,
                        lower: -PI,
                        upper: PI,
                        mimic: None,
                    })
                    .collect(),
                None,
                None,
            ),
            links: Vec::new(),
            fixtures: Vec::new(),
            uncollidable: Vec::new(),
            gravity_in_base: Vector3::new(0.0, 0.0, -9.81),
        };
        let known = all();
        let named = |name: &str| known.iter().find(|known| known.name == name).unwrap();
        for (measured, given) in [
            ("UR10", "UR5"),
            ("UR5e or UR7e", "UR5"),
            ("KUKA LBR iiwa 14", "KUKA LBR iiwa 7"),
            ("KUKA KR 6 R900", "KUKA KR 6 R700"),
            ("Yaskawa GP8", "Yaskawa GP7"),
        ] {
            let chain = named(measured).chain(0.0, 0.0);
            let target = Pose::translation(0.02, -0.05, 0.11);
            let rows: Vec<Measurement> = (0..40)
                .map(|index| {
                    let mut joints: Vec<f64> = (0..named(measured).joints()).map(|_| draws.uniform(-2.0, 2.0)).collect();
                    let at = (Pose::translation(1.0, 0.5, -0.2) * chain.forward(&joints) * target).translation.vector;
                    // The file counts two joints the other way round.
                    joints[1] = -joints[1];
                    joints[3] = -joints[3];
                    let noise = Vector3::from_fn(|_, _| 5e-4 * draws.normal());
                    Measurement { index, joints, position_m: (at + noise).into(), ..Measurement::default() }
                })
                .collect();
            let rows: Vec<&Measurement> = rows.iter().collect();
            let found = variant(&arm(named(given)), &rows).expect(measured);
            assert_eq!(found.name, measured);
            assert_eq!(variant(&arm(named(given)), &rows[..0]), None);
        }
    }
}
