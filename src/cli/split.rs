//! `stride split`: the commands that render a scene in shards, each a range of samples, and merge their films.
//!
//! One command per line, for a POSIX shell: schedulers run line N as their task N, and the last line when all others
//! have succeeded. `examples/farm/` does so with Slurm, Kubernetes and GNU parallel.

use super::failure::{Failure, usage};
use super::merge;
use super::render::{self, RenderArguments};
use crate::math::lanes::Level;
use crate::scene::Loaded;
use anyhow::Context;
use clap::parser::ValueSource;
use clap::{Arg, ArgMatches, Args, Command, FromArgMatches};
use std::ffi::{OsStr, OsString};
use std::io::{self, BufWriter, Write};
use std::ops::Range;
use std::path::PathBuf;

/// The most shards: their films are named on one command line, whose length systems limit.
const MOST_SHARDS: u32 = 10_000;

#[derive(Debug, clap::Args)]
pub(super) struct SplitArguments {
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_SHARDS)),
        help = format!("Number of shards, 1 to {MOST_SHARDS}: parts of the render with equally many samples per pixel"))]
    into: u32,
    #[command(flatten)]
    whole: WholeRender,
}

/// Why a render of samples that are distributed by error is not split.
const ADAPTIVE: &str =
    "samples are distributed by an error that is estimated from all samples, and a shard has only some";

/// Options of render that shards cannot have, and why.
const REFUSED: [(&str, &str); 11] = [
    ("range", "the samples of a render are split from sample 0 on; give their number with --spp"),
    ("time", "a shard needs to know its samples before the render; give their number with --spp"),
    (
        "noise",
        "a render ends at an error that is estimated from all samples, and a shard has only some; use --spp",
    ),
    ("adaptive", ADAPTIVE),
    ("resume", "shards begin films of their own; render the missing samples of a film with render --range"),
    ("samples", "every shard would write the same file; use it with render --range"),
    ("stats", "every shard would write the same file; use it with render --range"),
    ("dump_at", "no shard has the samples of such a picture; merge the first films to get one"),
    ("overlay", "shards write no picture"),
    ("window", "shards are rendered without a window"),
    ("tev", "shards are rendered without a viewer"),
];

/// Options of render with another use here: the number of samples, names of films, files to merge to.
const USED: [&str; 3] = ["spp", "film", "outputs"];

/// Options of render that every shard has.
const ALWAYS: [&str; 2] = ["continues", "headless"];

/// The arguments of the render that is split.
#[derive(Debug)]
struct WholeRender {
    arguments: RenderArguments,
    /// The options that were given: the identifier, and the words as they were written.
    options: Vec<(String, Vec<OsString>)>,
}

impl Args for WholeRender {
    fn augment_args(command: Command) -> Command {
        let hidden = REFUSED.iter().map(|(id, _)| *id).chain(ALWAYS);
        hidden
            .fold(RenderArguments::augment_args(command), |command, id| {
                command.mut_arg(id, |argument| argument.hide(true))
            })
            .mut_arg("spp", |argument| {
                argument.help("Samples per pixel of all shards together, instead of the scene's")
            })
            .mut_arg("outputs", |argument| {
                argument.help(
                    "File to merge to: .film, .exr, .png or .hdr; may be given several times [default: the scene's name with .png, in the current folder]",
                )
            })
            .mut_arg("film", |argument| {
                argument.help(
                    "Name of the shards' films, to which their numbers are added: NAME-01.film and so on [default: the scene's name, in the current folder]",
                )
            })
    }

    fn augment_args_for_update(command: Command) -> Command {
        WholeRender::augment_args(command)
    }
}

impl FromArgMatches for WholeRender {
    fn from_arg_matches(matches: &ArgMatches) -> Result<WholeRender, clap::Error> {
        let options = RenderArguments::augment_args(Command::new("render"))
            .get_arguments()
            .filter_map(|argument| words(argument, matches))
            .collect();
        Ok(WholeRender { options, arguments: RenderArguments::from_arg_matches(matches)? })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = WholeRender::from_arg_matches(matches)?;
        Ok(())
    }
}

/// An option as it was given, by its identifier: the words of a command line that give it again.
fn words(argument: &Arg, matches: &ArgMatches) -> Option<(String, Vec<OsString>)> {
    let id = argument.get_id().as_str();
    let name = format!("--{}", argument.get_long()?);
    if matches.value_source(id) != Some(ValueSource::CommandLine) {
        return None;
    }
    if !argument.get_action().takes_values() {
        return Some((id.to_owned(), vec![name.into()]));
    }
    let mut words = Vec::new();
    for values in matches.get_raw_occurrences(id)? {
        let mut values: Vec<&OsStr> = values.collect();
        let listed = argument.get_value_delimiter().map(|comma| values.join(OsStr::new(&comma.to_string())));
        if let Some(listed) = &listed {
            values = vec![listed];
        }
        match values.first() {
            // It would be taken for an option of its own.
            Some(only) if values.len() == 1 && only.as_encoded_bytes().starts_with(b"-") => {
                let mut word = OsString::from(&name);
                word.push("=");
                word.push(only);
                words.push(word);
            }
            _ => {
                words.push(OsString::from(&name));
                words.extend(values.iter().map(|&value| value.to_owned()));
            }
        }
    }
    Some((id.to_owned(), words))
}

