//! What a search makes large: one number for a set of configurations, and quickly for a set of which one configuration changes.

use nalgebra::Vector3;

use super::candidates::{NothingMeasurable, Rules, Sampler};
use super::problem::{Criterion, Request};
use crate::numerics::dense;
use crate::quality::evaluator::{Evaluator, comprehensive};
use crate::quality::globality::dispersion;
use crate::quality::information::{InformationModel, JacobianScratch};
use crate::quality::observability::observability;
use crate::quality::prediction::{Prediction, PredictionWorkspace};
use crate::seed::stream;

/// Configurations that stand for the workspace.
const WORKSPACE_POINTS: usize = 500;
/// Share of the mean information of a configuration that is added to every set's, so that a set that does not determine the
/// parameters has a value too (a poor one), and a search finds its way out.
const RIDGE: f64 = 1e-9;

/// Changes of a set after which its Gram matrix is summed anew, so that rounding does not pile up.
const RESUM: usize = 64;

/// The models behind all criteria, for one arm and sensor.
pub struct Models {
    /// O1–O6, dispersion, evenness and O_C.
    pub evaluator: Evaluator,
    /// Information in units of the noise.
    pub information: InformationModel,
    /// The workspace over which poses are predicted: whatever the arm reaches, whether or not the sensor sees it.
    pub workspace: PredictionWorkspace,
    /// Diagonal of the ridge.
    ridge: Vec<f64>,
    joint_count: usize,
}

impl Models {
    /// Models of the arm, the sensor and the weights of `request`.
    ///
    /// # Errors
    /// If every configuration collides.
    pub fn new(request: &Request<'_>) -> Result<Self, NothingMeasurable> {
        let Request { arm, sensor, problem, .. } = *request;
        let orientation = sensor.orientation_sigma_rad.is_some();
        let evaluator =
            Evaluator::new(arm, orientation, problem.evenness_domain, problem.evenness_step_m, problem.jacobian_scaling);
        let information = InformationModel::new(arm, sensor, request.weights);
        let rules = Rules::reachable(arm);
        // A property of the arm, like the grid of the evenness: the same whatever the scene's seed.
        let points = Sampler::new(&rules).draw(&mut stream(0, "quality/prediction"), WORKSPACE_POINTS)?;
        let workspace = PredictionWorkspace::new(&information, &points, arm.joint_count());
        let rank = information.rank();
        let mut block = vec![0.0; rank * information.rows_per_pose()];
        let mut scratch = JacobianScratch::default();
        let mut ridge = vec![0.0; rank];
        for joints in points.chunks_exact(arm.joint_count()) {
            information.block_into(joints, &mut scratch, &mut block);
            for row in block.chunks_exact(rank) {
                for (sum, value) in ridge.iter_mut().zip(row) {
                    *sum += RIDGE / WORKSPACE_POINTS as f64 * value * value;
                }
            }
        }
        Ok(Models { evaluator, information, workspace, ridge, joint_count: arm.joint_count() })
    }

    /// Joints of the arm.
    #[must_use]
    pub fn joint_count(&self) -> usize {
        self.joint_count
    }

    /// What `configurations` (one after the other, rad or m) let expect of a model calibrated with them; `None` where they do not
    /// determine the parameters.
    #[must_use]
    pub fn predict(&self, configurations: &[f64], joint_count: usize) -> Option<Prediction> {
        let rank = self.information.rank();
        let (mut information, mut noise) = (vec![0.0; rank * rank], vec![0.0; rank * rank]);
        let mut block = vec![0.0; rank * self.information.rows_per_pose()];
        let mut scratch = JacobianScratch::default();
        for joints in configurations.chunks_exact(joint_count) {
            let end_point = self.information.block_into(joints, &mut scratch, &mut block);
            dense::add_gram(&block, 1.0, rank, &mut information);
            self.information.noise_into(&end_point, &mut block);
            dense::add_gram(&block, 1.0, rank, &mut noise);
        }
        if self.information.as_declared() {
            self.workspace.predict(&information)
        } else {
            self.workspace.predict_with(&information, &noise)
        }
    }

