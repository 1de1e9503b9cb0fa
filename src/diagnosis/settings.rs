//! The numbers that decide what a diagnosis says, with their units and reasons (those of a method's grids and tolerances stand with it). A diagnosis carries those that it was made with, a
//! recording keeps them, a replay uses what was recorded; `--set diagnosis.GROUP.NAME=VALUE` changes one.

use std::ops::RangeInclusive;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Prior scales of a magnitude ([`Prior::scales`]).
pub const SCALES: usize = 4;

/// A setting that no diagnosis can be made with: which one, what it is, what is allowed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key} = {found}: allowed is {allowed}")]
pub struct NotAllowed {
    /// `diagnosis.GROUP.NAME`.
    pub key: String,
    /// What was given.
    pub found: String,
    /// What could be.
    pub allowed: String,
}

/// Probabilities, shares.
const SHARE: RangeInclusive<f64> = 0.0..=1.0;
/// Degrees of freedom.
const DEGREES: RangeInclusive<f64> = 0.1..=1e6;
/// No upper limit that anybody would reach.
const MANY: f64 = 1e6;

trait Checked {
    /// Whether everything of `key` is in the range that is `allowed`.
    fn check(&self, key: &str, allowed: Option<RangeInclusive<f64>>) -> Result<(), NotAllowed>;
}

impl Checked for f64 {
    fn check(&self, key: &str, allowed: Option<RangeInclusive<f64>>) -> Result<(), NotAllowed> {
        match allowed {
            Some(range) if !range.contains(self) => Err(NotAllowed {
                key: key.to_owned(),
                found: self.to_string(),
                allowed: format!("{} to {}", range.start(), range.end()),
            }),
            _ => Ok(()),
        }
    }
}

impl Checked for usize {
    fn check(&self, key: &str, allowed: Option<RangeInclusive<f64>>) -> Result<(), NotAllowed> {
        (*self as f64).check(key, allowed)
    }
}

impl Checked for u8 {
    fn check(&self, key: &str, allowed: Option<RangeInclusive<f64>>) -> Result<(), NotAllowed> {
        f64::from(*self).check(key, allowed)
    }
}

impl<T: Checked, const N: usize> Checked for [T; N] {
    fn check(&self, key: &str, allowed: Option<RangeInclusive<f64>>) -> Result<(), NotAllowed> {
        self.iter().try_for_each(|one| one.check(key, allowed.clone()))
    }
}

impl<T: Checked> Checked for Vec<T> {
    fn check(&self, key: &str, allowed: Option<RangeInclusive<f64>>) -> Result<(), NotAllowed> {
        if self.is_empty() {
            let [found, allowed] = ["[]", "one number at least"].map(str::to_owned);
            return Err(NotAllowed { key: key.to_owned(), found, allowed });
        }
        self.iter().try_for_each(|one| one.check(key, allowed.clone()))
    }
}

