//! `kincal challenge`: cases that tell nothing but what was measured, and a score that cannot be had by altering them.

use std::fs;
use std::path::Path;

use kincal::effects::Kind;
use kincal::lab::challenge::verdict::oracle;
use kincal::lab::challenge::{Folder, Options, case};
use kincal::lab::reproduce::arms::arm8;
use kincal::simulation::effect::Effect;
use serde_json::Value;

use crate::harness::{Ran, kincal, messages, names, number};

const SEED: &str = "7391284650193847";

fn new(out: &Path, more: &[&str]) -> Ran {
    kincal(out, &[&["challenge", "new", "--seed", SEED], more].concat())
}

fn score(folder: &Path, more: &[&str]) -> Ran {
    kincal(folder, &[&["challenge", "score", folder.to_str().unwrap()], more].concat())
}

fn options() -> Options {
    Options {
        cases: 4,
        kinds: vec!["backlash".to_owned(), "radial_clearance".to_owned(), "tool_step".to_owned()],
        effects: [1, 1],
        base_rate: None,
        noise_m: vec![20e-6, 50e-6],
        heavy_tails: 0.0,
        understated: 0.0,
        poses: 24,
        repeats: 4,
        withheld: Vec::new(),
        outside: 0,
        soft: false,
        direct: false,
    }
}

#[test]
fn the_same_seed_makes_the_same_challenge() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b, c] = ["a", "b", "c"].map(|name| folder.path().join(name));
    let arguments = ["--cases", "5", "--poses", "24", "--json"];
    let first = new(&a, &arguments).ends(0).json();
    let again = new(&b, &[&arguments[..], &["--threads", "1"]].concat()).ends(0).json();
    assert_eq!(first["commitment"], again["commitment"]);
    assert_eq!(first["commitment"].as_str().unwrap(), fs::read_to_string(a.join("commitment.txt")).unwrap().trim());
    assert_eq!(names(&a).len(), 8);
    for name in names(&a) {
        assert!(fs::read(a.join(&name)).unwrap() == fs::read(b.join(&name)).unwrap(), "{name}");
    }
    let other = kincal(&c, &[&["challenge", "new", "--seed", "7391284650193848"], &arguments[..]].concat()).ends(0).json();
    assert_ne!(first["commitment"], other["commitment"]);
    // A challenge is never overwritten.
    assert!(new(&a, &arguments).ends(2).stderr.contains("holds a challenge already"));
}

/// What of a case is not a reading of the sensors.
fn public_part(path: &Path) -> Vec<(String, Value)> {
    let parts = messages(path).into_iter().map(|(topic, bytes)| {
        let mut value: Value = serde_json::from_slice(&bytes).unwrap();
        if topic == "/measurement" {
            for reading in ["position_m", "attitude_xyzw", "temperatures_c", "ambient_c"] {
                value.as_object_mut().unwrap().remove(reading);
            }
        }
        (topic, value)
    });
    parts.collect()
}

#[test]
fn nothing_of_a_case_but_the_readings_depends_on_the_truth() {
    let folder = tempfile::tempdir().unwrap();
    let [with, without] = ["with", "without"].map(|name| folder.path().join(name));
    new(&with, &["--cases", "6", "--poses", "24", "--effects", "2..3", "--kinds", "all"]).ends(0);
    new(&without, &["--cases", "6", "--poses", "24", "--effects", "0", "--heavy-tails", "0.5", "--understated", "0.5"]).ends(0);
    for index in 1..=6 {
        let name = format!("case-{index:04}.mcap");
        let [a, b] = [&with, &without].map(|folder| public_part(&folder.join(&name)));
        assert_eq!(a.len(), 1 + a.iter().filter(|(topic, _)| topic == "/measurement").count());
        assert!(a == b, "{name}");
        assert_ne!(fs::read(with.join(&name)).unwrap(), fs::read(without.join(&name)).unwrap());
    }
}

