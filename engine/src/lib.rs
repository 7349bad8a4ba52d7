//! Shibo engine.
