//! A set of effects fitted together, held so that an effect more, or one in another's place, costs next to nothing: what the members
//! take of every other column is kept, and brought up to date as members come and go (the sweep operator of stepwise regression,
//! Beaton 1964, block by block).

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Cholesky, DMatrix, DVector};

use super::evidence::{Evidence, Extension, log_allowed, log_multiplicity, one_signed};
use super::settings::SCALES;

/// Members, and all columns beside them.
pub(super) struct Fitted<'a> {
    evidence: Evidence<'a>,
    members: Vec<(usize, usize)>,
    /// Of each member, its places among the columns of all members.
    blocks: Vec<Range<usize>>,
    columns: Vec<usize>,
    /// Of each of them, what survives of geometry with every column.
    products: Vec<Arc<Vec<f64>>>,
    /// Of each of them, its coefficient where every column in turn is what is measured.
    taken: Vec<Vec<f64>>,
    /// Posterior covariance of the members' coefficients, over the noise's mean square: row by row.
    inverse: Vec<Vec<f64>>,
    coefficients: Vec<f64>,
    /// What survives geometry and members of the columns of each hypothesis with each other, as in the marginal.
    own: Vec<f64>,
    /// The same of each column with the residual.
    with_residual: Vec<f64>,
    drop: f64,
    log_determinant: f64,
}

/// What is there where some members are not: what they took is given back.
struct Beside {
    /// Places of their columns.
    block: Vec<usize>,
    /// What survives the other members of their columns with every column.
    given_back: Vec<Vec<f64>>,
    drop: f64,
    log_determinant: f64,
    /// Members that are left.
    count: usize,
    /// Log prior of these.
    prior: f64,
    /// Of those whose sign physics knows: place, coefficient, variance over the noise's mean square.
    signed: Vec<(usize, f64, f64)>,
}

/// y += a x
fn axpy(a: f64, x: &[f64], y: &mut [f64]) {
    if a != 0.0 {
        y.iter_mut().zip(x).for_each(|(y, x)| *y += a * x);
    }
}

fn log_determinant(cholesky: &Cholesky<f64, nalgebra::Dyn>) -> f64 {
    let factor = cholesky.l_dirty();
    (0..factor.nrows()).map(|i| 2.0 * libm::log(factor[(i, i)])).sum()
}

