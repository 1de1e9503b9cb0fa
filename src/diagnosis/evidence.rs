//! Marginal likelihood of sets of effects, in closed form: linear in the magnitudes, Gaussian priors of physical size, noise level
//! integrated out, geometry integrated out before (see [`super::products`]).

use std::f64::consts::LN_2;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::fitted::Fitted;
use super::products::Marginal;
use super::settings::{Prior, Settings};
use crate::effects::signature::library::Hypothesis;

/// What is known of the noise beforehand: so many readings' worth (degrees of freedom) of a mean square, in declared sigmas.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NoisePrior {
    /// Degrees of freedom.
    pub(crate) degrees_of_freedom: f64,
    /// Mean square over the declared one.
    pub(crate) level: f64,
}

/// The hypotheses in play, and where their columns are.
#[derive(Clone, Debug)]
pub(crate) struct Candidates {
    /// What they are.
    pub(crate) hypotheses: Vec<Hypothesis>,
    /// First column of each.
    pub(crate) first: Vec<usize>,
    /// Magnitude that a coefficient of one stands for.
    pub(crate) unit: Vec<f64>,
    /// Largest standard deviation that a prior of its coefficients may have: no arm has more of it.
    pub(crate) widest: Vec<f64>,
    /// Logarithm of the prior odds of having it over not.
    pub(crate) log_odds: Vec<f64>,
    /// Whether it is in play.
    pub(crate) active: Vec<bool>,
    /// From this number on they were not looked for before the readings were seen: scans of what remained have found them.
    pub(crate) scanned: usize,
}

/// Logarithm of how much likelier a set of `count` effects is beforehand than their own odds say: any number of effects is as likely as
/// any other, and so many there are are found in any order.
pub(super) fn log_multiplicity(count: usize) -> f64 {
    (1..=count).map(|number| libm::log(number as f64)).sum()
}

/// The coefficients of a model.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    /// Columns.
    pub(crate) columns: Vec<usize>,
    /// Posterior means.
    pub(crate) coefficients: DVector<f64>,
    /// Posterior covariance over the noise's mean square.
    pub(crate) covariance: DMatrix<f64>,
    /// Posterior mean of the noise's mean square, in declared sigmas.
    pub(crate) noise: f64,
}

impl Candidates {
    /// Columns of a hypothesis.
    #[must_use]
    pub(crate) fn columns(&self, hypothesis: usize) -> std::ops::Range<usize> {
        self.first[hypothesis]..self.first[hypothesis] + self.hypotheses[hypothesis].spread.len()
    }

    /// Standard deviation of the prior number `scale` of a hypothesis' coefficients.
    #[must_use]
    pub(crate) fn size(&self, prior: &Prior, hypothesis: usize, scale: usize) -> f64 {
        prior.scales[scale].min(self.widest[hypothesis])
    }

    /// Whether both cannot be in one model: they are the same thing.
    #[must_use]
    pub(crate) fn exclude(&self, a: usize, b: usize) -> bool {
        if a == b {
            return true;
        }
        let (a, b) = (&self.hypotheses[a], &self.hypotheses[b]);
        let special_case = |of: &Hypothesis| of.shape.unnamed().and_then(|(_, kind)| kind);
        match (a.kind, b.kind) {
            (Some(x), Some(y)) => x == y && a.location == b.location && !x.descriptor().may_repeat,
            // What bends, seats or yields in another way has the named case in it.
            (Some(kind), None) => a.location.index == b.location.index && special_case(b) == Some(kind),
            (None, Some(kind)) => a.location.index == b.location.index && special_case(a) == Some(kind),
            // Two bumps that overlap are one; so are two generalisations of one kind.
            (None, None) => {
                let alike = special_case(a).is_some() && special_case(a) == special_case(b);
                a.location == b.location && (alike || a.shape.overlaps(&b.shape))
            }
        }
    }
}

