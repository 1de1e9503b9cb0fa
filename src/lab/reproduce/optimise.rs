//! Chen et al. 2019, section V.C.2, Table 5 and Fig. 12: choosing a set, by the paper's swarm and by all other methods.
//!
//! First the swarm with the settings of Table 5 on O_C, under every scaling of the Jacobian. Then every method on O_C, I-optimality and
//! D-optimality with the budget of that swarm, and on the latter two with ten times as much. What they reach stands beside what
//! no set can go beyond.

use std::time::Instant;

use super::Experiment;
use super::bench::{Bench, Choice, MM, SCALINGS, choose, mean_of, plain};
use super::findings::{Claim, Data, Found, Tally};
use super::pictures::{end_points, in_workspace, reach};
use super::published::Published;
use crate::design::problem::{Criterion, Method};
use crate::design::search::SearchReport;
use crate::figure::{Axis, Figure, Kind, Panel, Series};
use crate::session::SessionError;

/// The experiment; a trial is a run of the swarm.
pub const EXPERIMENT: Experiment = Experiment {
    name: "optimise",
    place: "Table 5, Fig. 12",
    about: "the paper's swarm and other methods",
    trials: 5,
    work: run,
};

/// Budget of methods at leisure, in budgets of the swarm.
const LEISURE: u64 = 10;

/// Colours of the palette of figures.
const COLOURS: usize = 7;

/// A search that was made.
struct Searched {
    method: Method,
    criterion: Criterion,
    budget: u64,
    evaluations: u64,
    value: f64,
    /// Values of the criterion so far and the best of them.
    history: Vec<(u64, f64)>,
}

