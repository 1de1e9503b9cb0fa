//! The vocabulary of un-modelled effects: what kinds there are, where they sit, how large they realistically are
//! ([`Kind::descriptor`]), and what each does to a pose ([`signature`]). Shared by the simulated cell, which makes them happen in the
//! physics, and by the diagnosis, which looks for their signatures; neither knows how the other does it.

pub mod catalogue;
pub mod descriptor;
pub mod kind;
pub mod location;
pub mod signature;

pub use catalogue::catalogue_markdown;
pub use descriptor::{Descriptor, Load, Need, Neighbour, Range, SceneKeys, ScenePlace, Source, Unit};
pub use kind::Kind;
pub use location::{Level, Location};
