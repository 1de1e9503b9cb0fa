//! The direction of the last move that was long enough fades with a joint's way: Dahl's memory.

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{Displacement, Reading, Shape};

use super::ANGLE_ERROR;

/// Ways over which a joint may forget, rad.
pub const MEMORIES: [f64; 2] = [0.4, 1.2];

pub(in crate::effects::signature) fn columns(reading: &Reading, joint: usize, way: f64) -> Vec<Displacement> {
    let which = MEMORIES.iter().position(|known| *known == way).unwrap_or(0);
    vec![reading.moved(joint, reading.memory[joint][which])]
}

pub(super) fn hypotheses(site: &Site<'_>, joint: usize, all: &mut Vec<Hypothesis>) {
    if site.columns.time {
        for way in MEMORIES {
            let detail = format!("joint {} remembers its last moves", joint + 1);
            all.push(site.unnamed(Shape::Memory { joint, way }, ANGLE_ERROR, vec![0.5], detail));
        }
    }
}
