//! Stated and measured minimum detectable magnitudes: a table and a figure.

use crate::figure::{Axis, Colour, Estimate, Figure, Kind, Panel, Series};
use crate::lab::challenge::power::{Curve, Report};
use crate::lab::injection::units;
use crate::report::table;
use crate::statistics::share_interval95;
use crate::units::number;

fn unit(curve: &Curve) -> (&'static str, f64) {
    units(curve.kind)[0]
}

fn place(curve: &Curve) -> String {
    let level = serde_json::to_value(curve.location.level).ok().and_then(|level| level.as_str().map(str::to_owned));
    let level = level.unwrap_or_default();
    curve.location.index.map_or_else(|| level.clone(), |index| format!("{level} {index}"))
}

/// The table.
#[must_use]
pub fn power(report: &Report) -> String {
    let range = |range: Option<[f64; 2]>, factor: f64| {
        range.map_or_else(String::new, |[low, high]| format!(" ({} … {})", number(low / factor), number(high / factor)))
    };
    let rows = report.curves.iter().map(|curve| {
        let (unit, factor) = unit(curve);
        let dash = || "–".to_owned();
        let named: Vec<String> =
            curve.levels.iter().map(|level| format!("{:.0}", 100.0 * level.named as f64 / level.trials.max(1) as f64)).collect();
        // What is named in its place, most often first.
        let mut instead: Vec<(&String, usize)> = Vec::new();
        for (name, count) in curve.levels.iter().flat_map(|level| &level.wrong) {
            match instead.iter_mut().find(|(known, _)| *known == name) {
                Some((_, sum)) => *sum += count,
                None => instead.push((name, *count)),
            }
        }
        instead.sort_by(|a, b| b.1.cmp(&a.1).then(a.0.cmp(b.0)));
        let words: Vec<String> = instead.iter().take(2).map(|(name, count)| format!("{count} {name}")).collect();
        vec![
            curve.kind.name().to_owned(),
            place(curve),
            unit.to_owned(),
            curve.stated.map_or_else(dash, |stated| number(stated / factor) + &range(curve.stated_range, factor)),
            curve.measured.map_or_else(dash, |measured| number(measured / factor) + &range(curve.interval95, factor)),
            curve.ratio().map_or_else(dash, |ratio| format!("{ratio:.2}")),
            if named.is_empty() { dash() } else { named.join(" ") },
            if words.is_empty() { dash() } else { words.join(", ") },
        ]
    });
    let header =
        ["kind", "at", "unit", "stated (80 % of sets)", "measured (95 %)", "measured / stated", "named (%)", "named besides"];
    let mut text = table(&header, rows.collect());
    let levels: Vec<String> = report.curves.iter().find(|curve| !curve.levels.is_empty()).map_or_else(Vec::new, |curve| {
        let stated = curve.stated.unwrap_or(1.0);
        curve.levels.iter().map(|level| format!("{:.2}", level.magnitude / stated)).collect()
    });
    let trials = report.curves.iter().flat_map(|curve| &curve.levels).map(|level| level.trials).max().unwrap_or(0);
    text.push_str(&format!(
        "\nStated: minimum detectable magnitude of {} sets without an effect, median; {} of them have an effect named.\n\
         Measured: magnitude that is named in 80 % of cells, right kind at the right place; logistic curve through {trials} cells at\n\
         each of {} times the stated one. {} readings, noise {} µm per axis.\n",
        report.sets,
        report.false_alarms,
        levels.join(", "),
        report.readings,
        number(report.noise_m * 1e6),
    ));
    text
}

/// How often an effect is named by its magnitude: a panel for every kind.
#[must_use]
pub fn figure(report: &Report) -> Figure {
    let mut figure = Figure::new("Is the stated minimum detectable magnitude true?", 2);
    for curve in &report.curves {
        let (unit, factor) = unit(curve);
        let points = curve.levels.iter().map(|level| Estimate {
            x: level.magnitude / factor,
            y: 100.0 * level.named as f64 / level.trials as f64,
            x_interval: None,
            y_interval: Some(share_interval95(level.named, level.trials).map(|end| 100.0 * end)),
        });
        let mut panel = Panel::new(Axis::linear(format!("magnitude ({unit})")), Axis::linear("named (%)").range(0.0, 100.0))
            .titled(format!("{}, {}", curve.kind.name(), place(curve)))
            .with(Series::new("80 %", Kind::Horizontal(80.0)).colour(Colour::Dark));
        if let (Some(stated), Some([a, b])) = (curve.stated, curve.logistic) {
            let ends = [curve.levels.first(), curve.levels.last()].map(|level| level.map_or(stated, |level| level.magnitude));
            let line = (0..=60).map(|step| {
                let x = ends[0] + (ends[1] - ends[0]) * f64::from(step) / 60.0;
                [x / factor, 100.0 / (1.0 + libm::exp(-(a + b * x / stated)))]
            });
            panel = panel.with(Series::new("logistic curve", Kind::Line(line.collect())));
        }
        panel = panel.with(Series::new("cells, 95 %", Kind::Estimates(points.collect())));
        if let Some(stated) = curve.stated {
            panel = panel.with(Series::new("stated", Kind::Dashed(vec![[stated / factor, 0.0], [stated / factor, 100.0]])));
        }
        figure = figure.with(panel);
    }
    figure
}
