//! The topics of a recording and their schemas.

use std::borrow::Cow;

use foxglove::Encode;
use foxglove::messages::{FrameTransforms, JointStates, Log, PointCloud, PoseInFrame, PosesInFrame, SceneUpdate};

/// A topic of a recording. Poses and points are in the arm's root frame (`base_link`, or `world` where there is one), m.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Topic {
    /// What the run was; source of [`super::event::Event::Start`].
    Run,
    /// Shapes of links and fixtures, in link frames.
    Shapes,
    /// The arm's surfaces, its frames' axes and the measured pose's as coloured points, for viewers that draw clouds only: at zero,
    /// then at each measured configuration (nominal arm).
    ArmPoints,
    /// Link frames of the nominal arm: at zero, then at the joint readings of each measured configuration.
    Transforms,
    /// An iteration of the swarm without its end points.
    Swarm,
    /// End points of every particle; belongs to [`Topic::Swarm`] and is recorded nowhere else.
    SwarmEndPoints,
    /// A step of a search by any other method.
    Search,
    /// End points of the best set so far, when it changes (nominal arm).
    BestEndPoints,
    /// The chosen set.
    Design,
    /// Tool poses of the chosen configurations (nominal arm).
    Chosen,
    /// A measured configuration.
    Measurement,
    /// Its joint readings, by joint name.
    JointReadings,
    /// Its measured tool pose; identity orientation where the sensor sees positions only.
    PoseMeasured,
    /// Its tool pose at the joint readings (nominal arm).
    PoseNominal,
    /// The result of an identification.
    Identification,
    /// Measured points with the residual of the nominal arm.
    ResidualsBefore,
    /// Measured points with the residual of the identified arm.
    ResidualsAfter,
    /// Tool poses at the joint readings (identified arm).
    PosesPredicted,
    /// What causes the rest.
    Diagnosis,
    /// Notes.
    Log,
}

/// A schema record of an MCAP file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Schema {
    /// `foxglove.PointCloud`, `kincal.Measurement`, …
    pub name: String,
    /// `protobuf` or `jsonschema`.
    pub encoding: String,
    /// File descriptor set, or the JSON schema's text.
    pub data: Cow<'static, [u8]>,
}

impl Topic {
    /// Every topic, in the order of a run.
    pub const ALL: [Topic; 20] = [
        Topic::Run,
        Topic::Shapes,
        Topic::ArmPoints,
        Topic::Transforms,
        Topic::Swarm,
        Topic::SwarmEndPoints,
        Topic::Search,
        Topic::BestEndPoints,
        Topic::Design,
        Topic::Chosen,
        Topic::Measurement,
        Topic::JointReadings,
        Topic::PoseMeasured,
        Topic::PoseNominal,
        Topic::Identification,
        Topic::ResidualsBefore,
        Topic::ResidualsAfter,
        Topic::PosesPredicted,
        Topic::Diagnosis,
        Topic::Log,
    ];

