//! The metrics against NumPy, and their response to deliberate faults in an image.

use twobounce::layers::{Aov, Layers};
use twobounce::measure::metrics::{Comparison, compare};
use twobounce::measure::terms::Subtract;

const WIDTH: u32 = 96;
const HEIGHT: u32 = 64;

fn image(value: impl Fn(u32, u32, u32) -> f32) -> Vec<[f32; 3]> {
    let pixel = |i: u32| std::array::from_fn(|c| value(i % WIDTH, i / WIDTH, c as u32));
    (0..WIDTH * HEIGHT).map(pixel).collect()
}

/// The exact values of `metrics_values.py`: beauty and direct of the reference, then of the image.
fn pair() -> [Layers; 2] {
    let reference = |x: u32, y: u32, c: u32| ((x * x + 3 * y * y + 5 * c) / 40 % 61 + 1) as f32 / 32.0;
    let direct = move |x: u32, y: u32, c: u32| reference(x, y, c) * ((x + y) % 4) as f32 / 8.0;
    let off = |x: u32, y: u32, c: u32| ((7 * x + 11 * y + 3 * c) % 17) as f32 / 256.0 - 6.0 / 256.0;
    let direct_off = |x: u32, y: u32, c: u32| ((5 * x + 3 * y + c) % 7) as f32 / 512.0 - 3.0 / 512.0;
    let mut a = Layers::new(WIDTH, HEIGHT, image(reference));
    a.layers.push((Aov::Direct, image(direct)));
    let mut b = Layers::new(WIDTH, HEIGHT, image(|x, y, c| reference(x, y, c) + off(x, y, c)));
    b.layers.push((Aov::Direct, image(|x, y, c| direct(x, y, c) + direct_off(x, y, c))));
    [a, b]
}

/// A scene-like image: smooth shading, an edge, colours, a bright lamp.
fn picture() -> Layers {
    let shade = |x: u32, y: u32, c: u32| {
        let lamp = if (40..50).contains(&x) && y < 6 { 12.0 } else { 0.0 };
        let wall = if x < 30 { [0.6, 0.1, 0.05][c as usize] } else { [0.4, 0.45, 0.5][c as usize] };
        wall * (0.2 + y as f32 / HEIGHT as f32 + (x as f32 / 9.0).sin().abs()) + lamp
    };
    Layers::new(WIDTH, HEIGHT, image(shade))
}

fn changed(layers: &Layers, change: impl Fn(&Layers, u32, u32) -> [f32; 3]) -> Layers {
    let pixels = (0..WIDTH * HEIGHT).map(|i| change(layers, i % WIDTH, i / WIDTH)).collect();
    Layers::new(WIDTH, HEIGHT, pixels)
}

fn at(layers: &Layers, x: u32, y: u32) -> [f32; 3] {
    layers.beauty()[(y * WIDTH + x) as usize]
}

fn compared(image: &Layers, reference: &Layers) -> Comparison {
    compare(image, reference, Subtract::Own).expect("the images can be compared")
}

#[test]
fn ten_values_agree_with_numpy() {
    let [reference, image] = pair();
    let c = compared(&image, &reference);
    let text = include_str!("metrics_values.json");
    let expected: serde_json::Value = serde_json::from_str(text).expect("the values are JSON");
    let indirect = c.indirect.expect("both have a direct layer");
    let mut values = vec![("exposure", None, c.exposure as f64), ("flip", None, c.flip)];
    for (part, m) in [("total", c.total), ("indirect", indirect)] {
        let numbers = [("energy", m.energy), ("rel", m.rel), ("relmse", m.relmse), ("p95", m.p95)];
        values.extend(numbers.map(|(name, value)| (name, Some(part), value)));
    }
    assert_eq!(values.len(), 10);
    for (name, part, value) in values {
        let expected = part.map_or(&expected, |p| &expected[p])[name].as_f64().expect("a number");
        // f32 pixels; FLIP itself computes in f32.
        assert!((value / expected - 1.0).abs() < 1e-5, "{part:?} {name}: {value}, NumPy {expected}");
    }
}

#[test]
fn an_image_equals_itself() {
    let c = compared(&picture(), &picture());
    assert_eq!((c.total.energy, c.total.rel, c.total.relmse, c.total.p95, c.flip), (1.0, 0.0, 0.0, 0.0, 0.0));
    assert!(c.indirect.is_none(), "there is no direct layer to subtract");
}

#[test]
fn a_dropped_pi_shows_in_energy() {
    let reference = picture();
    let faulty = changed(&reference, |l, x, y| at(l, x, y).map(|v| v / std::f32::consts::PI));
    let c = compared(&faulty, &reference);
    assert!((c.total.energy * std::f64::consts::PI - 1.0).abs() < 1e-6, "{}", c.total.energy);
    assert!((c.total.rel - (1.0 - c.total.energy)).abs() < 1e-6 && c.flip > 0.1, "{c:?}", c = c.total);
}

#[test]
fn swapped_axes_show_though_energy_stays() {
    let reference = picture();
    // Mirrored left to right, and red swapped with blue: the effects of swapped axes on positions and on normals as
    // colours.
    let mirrored = changed(&reference, |l, x, y| at(l, WIDTH - 1 - x, y));
    let swapped = changed(&reference, |l, x, y| {
        let [r, g, b] = at(l, x, y);
        [b, g, r]
    });
    for faulty in [mirrored, swapped] {
        let c = compared(&faulty, &reference);
        assert!((c.total.energy - 1.0).abs() < 1e-6, "energy cannot see it");
        assert!(
            c.total.rel > 0.1 && c.total.relmse > 0.1 && c.total.p95 > 0.5 && c.flip > 0.1,
            "{:?} {}",
            c.total,
            c.flip
        );
    }
}

