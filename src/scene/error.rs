//! What is wrong with a scene file, where, and what to do about it.

use std::fmt;
use std::path::PathBuf;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Why a scene was refused.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The file could not be read.
    #[error("{}: {source}\n  do: check the path; `scenes/` holds the scenes that are shipped", path.display())]
    Read {
        /// As asked for.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The text is not a valid scene.
    #[error(transparent)]
    Invalid(Box<Problem>),
    /// A valid scene could not be written as TOML.
    #[error("the scene cannot be written as TOML: {0}")]
    Write(#[from] toml::ser::Error),
}

/// One thing that is wrong in a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// The file, or where else the text came from.
    pub origin: String,
    /// Line and column, from 1; absent for a value that no file holds, such as one given on the command line.
    pub position: Option<(usize, usize)>,
    /// Path of the key, such as `arm.frame[3].a_mm`; entries of a list count from 1. Empty for the whole file.
    pub key: String,
    /// What was found.
    pub found: String,
    /// What is allowed.
    pub allowed: String,
    /// What to do.
    pub remedy: String,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.origin)?;
        if let Some((line, column)) = self.position {
            write!(f, ":{line}:{column}")?;
        }
        write!(f, ": {}", if self.key.is_empty() { "(top level)" } else { &self.key })?;
        for (label, text) in [("found", &self.found), ("allowed", &self.allowed), ("do", &self.remedy)] {
            if !text.is_empty() {
                write!(f, "\n  {label}: {text}")?;
            }
        }
        Ok(())
    }
}

impl std::error::Error for Problem {}

/// What validation finds wrong, before it is known where in the text that is.
#[derive(Clone, Debug)]
pub(super) struct Invalid {
    pub(super) key: String,
    pub(super) found: String,
    pub(super) allowed: String,
    pub(super) remedy: String,
}

impl Invalid {
    pub(super) fn new(
        key: impl Into<String>,
        found: impl Into<String>,
        allowed: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Invalid { key: key.into(), found: found.into(), allowed: allowed.into(), remedy: remedy.into() }
    }

    pub(super) fn at(self, origin: &str, position: Option<(usize, usize)>) -> SceneError {
        let Invalid { key, found, allowed, remedy } = self;
        SceneError::Invalid(Box::new(Problem { origin: origin.to_owned(), position, key, found, allowed, remedy }))
    }
}

/// A parsed text that can say where its keys are.
pub(super) struct Located<'a> {
    text: &'a str,
    root: Spanned<DeTable<'a>>,
}

impl<'a> Located<'a> {
    /// Parses `text`; syntax errors and numbers that are not finite end here.
    pub(super) fn parse(text: &'a str, origin: &str) -> Result<Self, SceneError> {
        let root = DeTable::parse(text).map_err(|error| {
            let found = error.message().replace('\n', ", ");
            let position = error.span().map(|span| line_and_column(text, span.start));
            Invalid::new("", found, "TOML (https://toml.io)", "correct the syntax here").at(origin, position)
        })?;
        let located = Located { text, root };
        if let Some(invalid) = not_finite_in_table(located.root.get_ref(), "") {
            return Err(located.error(invalid, origin));
        }
        Ok(located)
    }

    /// Gives `invalid` the place of its key, or of the nearest table around it.
    pub(super) fn error(&self, invalid: Invalid, origin: &str) -> SceneError {
        let position = line_and_column(self.text, self.find(&invalid.key));
        invalid.at(origin, Some(position))
    }

    /// Puts an error of deserialising into our words.
    pub(super) fn deserialise_error(&self, error: &toml::de::Error, origin: &str) -> SceneError {
        let span = error.span();
        let key = span.as_ref().and_then(|span| key_in_table(self.root.get_ref(), "", span)).unwrap_or_default();
        let position = span.map(|span| line_and_column(self.text, span.start));
        in_our_words(error.message(), key).at(origin, position)
    }

