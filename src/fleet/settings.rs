//! Servers, logins, jobs and workers as the caller states them.

use crate::output::Progress;
use crate::session::DeviceChoice;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::time::Duration;

/// A server, and the way to log in.
#[derive(Clone, Debug, Default)]
pub struct Server {
    /// `nats://HOST:PORT`, or `tls://HOST:PORT`; several are separated by commas.
    pub url: String,
    /// The login.
    pub login: Login,
}

/// The way to log in, as NATS knows it.
#[derive(Clone, Debug, Default)]
pub struct Login {
    /// The user's name.
    pub user: Option<String>,
    /// The password.
    pub password: Option<String>,
    /// A token.
    pub token: Option<String>,
    /// The file with the seed of an nkey.
    pub nkey: Option<PathBuf>,
    /// A credentials file.
    pub creds: Option<PathBuf>,
    /// The part of the subjects of replies after `_INBOX`, instead of the user's name.
    pub inbox: Option<String>,
    /// Certificates of authorities, instead of the system's.
    pub ca: Option<PathBuf>,
    /// The client's own certificate and its key.
    pub certificate: Option<(PathBuf, PathBuf)>,
}

/// Changes to the settings of a scene, and what of it is rendered. `None` leaves a setting to the scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct JobSettings {
    /// Names and values of the variables of a Mitsuba scene.
    pub defines: Vec<(String, String)>,
    /// The name of the camera.
    pub camera: Option<String>,
    /// Width and height of the film.
    pub size: Option<(u32, u32)>,
    /// The seed.
    pub seed: Option<u32>,
    /// The name of the integrator.
    pub integrator: Option<String>,
    /// The name of the sampler.
    pub sampler: Option<String>,
    /// The maximum number of bounces.
    pub max_depth: Option<u32>,
    /// The name of the filter.
    pub filter: Option<String>,
    /// The name of the film mode.
    pub film_mode: Option<String>,
    /// The exposure of PNG files in stops.
    pub exposure: Option<f64>,
    /// The tone curve of PNG files.
    pub tone: Option<String>,
    /// The part of the film.
    pub crop: Option<[u32; 4]>,
    /// The names of layers.
    pub layers: Vec<String>,
}

/// A job to submit.
#[derive(Clone, Debug)]
pub struct Submission {
    /// The scene file.
    pub scene: PathBuf,
    /// Changes to its settings.
    pub settings: JobSettings,
    /// Whether something in a scene file of another program that has no counterpart is an error.
    pub is_strict: bool,
    /// Whether a scene file of another program may name files outside of its folder.
    pub allow_outside: bool,
    /// Samples per pixel, instead of the scene's.
    pub spp: Option<u32>,
    /// The error at which the render ends.
    pub noise: Option<f64>,
    /// The devices that may render the job.
    pub device: DeviceChoice,
    /// Jobs of higher priority are rendered first.
    pub priority: i32,
    /// The share of units that two workers render, 0 to 1.
    pub verify: f64,
    /// The time after which the unit of a silent worker is given to another one.
    pub patience: Duration,
    /// The time that a unit should take.
    pub unit: Duration,
    /// Whether to return when the job is on the server.
    pub is_detached: bool,
    /// The outputs.
    pub collecting: Collecting,
}

/// What the collector writes.
#[derive(Clone, Debug)]
pub struct Collecting {
    /// Picture files.
    pub pictures: Vec<PathBuf>,
    /// The film file, which is also the checkpoint; otherwise one beside the first picture, which is removed at the end.
    pub film: Option<PathBuf>,
    /// The interval of checkpoints.
    pub checkpoint: Duration,
    /// The folder with files of scenes.
    pub cache: PathBuf,
}

/// A worker.
#[derive(Clone, Debug)]
pub struct WorkerSettings {
    /// Its name, which is unique among the workers of a server.
    pub name: Option<String>,
    /// CPU threads; by default one per core.
    pub threads: Option<usize>,
    /// The devices that it offers.
    pub device: DeviceChoice,
    /// The folder with files of scenes.
    pub cache: PathBuf,
    /// The most bytes of a job's files, and of the whole folder.
    pub cache_bytes: u64,
    /// The time within which a unit is finished when the worker is asked to end. Otherwise it is handed back.
    pub grace: Duration,
    /// Whether to end when no job is open.
    pub ends_when_idle: bool,
}

/// A server and workers on this machine.
#[derive(Clone, Debug)]
pub struct LocalFleet {
    /// The number of workers.
    pub workers: usize,
    /// The job.
    pub submission: Submission,
}

/// The state of a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum JobState {
    /// It is being rendered.
    Open,
    /// All samples have been collected.
    Done,
    /// It was cancelled.
    Cancelled,
}

impl std::fmt::Display for JobState {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            JobState::Open => "open",
            JobState::Done => "done",
            JobState::Cancelled => "cancelled",
        })
    }
}

/// A job in a list.
#[derive(Clone, Debug)]
pub struct JobSummary {
    /// Its id.
    pub id: String,
    /// The name of the scene file.
    pub name: String,
    /// The state.
    pub state: JobState,
    /// The priority.
    pub priority: i32,
    /// Samples per pixel in the collector's last checkpoint, and at the end.
    pub samples: [u32; 2],
    /// The error at which the render ends.
    pub noise: Option<f64>,
    /// The collector, if there is one.
    pub collector: Option<String>,
}

/// What happens meanwhile.
#[derive(Clone, Debug)]
pub enum Notice {
    /// A line for the user.
    Line(String),
    /// Progress of the whole fleet, and the number of workers.
    Progress(Progress, usize),
    /// The last progress of a job that is complete.
    Ended(Progress),
}
