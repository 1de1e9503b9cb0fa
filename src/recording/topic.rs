//! The topics of a recording and their schemas.

use std::borrow::Cow;

use foxglove::Encode;
use foxglove::messages::{FrameTransforms, JointStates, Log, PointCloud, PoseInFrame, PosesInFrame, SceneUpdate};

use super::schema::recorded;
use crate::design::outcome::{DesignOutcome, SearchStep, SwarmIteration};
use crate::diagnosis::outcome::Diagnosis;
use crate::event::Start;
use crate::identification::outcome::Identification;
use crate::measurement::Measurement;

/// A topic of a recording. Poses and points are in the arm's root frame (`base_link`, or `world` where there is one), m.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Topic {
    /// What the run was; source of [`crate::event::Event::Start`].
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
        match self.form() {
            Form::Json(..) => "json",
            Form::Protobuf(..) => "protobuf",
        }
    }

    /// Name of the topic's schema.
    #[must_use]
    pub fn schema_name(self) -> &'static str {
        match self.form() {
            Form::Json(name, _) | Form::Protobuf(name, _) => name,
        }
    }

    /// The schema as it stands in the file.
    #[must_use]
    pub fn schema(self) -> Schema {
        match self.form() {
            Form::Json(name, schema) => {
                let data = Cow::Owned(schema(name).as_value().to_string().into_bytes());
                Schema { name: name.to_owned(), encoding: "jsonschema".to_owned(), data }
            }
            Form::Protobuf(name, schema) => {
                let (encoding, data) = schema().map_or_else(Default::default, |schema| (schema.encoding, schema.data));
                Schema { name: name.to_owned(), encoding, data }
            }
        }
    }

    fn form(self) -> Form {
        match self {
            Topic::Run => Form::Json("kincal.Run", recorded::<Start>),
            Topic::Swarm => Form::Json("kincal.SwarmIteration", recorded::<SwarmIteration>),
            Topic::Search => Form::Json("kincal.SearchStep", recorded::<SearchStep>),
            Topic::Design => Form::Json("kincal.DesignOutcome", recorded::<DesignOutcome>),
            Topic::Measurement => Form::Json("kincal.Measurement", recorded::<Measurement>),
            Topic::Identification => Form::Json("kincal.Identification", recorded::<Identification>),
            Topic::Diagnosis => Form::Json("kincal.Diagnosis", recorded::<Diagnosis>),
            Topic::Shapes => Form::Protobuf("foxglove.SceneUpdate", SceneUpdate::get_schema),
            Topic::Transforms => Form::Protobuf("foxglove.FrameTransforms", FrameTransforms::get_schema),
            Topic::ArmPoints | Topic::SwarmEndPoints | Topic::BestEndPoints | Topic::ResidualsBefore | Topic::ResidualsAfter => {
                Form::Protobuf("foxglove.PointCloud", PointCloud::get_schema)
            }
            Topic::Chosen | Topic::PosesPredicted => Form::Protobuf("foxglove.PosesInFrame", PosesInFrame::get_schema),
            Topic::JointReadings => Form::Protobuf("foxglove.JointStates", JointStates::get_schema),
            Topic::PoseMeasured | Topic::PoseNominal => Form::Protobuf("foxglove.PoseInFrame", PoseInFrame::get_schema),
            Topic::Log => Form::Protobuf("foxglove.Log", Log::get_schema),
        }
    }
}

/// How a topic's messages are written: the schema's name, and what makes it.
enum Form {
    /// One of kincal's own types.
    Json(&'static str, fn(&str) -> schemars::Schema),
    /// One of Foxglove's messages.
    Protobuf(&'static str, fn() -> Option<foxglove::Schema>),
}
