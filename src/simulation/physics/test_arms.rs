//! Arms for the tests of this module.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::arm::mdh::{Frame, SixParameters, chain};
use crate::arm::{Arm, Inertial, Link};
use crate::arm::{Joint, JointKind, Quantity};
use crate::seed::Stream;

/// An arm of `kinds.len()` joints with axes that alternate, about 1 m long, links of 8 to 1 kg.
pub(super) fn arm(kinds: &[JointKind], base_and_tool: bool) -> Arm {
    use std::f64::consts::FRAC_PI_2;
    let count = kinds.len();
    let frames: Vec<Frame> = (0..=count)
        .map(|index| Frame {
            alpha: [0.0, -FRAC_PI_2, FRAC_PI_2][if index == 0 { 0 } else { 1 + index % 2 }],
            a: if index == 0 { 0.0 } else { 0.02 + 0.01 * (index % 4) as f64 },
            theta: 0.1 * index as f64,
            d: 0.25 - 0.15 * index as f64 / count as f64,
            beta: 0.0,
        })
        .collect();
    let joints = kinds
        .iter()
        .enumerate()
        .map(|(index, kind)| Joint { name: format!("joint{}", index + 1), kind: *kind, lower: -3.0, upper: 3.0, mimic: None })
        .collect();
    let six = SixParameters { xyz: [0.1, -0.2, 0.3], rpy: [0.04, -0.05, 2.6] };
    let chain = chain(&frames, joints, base_and_tool.then_some(six), base_and_tool.then_some(six));
    let link = |index: usize| {
        let mass_kg = if index == 0 { 12.0 } else { 8.0 - 7.0 * (index - 1) as f64 / count as f64 };
        let length = if index == 0 { 0.2 } else { frames[index].d };
        let (thick, thin) = (mass_kg * (length * length / 12.0 + 0.001), mass_kg * 0.002);
        Link {
            name: if index == 0 { "base_link".to_owned() } else { format!("link{index}") },
            inertial: Some(Inertial {
                mass_kg,
                centre_of_mass_in_link: Point3::new(0.01, -0.005, 0.5 * length),
                inertia_in_link: Matrix3::from_diagonal(&Vector3::new(thick, thick, thin)),
            }),
            shapes: Vec::new(),
        }
    };
    Arm {
        name: "test arm".to_owned(),
        chain,
        links: (0..=count).map(link).collect(),
        fixtures: Vec::new(),
        uncollidable: Vec::new(),
        gravity_in_base: Vector3::new(0.0, 0.0, -9.81),
    }
}

/// Eight revolute joints.
pub(super) fn eight() -> Arm {
    arm(&[JointKind::Revolute; 8], false)
}

/// Nominal parameters with errors of up to ±30 mm and ±1.72°.
pub(super) fn parameters_true(arm: &Arm, stream: &mut Stream) -> Vec<f64> {
    let error = |quantity: Quantity| match quantity {
        Quantity::Length => 0.03,
        Quantity::Angle => 1.72_f64.to_radians(),
    };
    arm.chain
        .parameters
        .iter()
        .map(|parameter| parameter.nominal + stream.uniform(-1.0, 1.0) * error(parameter.quantity))
        .collect()
}

/// Joint coordinates: any angle within ±3 rad, slides within ±0.3 m.
pub(super) fn configuration(arm: &Arm, stream: &mut Stream) -> Vec<f64> {
    let span = |kind| if kind == JointKind::Revolute { 3.0 } else { 0.3 };
    arm.chain.joints.iter().map(|joint| stream.uniform(-1.0, 1.0) * span(joint.kind)).collect()
}

/// Growth of every link by up to ±12 µm/m/K · 20 K.
pub(super) fn growth(arm: &Arm, stream: &mut Stream) -> Vec<f64> {
    (0..=arm.joint_count()).map(|_| 1.0 + stream.uniform(-1.0, 1.0) * 240e-6).collect()
}
