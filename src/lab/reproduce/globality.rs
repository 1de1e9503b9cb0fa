//! Chen et al. 2019, section V.B.1, Tables 2 and 3, Figs. 5–7: a set whose end points lie together against one whose end points cover
//! the workspace.
//!
//! Set B is random over the whole joint ranges. Set A is random in ranges narrowed about their middles by one factor, chosen so that
//! the dispersion of A is to that of B as in Table 2. That changes two things at once: the end points lie together, and the joints
//! hardly move. Set C, which the paper has not, keeps them apart: joints over their whole ranges, but end points in a ball so small
//! that their dispersion is that of A.

use nalgebra::Vector3;

use super::Experiment;
use super::arms::narrowed;
use super::bench::{Bench, DEG, Fit, MM, mean, mean_of, orientation, plain, tally};
use super::findings::{Claim, Data, Found, flag};
use super::pictures::{end_points, in_workspace, reach};
use super::published::{Extremes, Published};
use crate::arm::ChainAt;
use crate::design::candidates::{NothingMeasurable, Rules, RulesScratch, Sampler};
use crate::figure::{Axis, Colour, Figure, Kind, Marker, Panel, Series};
use crate::identification::outcome::{Errors, Summary};
use crate::lab::trial::Trial;
use crate::quality::EvennessDomain;
use crate::quality::Indexes;
use crate::quality::evaluator::Scratch;
use crate::quality::globality::{WorkspaceGrid, dispersion};
use crate::seed::{Stream, stream};
use crate::session::SessionError;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "globality",
    place: "Tables 2 and 3, Figs. 5–7",
    about: "sets of little and of much dispersion",
    trials: 20,
    work: run,
};

/// Sets over which a mean dispersion is taken to choose the ranges of A.
const SETS: usize = 50;
/// Steps of the bisection.
const BISECTIONS: usize = 24;
/// Random end points among which the ball of C is chosen.
const POOL: usize = 20_000;
/// The ball is put where at least this share of random end points lies, if A's place has fewer.
const LEAST_SHARE: f64 = 0.01;
/// The sets.
const NAMES: [&str; 3] = ["A", "B", "C"];
/// What they are.
const LABELS: [&str; 3] = ["A, narrow joint ranges", "B, whole ranges", "C, whole ranges, end points in a ball"];

