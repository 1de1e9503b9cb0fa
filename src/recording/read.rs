//! Reading a recording, whole or cut off.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fmt;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use foxglove::messages::{Log, PointCloud};
use mcap::records::{Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{MAGIC, McapError};
use prost::Message as _;

use super::cloud;
use super::encode::NOT_DIAGNOSED;
use super::json::Source;
use super::topic::Topic;
use crate::event::{Event, Start};

/// Longest record and longest chunk after decompression that is accepted, bytes: a damaged length must not fill the memory.
const RECORD_LIMIT: usize = 256 * 1024 * 1024;
/// Bytes asked of the file at a time.
const READ_BYTES: usize = 256 * 1024;
/// How much of a file of others is searched for topics to name, bytes.
const FOREIGN_BYTES: u64 = 16 * 1024 * 1024;

/// A run, read back.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// What the run was. Also the first of `events`.
    pub start: Start,
    /// All events in order, the start included.
    pub events: Vec<Event>,
    /// Number of messages they were recorded in, those derived for viewers included.
    pub message_count: u64,
    /// Where and why reading ended before the file's regular end; `None` for a whole recording.
    pub cut: Option<Cut>,
    /// What to tell about the version that recorded; `None` where it is this one or older.
    pub version_warning: Option<String>,
}

impl Recording {
    /// Whether the run had ended and every checksum of the file holds.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.cut.is_none()
    }
}

/// Where a recording stops being readable. What comes before it has passed its checksums.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cut {
    /// The file.
    pub path: PathBuf,
    /// Whether bytes were altered; otherwise the end of the file is missing.
    pub damaged: bool,
    /// Offset of the first record (chunk) that could not be read, bytes.
    pub offset: u64,
    /// Length of the file, bytes.
    pub file_length: u64,
    /// What was found there.
    pub reason: String,
    /// Messages read before.
    pub messages: u64,
    /// Simulated time of the last message read, ns.
    pub last_time_ns: Option<u64>,
}

impl fmt::Display for Cut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Cut { path, offset, file_length, reason, messages, .. } = self;
        let path = path.display();
        if self.damaged {
            write!(f, "{path} is damaged at byte {offset} of {file_length} ({reason}); ")?;
        } else {
            write!(f, "{path} is cut off: its last whole record ends at byte {offset} of {file_length} ({reason}); ")?;
        }
        match self.last_time_ns {
            Some(ns) => write!(f, "{messages} messages up to {:.3} s of simulated time are there; ", ns as f64 * 1e-9)?,
            None => write!(f, "no message is there; ")?,
        }
        if self.damaged { write!(f, "copy it again or repeat the run") } else { write!(f, "repeat the run for the rest") }
    }
}

/// A file cannot be read as a recording.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file system refused.
    #[error("cannot read {}: {source}; check the path", path.display())]
    Input {
        /// The file.
        path: PathBuf,
        /// Why it failed.
        source: io::Error,
    },
    /// Nothing in it.
    #[error("{} is empty; repeat the run that should have written it", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// Another format.
    #[error("{} is no MCAP file (it begins with {found}); give a recording that kincal has written", path.display())]
    NotMcap {
        /// The file.
        path: PathBuf,
        /// Its first bytes.
        found: String,
    },
    /// An MCAP file of others.
    #[error(
        "{} is an MCAP file, but not a recording of kincal: it does not begin with a message kincal.Run on /run; topics found: \
         {topics}; give a recording that kincal has written",
        path.display()
    )]
    Foreign {
        /// The file.
        path: PathBuf,
        /// Topics with their schemas.
        topics: String,
    },
    /// Cut off or damaged before the first message.
    #[error("{0}")]
    Nothing(Cut),
    /// A message that passes its checksum but cannot be understood.
    #[error(
        "{}: message {number} on {topic} cannot be understood: {reason}; it was recorded by kincal {recorded_by}, this is \
         {}: use that version or repeat the run",
        path.display(),
        env!("CARGO_PKG_VERSION")
    )]
    Content {
        /// The file.
        path: PathBuf,
        /// Number of the message in the file, from 0.
        number: u64,
        /// Its topic.
        topic: String,
        /// What is wrong with it.
        reason: String,
        /// Version that recorded.
        recorded_by: String,
    },
}

/// A message as it stands in the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordedMessage {
    /// Number in the file, from 0.
    pub number: u64,
    /// Topic and schema.
    pub channel: Arc<RecordedChannel>,
    /// MCAP sequence number: that of the event.
    pub event: u32,
    /// Simulated time, ns.
    pub log_time_ns: u64,
    /// JSON or protobuf.
    pub data: Vec<u8>,
}

