//! From what was found to what is said.

use statrs::distribution::{ContinuousCDF, StudentsT};

use super::evidence::{SCALES, fit, one_signed};
use super::held_out::{Block, Fold, HeldOut};
use super::outcome::{
    Blocked, Candidate, Diagnosis, Effect, Gap, LeftOut, Magnitude, MinimumDetectable, NoiseFloor, NoiseSource, Parameters,
    Place, Residual, Undetectable, Unknown, Verdict,
};
use super::parameters::parameters;
use super::power::Bench;
use super::{Analysis, mean_sigma};
use crate::effects::signature::shape::Shape;
use crate::effects::{Kind, Level, Location};

/// From this probability on something is named.
const NAMED: f64 = 0.5;
/// From this probability on nothing else needs to be considered.
const SURE: f64 = 0.95;
/// A hypothesis of a set has at least this probability.
const WORTH_SAYING: f64 = 0.03;
/// Of the residual having no structure: below this there is some.
const STRUCTURED: f64 = 0.003;
/// Mean square of the residual, over that of the noise that is known, from which on something is left.
const EXCESS: f64 = 2.4;
/// Of the kinds and places, so many must be detectable at a realistic magnitude for "no gap".
const ENOUGH: f64 = 0.5;

/// Held-out RMS in one way of leaving out.
fn blocked(held_out: &HeldOut) -> Option<Blocked> {
    let rows: usize = held_out.folds.iter().map(|fold| fold.rows).sum();
    let rms = |squares: f64| libm::sqrt(squares / rows as f64);
    (rows > 0).then(|| Blocked {
        by: held_out.by,
        folds: held_out.folds.len(),
        nominal_rms_m: rms(held_out.folds.iter().map(|fold| fold.nominal).sum()),
        geometry_rms_m: rms(held_out.folds.iter().map(|fold| fold.geometry).sum()),
        explained_rms_m: rms(held_out.folds.iter().map(Fold::all).sum()),
        left_out: held_out
            .folds
            .iter()
            .map(|fold| {
                let rms = |squares: f64| libm::sqrt(squares / fold.rows as f64);
                LeftOut {
                    name: fold.name.clone(),
                    readings: fold.rows,
                    geometry_rms_m: rms(fold.geometry),
                    explained_rms_m: rms(fold.all()),
                }
            })
            .collect(),
    })
}

/// How many folds do without something that evidence chose for them.
fn doing_without(held_out: &HeldOut) -> Option<String> {
    let what = match held_out.by {
        Block::Region => "regions",
        Block::Payload => "payloads",
        Block::Session => "sessions",
    };
    let count = held_out.folds.iter().filter(|fold| fold.does_without()).count();
    (count > 0).then(|| {
        format!(
            "{count} of {} folds ({what}) leave out effects that evidence chose for them, because these did not help on readings that \
             were not used",
            held_out.folds.len()
        )
    })
}

/// What tells linear from saturating effects of load.
const PAYLOADS: &str =
    "linear and saturating effects of load look alike under one payload: the same configurations with two or three payloads";

/// What a hypothesis claims: its kind (or none) and its place.
type Claim = (Option<Kind>, Location);

fn claim(analysis: &Analysis<'_>, hypothesis: usize) -> Claim {
    let hypothesis = &analysis.candidates.hypotheses[hypothesis];
    (hypothesis.kind, hypothesis.location)
}

/// Probability that a model holds a member that fulfils `test`.
fn probability(analysis: &Analysis<'_>, test: impl Fn(usize) -> bool) -> f64 {
    let holds = |members: &[(usize, usize)]| members.iter().any(|(hypothesis, _)| test(*hypothesis));
    analysis.found.models.iter().filter(|(members, _)| holds(members)).map(|(_, weight)| weight).sum::<f64>().min(1.0)
}

