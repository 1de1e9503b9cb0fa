//! The listener that shows a run: finding where to, and a thread that does it.

use std::net::{SocketAddr, TcpStream, ToSocketAddrs};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, channel, sync_channel};
use std::time::{Duration, Instant};

use rerun::external::re_uri::{ProxyUri, RedapUri};
use rerun::sink::{FileSink, GrpcSink, LogSink};

use super::picture::Picture;
use super::target::Target;
use crate::arm::Arm;
use crate::design::problem::DesignProblem;
use crate::event::Event;
use crate::progress::{Progress, Stopped};

/// How long a viewer is looked for where nobody asked for one.
const PROBE: Duration = Duration::from_millis(100);
/// How long a viewer is looked for where it was asked for.
const CONNECT: Duration = Duration::from_secs(1);
/// How long a run waits for a viewer that takes nothing any more, before it goes on without it.
const STALL: Duration = Duration::from_secs(2);
/// How long the end of a run waits for a viewer to take the rest.
const FINISH: Duration = Duration::from_secs(5);
/// Events that may be on their way to the viewer.
const QUEUE: usize = 64;

/// The run cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum ViewerError {
    /// The URL is none.
    #[error("`{url}` is no address of a Rerun viewer ({reason}); it looks like rerun+http://127.0.0.1:9876/proxy")]
    Url {
        /// As given.
        url: String,
        /// Why it is none.
        reason: String,
    },
    /// Silent listens where a viewer was expected.
    #[error("no Rerun viewer listens at {url} ({reason}); start one with `rerun`, or ask for `spawn`")]
    Absent {
        /// The address tried.
        url: String,
        /// What the connection attempt ended with.
        reason: String,
    },
    /// The viewer's program is not installed.
    #[error(
        "there is no program `rerun` on PATH to show the run with; install it with `pip install rerun-sdk=={version}` or \
         `cargo install rerun-cli --version {version} --locked`, or write a file with FILE.rrd",
        version = rerun::build_info().version
    )]
    NotInstalled,
    /// The viewer's program could not be started.
    #[error("the Rerun viewer could not be started: {0}")]
    Spawn(String),
    /// The file cannot be created.
    #[error("{} cannot be written: {reason}", path.display())]
    Create {
        /// The file.
        path: PathBuf,
        /// What creating it ended with.
        reason: String,
    },
    /// The file could not be written to its end.
    #[error("{} could not be written completely: {reason}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What writing it ended with.
        reason: String,
    },
    /// A link cannot be placed.
    #[error("link `{link}` has no frame in the chain, whose frames are {frames}; it cannot be drawn")]
    LinkWithoutFrame {
        /// The link.
        link: String,
        /// Names of the chain's frames.
        frames: String,
    },
    /// The viewer has gone or does not keep up.
    #[error("the Rerun viewer at {url} went away before the run ended; the run itself is complete")]
    Lost {
        /// Where it was.
        url: String,
    },
    /// Rerun refused something.
    #[error("the run could not be drawn: {0}")]
    Draw(String),
}

/// Where the picture goes.
#[derive(Clone, Debug)]
enum Destination {
    Stream(String),
    File(PathBuf),
}

impl Destination {
    /// How long the end of the run may wait; files are waited for.
    fn patience(&self) -> Option<Duration> {
        match self {
            Destination::Stream(_) => Some(FINISH),
            Destination::File(_) => None,
        }
    }

    /// How long rows are collected before they are sent. Many small parcels cost a viewer memory and make a file slow to load;
    /// at the SDK's own choice for viewers, every row is one.
    fn batch(&self) -> Duration {
        match self {
            Destination::Stream(_) => Duration::from_millis(100),
            Destination::File(_) => Duration::from_secs(10),
        }
    }

    fn failed(&self, reason: String) -> ViewerError {
        match self {
            Destination::Stream(url) => ViewerError::Lost { url: url.clone() },
            Destination::File(path) => ViewerError::Write { path: path.clone(), reason },
        }
    }
}

/// Shows a run while it happens, or when it is replayed.
#[derive(Debug)]
pub struct Viewer {
    destination: Destination,
    events: Option<SyncSender<Event>>,
    result: Receiver<Result<(), ViewerError>>,
    lost: bool,
}

