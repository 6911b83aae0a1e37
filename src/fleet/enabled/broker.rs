//! The server: streams, messages and acknowledgements.
//!
//! This is the only file with asynchronous code. Its functions wait, so that collector and worker are plain processes.
//!
//! | stream | subjects | kept until |
//! |---|---|---|
//! | `STRIDE_FILES` | `stride.file.HASH.UPLOAD.PART`, `stride.file.HASH.link` | no job names the file |
//! | `STRIDE_JOBS` | `stride.job.JOB`: one message per job | `jobs remove` |
//! | `STRIDE_UNITS` | `stride.unit.JOB.FIRST.END.CHECK`: a work queue | acknowledged |
//! | `STRIDE_RESULTS` | `stride.part.JOB.FIRST.END.NONCE.PART`, `stride.done.JOB.FIRST.END.NONCE` | the film with it is on the collector's disk |
//!
//! `docs/fleet.md` states the oldest version of servers: newer features are not used.

use super::job::Job;
use super::login;
use super::unit::Unit;
use crate::fleet::{FleetError, Server};
use async_nats::Client;
use async_nats::jetstream::consumer::{AckPolicy, Consumer, pull};
use async_nats::jetstream::context::PublishErrorKind;
use async_nats::jetstream::message::PublishMessage;
use async_nats::jetstream::response::Response;
use async_nats::jetstream::stream::{
    Config, DirectGetErrorKind, DiscardPolicy, RetentionPolicy, StorageType,
};
use async_nats::jetstream::{self, AckKind, Context};
use crossbeam_channel::{Receiver, bounded};
use futures_util::StreamExt;
use serde::Serialize;
use std::collections::BTreeSet;
use std::fmt::Display;
use std::future::Future;
use std::time::Duration;
use tokio::runtime::{Builder, Runtime};
use tokio::sync::watch;

/// The streams.
pub(super) const FILES: &str = "STRIDE_FILES";
pub(super) const JOBS: &str = "STRIDE_JOBS";
pub(super) const UNITS: &str = "STRIDE_UNITS";
pub(super) const RESULTS: &str = "STRIDE_RESULTS";

/// The time limit of a request. A connection that is lost ends requests at once.
const LIMIT: Duration = Duration::from_secs(15);

/// The most bytes of a part. Servers accept messages of 1 MiB by default.
const MOST_PART: usize = 512 << 10;

/// The most bytes of results on a server, and the least: it gets the first half, quarter and so on of the most for which
/// its store has room. Stores are often powers of two: three quarters leave room for files and jobs.
const MOST_RESULTS: i64 = 48 << 30;
const LEAST_RESULTS: i64 = 48 << 10;

/// Bytes of a message beside its payload.
const OVERHEAD: usize = 4 << 10;

/// The longest message that is heard and not stored, in bytes.
const LONGEST_HEARD: usize = 64 << 10;

/// Units in the hands of workers at a time.
const MOST_IN_HAND: i64 = 100_000;

/// A connection to a server.
pub(super) struct Broker {
    client: Client,
    context: Context,
    /// Errors that the server has sent.
    refusals: Receiver<String>,
    /// Changes when the connection is lost or a request is not permitted: answers to requests before that do not come.
    losses: watch::Receiver<u64>,
    /// Dropped last: the others may need it for that.
    runtime: Runtime,
}

/// A stored message.
pub(super) struct Stored {
    pub(super) sequence: u64,
    pub(super) subject: String,
    pub(super) payload: Vec<u8>,
}

/// The answer to a message that is to be stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Answer {
    /// It has this number.
    Stored(u64),
    /// Another message has been stored on its subject since.
    Conflict,
    /// Its subject has a message, which is kept.
    Exists,
}

/// The queue of a job's units.
pub(super) struct Queue(Consumer<pull::Config>);

/// A unit from a queue, to be acknowledged.
pub(super) struct Delivery {
    pub(super) unit: Unit,
    message: jetstream::Message,
}

