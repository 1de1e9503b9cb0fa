//! What a named effect has besides kind, place and magnitude: enough to make it happen in a simulation.

use super::Analysis;
use super::evidence::Fit;
use super::outcome::Signature;
use crate::effects::Parameters;
use crate::effects::signature::shape::Coefficients;

/// What a member of the best set follows, with the coefficients of its columns from the fit that tells its magnitude.
pub(super) fn signature(analysis: &Analysis<'_>, fit: &Fit, hypothesis: usize) -> Signature {
    let of = &analysis.evidence.candidates.hypotheses[hypothesis];
    let unit = analysis.evidence.candidates.unit[hypothesis];
    let coefficient = |(column, spread): (usize, &f64)| {
        let at = fit.columns.iter().position(|known| *known == column);
        at.map_or(0.0, |at| fit.coefficients[at] * unit * spread)
    };
    let coefficients = analysis.evidence.candidates.columns(hypothesis).zip(&of.spread).map(coefficient).collect();
    Signature { shape: of.shape, coefficients }
}

/// The same by the names that results have for it.
pub(super) fn parameters(analysis: &Analysis<'_>, fit: &Fit, hypothesis: usize, signature: &Signature) -> Parameters {
    let times: Vec<f64> = analysis.conditions.in_time.iter().map(|row| analysis.measurements[*row].time_s).collect();
    let (begin, end) = (times.first().copied().unwrap_or(0.0), times.last().copied().unwrap_or(0.0));
    let share = |place: usize| times.get(place).map_or(1.0, |time| (time - begin) / (end - begin));
    // Between the last reading before and the first one after.
    let said = named(signature, |row| 0.5 * (share(row.saturating_sub(1)) + share(row)));
    let candidates = analysis.evidence.candidates;
    let sigma = |(column, spread): (usize, &f64)| {
        let at = fit.columns.iter().position(|known| *known == column);
        at.map_or(0.0, |at| libm::sqrt(fit.noise * fit.covariance[(at, at)]) * candidates.unit[hypothesis] * spread)
    };
    let sigmas = || candidates.columns(hypothesis).zip(&candidates.hypotheses[hypothesis].spread).map(sigma).collect();
    Parameters { sigmas_rad: said.angles_rad.as_ref().map(|_| sigmas()), ..said }
}

/// `after`: share of the session that has passed between the reading before a place in time and the one at it.
pub(crate) fn named(signature: &Signature, after: impl Fn(usize) -> f64) -> Parameters {
    let said = signature.shape.parameters(Coefficients(&signature.coefficients));
    Parameters { after: said.row.map(after), ..said }
}

#[cfg(test)]
mod tests {
    use crate::diagnosis::tests::with_analysis;
    use crate::effects::Kind;
    use crate::effects::kind::joint_eccentricity::Harmonic;
    use crate::effects::signature::shape::Shape;

    /// The coefficients are those of the wave that was put in, in its own unit, whatever the units in which it is looked for.
    #[test]
    fn the_signature_of_a_wave_has_its_amplitude_and_phase() {
        let (amplitude, phase) = (4e-4, 0.7_f64);
        with_analysis(
            |_, joints, _, of, _| if of == 2 { amplitude * (joints[of] + phase).sin() } else { 0.0 },
            |analysis| {
                let shape = Shape::Harmonic(Harmonic { joint: 2, order: 1.0 });
                let hypotheses = &analysis.evidence.candidates.hypotheses;
                let number = hypotheses
                    .iter()
                    .position(|of| of.kind == Some(Kind::JointEccentricity) && of.shape == shape)
                    .expect("once per turn of joint 3");
                let fit = analysis.evidence.fit(&[(number, crate::diagnosis::settings::SCALES - 1)]).unwrap();
                let found = super::signature(&analysis, &fit, number);
                assert_eq!(found.shape, shape);
                let [cosine, sine] = found.coefficients[..] else {
                    panic!("{found:?}");
                };
                assert!((cosine - amplitude * phase.sin()).abs() < 0.1 * amplitude, "{cosine}");
                assert!((sine - amplitude * phase.cos()).abs() < 0.1 * amplitude, "{sine}");
            },
        );
    }
}