/// A number of errors over the verification: its name, ours, and the paper's.
type Part = (&'static str, fn(&Summary) -> f64, fn(&Extremes) -> f64);

/// Where the end points of C may lie.
struct Ball {
    centre: Vector3<f64>,
    radius: f64,
}

/// One trial: indexes, evenness in the other domain, predicted RMS (m) and fit of each set, and the sets.
struct Trialled {
    sets: [Vec<f64>; 3],
    indexes: [Indexes; 3],
    other_evenness: [f64; 3],
    predicted_m: [f64; 3],
    fits: [Fit; 3],
}

fn run(bench: &Bench<'_>, trials: usize) -> Result<Found, SessionError> {
    let published = Published::get().globality;
    let (scene, arm, models) = (bench.scene, &bench.scene.arm, bench.models()?);
    let (count, joint_count) = (published.configurations, arm.joint_count());
    let (domain, other) = match scene.design.evenness_domain {
        EvennessDomain::Reachable => ("reachable workspace", EvennessDomain::BoundingCube),
        EvennessDomain::BoundingCube => ("bounding cube", EvennessDomain::Reachable),
    };
    let other_name = if other == EvennessDomain::BoundingCube { "bounding cube" } else { "reachable workspace" };
    let other_grid = WorkspaceGrid::new(arm, other, scene.design.evenness_step_m);
    let rules = Rules::measurable(arm, &scene.sensor);

    let whole = mean_dispersion(&rules, scene.seed, count)?;
    let target = whole * published.a.dispersion / published.b.dispersion;
    let factor =
        bisect(|factor| mean_dispersion(&Rules::measurable(&narrowed(arm, factor), &scene.sensor), scene.seed, count), target)?;
    let narrow_arm = narrowed(arm, factor);
    let narrow = Rules::measurable(&narrow_arm, &scene.sensor);
    let (ball, share, at_a) = ball(&rules, &narrow, scene.seed, count, target)?;

    let done: Vec<Trialled> = bench.trials("globality", trials, |number| {
        let trial = Trial::new(scene, bench.injected, number)?;
        let draw = |name: &str| stream(trial.seed(), &format!("globality/{name}"));
        let sets = [
            Sampler::new(&narrow).draw(&mut draw("a"), count)?,
            Sampler::new(&rules).draw(&mut draw("b"), count)?,
            in_ball(&rules, &ball, &mut draw("c"), count),
        ];
        let fit = |set: &Vec<f64>| Fit::new(&trial, set, models.information.rank());
        let fits = [fit(&sets[0])?, fit(&sets[1])?, fit(&sets[2])?];
        let mut scratch = Scratch::default();
        Ok(Trialled {
            indexes: [0, 1, 2].map(|set: usize| models.evaluator.evaluate(&sets[set], &mut scratch)),
            other_evenness: [0, 1, 2].map(|set: usize| other_grid.evenness(&end_points(arm, &sets[set]))),
            predicted_m: [0, 1, 2]
                .map(|set: usize| models.predict(&sets[set], joint_count).map_or(f64::NAN, |found| found.position_rms_m)),
            fits,
            sets,
        })
    })?;

    let over = |set: usize, get: &dyn Fn(&Trialled, usize) -> f64| mean_of(done.iter().map(|trial| get(trial, set)));
    let fits = |set: usize| done.iter().map(move |trial| &trial.fits[set]);
    let mut claims = Vec::new();
    for set in 0..3 {
        let paper = [Some(published.a), Some(published.b), None][set];
        let name = NAMES[set];
        let mut add = |what: String, paper: Option<f64>, get: &dyn Fn(&Trialled, usize) -> f64| {
            claims.push(Claim::new(what, paper, over(set, get)));
        };
        add(format!("dispersion D, {name} (m²)"), paper.map(|p| p.dispersion), &|trial, set| trial.indexes[set].dispersion_m2);
        add(format!("evenness U, {name}, {domain}"), paper.map(|p| p.evenness), &|trial, set| trial.indexes[set].evenness);
        add(format!("evenness U, {name}, {other_name}"), paper.map(|p| p.evenness), &|trial, set| trial.other_evenness[set]);
        add(format!("O_C, {name}"), None, &|trial, set| trial.indexes[set].comprehensive);
        add(format!("smallest singular value O3, {name}"), None, &|trial, set| trial.indexes[set].o3);
        add(format!("position RMS predicted from noise, {name} (mm)"), None, &|trial, set| MM * trial.predicted_m[set]);
    }
    let residuals = [None, Some(published.after_a), Some(published.after_b), None];
    for kind in ["position", "orientation"] {
        let get = |errors: &Errors, which: fn(&Summary) -> f64| match kind {
            "position" => MM * which(&errors.position_m),
            _ => orientation(errors, which),
        };
        let unit = if kind == "position" { "mm" } else { "°" };
        let mut add = |name: &str, paper: Option<Extremes>, set: usize, before: bool| {
            let parts: [Part; 3] =
                [("max", |s| s.max, |e| e.max), ("min", |s| s.min, |e| e.min), ("mean", |s| s.mean, |e| e.mean)];
            for (part, which, published) in parts {
                let ours = mean(fits(set), |fit| get(if before { &fit.before } else { &fit.after }, which));
                claims.push(Claim::new(format!("{kind} error {name}, {part} ({unit})"), paper.as_ref().map(published), ours));
            }
        };
        let of = |residuals: &super::published::Residuals| {
            if kind == "position" { residuals.position_mm } else { residuals.orientation_deg }
        };
        add("before", Some(of(&published.before)), 1, true);
        for set in 0..3 {
            add(&format!("after, {}", NAMES[set]), residuals[set + 1].as_ref().map(of), set, false);
        }
    }

    let error = |set: usize| mean(fits(set), Fit::position_mm);
    let ratio = |set: usize| match (error(set), error(1)) {
        (Some(set), Some(b)) => set.mean / b.mean,
        _ => f64::NAN,
    };
    let narrow_deg = DEG * narrow_arm.chain.joints.iter().map(|joint| 0.5 * (joint.upper - joint.lower)).fold(0.0, f64::max);
    let verdict = format!(
        "That concentrated sets calibrate badly {} where the joints hardly move (A: {} mm, B: {} mm; paper: {} and {} mm), but it is \
         {} the dispersion of the end points: with end points as close together as A's and joints over their whole ranges (C) {} mm \
         are left, {:.2} times B's error where A's is {:.1} times.",
        if ratio(0) > 1.5 { "holds" } else { "does not hold" },
        plain(error(0), 2),
        plain(error(1), 2),
        published.after_a.position_mm.mean,
        published.after_b.position_mm.mean,
        if ratio(2) < 1.0 + 0.25 * (ratio(0) - 1.0) { "not" } else { "partly" },
        plain(error(2), 2),
        ratio(2),
        ratio(0),
    );
    let reach = reach(arm)?;
    let mut figures = Vec::new();
    for set in 0..3 {
        let figure = in_workspace(
            format!("{}: end points of set {}", arm.name, LABELS[set]),
            &reach,
            &format!("set {}", NAMES[set]),
            &end_points(arm, &done[0].sets[set]),
        );
        figures.push((format!("globality-points-{}", NAMES[set].to_lowercase()), figure));
    }
    figures.push(("globality-residuals".to_owned(), residual_figure(&arm.name, &done[0])));
    Ok(Found {
        claims,
        verdict,
        notes: vec![
            format!(
                "Sets of {count}, {trials} trials, each with its own sets, true arm, noise and verification; maxima and minima are \
                 means over the trials, the paper's are of one."
            ),
            format!("A: every joint's range narrowed to {factor:.4} of it, ±{narrow_deg:.1}° for the widest."),
            format!(
                "C: a ball of radius {:.3} m about {} ({:.3}, {:.3}, {:.3}) m, where {:.1} % of random end points lie.",
                ball.radius,
                if at_a { "the mean end point of A" } else { "the mean of all end points, because too few lie near A's," },
                ball.centre.x,
                ball.centre.y,
                ball.centre.z,
                100.0 * share
            ),
        ],
        fits: tally(done.iter().flat_map(|trial| &trial.fits)),
        data: vec![data(&done), residual_data(&done[0])],
        figures,
    })
}

/// Mean dispersion of sets of `count` under `rules`, from a stream that is always the same.
fn mean_dispersion(rules: &Rules<'_>, seed: u64, count: usize) -> Result<f64, SessionError> {
    let configurations = Sampler::new(rules).draw(&mut stream(seed, "globality/ranges"), SETS * count)?;
    let points = end_points(rules.arm(), &configurations);
    Ok(points.chunks_exact(count).map(dispersion).sum::<f64>() / SETS as f64)
}

/// The factor between 0 and 1 at which the rising function `of` is `target`.
fn bisect(of: impl Fn(f64) -> Result<f64, SessionError>, target: f64) -> Result<f64, SessionError> {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if of(middle)? < target {
            low = middle;
        } else {
            high = middle;
        }
    }
    Ok(0.5 * (low + high))
}

