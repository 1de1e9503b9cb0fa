//! A scene: the arm, the sensor, the problem, and apart from them what is injected and hidden.

mod convert;
pub mod effect;
pub mod effect_file;
mod error;
pub mod file;
mod magnitude;
mod reader;
#[cfg(test)]
mod tests;
mod urdf;

pub use error::{Problem, SceneError};
pub use reader::{SceneFile, parse, parse_injected, read};

use serde::{Deserialize, Serialize};

use crate::arm::Arm;
use crate::measurement::Sensor;

/// Everything but the truth: what the analyser may know. This, and only this, goes into a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Name; the stem of output files.
    pub name: String,
    /// What the scene is for.
    pub description: String,
    /// Where the arm's numbers come from; belongs into every report.
    pub arm_note: String,
    /// What of the arm's URDF could not be taken over as it stands; empty for other arms.
    pub urdf_notes: Vec<String>,
    /// What the sensor is.
    pub sensor_name: String,
    /// Public seed: of the design, the held-out configurations and the order of measuring.
    pub seed: u64,
    /// Nominal arm and cell.
    pub arm: Arm,
    /// Declared accuracy.
    pub sensor: Sensor,
    /// The design problem.
    pub design: DesignProblem,
    /// How the measuring is organised.
    pub plan: Plan,
    /// How the residuals are weighted.
    pub weights: Weights,
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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Default, Serialize, Deserialize)]
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

/// How the error Jacobian is scaled before its singular values are taken: O1, O3 and all that is made of them depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JacobianScaling {
    /// Metres and radians as they are, all configurations stacked (the paper's reading).
    Si,
    /// The same over the root of the number of configurations, so that more configurations alone raise no index.
    PerPose,
    /// Every column of length one, so that the parameters' units do not matter.
    Columns,
}

/// Which points count as workspace in eq. 25.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EvennessDomain {
    /// Cells of the grid that the arm's end reaches.
    Reachable,
    /// All cells of the cube around them.
    BoundingCube,
}

/// The measuring: how many configurations verify, and in what time.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Configurations that are measured but not fitted.
    pub held_out_count: usize,
    /// Whether held-out poses are read by an exact reference instrument instead of the sensor (the paper's eq. 10).
    pub held_out_exact: bool,
    /// From one reading to the next, s.
    pub seconds_per_pose: f64,
    /// Temperature at which the nominal arm is nominal, °C.
    pub reference_temperature_c: f64,
    /// How many times each configuration is read, each time approached anew.
    pub repeats: usize,
    /// From which side the joints come to a configuration.
    pub approach: Approach,
    /// From the end of a move to the reading, s.
    pub dwell_s: f64,
    /// Masses that the tool carries, kg; configurations take them in turn.
    pub payloads_kg: Vec<f64>,
    /// Whether payloads are measured one after the other (true), or in mixed order.
    pub payload_blocks: bool,
    /// Course of the temperatures over the session; absent where nothing warms.
    pub temperature: Option<Temperature>,
}

/// From which side the joints come to a configuration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Approach {
    /// Which side.
    pub policy: ApproachPolicy,
    /// How far the last move of each turning joint is where the policy makes one, rad.
    pub travel_rad: f64,
    /// The same for a sliding joint, m.
    pub travel_m: f64,
}

/// From which side the joints come to a configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ApproachPolicy {
    /// Straight from the configuration measured before it (the first: from zero).
    #[default]
    Direct,
    /// Every joint upwards.
    Up,
    /// Every joint downwards.
    Down,
    /// All joints up for one configuration, down for the next.
    Alternate,
    /// Each joint of each configuration by the throw of a coin; repeats alike.
    Random,
}

/// Course of the temperatures over a session. A link follows the course with a lag of the first order.
#[derive(Clone, Debug, PartialEq)]
pub struct Temperature {
    /// Course over the session.
    pub profile: ThermalProfile,
    /// Largest rise of each link over the reference temperature, base link first, K.
    pub rise_k: Vec<f64>,
    /// Time constant with which each link follows, base link first, s; 0: at once.
    pub lag_s: Vec<f64>,
    /// Largest rise of the air, K.
    pub ambient_rise_k: f64,
}

/// Weights of the least-squares fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weights {
    /// Each residual over its declared sigma.
    Noise,
    /// Metres and radians alike, as in eq. 6.
    Unit,
}

/// What is injected: the hidden part of a scene, with its own seed. Only the simulated measurement sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct Injected {
    /// Key of everything that is drawn for the truth; combined with the scene's seed.
    pub seed: String,
    /// Half width of the uniform errors of length parameters, m.
    pub length_error_m: f64,
    /// Half width of the uniform errors of angle parameters, rad.
    pub angle_error_rad: f64,
    /// Errors given by name (m or rad), in place of drawn ones; in column order.
    pub parameter_errors: Vec<(String, f64)>,
    /// What is wrong with arm, cell and sensor besides the parameters; effects of one kind at one place add up.
    pub effects: Vec<effect::Effect>,
    /// True noise of the readings.
    pub noise: Noise,
}

/// Course of the temperature over the session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ThermalProfile {
    /// At its largest rise all the time.
    Constant,
    /// Rising all the time.
    WarmUp,
    /// Rising, then falling back.
    HeatAndCool,
}

/// Noise that the readings really have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Noise {
    /// Normal, with the declared sigmas times a factor.
    Declared {
        /// 1: as declared.
        factor: f64,
    },
    /// Uniform within ± the given half widths, the same for every axis.
    Uniform {
        /// Position, m.
        position_m: f64,
        /// Attitude (rotation vector), rad.
        attitude_rad: f64,
    },
    /// None.
    Off,
}
