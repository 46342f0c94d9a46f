//! Work that several machines share, as two processes: the joined parts equal the whole bit for bit, times excepted,
//! and a killed worker loses nothing and repeats nothing.

use std::collections::BTreeSet;
use std::fs;
use std::process::Stdio;
use std::time::{Duration, Instant};

use crate::cli_common::{Folder, after_first_row, finished, names, root, text};
use crate::more;
use serde_json::Value;

fn box_path() -> String {
    root().join("assets/cornell-point.glb").display().to_string()
}

/// A row without its times and without its machine.
fn lasting(row: &Value) -> Value {
    let mut row = row.clone();
    row["origin"] = Value::Null;
    for time in ["frames", "frame_gpu_ms", "frame_cpu_ms", "frame_wall_ms", "passes", "seconds"] {
        row["measured"].as_object_mut().unwrap().remove(time);
    }
    row
}

const SMALL: [&str; 8] =
    ["--size", "16x16", "--set", "voxels=16", "--presets", "fast,printed", "--reference-noise", "20"];
const MORE: [&str; 6] = ["--sweep", "rays.diffuse=1,2,6,7", "--paths", "1,4", "--import", "Other=other.exr,5"];

fn chart<'a>(scene: &'a str, output: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&["chart", scene, "-o", output][..], &SMALL, &MORE, more].concat()
}

#[test]
fn parts_of_a_chart_are_the_whole_one() {
    let (folder, scene) = (Folder::empty(), box_path());
    let other = ["render", &scene, "-q", "-o", "other.exr", "--aov", "direct"];
    folder.done(&[&other[..], &SMALL[..4]].concat());
    folder.done(&chart(&scene, "whole", &[]));
    let one = folder
        .command(&chart(&scene, "part.1", &["--shard", "1/2", "--machine", "anna"]))
        .stdout(Stdio::null())
        .spawn();
    let mut one = one.unwrap();
    // The other worker is killed in the middle, and started again.
    let second = chart(&scene, "part.2", &["--shard", "2/2", "--machine", "bert"]);
    let mut killed = after_first_row(&mut folder.command(&second), &folder.path("part.2"));
    killed.kill().unwrap();
    killed.wait().unwrap();
    let before = finished(&folder.path("part.2"));
    folder.done(&second);
    let after = finished(&folder.path("part.2"));
    assert!(before.iter().all(|row| after.contains(row)), "a finished row was measured anew");
    assert!(one.wait().unwrap().success());

    let whole = folder.rows("whole");
    let parts = ["part.1", "part.2"].map(|part| folder.rows(part));
    let keys = |rows: &[Value]| rows.iter().map(|row| row["key"].to_string()).collect::<BTreeSet<_>>();
    assert!(keys(&parts[0]).is_disjoint(&keys(&parts[1])), "a row was made twice");
    assert!(parts.iter().all(|part| !part.is_empty()), "one worker had nothing to do");
    let page = fs::read_to_string(folder.path("part.1/index.html")).unwrap();
    assert!(page.contains("This is part 1 of 2 of a chart."), "a part does not say that it is one");

    let said = folder.done(&["merge", "part.2", "part.1", "-o", "merged"]);
    assert!(said.contains(&format!("rows: {}, of 2 folders", whole.len())), "{said}");
    let merged = folder.rows("merged");
    assert_eq!(merged.iter().map(lasting).collect::<Vec<_>>(), whole.iter().map(lasting).collect::<Vec<_>>());
    let machines: BTreeSet<_> = merged.iter().filter_map(|row| row["origin"]["machine"].as_str()).collect();
    assert_eq!(machines, ["anna", "bert"].into());
    // Each machine has its own frontier, in both panels.
    let frontiers = |folder: &Folder, name| {
        fs::read_to_string(folder.path(name)).unwrap().matches("<polyline class=\"frontier\"").count()
    };
    assert_eq!(frontiers(&folder, "merged/chart.svg"), 2 * 2);
    folder.done(&["merge", "part.1", "part.2", "-o", "mixed", "--mix-machines"]);
    assert_eq!(frontiers(&folder, "mixed/chart.svg"), 2);
    let mixed = fs::read_to_string(folder.path("mixed/index.html")).unwrap();
    assert!(mixed.contains("\"mix_machines\":true"), "the page does not know that machines are mixed");

    // The command without --shard finds nothing left to do.
    let said = folder.done(&chart(&scene, "merged", &[]));
    assert!(said.contains(&format!("rows kept from earlier calls: {0} of {0}", whole.len())), "{said}");

    // Rows of other machines with these keys: the first times stay, the others become history; other errors are
    // refused.
    let said = folder.done(&["merge", "merged", "whole", "-o", "both", "--history"]);
    // The time of the import was given, so it is the same in every folder.
    let timed = whole.len() - 1;
    assert!(said.contains(&format!("measured on several machines or at several times: {timed}")), "{said}");
    assert_eq!(folder.rows("both"), merged);
    assert_eq!(names(&folder.path("both/history")).len(), timed);
    let (file, bytes) = &after[0];
    let other = text(bytes).replacen("\nrel = 0.", "\nrel = 1.", 1);
    assert_ne!(other.as_bytes(), &bytes[..], "nothing was changed");
    fs::write(file, other).unwrap();
    let said = folder.refused(&["merge", "whole", "part.2", "-o", "wrong"]);
    assert!(said.contains("1 rows were found differently") && said.contains("whole and part.2"), "{said}");
    assert!(!folder.path("wrong").exists(), "a folder was left behind");
}

