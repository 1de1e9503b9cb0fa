//! What named effects are worth on held-out poses, once what they do to each reading is known: by the formulas of first order
//! ([`Waterfall::displacements`]), or told by somebody else, such as a simulation.

use super::conditions::{self, Conditions};
use super::deflection::{Loads, Present, deflected};
use super::groups::groups;
use super::held_out::{self, Scheme};
use super::outcome::Effect;
use super::outliers;
use super::rows::{self, DiagnosisError, Readings, Rows};
use super::settings::Settings;
use super::weights;
use crate::arm::Arm;
use crate::effects::Location;
use crate::effects::signature::shape::{Displacement, Reading};
use crate::measurement::{Measurement, Sensor};

/// Rounds of fitting geometry beside the effects, and of weighting readings.
const PASSES: usize = 4;

/// Readings with the folds of their diagnosis and the weights that they have beside the effects named: the same for every step of a
/// waterfall.
#[derive(Clone, Debug)]
pub struct Waterfall<'a> {
    arm: &'a Arm,
    sensor: &'a Sensor,
    measurements: &'a [&'a Measurement],
    /// Geometry fitted beside the effects.
    pub(crate) rows: Rows,
    /// Readings as signatures see them.
    pub(crate) conditions: Conditions,
    scheme: Scheme,
    weights: Vec<f64>,
    good: Vec<bool>,
}

