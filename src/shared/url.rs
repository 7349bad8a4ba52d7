//! Address of a shared cache.
use std::fmt;

/// Kinds of stores.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    S3,
    Google,
    Azure,
    /// A WebDAV server.
    Http,
    Folder,
}

const KINDS: [(&str, Kind); 6] = [
    ("s3", Kind::S3),
    ("gs", Kind::Google),
    ("az", Kind::Azure),
    ("http", Kind::Http),
    ("https", Kind::Http),
    ("file", Kind::Folder),
];

/// A parsed address, without secrets.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Address {
    pub(crate) kind: Kind,
    scheme: &'static str,
    /// Bucket, container or server.
    pub(crate) host: String,
    /// Remaining path, without slashes around it.
    pub(crate) path: String,
}

impl Address {
    /// Parses an address. Error messages do not quote parts that might be secret.
    pub(crate) fn read(url: &str) -> Result<Self, String> {
        let forms = "s3://BUCKET/PREFIX, gs://, az://, https:// or file:///FOLDER";
        let Some((scheme, rest)) = url.split_once("://") else {
            return Err(format!("the shared cache must be an address: {forms}"));
        };
        let word: String = scheme.chars().take(20).collect();
        let Some((scheme, kind)) = KINDS.into_iter().find(|(name, _)| scheme.eq_ignore_ascii_case(name)) else {
            return Err(format!("the shared cache has the unknown scheme `{word}`; write {forms}"));
        };
        let (host, path) = rest.split_once('/').unwrap_or((rest, ""));
        if host.contains('@') || (kind != Kind::Folder && rest.contains(['?', '#'])) {
            let message = "the address of the shared cache holds a credential or a query, which others could read";
            return Err(format!("{message}; give credentials by the environment, as AWS_SECRET_ACCESS_KEY say"));
        }
        let path = path.trim_matches('/');
        if kind == Kind::Folder {
            if !matches!(host, "" | "localhost") || path.is_empty() {
                return Err(
                    "the shared cache in a folder must be written with its whole path: file:///mnt/share".into()
                );
            }
        } else if host.is_empty() || host.contains(|c: char| c.is_whitespace() || c.is_control()) {
            return Err(format!("the address of the shared cache names no bucket or server; write {forms}"));
        }
        if path.split('/').any(|part| part == "..") {
            return Err("the address of the shared cache must not contain `..`".into());
        }
        Ok(Self { kind, scheme, host: host.to_owned(), path: path.to_owned() })
    }

    /// Address of the server, for stores without buckets.
    #[cfg_attr(not(feature = "shared-cache"), expect(dead_code, reason = "only a connection needs it"))]
    pub(crate) fn server(&self) -> String {
        format!("{}://{}", self.scheme, self.host)
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let slash = if self.path.is_empty() { "" } else { "/" };
        write!(f, "{}://{}{slash}{}", self.scheme, self.host, self.path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parses_addresses() {
        let address =
            |kind, scheme, host: &str, path: &str| Address { kind, scheme, host: host.into(), path: path.into() };
        assert_eq!(Address::read("s3://b/a/c/"), Ok(address(Kind::S3, "s3", "b", "a/c")));
        assert_eq!(Address::read("S3://b"), Ok(address(Kind::S3, "s3", "b", "")));
        assert_eq!(Address::read("file:///mnt/share"), Ok(address(Kind::Folder, "file", "", "mnt/share")));
        assert_eq!(Address::read("https://h:80/x").unwrap().server(), "https://h:80");
        assert_eq!(Address::read("file:///mnt/share").unwrap().to_string(), "file:///mnt/share");
    }

    #[test]
    fn rejects_secrets_without_repeating_them() {
        for url in ["s3://key:hunter2@b/p", "https://hunter2@h/", "https://h/p?sig=hunter2", "s3://b/p#hunter2"] {
            let message = Address::read(url).unwrap_err();
            assert!(!message.contains("hunter2") && message.contains("environment"), "{message}");
        }
        for url in ["", "b/p", "ftp://b/p", "s3://", "s3:///p", "file://host/p", "file:///", "s3://b/../c", "s3://a b/"]
        {
            assert!(Address::read(url).is_err(), "{url}");
        }
    }
}
