//! What each event draws.
//!
//! Timelines: `event` counts everything and is the one the view opens on; `iteration` holds the swarm, `evaluations` (of the
//! criterion) any other search, `pose` (index of the
//! measurement) and `time` (of the session) the measuring. Clock times are not recorded.

use std::collections::BTreeMap;
use std::time::Duration;

use re_sdk_types::archetypes::{
    Arrows3D, LineStrips3D, Points3D, Scalars, SeriesLines, SeriesPoints, TextDocument, TextLog, TransformAxes3D,
};
use re_sdk_types::components::{Radius, TextLogLevel};
use rerun::log::ChunkBatcherConfig;
use rerun::sink::LogSink;
use rerun::{RecordingStream, RecordingStreamBuilder, RecordingStreamResult};
use sha2::{Digest, Sha256};

use super::body::{Body, point, transform};
use super::by_joint;
use super::chart::{self, Series, Unit};
use super::diagnosis::{self, Sight};
use super::layout::{self, Camera, Choosing, Parts};
use super::summary::{Summary, significant};
use super::viewer::ViewerError;
use crate::arm::Arm;
use crate::arm::frames::{Pose, pose_error};
use crate::design::outcome::{DesignOutcome, SearchStep, SwarmIteration};
use crate::design::problem::{DesignProblem, Method};
use crate::event::{Event, Start};
use crate::identification::outcome::{Identification, Residual};
use crate::measurement::{Measurement, Role};
use crate::quality::Indexes;
use crate::report::criterion::Words;

/// The application in the viewer, which keeps one layout for each.
pub(super) const APPLICATION: &str = "kincal";
/// The timeline of all events.
pub(super) const EVENTS: &str = "event";
const ITERATIONS: &str = "iteration";
const EVALUATIONS: &str = "evaluations";
const POSES: &str = "pose";
const TIME: &str = "time";

const AMBER: [u8; 3] = [255, 184, 56];
const AMBER_LINES: [u8; 3] = [92, 76, 48];
const FIT: [u8; 3] = [72, 200, 150];
const HELD_OUT: [u8; 3] = [186, 132, 255];
const BEFORE: [u8; 3] = [240, 128, 84];
const BEFORE_HELD_OUT: [u8; 3] = [255, 196, 150];
const PREDICTED: [u8; 3] = [235, 235, 235];
const POOR: [u8; 3] = [58, 66, 92];
const GOOD: [u8; 3] = [104, 160, 214];
const PERSONAL: [u8; 3] = [96, 112, 140];
const CURVES: [[u8; 3]; 6] = [AMBER, [110, 170, 230], [90, 200, 170], [200, 130, 220], [230, 120, 120], [170, 180, 120]];

/// Measured points that share an entity: growing entities of this size keep what is sent in proportion to what is measured.
const BLOCK: usize = 64;
/// Chosen configurations drawn as lines; more would hide the rest.
const LINES: usize = 60;

/// What has been drawn so far, as far as the next event needs it.
#[derive(Debug)]
pub(super) struct Picture {
    body: Body,
    name: String,
    /// Method of the design, and how its criterion is told.
    design: Option<(Method, Words)>,
    event: i64,
    best: Vec<Vec<f64>>,
    summary: Summary,
    /// What was measured.
    measurements: Vec<Measurement>,
    /// Measured minus nominal; what is measured minus identified is not known before the end.
    measured: Vec<Residual>,
    roles: BTreeMap<usize, Role>,
    series_named: bool,
    temperatures_named: bool,
    conditions_named: bool,
    /// Whether the chart and the arrows lag behind the measurements.
    stale: bool,
}

/// Which of its two vectors a residual is drawn with.
type Vector = fn(&Residual) -> &[f64; 6];

impl Picture {
    pub(super) fn new(arm: &Arm, design: Option<&DesignProblem>, name: &str) -> Result<Picture, ViewerError> {
        Ok(Picture {
            body: Body::new(arm)?,
            name: name.to_owned(),
            design: design.map(|design| (design.method, Words::new(Some(design.criterion)))),
            event: 0,
            best: Vec::new(),
            summary: Summary::default(),
            measurements: Vec::new(),
            measured: Vec::new(),
            roles: BTreeMap::new(),
            series_named: false,
            temperatures_named: false,
            conditions_named: false,
            stale: false,
        })
    }

