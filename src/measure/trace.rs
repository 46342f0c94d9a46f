//! Frames as a Chrome trace, for Perfetto and `chrome://tracing`: one slice per frame, and one per pass inside it.

use crate::vk::ZoneTimings;
use serde_json::{Value, json};

/// The process and thread of all slices: one track.
const TRACK: u32 = 1;

/// The trace of consecutive frames on `device`. Times are microseconds of device time; each frame starts after the
/// wall-clock time of the previous frame.
pub fn chrome_trace<'a>(device: &str, frames: impl IntoIterator<Item = &'a ZoneTimings>) -> Value {
    let mut events = vec![
        json!({ "ph": "M", "name": "process_name", "pid": TRACK, "args": { "name": "twobounce" } }),
        json!({ "ph": "M", "name": "thread_name", "pid": TRACK, "tid": TRACK, "args": { "name": device } }),
    ];
    let mut start_ms = 0.0;
    for (index, frame) in frames.into_iter().enumerate() {
        events.push(slice(&format!("frame {index}"), "frame", [start_ms, frame.gpu_ms], json!({})));
        for zone in &frame.zones {
            let details = json!({ "bytes": zone.bytes, "cpu_ms": zone.cpu_ms, "wall_ms": zone.wall_ms });
            let kind = format!("{:?}", zone.kind).to_lowercase();
            events.push(slice(zone.name, &kind, [start_ms + zone.start_ms, zone.gpu_ms], details));
        }
        // The next frame starts after the wait for this one. By rounding, device time may exceed wall-clock time.
        start_ms += frame.wall_ms.max(frame.gpu_ms);
    }
    json!({ "displayTimeUnit": "ms", "traceEvents": events })
}

/// A complete event, with its start and length.
fn slice(name: &str, category: &str, [start_ms, length_ms]: [f64; 2], details: Value) -> Value {
    let (start_us, length_us) = (start_ms * 1e3, length_ms * 1e3);
    json!({ "ph": "X", "name": name, "cat": category, "pid": TRACK, "tid": TRACK, "ts": start_us, "dur": length_us, "args": details })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vk::{ZoneKind, ZoneTiming};

    #[test]
    fn passes_nest_in_their_frames_which_follow_each_other() {
        let kind = ZoneKind::Compute;
        let zone =
            |name, start_ms, gpu_ms| ZoneTiming { name, kind, start_ms, gpu_ms, bytes: 64, ..ZoneTiming::default() };
        let frame = ZoneTimings { zones: vec![zone("a", 0.0, 1.0), zone("b", 1.0, 2.0)], gpu_ms: 3.0, wall_ms: 4.0 };
        let trace = chrome_trace("a device", [&frame, &frame]);
        let slices = &trace["traceEvents"].as_array().unwrap()[2..];
        let of = |event: &Value| {
            let [start, length] = ["ts", "dur"].map(|key| event[key].as_f64().unwrap());
            (event["name"].as_str().unwrap().to_owned(), start, start + length)
        };
        let slice = |name: &str, start, end| (name.to_owned(), start, end);
        let first = [slice("frame 0", 0.0, 3000.0), slice("a", 0.0, 1000.0), slice("b", 1000.0, 3000.0)];
        let second = [slice("frame 1", 4000.0, 7000.0), slice("a", 4000.0, 5000.0), slice("b", 5000.0, 7000.0)];
        assert_eq!(slices.iter().map(of).collect::<Vec<_>>(), [first, second].concat(), "microseconds");
        assert_eq!(slices[1]["cat"], "compute");
        assert_eq!(slices[1]["args"]["bytes"], 64);
    }
}
