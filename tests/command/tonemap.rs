//! Images for a display, by every command that writes them.

use std::fs;

use crate::cli_common::Folder;
use twobounce::layers::Layers;
use twobounce::output::display::{Display, ToneMap};

const SCENE: &str = "box.glb";
const SMALL: [&str; 3] = ["--size=24x16", "--preset=fast", "--set=voxels=16"];

fn bytes(folder: &Folder, name: &str) -> Vec<u8> {
    fs::read(folder.path(name)).unwrap()
}

#[test]
fn an_exr_is_shown_as_the_image_itself_is() {
    let folder = Folder::with_box(SCENE);
    let render = |more: &[&str]| folder.done(&[&["render", SCENE, "--noise=off"], &SMALL[..], more].concat());
    render(&["-o", "a.exr"]);
    for tone in ToneMap::ALL.iter().map(|tone| tone.name()) {
        for ending in ["png", "jpg"] {
            let [own, made, other] = ["own", "made", "other"].map(|name| format!("{name}.{ending}"));
            let said = render(&["-o", &own, "--tonemap", tone]);
            let told = folder.done(&["tonemap", "a.exr", "-o", &made, "--tonemap", tone]);
            let exposure = |said: &str| said.lines().find(|line| line.starts_with("exposure: ")).unwrap().to_owned();
            assert_eq!(exposure(&said), exposure(&told), "{tone}");
            assert!(bytes(&folder, &own) == bytes(&folder, &made), "{tone}, {ending}");
            folder.done(&["tonemap", "a.exr", "-o", &other, "--tonemap", tone, "--exposure=-3"]);
            assert!(bytes(&folder, &own) != bytes(&folder, &other), "{tone}, {ending}");
        }
    }
    for (args, part) in [
        (&["tonemap", "a.exr", "-o", "b.exr"][..], ".png or .jpg"),
        (&["tonemap", "none.exr", "-o", "b.png"], "none.exr"),
        (&["tonemap", SCENE, "-o", "b.png"], SCENE),
    ] {
        let said = folder.refused(args);
        assert!(said.contains(part), "{args:?}: {said}");
        assert!(!folder.path("b.png").exists());
    }
}

#[test]
fn references_are_shown_too() {
    let folder = Folder::with_box(SCENE);
    let trace = |more: &[&str]| folder.done(&[&["reference", SCENE, "--size=24x16", "--spp=4"], more].concat());
    trace(&["-o", "r.exr"]);
    let (image, _) = Layers::read_exr(&folder.path("r.exr")).unwrap();
    for name in ["r.png", "r.jpg"] {
        trace(&["-o", name]);
        image.write_shown(&folder.path("own.png"), Display::automatic(ToneMap::Neutral, image.beauty())).unwrap();
        image.write_shown(&folder.path("own.jpg"), Display::automatic(ToneMap::Neutral, image.beauty())).unwrap();
        assert!(bytes(&folder, name) == bytes(&folder, &name.replace('r', "own")), "{name}");
    }
    for (more, part) in [
        (&["-o", "a.png", "--aov=direct"][..], ".exr"),
        (&["-o", "a.exr", "--exposure=1"], ".png"),
        (&["-o", "a.jpg", "--transparent"], "transparent"),
        (&["-o", "a.tiff"], ".exr, .png or .jpg"),
        (&["-o", "a.png", "--samples=0-3"], ".film"),
    ] {
        let said = folder.refused(&[&["reference", SCENE], more].concat());
        assert!(said.contains(part), "{more:?}: {said}");
    }
}
