//! From the file's structures to validated types: units become SI here, once.

use nalgebra::{Matrix3, Point3, Translation3, UnitQuaternion, Vector3};

use super::Scene;
use super::effect_file;
use super::error::{Invalid, suggestion};
use super::file::*;
use super::urdf;
use crate::arm::frames::Pose;
use crate::arm::mdh::{self, Frame, SixParameters};
use crate::arm::urdf::rpy::{rotation_from_rpy, z_onto};
use crate::arm::{Arm, Fixture, Geometry, Inertial, Link, Shape};
use crate::arm::{Chain, Joint, JointKind, Quantity, Step};
use crate::design::problem::{DesignProblem, Swarm};
use crate::measurement::Weights;
use crate::measurement::{Sensor, View};
use crate::quality::{EvennessDomain, JacobianScaling};
use crate::simulation::injected::{Injected, Noise};
use crate::simulation::plan::{Approach, Plan, Temperature, ThermalProfile};

pub(super) type Checked<T> = Result<T, Invalid>;

fn metres_from_mm(mm: f64) -> f64 {
    mm / 1e3
}

fn metres_from_um(um: f64) -> f64 {
    um / 1e6
}

fn point_from_mm(mm: &[f64; 3]) -> Point3<f64> {
    Point3::from(mm.map(metres_from_mm))
}

/// The public part of a scene.
pub(super) fn scene(file: &SceneToml) -> Checked<Scene> {
    name(&file.name, "name", "names of output files come from it", &|c| {
        c.is_ascii_lowercase() || c.is_ascii_digit() || matches!(c, '-' | '_')
    })?;
    seed(file.seed, "seed")?;
    let (arm, urdf_notes) = arm(&file.arm)?;
    let sensor = sensor(&file.sensor)?;
    let weights = match file.identification.weights {
        WeightsToml::Noise => Weights::Noise,
        WeightsToml::Unit => Weights::Unit,
    };
    if weights == Weights::Noise {
        let unweighable = [
            ("sensor.position_noise_um", sensor.position_sigma_m),
            ("sensor.attitude_noise_deg", sensor.orientation_sigma_rad.unwrap_or(1.0)),
        ];
        if let Some((key, _)) = unweighable.iter().find(|(_, sigma)| *sigma == 0.0) {
            return Err(Invalid::new(
                *key,
                "0, with residuals weighted by their noise",
                "more than 0 where [identification] weights = \"noise\"",
                "declare the noise, or set [identification] weights = \"unit\"",
            ));
        }
    }
    let design = design(&file.design, &arm, &sensor)?;
    let plan = plan(&file.plan, &arm)?;
    let (configurations, most) = (design.count + plan.held_out_count, 1_000_000);
    if configurations * plan.repeats > most {
        return Err(Invalid::new(
            "plan.repeats",
            format!("{} readings of each of {configurations} configurations", plan.repeats),
            format!("{most} readings at most"),
            "measure fewer configurations, or each less often",
        ));
    }
    file.diagnosis
        .check()
        .map_err(|wrong| Invalid::new(wrong.key, wrong.found, wrong.allowed, "leave the line out for the usual value"))?;
    Ok(Scene {
        name: file.name.clone(),
        description: file.description.clone(),
        arm_note: file.arm.note.clone(),
        urdf_notes,
        sensor_name: file.sensor.name.clone(),
        seed: file.seed,
        arm,
        sensor,
        design,
        plan,
        diagnosis: file.diagnosis.clone(),
        weights,
    })
}

fn name(text: &str, key: &str, why: &str, allowed: &dyn Fn(char) -> bool) -> Checked<()> {
    if !text.is_empty() && text.len() <= 64 && !text.starts_with('-') && text.chars().all(allowed) {
        return Ok(());
    }
    let upper = if allowed('A') { "A-Z a-z" } else { "a-z" };
    Err(Invalid::new(
        key,
        format!("{text:?}"),
        format!("1 to 64 of {upper} 0-9 - _, not starting with -"),
        format!("choose another name: {why}"),
    ))
}

fn seed(seed: u64, key: &str) -> Checked<()> {
    if i64::try_from(seed).is_ok() {
        return Ok(());
    }
    let allowed = format!("0 to {} (TOML has no larger integers)", i64::MAX);
    Err(Invalid::new(key, seed.to_string(), allowed, "choose a smaller seed"))
}

