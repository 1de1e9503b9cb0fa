//! Globality indexes: how the end points of a set of configurations lie in the workspace.

use nalgebra::Vector3;

use crate::arm::Arm;
use crate::quality::EvennessDomain;
use crate::seed::stream;

/// Configurations from which the reachable workspace is told. The cells that are reached grow slowly with this number; it is fixed
/// so that the index of a set is a property of the arm and the set.
const WORKSPACE_SAMPLES: usize = 100_000;

/// Dispersion D (eq. 20): mean squared distance of the end points to their centre, m².
#[must_use]
pub fn dispersion(end_points: &[Vector3<f64>]) -> f64 {
    if end_points.is_empty() {
        return 0.0;
    }
    let count = end_points.len() as f64;
    let centre = end_points.iter().sum::<Vector3<f64>>() / count;
    end_points.iter().map(|point| (point - centre).norm_squared()).sum::<f64>() / count
}

/// The points over which the evenness takes its supremum: a cubic grid in the workspace.
///
/// Two readings of "traversing the workspace by unit length" (eqs. 22–25): the cells that the arm reaches, or every cell of the
/// bounding cube around them, which is what the paper's Table 2 fits.
#[derive(Clone, Debug)]
pub struct WorkspaceGrid {
    /// Grid points in base, m, each near the one before it.
    points: Vec<Vector3<f64>>,
}

impl WorkspaceGrid {
    /// The grid of step `step_m` of the arm at its nominal parameters, within its joint limits (collisions are not looked at).
    #[must_use]
    pub fn new(arm: &Arm, domain: EvennessDomain, step_m: f64) -> Self {
        let cells = reached_cells(arm, step_m);
        let at = |cell: &[i32; 3]| Vector3::from(cell.map(|index| f64::from(index) * step_m));
        let points = match domain {
            EvennessDomain::Reachable => cells.iter().map(at).collect(),
            EvennessDomain::BoundingCube => {
                let bound = |axis: usize| {
                    let values = cells.iter().map(|cell| cell[axis]);
                    (values.clone().min().unwrap_or(0), values.max().unwrap_or(0))
                };
                let bounds = [bound(0), bound(1), bound(2)];
                let widest = bounds.iter().map(|(low, high)| high - low).max().unwrap_or(0);
                // A cube: every axis as wide as the widest, about the middle of what is reached.
                let starts = bounds.map(|(low, high)| low - (widest - (high - low)) / 2);
                (0..=widest)
                    .flat_map(|x| (0..=widest).flat_map(move |y| (0..=widest).map(move |z| [x, y, z])))
                    .map(|cell| at(&[cell[0] + starts[0], cell[1] + starts[1], cell[2] + starts[2]]))
                    .collect()
            }
        };
        WorkspaceGrid { points }
    }

    /// Number of grid points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there is no point, so that no evenness can be told.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// d_sup (eq. 23): the largest distance from a grid point to the nearest end point, m.
    #[must_use]
    pub fn largest_hole(&self, end_points: &[Vector3<f64>]) -> f64 {
        if end_points.is_empty() {
            return f64::INFINITY;
        }
        let mut largest = 0.0;
        let mut near = 0;
        'points: for y in &self.points {
            // One end point nearer than the largest hole so far rules a grid point out. The one that ruled out its neighbour
            // mostly does.
            let mut smallest = (end_points[near] - y).norm_squared();
            if smallest <= largest {
                continue;
            }
            for (index, x) in end_points.iter().enumerate() {
                let distance = (x - y).norm_squared();
                if distance <= largest {
                    near = index;
                    continue 'points;
                }
                smallest = smallest.min(distance);
            }
            largest = smallest;
        }
        largest.sqrt()
    }

    /// Evenness U (eq. 25): root of the dispersion over d_sup.
    #[must_use]
    pub fn evenness(&self, end_points: &[Vector3<f64>]) -> f64 {
        let hole = self.largest_hole(end_points);
        if hole > 0.0 { dispersion(end_points).sqrt() / hole } else { 0.0 }
    }
}

/// Cells of the grid that end points of random configurations fall into, in the order of their coordinates.
fn reached_cells(arm: &Arm, step_m: f64) -> Vec<[i32; 3]> {
    let chain = arm.chain.at_nominal();
    let mut stream = stream(0, "quality/workspace");
    let mut joints = vec![0.0; arm.joint_count()];
    let mut cells: Vec<[i32; 3]> = (0..WORKSPACE_SAMPLES)
        .map(|_| {
            for (value, joint) in joints.iter_mut().zip(&arm.chain.joints) {
                *value = stream.uniform(joint.lower, joint.upper);
            }
            let point = chain.end_point(&joints);
            [point.x, point.y, point.z].map(|coordinate| (coordinate / step_m).round() as i32)
        })
        .collect();
    cells.sort_unstable();
    cells.dedup();
    cells
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dispersion_by_hand() {
        let points = [
            Vector3::new(1.0, 0.0, 0.0),
            Vector3::new(-1.0, 0.0, 0.0),
            Vector3::new(0.0, 3.0, 0.0),
            Vector3::new(0.0, -3.0, 0.0),
        ];
        assert!((dispersion(&points) - 5.0).abs() < 1e-15);
    }

    #[test]
    fn the_largest_hole_is_that_of_the_definition() {
        let mut stream = stream(5, "test/hole");
        let mut point = || Vector3::new(stream.unit(), stream.unit(), stream.unit());
        let grid = WorkspaceGrid { points: (0..500).map(|_| point()).collect() };
        for count in [1, 3, 40] {
            let ends: Vec<_> = (0..count).map(|_| point()).collect();
            let plain =
                grid.points.iter().map(|y| ends.iter().map(|x| (x - y).norm()).fold(f64::INFINITY, f64::min)).fold(0.0, f64::max);
            assert!((grid.largest_hole(&ends) - plain).abs() < 1e-15);
        }
    }
}
