//! What a table may have got wrong when no arm of its kind makes its readings: units, the order and sense of joints, zeros, couplings,
//! conventions of the pose, rows.
//!
//! A mistake is looked for with the nominal arm alone, base and target placed: what the corrected readings leave, as a share of the
//! positions' (and orientations') own spread. A mistake that shrinks everything to a point explains nothing of that. Mistakes of one kind
//! are tried first, then several together, the best sets of a size taken further; what is said leaves no more than an arm of this kind may
//! be off, and is the shortest of its kind.

mod fix;
mod variant;

pub use fix::{Fix, GRAMMAR, Said};

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::standing;
use crate::arm::frames::Pose;
use crate::arm::{Arm, ChainAt};
use crate::measurement::Measurement;
use crate::measurement::table::{Euler, MOVED};
use crate::units::{ANGLES, LENGTHS};

/// Readings that are looked at, spread over all of them.
const LOOKED_AT: usize = 60;
/// Share of the spread that an arm of this kind may leave: it is off by millimetres where it reaches metres.
const EXPLAINED: f64 = 0.02;
/// What explains also leaves so much less than what is without it.
const BETTER: f64 = 0.25;
/// Rounds of placing base and target in turn.
const ROUNDS: usize = 6;
/// Sets of mistakes that are taken further.
const BEAM: usize = 16;
/// Mistakes in one table, at most.
const MOST: usize = 6;
/// Joints up to which every order is tried.
const EVERY_ORDER: usize = 7;
/// Zeros that are tried, degrees, and to how much they are narrowed down.
const STEP_OF_ZEROS: f64 = 15.0;
/// Explanations within this factor of the best are as good.
const AS_GOOD: f64 = 1.5;
/// Rows by which poses may have slipped.
const SLIPS: isize = 5;
/// First rows of a slip that are tried at first.
const FIRST_ROWS: usize = 40;
/// Explanations that are said.
const SAID: usize = 3;

/// What would make the readings those of this arm.
#[derive(Clone, Debug, PartialEq)]
pub struct Explanation {
    /// Corrections, in the order in which they are applied.
    pub fixes: Vec<Fix>,
    /// RMS distance that the nominal arm then leaves, base and target placed, m.
    pub left_m: f64,
}

impl Explanation {
    /// As a clause: "joint `elbow` counts the other way round and the positions are inches".
    #[must_use]
    pub fn words(&self, arm: &Arm) -> String {
        let names: Vec<String> = arm.chain.joints.iter().map(|joint| joint.name.clone()).collect();
        self.fixes.iter().map(|fix| fix.words(&names)).collect::<Vec<_>>().join(", and ")
    }

    /// The options that correct it.
    #[must_use]
    pub fn options(&self) -> String {
        self.fixes.iter().map(|fix| format!("--fix-columns {fix}")).collect::<Vec<_>>().join(" ")
    }

    /// Whether only zeros are off: no mistake of the table, but of the arm.
    #[must_use]
    pub fn is_of_zeros(&self) -> bool {
        self.fixes.iter().all(|fix| matches!(fix, Fix::Zero(..)))
    }
}

/// Readings in arrays.
#[derive(Clone)]
struct Read {
    joints: Vec<Vec<f64>>,
    positions: Vec<Vector3<f64>>,
    turns: Option<Vec<Matrix3<f64>>>,
}

impl Read {
    fn of(rows: &[Measurement]) -> Read {
        // What lacks a coordinate cannot be placed.
        let whole: Vec<&Measurement> = rows.iter().filter(|row| row.unread == [false; 3]).collect();
        let rows: Vec<&Measurement> = if whole.is_empty() { rows.iter().collect() } else { whole };
        Read {
            joints: rows.iter().map(|row| row.joints.clone()).collect(),
            positions: rows.iter().map(|row| row.position().coords).collect(),
            turns: rows.iter().map(|row| row.orientation_xyzw.map(fix::matrix)).collect(),
        }
    }
}

/// A set of mistakes and what it leaves.
#[derive(Clone)]
struct Trial {
    fixes: Vec<Fix>,
    rows: Vec<Measurement>,
    left: Left,
}

/// What is left of readings: of all their spread, and of the positions, m.
#[derive(Clone, Copy)]
struct Left {
    share: f64,
    position_m: f64,
}

struct Search<'a> {
    chain: ChainAt,
    slides: Vec<bool>,
    said: &'a Said,
}

