//! A run that never happened, realistic enough to look at: an arm of eight joints, its swarm (or another search), measurements, identification.
//!
//! `KINCAL_VIEWING_SAMPLES=folder cargo test --release viewing::example -- --ignored` writes recordings to look at.

use std::path::{Path, PathBuf};

use nalgebra::{Matrix3, Point3, Vector3};

use super::{Target, Viewer, ViewerError, open};
use crate::arm::frames::{Pose, pose_error, rotation_from_vector};
use crate::arm::mdh::{Frame, chain};
use crate::arm::{Arm, Fixture, Geometry, Inertial, Link, Shape};
use crate::arm::{Joint, JointKind, Quantity};
use crate::design::outcome::{Advice, DesignOutcome, EvennessDomains, RandomReference, SearchStep, StopReason, SwarmIteration};
use crate::design::problem::{Criterion, DesignProblem, Method};
use crate::event::{Event, Start};
use crate::identification::outcome::{DeclaredNoise, Errors, Identification, ParameterEstimate, Residual, Summary};
use crate::measurement::{Measurement, Role};
use crate::progress::Progress as _;
use crate::quality::Indexes;
use crate::quality::prediction::Prediction;
use crate::seed::stream;

const JOINTS: usize = 8;

fn at(x: f64, y: f64, z: f64, geometry: Geometry) -> Shape {
    Shape { link_from_shape: Pose::translation(x, y, z), geometry }
}

fn arm() -> Arm {
    let lengths = [0.22, 0.0, 0.34, 0.0, 0.30, 0.0, 0.22, 0.0, 0.12];
    let quarter = std::f64::consts::FRAC_PI_2;
    let frames: Vec<Frame> = lengths
        .iter()
        .enumerate()
        .map(|(index, &d)| Frame {
            alpha: if index == 0 { 0.0 } else { quarter * if index % 2 == 1 { -1.0 } else { 1.0 } },
            d,
            ..Frame::default()
        })
        .collect();
    let joints = (1..=JOINTS)
        .map(|number| Joint { name: format!("joint{number}"), kind: JointKind::Revolute, lower: -2.0, upper: 2.0, mimic: None })
        .collect();
    let inertial =
        Inertial { mass_kg: 2.0, centre_of_mass_in_link: Point3::origin(), inertia_in_link: Matrix3::identity() * 1e-2 };
    let mut links = vec![Link {
        name: "base_link".to_owned(),
        inertial: None,
        shapes: vec![at(0.0, 0.0, 0.06, Geometry::Cylinder { half_length: 0.06, radius: 0.085 })],
    }];
    for number in 1..=JOINTS {
        let (d, radius) = (lengths[number - 1], 0.062 - 0.004 * number as f64);
        let mut shapes = vec![at(0.0, 0.0, 0.0, Geometry::Cylinder { half_length: radius * 1.25, radius })];
        if d > 0.0 {
            shapes.push(at(0.0, 0.0, d / 2.0, Geometry::Capsule { half_length: d / 2.0, radius: radius * 0.8 }));
        }
        if number == JOINTS {
            shapes = vec![
                at(0.0, 0.0, 0.0, Geometry::Sphere { radius: 0.04 }),
                Shape {
                    link_from_shape: Pose::rotation(Vector3::x() * quarter) * Pose::translation(0.0, 0.0, 0.06),
                    geometry: Geometry::Box { half_extents: [0.018, 0.018, 0.06] },
                },
            ];
        }
        links.push(Link { name: format!("link{number}"), inertial: Some(inertial.clone()), shapes });
    }
    let plate = Fixture {
        name: "floor".to_owned(),
        shape: at(0.0, 0.0, -0.02, Geometry::Box { half_extents: [0.6, 0.6, 0.02] }),
        may_touch: vec![0],
    };
    Arm {
        name: "example arm".to_owned(),
        chain: chain(&frames, joints, None, None),
        links,
        fixtures: vec![plate],
        uncollidable: Vec::new(),
        gravity_in_base: Vector3::new(0.0, 0.0, -9.81),
    }
}

