//! From the commanded coordinate to the shaft of a joint: encoder, gear, and their errors. Rigid; what yields is in the multibody.
//!
//! The servo turns the shaft until the encoder's reading is the commanded coordinate; the gear then puts its own error on the
//! output. Where several act on one joint, each takes the commanded coordinate: what they would do to each other is of second
//! order in their amplitudes.

use super::conditions::Conditions;

/// The drive train of one joint.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::simulation) struct Drive {
    pub(in crate::simulation) encoders: Vec<Encoder>,
    pub(in crate::simulation) wave_generators: Vec<WaveGenerator>,
    /// Of the joint's own angle, rad/rad.
    pub(in crate::simulation) ratio_error: f64,
    /// Joints whose motion leaks, and how much of it.
    pub(in crate::simulation) leaks: Vec<(usize, f64)>,
    pub(in crate::simulation) graduations: Vec<Graduation>,
    pub(in crate::simulation) fading: Vec<Fading>,
    pub(in crate::simulation) worn: Vec<WornSector>,
    pub(in crate::simulation) memories: Vec<Memory>,
    /// Drift of the zero with the temperature of the link that the joint moves, rad/K.
    pub(in crate::simulation) zero_drift: f64,
}

/// An encoder whose disc is badly fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::simulation) enum Encoder {
    /// The disc's centre is off the axis.
    OffAxis {
        /// Distance over the radius of the graduation.
        eccentricity: f64,
        /// Direction of the disc's centre seen from the axis at shaft angle zero, with the reading head at angle zero, rad.
        direction: f64,
    },
    /// The encoder's shaft meets the joint's at an angle, coupled by a Hooke joint: `tan reading = cos(bend) tan shaft`, angles
    /// counted from where the fork lies.
    Bent {
        /// `cos(bend)`.
        cosine: f64,
        /// Shaft angle at which the fork lies in the plane of both axes, rad.
        fork: f64,
    },
}

impl Encoder {
    /// The encoder that reads wrongly by `amplitude · cos(order · q + phase)`, to first order in the amplitude.
    pub(in crate::simulation) fn new(amplitude: f64, order: u8, phase: f64) -> Self {
        use std::f64::consts::{FRAC_PI_2, PI};
        let phase = if amplitude < 0.0 { phase + PI } else { phase };
        let amplitude = amplitude.abs();
        match order {
            1 => Encoder::OffAxis { eccentricity: amplitude, direction: phase - FRAC_PI_2 },
            // The first harmonic of a Hooke joint has the amplitude tan²(bend / 2).
            _ => Encoder::Bent { cosine: (1.0 - amplitude) / (1.0 + amplitude), fork: -(phase + FRAC_PI_2) / 2.0 },
        }
    }

    /// What the shaft has turned beyond the reading when the encoder reads `reading`, rad.
    pub(in crate::simulation) fn beyond(&self, reading: f64) -> f64 {
        match *self {
            Encoder::OffAxis { eccentricity, direction } => {
                // Seen from the disc's centre, the head has moved on by this, and so has the graduation under it.
                let head = |shaft: f64| {
                    let (sine, cosine) = libm::sincos(shaft + direction);
                    libm::atan2(-eccentricity * sine, 1.0 - eccentricity * cosine)
                };
                // reading = shaft − head(shaft); a contraction by the eccentricity, which is small.
                let mut beyond = 0.0;
                for _ in 0..20 {
                    let next = head(reading + beyond);
                    let done = (next - beyond).abs() < 1e-17;
                    beyond = next;
                    if done {
                        break;
                    }
                }
                beyond
            }
            Encoder::Bent { cosine, fork } => {
                let (s, c) = libm::sincos(reading - fork);
                libm::atan2(s * c * (1.0 - cosine), cosine * c * c + s * s)
            }
        }
    }
}

/// The wave generator of a strain-wave gear, whose two lobes push the teeth a little too far or too little.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::simulation) struct WaveGenerator {
    /// Of the output, rad.
    pub(in crate::simulation) amplitude: f64,
    /// Turns of the wave generator per turn of the output.
    pub(in crate::simulation) ratio: f64,
    /// rad.
    pub(in crate::simulation) phase: f64,
}

/// Lines of a graduation, or teeth, that are not where they should be.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::simulation) struct Graduation {
    /// Rising, rad.
    pub(in crate::simulation) angles: Vec<f64>,
    /// How far the output stands beyond each of them, rad.
    pub(in crate::simulation) errors: Vec<f64>,
}

