//! The program `shibo`: the command with the nodes of Shibo.
use std::process::ExitCode;

// With several threads, the allocator of musl is slow.
#[cfg(target_env = "musl")]
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    shibo::main(shibo_library::registry)
}