pub(super) fn not_negative(value: f64, key: &str) -> Checked<f64> {
    if value >= 0.0 {
        return Ok(value);
    }
    Err(Invalid::new(key, value.to_string(), "0 or more", "give the amount without a sign"))
}

pub(super) fn positive(value: f64, key: &str) -> Checked<f64> {
    if value > 0.0 {
        return Ok(value);
    }
    Err(Invalid::new(key, value.to_string(), "more than 0", "give a positive number"))
}

/// A number of things: at least one, and no more than memory and patience allow.
fn count(value: usize, most: usize, key: &str, remedy: &str) -> Checked<usize> {
    if (1..=most).contains(&value) {
        return Ok(value);
    }
    Err(Invalid::new(key, value.to_string(), format!("1 or more, {most} at most"), remedy))
}

pub(super) fn at_most(value: f64, most: f64, key: &str) -> Checked<f64> {
    if value <= most {
        return Ok(value);
    }
    Err(Invalid::new(key, value.to_string(), format!("{most} at most"), "give a smaller number"))
}

/// A declared noise: none, or so much that its inverse square is a number to calculate with.
fn declared_noise(value: f64, key: &str) -> Checked<f64> {
    if not_negative(value, key)? == 0.0 || value >= 1e-6 {
        return Ok(value);
    }
    Err(Invalid::new(key, value.to_string(), "0, or 0.000001 or more", "give the noise of a sensor"))
}

/// Furthest that the arm may reach with every link stretched out, m: the workspace lies within.
fn reach(arm: &Arm) -> f64 {
    let lengths = arm.chain.parameters.iter().filter(|parameter| parameter.quantity == Quantity::Length);
    let slides = arm.chain.joints.iter().filter(|joint| joint.kind == JointKind::Prismatic);
    let fixed = arm.chain.steps.iter().filter_map(|step| match step {
        Step::Fixed(pose) => Some(pose.translation.vector.norm()),
        _ => None,
    });
    lengths.map(|length| length.nominal.abs()).sum::<f64>()
        + fixed.sum::<f64>()
        + slides.map(|joint| joint.lower.abs().max(joint.upper.abs())).sum::<f64>()
}

/// Chain and links of an arm that the scene writes frame by frame.
fn mdh5(file: &ArmToml) -> Checked<(Chain, Vec<Link>)> {
    urdf::without(file)?;
    let Some((tool, jointed)) = file.frame.split_last().filter(|(_, jointed)| !jointed.is_empty()) else {
        return Err(Invalid::new(
            "arm.frame",
            format!("{} frames", file.frame.len()),
            "one frame per joint and one for the tool: 2 or more",
            "add [[arm.frame]] sections",
        ));
    };
    let mut joints: Vec<Joint> = Vec::with_capacity(jointed.len());
    let mut links = vec![link(file.base_link.as_ref(), "base_link".to_owned(), "arm.base_link")?];
    for (index, frame) in jointed.iter().enumerate() {
        let key = format!("arm.frame[{}]", index + 1);
        let Some(joint_toml) = &frame.joint else {
            return Err(Invalid::new(
                format!("{key}.joint"),
                format!("no joint in frame {} of {}", index + 1, file.frame.len()),
                "every frame but the last, the tool's, has a joint: as many frames as joints and one more",
                "add joint = { name = …, lower_deg = …, upper_deg = … }, or remove the frame",
            ));
        };
        let joint = joint(joint_toml, &format!("{key}.joint"))?;
        if let Some(other) = joints.iter().position(|other| other.name == joint.name) {
            return Err(Invalid::new(
                format!("{key}.joint.name"),
                format!("{:?}, which is the name of joint {} too", joint.name, other + 1),
                "names that are unique",
                "rename one of them",
            ));
        }
        joints.push(joint);
        links.push(link(frame.link.as_ref(), format!("link{}", index + 1), &format!("{key}.link"))?);
    }
    let last = format!("arm.frame[{}]", file.frame.len());
    if tool.joint.is_some() {
        return Err(Invalid::new(
            format!("{last}.joint"),
            format!("a joint in the last of {} frames", file.frame.len()),
            "as many frames as joints and one more: the last is the tool's and has no joint",
            "add a last [[arm.frame]] without a joint, from the last joint to the tool",
        ));
    }
    if tool.link.is_some() {
        return Err(Invalid::new(
            format!("{last}.link"),
            "a link in the tool's frame",
            "no link: what is behind the last joint is one body",
            format!("move it into arm.frame[{}].link, whose frame lies on the last joint's axis", file.frame.len() - 1),
        ));
    }
    let frames: Vec<Frame> = file
        .frame
        .iter()
        .map(|frame| Frame {
            alpha: frame.alpha_deg.to_radians(),
            a: metres_from_mm(frame.a_mm),
            theta: frame.theta_deg.to_radians(),
            d: metres_from_mm(frame.d_mm),
            beta: frame.beta_deg.to_radians(),
        })
        .collect();
    let six = |six: &SixToml| SixParameters { xyz: six.xyz_mm.map(metres_from_mm), rpy: six.rpy_deg.map(f64::to_radians) };
    Ok((mdh::chain(&frames, joints, file.base.as_ref().map(six), file.tool.as_ref().map(six)), links))
}

