//! Conditions of each row, as far as they were recorded, and what follows from what is missing.

use std::collections::BTreeSet;

use nalgebra::Vector3;
use rayon::prelude::*;

use super::conclusion::Note;
use super::deflection::{Deflected, Loads, Present, deflected};
use super::rows::Rows;
use super::settings::Model;
use crate::effects::signature::library::Columns;
use crate::effects::signature::shape::{Displacement, FADING_S, FORGETTING_S, MEMORIES, Reading};
use crate::measurement::Measurement;
use crate::measurement::table::MOVED;

/// Rows as signatures see them, and what the data have.
#[derive(Clone, Debug)]
pub(crate) struct Conditions {
    /// Of each row.
    pub(crate) readings: Vec<Reading>,
    /// What there is.
    pub(crate) columns: Columns,
    /// What is missing.
    pub(crate) notes: Vec<Note>,
    /// Row of each place in time.
    pub(crate) in_time: Vec<usize>,
}

/// The conditions of `measurements`, whose geometry is `rows`, with the effects `present`, which answer to `loads`. `upright`: the joints
/// that are, where an earlier fit has told (what the library has must not change from fit to fit). Also what the effects do to the target
/// of each row.
#[must_use]
pub(crate) fn conditions(
    measurements: &[&Measurement],
    rows: &Rows,
    present: &[Present],
    loads: Loads,
    upright: Option<&[bool]>,
    settings: &Model,
) -> (Conditions, Vec<Displacement>) {
    let mut notes = Vec::new();
    let count = rows.mechanism.joint_count();
    let total = measurements.len();
    let mut in_time: Vec<usize> = (0..total).collect();
    in_time.sort_by(|a, b| measurements[*a].time_s.total_cmp(&measurements[*b].time_s).then(a.cmp(b)));
    let mut order = vec![0; total];
    for (place, row) in in_time.iter().enumerate() {
        order[*row] = place;
    }
    let time_of = |row: Option<&usize>| row.map_or(0.0, |row| measurements[*row].time_s);
    let (begin, end) = (time_of(in_time.first()), time_of(in_time.last()));
    let time = end > begin;

    let approach = measurements.iter().all(|row| row.approach.len() == count);
    if !approach {
        notes.push(Note::NoApproach);
    }
    let moves = if approach { straight_moves(measurements, &in_time) } else { None };
    let links = measurements.iter().all(|row| row.temperatures_c.len() >= count);
    let ambient = measurements.iter().all(|row| row.ambient_c.is_some());
    let mut temperature = links || ambient;
    if !links && ambient {
        notes.push(Note::AirForLinks);
    }
    let temperatures = |row: &Measurement| -> (Vec<f64>, f64) {
        if links {
            let foot = row.ambient_c.unwrap_or(row.temperatures_c[0]);
            (row.temperatures_c[..count].to_vec(), foot)
        } else {
            let air = row.ambient_c.unwrap_or(0.0);
            (vec![air; count], air)
        }
    };
    let reference = in_time.first().filter(|_| temperature).map(|row| temperatures(measurements[*row]));
    if temperature {
        let mut spread: f64 = 0.0;
        for row in measurements {
            let (links, _) = temperatures(row);
            if let Some((reference, _)) = &reference {
                spread = links.iter().zip(reference).fold(spread, |most, (now, then)| most.max((now - then).abs()));
            }
        }
        if spread < settings.temperature_k {
            temperature = false;
            notes.push(Note::ConstantTemperature);
        }
    } else {
        notes.push(Note::NoTemperatures);
    }
    if measurements.iter().all(|row| row.payload_kg.is_none()) {
        notes.push(Note::NoPayload);
    }
    if !rows.mechanism.masses_known {
        notes.push(Note::NoMasses);
    }

    let mut readings: Vec<Reading> = Vec::with_capacity(total);
    for (row, measurement) in measurements.iter().enumerate() {
        let (rise_k, foot_rise_k) = match (&reference, temperature) {
            (Some((reference, foot)), true) => {
                let (now, now_foot) = temperatures(measurement);
                (now.iter().zip(reference).map(|(now, then)| now - then).collect(), now_foot - foot)
            }
            _ => (Vec::new(), 0.0),
        };
        readings.push(Reading {
            posture: rows.postures[row].clone(),
            joints: measurement.joints.clone(),
            slides: rows.mechanism.slides.clone(),
            target: rows.targets[row],
            approach: if approach { measurement.approach.iter().map(|sign| f64::from(*sign)).collect() } else { Vec::new() },
            rise_k,
            foot_rise_k,
            share: if time { (measurement.time_s - begin) / (end - begin) } else { 0.0 },
            order: order[row],
            torque_memory: vec![[0.0; FORGETTING_S.len()]; count],
            gravity: measurement.gravity(&rows.mechanism.gravity),
            since_begin_s: 0.0,
            behind: if moves.is_some() { vec![[0.0; FADING_S.len()]; count] } else { Vec::new() },
            memory: vec![[0.0; MEMORIES.len()]; count],
        });
    }
    if let Some(moves) = &moves {
        fall_behind(measurements, &in_time, moves, &mut readings);
    }
    // What remembers the loads of earlier readings, remembers those without effects.
    remember(measurements, &in_time, &mut readings);
    let deflected: Vec<Deflected> = readings
        .par_iter()
        .zip(measurements)
        .map(|(reading, row)| deflected(rows, reading, row.payload_kg.unwrap_or(0.0), present, loads))
        .collect();
    let (mut readings, displacement): (Vec<Reading>, Vec<Displacement>) =
        deflected.into_iter().map(|deflected| (deflected.reading, deflected.displacement)).unzip();
    remember(measurements, &in_time, &mut readings);
    let travel = (0..count)
        .map(|joint| {
            let values = measurements.iter().map(|row| row.joints[joint]);
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)])
        })
        .collect();
    let unknown = |reading: &Reading, joint: usize| {
        reading.posture.torque(joint).abs() < settings.upright * reading.posture.moment_sigma(joint)
    };
    let is_upright = |joint: usize| readings.iter().all(|reading| unknown(reading, joint));
    let upright = upright.map_or_else(|| (0..count).map(is_upright).collect(), <[bool]>::to_vec);
    let margin = ((settings.change_margin * total as f64) as usize).max(settings.change_margin_readings);
    let span = total.saturating_sub(2 * margin);
    let stride = span.div_ceil(settings.change_points.max(1)).max(1);
    let changes = (margin..total.saturating_sub(margin)).step_by(stride).collect();
    let columns = Columns {
        approach,
        moves: moves.is_some(),
        temperature,
        orientation: rows.equations.has_orientation(),
        time,
        rows: total,
        configurations: configurations(measurements),
        travel,
        upright,
        changes: if time { changes } else { Vec::new() },
    };
    (Conditions { readings, columns, notes, in_time }, displacement)
}

