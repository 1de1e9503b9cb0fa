//! What a sweep found: a table for people, tables for CSV, and a figure.

use crate::effects;
use crate::figure::{Axis, Colour, Estimate, Figure, Kind, Panel, Series};
use crate::lab::injection::units;
use crate::lab::reproduce::findings::Data;
use crate::lab::sweep::grid::{AS_THE_SCENE, NOTHING};
use crate::lab::sweep::{Cell, CellSummary};
use crate::report::table;
use crate::statistics::Mean;
use crate::units::number;

/// One more axis of the grid.
struct Column {
    name: &'static str,
    get: fn(&Cell) -> String,
}

/// The conditions, which are shown where they vary.
const CONDITIONS: [Column; 6] = [
    Column { name: "m", get: |cell| cell.poses.to_string() },
    Column { name: "method", get: |cell| cell.method.name().to_owned() },
    Column { name: "approach", get: |cell| name_of(&cell.approach) },
    Column { name: "temperature", get: |cell| cell.temperature.clone() },
    Column { name: "payloads (kg)", get: |cell| payloads(&cell.payloads_kg) },
    Column { name: "repeats", get: |cell| cell.repeats.to_string() },
];

fn name_of(value: &impl serde::Serialize) -> String {
    serde_json::to_value(value).ok().and_then(|value| value.as_str().map(str::to_owned)).unwrap_or_default()
}

fn payloads(masses: &[f64]) -> String {
    masses.iter().map(ToString::to_string).collect::<Vec<_>>().join("+")
}

/// Conditions that differ between cells.
fn varying(cells: &[CellSummary]) -> Vec<&'static Column> {
    let varies = |column: &&Column| cells.iter().any(|cell| (column.get)(&cell.what) != (column.get)(&cells[0].what));
    CONDITIONS.iter().filter(varies).collect()
}

/// A mean with its interval, in another unit.
fn with_interval(mean: Option<Mean>, factor: f64, digits: usize) -> String {
    match mean.map(|mean| mean.times(factor)) {
        Some(Mean { mean, interval95: Some([low, high]), .. }) => format!("{mean:.digits$} ({low:.digits$} … {high:.digits$})"),
        Some(Mean { mean, .. }) => format!("{mean:.digits$}"),
        None => "–".to_owned(),
    }
}

/// The coverage of the combination whose intervals hold the truth least often.
fn lowest(cell: &CellSummary) -> Option<f64> {
    cell.combinations.iter().map(|combination| combination.coverage).min_by(f64::total_cmp)
}

/// The table.
#[must_use]
pub fn sweep(cells: &[CellSummary]) -> String {
    let columns = varying(cells);
    let mut header = vec!["effect", "at", "magnitude"];
    header.extend(columns.iter().map(|column| column.name));
    header.extend([
        "held out (µm)",
        "effect (µm)",
        "swallowed (%)",
        "largest bias",
        "in σ",
        "all in σ",
        "coverage (%)",
        "lowest (%)",
        "residuals",
    ]);
    let rows = cells
        .iter()
        .map(|cell| {
            let mut row = vec![cell.what.effect.clone(), cell.what.place_written(), cell.what.magnitude_written()];
            row.extend(columns.iter().map(|column| (column.get)(&cell.what)));
            let worst = cell
                .combinations
                .iter()
                .max_by(|a, b| a.bias_in_standard_errors.abs().total_cmp(&b.bias_in_standard_errors.abs()));
            let plain = |mean: Option<Mean>, factor: f64, digits: usize| {
                mean.map_or_else(|| "–".to_owned(), |mean| format!("{:.digits$}", factor * mean.mean))
            };
            row.extend([
                with_interval(cell.held_out_m, 1e6, 1),
                plain(cell.displacement_m, 1e6, 1),
                plain(cell.swallowed, 100.0, 0),
                worst.map_or_else(
                    || "–".to_owned(),
                    |worst| format!("{} {} µ{}", worst.name, number(1e6 * worst.bias.mean), worst.unit),
                ),
                worst.map_or_else(|| "–".to_owned(), |worst| format!("{:.2}", worst.bias_in_standard_errors)),
                cell.bias_in_standard_errors.map_or_else(|| "–".to_owned(), |bias| format!("{bias:.2}")),
                with_interval(cell.coverage, 100.0, 1),
                lowest(cell).map_or_else(|| "–".to_owned(), |lowest| format!("{:.0}", 100.0 * lowest)),
                plain(cell.residual_scale, 1.0, 2),
            ]);
            row
        })
        .collect();
    let mut text = table(&header, rows);
    let first = &cells[0].what;
    let fixed: Vec<String> = CONDITIONS
        .iter()
        .filter(|column| !columns.iter().any(|other| other.name == column.name))
        .map(|column| format!("{} {}", column.name, (column.get)(first)))
        .collect();
    text.push_str(&format!(
        "\nIn all cells: {}. {} trials each; in brackets 95 % intervals of the means over trials.\n\
         Held out: position error of the calibrated arm on configurations that were not fitted, RMS, sensor noise included.\n\
         Effect: how far it moves the fitted positions, RMS. Swallowed: share of its energy (in sigmas) that the fitted geometry absorbs.\n\
         Bias: identified minus true value of a combination, mean over trials; in σ: over its mean stated standard error; all: RMS over \
         combinations.\n\
         Coverage: share of the stated 95 % intervals of the combinations that hold the true value; lowest: of one combination. Residuals: over the declared noise.\n",
        fixed.join(", "),
        cells[0].trials
    ));
    let lost: usize = cells.iter().map(|cell| cell.not_converged).sum();
    if lost > 0 {
        text.push_str(&format!("{lost} fits did not converge and are in no mean.\n"));
    }
    text
}

