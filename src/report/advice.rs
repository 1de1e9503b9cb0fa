//! What choosing is worth, told before anything is measured.

use super::table;
use crate::design::outcome::{Advice, DesignOutcome};
use crate::quality::prediction::Prediction;
use crate::units::number;

/// Gains smaller than this share are not worth the choosing.
const HARDLY: f64 = 0.1;

/// Predicted errors of random sets, the chosen one and the best there can be, and what follows.
pub(super) fn section(outcome: &DesignOutcome, advice: &Advice) -> String {
    let count = outcome.configurations.len();
    let random_sets = outcome.random.sets.saturating_sub(advice.random_undetermined);
    let gain = |error_m: f64| advice.random.map(|random| 1.0 - error_m / random.position_rms_m);
    let percent = |gain: Option<f64>| gain.map_or_else(dash, |gain| format!("{:.1}", 100.0 * gain));
    let millimetres = |error_m: f64| number(error_m * 1e3);
    let row = |name: String, prediction: Option<Prediction>, range: String, gain: Option<f64>| {
        let of = |get: &dyn Fn(Prediction) -> f64| prediction.map_or_else(dash, |prediction| number(get(prediction)));
        vec![
            name,
            of(&|p| p.position_rms_m * 1e3),
            range,
            percent(gain),
            of(&|p| p.orientation_rms_rad.to_degrees()),
            of(&|p| p.position_worst_m * 1e3),
        ]
    };
    let [least, most] = advice.random_range_m.map(millimetres);
    let range = if advice.random.is_some() { format!("{least} … {most}") } else { dash() };
    let mut bound = row(format!("no choice of {count} can do better than"), None, dash(), gain(advice.bound_m));
    bound[1] = millimetres(advice.bound_m);
    let rows = vec![
        row(format!("random, mean of {random_sets} sets"), advice.random, range, None),
        row("this set".to_owned(), advice.chosen, dash(), advice.chosen.and_then(|chosen| gain(chosen.position_rms_m))),
        bound,
    ];
    let header =
        ["error that noise will leave", "RMS (mm)", "min … max", "gain on random (%)", "orientation (°)", "worst of 300 (mm)"];
    let mut text = format!("\nPosition error that noise will leave over the workspace:\n{}\n", table(&header, rows));
    if advice.random_undetermined > 0 {
        let undetermined = advice.random_undetermined;
        text.push_str(&format!("{undetermined} of {} random sets do not determine the parameters.\n", outcome.random.sets));
    }
    text.push_str(&sentence(outcome, advice));
    text.push_str(&format!(
        "This is noise alone: play, bending, warming and whatever else the model leaves out come on top, whatever is chosen.\n\
         The bound is exact for {} candidate configurations, {} % of the variance off for the best that a search found beside them.\n",
        advice.bound_candidates,
        number(100.0 * advice.bound_gap)
    ));
    text
}

/// Whether choosing pays, and what this choice has of it.
fn sentence(outcome: &DesignOutcome, advice: &Advice) -> String {
    const BETTER: &str = "`--set design.criterion=i_optimality --set design.method=perturbation` chooses for this error";
    let count = outcome.configurations.len();
    let (random, chosen) = match (advice.random, advice.chosen) {
        (Some(random), Some(chosen)) => (random.position_rms_m, chosen.position_rms_m),
        (_, None) => return format!("This set does not determine the parameters; {BETTER}.\n"),
        (None, Some(_)) => return "No random set determines the parameters: choosing is a must here.\n".to_owned(),
    };
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let (possible, gained) = (1.0 - advice.bound_m / random, 1.0 - chosen / random);
    let mut text = String::new();
    if gained < 0.0 {
        text.push_str(&format!(
            "This set, chosen by {} on {}, leaves {} more than random ones do; {BETTER}.\n",
            outcome.method,
            outcome.criterion,
            percent(-gained)
        ));
    }
    if possible < HARDLY {
        text.push_str(&format!(
            "Choosing hardly pays here: no {count} configurations can leave more than {} less than random ones do.\n",
            percent(possible.max(0.0))
        ));
    } else if gained < 0.0 {
        text.push_str(&format!("No set leaves more than {} less than random ones do.\n", percent(possible)));
    } else {
        // The error falls with the root of the number of configurations.
        let ratio = random / chosen;
        text.push_str(&format!(
            "This set gains {} where at most {} can be gained: it takes about {:.0} random configurations to leave as little as \
             these {count}.\n",
            percent(gained),
            percent(possible),
            count as f64 * ratio * ratio
        ));
    }
    text
}