#[test]
fn the_same_poses_from_two_truths_are_the_same_file() {
    let folder = tempfile::tempdir().unwrap();
    let (base, options, key) = (arm8().unwrap(), options(), case::key(5));
    for index in 0..options.cases {
        let public = case::public(&base, &options, &key, index).unwrap();
        let one = case::hidden(&public, &options, &key, index);
        // Another truth in words, the same in deed: an effect more, which none of the readings has.
        let mut other = case::hidden(&public, &options, &key, index);
        other.injected.effects.push(Effect::MeasurementOutliers { share: 0.0, factor: 9.0 });
        other.kinds.push(Kind::MeasurementOutliers);
        other.noise.factor = 7.0;
        let [a, b] = [&one, &other].map(|hidden| case::measured(&public, hidden, index).unwrap());
        assert_eq!((a.1.effects.len(), b.1.effects.len()), (1, 2));
        let [a, b] = [("a", a.0), ("b", b.0)].map(|(name, measured)| {
            fs::read(case::write(&folder.path().join(name), index, &public, &measured).unwrap()).unwrap()
        });
        assert!(a == b, "case {index}");
    }
}

#[test]
fn no_word_and_no_number_of_the_truth_is_in_the_folder() {
    let folder = tempfile::tempdir().unwrap();
    new(folder.path(), &["--cases", "6", "--poses", "24", "--effects", "1..2", "--kinds", "all"]).ends(0);
    let sealed = Folder::open(folder.path()).unwrap().unseal().unwrap();
    let mut hidden: Vec<Vec<u8>> =
        ["injected", "lambda", "true_value", "effects", SEED, &sealed.salt].map(|word| word.as_bytes().to_vec()).into();
    for truth in &sealed.cases {
        hidden.push(truth.key.clone().into_bytes());
        hidden.extend(truth.effects.iter().map(|effect| effect.kind.clone().into_bytes()));
        let numbers = truth.parameters.iter().map(|(_, value)| *value).chain(truth.effects.iter().map(|effect| effect.magnitude));
        for number in numbers {
            hidden.push(number.to_string().into_bytes());
            hidden.push(number.to_le_bytes().to_vec());
        }
    }
    let mut haystacks: Vec<(String, Vec<u8>)> = Vec::new();
    for name in names(folder.path()) {
        let path = folder.path().join(&name);
        if name.ends_with(".mcap") {
            haystacks.extend(messages(&path));
        }
        haystacks.push((name, fs::read(path).unwrap()));
    }
    for (place, bytes) in &haystacks {
        for needle in &hidden {
            let found = bytes.windows(needle.len()).any(|window| window == needle.as_slice());
            assert!(!found, "{} is in {place}", needle.escape_ascii());
        }
    }
}

#[test]
fn what_is_missing_or_altered_is_told() {
    let folder = tempfile::tempdir().unwrap();
    new(folder.path(), &["--cases", "3", "--poses", "24"]).ends(0);
    let refused = |name: &str, says: &str| {
        let ran = score(folder.path(), &[]).ends(2);
        assert!(ran.stderr.contains(name) && ran.stderr.contains(says), "{}", ran.stderr);
        assert!(!folder.path().join("score.json").exists() && !folder.path().join("verdicts").exists());
    };
    for (name, missing, altered) in [
        ("case-0002.mcap", "copy it again", "checksum"),
        ("sealed.truth", "copy it again", "checksum"),
        ("commitment.txt", "copy it again", "not that of the manifest"),
        ("manifest.json", "kincal challenge new", "copy it again"),
    ] {
        let path = folder.path().join(name);
        let bytes = fs::read(&path).unwrap();
        fs::remove_file(&path).unwrap();
        refused(name, missing);
        let mut changed = bytes.clone();
        let middle = changed.len() / 3;
        changed[middle] ^= 1;
        fs::write(&path, &changed).unwrap();
        if name != "manifest.json" {
            refused(name, altered);
        } else {
            // Whatever of it is changed, something no longer fits.
            score(folder.path(), &[]).ends(2);
        }
        fs::write(&path, &bytes).unwrap();
    }
    // Another truth with checksums that fit it is not what was committed to.
    let text = fs::read_to_string(folder.path().join("manifest.json")).unwrap();
    let manifest: Value = serde_json::from_str(&text).unwrap();
    let commitment = manifest["commitment"].as_str().unwrap();
    let forged = commitment.replace(|digit: char| digit == commitment.chars().next().unwrap(), "z");
    fs::write(folder.path().join("manifest.json"), text.replace(commitment, &forged)).unwrap();
    fs::write(folder.path().join("commitment.txt"), &forged).unwrap();
    let ran = score(folder.path(), &[]).ends(2);
    assert!(ran.stderr.contains("committed to was"), "{}", ran.stderr);
}

