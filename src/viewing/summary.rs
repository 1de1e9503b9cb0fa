//! The run in words: the markdown document beside the pictures.

use std::fmt::Write as _;

use crate::design::outcome::{Advice, DesignOutcome, SearchStep, StopReason, SwarmIteration};
use crate::event::Start;
use crate::identification::outcome::{Errors, Identification};
use crate::measurement::{Measurement, Role};
use crate::quality::Indexes;
use crate::report::criterion::Words;

/// What is known of the run so far, newest section first.
#[derive(Debug, Default)]
pub(super) struct Summary {
    head: String,
    choosing: String,
    design: String,
    measured: [usize; 2],
    session_s: f64,
    identified: String,
    diagnosed: String,
}

impl Summary {
    pub(super) fn start(&mut self, name: &str, arm: &str, start: &Start) {
        self.head = format!("### {name}: {}\narm {arm}, kincal {}\n\n", start.command, start.version);
    }

    pub(super) fn swarm(&mut self, swarm: &SwarmIteration, words: Words) {
        self.choosing = format!(
            "#### Swarm\non `{}`, iteration {} of {}: {} after {} evaluations, {} rejections\n\n",
            words.name(),
            swarm.iteration,
            swarm.iterations,
            swarm.best_value().map(|best| words.value(best)).unwrap_or_default(),
            swarm.evaluations,
            swarm.rejections
        );
    }

    /// `method` as in the scene.
    pub(super) fn search(&mut self, step: &SearchStep, method: &str, words: Words) {
        self.choosing = format!(
            "#### Search\n`{method}` on `{}`: step {}, {} of {} evaluations, {} rejections; best: **{}**\n\n",
            words.name(),
            step.step,
            step.evaluations,
            step.budget,
            step.rejections,
            words.value(step.best)
        );
    }

    pub(super) fn designed(&mut self, design: &DesignOutcome) {
        self.choosing.clear();
        let stop = match design.stop {
            StopReason::IterationLimit => "all iterations made",
            StopReason::Converged => "converged",
            StopReason::Drawn => "drawn",
            StopReason::BudgetSpent => "budget spent",
        };
        let mut text = format!(
            "#### Design\n{} configurations by `{}` on `{}`: **{}**; {stop}, {} evaluations, {} rejections; rank {}.\n\n\
             {}| index | chosen | random, mean | random, range |\n|---|---|---|---|\n",
            design.configurations.len(),
            design.method,
            design.criterion,
            Words::of(&design.criterion).value(design.value),
            design.evaluations,
            design.rejections,
            design.indexes.rank,
            design.advice.as_ref().map(predicted).unwrap_or_default(),
        );
        type Of = fn(&Indexes) -> f64;
        let rows: [(&str, Of); 9] = [
            ("O_C", |i| i.comprehensive),
            ("O1", |i| i.o1),
            ("O2", |i| i.o2),
            ("O3", |i| i.o3),
            ("O4", |i| i.o4),
            ("O5", |i| i.o5),
            ("O6", |i| i.o6),
            ("D, m²", |i| i.dispersion_m2),
            ("U", |i| i.evenness),
        ];
        for (name, of) in rows {
            let [chosen, mean, min, max] = [&design.indexes, &design.random.mean, &design.random.min, &design.random.max]
                .map(|indexes| significant(of(indexes), 4));
            writeln!(text, "| {name} | {chosen} | {mean} | {min} … {max} |").ok();
        }
        if !design.dropped_parameters.is_empty() {
            write!(text, "\nHeld at nominal: {}.\n", design.dropped_parameters.join(", ")).ok();
        }
        self.design = text + "\n";
    }

    pub(super) fn measured(&mut self, measurement: &Measurement) {
        self.measured[usize::from(measurement.role == Role::HeldOut)] += 1;
        self.session_s = measurement.time_s;
    }

    /// `scales` states how long the arrows of the residuals are drawn.
    pub(super) fn identified(&mut self, identified: &Identification, scales: &[String]) {
        let mut text = format!(
            "#### Identified\n{}**{}** after {} iterations: {}. Rank {} of {} parameters, {} equations{}.\n\n",
            table(identified),
            if identified.converged { "converged" } else { "NOT CONVERGED" },
            identified.iterations,
            identified.reason.trim_end_matches('.'),
            identified.rank,
            identified.parameters.len(),
            identified.equations,
            identified
                .residual_scale
                .filter(|_| !identified.noise_estimated)
                .map(|scale| format!(", residuals {} × declared noise", significant(scale, 3)))
                .unwrap_or_default(),
        );
        if !scales.is_empty() {
            for scale in scales {
                writeln!(text, "- {scale}").ok();
            }
            text += "\n";
        }
        for note in &identified.notes {
            writeln!(text, "- {note}").ok();
        }
        self.identified = text + "\n";
    }

