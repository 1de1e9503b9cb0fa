//! The score of a diagnosis: tables for people, one for CSV, and the reliability plot.

use crate::figure::{Axis, Colour, Estimate, Figure, Kind, Panel, Series};
use crate::lab::challenge::score::{ANY, Confusion, LAMBDA, NOT_THERE, Restored, Score, Single};
use crate::report::table;
use crate::statistics::{median, share_interval95};

/// `97 % (31/32)`.
fn share(part: usize, of: usize) -> String {
    if of == 0 { "–".to_owned() } else { format!("{:.1} % ({part}/{of})", 100.0 * part as f64 / of as f64) }
}

fn percent(value: Option<f64>) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{:.1} %", 100.0 * value))
}

fn single(name: String, row: &Single) -> Vec<String> {
    vec![
        name,
        row.cases.to_string(),
        share(row.right, row.cases),
        share(row.right_place, row.right),
        share(row.abstained, row.cases),
        row.in_a_set.to_string(),
        share(row.wrong, row.cases),
        share(row.confidently_wrong, row.cases),
        row.unknown.to_string(),
    ]
}

const SINGLE: [&str; 9] =
    ["one effect, by λ", "cases", "right kind", "right place", "abstained", "in a set", "wrong kind", "confidently", "unknown"];

/// All tables. `seconds` are the times of the diagnosis, case by case; empty where it was made elsewhere.
#[must_use]
pub fn score(score: &Score, who: &str, seconds: &[f64]) -> String {
    let mut text = format!("{} cases, diagnosed by {who}\n", score.cases);
    text.push_str(&table(&SINGLE, score.single.iter().map(|row| single(row.lambda.clone(), row)).collect()));
    text.push('\n');
    let kinds = score.by_kind.iter().map(|kind| {
        let (all, visible) = (&kind.all, &kind.visible);
        let named = |row: &&Confusion| row.truth == kind.kind && row.lambda == visible.lambda && row.named != kind.kind;
        let instead: Vec<String> =
            score.confusion.iter().filter(named).map(|row| format!("{} {}", row.cases, row.named)).collect();
        vec![
            kind.kind.clone(),
            all.cases.to_string(),
            share(all.right, all.cases),
            share(all.wrong, all.cases),
            visible.cases.to_string(),
            share(visible.right, visible.cases),
            share(visible.right_place, visible.right),
            if instead.is_empty() { "–".to_owned() } else { instead.join(", ") },
        ]
    });
    if !score.by_kind.is_empty() {
        let header = [
            "one effect, by kind",
            "cases",
            "right kind",
            "wrong kind",
            "λ ≥ 40",
            "right kind",
            "right place",
            "there named instead",
        ];
        text.push_str(&table(&header, kinds.collect()));
        text.push('\n');
    }
    let several = &score.several;
    text.push_str(&table(
        &["several effects", "cases", "exact set", "found (recall)", "right among named (precision)"],
        vec![
            vec![
                "all".to_owned(),
                several.cases.to_string(),
                share(several.exact, several.cases),
                share(several.found, several.effects),
                share(several.named_right, several.named),
            ],
            vec![
                "each λ ≥ 40".to_owned(),
                several.visible_cases.to_string(),
                share(several.visible_exact, several.visible_cases),
                share(several.visible_found, several.visible_effects),
                "–".to_owned(),
            ],
        ],
    ));
    text.push('\n');
    let free = score
        .effect_free
        .iter()
        .map(|row| vec![row.noise.clone(), row.cases.to_string(), share(row.named, row.cases), share(row.unknown, row.cases)]);
    text.push_str(&table(&["no effect, noise", "cases", "false alarm", "called unknown"], free.collect()));
    text.push('\n');
    let foreign = score.foreign.iter().map(|row| {
        vec![row.lambda.clone(), row.cases.to_string(), share(row.flagged, row.cases), share(row.misnamed, row.cases)]
    });
    text.push_str(&table(&["kind not to be known", "cases", "flagged unknown", "misnamed"], foreign.collect()));
    text.push('\n');
    let mixed = &score.mixed;
    if mixed.cases > 0 {
        text.push_str(&table(
            &["known beside unknown kinds", "cases", "known, λ ≥ 60, named", "right among named", "unknown, λ ≥ 60, flagged"],
            vec![vec![
                "all".to_owned(),
                mixed.cases.to_string(),
                share(mixed.visible_found, mixed.visible_effects),
                share(mixed.named_right, mixed.named),
                share(mixed.flagged, mixed.visible_outside),
            ]],
        ));
        text.push('\n');
    }
    let competition = &score.competition;
    text.push_str(&table(
        &["as in competitions", "false alarms", "detected, λ ≥ 40", "mean probability of the true cause, λ ≥ 40"],
        vec![vec![
            "all".to_owned(),
            share(competition.false_alarms, competition.quiet_cases),
            share(competition.detected, competition.faulty_cases),
            competition.mean_probability_of_true.map_or_else(|| "–".to_owned(), |mean| format!("{mean:.3}")),
        ]],
    ));
    text.push('\n');
    if let Some(rows) = &score.restored {
        text.push_str(&restored(rows));
        text.push('\n');
    }
    let sizes = score
        .magnitudes
        .iter()
        .map(|row| vec![row.lambda.clone(), row.given.to_string(), percent(row.median_error), share(row.covered, row.intervals)]);
    text.push_str(&table(&["magnitude, found effects", "given", "median error", "95 % intervals cover"], sizes.collect()));
    if !score.changes.is_empty() {
        text.push('\n');
        let rows = score
            .changes
            .iter()
            .map(|row| vec![row.kind.clone(), row.given.to_string(), percent(row.median_error), percent(row.largest_of_90)]);
        let header = ["time of named steps", "given", "median error, of the session", "90 % below"];
        text.push_str(&table(&header, rows.collect()));
    }
    for bin in [3, 2] {
        let (_, name) = LAMBDA[bin];
        if let Some(matrix) = matrix(&score.confusion, name) {
            text.push_str(&format!(
                "\nOne effect with λ {name}: cases by what is there (rows) and what is named (columns)\n{matrix}"
            ));
        }
    }
    let calibration = &score.calibration;
    let number = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |value| format!("{value:.3}"));
    text.push_str(&format!(
        "\nProbabilities: {} statements, ECE {}, Brier {}.\n",
        calibration.statements,
        number(calibration.ece),
        number(calibration.brier)
    ));
    if let Some(closure) = &score.closure {
        text.push_str(&format!(
            "Held-out gap closed over what one closes who knows the effects: median {}, mean {}, 90 % or more in {} ({} cases, each \
             effect known with λ ≥ 40; {} more in which who knows closes next to nothing).\n",
            percent(closure.median),
            percent(closure.mean),
            share(closure.nearly_all, closure.cases),
            closure.cases,
            closure.nothing_to_close
        ));
    }
    if !seconds.is_empty() {
        text.push_str(&format!(
            "Time per case: {:.4} s median, {:.4} s at most (cases side by side on all threads).\n",
            median(seconds.iter().copied()).unwrap_or_default(),
            seconds.iter().copied().fold(0.0, f64::max)
        ));
    }
    text.push_str(
        "λ: what geometry leaves of the effect, in squared sigmas of the declared noise. Named: probability of a half or more; \
         confidently: 0.95 or more. Right place: of those with the right kind. Shares are of the cases of their row.\n",
    );
    text
}

