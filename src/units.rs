//! Units that are not SI, and numbers as people read them.

/// One second of arc, rad.
pub const ARCSEC: f64 = std::f64::consts::PI / 648_000.0;

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