#[test]
fn parts_of_a_table_of_stability_are_the_whole_one() {
    let folder = Folder::empty();
    let cells = ["--case", "self-light-plane,leak-1/2", "--preset", "fast", "--grid", "16,32", "--quick"];
    let stability = |more: &[&str]| folder.done(&[&["stability"][..], &cells, more].concat());
    stability(&["-o", "whole"]);
    let listed = stability(&["-o", "part", "--list", "2"]);
    let commands: Vec<&str> = listed.lines().collect();
    assert_eq!(commands.len(), 2, "{listed}");
    for (i, command) in commands.iter().enumerate() {
        let words: Vec<&str> = command.split(' ').skip(1).collect();
        assert!(words.contains(&format!("part.{}", i + 1).as_str()), "{command}");
        folder.done(&words);
    }
    let parts: Vec<String> = (1..=2).map(|i| format!("part.{i}")).filter(|part| folder.path(part).exists()).collect();
    let parts: Vec<&str> = parts.iter().map(String::as_str).collect();
    folder.done(&[&["merge"][..], &parts, &["-o", "merged"]].concat());
    let read = |name: &str| fs::read_to_string(folder.path(name)).unwrap();
    assert_eq!(read("merged/rows.csv"), read("whole/rows.csv"));
    let rows = |name| folder.rows(name).iter().map(lasting).collect::<Vec<_>>();
    assert_eq!(rows("merged"), rows("whole"));
}

#[test]
fn samples_of_a_reference_add_up_to_the_same_bytes() {
    let (folder, scene) = (Folder::empty(), box_path());
    let start = ["reference", &scene, "--size", "20x12", "--aov", "direct,depth,albedo,normal,diffuse"];
    let with = |more: &'static [&str]| [&start[..], more].concat();
    folder.done(&with(&["--spp", "48", "-o", "whole.exr"]));
    let listed = folder.run(&with(&["--samples", "0-47", "--list", "3", "-o", "part.film"]));
    let commands = text(&listed.stdout);
    assert!(text(&listed.stderr).contains("twobounce merge part.1.film part.2.film part.3.film -o part.film"));
    for command in commands.lines().rev() {
        folder.done(&command.split(' ').skip(1).collect::<Vec<_>>());
    }
    assert_eq!(commands.lines().count(), 3, "{commands}");
    folder.done(&["merge", "part.2.film", "part.3.film", "-o", "rest.film"]);
    folder.done(&["merge", "rest.film", "part.1.film", "-o", "merged.exr"]);
    let read = |name: &str| fs::read(folder.path(name)).unwrap();
    assert!(read("merged.exr") == read("whole.exr"), "merged films are another image");

    // A killed worker continues with the samples that it has.
    let long = ["reference", &scene, "--size", "64x64", "--samples", "16-3999", "-o", "long.film"];
    let mut child = folder.command(&long).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    std::thread::sleep(Duration::from_secs(3));
    // SAFETY: the child has not been waited for, so its process number is still its own.
    assert_eq!(unsafe { libc::kill(child.id() as i32, libc::SIGTERM) }, 0);
    let code = child.wait().unwrap().code();
    if code == Some(143) {
        assert!(!folder.path("long.film").exists(), "half a film was written");
        let kept = names(&folder.path("cache")).into_iter().filter(|name| name.contains("-16.film")).count();
        assert_eq!(kept, 2, "finished samples are not kept beside those of part 2");
    } else {
        assert_eq!(code, Some(0), "the work was done before it was stopped");
    }

    for (args, part) in [
        (&["merge", "part.1.film", "part.3.film", "-o", "x.exr"][..], "samples 16-31 are in none of the films"),
        (&["merge", "part.1.film", "part.1.film", "-o", "x.exr"], "is in another film too"),
        (&["merge", "rest.film", "-o", "x.exr"], "samples 0-15 are in none of the films"),
        (&["merge", "whole.exr", "-o", "x.exr"], "whole.exr: is no film"),
        (&["merge", "part.1.film", "-o", "x.png"], "x.png: is no .film and no .exr"),
        (&["merge", "none", "-o", "x"], "none: does not exist"),
        (
            &["reference", "scene.glb", "--samples", "3-1", "-o", "x.film"],
            "the numbers of the first and the last sample",
        ),
        (&["reference", "scene.glb", "--samples", "0-1", "-o", "x.exr"], "x.exr: is no .film"),
    ] {
        let said = folder.refused(args);
        assert!(said.contains(part), "{args:?}: {said}");
        assert!(!folder.path("x.exr").exists() && !folder.path("x").exists(), "{args:?} left something behind");
    }
}

