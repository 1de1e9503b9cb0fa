//! Tests of the effects that the comparison with statics (`lab::effect_validation`) does not make: the way into a pose,
//! bits, and what is refused.

use nalgebra::Vector3;

use super::conditions::{Conditions, Stop};
use super::physical_arm::PhysicalArm;
use super::settling::{Settled, Settling, Start};
use super::test_arms;
use crate::arm::Arm;
use crate::arm::JointKind::{Prismatic, Revolute};
use crate::arm::frames::{pose_error, rotation_vector};
use crate::seed::stream;
use crate::simulation::effect::{Effect, Foot, Growing, Moves};

fn new(arm: &Arm, effects: &[Effect]) -> PhysicalArm {
    PhysicalArm::new(arm, &arm.chain.nominal(), effects, Settling::default()).unwrap()
}

/// A session: way points of all joints, each with where the last move comes from, 20 s apart.
fn stops(way: &[(Vec<f64>, Vec<f64>)]) -> Vec<Stop<'_>> {
    way.iter()
        .enumerate()
        .map(|(index, (from, joints))| Stop { joints, from, payload_kg: 3.0, time_s: 20.0 * index as f64 + 2.0, dwell_s: 2.0 })
        .collect()
}

fn conditions<'a>(stops: &'a [Stop<'a>], index: usize, rise_k: &'a [f64]) -> Conditions<'a> {
    Conditions {
        joints: stops[index].joints,
        from: stops[index].from,
        rise_k,
        payload_kg: stops[index].payload_kg,
        time_s: stops[index].time_s,
        session_s: 20.0 * stops.len() as f64,
        dwell_s: stops[index].dwell_s,
        history: &stops[..index],
    }
}

/// Moves of joint `joint` alone, from one coordinate to the next, all other joints staying.
fn moves(arm: &Arm, joint: usize, coordinates: &[f64]) -> Vec<(Vec<f64>, Vec<f64>)> {
    let at = |q: f64| {
        let mut joints = vec![0.4; arm.joint_count()];
        joints[joint] = q;
        joints
    };
    coordinates.windows(2).map(|pair| (at(pair[0]), at(pair[1]))).collect()
}

fn value(settled: &Settled, effect: &str) -> f64 {
    settled.yields.iter().find(|of| of.effect == effect).unwrap().value
}

#[test]
fn the_output_of_a_gear_with_backlash_follows_the_operator_of_play() {
    for kinds in [[Revolute; 3], [Revolute, Prismatic, Revolute]] {
        let arm = test_arms::arm(&kinds, false);
        let width = 2e-4;
        let mut physical = new(&arm, &[Effect::Backlash { joint: 1, width }]);
        let h = width / 2.0;
        // Large moves, moves within the play, none at all, and a turn half-way.
        let way = [0.2, 0.5, 0.5, 0.5 - h, 0.5 - 1.2 * h, 0.5 - 5.0 * h, 0.5 - 4.5 * h, 0.5 - 2.9 * h, 0.1, 0.1 + 0.3 * h];
        let rows = moves(&arm, 1, &way);
        let stops = stops(&rows);
        let mut seat: f64 = 0.0;
        for (index, pair) in way.windows(2).enumerate() {
            // The output stays until a flank of the motor's reaches it.
            seat = (seat - (pair[1] - pair[0])).clamp(-h, h);
            let settled = physical.settle(&conditions(&stops, index, &[0.0; 4]));
            assert!(settled.converged);
            let found = value(&settled, "backlash");
            assert!((found - seat).abs() < 1e-3 * h, "move {index}: {found:e} instead of {seat:e}");
        }
    }
}

