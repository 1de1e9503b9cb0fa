//! Results as tables and figures for people. Units are in the headers; machines get the same results as JSON.

pub mod diagnosis;

mod advice;
pub mod criterion;
pub mod wording;

use comfy_table::{Cell, CellAlignment, LineStyle, Table, TableStyle};

use crate::design::outcome::{DesignOutcome, StopReason};
use crate::identification::ladder::Rung;
use crate::identification::outcome::{Deviation, Errors, Identification, JointFrame, Summary};
use crate::quality::Indexes;
use crate::quality::JacobianScaling;
use crate::units::number;
use criterion::Words;

/// Lines above and below, and one under the header.
const STYLE: TableStyle = TableStyle::new()
    .top_border(LineStyle::none().fill('─').junction('─'))
    .header_separator(LineStyle::none().fill('─').junction('─'))
    .bottom_border(LineStyle::none().fill('─').junction('─'));

/// A table whose first column is text and whose others are numbers.
pub(crate) fn table(header: &[&str], rows: Vec<Vec<String>>) -> String {
    let mut table = Table::new();
    table.load_style(STYLE).set_header(header.iter().enumerate().map(|(column, name)| cell(column, name)));
    for row in rows {
        table.add_row(row.iter().enumerate().map(|(column, text)| cell(column, text)));
    }
    table.to_string()
}

fn cell(column: usize, text: &str) -> Cell {
    let alignment = if column == 0 { CellAlignment::Left } else { CellAlignment::Right };
    Cell::new(text).set_alignment(alignment)
}

/// Indexes of the chosen set beside random sets of the same size.
#[must_use]
pub fn design(outcome: &DesignOutcome, parameter_count: usize, scaling: JacobianScaling) -> String {
    let scaling = match scaling {
        JacobianScaling::Si => "none, m and rad",
        JacobianScaling::PerPose => "per pose, m and rad over √m",
        JacobianScaling::Columns => "columns of length one",
    };
    let atan = |value: f64| std::f64::consts::FRAC_2_PI * libm::atan(value);
    let row = |name: &str, get: &dyn Fn(&Indexes) -> f64| {
        let random = &outcome.random;
        vec![
            name.to_owned(),
            number(get(&random.mean)),
            format!("{} … {}", number(get(&random.min)), number(get(&random.max))),
            number(get(&outcome.indexes)),
            number(get(&outcome.indexes_all_parameters)),
        ]
    };
    let rows = vec![
        row("O_C, comprehensive (eq. 27)", &|i| i.comprehensive),
        row("  O1 part, 2/π·atan O1", &|i| atan(i.o1)),
        row("  O2 part", &|i| atan(i.o2)),
        row("  O3 part", &|i| atan(i.o3)),
        row("  D part", &|i| atan(i.dispersion_m2)),
        row("  U part", &|i| atan(i.evenness)),
        row("O1, mean of singular values", &|i| i.o1),
        row("O2, inverse condition number", &|i| i.o2),
        row("O3, smallest singular value", &|i| i.o3),
        row("O4, noise amplification", &|i| i.o4),
        row("O5, A-optimality", &|i| i.o5),
        row("O6, Φp-optimality", &|i| i.o6),
        row("D, dispersion (m²)", &|i| i.dispersion_m2),
        row("U, evenness", &|i| i.evenness),
    ];
    let all = format!("chosen, all {parameter_count}");
    let random = format!("random, mean of {}", outcome.random.sets);
    let mut text = table(&["index", &random, "min … max", "chosen", &all], rows);
    let dropped = if outcome.dropped_parameters.is_empty() { "none".to_owned() } else { outcome.dropped_parameters.join(", ") };
    text.push_str(&format!(
        "\n{} configurations by {} on {}: {}.\n\
         {} evaluations of the criterion; {} configurations refused (they collide or the sensor does not see them); stopped: {}.\n\
         Identifiable: {} of {parameter_count} parameters; held at nominal: {dropped}.\n\
         Singular values are of the Jacobian (scaling: {scaling}) on the identifiable subspace; the last column counts all \
         {parameter_count}.\n\
         Evenness: reachable workspace {:.3}, bounding cube {:.3}.\n",
        outcome.configurations.len(),
        outcome.method,
        outcome.criterion,
        Words::of(&outcome.criterion).value(outcome.value),
        outcome.evaluations,
        outcome.rejections,
        stop(outcome.stop),
        outcome.indexes.rank,
        outcome.evenness_domains.reachable,
        outcome.evenness_domains.bounding_cube,
    ));
    if let Some(reason) = &outcome.no_advice {
        text.push_str(&format!("Whether choosing pays cannot be told: {reason}.\n"));
    }
    if let Some(advice) = &outcome.advice {
        text.push_str(&advice::section(outcome, advice));
    }
    text
}

