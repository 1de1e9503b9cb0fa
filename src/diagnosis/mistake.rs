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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene;
    use crate::seed::stream;

    /// Readings of the shipped arm in a frame of their own, its target off the flange, after `change`.
    fn said(change: impl Fn(&mut Measurement)) -> String {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/arm8.toml");
        let arm = scene::read(path).unwrap().scene.arm;
        let mut draws = stream(2, "test/mistake");
        let mut pose = |size: f64| {
            let mut three = || Vector3::from_fn(|_, _| draws.uniform(-size, size));
            nalgebra::Isometry3::new(three(), three())
        };
        let (base, target) = (pose(1.0), pose(0.1));
        let mut rows: Vec<Measurement> = (0..40)
            .map(|index| {
                let joints: Vec<f64> = arm.chain.joints.iter().map(|of| draws.uniform(of.lower, of.upper)).collect();
                let position_m = (base * arm.chain.at_nominal().forward(&joints) * target).translation.vector.into();
                Measurement { index, joints, position_m, ..Measurement::default() }
            })
            .collect();
        rows.iter_mut().for_each(change);
        hint(&arm, &rows.iter().collect::<Vec<_>>(), 0.5)
    }

    #[test]
    fn each_mistake_is_told_by_its_name() {
        assert!(
            said(|row| row.position_m = row.position_m.map(|value| value * 1e-3)).contains("metres in columns that say mill")
        );
        assert!(
            said(|row| row.position_m = row.position_m.map(|value| value * 1e3)).contains("millimetres in columns that say m")
        );
        let turned = |factor: f64| said(move |row| row.joints.iter_mut().for_each(|value| *value *= factor));
        assert!(turned(180.0 / std::f64::consts::PI).contains("degrees in columns that say rad"));
        assert!(turned(std::f64::consts::PI / 180.0).contains("rad in columns that say degrees"));
        assert!(said(|row| row.joints[4] = -row.joints[4]).contains("joint 5 counted the other way round"));
        assert!(said(|row| row.joints.swap(2, 5)).contains("columns of joints 3 and 6 were swapped"));
    }

    /// Where none of them explains it, none is said, but a joint of which the readings stand still is.
    #[test]
    fn nothing_is_blamed_that_explains_little() {
        let mut draws = stream(3, "test/mistake/noise");
        let noise: Vec<[f64; 3]> = (0..40).map(|_| [0; 3].map(|_| draws.uniform(-1.0, 1.0))).collect();
        assert!(said(|row| row.position_m = noise[row.index]).contains("is it this robot"));
        assert!(
            said(|row| (row.position_m, row.joints[3]) = (noise[row.index], 0.3)).contains("readings of joint 4 never change")
        );
    }
}
