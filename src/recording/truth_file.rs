//! The truth file beside a recording: what was injected, and what came of it. With the recording it repeats the run.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::simulation::cell::Truth;
use crate::simulation::cell::truth::{TrueEffect, TrueParameter, TruePose};

/// The file as it stands: TOML, the scene's `[injected]` section first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TruthFile {
    /// Version of kincal.
    pub version: String,
    /// Name of the scene.
    pub scene: String,
    /// Public seed of the run that it belongs to.
    pub seed: u64,
    /// The hidden section of the scene.
    pub injected: toml::Table,
    /// What was drawn.
    pub parameters: Vec<TrueParameter>,
    /// What happens to the arm, its cell and its sensor besides.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<TrueEffect>,
    /// What the physics made of it.
    pub poses: Vec<TruePose>,
}

/// A truth file that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum TruthFileError {
    /// Reading failed.
    #[error("cannot read {file}: {source}; give the truth file (.truth.toml) of this run")]
    Unreadable {
        /// Path.
        file: String,
        /// Cause.
        source: std::io::Error,
    },
    /// Writing failed.
    #[error("{file} cannot be written: {reason}; choose another folder with --out")]
    Unwritable {
        /// Path.
        file: String,
        /// Cause.
        reason: String,
    },
    /// Not a truth file.
    #[error("{file} is not a truth file of kincal: {reason}")]
    Foreign {
        /// Path.
        file: String,
        /// What the parser says, with line and column.
        reason: String,
    },
}

impl TruthFile {
    /// The truth in it.
    #[must_use]
    pub fn truth(self) -> Truth {
        Truth { parameters: self.parameters, effects: self.effects, poses: self.poses }
    }

    /// Writes the file at once: under another name first, so that no half of it is ever seen.
    ///
    /// # Errors
    /// If the folder cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), TruthFileError> {
        let unwritable = |reason: String| TruthFileError::Unwritable { file: path.display().to_string(), reason };
        let text = toml::to_string(self).map_err(|error| unwritable(error.to_string()))?;
        write_whole(path, text.as_bytes()).map_err(|error| unwritable(error.to_string()))
    }

    /// Reads the file at `path`.
    ///
    /// # Errors
    /// If it cannot be read or is something else.
    pub fn read(path: &Path) -> Result<TruthFile, TruthFileError> {
        let file = path.display().to_string();
        let text = crate::files::text(path, crate::files::LARGEST_TEXT)
            .map_err(|source| TruthFileError::Unreadable { file: file.clone(), source })?;
        toml::from_str(&text).map_err(|error| TruthFileError::Foreign { file, reason: error.to_string().trim_end().to_owned() })
    }
}

/// Writes a small file so that it is there whole or not at all.
///
/// # Errors
/// As the file system says.
pub fn write_whole(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut partial = path.as_os_str().to_owned();
    partial.push(".partial");
    let partial = std::path::PathBuf::from(partial);
    let (aside, mut file) = crate::files::Aside::create(&partial)?;
    std::io::Write::write_all(&mut file, bytes)?;
    aside.become_of(path)
}