/// The mistakes that explain `rows` (all of a table: corrections count them) best, the shortest sets first that do, the best of them first; none where nothing explains them.
#[must_use]
pub fn explanations(arm: &Arm, said: &Said, rows: &[&Measurement]) -> Vec<Explanation> {
    let search = Search { chain: arm.chain.at_nominal(), slides: arm.slides(), said };
    let all = in_frame(rows);
    if all.is_empty() {
        return Vec::new();
    }
    let few: Vec<Measurement> = spread(&all).into_iter().cloned().collect();
    let start = Trial { fixes: Vec::new(), left: search.left(&Read::of(&few)), rows: few };
    let enough = |left: &Left| left.share < EXPLAINED && left.share < BETTER * start.left.share;

    let mut found: Vec<Trial> = search.conventions(&start);
    found.extend(search.slips(&all).into_iter().map(|(fix, left)| Trial { fixes: vec![fix], rows: Vec::new(), left }));
    found.extend(search.orders(&start));
    let mut beam = vec![start.clone()];
    // Conventions of the whole table go together with what is wrong of joints.
    beam.extend(best_of(found.iter().filter(|trial| !trial.rows.is_empty()).cloned().collect(), BEAM));
    // Two mistakes may hide each other: neither alone helps. Of every one that is a choice among few, every second is tried.
    let mut singles: Vec<Trial> = Vec::new();
    for size in 0..MOST {
        found.extend(beam.par_iter().flat_map_iter(|trial| search.of_joints(trial, true)).collect::<Vec<_>>());
        found.extend(singles.par_iter().flat_map_iter(|trial| search.of_joints(trial, false)).collect::<Vec<_>>());
        singles = if size == 0 {
            found.iter().filter(|trial| trial.fixes.iter().all(Fix::is_plain)).cloned().collect()
        } else {
            Vec::new()
        };
        let good: Vec<Trial> = found.iter().filter(|trial| enough(&trial.left)).cloned().collect();
        if !good.is_empty() {
            return said_of(good, &search);
        }
        let longer = found.drain(..).filter(|trial| !trial.rows.is_empty() && trial.fixes.len() > size);
        beam = best_of(longer.collect(), BEAM);
    }
    Vec::new()
}

/// Some of `rows`, at different configurations: repeats tell nothing new, and every so many rows may be the same pose again.
fn spread(rows: &[Measurement]) -> Vec<&Measurement> {
    let mut seen = std::collections::BTreeSet::new();
    let configuration =
        |row: &Measurement| -> Vec<i64> { row.joints.iter().map(|value| (value / MOVED).round() as i64).collect() };
    let different: Vec<&Measurement> = rows.iter().filter(|row| seen.insert(configuration(row))).collect();
    let step = different.len().div_ceil(LOOKED_AT).max(1);
    different.into_iter().step_by(step).collect()
}

/// The readings that have a position; fixed points have none.
fn in_frame(rows: &[&Measurement]) -> Vec<Measurement> {
    rows.iter().filter(|row| row.is_in_frame()).map(|row| (*row).clone()).collect()
}

/// Whether the nominal arm, base and target placed, leaves more of `rows` than an arm of this kind may.
#[must_use]
pub fn is_suspicious(arm: &Arm, rows: &[&Measurement]) -> bool {
    let search = Search { chain: arm.chain.at_nominal(), slides: arm.slides(), said: &Said::default() };
    let all = in_frame(rows);
    if all.is_empty() {
        return false;
    }
    search.left(&Read::of(&all)).share >= EXPLAINED
}

/// The best of `trials`, each set of mistakes once.
fn best_of(mut trials: Vec<Trial>, most: usize) -> Vec<Trial> {
    trials.sort_by(|a, b| a.left.share.total_cmp(&b.left.share));
    let mut seen: Vec<String> = Vec::new();
    trials.retain(|trial| {
        let mut parts: Vec<String> = trial.fixes.iter().map(ToString::to_string).collect();
        parts.sort();
        let key = parts.join(" ");
        let new = !seen.contains(&key) && seen.len() < most;
        if new {
            seen.push(key);
        }
        new
    });
    trials
}

fn said_of(good: Vec<Trial>, search: &Search<'_>) -> Vec<Explanation> {
    // The shortest; of these the best.
    let length = |trial: &Trial| trial.fixes.iter().map(Fix::weight).sum::<usize>();
    let shortest = good.iter().map(length).min().unwrap_or(0);
    let good: Vec<Trial> = good.into_iter().filter(|trial| length(trial) == shortest).collect();
    let good = best_of(good, SAID);
    let best = good.first().map_or(0.0, |trial| trial.left.share);
    let near = good.into_iter().filter(|trial| trial.left.share <= AS_GOOD * best);
    near.map(|trial| Explanation { fixes: joined(trial.fixes, search.slides.len()), left_m: trial.left.position_m }).collect()
}