/// What becomes of the cases once the kinds that were withheld are put back.
fn restored(rows: &[Restored]) -> String {
    let kinds: std::collections::BTreeSet<&str> =
        rows.iter().map(|row| row.kind.as_str()).filter(|kind| ![ANY, NOT_THERE].contains(kind)).collect();
    let rms = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |value| format!("{:.1}", 1e6 * value));
    // Rows of a kind say nothing new where there is only one, nor does their sum where one bin has all of it.
    let again = |row: &Restored| {
        let same = |other: &Restored| other.kind == row.kind && other.lambda != row.lambda && other.cases == row.cases;
        kinds.len() < 2 || row.lambda == "all" && rows.iter().any(same)
    };
    let shown = rows.iter().filter(|row| row.kind == ANY || row.cases > 0 && (row.kind == NOT_THERE || !again(row)));
    let lines = shown.map(|row| {
        let closure = row.closure.as_ref();
        vec![
            match row.kind.as_str() {
                ANY => row.lambda.clone(),
                NOT_THERE => NOT_THERE.to_owned(),
                kind => format!("{kind}, {}", row.lambda),
            },
            row.cases.to_string(),
            row.right.map_or_else(|| "–".to_owned(), |right| share(right, row.cases)),
            share(row.wrong, row.cases),
            share(row.unknown, row.cases),
            percent(closure.and_then(|closure| closure.median)),
            percent(closure.and_then(|closure| closure.mean)),
            closure.map_or_else(|| "–".to_owned(), |closure| closure.cases.to_string()),
            match [row.geometry_rms_m, row.withheld_rms_m, row.restored_rms_m, row.noise_rms_m] {
                [None, None, None, None] => "–".to_owned(),
                chain => chain.map(rms).join(" → "),
            },
        ]
    });
    let header = [
        "put back",
        "cases",
        "right kind and place",
        "anything wrong",
        "still unknown",
        "gap closed",
        "mean",
        "of",
        "held out, µm",
    ];
    format!(
        "Withheld, then put back: {}\n{}\nGap closed: of what a diagnosis closes on held-out poses that is told the effects, median and mean \
         of so many cases; in the others\nit closes next to nothing, or something is outside the library. Held out: median RMS, geometry → \
         with what the library without the kind\nchose → with the kind back → noise. Of several effects in a case all withheld ones must be \
         right, the largest λ counts, and the gap is that of all.\n",
        kinds.iter().copied().collect::<Vec<_>>().join(", "),
        table(&header, lines.collect())
    )
}

