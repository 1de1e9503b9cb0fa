//! How large a named effect is, with its interval.

use super::Analysis;
use super::evidence::{Fit, one_signed};
use super::outcome::Magnitude;
use super::settings::{Decision, SCALES};
use crate::effects::{Kind, Load};
use crate::numerics::distribution::{NORMAL_95, student_quantile};

/// The best set fitted with the widest prior there is, so that it pulls next to nothing: what magnitudes and all else that effects have
/// are told from.
pub(super) fn unpulled(analysis: &Analysis<'_>) -> Option<Fit> {
    let widest = SCALES - 1;
    let members: Vec<(usize, usize)> = analysis.found.best.iter().map(|(member, _)| (*member, widest)).collect();
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
    let name = if load { "relative (no masses)".to_owned() } else { name };
    let model = model_sigma(of.kind, &analysis.options.settings.decision);
    if width == 1 {
        let (mean, sigma) = (value(0), libm::hypot(libm::sqrt(covariance(0, 0)), model * value(0).abs()));
        let interval = [mean - quantile * sigma, mean + quantile * sigma];
        // What has no sign is told by its size.
        let signed = one_signed(of);
        let flip = !signed && mean < 0.0 && of.kind == Some(Kind::Backlash);
        let interval = if flip { [-interval[1], -interval[0]] } else { interval };
        return Magnitude { value: if flip { -mean } else { mean }, unit: name, ci95: interval };
    }
    let length = libm::sqrt((0..width).map(|i| value(i) * value(i)).sum::<f64>());
    let mut along = 0.0;
    let mut trace = 0.0;
    for i in 0..width {
        trace += covariance(i, i);
        for j in 0..width {
            along += value(i) * value(j) * covariance(i, j) / (length * length).max(1e-300);
        }
    }
    // The length of a noisy vector is too long by what is across it.
    let true_length = libm::sqrt((length * length - (trace - along)).max(0.05 * length * length));
    let half = quantile * libm::hypot(libm::sqrt(along), model * length);
    Magnitude { value: true_length, unit: name, ci95: [(true_length - half).max(0.0), true_length + half] }
}

/// How well a signature is known, as a share of the magnitude (one sigma): what loads a joint hangs on levers that calibration cannot
/// place to better than a millimetre or two in some tenths of a metre.
fn model_sigma(kind: Option<Kind>, settings: &Decision) -> f64 {
    if is_driven_by_load(kind) { settings.load_signature } else { settings.signature }
}

fn is_driven_by_load(kind: Option<Kind>) -> bool {
    kind.is_some_and(|kind| kind.descriptor().load == Load::Drives)
}
