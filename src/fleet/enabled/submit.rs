//! Submits a job: sends the files of its scene, creates it, and collects it.

use super::broker::{Answer, Broker};
use super::collect::{OnStop, collect_job, with_outputs};
use super::job::{Job, JobDevice, facts, now, unique};
use super::mail::{JobMail, Mail, job_subject};
use super::plan::Plan;
use super::renderer::Renderer;
use super::scene_files::{load_with_files, manifest};
use super::unit::Unit;
use super::uploads::send;
use super::{Stop, Tell};
use crate::film::file::VERSION;
use crate::film::noise::FIRST_MILESTONE;
use crate::fleet::{FleetError, JobState, Notice, Server, Submission};

/// Bytes by which the message of a job may grow: units, barred workers and the lease.
const GROWTH: usize = 128 << 10;

/// Submits a job and, unless it is detached, collects it. Returns its id.
pub fn submit(
    server: &Server,
    submission: &Submission,
    stop: &Stop,
    tell: Tell<'_>,
) -> Result<String, FleetError> {
    submit_with(server, submission, OnStop::Leave, stop, tell)
}

pub(super) fn submit_with(
    server: &Server,
    submission: &Submission,
    on_stop: OnStop,
    stop: &Stop,
    tell: Tell<'_>,
) -> Result<String, FleetError> {
    let options = submission.settings.reading(submission.is_strict, submission.allow_outside);
    let (loaded, files) = load_with_files(&submission.scene, &options)?;
    for warning in &loaded.warnings {
        tell(Notice::Line(format!("warning: {warning}")));
    }
    if loaded.scene.render.adaptive {
        return Err(FleetError::Job(
            "adaptive sampling cannot be shared by machines: each pixel's number of samples depends on all others; remove adaptive from the scene, and use --noise".to_owned(),
        ));
    }
    let samples = loaded.scene.render.samples;
    let render = submission.settings.render(loaded)?.keep(&submission.scene);
    let mut job = Job {
        id: unique("j"),
        name: submission
            .scene
            .file_name()
            .map_or_else(String::new, |name| name.to_string_lossy().into_owned()),
        created: now(),
        scene: Default::default(),
        settings: submission.settings.clone(),
        facts: String::new(),
        film_format: VERSION,
        device: JobDevice::of(&submission.device),
        priority: submission.priority,
        state: JobState::Open,
        target: match (submission.spp, submission.noise) {
            (Some(spp), _) => spp,
            (None, Some(_)) => u32::MAX,
            (None, None) => samples,
        },
        noise: submission.noise,
        verify: submission.verify,
        patience: submission.patience.as_millis().clamp(1, u128::from(u64::MAX)) as u64,
        unit: submission.unit.as_millis().clamp(1, u128::from(u64::MAX)) as u64,
        plan: Plan::default(),
        held: 0,
        collector: None,
        barred: Vec::new(),
    };
    // Errors of settings and outputs come before anything is sent.
    let settings = with_outputs(render.clone(), &job, &submission.collecting).settings()?;
    job.facts = facts(&settings).to_string();
    let (scene, paths) = manifest(&submission.scene, &files)?;
    job.scene = scene;
    let broker = Broker::connect(server)?;
    let (bytes, most) = (job.to_bytes().len(), broker.message_bytes());
    // Small limits leave half of themselves.
    if bytes > most - GROWTH.min(most / 2) {
        return Err(FleetError::Server(format!(
            "the job has {bytes} bytes, most of them names of its {} files, and grows while it is rendered; the server accepts messages of {most} bytes: raise max_payload of the server",
            job.scene.files.len()
        )));
    }
    broker.create_streams()?;
    send(&broker, &job.scene, &paths, stop)?;
    if submission.is_detached {
        // There is no collector that could learn the speed of workers.
        let size = match job.device {
            JobDevice::Cpu => measured_size(Renderer::new(render.clone())?, &job, stop)?,
            JobDevice::Gpu(_) | JobDevice::All(_) => 1.max(job.target.min(1 << 16) / 256),
        };
        let limit = if job.noise.is_some() { job.target.min(FIRST_MILESTONE) } else { job.target };
        // Whoever stops in the middle leaves units that the collector issues again.
        job.plan.extend(limit, size.max(limit.div_ceil(1 << 19)));
    }
    let answer = broker.store(job_subject(&job.id)?, job.to_bytes(), Some(0))?;
    if answer == Answer::Conflict {
        return Err(FleetError::Job(format!("there is a job {} already; submit again", job.id)));
    }
    // A job that was removed at this moment may have had the same files.
    send(&broker, &job.scene, &paths, stop)?;
    broker.create_queue(&job)?;
    tell(Notice::Line(format!("job {} is on the server", job.id)));
    if submission.is_detached {
        let mail = JobMail { broker: &broker, id: &job.id };
        job.plan.units().try_for_each(|range| mail.issue(&Unit::new(&job.id, &range)))?;
        return Ok(job.id);
    }
    collect_job(&broker, &job, render, (&submission.collecting, on_stop), stop, tell)?;
    Ok(job.id)
}

/// The size of units that take the wanted time on a machine like this one.
fn measured_size(mut renderer: Renderer, job: &Job, stop: &Stop) -> Result<u32, FleetError> {
    // The first time includes compiling the scene.
    let mut took = 0.0;
    for _ in 0..2 {
        let film = renderer.render(&(0..1), stop, |_| ())?;
        let film = film.ok_or_else(|| FleetError::Job("stopped before the job was submitted".to_owned()))?;
        took = film.took.as_secs_f64().max(1e-6);
    }
    let size = (job.unit as f64 / 1000.0 / took) as u32;
    Ok(size.clamp(1, job.target.div_ceil(8).max(1)))
}
