//! What un-modelled effects do to a calibration: effect × magnitude × place × design × conditions × trials.
//!
//! A [`Grid`] spans cells. Trial `n` is the same true arm, the same verification and the same noise in every cell, so that cells are
//! compared in pairs; it is defined by scene, grid and its number alone. Trials are done and stored in one order, number by number and
//! cell by cell: a file of results is then the beginning of every longer one, and sums do not depend on who computed what.

pub mod grid;
pub mod results;
pub mod summary;

pub use grid::{Background, Cell, Grid};
pub use results::{Header, Record, Results, ResultsError};
pub use summary::{CellSummary, Reduction};

use std::collections::BTreeMap;
use std::ops::Range;

use rayon::prelude::*;
use sha2::{Digest, Sha256};

use super::detectability::{Geometry, difference, has_signal, noiseless};
use crate::arm::frames::Pose;
use crate::design;
use crate::design::problem::Method;
use crate::effects::Kind;
use crate::identification::{fit_some, identify_on};
use crate::measurement::{Measurement, Role};
use crate::progress::{Silent, Steps, Stopped};
use crate::quality::subspace::Subspace;
use crate::scene::{Scene, SceneError, SceneFile};
use crate::seed::derive;
use crate::session::SessionError;
use crate::simulation::cell::plan::{Planned, plan};
use crate::simulation::cell::{measure, truth};
use crate::simulation::effect::Effect;
use crate::simulation::injected::Injected;

/// Trials of a thread from one flush to the next.
const PER_THREAD: usize = 8;

