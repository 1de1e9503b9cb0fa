//! Held-out errors: the gap between geometry and noise, and what the effects close of it.

use super::Analysis;
use super::held_out::{Fold, HeldOut};
use super::outcome::{Blocked, Gap, LeftOut};
use crate::numerics::distribution::student_quantile;

/// The folds by region, and the noise that no model goes below.
pub(super) struct Closing<'a> {
    /// By region.
    pub(super) folds: &'a [Fold],
    /// RMS length of the noise of a position, m.
    noise_rms_m: f64,
    /// In other ways.
    others: &'a [HeldOut],
    /// Square of a gap over that of the noise above which shares of it mean something.
    least: f64,
}

impl<'a> Closing<'a> {
    /// `position_m`: noise, one sigma per axis.
    pub(super) fn new(analysis: &'a Analysis<'_>, position_m: f64) -> Closing<'a> {
        let (folds, others) = match analysis.held_out.split_first() {
            Some((by_region, others)) => (by_region.folds.as_slice(), others),
            None => (&[][..], &[][..]),
        };
        let equations = &analysis.linear.rows.equations;
        let read: usize = (0..equations.readings()).map(|row| equations.of_position(row).len()).sum();
        let axes = read as f64 / equations.readings() as f64;
        Closing { folds, noise_rms_m: libm::sqrt(axes) * position_m, others, least: analysis.options.settings.decision.gap }
    }

    /// Of a sum over the readings of all folds.
    fn rms(&self, squares: f64) -> f64 {
        let rows: f64 = self.folds.iter().map(|fold| fold.rows as f64).sum::<f64>().max(1.0);
        libm::sqrt(squares / rows)
    }

    /// Held-out RMS with what was chosen without each fold, m.
    pub(super) fn explained(&self) -> f64 {
        self.rms(self.folds.iter().map(|fold| fold.explained).sum())
    }

    /// Held-out RMS with the first `count` effects of the best set of all readings, each as large as the other folds say, m.
    pub(super) fn after(&self, count: usize) -> f64 {
        self.rms(self.folds.iter().map(|fold| fold.with(count)).sum())
    }

    /// Share of the gap that a step from one RMS to another closes.
    pub(super) fn closed(&self, before: f64, after: f64) -> Option<f64> {
        let floor2 = self.noise_rms_m * self.noise_rms_m;
        let gap = before * before - floor2;
        (gap > self.least * floor2 && gap > 0.0).then(|| 1.0 - (after * after - floor2) / gap)
    }

    /// 95 % interval of the share closed, from the folds.
    fn interval(&self) -> Option<[f64; 2]> {
        let of_folds: Vec<f64> = self
            .folds
            .iter()
            .filter_map(|fold| {
                let mean = |squares: f64| libm::sqrt(squares / fold.rows as f64);
                self.closed(mean(fold.geometry), mean(fold.explained))
            })
            .collect();
        let n = of_folds.len() as f64;
        let mean = of_folds.iter().sum::<f64>() / n;
        let variance = of_folds.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / (n - 1.0);
        let half = student_quantile(0.975, n - 1.0)? * libm::sqrt(variance / n);
        (n > 2.0).then_some([mean - half, mean + half])
    }

    /// All of it.
    pub(super) fn gap(&self) -> Gap {
        let geometry_rms_m = self.rms(self.folds.iter().map(|fold| fold.geometry).sum());
        let explained_rms_m = self.explained();
        // Where nothing is used nothing is closed.
        let uses_any = self.folds.iter().any(|fold| fold.used > 0);
        let gap_closed = self.closed(geometry_rms_m, explained_rms_m).filter(|_| uses_any);
        Gap {
            nominal_rms_m: self.rms(self.folds.iter().map(|fold| fold.nominal).sum()),
            geometry_rms_m,
            explained_rms_m,
            noise_rms_m: self.noise_rms_m,
            gap_closed,
            gap_closed_ci95: gap_closed.and_then(|_| self.interval()),
            folds: self.folds.len(),
            blocked: self.others.iter().filter_map(blocked).collect(),
        }
    }
}