    /// The topic's name in the file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Topic::Run => "/run",
            Topic::Shapes => "/arm/shapes",
            Topic::ArmPoints => "/arm/points",
            Topic::Transforms => "/tf",
            Topic::Swarm => "/design/swarm",
            Topic::SwarmEndPoints => "/design/swarm/end_points",
            Topic::Search => "/design/search",
            Topic::BestEndPoints => "/design/best/end_points",
            Topic::Design => "/design/outcome",
            Topic::Chosen => "/design/chosen",
            Topic::Measurement => "/measurement",
            Topic::JointReadings => "/measurement/joints",
            Topic::PoseMeasured => "/measurement/pose_measured",
            Topic::PoseNominal => "/measurement/pose_nominal",
            Topic::Identification => "/identification",
            Topic::ResidualsBefore => "/identification/residuals_before",
            Topic::ResidualsAfter => "/identification/residuals_after",
            Topic::PosesPredicted => "/identification/poses_predicted",
            Topic::Diagnosis => "/diagnosis",
            Topic::Log => "/log",
        }
    }

    /// The topic with this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Topic> {
        Topic::ALL.into_iter().find(|topic| topic.name() == name)
    }

    /// `json` or `protobuf`.
    #[must_use]
    pub fn message_encoding(self) -> &'static str {
        if self.json_schema().is_some() { "json" } else { "protobuf" }
    }

    /// Name of the topic's schema.
    #[must_use]
    pub fn schema_name(self) -> &'static str {
        match self {
            Topic::Run => "kincal.Run",
            Topic::Swarm => "kincal.SwarmIteration",
            Topic::Search => "kincal.SearchStep",
            Topic::Design => "kincal.DesignOutcome",
            Topic::Measurement => "kincal.Measurement",
            Topic::Identification => "kincal.Identification",
            Topic::Diagnosis => "kincal.Diagnosis",
            Topic::Shapes => "foxglove.SceneUpdate",
            Topic::Transforms => "foxglove.FrameTransforms",
            Topic::ArmPoints | Topic::SwarmEndPoints | Topic::BestEndPoints | Topic::ResidualsBefore | Topic::ResidualsAfter => {
                "foxglove.PointCloud"
            }
            Topic::Chosen | Topic::PosesPredicted => "foxglove.PosesInFrame",
            Topic::JointReadings => "foxglove.JointStates",
            Topic::PoseMeasured | Topic::PoseNominal => "foxglove.PoseInFrame",
            Topic::Log => "foxglove.Log",
        }
    }

    /// The schema as it stands in the file.
    #[must_use]
    pub fn schema(self) -> Schema {
        if let Some(template) = self.json_schema() {
            let data = Cow::Owned(expand(template).into_bytes());
            return Schema { name: self.schema_name().to_owned(), encoding: "jsonschema".to_owned(), data };
        }
        let schema = match self.schema_name() {
            "foxglove.SceneUpdate" => SceneUpdate::get_schema(),
            "foxglove.JointStates" => JointStates::get_schema(),
            "foxglove.FrameTransforms" => FrameTransforms::get_schema(),
            "foxglove.PointCloud" => PointCloud::get_schema(),
            "foxglove.PosesInFrame" => PosesInFrame::get_schema(),
            "foxglove.PoseInFrame" => PoseInFrame::get_schema(),
            _ => Log::get_schema(),
        };
        let (encoding, data) = schema.map_or_else(Default::default, |schema| (schema.encoding, schema.data));
        Schema { name: self.schema_name().to_owned(), encoding, data }
    }

    fn json_schema(self) -> Option<&'static str> {
        match self {
            Topic::Run => Some(include_str!("schemas/run.json")),
            Topic::Swarm => Some(include_str!("schemas/swarm_iteration.json")),
            Topic::Search => Some(include_str!("schemas/search_step.json")),
            Topic::Design => Some(include_str!("schemas/design_outcome.json")),
            Topic::Measurement => Some(include_str!("schemas/measurement.json")),
            Topic::Identification => Some(include_str!("schemas/identification.json")),
            Topic::Diagnosis => Some(include_str!("schemas/diagnosis.json")),
            _ => None,
        }
    }
}

/// Puts shared parts in place of `"@name"`: Foxglove follows no `$ref`, and takes neither type lists nor arrays of arrays.
fn expand(template: &str) -> String {
    template
        // Before what stands in it.
        .replace("\"@least\"", include_str!("schemas/least.json").trim_end())
        .replace("\"@place\"", include_str!("schemas/place.json").trim_end())
        .replace("\"@errors\"", include_str!("schemas/errors.json").trim_end())
        .replace("\"@summary\"", include_str!("schemas/summary.json").trim_end())
        .replace("\"@prediction\"", include_str!("schemas/prediction.json").trim_end())
        .replace("\"@indexes\"", include_str!("schemas/indexes.json").trim_end())
        .replace("\"@configuration\"", include_str!("schemas/configuration.json").trim_end())
}
