//! Shared by tests.
pub mod bad;
