//! `kincal reproduce`: the experiments of the paper, and what they leave on the disk.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::harness::{kincal, names, number};

const ITEMS: [&str; 7] = ["globality", "quality", "count-index", "count-error", "optimise", "sets", "headline"];

/// The paper's scene with a swarm so small that every search is short.
fn small(folder: &Path) -> String {
    let text = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/paper.toml")).unwrap();
    let small = text.replace("particles = 20", "particles = 5").replace("iterations = 200", "iterations = 7");
    assert_ne!(text, small);
    let path = folder.join("small.toml");
    fs::write(&path, small.replace("name = \"paper\"", "name = \"small\"").replace("count = 40", "count = 12")).unwrap();
    path.to_str().unwrap().to_owned()
}

/// The claim of an item whose text begins so.
#[track_caller]
fn claim<'v>(findings: &'v Value, item: &str, what: &str) -> &'v Value {
    let of = findings.as_array().unwrap().iter().find(|findings| findings["item"] == item).unwrap();
    let claims = of["claims"].as_array().unwrap();
    claims.iter().find(|claim| claim["what"].as_str().unwrap().trim().starts_with(what)).unwrap_or_else(|| panic!("{what}"))
}

#[test]
fn every_item_sets_its_numbers_beside_the_paper_s() {
    let folder = tempfile::tempdir().unwrap();
    let scene = small(folder.path());
    let json = kincal(folder.path(), &["reproduce", "--arm", &scene, "--trials", "2", "--json", "--quiet"]).ends(0).json();
    assert!(json["arms"][0]["note"].as_str().unwrap().contains("not the paper's arm"));
    assert_eq!(json["not_converged"], 0);
    let findings = &json["findings"];
    let items: Vec<&str> = findings.as_array().unwrap().iter().map(|findings| findings["item"].as_str().unwrap()).collect();
    assert_eq!(items, ITEMS);
    for findings in findings.as_array().unwrap() {
        assert!(findings["verdict"].as_str().unwrap().len() > 50 && findings["arm"] == "paper8r");
        for claim in findings["claims"].as_array().unwrap() {
            assert!(claim["ours"]["mean"].as_f64().is_some_and(f64::is_finite), "{claim}");
        }
    }
    let value = |item: &str, what: &str, pointer: &str| number(claim(findings, item, what), pointer);
    // Some of the paper's numbers, each with ours beside it.
    assert_eq!(value("globality", "position error after, A, mean (mm)", "/paper"), 11.41);
    assert_eq!(value("quality", "O_C at ±180°", "/paper"), 1.177);
    assert_eq!(value("count-index", "growth of O_C, m = 8 to 50", "/paper"), 103.21);
    assert_eq!(value("count-error", "position error, m = 60", "/paper"), 0.6);
    assert_eq!(value("optimise", "O_C of the swarm's optimum", "/paper"), 1.4259);
    assert_eq!(value("headline", "gain in position error, optimal for O_C", "/paper"), 43.86);
    // A and C are as concentrated as the paper's A beside B.
    let dispersion = |set: &str| value("globality", &format!("dispersion D, {set}"), "/ours/mean");
    assert!((dispersion("A") / dispersion("B") - 0.04566 / 0.19232).abs() < 0.1);
    assert!((dispersion("C") / dispersion("A") - 1.0).abs() < 0.3);
    assert!(
        value("count-error", "position error, m = 200", "/ours/mean")
            < value("count-error", "position error, m = 8", "/ours/mean")
    );
    // No search goes beyond the bound.
    let optimise = findings.as_array().unwrap().iter().find(|findings| findings["item"] == "optimise").unwrap();
    let mut bounded = 0;
    for claim in optimise["claims"].as_array().unwrap().iter().filter(|claim| !claim["bound"].is_null()) {
        let (ours, bound) = (number(claim, "/ours/mean"), number(claim, "/bound"));
        let i_optimality = claim["what"].as_str().unwrap().starts_with("I-");
        assert!(if i_optimality { ours >= bound } else { ours <= bound }, "{claim}");
        bounded += 1;
    }
    assert_eq!(bounded, 40);

    // What it says that it wrote is there, and nothing else.
    let written = names(&folder.path().join("reproduce/small"));
    let mut files: Vec<&str> =
        json["files"].as_array().unwrap().iter().map(|file| file.as_str().unwrap().rsplit('/').next().unwrap()).collect();
    files.sort_unstable();
    assert_eq!(written, files);
    for item in ITEMS {
        for extension in ["csv", "svg", "png"] {
            let fits = |name: &&&str| name.starts_with(item) && name.ends_with(&format!(".{extension}"));
            let found: Vec<_> = files.iter().filter(fits).collect();
            assert!(!found.is_empty(), "{item} has no {extension}");
            for name in found {
                assert!(fs::metadata(folder.path().join("reproduce/small").join(name)).unwrap().len() > 100, "{name}");
            }
        }
    }
    let mut table = csv::Reader::from_path(folder.path().join("reproduce/small/count-error.csv")).unwrap();
    assert_eq!(&table.headers().unwrap()[0], "m");
    assert!(table.records().count() >= 14);
}