fn unreachable(error: impl Display) -> FleetError {
    FleetError::Unreachable(error.to_string())
}

impl Broker {
    /// Connects, and checks that the server keeps messages.
    pub(super) fn connect(server: &Server) -> Result<Broker, FleetError> {
        let runtime = Builder::new_multi_thread()
            .worker_threads(1)
            .enable_all()
            .build()
            .map_err(|error| FleetError::Server(format!("threads cannot be started: {error}")))?;
        let (refusals_out, refusals) = bounded(16);
        let (losses_out, losses) = watch::channel(0);
        let client = login::connect(&runtime, server, refusals_out, losses_out)?;
        // The context starts a task.
        let entered = runtime.enter();
        let mut context = jetstream::new(client.clone());
        context.set_timeout(LIMIT);
        drop(entered);
        let broker = Broker { client, context, refusals, losses, runtime };
        // A server without JetStream is found before anything is sent.
        match broker.last_number(JOBS) {
            Err(error) if is_without_store(&error.to_string()) => Err(without_store()),
            other => other.map(|_| broker),
        }
    }

    /// Waits for a request, for a limited time.
    fn wait<T, E: Display>(&self, request: impl Future<Output = Result<T, E>>) -> Result<T, FleetError> {
        match self.wait_for(request) {
            Ok(result) => result.map_err(|error| self.failed(error)),
            Err(error) => Err(error),
        }
    }

    /// The same, with the request's own error.
    fn wait_for<T>(&self, request: impl Future<Output = T>) -> Result<T, FleetError> {
        let mut losses = self.losses.clone();
        losses.mark_unchanged();
        let answer = self.runtime.block_on(async {
            tokio::select! {
                answer = request => Ok(answer),
                _ = losses.changed() => Err("the connection was lost"),
                () = tokio::time::sleep(LIMIT) => Err("no answer"),
            }
        });
        answer.map_err(|why| self.failed(why))
    }

    /// The error of a request: a permission that is missing is reported as such.
    fn failed(&self, error: impl Display) -> FleetError {
        match self.refusals.try_iter().find(|refusal| refusal.to_lowercase().contains("permission")) {
            Some(refusal) => FleetError::Server(format!("this login may not do that: {refusal}")),
            None => unreachable(error),
        }
    }

    /// Creates the streams that do not exist.
    pub(super) fn create_streams(&self) -> Result<(), FleetError> {
        let kept = |name: &str, subjects: &[&str]| Config {
            name: name.to_owned(),
            subjects: subjects.iter().map(|&subject| subject.to_owned()).collect(),
            max_messages_per_subject: 1,
            discard: DiscardPolicy::New,
            storage: StorageType::File,
            num_replicas: 1,
            allow_direct: true,
            ..Config::default()
        };
        let once = |config: Config| Config { discard_new_per_subject: true, ..config };
        let streams = [
            once(kept(FILES, &["stride.file.>"])),
            Config { discard: DiscardPolicy::Old, ..kept(JOBS, &["stride.job.*"]) },
            once(Config { retention: RetentionPolicy::WorkQueue, ..kept(UNITS, &["stride.unit.>"]) }),
            // Limited, so that results never leave no room for the messages by which they are collected.
            Config { max_bytes: MOST_RESULTS, ..once(kept(RESULTS, &["stride.part.>", "stride.done.>"])) },
        ];
        for mut config in streams {
            loop {
                let failed = match self.wait_for(self.context.get_or_create_stream(config.clone()))? {
                    Ok(stream) if has_subjects(&stream.cached_info().config, &config) => break,
                    // Otherwise messages would get no answer, which looks like a lost connection.
                    Ok(_) => return Err(earlier_version(&config.name)),
                    Err(error) => error.to_string(),
                };
                // The store has less room than that.
                if failed.contains("insufficient") && config.max_bytes > LEAST_RESULTS {
                    config.max_bytes /= 2;
                    continue;
                }
                return Err(self.not_created(&config.name, &failed));
            }
        }
        Ok(())
    }

