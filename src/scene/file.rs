//! The scene file: TOML whose keys carry their units, as it is written by hand.
//!
//! These structures are the schema. Unknown keys are refused; every quantity is in the unit that its key ends in, and becomes SI
//! and radians once, when [`super::parse`] turns them into the validated types of [`super`]. The optional section `[injected]`
//! holds what is hidden from the analyser.

use std::collections::BTreeMap;
use std::fmt;

use serde::de::{self, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use crate::design::problem::{Criterion, Method};
use crate::diagnosis::settings::Settings;
use crate::simulation::effect::Moves;
use crate::simulation::plan::ApproachPolicy;

/// The whole file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneToml {
    /// Stem of output files: `a`–`z`, `0`–`9`, `-`, `_`.
    pub name: String,
    /// What the scene is for, in a sentence.
    #[serde(default)]
    pub description: String,
    /// Public seed, of design and held-out configurations; 0 … 2⁶³−1.
    pub seed: u64,
    /// `[arm]`
    pub arm: ArmToml,
    /// `[sensor]`
    pub sensor: SensorToml,
    /// `[design]`
    pub design: DesignToml,
    /// `[identification]`
    #[serde(default)]
    pub identification: IdentificationToml,
    /// `[plan]`
    pub plan: PlanToml,
    /// `[diagnosis]`: numbers that decide what a diagnosis says, where they are not as usual.
    #[serde(default, skip_serializing_if = "is_usual")]
    pub diagnosis: Settings,
    /// `[injected]`: what the simulated cell hides from the analyser. Absent where the scene is public.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub injected: Option<InjectedToml>,
}

fn is_usual(settings: &Settings) -> bool {
    *settings == Settings::default()
}

/// A file that holds nothing but `[injected]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct InjectedOnlyToml {
    pub(super) injected: InjectedToml,
}

/// `[arm]`: the nominal arm and its cell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArmToml {
    /// Name of the robot: letters, digits, `-`, `_`.
    pub name: String,
    /// How the frames are written.
    pub convention: Convention,
    /// With `urdf`: file that holds the arm, relative to the scene's folder. Reading the scene puts its text into `urdf`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub urdf_file: Option<String>,
    /// With `urdf`: the text itself, `'''<robot …>'''`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub urdf: Option<String>,
    /// With `urdf`: link at which the arm begins. Default: the root.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub urdf_base_link: Option<String>,
    /// With `urdf`: link at which it ends. Default: the only leaf.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub urdf_tip_link: Option<String>,
    /// Where the numbers come from; printed in every report.
    #[serde(default)]
    pub note: String,
    /// Acceleration of free fall in the base frame, m/s². Default: 9.81 downwards.
    #[serde(default = "standard_gravity")]
    pub gravity_m_s2: [f64; 3],
    /// Pairs of links that are never checked against each other. Neighbours never are.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub uncollidable: Vec<[String; 2]>,
    /// Six more parameters in front of the first frame: the base link in the chain's base (`world`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base: Option<SixToml>,
    /// Six more parameters behind the last frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tool: Option<SixToml>,
    /// What stands still before joint 1; its frame is the one in which frame 1 is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base_link: Option<LinkToml>,
    /// `[[arm.frame]]`: one per joint, base to tool, then the tool's. None with `urdf`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub frame: Vec<FrameToml>,
    /// `[[arm.fixture]]`: bodies of the cell.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub fixture: Vec<FixtureToml>,
}

fn standard_gravity() -> [f64; 3] {
    [0.0, 0.0, -9.81]
}

/// Conventions for frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Convention {
    /// `Rot(x, alpha) Trans(x, a) Rot(z, theta) Trans(z, d) Rot(y, beta)`; see [`crate::arm::mdh`].
    #[serde(rename = "mdh5")]
    Mdh5,
    /// A URDF, with six parameters for every joint that moves and for the tool; see [`crate::arm::urdf::import`].
    #[serde(rename = "urdf")]
    Urdf,
}

/// The six parameters of a frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SixToml {
    /// Translation, mm.
    pub xyz_mm: [f64; 3],
    /// Roll, pitch, yaw: `Rot(z, yaw) Rot(y, pitch) Rot(x, roll)`, degrees.
    pub rpy_deg: [f64; 3],
}

