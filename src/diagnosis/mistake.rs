//! What a table may have got wrong when no arm of its kind makes its readings: units, a joint's sense, two joints, the model.

use nalgebra::{Matrix3, Vector3};

use crate::arm::Arm;
use crate::arm::frames::registration;
use crate::effects::signature::posture::Mechanism;
use crate::measurement::Measurement;

/// Rounds of fitting base and target in turn: each takes up a part of what the other leaves, and few do for a misfit of millimetres.
const ROUNDS: usize = 20;
/// Keeps the target where nothing tells it, next to sums over readings of about one.
const DAMPING: f64 = 1e-9;

/// A sentence about what to look at: the mistake that explains most of the misfit, if one leaves less of it than the share `mended`.
#[must_use]
pub(crate) fn hint(arm: &Arm, measurements: &[&Measurement], mended: f64) -> String {
    let mechanism = Mechanism::new(arm);
    // What lacks a coordinate cannot be registered.
    let whole: Vec<&&Measurement> = measurements.iter().filter(|row| row.unread == [false; 3]).collect();
    let measurements = if whole.is_empty() { measurements.iter().collect() } else { whole };
    let joints: Vec<Vec<f64>> = measurements.iter().map(|row| row.joints.clone()).collect();
    let points: Vec<Vector3<f64>> = measurements.iter().map(|row| row.position().coords).collect();
    let count = mechanism.joint_count();
    let as_is = misfit(&mechanism, &joints, &points);
    let mut best: Option<(f64, String)> = None;
    let mut try_with = |said: String, joints: &[Vec<f64>], scale: f64| {
        let scaled: Vec<Vector3<f64>> = points.iter().map(|point| point * scale).collect();
        let left = misfit(&mechanism, joints, &scaled);
        if best.as_ref().is_none_or(|(known, _)| left < *known) {
            best = Some((left, said));
        }
    };
    let changed = |change: &dyn Fn(&mut Vec<f64>)| {
        let mut all = joints.clone();
        all.iter_mut().for_each(change);
        all
    };
    for (factor, said) in [
        (1e3, "the positions were metres in columns that say millimetres"),
        (1e-3, "the positions were millimetres in columns that say metres"),
    ] {
        try_with(said.to_owned(), &joints, factor);
    }
    let turning = |row: &mut Vec<f64>, factor: f64| {
        for (value, slides) in row.iter_mut().zip(&mechanism.slides) {
            *value *= if *slides { 1.0 } else { factor };
        }
    };
    let degree = std::f64::consts::PI / 180.0;
    try_with("the joint angles were degrees in columns that say rad".to_owned(), &changed(&|row| turning(row, degree)), 1.0);
    try_with(
        "the joint angles were rad in columns that say degrees".to_owned(),
        &changed(&|row| turning(row, 1.0 / degree)),
        1.0,
    );
    for joint in 0..count {
        try_with(format!("joint {} counted the other way round", joint + 1), &changed(&|row| row[joint] = -row[joint]), 1.0);
        for other in 0..joint {
            let said = format!("the columns of joints {} and {} were swapped", other + 1, joint + 1);
            try_with(said, &changed(&|row| row.swap(joint, other)), 1.0);
        }
    }
    let frozen: Vec<String> = (0..count)
        .filter(|joint| joints.iter().all(|row| row[*joint] == joints[0][*joint]))
        .map(|joint| (joint + 1).to_string())
        .collect();
    if let Some((left, said)) = best.filter(|(left, _)| *left < mended * as_is) {
        return format!("It would be {:.1} mm (base and target fitted) if {said}", left * 1e3);
    }
    if !frozen.is_empty() {
        return format!("The readings of joint {} never change: was the arm really still there?", frozen.join(", "));
    }
    "Neither other units, nor a joint that counts the other way round, nor two swapped joints explain it: is it this robot, and are \
     its links from --base-link to --tip-link?"
        .to_owned()
}

/// RMS distance (m) between `points` and the nominal arm, where it stands and its target fitted.
fn misfit(mechanism: &Mechanism, joints: &[Vec<f64>], points: &[Vector3<f64>]) -> f64 {
    let postures: Vec<(Vector3<f64>, Matrix3<f64>)> = joints
        .iter()
        .map(|row| {
            let posture = mechanism.posture(row, 0.0);
            (posture.tool, posture.tool_axes)
        })
        .collect();
    let mut offset = Vector3::zeros();
    let mut rms = f64::INFINITY;
    for _ in 0..ROUNDS {
        let targets: Vec<Vector3<f64>> = postures.iter().map(|(tool, axes)| tool + axes * offset).collect();
        let Some(base) = registration(&targets, points) else {
            return f64::INFINITY;
        };
        // The target, given where the base stands.
        let (mut normal, mut right) = (Matrix3::identity() * DAMPING, Vector3::zeros());
        let mut squares = 0.0;
        for ((tool, axes), point) in postures.iter().zip(points) {
            let in_root = base.inverse_transform_vector(&(point - base.translation.vector));
            normal += axes.transpose() * axes;
            right += axes.transpose() * (in_root - tool);
            squares += (in_root - tool - axes * offset).norm_squared();
        }
        rms = libm::sqrt(squares / points.len() as f64);
        offset = normal.try_inverse().map_or(offset, |inverse| inverse * right);
    }
    rms
}
