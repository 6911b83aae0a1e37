//! Errors of logins, servers, versions and files.

use crate::common::watched::poll;
use crate::machines::{Place, SIZE, cover, free_port, has_faults, has_server};
use std::fs;
use std::io::Write;
use std::net::TcpListener;
use std::process::{Command, Stdio};

#[test]
fn logins_and_servers_that_are_wrong_have_remedies() {
    if !has_server() {
        return;
    }
    let place = Place::start(&["--user", "u", "--pass", "right"]);
    let list = |password: &str| place.run(&["jobs", "list", "--user", "u", "--password", password]);
    assert!(list("right").status.success(), "{:?}", list("right"));
    let said = String::from_utf8(list("wrong").stderr).unwrap();
    assert!(said.contains("refuses this login") && said.contains("--creds"), "{said}");
    let at = |port: u16| {
        let url = format!("nats://127.0.0.1:{port}");
        let output = place.run_command(place.stride_at(&url, &["jobs", "list"]));
        String::from_utf8(output.stderr).unwrap()
    };
    // A server of something else, and no server at all.
    let other = TcpListener::bind(("127.0.0.1", free_port())).unwrap();
    let port = other.local_addr().unwrap().port();
    let greeting = std::thread::spawn(move || {
        if let Ok((mut stream, _)) = other.accept() {
            let _ = stream.write_all(b"220 mail.example ESMTP\r\n");
        }
    });
    let said = at(port);
    assert!(said.contains("cannot connect to nats://127.0.0.1"), "{said}");
    greeting.join().unwrap();
    let said = at(port);
    assert!(said.contains("nothing listens there"), "{said}");
    // A server without JetStream.
    let mut storeless = Place::without_server();
    storeless.options = &[];
    storeless.start_server();
    let scene = cover();
    for command in [&["submit", &scene, "-o", "x.exr"][..], &["work"], &["jobs", "list"]] {
        let said = storeless.fail(command);
        assert!(said.contains("start it with JetStream"), "{said}");
    }
}

#[test]
fn missing_files_and_other_versions_are_named() {
    if !has_server() {
        return;
    }
    let place = Place::start(&[]);
    let text = "[[entities]]\nname = \"a\"\nshape = { type = \"mesh\", file = \"gone.ply\" }\nmaterial = \"m\"\n[materials.m]\ntype = \"matte\"\n";
    fs::write(place.path("broken.toml"), text).unwrap();
    let said = place.fail(&["submit", "broken.toml", "-o", "b.exr"]);
    assert!(said.contains("gone.ply") && said.contains("no such file"), "{said}");
    if !has_faults() {
        return;
    }
    let _other = place.worker("other", |command| {
        command.env("STRIDE_TEST_FLEET_PROGRAM", "stride 99.0");
    });
    let scene = cover();
    let mut submit =
        place.watch(&["submit", &scene, "--size", SIZE, "--spp", "3", "-o", "s.exr", "--film", "s.film"]);
    submit.hear("its program is stride");
    // A worker of the right version completes it.
    let _right = place.worker("right", |_| ());
    let (code, said) = submit.end();
    assert_eq!(code, Some(0), "{said}");
    place.expect_single("s", &["--spp", "3"]);
}

#[test]
fn a_full_server_loses_nothing() {
    if !has_server() || !has_faults() {
        return;
    }
    // Room for about eight results.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("small.conf");
    fs::write(&path, "jetstream { max_file_store: 160KB }").unwrap();
    let place = Place::start(&["-c", path.to_str().unwrap()]);
    let scene = cover();
    let fixed = ["submit", &scene, "--detach", "-q", "--size", SIZE, "--unit", "1ms", "--patience", "500ms"];
    let id = place.succeed(&[&fixed[..], &["--spp", "60"]].concat()).0.trim().to_owned();
    // Workers that die when they have sent the parts of their films, until these take all room.
    let mut mute = 0;
    let is_full = || place.said("mute").contains("the server has no room");
    while !is_full() {
        let mut worker = place.worker("mute", |command| {
            command.env("STRIDE_TEST_FLEET_MUTE", "1");
        });
        poll("the end of a worker", || worker.has_ended() || is_full());
        mute += 1;
        assert!(mute < 60, "the server is never full");
    }
    let mut watching = place.watch(&["jobs", "watch", &id]);
    let _workers = ["a", "b"].map(|name| place.worker(name, |_| ()));
    watching.hear("the server has no room");
    let collect = ["jobs", "collect", &id, "-q", "--film", "f.film", "-o", "f.exr", "--checkpoint", "1h"];
    place.succeed(&collect);
    place.expect_single("f", &["--spp", "60"]);
}

