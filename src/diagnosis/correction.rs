//! Where an arm really is, with the geometry that was fitted beside the named effects and with what these do: what its joints must be told so
//! that it is where it is wanted.

use super::conditions;
use super::deflection::Loads;
use super::outcome::Diagnosis;
use super::rows::{DiagnosisError, Rows};
use super::waterfall::Waterfall;
use crate::arm::frames::{Pose, rotation_from_vector};
use crate::arm::inverse::{Reached, reach};
use crate::arm::{Arm, ChainAt, Joint};
use crate::measurement::table::MOVED;
use crate::measurement::{Measurement, Sensor};
use nalgebra::Vector3;

/// Rounds of correcting by what the effects do where the arm then is.
const ROUNDS: usize = 20;
/// A change of the joints that is nothing, rad or m.
const SETTLED: f64 = 1e-9;

/// An arm as its readings and their diagnosis have it.
#[derive(Clone, Debug)]
pub struct Correction<'a> {
    waterfall: Waterfall<'a>,
    /// The fitted arm without readings.
    arm: Rows,
    measurements: &'a [&'a Measurement],
    diagnosis: &'a Diagnosis,
    /// Whether poses are of the target in the measurement frame, not of the tool in root.
    in_measurement_frame: bool,
}

/// A wanted pose.
#[derive(Clone, Debug)]
pub struct Wanted {
    /// Of the tool in root, or of the target in the measurement frame.
    pub pose: Pose,
    /// Whether its orientation counts.
    pub oriented: bool,
    /// Conditions, as a reading's; its joints say where the pose is looked for.
    pub like: Measurement,
}

