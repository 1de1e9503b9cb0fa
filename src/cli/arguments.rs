//! Arguments of every command.

use std::path::PathBuf;

use clap::builder::{PossibleValue, PossibleValuesParser};
use clap::{Args, Parser, Subcommand, ValueEnum};

use crate::identification::ladder::Freedom;

/// Calibration of robot arms with a physics simulator in the loop.
#[derive(Debug, Parser)]
#[command(
    name = "kincal",
    version,
    about = "Calibrate robot arms: choose configurations, measure them (in a physics simulator or for real), identify the \
             geometry, and keep a recording that replays bit for bit.",
    after_help = "Examples:\n  \
        kincal run scenes/arm8.toml                        the whole chain, to recordings/arm8.mcap\n  \
        kincal run scenes/arm8.toml --json > result.json   the same for a program\n  \
        kincal replay recordings/arm8.mcap                 recompute it and compare bit for bit\n  \
        kincal identify cell.csv --robot ur5.urdf          calibrate a real arm from a table\n\n\
        Exit codes: 0 done; 1 done, but the answer is bad (no convergence, a replay that differs); 2 the input is wrong."
)]
pub(crate) struct Arguments {
    #[command(flatten)]
    pub(crate) global: Global,
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// Options of every command.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Options of every command")]
pub(crate) struct Global {
    /// Print one JSON object on stdout; everything else goes to stderr
    #[arg(long, global = true)]
    pub(crate) json: bool,
    /// Seed in place of the scene's; file names then end in -seedN
    #[arg(long, global = true, value_name = "N")]
    pub(crate) seed: Option<u64>,
    /// Number of threads (the result does not depend on it)
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(crate) threads: Option<u16>,
    /// No progress bars and no remarks on stderr
    #[arg(long, short, global = true)]
    pub(crate) quiet: bool,
    /// Folder for what is written
    #[arg(long, global = true, value_name = "DIR", default_value = "recordings")]
    pub(crate) out: PathBuf,
    /// Where to show the run: `auto` (a viewer that listens), `spawn`, `connect[=URL]`, `FILE.rrd`, `off`
    #[arg(long, global = true, value_name = "TARGET", default_value = "auto")]
    pub(crate) rerun: String,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// The whole chain: design, measurement, identification
    #[command(after_help = "Example:\n  kincal run scenes/arm8.toml --set design.count=20 --seed 7 --rerun run.rrd")]
    Run(SceneOptions),
    /// Choose the configurations to measure
    #[command(after_help = "Example:\n  kincal design scenes/arm8.toml --set design.method=random\n\n\
        Beside the recording, OUT/NAME-design.csv has the configurations in an order in which the moves are short, from the middle of the\n\
        joints' limits on; collisions on the way are not looked at.")]
    Design(SceneOptions),
    /// Measure configurations on the simulated arm
    #[command(after_help = "Example:\n  kincal measure scenes/arm8.toml --design recordings/arm8-design.mcap\n  \
        kincal measure scenes/arm8.toml --design poses-joints.csv")]
    Measure(MeasureOptions),
    /// Identify the geometry from a recording or a table of measurements
    #[command(after_help = "Examples:\n  kincal identify recordings/arm8-measure.mcap\n  \
        kincal identify grid.csv --robot ur5.urdf --evaluate random.csv --position-noise-um 25\n\n\
        A table's header names columns and units: q1_rad… (or _deg), x_m, y_m, z_m (or _mm; those that were\n\
        read, a cell may be empty), optional qx, qy, qz, qw, pose_id, time_s, role (fit, held_out), temp1_c…. The measurement frame and the target on the flange are fitted.")]
    Identify(IdentifyOptions),
    /// Say which un-modelled effect causes what calibration leaves, where, and with what probability
    #[command(after_help = "Examples:\n  kincal diagnose recordings/arm8-measure.mcap\n  \
        kincal diagnose grid.csv --robot ur5.urdf --position-noise-um 25 --json\n  \
        kincal diagnose recordings/arm8-measure.mcap --confirm       what is named, again from the physics\n\n\
        Besides the columns of `kincal identify` a table may have approach1… (-1, 0, 1), temp_ambient_c, payload_kg, dwell_s,\n\
        session and target. What is missing switches off what needs it. Exit code 1: there is a gap that is not explained, or\n\
        --confirm finds that the physics disagrees: it moves the target otherwise than the formulas of first order (by more than 5 %\n\
        and more than a fifth of the noise floor), its held-out RMS differs from theirs by more than that, or stays above the\n\
        diagnosis' own by more than half of it.")]
    Diagnose(DiagnoseOptions),
    /// Make a table of measurements out of a bag of ROS 2
    #[command(after_help = "Examples:\n  kincal import bag/ --robot ur5.urdf\n  \
        kincal import bag.mcap --robot ur5.urdf --poses /tf:marker --out tables\n  \
        kincal identify tables/bag.csv --robot ur5.urdf\n\n\
        Joints are read from sensor_msgs/JointState by their names in the URDF; poses from PoseStamped, PoseWithCovarianceStamped,\n\
        PointStamped, TransformStamped, Odometry and TFMessage. There is a row for each time that the arm stood still (the mean of what\n\
        was read), or for each pose where it never did. Where the arm moves, the program finds by how much poses are stamped late.")]
    Import(ImportOptions),
    /// Joint angles at which a calibrated robot reaches wanted poses
    #[command(after_help = "Examples:\n  kincal correct --robot recordings/cell-identified.urdf --targets poses.csv\n  \
        kincal correct --measurements cell.csv --robot ur5.urdf --targets poses.csv     with the effects that a diagnosis names\n\n\
        The table has x_mm, y_mm, z_mm (or _m) of the tip in the root's frame, and qx, qy, qz, qw or three angles (--euler) where orientations\n\
        count; joint columns say where each pose is looked for, else it is the nearest to the one before. A robot that was calibrated with\n\
        --with-frames takes poses of the target in the measurement frame. With --measurements, sides of approach follow from the order of the\n\
        poses (the first comes from the last one measured), or from approach1 …; payload_kg and temperatures count where effects go with\n\
        them. Exit code 1: a pose is out of reach.")]
    Correct(CorrectOptions),
    /// Recompute a recording and compare bit for bit
    #[command(after_help = "Examples:\n  kincal replay recordings/arm8.mcap\n  \
        kincal replay recordings/arm8.mcap --truth recordings/arm8.truth.toml\n  \
        kincal replay recordings/arm8.mcap --rerun spawn")]
    Replay(ReplayOptions),
    /// Write a robot or measurements in another format
    #[command(after_help = "Examples:\n  kincal export scenes/arm8.toml --to urdf\n  \
        kincal export recordings/arm8.mcap --to urdf        the calibrated arm\n  \
        kincal export recordings/arm8.mcap --to csv         the measurements")]
    Export(ExportOptions),
    /// Repeat experiments of Chen et al. 2019 beside their published numbers
    #[command(
        after_help = "Examples:\n  kincal reproduce                                             everything, on all arms\n  \
        kincal reproduce count-error --arm scenes/paper.toml --trials 20\n\n\
        Tables (CSV) and figures (SVG, PNG) go to OUT/reproduce/SCENE/."
    )]
    Reproduce(ReproduceOptions),
    /// List the un-modelled effects that can be simulated, or check each against an independent solution
    #[command(
        after_help = "Examples:\n  kincal effects                       what there is, where, in which unit and range, and its keys\n  \
        kincal effects scenes/arm8.toml      each on this arm against statics, 200 random configurations"
    )]
    Effects(EffectsOptions),
    /// What un-modelled effects do to a calibration: effect × place × magnitude × design × trials
    #[command(after_help = "Examples:\n  \
            kincal sweep scenes/arm8.toml --effect radial_clearance --at joint3 --magnitudes 0,10,30,60um\n  \
            kincal sweep scenes/arm8.toml --effect backlash --at joint2,joint5 --approach up,random --poses 20,40 --trials 200\n  \
            kincal sweep scenes/arm8.toml --effect joint_compliance --magnitudes 0,50urad/Nm --payloads 0 --payloads 0,5\n  \
            kincal sweep scenes/arm8.toml                        as the scene injects it\n\n\
            In parts, anywhere, to the same bytes:\n  \
            kincal sweep scenes/arm8.toml --effect tilt_clearance --trials 0..500 --out a\n  \
            kincal sweep scenes/arm8.toml --effect tilt_clearance --trials 500..1000 --out b\n  \
            kincal sweep --merge a b --out both\n\n\
            Every combination of the values of all axes is a cell; each trial is a true arm, verification and noise of its own, the same\n\
            in every cell. Axes that are not given stay as the scene has them. A file for --grid has the same names:\n  \
            effect = [\"backlash\"]\n  at = [\"joint2\", \"joint5\"]\n  magnitudes = \"0,60arcsec\"\n  poses = [20, 40]\n  \
            payloads_kg = [[0.0], [0.0, 5.0]]\n  trials = \"200\"\n\n\
            Results go to OUT/NAME-sweep.jsonl as trials finish; the same command goes on behind them. From them come .mcap, .csv,\n\
            -combinations.csv, .svg and .png.")]
    Sweep(SweepOptions),
    /// Blind cases whose fault is withheld, and the score of whoever diagnoses them
    Challenge {
        /// What to do
        #[command(subcommand)]
        command: ChallengeCommand,
    },
}

