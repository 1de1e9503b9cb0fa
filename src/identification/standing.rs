//! Where an arm stands in the measurement frame and where its target sits on the tool, for a fit to begin with: the arm as its file says,
//! from readings in a frame that nobody knows.
//!
//! Readings of which the tool's origin alone tells where the arm stands (a reflector near the flange) are the usual case. A target far
//! from the flange, few axes or a wrist that only turns need more: orientations give both rotations at once (Shah 2013), and
//! positions alone are tried from many places of the target.

use nalgebra::{Matrix3, SMatrix, UnitQuaternion, Vector3};

use crate::arm::frames::{Pose, pose_from_parts, registration};
use crate::measurement::Measurement;

/// Readings that are looked at, spread over all of them.
const LOOKED_AT: usize = 120;
/// What is left of the readings' spread is no doubt about where the arm stands.
const SURE: f64 = 0.05;
/// Places of the target that are tried, over the spread of the readings.
const DISTANCES: [f64; 3] = [0.1, 0.3, 1.0];
/// Rounds of placing base and target in turn, of a trial and of the best ones.
const ROUNDS: [usize; 2] = [6, 60];
/// Trials that are followed to the end.
const FOLLOWED: usize = 3;
/// Rounds of leaving out readings that are far off.
const ROUNDS_OF_MOST: usize = 20;
/// How far a reading may be off over the median of all distances, before it is left out of the start.
const FAR_OFF: f64 = 3.0;
/// Keeps the target where nothing tells it, next to sums over readings of about one.
const DAMPING: f64 = 1e-9;

/// Where an arm stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Standing {
    /// Its root in the measurement frame.
    pub measurement_from_root: Pose,
    /// Each target on its tool.
    pub tool_from_target: Vec<Pose>,
    /// Root of the mean square of what is left of the positions, m.
    pub left_m: f64,
    /// Root of the mean square of their distances from their mean, m.
    pub spread_m: f64,
}

impl Standing {
    /// What is left as a share of the spread: how much of the positions' variance the arm does not explain.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.left_m / self.spread_m.max(f64::MIN_POSITIVE)
    }
}

/// One reading: its row, the tool in root, the target's measured position and orientation, and which target.
#[derive(Clone, Copy, Debug)]
struct Sight {
    row: usize,
    tool: Pose,
    axes: Matrix3<f64>,
    position: Vector3<f64>,
    orientation: Option<UnitQuaternion<f64>>,
    target: usize,
}

/// Where the arm whose tool is at `tools` (in root) stands, from `measurements` of which number `target[row]` of `targets` was read.
/// `None` where they do not tell at all.
#[must_use]
pub fn stand(tools: &[Pose], measurements: &[&Measurement], target: &[usize], targets: usize) -> Option<Standing> {
    // A coordinate that was not read is taken as zero where there are no others: near enough to begin with.
    let whole: Vec<usize> = (0..measurements.len()).filter(|row| measurements[*row].unread == [false; 3]).collect();
    let every: Vec<usize> = (0..measurements.len()).collect();
    let of_whole = if whole.is_empty() { None } else { stand_of(&whole, tools, measurements, target, targets) };
    of_whole.or_else(|| stand_of(&every, tools, measurements, target, targets))
}