fn run(bench: &Bench<'_>, runs: usize) -> Result<Found, SessionError> {
    let published = Published::get().optimise;
    let (scene, arm) = (bench.scene, &bench.scene.arm);
    let (count, budget) = (scene.design.count, scene.design.swarm.evaluations());
    let searches = [
        (Criterion::Comprehensive, budget),
        (Criterion::IOptimality, budget),
        (Criterion::DOptimality, budget),
        (Criterion::IOptimality, LEISURE * budget),
        (Criterion::DOptimality, LEISURE * budget),
    ];
    bench.progress.begin("searching", SCALINGS.len() * runs + searches.len() * Method::ALL.len())?;

    let mut claims = Vec::new();
    let mut optima = Vec::new();
    for (scaling, name) in SCALINGS {
        let mut values = Vec::new();
        for number in 0..runs {
            // The first of the scene's own scaling is the optimum that other experiments use.
            let own = number == 0 && scaling == scene.design.jacobian_scaling;
            values.push(if own { bench.optimum()?.value } else { bench.swarm(scaling, number)?.value });
            bench.progress.done()?;
        }
        let mean = mean_of(values);
        optima.push(format!("{} under `{name}`", plain(mean, 4)));
        claims.push(Claim::new(format!("O_C of the swarm's optimum, scaling {name}"), Some(published.comprehensive), mean));
    }

    let models = bench.models()?;
    let mut searched = Vec::new();
    for (criterion, budget) in searches {
        for method in Method::ALL {
            let start = Instant::now();
            let mut history: Vec<(u64, f64)> = Vec::new();
            let mut watch = |told: SearchReport| {
                let now = match told {
                    SearchReport::Swarm(swarm) => (swarm.evaluations, swarm.personal_best[swarm.best_particle]),
                    SearchReport::Step(step) => (step.evaluations, step.best),
                };
                // Of a stretch without progress its ends say all.
                if let [.., (_, before), (spent, last)] = history.as_mut_slice()
                    && *before == now.1
                    && *last == now.1
                {
                    *spent = now.0;
                } else {
                    history.push(now);
                }
            };
            let choice = Choice { method, criterion, count, budget };
            let label = format!("optimise/{}/{}", criterion.name(), method.name());
            let (found, evaluations) = choose(scene, models, choice, &label, &mut watch)?;
            bench.progress.remark(format!(
                "  {}, {}, {budget} values: {:.2} s",
                criterion.name(),
                method.name(),
                start.elapsed().as_secs_f64()
            ))?;
            bench.progress.done()?;
            searched.push(Searched { method, criterion, budget, evaluations, value: found.value, history });
        }
    }
    // What no set of so many goes beyond, as the criterion's value.
    let limit = |criterion: Criterion| match criterion {
        Criterion::IOptimality => bench.limits.least_rms_m(scene, models, count).map(|least| -2.0 * libm::log(least)),
        Criterion::DOptimality => bench.limits.largest_d(scene, models, count),
        _ => None,
    };
    let readable = |criterion: Criterion, value: f64| readable(criterion, value, limit(criterion));
    let bound = |criterion: Criterion| limit(criterion).map(|limit| readable(criterion, limit));
    for search in &searched {
        let what = format!("{}, {}, {} values", name(criterion_kind(search.criterion)), search.method.name(), search.budget);
        let ours = readable(search.criterion, search.value);
        claims.push(Claim::single(what, None, Some(ours)).bounded(bound(search.criterion)));
    }

    let best = |criterion: Criterion, budget: u64| {
        let of = searched.iter().filter(|search| search.criterion == criterion && search.budget == budget);
        of.max_by(|a, b| a.value.total_cmp(&b.value))
    };
    let swarm = |criterion: Criterion| {
        searched.iter().find(|search| search.criterion == criterion && search.method == Method::Pso && search.budget == budget)
    };
    let efficiency = match (swarm(Criterion::IOptimality), best(Criterion::IOptimality, LEISURE * budget)) {
        (Some(swarm), Some(best)) => format!(
            "On the predicted position error the swarm reaches {:.4} mm where {} reaches {:.4} mm at leisure{}.",
            readable(Criterion::IOptimality, swarm.value),
            best.method.name(),
            readable(Criterion::IOptimality, best.value),
            bound(Criterion::IOptimality).map_or_else(String::new, |bound| format!(" and no set less than {bound:.4} mm")),
        ),
        _ => String::new(),
    };
    let equal = best(Criterion::Comprehensive, budget);
    let verdict = format!(
        "The swarm's O_C is {} (paper: {}): the printed value depends on a scaling that the paper does not tell. With the same budget \
         {} reaches the largest O_C, {:.4}, the swarm {:.4}. {efficiency}",
        optima.join(", "),
        published.comprehensive,
        equal.map_or("no method", |search| search.method.name()),
        equal.map_or(f64::NAN, |search| search.value),
        swarm(Criterion::Comprehensive).map_or(f64::NAN, |search| search.value),
    );
    let points = end_points(arm, &bench.optimum()?.configurations);
    Ok(Found {
        claims,
        verdict,
        notes: vec![
            format!("m = {count}; {runs} runs of the swarm for each scaling, one search for each method, criterion and budget."),
            "I-optimality is given as the position RMS over the workspace that noise lets expect, D-optimality as the r-th root of the \
             information's determinant over the largest that any set has (r parameters)."
                .to_owned(),
        ],
        fits: Tally::default(),
        data: vec![data(&searched, &limit), history(&searched)],
        figures: vec![
            ("optimise-convergence".to_owned(), figure(&arm.name, &searched, budget, &limit)),
            (
                "optimise-points".to_owned(),
                in_workspace(format!("{}: end points of the set optimal for O_C", arm.name), &reach(arm)?, "optimal set", &points),
            ),
        ],
    })
}

/// What a value of the criterion means for people: O_C, the predicted RMS in mm, or the efficiency in % (the determinant's root over
/// the largest, `limit`; the value itself where that is not known).
fn readable(criterion: Criterion, value: f64, limit: Option<f64>) -> f64 {
    match (criterion, limit) {
        (Criterion::IOptimality, _) => MM * libm::exp(-0.5 * value),
        (Criterion::DOptimality, Some(limit)) => 100.0 * libm::exp(value - limit),
        _ => value,
    }
}

