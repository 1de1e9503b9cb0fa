//! The file of results: a header, then one line for every finished trial, in the order of the work. Nothing in it is ever changed, so
//! that a sweep that was killed goes on behind its last whole line.

use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, Seek, Write};
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::grid::Cell;
use crate::files::Aside;

/// First field of the header.
pub const FORMAT: &str = "kincal sweep 1";

/// First line of the file: what was swept.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Header {
    /// [`FORMAT`].
    pub format: String,
    /// Of kincal.
    pub version: String,
    /// Name of the scene.
    pub scene: String,
    /// Where the arm's numbers come from.
    pub arm_note: String,
    /// SHA-256 of everything that the numbers depend on: version, scene, grid, chosen configurations.
    pub hash: String,
    /// Declared position noise at no distance, one sigma per axis, m.
    pub position_sigma_m: f64,
    /// Name and unit of every parameter.
    pub parameters: Vec<(String, String)>,
    /// The cells, in the order of their numbers.
    pub cells: Vec<Cell>,
    /// Public part of the scene.
    pub public_scene: String,
}

/// A finished trial in one cell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Record {
    /// Number of the trial.
    pub trial: u64,
    /// Number of the cell.
    pub cell: usize,
    /// Whether the fit converged.
    pub converged: bool,
    /// Combinations told apart.
    pub rank: usize,
    /// Position error on what was held out, RMS, m.
    pub held_out_m: f64,
    /// Orientation error on it, RMS, rad.
    pub held_out_rad: Option<f64>,
    /// Residuals over the declared noise.
    pub residual_scale: Option<f64>,
    /// How far the effect moves the fitted positions, RMS, m; absent where there is none.
    pub displacement_m: Option<f64>,
    /// Share of the effect's energy (in sigmas) that geometry absorbs.
    pub swallowed: Option<f64>,
    /// What is left of it, ‖P⊥ s‖²/σ², with the geometry that is fitted here.
    pub lambda: Option<f64>,
    /// What was identified; empty where the fit did not converge.
    pub estimates: Vec<Estimate>,
}

/// An identified combination.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "(usize, f64, f64, f64)", into = "(usize, f64, f64, f64)")]
pub struct Estimate {
    /// Column of the independent parameter.
    pub column: usize,
    /// Identified minus true value of the combination, SI.
    pub error: f64,
    /// As stated.
    pub standard_error: f64,
    /// Half width of the stated 95 % interval.
    pub half_width: f64,
}

impl From<(usize, f64, f64, f64)> for Estimate {
    fn from((column, error, standard_error, half_width): (usize, f64, f64, f64)) -> Self {
        Estimate { column, error, standard_error, half_width }
    }
}

impl From<Estimate> for (usize, f64, f64, f64) {
    fn from(estimate: Estimate) -> Self {
        (estimate.column, estimate.error, estimate.standard_error, estimate.half_width)
    }
}

/// A file of results cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ResultsError {
    /// The file system refused.
    #[error("cannot {action} {}: {source}; check the path, or choose another folder with --out", path.display())]
    Io {
        /// What was tried.
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// Why it failed.
        source: io::Error,
    },
    /// Another process writes it.
    #[error("{} is being written by another sweep; wait for it, or choose another folder with --out", path.display())]
    Busy {
        /// The file.
        path: PathBuf,
    },
    /// Not one of ours, or damaged.
    #[error("{}:{line}: {reason}; it is not what kincal sweep writes: remove it, or choose another folder with --out", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: u64,
        /// What is wrong.
        reason: String,
    },
    /// Made with something else.
    #[error(
        "{} holds results of another sweep (hash {found}, this one {expected}): scene, grid or version differ; give what it was made \
         with, or choose another folder with --out",
        path.display()
    )]
    Other {
        /// The file.
        path: PathBuf,
        /// Its hash, shortened.
        found: String,
        /// The one at hand, shortened.
        expected: String,
    },
    /// Other trials.
    #[error(
        "{} holds trials {found}, asked for are {asked}; ask for trials from {} on that include these, or choose another folder with --out",
        path.display(),
        first
    )]
    Range {
        /// The file.
        path: PathBuf,
        /// What it holds.
        found: String,
        /// What was asked for.
        asked: String,
        /// First trial of the file.
        first: u64,
    },
    /// Parts that do not fit together.
    #[error("{0}")]
    Parts(String),
}

/// A file of results that is being written.
pub struct Results {
    file: File,
    path: PathBuf,
    count: u64,
}

/// What the header needs before records can follow.
fn line(value: &impl Serialize) -> Result<Vec<u8>, String> {
    let mut line = serde_json::to_vec(value).map_err(|error| error.to_string())?;
    line.push(b'\n');
    Ok(line)
}

