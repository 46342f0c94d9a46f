//! The error of the renderer's approximation of clearcoat, sheen, anisotropy, iridescence, diffuse transmission and
//! dispersion.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};
use twobounce::lab::specimen::Specimen;
use twobounce::layers::{Aov, Layers};
use twobounce::measure::metrics::{compare, metrics};
use twobounce::measure::picture::side_by_side;
use twobounce::measure::terms::Subtract;
use twobounce::output::file;
use twobounce::reference::{Depth, Stop};
use twobounce::renderer::RenderOptions;
use twobounce::scene::finish::{Anisotropy, Clearcoat, DiffuseTransmission, Finish, Iridescence, Sheen};
use twobounce::scene::{Material, Mesh, Scene, View};
use twobounce::settings::Settings;
use twobounce::vk::{Context, ContextOptions};
use twobounce::{Error, Result};

const SIZE: u32 = 96;
const SAMPLES: u32 = 192;
/// The albedo of the measured material: no other surface has it, so the albedo layer tells its pixels.
const BASE: Vec3 = Vec3::new(0.7, 0.4, 0.25);

/// The start of the table in the page.
pub const HEADING: &str = "\n## Numbers\n";

/// Writes the table of the page. `folder`: for the pictures behind the numbers; `chosen`: the start of the names of
/// scenes to measure; the other lines stay.
pub fn run(folder: Option<PathBuf>, chosen: &str) -> Result<()> {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/materials.md");
    let before = std::fs::read_to_string(&page).map_err(|e| Error::file(&page, e.to_string()))?;
    let context = Context::new(&ContextOptions::default())?;
    let mut table = String::from(
        "\n| scene | `rel` | energy | `rel` on the material | energy on the material |\n|---|---:|---:|---:|---:|\n",
    );
    for scene in scenes() {
        let kept = before.lines().find(|line| line.starts_with(&format!("| {} |", scene.name)));
        if let Some(line) = kept.filter(|_| !scene.name.starts_with(chosen)) {
            table += &format!("{line}\n");
            continue;
        }
        let truth = traced(&scene, SIZE, SAMPLES)?;
        let image = rendered(&context, &scene, SIZE)?;
        let line = row(&scene.name, &image, &truth)?;
        print!("{line}");
        table += &line;
        if let Some(folder) = &folder {
            let png = side_by_side(&image, &truth, &compare(&image, &truth, Subtract::Own)?)?;
            file::write(&folder.join(format!("{}.png", scene.name.replace([' ', ','], "-"))), &png)?;
        }
    }
    let opening = before.split(HEADING).next().unwrap_or_default();
    file::write(&page, format!("{opening}{HEADING}{table}").as_bytes())
}

/// Numbers over the whole image, and over the pixels that show the material alone.
pub fn row(name: &str, image: &Layers, truth: &Layers) -> Result<String> {
    let shows = |i: usize| [image, truth].iter().all(|l| albedo(l)[i].abs_diff_eq(BASE, 2e-3));
    let on_it = |layers: &Layers| -> Vec<[f32; 3]> {
        layers.beauty().iter().enumerate().filter(|(i, _)| shows(*i)).map(|(_, pixel)| *pixel).collect()
    };
    let all = metrics(image.beauty(), truth.beauty(), "reference")?;
    let own = metrics(&on_it(image), &on_it(truth), "reference")?;
    Ok(format!("| {name} | {:.3} | {:.3} | {:.3} | {:.3} |\n", all.rel, all.energy, own.rel, own.energy))
}

fn albedo(layers: &Layers) -> Vec<Vec3> {
    layers.get(Aov::Albedo).expect("the layer").iter().map(|&p| Vec3::from(p)).collect()
}

/// A scene as the page names it.
fn specimen(scene: &Scene) -> Specimen {
    let view = View::look_at(DVec3::new(0.0, 0.1, 3.3), DVec3::new(0.0, -0.1, 0.0), DVec3::Y, 40f32.to_radians());
    Specimen { view, ..Specimen::new(scene.clone()) }
}

pub fn rendered(context: &Arc<Context>, scene: &Scene, size: u32) -> Result<Layers> {
    let specimen = specimen(scene);
    let options = RenderOptions { aovs: vec![Aov::Albedo], ..specimen.options((size, size)) };
    specimen.rendered(context, &Settings::default(), options)
}

pub fn traced(scene: &Scene, size: u32, samples: u32) -> Result<Layers> {
    let film = specimen(scene).traced((size, size), Depth::Full, Stop::Samples(samples))?;
    Ok(film.layers(&[Aov::Albedo]))
}

