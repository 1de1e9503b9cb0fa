//! The error of every configuration on a logarithmic scale, which Rerun's plots do not have: drawn in a plane.

use re_sdk_types::archetypes::{LineStrips2D, Points2D};
use re_sdk_types::components::Radius;
use rerun::{RecordingStream, RecordingStreamResult};

const WIDTH: f64 = 160.0;
const HEIGHT: f64 = 80.0;
/// x and y ranges of the whole drawing.
pub(super) const BOUNDS: [[f64; 2]; 2] = [[-22.0, WIDTH + 4.0], [-16.0, HEIGHT + 10.0]];
const GRID: [u8; 3] = [70, 74, 82];
const TEXT: [u8; 3] = [190, 194, 202];

/// The points of one kind.
#[derive(Clone, Debug)]
pub(super) struct Series {
    pub(super) name: String,
    pub(super) colour: [u8; 3],
    /// Index of the measurement, and the error in the unit of the ticks.
    pub(super) values: Vec<(usize, f64)>,
}

/// Unit of a chart: how its ticks are written.
#[derive(Clone, Copy, Debug)]
pub(super) enum Unit {
    /// Values in metres, ticks in nm, µm, mm, m.
    Metre,
    /// Values in degrees.
    Degree,
}

impl Unit {
    fn tick(self, exponent: i32) -> String {
        match self {
            Unit::Metre => {
                let (unit, zero) = match exponent {
                    i32::MIN..=-7 => ("nm", -9),
                    -6..=-4 => ("µm", -6),
                    -3..=-1 => ("mm", -3),
                    _ => ("m", 0),
                };
                format!("{} {unit}", 10f64.powi(exponent - zero))
            }
            Unit::Degree if exponent < -4 => format!("1e{exponent}°"),
            Unit::Degree => format!("{}°", 10f64.powi(exponent)),
        }
    }
}

/// Logs a chart without values under `path`.
pub(super) fn log_empty(stream: &RecordingStream, path: &str) -> RecordingStreamResult<()> {
    let text = Points2D::new([[(WIDTH / 2.0) as f32, (HEIGHT / 2.0) as f32]])
        .with_labels(["nothing is measured yet"])
        .with_show_labels(true)
        .with_colors([TEXT])
        .with_radii([Radius::new_ui_points(0.0)]);
    stream.log(format!("{path}/text"), &text)
}

/// Logs the chart under `path`.
pub(super) fn log(stream: &RecordingStream, path: &str, unit: Unit, series: &[Series]) -> RecordingStreamResult<()> {
    let drawable = |value: f64| value.is_finite() && value > 0.0;
    let logs = || series.iter().flat_map(|s| &s.values).filter(|v| drawable(v.1)).map(|v| libm::log10(v.1));
    let (low, high) = logs().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    if low > high {
        return Ok(());
    }
    let (low, high) = (low.floor() as i32, (high.ceil() as i32).max(low.floor() as i32 + 1));
    let last = series.iter().flat_map(|s| &s.values).map(|v| v.0).max().unwrap_or(0);
    let x = |index: usize| (WIDTH * (index as f64 + 0.5) / (last as f64 + 1.0)) as f32;
    let y = |log: f64| (HEIGHT * (f64::from(high) - log) / f64::from(high - low)) as f32;

    let lines: Vec<[[f32; 2]; 2]> = (low..=high).map(|e| [[0.0, y(f64::from(e))], [WIDTH as f32, y(f64::from(e))]]).collect();
    let grid = LineStrips2D::new(lines).with_colors([GRID]).with_radii([Radius::new_ui_points(0.6)]);
    stream.log(format!("{path}/grid"), &grid)?;

    // A label stands below its point.
    let mut places: Vec<[f32; 2]> = (low..=high).map(|e| [-11.0, y(f64::from(e)) - 4.0]).collect();
    let mut labels: Vec<String> = (low..=high).map(|e| unit.tick(e)).collect();
    places.push([(WIDTH / 2.0) as f32, HEIGHT as f32]);
    labels.push(format!("configurations 0 … {last}, in the order of measuring"));
    let mut colours = vec![TEXT; labels.len()];
    for (number, one) in series.iter().filter(|one| !one.values.is_empty()).enumerate() {
        places.push([20.0 + 40.0 * number as f32, -16.0]);
        labels.push(one.name.clone());
        colours.push(one.colour);
    }
    let text = Points2D::new(places)
        .with_labels(labels)
        .with_show_labels(true)
        .with_colors(colours)
        .with_radii([Radius::new_ui_points(0.0)]);
    stream.log(format!("{path}/text"), &text)?;

    for one in series {
        let points = one.values.iter().filter(|v| drawable(v.1)).map(|(index, value)| [x(*index), y(libm::log10(*value))]);
        let points = Points2D::new(points).with_colors([one.colour]).with_radii([Radius::new_ui_points(2.6)]);
        stream.log(format!("{path}/{}", one.name.replace([' ', ','], "_")), &points)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_carry_a_unit_that_reads_well() {
        let ticks = [-8, -6, -5, -3, -2, 0].map(|exponent| Unit::Metre.tick(exponent));
        assert_eq!(ticks, ["10 nm", "1 µm", "10 µm", "1 mm", "10 mm", "1 m"]);
        assert_eq!(Unit::Degree.tick(-3), "0.001°");
    }
}
