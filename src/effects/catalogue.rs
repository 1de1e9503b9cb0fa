//! The table of kinds in words, and as Markdown for the guide.

use super::descriptor::Range;
use super::kind::Kind;
use super::location::Level;

/// Where effects of a kind sit.
#[must_use]
pub fn place(level: Level) -> &'static str {
    match level {
        Level::Joint => "joint",
        Level::Link => "link",
        Level::Base => "base or sensor",
        Level::Tool => "tool",
        Level::Sensor => "sensor",
    }
}

/// Smallest and largest magnitude, SI.
#[must_use]
pub fn range(range: Range) -> String {
    match range {
        Range::Everywhere(range) => interval(range),
        Range::ByHalf { proximal, distal } => format!("{} (base), {} (wrist)", interval(proximal), interval(distal)),
    }
}

/// Two positive numbers with their common power of ten: `1.67–10·10⁻⁵`.
fn interval([low, high]: [f64; 2]) -> String {
    let exponent = libm::floor(libm::log10(low)) as i32;
    let (factor, power) = if (-2..=1).contains(&exponent) {
        (1.0, String::new())
    } else {
        let exponent_text = exponent.to_string();
        let superscript = exponent_text.chars().map(|digit| match digit {
            '-' => '⁻',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            digit => char::from_u32('⁰' as u32 + digit.to_digit(10).unwrap_or(0)).unwrap_or(digit),
        });
        (libm::pow(10.0, f64::from(exponent)), format!("·10{}", superscript.collect::<String>()))
    };
    // Three significant digits at most, without zeros at the end.
    let written = |value: f64| {
        let value = value / factor;
        let places = usize::try_from(2 - libm::floor(libm::log10(value)) as i32).unwrap_or(0);
        let text = format!("{value:.places$}");
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
    };
    format!("{}–{}{power}", written(low), written(high))
}

/// What the data must have for a kind, in words; a dash where it asks for nothing.
#[must_use]
pub fn needs(kind: Kind) -> String {
    let needs: Vec<&str> = kind.descriptor().needs.iter().map(|need| need.words()).collect();
    if needs.is_empty() { "–".to_owned() } else { needs.join(", ") }
}

/// The whole table as Markdown: one section with what there is, where, how large and what the data must have, one with the source of
/// every range, one with what is mistaken for what, one with the keys in a scene.
#[must_use]
pub fn catalogue_markdown() -> String {
    let table = |header: &[&str], rows: Vec<Vec<String>>| {
        let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let head = line(header.iter().map(|cell| (*cell).to_owned()).collect());
        let rule = line(vec!["---".to_owned(); header.len()]);
        head + &rule + &rows.into_iter().map(line).collect::<String>()
    };
    let code = |text: &str| format!("`{text}`");
    let kinds = Kind::ALL.map(|kind| {
        let of = kind.descriptor();
        let named = if of.known.is_some() { "yes" } else { "no" };
        let magnitude = format!("{}, {}", of.magnitude, of.unit.name());
        vec![
            code(of.name),
            of.about.to_owned(),
            place(of.level).to_owned(),
            magnitude,
            range(of.range),
            needs(kind),
            named.to_owned(),
        ]
    });
    let sources = Kind::ALL.map(|kind| vec![code(kind.name()), kind.descriptor().source.words().to_owned()]);
    let neighbours = Kind::known().flat_map(|kind| {
        let of = kind.descriptor();
        of.neighbours.iter().map(|other| vec![code(of.name), code(other.kind.name()), other.told_apart_by.to_owned()])
    });
    let keys = Kind::ALL.map(|kind| {
        let keys = kind.descriptor().scene;
        vec![code(kind.name()), code(&keys.in_a_line())]
    });
    format!(
        "True pose = pose at the joint readings + effect. Magnitudes in SI, of an arm of about 1 m reach.\n\n{}\n\
         ## Where the ranges come from\n\n{}\n## What is mistaken for what\n\n{}\n## Keys in a scene\n\n\
         Of a table `[[injected.effect]]`, besides `kind`; in brackets: may be left out.\n\n{}",
        table(
            &["kind", "what happens", "place", "magnitude", "realistic", "the data must have", "the diagnosis knows it"],
            kinds.to_vec()
        ),
        table(&["kind", "source of the range"], sources.to_vec()),
        table(&["kind", "mistaken for", "told apart by"], neighbours.collect()),
        table(&["kind", "keys"], keys.to_vec()),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_written_with_one_power_of_ten() {
        assert_eq!(interval([10e-6, 60e-6]), "1–6·10⁻⁵");
        assert_eq!(interval([1.0 / 6e4, 1e-4]), "1.67–10·10⁻⁵");
        assert_eq!(interval([0.03, 0.15]), "0.03–0.15");
        assert_eq!(interval([0.5, 3.0]), "0.5–3");
    }

    #[test]
    fn the_markdown_names_every_kind_in_every_table() {
        let text = catalogue_markdown();
        for kind in Kind::ALL {
            let rows = text.lines().filter(|line| line.starts_with(&format!("| `{}` |", kind.name()))).count();
            assert_eq!(rows, 3 + kind.descriptor().neighbours.len(), "{kind:?}");
        }
        assert!(text.lines().filter(|line| line.starts_with('|')).all(|line| line.ends_with(" |")));
    }
}
