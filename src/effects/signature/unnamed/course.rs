//! The base or the tool goes neither steadily nor at once.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::signature::library::{Hypothesis, Site, twist_spread};
use crate::effects::signature::shape::{Course, Displacement, Family, Follows, Form, Reading, Recorded, Size, Unnamed};
use crate::effects::{Kind, Level, Location};

use super::Nameless;

/// Share of the session after which the base or the tool has gone half of its way, along a slope of 30 %; and one of 80 %.
const COURSES: [Course; 7] = [
    Course::Ramp { centre: 0.15, width: 0.3 },
    Course::Ramp { centre: 0.38, width: 0.3 },
    Course::Ramp { centre: 0.62, width: 0.3 },
    Course::Ramp { centre: 0.85, width: 0.3 },
    Course::Ramp { centre: 0.5, width: 0.8 },
    Course::Return,
    Course::Steady,
];

/// \[6\] A twist of the base over a course of time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BaseCourse {
    /// How it goes.
    pub course: Course,
}

impl Follows for BaseCourse {
    fn form(&self, _: bool) -> Form {
        // The magnitude of a twist is the length of its translation.
        Form {
            columns: 6,
            of_magnitude: 3,
            size: Size::Length,
            needs: Recorded::Pose,
            unnamed: Some(Unnamed { family: Family::BaseCourse, contains: None, near: None }),
        }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        reading.base_twist(self.course.at(reading.share))
    }
}

/// \[3, 6 with orientations\] A twist of the tool over a course of time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ToolCourse {
    /// How it goes.
    pub course: Course,
}

impl Follows for ToolCourse {
    fn form(&self, orientation: bool) -> Form {
        // The magnitude of a twist is the length of its translation.
        Form {
            columns: if orientation { 6 } else { 3 },
            of_magnitude: 3,
            size: Size::Length,
            needs: Recorded::Pose,
            unnamed: Some(Unnamed { family: Family::ToolCourse, contains: None, near: None }),
        }
    }

    fn columns(&self, reading: &Reading, orientation: bool) -> Vec<Displacement> {
        reading.tool_twist(self.course.at(reading.share), orientation)
    }
}

fn words(course: Course) -> String {
    match course {
        Course::Ramp { centre, width } => {
            let [begin, end] = [centre - width / 2.0, centre + width / 2.0].map(|share| 100.0 * share);
            format!("moves between {begin:.0} and {end:.0} % of the session")
        }
        Course::Return => "moves away and comes back".to_owned(),
        Course::Steady => "moves steadily".to_owned(),
    }
}

pub(super) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    if !site.columns.time {
        return;
    }
    let at = |level| Location { level, index: None };
    for course in COURSES {
        let how = words(course);
        // A base that moves steadily has a name.
        if course != Course::Steady {
            let (range, detail) = (site.range(Kind::BaseDrift), format!("the base or the sensor {how}"));
            let base = site.unnamed(Nameless::BaseCourse(BaseCourse { course }), range, twist_spread(true), detail);
            all.push(Hypothesis { location: at(Level::Base), ..base });
        }
        let (range, detail) = (site.range(Kind::ToolStep), format!("the tool {how}"));
        let tool =
            site.unnamed(Nameless::ToolCourse(ToolCourse { course }), range, twist_spread(site.columns.orientation), detail);
        all.push(Hypothesis { location: at(Level::Tool), ..tool });
    }
}
