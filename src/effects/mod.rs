//! The vocabulary of un-modelled effects: what kinds there are, where they sit, how large they realistically are
//! ([`Kind::descriptor`]), and what each does to a pose ([`signature`]). Shared by the simulated cell, which makes them happen in the
//! physics, and by the diagnosis, which looks for their signatures; neither knows how the other does it.
//!
//! # Adding a kind
//!
//! 1. `effects/kind.rs`: a variant of [`Kind`], its place in [`Kind::ALL`], and its row of the table. The compiler asks for the row; a
//!    test misses what is not in `ALL`. `kincal effects`, the guide, options, scene keys and the ranges of draws and priors read the row.
//!    From here on the compiler names every other place, because no `match` on a kind, an effect or a shape has a default:
//! 2. `effects/signature/<kind>.rs`: its columns and hypotheses, derived by hand. A shape that no other kind has is a variant of
//!    [`signature::shape::Shape`], whose questions (how many columns, what the data must have, what is undecided) it must answer, and
//!    which `diagnosis/parameters.rs` may give names for results. `effects/signature/library.rs` calls the hypotheses.
//! 3. `simulation/effect.rs`: a variant of [`Effect`](crate::simulation::effect::Effect), from the values of a scene and from a draw, and
//!    what of it the truth file tells (`simulation/cell/truth.rs`).
//! 4. `simulation/physics/mechanism/<kind>.rs`: what makes it happen in the multibody, never by its formula.
//! 5. `lab/effect_validation.rs`: the same by statics, a third derivation, and a case; a test holds both together to 2 % or 1 µm.
//!    `lab/confirm.rs` says which effect of the simulation a diagnosed shape is, and its test goes through every variant of every kind.
//!
//! Keys that no other kind has are fields of `scene/file.rs`, read in `scene/effect_file.rs`. A kind that the diagnosis is not to know
//! (`known: false`) needs no signature.

pub mod catalogue;
pub mod descriptor;
pub mod kind;
pub mod location;
pub mod signature;

pub use catalogue::catalogue_markdown;
pub use descriptor::{Descriptor, Load, Need, Neighbour, Range, SceneKeys, ScenePlace, Source, Unit};
pub use kind::Kind;
pub use location::{Level, Location};