/// The arm, and what of its URDF could not be taken over.
fn arm(file: &ArmToml) -> Checked<(Arm, Vec<String>)> {
    name(&file.name, "arm.name", "the exported URDF's robot is called so", &|c| {
        c.is_ascii_alphanumeric() || matches!(c, '-' | '_')
    })?;
    let (chain, links, notes) = match file.convention {
        Convention::Mdh5 => mdh5(file).map(|(chain, links)| (chain, links, Vec::new()))?,
        Convention::Urdf => urdf::arm(file).map(|imported| (imported.arm.chain, imported.arm.links, imported.notes))?,
    };
    let mut fixtures: Vec<Fixture> = Vec::with_capacity(file.fixture.len());
    for (index, fixture) in file.fixture.iter().enumerate() {
        let key = format!("arm.fixture[{}]", index + 1);
        if fixtures.iter().any(|other| other.name == fixture.name) {
            let found = format!("{:?}, which is the name of another fixture too", fixture.name);
            return Err(Invalid::new(format!("{key}.name"), found, "names that are unique", "rename one of them"));
        }
        let may_touch = fixture
            .may_touch
            .iter()
            .enumerate()
            .map(|(entry, name)| link_index(name, &links, &format!("{key}.may_touch[{}]", entry + 1)))
            .collect::<Checked<Vec<usize>>>()?;
        fixtures.push(Fixture { name: fixture.name.clone(), shape: shape(&fixture.shape, &format!("{key}.shape"))?, may_touch });
    }
    let mut uncollidable = Vec::with_capacity(file.uncollidable.len());
    for (index, [first, second]) in file.uncollidable.iter().enumerate() {
        let key = format!("arm.uncollidable[{}]", index + 1);
        let pair = (link_index(first, &links, &format!("{key}[1]"))?, link_index(second, &links, &format!("{key}[2]"))?);
        if pair.0 == pair.1 {
            return Err(Invalid::new(key, format!("{first:?} twice"), "two different links", "remove the pair"));
        }
        uncollidable.push((pair.0.min(pair.1), pair.0.max(pair.1)));
    }
    uncollidable.sort_unstable();
    uncollidable.dedup();
    let gravity_in_base = Vector3::from(file.gravity_m_s2);
    Ok((Arm { name: file.name.clone(), chain, links, fixtures, uncollidable, gravity_in_base }, notes))
}

fn link_index(name: &str, links: &[Link], key: &str) -> Checked<usize> {
    links.iter().position(|link| link.name == name).ok_or_else(|| {
        let names: Vec<&str> = links.iter().map(|link| link.name.as_str()).collect();
        let remedy = suggestion(name, &names).unwrap_or_else(|| "name a link of this arm".to_owned());
        Invalid::new(key, format!("{name:?}"), names.join(", "), remedy)
    })
}

