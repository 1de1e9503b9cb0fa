//! Configurations that may be measured: within the joint limits, free of collisions, and where the sensor sees them.

use crate::arm::Arm;
use crate::arm::ChainAt;
use crate::arm::self_collision::{self, CollisionCheck, Contact};
use crate::measurement::Sensor;
use crate::seed::Stream;

/// Draws after which a cell counts as one in which the arm cannot move.
const DRAWS: usize = 20_000;

/// What every configuration must keep to, by whatever method it is chosen.
pub struct Rules<'a> {
    arm: &'a Arm,
    check: CollisionCheck,
    chain: ChainAt,
    sensor: Option<&'a Sensor>,
}

/// Memory for the checks of one thread.
pub type RulesScratch = self_collision::Scratch;

impl<'a> Rules<'a> {
    /// Rules for what `sensor` is to measure.
    #[must_use]
    pub fn measurable(arm: &'a Arm, sensor: &'a Sensor) -> Self {
        Rules { sensor: Some(sensor), ..Rules::reachable(arm) }
    }

    /// Rules for where the arm may go, whether or not a sensor sees it there: its workspace.
    #[must_use]
    pub fn reachable(arm: &'a Arm) -> Self {
        Rules { arm, check: CollisionCheck::new(arm), chain: arm.chain.at_nominal(), sensor: None }
    }

    /// The arm.
    #[must_use]
    pub fn arm(&self) -> &'a Arm {
        self.arm
    }

    /// Whether `joints` (rad or m, within the limits) must not be measured: it collides, or the sensor does not see its end point.
    #[must_use]
    pub fn refuses(&self, joints: &[f64], scratch: &mut RulesScratch) -> bool {
        self.hidden(joints) || self.check.collides(joints, scratch)
    }

    fn hidden(&self, joints: &[f64]) -> bool {
        // Forward kinematics only where there is something that the sensor may not see.
        let limited = self.sensor.filter(|sensor| sensor.view.is_some());
        limited.is_some_and(|sensor| !sensor.sees(&self.chain.forward(joints).translation.vector))
    }
}

/// Draws configurations uniformly within the limits, refusing those against the rules.
pub struct Sampler<'a> {
    rules: &'a Rules<'a>,
    scratch: RulesScratch,
    /// Configurations refused so far.
    pub rejections: u64,
}

/// No configuration that may be measured was found.
#[derive(Debug, thiserror::Error)]
pub enum NothingMeasurable {
    /// The arm touches something.
    #[error(
        "none of {draws} random configurations is free of collisions; most often {} touches {} ({share:.0} % of the draws). \
         Check link shapes and fixtures, list the pair under `uncollidable` or the link under the fixture's `may_touch` if they are \
         meant to touch, or widen the joint limits",
        .contact.first, .contact.second
    )]
    Colliding {
        /// Configurations drawn.
        draws: usize,
        /// The pair that touches most often.
        contact: Contact,
        /// How often, in percent.
        share: f64,
    },
    /// The sensor does not see the end point.
    #[error(
        "of {draws} random configurations none is both free of collisions and seen by the sensor: {share:.0} % of the draws have their \
         end point outside its view. Check sensor.view (towards_mm, half_angle_deg) and sensor.position_mm"
    )]
    Hidden {
        /// Configurations drawn.
        draws: usize,
        /// Share whose end point is not seen, in percent.
        share: f64,
    },
}

impl<'a> Sampler<'a> {
    /// A sampler that keeps to `rules`.
    #[must_use]
    pub fn new(rules: &'a Rules<'a>) -> Self {
        Sampler { rules, scratch: RulesScratch::default(), rejections: 0 }
    }

    /// Appends one configuration (rad or m) to `out`.
    ///
    /// # Errors
    /// If every draw is refused.
    pub fn draw_into(&mut self, stream: &mut Stream, out: &mut Vec<f64>) -> Result<(), NothingMeasurable> {
        let start = out.len();
        for _ in 0..DRAWS {
            out.truncate(start);
            out.extend(self.rules.arm.chain.joints.iter().map(|joint| stream.uniform(joint.lower, joint.upper)));
            if !self.rules.refuses(&out[start..], &mut self.scratch) {
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
    /// If every draw is refused.
    pub fn draw(&mut self, stream: &mut Stream, count: usize) -> Result<Vec<f64>, NothingMeasurable> {
        let mut configurations = Vec::with_capacity(count * self.rules.arm.joint_count());
        for _ in 0..count {
            self.draw_into(stream, &mut configurations)?;
        }
        Ok(configurations)
    }

    fn explain(&self, stream: &mut Stream) -> NothingMeasurable {
        let mut contacts: Vec<(Contact, usize)> = Vec::new();
        let (samples, mut hidden, mut colliding) = (1000, 0, 0);
        for _ in 0..samples {
            let joints: Vec<f64> =
                self.rules.arm.chain.joints.iter().map(|joint| stream.uniform(joint.lower, joint.upper)).collect();
            hidden += u32::from(self.rules.hidden(&joints));
            if let Some(contact) = self.rules.check.contact(&joints) {
                colliding += 1;
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
        let share = |count: f64| 100.0 * count / f64::from(samples);
        if hidden > colliding {
            return NothingMeasurable::Hidden { draws: DRAWS, share: share(f64::from(hidden)) };
        }
        NothingMeasurable::Colliding { draws: DRAWS, contact, share: share(count as f64) }
    }
}