impl Results {
    /// Opens the file at `path` for the trials `trials` (numbers, end excluded) of the sweep `header`, making it where there is none;
    /// half a line at its end is dropped.
    ///
    /// # Errors
    /// If it holds something else, or cannot be written.
    pub fn open(path: &Path, header: &Header, trials: std::ops::Range<u64>) -> Result<Results, ResultsError> {
        let io = |action: &'static str| move |source| ResultsError::Io { action, path: path.to_owned(), source };
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(io("make the folder of"))?;
        }
        let mut file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path).map_err(io("open"))?;
        // A file system that knows no locks must not keep anyone from sweeping.
        if let Err(std::fs::TryLockError::WouldBlock) = file.try_lock() {
            return Err(ResultsError::Busy { path: path.to_owned() });
        }
        let mut reader = Reader::of(path, BufReader::new(&file))?;
        let (mut count, mut end) = (0, 0);
        if let Some(found) = reader.header()? {
            if found.hash != header.hash {
                let [found, expected] = [&found.hash, &header.hash].map(|hash| hash.chars().take(12).collect());
                return Err(ResultsError::Other { path: path.to_owned(), found, expected });
            }
            end = reader.offset;
            let cells = header.cells.len() as u64;
            let mut first = None;
            while let Some(record) = reader.next()? {
                let at = record.trial * cells + record.cell as u64;
                let first = *first.get_or_insert(record.trial);
                if first != trials.start || record.trial >= trials.end {
                    let found = format!("{first}..{}", record.trial + 1);
                    let asked = format!("{}..{}", trials.start, trials.end);
                    return Err(ResultsError::Range { path: path.to_owned(), found, asked, first });
                }
                if record.cell >= header.cells.len() || at != trials.start * cells + count {
                    return Err(reader.content(format!("trial {} of cell {} is out of order", record.trial, record.cell)));
                }
                count += 1;
                end = reader.offset;
            }
        }
        drop(reader);
        file.set_len(end).map_err(io("write"))?;
        file.seek(io::SeekFrom::End(0)).map_err(io("write"))?;
        let mut results = Results { file, path: path.to_owned(), count };
        if end == 0 {
            results.put(header)?;
        }
        Ok(results)
    }

    /// Records in it.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Appends records.
    ///
    /// # Errors
    /// If they cannot be written.
    pub fn append(&mut self, records: &[Record]) -> Result<(), ResultsError> {
        let mut bytes = Vec::new();
        for record in records {
            bytes.extend(line(record).map_err(ResultsError::Parts)?);
        }
        self.write(&bytes)?;
        self.count += records.len() as u64;
        Ok(())
    }

    fn put(&mut self, value: &impl Serialize) -> Result<(), ResultsError> {
        let bytes = line(value).map_err(ResultsError::Parts)?;
        self.write(&bytes)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), ResultsError> {
        // One call and no buffer: what is finished is in the file.
        self.file.write_all(bytes).map_err(|source| ResultsError::Io { action: "write", path: self.path.clone(), source })
    }
}

/// Reads a file of results line by line.
pub struct Reader<R> {
    path: PathBuf,
    lines: R,
    number: u64,
    offset: u64,
    text: Vec<u8>,
}

impl Reader<BufReader<File>> {
    /// Opens the file at `path`.
    ///
    /// # Errors
    /// If it cannot be opened.
    pub fn open(path: &Path) -> Result<Self, ResultsError> {
        let file = File::open(path).map_err(|source| ResultsError::Io { action: "read", path: path.to_owned(), source })?;
        Reader::of(path, BufReader::new(file))
    }
}

impl<R: BufRead> Reader<R> {
    fn of(path: &Path, lines: R) -> Result<Self, ResultsError> {
        Ok(Reader { path: path.to_owned(), lines, number: 0, offset: 0, text: Vec::new() })
    }

    fn content(&self, reason: String) -> ResultsError {
        ResultsError::Content { path: self.path.clone(), line: self.number, reason }
    }

    /// The next whole line; `None` at the end and where the last line is torn.
    fn line(&mut self) -> Result<bool, ResultsError> {
        self.text.clear();
        let read = self.lines.read_until(b'\n', &mut self.text);
        let read = read.map_err(|source| ResultsError::Io { action: "read", path: self.path.clone(), source })?;
        self.number += 1;
        if self.text.last() != Some(&b'\n') {
            return Ok(false);
        }
        self.offset += read as u64;
        Ok(true)
    }

    /// The header, which comes first; `None` in an empty file, or one whose first line is torn.
    ///
    /// # Errors
    /// If it is something else.
    pub fn header(&mut self) -> Result<Option<Header>, ResultsError> {
        if !self.line()? {
            // Nothing of anyone else's is thrown away.
            let begun = format!("{{\"format\":\"{FORMAT}\"").into_bytes();
            let length = begun.len().min(self.text.len());
            return if self.text[..length] == begun[..length] {
                Ok(None)
            } else {
                Err(self.content("the header is missing".to_owned()))
            };
        }
        let header: Header = serde_json::from_slice(&self.text).map_err(|error| self.content(error.to_string()))?;
        if header.format != FORMAT {
            return Err(self.content(format!("its format is {:?}, not {FORMAT:?}", header.format)));
        }
        Ok(Some(header))
    }