fn joint(file: &JointToml, key: &str) -> Checked<Joint> {
    name(&file.name, &format!("{key}.name"), "the exported URDF's joint is called so", &|c| {
        c.is_ascii_alphanumeric() || matches!(c, '-' | '_')
    })?;
    let (kind, unit, wrong_unit, limits, wrong_limits) = match file.kind {
        JointKindToml::Revolute => {
            (JointKind::Revolute, "deg", "mm", [file.lower_deg, file.upper_deg], [file.lower_mm, file.upper_mm])
        }
        JointKindToml::Prismatic => {
            (JointKind::Prismatic, "mm", "deg", [file.lower_mm, file.upper_mm], [file.lower_deg, file.upper_deg])
        }
    };
    let kind_name = if kind == JointKind::Revolute { "revolute" } else { "prismatic" };
    let mut values = [0.0; 2];
    for (value, (side, (limit, wrong))) in
        values.iter_mut().zip(["lower", "upper"].iter().zip(limits.iter().zip(wrong_limits.iter())))
    {
        if wrong.is_some() {
            return Err(Invalid::new(
                format!("{key}.{side}_{wrong_unit}"),
                format!("`{side}_{wrong_unit}` of a {kind_name} joint"),
                format!("`{side}_{unit}`"),
                format!("did you mean `{side}_{unit}`? limits of {kind_name} joints are in {unit} here"),
            ));
        }
        *value = limit.ok_or_else(|| {
            Invalid::new(
                format!("{key}.{side}_{unit}"),
                format!("`{side}_{unit}` is missing"),
                format!("`lower_{unit}` and `upper_{unit}` are required: configurations are drawn between them"),
                format!("add `{side}_{unit} = …`"),
            )
        })?;
    }
    let [lower, upper] = values;
    if lower >= upper {
        return Err(Invalid::new(
            format!("{key}.lower_{unit}"),
            format!("lower limit {lower}, upper limit {upper}"),
            "a lower limit below the upper one",
            "exchange or correct the limits",
        ));
    }
    let convert = match kind {
        JointKind::Revolute => f64::to_radians,
        JointKind::Prismatic => metres_from_mm,
    };
    Ok(Joint { name: file.name.clone(), kind, lower: convert(lower), upper: convert(upper), mimic: None })
}

fn link(file: Option<&LinkToml>, name: String, key: &str) -> Checked<Link> {
    let Some(file) = file else {
        return Ok(Link { name, inertial: None, shapes: Vec::new() });
    };
    let inertial = match (file.mass_kg, &file.centre_of_mass_mm, &file.inertia_kg_m2) {
        (None, None, None) => None,
        (Some(mass_kg), Some(centre), Some(inertia)) => {
            let InertiaToml { xx, yy, zz, xy, xz, yz } = *inertia;
            let inertial = Inertial {
                mass_kg: positive(mass_kg, &format!("{key}.mass_kg"))?,
                centre_of_mass_in_link: point_from_mm(centre),
                inertia_in_link: Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz),
            };
            if let Some((found, allowed)) = inertial.impossible() {
                let remedy = "check the unit (kg·m², about the centre of mass) and the signs of the products";
                return Err(Invalid::new(format!("{key}.inertia_kg_m2"), found, allowed, remedy));
            }
            Some(inertial)
        }
        (mass, centre, inertia) => {
            let missing =
                [("mass_kg", mass.is_none()), ("centre_of_mass_mm", centre.is_none()), ("inertia_kg_m2", inertia.is_none())];
            let missing: Vec<&str> = missing.iter().filter(|(_, missing)| *missing).map(|(name, _)| *name).collect();
            return Err(Invalid::new(
                key,
                format!("`{}` missing", missing.join("` and `")),
                "mass_kg, centre_of_mass_mm and inertia_kg_m2: all three or none",
                "add what is missing",
            ));
        }
    };
    let shapes = file
        .shapes
        .iter()
        .enumerate()
        .map(|(index, file)| shape(file, &format!("{key}.shapes[{}]", index + 1)))
        .collect::<Checked<Vec<Shape>>>()?;
    Ok(Link { name, inertial, shapes })
}

