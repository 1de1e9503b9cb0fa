//! Who may know whom. What a module must not see is not in its source.

use std::fs;
use std::path::{Path, PathBuf};

/// A source file without its comments and without its tests.
struct Source {
    /// Below `src`, with slashes.
    path: String,
    lines: Vec<(usize, String)>,
}

fn collect(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            collect(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

fn sources() -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    collect(&root, &mut files);
    files.sort();
    assert!(files.len() > 50);
    files
        .iter()
        // Files that only tests include.
        .filter(|file| !["tests.rs", "test_arms.rs", "viewing/example.rs"].iter().any(|name| file.ends_with(name)))
        .map(|file| {
            let text = fs::read_to_string(file).unwrap();
            let mut lines = Vec::new();
            let mut cfg_test = false;
            for (number, line) in text.lines().enumerate() {
                // Test modules stand last in their files.
                if cfg_test && line.starts_with("mod ") && line.ends_with('{') {
                    break;
                }
                cfg_test = line == "#[cfg(test)]";
                let code = line.split("//").next().unwrap_or_default();
                lines.push((number + 1, code.to_owned()));
            }
            Source { path: file.strip_prefix(&root).unwrap().to_str().unwrap().replace('\\', "/"), lines }
        })
        .collect()
}

/// Places that name the crate or module `name`, as a path.
fn mentions(source: &Source, name: &str) -> Vec<String> {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let named = |line: &str| {
        line.match_indices(name).any(|(at, _)| {
            !line[..at].ends_with(is_word) && !line[..at].ends_with('"') && line[at + name.len()..].starts_with("::")
        })
    };
    source
        .lines
        .iter()
        .filter(|(_, line)| named(line))
        .map(|(number, line)| format!("{}:{number}: {}", source.path, line.trim()))
        .collect()
}

#[test]
fn what_analyses_knows_nothing_of_the_physics() {
    let analyser =
        ["arm", "numerics", "solver", "identification", "quality", "design", "measurement", "recording", "effects", "diagnosis"];
    for source in sources() {
        let module = source.path.split(['/', '.']).next().unwrap();
        if !analyser.contains(&module) {
            continue;
        }
        for hidden in ["simulation", "physics", "cell"] {
            // `use super::x` of a module at the top would be the same.
            let found = [mentions(&source, &format!("crate::{hidden}")), mentions(&source, hidden)].concat();
            // The truth file is the truth: it is written beside the recording, and its types are the cell's.
            if source.path != "recording/truth_file.rs" {
                assert!(found.is_empty(), "{found:#?}");
            }
        }
        // Nor does what names causes know of the scene, whose effects are the hidden ones.
        if ["effects", "diagnosis"].contains(&module) {
            for hidden in ["scene", "lab", "session"] {
                let found = mentions(&source, &format!("crate::{hidden}"));
                assert!(found.is_empty(), "{found:#?}");
            }
        }
        if !["recording"].contains(&module) {
            let found: Vec<_> =
                source.lines.iter().filter(|(_, line)| line.contains("Injected") || line.contains("truth_file")).collect();
            assert!(found.is_empty(), "{}: {found:?}", source.path);
        }
    }
}

#[test]
fn every_large_dependency_stays_in_its_module() {
    let allowed: [(&str, &[&str]); 8] = [
        ("rapier3d", &["simulation/physics/"]),
        ("parry3d", &["simulation/physics/", "arm/self_collision.rs"]),
        ("mcap", &["recording/"]),
        ("foxglove", &["recording/"]),
        ("rerun", &["viewing/"]),
        ("clap", &["cli/"]),
        ("svg", &["figure/"]),
        ("tiny_skia", &["figure/"]),
    ];
    let sources = sources();
    for (dependency, places) in allowed {
        let mut used = false;
        for source in &sources {
            let found = mentions(source, dependency);
            used |= !found.is_empty();
            assert!(found.is_empty() || places.iter().any(|place| source.path.starts_with(place)), "{found:#?}");
        }
        assert!(used, "{dependency} is used nowhere: is the test still looking for the right name?");
    }
}

#[test]
fn nothing_prints_but_the_command_line() {
    for source in sources().iter().filter(|source| !source.path.starts_with("cli/")) {
        for (number, line) in &source.lines {
            let prints = ["println!", "eprintln!", "print!(", "dbg!"].iter().any(|name| line.contains(name));
            assert!(!prints, "{}:{number}: {line}", source.path);
        }
    }
}

/// The platform's mathematics library may round differently on the next machine; a recording replays bit for bit everywhere.
#[test]
fn transcendental_functions_are_those_of_libm() {
    let functions = [
        "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sin_cos", "sinh", "cosh", "tanh", "exp", "exp2", "exp_m1", "ln",
        "ln_1p", "log", "log2", "log10", "powf", "cbrt", "hypot",
    ];
    let mut found = Vec::new();
    // Nothing that is only drawn is ever recorded.
    for source in sources().iter().filter(|source| !source.path.starts_with("viewing/")) {
        for (number, line) in &source.lines {
            for function in functions {
                let method = line.match_indices(&format!(".{function}(")).next().is_some();
                let path = line.contains(&format!("f64::{function}")) && !line.contains(&format!("f64::{function}_"));
                if method || path {
                    found.push(format!("{}:{number}: {}", source.path, line.trim()));
                }
            }
        }
    }
    assert!(found.is_empty(), "{found:#?}");
}

/// Quantiles and products whose last digits depend on the platform have one home each, where they are pinned.
#[test]
fn what_depends_on_the_platform_is_pinned_in_one_place() {
    let allowed: [(&str, &[&str]); 4] = [
        ("statrs::", &["numerics/", "statistics.rs"]),
        ("inverse_cdf", &["numerics/"]),
        ("gemm", &[]),
        // The product of dynamic matrices that comes most easily: `numerics::transposed_product` is the same everywhere.
        (".transpose() * &", &[]),
    ];
    for source in sources() {
        for (word, places) in allowed {
            let free = places.iter().any(|place| source.path.starts_with(place));
            let found: Vec<_> = source.lines.iter().filter(|(_, line)| !free && line.contains(word)).collect();
            assert!(found.is_empty(), "{}: {found:?}", source.path);
        }
    }
}

/// Rooms know each other in one direction: no way along the `use` lines leads back to where it began.
#[test]
fn rooms_do_not_know_each_other_in_a_circle() {
    use std::collections::{BTreeMap, BTreeSet};

    let sources = sources();
    let room = |path: &str| path.split(['/', '.']).next().unwrap().to_owned();
    let rooms: BTreeSet<String> =
        sources.iter().map(|source| room(&source.path)).filter(|name| name != "lib" && name != "main").collect();
    let mut known: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for source in &sources {
        let Some(own) = rooms.get(&room(&source.path)) else { continue };
        for other in rooms.iter().filter(|other| *other != own) {
            if !mentions(source, &format!("crate::{other}")).is_empty() {
                known.entry(own).or_default().insert(other);
            }
        }
    }
    assert!(known["session"].contains("diagnosis"), "{known:#?}");
    // Rooms that know no room that is left can be left out; what then remains is in a circle.
    let mut left: BTreeSet<&str> = rooms.iter().map(String::as_str).collect();
    loop {
        let free: Vec<&str> =
            left.iter().copied().filter(|room| known.get(room).is_none_or(|known| known.is_disjoint(&left))).collect();
        if free.is_empty() {
            break;
        }
        free.iter().for_each(|room| assert!(left.remove(room)));
    }
    let circle: BTreeMap<&str, Vec<&str>> =
        left.iter().map(|room| (*room, known[room].intersection(&left).copied().collect())).collect();
    assert!(circle.is_empty(), "{circle:#?}");
}
