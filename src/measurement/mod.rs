//! What a real cell would know of a measured configuration. There is no truth in here.

pub mod equations;
pub mod streams;
pub mod table;

use nalgebra::{Point3, Quaternion, UnitQuaternion, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a measured configuration is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// Parameters are fitted to it.
    #[default]
    Fit,
    /// It carries the reported error and is never fitted.
    HeldOut,
}

/// One measured configuration: joint readings, the tool's pose in the measurement frame, and the conditions under which it was read.
/// What was not recorded is empty or absent.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Measurement {
    /// Position in the order of measuring, from 0.
    pub index: usize,
    /// Readings with the same number are repeats of one configuration.
    pub pose_id: usize,
    /// For fitting or for verification.
    pub role: Role,
    /// Since the start of the session, s.
    pub time_s: f64,
    /// Joint readings from the base outwards, rad (m for prismatic joints).
    pub joints: Vec<f64>,
    /// Temperatures of the moving links as read, °C, link 1 first; empty where there are no sensors.
    #[serde(default)]
    pub temperatures_c: Vec<f64>,
    /// Measured origin of the tool frame in the measurement frame: x, y, z, m.
    pub position_m: [f64; 3],
    /// Which of x, y and z were not read; their numbers stand for nothing.
    #[serde(default, skip_serializing_if = "all_read")]
    pub unread: [bool; 3],
    /// Measured orientation of the tool frame in the measurement frame as quaternion x, y, z, w; absent where the sensor sees positions only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[serde(rename = "attitude_xyzw")]
    pub orientation_xyzw: Option<[f64; 4]>,
    /// The three angles that the orientation was read as, rad, where it was: what other ways of taking them are tried on. Not recorded.
    #[serde(skip)]
    pub angles_rad: Option<[f64; 3]>,
    /// Direction of each joint's last move before the reading: -1, 0 (it did not move) or 1; empty where not recorded.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub approach: Vec<i8>,
    /// Temperature of the air as read, °C.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ambient_c: Option<f64>,
    /// Mass that the tool carries, as far as the cell knows, kg: a point mass at the origin of the tool frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub payload_kg: Option<f64>,
    /// From the end of the last move to the reading, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dwell_s: Option<f64>,
    /// Session: readings of one session share the set-up (tool, base, sensor).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub session: Option<String>,
    /// Gravity in the robot's root frame at this reading, m/s²; absent where nobody said: that of the robot's file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gravity_m_s2: Option<[f64; 3]>,
    /// A point that does not move in the measurement frame and whose place nobody knows, at which the target was; the position is then none that
    /// was read, and zero.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fixed_point: Option<String>,
    /// A plane that does not move in the measurement frame and of which nobody knows where it is, on which the target was. The position is
    /// then none that was read, and zero; of `unread` only z is not, which is the distance from the plane.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plane: Option<String>,
    /// Which reflector on the tool was read, where there are several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
}

fn all_read(unread: &[bool; 3]) -> bool {
    *unread == [false; 3]
}

/// What does not move in the measurement frame and of which nobody knows where it is, by its label; the target was there.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Feature {
    /// At a point: a ball in a socket.
    Point(String),
    /// On a plane: a tip that touches a surface plate.
    Plane(String),
}

impl Measurement {
    /// Where the target was, if that was not read but is known to be the same in other readings.
    #[must_use]
    pub fn feature(&self) -> Option<Feature> {
        let point = self.fixed_point.clone().map(Feature::Point);
        point.or_else(|| self.plane.clone().map(Feature::Plane))
    }

    /// Whether a position in the measurement frame was read.
    #[must_use]
    pub fn is_in_frame(&self) -> bool {
        self.fixed_point.is_none() && self.plane.is_none()
    }

    /// The measured origin of the tool.
    #[must_use]
    pub fn position(&self) -> Point3<f64> {
        Point3::from(self.position_m)
    }