/// `[[arm.frame]]`: five parameters, the joint that moves in them, and the link that moves with the joint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrameToml {
    /// Turn about x, first.
    pub alpha_deg: f64,
    /// Shift along x.
    pub a_mm: f64,
    /// Turn about z; added to the reading of a revolute joint.
    pub theta_deg: f64,
    /// Shift along z; added to the reading of a prismatic joint.
    pub d_mm: f64,
    /// Turn about y, last. Default: 0.
    #[serde(default)]
    pub beta_deg: f64,
    /// The joint; absent in the last frame, the tool's, and only there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint: Option<JointToml>,
    /// The link. Its frame lies on the joint's axis, after the joint's motion and before theta, d and beta: the link runs from
    /// its origin along z by d, then along x (turned by theta) by the next frame's a. Absent: no mass, no shape.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub link: Option<LinkToml>,
}

/// A joint. Limits in degrees if it turns, in mm if it slides.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointToml {
    /// Name, unique.
    pub name: String,
    /// Default: revolute.
    #[serde(default)]
    pub kind: JointKindToml,
    /// Smallest reading that may be commanded; revolute only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lower_deg: Option<f64>,
    /// Largest reading; revolute only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub upper_deg: Option<f64>,
    /// Smallest reading; prismatic only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lower_mm: Option<f64>,
    /// Largest reading; prismatic only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub upper_mm: Option<f64>,
}

/// How a joint moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum JointKindToml {
    /// Turns about z.
    #[default]
    Revolute,
    /// Slides along z.
    Prismatic,
}

/// A link, in its link frame. Mass, centre of mass and inertia: all three or none.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinkToml {
    /// kg.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass_kg: Option<f64>,
    /// mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub centre_of_mass_mm: Option<[f64; 3]>,
    /// About the centre of mass, along the axes of the link frame, kg·m².
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inertia_kg_m2: Option<InertiaToml>,
    /// For collision and drawing.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shapes: Vec<ShapeToml>,
}

/// Elements of the inertia tensor; products default to 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct InertiaToml {
    pub xx: f64,
    pub yy: f64,
    pub zz: f64,
    #[serde(default)]
    pub xy: f64,
    #[serde(default)]
    pub xz: f64,
    #[serde(default)]
    pub yz: f64,
}

/// A shape: a table with one of these keys.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ShapeToml {
    /// A ball swept along a segment.
    Capsule(SegmentToml),
    /// A cylinder.
    Cylinder(SegmentToml),
    /// A cuboid.
    Box(BoxToml),
    /// A ball.
    Sphere(SphereToml),
}

/// A segment with a radius, mm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SegmentToml {
    /// One end of the axis (a capsule's caps reach beyond it), mm.
    pub from_mm: [f64; 3],
    /// The other end, mm.
    pub to_mm: [f64; 3],
    /// mm.
    pub radius_mm: f64,
}

/// A cuboid, mm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoxToml {
    /// mm.
    pub centre_mm: [f64; 3],
    /// Full edges, mm.
    pub size_mm: [f64; 3],
    /// Roll, pitch, yaw, degrees. Default: along the axes of the frame.
    #[serde(default)]
    pub rpy_deg: [f64; 3],
}

/// A ball, mm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SphereToml {
    /// mm.
    pub centre_mm: [f64; 3],
    /// mm.
    pub radius_mm: f64,
}

/// `[[arm.fixture]]`: a body of the cell that does not move; its shape is in the chain's base frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FixtureToml {
    /// Name for messages, unique.
    pub name: String,
    /// Links that may touch it: `base_link`, `link1`, …, or as the URDF calls them. Default: none.
    #[serde(default)]
    pub may_touch: Vec<String>,
    /// The shape.
    pub shape: ShapeToml,
}

/// `[sensor]`: what the data sheet declares, one sigma per axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorToml {
    /// What it is.
    pub name: String,
    /// Where it stands in the base frame, mm.
    pub position_mm: [f64; 3],
    /// Position noise at no distance, µm.
    pub position_noise_um: f64,
    /// Growth of the position noise with distance, µm per m. Default: 0.
    #[serde(default)]
    pub position_noise_um_per_m: f64,
    /// Orientation noise per axis, degrees. Absent: the sensor sees positions only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[serde(rename = "attitude_noise_deg")]
    pub orientation_noise_deg: Option<f64>,
    /// Noise of the temperature sensors on the moving links, K. Absent: there are none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature_noise_k: Option<f64>,
    /// The cone that it sees, its apex where it stands. Absent: it sees everything.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub view: Option<ViewToml>,
}