/// Topic and schema name of a channel.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct RecordedChannel {
    /// As in the file.
    pub topic: String,
    /// As in the file; empty without a schema.
    pub schema: String,
}

impl RecordedMessage {
    /// The topic, where it is one of kincal's with kincal's schema.
    #[must_use]
    pub fn topic(&self) -> Option<Topic> {
        Topic::from_name(&self.channel.topic).filter(|topic| topic.schema_name() == self.channel.schema)
    }
}

/// Schemas and channels read so far.
#[derive(Default)]
struct Catalogue {
    schemas: BTreeMap<u16, String>,
    channels: BTreeMap<u16, Arc<RecordedChannel>>,
}

/// The messages of a recording, read chunk by chunk. Ends at the first fault; [`Messages::cut`] tells whether there was one.
pub struct Messages {
    path: PathBuf,
    file: File,
    file_length: u64,
    /// Whether the file ends as MCAP files do: then a missing piece is damage, not a cut.
    has_end: bool,
    reader: LinearReader,
    /// Where the next record begins.
    offset: u64,
    catalogue: Catalogue,
    queue: VecDeque<RecordedMessage>,
    taken: u64,
    last_time_ns: Option<u64>,
    footer_seen: bool,
    ended: bool,
    fault: Option<(bool, String)>,
    start: Start,
}

impl Messages {
    /// Opens a recording and checks that it is one.
    ///
    /// # Errors
    /// If the file cannot be read, is no MCAP, is one of others, or holds not even its first message.
    pub fn open(path: &Path) -> Result<Messages, ReadError> {
        let input = |source| ReadError::Input { path: path.to_owned(), source };
        let mut file = crate::files::open(path, u64::MAX).map_err(input)?;
        let file_length = file.metadata().map_err(input)?.len();
        let mut head = Vec::new();
        (&mut file).take(MAGIC.len() as u64).read_to_end(&mut head).map_err(input)?;
        if head.is_empty() {
            return Err(ReadError::Empty { path: path.to_owned() });
        }
        if !MAGIC.starts_with(&head) {
            return Err(ReadError::NotMcap { path: path.to_owned(), found: head.escape_ascii().to_string() });
        }
        let mut tail = Vec::new();
        if file_length >= 2 * MAGIC.len() as u64 {
            file.seek(SeekFrom::End(-(MAGIC.len() as i64))).map_err(input)?;
            (&mut file).take(MAGIC.len() as u64).read_to_end(&mut tail).map_err(input)?;
        }
        file.seek(SeekFrom::Start(0)).map_err(input)?;
        let options = LinearReaderOptions::default()
            .with_emit_chunks(true)
            .with_check_finishes_after_end_magic(true)
            .with_validate_data_section_crc(true)
            .with_validate_summary_section_crc(true)
            .with_record_length_limit(RECORD_LIMIT);
        let mut messages = Messages {
            path: path.to_owned(),
            file,
            file_length,
            has_end: tail == MAGIC,
            reader: LinearReader::new_with_options(options),
            offset: MAGIC.len() as u64,
            catalogue: Catalogue::default(),
            queue: VecDeque::new(),
            taken: 0,
            last_time_ns: None,
            footer_seen: false,
            ended: false,
            fault: None,
            start: Start { version: String::new(), command: String::new(), scene: String::new(), poses: None, real: None },
        };
        messages.fill()?;
        match messages.queue.front() {
            Some(first) if first.topic() == Some(Topic::Run) => {
                messages.start = parse(&first.data).map_err(|reason| messages.content_error(first, reason))?;
                Ok(messages)
            }
            None => match messages.cut() {
                Some(cut) => Err(ReadError::Nothing(cut)),
                None => Err(messages.foreign()),
            },
            Some(_) => {
                while !messages.ended && messages.offset < FOREIGN_BYTES {
                    messages.read_record()?;
                    messages.queue.clear();
                }
                Err(messages.foreign())
            }
        }
    }

    /// What the run was.
    #[must_use]
    pub fn start(&self) -> &Start {
        &self.start
    }

    /// Where and why reading has ended, once it has ended otherwise than at the regular end of the file.
    #[must_use]
    pub fn cut(&self) -> Option<Cut> {
        let (damaged, reason) = self.fault.clone()?;
        Some(Cut {
            path: self.path.clone(),
            damaged,
            offset: self.offset.min(self.file_length),
            file_length: self.file_length,
            reason,
            messages: self.taken,
            last_time_ns: self.last_time_ns,
        })
    }

    /// Bytes of the file that have been read and understood so far.
    #[must_use]
    pub fn offset(&self) -> u64 {
        self.offset
    }