fn indexes(progress: f64) -> Indexes {
    Indexes {
        o1: 0.4 + 0.4 * progress,
        o2: 0.03 + 0.05 * progress,
        o3: 0.2 + 0.35 * progress,
        o4: 0.01 + 0.02 * progress,
        o5: 0.1 + 0.05 * progress,
        o6: 0.2 + 0.1 * progress,
        dispersion_m2: 0.25 + 0.3 * progress,
        evenness: 0.8 - 0.4 * progress,
        comprehensive: 0.9 + 0.35 * progress,
        rank: 32,
    }
}

/// The events of a run: `particles` × `count` end points over `iterations`, `count` + `held_out` measurements.
fn events(particles: usize, count: usize, iterations: usize, held_out: usize) -> (Arm, Vec<Event>) {
    let arm = arm();
    let nominal = arm.chain.at_nominal();
    let mut draw = stream(1, "test/viewing");
    let mut configuration = |spread: f64| (0..JOINTS).map(|_| draw.uniform(-spread, spread)).collect::<Vec<f64>>();
    let start = Start {
        version: "0.1.0".to_owned(),
        command: "run".to_owned(),
        scene: "name = \"example\"\n".to_owned(),
        poses: None,
        real: None,
    };
    let mut events = vec![Event::Start(start), Event::Note("design by particle swarm, seed 1".to_owned())];

    let goal: Vec<Vec<f64>> = (0..count).map(|_| configuration(1.5)).collect();
    let begin: Vec<Vec<Vec<f64>>> = (0..particles).map(|_| (0..count).map(|_| configuration(2.0)).collect()).collect();
    let mut personal = vec![0.0f64; particles];
    for iteration in 0..=iterations {
        let progress = 1.0 - libm::exp(-3.0 * iteration as f64 / iterations as f64);
        let place = |particle: usize, index: usize| -> Vec<f64> {
            let share = (progress * (0.6 + 0.5 * particle as f64 / particles as f64)).min(0.97);
            begin[particle][index].iter().zip(&goal[index]).map(|(from, to)| from + share * (to - from)).collect()
        };
        let end_points = (0..particles)
            .map(|particle| {
                (0..count)
                    .map(|index| {
                        let tool = nominal.forward(&place(particle, index)).translation.vector;
                        [tool.x as f32, tool.y as f32, tool.z as f32]
                    })
                    .collect()
            })
            .collect();
        let fitness: Vec<f64> = (0..particles)
            .map(|p| {
                0.6 + 0.55 * progress * (0.7 + 0.3 * p as f64 / particles as f64) + 0.05 * libm::sin((iteration * (p + 3)) as f64)
            })
            .collect();
        for (best, now) in personal.iter_mut().zip(&fitness) {
            *best = best.max(*now);
        }
        events.push(Event::Swarm(SwarmIteration {
            iteration,
            iterations,
            fitness,
            personal_best: personal.clone(),
            best_particle: particles - 1,
            best: indexes(progress),
            inertia: 0.9 - 0.5 * progress,
            c1: 1.5 + progress,
            c2: 2.5 - progress,
            evaluations: (particles * (iteration + 1)) as u64,
            rejections: (7 * iteration) as u64,
            end_points,
            best_configurations: if iteration % 3 == 1 {
                Vec::new()
            } else {
                (0..count).map(|i| place(particles - 1, i)).collect()
            },
        }));
    }
    events.push(Event::Designed(DesignOutcome {
        method: "pso".to_owned(),
        criterion: "comprehensive".to_owned(),
        value: indexes(1.0).comprehensive,
        advice: None,
        no_advice: None,
        configurations: goal.clone(),
        indexes: indexes(1.0),
        indexes_all_parameters: indexes(1.0),
        evenness_domains: EvennessDomains { reachable: 0.4, bounding_cube: 0.7 },
        random: RandomReference { sets: 100, mean: indexes(0.1), min: indexes(0.0), max: indexes(0.3) },
        dropped_parameters: ["d2", "beta3", "theta9"].map(str::to_owned).to_vec(),
        evaluations: (particles * (iterations + 1)) as u64,
        rejections: (7 * iterations) as u64,
        stop: StopReason::IterationLimit,
    }));

    let mut draw = stream(1, "test/viewing/truth");
    let values: Vec<f64> = arm
        .chain
        .parameters
        .iter()
        .map(|parameter| {
            parameter.nominal + if parameter.quantity == Quantity::Length { 5e-4 } else { 1e-3 } * draw.uniform(-1.0, 1.0)
        })
        .collect();
    let truth = arm.chain.at(&values);
    let mut residuals = Vec::new();
    for index in 0..count + held_out {
        let joints = goal.get(index).cloned().unwrap_or_else(|| (0..JOINTS).map(|_| draw.uniform(-1.5, 1.5)).collect());
        let real = truth.forward(&joints);
        let mut noise = |sigma: f64| Vector3::from_fn(|_, _| sigma * draw.normal());
        let position = real.translation.vector + noise(12e-6);
        let measured = Pose::from_parts(position.into(), rotation_from_vector(&noise(3e-5)) * real.rotation);
        let q = measured.rotation.quaternion();
        events.push(Event::Measured(Measurement {
            index,
            pose_id: index,
            role: if index < count { Role::Fit } else { Role::HeldOut },
            time_s: 20.0 * index as f64,
            temperatures_c: (0..=JOINTS)
                .map(|link| 22.0 + 4.0 * (1.0 - libm::exp(-(index as f64) / 20.0)) / (1.0 + link as f64))
                .collect(),
            position_m: measured.translation.vector.into(),
            orientation_xyzw: Some([q.i, q.j, q.k, q.w]),
            joints: joints.clone(),
            approach: (0..JOINTS).map(|joint| if (index + joint) % 2 == 0 { 1 } else { -1 }).collect(),
            ambient_c: Some(21.0 + 0.02 * index as f64),
            payload_kg: Some(if index % 2 == 0 { 0.0 } else { 5.0 }),
            dwell_s: Some(2.0),
            ..Measurement::default()
        }));
        let six = |predicted: &Pose| -> [f64; 6] { pose_error(&measured, predicted).into() };
        residuals.push(Residual {
            index,
            position_m: position.into(),
            nominal: six(&nominal.forward(&joints)),
            identified: six(&real),
        });
    }
    let errors = |of: fn(&Residual) -> &[f64; 6], residuals: &[Residual]| Errors {
        count: residuals.len(),
        position_m: summary(residuals.iter().map(|r| Vector3::from_column_slice(&of(r)[..3]).norm())),
        rotation_rad: Some(summary(residuals.iter().map(|r| Vector3::from_column_slice(&of(r)[3..]).norm()))),
    };
    let (fit, verify) = residuals.split_at(count);
    events.push(Event::Identified(Identification {
        joint_frames: Vec::new(),
        left_out: Vec::new(),
        ladder: Vec::new(),
        converged: true,
        reason: "the step fell below 1e-12".to_owned(),
        iterations: 5,
        rank: 32,
        equations: 6 * count,
        residual_scale: Some(1.02),
        parameters: arm
            .chain
            .parameters
            .iter()
            .zip(&values)
            .map(|(parameter, value)| ParameterEstimate {
                name: parameter.name.clone(),
                nominal: parameter.nominal,
                identified: *value,
                standard_error: Some(1e-5),
                unit: parameter.quantity.unit().to_owned(),
                dropped: false,
            })
            .collect(),
        combinations: Vec::new(),
        nominal: errors(|r| &r.nominal, fit),
        fitted: errors(|r| &r.identified, fit),
        held_out: Some(errors(|r| &r.identified, verify)),
        held_out_nominal: Some(errors(|r| &r.nominal, verify)),
        declared_noise: DeclaredNoise { position_m: 5e-5, rotation_rad: Some(1e-4) },
        noise_estimated: false,
        residuals: residuals.clone(),
        notes: vec!["orientation weighted by its declared sigma".to_owned()],
    }));
    events.push(Event::Note("identified".to_owned()));
    (arm, events)
}