/// `sensor.view`: a cone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ViewToml {
    /// A point on its axis, in the base frame, mm.
    pub towards_mm: [f64; 3],
    /// Between its axis and its edge, degrees: more than 0, 180 (everything) at most.
    pub half_angle_deg: f64,
}

/// `[design]`: how many configurations are measured and how they are chosen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DesignToml {
    /// m: configurations that are measured and fitted; at least what eq. 30 asks for.
    pub count: usize,
    /// Default: perturbation, which won most situations of `kincal reproduce bake-off`.
    #[serde(default)]
    pub method: Method,
    /// What the method makes large. Default: i_optimality, which predicts the held-out error best there.
    #[serde(default)]
    pub criterion: Criterion,
    /// Values of the criterion after which a method stops at the latest (`pso` makes its iterations instead). Default: 20000.
    #[serde(default = "budget")]
    pub budget: u64,
    /// Random candidates of `detmax` and `perturbation`, and of the bound that no choice can beat. Default: 1000.
    #[serde(default = "pool")]
    pub pool: usize,
    /// Which points count as workspace in eq. 25. Default: reachable.
    #[serde(default)]
    pub evenness_domain: EvennessDomainToml,
    /// Step of the grid over the workspace, mm. Default: 100.
    #[serde(default = "evenness_step_mm")]
    pub evenness_step_mm: f64,
    /// How the error Jacobian is scaled before its singular values are taken. Default: si.
    #[serde(default)]
    pub jacobian_scaling: JacobianScalingToml,
    /// Random sets that the chosen one is compared with. Default: 30.
    #[serde(default = "random_sets")]
    pub random_sets: usize,
    /// `[design.swarm]`
    #[serde(default)]
    pub swarm: SwarmToml,
}

fn evenness_step_mm() -> f64 {
    100.0
}

fn budget() -> u64 {
    20_000
}

fn pool() -> usize {
    1000
}

fn random_sets() -> usize {
    30
}

/// Which points count as workspace.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EvennessDomainToml {
    /// What the arm's end reaches.
    #[default]
    Reachable,
    /// The cube around that.
    BoundingCube,
}

/// How the error Jacobian is scaled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum JacobianScalingToml {
    /// Metres and radians as they are, all configurations stacked: the paper's reading.
    #[default]
    Si,
    /// The same over the root of the number of configurations.
    PerPose,
    /// Every column of length one.
    Columns,
}

/// `[design.swarm]`: the particle swarm; the defaults are the paper's Table 5.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SwarmToml {
    /// N_Swrm. Default: 20.
    pub particles: usize,
    /// N_Iter. Default: 200.
    pub iterations: usize,
    /// ω_min and ω_max of eq. 37. Default: 0.4 and 0.95.
    pub inertia: [f64; 2],
    /// ξ of eq. 36. Default: 0.729.
    pub velocity_factor: f64,
    /// τ of eq. 38. Default: 1.
    pub tau: f64,
}

impl Default for SwarmToml {
    fn default() -> Self {
        SwarmToml { particles: 20, iterations: 200, inertia: [0.4, 0.95], velocity_factor: 0.729, tau: 1.0 }
    }
}

/// `[identification]`
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct IdentificationToml {
    /// Default: noise.
    pub weights: WeightsToml,
}

/// How residuals are weighted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum WeightsToml {
    /// Each over its declared sigma.
    #[default]
    Noise,
    /// Metres and radians alike, as in eq. 6.
    Unit,
}