pub(super) fn run(arguments: &SplitArguments) -> Result<(), Failure> {
    let whole = &arguments.whole;
    let given = |id: &str| whole.options.iter().any(|(other, _)| other == id);
    if let Some((id, reason)) = REFUSED.iter().find(|(id, _)| given(id)) {
        return Err(usage(format!("split cannot take --{}: {reason}", id.replace('_', "-"))));
    }
    let level = Level::from_environment().map_err(usage)?;
    let Loaded { scene, sources, crop, .. } = whole.arguments.scene.load_whole(whole.arguments.quiet)?;
    if scene.render.adaptive {
        return Err(usage(format!("split cannot take a scene with adaptive = true: {ADAPTIVE}")));
    }
    let samples = whole.arguments.spp.unwrap_or(scene.render.samples);
    let shards = Shards { samples, count: arguments.into.min(samples) };
    let (outputs, films) = (whole.arguments.pictures()?, whole.films(shards.count));
    merge::check_outputs(&outputs)?;
    if let Some(output) = outputs.iter().find(|output| films.contains(output)) {
        let output = output.display();
        return Err(usage(format!("-o {output} would replace the film of a shard; choose another name")));
    }
    // Settings that are wrong for one shard are wrong for all of them.
    let mut first = whole.arguments.clone();
    (first.range, first.film) = (Some(shards.range(0)), films.first().cloned());
    (first.spp, first.outputs) = (None, Vec::new());
    render::asked(&first, &scene, sources, crop, level)?.settings()?;
    if shards.count < arguments.into && !whole.arguments.quiet {
        let _ = writeln!(
            io::stderr(),
            "note: {samples} samples per pixel make {} shards of one sample, not {}",
            shards.count,
            arguments.into
        );
    }
    let commands = commands(whole, &shards, &films, &outputs)?;
    let mut out = BufWriter::new(io::stdout().lock());
    let written = commands.iter().try_for_each(|line| out.write_all(line)).and_then(|()| out.flush());
    Ok(written.context("standard output cannot be written")?)
}

/// The samples of a render in ranges whose lengths differ by at most one.
struct Shards {
    samples: u32,
    count: u32,
}

impl Shards {
    fn range(&self, shard: u32) -> Range<u32> {
        let start = |shard: u32| u64::from(shard) * u64::from(self.samples) / u64::from(self.count.max(1));
        start(shard) as u32..start(shard + 1) as u32
    }
}

impl WholeRender {
    /// The films of the shards, numbered from 1 on with equally many digits, so that lists of files have them in order.
    fn films(&self, count: u32) -> Vec<PathBuf> {
        let digits = count.to_string().len();
        let base = match &self.arguments.film {
            Some(film) if film.extension().is_some_and(|e| e.eq_ignore_ascii_case("film")) => {
                film.with_extension("")
            }
            Some(film) => film.clone(),
            None => PathBuf::from(self.arguments.scene.scene.file_stem().unwrap_or_default()),
        };
        let film = |number: u32| {
            let mut name = base.clone().into_os_string();
            name.push(format!("-{number:0digits$}.film"));
            PathBuf::from(name)
        };
        (1..=count).map(film).collect()
    }
}

/// The lines of all commands: one for each shard, and one that merges them.
fn commands(
    whole: &WholeRender,
    shards: &Shards,
    films: &[PathBuf],
    outputs: &[PathBuf],
) -> Result<Vec<Vec<u8>>, Failure> {
    // Called as this program was, which need not be on the path.
    let program = std::env::args_os().next().unwrap_or_else(|| "stride".into());
    let mut common = vec![program.clone(), "render".into(), operand(whole.arguments.scene.scene.as_os_str())];
    let is_passed = |id: &str| !USED.contains(&id) && !ALWAYS.contains(&id);
    let passed = whole.options.iter().filter(|(id, _)| is_passed(id));
    common.extend(passed.flat_map(|(_, words)| words.iter().cloned()));
    let mut lines = Vec::with_capacity(films.len() + 1);
    for (shard, film) in (0..shards.count).zip(films) {
        let Range { start, end } = shards.range(shard);
        let own = ["--range".into(), format!("{start}..{end}").into(), "--film".into()];
        let all = common.iter().cloned().chain(own);
        let all = all.chain([operand(film.as_os_str()), "--continue".into(), "--headless".into()]);
        lines.push(line(all)?);
    }
    let mut merge = vec![program, "merge".into()];
    merge.extend(films.iter().map(|film| operand(film.as_os_str())));
    for output in outputs {
        merge.extend(["-o".into(), operand(output.as_os_str())]);
    }
    // A render that is interrupted ends with success, and leaves its film unfinished.
    merge.extend(["--spp".into(), shards.samples.to_string().into()]);
    merge.extend(whole.arguments.quiet.then(|| "--quiet".into()));
    lines.push(line(merge)?);
    Ok(lines)
}