/// What parts of the data prefer to a claim of the best set: the folds whose best set lacks it and holds a claim that the best set of all
/// data has not, each with by how much it prefers that one (difference of probabilities), as a share of all folds. A posterior given
/// all data is too sure of the least wrong of wrong models; where parts of the data contradict it, the parts are believed (Huggins and
/// Miller 2023, "Reproducible model selection using bagged posteriors").
fn rivals(analysis: &Analysis<'_>, this: Claim) -> Vec<(Claim, usize, f64)> {
    let best: Vec<Claim> = analysis.found.best.members.iter().map(|(member, _)| claim(analysis, *member)).collect();
    let folds = analysis.held_out.first().map_or(&[][..], |by_region| &by_region.folds);
    let mut found: Vec<(Claim, usize, f64)> = Vec::new();
    for fold in folds.iter().filter(|fold| !fold.chosen.iter().any(|other| claim(analysis, *other) == this)) {
        let Some(other) = fold.chosen.iter().copied().find(|other| !best.contains(&claim(analysis, *other))) else {
            continue;
        };
        let of = |one: Claim| -> f64 {
            let holds = |members: &[(usize, usize)]| members.iter().any(|(member, _)| claim(analysis, *member) == one);
            fold.models.iter().filter(|(members, _)| holds(members)).map(|(_, weight)| weight).sum()
        };
        let rival = claim(analysis, other);
        let share = (of(rival) - of(this)).max(0.0) / folds.len() as f64;
        match found.iter_mut().find(|(known, _, _)| *known == rival) {
            Some((_, _, sum)) => *sum += share,
            None => found.push((rival, other, share)),
        }
    }
    found
}

fn place(analysis: &Analysis<'_>, hypothesis: usize) -> Place {
    let of = &analysis.candidates.hypotheses[hypothesis];
    let time_s = match of.shape {
        Shape::BaseStep(at) | Shape::ToolStep(at) => analysis.conditions.times.get(at).copied(),
        _ => None,
    };
    Place { level: of.location.level, index: of.location.index, time_s }
}

fn kind_name(kind: Option<Kind>) -> String {
    kind.map_or_else(|| "unknown".to_owned(), |kind| kind.name().to_owned())
}

