//! Point clouds: packing, and unpacking of the end points.

use foxglove::messages::packed_element_field::NumericType;
use foxglove::messages::{PackedElementField, PointCloud, Timestamp};

use crate::design::outcome::SwarmIteration;
use crate::identification::outcome::Residual;

type Layout = [(&'static str, NumericType)];

/// `red`, `green`, `blue`, `alpha` are what Rerun colours by; Foxglove can colour by any field.
const END_POINT: [(&str, NumericType); 9] = [
    ("x", NumericType::Float32),
    ("y", NumericType::Float32),
    ("z", NumericType::Float32),
    ("fitness", NumericType::Float32),
    ("particle", NumericType::Uint32),
    ("red", NumericType::Uint8),
    ("green", NumericType::Uint8),
    ("blue", NumericType::Uint8),
    ("alpha", NumericType::Uint8),
];
const END_POINT_STRIDE: usize = 24;

const BEST: [(&str, NumericType); 8] = [
    ("x", NumericType::Float32),
    ("y", NumericType::Float32),
    ("z", NumericType::Float32),
    ("configuration", NumericType::Uint32),
    ("red", NumericType::Uint8),
    ("green", NumericType::Uint8),
    ("blue", NumericType::Uint8),
    ("alpha", NumericType::Uint8),
];

const DOT: [(&str, NumericType); 7] = [
    ("x", NumericType::Float32),
    ("y", NumericType::Float32),
    ("z", NumericType::Float32),
    ("red", NumericType::Uint8),
    ("green", NumericType::Uint8),
    ("blue", NumericType::Uint8),
    ("alpha", NumericType::Uint8),
];

const RESIDUAL: [(&str, NumericType); 12] = [
    ("x", NumericType::Float64),
    ("y", NumericType::Float64),
    ("z", NumericType::Float64),
    ("dx", NumericType::Float64),
    ("dy", NumericType::Float64),
    ("dz", NumericType::Float64),
    ("norm", NumericType::Float64),
    ("index", NumericType::Uint32),
    ("red", NumericType::Uint8),
    ("green", NumericType::Uint8),
    ("blue", NumericType::Uint8),
    ("alpha", NumericType::Uint8),
];

fn size(kind: NumericType) -> u32 {
    match kind {
        NumericType::Unknown => 0,
        NumericType::Uint8 | NumericType::Int8 => 1,
        NumericType::Uint16 | NumericType::Int16 => 2,
        NumericType::Uint32 | NumericType::Int32 | NumericType::Float32 => 4,
        NumericType::Float64 => 8,
    }
}

fn fields(layout: &Layout) -> (Vec<PackedElementField>, u32) {
    let mut offset = 0;
    let fields = layout
        .iter()
        .map(|(name, kind)| {
            let field = PackedElementField { name: (*name).to_owned(), offset, r#type: *kind as i32 };
            offset += size(*kind);
            field
        })
        .collect();
    (fields, offset)
}

fn cloud(layout: &Layout, timestamp: Timestamp, frame_id: &str, data: Vec<u8>) -> PointCloud {
    let (fields, point_stride) = fields(layout);
    // Without a pose Foxglove takes the identity, and so does Rerun.
    PointCloud { timestamp: Some(timestamp), frame_id: frame_id.to_owned(), pose: None, point_stride, fields, data: data.into() }
}

/// Blue-violet (0) over teal to yellow (1).
fn ramp(share: f64) -> [u8; 4] {
    const STOPS: [[f64; 3]; 3] = [[68.0, 1.0, 84.0], [33.0, 145.0, 140.0], [253.0, 231.0, 37.0]];
    // A share that is not a number (all values equal) becomes the middle.
    let share = if share.is_finite() { share.clamp(0.0, 1.0) * 2.0 } else { 1.0 };
    let (from, to, part) = if share < 1.0 { (STOPS[0], STOPS[1], share) } else { (STOPS[1], STOPS[2], share - 1.0) };
    let mix = |channel: usize| (from[channel] + (to[channel] - from[channel]) * part) as u8;
    [mix(0), mix(1), mix(2), 255]
}

/// End points of every particle, coloured by fitness within the iteration.
pub(super) fn end_points(swarm: &SwarmIteration, timestamp: Timestamp, frame_id: &str) -> PointCloud {
    let (low, high) =
        swarm.fitness.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(*value), high.max(*value)));
    let count: usize = swarm.end_points.iter().map(Vec::len).sum();
    let mut data = Vec::with_capacity(count * END_POINT_STRIDE);
    for (particle, points) in swarm.end_points.iter().enumerate() {
        let fitness = swarm.fitness.get(particle).copied().unwrap_or(f64::NAN);
        let colour = ramp((fitness - low) / (high - low));
        for point in points {
            point.iter().for_each(|coordinate| data.extend(coordinate.to_le_bytes()));
            data.extend((fitness as f32).to_le_bytes());
            data.extend((particle as u32).to_le_bytes());
            data.extend(colour);
        }
    }
    cloud(&END_POINT, timestamp, frame_id, data)
}

/// A cloud of end points without any.
pub(super) fn no_end_points(timestamp: Timestamp, frame_id: &str) -> PointCloud {
    cloud(&END_POINT, timestamp, frame_id, Vec::new())
}

/// The end points of `particles` particles, as [`end_points`] has packed them.
pub(super) fn unpack_end_points(cloud: &PointCloud, particles: usize) -> Result<Vec<Vec<[f32; 3]>>, String> {
    let (expected, stride) = fields(&END_POINT);
    if cloud.fields != expected || cloud.point_stride != stride || !cloud.data.len().is_multiple_of(END_POINT_STRIDE) {
        return Err("its points are not packed as end points are".to_owned());
    }
    let word = |point: &[u8], at: usize| [point[at], point[at + 1], point[at + 2], point[at + 3]];
    let mut end_points = vec![Vec::new(); particles];
    for point in cloud.data.chunks_exact(END_POINT_STRIDE) {
        let particle = u32::from_le_bytes(word(point, 16));
        end_points
            .get_mut(particle as usize)
            .ok_or_else(|| format!("it has a point of particle {particle}, but there are {particles} particles"))?
            .push([0, 4, 8].map(|at| f32::from_le_bytes(word(point, at))));
    }
    Ok(end_points)
}

/// End points of one set, in one colour.
pub(super) fn best(points: impl Iterator<Item = [f64; 3]>, timestamp: Timestamp, frame_id: &str) -> PointCloud {
    let mut data = Vec::new();
    for (configuration, point) in points.enumerate() {
        point.iter().for_each(|coordinate| data.extend((*coordinate as f32).to_le_bytes()));
        data.extend((configuration as u32).to_le_bytes());
        data.extend([255, 120, 40, 255]);
    }
    cloud(&BEST, timestamp, frame_id, data)
}

/// Points that carry nothing but a colour.
pub(super) fn dots(dots: &[super::skeleton::Dot], timestamp: Timestamp, frame_id: &str) -> PointCloud {
    let mut data = Vec::with_capacity(dots.len() * 16);
    for (point, colour) in dots {
        point.iter().for_each(|coordinate| data.extend(coordinate.to_le_bytes()));
        data.extend(colour);
    }
    cloud(&DOT, timestamp, frame_id, data)
}

/// Measured points with the residual vector that `choose` picks, coloured by its length over `longest` (m).
pub(super) fn residuals(
    residuals: &[Residual],
    choose: fn(&Residual) -> &[f64; 6],
    longest: f64,
    timestamp: Timestamp,
    frame_id: &str,
) -> PointCloud {
    let mut data = Vec::new();
    for residual in residuals {
        let vector = choose(residual);
        let length = length(vector);
        residual.position_m.iter().chain(&vector[..3]).for_each(|coordinate| data.extend(coordinate.to_le_bytes()));
        data.extend(length.to_le_bytes());
        data.extend((residual.index as u32).to_le_bytes());
        data.extend(ramp(length / longest));
    }
    cloud(&RESIDUAL, timestamp, frame_id, data)
}

/// Length of the origin's part of a residual, m.
pub(super) fn length(residual: &[f64; 6]) -> f64 {
    nalgebra::Vector3::new(residual[0], residual[1], residual[2]).norm()
}

/// The first field in which two clouds differ: `points[17].x`, recorded and recomputed value.
pub(super) fn difference(recorded: &PointCloud, recomputed: &PointCloud) -> Option<(String, String, String)> {
    if recorded.fields != recomputed.fields || recorded.point_stride != recomputed.point_stride || recorded.point_stride == 0 {
        return None;
    }
    let stride = recorded.point_stride as usize;
    let (left, right) = (recorded.data.chunks_exact(stride), recomputed.data.chunks_exact(stride));
    for (number, (left, right)) in left.zip(right).enumerate() {
        for field in &recorded.fields {
            let kind = NumericType::try_from(field.r#type).ok()?;
            let range = field.offset as usize..field.offset as usize + size(kind) as usize;
            let (left, right) = (left.get(range.clone())?, right.get(range)?);
            if left != right {
                return Some((format!("points[{number}].{}", field.name), value(kind, left), value(kind, right)));
            }
        }
    }
    let (left, right) = (recorded.data.len() / stride, recomputed.data.len() / stride);
    (left != right).then(|| ("number of points".to_owned(), left.to_string(), right.to_string()))
}

fn value(kind: NumericType, bytes: &[u8]) -> String {
    match (kind, bytes) {
        (NumericType::Float32, &[a, b, c, d]) => format!("{:?}", f32::from_le_bytes([a, b, c, d])),
        (NumericType::Float64, &[a, b, c, d, e, f, g, h]) => format!("{:?}", f64::from_le_bytes([a, b, c, d, e, f, g, h])),
        (NumericType::Uint32, &[a, b, c, d]) => u32::from_le_bytes([a, b, c, d]).to_string(),
        _ => format!("{bytes:?}"),
    }
}
