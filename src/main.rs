//! The `kincal` binary; everything is in the library.

fn main() -> std::process::ExitCode {
    kincal::cli::main()
}