#[test]
fn a_result_that_never_has_room_is_an_error() {
    if !has_server() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("small.conf");
    fs::write(&path, "jetstream { max_file_store: 160KB }").unwrap();
    let place = Place::start(&["-c", path.to_str().unwrap()]);
    let scene = cover();
    let id = place.succeed(&["submit", &scene, "--detach", "-q", "--size", "200x100", "--spp", "1"]).0;
    let _worker = place.worker("w", |_| ());
    poll("the message of the worker", || place.said("w").contains("raise max_file_store"));
    // The job is there for a server with more room.
    assert!(place.succeed(&["jobs", "list"]).0.contains(id.trim()));
}

#[test]
fn the_server_configuration_gives_each_role_its_subjects_only() {
    if !has_server() {
        return;
    }
    let config = format!("{}/docs/fleet/nats-server.conf", env!("CARGO_MANIFEST_DIR"));
    let text = fs::read_to_string(config).unwrap();
    // The passwords of the example.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("server.conf");
    let text = ["SUBMITTER", "WORKER", "READER"].iter().fold(text, |text, role| {
        text.replace(&format!("${role}_PASSWORD"), &format!("\"{}\"", role.to_lowercase()))
    });
    fs::write(&path, text).unwrap();
    let place = Place::start(&["-c", path.to_str().unwrap()]);
    let login = |role: &'static str| ["--user", role, "--password", role];
    let _worker = place.worker("w", |command| {
        command.args(login("worker"));
    });
    let scene = cover();
    let job = ["submit", &scene, "-q", "--size", SIZE, "--spp", "3", "-o", "p.exr", "--film", "p.film"];
    place.succeed(&[&job[..], &login("submitter")].concat());
    place.expect_single("p", &["--spp", "3"]);
    let list = |role| place.succeed(&[&["jobs", "list"][..], &login(role)].concat()).0;
    let id = list("reader").split(' ').next().unwrap().to_owned();
    for role in ["reader", "worker"] {
        let said = place.fail(&[&["jobs", "priority", &id, "3"][..], &login(role)].concat());
        assert!(said.contains("may not do that"), "{role}: {said}");
    }
    // Negative control.
    place.succeed(&[&["jobs", "priority", &id, "3"][..], &login("submitter")].concat());
    // Replies to others are not for a reader, who could otherwise read scenes and results.
    let elsewhere = ["jobs", "list", "--inbox", "worker"];
    let said = place.fail(&[&elsewhere[..], &login("reader")].concat());
    assert!(said.contains("may not do that"), "{said}");
}

#[test]
fn tls_needs_the_right_certificate() {
    if !has_server() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let made = Command::new("openssl")
        .args(["req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=localhost"])
        .args(["-addext", "subjectAltName=IP:127.0.0.1", "-addext", "basicConstraints=critical,CA:FALSE"])
        .args(["-keyout", &path("key.pem"), "-out", &path("cert.pem")])
        .stderr(Stdio::null())
        .status();
    if !made.is_ok_and(|status| status.success()) {
        assert!(std::env::var("STRIDE_REQUIRE_ALL").as_deref() != Ok("1"), "openssl makes no certificate");
        println!("skipped: openssl makes no certificate");
        return;
    }
    let place = Place::start(&["--tls", "--tlscert", &path("cert.pem"), "--tlskey", &path("key.pem")]);
    let list = |more: &[&str]| {
        let url = place.url().replace("nats://", "tls://");
        let mut command = place.stride_at(&url, &["jobs", "list"]);
        command.args(more);
        let output = place.run_command(command);
        (output.status.success(), String::from_utf8(output.stderr).unwrap())
    };
    let mut said = String::new();
    poll("a connection with TLS", || {
        let (success, text) = list(&["--ca", &path("cert.pem")]);
        said = text;
        success || said.contains("processor")
    });
    assert!(!said.contains("processor"), "{said}");
    let (success, said) = list(&[]);
    assert!(!success && said.contains("cannot connect to tls://"), "{said}");
}

