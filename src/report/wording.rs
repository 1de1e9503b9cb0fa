//! The words of a diagnosis: its sentence, its notes, its advice, and what it says of each thing.

use crate::diagnosis::conclusion::{Advice, Conclusion, Hidden, Note, Reason, Remainder, Remains, Step, Trend, Variable};
use crate::diagnosis::held_out::Block;
use crate::diagnosis::outcome::{Diagnosis, Effect, NoiseSource, Place, Undetectable, Unknown, Verdict};
use crate::effects::{Kind, Level, Location};

/// What `conclusion` says in words.
#[must_use]
pub fn diagnosis(conclusion: Conclusion) -> Diagnosis {
    let sentence = sentence(&conclusion);
    let unknown = unknown(&conclusion.unknown);
    let undetectable = conclusion.undetectable.into_iter().map(|one| Undetectable {
        reason: reason(one.reason),
        kind: one.kind,
        location: one.location,
        minimum_detectable: one.minimum_detectable,
    });
    let detectable = conclusion.detectable.into_iter().map(|one| Undetectable {
        reason: String::new(),
        kind: one.kind,
        location: one.location,
        minimum_detectable: one.minimum_detectable,
    });
    Diagnosis {
        verdict: conclusion.verdict,
        sentence,
        noise_floor: conclusion.noise_floor,
        gap: conclusion.gap,
        effects: conclusion.effects.into_iter().map(with_detail).collect(),
        confusion_sets: conclusion.confusion_sets,
        undetectable: undetectable.collect(),
        detectable: detectable.collect(),
        unknown,
        maps: conclusion.maps,
        next_measurements: conclusion.next.iter().map(advice).collect(),
        notes: conclusion.notes.into_iter().map(note).collect(),
        gravity_m_s2: conclusion.gravity_m_s2,
        readings: conclusion.readings,
        settings: conclusion.settings,
        residuals: conclusion.residuals,
    }
}

/// A direction in the root frame.
fn towards(direction: [f64; 3]) -> String {
    let length = libm::sqrt(direction.iter().map(|value| value * value).sum::<f64>()).max(1e-300);
    let unit = direction.map(|value| value / length);
    let axis = (0..3).find(|axis| unit[*axis].abs() > 0.9999);
    axis.map_or_else(
        || format!("along ({:.2}, {:.2}, {:.2}) of the base", unit[0], unit[1], unit[2]),
        |axis| format!("along {}{} of the base", if unit[axis] > 0.0 { "+" } else { "-" }, ["x", "y", "z"][axis]),
    )
}

/// The verdict in a sentence.
fn sentence(of: &Conclusion) -> String {
    let names = causes(&of.effects);
    let list = names.join(", ");
    let um = |metres: f64| format!("{:.0} µm", metres * 1e6);
    let (geometry, explained) = (um(of.gap.geometry_rms_m), um(of.gap.explained_rms_m));
    let share = 100.0 * of.detectable_share;
    match of.verdict {
        Verdict::NoGap => format!(
            "No gap: geometry explains the readings down to {geometry} RMS on held-out poses, and {share:.0} % of what is looked for would \
             have shown at a realistic size.{}",
            nowhere(of)
        ),
        Verdict::NotDetectable => format!(
            "Nothing is seen, but only {share:.0} % of what is looked for would have shown at a realistic size: these readings cannot tell."
        ),
        Verdict::Explained => format!(
            "Explained by {list}: held-out RMS {geometry} with geometry, {explained} with the cause{}.",
            if names.len() > 1 { "s" } else { "" }
        ),
        Verdict::Ambiguous if names.len() > 1 => format!(
            "Several causes, not all settled (below {:.0} %): {list}; held-out RMS {geometry} with geometry, {explained} with the causes.",
            100.0 * of.settings.decision.sure
        ),
        Verdict::Ambiguous => {
            let first = of.confusion_sets.first().into_iter().flatten().take(3);
            let candidates: Vec<String> =
                first.map(|one| format!("{} ({:.0} %)", at(one.kind_name(), &one.location), 100.0 * one.probability)).collect();
            if candidates.is_empty() {
                format!("Something is there that is not settled: {list}.")
            } else {
                format!("Something is there, and these readings cannot tell which it is: {}.", candidates.join(" or "))
            }
        }
        Verdict::UnknownRemains => {
            let what = remainder(&of.unknown);
            if names.is_empty() {
                format!("Something is there that no effect of the library explains: {what}.")
            } else {
                format!("Besides {list}, something remains that no effect of the library explains: {what}.")
            }
        }
    }
}

