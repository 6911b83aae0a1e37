//! Exit codes: 0 done, 1 failed, 2 bad usage.

fn main() -> std::process::ExitCode {
    stride::cli::main()
}
