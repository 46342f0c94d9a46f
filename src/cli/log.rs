//! Log lines on standard error: warnings by default, more with `TWOBOUNCE_LOG=info` or `debug`.

use tracing_subscriber::EnvFilter;

/// Sends the library's log to standard error.
pub fn init() {
    let filter = EnvFilter::try_from_env("TWOBOUNCE_LOG").unwrap_or_else(|_| EnvFilter::new("warn"));
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).without_time().init();
}