#[test]
fn a_shift_by_one_pixel_shows() {
    let reference = picture();
    let faulty = changed(&reference, |l, x, y| at(l, x.saturating_sub(1), y));
    let c = compared(&faulty, &reference);
    assert!(c.total.rel > 0.02 && c.total.relmse > 0.002 && c.flip > 0.01, "{:?} {}", c.total, c.flip);
}

#[test]
fn one_wrong_row_shows_in_the_mean_but_not_in_p95() {
    let reference = picture();
    let faulty = changed(&reference, |l, x, y| if y == 20 { [0.0; 3] } else { at(l, x, y) });
    let c = compared(&faulty, &reference);
    assert!(c.total.rel > 0.005 && c.total.p95 == 0.0, "{:?}", c.total);
}

#[test]
fn each_image_subtracts_its_own_direct_layer() {
    let [reference, image] = pair();
    let mut faulty = image.clone();
    faulty.layers[1].1 = reference.layers[1].1.clone();
    let (own, others) = (compared(&image, &reference).indirect, compared(&faulty, &reference).indirect);
    assert!(own.is_some() && own != others, "the direct layer of the wrong image was subtracted");
}

/// Metal in the left half, wholly diffuse in the right half, with a column of edge pixels between.
fn half_metal() -> Layers {
    let mut layers = picture();
    let direct = layers.beauty().iter().map(|p| p.map(|v| v / 4.0)).collect();
    let share = |x: u32| [0.0, 0.998, 1.0][1 + x.cmp(&(WIDTH / 2)) as usize];
    layers.layers.push((Aov::Direct, direct));
    layers.layers.push((Aov::Diffuse, image(|x, _, _| share(x))));
    layers
}

#[test]
fn only_faults_on_diffuse_surfaces_show_in_their_metrics() {
    let reference = half_metal();
    let with_fault = |column: u32| {
        let mut faulty = reference.clone();
        faulty.layers[0].1[(20 * WIDTH + column) as usize] = [9.0; 3];
        // The reference's diffuse layer selects the pixels.
        faulty.layers.retain(|(aov, _)| *aov != Aov::Diffuse);
        let c = compared(&faulty, &reference);
        (c.indirect.expect("both have direct layers"), c.indirect_diffuse.expect("the reference has a diffuse layer"))
    };
    let (metal, edge, diffuse) = (with_fault(3), with_fault(WIDTH / 2), with_fault(WIDTH - 3));
    for (indirect, of_diffuse) in [metal, edge] {
        assert!(indirect.rel > 1e-3 && indirect.relmse > 1e-3 && indirect.energy > 1.001, "{indirect:?}");
        assert_eq!((of_diffuse.energy, of_diffuse.rel, of_diffuse.relmse, of_diffuse.p95), (1.0, 0.0, 0.0, 0.0));
    }
    let (indirect, of_diffuse) = diffuse;
    assert!(indirect.rel > 1e-3 && of_diffuse.rel > indirect.rel, "{indirect:?} {of_diffuse:?}");
    assert!(of_diffuse.relmse > indirect.relmse && of_diffuse.energy > indirect.energy, "{indirect:?} {of_diffuse:?}");
}

#[test]
fn without_diffuse_surfaces_their_metrics_are_absent() {
    let mut reference = half_metal();
    reference.layers[2].1.fill([0.99; 3]);
    assert!(compared(&reference, &reference).indirect_diffuse.is_none(), "no pixel is wholly diffuse");
    reference.layers[2].1.fill([1.0; 3]);
    assert_eq!(compared(&reference, &reference).indirect_diffuse, compared(&reference, &reference).indirect);
    reference.layers.remove(1);
    assert!(compared(&reference, &reference).indirect_diffuse.is_none(), "there is no direct layer to subtract");
}

#[test]
fn non_finite_values_are_counted_and_excluded() {
    let reference = picture();
    let faulty = changed(&reference, |l, x, y| match (x, y) {
        (3, 4) => [f32::NAN, 1.0, f32::NAN],
        (5, 6) => [f32::INFINITY, 0.0, 0.0],
        _ => at(l, x, y),
    });
    let c = compared(&faulty, &reference);
    assert_eq!((c.image.nan, c.image.inf, c.reference.count()), (2, 1, 0));
    assert_eq!((c.total.energy, c.total.rel), (1.0, 0.0));
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let reference = picture();
    let refused =
        |image: &Layers, reference: &Layers| compare(image, reference, Subtract::Own).expect_err("refused").to_string();
    let small = Layers::new(2, 2, vec![[1.0; 3]; 4]);
    assert_eq!(refused(&small, &reference), "the image is 2x2, the reference 96x64; render both at the same size");
    let nowhere = changed(&reference, |_, _, _| [f32::NAN; 3]);
    assert_eq!(refused(&nowhere, &reference), "the image has no finite pixel; render it again");
    assert_eq!(refused(&reference, &nowhere), "the reference has no finite pixel; render it again");
    let black = changed(&reference, |_, _, _| [0.0; 3]);
    assert_eq!(
        refused(&reference, &black),
        "the reference is black, so relative errors are undefined; light the scene"
    );
}