    /// Opens the stream of the run that begins with `first`, with what stands still in it and its layout. Rows are
    /// collected for `batch` before they are sent.
    pub(super) fn begin(
        &mut self,
        first: &Event,
        sink: Box<dyn LogSink>,
        batch: Duration,
    ) -> RecordingStreamResult<RecordingStream> {
        let command = match first {
            Event::Start(start) => start.command.as_str(),
            _ => "",
        };
        let builder = RecordingStreamBuilder::new(APPLICATION).enabled(true).recording_id(self.recording_id(first));
        let (_, info, _, _, hooks, _) = builder.into_args();
        let batching = ChunkBatcherConfig { flush_tick: batch, ..ChunkBatcherConfig::DEFAULT };
        // Without Rerun's own properties: they hold the hour at which the picture was made.
        let stream = RecordingStream::new(info, None, Some(batching), hooks, sink)?;
        stream.set_log_time_enabled(false);
        stream.set_log_tick_enabled(false);
        stream.send_recording_name(self.name.as_str())?;
        let parts = Parts::of(command, self.design);
        layout::send(&stream, APPLICATION, parts, self.camera(), self.body.arm().joint_count())?;
        stream.set_time_sequence(EVENTS, 0);
        if matches!(parts.choosing, Choosing::Search(_)) {
            // What stands still is there on the search's own timeline too.
            stream.set_time_sequence(EVALUATIONS, 0);
        }
        self.body.log_shapes(&stream)?;
        self.log_scales(&stream, &["nothing is measured yet".to_owned()])?;
        for path in ["errors/position", "errors/attitude"] {
            chart::log_empty(&stream, path)?;
        }
        if parts.diagnosed {
            diagnosis::log_empty(&stream)?;
        }
        Ok(stream)
    }

    /// The same for the same run, so that showing it again does not look like another one.
    fn recording_id(&self, first: &Event) -> String {
        let mut hash = Sha256::new();
        hash.update(self.name.as_bytes());
        hash.update(self.body.arm().name.as_bytes());
        for value in self.body.arm().chain.nominal() {
            hash.update(value.to_le_bytes());
        }
        if let Event::Start(Start { version, command, scene, .. }) = first {
            for text in [version, command, scene] {
                hash.update(text.len().to_le_bytes());
                hash.update(text.as_bytes());
            }
        }
        let digest: [u8; 32] = hash.finalize().into();
        let hex: String = digest[..8].iter().map(|byte| format!("{byte:02x}")).collect();
        format!("{}-{hex}", self.name)
    }

    fn up(&self) -> nalgebra::Vector3<f64> {
        let up = -self.body.arm().gravity_in_base;
        if up.norm() > 1e-9 { up.normalize() } else { nalgebra::Vector3::z() }
    }

    fn camera(&self) -> Camera {
        let size = self.body.stretch;
        let up = self.up();
        let aside = if up.x.abs() < 0.9 { nalgebra::Vector3::x() } else { nalgebra::Vector3::y() };
        let right = (aside - up * up.dot(&aside)).normalize();
        let target = up * 0.25 * size;
        let position = target + (right * 1.15 - up.cross(&right) * 1.3 + up * 0.75) * size;
        Camera { position: point(&position), target: point(&target), up: point(&up) }
    }

