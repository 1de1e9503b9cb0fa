//! Every method, through one function.

use super::candidates::Rules;
use super::objective::{Models, Objective};
use super::outcome::StopReason;
use super::pool::PoolSet;
use super::search::{Found, SearchReport, Task, search};
use crate::design::problem::{Criterion, Method, Swarm};
use crate::scene::Scene;
use crate::seed::stream;

const COUNT: usize = 9;
const BUDGET: u64 = 600;
const POOL: usize = 60;
const CRITERIA: [Criterion; 3] = [Criterion::IOptimality, Criterion::Comprehensive, Criterion::Dispersion];

fn scene(name: &str) -> Scene {
    crate::scene::read(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name)).unwrap().scene
}

/// What a search found and told: best value and configurations of every step, the values that it spent and what it refused.
#[derive(Debug, PartialEq)]
struct Search {
    found: Found,
    bests: Vec<f64>,
    told: Vec<Vec<Vec<f64>>>,
    evaluations: u64,
    rejections: u64,
}

fn run(method: Method, criterion: Criterion, scene: &Scene, models: &Models, count: usize, budget: u64) -> Search {
    let rules = Rules::measurable(&scene.arm, &scene.sensor);
    let objective = Objective::new(models, criterion, scene.arm.joint_count());
    let task = Task::new(&rules, &objective, count, budget, POOL);
    let (mut bests, mut told) = (Vec::new(), Vec::new());
    let mut watch = |step: SearchReport| {
        let (best, configurations, evaluations) = match step {
            // The swarm tells the indexes of its best; the criterion's value is that of its best particle.
            SearchReport::Swarm(step) => {
                let best = step.personal_best.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                (best, step.best_configurations, step.evaluations)
            }
            SearchReport::Step(step) => (step.best, step.best_configurations, step.evaluations),
        };
        assert_eq!(evaluations, task.evaluations());
        bests.push(best);
        told.push(configurations);
        Ok(())
    };
    let swarm = Swarm { particles: 12, ..scene.design.swarm.clone() };
    let found = search(method, &task, &swarm, &mut stream(3, "test/methods"), &mut watch).unwrap();
    Search { found, bests, told, evaluations: task.evaluations(), rejections: task.rejections() }
}

#[test]
fn every_method_keeps_to_the_task() {
    let scene = scene("arm8.toml");
    let models = Models::new(&scene.request()).unwrap();
    let rules = Rules::measurable(&scene.arm, &scene.sensor);
    let joints = scene.arm.joint_count();
    let within =
        |configuration: &[f64]| scene.arm.within_limits(configuration) && !rules.refuses(configuration, &mut Default::default());
    for (criterion, method) in CRITERIA.into_iter().flat_map(|criterion| Method::ALL.map(|method| (criterion, method))) {
        let name = format!("{} by {}", criterion.name(), method.name());
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| run(method, criterion, &scene, &models, COUNT, BUDGET))
        };
        let result = with(1);
        assert_eq!(result, with(2), "{name}: the number of threads shows");
        // At most one batch more than the budget: all candidates of the pool, or one value for every joint of the set.
        assert!(result.evaluations <= BUDGET + POOL.max(COUNT * joints) as u64, "{name}: {}", result.evaluations);
        let least = if method == Method::Random { 1 } else { BUDGET };
        assert!(result.evaluations >= least, "{name} spends no more than {}", result.evaluations);

        let Found { configurations, value, stop } = &result.found;
        assert_eq!(configurations.len(), COUNT * joints, "{name}");
        assert!(configurations.chunks_exact(joints).all(within), "{name} returns what is against the rules");
        assert!(
            result.told.iter().flatten().all(|configuration| within(configuration)),
            "{name} tells what is against the rules"
        );
        assert!(result.told.iter().all(|set| set.is_empty() || set.len() == COUNT), "{name}");
        let fresh = Objective::new(&models, criterion, joints).value(configurations, &mut Default::default());
        assert!((fresh - value).abs() <= 1e-9 * fresh.abs(), "{name}: {value} is {fresh}");

        assert!(result.bests.windows(2).all(|pair| pair[1] >= pair[0]), "{name} tells a best that gets worse");
        assert_eq!(result.bests.last(), Some(value), "{name}");
        let last = result.told.iter().rfind(|set| !set.is_empty()).unwrap();
        assert_eq!(&last.concat(), configurations, "{name} returns another set than it told last");
        assert!(!result.told[0].is_empty(), "{name} does not tell its start");
        assert!(result.bests.len() <= 650, "{name} tells {} steps", result.bests.len());
        match method {
            Method::Random => assert_eq!(*stop, StopReason::Drawn),
            Method::Pso => assert!(matches!(stop, StopReason::IterationLimit | StopReason::Converged)),
            _ => assert_eq!(*stop, StopReason::BudgetSpent, "{name}"),
        }
    }
}