macro_rules! settings {
    ($($(#[$of_group:meta])* $group:ident { $($(#[$of_number:meta])* $name:ident: $kind:ty = $value:expr $(=> $allowed:expr)?,)* })*) => {
        $(
            $(#[$of_group])*
            #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
            #[serde(default, deny_unknown_fields)]
            pub struct $group {
                $($(#[$of_number])* pub $name: $kind,)*
            }

            impl Default for $group {
                fn default() -> Self {
                    $group { $($name: $value,)* }
                }
            }

            impl Checked for $group {
                fn check(&self, key: &str, _: Option<RangeInclusive<f64>>) -> Result<(), NotAllowed> {
                    $(
                        let allowed: Option<RangeInclusive<f64>> = None$(.or(Some($allowed)))?;
                        self.$name.check(&format!("{key}.{}", stringify!($name)), allowed)?;
                    )*
                    Ok(())
                }
            }
        )*
    };
}

settings! {
    /// All of them.
    Settings {
        /// What tells the noise.
        noise: Noise = Noise::default(),
        /// How the linear problem is made.
        model: Model = Model::default(),
        /// What is likely before any reading is looked at.
        prior: Prior = Prior::default(),
        /// The search over sets of effects.
        search: Search = Search::default(),
        /// Gear ripple of any tooth count.
        ripple: Ripple = Ripple::default(),
        /// Joints that do not repeat.
        scatter: Scatter = Scatter::default(),
        /// Readings that are far off.
        outliers: Outliers = Outliers::default(),
        /// Readings that are left out, and structure that remains.
        validation: Validation = Validation::default(),
        /// What is said.
        decision: Decision = Decision::default(),
        /// What would have shown.
        power: Power = Power::default(),
        /// Which way gravity acts.
        gravity: Gravity = Gravity::default(),
    }

    /// What tells the noise.
    Noise {
        /// Joint readings that differ by less are of one configuration, rad or m: commanded values come back rounded, or as encoders see
        /// them.
        same_configuration: f64 = 2e-4 => 0.0..=1.0,
        /// Temperatures that differ by less are the same, K: what a sensor on a link tells.
        same_temperature_k: f64 = 0.5 => 0.0..=1e3,
        /// Pairs of equal readings that a noise needs: a variance from fewer is worth nothing.
        contrasts: usize = 3 => 1.0..=MANY,
        /// Pairs of alike readings from which their correlation is estimated rather than taken as a half.
        pairs: f64 = 6.0 => 1.0..=MANY,
        /// Degrees of freedom of what repeats without a move tell: they show the sensor, not the arm.
        unmoved_degrees: f64 = 4.0 => DEGREES,
        /// Of what repeats with a move tell, at most: other conditions than theirs are measured, too.
        repeats_degrees: f64 = 20.0 => DEGREES,
        /// Of what a data sheet or the user says.
        declared_degrees: f64 = 10.0 => DEGREES,
        /// Of what nobody says.
        assumed_degrees: f64 = 1.0 => DEGREES,
        /// Correlation of what is left of readings of one configuration from which on it is the configuration's.
        alike: f64 = 0.9 => SHARE,
        /// Degrees of freedom of repeats from which on they tell the orientations' noise beside the positions'.
        orientation_degrees: f64 = 36.0 => 1.0..=MANY,
        /// Mean square, over what is said of the noise, beyond which what is left is no noise.
        no_noise: f64 = 9.0 => 1.0..=MANY,
        /// Beyond chance, a difference of the logarithms of two sigmas that matters.
        log_sigma_matters: f64 = 0.1 => 0.0..=10.0,
        /// Standard errors that are chance.
        standard_errors: f64 = 3.0 => 0.0..=100.0,
        /// Correlation of readings of one configuration that is taken where there are too few pairs to estimate it.
        few_pairs_correlation: f64 = 0.5 => SHARE,
        /// Weight for being far off above which a row tells how alike readings of one configuration are.
        near: f64 = 0.5 => SHARE,
        /// Weight, all reasons together, above which a row tells how exact orientations are beside positions.
        counted: f64 = 0.3 => SHARE,
    }

    /// How the linear problem is made.
    Model {
        /// Rounds of fitting around what was found, at most.
        passes: usize = 12 => 1.0..=100.0,
        /// Effects of the first pass at most; twice as many in the next one, and so on.
        first: usize = 4 => 1.0..=100.0,
        /// Passes in which the geometry's prior is chosen.
        choosing: usize = 3 => 1.0..=100.0,
        /// Sigmas of the geometry's prior over those of manufacturing (5 mm, 10 mrad) that are tried: the readings say how far the arm is
        /// from nominal.
        geometry_scales: Vec<f64> = crate::identification::prior::SCALES.to_vec() => 1e-6..=1e3,
        /// Of the noise, the difference between loads as they are and as they are read that is worth trying both.
        loads_matter: f64 = 0.3 => 0.0..=MANY,
        /// Passes in which both are tried: those in which the geometry's prior is chosen, and two around it.
        loads_passes: usize = 5 => 0.0..=100.0,
        /// Of the noise, the movement of a target from pass to pass that is nothing.
        settled: f64 = 0.1 => 0.0..=MANY,
        /// Change of a row's weight from pass to pass that is nothing.
        settled_weight: f64 = 1e-2 => 0.0..=1.0,
        /// What is typically left of the positions may grow by so much from pass to pass: more, and effects were taken larger than first
        /// order tells.
        grows: f64 = 2.0 => 1.0..=MANY,
        /// How often the way to what was found is halved then.
        halvings: usize = 3 => 0.0..=100.0,
        /// A joint is upright where its torque never exceeds so many sigmas of what is not known of it: its axis leans by less than a degree,
        /// and which way its foot leans decides on which side its play is seated.
        upright: f64 = 6.0 => 0.0..=MANY,
        /// Moments of a step that are tried at most.
        change_points: usize = 80 => 1.0..=MANY,
        /// Share of the readings that a step leaves before it and after it at least.
        change_margin: f64 = 0.02 => 0.0..=0.5,
        /// The same as a number of readings: fewer do not tell where the base then stands.
        change_margin_readings: usize = 3 => 1.0..=MANY,
        /// Fitted errors of a frame over their prior's sigma beyond which it is another robot, or its readings are wrong.
        implausible: f64 = 12.0 => 1.0..=MANY,
        /// What remains (RMS) over the arm's reach beyond which it is another robot.
        astray: f64 = 0.05 => 1e-6..=MANY,
        /// Share of the readings that must not be far off from what geometry makes of the others, so that the others are judged without them.
        of_this_robot: f64 = 0.6 => SHARE,
        /// Change of a temperature within the session below which no thermal effect can be looked for, K.
        temperature_k: f64 = 0.05 => 0.0..=100.0,
        /// Reach below which an arm counts as one of this reach there, m.
        small_arm_m: f64 = 0.1 => 1e-6..=MANY,
        /// What remains of orientations (RMS, rad) beyond which it is another robot.
        astray_rad: f64 = 0.1 => 1e-6..=MANY,
    }

    /// What is likely before any reading is looked at.
    Prior {
        /// Odds of one effect.
        odds: f64 = 1.0 => 1e-12..=1e12,
        /// Share of shapes without a name.
        unnamed: f64 = 0.25 => SHARE,
        /// Of what an unknown cause does, in squares: how much of it a signature at the same place may have by being the difference between
        /// the cause and the shape that stands for it.
        misfit: f64 = 0.05 => SHARE,
        /// λ at the upper end of the realistic range below which a hypothesis has no information in the data.
        no_information: f64 = 4.0 => 0.0..=MANY,
        /// Standard deviations of a magnitude in units of its usual one: of usual arms, of worse ones, of desktop arms, of hobby and
        /// cable-driven arms.
        scales: [f64; SCALES] = [1.0, 2.5, 12.0, 150.0] => 1e-6..=1e6,
        /// How likely each of them is.
        scale_shares: [f64; SCALES] = [0.44, 0.44, 0.10, 0.02] => SHARE,
    }

    /// Which way gravity acts, where nobody said.
    Gravity {
        /// How much likelier, as a logarithm, robots stand upright than on a certain wall or ceiling.
        wall: f64 = 7.0 => 0.0..=MANY,
        /// The same of any slope, the choice among all of them included.
        slope: f64 = 15.0 => 0.0..=MANY,
        /// Share of what geometry, errors of the joints' angles and yielding of an upright arm leave beyond the noise that yielding under
        /// it explains at least.
        explains: f64 = 0.5 => SHARE,
        /// Angle from upright below which nothing is said, rad.
        apart_rad: f64 = 0.1 => 0.0..=3.2,
    }

    /// The search over sets of effects.
    Search {
        /// Effects of a set at most.
        most: usize = 24 => 1.0..=24.0,
        /// Rounds of the walk: in each, every cause is drawn anew once.
        rounds: usize = 16 => 1.0..=1e3,
        /// Probability from which on a cause needs no more rounds.
        certain: f64 = 0.995 => SHARE,
        /// Places for causes that are not in the likeliest set.
        spare: usize = 1 => 0.0..=24.0,
        /// Number (from 0) of the prior scale of a member for which none was chosen: that of worse arms than usual.
        stand_in_scale: usize = 1 => 0.0..=(SCALES - 1) as f64,
    }

    /// Gear ripple of any tooth count.
    Ripple {
        /// Drop of the residual's square, in squares of the noise, from which on a ripple is worth a hypothesis: what the strongest of some
        /// thousands reaches by chance.
        worth: f64 = 16.0 => 0.0..=MANY,
        /// Ripples taken from one scan.
        most: usize = 3 => 0.0..=100.0,
    }

    /// Joints that do not repeat.
    Scatter {
        /// Times that what was found is looked through for them.
        looks: usize = 3 => 0.0..=100.0,
        /// Smallest sigma of a joint's scatter, rad or m; the others are a root of two larger each.
        smallest: f64 = 5e-6 => 1e-9..=1.0,
        /// Sigmas looked at.
        steps: u8 = 18 => 1.0..=60.0,
        /// Joints that may scatter.
        most: usize = 2 => 0.0..=100.0,
        /// Standard deviations by which residuals must point along the joint's motion.
        along: f64 = 3.5 => 0.0..=MANY,
        /// Held-out RMS with joints that do not repeat, over that without, from which on there are none.
        worse: f64 = 1.03 => 0.0..=MANY,
        /// Ratio of two sigmas of a joint's scatter, from and to, that are the same: within about a step.
        alike: [f64; 2] = [0.7, 1.5] => 0.0..=MANY,
    }

    /// Readings that are far off.
    Outliers {
        /// Prior odds that there are any.
        odds: f64 = 0.04 => 1e-12..=1e12,
        /// From this probability on they are there, and rows are taken for such.
        there: f64 = 0.5 => SHARE,
        /// Probability from which on a row is one of them.
        row: f64 = 0.99 => SHARE,
        /// Their noise over that of the others from which on they are named.
        factor: f64 = 4.0 => 1.0..=MANY,
        /// The same beside something unknown, or a map of a joint's angle: a misfit has tails, too.
        factor_beside_unknown: f64 = 9.0 => 1.0..=MANY,
        /// Shares of the readings that are tried, each as likely.
        shares: Vec<f64> = vec![0.02, 0.03, 0.05, 0.08, 0.12, 0.18, 0.3] => 1e-6..=0.999,
        /// Their noise over that of the others that is tried, each as likely.
        factors: Vec<f64> = vec![4.0, 6.0, 9.0, 14.0, 20.0, 40.0, 100.0, 300.0, 1e3, 1e4] => 1.0..=MANY,
        /// The mean square of good readings is not known well and is averaged over: from value to value its logarithm goes on by so much.
        level_step: f64 = 0.08 => 1e-6..=10.0,
        /// Steps of it to either side of what it looks like.
        level_steps: u8 = 6 => 0.0..=60.0,
        /// Share of the readings whose side of play is known from which on they alone tell the share of those far off.
        decided: f64 = 0.5 => SHARE,
    }

    /// Readings that are left out, and structure that remains.
    Validation {
        /// Folds.
        folds: usize = 5 => 2.0..=100.0,
        /// Configurations per region at least; where there are fewer there are fewer regions, but never less than two.
        configurations: usize = 4 => 1.0..=MANY,
        /// Share of the readings that must be left without a fold: fewer would hardly tell where the arm stands.
        left: f64 = 0.25 => SHARE,
        /// Largest gain of a fold that counts against the losses of others, as a logarithm of mean squares.
        largest_gain: f64 = 1.0 => 0.0..=MANY,
        /// Largest loss of a fold, the same.
        largest_loss: f64 = 3.0 => 0.0..=MANY,
        /// Permutations of the residual that show what structure is by chance.
        permutations: usize = 400 => 1.0..=MANY,
        /// Bins of a joint's map.
        bins: usize = 8 => 2.0..=100.0,
    }

    /// What is said.
    Decision {
        /// From this probability on something is named: a wrong name, after which someone mends what is not broken, costs twice what a
        /// missing one does.
        named: f64 = 2.0 / 3.0 => SHARE,
        /// From this probability on something is there, whatever it is called.
        there: f64 = 0.5 => SHARE,
        /// From this probability on nothing else needs to be considered.
        sure: f64 = 0.95 => SHARE,
        /// Share of the folds that must choose a cause for it to be settled.
        folds: f64 = 0.5 => SHARE,
        /// A hypothesis of a set that cannot be told apart has at least this probability.
        worth_saying: f64 = 0.03 => SHARE,
        /// Of the residual having no structure: below this probability there is some.
        structured: f64 = 0.003 => SHARE,
        /// Mean square of the residual, over that of the noise that is known, from which on something is left: a sensor may be somewhat worse
        /// than it says, not this much.
        excess: f64 = 2.4 => 1.0..=MANY,
        /// Share of kinds and places that must have been detectable at a realistic magnitude for "no gap".
        detectable: f64 = 0.5 => SHARE,
        /// How well a signature that load drives is known, as a share of the magnitude (one sigma): it hangs on levers that calibration cannot
        /// place to better than a millimetre or two in some tenths of a metre.
        load_signature: f64 = 7e-3 => SHARE,
        /// The same of other signatures.
        signature: f64 = 2e-3 => SHARE,
        /// The same of the root mean square of a free function: it hangs on which angles were read, and geometry takes a part of it.
        free_signature: f64 = 0.05 => SHARE,
        /// Mean squares of the residual, over the declared one, that are nothing to speak of: least and most.
        usual_noise: [f64; 2] = [0.44, 2.25] => 0.0..=MANY,
        /// Held-out RMS over what is left of the readings used, from which on the readings are too few.
        few: f64 = 4.0 => 1.0..=MANY,
        /// Error by rounded joint readings over the sensor's from which on it is worth a word.
        rounded: f64 = 0.3 => 0.0..=MANY,
        /// Error by rounded joint readings over what geometry leaves beyond which the arm stood where the rounded readings say.
        rounded_over_left: f64 = 1.5 => 0.0..=MANY,
        /// Shapes without a name that are said of what is unknown, the largest first.
        unknown_said: usize = 4 => 0.0..=100.0,
        /// Correlation of readings of one configuration that is worth a word.
        correlation: f64 = 0.05 => SHARE,
        /// Square of the gap between held-out errors and noise, over that of the noise, above which shares of it mean something.
        gap: f64 = 0.02 => 0.0..=MANY,
        /// Share of its square that remains of a fitted length at least, when what noise adds to lengths is taken off.
        shortened: f64 = 0.05 => SHARE,
    }

    /// What would have shown.
    Power {
        /// Share of cases in which the least magnitude is named.
        share: f64 = 0.8 => SHARE,
        /// Readings that stand for all, where there are many more: what would have shown hangs on them evenly.
        readings: usize = 150 => 1.0..=MANY,
        /// Draws of a claim, shared by its variants.
        draws: usize = 192 => 1.0..=MANY,
        /// Variants of a claim that are taken as the truth.
        truths: usize = 4 => 1.0..=MANY,
        /// Variants of the same claim that are looked at, and of other claims.
        alike: [usize; 2] = [9, 10] => 1.0..=MANY,
        /// Likeness (cosine squared) from which on a hypothesis of another claim is looked at.
        unlike: f64 = 0.01 => SHARE,
        /// Likeness from which on that is why something would not show.
        likeness_said: f64 = 0.8 => SHARE,
        /// Share of a claim's variants that survive geometry, below which no least magnitude is told.
        surviving: f64 = 0.5 => SHARE,
        /// Information (λ of the middle of what is realistic) below which a variant does not survive geometry.
        nothing: f64 = 1e-8 => 0.0..=MANY,
        /// Least magnitude over the largest realistic one from which on none is told.
        beyond: f64 = 1e4 => 1.0..=1e12,
    }
}

impl Settings {
    /// The same with `diagnosis.GROUP.NAME` set to `value` (a number, or numbers in brackets).
    ///
    /// # Errors
    /// In words: what is not known, and what there is; or what is not allowed.
    pub fn with(&self, key: &str, value: &str) -> Result<Settings, String> {
        let mut whole = serde_json::to_value(self).map_err(|error| error.to_string())?;
        let mut place = &mut whole;
        for name in key.strip_prefix("diagnosis.").ok_or("keys begin with `diagnosis.`")?.split('.') {
            let known: Vec<String> = place.as_object().map(|table| table.keys().cloned().collect()).unwrap_or_default();
            place = place.get_mut(name).ok_or_else(|| format!("no setting `{name}`; there are {}", known.join(", ")))?;
        }
        *place = serde_json::from_str(value).map_err(|_| format!("`{value}` is no number, nor numbers in brackets"))?;
        let changed: Settings = serde_json::from_value(whole).map_err(|error| error.to_string())?;
        changed.check().map_err(|wrong| wrong.to_string())?;
        Ok(changed)
    }

    /// Whether a diagnosis can be made with them.
    ///
    /// # Errors
    /// The first that cannot be.
    pub fn check(&self) -> Result<(), NotAllowed> {
        Checked::check(self, "diagnosis", None)?;
        let prior = &self.prior;
        let shares: f64 = prior.scale_shares.iter().sum();
        let rising = |values: &[f64]| values.windows(2).all(|pair| pair[0] < pair[1]);
        let not = |key: &str, found: &[f64], allowed: &str| {
            Err(NotAllowed { key: format!("diagnosis.{key}"), found: format!("{found:?}"), allowed: allowed.to_owned() })
        };
        if !rising(&prior.scales) {
            return not("prior.scales", &prior.scales, "numbers that rise");
        }
        if prior.scale_shares.contains(&0.0) || (shares - 1.0).abs() > 1e-9 {
            return not("prior.scale_shares", &prior.scale_shares, "numbers above 0 with the sum 1");
        }
        if !rising(&self.decision.usual_noise) {
            return not("decision.usual_noise", &self.decision.usual_noise, "the least and the most");
        }
        if !rising(&self.scatter.alike) {
            return not("scatter.alike", &self.scatter.alike, "the least and the most");
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_out_is_as_usual_and_what_is_unknown_is_refused() {
        let changed: Settings = serde_json::from_str(r#"{ "decision": { "named": 0.7 } }"#).unwrap();
        assert_eq!(changed, Settings { decision: Decision { named: 0.7, ..Decision::default() }, ..Settings::default() });
        assert!(serde_json::from_str::<Settings>(r#"{ "decision": { "nammed": 0.7 } }"#).is_err());
        let whole = serde_json::to_string(&Settings::default()).unwrap();
        assert_eq!(serde_json::from_str::<Settings>(&whole).unwrap(), Settings::default());
        assert_eq!(Settings::default().with("diagnosis.decision.named", "0.7").unwrap(), changed);
        assert_eq!(Settings::default().check(), Ok(()));
        for (key, value, said) in [
            ("decision.named", "1", "begin with"),
            ("diagnosis.decision.nammed", "1", "no setting `nammed`; there are"),
            ("diagnosis.decision.named", "many", "no number"),
            ("diagnosis.decision.named", "[1]", "invalid type"),
            ("diagnosis.decision.named", "1.1", "diagnosis.decision.named = 1.1: allowed is 0 to 1"),
            ("diagnosis.validation.folds", "1", "allowed is 2 to 100"),
            ("diagnosis.validation.folds", "-1", "invalid value"),
            ("diagnosis.model.geometry_scales", "[]", "one number at least"),
            ("diagnosis.prior.scales", "[1,2,3,0]", "allowed is 0.000001 to 1000000"),
            ("diagnosis.prior.scales", "[1,3,2,4]", "numbers that rise"),
            ("diagnosis.prior.scale_shares", "[0.5,0.5,0.5,0.5]", "the sum 1"),
            ("diagnosis.decision.usual_noise", "[3,1]", "the least and the most"),
            ("diagnosis.scatter.alike", "[2,1]", "the least and the most"),
            ("diagnosis.outliers.shares", "[0.1,1]", "allowed is 0.000001 to 0.999"),
            ("diagnosis.search.stand_in_scale", "4", "allowed is 0 to 3"),
        ] {
            assert!(Settings::default().with(key, value).unwrap_err().contains(said), "{key} {value}");
        }
    }
}
