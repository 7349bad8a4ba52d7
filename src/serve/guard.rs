//! Decides which requests are answered, and sets the security headers of the answers.
use super::connections::Acquaintance;
use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::header::{self, HeaderName, HeaderValue};
use axum::http::{HeaderMap, Method, StatusCode};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use std::sync::Arc;

/// Content Security Policy: only the page's own files, nothing inline.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src 'self'; \
    worker-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

const HEADERS: [(HeaderName, &str); 7] = [
    (header::CONTENT_SECURITY_POLICY, POLICY),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::X_FRAME_OPTIONS, "DENY"),
    (header::REFERRER_POLICY, "no-referrer"),
    (header::CACHE_CONTROL, "no-store"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
];

/// Expected host, origin and token of a request.
#[derive(Clone, Debug)]
pub(super) struct Guard {
    host: String,
    origin: String,
    token: String,
}

impl Guard {
    /// Creates the guard of the page at `port` with `token` in its address.
    pub(super) fn new(port: u16, token: &str) -> Self {
        let host = format!("127.0.0.1:{port}");
        Self { origin: format!("http://{host}"), host, token: token.to_owned() }
    }

    /// Returns the status with which a request is refused, if it is.
    fn refusal(&self, method: &Method, path: &str, authority: Option<&str>, headers: &HeaderMap) -> Option<StatusCode> {
        let is = |name: HeaderName, wanted: &str| {
            let mut values = headers.get_all(name).iter();
            let first = values.next();
            (first.map(|v| v.as_bytes() == wanted.as_bytes()), values.next().is_none())
        };
        let ours =
            matches!(is(header::HOST, &self.host), (Some(true), true)) && authority.is_none_or(|a| a == self.host);
        let origin = match is(header::ORIGIN, &self.origin) {
            (None, _) => method == Method::GET || method == Method::HEAD,
            (Some(same), alone) => same && alone,
        };
        let site = headers.get("sec-fetch-site").is_none_or(|site| site == "same-origin" || site == "none");
        if !ours || !origin || !site {
            return Some(StatusCode::FORBIDDEN);
        }
        let known = path.strip_prefix('/').and_then(|path| path.split_once('/')).is_some_and(|(t, _)| self.is_token(t));
        (!known).then_some(StatusCode::NOT_FOUND)
    }

    /// Compares in constant time: the duration does not depend on the number of matching bytes.
    fn is_token(&self, given: &str) -> bool {
        let (a, b) = (self.token.as_bytes(), given.as_bytes());
        a.len() == b.len() && a.iter().zip(b).fold(0, |all, (a, b)| all | (a ^ b)) == 0
    }
}

/// Page for an old address, such as that of a bookmark. It contains nothing of the graph.
const MOVED: &str = include_str!("page/moved.html");

/// Returns true for a request of a browser that will show the answer to its user.
fn wants_page(headers: &HeaderMap) -> bool {
    headers.get(header::ACCEPT).and_then(|kinds| kinds.to_str().ok()).is_some_and(|kinds| kinds.contains("text/html"))
}

/// Passes permitted requests on, and adds the headers to all answers.
pub(super) async fn guard(State(guard): State<Arc<Guard>>, request: Request<Body>, next: Next) -> Response {
    let uri = request.uri();
    let authority = uri.authority().map(ToString::to_string);
    let mut response = match guard.refusal(request.method(), uri.path(), authority.as_deref(), request.headers()) {
        // A client without the token must not keep its connection.
        Some(status) if status == StatusCode::NOT_FOUND && wants_page(request.headers()) => {
            let kind = [(header::CONNECTION, "close"), (header::CONTENT_TYPE, "text/html; charset=utf-8")];
            (status, kind, MOVED).into_response()
        }
        Some(status) => (status, [(header::CONNECTION, "close")]).into_response(),
        None => {
            request.extensions().get::<Acquaintance>().into_iter().for_each(Acquaintance::make);
            next.run(request).await
        }
    };
    for (name, value) in HEADERS {
        response.headers_mut().entry(name).or_insert(HeaderValue::from_static(value));
    }
    response
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(method: &Method, path: &str, list: &[(&'static str, &'static str)]) -> Option<u16> {
        let mut headers = HeaderMap::new();
        for (name, value) in list {
            headers.append(*name, HeaderValue::from_static(value));
        }
        Guard::new(80, "abc").refusal(method, path, None, &headers).map(|s| s.as_u16())
    }

    #[test]
    fn accepts_requests_of_own_page_only() {
        let host = ("host", "127.0.0.1:80");
        let origin = ("origin", "http://127.0.0.1:80");
        let get = |path, list: &[_]| refused(&Method::GET, path, list);
        assert_eq!(get("/abc/", &[host]), None);
        assert_eq!(get("/abc/x", &[host, origin, ("sec-fetch-site", "same-origin")]), None);
        assert_eq!(get("/abd/", &[host]), Some(404));
        assert_eq!(get("/abc", &[host]), Some(404));
        assert_eq!(get("/", &[host]), Some(404));
        assert_eq!(get("/abc/", &[]), Some(403));
        assert_eq!(get("/abc/", &[host, host]), Some(403));
        assert_eq!(get("/abc/", &[("host", "localhost:80")]), Some(403));
        assert_eq!(get("/abc/", &[("host", "127.0.0.1:81")]), Some(403));
        assert_eq!(get("/abc/", &[host, ("origin", "null")]), Some(403));
        assert_eq!(get("/abc/", &[host, ("origin", "http://evil.example")]), Some(403));
        assert_eq!(get("/abc/", &[host, origin, origin]), Some(403));
        assert_eq!(get("/abc/", &[host, ("sec-fetch-site", "cross-site")]), Some(403));
        assert_eq!(refused(&Method::POST, "/abc/values", &[host]), Some(403));
        assert_eq!(refused(&Method::POST, "/abc/values", &[host, origin]), None);
        let guard = Guard::new(80, "abc");
        let headers = HeaderMap::from_iter([(header::HOST, HeaderValue::from_static("127.0.0.1:80"))]);
        assert!(guard.refusal(&Method::GET, "/abc/", Some("evil:80"), &headers).is_some());
    }
}
