//! Settled measurements per second: eight joints, clearance in none, one or all of them.

use divan::{Bencher, counter::ItemsCount};
use kincal::arm::{Arm, Inertial, Link};
use kincal::kinematics::mdh::{Frame, chain};
use kincal::kinematics::{Joint, JointKind};
use kincal::physics::{Clearance, PhysicalArm, Settling, Start};
use kincal::seed::stream;
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
        .map(|index| Joint { name: format!("joint{index}"), kind: JointKind::Revolute, lower: -3.0, upper: 3.0 })
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
    let clearance = Clearance { radial_m: 30e-6, axial_m: 20e-6, tilt_rad: 100e-6 };
    let clearances: Vec<Clearance> =
        (0..8).map(|joint| if joint < joints_with_clearance { clearance } else { Clearance::NONE }).collect();
    let mut physical = PhysicalArm::new(&arm, &arm.chain.nominal(), &clearances, Settling { start, ..Settling::default() })
        .expect("a valid arm");
    let mut stream = stream(1, "bench/physics");
    let configurations: Vec<Vec<f64>> = (0..POSES).map(|_| (0..8).map(|_| stream.uniform(-3.0, 3.0)).collect()).collect();
    bencher
        .counter(ItemsCount::new(POSES))
        .bench_local(|| configurations.iter().map(|joints| physical.settle(joints, &[1.0; 9]).steps).sum::<usize>());
}

#[divan::bench(args = [0, 1, 8], sample_count = 20)]
fn from_the_predicted_seat(bencher: Bencher, joints_with_clearance: usize) {
    settle(bencher, joints_with_clearance, Start::Predicted);
}

#[divan::bench(args = [1, 8], sample_count = 20)]
fn from_the_centre(bencher: Bencher, joints_with_clearance: usize) {
    settle(bencher, joints_with_clearance, Start::Centre);
}
