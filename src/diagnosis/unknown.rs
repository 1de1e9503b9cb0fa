//! Whether something is left that no effect of the library explains.

use super::Analysis;
use super::conclusion::{Remainder, Remains};
use super::outcome::{NoiseFloor, NoiseSource};

/// What is unknown: shapes without a name, structure, or too much. `level`: mean square of the residual over the declared one.
pub(super) fn unknown(analysis: &Analysis<'_>, level: f64, noise_floor: &NoiseFloor) -> Remainder {
    let of_nameless = analysis
        .found
        .claims
        .iter()
        .filter(|belief| belief.claim.0.is_none())
        .map(|belief| belief.probability)
        .fold(0.0, f64::max);
    let decision = &analysis.options.settings.decision;
    let p_value = analysis.structure.p_value;
    let structured = p_value < decision.structured;
    // A sensor may be somewhat worse than it says, not this much.
    let known = !matches!(noise_floor.source, NoiseSource::Assumed);
    let over = noise_floor.position_m / analysis.sigma_m();
    let excess = known && level > decision.excess * over * over;
    let scatters = !analysis.scatter.is_empty();
    let present = of_nameless >= decision.named || structured || excess || scatters;
    let mut remains: Vec<Remains> = Vec::new();
    if present {
        let members = analysis.found.best.iter().map(|(hypothesis, _)| &analysis.evidence.candidates.hypotheses[*hypothesis]);
        let mut unnamed: Vec<_> = members.zip(&analysis.moved.rms_m).filter(|(of, _)| of.kind.is_none()).collect();
        unnamed.sort_by(|a, b| b.1.total_cmp(a.1));
        let largest = unnamed.iter().take(decision.unknown_said);
        remains.extend(largest.map(|(of, rms_m)| Remains::Shape { detail: of.detail.clone(), rms_m: *rms_m }));
        if unnamed.len() > decision.unknown_said {
            remains.push(Remains::Smaller { count: unnamed.len() - decision.unknown_said });
        }
        remains.extend(analysis.scatter.iter().map(|one| Remains::Scatter {
            joint: one.joint + 1,
            sigma: one.sigma * libm::sqrt(level),
            slides: analysis.linear.rows.mechanism.slides[one.joint],
        }));
        if structured {
            remains.push(Remains::Trend(analysis.structure.strongest));
        }
        if remains.is_empty() {
            remains.push(Remains::Noise { ratio: libm::sqrt(level), source: noise_floor.source });
        }
    }
    let of_scatter = analysis.scatter.iter().map(|one| 1.0 / (1.0 + libm::exp(one.log_odds))).fold(1.0, f64::min);
    Remainder { present, p_value: p_value.min(1.0 - of_nameless).min(of_scatter).max(0.0), remains }
}