/// The ball in which sets of `count` have the mean dispersion `target`; the share of random end points in it; whether it lies about
/// the mean end point of A.
fn ball(
    rules: &Rules<'_>,
    narrow: &Rules<'_>,
    seed: u64,
    count: usize,
    target: f64,
) -> Result<(Ball, f64, bool), NothingMeasurable> {
    let arm = rules.arm();
    let pool = end_points(arm, &Sampler::new(rules).draw(&mut stream(seed, "globality/ball"), POOL)?);
    let of_a = end_points(arm, &Sampler::new(narrow).draw(&mut stream(seed, "globality/ranges"), SETS * count)?);
    let middle = |points: &[Vector3<f64>]| points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let about = |centre: Vector3<f64>| {
        let mut near: Vec<(f64, Vector3<f64>)> = pool.iter().map(|point| ((point - centre).norm(), *point)).collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut sum, mut squares) = (Vector3::zeros(), 0.0);
        let mut inside = near.len();
        for (index, (_, point)) in near.iter().enumerate() {
            let offset = point - centre;
            sum += offset;
            squares += offset.norm_squared();
            let number = (index + 1) as f64;
            let variance = squares / number - (sum / number).norm_squared();
            // A sample's mean squared distance to its own mean is smaller by one part in its number.
            if index + 1 >= count && variance * (count as f64 - 1.0) / count as f64 >= target {
                inside = index + 1;
                break;
            }
        }
        (Ball { centre, radius: near[inside - 1].0 }, inside as f64 / POOL as f64)
    };
    let (ball, share) = about(middle(&of_a));
    if share >= LEAST_SHARE {
        return Ok((ball, share, true));
    }
    let (ball, share) = about(middle(&pool));
    Ok((ball, share, false))
}

