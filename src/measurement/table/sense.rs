//! Conditions that no cell has: units that are other than the column says, clocks that run backwards.

use super::Measurement;

/// Air that people and instruments work in, °C.
const HOTTEST_AIR: f64 = 60.0;
/// Links of a robot that still moves, °C.
const HOTTEST_LINK: f64 = 200.0;
const COLDEST: f64 = -90.0;
/// What an arm carries, kg.
const HEAVIEST: f64 = 2000.0;

/// A temperature in °C, of the air or of a link.
///
/// # Errors
/// If none has it, with the unit in which it would.
pub(super) fn temperature(value: f64, of_air: bool) -> Result<f64, String> {
    let hottest = if of_air { HOTTEST_AIR } else { HOTTEST_LINK };
    if (COLDEST..=hottest).contains(&value) {
        return Ok(value);
    }
    let (kelvin, fahrenheit) = (value - 273.15, (value - 32.0) / 1.8);
    let usual = -30.0..=HOTTEST_AIR;
    let hint = if value > 200.0 && usual.contains(&kelvin) {
        format!("; as kelvin it is {kelvin:.1} °C: subtract 273.15")
    } else if value > 0.0 && usual.contains(&fahrenheit) {
        format!("; as °F it is {fahrenheit:.1} °C: convert it")
    } else {
        String::new()
    };
    Err(format!("is {value} °C; from {COLDEST} to {hottest} are what a cell has{hint}"))
}

/// A mass on the tool, kg.
///
/// # Errors
/// If no arm carries it.
pub(super) fn payload(value: f64) -> Result<f64, String> {
    match value {
        _ if value < 0.0 => Err(format!("is {value}; 0 or more is needed")),
        _ if value > HEAVIEST => {
            Err(format!("is {value}; no arm carries more than {HEAVIEST} kg: is it in grams ({} kg)?", value / 1e3))
        }
        _ => Ok(value),
    }
}

/// What is to be said where the times of `rows`, in their order in the file, go back within a session.
pub(super) fn order_of_times(rows: &[Measurement]) -> Option<String> {
    let steps = rows.windows(2).filter(|pair| pair[0].session == pair[1].session).count();
    let back: Vec<usize> = (1..rows.len())
        .filter(|row| rows[*row].session == rows[row - 1].session && rows[*row].time_s < rows[row - 1].time_s)
        .collect();
    let first = back.first()?;
    if 2 * back.len() > steps {
        return Some(
            "time runs backwards from row to row: rows are taken in the order of their times, the last one first; if they stand in the \
             order of measuring, the clock is wrong: leave it out with --ignore-columns"
                .to_owned(),
        );
    }
    let more = if back.len() > 1 { format!(" and {} more", back.len() - 1) } else { String::new() };
    Some(format!(
        "time goes back at reading {}{more}: rows are taken in the order of their times; sessions with clocks of their own need labels in a \
         column `session`",
        first + 1
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conditions_in_other_units_are_told_with_the_unit() {
        assert_eq!(temperature(21.5, true), Ok(21.5));
        assert_eq!(temperature(85.0, false), Ok(85.0));
        assert!(temperature(293.15, true).unwrap_err().contains("as kelvin it is 20.0 °C"));
        assert!(temperature(313.15, false).unwrap_err().contains("as kelvin it is 40.0 °C"));
        assert!(temperature(68.0, true).unwrap_err().contains("as °F it is 20.0 °C"));
        assert!(temperature(-200.0, false).unwrap_err().ends_with("what a cell has"));
        assert_eq!(payload(12.5), Ok(12.5));
        assert!(payload(5000.0).unwrap_err().contains("in grams (5 kg)?"));
        assert!(payload(-1.0).is_err());
        let at = |times: &[f64]| -> Vec<Measurement> {
            times.iter().map(|time_s| Measurement { time_s: *time_s, ..Measurement::default() }).collect()
        };
        assert_eq!(order_of_times(&at(&[0.0, 1.0, 1.0, 2.0])), None);
        assert!(order_of_times(&at(&[0.0, 1.0, 0.5, 2.0])).unwrap().contains("at reading 3"));
        assert!(order_of_times(&at(&[3.0, 2.0, 1.0])).unwrap().contains("time runs backwards"));
    }
}
