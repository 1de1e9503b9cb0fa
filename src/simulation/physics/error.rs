//! Why an arm cannot be simulated.

use thiserror::Error;

/// Why [`super::PhysicalArm::new`] refused.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PhysicsError {
    /// A moving link has no mass distribution.
    #[error("link `{link}` has no inertial: physics needs the mass, centre of mass and inertia of every moving link")]
    MissingInertial {
        /// Its name.
        link: String,
    },
    /// A mass, centre of mass or inertia that no body has.
    #[error("the inertial of link `{link}` is not one of a body: {what}")]
    BadInertial {
        /// Its name.
        link: String,
        /// What is wrong with it.
        what: String,
    },
    /// Two lists that belong together differ in length.
    #[error("{got} {what}, expected {expected}")]
    Count {
        /// What was counted.
        what: &'static str,
        /// How many there are.
        got: usize,
        /// How many there should be.
        expected: usize,
    },
    /// A clearance that is negative, not finite, or so large that first-order play no longer describes it.
    #[error("{what} clearance of joint number {} is {got}, allowed is 0 to {largest} ({unit})", .joint + 1)]
    BadClearance {
        /// Index of the joint, from 0.
        joint: usize,
        /// Radial, axial or tilt.
        what: &'static str,
        /// The value.
        got: f64,
        /// The largest that is allowed.
        largest: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// An effect at a joint or link that the arm does not have.
    #[error("{effect} is at {what} number {number}, but the arm has {count} joints")]
    NoSuchPlace {
        /// The effect's name.
        effect: &'static str,
        /// Joint, link or source.
        what: &'static str,
        /// From 1.
        number: usize,
        /// How many joints there are.
        count: usize,
    },
    /// An effect of turning joints at one that slides.
    #[error("{effect} is at joint number {}, which slides: this happens to joints that turn", .joint + 1)]
    Slides {
        /// The effect's name.
        effect: &'static str,
        /// Index of the joint, from 0.
        joint: usize,
    },
    /// A magnitude that no arm has.
    #[error("the {what} of {effect} at {place} is {got}, expected {expected}")]
    BadEffect {
        /// The effect's name.
        effect: &'static str,
        /// Where it is.
        place: String,
        /// Which of its numbers.
        what: &'static str,
        /// The value.
        got: f64,
        /// What is allowed.
        expected: &'static str,
    },
    /// A number that is not finite.
    #[error("{what} is {got}, expected a finite number")]
    NotFinite {
        /// Where it stands.
        what: String,
        /// The value.
        got: f64,
    },
    /// A setting outside its range.
    #[error("settling.{what} is {got}, expected {expected}")]
    BadSetting {
        /// Name of the setting.
        what: &'static str,
        /// The value.
        got: f64,
        /// What is allowed.
        expected: &'static str,
    },
}