#[test]
fn gravity_does_not_push_what_friction_holds() {
    let arm = test_arms::eight();
    let joints = [0.3, 0.8, -0.5, 1.0, 0.2, -0.4, 0.1, 0.6];
    let from = joints.map(|q| q - 0.1);
    let width = 3e-4;
    for joint in 0..8 {
        let mut physical = new(&arm, &[Effect::Backlash { joint, width }]);
        for payload_kg in [0.0, 20.0] {
            let conditions = Conditions { from: &from, payload_kg, ..Conditions::still(&joints, &[0.0; 9]) };
            let found = value(&physical.settle(&conditions), "backlash");
            assert!((found + width / 2.0).abs() < 1e-3 * width, "joint {joint}: {found:e}");
        }
    }
}

#[test]
fn what_creeps_comes_to_the_place_of_a_spring() {
    let arm = test_arms::eight();
    let joints = [0.3, 0.8, -0.5, 1.0, 0.2, -0.4, 0.1, 0.6];
    let (compliance, time_constant) = (2e-5, 30.0);
    let mut creeps = new(&arm, &[Effect::CreepAfterMotion { joint: 1, compliance, time_constant }]);
    let mut yields = new(&arm, &[Effect::JointCompliance { joint: 1, stiffness: 1.0 / compliance }]);
    let at = |dwell_s| Conditions { payload_kg: 4.0, dwell_s, ..Conditions::still(&joints, &[0.0; 9]) };
    let whole = value(&yields.settle(&at(0.0)), "joint_compliance");
    assert!(whole.abs() > 1e-4);
    for dwell_s in [0.0, 3.0, 30.0, 900.0] {
        let found = value(&creeps.settle(&at(dwell_s)), "creep_after_motion");
        let expected = whole * (1.0 - (-dwell_s / time_constant).exp());
        // The load turns with the joint, by less than it has turned.
        assert!((found - expected).abs() < 2e-3 * whole.abs(), "{dwell_s} s: {found:e} instead of {expected:e}");
    }
    // Two stops at one place are one long stop.
    let stop = Stop { joints: &joints, from: &joints, payload_kg: 4.0, time_s: 10.0, dwell_s: 10.0 };
    let parted = Conditions { history: &[stop], time_s: 30.0, ..at(5.0) };
    let (parted, whole) = (creeps.settle(&parted), creeps.settle(&at(30.0)));
    let error = pose_error(&parted.base_from_tool, &whole.base_from_tool).norm();
    assert!(error < 2e-3 * value(&whole, "creep_after_motion").abs(), "{error:e}");
}

/// One turn about an axis across the joint's: nothing of it about the joint's, not even half the product of its parts.
#[test]
fn a_link_that_bends_far_is_not_twisted() {
    let arm = test_arms::eight();
    let joints = [0.3, 0.8, -0.5, 1.0, 0.2, -0.4, 0.1, 0.6];
    let conditions = Conditions { payload_kg: 4.0, ..Conditions::still(&joints, &[0.0; 9]) };
    let straight = new(&arm, &[]).settle(&conditions);
    let turn = |link: usize| {
        let bent = new(&arm, &[Effect::LinkBending { link, compliance: 2e-3, beam: false }]).settle(&conditions);
        // The tool turns by as much as the link's end, about the same axis.
        let axis = straight.base_from_link[link + 1].rotation;
        let turn = bent.base_from_tool.rotation * straight.base_from_tool.rotation.inverse();
        rotation_vector(&(axis.inverse() * turn * axis))
    };
    let turns: Vec<Vector3<f64>> = (0..8).map(turn).collect();
    let product = |turn: &Vector3<f64>| 0.5 * (turn.x * turn.y).abs();
    let largest = turns.iter().map(product).fold(0.0, f64::max);
    assert!(largest > 1e-5, "{turns:?}");
    for turn in &turns {
        assert!(turn.z.abs() < 0.05 * largest, "{turn:?} {largest:e}");
    }
}

