//! Where a run is shown.

use std::path::PathBuf;
use std::str::FromStr;

/// Where a run is shown: the value of `--rerun`.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub enum Target {
    /// At the viewer that listens on the default port of this machine; nowhere if there is none.
    #[default]
    Auto,
    /// At a viewer that is started for it, or that listens already.
    Spawn,
    /// At the viewer that listens at a URL (`None`: the default port of this machine); an error if there is none.
    Connect(Option<String>),
    /// In a `.rrd` file.
    File(PathBuf),
    /// Nowhere.
    Off,
}

/// A word that is no target.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TargetError {
    /// No target begins like this.
    #[error("`{0}` is no place to show a run at; allowed are auto, spawn, connect, connect=URL, FILE.rrd and off")]
    Unknown(String),
    /// `connect=` with nothing after it.
    #[error(
        "`connect=` needs a URL such as connect=rerun+http://127.0.0.1:9876/proxy or connect=127.0.0.1:9876; \
         plain `connect` takes the default port of this machine"
    )]
    NoUrl,
}

impl FromStr for Target {
    type Err = TargetError;

    fn from_str(text: &str) -> Result<Self, TargetError> {
        match text {
            "auto" => Ok(Target::Auto),
            "spawn" => Ok(Target::Spawn),
            "connect" => Ok(Target::Connect(None)),
            "off" => Ok(Target::Off),
            _ => match text.strip_prefix("connect=") {
                Some("") => Err(TargetError::NoUrl),
                Some(url) => Ok(Target::Connect(Some(url.to_owned()))),
                None if text.len() > ".rrd".len() && text.ends_with(".rrd") => Ok(Target::File(PathBuf::from(text))),
                None => Err(TargetError::Unknown(text.to_owned())),
            },
        }
    }
}

impl std::fmt::Display for Target {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Target::Auto => f.write_str("auto"),
            Target::Spawn => f.write_str("spawn"),
            Target::Connect(None) => f.write_str("connect"),
            Target::Connect(Some(url)) => write!(f, "connect={url}"),
            Target::File(path) => write!(f, "{}", path.display()),
            Target::Off => f.write_str("off"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_target_is_read_as_it_is_written() {
        for text in ["auto", "spawn", "connect", "connect=rerun+http://10.0.0.7:9876/proxy", "out/run.rrd", "off"] {
            let target: Target = text.parse().unwrap();
            assert_eq!(target.to_string(), text);
        }
        assert_eq!("out/run.rrd".parse(), Ok(Target::File(PathBuf::from("out/run.rrd"))));
    }

    #[test]
    fn a_word_that_is_no_target_is_told_what_is_allowed() {
        for text in ["", "Auto", "run.mcap", ".rrd", "yes"] {
            let message = text.parse::<Target>().unwrap_err().to_string();
            for allowed in ["auto", "spawn", "connect=URL", "FILE.rrd", "off"] {
                assert!(message.contains(allowed), "`{text}`: {message}");
            }
        }
        assert!("connect=".parse::<Target>().unwrap_err().to_string().contains("127.0.0.1:9876"));
    }
}
