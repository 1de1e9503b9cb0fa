//! Bags of ROS 2 (MCAP, messages in CDR): joint states and poses as they were recorded, with the times of their headers.
//!
//! Layouts of messages: `common_interfaces` of ROS 2 (`sensor_msgs`, `geometry_msgs`, `nav_msgs`) and `geometry2` (`tf2_msgs`); the first four
//! bytes of each say its byte order (DDS-XTypes 1.3, 7.6.2).

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use mcap::records::Record;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use serde::Deserialize;
use serde::de::DeserializeOwned;

use crate::measurement::streams::{JointSample, PoseSample, Streams};

/// Longest record that is accepted, bytes: a damaged length must not fill the memory.
const RECORD_LIMIT: usize = 256 * 1024 * 1024;
/// Names that a message lists, at most.
const LISTED: usize = 12;

/// What there is in a bag of joints and poses.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bag {
    /// By topic: names of the joints, and what they read.
    joints: BTreeMap<String, Vec<NamedJoints>>,
    /// By topic, or by `topic:frame` where a topic carries several.
    poses: BTreeMap<String, Vec<PoseSample>>,
    /// Why reading ended before the end of a file.
    pub cut: Option<String>,
}

#[derive(Clone, Debug, PartialEq)]
struct NamedJoints {
    time_s: f64,
    names: Vec<String>,
    values: Vec<f64>,
}

/// Streams that were picked out of a bag.
#[derive(Clone, Debug, PartialEq)]
pub struct Picked {
    /// The streams.
    pub streams: Streams,
    /// Topic of the joints.
    pub joints: String,
    /// Topic (and frame) of the poses.
    pub poses: String,
}

/// A bag that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum BagError {
    /// The file system refused.
    #[error("cannot read {}: {source}; check the path", path.display())]
    Input {
        /// The file.
        path: PathBuf,
        /// Why it failed.
        source: std::io::Error,
    },
    /// Another storage.
    #[error("{}: {what}; convert it first with `{how}`", path.display())]
    Storage {
        /// The file.
        path: PathBuf,
        /// What it is.
        what: &'static str,
        /// What makes an MCAP bag of it.
        how: &'static str,
    },
    /// No bag.
    #[error("{} is no bag of ROS 2: {what}; give an .mcap file, or the folder that `ros2 bag record -s mcap` has written", path.display())]
    NoBag {
        /// The file.
        path: PathBuf,
        /// What was found.
        what: String,
    },
    /// A message that is not what its schema says.
    #[error("{}: message {number}, on {topic}, is no {schema}: {reason}", path.display())]
    Message {
        /// The file.
        path: PathBuf,
        /// Number in the file, from 1.
        number: u64,
        /// Its topic.
        topic: String,
        /// Its schema.
        schema: String,
        /// Why not.
        reason: String,
    },
    /// Which topic is meant is not clear, or there is none.
    #[error("{}: {what}", path.display())]
    Choice {
        /// The bag.
        path: PathBuf,
        /// What is there, and what to say.
        what: String,
    },
}

#[derive(Deserialize)]
struct Time {
    sec: i32,
    nanosec: u32,
}

#[derive(Deserialize)]
struct Header {
    stamp: Time,
    #[allow(dead_code, reason = "it stands between the fields that are read")]
    frame_id: String,
}

#[derive(Deserialize)]
struct JointState {
    header: Header,
    name: Vec<String>,
    position: Vec<f64>,
}

#[derive(Deserialize)]
struct Point {
    x: f64,
    y: f64,
    z: f64,
}

#[derive(Deserialize)]
struct Quaternion {
    x: f64,
    y: f64,
    z: f64,
    w: f64,
}

#[derive(Deserialize)]
struct Placed {
    position: Point,
    orientation: Quaternion,
}

/// `PoseStamped` and, for what follows is not read, `PoseWithCovarianceStamped`.
#[derive(Deserialize)]
struct PoseStamped {
    header: Header,
    pose: Placed,
}