/// Reversed joints in one correction; exchanges of columns as one order.
fn joined(fixes: Vec<Fix>, joints: usize) -> Vec<Fix> {
    let (mut reversed, mut others): (Vec<usize>, Vec<Fix>) = (Vec::new(), Vec::new());
    let mut order: Option<Vec<usize>> = None;
    let mut zeros: BTreeMap<usize, f64> = BTreeMap::new();
    if fixes.iter().any(|fix| matches!(fix, Fix::Couple { .. } | Fix::Factor(..))) {
        // What mixes joints does not commute with the rest.
        return fixes;
    }
    for fix in fixes {
        match fix {
            Fix::Reverse(joints) => {
                // Zeros are added last.
                joints.iter().filter_map(|joint| zeros.get_mut(joint).map(|zero| *zero = -*zero)).for_each(drop);
                reversed.extend(joints);
            }
            Fix::Zero(joint, zero) => *zeros.entry(joint).or_default() += zero,
            // What comes later holds joints in the order so far.
            Fix::Order(next) => {
                let before = order.take().unwrap_or_else(|| (0..joints).collect());
                order = Some(before.iter().map(|joint| next[*joint]).collect());
                // Joints that were told by their number before have another now.
                reversed.iter_mut().for_each(|joint| *joint = next[*joint]);
                zeros = zeros.into_iter().map(|(joint, zero)| (next[joint], zero)).collect();
            }
            other => others.push(other),
        }
    }
    reversed.sort_unstable();
    let reversed = (!reversed.is_empty()).then_some(Fix::Reverse(reversed));
    let zeros = zeros.into_iter().map(|(joint, zero)| Fix::Zero(joint, zero));
    order.map(Fix::Order).into_iter().chain(others).chain(reversed).chain(zeros).collect()
}

impl Fix {
    /// Whether it is a choice among few about joints.
    fn is_plain(&self) -> bool {
        let quarters = |zero: f64| (zero / FRAC_PI_2 - (zero / FRAC_PI_2).round()).abs() < 1e-9;
        match self {
            Fix::Order(order) => order.iter().enumerate().filter(|(at, joint)| at != *joint).count() == 2,
            Fix::Reverse(_) => true,
            Fix::Zero(_, zero) => quarters(*zero),
            _ => false,
        }
    }

    /// How much it takes to believe it: a number that is free to be anything counts for more.
    fn weight(&self) -> usize {
        match self {
            Fix::Zero(..) | Fix::Factor(..) | Fix::Scale(_) => 2,
            Fix::Couple { .. } => 2,
            _ => 1,
        }
    }
}

