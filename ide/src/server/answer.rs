//! Form of the answers to requests.
use lsp_server::ErrorCode;
use serde::Serialize;
use serde_json::Value as Json;

/// Reason why a request has no answer: code and message.
pub(crate) struct Refusal(pub(crate) ErrorCode, pub(crate) String);

impl Refusal {
    /// A failure with a reason for the user.
    pub(crate) fn because(reason: impl Into<String>) -> Self {
        Self(ErrorCode::RequestFailed, reason.into())
    }
}

/// Answer to a request.
pub(crate) type Answer = Result<Json, Refusal>;

/// Answers with a value.
pub(crate) fn json(value: impl Serialize) -> Answer {
    serde_json::to_value(value).map_err(|error| Refusal(ErrorCode::InternalError, error.to_string()))
}