    /// Draws an event.
    pub(super) fn take(&mut self, stream: &RecordingStream, event: &Event) -> RecordingStreamResult<()> {
        stream.set_time_sequence(EVENTS, self.event);
        self.event += 1;
        match event {
            Event::Start(start) => self.summary.start(&self.name, &self.body.arm().name, start),
            Event::Swarm(swarm) => self.swarm(stream, swarm)?,
            Event::Search(step) => self.search(stream, step)?,
            Event::Designed(design) => self.designed(stream, design)?,
            Event::Measured(measurement) => self.measured(stream, measurement)?,
            Event::Identified(identified) => self.identified(stream, identified)?,
            Event::Diagnosed(diagnosis) => {
                let sight = Sight { stretch: self.body.stretch, up: self.up() };
                diagnosis::log(stream, diagnosis, sight)?;
                self.summary.diagnosed(diagnosis::summary(diagnosis));
            }
            Event::NotDiagnosed(reason) => {
                let text = format!("no diagnosis: {reason}");
                return stream.log("notes", &TextLog::new(text).with_level(TextLogLevel::INFO));
            }
            Event::Note(text) => return stream.log("notes", &TextLog::new(text.as_str()).with_level(TextLogLevel::INFO)),
        }
        stream.log("summary", &TextDocument::from_markdown(self.summary.markdown()))
    }

    fn size(&self, share: f64) -> Radius {
        Radius::new_scene_units((share * self.body.stretch) as f32)
    }

    /// The tool's nominal places in `configurations`, as balls of a share of the arm's length.
    fn end_points(&self, configurations: &[Vec<f64>], share: f64) -> Points3D {
        let tools = configurations.iter().filter_map(|joints| self.body.tool(joints));
        Points3D::new(tools.map(|tool| point(&tool.translation.vector))).with_colors([AMBER]).with_radii([self.size(share)])
    }

    /// How values of the criterion are told.
    fn words(&self) -> Words {
        self.design.map_or(Words::new(None), |(_, words)| words)
    }

    fn swarm(&mut self, stream: &RecordingStream, swarm: &SwarmIteration) -> RecordingStreamResult<()> {
        stream.set_time_sequence(ITERATIONS, swarm.iteration as i64);
        if !self.series_named {
            self.series_named = true;
            name_series(stream, swarm.fitness.len())?;
        }
        if !swarm.best_configurations.is_empty() {
            self.best.clone_from(&swarm.best_configurations);
            stream.log("world/swarm/best", &self.end_points(&self.best, 0.009))?;
            stream.log("world/design/end_points", &self.end_points(&self.best, 0.006))?;
        }
        if !self.best.is_empty() {
            // One configuration of the best set per iteration: playing the swarm moves the arm through the set.
            self.body.log_configuration(stream, &self.best[swarm.iteration % self.best.len()])?;
        }
        let colours = particle_colours(&swarm.fitness);
        let mut points = Vec::with_capacity(swarm.end_points.iter().map(Vec::len).sum());
        let mut point_colours = Vec::with_capacity(points.capacity());
        for (particle, end_points) in swarm.end_points.iter().enumerate() {
            points.extend_from_slice(end_points);
            let colour = colours.get(particle).copied().unwrap_or(POOR);
            point_colours.extend(std::iter::repeat_n(colour, end_points.len()));
        }
        let particles = Points3D::new(points).with_colors(point_colours).with_radii([self.size(0.004)]);
        stream.log("world/swarm/particles", &particles)?;

        let words = self.words();
        let scaled = |values: &[f64]| Scalars::new(values.iter().map(|value| words.scaled(*value)).collect::<Vec<_>>());
        stream.log("swarm/fitness/particles", &scaled(&swarm.fitness))?;
        stream.log("swarm/fitness/personal_best", &scaled(&swarm.personal_best))?;
        stream.log("swarm/fitness/best", &Scalars::new(swarm.best_value().map(|best| words.scaled(best))))?;
        stream.log("swarm/indexes", &Scalars::new(normalised(&swarm.best)))?;
        stream.log("swarm/effort", &Scalars::new([swarm.evaluations as f64, swarm.rejections as f64]))?;
        stream.log("swarm/coefficients", &Scalars::new([swarm.inertia, swarm.c1, swarm.c2]))?;
        self.summary.swarm(swarm, words);
        Ok(())
    }

