//! The paths to other modules in a source.

/// A path in a source.
pub(crate) struct Named {
    /// From the crate's root.
    pub(crate) path: Vec<String>,
    /// The name by which the source refers to its target.
    pub(crate) known: String,
    /// Whether the source only re-exports it, as by `pub use`.
    pub(crate) is_passed_on: bool,
}

/// The paths in some tokens that begin with `crate`, `super` or `self`, from the crate's root, with the names that a
/// `use` gives their targets. A path within a module that the tokens open counts as the outer module's.
pub(crate) fn paths(tokens: &[String], module: &[String]) -> Vec<Named> {
    let mut found = Vec::new();
    // Since the last `use` of a `pub use`: paths up to the semicolon are re-exported.
    let mut passes_on = false;
    let mut i = 0;
    while i < tokens.len() {
        if tokens[i] == ";" {
            passes_on = false;
        }
        if tokens[i] == "use" && i > 0 && (tokens[i - 1] == "pub" || tokens[i - 1] == ")") {
            passes_on = true;
        }
        let begins = matches!(tokens[i].as_str(), "crate" | "super" | "self")
            && tokens.get(i + 1).is_some_and(|next| next == "::")
            && (i == 0 || tokens[i - 1] != "::");
        if begins {
            let mut base = match tokens[i].as_str() {
                "crate" => Vec::new(),
                "self" => module.to_vec(),
                _ => module[..module.len().saturating_sub(1)].to_vec(),
            };
            let mut at = i + 2;
            while tokens.get(at).is_some_and(|token| token == "super") {
                base.pop();
                at += 2;
            }
            i = tree(tokens, at, &base, passes_on, &mut found);
        } else if tokens[i] == "use"
            && tokens.get(i + 2).is_some_and(|next| next == "::")
            && tokens[i + 1] != "::"
        {
            // A path to a module of its own: `pub use simple::Simple`.
            if !matches!(tokens[i + 1].as_str(), "crate" | "super" | "self") {
                i = tree(tokens, i + 1, module, passes_on, &mut found);
                continue;
            }
            i += 1;
        } else if is_part(tokens, i) {
            i = tree(tokens, i, module, passes_on, &mut found);
        } else {
            i += 1;
        }
    }
    found
}

/// Whether a path begins here with the name of a module that the tokens declare: `noise::least()`.
fn is_part(tokens: &[String], i: usize) -> bool {
    let is_path = tokens.get(i + 1).is_some_and(|next| next == "::") && (i == 0 || tokens[i - 1] != "::");
    is_path && tokens.windows(3).any(|some| some[0] == "mod" && some[1] == tokens[i] && some[2] == ";")
}

/// A tree of names behind a path; returns the index of its end.
fn tree(
    tokens: &[String],
    mut at: usize,
    base: &[String],
    is_passed_on: bool,
    found: &mut Vec<Named>,
) -> usize {
    let mut path = base.to_vec();
    loop {
        match tokens.get(at).map(String::as_str) {
            Some("{") => {
                at += 1;
                while tokens.get(at).is_some_and(|token| token != "}") {
                    at = tree(tokens, at, &path, is_passed_on, found);
                    if tokens.get(at).is_some_and(|token| token == ",") {
                        at += 1;
                    }
                }
                return at + 1;
            }
            Some("self") if tokens.get(at + 1).is_none_or(|token| token != "::") => {
                let known = path.last().cloned().unwrap_or_default();
                found.push(Named { path, known, is_passed_on });
                return at + 1;
            }
            Some(name) if name.chars().all(|c| c.is_alphanumeric() || c == '_') => {
                path.push(name.to_owned());
                at += 1;
            }
            _ => return at + 1,
        }
        if tokens.get(at).is_some_and(|token| token == "::") {
            at += 1;
            continue;
        }
        let mut known = path.last().cloned().unwrap_or_default();
        if tokens.get(at).is_some_and(|token| token == "as") {
            known = tokens.get(at + 1).cloned().unwrap_or_default();
            at += 2;
        }
        found.push(Named { path, known, is_passed_on });
        return at;
    }
}
