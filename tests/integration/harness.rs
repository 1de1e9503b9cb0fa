//! Running `kincal`, and MCAP files read and rewritten without kincal's own reader.

use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::Value;
use tempfile::TempDir;

/// Arguments that make a run of a shipped scene quick.
pub(crate) const QUICK: [&str; 2] = ["--set", "design.swarm.iterations=5"];

/// What a command did.
pub(crate) struct Ran {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
    pub(crate) arguments: String,
}

/// The command, ready to start in the project's folder.
pub(crate) fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kincal"));
    command.args(arguments).current_dir(env!("CARGO_MANIFEST_DIR")).stdin(Stdio::null());
    // A viewer that happens to listen on this machine is left alone.
    if !arguments.contains(&"--rerun") {
        command.args(["--rerun", "off"]);
    }
    command
}

/// Runs `kincal` with `arguments` and `--out out`. It must not panic, whatever it is given.
pub(crate) fn kincal(out: &Path, arguments: &[&str]) -> Ran {
    let mut all = arguments.to_vec();
    all.extend(["--out", out.to_str().unwrap()]);
    let output = command(&all).output().unwrap();
    let ran = Ran {
        code: output.status.code(),
        stdout: String::from_utf8(output.stdout).unwrap(),
        stderr: String::from_utf8(output.stderr).unwrap(),
        arguments: all.join(" "),
    };
    assert!(!ran.stderr.contains("panicked") && !ran.stdout.contains("panicked"), "{}: {}", ran.arguments, ran.stderr);
    ran
}

impl Ran {
    /// Asserts the exit code.
    #[track_caller]
    pub(crate) fn ends(self, code: i32) -> Ran {
        assert_eq!(self.code, Some(code), "kincal {}\n{}{}", self.arguments, self.stdout, self.stderr);
        self
    }

    /// The one object on stdout.
    #[track_caller]
    pub(crate) fn json(&self) -> Value {
        let value: Value = serde_json::from_str(&self.stdout).unwrap_or_else(|error| panic!("{error}: {}", self.stdout));
        assert!(value.is_object());
        value
    }
}

/// A folder with a quick run of `arm8` in it.
pub(crate) struct Run {
    pub(crate) folder: TempDir,
    pub(crate) json: Value,
}

impl Run {
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// A path in the folder, for an argument.
    pub(crate) fn text(&self, name: &str) -> String {
        self.path(name).to_str().unwrap().to_owned()
    }
}

/// A quick run of `arm8`, with more arguments.
pub(crate) fn quick_run(more: &[&str]) -> Run {
    let folder = tempfile::tempdir().unwrap();
    let mut arguments = vec!["run", "scenes/arm8.toml", "--json", "--quiet"];
    arguments.extend(QUICK);
    arguments.extend(more);
    let json = kincal(folder.path(), &arguments).ends(0).json();
    Run { folder, json }
}

/// Names in a folder, in order; none where there is no such folder.
pub(crate) fn names(folder: &Path) -> Vec<String> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let mut names: Vec<String> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Topic and bytes of every message of an MCAP file.
pub(crate) fn messages(path: &Path) -> Vec<(String, Vec<u8>)> {
    let bytes = fs::read(path).unwrap();
    let stream = mcap::MessageStream::new(&bytes).unwrap();
    stream.map(|message| message.unwrap()).map(|message| (message.channel.topic.clone(), message.data.into_owned())).collect()
}

/// Writes the recording at `from` to `to`, each message as `change` makes it of topic, number within the topic, and bytes: a
/// valid file, checksums and all.
pub(crate) fn rewrite(from: &Path, to: &Path, mut change: impl FnMut(&str, usize, &[u8]) -> Option<Vec<u8>>) {
    let bytes = fs::read(from).unwrap();
    let mut writer = mcap::Writer::new(fs::File::create(to).unwrap()).unwrap();
    let mut counts = std::collections::BTreeMap::<String, usize>::new();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let mut message = message.unwrap();
        let count = counts.entry(message.channel.topic.clone()).or_default();
        if let Some(data) = change(&message.channel.topic, *count, &message.data) {
            message.data = Cow::Owned(data);
        }
        *count += 1;
        writer.write(&message).unwrap();
    }
    writer.finish().unwrap();
}

/// Writes the recording at `from` to `to` without the messages on `topic`; how many those were.
pub(crate) fn without_topic(from: &Path, to: &Path, topic: &str) -> usize {
    let bytes = fs::read(from).unwrap();
    let mut writer = mcap::Writer::new(fs::File::create(to).unwrap()).unwrap();
    let mut dropped = 0;
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        if message.channel.topic == topic {
            dropped += 1;
        } else {
            writer.write(&message).unwrap();
        }
    }
    writer.finish().unwrap();
    dropped
}

/// Changes the text of message number `number` of the JSON topic `topic`: as text, so that nothing else in it changes.
pub(crate) fn rewrite_text(from: &Path, to: &Path, topic: &str, number: usize, change: impl Fn(&str) -> String) {
    let mut changed = false;
    rewrite(from, to, |at, count, data| {
        (at == topic && count == number).then(|| {
            let (old, new) = (std::str::from_utf8(data).unwrap(), change(std::str::from_utf8(data).unwrap()));
            changed = old != new;
            new.into_bytes()
        })
    });
    assert!(changed, "nothing is changed in message {number} on {topic}");
}

/// Sets the number at the JSON pointer to the next larger one.
pub(crate) fn next_up(text: &str, pointer: &str) -> String {
    let value: Value = serde_json::from_str(text).unwrap();
    let old = number(&value, pointer);
    // Numbers with all their digits stand there once.
    let [old, new] = [old, old.next_up()].map(|number| serde_json::to_string(&number).unwrap());
    assert_eq!(text.matches(&old).count(), 1, "{old}");
    text.replacen(&old, &new, 1)
}

/// A number somewhere in a JSON value, by its JSON pointer.
#[track_caller]
pub(crate) fn number(value: &Value, pointer: &str) -> f64 {
    value.pointer(pointer).and_then(Value::as_f64).unwrap_or_else(|| panic!("no number at {pointer}"))
}
