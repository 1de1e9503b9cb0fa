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
    // Nor may readings be ever so far off that count for little, and are no outliers.
    let usual = over * over;
    let excess = known && (level > decision.excess * usual || analysis.left > analysis.options.settings.noise.no_noise * usual);
    let scatters = !analysis.scatter.is_empty();
    let present = of_nameless >= decision.there || structured || excess || scatters;
    let mut remains: Vec<Remains> = Vec::new();
    if present {
        let detail = |member: usize| &analysis.evidence.candidates.hypotheses[analysis.found.best[member].0].detail;
        let mut unnamed = analysis.moved.unnamed.clone();
        unnamed.sort_by(|a, b| b.2.total_cmp(&a.2));
        let largest = unnamed.iter().take(decision.unknown_said);
        remains.extend(largest.map(|(first, count, rms_m)| Remains::Shape {
            detail: detail(*first).clone(),
            besides: count - 1,
            rms_m: *rms_m,
        }));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::conclusion::{Trend, Variable};
    use crate::diagnosis::scatter::Scatter;
    use crate::diagnosis::search::Belief;
    use crate::diagnosis::tests::{SIGMA, with_analysis};
    use crate::diagnosis::{Analysis, Moved};

    fn ask(change: impl FnOnce(&mut Analysis<'_>), level: f64, source: NoiseSource) -> Remainder {
        let mut said = None;
        with_analysis(
            |_, _, _, _, _| 0.0,
            |mut analysis| {
                change(&mut analysis);
                said = Some(unknown(&analysis, level, &NoiseFloor { position_m: SIGMA, rotation_rad: None, source }));
            },
        );
        said.unwrap()
    }

    #[test]
    fn too_much_noise_is_unknown_only_where_the_noise_is_known() {
        let nothing = |_: &mut Analysis<'_>| {};
        assert_eq!(ask(nothing, 2.3, NoiseSource::Declared), Remainder { present: false, p_value: 0.5, remains: Vec::new() });
        assert!(!ask(nothing, 9.0, NoiseSource::Assumed).present);
        let found = ask(nothing, 2.56, NoiseSource::Declared);
        let [Remains::Noise { ratio, source: NoiseSource::Declared }] = found.remains[..] else { panic!("{found:?}") };
        assert!(found.present && (ratio - 1.6).abs() < 1e-12);
    }

    #[test]
    fn structure_and_scatter_are_unknown_whatever_the_level() {
        let trend = Trend { along: Some(2), follows: Variable::Angle(3) };
        let structured = |analysis: &mut Analysis<'_>| {
            analysis.structure.p_value = 0.0025;
            analysis.structure.strongest = trend;
        };
        let expected = Remainder { present: true, p_value: 0.0025, remains: vec![Remains::Trend(trend)] };
        assert_eq!(ask(structured, 1.0, NoiseSource::Declared), expected);
        // Odds of 99 to 1 leave a hundredth; where all noise is twice as large, so is that of the joint.
        let scatters = |analysis: &mut Analysis<'_>| {
            analysis.scatter = vec![Scatter { joint: 3, sigma: 1e-4, log_odds: 99_f64.ln() }];
        };
        let found = ask(scatters, 4.0, NoiseSource::Declared);
        assert!(found.present && (found.p_value - 0.01).abs() < 1e-12, "{found:?}");
        let [Remains::Scatter { joint: 4, sigma, slides: false }] = found.remains[..] else { panic!("{found:?}") };
        assert!((sigma - 2e-4).abs() < 1e-16);
    }

    #[test]
    fn of_many_shapes_the_largest_are_said() {
        let mut details = Vec::new();
        let unnamed = |analysis: &mut Analysis<'_>| {
            let all = &analysis.evidence.candidates.hypotheses;
            let six: Vec<usize> = (0..all.len()).filter(|number| all[*number].kind.is_none()).step_by(7).take(6).collect();
            details = six.iter().map(|number| all[*number].detail.clone()).collect();
            let claim = (None, all[six[0]].location);
            analysis.found.claims = vec![Belief { claim, hypothesis: six[0], probability: 0.8 }];
            analysis.found.best = six.iter().map(|number| (*number, 1)).collect();
            let sizes = [1e-6, 6e-6, 3e-6, 5e-6, 2e-6, 4e-6];
            let unnamed = sizes.iter().enumerate().map(|(member, size)| (member, 1, *size)).collect();
            analysis.moved = Moved { most: Vec::new(), unnamed };
        };
        let found = ask(unnamed, 1.0, NoiseSource::Declared);
        assert!(found.present && (found.p_value - 0.2).abs() < 1e-12);
        let shape = |number: usize, rms_m: f64| Remains::Shape { detail: details[number].clone(), besides: 0, rms_m };
        assert_eq!(
            found.remains,
            [shape(1, 6e-6), shape(3, 5e-6), shape(5, 4e-6), shape(2, 3e-6), Remains::Smaller { count: 2 }]
        );
    }
}