fn criterion_kind(criterion: Criterion) -> usize {
    match criterion {
        Criterion::IOptimality => 1,
        Criterion::DOptimality => 2,
        _ => 0,
    }
}

fn name(kind: usize) -> &'static str {
    ["O_C", "I-optimality, RMS (mm)", "D-optimality, efficiency (%)"][kind]
}

type Limit<'l> = dyn Fn(Criterion) -> Option<f64> + 'l;

/// Best value against what it cost.
fn figure(arm: &str, searched: &[Searched], budget: u64, limit: &Limit<'_>) -> Figure {
    let mut figure = Figure::new(format!("{arm}: best value against values computed"), 2);
    let panels = [
        (Criterion::Comprehensive, budget, "(a) O_C"),
        (Criterion::IOptimality, budget, "(b) I-optimality"),
        (Criterion::DOptimality, budget, "(c) D-optimality"),
        (Criterion::IOptimality, LEISURE * budget, "(d) I-optimality at leisure"),
    ];
    for (criterion, budget, title) in panels {
        let label = ["O_C", "predicted position RMS (mm)", "D-efficiency (%)"][criterion_kind(criterion)];
        let shown = || searched.iter().filter(|search| search.criterion == criterion && search.budget == budget);
        let limit = limit(criterion);
        let mut axis = Axis::linear(label);
        let random = shown().find(|search| search.method == Method::Random);
        if let (Some(limit), Some(random)) = (limit, random) {
            // The poor beginnings of some methods would hide all the rest.
            let (best, usual) = (readable(criterion, limit, Some(limit)), readable(criterion, random.value, Some(limit)));
            let ends = [best - 0.1 * (usual - best), usual + 0.5 * (usual - best)];
            axis = axis.range(ends[0].min(ends[1]), ends[0].max(ends[1]));
        }
        let mut panel = Panel::new(Axis::log("values of the criterion"), axis).titled(title);
        for (number, search) in shown().enumerate() {
            let points: Vec<[f64; 2]> =
                search.history.iter().map(|(spent, best)| [(*spent).max(1) as f64, readable(criterion, *best, limit)]).collect();
            let kind = match points.len() {
                1 => Kind::Points(points),
                // The palette repeats.
                _ if number >= COLOURS => Kind::Dashed(points),
                _ => Kind::Line(points),
            };
            panel = panel.with(Series::new(search.method.name(), kind));
        }
        if let Some(limit) = limit {
            panel = panel.with(Series::new("no set goes beyond", Kind::Horizontal(readable(criterion, limit, Some(limit)))));
        }
        figure = figure.with(panel);
    }
    figure
}

fn data(searched: &[Searched], limit: &Limit<'_>) -> Data {
    let columns = ["criterion", "method", "budget", "evaluations", "value", "readable", "limit", "efficiency"];
    let rows = searched.iter().map(|search| {
        let limit = limit(search.criterion);
        // Ratio of the determinants' roots, or of the root mean squares.
        let power = if search.criterion == Criterion::IOptimality { 0.5 } else { 1.0 };
        let numbers = vec![
            search.budget as f64,
            search.evaluations as f64,
            search.value,
            readable(search.criterion, search.value, limit),
            limit.unwrap_or(f64::NAN),
            limit.map_or(f64::NAN, |limit| libm::exp(power * (search.value - limit))),
        ];
        (vec![search.criterion.name().to_owned(), search.method.name().to_owned()], numbers)
    });
    Data::labelled("optimise", &columns, rows.collect())
}

fn history(searched: &[Searched]) -> Data {
    let rows = searched.iter().flat_map(|search| {
        search.history.iter().map(|(spent, best)| {
            let labels = vec![search.criterion.name().to_owned(), search.method.name().to_owned()];
            (labels, vec![search.budget as f64, *spent as f64, *best])
        })
    });
    Data::labelled("optimise-history", &["criterion", "method", "budget", "evaluations", "best"], rows.collect())
}
