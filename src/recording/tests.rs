//! Tests of the recording as a whole.

use std::fs;
use std::path::{Path, PathBuf};

use nalgebra::Vector3;
use serde_json::Value;

use super::encode::Encoder;
use super::schema::check;
use super::topic::Topic;
use super::*;
use crate::arm::chain::{Joint, JointKind};
use crate::arm::frames::{Pose, pose_error};
use crate::arm::mdh;
use crate::arm::{Arm, Fixture, Geometry, Link, Shape};
use crate::design::outcome::{Advice, DesignOutcome, EvennessDomains, RandomReference, SearchStep, StopReason, SwarmIteration};
use crate::diagnosis::held_out::Block;
use crate::diagnosis::outcome::{
    self, Blocked, Candidate, Diagnosis, Effect, Gap, LeftOut, Magnitude, Map, MinimumDetectable, NoiseFloor, NoiseSource,
    Parameters, Place, Signature, Undetectable, Unknown, Verdict,
};
use crate::effects::kind::joint_eccentricity::Harmonic;
use crate::effects::signature::shape;
use crate::effects::{Kind, Level};
use crate::event::RealCell;
use crate::event::{Event, Start};
use crate::identification::outcome::{Combination, DeclaredNoise, Errors, Identification, ParameterEstimate, Residual, Summary};
use crate::measurement::{Measurement, Role};
use crate::progress::Progress as _;
use crate::quality::Indexes;
use crate::quality::prediction::Prediction;
use crate::seed::{Stream, stream};

const JOINTS: usize = 6;

/// Sizes of a synthetic run.
struct Size {
    iterations: usize,
    particles: usize,
    configurations: usize,
    measurements: usize,
}

const SMALL: Size = Size { iterations: 23, particles: 7, configurations: 5, measurements: 20 };

fn arm() -> Arm {
    let mut stream = stream(7, "test/recording/arm");
    let frames: Vec<mdh::Frame> = (0..=JOINTS)
        .map(|_| mdh::Frame {
            alpha: stream.uniform(-1.6, 1.6),
            a: stream.uniform(0.0, 0.4),
            theta: stream.uniform(-1.0, 1.0),
            d: stream.uniform(0.0, 0.3),
            beta: 0.0,
        })
        .collect();
    let joints = (1..=JOINTS)
        .map(|joint| Joint { name: format!("joint{joint}"), kind: JointKind::Revolute, lower: -3.0, upper: 3.0, mimic: None })
        .collect();
    let shape = |geometry| Shape { link_from_shape: Pose::translation(0.1, 0.0, 0.05), geometry };
    let link = |name: String, geometry| Link { name, inertial: None, shapes: vec![shape(geometry)] };
    let mut links = vec![link("base_link".to_owned(), Geometry::Cylinder { half_length: 0.1, radius: 0.08 })];
    links.extend((1..=JOINTS).map(|number| {
        let capsule = Geometry::Capsule { half_length: 0.12, radius: 0.04 };
        link(format!("link{number}"), if number == JOINTS { Geometry::Sphere { radius: 0.05 } } else { capsule })
    }));
    let floor =
        Fixture { name: "floor".to_owned(), shape: shape(Geometry::Box { half_extents: [1.0, 1.0, 0.01] }), may_touch: vec![0] };
    Arm {
        name: "synthetic".to_owned(),
        chain: mdh::chain(&frames, joints, None, None),
        links,
        fixtures: vec![floor],
        uncollidable: Vec::new(),
        gravity_in_base: Vector3::new(0.0, 0.0, -9.81),
    }
}

fn indexes(stream: &mut Stream) -> Indexes {
    Indexes {
        o1: stream.uniform(0.0, 1.0),
        o2: stream.uniform(0.0, 1e-3),
        o3: stream.uniform(0.0, 1e-9),
        o4: stream.uniform(0.0, 1e-200),
        o5: stream.uniform(0.0, 1e9),
        o6: -0.0,
        dispersion_m2: f64::MIN_POSITIVE / 3.0,
        evenness: 0.1 + 0.2,
        comprehensive: stream.uniform(0.0, 1.0),
        rank: 27,
    }
}

fn configurations(stream: &mut Stream, count: usize) -> Vec<Vec<f64>> {
    (0..count).map(|_| (0..JOINTS).map(|_| stream.uniform(-3.0, 3.0)).collect()).collect()
}

