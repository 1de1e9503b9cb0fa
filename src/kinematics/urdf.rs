//! URDF in and out (placeholder until the branch lands).
use crate::arm::Arm;
/// E
#[derive(Debug, thiserror::Error)]
#[error("urdf not there")]
pub struct UrdfError;
/// I
pub struct Imported { /// A
 pub arm: Arm }
/// X
pub fn export(_: &Arm) -> Result<String, UrdfError> { Ok(String::new()) }
/// X
pub fn export_with(_: &Arm, _: &[f64]) -> Result<String, UrdfError> { Ok(String::new()) }
/// X
pub fn read(_: &std::path::Path, _: Option<&str>, _: Option<&str>) -> Result<Imported, UrdfError> { Err(UrdfError) }
