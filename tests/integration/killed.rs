//! A run that is killed.

use std::fs;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use crate::harness::{command, kincal, names};

/// Starts a run into `out` that never ends by itself, and waits until its recording has `bytes`.
fn endless_run(out: &Path, bytes: u64) -> Child {
    let partial = out.join("arm8.partial.mcap");
    let out_text = out.to_str().unwrap();
    let arguments = ["run", "scenes/arm8.toml", "--set", "design.swarm.iterations=100000", "--out", out_text];
    let mut child = command(&arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let begun = Instant::now();
    while fs::metadata(&partial).map_or(0, |metadata| metadata.len()) < bytes {
        assert!(begun.elapsed() < Duration::from_secs(60) && child.try_wait().unwrap().is_none(), "it does not record");
        std::thread::sleep(Duration::from_millis(10));
    }
    child
}

#[test]
fn a_killed_run_leaves_a_partial_recording_that_can_be_used() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    let partial = out.join("arm8.partial.mcap");
    let mut child = endless_run(out, 300_000);
    // SIGKILL: no handler, no destructor.
    child.kill().unwrap();
    assert!(!child.wait().unwrap().success());
    assert_eq!(names(out), ["arm8.partial.mcap"]);

    let path = partial.to_str().unwrap();
    let exported = out.join("exported");
    kincal(&exported, &["export", path, "--to", "toml"]).ends(2);
    kincal(&exported, &["export", path, "--to", "toml", "--partial"]).ends(0);
    let scene = fs::read_to_string(exported.join("arm8.partial.public.toml")).unwrap();
    assert!(scene.contains("iterations = 100000") && !scene.contains("injected"), "{scene}");
    // The replay ends where the recording does, not 100000 iterations later.
    let begun = Instant::now();
    let ran = kincal(out, &["replay", path, "--json"]).ends(2);
    assert!(ran.stderr.contains("is cut off"), "{}", ran.stderr);
    let json = ran.json();
    assert!(json["first_difference"].is_null() && json["messages_compared"].as_u64().unwrap() > 10, "{json}");
    println!("replayed {} messages in {:?}", json["messages_compared"], begun.elapsed());
    let ran = kincal(out, &["identify", path, "--partial"]).ends(2);
    assert!(ran.stderr.contains("holds no measurements"), "{}", ran.stderr);
    assert_eq!(names(out), ["arm8.partial.mcap", "exported"]);

    // The next run takes over.
    kincal(out, &["run", "scenes/arm8.toml", "--set", "design.swarm.iterations=5"]).ends(0);
    assert!(!partial.exists() && out.join("arm8.mcap").exists());
}

#[test]
fn two_runs_of_one_name_do_not_write_into_each_other() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    let mut child = endless_run(out, 1000);
    let ran = kincal(out, &["run", "scenes/arm8.toml", "--set", "design.swarm.iterations=5"]).ends(2);
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(ran.stderr.contains("is being written by another run"), "{}", ran.stderr);
    assert_eq!(names(out), ["arm8.partial.mcap"]);
}