    fn search(&mut self, stream: &RecordingStream, step: &SearchStep) -> RecordingStreamResult<()> {
        stream.set_time_sequence(EVALUATIONS, i64::try_from(step.evaluations).unwrap_or(i64::MAX));
        if !self.series_named {
            self.series_named = true;
            name_search(stream)?;
        }
        if !step.best_configurations.is_empty() {
            self.best.clone_from(&step.best_configurations);
            stream.log("world/design/end_points", &self.end_points(&self.best, 0.006))?;
        }
        if !self.best.is_empty() {
            // As with the swarm: playing the search moves the arm through the best set.
            self.body.log_configuration(stream, &self.best[step.step % self.best.len()])?;
        }
        let words = self.words();
        for (path, value) in [("search/criterion/best", step.best), ("search/criterion/current", step.value)] {
            // A set that determines nothing has no place in the chart.
            let scaled = words.scaled(value);
            if scaled.is_finite() && value > f64::MIN {
                stream.log(path, &Scalars::new([scaled]))?;
            }
        }
        stream.log("search/effort", &Scalars::new([step.evaluations as f64, step.rejections as f64]))?;
        self.summary.search(step, self.design.map_or("search", |(method, _)| method.name()), words);
        Ok(())
    }

    fn designed(&mut self, stream: &RecordingStream, design: &DesignOutcome) -> RecordingStreamResult<()> {
        stream.log("world/design/end_points", &self.end_points(&design.configurations, 0.006))?;
        let arms = design.configurations.iter().take(LINES).map(|joints| self.body.skeleton(joints));
        let arms = LineStrips3D::new(arms).with_colors([AMBER_LINES]);
        stream.log("world/design/configurations", &arms.with_radii([Radius::new_ui_points(0.5)]))?;
        if let Some(first) = design.configurations.first() {
            self.body.log_configuration(stream, first)?;
        }
        self.summary.designed(design);
        Ok(())
    }

    fn measured(&mut self, stream: &RecordingStream, measurement: &Measurement) -> RecordingStreamResult<()> {
        stream.set_time_sequence(POSES, measurement.index as i64);
        stream.set_duration_secs(TIME, measurement.time_s);
        self.body.log_configuration(stream, &measurement.joints)?;
        let orientation = measurement.orientation();
        let measured = Pose::from_parts(measurement.position().coords.into(), orientation.unwrap_or_default());
        stream.log("world/measured/now", &transform(&measured))?;
        if orientation.is_some() {
            stream.log("world/measured/now", &TransformAxes3D::new((0.09 * self.body.stretch) as f32))?;
        }
        self.roles.insert(measurement.index, measurement.role);
        if let Some(predicted) = self.body.tool(&measurement.joints) {
            stream.log("world/measured/predicted", &transform(&predicted))?;
            stream.log("world/measured/predicted", &TransformAxes3D::new((0.05 * self.body.stretch) as f32))?;
            let mut difference: [f64; 6] = pose_error(&measured, &predicted).into();
            if orientation.is_none() {
                difference[3..].fill(0.0);
            }
            // Measured and predicted poses are too close to be told apart in the cell: a label says how far they are.
            let mut label = format!("{} mm", significant(length(&difference[..3]) * 1e3, 3));
            if orientation.is_some() {
                label += &format!(", {}°", significant(length(&difference[3..]).to_degrees(), 3));
            }
            let here = Points3D::new([point(&measured.translation.vector)])
                .with_colors([PREDICTED])
                .with_radii([self.size(0.012)])
                .with_labels([label + " off nominal"])
                .with_show_labels(true);
            stream.log("world/measured/tool", &here)?;
            self.measured.push(Residual {
                index: measurement.index,
                position_m: measurement.position_m,
                nominal: difference,
                identified: [0.0; 6],
            });
            let block = (self.measured.len() - 1) / BLOCK;
            let members = &self.measured[block * BLOCK..];
            let points = Points3D::new(members.iter().map(|r| r.position_m.map(|x| x as f32)))
                .with_colors(members.iter().map(|r| role_colour(self.role(r))))
                .with_radii([self.size(0.01)]);
            stream.log(format!("world/measured/points/{block}"), &points)?;
        }

        if !measurement.temperatures_c.is_empty() {
            if !self.temperatures_named {
                self.temperatures_named = true;
                // The base link has no sensor.
                let links = &self.body.arm().links;
                let first = links.len().saturating_sub(measurement.temperatures_c.len());
                let names = links.iter().skip(first).map(|link| link.name.as_str());
                stream.log_static("temperatures", &SeriesLines::new().with_names(names.collect::<Vec<_>>()))?;
            }
            stream.log("temperatures", &Scalars::new(measurement.temperatures_c.iter().copied()))?;
        }
        self.conditions(stream, measurement)?;
        // Chart and arrows are drawn anew, ever more rarely, so that the work stays in proportion to the measurements.
        let count = self.measured.len();
        self.stale = true;
        if count <= BLOCK || count.is_multiple_of(count / (BLOCK / 2)) {
            self.catch_up(stream)?;
        }
        self.summary.measured(measurement);
        self.measurements.push(measurement.clone());
        Ok(())
    }

