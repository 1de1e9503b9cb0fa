//! Replay: recomputed events against a recording, bit for bit.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use foxglove::messages::PointCloud;
use prost::Message as _;
use serde_json::Value;

use super::cloud;
use super::encode::{Encoder, Message};
use super::read::{Cut, Messages, ReadError, RecordedMessage};
use super::topic::Topic;
use crate::arm::Arm;
use crate::event::{Event, Start};
use crate::progress::{Progress, Stopped};

/// Takes the events of a repeated run and compares their messages with the recorded ones, in order. The recording is read
/// alongside, one chunk at a time.
pub struct Comparer {
    recorded: Messages,
    encoder: Encoder,
    /// Messages so far by topic, to number them in a report.
    counts: BTreeMap<String, u64>,
    compared: u64,
    extra: u64,
    differing: u64,
    first_difference: Option<Difference>,
    /// Messages that this version makes otherwise than the one that recorded.
    other_version: u64,
}

/// Topics whose content comes of methods that change from version to version, and the first version that makes them as this one does.
/// Everything else has been the same bits since 0.1.0, but for readings of links that bend: since 0.4.0 a bend about two axes twists no link,
/// and only the truth tells which links bend.
const MADE_SINCE: [(Topic, [u64; 3]); 4] = [
    (Topic::Identification, [0, 2, 0]),
    (Topic::ResidualsAfter, [0, 2, 0]),
    (Topic::PosesPredicted, [0, 2, 0]),
    (Topic::Diagnosis, [0, 5, 0]),
];

/// Whether `version` makes `topic` by another method than this one.
fn is_made_otherwise(topic: Topic, version: &str) -> bool {
    let recorded = super::read::version_numbers(version);
    MADE_SINCE.iter().any(|(of, since)| *of == topic && recorded.as_slice() < since.as_slice())
}

/// What a comparison came to.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Messages that stand in both and were compared.
    pub compared: u64,
    /// Those of them that differ.
    pub differing: u64,
    /// Recorded messages that the repeated run has not made.
    pub missing: u64,
    /// Messages of the repeated run that were not recorded.
    pub extra: u64,
    /// Messages that could not be compared, because the version that recorded makes them by another method.
    pub other_version: u64,
    /// The first message that differs, is missing or is extra.
    pub first_difference: Option<Difference>,
    /// Where the recording breaks off. What would have come after it counts as extra, but not as a difference.
    pub cut: Option<Cut>,
}

impl Comparison {
    /// Whether the repeated run made every recorded message with the same bytes at the same simulated time, and no others.
    #[must_use]
    pub fn identical(&self) -> bool {
        self.first_difference.is_none()
    }
}

/// Where two runs part.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Number of the message in the recording, from 0.
    pub message: u64,
    /// Topic of the recorded message; of the recomputed one where none was recorded.
    pub topic: String,
    /// Its number within the topic, from 0.
    pub number_in_topic: u64,
    /// Simulated time, ns.
    pub log_time_ns: u64,
    /// What differs: `best.o1`, `points[3].x`, `byte 17`, `topic`, `time`.
    pub field: String,
    /// As recorded.
    pub recorded: String,
    /// As recomputed.
    pub recomputed: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Difference { topic, number_in_topic, field, recorded, recomputed, log_time_ns, message } = self;
        let time = *log_time_ns as f64 * 1e-9;
        write!(f, "{topic}[{number_in_topic}].{field}: recorded {recorded}, recomputed {recomputed} ")?;
        write!(f, "(message {message}, {time:.3} s)")
    }
}

impl Comparer {
    /// Opens the recording to compare with. `arm` is the nominal arm of its scene.
    ///
    /// # Errors
    /// As [`Messages::open`].
    pub fn open(path: &Path, arm: &Arm) -> Result<Comparer, ReadError> {
        Ok(Comparer {
            recorded: Messages::open(path)?,
            encoder: Encoder::new(arm),
            counts: BTreeMap::new(),
            compared: 0,
            extra: 0,
            differing: 0,
            first_difference: None,
            other_version: 0,
        })
    }

    /// What the recorded run was.
    #[must_use]
    pub fn start(&self) -> &Start {
        self.recorded.start()
    }

    /// Whether the repeated run has gone on where the recording is cut off: nothing that follows can be compared.
    #[must_use]
    pub fn is_past_cut(&self) -> bool {
        self.extra > 0 && self.recorded.cut().is_some()
    }

    /// Ends the comparison: what is left in the recording is missing in the repeated run.
    ///
    /// # Errors
    /// If the rest of the recording cannot be read.
    pub fn finish(mut self) -> Result<Comparison, ReadError> {
        let mut missing = 0;
        while let Some(recorded) = self.recorded.next() {
            let recorded = recorded?;
            missing += 1;
            let count = self.count(&recorded.channel.topic, recorded.event);
            self.first_difference.get_or_insert_with(|| Difference {
                message: recorded.number,
                topic: recorded.channel.topic.clone(),
                number_in_topic: count,
                log_time_ns: recorded.log_time_ns,
                field: "message".to_owned(),
                recorded: format!("{} bytes", recorded.data.len()),
                recomputed: "nothing".to_owned(),
            });
        }
        Ok(Comparison {
            compared: self.compared,
            differing: self.differing,
            missing,
            extra: self.extra,
            other_version: self.other_version,
            first_difference: self.first_difference,
            cut: self.recorded.cut(),
        })
    }