    /// Adds the ridge to an information matrix (row-major).
    pub(super) fn add_ridge(&self, information: &mut [f64]) {
        let rank = self.ridge.len();
        for (i, ridge) in self.ridge.iter().enumerate() {
            information[i * rank + i] += ridge;
        }
    }
}

/// A criterion on the models of an arm. Larger is better; variances count as minus their logarithm, determinants as the logarithm
/// of their root, so that differences are relative.
pub struct Objective<'a> {
    models: &'a Models,
    criterion: Criterion,
    family: Family,
    joint_count: usize,
}

/// What a criterion is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Family {
    /// Singular values of the stacked Jacobian of all parameters (and end points).
    Singular,
    /// Information on the identifiable parameters.
    Information,
    /// End points alone.
    EndPoints,
}

/// Memory for the values of one thread.
#[derive(Clone, Debug, Default)]
pub struct ObjectiveScratch {
    jacobian: JacobianScratch,
    all_rows: Vec<f64>,
    rows: Vec<f64>,
    gram: Vec<f64>,
    factor: Vec<f64>,
    end_points: Vec<Vector3<f64>>,
}

impl ObjectiveScratch {
    /// End points of the set that was valued last, in base, m.
    #[must_use]
    pub fn end_points(&self) -> &[Vector3<f64>] {
        &self.end_points
    }
}

impl<'a> Objective<'a> {
    /// `criterion` on `models`; `joint_count` is the arm's.
    #[must_use]
    pub fn new(models: &'a Models, criterion: Criterion, joint_count: usize) -> Self {
        let family = match criterion {
            Criterion::Dispersion | Criterion::Evenness => Family::EndPoints,
            Criterion::DOptimality | Criterion::IOptimality | Criterion::GOptimality => Family::Information,
            _ => Family::Singular,
        };
        Objective { models, criterion, family, joint_count }
    }

    /// The criterion.
    #[must_use]
    pub fn criterion(&self) -> Criterion {
        self.criterion
    }

    /// The models behind it.
    #[must_use]
    pub fn models(&self) -> &'a Models {
        self.models
    }

    /// Joints of the arm.
    #[must_use]
    pub fn joint_count(&self) -> usize {
        self.joint_count
    }

    /// Value of `configurations`, one after the other (rad or m).
    pub fn value(&self, configurations: &[f64], scratch: &mut ObjectiveScratch) -> f64 {
        let (columns, size) = (self.columns(), self.row_size());
        let mut gram = std::mem::take(&mut scratch.gram);
        let mut rows = std::mem::take(&mut scratch.rows);
        let mut end_points = std::mem::take(&mut scratch.end_points);
        gram.clear();
        gram.resize(columns * columns, 0.0);
        rows.resize(size, 0.0);
        end_points.clear();
        for joints in configurations.chunks_exact(self.joint_count) {
            end_points.push(self.contribution(joints, scratch, &mut rows));
            dense::add_gram(&rows, 1.0, columns, &mut gram);
        }
        let value = self.value_of(&gram, &end_points, scratch);
        (scratch.gram, scratch.rows, scratch.end_points) = (gram, rows, end_points);
        value
    }

    /// Columns of the rows that configurations contribute.
    fn columns(&self) -> usize {
        match self.family {
            Family::Singular => self.models.evaluator.parameter_count(),
            Family::Information => self.models.information.rank(),
            Family::EndPoints => 0,
        }
    }

    fn row_size(&self) -> usize {
        self.columns() * self.models.information.rows_per_pose()
    }

    /// Writes the rows of one configuration; its end point.
    fn contribution(&self, joints: &[f64], scratch: &mut ObjectiveScratch, rows: &mut [f64]) -> Vector3<f64> {
        match self.family {
            Family::Information => self.models.information.block_into(joints, &mut scratch.jacobian, rows),
            Family::Singular | Family::EndPoints => self.models.evaluator.rows_into(joints, &mut scratch.all_rows, rows),
        }
    }

    /// Value of a set whose rows have the Gram matrix `gram` (lower triangle).
    fn value_of(&self, gram: &[f64], end_points: &[Vector3<f64>], scratch: &mut ObjectiveScratch) -> f64 {
        let evaluator = &self.models.evaluator;
        match self.family {
            Family::EndPoints => match self.criterion {
                Criterion::Dispersion => dispersion(end_points),
                _ => evaluator.grid().evenness(end_points),
            },
            Family::Singular => {
                let o = observability(&evaluator.singular_values(gram, end_points.len()));
                match self.criterion {
                    Criterion::O1 => o.o1,
                    Criterion::O2 => o.o2,
                    Criterion::O3 => o.o3,
                    Criterion::O4 => o.o4,
                    Criterion::O5 => o.o5,
                    Criterion::O6 => o.o6,
                    _ => {
                        let (d, u) = (dispersion(end_points), evaluator.grid().evenness(end_points));
                        comprehensive(d, u, [o.o1, o.o2, o.o3])
                    }
                }
            }
            Family::Information => {
                let rank = self.models.information.rank();
                scratch.factor.clear();
                scratch.factor.extend_from_slice(gram);
                self.models.add_ridge(&mut scratch.factor);
                if !dense::cholesky(&mut scratch.factor, rank) {
                    return f64::NEG_INFINITY;
                }
                match self.criterion {
                    Criterion::DOptimality => dense::log_determinant(&scratch.factor, rank) / rank as f64,
                    Criterion::GOptimality => -libm::log(self.models.workspace.worst_variance(&scratch.factor)),
                    _ => -libm::log(self.models.workspace.mean_variance(&scratch.factor)),
                }
            }
        }
    }
}