impl<'a> Fitted<'a> {
    /// `members` with what is known of them. A member that no arithmetic can tell from others is left out.
    #[must_use]
    pub(super) fn new(evidence: &Evidence<'a>, members: &[(usize, usize)]) -> Fitted<'a> {
        let marginal = evidence.marginal;
        let mut fitted = Fitted {
            evidence: *evidence,
            members: Vec::new(),
            blocks: Vec::new(),
            columns: Vec::new(),
            products: Vec::new(),
            taken: Vec::new(),
            inverse: Vec::new(),
            coefficients: Vec::new(),
            own: marginal.own_blocks().to_vec(),
            with_residual: marginal.with_residual.clone(),
            drop: 0.0,
            log_determinant: 0.0,
        };
        for member in members {
            fitted.add(*member);
        }
        fitted
    }

    /// The members, in the order in which they came.
    #[must_use]
    pub(super) fn members(&self) -> &[(usize, usize)] {
        &self.members
    }

    fn size(&self, (hypothesis, scale): (usize, usize)) -> f64 {
        self.evidence.candidates.size(&self.evidence.settings.prior, hypothesis, scale)
    }

    /// What survives of the columns of `hypothesis` with each other, row by row.
    fn block(&self, hypothesis: usize) -> &[f64] {
        let (first, width) = (self.evidence.marginal.first_own(hypothesis), self.evidence.candidates.columns(hypothesis).len());
        &self.own[first..first + width * width]
    }

    /// `sign` times what `with` and `coefficients` of columns explain of every column, and of the residual, is added to what survives.
    fn give(&mut self, sign: f64, with: &[Vec<f64>], taken: &[Vec<f64>], coefficients: &[f64]) {
        let candidates = self.evidence.candidates;
        for ((with, taken), coefficient) in with.iter().zip(taken).zip(coefficients) {
            axpy(sign * coefficient, with, &mut self.with_residual);
            for hypothesis in 0..candidates.hypotheses.len() {
                let (columns, first) = (candidates.columns(hypothesis), self.evidence.marginal.first_own(hypothesis));
                let width = columns.len();
                for (i, a) in columns.clone().enumerate() {
                    axpy(sign * with[a], &taken[columns.clone()], &mut self.own[first + i * width..first + (i + 1) * width]);
                }
            }
        }
    }

    /// One more.
    pub(super) fn add(&mut self, member: (usize, usize)) {
        let (marginal, candidates) = (self.evidence.marginal, self.evidence.candidates);
        let columns = candidates.columns(member.0);
        let width = columns.len();
        let size = self.size(member);
        let precision = 1.0 / (size * size);
        let mut left = DMatrix::from_row_slice(width, width, self.block(member.0));
        (0..width).for_each(|i| left[(i, i)] += precision);
        let Some(cholesky) = Cholesky::new(left) else {
            return;
        };
        let own_inverse = cholesky.inverse();
        // What survives of the new columns with every column.
        let rows: Vec<Arc<Vec<f64>>> = columns.clone().map(|column| marginal.row(column)).collect();
        let surviving: Vec<Vec<f64>> = columns
            .clone()
            .zip(&rows)
            .map(|(column, row)| {
                let mut left = row.as_ref().clone();
                self.taken.iter().zip(&self.products).for_each(|(taken, products)| axpy(-taken[column], products, &mut left));
                left
            })
            .collect();
        let taken: Vec<Vec<f64>> = (0..width)
            .map(|i| {
                let mut sum = vec![0.0; marginal.with_residual.len()];
                surviving.iter().enumerate().for_each(|(j, row)| axpy(own_inverse[(i, j)], row, &mut sum));
                sum
            })
            .collect();
        let right = DVector::from_fn(width, |i, _| self.with_residual[columns.start + i]);
        let coefficients = &own_inverse * &right;
        self.drop += right.dot(&coefficients);
        self.log_determinant += log_determinant(&cholesky) - width as f64 * libm::log(precision);
        self.give(-1.0, &surviving, &taken, coefficients.as_slice());
        let before = self.columns.len();
        let of_new: Vec<Vec<f64>> = self.taken.iter().map(|taken| taken[columns.clone()].to_vec()).collect();
        // Of the members before with the new one.
        let across: Vec<Vec<f64>> = of_new
            .iter()
            .map(|of_new| (0..width).map(|j| -(0..width).map(|i| of_new[i] * own_inverse[(i, j)]).sum::<f64>()).collect())
            .collect();
        for k in 0..before {
            for (i, of_new) in of_new[k].iter().enumerate() {
                axpy(-of_new, &taken[i], &mut self.taken[k]);
                self.coefficients[k] -= of_new * coefficients[i];
            }
            for (l, of_new) in of_new.iter().enumerate() {
                self.inverse[k][l] -= across[k].iter().zip(of_new).map(|(a, b)| a * b).sum::<f64>();
            }
            self.inverse[k].extend(&across[k]);
        }
        for i in 0..width {
            let own = (0..width).map(|j| own_inverse[(i, j)]);
            self.inverse.push(across.iter().map(|across| across[i]).chain(own).collect());
        }
        self.members.push(member);
        self.blocks.push(before..before + width);
        self.columns.extend(columns);
        self.products.extend(rows);
        self.taken.extend(taken);
        self.coefficients.extend(coefficients.iter());
    }

    /// Number `at` of the members goes.
    pub(super) fn remove(&mut self, at: usize) {
        let beside = self.beside(&[at]);
        let block = self.blocks[at].clone();
        let own_coefficients = self.coefficients[block.clone()].to_vec();
        let own_taken: Vec<Vec<f64>> = self.taken.drain(block.clone()).collect();
        self.give(1.0, &beside.given_back, &own_taken, &own_coefficients);
        let across: Vec<Vec<f64>> = self.inverse.iter().map(|row| row[block.clone()].to_vec()).collect();
        let own = self.own_precision(&beside.block);
        let width = block.len();
        let weighed: Vec<Vec<f64>> =
            across.iter().map(|across| (0..width).map(|j| (0..width).map(|i| across[i] * own[(i, j)]).sum()).collect()).collect();
        for row in &mut self.inverse {
            row.drain(block.clone());
        }
        self.inverse.drain(block.clone());
        self.coefficients.drain(block.clone());
        self.columns.drain(block.clone());
        self.products.drain(block.clone());
        let outside = |k: &usize| !block.contains(k);
        for (place, k) in (0..across.len()).filter(outside).enumerate() {
            for i in 0..width {
                axpy(-across[k][i], &beside.given_back[i], &mut self.taken[place]);
                self.coefficients[place] -= weighed[k][i] * own_coefficients[i];
            }
            for (other, l) in (0..across.len()).filter(outside).enumerate() {
                self.inverse[place][other] -= weighed[k].iter().zip(&across[l]).map(|(a, b)| a * b).sum::<f64>();
            }
        }
        (self.drop, self.log_determinant) = (beside.drop, beside.log_determinant);
        self.members.remove(at);
        self.blocks.remove(at);
        for later in &mut self.blocks[at..] {
            *later = later.start - width..later.end - width;
        }
    }

    /// Precision of the columns at `block` beside all other members.
    fn own_precision(&self, block: &[usize]) -> DMatrix<f64> {
        let own = DMatrix::from_fn(block.len(), block.len(), |i, j| {
            0.5 * (self.inverse[block[i]][block[j]] + self.inverse[block[j]][block[i]])
        });
        let inverse = |own: DMatrix<f64>| Cholesky::new(own).map(|cholesky| cholesky.inverse());
        inverse(own).unwrap_or_else(|| DMatrix::zeros(block.len(), block.len()))
    }

    /// The set without the members numbered `without`.
    fn beside(&self, without: &[usize]) -> Beside {
        let block: Vec<usize> = without.iter().flat_map(|at| self.blocks[*at].clone()).collect();
        let width = block.len();
        let precision = self.own_precision(&block);
        let given_back: Vec<Vec<f64>> = (0..width)
            .map(|i| {
                let mut sum = vec![0.0; self.with_residual.len()];
                block.iter().enumerate().for_each(|(j, at)| axpy(precision[(i, j)], &self.taken[*at], &mut sum));
                sum
            })
            .collect();
        let own = DVector::from_fn(width, |i, _| self.coefficients[block[i]]);
        let pulled = &precision * &own;
        let prior_precision: f64 =
            without.iter().map(|at| -2.0 * self.blocks[*at].len() as f64 * libm::log(self.size(self.members[*at]))).sum();
        let of_block = Cholesky::new(precision.clone()).map_or(0.0, |cholesky| log_determinant(&cholesky));
        let kept = || self.members.iter().enumerate().filter(|(at, _)| !without.contains(at));
        let signed = kept()
            .filter(|(_, (hypothesis, _))| one_signed(&self.evidence.candidates.hypotheses[*hypothesis]))
            .map(|(at, _)| {
                let place = self.blocks[at].start;
                let across = DVector::from_fn(width, |i, _| self.inverse[place][block[i]]);
                let variance = self.inverse[place][place] - across.dot(&(&precision * &across));
                (place, self.coefficients[place] - across.dot(&pulled), variance)
            })
            .collect();
        let (candidates, shares) = (self.evidence.candidates, &self.evidence.settings.prior.scale_shares);
        Beside {
            drop: self.drop - own.dot(&pulled),
            log_determinant: self.log_determinant - (of_block - prior_precision),
            count: self.members.len() - without.len(),
            prior: kept().map(|(_, (hypothesis, scale))| candidates.log_odds[*hypothesis] + libm::log(shares[*scale])).sum(),
            signed,
            block,
            given_back,
        }
    }

    /// Evidence and prior of the members, over those of no effect.
    #[must_use]
    pub(super) fn log_posterior(&self) -> f64 {
        self.log_posterior_of(&self.beside(&[]))
    }

    fn log_posterior_of(&self, beside: &Beside) -> f64 {
        if beside.count == 0 {
            return 0.0;
        }
        let level = self.evidence.level(beside.drop);
        let signs: f64 = beside.signed.iter().map(|(_, value, variance)| log_of_sign(*value, level, *variance)).sum();
        log_multiplicity(beside.count) + beside.prior + self.evidence.log_ratio(beside.drop, beside.log_determinant) + signs
    }

    /// All sets that have one effect more than the members.
    #[must_use]
    pub(super) fn extensions(&self) -> Vec<Extension> {
        self.extensions_of(&self.beside(&[]), None)
    }

    /// The log posterior without number `at` of the members, and all sets with another effect in its place.
    #[must_use]
    pub(super) fn exchanges(&self, at: usize) -> (f64, Vec<Extension>) {
        let beside = self.beside(&[at]);
        (self.log_posterior_of(&beside), self.extensions_of(&beside, Some(at)))
    }

    fn extensions_of(&self, beside: &Beside, without: Option<usize>) -> Vec<Extension> {
        let candidates = self.evidence.candidates;
        let mut found = Vec::with_capacity(SCALES * candidates.hypotheses.len());
        for hypothesis in 0..candidates.hypotheses.len() {
            let kept = self.members.iter().enumerate().filter(|(at, _)| Some(*at) != without);
            if candidates.active[hypothesis] && !kept.into_iter().any(|(_, (member, _))| candidates.exclude(*member, hypothesis))
            {
                for scale in 0..SCALES {
                    found.push(Extension { member: (hypothesis, scale), log_posterior: 0.0 });
                }
                let first = found.len() - SCALES;
                let put = |scale: usize, log_posterior: f64| found[first + scale].log_posterior = log_posterior;
                self.extension(beside, hypothesis, 0..SCALES, put);
            }
        }
        found
    }

    /// Log posterior with `member` besides.
    #[must_use]
    pub(super) fn log_posterior_with(&self, member: (usize, usize)) -> f64 {
        let mut found = f64::NEG_INFINITY;
        self.extension(&self.beside(&[]), member.0, member.1..member.1 + 1, |_, log_posterior| found = log_posterior);
        found
    }

    /// Log posterior of the set with `hypothesis` besides, at each of the `scales` of its prior.
    fn extension(&self, beside: &Beside, hypothesis: usize, scales: Range<usize>, mut put: impl FnMut(usize, f64)) {
        let (evidence, candidates) = (&self.evidence, self.evidence.candidates);
        let columns = candidates.columns(hypothesis);
        let width = columns.len();
        let signed = one_signed(&candidates.hypotheses[hypothesis]);
        let prior = log_multiplicity(beside.count + 1) + beside.prior + candidates.log_odds[hypothesis];
        // What the members whose signs are known take of the new columns.
        let of_signed: Vec<Vec<f64>> = beside
            .signed
            .iter()
            .map(|(place, ..)| {
                let mut taken = self.taken[*place][columns.clone()].to_vec();
                for (at, given_back) in beside.block.iter().zip(&beside.given_back) {
                    axpy(-self.inverse[*place][*at], &given_back[columns.clone()], &mut taken);
                }
                taken
            })
            .collect();
        let one: Vec<f64> = (0..width).map(|i| f64::from(u8::from(i == 0))).collect();
        // `variance`: of a sum of the new coefficients with such factors.
        let total = |scale: usize, drop: f64, log_determinant: f64, coefficients: &[f64], variance: &dyn Fn(&[f64]) -> f64| {
            let level = evidence.level(drop);
            let mut total = prior + libm::log(evidence.settings.prior.scale_shares[scale]);
            total += evidence.log_ratio(drop, beside.log_determinant + log_determinant);
            if signed {
                total += log_of_sign(coefficients[0], level, variance(&one));
            }
            for ((_, value, own), taken) in beside.signed.iter().zip(&of_signed) {
                let shift: f64 = taken.iter().zip(coefficients).map(|(taken, value)| taken * value).sum();
                total += log_of_sign(value - shift, level, own + variance(taken));
            }
            total
        };
        let precision = |scale: usize| {
            let size = self.size((hypothesis, scale));
            1.0 / (size * size)
        };
        let given = || beside.block.iter().zip(&beside.given_back);
        let right = |column: usize| {
            self.with_residual[column] + given().map(|(at, back)| back[column] * self.coefficients[*at]).sum::<f64>()
        };
        if width == 1 {
            let column = columns.start;
            let left = self.block(hypothesis)[0] + given().map(|(at, back)| back[column] * self.taken[*at][column]).sum::<f64>();
            let right = right(column);
            for scale in scales {
                let diagonal = left + precision(scale);
                let coefficient = right / diagonal;
                let more = libm::log(diagonal / precision(scale));
                put(scale, total(scale, beside.drop + right * coefficient, more, &[coefficient], &|of| of[0] * of[0] / diagonal));
            }
            return;
        }
        let mut left = DMatrix::from_row_slice(width, width, self.block(hypothesis));
        for (at, back) in given() {
            for i in 0..width {
                axpy(back[columns.start + i], &self.taken[*at][columns.clone()], left.column_mut(i).as_mut_slice());
            }
        }
        let right = DVector::from_fn(width, |i, _| right(columns.start + i));
        for scale in scales {
            let mut matrix = left.clone();
            (0..width).for_each(|i| matrix[(i, i)] += precision(scale));
            let Some(cholesky) = Cholesky::new(matrix) else {
                put(scale, f64::NEG_INFINITY);
                continue;
            };
            let coefficients = cholesky.solve(&right);
            let more = log_determinant(&cholesky) - width as f64 * libm::log(precision(scale));
            let factor = cholesky.l_dirty();
            let variance = |of: &[f64]| {
                let mut of = DVector::from_column_slice(of);
                factor.solve_lower_triangular_mut(&mut of);
                of.norm_squared()
            };
            let drop = beside.drop + right.dot(&coefficients);
            put(scale, total(scale, drop, more, coefficients.as_slice(), &variance));
        }
    }

    /// What survives of `columns` with each other beside the members but those numbered `without`.
    #[must_use]
    pub(super) fn surviving(&self, columns: &[usize], without: &[usize]) -> DMatrix<f64> {
        let beside = self.beside(without);
        let mut left = self.evidence.marginal.between(columns);
        let mut add = |sign: f64, with: &[f64], taken: &[f64]| {
            for (j, other) in columns.iter().enumerate() {
                for (i, column) in columns.iter().enumerate() {
                    left[(i, j)] += sign * with[*column] * taken[*other];
                }
            }
        };
        self.products.iter().zip(&self.taken).for_each(|(with, taken)| add(-1.0, with, taken));
        beside.block.iter().zip(&beside.given_back).for_each(|(at, with)| add(1.0, with, &self.taken[*at]));
        left
    }
}

/// Of a member whose sign physics knows: its coefficient, the noise's mean square, its variance over that.
fn log_of_sign(value: f64, level: f64, variance: f64) -> f64 {
    log_allowed(value / libm::sqrt((level * variance).max(0.0)).max(1e-300))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::evidence::{Candidates, NoisePrior};
    use crate::diagnosis::products::test_marginal;
    use crate::diagnosis::settings::Settings;
    use crate::effects::kind::joint_compliance::Torque;
    use crate::effects::signature::library::Hypothesis;
    use crate::effects::signature::shape::Shape;
    use crate::effects::{Kind, Level, Location};
    use crate::seed::stream;

    /// Sets come and go; what is kept is what each of them says when it is solved in one piece.
    #[test]
    fn what_is_brought_up_to_date_is_what_is_solved_at_once() {
        let widths = [1, 3, 1, 2, 1, 5, 1, 1];
        let kinds = [Some(Kind::JointCompliance), None, Some(Kind::Backlash), Some(Kind::JointEccentricity)];
        let of = |number: usize| Hypothesis {
            share: None,
            kind: if widths[number] == 1 || number == 3 { kinds[number % 4] } else { None },
            location: Location { level: Level::Joint, index: Some(number + 1) },
            shape: Shape::Torque(Torque { joint: number }),
            range: [0.5, 2.0],
            spread: vec![1.0; widths[number]],
            detail: String::new(),
        };
        let hypotheses: Vec<Hypothesis> = (0..widths.len()).map(of).collect();
        assert!(hypotheses.iter().filter(|of| one_signed(of)).count() > 1);
        let first: Vec<usize> = (0..widths.len()).map(|number| widths[..number].iter().sum()).collect();
        let count = widths.len();
        let candidates = Candidates {
            hypotheses,
            first,
            unit: vec![1.0; count],
            widest: vec![f64::INFINITY; count],
            log_odds: (0..count).map(|number| -1.0 - 0.1 * number as f64).collect(),
            active: vec![true; count],
            scanned: count,
        };
        let mut draws = stream(5, "test/fitted");
        let all: usize = widths.iter().sum();
        let mut signatures = DMatrix::from_fn(60, all, |_, _| draws.normal());
        // Some are much alike, so that signs hang on what else is there.
        let alike = signatures.column(0) + signatures.column(6) * 0.2;
        signatures.set_column(6, &alike);
        let residual = signatures.column(0) * 0.4 + DVector::from_fn(60, |_, _| draws.normal());
        let products = test_marginal(&candidates, &signatures, &residual);
        let (marginal, settings) = (products.marginal(), Settings::default());
        let noise = NoisePrior { degrees_of_freedom: 10.0, level: 1.0 };
        let evidence = Evidence { marginal: &marginal, candidates: &candidates, noise, settings: &settings };
        let mut fitted = Fitted::new(&evidence, &[(5, 1)]);
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-9 * b.abs().max(1.0), "{a} {b}");
        for step in 0..60 {
            let members = fitted.members().to_vec();
            near(fitted.log_posterior(), evidence.log_posterior(&members));
            for at in 0..members.len() {
                let mut fewer = members.clone();
                fewer.remove(at);
                let (without, others) = fitted.exchanges(at);
                near(without, evidence.log_posterior(&fewer));
                for extension in others {
                    near(extension.log_posterior, evidence.log_posterior(&[&fewer[..], &[extension.member]].concat()));
                }
            }
            let extensions = fitted.extensions();
            for extension in &extensions {
                near(extension.log_posterior, evidence.log_posterior(&[&members[..], &[extension.member]].concat()));
                near(extension.log_posterior, fitted.log_posterior_with(extension.member));
            }
            // What survives beside all but the first.
            if members.len() > 1 {
                let fewer = Fitted::new(&evidence, &members[1..]);
                let (one, other) = (fitted.surviving(&[1, 2, 7], &[0]), fewer.surviving(&[1, 2, 7], &[]));
                assert!((one - &other).norm() < 1e-9 * other.norm());
            }
            if extensions.is_empty() || (step % 3 == 2 && !members.is_empty()) {
                fitted.remove(draws.index(members.len()));
            } else {
                fitted.add(extensions[draws.index(extensions.len())].member);
            }
        }
    }
}