impl Search<'_> {
    /// What the nominal arm leaves of `read`, base and target placed.
    fn left(&self, read: &Read) -> Left {
        let tools: Vec<Pose> = read.joints.iter().map(|joints| self.chain.forward(joints)).collect();
        let nothing = Left { share: 1.0, position_m: f64::INFINITY };
        let Some(found) = standing::in_turn_of(&tools, &read.positions, ROUNDS) else {
            return nothing;
        };
        let of_positions = found.share();
        if !of_positions.is_finite() {
            return nothing;
        }
        let Some(turns) = &read.turns else {
            return Left { share: of_positions, position_m: found.left_m };
        };
        // Orientations: the target's turn that is nearest to all.
        let base = found.measurement_from_root.rotation.to_rotation_matrix().into_inner();
        let ours: Vec<Matrix3<f64>> = tools.iter().map(|tool| base * tool.rotation.to_rotation_matrix().into_inner()).collect();
        let sum: Matrix3<f64> = ours.iter().zip(turns).map(|(ours, read)| ours.transpose() * read).sum();
        let svd = sum.svd(true, true);
        let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else {
            return nothing;
        };
        let mut signs = Matrix3::identity();
        let smallest = svd.singular_values.imin();
        signs[(smallest, smallest)] = (u * v_t).determinant().signum();
        let target = u * signs * v_t;
        let count = turns.len() as f64;
        let mean: Matrix3<f64> = turns.iter().sum::<Matrix3<f64>>() / count;
        let spread: f64 = turns.iter().map(|turn| (turn - mean).norm_squared()).sum();
        let left: f64 = ours.iter().zip(turns).map(|(ours, read)| (ours * target - read).norm_squared()).sum();
        let of_turns = libm::sqrt(left / spread.max(1e-12));
        let share = libm::sqrt(0.5 * (of_positions * of_positions + of_turns * of_turns));
        Left { share, position_m: found.left_m }
    }

    fn trial(&self, from: &Trial, fix: Fix) -> Option<Trial> {
        let mut rows = from.rows.clone();
        fix.apply(&mut rows, self.said, &self.slides).ok()?;
        let left = self.left(&Read::of(&rows));
        Some(Trial { fixes: from.fixes.iter().cloned().chain([fix]).collect(), rows, left })
    }

    /// Each mistake about the whole table: units, and how poses are written.
    fn conventions(&self, start: &Trial) -> Vec<Trial> {
        let mut fixes: Vec<Fix> = Vec::new();
        let same = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-9;
        for (names, unit) in LENGTHS {
            let name = names[0];
            if !self.said.position.iter().all(|said| same(*said, unit)) {
                fixes.push(Fix::Positions(name));
            }
            for axis in 0..3 {
                if !same(self.said.position[axis], unit) {
                    fixes.push(Fix::PositionsOf(axis, name));
                }
            }
        }
        for (names, unit) in ANGLES {
            let name = names[0];
            if !same(self.said.angle, unit) {
                fixes.push(Fix::Angles(name));
            }
        }
        // Which axis shows only in orientations that are right all the same.
        for axis in [1, 0, 2] {
            fixes.push(Fix::Axes(std::array::from_fn(|at| (at, if at == axis { -1.0 } else { 1.0 }))));
        }
        if start.rows.iter().all(|row| row.orientation_xyzw.is_some()) {
            for [x, y, z] in [[1, 0, 2], [2, 1, 0], [0, 2, 1], [1, 2, 0], [2, 0, 1]] {
                fixes.push(Fix::Axes([(x, 1.0), (y, 1.0), (z, 1.0)]));
            }
            fixes.extend([Fix::Inverse, Fix::RealPartFirst, Fix::Conjugate]);
            if let Some(said) = self.said.euler {
                // Order about fixed axes is the other way round about moving ones.
                let usual = |euler: Euler| match euler {
                    Euler::Turns { axes: [a, b, c], moving: true } => Euler::Turns { axes: [c, b, a], moving: false },
                    other => other,
                };
                fixes.extend(Euler::all().into_iter().filter(|euler| *euler != usual(said)).map(Fix::Angled));
            }
        }
        fixes.extend(self.scale(start).map(Fix::Scale));
        let mut tried: Vec<Trial> = fixes.into_par_iter().filter_map(|fix| self.trial(start, fix)).collect();
        let wrong_order = tried.iter().find(|trial| trial.fixes == [Fix::RealPartFirst]).cloned();
        tried.extend(wrong_order.iter().flat_map(|trial| {
            [Fix::Conjugate, Fix::Inverse].into_iter().filter_map(|fix| self.trial(trial, fix)).collect::<Vec<_>>()
        }));
        // Without orientations all mirrors are the same: one is enough.
        if start.rows.iter().any(|row| row.orientation_xyzw.is_none()) {
            let mut mirrored = false;
            tried.retain(|trial| !matches!(trial.fixes[0], Fix::Axes(_)) || !std::mem::replace(&mut mirrored, true));
        }
        tried
    }

    /// By what the positions are too small, where they are the arm's in another size.
    fn scale(&self, start: &Trial) -> Option<f64> {
        let read = Read::of(&start.rows);
        let tools: Vec<Pose> = read.joints.iter().map(|joints| self.chain.forward(joints)).collect();
        let mut factor = 1.0;
        for _ in 0..ROUNDS {
            let positions: Vec<Vector3<f64>> = read.positions.iter().map(|position| position * factor).collect();
            let found = standing::in_turn_of(&tools, &positions, ROUNDS)?;
            let [base, target] = [found.measurement_from_root, found.tool_from_target[0]];
            let ours: Vec<Vector3<f64>> = tools.iter().map(|tool| (base * tool * target).translation.vector).collect();
            let middle = |points: &[Vector3<f64>]| points.iter().sum::<Vector3<f64>>() / points.len() as f64;
            let (our_middle, their_middle) = (middle(&ours), middle(&positions));
            let both = ours.iter().zip(&positions).map(|(ours, theirs)| (ours - our_middle, theirs - their_middle));
            let (with, own) =
                both.fold((0.0, 0.0), |(with, own), (ours, theirs)| (with + ours.dot(&theirs), own + theirs.norm_squared()));
            // Of our own points on theirs: what is not explained makes it no smaller.
            factor *= with / own;
            if !(factor.is_finite() && factor > 0.0) {
                return None;
            }
        }
        // A prefix of a unit is meant as such.
        let tens = libm::pow(10.0, libm::log10(factor).round());
        let factor = if (factor / tens - 1.0).abs() < 0.02 { tens } else { factor };
        let digits = libm::pow(10.0, 3.0 - libm::log10(factor).floor());
        Some((factor * digits).round() / digits).filter(|factor| (factor - 1.0).abs() > 0.05)
    }

    /// Every order of the columns, where that is not too many.
    fn orders(&self, start: &Trial) -> Vec<Trial> {
        let count = self.slides.len();
        if count > EVERY_ORDER {
            return Vec::new();
        }
        let tried: Vec<Trial> = permutations(count)
            .into_par_iter()
            .filter_map(|order| {
                // Only the best are kept: no copies of the rest.
                let trial = self.trial(start, Fix::Order(order))?;
                Some(Trial { rows: Vec::new(), ..trial })
            })
            .collect();
        let best = best_of(tried, BEAM);
        best.into_iter().filter_map(|trial| self.trial(start, trial.fixes.into_iter().next()?)).collect()
    }

    /// `trial` with one more mistake about joints; all of them, or those that are a choice among few.
    fn of_joints(&self, trial: &Trial, all: bool) -> Vec<Trial> {
        let count = self.slides.len();
        let touched =
            |joint: usize| trial.fixes.iter().any(|fix| matches!(fix, Fix::Zero(of, _) | Fix::Factor(of, _) if *of == joint));
        let mut tried = Vec::new();
        let mut add = |fix: Fix| tried.extend(self.trial(trial, fix));
        for joint in 0..count {
            if !trial.fixes.contains(&Fix::Reverse(vec![joint])) {
                add(Fix::Reverse(vec![joint]));
            }
            for other in 0..joint {
                let mut order: Vec<usize> = (0..count).collect();
                order.swap(joint, other);
                add(Fix::Order(order));
            }
            if !touched(joint) && !self.slides[joint] {
                [FRAC_PI_2, PI, -FRAC_PI_2].into_iter().for_each(|zero| add(Fix::Zero(joint, zero)));
            }
            if !all {
                continue;
            }
            for other in (0..count).filter(|other| *other != joint && self.slides[*other] == self.slides[joint]) {
                add(Fix::Couple { joint, other, sign: 1.0 });
                add(Fix::Couple { joint, other, sign: -1.0 });
            }
            if touched(joint) {
                continue;
            }
            for factor in [0.5, 2.0, 0.1, 10.0, 1e-3, 1e3] {
                add(Fix::Factor(joint, factor));
            }
        }
        for joint in (0..count).filter(|_| all).filter(|joint| !touched(*joint) && !self.slides[*joint]) {
            tried.extend(self.zero(trial, joint));
        }
        tried
    }

    /// `trial` with the zero of `joint` that fits best.
    fn zero(&self, trial: &Trial, joint: usize) -> Option<Trial> {
        let read = Read::of(&trial.rows);
        let share = |zero: f64| {
            let mut moved = read.clone();
            moved.joints.iter_mut().for_each(|row| row[joint] += zero);
            self.left(&moved).share
        };
        let step = STEP_OF_ZEROS.to_radians();
        let count = (2.0 * PI / step).round() as usize;
        let best = (1..count).map(|at| at as f64 * step).map(|zero| (share(zero), zero)).min_by(|a, b| a.0.total_cmp(&b.0))?;
        let (mut best_share, mut zero, mut width) = (best.0, best.1, step / 2.0);
        while width > 1e-4 {
            for candidate in [zero - width, zero + width] {
                let candidate_share = share(candidate);
                if candidate_share < best_share {
                    (best_share, zero) = (candidate_share, candidate);
                }
            }
            width /= 2.0;
        }
        let zero = if zero > PI { zero - 2.0 * PI } else { zero };
        // A quarter or half turn is meant as such.
        let whole = (zero / FRAC_PI_2).round() * FRAC_PI_2;
        let zero = if whole != 0.0 && (zero - whole).abs() < 0.02 { whole } else { zero };
        self.trial(trial, Fix::Zero(joint, zero))
    }

    /// Poses that have slipped against the joints from some row on.
    fn slips(&self, all: &[Measurement]) -> Vec<(Fix, Left)> {
        if all.len() < 8 {
            return Vec::new();
        }
        let step = all.len().div_ceil(FIRST_ROWS).max(1);
        let left = |first: usize, by: isize| -> Option<(Fix, Left)> {
            let fix = Fix::Shift(first, by);
            let mut rows = all.to_vec();
            fix.apply(&mut rows, self.said, &self.slides).ok()?;
            Some((fix, self.left(&Read::of(&rows))))
        };
        let ways: Vec<(usize, isize)> = (0..all.len())
            .step_by(step)
            .flat_map(|first| (-SLIPS..=SLIPS).filter(|by| *by != 0).map(move |by| (first, by)))
            .collect();
        let coarse: Vec<(Fix, Left)> = ways.into_par_iter().filter_map(|(first, by)| left(first, by)).collect();
        let best = coarse.iter().min_by(|a, b| a.1.share.total_cmp(&b.1.share)).map(|(fix, _)| fix.clone());
        let Some(Fix::Shift(near, by)) = best else {
            return Vec::new();
        };
        let fine: Vec<(Fix, Left)> = (near.saturating_sub(step)..(near + step).min(all.len()))
            .into_par_iter()
            .filter_map(|first| left(first, by))
            .collect();
        fine.into_iter().min_by(|a, b| a.1.share.total_cmp(&b.1.share)).into_iter().collect()
    }
}

