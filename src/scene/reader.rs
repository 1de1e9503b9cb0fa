//! Reading scenes, overriding values, and writing the public part.

use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::convert;
use super::error::{Invalid, Located, Problem, SceneError, in_our_words};
use super::file::{InjectedOnlyToml, SceneToml, WeightsToml};
use super::magnitude::too_large;
use super::{Scene, urdf};
use crate::arm::Arm;
use crate::design::problem::Method;
use crate::simulation::injected::Injected;

/// A scene as read: validated, with the file's own values kept for writing them again.
#[derive(Clone, Debug)]
pub struct SceneFile {
    /// What the analyser may know.
    pub scene: Scene,
    /// What it may not; absent in a public scene.
    pub injected: Option<Injected>,
    toml: SceneToml,
    /// Where `arm.urdf_file` is looked for; `None` for a text that no file holds.
    folder: Option<PathBuf>,
}

/// Reads and validates the scene file at `path`.
///
/// # Errors
/// If the file cannot be read or is not a valid scene; the message names line, key, what was found and what is allowed.
pub fn read(path: impl AsRef<Path>) -> Result<SceneFile, SceneError> {
    let path = path.as_ref();
    let text = crate::files::text(path, crate::files::LARGEST_TEXT)
        .map_err(|source| SceneError::Read { path: path.to_owned(), source })?;
    in_folder(&text, &path.display().to_string(), path.parent())
}

/// Validates the scene `text`; `origin` is what messages call it.
///
/// # Errors
/// If it is not a valid scene, or names a URDF by its file: only [`read`] knows where to look for it.
pub fn parse(text: &str, origin: &str) -> Result<SceneFile, SceneError> {
    in_folder(text, origin, None)
}

fn in_folder(text: &str, origin: &str, folder: Option<&Path>) -> Result<SceneFile, SceneError> {
    if text.trim_start().starts_with('<') {
        return Err(SceneError::Invalid(Box::new(Problem {
            origin: origin.to_owned(),
            position: Some((1, 1)),
            key: String::new(),
            found: "XML, such as a URDF".to_owned(),
            allowed: "a scene in TOML".to_owned(),
            remedy:
                "give a scene such as scenes/arm8.toml; a URDF goes with a table to `kincal identify TABLE --robot URDF`, or \
                     into a scene such as scenes/panda.toml"
                    .to_owned(),
        })));
    }
    let located = Located::parse(text, origin)?;
    let toml: SceneToml = deserialise(text, &located, origin)?;
    validated(toml, folder).map_err(|invalid| located.error(invalid, origin))
}

/// Validates the text of an injected section alone, as [`SceneFile::injected_toml`] writes it, against the arm it is about.
///
/// # Errors
/// If it is not a valid section `[injected]`.
pub fn parse_injected(text: &str, origin: &str, arm: &Arm) -> Result<Injected, SceneError> {
    let located = Located::parse(text, origin)?;
    let toml: InjectedOnlyToml = deserialise(text, &located, origin)?;
    if let Some(invalid) = toml::Value::try_from(&toml).ok().and_then(|value| too_large(&value, "")) {
        return Err(located.error(invalid, origin));
    }
    convert::injected(&toml.injected, arm).map_err(|invalid| located.error(invalid, origin))
}

fn deserialise<T: DeserializeOwned>(text: &str, located: &Located<'_>, origin: &str) -> Result<T, SceneError> {
    toml::from_str(text).map_err(|error| located.deserialise_error(&error, origin))
}

