//! What experiments found, for people as tables and for programs as CSV.

use crate::lab::reproduce::findings::{Claim, Data, Findings};
use crate::report::table;
use crate::units::number;

/// The published numbers beside ours, the verdict, and what was assumed.
#[must_use]
pub fn findings(findings: &Findings) -> String {
    let rows = findings.found.claims.iter().map(claim).collect();
    let mut text = format!(
        "{} on {} ({})\n{}\n{}\n",
        findings.item,
        findings.arm,
        findings.place,
        table(&["what", "paper", "ours (mean)", "95 %", "bound"], rows),
        findings.found.verdict
    );
    let fits = &findings.found.fits;
    if fits.fits > 0 {
        text.push_str(&format!(
            "{} fits, {} did not converge, {} held combinations at nominal that their set does not show.\n",
            fits.fits, fits.not_converged, fits.held
        ));
    }
    for note in &findings.found.notes {
        text.push_str(&format!("Note: {note}\n"));
    }
    text
}

fn claim(claim: &Claim) -> Vec<String> {
    let maybe = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), number);
    let interval = match claim.ours.and_then(|ours| ours.interval95) {
        Some([low, high]) => format!("{} … {}", number(low), number(high)),
        None => "–".to_owned(),
    };
    vec![claim.what.clone(), maybe(claim.paper), maybe(claim.ours.map(|ours| ours.mean)), interval, maybe(claim.bound)]
}

/// A table of numbers as CSV; what is not a number is an empty field.
///
/// # Errors
/// If rows are not of one length, which no experiment does.
pub fn csv(data: &Data) -> Result<Vec<u8>, csv::Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(&data.columns)?;
    for (index, row) in data.rows.iter().enumerate() {
        let labels = data.labels.get(index).map(Vec::as_slice).unwrap_or_default();
        let numbers = row.iter().map(|value| if value.is_finite() { value.to_string() } else { String::new() });
        writer.write_record(labels.iter().cloned().chain(numbers))?;
    }
    writer.into_inner().map_err(|error| error.into_error().into())
}

/// The claims as a table for CSV.
#[must_use]
pub fn claims(findings: &Findings) -> Data {
    let missing = |value: Option<f64>| value.unwrap_or(f64::NAN);
    let rows = findings.found.claims.iter().map(|claim| {
        let [low, high] = claim.ours.and_then(|ours| ours.interval95).unwrap_or([f64::NAN; 2]);
        let trials = claim.ours.map_or(0, |ours| ours.trials);
        let ours = missing(claim.ours.map(|ours| ours.mean));
        let what = claim.what.trim().to_owned();
        (vec![what], vec![missing(claim.paper), ours, low, high, trials as f64, missing(claim.bound)])
    });
    let columns = ["what", "paper", "ours", "low95", "high95", "trials", "bound"];
    Data::labelled(format!("{}-claims", findings.item), &columns, rows.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_is_an_empty_field() {
        let rows = vec![(vec!["a, b".to_owned()], vec![1.5, f64::NAN]), (vec!["c".to_owned()], vec![f64::INFINITY, 1e-20])];
        let data = Data::labelled("name", &["what", "x", "y"], rows);
        let text = String::from_utf8(csv(&data).unwrap()).unwrap();
        assert_eq!(text, "what,x,y\n\"a, b\",1.5,\nc,,0.00000000000000000001\n");
    }
}
