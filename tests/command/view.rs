//! `view`, on a display in memory.
#![cfg(feature = "window")]

use std::path::Path;
use std::process::{Command, Output};
use std::sync::{Mutex, PoisonError};

use crate::cli_common::{Display, folder};
use twobounce::layers::Layers;

/// Lock of the tests: only one window is open at a time.
static ALONE: Mutex<()> = Mutex::new(());

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/cornell-area.glb");

/// Small enough for a CPU device.
const SMALL: [&str; 5] = ["--preset", "fast", "--set", "voxels=16", "--validation"];

/// Plays a script in a window of 96×64, whose pictures are not refined.
fn view(folder: &Path, script: &str, more: &[&str]) -> Output {
    view_of(SCENE, folder, script, &[&["--refine", "1"], more].concat())
}

fn view_of(scene: &str, folder: &Path, script: &str, more: &[&str]) -> Output {
    let program = [env!("CARGO_BIN_EXE_twobounce"), "view", scene];
    view_by(&program, folder, script, more)
}

/// As [`view_of`], with these words before its arguments.
fn view_by(program: &[&str], folder: &Path, script: &str, more: &[&str]) -> Output {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    std::fs::write(folder.join("script"), script).unwrap();
    let display = Display::open();
    let args = [&["--size", "96x64", "--script", "script"], &SMALL[..], more].concat();
    display.command(program).args(args).current_dir(folder).output().unwrap()
}

/// Standard output of a session; fails if the session fails.
fn viewed(folder: &Path, script: &str) -> String {
    said(view(folder, script, &[]))
}