fn validated(mut toml: SceneToml, folder: Option<&Path>) -> Result<SceneFile, Invalid> {
    let urdf_file = urdf::inline(&mut toml.arm, folder)?;
    // What TOML cannot write, such as a seed of 64 bits, is refused by name below.
    if let Some(invalid) = toml::Value::try_from(&toml).ok().and_then(|value| too_large(&value, "")) {
        return Err(invalid);
    }
    let scene = convert::scene(&toml).map_err(|invalid| match urdf_file {
        // The key that the scene has; the line is that of the other file.
        Some(file) if invalid.key == "arm.urdf" => {
            Invalid { key: "arm.urdf_file".to_owned(), found: format!("{file}, {}", invalid.found), ..invalid }
        }
        _ => invalid,
    })?;
    let injected = toml.injected.as_ref().map(|injected| convert::injected(injected, &scene.arm)).transpose()?;
    toml.injected.as_ref().map(|injected| convert::together(injected, &scene.plan)).transpose()?;
    Ok(SceneFile { scene, injected, toml, folder: folder.map(Path::to_owned) })
}

impl SceneFile {
    /// The scene without its injected section, written from the validated values: the file's comments are not in it. Parsing it
    /// gives [`SceneFile::scene`] again, bit for bit.
    ///
    /// # Errors
    /// If the values cannot be written, which no valid scene causes.
    pub fn public_toml(&self) -> Result<String, SceneError> {
        Ok(toml::to_string(&SceneToml { injected: None, ..self.toml.clone() })?)
    }

    /// The injected section alone, for [`parse_injected`]; `None` in a public scene.
    ///
    /// # Errors
    /// If the values cannot be written, which no valid scene causes.
    pub fn injected_toml(&self) -> Result<Option<String>, SceneError> {
        let Some(injected) = self.toml.injected.clone() else {
            return Ok(None);
        };
        Ok(Some(toml::to_string(&InjectedOnlyToml { injected })?))
    }

    /// The values as the file holds them, overrides included.
    #[must_use]
    pub fn toml(&self) -> &SceneToml {
        &self.toml
    }

    /// Overrides the public seed.
    ///
    /// # Errors
    /// If it exceeds 2⁶³−1, which TOML cannot write.
    pub fn set_seed(&mut self, seed: u64) -> Result<(), SceneError> {
        self.change("seed", &seed, |toml| toml.seed = seed)
    }

    /// Overrides the number of configurations m.
    ///
    /// # Errors
    /// If it is below what eq. 30 asks for.
    pub fn set_count(&mut self, count: usize) -> Result<(), SceneError> {
        self.change("design.count", &count, |toml| toml.design.count = count)
    }

    /// Overrides the number of held-out configurations.
    ///
    /// # Errors
    /// If it is zero.
    pub fn set_held_out_count(&mut self, count: usize) -> Result<(), SceneError> {
        self.change("plan.held_out_count", &count, |toml| toml.plan.held_out_count = count)
    }

    /// Overrides how configurations are chosen.
    ///
    /// # Errors
    /// None today; as the others.
    pub fn set_method(&mut self, method: Method) -> Result<(), SceneError> {
        self.change("design.method", &method, |toml| toml.design.method = method)
    }

    /// Overrides how residuals are weighted.
    ///
    /// # Errors
    /// If they are to be weighted by a noise that is declared to be zero.
    pub fn set_weights(&mut self, weights: WeightsToml) -> Result<(), SceneError> {
        self.change("identification.weights", &weights, |toml| toml.identification.weights = weights)
    }

    /// Overrides the hidden seed.
    ///
    /// # Errors
    /// If the scene injects nothing.
    pub fn set_injected_seed(&mut self, seed: &str) -> Result<(), SceneError> {
        if self.injected.is_none() {
            return Err(nothing_injected().at(&origin_of("injected.seed", seed), None));
        }
        self.change("injected.seed", &seed, |toml| {
            if let Some(injected) = &mut toml.injected {
                injected.seed = seed.to_owned();
            }
        })
    }