/// `[plan]`: how the measuring is organised.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlanToml {
    /// Configurations that are measured but not fitted; they carry the reported error.
    pub held_out_count: usize,
    /// Whether these are read without noise, as the paper does (eq. 10). Default: no.
    #[serde(default)]
    pub held_out_exact: bool,
    /// From one reading to the next, s. Default: 10.
    #[serde(default = "seconds_per_pose")]
    pub seconds_per_pose: f64,
    /// At which the nominal arm is nominal, °C. Default: 20.
    #[serde(default = "reference_temperature_c")]
    pub reference_temperature_c: f64,
    /// Readings of each configuration, each approached anew. Default: 1; without repeats the noise cannot be told from the data.
    #[serde(default = "one")]
    pub repeats: usize,
    /// From which side the joints come. Default: direct.
    #[serde(default)]
    pub approach: ApproachPolicy,
    /// How far the last move is where the policy makes one; joints that turn. Default: 5.
    #[serde(default = "approach_travel")]
    pub approach_travel_deg: f64,
    /// The same for joints that slide. Default: 5.
    #[serde(default = "approach_travel")]
    pub approach_travel_mm: f64,
    /// From the end of a move to the reading, s. Default: 0.
    #[serde(default)]
    pub dwell_s: f64,
    /// Masses that the tool carries; configurations take them in turn. Default: none.
    #[serde(default = "no_payload")]
    pub payloads_kg: Vec<f64>,
    /// Whether payloads are measured one after the other. Default: no, in mixed order.
    #[serde(default)]
    pub payload_blocks: bool,
    /// `[plan.temperature]`; absent: nothing warms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature: Option<TemperatureToml>,
}

fn one() -> usize {
    1
}

fn approach_travel() -> f64 {
    5.0
}

fn no_payload() -> Vec<f64> {
    vec![0.0]
}

/// `[plan.temperature]`: course of the temperatures over the session.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TemperatureToml {
    /// Course over the session.
    pub profile: ThermalProfileToml,
    /// Largest rise over the reference temperature, K: one number, or one per link, base link first.
    pub rise_k: OneOrEach,
    /// Time constant with which a link follows, s: one number, or one per link. Default: 0, at once.
    #[serde(default = "at_once")]
    pub lag_s: OneOrEach,
    /// Largest rise of the air, K. Default: 0.
    #[serde(default)]
    pub ambient_rise_k: f64,
}

fn at_once() -> OneOrEach {
    OneOrEach::One(0.0)
}

fn seconds_per_pose() -> f64 {
    10.0
}

/// A text, or a whole number as its digits.
fn text_or_number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged, expecting = "a text or a whole number")]
    enum Key {
        Text(String),
        Number(i64),
    }
    Ok(match Key::deserialize(deserializer)? {
        Key::Text(text) => text,
        Key::Number(number) => number.to_string(),
    })
}

fn reference_temperature_c() -> f64 {
    20.0
}

/// `[injected]`: the truth. Never in a recording, never seen by the analyser.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InjectedToml {
    /// Key of everything that is drawn for the truth, combined with the scene's public seed: any text or whole number. Whoever
    /// guesses it can draw the truth from a recording; 32 random hexadecimal digits cannot be guessed.
    #[serde(deserialize_with = "text_or_number")]
    pub seed: String,
    /// `[injected.parameters]`; absent: none is wrong.
    #[serde(default)]
    pub parameters: ParametersToml,
    /// `[injected.noise]`; absent: as declared.
    #[serde(default)]
    pub noise: NoiseToml,
    /// `[[injected.effect]]`
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub effect: Vec<EffectToml>,
    /// Sections of earlier versions; refused with what to write instead.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thermal: Option<toml::Value>,
    /// As `thermal`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clearance: Option<toml::Value>,
}

/// `[injected.parameters]`: errors of the geometric parameters.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ParametersToml {
    /// Half width of the uniform errors of lengths, mm. Default: 0.
    pub length_mm: f64,
    /// Half width of the uniform errors of angles, degrees. Default: 0.
    pub angle_deg: f64,
    /// Errors given in place of drawn ones: `{ theta3_deg = 0.1, a2_mm = -0.3 }`.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub errors: BTreeMap<String, f64>,
}