    fn not_created(&self, name: &str, why: &str) -> FleetError {
        if is_without_store(why) {
            return without_store();
        }
        match self.failed(why) {
            FleetError::Unreachable(_) => {
                FleetError::Server(format!("the stream {name} cannot be created: {why}"))
            }
            other => other,
        }
    }

    /// The most bytes of a part of a file or a result.
    pub(super) fn part_bytes(&self) -> usize {
        self.client.max_payload().saturating_sub(OVERHEAD).clamp(1, MOST_PART)
    }

    /// The most bytes of a message.
    pub(super) fn message_bytes(&self) -> usize {
        self.client.max_payload()
    }

    /// Stores a message. If `expected` is given, the last message on the subject must have this number; 0 is none.
    pub(super) fn store(
        &self,
        subject: String,
        payload: Vec<u8>,
        expected: Option<u64>,
    ) -> Result<Answer, FleetError> {
        let mut message = PublishMessage::build().payload(payload.into());
        if let Some(expected) = expected {
            message = message.expected_last_subject_sequence(expected);
        }
        let stored = self.wait_for(async {
            let sent = self.context.send_publish(subject.clone(), message).await?;
            sent.await
        })?;
        let error = match stored {
            Ok(stored) => return Ok(Answer::Stored(stored.sequence)),
            Err(error) => error,
        };
        let text = error.to_string();
        match error.kind() {
            PublishErrorKind::WrongLastSequence => Ok(Answer::Conflict),
            PublishErrorKind::MaxPayloadExceeded => Err(FleetError::Server(format!(
                "a message is larger than the server accepts: raise max_payload ({text})"
            ))),
            _ if text.contains("maximum messages per subject") => Ok(Answer::Exists),
            _ if text.contains("maximum")
                || text.contains("insufficient")
                || text.contains("resource limit") =>
            {
                Err(FleetError::Full(text))
            }
            _ => Err(self.failed(text)),
        }
    }

    /// The first message after the one with the number `after` whose subject matches.
    pub(super) fn next(&self, stream: &str, after: u64, filter: &str) -> Result<Option<Stored>, FleetError> {
        self.get(stream, |get| get.sequence(after + 1).next_by_subject(filter))
    }

    /// The last message on a subject.
    pub(super) fn last(&self, stream: &str, subject: &str) -> Result<Option<Stored>, FleetError> {
        self.get(stream, |get| get.last_by_subject(subject))
    }

    fn get(
        &self,
        stream: &str,
        which: impl FnOnce(
            async_nats::jetstream::stream::DirectGetBuilder,
        ) -> async_nats::jetstream::stream::DirectGetBuilder,
    ) -> Result<Option<Stored>, FleetError> {
        let message = self.wait_for(async {
            let stream = self.context.get_stream_no_info(stream).await.map_err(|error| error.to_string())?;
            match which(stream.direct_get_builder()).send().await {
                Ok(message) => Ok(Some(message)),
                Err(error) if error.kind() == DirectGetErrorKind::NotFound => Ok(None),
                Err(error) => Err(error.to_string()),
            }
        })?;
        let message = message.map_err(|error| self.failed(error))?;
        Ok(message.map(|message| Stored {
            sequence: message.sequence,
            subject: message.subject.to_string(),
            payload: message.payload.to_vec(),
        }))
    }

    /// The number of the last message of a stream, if it exists.
    pub(super) fn last_number(&self, stream: &str) -> Result<Option<u64>, FleetError> {
        match self.wait_for(self.context.get_stream(stream))? {
            Ok(stream) => Ok(Some(stream.cached_info().state.last_sequence)),
            Err(error) if error.to_string().contains("not found") => Ok(None),
            Err(error) => Err(self.failed(error)),
        }
    }

    /// The bytes of a stream, and the most that it may have.
    pub(super) fn room(&self, stream: &str) -> Result<[u64; 2], FleetError> {
        let stream = self.wait(self.context.get_stream(stream))?;
        let info = stream.cached_info();
        let most = u64::try_from(info.config.max_bytes).unwrap_or(u64::MAX);
        Ok([info.state.bytes, most])
    }

