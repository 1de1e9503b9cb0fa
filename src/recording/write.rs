//! Writing a recording while the run goes on.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{McapError, WriteOptions, Writer};

use super::encode::{EncodeError, Encoder, Message};
use super::topic::Topic;
use crate::arm::Arm;
use crate::event::Event;
use crate::progress::{Progress, Stopped};

/// Uncompressed size at which a chunk is closed after the current event, bytes.
const CHUNK_BYTES: usize = 1024 * 1024;
/// Iterations or steps of the design from one flush to the next.
const STEPS_PER_FLUSH: usize = 10;
/// Measured configurations from one flush to the next.
const MEASUREMENTS_PER_FLUSH: usize = 16;

/// Identifies the writer in the file's header.
const LIBRARY: &str = concat!("kincal ", env!("CARGO_PKG_VERSION"));

/// A recording could not be written.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file system refused.
    #[error("cannot {action} {}: {source}; {}", path.display(), remedy(source))]
    Output {
        /// What was tried: `create`, `write`, …
        action: &'static str,
        /// The file or directory.
        path: PathBuf,
        /// Why it failed.
        source: io::Error,
    },
    /// Another process writes the same recording.
    #[error("{} is being written by another run; wait for it or choose another name or directory", path.display())]
    Busy {
        /// The partial file.
        path: PathBuf,
    },
    /// The file's format cannot take it.
    #[error("cannot write {}: {source}", path.display())]
    Format {
        /// The partial file.
        path: PathBuf,
        /// Why it failed.
        source: McapError,
    },
    /// An event cannot be recorded.
    #[error(transparent)]
    Event(#[from] EncodeError),
}

fn remedy(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => "free some space or choose another output directory",
        _ => "choose an output directory that can be written to",
    }
}

/// Writes a run to `{directory}/{name}.partial.mcap`, which becomes `{directory}/{name}.mcap` when the run has ended well: an
/// earlier recording of that name is replaced by a whole one only. A run that dies leaves the partial file, readable up to its
/// last chunk.
///
/// Chunks end after fixed numbers of events, never by the clock, so that the bytes are a function of the events alone.
pub struct Recorder {
    encoder: Encoder,
    /// `None` only while it is being finished or dropped.
    writer: Option<Writer<NoSeek<BufWriter<File>>>>,
    channels: BTreeMap<Topic, u16>,
    partial: PathBuf,
    finished: PathBuf,
    steps_since_flush: usize,
    measurements_since_flush: usize,
    bytes_since_flush: usize,
    output_failed: bool,
    /// Whether what is derived for viewers is left out.
    sources_only: bool,
}

