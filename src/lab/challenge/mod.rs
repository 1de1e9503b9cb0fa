//! Blind cases: recordings of cells whose fault is withheld, the sealed truth about them, and the score of whoever diagnoses them.
//!
//! What of a case is public ([`case::Public`]) is drawn before and apart from what is hidden ([`case::Hidden`]); a recording is written
//! from the public part and the measurements alone.

pub mod case;
pub mod folder;
pub mod power;
pub mod score;
pub mod verdict;

pub use case::{CaseTruth, Options, TrueEffect};
pub use folder::{Case, ChallengeError, Folder, Sealed};
pub use score::{Score, score};
pub use verdict::Verdict;
