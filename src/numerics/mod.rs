//! Numbers that are the same bit for bit on every machine: what is recorded is computed again elsewhere and compared.
//!
//! The products of two large dynamic matrices that nalgebra makes go through kernels that depend on the processor (those with a vector,
//! `tr_mul` and its decompositions do not), and the quantiles of statrs
//! through iterations whose last digits depend on the platform. Whatever ends in a recording uses these instead: [`dense`] on slices,
//! [`matrix`] on nalgebra's matrices, [`distribution`] for quantiles and tails.

pub mod dense;
pub mod distribution;
pub mod matrix;

pub use matrix::{gram, product, scaled_inverse, transposed_product};