    /// Overrides any value: `key` as in messages (`design.swarm.particles`, `arm.frame[3].a_mm`), `value` as TOML. The key need
    /// not be in the file if the schema has it.
    ///
    /// # Errors
    /// If the key or the value is not allowed; the scene is then unchanged.
    pub fn set(&mut self, key: &str, value: &str) -> Result<(), SceneError> {
        let origin = origin_of(key, value);
        if self.injected.is_none() && key.split('.').next() == Some("injected") {
            return Err(nothing_injected().at(&origin, None));
        }
        let assignment = format!("value = {value}");
        Located::parse(&assignment, &origin).map_err(|error| without_position(error, key))?;
        let table = toml::from_str::<toml::Table>(&assignment).ok().filter(|table| table.len() == 1);
        let value = table.and_then(|mut table| table.remove("value"));
        let mut root = toml::Value::try_from(&self.toml)?;
        if key == "arm.urdf_file"
            && let Some(arm) = root.get_mut("arm").and_then(toml::Value::as_table_mut)
        {
            // The text that is there is the other file's.
            arm.remove("urdf");
        }
        let place = place(&mut root, key).map_err(|invalid| invalid.at(&origin, None))?;
        match (place, value) {
            (Place::Key(table, name), Some(value)) => {
                table.insert(name, value);
            }
            (Place::Entry(entry), Some(value)) => *entry = value,
            (_, None) => {
                return Err(Invalid::new(key, assignment, "one TOML value", "give one value for one key").at(&origin, None));
            }
        }
        // By way of text: reading scenes from values as well would be a tenth of the program's machine code.
        let toml: SceneToml = toml::from_str(&toml::to_string(&root)?)
            .map_err(|error| in_our_words(error.message(), key.to_owned()).at(&origin, None))?;
        *self = validated(toml, self.folder.as_deref()).map_err(|invalid| invalid.at(&origin, None))?;
        Ok(())
    }

    fn change(&mut self, key: &str, value: &impl Serialize, change: impl FnOnce(&mut SceneToml)) -> Result<(), SceneError> {
        let mut toml = self.toml.clone();
        change(&mut toml);
        let shown = || serde_json::to_string(value).unwrap_or_else(|_| "…".to_owned());
        *self = validated(toml, self.folder.as_deref()).map_err(|invalid| invalid.at(&origin_of(key, &shown()), None))?;
        Ok(())
    }
}

fn origin_of(key: &str, value: &str) -> String {
    format!("override {key} = {value}")
}

fn nothing_injected() -> Invalid {
    Invalid::new(
        "injected",
        "a public scene",
        "a scene with a section [injected]",
        "use the scene file with its injected section",
    )
}

fn without_position(error: SceneError, key: &str) -> SceneError {
    match error {
        SceneError::Invalid(mut problem) => {
            problem.position = None;
            problem.key = key.to_owned();
            SceneError::Invalid(problem)
        }
        other => other,
    }
}

enum Place<'a> {
    Key(&'a mut toml::Table, String),
    Entry(&'a mut toml::Value),
}

/// Where the value of `key` is, or would be if the schema lets it be left out.
fn place<'a>(root: &'a mut toml::Value, key: &str) -> Result<Place<'a>, Invalid> {
    let nowhere = |at: &str| {
        Invalid::new(
            key,
            format!("no `{at}` in this scene"),
            "the path of a key, such as design.count or arm.frame[3].a_mm",
            "check the key",
        )
    };
    let mut value = root;
    let mut segments = key.split('.').peekable();
    while let Some(segment) = segments.next() {
        let (name, indices) = super::error::split_indices(segment);
        let is_last = segments.peek().is_none();
        let table = value.as_table_mut().ok_or_else(|| nowhere(segment))?;
        if is_last && indices.is_empty() {
            return Ok(Place::Key(table, name.to_owned()));
        }
        value = table.get_mut(name).ok_or_else(|| nowhere(segment))?;
        for index in indices {
            value = value.as_array_mut().and_then(|array| array.get_mut(index)).ok_or_else(|| nowhere(segment))?;
        }
        if is_last {
            return Ok(Place::Entry(value));
        }
    }
    Err(nowhere(key))
}