#[test]
fn sets_that_determine_nothing_and_budgets_of_nothing_do_no_harm() {
    let scene = scene("paper.toml");
    let models = Models::new(&scene.request()).unwrap();
    // Two configurations never determine the parameters: every O3 is zero, and all information is the ridge's.
    for criterion in [Criterion::O3, Criterion::DOptimality] {
        for (method, budget) in Method::ALL.into_iter().flat_map(|method| [0, 1, 7, 150].map(|budget| (method, budget))) {
            let result = run(method, criterion, &scene, &models, 2, budget);
            assert_eq!(result.found.configurations.len(), 2 * scene.arm.joint_count(), "{} {budget}", method.name());
            assert!(!result.found.value.is_nan());
            assert!(result.bests.windows(2).all(|pair| pair[1] >= pair[0]));
        }
    }
}

/// The paper's arm with only its first two joints free: end points on a surface of revolution about the base's z.
fn two_joints() -> Scene {
    let mut scene = scene("paper.toml");
    for joint in &mut scene.arm.chain.joints[2..] {
        (joint.lower, joint.upper) = (0.0, 0.0);
    }
    scene
}

#[test]
fn methods_come_close_to_a_dispersion_that_is_known() {
    let scene = two_joints();
    let models = Models::new(&scene.request()).unwrap();
    let rules = Rules::measurable(&scene.arm, &scene.sensor);
    // Radius² and height of the circles on which end points may lie. All points of a set with the greatest dispersion lie about
    // the axis: on two circles, k of 8 on one, the dispersion is the mean radius² and the variance of the height.
    let chain = scene.arm.chain.at_nominal();
    let limits = &scene.arm.chain.joints[1];
    let circles: Vec<[f64; 2]> = (0..=720)
        .map(|i| limits.lower + (limits.upper - limits.lower) * f64::from(i) / 720.0)
        .map(|angle| [0.0, angle, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
        .filter(|joints| !rules.refuses(joints, &mut Default::default()))
        .map(|joints| chain.jacobian(&joints).0.translation.vector)
        .map(|point| [point.x * point.x + point.y * point.y, point.z])
        .collect();
    let mut optimum: f64 = 0.0;
    for k in 0..=4 {
        let share = f64::from(k) / 8.0;
        for [square, height] in &circles {
            for [other_square, other_height] in &circles {
                let apart = height - other_height;
                optimum = optimum.max(share * square + (1.0 - share) * other_square + share * (1.0 - share) * apart * apart);
            }
        }
    }
    for method in Method::ALL {
        // Coordinate exchange spends six of eight visits on joints that cannot move. Repeating configurations is no loss here.
        let share = match method {
            Method::Random => 0.2,
            Method::BestOfRandom | Method::Detmax | Method::Pso => 0.85,
            Method::CoordinateExchange => 0.95,
            _ => 0.99,
        };
        let value = run(method, Criterion::Dispersion, &scene, &models, 8, 4000).found.value;
        assert!(value >= share * optimum && value <= optimum * 1.0005, "{}: {value} of {optimum}", method.name());
    }
}

#[test]
fn the_pools_formulas_are_what_sets_are_worth() {
    for name in ["arm8.toml", "paper.toml"] {
        let scene = scene(name);
        let models = Models::new(&scene.request()).unwrap();
        let rules = Rules::measurable(&scene.arm, &scene.sensor);
        let joints = scene.arm.joint_count();
        for criterion in [Criterion::DOptimality, Criterion::IOptimality] {
            let objective = Objective::new(&models, criterion, joints);
            let task = Task::new(&rules, &objective, 14, 0, POOL);
            let mut stream = stream(8, "test/pool");
            let pool = task.draw(&mut stream, POOL).unwrap();
            let configurations = |members: &[usize]| -> Vec<f64> {
                members.iter().flat_map(|member| &pool[member * joints..(member + 1) * joints]).copied().collect()
            };
            let value = |members: &[usize]| objective.value(&configurations(members), &mut Default::default());
            let mut set = PoolSet::new(&task, &pool, (0..14).collect());
            for change in 0..150 {
                let before = set.members().to_vec();
                // Up and down between 11 and 17 members.
                let trials: Vec<Vec<usize>> = if (change / 3) % 2 == 0 {
                    set.add_best();
                    (0..POOL).map(|member| before.iter().copied().chain([member]).collect()).collect()
                } else {
                    set.remove_worst();
                    (0..before.len()).map(|out| before[..out].iter().chain(&before[out + 1..]).copied().collect()).collect()
                };
                let best = trials.iter().map(|members| value(members)).fold(f64::NEG_INFINITY, f64::max);
                let fresh = value(set.members());
                assert!((set.value() - fresh).abs() <= 1e-8 * fresh.abs(), "{name} {change}: {} is {fresh}", set.value());
                assert!(fresh >= best - 1e-9 * best.abs(), "{name} {} {change}: {fresh}, not {best}", criterion.name());
            }
        }
    }
}