impl Graduation {
    /// How far the output stands beyond `angle`, rad: straight from one to the next, and nothing beyond the ends.
    fn beyond(&self, angle: f64) -> f64 {
        let next = self.angles.partition_point(|known| *known <= angle);
        if next == self.angles.len() && self.angles.last() == Some(&angle) {
            return self.errors[next - 1];
        }
        if next == 0 || next == self.angles.len() {
            return 0.0;
        }
        let [from, to] = [self.angles[next - 1], self.angles[next]];
        let share = (angle - from) / (to - from);
        self.errors[next - 1] * (1.0 - share) + self.errors[next] * share
    }
}

/// An output that follows its motor with a delay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::simulation) struct Fading {
    /// Of a move, what is left at its reading.
    pub(in crate::simulation) share: f64,
    /// Over which it fades; zero: gone by the next reading.
    pub(in crate::simulation) time_constant_s: f64,
}

impl Fading {
    /// How far the output stands behind, rad or m.
    fn behind(&self, joint: usize, conditions: &Conditions) -> f64 {
        let last = conditions.joints[joint] - conditions.from[joint];
        let left = |elapsed_s: f64| if self.time_constant_s > 0.0 { libm::exp(-elapsed_s / self.time_constant_s) } else { 0.0 };
        let earlier: f64 = conditions
            .history
            .iter()
            .map(|stop| (stop.joints[joint] - stop.from[joint]) * left(conditions.time_s - stop.time_s))
            .sum();
        self.share * (last + earlier)
    }
}

/// A sector of worn teeth: the output stands behind where it should, most in the middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::simulation) struct WornSector {
    /// In the middle, rad.
    pub(in crate::simulation) depth: f64,
    /// rad.
    pub(in crate::simulation) centre: f64,
    /// rad.
    pub(in crate::simulation) half_width: f64,
}

impl WornSector {
    /// How far the output stands behind at `angle`, rad.
    fn behind(&self, angle: f64) -> f64 {
        use std::f64::consts::{PI, TAU};
        let turns = libm::round((angle - self.centre) / TAU);
        let off = (angle - self.centre - TAU * turns).abs();
        if off >= self.half_width { 0.0 } else { 0.5 * self.depth * (1.0 + libm::cos(PI * off / self.half_width)) }
    }
}

/// Friction of a pre-loaded fit after Dahl: the output stays behind by an angle that grows to `amplitude` over `travel` and turns
/// round with the motion. Dahl's equation `dδ/dq = −(amplitude · sgn dq + δ) / travel · sgn dq` is linear as long as the direction
/// lasts, so that every move is integrated exactly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::simulation) struct Memory {
    /// rad.
    pub(in crate::simulation) amplitude: f64,
    /// rad.
    pub(in crate::simulation) travel: f64,
}

/// What is left of a move so many times `travel` ago is below the last bit.
const FORGOTTEN: f64 = 40.0;

impl Memory {
    fn state(&self, joint: usize, conditions: &Conditions) -> f64 {
        // Newest first: each move's saturated value, weighed by what all later moves have left of it.
        let (mut state, mut faded) = (0.0, 0.0);
        for (from, to) in conditions.moves_backwards(joint) {
            let way = (to - from).abs() / self.travel;
            if way > 0.0 {
                state -= libm::exp(-faded) * (1.0 - libm::exp(-way)) * self.amplitude.copysign(to - from);
            }
            faded += way;
            if faded > FORGOTTEN {
                break;
            }
        }
        state
    }
}

impl Drive {
    /// The output's coordinate, without what the loads do to it, rad or m.
    pub(in crate::simulation) fn output(&self, joint: usize, conditions: &Conditions) -> f64 {
        let q = conditions.joints[joint];
        let encoders: f64 = self.encoders.iter().map(|encoder| encoder.beyond(q)).sum();
        let waves: f64 = self.wave_generators.iter().map(|w| w.amplitude * libm::cos(2.0 * (w.ratio * q) + w.phase)).sum();
        let leaks: f64 = self.leaks.iter().map(|(source, coupling)| coupling * conditions.joints[*source]).sum();
        let graduations: f64 = self.graduations.iter().map(|graduation| graduation.beyond(q)).sum();
        let fading: f64 = self.fading.iter().map(|fading| fading.behind(joint, conditions)).sum();
        let worn: f64 = self.worn.iter().map(|sector| sector.behind(q)).sum();
        let memories: f64 = self.memories.iter().map(|memory| memory.state(joint, conditions)).sum();
        let drift = self.zero_drift * conditions.rise_k[joint + 1];
        q + (encoders + waves + self.ratio_error * q + leaks + graduations - fading - worn + memories + drift)
    }
}