    /// The subjects of a stream's messages that match.
    pub(super) fn subjects(&self, stream: &str, filter: &str) -> Result<Vec<String>, FleetError> {
        self.wait(async {
            let stream = self.context.get_stream_no_info(stream).await.map_err(|error| error.to_string())?;
            let info = stream.info_with_subjects(filter).await.map_err(|error| error.to_string())?;
            let subjects = info.map(|subject| subject.map(|(subject, _)| subject));
            subjects
                .collect::<Vec<_>>()
                .await
                .into_iter()
                .collect::<Result<_, _>>()
                .map_err(|error: async_nats::jetstream::stream::InfoError| error.to_string())
        })
    }

    /// Removes a message. It is no error if it is not there.
    ///
    /// The oldest servers do not give the room of messages back that are removed by their subjects, and may leave some.
    pub(super) fn remove(&self, stream: &str, number: u64) -> Result<(), FleetError> {
        #[derive(Serialize)]
        struct Request {
            seq: u64,
            no_erase: bool,
        }
        let request = Request { seq: number, no_erase: true };
        let subject = format!("STREAM.MSG.DELETE.{stream}");
        let response: Response<serde_json::Value> = self.wait(self.context.request(subject, &request))?;
        match response {
            Response::Ok(_) => Ok(()),
            Response::Err { error } => match error.to_string() {
                // Two texts: for a number that has been, and for one that has not.
                why if why.contains("not found") || why.contains("no message found") => Ok(()),
                why => Err(self.failed(why)),
            },
        }
    }

    /// Removes the messages whose subjects match, one by one.
    pub(super) fn remove_all(&self, stream: &str, filter: &str) -> Result<(), FleetError> {
        let mut after = 0;
        while let Some(stored) = self.next(stream, after, filter)? {
            self.remove(stream, stored.sequence)?;
            after = stored.sequence;
        }
        Ok(())
    }

    /// Creates the queue of a job's units.
    pub(super) fn create_queue(&self, job: &Job) -> Result<(), FleetError> {
        let config = pull::Config {
            durable_name: Some(queue_name(&job.id)),
            ack_policy: AckPolicy::Explicit,
            ack_wait: job.patience(),
            max_deliver: -1,
            max_ack_pending: MOST_IN_HAND,
            filter_subject: format!("stride.unit.{}.>", job.id),
            ..pull::Config::default()
        };
        self.wait(self.context.create_consumer_on_stream(config, UNITS)).map(drop)
    }

    /// Removes the queue of a job with its units.
    pub(super) fn delete_queue(&self, job: &str) -> Result<(), FleetError> {
        self.remove_all(UNITS, &format!("stride.unit.{job}.>"))?;
        match self.wait_for(self.context.delete_consumer_from_stream(queue_name(job), UNITS))? {
            Ok(_) => Ok(()),
            Err(error) if error.to_string().contains("not found") => Ok(()),
            Err(error) => Err(self.failed(error)),
        }
    }

    /// The queue of a job, if it exists.
    pub(super) fn queue(&self, job: &str) -> Result<Option<Queue>, FleetError> {
        match self.wait_for(self.context.get_consumer_from_stream(queue_name(job), UNITS))? {
            Ok(consumer) => Ok(Some(Queue(consumer))),
            Err(error) if error.to_string().contains("not found") => Ok(None),
            Err(error) => Err(self.failed(error)),
        }
    }

    /// The number of units of a job that wait in the queue, and of those in the hands of workers, if there is a queue.
    pub(super) fn queued(&self, job: &str) -> Result<Option<[u64; 2]>, FleetError> {
        let counts = |queue: Queue| {
            let info = queue.0.cached_info();
            [info.num_pending, info.num_ack_pending as u64]
        };
        Ok(self.queue(job)?.map(counts))
    }