/// A sweep could not be done.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    /// A step of a trial.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// A value of the grid does not fit the scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The results could not be kept.
    #[error(transparent)]
    Results(#[from] ResultsError),
    /// Whoever was told stopped it.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

/// A sweep that is ready: the cells with their chosen configurations.
pub struct Sweep {
    cells: Vec<Ready>,
    /// What every cell has.
    injected: Injected,
    /// What the scene has.
    whole: Injected,
    structure: Subspace,
    seed: u64,
    header: Header,
}

/// A scene with the configurations that were chosen for it.
type Chosen = (Scene, Vec<Vec<f64>>);

/// A cell with what is the same in all its trials.
struct Ready {
    cell: Cell,
    scene: Scene,
    chosen: Vec<Vec<f64>>,
    geometry: Geometry,
    /// Joints of the fitted readings in the order of `geometry`'s rows.
    rows: Vec<Vec<f64>>,
}

impl Sweep {
    /// Chooses the configurations of every cell, each set once. `injected` is that of `file`.
    ///
    /// # Errors
    /// If a value of the grid does not fit the scene, or no configuration may be measured.
    pub fn new(file: &SceneFile, injected: &Injected, grid: &Grid, progress: &Steps) -> Result<Sweep, SweepError> {
        let cells = grid.cells();
        let mut sets: BTreeMap<(usize, Method), Chosen> = BTreeMap::new();
        let wanted: std::collections::BTreeSet<_> = cells.iter().map(|cell| (cell.poses, cell.method)).collect();
        progress.begin("choosing", wanted.len())?;
        for (poses, method) in wanted {
            let mut file = file.clone();
            file.set_count(poses)?;
            file.set_method(method)?;
            let chosen = design::design(&file.scene.request(), &mut Silent).map_err(SessionError::from)?.configurations;
            sets.insert((poses, method), (file.scene, chosen));
            progress.done()?;
        }
        let arm = &file.scene.arm;
        let mut ready = Vec::with_capacity(cells.len());
        for cell in cells {
            let Some((scene, chosen)) = sets.get(&(cell.poses, cell.method)) else { continue };
            let mut scene = scene.clone();
            cell.conditions(&mut scene.plan, arm, chosen.len());
            let chosen = chosen.clone();
            let rows = in_order_of_configurations(&plan(&scene.cell(), &chosen, &[]))
                .map(|(_, planned)| planned.joints.clone())
                .collect::<Vec<_>>();
            let joints: Vec<&[f64]> = rows.iter().map(Vec::as_slice).collect();
            let geometry = Geometry::new(&arm.chain, &arm.chain.nominal(), &scene.sensor, &joints);
            ready.push(Ready { cell, scene, chosen, geometry, rows });
        }
        let header = header(file, grid, &ready)?;
        let structure = Subspace::of_structure(arm, file.scene.sensor.orientation_sigma_rad.is_some());
        let background = match grid.background {
            Background::Scene => injected.clone(),
            Background::Nothing => Injected { effects: Vec::new(), ..injected.clone() },
        };
        let seed = file.scene.seed;
        let sweep = Sweep { cells: ready, injected: background, whole: injected.clone(), structure, seed, header };
        // What cannot be simulated is refused before hours are spent.
        for ready in &sweep.cells {
            let (_, injected) = sweep.injected_of(&ready.cell, &ready.scene);
            measure::check(&ready.scene.cell(), &injected).map_err(measure::MeasureError::from).map_err(SessionError::from)?;
        }
        Ok(sweep)
    }

    /// What a file of results of this sweep begins with.
    #[must_use]
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Does what is left of `trials` in every cell, appending to `results`.
    ///
    /// # Errors
    /// Whatever a trial or the file reports.
    pub fn run(&self, trials: Range<u64>, results: &mut Results, progress: &Steps) -> Result<(), SweepError> {
        let cells = self.cells.len() as u64;
        let all = trials.start * cells..trials.end * cells;
        let mut next = all.start + results.count();
        progress.begin("sweeping", usize::try_from(all.end.saturating_sub(next)).unwrap_or(usize::MAX))?;
        let batch = (PER_THREAD * rayon::current_num_threads()) as u64;
        while next < all.end {
            let end = (next + batch).min(all.end);
            let records: Vec<Record> = (next..end)
                .into_par_iter()
                .map(|item| {
                    let record = self.trial(item / cells, (item % cells) as usize)?;
                    progress.done()?;
                    Ok(record)
                })
                .collect::<Result<_, SweepError>>()?;
            results.append(&records)?;
            next = end;
        }
        Ok(())
    }

    /// Trial `number` in cell `index`.
    ///
    /// # Errors
    /// Whatever a step reports.
    pub fn trial(&self, number: u64, index: usize) -> Result<Record, SweepError> {
        let ready = &self.cells[index];
        let mut scene = ready.scene.clone();
        scene.seed = derive(self.seed, number);
        let (background, injected) = self.injected_of(&ready.cell, &scene);
        let held_out = design::held_out(&scene.request(), scene.plan.held_out_count, scene.plan.held_out_exact)
            .map_err(SessionError::from)?;
        let planned = plan(&scene.cell(), &ready.chosen, &held_out);
        let (measurements, truth) =
            measure(&scene.cell(), &injected, &planned, planned.len(), &mut Silent).map_err(SessionError::from)?;
        let (arm, sensor) = (&scene.arm, &scene.sensor);
        let identification =
            identify_on(&self.structure, arm, sensor, scene.weights, &measurements).map_err(SessionError::from)?;
        let values: Vec<f64> = truth.parameters.iter().map(|parameter| parameter.true_value).collect();

        // What the independent parameters would be if the dropped ones stood at nominal and the poses stayed the same: the fit to
        // poses without noise and without effects.
        let truly = arm.chain.at(&values);
        let perfect: Vec<Measurement> = ready
            .rows
            .iter()
            .map(|joints| {
                let pose = truly.forward(joints);
                let q = pose.rotation.quaternion();
                Measurement {
                    joints: joints.clone(),
                    position_m: pose.translation.vector.into(),
                    orientation_xyzw: sensor.orientation_sigma_rad.map(|_| [q.i, q.j, q.k, q.w]),
                    ..Measurement::default()
                }
            })
            .collect();
        let perfect: Vec<&Measurement> = perfect.iter().collect();
        let columns: Vec<usize> = (0..values.len()).filter(|column| !identification.parameters[*column].dropped).collect();
        let target = fit_some(arm, sensor, &perfect, &columns);
        let estimates = match (&target, identification.converged) {
            (Some(target), true) => columns
                .iter()
                .zip(&identification.combinations)
                .map(|(&column, combination)| results::Estimate {
                    column,
                    error: identification.parameters[column].identified - target[column],
                    standard_error: combination.standard_error,
                    half_width: 0.5 * (combination.interval95[1] - combination.interval95[0]),
                })
                .collect(),
            _ => Vec::new(),
        };

        let signal = match background {
            Some(background) => Some(self.signal(&scene, &background, &injected, &planned, &truly)?),
            None => None,
        };
        let surviving = signal.as_ref().map(|signal| ready.geometry.surviving(signal));
        let displacement_m = signal.as_ref().map(|signal| {
            let squares: f64 = signal.iter().map(|pose| pose[..3].iter().map(|value| value * value).sum::<f64>()).sum();
            (squares / signal.len().max(1) as f64).sqrt()
        });
        let held_out = identification.held_out.as_ref().ok_or(SessionError::NothingHeldOut)?;
        Ok(Record {
            trial: number,
            cell: index,
            converged: identification.converged,
            rank: identification.rank,
            held_out_m: held_out.position_m.rms,
            held_out_rad: held_out.rotation_rad.map(|summary| summary.rms),
            residual_scale: identification.residual_scale,
            displacement_m,
            swallowed: surviving.and_then(super::detectability::Surviving::swallowed),
            lambda: surviving.map(|surviving| surviving.lambda),
            estimates,
        })
    }

    /// What is injected without and with the cell's effect; without is absent where the cell has none of its own that could be seen.
    fn injected_of(&self, cell: &Cell, scene: &Scene) -> (Option<Injected>, Injected) {
        match Kind::from_name(&cell.effect) {
            Some(kind) => {
                let mut stream = truth::stream(&self.injected, scene.seed, "sweep/effect");
                let place = cell.location.and_then(|location| location.index).map(|index| index - 1);
                let effect = Effect::drawn(kind, place, cell.magnitude, &scene.arm, &mut stream);
                let seen = has_signal(&effect);
                let mut injected = self.injected.clone();
                injected.effects.push(effect);
                (seen.then(|| self.injected.clone()), injected)
            }
            None if cell.effect == grid::AS_THE_SCENE => (Some(self.injected.clone()), self.whole.clone()),
            None => (None, self.injected.clone()),
        }
    }

    /// What the effect does to the fitted poses, in the order of the cell's geometry.
    fn signal(
        &self,
        scene: &Scene,
        background: &Injected,
        injected: &Injected,
        planned: &[Planned],
        truly: &crate::arm::ChainAt,
    ) -> Result<Vec<[f64; 6]>, SweepError> {
        let with = noiseless(scene, injected, planned).map_err(SessionError::from)?;
        // An arm without effects is its kinematics.
        let plain = background.effects.is_empty();
        let without: Vec<Pose> = if plain {
            planned.iter().map(|planned| truly.forward(&planned.joints)).collect()
        } else {
            noiseless(scene, background, planned).map_err(SessionError::from)?
        };
        let all = difference(&with, &without);
        Ok(in_order_of_configurations(planned).map(|(index, _)| all[index]).collect())
    }
}

/// The fitted readings, configuration by configuration, repeats in the order of measuring, each with its index.
fn in_order_of_configurations(planned: &[Planned]) -> impl Iterator<Item = (usize, &Planned)> {
    let mut rows: Vec<(usize, &Planned)> = planned.iter().enumerate().filter(|(_, planned)| planned.role == Role::Fit).collect();
    rows.sort_by_key(|(index, planned)| (planned.pose_id, *index));
    rows.into_iter()
}

/// Describes the sweep, with a hash of everything that its numbers depend on.
fn header(file: &SceneFile, grid: &Grid, ready: &[Ready]) -> Result<Header, SweepError> {
    let parameters: Vec<(String, String)> = file
        .scene
        .arm
        .chain
        .parameters
        .iter()
        .map(|parameter| (parameter.name.clone(), parameter.quantity.unit().to_owned()))
        .collect();
    let public = file.public_toml()?;
    let mut hash = Sha256::new();
    let mut put = |text: &str| {
        hash.update((text.len() as u64).to_le_bytes());
        hash.update(text.as_bytes());
    };
    put(env!("CARGO_PKG_VERSION"));
    put(&public);
    put(&file.injected_toml()?.unwrap_or_default());
    put(&serde_json::to_string(grid).unwrap_or_default());
    for Ready { cell, chosen, .. } in ready {
        put(&serde_json::to_string(cell).unwrap_or_default());
        put(&serde_json::to_string(chosen).unwrap_or_default());
    }
    Ok(Header {
        format: results::FORMAT.to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        scene: file.scene.name.clone(),
        arm_note: file.scene.arm_note.clone(),
        hash: hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect(),
        position_sigma_m: file.scene.sensor.position_sigma_m,
        parameters,
        cells: ready.iter().map(|ready| ready.cell.clone()).collect(),
        public_scene: public,
    })
}