/// Whether physics allows only one sign: of what has one coefficient.
#[must_use]
pub(crate) fn one_signed(hypothesis: &Hypothesis) -> bool {
    hypothesis.spread.len() == 1 && hypothesis.kind.is_some_and(|kind| kind.descriptor().one_signed)
}

/// Members fitted together.
struct Solved {
    columns: Vec<usize>,
    factor: Cholesky<f64, Dyn>,
    coefficients: DVector<f64>,
    drop: f64,
    log_determinant: f64,
}

/// The evidence of sets of effects, given what survives of the geometry.
#[derive(Clone, Copy)]
pub(crate) struct Evidence<'a> {
    /// What survives of the geometry.
    pub(crate) marginal: &'a Marginal<'a>,
    /// The hypotheses.
    pub(crate) candidates: &'a Candidates,
    /// What is known of the noise.
    pub(crate) noise: NoisePrior,
    /// What is likely beforehand, and how it is searched.
    pub(crate) settings: &'a Settings,
}

/// An effect more.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extension {
    /// The hypothesis and the scale of its prior.
    pub member: (usize, usize),
    /// Logarithm of the posterior of the whole set over that of the empty set.
    pub log_posterior: f64,
}

impl<'a> Evidence<'a> {
    fn solve(&self, members: &[(usize, usize)]) -> Option<Solved> {
        self.solve_sized(self.sized(members))
    }

    /// `members`, each with the standard deviation of its coefficients' prior.
    fn sized(&self, members: &[(usize, usize)]) -> impl Iterator<Item = (usize, f64)> {
        members.iter().map(|(hypothesis, scale)| (*hypothesis, self.candidates.size(&self.settings.prior, *hypothesis, *scale)))
    }

    /// `members`: hypotheses, each with the standard deviation of its coefficients over the noise's.
    fn solve_sized(&self, members: impl Iterator<Item = (usize, f64)>) -> Option<Solved> {
        let members: Vec<(usize, f64)> = members.collect();
        let (mut columns, mut precision) = (Vec::new(), Vec::new());
        for (hypothesis, size) in &members {
            for column in self.candidates.columns(*hypothesis) {
                columns.push(column);
                precision.push(1.0 / (size * size));
            }
        }
        let count = columns.len();
        let mut products = DMatrix::from_diagonal(&DVector::from_vec(precision.clone()));
        let mut first = 0;
        for (number, (hypothesis, _)) in members.iter().enumerate() {
            let width = self.candidates.columns(*hypothesis).len();
            for (i, j) in (0..width).flat_map(|i| (0..width).map(move |j| (i, j))) {
                products[(first + i, first + j)] += self.marginal.own(*hypothesis, i, j);
            }
            // Of two members the first one's products are asked for: who is only tried stands last, and its own are never made.
            if number + 1 < members.len() {
                for i in first..first + width {
                    let row = self.marginal.row(columns[i]);
                    for j in first + width..count {
                        (products[(i, j)], products[(j, i)]) = (row[columns[j]], row[columns[j]]);
                    }
                }
            }
            first += width;
        }
        let right = DVector::from_fn(count, |i, _| self.marginal.with_residual[columns[i]]);
        let cholesky = Cholesky::new(products)?;
        let coefficients = cholesky.solve(&right);
        let drop = right.dot(&coefficients);
        let factor = cholesky.l_dirty();
        let log_determinant = (0..count).map(|i| 2.0 * libm::log(factor[(i, i)]) - libm::log(precision[i])).sum::<f64>();
        Some(Solved { columns, factor: cholesky, coefficients, drop, log_determinant })
    }

    /// Logarithm of the evidence over that of no effect.
    pub(super) fn log_ratio(&self, drop: f64, log_determinant: f64) -> f64 {
        let before = self.noise.degrees_of_freedom * self.noise.level + self.marginal.residual;
        let after = (before - drop).max(1e-9 * before);
        let degrees = self.noise.degrees_of_freedom + self.marginal.degrees_of_freedom;
        -0.5 * log_determinant - 0.5 * degrees * libm::log(after / before)
    }