    /// A unit from a queue, if one waits; an error in its place if it is malformed, and thus removed.
    pub(super) fn take(&self, queue: &Queue) -> Result<Option<Result<Delivery, FleetError>>, FleetError> {
        let taken = self.wait(async {
            let mut batch =
                queue.0.fetch().max_messages(1).messages().await.map_err(|error| error.to_string())?;
            batch.next().await.transpose().map_err(|error| error.to_string())
        })?;
        let Some(message) = taken else { return Ok(None) };
        match Unit::parse(&message.payload) {
            Ok(unit) => Ok(Some(Ok(Delivery { unit, message }))),
            Err(error) => {
                // It would be delivered forever.
                self.wait(message.ack_with(AckKind::Term))?;
                Ok(Some(Err(error)))
            }
        }
    }

    /// Tells the server that the unit is being rendered.
    pub(super) fn keep(&self, delivery: &Delivery) -> Result<(), FleetError> {
        self.wait(delivery.message.ack_with(AckKind::Progress))
    }

    /// Acknowledges a unit, and waits until the server knows.
    pub(super) fn acknowledge(&self, delivery: &Delivery) -> Result<(), FleetError> {
        self.wait(delivery.message.double_ack())
    }

    /// Hands a unit back, to be delivered after a pause.
    pub(super) fn hand_back(&self, delivery: &Delivery, pause: Duration) -> Result<(), FleetError> {
        let pause = (!pause.is_zero()).then_some(pause);
        self.wait(delivery.message.ack_with(AckKind::Nak(pause)))?;
        self.wait(self.client.flush())
    }

    /// Sends a message to those who listen now.
    pub(super) fn say(&self, subject: String, text: Vec<u8>) -> Result<(), FleetError> {
        self.wait(self.client.publish(subject, text.into()))
    }

    /// Receives messages on a subject from now on. If they are not received, later ones are dropped.
    pub(super) fn listen(&self, subject: String) -> Result<Receiver<Vec<u8>>, FleetError> {
        let mut messages = self.wait(self.client.subscribe(subject))?;
        let (heard_out, heard) = bounded(256);
        self.runtime.spawn(async move {
            while let Some(message) = messages.next().await {
                // Anyone may send them.
                if message.payload.len() > LONGEST_HEARD {
                    continue;
                }
                let heard = heard_out.try_send(message.payload.to_vec());
                if matches!(heard, Err(crossbeam_channel::TrySendError::Disconnected(_))) {
                    break;
                }
            }
        });
        Ok(heard)
    }
}

/// Whether a stream that was found has the wanted subjects, in any order.
fn has_subjects(found: &Config, wanted: &Config) -> bool {
    let sorted = |config: &Config| config.subjects.iter().cloned().collect::<BTreeSet<String>>();
    sorted(found) == sorted(wanted)
}

fn earlier_version(name: &str) -> FleetError {
    let what = if name == FILES { "files" } else { "messages" };
    FleetError::Server(format!("the server has {what} of an earlier version; remove the stream {name}"))
}

fn is_without_store(why: &str) -> bool {
    ["no responders", "not enabled", "resource does not exist"].iter().any(|&words| why.contains(words))
}

fn without_store() -> FleetError {
    FleetError::Server("the server keeps no messages: start it with JetStream (nats-server -js)".to_owned())
}

fn queue_name(job: &str) -> String {
    format!("units-{job}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_of_an_earlier_version_are_told_by_their_subjects() {
        let of = |subjects: &[&str]| Config {
            subjects: subjects.iter().map(|&subject| subject.to_owned()).collect(),
            ..Config::default()
        };
        assert!(has_subjects(&of(&["stride.b.>", "stride.a.>"]), &of(&["stride.a.>", "stride.b.>"])));
        assert!(!has_subjects(&of(&["stride.file.*.*"]), &of(&["stride.file.>"])));
        let error = earlier_version(FILES).to_string();
        assert_eq!(error, "the server has files of an earlier version; remove the stream STRIDE_FILES");
    }
}