fn stand_of(rows: &[usize], tools: &[Pose], measurements: &[&Measurement], target: &[usize], targets: usize) -> Option<Standing> {
    let sights: Vec<Sight> = rows
        .iter()
        .map(|row| Sight {
            row: *row,
            tool: tools[*row],
            axes: tools[*row].rotation.to_rotation_matrix().into_inner(),
            position: measurements[*row].position().coords,
            orientation: measurements[*row].orientation(),
            target: target[*row],
        })
        .collect();
    let mut kept = sights.clone();
    let mut found = stand_once(&kept, targets)?;
    // A reading that is a metre off would carry the base along: those that are far from where most of them are go out, and come back
    // where the next start has them near.
    for _ in 0..ROUNDS_OF_MOST {
        let off = distances(&sights, &found);
        let mut sorted = off.clone();
        sorted.sort_by(f64::total_cmp);
        let limit = FAR_OFF * sorted[sorted.len() / 2];
        let near: Vec<Sight> = sights.iter().zip(&off).filter(|(_, off)| **off <= limit).map(|(sight, _)| *sight).collect();
        let same = near.len() == kept.len() && near.iter().zip(&kept).all(|(a, b)| a.row == b.row);
        let every_target = (0..targets).all(|target| near.iter().any(|sight| sight.target == target));
        if same || !every_target {
            break;
        }
        let Some(next) = stand_once(&near, targets) else {
            break;
        };
        (kept, found) = (near, next);
    }
    Some(with_orientations(found, &kept))
}

fn stand_once(sights: &[Sight], targets: usize) -> Option<Standing> {
    let near = placed(sights, &vec![Vector3::zeros(); targets]);
    if let Some(near) = near.filter(|near| near.share() < SURE) {
        return Some(near);
    }
    let step = sights.len().div_ceil(LOOKED_AT).max(1);
    let few: Vec<Sight> = sights.iter().step_by(step).copied().collect();
    let best = of_orientations(&few, targets).into_iter().chain(of_positions(&few, targets));
    best.min_by(|a, b| a.left_m.total_cmp(&b.left_m))
}

/// How far off each reading is, m.
fn distances(sights: &[Sight], found: &Standing) -> Vec<f64> {
    let target = |sight: &Sight| sight.tool * nalgebra::Point3::from(found.tool_from_target[sight.target].translation.vector);
    sights.iter().map(|sight| ((found.measurement_from_root * target(sight)).coords - sight.position).norm()).collect()
}

/// Places the base where the targets are at `offsets` on the tool.
fn placed(sights: &[Sight], offsets: &[Vector3<f64>]) -> Option<Standing> {
    let from: Vec<Vector3<f64>> =
        sights.iter().map(|sight| sight.tool.translation.vector + sight.axes * offsets[sight.target]).collect();
    let to: Vec<Vector3<f64>> = sights.iter().map(|sight| sight.position).collect();
    let base = registration(&from, &to)?;
    Some(standing(sights, base, offsets))
}

fn standing(sights: &[Sight], base: Pose, offsets: &[Vector3<f64>]) -> Standing {
    let count = sights.len().max(1) as f64;
    let centre = sights.iter().map(|sight| sight.position).sum::<Vector3<f64>>() / count;
    let spread: f64 = sights.iter().map(|sight| (sight.position - centre).norm_squared()).sum();
    let left = |sight: &Sight| {
        let target = sight.tool.translation.vector + sight.axes * offsets[sight.target];
        (sight.position - base.rotation * target - base.translation.vector).norm_squared()
    };
    Standing {
        measurement_from_root: base,
        tool_from_target: offsets.iter().map(|offset| Pose::from_parts((*offset).into(), UnitQuaternion::identity())).collect(),
        left_m: libm::sqrt(sights.iter().map(left).sum::<f64>() / count),
        spread_m: libm::sqrt(spread / count),
    }
}

/// Turns the targets as the first reading of each has them.
fn with_orientations(mut standing: Standing, sights: &[Sight]) -> Standing {
    for (number, target) in standing.tool_from_target.iter_mut().enumerate() {
        let first = sights.iter().find(|sight| sight.target == number);
        if let Some((sight, orientation)) = first.and_then(|sight| Some((sight, sight.orientation?))) {
            target.rotation = (standing.measurement_from_root.rotation * sight.tool.rotation).inverse() * orientation;
        }
    }
    standing
}