    /// Posterior mean of the noise's mean square, in declared sigmas, where members explain so much.
    pub(super) fn level(&self, drop: f64) -> f64 {
        (self.noise.degrees_of_freedom * self.noise.level + self.marginal.residual - drop).max(1e-12)
            / (self.noise.degrees_of_freedom + self.marginal.degrees_of_freedom)
    }

    /// Evidence and prior of `members` together, over those of no effect.
    #[must_use]
    pub(crate) fn log_posterior(&self, members: &[(usize, usize)]) -> f64 {
        if members.is_empty() {
            return 0.0;
        }
        let Some(model) = self.solve(members) else {
            return f64::NEG_INFINITY;
        };
        let level = self.level(model.drop);
        let mut at = 0;
        let mut total = self.log_ratio(model.drop, model.log_determinant) + log_multiplicity(members.len());
        for (hypothesis, scale) in members {
            total += self.candidates.log_odds[*hypothesis] + libm::log(self.settings.prior.scale_shares[*scale]);
            if one_signed(&self.candidates.hypotheses[*hypothesis]) {
                let mut unit = DVector::zeros(model.columns.len());
                unit[at] = 1.0;
                let variance = model.factor.solve(&unit)[at];
                total += log_allowed(model.coefficients[at] / libm::sqrt(level * variance).max(1e-300));
            }
            at += self.candidates.columns(*hypothesis).len();
        }
        total
    }

    /// Logarithm of the evidence of `others` with `hypothesis` over that of `others` alone, where its coefficients have the standard
    /// deviation `size`; without any prior of it being there.
    pub(super) fn log_gain(&self, others: &[(usize, usize)], hypothesis: usize, size: f64) -> f64 {
        let ratio =
            |model: Option<Solved>| model.map_or(f64::NEG_INFINITY, |model| self.log_ratio(model.drop, model.log_determinant));
        ratio(self.solve_sized(self.sized(others).chain([(hypothesis, size)]))) - ratio(self.solve(others))
    }

    /// What survives of the geometry of what `those` of `members` do together, as a sum of squares in sigmas of the noise that
    /// `members` leave.
    pub(super) fn energy(&self, members: &[(usize, usize)], those: impl Fn(usize) -> bool) -> f64 {
        let Some(model) = self.solve(members) else {
            return 0.0;
        };
        let counts = members.iter().flat_map(|(hypothesis, _)| self.candidates.columns(*hypothesis).map(|_| those(*hypothesis)));
        let own: Vec<(usize, f64)> = model
            .columns
            .iter()
            .zip(model.coefficients.iter())
            .zip(counts)
            .filter(|(_, counts)| *counts)
            .map(|((column, value), _)| (*column, *value))
            .collect();
        let sum = |(column, value): &(usize, f64)| {
            let row = self.marginal.row(*column);
            own.iter().map(|(other, of_other)| value * row[*other] * of_other).sum::<f64>()
        };
        own.iter().map(sum).sum::<f64>() / self.level(model.drop)
    }

    /// How much of `hypothesis`, one of `members`, those of them take back that fulfil `those`: as a coefficient (root mean square, where
    /// it has several), nothing where they do not.
    pub(super) fn cancelled(&self, members: &[(usize, usize)], those: impl Fn(usize) -> bool, hypothesis: usize) -> f64 {
        let Some(model) = self.solve(members) else {
            return 0.0;
        };
        let of = members.iter().flat_map(|(member, _)| self.candidates.columns(*member).map(move |_| *member));
        let (mut square, mut product, mut sum, mut count) = (0.0, 0.0, 0.0, 0.0);
        let values: Vec<(usize, usize, f64)> = of
            .zip(&model.columns)
            .zip(model.coefficients.iter())
            .map(|((member, column), value)| (member, *column, *value))
            .collect();
        for (_, column, value) in values.iter().filter(|(member, ..)| *member == hypothesis) {
            let row = self.marginal.row(*column);
            for (member, other, of_other) in &values {
                let both = value * row[*other] * of_other;
                square += if *member == hypothesis { both } else { 0.0 };
                product += if those(*member) { both } else { 0.0 };
            }
            (sum, count) = (sum + value * value, count + 1.0);
        }
        (-product / square.max(1e-300)).max(0.0) * libm::sqrt(sum / f64::max(count, 1.0))
    }