/// Opens the place where a run of `arm` is shown: `None` where it is not to be shown, or where nobody looks.
///
/// `arm` is the nominal arm; `design` the problem that is solved in the run, which names its method and criterion; `name` is the recording's name in the viewer. Runs of one name, arm, scene and command have one
/// recording id.
///
/// # Errors
/// If the viewer that was asked for is not there, or the file cannot be written. [`Target::Auto`] and [`Target::Off`] fail only
/// for an arm that cannot be drawn.
pub fn open(target: &Target, arm: &Arm, design: Option<&DesignProblem>, name: &str) -> Result<Option<Viewer>, ViewerError> {
    let (destination, sink): (Destination, Box<dyn LogSink>) = match target {
        Target::Off => return Ok(None),
        Target::Auto => {
            if !listens(&SocketAddr::from(([127, 0, 0, 1], rerun::DEFAULT_SERVER_PORT)), PROBE) {
                return Ok(None);
            }
            let url = rerun::DEFAULT_CONNECT_URL.to_owned();
            let uri = proxy_uri(&url)?;
            (Destination::Stream(url), Box::new(GrpcSink::new(uri)))
        }
        Target::Connect(url) => {
            let url = url.as_deref().map_or_else(|| rerun::DEFAULT_CONNECT_URL.to_owned(), full_url);
            let uri = proxy_uri(&url)?;
            probe(&uri, &url)?;
            (Destination::Stream(url), Box::new(GrpcSink::new(uri)))
        }
        Target::Spawn => {
            let url = spawn()?;
            let uri = proxy_uri(&url)?;
            (Destination::Stream(url), Box::new(GrpcSink::new(uri)))
        }
        Target::File(path) => {
            let create = |reason: String| ViewerError::Create { path: path.clone(), reason };
            if let Some(folder) = path.parent() {
                std::fs::create_dir_all(folder).map_err(|error| create(error.to_string()))?;
            }
            let sink = FileSink::new(path).map_err(|error| create(innermost(&error)))?;
            (Destination::File(path.clone()), Box::new(sink))
        }
    };
    Viewer::start(destination, sink, Picture::new(arm, design, name)?).map(Some)
}

fn listens(address: &SocketAddr, timeout: Duration) -> bool {
    TcpStream::connect_timeout(address, timeout).is_ok()
}

/// `10.0.0.7:9876` is enough of an address.
fn full_url(url: &str) -> String {
    if url.contains("://") { url.to_owned() } else { format!("rerun+http://{url}/proxy") }
}

fn proxy_uri(url: &str) -> Result<ProxyUri, ViewerError> {
    let refused = |reason: String| ViewerError::Url { url: url.to_owned(), reason };
    match url.parse::<RedapUri>() {
        Ok(RedapUri::Proxy(uri)) => Ok(uri),
        Ok(_) => Err(refused("it does not end in /proxy".to_owned())),
        Err(error) => Err(refused(error.to_string())),
    }
}

/// Whether somebody listens at `uri`: gRPC alone would retry in the background without end.
fn probe(uri: &ProxyUri, url: &str) -> Result<(), ViewerError> {
    let absent = |reason: String| ViewerError::Absent { url: url.to_owned(), reason };
    let host = format!("{}:{}", uri.origin.host, uri.origin.port);
    let addresses = host.to_socket_addrs().map_err(|error| absent(error.to_string()))?;
    let mut reason = "the name has no address".to_owned();
    for address in addresses {
        match TcpStream::connect_timeout(&address, CONNECT) {
            Ok(_) => return Ok(()),
            Err(error) => reason = error.to_string(),
        }
    }
    Err(absent(reason))
}

/// Starts a viewer, or finds one on the default port; returns its URL.
fn spawn() -> Result<String, ViewerError> {
    let default = SocketAddr::from(([127, 0, 0, 1], rerun::DEFAULT_SERVER_PORT));
    if listens(&default, PROBE) {
        return Ok(rerun::DEFAULT_CONNECT_URL.to_owned());
    }
    if !is_on_path("rerun") {
        return Err(ViewerError::NotInstalled);
    }
    let options = rerun::SpawnOptions { hide_welcome_screen: true, wait_for_bind: true, ..Default::default() };
    rerun::spawn(&options).map_err(|error| ViewerError::Spawn(error.to_string()))?;
    if !listens(&default, CONNECT) {
        return Err(ViewerError::Spawn("it ended or does not listen; is there a screen it can open a window on?".to_owned()));
    }
    Ok(rerun::DEFAULT_CONNECT_URL.to_owned())
}

fn is_on_path(program: &str) -> bool {
    let file = format!("{program}{}", std::env::consts::EXE_SUFFIX);
    std::env::var_os("PATH").is_some_and(|path| std::env::split_paths(&path).any(|folder| is_file(&folder.join(&file))))
}