fn shape(file: &ShapeToml, key: &str) -> Checked<Shape> {
    let segment = |segment: &SegmentToml, kind: &str| -> Checked<(Pose, f64, f64)> {
        let (from, to) = (point_from_mm(&segment.from_mm), point_from_mm(&segment.to_mm));
        let radius = metres_from_mm(positive(segment.radius_mm, &format!("{key}.{kind}.radius_mm"))?);
        let length = (to - from).norm();
        if length == 0.0 {
            return Err(Invalid::new(
                format!("{key}.{kind}.to_mm"),
                "both ends at one point",
                "two different ends",
                "use sphere = { centre_mm = …, radius_mm = … }",
            ));
        }
        let middle = nalgebra::center(&from, &to);
        Ok((Pose::from_parts(Translation3::from(middle.coords), z_onto(&((to - from) / length))), length / 2.0, radius))
    };
    Ok(match file {
        ShapeToml::Capsule(capsule) => {
            let (link_from_shape, half_length, radius) = segment(capsule, "capsule")?;
            Shape { link_from_shape, geometry: Geometry::Capsule { half_length, radius } }
        }
        ShapeToml::Cylinder(cylinder) => {
            let (link_from_shape, half_length, radius) = segment(cylinder, "cylinder")?;
            Shape { link_from_shape, geometry: Geometry::Cylinder { half_length, radius } }
        }
        ShapeToml::Box(cuboid) => {
            let mut half_extents = [0.0; 3];
            for (axis, (half, size)) in half_extents.iter_mut().zip(&cuboid.size_mm).enumerate() {
                *half = metres_from_mm(positive(*size, &format!("{key}.box.size_mm[{}]", axis + 1))?) / 2.0;
            }
            let rotation = rotation_from_rpy(cuboid.rpy_deg.map(f64::to_radians));
            let link_from_shape = Pose::from_parts(Translation3::from(point_from_mm(&cuboid.centre_mm).coords), rotation);
            Shape { link_from_shape, geometry: Geometry::Box { half_extents } }
        }
        ShapeToml::Sphere(sphere) => Shape {
            link_from_shape: Pose::from_parts(
                Translation3::from(point_from_mm(&sphere.centre_mm).coords),
                UnitQuaternion::identity(),
            ),
            geometry: Geometry::Sphere {
                radius: metres_from_mm(positive(sphere.radius_mm, &format!("{key}.sphere.radius_mm"))?),
            },
        },
    })
}

fn sensor(file: &SensorToml) -> Checked<Sensor> {
    Ok(Sensor {
        position_in_base: point_from_mm(&file.position_mm),
        position_sigma_m: metres_from_um(declared_noise(file.position_noise_um, "sensor.position_noise_um")?),
        position_sigma_per_m: metres_from_um(not_negative(file.position_noise_um_per_m, "sensor.position_noise_um_per_m")?),
        orientation_sigma_rad: file
            .orientation_noise_deg
            .map(|degrees| declared_noise(degrees, "sensor.attitude_noise_deg").map(f64::to_radians))
            .transpose()?,
        distances: Vec::new(),
        temperature_sigma_k: file
            .temperature_noise_k
            .map(|sigma| not_negative(sigma, "sensor.temperature_noise_k"))
            .transpose()?,
        view: file.view.as_ref().map(|view| self::view(view, &file.position_mm)).transpose()?,
    })
}

fn view(file: &ViewToml, position_mm: &[f64; 3]) -> Checked<View> {
    if file.towards_mm == *position_mm {
        return Err(Invalid::new(
            "sensor.view.towards_mm",
            format!("{:?}, where the sensor stands", file.towards_mm),
            "another point than sensor.position_mm: the axis of the cone runs through both",
            "give a point that the sensor looks at, such as the middle of the workspace",
        ));
    }
    let half_angle_deg = file.half_angle_deg;
    if !(half_angle_deg > 0.0 && half_angle_deg <= 180.0) {
        return Err(Invalid::new(
            "sensor.view.half_angle_deg",
            half_angle_deg.to_string(),
            "more than 0, 180 at most",
            "give the angle between the axis and the edge of the cone",
        ));
    }
    Ok(View { towards_in_base: point_from_mm(&file.towards_mm), half_angle_rad: half_angle_deg.to_radians() })
}