#[derive(Debug, Subcommand)]
pub(crate) enum ChallengeCommand {
    /// Make blind cases: recordings, the sealed truth, and a commitment to it
    #[command(after_help = "Examples:\n  \
        kincal challenge new --cases 500 --seed \"$(od -An -N8 -tu8 /dev/urandom | tr -d ' ')\" --out blind\n  \
        kincal challenge new --cases 100 --seed 7391284650193847 --kinds backlash,gravity_lost_motion --effects 1 --out blind\n  \
        kincal challenge new --cases 1000 --seed 7391284650193847 --effects 0 --heavy-tails 0.33 --understated 0.33 --out quiet\n\n\
        Every case is a cell with an arm of its own: random configurations and approach, heating and cooling, two payloads, some\n\
        configurations read twice. What is written of it is what a real cell would tell. The truth, with the detectability of every\n\
        effect, is in OUT/sealed.truth; its SHA-256 is printed and stands in OUT/commitment.txt. The same command makes the same bytes.")]
    New(NewOptions),
    /// Diagnose the cases, then open the seal, check the commitment and print the score
    #[command(after_help = "Examples:\n  \
        kincal challenge score blind --baseline none\n  \
        kincal challenge score blind --verdicts mine        verdicts of another tool: mine/case-0001.json …\n\n\
        A verdict is what `kincal diagnose --json` prints; needed of it: verdict, effects [{kind, location {level, index}, probability,\n\
        magnitude {value, unit, ci95}}], confusion_sets, unknown {present}.\n\n\
        Where the folder withholds kinds, kincal then diagnoses every case again with its whole library (DIR/restored/) and prints how\n\
        often the kind is found once it is back, and how much of the held-out gap closes over a diagnosis told the truth.")]
    Score(ScoreOptions),
    /// Check by simulation the minimum detectable magnitudes that `kincal diagnose` states
    #[command(after_help = "Examples:\n  \
        kincal challenge power --kinds backlash,joint_compliance --trials 50\n  \
        kincal challenge power --kinds backlash:3,base_step --noise 50 --poses 40 --seed 2\n\n\
        The plan is that of a blind case. Sets without an effect give the stated magnitude; cells with the effect at 0.6 to 1.6 times\n\
        that, each with parameter errors and noise of its own, are measured and diagnosed as real ones; a logistic curve through the\n\
        shares that are named gives the magnitude that is named in 80 %. Written: OUT/power.json, .svg, .png.")]
    Power(PowerOptions),
}