impl Recorder {
    /// Opens the partial file, and makes the directory where there is none. `arm` is the nominal arm.
    ///
    /// # Errors
    /// If the directory or the file cannot be made or another process is writing it.
    pub fn create(directory: &Path, name: &str, arm: &Arm) -> Result<Recorder, RecordError> {
        fs::create_dir_all(directory).map_err(|source| output("create", directory, source))?;
        let partial = directory.join(format!("{name}.partial.mcap"));
        let finished = directory.join(format!("{name}.mcap"));
        if finished.is_dir() {
            return Err(output("replace", &finished, io::ErrorKind::IsADirectory.into()));
        }
        let create = |source| output("create", &partial, source);
        crate::files::no_link(&partial).map_err(create)?;
        let file = OpenOptions::new().write(true).create(true).truncate(false).open(&partial).map_err(create)?;
        // A file system that knows no locks must not keep anyone from recording.
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            return Err(RecordError::Busy { path: partial });
        }
        file.set_len(0).map_err(create)?;
        let writer = WriteOptions::new()
            .profile("")
            .library(LIBRARY)
            .compression(Some(mcap::Compression::Zstd))
            .compression_threads(0)
            // Chunks are closed between events only, so that none holds half of one.
            .chunk_size(None)
            // A chunk goes to the file in one piece, so that a killed run leaves no half-written header.
            .disable_seeking(true)
            .create(NoSeek::new(BufWriter::new(file)))
            .map_err(|source| format(&partial, source))?;
        Ok(Recorder {
            encoder: Encoder::new(arm),
            writer: Some(writer),
            channels: BTreeMap::new(),
            partial,
            finished,
            steps_since_flush: 0,
            measurements_since_flush: 0,
            bytes_since_flush: 0,
            output_failed: false,
            sources_only: false,
        })
    }

    /// Leaves out what is derived for viewers: a thousand recordings that a program reads need no pictures.
    #[must_use]
    pub fn sources_only(mut self) -> Recorder {
        self.sources_only = true;
        self
    }

    /// Where the run is being written.
    #[must_use]
    pub fn partial_path(&self) -> &Path {
        &self.partial
    }

    /// Records the next event.
    ///
    /// # Errors
    /// If it cannot be written or holds numbers that are not finite.
    pub fn record(&mut self, event: &Event) -> Result<(), RecordError> {
        let recorded = self.record_messages(event);
        self.output_failed |= matches!(recorded, Err(RecordError::Output { .. } | RecordError::Format { .. }));
        recorded
    }

    /// Gives the recording up and removes the partial file: the run was refused. Where it ended because nothing more could be
    /// written, the file stays.
    pub fn discard(self) {
        let partial = (!self.output_failed).then(|| self.partial.clone());
        drop(self);
        if let Some(partial) = partial {
            // Nothing to be done, and nothing lost, where it cannot be removed.
            let _ = fs::remove_file(partial);
        }
    }

    fn record_messages(&mut self, event: &Event) -> Result<(), RecordError> {
        for message in self.encoder.encode(event)? {
            if self.sources_only && message.topic.message_encoding() != "json" {
                continue;
            }
            self.bytes_since_flush += message.data.len();
            self.write(&message).map_err(|source| format(&self.partial, source))?;
        }
        if let Event::Start(start) = event {
            let metadata = [("version".to_owned(), start.version.clone()), ("command".to_owned(), start.command.clone())].into();
            self.with_writer(|writer| writer.write_metadata(&Metadata { name: "kincal".to_owned(), metadata }))?;
        }
        match event {
            Event::Swarm(_) | Event::Search(_) => self.steps_since_flush += 1,
            Event::Measured(_) => self.measurements_since_flush += 1,
            _ => {}
        }
        let phase_ended = matches!(event, Event::Start(_) | Event::Designed(_) | Event::Identified(_) | Event::Diagnosed(_));
        if phase_ended
            || self.steps_since_flush >= STEPS_PER_FLUSH
            || self.measurements_since_flush >= MEASUREMENTS_PER_FLUSH
            || self.bytes_since_flush >= CHUNK_BYTES
        {
            self.with_writer(Writer::flush)?;
            (self.steps_since_flush, self.measurements_since_flush, self.bytes_since_flush) = (0, 0, 0);
        }
        Ok(())
    }

    /// Ends the recording and gives it its final name, which is returned.
    ///
    /// # Errors
    /// If the rest cannot be written or the file not be renamed; the partial file is left.
    pub fn finish(mut self) -> Result<PathBuf, RecordError> {
        self.with_writer(|writer| writer.finish().map(|_| ()))?;
        if let Some(writer) = self.writer.take() {
            let file = writer.into_inner().into_inner().into_inner();
            let file = file.map_err(|error| output("write", &self.partial, error.into_error()))?;
            file.sync_all().map_err(|source| output("write", &self.partial, source))?;
        }
        fs::rename(&self.partial, &self.finished).map_err(|source| output("replace", &self.finished, source))?;
        Ok(self.finished.clone())
    }

    fn with_writer<T>(
        &mut self,
        act: impl FnOnce(&mut Writer<NoSeek<BufWriter<File>>>) -> Result<T, McapError>,
    ) -> Result<T, RecordError> {
        let writer = self.writer.as_mut().ok_or(McapError::AttemptedWriteAfterFailure);
        writer.and_then(act).map_err(|source| format(&self.partial, source))
    }

    fn write(&mut self, message: &Message) -> Result<(), McapError> {
        let writer = self.writer.as_mut().ok_or(McapError::AttemptedWriteAfterFailure)?;
        let channel_id = match self.channels.get(&message.topic) {
            Some(id) => *id,
            None => {
                let schema = message.topic.schema();
                let schema_id = writer.add_schema(&schema.name, &schema.encoding, &schema.data)?;
                let (name, encoding) = (message.topic.name(), message.topic.message_encoding());
                let id = writer.add_channel(schema_id, name, encoding, &BTreeMap::new())?;
                self.channels.insert(message.topic, id);
                id
            }
        };
        let header = MessageHeader {
            channel_id,
            sequence: message.event,
            log_time: message.log_time_ns,
            publish_time: message.log_time_ns,
        };
        writer.write_to_known_channel(&header, &message.data)
    }
}

impl Progress<&Event> for Recorder {
    fn report(&mut self, event: &Event) -> Result<(), Stopped> {
        self.record(event).map_err(|error| Stopped(error.to_string()))
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        if let Some(mut writer) = self.writer.take() {
            // A run that failed keeps what it has, but without the footer that would make it look whole.
            let _ = writer.flush();
            drop(writer.into_inner());
        }
    }
}

fn output(action: &'static str, path: &Path, source: io::Error) -> RecordError {
    RecordError::Output { action, path: path.to_owned(), source }
}

fn format(path: &Path, source: McapError) -> RecordError {
    match source {
        McapError::Io(source) => output("write", path, source),
        source => RecordError::Format { path: path.to_owned(), source },
    }
}