fn labels(cell: &CellSummary) -> Vec<String> {
    let mut labels = vec![
        cell.cell.to_string(),
        cell.what.effect.clone(),
        cell.what.location.map_or_else(String::new, |location| name_of(&location.level)),
        cell.what.location.and_then(|location| location.index).map_or_else(String::new, |index| index.to_string()),
        cell.what.magnitude.to_string(),
        cell.what.unit.clone(),
    ];
    labels.extend(CONDITIONS.iter().map(|column| (column.get)(&cell.what)));
    labels
}

const LABELS: [&str; 12] = [
    "cell",
    "effect",
    "level",
    "index",
    "magnitude",
    "unit",
    "poses",
    "method",
    "approach",
    "temperature",
    "payloads_kg",
    "repeats",
];

/// The cells, and the combinations of every cell, for CSV; SI.
#[must_use]
pub fn data(cells: &[CellSummary]) -> [Data; 2] {
    let three = |mean: Option<Mean>| {
        let [low, high] = mean.and_then(|mean| mean.interval95).unwrap_or([f64::NAN; 2]);
        [mean.map_or(f64::NAN, |mean| mean.mean), low, high]
    };
    let rows = cells.iter().map(|cell| {
        let mut numbers = vec![cell.trials as f64, cell.not_converged as f64, cell.rank[0] as f64, cell.rank[1] as f64];
        for mean in [
            cell.held_out_m,
            cell.held_out_rad,
            cell.residual_scale,
            cell.displacement_m,
            cell.swallowed,
            cell.lambda,
            cell.coverage,
        ] {
            numbers.extend(three(mean));
        }
        numbers.push(cell.bias_in_standard_errors.unwrap_or(f64::NAN));
        (labels(cell), numbers)
    });
    let mut columns: Vec<String> = LABELS.iter().map(|name| (*name).to_owned()).collect();
    columns.extend(["trials", "not_converged", "rank_min", "rank_max"].map(str::to_owned));
    for name in ["held_out_rms_m", "held_out_rms_rad", "residuals_over_noise", "effect_rms_m", "swallowed", "lambda", "coverage"]
    {
        columns.extend([name.to_owned(), format!("{name}_low95"), format!("{name}_high95")]);
    }
    columns.push("bias_rms_in_standard_errors".to_owned());
    let columns: Vec<&str> = columns.iter().map(String::as_str).collect();
    let table = Data::labelled("cells", &columns, rows.collect());

    let rows = cells.iter().flat_map(|cell| {
        cell.combinations.iter().map(|combination| {
            let mut labels = labels(cell);
            labels.extend([combination.name.clone(), combination.unit.clone()]);
            let [bias, low, high] = three(Some(combination.bias));
            let numbers = vec![
                bias,
                low,
                high,
                combination.standard_error,
                combination.bias_in_standard_errors,
                combination.scatter,
                combination.coverage,
            ];
            (labels, numbers)
        })
    });
    let mut columns = LABELS.to_vec();
    columns.extend([
        "combination",
        "combination_unit",
        "bias",
        "bias_low95",
        "bias_high95",
        "standard_error",
        "bias_in_standard_errors",
        "scatter",
        "coverage",
    ]);
    [table, Data::labelled("combinations", &columns, rows.collect())]
}