/// From many places of the targets, base and targets placed in turn; the best.
fn of_positions(sights: &[Sight], targets: usize) -> Option<Standing> {
    let spread = standing(sights, Pose::identity(), &vec![Vector3::zeros(); targets]).spread_m;
    let directions = [Vector3::x(), Vector3::y(), Vector3::z()];
    let away = DISTANCES.iter().flat_map(|distance| directions.map(|axis| axis * (*distance * spread)));
    let starts = std::iter::once(Vector3::zeros()).chain(away.flat_map(|offset| [offset, -offset]));
    let mut trials: Vec<Standing> = starts.filter_map(|start| in_turn(sights, vec![start; targets], ROUNDS[0])).collect();
    trials.sort_by(|a, b| a.left_m.total_cmp(&b.left_m));
    let followed = trials.into_iter().take(FOLLOWED).filter_map(|trial| {
        let offsets = trial.tool_from_target.iter().map(|target| target.translation.vector).collect();
        in_turn(sights, offsets, ROUNDS[1])
    });
    followed.min_by(|a, b| a.left_m.total_cmp(&b.left_m))
}

/// Places the base given the targets and these given the base, `rounds` times.
pub(super) fn in_turn_of(tools: &[Pose], positions: &[Vector3<f64>], rounds: usize) -> Option<Standing> {
    let sight = |(row, (tool, position)): (usize, (&Pose, &Vector3<f64>))| Sight {
        row,
        tool: *tool,
        axes: tool.rotation.to_rotation_matrix().into_inner(),
        position: *position,
        orientation: None,
        target: 0,
    };
    let sights: Vec<Sight> = tools.iter().zip(positions).enumerate().map(sight).collect();
    in_turn(&sights, vec![Vector3::zeros()], rounds)
}

fn in_turn(sights: &[Sight], mut offsets: Vec<Vector3<f64>>, rounds: usize) -> Option<Standing> {
    let mut found = placed(sights, &offsets)?;
    for _ in 0..rounds {
        offsets = targets_on_tool(sights, &found.measurement_from_root, &offsets);
        found = placed(sights, &offsets)?;
    }
    Some(found)
}

/// The targets nearest to the readings where the base stands at `base`.
fn targets_on_tool(sights: &[Sight], base: &Pose, before: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let mut sums = vec![(DAMPING, Vector3::zeros()); before.len()];
    for sight in sights {
        let in_root = base.inverse_transform_vector(&(sight.position - base.translation.vector));
        let (count, sum) = &mut sums[sight.target];
        *count += 1.0;
        *sum += sight.axes.transpose() * (in_root - sight.tool.translation.vector);
    }
    sums.into_iter().map(|(count, sum)| sum / count).collect()
}