    /// Temperature of the air, payload, and where each joint came from.
    fn conditions(&mut self, stream: &RecordingStream, measurement: &Measurement) -> RecordingStreamResult<()> {
        if !self.conditions_named {
            self.conditions_named = true;
            stream.log_static("temperatures/air", &SeriesLines::new().with_names(["air"]))?;
            stream.log_static("conditions/payload", &SeriesLines::new().with_names(["payload"]))?;
            let joints = self.body.arm().chain.joints.iter().map(|joint| joint.name.as_str());
            stream.log_static("conditions/approach", &SeriesLines::new().with_names(joints.collect::<Vec<_>>()))?;
        }
        if let Some(ambient_c) = measurement.ambient_c {
            stream.log("temperatures/air", &Scalars::new([ambient_c]))?;
        }
        if let Some(payload_kg) = measurement.payload_kg {
            stream.log("conditions/payload", &Scalars::new([payload_kg]))?;
        }
        if !measurement.approach.is_empty() {
            // Each joint on a line of its own, at its number: above it where the joint came upwards.
            let place = |(joint, direction): (usize, &i8)| joint as f64 + 1.0 + 0.3 * f64::from(*direction);
            stream.log("conditions/approach", &Scalars::new(measurement.approach.iter().enumerate().map(place)))?;
        }
        Ok(())
    }

    /// Draws what was put off: to be called after the last event.
    pub(super) fn catch_up(&mut self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        if !self.stale || self.measured.is_empty() {
            return Ok(());
        }
        self.stale = false;
        let scale = self.arrows(stream, "before", &self.measured, |r| &r.nominal, [BEFORE, BEFORE_HELD_OUT])?;
        self.log_scales(stream, &[scale])?;
        self.log_errors(stream, &self.measured, false)
    }

    fn identified(&mut self, stream: &RecordingStream, identified: &Identification) -> RecordingStreamResult<()> {
        let residuals = &identified.residuals;
        let mut scales = Vec::new();
        if !residuals.is_empty() {
            scales.push(self.arrows(stream, "before", residuals, |r| &r.nominal, [BEFORE, BEFORE_HELD_OUT])?);
            scales.push(self.arrows(stream, "after", residuals, |r| &r.identified, [FIT, HELD_OUT])?);
            self.log_scales(stream, &scales)?;
        }
        self.log_errors(stream, residuals, true)?;
        by_joint::log(stream, "errors/by_joint", self.body.arm(), &self.measurements, residuals)?;
        self.stale = false;
        self.summary.identified(identified, &scales);
        Ok(())
    }

