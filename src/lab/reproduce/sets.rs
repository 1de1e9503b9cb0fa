//! Chen et al. 2019, section V.C.2.a, Table 6 and Figs. 13–15: dispersion, evenness and O_C of the optimal set against random sets.

use super::Experiment;
use super::bench::{Bench, mean_of};
use super::findings::{Claim, Data, Found, Tally};
use crate::design::candidates::{Rules, Sampler};
use crate::figure::{Axis, Colour, Figure, Kind, Marker, Panel, Series};
use crate::quality::Indexes;
use crate::quality::evaluator::Scratch;
use crate::seed::{derive, stream};
use crate::session::SessionError;

/// The experiment; a trial is a random set.
pub const EXPERIMENT: Experiment = Experiment {
    name: "sets",
    place: "Table 6, Figs. 13–15",
    about: "the optimal set's indexes among random sets'",
    trials: 500,
    work: run,
};

type Get = fn(&Indexes) -> f64;

/// Index, its axis, and the paper's figure.
const INDEXES: [(&str, &str, Get); 3] = [
    ("dispersion D (m²)", "Fig. 13", |indexes| indexes.dispersion_m2),
    ("evenness U", "Fig. 14", |indexes| indexes.evenness),
    ("O_C", "Fig. 15", |indexes| indexes.comprehensive),
];

fn run(bench: &Bench<'_>, sets: usize) -> Result<Found, SessionError> {
    let (scene, arm, models) = (bench.scene, &bench.scene.arm, bench.models()?);
    let count = scene.design.count;
    let rules = Rules::measurable(arm, &scene.sensor);
    let random: Vec<(Indexes, f64)> = bench.trials("random sets", sets, |number| {
        let seed = derive(scene.seed, number as u64);
        let set = Sampler::new(&rules).draw(&mut stream(seed, "sets"), count)?;
        let predicted = models.predict(&set, arm.joint_count()).map_or(f64::NAN, |found| 1e3 * found.position_rms_m);
        Ok((models.evaluator.evaluate(&set, &mut Scratch::default()), predicted))
    })?;
    let chosen = bench.optimum()?;
    let optimum = models.evaluator.evaluate(&chosen.configurations, &mut Scratch::default());
    let predicted = models.predict(&chosen.configurations, arm.joint_count()).map(|found| 1e3 * found.position_rms_m);

    let mut claims = Vec::new();
    let mut above = Vec::new();
    let mut add = |name: &str, optimum: Option<f64>, values: &[f64], larger_is_better: bool| {
        let mean = mean_of(values.iter().copied());
        let best = |value: f64, than: f64| if larger_is_better { value > than } else { value < than };
        let better =
            optimum.map(|optimum| values.iter().filter(|value| best(**value, optimum)).count() as f64 / values.len() as f64);
        claims.push(Claim::single(format!("{name}, optimal set"), None, optimum));
        claims.push(Claim::new(format!("{name}, random sets, mean"), None, mean));
        claims.push(Claim::single(format!("{name}, random sets, min"), None, values.iter().copied().reduce(f64::min)));
        claims.push(Claim::single(format!("{name}, random sets, max"), None, values.iter().copied().reduce(f64::max)));
        claims.push(Claim::single(
            format!("{name}, random sets better than the optimal (%)"),
            None,
            better.map(|share| 100.0 * share),
        ));
        let holds = optimum.zip(mean).is_some_and(|(optimum, mean)| best(optimum, mean.mean));
        above.push((holds, optimum.unwrap_or(f64::NAN), mean.map_or(f64::NAN, |mean| mean.mean), better.unwrap_or(f64::NAN)));
    };
    for (name, _, get) in INDEXES {
        add(name, Some(get(&optimum)), &random.iter().map(|(indexes, _)| get(indexes)).collect::<Vec<_>>(), true);
    }
    let errors: Vec<f64> = random.iter().map(|(_, predicted)| *predicted).collect();
    add("position RMS predicted from noise (mm)", predicted, &errors, false);

    let all = above[..3].iter().all(|(holds, ..)| *holds);
    let (_, optimal_error, random_error, better) = above[3];
    let verdict = format!(
        "That D, U and O_C of the optimal set are above the random means {} (D {:.3} and {:.3}, U {:.3} and {:.3}, O_C {:.3} and \
         {:.3}); the position error that noise lets expect is {:.3} mm with it and {:.3} mm with random sets, {:.0} % of which are \
         better.",
        if all { "holds" } else { "does not hold" },
        above[0].1,
        above[0].2,
        above[1].1,
        above[1].2,
        above[2].1,
        above[2].2,
        optimal_error,
        random_error,
        100.0 * better,
    );
    let rows = random.iter().enumerate().map(|(number, (indexes, predicted))| {
        let mut row = vec![number as f64 + 1.0];
        row.extend(INDEXES.map(|(_, _, get)| get(indexes)));
        row.push(*predicted);
        row
    });
    let columns = ["set", "dispersion_m2", "evenness", "comprehensive", "position_rms_predicted_mm"];
    Ok(Found {
        claims,
        verdict,
        notes: vec![format!(
            "{sets} random sets of {count}; the optimal set is that of the paper's swarm on O_C. Of Table 6 no number survives."
        )],
        fits: Tally::default(),
        data: vec![Data::new("sets", &columns, rows.collect())],
        figures: vec![("sets".to_owned(), figure(&arm.name, &random, &optimum, &errors, predicted))],
    })
}

fn figure(arm: &str, random: &[(Indexes, f64)], optimum: &Indexes, errors: &[f64], predicted: Option<f64>) -> Figure {
    let panel = |title: String, label: &str, values: Vec<f64>, optimum: Option<f64>| {
        let points = values.iter().enumerate().map(|(number, value)| [number as f64 + 1.0, *value]).collect();
        let panel = Panel::new(Axis::linear("random set"), Axis::linear(label))
            .titled(title)
            .with(Series::new("random sets", Kind::Points(points)).marker(Marker::Dot).colour(Colour::Palette(0)));
        match optimum {
            Some(optimum) => panel.with(Series::new("optimal set", Kind::Horizontal(optimum)).colour(Colour::Palette(1))),
            None => panel,
        }
    };
    let mut figure = Figure::new(format!("{arm}: indexes of random sets and of the set optimal for O_C"), 2);
    for (letter, (name, place, get)) in ["a", "b", "c"].into_iter().zip(INDEXES) {
        let values = random.iter().map(|(indexes, _)| get(indexes)).collect();
        figure = figure.with(panel(format!("({letter}) {place}"), name, values, Some(get(optimum))));
    }
    figure.with(panel("(d) not in the paper".to_owned(), "predicted position RMS (mm)", errors.to_vec(), predicted))
}
