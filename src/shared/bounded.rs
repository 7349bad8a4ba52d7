//! Bounds the size of server answers: reading stops at a limit, so an endless answer uses no memory.
use axum::body::Bytes;
use hyper::body::{Body, Frame, SizeHint};
use object_store::ClientOptions;
use object_store::client::{
    HttpClient, HttpConnector, HttpError, HttpErrorKind, HttpRequest, HttpResponse, HttpResponseBody, HttpService,
    ReqwestConnector,
};
use shibo_engine::eval::LARGEST_ANSWER;
use std::future::Future;
use std::pin::Pin;
use std::task::{Context, Poll};

/// Maximum size in bytes of an answer that only reports an error.
const REASON: u64 = 64 << 10;

/// Factory for clients that bound answers.
#[derive(Debug)]
pub(super) struct Bounded;

impl HttpConnector for Bounded {
    fn connect(&self, options: &ClientOptions) -> object_store::Result<HttpClient> {
        Ok(HttpClient::new(Service(ReqwestConnector::default().connect(options)?)))
    }
}

/// A client.
#[derive(Debug)]
struct Service(HttpClient);

impl HttpService for Service {
    fn call<'s, 'a>(
        &'s self,
        request: HttpRequest,
    ) -> Pin<Box<dyn Future<Output = Result<HttpResponse, HttpError>> + Send + 'a>>
    where
        's: 'a,
        Self: 'a,
    {
        Box::pin(async move {
            let response = self.0.execute(request).await?;
            let left = if response.status().is_success() { LARGEST_ANSWER } else { REASON };
            Ok(response.map(|body| HttpResponseBody::new(Answer { body, left })))
        })
    }
}

/// Body of an answer, and the number of bytes still allowed.
struct Answer<B> {
    body: B,
    left: u64,
}

impl<B: Body<Data = Bytes, Error = HttpError> + Unpin> Body for Answer<B> {
    type Data = Bytes;
    type Error = HttpError;

    fn poll_frame(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Option<Result<Frame<Bytes>, HttpError>>> {
        let polled = Pin::new(&mut self.body).poll_frame(cx);
        let Poll::Ready(Some(Ok(frame))) = polled else { return polled };
        match self.left.checked_sub(frame.data_ref().map_or(0, |data| data.len() as u64)) {
            Some(left) => {
                self.left = left;
                Poll::Ready(Some(Ok(frame)))
            }
            None => Poll::Ready(Some(Err(HttpError::new(HttpErrorKind::Decode, TooLong)))),
        }
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        // No memory is reserved for a length announced by a server.
        SizeHint::default()
    }
}

/// Error: an answer exceeds the limit.
#[derive(Debug)]
struct TooLong;

impl std::fmt::Display for TooLong {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("the answer is too long")
    }
}

impl std::error::Error for TooLong {}

#[cfg(test)]
mod tests {
    use super::*;

    /// A body of one-kilobyte chunks.
    struct Chunks(u64);

    impl Body for Chunks {
        type Data = Bytes;
        type Error = HttpError;

        fn poll_frame(mut self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<Option<Result<Frame<Bytes>, HttpError>>> {
            self.0 += 1;
            Poll::Ready((self.0 <= 100).then(|| Ok(Frame::data(Bytes::from(vec![0; 1024])))))
        }
    }

    /// Reads a body of a hundred kilobytes; returns the bytes passed on, and true if that was all.
    fn read(left: u64) -> (usize, bool) {
        let mut answer = Answer { body: Chunks(0), left };
        let mut cx = Context::from_waker(std::task::Waker::noop());
        let frames = std::iter::from_fn(|| match Pin::new(&mut answer).poll_frame(&mut cx) {
            Poll::Ready(frame) => frame,
            Poll::Pending => None,
        });
        let mut bytes = 0;
        for frame in frames {
            match frame {
                Ok(frame) => bytes += frame.data_ref().map_or(0, Bytes::len),
                Err(_) => return (bytes, false),
            }
        }
        (bytes, true)
    }

    #[test]
    fn stops_reading_at_limit() {
        assert_eq!(read(100 << 10), (100 << 10, true));
        assert_eq!(read((100 << 10) - 1), (99 << 10, false));
        assert_eq!(read(0), (0, false));
    }
}
