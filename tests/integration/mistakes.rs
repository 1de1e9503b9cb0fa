//! What tables get wrong, on arms of every kind: each mistake is named and its correction undoes it, and what is right is left alone.

use kincal::arm::frames::{Pose, rotation_from_vector};
use kincal::arm::{Arm, urdf};
use kincal::identification::mistake::{Explanation, Fix, Said, explanations, is_suspicious};
use kincal::measurement::Measurement;
use kincal::measurement::table::Euler;
use kincal::scene;
use kincal::seed::{Stream, stream};
use nalgebra::Vector3;

fn scene_path(name: &str) -> std::path::PathBuf {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name)
}

fn data_folder() -> Option<std::path::PathBuf> {
    let folder = std::env::var_os("KINCAL_DATA_DIR").map(Into::into);
    if folder.is_none() {
        eprintln!("KINCAL_DATA_DIR is not set: the arms in it are left out");
    }
    folder
}

/// A SCARA: three axes upright, one of them sliding.
const SCARA: &str = r#"<robot name="scara"><link name="base"/><link name="a"/><link name="b"/><link name="c"/><link name="d"/>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="a"/><origin xyz="0 0 0.4"/><axis xyz="0 0 1"/>
<limit lower="-2.5" upper="2.5" effort="1" velocity="1"/></joint>
<joint name="elbow" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0.35 0 0.05"/><axis xyz="0 0 1"/>
<limit lower="-2.4" upper="2.4" effort="1" velocity="1"/></joint>
<joint name="quill" type="prismatic"><parent link="b"/><child link="c"/><origin xyz="0.3 0 0"/><axis xyz="0 0 -1"/>
<limit lower="0" upper="0.3" effort="1" velocity="1"/></joint>
<joint name="wrist" type="revolute"><parent link="c"/><child link="d"/><axis xyz="0 0 -1"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint></robot>"#;

/// A gantry with a turning head of two axes.
const GANTRY: &str = r#"<robot name="gantry"><link name="base"/><link name="a"/><link name="b"/><link name="c"/><link name="d"/><link name="e"/>
<joint name="x" type="prismatic"><parent link="base"/><child link="a"/><axis xyz="1 0 0"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="y" type="prismatic"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/>
<limit lower="-0.6" upper="0.6" effort="1" velocity="1"/></joint>
<joint name="z" type="prismatic"><parent link="b"/><child link="c"/><axis xyz="0 0 -1"/>
<limit lower="0" upper="0.5" effort="1" velocity="1"/></joint>
<joint name="pan" type="revolute"><parent link="c"/><child link="d"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="tilt" type="revolute"><parent link="d"/><child link="e"/><origin xyz="0.1 0 -0.2"/><axis xyz="0 1 0"/>
<limit lower="-1.5" upper="1.5" effort="1" velocity="1"/></joint></robot>"#;

fn arms() -> Vec<(String, Arm)> {
    let mut arms: Vec<(String, Arm)> = Vec::new();
    for (name, text) in [("SCARA", SCARA), ("gantry", GANTRY)] {
        arms.push((name.to_owned(), urdf::import(text, name, None, None).unwrap().arm));
    }
    for (name, file) in [("Panda", "panda.urdf"), ("tutorial arm", "tutorial.urdf")] {
        let file = scene_path(file);
        let leaf = if name == "Panda" { Some("panda_link8") } else { None };
        let read = urdf::read(&file, None, leaf).or_else(|_| urdf::read(&file, None, None)).unwrap();
        arms.push((name.to_owned(), read.arm));
    }
    arms.push(("eight joints".to_owned(), scene::read(scene_path("arm8.toml")).unwrap().scene.arm));
    if let Some(data) = data_folder() {
        for (name, file) in [("UR10", "ur10_tracker/ur10.urdf"), ("iiwa", "mukca_sockets/iiwa14.urdf")] {
            if let Ok(read) = urdf::read(&data.join(file), None, None) {
                arms.push((name.to_owned(), read.arm));
            }
        }
    }
    arms
}