/// Held-out RMS in one way of leaving out.
fn blocked(held_out: &HeldOut) -> Option<Blocked> {
    let rows: usize = held_out.folds.iter().map(|fold| fold.rows).sum();
    let rms = |squares: f64| libm::sqrt(squares / rows as f64);
    (rows > 0).then(|| Blocked {
        by: held_out.by,
        folds: held_out.folds.len(),
        nominal_rms_m: rms(held_out.folds.iter().map(|fold| fold.nominal).sum()),
        geometry_rms_m: rms(held_out.folds.iter().map(|fold| fold.geometry).sum()),
        explained_rms_m: rms(held_out.folds.iter().map(|fold| fold.explained).sum()),
        left_out: held_out
            .folds
            .iter()
            .map(|fold| {
                let rms = |squares: f64| libm::sqrt(squares / fold.rows as f64);
                LeftOut {
                    name: fold.name.clone(),
                    readings: fold.rows,
                    geometry_rms_m: rms(fold.geometry),
                    explained_rms_m: rms(fold.explained),
                }
            })
            .collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::held_out::Block;
    use crate::diagnosis::tests::fold_of;

    /// Folds of ten readings with so many squares of the noise, of one each.
    fn closing(folds: &[Fold]) -> Closing<'_> {
        Closing { folds, noise_rms_m: 1.0, others: &[], least: 0.02 }
    }

    #[test]
    fn shares_of_the_gap_add_up() {
        let of = closing(&[]);
        let close = |found: Option<f64>, share: f64| assert!((found.unwrap() - share).abs() < 1e-12, "{found:?}");
        close(of.closed(2.0, 1.0), 1.0);
        close(of.closed(2.0, 2.0), 0.0);
        // Squares add: of 4 over 1, the middle is 2.5.
        close(of.closed(2.0, 2.5_f64.sqrt()), 0.5);
        assert!(of.closed(2.0, 3.0).unwrap() < 0.0);
        // What is above the noise by a hundredth of its square is no gap.
        assert_eq!(of.closed(1.01_f64.sqrt(), 1.0), None);
        assert!(of.closed(1.03_f64.sqrt(), 1.0).is_some());
        assert_eq!(of.closed(0.5, 0.4), None);
    }

    /// Of a gap of two squares 0.8, 0.4 and nothing are left: shares of 0.6, 0.8 and 1, of mean 0.8 and standard deviation 0.2. Student's t
    /// of two degrees of freedom is 4.3027.
    #[test]
    fn the_interval_is_that_of_student() {
        let folds = [1.8, 1.4, 1.0].map(|square| fold_of([500.0, 30.0, 10.0 * square], &[], vec![0]));
        let [low, high] = closing(&folds).interval().unwrap();
        let half = 4.302_653 * 0.2 / 3_f64.sqrt();
        assert!((low - (0.8 - half)).abs() < 1e-5 && (high - (0.8 + half)).abs() < 1e-5, "{low} {high}");
        // Two folds have no interval.
        assert_eq!(closing(&folds[..2]).interval(), None);
    }

    #[test]
    fn held_out_errors_are_of_all_folds_together() {
        let folds = [fold_of([500.0, 40.0, 10.0], &[20.0, 10.0], vec![0]), fold_of([500.0, 140.0, 10.0], &[60.0], vec![0])];
        let of = closing(&folds);
        // Twenty readings: squares of 180, then 80, then 70 (the second fold has one effect only).
        let near = |found: f64, squares: f64| assert!((found - (squares / 20.0).sqrt()).abs() < 1e-12, "{found} {squares}");
        near(of.after(0), 180.0);
        near(of.after(1), 80.0);
        near(of.after(2), 70.0);
        near(of.explained(), 20.0);
        let gap = of.gap();
        near(gap.nominal_rms_m, 1000.0);
        assert!((gap.gap_closed.unwrap() - 1.0).abs() < 1e-12);
        // Where no fold uses anything nothing is closed, whatever the numbers.
        let idle = [fold_of([500.0, 40.0, 10.0], &[], Vec::new())];
        assert_eq!(closing(&idle).gap().gap_closed, None);
        let other = HeldOut { by: Block::Payload, folds: folds.to_vec() };
        let of_payload = blocked(&other).unwrap();
        near(of_payload.geometry_rms_m, 180.0);
        assert!((of_payload.left_out[1].geometry_rms_m - 14_f64.sqrt()).abs() < 1e-12);
        assert!(blocked(&HeldOut { by: Block::Session, folds: Vec::new() }).is_none());
    }
}
