//! Chen et al. 2019, section V.C.1.a, Figs. 9 and 10: O1, O2, O3 and O_C against the number of configurations.
//!
//! Random sets are nested: that of m configurations is the first m of one draw. The paper does not say how the Jacobian is scaled; the
//! growth that it prints depends on that, so all three scalings are computed from the same configurations.

use super::Experiment;
use super::bench::{Bench, SCALINGS, fewest, mean_of, plain};
use super::findings::{Claim, Data, Found, Tally, with_ends};
use super::pictures::band;
use super::published::Published;
use crate::design::candidates::{Rules, Sampler};
use crate::design::objective::Models;
use crate::figure::{Axis, Colour, Figure, Kind, Marker, Panel, Series};
use crate::numerics::dense;
use crate::quality::evaluator::comprehensive;
use crate::quality::globality::dispersion;
use crate::quality::observability::observability;
use crate::seed::{derive, stream};
use crate::session::SessionError;
use crate::statistics::Mean;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "count-index",
    place: "Figs. 9 and 10",
    about: "indexes against the number of configurations",
    trials: 10,
    work: run,
};

/// The gradient of O_C at m is taken from m over this factor to m times it.
const GRADIENT: f64 = 1.25;
/// Names of the indexes, in the order in which they are kept.
const INDEXES: [&str; 4] = ["O1", "O2", "O3", "O_C"];

/// O1, O2, O3 and O_C under each scaling, for every m of one trial.
type Curve = Vec<[[f64; 4]; 3]>;

fn run(bench: &Bench<'_>, trials: usize) -> Result<Found, SessionError> {
    let published = Published::get().count_index;
    let arm = &bench.scene.arm;
    let models = [bench.models_scaled(SCALINGS[0].0)?, bench.models_scaled(SCALINGS[1].0)?, bench.models_scaled(SCALINGS[2].0)?];
    let rules = Rules::measurable(arm, &bench.scene.sensor);
    let [first, .., last] = published.configurations;
    let first = first.max(fewest(models[0]));
    let counts: Vec<usize> = (first..=last).collect();

    let curves: Vec<Curve> = bench.trials("indexes", trials, |number| {
        let seed = derive(bench.scene.seed, number as u64);
        let set = Sampler::new(&rules).draw(&mut stream(seed, "count-index"), last)?;
        Ok(curve(&models, &set, arm.joint_count(), first))
    })?;

    let at = |count: usize| count.max(first) - first;
    let mean = |scaling: usize, index: usize, count: usize| mean_of(curves.iter().map(|curve| curve[at(count)][scaling][index]));
    let growth = |scaling: usize, from: usize, to: usize| {
        mean_of(curves.iter().map(|curve| curve[at(to)][scaling][3] / curve[at(from)][scaling][3] - 1.0))
    };
    let mut claims = Vec::new();
    let mut misfit = [0.0; 3];
    for (scaling, (_, name)) in SCALINGS.iter().enumerate() {
        for (step, paper) in published.growth_percent.into_iter().enumerate() {
            let (from, to) = (published.configurations[step].max(first), published.configurations[step + 1]);
            let ours = growth(scaling, from, to);
            misfit[scaling] += ours.map_or(f64::INFINITY, |ours| {
                let ratio = libm::log1p(ours.mean) - libm::log1p(paper / 100.0);
                ratio * ratio
            });
            let what = format!("growth of O_C, m = {from} to {to}, {name} (%)");
            claims.push(Claim::new(what, Some(paper), ours.map(|ours| ours.times(100.0))));
        }
    }
    for (scaling, (_, name)) in SCALINGS.iter().enumerate() {
        for count in [first, 40.max(first), last] {
            claims.push(Claim::new(format!("O_C, m = {count}, {name}"), None, mean(scaling, 3, count)));
        }
    }

    let nearest = (0..3).fold(0, |best, scaling| if misfit[scaling] < misfit[best] { scaling } else { best });
    let told = |scaling: usize| {
        let parts = (0..3).map(|step| {
            let (from, to) = (published.configurations[step].max(first), published.configurations[step + 1]);
            plain(growth(scaling, from, to).map(|growth| growth.times(100.0)), 1)
        });
        parts.collect::<Vec<_>>().join(", ")
    };
    let [first_printed, second_printed, third_printed] = published.growth_percent;
    // A typical ratio between our growth factors and the printed ones.
    let off = libm::expm1((misfit[nearest] / 3.0).sqrt());
    let verdict = format!(
        "Of the three scalings `{}` comes nearest to the growth that the paper prints ({first_printed}, {second_printed}, \
         {third_printed} %): {} %, its factors off by {:.0} % on average; `{}` gives {} %, `{}` {} %.",
        SCALINGS[nearest].1,
        told(nearest),
        100.0 * off,
        SCALINGS[(nearest + 1) % 3].1,
        told((nearest + 1) % 3),
        SCALINGS[(nearest + 2) % 3].1,
        told((nearest + 2) % 3),
    );
    let mut notes = vec![
        format!("{trials} draws of {last} configurations, nested sets, every m from {first}; band: 95 % of the mean."),
        "A set under `per_pose` is the one under `si` with its singular values over √m.".to_owned(),
    ];
    if first > published.configurations[0] {
        notes.push(format!("The growth starts at m = {first}: fewer configurations do not determine the parameters."));
    }
    Ok(Found {
        claims,
        verdict,
        notes,
        fits: Tally::default(),
        data: vec![data(&counts, &mean)],
        figures: vec![
            ("count-index".to_owned(), index_figure(&arm.name, &counts, &mean)),
            ("count-index-growth".to_owned(), growth_figure(&arm.name, &counts, &mean, &published)),
        ],
    })
}

