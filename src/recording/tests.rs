//! Tests of the recording as a whole.