    fn find(&self, key: &str) -> usize {
        let mut offset = self.root.span().start;
        let mut table = Some(self.root.get_ref());
        for segment in key.split('.').filter(|segment| !segment.is_empty()) {
            let (name, indices) = split_indices(segment);
            let Some((key, found)) = table.and_then(|table| table.iter().find(|(key, _)| key.get_ref() == name)) else {
                return offset;
            };
            offset = key.span().start;
            let mut value = Some(found);
            for index in indices {
                let Some(entry) = value.and_then(|value| value.get_ref().as_array()).and_then(|array| array.get(index)) else {
                    return offset;
                };
                offset = entry.span().start;
                value = Some(entry);
            }
            table = value.and_then(|value| value.get_ref().as_table());
        }
        offset
    }
}

/// `frame[3]` as `frame` and `[2]`: keys count from 1, arrays from 0.
pub(super) fn split_indices(segment: &str) -> (&str, Vec<usize>) {
    let mut parts = segment.split('[');
    let name = parts.next().unwrap_or(segment);
    let indices = parts.filter_map(|part| part.trim_end_matches(']').parse::<usize>().ok()?.checked_sub(1)).collect::<Vec<_>>();
    (name, indices)
}

fn join(key: &str, name: &str) -> String {
    if key.is_empty() { name.to_owned() } else { format!("{key}.{name}") }
}

fn not_finite_in_table(table: &DeTable<'_>, key: &str) -> Option<Invalid> {
    table.iter().find_map(|(name, value)| not_finite(value.get_ref(), &join(key, name.get_ref())))
}

fn not_finite(value: &DeValue<'_>, key: &str) -> Option<Invalid> {
    match value {
        DeValue::Table(table) => not_finite_in_table(table, key),
        DeValue::Array(array) => {
            array.iter().enumerate().find_map(|(index, entry)| not_finite(entry.get_ref(), &format!("{key}[{}]", index + 1)))
        }
        DeValue::Float(float) => {
            let finite = float.as_str().replace('_', "").parse::<f64>().is_ok_and(f64::is_finite);
            (!finite).then(|| Invalid::new(key, float.as_str(), "a finite number", "write a number"))
        }
        _ => None,
    }
}

/// The path of the key or value that `span` covers exactly.
fn key_in_table(table: &DeTable<'_>, key: &str, span: &std::ops::Range<usize>) -> Option<String> {
    table.iter().find_map(|(name, value)| {
        let path = join(key, name.get_ref());
        if name.span() == *span { Some(path) } else { key_in_value(value, path, span) }
    })
}

fn key_in_value(value: &Spanned<DeValue<'_>>, key: String, span: &std::ops::Range<usize>) -> Option<String> {
    if value.span() == *span && !value.get_ref().is_array() {
        return Some(key);
    }
    let within = match value.get_ref() {
        DeValue::Table(table) => key_in_table(table, &key, span),
        DeValue::Array(array) => {
            array.iter().enumerate().find_map(|(index, entry)| key_in_value(entry, format!("{key}[{}]", index + 1), span))
        }
        _ => None,
    };
    within.or_else(|| (value.span() == *span).then_some(key))
}

fn line_and_column(text: &str, offset: usize) -> (usize, usize) {
    let before = text.get(..offset).unwrap_or(text);
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
}

fn quoted(text: &str) -> Vec<&str> {
    text.split('`').skip(1).step_by(2).collect()
}

/// serde's message as what was found, what is allowed and what to do.
pub(super) fn in_our_words(message: &str, key: String) -> Invalid {
    let message = message.lines().collect::<Vec<_>>().join(", ");
    if let Some((found, expected)) = ["invalid type: ", "invalid value: ", "invalid "]
        .iter()
        .find_map(|kind| message.strip_prefix(kind)?.split_once(", expected "))
    {
        // What `identify --base-link` takes is tried here too.
        let remedy = match key.as_str() {
            "arm.base_link" => "did you mean `urdf_base_link`? base_link is the table of a link",
            _ => "give a value of the allowed kind",
        };
        return Invalid::new(key, found, in_plain_words(expected), remedy);
    }
    let names = quoted(&message);
    match names.split_first() {
        Some((first, allowed)) if message.starts_with("unknown field") => {
            let remedy = suggestion(first, allowed).unwrap_or_else(|| "remove the key, or use one of those allowed".to_owned());
            Invalid::new(key, format!("unknown key `{first}`"), allowed.join(", "), remedy)
        }
        Some((first, allowed)) if message.starts_with("unknown variant") => {
            let remedy = suggestion(first, allowed).unwrap_or_else(|| "use one of those allowed".to_owned());
            Invalid::new(key, format!("`{first}`"), allowed.join(", "), remedy)
        }
        Some((first, _)) if message.starts_with("missing field") => {
            let allowed = format!("`{first}` is required here");
            Invalid::new(key, format!("`{first}` is missing"), allowed, format!("add `{first} = …`"))
        }
        _ => Invalid::new(key, message.clone(), "", "correct the value"),
    }
}

