//! The grid of a sweep: which values every axis takes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::arm::Arm;
use crate::design::problem::Method;
use crate::effects::{Kind, Location};
use crate::lab::conditions::course;
use crate::lab::injection;
use crate::simulation::plan::{ApproachPolicy, Plan};

/// Name of a cell without an effect of its own.
pub const NOTHING: &str = "none";
/// Name of a cell in which everything is as the scene injects it.
pub const AS_THE_SCENE: &str = "scene";

/// The grid: every combination of the values of its axes is a cell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Grid {
    /// Effects with place and magnitude, and what has none.
    pub effects: Vec<Injecting>,
    /// Numbers of configurations that are fitted.
    pub poses: Vec<usize>,
    /// How they are chosen.
    pub methods: Vec<Method>,
    /// From which side they are approached.
    pub approaches: Vec<ApproachPolicy>,
    /// Courses of the temperature: `as the scene`, `off`, `constant`, `warm-up`, `heat-and-cool`.
    pub temperatures: Vec<String>,
    /// Payloads that take turns, kg.
    pub payloads_kg: Vec<Vec<f64>>,
    /// Readings of each configuration.
    pub repeats: Vec<usize>,
    /// What else is injected.
    pub background: Background,
}

/// What is injected besides parameters, noise and the cell's own effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Background {
    /// Nothing.
    Nothing,
    /// What the scene injects.
    Scene,
}

/// A value of the first axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Injecting {
    /// Name of the effect, [`NOTHING`] or [`AS_THE_SCENE`].
    pub effect: String,
    /// Where.
    pub location: Option<Location>,
    /// SI, in the unit of the effect.
    pub magnitude: f64,
}

impl Injecting {
    /// No effect.
    #[must_use]
    pub fn nothing() -> Self {
        Injecting { effect: NOTHING.to_owned(), location: None, magnitude: 0.0 }
    }

    /// What the scene injects.
    #[must_use]
    pub fn as_the_scene() -> Self {
        Injecting { effect: AS_THE_SCENE.to_owned(), ..Injecting::nothing() }
    }

    /// Every magnitude (SI) of `kind` at every place (from 0); zero is no effect, and is there once.
    #[must_use]
    pub fn all(kind: Kind, places: &[Option<usize>], magnitudes: &[f64]) -> Vec<Injecting> {
        let none = magnitudes.contains(&0.0).then(Injecting::nothing);
        let some = places.iter().flat_map(|place| {
            magnitudes.iter().filter(|magnitude| **magnitude > 0.0).map(|magnitude| Injecting {
                effect: kind.name().to_owned(),
                location: Some(injection::location(kind, *place)),
                magnitude: *magnitude,
            })
        });
        none.into_iter().chain(some).collect()
    }
}

/// A cell of the grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Cell {
    /// Name of the effect, [`NOTHING`] or [`AS_THE_SCENE`].
    pub effect: String,
    /// Where.
    pub location: Option<Location>,
    /// SI, in `unit`.
    pub magnitude: f64,
    /// Of the magnitude.
    pub unit: String,
    /// Configurations that are fitted.
    pub poses: usize,
    /// How they are chosen.
    pub method: Method,
    /// From which side they are approached.
    pub approach: ApproachPolicy,
    /// Course of the temperature.
    pub temperature: String,
    /// Payloads that take turns, kg.
    pub payloads_kg: Vec<f64>,
    /// Readings of each configuration.
    pub repeats: usize,
}

/// The course that the scene's own plan has.
pub const SCENES_COURSE: &str = "scene";
/// Courses by name.
pub const COURSES: [&str; 5] = [SCENES_COURSE, "off", "constant", "warm-up", "heat-and-cool"];

impl Grid {
    /// Every cell: effects vary fastest.
    #[must_use]
    pub fn cells(&self) -> Vec<Cell> {
        let mut cells = Vec::new();
        for &poses in &self.poses {
            for &method in &self.methods {
                for &approach in &self.approaches {
                    for temperature in &self.temperatures {
                        for payloads_kg in &self.payloads_kg {
                            for &repeats in &self.repeats {
                                cells.extend(self.effects.iter().map(|injecting| Cell {
                                    effect: injecting.effect.clone(),
                                    location: injecting.location,
                                    magnitude: injecting.magnitude,
                                    unit: Kind::from_name(&injecting.effect).map_or("", Kind::unit).to_owned(),
                                    poses,
                                    method,
                                    approach,
                                    temperature: temperature.clone(),
                                    payloads_kg: payloads_kg.clone(),
                                    repeats,
                                }));
                            }
                        }
                    }
                }
            }
        }
        cells
    }
}

impl Cell {
    /// Puts the cell's conditions into a plan of `poses` configurations.
    pub fn conditions(&self, plan: &mut Plan, arm: &Arm, poses: usize) {
        plan.approach.policy = self.approach;
        plan.payloads_kg.clone_from(&self.payloads_kg);
        plan.repeats = self.repeats;
        if self.temperature != SCENES_COURSE {
            let readings = (poses + plan.held_out_count) * self.repeats;
            plan.temperature = course(&self.temperature, arm, readings as f64 * plan.seconds_per_pose);
        }
    }

    /// The magnitude with its unit, as it is printed.
    #[must_use]
    pub fn magnitude_written(&self) -> String {
        Kind::from_name(&self.effect).map_or_else(|| "–".to_owned(), |kind| injection::written(self.magnitude, kind))
    }

    /// The place, as it is printed.
    #[must_use]
    pub fn place_written(&self) -> String {
        self.location.map_or_else(|| "–".to_owned(), place_written)
    }
}

/// `joint 3`, `base`.
#[must_use]
pub fn place_written(location: Location) -> String {
    let level = serde_json::to_value(location.level).ok();
    let level = level.as_ref().and_then(serde_json::Value::as_str).unwrap_or_default();
    location.index.map_or_else(|| level.to_owned(), |index| format!("{level} {index}"))
}