fn stop(reason: StopReason) -> &'static str {
    match reason {
        StopReason::IterationLimit => "all iterations made",
        StopReason::Converged => "no particle moved any more",
        StopReason::Drawn => "drawn once",
        StopReason::BudgetSpent => "budget spent",
    }
}

/// How the poses settled in the simulator.
#[cfg(feature = "simulator")]
pub struct SettlingReport {
    /// Poses that settled within the tolerances.
    pub settled: usize,
    /// A line for people.
    pub text: String,
}

/// Tells how the poses of a run settled.
#[cfg(feature = "simulator")]
#[must_use]
pub fn settling(truth: &crate::simulation::cell::Truth) -> SettlingReport {
    let poses = &truth.poses;
    let settled = poses.iter().filter(|pose| pose.settled).count();
    let worst = poses.iter().map(|pose| pose.settling_error_m).fold(0.0, f64::max);
    let steps: usize = poses.iter().map(|pose| pose.settling_steps).sum();
    let undecided = poses.iter().filter(|pose| pose.seats.iter().any(|seat| !seat.undecided.is_empty())).count();
    let count = poses.len();
    let mut text = format!(
        "{count} poses simulated, {settled} settled; largest settling error {:.4} µm, {:.1} steps per pose",
        worst * 1e6,
        steps as f64 / count.max(1) as f64
    );
    if undecided > 0 {
        text.push_str(&format!(
            ";\nplay that no load decides (such as along a level axis) rests in its middle: somewhere in {undecided} of them"
        ));
    }
    text.push_str(".\n");
    SettlingReport { settled, text }
}

/// Errors before and after, and how the fit went.
#[must_use]
pub fn identification(identification: &Identification) -> String {
    let mut rows = Vec::new();
    let mut add = |name: &str, before: Option<&Errors>, after: Option<&Errors>| {
        for (label, errors) in [("nominal", before), ("identified", after)] {
            let Some(errors) = errors else { continue };
            rows.push(error_row(&format!("{name} ({}), {label}", errors.count), errors));
        }
    };
    add("fitted", Some(&identification.nominal), Some(&identification.fitted));
    add("held out", identification.held_out_nominal.as_ref(), identification.held_out.as_ref());
    let header =
        ["configurations, model", "position mean (mm)", "RMS", "min", "max", "orientation mean (°)", "RMS", "min", "max"];
    let mut text = table(&header, rows);
    let dropped = identification.parameters.iter().filter(|parameter| parameter.dropped).count();
    text.push_str(&format!(
        "\n{} after {} steps ({}). Rank {} of {} parameters, {dropped} held at nominal; {} equations{}.\n",
        if identification.converged { "Converged" } else { "NOT CONVERGED" },
        identification.iterations,
        identification.reason,
        identification.rank,
        identification.parameters.len(),
        identification.equations,
        identification
            .residual_scale
            .filter(|_| !identification.noise_estimated)
            .map(|scale| format!("; residuals {scale:.2} × declared noise"))
            .unwrap_or_default(),
    ));
    let noise = &identification.declared_noise;
    if noise.position_m > 0.0 {
        text.push_str(&format!(
            "Of every error above, {} mm RMS is the {} noise of the reading itself",
            number(noise.position_m * 1e3),
            if identification.noise_estimated { "estimated" } else { "declared" }
        ));
        match noise.rotation_rad {
            Some(rotation) if rotation > 0.0 => text.push_str(&format!(" ({}°).\n", number(rotation.to_degrees()))),
            _ => text.push_str(".\n"),
        }
    }
    let held: Vec<&str> =
        identification.parameters.iter().filter(|parameter| parameter.dropped).map(|parameter| parameter.name.as_str()).collect();
    // A real arm's file has parameters that base and target stand in for, always the same.
    if !held.is_empty() && identification.ladder.is_empty() {
        text.push_str(&format!("Held at nominal: {}.\n", held.join(", ")));
    }
    if !identification.ladder.is_empty() {
        text.push_str(&format!("\n{}\n", ladder(&identification.ladder)));
    }
    for note in &identification.notes {
        text.push_str(&format!("Note: {note}{}\n", if note.ends_with('?') { "" } else { "." }));
    }
    text
}

