//! What a design method tells while it runs and when it has ended.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::quality::Indexes;
use crate::quality::prediction::Prediction;

/// The swarm after one iteration (iteration 0 is the initial swarm). In a recording the end points are in the cloud
/// `/design/swarm/end_points` with the same sequence number.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SwarmIteration {
    /// k of eq. 36; 0 is the initial swarm.
    pub iteration: usize,
    /// Iterations that will be made if nothing stops the swarm before.
    pub iterations: usize,
    /// Fitness of each particle where it is now: the criterion's value as in [`SearchStep::value`], O_C in the paper.
    pub fitness: Vec<f64>,
    /// Fitness of each particle's best-known position.
    pub personal_best: Vec<f64>,
    /// The particle (from 0) that holds the swarm's best-known position.
    pub best_particle: usize,
    /// Indexes of the swarm's best-known position.
    pub best: Indexes,
    /// Inertia weight ω (eq. 37) that led here; zero in the initial swarm.
    pub inertia: f64,
    /// Acceleration factor towards the own best (eq. 38); zero in the initial swarm.
    pub c1: f64,
    /// Acceleration factor towards the swarm's best (eq. 38); zero in the initial swarm.
    pub c2: f64,
    /// Evaluations of the fitness so far.
    pub evaluations: u64,
    /// Configurations refused so far, because they collide or the sensor does not see them.
    pub rejections: u64,
    /// End points of every particle's configurations in base, m: particle by particle. Recorded as a point cloud.
    #[serde(skip)]
    pub end_points: Vec<Vec<[f32; 3]>>,
    /// Configurations (rad or m) of the swarm's best-known position; empty where it is that of the iteration before.
    pub best_configurations: Vec<Vec<f64>>,
}

impl SwarmIteration {
    /// The criterion's value at the swarm's best-known position.
    #[must_use]
    pub fn best_value(&self) -> Option<f64> {
        self.personal_best.get(self.best_particle).copied()
    }
}

/// A step of a search by any other method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SearchStep {
    /// Number of the step, from 0.
    pub step: usize,
    /// Values of the criterion so far.
    pub evaluations: u64,
    /// Values of the criterion that may be computed.
    pub budget: u64,
    /// Configurations refused so far, because they collide or the sensor does not see them.
    pub rejections: u64,
    /// Value of the criterion where the search is (a population's mean). Larger is better: an index as it is, the determinant of
    /// the information as the logarithm of its r-th root, a variance (m²) as minus its logarithm; always finite.
    pub value: f64,
    /// The best value so far.
    pub best: f64,
    /// Configurations (rad or m) of the best set; empty where it is that of the step before.
    pub best_configurations: Vec<Vec<f64>>,
}

/// Why a method stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StopReason {
    /// The iterations asked for were made.
    IterationLimit,
    /// No particle moves any more.
    Converged,
    /// The method makes no iterations (random sets).
    Drawn,
    /// All values of the criterion that it may compute are computed.
    BudgetSpent,
}

/// Mean, smallest and largest value of each index over random sets of the same size: what choosing is compared with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RandomReference {
    /// Number of random sets.
    pub sets: usize,
    /// Mean of each index.
    pub mean: Indexes,
    /// Smallest of each index.
    pub min: Indexes,
    /// Largest of each index.
    pub max: Indexes,
}

/// The chosen set and how it came about.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DesignOutcome {
    /// The method's name as in the scene: `coordinate_exchange`, `pso`, ….
    pub method: String,
    /// The criterion's name as in the scene: `i_optimality`, `comprehensive`, ….
    pub criterion: String,
    /// The criterion's value, larger is better: an index as it is; `d_optimality` the logarithm of the r-th root of the determinant of
    /// the information; `i_optimality` and `g_optimality` minus the logarithm of a variance in m², so that exp(−value/2) is the
    /// position error in m. A billionth of a typical reading's information is added, so that sets that do not determine the
    /// parameters have finite (poor) values.
    pub value: f64,
    /// Chosen configurations, rad (m for prismatic joints), in the order of measuring.
    pub configurations: Vec<Vec<f64>>,
    /// Indexes on the identifiable subspace.
    pub indexes: Indexes,
    /// The same with all singular values counted, those that are zero up to rounding too: the plain reading of eqs. 15–17.
    pub indexes_all_parameters: Indexes,
    /// Evenness in both workspace domains.
    pub evenness_domains: EvennessDomains,
    /// Random sets of the same size.
    pub random: RandomReference,
    /// What choosing is worth; absent where it cannot be told.
    pub advice: Option<Advice>,
    /// Why it cannot be told.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub no_advice: Option<String>,
    /// Names of parameters that the others can stand in for and that are therefore held at their nominal values.
    pub dropped_parameters: Vec<String>,
    /// Values of the criterion that were computed.
    pub evaluations: u64,
    /// Configurations refused because they collide or the sensor does not see them.
    pub rejections: u64,
    /// Why the method stopped.
    pub stop: StopReason,
}

/// What the choice is worth, told before anything is measured: the position error over the workspace that the readings' noise will
/// leave in the calibrated model (RMS), for this set, for random ones, and the least that any set of as many configurations can
/// leave.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Advice {
    /// The chosen set; absent where it does not determine the parameters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chosen: Option<Prediction>,
    /// Mean over the random sets that determine the parameters; absent where none does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub random: Option<Prediction>,
    /// Smallest and largest position error of these, m.
    pub random_range_m: [f64; 2],
    /// Random sets that do not determine the parameters.
    pub random_undetermined: usize,
    /// No set of as many of the candidates leaves less than this, m: from the optimal approximate design. For configurations that
    /// are no candidates it is as good as a search for better ones.
    pub bound_m: f64,
    /// What is left between that design and its dual, as a share: the bound already allows for it.
    pub bound_gap: f64,
    /// Candidates among which the bound holds.
    pub bound_candidates: usize,
}

/// Evenness (eq. 25) in both readings of "workspace".
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct EvennessDomains {
    /// Over the reachable workspace.
    pub reachable: f64,
    /// Over the cube around the reachable workspace.
    pub bounding_cube: f64,
}
