//! `--shared-cache`: results that several machines share, in an object store or in a folder.
#[cfg(feature = "shared-cache")]
mod bounded;
#[cfg(feature = "shared-cache")]
mod connect;
#[cfg(feature = "shared-cache")]
mod remote;
mod url;

use crate::environment;
use crate::quit::Quit;
use shibo_engine::eval::{Seal, SharedStore, Trouble};
use std::sync::Arc;
pub(crate) use url::Address;

/// A shared cache, and its address for messages.
pub(crate) struct Shared {
    pub(crate) store: Arc<SharedStore>,
    address: Address,
}

/// The entries of a shared cache.
pub(crate) trait Entries {
    /// Calls `visit` with name, size and, if `whole`, bytes of every entry.
    fn each(&self, whole: bool, visit: &mut dyn FnMut(&str, u64, &[u8])) -> Result<(), Trouble>;

    /// Removes every entry; returns their number and size.
    fn clear(&self) -> Result<(u64, u64), Trouble>;
}

/// Seal of shared entries: includes the secret of the environment, if there is one.
pub(crate) fn seal(seal: Seal) -> Seal {
    environment::cache_key().map_or(seal, |secret| seal.keyed(&secret))
}

/// Opens the shared cache of the command line or else of the environment, if there is one; sends no request.
pub(crate) fn open(given: Option<&str>, build: Seal) -> Result<Option<Shared>, Quit> {
    let Some(address) = address(given)? else { return Ok(None) };
    let store = Arc::new(SharedStore::new(remote(&address)?, seal(build)));
    Ok(Some(Shared { store, address }))
}

/// Address of the shared cache.
pub(crate) fn address(given: Option<&str>) -> Result<Option<Address>, Quit> {
    let Some(url) = given.map(str::to_owned).or_else(environment::shared_cache) else { return Ok(None) };
    Address::read(&url).map(Some).map_err(Quit::Usage)
}

impl Shared {
    /// Finishes background work; returns a message if something failed.
    pub(crate) fn finish(&self) -> Option<String> {
        self.store.finish();
        let (trouble, times) = self.store.trouble()?;
        let often = if times > 1 { format!(" ({times} times)") } else { String::new() };
        let text = trouble.text();
        Some(format!("the shared cache {} {text}{often}; went on without it, with the same results", self.address))
    }
}

#[cfg(feature = "shared-cache")]
fn remote(address: &Address) -> Result<Box<dyn shibo_engine::eval::Remote>, Quit> {
    Ok(Box::new(remote::Objects::new(connect::connect(address)?, address)?))
}

/// Opens the entries of the shared cache at an address.
#[cfg(feature = "shared-cache")]
pub(crate) fn entries(address: &Address) -> Result<Box<dyn Entries>, Quit> {
    Ok(Box::new(remote::Objects::new(connect::connect(address)?, address)?))
}

#[cfg(not(feature = "shared-cache"))]
fn remote(_address: &Address) -> Result<Box<dyn shibo_engine::eval::Remote>, Quit> {
    Err(without())
}

/// Opens the entries of the shared cache at an address.
#[cfg(not(feature = "shared-cache"))]
pub(crate) fn entries(_address: &Address) -> Result<Box<dyn Entries>, Quit> {
    Err(without())
}

#[cfg(not(feature = "shared-cache"))]
fn without() -> Quit {
    Quit::Usage(
        "this program was built without shared caches: build it with `cargo build --release --features shared-cache`, or leave \
         out `--shared-cache` and the variable SHIBO_SHARED_CACHE"
            .into(),
    )
}