/// Held-out error, what geometry swallows, bias and coverage against magnitude, a line for every place and every set of conditions.
/// Cells without an effect are the zero of every line.
#[must_use]
pub fn figure(scene: &str, cells: &[CellSummary]) -> Figure {
    let columns = varying(cells);
    let conditions = |cell: &Cell| columns.iter().map(|column| (column.get)(cell)).collect::<Vec<_>>();
    let mut lines: Vec<(String, Vec<&CellSummary>)> = Vec::new();
    let single = cells.iter().filter(|cell| cell.what.location.is_some()).all(|cell| {
        Some(cell.what.effect.as_str())
            == cells.iter().find(|cell| cell.what.location.is_some()).map(|cell| cell.what.effect.as_str())
    });
    for cell in cells.iter().filter(|cell| cell.what.effect != NOTHING) {
        let mut parts = Vec::new();
        if !single || cell.what.effect == AS_THE_SCENE {
            parts.push(cell.what.effect.clone());
        }
        parts.extend(cell.what.location.map(crate::lab::sweep::grid::place_written));
        parts.extend(columns.iter().map(|column| format!("{} {}", column.name, (column.get)(&cell.what))));
        let name = parts.join(", ");
        match lines.iter_mut().find(|(other, _)| *other == name) {
            Some((_, line)) => line.push(cell),
            None => {
                let zero = cells.iter().find(|zero| {
                    zero.what.effect == NOTHING
                        && conditions(&zero.what) == conditions(&cell.what)
                        && cell.what.effect != AS_THE_SCENE
                });
                lines.push((name, zero.into_iter().chain([cell]).collect()));
            }
        }
    }
    if lines.is_empty() {
        lines = cells.iter().map(|cell| (conditions(&cell.what).join(", "), vec![cell])).collect();
    }
    let injected = cells.iter().find_map(|cell| effects::Kind::from_name(&cell.what.effect)).filter(|_| single);
    let (unit, factor) = injected.map_or(("SI", 1.0), |kind| units(kind)[0]);
    let x = || {
        let what = injected.map_or("magnitude".to_owned(), |kind| kind.name().replace('_', " "));
        Axis::linear(format!("{what} ({unit})")).zero()
    };
    let panel = |title: &str, y: Axis, get: &dyn Fn(&CellSummary) -> Option<Mean>, bound: Option<f64>| {
        let mut panel = Panel::new(x(), y).titled(title);
        for (name, line) in &lines {
            let estimates = line.iter().filter_map(|cell| {
                let mean = get(cell)?;
                Some(Estimate { x: cell.what.magnitude / factor, y: mean.mean, x_interval: None, y_interval: mean.interval95 })
            });
            panel = panel.with(Series::new(name.clone(), Kind::Estimates(estimates.collect())));
        }
        match bound {
            Some(bound) => panel.with(Series::new("", Kind::Horizontal(bound)).colour(Colour::Dark)),
            None => panel,
        }
    };
    let plain = |mean: f64| Mean { mean, interval95: None, trials: 0 };
    Figure::new(format!("Sweep of {scene}: what un-modelled effects do to a calibration"), 2)
        .with(panel(
            "Held out",
            Axis::linear("position error, RMS (µm)").zero(),
            &|cell| cell.held_out_m.map(|mean| mean.times(1e6)),
            None,
        ))
        .with(panel(
            "Swallowed by geometry",
            Axis::linear("share of the effect (%)").range(0.0, 100.0),
            &|cell| cell.swallowed.map(|mean| mean.times(100.0)),
            None,
        ))
        .with(panel(
            "Bias of the identified combinations",
            Axis::linear("mean error / std error, RMS").zero(),
            &|cell| cell.bias_in_standard_errors.map(plain),
            None,
        ))
        .with(panel(
            "Coverage of the stated 95 % intervals",
            Axis::linear("hold the true value (%)"),
            &|cell| cell.coverage.map(|mean| mean.times(100.0)),
            Some(95.0),
        ))
}