    fn compare(&mut self, recomputed: &Message) -> Result<(), ReadError> {
        let Some(recorded) = self.recorded.next().transpose()? else {
            self.extra += 1;
            let count = self.count(recomputed.topic.name(), recomputed.event);
            if self.recorded.cut().is_none() {
                self.first_difference.get_or_insert_with(|| Difference {
                    message: self.compared,
                    topic: recomputed.topic.name().to_owned(),
                    number_in_topic: count,
                    log_time_ns: recomputed.log_time_ns,
                    field: "message".to_owned(),
                    recorded: "nothing".to_owned(),
                    recomputed: format!("{} bytes", recomputed.data.len()),
                });
            }
            return Ok(());
        };
        let count = self.count(&recorded.channel.topic, recorded.event);
        if recorded.topic() == Some(recomputed.topic) && is_made_otherwise(recomputed.topic, &self.recorded.start().version) {
            self.other_version += 1;
            return Ok(());
        }
        self.compared += 1;
        if let Some((field, was, is)) = difference(&recorded, recomputed) {
            self.differing += 1;
            self.first_difference.get_or_insert_with(|| Difference {
                message: recorded.number,
                topic: recorded.channel.topic.clone(),
                number_in_topic: count,
                log_time_ns: recorded.log_time_ns,
                field,
                recorded: was,
                recomputed: is,
            });
        }
        Ok(())
    }

    /// The message's number within its topic; the empty clouds of the start do not count, so that a cloud has the number of
    /// its iteration.
    fn count(&mut self, topic: &str, event: u32) -> u64 {
        let count = self.counts.entry(topic.to_owned()).or_default();
        let number = *count;
        *count += u64::from(event > 0);
        number
    }
}

impl Progress<&Event> for Comparer {
    fn report(&mut self, event: &Event) -> Result<(), Stopped> {
        let messages = self.encoder.encode(event).map_err(|error| Stopped(error.to_string()))?;
        messages.iter().try_for_each(|message| self.compare(message)).map_err(|error| Stopped(error.to_string()))
    }
}

/// Field, recorded and recomputed value of the first difference.
fn difference(recorded: &RecordedMessage, recomputed: &Message) -> Option<(String, String, String)> {
    let topic = recomputed.topic;
    if recorded.topic() != Some(topic) {
        let was = format!("{} ({})", recorded.channel.topic, recorded.channel.schema);
        return Some(("topic".to_owned(), was, format!("{} ({})", topic.name(), topic.schema_name())));
    }
    if recorded.event != recomputed.event {
        return Some(("sequence number".to_owned(), recorded.event.to_string(), recomputed.event.to_string()));
    }
    if recorded.data != recomputed.data {
        let named = match (topic.message_encoding(), topic.schema_name()) {
            ("json", _) => json_difference(&recorded.data, &recomputed.data),
            (_, "foxglove.PointCloud") => cloud_difference(&recorded.data, &recomputed.data),
            _ => None,
        };
        return Some(named.unwrap_or_else(|| byte_difference(topic, &recorded.data, &recomputed.data)));
    }
    (recorded.log_time_ns != recomputed.log_time_ns)
        .then(|| ("time".to_owned(), format!("{} ns", recorded.log_time_ns), format!("{} ns", recomputed.log_time_ns)))
}

fn cloud_difference(recorded: &[u8], recomputed: &[u8]) -> Option<(String, String, String)> {
    cloud::difference(&PointCloud::decode(recorded).ok()?, &PointCloud::decode(recomputed).ok()?)
}

fn byte_difference(topic: Topic, recorded: &[u8], recomputed: &[u8]) -> (String, String, String) {
    let same = recorded.iter().zip(recomputed).take_while(|(left, right)| left == right).count();
    let show = |data: &[u8]| match data.get(same) {
        Some(byte) => format!("{byte:#04x} (of {} bytes)", data.len()),
        None => format!("nothing (of {} bytes)", data.len()),
    };
    (format!("byte {same} of its {}", topic.schema_name()), show(recorded), show(recomputed))
}

fn json_difference(recorded: &[u8], recomputed: &[u8]) -> Option<(String, String, String)> {
    let (recorded, recomputed) = (serde_json::from_slice(recorded).ok()?, serde_json::from_slice(recomputed).ok()?);
    let (path, recorded, recomputed) = value_difference(String::new(), &recorded, &recomputed)?;
    Some((path.trim_start_matches('.').to_owned(), recorded, recomputed))
}

fn value_difference(path: String, recorded: &Value, recomputed: &Value) -> Option<(String, String, String)> {
    match (recorded, recomputed) {
        (Value::Object(left), Value::Object(right)) => {
            let absent = &Value::Null;
            let keys = left.keys().chain(right.keys().filter(|key| !left.contains_key(*key)));
            keys.into_iter().find_map(|key| {
                let (left, right) = (left.get(key).unwrap_or(absent), right.get(key).unwrap_or(absent));
                value_difference(format!("{path}.{key}"), left, right)
            })
        }
        (Value::Array(left), Value::Array(right)) => {
            let mut pairs = left.iter().zip(right).enumerate();
            pairs.find_map(|(index, (left, right))| value_difference(format!("{path}[{index}]"), left, right)).or_else(|| {
                let lengths = (left.len().to_string(), right.len().to_string());
                (left.len() != right.len()).then(|| (format!("{path}, number of entries"), lengths.0, lengths.1))
            })
        }
        // As text: 0.0 and -0.0 are equal as values but not as bits.
        (left, right) => {
            let (left, right) = (left.to_string(), right.to_string());
            (left != right).then_some((path, shorten(left), shorten(right)))
        }
    }
}

fn shorten(text: String) -> String {
    const LONGEST: usize = 80;
    match text.char_indices().nth(LONGEST) {
        Some((at, _)) => format!("{}…", &text[..at]),
        None => text,
    }
}