#[derive(Deserialize)]
struct PointStamped {
    header: Header,
    point: Point,
}

/// `Odometry`, and `TransformStamped`, whose transform is laid out as a pose.
#[derive(Deserialize)]
struct OfFrame {
    header: Header,
    child_frame_id: String,
    pose: Placed,
}

#[derive(Deserialize)]
struct TfMessage {
    transforms: Vec<OfFrame>,
}

/// Reads what a bag says of joints and poses: an .mcap file, or a folder of them.
///
/// # Errors
/// If it cannot be read or holds no MCAP. A file that was cut off is read up to there ([`Bag::cut`]).
pub fn read(path: &Path) -> Result<Bag, BagError> {
    let input = |source| BagError::Input { path: path.to_owned(), source };
    let mut files = vec![path.to_owned()];
    if path.is_dir() {
        let entries: Result<Vec<PathBuf>, _> =
            std::fs::read_dir(path).map_err(input)?.map(|entry| entry.map(|entry| entry.path())).collect();
        let mut entries = entries.map_err(input)?;
        entries.sort();
        let of = |ending: &str| entries.iter().filter(|file| file.extension().is_some_and(|of| of == ending)).cloned().collect();
        files = of("mcap");
        let databases: Vec<PathBuf> = of("db3");
        if let (true, Some(database)) = (files.is_empty(), databases.first()) {
            return Err(of_database(database));
        }
        if files.is_empty() {
            return Err(BagError::NoBag { path: path.to_owned(), what: "no .mcap file is in this folder".to_owned() });
        }
    }
    let mut bag = Bag::default();
    for file in &files {
        read_file(file, &mut bag)?;
    }
    Ok(bag)
}

fn of_database(path: &Path) -> BagError {
    BagError::Storage {
        path: path.to_owned(),
        what: "a bag that is stored in SQLite",
        how: "rosbags-convert --src BAG --dst NEW --dst-storage mcap",
    }
}

fn read_file(path: &Path, bag: &mut Bag) -> Result<(), BagError> {
    let input = |source| BagError::Input { path: path.to_owned(), source };
    let mut file = crate::files::open(path, u64::MAX).map_err(input)?;
    let mut head = Vec::new();
    (&mut file).take(16).read_to_end(&mut head).map_err(input)?;
    if head.starts_with(b"SQLite format") {
        return Err(of_database(path));
    }
    if head.starts_with(b"#ROSBAG V") {
        let (what, how) = ("a bag of ROS 1", "rosbags-convert --src BAG --dst NEW --dst-storage mcap");
        return Err(BagError::Storage { path: path.to_owned(), what, how });
    }
    if !head.starts_with(mcap::MAGIC) {
        let what = format!("it begins with {}", head.escape_ascii());
        return Err(BagError::NoBag { path: path.to_owned(), what });
    }
    let mut file = head.as_slice().chain(file);
    let mut reader = LinearReader::new_with_options(LinearReaderOptions::default().with_record_length_limit(RECORD_LIMIT));
    let (mut schemas, mut channels) = (BTreeMap::new(), BTreeMap::new());
    let mut number = 0;
    while let Some(event) = reader.next_event() {
        match event {
            Ok(LinearReadEvent::ReadRequest(count)) => {
                let read = file.read(reader.insert(count)).map_err(input)?;
                reader.notify_read(read);
            }
            Ok(LinearReadEvent::Record { data, opcode }) => match mcap::parse_record(opcode, data) {
                Ok(Record::Schema { header, .. }) => {
                    schemas.insert(header.id, header.name);
                }
                Ok(Record::Channel(channel)) => {
                    let schema: String = schemas.get(&channel.schema_id).cloned().unwrap_or_default();
                    channels.insert(channel.id, (channel.topic, schema, channel.message_encoding));
                }
                Ok(Record::Message { header, data }) => {
                    number += 1;
                    if let Some((topic, schema, encoding)) = channels.get(&header.channel_id) {
                        let logged = header.log_time as f64 * 1e-9;
                        bag.take(topic, schema, encoding, logged, &data).map_err(|reason| BagError::Message {
                            path: path.to_owned(),
                            number,
                            topic: topic.clone(),
                            schema: schema.clone(),
                            reason,
                        })?;
                    }
                }
                Ok(_) => {}
                Err(error) => {
                    bag.cut = Some(format!("{}: reading ended after message {number}: {error}", path.display()));
                    return Ok(());
                }
            },
            Err(error) => {
                bag.cut = Some(format!("{}: reading ended after message {number}: {error}", path.display()));
                return Ok(());
            }
        }
    }
    Ok(())
}

