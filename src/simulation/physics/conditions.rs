//! Under what a pose is taken up: all that the true arm's place depends on besides itself.

/// The conditions of one reading. Nothing else goes into its result.
#[derive(Clone, Copy, Debug)]
pub struct Conditions<'a> {
    /// Commanded joint coordinates, rad or m.
    pub joints: &'a [f64],
    /// Joint coordinates from which the last move comes, rad or m.
    pub from: &'a [f64],
    /// Rise of each link over the temperature at which the arm is nominal, base link first, K.
    pub rise_k: &'a [f64],
    /// Mass that the tool is believed to carry, kg.
    pub payload_kg: f64,
    /// Since the start of the session, s.
    pub time_s: f64,
    /// Length of the session, s.
    pub session_s: f64,
    /// From the end of the last move to the reading, s.
    pub dwell_s: f64,
    /// The earlier readings of the session, in their order.
    pub history: &'a [Stop<'a>],
}

/// An earlier reading of the session.
#[derive(Clone, Copy, Debug)]
pub struct Stop<'a> {
    /// Commanded joint coordinates, rad or m.
    pub joints: &'a [f64],
    /// Joint coordinates from which the last move came, rad or m.
    pub from: &'a [f64],
    /// Mass that the tool was believed to carry, kg.
    pub payload_kg: f64,
    /// Time of the reading since the start of the session, s.
    pub time_s: f64,
    /// From the end of the move to the reading, s.
    pub dwell_s: f64,
}

impl<'a> Conditions<'a> {
    /// The first reading of a session, at `joints`, without a move, payload or warmth.
    #[must_use]
    pub fn still(joints: &'a [f64], rise_k: &'a [f64]) -> Self {
        Conditions { joints, from: joints, rise_k, payload_kg: 0.0, time_s: 0.0, session_s: 0.0, dwell_s: 0.0, history: &[] }
    }

    /// Share of the session that has passed, 0 to 1.
    pub(super) fn share(&self) -> f64 {
        if self.session_s > 0.0 { (self.time_s / self.session_s).clamp(0.0, 1.0) } else { 0.0 }
    }

    /// The last way of joint `joint`, newest move first: pairs of where a straight move began and where it ended.
    pub(super) fn moves_backwards(&self, joint: usize) -> impl Iterator<Item = (f64, f64)> + '_ {
        let stops = self.history.iter().rev().map(move |stop| (stop.from[joint], stop.joints[joint]));
        let mut later: Option<f64> = None;
        std::iter::once((self.from[joint], self.joints[joint])).chain(stops).flat_map(move |(from, to)| {
            // Before the last move of a reading, the joint goes from where it was read last to where that move begins.
            let between = later.replace(from).map(|start| (to, start));
            [between, Some((from, to))].into_iter().flatten()
        })
    }
}
