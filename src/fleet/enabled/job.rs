//! Jobs as the server keeps them: one message per job, replaced by each change.

use super::notes::plain;
use super::plan::Plan;
use crate::api::Render;
use crate::film::file::VERSION;
use crate::film::{Identity, Layer};
use crate::fleet::{FleetError, JobSettings, JobState, JobSummary};
use crate::scene::{Choice, FilmMode, Filter, Integrator, LoadOptions, Loaded, Sampler, Tone};
use crate::session::{CPU, DeviceChoice, RenderSettings, film_head};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// The shortest time after which a silent worker is replaced: shorter ones would only cost messages.
const LEAST_PATIENCE: Duration = Duration::from_millis(100);

/// A job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Job {
    /// Letters and digits: part of subjects and file names.
    pub(super) id: String,
    /// The name of the scene file.
    pub(super) name: String,
    /// Seconds since 1970: of jobs of equal priority, the older one is rendered first.
    pub(super) created: u64,
    pub(super) scene: Manifest,
    pub(super) settings: JobSettings,
    /// The facts that determine the bits of samples, without the device.
    pub(super) facts: String,
    /// The version of the format of films.
    pub(super) film_format: u32,
    pub(super) device: JobDevice,
    pub(super) priority: i32,
    pub(super) state: JobState,
    /// Samples per pixel at the end.
    pub(super) target: u32,
    pub(super) noise: Option<f64>,
    /// The share of units that two workers render.
    pub(super) verify: f64,
    /// Milliseconds after which the unit of a silent worker is given to another one.
    pub(super) patience: u64,
    /// Milliseconds that a unit should take.
    pub(super) unit: u64,
    /// The units that have been issued.
    pub(super) plan: Plan,
    /// Samples per pixel in the collector's last checkpoint.
    pub(super) held: u32,
    pub(super) collector: Option<Lease>,
    /// Workers whose results are refused.
    pub(super) barred: Vec<String>,
}

/// The files of a scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Manifest {
    /// The place of the scene file among them.
    pub(super) scene: usize,
    pub(super) files: Vec<SceneFile>,
}

/// A file of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct SceneFile {
    /// Its path from the folder that contains all files of the scene, with `/` between the names.
    pub(super) path: String,
    /// The SHA-256 of its contents, in hexadecimal digits.
    pub(super) sha256: String,
    pub(super) bytes: u64,
}

/// The right to collect a job. Its owner renews it; another collector waits until it is no longer renewed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Lease {
    pub(super) owner: String,
    /// Counts renewals.
    pub(super) renewed: u64,
}

/// The devices whose samples a job has.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum JobDevice {
    Cpu,
    /// A GPU whose name contains this.
    Gpu(Option<String>),
    All(Option<String>),
}

impl JobDevice {
    pub(super) fn of(choice: &DeviceChoice) -> JobDevice {
        match choice.clone() {
            DeviceChoice::Cpu => JobDevice::Cpu,
            DeviceChoice::Gpu(name) => JobDevice::Gpu(name),
            DeviceChoice::All(name) => JobDevice::All(name),
        }
    }

    pub(super) fn choice(&self) -> DeviceChoice {
        match self.clone() {
            JobDevice::Cpu => DeviceChoice::Cpu,
            JobDevice::Gpu(name) => DeviceChoice::Gpu(name),
            JobDevice::All(name) => DeviceChoice::All(name),
        }
    }

    /// Whether films of a device, by its description in their headers, belong to the job.
    pub(super) fn allows(&self, description: &str) -> bool {
        let (start, name) = match self {
            JobDevice::Cpu => return description == CPU,
            JobDevice::Gpu(name) => ("gpu: ", name),
            JobDevice::All(name) => ("all: ", name),
        };
        let name = name.as_deref().unwrap_or_default().to_lowercase();
        description.starts_with(start) && description.to_lowercase().contains(&name)
    }

    /// Whether a worker that offers these devices renders the job.
    pub(super) fn is_offered_by(&self, offer: &DeviceChoice) -> bool {
        match (self, offer) {
            (_, DeviceChoice::All(_)) => true,
            (JobDevice::Cpu, DeviceChoice::Cpu) | (JobDevice::Gpu(_), DeviceChoice::Gpu(_)) => true,
            (JobDevice::Cpu, DeviceChoice::Gpu(_)) => false,
            (JobDevice::Gpu(_) | JobDevice::All(_), _) => false,
        }
    }
}

impl Job {
    pub(super) fn patience(&self) -> Duration {
        Duration::from_millis(self.patience).max(LEAST_PATIENCE)
    }

    /// Fails if this program makes other samples than the job has, and says which fact differs.
    pub(super) fn check(&self, settings: &RenderSettings) -> Result<(), FleetError> {
        let ours = facts(settings);
        let theirs = Identity::parse(&self.facts)
            .ok_or_else(|| FleetError::Refused(format!("job {}: its facts are malformed", self.id)))?;
        if let Some(difference) = ours.difference(&theirs) {
            return Err(FleetError::Refused(format!(
                "job {} belongs to another render than this machine would make: {difference}",
                self.id
            )));
        }
        if self.film_format != VERSION {
            return Err(FleetError::Refused(format!(
                "job {} has films of version {}, and this program writes version {VERSION}",
                self.id, self.film_format
            )));
        }
        Ok(())
    }

    pub(super) fn summary(&self) -> JobSummary {
        JobSummary {
            id: self.id.clone(),
            name: plain(&self.name),
            state: self.state,
            priority: self.priority,
            samples: [self.held, self.target],
            noise: self.noise,
            collector: self.collector.as_ref().map(|lease| lease.owner.clone()),
        }
    }

