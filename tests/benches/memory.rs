//! Peak memory and time of whole commands, each in a process of its own: `cargo bench --bench memory`. Linux only.

#![allow(clippy::print_stdout, reason = "a benchmark prints what it measured")]

use std::path::Path;
use std::process::{Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

/// The operating system keeps the peak of a process only while it lives; this is how often it is asked for.
const SAMPLED_EVERY: Duration = Duration::from_millis(2);

fn main() -> ExitCode {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().to_str().expect("a path in UTF-8").to_owned();
    let scene = format!("{}/scenes/arm8.toml", env!("CARGO_MANIFEST_DIR"));
    let (recording, design) = (format!("{out}/arm8.mcap"), format!("{out}/arm8-design.mcap"));
    let commands: [&[&str]; 5] = [
        &["run", &scene],
        &["design", &scene],
        &["measure", &scene, "--design", &design],
        &["identify", &recording],
        &["diagnose", &recording],
    ];
    println!("{:<10} {:>10} {:>10}", "command", "peak, MB", "time, s");
    for arguments in commands {
        let Some((peak_kb, time)) = measured(arguments, folder.path()) else {
            eprintln!("kincal {} failed, or this system does not tell the memory of a process", arguments.join(" "));
            return ExitCode::FAILURE;
        };
        println!("{:<10} {:>10.0} {:>10.2}", arguments[0], peak_kb as f64 / 1e3, time.as_secs_f64());
    }
    ExitCode::SUCCESS
}

/// Peak resident memory, kB, and wall time of `kincal` with these arguments.
fn measured(arguments: &[&str], out: &Path) -> Option<(u64, Duration)> {
    let start = Instant::now();
    let mut child = Command::new(env!("CARGO_BIN_EXE_kincal"))
        .args(arguments)
        .args(["--quiet", "--rerun", "off", "--out"])
        .arg(out)
        .stdout(Stdio::null())
        .spawn()
        .ok()?;
    let mut peak = None;
    let status = loop {
        peak = peak.max(peak_kb(child.id()));
        if let Some(status) = child.try_wait().ok()? {
            break status;
        }
        std::thread::sleep(SAMPLED_EVERY);
    };
    // 1 is a bad answer, such as a gap that nothing explains: a result like any other.
    status.code().filter(|code| *code < 2)?;
    Some((peak?, start.elapsed()))
}

fn peak_kb(process: u32) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix(" kB")?.parse().ok()
}