/// A set of configurations under change, with what they contribute kept, so that changing one costs no more than that one.
#[derive(Clone)]
pub struct Set<'a> {
    objective: &'a Objective<'a>,
    configurations: Vec<f64>,
    rows: Vec<f64>,
    end_points: Vec<Vector3<f64>>,
    gram: Vec<f64>,
    /// Changes since the Gram matrix was summed.
    changes: usize,
}

impl<'a> Set<'a> {
    /// The set of `configurations`, one after the other (rad or m).
    #[must_use]
    pub fn new(objective: &'a Objective<'a>, configurations: Vec<f64>, scratch: &mut ObjectiveScratch) -> Self {
        let mut set =
            Set { objective, configurations: Vec::new(), rows: Vec::new(), end_points: Vec::new(), gram: Vec::new(), changes: 0 };
        for joints in configurations.chunks_exact(objective.joint_count) {
            let start = set.rows.len();
            set.rows.resize(start + objective.row_size(), 0.0);
            let end_point = objective.contribution(joints, scratch, &mut set.rows[start..]);
            set.end_points.push(end_point);
        }
        set.configurations = configurations;
        set.sum();
        set
    }

    /// Number of configurations.
    #[must_use]
    pub fn len(&self) -> usize {
        self.end_points.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.end_points.is_empty()
    }

    /// All configurations, one after the other (rad or m).
    #[must_use]
    pub fn configurations(&self) -> &[f64] {
        &self.configurations
    }

    /// Configuration number `index`.
    #[must_use]
    pub fn get(&self, index: usize) -> &[f64] {
        &self.configurations[index * self.objective.joint_count..(index + 1) * self.objective.joint_count]
    }

    /// Value of the set as it is.
    pub fn value(&self, scratch: &mut ObjectiveScratch) -> f64 {
        self.objective.value_of(&self.gram, &self.end_points, scratch)
    }

    /// Value of the set with `joints` in place of configuration `index`.
    pub fn value_with(&self, index: usize, joints: &[f64], scratch: &mut ObjectiveScratch) -> f64 {
        self.value_changed(Some(index), Some(joints), scratch)
    }