/// A run as a `kincal run` makes it, with numbers that look like those of one.
fn events(size: &Size) -> Vec<Event> {
    let mut stream = stream(11, "test/recording/events");
    let chain = arm().chain.at_nominal();
    let mut events = vec![
        Event::Start(Start {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            command: "run".to_owned(),
            scene: "name = \"synthetic\"\nseed = 11 # ünïcode, \"quotes\"\n".to_owned(),
            poses: Some(19),
            real: Some(RealCell {
                known: Vec::new(),
                notes: Vec::new(),
                only: None,
                zeros: Vec::new(),
                distances: Vec::new(),
                urdf: Some("<robot/>".to_owned()),
                base_link: Some("base_link".to_owned()),
                tip_link: Some("tool".to_owned()),
                noise_assumed: true,
                position_sigma_m: 2e-5,
                orientation_sigma_rad: 1.0 / 3e4,
            }),
        }),
        Event::Note("a note".to_owned()),
    ];
    for iteration in 0..=size.iterations {
        let end_points = (0..size.particles)
            .map(|_| {
                let set = configurations(&mut stream, size.configurations);
                set.iter().map(|joints| chain.forward(joints).translation.vector.cast::<f32>().into()).collect()
            })
            .collect();
        events.push(Event::Swarm(SwarmIteration {
            iteration,
            iterations: size.iterations,
            fitness: (0..size.particles).map(|_| stream.uniform(0.0, 2.0)).collect(),
            personal_best: (0..size.particles).map(|_| stream.uniform(0.0, 2.0)).collect(),
            best_particle: iteration % size.particles,
            best: indexes(&mut stream),
            inertia: if iteration == 0 { 0.0 } else { stream.uniform(0.4, 0.9) },
            c1: stream.uniform(0.0, 2.0),
            c2: stream.uniform(0.0, 2.0),
            evaluations: (iteration * size.particles) as u64,
            rejections: u64::MAX - iteration as u64,
            end_points,
            best_configurations: if iteration % 3 == 0 { configurations(&mut stream, size.configurations) } else { Vec::new() },
        }));
    }
    events.push(Event::Designed(DesignOutcome {
        method: "pso".to_owned(),
        criterion: "comprehensive".to_owned(),
        value: stream.uniform(0.0, 1.0),
        advice: None,
        no_advice: None,
        configurations: configurations(&mut stream, size.configurations),
        indexes: indexes(&mut stream),
        indexes_all_parameters: indexes(&mut stream),
        evenness_domains: EvennessDomains { reachable: stream.uniform(0.0, 1.0), bounding_cube: stream.uniform(0.0, 1.0) },
        random: RandomReference { sets: 100, mean: indexes(&mut stream), min: indexes(&mut stream), max: indexes(&mut stream) },
        dropped_parameters: vec!["alpha1".to_owned(), "d2".to_owned()],
        evaluations: 1234,
        rejections: 56,
        stop: StopReason::IterationLimit,
    }));
    for (index, joints) in configurations(&mut stream, size.measurements).into_iter().enumerate() {
        let pose = chain.forward(&joints);
        events.push(Event::Measured(Measurement {
            angles_rad: None,
            fixed_point: None,
            plane: None,
            gravity_m_s2: Some([0.0, 0.0, -9.81]),
            index,
            pose_id: index,
            role: if index % 4 == 3 { Role::HeldOut } else { Role::Fit },
            time_s: 12.5 * index as f64,
            joints,
            temperatures_c: if index % 2 == 0 { vec![22.0, 22.5] } else { Vec::new() },
            position_m: (pose.translation.vector.map(|value| value + stream.uniform(-1e-3, 1e-3))).into(),
            unread: [false, false, index % 4 == 3],
            orientation_xyzw: (index % 3 != 0).then(|| pose.rotation.coords.into()),
            // The last one as earlier versions recorded it.
            approach: if index + 1 < size.measurements { vec![-1, 0, 1] } else { Vec::new() },
            ambient_c: (index % 2 == 0).then_some(21.5),
            payload_kg: (index + 1 < size.measurements).then_some(2.5),
            dwell_s: (index % 2 == 0).then_some(1.5),
            session: (index % 2 == 0).then(|| "morning".to_owned()),
            target: (index % 3 == 0).then(|| "smr 1".to_owned()),
        }));
    }
    events.push(Event::Diagnosed(Box::new(diagnosis(&mut stream, size.measurements))));
    events.push(Event::Note("fitting".to_owned()));
    let summary = |stream: &mut Stream| Summary { min: 0.0, mean: stream.uniform(0.0, 1e-3), rms: 1e-3, max: 2e-3 };
    let errors = |stream: &mut Stream, rotation: bool| Errors {
        count: size.measurements,
        position_m: summary(stream),
        rotation_rad: rotation.then(|| summary(stream)),
    };
    let parameters = arm().chain.parameters;
    events.push(Event::Identified(Identification {
        joint_frames: Vec::new(),
        left_out: Vec::new(),
        ladder: Vec::new(),
        converged: true,
        reason: "the step is small".to_owned(),
        iterations: 4,
        rank: 27,
        equations: 120,
        residual_scale: Some(stream.uniform(0.8, 1.2)),
        parameters: parameters
            .iter()
            .enumerate()
            .map(|(number, parameter)| ParameterEstimate {
                name: parameter.name.clone(),
                nominal: parameter.nominal,
                identified: parameter.nominal + stream.uniform(-1e-3, 1e-3),
                standard_error: (number % 4 != 0).then(|| stream.uniform(0.0, 1e-4)),
                unit: parameter.quantity.unit().to_owned(),
                dropped: number % 4 == 0,
            })
            .collect(),
        combinations: vec![Combination {
            name: "a2".to_owned(),
            expression: "a2 + 0.5 · d1".to_owned(),
            estimate: stream.uniform(-1e-3, 1e-3),
            standard_error: stream.uniform(0.0, 1e-5),
            interval95: [-1e-3, 1e-3],
            unit: "m".to_owned(),
        }],
        nominal: errors(&mut stream, true),
        fitted: errors(&mut stream, false),
        held_out: Some(errors(&mut stream, true)),
        held_out_nominal: None,
        declared_noise: DeclaredNoise { position_m: 5e-5, rotation_rad: None },
        noise_estimated: true,
        residuals: (0..size.measurements)
            .map(|index| Residual {
                index,
                position_m: [0, 1, 2].map(|_| stream.uniform(-1.0, 1.0)),
                nominal: [0; 6].map(|_| stream.uniform(-1e-3, 1e-3)),
                identified: [0; 6].map(|_| stream.uniform(-1e-5, 1e-5)),
            })
            .collect(),
        notes: vec!["weights: declared noise".to_owned()],
    }));
    events
}

