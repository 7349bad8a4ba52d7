//! Build script: gives the crate `CODE_FINGERPRINT`, which keeps cached results of another version apart.

fn main() -> std::io::Result<()> {
    shibo_fingerprint::emit()
}