/// Standard output of a command; fails if the command fails.
fn said(output: Output) -> String {
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

fn pixels(path: &Path) -> image::RgbImage {
    image::open(path).unwrap_or_else(|error| panic!("{}: {error}", path.display())).into_rgb8()
}

/// Runs a command that the window printed.
fn run_printed(folder: &Path, command: &str) {
    let program = Path::new(env!("CARGO_BIN_EXE_twobounce")).parent().unwrap();
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap_or_default());
    let output = Command::new("sh").args(["-c", command]).env("PATH", path).current_dir(folder).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{command}: {}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn the_window_shows_the_bits_that_its_command_renders() {
    let folder = folder();
    let walk = "turn 0.1 0\nwalk 0.1 0.2 0.3\nset bounces=all\nrest\npanel closed\n";
    let script = format!("rest\npanel closed\ngrab a.png\nkey C\n{walk}grab b.png\nsave c.png\nkey C\nquit");
    let said = viewed(folder.path(), &script);
    let commands: Vec<&str> = said.lines().filter(|line| line.starts_with("twobounce render")).collect();
    assert_eq!(commands.len(), 2, "{said}");
    assert!(!commands[0].contains("--eye") && commands[1].contains("--eye"), "{commands:?}");
    for (command, shown) in commands.iter().zip(["a.png", "b.png"]) {
        run_printed(folder.path(), command);
        let (rendered, shown) = (pixels(&folder.path().join("image.png")), pixels(&folder.path().join(shown)));
        assert!(rendered.pixels().any(|pixel| pixel.0 != rendered.get_pixel(0, 0).0), "an image of one colour");
        assert!(rendered == shown, "{command}");
    }
    assert!(pixels(&folder.path().join("c.png")) == pixels(&folder.path().join("b.png")));
    assert!(folder.path().join("c.exr").exists());
    assert!(pixels(&folder.path().join("a.png")) != pixels(&folder.path().join("b.png")));
}

/// At rest the picture is refined, and the printed command makes the picture in the window.
#[test]
fn a_picture_at_rest_is_refined_and_its_light_settles_before_the_eye() {
    let folder = folder();
    let script = "rest\nrefined\npanel closed\ngrab a.png\nkey C\nsay\nquit";
    let sets = ["--refine", "3", "--set", "bounces=all", "--set", "rays.passes=400"];
    let said = said(view_of(SCENE, folder.path(), script, &sets));
    let command = said.lines().find(|line| line.starts_with("twobounce render")).expect("a command");
    assert!(command.contains("image.passes=3"), "{command}");
    run_printed(folder.path(), command);
    assert!(pixels(&folder.path().join("image.png")) == pixels(&folder.path().join("a.png")), "{command}");
    let unfinished = said.split_once("unfinished pictures ").and_then(|(_, rest)| rest.split(';').next()?.parse().ok());
    assert!(unfinished.is_some_and(|pictures: u32| pictures > 0), "nothing was shown while light settled: {said}");
}

/// Stored light of earlier motion is discarded when everything stands still.
#[test]
fn an_animation_that_stops_shows_what_its_command_renders() {
    let folder = folder();
    let demo = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/demo.glb");
    let script = "rest\npanel closed\nkey Space\nwait 0.3\nkey Space\nrest\ngrab a.png\nkey C\nquit";
    let said = said(view_of(demo, folder.path(), script, &["--refine", "1", "--set", "bounces=all"]));
    let command = said.lines().find(|line| line.starts_with("twobounce render")).expect("a command");
    run_printed(folder.path(), command);
    assert!(pixels(&folder.path().join("image.png")) == pixels(&folder.path().join("a.png")), "{command}");
}

#[test]
fn a_window_is_resized_and_its_swapchain_made_a_hundred_times() {
    let folder = folder();
    let script = "rest\nremake 100\nsize 120 80\nrest\nminimise\nrestore\nrest\npanel closed\ngrab a.png\nsay\nquit";
    let said = viewed(folder.path(), script);
    let made = said.lines().find_map(|line| line.strip_prefix("swapchains ")?.split(';').next()?.parse::<u32>().ok());
    assert!(made.is_some_and(|made| made > 101), "{said}");
    assert_eq!(pixels(&folder.path().join("a.png")).dimensions(), (120, 80));
}

/// With a window manager, which hides the window and shows it again; frames are made meanwhile.
#[test]
fn a_window_is_minimised_and_restored() {
    let folder = folder();
    let managed =
        "command -v jwm >/dev/null || { echo install package jwm >&2; exit 2; }; jwm >/dev/null 2>&1 & exec \"$@\"";
    let program = ["sh", "-c", managed, "sh", env!("CARGO_BIN_EXE_twobounce"), "view", SCENE];
    let script = "rest\npanel closed\nsize 96 64\nrest\ngrab a.png\nminimised\nset bounces=1\nrest\nset bounces=2\nrest\n\
                  restored\nrest\ngrab b.png\nquit";
    said(view_by(&program, folder.path(), script, &["--refine", "1"]));
    assert!(pixels(&folder.path().join("a.png")) == pixels(&folder.path().join("b.png")));
}

/// A swapchain that no longer fits, found alternately at acquire and at present, is recreated, and the picture stays.
#[test]
fn swapchains_that_are_out_of_date_are_made_anew() {
    let folder = folder();
    let faults = "fault acquire\nfault present\n".repeat(10);
    let script = format!("rest\npanel closed\ngrab a.png\n{faults}remake 20\nrest\nsay\ngrab b.png\nquit");
    let said = viewed(folder.path(), &script);
    let made: u32 = said.split_once("swapchains ").and_then(|(_, rest)| rest.split(';').next()?.parse().ok()).unwrap();
    assert!(made >= 41, "one at first, twenty by hand, and one per fault: {said}");
    assert!(pixels(&folder.path().join("a.png")) == pixels(&folder.path().join("b.png")));
}

/// Each of the two devices is lost in turn and reopened; a device that is lost again at once ends the window with a
/// message.
#[test]
fn lost_devices_are_opened_anew() {
    let folder = folder();
    let script = "rest\npanel closed\ngrab a.png\nfault lost\nremake 1\nrest\nlose\nrest\ngrab b.png\nquit";
    let output = view(folder.path(), script, &[]);
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    said(output);
    assert_eq!(errors.matches("was lost and is reopened").count(), 2, "{errors}");
    assert!(pixels(&folder.path().join("a.png")) == pixels(&folder.path().join("b.png")));

    for again in ["fault lost\nremake 1\nfault lost\nremake 1\nquit", "lose\nrest\nlose\nrest\nquit"] {
        let output = view(folder.path(), &format!("rest\n{again}"), &[]);
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{again}: {errors}");
        assert!(errors.contains("was lost again"), "{again}: {errors}");
    }
}

#[test]
fn layers_and_panel_are_shown() {
    let folder = folder();
    let script = "rest\npanel closed\ngrab a.png\nlayer normal\nrest\ngrab b.png\nlayer beauty\npanel open\nrest\ngrab c.png\nquit";
    viewed(folder.path(), script);
    let [image, normals, panel] = ["a.png", "b.png", "c.png"].map(|name| pixels(&folder.path().join(name)));
    assert!(image != normals && image != panel);
}

/// Each picture gets a new name, whatever the folder holds, and is complete though the key is pressed while it is made.
#[test]
fn pictures_are_saved_whole_under_names_that_are_free() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let name = Path::new(SCENE).file_stem().unwrap().to_str().unwrap();
    std::fs::write(at(&format!("{name}.exr")), "another's").unwrap();
    let script = "turn 0.1 0\nkey P\nrest\nwait 0\nturn 0.2 0\nrest\nkey P\nwait 0\nquit";
    let said = viewed(folder.path(), script);
    for number in [2, 3] {
        assert!(said.contains(&format!("wrote {name}-{number}.png and {name}-{number}.exr")), "{said}");
        let image = image::open(at(&format!("{name}-{number}.png"))).unwrap();
        let (saved, _) = Layers::read_exr(&at(&format!("{name}-{number}.exr"))).unwrap();
        assert_eq!((image.width(), image.height()), (saved.width, saved.height));
        assert_eq!((saved.width, saved.height), (96, 64), "a coarse picture");
    }
    assert_eq!(std::fs::read_to_string(at(&format!("{name}.exr"))).unwrap(), "another's");
    assert!(!at(&format!("{name}.png")).exists());
}

