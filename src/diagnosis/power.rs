//! What a data set would show: the least magnitude of every kind at every place that would be named in four cases of five.
//!
//! Once geometry is out everything is linear and Gaussian, so the analyser is run on draws of the few numbers that it looks at: the
//! inner products of the residual with the signature and with those that are most alike. The same draws serve every magnitude. What
//! is unlike the truth does not matter: it is as likely beside it as without it.

use std::f64::consts::LN_2;
use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, SymmetricEigen};

use super::evidence::{Candidates, Evidence, NoisePrior, log_allowed, one_signed};
use super::fitted::Fitted;
use super::products::Marginal;
use super::settings::{SCALES, Settings};
use crate::effects::signature::shape::Size;
use crate::numerics::transposed_product;
use crate::seed::stream;

/// Columns of all that is looked at beside the truth.
const COLUMNS: usize = 64;
/// Differences of log posterior beyond which another member adds nothing.
const NEGLIGIBLE: f64 = 9.0;
/// λ between which the least magnitude is looked for first; where it is not, the search goes on from there.
const FIRST: [f64; 2] = [12.0, 40.0];
/// Doublings of the magnitude after which nothing would ever show, and tries after which less does not matter.
const DOUBLINGS: usize = 14;
const HALVINGS: usize = 20;
/// Ratio between a magnitude that shows too rarely and one that shows often enough at which the search ends: draws tell no better.
const EXACT: f64 = 1.01;
/// Shares of the usual turn that come with a translation, drawn evenly.
const TURNS: [f64; 2] = [0.2, 1.0];
/// Log prior odds of what is not in play.
const OUT_OF_PLAY: f64 = -6.0;

/// The power of a claim.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Power {
    /// Least magnitude, SI; `None` where nothing survives.
    pub(crate) least: Option<f64>,
    /// Named hypothesis of another claim that is most alike, and how much (cosine squared).
    pub(crate) alike: Option<(usize, f64)>,
}

/// Finds what a data set would show.
pub(crate) struct Bench<'a> {
    settings: &'a Settings,
    candidates: &'a Candidates,
    marginal: &'a Marginal<'a>,
    prior: NoisePrior,
    noise: f64,
    /// What is found already.
    beside: Fitted<'a>,
    /// Of every hypothesis, the inverse of its inner products.
    inverses: Vec<DMatrix<f64>>,
    /// Draws of standard normals that all claims share, so that one can be compared with another.
    pool: Vec<Pool>,
}

/// What is drawn at once.
struct Pool {
    /// Along the signal; these are quantiles, each once.
    along: f64,
    /// Of the columns.
    columns: Vec<f64>,
    /// Of all other equations together.
    rest: f64,
    /// Where the effect points.
    direction: Vec<f64>,
    /// Share of a turn beside a translation.
    turn: f64,
}

/// Something that is looked at.
struct Member {
    hypothesis: usize,
    own: bool,
    signed: bool,
    columns: Range<usize>,
    /// By scale, all that no draw changes.
    constant: [f64; SCALES],
    largest: f64,
}

/// A truth, what is looked at beside it, and draws. Columns are along the principal axes of each member.
struct World {
    members: Vec<Member>,
    /// By column, one over inner product and precision of each scale.
    inverse: Vec<[f64; SCALES]>,
    /// Draw by draw: what a unit magnitude adds to the inner products with the residual, and the noise in them.
    signal: Vec<f64>,
    noise: Vec<f64>,
    draws: Vec<Draw>,
    /// From this probability on something is named.
    named: f64,
    /// Half the equations, and what the residual's square has beside them.
    half: f64,
    pinned: f64,
}

/// Squares of a draw: of a unit magnitude's signal, twice its product with the noise, of the noise.
struct Draw {
    signal: f64,
    cross: f64,
    noise: f64,
}