/// So many places of one kind are said as one cause.
const ALIKE: usize = 3;

/// The causes with their probabilities, in words: two ripples of one joint are one, and so is what many joints show alike.
fn causes(effects: &[Effect]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for effect in effects {
        let mut alike: Vec<(usize, f64)> = effects
            .iter()
            .filter(|other| (other.kind, other.location.level) == (effect.kind, effect.location.level))
            .filter_map(|other| Some((other.location.index?, 100.0 * other.probability)))
            .collect();
        alike.sort_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
        alike.dedup_by_key(|(index, _)| *index);
        let name = if alike.len() >= ALIKE {
            let places: Vec<usize> = alike.iter().map(|(index, _)| *index).collect();
            let (last, others) = places.split_last().map_or((0, &[][..]), |(last, others)| (*last, others));
            let of = |better: fn(f64, f64) -> f64, from: f64| alike.iter().map(|(_, percent)| percent.round()).fold(from, better);
            let (least, most) = (of(f64::min, f64::INFINITY), of(f64::max, 0.0));
            let percent = if least < most { format!("{least} to {most} %") } else { format!("{most} %") };
            let (kind, level) =
                (effect.kind.name().replace('_', " "), if effect.location.level == Level::Link { "links" } else { "joints" });
            format!("{kind} of {level} {} and {last} ({percent})", numbers(others, ", "))
        } else {
            format!("{} ({:.0} %)", at(effect.kind.name(), &effect.location), 100.0 * effect.probability)
        };
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

/// Kinds that would have shown at no place.
fn nowhere(of: &Conclusion) -> String {
    let seen = |one: &&Hidden| of.detectable.iter().any(|visible| visible.kind == one.kind);
    let mut blind: Vec<String> =
        of.undetectable.iter().filter(|one| !seen(one)).map(|one| one.kind.name().replace('_', " ")).collect();
    blind.sort();
    blind.dedup();
    if blind.is_empty() { String::new() } else { format!(" Nowhere to be seen would have been: {}.", blind.join(", ")) }
}

/// A kind (by its name) and where it is.
fn words(kind: &str, location: &Location) -> String {
    format!("{} of {location}", kind.replace('_', " "))
}

/// The same with the moment, where there is one.
fn at(kind: &str, place: &Place) -> String {
    let words = words(kind, &Location { level: place.level, index: place.index });
    match place.when() {
        Some(when) => format!("{words} at {when}"),
        None => words,
    }
}

/// Whose noise it is.
fn whose(source: NoiseSource) -> &'static str {
    match source {
        NoiseSource::Repeats => "repeats'",
        NoiseSource::Declared => "declared",
        NoiseSource::Assumed => "assumed",
    }
}

/// What the rows of a fold share, of all folds.
pub(super) fn blocks(by: Block) -> &'static str {
    match by {
        Block::Region => "regions",
        Block::Payload => "payloads",
        Block::Session => "sessions",
    }
}

/// `effect` with its detail, where that is not its hypothesis's.
fn with_detail(effect: Effect) -> Effect {
    match (effect.kind, effect.parameters.factor) {
        (Kind::MeasurementOutliers, Some(factor)) => {
            Effect { detail: format!("noise about {factor} times that of the other readings"), ..effect }
        }
        _ => effect,
    }
}