#[test]
fn frames_are_those_of_the_whole_sequence() {
    let folder = Folder::empty();
    let render = |pattern: &str, more: &[&str]| {
        let all = ["render", "demo:", "-o", pattern, "--size", "24x16", "--set", "voxels=16", "--fps", "1"];
        folder.done(&[&all[..], more].concat())
    };
    fs::create_dir(folder.path("whole")).unwrap();
    fs::create_dir(folder.path("part")).unwrap();
    // The shadow cones of `printed` turn with time, not with the number of earlier frames.
    for preset in more::every(2, ["fast", "photons", "printed"]) {
        render("whole/%02d.png", &["--preset", preset, "--frames", "4"]);
        let listed = render("part/%02d.png", &["--preset", preset, "--frames", "0-3:1", "--list", "2"]);
        let commands: Vec<Vec<&str>> = listed.lines().map(|line| line.split(' ').skip(1).collect()).collect();
        assert_eq!(commands.len(), 2, "{listed}");
        commands.iter().for_each(|command| drop(folder.done(command)));
        assert_eq!(names(&folder.path("part")).len(), 4);
        for name in names(&folder.path("whole")) {
            let read = |at: &str| fs::read(folder.path(at).join(&name)).unwrap();
            assert!(read("whole") == read("part"), "{name} of {preset} is another one when its part begins later");
        }
    }
    fs::create_dir(folder.path("few")).unwrap();
    render("few/%02d.png", &["--preset", "fast", "--frames", "1-3:2"]);
    assert_eq!(names(&folder.path("few")), ["01.png", "03.png"]);
    let said = folder.refused(&["render", "demo:", "-o", "%d.png", "--frames", "1-5", "--set", "bounces=all"]);
    assert!(said.contains("each frame goes on from the one before it"), "{said}");
    let said = folder.refused(&["render", "demo:", "-o", "%d.png", "--frames", "5-1"]);
    assert!(said.contains("such as 60, 0-59 or 0-59:2"), "{said}");
}

/// Two processes that need the same reference trace it once.
#[test]
fn a_reference_is_traced_by_one_of_two() {
    let (folder, scene) = (Folder::empty(), box_path());
    let start = Instant::now();
    let reference = |name: &str| {
        let mut command = folder.command(&["reference", &scene, "--size", "48x48", "--spp", "256", "-o", name]);
        command.stdout(Stdio::piped()).spawn().unwrap()
    };
    let both = [reference("a.exr"), reference("b.exr")].map(|child| text(&child.wait_with_output().unwrap().stdout));
    let cached = both.iter().filter(|said| said.contains("taken from the cache")).count();
    assert_eq!(cached, 1, "both traced it in {:?}: {both:?}", start.elapsed());
    assert!(names(&folder.path("cache")).iter().all(|name| !name.ends_with(".lock")), "a lock is left");
}