/// All orders of `count` things but the first.
fn permutations(count: usize) -> Vec<Vec<usize>> {
    let mut all = vec![Vec::new()];
    for _ in 0..count {
        all = all
            .into_iter()
            .flat_map(|begun: Vec<usize>| {
                let free: Vec<usize> = (0..count).filter(|one| !begun.contains(one)).collect();
                free.into_iter().map(move |one| begun.iter().copied().chain([one]).collect())
            })
            .collect();
    }
    all.retain(|order| order.iter().enumerate().any(|(at, one)| at != *one));
    all
}

/// Another robot is named before a mistake that leaves twice as much.
const FITS_BETTER: f64 = 0.5;

/// What to look at.
#[derive(Clone, Debug, PartialEq)]
pub struct Hint {
    /// A sentence: what explains the readings, with the options that correct it.
    pub text: String,
    /// Mistakes that explain them.
    pub explanations: Vec<Explanation>,
    /// Whether they are those of another robot.
    pub another_robot: bool,
}

/// What to look at where `rows` are not those of `arm`.
#[must_use]
pub fn hint(arm: &Arm, said: &Said, rows: &[&Measurement]) -> Hint {
    let found = explanations(arm, said, rows);
    let clause = |of: &Explanation| {
        format!("{} (the nominal arm is then within {:.1} mm; correct it with {})", of.words(arm), of.left_m * 1e3, of.options())
    };
    // A robot of the same family in another size is nearly this one with its positions scaled.
    let nearest = found.iter().map(|of| of.left_m).fold(f64::INFINITY, f64::min);
    let another = variant::variant(arm, rows).filter(|variant| variant.left_m < FITS_BETTER * nearest);
    if let Some(variant) = another {
        let text = format!(
            "They are those of another robot, {}: with its maker's dimensions it is within {:.1} mm of them. Give its file with --robot",
            variant.name,
            variant.left_m * 1e3
        );
        return Hint { text, explanations: Vec::new(), another_robot: true };
    }
    let of = |text: String, explanations: Vec<Explanation>| Hint { text, explanations, another_robot: false };
    if !found.is_empty() {
        let clauses: Vec<String> = found.iter().map(clause).collect();
        return of(format!("They would fit if {}", clauses.join(", or if ")), found);
    }
    let still = |joint: &usize| rows.iter().all(|row| row.joints[*joint] == rows[0].joints[*joint]);
    let frozen: Vec<String> =
        (0..arm.joint_count()).filter(still).map(|joint| format!("`{}`", arm.chain.joints[joint].name)).collect();
    if !frozen.is_empty() {
        return of(format!("The readings of joint {} never change: was the arm really still there?", frozen.join(", ")), found);
    }
    let nothing = "No other units, order, sense or zero of the joints, no other convention of the poses and no slip of the rows explains \
                   them: is it this robot, and are its links from --base-link to --tip-link?";
    of(nothing.to_owned(), found)
}

#[cfg(test)]
mod tests;
