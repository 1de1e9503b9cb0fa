//! Every number that decides what a diagnosis says, with its unit and its reason. A diagnosis carries those that it was made with, a
//! recording keeps them, a replay uses what was recorded; `--set diagnosis.GROUP.NAME=VALUE` changes one.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Prior scales of a magnitude ([`Prior::scales`]).
pub const SCALES: usize = 4;

macro_rules! settings {
    ($($(#[$of_group:meta])* $group:ident { $($(#[$of_number:meta])* $name:ident: $kind:ty = $value:expr,)* })*) => {
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
    }

    /// What tells the noise.
    Noise {
        /// Joint readings that differ by less are of one configuration, rad or m: commanded values come back rounded, or as encoders see
        /// them.
        same_configuration: f64 = 2e-4,
        /// Temperatures that differ by less are the same, K: what a sensor on a link tells.
        same_temperature_k: f64 = 0.5,
        /// Pairs of equal readings that a noise needs: a variance from fewer is worth nothing.
        contrasts: usize = 3,
        /// Pairs of alike readings from which their correlation is estimated rather than taken as a half.
        pairs: f64 = 6.0,
        /// Degrees of freedom of what repeats without a move tell: they show the sensor, not the arm.
        unmoved_degrees: f64 = 4.0,
        /// Of what repeats with a move tell, at most: other conditions than theirs are measured, too.
        repeats_degrees: f64 = 20.0,
        /// Of what a data sheet or the user says.
        declared_degrees: f64 = 10.0,
        /// Of what nobody says.
        assumed_degrees: f64 = 1.0,
        /// Correlation of what is left of readings of one configuration from which on it is the configuration's.
        alike: f64 = 0.9,
        /// Degrees of freedom of repeats from which on they tell the orientations' noise beside the positions'.
        orientation_degrees: f64 = 36.0,
        /// Mean square, over what is said of the noise, beyond which what is left is no noise.
        no_noise: f64 = 9.0,
        /// Beyond chance, a difference of the logarithms of two sigmas that matters.
        log_sigma_matters: f64 = 0.1,
        /// Standard errors that are chance.
        standard_errors: f64 = 3.0,
    }

    /// How the linear problem is made.
    Model {
        /// Rounds of fitting around what was found, at most.
        passes: usize = 12,
        /// Effects of the first pass at most; twice as many in the next one, and so on.
        first: usize = 4,
        /// Passes in which the geometry's prior is chosen.
        choosing: usize = 3,
        /// Sigmas of the geometry's prior over those of manufacturing (5 mm, 10 mrad) that are tried: the readings say how far the arm is
        /// from nominal.
        geometry_scales: Vec<f64> = vec![3.0, 1.0, 0.3, 0.1, 0.03],
        /// Of the noise, the difference between loads as they are and as they are read that is worth trying both.
        loads_matter: f64 = 0.3,
        /// Of the noise, the movement of a target from pass to pass that is nothing.
        settled: f64 = 0.1,
        /// Change of a row's weight from pass to pass that is nothing.
        settled_weight: f64 = 1e-2,
        /// A joint is upright where its torque never exceeds so many sigmas of what is not known of it: its axis leans by less than a degree,
        /// and which way its foot leans decides on which side its play is seated.
        upright: f64 = 6.0,
        /// Moments of a step that are tried at most.
        change_points: usize = 80,
        /// Fitted errors of a frame over their prior's sigma beyond which it is another robot, or its readings are wrong.
        implausible: f64 = 12.0,
        /// What remains (RMS) over the arm's reach beyond which it is another robot.
        astray: f64 = 0.05,
        /// Reach below which an arm counts as one of this reach there, m.
        small_arm_m: f64 = 0.1,
    }

    /// What is likely before any reading is looked at.
    Prior {
        /// Odds of one effect.
        odds: f64 = 1.0,
        /// Share of shapes without a name.
        unnamed: f64 = 0.25,
        /// λ at the upper end of the realistic range below which a hypothesis has no information in the data.
        no_information: f64 = 4.0,
        /// Standard deviations of a magnitude in units of its usual one: of usual arms, of worse ones, of desktop arms, of hobby and
        /// cable-driven arms.
        scales: [f64; SCALES] = [1.0, 2.5, 12.0, 150.0],
        /// How likely each of them is.
        scale_shares: [f64; SCALES] = [0.44, 0.44, 0.10, 0.02],
    }

    /// The search over sets of effects.
    Search {
        /// Effects of a set at most.
        most: usize = 24,
        /// Rounds of the walk: in each, every cause is drawn anew once.
        rounds: usize = 16,
        /// Probability from which on a cause needs no more rounds.
        certain: f64 = 0.995,
        /// Places for causes that are not in the likeliest set.
        spare: usize = 1,
        /// Additions whose posterior is computed exactly: how signs shift beside a new member is left out at first.
        exact: usize = 6,
    }

    /// Gear ripple of any tooth count.
    Ripple {
        /// Drop of the residual's square, in squares of the noise, from which on a ripple is worth a hypothesis: what the strongest of some
        /// thousands reaches by chance.
        worth: f64 = 16.0,
        /// Ripples taken from one scan.
        most: usize = 3,
    }

    /// Joints that do not repeat.
    Scatter {
        /// Times that what was found is looked through for them.
        looks: usize = 3,
        /// Smallest sigma of a joint's scatter, rad or m; the others are a root of two larger each.
        smallest: f64 = 5e-6,
        /// Sigmas looked at.
        steps: u8 = 18,
        /// Joints that may scatter.
        most: usize = 2,
        /// Standard deviations by which residuals must point along the joint's motion.
        along: f64 = 3.5,
        /// Held-out RMS with joints that do not repeat, over that without, from which on there are none.
        worse: f64 = 1.03,
    }

    /// Readings that are far off.
    Outliers {
        /// Prior odds that there are any.
        odds: f64 = 0.04,
        /// From this probability on they are there, and rows are taken for such.
        there: f64 = 0.5,
        /// Probability from which on a row is one of them.
        row: f64 = 0.99,
        /// Their noise over that of the others from which on they are named.
        factor: f64 = 4.0,
        /// The same beside something unknown: a misfit has tails, too.
        factor_beside_unknown: f64 = 9.0,
    }

    /// Readings that are left out, and structure that remains.
    Validation {
        /// Folds.
        folds: usize = 5,
        /// Largest gain of a fold that counts against the losses of others, as a logarithm of mean squares.
        largest_gain: f64 = 1.0,
        /// Largest loss of a fold, the same.
        largest_loss: f64 = 3.0,
        /// Permutations of the residual that show what structure is by chance.
        permutations: usize = 400,
        /// Bins of a joint's map.
        bins: usize = 8,
    }

    /// What is said.
    Decision {
        /// From this probability on something is named.
        named: f64 = 0.5,
        /// From this probability on nothing else needs to be considered.
        sure: f64 = 0.95,
        /// A hypothesis of a set that cannot be told apart has at least this probability.
        worth_saying: f64 = 0.03,
        /// Of the residual having no structure: below this probability there is some.
        structured: f64 = 0.003,
        /// Mean square of the residual, over that of the noise that is known, from which on something is left: a sensor may be somewhat worse
        /// than it says, not this much.
        excess: f64 = 2.4,
        /// Share of kinds and places that must have been detectable at a realistic magnitude for "no gap".
        detectable: f64 = 0.5,
        /// How well a signature that load drives is known, as a share of the magnitude (one sigma): it hangs on levers that calibration cannot
        /// place to better than a millimetre or two in some tenths of a metre.
        load_signature: f64 = 7e-3,
        /// The same of other signatures.
        signature: f64 = 2e-3,
        /// Mean squares of the residual, over the declared one, that are nothing to speak of: least and most.
        usual_noise: [f64; 2] = [0.44, 2.25],
        /// Held-out RMS over what is left of the readings used, from which on the readings are too few.
        few: f64 = 4.0,
        /// Error by rounded joint readings over the sensor's from which on it is worth a word.
        rounded: f64 = 0.3,
        /// Shapes without a name that are said of what is unknown, the largest first.
        unknown_said: usize = 4,
        /// Correlation of readings of one configuration that is worth a word.
        correlation: f64 = 0.05,
    }

    /// What would have shown.
    Power {
        /// Share of cases in which the least magnitude is named.
        share: f64 = 0.8,
        /// Readings that stand for all, where there are many more: what would have shown hangs on them evenly.
        readings: usize = 150,
        /// Draws of a claim, shared by its variants.
        draws: usize = 192,
        /// Variants of a claim that are taken as the truth.
        truths: usize = 4,
        /// Variants of the same claim that are looked at, and rivals.
        alike: [usize; 2] = [9, 10],
        /// Likeness (cosine squared) from which on a rival is looked at.
        unlike: f64 = 0.01,
        /// Likeness from which on a rival is why something would not show.
        likeness_said: f64 = 0.8,
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
        serde_json::from_value(whole).map_err(|error| error.to_string())
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
        for (key, value, said) in [
            ("decision.named", "1", "begin with"),
            ("diagnosis.decision.nammed", "1", "no setting `nammed`; there are"),
            ("diagnosis.decision.named", "many", "no number"),
            ("diagnosis.decision.named", "[1]", "invalid type"),
        ] {
            assert!(Settings::default().with(key, value).unwrap_err().contains(said), "{key} {value}");
        }
    }
}
