//! `shibo git`, and versions of files in a repository. The program `git` is started where a repository is asked for.
mod install;
mod revision;

pub(crate) use install::{GitArgs, run};
pub(crate) use revision::{Repository, Version, merge_lines, version};