    /// Logarithm of the marginal likelihood of the readings with `members`, up to what does not depend on members and on the
    /// geometry's prior: for the comparison of such priors. What the prior says counts as readings do, so that as many numbers are
    /// explained whatever it is.
    #[must_use]
    pub(crate) fn log_likelihood(&self, members: &[(usize, usize)]) -> f64 {
        let (drop, log_determinant) = self.solve(members).map_or((0.0, 0.0), |model| (model.drop, model.log_determinant));
        let degrees = self.noise.degrees_of_freedom + self.marginal.beyond_free;
        let left = self.noise.degrees_of_freedom * self.noise.level + self.marginal.residual - drop;
        self.marginal.log_geometry - 0.5 * log_determinant - 0.5 * degrees * libm::log(left.max(1e-12))
    }

    /// Posterior mean of the noise's mean square beside `members`, in declared sigmas.
    #[must_use]
    pub(crate) fn noise_level(&self, members: &[(usize, usize)]) -> f64 {
        self.level(self.solve(members).map_or(0.0, |model| model.drop))
    }

    /// The coefficients of `members`.
    #[must_use]
    pub(crate) fn fit(&self, members: &[(usize, usize)]) -> Option<Fit> {
        let model = self.solve(members)?;
        Some(Fit {
            noise: self.level(model.drop),
            columns: model.columns,
            coefficients: model.coefficients,
            covariance: model.factor.inverse(),
        })
    }

    /// Columns and coefficients of `members`.
    #[must_use]
    pub(crate) fn coefficients(&self, members: &[(usize, usize)]) -> Vec<(usize, f64)> {
        let solved = self.solve(members);
        solved.map_or_else(Vec::new, |model| model.columns.into_iter().zip(model.coefficients.iter().copied()).collect())
    }

    /// All sets that have one effect more than `members`.
    #[must_use]
    pub(crate) fn extensions(&self, members: &[(usize, usize)]) -> Vec<Extension> {
        Fitted::new(self, members).extensions()
    }
}