/// The magnitude of a member of the best set. The prior is the widest there is, so that it pulls next to nothing.
fn magnitude(analysis: &Analysis<'_>, hypothesis: usize) -> Option<Magnitude> {
    let widest = SCALES.len() - 1;
    let mut members: Vec<(usize, usize)> = analysis.found.best.members.iter().map(|(member, _)| (*member, widest)).collect();
    if !members.iter().any(|(member, _)| *member == hypothesis) {
        members.push((hypothesis, widest));
    }
    let fit = fit(analysis.surviving, analysis.candidates, analysis.noise, &members)?;
    let of = &analysis.candidates.hypotheses[hypothesis];
    let unit = analysis.candidates.unit[hypothesis];
    let columns = analysis.candidates.columns(hypothesis);
    // Of a twist, the length of its translation.
    let width = if matches!(of.shape, Shape::BaseDrift | Shape::BaseStep(_) | Shape::ToolStep(_)) { 3 } else { columns.len() };
    let at: Vec<usize> = columns.take(width).filter_map(|column| fit.columns.iter().position(|known| *known == column)).collect();
    let value = |i: usize| fit.coefficients[at[i]] * unit * of.spread[i];
    let covariance = |i: usize, j: usize| fit.noise * fit.covariance[(at[i], at[j])] * unit * unit * of.spread[i] * of.spread[j];
    let freedom = (analysis.surviving.freedom + analysis.noise.freedom).max(1.0);
    let quantile = StudentsT::new(0.0, 1.0, freedom).map_or(1.96, |student| student.inverse_cdf(0.975));
    let name = of.kind.map_or("", Kind::unit).to_owned();
    let load = matches!(of.kind, Some(Kind::JointCompliance | Kind::LinkBending)) && !analysis.rows.mechanism.masses_known;
    let name = if load { "relative (no masses)".to_owned() } else { name };
    let model = model_sigma(of.kind);
    if width == 1 {
        let (mean, sigma) = (value(0), libm::hypot(libm::sqrt(covariance(0, 0)), model * value(0).abs()));
        let interval = [mean - quantile * sigma, mean + quantile * sigma];
        // What has no sign is told by its size.
        let signed = one_signed(of);
        let flip = !signed && mean < 0.0 && of.kind == Some(Kind::Backlash);
        let interval = if flip { [-interval[1], -interval[0]] } else { interval };
        return Some(Magnitude { value: if flip { -mean } else { mean }, unit: name, ci95: interval });
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
    Some(Magnitude { value: true_length, unit: name, ci95: [(true_length - half).max(0.0), true_length + half] })
}

/// How well a signature is known, as a share of the magnitude (one sigma): what loads a joint hangs on levers that calibration cannot
/// place to better than a millimetre or two in some tenths of a metre.
fn model_sigma(kind: Option<Kind>) -> f64 {
    match kind {
        Some(Kind::JointCompliance | Kind::LinkBending) => 7e-3,
        _ => 2e-3,
    }
}

/// Puts the analysis into words and numbers.
pub(super) fn put(analysis: &Analysis<'_>) -> Diagnosis {
    let total = analysis.measurements.len();
    let mut notes = analysis.conditions.notes.clone();
    notes.extend(analysis.rows.notes.iter().cloned());
    let folds = analysis.held_out.first().map_or(&[][..], |by_region| &by_region.folds);
    let declared = mean_sigma(analysis.sensor, analysis.measurements);
    let (position_m, source) = match analysis.repeats {
        Some(repeats) => (repeats.position_m, NoiseSource::Repeats),
        None => (declared, analysis.options.noise),
    };
    let rotation_rad = analysis.sensor.attitude_sigma_rad.filter(|_| analysis.rows.per_row == 6);
    let noise_floor = NoiseFloor { position_m, rotation_rad, source };
    if analysis.repeats.is_some_and(|repeats| !repeats.moved) {
        notes.push(
            "the repeats were read without a move between them: they show the sensor's noise, not what the arm repeats to"
                .to_owned(),
        );
    }
    if let Some(correlation) = analysis.correlation.filter(|correlation| *correlation > 0.05) {
        notes.push(format!(
            "readings of the same configuration are alike (correlation {correlation:.2} of what is left): they are weighted down, n of \
             them to n / (1 + {correlation:.2} (n − 1))"
        ));
    }
    notes.extend(analysis.held_out.iter().filter_map(doing_without));
    let noise_rms = libm::sqrt(3.0) * position_m;

    // Held out.
    let rows: f64 = folds.iter().map(|fold| fold.rows as f64).sum::<f64>().max(1.0);
    let rms = |squares: f64| libm::sqrt(squares / rows);
    let nominal_rms_m = rms(folds.iter().map(|fold| fold.nominal).sum());
    let geometry_rms_m = rms(folds.iter().map(|fold| fold.geometry).sum());
    let after = |count: usize| rms(folds.iter().map(|fold| fold.with(count)).sum());
    let explained_rms_m = after(usize::MAX);
    let floor2 = noise_rms * noise_rms;
    let closed = |before: f64, after: f64| {
        let gap = before * before - floor2;
        (gap > 0.02 * floor2 && gap > 0.0).then(|| 1.0 - (after * after - floor2) / gap)
    };
    // Where nothing is used nothing is closed.
    let uses_any = folds.iter().any(|fold| !fold.explained.is_empty());
    let gap_closed = closed(geometry_rms_m, explained_rms_m).filter(|_| uses_any);
    let gap_closed_ci95 = gap_closed.and_then(|_| {
        let of_folds: Vec<f64> = folds
            .iter()
            .filter_map(|fold| {
                let mean = |squares: f64| libm::sqrt(squares / fold.rows as f64);
                closed(mean(fold.geometry), mean(fold.all()))
            })
            .collect();
        let n = of_folds.len() as f64;
        let mean = of_folds.iter().sum::<f64>() / n;
        let variance = of_folds.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / (n - 1.0);
        let student = StudentsT::new(0.0, 1.0, n - 1.0).ok()?;
        let half = student.inverse_cdf(0.975) * libm::sqrt(variance / n);
        (n > 2.0).then_some([mean - half, mean + half])
    });
    let gap = Gap {
        nominal_rms_m,
        geometry_rms_m,
        explained_rms_m,
        noise_rms_m: noise_rms,
        gap_closed,
        gap_closed_ci95,
        folds: folds.len(),
        blocked: analysis.held_out.iter().skip(1).filter_map(blocked).collect(),
    };

    let best = fit(analysis.surviving, analysis.candidates, analysis.noise, &analysis.found.best.members);
    let level = best.map_or(1.0, |fit| fit.noise);
    // What is unknown.
    let of_nameless = probability(analysis, |hypothesis| analysis.candidates.hypotheses[hypothesis].kind.is_none());
    let p_value = analysis.structure.p_value;
    let structured = p_value < STRUCTURED;
    // A sensor may be somewhat worse than it says, not this much.
    let known = !matches!(source, NoiseSource::Assumed);
    let excess = known && level > EXCESS * (position_m / declared) * (position_m / declared);
    let present = of_nameless >= NAMED || structured || excess;
    let unknown_members: Vec<usize> = analysis
        .found
        .best
        .members
        .iter()
        .map(|(hypothesis, _)| *hypothesis)
        .filter(|hypothesis| analysis.candidates.hypotheses[*hypothesis].kind.is_none())
        .collect();
    let r#where = present.then(|| {
        let mut said: Vec<String> =
            unknown_members.iter().map(|hypothesis| analysis.candidates.hypotheses[*hypothesis].detail.clone()).collect();
        if structured {
            said.push(analysis.structure.r#where.clone());
        }
        if said.is_empty() {
            said.push(format!("what remains is {:.1} times the {} noise", libm::sqrt(level), word(source)));
        }
        said.join("; ")
    });
    let unknown = Unknown { present, p_value: p_value.min(1.0 - of_nameless).max(0.0), r#where };

    // Named effects.
    let mut effects = Vec::new();
    let mut named_as: Vec<Option<usize>> = vec![None; analysis.found.best.members.len()];
    for (step, (hypothesis, _)) in analysis.found.best.members.iter().enumerate() {
        let this = claim(analysis, *hypothesis);
        let of = &analysis.candidates.hypotheses[*hypothesis];
        if of.kind.is_none() {
            continue;
        }
        let rivalled: f64 = rivals(analysis, this).iter().map(|(_, _, share)| share).sum();
        let probability = probability(analysis, |other| claim(analysis, other) == this) * (1.0 - rivalled);
        let chosen = folds.iter().filter(|fold| fold.chosen.iter().any(|other| claim(analysis, *other) == this)).count();
        // Beside something unknown a name may only stand in for it: it must be sure, the same whatever is left out, help on readings
        // that were not used, and help more than what has no name.
        let needed = if present { SURE } else { NAMED };
        let before_unknown = analysis.found.best.members[..step].iter().all(|(other, _)| !unknown_members.contains(other));
        let helps = after(step + 1) < after(step);
        let stable = !present || (before_unknown && helps && 5 * chosen >= 4 * folds.len());
        let Some(magnitude) = magnitude(analysis, *hypothesis).filter(|_| probability >= needed && stable) else {
            continue;
        };
        let (before, now) = (after(step), after(step + 1));
        named_as[step] = Some(effects.len());
        effects.push(Effect {
            kind: kind_name(of.kind),
            location: place(analysis, *hypothesis),
            probability,
            magnitude,
            parameters: parameters(analysis, *hypothesis),
            held_out_rms_before_m: before,
            held_out_rms_after_m: now,
            gap_closed: closed(before, now),
            folds: [chosen, folds.len()],
            detail: of.detail.clone(),
        });
    }
    let outliers = &analysis.outliers;
    let is_left_out = analysis.options.without.contains(&Kind::MeasurementOutliers);
    // A misfit has tails, too.
    let enough = if present { 9.0 } else { 4.0 };
    if outliers.probability >= NAMED && outliers.factor >= enough && !is_left_out {
        effects.push(Effect {
            kind: Kind::MeasurementOutliers.name().to_owned(),
            location: Place { level: Level::Sensor, index: None, time_s: None },
            probability: outliers.probability,
            magnitude: Magnitude { value: outliers.share, unit: "1".to_owned(), ci95: outliers.share_ci95 },
            parameters: Parameters { factor: Some(outliers.factor), ..Parameters::default() },
            held_out_rms_before_m: explained_rms_m,
            held_out_rms_after_m: explained_rms_m,
            gap_closed: None,
            folds: [0, folds.len()],
            detail: format!("noise about {} times that of the other readings", outliers.factor),
        });
    }
    if !outliers.rows.is_empty() {
        let names: Vec<String> =
            outliers.rows.iter().take(20).map(|row| (analysis.measurements[*row].index + 1).to_string()).collect();
        let more = if outliers.rows.len() > 20 { format!(" and {} more", outliers.rows.len() - 20) } else { String::new() };
        notes
            .push(format!("readings far off, weighted down and not counted in held-out errors: rows {}{more}", names.join(", ")));
    }

    let confusion_sets = confusion(analysis);

    // Power.
    if !(0.44..=2.25).contains(&level) {
        notes.push(format!("the residuals are {:.2} times the {} noise", libm::sqrt(level), word(source)));
    }
    let (undetectable, detectable, share) = detectability(analysis, level);

    let named: Vec<&Effect> = effects.iter().filter(|effect| effect.kind != Kind::MeasurementOutliers.name()).collect();
    let open = confusion_sets.iter().any(|set| set.iter().map(|candidate| candidate.probability).sum::<f64>() >= NAMED);
    let verdict = if present {
        Verdict::UnknownRemains
    } else if !named.is_empty() && named.iter().all(|effect| effect.probability >= SURE) {
        Verdict::Explained
    } else if !named.is_empty() || open {
        Verdict::Ambiguous
    } else if !effects.is_empty() {
        Verdict::Explained
    } else if share >= ENOUGH {
        Verdict::NoGap
    } else {
        Verdict::NotDetectable
    };
    let next_measurements = next(analysis, &confusion_sets, &undetectable, &detectable, verdict);
    let mut sentence = sentence(verdict, &effects, &confusion_sets, &unknown, &gap, share);
    if verdict == Verdict::NoGap {
        let seen = |kind: &str| detectable.iter().any(|one| one.kind == kind);
        let mut blind: Vec<String> =
            undetectable.iter().filter(|one| !seen(&one.kind)).map(|one| one.kind.replace('_', " ")).collect();
        blind.sort();
        blind.dedup();
        if !blind.is_empty() {
            sentence.push_str(&format!(" Nowhere to be seen would have been: {}.", blind.join(", ")));
        }
    }
    Diagnosis {
        verdict,
        sentence,
        noise_floor,
        gap,
        effects,
        confusion_sets,
        undetectable,
        detectable,
        unknown,
        maps: analysis.maps.clone(),
        next_measurements,
        notes,
        readings: total,
        residuals: analysis
            .residuals
            .iter()
            .zip(&analysis.moved)
            .map(|(residual, moved)| Residual { cause: moved.and_then(|member| named_as[member]), ..residual.clone() })
            .collect(),
    }
}

fn word(source: NoiseSource) -> &'static str {
    match source {
        NoiseSource::Repeats => "repeats'",
        NoiseSource::Declared => "declared",
        NoiseSource::Assumed => "assumed",
    }
}

