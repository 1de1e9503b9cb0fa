//! The folder of a challenge: cases, a manifest with their checksums, the sealed truth, and the commitment to it.

use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::case::{self, CaseTruth, Options};
use crate::event::{self, Start};
use crate::measurement::Measurement;
use crate::progress::{Steps, Stopped};
use crate::recording::truth_file::write_whole;
use crate::recording::{self, ReadError, RecordError};
use crate::scene::{SceneError, SceneFile};
use crate::seed::{hidden_stream, stream};
use crate::session::SessionError;

/// File that names the cases; it is written last.
pub const MANIFEST: &str = "manifest.json";
/// File of the truth.
pub const SEAL: &str = "sealed.truth";
/// File of the commitment.
pub const COMMITMENT: &str = "commitment.txt";
/// Format of the manifest and of the seal.
const FORMAT: &str = "kincal challenge 1";
/// What the seal begins with.
const SEAL_MAGIC: &[u8] = b"kincal sealed truth 1\n";
/// Cases between two looks at the progress; all that is in memory at a time.
const BATCH: usize = 64;

/// A challenge could not be made or read.
#[derive(Debug, thiserror::Error)]
pub enum ChallengeError {
    /// A step.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// Writing a case.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// Reading a case.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The file system refused.
    #[error("cannot {action} {}: {source}; {remedy}", path.display())]
    Io {
        /// What was tried.
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// Why it failed.
        source: std::io::Error,
        /// What to do.
        remedy: &'static str,
    },
    /// Whoever was told stopped it.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// A cell could not be diagnosed.
    #[error("a simulated cell cannot be diagnosed: {reason}")]
    Diagnosis {
        /// Why, with what to do.
        reason: String,
    },
    /// A challenge is there already.
    #[error("{} holds a challenge already; choose another folder with --out", path.display())]
    Occupied {
        /// The folder.
        path: PathBuf,
    },
    /// Something is not as it was made.
    #[error("{}: {reason}; the challenge is not what was made: copy it again, or make it anew with `kincal challenge new`", path.display())]
    Altered {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
}

/// The manifest: nothing in it depends on the truth but the commitment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Format.
    pub format: String,
    /// Of kincal.
    pub version: String,
    /// SHA-256 of the truth.
    pub commitment: String,
    /// SHA-256 of the file that holds it.
    pub seal_sha256: String,
    /// Kinds of effects that whoever diagnoses must not use.
    pub withheld: Vec<String>,
    /// The cases.
    pub cases: Vec<ManifestCase>,
}

/// A case in the manifest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ManifestCase {
    /// Its file.
    pub file: String,
    /// Of the file.
    pub sha256: String,
}

/// What is sealed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sealed {
    /// Format.
    pub format: String,
    /// Of kincal.
    pub version: String,
    /// So that nobody can try truths until one has the commitment.
    pub salt: String,
    /// Of the challenge.
    pub seed: u64,
    /// How cases were drawn.
    pub options: Options,
    /// The truth about every case.
    pub cases: Vec<CaseTruth>,
}

/// A challenge that is there, its files as they were made.
#[derive(Clone, Debug)]
pub struct Folder {
    /// The folder.
    pub path: PathBuf,
    /// Its manifest.
    pub manifest: Manifest,
}

/// A case as whoever diagnoses it sees it.
#[derive(Clone, Debug)]
pub struct Case {
    /// Its name: `case-0001`.
    pub name: String,
    /// Its file.
    pub path: PathBuf,
    /// The public scene.
    pub start: Start,
    /// The readings.
    pub measurements: Vec<Measurement>,
    /// Kinds of effects that must not be used.
    pub withheld: Vec<String>,
}

/// SHA-256 in hexadecimal.
fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Makes the cases in the folder `path`, which holds no challenge yet; the manifest.
///
/// # Errors
/// If a case cannot be made or written.
pub fn create(path: &Path, base: &SceneFile, options: &Options, seed: u64, progress: &Steps) -> Result<Manifest, ChallengeError> {
    let io = |action, path: &Path| {
        let path = path.to_owned();
        move |source| ChallengeError::Io { action, path, source, remedy: "choose another folder with --out" }
    };
    if [MANIFEST, SEAL, COMMITMENT].iter().any(|name| path.join(name).exists()) {
        return Err(ChallengeError::Occupied { path: path.to_owned() });
    }
    std::fs::create_dir_all(path).map_err(io("make", path))?;
    let key = case::key(seed);
    progress.begin("cases", options.cases)?;
    let (mut cases, mut truths) = (Vec::new(), Vec::new());
    for first in (0..options.cases).step_by(BATCH) {
        let batch: Vec<(ManifestCase, CaseTruth)> = (first..(first + BATCH).min(options.cases))
            .into_par_iter()
            .map(|index| {
                let public = case::public(base, options, &key, index)?;
                let hidden = case::hidden(&public, options, &key, index);
                let (measurements, truth) = case::measured(&public, &hidden, index)?;
                let written = case::write(path, index, &public, &measurements)?;
                let bytes = std::fs::read(&written).map_err(io("read", &written))?;
                progress.done()?;
                Ok((ManifestCase { file: truth.file.clone(), sha256: sha256(&bytes) }, truth))
            })
            .collect::<Result<_, ChallengeError>>()?;
        for (case, truth) in batch {
            cases.push(case);
            truths.push(truth);
        }
    }
    let mut salt = hidden_stream(&key, "challenge/salt");
    let sealed = Sealed {
        format: FORMAT.to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        salt: (0..32).map(|_| format!("{:02x}", salt.index(256))).collect(),
        seed,
        options: options.clone(),
        cases: truths,
    };
    let text = serde_json::to_vec(&sealed)
        .map_err(|error| ChallengeError::Altered { path: path.join(SEAL), reason: error.to_string() })?;
    let commitment = sha256(&text);
    let seal = [SEAL_MAGIC, &veiled(&text)].concat();
    let manifest = Manifest {
        format: FORMAT.to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        commitment: commitment.clone(),
        seal_sha256: sha256(&seal),
        withheld: options.withheld.clone(),
        cases,
    };
    let put = |name: &str, bytes: &[u8]| write_whole(&path.join(name), bytes).map_err(io("write", &path.join(name)));
    put(SEAL, &seal)?;
    put(COMMITMENT, format!("{commitment}\n").as_bytes())?;
    let mut text = serde_json::to_vec_pretty(&manifest).unwrap_or_default();
    text.push(b'\n');
    put(MANIFEST, &text)?;
    Ok(manifest)
}