#[test]
fn the_number_of_threads_changes_no_byte_of_an_experiment() {
    let folders = ["1", "2"].map(|threads| {
        let folder = tempfile::tempdir().unwrap();
        let items = ["globality", "count-error", "sets"];
        let options = ["--arm", "scenes/paper.toml", "--trials", "2", "--threads", threads];
        let ran = kincal(folder.path(), &[&["reproduce"], &items[..], &options[..]].concat()).ends(0);
        assert!(ran.stderr.contains("globality on paper8r: ") && !ran.stdout.contains(" s\n"));
        // The folder's name is in the text.
        (ran.stdout.replace(folder.path().to_str().unwrap(), "OUT"), folder)
    });
    assert_eq!(folders[0].0, folders[1].0);
    assert!(folders[0].0.contains("not the paper's arm") && folders[0].0.contains("what") && folders[0].0.contains("bound"));
    let [one, two] = [0, 1].map(|run: usize| folders[run].1.path().join("reproduce/paper"));
    assert_eq!(names(&one), names(&two));
    assert!(names(&one).len() > 12);
    for name in names(&one) {
        assert!(fs::read(one.join(&name)).unwrap() == fs::read(two.join(&name)).unwrap(), "{name} differs");
    }
}

#[test]
fn what_cannot_be_reproduced_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refuse = |arguments: &[&str], words: &[&str]| {
        let ran = kincal(folder.path(), arguments).ends(2);
        assert!(words.iter().all(|word| ran.stderr.contains(word)), "{}", ran.stderr);
    };
    refuse(&["reproduce", "everything"], &ITEMS);
    refuse(&["reproduce", "sets", "--arm", "missing.toml"], &["missing.toml"]);
    refuse(&["reproduce", "sets", "--arm", "scenes/paper.toml", "--arm", "scenes/paper.toml"], &["two scenes are called paper"]);
    fs::write(folder.path().join("reproduce"), "mine").unwrap();
    refuse(&["reproduce", "sets", "--arm", "scenes/paper.toml"], &["cannot make the folder", "--out"]);
}

/// Spot checks against the paper's text.
#[test]
fn the_published_numbers_are_the_paper_s() {
    let text = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/reference/chen2019.toml")).unwrap();
    let published: toml::Table = toml::from_str(&text).unwrap();
    let at = |path: &str| {
        let value = path.split('.').fold(None, |value: Option<&toml::Value>, key| match value {
            None => published.get(key),
            Some(toml::Value::Array(rows)) => rows.get(key.parse::<usize>().unwrap()),
            Some(value) => value.get(key),
        });
        let value = value.unwrap();
        value.as_float().or_else(|| value.as_integer().map(|value| value as f64)).unwrap()
    };
    for (path, value) in [
        ("globality.b.evenness", 0.38087),
        ("globality.before.position_mm.max", 148.20),
        ("globality.after_a.attitude_deg.min", 0.19),
        ("quality.comprehensive.0", 0.0192),
        ("count_index.growth_percent.2", 27.98),
        ("count_error.row.1.position_mm", 1.20),
        ("optimise.inertia.1", 0.95),
        ("optimise.comprehensive", 1.4259),
        ("sets.sets", 500.0),
        ("headline.attitude_gain_percent", 14.29),
    ] {
        assert_eq!(at(path), value, "{path}");
    }
}