/// Sixty readings of `arm`, its frames off by about a millimetre, the target off the flange, in a frame of their own.
fn readings(arm: &Arm, orientation: bool, draws: &mut Stream) -> Vec<Measurement> {
    let mut pose = |size: f64, turn: f64| {
        let mut three = |size: f64| Vector3::from_fn(|_, _| draws.uniform(-size, size));
        Pose::from_parts(three(size).into(), rotation_from_vector(&three(turn)))
    };
    let (base, target) = (pose(1.0, 1.5), pose(0.12, 1.0));
    let mut values = arm.chain.nominal();
    for value in &mut values {
        // Half a millimetre or half a milliradian.
        *value += 5e-4 * draws.normal();
    }
    let chain = arm.chain.at(&values);
    (0..60)
        .map(|index| {
            let joints: Vec<f64> =
                arm.chain.joints.iter().map(|joint| draws.uniform(joint.lower.max(-2.6), joint.upper.min(2.6))).collect();
            let there = base * chain.forward(&joints) * target;
            let noise = Vector3::from_fn(|_, _| 5e-5 * draws.normal());
            Measurement {
                index,
                pose_id: index,
                joints,
                position_m: (there.translation.vector + noise).into(),
                orientation_xyzw: orientation.then(|| there.rotation.coords.into()),
                ..Measurement::default()
            }
        })
        .collect()
}

/// Kinds of mistakes: the correction that undoes what was done to the rows, in place.
fn mistake(kind: &str, rows: &mut Vec<Measurement>, arm: &Arm, draws: &mut Stream) -> Option<Vec<Fix>> {
    let count = arm.joint_count();
    let slides = arm.slides();
    let mut pick = |below: usize| (draws.unit() * below as f64) as usize % below.max(1);
    // Mistakes of outer joints show; the first joint's zero and the last one's are parts of base and target.
    let fixes = match kind {
        "two columns swapped" => {
            let (first, second) = (pick(count), pick(count));
            let mut order: Vec<usize> = (0..count).collect();
            order.swap(first, second);
            if first == second || slides[first] != slides[second] {
                return None;
            }
            vec![Fix::Order(order)]
        }
        "three columns moved on" => {
            let first = pick(count - 2);
            let mut order: Vec<usize> = (0..count).collect();
            order[first..first + 3].rotate_left(1);
            if slides[first..first + 3].iter().any(|of| *of != slides[first]) {
                return None;
            }
            vec![Fix::Order(order)]
        }
        "one joint reversed" => vec![Fix::Reverse(vec![pick(count)])],
        "two joints reversed" => {
            let (first, second) = (pick(count), pick(count));
            if first >= second {
                return None;
            }
            vec![Fix::Reverse(vec![first, second])]
        }
        "zero of a quarter turn" => {
            let joint = 1 + pick(count - 2);
            if slides[joint] {
                return None;
            }
            vec![Fix::Zero(joint, std::f64::consts::FRAC_PI_2)]
        }
        "coupled to the joint before" => {
            let joint = 1 + pick(count - 1);
            if slides[joint] || slides[joint - 1] {
                return None;
            }
            vec![Fix::Couple { joint, other: joint - 1, sign: 1.0 }]
        }
        "inches" => vec![Fix::Positions("inch")],
        "one axis in cm" => vec![Fix::PositionsOf(pick(3), "cm")],
        "degrees as rad" => vec![Fix::Angles("deg")],
        "mirrored" => vec![Fix::Axes([(0, 1.0), (1, -1.0), (2, 1.0)])],
        "slipped by two" => vec![Fix::Shift(20, 2)],
        "w first" => vec![Fix::RealPartFirst],
        "conjugate" => vec![Fix::Conjugate],
        "inverse pose" => vec![Fix::Inverse],
        "angles in another way" => vec![Fix::Angled(Euler::Turns { axes: [0, 1, 2], moving: false })],
        _ => unreachable!("{kind}"),
    };
    // What undoes it, backwards.
    for fix in &fixes {
        match fix {
            Fix::Order(order) => rows.iter_mut().for_each(|row| {
                let own = row.joints.clone();
                order.iter().enumerate().for_each(|(column, joint)| row.joints[column] = own[*joint]);
            }),
            Fix::Zero(joint, zero) => rows.iter_mut().for_each(|row| row.joints[*joint] -= zero),
            Fix::Couple { joint, other, sign } => rows.iter_mut().for_each(|row| row.joints[*joint] += sign * row.joints[*other]),
            Fix::Positions(_) => {
                rows.iter_mut().for_each(|row| row.position_m = row.position_m.map(|value| value / 0.0254 * 1e-3))
            }
            Fix::PositionsOf(axis, _) => rows.iter_mut().for_each(|row| row.position_m[*axis] *= 0.1),
            Fix::Angles(_) => rows.iter_mut().for_each(|row| {
                let turning = row.joints.iter_mut().zip(&slides).filter(|(_, slides)| !**slides);
                turning.for_each(|(value, _)| *value = value.to_degrees());
            }),
            Fix::Shift(first, by) => {
                let read = rows.clone();
                for (row, wrong) in rows.iter_mut().enumerate().skip(*first) {
                    if let Some(from) = row.checked_add_signed(*by).filter(|from| *from < read.len()) {
                        (wrong.position_m, wrong.orientation_xyzw) = (read[from].position_m, read[from].orientation_xyzw);
                    }
                }
                rows.truncate(read.len().saturating_sub(by.unsigned_abs()));
            }
            Fix::RealPartFirst => rows.iter_mut().for_each(|row| {
                row.orientation_xyzw = row.orientation_xyzw.map(|[x, y, z, w]| [w, x, y, z]);
            }),
            Fix::Angled(_) => rows.iter_mut().for_each(|row| {
                let (roll, pitch, yaw) = row.orientation().unwrap().euler_angles();
                row.angles_rad = Some([roll, pitch, yaw]);
                row.orientation_xyzw = row.angles_rad.map(|angles| Euler::Vector.turn(angles).coords.into());
            }),
            // The rest undo themselves.
            other => other.apply(rows, &said(), &slides).unwrap(),
        }
    }
    Some(fixes)
}