#[test]
fn the_scorer_can_fail_and_can_succeed() {
    let folder = tempfile::tempdir().unwrap();
    let cases = folder.path().join("cases");
    new(&cases, &["--cases", "30", "--poses", "24", "--effects", "0..2", "--kinds", "all", "--withheld", "tool_step"]).ends(0);
    let baseline = score(&cases, &["--baseline", "none", "--json"]).ends(0).json();
    assert_eq!(names(&cases.join("verdicts")).len(), 30);
    let score_of = |json: &Value, pointer: &str| number(&json["score"], pointer);
    let single = score_of(&baseline, "/single/5/cases");
    assert!(
        single > 0.0 && score_of(&baseline, "/single/5/right") == 0.0 && score_of(&baseline, "/single/5/abstained") == single
    );
    assert_eq!(score_of(&baseline, "/several/found"), 0.0);
    assert_eq!(score_of(&baseline, "/foreign/2/flagged"), 0.0);
    assert_eq!(score_of(&baseline, "/effect_free/3/named"), 0.0);

    let truth = Folder::open(&cases).unwrap().unseal().unwrap();
    let verdicts = folder.path().join("oracle");
    fs::create_dir(&verdicts).unwrap();
    for case in &truth.cases {
        let path = verdicts.join(case.file.replace(".mcap", ".json"));
        fs::write(path, serde_json::to_string(&oracle(case, &["tool_step".to_owned()])).unwrap()).unwrap();
    }
    let perfect = score(&cases, &["--verdicts", verdicts.to_str().unwrap(), "--json"]).ends(0).json();
    assert_eq!(score_of(&perfect, "/single/5/right_place"), single);
    assert_eq!(score_of(&perfect, "/several/exact"), score_of(&perfect, "/several/cases"));
    assert_eq!(score_of(&perfect, "/foreign/2/flagged"), score_of(&perfect, "/foreign/2/cases"));
    assert!(score_of(&perfect, "/foreign/2/cases") > 0.0);
    assert_eq!(score_of(&perfect, "/calibration/ece"), 0.0);
    let cases_of = |pointer: &str| score_of(&perfect, pointer);
    let all = cases_of("/single/5/cases")
        + cases_of("/several/cases")
        + cases_of("/effect_free/3/cases")
        + cases_of("/foreign/2/cases");
    assert_eq!(all, 30.0);

    fs::remove_file(verdicts.join("case-0007.json")).unwrap();
    let ran = score(&cases, &["--verdicts", verdicts.to_str().unwrap()]).ends(2);
    assert!(ran.stderr.contains("case-0007.json"), "{}", ran.stderr);
}

#[test]
fn what_was_withheld_closes_the_gap_once_it_is_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let arguments = ["--cases", "3", "--poses", "40", "--noise", "20", "--effects", "1", "--kinds", "backlash"];
    new(path, &[&arguments[..], &["--withheld", "backlash"]].concat()).ends(0);
    let first = score(path, &["--json"]).ends(0).json();
    let again = score(path, &["--json", "--threads", "1"]).ends(0).json();
    assert_eq!(first["score"], again["score"]);
    let said = |folder: &str, case: &str| -> Value {
        serde_json::from_str(&fs::read_to_string(path.join(folder).join(case)).unwrap()).unwrap()
    };
    let names_backlash = |folder: &str| {
        let named = |case: &&String| said(folder, case)["effects"].as_array().unwrap().iter().any(|it| it["kind"] == "backlash");
        names(&path.join(folder)).iter().filter(named).count()
    };
    assert_eq!((names_backlash("verdicts"), names(&path.join("restored")).len()), (0, 3));
    let rows = first["score"]["restored"].as_array().unwrap();
    let row = |kind: &str, lambda: &str| rows.iter().find(|row| row["kind"] == kind && row["lambda"] == lambda).unwrap();
    let all = row("any", "all");
    assert_eq!(all, &{
        let mut same = row("backlash", "all").clone();
        same["kind"] = "any".into();
        same
    });
    assert_eq!(number(all, "/cases"), 3.0);
    assert!(number(all, "/right") >= 2.0 && number(all, "/right") <= names_backlash("restored") as f64, "{all}");
    assert!(number(all, "/closure/median") > 0.9, "{all}");
    let rms = ["geometry", "withheld", "restored", "noise"].map(|name| number(all, &format!("/{name}_rms_m")));
    assert!(rms[2] < rms[0] && rms[2] < rms[1] && rms[3] > 0.0, "{rms:?}");
    assert_eq!(number(row("not there", "all"), "/cases"), 0.0);
    // Of somebody else's diagnosis that cannot be asked.
    let baseline = score(path, &["--baseline", "none", "--json"]).ends(0).json();
    assert!(baseline["score"]["restored"].is_null());
}