    /// Value of the set with `joints` added.
    pub fn value_plus(&self, joints: &[f64], scratch: &mut ObjectiveScratch) -> f64 {
        self.value_changed(None, Some(joints), scratch)
    }

    /// Value of the set without configuration `index`.
    pub fn value_without(&self, index: usize, scratch: &mut ObjectiveScratch) -> f64 {
        self.value_changed(Some(index), None, scratch)
    }

    fn value_changed(&self, leaves: Option<usize>, joins: Option<&[f64]>, scratch: &mut ObjectiveScratch) -> f64 {
        let (columns, size) = (self.objective.columns(), self.objective.row_size());
        let mut gram = std::mem::take(&mut scratch.gram);
        let mut rows = std::mem::take(&mut scratch.rows);
        let mut end_points = std::mem::take(&mut scratch.end_points);
        gram.clear();
        gram.extend_from_slice(&self.gram);
        end_points.clear();
        end_points.extend_from_slice(&self.end_points);
        if let Some(joints) = joins {
            rows.resize(size, 0.0);
            let end_point = self.objective.contribution(joints, scratch, &mut rows);
            dense::add_gram(&rows, 1.0, columns, &mut gram);
            match leaves {
                Some(index) => end_points[index] = end_point,
                None => end_points.push(end_point),
            }
        }
        if let Some(index) = leaves {
            dense::add_gram(&self.rows[index * size..(index + 1) * size], -1.0, columns, &mut gram);
            if joins.is_none() {
                end_points.remove(index);
            }
        }
        let value = self.objective.value_of(&gram, &end_points, scratch);
        (scratch.gram, scratch.rows, scratch.end_points) = (gram, rows, end_points);
        value
    }

    /// Puts `joints` in the place of configuration `index`.
    pub fn replace(&mut self, index: usize, joints: &[f64], scratch: &mut ObjectiveScratch) {
        let (size, count) = (self.objective.row_size(), self.objective.joint_count);
        self.configurations[index * count..(index + 1) * count].copy_from_slice(joints);
        self.add(index, -1.0);
        self.end_points[index] = self.objective.contribution(joints, scratch, &mut self.rows[index * size..(index + 1) * size]);
        self.add(index, 1.0);
        self.changed();
    }

    /// Adds `joints` as the last configuration.
    pub fn push(&mut self, joints: &[f64], scratch: &mut ObjectiveScratch) {
        let start = self.rows.len();
        self.rows.resize(start + self.objective.row_size(), 0.0);
        self.configurations.extend_from_slice(joints);
        let end_point = self.objective.contribution(joints, scratch, &mut self.rows[start..]);
        self.end_points.push(end_point);
        self.add(self.len() - 1, 1.0);
        self.changed();
    }

    /// Takes configuration `index` out; those behind it move up.
    pub fn remove(&mut self, index: usize) {
        let (size, count) = (self.objective.row_size(), self.objective.joint_count);
        self.add(index, -1.0);
        self.configurations.drain(index * count..(index + 1) * count);
        self.rows.drain(index * size..(index + 1) * size);
        self.end_points.remove(index);
        self.changed();
    }

    /// Adds what configuration `index` contributes to the Gram matrix, or takes it (`factor` −1).
    fn add(&mut self, index: usize, factor: f64) {
        let (columns, size) = (self.objective.columns(), self.objective.row_size());
        dense::add_gram(&self.rows[index * size..(index + 1) * size], factor, columns, &mut self.gram);
    }

    fn changed(&mut self) {
        self.changes += 1;
        if self.changes >= RESUM {
            self.sum();
        }
    }

    /// Sums the Gram matrix anew.
    fn sum(&mut self) {
        self.changes = 0;
        let (columns, size) = (self.objective.columns(), self.objective.row_size());
        self.gram.clear();
        self.gram.resize(columns * columns, 0.0);
        if size > 0 {
            for rows in self.rows.chunks_exact(size) {
                dense::add_gram(rows, 1.0, columns, &mut self.gram);
            }
        }
    }
}
