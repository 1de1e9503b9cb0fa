//! Conditions of a session that experiments put into a plan.

use crate::arm::Arm;
use crate::simulation::plan::{Temperature, ThermalProfile};

/// A course of the temperature by its name (`constant`, `warm-up`, `heat-and-cool`; `None` for any other): the foot rises by 3 K, the
/// links by 12 K near the motors of the shoulder to 5 K at the tool, the air by 2 K. Each link follows with a lag of its own, the
/// heavier the slower, up to a quarter of the session, which lasts `session_s`.
#[must_use]
pub fn course(name: &str, arm: &Arm, session_s: f64) -> Option<Temperature> {
    let profile = match name {
        "constant" => ThermalProfile::Constant,
        "warm-up" => ThermalProfile::WarmUp,
        "heat-and-cool" => ThermalProfile::HeatAndCool,
        _ => return None,
    };
    let links = arm.links.len();
    let along = |link: usize| if links > 2 { (link as f64 - 1.0) / (links as f64 - 2.0) } else { 0.0 };
    // Neighbours differ, so that none can stand in for another.
    let uneven = |link: usize| if link.is_multiple_of(2) { 1.0 } else { 0.75 };
    let tenths = |value: f64| (10.0 * value).round() / 10.0;
    let rise_k = (0..links).map(|link| if link == 0 { 3.0 } else { tenths((12.0 - 7.0 * along(link)) * uneven(link)) }).collect();
    let lag = |link: usize| if link == 0 { 0.25 } else { (0.2 - 0.15 * along(link)) * uneven(link + 1) };
    // Seconds and tenths of a kelvin, for people read them.
    let lag_s = (0..links).map(|link| (lag(link) * session_s).round()).collect();
    Some(Temperature { profile, rise_k, lag_s, ambient_rise_k: 2.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_link_has_a_lag_of_its_own() {
        let arm = crate::lab::reproduce::arms::arms().unwrap().swap_remove(0).scene.arm;
        let course = course("heat-and-cool", &arm, 1200.0).unwrap();
        assert_eq!((course.rise_k.len(), course.lag_s.len()), (arm.links.len(), arm.links.len()));
        let mut lags = course.lag_s.clone();
        lags.sort_by(f64::total_cmp);
        assert!(lags.windows(2).all(|pair| pair[0] < pair[1]) && lags[0] > 0.0, "{lags:?}");
        assert!(super::course("off", &arm, 1.0).is_none());
    }
}