#[derive(Debug, Args)]
pub(crate) struct NewOptions {
    /// Number of cases
    #[arg(long, value_name = "N")]
    pub(crate) cases: usize,
    /// Effects to draw from: kinds, `known` (the default), `foreign` (those outside the analyser's library) or `all`
    #[arg(long, value_name = "KIND", value_delimiter = ',')]
    pub(crate) kinds: Vec<String>,
    /// Number of effects of a case: a number, or fewest..most (both included)
    #[arg(long, value_name = "N|A..B", default_value = "0..3", allow_hyphen_values = true)]
    pub(crate) effects: String,
    /// Effects outside the analyser's library in every case, beside those of --kinds
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) outside: usize,
    /// Magnitudes up to those of hobby and cable-driven arms: joints that yield by degrees, play of two degrees
    #[arg(long)]
    pub(crate) soft: bool,
    /// The arm comes to each configuration straight from the one before, which effects of the last move need to be told
    #[arg(long)]
    pub(crate) direct: bool,
    /// Share of cases without an effect; without it every number of effects is as likely
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    pub(crate) base_rate: Option<f64>,
    /// Declared position noises to draw from, one sigma per axis in µm
    #[arg(long, value_name = "UM", value_delimiter = ',', default_value = "20,50", allow_negative_numbers = true)]
    pub(crate) noise: Vec<f64>,
    /// Share of cases whose noise has heavy tails
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, allow_negative_numbers = true)]
    pub(crate) heavy_tails: f64,
    /// Share of cases whose noise is 1.3 times what is declared
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, allow_negative_numbers = true)]
    pub(crate) understated: f64,
    /// Readings of a case
    #[arg(long, value_name = "M", default_value_t = 60)]
    pub(crate) poses: usize,
    /// Of them, second readings of a configuration [default: a sixth]
    #[arg(long, value_name = "N")]
    pub(crate) repeats: Option<usize>,
    /// Kinds that whoever diagnoses must not use; they are drawn, and are to be called unknown (`score` puts them back afterwards)
    #[arg(long, value_name = "KIND", value_delimiter = ',')]
    pub(crate) withheld: Vec<String>,
    /// Scene with the arm and the cell, in place of the eight-joint arm; what it injects is left out
    #[arg(long, value_name = "SCENE")]
    pub(crate) scene: Option<PathBuf>,
    /// Override a value of the scene; may be given again
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
}