    /// Gravity in the root frame, m/s², where that of the robot's file is `usual`.
    #[must_use]
    pub fn gravity(&self, usual: &Vector3<f64>) -> Vector3<f64> {
        self.gravity_m_s2.map_or(*usual, Vector3::from)
    }

    /// The measured orientation, where there is one.
    #[must_use]
    pub fn orientation(&self) -> Option<UnitQuaternion<f64>> {
        // The recorded numbers are taken as they are, so that a replay sees the bits that were measured.
        self.orientation_xyzw.map(|[x, y, z, w]| UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z)))
    }
}

/// Declared accuracy of the sensor, one sigma per axis: what its data sheet says.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensor {
    /// Where the sensor stands, in base, m: the noise grows with the distance from here.
    pub position_in_base: Point3<f64>,
    /// Position noise at no distance, m.
    pub position_sigma_m: f64,
    /// Growth of the position noise with distance, m per m.
    pub position_sigma_per_m: f64,
    /// Orientation noise per axis, rad; `None` where the sensor sees positions only, zero where it is taken as exact.
    pub orientation_sigma_rad: Option<f64>,
    /// Noise of the temperature sensors on the moving links, K; `None` where there are none.
    pub temperature_sigma_k: Option<f64>,
    /// The cone that it sees; `None` where it sees everything.
    pub view: Option<View>,
    /// Known distances of fixed points ([`Measurement::fixed_point`]).
    pub distances: Vec<Distance>,
}

/// A known distance of two fixed points, such as of two sockets in one block.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Distance {
    /// One point's label.
    pub point_a: String,
    /// The other's.
    pub point_b: String,
    /// Distance, m.
    pub distance_m: f64,
    /// One sigma, m.
    pub sigma_m: f64,
}

/// What a sensor sees: a cone whose apex is the sensor's position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// A point on the axis, in base, m.
    pub towards_in_base: Point3<f64>,
    /// Between axis and edge, rad; π sees everything.
    pub half_angle_rad: f64,
}

impl Sensor {
    /// A sensor that is equally exact everywhere and sees everything: position noise in m and orientation noise in rad, one sigma
    /// per axis; `None` where it sees positions only.
    #[must_use]
    pub fn uniform(position_sigma_m: f64, orientation_sigma_rad: Option<f64>) -> Self {
        Sensor {
            position_in_base: Point3::origin(),
            position_sigma_m,
            position_sigma_per_m: 0.0,
            orientation_sigma_rad,
            temperature_sigma_k: None,
            distances: Vec::new(),
            view: None,
        }
    }

    /// Sigma of a position reading at `position` (in base), m per axis.
    #[must_use]
    pub fn position_sigma_at(&self, position: &Vector3<f64>) -> f64 {
        self.position_sigma_m + self.position_sigma_per_m * (position - self.position_in_base.coords).norm()
    }

    /// Mean position noise of `measurements`, one sigma per axis, m.
    #[must_use]
    pub fn mean_position_sigma<'a>(&self, measurements: impl IntoIterator<Item = &'a Measurement>) -> f64 {
        let (mut sum, mut count) = (0.0, 0_usize);
        for row in measurements {
            sum += self.position_sigma_at(&row.position().coords);
            count += 1;
        }
        (sum / count.max(1) as f64).max(1e-9)
    }

    /// Whether the sensor sees `point` (in base, m): within its cone, apex included, or anywhere where it has none.
    #[must_use]
    pub fn sees(&self, point: &Vector3<f64>) -> bool {
        let Some(view) = &self.view else {
            return true;
        };
        let axis = view.towards_in_base - self.position_in_base;
        let sight = point - self.position_in_base.coords;
        // Exact at 0 and π, where an arc cosine would hang on rounding.
        libm::atan2(axis.cross(&sight).norm(), axis.dot(&sight)) <= view.half_angle_rad
    }
}

/// Weights of the least-squares fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weights {
    /// Each residual over its declared sigma.
    Noise,
    /// Metres and radians alike, as in eq. 6.
    Unit,
}