#[test]
fn a_case_is_a_recording_like_any_other() {
    let folder = tempfile::tempdir().unwrap();
    new(folder.path(), &["--cases", "1", "--effects", "0"]).ends(0);
    let path = folder.path().join("case-0001.mcap");
    let json = kincal(folder.path(), &["identify", path.to_str().unwrap(), "--json"]).code;
    // Converged; nothing is held out, so that nothing can be said to be worse.
    assert_eq!(json, Some(0));
}

#[test]
fn what_cannot_be_drawn_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (more, says) in [
        (&["--kinds", "rust"][..], "--kinds rust: no such kind"),
        (&["--withheld", "wrong_payload"], "--withheld wrong_payload"),
        (&["--effects", "3..1"], "--effects 3..1"),
        (&["--noise", "0"], "--noise 0"),
        (&["--base-rate", "1.5"], "--base-rate 1.5"),
        (&["--heavy-tails", "0.7", "--understated", "0.7"], "together 1 at most"),
        (&["--poses", "20", "--repeats", "15"], "half at most"),
        (&["--poses", "3"], "design.count"),
    ] {
        let ran = new(folder.path(), &[&["--cases", "2"], more].concat()).ends(2);
        assert!(ran.stderr.contains(says), "{}", ran.stderr);
        assert!(names(folder.path()).is_empty());
    }
    let ran = kincal(folder.path(), &["challenge", "new", "--cases", "2"]).ends(2);
    assert!(ran.stderr.contains("needs a seed"), "{}", ran.stderr);
    let ran = kincal(folder.path(), &["challenge", "score", "nowhere"]).ends(2);
    assert!(ran.stderr.contains("nowhere/manifest.json"), "{}", ran.stderr);
}

#[test]
fn stated_magnitudes_are_checked_the_same_way_every_time() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
    let arguments = ["challenge", "power", "--kinds", "backlash:3", "--poses", "30", "--sets", "2", "--trials", "4"];
    let arguments = [&arguments[..], &["--levels", "4,0.2", "--json"]].concat();
    let first = kincal(&a, &arguments).ends(0).json();
    let again = kincal(&b, &[&arguments[..], &["--threads", "1"]].concat()).ends(0).json();
    assert_eq!(first["power"], again["power"]);
    assert_eq!(names(&a), ["power.json", "power.png", "power.svg"]);
    let curve = &first["power"]["curves"][0];
    let levels = curve["levels"].as_array().unwrap();
    let named: Vec<f64> = levels.iter().map(|level| number(level, "/named")).collect();
    assert_eq!(named, [0.0, 4.0]);
    assert!((number(&levels[1], "/magnitude") / number(curve, "/stated") - 4.0).abs() < 1e-9);
    for (wrong, says) in [
        (["--kinds", "gremlins"], "no such kind"),
        (["--kinds", "backlash:9"], "can be at"),
        (["--trials", "0"], "--trials 0"),
        (["--sets", "0"], "--sets 0"),
        (["--levels", "1"], "--levels"),
        (["--noise", "-1"], "--noise -1"),
        (["--poses", "3"], "--poses 3"),
    ] {
        let ran = kincal(&a, &[&["challenge", "power"], &wrong[..]].concat());
        assert!(ran.ends(2).stderr.contains(says), "{wrong:?}");
    }
}