#[test]
fn the_path_tracer_runs_beside_and_the_picture_fades_to_it() {
    let folder = folder();
    let script = "rest\npanel closed\ngrab a.png\ntruth 1\ngrab b.png\nsay\ntruth 2\ngrab c.png\nturn 0.1 0\nquit";
    let said = viewed(folder.path(), script);
    let number = |name: &str| {
        let after = said.split_once(name).unwrap_or_else(|| panic!("no {name} in {said}")).1;
        after.trim_start().split([',', '\n']).next().unwrap().parse::<f64>().unwrap()
    };
    // A few paths a pixel are noisy; the energy is right nevertheless.
    assert!((number("energy") - 1.0).abs() < 0.1 && number("rel") > 0.0 && number("FLIP") > 0.0, "{said}");
    let [image, reference, error] = ["a.png", "b.png", "c.png"].map(|name| pixels(&folder.path().join(name)));
    assert!(image != reference && reference != error);
    assert!(error.pixels().all(|pixel| pixel.0[0] == pixel.0[1] && pixel.0[1] == pixel.0[2]), "FLIP is grey");
}

#[test]
fn a_window_closes_while_a_frame_is_made() {
    let folder = folder();
    viewed(folder.path(), "set image.passes=64\nquit");
}

#[test]
fn what_cannot_be_shown_is_said_in_a_sentence() {
    let folder = folder();
    let output = Command::new(env!("CARGO_BIN_EXE_twobounce"))
        .args(["view", SCENE])
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET")
        .output()
        .unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.lines().count() == 1 && said.contains("twobounce render"), "{said}");

    let output = view(folder.path(), "rest\nsomersault", &[]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("script") && said.contains("line 2"), "{said}");
}

