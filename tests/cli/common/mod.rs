//! Shared by tests.
pub(crate) mod bad;
pub(crate) mod facts;
pub(crate) mod kinds;