/// A message in CDR, whatever its byte order.
fn decoded<T: DeserializeOwned>(data: &[u8]) -> Result<T, String> {
    let (head, body) = data.split_at_checked(4).ok_or("it has no header of encapsulation")?;
    let read = match head {
        [0, 0, ..] => re_cdr::from_bytes::<T, re_cdr::BigEndian>(body),
        [0, 1, ..] => re_cdr::from_bytes::<T, re_cdr::LittleEndian>(body),
        _ => return Err(format!("its encapsulation {:02x}{:02x} is not plain CDR", head[0], head[1])),
    };
    read.map(|(value, _)| value).map_err(|error| error.to_string())
}

impl Bag {
    fn take(&mut self, topic: &str, schema: &str, encoding: &str, logged: f64, data: &[u8]) -> Result<(), String> {
        let kind = schema.rsplit('/').next().unwrap_or_default();
        if encoding != "cdr" {
            return Ok(());
        }
        // A header whose time nobody has set is at zero.
        let time = |header: &Header| match header.stamp {
            Time { sec: 0, nanosec: 0 } => logged,
            Time { sec, nanosec } => f64::from(sec) + f64::from(nanosec) * 1e-9,
        };
        let placed = |header: &Header, pose: &Placed| PoseSample {
            time_s: time(header),
            position_m: [pose.position.x, pose.position.y, pose.position.z],
            orientation_xyzw: {
                let Quaternion { x, y, z, w } = pose.orientation;
                let size = libm::sqrt(x * x + y * y + z * z + w * w);
                (size > 0.5).then(|| [x, y, z, w].map(|value| value / size))
            },
        };
        let sound = |sample: &PoseSample| {
            let turn = sample.orientation_xyzw.unwrap_or([0.0; 4]);
            sample.time_s.is_finite() && sample.position_m.iter().chain(&turn).all(|value| value.is_finite())
        };
        let mut found = |name: String, sample: PoseSample| {
            // A tracker that has lost its target says so by numbers that are none.
            if sound(&sample) {
                self.poses.entry(name).or_default().push(sample);
            }
        };
        match kind {
            "JointState" => {
                let read: JointState = decoded(data)?;
                let sample = NamedJoints { time_s: time(&read.header), names: read.name, values: read.position };
                if sample.values.len() == sample.names.len() && sample.values.iter().all(|value| value.is_finite()) {
                    self.joints.entry(topic.to_owned()).or_default().push(sample);
                }
            }
            "PoseStamped" | "PoseWithCovarianceStamped" => {
                let read: PoseStamped = decoded(data)?;
                found(topic.to_owned(), placed(&read.header, &read.pose));
            }
            "PointStamped" => {
                let read: PointStamped = decoded(data)?;
                let position_m = [read.point.x, read.point.y, read.point.z];
                found(topic.to_owned(), PoseSample { time_s: time(&read.header), position_m, orientation_xyzw: None });
            }
            "Odometry" => {
                let read: OfFrame = decoded(data)?;
                found(topic.to_owned(), placed(&read.header, &read.pose));
            }
            "TransformStamped" => {
                let read: OfFrame = decoded(data)?;
                found(topic.to_owned(), placed(&read.header, &read.pose));
            }
            "TFMessage" => {
                let read: TfMessage = decoded(data)?;
                for of in read.transforms {
                    found(format!("{topic}:{}", of.child_frame_id), placed(&of.header, &of.pose));
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// The joints of these names, in this order, and the poses; topics where there is a choice.
    ///
    /// # Errors
    /// If there are none, or it is not clear which are meant.
    pub fn pick(&self, path: &Path, names: &[String], joints: Option<&str>, poses: Option<&str>) -> Result<Picked, BagError> {
        let choice = |what: String| BagError::Choice { path: path.to_owned(), what };
        let whole = |samples: &Vec<NamedJoints>| -> Vec<JointSample> {
            let of = |sample: &NamedJoints| {
                let value = |name: &String| sample.names.iter().position(|own| own == name).map(|at| sample.values[at]);
                Some(JointSample { time_s: sample.time_s, joints: names.iter().map(value).collect::<Option<_>>()? })
            };
            samples.iter().filter_map(of).collect()
        };
        let usable: BTreeMap<&String, Vec<JointSample>> =
            self.joints.iter().map(|(topic, samples)| (topic, whole(samples))).filter(|(_, own)| !own.is_empty()).collect();
        let topic = match joints {
            Some(said) => usable.keys().find(|topic| topic.as_str() == said).copied(),
            // The measured state beside a commanded one.
            None => usable.keys().find(|topic| topic.as_str() == "/joint_states").or(usable.keys().next()).copied(),
        };
        let Some(joint_topic) = topic else {
            let mut there: Vec<String> = self
                .joints
                .iter()
                .map(|(topic, samples)| {
                    let mut known: Vec<&str> = samples.iter().flat_map(|of| &of.names).map(String::as_str).collect();
                    known.sort_unstable();
                    known.dedup();
                    format!("{topic} ({})", listed(&known))
                })
                .collect();
            if there.is_empty() {
                there.push("none".to_owned());
            }
            return Err(choice(format!(
                "no topic {}of sensor_msgs/JointState names all joints of the robot ({}); there is: {}",
                joints.map(|said| format!("`{said}` ")).unwrap_or_default(),
                listed(&names.iter().map(String::as_str).collect::<Vec<_>>()),
                there.join("; ")
            )));
        };
        let known: Vec<&String> = self.poses.keys().collect();
        let alone: Vec<&String> = known.iter().copied().filter(|name| !name.contains(':')).collect();
        let pose_topic = match (poses, alone.as_slice(), known.as_slice()) {
            (Some(said), ..) => known.iter().find(|name| name.as_str() == said).copied(),
            (None, [only], _) | (None, [], [only]) => Some(*only),
            _ => None,
        };
        let Some(pose_topic) = pose_topic else {
            let there: Vec<String> =
                known.iter().map(|name| format!("{name} ({} poses)", self.poses[name.as_str()].len())).collect();
            let there: Vec<&str> = there.iter().map(String::as_str).collect();
            return Err(choice(match (poses, known.is_empty()) {
                (_, true) => {
                    "there are no poses: PoseStamped, PoseWithCovarianceStamped, PointStamped, TransformStamped, Odometry or \
                              TFMessage are read"
                        .to_owned()
                }
                (Some(said), _) => format!("there are no poses on `{said}`; --poses takes one of: {}", listed(&there)),
                (None, _) => format!("which poses are the target's? --poses takes one of: {}", listed(&there)),
            }));
        };
        let streams = Streams::new(usable[joint_topic].clone(), self.poses[pose_topic].clone());
        Ok(Picked { streams, joints: joint_topic.clone(), poses: pose_topic.clone() })
    }
}

fn listed(names: &[&str]) -> String {
    let more = names.len().saturating_sub(LISTED);
    let mut text = names.iter().take(LISTED).copied().collect::<Vec<_>>().join(", ");
    if more > 0 {
        text.push_str(&format!(" and {more} more"));
    }
    text
}