/// Sets of claims that the data cannot tell apart: each member of the best set that is not sure, with what may stand in its place.
fn confusion(analysis: &Analysis<'_>) -> Vec<Vec<Candidate>> {
    // All claims with their probabilities and one hypothesis that stands for each.
    let mut claims: Vec<(Claim, f64, usize)> = Vec::new();
    for (members, weight) in &analysis.found.models {
        let mut seen: Vec<Claim> = Vec::new();
        for (hypothesis, _) in members {
            let this = claim(analysis, *hypothesis);
            if seen.contains(&this) {
                continue;
            }
            seen.push(this);
            match claims.iter_mut().find(|(known, _, _)| *known == this) {
                Some((_, probability, _)) => *probability += weight,
                None => claims.push((this, *weight, *hypothesis)),
            }
        }
    }
    // Parts of the data that contradict the best set take their share of its members' probabilities.
    for (member, _) in &analysis.found.best.members {
        let this = claim(analysis, *member);
        let Some(before) = claims.iter().find(|(known, _, _)| *known == this).map(|(_, probability, _)| *probability) else {
            continue;
        };
        for (rival, hypothesis, share) in rivals(analysis, this) {
            let moved = before * share;
            for (known, probability, _) in &mut claims {
                *probability -= if *known == this { moved } else { 0.0 };
            }
            match claims.iter_mut().find(|(known, _, _)| *known == rival) {
                Some((_, probability, _)) => *probability = (*probability + moved).min(1.0),
                None => claims.push((rival, moved, hypothesis)),
            }
        }
    }
    claims.retain(|(_, probability, _)| *probability >= WORTH_SAYING && *probability < SURE);
    // Claims of one set exclude each other: they are hardly ever in one model.
    let together = |a: &Claim, b: &Claim| -> f64 {
        let has =
            |members: &[(usize, usize)], one: &Claim| members.iter().any(|(hypothesis, _)| claim(analysis, *hypothesis) == *one);
        let models = analysis.found.models.iter();
        models.filter(|(members, _)| has(members, a) && has(members, b)).map(|(_, weight)| weight).sum()
    };
    claims.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut sets: Vec<Vec<(Claim, f64, usize)>> = Vec::new();
    for one in claims {
        let fits = |set: &Vec<(Claim, f64, usize)>| {
            let sum: f64 = set.iter().map(|(_, probability, _)| probability).sum();
            sum + one.1 < 1.02 && set.iter().all(|other| together(&other.0, &one.0) < 0.3 * one.1.min(other.1))
        };
        match sets.iter_mut().find(|set| fits(set)) {
            Some(set) => set.push(one),
            None => sets.push(vec![one]),
        }
    }
    sets.into_iter()
        .filter(|set| set.len() > 1 && set.iter().map(|(_, probability, _)| probability).sum::<f64>() >= 0.2)
        .map(|set| {
            set.into_iter()
                .take(12)
                .map(|((kind, _), probability, hypothesis)| Candidate {
                    kind: kind_name(kind),
                    location: place(analysis, hypothesis),
                    probability,
                    detail: analysis.candidates.hypotheses[hypothesis].detail.clone(),
                })
                .collect()
        })
        .collect()
}