#[derive(Debug, Args)]
pub(crate) struct PowerOptions {
    /// Kinds to check, each with its joint or link where it matters (backlash:3) [default: five that differ]
    #[arg(long, value_name = "KIND[:N]", value_delimiter = ',')]
    pub(crate) kinds: Vec<String>,
    /// Cells at every magnitude
    #[arg(long, value_name = "N", default_value_t = 100)]
    pub(crate) trials: usize,
    /// Sets without an effect, of whose stated magnitudes the median counts
    #[arg(long, value_name = "N", default_value_t = 20)]
    pub(crate) sets: usize,
    /// Declared position noise, one sigma per axis in µm
    #[arg(long, value_name = "UM", default_value_t = 20.0, allow_negative_numbers = true)]
    pub(crate) noise: f64,
    /// Readings of a cell, of which a sixth are second ones of a configuration
    #[arg(long, value_name = "M", default_value_t = 60)]
    pub(crate) poses: usize,
    /// Magnitudes, over the stated one
    #[arg(
        long,
        value_name = "X",
        value_delimiter = ',',
        default_value = "0.6,0.75,0.9,1,1.1,1.3,1.6",
        allow_negative_numbers = true
    )]
    pub(crate) levels: Vec<f64>,
    /// Scene with the arm and the cell, in place of the eight-joint arm; what it injects is left out
    #[arg(long, value_name = "SCENE")]
    pub(crate) scene: Option<PathBuf>,
    /// Override a value of the scene; may be given again
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
}

#[derive(Debug, Args)]
pub(crate) struct ScoreOptions {
    /// Folder of the challenge
    #[arg(value_name = "DIR")]
    pub(crate) folder: PathBuf,
    /// Verdicts made elsewhere: a folder with case-0001.json …
    #[arg(long, value_name = "DIR")]
    pub(crate) verdicts: Option<PathBuf>,
    /// Diagnosis that needs no thought, to be scored in place of kincal's
    #[arg(long, value_enum, conflicts_with = "verdicts")]
    pub(crate) baseline: Option<Baseline>,
}

/// Trivial diagnoses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Baseline {
    /// Nothing is ever wrong
    None,
}

#[derive(Debug, Args)]
pub(crate) struct SceneOptions {
    /// Scene file (TOML)
    pub(crate) scene: PathBuf,
    /// Override a value of the scene, such as `design.count=20`; may be given again
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
}

#[derive(Debug, Args)]
pub(crate) struct EffectsOptions {
    /// Scene file (TOML) whose nominal arm the effects happen to; without it they are listed
    pub(crate) scene: Option<PathBuf>,
    /// Random configurations per effect
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u16).range(2..=10_000))]
    pub(crate) poses: u16,
}

