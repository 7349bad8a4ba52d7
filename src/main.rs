//! The `shibo` command.
fn main() {}