fn design(file: &DesignToml, arm: &Arm, sensor: &Sensor) -> Checked<DesignProblem> {
    let parameters = arm.chain.parameters.len();
    let (equations, seen) = if sensor.orientation_sigma_rad.is_some() { (6, "a pose") } else { (3, "a position") };
    let least = parameters.div_ceil(equations);
    if file.count < least {
        return Err(Invalid::new(
            "design.count",
            file.count.to_string(),
            format!("{least} or more: {seen} gives {equations} equations and the arm has {parameters} parameters (eq. 30)"),
            format!("set count = {least} or more"),
        ));
    }
    let swarm = &file.swarm;
    let step_m = metres_from_mm(positive(file.evenness_step_mm, "design.evenness_step_mm")?);
    let (reach_m, most_steps) = (reach(arm), 300.0);
    if step_m < 2.0 * reach_m / most_steps {
        return Err(Invalid::new(
            "design.evenness_step_mm",
            file.evenness_step_mm.to_string(),
            format!(
                "{:.1} or more: the stretched arm reaches {reach_m:.1} m, and the grid has {most_steps} steps at most",
                2e3 * reach_m / most_steps
            ),
            "give a larger step, or check the lengths of the arm",
        ));
    }
    let [least_inertia, most_inertia] = swarm.inertia;
    if !(0.0 <= least_inertia && least_inertia <= most_inertia && most_inertia <= 10.0) {
        return Err(Invalid::new(
            "design.swarm.inertia",
            format!("[{least_inertia}, {most_inertia}]"),
            "[ω_min, ω_max] with 0 ≤ ω_min ≤ ω_max ≤ 10",
            "put the smaller one first",
        ));
    }
    Ok(DesignProblem {
        count: count(file.count, 10_000, "design.count", "measure fewer configurations")?,
        method: file.method,
        criterion: file.criterion,
        budget: count(
            usize::try_from(file.budget).unwrap_or(usize::MAX),
            1_000_000_000,
            "design.budget",
            "or use method = \"random\"",
        )? as u64,
        pool: count(file.pool, 100_000, "design.pool", "give the search candidates")?,
        swarm: Swarm {
            particles: count(swarm.particles, 1000, "design.swarm.particles", "give the swarm particles")?,
            iterations: count(swarm.iterations, 1_000_000, "design.swarm.iterations", "or use method = \"random\"")?,
            inertia: swarm.inertia,
            velocity_factor: at_most(
                positive(swarm.velocity_factor, "design.swarm.velocity_factor")?,
                100.0,
                "design.swarm.velocity_factor",
            )?,
            tau: at_most(positive(swarm.tau, "design.swarm.tau")?, 1000.0, "design.swarm.tau")?,
        },
        evenness_domain: match file.evenness_domain {
            EvennessDomainToml::Reachable => EvennessDomain::Reachable,
            EvennessDomainToml::BoundingCube => EvennessDomain::BoundingCube,
        },
        evenness_step_m: step_m,
        jacobian_scaling: match file.jacobian_scaling {
            JacobianScalingToml::Si => JacobianScaling::Si,
            JacobianScalingToml::PerPose => JacobianScaling::PerPose,
            JacobianScalingToml::Columns => JacobianScaling::Columns,
        },
        random_sets: count(file.random_sets, 1000, "design.random_sets", "the chosen set is compared with random ones")?,
    })
}

fn plan(file: &PlanToml, arm: &Arm) -> Checked<Plan> {
    let reference_temperature_c = file.reference_temperature_c;
    if reference_temperature_c <= ABSOLUTE_ZERO_C {
        return Err(Invalid::new(
            "plan.reference_temperature_c",
            reference_temperature_c.to_string(),
            "more than -273.15",
            "temperatures are in °C here",
        ));
    }
    Ok(Plan {
        held_out_count: count(file.held_out_count, 100_000, "plan.held_out_count", "the reported error comes from these")?,
        held_out_exact: file.held_out_exact,
        seconds_per_pose: at_most(positive(file.seconds_per_pose, "plan.seconds_per_pose")?, 1e6, "plan.seconds_per_pose")?,
        reference_temperature_c,
        repeats: count(file.repeats, 1000, "plan.repeats", "each configuration is read so many times")?,
        approach: Approach {
            policy: file.approach,
            travel_rad: positive(file.approach_travel_deg, "plan.approach_travel_deg")?.to_radians(),
            travel_m: metres_from_mm(positive(file.approach_travel_mm, "plan.approach_travel_mm")?),
        },
        dwell_s: dwell(file)?,
        payloads_kg: payloads(&file.payloads_kg)?,
        payload_blocks: file.payload_blocks,
        temperature: file.temperature.as_ref().map(|file| temperature(file, reference_temperature_c, arm)).transpose()?,
    })
}

fn dwell(file: &PlanToml) -> Checked<f64> {
    if not_negative(file.dwell_s, "plan.dwell_s")? <= file.seconds_per_pose {
        return Ok(file.dwell_s);
    }
    Err(Invalid::new(
        "plan.dwell_s",
        file.dwell_s.to_string(),
        format!("seconds_per_pose = {} at most: the next reading comes then", file.seconds_per_pose),
        "give a smaller number, or raise seconds_per_pose",
    ))
}

