//! Results that are tables rather than events in time, such as those of a sweep, as MCAP: one topic per table, one JSON message per row.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

use foxglove::messages::{Log, Timestamp, log};
use mcap::records::MessageHeader;
use mcap::{McapError, WriteOptions};
use prost::Message as _;
use schemars::{JsonSchema, Schema};
use serde::Serialize;
use serde_json::Value;

use super::json::without_null;
use super::schema::recorded;
use super::topic::Topic;

/// A table.
#[derive(Clone, Debug)]
pub struct Table {
    topic: &'static str,
    schema: Schema,
    rows: Vec<Vec<u8>>,
}

impl Table {
    /// A table on `topic` (`/sweep/cell`) whose schema is called `schema` (`kincal.SweepCell`); what is null in a row is not written.
    ///
    /// # Errors
    /// If JSON cannot hold a row.
    pub fn new<T: Serialize + JsonSchema>(topic: &'static str, schema: &str, rows: &[T]) -> serde_json::Result<Table> {
        let rows = rows.iter().map(without_null).collect::<Result<_, _>>()?;
        Ok(Table { topic, schema: recorded::<T>(schema), rows })
    }
}

/// Tables could not be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {}: {source}; choose another folder with --out", path.display())]
pub struct TablesError {
    /// The file.
    pub path: PathBuf,
    /// Why it failed.
    pub source: McapError,
}

/// Writes `tables` to `path`, and `text` as a note; rows stand at whole seconds from zero. The same tables give the same bytes.
///
/// # Errors
/// If the file cannot be written; no half of it is left.
pub fn write(path: &Path, tables: &[Table], text: &str) -> Result<(), TablesError> {
    let partial = path.with_extension("partial.mcap");
    let written = write_to(&partial, tables, text).and_then(|()| Ok(fs::rename(&partial, path)?));
    written.map_err(|source| {
        // The error that is told is the first one.
        let _ = fs::remove_file(&partial);
        TablesError { path: path.to_owned(), source }
    })
}

fn write_to(path: &Path, tables: &[Table], text: &str) -> Result<(), McapError> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)?;
    }
    let mut writer = WriteOptions::new()
        .profile("")
        .library(concat!("kincal ", env!("CARGO_PKG_VERSION")))
        .compression(Some(mcap::Compression::Zstd))
        .compression_threads(0)
        .create(BufWriter::new(File::create(path)?))?;
    let at = |sequence: usize, channel_id| {
        let log_time = sequence as u64 * 1_000_000_000;
        let sequence = u32::try_from(sequence).unwrap_or(u32::MAX);
        MessageHeader { channel_id, sequence, log_time, publish_time: log_time }
    };
    for table in tables {
        let name = table.schema.get("title").and_then(Value::as_str).unwrap_or_default();
        let schema = writer.add_schema(name, "jsonschema", table.schema.as_value().to_string().as_bytes())?;
        let channel = writer.add_channel(schema, table.topic, "json", &BTreeMap::new())?;
        for (sequence, row) in table.rows.iter().enumerate() {
            writer.write_to_known_channel(&at(sequence, channel), row)?;
        }
    }
    let schema = Topic::Log.schema();
    let schema = writer.add_schema(&schema.name, &schema.encoding, &schema.data)?;
    let channel = writer.add_channel(schema, Topic::Log.name(), Topic::Log.message_encoding(), &BTreeMap::new())?;
    let note = Log {
        timestamp: Some(Timestamp::new(0, 0)),
        level: log::Level::Info as i32,
        message: text.to_owned(),
        name: "kincal".to_owned(),
        ..Log::default()
    };
    writer.write_to_known_channel(&at(0, channel), &note.encode_to_vec())?;
    writer.finish()?;
    let file = writer.into_inner().into_inner().map_err(io::IntoInnerError::into_error)?;
    file.sync_all()?;
    Ok(())
}
