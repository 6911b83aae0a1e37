//! Connections to a server: the login, TLS, and errors with a remedy.

use super::job::token;
use crate::fleet::{FleetError, Login, Server};
use async_nats::{Client, ConnectError, ConnectErrorKind, ConnectOptions};
use crossbeam_channel::Sender;
use std::panic::AssertUnwindSafe;
use std::path::Path;
use std::time::Duration;
use tokio::runtime::Runtime;
use tokio::sync::watch;

/// The time limit of a connection.
const CONNECT: Duration = Duration::from_secs(15);

/// The longest pause before a lost server is tried again.
const LONGEST_PAUSE: Duration = Duration::from_secs(2);

/// Connects. Errors that the server sends later are sent to `refusals`; they are not kept if nobody receives them.
/// `losses` counts these errors and the times that the connection is lost: requests before that have no answer.
pub(super) fn connect(
    runtime: &Runtime,
    server: &Server,
    refusals: Sender<String>,
    losses: watch::Sender<u64>,
) -> Result<Client, FleetError> {
    let Server { url, login } = server;
    let wants_tls = url.contains("tls://") || login.ca.is_some() || login.certificate.is_some();
    let has_tls = prepare_tls();
    if wants_tls && !has_tls {
        return Err(FleetError::Server(without_tls().to_owned()));
    }
    let options = options(login)?
        .custom_inbox_prefix(inbox(login))
        .name(format!("stride {}", env!("CARGO_PKG_VERSION")))
        .connection_timeout(CONNECT)
        .request_timeout(Some(CONNECT))
        .max_reconnects(None)
        .reconnect_delay_callback(|attempt| {
            LONGEST_PAUSE.min(Duration::from_millis(50).saturating_mul(attempt.min(100) as u32))
        })
        .event_callback(move |event| {
            match &event {
                async_nats::Event::ServerError(error) => {
                    // Only the first errors are of interest. A request that is not permitted has no answer.
                    let _ = refusals.try_send(error.to_string());
                    losses.send_modify(|count| *count += 1);
                }
                async_nats::Event::Disconnected => losses.send_modify(|count| *count += 1),
                _ => {}
            }
            std::future::ready(())
        });
    let addresses: Vec<String> = url.split(',').map(|url| url.trim().to_owned()).collect();
    let connect = || runtime.block_on(async { options.connect(addresses).await });
    let connected = match has_tls {
        true => connect(),
        // A server that requires TLS would end the connection with a panic.
        false => std::panic::catch_unwind(AssertUnwindSafe(connect))
            .map_err(|_| FleetError::Server(without_tls().to_owned()))?,
    };
    connected.map_err(|error| describe(&error, url))
}

/// The start of the subjects of replies: users can only be kept from the replies to others if theirs differ.
fn inbox(login: &Login) -> String {
    let name = login.inbox.as_deref().or(login.user.as_deref());
    name.map_or_else(|| "_INBOX".to_owned(), |name| format!("_INBOX.{}", token(name)))
}

fn options(login: &Login) -> Result<ConnectOptions, FleetError> {
    let mut options = ConnectOptions::new();
    if let Some(user) = &login.user {
        options = options.user_and_password(user.clone(), login.password.clone().unwrap_or_default());
    } else if login.password.is_some() {
        return Err(FleetError::Server("a password needs a user: add --user NAME".to_owned()));
    }
    if let Some(token) = &login.token {
        options = options.token(token.clone());
    }
    if let Some(path) = &login.nkey {
        options = options.nkey(seed(&read(path)?, path)?);
    }
    if let Some(path) = &login.creds {
        let wrong = |reason| FleetError::File { path: path.clone(), reason };
        options = options.credentials(&read(path)?).map_err(wrong)?;
    }
    if let Some(path) = &login.ca {
        read(path)?;
        options = options.add_root_certificates(path.clone());
    }
    if let Some((certificate, key)) = &login.certificate {
        read(certificate)?;
        read(key)?;
        options = options.add_client_certificate(certificate.clone(), key.clone());
    }
    Ok(options)
}

fn read(path: &Path) -> Result<String, FleetError> {
    std::fs::read_to_string(path).map_err(|reason| FleetError::File { path: path.to_path_buf(), reason })
}

/// The seed in a file of an nkey: the first line that begins with S.
fn seed(text: &str, path: &Path) -> Result<String, FleetError> {
    let seed = text.lines().map(str::trim).find(|line| line.starts_with('S') && line.len() > 50);
    seed.map(str::to_owned).ok_or_else(|| {
        FleetError::Server(format!("{path:?} has no seed of an nkey, which is a line that begins with S"))
    })
}

/// Selects the implementation of TLS. Returns whether there is one for this processor.
fn prepare_tls() -> bool {
    #[cfg(target_arch = "x86_64")]
    let is_supported = is_x86_feature_detected!("aes")
        && is_x86_feature_detected!("pclmulqdq")
        && is_x86_feature_detected!("ssse3")
        && is_x86_feature_detected!("bmi1")
        && is_x86_feature_detected!("bmi2")
        && is_x86_feature_detected!("adx")
        && is_x86_feature_detected!("avx2");
    #[cfg(target_arch = "aarch64")]
    let is_supported = std::arch::is_aarch64_feature_detected!("aes")
        && std::arch::is_aarch64_feature_detected!("sha2")
        && std::arch::is_aarch64_feature_detected!("pmull");
    #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
    if is_supported {
        // Another one may have been selected before, by the caller of the library.
        let _ = rustls_graviola::default_provider().install_default();
        return true;
    }
    false
}

fn without_tls() -> &'static str {
    "TLS needs a processor with the instructions AES, ADX and AVX2 (x86-64) or AES (ARM): use a tunnel, such as ssh, to a server without TLS"
}

/// An error of a connection, with a remedy.
fn describe(error: &ConnectError, url: &str) -> FleetError {
    let text = error.to_string();
    let remedy = match error.kind() {
        ConnectErrorKind::AuthorizationViolation | ConnectErrorKind::Authentication => {
            "it refuses this login; check --user, --password, --token, --nkey or --creds"
        }
        ConnectErrorKind::Tls => "TLS failed; check --ca, --cert and --key, and the name of the server",
        ConnectErrorKind::ServerParse => "this is not the address of a server; write nats://HOST:4222",
        ConnectErrorKind::Dns => "there is no host of this name",
        ConnectErrorKind::TimedOut => "it does not answer like a NATS server; check host and port",
        _ if text.contains("refused") => {
            "nothing listens there; start nats-server -js, or check host and port"
        }
        _ => "check host and port, and that a NATS server listens there",
    };
    FleetError::Server(format!("cannot connect to {url}: {remedy} ({text})"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replies_are_separated_by_users() {
        let of = |user: Option<&str>, name: Option<&str>| {
            let [user, name] = [user, name].map(|text| text.map(str::to_owned));
            inbox(&Login { user, inbox: name, ..Login::default() })
        };
        assert_eq!(of(None, None), "_INBOX");
        assert_eq!(of(Some("a.>"), None), "_INBOX.a--");
        assert_eq!(of(Some("a"), Some("worker")), "_INBOX.worker");
    }

    #[test]
    fn the_seed_of_an_nkey_is_found() {
        let seed_line = format!("SU{}", "A".repeat(56));
        let text = format!("# comment\n  {seed_line}\n");
        assert_eq!(seed(&text, Path::new("a.nk")).unwrap(), seed_line);
        assert!(seed("nothing", Path::new("a.nk")).is_err());
    }
}