fn summary(values: impl Iterator<Item = f64> + Clone) -> Summary {
    let n = values.clone().count() as f64;
    Summary {
        min: values.clone().fold(f64::INFINITY, f64::min),
        mean: values.clone().sum::<f64>() / n,
        rms: (values.clone().map(|v| v * v).sum::<f64>() / n).sqrt(),
        max: values.fold(0.0, f64::max),
    }
}

/// The events of a run with a search of `steps` steps in place of the swarm.
fn searched(count: usize, steps: usize, held_out: usize) -> (Arm, Vec<Event>) {
    let (arm, mut events) = events(4, count, 2, held_out);
    events.retain(|event| !matches!(event, Event::Swarm(_)));
    events[1] = Event::Note("design by coordinate exchange, seed 1".to_owned());
    let prediction = |position_rms_m: f64| Prediction {
        position_rms_m,
        orientation_rms_rad: 0.3 * position_rms_m,
        position_worst_m: 1.6 * position_rms_m,
    };
    let mut configurations = Vec::new();
    for event in &mut events {
        if let Event::Designed(design) = event {
            design.method = "coordinate_exchange".to_owned();
            design.criterion = "i_optimality".to_owned();
            design.value = -2.0 * libm::log(52e-6);
            design.stop = StopReason::BudgetSpent;
            design.advice = Some(Advice {
                chosen: Some(prediction(52e-6)),
                random: Some(prediction(66e-6)),
                random_range_m: [60e-6, 75e-6],
                random_undetermined: 0,
                bound_m: 49e-6,
                bound_gap: 1e-3,
                bound_candidates: 1000,
            });
            configurations.clone_from(&design.configurations);
        }
    }
    let told = (0..steps).map(|step| {
        let error = |progress: f64| (52.0 + 14.0 * libm::exp(-4.0 * progress)) * 1e-6;
        let progress = step as f64 / steps as f64;
        Event::Search(SearchStep {
            step,
            evaluations: 1 + 500 * step as u64,
            budget: 500 * steps as u64,
            rejections: 31 * step as u64,
            // The first set determines nothing.
            value: if step == 0 { f64::MIN } else { -2.0 * libm::log(error(progress - 0.1 * libm::sin(step as f64).abs())) },
            best: if step == 0 { f64::MIN } else { -2.0 * libm::log(error(progress)) },
            best_configurations: if step % 3 == 1 { Vec::new() } else { configurations.clone() },
        })
    });
    let told: Vec<Event> = told.collect();
    events.splice(2..2, told);
    (arm, events)
}