    /// Charts of the error of each configuration; `after`: those of the identified model too.
    fn log_errors(&self, stream: &RecordingStream, residuals: &[Residual], after: bool) -> RecordingStreamResult<()> {
        let kinds: [(&str, [u8; 3], Role, Vector); 4] = [
            ("before", BEFORE, Role::Fit, |r| &r.nominal),
            ("before, held out", BEFORE_HELD_OUT, Role::HeldOut, |r| &r.nominal),
            ("after", FIT, Role::Fit, |r| &r.identified),
            ("after, held out", HELD_OUT, Role::HeldOut, |r| &r.identified),
        ];
        let position: fn(&[f64; 6]) -> f64 = |six| length(&six[..3]);
        let orientation: fn(&[f64; 6]) -> f64 = |six| length(&six[3..]).to_degrees();
        for (path, unit, error) in [("errors/position", Unit::Metre, position), ("errors/attitude", Unit::Degree, orientation)] {
            let series: Vec<Series> = kinds[..if after { 4 } else { 2 }]
                .iter()
                .map(|(name, colour, role, vector)| {
                    let members = residuals.iter().filter(|r| self.role(r) == *role);
                    let values = members.map(|r| (r.index, error(vector(r)))).collect();
                    Series { name: (*name).to_owned(), colour: *colour, values }
                })
                .collect();
            chart::log(stream, path, unit, &series)?;
        }
        Ok(())
    }

    fn role(&self, residual: &Residual) -> Role {
        self.roles.get(&residual.index).copied().unwrap_or(Role::Fit)
    }

    /// Draws one set of residuals so that the mean arrow is about a tenth of the arm; returns the scale in words.
    fn arrows(
        &self,
        stream: &RecordingStream,
        name: &str,
        residuals: &[Residual],
        vector: Vector,
        [fit, held_out]: [[u8; 3]; 2],
    ) -> RecordingStreamResult<String> {
        let mean = residuals.iter().map(|r| length(&vector(r)[..3])).sum::<f64>() / residuals.len().max(1) as f64;
        let scale = if mean > 0.0 && mean.is_finite() { round(0.1 * self.body.stretch / mean) } else { 1.0 };
        let vectors = residuals.iter().map(|r| {
            let v = vector(r);
            [v[0], v[1], v[2]].map(|x| (x * scale) as f32)
        });
        let colours = residuals.iter().map(|r| if self.role(r) == Role::HeldOut { held_out } else { fit });
        let arrows = Arrows3D::from_vectors(vectors)
            .with_origins(residuals.iter().map(|r| r.position_m.map(|x| x as f32)))
            .with_colors(colours)
            .with_radii([self.size(0.0045)]);
        stream.log(format!("world/residuals/{name}"), &arrows)?;
        Ok(format!("{name}: arrows ×{scale}, 10 cm = {}", metres(0.1 / scale)))
    }

    /// The scales as labels above the arm.
    fn log_scales(&self, stream: &RecordingStream, scales: &[String]) -> RecordingStreamResult<()> {
        let up = self.up();
        let places = (0..scales.len()).map(|row| point(&(up * self.body.stretch * (1.12 - 0.09 * row as f64))));
        let labels = Points3D::new(places)
            .with_labels(scales.iter().map(String::as_str))
            .with_show_labels(true)
            .with_colors([BEFORE, FIT])
            .with_radii([Radius::new_ui_points(0.0)]);
        stream.log("world/residuals/scales", &labels)
    }
}

fn length(vector: &[f64]) -> f64 {
    vector.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// A length in the unit that reads best: `2 mm`, `20 µm`.
pub(super) fn metres(value: f64) -> String {
    let (factor, unit) = match value {
        _ if value >= 1.0 => (1.0, "m"),
        _ if value >= 1e-3 => (1e3, "mm"),
        _ if value >= 1e-6 => (1e6, "µm"),
        _ => (1e9, "nm"),
    };
    // Scales are round numbers: what is past the third digit is rounding.
    let rounded = libm::round(value * factor * 1e3) / 1e3;
    format!("{rounded} {unit}")
}

fn role_colour(role: Role) -> [u8; 3] {
    match role {
        Role::Fit => FIT,
        Role::HeldOut => HELD_OUT,
    }
}

/// The nearest of 1, 2 and 5 times a power of ten.
pub(super) fn round(value: f64) -> f64 {
    let power = libm::pow(10.0, libm::floor(libm::log10(value)));
    let ratio = value / power;
    let nearest = if ratio < 1.5 {
        1.0
    } else if ratio < 3.5 {
        2.0
    } else if ratio < 7.5 {
        5.0
    } else {
        10.0
    };
    nearest * power
}

/// O_C and what it is made of (eq. 27): each index as 2/π·atan, in (0, 1).
fn normalised(indexes: &Indexes) -> [f64; 6] {
    let squashed = |value: f64| std::f64::consts::FRAC_2_PI * libm::atan(value);
    [
        indexes.comprehensive,
        squashed(indexes.o1),
        squashed(indexes.o2),
        squashed(indexes.o3),
        squashed(indexes.dispersion_m2),
        squashed(indexes.evenness),
    ]
}

/// From poor to good by fitness.
fn particle_colours(fitness: &[f64]) -> Vec<[u8; 3]> {
    let (low, high) = fitness
        .iter()
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(*value), high.max(*value)));
    fitness
        .iter()
        .map(|value| {
            let share = if high > low && value.is_finite() { (value - low) / (high - low) } else { 0.0 };
            std::array::from_fn(|k| (f64::from(POOR[k]) + share * (f64::from(GOOD[k]) - f64::from(POOR[k]))) as u8)
        })
        .collect()
}

