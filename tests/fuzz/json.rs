//! Changes of a JSON document that leave it valid JSON.

use serde_json::{Map, Value, json};

use crate::bytes::WHOLE;
use crate::random::Random;

/// Strings that formats define, and unexpected ones.
const TEXTS: [&str; 26] = [
    "",
    "SCALAR",
    "VEC2",
    "VEC3",
    "VEC4",
    "MAT4",
    "STEP",
    "CUBICSPLINE",
    "translation",
    "weights",
    "BLEND",
    "MASK",
    "spot",
    "directional",
    "ATTRIBUTES",
    "TRIANGLES",
    "INDICES",
    "OCTAHEDRAL",
    "QUATERNION",
    "EXPONENTIAL",
    "COLOR",
    "data:,",
    "data:;base64,AAAAAAAAgD8AAIA/AACAPw==",
    "../up",
    "a\nb\u{0}\u{202e}\"{}%",
    "2.0",
];

/// Keys that documents of the corpus may lack.
const KEYS: [&str; 14] = [
    "sparse",
    "byteStride",
    "byteOffset",
    "normalized",
    "indices",
    "skin",
    "weights",
    "matrix",
    "children",
    "targets",
    "mode",
    "uri",
    "extras",
    "extensions",
];

/// A value with more entries than this is not extended: large documents have tests of their own.
const MOST_ENTRIES: usize = 300;

/// Changes up to eight places.
pub fn change(random: &mut Random, document: &mut Value) {
    for _ in 0..random.few() {
        let places = pointers(document);
        let (from, to) = (&places[random.below(places.len())], &places[random.below(places.len())]);
        let copy = document.pointer(from).cloned().unwrap_or_default();
        let many = places.len() > 20 * MOST_ENTRIES;
        if let Some(value) = document.pointer_mut(to) {
            once(random, value, copy, many);
        }
    }
}

/// The JSON pointers of all values; an escape in a key makes its value unreachable, which does not matter.
fn pointers(document: &Value) -> Vec<String> {
    fn walk(value: &Value, at: String, out: &mut Vec<String>) {
        match value {
            Value::Array(list) => list.iter().enumerate().for_each(|(i, v)| walk(v, format!("{at}/{i}"), out)),
            Value::Object(map) => map.iter().for_each(|(key, v)| walk(v, format!("{at}/{key}"), out)),
            _ => {}
        }
        out.push(at);
    }
    let mut out = Vec::new();
    walk(document, String::new(), &mut out);
    out
}

fn once(random: &mut Random, value: &mut Value, copy: Value, many: bool) {
    let kind = random.below(12);
    match (kind, &mut *value) {
        // Another value of the document, or another type.
        (0, _) if !many => *value = copy,
        (1, _) => {
            *value = [json!(null), json!(true), json!([]), json!({}), json!(0), json!("")][random.below(6)].clone()
        }
        (2, _) if !many => {
            let inner = std::mem::take(value);
            *value = (0..1 << random.below(8)).fold(inner, |inner, _| json!([inner]));
        }
        (_, Value::Number(_) | Value::Bool(_) | Value::Null) => *value = number(random, value),
        (_, Value::String(text)) => *text = string(random, text),
        (_, Value::Array(list)) => array(random, list, copy),
        (_, Value::Object(map)) => object(random, map, copy),
    }
}

fn number(random: &mut Random, old: &Value) -> Value {
    let whole = old.as_i64().unwrap_or(0);
    match random.below(6) {
        0 => json!(whole.wrapping_add(1)),
        1 => json!(whole.wrapping_sub(1)),
        2 => json!(WHOLE[random.below(WHOLE.len())]),
        3 => json!(random.below(12)),
        4 => json!(old.as_f64().unwrap_or(0.0) * [-1.0, 0.5, 1e3, 1e-30, 1e30][random.below(5)]),
        _ => json!([-1.0, 1.0, 0.5, 1e-300, 1e300, -1e39, 5120.0, 5126.0, -0.0][random.below(9)]),
    }
}

fn string(random: &mut Random, old: &str) -> String {
    match random.below(4) {
        0 => old.repeat(2),
        1 => old.chars().take(random.below(old.len() + 1)).collect(),
        _ => TEXTS[random.below(TEXTS.len())].to_owned(),
    }
}

fn array(random: &mut Random, list: &mut Vec<Value>, copy: Value) {
    match random.below(6) {
        0 => list.push(copy),
        1 if !list.is_empty() => drop(list.remove(random.below(list.len()))),
        2 if !list.is_empty() => {
            let (a, b) = (random.below(list.len()), random.below(list.len()));
            list.swap(a, b);
        }
        3 => list.truncate(random.below(list.len() + 1)),
        _ if !list.is_empty() && list.len() < MOST_ENTRIES => {
            let again = list[random.below(list.len())].clone();
            list.extend(vec![again; 1 << random.below(6)]);
        }
        _ => {}
    }
}

fn object(random: &mut Random, map: &mut Map<String, Value>, copy: Value) {
    let keys: Vec<String> = map.keys().cloned().collect();
    let some = (!keys.is_empty()).then(|| keys[random.below(keys.len())].clone());
    match (random.below(4), some) {
        (0, Some(key)) => drop(map.remove(&key)),
        (1, Some(key)) => drop(map.insert(key, copy)),
        (2, Some(key)) => {
            let (value, other) = (map.remove(&key).unwrap_or_default(), &keys[random.below(keys.len())]);
            map.insert(other.clone(), value);
        }
        _ => drop(map.insert(KEYS[random.below(KEYS.len())].to_owned(), copy)),
    }
}