/// What would show from which magnitude on, and the share of kinds and places that would show at a realistic one.
fn detectability(analysis: &Analysis<'_>, noise: f64) -> (Vec<Undetectable>, Vec<Undetectable>, f64) {
    use rayon::prelude::*;
    let candidates = analysis.candidates;
    let mut claims: Vec<(Kind, Claim, Vec<usize>)> = Vec::new();
    for number in 0..candidates.hypotheses.len() {
        let this = claim(analysis, number);
        match (claims.iter_mut().find(|(_, known, _)| *known == this), this.0) {
            (Some((_, _, variants)), _) => variants.push(number),
            (None, Some(kind)) => claims.push((kind, this, vec![number])),
            (None, None) => {}
        }
    }
    let bench = Bench::new(candidates, analysis.surviving, analysis.noise, noise, &analysis.found.best.members);
    let powers: Vec<_> = claims.par_iter().map(|(_, _, variants)| bench.power(variants)).collect();
    let (mut undetectable, mut detectable) = (Vec::new(), Vec::new());
    let (mut seen, mut all) = (0.0, 0.0);
    for ((kind, _, variants), power) in claims.into_iter().zip(powers) {
        let hypothesis = &candidates.hypotheses[variants[0]];
        let place = Place { time_s: None, ..place(analysis, variants[0]) };
        let largest = hypothesis.range[1];
        all += 1.0;
        let value = power.least.filter(|least| least.is_finite() && *least < 1e4 * largest);
        let least = MinimumDetectable { value, unit: kind.unit().to_owned() };
        let entry = |reason: String| Undetectable {
            kind: kind.name().to_owned(),
            location: place,
            minimum_detectable: least.clone(),
            reason,
        };
        match value {
            Some(value) if value <= largest => {
                seen += 1.0;
                detectable.push(entry(String::new()));
            }
            Some(_) => {
                let alike = power.alike.filter(|(_, likeness)| *likeness > 0.8).map(|(other, likeness)| {
                    let that = &candidates.hypotheses[other];
                    let words = words(&kind_name(that.kind), &that.location);
                    format!("cannot be told from {words} (likeness {:.2}) at a realistic size", libm::sqrt(likeness))
                });
                let reason = alike.unwrap_or_else(|| "a realistic size is lost in the noise, or geometry absorbs it".to_owned());
                undetectable.push(entry(reason));
            }
            None => undetectable.push(entry(why_nothing(kind).to_owned())),
        }
    }
    let columns = &analysis.conditions.columns;
    let joints = analysis.rows.mechanism.joint_count();
    let mut missing = |kind: Kind, reason: &str| {
        for joint in 1..=joints {
            all += 1.0;
            undetectable.push(Undetectable {
                kind: kind.name().to_owned(),
                location: Place { level: kind.level(), index: Some(joint), time_s: None },
                minimum_detectable: MinimumDetectable { value: None, unit: kind.unit().to_owned() },
                reason: reason.to_owned(),
            });
        }
    };
    if !columns.approach {
        missing(Kind::Backlash, "no approach directions were recorded");
    }
    if !columns.temperature {
        for kind in [Kind::LinkThermalGrowth, Kind::JointThermalDrift] {
            missing(kind, "no temperatures that change were recorded");
        }
    }
    (undetectable, detectable, seen / f64::max(all, 1.0))
}