/// How many configurations there are.
fn configurations(measurements: &[&Measurement]) -> usize {
    let rounded = |row: &&Measurement| row.joints.iter().map(|value| (value / MOVED).round() as i64).collect::<Vec<_>>();
    measurements.iter().map(rounded).collect::<BTreeSet<_>>().len()
}

/// Of each row, the way of each joint from the reading before, rad or m: none at the first of a session. `None` where the sides of approach
/// tell of other moves: over a point between.
fn straight_moves(measurements: &[&Measurement], in_time: &[usize]) -> Option<Vec<Vec<f64>>> {
    let mut moves = vec![vec![0.0; measurements[*in_time.first()?].joints.len()]; measurements.len()];
    for pair in in_time.windows(2) {
        let [before, row] = [pair[0], pair[1]].map(|row| measurements[row]);
        if before.session != row.session {
            continue;
        }
        for (joint, way) in moves[pair[1]].iter_mut().enumerate() {
            *way = row.joints[joint] - before.joints[joint];
            if way.abs() > MOVED && f64::from(row.approach[joint]) * *way < 0.0 {
                return None;
            }
        }
    }
    Some(moves)
}

/// What is left of each joint's moves at each reading.
fn fall_behind(measurements: &[&Measurement], in_time: &[usize], moves: &[Vec<f64>], readings: &mut [Reading]) {
    let mut behind = readings.first().map_or_else(Vec::new, |reading| reading.behind.clone());
    let (mut before, mut begin_s): (Option<&Measurement>, f64) = (None, 0.0);
    for row in in_time {
        let now = measurements[*row];
        let pause = before.map_or(0.0, |before| (now.time_s - before.time_s).max(0.0));
        let begins = before.is_none_or(|before| before.session != now.session);
        for (behind, way) in behind.iter_mut().zip(&moves[*row]) {
            for (behind, fading) in behind.iter_mut().zip(FADING_S) {
                let kept = if begins || fading == 0.0 { 0.0 } else { libm::exp(-pause / fading) };
                *behind = *behind * kept + way;
            }
        }
        readings[*row].behind.clone_from(&behind);
        begin_s = if begins { now.time_s } else { begin_s };
        readings[*row].since_begin_s = now.time_s - begin_s;
        before = Some(now);
    }
}

