//! How good a set of configurations is: observability (O1–O6), globality (dispersion, evenness), and both together (O_C).

pub mod evaluator;
pub mod globality;
pub mod information;
pub mod observability;
pub mod prediction;
pub mod subspace;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Every index of a set of configurations.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Indexes {
    /// Geometric mean of the singular values over the root of their number (eq. 15; Menq and Borm).
    pub o1: f64,
    /// Inverse condition number (eq. 16; Driels and Pathre).
    pub o2: f64,
    /// Smallest singular value (eq. 17; Nahvi, Hollerbach and Hayward).
    pub o3: f64,
    /// Noise amplification index, σ_min² / σ_max (Nahvi and Hollerbach 1996).
    pub o4: f64,
    /// One over the sum of the reciprocal singular values (Sun and Hollerbach 2008).
    pub o5: f64,
    /// Improved Φp-optimality (Wang et al. 2018).
    pub o6: f64,
    /// Dispersion D of the end points, m² (eq. 20).
    pub dispersion_m2: f64,
    /// Evenness U of the end points (eq. 25) in the domain that the design uses.
    pub evenness: f64,
    /// Comprehensive quality index (eq. 27).
    pub comprehensive: f64,
    /// Singular values taken as nonzero: the dimension of the identifiable subspace.
    pub rank: usize,
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
