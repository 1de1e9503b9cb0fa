//! How well the calibrated model will predict the pose over the workspace: the variance that the readings' noise leaves.
//!
//! With information M of a set on the identifiable parameters, the pose at a configuration with error Jacobian P is predicted with
//! covariance P M⁻¹ Pᵀ. Its mean over the workspace is what I-optimality (also V- or Q-optimality) makes small, its largest value
//! what G-optimality makes small (Atkinson, Donev and Tobias 2007, chapter 10).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::information::{InformationModel, JacobianScratch};
use crate::numerics::dense;

/// Configurations of the sample at which the G-criterion looks for the worst point.
const WORST_POINTS: usize = 200;

/// The workspace as a sample of configurations, prepared for one arm and what is identified of it.
#[derive(Clone, Debug)]
pub struct PredictionWorkspace {
    rank: usize,
    /// Mean of PᵀP over the sample, position rows (m² per unit of covariance): row-major `rank × rank`.
    position: Vec<f64>,
    /// The same for the orientation rows (rad²).
    orientation: Vec<f64>,
    /// Position rows of the first points, 3 × rank each: those that the G-criterion looks at.
    points: Vec<f64>,
    /// Those of the others, at which what was chosen is judged; the same where there are none.
    judged: Vec<f64>,
}

/// What is expected of a calibrated model that has no error but what noise left in it.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Prediction {
    /// Root of the mean squared position error over the workspace (3-D), m: the root of the I-criterion.
    pub position_rms_m: f64,
    /// Root of the mean squared orientation error (rotation vector), rad.
    #[serde(rename = "attitude_rms_rad")]
    pub orientation_rms_rad: f64,
    /// Root of the largest mean squared position error at any of some hundred sampled points of the workspace, m. They are others
    /// than those at which the G-criterion is computed.
    pub position_worst_m: f64,
}

impl PredictionWorkspace {
    /// The workspace told by `configurations` (one after the other, rad or m).
    #[must_use]
    pub fn new(model: &InformationModel, configurations: &[f64], joint_count: usize) -> Self {
        let rank = model.rank();
        let mut rows = vec![0.0; 6 * rank];
        let mut scratch = JacobianScratch::default();
        let (mut position, mut orientation) = (vec![0.0; rank * rank], vec![0.0; rank * rank]);
        let (mut points, mut judged) = (Vec::new(), Vec::new());
        let share = joint_count as f64 / configurations.len().max(1) as f64;
        for (index, joints) in configurations.chunks_exact(joint_count).enumerate() {
            model.unscaled_into(joints, &mut scratch, &mut rows);
            dense::add_gram(&rows[..3 * rank], share, rank, &mut position);
            dense::add_gram(&rows[3 * rank..], share, rank, &mut orientation);
            let of = if index < WORST_POINTS { &mut points } else { &mut judged };
            of.extend_from_slice(&rows[..3 * rank]);
        }
        dense::mirror(&mut position, rank);
        dense::mirror(&mut orientation, rank);
        if judged.is_empty() {
            judged.clone_from(&points);
        }
        PredictionWorkspace { rank, position, orientation, points, judged }
    }

    /// L of the I-criterion tr(L M⁻¹): mean of PᵀP over the workspace, position rows; row-major `rank × rank`, both triangles.
    #[must_use]
    pub fn position_matrix(&self) -> &[f64] {
        &self.position
    }

    /// I-criterion: mean variance of the predicted position over the workspace (trace over the axes), m²; from the Cholesky
    /// factor of the information.
    #[must_use]
    pub fn mean_variance(&self, factor: &[f64]) -> f64 {
        dense::dot(&self.position, &dense::inverse(factor, self.rank))
    }

    /// G-criterion: largest variance of the predicted position at 200 sampled points of the workspace, m².
    #[must_use]
    pub fn worst_variance(&self, factor: &[f64]) -> f64 {
        self.worst(&self.points, &dense::inverse(factor, self.rank))
    }

