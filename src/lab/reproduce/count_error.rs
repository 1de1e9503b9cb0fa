//! Chen et al. 2019, section V.C.1.b, Table 4 and Fig. 11: held-out error against the number of configurations.
//!
//! Random sets, nested within a trial. Beside the fits stands what their noise lets expect (first order, no fit), and the least that
//! any choice of as many configurations can leave.

use super::Experiment;
use super::bench::{Bench, DEG, Fit, MM, fewest, mean, mean_of, orientation, plain, tally};
use super::findings::{Claim, Data, Found, with_ends};
use super::pictures::band;
use super::published::Published;
use crate::design::candidates::{Rules, Sampler};
use crate::figure::{Axis, Colour, Figure, Kind, Marker, Panel, Series};
use crate::lab::trial::Trial;
use crate::quality::prediction::Prediction;
use crate::seed::stream;
use crate::session::SessionError;
use crate::statistics::{Mean, nearest_rank};

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "count-error",
    place: "Table 4, Fig. 11",
    about: "held-out error against the number of configurations",
    trials: 100,
    work: run,
};

/// Numbers of configurations beside those of the table, in equal ratios.
const BETWEEN: usize = 13;
/// From here on the error should fall with the root of m.
const SLOPE_FROM: usize = 20;

/// A number of configurations in one trial.
struct Point {
    fit: Fit,
    predicted: Option<Prediction>,
}

