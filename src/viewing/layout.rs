//! The blueprint: which views a run opens on.
//!
//! Written with the blueprint archetypes themselves, because the SDK's `Blueprint` type cannot set a view's properties (camera,
//! legends, bounds). Its messages are the same.

use re_sdk_types::blueprint::archetypes::{
    Background, ContainerBlueprint, EyeControls3D, LineGrid3D, PanelBlueprint, PlotLegend, TimePanelBlueprint, ViewBlueprint,
    ViewContents, ViewportBlueprint, VisualBounds2D as VisualBounds,
};
use re_sdk_types::blueprint::components::{
    ActiveTab, BackgroundKind, ColumnShare, ContainerKind, Corner2D, Eye3DKind, Fps, IncludedContent, PanelState, PlayState,
    QueryExpression, RootContainer, RowShare, TimelineName, ViewClass, VisualBounds2D,
};
use re_sdk_types::components::{Name, Position3D, Vector3D};
use re_sdk_types::datatypes::{Float32, Float64, Range1D, Range2D, Uuid};
use rerun::EntityPath;
use rerun::external::re_log_types::BlueprintActivationCommand;
use rerun::{AsComponents, RecordingStream, RecordingStreamBuilder, RecordingStreamResult};

use super::{by_joint, chart, diagnosis, picture};
use crate::design::problem::Method;
use crate::report::criterion::Words;

const BACKGROUND: [u8; 3] = [20, 22, 28];

/// What there is to see of the choosing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Choosing {
    /// It is not done.
    Not,
    /// The paper's swarm.
    Swarm(Words),
    /// Any other method.
    Search(Words),
}

/// Which parts of a run there are to see.
#[derive(Clone, Copy, Debug)]
pub(super) struct Parts {
    pub(super) choosing: Choosing,
    pub(super) measured: bool,
    pub(super) diagnosed: bool,
    /// Whether the diagnosis is what is opened on.
    pub(super) diagnosis_first: bool,
}

impl Parts {
    /// What the run of a command shows; all of it for a command that is not known here.
    pub(super) fn of(command: &str, design: Option<(Method, Words)>) -> Parts {
        let choosing = match design {
            _ if matches!(command, "measure" | "identify" | "diagnose") => Choosing::Not,
            None => Choosing::Not,
            Some((Method::Pso, words)) => Choosing::Swarm(words),
            Some((_, words)) => Choosing::Search(words),
        };
        Parts {
            choosing,
            measured: command != "design",
            diagnosed: !matches!(command, "design" | "measure" | "identify"),
            diagnosis_first: command == "diagnose",
        }
    }
}

/// How the scene is looked at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Camera {
    pub(super) position: [f32; 3],
    pub(super) target: [f32; 3],
    pub(super) up: [f32; 3],
}

enum Node {
    View {
        class: &'static str,
        name: String,
        contents: Vec<&'static str>,
        properties: Vec<(&'static str, Box<dyn AsComponents>)>,
    },
    Container {
        kind: ContainerKind,
        /// Shown where it is a tab; empty for none.
        name: &'static str,
        children: Vec<(f32, Node)>,
    },
}

fn view(class: &'static str, name: impl Into<String>, contents: &[&'static str]) -> Node {
    Node::View { class, name: name.into(), contents: contents.to_vec(), properties: Vec::new() }
}

fn rows(children: Vec<(f32, Node)>) -> Node {
    Node::Container { kind: ContainerKind::Vertical, name: "", children }
}

fn columns(children: Vec<(f32, Node)>) -> Node {
    Node::Container { kind: ContainerKind::Horizontal, name: "", children }
}

fn tabs(children: Vec<Node>) -> Node {
    Node::Container { kind: ContainerKind::Tabs, name: "", children: children.into_iter().map(|child| (1.0, child)).collect() }
}

impl Node {
    fn with(mut self, name: &'static str, archetype: impl AsComponents + 'static) -> Node {
        if let Node::View { properties, .. } = &mut self {
            properties.push((name, Box::new(archetype)));
        }
        self
    }

    fn named(mut self, title: &'static str) -> Node {
        if let Node::Container { name, .. } = &mut self {
            *name = title;
        }
        self
    }