#[test]
fn without_the_feature_there_is_nothing_of_a_window() {
    let tree = |features: &[&str]| {
        let arguments = ["tree", "--offline", "--locked", "--edges", "normal", "--prefix", "none"];
        let cargo =
            Command::new(env!("CARGO")).args(arguments).args(features).current_dir(env!("CARGO_MANIFEST_DIR")).output();
        String::from_utf8(cargo.unwrap().stdout).unwrap()
    };
    let windows =
        |tree: &str| ["winit ", "egui ", "ash-window "].iter().any(|name| tree.lines().any(|l| l.starts_with(name)));
    assert!(windows(&tree(&[])));
    assert!(!windows(&tree(&["--no-default-features"])));
}

/// The left part shows the render of `--preset fast`, the right part that of another preset; a picture has no
/// difference from itself.
#[test]
fn another_preset_is_shown_beside() {
    let folder = folder();
    let script = "rest\npanel closed\ngrab own.png\nkey C\nbeside split cones\nrest\ngrab both.png\nbeside difference fast\nrest\n\
                  grab none.png\nbeside difference one bounce fewer\nrest\ngrab bounce.png\nbeside flicker cones\nrest\n\
                  beside split nothing\nrest\ngrab again.png\nquit";
    let said = viewed(folder.path(), script);
    let command = said.lines().find(|line| line.starts_with("twobounce render")).expect("a command");
    run_printed(folder.path(), &command.replace("--preset=fast", "--preset=cones"));
    let shown = |name: &str| pixels(&folder.path().join(name));
    let (own, other, both) = (shown("own.png"), shown("image.png"), shown("both.png"));
    assert!(own != other);
    for (x, y, pixel) in both.enumerate_pixels().filter(|(x, ..)| *x != 48) {
        assert_eq!(pixel, if x < 48 { &own } else { &other }.get_pixel(x, y), "{x}, {y}");
    }
    assert!(shown("none.png").pixels().all(|pixel| pixel.0 == [0; 3]));
    // The second bounce alone is light, and less than all of it.
    let sum = |image: &image::RgbImage| image.pixels().flat_map(|p| p.0).map(u64::from).sum::<u64>();
    let bounce = sum(&shown("bounce.png"));
    assert!(bounce > 0 && bounce < sum(&own), "{bounce}");
    assert!(shown("again.png") == own);
}

#[test]
fn voxels_and_list_lengths_are_shown() {
    let folder = folder();
    let script = "layer voxels\nrest\npanel closed\ngrab a.png\nlayer voxels, level 2\nrest\ngrab b.png\n\
                  layer list lengths\nrest\ngrab c.png\nquit";
    viewed(folder.path(), script);
    let colors = |name: &str| {
        let image = pixels(&folder.path().join(name));
        image.pixels().map(|pixel| pixel.0).collect::<std::collections::BTreeSet<_>>()
    };
    let (fine, coarse, lengths) = (colors("a.png").len(), colors("b.png").len(), colors("c.png"));
    assert!(fine > 3 * coarse && coarse > 3, "{fine} and {coarse} voxels");
    // A voxel within a wall has one or two triangles, one at a corner more.
    assert!(lengths.contains(&[0, 0, 0]) && lengths.len() > 2, "{lengths:?}");
}

