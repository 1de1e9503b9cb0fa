//! How large a named effect is, with its interval.

use nalgebra::{DMatrix, DVector};

use super::Analysis;
use super::evidence::Fit;
use super::outcome::Magnitude;
use super::settings::{Decision, SCALES};
use crate::effects::signature::shape::Size;
use crate::effects::{Kind, Load};
use crate::numerics::distribution::{NORMAL_95, student_quantile};

/// Unit of what load drives where no masses are known.
const RELATIVE: &str = "relative (no masses)";

/// The best set fitted with the widest prior there is, so that it pulls next to nothing: what magnitudes and all else that effects have
/// are told from. A free function keeps its own, as it has values where no reading tells them.
pub(super) fn unpulled(analysis: &Analysis<'_>) -> Option<Fit> {
    let widest = SCALES - 1;
    let free = |member: usize| analysis.evidence.candidates.hypotheses[member].shape.size() == Size::Rms;
    let scale = |(member, own): &(usize, usize)| (*member, if free(*member) { *own } else { widest });
    let members: Vec<(usize, usize)> = analysis.found.best.iter().map(scale).collect();
    analysis.evidence.fit(&members)
}

/// The magnitude of a member of the best set, from its fit ([`unpulled`]).
pub(super) fn magnitude(analysis: &Analysis<'_>, fit: &Fit, hypothesis: usize) -> Magnitude {
    let of = &analysis.evidence.candidates.hypotheses[hypothesis];
    let unit = analysis.evidence.candidates.unit[hypothesis];
    let columns = analysis.evidence.candidates.columns(hypothesis);
    let width = of.shape.magnitude_width();
    let at: Vec<usize> = columns.take(width).filter_map(|column| fit.columns.iter().position(|known| *known == column)).collect();
    let value = |i: usize| fit.coefficients[at[i]] * unit * of.spread[i];
    let covariance = |i: usize, j: usize| fit.noise * fit.covariance[(at[i], at[j])] * unit * unit * of.spread[i] * of.spread[j];
    let degrees_of_freedom =
        (analysis.evidence.marginal.degrees_of_freedom + analysis.evidence.noise.degrees_of_freedom).max(1.0);
    let quantile = student_quantile(0.975, degrees_of_freedom).unwrap_or(NORMAL_95);
    let name = of.kind.map_or("", Kind::unit).to_owned();
    let load = is_driven_by_load(of.kind) && !analysis.linear.rows.mechanism.masses_known;
    let name = if load { RELATIVE.to_owned() } else { name };
    let settings = &analysis.options.settings.decision;
    let model = if of.shape.size() == Size::Rms { settings.free_signature } else { model_sigma(of.kind, settings) };
    if width == 1 {
        let (mean, sigma) = (value(0), libm::hypot(libm::sqrt(covariance(0, 0)), model * value(0).abs()));
        let interval = [mean - quantile * sigma, mean + quantile * sigma];
        let flip = mean < 0.0 && of.kind.is_some_and(|kind| kind.descriptor().sign_apart);
        let interval = if flip { [-interval[1], -interval[0]] } else { interval };
        return Magnitude { value: if flip { -mean } else { mean }, unit: name, ci95: interval };
    }
    let metric = metric(analysis, hypothesis);
    let values = DVector::from_fn(width, |i, _| value(i));
    let weighed = &metric * &values;
    let length = libm::sqrt(values.dot(&weighed).max(0.0));
    let covariance = DMatrix::from_fn(width, width, covariance);
    let along = weighed.dot(&(&covariance * &weighed)) / (length * length).max(1e-300);
    let trace = metric.component_mul(&covariance).sum();
    // The length of a noisy vector is too long by what is across it.
    let true_length = libm::sqrt((length * length - (trace - along)).max(settings.shortened * length * length));
    let half = quantile * libm::hypot(libm::sqrt(along), model * length);
    Magnitude { value: true_length, unit: name, ci95: [(true_length - half).max(0.0), true_length + half] }
}

/// What makes a square of a magnitude from coefficients of `hypothesis`: of a free function, what the readings see of it.
fn metric(analysis: &Analysis<'_>, hypothesis: usize) -> DMatrix<f64> {
    let shape = &analysis.evidence.candidates.hypotheses[hypothesis].shape;
    let width = shape.magnitude_width();
    match shape.size() {
        Size::Length => DMatrix::identity(width, width),
        Size::Rms => {
            let marginal = analysis.evidence.marginal;
            let all = marginal.information(hypothesis).max(1e-300);
            DMatrix::from_fn(width, width, |i, j| marginal.own(hypothesis, i, j) / all)
        }
    }
}

