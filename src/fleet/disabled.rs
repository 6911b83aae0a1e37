//! The room without the feature: the same functions, which say so.

use super::{Collecting, FleetError, JobSummary, LocalFleet, Notice, Server, Submission, WorkerSettings};
use crossbeam_channel::Receiver;
use std::convert::Infallible;
use std::ffi::{OsStr, OsString};

/// The channel that closes on a request to stop.
type Stop = Receiver<Infallible>;

/// Submits a job. Without the feature it fails.
pub fn submit(_: &Server, _: &Submission, _: &Stop, _: &mut dyn FnMut(Notice)) -> Result<String, FleetError> {
    Err(FleetError::NotBuilt)
}

/// Renders units of jobs. Without the feature it fails.
pub fn work(_: &Server, _: &WorkerSettings, _: &Stop, _: &mut dyn FnMut(Notice)) -> Result<(), FleetError> {
    Err(FleetError::NotBuilt)
}

/// Collects the results of a job. Without the feature it fails.
pub fn collect(
    _: &Server,
    _: &str,
    _: &Collecting,
    _: &Stop,
    _: &mut dyn FnMut(Notice),
) -> Result<(), FleetError> {
    Err(FleetError::NotBuilt)
}

/// Lists the jobs. Without the feature it fails.
pub fn list(_: &Server) -> Result<Vec<JobSummary>, FleetError> {
    Err(FleetError::NotBuilt)
}

/// Shows the progress of a job. Without the feature it fails.
pub fn watch(_: &Server, _: &str, _: &Stop, _: &mut dyn FnMut(Notice)) -> Result<(), FleetError> {
    Err(FleetError::NotBuilt)
}

/// Cancels a job. Without the feature it fails.
pub fn cancel(_: &Server, _: &str) -> Result<(), FleetError> {
    Err(FleetError::NotBuilt)
}

/// Changes the number of samples. Without the feature it fails.
pub fn extend(_: &Server, _: &str, _: u32) -> Result<(), FleetError> {
    Err(FleetError::NotBuilt)
}

/// Changes the priority. Without the feature it fails.
pub fn prioritise(_: &Server, _: &str, _: i32) -> Result<(), FleetError> {
    Err(FleetError::NotBuilt)
}

/// Starts a server and workers on this machine, and renders. Without the feature it fails.
pub fn local(_: &LocalFleet, _: &Stop, _: &mut dyn FnMut(Notice)) -> Result<(), FleetError> {
    Err(FleetError::NotBuilt)
}

/// Runs a program of a fleet on this machine. Without the feature it fails.
pub fn keep(_: &OsStr, _: &[OsString]) -> Result<(), FleetError> {
    Err(FleetError::NotBuilt)
}
