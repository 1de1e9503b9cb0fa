//! Ranges and ticks.
//!
//! An axis maps its values to coordinates (the value, or its decimal logarithm), and a range of coordinates to a length.

use super::{Axis, Scale};

/// Values beyond are not drawn, so that differences of values stay finite.
const LARGEST: f64 = 1e300;

/// A value that can be drawn on a linear axis.
pub(super) fn usable(value: f64) -> bool {
    value.abs() <= LARGEST
}

/// Smallest and largest.
pub(super) fn extent(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    values.fold(None, |found, value| match found {
        None => Some([value, value]),
        Some([from, to]) => Some([from.min(value), to.max(value)]),
    })
}

/// A range that has a length worth drawing.
pub(super) fn widened([from, to]: [f64; 2]) -> [f64; 2] {
    let largest = from.abs().max(to.abs());
    if to - from > 1e-9 * largest && to - from > 1e-290 {
        return [from, to];
    }
    let half = if largest > 1e-290 { largest * 0.05 } else { 1.0 };
    [from - half, to + half]
}

/// A tick with its text.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tick {
    /// Coordinate.
    pub(super) at: f64,
    pub(super) label: String,
}

/// An axis with its range.
#[derive(Clone, Debug)]
pub(super) struct Ruler<'a> {
    axis: &'a Axis,
    /// Number of categories, if the numbers are names.
    categories: Option<usize>,
    /// Range of coordinates.
    pub(super) range: [f64; 2],
    /// Against the direction of the axis.
    pub(super) reversed: bool,
}

/// What an axis must show.
#[derive(Clone, Debug, Default)]
pub(super) struct Needs {
    pub(super) values: Vec<f64>,
    /// Bars stand on zero.
    pub(super) zero: bool,
    /// At least as many categories, if these are needed.
    pub(super) categories: Option<usize>,
}

/// Coordinate of a value, if it can be drawn.
fn coordinate(axis: &Axis, value: f64) -> Option<f64> {
    match axis.scale {
        Scale::Linear => usable(value).then_some(value),
        Scale::Log => (value > 0.0 && value.is_finite()).then(|| libm::log10(value)),
    }
}

impl<'a> Ruler<'a> {
    /// The axis with the range it asks for, or else that of the values. None if there is nothing to show.
    pub(super) fn new(axis: &'a Axis, needs: &Needs) -> Option<Self> {
        let named = axis.categories.as_ref().map(Vec::len);
        if let Some(count) = named.max(needs.categories) {
            let range = [-0.5, count as f64 - 0.5];
            return (count > 0).then_some(Self { axis, categories: Some(count), range, reversed: false });
        }
        let asked = axis.range.and_then(|[from, to]| {
            let range = [coordinate(axis, from)?, coordinate(axis, to)?];
            (range[0] < range[1] && widened(range) == range).then_some(range)
        });
        let range = match asked {
            Some(range) => range,
            None => {
                let [from, to] = extent(needs.values.iter().filter_map(|value| coordinate(axis, *value)))?;
                let zero = (axis.from_zero || needs.zero) && axis.scale == Scale::Linear;
                let [low, high] = if zero { [from.min(0.0), to.max(0.0)] } else { [from, to] };
                // Where all values are the same, a logarithm may be zero and means nothing by its size.
                let [low, high] = match axis.scale {
                    Scale::Log if high - low < 1e-9 => [low - 0.3, high + 0.3],
                    _ => widened([low, high]),
                };
                let room = 0.05 * (high - low);
                [if zero && low == 0.0 { low } else { low - room }, if zero && high == 0.0 { high } else { high + room }]
            }
        };
        Some(Self { axis, categories: None, range, reversed: false })
    }

    /// Where a value is: 0 at the beginning of the axis, 1 at its end. None if it cannot be drawn.
    pub(super) fn fraction(&self, value: f64) -> Option<f64> {
        let at = if self.is_named() { usable(value).then_some(value) } else { coordinate(self.axis, value) };
        at.map(|at| self.fraction_of(at))
    }

    /// Where a coordinate is.
    pub(super) fn fraction_of(&self, at: f64) -> f64 {
        let fraction = (at - self.range[0]) / (self.range[1] - self.range[0]);
        if self.reversed { 1.0 - fraction } else { fraction }
    }

    /// Value at a fraction of the axis.
    pub(super) fn value(&self, fraction: f64) -> f64 {
        let at = self.range[0] + fraction * self.length();
        if self.axis.scale == Scale::Log && self.categories.is_none() { libm::exp10(at) } else { at }
    }

    /// Where bars stand: zero, or the beginning of a logarithmic axis.
    pub(super) fn base(&self) -> f64 {
        match self.axis.scale {
            Scale::Linear => self.fraction_of(0.0).clamp(0.0, 1.0),
            Scale::Log => 0.0,
        }
    }

    pub(super) fn length(&self) -> f64 {
        self.range[1] - self.range[0]
    }

    pub(super) fn is_named(&self) -> bool {
        self.categories.is_some()
    }

    /// The same middle, another length.
    pub(super) fn set_length(&mut self, length: f64) {
        let middle = 0.5 * (self.range[0] + self.range[1]);
        self.range = [middle - 0.5 * length, middle + 0.5 * length];
    }

    /// Label of the axis, with the factor of its ticks.
    pub(super) fn label(&self) -> String {
        match (self.categories, self.axis.scale, power(self.range)) {
            (None, Scale::Linear, power) if power != 0 => {
                format!("{} ×10{}", self.axis.label, superscript(power)).trim().to_owned()
            }
            _ => self.axis.label.clone(),
        }
    }

