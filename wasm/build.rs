//! Options of the linker.
fn main() {
    if std::env::var_os("CARGO_CFG_TARGET_FAMILY").is_some_and(|family| family == "wasm") {
        // Graphs may be nested as deep as natively. The engine itself keeps results in 512 MiB, and nodes may take as many again.
        println!("cargo::rustc-link-arg-cdylib=-zstack-size=8388608");
        println!("cargo::rustc-link-arg-cdylib=--max-memory=2147483648");
    }
    println!("cargo::rerun-if-changed=build.rs");
}