/// Logarithm of the share of the posterior that physics allows (a magnitude above 0), over that of the prior (a half). `z`: the
/// magnitude over its sigma.
pub(super) fn log_allowed(z: f64) -> f64 {
    // Far below, the tail is so thin that its logarithm is what counts.
    if z > 6.0 {
        LN_2
    } else if z < -6.0 {
        -0.5 * z * z - libm::log(-z) - 0.919 + 0.693
    } else {
        libm::log(libm::erfc(-z * std::f64::consts::FRAC_1_SQRT_2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::products::test_marginal;
    use crate::diagnosis::settings::SCALES;
    use crate::effects::kind::joint_compliance::Torque;
    use crate::effects::signature::shape::Shape;
    use crate::effects::{Kind, Level, Location};
    use crate::seed::stream;

    /// The normal distribution's table, and its tail's first term far out.
    #[test]
    fn the_share_that_physics_allows_is_that_of_the_normal_distribution() {
        for (z, share) in [(0.0, 0.5), (1.0, 0.841_345), (-1.0, 0.158_655), (-3.0, 0.001_349_898), (6.5, 1.0)] {
            let found = 0.5 * log_allowed(z).exp();
            assert!((found / share - 1.0).abs() < 1e-5, "{z}: {found}");
        }
        assert!((log_allowed(-6.0 - 1e-9) - log_allowed(-6.0 + 1e-9)).abs() < 0.03);
    }

    /// A compliance is positive; one of several coefficients, of which each may point anywhere, has no sign.
    #[test]
    fn one_sign_holds_for_one_coefficient() {
        let of = |columns: usize| Hypothesis {
            share: None,
            kind: Some(Kind::JointCompliance),
            location: Location { level: Level::Joint, index: Some(1) },
            shape: Shape::Torque(Torque { joint: 0 }),
            range: [0.5, 2.0],
            spread: vec![1.0; columns],
            detail: String::new(),
        };
        let candidates = |columns: usize| Candidates {
            hypotheses: vec![of(columns)],
            first: vec![0],
            unit: vec![1.0],
            widest: vec![f64::INFINITY],
            log_odds: vec![-1.0],
            active: vec![true],
            scanned: 1,
        };
        let (noise, settings) = (NoisePrior { degrees_of_freedom: 10.0, level: 1.0 }, Settings::default());
        let mut draws = stream(4, "test/one-signed");
        let both = DMatrix::from_fn(80, 2, |_, _| draws.normal());
        let errors = DVector::from_fn(80, |_, _| draws.normal());
        let value = |columns: usize, sign: f64| {
            let (candidates, signatures) = (candidates(columns), both.columns(0, columns).into_owned());
            let residual = (&errors + signatures.column(0)) * sign;
            let products = test_marginal(&candidates, &signatures, &residual);
            let marginal = products.marginal();
            let evidence = Evidence { marginal: &marginal, candidates: &candidates, noise, settings: &settings };
            let found = evidence.extensions(&[]);
            assert_eq!(found.len(), SCALES);
            for one in &found {
                let whole = evidence.log_posterior(&[one.member]);
                assert!((one.log_posterior - whole).abs() < 1e-9 * whole.abs().max(1.0), "{one:?} against {whole}");
            }
            found[0].log_posterior
        };
        assert!(value(1, 1.0) > value(1, -1.0) + 10.0);
        assert!((value(2, 1.0) - value(2, -1.0)).abs() < 1e-9);
    }

    /// Two columns that are nearly the same, one large against the other; and a third that has nothing to do with them.
    #[test]
    fn what_is_taken_back_counts_and_what_stands_beside_does_not() {
        let of = |joint: usize| Hypothesis {
            share: None,
            kind: Some(Kind::JointCompliance),
            location: Location { level: Level::Joint, index: Some(joint + 1) },
            shape: Shape::Torque(Torque { joint }),
            range: [0.5, 2.0],
            spread: vec![1.0],
            detail: String::new(),
        };
        let candidates = Candidates {
            hypotheses: (0..3).map(of).collect(),
            first: (0..3).collect(),
            unit: vec![1.0; 3],
            widest: vec![f64::INFINITY; 3],
            log_odds: vec![-1.0; 3],
            active: vec![true; 3],
            scanned: 3,
        };
        let mut draws = stream(12, "test/cancelled");
        let mut signatures = DMatrix::from_fn(400, 3, |_, _| 100.0 * draws.normal());
        let alike = signatures.column(0) + signatures.column(1) * 0.1;
        signatures.set_column(1, &alike);
        let apart = signatures.column(2)
            - signatures.column(0) * (signatures.column(0).dot(&signatures.column(2)) / signatures.column(0).norm_squared());
        signatures.set_column(2, &apart);
        let residual = signatures.column(0) * 2.0 - signatures.column(1) * 1.5 + signatures.column(2) * 3.0;
        let products = test_marginal(&candidates, &signatures, &residual);
        let (marginal, settings) = (products.marginal(), Settings::default());
        let noise = NoisePrior { degrees_of_freedom: 100.0, level: 1.0 };
        let evidence = Evidence { marginal: &marginal, candidates: &candidates, noise, settings: &settings };
        let members = [(0, 3), (1, 3), (2, 3)];
        // Of 2 the other takes 1.5 back.
        let taken = evidence.cancelled(&members, |member| member == 1, 0);
        assert!((taken - 1.5).abs() < 0.1, "{taken}");
        let beside = evidence.cancelled(&members, |member| member == 2, 0);
        assert!(beside < 0.01, "{beside}");
    }
}
