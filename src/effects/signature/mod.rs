//! Closed-form signatures of un-modelled effects: what each does to the pose that is read, derived on their own (never from the
//! physics that makes them happen). One file per kind, with its columns and its hypotheses; [`unnamed`] has the shapes of no kind.

mod backlash;
mod base_drift;
mod base_step;
mod base_tilt;
mod gear_coupling;
mod gravity_lost_motion;
mod joint_compliance;
mod joint_eccentricity;
mod joint_thermal_drift;
pub mod library;
mod link_bending;
mod link_thermal_growth;
mod measurement_scale;
pub mod posture;
mod radial_clearance;
pub mod shape;
mod strain_wave_error;
mod tilt_clearance;
mod tool_step;
pub mod unnamed;
