//! Build script: gives the crate `CODE_FINGERPRINT`, which names the results of this build.

fn main() -> std::io::Result<()> {
    shibo_fingerprint::emit()
}
