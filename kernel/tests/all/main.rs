//! The methods: vectors, properties and statistics.
mod leather_properties;
mod leather_statistics;
mod leather_vectors;
mod synthesis;
mod synthesis_joints;
mod synthesis_mended;
mod synthesis_properties;
mod synthesis_vectors;
mod wood_vectors;