/// `count` random configurations whose end points lie in `ball`, in which end points are known to lie.
fn in_ball(rules: &Rules<'_>, ball: &Ball, stream: &mut Stream, count: usize) -> Vec<f64> {
    let arm = rules.arm();
    let chain: ChainAt = arm.chain.at_nominal();
    let mut scratch = RulesScratch::default();
    let mut set = Vec::with_capacity(count * arm.joint_count());
    while set.len() < count * arm.joint_count() {
        let joints: Vec<f64> = arm.chain.joints.iter().map(|joint| stream.uniform(joint.lower, joint.upper)).collect();
        // Collisions last: they cost most.
        if (chain.end_point(&joints) - ball.centre).norm() <= ball.radius && !rules.refuses(&joints, &mut scratch) {
            set.extend(joints);
        }
    }
    set
}

/// Errors of every configuration of the verification of one trial: before, then after each set; mm, °.
fn errors(trial: &Trialled) -> Vec<[[f64; 2]; 4]> {
    let length = |residual: &[f64]| residual.iter().map(|r| r * r).sum::<f64>().sqrt();
    let of = |residual: &[f64; 6]| [MM * length(&residual[..3]), DEG * length(&residual[3..])];
    let residuals = trial.fits.each_ref().map(|fit| &fit.residuals);
    (0..residuals[0].len())
        .map(|index| {
            let after = [0, 1, 2].map(|set: usize| of(&residuals[set][index].identified));
            [of(&residuals[0][index].nominal), after[0], after[1], after[2]]
        })
        .collect()
}

/// Fig. 7, with the control.
fn residual_figure(arm: &str, trial: &Trialled) -> Figure {
    let errors = errors(trial);
    let markers = [Marker::Cross, Marker::Square, Marker::Circle, Marker::Triangle];
    let panel = |title: &str, label: &str, kind: usize| {
        let mut panel = Panel::new(Axis::linear("configuration of the verification"), Axis::log(label)).titled(title);
        for (series, name) in ["before", "after A", "after B", "after C"].into_iter().enumerate() {
            let points = errors.iter().enumerate().map(|(index, error)| [index as f64 + 1.0, error[series][kind]]).collect();
            let colour = if series == 0 { Colour::Dark } else { Colour::Palette(series - 1) };
            panel = panel.with(Series::new(name, Kind::Line(points)).colour(colour).marker(markers[series]));
        }
        panel
    };
    Figure::new(format!("{arm}: errors before and after calibration with sets A, B and C"), 2)
        .with(panel("(a) position", "position error (mm)", 0))
        .with(panel("(b) orientation", "orientation error (°)", 1))
}

fn residual_data(trial: &Trialled) -> Data {
    let columns = [
        "configuration",
        "before_mm",
        "before_deg",
        "after_a_mm",
        "after_a_deg",
        "after_b_mm",
        "after_b_deg",
        "after_c_mm",
        "after_c_deg",
    ];
    let errors = errors(trial);
    let rows = errors
        .iter()
        .enumerate()
        .map(|(index, row)| std::iter::once(index as f64 + 1.0).chain(row.iter().flatten().copied()).collect());
    Data::new("globality-residuals", &columns, rows.collect())
}

fn data(done: &[Trialled]) -> Data {
    let columns = [
        "set",
        "trial",
        "dispersion_m2",
        "evenness",
        "evenness_other_domain",
        "comprehensive",
        "predicted_rms_mm",
        "before_mm",
        "before_deg",
        "after_mm",
        "after_deg",
        "converged",
    ];
    let rows = done.iter().enumerate().flat_map(|(number, trial)| {
        (0..3).map(move |set| {
            let (indexes, fit) = (&trial.indexes[set], &trial.fits[set]);
            let numbers = vec![
                number as f64,
                indexes.dispersion_m2,
                indexes.evenness,
                trial.other_evenness[set],
                indexes.comprehensive,
                MM * trial.predicted_m[set],
                MM * fit.before.position_m.mean,
                orientation(&fit.before, |summary| summary.mean),
                fit.position_mm(),
                fit.orientation_deg(),
                flag(fit.converged),
            ];
            (vec![NAMES[set].to_owned()], numbers)
        })
    });
    Data::labelled("globality", &columns, rows.collect())
}
