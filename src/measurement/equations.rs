//! What readings tell, as equations: each is one number that was read, about the pose of one reading, with its own sigma.
//!
//! This is the only place that knows how many numbers a reading has. A fit, a weighting or a signature asks here which components of a
//! pose there are; all give the six of a pose (position, then rotation vector, in the measurement frame) and take what was read. A
//! measurement that couples two poses, such as a distance, or that is about a point nobody knows, such as a fixed ball, is one more
//! way in [`Equations::pick`] to make numbers of poses.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};

use super::{Measurement, Sensor};

/// Components of a pose: x, y, z of the origin (m), then the rotation vector (rad).
pub const COMPONENTS: usize = 6;

/// The equations of some readings, in their order; those of a reading stand together.
#[derive(Clone, Debug, PartialEq)]
pub struct Equations {
    /// First equation of each reading, and last how many there are.
    first: Vec<usize>,
    /// Which component of its reading's pose each equation is about.
    component: Vec<usize>,
    /// Declared sigma of each, m or rad.
    sigma: Vec<f64>,
    /// Axes, in the measurement frame, along which the components of readings are that are not along that frame's own; empty for none.
    axes: Vec<Option<Matrix3<f64>>>,
}

impl Equations {
    /// What `measurements` tell, read by `sensor`: the components of the position that were read, and the orientation where every one of
    /// them has one and the sensor says how well.
    #[must_use]
    pub fn new(sensor: &Sensor, measurements: &[&Measurement]) -> Equations {
        let orientation_sigma =
            sensor.orientation_sigma_rad.filter(|_| measurements.iter().all(|row| row.orientation_xyzw.is_some()));
        let mut equations = Equations { first: vec![0], component: Vec::new(), sigma: Vec::new(), axes: Vec::new() };
        for row in measurements {
            let position_sigma = sensor.position_sigma_at(&row.position().coords);
            for component in 0..COMPONENTS {
                let sigma = if component < 3 { (!row.unread[component]).then_some(position_sigma) } else { orientation_sigma };
                if let Some(sigma) = sigma {
                    equations.component.push(component);
                    equations.sigma.push(sigma);
                }
            }
            equations.first.push(equations.component.len());
        }
        equations
    }

    /// Number of readings.
    #[must_use]
    pub fn readings(&self) -> usize {
        self.first.len() - 1
    }

    /// Number of equations.
    #[must_use]
    pub fn len(&self) -> usize {
        self.component.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.component.is_empty()
    }

    /// The equations of reading number `row`.
    #[must_use]
    pub fn of(&self, row: usize) -> Range<usize> {
        self.first[row]..self.first[row + 1]
    }

    /// Those of them that are about the position.
    #[must_use]
    pub fn of_position(&self, row: usize) -> Range<usize> {
        let all = self.of(row);
        let positions = self.component[all.clone()].iter().filter(|component| **component < 3).count();
        all.start..all.start + positions
    }

    /// Number of equations of each reading.
    #[must_use]
    pub fn counts(&self) -> Vec<usize> {
        self.first.windows(2).map(|ends| ends[1] - ends[0]).collect()
    }

    /// Declared sigma of each equation, m or rad.
    #[must_use]
    pub fn sigmas(&self) -> &[f64] {
        &self.sigma
    }

    /// Which component of a pose `equation` is about.
    #[must_use]
    pub fn component(&self, equation: usize) -> usize {
        self.component[equation]
    }

    /// Whether orientations are among them.
    #[must_use]
    pub fn has_orientation(&self) -> bool {
        self.component.iter().any(|component| *component >= 3)
    }

    /// Which components of a pose are read at all, in some reading.
    #[must_use]
    pub fn components(&self) -> [bool; COMPONENTS] {
        std::array::from_fn(|component| self.component.contains(&component))
    }

    /// What the equations of reading `row` say of `pose`, a small change of its pose: m and rad in the measurement frame.
    pub fn pick(&self, row: usize, pose: [f64; COMPONENTS]) -> impl Iterator<Item = f64> {
        let pose = match self.axes_of(row) {
            Some(axes) => turned(pose, |part| axes.tr_mul(&part)),
            None => pose,
        };
        self.component[self.of(row)].iter().map(move |component| pose[*component])
    }