    /// Checks what is used in subjects and paths: the message may come from anyone who can submit.
    pub(super) fn parse(text: &[u8]) -> Result<Job, FleetError> {
        let malformed =
            |why: String| FleetError::Refused(plain(&format!("a job on the server is malformed: {why}")));
        let job: Job = serde_json::from_slice(text).map_err(|error| malformed(error.to_string()))?;
        let is_id =
            !job.id.is_empty() && job.id.len() <= 32 && job.id.bytes().all(|b| b.is_ascii_alphanumeric());
        if !is_id {
            return Err(malformed("its id is not one".to_owned()));
        }
        if job.target == 0 || job.patience == 0 || !(0.0..=1.0).contains(&job.verify) || !job.plan.is_sound()
        {
            return Err(malformed("its numbers are out of range".to_owned()));
        }
        Ok(job)
    }

    /// Whether a collector has the lease.
    pub(super) fn is_collected_by(&self, owner: &str) -> bool {
        self.collector.as_ref().is_some_and(|lease| lease.owner == owner)
    }

    pub(super) fn to_bytes(&self) -> Vec<u8> {
        // Plain data: it cannot fail.
        serde_json::to_vec(self).unwrap_or_default()
    }
}

impl JobSettings {
    /// What the reader of the scene is told.
    pub(super) fn reading(&self, is_strict: bool, allow_outside: bool) -> LoadOptions {
        LoadOptions {
            defines: self.defines.clone(),
            camera: self.camera.clone(),
            strict: is_strict,
            allow_outside,
        }
    }

    /// The render of a scene with these settings.
    pub(super) fn render(&self, loaded: Loaded) -> Result<Render, FleetError> {
        let layer = |name: &String| {
            let found = Layer::ALL.into_iter().find(|layer| layer.name() == name);
            found.ok_or_else(|| FleetError::Job(format!("there is no layer {name:?}")))
        };
        let layers = self.layers.iter().map(layer).collect::<Result<Vec<_>, _>>()?;
        // The scene's own crop is one of its own size.
        let crop = self.crop.or(loaded.crop.filter(|_| self.size.is_none()));
        Ok(Render::new(&loaded.scene)
            .sources(loaded.sources)
            .size(self.size)
            .seed(self.seed)
            .integrator(choice::<Integrator>(self.integrator.as_deref())?)
            .sampler(choice::<Sampler>(self.sampler.as_deref())?)
            .max_depth(self.max_depth)
            .filter(choice::<Filter>(self.filter.as_deref())?)
            .film_mode(choice::<FilmMode>(self.film_mode.as_deref())?)
            .exposure(self.exposure)
            .tone(choice::<Tone>(self.tone.as_deref())?)
            .crop(crop)
            .layers(layers))
    }
}

fn choice<C: Choice>(name: Option<&str>) -> Result<Option<C>, FleetError> {
    name.map(C::of_name).transpose().map_err(FleetError::Job)
}

/// The facts that determine the bits of samples, without the device, of which the job says the kind.
pub(super) fn facts(settings: &RenderSettings) -> Identity {
    let identity = film_head(settings, "").identity;
    let facts = identity.facts().filter(|(name, _)| *name != "device");
    facts.fold(Identity::default(), |all, (name, value)| match super::hooks::other_program(name) {
        Some(other) => all.with(name, other),
        None => all.with(name, value),
    })
}

/// Seconds since 1970.
pub(super) fn now() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs())
}

/// A name that no other process chooses: letters and digits.
pub(super) fn unique(start: &str) -> String {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let seed = format!("{} {} {start}", now.as_nanos(), std::process::id());
    format!("{start}{}", &data_encoding::HEXLOWER.encode(&Sha256::digest(seed))[..10])
}

/// The name of this machine, in characters that subjects allow.
pub(super) fn machine() -> String {
    let name = std::fs::read_to_string("/proc/sys/kernel/hostname")
        .ok()
        .or_else(|| std::env::var("HOSTNAME").or_else(|_| std::env::var("COMPUTERNAME")).ok())
        .unwrap_or_else(|| "machine".to_owned());
    token(name.trim())
}

/// A text as one token of a subject.
pub(super) fn token(text: &str) -> String {
    let allowed = |c: char| if c.is_ascii_alphanumeric() || c == '-' || c == '_' { c } else { '-' };
    text.chars().take(64).map(allowed).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn devices_match_offers() {
        let (cpu, gpu, all) = (DeviceChoice::Cpu, DeviceChoice::Gpu(None), DeviceChoice::All(None));
        let offered = |device: JobDevice| [&cpu, &gpu, &all].map(|offer| device.is_offered_by(offer));
        assert_eq!(offered(JobDevice::Cpu), [true, false, true]);
        assert_eq!(offered(JobDevice::Gpu(Some("x".into()))), [false, true, true]);
        assert_eq!(offered(JobDevice::All(None)), [false, false, true]);
        let allowed = |device: JobDevice| {
            ["cpu", "gpu: Card X", "all: cpu and Card X"].map(|description| device.allows(description))
        };
        assert_eq!(allowed(JobDevice::Cpu), [true, false, false]);
        assert_eq!(allowed(JobDevice::Gpu(Some("card".into()))), [false, true, false]);
        assert_eq!(allowed(JobDevice::Gpu(Some("other".into()))), [false; 3]);
        assert_eq!(allowed(JobDevice::All(None)), [false, false, true]);
    }

    #[test]
    fn names_are_tokens() {
        assert_eq!(token("a.b c>*/ü"), "a-b-c----");
        assert!(unique("j").bytes().all(|b| b.is_ascii_alphanumeric()));
    }
}
