//! Settled measurements per second: eight joints, clearance in none, one or all of them; and one effect of each family.

use divan::{Bencher, counter::ItemsCount};
use kincal::arm::mdh::{Frame, chain};
use kincal::arm::{Arm, Inertial, Link};
use kincal::arm::{Joint, JointKind};
use kincal::seed::stream;
use kincal::simulation::effect::{Effect, Foot, Growing, Moves};
use kincal::simulation::physics::{Conditions, PhysicalArm, Settling, Start, Stop};
use nalgebra::{Matrix3, Point3, Vector3};

fn main() {
    divan::main();
}

fn arm() -> Arm {
    use std::f64::consts::FRAC_PI_2;
    let frames: Vec<Frame> = (0..9)
        .map(|index| Frame {
            alpha: if index == 0 { 0.0 } else { [FRAC_PI_2, -FRAC_PI_2][index % 2] },
            a: 0.03,
            d: 0.25 - 0.02 * index as f64,
            ..Frame::default()
        })
        .collect();
    let joints = (1..=8)
        .map(|index| Joint { name: format!("joint{index}"), kind: JointKind::Revolute, lower: -3.0, upper: 3.0, mimic: None })
        .collect();
    let link = |index: usize| Link {
        name: if index == 0 { "base_link".to_owned() } else { format!("link{index}") },
        inertial: Some(Inertial {
            mass_kg: 9.0 - index as f64,
            centre_of_mass_in_link: Point3::new(0.01, 0.0, 0.1),
            inertia_in_link: Matrix3::identity() * 0.02,
        }),
        shapes: Vec::new(),
    };
    Arm {
        name: "bench".to_owned(),
        chain: chain(&frames, joints, None, None),
        links: (0..9).map(link).collect(),
        fixtures: Vec::new(),
        uncollidable: Vec::new(),
        gravity_in_base: Vector3::new(0.0, 0.0, -9.81),
    }
}

const POSES: usize = 100;

fn settle(bencher: Bencher, joints_with_clearance: usize, start: Start) {
    let arm = arm();
    let clearance = |joint| Effect::Clearance { joint, radial: 30e-6, axial: 20e-6, tilt: 100e-6, held: None };
    let effects: Vec<Effect> = (0..joints_with_clearance).map(clearance).collect();
    let mut physical =
        PhysicalArm::new(&arm, &arm.chain.nominal(), &effects, Settling { start, ..Settling::default() }).expect("a valid arm");
    let mut stream = stream(1, "bench/physics");
    let configurations: Vec<Vec<f64>> = (0..POSES).map(|_| (0..8).map(|_| stream.uniform(-3.0, 3.0)).collect()).collect();
    bencher.counter(ItemsCount::new(POSES)).bench_local(|| {
        configurations.iter().map(|joints| physical.settle(&Conditions::still(joints, &[0.0; 9])).steps).sum::<usize>()
    });
}

/// One effect of each family by its name, at the second joint.
fn effect(name: &str) -> Effect {
    let joint = 1;
    let shift = Vector3::new(3e-5, -2e-5, 1e-5);
    match name {
        "spring" => Effect::JointCompliance { joint, stiffness: 3e4 },
        "bending" => Effect::LinkBending { link: joint, compliance: 2e-5, beam: false },
        "hardening" => Effect::HardeningStiffness { joint, stiffness: 2e4, cubic: 5e8 },
        "creep" => Effect::CreepAfterMotion { joint, compliance: 1e-5, time_constant: 60.0 },
        "backlash" => Effect::Backlash { joint, width: 3e-4 },
        "lost motion" => Effect::GravityLostMotion { joint, width: 3e-4 },
        "drive train" => Effect::JointEccentricity { joint, amplitude: 2e-4, order: 1, phase: 0.3 },
        "memory" => Effect::MemoryHysteresis { joint, amplitude: 3e-4, travel: 0.1 },
        "crosstalk" => Effect::MomentCrosstalk { joint, gain: 3e-6 },
        "growth" => Effect::LinkThermalGrowth { of: Growing::Arm(Foot::Own), expansion: 2e-5 },
        "step" => Effect::BaseStep { moves: Moves::Base, translation: shift, rotation: shift, after: 0.5 },
        _ => Effect::WrongPayload { excess: 1.0, stiffness: 2e4 },
    }
}

const FAMILIES: [&str; 12] = [
    "spring",
    "bending",
    "hardening",
    "creep",
    "backlash",
    "lost motion",
    "drive train",
    "memory",
    "crosstalk",
    "growth",
    "step",
    "springs in all joints",
];

#[divan::bench(args = FAMILIES, sample_count = 20)]
fn one_effect(bencher: Bencher, family: &str) {
    let arm = arm();
    let mut physical = PhysicalArm::new(&arm, &arm.chain.nominal(), &[effect(family)], Settling::default()).expect("a valid arm");
    let mut stream = stream(1, "bench/physics");
    let configurations: Vec<Vec<f64>> = (0..POSES).map(|_| (0..8).map(|_| stream.uniform(-3.0, 3.0)).collect()).collect();
    let zero = vec![0.0; 8];
    let from = |index: usize| if index == 0 { &zero } else { &configurations[index - 1] };
    let stops: Vec<Stop> = configurations
        .iter()
        .enumerate()
        .map(|(index, joints)| Stop { joints, from: from(index), payload_kg: 5.0, time_s: 20.0 * index as f64, dwell_s: 2.0 })
        .collect();
    bencher.counter(ItemsCount::new(POSES)).bench_local(|| {
        let settle = |(index, stop): (usize, &Stop)| {
            let conditions = Conditions {
                joints: stop.joints,
                from: stop.from,
                rise_k: &[8.0; 9],
                payload_kg: stop.payload_kg,
                time_s: stop.time_s,
                session_s: 20.0 * POSES as f64,
                dwell_s: stop.dwell_s,
                history: &stops[..index],
            };
            physical.settle(&conditions).steps
        };
        stops.iter().enumerate().map(settle).sum::<usize>()
    });
}

#[divan::bench(args = [0, 1, 8], sample_count = 20)]
fn from_the_predicted_seat(bencher: Bencher, joints_with_clearance: usize) {
    settle(bencher, joints_with_clearance, Start::Predicted);
}

#[divan::bench(args = [1, 8], sample_count = 20)]
fn from_the_centre(bencher: Bencher, joints_with_clearance: usize) {
    settle(bencher, joints_with_clearance, Start::Centre);
}