#[derive(Debug, Args)]
pub(crate) struct MeasureOptions {
    #[command(flatten)]
    pub(crate) scene: SceneOptions,
    /// What to measure: the recording of `kincal design`, or a table of joint angles (.csv), such as `kincal correct` writes
    #[arg(long, value_name = "FILE")]
    pub(crate) design: PathBuf,
}

/// How a table is laid out.
#[derive(Debug, Default, Args)]
pub(crate) struct LayoutOptions {
    /// How three angles of a table make an orientation: rpy (URDF, ROS), abc (KUKA), wpr (FANUC), rotvec (Universal Robots), or the order of
    /// the turns, such as xyz about fixed axes or ZYX about moving ones
    #[arg(long, value_name = "CONVENTION")]
    pub(crate) euler: Option<String>,
    /// Columns of a table that are not to be read
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub(crate) ignore_columns: Vec<String>,
}

/// The robot and the sensor of a table.
#[derive(Debug, Args)]
pub(crate) struct RobotOptions {
    /// Nominal robot of a table: a URDF or a scene
    #[arg(long, value_name = "FILE")]
    pub(crate) robot: Option<PathBuf>,
    /// Link of the URDF at which the arm begins
    #[arg(long, value_name = "LINK")]
    pub(crate) base_link: Option<String>,
    /// Link of the URDF that carries the target
    #[arg(long, value_name = "LINK")]
    pub(crate) tip_link: Option<String>,
    /// Declared position noise of a table's sensor, one sigma per axis [default: 20]
    #[arg(long, value_name = "UM", allow_negative_numbers = true)]
    pub(crate) position_noise_um: Option<f64>,
    /// Declared orientation noise of a table's sensor, one sigma per axis [default: 0.005]
    #[arg(long = "attitude-noise-deg", value_name = "DEG", allow_negative_numbers = true)]
    pub(crate) orientation_noise_deg: Option<f64>,
    #[command(flatten)]
    pub(crate) layout: LayoutOptions,
    /// Ticks of the joints' encoders per turn, for columns q1_ticks …
    #[arg(long, value_name = "N")]
    pub(crate) ticks_per_turn: Option<f64>,
    /// Known distances of fixed points: point_a,point_b,distance_mm,sigma_mm
    #[arg(long, value_name = "FILE")]
    pub(crate) distances: Option<PathBuf>,
    /// Correct what a table got wrong, such as order:1,2,4,5,3,6, reverse:2,5, zero:3=90, positions:inch, axes:x,-y,z, quaternion:wxyz or
    /// shift:31=+2; in the order given, may be given again
    #[arg(long, value_name = "WHAT:HOW", allow_hyphen_values = true)]
    pub(crate) fix_columns: Vec<String>,
    /// Gravity in the robot's root link, m/s²: 9.81,0,0 for a robot on a wall, 0,0,9.81 for one that hangs [default: as the file has it]
    #[arg(long, value_name = "X,Y,Z", value_delimiter = ',', allow_negative_numbers = true)]
    pub(crate) gravity: Vec<f64>,
}

#[derive(Debug, Args)]
pub(crate) struct ImportOptions {
    /// Bag: an .mcap file, or the folder of one
    pub(crate) bag: PathBuf,
    /// Nominal robot (URDF or scene), whose joints are looked for by name
    #[arg(long, value_name = "FILE")]
    pub(crate) robot: PathBuf,
    /// First link of the chain [default: the root]
    #[arg(long, value_name = "LINK")]
    pub(crate) base_link: Option<String>,
    /// Last link of the chain [default: the only leaf]
    #[arg(long, value_name = "LINK")]
    pub(crate) tip_link: Option<String>,
    /// Topic of the joint readings [default: /joint_states, or the only one]
    #[arg(long, value_name = "TOPIC")]
    pub(crate) joints: Option<String>,
    /// Topic of the target's poses, TOPIC:FRAME in a TFMessage [default: the only one]
    #[arg(long, value_name = "TOPIC")]
    pub(crate) poses: Option<String>,
    /// By how much poses are stamped late, s [default: what is found]
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    pub(crate) latency: Option<f64>,
    /// A row for each pose, though the arm stood still now and then
    #[arg(long)]
    pub(crate) moving: bool,
}