fn why_nothing(kind: Kind) -> &'static str {
    match kind {
        Kind::MeasurementScale => "link lengths that are fitted absorb it wholly; a scale bar would show it",
        Kind::JointCompliance | Kind::GravityLostMotion | Kind::TiltClearance | Kind::RadialClearance | Kind::LinkBending => {
            "gravity loads this joint not at all, or always alike"
        }
        Kind::Backlash => "the joint is always approached from the same side",
        _ => "geometry absorbs it wholly on these configurations",
    }
}

/// A kind at a place, in words.
fn words(kind: &str, location: &Location) -> String {
    let level = match location.level {
        Level::Joint => "joint",
        Level::Link => "link",
        Level::Base => "the base",
        Level::Tool => "the tool",
        Level::Sensor => "the sensor",
    };
    let kind = kind.replace('_', " ");
    match location.index {
        Some(index) => format!("{kind} of {level} {index}"),
        None if location.level == Level::Link => format!("{kind} of the whole arm"),
        None => format!("{kind} of {level}"),
    }
}

fn of_place(kind: &str, place: &Place) -> String {
    let words = words(kind, &Location { level: place.level, index: place.index });
    match place.time_s {
        Some(time) => format!("{words} at {time:.0} s"),
        None => words,
    }
}

/// The verdict in a sentence.
fn sentence(verdict: Verdict, effects: &[Effect], sets: &[Vec<Candidate>], unknown: &Unknown, gap: &Gap, share: f64) -> String {
    let list = |effects: &[Effect]| {
        let names: Vec<String> = effects
            .iter()
            .map(|effect| format!("{} ({:.0} %)", of_place(&effect.kind, &effect.location), 100.0 * effect.probability))
            .collect();
        names.join(", ")
    };
    let um = |metres: f64| format!("{:.0} µm", metres * 1e6);
    match verdict {
        Verdict::NoGap => format!(
            "No gap: geometry explains the readings down to {} RMS on held-out poses, and {:.0} % of what is looked for would have \
             shown at a realistic size.",
            um(gap.geometry_rms_m),
            100.0 * share
        ),
        Verdict::NotDetectable => format!(
            "Nothing is seen, but only {:.0} % of what is looked for would have shown at a realistic size: these readings cannot tell.",
            100.0 * share
        ),
        Verdict::Explained => format!(
            "Explained by {}: held-out RMS {} with geometry, {} with the cause.",
            list(effects),
            um(gap.geometry_rms_m),
            um(gap.explained_rms_m)
        ),
        Verdict::Ambiguous => {
            let candidates: Vec<String> = sets
                .first()
                .into_iter()
                .flatten()
                .take(3)
                .map(|one| format!("{} ({:.0} %)", of_place(&one.kind, &one.location), 100.0 * one.probability))
                .collect();
            if effects.len() > 1 {
                format!(
                    "Several causes, not all settled (below {:.0} %): {}; held-out RMS {} with geometry, {} with the causes.",
                    100.0 * SURE,
                    list(effects),
                    um(gap.geometry_rms_m),
                    um(gap.explained_rms_m)
                )
            } else if candidates.is_empty() {
                format!("Something is there that is not settled: {}.", list(effects))
            } else {
                format!("Something is there, and these readings cannot tell which it is: {}.", candidates.join(" or "))
            }
        }
        Verdict::UnknownRemains => {
            let place = unknown.r#where.clone().unwrap_or_default();
            if effects.is_empty() {
                format!("Something is there that no effect of the library explains: {place}.")
            } else {
                format!("Besides {}, something remains that no effect of the library explains: {place}.", list(effects))
            }
        }
    }
}

