//! The same command gives the same bytes.

use std::fs;

use crate::harness::quick_run;

#[test]
fn the_number_of_threads_changes_no_byte() {
    let runs = ["1", "2"].map(|threads| quick_run(&["--threads", threads]));
    for name in ["arm8.mcap", "arm8.truth.toml", "arm8.urdf", "arm8.calibrated.urdf"] {
        let [one, two] = [0, 1].map(|run: usize| fs::read(runs[run].path(name)).unwrap());
        assert!(one == two, "{name} differs between one thread and two");
    }
}

#[test]
fn another_seed_gives_another_run() {
    let (run, other) = (quick_run(&[]), quick_run(&["--seed", "7"]));
    assert_eq!(other.json["seed"], 7);
    for (name, other_name) in [("arm8.mcap", "arm8-seed7.mcap"), ("arm8.truth.toml", "arm8-seed7.truth.toml")] {
        assert_ne!(fs::read(run.path(name)).unwrap(), fs::read(other.path(other_name)).unwrap());
    }
    assert_ne!(run.json["design"]["configurations"], other.json["design"]["configurations"]);
    // The hidden errors depend on the public seed too, the nominal arm on none.
    assert_ne!(run.json["identification"]["parameters"], other.json["identification"]["parameters"]);
    assert_eq!(fs::read(run.path("arm8.urdf")).unwrap(), fs::read(other.path("arm8-seed7.urdf")).unwrap());
}

#[test]
fn overriding_a_value_is_the_same_as_writing_it_into_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    let text = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/arm8.toml")).unwrap();
    let scene = folder.path().join("written.toml");
    fs::write(&scene, text.replace("iterations = 200", "iterations = 5").replace("count = 40", "count = 12")).unwrap();
    crate::harness::kincal(folder.path(), &["run", scene.to_str().unwrap(), "-q"]).ends(0);
    let run = quick_run(&["--set", "design.count=12"]);
    assert!(fs::read(run.path("arm8.mcap")).unwrap() == fs::read(folder.path().join("arm8.mcap")).unwrap());
}
