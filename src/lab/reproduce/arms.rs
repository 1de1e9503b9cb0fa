//! The arms on which every claim is tried, and arms with narrower joints.

use crate::arm::Arm;
use crate::arm::JointKind;
use crate::scene::{self, SceneError, SceneFile};

/// Scenes of the arms: the substitute for the paper's, one with parallel axes, and one that exists. They are part of the program,
/// which may stand anywhere.
const SCENES: [(&str, &str); 3] = [
    ("scenes/paper.toml", include_str!("../../../scenes/paper.toml")),
    ("scenes/parallel8.toml", include_str!("../../../scenes/parallel8.toml")),
    ("scenes/panda.toml", include_str!("../../../scenes/panda.toml")),
];
/// What one of them takes from another file.
const URDF: (&str, &str) = ("urdf_file = \"panda.urdf\"", include_str!("../../../scenes/panda.urdf"));

/// The scene of the eight-joint arm on a floor that a tracker measures.
///
/// # Errors
/// If it is no valid scene.
pub fn arm8() -> Result<SceneFile, SceneError> {
    scene::parse(include_str!("../../../scenes/arm8.toml"), "scenes/arm8.toml")
}

/// The scenes of all arms.
///
/// # Errors
/// If one of them is no valid scene.
pub fn arms() -> Result<Vec<SceneFile>, SceneError> {
    let (key, urdf) = URDF;
    SCENES.iter().map(|(name, text)| scene::parse(&text.replace(key, &format!("urdf = '''\n{urdf}'''")), name)).collect()
}

/// `arm` with the range of every joint that turns cut to its middle ± `half_width` (rad), where it was wider.
#[must_use]
pub fn cut(arm: &Arm, half_width: f64) -> Arm {
    with_half_widths(arm, |kind, half| if kind == JointKind::Revolute { half.min(half_width) } else { half })
}

/// `arm` with every joint's range narrowed about its middle by `factor`.
#[must_use]
pub fn narrowed(arm: &Arm, factor: f64) -> Arm {
    with_half_widths(arm, |_, half| half * factor)
}

fn with_half_widths(arm: &Arm, change: impl Fn(JointKind, f64) -> f64) -> Arm {
    let mut arm = arm.clone();
    for joint in &mut arm.chain.joints {
        let (middle, half) = (0.5 * (joint.lower + joint.upper), 0.5 * (joint.upper - joint.lower));
        let changed = change(joint.kind, half);
        // Limits that stay are left as they are, to the last bit.
        if changed < half {
            (joint.lower, joint.upper) = (middle - changed, middle + changed);
        }
    }
    arm
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn the_arms_of_the_program_are_those_of_the_files() {
        for (file, (name, _)) in arms().unwrap().iter().zip(SCENES) {
            let read = scene::read(Path::new(env!("CARGO_MANIFEST_DIR")).join(name)).unwrap();
            assert_eq!((&file.scene, &file.injected), (&read.scene, &read.injected));
        }
    }

    #[test]
    fn ranges_are_cut_about_their_middle() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/arm8.toml");
        let arm = scene::read(&path).unwrap().scene.arm;
        let limits = |arm: &Arm| arm.chain.joints.iter().map(|joint| (joint.lower, joint.upper)).collect::<Vec<_>>();
        assert_eq!(limits(&cut(&arm, 4.0)), limits(&arm));
        assert_eq!(limits(&narrowed(&arm, 1.0)), limits(&arm));
        assert!(limits(&cut(&arm, 0.5)).iter().all(|limits| *limits == (-0.5, 0.5)));
        let (first, half) = (limits(&arm)[0].1, limits(&narrowed(&arm, 0.5))[0].1);
        assert!((half - 0.5 * first).abs() < 1e-15);
    }
}
