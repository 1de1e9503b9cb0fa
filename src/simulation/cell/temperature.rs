//! Temperatures of the links in the course of a session.

use std::f64::consts::PI;

use crate::simulation::plan::{Plan, Temperature, ThermalProfile};

/// Rise of every link (base link first) over the reference temperature, K, at `time_s` of a session of `session_s`; zero for each of
/// the `links` where nothing warms.
#[must_use]
pub fn rises(plan: &Plan, links: usize, time_s: f64, session_s: f64) -> Vec<f64> {
    match &plan.temperature {
        Some(temperature) => {
            let of_link = |(rise, lag): (&f64, &f64)| rise * followed(temperature.profile, *lag, time_s, session_s);
            temperature.rise_k.iter().zip(&temperature.lag_s).map(of_link).collect()
        }
        None => vec![0.0; links],
    }
}

/// Rise of the air over the reference temperature, K.
#[must_use]
pub fn ambient_rise(plan: &Plan, time_s: f64, session_s: f64) -> f64 {
    let of_air = |temperature: &Temperature| temperature.ambient_rise_k * followed(temperature.profile, 0.0, time_s, session_s);
    plan.temperature.as_ref().map_or(0.0, of_air)
}

/// What follows the course `profile` with a time constant `lag` from rest, as a share of the largest rise: the solution of
/// `lag · dy/dt = course(t) − y`, `y(0) = 0`. At a constant temperature everything has been there for long.
fn followed(profile: ThermalProfile, lag: f64, time_s: f64, session_s: f64) -> f64 {
    let share = if session_s > 0.0 { (time_s / session_s).clamp(0.0, 1.0) } else { 0.0 };
    let time = share * session_s;
    let fading = if lag > 0.0 { libm::exp(-time / lag) } else { 0.0 };
    match profile {
        ThermalProfile::Constant => 1.0,
        ThermalProfile::WarmUp if session_s > 0.0 => share - lag / session_s * (1.0 - fading),
        ThermalProfile::HeatAndCool if session_s > 0.0 => {
            let late = PI * lag / session_s;
            let (sine, cosine) = libm::sincos(PI * share);
            (sine - late * cosine + late * fading) / (1.0 + late * late)
        }
        ThermalProfile::WarmUp | ThermalProfile::HeatAndCool => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_follows_solves_its_equation() {
        let session = 1200.0;
        for profile in [ThermalProfile::WarmUp, ThermalProfile::HeatAndCool] {
            let course = |time: f64| match profile {
                ThermalProfile::WarmUp => time / session,
                _ => (PI * time / session).sin(),
            };
            for lag in [10.0, 200.0, 5000.0] {
                // The midpoint rule, far finer than what is compared.
                let (steps, mut y) = (240_000, 0.0);
                let step = session / f64::from(steps);
                for number in 0..steps {
                    let time = f64::from(number) * step;
                    let middle = y + 0.5 * step * (course(time) - y) / lag;
                    y += step * (course(time + 0.5 * step) - middle) / lag;
                    if (number + 1) % 40_000 == 0 {
                        let closed = followed(profile, lag, time + step, session);
                        assert!((closed - y).abs() < 1e-9, "{profile:?}, {lag} s: {closed} and {y}");
                    }
                }
            }
            assert!((followed(profile, 0.0, 300.0, session) - course(300.0)).abs() < 1e-15);
            assert_eq!(followed(profile, 50.0, 0.0, 0.0), 0.0);
        }
        assert_eq!(followed(ThermalProfile::Constant, 50.0, 0.0, session), 1.0);
    }
}
