//! The simulated cell: what is hidden of a scene ([`effect`], [`injected`]) becomes a true arm in the [`physics`], which a [`cell`]
//! measures as [`plan`]ned.
//!
//! Nothing that analyses measurements imports this: it sees what a real cell would give.

#[cfg(feature = "simulator")]
pub mod cell;
pub mod effect;
pub mod injected;
#[cfg(feature = "simulator")]
pub mod physics;
pub mod plan;
