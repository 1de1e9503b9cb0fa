//! A twist of the tool from a reading on; without orientations its rotation cannot be seen.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::signature::library::{Columns, Hypothesis, Site, twist_spread};
use crate::effects::signature::shape::{Coefficients, Displacement, Follows, Form, Named, Reading, Recorded, Shape, Size};
use crate::effects::{Kind, Parameters, Values};

/// \[3, 6 with orientations\] A twist of the tool from a row on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ToolStep {
    /// Place in the order of time, from 0, of the first reading after it.
    pub row: usize,
}

impl Follows for ToolStep {
    fn form(&self, orientation: bool) -> Form {
        // The magnitude of a twist is the length of its translation.
        Form {
            columns: if orientation { 6 } else { 3 },
            of_magnitude: 3,
            size: Size::Length,
            needs: Recorded::Pose,
            unnamed: None,
        }
    }

    fn columns(&self, reading: &Reading, orientation: bool) -> Vec<Displacement> {
        let after = f64::from(u8::from(reading.order >= self.row));
        reading.tool_twist(after, orientation)
    }
}

impl Named for ToolStep {
    fn undecided(&self, _: &Reading) -> bool {
        false
    }

    fn closer(&self, columns: &Columns) -> Vec<(Shape, String)> {
        columns.rows_about(self.row).into_iter().map(|row| (Shape::ToolStep(ToolStep { row }), String::new())).collect()
    }

    fn parameters(&self, of: Coefficients<'_>) -> Parameters {
        Parameters { row: Some(self.row), ..of.moved() }
    }

    fn values(&self, of: Coefficients<'_>) -> Result<Vec<Values>, String> {
        Ok(vec![of.twist()])
    }
}

pub(in crate::effects) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    if site.place.is_none() {
        all.extend(site.columns.changes.iter().map(|row| {
            let step = site.hypothesis(Kind::ToolStep, Shape::ToolStep(ToolStep { row: *row }));
            Hypothesis { spread: twist_spread(site.columns.orientation), ..step }
        }));
    }
}
