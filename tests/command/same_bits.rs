//! A repeated command writes equal bytes, whatever the number of the driver's threads, its caches and the machine's
//! other work. Vectors of 128 bits give the pixels of 256 bits; only the device's name in an EXR's header tells them
//! apart. The preset `printed` is an exception. On a GPU, which has neither such threads nor widths, runs are compared.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use crate::cli_common::{root, text};
use twobounce::layers::Layers;
use twobounce::settings::PRESETS;

/// Renders the gallery with a preset on a software driver of this many threads and bits.
struct Around<'a> {
    preset: &'a str,
    width: &'a str,
    threads: &'a str,
}

impl Around<'_> {
    /// Writes `out.png` and `out.exr` into a folder, and returns their bytes. `cache` holds compiled pipelines.
    fn render(&self, cache: &Path, out: &Path) -> [Vec<u8>; 2] {
        fs::create_dir_all(out).unwrap();
        ["out.png", "out.exr"].map(|name| {
            let mut command = Command::new(env!("CARGO_BIN_EXE_twobounce"));
            command.args(["render", "assets/gallery.glb", "--preset", self.preset, "--set", "voxels=32"]);
            command.args(["--size", "48x32", "--quiet", "-o"]).arg(out.join(name)).current_dir(root());
            command.env("LP_NATIVE_VECTOR_WIDTH", self.width).env("LP_NUM_THREADS", self.threads);
            command.env("XDG_CACHE_HOME", cache).env_remove("MESA_SHADER_CACHE_DIR").stdin(Stdio::null());
            let output = command.output().unwrap();
            assert!(output.status.success(), "{}: {}, {}", self.setup_in_words(), output.status, text(&output.stderr));
            fs::read(out.join(name)).unwrap()
        })
    }

    fn setup_in_words(&self) -> String {
        format!("{} with {} bits and {} threads", self.preset, self.width, self.threads)
    }
}

/// The preset of which 108 of the gallery's 1536 pixels differ between vector widths, by up to 0.1 %; and the allowed
/// share of such pixels.
const DIFFERS: (&str, f32) = ("printed", 2e-3);

/// Sets the flag when its scope ends, also by a panic.
struct AtEnd<'a>(&'a AtomicBool);

impl Drop for AtEnd<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Runs `work` while two other threads occupy every core.
fn beside_other_work<T>(work: impl FnOnce() -> T) -> T {
    let done = AtomicBool::new(false);
    thread::scope(|scope| {
        let _at_end = AtEnd(&done);
        for _ in 0..2 * thread::available_parallelism().map_or(1, |n| n.get()) {
            scope.spawn(|| {
                while !done.load(Ordering::Relaxed) {
                    std::hint::spin_loop();
                }
            });
        }
        work()
    })
}

#[test]
#[ignore = "minutes a preset, most of them in the driver's compiler: make test-more"]
fn nothing_around_a_render_changes_a_bit() {
    let place = tempfile::tempdir().unwrap();
    let at = |name: &str| place.path().join(name);
    for preset in PRESETS.iter().map(|preset| preset.name) {
        let [wide, narrow] = ["256", "128"].map(|width| {
            let around = |threads| Around { preset, width, threads };
            let cache = at(&format!("{preset}-{width}"));
            let [expected, other] = thread::scope(|scope| {
                let other = scope.spawn(|| around("4").render(&cache, &at("other")));
                [around("1").render(&cache, &at(width)), other.join().unwrap()]
            });
            assert!(other == expected, "{} beside another on a cold cache", around("1 and 4").setup_in_words());
            assert!(fs::read_dir(cache.join("twobounce")).unwrap().count() > 0, "the cache is warm now");
            let found = around("2").render(&cache, &at("other"));
            assert!(found == expected, "{} and a warm cache", around("2").setup_in_words());
            let found = beside_other_work(|| around("4").render(&cache, &at("other")));
            assert!(found == expected, "{} and a warm cache on a loaded machine", around("4").setup_in_words());
            let [png, _] = expected;
            (png, Layers::read_exr(&at(width).join("out.exr")).unwrap().0)
        });
        let off = |(a, b): (&f32, &f32)| if a == b { 0.0 } else { (a - b).abs() / a.abs().max(b.abs()) };
        let values = |image: &'_ Layers| image.beauty().iter().flatten().copied().collect::<Vec<f32>>();
        let most = values(&wide.1).iter().zip(&values(&narrow.1)).map(off).fold(0.0, f32::max);
        println!("{preset}: values of 128 bits are off by {most} at most");
        let allowed = if preset == DIFFERS.0 { DIFFERS.1 } else { 0.0 };
        assert!(wide.0 == narrow.0 || allowed > 0.0, "{preset}: the .png of 128 bits");
        assert!(most <= allowed, "{preset}: the .exr of 128 bits is off by {most}");
    }
}