fn everything() -> Vec<Effect> {
    let shift = Vector3::new(3e-5, -2e-5, 1e-5);
    vec![
        Effect::JointCompliance { joint: 1, stiffness: 3e4 },
        Effect::LinkBending { link: 1, compliance: 2e-5, beam: false },
        Effect::Clearance { joint: 1, radial: 30e-6, axial: 10e-6, tilt: 1e-4, held: None },
        Effect::Backlash { joint: 1, width: 3e-4 },
        Effect::GravityLostMotion { joint: 1, width: 2e-4 },
        Effect::JointEccentricity { joint: 2, amplitude: 2e-4, order: 1, phase: 0.3 },
        Effect::JointEccentricity { joint: 2, amplitude: 2e-4, order: 2, phase: -1.0 },
        Effect::StrainWaveError { joint: 3, amplitude: 1e-4, ratio: 100.0, phase: 0.1 },
        Effect::GearCoupling { joint: 4, ratio_error: 1e-4, coupling: 2e-4, source: 3 },
        Effect::LinkThermalGrowth { of: Growing::Arm(Foot::Own), expansion: 2e-5 },
        Effect::JointThermalDrift { joint: 5, drift: 1e-5 },
        Effect::BaseDrift { moves: Moves::Base, translation: shift, rotation: shift },
        Effect::BaseStep { moves: Moves::Base, translation: shift, rotation: shift, after: 0.5 },
        Effect::ToolStep { translation: shift, rotation: shift, after: 0.3 },
        Effect::WornToothSector { joint: 0, depth: 5e-4, centre: 0.0, half_width: 2.0 },
        Effect::CreepAfterMotion { joint: 3, compliance: 1e-5, time_constant: 50.0 },
        Effect::MomentCrosstalk { joint: 4, gain: 3e-6 },
        Effect::MemoryHysteresis { joint: 5, amplitude: 3e-4, travel: 0.2 },
        Effect::WrongPayload { excess: 1.0, stiffness: 2e4 },
        Effect::HardeningStiffness { joint: 2, stiffness: 2e4, cubic: 5e8 },
    ]
}

#[test]
fn with_every_effect_at_once_the_same_arguments_give_the_same_bits() {
    let arm = test_arms::eight();
    let mut stream = stream(7, "test/physics/effects");
    let rows: Vec<(Vec<f64>, Vec<f64>)> =
        (0..12).map(|_| (test_arms::configuration(&arm, &mut stream), test_arms::configuration(&arm, &mut stream))).collect();
    let stops = stops(&rows);
    let rise_k = [5.0; 9];
    for start in [Start::Centre, Start::Predicted] {
        let settling = Settling { start, ..Settling::default() };
        let fresh = || PhysicalArm::new(&arm, &arm.chain.nominal(), &everything(), settling).unwrap();
        let bits = |settled: &Settled| {
            assert!(settled.converged && settled.settling_error_m < 1e-9, "{settled:?}");
            let pose = settled.base_from_tool;
            (pose.translation.vector.map(f64::to_bits), pose.rotation.coords.map(f64::to_bits), format!("{settled:?}"))
        };
        let mut used = fresh();
        let in_order: Vec<_> = (0..rows.len()).map(|index| bits(&used.settle(&conditions(&stops, index, &rise_k)))).collect();
        // Another payload in between leaves nothing behind.
        used.settle(&Conditions { payload_kg: 9.0, ..conditions(&stops, 3, &rise_k) });
        for index in (0..rows.len()).rev() {
            assert_eq!(bits(&used.settle(&conditions(&stops, index, &rise_k))), in_order[index]);
            assert_eq!(bits(&fresh().settle(&conditions(&stops, index, &rise_k))), in_order[index]);
        }
    }
}

