//! The moments about the x and y axes of a joint's frame turn it about z; the frame is that of the moving side or of the side that the
//! joint moves on.

use nalgebra::{Matrix3, Vector3};

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{Displacement, Reading, Shape};

/// rad/(N·m)
const RANGE: [f64; 2] = [0.3e-5, 3e-5];

pub(in crate::effects::signature) fn columns(reading: &Reading, joint: usize, moving: bool) -> Vec<Displacement> {
    let posture = &reading.posture;
    let mut frame = posture.frames[joint];
    if !moving {
        // Back by the joint's angle about z.
        let (sine, cosine) = libm::sincos(reading.joints[joint]);
        let (x, y): (Vector3<f64>, Vector3<f64>) = (frame.column(0).into(), frame.column(1).into());
        frame = Matrix3::from_columns(&[x * cosine - y * sine, y * cosine + x * sine, posture.axes[joint]]);
    }
    [0, 1].map(|axis| reading.moved(joint, frame.column(axis).dot(&posture.moments[joint]))).to_vec()
}

pub(super) fn hypotheses(site: &Site<'_>, joint: usize, all: &mut Vec<Hypothesis>) {
    if site.turns() {
        for moving in [false, true] {
            let detail = format!("moment across the axis of joint {} turns it", joint + 1);
            let spread = vec![std::f64::consts::FRAC_1_SQRT_2; 2];
            all.push(site.unnamed(Shape::Crosstalk { joint, moving }, RANGE, spread, detail));
        }
    }
}
