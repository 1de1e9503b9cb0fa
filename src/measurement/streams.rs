//! Joint readings and target poses that come as two streams, each with its own clock, made into the rows of a table: one for each time that
//! the arm stood still, or one for each pose of a moving arm; and the time by which one clock is behind the other.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::Measurement;

/// The arm stands still where no joint moves by more than this (rad or m) while a window of [`WINDOW`] passes.
const STILL: f64 = 5e-4;
/// Half of the window in which the arm must stand still, s.
const WINDOW: f64 = 0.15;
/// Joint readings further apart than this (s) say nothing of the time between.
const GAP: f64 = 0.25;
/// Times of standing still that make a table of their own; with fewer, poses of the moving arm are rows, too.
const ENOUGH: usize = 6;
/// Least time between rows of a moving arm, s: nearer ones tell the same.
const APART: f64 = 0.05;
/// Largest difference of the clocks that is looked for, s, and the first steps of looking.
const LONGEST: f64 = 0.5;
const STEPS: i32 = 50;
/// Poses that are looked at for it.
const LOOKED_AT: usize = 400;
/// A joint moves where it is faster than this, rad/s or m/s.
const MOVES: f64 = 0.02;

/// Joints at a time.
#[derive(Clone, Debug, PartialEq)]
pub struct JointSample {
    /// s, since any time.
    pub time_s: f64,
    /// From the base outwards, rad (m for prismatic joints).
    pub joints: Vec<f64>,
}

/// What was read of the target at a time.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseSample {
    /// s, since the same time as that of the joints.
    pub time_s: f64,
    /// In the measurement frame, m.
    pub position_m: [f64; 3],
    /// As quaternion x, y, z, w; none where positions alone were read.
    pub orientation_xyzw: Option<[f64; 4]>,
}

/// Both streams, in the order of their times.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Streams {
    /// Joint readings.
    pub joints: Vec<JointSample>,
    /// Poses.
    pub poses: Vec<PoseSample>,
}

/// By how much poses are stamped later than joint readings of the same moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Latency {
    /// s.
    pub seconds: f64,
    /// One standard error of it, s, as if what is left were noise.
    pub standard_error: f64,
    /// RMS distance of poses from where a nominal arm has them, m: with clocks that agree, and with this shift.
    pub left_m: [f64; 2],
}

/// Rows of a table, and how they came to be.
#[derive(Clone, Debug, PartialEq)]
pub struct Rows {
    /// The rows; times begin at zero.
    pub measurements: Vec<Measurement>,
    /// Whether the arm stood still at each.
    pub still: bool,
    /// Poses that are in no row: the arm moved, or no joint reading is near.
    pub unused: usize,
}

impl Streams {
    /// Sorts both by time; of samples at one time the first counts.
    #[must_use]
    pub fn new(mut joints: Vec<JointSample>, mut poses: Vec<PoseSample>) -> Streams {
        joints.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        joints.dedup_by(|a, b| a.time_s == b.time_s);
        poses.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        poses.dedup_by(|a, b| a.time_s == b.time_s);
        Streams { joints, poses }
    }

    /// Joints at `time_s`, between the two readings about it; the nearest where these are far apart. None where none is near.
    fn at(&self, time_s: f64) -> Option<Vec<f64>> {
        let after = self.joints.partition_point(|sample| sample.time_s < time_s);
        let (before, next) = (after.checked_sub(1).map(|at| &self.joints[at]), self.joints.get(after));
        if let (Some(before), Some(next)) = (before, next)
            && next.time_s - before.time_s <= GAP
        {
            let share = (time_s - before.time_s) / (next.time_s - before.time_s);
            return Some(before.joints.iter().zip(&next.joints).map(|(a, b)| a + share * (b - a)).collect());
        }
        let near = |sample: &&JointSample| (sample.time_s - time_s).abs() <= GAP / 2.0;
        let nearest = before.into_iter().chain(next).filter(near);
        nearest.min_by(|a, b| (a.time_s - time_s).abs().total_cmp(&(b.time_s - time_s).abs())).map(|of| of.joints.clone())
    }

