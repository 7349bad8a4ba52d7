//! Failure of a command.
use crate::terminal::Terminal;
use std::process::ExitCode;

/// Reason why a command failed.
#[derive(Debug)]
pub(crate) enum Quit {
    /// Errors in the user's files, already shown.
    Shown,
    /// An operation failed.
    Failed(anyhow::Error),
    /// The arguments are wrong.
    Usage(String),
    /// An operation failed that has codes below 129 for other results.
    Fatal(String),
    /// Ctrl-C; what could be written was written.
    Interrupted,
    /// The program that reads stdout has closed it.
    Closed,
}

impl Quit {
    /// A failure with a message.
    pub(crate) fn failed(message: impl Into<String>) -> Self {
        Self::Failed(anyhow::Error::msg(message.into()))
    }

    /// Message of the failure, for use elsewhere.
    pub(crate) fn text(&self) -> String {
        match self {
            Self::Shown | Self::Closed | Self::Interrupted => "it could not be done".to_owned(),
            Self::Failed(error) => format!("{error:#}"),
            Self::Usage(message) | Self::Fatal(message) => message.clone(),
        }
    }

    /// Prints messages not yet printed, and returns the exit code.
    pub(crate) fn code(&self, terminal: &Terminal) -> ExitCode {
        match self {
            Self::Shown | Self::Closed => ExitCode::FAILURE,
            Self::Interrupted => ExitCode::from(130),
            Self::Failed(error) => {
                terminal.error(&format!("{error:#}"));
                ExitCode::FAILURE
            }
            Self::Usage(message) => {
                terminal.error(message);
                ExitCode::from(2)
            }
            Self::Fatal(message) => {
                terminal.error(message);
                ExitCode::from(129)
            }
        }
    }
}

impl From<anyhow::Error> for Quit {
    fn from(error: anyhow::Error) -> Self {
        Self::Failed(error)
    }
}
