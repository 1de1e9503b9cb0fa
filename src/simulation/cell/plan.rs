//! The order of measuring: which configuration is read when, from where the arm comes to it, and what it carries.

use super::Cell;
use crate::arm::{Joint, JointKind};
use crate::measurement::{Measurement, Role};
use crate::seed::stream;
use crate::simulation::effect::Effect;
use crate::simulation::injected::Injected;
use crate::simulation::plan::ApproachPolicy;

/// A reading to be taken, in the order of measuring.
#[derive(Clone, Debug, PartialEq)]
pub struct Planned {
    /// Same number, same configuration (and payload): a repeat.
    pub pose_id: usize,
    /// For fitting or for verification.
    pub role: Role,
    /// Commanded joint coordinates, rad or m.
    pub joints: Vec<f64>,
    /// Joint coordinates from which the last move comes, rad or m.
    pub from: Vec<f64>,
    /// Mass that the tool is believed to carry, kg.
    pub payload_kg: f64,
    /// Since the start of the session, s.
    pub time_s: f64,
    /// From the end of the last move to the reading, s.
    pub dwell_s: f64,
}

impl Planned {
    /// Direction of each joint's last move: -1, 0 or 1.
    #[must_use]
    pub fn approach(&self) -> Vec<i8> {
        let direction = |(to, from): (&f64, &f64)| match to.total_cmp(from) {
            std::cmp::Ordering::Less => -1,
            std::cmp::Ordering::Equal => 0,
            std::cmp::Ordering::Greater => 1,
        };
        self.joints.iter().zip(&self.from).map(direction).collect()
    }
}

/// A reading before it is known what comes before it.
struct Row {
    pose_id: usize,
    role: Role,
    joints: Vec<f64>,
    payload_kg: f64,
    dwell_s: f64,
}

/// The order of measuring: chosen and held-out configurations and their repeats shuffled, so that neither sees only one part of a
/// drift; with `payload_blocks` one payload after the other, shuffled within.
#[must_use]
pub fn plan(cell: &Cell<'_>, chosen: &[Vec<f64>], held_out: &[Vec<f64>]) -> Vec<Planned> {
    let payloads = &cell.plan.payloads_kg;
    let of = |role, configurations: &[Vec<f64>], first: usize| {
        let row = |(index, joints): (usize, &Vec<f64>)| Row {
            pose_id: first + index,
            role,
            joints: joints.clone(),
            payload_kg: payloads[index % payloads.len()],
            dwell_s: cell.plan.dwell_s,
        };
        configurations.iter().enumerate().map(row).collect::<Vec<_>>()
    };
    let mut rows = Vec::with_capacity(cell.plan.repeats * (chosen.len() + held_out.len()));
    for _ in 0..cell.plan.repeats {
        rows.extend(of(Role::Fit, chosen, 0));
        rows.extend(of(Role::HeldOut, held_out, chosen.len()));
    }
    stream(cell.seed, "plan/order").shuffle(&mut rows);
    if cell.plan.payload_blocks {
        let block = |row: &Row| payloads.iter().position(|payload| *payload == row.payload_kg);
        rows.sort_by_key(block);
        rows.chunk_by_mut(|row, next| row.payload_kg == next.payload_kg).for_each(part_repeats);
    } else {
        part_repeats(&mut rows);
    }
    let times = (0..rows.len()).map(|index| index as f64 * cell.plan.seconds_per_pose).collect();
    in_order(cell, rows, times)
}

/// The plan by which `measurements` were taken.
#[must_use]
pub fn as_measured(cell: &Cell<'_>, measurements: &[Measurement]) -> Vec<Planned> {
    let row = |row: &Measurement| Row {
        pose_id: row.pose_id,
        role: row.role,
        joints: row.joints.clone(),
        payload_kg: row.payload_kg.unwrap_or_default(),
        dwell_s: row.dwell_s.unwrap_or(cell.plan.dwell_s),
    };
    let times = measurements.iter().map(|row| row.time_s).collect();
    in_order(cell, measurements.iter().map(row).collect(), times)
}

/// What should be said of a plan before it is carried out.
#[must_use]
pub fn notes(cell: &Cell<'_>, injected: &Injected) -> Vec<String> {
    let mut notes = Vec::new();
    if cell.plan.repeats == 1 {
        notes.push(
            "every configuration is read once, so the noise cannot be estimated from the readings and is taken as declared \
             (plan.repeats = 2 would tell)"
                .to_owned(),
        );
    }
    let thermal = |effect: &&Effect| matches!(effect, Effect::LinkThermalGrowth { .. } | Effect::JointThermalDrift { .. });
    if let Some(effect) = injected.effects.iter().find(thermal).filter(|_| cell.plan.temperature.is_none()) {
        notes.push(format!("{} does nothing, because nothing warms: the plan has no [plan.temperature]", effect.name()));
    }
    notes
}