/// How much of the arm was let loose, and what that is worth on readings that were left out.
fn ladder(rungs: &[Rung]) -> String {
    let row = |rung: &Rung| {
        vec![
            rung.free.words().to_owned(),
            number(rung.left_out_m * 1e3),
            rung.left_out_rad.map_or_else(|| "–".to_owned(), |angle| number(angle.to_degrees())),
            if rung.chosen { "taken" } else { "" }.to_owned(),
        ]
    };
    table(&["let loose", "RMS on readings left out (mm)", "orientation (°)", ""], rungs.iter().map(row).collect())
}

/// How far each joint's frame is off, with standard errors.
#[must_use]
pub fn joint_frames(identification: &Identification) -> String {
    let told = |of: Option<&Deviation>, factor: f64| match of {
        Some(of) if of.estimate == 0.0 && of.standard_error == 0.0 => "held".to_owned(),
        Some(of) => format!("{:.3} ± {:.3}", of.estimate * factor, of.standard_error * factor),
        None => "–".to_owned(),
    };
    let row = |joint: &JointFrame| {
        let (factor, unit) = if joint.zero_unit == "rad" { (1f64.to_degrees(), "°") } else { (1e3, " mm") };
        let degrees = 1f64.to_degrees();
        vec![
            joint.joint.clone(),
            format!("{}{unit}", told(Some(&joint.zero), factor)),
            told(joint.shift_m.first(), 1e3),
            told(joint.shift_m.get(1), 1e3),
            told(joint.shift_m.get(2), 1e3),
            told(joint.turn_rad.first(), degrees),
            told(joint.turn_rad.get(1), degrees),
        ]
    };
    let header = ["joint, axis along z", "zero", "x (mm)", "y (mm)", "z (mm)", "about x (°)", "about y (°)"];
    format!(
        "{}\nWhat each joint's frame is off its file, with standard errors; of errors that these readings cannot tell apart, the likeliest.\n\
         The zero is what must be added to the reading.\n",
        table(&header, identification.joint_frames.iter().map(row).collect())
    )
}

fn error_row(name: &str, errors: &Errors) -> Vec<String> {
    let mut row = vec![name.to_owned()];
    let mut add = |summary: &Summary, factor: f64| {
        row.extend([summary.mean, summary.rms, summary.min, summary.max].map(|value| number(value * factor)));
    };
    add(&errors.position_m, 1e3);
    match &errors.rotation_rad {
        Some(summary) => add(summary, 180.0 / std::f64::consts::PI),
        None => row.extend((0..4).map(|_| "–".to_owned())),
    }
    row
}

/// Every identifiable combination with its estimate and 95 % interval, in µm and µrad.
#[must_use]
pub fn combinations(identification: &Identification) -> String {
    let rows = identification
        .combinations
        .iter()
        .map(|combination| {
            let unit = if combination.unit == "m" { "µm" } else { "µrad" };
            let micro = |value: f64| format!("{:.2}", value * 1e6);
            vec![
                combination.expression.clone(),
                unit.to_owned(),
                micro(combination.estimate),
                micro(combination.standard_error),
                micro(combination.interval95[0]),
                micro(combination.interval95[1]),
            ]
        })
        .collect();
    table(&["identifiable combination", "unit", "change", "standard error", "95 % from", "to"], rows)
}
