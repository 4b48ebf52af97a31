//! The command `dmp`: score LiDAR SLAM runs without ground truth.

fn main() -> std::process::ExitCode {
    dmp_cli::main()
}