/// How well a signature is known, as a share of the magnitude (one sigma): what loads a joint hangs on levers that calibration cannot
/// place to better than a millimetre or two in some tenths of a metre.
fn model_sigma(kind: Option<Kind>, settings: &Decision) -> f64 {
    if is_driven_by_load(kind) { settings.load_signature } else { settings.signature }
}

fn is_driven_by_load(kind: Option<Kind>) -> bool {
    kind.is_some_and(|kind| kind.descriptor().load == Load::Drives)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::tests::{hypothesis, with_analysis};
    use crate::effects::signature::shape::Shape;
    use crate::seed::stream;

    /// A fit in which `hypothesis` has the coefficients `values` (SI) with independent errors of `sigma`.
    fn fit(analysis: &Analysis<'_>, hypothesis: usize, values: &[f64], sigma: f64) -> Fit {
        let candidates = analysis.evidence.candidates;
        let size = |at: usize| candidates.unit[hypothesis] * candidates.hypotheses[hypothesis].spread[at];
        let variances = DVector::from_fn(values.len(), |at, _| (sigma / size(at)) * (sigma / size(at)));
        Fit {
            columns: candidates.columns(hypothesis).collect(),
            coefficients: DVector::from_fn(values.len(), |at, _| values[at] / size(at)),
            covariance: DMatrix::from_diagonal(&variances),
            noise: 1.0,
        }
    }

    #[test]
    fn a_width_is_positive_and_a_stiffness_keeps_its_sign() {
        with_analysis(
            |_, _, _, _, _| 0.0,
            |analysis| {
                let of = |kind: Kind, value: f64| {
                    let number = hypothesis(&analysis, Some(kind), 3);
                    magnitude(&analysis, &fit(&analysis, number, &[value], 1e-5), number)
                };
                let width = of(Kind::Backlash, -2e-4);
                assert!((width.value - 2e-4).abs() < 1e-12);
                assert_eq!(width, of(Kind::Backlash, 2e-4));
                // About two sigmas to either side, and a little for what is not known of the signature.
                let half = 0.5 * (width.ci95[1] - width.ci95[0]);
                assert!((1.96e-5..2.05e-5).contains(&half) && (width.ci95[0] + half - 2e-4).abs() < 1e-12, "{width:?}");
                assert!(of(Kind::JointCompliance, -3e-5).value < 0.0);
            },
        );
    }

    /// Noise makes a vector longer: draws about a known one tell whether what is taken off is right, and how often the interval has it.
    #[test]
    fn the_length_of_a_noisy_vector_is_not_too_long() {
        with_analysis(
            |_, _, _, _, _| 0.0,
            |analysis| {
                let is = |of: &Shape| {
                    *of == Shape::Harmonic(crate::effects::kind::joint_eccentricity::Harmonic { joint: 2, order: 1.0 })
                };
                let of_kind = |number: &usize| {
                    let of = &analysis.evidence.candidates.hypotheses[*number];
                    of.kind == Some(Kind::JointEccentricity) && is(&of.shape)
                };
                let number = (0..analysis.evidence.candidates.hypotheses.len()).find(of_kind).unwrap();
                let (truth, sigma, count) = (5e-5, 0.8e-5, 10_000);
                let mut draws = stream(3, "test/lengths");
                let (mut plain, mut told, mut inside) = (0.0, 0.0, 0);
                for _ in 0..count {
                    let values = [truth * 0.6, truth * 0.8].map(|value| value + sigma * draws.normal());
                    let found = magnitude(&analysis, &fit(&analysis, number, &values, sigma), number);
                    plain += values[0].hypot(values[1]) / f64::from(count);
                    told += found.value / f64::from(count);
                    inside += i32::from(found.ci95[0] <= truth && truth <= found.ci95[1]);
                }
                assert!(plain / truth - 1.0 > 0.008 && (told / truth - 1.0).abs() < 0.006, "{plain} {told}");
                assert!((0.94..0.965).contains(&(f64::from(inside) / f64::from(count))), "{inside}");
            },
        );
    }
}