    /// Logs the node and what is in it; returns its path and number.
    fn log(self, stream: &RecordingStream, next: &mut u8) -> RecordingStreamResult<(EntityPath, Uuid)> {
        *next += 1;
        let id = Uuid { bytes: [0x6b, 0x69, 0x6e, 0x63, 0x61, 0x6c, 0x40, 0, 0x80, 0, 0, 0, 0, 0, 0, *next] };
        match self {
            Node::View { class, name, contents, properties } => {
                let path = format!("view/{id}");
                let queries = contents.iter().map(|query| QueryExpression((*query).into()));
                stream.log(format!("{path}/ViewContents"), &ViewContents::new(queries))?;
                let blueprint = ViewBlueprint::new(ViewClass(class.into())).with_display_name(Name(name.into()));
                stream.log(path.as_str(), &blueprint.with_space_origin("/"))?;
                for (property, archetype) in properties {
                    stream.log(format!("{path}/{property}"), archetype.as_ref())?;
                }
                Ok((path.into(), id))
            }
            Node::Container { kind, name, children } => {
                let mut shares = Vec::new();
                let mut contents = Vec::new();
                for (share, child) in children {
                    shares.push(Float32(share));
                    contents.push(child.log(stream, next)?.0.to_string());
                }
                let mut container = ContainerBlueprint::new(kind);
                container = match kind {
                    ContainerKind::Horizontal => container.with_col_shares(shares.into_iter().map(ColumnShare)),
                    ContainerKind::Vertical => container.with_row_shares(shares.into_iter().map(RowShare)),
                    _ => match contents.first() {
                        Some(first) => container.with_active_tab(ActiveTab(first.as_str().into())),
                        None => container,
                    },
                };
                if !name.is_empty() {
                    container = container.with_display_name(Name(name.into()));
                }
                let path = format!("container/{id}");
                let contents = contents.into_iter().map(|content| IncludedContent(content.into()));
                stream.log(path.as_str(), &container.with_contents(contents))?;
                Ok((path.into(), id))
            }
        }
    }
}