fn is_file(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|metadata| metadata.is_file())
}

/// The message of the error at the bottom: `Permission denied (os error 13)` rather than a chain of wrappers.
fn innermost(error: &dyn std::error::Error) -> String {
    let mut error = error;
    while let Some(source) = error.source() {
        error = source;
    }
    error.to_string()
}

impl Viewer {
    fn start(destination: Destination, sink: Box<dyn LogSink>, picture: Picture) -> Result<Viewer, ViewerError> {
        let (events, queue) = sync_channel(QUEUE);
        let (done, result) = channel();
        let to = destination.clone();
        std::thread::Builder::new()
            .name("viewer".to_owned())
            .spawn(move || {
                let outcome = show(picture, sink, &queue, &to);
                // Silent is left to hear it if the run has ended without waiting.
                drop(queue);
                done.send(outcome).ok();
            })
            .map_err(|error| ViewerError::Draw(error.to_string()))?;
        Ok(Viewer { destination, events: Some(events), result, lost: false })
    }

    /// One line for the user: where the run is shown.
    #[must_use]
    pub fn describe(&self) -> String {
        match &self.destination {
            Destination::Stream(url) => format!("streaming to the Rerun viewer at {url}"),
            Destination::File(path) => {
                format!("writing the Rerun recording {path} (open it with `rerun {path}`)", path = path.display())
            }
        }
    }

    /// Waits until all that was taken is shown or written, for a limited time where a viewer may have gone.
    ///
    /// # Errors
    /// If the viewer went away or the file could not be written completely. The run itself is not concerned.
    pub fn finish(mut self) -> Result<(), ViewerError> {
        self.end()
    }

    fn end(&mut self) -> Result<(), ViewerError> {
        if self.events.take().is_none() {
            return Ok(());
        }
        if self.lost {
            return Err(self.destination.failed("it stopped taking events".to_owned()));
        }
        let outcome = match self.destination.patience() {
            Some(patience) => self.result.recv_timeout(patience),
            None => self.result.recv().map_err(|_| RecvTimeoutError::Disconnected),
        };
        // A thread that is stuck in a dead connection is left behind: it ends with the process.
        outcome.unwrap_or_else(|error| Err(self.destination.failed(error.to_string())))
    }

    fn send(&mut self, event: Event) {
        let Some(events) = self.events.as_ref().filter(|_| !self.lost) else { return };
        let mut event = event;
        let since = Instant::now();
        loop {
            match events.try_send(event) {
                Ok(()) => return,
                Err(TrySendError::Disconnected(_)) => break,
                Err(TrySendError::Full(returned)) => {
                    if self.destination.patience().is_some() && since.elapsed() > STALL {
                        break;
                    }
                    event = returned;
                    std::thread::sleep(Duration::from_millis(1));
                }
            }
        }
        self.lost = true;
    }
}

impl Progress<&Event> for Viewer {
    /// Never an error for a viewer that has gone: closing its window ends no run. A file that cannot be drawn into is one.
    fn report(&mut self, event: &Event) -> Result<(), Stopped> {
        self.send(event.clone());
        if self.lost && matches!(self.destination, Destination::File(_)) {
            let reason = match self.result.try_recv() {
                Ok(Err(error)) => error.to_string(),
                _ => self.destination.failed("it stopped taking events".to_owned()).to_string(),
            };
            return Err(Stopped(reason));
        }
        Ok(())
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        // Whoever wants to know how it ended calls `finish`.
        self.end().ok();
    }
}

/// Draws every event until there are no more, and sees that they arrive.
fn show(
    mut picture: Picture,
    sink: Box<dyn LogSink>,
    events: &Receiver<Event>,
    destination: &Destination,
) -> Result<(), ViewerError> {
    let draw = |error: rerun::RecordingStreamError| ViewerError::Draw(error.to_string());
    let Ok(first) = events.recv() else { return Ok(()) };
    let stream = picture.begin(&first, sink, destination.batch()).map_err(draw)?;
    picture.take(&stream, &first).map_err(draw)?;
    while let Ok(event) = events.recv() {
        picture.take(&stream, &event).map_err(draw)?;
    }
    picture.catch_up(&stream).map_err(draw)?;
    let patience = destination.patience().unwrap_or(Duration::MAX);
    let flushed = stream.flush_with_timeout(patience);
    // The file's footer is written when the stream goes.
    drop(stream);
    flushed.map_err(|error| destination.failed(error.to_string()))
}