/// The text under a stream of random bytes, so that nobody reads it by accident; the same again takes it away. It is no secret:
/// what binds is the commitment.
fn veiled(text: &[u8]) -> Vec<u8> {
    let mut veil = stream(0, "challenge/seal");
    text.iter().map(|byte| byte ^ veil.index(256) as u8).collect()
}

impl Folder {
    /// Opens the challenge in the folder `path` and checks that every file is there as it was made; the seal stays shut.
    ///
    /// # Errors
    /// If anything is missing or altered.
    pub fn open(path: &Path) -> Result<Folder, ChallengeError> {
        let read = |name: &str, remedy: &'static str| {
            let path = path.join(name);
            std::fs::read(&path).map_err(|source| ChallengeError::Io { action: "read", path, source, remedy })
        };
        let altered = |name: &str, reason: String| ChallengeError::Altered { path: path.join(name), reason };
        let text = read(MANIFEST, "give the folder that `kincal challenge new` has written")?;
        let manifest: Manifest = serde_json::from_slice(&text).map_err(|error| altered(MANIFEST, error.to_string()))?;
        if manifest.format != FORMAT {
            return Err(altered(MANIFEST, format!("its format is {:?}, not {FORMAT:?}", manifest.format)));
        }
        let commitment = read(COMMITMENT, "the commitment is part of the challenge: copy it again")?;
        let commitment = String::from_utf8_lossy(&commitment);
        if commitment.trim() != manifest.commitment {
            return Err(altered(COMMITMENT, "the commitment is not that of the manifest".to_owned()));
        }
        let seal = read(SEAL, "the sealed truth is part of the challenge: copy it again")?;
        if sha256(&seal) != manifest.seal_sha256 {
            return Err(altered(SEAL, "the seal's checksum is not that of the manifest".to_owned()));
        }
        for case in &manifest.cases {
            // A name from a file is no path to elsewhere.
            if case.file.contains(['/', '\\']) || case.file.starts_with('.') {
                return Err(altered(MANIFEST, format!("{:?} is no name of a case", case.file)));
            }
            let bytes = read(&case.file, "the case is part of the challenge: copy it again")?;
            if sha256(&bytes) != case.sha256 {
                return Err(altered(&case.file, "the case's checksum is not that of the manifest".to_owned()));
            }
        }
        Ok(Folder { path: path.to_owned(), manifest })
    }

    /// The same cases with nothing withheld.
    #[must_use]
    pub fn whole(&self) -> Folder {
        let manifest = Manifest { withheld: Vec::new(), ..self.manifest.clone() };
        Folder { path: self.path.clone(), manifest }
    }

    /// Case `index` as whoever diagnoses sees it.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn case(&self, index: usize) -> Result<Case, ChallengeError> {
        let file = &self.manifest.cases[index].file;
        let path = self.path.join(file);
        let recording = recording::read(&path)?;
        let measurements = event::measurements(&recording.events);
        let name = file.trim_end_matches(".mcap").to_owned();
        Ok(Case { name, path, start: recording.start, measurements, withheld: self.manifest.withheld.clone() })
    }

    /// Opens the seal and checks it against the commitment.
    ///
    /// # Errors
    /// If the truth is not what was committed to.
    pub fn unseal(&self) -> Result<Sealed, ChallengeError> {
        let path = self.path.join(SEAL);
        let altered = |reason: String| ChallengeError::Altered { path: path.clone(), reason };
        let bytes = std::fs::read(&path).map_err(|source| ChallengeError::Io {
            action: "read",
            path: path.clone(),
            source,
            remedy: "the sealed truth is part of the challenge: copy it again",
        })?;
        let Some(text) = bytes.strip_prefix(SEAL_MAGIC).map(veiled) else {
            return Err(altered("it is no sealed truth of kincal".to_owned()));
        };
        let found = sha256(&text);
        if found != self.manifest.commitment {
            return Err(altered(format!("the truth has the SHA-256 {found}, committed to was {}", self.manifest.commitment)));
        }
        let sealed: Sealed = serde_json::from_slice(&text).map_err(|error| altered(error.to_string()))?;
        let files = |names: Vec<&String>| names.into_iter().cloned().collect::<Vec<_>>();
        let listed = files(self.manifest.cases.iter().map(|case| &case.file).collect());
        if files(sealed.cases.iter().map(|case| &case.file).collect()) != listed {
            return Err(altered("it is about other cases than the manifest".to_owned()));
        }
        Ok(sealed)
    }
}