    /// Joint readings within half a window of `time_s`.
    fn about(&self, time_s: f64) -> &[JointSample] {
        let first = self.joints.partition_point(|sample| sample.time_s < time_s - WINDOW);
        let last = self.joints.partition_point(|sample| sample.time_s <= time_s + WINDOW);
        &self.joints[first..last.max(first)]
    }

    /// Whether no joint moves about `time_s`: as far as is known, for a joint that is read once a pose may well stand.
    fn is_still(&self, time_s: f64) -> bool {
        let about = self.about(time_s);
        let count = about.first().map_or(0, |of| of.joints.len());
        (0..count).all(|joint| {
            let values = about.iter().map(|of| of.joints[joint]);
            values.clone().fold(f64::NEG_INFINITY, f64::max) - values.fold(f64::INFINITY, f64::min) <= STILL
        })
    }

    /// Fastest joint about `time_s`, rad/s or m/s; zero where too few readings are near.
    fn speed(&self, time_s: f64) -> f64 {
        let about = self.about(time_s);
        let (Some(first), Some(last)) = (about.first(), about.last()) else {
            return 0.0;
        };
        let span = last.time_s - first.time_s;
        let fastest = first.joints.iter().zip(&last.joints).map(|(a, b)| (b - a).abs()).fold(0.0, f64::max);
        if span > 0.0 { fastest / span } else { 0.0 }
    }

    /// By how much poses are stamped late, where the arm moves enough to tell. `left` says how far (root mean square, m) a nominal arm with
    /// these joints misses these positions, base and target placed anew; none where they do not tell.
    #[must_use]
    pub fn latency(&self, left: impl Fn(&[Vec<f64>], &[Vector3<f64>]) -> Option<f64>) -> Option<Latency> {
        let moving: Vec<&PoseSample> = self.poses.iter().filter(|pose| self.speed(pose.time_s) > MOVES).collect();
        // Poses near one another in time would make the standard error too small.
        let mut chosen: Vec<&PoseSample> = Vec::new();
        for pose in moving {
            if chosen.last().is_none_or(|last| pose.time_s - last.time_s >= APART) {
                chosen.push(pose);
            }
        }
        let step = chosen.len().div_ceil(LOOKED_AT).max(1);
        // Those that all shifts that are looked at have joints for.
        let inside = |pose: &&PoseSample| [-LONGEST, LONGEST].iter().all(|shift| self.at(pose.time_s + shift).is_some());
        let chosen: Vec<&PoseSample> = chosen.into_iter().step_by(step).filter(inside).collect();
        if chosen.len() < 2 * ENOUGH {
            return None;
        }
        let positions: Vec<Vector3<f64>> = chosen.iter().map(|pose| pose.position_m.into()).collect();
        let of = |shift: f64| -> Option<f64> {
            let joints: Option<Vec<Vec<f64>>> = chosen.iter().map(|pose| self.at(pose.time_s - shift)).collect();
            left(&joints?, &positions)
        };
        let without = of(0.0)?;
        let width = LONGEST / f64::from(STEPS);
        let grid = (-STEPS..=STEPS).filter_map(|step| Some((f64::from(step) * width, of(f64::from(step) * width)?)));
        let best = grid.min_by(|a, b| a.1.total_cmp(&b.1))?;
        // The square is a parabola near its least value.
        let (mut middle, mut half) = (best.0, width);
        let mut curvature = 0.0;
        for _ in 0..4 {
            let [below, here, above] = [of(middle - half)?, of(middle)?, of(middle + half)?].map(|value| value * value);
            curvature = (below - 2.0 * here + above) / (half * half);
            if curvature <= 0.0 {
                return None;
            }
            middle += (0.5 * (below - above) / (curvature * half)).clamp(-half, half);
            half *= 0.3;
        }
        let rest = of(middle)?;
        // A sum of squares of 3 n numbers with the mean square rest² / 3 grows by one of these in one standard error.
        let count = chosen.len() as f64;
        let standard_error = libm::sqrt(2.0 * rest * rest / 3.0 / (curvature * count));
        Some(Latency { seconds: middle, standard_error, left_m: [without, rest] })
    }