fn payloads(file: &[f64]) -> Checked<Vec<f64>> {
    let key = "plan.payloads_kg";
    if file.is_empty() {
        return Err(Invalid::new(key, "an empty list", "one mass or more", "write [0] for a tool that carries nothing"));
    }
    let payload = |(index, mass): (usize, &f64)| {
        let key = format!("{key}[{}]", index + 1);
        at_most(not_negative(*mass, &key)?, 1e3, &key)
    };
    file.iter().enumerate().map(payload).collect()
}

/// 0 K in °C.
const ABSOLUTE_ZERO_C: f64 = -273.15;

fn temperature(file: &TemperatureToml, reference_c: f64, arm: &Arm) -> Checked<Temperature> {
    let warm_enough = |rise: f64, of: &str, key: &str| {
        if reference_c + rise > ABSOLUTE_ZERO_C {
            return Ok(rise);
        }
        let found = format!("{rise}, which makes {} °C of {of}", reference_c + rise);
        Err(Invalid::new(
            key,
            found,
            format!("more than {}", ABSOLUTE_ZERO_C - reference_c),
            "there is nothing below absolute zero",
        ))
    };
    // Lists are base link first, keys count from 1 and links from the base, which is 0.
    let of_link = |values: &OneOrEach, index: usize, key: &str| match values {
        OneOrEach::One(_) => (key.to_owned(), "every link".to_owned()),
        OneOrEach::Each(_) => (format!("{key}[{}]", index + 1), format!("link {index}")),
    };
    let rise = |(index, rise): (usize, f64)| {
        let (key, link) = of_link(&file.rise_k, index, "plan.temperature.rise_k");
        warm_enough(rise, &link, &key)
    };
    let lag = |(index, lag): (usize, f64)| {
        let (key, _) = of_link(&file.lag_s, index, "plan.temperature.lag_s");
        at_most(not_negative(lag, &key)?, 1e6, &key)
    };
    let rise_k = each_link(&file.rise_k, "plan.temperature.rise_k", arm)?;
    let lag_s = each_link(&file.lag_s, "plan.temperature.lag_s", arm)?;
    Ok(Temperature {
        profile: match file.profile {
            ThermalProfileToml::Constant => ThermalProfile::Constant,
            ThermalProfileToml::WarmUp => ThermalProfile::WarmUp,
            ThermalProfileToml::HeatAndCool => ThermalProfile::HeatAndCool,
        },
        rise_k: rise_k.into_iter().enumerate().map(rise).collect::<Checked<_>>()?,
        lag_s: lag_s.into_iter().enumerate().map(lag).collect::<Checked<_>>()?,
        ambient_rise_k: warm_enough(file.ambient_rise_k, "the air", "plan.temperature.ambient_rise_k")?,
    })
}

/// What of the hidden part depends on the plan.
pub(super) fn together(injected: &InjectedToml, plan: &Plan) -> Checked<()> {
    let lightest = plan.payloads_kg.iter().fold(f64::INFINITY, |least, payload| least.min(*payload));
    for (index, effect) in injected.effect.iter().enumerate() {
        if let Some(excess) = effect.excess_kg.filter(|excess| excess + lightest < 0.0) {
            return Err(Invalid::new(
                format!("injected.effect[{}].excess_kg", index + 1),
                excess.to_string(),
                format!("{} or more: the tool carries {lightest} kg at least (plan.payloads_kg)", -lightest),
                "no payload weighs less than nothing",
            ));
        }
    }
    Ok(())
}

/// The hidden part, checked against the arm it is about.
pub(super) fn injected(file: &InjectedToml, arm: &Arm) -> Checked<Injected> {
    let parameters = &file.parameters;
    let mut parameter_errors = Vec::with_capacity(parameters.errors.len());
    for (key, value) in &parameters.errors {
        parameter_errors.push(parameter_error(key, *value, arm)?);
    }
    // In column order, whatever the order of the file.
    parameter_errors.sort_by_key(|(name, _)| arm.chain.parameters.iter().position(|parameter| parameter.name == *name));
    let moved = [
        (
            "thermal",
            file.thermal.is_some(),
            "its course belongs into [plan.temperature] (profile, rise_k), its expansion into an \
          [[injected.effect]] with kind = \"link_thermal_growth\" and expansion_um_per_m_per_k",
        ),
        ("clearance", file.clearance.is_some(), "write [[injected.effect]] with kind = \"clearance\" and the same keys"),
    ];
    if let Some((name, _, remedy)) = moved.into_iter().find(|(_, given, _)| *given) {
        let found = format!("a section `{name}` of an earlier version");
        return Err(Invalid::new(format!("injected.{name}"), found, "parameters, effect, noise", remedy));
    }
    let mut effects = Vec::with_capacity(file.effect.len());
    for (index, effect) in file.effect.iter().enumerate() {
        effects.extend(effect_file::effects(effect, &format!("injected.effect[{}]", index + 1), arm)?);
    }
    Ok(Injected {
        seed: file.seed.clone(),
        length_error_m: metres_from_mm(not_negative(parameters.length_mm, "injected.parameters.length_mm")?),
        angle_error_rad: not_negative(parameters.angle_deg, "injected.parameters.angle_deg")?.to_radians(),
        parameter_errors,
        effects,
        noise: noise(&file.noise)?,
    })
}