#[derive(Debug, Args)]
pub(crate) struct CorrectOptions {
    /// Wanted poses (.csv)
    #[arg(long, value_name = "FILE")]
    pub(crate) targets: PathBuf,
    /// Recording or table of measurements: the geometry is that of a diagnosis of it, whose named effects count, and --robot is the nominal
    /// one
    #[arg(long, value_name = "FILE")]
    pub(crate) measurements: Option<PathBuf>,
    /// Poses are those of the target in the measurement frame, not of the tip in the root's (with --measurements)
    #[arg(long, requires = "measurements")]
    pub(crate) in_measurement_frame: bool,
    #[command(flatten)]
    pub(crate) robot: RobotOptions,
}

#[derive(Debug, Args)]
pub(crate) struct DiagnoseOptions {
    /// Recording (.mcap) or table of measurements (.csv)
    pub(crate) input: PathBuf,
    #[command(flatten)]
    pub(crate) robot: RobotOptions,
    /// Kinds of effects that are not to be looked for
    #[arg(long, value_name = "KIND", value_delimiter = ',')]
    pub(crate) without: Vec<String>,
    /// Simulate the effects that are named on the same poses, and compare what they do and what is left
    #[arg(long)]
    pub(crate) confirm: bool,
    /// Change a number that decides, such as diagnosis.decision.named=0.7; may be given again
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Use a recording that was cut off, up to the cut
    #[arg(long)]
    pub(crate) partial: bool,
}

/// Rungs of the ladder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Only {
    /// Base and target: the arm stays nominal
    Base,
    /// The joints' zeros
    Zeros,
    /// Zeros and link lengths
    Lengths,
    /// The whole geometry
    Geometry,
}

impl From<Only> for Freedom {
    fn from(only: Only) -> Freedom {
        match only {
            Only::Base => Freedom::BaseAndTarget,
            Only::Zeros => Freedom::Zeros,
            Only::Lengths => Freedom::Lengths,
            Only::Geometry => Freedom::Geometry,
        }
    }
}

#[derive(Debug, Args)]
pub(crate) struct IdentifyOptions {
    /// Recording (.mcap) or table of measurements (.csv)
    pub(crate) input: PathBuf,
    /// Other measurements of the same arm that carry the held-out error
    #[arg(long, value_name = "FILE")]
    pub(crate) evaluate: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) robot: RobotOptions,
    /// Print what each joint is off, and every identifiable combination
    #[arg(long)]
    pub(crate) parameters: bool,
    /// What alone is to be let loose of a real arm beside its base and target [default: what predicts readings best that are left out]
    #[arg(long, value_enum)]
    pub(crate) only: Option<Only>,
    /// What is as the file says: a joint (elbow_joint, or 3), a part of it (3.zero, 3.length, 3.twist), zeros, lengths, twists, base or target
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub(crate) fix: Vec<String>,
    /// What is free, whatever predicts best: names as for --fix
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub(crate) free: Vec<String>,
    /// How far something may be off, one sigma: lengths=0.2mm, elbow_joint.zero=0.5deg
    #[arg(long, value_name = "NAME=SIGMA", value_delimiter = ',')]
    pub(crate) prior: Vec<String>,
    /// Add the measurement frame and the target to the calibrated URDF, as links with fixed joints
    #[arg(long)]
    pub(crate) with_frames: bool,
    /// Use a recording that was cut off, up to the cut
    #[arg(long)]
    pub(crate) partial: bool,
}