    pub(super) fn diagnosed(&mut self, text: String) {
        self.diagnosed = text;
    }

    /// The document.
    pub(super) fn markdown(&self) -> String {
        let [fit, held_out] = self.measured;
        let measured = if fit + held_out == 0 {
            String::new()
        } else {
            format!("#### Measured\n{fit} to fit, {held_out} held out; {} min.\n\n", significant(self.session_s / 60.0, 3))
        };
        [&self.head, &self.identified, &self.diagnosed, &measured, &self.choosing, &self.design]
            .into_iter()
            .map(String::as_str)
            .collect()
    }
}

/// What noise alone will leave: by random sets, by the chosen one, and at least.
fn predicted(advice: &Advice) -> String {
    let mm = |error_m: Option<f64>| error_m.map_or("–".to_owned(), |error_m| format!("{} mm", significant(error_m * 1e3, 3)));
    let [random, chosen] = [advice.random, advice.chosen].map(|prediction| mm(prediction.map(|p| p.position_rms_m)));
    let bound = mm(Some(advice.bound_m));
    format!("Noise will leave an error of {chosen} RMS over the workspace; random sets {random}, no set less than {bound}.\n\n")
}

/// Errors before and after, on held-out configurations first where there are any; the first of them in a sentence.
fn table(identified: &Identification) -> String {
    let mut pairs: Vec<(&str, &Errors, &Errors)> = Vec::new();
    if let (Some(before), Some(after)) = (&identified.held_out_nominal, &identified.held_out) {
        pairs.push(("held out", before, after));
    }
    pairs.push(("fitted", &identified.nominal, &identified.fitted));
    let mm = |value: f64| significant(value * 1e3, 3);
    let degrees = |value: Option<f64>| value.map_or("–".to_owned(), |value| significant(value.to_degrees(), 3));
    let mut text = String::new();
    if let Some((name, before, after)) = pairs.first() {
        let (before, now) = (mm(before.position_m.mean), mm(after.position_m.mean));
        write!(text, "Mean error **{before} mm → {now} mm** on {} configurations {name}.\n\n", after.count).ok();
    }
    text += "| | mean mm | max mm | mean ° | max ° |\n|---|---|---|---|---|\n";
    for (name, before, after) in pairs {
        for (when, errors) in [("before", before), ("after", after)] {
            let Errors { count, position_m: position, rotation_rad: rotation } = errors;
            let [mean, max] = [degrees(rotation.map(|r| r.mean)), degrees(rotation.map(|r| r.max))];
            writeln!(text, "| {count} {name}, {when} | {} | {} | {mean} | {max} |", mm(position.mean), mm(position.max)).ok();
        }
    }
    text + "\n"
}

/// A number with `digits` significant digits.
pub(super) fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let exponent = libm::floor(libm::log10(value.abs())) as i32;
    if !(-5..=6).contains(&exponent) {
        return format!("{value:.*e}", digits.saturating_sub(1));
    }
    let decimals = usize::try_from(digits as i32 - 1 - exponent).unwrap_or(0);
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_search_is_told_by_its_method_and_in_the_words_of_its_criterion() {
        let step = SearchStep {
            step: 3,
            evaluations: 7680,
            budget: 20_000,
            rejections: 5,
            value: 18.0,
            best: -2.0 * libm::log(0.052e-3),
            best_configurations: Vec::new(),
        };
        let mut summary = Summary::default();
        summary.search(&step, "coordinate_exchange", Words::of("i_optimality"));
        let expected = "`coordinate_exchange` on `i_optimality`: step 3, 7680 of 20000 evaluations, 5 rejections; best: \
                        **predicted 0.0520 mm**";
        assert!(summary.markdown().contains(expected), "{}", summary.markdown());
    }

    #[test]
    fn numbers_keep_their_significant_digits() {
        assert_eq!(significant(1234.5678, 3), "1235");
        assert_eq!(significant(0.012_345, 3), "0.0123");
        assert_eq!(significant(-2.0, 3), "-2.00");
        assert_eq!(significant(1e-9, 3), "1.00e-9");
        assert_eq!(significant(0.0, 3), "0");
    }
}
