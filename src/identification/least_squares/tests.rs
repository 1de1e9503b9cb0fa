use super::*;
use crate::arm::frames::rotation_from_vector;
use crate::measurement::Role;
use crate::scene::SceneFile;
use crate::seed::{Stream, stream};

fn scene(name: &str) -> SceneFile {
    crate::scene::read(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name)).unwrap()
}

/// Values at up to `length` m and `angle` rad from nominal.
fn true_values(arm: &Arm, length: f64, angle: f64, stream: &mut Stream) -> Vec<f64> {
    let width = |unit: &str| if unit == "m" { length } else { angle };
    let parameters = arm.chain.parameters.iter();
    parameters.map(|p| p.nominal + width(p.quantity.unit()) * stream.uniform(-1.0, 1.0)).collect()
}

fn measure(arm: &Arm, values: &[f64], count: usize, sigma: [f64; 2], orientation: bool, stream: &mut Stream) -> Vec<Measurement> {
    let chain = arm.chain.at(values);
    (0..count)
        .map(|index| {
            let joints: Vec<f64> = arm.chain.joints.iter().map(|joint| stream.uniform(joint.lower, joint.upper)).collect();
            let pose = chain.forward(&joints);
            let position = pose.translation.vector + Vector3::from_fn(|_, _| sigma[0] * stream.normal());
            let q = rotation_from_vector(&Vector3::from_fn(|_, _| sigma[1] * stream.normal())) * pose.rotation;
            Measurement {
                index,
                pose_id: index,
                role: if index % 3 == 2 { Role::HeldOut } else { Role::Fit },
                time_s: index as f64,
                joints,
                temperatures_c: Vec::new(),
                position_m: position.into(),
                orientation_xyzw: orientation.then_some([q.i, q.j, q.k, q.w]),
                ..Measurement::default()
            }
        })
        .collect()
}

fn sensor(sigma: [f64; 2], orientation: bool) -> Sensor {
    Sensor {
        position_in_base: nalgebra::Point3::origin(),
        position_sigma_m: sigma[0],
        position_sigma_per_m: 0.0,
        orientation_sigma_rad: orientation.then_some(sigma[1]),
        temperature_sigma_k: None,
        distances: Vec::new(),
        view: None,
    }
}

#[test]
fn exact_poses_of_any_true_arm_are_predicted_exactly_whatever_was_dropped() {
    let arm = scene("paper.toml").scene.arm;
    let mut stream = stream(1, "test/exact");
    for orientation in [true, false] {
        for _ in 0..5 {
            let values = true_values(&arm, 0.03, 1.72f64.to_radians(), &mut stream);
            let measured = measure(&arm, &values, 60, [0.0, 0.0], orientation, &mut stream);
            let result = identify(&arm, &sensor([1e-5, 1e-5], orientation), Weights::Noise, &measured).unwrap();
            assert!(result.converged, "{}", result.reason);
            assert_eq!(result.rank, if orientation { 36 } else { 33 });
            let held_out = result.held_out.unwrap();
            assert!(held_out.position_m.max < 1e-11, "{:e}", held_out.position_m.max);
            if let Some(rotation) = held_out.rotation_rad {
                assert!(rotation.max < 1e-11, "{:e}", rotation.max);
            }
            assert!(result.held_out_nominal.unwrap().position_m.mean > 0.02);
        }
    }
}

/// A small version of the coverage check: 95 % intervals must hold the truth 95 times in 100, however large the errors are. The
/// truth of a combination is what its parameter becomes when the exact poses of the true arm are fitted with the same parameters
/// held at nominal.
#[test]
fn intervals_cover_the_true_combinations() {
    for (name, length, angle_deg, sigma) in [("arm8.toml", 1e-3, 0.2f64, [20e-6, 5e-5]), ("paper.toml", 0.03, 1.72, [1e-3, 1e-3])]
    {
        let arm = scene(name).scene.arm;
        let (mut inside, mut total) = (0, 0);
        for trial in 0..40 {
            let mut stream = stream(trial, "test/coverage");
            let values = true_values(&arm, length, angle_deg.to_radians(), &mut stream);
            let exact = measure(&arm, &values, 60, [0.0, 0.0], true, &mut stream);
            let mut noisy = exact.clone();
            for row in &mut noisy {
                let q = rotation_from_vector(&Vector3::from_fn(|_, _| sigma[1] * stream.normal())) * row.orientation().unwrap();
                row.orientation_xyzw = Some([q.i, q.j, q.k, q.w]);
                row.position_m.iter_mut().for_each(|value| *value += sigma[0] * stream.normal());
            }
            let sensor = sensor(sigma, true);
            let truth = identify(&arm, &sensor, Weights::Noise, &exact).unwrap();
            let result = identify(&arm, &sensor, Weights::Noise, &noisy).unwrap();
            assert!(result.converged && truth.converged);
            for (combination, truth) in result.combinations.iter().zip(&truth.combinations) {
                assert_eq!(combination.name, truth.name);
                inside += u32::from((combination.interval95[0]..=combination.interval95[1]).contains(&truth.estimate));
                total += 1;
            }
        }
        let coverage = f64::from(inside) / f64::from(total);
        assert!((0.93..=0.97).contains(&coverage), "{name}: {coverage:.3} of {total}");
    }
}

