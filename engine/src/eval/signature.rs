//! Detects from metadata that a file may have changed, without reading it.
use std::fs::Metadata;
use std::time::{Duration, SystemTime};

/// File systems have coarse clocks: a file changed less than this before it was read may change again without changing
/// its times.
const COARSE: Duration = Duration::from_secs(2);

/// File metadata that identifies a content without reading it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Signature {
    is_file: bool,
    length: u64,
    modified: Option<SystemTime>,
    changed: Option<SystemTime>,
    /// Device and inode number, where the system has them.
    identity: [u64; 2],
}

impl Signature {
    /// The signature of a file with this metadata.
    pub fn of(metadata: &Metadata) -> Self {
        let (changed, identity) = unix(metadata);
        Self {
            is_file: metadata.is_file(),
            length: metadata.len(),
            modified: metadata.modified().ok(),
            changed,
            identity,
        }
    }

    /// The length of the file in bytes.
    pub const fn length(&self) -> u64 {
        self.length
    }

    /// Returns true if a change after `read`, the time the content was read, could leave the signature unchanged.
    pub fn may_hide_a_change(&self, read: SystemTime) -> bool {
        let near = |time: SystemTime| read.duration_since(time).unwrap_or_else(|e| e.duration()) < COARSE;
        [self.modified, self.changed].into_iter().flatten().any(near)
    }
}

#[cfg(unix)]
fn unix(metadata: &Metadata) -> (Option<SystemTime>, [u64; 2]) {
    use std::os::unix::fs::MetadataExt;
    let seconds = u64::try_from(metadata.ctime()).ok();
    let nanos = u64::try_from(metadata.ctime_nsec()).unwrap_or(0);
    let changed = seconds.map(|s| SystemTime::UNIX_EPOCH + Duration::from_secs(s) + Duration::from_nanos(nanos));
    (changed, [metadata.dev(), metadata.ino()])
}

#[cfg(not(unix))]
fn unix(_metadata: &Metadata) -> (Option<SystemTime>, [u64; 2]) {
    (None, [0; 2])
}