#[test]
fn options_that_cannot_be_meant_are_errors_of_the_command_line() {
    // Without a server: nothing is connected.
    let place = Place::without_server();
    let scene = cover();
    let refused = [
        &["work", "--name", ""][..],
        &["submit", &scene, "--detach", "-o", "x.exr"],
        &["submit", &scene, "--detach", "--film", "x.film"],
        &["submit", &scene, "--detach", "--checkpoint", "5s"],
    ];
    for arguments in refused {
        let output = place.run(arguments);
        let said = String::from_utf8_lossy(&output.stderr);
        let names = arguments.iter().any(|it| it.starts_with("--") && said.contains(*it));
        assert!(output.status.code() == Some(2) && names, "{arguments:?}: {said}");
    }
    // Negative control: the server is looked for.
    for arguments in [&["work", "--name", "w"][..], &["submit", &scene, "--detach"]] {
        let said = place.fail(arguments);
        assert!(said.contains("nothing listens there"), "{arguments:?}: {said}");
    }
}

#[test]
fn malformed_units_and_results_end_no_worker_and_no_collector() {
    if !has_server() {
        return;
    }
    let place = Place::start(&[]);
    let scene = cover();
    let fixed = ["submit", &scene, "--detach", "-q", "--size", SIZE, "--unit", "1ms", "--spp", "3"];
    let id = place.succeed(&fixed).0.trim().to_owned();
    // No unit at all, one without samples, and one of another job.
    let other = |job: &str| format!("{{\"job\":\"{job}\",\"first\":7,\"end\":7,\"check\":0,\"not\":[]}}");
    place.publish(&format!("stride.unit.{id}.junk"), "junk");
    place.publish(&format!("stride.unit.{id}.7.7.0"), &other(&id));
    place.publish(&format!("stride.unit.{id}.7.8.0"), &other("jother").replace("\"end\":7", "\"end\":8"));
    place.publish(&format!("stride.done.{id}.0.1.nonce"), "junk");
    let mut worker = place.worker("w", |_| ());
    for said in ["a unit is malformed", "a unit has no samples"] {
        poll(said, || place.said("w").contains(said));
    }
    let collect = ["jobs", "collect", &id, "--film", "m.film", "-o", "m.exr"];
    let (_, said) = place.succeed(&collect);
    assert!(said.contains("a result is malformed"), "{said}");
    place.expect_single("m", &["--spp", "3"]);
    assert!(!worker.has_ended() && place.said("w").contains("it is ignored"), "{}", place.said("w"));
}

#[test]
fn a_job_that_could_not_grow_is_refused() {
    if !has_server() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("small.conf");
    fs::write(&path, "max_payload: 8KB").unwrap();
    let place = Place::start(&["-c", path.to_str().unwrap()]);
    // Tiles of one picture, whose names fill the message of a job.
    let tile = |number: u32| image::RgbImage::new(1, 1).save(place.path(&format!("t{number}.png"))).unwrap();
    (1001..1041).for_each(tile);
    let text = fs::read_to_string(cover()).unwrap();
    let more = "\n[textures.t]\ntype = \"image\"\nfile = \"t<UDIM>.png\"\n[materials.t]\ntype = \"matte\"\nreflectance = \"t\"\n";
    fs::write(place.path("a.toml"), text + more).unwrap();
    let submit = ["submit", "a.toml", "--detach", "-q", "--size", SIZE, "--spp", "2"];
    let said = place.fail(&submit);
    assert!(said.contains("names of its 41 files") && said.contains("raise max_payload"), "{said}");
    assert_eq!(place.succeed(&["jobs", "list"]).0, "");
    // Negative control: fewer files leave room.
    (1003..1041).for_each(|number| fs::remove_file(place.path(&format!("t{number}.png"))).unwrap());
    let id = place.succeed(&submit).0.trim().to_owned();
    let _worker = place.worker("w", |_| ());
    place.succeed(&["jobs", "collect", &id, "-q", "--film", "g.film", "-o", "g.exr"]);
    place.expect_single_of("a.toml", "g", &["--spp", "2"]);
}