/// Indexes of the first `first`, `first` + 1, … of `set`.
fn curve(models: &[&Models; 3], set: &[f64], joint_count: usize, first: usize) -> Curve {
    let evaluator = &models[0].evaluator;
    let columns = evaluator.parameter_count();
    let (mut scratch, mut rows) = (Vec::new(), vec![0.0; evaluator.row_size()]);
    let mut gram = vec![0.0; columns * columns];
    let mut end_points = Vec::new();
    let mut curve = Vec::new();
    for joints in set.chunks_exact(joint_count) {
        end_points.push(evaluator.rows_into(joints, &mut scratch, &mut rows));
        dense::add_gram(&rows, 1.0, columns, &mut gram);
        if end_points.len() < first {
            continue;
        }
        let (d, u) = (dispersion(&end_points), evaluator.grid().evenness(&end_points));
        curve.push(models.map(|models| {
            let o = observability(&models.evaluator.singular_values(&gram, end_points.len()));
            [o.o1, o.o2, o.o3, comprehensive(d, u, [o.o1, o.o2, o.o3])]
        }));
    }
    curve
}

type MeanAt<'m> = dyn Fn(usize, usize, usize) -> Option<Mean> + 'm;

/// Fig. 9.
fn index_figure(arm: &str, counts: &[usize], mean: &MeanAt<'_>) -> Figure {
    let mut figure = Figure::new(format!("{arm}: indexes against the number of configurations"), 2);
    for (index, name) in INDEXES.iter().enumerate() {
        let y = if index == 3 { Axis::linear(*name) } else { Axis::log(*name) };
        let mut panel =
            Panel::new(Axis::log("number of configurations"), y).titled(format!("({}) {name}", ["a", "b", "c", "d"][index]));
        for (scaling, (_, label)) in SCALINGS.iter().enumerate() {
            let points = band(counts.iter().map(|count| (*count as f64, mean(scaling, index, *count))));
            panel = panel.with(Series::new(*label, points));
        }
        figure = figure.with(panel);
    }
    figure
}

/// Fig. 10: growth of O_C over its value at the first m, and its gradient.
fn growth_figure(arm: &str, counts: &[usize], mean: &MeanAt<'_>, published: &super::published::CountIndex) -> Figure {
    let value = |scaling: usize, count: usize| mean(scaling, 3, count).map_or(f64::NAN, |mean| mean.mean);
    let x = || Axis::log("number of configurations");
    let mut growth = Panel::new(x(), Axis::linear("O_C over its value at the first m (%)")).titled("(a) growth");
    let mut gradient = Panel::new(x(), Axis::log("gradient of O_C (per configuration)")).titled("(b) gradient");
    for (scaling, (_, label)) in SCALINGS.iter().enumerate() {
        let start = value(scaling, counts[0]);
        let points = counts.iter().map(|count| [*count as f64, 100.0 * (value(scaling, *count) / start - 1.0)]).collect();
        growth = growth.with(Series::new(*label, Kind::Line(points)));
        let [first, .., last] = counts else { continue };
        let steps = counts.iter().filter_map(|count| {
            let low = libm::round(*count as f64 / GRADIENT) as usize;
            let high = libm::round(*count as f64 * GRADIENT) as usize;
            let rise = (low >= *first && high <= *last && low < high).then(|| value(scaling, high) - value(scaling, low))?;
            Some([*count as f64, rise / (high - low) as f64])
        });
        gradient = gradient.with(Series::new(*label, Kind::Line(steps.collect())));
    }
    let mut factor = 1.0;
    let mut printed = vec![[published.configurations[0] as f64, 0.0]];
    for (count, percent) in published.configurations[1..].iter().zip(published.growth_percent) {
        factor *= 1.0 + percent / 100.0;
        printed.push([*count as f64, 100.0 * (factor - 1.0)]);
    }
    growth = growth.with(Series::new("paper", Kind::Points(printed)).colour(Colour::Dark).marker(Marker::Diamond));
    Figure::new(format!("{arm}: growth of O_C with the number of configurations"), 2).with(growth).with(gradient)
}

fn data(counts: &[usize], mean: &MeanAt<'_>) -> Data {
    let mut columns = vec!["m".to_owned()];
    for (_, scaling) in SCALINGS {
        for index in ["o1", "o2", "o3", "comprehensive"] {
            columns.extend(["", "_low", "_high"].map(|end| format!("{index}_{scaling}{end}")));
        }
    }
    let rows = counts.iter().map(|count| {
        let mut row = vec![*count as f64];
        for scaling in 0..3 {
            for index in 0..4 {
                row.extend(with_ends(mean(scaling, index, *count)));
            }
        }
        row
    });
    let columns: Vec<&str> = columns.iter().map(String::as_str).collect();
    Data::new("count-index", &columns, rows.collect())
}
