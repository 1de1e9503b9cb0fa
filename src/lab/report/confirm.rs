//! What the physics says of a diagnosis, for people: the same waterfall from formulas and from the simulated arm.

use crate::lab::confirm::{Answer, Confirmation};
use crate::report::diagnosis::place;
use crate::report::table;
use crate::units::micrometres as um;

/// The part of the report that comes under the diagnosis.
#[must_use]
pub fn text(confirmation: &Confirmation) -> String {
    let mut text = format!("{}\n", confirmation.sentence);
    if matches!(confirmation.verdict, Answer::NothingToConfirm) {
        return text;
    }
    let some = |metres: Option<f64>| metres.map_or_else(|| "–".to_owned(), um);
    let none = || "–".to_owned();
    let geometry = um(confirmation.geometry_rms_m);
    let mut rows =
        vec![vec!["geometry".to_owned(), none(), geometry.clone(), geometry, none(), none(), none(), none(), String::new()]];
    for step in &confirmation.steps {
        let word = match (step.simulated, step.disagreement.is_empty()) {
            (false, _) => "not simulated",
            (true, true) => "agrees",
            (true, false) => "DISAGREES",
        };
        rows.push(vec![
            format!("+ {} {}", step.kind, place(&step.location)),
            um(step.diagnosed_rms_m),
            um(step.analytic_rms_m),
            um(step.physics_rms_m),
            some(step.displacement_rms_m),
            some(step.difference_rms_m),
            some(step.difference_max_m),
            step.difference_share.map_or_else(none, |share| format!("{:.1} %", 100.0 * share)),
            word.to_owned(),
        ]);
    }
    let noise = um(confirmation.noise_rms_m);
    rows.push(vec!["noise floor".to_owned(), noise.clone(), noise.clone(), noise, none(), none(), none(), none(), String::new()]);
    let header = [
        "held out, RMS",
        "diagnosis, µm",
        "formulas, µm",
        "physics, µm",
        "moved by, µm RMS",
        "formula off, µm RMS",
        "at most, µm",
        "of it",
        "",
    ];
    text.push_str(&table(&header, rows));
    text.push_str(&format!(
        "\nSimulated at rest to {} µm{}{}.\n",
        um(confirmation.settling_error_m),
        if confirmation.unsettled > 0 { format!("; {} readings did not settle", confirmation.unsettled) } else { String::new() },
        if confirmation.undecided > 0 {
            format!("; in {} readings friction holds play that the formulas seat", confirmation.undecided)
        } else {
            String::new()
        },
    ));
    text
}