#[derive(Debug, Args)]
pub(crate) struct ReplayOptions {
    /// Recording (.mcap)
    pub(crate) recording: PathBuf,
    /// Its truth file: the physics is then recomputed as well
    #[arg(long, value_name = "FILE")]
    pub(crate) truth: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct ExportOptions {
    /// Scene (.toml) or recording (.mcap); for --to dh also a URDF
    pub(crate) input: PathBuf,
    /// Link of the URDF at which the arm begins
    #[arg(long, value_name = "LINK")]
    pub(crate) base_link: Option<String>,
    /// Link of the URDF at which it ends
    #[arg(long, value_name = "LINK")]
    pub(crate) tip_link: Option<String>,
    /// Format
    #[arg(long, value_enum)]
    pub(crate) to: Format,
    /// Use a recording that was cut off, up to the cut
    #[arg(long)]
    pub(crate) partial: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// The arm: nominal from a scene, identified from a recording that holds an identification
    Urdf,
    /// The measurements of a recording; of a design, its configurations in an order with short moves
    Csv,
    /// The public part of the scene
    Toml,
    /// The arm as a table of modified Denavit-Hartenberg parameters (CSV; mm, degrees)
    Dh,
    /// The identified arm as the kinematics file of Universal Robots' driver (YAML)
    UrKinematics,
    /// Base and target of an identified arm as static transforms of ROS 2 (a shell script)
    RosTransforms,
}

#[derive(Debug, Args)]
pub(crate) struct ReproduceOptions {
    /// Experiments; all of the paper's if none is named
    #[arg(value_name = "ITEM", value_parser = items())]
    pub(crate) items: Vec<String>,
    /// Scene in place of the arms of the project; may be given again
    #[arg(long, value_name = "SCENE")]
    pub(crate) arm: Vec<PathBuf>,
    /// Trials in place of each experiment's own number
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(crate) trials: Option<u32>,
}

#[derive(Debug, Args)]
pub(crate) struct SweepOptions {
    /// Scene file (TOML)
    pub(crate) scene: Option<PathBuf>,
    /// Override a value of the scene, such as `design.count=20`; may be given again
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Effects to switch on, one at a time; without it, all that the scene injects
    #[arg(long, value_name = "KIND", value_delimiter = ',')]
    pub(crate) effect: Vec<String>,
    /// Joints or links that have it, by name or number, one at a time; without it, each of the arm
    #[arg(long, visible_alias = "joints", value_name = "PLACE", value_delimiter = ',')]
    pub(crate) at: Vec<String>,
    /// Magnitudes with their unit, such as 0,10,30,60um; without it, none and three from the realistic range
    #[arg(long, value_name = "LIST", allow_hyphen_values = true)]
    pub(crate) magnitudes: Option<String>,
    /// Numbers of configurations that are fitted
    #[arg(long, value_name = "M", value_delimiter = ',')]
    pub(crate) poses: Vec<usize>,
    /// How they are chosen: random, perturbation, pso, …
    #[arg(long, value_name = "METHOD", value_delimiter = ',')]
    pub(crate) method: Vec<String>,
    /// From which side they are approached: direct, up, down, alternate, random
    #[arg(long, value_name = "POLICY", value_delimiter = ',')]
    pub(crate) approach: Vec<String>,
    /// Courses of the temperature: scene, off, constant, warm-up, heat-and-cool
    #[arg(long, value_name = "COURSE", value_delimiter = ',')]
    pub(crate) temperature: Vec<String>,
    /// Masses in kg that take turns on the tool, such as 0,5; give it again for another set
    #[arg(long, value_name = "KG,…", allow_hyphen_values = true)]
    pub(crate) payloads: Vec<String>,
    /// Readings of each configuration
    #[arg(long, value_name = "N", value_delimiter = ',')]
    pub(crate) repeats: Vec<usize>,
    /// Keep what the scene injects besides the effect
    #[arg(long)]
    pub(crate) keep_injected: bool,
    /// Trials in every cell: how many, or which (from..to, end excluded) [default: 100]
    #[arg(long, value_name = "N|A..B", allow_hyphen_values = true)]
    pub(crate) trials: Option<String>,
    /// The axes from a file (TOML); options stand over it
    #[arg(long, value_name = "FILE")]
    pub(crate) grid: Option<PathBuf>,
    /// Merge files of results (or folders that hold one) into one in OUT
    #[arg(long, value_name = "FILE", num_args = 1..)]
    pub(crate) merge: Vec<PathBuf>,
}

/// Names of the experiments, with what they repeat.
fn items() -> PossibleValuesParser {
    let named = crate::lab::reproduce::ALL
        .iter()
        .chain(crate::lab::reproduce::BEYOND)
        .map(|experiment| PossibleValue::new(experiment.name).help(format!("{}: {}", experiment.place, experiment.about)));
    let everything = PossibleValue::new(super::reproduce::EVERYTHING).help("All of the paper's: tables and figures");
    PossibleValuesParser::new(named.chain([everything]).collect::<Vec<_>>())
}