fn scene(name: &str, contents: &[&'static str], camera: Camera) -> Node {
    let eye = EyeControls3D::new()
        .with_kind(Eye3DKind::Orbital)
        .with_position(Position3D::from(camera.position))
        .with_look_target(Position3D::from(camera.target))
        .with_eye_up(Vector3D::from(camera.up));
    view("3D", name, contents)
        .with("EyeControls3D", eye)
        .with("LineGrid3D", LineGrid3D::new().with_visible(false))
        .with("Background", Background::new(BackgroundKind::SolidColor).with_color(BACKGROUND))
}

fn plot(name: &str, contents: &[&'static str], legend: bool) -> Node {
    legend_at(Corner2D::RightBottom, name, contents, legend)
}

fn legend_at(corner: Corner2D, name: &str, contents: &[&'static str], legend: bool) -> Node {
    let legend = PlotLegend::new().with_visible(legend).with_corner(corner);
    view("TimeSeries", name, contents).with("PlotLegend", legend)
}

fn error_chart(name: &str, path: &'static str) -> Node {
    drawing(name, path, chart::BOUNDS)
}

/// A drawing in a plane that fills `x` and `y` ranges.
fn drawing(name: &str, path: &'static str, [x, y]: [[f64; 2]; 2]) -> Node {
    let bounds = VisualBounds2D(Range2D { x_range: Range1D(x), y_range: Range1D(y) });
    view("2D", name, &[path]).with("VisualBounds2D", VisualBounds::new(bounds))
}

/// The pages: what is done, and what is diagnosed of it.
fn pages(parts: Parts, camera: Camera, joints: usize) -> Node {
    let run = tree(parts, camera, joints).named("Calibration");
    if !parts.diagnosed {
        return run;
    }
    let contents = ["/world/base/**", "/world/cell/**", "/world/diagnosis/**"];
    // Nearer than where an arm stands in the picture.
    let near = |from: f32, to: f32| to + 0.8 * (from - to);
    let position = std::array::from_fn(|axis| near(camera.position[axis], camera.target[axis]));
    let closer = Camera { position, ..camera };
    let residuals = scene("Residuals by cause: geometry alone (strong), with the causes (pale)", &contents, closer);
    let waterfall = drawing("Held-out RMS", "/diagnosis/waterfall/**", diagnosis::BOUNDS);
    let report = view("TextDocument", "Report", &["/diagnosis/report"]);
    let diagnosis = columns(vec![(5.0, residuals), (4.0, rows(vec![(4.0, waterfall), (5.0, report)]))]).named("Diagnosis");
    tabs(if parts.diagnosis_first { vec![diagnosis, run] } else { vec![run, diagnosis] })
}

/// The views of what is done.
fn tree(parts: Parts, camera: Camera, joints: usize) -> Node {
    let summary = view("TextDocument", "Summary", &["/summary"]);
    let notes = view("TextLog", "Notes", &["/notes/**"]);
    let mut cell = vec!["/world/base/**", "/world/cell/**", "/world/arm/**", "/world/arm_line/**", "/world/design/**"];
    let mut cell_name = "Cell: arm, chosen end points (amber)".to_owned();
    if parts.measured {
        cell.push("/world/measured/**");
        cell_name = "Cell: arm; chosen (amber), measured (green), held out (violet)".to_owned();
    }
    let cell = scene(&cell_name, &cell, camera);
    let swarm = || {
        let contents = ["/world/base/**", "/world/cell/**", "/world/swarm/**"];
        scene("Swarm: end points; best set amber, others by fitness", &contents, camera)
    };
    let residuals = || {
        scene(
            "Residuals: measured minus predicted, before and after",
            &["/world/base/**", "/world/cell/**", "/world/residuals/**"],
            camera,
        )
    };
    let indexes = || plot("Indexes of the best set: O_C and its parts as 2/π·atan", &["/swarm/indexes/**"], true);
    let effort = |path| plot("Evaluations, rejections", &[path], true);
    let fitness = |words: Words| {
        let name = format!("{}: swarm's best (amber), particles", capital(words.quantity()));
        tabs(vec![
            plot(&name, &["/swarm/fitness/**"], false),
            effort("/swarm/effort/**"),
            plot("ω, c1, c2", &["/swarm/coefficients/**"], true),
        ])
    };
    let search =
        |words: Words| tabs(vec![plot(&capital(words.quantity()), &["/search/criterion/**"], true), effort("/search/effort/**")]);
    let position = error_chart("Position error", "/errors/position/**");
    let orientation = error_chart("Orientation error", "/errors/attitude/**");
    let by_joint =
        || drawing("What is left, joint by joint: came up (amber), down (blue)", "/errors/by_joint/**", by_joint::bounds(joints));
    let conditions = || {
        vec![
            plot("Temperatures, °C", &["/temperatures/**"], true),
            plot("Payload, kg", &["/conditions/payload/**"], true),
            plot("Approach: each joint at its number, up or down", &["/conditions/approach/**"], true),
        ]
    };
    let side = tabs(vec![summary, notes]);
    match (parts.choosing, parts.measured) {
        (Choosing::Swarm(words), false) => columns(vec![
            (4.0, rows(vec![(3.0, cell), (2.0, indexes())])),
            (3.0, rows(vec![(3.0, swarm()), (2.0, fitness(words))])),
            (3.0, side),
        ]),
        (Choosing::Swarm(words), true) => columns(vec![
            (4.0, rows(vec![(10.0, cell), (5.0, indexes()), (4.0, fitness(words))])),
            (4.0, rows(vec![(1.0, residuals()), (1.0, tabs(vec![swarm(), by_joint()]))])),
            (3.0, rows(vec![(2.0, side), (1.0, tabs([position, orientation].into_iter().chain(conditions()).collect()))])),
        ]),
        (Choosing::Search(words), false) => columns(vec![(2.0, rows(vec![(3.0, cell), (2.0, search(words))])), (1.0, side)]),
        (Choosing::Search(words), true) => columns(vec![
            (4.0, rows(vec![(10.0, cell), (6.0, search(words))])),
            (4.0, rows(vec![(10.0, residuals()), (6.0, tabs(vec![by_joint(), position, orientation]))])),
            (3.0, rows(vec![(2.0, side), (1.0, tabs(conditions()))])),
        ]),
        (Choosing::Not, _) => {
            let scenes = columns(vec![(1.0, cell), (1.0, residuals())]);
            let charts = columns(vec![(3.0, by_joint()), (2.0, tabs(vec![position, orientation]))]);
            columns(vec![
                (8.0, rows(vec![(5.0, scenes), (3.0, charts)])),
                (3.0, rows(vec![(2.0, side), (1.0, tabs(conditions()))])),
            ])
        }
    }
}

/// A title begins with a capital letter.
fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map(|first| first.to_uppercase().chain(letters).collect()).unwrap_or_default()
}

/// Sends the blueprint of a run and makes it the active one.
pub(super) fn send(
    stream: &RecordingStream,
    application: &'static str,
    parts: Parts,
    camera: Camera,
    joints: usize,
) -> RecordingStreamResult<()> {
    let (blueprint, storage) = RecordingStreamBuilder::new(application).enabled(true).blueprint().memory()?;
    blueprint.set_time_sequence("blueprint", 0);
    let (_, root) = pages(parts, camera, joints).log(&blueprint, &mut 0)?;
    let viewport =
        ViewportBlueprint::new().with_root_container(RootContainer(root)).with_auto_layout(false).with_auto_views(false);
    blueprint.log("viewport", &viewport)?;
    blueprint.log("blueprint_panel", &PanelBlueprint::new().with_state(PanelState::Hidden))?;
    blueprint.log("selection_panel", &PanelBlueprint::new().with_state(PanelState::Hidden))?;
    // Following: the picture is the newest one, live and when a file is opened.
    let time = TimePanelBlueprint::new()
        .with_state(PanelState::Collapsed)
        .with_timeline(TimelineName(picture::EVENTS.into()))
        .with_play_state(PlayState::Following)
        .with_fps(Fps(Float64(12.0)));
    blueprint.log("time_panel", &time)?;
    let Some(id) = blueprint.store_info().map(|info| info.store_id) else { return Ok(()) };
    let messages = storage.take();
    stream.send_blueprint(messages, BlueprintActivationCommand::make_active(id));
    Ok(())
}