/// A room with two objects of each material, the second with another parameter.
pub fn scenes() -> Vec<Scene> {
    let plastic = Material { specular: 1.0, roughness: 0.6, ..Material::lambert("base", BASE) };
    let metal = Material { metallic: 1.0, ..plastic.clone() };
    let with = |material: &Material, roughness: f32, finish: Finish| Material {
        roughness,
        finish: Some(Box::new(finish)),
        ..material.clone()
    };
    let coat = |roughness: f32| {
        let clearcoat = Clearcoat { factor: 1.0, roughness, ..Clearcoat::default() };
        with(&plastic, 0.6, Finish { clearcoat, ..Finish::default() })
    };
    let velvet = |roughness: f32| {
        let sheen = Sheen { color: Vec3::new(0.9, 0.8, 1.0), roughness, ..Sheen::default() };
        with(&Material { specular: 0.0, ..plastic.clone() }, 1.0, Finish { sheen, ..Finish::default() })
    };
    let brushed = |strength: f32, roughness: f32| {
        let anisotropy = Anisotropy { strength, ..Anisotropy::default() };
        with(&metal, roughness, Finish { anisotropy, ..Finish::default() })
    };
    let filmed = |base: &Material, nm: f32, roughness: f32| {
        let iridescence = Iridescence { factor: 1.0, ior: 1.5, thickness_nm: [nm, nm], ..Iridescence::default() };
        with(base, roughness, Finish { iridescence, ..Finish::default() })
    };
    let leaf = |factor: f32| {
        let diffuse_transmission =
            DiffuseTransmission { factor, color: Vec3::new(0.9, 0.8, 0.3), ..DiffuseTransmission::default() };
        let base = Material { double_sided: true, specular: 0.0, ..plastic.clone() };
        with(&base, 1.0, Finish { diffuse_transmission, ..Finish::default() })
    };
    let glass = |dispersion: f32| {
        let base = Material { transmission: 1.0, thickness: 0.5, ..plastic.clone() };
        with(&base, 0.0, Finish { dispersion, ..Finish::default() })
    };
    let plain = |material: &Material, roughness: f32| with(material, roughness, Finish::default());
    vec![
        room("none of them, dielectric", [plain(&plastic, 0.6), plain(&plastic, 0.2)], false),
        room("none of them, metal", [plain(&metal, 0.5), plain(&metal, 0.2)], false),
        room("clearcoat, smooth and rough", [coat(0.0), coat(0.4)], false),
        room("sheen, roughness 0.3 and 0.8", [velvet(0.3), velvet(0.8)], false),
        room("anisotropy, strength 0.5 and 0.9", [brushed(0.5, 0.3), brushed(0.9, 0.2)], false),
        room("iridescence, dielectric and metal", [filmed(&plastic, 350.0, 0.2), filmed(&metal, 550.0, 0.2)], false),
        room("diffuse transmission, 0.5 and 1", [leaf(0.5), leaf(1.0)], true),
        room("glass, no dispersion", [glass(0.0), glass(0.0)], false),
        room("dispersion, 1 and 10", [glass(1.0), glass(10.0)], false),
    ]
}

/// Two balls, or two sheets that hang before the lamp, in a room whose front is open.
fn room(name: &str, materials: [Material; 2], sheets: bool) -> Scene {
    let mut scene = Scene::empty(name);
    let mut wall = |name: &str, albedo: Vec3, corner: Vec3, u: Vec3, v: Vec3| {
        let material = scene.add_material(Material::lambert(name, albedo));
        scene.add_mesh(Mesh::quad(name, material, corner, u, v), DAffine3::IDENTITY);
    };
    let [x, y, z] = [2.0 * Vec3::X, 2.0 * Vec3::Y, 2.0 * Vec3::Z];
    wall("floor", Vec3::splat(0.5), Vec3::new(-1.0, -1.0, 1.0), x, -z);
    wall("back", Vec3::splat(0.6), Vec3::new(-1.0, -1.0, -1.0), x, y);
    wall("left", Vec3::new(0.6, 0.1, 0.08), Vec3::new(-1.0, -1.0, 1.0), -z, y);
    wall("right", Vec3::new(0.15, 0.45, 0.1), Vec3::new(1.0, -1.0, -1.0), z, y);
    wall("ceiling", Vec3::splat(0.7), Vec3::new(-1.0, 1.0, -1.0), x, z);
    scene.sky = Vec3::splat(0.3);
    let lamp = scene.add_material(Material::lamp("lamp", Vec3::splat(12.0)));
    let (corner, depth) = if sheets { (-0.9, 0.3) } else { (0.2, 0.5) };
    let lamp = Mesh::quad("lamp", lamp, Vec3::new(-0.4, 0.98, corner), Vec3::X * 0.8, Vec3::Z * depth);
    scene.add_mesh(lamp, DAffine3::IDENTITY);
    for (material, at) in materials.into_iter().zip([-0.45, 0.45]) {
        let material = scene.add_material(material);
        let mesh = if sheets {
            Mesh::quad("sheet", material, Vec3::new(at as f32 - 0.35, -0.8, -0.2), Vec3::X * 0.7, Vec3::Y * 1.1)
        } else {
            ball(material, 0.4)
        };
        let place = DVec3::new(if sheets { 0.0 } else { at }, if sheets { 0.0 } else { -0.6 }, 0.0);
        scene.add_mesh(mesh, DAffine3::from_translation(place));
    }
    scene
}

/// A sphere with tangents along its circles of latitude.
fn ball(material: usize, radius: f32) -> Mesh {
    const RINGS: u32 = 48;
    let mut mesh = Mesh { name: "ball".into(), material, ..Mesh::default() };
    for ring in 0..=RINGS {
        for step in 0..=2 * RINGS {
            let (sin, cos) = (std::f32::consts::PI * ring as f32 / RINGS as f32).sin_cos();
            let (s, c) = (std::f32::consts::PI * step as f32 / RINGS as f32).sin_cos();
            let normal = Vec3::new(sin * s, cos, sin * c);
            mesh.positions.push(normal * radius);
            mesh.normals.push(normal);
            mesh.tangents.push(Vec4::new(c, 0.0, -s, 1.0));
            if ring < RINGS && step < 2 * RINGS {
                let (a, b) = (ring * (2 * RINGS + 1) + step, (ring + 1) * (2 * RINGS + 1) + step);
                mesh.indices.extend([a, b, b + 1, a, b + 1, a + 1]);
            }
        }
    }
    mesh.uvs = [0, 1].map(|_| vec![Vec2::ZERO; mesh.positions.len()]);
    mesh.colors = vec![Vec4::ONE; mesh.positions.len()];
    mesh
}
