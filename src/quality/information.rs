//! Information that a configuration's reading carries about the identifiable parameters, in units of the reading's noise.

use nalgebra::Vector3;

use super::subspace::Subspace;
use crate::arm::Arm;
use crate::arm::ChainAt;
use crate::measurement::Sensor;
use crate::measurement::Weights;

/// What a reading tells: the error Jacobian at the nominal parameters, its columns those that can be told apart, its rows divided
/// by the standard deviation that the fit assumes of them. With these rows X of a set, the parameters' covariance is (XᵀX)⁻¹.
///
/// With [`Weights::Unit`] the fit takes a radian for a metre, and so does the covariance: the position's sigma stands for both.
#[derive(Clone, Debug)]
pub struct InformationModel {
    chain: ChainAt,
    sensor: Sensor,
    weights: Weights,
    /// Columns of the full Jacobian.
    independent: Vec<usize>,
    orientation: bool,
}

/// Memory for the Jacobians of one thread.
#[derive(Clone, Debug, Default)]
pub struct JacobianScratch {
    rows: Vec<f64>,
}

impl InformationModel {
    /// The information about `arm` of what `sensor` reads, where residuals are weighted by `weights`.
    #[must_use]
    pub fn new(arm: &Arm, sensor: &Sensor, weights: Weights) -> Self {
        let orientation = sensor.orientation_sigma_rad.is_some();
        let subspace = Subspace::of_structure(arm, orientation);
        InformationModel {
            chain: arm.chain.at_nominal(),
            sensor: sensor.clone(),
            weights,
            independent: subspace.independent,
            orientation,
        }
    }

    /// Dimension of the identifiable subspace: columns of a block.
    #[must_use]
    pub fn rank(&self) -> usize {
        self.independent.len()
    }

    /// Rows of a block: 6 with orientation, 3 for positions only.
    #[must_use]
    pub fn rows_per_pose(&self) -> usize {
        if self.orientation { 6 } else { 3 }
    }

    /// Writes the block of `joints` (rad or m) to `block` (`rows_per_pose × rank`, row-major); the end point in base, m.
    pub fn block_into(&self, joints: &[f64], scratch: &mut JacobianScratch, block: &mut [f64]) -> Vector3<f64> {
        let end_point = self.jacobian_into(joints, scratch);
        let (position, orientation) = self.sigmas(&end_point);
        let n = self.chain.parameter_count();
        for (component, row) in block.chunks_exact_mut(self.rank()).enumerate() {
            let factor = 1.0 / if component < 3 { position } else { orientation };
            let source = &scratch.rows[component * n..(component + 1) * n];
            for (entry, column) in row.iter_mut().zip(&self.independent) {
                *entry = factor * source[*column];
            }
        }
        end_point
    }

    /// Writes the unscaled error Jacobian of `joints` on the identifiable columns to `rows` (`6 × rank`, row-major: m, then rad).
    pub fn unscaled_into(&self, joints: &[f64], scratch: &mut JacobianScratch, rows: &mut [f64]) {
        self.jacobian_into(joints, scratch);
        let n = self.chain.parameter_count();
        for (component, row) in rows.chunks_exact_mut(self.rank()).enumerate() {
            for (entry, column) in row.iter_mut().zip(&self.independent) {
                *entry = scratch.rows[component * n + column];
            }
        }
    }

    fn jacobian_into(&self, joints: &[f64], scratch: &mut JacobianScratch) -> Vector3<f64> {
        let n = self.chain.parameter_count();
        scratch.rows.resize(6 * n, 0.0);
        self.chain.jacobian_into(joints, &mut scratch.rows, n).1
    }

    /// Whether what the fit assumes of the noise is what the sensor declares, so that (XᵀX)⁻¹ is the covariance.
    #[must_use]
    pub fn as_declared(&self) -> bool {
        let sensor = &self.sensor;
        let alike = |sigma: f64| (sigma - sensor.position_sigma_m).abs() <= 1e-9 * sensor.position_sigma_m;
        match self.weights {
            Weights::Noise => true,
            Weights::Unit => sensor.position_sigma_per_m == 0.0 && sensor.orientation_sigma_rad.is_none_or(alike),
        }
    }

