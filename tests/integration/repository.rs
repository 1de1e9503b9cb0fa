//! The folder that runs write to by default leaves no trace in the repository.

use std::process::Command;

#[test]
fn recordings_are_ignored() {
    let git = |arguments: &[&str]| Command::new("git").args(arguments).current_dir(env!("CARGO_MANIFEST_DIR")).output();
    let Ok(Ok(top)) = git(&["rev-parse", "--show-toplevel"]).map(|output| String::from_utf8(output.stdout)) else {
        println!("skipped: there is no git");
        return;
    };
    let here = std::fs::canonicalize(env!("CARGO_MANIFEST_DIR")).unwrap();
    if std::fs::canonicalize(top.trim()).ok() != Some(here) {
        println!("skipped: this is not a repository of its own");
        return;
    }
    for name in ["arm8.mcap", "arm8.partial.mcap", "arm8.truth.toml", "arm8.urdf", "arm8.calibrated.urdf", "run.rrd", "arm8.csv"]
    {
        let ignored = git(&["check-ignore", "--quiet", &format!("recordings/{name}")]).unwrap().status;
        assert!(ignored.success(), "recordings/{name} is not ignored");
    }
    let help = crate::harness::kincal(std::path::Path::new("nowhere"), &["--help"]).ends(0);
    assert!(help.stdout.contains("[default: recordings]"), "{}", help.stdout);
}