/// Base and target from orientations `R = Z A X` of the tool's `A`: the rotations by the singular vectors of `sum A x R` (Shah, Solving the
/// robot-world/hand-eye calibration problem using the Kronecker product, 2013), then the positions, which are linear in what is left. The
/// first target tells the base's rotation.
fn of_orientations(sights: &[Sight], targets: usize) -> Option<Standing> {
    let seen: Vec<(Matrix3<f64>, Matrix3<f64>)> = sights
        .iter()
        .filter(|sight| sight.target == 0)
        .filter_map(|sight| Some((sight.axes, sight.orientation?.to_rotation_matrix().into_inner())))
        .collect();
    if seen.len() < 3 {
        return None;
    }
    let mut sum = SMatrix::<f64, 9, 9>::zeros();
    for (ours, read) in &seen {
        sum += ours.kronecker(read);
    }
    let svd = sum.svd(true, true);
    let largest = svd.singular_values.imax();
    let vector = svd.u?.column(largest).into_owned();
    let matrix = Matrix3::from_column_slice(vector.as_slice());
    let matrix = if matrix.determinant() < 0.0 { -matrix } else { matrix };
    let parts = matrix.svd(true, true);
    let rotation = parts.u? * parts.v_t?;
    let turn = pose_from_parts(&rotation, &Vector3::zeros()).rotation;
    // Positions: `read = turn (tool + axes offset) + shift`, one offset per target.
    let width = 3 + 3 * targets;
    let mut normal = nalgebra::DMatrix::<f64>::identity(width, width) * DAMPING;
    let mut right = nalgebra::DVector::<f64>::zeros(width);
    for sight in sights {
        let mut row = nalgebra::DMatrix::<f64>::zeros(3, width);
        row.view_mut((0, 0), (3, 3)).copy_from(&Matrix3::identity());
        row.view_mut((0, 3 + 3 * sight.target), (3, 3)).copy_from(&(rotation * sight.axes));
        let left = sight.position - rotation * sight.tool.translation.vector;
        normal += row.tr_mul(&row);
        right += row.tr_mul(&left);
    }
    let solved = normal.cholesky()?.solve(&right);
    let offsets: Vec<Vector3<f64>> = (0..targets).map(|target| solved.fixed_rows::<3>(3 + 3 * target).into_owned()).collect();
    let base = Pose::from_parts(Vector3::from(solved.fixed_rows::<3>(0)).into(), turn);
    Some(standing(sights, base, &offsets))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::frames::rotation_from_vector;
    use crate::seed::{Stream, stream};

    fn pose(size: f64, draws: &mut Stream) -> Pose {
        let mut three = |size: f64| Vector3::from_fn(|_, _| draws.uniform(-size, size));
        let turn = rotation_from_vector(&three(1.5));
        Pose::from_parts(three(size).into(), turn)
    }

    /// Readings of an arm of which `tools` are the poses, in a frame of their own with a target `far` from the tool.
    fn readings(tools: &[Pose], far: f64, orientation: bool, draws: &mut Stream) -> Vec<Measurement> {
        let (base, target) = (pose(2.0, draws), pose(far, draws));
        let read = |tool: &Pose| {
            let there = base * tool * target;
            let orientation_xyzw = orientation.then(|| there.rotation.coords.into());
            Measurement { position_m: there.translation.vector.into(), orientation_xyzw, ..Measurement::default() }
        };
        tools.iter().map(read).collect()
    }

    /// Two axes that cross, turned over the whole circle: the tool's origin never moves, a target far off does.
    #[test]
    fn a_positioner_of_two_axes_is_found() {
        let mut draws = stream(1, "test/standing");
        for orientation in [true, false] {
            for _ in 0..5 {
                let tools: Vec<Pose> = (0..40)
                    .map(|row| {
                        let (first, second) = (0.7 * f64::from(row), 2.3 * f64::from(row) + 0.4);
                        let turn = rotation_from_vector(&(Vector3::z() * first)) * rotation_from_vector(&(Vector3::x() * second));
                        Pose::from_parts(Vector3::zeros().into(), turn)
                    })
                    .collect();
                let rows = readings(&tools, 1.0, orientation, &mut draws);
                let rows: Vec<&Measurement> = rows.iter().collect();
                let found = stand(&tools, &rows, &[0; 40], 1).unwrap();
                assert!(found.share() < 0.03, "{orientation}: {}", found.share());
            }
        }
    }

    #[test]
    fn several_targets_far_from_the_flange_are_found() {
        let mut draws = stream(2, "test/standing/targets");
        let tools: Vec<Pose> = (0..60).map(|_| pose(0.6, &mut draws)).collect();
        let mut rows = readings(&tools, 0.8, false, &mut draws);
        let base = pose(1.0, &mut draws);
        let offsets = [Vector3::new(0.9, 0.0, 0.3), Vector3::new(-0.4, 0.5, 0.0)];
        for (row, (tool, read)) in tools.iter().zip(&mut rows).enumerate() {
            read.position_m = (base * (tool * nalgebra::Point3::from(offsets[row % 2]))).coords.into();
        }
        let target: Vec<usize> = (0..60).map(|row| row % 2).collect();
        let found = stand(&tools, &rows.iter().collect::<Vec<_>>(), &target, 2).unwrap();
        assert!(found.share() < 0.01, "{}", found.share());
        assert!((found.tool_from_target[0].translation.vector - offsets[0]).norm() < 0.02);
    }
}