    fn foreign(&self) -> ReadError {
        let topics: BTreeSet<&Arc<RecordedChannel>> = self.catalogue.channels.values().collect();
        let mut names: Vec<String> = topics
            .iter()
            .take(10)
            .map(|channel| match channel.schema.as_str() {
                "" => channel.topic.clone(),
                schema => format!("{} ({schema})", channel.topic),
            })
            .collect();
        if topics.len() > names.len() {
            names.push(format!("and {} more", topics.len() - names.len()));
        }
        if names.is_empty() {
            names.push("none".to_owned());
        }
        ReadError::Foreign { path: self.path.clone(), topics: names.join(", ") }
    }

    fn content_error(&self, message: &RecordedMessage, reason: String) -> ReadError {
        ReadError::Content {
            path: self.path.clone(),
            number: message.number,
            topic: message.channel.topic.clone(),
            reason,
            recorded_by: if self.start.version.is_empty() { "?".to_owned() } else { self.start.version.clone() },
        }
    }

    /// Reads records until there is a message or the end.
    fn fill(&mut self) -> Result<(), ReadError> {
        while self.queue.is_empty() && !self.ended {
            self.read_record()?;
        }
        Ok(())
    }

    fn read_record(&mut self) -> Result<(), ReadError> {
        loop {
            let fault = match self.reader.next_event() {
                None => {
                    self.ended = true;
                    // Cannot happen as the end magic is asked for, but a file without a footer must never count as whole.
                    self.fault = (!self.footer_seen).then(|| (false, "its footer is missing".to_owned()));
                    return Ok(());
                }
                Some(Ok(LinearReadEvent::ReadRequest(wanted))) => {
                    let buffer = self.reader.insert(wanted.min(READ_BYTES));
                    let read = loop {
                        match self.file.read(buffer) {
                            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                            other => break other,
                        }
                    };
                    let read = read.map_err(|source| ReadError::Input { path: self.path.clone(), source })?;
                    self.reader.notify_read(read);
                    continue;
                }
                Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                    let length = 9 + data.len() as u64;
                    self.footer_seen |= opcode == op::FOOTER;
                    let mut found = Vec::new();
                    let outcome = match opcode {
                        op::CHUNK => unpack_chunk(data, &mut self.catalogue, &mut found),
                        // After the data section, channels and schemas are repeated; there are no messages.
                        opcode => take_record(opcode, data, &mut self.catalogue, &mut found),
                    };
                    match outcome {
                        Ok(()) => {
                            for mut message in found {
                                message.number = self.taken;
                                self.taken += 1;
                                self.last_time_ns = Some(message.log_time_ns);
                                self.queue.push_back(message);
                            }
                            self.offset += length;
                            return Ok(());
                        }
                        Err(error) => (true, format!("{}: {error}", kind(opcode))),
                    }
                }
                Some(Err(error)) => match error {
                    McapError::UnexpectedEof if !self.has_end => (false, "the file ends there".to_owned()),
                    McapError::RecordTooLarge { .. } if !self.has_end => (false, "what follows is no record".to_owned()),
                    McapError::UnexpectedEof => (true, "a record does not end where it should".to_owned()),
                    McapError::BadDataCrc { .. } => {
                        (true, "the checksum over all records fails though each chunk passes its own".to_owned())
                    }
                    error => (true, error.to_string()),
                },
            };
            self.ended = true;
            self.fault = Some(fault);
            return Ok(());
        }
    }
}

impl Iterator for Messages {
    type Item = Result<RecordedMessage, ReadError>;

    fn next(&mut self) -> Option<Self::Item> {
        if let Err(error) = self.fill() {
            self.ended = true;
            return Some(Err(error));
        }
        self.queue.pop_front().map(Ok)
    }
}

fn kind(opcode: u8) -> &'static str {
    match opcode {
        op::CHUNK => "chunk",
        op::SCHEMA => "schema",
        op::CHANNEL => "channel",
        op::MESSAGE => "message",
        _ => "record",
    }
}

/// Takes the records of a chunk, after its checksum has been checked.
fn unpack_chunk(chunk: &[u8], catalogue: &mut Catalogue, found: &mut Vec<RecordedMessage>) -> Result<(), McapError> {
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_skip_end_magic(true)
        .with_prevalidate_chunk_crcs(true)
        .with_record_length_limit(RECORD_LIMIT);
    let mut reader = LinearReader::new_with_options(options);
    let buffer = reader.insert(9 + chunk.len());
    buffer[0] = op::CHUNK;
    buffer[1..9].copy_from_slice(&(chunk.len() as u64).to_le_bytes());
    buffer[9..].copy_from_slice(chunk);
    reader.notify_read(9 + chunk.len());
    while let Some(event) = reader.next_event() {
        match event? {
            LinearReadEvent::ReadRequest(_) => {
                let _ = reader.insert(1);
                reader.notify_read(0);
            }
            LinearReadEvent::Record { opcode, data } => take_record(opcode, data, catalogue, found)?,
        }
    }
    Ok(())
}

