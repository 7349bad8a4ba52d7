//! The program `shibo`: the command with the nodes of Shibo.
use std::process::ExitCode;

fn main() -> ExitCode {
    shibo::main(shibo_library::registry)
}
