//! The commands for many machines in builds without them: an error with a remedy.

use super::failure::Failure;
use std::ffi::OsString;

#[derive(Debug, clap::Args)]
#[command(disable_help_flag = true)]
pub(super) struct AnyArguments {
    /// Whatever is given
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<OsString>,
}

pub(super) fn run(arguments: &AnyArguments) -> Result<(), Failure> {
    let _ = &arguments.arguments;
    let message = "this stride was built without support for fleets: build it with --features fleet";
    Err(anyhow::anyhow!(message).into())
}