/// Stored light of surfaces equals the light of the image there; a volume's sides differ; only methods with these
/// layers show them.
#[test]
fn light_is_shown_where_it_is_kept() {
    let folder = folder();
    let cones = "set method=cones\n";
    let script = format!(
        "rest\npanel closed\nlayer indirect\nrest\ngrab seen.png\nlayer light kept\nrest\ngrab kept.png\nlayer where light is kept\nrest\n\
         grab items.png\n{cones}layer volume\nrest\ngrab mean.png\nlayer volume 1 0 +x\nrest\ngrab x.png\nlayer volume 1 3 +x\nrest\n\
         grab coarse.png\nquit"
    );
    said(view(folder.path(), &script, &["--exposure", "0"]));
    let image = |name: &str| pixels(&folder.path().join(name));
    let mean = |name: &str| image(name).pixels().flat_map(|p| p.0).map(f64::from).sum::<f64>() / (3.0 * 96.0 * 64.0);
    let colors = |name: &str| image(name).pixels().map(|p| p.0).collect::<std::collections::BTreeSet<_>>().len();
    assert!(mean("kept.png") > 10.0 && mean("mean.png") > 10.0, "{} and {}", mean("kept.png"), mean("mean.png"));
    // An item has one colour in all pixels that show it.
    assert!(colors("items.png") > 50 && colors("kept.png") <= colors("items.png") + 2);
    assert!(image("x.png") != image("mean.png") && image("x.png") != image("coarse.png"));
    assert!(image("kept.png") != image("seen.png"));
}

/// The rays of a pixel bring the light of its gather, and end at surfaces.
#[test]
fn the_rays_of_a_pixel_are_listed() {
    let folder = folder();
    let script = "rest\nrays 48 60\nsay\nbounds\npanel closed\ngrab a.png\nquit";
    let said =
        said(view(folder.path(), script, &["--set", "rays.diffuse=16", "--set", "image.gather_resolution=full"]));
    let rays: Vec<&str> = said.lines().filter(|line| line.starts_with("ray ")).collect();
    assert_eq!(rays.len(), 16, "{said}");
    // The pixel shows the floor: its rays go up, to walls, the ceiling and the boxes, and leave through the open front.
    assert!(rays.iter().filter(|ray| ray.ends_with("front")).count() > 8, "{said}");
    assert!(!rays.iter().any(|ray| ray.ends_with("back")), "{said}");
    let points = |ray: &str| {
        let numbers: Vec<f64> = ray
            .split(|c: char| !(c.is_ascii_digit() || "-.e".contains(c)))
            .filter_map(|word| word.parse().ok())
            .collect();
        [[numbers[0], numbers[1], numbers[2]], [numbers[3], numbers[4], numbers[5]]]
    };
    for ray in &rays {
        let [from, to] = points(ray);
        assert!((from[1] + 1.0).abs() < 0.01 && to[1] > from[1], "{ray}"); // the floor is at −1
    }
    assert!(
        pixels(&folder.path().join("a.png")).pixels().any(|pixel| pixel.0[0] > 200 && pixel.0[2] < 60),
        "no bounds"
    );
}

#[test]
fn a_setting_is_measured_beside_its_neighbours() {
    let folder = folder();
    let said = viewed(folder.path(), "rest\ncost bounces\ncost voxels\nsay\nquit");
    let costs = said.lines().find(|line| line.starts_with("costs ")).expect("costs");
    for value in ["bounces: 1: ", "2: ", "all: ", "voxels: ", "16: ", "32: "] {
        assert!(costs.contains(value), "no {value} in {costs}");
    }
    assert_eq!(costs.matches(" ms, ").count(), 5, "{costs}");
}

/// Another file replaces the open one; one that cannot be read changes nothing.
#[test]
fn a_dropped_file_is_shown_instead() {
    let folder = folder();
    let other = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/thick-walls.glb");
    let script = format!(
        "rest\npanel closed\ndrop missing.glb\nrest\ngrab a.png\ndrop {other}\nrest\nkey C\ngrab b.png\nkey R\nrest\ngrab c.png\nquit"
    );
    let said = viewed(folder.path(), &script);
    let command = said.lines().find(|line| line.starts_with("twobounce render")).expect("a command");
    run_printed(folder.path(), command);
    let shown = |name: &str| pixels(&folder.path().join(name));
    assert!(shown("a.png") != shown("b.png"));
    assert!(shown("b.png") == shown("image.png") && shown("b.png") == shown("c.png"), "{command}");
}