    /// About as many labelled ticks.
    pub(super) fn ticks(&self, about: usize) -> Vec<Tick> {
        if let Some(count) = self.categories {
            let name = |index: usize| match &self.axis.categories {
                Some(names) => names.get(index).cloned().unwrap_or_default(),
                None => (index + 1).to_string(),
            };
            return (0..count).map(|index| Tick { at: index as f64, label: name(index) }).collect();
        }
        match self.axis.scale {
            Scale::Linear => {
                let unit = libm::exp10(f64::from(power(self.range)));
                linear(self.range, about)
                    .into_iter()
                    .map(|(at, step)| Tick { at, label: decimal(at / unit, step / unit) })
                    .collect()
            }
            Scale::Log => self.log_ticks(about),
        }
    }

    fn log_ticks(&self, about: usize) -> Vec<Tick> {
        let [low, high] = self.range;
        if self.length() < 0.7 {
            // Less than a decade is almost linear.
            let [from, to] = [libm::exp10(low), libm::exp10(high)];
            let steps = linear([from, to], about).into_iter().filter(|(value, _)| *value > 0.0);
            let (largest, smallest) = (to, from);
            return steps
                .map(|(value, step)| {
                    let label = if (1e-3..1e5).contains(&largest) && smallest >= 1e-4 {
                        decimal(value, step)
                    } else {
                        scientific(value, step)
                    };
                    Tick { at: libm::log10(value), label }
                })
                .collect();
        }
        let every = ((self.length() / about.max(2) as f64).ceil() as i32).max(1);
        let factors: &[f64] = if self.length() < 2.0 { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let decades = (low.floor() as i32)..=(high.ceil() as i32);
        let plain = low > -4.0 && high < 4.7;
        let mut ticks = Vec::new();
        for decade in decades.filter(|decade| decade.rem_euclid(every) == 0) {
            for factor in factors {
                let at = f64::from(decade) + libm::log10(*factor);
                if at < low - 1e-9 || at > high + 1e-9 {
                    continue;
                }
                let label = if plain {
                    format!("{:.*}", (-decade).max(0) as usize, factor * libm::exp10(f64::from(decade)))
                } else if *factor == 1.0 {
                    format!("10{}", superscript(decade))
                } else {
                    format!("{factor}·10{}", superscript(decade))
                };
                ticks.push(Tick { at, label });
            }
        }
        ticks
    }

    /// Coordinates of the ticks without labels: the other multiples in a decade.
    pub(super) fn minor_ticks(&self) -> Vec<f64> {
        let [low, high] = self.range;
        if self.axis.scale == Scale::Linear || self.categories.is_some() || self.length() > 6.0 {
            return Vec::new();
        }
        ((low.floor() as i32)..=(high.ceil() as i32))
            .flat_map(|decade| (2..10).map(move |factor| f64::from(decade) + libm::log10(f64::from(factor))))
            .filter(|at| (low..=high).contains(at))
            .collect()
    }
}

/// Multiples of 1, 2 or 5 times a power of ten in the range, with their step.
fn linear([low, high]: [f64; 2], about: usize) -> Vec<(f64, f64)> {
    let rough = (high - low) / about.max(2) as f64;
    let power = libm::exp10(libm::floor(libm::log10(rough)));
    let factor = match rough / power {
        ..1.5 => 1.0,
        ..3.5 => 2.0,
        ..7.5 => 5.0,
        _ => 10.0,
    };
    let step = factor * power;
    if !(step.is_finite() && step > 0.0) {
        return Vec::new();
    }
    let first = (low / step - 1e-9).ceil();
    let count = ((high / step + 1e-9).floor() - first) as usize;
    (0..=count.min(50)).map(|index| ((first + index as f64) * step, step)).collect()
}

/// Power of ten taken out of ticks that would be too long.
fn power([low, high]: [f64; 2]) -> i32 {
    let largest = low.abs().max(high.abs());
    if (1e-2..1e5).contains(&largest) || largest == 0.0 { 0 } else { libm::floor(libm::log10(largest)) as i32 }
}

/// As many decimals as the step needs.
fn decimal(value: f64, step: f64) -> String {
    let decimals = libm::ceil(-libm::log10(step) - 1e-6).clamp(0.0, 12.0) as usize;
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.chars().all(|c| c == '0' || c == '.') => digits.to_owned(),
        Some(digits) => format!("−{digits}"),
        None => text,
    }
}

fn scientific(value: f64, step: f64) -> String {
    let power = libm::floor(libm::log10(value) + 1e-9);
    let unit = libm::exp10(power);
    format!("{}·10{}", decimal(value / unit, step / unit), superscript(power as i32))
}

/// A value with as many significant digits, as in a cell of a table.
pub(super) fn significant(value: f64, digits: usize) -> String {
    let digits = digits.clamp(1, 15) as i32;
    if value == 0.0 {
        return "0".to_owned();
    }
    // Rounding may add a digit: 9.99 with two digits is 10.
    let power = libm::floor(libm::log10(value.abs()));
    let rounded = libm::round(value.abs() / libm::exp10(power - f64::from(digits - 1)));
    let power = power as i32 + i32::from(rounded >= libm::exp10(f64::from(digits)));
    if (-3..6).contains(&power) {
        decimal(value, libm::exp10(f64::from((power + 1 - digits).min(0))))
    } else {
        let mantissa = decimal(value / libm::exp10(f64::from(power)), libm::exp10(f64::from(1 - digits)));
        format!("{mantissa}·10{}", superscript(power))
    }
}

fn superscript(number: i32) -> String {
    number
        .to_string()
        .chars()
        .map(|digit| match digit {
            '-' => '⁻',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            '0' => '⁰',
            // The others follow each other.
            other => char::from_u32(u32::from('⁴') + (u32::from(other) - u32::from('4'))).unwrap_or(other),
        })
        .collect()
}