impl<'a> Waterfall<'a> {
    /// Of `measurements` of `arm`, read by `sensor`, in which `effects` were found. Readings that are far off beside them are weighted
    /// down and do not count where they are held out, and those that repeat others count as much as they tell, as in a diagnosis.
    ///
    /// # Errors
    /// If the measurements cannot tell where the arm stands, or are not this robot's.
    pub fn new(
        arm: &'a Arm,
        sensor: &'a Sensor,
        measurements: &'a [&'a Measurement],
        effects: &[Effect],
        settings: &Settings,
    ) -> Result<Self, DiagnosisError> {
        settings.check()?;
        let total = measurements.len();
        let groups = groups(measurements, &settings.noise);
        let start = vec![1.0; total];
        let rows = rows::fit(arm, Readings { sensor, measurements, weights: &start, displacement: &[], scatter: &[] })?;
        let (conditions, _) = conditions::conditions(measurements, &rows, &[], Loads::AsItStands, None, &settings.model);
        let scheme = held_out::schemes(measurements, &rows.targets, &groups, &settings.validation).swap_remove(0);
        let good = vec![true; total];
        let mut waterfall = Waterfall { arm, sensor, measurements, rows, conditions, scheme, weights: start, good };
        for _ in 0..PASSES {
            let displacement = waterfall.together(effects);
            let weights = &waterfall.weights;
            let rows = rows::fit(arm, Readings { sensor, measurements, weights, displacement: &displacement, scatter: &[] })?;
            let weighed = weights::weigh(&rows, &rows.residual, weights, &groups, &settings.noise);
            let outliers = outliers::look(&weighed.squares, &rows.equations.counts(), &settings.outliers).rows;
            waterfall.good = (0..total).map(|row| !outliers.contains(&row)).collect();
            waterfall.weights = weighed.far.iter().zip(&weighed.dependent).map(|(a, b)| a * b).collect();
            waterfall.conditions = conditions::conditions(measurements, &rows, &[], Loads::AsItStands, None, &settings.model).0;
            waterfall.rows = rows;
        }
        Ok(waterfall)
    }

    /// What all of `effects` that have a formula do together (of each reading: shift of the target in m, turn in rad, in root), as large as
    /// they are: loads are those of the arm as it stands with them, also where the diagnosis found that the readings already say where it
    /// stands.
    #[must_use]
    pub fn together(&self, effects: &[Effect]) -> Vec<Displacement> {
        let of = |(reading, row): (&Reading, &&Measurement)| self.together_at(effects, reading, row.payload_kg.unwrap_or(0.0));
        self.conditions.readings.iter().zip(self.measurements).map(of).collect()
    }

    /// The same of one `reading`, the tool carrying `payload_kg`.
    #[must_use]
    pub fn together_at(&self, effects: &[Effect], reading: &Reading, payload_kg: f64) -> Displacement {
        let known = effects.iter().filter_map(|effect| {
            let signature = effect.signature.as_ref().filter(|signature| signature.shape.can_be_read(reading))?;
            Some(Present {
                location: Location { level: effect.location.level, index: effect.location.index },
                shape: signature.shape,
                coefficients: signature.coefficients.clone(),
            })
        });
        deflected(&self.rows, reading, payload_kg, &known.collect::<Vec<_>>(), Loads::AsItStands).displacement
    }

    /// What `effect` does to the target in each reading (shift in m, turn in rad, in root), to first order: the columns of what it was
    /// diagnosed to follow times their coefficients. `None` where it follows nothing (outliers), or where the readings lack what it needs.
    #[must_use]
    pub fn displacements(&self, effect: &Effect) -> Option<Vec<Displacement>> {
        let signature = effect.signature.as_ref()?;
        let orientation = self.rows.equations.has_orientation();
        self.conditions.readings.iter().map(|reading| signature.displacement(reading, orientation)).collect()
    }

    /// 3-D position RMS on held-out poses, m, of base, target and geometry fitted to what the readings are without `displacements`
    /// (of each reading: shift of the target in m, turn in rad, in root).
    ///
    /// # Errors
    /// If what remains is not this robot's.
    pub fn after(&self, displacements: &[Displacement]) -> Result<f64, DiagnosisError> {
        use rayon::prelude::*;
        let (sensor, measurements) = (self.sensor, self.measurements);
        let squares: Vec<(f64, usize)> = (0..self.scheme.folds)
            .into_par_iter()
            .map(|number| {
                let held = |row: &usize| self.scheme.fold[*row] == number;
                // What weighs nothing has no part in the fit, and its residual is the prediction's error.
                let weights: Vec<f64> =
                    (0..measurements.len()).map(|row| if held(&row) { 0.0 } else { self.weights[row] }).collect();
                let fitted = rows::fit(
                    self.arm,
                    Readings { sensor, measurements, weights: &weights, displacement: displacements, scatter: &[] },
                )?;
                let counted: Vec<usize> = (0..measurements.len()).filter(|row| held(row) && self.good[*row]).collect();
                let square = |row: &usize| fitted.residual.rows_range(fitted.equations.of_position(*row)).norm_squared();
                Ok((counted.iter().map(square).sum::<f64>(), counted.len()))
            })
            .collect::<Result<_, DiagnosisError>>()?;
        let (sum, count) = squares.iter().fold((0.0, 0), |(sum, count), one| (sum + one.0, count + one.1));
        Ok(libm::sqrt(sum / count.max(1) as f64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::tests::{SIGMA, diagnosed, readings, sensor};

    /// The waterfall from geometry to the noise, with readings of which only the play is wrong.
    #[test]
    fn the_true_cause_takes_held_out_errors_down_to_the_noise() {
        let width = 8e-4;
        let (arm, rows) = readings(
            "test/waterfall",
            |_, _, approach, joint, _| {
                if joint == 2 { 0.5 * width * f64::from(approach[2]) } else { 0.0 }
            },
        );
        let found = diagnosed(&arm, &rows, Vec::new());
        let (rows, sensor, settings): (Vec<&Measurement>, _, _) = (rows.iter().collect(), sensor(), Settings::default());
        let waterfall = Waterfall::new(&arm, &sensor, &rows, &found.effects, &settings).unwrap();
        let nothing = waterfall.after(&vec![[0.0; 6]; rows.len()]).unwrap();
        let all = waterfall.after(&waterfall.together(&found.effects)).unwrap();
        let noise = 3_f64.sqrt() * SIGMA;
        // Sixty readings do not tell geometry quite.
        assert!((noise..2.0 * noise).contains(&all) && nothing > 2.0 * all, "{nothing} {all}");
        // One effect and nothing else: its columns are what all do together, to second order.
        let alone = waterfall.displacements(&found.effects[0]).unwrap();
        let size = |of: &Displacement| of[0].hypot(of[1]).hypot(of[2]);
        for (one, together) in alone.iter().zip(waterfall.together(&found.effects)) {
            assert!((size(one) - size(&together)).abs() < 1e-6, "{one:?} {together:?}");
        }
        // Where the readings lack what an effect follows, nothing is said.
        let mut blind = waterfall.clone();
        blind.conditions.readings.iter_mut().for_each(|reading| reading.approach.clear());
        assert_eq!(blind.displacements(&found.effects[0]), None);
    }
}