    /// The rows, where poses are stamped `latency_s` late: one for each time that the arm stood still (the means of all that was read then), or
    /// where these are few, or `moving` is asked for, one for each pose.
    #[must_use]
    pub fn rows(&self, latency_s: f64, moving: bool) -> Rows {
        let mut stood: Vec<Vec<(f64, Vec<f64>, &PoseSample)>> = Vec::new();
        let mut all: Vec<(f64, Vec<f64>, &PoseSample)> = Vec::new();
        for pose in &self.poses {
            let time_s = pose.time_s - latency_s;
            let Some(joints) = self.at(time_s) else {
                continue;
            };
            if all.last().is_none_or(|(last, ..)| time_s - last >= APART) {
                all.push((time_s, joints.clone(), pose));
            }
            if !self.is_still(time_s) {
                continue;
            }
            let same = |(last, before, _): &(f64, Vec<f64>, &PoseSample)| {
                time_s - last <= 4.0 * GAP && before.iter().zip(&joints).all(|(a, b)| (a - b).abs() <= STILL)
            };
            match stood.last_mut() {
                Some(own)
                    if own
                        .first()
                        .is_some_and(|(_, before, _)| before.iter().zip(&joints).all(|(a, b)| (a - b).abs() <= STILL))
                        && own.last().is_some_and(same) =>
                {
                    own.push((time_s, joints, pose));
                }
                _ => stood.push(vec![(time_s, joints, pose)]),
            }
        }
        let still = !moving && stood.len() >= ENOUGH;
        let groups: Vec<Vec<(f64, Vec<f64>, &PoseSample)>> =
            if still { stood } else { all.into_iter().map(|one| vec![one]).collect() };
        let used: usize = groups.iter().map(Vec::len).sum();
        let begin = groups.first().and_then(|group| group.first()).map_or(0.0, |(time, ..)| *time);
        let measurements = groups.iter().enumerate().map(|(index, group)| mean(index, group, begin)).collect();
        Rows { measurements, still, unused: self.poses.len() - used.min(self.poses.len()) }
    }
}