/// The problem of a run, as far as it is shown.
fn problem(events: &[Event]) -> DesignProblem {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/arm8.toml");
    let mut problem = crate::scene::read(&path).unwrap().scene.design;
    let searched = events.iter().any(|event| matches!(event, Event::Search(_)));
    (problem.method, problem.criterion) = match searched {
        true => (Method::CoordinateExchange, Criterion::IOptimality),
        false => (Method::Pso, Criterion::Comprehensive),
    };
    problem
}

fn write(path: &Path, arm: &Arm, events: &[Event]) {
    let mut viewer = open(&Target::File(path.to_owned()), arm, Some(&problem(events)), "example").unwrap().unwrap();
    for event in events {
        viewer.report(event).unwrap();
    }
    viewer.finish().unwrap();
}

#[test]
fn a_run_is_written_to_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.rrd");
    let (arm, events) = events(20, 40, 30, 20);
    write(&path, &arm, &events);
    let bytes = std::fs::read(&path).unwrap();
    assert!(bytes.len() > 100_000, "{} bytes", bytes.len());
    assert_eq!(&bytes[..3], b"RRF", "the mark of a Rerun file");
    for path in ["/temperatures/air", "/conditions/payload", "/conditions/approach"] {
        assert!(bytes.windows(path.len()).any(|window| window == path.as_bytes()), "{path}");
    }
}

#[test]
fn a_search_is_written_to_a_file_and_nothing_of_a_swarm() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("search.rrd");
    let (arm, events) = searched(40, 30, 20);
    write(&path, &arm, &events);
    let bytes = std::fs::read(&path).unwrap();
    let holds = |text: &str| bytes.windows(text.len()).any(|window| window == text.as_bytes());
    assert!(bytes.len() > 100_000 && holds("/search/criterion/best") && holds("/search/effort"), "{} bytes", bytes.len());
    assert!(!holds("/swarm/"), "panels of a swarm that there is not");
    let (arm, events) = super::example::events(4, 10, 5, 5);
    write(&path, &arm, &events);
    let bytes = std::fs::read(&path).unwrap();
    let holds = |text: &str| bytes.windows(text.len()).any(|window| window == text.as_bytes());
    assert!(holds("/swarm/fitness/best") && !holds("/search/"), "panels of a search that there is not");
}

#[test]
fn a_file_that_cannot_be_written_is_an_error_with_its_name() {
    let error = open(&Target::File(PathBuf::from("/proc/no/folder/run.rrd")), &arm(), None, "example").unwrap_err();
    assert!(matches!(&error, ViewerError::Create { .. }), "{error:?}");
    assert_eq!(error.to_string(), "/proc/no/folder/run.rrd cannot be written: No such file or directory (os error 2)");
}

