//! Coordinates in which a joint or its link yields, each one axis of the multibody with a law of its own.

/// A coordinate outboard of the joint's motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::simulation) struct Coordinate {
    pub(in crate::simulation) joint: usize,
    pub(in crate::simulation) direction: Direction,
    pub(in crate::simulation) law: Law,
}

/// Which motion it is, in the frame after the joint's motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::simulation) enum Direction {
    /// About the joint's axis (along it where the joint slides).
    Joint,
    /// Across the link, at a place of it.
    Across { bend: Bend, axis: Axis },
}

/// Where a link bends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::simulation) enum Bend {
    /// At the joint: x and y are those of the link, across the joint's axis.
    Joint,
    /// At a point of [`BEAM_POINTS`]: x and y are across the line from joint to joint.
    Beam { point: usize },
}

/// An axis of a place where a link bends. A bend of so much about two axes is one turn about an axis between them; hinges one after the
/// other twist the link besides, by half the product of their angles. With half of x before y and half after it, that twist is nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::simulation) enum Axis {
    /// Half of what turns about x.
    FirstX,
    /// About y, turned with what is before it.
    Y,
    /// The other half.
    LastX,
}

impl Axis {
    /// In the order of the series.
    pub(in crate::simulation) const ALL: [Axis; 3] = [Axis::FirstX, Axis::Y, Axis::LastX];

    /// Its part of all that turns about its direction.
    pub(in crate::simulation) const fn share(self) -> f64 {
        match self {
            Axis::FirstX | Axis::LastX => 0.5,
            Axis::Y => 1.0,
        }
    }
}

/// Where a beam is hinged, as shares of its length: the points of Gauss's rule, 1/2 ∓ 1/(2 √3).
pub(in crate::simulation) const BEAM_POINTS: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];

/// What holds it. Units per rad, or per m where the joint slides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::simulation) enum Law {
    /// A linear spring, N·m/rad.
    Spring { stiffness: f64 },
    /// The same, and a servo that adds the sag which it expects from the load that it knows of.
    Compensated { stiffness: f64 },
    /// Load = stiffness · θ + cubic · θ³.
    Hardening { stiffness: f64, cubic: f64 },
    /// A spring of this compliance (rad/(N·m)) with a damper beside it, which yields with this time constant (s).
    Creep { compliance: f64, time_constant: f64 },
    /// Free between ± half a width: gravity decides.
    LostMotion { half_width: f64 },
    /// Between two stops of the motor's, with friction against the inboard part.
    Backlash { half_width: f64 },
}

impl Law {
    /// Name in results: that of the effect.
    pub(in crate::simulation) fn name(self, direction: Direction) -> &'static str {
        match (self, direction) {
            (Law::Spring { .. }, Direction::Joint) => "joint_compliance",
            (Law::Spring { .. }, _) => "link_bending",
            (Law::Compensated { .. }, _) => "wrong_payload",
            (Law::Hardening { .. }, _) => "hardening_stiffness",
            (Law::Creep { .. }, _) => "creep_after_motion",
            (Law::LostMotion { .. }, _) => "gravity_lost_motion",
            (Law::Backlash { .. }, _) => "backlash",
        }
    }
}

/// What acts on a coordinate during a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::simulation) enum Hold {
    /// Stiffness and the coordinate at which it is relaxed.
    Spring { stiffness: f64, rest: f64 },
    /// Between two limits.
    Between { lower: f64, upper: f64 },
}

/// The spring that hardens, as its tangent at `at`: steps then converge as Newton's do.
pub(in crate::simulation) fn tangent(stiffness: f64, cubic: f64, at: f64) -> Hold {
    let slope = stiffness + 3.0 * cubic * at * at;
    Hold::Spring { stiffness: slope, rest: at - at * (stiffness + cubic * at * at) / slope }
}

/// Spring and damper after `dwell_s` at constant load, from `start`: the exact solution `rest + (start − rest) e^(−t/T)`, in which
/// `rest` is compliance times load, is that of a stiffer spring with another resting place.
pub(in crate::simulation) fn crept(compliance: f64, time_constant: f64, start: f64, dwell_s: f64) -> Hold {
    let kept = libm::exp(-dwell_s / time_constant);
    // Before anything has crept the coordinate is as good as locked.
    let yielded = (1.0 - kept).max(1e-9);
    Hold::Spring { stiffness: 1.0 / (yielded * compliance), rest: kept * start }
}