/// Positions are said to be in mm, angles in rad.
fn said() -> Said {
    Said { angle: 1.0, position: [1e-3; 3], euler: Some(Euler::Vector) }
}

const KINDS: [(&str, bool); 16] = [
    ("two columns swapped", false),
    ("three columns moved on", false),
    ("one joint reversed", false),
    ("two joints reversed", false),
    ("zero of a quarter turn", false),
    ("coupled to the joint before", false),
    ("inches", false),
    ("one axis in cm", false),
    ("degrees as rad", false),
    ("mirrored", false),
    ("slipped by two", false),
    ("w first", true),
    ("conjugate", true),
    ("inverse pose", true),
    ("angles in another way", true),
    ("nothing", false),
];

/// Whether `found` makes the readings those of the arm, as a stranger would check: the nominal arm fits, and no more is said than was done.
fn right(found: &[Explanation], wrong: &[Measurement], done: &[Fix], arm: &Arm) -> bool {
    let Some(best) = found.first() else {
        return false;
    };
    let mut rows = wrong.to_vec();
    if best.fixes.iter().any(|fix| fix.apply(&mut rows, &said(), &arm.slides()).is_err()) {
        return false;
    }
    !is_suspicious(arm, &rows.iter().collect::<Vec<_>>()) && best.fixes.len() <= done.len()
}

#[test]
fn mistakes_of_tables_are_named_on_arms_of_every_kind() {
    let mut table = String::new();
    let (mut total, mut rights) = (0, 0);
    let mut unseen: Vec<String> = Vec::new();
    let arms = arms();
    for (kind, orientation) in KINDS {
        let (mut shown, mut named, mut quiet) = (0, 0, 0);
        for (name, arm) in &arms {
            for seed in 0..2_u64 {
                let mut draws = stream(seed, &format!("test/mistakes/{kind}/{name}"));
                let mut rows = readings(arm, orientation, &mut draws);
                let fixes = if kind == "nothing" { Some(Vec::new()) } else { mistake(kind, &mut rows, arm, &mut draws) };
                let Some(done) = fixes else { continue };
                let read: Vec<&Measurement> = rows.iter().collect();
                // A mistake of a joint that moves the target by next to nothing shows to nobody.
                if !is_suspicious(arm, &read) {
                    quiet += 1;
                    continue;
                }
                shown += 1;
                let found = explanations(arm, &said(), &read);
                if right(&found, &rows, &done, arm) {
                    named += 1;
                } else {
                    let said: Vec<String> = found.iter().map(Explanation::options).collect();
                    unseen.push(format!("{kind} on {name}: {done:?}, said {said:?}"));
                }
            }
        }
        table.push_str(&format!("{kind:28} {named:3} of {shown:3} named, {quiet} too small to show\n"));
        (total, rights) = (total + shown, rights + named);
        if kind == "nothing" {
            assert_eq!(shown, 0, "readings without a mistake are suspicious");
        }
    }
    eprintln!("{table}{}", unseen.join("\n"));
    assert_eq!(rights, total, "\n{table}\n{}", unseen.join("\n"));
}