    /// The next record.
    ///
    /// # Errors
    /// If a whole line is none.
    #[allow(clippy::should_implement_trait, reason = "an iterator could not end at an error and be asked for the line")]
    pub fn next(&mut self) -> Result<Option<Record>, ResultsError> {
        if !self.line()? {
            return Ok(None);
        }
        serde_json::from_slice(&self.text).map(Some).map_err(|error| self.content(error.to_string()))
    }
}

/// Merges the parts of a sweep (files of the same sweep, made anywhere) into the file at `out`, as one run would have written it; the
/// trials that it then holds. One line of each part is in memory.
///
/// # Errors
/// If the parts belong to different sweeps, overlap with different numbers, or leave a gap.
pub fn merge(parts: &[PathBuf], out: &Path) -> Result<std::ops::Range<u64>, ResultsError> {
    let mut readers = Vec::with_capacity(parts.len());
    let mut header: Option<Header> = None;
    for path in parts {
        let mut reader = Reader::open(path)?;
        let Some(found) = reader.header()? else {
            return Err(ResultsError::Parts(format!("{} is empty; leave it out", path.display())));
        };
        match &header {
            Some(header) if header.hash != found.hash => {
                let [found, expected] = [&found.hash, &header.hash].map(|hash| hash.chars().take(12).collect());
                return Err(ResultsError::Other { path: path.clone(), found, expected });
            }
            _ => header = Some(found),
        }
        readers.push(reader);
    }
    let Some(header) = header else {
        return Err(ResultsError::Parts("--merge needs at least one file of results".to_owned()));
    };
    let cells = header.cells.len() as u64;
    let mut heads: Vec<Option<Record>> = Vec::with_capacity(readers.len());
    for reader in &mut readers {
        heads.push(reader.next()?);
    }
    let partial = out.with_extension("partial.jsonl");
    let io = |action: &'static str, path: &Path| {
        let path = path.to_owned();
        move |source| ResultsError::Io { action, path, source }
    };
    if let Some(folder) = out.parent() {
        std::fs::create_dir_all(folder).map_err(io("make the folder of", out))?;
    }
    let (aside, file) = Aside::create(&partial).map_err(io("write", &partial))?;
    let mut writer = io::BufWriter::new(file);
    writer.write_all(&line(&header).map_err(ResultsError::Parts)?).map_err(io("write", &partial))?;
    let place = |record: &Record| record.trial * cells + record.cell as u64;
    let mut range: Option<(u64, u64)> = None;
    let merged = loop {
        let Some(next) = heads.iter().flatten().map(place).min() else { break Ok(()) };
        if let Some((_, last)) = range
            && next != last + 1
        {
            let from = (last + 1) / cells;
            break Err(ResultsError::Parts(format!(
                "the parts leave a gap: trial {from} (cell {}) up to trial {} (cell {}) is in none of them; sweep it with --trials \
                 {from}..{} and merge again",
                (last + 1) % cells,
                next / cells,
                next % cells,
                next.div_ceil(cells)
            )));
        }
        let mut taken: Option<(Record, usize)> = None;
        for (index, head) in heads.iter_mut().enumerate() {
            let Some(record) = head.take_if(|record| place(record) == next) else { continue };
            match &taken {
                Some((other, from)) if *other != record => {
                    return Err(ResultsError::Parts(format!(
                        "{} and {} differ in trial {}, cell {}: they were not made by the same program on the same kind of machine",
                        parts[*from].display(),
                        parts[index].display(),
                        record.trial,
                        record.cell
                    )));
                }
                Some(_) => {}
                None => taken = Some((record, index)),
            }
            *head = readers[index].next()?;
            if let Some(record) = head
                && place(record) <= next
            {
                return Err(readers[index].content(format!("trial {} of cell {} is out of order", record.trial, record.cell)));
            }
        }
        if let Some((record, _)) = taken {
            writer.write_all(&line(&record).map_err(ResultsError::Parts)?).map_err(io("write", &partial))?;
        }
        range = Some((range.map_or(next, |(first, _)| first), next));
    };
    let finished = merged.and_then(|()| match range {
        Some((first, last)) if first % cells == 0 && (last + 1) % cells == 0 => Ok(first / cells..(last + 1) / cells),
        Some((first, last)) => Err(ResultsError::Parts(format!(
            "the parts begin or end in the middle of a trial ({} and {}): let the unfinished sweep finish, then merge",
            first / cells,
            last / cells
        ))),
        None => Err(ResultsError::Parts("the parts hold no finished trial".to_owned())),
    });
    let written = writer.into_inner().map_err(|error| error.into_error()).and_then(|file| file.sync_all());
    let trials = finished?;
    written.map_err(io("write", &partial))?;
    aside.become_of(out).map_err(io("write", out))?;
    Ok(trials)
}