fn run(bench: &Bench<'_>, trials: usize) -> Result<Found, SessionError> {
    let published = Published::get().count_error;
    let (scene, arm, models) = (bench.scene, &bench.scene.arm, bench.models()?);
    let joint_count = arm.joint_count();
    let rules = Rules::measurable(arm, &scene.sensor);
    let least = fewest(models);
    let table: Vec<usize> = published.row.iter().map(|row| row.configurations).collect();
    let (first, last) = (table[0].max(least), table[table.len() - 1]);
    let ratio = libm::log(last as f64 / first as f64) / BETWEEN as f64;
    let mut counts: Vec<usize> =
        (0..=BETWEEN).map(|step| libm::round(first as f64 * libm::exp(ratio * step as f64)) as usize).collect();
    counts.extend(table.iter().filter(|count| **count >= least));
    counts.sort_unstable();
    counts.dedup();

    let done: Vec<Vec<Point>> = bench.trials("calibrating", trials, |number| {
        let trial = Trial::new(scene, bench.injected, number)?;
        let all = Sampler::new(&rules).draw(&mut stream(trial.seed(), "count-error"), last)?;
        let points = counts.iter().map(|count| {
            let set = &all[..count * joint_count];
            let fit = Fit::new(&trial, set, models.information.rank())?;
            Ok(Point { fit, predicted: models.predict(set, joint_count) })
        });
        points.collect()
    })?;

    let rows: Vec<Row> = counts
        .iter()
        .enumerate()
        .map(|(index, count)| {
            let fits = || done.iter().map(|points| &points[index].fit);
            let predicted =
                |get: fn(&Prediction) -> f64| mean_of(done.iter().filter_map(|points| points[index].predicted.as_ref().map(get)));
            Row {
                count: *count,
                position: mean(fits(), Fit::position_mm),
                position_rms: mean(fits(), |fit| MM * fit.after.position_m.rms),
                orientation: mean(fits(), Fit::orientation_deg),
                orientation_rms: mean(fits(), |fit| orientation(&fit.after, |summary| summary.rms)),
                predicted_position: predicted(|prediction| MM * prediction.position_rms_m),
                predicted_orientation: predicted(|prediction| DEG * prediction.orientation_rms_rad),
                bound: bench.limits.least_rms_m(scene, models, *count).map(|least| MM * least),
                not_converged: tally(fits()).not_converged,
            }
        })
        .collect();

    let before = |get: fn(&Fit) -> f64| mean(done.iter().map(|points| &points[0].fit), get);
    let mut claims = vec![
        Claim::new("position error before (mm)", None, before(|fit| MM * fit.before.position_m.mean)),
        Claim::new("orientation error before (°)", None, before(|fit| orientation(&fit.before, |summary| summary.mean))),
    ];
    for published in &published.row {
        let count = published.configurations;
        let row = rows.iter().find(|row| row.count == count);
        let of = |get: fn(&Row) -> Option<Mean>| row.and_then(get);
        claims.push(Claim::new(format!("position error, m = {count} (mm)"), Some(published.position_mm), of(|row| row.position)));
        claims.push(
            Claim::new(format!("position RMS, m = {count} (mm)"), None, of(|row| row.position_rms))
                .bounded(row.and_then(|row| row.bound)),
        );
        claims.push(
            Claim::new(format!("position RMS predicted from noise, m = {count} (mm)"), None, of(|row| row.predicted_position))
                .bounded(row.and_then(|row| row.bound)),
        );
        claims.push(Claim::new(
            format!("orientation error, m = {count} (°)"),
            Some(published.orientation_deg),
            of(|row| row.orientation),
        ));
        claims.push(Claim::new(format!("orientation RMS, m = {count} (°)"), None, of(|row| row.orientation_rms)));
    }
    let slope = mean_of(done.iter().filter_map(|points| {
        let kept = counts.iter().zip(points).filter(|(count, point)| **count >= SLOPE_FROM && point.fit.converged);
        slope(&kept.map(|(count, point)| [libm::log(*count as f64), libm::log(point.fit.position_mm())]).collect::<Vec<_>>())
    }));
    let paper_rows = published.row.iter().filter(|row| row.configurations >= SLOPE_FROM);
    let paper_points: Vec<[f64; 2]> =
        paper_rows.map(|row| [libm::log(row.configurations as f64), libm::log(row.position_mm)]).collect();
    let paper_slope = self::slope(&paper_points);
    claims.push(Claim::new(format!("slope of log error over log m, m ≥ {SLOPE_FROM}"), paper_slope, slope));

    // The paper's numbers are of single calibrations: they are compared with those, not with the interval of our mean.
    let inside = published.row.iter().filter(|published| {
        let Some(index) = counts.iter().position(|count| *count == published.configurations) else { return false };
        let errors = || done.iter().map(|points| &points[index].fit).filter(|fit| fit.converged).map(Fit::position_mm);
        let [low, high] = [0.025, 0.975].map(|share| nearest_rank(errors(), share).unwrap_or(f64::NAN));
        (low..=high).contains(&published.position_mm)
    });
    let fall: Vec<String> = published
        .row
        .iter()
        .map(|published| {
            let ours = rows.iter().find(|row| row.count == published.configurations).and_then(|row| row.position);
            format!("{} mm at m = {} (paper {:.2})", plain(ours, 2), published.configurations, published.position_mm)
        })
        .collect();
    let verdict = format!(
        "That the error falls ever more slowly with the number of configurations {}: {}; {} of the paper's {} position errors lie where \
         95 % of our single calibrations do, and from m = {SLOPE_FROM} the error falls as m to the power {} (noise alone: −0.5).",
        if slope.is_some_and(|slope| slope.mean < -0.3) { "holds" } else { "does not hold" },
        fall.join(", "),
        inside.count(),
        published.row.len(),
        plain(slope, 2),
    );
    let mut notes = vec![
        format!(
            "{trials} calibrations for every m, each trial with its own nested random sets, true arm, noise and verification."
        ),
        "Errors are against exact poses (eq. 10) where the scene says held_out_exact.".to_owned(),
    ];
    if first > table[0] {
        notes.push(format!("Fewer than {first} configurations do not determine the parameters."));
    }
    Ok(Found {
        claims,
        verdict,
        notes,
        fits: tally(done.iter().flatten().map(|point| &point.fit)),
        data: vec![data(&rows)],
        figures: vec![("count-error".to_owned(), figure(&arm.name, &rows, &published))],
    })
}

