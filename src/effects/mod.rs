//! The vocabulary of un-modelled effects: what kinds there are, where they sit, how large they realistically are
//! ([`Kind::descriptor`]), and what each does to a pose ([`signature`]). Shared by the simulated cell, which makes them happen in the
//! physics, and by the diagnosis, which looks for their signatures; neither knows how the other does it.
//!
//! # Adding a kind
//!
//! Five files, two of them new; the guide goes through them ([Add an effect](crate::guide::add_effect)). No `match` on a kind, an effect or a shape has
//! a default, so that the compiler names every place from the variant of [`Kind`] on:
//!
//! 1. `effects/kind.rs`: a variant of [`Kind`], its place in [`Kind::ALL`], its row of the table, its shapes in
//!    [`Shape`](signature::shape::Shape).
//! 2. `effects/kind/<kind>.rs`: its shapes and its hypotheses, derived by hand.
//! 3. `simulation/effect/mod.rs`: a variant of [`Effect`](crate::simulation::effect::Effect), from the values of a scene and from a draw,
//!    what it is in numbers, and the call of its mechanism.
//! 4. `simulation/effect/<kind>.rs`: what makes it happen in the multibody, never by its formula.
//! 5. `lab/effect_validation.rs`: the same by statics, a third derivation, and a case; a test holds both together to 2 % or 1 µm.
//!
//! Keys that no other kind has are fields of `scene/file.rs` and of [`Values`], read in `scene/effect_file.rs`. A kind that the diagnosis
//! is not to know (`known: None`) has no file in `effects/kind`.

pub mod catalogue;
pub mod descriptor;
pub mod kind;
pub mod location;
pub mod parameters;
pub mod signature;
pub mod values;

pub use catalogue::catalogue_markdown;
pub use descriptor::{
    Advice, Descriptor, Known, Load, Measure, Misses, Need, Neighbour, Range, SceneKeys, ScenePlace, Source, Unit,
};
pub use kind::Kind;
pub use location::{Level, Location};
pub use parameters::Parameters;
pub use values::{Foot, Moves, Values};
