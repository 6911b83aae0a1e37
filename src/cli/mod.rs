//! The command line: one file per subcommand, each from arguments to an exit code.

mod advice;
mod arguments;
mod bench;
#[cfg(feature = "fleet")]
mod broker;
mod check;
mod compare;
mod contents;
mod convert;
mod develop;
mod devices;
mod events;
mod failure;
#[cfg(feature = "fleet")]
mod fleet;
mod info;
#[cfg(feature = "fleet")]
mod jobs;
mod loading;
mod merge;
mod print;
mod program;
mod reading;
mod render;
mod reporter;
mod split;
mod stats;
mod stop;
#[cfg(feature = "fleet")]
mod submit;
mod trace;
#[cfg(not(feature = "fleet"))]
mod without_fleet;
#[cfg(feature = "fleet")]
mod work;

use clap::{Parser, Subcommand};
use failure::Failure;
use std::io::Write;
use std::process::ExitCode;

/// A physically based path tracer with pictures that are identical to the bit for any number of threads.
#[derive(Debug, Parser)]
#[command(name = "stride", version, arg_required_else_help = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Render a scene to a window and to picture files
    Render(Box<render::RenderArguments>),
    /// Check a scene file for errors without rendering
    Check(check::CheckArguments),
    /// Write a scene file as TOML, with its meshes and pictures beside it
    Convert(convert::ConvertArguments),
    /// Trace one path again and describe it bounce by bounce
    Trace(trace::TraceArguments),
    /// Measure time against threads, time against depth, or error against samples
    Bench(bench::BenchArguments),
    /// Print the commands that render a scene in parts on many machines, and merge them
    Split(Box<split::SplitArguments>),
    /// Merge films of disjoint samples of one render, exactly
    Merge(merge::MergeArguments),
    /// Make a picture from dumped samples, with any filter
    Develop(develop::DevelopArguments),
    /// Measure the difference between two pictures
    Compare(compare::CompareArguments),
    /// Describe a film, a picture, a sample dump, a scene or a mesh, or list the devices
    Info(info::InfoArguments),
    /// Render a scene on many machines, over a NATS server
    #[cfg(feature = "fleet")]
    Submit(Box<submit::SubmitArguments>),
    /// Render for others: take work from a NATS server
    #[cfg(feature = "fleet")]
    Work(work::WorkArguments),
    /// List, watch, change and collect the jobs on a NATS server
    #[cfg(feature = "fleet")]
    Jobs(jobs::JobsArguments),
    /// Try rendering on many machines with workers on this one
    #[cfg(feature = "fleet")]
    Fleet(fleet::FleetArguments),
    /// Fail: these commands are in other builds
    #[cfg(not(feature = "fleet"))]
    #[command(name = "submit", aliases = ["work", "jobs", "fleet"], hide = true)]
    WithoutFleet(without_fleet::AnyArguments),
}

/// Runs the program: 0 done, 1 failed, 2 bad usage.
pub fn main() -> ExitCode {
    // clap itself exits with 2 on a parse error, and with 0 for --help and --version.
    let arguments = Arguments::try_parse().unwrap_or_else(|mut error| {
        advice::add(&mut error);
        error.exit()
    });
    let result = match arguments.command {
        Command::Render(arguments) => render::run(*arguments),
        Command::Check(arguments) => check::run(&arguments),
        Command::Convert(arguments) => convert::run(&arguments),
        Command::Trace(arguments) => trace::run(&arguments),
        Command::Bench(arguments) => bench::run(&arguments),
        Command::Split(arguments) => split::run(&arguments),
        Command::Merge(arguments) => merge::run(&arguments),
        Command::Develop(arguments) => develop::run(&arguments),
        Command::Compare(arguments) => compare::run(&arguments),
        Command::Info(arguments) => info::run(&arguments),
        #[cfg(feature = "fleet")]
        Command::Submit(arguments) => submit::run(&arguments),
        #[cfg(feature = "fleet")]
        Command::Work(arguments) => work::run(&arguments),
        #[cfg(feature = "fleet")]
        Command::Jobs(arguments) => jobs::run(&arguments),
        #[cfg(feature = "fleet")]
        Command::Fleet(arguments) => fleet::run(&arguments),
        #[cfg(not(feature = "fleet"))]
        Command::WithoutFleet(arguments) => without_fleet::run(&arguments),
    };
    let Err(failure) = result else { return ExitCode::SUCCESS };
    // Standard error may be closed: then only the exit code reports the error.
    let _ = writeln!(std::io::stderr(), "error: {}", failure.message());
    ExitCode::from(match failure {
        Failure::Failed(_) => 1,
        Failure::Usage(_) => 2,
    })
}