#[test]
fn without_a_load_what_yields_stays() {
    let mut arm = test_arms::eight();
    arm.gravity_in_base.fill(0.0);
    let effects = [
        Effect::JointCompliance { joint: 1, stiffness: 3e4 },
        Effect::LinkBending { link: 2, compliance: 2e-5, beam: false },
        Effect::GravityLostMotion { joint: 3, width: 2e-4 },
        Effect::HardeningStiffness { joint: 2, stiffness: 2e4, cubic: 5e8 },
        Effect::MomentCrosstalk { joint: 4, gain: 3e-6 },
        Effect::WrongPayload { excess: 1.0, stiffness: 2e4 },
    ];
    let settled = new(&arm, &effects).settle(&Conditions::still(&[0.5; 8], &[0.0; 9]));
    assert!(settled.converged);
    assert!(pose_error(&settled.base_from_tool, &arm.chain.at_nominal().forward(&[0.5; 8])).amax() < 1e-14);
}

#[test]
fn effects_that_cannot_be_are_refused() {
    let arm = test_arms::arm(&[Revolute, Prismatic, Revolute], false);
    let refused =
        |effect: Effect| PhysicalArm::new(&arm, &arm.chain.nominal(), &[effect], Settling::default()).err().unwrap().to_string();
    let zero = Vector3::zeros();
    let cases = [
        (
            Effect::JointCompliance { joint: 0, stiffness: -5.0 },
            "the stiffness of joint_compliance at joint 1 is -5, expected between 100 and 1e12 (N·m/rad, N/m)",
        ),
        (Effect::JointCompliance { joint: 3, stiffness: 1e4 }, "joint_compliance is at joint number 4, but the arm has 3 joints"),
        (
            Effect::LinkBending { link: 1, compliance: 0.0, beam: false },
            "the compliance of link_bending at link 2 is 0, expected between 1e-12 and 0.01 (rad/(N·m), m/N)",
        ),
        (
            Effect::Backlash { joint: 2, width: 0.2 },
            "the width of backlash at joint 3 is 0.2, expected more than 0 and at most 0.1",
        ),
        (
            Effect::JointEccentricity { joint: 1, amplitude: 1e-4, order: 1, phase: 0.0 },
            "joint_eccentricity is at joint number 2, which slides: this happens to joints that turn",
        ),
        (
            Effect::JointEccentricity { joint: 0, amplitude: 1e-4, order: 3, phase: 0.0 },
            "the order of joint_eccentricity at joint 1 is 3, expected 1 or 2",
        ),
        (
            Effect::GearCoupling { joint: 0, ratio_error: 0.0, coupling: 1e-4, source: 7 },
            "gear_coupling is at source number 8, but the arm has 3 joints",
        ),
        (
            Effect::ToolStep { translation: zero, rotation: zero, after: 1.5 },
            "the share of the session of tool_step at the tool is 1.5, expected between 0 and 1",
        ),
        (
            Effect::BaseStep { moves: Moves::Sensor, translation: zero.add_scalar(f64::NAN), rotation: zero, after: 0.5 },
            "the translation of base_step at the base is NaN, expected between -0.1 and 0.1",
        ),
        (
            Effect::LinkThermalGrowth { of: Growing::Arm(Foot::Own), expansion: 1.0 },
            "the expansion of link_thermal_growth at the whole arm is 1, expected between -0.001 and 0.001 (1/K)",
        ),
        (
            Effect::MeasurementOutliers { share: 2.0, factor: 5.0 },
            "the share of measurement_outliers at the sensor is 2, expected between 0 and 1",
        ),
    ];
    for (effect, message) in cases {
        assert_eq!(refused(effect), message);
    }
}

#[test]
fn clearances_of_one_joint_add_up() {
    let arm = test_arms::eight();
    let joints = [0.3, 0.8, -0.5, 1.0, 0.2, -0.4, 0.1, 0.6];
    let clearance = |radial, tilt| Effect::Clearance { joint: 2, radial, axial: 0.0, tilt, held: None };
    let settle = |effects: &[Effect]| new(&arm, effects).settle(&Conditions::still(&joints, &[0.0; 9])).base_from_tool;
    let (once, twice) = (settle(&[clearance(30e-6, 1e-4)]), settle(&[clearance(30e-6, 0.0), clearance(0.0, 1e-4)]));
    assert_eq!(once, twice);
}