/// A path that is not taken for an option.
fn operand(path: &OsStr) -> OsString {
    let mut operand = OsString::from(if path.as_encoded_bytes().starts_with(b"-") { "./" } else { "" });
    operand.push(path);
    operand
}

/// A command on one line.
fn line(words: impl IntoIterator<Item = OsString>) -> Result<Vec<u8>, Failure> {
    let mut line = Vec::new();
    for word in words {
        if word.as_encoded_bytes().contains(&b'\n') {
            return Err(usage(format!(
                "{word:?} has a line break, and every command is one line; rename it"
            )));
        }
        if !line.is_empty() {
            line.push(b' ');
        }
        line.extend(quoted(word.as_encoded_bytes()));
    }
    line.push(b'\n');
    Ok(line)
}

/// A word that a POSIX shell takes literally: in single quotes unless it has harmless characters only (POSIX.1-2017,
/// Shell Command Language, section 2.2).
fn quoted(word: &[u8]) -> Vec<u8> {
    // An equals sign in the first word of a command is an assignment; options are never first.
    let is_option = word.starts_with(b"-");
    let is_harmless =
        |c: &u8| c.is_ascii_alphanumeric() || b"_-./,:+@%".contains(c) || (*c == b'=' && is_option);
    if !word.is_empty() && word.iter().all(is_harmless) {
        return word.to_vec();
    }
    let mut quoted = vec![b'\''];
    for &c in word {
        match c {
            b'\'' => quoted.extend(br"'\''"),
            c => quoted.push(c),
        }
    }
    quoted.push(b'\'');
    quoted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_have_all_samples_once() {
        for (samples, count) in [(1, 1), (13, 5), (10_007, 10_000), (64, 64), (u32::MAX, 9999)] {
            let shards = Shards { samples, count };
            let mut end = 0;
            for shard in 0..count {
                let range = shards.range(shard);
                assert_eq!(range.start, end, "{samples} {count}");
                assert!((samples / count..=samples.div_ceil(count)).contains(&(range.end - range.start)));
                end = range.end;
            }
            assert_eq!(end, samples);
        }
    }

    #[test]
    fn options_are_given_again_as_they_were_written() {
        let parsed = |line: &[&str]| {
            let command = SplitArguments::augment_args(Command::new("split").no_binary_name(true));
            SplitArguments::from_arg_matches(&command.try_get_matches_from(line).unwrap()).unwrap()
        };
        let given = ["a b.toml", "--into", "2", "--layers", "uv,depth", "-q", "--exposure", "-1", "--spp=9"];
        let arguments = parsed(&[&given[..], &["--layers", "albedo", "-o", "x.exr", "--headless"]].concat());
        let films = arguments.whole.films(2);
        let shards = Shards { samples: 9, count: 2 };
        let outputs = arguments.whole.arguments.pictures().unwrap();
        let lines = commands(&arguments.whole, &shards, &films, &outputs).unwrap();
        let text =
            |line: &[u8]| String::from_utf8(line.to_vec()).unwrap().split_once(' ').unwrap().1.to_owned();
        assert_eq!(
            text(&lines[1]),
            "render 'a b.toml' --exposure=-1 --layers uv,depth --layers albedo --quiet --range 4..9 --film 'a b-2.film' --continue --headless\n"
        );
        assert_eq!(text(&lines[2]), "merge 'a b-1.film' 'a b-2.film' -o x.exr --spp 9 --quiet\n");
        assert_eq!(lines.len(), 3);
        let arguments = parsed(&["--into", "10", "--film", "shards/a.film", "--", "-x.toml"]);
        assert_eq!(arguments.whole.films(10)[8], PathBuf::from("shards/a-09.film"));
        let lines = commands(&arguments.whole, &shards, &films, &[]).unwrap();
        assert!(text(&lines[0]).starts_with("render ./-x.toml --range 0..4"), "{}", text(&lines[0]));
    }

    #[test]
    fn refused_and_used_options_exist() {
        let command = RenderArguments::augment_args(Command::new("render"));
        let known = |id: &&str| command.get_arguments().any(|argument| argument.get_id() == *id);
        assert!(REFUSED.iter().map(|(id, _)| id).chain(&USED).chain(&ALWAYS).all(known));
    }

    #[test]
    fn words_are_quoted_where_a_shell_would_change_them() {
        let text = |word: &str| String::from_utf8(quoted(word.as_bytes())).unwrap();
        for plain in ["scene.toml", "--exposure=-1", "0..16", "/a/b_c-d.film", "640x480", "a@b:c,d+%"] {
            assert_eq!(text(plain), plain);
        }
        assert_eq!(text("it's"), r"'it'\''s'");
        for odd in ["", "a b", "~", "a=b", "$x", "*", "#a", "größe", "a\\b", "!", "{a,b}", "a\"b"] {
            assert_eq!(text(odd), format!("'{odd}'"));
        }
        assert!(line(["a\nb".into()]).is_err());
    }
}