/// Moves readings of one configuration apart where they follow each other: without a move between them they would show the sensor's
/// noise, not the arm's.
fn part_repeats(rows: &mut [Row]) {
    let count = rows.len();
    for here in 1..count {
        if rows[here].pose_id != rows[here - 1].pose_id {
            continue;
        }
        // The next row that parts them and parts nothing else less; none where nearly all rows are of one configuration.
        let other = (here + 1..count).chain(0..here - 1).find(|other| {
            rows.swap(here, *other);
            let parted = |at: usize| {
                (at == 0 || rows[at].pose_id != rows[at - 1].pose_id)
                    && (at + 1 == count || rows[at].pose_id != rows[at + 1].pose_id)
            };
            let good = parted(here) && parted(*other);
            rows.swap(here, *other);
            good
        });
        if let Some(other) = other {
            rows.swap(here, other);
        }
    }
}

/// Rows in the order of measuring, with the moves between them.
fn in_order(cell: &Cell<'_>, rows: Vec<Row>, times: Vec<f64>) -> Vec<Planned> {
    let mut before = vec![0.0; cell.arm.joint_count()];
    let planned = rows.into_iter().zip(times).map(|(Row { pose_id, role, joints, payload_kg, dwell_s }, time_s)| {
        let before = std::mem::replace(&mut before, joints.clone());
        let from = match directions(cell, pose_id) {
            Some(directions) => start_of_move(cell, &joints, &directions),
            None => before,
        };
        Planned { pose_id, role, joints, from, payload_kg, time_s, dwell_s }
    });
    planned.collect()
}

/// From which side each joint comes to configuration `pose_id`: whether upwards; `None` where it comes straight from the last one.
fn directions(cell: &Cell<'_>, pose_id: usize) -> Option<Vec<bool>> {
    let count = cell.arm.joint_count();
    match cell.plan.approach.policy {
        ApproachPolicy::Direct => None,
        ApproachPolicy::Up => Some(vec![true; count]),
        ApproachPolicy::Down => Some(vec![false; count]),
        ApproachPolicy::Alternate => Some(vec![pose_id.is_multiple_of(2); count]),
        ApproachPolicy::Random => {
            // By the configuration, so that repeats are approached alike wherever they stand.
            let mut coins = stream(cell.seed, &format!("plan/approach/{pose_id}"));
            Some((0..count).map(|_| coins.unit() < 0.5).collect())
        }
    }
}

