//! Running `kincal`, and MCAP files read and rewritten without kincal's own reader.

use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::Value;
use tempfile::TempDir;

/// Arguments that make a run of a shipped scene quick.
pub const QUICK: [&str; 2] = ["--set", "design.swarm.iterations=5"];

/// What a command did.
pub struct Ran {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
    pub arguments: String,
}

/// The command, ready to start in the project's folder.
pub fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kincal"));
    command.args(arguments).current_dir(env!("CARGO_MANIFEST_DIR")).stdin(Stdio::null());
    command
}

/// Runs `kincal` with `arguments` and `--out out`. It must not panic, whatever it is given.
pub fn kincal(out: &Path, arguments: &[&str]) -> Ran {
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
    pub fn ends(self, code: i32) -> Ran {
        assert_eq!(self.code, Some(code), "kincal {}\n{}{}", self.arguments, self.stdout, self.stderr);
        self
    }

    /// The one object on stdout.
    #[track_caller]
    pub fn json(&self) -> Value {
        let value: Value = serde_json::from_str(&self.stdout).unwrap_or_else(|error| panic!("{error}: {}", self.stdout));
        assert!(value.is_object());
        value
    }
}

/// A folder with a quick run of `arm8` in it.
pub struct Run {
    pub folder: TempDir,
    pub json: Value,
}

impl Run {
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// A path in the folder, for an argument.
    pub fn text(&self, name: &str) -> String {
        self.path(name).to_str().unwrap().to_owned()
    }
}

/// A quick run of `arm8`, with more arguments.
pub fn quick_run(more: &[&str]) -> Run {
    let folder = tempfile::tempdir().unwrap();
    let mut arguments = vec!["run", "scenes/arm8.toml", "--json", "--quiet"];
    arguments.extend(QUICK);
    arguments.extend(more);
    let json = kincal(folder.path(), &arguments).ends(0).json();
    Run { folder, json }
}

/// Names in a folder, in order; none where there is no such folder.
pub fn names(folder: &Path) -> Vec<String> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let mut names: Vec<String> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Topic and bytes of every message of an MCAP file.
pub fn messages(path: &Path) -> Vec<(String, Vec<u8>)> {
    let bytes = fs::read(path).unwrap();
    let stream = mcap::MessageStream::new(&bytes).unwrap();
    stream.map(|message| message.unwrap()).map(|message| (message.channel.topic.clone(), message.data.into_owned())).collect()
}

/// Writes the recording at `from` to `to`, each message as `change` makes it of topic, number within the topic, and bytes: a
/// valid file, checksums and all.
pub fn rewrite(from: &Path, to: &Path, mut change: impl FnMut(&str, usize, &[u8]) -> Option<Vec<u8>>) {
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

/// Changes message number `number` of the JSON topic `topic`.
pub fn rewrite_json(from: &Path, to: &Path, topic: &str, number: usize, change: impl Fn(&mut Value)) {
    let mut changed = false;
    rewrite(from, to, |at, count, data| {
        (at == topic && count == number).then(|| {
            let mut value: Value = serde_json::from_slice(data).unwrap();
            change(&mut value);
            changed = true;
            serde_json::to_vec(&value).unwrap()
        })
    });
    assert!(changed, "no message {number} on {topic}");
}

/// A number somewhere in a JSON value, by its JSON pointer.
#[track_caller]
pub fn number(value: &Value, pointer: &str) -> f64 {
    value.pointer(pointer).and_then(Value::as_f64).unwrap_or_else(|| panic!("no number at {pointer}"))
}