#[test]
fn a_viewer_that_is_not_there_is_an_error_and_an_address_that_is_none_too() {
    // A port that was free a moment ago.
    let port = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let connect =
        |url: String| open(&Target::Connect(Some(url)), &arm(), None, "example").map(|_: Option<Viewer>| ()).unwrap_err();
    let error = connect(format!("127.0.0.1:{port}"));
    assert!(matches!(&error, ViewerError::Absent { .. }), "{error:?}");
    assert!(error.to_string().contains("start one"), "{error}");
    assert!(matches!(connect("http://".to_owned()), ViewerError::Url { .. }));
    assert!(open(&Target::Off, &arm(), None, "example").unwrap().is_none());
}

#[test]
fn a_viewer_that_takes_nothing_holds_up_no_run() {
    // Accepts connections and never answers.
    let silent = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let url = silent.local_addr().unwrap().to_string();
    let (arm, events) = events(20, 40, 200, 20);
    let since = std::time::Instant::now();
    let mut viewer = open(&Target::Connect(Some(url)), &arm, Some(&problem(&events)), "example").unwrap().unwrap();
    for event in &events {
        viewer.report(event).unwrap();
    }
    assert!(matches!(viewer.finish(), Err(ViewerError::Lost { .. })));
    assert!(since.elapsed().as_secs_f64() < 12.0, "{:?}", since.elapsed());
}

/// Streams a run at the pace of a live one to the target that the environment names.
#[test]
#[ignore = "streams to $KINCAL_VIEWING_TARGET"]
fn live() {
    let target: Target = std::env::var("KINCAL_VIEWING_TARGET").unwrap().parse().unwrap();
    let (arm, events) = events(20, 40, 30, 20);
    let Some(mut viewer) = open(&target, &arm, Some(&problem(&events)), "example").unwrap_or_else(|error| panic!("{error}"))
    else {
        eprintln!("nobody looks");
        return;
    };
    eprintln!("{}", viewer.describe());
    let mut slowest = std::time::Duration::ZERO;
    for event in &events {
        let since = std::time::Instant::now();
        viewer.report(event).unwrap();
        slowest = slowest.max(since.elapsed());
        std::thread::sleep(std::time::Duration::from_millis(40));
    }
    let since = std::time::Instant::now();
    let outcome = viewer.finish();
    eprintln!("slowest event {slowest:?}, end {:?}: {outcome:?}", since.elapsed());
}

/// Writes recordings to look at, and says what they cost.
#[test]
#[ignore = "writes recordings for screenshots to $KINCAL_VIEWING_SAMPLES"]
fn samples() {
    let folder = PathBuf::from(std::env::var_os("KINCAL_VIEWING_SAMPLES").unwrap());
    std::fs::create_dir_all(&folder).unwrap();
    let (arm, run) = events(20, 40, 30, 20);
    write(&folder.join("run.rrd"), &arm, &run);
    write(&folder.join("half-swarm.rrd"), &arm, &run[..18]);
    write(&folder.join("half-measured.rrd"), &arm, &run[..64]);
    let (search_arm, search) = searched(40, 30, 20);
    write(&folder.join("search.rrd"), &search_arm, &search);
    let part = |command: &str, keep: fn(&Event) -> bool| -> Vec<Event> {
        let start =
            Start { version: "0.1.0".to_owned(), command: command.to_owned(), scene: String::new(), poses: None, real: None };
        std::iter::once(Event::Start(start)).chain(run[1..].iter().filter(|event| keep(event)).cloned()).collect()
    };
    write(&folder.join("design.rrd"), &arm, &part("design", |e| matches!(e, Event::Swarm(_) | Event::Designed(_))));
    write(&folder.join("measure.rrd"), &arm, &part("measure", |e| matches!(e, Event::Measured(_))));
    write(&folder.join("identify.rrd"), &arm, &part("identify", |e| matches!(e, Event::Measured(_) | Event::Identified(_))));

    let (arm, run) = events(20, 40, 200, 20);
    let since = std::time::Instant::now();
    write(&folder.join("long.rrd"), &arm, &run);
    eprintln!("200 iterations of 800 points: {:?}", since.elapsed());
}