fn unknown(of: &Remainder) -> Unknown {
    Unknown { present: of.present, p_value: of.p_value, r#where: of.present.then(|| remainder(of)) }
}

fn remainder(of: &Remainder) -> String {
    of.remains.iter().map(remains).collect::<Vec<_>>().join("; ")
}

fn remains(part: &Remains) -> String {
    match part {
        Remains::Shape { detail, besides: 0, rms_m } => format!("{detail} ({:.0} µm)", rms_m * 1e6),
        Remains::Shape { detail, besides, rms_m } => format!(
            "{detail} ({:.0} µm, together with {besides} more shape{})",
            rms_m * 1e6,
            if *besides == 1 { "" } else { "s" }
        ),
        Remains::Smaller { count } => format!("{count} smaller one{}", if *count == 1 { "" } else { "s" }),
        Remains::Scatter { joint, sigma, slides } => {
            let (size, unit) = if *slides { (sigma * 1e6, "µm") } else { (sigma.to_degrees() * 3600.0, "arcsec") };
            format!("joint {joint} does not repeat: its errors scatter by {size:.0} {unit}, in no order that was recorded")
        }
        Remains::Trend(found) => trend(*found),
        Remains::Noise { ratio, source } => format!("what remains is {ratio:.1} times the {} noise", whose(*source)),
    }
}

fn trend(found: Trend) -> String {
    let what = found.along.map_or_else(String::new, |joint| format!(" along joint {joint}"));
    let follows = match found.follows {
        Variable::Angle(joint) => format!("the angle of joint {joint}"),
        Variable::Torque(joint) => format!("the torque of joint {joint}"),
        Variable::Time => "time".to_owned(),
        Variable::Temperature => "temperature".to_owned(),
    };
    format!("the residual{what} follows {follows}")
}

fn reason(why: Reason) -> String {
    match why {
        Reason::Like { kind, location, likeness } => {
            format!("cannot be told from {} (likeness {likeness:.2}) at a realistic size", words(kind.name(), &location))
        }
        Reason::TooSmall => "a realistic size is lost in the noise, or geometry absorbs it".to_owned(),
        Reason::NoApproach => "no approach directions were recorded".to_owned(),
        Reason::NoMoves => {
            "the arm came to its readings over points between, so that the length of the last move is not known".to_owned()
        }
        Reason::OneSide => "the joint is always approached from the same side".to_owned(),
        Reason::NoTemperatures => "no temperatures that change were recorded".to_owned(),
        Reason::LoadedAlike => "gravity loads this joint not at all, or always alike".to_owned(),
        Reason::LengthsAbsorb => "link lengths that are fitted absorb it wholly; a scale bar would show it".to_owned(),
        Reason::GeometryAbsorbs => "geometry absorbs it wholly on these configurations".to_owned(),
    }
}

/// Numbers with `between` between them.
fn numbers(of: &[usize], between: &str) -> String {
    of.iter().map(usize::to_string).collect::<Vec<_>>().join(between)
}

/// Rows of readings far off that are said; of more, the number.
const ROWS_SAID: usize = 20;

fn note(note: Note) -> String {
    let um = |metres: f64| metres * 1e6;
    match note {
        Note::NoApproach => "no approach directions: backlash cannot be looked for".to_owned(),
        Note::AirForLinks => "no temperatures of the links: that of the air stands in for all of them".to_owned(),
        Note::ConstantTemperature => "the temperature never changes: thermal effects cannot be looked for".to_owned(),
        Note::NoTemperatures => "no temperatures: thermal effects cannot be looked for".to_owned(),
        Note::NoPayload => "no payload column: the arm is taken to carry nothing".to_owned(),
        Note::NoMasses => {
            "the robot's file has no masses: each link is taken to weigh 1 kg in its middle, and magnitudes that are driven by load have no \
             physical unit"
                .to_owned()
        }
        Note::Gravity { m_s2 } => {
            let [x, y, z] = m_s2.map(|value| format!("{:.2}", value + 0.0));
            format!(
                "nobody said which way gravity acts on this arm, and the readings do: {}, not down along -z of the base; all loads are \
                 taken so. If that is right, say it with --gravity {x},{y},{z}; if it is not, with --gravity 0,0,-9.81",
                towards(m_s2)
            )
        }
        Note::Geometry(said) => said,
        Note::Astray => {
            "no fit settles around what was found, so large is what several shapes together do where they nearly cancel: magnitudes hold to \
             first order only; a larger declared noise leaves less to be explained"
                .to_owned()
        }
        Note::UnmovedRepeats => {
            "the repeats were read without a move between them: they show the sensor's noise, not what the arm repeats to".to_owned()
        }
        Note::Alike { correlation } => format!(
            "readings of the same configuration are alike (correlation {correlation:.2} of what is left): they are weighted down, n of \
             them to n / (1 + {correlation:.2} (n − 1))"
        ),
        Note::FoldsDoWithout { by, count, folds } => format!(
            "{count} of {folds} folds ({}) leave out effects that evidence chose for them, because these did not help on readings that were \
             not used",
            blocks(by)
        ),
        // A difference of positions has three degrees of freedom; a sigma of n is known to one in the root of 2 n.
        Note::NoiseOfRepeats { degrees_of_freedom } => format!(
            "the noise is that of repeats: {:.0} differences between readings of one configuration that agree in all that was recorded \
             (±{:.0} %)",
            degrees_of_freedom / 3.0,
            100.0 / libm::sqrt(2.0 * degrees_of_freedom)
        ),
        Note::OrientationNoise { taken_rad, said_rad } => format!(
            "orientations are taken to be read to {:.4}°, not to {:.4}° as is said of them: so much is left of them beside what is left of \
             the positions",
            taken_rad.to_degrees(),
            said_rad.to_degrees()
        ),
        Note::FewReadings { held_out_m, used_m, readings } => format!(
            "held-out errors ({:.0} µm) are far above what is left of the readings that were used ({:.0} µm): {readings} readings are too \
             few to tell this arm's geometry, and what is named rests on few",
            um(held_out_m),
            um(used_m)
        ),
        Note::Rounded { joints, step, rms_m } => {
            let step = match step {
                Step::Degrees(step) => format!("{step}°"),
                Step::Radians(step) => format!("{step} rad"),
            };
            format!(
                "readings of joint {} are rounded to {step}: where the arm stood anywhere within that, this alone is an error of {:.0} µm RMS, \
                 which may look like joints that do not repeat or like ripple; write them out in full",
                numbers(&joints, ", "),
                um(rms_m)
            )
        }
        Note::FarOff { rows } => {
            let said = &rows[..rows.len().min(ROWS_SAID)];
            let more = if rows.len() > ROWS_SAID { format!(" and {} more", rows.len() - ROWS_SAID) } else { String::new() };
            format!("readings far off, weighted down and not counted in held-out errors: rows {}{more}", numbers(said, ", "))
        }
        Note::UnusualNoise { ratio, source, beside } => {
            let scatter =
                if beside.is_empty() { String::new() } else { format!(" (beside the scatter of joint {})", numbers(&beside, " and ")) };
            let large = if ratio < 1.0 {
                ": it is said to be larger than it is, and hides what is there"
            } else {
                ": something remains, or the sensor is worse than is said, and what is made of its noise may have been given a name"
            };
            format!("the residuals are {ratio:.2} times the {} noise{scatter}{large}", whose(source))
        }
    }
}

fn advice(advice: &Advice) -> String {
    let fixed = match advice {
        Advice::Repeat { joint } => {
            return format!(
                "joint {joint}: read a few configurations many times, with a move of this joint alone between, from both sides in turn, and \
                 record the side"
            );
        }
        Advice::BothSides { joints } => {
            return format!(
                "backlash of joint {} could not show, for it was always approached from the same side: approach it from both",
                numbers(joints, ", ")
            );
        }
        Advice::Measure(measure) => measure.words(),
        Advice::MoreWhereItShows => "a shape without a name: more configurations where it shows",
        Advice::RecordApproach => {
            "backlash could not show: record from which side each joint was approached (columns approach1, …), and use both sides"
        }
        Advice::WarmUp => {
            "thermal effects could not show, for the temperature hardly changed: let the arm warm up and cool down in one session"
        }
        Advice::RecordTemperatures => {
            "thermal effects could not show: record temperatures (temp_ambient_c, temp1_c, …) while the arm warms up and cools down"
        }
        Advice::ReadTwice => "read some configurations twice, approached alike: repeats tell the noise",
        Advice::MoreReadings => "more configurations, or a sensor with less noise",
    };
    fixed.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::outcome::{Candidate, Gap, Magnitude, MinimumDetectable, NoiseFloor, Parameters};
    use crate::diagnosis::settings::Settings;

    fn joint(index: usize) -> Place {
        Place::of(Level::Joint, Some(index))
    }

    fn effect(kind: Kind, index: usize, probability: f64) -> Effect {
        Effect {
            kind,
            location: joint(index),
            probability,
            magnitude: Magnitude { value: 1e-4, unit: "rad".to_owned(), ci95: [0.9e-4, 1.1e-4] },
            parameters: Parameters::default(),
            signature: None,
            held_out_rms_before_m: 1e-4,
            held_out_rms_after_m: 5e-5,
            gap_closed: None,
            folds: [5, 5],
            detail: String::new(),
        }
    }

    fn conclusion(verdict: Verdict, effects: Vec<Effect>) -> Conclusion {
        let gap = Gap {
            nominal_rms_m: 1e-3,
            geometry_rms_m: 89.4e-6,
            explained_rms_m: 64.6e-6,
            noise_rms_m: 5e-5,
            gap_closed: None,
            gap_closed_ci95: None,
            folds: 5,
            blocked: Vec::new(),
        };
        Conclusion {
            verdict,
            noise_floor: NoiseFloor { position_m: 2e-5, rotation_rad: None, source: NoiseSource::Declared },
            gap,
            effects,
            confusion_sets: Vec::new(),
            undetectable: Vec::new(),
            detectable: Vec::new(),
            detectable_share: 0.625,
            unknown: Remainder { present: false, p_value: 0.5, remains: Vec::new() },
            maps: Vec::new(),
            next: Vec::new(),
            notes: Vec::new(),
            gravity_m_s2: None,
            readings: 60,
            settings: Settings::default(),
            residuals: Vec::new(),
        }
    }

    #[test]
    fn every_verdict_has_its_sentence() {
        let says = |of: Conclusion| diagnosis(of).sentence;
        let play = || effect(Kind::Backlash, 3, 0.996);
        assert_eq!(
            says(conclusion(Verdict::Explained, vec![play()])),
            "Explained by backlash of joint 3 (100 %): held-out RMS 89 µm with geometry, 65 µm with the cause."
        );
        let two = vec![play(), effect(Kind::StrainWaveError, 1, 0.7), effect(Kind::StrainWaveError, 1, 0.7)];
        assert_eq!(
            says(conclusion(Verdict::Ambiguous, two)),
            "Several causes, not all settled (below 95 %): backlash of joint 3 (100 %), strain wave error of joint 1 (70 %); held-out RMS \
             89 µm with geometry, 65 µm with the causes."
        );
        let many = [2, 5, 1].map(|index| effect(Kind::JointAngleMap, index, 0.9 + 0.02 * index as f64));
        assert_eq!(
            causes(&[many.to_vec(), vec![play()]].concat()),
            ["joint angle map of joints 1, 2 and 5 (92 to 100 %)", "backlash of joint 3 (100 %)"]
        );
        let step = Place { time_s: Some(61.4), ..Place::of(Level::Base, None) };
        let candidate =
            |kind, location, probability| Candidate { kind, location, probability, detail: "not in the sentence".to_owned() };
        let set = vec![candidate(Some(Kind::BaseStep), step, 0.6), candidate(None, joint(2), 0.3)];
        let open = Conclusion { confusion_sets: vec![set], ..conclusion(Verdict::Ambiguous, Vec::new()) };
        assert_eq!(
            says(open),
            "Something is there, and these readings cannot tell which it is: base step of the base at 61 s (60 %) or unknown of joint 2 \
             (30 %)."
        );
        let hidden = |kind, index| Hidden {
            kind,
            location: joint(index),
            minimum_detectable: MinimumDetectable { value: None, unit: "rad".to_owned() },
            reason: Reason::OneSide,
        };
        let none = Conclusion {
            undetectable: vec![hidden(Kind::Backlash, 2), hidden(Kind::Backlash, 1)],
            ..conclusion(Verdict::NoGap, Vec::new())
        };
        assert!(says(none).ends_with(
            "62 % of what is looked for would have shown at a realistic size. Nowhere to be seen would have been: backlash."
        ));
        assert!(says(conclusion(Verdict::NotDetectable, Vec::new())).contains("only 62 %"));
    }

    #[test]
    fn what_remains_is_said_part_by_part() {
        let remains = vec![
            Remains::Shape { detail: "angle of joint 3 near 20°".to_owned(), besides: 0, rms_m: 41.6e-6 },
            Remains::Smaller { count: 1 },
            Remains::Scatter { joint: 4, sigma: 1.0_f64.to_radians() / 360.0, slides: false },
            Remains::Scatter { joint: 1, sigma: 7e-6, slides: true },
            Remains::Trend(Trend { along: Some(2), follows: Variable::Torque(3) }),
            Remains::Trend(Trend { along: None, follows: Variable::Time }),
            Remains::Noise { ratio: 2.04, source: NoiseSource::Repeats },
        ];
        let parts = [
            "angle of joint 3 near 20° (42 µm)",
            "1 smaller one",
            "joint 4 does not repeat: its errors scatter by 10 arcsec, in no order that was recorded",
            "joint 1 does not repeat: its errors scatter by 7 µm, in no order that was recorded",
            "the residual along joint 2 follows the torque of joint 3",
            "the residual follows time",
            "what remains is 2.0 times the repeats' noise",
        ];
        let of = Conclusion {
            unknown: Remainder { present: true, p_value: 0.001, remains },
            ..conclusion(Verdict::UnknownRemains, vec![effect(Kind::Backlash, 3, 0.9)])
        };
        let said = diagnosis(of);
        assert_eq!(said.unknown.r#where.as_deref(), Some(parts.join("; ").as_str()));
        assert!(said.sentence.starts_with("Besides backlash of joint 3 (90 %), something remains"));
        assert_eq!(diagnosis(conclusion(Verdict::NoGap, Vec::new())).unknown.r#where, None);
    }

    #[test]
    fn numbers_of_notes_are_in_the_units_that_are_said() {
        let notes = vec![
            Note::Rounded { joints: vec![2, 5], step: Step::Degrees(0.01), rms_m: 87e-6 },
            Note::Rounded { joints: vec![1], step: Step::Radians(1e-5), rms_m: 1e-6 },
            Note::FarOff { rows: (1..=23).collect() },
            Note::UnusualNoise { ratio: 0.5, source: NoiseSource::Declared, beside: vec![1, 4] },
            Note::NoiseOfRepeats { degrees_of_freedom: 50.0 },
            Note::OrientationNoise { taken_rad: 0.002_f64.to_radians(), said_rad: 0.01_f64.to_radians() },
        ];
        let said = diagnosis(Conclusion { notes, ..conclusion(Verdict::NoGap, Vec::new()) }).notes;
        assert!(
            said[0].starts_with("readings of joint 2, 5 are rounded to 0.01°") && said[0].contains("87 µm RMS"),
            "{}",
            said[0]
        );
        assert!(said[1].starts_with("readings of joint 1 are rounded to 0.00001 rad"), "{}", said[1]);
        assert!(said[2].ends_with("18, 19, 20 and 3 more"), "{}", said[2]);
        assert!(
            said[3]
                .starts_with("the residuals are 0.50 times the declared noise (beside the scatter of joint 1 and 4): it is said")
        );
        assert!(said[4].contains("17 differences") && said[4].ends_with("(±10 %)"), "{}", said[4]);
        assert!(said[5].contains("read to 0.0020°, not to 0.0100° as is said"), "{}", said[5]);
    }

    #[test]
    fn the_detail_of_readings_far_off_is_their_factor() {
        let far = Effect {
            kind: Kind::MeasurementOutliers,
            parameters: Parameters { factor: Some(14.0), ..Parameters::default() },
            ..effect(Kind::MeasurementOutliers, 1, 0.9)
        };
        let said = diagnosis(conclusion(Verdict::Explained, vec![far]));
        assert_eq!(said.effects[0].detail, "noise about 14 times that of the other readings");
    }
}
