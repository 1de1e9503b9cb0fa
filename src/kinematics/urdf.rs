//! URDF in and out.