    /// Scales the rows of the block of a reading at `end_point` by the declared sigmas over the assumed ones: with these rows Y,
    /// the covariance of an estimate is (XᵀX)⁻¹ YᵀY (XᵀX)⁻¹.
    pub fn noise_into(&self, end_point: &Vector3<f64>, block: &mut [f64]) {
        let (position, orientation) = self.sigmas(end_point);
        let declared = [self.sensor.position_sigma_at(end_point), self.sensor.orientation_sigma_rad.unwrap_or(orientation)];
        let factors = [declared[0] / position, declared[1] / orientation];
        for (component, row) in block.chunks_exact_mut(self.rank()).enumerate() {
            row.iter_mut().for_each(|entry| *entry *= factors[component / 3]);
        }
    }

    /// Standard deviations of a reading at `end_point` as the fit takes them: m, rad. One where nothing is declared, so that
    /// variances are then relative.
    fn sigmas(&self, end_point: &Vector3<f64>) -> (f64, f64) {
        let or_one = |sigma: f64| if sigma > 0.0 { sigma } else { 1.0 };
        match self.weights {
            Weights::Noise => {
                (or_one(self.sensor.position_sigma_at(end_point)), or_one(self.sensor.orientation_sigma_rad.unwrap_or(1.0)))
            }
            Weights::Unit => {
                let position = or_one(self.sensor.position_sigma_m);
                (position, position)
            }
        }
    }
}

/// Blocks of many configurations one after the other.
#[derive(Clone, Debug, PartialEq)]
pub struct Blocks {
    rank: usize,
    rows_per_pose: usize,
    rows: Vec<f64>,
}

impl Blocks {
    /// None yet.
    #[must_use]
    pub fn new(rank: usize, rows_per_pose: usize) -> Self {
        Blocks { rank, rows_per_pose, rows: Vec::new() }
    }

    /// Blocks of `configurations` (one after the other, rad or m).
    #[must_use]
    pub fn of(model: &InformationModel, configurations: &[f64], joint_count: usize) -> Self {
        let mut blocks = Blocks::new(model.rank(), model.rows_per_pose());
        let size = blocks.size();
        let count = configurations.len() / joint_count.max(1);
        blocks.rows.resize(count * size, 0.0);
        let mut scratch = JacobianScratch::default();
        for (joints, block) in configurations.chunks_exact(joint_count).zip(blocks.rows.chunks_exact_mut(size)) {
            model.block_into(joints, &mut scratch, block);
        }
        blocks
    }

    /// Adds a block (`rows_per_pose × rank`, row-major).
    ///
    /// # Panics
    /// If it has another size.
    pub fn push(&mut self, block: &[f64]) {
        assert_eq!(block.len(), self.size(), "a block has rows_per_pose × rank numbers");
        self.rows.extend_from_slice(block);
    }

    /// Numbers of one block.
    #[must_use]
    pub fn size(&self) -> usize {
        self.rank * self.rows_per_pose
    }

    /// Columns of a block.
    #[must_use]
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// Rows of a block.
    #[must_use]
    pub fn rows_per_pose(&self) -> usize {
        self.rows_per_pose
    }

    /// Number of blocks.
    #[must_use]
    pub fn len(&self) -> usize {
        self.rows.len() / self.size().max(1)
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Block number `index`, row-major.
    #[must_use]
    pub fn get(&self, index: usize) -> &[f64] {
        &self.rows[index * self.size()..(index + 1) * self.size()]
    }

    /// All blocks, one after the other.
    pub fn iter(&self) -> impl Iterator<Item = &[f64]> {
        self.rows.chunks_exact(self.size())
    }
}