/// What came before, in time: loads and moves that a joint may remember.
fn remember(measurements: &[&Measurement], in_time: &[usize], readings: &mut [Reading]) {
    let (count, total) = (readings.first().map_or(0, |reading| reading.joints.len()), readings.len());
    let mut memory = vec![[0.0; MEMORIES.len()]; count];
    for place in 0..total {
        let row = in_time[place];
        if let Some(before) = place.checked_sub(1).map(|before| in_time[before]) {
            let pause = measurements[row].time_s - measurements[before].time_s;
            for joint in 0..count {
                let torque = readings[row].posture.torque(joint);
                for (which, time) in FORGETTING_S.iter().enumerate() {
                    let kept = libm::exp(-pause.max(0.0) / time);
                    readings[row].torque_memory[joint][which] =
                        readings[before].torque_memory[joint][which] * kept + torque * (1.0 - kept);
                }
                let way = readings[row].joints[joint] - readings[before].joints[joint];
                // Where the last move's direction is known it may not be that of the whole way.
                let sign = if way == 0.0 { 0.0 } else { way.signum() };
                for (memory, length) in memory[joint].iter_mut().zip(MEMORIES) {
                    let kept = libm::exp(-way.abs() / length);
                    *memory = *memory * kept - sign * (1.0 - kept);
                }
                readings[row].memory[joint] = memory[joint];
            }
        } else {
            for joint in 0..count {
                readings[row].torque_memory[joint] = [readings[row].posture.torque(joint); FORGETTING_S.len()];
            }
        }
    }
}

/// Mean of vectors; zero where there are none.
#[must_use]
pub(crate) fn centre(points: &[Vector3<f64>]) -> Vector3<f64> {
    points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::tests::with_analysis;

    /// The readings of an undisturbed arm, `count` of them, all of which are the first one.
    fn alike(count: usize, ask: impl FnOnce(Vec<Measurement>, Vec<Reading>)) {
        with_analysis(
            |_, _, _, _, _| 0.0,
            |analysis| ask(vec![analysis.measurements[0].clone(); count], vec![analysis.conditions.readings[0].clone(); count]),
        );
    }

    #[test]
    fn a_move_in_two_parts_is_remembered_as_the_whole_and_a_long_one_forgets_all_before() {
        alike(4, |rows, mut readings| {
            let rows: Vec<&Measurement> = rows.iter().collect();
            for (at, reading) in readings.iter_mut().enumerate() {
                // Joint 1 in two parts, joint 2 at once, joint 3 there and far back.
                reading.joints[0] = [0.0, 0.1, 0.3, 0.3][at];
                reading.joints[1] = [0.0, 0.0, 0.3, 0.3][at];
                reading.joints[2] = [0.0, 0.3, -100.0, -100.0][at];
            }
            remember(&rows, &[0, 1, 2, 3], &mut readings);
            for (which, length) in MEMORIES.iter().enumerate() {
                // It lags behind its motion, and nothing is forgotten while it stands.
                let whole = -(1.0 - (-0.3 / length).exp());
                for joint in 0..2 {
                    let found = [2, 3].map(|at| readings[at].memory[joint][which]);
                    assert!(found.iter().all(|value| (value - whole).abs() < 1e-12), "{found:?} {whole}");
                }
                assert!((readings[2].memory[2][which] - 1.0).abs() < 1e-12);
            }
        });
    }

    #[test]
    fn a_load_that_stays_is_remembered_as_it_is() {
        alike(3, |rows, mut readings| {
            let rows: Vec<Measurement> =
                rows.into_iter().enumerate().map(|(at, row)| Measurement { time_s: 40.0 * at as f64, ..row }).collect();
            let rows: Vec<&Measurement> = rows.iter().collect();
            remember(&rows, &[0, 1, 2], &mut readings);
            for joint in 0..readings[0].joints.len() {
                let torque = readings[2].posture.torque(joint);
                assert!(
                    readings[2].torque_memory[joint].iter().all(|value| (value - torque).abs() < 1e-9 * torque.abs().max(1.0))
                );
            }
        });
    }
}