    /// The change of its pose that the equations of reading `row` have the `values` of; nothing where nothing was read.
    #[must_use]
    pub fn pose(&self, row: usize, values: &[f64]) -> [f64; COMPONENTS] {
        let mut pose = [0.0; COMPONENTS];
        for (component, value) in self.component[self.of(row)].iter().zip(values) {
            pose[*component] = *value;
        }
        match self.axes_of(row) {
            Some(axes) => turned(pose, |part| axes * part),
            None => pose,
        }
    }

    /// With the components of each reading along these axes of the measurement frame (columns); along its own where there are none.
    pub fn set_axes(&mut self, axes: Vec<Option<Matrix3<f64>>>) {
        self.axes = axes;
    }

    fn axes_of(&self, row: usize) -> Option<&Matrix3<f64>> {
        self.axes.get(row)?.as_ref()
    }

    /// The equations about positions alone, and of each its number among all.
    #[must_use]
    pub fn positions(&self) -> (Equations, Vec<usize>) {
        let mut equations = Equations { first: vec![0], component: Vec::new(), sigma: Vec::new(), axes: Vec::new() };
        let mut which = Vec::new();
        for row in 0..self.readings() {
            for equation in self.of_position(row) {
                equations.component.push(self.component[equation]);
                equations.sigma.push(self.sigma[equation]);
                which.push(equation);
            }
            equations.first.push(equations.component.len());
        }
        equations.axes.clone_from(&self.axes);
        (equations, which)
    }
}

/// Both halves of a small change of a pose, each turned by `turn`.
fn turned([x, y, z, rx, ry, rz]: [f64; COMPONENTS], turn: impl Fn(Vector3<f64>) -> Vector3<f64>) -> [f64; COMPONENTS] {
    let (shift, rotation) = (turn(Vector3::new(x, y, z)), turn(Vector3::new(rx, ry, rz)));
    [shift.x, shift.y, shift.z, rotation.x, rotation.y, rotation.z]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sensor(orientation: Option<f64>) -> Sensor {
        Sensor {
            position_in_base: nalgebra::Point3::origin(),
            position_sigma_m: 1e-5,
            position_sigma_per_m: 1e-6,
            orientation_sigma_rad: orientation,
            temperature_sigma_k: None,
            distances: Vec::new(),
            view: None,
        }
    }

    fn row(x: f64, unread: [bool; 3], orientation: bool) -> Measurement {
        let orientation_xyzw = orientation.then_some([0.0, 0.0, 0.0, 1.0]);
        Measurement { position_m: [x, 0.0, 0.0], unread, orientation_xyzw, ..Measurement::default() }
    }

    #[test]
    fn a_reading_has_the_equations_that_were_read() {
        let rows = [row(1.0, [false; 3], true), row(2.0, [false, false, true], true)];
        let equations = Equations::new(&sensor(Some(1e-4)), &rows.iter().collect::<Vec<_>>());
        assert_eq!((equations.len(), equations.counts(), equations.readings()), (11, vec![6, 5], 2));
        assert_eq!((equations.of(1), equations.of_position(1)), (6..11, 6..8));
        assert_eq!(equations.sigmas()[5..8], [1e-4, 1.2e-5, 1.2e-5]);
        let pose = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        let picked: Vec<f64> = equations.pick(1, pose).collect();
        assert_eq!(picked, [1.0, 2.0, 4.0, 5.0, 6.0]);
        assert_eq!(equations.pose(1, &picked), [1.0, 2.0, 0.0, 4.0, 5.0, 6.0]);
        let (positions, which) = equations.positions();
        assert_eq!((positions.counts(), which), (vec![3, 2], vec![0, 1, 2, 6, 7]));
        assert!(equations.has_orientation() && !positions.has_orientation());
        assert_eq!(positions.components(), [true, true, true, false, false, false]);
    }

    #[test]
    fn orientations_count_where_all_have_them_and_the_sensor_says_how_well() {
        let rows = [row(0.0, [false; 3], true), row(0.0, [false; 3], false)];
        let rows: Vec<&Measurement> = rows.iter().collect();
        assert_eq!(Equations::new(&sensor(Some(1e-4)), &rows).counts(), [3, 3]);
        assert_eq!(Equations::new(&sensor(Some(1e-4)), &rows[..1]).counts(), [6]);
        assert_eq!(Equations::new(&sensor(None), &rows[..1]).counts(), [3]);
    }
}
