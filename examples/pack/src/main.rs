//! The command `shibo` with the nodes of this pack: `render`, `check`, `watch`, `lsp`, `nodes` and all others.
use std::process::ExitCode;

fn main() -> ExitCode {
    shibo::main(shibo_example_pack::registry)
}
