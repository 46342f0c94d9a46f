//! Writes `docs/talk.md`, the talk's slides one by one, and its pictures: what each pass leaves on the device.
//!
//! `cargo run --release --example talk`

mod page;
mod pictures;

use std::path::Path;

use twobounce::Result;
use twobounce::output::file;

fn main() -> Result<()> {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    for (name, bytes) in pictures::all()? {
        file::write(&docs.join("talk").join(name), &bytes)?;
        println!("docs/talk/{name}: {} bytes", bytes.len());
    }
    file::write(&docs.join("talk.md"), page::document().as_bytes())
}