fn parameter_error(key: &str, value: f64, arm: &Arm) -> Checked<(String, f64)> {
    let path = format!("injected.parameters.errors.{key}");
    let unit_of = |quantity| match quantity {
        Quantity::Length => "mm",
        Quantity::Angle => "deg",
    };
    let names: Vec<String> =
        arm.chain.parameters.iter().map(|parameter| format!("{}_{}", parameter.name, unit_of(parameter.quantity))).collect();
    let Some(parameter) = names.iter().position(|name| name == key) else {
        let all: Vec<&str> = names.iter().map(String::as_str).collect();
        let remedy = suggestion(key, &all).unwrap_or_else(|| "name a parameter of this arm, with its unit".to_owned());
        return Err(Invalid::new(path, format!("unknown parameter `{key}`"), all.join(", "), remedy));
    };
    let parameter = &arm.chain.parameters[parameter];
    let value = match parameter.quantity {
        Quantity::Length => metres_from_mm(value),
        Quantity::Angle => value.to_radians(),
    };
    Ok((parameter.name.clone(), value))
}

/// One number for every link, or one for each, base link first.
pub(super) fn each_link(values: &OneOrEach, key: &str, arm: &Arm) -> Checked<Vec<f64>> {
    match values {
        OneOrEach::One(value) => Ok(vec![*value; arm.links.len()]),
        OneOrEach::Each(values) if values.len() == arm.links.len() => Ok(values.clone()),
        OneOrEach::Each(values) => Err(Invalid::new(
            key,
            format!("{} numbers", values.len()),
            format!("one number, or {}: one per link, base link first", arm.links.len()),
            "give as many as there are links",
        )),
    }
}

fn noise(file: &NoiseToml) -> Checked<Noise> {
    let kind = match file.kind {
        NoiseKindToml::Declared => "declared",
        NoiseKindToml::Uniform => "uniform",
        NoiseKindToml::Off => "off",
    };
    let given = [
        ("factor", file.factor.is_some(), file.kind == NoiseKindToml::Declared),
        ("position_mm", file.position_mm.is_some(), file.kind == NoiseKindToml::Uniform),
        ("attitude_deg", file.orientation_deg.is_some(), file.kind == NoiseKindToml::Uniform),
    ];
    if let Some((name, ..)) = given.iter().find(|(_, given, fits)| *given && !fits) {
        return Err(Invalid::new(
            format!("injected.noise.{name}"),
            format!("`{name}` with kind = {kind:?}"),
            "factor with kind = \"declared\"; position_mm and attitude_deg with kind = \"uniform\"",
            "remove the key or change the kind",
        ));
    }
    let required = |value: Option<f64>, name: &str| {
        let key = format!("injected.noise.{name}");
        let value = value.ok_or_else(|| {
            let allowed = "position_mm and attitude_deg with kind = \"uniform\"";
            Invalid::new(key.clone(), format!("`{name}` is missing"), allowed, format!("add `{name} = …` (0 is allowed)"))
        })?;
        not_negative(value, &key)
    };
    Ok(match file.kind {
        NoiseKindToml::Declared => {
            let key = "injected.noise.factor";
            Noise::Declared { factor: at_most(not_negative(file.factor.unwrap_or(1.0), key)?, 1e6, key)? }
        }
        NoiseKindToml::Uniform => Noise::Uniform {
            position_m: metres_from_mm(required(file.position_mm, "position_mm")?),
            orientation_rad: required(file.orientation_deg, "attitude_deg")?.to_radians(),
        },
        NoiseKindToml::Off => Noise::Off,
    })
}
