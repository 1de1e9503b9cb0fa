//! What is to be chosen, by which method, for which criterion.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::arm::Arm;
use crate::measurement::{Sensor, Weights};
use crate::quality::{EvennessDomain, JacobianScaling};

/// A design problem with the arm and the sensor that it is for.
#[derive(Clone, Copy, Debug)]
pub struct Request<'a> {
    /// Nominal arm and cell.
    pub arm: &'a Arm,
    /// Declared accuracy.
    pub sensor: &'a Sensor,
    /// How the residuals of the calibration will be weighted.
    pub weights: Weights,
    /// Public seed of all that is drawn.
    pub seed: u64,
    /// The problem.
    pub problem: &'a DesignProblem,
}

/// The design problem.
#[derive(Clone, Debug, PartialEq)]
pub struct DesignProblem {
    /// Number of configurations m.
    pub count: usize,
    /// Method.
    pub method: Method,
    /// What the method makes large.
    pub criterion: Criterion,
    /// Values of the criterion after which a method stops at the latest. The particle swarm of the paper counts iterations instead.
    pub budget: u64,
    /// Candidates of methods that choose from a pool.
    pub pool: usize,
    /// Particle swarm settings.
    pub swarm: Swarm,
    /// Domain of the evenness.
    pub evenness_domain: EvennessDomain,
    /// Step of the grid over which the evenness takes its supremum, m.
    pub evenness_step_m: f64,
    /// Scaling of the error Jacobian before its singular values are taken.
    pub jacobian_scaling: JacobianScaling,
    /// Random sets that the chosen one is compared with.
    pub random_sets: usize,
}

/// How configurations are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Particle swarm (Chen et al. 2019, eqs. 33–38).
    Pso,
    /// Particle swarm with falling inertia, bounded velocity and restarts of what stagnates (in the spirit of Wang et al. 2018; not
    /// its formulas).
    ImprovedPso,
    /// Adding and deleting candidates with excursions (Mitchell 1974).
    Detmax,
    /// Simulated annealing (after Wang et al. 2014).
    Annealing,
    /// Genetic algorithm (after Aoyagi et al. 2010).
    Genetic,
    /// Few configurations, each measured several times, by genetic algorithm and gradient search (after Wu et al. 2015).
    GeneticRepeated,
    /// Perturbation of configurations with a few DETMAX steps (after Wang et al. 2017).
    #[default]
    Perturbation,
    /// One joint of one configuration at a time (Meyer and Nachtsheim 1995).
    CoordinateExchange,
    /// The best of many random sets.
    BestOfRandom,
    /// One random set.
    Random,
}

/// What a set of configurations is chosen for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Criterion {
    /// O_C (Chen et al. 2019, eq. 27).
    Comprehensive,
    /// Observability index O1.
    O1,
    /// O2.
    O2,
    /// O3.
    O3,
    /// O4.
    O4,
    /// O5.
    O5,
    /// O6.
    O6,
    /// Dispersion D of the end points.
    Dispersion,
    /// Evenness U of the end points.
    Evenness,
    /// Determinant of the information: the volume of the parameters' confidence region.
    DOptimality,
    /// Mean variance of the predicted position over the workspace.
    #[default]
    IOptimality,
    /// Its largest value at a point of the workspace.
    GOptimality,
}

impl Method {
    /// Every method.
    pub const ALL: [Method; 10] = [
        Method::Pso,
        Method::ImprovedPso,
        Method::Detmax,
        Method::Annealing,
        Method::Genetic,
        Method::GeneticRepeated,
        Method::Perturbation,
        Method::CoordinateExchange,
        Method::BestOfRandom,
        Method::Random,
    ];

    /// The method's name in scenes and results.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Method::Pso => "pso",
            Method::ImprovedPso => "improved_pso",
            Method::Detmax => "detmax",
            Method::Annealing => "annealing",
            Method::Genetic => "genetic",
            Method::GeneticRepeated => "genetic_repeated",
            Method::Perturbation => "perturbation",
            Method::CoordinateExchange => "coordinate_exchange",
            Method::BestOfRandom => "best_of_random",
            Method::Random => "random",
        }
    }
}

impl Criterion {
    /// Every criterion.
    pub const ALL: [Criterion; 12] = [
        Criterion::Comprehensive,
        Criterion::O1,
        Criterion::O2,
        Criterion::O3,
        Criterion::O4,
        Criterion::O5,
        Criterion::O6,
        Criterion::Dispersion,
        Criterion::Evenness,
        Criterion::DOptimality,
        Criterion::IOptimality,
        Criterion::GOptimality,
    ];

    /// The criterion with this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Criterion> {
        Criterion::ALL.into_iter().find(|criterion| criterion.name() == name)
    }

    /// The criterion's name in scenes and results.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Criterion::Comprehensive => "comprehensive",
            Criterion::O1 => "o1",
            Criterion::O2 => "o2",
            Criterion::O3 => "o3",
            Criterion::O4 => "o4",
            Criterion::O5 => "o5",
            Criterion::O6 => "o6",
            Criterion::Dispersion => "dispersion",
            Criterion::Evenness => "evenness",
            Criterion::DOptimality => "d_optimality",
            Criterion::IOptimality => "i_optimality",
            Criterion::GOptimality => "g_optimality",
        }
    }
}

/// Settings of the particle swarm (Table 5).
#[derive(Clone, Debug, PartialEq)]
pub struct Swarm {
    /// N_Swrm.
    pub particles: usize,
    /// N_Iter.
    pub iterations: usize,
    /// ω_min and ω_max of eq. 37.
    pub inertia: [f64; 2],
    /// ξ of eq. 36.
    pub velocity_factor: f64,
    /// τ of eq. 38.
    pub tau: f64,
}

impl Swarm {
    /// Values of the criterion that the swarm computes: all particles in every iteration and at the start.
    #[must_use]
    pub fn evaluations(&self) -> u64 {
        self.particles as u64 * (self.iterations as u64 + 1)
    }
}
