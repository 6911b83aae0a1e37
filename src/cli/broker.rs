//! Arguments of the commands that use a NATS server, and the output of what happens meanwhile.

use super::reporter::Reporter;
use crate::fleet::{Login, Notice, Server};
use std::io::Write;
use std::path::PathBuf;

/// A server, and the login.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct BrokerArguments {
    /// NATS server with JetStream: nats://HOST:PORT, or tls://HOST:PORT; several separated by commas
    #[arg(long, value_name = "URL", default_value = "nats://127.0.0.1:4222")]
    broker: String,
    /// User of the server
    #[arg(long, value_name = "NAME")]
    user: Option<String>,
    /// Password of the user; others on this machine can see it, unlike files of --nkey or --creds
    #[arg(long, value_name = "TEXT", requires = "user")]
    password: Option<String>,
    /// Token of the server
    #[arg(long, value_name = "TEXT")]
    token: Option<String>,
    /// File with the seed of an nkey
    #[arg(long, value_name = "FILE")]
    nkey: Option<PathBuf>,
    /// Credentials file
    #[arg(long, value_name = "FILE")]
    creds: Option<PathBuf>,
    /// Part of the subjects of replies after _INBOX, to which this login may listen [default: the user, if any]
    #[arg(long, value_name = "NAME")]
    inbox: Option<String>,
    /// Certificates of the authorities that the server's certificate may come from [default: the system's]
    #[arg(long, value_name = "FILE")]
    ca: Option<PathBuf>,
    /// Certificate of this client
    #[arg(long, value_name = "FILE", requires = "key")]
    cert: Option<PathBuf>,
    /// Key of the client's certificate
    #[arg(long, value_name = "FILE", requires = "cert")]
    key: Option<PathBuf>,
}

impl BrokerArguments {
    pub(super) fn server(&self) -> Server {
        let BrokerArguments { broker, user, password, token, nkey, creds, inbox, ca, cert, key } =
            self.clone();
        Server {
            url: broker,
            login: Login { user, password, token, nkey, creds, inbox, ca, certificate: cert.zip(key) },
        }
    }
}

/// The default folder for files of scenes.
pub(super) fn default_cache() -> PathBuf {
    let home = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let cache = home("XDG_CACHE_HOME").or_else(|| Some(home("HOME")?.join(".cache")));
    cache.or_else(|| home("LOCALAPPDATA")).unwrap_or_else(std::env::temp_dir).join("stride")
}

/// Prints what happens on standard error.
pub(super) struct Notices {
    reporter: Option<Reporter>,
    quiet: bool,
}

impl Notices {
    pub(super) fn new(quiet: bool) -> Notices {
        Notices { reporter: None, quiet }
    }

    pub(super) fn tell(&mut self, notice: Notice) {
        match notice {
            // Warnings are about the result.
            Notice::Line(line) if self.quiet && !line.starts_with("warning: ") => {}
            Notice::Line(line) => match &mut self.reporter {
                Some(reporter) => reporter.note(&line),
                // Standard error may be closed, which is no error.
                None => drop(writeln!(std::io::stderr(), "{line}")),
            },
            Notice::Progress(..) | Notice::Ended(_) if self.quiet => {}
            Notice::Progress(progress, workers) => {
                let count = if workers == 1 { "1 worker".to_owned() } else { format!("{workers} workers") };
                self.reporter.get_or_insert_with(Reporter::stderr).update_with(&progress, &count);
            }
            Notice::Ended(progress) => {
                self.reporter.take().unwrap_or_else(Reporter::stderr).finish(&progress);
            }
        }
    }
}