/// What to measure next.
fn next(
    analysis: &Analysis<'_>,
    sets: &[Vec<Candidate>],
    blind: &[Undetectable],
    seen: &[Undetectable],
    verdict: Verdict,
) -> Vec<String> {
    let mut said: Vec<String> = Vec::new();
    let mut say = |text: &str| {
        if !said.iter().any(|known| known == text) {
            said.push(text.to_owned());
        }
    };
    let columns = &analysis.conditions.columns;
    for set in sets {
        let has = |name: &str| set.iter().any(|one| one.kind == name);
        if has("joint_compliance") && has("link_bending") {
            say("compliance or bending: load the arm sideways, tilt the base, or put a target on a link in between");
        }
        if (has("link_bending") && has("tilt_clearance")) || has("joint_compliance") || has("gravity_lost_motion") {
            say(PAYLOADS);
        }
        if has("link_thermal_growth") || has("joint_thermal_drift") || has("base_drift") {
            say("temperature or time: heat and cool in one session, so that temperatures return while time goes on");
        }
        if has("joint_eccentricity") || has("gear_coupling") {
            say("harmonics of a joint: move it through its whole travel, other joints at rest");
        }
        if has("base_step") || has("tool_step") {
            say("base or tool: read the same few configurations again with another attitude of the tool");
        }
        if has("unknown") {
            say("a shape without a name: more configurations where it shows");
        }
    }
    // What these readings could not have shown, whatever they did show.
    let places = |kind: Kind| -> Vec<String> {
        let of_kind = blind.iter().filter(|one| one.kind == kind.name() && one.minimum_detectable.value.is_none());
        of_kind.filter_map(|one| one.location.index).map(|index| index.to_string()).collect()
    };
    if !columns.approach {
        say(
            "backlash could not show: record from which side each joint was approached (columns approach1, …), and use both sides",
        );
    } else {
        let joints = places(Kind::Backlash);
        if !joints.is_empty() {
            say(&format!(
                "backlash of joint {} could not show, for it was always approached from the same side: approach it from both",
                joints.join(", ")
            ));
        }
    }
    let thermal = [Kind::LinkThermalGrowth, Kind::JointThermalDrift];
    if !seen.iter().any(|one| thermal.iter().any(|kind| one.kind == kind.name())) {
        let known = analysis.measurements.iter().any(|row| row.ambient_c.is_some() || !row.temperatures_c.is_empty());
        say(if known {
            "thermal effects could not show, for the temperature hardly changed: let the arm warm up and cool down in one session"
        } else {
            "thermal effects could not show: record temperatures (temp_ambient_c, temp1_c, …) while the arm warms up and cools down"
        });
    }
    let payload = analysis.measurements.first().and_then(|row| row.payload_kg);
    if analysis.measurements.iter().all(|row| row.payload_kg == payload) {
        say(
            "linear and saturating effects of load look alike under one payload: the same configurations with two or three payloads",
        );
    }
    if verdict != Verdict::Explained {
        if analysis.repeats.is_none() {
            say("read some configurations twice, approached alike: repeats tell the noise");
        }
        if verdict == Verdict::NotDetectable {
            say("more configurations, or a sensor with less noise");
        }
    }
    said
}
