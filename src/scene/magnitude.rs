//! How large a number of a scene may be. What nobody means would only overflow, or never end, further on.

use super::error::Invalid;

/// Units at the end of keys, longer ones first, and the largest amount that is taken for meant.
const LARGEST: [(&str, f64); 19] = [
    ("um_per_m_per_k", 1e6),
    ("um_per_m", 1e6),
    ("urad_per_rad", 1e6),
    ("urad_per_nm", 1e6),
    ("urad_per_k", 1e6),
    ("nm_per_mrad3", 1e9),
    ("nm_per_rad", 1e12),
    ("arcsec", 1e6),
    ("ppm", 1e6),
    ("kg_m2", 1e6),
    ("m_s2", 1e3),
    ("urad", 1e6),
    ("deg", 36e3),
    ("mm", 1e5),
    ("um", 1e6),
    ("kg", 1e5),
    ("k", 1e4),
    ("c", 1e4),
    ("s", 1e6),
];

/// What is too large below `key`, if anything. Entries of tables without a unit of their own have that of their table.
pub(super) fn too_large(value: &toml::Value, key: &str) -> Option<Invalid> {
    within(value, key, None)
}

fn within(value: &toml::Value, key: &str, largest: Option<(&str, f64)>) -> Option<Invalid> {
    match value {
        toml::Value::Table(table) => table.iter().find_map(|(name, value)| {
            let path = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
            within(value, &path, largest_of(name).or(largest))
        }),
        toml::Value::Array(entries) => {
            entries.iter().enumerate().find_map(|(index, value)| within(value, &format!("{key}[{}]", index + 1), largest))
        }
        toml::Value::Float(number) => beyond(*number, key, largest),
        toml::Value::Integer(number) => beyond(*number as f64, key, largest),
        _ => None,
    }
}

fn largest_of(name: &str) -> Option<(&'static str, f64)> {
    LARGEST.into_iter().find(|(unit, _)| name.strip_suffix(unit).is_some_and(|stem| stem.ends_with('_')))
}

fn beyond(number: f64, key: &str, largest: Option<(&str, f64)>) -> Option<Invalid> {
    let (unit, largest) = largest?;
    let allowed = format!("{} to {largest}", -largest);
    (number.abs() > largest)
        .then(|| Invalid::new(key, number.to_string(), allowed, format!("check the number: the unit is {unit}")))
}
