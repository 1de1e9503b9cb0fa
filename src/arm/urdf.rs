//! URDF in and out.
//!
//! An imported arm is a chain whose parameters are the six numbers of each moving joint's origin, and of the tool's; an exported
//! one holds every frame of the chain as a link, its numbers written so that they read back as the same bits.

mod export;
mod import;
mod locate;
mod others;
mod plausible;
mod rewrite;
pub(crate) mod rpy;
#[cfg(test)]
mod tests;

use std::fmt;
use std::path::PathBuf;

pub use export::{export, export_with};
pub use import::{Imported, import, read};
pub use others::{ros_transforms, ur_kinematics};
pub use rewrite::{Added, Change, rewrite};

/// Why a URDF could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum UrdfError {
    /// The file could not be read.
    #[error("{}: {source}\n  do: check the path", path.display())]
    Read {
        /// As asked for.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The text is not a URDF of a serial arm.
    #[error(transparent)]
    Invalid(Box<UrdfProblem>),
    /// The values to export do not belong to the arm.
    #[error("{found} parameter values for an arm with {expected} parameters")]
    ValueCount {
        /// Values given.
        found: usize,
        /// Parameters of the arm.
        expected: usize,
    },
    /// A value to export is not a number.
    #[error("parameter {name} is {value}: only finite values can be written")]
    NotFinite {
        /// The parameter.
        name: String,
        /// Its value.
        value: f64,
    },
}

/// One thing that is wrong in a URDF.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UrdfProblem {
    /// The file, or what else the text is called.
    pub origin: String,
    /// Line, from 1, where it can be found.
    pub line: Option<usize>,
    /// The element: `joint "wrist"`; empty for the whole file.
    pub element: String,
    /// What was found.
    pub found: String,
    /// What is allowed.
    pub allowed: String,
    /// What to do.
    pub remedy: String,
}

impl fmt::Display for UrdfProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.origin)?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        write!(f, ": {}", if self.element.is_empty() { "(robot)" } else { &self.element })?;
        for (label, text) in [("found", &self.found), ("allowed", &self.allowed), ("do", &self.remedy)] {
            if !text.is_empty() {
                write!(f, "\n  {label}: {text}")?;
            }
        }
        Ok(())
    }
}

impl std::error::Error for UrdfProblem {}