/// The mean of what was read while the arm stood.
fn mean(index: usize, group: &[(f64, Vec<f64>, &PoseSample)], begin: f64) -> Measurement {
    let count = group.len() as f64;
    let joints = (0..group[0].1.len()).map(|joint| group.iter().map(|(_, joints, _)| joints[joint]).sum::<f64>() / count);
    let position: Vector3<f64> = group.iter().map(|(.., pose)| Vector3::from(pose.position_m)).sum::<Vector3<f64>>() / count;
    // Quaternions of one pose differ by little, but for their sign.
    let turns: Option<Vec<[f64; 4]>> = group.iter().map(|(.., pose)| pose.orientation_xyzw).collect();
    let orientation = turns.and_then(|turns| {
        let first = turns[0];
        let sum = turns.iter().fold([0.0; 4], |sum, turn| {
            let sign = if first.iter().zip(turn).map(|(a, b)| a * b).sum::<f64>() < 0.0 { -1.0 } else { 1.0 };
            std::array::from_fn(|at| sum[at] + sign * turn[at])
        });
        let [x, y, z, w]: [f64; 4] = sum;
        let unit = UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-9)?;
        Some(unit.coords.into())
    });
    Measurement {
        index,
        pose_id: index,
        time_s: group.iter().map(|(time, ..)| time).sum::<f64>() / count - begin,
        joints: joints.collect(),
        position_m: position.into(),
        orientation_xyzw: orientation,
        ..Measurement::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::stream;

    /// An arm of two joints in a plane that moves from one stand to the next, its target read late and with noise.
    fn streams(late_s: f64) -> (Streams, Vec<Vec<f64>>) {
        let mut draws = stream(1, "test/streams");
        let mut stands: Vec<Vec<f64>> = vec![vec![0.0, 0.0]];
        let (mut joints, mut poses) = (Vec::new(), Vec::new());
        let at = |time: f64, stands: &[Vec<f64>]| -> Vec<f64> {
            // A second of standing, a second of moving.
            let (number, within) = ((time / 2.0) as usize, time % 2.0);
            let share = (within - 1.0).clamp(0.0, 1.0);
            let share = share * share * (3.0 - 2.0 * share);
            stands[number].iter().zip(&stands[number + 1]).map(|(a, b)| a + share * (b - a)).collect()
        };
        for _ in 0..22 {
            stands.push(vec![draws.uniform(-1.0, 1.0), draws.uniform(-1.0, 1.0)]);
        }
        for tick in 0..4000 {
            let time = 0.01 * f64::from(tick);
            joints.push(JointSample { time_s: time, joints: at(time, &stands) });
            if tick % 3 == 0 && time > late_s {
                let then = at(time - late_s, &stands);
                let position = forward(&then) + Vector3::from_fn(|_, _| 1e-4 * draws.normal());
                poses.push(PoseSample { time_s: time, position_m: position.into(), orientation_xyzw: None });
            }
        }
        (Streams::new(joints, poses), stands)
    }

    fn forward(joints: &[f64]) -> Vector3<f64> {
        let both = joints[0] + joints[1];
        Vector3::new(0.5 * joints[0].cos() + 0.4 * both.cos(), 0.5 * joints[0].sin() + 0.4 * both.sin(), 0.0)
    }

    fn left(joints: &[Vec<f64>], read: &[Vector3<f64>]) -> Option<f64> {
        let sum: f64 = joints.iter().zip(read).map(|(joints, read)| (forward(joints) - read).norm_squared()).sum();
        Some((sum / read.len() as f64).sqrt())
    }

    #[test]
    fn clocks_that_differ_are_found_and_put_right() {
        for late in [0.0, 0.05, -0.12] {
            let (streams, _) = streams(late);
            let found = streams.latency(left).unwrap();
            assert!((found.seconds - late).abs() < 1e-3, "{late}: {found:?}");
            assert!((found.seconds - late).abs() < 5.0 * found.standard_error.max(1e-4), "{late}: {found:?}");
            assert!(found.left_m[1] < 5e-4, "{found:?}");
        }
    }

    #[test]
    fn there_is_a_row_for_each_stand_and_it_is_the_mean_of_what_was_read() {
        let (streams, stands) = streams(0.05);
        let rows = streams.rows(0.05, false);
        assert!(rows.still && rows.measurements.len() == 20, "{}", rows.measurements.len());
        for (row, stand) in rows.measurements.iter().zip(&stands) {
            assert!(row.joints.iter().zip(stand).all(|(a, b)| (a - b).abs() < 2e-4), "{:?} {stand:?}", row.joints);
            assert!((Vector3::from(row.position_m) - forward(&row.joints)).norm() < 1e-4);
        }
        let moving = streams.rows(0.05, true);
        assert!(!moving.still && moving.measurements.len() > 400);
    }

    #[test]
    fn a_reading_for_each_pose_is_a_row_of_its_own() {
        let joints: Vec<JointSample> =
            (0..8).map(|at| JointSample { time_s: 5.0 * f64::from(at), joints: vec![0.1 * f64::from(at)] }).collect();
        let pose = |time_s| PoseSample { time_s, position_m: [time_s, 0.0, 0.0], orientation_xyzw: None };
        // The last one is between two readings.
        let poses: Vec<PoseSample> = joints.iter().map(|of| pose(of.time_s + 0.02)).chain([pose(12.5)]).collect();
        let rows = Streams::new(joints.clone(), poses).rows(0.0, false);
        assert_eq!((rows.measurements.len(), rows.unused), (8, 1));
        assert!(rows.measurements.iter().zip(&joints).all(|(row, of)| row.joints == of.joints));
    }
}