/// A diagnosis with something in every part, and with everything absent that may be.
fn diagnosis(stream: &mut Stream, readings: usize) -> Diagnosis {
    let place = |index, time_s| Place { time_s, row: time_s.map(|_| 7), ..Place::of(Level::Joint, index) };
    let effect = |stream: &mut Stream, parameters| Effect {
        kind: Kind::Backlash,
        location: place(Some(3), None),
        probability: stream.uniform(0.0, 1.0),
        magnitude: Magnitude {
            value: stream.uniform(0.0, 1e-3),
            unit: "rad".to_owned(),
            ci95: [-0.0, stream.uniform(0.0, 1e-3)],
        },
        parameters,
        signature: Some(Signature {
            shape: shape::Shape::Harmonic(Harmonic { joint: 2, order: 2.0 }),
            coefficients: vec![stream.uniform(0.0, 1e-3), -0.0],
        }),
        held_out_rms_before_m: stream.uniform(0.0, 1e-3),
        held_out_rms_after_m: stream.uniform(0.0, 1e-3),
        gap_closed: Some(stream.uniform(0.0, 1.0)),
        folds: [4, 5],
        detail: String::new(),
    };
    let all = Parameters {
        time_constant_s: Some(60.0),
        angles_rad: Some(vec![0.0, 0.1]),
        errors_rad: Some(vec![1e-4, -2e-4]),
        sigmas_rad: Some(vec![1e-5, 2e-5]),
        sign: Some(-1.0),
        phase_rad: Some(stream.uniform(-1.0, 1.0)),
        order: Some(2.0),
        source: Some(2),
        translation_m: Some([1e-6, -0.0, 3e-6]),
        rotation_rad: Some([0.0; 3]),
        after: Some(0.5),
        row: Some(7),
        factor: Some(3.0),
        held: Some(0.1),
    };
    let none = Effect { gap_closed: None, signature: None, ..effect(stream, Parameters::default()) };
    let candidate = |stream: &mut Stream, index| Candidate {
        kind: None,
        location: place(index, Some(12.5)),
        probability: stream.uniform(0.0, 1.0),
        detail: "a bump".to_owned(),
    };
    let sets = [[Some(1), None], [Some(2), Some(4)]].map(|set| set.map(|index| candidate(stream, index)).to_vec());
    let least = |value, reason: &str| Undetectable {
        kind: Kind::BaseDrift,
        location: Place::of(Level::Base, None),
        minimum_detectable: MinimumDetectable { value, unit: "m".to_owned() },
        reason: reason.to_owned(),
    };
    Diagnosis {
        settings: Default::default(),
        gravity_m_s2: None,
        verdict: Verdict::Ambiguous,
        sentence: "Something is there.".to_owned(),
        noise_floor: NoiseFloor { position_m: 1e-5 / 3.0, rotation_rad: None, source: NoiseSource::Declared },
        gap: Gap {
            nominal_rms_m: stream.uniform(0.0, 1e-3),
            geometry_rms_m: stream.uniform(0.0, 1e-4),
            explained_rms_m: stream.uniform(0.0, 1e-5),
            noise_rms_m: 1e-5,
            gap_closed: Some(0.75),
            gap_closed_ci95: Some([0.5, 0.9]),
            folds: 5,
            blocked: vec![Blocked {
                by: Block::Payload,
                folds: 2,
                nominal_rms_m: 1e-3,
                geometry_rms_m: 1e-4,
                explained_rms_m: 1e-5,
                left_out: vec![LeftOut {
                    name: "4 kg".to_owned(),
                    readings: 30,
                    geometry_rms_m: 1e-4,
                    explained_rms_m: stream.uniform(0.0, 1e-5),
                }],
            }],
        },
        effects: vec![effect(stream, all), none],
        confusion_sets: sets.to_vec(),
        undetectable: vec![least(None, "no payload")],
        detectable: vec![least(Some(stream.uniform(0.0, 1e-3)), "")],
        unknown: Unknown { present: true, p_value: 1e-300, r#where: Some("joint 2".to_owned()) },
        maps: vec![Map { joint: 1, angle: vec![-0.5, 0.5], mean: vec![-0.0, 1e-6], standard_error: vec![1e-6; 2] }],
        next_measurements: vec!["more".to_owned()],
        notes: vec!["a note".to_owned()],
        readings,
        residuals: (0..readings)
            .map(|row| outcome::Residual {
                row,
                position_m: [0, 1, 2].map(|_| stream.uniform(-1.0, 1.0)),
                before_m: [0, 1, 2].map(|_| stream.uniform(-1e-4, 1e-4)),
                after_m: [0, 1, 2].map(|_| stream.uniform(-1e-5, 1e-5)),
                cause: [Some(0), Some(1), None][row % 3],
            })
            .collect(),
    }
}

/// The same run with a search of `steps` steps in place of the swarm, and advice.
fn searched(size: &Size, steps: usize) -> Vec<Event> {
    let mut stream = stream(13, "test/recording/search");
    let mut search: Vec<Event> = (0..steps)
        .map(|step| {
            Event::Search(SearchStep {
                step,
                evaluations: 17 * step as u64 + 1,
                budget: 20_000,
                rejections: step as u64,
                // As hopeless as a set can be at first.
                value: if step == 0 { f64::MIN } else { stream.uniform(10.0, 20.0) },
                best: if step == 0 { f64::MIN } else { stream.uniform(20.0, 21.0) },
                best_configurations: if step % 4 == 0 { configurations(&mut stream, size.configurations) } else { Vec::new() },
            })
        })
        .collect();
    let mut rest = events(size);
    rest.retain(|event| !matches!(event, Event::Swarm(_)));
    for event in &mut rest {
        if let Event::Designed(outcome) = event {
            outcome.method = "coordinate_exchange".to_owned();
            outcome.criterion = "i_optimality".to_owned();
            outcome.stop = StopReason::BudgetSpent;
            let prediction = |scale: f64| Prediction {
                position_rms_m: 1e-5 * scale / 3.0,
                orientation_rms_rad: 1e-5 / 7.0,
                position_worst_m: 4e-5 / 3.0,
            };
            outcome.advice = Some(Advice {
                chosen: Some(prediction(1.0)),
                random: Some(prediction(1.5)),
                random_range_m: [1e-5 / 3.0, 1e-5],
                random_undetermined: 2,
                bound_m: 0.9e-5 / 3.0,
                bound_gap: 1e-4,
                bound_candidates: 1000,
            });
        }
    }
    let designed = rest.iter().position(|event| matches!(event, Event::Designed(_))).unwrap();
    rest.splice(designed..designed, search.drain(..));
    rest
}

fn record(directory: &Path, events: &[Event]) -> PathBuf {
    let mut recorder = Recorder::create(directory, "run", &arm()).unwrap();
    for event in events {
        recorder.report(event).unwrap();
    }
    recorder.finish().unwrap()
}

/// Equal to the bit: all numbers of `Debug` are shortest round-trip, and `-0.0` is written as such.
fn assert_same(read: &[Event], written: &[Event]) {
    assert_eq!(read.len(), written.len());
    for (read, written) in read.iter().zip(written) {
        assert_eq!(read, written);
        assert_eq!(format!("{read:?}"), format!("{written:?}"));
    }
}

#[test]
fn events_come_back_bit_for_bit() {
    let directory = tempfile::tempdir().unwrap();
    let events = events(&SMALL);
    let path = record(directory.path(), &events);
    assert_eq!(path, directory.path().join("run.mcap"));
    assert!(!directory.path().join("run.partial.mcap").exists());
    let recording = read(&path).unwrap();
    assert!(recording.is_complete(), "{:?}", recording.cut);
    assert_eq!(recording.version_warning, None);
    assert_same(&recording.events, &events);
}

#[test]
fn a_search_comes_back_bit_for_bit_whole_or_cut_off_and_replays() {
    let directory = tempfile::tempdir().unwrap();
    let events = searched(&SMALL, 23);
    let path = record(directory.path(), &events);
    let recording = read(&path).unwrap();
    assert!(recording.is_complete(), "{:?}", recording.cut);
    assert_same(&recording.events, &events);
    let comparison = replay(&path, &events);
    assert!(comparison.identical() && comparison.compared == recording.message_count, "{comparison:?}");

    let bytes = fs::read(&path).unwrap();
    let cut_path = directory.path().join("cut.mcap");
    let mut counts = std::collections::BTreeSet::new();
    for length in (0..bytes.len()).step_by(211) {
        fs::write(&cut_path, &bytes[..length]).unwrap();
        if let Ok(cut) = read(&cut_path) {
            assert!(!cut.cut.unwrap().damaged);
            assert_same(&cut.events, &events[..cut.events.len()]);
            counts.insert(cut.events.len());
        }
    }
    // Start; note and steps by tens; the design; measurements by sixteens; all but the end. Chunk by chunk.
    assert_eq!(counts.into_iter().collect::<Vec<_>>(), [1, 12, 22, 26, 42, 47, 49]);

    type Change = fn(&mut Event);
    let cases: [(usize, Change, &str); 3] = [
        (
            6,
            |event| {
                if let Event::Search(step) = event {
                    next_up(&mut step.best)
                }
            },
            "/design/search[4].best: recorded",
        ),
        (
            6,
            |event| {
                if let Event::Search(step) = event {
                    next_up(&mut step.best_configurations[2][5])
                }
            },
            "/design/search[4].best_configurations[2].joints[5]: recorded",
        ),
        (
            25,
            |event| {
                if let Event::Designed(outcome) = event {
                    outcome.advice = None
                }
            },
            "/design/outcome[0].advice: recorded {",
        ),
    ];
    for (number, change, expected) in cases {
        let mut altered = events.clone();
        change(&mut altered[number]);
        let difference = replay(&path, &altered).first_difference.unwrap().to_string();
        assert!(difference.starts_with(expected), "{difference}, expected {expected}");
    }
}

#[test]
fn the_same_events_give_the_same_bytes() {
    let directory = tempfile::tempdir().unwrap();
    let events = events(&SMALL);
    let first = fs::read(record(&directory.path().join("a"), &events)).unwrap();
    std::thread::sleep(std::time::Duration::from_millis(20));
    assert_eq!(first, fs::read(record(&directory.path().join("b"), &events)).unwrap());
}

#[test]
fn times_never_go_backwards_and_every_event_stands_in_one_chunk() {
    let directory = tempfile::tempdir().unwrap();
    let path = record(directory.path(), &events(&SMALL));
    let bytes = fs::read(&path).unwrap();
    let (mut last, mut event, mut offset) = (0, 0, 0);
    let mut messages = Messages::open(&path).unwrap();
    while let Some(message) = messages.next() {
        let message = message.unwrap();
        assert!(message.log_time_ns >= last);
        // The queue is empty again when a chunk has been used up.
        if message.event == event {
            assert!(offset == 0 || offset == messages.offset(), "event {event} is split");
        }
        (last, event, offset) = (message.log_time_ns, message.event, messages.offset());
        assert!(message.topic().is_some());
    }
    assert_eq!(messages.cut(), None);
    // 0.1 s each: 24 iterations, the design, the lead to the session, the diagnosis, the identification; 19 poses every 12.5 s.
    assert_eq!(last, 100_000_000 * (24 + 1 + 1 + 1 + 1) + 19 * 12_500_000_000);
    assert!(bytes.len() < 400_000, "{} bytes", bytes.len());
}

#[test]
fn a_truncated_recording_is_readable_up_to_its_last_whole_chunk() {
    let directory = tempfile::tempdir().unwrap();
    let events = events(&SMALL);
    let bytes = fs::read(record(directory.path(), &events)).unwrap();
    let path = directory.path().join("cut.mcap");
    let mut counts = std::collections::BTreeSet::new();
    for length in (0..bytes.len()).step_by(211).chain(bytes.len() - 60..bytes.len()) {
        fs::write(&path, &bytes[..length]).unwrap();
        match read(&path) {
            Ok(recording) => {
                let cut = recording.cut.clone().unwrap();
                assert!(!cut.damaged, "{length}: {cut}");
                assert!(cut.offset <= length as u64 && cut.file_length == length as u64);
                assert!(cut.to_string().contains("cut.mcap is cut off"), "{cut}");
                assert_same(&recording.events, &events[..recording.events.len()]);
                counts.insert(recording.events.len());
            }
            Err(ReadError::Empty { .. }) => assert_eq!(length, 0),
            Err(ReadError::Nothing(cut)) => assert!(!cut.damaged && length < 20_000, "{length}: {cut}"),
            Err(error) => panic!("{length}: {error}"),
        }
    }
    // Start; note and iterations by tens; the design; measurements by sixteens; the diagnosis; all. Chunk by chunk.
    assert_eq!(counts.into_iter().collect::<Vec<_>>(), [1, 12, 22, 27, 43, 48, 50]);
}

#[test]
fn an_altered_byte_is_noticed_wherever_it_is() {
    let directory = tempfile::tempdir().unwrap();
    let events = events(&SMALL);
    let bytes = fs::read(record(directory.path(), &events)).unwrap();
    let path = directory.path().join("damaged.mcap");
    let mut altered = bytes.clone();
    for (number, at) in (0..bytes.len()).step_by(101).chain(bytes.len() - 400..bytes.len()).enumerate() {
        altered[at] ^= [0x01, 0x80, 0xff, 0x10][number % 4];
        fs::write(&path, &altered).unwrap();
        match read(&path) {
            Ok(recording) => {
                let cut = recording.cut.clone().unwrap_or_else(|| panic!("byte {at} of {} is not noticed", bytes.len()));
                // Without its end magic the file looks cut off.
                assert!(cut.damaged || at >= bytes.len() - 8, "{at}: {cut}");
                assert_same(&recording.events, &events[..recording.events.len()]);
            }
            Err(ReadError::NotMcap { .. }) => assert!(at < 8),
            Err(ReadError::Nothing(cut)) => assert!(cut.damaged && at < 20_000, "{at}: {cut}"),
            Err(error) => panic!("{at}: {error}"),
        }
        altered[at] = bytes[at];
    }
}

#[test]
fn arbitrary_bytes_never_panic() {
    let directory = tempfile::tempdir().unwrap();
    let bytes = fs::read(record(directory.path(), &events(&SMALL))).unwrap();
    let path = directory.path().join("noise.mcap");
    let mut stream = stream(3, "test/recording/noise");
    for _ in 0..200 {
        let mut noise = bytes.clone();
        for _ in 0..1 + (stream.uniform(0.0, 1.0) * 40.0) as usize {
            // Half of the changes go to the first kilobytes, where header, schemas and lengths are.
            let end = if stream.uniform(0.0, 1.0) < 0.5 { noise.len() as f64 } else { 3000.0 };
            let at = stream.uniform(8.0, end) as usize;
            noise[at] = stream.uniform(0.0, 256.0) as u8;
        }
        noise.truncate(stream.uniform(0.0, 1.5 * noise.len() as f64) as usize);
        fs::write(&path, &noise).unwrap();
        // A byte may be replaced by itself.
        let _ = read(&path).map(|recording| assert!(recording.cut.is_some() || noise == bytes));
        let mut random: Vec<u8> = mcap::MAGIC.to_vec();
        random.extend(
            (0..300).map(|_| stream.uniform(0.0, 256.0) as u8 & if stream.uniform(0.0, 1.0) < 0.5 { 0x0f } else { 0xff }),
        );
        fs::write(&path, &random).unwrap();
        read(&path).unwrap_err();
    }
}

#[test]
fn a_killed_run_leaves_its_last_chunks_and_the_earlier_recording() {
    let directory = tempfile::tempdir().unwrap();
    let events = events(&SMALL);
    let whole = fs::read(record(directory.path(), &events)).unwrap();
    let mut recorder = Recorder::create(directory.path(), "run", &arm()).unwrap();
    for event in &events[..20] {
        recorder.report(event).unwrap();
    }
    // What SIGKILL leaves: nothing that was buffered is written any more.
    std::mem::forget(recorder);
    let recording = read(&directory.path().join("run.partial.mcap")).unwrap();
    let cut = recording.cut.clone().unwrap();
    assert!(!cut.damaged);
    assert_eq!((recording.events.len(), cut.last_time_ns), (12, Some(1_000_000_000)));
    assert_same(&recording.events, &events[..12]);
    assert_eq!(fs::read(directory.path().join("run.mcap")).unwrap(), whole);
}

#[test]
fn a_process_killed_with_sigkill_leaves_a_readable_file() {
    let directory = tempfile::tempdir().unwrap();
    let mut child = std::process::Command::new(std::env::current_exe().unwrap())
        .args(["--ignored", "--exact", "recording::tests::records_until_it_is_killed"])
        .env("KINCAL_KILL_TEST", directory.path())
        .stdout(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let partial = directory.path().join("run.partial.mcap");
    let patience = std::time::Instant::now();
    while fs::metadata(&partial).map_or(0, |metadata| metadata.len()) < 200_000 {
        assert!(patience.elapsed().as_secs() < 60, "nothing is written");
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let recording = read(&partial).unwrap();
    let cut = recording.cut.unwrap();
    assert!(!cut.damaged && cut.to_string().contains("run.partial.mcap is cut off"), "{cut}");
    let events = events(&SMALL);
    assert_same(&recording.events[..26], &events[..26]);
    assert!(recording.events[26..].iter().all(|event| *event == events[25]));
}

/// The child process of the test above.
#[test]
#[ignore = "never ends by itself"]
fn records_until_it_is_killed() {
    let directory = PathBuf::from(std::env::var("KINCAL_KILL_TEST").unwrap());
    let mut recorder = Recorder::create(&directory, "run", &arm()).unwrap();
    let events = events(&SMALL);
    events[..26].iter().for_each(|event| recorder.report(event).unwrap());
    loop {
        recorder.report(&events[25]).unwrap();
    }
}

#[test]
fn a_run_that_fails_keeps_all_it_had_and_does_not_look_whole() {
    let directory = tempfile::tempdir().unwrap();
    let events = events(&SMALL);
    let mut recorder = Recorder::create(directory.path(), "run", &arm()).unwrap();
    for event in &events[..20] {
        recorder.report(event).unwrap();
    }
    drop(recorder);
    let recording = read(&directory.path().join("run.partial.mcap")).unwrap();
    assert!(!recording.is_complete());
    assert_same(&recording.events, &events[..20]);
    assert!(!directory.path().join("run.mcap").exists());
    // The next run takes the partial file over.
    record(directory.path(), &events);
    assert!(!directory.path().join("run.partial.mcap").exists());
}

#[test]
fn two_runs_of_one_name_do_not_write_into_each_other() {
    let directory = tempfile::tempdir().unwrap();
    let first = Recorder::create(directory.path(), "run", &arm()).unwrap();
    let error = Recorder::create(directory.path(), "run", &arm()).err().unwrap();
    assert!(matches!(error, RecordError::Busy { .. }), "{error}");
    drop(first);
    Recorder::create(directory.path(), "run", &arm()).unwrap();
}

#[test]
fn an_output_that_cannot_be_written_is_named_with_reason_and_remedy() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("file");
    fs::write(&file, "x").unwrap();
    let error = Recorder::create(&file.join("below"), "run", &arm()).err().unwrap().to_string();
    assert!(error.contains("cannot create") && error.contains("file/below") && error.contains("choose an output"), "{error}");
    fs::create_dir(directory.path().join("taken.mcap")).unwrap();
    let error = Recorder::create(directory.path(), "taken", &arm()).err().unwrap().to_string();
    assert!(error.contains("cannot replace") && error.contains("directory"), "{error}");
}

#[test]
fn files_of_others_are_named_for_what_they_are() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("other.mcap");
    let message = |path: &Path| read(path).unwrap_err().to_string();
    assert!(message(&path).contains("cannot read"));
    fs::write(&path, "").unwrap();
    assert!(message(&path).contains("is empty"));
    fs::write(&path, "#!/bin/sh\n").unwrap();
    assert!(message(&path).contains("is no MCAP file (it begins with #!/bin/s)"), "{}", message(&path));
    for (topic, schema, text) in
        [("/imu", "sensor_msgs/Imu", "topics found: /imu (sensor_msgs/Imu)"), ("/run", "Other", "topics found: /run (Other)")]
    {
        let mut writer = mcap::Writer::new(fs::File::create(&path).unwrap()).unwrap();
        let schema = writer.add_schema(schema, "ros1msg", b"").unwrap();
        let channel_id = writer.add_channel(schema, topic, "ros1", &Default::default()).unwrap();
        let header = mcap::records::MessageHeader { channel_id, sequence: 0, log_time: 5, publish_time: 5 };
        writer.write_to_known_channel(&header, b"abc").unwrap();
        writer.finish().unwrap();
        assert!(message(&path).contains(text), "{}", message(&path));
    }
    let mut writer = mcap::Writer::new(fs::File::create(&path).unwrap()).unwrap();
    writer.finish().unwrap();
    assert!(message(&path).contains("topics found: none"), "{}", message(&path));
}

#[test]
fn a_recording_of_a_newer_version_is_read_with_a_warning() {
    let directory = tempfile::tempdir().unwrap();
    let mut events = events(&SMALL);
    let Event::Start(start) = &mut events[0] else { panic!() };
    start.version = "99.1.0-rc.2".to_owned();
    let recording = read(&record(directory.path(), &events)).unwrap();
    assert!(recording.version_warning.unwrap().contains("recorded by kincal 99.1.0-rc.2, this is"));
    assert_same(&recording.events, &events);
}

#[test]
fn what_cannot_be_read_back_is_refused() {
    let mut events = events(&SMALL);
    let refused = |event: &Event| Encoder::new(&arm()).encode(event).unwrap_err().to_string();
    let Event::Swarm(swarm) = &mut events[2] else { panic!() };
    swarm.fitness[3] = f64::NAN;
    assert!(refused(&events[2]).starts_with("/design/swarm: fitness is NaN or infinite"), "{}", refused(&events[2]));
    let mut step = searched(&SMALL, 1).swap_remove(2);
    let Event::Search(search) = &mut step else { panic!() };
    search.best_configurations[1].push(0.0);
    assert_eq!(refused(&step), "/design/search: a configuration has 7 joint coordinates, the arm has 6 joints");
    let Event::Search(search) = &mut step else { panic!() };
    search.value = f64::NEG_INFINITY;
    assert!(refused(&step).starts_with("/design/search: value is NaN or infinite"), "{}", refused(&step));
    let Event::Measured(measurement) = &mut events[30] else { panic!() };
    measurement.joints.pop();
    assert_eq!(refused(&events[30]), "/measurement: a configuration has 5 joint coordinates, the arm has 6 joints");
    let Event::Diagnosed(diagnosis) = &mut events[47] else { panic!() };
    diagnosis.gap.gap_closed = Some(f64::NAN);
    assert!(refused(&events[47]).starts_with("/diagnosis: a number is NaN or infinite"), "{}", refused(&events[47]));
    let Some(Event::Identified(identification)) = events.last_mut() else { panic!() };
    identification.parameters[1].standard_error = Some(f64::INFINITY);
    assert!(refused(events.last().unwrap()).contains("NaN or infinite"));
}

fn replay(path: &Path, events: &[Event]) -> Comparison {
    let mut comparer = Comparer::open(path, &arm()).unwrap();
    events.iter().for_each(|event| comparer.report(event).unwrap());
    comparer.finish().unwrap()
}

#[test]
fn a_repeated_run_is_identical() {
    let directory = tempfile::tempdir().unwrap();
    let events = events(&SMALL);
    let path = record(directory.path(), &events);
    let comparison = replay(&path, &events);
    assert!(comparison.identical() && comparison.cut.is_none(), "{comparison:?}");
    assert_eq!((comparison.compared, comparison.missing, comparison.extra), (read(&path).unwrap().message_count, 0, 0));
}

fn next_up(value: &mut f64) {
    *value = value.next_up();
}

#[test]
fn a_change_in_the_last_bit_is_found_and_named() {
    let directory = tempfile::tempdir().unwrap();
    let events = events(&SMALL);
    let path = record(directory.path(), &events);
    type Change = fn(&mut Event);
    let cases: [(usize, Change, &str); 7] = [
        (
            4,
            |event| {
                if let Event::Swarm(swarm) = event {
                    next_up(&mut swarm.best.o1)
                }
            },
            "/design/swarm[2].best.o1: recorded 0.",
        ),
        (
            4,
            |event| {
                if let Event::Swarm(swarm) = event {
                    next_up(&mut swarm.fitness[6])
                }
            },
            "/design/swarm[2].fitness[6]: recorded",
        ),
        (
            5,
            |event| {
                if let Event::Swarm(swarm) = event {
                    let value = &mut swarm.end_points[3][2][1];
                    *value = value.next_up();
                }
            },
            "/design/swarm/end_points[3].points[17].y: recorded",
        ),
        (
            2,
            |event| {
                if let Event::Swarm(swarm) = event {
                    swarm.best.o6 = 0.0
                }
            },
            "/design/swarm[0].best.o6: recorded -0.0, recomputed 0.0 (message 9, 0.100 s)",
        ),
        (
            31,
            |event| {
                if let Event::Measured(measurement) = event {
                    measurement.orientation_xyzw = None
                }
            },
            "/measurement[",
        ),
        (
            49,
            |event| {
                if let Event::Identified(identification) = event {
                    next_up(&mut identification.parameters[3].identified)
                }
            },
            "/identification[0].parameters[3].identified: recorded",
        ),
        (
            47,
            |event| {
                if let Event::Diagnosed(diagnosis) = event {
                    next_up(&mut diagnosis.confusion_sets[0][1].probability)
                }
            },
            "/diagnosis[0].confusion_sets[0].candidates[1].probability: recorded",
        ),
    ];
    for (number, change, expected) in cases {
        let mut altered = events.clone();
        change(&mut altered[number]);
        let comparison = replay(&path, &altered);
        let difference = comparison.first_difference.as_ref().unwrap().to_string();
        assert!(!comparison.identical() && difference.starts_with(expected), "{difference}, expected {expected}");
    }
}

#[test]
fn missing_and_extra_events_are_counted() {
    let directory = tempfile::tempdir().unwrap();
    let events = events(&SMALL);
    let path = record(directory.path(), &events);
    let shorter = replay(&path, &events[..events.len() - 1]);
    assert_eq!((shorter.identical(), shorter.missing, shorter.extra), (false, 4, 0));
    assert!(shorter.first_difference.unwrap().to_string().starts_with("/identification[0].message: recorded"));
    let mut longer = events.clone();
    longer.push(Event::Note("more".to_owned()));
    let longer = replay(&path, &longer);
    assert_eq!((longer.identical(), longer.missing, longer.extra), (false, 0, 1));
    // Of a recording that was cut off, what is there is compared.
    let bytes = fs::read(&path).unwrap();
    let cut = directory.path().join("cut.mcap");
    fs::write(&cut, &bytes[..bytes.len() / 2]).unwrap();
    let comparison = replay(&cut, &events);
    assert!(comparison.identical() && comparison.extra > 0 && !comparison.cut.unwrap().damaged);
}

#[test]
fn the_recorded_frames_multiply_to_the_nominal_tool_pose() {
    use foxglove::messages::{FrameTransforms, PoseInFrame, PosesInFrame, Quaternion, Vector3};
    use nalgebra::{Translation3, UnitQuaternion};
    use prost::Message as _;

    let to_pose = |t: Option<Vector3>, q: Option<Quaternion>| {
        let (t, q) = (t.unwrap(), q.unwrap());
        let rotation = UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(q.w, q.x, q.y, q.z));
        Pose::from_parts(Translation3::new(t.x, t.y, t.z), rotation)
    };
    let six = mdh::SixParameters { xyz: [0.1, 0.2, 0.3], rpy: [0.1, -0.2, 0.3] };
    let plain = arm();
    let mut mounted = arm();
    mounted.chain =
        mdh::chain(&[mdh::Frame { alpha: 0.4, a: 0.3, ..Default::default() }; 7], mounted.chain.joints, Some(six), None);
    for (arm, names) in [(plain, vec!["base_link", "link1"]), (mounted, vec!["world", "base_link", "link1"])] {
        let mut encoder = Encoder::new(&arm);
        let measured = events(&SMALL).into_iter().filter(|event| matches!(event, Event::Measured(_)));
        for event in measured {
            let Event::Measured(measurement) = &event else { panic!() };
            let expected = arm.chain.at_nominal().forward(&measurement.joints);
            let messages = encoder.encode(&event).unwrap();
            let data = |topic| messages.iter().find(|message| message.topic == topic).unwrap().data.as_slice();
            let transforms = FrameTransforms::decode(data(Topic::Transforms)).unwrap().transforms;
            assert_eq!(transforms.len(), arm.chain.frame_names().len() - 1);
            let (mut frame, mut pose) = (names[0].to_owned(), Pose::identity());
            for (number, transform) in transforms.into_iter().enumerate() {
                assert_eq!(transform.parent_frame_id, frame);
                assert!(names.get(number + 1).is_none_or(|name| *name == transform.child_frame_id));
                pose *= to_pose(transform.translation, transform.rotation);
                frame = transform.child_frame_id;
            }
            assert_eq!(frame, "tool");
            let nominal = PoseInFrame::decode(data(Topic::PoseNominal)).unwrap();
            assert_eq!(nominal.frame_id, names[0]);
            let nominal = nominal.pose.map(|pose| to_pose(pose.position, pose.orientation)).unwrap();
            assert!(pose_error(&pose, &expected).norm() < 1e-14 && nominal == expected);
        }
    }
    // With the nominal values as identified ones, the identified arm predicts the nominal poses.
    let (arm, mut events) = (arm(), events(&SMALL));
    let Some(Event::Identified(identification)) = events.last_mut() else { panic!() };
    identification.parameters.iter_mut().for_each(|parameter| parameter.identified = parameter.nominal);
    let mut encoder = Encoder::new(&arm);
    let messages: Vec<_> = events.iter().flat_map(|event| encoder.encode(event).unwrap()).collect();
    let predicted = messages.iter().find(|message| message.topic == Topic::PosesPredicted).unwrap();
    let nominal = messages.iter().filter(|message| message.topic == Topic::PoseNominal);
    let nominal: Vec<_> = nominal.map(|message| PoseInFrame::decode(message.data.as_slice()).unwrap().pose.unwrap()).collect();
    assert_eq!(PosesInFrame::decode(predicted.data.as_slice()).unwrap().poses, nominal);
}

