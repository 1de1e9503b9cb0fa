//! The direction of the last move that was long enough fades with a joint's way: Dahl's memory.

use std::num::NonZeroUsize;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{Displacement, Family, Follows, Form, Reading, Recorded, Size, Unnamed, from_one};

use super::{ANGLE_ERROR, Nameless};

/// Ways over which a joint may forget, rad.
pub const MEMORIES: [f64; 2] = [0.4, 1.2];

/// \[1\] The direction of the last move that was long enough fades with a joint's way: Dahl's memory of a way.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Memory {
    /// Joint, or the link that it moves.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub joint: usize,
    /// One of [`MEMORIES`], rad.
    pub way: f64,
}

impl Follows for Memory {
    fn form(&self, _: bool) -> Form {
        Form {
            columns: 1,
            of_magnitude: 1,
            size: Size::Length,
            needs: Recorded::Pose,
            unnamed: Some(Unnamed { family: Family::Memory, contains: None, near: None }),
        }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        let which = MEMORIES.iter().position(|known| *known == self.way).unwrap_or(0);
        vec![reading.moved(self.joint, reading.memory[self.joint][which])]
    }
}

pub(super) fn hypotheses(site: &Site<'_>, joint: usize, all: &mut Vec<Hypothesis>) {
    if site.columns.time {
        for way in MEMORIES {
            let detail = format!("joint {} remembers its last moves", joint + 1);
            all.push(site.unnamed(Nameless::Memory(Memory { joint, way }), ANGLE_ERROR, vec![0.5], detail));
        }
    }
}