fn dash() -> String {
    "–".to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::outcome::{EvennessDomains, RandomReference, StopReason};
    use crate::quality::Indexes;

    fn outcome() -> DesignOutcome {
        let indexes = Indexes::default();
        DesignOutcome {
            method: "pso".to_owned(),
            criterion: "comprehensive".to_owned(),
            value: 1.4,
            configurations: vec![vec![0.0; 8]; 40],
            indexes,
            indexes_all_parameters: indexes,
            evenness_domains: EvennessDomains::default(),
            random: RandomReference { sets: 30, mean: indexes, min: indexes, max: indexes },
            advice: None,
            no_advice: None,
            dropped_parameters: Vec::new(),
            evaluations: 1,
            rejections: 0,
            stop: StopReason::BudgetSpent,
        }
    }

    fn prediction(position_rms_m: f64) -> Prediction {
        Prediction { position_rms_m, orientation_rms_rad: 0.01f64.to_radians(), position_worst_m: 2.0 * position_rms_m }
    }

    /// The section for errors of a random and a chosen set and the bound, mm.
    fn text(random: Option<f64>, chosen: Option<f64>, bound: f64) -> String {
        let advice = Advice {
            chosen: chosen.map(|error| prediction(error * 1e-3)),
            random: random.map(|error| prediction(error * 1e-3)),
            random_range_m: random.map_or([0.0; 2], |error| [0.9e-3 * error, 1.1e-3 * error]),
            random_undetermined: 2,
            bound_m: bound * 1e-3,
            bound_gap: 1e-3,
            bound_candidates: 1000,
        };
        section(&outcome(), &advice)
    }

    #[test]
    fn a_gain_is_told_in_random_configurations() {
        let text = text(Some(0.05), Some(0.04), 0.03);
        for expected in [
            "random, mean of 28 sets",
            "2 of 30 random sets",
            "0.0450 … 0.0550",
            "gains 20.0 % where at most 40.0 % can be gained",
            // 40 · (5/4)² = 62.5, to even.
            "about 62 random configurations",
            "no choice of 40 can do better than",
            "noise alone",
            "exact for 1000 candidate configurations",
            "0.1000 % of the variance",
        ] {
            assert!(text.contains(expected), "{expected}: {text}");
        }
        assert!(!text.contains("hardly") && !text.contains("--set"), "{text}");
    }

    #[test]
    fn where_little_can_be_gained_it_is_said() {
        let text = text(Some(0.05), Some(0.048), 0.046);
        assert!(text.contains("Choosing hardly pays here: no 40 configurations can leave more than 8.0 % less"), "{text}");
    }

    #[test]
    fn a_set_worse_than_random_is_called_so_with_what_to_do() {
        for (bound, more) in [(0.03, "No set leaves more than 40.0 % less than random ones do"), (0.049, "Choosing hardly pays")]
        {
            let text = text(Some(0.05), Some(0.055), bound);
            assert!(text.contains("chosen by pso on comprehensive, leaves 10.0 % more than random ones do"), "{text}");
            let remedy = "--set design.criterion=i_optimality --set design.method=perturbation";
            assert!(text.contains(remedy) && text.contains(more), "{text}");
        }
    }

    #[test]
    fn sets_that_determine_nothing_have_no_error() {
        assert!(text(Some(0.05), None, 0.03).contains("This set does not determine the parameters"));
        assert!(text(None, Some(0.05), 0.03).contains("choosing is a must"));
    }
}