/// Means over the trials for one number of configurations; mm, °.
struct Row {
    count: usize,
    position: Option<Mean>,
    position_rms: Option<Mean>,
    orientation: Option<Mean>,
    orientation_rms: Option<Mean>,
    predicted_position: Option<Mean>,
    predicted_orientation: Option<Mean>,
    bound: Option<f64>,
    not_converged: usize,
}

/// Least-squares slope; `None` of fewer than two points.
fn slope(points: &[[f64; 2]]) -> Option<f64> {
    let count = points.len() as f64;
    let middle = [0, 1].map(|axis: usize| points.iter().map(|point| point[axis]).sum::<f64>() / count);
    let square: f64 = points.iter().map(|[x, _]| (x - middle[0]) * (x - middle[0])).sum();
    let product: f64 = points.iter().map(|[x, y]| (x - middle[0]) * (y - middle[1])).sum();
    (square > 0.0).then(|| product / square)
}

/// Fig. 11.
fn figure(arm: &str, rows: &[Row], published: &super::published::CountError) -> Figure {
    type Get = fn(&Row) -> Option<Mean>;
    let panel = |title: &str, label: &str, [ours, rms, predicted]: [Get; 3], paper: Vec<[f64; 2]>, bound: bool| {
        let line =
            |get: Get| rows.iter().filter_map(|row| get(row).map(|mean| [row.count as f64, mean.mean])).collect::<Vec<_>>();
        let panel = Panel::new(Axis::log("number of configurations"), Axis::log(label))
            .titled(title)
            .with(Series::new("mean error, 95 %", band(rows.iter().map(|row| (row.count as f64, ours(row))))))
            .with(Series::new("RMS", Kind::Line(line(rms))))
            .with(Series::new("RMS predicted from noise", Kind::Dashed(line(predicted))))
            .with(Series::new("paper, mean", Kind::Points(paper)).colour(Colour::Dark).marker(Marker::Diamond));
        let least: Vec<[f64; 2]> = rows.iter().filter_map(|row| row.bound.map(|bound| [row.count as f64, bound])).collect();
        if bound && !least.is_empty() {
            panel.with(Series::new("least RMS of any choice", Kind::Dashed(least)).colour(Colour::Dark))
        } else {
            panel
        }
    };
    let paper = |get: fn(&super::published::CountErrorRow) -> f64| {
        published.row.iter().map(|row| [row.configurations as f64, get(row)]).collect()
    };
    Figure::new(format!("{arm}: held-out error against the number of configurations"), 2)
        .with(panel(
            "(a) position",
            "position error (mm)",
            [|row| row.position, |row| row.position_rms, |row| row.predicted_position],
            paper(|row| row.position_mm),
            true,
        ))
        .with(panel(
            "(b) orientation",
            "orientation error (°)",
            [|row| row.orientation, |row| row.orientation_rms, |row| row.predicted_orientation],
            paper(|row| row.orientation_deg),
            false,
        ))
}

fn data(rows: &[Row]) -> Data {
    let columns = [
        "m",
        "position_mm",
        "position_low_mm",
        "position_high_mm",
        "position_rms_mm",
        "position_rms_predicted_mm",
        "position_rms_bound_mm",
        "attitude_deg",
        "attitude_low_deg",
        "attitude_high_deg",
        "attitude_rms_deg",
        "attitude_rms_predicted_deg",
        "not_converged",
    ];
    let value = |mean: Option<Mean>| with_ends(mean)[0];
    let rows = rows.iter().map(|row| {
        let position = [value(row.position_rms), value(row.predicted_position), row.bound.unwrap_or(f64::NAN)];
        let orientation = [value(row.orientation_rms), value(row.predicted_orientation), row.not_converged as f64];
        [&[row.count as f64], with_ends(row.position).as_slice(), &position, &with_ends(row.orientation), &orientation].concat()
    });
    Data::new("count-error", &columns, rows.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_line_has_its_slope() {
        assert!((slope(&[[0.0, 1.0], [1.0, 0.5], [4.0, -1.0]]).unwrap() + 0.5).abs() < 1e-15);
        assert!(slope(&[[1.0, 1.0]]).is_none() && slope(&[]).is_none());
    }
}