/// `[[injected.effect]]`: something that is wrong with arm, cell or sensor besides the parameters. Which keys belong to which kind is
/// written in the table of kinds ([`crate::effects::Kind::descriptor`]), which `kincal effects` prints.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EffectToml {
    /// Kind of effect.
    pub kind: String,
    /// Name of the joint.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint: Option<String>,
    /// Name of the link.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub link: Option<String>,
    /// Name of the joint whose motion leaks.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// What drifts or steps. Default: base.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub moves: Option<Moves>,
    /// Periods per turn: 1 or 2.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub order: Option<u8>,
    /// N·m/rad.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness_nm_per_rad: Option<f64>,
    /// Nm/mrad³: torque per cube of the angle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cubic_nm_per_mrad3: Option<f64>,
    /// µrad per N·m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compliance_urad_per_nm: Option<f64>,
    /// Whether the link bends as a slender beam from its joint to the next. Default: false.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub beam: Option<bool>,
    /// µrad per N·m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gain_urad_per_nm: Option<f64>,
    /// Full width of the play.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub width_arcsec: Option<f64>,
    /// Amplitude of the angle error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub amplitude_arcsec: Option<f64>,
    /// Phase of the angle error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub phase_deg: Option<f64>,
    /// Gear ratio N.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ratio: Option<f64>,
    /// Error of the gear ratio.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ratio_error_urad_per_rad: Option<f64>,
    /// Leak from the source joint.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coupling_urad_per_rad: Option<f64>,
    /// Expansion, µm/m/K: one number, or one per link, base link first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expansion_um_per_m_per_k: Option<OneOrEach>,
    /// Drift of the joint's zero.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drift_urad_per_k: Option<f64>,
    /// Radius of the disc in which the joint's centre may lie.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radial_um: Option<f64>,
    /// Half width along the axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axial_um: Option<f64>,
    /// Radius of the disc of the tilt.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tilt_urad: Option<f64>,
    /// Of the base or sensor, in base axes; of the tool, in tool axes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub translation_um: Option<[f64; 3]>,
    /// The same as a rotation vector. Default: 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation_urad: Option<[f64; 3]>,
    /// Share of the session (0 to 1) after which it happens.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub after: Option<f64>,
    /// Relative error of the sensor's distances.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale_ppm: Option<f64>,
    /// Share of the readings, 0 to 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub share: Option<f64>,
    /// Noise of these readings over the declared one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub factor: Option<f64>,
    /// How far the output falls behind in the middle of the worn sector.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth_arcsec: Option<f64>,
    /// Middle of the worn sector.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub centre_deg: Option<f64>,
    /// Half of its width.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub half_width_deg: Option<f64>,
    /// Time constant.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_constant_s: Option<f64>,
    /// Way over which the memory fades.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub travel_deg: Option<f64>,
    /// Share of the last move that is left at the reading, parts per million.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lag_ppm: Option<f64>,
    /// Angles of a table of errors, rising.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angles_deg: Option<Vec<f64>>,
    /// Error of the joint angle at each of them, straight between them and none beyond.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub errors_arcsec: Option<Vec<f64>>,
    /// True minus recorded payload.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub excess_kg: Option<f64>,
}

/// Course of the temperature.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ThermalProfileToml {
    /// At its largest rise all the time.
    Constant,
    /// Rising all the time.
    WarmUp,
    /// Rising, then falling back.
    HeatAndCool,
}

/// One number for all links, or one for each.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum OneOrEach {
    /// The same for all.
    One(f64),
    /// Base link first.
    Each(Vec<f64>),
}

impl<'de> Deserialize<'de> for OneOrEach {
    // By hand, because an untagged enum could not say what it expects.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Seen;
        impl<'de> Visitor<'de> for Seen {
            type Value = OneOrEach;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number, or a list with one number per link")
            }

            fn visit_f64<E: de::Error>(self, value: f64) -> Result<OneOrEach, E> {
                Ok(OneOrEach::One(value))
            }

            fn visit_i64<E: de::Error>(self, value: i64) -> Result<OneOrEach, E> {
                Ok(OneOrEach::One(value as f64))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut entries: A) -> Result<OneOrEach, A::Error> {
                let mut values = Vec::new();
                while let Some(value) = entries.next_element()? {
                    values.push(value);
                }
                Ok(OneOrEach::Each(values))
            }
        }
        deserializer.deserialize_any(Seen)
    }
}

/// `[injected.noise]`: the noise that the readings really have.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NoiseToml {
    /// Default: declared.
    #[serde(default)]
    pub kind: NoiseKindToml,
    /// With `declared`: the declared sigmas times this. Default: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub factor: Option<f64>,
    /// With `uniform`: half width per axis, mm. Required there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position_mm: Option<f64>,
    /// With `uniform`: half width per axis, degrees. Required there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[serde(rename = "attitude_deg")]
    pub orientation_deg: Option<f64>,
}

/// Kinds of noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum NoiseKindToml {
    /// Normal, with the declared sigmas.
    #[default]
    Declared,
    /// Uniform.
    Uniform,
    /// None.
    Off,
}
