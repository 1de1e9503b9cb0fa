//! Recordings: every run as a stream of events, written to MCAP, read back, and compared bit for bit.

pub mod event;
pub mod truth_file;