/// What Foxglove takes: every property described and of one type, no references, no arrays of arrays.
fn for_viewers(path: &str, schema: &Value) {
    assert!(schema["description"].is_string() || path.ends_with(']'), "{path} is not described");
    match schema["type"].as_str().unwrap_or_else(|| panic!("{path} has no single type: {schema}")) {
        "object" => {
            schema["properties"]
                .as_object()
                .unwrap()
                .iter()
                .for_each(|(key, inner)| for_viewers(&format!("{path}.{key}"), inner));
        }
        "array" => {
            assert_ne!(schema["items"]["type"], "array", "{path}: Foxglove takes no arrays of arrays");
            for_viewers(&format!("{path}[]"), &schema["items"]);
        }
        "number" | "integer" | "string" | "boolean" => {}
        other => panic!("{path}: {other}"),
    }
}

#[test]
fn json_messages_are_what_their_schemas_say() {
    let mut encoder = Encoder::new(&arm());
    let mut seen = std::collections::BTreeSet::new();
    for event in events(&SMALL).into_iter().chain(searched(&SMALL, 5)) {
        for message in encoder.encode(&event).unwrap() {
            seen.insert(message.topic);
            let schema = message.topic.schema();
            assert_eq!(schema.encoding, if message.topic.message_encoding() == "json" { "jsonschema" } else { "protobuf" });
            if message.topic.message_encoding() == "json" {
                let schema: Value = serde_json::from_slice(&schema.data).unwrap();
                assert_eq!(schema["title"], message.topic.schema_name());
                for_viewers(message.topic.name(), &schema);
                let value = serde_json::from_slice(&message.data).unwrap();
                check(&schema.try_into().unwrap(), &value).unwrap();
            }
        }
    }
    assert_eq!(seen.into_iter().collect::<Vec<_>>(), Topic::ALL);
}