impl<'a> Bench<'a> {
    /// For data with this `evidence`, with a noise of mean square `noise` (in declared sigmas), and with the effects `found`, beside which everything else has to show.
    #[must_use]
    pub(crate) fn new(evidence: &Evidence<'a>, noise: f64, found: &[(usize, usize)]) -> Bench<'a> {
        let Evidence { marginal, candidates, noise: prior, settings } = *evidence;
        let inverses = (0..candidates.hypotheses.len())
            .map(|hypothesis| {
                let columns = candidates.columns(hypothesis);
                let block = DMatrix::from_fn(columns.len(), columns.len(), |i, j| marginal.own(hypothesis, i, j));
                firm(block).map_or_else(|| DMatrix::zeros(columns.len(), columns.len()), |cholesky| cholesky.inverse())
            })
            .collect();
        let widest = (0..candidates.hypotheses.len()).map(|number| candidates.columns(number).len()).max().unwrap_or(1);
        let mut stream = stream(0, "power");
        let mut quantiles: Vec<f64> =
            (0..settings.power.draws).map(|draw| normal_quantile((draw as f64 + 0.5) / settings.power.draws as f64)).collect();
        stream.shuffle(&mut quantiles);
        let pool = quantiles
            .into_iter()
            .map(|along| Pool {
                along,
                columns: (0..COLUMNS + widest).map(|_| stream.normal()).collect(),
                rest: stream.normal(),
                direction: (0..widest.max(6)).map(|_| stream.normal()).collect(),
                turn: stream.uniform(TURNS[0], TURNS[1]),
            })
            .collect();
        Bench {
            settings,
            candidates,
            marginal,
            prior,
            noise: noise.max(1e-12),
            beside: Fitted::new(evidence, found),
            inverses,
            pool,
        }
    }

    fn information(&self, hypothesis: usize) -> f64 {
        self.marginal.information(hypothesis)
    }

    /// Share of the signal of `truth` that `other` can stand in for.
    fn likeness(&self, truth: usize, other: usize) -> f64 {
        let (of, by) = (self.candidates.columns(truth), self.candidates.columns(other));
        let inverse = &self.inverses[other];
        let (mut explained, mut all) = (0.0, 0.0);
        for column in of {
            let row = self.marginal.row(column);
            all += row[column];
            for i in 0..by.len() {
                for j in 0..by.len() {
                    explained += row[by.start + i] * inverse[(i, j)] * row[by.start + j];
                }
            }
        }
        (explained / all.max(1e-300)).clamp(0.0, 1.0)
    }

    /// The power of the claim whose variants are `variants`, each as likely.
    #[must_use]
    pub(crate) fn power(&self, variants: &[usize]) -> Power {
        let shows = |variant: &usize| self.information(*variant) / self.noise >= self.settings.power.nothing;
        let seen: Vec<usize> = variants.iter().copied().filter(shows).collect();
        if seen.is_empty() || (seen.len() as f64) < self.settings.power.surviving * variants.len() as f64 {
            return Power { least: None, alike: None };
        }
        let count = seen.len().min(self.settings.power.truths);
        let mut alike: Option<(usize, f64)> = None;
        let mut worlds = Vec::with_capacity(count);
        for number in 0..count {
            let truth = seen[(2 * number + 1) * seen.len() / (2 * count)];
            let shares: Vec<(usize, f64)> = (0..self.candidates.hypotheses.len())
                .filter(|other| *other != truth && (self.candidates.active[*other] || variants.contains(other)))
                .map(|other| (other, self.likeness(truth, other)))
                .collect();
            for (other, share) in &shares {
                let named = self.candidates.hypotheses[*other].kind.is_some() && !variants.contains(other);
                if named && alike.is_none_or(|(_, most)| *share > most) {
                    alike = Some((*other, *share));
                }
            }
            worlds.extend(self.world(truth, variants, shares, number, count));
        }
        Power { least: self.least(&worlds), alike }
    }

    /// The least magnitude that is named often enough in `worlds`.
    fn least(&self, worlds: &[World]) -> Option<f64> {
        let draws: usize = worlds.iter().map(|world| world.draws.len()).sum();
        // What is named at a smaller magnitude and at a larger one is named between; what is at neither is not.
        let named = |size: f64, low: &[bool], high: &[bool]| -> Vec<bool> {
            let all = worlds.iter().flat_map(|world| (0..world.draws.len()).map(move |draw| (world, draw)));
            let known = low.iter().zip(high);
            all.zip(known)
                .map(|((world, draw), (low, high))| if low == high { *low } else { world.is_named(draw, size) })
                .collect()
        };
        let enough =
            |named: &[bool]| named.iter().filter(|named| **named).count() as f64 >= self.settings.power.share * draws as f64;
        let (never, always) = (vec![false; draws], vec![true; draws]);
        let mean = worlds.iter().flat_map(|world| &world.draws).map(|draw| draw.signal).sum::<f64>() / draws.max(1) as f64;
        if draws == 0 || mean <= 0.0 {
            return None;
        }
        let (mut low, mut high) = (libm::sqrt(FIRST[0] * self.noise / mean), libm::sqrt(FIRST[1] * self.noise / mean));
        let (mut below, mut above) = (named(low, &never, &always), named(high, &never, &always));
        let mut tries = 0;
        while !enough(&above) {
            (low, below) = (high, above);
            high *= 2.0;
            above = named(high, &never, &always);
            tries += 1;
            if tries > DOUBLINGS {
                return None;
            }
        }
        while enough(&below) {
            (high, above) = (low, below);
            low *= 0.5;
            below = named(low, &never, &always);
            tries += 1;
            if tries > HALVINGS {
                return Some(high);
            }
        }
        while high / low > EXACT {
            let middle = libm::sqrt(low * high);
            let between = named(middle, &below, &above);
            if enough(&between) {
                (high, above) = (middle, between);
            } else {
                (low, below) = (middle, between);
            }
        }
        Some(libm::sqrt(low * high))
    }

    /// The world in which `truth` is there: number `number` of `count` of its claim.
    fn world(
        &self,
        truth: usize,
        variants: &[usize],
        mut shares: Vec<(usize, f64)>,
        number: usize,
        count: usize,
    ) -> Option<World> {
        let apart = |member: usize| !variants.contains(&member) && !self.candidates.exclude(member, truth);
        let gone: Vec<usize> =
            (0..self.beside.members().len()).filter(|number| !apart(self.beside.members()[*number].0)).collect();
        let beside: Vec<(usize, usize)> = self.beside.members().iter().copied().filter(|(member, _)| apart(*member)).collect();
        let taken = |other: usize| beside.iter().any(|(member, _)| self.candidates.exclude(*member, other));
        shares.retain(|(other, share)| *share >= self.settings.power.unlike && !taken(*other));
        shares.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let mut chosen = vec![truth];
        let mut room = COLUMNS;
        let mut left = self.settings.power.alike;
        for (other, _) in &shares {
            let (width, which) = (self.candidates.columns(*other).len(), usize::from(!variants.contains(other)));
            if left[which] > 0 && width <= room {
                left[which] -= 1;
                room -= width;
                chosen.push(*other);
            }
        }
        // What it claims comes first, so that others that are far behind it are passed over.
        chosen[1..].sort_by_key(|other| !variants.contains(other));
        let columns: Vec<usize> = chosen.iter().flat_map(|member| self.candidates.columns(*member)).collect();
        let size = columns.len();
        // What is found takes its part out of everything else.
        let products = self.beside.surviving(&columns, &gone);
        let mut axes = DMatrix::zeros(size, size);
        let mut members = Vec::with_capacity(chosen.len());
        let mut inverse = vec![[0.0; SCALES]; size];
        let mut first = 0;
        for hypothesis in chosen {
            let width = self.candidates.columns(hypothesis).len();
            let block = products.view((first, first), (width, width)).into_owned();
            let (values, vectors) = if width == 1 {
                (vec![block[(0, 0)]], DMatrix::identity(1, 1))
            } else {
                let eigen = SymmetricEigen::new(block);
                (eigen.eigenvalues.iter().map(|value| value.max(0.0)).collect(), eigen.eigenvectors)
            };
            axes.view_mut((first, first), (width, width)).copy_from(&vectors);
            let log_odds = self.candidates.log_odds[hypothesis];
            let mut constant = [if log_odds.is_finite() { log_odds } else { OUT_OF_PLAY }; SCALES];
            for (scale, share) in self.settings.prior.scale_shares.iter().enumerate() {
                let size = self.candidates.size(&self.settings.prior, hypothesis, scale);
                constant[scale] += libm::log(*share);
                for (i, value) in values.iter().enumerate() {
                    inverse[first + i][scale] = 1.0 / (value + 1.0 / (size * size));
                    constant[scale] -= 0.5 * libm::log(1.0 + value * size * size);
                }
            }
            members.push(Member {
                hypothesis,
                own: variants.contains(&hypothesis),
                signed: one_signed(&self.candidates.hypotheses[hypothesis]),
                columns: first..first + width,
                constant,
                largest: constant.into_iter().fold(f64::NEG_INFINITY, f64::max) + LN_2,
            });
            first += width;
        }
        let products = axes.tr_mul(&transposed_product(&products, &axes));
        let factor = firm(products.clone())?.unpack();
        let mut world = World {
            members,
            inverse,
            signal: Vec::new(),
            noise: Vec::new(),
            draws: Vec::new(),
            named: self.settings.decision.named,
            half: 0.5 * (self.prior.degrees_of_freedom + self.marginal.degrees_of_freedom),
            pinned: self.prior.degrees_of_freedom * self.prior.level,
        };
        self.draw(&mut world, &products, &factor, &axes, number, count);
        Some(world)
    }

    /// Draws for `world`, whose columns have these inner products and their factor.
    fn draw(
        &self,
        world: &mut World,
        products: &DMatrix<f64>,
        factor: &DMatrix<f64>,
        axes: &DMatrix<f64>,
        number: usize,
        count: usize,
    ) {
        let size = products.nrows();
        let width = world.members[0].columns.len();
        let truth = &self.candidates.hypotheses[world.members[0].hypothesis];
        let unit = self.candidates.unit[world.members[0].hypothesis];
        let sigma = libm::sqrt(self.noise);
        let shares = self.marginal.shares(world.members[0].hypothesis);
        // Row by row.
        let rows: Vec<f64> = (0..size).flat_map(|i| (0..=i).map(move |j| factor[(i, j)])).collect();
        let shown: Vec<f64> = (0..size).flat_map(|i| (0..width).map(move |j| products[(i, j)])).collect();
        let (mut direction, mut own, mut normal) = (vec![0.0; width], vec![0.0; width], vec![0.0; size]);
        for pool in self.pool.iter().skip(number).step_by(count) {
            towards(&mut direction, world.members[0].signed, truth.shape.size(), &shares, pool);
            // Along the principal axes of the truth.
            for (i, own) in own.iter_mut().enumerate() {
                *own = (0..width).map(|j| axes[(j, i)] * direction[j] / (unit * truth.spread[j])).sum();
            }
            let signal: f64 = (0..width).map(|i| own[i] * own[i] * products[(i, i)]).sum();
            normal.copy_from_slice(&pool.columns[..size]);
            // What decides is the noise along the signal: there its quantiles are met one by one.
            let length = libm::sqrt(signal.max(1e-300));
            let along: f64 = (0..width).map(|i| normal[i] * own[i] * factor[(i, i)]).sum::<f64>() / length;
            for i in 0..width {
                normal[i] += (pool.along - along) * own[i] * factor[(i, i)] / length;
            }
            let mut squares: f64 = normal.iter().map(|value| value * value).sum();
            squares += chi_square(self.marginal.degrees_of_freedom - size as f64, pool.rest);
            let mut cross = 0.0;
            let mut first = 0;
            for i in 0..size {
                let row = &rows[first..=first + i];
                first += i + 1;
                let noise = sigma * row.iter().zip(&normal).map(|(factor, normal)| factor * normal).sum::<f64>();
                let shown = &shown[i * width..(i + 1) * width];
                world.signal.push(shown.iter().zip(&own).map(|(product, own)| product * own).sum());
                world.noise.push(noise);
                if i < width {
                    cross += 2.0 * own[i] * noise;
                }
            }
            world.draws.push(Draw { signal, cross, noise: self.noise * squares });
        }
    }
}

/// A direction in which a unit magnitude may point, as effects have it: a sign; a phase; a translation; a translation with a turn.
/// `shares`: of the readings, what each part of a free function gets.
fn towards(direction: &mut [f64], signed: bool, size: Size, shares: &[f64], pool: &Pool) {
    let width = direction.len();
    if width == 1 {
        direction[0] = if signed || pool.direction[0] > 0.0 { 1.0 } else { -1.0 };
        return;
    }
    direction.copy_from_slice(&pool.direction[..width]);
    if size == Size::Rms {
        let square: f64 = direction.iter().zip(shares).map(|(value, share)| value * value * share).sum();
        direction.iter_mut().for_each(|value| *value /= libm::sqrt(square.max(1e-12)));
        return;
    }
    let scaled = |part: &mut [f64], length: f64| {
        let norm = libm::sqrt(part.iter().map(|value| value * value).sum::<f64>()).max(1e-12);
        part.iter_mut().for_each(|value| *value *= length / norm);
    };
    let (translation, rotation) = direction.split_at_mut(if width == 6 { 3 } else { width });
    scaled(translation, 1.0);
    scaled(rotation, pool.turn);
}

/// χ² with so many degrees of freedom where a standard normal is `normal` (Wilson and Hilferty).
fn chi_square(degrees_of_freedom: f64, normal: f64) -> f64 {
    if degrees_of_freedom < 1.0 {
        return 0.0;
    }
    let part = 2.0 / (9.0 * degrees_of_freedom);
    let root = 1.0 - part + normal * libm::sqrt(part);
    degrees_of_freedom * (root * root * root).max(0.0)
}

/// The factor of a matrix that rounding may have left without one.
fn firm(mut matrix: DMatrix<f64>) -> Option<Cholesky<f64, nalgebra::Dyn>> {
    let largest = matrix.diagonal().max().max(1e-300);
    for i in 0..matrix.nrows() {
        matrix[(i, i)] += 1e-9 * matrix[(i, i)] + 1e-13 * largest;
    }
    Cholesky::new(matrix)
}

fn normal_quantile(share: f64) -> f64 {
    let (mut low, mut high) = (-9.0, 9.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if 0.5 * libm::erfc(-middle * std::f64::consts::FRAC_1_SQRT_2) < share {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// A sum of exponentials of what is claimed and of everything else, relative to the largest.
struct Tally {
    top: f64,
    own: f64,
    other: f64,
    top_is_own: bool,
}

impl Tally {
    fn add(&mut self, log: f64, own: bool) {
        if log < self.top - 1.5 * NEGLIGIBLE {
            return;
        }
        let weight = if log > self.top {
            let shrunk = libm::exp(self.top - log);
            self.own *= shrunk;
            self.other *= shrunk;
            (self.top, self.top_is_own) = (log, own);
            1.0
        } else {
            libm::exp(log - self.top)
        };
        if own {
            self.own += weight;
        } else {
            self.other += weight;
        }
    }
}

impl World {
    /// Whether a magnitude of `size` is named in a draw.
    fn is_named(&self, draw: usize, size: f64) -> bool {
        let columns = self.inverse.len();
        let signal = &self.signal[draw * columns..(draw + 1) * columns];
        let noise = &self.noise[draw * columns..(draw + 1) * columns];
        let of = &self.draws[draw];
        let residual = (of.noise + size * (of.cross + size * of.signal)).max(1e-12);
        let before = self.pinned + residual;
        let mut tally = Tally { top: 0.0, own: 0.0, other: 1.0, top_is_own: false };
        for member in &self.members {
            let mut drops = [0.0; SCALES];
            let mut right = 0.0;
            for column in member.columns.clone() {
                right = noise[column] + size * signal[column];
                for (drop, inverse) in drops.iter_mut().zip(&self.inverse[column]) {
                    *drop += right * right * inverse;
                }
            }
            // The widest prior explains most; −log(1 − x) is x / (1 − x) at most.
            let share = (drops[SCALES - 1] / before).min(1.0 - 1e-9);
            if member.largest + self.half * share / (1.0 - share) < tally.top - NEGLIGIBLE {
                continue;
            }
            for (scale, drop) in drops.iter().enumerate() {
                let after = (before - drop).max(1e-9 * before);
                let mut log = member.constant[scale] - self.half * libm::log(after / before);
                if member.signed {
                    let level = after / (2.0 * self.half);
                    log += log_allowed(right * libm::sqrt(self.inverse[member.columns.start][scale] / level));
                }
                tally.add(log, member.own);
            }
        }
        tally.top_is_own && tally.own >= self.named * (tally.own + tally.other)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;

    use super::*;
    use crate::diagnosis::products::test_marginal;
    use crate::effects::kind::joint_compliance::Torque;
    use crate::effects::signature::library::Hypothesis;
    use crate::effects::signature::shape::Shape;
    use crate::effects::{Kind, Location};

    const ROWS: usize = 150;

    fn hypothesis(kind: Option<Kind>, joint: usize, width: usize) -> Hypothesis {
        Hypothesis {
            share: None,
            kind,
            location: Location { level: crate::effects::Level::Joint, index: Some(joint) },
            shape: Shape::Torque(Torque { joint }),
            range: [0.5, 2.0],
            spread: vec![if width == 2 { 0.7 } else { 1.0 }; width],
            detail: String::new(),
        }
    }

    /// Signatures of `widths`, each made partly of the one before.
    fn problem(likeness: f64) -> (Candidates, DMatrix<f64>) {
        let hypotheses = vec![
            hypothesis(Some(Kind::JointCompliance), 1, 1),
            hypothesis(Some(Kind::Backlash), 1, 1),
            hypothesis(None, 1, 1),
            hypothesis(Some(Kind::JointEccentricity), 2, 2),
            hypothesis(Some(Kind::JointEccentricity), 2, 2),
            hypothesis(Some(Kind::GearCoupling), 2, 1),
            hypothesis(Some(Kind::TiltClearance), 3, 1),
        ];
        let mut draws = stream(4, "test/power");
        let (mut first, mut columns) = (Vec::new(), Vec::<DVector<f64>>::new());
        for hypothesis in &hypotheses {
            first.push(columns.len());
            for _ in &hypothesis.spread {
                let mut column = DVector::from_fn(ROWS, |_, _| draws.normal());
                if let Some(before) = columns.last() {
                    column = column * (1.0 - likeness * likeness).sqrt() + before * likeness;
                }
                columns.push(column);
            }
        }
        let count = hypotheses.len();
        let candidates = Candidates {
            hypotheses,
            first,
            unit: vec![0.8; count],
            widest: vec![f64::INFINITY; count],
            log_odds: (0..count).map(|number| -3.0 - 0.3 * number as f64).collect(),
            active: vec![true; count],
            scanned: count,
        };
        (candidates, DMatrix::from_columns(&columns))
    }

    /// Cases row by row, with the evidence of the search itself.
    #[test]
    fn the_least_magnitude_is_named_in_four_cases_of_five() {
        let settings = Settings::default();
        let prior = NoisePrior { degrees_of_freedom: 10.0, level: 1.0 };
        let noise: f64 = 1.7;
        for (likeness, found) in [(0.2, vec![]), (0.9, vec![]), (0.6, vec![(5, 1)])] {
            let (candidates, signatures) = problem(likeness);
            let products = test_marginal(&candidates, &signatures, &DVector::zeros(ROWS));
            let unit = products.marginal();
            let evidence = Evidence { marginal: &unit, candidates: &candidates, noise: prior, settings: &settings };
            let bench = Bench::new(&evidence, noise, &found);
            let base = |with: &[(usize, usize)]| [&found[..], with].concat();
            for variants in [vec![0], vec![1], vec![3, 4], vec![6]] {
                let least = bench.power(&variants).least.unwrap();
                let mut draws = stream(9, &format!("test/cases/{variants:?}"));
                let cases = 600;
                let mut right = 0;
                for case in 0..cases {
                    let truth = variants[case % variants.len()];
                    let mut residual = DVector::from_fn(ROWS, |_, _| noise.sqrt() * draws.normal());
                    let phase = draws.uniform(0.0, std::f64::consts::TAU);
                    let sign = if truth == 0 || truth == 6 || phase < std::f64::consts::PI { 1.0 } else { -1.0 };
                    for (i, column) in candidates.columns(truth).enumerate() {
                        let share = if candidates.columns(truth).len() == 1 { sign } else { [phase.cos(), phase.sin()][i] };
                        let spread = candidates.hypotheses[truth].spread[i];
                        residual += signatures.column(column) * (least * share / (candidates.unit[truth] * spread));
                    }
                    for (member, _) in &found {
                        residual += signatures.column(candidates.first[*member]) * 2.3;
                    }
                    let products = test_marginal(&candidates, &signatures, &residual);
                    let seen = products.marginal();
                    let evidence = Evidence { marginal: &seen, candidates: &candidates, noise: prior, settings: &settings };
                    let without = evidence.log_posterior(&base(&[]));
                    let (mut own, mut all, mut best) = (0.0, 1.0, (0.0, false));
                    for member in (0..candidates.hypotheses.len()).filter(|member| found.iter().all(|(other, _)| other != member))
                    {
                        for scale in 0..SCALES {
                            let log = evidence.log_posterior(&base(&[(member, scale)])) - without;
                            all += log.exp();
                            if variants.contains(&member) {
                                own += log.exp();
                            }
                            if log > best.0 {
                                best = (log, variants.contains(&member));
                            }
                        }
                    }
                    right += usize::from(own >= settings.decision.named * all && best.1);
                }
                let share = f64::from(right as u32) / f64::from(cases as u32);
                // Three standard errors of the count, and as much again for that of the draws.
                assert!((share - 0.8).abs() < 0.07, "{variants:?} at {likeness}: {share}");
            }
        }
    }

    #[test]
    fn what_is_the_same_is_never_told_apart() {
        let (candidates, mut signatures) = problem(0.2);
        let copy = signatures.column(0) * 1.0;
        signatures.set_column(1, &copy);
        let settings = Settings::default();
        let noise = NoisePrior { degrees_of_freedom: 10.0, level: 1.0 };
        let products = test_marginal(&candidates, &signatures, &DVector::zeros(ROWS));
        let unit = products.marginal();
        let evidence = Evidence { marginal: &unit, candidates: &candidates, noise, settings: &settings };
        let bench = Bench::new(&evidence, 1.0, &[]);
        // Of two that are the same the one that is less likely beforehand is never named.
        let power = bench.power(&[1]);
        assert_eq!(power.least, None);
        assert!(power.alike.is_some_and(|(other, likeness)| other == 0 && likeness > 0.999));
        signatures.fill_column(8, 0.0);
        let noise = NoisePrior { degrees_of_freedom: 10.0, level: 1.0 };
        let products = test_marginal(&candidates, &signatures, &DVector::zeros(ROWS));
        let unit = products.marginal();
        let evidence = Evidence { marginal: &unit, candidates: &candidates, noise, settings: &settings };
        let bench = Bench::new(&evidence, 1.0, &[]);
        assert_eq!(bench.power(&[6]), Power { least: None, alike: None });
    }

    #[test]
    fn quantiles_and_squares_are_those_of_the_tables() {
        assert!((normal_quantile(0.975) - 1.959_963_985).abs() < 1e-8);
        assert!((chi_square(10.0, 1.644_853_627) - 18.307).abs() < 0.05);
        assert_eq!(chi_square(0.0, 1.0), 0.0);
    }
}