impl<'a> Correction<'a> {
    /// Of `measurements` of `arm` by `sensor`, whose diagnosis is `diagnosis`. Poses are those of the tool in root, or
    /// `in_measurement_frame` of the target there (of the first session and target).
    ///
    /// # Errors
    /// If the measurements cannot tell.
    pub fn new(
        arm: &'a Arm,
        sensor: &'a Sensor,
        measurements: &'a [&'a Measurement],
        diagnosis: &'a Diagnosis,
        in_measurement_frame: bool,
    ) -> Result<Self, DiagnosisError> {
        let waterfall = Waterfall::new(arm, sensor, measurements, &diagnosis.effects, &diagnosis.settings)?;
        let arm = waterfall.rows.without_readings();
        Ok(Correction { waterfall, arm, measurements, diagnosis, in_measurement_frame })
    }

    /// The arm without what the effects do, from its root to its tool, or from the measurement frame to the target.
    #[must_use]
    pub fn chain(&self) -> &ChainAt {
        let rows = &self.waterfall.rows;
        if self.in_measurement_frame { &rows.measurement_to_target } else { rows.mechanism.chain() }
    }

    /// Where the end of [`Correction::chain`] is when the arm is at the joints of `like`, come straight from those of `before`.
    #[must_use]
    pub fn pose(&self, like: &Measurement, before: &Measurement) -> Pose {
        let still = self.chain().forward(&like.joints);
        self.moved(&still, like, before)
    }

    /// The end of the chain at `still`, displaced by what the effects do.
    fn moved(&self, still: &Pose, like: &Measurement, before: &Measurement) -> Pose {
        let Some([x, y, z, rx, ry, rz]) = self.displacement(like, before) else {
            return *still;
        };
        let rows = &self.waterfall.rows;
        let (mut shift, mut turn) = (Vector3::new(x, y, z), Vector3::new(rx, ry, rz));
        let mut target = still * rows.tool_from_target[0];
        if self.in_measurement_frame {
            let base = rows.measurement_from_root[0].rotation;
            (shift, turn, target) = (base * shift, base * turn, *still);
        }
        // What the target does by turning, the tool does about another point.
        let turned = rotation_from_vector(&turn);
        let lever = still.translation.vector - target.translation.vector;
        let place = target.translation.vector + shift + turned * lever;
        Pose::from_parts(place.into(), turned * still.rotation)
    }

    /// What the effects do to the target of a reading `like`, the arm come straight from `before`.
    fn displacement(&self, like: &Measurement, before: &Measurement) -> Option<[f64; 6]> {
        let measurements = self.measurements;
        let times = measurements.iter().map(|row| row.time_s);
        let (begin, end) = times.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), time| (low.min(time), high.max(time)));
        let approached = measurements.iter().all(|row| row.approach.len() == like.joints.len());
        let known = before.approach.len() == like.joints.len();
        let side = |joint: usize| {
            let way = like.joints[joint] - before.joints[joint];
            match () {
                () if way.abs() > MOVED => way.signum() as i8,
                () if known => before.approach[joint],
                () => 0,
            }
        };
        let approach = match () {
            () if !approached => Vec::new(),
            () if like.approach.len() == like.joints.len() => like.approach.clone(),
            () => (0..like.joints.len()).map(side).collect(),
        };
        let model = measurements.last()?;
        let temperatures_c =
            if like.temperatures_c.len() == model.temperatures_c.len() { &like.temperatures_c } else { &model.temperatures_c };
        let asked = Measurement {
            time_s: end,
            approach,
            temperatures_c: temperatures_c.clone(),
            ambient_c: like.ambient_c.or(model.ambient_c),
            gravity_m_s2: like.gravity_m_s2.or(model.gravity_m_s2),
            ..like.clone()
        };
        // It comes as long after the pose before as readings came after one another, at the end of the session, whose beginning is what
        // temperatures rise from.
        let pause = (end - begin) / measurements.len().max(2) as f64;
        let before = Measurement {
            time_s: end - pause,
            approach: vec![0; asked.approach.len()],
            temperatures_c: asked.temperatures_c.clone(),
            ambient_c: asked.ambient_c,
            session: asked.session.clone(),
            ..before.clone()
        };
        let first = measurements.iter().min_by(|a, b| a.time_s.total_cmp(&b.time_s))?;
        let mut rows = self.arm.clone();
        let course = [*first, &before, &asked];
        course.iter().for_each(|row| rows.push(row));
        let settings = &self.diagnosis.settings.model;
        let (conditions, _) = conditions::conditions(&course, &rows, &[], Loads::AsItStands, None, settings);
        let mut readings = conditions.readings;
        let mut reading = readings.pop()?;
        // Steps have all happened.
        reading.order = measurements.len();
        Some(self.waterfall.together_at(&self.diagnosis.effects, &reading, like.payload_kg.unwrap_or(0.0)))
    }

    /// The joints at which the tool is where it is `wanted`, come straight from `before`, within the limits of `joints`; and how far off it
    /// is there.
    #[must_use]
    pub fn reach(&self, wanted: &Wanted, before: &Measurement, joints: &[Joint]) -> Reached {
        let mut like = wanted.like.clone();
        let mut goal = wanted.pose;
        let mut found = reach(self.chain(), joints, &goal, wanted.oriented, &like.joints);
        for _ in 0..ROUNDS {
            let change = found.joints.iter().zip(&like.joints).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            like.joints.clone_from(&found.joints);
            let still = self.chain().forward(&like.joints);
            let moved = self.moved(&still, &like, before);
            // As far before the wanted place as the effects carry it.
            let shift = moved.translation.vector - still.translation.vector;
            let turn = moved.rotation * still.rotation.inverse();
            goal = Pose::from_parts((wanted.pose.translation.vector - shift).into(), turn.inverse() * wanted.pose.rotation);
            if change < SETTLED {
                break;
            }
            found = reach(self.chain(), joints, &goal, wanted.oriented, &like.joints);
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::tests::{diagnosed, readings, sensor};
    use crate::seed::stream;

    /// Play of one joint: what is wanted is reached by the arm with its play, from either side.
    #[test]
    fn what_is_wanted_is_reached_with_the_effects() {
        let width = 8e-4;
        let (arm, rows) = readings(
            "test/waterfall",
            |_, _, approach, joint, _| if joint == 2 { 0.5 * width * f64::from(approach[2]) } else { 0.0 },
        );
        let found = diagnosed(&arm, &rows, Vec::new());
        assert_eq!(found.effects.len(), 1);
        let (rows, sensor): (Vec<&Measurement>, _) = (rows.iter().collect(), sensor());
        let correction = Correction::new(&arm, &sensor, &rows, &found, false).unwrap();
        let mut draws = stream(1, "test/correction");
        let mut before = rows[0].clone();
        let mut plain = 0.0_f64;
        for _ in 0..10 {
            let joints: Vec<f64> = arm.chain.joints.iter().map(|of| draws.uniform(0.8 * of.lower, 0.8 * of.upper)).collect();
            let like = Measurement { joints: joints.clone(), ..rows[0].clone() };
            let like = Measurement { approach: Vec::new(), ..like };
            let wanted = Wanted { pose: correction.pose(&like, &before), oriented: true, like: like.clone() };
            let reached = correction.reach(&wanted, &before, &arm.chain.joints);
            let there = Measurement { joints: reached.joints.clone(), ..like };
            let off = (correction.pose(&there, &before).translation.vector - wanted.pose.translation.vector).norm();
            assert!(off < 1e-8, "{off}");
            let still = correction.chain().forward(&joints);
            plain = plain.max((still.translation.vector - wanted.pose.translation.vector).norm());
            before = there;
        }
        // Without the effects it would be off by what the play does.
        assert!(plain > 5e-5, "{plain}");
    }
}