/// Not a test: writes a recording of the paper's size to look at, and times writing and reading.
#[test]
#[ignore = "writes to KINCAL_SAMPLE; for measuring and looking"]
fn sample() {
    let directory = PathBuf::from(std::env::var("KINCAL_SAMPLE").unwrap());
    let events = events(&Size { iterations: 200, particles: 50, configurations: 60, measurements: 100 });
    let clock = std::time::Instant::now();
    let path = record(&directory, &events);
    let (written, size) = (clock.elapsed(), fs::metadata(&path).unwrap().len());
    let clock = std::time::Instant::now();
    let recording = read(&path).unwrap();
    let was_read = clock.elapsed();
    let clock = std::time::Instant::now();
    assert!(replay(&path, &events).identical());
    println!("{} events, {} messages, {size} bytes", events.len(), recording.message_count);
    println!("written in {written:?}, read in {was_read:?}, compared in {:?}", clock.elapsed());
}

#[test]
fn a_measurement_without_conditions_reads_as_without() {
    let text = r#"{"index":3,"pose_id":2,"role":"held_out","time_s":7.5,"joints":[0.1,-2.0],"position_m":[1.0,2.0,3.0]}"#;
    let expected = Measurement {
        index: 3,
        pose_id: 2,
        role: Role::HeldOut,
        time_s: 7.5,
        joints: vec![0.1, -2.0],
        position_m: [1.0, 2.0, 3.0],
        ..Measurement::default()
    };
    assert_eq!(serde_json::from_str::<Measurement>(text).unwrap(), expected);
    // What is absent is not written either, and every key that is has a place in the schema.
    let schema = Topic::Measurement.schema();
    let schema: Value = serde_json::from_slice(&schema.data).unwrap();
    let keys = |measurement: &Measurement| -> Vec<String> {
        let value = serde_json::to_value(measurement).unwrap();
        value.as_object().unwrap().keys().cloned().collect()
    };
    assert_eq!(keys(&expected), ["index", "joints", "pose_id", "position_m", "role", "temperatures_c", "time_s"]);
    let all = Measurement {
        orientation_xyzw: Some([0.0, 0.0, 0.0, 1.0]),
        approach: vec![1, -1],
        ambient_c: Some(20.0),
        payload_kg: Some(5.0),
        dwell_s: Some(2.0),
        gravity_m_s2: Some([0.0, 0.0, -9.81]),
        session: Some("1".to_owned()),
        target: Some("A".to_owned()),
        angles_rad: None,
        fixed_point: Some("socket".to_owned()),
        plane: Some("plate".to_owned()),
        unread: [false, false, true],
        ..expected
    };
    let mut described: Vec<String> = schema["properties"].as_object().unwrap().keys().cloned().collect();
    let mut written = keys(&all);
    described.sort_unstable();
    written.sort_unstable();
    assert_eq!(written, described);
}
