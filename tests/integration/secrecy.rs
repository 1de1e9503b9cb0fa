//! Nothing hidden is in a recording.

use std::fs;

use crate::harness::{messages, quick_run, without_topic};

/// The messages before the first measurement: all that is known before the physics has spoken.
fn before_measuring(run: &crate::harness::Run) -> Vec<(String, Vec<u8>)> {
    let messages = messages(&run.path("arm8.mcap"));
    let first = messages.iter().position(|(topic, _)| topic == "/measurement").unwrap();
    assert!(first > 10);
    messages[..first].to_vec()
}

#[test]
fn what_is_injected_shows_in_the_measurements_only() {
    let run = quick_run(&[]);
    let usual = before_measuring(&run);
    for set in [
        "injected.seed=732",
        "injected.parameters.length_mm=0.5",
        "injected.parameters.errors={a2_mm=0.25}",
        "injected.effect=[]",
        "injected.effect=[{kind=\"backlash\",joint=\"joint3\",width_arcsec=60}]",
        "injected.noise={kind=\"off\"}",
        "injected.effect[4].expansion_um_per_m_per_k=5",
    ] {
        let other = quick_run(&["--set", set]);
        assert!(before_measuring(&other) == usual, "{set} shows before anything is measured");
        assert_ne!(fs::read(run.path("arm8.mcap")).unwrap(), fs::read(other.path("arm8.mcap")).unwrap(), "{set} does nothing");
    }
}

#[test]
fn no_word_and_no_number_of_the_truth_is_in_the_recording() {
    let run = quick_run(&["--set", "injected.seed=7305550123456789"]);
    let truth: toml::Table = toml::from_str(&fs::read_to_string(run.path("arm8.truth.toml")).unwrap()).unwrap();
    assert_eq!(truth["injected"]["seed"].as_str(), Some("7305550123456789"));
    let mut hidden: Vec<Vec<u8>> =
        ["7305550123456789", "injected", "true_value", "expansion"].map(|word| word.as_bytes().to_vec()).into();
    hidden.push(7_305_550_123_456_789u64.to_le_bytes().to_vec());
    let mut number = |value: f64| {
        hidden.push(value.to_string().into_bytes());
        hidden.push(value.to_le_bytes().to_vec());
    };
    for parameter in truth["parameters"].as_array().unwrap() {
        let [nominal, value] = ["nominal", "true_value"].map(|key| parameter[key].as_float().unwrap());
        assert_ne!(nominal, value);
        number(value);
    }
    for pose in truth["poses"].as_array().unwrap() {
        pose["position_m"].as_array().unwrap().iter().for_each(|value| number(value.as_float().unwrap()));
        pose["attitude_xyzw"].as_array().unwrap().iter().for_each(|value| number(value.as_float().unwrap()));
    }
    // The file itself (metadata, header, schemas) and everything that is compressed in it.
    let mut haystacks = vec![("the file".to_owned(), fs::read(run.path("arm8.mcap")).unwrap())];
    haystacks.extend(messages(&run.path("arm8.mcap")));
    for (place, bytes) in &haystacks {
        for needle in &hidden {
            let found = bytes.windows(needle.len()).any(|window| window == needle.as_slice());
            assert!(!found, "{} is in {place}", needle.escape_ascii());
        }
    }
    // Kinds of effects have names in the diagnosis too, which are what it makes of the readings. Nowhere else.
    let bare = run.path("bare.mcap");
    assert_eq!(without_topic(&run.path("arm8.mcap"), &bare, "/diagnosis"), 1);
    haystacks.retain(|(place, _)| place != "/diagnosis" && place != "the file");
    haystacks.push(("the file without its diagnosis".to_owned(), fs::read(&bare).unwrap()));
    for (place, bytes) in &haystacks {
        for word in ["clearance", "radial"] {
            assert!(!bytes.windows(word.len()).any(|window| window == word.as_bytes()), "{word} is in {place}");
        }
    }
    println!("{} hidden words and numbers are in none of {} messages", hidden.len(), haystacks.len() - 1);
}
