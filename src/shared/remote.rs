//! An object store behind the engine's interface: all calls have a timeout.
use super::Entries;
use super::url::{Address, Kind};
use crate::quit::Quit;
use axum::body::Bytes;
use futures_util::{Stream, StreamExt};
use object_store::path::Path;
use object_store::{Error, ObjectStore, ObjectStoreExt, PutPayload};
use shibo_engine::eval::{Remote, Shelf, Trouble};
use std::future::Future;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use tokio::runtime::Runtime;

/// Folder below the user's prefix; nothing outside it is ever touched.
const FOLDER: &str = "shibo-cache-1";
/// Timeout of `shibo cache` for one answer.
const PATIENCE: Duration = Duration::from_secs(30);

/// An object store.
pub(super) struct Objects {
    store: Arc<dyn ObjectStore>,
    prefix: Path,
    /// Path of the store if it is a folder.
    folder: Option<PathBuf>,
    /// Removed on drop: a hanging call must not delay the end of the command.
    runtime: Option<Runtime>,
}

impl Objects {
    pub(super) fn new(store: Arc<dyn ObjectStore>, address: &Address) -> Result<Self, Quit> {
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build();
        let runtime = runtime.map_err(|error| Quit::failed(format!("cannot start a thread: {error}")))?;
        // For a folder, the store is already rooted there.
        let path = if address.kind == Kind::Folder { "" } else { &address.path };
        let prefix = path.split('/').filter(|part| !part.is_empty()).chain([FOLDER]).collect();
        let folder = (address.kind == Kind::Folder).then(|| PathBuf::from(format!("/{}", address.path)));
        Ok(Self { store, prefix, folder, runtime: Some(runtime) })
    }

    fn within<T>(&self, time: Duration, work: impl Future<Output = object_store::Result<T>>) -> Result<T, Trouble> {
        let Some(runtime) = &self.runtime else { return Err(Trouble::Gone) };
        let limited = async { tokio::time::timeout(time, work).await };
        match runtime.block_on(limited) {
            Ok(done) => done.map_err(|error| trouble(&error)),
            Err(_) => Err(Trouble::Slow),
        }
    }

    fn path(&self, name: &str) -> Path {
        name.split('/').fold(self.prefix.clone(), |path, part| path.join(part))
    }

    /// Returns true if no part of an entry's path is a symbolic link, which could lead to files of the user.
    fn is_inside(&self, location: &Path) -> bool {
        let mut at = self.folder.clone();
        location.parts().all(|part| {
            at.as_mut().is_none_or(|at| {
                at.push(part.as_ref());
                !at.is_symlink()
            })
        })
    }

    /// Names and sizes of all entries; other files are skipped.
    fn list(&self) -> Result<Vec<(String, u64)>, Trouble> {
        let mut found = Vec::new();
        for shelf in Shelf::ALL {
            let folder = self.path(shelf.name());
            let mut stream = self.store.list(Some(&folder));
            while let Some(entry) = self.within(PATIENCE, async { stream.next().await.transpose() })? {
                let inside = entry.location.prefix_match(&self.prefix);
                let name = inside.map(|parts| parts.map(|part| part.as_ref().to_owned()).collect::<Vec<_>>().join("/"));
                let name = name.filter(|name| Shelf::is_entry(name) && self.is_inside(&entry.location));
                found.extend(name.map(|name| (name, entry.size)));
            }
        }
        Ok(found)
    }
}

impl Drop for Objects {
    fn drop(&mut self) {
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_background();
        }
    }
}

impl Remote for Objects {
    fn get(&self, name: &str, most: u64, within: Duration) -> Result<Option<Vec<u8>>, Trouble> {
        let path = self.path(name);
        let found = self.within(within, async {
            match self.store.get(&path).await {
                Ok(found) if found.meta.size > most => Ok(Some(Err(Trouble::Wrong))),
                Ok(found) => {
                    let size = found.meta.size;
                    Ok(Some(collected(found.into_stream(), size).await?))
                }
                Err(Error::NotFound { .. }) => Ok(None),
                Err(error) => Err(error),
            }
        });
        found.and_then(Option::transpose)
    }

    fn put(&self, name: &str, bytes: Vec<u8>, within: Duration) -> Result<(), Trouble> {
        let path = self.path(name);
        self.within(within, async { self.store.put(&path, PutPayload::from(bytes)).await }).map(drop)
    }
}

impl Entries for Objects {
    fn each(&self, whole: bool, visit: &mut dyn FnMut(&str, u64, &[u8])) -> Result<(), Trouble> {
        for (name, size) in self.list()? {
            if whole {
                let bytes = self.get(&name, u64::MAX, PATIENCE)?;
                bytes.into_iter().for_each(|bytes| visit(&name, size, &bytes));
            } else {
                visit(&name, size, &[]);
            }
        }
        Ok(())
    }

    fn clear(&self) -> Result<(u64, u64), Trouble> {
        let (mut count, mut bytes) = (0, 0);
        for (name, size) in self.list()? {
            let path = self.path(&name);
            self.within(PATIENCE, async { self.store.delete(&path).await })?;
            (count, bytes) = (count + 1, bytes + size);
        }
        Ok((count, bytes))
    }
}

/// Collects a stream of announced length; stops reading beyond that length.
async fn collected<E>(
    mut stream: impl Stream<Item = Result<Bytes, E>> + Unpin,
    size: u64,
) -> Result<Result<Vec<u8>, Trouble>, E> {
    let mut bytes = Vec::new();
    while let Some(part) = stream.next().await {
        let part = part?;
        if (bytes.len() + part.len()) as u64 > size {
            return Ok(Err(Trouble::Wrong));
        }
        bytes.extend_from_slice(&part);
    }
    Ok(Ok(bytes))
}

/// Classifies an error. Its text is not shown, since it could quote a secret.
fn trouble(error: &Error) -> Trouble {
    let mut text = String::new();
    let mut cause = Some(error as &dyn std::error::Error);
    while let Some(error) = cause {
        text.push_str(&error.to_string().to_lowercase());
        cause = error.source();
    }
    let says = |words: &[&str]| words.iter().any(|word| text.contains(word));
    match error {
        Error::NotFound { .. } => Trouble::Missing,
        Error::PermissionDenied { .. } | Error::Unauthenticated { .. } => Trouble::Denied,
        _ if says(&["nosuchbucket", "containernotfound"]) => Trouble::Missing,
        _ if says(&["status code: 403", "403 forbidden", "401 unauthorized", "permission denied"]) => Trouble::Denied,
        _ if says(&["timed out", "timeout"]) => Trouble::Slow,
        _ if says(&["status code: 5", "server error", "slowdown"]) => Trouble::Failed,
        _ => Trouble::Gone,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classifies_errors_by_kind() {
        let error = |text: &str| Error::Generic { store: "S3", source: text.into() };
        let cases = [
            ("Server returned non-2xx status code: 503 Service Unavailable", Trouble::Failed),
            ("error sending request: operation timed out", Trouble::Slow),
            ("Server returned non-2xx status code: 404: NoSuchBucket", Trouble::Missing),
            ("connection refused", Trouble::Gone),
        ];
        for (text, expected) in cases {
            assert_eq!(trouble(&error(text)), expected, "{text}");
        }
    }
}