fn take_record(opcode: u8, data: &[u8], catalogue: &mut Catalogue, found: &mut Vec<RecordedMessage>) -> Result<(), McapError> {
    // Other records are not parsed: nothing in them is needed.
    if !matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE) {
        return Ok(());
    }
    match mcap::parse_record(opcode, data)? {
        Record::Schema { header, .. } => {
            catalogue.schemas.insert(header.id, header.name);
        }
        Record::Channel(channel) => {
            let schema = catalogue.schemas.get(&channel.schema_id).cloned().unwrap_or_default();
            catalogue.channels.insert(channel.id, Arc::new(RecordedChannel { topic: channel.topic, schema }));
        }
        Record::Message { header, data } => {
            let channel = catalogue.channels.get(&header.channel_id);
            let channel = channel.ok_or(McapError::UnknownChannel(header.sequence, header.channel_id))?;
            found.push(RecordedMessage {
                number: 0,
                channel: Arc::clone(channel),
                event: header.sequence,
                log_time_ns: header.log_time,
                data: data.into_owned(),
            });
        }
        _ => {}
    }
    Ok(())
}

/// Reads all events of a recording. One that was cut off or damaged is read up to there: see [`Recording::cut`].
///
/// # Errors
/// As [`Messages::open`], and if a message cannot be understood.
pub fn read(path: &Path) -> Result<Recording, ReadError> {
    let mut messages = Messages::open(path)?;
    let start = messages.start().clone();
    let mut events = Vec::new();
    // Number of the event that the last element of `events` is.
    let mut last = None;
    let mut message_count = 0;
    while let Some(message) = messages.next() {
        let message = message?;
        message_count += 1;
        let event = match message.topic() {
            Some(Topic::Run) => parse(&message.data).map(Event::Start),
            Some(Topic::Swarm) => parse(&message.data).map(Event::Swarm),
            Some(Topic::Search) => parse(&message.data).map(Event::Search),
            Some(Topic::Design) => parse(&message.data).map(Event::Designed),
            Some(Topic::Measurement) => parse(&message.data).map(Event::Measured),
            Some(Topic::Identification) => parse(&message.data).map(Event::Identified),
            Some(Topic::Diagnosis) => parse(&message.data).map(|diagnosis| Event::Diagnosed(Box::new(diagnosis))),
            Some(Topic::Log) => Log::decode(message.data.as_slice())
                .map(|log| match log.name.as_str() {
                    NOT_DIAGNOSED => Event::NotDiagnosed(log.message),
                    _ => Event::Note(log.message),
                })
                .map_err(|error| error.to_string()),
            Some(Topic::SwarmEndPoints) => match events.last_mut() {
                Some(Event::Swarm(swarm)) if last == Some(message.event) => {
                    let cloud = PointCloud::decode(message.data.as_slice()).map_err(|error| error.to_string());
                    let points = cloud.and_then(|cloud| cloud::unpack_end_points(&cloud, swarm.fitness.len()));
                    swarm.end_points = points.map_err(|reason| messages.content_error(&message, reason))?;
                    continue;
                }
                // The start tells the cloud's frame.
                Some(Event::Start(_)) if last == Some(message.event) => continue,
                _ => Err("it does not follow its iteration".to_owned()),
            },
            // Derived from the events above, or of a version to come.
            _ => continue,
        };
        match event {
            Ok(event) => events.push(event),
            Err(reason) => {
                let error = messages.content_error(&message, reason);
                // What cannot be understood because a piece before it is damaged ends there.
                messages.by_ref().for_each(drop);
                if messages.cut().is_none() {
                    return Err(error);
                }
                break;
            }
        }
        last = Some(message.event);
    }
    let version_warning = version_warning(path, &start.version);
    Ok(Recording { start, events, message_count, cut: messages.cut(), version_warning })
}

fn parse<T: Source>(data: &[u8]) -> Result<T, String> {
    T::from_json(data).map_err(|error| error.to_string())
}

fn version_warning(path: &Path, recorded: &str) -> Option<String> {
    let this = env!("CARGO_PKG_VERSION");
    (version_numbers(recorded) > version_numbers(this))
        .then(|| format!("{} was recorded by kincal {recorded}, this is {this}: what is new in it is not seen", path.display()))
}

/// Major, minor and patch of a version.
pub(super) fn version_numbers(version: &str) -> Vec<u64> {
    version.split(['.', '-', '+']).take(3).map(|part| part.parse().unwrap_or(0)).collect()
}
