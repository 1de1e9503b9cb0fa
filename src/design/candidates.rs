//! Configurations that may be measured: within the joint limits and free of collisions.

use crate::arm::Arm;
use crate::seed::Stream;
use crate::self_collision::{CollisionCheck, Contact, Scratch};

/// Draws after which a cell counts as one in which the arm cannot move.
const DRAWS: usize = 20_000;

/// Draws configurations uniformly within the limits, refusing those that collide.
pub struct Sampler<'a> {
    arm: &'a Arm,
    check: &'a CollisionCheck,
    scratch: Scratch,
    /// Configurations refused so far.
    pub rejections: u64,
}

/// No configuration free of collisions was found.
#[derive(Debug, thiserror::Error)]
#[error(
    "none of {draws} random configurations is free of collisions; most often {} touches {} ({share:.0} % of the draws). \
     Check link shapes and fixtures, list the pair under `uncollidable` or the link under the fixture's `may_touch` if they are \
     meant to touch, or widen the joint limits",
    .contact.first, .contact.second
)]
pub struct AlwaysColliding {
    draws: usize,
    contact: Contact,
    share: f64,
}

impl<'a> Sampler<'a> {
    /// A sampler for `arm`, whose collisions `check` tells.
    #[must_use]
    pub fn new(arm: &'a Arm, check: &'a CollisionCheck) -> Self {
        Sampler { arm, check, scratch: Scratch::default(), rejections: 0 }
    }

    /// Appends one configuration (rad or m) to `out`.
    ///
    /// # Errors
    /// If every draw collides.
    pub fn draw_into(&mut self, stream: &mut Stream, out: &mut Vec<f64>) -> Result<(), AlwaysColliding> {
        let start = out.len();
        for _ in 0..DRAWS {
            out.truncate(start);
            out.extend(self.arm.chain.joints.iter().map(|joint| stream.uniform(joint.lower, joint.upper)));
            if !self.check.collides(&out[start..], &mut self.scratch) {
                return Ok(());
            }
            self.rejections += 1;
        }
        out.truncate(start);
        Err(self.explain(stream))
    }

    /// `count` configurations, one after the other.
    ///
    /// # Errors
    /// If every draw collides.
    pub fn draw(&mut self, stream: &mut Stream, count: usize) -> Result<Vec<f64>, AlwaysColliding> {
        let mut configurations = Vec::with_capacity(count * self.arm.joint_count());
        for _ in 0..count {
            self.draw_into(stream, &mut configurations)?;
        }
        Ok(configurations)
    }

    fn explain(&self, stream: &mut Stream) -> AlwaysColliding {
        let mut contacts: Vec<(Contact, usize)> = Vec::new();
        let samples = 1000;
        for _ in 0..samples {
            let joints: Vec<f64> = self.arm.chain.joints.iter().map(|joint| stream.uniform(joint.lower, joint.upper)).collect();
            if let Some(contact) = self.check.contact(&joints) {
                match contacts.iter_mut().find(|(known, _)| *known == contact) {
                    Some((_, count)) => *count += 1,
                    None => contacts.push((contact, 1)),
                }
            }
        }
        let (contact, count) = contacts
            .into_iter()
            .max_by_key(|(_, count)| *count)
            .unwrap_or((Contact { first: "a link".into(), second: "another".into() }, 0));
        AlwaysColliding { draws: DRAWS, contact, share: 100.0 * count as f64 / f64::from(samples) }
    }
}
