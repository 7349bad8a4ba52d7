//! Starts `shibo lsp` in Zed, with the program on the search path.
use zed_extension_api::{self as zed, Command, LanguageServerId, Result, Worktree};

struct Shibo;

impl zed::Extension for Shibo {
    fn new() -> Self {
        Self
    }

    fn language_server_command(&mut self, _id: &LanguageServerId, worktree: &Worktree) -> Result<Command> {
        let program = worktree.which("shibo").ok_or("`shibo` is not on the search path")?;
        Ok(Command { command: program, args: vec!["lsp".to_owned()], env: worktree.shell_env() })
    }
}

zed::register_extension!(Shibo);
