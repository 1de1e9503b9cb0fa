//! Recordings: every run as a stream of events, written to MCAP, read back, and compared bit for bit.
//!
//! Each event becomes one source message, from which it is restored, and messages derived from it for viewers (Foxglove's
//! protobuf schemas). All messages of an event carry its number as their MCAP sequence number and stand in one chunk.

pub mod compare;
pub mod encode;
pub mod read;
pub mod ros;
pub mod schema;
pub mod tables;
pub mod topic;
#[cfg(feature = "simulator")]
pub mod truth_file;
pub mod write;

mod cloud;
mod json;
mod skeleton;
#[cfg(test)]
mod tests;

pub use compare::{Comparer, Comparison, Difference};
pub use read::{Cut, Messages, ReadError, Recording, read};
pub use write::{RecordError, Recorder};
