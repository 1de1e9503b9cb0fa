//! Units that are not SI, and numbers as people read them.

/// One second of arc, rad.
pub const ARCSEC: f64 = std::f64::consts::PI / 648_000.0;

/// Units of length by their names, the first being ours: m.
pub const LENGTHS: [(&[&str], f64); 6] = [
    (&["m", "meter", "meters", "metre", "metres"], 1.0),
    (&["mm", "millimeter", "millimeters", "millimetre", "millimetres"], 1e-3),
    (&["cm"], 1e-2),
    (&["um", "µm", "micron", "microns"], 1e-6),
    (&["inch", "in", "inches"], 0.0254),
    (&["ft", "foot", "feet"], 0.3048),
];
/// Units of angle: rad.
pub const ANGLES: [(&[&str], f64); 4] = [
    (&["rad", "radian", "radians"], 1.0),
    (&["deg", "degree", "degrees", "°"], std::f64::consts::PI / 180.0),
    (&["turn", "turns", "rev"], 2.0 * std::f64::consts::PI),
    (&["mrad"], 1e-3),
];

/// The unit of `units` that has this name: our name for it, and its size in m or rad.
#[must_use]
pub fn unit_named(units: &[(&'static [&'static str], f64)], name: &str) -> Option<(&'static str, f64)> {
    units.iter().find(|(names, _)| names.contains(&name)).map(|(names, size)| (names[0], *size))
}

/// A length in micrometres, without its unit; what is below a nanometre is only said to be.
#[must_use]
pub fn micrometres(metres: f64) -> String {
    if metres > 0.0 && metres < 1e-9 { "< 0.001".to_owned() } else { number(metres * 1e6) }
}

/// Four significant digits, in plain notation where that is readable.
#[must_use]
pub fn number(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 {
        "0".to_owned()
    } else if !(1e-4..1e6).contains(&size) {
        format!("{value:.3e}")
    } else {
        let before = (libm::floor(libm::log10(size)) as i32 + 1).max(0);
        format!("{value:.*}", usize::try_from((4 - before).clamp(0, 6)).unwrap_or(0))
    }
}
