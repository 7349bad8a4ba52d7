//! How a command ends when it fails.
use crate::terminal::Terminal;
use std::process::ExitCode;

/// Why a command ended early.
#[derive(Debug)]
pub(crate) enum Quit {
    /// Errors in the user's files, which have been shown.
    Shown,
    /// Something that could not be done.
    Failed(anyhow::Error),
    /// The arguments are wrong.
    Usage(String),
    /// The program that reads stdout has closed it.
    Closed,
}

impl Quit {
    /// A failure with a message.
    pub(crate) fn failed(message: impl Into<String>) -> Self {
        Self::Failed(anyhow::Error::msg(message.into()))
    }

    /// What went wrong, for those who read it elsewhere.
    pub(crate) fn text(&self) -> String {
        match self {
            Self::Shown | Self::Closed => "it could not be done".to_owned(),
            Self::Failed(error) => format!("{error:#}"),
            Self::Usage(message) => message.clone(),
        }
    }

    /// Prints what was not printed yet, and gives the exit code.
    pub(crate) fn code(&self, terminal: &Terminal) -> ExitCode {
        match self {
            Self::Shown | Self::Closed => ExitCode::FAILURE,
            Self::Failed(error) => {
                terminal.error(&format!("{error:#}"));
                ExitCode::FAILURE
            }
            Self::Usage(message) => {
                terminal.error(message);
                ExitCode::from(2)
            }
        }
    }
}

impl From<anyhow::Error> for Quit {
    fn from(error: anyhow::Error) -> Self {
        Self::Failed(error)
    }
}