    /// What a set with this information (lower triangle, row-major) lets expect, where the readings are as noisy as it assumes;
    /// `None` where it does not determine the parameters.
    #[must_use]
    pub fn predict(&self, information: &[f64]) -> Option<Prediction> {
        let mut factor = information.to_vec();
        dense::cholesky(&mut factor, self.rank).then(|| self.of_covariance(&dense::inverse(&factor, self.rank)))
    }

    /// The same for readings whose noise is another: `noise` is the Gram matrix (lower triangle) of the rows scaled by it
    /// ([`InformationModel::noise_into`]).
    #[must_use]
    pub fn predict_with(&self, information: &[f64], noise: &[f64]) -> Option<Prediction> {
        let (n, mut factor, mut noise) = (self.rank, information.to_vec(), noise.to_vec());
        if !dense::cholesky(&mut factor, n) {
            return None;
        }
        dense::mirror(&mut noise, n);
        let inverse = dense::inverse(&factor, n);
        let (mut half, mut covariance) = (vec![0.0; n * n], vec![0.0; n * n]);
        dense::multiply(&inverse, &noise, n, &mut half);
        dense::multiply(&half, &inverse, n, &mut covariance);
        Some(self.of_covariance(&covariance))
    }

    /// From the covariance of the parameters, both triangles.
    fn of_covariance(&self, covariance: &[f64]) -> Prediction {
        Prediction {
            position_rms_m: dense::dot(&self.position, covariance).max(0.0).sqrt(),
            orientation_rms_rad: dense::dot(&self.orientation, covariance).max(0.0).sqrt(),
            position_worst_m: self.worst(&self.judged, covariance).max(0.0).sqrt(),
        }
    }

    /// Largest position variance at `points`, m².
    fn worst(&self, points: &[f64], covariance: &[f64]) -> f64 {
        let variance = |rows: &[f64]| rows.chunks_exact(self.rank).map(|row| dense::quadratic(covariance, row)).sum::<f64>();
        points.chunks_exact(3 * self.rank).map(variance).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;
    use crate::quality::information::Blocks;
    use crate::seed::stream;

    #[test]
    fn variances_are_those_of_the_covariance() {
        let scene = crate::scene::read(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/arm8.toml")).unwrap().scene;
        let model = InformationModel::new(&scene.arm, &scene.sensor, scene.weights);
        let rank = model.rank();
        let mut stream = stream(4, "test/prediction");
        let mut draw = |count: usize| -> Vec<f64> {
            (0..count).flat_map(|_| &scene.arm.chain.joints).map(|joint| stream.uniform(joint.lower, joint.upper)).collect()
        };
        let (set, points) = (draw(20), draw(30));
        let blocks = Blocks::of(&model, &set, 8);
        let mut information = vec![0.0; rank * rank];
        blocks.iter().for_each(|block| dense::add_gram(block, 1.0, rank, &mut information));
        let workspace = PredictionWorkspace::new(&model, &points, 8);
        let prediction = workspace.predict(&information).unwrap();

        let stacked = DMatrix::from_row_iterator(blocks.len() * 6, rank, blocks.iter().flatten().copied());
        let covariance = (stacked.transpose() * stacked).try_inverse().unwrap();
        let mut traces = Vec::new();
        let mut rows = vec![0.0; 6 * rank];
        for joints in points.chunks_exact(8) {
            model.unscaled_into(joints, &mut JacobianScratch::default(), &mut rows);
            let p = DMatrix::from_row_slice(6, rank, &rows);
            let variance = &p * &covariance * p.transpose();
            traces.push((variance.view((0, 0), (3, 3)).trace(), variance.view((3, 3), (3, 3)).trace()));
        }
        let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / 30.0;
        let close = |a: f64, b: f64| assert!((a / b.sqrt() - 1.0).abs() < 1e-7, "{a} is not {}", b.sqrt());
        close(prediction.position_rms_m, mean(&mut traces.iter().map(|trace| trace.0)));
        close(prediction.orientation_rms_rad, mean(&mut traces.iter().map(|trace| trace.1)));
        close(prediction.position_worst_m, traces.iter().map(|trace| trace.0).fold(0.0, f64::max));
        assert!(workspace.predict(&vec![0.0; rank * rank]).is_none());
    }
}