fn in_plain_words(expected: &str) -> String {
    match expected {
        "f64" => "a number".to_owned(),
        "u64" | "usize" => "a whole number, not negative".to_owned(),
        "an array of length 3" | "array of length 3" => "a list of three numbers".to_owned(),
        "an array of length 2" | "array of length 2" => "a list of two".to_owned(),
        other => match other.strip_prefix("struct ") {
            Some(_) => "a table".to_owned(),
            None => other.to_owned(),
        },
    }
}

const UNITS: [(&str, &str); 31] = [
    ("um_per_m_per_k", "expansions are in µm per m and K"),
    ("urad_per_rad", "errors of gears are in µrad per rad"),
    ("urad_per_nm", "compliances are in µrad per N·m"),
    ("rad_per_nm", ""),
    ("urad_per_k", "drifts are in µrad per K"),
    ("nm_per_mrad3", "this stiffness is in N·m/mrad³"),
    ("nm_per_rad3", ""),
    ("nm_per_rad", "stiffnesses are in N·m/rad"),
    ("n_per_m", ""),
    ("nm_per_deg", ""),
    ("ppm", "scales are in parts per million"),
    ("percent", ""),
    ("um_per_m", "growth of noise with distance is in µm per m"),
    ("kg_m2", "inertias are in kg·m²"),
    ("m_s2", "accelerations are in m/s²"),
    ("rad_s", "angular velocities are in rad/s"),
    ("mm", "lengths are in mm"),
    ("cm", ""),
    ("um", "small lengths are in µm"),
    ("m", ""),
    ("deg", "angles are in degrees"),
    ("mrad", ""),
    ("urad", "small angles are in µrad"),
    ("rad", ""),
    ("arcsec", "errors of angles are in arc seconds"),
    ("arcmin", ""),
    ("kg", "masses are in kg"),
    ("g", ""),
    ("k", "temperature differences are in K"),
    ("c", "temperatures are in °C"),
    ("s", "times are in s"),
];

/// A key without its unit, and what to say about the unit.
fn without_unit(name: &str) -> (&str, &'static str) {
    UNITS.iter().find_map(|(unit, says)| Some((name.strip_suffix(unit)?.strip_suffix('_')?, *says))).unwrap_or((name, ""))
}

/// The allowed name that was probably meant.
pub(super) fn suggestion<'a>(found: &str, allowed: impl IntoIterator<Item = &'a &'a str>) -> Option<String> {
    let (stem, _) = without_unit(found);
    let mut best: Option<(usize, &str)> = None;
    for name in allowed {
        let (allowed_stem, says) = without_unit(name);
        if stem == allowed_stem && found != *name {
            let says = if says.is_empty() { String::new() } else { format!(" {says} here") };
            return Some(format!("did you mean `{name}`?{says}"));
        }
        let is_part = found.len() > 2 && (name.starts_with(found) || name.ends_with(found));
        let distance = if is_part { 1 } else { edits(found, name) };
        if best.is_none_or(|(least, _)| distance < least) {
            best = Some((distance, name));
        }
    }
    best.filter(|(distance, name)| *distance <= 2.max(name.len() / 3)).map(|(_, name)| format!("did you mean `{name}`?"))
}

/// Levenshtein's distance.
fn edits(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, from) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, to) in b.iter().enumerate() {
            let changed = diagonal + usize::from(from != *to);
            diagonal = row[j + 1];
            row[j + 1] = changed.min(row[j] + 1).min(row[j + 1] + 1);
        }
    }
    row[b.len()]
}