/// Where the last move begins; on the other side where a limit is in the way, at the further limit where both are.
fn start_of_move(cell: &Cell<'_>, joints: &[f64], upwards: &[bool]) -> Vec<f64> {
    let approach = &cell.plan.approach;
    let start = |((joint, upwards), of): ((&f64, &bool), &Joint)| {
        let travel = if of.kind == JointKind::Revolute { approach.travel_rad } else { approach.travel_m };
        let sides = [joint - travel, joint + travel];
        let [wanted, other] = if *upwards { sides } else { [sides[1], sides[0]] };
        let (below, above) = (joint - of.lower, of.upper - joint);
        match (of.lower..=of.upper).contains(&wanted) {
            true => wanted,
            false if (of.lower..=of.upper).contains(&other) => other,
            false if below > above => of.lower,
            false => of.upper,
        }
    };
    joints.iter().zip(upwards).zip(&cell.arm.chain.joints).map(start).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    fn scene(settings: &[(&str, &str)]) -> Scene {
        let mut file = crate::lab::reproduce::arms::arms().unwrap().swap_remove(0);
        for (key, value) in settings {
            file.set(key, value).unwrap();
        }
        file.scene
    }

    fn configurations(scene: &Scene, count: usize) -> Vec<Vec<f64>> {
        let mut stream = stream(5, "test/plan");
        let of = |stream: &mut crate::seed::Stream| {
            scene.arm.chain.joints.iter().map(|of| stream.uniform(of.lower, of.upper)).collect()
        };
        (0..count).map(|_| of(&mut stream)).collect()
    }

    #[test]
    fn without_settings_every_configuration_is_read_once_straight_from_the_last() {
        let scene = scene(&[]);
        let all = configurations(&scene, 10);
        let planned = plan(&scene.cell(), &all[..6], &all[6..]);
        let mut order: Vec<usize> = (0..10).collect();
        stream(scene.seed, "plan/order").shuffle(&mut order);
        assert_eq!(planned.iter().map(|row| row.pose_id).collect::<Vec<_>>(), order);
        for (index, row) in planned.iter().enumerate() {
            assert_eq!(row.joints, all[row.pose_id]);
            assert_eq!(row.role, if row.pose_id < 6 { Role::Fit } else { Role::HeldOut });
            assert_eq!((row.time_s, row.payload_kg), (index as f64 * scene.plan.seconds_per_pose, 0.0));
            let before = index.checked_sub(1).map_or_else(|| vec![0.0; 8], |before| planned[before].joints.clone());
            assert_eq!(row.from, before);
        }
    }

    #[test]
    fn repeats_share_number_payload_and_approach() {
        for policy in ["up", "down", "alternate", "random"] {
            let policy = format!("\"{policy}\"");
            let scene = scene(&[
                ("plan.repeats", "3"),
                ("plan.approach", &policy),
                ("plan.payloads_kg", "[0, 5]"),
                ("plan.payload_blocks", "true"),
            ]);
            let all = configurations(&scene, 20);
            let planned = plan(&scene.cell(), &all[..14], &all[14..]);
            assert_eq!(planned.len(), 60);
            assert!(planned.windows(2).all(|pair| pair[0].payload_kg <= pair[1].payload_kg));
            for (pose_id, joints) in all.iter().enumerate() {
                let repeats: Vec<&Planned> = planned.iter().filter(|row| row.pose_id == pose_id).collect();
                assert_eq!(repeats.len(), 3);
                for row in &repeats {
                    assert_eq!((&row.from, &row.joints, row.payload_kg), (&repeats[0].from, joints, repeats[0].payload_kg));
                    for (joint, (from, to)) in row.from.iter().zip(&row.joints).enumerate() {
                        let of = &scene.arm.chain.joints[joint];
                        assert!((of.lower..=of.upper).contains(from));
                        assert!(((from - to).abs() - 5f64.to_radians()).abs() < 1e-12);
                        let upwards = match policy.as_str() {
                            "\"up\"" => Some(true),
                            "\"down\"" => Some(false),
                            "\"alternate\"" => Some(pose_id % 2 == 0),
                            _ => None,
                        };
                        let free = to - of.lower > 0.1 && of.upper - to > 0.1;
                        assert!(!free || upwards.is_none_or(|upwards| (from < to) == upwards));
                    }
                }
            }
            let ups = planned.iter().flat_map(Planned::approach).filter(|direction| *direction > 0).count();
            match policy.as_str() {
                "\"up\"" => assert!(ups > 460),
                "\"down\"" => assert!(ups < 20),
                _ => assert!((140..340).contains(&ups), "{ups} of 480"),
            }
        }
    }

    #[test]
    fn repeats_never_follow_each_other() {
        for (configured, repeats) in [(2, 2), (3, 5), (20, 3), (60, 2)] {
            for blocks in ["false", "true"] {
                let scene = scene(&[
                    ("plan.repeats", &repeats.to_string()),
                    ("plan.payloads_kg", if configured > 3 { "[0, 5]" } else { "[0]" }),
                    ("plan.payload_blocks", blocks),
                ]);
                let planned = plan(&scene.cell(), &configurations(&scene, configured), &[]);
                assert_eq!(planned.len(), configured * repeats);
                for pose_id in 0..configured {
                    assert_eq!(planned.iter().filter(|row| row.pose_id == pose_id).count(), repeats);
                }
                assert!(planned.windows(2).all(|pair| pair[0].pose_id != pair[1].pose_id), "{configured} × {repeats}, {blocks}");
                assert!(planned.iter().skip(1).all(|row| row.approach().iter().any(|direction| *direction != 0)));
            }
        }
        // Nothing to part them with.
        let scene = scene(&[("plan.repeats", "3")]);
        assert_eq!(plan(&scene.cell(), &configurations(&scene, 1), &[]).len(), 3);
    }

    #[test]
    fn joints_with_less_room_than_the_travel_come_from_their_further_limit() {
        let scene = scene(&[("plan.approach", "\"random\""), ("plan.approach_travel_deg", "10000")]);
        let all = configurations(&scene, 30);
        for row in plan(&scene.cell(), &all, &[]) {
            for ((from, to), joint) in row.from.iter().zip(&row.joints).zip(&scene.arm.chain.joints) {
                let further = if to - joint.lower > joint.upper - to { joint.lower } else { joint.upper };
                assert_eq!(*from, further);
            }
        }
    }

    #[test]
    fn a_plan_that_cannot_tell_the_noise_or_warms_nothing_is_told() {
        let mut file = crate::lab::reproduce::arms::arm8().unwrap();
        let count = |file: &crate::scene::SceneFile| notes(&file.scene.cell(), file.injected.as_ref().unwrap()).len();
        assert!(notes(&file.scene.cell(), file.injected.as_ref().unwrap())[0].contains("plan.repeats"));
        assert_eq!(count(&file), 1);
        file.set("plan.repeats", "2").unwrap();
        assert_eq!(count(&file), 0);
        let mut text = file.toml().clone();
        text.plan.temperature = None;
        let cold = crate::scene::parse(&toml::to_string(&text).unwrap(), "cold").unwrap();
        assert!(notes(&cold.scene.cell(), cold.injected.as_ref().unwrap())[0].contains("link_thermal_growth does nothing"));
    }

    #[test]
    fn what_was_measured_tells_how_it_was_planned() {
        let scene = scene(&[
            ("plan.repeats", "2"),
            ("plan.approach", "\"random\""),
            ("plan.payloads_kg", "[0, 5]"),
            ("plan.dwell_s", "2"),
        ]);
        let all = configurations(&scene, 12);
        let planned = plan(&scene.cell(), &all[..8], &all[8..]);
        let measured = planned.iter().enumerate().map(|(index, row)| Measurement {
            index,
            pose_id: row.pose_id,
            role: row.role,
            joints: row.joints.clone(),
            payload_kg: Some(row.payload_kg),
            time_s: row.time_s,
            ..Measurement::default()
        });
        assert_eq!(as_measured(&scene.cell(), &measured.collect::<Vec<_>>()), planned);
    }
}