/// With a scene that can be read but not rendered, the open one stays.
#[test]
fn a_dropped_scene_that_does_not_fit_changes_nothing() {
    let folder = folder();
    let large = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/demo.glb");
    let script = format!(
        "rest\npanel closed\ngrab a.png\ndrop {large}\nrest\nturn 0.1 0\nturn -0.1 0\nrest\ngrab b.png\nkey C\npanel open\nrest\nquit"
    );
    let output = view(folder.path(), &script, &["--memory-limit", "12MiB"]);
    let said = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(said.contains("demo: triangles"), "it was not read: {said}");
    let command = said.lines().find(|line| line.starts_with("twobounce render")).expect("a command");
    assert!(command.contains("cornell-area"), "{command}");
    let shown = |name: &str| pixels(&folder.path().join(name));
    let moved = shown("a.png")
        .pixels()
        .zip(shown("b.png").pixels())
        .filter(|(a, b)| a.0.iter().zip(b.0).any(|(a, b)| a.abs_diff(b) > 2))
        .count();
    assert!(moved < 60, "{moved} pixels differ: the eye did not come back");
}

/// Saved GLSL is used at once; where it has an error, the last picture stays, and the error is shown.
#[cfg(feature = "hot-reload")]
#[test]
fn saved_shaders_are_shown() {
    let folder = folder();
    let glsl = folder.path().join("glsl");
    copy(&Path::new(env!("CARGO_MANIFEST_DIR")).join("glsl"), &glsl);
    let file = glsl.join("ground/image/image.comp");
    let good = std::fs::read_to_string(&file).unwrap();
    let shown = "imageStore(shaded[0], at, shown.beauty);";
    let dark = good.replacen(shown, "imageStore(shaded[0], at, 0.5 * shown.beauty);", 1);
    let broken = dark.replacen("0.5 * shown", "nothing * shown", 1);
    let line = good.lines().position(|line| line.contains(shown)).expect("the image is stored") + 1;
    // Each change is saved after the window has shown the one before.
    let saves = [("a.png", dark), ("b.png", broken), ("c.png", good)];
    let shown = folder.path().to_owned();
    let editor = std::thread::spawn(move || {
        for (before, text) in saves {
            let since = std::time::Instant::now();
            while !shown.join(before).exists() {
                assert!(since.elapsed().as_secs() < 120, "there is no {before}");
                std::thread::sleep(std::time::Duration::from_millis(20));
            }
            std::fs::write(&file, text).unwrap();
        }
    });
    let script = "rest\npanel closed\ngrab a.png\nreload\nrest\ngrab b.png\nreload\nrest\ngrab c.png\nreload\nrest\ngrab d.png\nquit";
    let output = view(folder.path(), script, &["--glsl", "glsl", "--exposure", "0"]);
    let (said, errors) = (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
    assert_eq!(output.status.code(), Some(0), "{errors}");
    editor.join().unwrap();
    let [a, b, c, d] = ["a.png", "b.png", "c.png", "d.png"].map(|name| pixels(&folder.path().join(name)));
    let sum = |image: &image::RgbImage| image.as_raw().iter().map(|&code| u64::from(code)).sum::<u64>();
    assert!(sum(&b) < sum(&a) * 9 / 10, "{} is not darker than {}", sum(&b), sum(&a));
    assert!(b != c, "the error is shown over the picture");
    assert!(a == d, "what was saved last is what the program was built of");
    assert!(errors.contains(&format!("image.comp:{line}: error: 'nothing'")), "{errors}");
    assert!(said.contains("shaders compiled anew"), "{said}");
}

#[cfg(feature = "hot-reload")]
fn copy(from: &Path, to: &Path) {
    std::fs::create_dir(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        let there = to.join(path.file_name().unwrap());
        if path.is_dir() {
            copy(&path, &there);
        } else {
            std::fs::copy(&path, there).unwrap();
        }
    }
}
