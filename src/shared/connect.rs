//! Creates the client for an address. Credentials come from the usual environment variables of each store.
use super::bounded::Bounded;
use super::url::{Address, Kind};
use crate::quit::Quit;
use object_store::aws::{AmazonS3Builder, AmazonS3ConfigKey};
use object_store::azure::{AzureConfigKey, MicrosoftAzureBuilder};
use object_store::gcp::{GoogleCloudStorageBuilder, GoogleConfigKey};
use object_store::http::HttpBuilder;
use object_store::local::LocalFileSystem;
use object_store::{ClientConfigKey, ClientOptions, ObjectStore, RetryConfig};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// Creates a client for an address, without sending a request.
pub(super) fn connect(address: &Address) -> Result<Arc<dyn ObjectStore>, Quit> {
    // Fails if a provider is installed already, which is fine too.
    let _ = rustls::crypto::ring::default_provider().install_default();
    built(address).map_err(|error| {
        // The error text might quote a secret, so only its kind is shown.
        let kind = match error {
            object_store::Error::NotFound { .. } => "it does not exist",
            object_store::Error::PermissionDenied { .. } => "it may not be used",
            _ => "its settings in the environment are not complete or not right",
        };
        Quit::Usage(format!("the shared cache {address} cannot be used: {kind}"))
    })
}

/// The engine decides itself which requests are retried.
fn never_again() -> RetryConfig {
    RetryConfig { max_retries: 0, retry_timeout: Duration::from_secs(1), ..RetryConfig::default() }
}

fn built(address: &Address) -> object_store::Result<Arc<dyn ObjectStore>> {
    let (connect, host) = (ClientConfigKey::ConnectTimeout, address.host.as_str());
    Ok(match address.kind {
        Kind::S3 => {
            let builder = AmazonS3Builder::from_env().with_bucket_name(host).with_retry(never_again());
            let builder = builder.with_http_connector(Bounded);
            Arc::new(builder.with_config(AmazonS3ConfigKey::Client(connect), "1 second").build()?)
        }
        Kind::Google => {
            let builder = GoogleCloudStorageBuilder::from_env().with_bucket_name(host).with_retry(never_again());
            let builder = builder.with_http_connector(Bounded);
            Arc::new(builder.with_config(GoogleConfigKey::Client(connect), "1 second").build()?)
        }
        Kind::Azure => {
            let builder = MicrosoftAzureBuilder::from_env().with_container_name(host).with_retry(never_again());
            let builder = builder.with_http_connector(Bounded);
            Arc::new(builder.with_config(AzureConfigKey::Client(connect), "1 second").build()?)
        }
        Kind::Http => {
            let plain = address.server().starts_with("http:");
            let options = ClientOptions::new().with_allow_http(plain).with_connect_timeout(Duration::from_secs(1));
            let builder = HttpBuilder::new().with_url(address.server()).with_retry(never_again());
            Arc::new(builder.with_http_connector(Bounded).with_client_options(options).build()?)
        }
        Kind::Folder => {
            let folder = PathBuf::from(format!("/{}", address.path));
            let made = std::fs::create_dir_all(&folder).and_then(|()| folder.canonicalize());
            let folder =
                made.map_err(|source| object_store::Error::NotFound { path: String::new(), source: Box::new(source) })?;
            Arc::new(LocalFileSystem::new_with_prefix(folder)?)
        }
    })
}
