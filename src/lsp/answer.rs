//! Form of the answers to requests.
use lsp_server::ErrorCode;
use serde_json::Value as Json;

/// Reason why a request has no answer: code and message.
pub(super) struct Refusal(pub(super) ErrorCode, pub(super) String);

impl Refusal {
    /// A failure with a reason for the user.
    pub(super) fn because(reason: impl Into<String>) -> Self {
        Self(ErrorCode::RequestFailed, reason.into())
    }
}

/// Answer to a request.
pub(super) type Answer = Result<Json, Refusal>;