/// Which kind was named for which in cases whose λ is in the bin `lambda`; kinds have numbers so that columns are narrow.
fn matrix(rows: &[Confusion], lambda: &str) -> Option<String> {
    let rows: Vec<&Confusion> = rows.iter().filter(|row| row.lambda == lambda).collect();
    let mut names: Vec<&str> = rows.iter().flat_map(|row| [row.truth.as_str(), row.named.as_str()]).collect();
    names.sort_unstable();
    names.dedup();
    // What is no kind stands last, in words.
    let (mut kinds, others): (Vec<&str>, Vec<&str>) =
        names.into_iter().partition(|name| !["unknown", "a set", "nothing"].contains(name));
    let numbered = kinds.len();
    kinds.extend(others);
    let mut header = vec!["there".to_owned()];
    header
        .extend(kinds.iter().enumerate().map(|(at, name)| if at < numbered { (at + 1).to_string() } else { (*name).to_owned() }));
    header.push("cases".to_owned());
    let count = |truth: &str, named: &str| {
        rows.iter().filter(|row| row.truth == truth && row.named == named).map(|row| row.cases).sum::<usize>()
    };
    let lines = kinds[..numbered].iter().enumerate().map(|(at, truth)| {
        let mut line = vec![format!("{} {truth}", at + 1)];
        line.extend(kinds.iter().map(|named| match count(truth, named) {
            0 => "·".to_owned(),
            cases => cases.to_string(),
        }));
        line.push(kinds.iter().map(|named| count(truth, named)).sum::<usize>().to_string());
        line
    });
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    (numbered > 0).then(|| table(&header, lines.collect()))
}

/// Which kind was named for which, for CSV.
///
/// # Errors
/// None that a text could cause.
pub fn confusion(rows: &[Confusion]) -> Result<Vec<u8>, csv::Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row)?;
    }
    writer.into_inner().map_err(|error| error.into_error().into())
}

/// Stated probability against the share that is true, with how often each was stated; and what is right by λ.
#[must_use]
pub fn figure(score: &Score) -> Figure {
    let calibration = &score.calibration;
    let points = calibration.reliability.iter().map(|bin| {
        let true_ones = libm::round(bin.true_share * bin.statements as f64) as usize;
        let interval = share_interval95(true_ones, bin.statements);
        Estimate { x: bin.stated, y: bin.true_share, x_interval: None, y_interval: Some(interval) }
    });
    let reliability =
        Panel::new(Axis::linear("stated probability").range(0.0, 1.0), Axis::linear("share that is true").range(0.0, 1.0))
            .titled("Reliability of the probabilities")
            .with(Series::new("", Kind::Diagonal).colour(Colour::Dark))
            .with(Series::new("with 95 % intervals", Kind::Estimates(points.collect())));
    let rows: Vec<&Single> = score.single.iter().filter(|row| row.cases > 0).collect();
    let shares = |get: &dyn Fn(&Single) -> usize| rows.iter().map(|row| 100.0 * get(row) as f64 / row.cases as f64).collect();
    let names = rows.iter().map(|row| format!("{} ({})", row.lambda, row.cases));
    let right = Panel::new(Axis::categories("λ (cases)", names), Axis::linear("cases (%)").range(0.0, 100.0))
        .titled("One effect")
        .with(Series::new("right kind", Kind::Bars(shares(&|row| row.right))))
        .with(Series::new("abstained", Kind::Bars(shares(&|row| row.abstained))))
        .with(Series::new("wrong kind", Kind::Bars(shares(&|row| row.wrong))));
    let stated = calibration.reliability.iter();
    let names = stated.clone().map(|bin| {
        let low = ((bin.stated * 10.0) as usize).min(9);
        format!("{:.1}–{:.1}", low as f64 / 10.0, (low + 1) as f64 / 10.0)
    });
    let counts = |get: &dyn Fn(f64, f64) -> f64| {
        stated.clone().map(|bin| get(bin.statements as f64, bin.statements as f64 * bin.true_share)).collect::<Vec<f64>>()
    };
    let counted = Panel::new(Axis::categories("stated probability", names), Axis::linear("statements").zero())
        .titled("How often each probability is stated")
        .with(Series::new("stated", Kind::Bars(counts(&|all, _| all))))
        .with(Series::new("true", Kind::Bars(counts(&|_, right| right))));
    Figure::new("Score of the diagnosis", 2).with(reliability).with(counted).with(right)
}
