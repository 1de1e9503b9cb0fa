//! What is said of readings that are wrong in more than one way, or in none that is known; single mistakes on arms of every kind are
//! tried in `tests/integration/mistakes.rs`.

use super::*;
use crate::scene;
use crate::seed::stream;

/// Readings of the shipped arm in a frame of their own, its target off the flange, after `change`; positions are said to be in mm.
fn said(change: impl Fn(&mut Measurement)) -> (String, Vec<Explanation>) {
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
    let found = hint(&arm, &Said { angle: 1.0, position: [1e-3; 3], euler: None }, &rows.iter().collect::<Vec<_>>());
    (found.text, found.explanations)
}

fn options(found: &[Explanation]) -> Vec<String> {
    found.iter().map(Explanation::options).collect()
}

#[test]
fn several_mistakes_at_once_are_told_together() {
    let (text, found) = said(|row| {
        row.position_m = row.position_m.map(|value| value / 0.0254 * 1e-3);
        row.joints[2] = -row.joints[2];
        row.joints[4] = -row.joints[4];
    });
    assert_eq!(options(&found), ["--fix-columns positions:inch --fix-columns reverse:3,5"], "{text}");
    assert!(text.contains("the positions are inches") && text.contains("count the other way round"), "{text}");
    let (_, found) = said(|row| {
        row.joints.swap(2, 5);
        row.joints[1] -= std::f64::consts::FRAC_PI_2;
    });
    assert_eq!(options(&found), ["--fix-columns order:1,2,6,4,5,3,7,8 --fix-columns zero:2=90"]);
}

/// Where none of them explains it, none is said, but a joint of which the readings stand still is.
#[test]
fn nothing_is_blamed_that_explains_little() {
    let mut draws = stream(3, "test/mistake/noise");
    let noise: Vec<[f64; 3]> = (0..40).map(|_| [0; 3].map(|_| draws.uniform(-1.0, 1.0))).collect();
    let (text, found) = said(|row| row.position_m = noise[row.index]);
    assert!(found.is_empty() && text.contains("is it this robot"), "{text}");
    let (text, found) = said(|row| (row.position_m, row.joints[3]) = (noise[row.index], 0.3));
    assert!(found.is_empty() && text.contains("never change"), "{text}");
}
