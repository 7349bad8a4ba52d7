//! Shared by tests.
pub(crate) mod bad;