/// To first order the combination is the expression that is printed.
#[test]
fn an_expression_is_what_the_independent_parameter_takes_up() {
    let arm = scene("arm8.toml").scene.arm;
    let mut stream = stream(9, "test/expression");
    let values = true_values(&arm, 1e-5, 1e-5, &mut stream);
    let exact = measure(&arm, &values, 60, [0.0, 0.0], true, &mut stream);
    let result = identify(&arm, &sensor([1e-6, 1e-6], true), Weights::Noise, &exact).unwrap();
    let subspace = Subspace::of_structure(&arm, true);
    for (position, combination) in result.combinations.iter().enumerate() {
        let change = |column: usize| values[column] - arm.chain.parameters[column].nominal;
        let column = subspace.independent[position];
        assert_eq!(combination.name, arm.chain.parameters[column].name);
        let shared =
            subspace.dropped.iter().enumerate().map(|(other, dropped)| subspace.share[(position, other)] * change(*dropped));
        let expected = change(column) + shared.sum::<f64>();
        assert!(
            (combination.estimate - expected).abs() < 2e-9,
            "{}: {} is not {expected}",
            combination.expression,
            combination.estimate
        );
    }
}

#[test]
fn standard_errors_are_the_scatter_of_the_estimates_with_either_weights() {
    let arm = scene("paper.toml").scene.arm;
    let sigma = [2e-4, 3e-4];
    for weights in [Weights::Noise, Weights::Unit] {
        let mut draw = stream(3, "test/scatter");
        let values = true_values(&arm, 1e-3, 1e-3, &mut draw);
        let template = measure(&arm, &values, 60, [0.0, 0.0], true, &mut draw);
        let mut estimates: Vec<Vec<f64>> = Vec::new();
        let mut declared = Vec::new();
        for _ in 0..80 {
            let mut measured = template.clone();
            for row in &mut measured {
                let orientation = row.orientation().unwrap();
                let q = rotation_from_vector(&Vector3::from_fn(|_, _| sigma[1] * draw.normal())) * orientation;
                row.orientation_xyzw = Some([q.i, q.j, q.k, q.w]);
                row.position_m.iter_mut().for_each(|value| *value += sigma[0] * draw.normal());
            }
            let result = identify(&arm, &sensor(sigma, true), weights, &measured).unwrap();
            estimates.push(result.combinations.iter().map(|c| c.estimate).collect());
            declared = result.combinations.iter().map(|c| c.standard_error).collect();
        }
        let n = estimates.len() as f64;
        let mut ratios = 0.0;
        for (column, standard_error) in declared.iter().enumerate() {
            let mean = estimates.iter().map(|e| e[column]).sum::<f64>() / n;
            let variance = estimates.iter().map(|e| (e[column] - mean).powi(2)).sum::<f64>() / (n - 1.0);
            ratios += variance / standard_error.powi(2) / declared.len() as f64;
        }
        // The mean of 36 variance ratios of 80 draws each scatters by about 3 %.
        assert!((0.88..1.12).contains(&ratios), "{weights:?}: {ratios}");
    }
}

#[test]
fn too_little_or_unfit_data_is_refused() {
    let arm = scene("paper.toml").scene.arm;
    let mut stream = stream(4, "test/few");
    let measured = measure(&arm, &arm.chain.nominal(), 7, [0.0, 0.0], true, &mut stream);
    let refused = identify(&arm, &sensor([1e-5, 1e-5], true), Weights::Noise, &measured).expect_err("30 equations");
    assert_eq!(refused, IdentificationError::TooFew { poses: 5, equations: 30, rank: 36, needed: 6 });
    let refused = identify(&arm, &sensor([1e-5, 0.0], true), Weights::Noise, &measured).unwrap_err();
    assert_eq!(refused, IdentificationError::NoNoise { what: "orientation" });
    let mut short = measured.clone();
    short[3].joints.pop();
    let refused = identify(&arm, &sensor([1e-5, 1e-5], true), Weights::Noise, &short).unwrap_err();
    assert_eq!(refused, IdentificationError::JointCount { index: 3, found: 7, expected: 8 });
}

#[test]
fn poses_that_are_all_the_same_are_refused() {
    let arm = scene("paper.toml").scene.arm;
    let mut stream = stream(5, "test/same");
    let mut measured = measure(&arm, &arm.chain.nominal(), 30, [0.0, 0.0], true, &mut stream);
    let first = measured[0].clone();
    measured.iter_mut().for_each(|row| *row = Measurement { index: row.index, role: row.role, ..first.clone() });
    let result = identify(&arm, &sensor([1e-5, 1e-5], true), Weights::Noise, &measured).unwrap();
    // One configuration shows six combinations, and the rank says so.
    assert_eq!(result.rank, 6);
    assert!(result.notes[0].contains("of the 36 combinations"), "{:?}", result.notes);
}

#[test]
fn noise_larger_than_declared_is_noticed_and_widens_the_intervals() {
    let arm = scene("paper.toml").scene.arm;
    let mut stream = stream(6, "test/larger");
    let measured = measure(&arm, &arm.chain.nominal(), 60, [3e-5, 3e-5], true, &mut stream);
    let result = identify(&arm, &sensor([1e-5, 1e-5], true), Weights::Noise, &measured).unwrap();
    assert!((2.5..3.5).contains(&result.residual_scale.unwrap()), "{:?}", result.residual_scale);
    assert!(result.notes.iter().any(|note| note.contains("times what the declared noise allows")));
    let right = identify(&arm, &sensor([3e-5, 3e-5], true), Weights::Noise, &measured).unwrap();
    let ratio = result.combinations[0].standard_error / right.combinations[0].standard_error;
    assert!((0.8..1.25).contains(&ratio), "{ratio}");
}