/// Names and colours of a search's curves, at all times. Steps may be few: each is a point on its curve.
fn name_search(stream: &RecordingStream) -> RecordingStreamResult<()> {
    for (path, name, colour, width) in
        [("search/criterion/best", "best", AMBER, 3.0), ("search/criterion/current", "current", CURVES[1], 1.5)]
    {
        stream.log_static(path, &SeriesLines::new().with_names([name]).with_colors([colour]).with_widths([width]))?;
        let points = SeriesPoints::new().with_names([name]).with_colors([colour]).with_marker_sizes([width]);
        stream.log_static(path, &points)?;
    }
    let effort = SeriesLines::new().with_names(["evaluations", "rejections"]);
    stream.log_static("search/effort", &effort.with_colors(CURVES[..2].iter().copied()))
}

/// Names, colours and widths of the curves, at all times.
fn name_series(stream: &RecordingStream, particles: usize) -> RecordingStreamResult<()> {
    let style = |names: &[&str], colours: &[[u8; 3]], widths: &[f32]| {
        SeriesLines::new()
            .with_names(names.iter().copied())
            .with_colors(colours.iter().copied())
            .with_widths(widths.iter().copied())
    };
    let faint = |name: &str, colour: [u8; 3]| {
        let names: Vec<String> = (0..particles).map(|particle| format!("{name} {particle}")).collect();
        SeriesLines::new().with_names(names).with_colors(vec![colour; particles]).with_widths(vec![1.0; particles])
    };
    stream.log_static("swarm/fitness/particles", &faint("particle", PERSONAL))?;
    stream.log_static("swarm/fitness/personal_best", &faint("best of particle", GOOD))?;
    stream.log_static("swarm/fitness/best", &style(&["best of swarm"], &[AMBER], &[3.0]))?;
    let widths = [3.0, 1.5, 1.5, 1.5, 1.5, 1.5];
    stream.log_static("swarm/indexes", &style(&["O_C", "O1", "O2", "O3", "D", "U"], &CURVES, &widths))?;
    stream.log_static("swarm/effort", &style(&["evaluations", "rejections"], &CURVES[..2], &[1.5; 2]))?;
    stream.log_static("swarm/coefficients", &style(&["ω", "c1", "c2"], &CURVES[..3], &[1.5; 3]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_written_in_the_unit_that_reads_best() {
        assert_eq!([0.002, 2e-5, 5e-8, 1.0].map(metres), ["2 mm", "20 µm", "50 nm", "1 m"]);
    }

    #[test]
    fn scales_are_round_numbers() {
        assert_eq!([0.9, 1.2, 2.2, 6.0, 8.0, 1700.0].map(round), [1.0, 1.0, 2.0, 5.0, 10.0, 2000.0]);
    }

    #[test]
    fn equal_fitness_has_a_colour_too() {
        assert_eq!(particle_colours(&[1.0, 1.0, f64::NAN]), [POOR; 3]);
        assert_eq!(particle_colours(&[0.0, 1.0]), [POOR, GOOD]);
    }
}
